"""The half-space: alpha N = (1 - nu) J(t) at every wavenumber (J. Boussinesq; the correspondence is exact).

With a bulk modulus in place of nu it is another creep, ``response.volume.surface_creep``, as exact.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.materials import KelvinVoigt, Material
from jaxcontact.inputs.spectrum import Spectrum
from jaxcontact.response.base import Response, Separable
from jaxcontact.response.influence.images import Images
from jaxcontact.response.volume import surface_creep, surface_parts


@pytree
class HalfSpace(Response):
    """A half-space of one material, elastic or not."""

    material: Material

    def step(self, wavenumber: Array, start: Array, end: Array) -> Array:
        mean = surface_creep(self.material).mean_creep(jnp.asarray(start, float), jnp.asarray(end, float))
        return mean * jnp.ones_like(jnp.asarray(wavenumber, float))

    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Equal to ``step``: for a half-space of constant nu the substitution is exact."""
        return self.step(wavenumber, start, end)

    def wavenumbers(self) -> Array:
        """Any one will do."""
        return jnp.ones(1)

    def separate(self, nodes: int) -> Separable:
        """Exact, for any ``nodes``."""
        share, creep = surface_parts(self.material)
        rates, fluidities = own_creep(creep)
        terms = share * jnp.stack([creep.instantaneous, jnp.ones(())])[:, None]
        return Separable(rates, terms, fluidities[None], jnp.zeros(()))

    def expand(self, values: Array) -> Images:
        """One step without end."""
        return Images(jnp.zeros(0), values)

    def expand_shapes(self, shapes: Array) -> Images:
        """As ``expand``."""
        return self.expand(shapes)

    def wide(self, t: Array | float) -> Array:
        return surface_creep(self.material).creep(t)

    def narrow(self, t: Array | float) -> Array:
        return self.wide(t)

    def springs(self, t: Array | float) -> Array:
        return jnp.zeros(())

    def long_term(self) -> Array:
        creep = surface_creep(self.material)
        return creep.instantaneous + jnp.sum(jnp.where(creep.rates > 0.0, creep.amplitudes, 0.0))

    def flows(self) -> Array:
        return may_flow(self.material)

    def rigid_at_first(self) -> Array | bool:
        return isinstance(self.material, KelvinVoigt) or _rigid_at_first(self.material)

    def stiffness_ratio(self) -> Array:
        return jnp.zeros(())

    def surface(self) -> Material:
        return self.material

    def film(self) -> None:
        return None

    def film_creep(self) -> Spectrum:
        """That of the half-space."""
        return surface_parts(self.material)[1]

    def on_rigid_base(self) -> Array:
        """Zero: there is no film."""
        return jnp.zeros(1)

    def creeps_far(self) -> bool:
        return True


@jax.jit  # of every check, where each operation would be a program of its own
def _rigid_at_first(material: Material) -> Array:
    return material.spectrum().instantaneous == 0.0


def own_creep(spectrum: Spectrum) -> tuple[Array, Array]:
    """A material's own rates [1/s] and their fluidities J_i/tau_i [1/(Pa s)], unlimited flow last."""
    rates, fluidities = spectrum.rates, spectrum.amplitudes * spectrum.rates
    if spectrum.fluidity is None:
        return rates, fluidities
    return jnp.append(rates, 0.0), jnp.append(fluidities, spectrum.fluidity)


def may_flow(material: Material) -> Array:
    """Whether a material flows without limit, () bool."""
    fluidity = material.spectrum().fluidity
    return jnp.zeros((), bool) if fluidity is None else jnp.asarray(fluidity) > 0.0
