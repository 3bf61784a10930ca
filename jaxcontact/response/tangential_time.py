"""The tangential response in time as a sum of products, as ``response.separable`` has the normal one.

    f(alpha, t) = C_0(alpha) + sum_k lambda_k C_k(alpha) (1 - exp(-lambda_k t))/lambda_k,      f = alpha (L, T, K),

lambda_k C_k = sum_m mix[m, k] S_m. For a half-space all is one shape times the creep compliance, exactly.
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact import _checks
from jaxcontact._pytree import pytree
from jaxcontact.layers import LayeredHalfSpace
from jaxcontact.materials import Material
from jaxcontact.response.half_space import own_creep
from jaxcontact.response.stack import all_steps, solids
from jaxcontact.response.tangential_images import fit_wavenumbers


@pytree
class TangentialSeparable:
    """rates: lambda_k [1/s], (K,); terms: C_0 and the S_m of alpha (L, T, K) at ``fit_wavenumbers``, (3, M + 1, n); mix:
    (M, K); lambda_k C_k = sum_m mix[m, k] S_m [1/(Pa s)]."""

    rates: Array
    terms: Array
    mix: Array


def check_elastic_layers(body: LayeredHalfSpace) -> None:
    """Under friction layers and what they lie on are elastic today."""
    for solid in solids(body) if body.layers else []:
        _checks.require(
            not _creeps(solid),
            f"body: expected elastic layers on an elastic substrate under friction, got {type(solid).__name__}:"
            " the tangential response of a creeping layer cannot be computed yet",
        )


def separate_tangential(body: LayeredHalfSpace) -> TangentialSeparable:
    """The sum of products of a body."""
    if not body.layers:
        return _of_half_space(body.substrate)
    L, K, _, T = all_steps(body, fit_wavenumbers(body), 0.0)
    return TangentialSeparable(jnp.zeros(0), jnp.stack([L, T, K])[:, None], jnp.zeros((0, 0)))


def half_space_shares(material: Material) -> Array:
    """alpha (L, T, K) over the creep compliance, (3,)."""
    nu = jnp.asarray(material.nu, float)
    return jnp.stack([1.0 - nu, jnp.ones(()), 0.5 - nu])


def _of_half_space(material: Material) -> TangentialSeparable:
    spectrum = material.spectrum()
    rates, fluidities = own_creep(spectrum)
    shares = half_space_shares(material)[:, None, None]
    if not rates.size:
        return TangentialSeparable(rates, shares * spectrum.instantaneous, jnp.zeros((0, 0)))
    terms = shares * jnp.stack([spectrum.instantaneous, jnp.ones(())])[:, None]
    return TangentialSeparable(rates, terms, fluidities[None])


def _creeps(solid: Material) -> bool:
    spectrum = solid.spectrum()
    return spectrum.rates.size > 0 or spectrum.fluidity is not None
