"""The area of contact from pressure and gap on the grid, to a few hundredths of a cell along its edge.

At the edge of a contact both the pressure inside and the gap outside vanish. Let c be the displacement of a cell at the
edge under its own unit pressure while its neighbours are held (``Operator.confined_compliance``). The function

    v = c p  in contact,      v = -g  outside

passes through zero at the edge with about the same slope on both sides. It is continuous in load and material
parameters, since p = g = 0 for a cell that just enters contact. The area of contact is that of {v > 0}, taken triangle by
triangle between the centres of the cells, with two corrections for what v is at an edge on a grid:

- Where a side of a triangle crosses the edge at the fraction t from the pressed cell, with v linear along the side, the
  crossing is moved to t + BEND t (1 - t).
- The level set lies OUTSIDE beyond the edge of the continuous contact, in parts of a cell. Its perimeter, measured on the
  same triangles, times OUTSIDE is subtracted. The correction thus follows the patches of contact, however many, and
  vanishes where there is no edge.

Both constants depend on the direction of the edge. In plane strain c is that of a row of cells, and is brought to that of
one cell by ROW.

In a body with memory c p is only what the present pressure contributes. Under a constant contact in which the pressure
relaxes, c p would vanish while the gap outside stays, and the level set would retreat to the pressed cells' centres. The
compliance of a cell therefore includes earlier pressure (``memory_factor``).

Where contact reaches the side of a grid that is not periodic, it ends with the last cell. A wall, such as the flank of a
flat punch, has no gap that tells how far it is: there the edge lies close to the centres of the last pressed cells, up to
half a cell inside the wall.
"""

from collections.abc import Iterator

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.reductions import total

# Of edges along an axis of the grid, and of oblique ones; from Hertz contacts of 1.5 to 40 cells radius at random places
# on the grid. On films between a twentieth of a cell and three cells thick the edge lies up to 0.07 of a cell elsewhere.
BEND = 0.53, 0.2
OUTSIDE = 0.14, 0.075
ROW = 1.53  # held compliance of a row of cells over that of one cell, on a half-space: the mean |k| on a square and a line


def contact_cells(pressure: Array, gap: Array, compliance: Array, periodic: tuple[bool, bool]) -> Array:
    """Return the area of contact in cells, (), which is not a whole number.

    Args:
        pressure, gap: (nx, ny), scaled; the gap is zero in contact.
        compliance: c of the module, () or (nx, ny).
        periodic: whether the grid is periodic along x and along y.

    Differentiable, with derivative zero where nothing is in contact.
    """
    if pressure.shape[1] == 1:  # plane strain
        compliance, periodic = compliance / ROW, (periodic[0], True)
    own = compliance * pressure
    level = jnp.where(pressure > 0.0, own, -jnp.minimum(gap, jnp.max(own)))
    for axis, wraps in enumerate(periodic):
        level = _padded(level, axis, wraps)[(slice(None),) * axis + (slice(1 if wraps else None, None),)]
    weights = jnp.outer(*(_widths(n, wraps) for n, wraps in zip(pressure.shape, periodic, strict=True)))
    shares, rims = zip(*(_share_and_rim(*corners) for corners in _triangles(level)), strict=True)
    return jnp.maximum(total(weights * (sum(shares) / 4.0 - sum(rims) / 2.0)), 0.0)


def _widths(n: int, wraps: bool) -> Array:
    """Return the part of each square between cells' centres that lies in the grid, along an axis of n cells."""
    return jnp.ones(n) if wraps else jnp.ones(n + 1).at[jnp.array([0, n])].set(0.5)


def memory_factor(earlier: Array, displacement: Array, periodic: tuple[bool, bool]) -> Array:
    """Return the local displacement by present and earlier pressure over that by the present pressure, (nx, ny), >= 1.

    earlier, displacement: (nx, ny), left by earlier pressure and caused by the present pressure. The ratio is that of
    their Laplacians, which are local, by least squares over 3 x 3 cells. On a half-space it is exact for a contact that
    stays as it is, whatever the history of its load.
    """
    left, present = (_laplacian(field, periodic) for field in (earlier, displacement))
    common, square = _box_sum(left * present, periodic), _box_sum(present**2, periodic)
    some = square > 0.0
    return 1.0 + jnp.where(some, jnp.maximum(common, 0.0) / jnp.where(some, square, 1.0), 0.0)


def _laplacian(field: Array, periodic: tuple[bool, bool]) -> Array:
    f = _surrounded(field, periodic)
    return f[2:, 1:-1] + f[:-2, 1:-1] + f[1:-1, 2:] + f[1:-1, :-2] - 4.0 * field


def _box_sum(field: Array, periodic: tuple[bool, bool]) -> Array:
    """Return the sum over 3 x 3 cells around each."""
    f = _surrounded(field, periodic)
    rows = f[:-2] + f[1:-1] + f[2:]
    return rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]


def _surrounded(field: Array, periodic: tuple[bool, bool]) -> Array:
    """Return the field with one more cell at both ends of both axes."""
    for axis, wraps in enumerate(periodic):
        field = _padded(field, axis, wraps)
    return field


def _padded(field: Array, axis: int, wraps: bool) -> Array:
    """Return the field with one more cell at both ends: the periodic neighbour or a copy of the last cell."""
    widths = [(1, 1) if i == axis else (0, 0) for i in range(2)]
    return jnp.pad(field, widths, mode="wrap" if wraps else "edge")


def _triangles(level: Array) -> Iterator[tuple[Array, Array, Array]]:
    """Yield the values at the corners of the triangles of both ways to halve a square, that at the right angle first."""
    a, b, c, d = level[:-1, :-1], level[1:, :-1], level[1:, 1:], level[:-1, 1:]
    yield from ((b, a, c), (d, a, c), (a, b, d), (c, b, d))


def _share_and_rim(right: Array, one: Array, other: Array) -> tuple[Array, Array]:
    """Return the share of each triangle's area with values above zero, and OUTSIDE times the length of the edge in it."""
    high, low = jnp.maximum(jnp.maximum(right, one), other), jnp.minimum(jnp.minimum(right, one), other)
    middle = jnp.maximum(jnp.minimum(right, one), jnp.minimum(jnp.maximum(right, one), other))
    cut, most = (high > 0.0) & (low <= 0.0), middle > 0.0
    lone = jnp.where(most, low, high)  # the corner that is alone on its side of the edge
    aligned = _aligned(one - right, other - right)
    bend = jnp.where(most, -1.0, 1.0) * _mixed(BEND, aligned)

    def crossing(value: Array) -> Array:
        t = lone / jnp.where(cut, lone - value, 1.0)
        return t + bend * t * (1.0 - t)

    at_right = lone == right
    first = crossing(jnp.where(at_right, one, right))  # along a leg
    second = crossing(jnp.where(at_right | (lone == one), other, one))  # along a leg, or the hypotenuse
    share = first * second
    area = jnp.where(cut, jnp.where(most, 1.0 - share, share), jnp.where(low > 0.0, 1.0, 0.0))
    square = jnp.where(at_right, first**2 + second**2, (first - second) ** 2 + second**2)
    runs = cut & (square > 0.0)
    length = jnp.where(runs, jnp.sqrt(jnp.where(runs, square, 1.0)), 0.0)
    return area, _mixed(OUTSIDE, aligned**2) * length


def _aligned(along: Array, across: Array) -> Array:
    """Return 1 for edges along an axis of the grid to 0 for edges at 45 degrees, from the differences of the level along
    both legs of a triangle."""
    along, across = jnp.abs(along), jnp.abs(across)
    steep, gentle = jnp.maximum(along, across), jnp.minimum(along, across)
    return (1.0 - gentle / jnp.where(steep > 0.0, steep, 1.0)) ** 3


def _mixed(values: tuple[float, float], aligned: Array) -> Array:
    return values[1] + (values[0] - values[1]) * aligned
