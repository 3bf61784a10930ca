"""The integrals of the exponential, real and complex: the one home of (1 - exp(-z))/z and its kin.

    phi1(z) = int_0^1 exp(-z s) ds           = (1 - exp(-z))/z
    phi2(z) = int_0^1 (1 - s) exp(-z s) ds   = (1 - phi1)/z
    psi(z)  = int_0^1 s exp(-z s) ds         = (phi1 - exp(-z))/z

for Re z >= 0, z = 0 included, with finite derivatives. Near zero, where the right sides cancel, their
Taylor series stand in: all are good to 3e-14 of their size (tests: 40-digit values).
"""

import math

import jax
import jax.numpy as jnp
from jax import Array

SERIES_BELOW = 0.1  # of |Re z| + |Im z|
PHI2 = [(-1.0) ** n / math.factorial(n + 2) for n in range(10)]


def _apart(z: Array) -> tuple[Array, Array, Array]:
    """Where z is near zero, phi2 there by its series, and z with one in place of what is near zero."""
    size = jnp.abs(z.real) + jnp.abs(z.imag) if jnp.iscomplexobj(z) else jnp.abs(z)
    small = size < SERIES_BELOW
    low = jnp.where(small, z, 0.0)
    series = jnp.full_like(low, PHI2[-1])
    for coefficient in PHI2[-2::-1]:
        series = series * low + coefficient
    return small, series, jnp.where(small, 1.0, z)


@jax.jit  # traced once for one shape, wherever it is called
def phi1(z: Array) -> Array:
    """(1 - exp(-z))/z: the mean of exp(-z s) over 0 <= s <= 1."""
    small, series, safe = _apart(z)
    return jnp.where(small, 1.0 - z * series, (1.0 - jnp.exp(-safe)) / safe)


@jax.jit  # as ``phi1``
def ramps(z: Array) -> tuple[Array, Array, Array]:
    """exp(-z), psi(z) and phi2(z), by one exponential.

    Of what decays at the rate z, these are the shares after a unit of time of what was there, and of
    a source that is linear in that time from its value at the start and from its value at the end.
    """
    small, series, safe = _apart(z)
    decay = jnp.exp(-safe)
    mean = (1.0 - decay) / safe
    start = jnp.where(small, 1.0 - (1.0 + z) * series, (mean - decay) / safe)
    end = jnp.where(small, series, (1.0 - mean) / safe)
    return jnp.where(small, 1.0 - z * (1.0 - z * series), decay), start, end


def mean_decay(rate: Array, start: Array, end: Array) -> Array:
    """Mean of exp(-rate t) over start <= t <= end; its value where the two coincide."""
    return jnp.exp(-rate * start) * phi1(rate * (end - start))
