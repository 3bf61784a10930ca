"""Shear: normal and tangential load together, with friction, over a history."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support import checks
from jaxcontact._support.pytree import as_float64
from jaxcontact._support.scale import Scale
from jaxcontact.history.shear_march import ShearSetup, ShearStep, march
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
from jaxcontact.operators.kernels import Errors
from jaxcontact.operators.traction_kernels import TractionKernels, build_traction
from jaxcontact.results.friction import ShearHistory
from jaxcontact.verbs.experiment import Experiment, fine_steps, fine_values, reported


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
    save: str = "all",
    substeps: int = 1,
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
        save: "all" keeps the fields of all times, "last" those of the last.
        substeps: inner steps between two times, static.

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
    experiment = Experiment.of(
        body, indenter, control, times, grid=grid, tolerance=tolerance, max_iterations=max_iterations,
        save=save, substeps=substeps,
    )  # fmt: skip
    checks.one_of("save", save, "all", "last")
    check_free_along_x(grid, "shear")
    valid = check_tangential(tangential, np.shape(times)[0]) & check_friction(friction, grid.shape)
    given = as_float64((tangential, friction))
    experiment = experiment.also(valid)
    result, errors = _run(experiment, *given, coupled=bool(coupled))
    return reported(result, errors, experiment)


def _compiled(
    experiment: Experiment, tangential: TangentialControl, friction: Array, *, coupled: bool
) -> tuple[ShearHistory, Errors]:
    """The compiled core: one trace for equal shapes and options."""
    kernels = build_traction(experiment.body, experiment.indenter, experiment.grid, coupled=coupled)
    scale = kernels.normal.scale
    setup = _setup(experiment, kernels, tangential, friction, coupled)
    steps = _steps(experiment, tangential, scale)
    outcomes, last, carry = march(setup, steps, all_fields=experiment.options.save == "all")
    fields = outcomes.fields or last
    whole = {"profile": setup.profile, "friction_work": carry.work}
    in_si = scale.to_si(**whole, **fields, **outcomes.numbers)
    history = ShearHistory(times=experiment.times, grid=experiment.grid, saved=None, **in_si)
    return history, kernels.normal.errors(experiment.duration)


_run = Program(_compiled, ("coupled",))


def _setup(
    experiment: Experiment,
    kernels: TractionKernels,
    tangential: TangentialControl,
    friction: Array,
    coupled: bool,
) -> ShearSetup:
    profile = experiment.indenter.profile(experiment.grid) / kernels.normal.scale.length
    return ShearSetup(
        memory=TractionMemory(kernels),
        profile=profile,
        coefficient=jnp.broadcast_to(friction, profile.shape),
        tolerance=experiment.tolerance,
        max_iterations=experiment.max_iterations,
        load_controlled=experiment.load_controlled,
        tangential_load_controlled=isinstance(tangential, TangentialLoad),
        coupled=coupled,
        edges=experiment.edges,
    )


def _steps(experiment: Experiment, tangential: TangentialControl, scale: Scale) -> ShearStep:
    """The inner steps, (nt, substeps, ...), scaled."""
    times, substeps = experiment.times, experiment.options.substeps
    name = "tangential_load" if isinstance(tangential, TangentialLoad) else "tangential_displacement"
    wanted = jnp.broadcast_to(scale.from_si(name, tangential.value), (times.size, 2))
    fine = lambda values: fine_values(values, substeps)
    targets = fine(jnp.broadcast_to(experiment.target(scale), times.shape))
    return ShearStep(
        fine_steps(times, substeps), targets, jnp.stack([fine(wanted[:, 0]), fine(wanted[:, 1])], -1)
    )
