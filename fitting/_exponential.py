"""Integrals of the exponential, for memories under a history that is linear between samples.

    phi1(z) = int_0^1 exp(-z s) ds = (1 - exp(-z))/z
    phi2(z) = int_0^1 (1 - s) exp(-z s) ds = (1 - phi1(z))/z

For z >= 0 of any shape, with derivatives; both within 1e-14 of their value.
"""

import math

import jax.numpy as jnp
from jax import Array

SERIES = 0.1  # below it the differences cancel, and the terms up to z^11 leave 1e-19


def phi1(z: Array) -> Array:
    """(1 - exp(-z))/z, 1 at 0."""
    return jnp.where(z < SERIES, _series(z, 1), -jnp.expm1(-z) / _off_zero(z))


def phi2(z: Array) -> Array:
    """(z - 1 + exp(-z))/z^2, 1/2 at 0."""
    return jnp.where(z < SERIES, _series(z, 2), (1.0 + jnp.expm1(-z) / _off_zero(z)) / _off_zero(z))


def _off_zero(z: Array) -> Array:
    """z where the closed form is taken; a where alone would leave nan in the derivative."""
    return jnp.where(z < SERIES, 1.0, z)


def _series(z: Array, order: int) -> Array:
    """sum_k (-z)^k/(k + order)!."""
    total = jnp.zeros_like(z)
    for k in reversed(range(12)):
        total = 1.0 / math.factorial(k + order) - z * total
    return total
