"""The motion of the indenter over the body: moves and directions in the inner steps, and checks of the track."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import is_concrete, require_real
from jaxcontact.bodies.body import LayeredHalfSpace, check_bonded
from jaxcontact.bodies.controls import check_friction
from jaxcontact.bodies.grid import Grid, check_grid
from jaxcontact.history.memory import Way
from jaxcontact.history.time_loop import at_fine_times, fine_steps
from jaxcontact.indenters.shapes import Indenter

FARTHEST = 1 / 2  # longest move in an inner step over the width of the grid
GAUSS_PLACES, GAUSS_WEIGHTS = (
    np.polynomial.legendre.leggauss(12) + np.array([[1.0], [0.0]])
) / 2.0  # on 0 to 1
# distance from an earlier place, over the width of the grid, below which the indenter is back at it
RETURN = 1 / 4
SAMPLES = 1500  # places of the track at which a return is looked for, beside its turning points


def as_array(velocity: Array | float) -> Any:
    """Return a velocity, which may be a tuple or list of numbers, as an array; ValueError for anything else."""
    require_real("velocity", velocity)
    try:
        return (
            np.asarray(velocity, dtype=float) if is_concrete(velocity) else jnp.asarray(velocity, dtype=float)
        )
    except (TypeError, ValueError):
        raise ValueError(f"velocity: expected a number or numbers [m/s], got {velocity!r}") from None


def speed_of(velocity: Array) -> Array:
    """Return |v| of vectors (..., 2), with zero derivative at rest."""
    return _root(jnp.sum(velocity**2, -1))


def mean_speed(start: Array, end: Array) -> Array:
    """Return the mean of |v| over a step in which the velocity v changes linearly between two vectors (..., 2).

    With v = b + a s, 0 <= s <= 1, it is the integral of sqrt(A (s - s0)^2 + h^2), A = |a|^2, s0 = -a.b/A and h the smallest
    speed on the line: in closed form, or by a Gauss-Legendre rule of 12 nodes (error 1e-15) where v changes by less
    than half of its mean. It is less than the mean of both speeds where the direction changes: half of it for a reversal.
    """
    change, middle = end - start, (start + end) / 2.0
    squared = jnp.sum(change**2, -1)
    steady = squared <= 0.25 * jnp.sum(middle**2, -1)
    at_rest = (squared == 0.0) & jnp.all(middle == 0.0, -1)
    between = start[..., None, :] + change[..., None, :] * GAUSS_PLACES[:, None]
    between = jnp.where((steady & ~at_rest)[..., None, None], between, 1.0)  # safe to differentiate
    smooth = jnp.sum(GAUSS_WEIGHTS * jnp.sqrt(jnp.sum(between**2, -1)), -1)
    square = jnp.where(steady, 1.0, squared)
    nearest = -jnp.sum(change * start, -1) / square
    across = start[..., 0] * end[..., 1] - start[..., 1] * end[..., 0]
    ratio = jnp.where(steady, 1.0, (across / square) ** 2)  # h^2/A
    integral = lambda x: 0.5 * (x * _root(x**2 + ratio) + _times_asinh(ratio, x))
    turning = jnp.sqrt(square) * (integral(1.0 - nearest) - integral(-nearest))
    return jnp.where(at_rest, 0.0, jnp.where(steady, smooth, turning))


def _root(x: Array) -> Array:
    """Return the square root; at zero its derivative is zero."""
    return jnp.where(x > 0.0, jnp.sqrt(jnp.where(x > 0.0, x, 1.0)), 0.0)


def _times_asinh(g: Array, x: Array) -> Array:
    """Return g asinh(x/sqrt(g)), zero at g = 0."""
    some = g > 0.0
    safe = jnp.where(some, g, 1.0)
    return jnp.where(some, safe * jnp.arcsinh(x / jnp.sqrt(safe)), 0.0)


def as_vector(velocity: Any) -> Any:
    """Return a velocity, a number along x or a vector (..., 2), as a vector; known values in numpy stay so."""
    numbers: Any = np if isinstance(velocity, np.ndarray | np.generic) else jnp
    return numbers.stack([velocity, numbers.zeros(())]) if velocity.ndim == 0 else velocity


def over_times(velocity: Array, times: Array) -> Array:
    """Return a velocity (), (2,) or (nt, 2) at each time, (nt, 2)."""
    return jnp.broadcast_to(as_vector(velocity), (times.shape[0], 2))


def ways(velocity: Any, times: Any, grid: Grid) -> tuple[Any, Any]:
    """Return the ways [cells] between two times at the velocity of the first and at that of the second, (nt - 1, 2) each.

    velocity: a number, (2,) or (nt, 2). Known values stay in numpy, since operations of jax are traced inside jit.
    """
    numbers: Any = np if is_concrete(velocity, times, grid) else jnp
    v = numbers.broadcast_to(as_vector(numbers.asarray(velocity, float)), (np.shape(times)[0], 2))
    spacing = numbers.stack([numbers.asarray(d, float) for d in grid.spacing])
    per_cell = numbers.diff(numbers.asarray(times, float))[:, None] / spacing
    return v[:-1] * per_cell, v[1:] * per_cell


def moves(velocity: Array, times: Array, substeps: int) -> Way:
    """Return the move of the indenter in each inner step, (nt, substeps), for a velocity in cells per second."""
    start, end = at_fine_times(over_times(velocity, times), substeps)
    move = (start + end) / 2.0 * fine_steps(times, substeps)[..., None]
    return Way(move[..., 0], None if velocity.ndim == 0 else move[..., 1])


def departures(velocity: Array, times: Array, substeps: int) -> Way | None:
    """Return how far the indenter, in the middle of each inner step, is from where its mean velocity would have it,
    -dv dt/8, as ``moves``; dv: change of the velocity in the step.

    None for a velocity that does not change.
    """
    if velocity.ndim < 2:
        return None
    start, end = at_fine_times(velocity, substeps)
    aside = (start - end) / 8.0 * fine_steps(times, substeps)[..., None]
    return Way(aside[..., 0], aside[..., 1])


def carried_past(field: Array, move: Way, ratio: Array, periodic: tuple[bool, bool], beyond: str) -> Array:
    """Return a field of the body (nx, ny) in the frame of an indenter after its move: f(x + move), along x and then y.

    By Lagrange's polynomial through four cells, held between the two cells on either side, so that no value arises beyond
    those of the field, and none is changed by a move of whole cells (R. Bermejo, A. Staniforth, Mon. Weather Rev. 120 (1992)
    2622). move [cells along x]; ratio: dy/dx; beyond: what lies beyond a side that is not periodic, "constant" for zero or
    "edge".
    """
    for axis, cells in enumerate((move.x, None if move.y is None else move.y / ratio)):
        n = field.shape[axis]
        if cells is None or n == 1:
            continue
        whole = jnp.floor(cells)
        t = cells - whole
        whole = jax.lax.stop_gradient(whole).astype(int)
        whole = whole % n if periodic[axis] else jnp.clip(whole, -n - 2, n + 2)

        # from the cell before to the second one after the place that comes to each cell
        pads = [(n + 3, n + 4) if k == axis else (0, 0) for k in range(2)]
        padded = jnp.pad(field, pads, mode="wrap" if periodic[axis] else beyond)
        near = jax.lax.dynamic_slice_in_dim(padded, whole + n + 2, n + 3, axis)
        before, one, other, after = (jax.lax.slice_in_dim(near, k, k + n, axis=axis) for k in range(4))
        polynomial = (
            -t * (t - 1.0) * (t - 2.0) / 6.0 * before
            + (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0 * one
            - (t + 1.0) * t * (t - 2.0) / 2.0 * other
            + (t + 1.0) * t * (t - 1.0) / 6.0 * after
        )
        field = jnp.clip(polynomial, jnp.minimum(one, other), jnp.maximum(one, other))
    return field


def directions(velocity: Array, times: Array, substeps: int) -> Array:
    """Return unit vectors of the velocity at the end of each inner step, zero at rest, (nt, substeps, 2)."""
    return unit_vectors(at_fine_times(over_times(velocity, times), substeps)[1])


def unit_vectors(v: Array) -> Array:
    """Return vectors (..., 2) over their lengths, zero where they are zero.

    They follow from the ratio of the components: along an axis the derivative by the length is then exactly zero, and not
    the rounding of v/|v|, for which no linear system of derivatives can be solved.
    """
    steep = jnp.abs(v[..., 1:]) > jnp.abs(v[..., :1])
    large, small = jnp.split(jnp.where(steep, v[..., ::-1], v), 2, -1)
    ratio = small / jnp.where(large == 0.0, 1.0, large)
    unit = jnp.sign(large) / jnp.sqrt(1.0 + ratio**2) * jnp.concatenate([jnp.ones_like(ratio), ratio], -1)
    return jnp.where(steep, unit[..., ::-1], unit)


def check_sliding_friction(friction: Any, grid: Grid, body: LayeredHalfSpace, indenter: Indenter) -> Verdict:
    """Check the friction of a sliding contact; the tangential responses are those of a grid that is not periodic.

    ValueError unless it is None, or a coefficient as in ``shear`` with bonded layers on such a grid.
    """
    if friction is None:
        return True
    checks.require(not any(grid.periodic), "friction: expected None on a periodic grid or in plane strain")
    for surface in (body, indenter.surface()):
        if surface is not None:
            check_bonded(surface, "friction")
    return check_friction(friction, grid.shape)


class TooFewSubstepsError(ValueError):
    """The indenter moves farther in an inner step than the grid allows; more substeps mend it."""


def checked_track(velocity: Array, times: Array, grid: Grid, substeps: int) -> Verdict:
    """Check a velocity, a number, (2,) or (nt, 2): ValueError where it is not finite, moves too far in an inner step, or
    comes back to what has left the grid.

    Nothing leaves a grid that is periodic along both axes; in plane strain the motion is along x.
    """
    nt = np.shape(times)[0]
    finite = check_shape_of_velocity(velocity, nt) & check_along_x(np.shape(velocity), grid)
    finite = finite & checks.finite("velocity [m/s]", velocity)
    if all(grid.periodic) or not is_concrete(velocity, times, grid):
        return finite
    vector = np.broadcast_to(as_vector(np.asarray(velocity, dtype=float)), (nt, 2))
    width = np.asarray(grid.width, dtype=float)
    moves = (vector[1:] + vector[:-1]) / 2.0 * np.diff(np.asarray(times, dtype=float))[:, None] / width

    # no inner step exceeds ``FARTHEST`` widths
    farthest = float(np.max(np.abs(moves), initial=0.0))
    needed = int(np.ceil(farthest / FARTHEST * (1.0 - 1e-12)))
    if needed > substeps:
        raise TooFewSubstepsError(
            f"velocity: expected steps of at most {FARTHEST} of the grid's width, got {farthest:.3g} between two"
            f" times in {substeps} substeps: pass substeps={needed} or more, or a wider grid"
        )

    # the track does not come back to a place after its history has left the grid, half a width away
    places = np.concatenate([np.zeros((1, 2)), np.cumsum(moves, axis=0)])
    turns = 1 + np.flatnonzero(np.any(moves[1:] * moves[:-1] < 0.0, axis=1))
    some = np.linspace(0, len(places) - 1, min(len(places), SAMPLES)).astype(int)
    fewer = places[np.union1d(some, turns)]
    for i, place in enumerate(fewer[:-2]):
        away = np.max(np.abs(fewer[i + 1 :] - place), axis=1)
        left = np.maximum.accumulate(away)
        back = (left > 0.5) & (away < RETURN)
        if np.any(back):
            stroke = float(left[np.argmax(back)])
            raise ValueError(
                f"velocity: expected a track that stays within half the grid's width of every place it"
                f" comes back to, got one that goes {stroke:.3g} widths away: a grid {2.0 * stroke:.3g} times"
                " as wide, and more for the contact, holds it"
            )
    return True


def check_shape_of_velocity(velocity: Any, nt: int | None = None, where: str = "") -> Verdict:
    """Check that a velocity is a number or (2,) or, with a number of times, (nt, 2); where: when only these are accepted."""
    shape = np.shape(velocity)
    over = "" if nt is None else f" or ({nt}, 2) as times"
    expected = f"a number{',' if over else ' or'} shape (2,){over}{where}"
    good = shape in ((), (2,)) or (nt is not None and shape == (nt, 2))
    checks.require(good, f"velocity: expected {expected}, got shape {shape}")
    return True


def check_along_x(shape: tuple[int, ...], grid: Grid) -> Verdict:
    """Check that a velocity of this shape is one number in plane strain; ValueError otherwise."""
    check_grid(grid)
    checks.require(
        not grid.plane_strain or shape == (),
        f"velocity: expected one number, along x, in plane strain, got shape {shape}",
    )
    return True
