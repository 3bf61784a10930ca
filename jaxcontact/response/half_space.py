"""The half-space: alpha N = (1 - nu) J(t) at every wavenumber (J. Boussinesq; the correspondence is exact).

With a bulk modulus in place of nu, the creep is ``response.stack.surface_creep``, which is exact as well.
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.bodies.materials import Material
from jaxcontact.response.images import Images
from jaxcontact.response.interface import Response, Separable
from jaxcontact.response.stack import surface_creep, surface_parts


@pytree
class HalfSpace(Response):
    """A half-space of one material, elastic or viscoelastic."""

    material: Material

    def mean_response(self, wavenumber: Array, start: Array, end: Array) -> Array:
        mean = surface_creep(self.material).mean_creep(jnp.asarray(start, float), jnp.asarray(end, float))
        return mean * jnp.ones_like(jnp.asarray(wavenumber, float))

    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return ``mean_response``: for a half-space of constant nu the substitution is exact."""
        return self.mean_response(wavenumber, start, end)

    def wavenumbers(self) -> Array:
        """Return one arbitrary wavenumber, since the response does not depend on it."""
        return jnp.ones(1)

    def separate(self, nodes: int) -> Separable:
        """Return the sum of products, exact for any ``nodes``."""
        share, creep = surface_parts(self.material)
        rates, fluidities = creep.rates_and_fluidities()
        terms = share * jnp.stack([creep.instantaneous, jnp.ones(())])[:, None]
        own_factors = jnp.append(creep.instantaneous, fluidities)
        return Separable(rates, terms, fluidities[None], own_factors, jnp.zeros(()))

    def expand(self, values: Array) -> Images:
        """Return a single image at the surface."""
        return Images(jnp.zeros(0), values)

    def expand_shapes(self, start: Array, film: Array, rest: Array) -> Images:
        """Return the same image as ``expand``."""
        return self.expand(jnp.concatenate([start, film, rest]))
