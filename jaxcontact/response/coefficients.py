"""Influence coefficients: the displacement at a cell due to a unit pressure on another.

An image at depth z (``response.images``) has a closed form over a rectangular cell, since exp(-z alpha)/alpha is the
transform of 1/(2 pi r): with F(x, y; z) the double integral of 1/(2 pi r), r^2 = x^2 + y^2 + z^2,

    F = (1/2 pi) [x asinh(y/sqrt(x^2 + z^2)) + y asinh(x/sqrt(y^2 + z^2)) - z atan(x y/(z r))],

the coefficient at an offset is the difference of F over the cell's four corners (z = 0: A. E. H. Love,
Phil. Trans. R. Soc. A 228 (1929) 377). This form is used for the last step of the staircase, which is unbounded. The
many other steps are sums of Gaussians (``response.images``), which are products of a factor for x and one
for y, so that the sum over all of them is a single product of two matrices.

The error is 1e-9 of the central coefficient for films up to ten times as stiff as their substrate, at any
thickness; that of the paper's refined grid (its Eqs. 7-10, ``reference.refined_grid``) is 0.2 to 2 %.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace
from jaxcontact.bodies.grid import Grid
from jaxcontact.response.images import NEGLECTED, POINTS, Images, over_cells, staircase


def influence_coefficients(grid: Grid, images: Images) -> Array:
    """Return the coefficients [m/Pa] at offsets (i, j) >= 0, (..., nx, ny), for heights (..., J + 1)."""
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    depths, aspect = images.depths / dx, dy / dx  # all in units of dx
    # asinh(u) for u >= 0, twice as fast as ``jnp.arcsinh``
    asinh = lambda u: jnp.log1p(u + u**2 / (1.0 + jnp.sqrt(1.0 + u**2)))

    # The last step of the staircase: F over the corners of the cells, in x and in y odd.
    z = jnp.append(0.0, depths)[-1]
    x, y = (jnp.arange(nx) + 0.5)[:, None], (jnp.arange(ny) + 0.5)[None, :] * aspect
    r = jnp.sqrt(x**2 + y**2 + z**2)
    logs = x * asinh(y / jnp.sqrt(x**2 + z**2)) + y * asinh(x / jnp.sqrt(y**2 + z**2))
    F = (logs - z * jnp.arctan2(x * y, z * r)) / (2.0 * jnp.pi)
    for axis in (0, 1):
        F = jnp.diff(F, axis=axis, prepend=-jnp.take(F, jnp.array([0]), axis))
    last = images.heights[..., -1, None, None] * F
    if not depths.size:
        return last * dx

    # The other steps, which are bounded: sums over t = exp(v) of Gaussians (``response.images``), from lengths sqrt(t) far
    # below a cell to where the terms are negligible: those of two images differ by z_J^2/(4 t) at most, over sqrt(t).
    low, high = NEGLECTED**2, jnp.maximum(1.0, (depths[-1] ** 2 / NEGLECTED) ** (2.0 / 3.0))
    v = jnp.linspace(jnp.log(low), jax.lax.stop_gradient(jnp.log(high)), POINTS)
    t = jnp.exp(v)
    # in t a step is exp(-z_j^2/(4 t)) - exp(-z_(j+1)^2/(4 t)): the staircase for depths z_j^2 and wavenumbers 1/(4 t)
    of_steps = images.heights[..., :-1] @ staircase(depths**2, 0.25 / t)[:, :-1].T
    weights = of_steps * (v[1] - v[0]) / (4.0 * jnp.pi**1.5 * jnp.sqrt(t))
    along_x, along_y = over_cells(nx, t), over_cells(ny, t, aspect)
    return (last + (weights[..., None, :] * along_x) @ along_y.T) * dx


# Influence coefficients in plane strain: the displacement at a strip due to a unit pressure on another.
#
# The surface displacement of a line load on an image at depth z is -ln(r^2/d^2)/(2 pi), r^2 = x^2 + z^2, d a datum.
# In a step of the staircase of ``response.images``, from z down to Z, the datum cancels; integrated over x,
#
#     F(z, Z) = [x ln(1 + (Z^2 - z^2)/(x^2 + z^2)) + 2 Z atan(x/Z) - 2 z atan(x/z)]/(2 pi),
#     F(z)    = -[x ln((x^2 + z^2)/d^2) - 2 x + 2 z atan(x/z)]/(2 pi)            for the last, unbounded step,
#
# and the coefficient is the difference of F over the strip's edges. The datum is the width of the grid (``grid``).
# Source of the line load on a half-space: K. L. Johnson, Contact Mechanics (1985), section 2.3.


def line_coefficients(grid: Grid, images: Images) -> Array:
    """Return the coefficients [m/Pa] at offsets i >= 0, (..., nx, 1), for heights (..., J + 1)."""
    x, datum = jnp.arange(grid.shape[0]) + 0.5, float(grid.shape[0])  # the edges; all in units of dx

    def descend(carry: tuple[Array, Array], stair: tuple[Array, Array]) -> tuple[tuple[Array, Array], None]:
        (total, z), (height, Z) = carry, stair
        logarithm = x * jnp.log1p((Z - z) * (Z + z) / (x**2 + z**2))
        F = logarithm + 2.0 * (Z * jnp.arctan2(x, Z) - z * jnp.arctan2(x, z))  # 2 pi F(z, Z)
        return (total + height[..., None] * F, Z), None

    heights, depths = jnp.moveaxis(images.heights, -1, 0), images.depths / grid.spacing[0]
    top = jnp.zeros((*heights.shape[1:], x.size)), jnp.zeros(())
    (total, z), _ = jax.lax.scan(descend, top, (heights[:-1], depths))
    F = 2.0 * (x - z * jnp.arctan2(x, z)) - x * jnp.log((x**2 + z**2) / datum**2)  # 2 pi F(z)
    total = total + heights[-1][..., None] * F
    strips = jnp.diff(total, axis=-1, prepend=-total[..., :1])
    return strips[..., None] * grid.spacing[0] / (2.0 * jnp.pi)


# Influence coefficients for a grid that is periodic along one axis and free along the other.
#
# Along the periodic axis, say y, pressure is the sum of its waves k, and along x it is
# constant over each cell. The response of an image at depth z (``response.images``) to such a wave is
#
#     K0(k sqrt(x^2 + z^2))/pi = 1/(2 pi) int_{-inf}^{inf} exp(-k^2 t - (x^2 + z^2)/(4 t)) dv,      t = exp(v),
#
# a product of factors for the wave, the depth and the position (``response.images``). The mean along y,
# k = 0, is plane strain (``line_coefficients``). Source of the integral: NIST Digital Library of
# Mathematical Functions, 10.32.10.


DECAYED = 36.0  # waves of a larger exponent are negligible


def strip_coefficients(grid: Grid, images: Images) -> Array:
    """Return the coefficients [m/Pa] at offsets >= 0 along the free axis and over a full period along the other, (...,
    nx, ny).
    """
    if grid.periodic[0]:
        turned = replace(
            grid, shape=grid.shape[::-1], spacing=grid.spacing[::-1], periodic=grid.periodic[::-1]
        )
        return jnp.swapaxes(strip_coefficients(turned, images), -1, -2)
    # The waves along y except the mean, in units of dx: sums over t = exp(v) of the formula above.
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    k = 2.0 * jnp.pi * jnp.fft.rfftfreq(ny)[1:] * dx / dy
    longest, shortest = 2.0 * jnp.pi * dx / (ny * dy), jnp.pi * dx / dy
    ends = 2.0 * jnp.log(NEGLECTED / (1.0 + shortest)), jnp.log(DECAYED / longest**2)
    v = jnp.linspace(*jax.lax.stop_gradient(ends), POINTS)
    t = jnp.exp(v)
    weights = Images((images.depths / dx) ** 2, images.heights).at(0.25 / t) * (v[1] - v[0])
    decays = jnp.exp(-(k**2) * t[:, None])
    waves = (weights[..., None, :] * over_cells(nx, t)) @ decays * (dx / (2.0 * jnp.pi))

    # The mean along y is plane strain.
    rows = jnp.concatenate([line_coefficients(grid, images), waves], -1)
    return jnp.fft.irfft(rows, n=ny, axis=-1)


# The response of images at the wavevectors of a periodic grid, which needs no influence coefficients.
#
# With the heights H_j and depths z_j of ``response.images``,
#
#     N(k) = sum_j H_j (exp(-z_j |k|) - exp(-z_{j+1} |k|))/|k|,      z_0 = 0, z_{J+1} = infinity,
#
# at the wavenumbers of the discrete Fourier transform of the grid, the highest included. There is no factor for the
# shape of a cell: pressure is the trigonometric polynomial through its values, whose waves have the response of the
# solid itself. For a body N(0) is infinite, and is set to zero: displacement is relative to the mean
# (H. M. Stanley, T. Kato, J. Tribol. 119 (1997) 481). On a rigid base it is the shortening under a uniform pressure.


def wavenumbers(grid: Grid) -> Array:
    """Return |k| of the grid's waves [rad/m], (ny/2 + 1, nx)."""
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    along_x, along_y = jnp.fft.fftfreq(nx) / dx, jnp.fft.rfftfreq(ny) / dy
    square = (along_x**2 + along_y[:, None] ** 2).at[0, 0].set(1.0)
    return 2.0 * jnp.pi * jnp.sqrt(square).at[0, 0].set(0.0)


def periodic_response(grid: Grid, images: Images, mean: Array | float = 0.0) -> Array:
    """Return N(k) [m/Pa] for heights (..., J + 1), (..., ny/2 + 1, nx); mean: at k = 0, (...)."""
    k = wavenumbers(grid)
    safe = k.at[0, 0].set(1.0)

    def descend(carry: tuple[Array, Array], stair: tuple[Array, Array]) -> tuple[tuple[Array, Array], None]:
        (total, upper), (height, thickness) = carry, stair
        within = upper * -jnp.expm1(-safe * thickness)
        return (total + height[..., None, None] * within, upper - within), None

    heights = jnp.moveaxis(images.heights, -1, 0)
    top = jnp.zeros((*heights.shape[1:], *k.shape)), jnp.ones_like(k)
    (total, deepest), _ = jax.lax.scan(descend, top, (heights[:-1], _thicknesses(images)))
    total = total + heights[-1][..., None, None] * deepest
    return (total / safe).at[..., 0, 0].set(mean)


def periodic_coefficients(grid: Grid, images: Images, mean: Array | None = None) -> Array:
    """Return the displacement [m/Pa] at offsets (i, j) >= 0 under a unit pressure on one cell in each period, (..., nx,
    ny).

    This holds for a film on a rigid base, whose last height is zero: N(0) is its shortening under a uniform pressure,
    ``mean``, or by default the limit of the images.
    """
    nx, ny = grid.shape
    transform = jnp.swapaxes(periodic_response(grid, images), -1, -2)
    mean = images.heights[..., :-1] @ _thicknesses(images) if mean is None else mean
    return jnp.fft.irfft2(transform.at[..., 0, 0].set(mean), s=(nx, ny))


def _thicknesses(images: Images) -> Array:
    """Return z_{j+1} - z_j, (J,)."""
    return jnp.diff(images.depths, prepend=0.0)


# Influence coefficients of tangential traction: the displacement at a cell due to a unit traction on another.
#
# With the four functions of ``response.stack`` as sums of images exp(-z alpha)/alpha, each entry of the surface
# response at the wavevector (m, n) is a sum of terms of five kinds, whose integrals over a rectangular cell have
# closed forms. The coefficient at an offset is 1/(2 pi) times the difference over the cell's corners of
#
#     m^2/alpha^3:   F_xx = x ln(y + r) - z [atan(y/x) - atan(y z/(x r))]
#     m n/alpha^3:   F_xy = r - z ln(r + z)
#     i m/alpha^2:   H_x  = x atan(y z/(x r)) - x atan(y/x) - y ln(r + z) - z ln(y + r)
#
# r^2 = x^2 + y^2 + z^2; F_yy and H_y with x and y exchanged; F_xx + F_yy is the F of
# ``influence_coefficients``. For z = 0 these are the integrals of V. Cerruti's solution and of the radial
# displacement in J. Boussinesq's (K. L. Johnson, Contact Mechanics, 1985, sections 3.2 and 3.6). Terms of x or y
# alone cancel in the differences. F(z) - F(0) is evaluated as one expression, so that sums over images of a film much
# thinner than a cell do not suffer from cancellation.


class SurfaceKernels(NamedTuple):
    """Coefficients at offsets (i, j) >= 0, (..., nx, ny), or the integrals for m^2/alpha^3, n^2/alpha^3, m n/alpha^3,
    i m/alpha^2 and i n/alpha^2 that they consist of.

    xx, yy, xy: displacement along the first index per traction along the second, xy odd in both offsets; x and y:
    displacement along x (odd in it) and y per pressure; the normal displacement due to a traction along x or y is minus
    that.
    """

    xx: Array
    yy: Array
    xy: Array
    x: Array
    y: Array


def on_surface(x: Array, y: Array) -> SurfaceKernels:
    """Return 2 pi times the integrals of the formulas above at z = 0; x and y not zero."""
    r = jnp.sqrt(x**2 + y**2)
    return SurfaceKernels(
        xx=x * jnp.log(y + r),
        yy=y * jnp.log(x + r),
        xy=r,
        x=-x * jnp.arctan(y / x) - y * jnp.log(r),
        y=-y * jnp.arctan(x / y) - x * jnp.log(r),
    )


def of_image(x: Array, y: Array, z: Array) -> SurfaceKernels:
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
    # zero, but at the surface, where it makes ln(x + r) of the first and ln(y + r) of the second
    lifted = z - safe_z
    log_x = jnp.log1p((x + r_less_z + lifted) / safe_z)  # ln((x + r)/z)
    log_y = jnp.log1p((y + r_less_z + lifted) / safe_z)
    log_ratio = jnp.log1p((r_less_rho + z) / rho)  # ln((r + z)/rho)
    return SurfaceKernels(
        xx=x * jnp.log1p(r_less_rho / (y + rho)) - z * difference_x,
        yy=y * jnp.log1p(r_less_rho / (x + rho)) - z * difference_y,
        xy=r_less_z - rho - z * jnp.log1p((r_less_z + 2.0 * lifted) / (2.0 * safe_z)),
        x=x * angle_x - y * log_ratio - z * log_y,
        y=y * angle_y - x * log_ratio - z * log_x,
    )


def tangential_over_cells(grid: Grid, integrals: Callable[[Array, Array], SurfaceKernels]) -> SurfaceKernels:
    """Return dx times the differences over a cell's corners at offsets (i, j) >= 0, each (nx, ny)."""
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    x, y = jnp.arange(nx + 1) - 0.5, (jnp.arange(ny + 1) - 0.5) * (dy / dx)  # in units of dx
    corners = integrals(x[:, None], y[None, :])
    difference = lambda f: f[1:, 1:] - f[:-1, 1:] - f[1:, :-1] + f[:-1, :-1]
    return SurfaceKernels(*(dx * difference(f) / (2.0 * jnp.pi) for f in corners))


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
        each = tangential_over_cells(grid, lambda x, y: of_image(x, y, z))
        return jax.tree.map(jnp.add, total, _weighted(each, image[1])), None

    start = _weighted(tangential_over_cells(grid, on_surface), images.weights[..., 0])
    others = images.depths[1:], jnp.moveaxis(images.weights[..., 1:], -1, 0)
    return jax.lax.scan(add, start, others)[0]


def _weighted(kinds: SurfaceKernels, weights: Array) -> SurfaceKernels:
    """Return the entries for weights of alpha (L, T, K), (3, ...)."""
    L, T, K = weights[..., None, None]
    return SurfaceKernels(
        xx=L * kinds.xx + T * kinds.yy,
        yy=L * kinds.yy + T * kinds.xx,
        xy=(L - T) * kinds.xy,
        x=K * kinds.x,
        y=K * kinds.y,
    )


# Influence coefficients of tangential traction in plane strain: the displacement of a strip due to a unit traction on
# another.
#
# A traction along x causes displacements along x and z, one along y only along y (anti-plane shear). The images of
# ``tangential_coefficients`` at depth z have the integrals over x, times 2 pi,
#
#     1/alpha:       F(z) = -x ln((x^2 + z^2)/d^2) + 2 x - 2 z atan(x/z)
#     i m/alpha^2:   H(z) = -2 x atan(x/z) + z ln(1 + x^2/z^2)
#
# the first with alpha L for xx and with alpha T for yy, the second, which is odd in the offset, with alpha K. The
# coefficient is the difference over the strip's edges; F(z) - F(0) and H(z) - H(0) are each evaluated as one
# expression. At z = 0 a unit pressure displaces all points on one side of it tangentially by the same H' = -pi,
# whatever the distance. Displacement is relative to that of the surface at the distance d, one width of the grid,
# from a line load on a half-space (``grid``); the datum d applies to the displacements along x due to tractions along
# x and along y due to those along y, and not to the coupling terms. Source of the line loads on a half-space: K. L.
# Johnson, Contact Mechanics (1985), sections 2.3 and 2.4.


def tangential_lines(grid: Grid, images: TangentialImages) -> SurfaceKernels:
    """Return the coefficients [m/Pa] at offsets i >= 0, (..., nx, 1), as ``tangential_coefficients``; xy and y are zero."""
    x, datum = jnp.arange(grid.shape[0]) + 0.5, float(grid.shape[0])  # positive edges; in units of dx

    def weighted(F: Array, H: Array, weights: Array) -> Array:
        even, odd = jnp.diff(F, prepend=-F[:1]), jnp.diff(H, prepend=H[:1])  # F is odd in x, H even
        L, T, K = weights[..., None]
        return jnp.stack([L * even, T * even, K * odd])

    def add(total: Array, image: tuple[Array, Array]) -> tuple[Array, None]:
        # F(z) - F(0) and H(z) - H(0) at a depth z > 0
        z = image[0] / grid.spacing[0]
        F = -x * jnp.log1p((z / x) ** 2) - 2.0 * z * jnp.arctan2(x, z)
        H = 2.0 * x * jnp.arctan2(z, x) + z * jnp.log1p((x / z) ** 2)
        return total + weighted(F, H, image[1]), None

    # F(0) and H(0)
    start = weighted(2.0 * x - 2.0 * x * jnp.log(x / datum), -jnp.pi * x, images.weights[..., 0])
    others = images.depths[1:], jnp.moveaxis(images.weights[..., 1:], -1, 0)
    total = jax.lax.scan(add, start, others)[0]
    xx, yy, x = total[..., None] * grid.spacing[0] / (2.0 * jnp.pi)
    zero = jnp.zeros_like(xx)
    return SurfaceKernels(xx=xx, yy=yy, xy=zero, x=x, y=zero)
