"""Shear: normal and tangential load together, with friction, over a history."""

from __future__ import annotations

from typing import Any, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.pytree import as_float64, pytree, static
from jaxcontact._support.scale import Scale
from jaxcontact.history.shear_march import ShearStepper
from jaxcontact.history.tractions import TractionMemory
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.controls import (
    Control,
    TangentialControl,
    TangentialLoad,
    check_friction,
    check_tangential,
)
from jaxcontact.inputs.grid import Grid, check_free_along_x
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.operators.traction_kernels import build_traction
from jaxcontact.results.friction import ShearHistory, ShearStep
from jaxcontact.results.notes import announce
from jaxcontact.verbs.experiment import Experiment, Plan, Save, TimedExperiment, fine_values, marched


def shear(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    tangential: TangentialControl,
    times: Array,
    *,
    friction: Array | float,
    grid: Grid,
    coupled: bool = True,
    tolerance: Array | float = 1e-8,
    max_iterations: Array | int = 2000,
    save: Save = "all",
    substeps: int = 1,
    checkpoint: str = "pressures",
) -> ShearHistory:
    """Press an indenter on a body and move it sideways, with Coulomb friction: partial slip in time.

        |q| <= mu p,      slip = 0 where |q| < mu p,      slip = -k q, k >= 0, where |q| = mu p

    Beside the law of contact of ``indent``, for the tangential tractions q on the body and the slip of its surface over
    the indenter from one step to the next. Tangential displacements are small: body and indenter keep their cells.
    Pressure and traction are solved in turns (``contact.partial_slip``): with ``coupled`` the shear moves the pressure
    and the pressure draws the surface sideways, as they do unless the two solids are elastically similar. The order of
    events counts: what rises together must rise in steps (``substeps``), while a tangential load put on after the normal
    one may come in a single step (R. D. Mindlin, H. Deresiewicz, J. Appl. Mech. 20 (1953) 327).

    All numbers are differentiable, also the coefficient of friction, with the sets of stick, slip and separation held:
    differentiate a field of the result, not the whole (it has integers).

    Args:
        body, indenter, times, grid: as in ``indent``; a grid that is periodic along both axes is refused. In plane
            strain tangential displacement, too, is that from one width of the grid away (``grid``).
        control: ``Load`` or ``Approach``, as in ``indent``.
        tangential: ``TangentialLoad`` [N] or ``TangentialDisplacement`` [m] of the indenter: (2,) or (nt, 2), which
            steps on at times[0] together with the control and is linear between times.
        friction: coefficient of friction mu >= 0, a number or (nx, ny).
        coupled: whether normal and tangential problem feel each other, static; without, each step is solved once.
        tolerance, max_iterations: as in ``indent``, of both problems; iterations of all rounds of a step.
        save: as in ``indent``; a function is given one step (``.traction`` (2, nx, ny) [Pa], ``.slip`` [m], ``.stick``,
            ``.tangential_load`` [N], ...: ``results.friction.ShearStep``).
        substeps, checkpoint: as in ``indent``.

    Returns:
        A ``ShearHistory``. Failure is data: ``status`` and ``converged``; warnings as in ``indent``.

    Raises:
        ValueError: what cannot be computed, before anything is.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> grid, ball = jc.Grid.square(n=32, width=300e-6), jc.Sphere(5e-3)
        >>> push = jc.TangentialLoad([[0.0, 0.0], [3.0, 0.0]])
        >>> history = jc.shear(glass, ball, jc.Load(20.0), push, [0.0, 1.0], friction=0.3, grid=grid, coupled=False)
        >>> sticking, touching = np.sum(history.stick[-1]), np.sum(history.pressure[-1] > 0)
        >>> f"{np.sqrt(sticking/touching):.2f} of the contact radius sticks"   # Mindlin: (1 - 0.5)^(1/3)
        '0.79 of the contact radius sticks'
    """
    shearing = Shearing.of(
        body, indenter, control, times, tangential=tangential, friction=friction, coupled=coupled, grid=grid,
        tolerance=tolerance, max_iterations=max_iterations, save=save, substeps=substeps, checkpoint=checkpoint,
    )  # fmt: skip
    history = marched(shearing)
    announce(history, stacklevel=2)
    return history


@pytree
class Shearing(TimedExperiment):
    """Pressing and shearing; tangential, friction and coupled: as given to ``shear``."""

    tangential: TangentialControl
    friction: Array
    coupled: bool = static()

    @classmethod
    def of(  # type: ignore[override]
        cls,
        body: LayeredHalfSpace,
        indenter: Indenter,
        control: Control,
        times: Any,
        *,
        tangential: TangentialControl,
        friction: Any,
        coupled: bool = True,
        max_iterations: Any = 2000,
        **options: Any,
    ) -> Self:
        experiment = Experiment.of(body, indenter, control, times, max_iterations=max_iterations, **options)
        check_free_along_x(experiment.grid, "shear")
        valid = check_tangential(tangential, np.shape(times)[0])
        experiment = experiment.also(valid & check_friction(friction, experiment.grid.shape))
        tangential, friction = as_float64((tangential, friction))
        return cls(**vars(experiment), tangential=tangential, friction=friction, coupled=bool(coupled))

    def with_kernels(self) -> Self:
        """The kernels are those of tractions, which the march builds."""
        return self

    def planned(self) -> Plan:
        """Return the march, kernels included."""
        kernels = build_traction(self.body, self.indenter, self.grid, coupled=self.coupled)
        scale = kernels.normal.scale
        stepper = ShearStepper(
            memory=TractionMemory(kernels),
            coefficient=jnp.broadcast_to(self.friction, self.grid.shape),
            tangential_load_controlled=isinstance(self.tangential, TangentialLoad),
            coupled=self.coupled,
            **self.contact(scale),
        )
        errors = kernels.errors(self.duration)
        return self.plan(stepper, self._targets(scale), scale, errors, makes=ShearHistory, step=ShearStep)

    def _targets(self, scale: Scale) -> Array:
        """Return the tangential control at the ends of the inner steps, scaled, (nt, substeps, 2)."""
        forced = isinstance(self.tangential, TangentialLoad)
        name = "tangential_load" if forced else "tangential_displacement"
        wanted = jnp.broadcast_to(scale.from_si(name, self.tangential.value), (self.times.size, 2))
        return jnp.stack([fine_values(wanted[:, axis], self.options.substeps) for axis in (0, 1)], -1)
