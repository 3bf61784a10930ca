"""Where a contact ends, found below the cell.

On the edge both the pressure inside and the gap outside are zero. A cell at the edge sinks by c p under a pressure p
of its own when its neighbours stay where they are (``Operator.held_compliance``), so that

    v = c p  in contact,      v = -g  outside

is one function that goes through zero with about the same slope on both sides, on a half-space as on a thin
film, for a contact that grows as for one that creeps. The contact is {v > 0}, with v nearly linear between the
centres of cells. When a cell enters contact its p and g are both zero, and v does not jump: the area moves with
load and materials, cell or no cell.

A wall, beside a flat punch or at the end of the grid, has no gap to tell how far it is: there the contact ends
with the cell.
"""

import math

import jax.numpy as jnp
from jax import Array

# Measured against axisymmetric solutions on films from 1e-3 to 10 radii of contact, creeping or not. A cell is
# pressed whose centre lies up to a part of a cell beyond the edge of the continuous contact, 0.03 to 0.11. Between
# a pressed cell and a free one, where a linear v is zero at t, the edge lies farther out by BEND t (1 - t): towards
# the edge the pressure falls ever faster, and the gap opens slowly.
BEYOND, BEND = 0.07, 0.2


def contact_cells(pressure: Array, gap: Array, compliance: Array, periodic: tuple[bool, bool]) -> Array:
    """The cells within the edge of the contact, (), not a whole number; pressure and gap (nx, ny), scaled.

    compliance: c of the module. Differentiable, without contact as well.
    """
    own = compliance * pressure
    level = jnp.where(pressure > 0.0, own, -jnp.minimum(gap, jnp.max(own)))
    for axis, wraps in enumerate(periodic):
        level = _closed(level, axis, wraps)
    a, b, c, d = level[:-1, :-1], level[1:, :-1], level[1:, 1:], level[:-1, 1:]
    triangles = (a, b, c), (c, d, a), (b, c, d), (d, a, b)  # both ways to cut a square
    cells = sum(jnp.sum(_share(*corners)) for corners in triangles) / 4.0
    if pressure.shape[1] == 1:
        return jnp.maximum(cells - 2.0 * BEYOND, 0.0)
    return cells * (1.0 - BEYOND / jnp.sqrt(cells / math.pi + 1.0)) ** 2


def _closed(level: Array, axis: int, wraps: bool) -> Array:
    """With the first cell once more behind the last, or with a wall at either end, which contact meets half-way."""
    first, last = (jnp.take(level, jnp.array([i]), axis=axis) for i in (0, -1))
    if wraps:
        return jnp.concatenate([level, first], axis)
    return jnp.concatenate([-jnp.abs(first), level, -jnp.abs(last)], axis)


def _share(a: Array, b: Array, c: Array) -> Array:
    """Of a triangle, where the linear function with these values at its corners is above zero."""
    high, low = jnp.maximum(jnp.maximum(a, b), c), jnp.minimum(jnp.minimum(a, b), c)
    middle = jnp.maximum(jnp.minimum(a, b), jnp.minimum(jnp.maximum(a, b), c))
    cut, most = (high > 0.0) & (low <= 0.0), middle > 0.0
    lone, other = (
        jnp.where(most, low, high),
        jnp.where(most, high, low),
    )  # the corner that is alone on its side
    sides = (lone / jnp.where(cut, lone - value, 1.0) for value in (middle, other))
    first, second = (t + jnp.where(most, -BEND, BEND) * t * (1.0 - t) for t in sides)
    area = first * second
    return jnp.where(cut, jnp.where(most, 1.0 - area, area), jnp.where(low > 0.0, 1.0, 0.0))
