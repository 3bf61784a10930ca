"""Hamiltonian Monte Carlo sampling of the posterior of a fit: its density, the starts of the chains, and the chains.

The density is that of ``bayes.py`` over coordinates x between ``low`` and ``high``; the sampler moves in z, x = low +
(high - low)/(1 + exp(-z)). It is the No-U-Turn sampler of numpyro (M. D. Hoffman, A. Gelman, J. Mach. Learn. Res. 15
(2014) 1593), which is imported only here.
"""

import dataclasses
import functools
import importlib
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import Partial

from jaxcontact._compile.kept_traces import fast_compile_options

APART = 2.0  # distance of the starts of the chains, in standard deviations
WIDEST = 0.5  # largest standard deviation in z used for the starts, where the curvature is uninformative
ACCEPTED = 0.9  # target acceptance probability of the step size adaptation


@functools.partial(
    jax.tree_util.register_dataclass, meta_fields=[],
    data_fields=["residual", "held", "free", "logs", "low", "high", "rss", "widening", "points", "known"],
)  # fmt: skip
@dataclasses.dataclass(frozen=True)
class Density:
    """Posterior density of the coordinates of a fit.

    residual (n,): function of the values (k,); held (k,): the values of coordinates that are held; free (p,): places of
    the coordinates; logs (p,): which of them are logarithms; low, high (p,): bounds of the uniform prior; rss: the
    minimum; widening: factor on the noise variance; points: n; known: whether sigma is known.
    """

    residual: Partial
    held: Array
    free: Array
    logs: Array
    low: Array
    high: Array
    rss: Array
    widening: Array
    points: Array
    known: Array

    def coordinates(self, z: Array) -> Array:
        """Return the coordinates x (p,) of z (p,)."""
        return self.low + (self.high - self.low) * jax.nn.sigmoid(z)

    def values(self, x: Array) -> Array:
        """Return the compliances and nuisance parameters (k,) of coordinates (p,)."""
        own = jnp.where(self.logs, jnp.exp(jnp.where(self.logs, x, 0.0)), x)
        return self.held.at[self.free].set(own)

    def residual_at(self, z: Array) -> Array:
        """Return the weighted residuals (n,) at z (p,)."""
        return self.residual(self.values(self.coordinates(z)))

    def potential(self, z: Array) -> Array:
        """Return the negative log density of z (p,), up to a constant."""
        r = self.residual_at(z)
        rise = (r @ r - self.rss) / self.widening
        estimated = 0.5 * self.points * jnp.log1p(jnp.maximum(rise / self.rss, -0.5))
        by_data = jnp.where(self.known, 0.5 * rise, estimated)
        return by_data - jnp.sum(jax.nn.log_sigmoid(z) + jax.nn.log_sigmoid(-z))


def sampler() -> Any:
    """Return the NUTS sampler of numpyro; ImportError that names the package to install."""
    try:
        return importlib.import_module("numpyro.infer.hmc").hmc
    except ImportError:
        raise ImportError("posterior needs numpyro: pip install 'jaxcontact[bayes]'") from None


def starts(density: Density, chains: int, seed: int) -> Array:
    """Return starts z (chains, p) about the best fit, spread according to the curvature there, within the prior."""
    best = np.asarray(density.held)[np.asarray(density.free)]
    x = np.where(density.logs, np.log(np.maximum(best, 1e-300)), best)
    share = np.clip((x - density.low) / (density.high - density.low), 0.02, 0.98)
    z = np.log(share / (1.0 - share))
    curvature, axes = np.linalg.eigh(np.asarray(_curvature(jnp.asarray(z), density)))
    size = np.minimum(1.0 / np.sqrt(np.maximum(curvature, 1e-300)), WIDEST)
    random = np.random.default_rng(seed).standard_normal((chains, z.size))
    return jnp.asarray(z + APART * (random * size) @ axes.T)


@jax.jit
def _curvature(z: Array, density: Density) -> Array:
    """Return the Gauss-Newton Hessian (p, p) of the potential, without the prior."""
    J = jax.jacfwd(density.residual_at)(z)
    noise = jnp.where(density.known, 1.0, density.rss / density.points) * density.widening
    return J.T @ J / noise


def run(keys: Array, z: Array, density: Density, warmup: int, samples: int) -> tuple[Array, Array]:
    """Return coordinates (chains, samples, p) and divergence flags (chains, samples) of chains from z (chains, p)."""
    return _compiled()(keys, z, density, warmup=warmup, samples=samples)


@functools.cache
def _compiled() -> Any:
    return jax.jit(_chains, static_argnames=("warmup", "samples"), compiler_options=fast_compile_options())


def _chains(keys: Array, z: Array, density: Density, warmup: int, samples: int) -> tuple[Array, Array]:
    begin, step = sampler()(density.potential, algo="NUTS")

    def chain(key: Array, z: Array) -> tuple[Array, Array]:
        state = begin(
            z, num_warmup=warmup, dense_mass=True, target_accept_prob=ACCEPTED,
            forward_mode_differentiation=True, rng_key=key,
        )  # fmt: skip

        def go(state: Any, _: None) -> tuple[Any, tuple[Array, Array]]:
            state = step(state)
            return state, (density.coordinates(state.z), state.diverging)

        return jax.lax.scan(go, state, None, warmup + samples)[1]

    x, astray = jax.vmap(chain)(keys, z)
    return x[:, warmup:], astray[:, warmup:]
