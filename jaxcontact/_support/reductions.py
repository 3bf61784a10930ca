"""Sums and largest values over a grid at a fraction of the usual time on a CPU.

XLA reduces a field on a CPU in windows of 32 x 32 cells, element by element. Two forms escape this: a product with a vector
of ones, into which the computation of the summands is fused, and a reduction of two fields together (measured at 192 x 192
in a program on one core: 29 us for a usual sum, besides its summands; 8 us for a product with ones).
"""

import jax
import jax.numpy as jnp
from jax import Array

NARROW = 32  # cells: on narrower fields the usual sum takes no longer


def total(field: Array) -> Array:
    """Return the sum of a field (nx, ny) of numbers or of conditions, (); differentiable."""
    field = field.astype(float)
    return jnp.sum(field if field.shape[-1] < NARROW else field @ jnp.ones(field.shape[-1]))


def totals(*fields: Array) -> tuple[Array, ...]:
    """Return the sums of several fields, () each; without derivative."""
    return tuple(total(jax.lax.stop_gradient(field)) for field in fields)


def largest(field: Array) -> Array:
    """Return the largest value of a field of numbers, (); without derivative."""
    field = jax.lax.stop_gradient(field)
    limit, axes = jnp.asarray(-jnp.inf), tuple(range(field.ndim))
    extremes = lambda one, other: (jnp.maximum(one[0], other[0]), jnp.minimum(one[1], other[1]))
    return jax.lax.reduce((field, -field), (limit, -limit), extremes, axes)[0]
