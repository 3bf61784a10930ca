"""Memory as a handful of fields: the hereditary integral at a cost that does not grow with time.

    u(t) = C_0 * p + sum_k lambda_k C_k * eta_k,      eta_k' = p - lambda_k eta_k,      eta_k = 0 at first.

For a pressure linear over a step dt the update is exact: with z = lambda dt, and
psi and phi2 the integrals of the exponential (``_support.exponential``),

    eta(t + dt) = exp(-z) eta + dt psi(z) p(t) + dt phi2(z) p(t + dt).

lambda = 0 (unlimited flow) gives psi = phi2 = 1/2; a step of no length keeps the fields, so that a jump of
the load meets the instantaneous kernel C_0. Second order in dt, of any dt.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import ramps
from jaxcontact._support.pytree import pytree
from jaxcontact.history.memory import Memory, Prediction
from jaxcontact.history.observables import inner_product
from jaxcontact.history.step_error import Delayed
from jaxcontact.operators import spectral
from jaxcontact.operators.kernels import Kernels


class Before(NamedTuple):
    """eta (K, nx, ny) and the pressure (nx, ny) before a step: the fields pass the memory once, after the step."""

    eta: Array
    pressure: Array


@pytree
class RecursiveMemory(Memory):
    """Exact exponential recursion over the rates of the kernels; fields: eta (K, nx, ny); step: dt [s]."""

    kernels: Kernels

    @property
    def inherits(self) -> bool:
        """True if there is any rate; without one the displacement depends on the present pressure alone."""
        return self.kernels.rates.shape[0] > 0

    def start(self, shape: tuple[int, int]) -> Array:
        return jnp.zeros((self.kernels.rates.shape[0], *shape))

    def predict(self, eta: Array, pressure: Array, dt: Array) -> Prediction:
        k = self.kernels
        decay, old, new = ramps(k.rates * dt)
        count = len(k.mix) if len(eta) else 0  # an elastic body has no history
        mix = k.mix[:count]  # of matrices: quicker to differentiate
        mixed = (mix * decay) @ eta.reshape(len(eta), pressure.size)
        mixed = mixed.reshape(count, *pressure.shape) + jnp.tensordot(mix @ (dt * old), pressure, 0)
        earlier = k.family.total(mixed)
        return Prediction(k.family.combined([1.0, *(k.mix @ (dt * new))]), earlier, Before(eta, pressure))

    def update(self, before: Before, pressure: Array, dt: Array) -> Array:
        decay, old, new = ramps(self.kernels.rates * dt)
        added = jnp.tensordot(dt * old, before.pressure, 0) + jnp.tensordot(dt * new, pressure, 0)
        return decay[:, None, None] * before.eta + added

    def stored_energy(self, eta: Array, pressure: Array) -> Array:
        """Return 1/2 <p, C_0 p> + 1/2 sum_k lambda_k <eta_k, lambda_k C_k eta_k>, the energy of the springs of
        ``history.observables``, ().
        """
        k = self.kernels
        members, shape = k.family.members, spectral.padded_shape(pressure.shape, k.family.members.periodic)
        fields = jnp.concatenate([pressure[None], eta])
        waves = spectral.transform(fields, members.periodic)
        squares = waves.real**2 + waves.imag**2
        energies = jax.vmap(lambda s: inner_product(members.spectrum, s, shape))(squares)  # (K + 1, M + 1)
        return 0.5 * energies[0, 0] + 0.5 * jnp.sum(k.rates[:, None] * k.mix.T * energies[1:, 1:])

    def delayed(self, eta: Array, pressure: Array) -> Delayed:
        return Delayed(self.kernels.rates, self.kernels.delayed_shares(pressure))

    def observe(self, eta: Array, pressure: Array, dt: Array) -> dict[str, Array]:
        film = self.kernels.film
        if film is None:
            return {"film_strain": jnp.zeros(())}
        return {"film_strain": film.strain(pressure, eta)}
