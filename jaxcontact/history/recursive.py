"""Memory as a handful of fields: the hereditary integral at a cost that does not grow with time.

    u(t) = C_0 * p + sum_k lambda_k C_k * eta_k,      eta_k' = p - lambda_k eta_k,      eta_k = 0 at first.

For a pressure linear over a step dt the update is exact: with z = lambda dt, E = exp(-z),
phi = (1 - E)/z,

    eta(t + dt) = E eta + dt a p(t) + dt b p(t + dt),      a = (phi - E)/z,      b = (1 - phi)/z.

lambda = 0 (unlimited flow) gives a = b = 1/2; a step of no length keeps the fields, so that a jump of
the load meets the instantaneous kernel C_0. Second order in dt, of any dt.
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact import spectral
from jaxcontact._pytree import pytree
from jaxcontact.kernels import Kernels

SERIES_BELOW = 1e-2


def step_weights(rates: Array, dt: Array) -> tuple[Array, Array, Array]:
    """E, dt a and dt b of the module's formula, each of the shape of ``rates``."""
    z = rates * dt
    small = z < SERIES_BELOW
    safe = jnp.where(small, 1.0, z)
    decay = jnp.exp(-z)
    phi = -jnp.expm1(-safe) / safe
    old = jnp.where(small, 1 / 2 - z / 3 + z**2 / 8 - z**3 / 30 + z**4 / 144, (phi - jnp.exp(-safe)) / safe)
    new = jnp.where(small, 1 / 2 - z / 6 + z**2 / 24 - z**3 / 120 + z**4 / 720, (1.0 - phi) / safe)
    return decay, dt * old, dt * new


@pytree
class Operator:
    """The kernel of the present step and the displacement (nx, ny) left by all earlier pressure."""

    spectrum: Array
    circulant: Array
    earlier: Array


@pytree
class RecursiveMemory:
    """Exact exponential recursion over the rates of the kernels."""

    kernels: Kernels

    def start(self, shape: tuple[int, int]) -> Array:
        """No history: eta = 0, (K, nx, ny)."""
        return jnp.zeros((self.kernels.rates.shape[0], *shape))

    def predict(self, eta: Array, pressure: Array, dt: Array) -> tuple[Operator, Array]:
        """The operator of the coming step, and the fields before its new pressure comes in."""
        k = self.kernels
        decay, old, new = step_weights(k.rates, dt)
        eta = decay[:, None, None] * eta + old[:, None, None] * pressure
        shape = pressure.shape
        if eta.shape[0] == 0:
            return Operator(k.spectra[0], k.circulants[0], jnp.zeros(shape)), eta
        spectrum = k.spectra[0] + jnp.tensordot(k.mix @ new, k.spectra[1:], 1)
        circulant = k.circulants[0] + jnp.tensordot(k.mix @ new, k.circulants[1:], 1)
        mixed = spectral.transform(jnp.tensordot(k.mix, eta, 1))
        earlier = spectral.inverse(jnp.sum(k.spectra[1:] * mixed, 0), shape)
        return Operator(spectrum, circulant, earlier), eta

    def update(self, eta: Array, pressure: Array, dt: Array) -> Array:
        """The fields after the step, with its new pressure."""
        return eta + step_weights(self.kernels.rates, dt)[2][:, None, None] * pressure

    def film_shear_strain(self, eta: Array, pressure: Array, dt: Array) -> Array:
        """The hereditary integral of the film's J over the pressure, without unit, (nx, ny)."""
        assert self.kernels.film is not None
        weights = self.kernels.film.weights
        return weights[0] * pressure + jnp.tensordot(weights[1:], eta, 1)

    def observe(self, eta: Array, pressure: Array, dt: Array) -> None:
        """Nothing beyond what every step reports."""

    def film_coefficients(self) -> Array | None:
        """See ``kernels.Film``."""
        return None if self.kernels.film is None else self.kernels.film.coefficients
