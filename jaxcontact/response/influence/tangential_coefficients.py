"""Influence coefficients of tangential traction: displacement at a cell under a unit traction on another.

With the four functions of ``response.stack`` as sums of images exp(-z alpha)/alpha, each entry of the surface
response at the wavevector (m, n) is a sum of terms of five kinds, whose integrals over a rectangular cell are
closed forms. The coefficient at an offset is 1/(2 pi) times the difference over the cell's corners of

    m^2/alpha^3:   F_xx = x ln(y + r) - z [atan(y/x) - atan(y z/(x r))]
    m n/alpha^3:   F_xy = r - z ln(r + z)
    i m/alpha^2:   H_x  = x atan(y z/(x r)) - x atan(y/x) - y ln(r + z) - z ln(y + r)

r^2 = x^2 + y^2 + z^2; F_yy and H_y with x and y exchanged; F_xx + F_yy is the F of ``response.influence.coefficients``. For
z = 0 these are the integrals of V. Cerruti's solution and of the radial displacement in J. Boussinesq's (K. L.
Johnson, Contact Mechanics, 1985, sections 3.2 and 3.6). Terms of x or y alone drop out of the differences. As there,
F(z) - F(0) is taken in one, so that sums over images of a film much thinner than a cell keep their digits.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.grid import Grid


class Kinds(NamedTuple):
    """What belongs to m^2/alpha^3, n^2/alpha^3, m n/alpha^3, i m/alpha^2 and i n/alpha^2."""

    xx: Array
    yy: Array
    xy: Array
    x: Array
    y: Array


@pytree
class SurfaceKernels:
    """Coefficients at offsets (i, j) >= 0, (..., nx, ny).

    xx, yy, xy: displacement along the first per traction along the second, xy odd in both offsets; x and y:
    displacement along x (odd in it) and y per pressure; a traction along them moves the surface down by minus that.
    """

    xx: Array
    yy: Array
    xy: Array
    x: Array
    y: Array


def on_surface(x: Array, y: Array) -> Kinds:
    """2 pi times the integrals of the module's formulas at z = 0; x and y not zero."""
    r = jnp.sqrt(x**2 + y**2)
    return Kinds(
        xx=x * jnp.log(y + r),
        yy=y * jnp.log(x + r),
        xy=r,
        x=-x * jnp.arctan(y / x) - y * jnp.log(r),
        y=-y * jnp.arctan(x / y) - x * jnp.log(r),
    )


def of_image(x: Array, y: Array, z: Array) -> Kinds:
    """2 pi times what the integrals at depth z have beyond those at z = 0; z may be zero, x and y not.

    Multiples of z alone, which drop out of the differences over a cell, are left out, and what remains is written without
    cancellation, however deep the image lies.
    """
    above, r = jnp.sqrt(x**2 + y**2), jnp.sqrt(x**2 + y**2 + z**2)
    further, deep = z**2 / (r + above), jnp.where(z > 0.0, z, 1.0)
    excess = above**2 / (r + z)  # r - z
    angle_x, angle_y = jnp.arctan(y * z / (x * r)), jnp.arctan(x * z / (y * r))
    steeper_x = jnp.arctan(x * y * excess / (x**2 * r + y**2 * z))  # atan(y/x) - angle_x
    steeper_y = jnp.arctan(x * y * excess / (y**2 * r + x**2 * z))
    log_x, log_y = jnp.log1p((x + excess) / deep), jnp.log1p((y + excess) / deep)  # ln((x + r)/z)
    deeper = jnp.log1p((further + z) / above)  # ln((r + z)/r_0)
    return Kinds(
        xx=x * jnp.log1p(further / (y + above)) - z * steeper_x,
        yy=y * jnp.log1p(further / (x + above)) - z * steeper_y,
        xy=excess - above - z * jnp.log1p(excess / (2.0 * deep)),
        x=x * angle_x - y * deeper - z * log_y,
        y=y * angle_y - x * deeper - z * log_x,
    )


def over_cells(grid: Grid, integrals: Callable[[Array, Array], Kinds]) -> Kinds:
    """dx times the differences over a cell's corners at offsets (i, j) >= 0, each (nx, ny)."""
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    x, y = jnp.arange(nx + 1) - 0.5, (jnp.arange(ny + 1) - 0.5) * (dy / dx)  # in units of dx
    corners = integrals(x[:, None], y[None, :])
    difference = lambda f: f[1:, 1:] - f[:-1, 1:] - f[1:, :-1] + f[:-1, :-1]
    return Kinds(*(dx * difference(f) / (2.0 * jnp.pi) for f in corners))


@pytree
class TangentialImages:
    """Images of alpha (L, T, K): depths z_j [m], (J,), z_0 = 0 first; weights [1/Pa], (3, ..., J).

    The first weight is that of 1, the others those of exp(-z_j alpha) - 1.
    """

    depths: Array
    weights: Array


def tangential_coefficients(grid: Grid, images: TangentialImages) -> SurfaceKernels:
    """Coefficients [m/Pa] at offsets (i, j) >= 0, (..., nx, ny)."""

    def add(total: SurfaceKernels, image: tuple[Array, Array]) -> tuple[SurfaceKernels, None]:
        z = image[0] / grid.spacing[0]
        each = over_cells(grid, lambda x, y: of_image(x, y, z))
        return jax.tree.map(jnp.add, total, _weighted(each, image[1])), None

    start = _weighted(over_cells(grid, on_surface), images.weights[..., 0])
    others = images.depths[1:], jnp.moveaxis(images.weights[..., 1:], -1, 0)
    return jax.lax.scan(add, start, others)[0]


def _weighted(kinds: Kinds, weights: Array) -> SurfaceKernels:
    """The entries for weights of alpha (L, T, K), (3, ...)."""
    L, T, K = weights[..., None, None]
    return SurfaceKernels(
        xx=L * kinds.xx + T * kinds.yy,
        yy=L * kinds.yy + T * kinds.xx,
        xy=(L - T) * kinds.xy,
        x=K * kinds.x,
        y=K * kinds.y,
    )
