"""Influence coefficients for a grid that is periodic along one axis and free along the other.

Along the periodic axis, say y, pressure is the sum of its waves k (``response.influence.periodic``), and along x it
is constant over each cell. The response of an image at depth z (``response.influence.images``) to such a wave is

    K0(k sqrt(x^2 + z^2))/pi = 1/(2 pi) int_{-inf}^{inf} exp(-k^2 t - (x^2 + z^2)/(4 t)) dv,      t = exp(v),

a product of factors for the wave, the depth and the position (``response.influence.gaussians``). The mean along y, k = 0,
is plane strain (``response.influence.line_coefficients``). Source of the integral: NIST Digital Library of Mathematical
Functions, 10.32.10.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import replace
from jaxcontact.inputs.grid import Grid
from jaxcontact.response.influence.gaussians import NEGLECTED, POINTS, over_cells
from jaxcontact.response.influence.images import Images
from jaxcontact.response.influence.line_coefficients import line_coefficients

DECAYED = 36.0  # the exponent beyond which a wave is negligible


def strip_coefficients(grid: Grid, images: Images) -> Array:
    """Return the coefficients [m/Pa] at offsets >= 0 along the free axis and over a full period along the other, (...,
    nx, ny).
    """
    if grid.periodic[0]:
        turned = replace(
            grid, shape=grid.shape[::-1], spacing=grid.spacing[::-1], periodic=grid.periodic[::-1]
        )
        return jnp.swapaxes(strip_coefficients(turned, images), -1, -2)
    rows = jnp.concatenate([line_coefficients(grid, images), _of_waves(grid, images)], -1)
    return jnp.fft.irfft(rows, n=grid.shape[1], axis=-1)


def _of_waves(grid: Grid, images: Images) -> Array:
    """Return the coefficients of all waves except the mean, (..., nx, ny/2)."""
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    k = 2.0 * jnp.pi * jnp.fft.rfftfreq(ny)[1:] * dx / dy  # all in units of dx
    longest, shortest = 2.0 * jnp.pi * dx / (ny * dy), jnp.pi * dx / dy
    ends = 2.0 * jnp.log(NEGLECTED / (1.0 + shortest)), jnp.log(DECAYED / longest**2)
    v = jnp.linspace(*jax.lax.stop_gradient(ends), POINTS)
    t = jnp.exp(v)
    weights = Images((images.depths / dx) ** 2, images.heights).at(0.25 / t) * (v[1] - v[0])
    over_waves = jnp.exp(-(k**2) * t[:, None])
    return (weights[..., None, :] * over_cells(nx, t)) @ over_waves * (dx / (2.0 * jnp.pi))
