"""Images: a response as a sum of real exponentials in the wavenumber, at fixed depths.

A response alpha N(alpha) is written as

    alpha N = A_s + sum_j w_j (exp(-z_j alpha) - 1),

where A_s is its value at alpha = 0. Each exponential is the response of a half-space seen at a depth z_j
(an "image"), whose integral over a cell is closed form (``response.coefficients``). The weights are a
linear least-squares fit, so whatever is made of them is differentiable in the response.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._pytree import pytree

IMAGES = 40
NODES = np.geomspace(1e-5, 40.0, 400)
BEYOND = 1e5  # alpha h where every image has died away
CUTOFF = 1e-14
MOST_STIFF = 1e3  # film over substrate modulus up to which the depths reach far enough


@pytree
class Images:
    """depths: z_j [m], (J,), z_0 = 0 first; weights: (..., J) [1/Pa], of 1 first, then of exp(-z_j alpha) - 1."""

    depths: Array
    weights: Array


def image_depths(stiffness_ratio: Array) -> Array:
    """z_j/h, (IMAGES,): from 1.2 to 30, or to 12 G for a film G > 2.5 times as stiff as its substrate."""
    reach = jnp.maximum(30.0, 12.0 * jax.lax.stop_gradient(stiffness_ratio))
    return 1.2 * (reach / 1.2) ** jnp.linspace(0.0, 1.0, IMAGES)


def fit_wavenumbers(thickness: Array | float) -> Array:
    """The wavenumbers [rad/m] at which a response is to be given to ``fit_images``, (n,)."""
    return jnp.append(NODES, BEYOND) / thickness


def quantised(ratio: Array) -> Array:
    """The power of two nearest to a ratio > 0, at most 1024, without derivative."""
    return jnp.exp2(jnp.round(jnp.log2(jnp.minimum(jax.lax.stop_gradient(ratio), 1024.0))))


def fit_images(
    values: Array, at_zero: Array, floor: Array | float, relative_depths: Array, thickness: Array | float
) -> Images:
    """Least-squares images of responses alpha N.

    values: alpha N at ``fit_wavenumbers``, (..., n) [any unit]; at_zero: its value at alpha = 0, (...);
    floor: at_zero over the limit of short waves, (), roughly: errors are relative to floor + x/(1 + x),
    x = alpha h; relative_depths: z_j/h, (J,).

    The matrix has no units and, with a quantised floor, does not follow the values: the images are
    linear in them, without noise in finite differences or between systems of units.
    """
    x = jnp.append(NODES, BEYOND)
    # the limit of short waves is held a thousand times closer than the rest
    rows = jnp.ones(x.size).at[-1].set(1e3) / (floor + x / (1.0 + x))
    exponent = jnp.minimum(x[:, None] * relative_depths, 700.0)
    matrix = jax.lax.stop_gradient(jnp.expm1(-exponent) * rows[:, None])
    u, s, vt = jnp.linalg.svd(matrix, full_matrices=False)
    target = (values - at_zero[..., None]) * rows
    weights = jnp.where(s > CUTOFF * s[0], 1.0 / s, 0.0) * (target @ u) @ vt
    depths = jnp.append(0.0, thickness * relative_depths)
    return Images(depths, jnp.concatenate([at_zero[..., None], weights], -1))
