"""Influence coefficients: the displacement at a cell under a unit pressure on another.

An image at depth z (``response.images``) has a closed form over a rectangular cell: with F(x, y; z) the
double integral of 1/(2 pi r), r^2 = x^2 + y^2 + z^2,

    F = (1/2 pi) [x ln(y + r) + y ln(x + r) - z atan(x y/(z r))],

the coefficient at an offset is the difference of F over the cell's four corners (z = 0: A. E. H. Love,
Phil. Trans. R. Soc. A 228 (1929) 377; terms of x or y alone drop out of the difference). For an image
F(z) - F(0) is taken in one, with r_0 = r(z = 0) and s = r - r_0 = z^2/(r + r_0),

    F(z) - F(0) = (1/2 pi) [x ln(1 + s/(y + r_0)) + y ln(1 + s/(x + r_0)) - z atan(x y/(z r))],

since in sums over images of a film much thinner than a cell all else cancels. They are good to 1e-9 of the
central one, whatever the film's thickness; the paper's refined grid (its Eqs. 7-10,
``reference.refined_grid``) has 0.2 to 2 %.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.grid import Grid
from jaxcontact.response.images import Images


def _surface_integral(x: Array, y: Array) -> Array:
    """2 pi F of the module's formula at z = 0; x and y not zero."""
    r = jnp.sqrt(x**2 + y**2)
    return x * jnp.log(y + r) + y * jnp.log(x + r)


def _image_integral(x: Array, y: Array, z: Array) -> Array:
    """2 pi (F(z) - F(0)) of the module's formula; z may be zero, x and y not."""
    above, r = jnp.sqrt(x**2 + y**2), jnp.sqrt(x**2 + y**2 + z**2)
    further = z**2 / (r + above)
    logs = x * jnp.log1p(further / (y + above)) + y * jnp.log1p(further / (x + above))
    return logs - z * jnp.arctan2(x * y, z * r)


def _over_cells(grid: Grid, integral: Callable[[Array, Array], Array]) -> Array:
    """dx times the difference of F over a cell's corners at offsets (i, j) >= 0, (nx, ny)."""
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    x, y = jnp.arange(nx + 1) - 0.5, (jnp.arange(ny + 1) - 0.5) * (dy / dx)  # in units of dx
    corner = integral(x[:, None], y[None, :])
    return dx * (corner[1:, 1:] - corner[:-1, 1:] - corner[1:, :-1] + corner[:-1, :-1]) / (2.0 * jnp.pi)


def surface_coefficients(grid: Grid) -> Array:
    """Coefficients [m] of 1/alpha at offsets (i, j) >= 0, (nx, ny)."""
    return _over_cells(grid, _surface_integral)


def image_coefficients(grid: Grid, depth: Array) -> Array:
    """Coefficients [m] of (exp(-depth alpha) - 1)/alpha at offsets (i, j) >= 0, (nx, ny)."""
    z = depth / grid.spacing[0]
    return _over_cells(grid, lambda x, y: _image_integral(x, y, z))


def influence_coefficients(grid: Grid, images: Images) -> Array:
    """Coefficients [m/Pa] at offsets (i, j) >= 0, (..., nx, ny), for image weights (..., J)."""

    def add(total: Array, image: tuple[Array, Array]) -> tuple[Array, None]:
        depth, weight = image
        return total + weight[..., None, None] * image_coefficients(grid, depth), None

    start = images.weights[..., :1, None] * surface_coefficients(grid)
    return jax.lax.scan(add, start, (images.depths[1:], jnp.moveaxis(images.weights[..., 1:], -1, 0)))[0]
