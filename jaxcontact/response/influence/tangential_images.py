"""The tangential response of a body as images: alpha (L, T, K) as sums of real exponentials in the wavenumber.

As in ``response.influence.images``, each function of ``response.stack`` is written as

    f(alpha) = f(0) + sum_j w_j (exp(-z_j alpha) - 1)

at fixed depths z_j, its weights a linear least-squares fit of its values, so that whatever is made of them is
differentiable in the response. A half-space is one image on its surface, exactly.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.response.influence.linear_fit import decomposed
from jaxcontact.response.influence.tangential_coefficients import TangentialImages
from jaxcontact.response.stack import solids

IMAGES = 48
NODES = np.geomspace(
    1e-5, 40.0, 400
)  # alpha h, h of the thinnest layer for the last, of all layers for the first
BEYOND = 1e5  # alpha h where every image has died away
SHALLOWEST, DEEPEST, DEEPEST_OF_STIFF = 1.2, 30.0, 12.0  # z/h; the last times the ratio of stiffnesses
STIFFEST = 1024.0  # ratio of stiffnesses that the depths reach for
CUTOFF = 1e-14
HELD = 1e3  # how much closer the limit of short waves is held than the rest


def fit_wavenumbers(body: LayeredHalfSpace) -> Array:
    """Where a response is to be given to ``fit_images`` [rad/m], (n,): zero first, and for a half-space only."""
    if not body.layers:
        return jnp.zeros(1)
    total, thinnest = _thicknesses(body)
    stretch = (total / thinnest) ** np.linspace(1.0, 0.0, NODES.size)
    return jnp.concatenate([jnp.zeros(1), NODES / (thinnest * stretch), BEYOND / thinnest[None]])


def _thicknesses(body: LayeredHalfSpace) -> tuple[Array, Array]:
    """Of all layers and of the thinnest one, () [m]."""
    each = jnp.asarray([layer.thickness for layer in body.layers], float)
    return jnp.sum(each), jnp.min(each)


def _stiffness_ratio(body: LayeredHalfSpace) -> Array:
    """The stiffest layer's first modulus over the substrate's, as the power of two that is nearest."""
    first = [jax.lax.stop_gradient(solid.spectrum().instantaneous) for solid in solids(body)]
    stiffest = jnp.min(jnp.stack([jnp.where(J > 0.0, J, first[-1] / STIFFEST) for J in first[:-1]]))
    return jnp.exp2(jnp.round(jnp.log2(jnp.clip(first[-1] / stiffest, 1.0 / STIFFEST, STIFFEST))))


def fit_images(body: LayeredHalfSpace, values: Array) -> TangentialImages:
    """Least-squares images of alpha (L, T, K) at ``fit_wavenumbers``, (3, ..., n) [any unit].

    The matrix has no units and does not follow the values: the images are linear in them.
    """
    if not body.layers:
        return TangentialImages(jnp.zeros(1), values)
    (total, thinnest), ratio = _thicknesses(body), _stiffness_ratio(body)
    reach = jnp.maximum(DEEPEST, DEEPEST_OF_STIFF * ratio) * total / (SHALLOWEST * thinnest)
    depths = SHALLOWEST * thinnest * reach ** jnp.linspace(0.0, 1.0, IMAGES)
    wavenumbers = fit_wavenumbers(body)[1:]
    x = wavenumbers * total
    rows = jnp.ones(x.size).at[-1].set(HELD) / (ratio + x / (1.0 + x))
    exponent = jnp.minimum(wavenumbers[:, None] * depths, 700.0)
    target = (values[..., 1:] - values[..., :1]) * rows
    weights = decomposed(jnp.expm1(-exponent) * rows[:, None]).truncated(target, CUTOFF)
    return TangentialImages(jnp.append(0.0, depths), jnp.concatenate([values[..., :1], weights], -1))
