"""Sliding in time: an indenter that moves over the body, in any direction and at any speed."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support.pytree import as_float64
from jaxcontact._support.status import Status
from jaxcontact.history.moving import Motion, Shift, moving_memory
from jaxcontact.history.observables import SlidingStep
from jaxcontact.history.track import (
    FARTHEST,
    as_array,
    check_rubbing,
    checked_track,
    directions,
    over_times,
    shifts,
)
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.controls import Control
from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.operators.kernels import Errors, Kernels
from jaxcontact.operators.rubbing import rub
from jaxcontact.results.sliding import SlidingHistory, with_totals
from jaxcontact.verbs.experiment import Experiment, Plan, Save, fine_steps, reported

DROPPED_LIMIT = 0.01  # of the largest approach


def slide(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    times: Array,
    *,
    velocity: Array | float,
    grid: Grid,
    tolerance: Array | float = 1e-8,
    max_iterations: Array | int = 500,
    save: Save = "all",
    substeps: int = 1,
    kernels: Kernels | None = None,
    checkpoint: str = "pressures",
    friction: Array | float | None = None,
) -> SlidingHistory:
    """Press an indenter on a body, move it over the body and follow the contact in time.

        u(x, t) = int_0^t K(x + X(t) - X(s), t - s) * dp(x, s),   g = profile + u - approach >= 0,  p >= 0,  p g = 0

    in the frame of the indenter, whose place over the body is X(t) = int velocity dt.

    An inner step may move up to half the grid's width: take more ``substeps`` beyond. Steady pressure is moved
    without error at any step; otherwise the error is of second order in the step, which should stay well below
    a contact's radius while the pressure changes (one of 0.45 widths is off by a tenth at first).

    What the indenter leaves behind on the grid is remembered, also when it comes back: the grid must be
    twice as wide as the stroke and the contact's radius together. What leaves the grid is dropped, and
    ``dropped`` of the result bounds what it would still do: nothing for a film (doubling the grid changes the
    peak by 1e-5), but 4 % of peak and approach for a half-space of Table 4's material after 4 h at 0.4 um/s on
    5 mm. A track that leaves the grid and comes back is refused; one that brings the contact back to what was
    dropped has status 5.

    With friction the traction mu p, along the velocity on the body, sinks the surface too and moves the pressure; see
    ``slide_steady``.

    On a grid that is periodic along both axes nothing leaves: a step may be of any length, and the indenter comes upon
    the tracks of others like it. In plane strain the velocity is one number.

    Args:
        velocity: of the indenter over the body [m/s]: a number (along x), (2,) for (vx, vy), or (nt, 2) over
            times, linear between them; +x has its leading edge, and the higher pressure, on the +x side. It
            steps on with the load at times[0].
        friction: as in ``slide_steady``, along the velocity at the end of each inner step.
        body, indenter, control, times, grid, tolerance, max_iterations, save, substeps, kernels, checkpoint: as
            in ``indent``. There is no ``correspondence``: the quasi-elastic way has no common rates, without
            which history cannot be moved.

    Returns:
        A ``SlidingHistory``, warnings as in ``indent``.

    Raises:
        ValueError: what cannot be computed, before anything is.

    Example:
        >>> rubber = jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=1e6, G2=1e6, eta2=1e6, nu=0.5))
        >>> grid, times = jc.Grid.square(n=24, width=4e-3), [0.0, 1.0, 2.0]
        >>> history = jc.slide(rubber, jc.Sphere(5e-3), jc.Load(0.1), times, velocity=5e-4, grid=grid)
        >>> bool(history.tangential_force[-1] > 0.0)             # it resists
        True
    """
    experiment = Experiment.of(
        body, indenter, control, times, grid=grid, tolerance=tolerance, max_iterations=max_iterations,
        kernels=kernels, save=save, substeps=substeps, checkpoint=checkpoint,
    )  # fmt: skip
    velocity = as_array(velocity)
    experiment = experiment.also(checked_track(velocity, times, grid, substeps)).also(
        check_rubbing(friction, grid)
    )
    result, errors = _run(experiment.with_kernels(), as_float64(velocity), as_float64(friction))
    return reported(result, errors, experiment)


@Program
def _run(experiment: Experiment, velocity: Array, friction: Array | None) -> tuple[SlidingHistory, Errors]:
    """The compiled core: one trace for equal shapes and options."""
    plan = planned(experiment, velocity, friction)
    outcomes, last = plan.march(experiment.options)
    history = plan.history(experiment.grid, experiment.times, outcomes, last)
    motion, slid = plan.steps.memory, outcomes.more
    status = with_far_steps(history["status"], motion.shift, experiment.grid)
    status = with_returns(status, slid, jnp.max(jnp.abs(outcomes.approach)))
    in_si = plan.scale.to_si(
        coulomb_force=slid.coulomb,
        lateral_force=slid.force,
        hysteresis_force=slid.hysteresis,
        pressure_centre=slid.centre,
        leading_peak=slid.leading_peak,
        hysteresis_power=slid.dissipated,
        stored_energy=slid.stored,
        dropped=slid.dropped,
    )
    moving = over_times(velocity, experiment.times)
    rubs = jnp.zeros(()) if friction is None else friction
    own = {"status": status, "velocity": moving, "friction": jnp.broadcast_to(rubs, experiment.grid.shape)}
    return SlidingHistory(**history | own | with_totals(in_si, moving)), plan.errors


def planned(experiment: Experiment, velocity: Array, friction: Array | None) -> Plan:
    """The march of a slide."""
    kernels, times, grid = experiment.ready_kernels, experiment.times, experiment.grid
    scale, substeps = kernels.scale, experiment.options.substeps
    shift = shifts(velocity / scale.length, times, substeps)
    motion = Motion(fine_steps(times, substeps), shift, directions(velocity, times, substeps))
    profile = experiment.indenter.profile(grid) / scale.length
    rubbing = None
    if friction is not None:
        rubbing = rub(experiment.body, experiment.indenter, grid, scale, friction)
    memory = moving_memory(kernels, profile, grid.spacing[1] / grid.spacing[0], rubbing)
    return experiment.plan(memory, motion, scale, kernels.errors(experiment.duration))


def with_far_steps(status: Array, shift: Shift, grid: Grid) -> Array:
    """The status, with the steps marked that moved farther than the scheme can bear: none on a periodic grid."""
    if all(grid.periodic):
        return status
    nx, ny = grid.shape
    far = jnp.abs(shift.x) > FARTHEST * nx * (1.0 + 1e-9)
    if shift.y is not None:
        far = far | (jnp.abs(shift.y) > FARTHEST * ny * (1.0 + 1e-9) * grid.spacing[1] / grid.spacing[0])
    far = jnp.cumsum(jnp.any(far, 1)) > 0
    return jnp.where(far & (status != Status.NOT_CONVERGED), int(Status.MOVED_TOO_FAR), status)


def with_returns(status: Array, slid: SlidingStep, depth: Array) -> Array:
    """Return the status with the rows marked in which dropped history under the contact would show, and those after.

    An inner step of a row counts: it is in the running maximum ``returned``.
    """
    limit, earlier = DROPPED_LIMIT * depth, jnp.append(0.0, slid.returned[:-1])
    back = (slid.overlaps & (slid.dropped > limit)) | ((slid.returned > limit) & (slid.returned > earlier))
    status = jnp.where(back & (status == Status.FINE), int(Status.CAME_BACK), status)
    after = (earlier > limit) & (status == Status.FINE)
    return jnp.where(after, int(Status.INHERITED), status)
