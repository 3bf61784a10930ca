"""The response of images at the wavevectors of a periodic grid, which needs no influence coefficients.

With the heights H_j and depths z_j of ``response.influence.images``,

    N(k) = sum_j H_j (exp(-z_j |k|) - exp(-z_{j+1} |k|))/|k|,      z_0 = 0, z_{J+1} = infinity,

at the wavenumbers of the discrete Fourier transform of the grid, the highest included. There is no factor for the
shape of a cell: pressure is the trigonometric polynomial through its values, whose waves have the response of the
solid itself. For a body N(0) is infinite, and is set to zero: displacement is relative to the mean
(H. M. Stanley, T. Kato, J. Tribol. 119 (1997) 481).
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.inputs.grid import Grid
from jaxcontact.response.influence.images import Images


def wavenumbers(grid: Grid) -> Array:
    """Return |k| of the grid's waves [rad/m], (ny/2 + 1, nx)."""
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    along_x, along_y = jnp.fft.fftfreq(nx) / dx, jnp.fft.rfftfreq(ny) / dy
    square = (along_x**2 + along_y[:, None] ** 2).at[0, 0].set(1.0)
    return 2.0 * jnp.pi * jnp.sqrt(square).at[0, 0].set(0.0)


def periodic_response(grid: Grid, images: Images) -> Array:
    """Return N(k) [m/Pa] for heights (..., J + 1), zero at k = 0, (..., ny/2 + 1, nx)."""
    k = wavenumbers(grid)
    safe = k.at[0, 0].set(1.0)

    def descend(carry: tuple[Array, Array], step: tuple[Array, Array]) -> tuple[tuple[Array, Array], None]:
        (total, upper), (height, thickness) = carry, step
        within = upper * -jnp.expm1(-safe * thickness)
        return (total + height[..., None, None] * within, upper - within), None

    heights = jnp.moveaxis(images.heights, -1, 0)
    top = jnp.zeros((*heights.shape[1:], *k.shape)), jnp.ones_like(k)
    (total, deepest), _ = jax.lax.scan(descend, top, (heights[:-1], _thicknesses(images)))
    total = total + heights[-1][..., None, None] * deepest
    return (total / safe).at[..., 0, 0].set(0.0)


def periodic_coefficients(grid: Grid, images: Images) -> Array:
    """Return the displacement [m/Pa] at offsets (i, j) >= 0 under a unit pressure on one cell in each period, (..., nx,
    ny).

    This holds for a film on a rigid base, whose last height is zero: N(0) is its shortening under a uniform pressure.
    """
    nx, ny = grid.shape
    spectrum = jnp.swapaxes(periodic_response(grid, images), -1, -2)
    mean = images.heights[..., :-1] @ _thicknesses(images)
    return jnp.fft.irfft2(spectrum.at[..., 0, 0].set(mean), s=(nx, ny))


def _thicknesses(images: Images) -> Array:
    """Return z_{j+1} - z_j, (J,)."""
    return jnp.diff(images.depths, prepend=0.0)
