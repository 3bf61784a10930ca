"""The half-space: alpha N = (1 - nu) J(t) at every wavenumber (J. Boussinesq; the correspondence is exact).

With a bulk modulus in place of nu, the creep is ``response.volume.surface_creep``, which is exact as well.
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.materials import Material
from jaxcontact.inputs.spectrum import Spectrum
from jaxcontact.response.base import Response, Separable
from jaxcontact.response.influence.images import Images
from jaxcontact.response.volume import surface_creep, surface_parts


@pytree
class HalfSpace(Response):
    """A half-space of one material, elastic or viscoelastic."""

    material: Material

    def step(self, wavenumber: Array, start: Array, end: Array) -> Array:
        mean = surface_creep(self.material).mean_creep(jnp.asarray(start, float), jnp.asarray(end, float))
        return mean * jnp.ones_like(jnp.asarray(wavenumber, float))

    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return ``step``: for a half-space of constant nu the substitution is exact."""
        return self.step(wavenumber, start, end)

    def wavenumbers(self) -> Array:
        """Return one arbitrary wavenumber, since the response does not depend on it."""
        return jnp.ones(1)

    def separate(self, nodes: int) -> Separable:
        """Return the sum of products, exact for any ``nodes``."""
        share, creep = surface_parts(self.material)
        rates, fluidities = own_creep(creep)
        terms = share * jnp.stack([creep.instantaneous, jnp.ones(())])[:, None]
        film = jnp.append(creep.instantaneous, fluidities)
        return Separable(rates, terms, fluidities[None], film, jnp.zeros(()))

    def expand(self, values: Array) -> Images:
        """Return a single image at the surface."""
        return Images(jnp.zeros(0), values)

    def expand_shapes(self, shapes: Array) -> Images:
        """Return the same image as ``expand``."""
        return self.expand(shapes)


def own_creep(spectrum: Spectrum) -> tuple[Array, Array]:
    """Return a material's own rates [1/s] and their fluidities J_i/tau_i [1/(Pa s)], steady-state flow last."""
    rates, fluidities = spectrum.rates, spectrum.amplitudes * spectrum.rates
    if spectrum.fluidity is None:
        return rates, fluidities
    return jnp.append(rates, 0.0), jnp.append(fluidities, spectrum.fluidity)


def may_flow(material: Material) -> Array:
    """Return whether a material has steady-state viscous flow, () bool."""
    fluidity = material.spectrum().fluidity
    return jnp.zeros((), bool) if fluidity is None else jnp.asarray(fluidity) > 0.0
