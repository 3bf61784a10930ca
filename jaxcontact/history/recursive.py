"""Memory as a handful of fields: the hereditary integral at a cost that does not grow with time.

    u(t) = C_0 * p + sum_k lambda_k C_k * eta_k,      eta_k' = p - lambda_k eta_k,      eta_k = 0 at first.

For a pressure linear over a step dt the update is exact: with z = lambda dt, E = exp(-z),
phi = (1 - E)/z,

    eta(t + dt) = E eta + dt a p(t) + dt b p(t + dt),      a = (phi - E)/z,      b = (1 - phi)/z.

lambda = 0 (unlimited flow) gives a = b = 1/2; a step of no length keeps the fields, so that a jump of
the load meets the instantaneous kernel C_0. Second order in dt, of any dt.
"""

import jax
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
    """The kernel of the present step and the displacement (nx, ny) left by all earlier pressure.

    window: the kernel on a window, see ``contact.normal.Problem``.
    """

    spectrum: Array
    circulant: Array
    window: spectral.Window | None
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
        eta = decay[:, None, None] * eta + jnp.tensordot(old, pressure, 0)
        shape, weights = pressure.shape, k.mix @ new
        mixed = jnp.tensordot(k.mix, eta, 1)
        # term by term: at a time, all shapes and their tangents would leave the processor's cache
        now = lambda a: sum((weights[m] * a[m + 1] for m in range(weights.size)), a[0])
        terms = [k.spectra[m + 1] * spectral.transform(mixed[m]) for m in range(weights.size) if eta.shape[0]]
        earlier = spectral.inverse(sum(terms), shape) if terms else jnp.zeros(shape)
        return Operator(now(k.spectra), now(k.circulants), jax.tree.map(now, k.window), earlier), eta

    def update(self, eta: Array, pressure: Array, dt: Array) -> Array:
        """The fields after the step, with its new pressure."""
        return eta + jnp.tensordot(step_weights(self.kernels.rates, dt)[2], pressure, 0)

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
