"""A material of one's own, made from its base in ``jaxcontact.abc``, as a user would write it."""

import jax.numpy as jnp

from jaxcontact.abc import Material, Spectrum, pytree


@pytree
class TwoKelvin(Material):
    """A spring in series with two Kelvin-Voigt elements."""

    G: float
    G1: float
    G2: float
    eta1: float
    eta2: float
    nu: float = 0.4
    bulk_modulus: float | None = None

    def spectrum(self):
        J = jnp.stack([1.0 / jnp.asarray(self.G1), 1.0 / jnp.asarray(self.G2)])
        rates = jnp.stack([jnp.asarray(self.G1) / self.eta1, jnp.asarray(self.G2) / self.eta2])
        return Spectrum(1.0 / jnp.asarray(self.G), J, rates)
