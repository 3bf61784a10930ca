"""The tangential response in time as a sum of products, as ``response.time.separable`` has the normal one.

    f(alpha, t) = C_0(alpha) + sum_k lambda_k C_k(alpha) (1 - exp(-lambda_k t))/lambda_k,      f = alpha (L, T, K),

lambda_k C_k = sum_m mix[m, k] S_m. For a half-space all is one shape times the creep compliance, exactly. For layers that
creep the exact response (``response.stack``) is fitted at times over the band of their rates, as ``response.time.rational``
does at frequencies: a few picked wavenumbers stand for all, in two linear least-squares fits.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.inputs.materials import Material
from jaxcontact.response.half_space import own_creep
from jaxcontact.response.influence.tangential_images import fit_wavenumbers
from jaxcontact.response.stack import all_steps, solids
from jaxcontact.response.time.band import band, creeps, flows
from jaxcontact.response.time.rational import least_squares, pivots
from jaxcontact.response.volume import nu_at_first, surface_creep

RATES, SHAPES, TIMES = 32, 12, 96
SAMPLED = 10.0  # how far the times reach beyond the band of the rates
LEAST = 1e-9  # of the largest response: a smaller one is fitted as if it were of that size


@pytree
class TangentialSeparable:
    """rates: lambda_k [1/s], (K,); terms: C_0 and the S_m of alpha (L, T, K) at ``fit_wavenumbers``, (3, M + 1, n); mix:
    (M, K); lambda_k C_k = sum_m mix[m, k] S_m [1/(Pa s)]."""

    rates: Array
    terms: Array
    mix: Array


def separate_tangential(body: LayeredHalfSpace) -> TangentialSeparable:
    """The sum of products of a body; of a layered one at fixed rates, four a decade, and those of its solids."""
    if not body.layers:
        return _of_half_space(body.substrate)
    start = _entries(body, jnp.zeros(()))
    if not any(creeps(solid) for solid in solids(body)):
        return TangentialSeparable(jnp.zeros(0), start.reshape(3, 1, -1), jnp.zeros((0, 0)))
    low, high = band(jax.lax.stop_gradient(body))
    spread = lambda low, high, count: low * (high / low) ** jnp.linspace(0.0, 1.0, count)
    times = spread(1.0 / (SAMPLED * high), SAMPLED / low, TIMES)
    rest = _entries(body, times[:, None]) - start
    held = jax.lax.stop_gradient(rest)
    rows = 1.0 / jnp.sqrt(jnp.mean(held**2, 1, keepdims=True))
    columns = jnp.max(jnp.abs(rows * held), 0)
    columns = jnp.maximum(columns, LEAST * jnp.max(columns))
    weighted = rows * rest / columns
    picked = pivots(weighted, SHAPES)
    shapes = least_squares(weighted[:, picked], weighted) * columns
    rates = _rates(body, spread(low, high, RATES))
    growth = times[:, None] * phi1(times[:, None] * rates)
    unit = jnp.where(rates > 0.0, rates, low)
    mix = least_squares(rows * growth * unit, weighted[:, picked]) * unit[:, None]
    terms = jnp.concatenate([start[None], shapes]).reshape(SHAPES + 1, 3, -1)
    return TangentialSeparable(rates, jnp.moveaxis(terms, 1, 0), mix.T)


def _entries(body: LayeredHalfSpace, t: Array) -> Array:
    """alpha (L, T, K) at ``fit_wavenumbers``, one after the other, (..., 3 n) for times (..., 1) or ()."""
    L, K, _, T = all_steps(body, fit_wavenumbers(body), t)
    return jnp.concatenate([L, T, K], -1)


def _rates(body: LayeredHalfSpace, grid: Array) -> Array:
    """Those of the grid and of the solids, and zero where one of them flows."""
    own = [solid.spectrum().rates for solid in solids(body)]
    flow = jnp.zeros(1 if any(flows(solid) for solid in solids(body)) else 0)
    return jax.lax.stop_gradient(jnp.concatenate([grid, *own, flow]))


def half_space_shares(material: Material) -> Array:
    """alpha (L, T, K) over the compliance at first, with a constant nu over the creep compliance, (3,)."""
    nu = nu_at_first(material)
    return jnp.stack([1.0 - nu, jnp.ones(()), 0.5 - nu])


def _of_half_space(material: Material) -> TangentialSeparable:
    """One shape times the creep; with a bulk modulus one for the shear and one for the surface's creep.

    Then (1 - nu) j = S, (1/2 - nu) j = S - j/2, S of ``response.volume.surface_creep``.
    """
    if material.bulk_modulus is None:
        parts = [(half_space_shares(material), material.spectrum())]
    else:
        shear, surface = jnp.array([0.0, 1.0, -0.5]), jnp.array([1.0, 0.0, 1.0])
        parts = [(shear, material.spectrum()), (surface, surface_creep(material))]
    start = sum(share * creep.instantaneous for share, creep in parts)
    owned = [own_creep(creep) for _, creep in parts]
    rates = jnp.concatenate([each for each, _ in owned])
    if not rates.size:
        return TangentialSeparable(rates, jnp.reshape(start, (3, 1, 1)), jnp.zeros((0, 0)))
    terms = jnp.stack([start, *(share for share, _ in parts)], 1)[:, :, None]
    return TangentialSeparable(rates, terms, jax.scipy.linalg.block_diag(*(flow for _, flow in owned)))
