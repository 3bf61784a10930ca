"""The displacement of a surface under a pressure that is given, at rest or in motion.

The displacement is that of ``slide`` under the pressures of a contact: with the fields eta_k of ``history.memory`` in the
frame of the load, which moves over the body with the velocity v,

    u = C_0 * p + sum_k lambda_k C_k * eta_k,      d eta_k/dt - v . grad eta_k = p - lambda_k eta_k.
"""

from __future__ import annotations

import functools
import warnings
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.programs import Program
from jaxcontact._support import checks
from jaxcontact._support.pytree import as_float64, is_concrete, untupled
from jaxcontact._support.status import LARGEST_ERROR, Status, most_serious
from jaxcontact.bodies.body import LayeredHalfSpace, checked_body
from jaxcontact.bodies.grid import Grid, check_grid
from jaxcontact.history.memory import Motion, moving_memory
from jaxcontact.history.motion import FARTHEST, as_array, checked_track, directions, moves, ways
from jaxcontact.history.time_loop import fine_steps, fine_values
from jaxcontact.indenters.shapes import Sphere
from jaxcontact.operators.kernels import Kernels, build, check_stiffness
from jaxcontact.operators.operator import Operator
from jaxcontact.response.stack import has_zero_instantaneous_compliance, top_layer
from jaxcontact.results.contact import Deflection

RIGID = Sphere(1.0)  # what presses has no compliance of its own
MOST_SUBSTEPS = 1000
OFF_THE_WAY = 0.1  # cells by which an inner step may be off the way of a velocity that changes


def deflection(
    body: LayeredHalfSpace,
    grid: Grid,
    pressure: Any,
    times: Any,
    *,
    velocity: Any = 0.0,
    substeps: int | None = None,
) -> Deflection:
    """Compute the displacement of the surface under a pressure that is given and may move, such as a wheel's on a road.

    The pressure is applied as a step at the first time, and is linear between the times in the frame of the load, which
    moves over the body with the velocity. In this frame the displacement is exact in time for such a pressure and a
    constant velocity; the point X of the body is at x = X - integral of v dt. What of the track leaves the grid is
    neglected, and ``truncation_bound`` is a bound on its displacement under the pressure: the grid must hold the load and
    the part of the track that matters. On a grid that is periodic along both axes displacement is relative to the mean,
    unless the base is rigid.

    The result is differentiable with respect to all numbers. ``subsurface`` has the stresses, for a pressure that moves from
    its history in the frame of the body, p(x - v t), at times between which it moves by less than a cell or two.

    Args:
        body: a ``LayeredHalfSpace``.
        grid: a ``Grid``, which moves with the load.
        pressure: (nx, ny) [Pa] at all times, or (nt, nx, ny), positive in compression.
        times: (nt,) [s], not decreasing.
        velocity: of the load over the body [m/s]: a number along x, (2,) or (nt, 2).
        substeps: inner steps between two times, static, each of a constant velocity; None: as many as the motion needs, each
            of at most half the width of the grid and within a tenth of a cell of the way of a velocity that changes (1 where
            the values are traced).

    Returns:
        ``Deflection``; nan where a value traced by jit or vmap is outside its range.

    Raises:
        ValueError: invalid or unsupported input, or a track that returns to where its history has left the grid.

    Example:
        >>> soil = jc.LayeredHalfSpace([], substrate=jc.Elastic.from_young(50e6, nu=0.35))
        >>> grid = jc.Grid.square(n=33, width=1.65)
        >>> x, y = grid.coordinates()
        >>> tyre = np.where(x**2 + y**2 < 0.15**2, 0.7e6, 0.0)
        >>> under = jc.deflection(soil, grid, tyre, [0.0, 0.05], velocity=15.0)
        >>> f"{under.displacement[-1].max() * 1e3:.1f} mm"  # 2 (1 - nu^2) p a/E of a disc of the same area: 3.5 mm
        '3.4 mm'
    """
    body, valid = checked_body(body)
    times, velocity = untupled(times), as_array(velocity)
    valid = valid & check_grid(grid) & checks.not_decreasing("times [s]", times) & check_stiffness(body)
    count, shape = np.shape(times)[0], np.shape(pressure)
    checks.require(
        shape in (tuple(grid.shape), (count, *grid.shape)),
        f"pressure: expected shape {tuple(grid.shape)} as the grid or {(count, *grid.shape)} as times, got {shape}",
    )
    valid = valid & checks.finite("pressure [Pa]", pressure)
    rigid = top_layer(body) is not None and has_zero_instantaneous_compliance(body)
    if is_concrete(rigid):
        checks.require(
            not bool(rigid),
            "layer: a material with J(0) = 0 has no bound on its decay rates over a substrate; expected one with an"
            " instantaneous compliance in deflection",
        )
    else:
        valid = valid & ~jnp.asarray(rigid)
    if substeps is None:
        substeps = _least_substeps(velocity, times, grid)
    checks.whole("substeps", substeps, 1, MOST_SUBSTEPS)
    valid = valid & checked_track(velocity, times, grid, substeps)
    body, grid, pressure, times, velocity = as_float64((body, grid, pressure, times, velocity))
    if valid is not True:
        pressure = jnp.where(valid, pressure, jnp.nan)
    pressure = jnp.broadcast_to(pressure, (count, *grid.shape))
    found = _march(build(body, RIGID, grid), grid, pressure, times, velocity, substeps=substeps)
    for note in found.notes if is_concrete(found) else ():
        warnings.warn(note, stacklevel=2)
    return found


def _least_substeps(velocity: Any, times: Any, grid: Grid) -> int:
    """Return the least number of inner steps of which none is longer than a part ``FARTHEST`` of the grid, or farther than
    ``OFF_THE_WAY`` from the way."""
    shape, count = np.shape(velocity), np.shape(times)[0]
    if not is_concrete(velocity, times, grid) or all(grid.periodic) or shape not in ((), (2,), (count, 2)):
        return 1
    checks.finite("velocity [m/s]", velocity)
    starts, ends = (way / np.array(grid.shape) for way in ways(velocity, times, grid))

    # of inner steps in which the velocity is linear the first or the last one is the longest
    def longest(n: int) -> float:
        half = (ends - starts) / (2 * n)
        return float(np.max(np.maximum(np.abs(starts + half), np.abs(ends - half)), initial=0.0)) / n

    # and the way of a constant velocity is |dv| dt/8 off that of one which changes by dv
    off = np.max(np.abs(ends - starts) * np.array(grid.shape), initial=0.0) / 8.0
    n = max(
        1,
        int(np.ceil(longest(1) / FARTHEST * (1.0 - 1e-12))),
        int(np.ceil(np.sqrt(off / OFF_THE_WAY) - 1e-9)),
    )
    while longest(n) > FARTHEST * (1.0 + 1e-12) and n <= MOST_SUBSTEPS:
        n += 1
    checks.require(
        n <= MOST_SUBSTEPS,
        f"times [s]: expected steps of at most {MOST_SUBSTEPS // 2} widths of the grid along the track, got"
        f" {np.max(np.abs([starts, ends]), initial=0.0):.4g}: pass more times or a wider grid",
    )
    return n


@functools.partial(Program, static_argnames=("substeps",))
def _march(
    kernels: Kernels, grid: Grid, pressure: Array, times: Array, velocity: Array, *, substeps: int
) -> Deflection:
    """Return the displacement after each time, with the memory of a moving body."""
    # the way of the load over the body in inner steps [cells], and the pressure at their ends
    scale = kernels.scale
    memory = moving_memory(kernels, jnp.zeros(grid.shape), grid.spacing[1] / grid.spacing[0])
    move = moves(velocity / scale.length, times, substeps)
    motion = Motion(fine_steps(times, substeps), move, directions(velocity, times, substeps))
    pressures = fine_values(scale.from_si("pressure", pressure), substeps)

    def advance(carry: tuple[Any, Array], step: tuple[Motion, Array]) -> tuple[tuple[Any, Array], Any]:
        # u = K p + what earlier pressure has left; no contact has to be found
        (fields, before), (moved, now) = carry, step
        ahead = memory.predict(fields, before, moved)
        fields = memory.update(ahead.fields, now, moved)
        assert isinstance(ahead.operator, Operator)  # of a pressure alone
        return (fields, now), (ahead.operator(now) + ahead.earlier, fields.truncation_bound)

    def over_one(carry: tuple[Any, Array], steps: Any) -> tuple[tuple[Any, Array], Any]:
        carry, outcomes = jax.lax.scan(advance, carry, steps)
        return carry, jax.tree.map(lambda a: a[-1], outcomes)

    start = memory.start(grid.shape), jnp.zeros(grid.shape)
    _, (displacement, lost) = jax.lax.scan(over_one, start, (motion, pressures))

    # statuses: of steps that were too long, of the response, and of values out of range
    errors = kernels.errors(times[-1] - times[0])
    error = jnp.maximum(errors.separation, errors.images)
    late = times - times[0] > errors.horizon
    far = jnp.zeros(times.shape, bool)
    if not all(grid.periodic):
        nx, ny = grid.shape
        way = [jnp.abs(move.x) / nx] + ([] if move.y is None else [jnp.abs(move.y) / (ny * memory.ratio)])
        far = jnp.max(jnp.stack(way), (0, 2)) > FARTHEST * (1.0 + 1e-9)
    status = most_serious(
        (jnp.cumsum(far) > 0, Status.MOVED_TOO_FAR),
        (late | (error > LARGEST_ERROR), Status.NOT_RESOLVED),
        (jnp.isnan(jnp.sum(displacement, (1, 2))), Status.OUT_OF_RANGE),
    )
    return Deflection(grid, times, displacement * scale.length, lost * scale.length, error, status)
