"""Sliding in time: an indenter that moves over the body, in any direction and at any speed."""

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._pytree import as_float64, replace
from jaxcontact.controls import Control, Load
from jaxcontact.geometry import Indenter
from jaxcontact.grid import Grid
from jaxcontact.history import march as marching
from jaxcontact.indentation import check_inputs, check_kernels, fine_times, fine_values, to_si, warn
from jaxcontact.kernels import Kernels, build
from jaxcontact.layers import LayeredHalfSpace, checked_body
from jaxcontact.results import CAME_BACK, MOVED_TOO_FAR
from jaxcontact.sliding.observables import Observed
from jaxcontact.sliding.results import SlidingHistory
from jaxcontact.sliding.track import FARTHEST, as_array, check_velocity, directions, over_times, shifts
from jaxcontact.sliding.transport import Motion, Shift, moving_memory

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
    save: str | Callable[[Any], Any] = "all",
    substeps: int = 1,
    kernels: Kernels | None = None,
) -> SlidingHistory:
    """Press an indenter on a body, move it over the body and follow the contact in time.

        u(x, t) = int_0^t K(x + X(t) - X(s), t - s) * dp(x, s),   g = profile + u - approach >= 0,  p >= 0,  p g = 0

    in the frame of the indenter, whose place over the body is X(t) = int velocity dt. velocity [m/s]: a number
    (along x), (2,) for (vx, vy), or (nt, 2) over times, linear between them; +x has its leading edge, and
    the higher pressure, on the +x side. It steps on with the load at times[0].

    The other arguments are those of ``indent``. An inner step may move up to half the grid's width: take
    more ``substeps`` beyond. Steady pressure is moved without error at any step; otherwise the error is
    of second order in the step, which should stay well below a contact's radius while the pressure changes
    (one of 0.45 widths is off by a tenth at first).

    What the indenter leaves behind on the grid is remembered, also when it comes back: the grid must be
    twice as wide as the stroke and the contact's radius together. What leaves the grid is dropped, and ``dropped``
    of the result bounds what it would still do: nothing for a film (doubling the grid changes the peak by 1e-5),
    but 4 % of peak and approach for a half-space of Table 4's material after 4 h at 0.4 um/s on 5 mm. A
    track that leaves the grid and comes back is refused; one that brings the contact back to what was dropped
    has status 5.

    Returns a ``SlidingHistory``. Raises ValueError for what cannot be computed.
    """
    body, velocity = checked_body(body), as_array(velocity)
    check_inputs(body, indenter, control, times, grid, save, substeps, "exact")
    check_velocity(velocity, times, grid, substeps)
    if kernels is not None:
        check_kernels(kernels, grid, "exact")
    result, separation = _run(
        *as_float64((body, indenter, control, times, velocity, grid, tolerance)),
        jnp.asarray(max_iterations),
        kernels,
        save=save,
        substeps=substeps,
    )
    warn(result, separation)
    return result


@functools.partial(jax.jit, static_argnames=("save", "substeps"))
def _run(
    body, indenter, control, times, velocity, grid, tolerance, max_iterations, kernels, *, save, substeps
):
    """The compiled core: one trace for equal shapes and flags."""
    setup, steps, units, separation = prepare(
        body, indenter, control, times, velocity, grid, tolerance, max_iterations, kernels, substeps
    )
    outcomes, last = marching.march_from_rest(setup, steps, save)
    contact = to_si(times, grid, setup, units, outcomes, last, save)
    status = with_far_steps(contact.status, steps.memory.shift, grid)
    status = with_returns(status, outcomes.observed, jnp.max(jnp.abs(outcomes.approach)))
    return _sliding(
        replace(contact, status=status), velocity, steps.memory, units, outcomes.observed, grid
    ), separation


def prepare(body, indenter, control, times, velocity, grid, tolerance, max_iterations, kernels, substeps):
    """Everything the march needs: its setup, its steps, the units, and the error of shared rates."""
    kernels = build(body, indenter, grid) if kernels is None else kernels
    units = kernels.units
    _, dt = fine_times(times, substeps)
    shift = shifts(velocity / units.length, times, substeps)
    motion = Motion(dt, shift, directions(velocity, times, substeps))
    load_controlled = isinstance(control, Load)
    scale = units.compliance / grid.cell_area if load_controlled else 1.0 / units.length
    profile = indenter.profile(grid) / units.length
    memory = moving_memory(kernels, profile, grid.spacing[1] / grid.spacing[0])
    setup = marching.Setup(memory, profile, tolerance, max_iterations, load_controlled)
    steps = marching.Steps(dt, fine_values(control.value * scale, times, substeps), motion)
    return setup, steps, units, kernels.separation_error


def _sliding(contact, velocity, motion, units, observed, grid) -> SlidingHistory:
    """The contact with what is particular to sliding, in the user's units."""
    force = grid.cell_area / units.compliance
    energy = force * units.length
    return SlidingHistory(
        **vars(contact),
        velocity=over_times(velocity, contact.times),
        lateral_force=observed.force * force,
        tangential_force=-jnp.sum(observed.force * motion.direction[:, -1], -1) * force,
        pressure_centre=observed.centre * units.length,
        leading_peak=observed.leading_peak / units.compliance,
        power=observed.dissipated * energy,
        stored_energy=observed.stored * energy,
        dropped=observed.dropped * units.length,
    )


def with_far_steps(status: Array, shift: Shift, grid: Grid) -> Array:
    """The status, with the steps marked that moved farther than the scheme can bear."""
    nx, ny = grid.shape
    far = jnp.abs(shift.x) > FARTHEST * nx * (1.0 + 1e-9)
    if shift.y is not None:
        far = far | (jnp.abs(shift.y) > FARTHEST * ny * (1.0 + 1e-9) * grid.spacing[1] / grid.spacing[0])
    far = jnp.cumsum(jnp.any(far, 1)) > 0
    return jnp.where(far & (status != marching.NOT_CONVERGED), MOVED_TOO_FAR, status)


def with_returns(status: Array, observed: Observed, depth: Array) -> Array:
    """The status, with the steps marked in which dropped history under the contact would show."""
    back = observed.overlaps & (observed.dropped > DROPPED_LIMIT * depth)
    return jnp.where(back & (status == 0), CAME_BACK, status)
