"""Influence coefficients: the displacement at a cell due to a unit pressure on another.

An image at depth z (``response.influence.images``) has a closed form over a rectangular cell: with F(x, y; z) the
double integral of 1/(2 pi r), r^2 = x^2 + y^2 + z^2,

    F = (1/2 pi) [x asinh(y/sqrt(x^2 + z^2)) + y asinh(x/sqrt(y^2 + z^2)) - z atan(x y/(z r))],

the coefficient at an offset is the difference of F over the cell's four corners (z = 0: A. E. H. Love,
Phil. Trans. R. Soc. A 228 (1929) 377). This form is used for the last step of the staircase, which is unbounded. The
many other steps are sums of Gaussians (``response.influence.gaussians``), which are products of a factor for x and one
for y, so that the sum over all of them is a single product of two matrices.

The error is 1e-9 of the central coefficient for films up to ten times as stiff as their substrate, at any
thickness; that of the paper's refined grid (its Eqs. 7-10, ``reference.refined_grid``) is 0.2 to 2 %.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.inputs.grid import Grid
from jaxcontact.response.influence.gaussians import NEGLECTED, POINTS, over_cells
from jaxcontact.response.influence.images import Images, steps


def influence_coefficients(grid: Grid, images: Images) -> Array:
    """Return the coefficients [m/Pa] at offsets (i, j) >= 0, (..., nx, ny), for heights (..., J + 1)."""
    dx, dy = grid.spacing
    depths, aspect = images.depths / dx, dy / dx  # all in units of dx
    last = images.heights[..., -1, None, None] * _image_at(jnp.append(0.0, depths)[-1], grid.shape, aspect)
    if not depths.size:
        return last * dx
    return (last + _of_steps(images.heights[..., :-1], depths, grid.shape, aspect)) * dx


def _image_at(z: Array, shape: tuple[int, int], aspect: Array) -> Array:
    """Return the response of an image at depth z to a uniform pressure on a cell: F over the cell's corners, (nx, ny)."""
    x, y = (jnp.arange(shape[0]) + 0.5)[:, None], (jnp.arange(shape[1]) + 0.5)[None, :] * aspect
    r = jnp.sqrt(x**2 + y**2 + z**2)
    logs = x * _asinh(y / jnp.sqrt(x**2 + z**2)) + y * _asinh(x / jnp.sqrt(y**2 + z**2))
    corners = (logs - z * jnp.arctan2(x * y, z * r)) / (2.0 * jnp.pi)
    for axis in (0, 1):  # F is odd in x and in y
        corners = jnp.diff(corners, axis=axis, prepend=-jnp.take(corners, jnp.array([0]), axis))
    return corners


def _asinh(u: Array) -> Array:
    """Return asinh(u) for u >= 0, twice as fast as ``jnp.arcsinh``."""
    return jnp.log1p(u + u**2 / (1.0 + jnp.sqrt(1.0 + u**2)))


def _of_steps(heights: Array, depths: Array, shape: tuple[int, int], aspect: Array) -> Array:
    """Return the response of the bounded steps, heights (..., J), over cells, (..., nx, ny)."""
    low, high = NEGLECTED**2, jnp.maximum(1.0, (depths[-1] ** 2 / NEGLECTED) ** (2.0 / 3.0))
    v = jnp.linspace(jnp.log(low), jax.lax.stop_gradient(jnp.log(high)), POINTS)
    t = jnp.exp(v)
    weights = (
        heights @ steps(depths**2, 0.25 / t)[:, :-1].T * (v[1] - v[0]) / (4.0 * jnp.pi**1.5 * jnp.sqrt(t))
    )
    along_x, along_y = over_cells(shape[0], t), over_cells(shape[1], t, aspect)
    return (weights[..., None, :] * along_x) @ along_y.T
