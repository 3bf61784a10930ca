"""The tangential response of a body as images: alpha (L, T, K) as sums of real exponentials in the wavenumber.

Each function of ``response.stack`` is written as

    f(alpha) = f(0) + sum_j w_j (exp(-z_j alpha) - 1)

with the staircases of ``response.influence.images``: w_j is the difference of two successive heights. Depths and
wavenumbers are those of ``response.time.ladder``, so that the images reach as far below a layer that becomes much stiffer
than what lies below it. A half-space is one image on its surface, exactly.
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.response.influence.tangential_coefficients import TangentialImages
from jaxcontact.response.time import ladder


def fit_wavenumbers(body: LayeredHalfSpace) -> Array:
    """Return the wavenumbers (n,) [rad/m] at which ``fit_images`` takes a response: zero first, for a half-space zero
    alone."""
    return ladder.wavenumbers(body) if body.layers else jnp.zeros(1)


def fit_images(body: LayeredHalfSpace, values: Array) -> TangentialImages:
    """Least-squares images of alpha (L, T, K) at ``fit_wavenumbers``, (3, ..., n) [any unit].

    The matrix does not follow the values: the images are linear in them.
    """
    if not body.layers:
        return TangentialImages(jnp.zeros(1), values)
    fitted = ladder.expand_tangential(body, values)
    weights = jnp.concatenate([fitted.heights[..., -1:], jnp.diff(fitted.heights, axis=-1)], -1)
    return TangentialImages(jnp.append(0.0, fitted.depths), weights)


def images_at(images: TangentialImages, wavenumber: Array) -> Array:
    """Return alpha (L, T, K) of images at wavenumbers (n,) [rad/m], (3, ..., n)."""
    decayed = jnp.expm1(-images.depths[1:, None] * wavenumber)
    return images.weights[..., :1] + images.weights[..., 1:] @ decayed
