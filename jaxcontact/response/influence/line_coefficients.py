"""Influence coefficients in plane strain: the displacement at a strip due to a unit pressure on another.

The surface displacement of a line load on an image at depth z is -ln(r^2/d^2)/(2 pi), r^2 = x^2 + z^2, d a datum. In a
step of the staircase of ``response.influence.images``, from z down to Z, the datum cancels; integrated over x,

    F(z, Z) = [x ln(1 + (Z^2 - z^2)/(x^2 + z^2)) + 2 Z atan(x/Z) - 2 z atan(x/z)]/(2 pi),
    F(z)    = -[x ln((x^2 + z^2)/d^2) - 2 x + 2 z atan(x/z)]/(2 pi)            for the last, unbounded step,

and the coefficient is the difference of F over the strip's edges. The datum is the width of the grid (``grid``). Source
of the line load on a half-space: K. L. Johnson, Contact Mechanics (1985), section 2.3.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.inputs.grid import Grid
from jaxcontact.response.influence.images import Images


def _step_integral(x: Array, upper: Array, lower: Array) -> Array:
    """Return 2 pi F(z, Z) of the module's formula."""
    logarithm = x * jnp.log1p((lower - upper) * (lower + upper) / (x**2 + upper**2))
    return logarithm + 2.0 * (lower * jnp.arctan2(x, lower) - upper * jnp.arctan2(x, upper))


def _last_integral(x: Array, depth: Array, datum: float) -> Array:
    """Return 2 pi F(z) of the module's formula for the last step."""
    logarithm = x * jnp.log((x**2 + depth**2) / datum**2)
    return 2.0 * (x - depth * jnp.arctan2(x, depth)) - logarithm


def line_coefficients(grid: Grid, images: Images) -> Array:
    """Return the coefficients [m/Pa] at offsets i >= 0, (..., nx, 1), for heights (..., J + 1)."""
    edges = jnp.arange(grid.shape[0]) + 0.5  # all in units of dx

    def descend(carry: tuple[Array, Array], step: tuple[Array, Array]) -> tuple[tuple[Array, Array], None]:
        (total, upper), (height, lower) = carry, step
        return (total + height[..., None] * _step_integral(edges, upper, lower), lower), None

    heights, depths = jnp.moveaxis(images.heights, -1, 0), images.depths / grid.spacing[0]
    top = jnp.zeros((*heights.shape[1:], edges.size)), jnp.zeros(())
    (total, deepest), _ = jax.lax.scan(descend, top, (heights[:-1], depths))
    total = total + heights[-1][..., None] * _last_integral(edges, deepest, float(grid.shape[0]))
    strips = jnp.diff(total, axis=-1, prepend=-total[..., :1])
    return strips[..., None] * grid.spacing[0] / (2.0 * jnp.pi)
