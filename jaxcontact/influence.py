"""Influence coefficients: the displacement at a cell under a unit pressure on another.

A response alpha N(alpha) is written as a sum of real exponentials at fixed depths z_j,

    alpha N = A_s + sum_j w_j (exp(-z_j alpha) - 1),

where A_s is its value at alpha = 0. Each exponential is the response of a half-space seen at a depth z_j
(an "image"), and has a closed form over a rectangular cell: with F(x, y; z) the double integral of
1/(2 pi r), r^2 = x^2 + y^2 + z^2,

    F = (1/2 pi) [x ln(y + r) + y ln(x + r) - z atan(x y/(z r))],

the coefficient at an offset is the difference of F over the cell's four corners (z = 0: A. E. H. Love,
Phil. Trans. R. Soc. A 228 (1929) 377; terms of x or y alone drop out of the difference). For an image
F(z) - F(0) is taken in one, with r_0 = r(z = 0) and s = r - r_0 = z^2/(r + r_0),

    F(z) - F(0) = (1/2 pi) [x ln(1 + s/(y + r_0)) + y ln(1 + s/(x + r_0)) - z atan(x y/(z r))],

since in sums over images of a film much thinner than a cell all else cancels. The weights are a linear
least-squares fit, so the coefficients are differentiable in the response, and good to 1e-9
of the central one, whatever the film's thickness; the paper's refined grid (its Eqs. 7-10,
``reference.refined_grid``) has 0.2 to 2 %.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._pytree import pytree
from jaxcontact.grid import Grid

IMAGES = 40
NODES = np.geomspace(1e-5, 40.0, 400)
BEYOND = 1e5  # alpha h where every image has died away
CUTOFF = 1e-14


@pytree
class Images:
    """depths: z_j [m], (J,), z_0 = 0 first; weights: (..., J) [1/Pa], of 1 first, then of exp(-z_j alpha) - 1."""

    depths: Array
    weights: Array


def image_depths(stiffness_ratio: Array) -> Array:
    """z_j/h, (IMAGES,): from 1.2 to 30, or to 12 G for a film G > 2.5 times as stiff as its substrate."""
    reach = jnp.maximum(30.0, 12.0 * jax.lax.stop_gradient(stiffness_ratio))
    return 1.2 * (reach / 1.2) ** jnp.linspace(0.0, 1.0, IMAGES)


def fit_wavenumbers(thickness: Array | float) -> Array:
    """The wavenumbers [rad/m] at which a response is to be given to ``fit_images``, (n,)."""
    return jnp.append(NODES, BEYOND) / thickness


def quantised(ratio: Array) -> Array:
    """The power of two nearest to a ratio > 0, at most 1024, without derivative."""
    return jnp.exp2(jnp.round(jnp.log2(jnp.minimum(jax.lax.stop_gradient(ratio), 1024.0))))


def fit_images(
    values: Array, at_zero: Array, floor: Array | float, relative_depths: Array, thickness: Array | float
) -> Images:
    """Least-squares images of responses alpha N.

    values: alpha N at ``fit_wavenumbers``, (..., n) [any unit]; at_zero: its value at alpha = 0, (...);
    floor: at_zero over the limit of short waves, (), roughly: errors are relative to floor + x/(1 + x),
    x = alpha h; relative_depths: z_j/h, (J,).

    The matrix has no units and, with a quantised floor, does not follow the values: the images are
    linear in them, without noise in finite differences or between systems of units.
    """
    x = jnp.append(NODES, BEYOND)
    # the limit of short waves is held a thousand times closer than the rest
    rows = jnp.ones(x.size).at[-1].set(1e3) / (floor + x / (1.0 + x))
    exponent = jnp.minimum(x[:, None] * relative_depths, 700.0)
    matrix = jax.lax.stop_gradient(jnp.expm1(-exponent) * rows[:, None])
    u, s, vt = jnp.linalg.svd(matrix, full_matrices=False)
    target = (values - at_zero[..., None]) * rows
    weights = jnp.where(s > CUTOFF * s[0], 1.0 / s, 0.0) * (target @ u) @ vt
    depths = jnp.append(0.0, thickness * relative_depths)
    return Images(depths, jnp.concatenate([at_zero[..., None], weights], -1))


def half_space_images(compliance: Array) -> Images:
    """alpha N constant: one image on the surface. compliance: (...) [1/Pa]."""
    return Images(jnp.zeros(1), compliance[..., None])


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
