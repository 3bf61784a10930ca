"""The area of contact from pressure and gap on the grid, of second order in the size of the cells.

At the edge of a contact both the pressure inside and the gap outside vanish. Let c be the displacement of a cell at the
edge under its own unit pressure while its neighbours are held (``Operator.confined_compliance``). The function

    v = c p  in contact,      v = -g  outside

passes through zero at the edge with about the same slope on both sides. It is continuous in load and material
parameters, since p = g = 0 for a cell that just enters contact. The area of contact is that of {v > 0}, taken triangle by
triangle between the centres of the cells, with three corrections for what v is at an edge on a grid. They make the error
of the edge vanish to first order in the size of the cells:

- Where a side of a triangle crosses the edge at the fraction t from the corner that is alone on its side of the edge, with
  v linear along the side, the crossing is moved by t (1 - t) [+-(a + b y^2) + c y + d y^3], y = 1 - 2 t, the sign +
  where this corner is pressed, with a, b, c, d as in LEG or, for the long side of a triangle, HYPOTENUSE.
- The level set lies OUTSIDE beyond the edge of the continuous contact, in parts of a cell. Its perimeter, measured on the
  same triangles, times OUTSIDE is subtracted. The correction thus follows the patches of contact, however many, and
  vanishes where there is no edge.
- A curved edge is cut by its chords, and v is linear along the sides only to first order: ROUND times the integral of the
  curvature along the edge is added, taken from the share of contact in 3 x 3 squares, which is 1/2 + (s - 1/2)/3 at a
  straight edge, s that of the square itself, and less where the contact is convex.

Near a straight edge the discrete problem depends only on the direction of the edge and its place among the cells. In any
direction with a rational slope all cells of a row along the edge have the same pressure. The problem is then one of one
dimension, which was solved in eleven directions (as in ``tests/support/oblique_edges.py``). BEND, SKEW, QUARTIC and
OUTSIDE were fitted to the half-widths and their slopes there; ROUND follows from Hertz contacts. In plane strain c is that
of a row of cells, and is brought to that of one cell by ROW.

In a body with memory c p is only what the present pressure contributes. Under a constant contact in which the pressure
relaxes, c p would vanish while the gap outside stays, and the level set would retreat to the pressed cells' centres. The
compliance of a cell therefore includes earlier pressure (``memory_factor``).

On cells that are not square v has the same slope on both sides of the edge only if c follows the direction of the edge.
Along an edge in y, the rows of pressed cells are strips of width dx, whatever dy is; their compliance is that of a square
of this width. With e = dy/dx of a half-space, the unit normal (n_x, n_y) of the edge, and c of one cell, pressed values
are multiplied by

    g = m(e) sqrt(n_x^2/e + n_y^2 e),

where m(e) is the compliance of a square over that of a cell of equal area and of the sides 1 : e. All lengths above are
then in cells along x and y. Lines in eleven directions on cells of 1.5 to 7 : 1 are again found to 0.01 of the cell's
extent across the edge, in the mean to 0.005. A layer thinner than a cell responds locally, and c is then that of one cell
on cells of any sides. In general, e is therefore the ratio of the displacements of the surface under pressures that
alternate from cell to cell along y and along x (``Operator.cell_ratio``). The correction for a curved edge is of second
order in the extent of a cell across it, which in cells is g/m: a part STRETCHED of ROUND, from Hertz contacts, is times
(g/m)^4.

Where contact reaches the side of a grid that is not periodic, it ends with the last cell. A wall, such as the flank of a
flat punch, has no gap that tells how far it is: there the edge lies close to the centres of the last pressed cells, up to
half a cell inside the wall.
"""

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.reductions import total

# Coefficients of polynomials of a number that is 1 for edges along an axis of the grid and 0 for edges at 45 degrees.
LEG = (
    (0.5572, 0.3881, -0.4618),
    (-0.0769, 0.8159, -0.3368),
    (0.0656, 0.3053, 0.0388),
    (-0.0445, 0.4327, -0.2323),
)
HYPOTENUSE = (
    (0.7935, 0.0100, 0.1459),
    (-0.0141, 0.5362, -0.7026),
    (0.2859, -0.2697, -0.0977),
    (-0.0753, 0.7192, -0.6206),
)
OUTSIDE = 0.1554, 0.0918, -0.0689
ROUND, STRETCHED = 0.5, 0.82  # the second: the part of it that follows g on cells that are not square
# log m = LONG_CELL[0] L^2/(1 + LONG_CELL[1] L^2), L = log e, to 1e-3 up to e = 7; by summing displacements of rectangles.
LONG_CELL = 0.2003, 0.0777
DIRECTIONS = 3  # times that the normal of an edge and g, on which it depends, are found in turn
ROW = 1.53  # held compliance of a row of cells over that of one cell, on a half-space: the mean |k| on a square and a line

CORNERS = (0, 0), (1, 0), (1, 1), (0, 1)  # of a square, one after the other
# Corners of the triangles of both ways to halve a square: that at the right angle, that beside it along x, and along y.
TRIANGLES = (1, 0, 2), (3, 2, 0), (0, 1, 3), (2, 3, 1)
TILE, BATCH = 8, 32  # squares along a side of a tile; tiles of which the corrections are computed together


def contact_cells(
    pressure: Array,
    gap: Array,
    compliance: Array,
    periodic: tuple[bool, bool],
    cell_ratio: Array | float = 1.0,
) -> Array:
    """Return the area of contact in cells, (), which is not a whole number.

    Args:
        pressure, gap: (nx, ny), scaled; the gap is zero in contact.
        compliance: c of the module, () or (nx, ny).
        periodic: whether the grid is periodic along x and along y.
        cell_ratio: e of the module, 1 for square cells.

    Differentiable, with derivative zero where nothing is in contact.
    """
    if pressure.shape[1] == 1:  # plane strain
        compliance, periodic = compliance / ROW, (periodic[0], True)

    # The function v, no lower outside than it may count at an edge, on the corners of squares between cells' centres;
    # with the squares of all tiles along each axis, and one more square before and after them.
    own, stretch = compliance * pressure, jnp.log(cell_ratio)
    largest = jnp.max(own) * _long_cell(stretch) * jnp.exp(0.5 * jnp.abs(stretch))
    level = jnp.where(pressure > 0.0, own, -jnp.minimum(gap, largest))
    (nx, ny), (wraps_x, wraps_y) = pressure.shape, periodic
    along_x, along_y = _widths(nx, wraps_x), _widths(ny, wraps_y)
    before, after = 1 if wraps_x else 2, along_x.size + 3 - nx
    level = jnp.pad(level, [(before, after - before), (0, 0)], mode="wrap" if wraps_x else "edge")
    before, after = 1 if wraps_y else 2, along_y.size + 3 - ny
    level = jnp.pad(level, [(0, 0), (before, after - before)], mode="wrap" if wraps_y else "edge")

    # The area of the squares whose first corner is pressed; only tiles that the edge crosses differ from that.
    positive = level[1:-1, 1:-1] > 0.0
    one = positive[:-1, :-1]
    inside = total(jnp.outer(along_x.ravel(), along_y.ravel()) * one)
    cut = (one != positive[1:, :-1]) | (one != positive[1:, 1:]) | (one != positive[:-1, 1:])
    crossed = jnp.any(cut.reshape(*along_x.shape, *along_y.shape), (1, 3)).ravel()

    # The numbers of the tiles, those with an edge first; the number zero fills up the last batch.
    number, count = jnp.sum(crossed), len(crossed)
    place = jnp.where(crossed, jnp.cumsum(crossed), number + jnp.cumsum(~crossed)) - 1
    order = jnp.zeros(count + -count % min(BATCH, count), int).at[place].set(jnp.arange(count))
    i, j = order // len(along_y), order % len(along_y)
    (_, height), (_, width) = along_x.shape, along_y.shape
    tile = lambda i, j: jax.lax.dynamic_slice(level, (i * height, j * width), (height + 3, width + 3))
    once = jnp.arange(len(order)) < count
    given = jax.vmap(tile)(i, j), once[:, None] * along_x[i], along_y[j]
    batches = jax.tree.map(lambda a: a.reshape(-1, min(BATCH, len(a)), *a.shape[1:]), given)

    # What the triangles of the tiles with an edge add, batch by batch.
    @partial(jax.checkpoint, prevent_cse=False)
    def add(sum_: Array, batch: tuple[Array, tuple[Array, Array, Array]]) -> tuple[Array, None]:
        first, tiles = batch
        added = jax.lax.cond(first < number, _near_edge, lambda *_: jnp.zeros(()), *tiles, stretch)
        return sum_ + added, None

    firsts = jnp.arange(len(batches[1])) * batches[1].shape[1]
    return jnp.maximum(jax.lax.scan(add, inside, (firsts, batches))[0], 0.0)


def _widths(n: int, wraps: bool) -> Array:
    """Return the part of each square between cells' centres that lies in the grid, along an axis of n cells.

    (tiles, squares), zero for those that fill up the last tile.
    """
    squares = n if wraps else n + 1
    size = min(TILE, squares)
    count = -(-squares // size)
    widths = jnp.ones(n) if wraps else jnp.ones(n + 1).at[jnp.array([0, n])].set(0.5)
    return jnp.pad(widths, (0, count * size - squares)).reshape(count, size)


def _near_edge(level: Array, along_x: Array, along_y: Array, stretch: Array) -> Array:
    """Return by how much the area in tiles differs from that of the squares whose first corner is in contact, ().

    level: (tiles, m + 3, n + 3), with one more square on all sides; along_x, along_y: (tiles, m), (tiles, n), the part of
    each square that lies in the grid; stretch: log e of the module.
    """
    _, height, width = level.shape
    corner = lambda offset: jax.lax.dynamic_slice(level, (0, *offset), (len(level), height - 1, width - 1))
    # by vmap, since the transpose of four slices would compute each part many times
    corners = jax.vmap(corner)(jnp.array(CORNERS))
    share, rim, length = _shares_rims_lengths(corners, stretch)
    # without slices: the gradient of a padded one would compute each operation many times
    near = lambda n: (jnp.abs(jnp.arange(n)[:, None] - jnp.arange(n)) <= 1).astype(float)
    box = jnp.einsum("ik,tkl,jl->tij", near(height - 1), share, near(width - 1))  # sums over 3 x 3 squares
    missing = 0.5 + (share - 0.5) / 3.0 - box / 9.0
    beyond = share - (corners[0] > 0.0) - rim + ROUND * length * missing
    along_x, along_y = (jnp.pad(part, ((0, 0), (1, 1))) for part in (along_x, along_y))
    return jnp.sum(beyond * along_x[:, :, None] * along_y[:, None, :])


@partial(jax.checkpoint, prevent_cse=False)
def _shares_rims_lengths(corners: Array, stretch: Array) -> tuple[Array, ...]:
    """Return of whole squares (tiles, m, n), from the values at their corners (4, tiles, m, n), the share of their area with
    values above zero, and the length of the edge in it, with the factors OUTSIDE and STRETCHED.

    All triangles at once, chosen and summed by products: these are not fused with other operations, so that the gradient
    computes each once. It computes them anew, since to store them all takes longer.
    """
    chosen = jnp.eye(len(CORNERS))[jnp.array(TRIANGLES).T]
    # at the right angle, beside it along x, along y
    values = tuple(jnp.einsum("stc,cijk->stijk", chosen, corners))

    # 1. Pressed values times g of the module. The normal follows from the differences of the level along both legs, which
    # depend on g: a fixed point, found by repetition. (g/m)^2 is 1 for stretch = 0.
    wide = _long_cell(stretch)
    factor = wide * jnp.ones_like(values[0])
    for _ in range(DIRECTIONS):
        corner, one, other = (jnp.where(value > 0.0, factor * value, value) for value in values)
        x, y = (one - corner) ** 2, (other - corner) ** 2
        weighted = x * jnp.exp(stretch) + y * jnp.exp(-stretch)
        sloping = weighted > 0.0
        turned = jnp.where(sloping, (x + y) / jnp.where(sloping, weighted, 1.0), 1.0)
        factor = wide * jnp.sqrt(turned)
    right, one, other = (jnp.where(value > 0.0, factor * value, value) for value in values)

    # 2. The corner that is alone on its side of the edge, counted in numbers: maxima and logical operations take several
    # times as long on a CPU.
    signs = [jnp.where(value > 0.0, 1.0, 0.0) for value in (right, one, other)]
    pressed = signs[0] + signs[1] + signs[2]
    most = pressed > 1.5
    cut = jnp.abs(pressed - 1.5) < 1.0
    at_right, at_one = ((sign > 0.5) != most for sign in signs[:2])
    lone = jnp.where(at_right, right, jnp.where(at_one, one, other))

    # 3. Where the sides from it cross the edge, with the correction of the module: coefficients are polynomials of 1 for
    # edges along an axis of the grid to 0 for edges at 45 degrees.
    along, across = jnp.abs(one - right), jnp.abs(other - right)
    steep, gentle = jnp.maximum(along, across), jnp.minimum(along, across)
    aligned = (1.0 - gentle / jnp.where(steep > 0.0, steep, 1.0)) ** 2
    sign = jnp.where(most, -1.0, 1.0)
    leg, hypotenuse = ([_polynomial(row, aligned) for row in side] for side in (LEG, HYPOTENUSE))
    either = [jnp.where(at_right, *pair) for pair in zip(leg, hypotenuse, strict=True)]

    def crossing(value: Array, moved: list[Array]) -> Array:
        bend, quartic, skew, cubic = moved
        t = lone / jnp.where(cut, lone - value, 1.0)
        y = 1.0 - 2.0 * t
        return t + t * (1.0 - t) * (sign * (bend + quartic * y**2) + (skew + cubic * y**2) * y)

    first = crossing(jnp.where(at_right, one, right), leg)
    second = crossing(jnp.where(at_right | at_one, other, one), either)

    # 4. The triangle that the edge cuts off, and the length of the edge in it.
    share = first * second
    share = jnp.where(cut, jnp.where(most, 1.0 - share, share), jnp.where(most, 1.0, 0.0))
    square = jnp.where(at_right, first**2 + second**2, (first - second) ** 2 + second**2)
    runs = cut & (square > 0.0)
    length = jnp.where(runs, jnp.sqrt(jnp.where(runs, square, 1.0)), 0.0)
    rim = _polynomial(OUTSIDE, aligned) * length

    parts = share, rim, length * (1.0 + STRETCHED * (turned**2 - 1.0))
    weights = jnp.array([0.25, 0.5, 0.5])[:, None] * jnp.ones(len(TRIANGLES))
    return tuple(jnp.einsum("t,tijk->ijk", w, part) for w, part in zip(weights, parts, strict=True))


def memory_factor(earlier: Array, displacement: Array, periodic: tuple[bool, bool]) -> Array:
    """Return the local displacement by present and earlier pressure over that by the present pressure, (nx, ny), >= 1.

    earlier, displacement: (nx, ny), left by earlier pressure and caused by the present pressure. The ratio is that of
    their Laplacians, which are local, by least squares over 3 x 3 cells. On a half-space it is exact for a contact that
    stays as it is, whatever the history of its load.
    """
    fields = jnp.stack([earlier, displacement])
    laplacians = _sums(fields, (3, 1), periodic) + _sums(fields, (1, 3), periodic) - 6.0 * fields
    common, square = _sums(laplacians * laplacians[1], (3, 3), periodic)
    some = square > 0.0
    return 1.0 + jnp.where(some, jnp.maximum(common, 0.0) / jnp.where(some, square, 1.0), 0.0)


def _sums(fields: Array, block: tuple[int, int], periodic: tuple[bool, bool]) -> Array:
    """Return the sums of fields (n, nx, ny) over a block of cells around each cell; beyond an end of the grid are the
    periodic neighbours or the last cell again.
    """
    for axis, (size, wraps) in enumerate(zip(block, periodic, strict=True), 1):
        ends = [(size // 2, size // 2) if i == axis else (0, 0) for i in range(3)]
        fields = jnp.pad(fields, ends, mode="wrap" if wraps else "edge")
    return jax.lax.reduce_window(fields, 0.0, jax.lax.add, (1, *block), (1, 1, 1), "VALID")


def _long_cell(stretch: Array) -> Array:
    """Return m of the module, from log e."""
    return jnp.exp(LONG_CELL[0] * stretch**2 / (1.0 + LONG_CELL[1] * stretch**2))


def _polynomial(coefficients: tuple[float, ...], x: Array) -> Array:
    """Return the polynomial with these coefficients, from that of x^0 on."""
    return jnp.polyval(jnp.asarray(coefficients[::-1]), x)
