"""Influence coefficients of tangential traction in plane strain: the displacement of a strip due to a unit traction on
another.

A traction along x causes displacements along x and z, one along y only along y (anti-plane shear). The images of
``response.influence.tangential_coefficients`` at depth z have the integrals over x, times 2 pi,

    1/alpha:       F(z) = -x ln((x^2 + z^2)/d^2) + 2 x - 2 z atan(x/z)
    i m/alpha^2:   H(z) = -2 x atan(x/z) + z ln(1 + x^2/z^2)

the first with alpha L for xx and with alpha T for yy, the second, which is odd in the offset, with alpha K. The
coefficient is the difference over the strip's edges; F(z) - F(0) and H(z) - H(0) are each evaluated as one expression. At
z = 0 a unit pressure displaces all points on one side of it tangentially by the same H' = -pi, whatever the distance.
Displacement is relative to that of the surface at the distance d, one width of the grid, from a line load on a half-space
(``grid``); the datum d applies to the displacements along x due to tractions along x and along y due to those along y,
and not to the coupling terms. Source of the line loads on a half-space: K. L. Johnson, Contact Mechanics (1985),
sections 2.3 and 2.4.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.inputs.grid import Grid
from jaxcontact.response.influence.tangential_coefficients import SurfaceKernels, TangentialImages


def _on_surface(x: Array, datum: float) -> tuple[Array, Array]:
    """Return F and H of the module's formulas at z = 0, x > 0."""
    return 2.0 * x - 2.0 * x * jnp.log(x / datum), -jnp.pi * x


def _of_image(x: Array, z: Array) -> tuple[Array, Array]:
    """Return the differences F(z) - F(0) and H(z) - H(0) at depth z > 0."""
    even = -x * jnp.log1p((z / x) ** 2) - 2.0 * z * jnp.arctan2(x, z)
    return even, 2.0 * x * jnp.arctan2(z, x) + z * jnp.log1p((x / z) ** 2)


def _strips(kinds: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return the differences over a strip's edges from the values at positive ones: F is odd in x, H even."""
    f, h = kinds
    return jnp.diff(f, prepend=-f[:1]), jnp.diff(h, prepend=h[:1])


def tangential_lines(grid: Grid, images: TangentialImages) -> SurfaceKernels:
    """Return the coefficients [m/Pa] at offsets i >= 0, (..., nx, 1), as ``tangential_coefficients``; xy and y are zero."""
    edges = jnp.arange(grid.shape[0]) + 0.5  # in units of dx

    def weighted(kinds: tuple[Array, Array], weights: Array) -> Array:
        even, odd = _strips(kinds)
        L, T, K = weights[..., None]
        return jnp.stack([L * even, T * even, K * odd])

    def add(total: Array, image: tuple[Array, Array]) -> tuple[Array, None]:
        return total + weighted(_of_image(edges, image[0] / grid.spacing[0]), image[1]), None

    start = weighted(_on_surface(edges, float(grid.shape[0])), images.weights[..., 0])
    others = images.depths[1:], jnp.moveaxis(images.weights[..., 1:], -1, 0)
    total = jax.lax.scan(add, start, others)[0]
    xx, yy, x = total[..., None] * grid.spacing[0] / (2.0 * jnp.pi)
    zero = jnp.zeros_like(xx)
    return SurfaceKernels(xx=xx, yy=yy, xy=zero, x=x, y=zero)
