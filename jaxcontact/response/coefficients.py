"""Influence coefficients: the displacement at a cell under a unit pressure on another.

An image at depth z (``response.images``) has a closed form over a rectangular cell: with F(x, y; z) the
double integral of 1/(2 pi r), r^2 = x^2 + y^2 + z^2,

    F = (1/2 pi) [x asinh(y/sqrt(x^2 + z^2)) + y asinh(x/sqrt(y^2 + z^2)) - z atan(x y/(z r))],

the coefficient at an offset is the difference of F over the cell's four corners (z = 0: A. E. H. Love,
Phil. Trans. R. Soc. A 228 (1929) 377). For a step of the staircase, from z down to Z, the difference of F is
taken in one, since for a film much thinner than a cell all else cancels: with R = r(Z),

    asinh(y/sqrt(x^2 + z^2)) - asinh(y/sqrt(x^2 + Z^2))
        = asinh(y (Z^2 - z^2)/((r + R) sqrt(x^2 + z^2) sqrt(x^2 + Z^2))).

They are good to 1e-9 of the central one for films up to ten times as stiff as their substrate, whatever their
thickness; the paper's refined grid (its Eqs. 7-10, ``reference.refined_grid``) has 0.2 to 2 %.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.grid import Grid
from jaxcontact.response.images import Images


class Level(NamedTuple):
    """The corners (x, y) > 0 seen from a depth z, in units of dx.

    distance: r, (nx, ny); across and along: sqrt(x^2 + z^2), (nx, 1), and sqrt(y^2 + z^2), (1, ny); angle:
    z atan(x y/(z r)), (nx, ny).
    """

    depth: Array
    distance: Array
    across: Array
    along: Array
    angle: Array


def _level(x: Array, y: Array, z: Array) -> Level:
    r = jnp.sqrt(x**2 + y**2 + z**2)
    return Level(z, r, jnp.sqrt(x**2 + z**2), jnp.sqrt(y**2 + z**2), z * jnp.arctan2(x * y, z * r))


def _asinh(u: Array) -> Array:
    """For u >= 0; twice as fast as ``jnp.arcsinh``."""
    return jnp.log1p(u + u**2 / (1.0 + jnp.sqrt(1.0 + u**2)))


def _step_integral(x: Array, y: Array, upper: Level, lower: Level) -> Array:
    """2 pi (F(z) - F(Z)) of the module's formula, (nx, ny)."""
    rise = (lower.depth - upper.depth) * (lower.depth + upper.depth) / (upper.distance + lower.distance)
    logs = x * _asinh(y * rise / (upper.across * lower.across))
    return logs + y * _asinh(x * rise / (upper.along * lower.along)) - (upper.angle - lower.angle)


def _last_integral(x: Array, y: Array, level: Level) -> Array:
    """2 pi F of the module's formula, (nx, ny)."""
    return x * _asinh(y / level.across) + y * _asinh(x / level.along) - level.angle


def _over_cells(corners: Array) -> Array:
    """The difference over a cell's corners of functions odd in x and y, from their values at positive ones."""
    corners = jnp.diff(corners, axis=-2, prepend=-corners[..., :1, :])
    return jnp.diff(corners, axis=-1, prepend=-corners[..., :1])


def _corners(grid: Grid) -> tuple[Array, Array]:
    """Those with x > 0, (nx, 1), and y > 0, (1, ny), in units of dx."""
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    return (jnp.arange(nx) + 0.5)[:, None], (jnp.arange(ny) + 0.5)[None, :] * (dy / dx)


def influence_coefficients(grid: Grid, images: Images) -> Array:
    """Coefficients [m/Pa] at offsets (i, j) >= 0, (..., nx, ny), for heights (..., J + 1)."""
    x, y = _corners(grid)

    def descend(carry: tuple[Array, Level], step: tuple[Array, Array]) -> tuple[tuple[Array, Level], None]:
        (total, upper), (height, z) = carry, step
        lower = _level(x, y, z)
        return (total + height[..., None, None] * _step_integral(x, y, upper, lower), lower), None

    heights, depths = jnp.moveaxis(images.heights, -1, 0), images.depths / grid.spacing[0]
    top = jnp.zeros((*heights.shape[1:], *grid.shape)), _level(x, y, jnp.zeros(()))
    (total, deepest), _ = jax.lax.scan(descend, top, (heights[:-1], depths))
    total = total + heights[-1][..., None, None] * _last_integral(x, y, deepest)
    return _over_cells(total) * grid.spacing[0] / (2.0 * jnp.pi)
