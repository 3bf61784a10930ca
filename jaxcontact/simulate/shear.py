"""Shear: normal and tangential load together, with friction, over a history.

The public function ``shear``, and ``Shearing``, its checked arguments and the plan of its march. The step in time, with the
work of friction, is ``history.friction_step``, and Coulomb's law is solved in ``contact.friction``.
"""

from __future__ import annotations

from typing import Any, Self

import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.pytree import as_float64, pytree, replace, static
from jaxcontact.bodies.body import LayeredHalfSpace, check_bonded
from jaxcontact.bodies.controls import (
    Control,
    TangentialControl,
    TangentialLoad,
    check_friction,
    check_tangential,
)
from jaxcontact.bodies.grid import Grid, check_free_along_x
from jaxcontact.bodies.laws import Adhesion
from jaxcontact.history.friction_step import ShearStepper
from jaxcontact.history.memory import TractionMemory, with_indenter
from jaxcontact.history.time_loop import fine_values
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.operators.kernels import TractionKernels, build_traction
from jaxcontact.results.contact import ShearHistory, ShearStep
from jaxcontact.results.notes import announce
from jaxcontact.simulate.run import Experiment, Plan, Save, marched, refined


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
    substeps: int | str = 1,
    checkpoint: str = "pressures",
    adhesion: Adhesion | None = None,
    shear_strength: Array | float | None = None,
) -> ShearHistory:
    """Compute partial slip over time: an indenter under normal and tangential control, with Coulomb friction.

        |q| <= mu p,      slip = 0 where |q| < mu p,      slip = -k q, k >= 0, where |q| = mu p

    These equations for the tangential traction q on the body, and the slip of its surface over the indenter from one step
    to the next, hold in addition to those of ``indent``. Tangential displacements are taken as small, so that opposite
    cells of body and indenter stay the same. Pressure and traction are solved in turn until both are satisfied
    (``contact.friction``). With ``coupled``, tractions cause normal displacements and the pressure causes tangential
    displacements; these vanish only if the two solids are elastically similar. The result depends on the order of
    loading: loads that increase simultaneously need several steps (``substeps``), while a tangential load that is applied
    after the normal one may be applied in a single step (R. D. Mindlin, H. Deresiewicz, J. Appl. Mech. 20 (1953) 327).
    With adhesion the bound mu p is replaced by mu p_c + tau where the surfaces touch, with the pressure p_c that contact
    carries and the shear strength tau.

    The fields of the result are differentiable with respect to all numbers, including the coefficient of friction; the
    derivatives are those at constant areas of stick, slip and separation. Differentiate a field and not the whole
    result, which contains integers.

    Args:
        body, indenter, times, grid: as in ``indent``; a grid that is periodic along both axes is rejected. In plane
            strain, tangential displacements are also measured from the surface at a distance of one width of the grid. Those
            of an indenter that creeps or is coated have a memory of their own.
        control: ``Load`` or ``Approach``, as in ``indent``.
        tangential: ``TangentialLoad`` [N] or ``TangentialDisplacement`` [m] of the indenter, (2,) or (nt, 2). It is applied
            as a step at times[0] together with the control, and is linear between the times.
        friction: coefficient of friction mu >= 0, a number or (nx, ny).
        coupled: whether the coupling of normal and tangential problem is included, static. Without it each problem is
            solved once in a step.
        tolerance, max_iterations: as in ``indent``, for both problems; the limit applies to all outer iterations of a
            step together.
        save: as in ``indent``; the argument of a function has also ``.traction`` (2, nx, ny) [Pa], ``.slip`` [m],
            ``.stick``, ``.tangential_load`` [N] and others (``results.contact.ShearStep``).
        substeps, checkpoint: as in ``indent``.
        adhesion: as in ``indent``; the control may then be negative. p_c is the net pressure plus the attraction
            (``contact_pressure`` of the result). It needs coupled=False: the traction does not change the pressure, as
            between similar solids, or an incompressible and a rigid one.
        shear_strength: tau, with adhesion alone: a shear stress [Pa] >= 0, a number or (nx, ny), which the contact holds
            beside mu p_c wherever it touches; None for zero. Cells that touch count whole, so that tau times their area has
            an error of up to some percent on coarse grids (page *Limitations*), and no derivative by what moves the edge.

    Returns:
        A ``ShearHistory``, with adhesion with ``contact_pressure``, ``jumps`` and others. Failures are reported in
        ``status`` and ``converged``; warnings are as in ``indent``.

    Raises:
        ValueError: invalid or unsupported input, before the computation starts.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> grid, ball = jc.Grid.square(n=32, width=300e-6), jc.Sphere(5e-3)
        >>> push = jc.TangentialLoad([[0.0, 0.0], [3.0, 0.0]])
        >>> history = jc.shear(glass, ball, jc.Load(20.0), push, [0.0, 1.0], friction=0.3, grid=grid, coupled=False)
        >>> sticking, touching = np.sum(history.stick[-1]), np.sum(history.pressure[-1] > 0)
        >>> f"{np.sqrt(sticking/touching):.2f} of the contact radius sticks"   # Mindlin: (1 - 0.5)^(1/3)
        '0.79 of the contact radius sticks'
    """
    make = lambda count: Shearing.of(
        body, indenter, control, times, grid, substeps=count, tolerance=tolerance, max_iterations=max_iterations, save=save,
        checkpoint=checkpoint, tangential=tangential, friction=friction, coupled=coupled, adhesion=adhesion,
        shear_strength=shear_strength,
    )  # fmt: skip
    history: ShearHistory = refined(marched, make, substeps)
    announce(history, stacklevel=2)
    return history


@pytree
class Shearing(Experiment):
    """Pressing and shearing; tangential, friction and coupled: as given to ``shear``."""

    tangential: TangentialControl
    friction: Array
    coupled: bool = static()

    @classmethod
    def of(  # type: ignore[override]
        cls,
        *contact: Any,
        tangential: TangentialControl,
        friction: Any,
        coupled: bool = True,
        **given: Any,
    ) -> Self:
        """Check the arguments of ``shear``; contact and given: the arguments of ``Experiment.of``."""
        experiment = Experiment.of(*contact, **given)
        checks.require(
            experiment.adhesion is None or not coupled,
            "coupled: expected False with adhesion, got True: the traction is computed without its effect on the pressure",
        )

        # What a tangential force needs: a grid with sides, layers that cannot move freely, a control and friction.
        check_free_along_x(experiment.grid, "shear")
        for each in experiment.surfaces:
            check_bonded(each, "shear")
        valid = check_tangential(tangential, experiment.times.size)
        experiment = experiment.also(valid & check_friction(friction, experiment.grid.shape))
        own = as_float64({"tangential": tangential, "friction": friction})
        return cls(**vars(experiment), **own, coupled=bool(coupled))

    def with_kernels(self) -> Self:
        """Return the experiment with the kernels of tractions."""
        kernels = build_traction(self.body, self.indenter, self.grid, coupled=self.coupled)
        return replace(self, kernels=kernels)

    @property
    def work(self) -> float:
        return 40.0 * super().work  # the searches for the traction

    def planned(self) -> Plan:
        """Return the march: the memory of pressure and traction, and the tangential control at the inner steps."""
        kernels: TractionKernels = self.kernels
        scale = kernels.normal.scale

        # With adhesion the shear strength at each cell.
        strength = None
        if self.adhesion is not None:
            strength = 0.0 if self.shear_strength is None else self.shear_strength
            strength = scale.from_si("pressure", jnp.broadcast_to(strength, self.grid.shape))

        load_given = isinstance(self.tangential, TangentialLoad)
        stepper = ShearStepper(
            memory=with_indenter(TractionMemory(kernels), kernels),
            coefficient=jnp.broadcast_to(self.friction, self.grid.shape),
            tangential_load_controlled=load_given,
            coupled=self.coupled,
            strength=strength,
            **self.stepper_arguments(scale),
        )

        # The tangential control at the inner steps, (nt, substeps, 2).
        name = "tangential_load" if load_given else "tangential_displacement"
        at_times = jnp.broadcast_to(scale.from_si(name, self.tangential.value), (self.times.size, 2))
        targets = jnp.stack([fine_values(at_times[:, axis], self.substeps) for axis in (0, 1)], -1)
        steps, errors = self.steps(scale, targets), kernels.errors(self.duration)
        time_fields, fixed_fields = {"times": self.times} | self.tabor_number, {"grid": self.grid}
        return Plan(stepper, steps, scale, errors, time_fields, fixed_fields, ShearHistory, ShearStep)
