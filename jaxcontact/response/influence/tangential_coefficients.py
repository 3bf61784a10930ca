"""Influence coefficients of tangential traction: the displacement at a cell due to a unit traction on another.

With the four functions of ``response.stack`` as sums of images exp(-z alpha)/alpha, each entry of the surface
response at the wavevector (m, n) is a sum of terms of five kinds, whose integrals over a rectangular cell have
closed forms. The coefficient at an offset is 1/(2 pi) times the difference over the cell's corners of

    m^2/alpha^3:   F_xx = x ln(y + r) - z [atan(y/x) - atan(y z/(x r))]
    m n/alpha^3:   F_xy = r - z ln(r + z)
    i m/alpha^2:   H_x  = x atan(y z/(x r)) - x atan(y/x) - y ln(r + z) - z ln(y + r)

r^2 = x^2 + y^2 + z^2; F_yy and H_y with x and y exchanged; F_xx + F_yy is the F of ``response.influence.coefficients``.
For z = 0 these are the integrals of V. Cerruti's solution and of the radial displacement in J. Boussinesq's (K. L.
Johnson, Contact Mechanics, 1985, sections 3.2 and 3.6). Terms of x or y alone cancel in the differences. F(z) - F(0) is
evaluated as one expression, so that sums over images of a film much thinner than a cell do not suffer from cancellation.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.grid import Grid


class Kinds(NamedTuple):
    """The quantities for m^2/alpha^3, n^2/alpha^3, m n/alpha^3, i m/alpha^2 and i n/alpha^2."""

    xx: Array
    yy: Array
    xy: Array
    x: Array
    y: Array


@pytree
class SurfaceKernels:
    """Coefficients at offsets (i, j) >= 0, (..., nx, ny).

    xx, yy, xy: displacement along the first index per traction along the second, xy odd in both offsets; x and y:
    displacement along x (odd in it) and y per pressure; the normal displacement due to a traction along x or y is minus
    that.
    """

    xx: Array
    yy: Array
    xy: Array
    x: Array
    y: Array


def on_surface(x: Array, y: Array) -> Kinds:
    """Return 2 pi times the integrals of the module's formulas at z = 0; x and y not zero."""
    r = jnp.sqrt(x**2 + y**2)
    return Kinds(
        xx=x * jnp.log(y + r),
        yy=y * jnp.log(x + r),
        xy=r,
        x=-x * jnp.arctan(y / x) - y * jnp.log(r),
        y=-y * jnp.arctan(x / y) - x * jnp.log(r),
    )


def of_image(x: Array, y: Array, z: Array) -> Kinds:
    """Return 2 pi times the differences of the integrals at depth z from those at z = 0; z may be zero, x and y not.

    Multiples of z alone, which cancel in the differences over a cell, are omitted, and the remainder is written without
    cancellation, for images at any depth. At the surface the logarithms of z, which cancel likewise, are left out, so that
    the derivative by z is there as well.
    """
    rho, r = jnp.sqrt(x**2 + y**2), jnp.sqrt(x**2 + y**2 + z**2)
    r_less_rho, safe_z = z**2 / (r + rho), jnp.where(z > 0.0, z, 1.0)
    r_less_z = rho**2 / (r + z)
    angle_x, angle_y = jnp.arctan(y * z / (x * r)), jnp.arctan(x * z / (y * r))
    difference_x = jnp.arctan(x * y * r_less_z / (x**2 * r + y**2 * z))  # atan(y/x) - angle_x
    difference_y = jnp.arctan(x * y * r_less_z / (y**2 * r + x**2 * z))
    lifted = (
        z - safe_z
    )  # zero, but at the surface, where it makes ln(x + r) of the first and ln(y + r) of the second
    log_x = jnp.log1p((x + r_less_z + lifted) / safe_z)  # ln((x + r)/z)
    log_y = jnp.log1p((y + r_less_z + lifted) / safe_z)
    log_ratio = jnp.log1p((r_less_rho + z) / rho)  # ln((r + z)/rho)
    return Kinds(
        xx=x * jnp.log1p(r_less_rho / (y + rho)) - z * difference_x,
        yy=y * jnp.log1p(r_less_rho / (x + rho)) - z * difference_y,
        xy=r_less_z - rho - z * jnp.log1p((r_less_z + 2.0 * lifted) / (2.0 * safe_z)),
        x=x * angle_x - y * log_ratio - z * log_y,
        y=y * angle_y - x * log_ratio - z * log_x,
    )


def over_cells(grid: Grid, integrals: Callable[[Array, Array], Kinds]) -> Kinds:
    """Return dx times the differences over a cell's corners at offsets (i, j) >= 0, each (nx, ny)."""
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    x, y = jnp.arange(nx + 1) - 0.5, (jnp.arange(ny + 1) - 0.5) * (dy / dx)  # in units of dx
    corners = integrals(x[:, None], y[None, :])
    difference = lambda f: f[1:, 1:] - f[:-1, 1:] - f[1:, :-1] + f[:-1, :-1]
    return Kinds(*(dx * difference(f) / (2.0 * jnp.pi) for f in corners))


@pytree
class TangentialImages:
    """Images of alpha (L, T, K): depths z_j [m], (J,), z_0 = 0 first; weights [1/Pa], (3, ..., J).

    The first weight multiplies 1, the others exp(-z_j alpha) - 1.
    """

    depths: Array
    weights: Array


def tangential_coefficients(grid: Grid, images: TangentialImages) -> SurfaceKernels:
    """Return the coefficients [m/Pa] at offsets (i, j) >= 0, (..., nx, ny)."""

    def add(total: SurfaceKernels, image: tuple[Array, Array]) -> tuple[SurfaceKernels, None]:
        z = image[0] / grid.spacing[0]
        each = over_cells(grid, lambda x, y: of_image(x, y, z))
        return jax.tree.map(jnp.add, total, _weighted(each, image[1])), None

    start = _weighted(over_cells(grid, on_surface), images.weights[..., 0])
    others = images.depths[1:], jnp.moveaxis(images.weights[..., 1:], -1, 0)
    return jax.lax.scan(add, start, others)[0]


def _weighted(kinds: Kinds, weights: Array) -> SurfaceKernels:
    """Return the entries for weights of alpha (L, T, K), (3, ...)."""
    L, T, K = weights[..., None, None]
    return SurfaceKernels(
        xx=L * kinds.xx + T * kinds.yy,
        yy=L * kinds.yy + T * kinds.xx,
        xy=(L - T) * kinds.xy,
        x=K * kinds.x,
        y=K * kinds.y,
    )
