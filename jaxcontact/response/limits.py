"""Properties of a body that follow from its materials, independent of the formula of its response.

The compliance for contacts much wider than the layers is that of the substrate, and for contacts much narrower than the
top layer that of its material. Both are compliances of half-spaces, (1 - nu) J(t) at
a constant Poisson's ratio (``response.volume.surface_creep``).
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.layers import Layer, LayeredHalfSpace
from jaxcontact.inputs.materials import Elastic, KelvinVoigt, Material
from jaxcontact.inputs.spectrum import Spectrum
from jaxcontact.response.half_space import may_flow
from jaxcontact.response.time.ladder import stiffness_contrast
from jaxcontact.response.volume import film_creep, film_shape, surface_creep


@pytree
class BodyLimits:
    """Facts about layers, the top one first, on a substrate; made by ``limits_of``."""

    layers: tuple[Layer, ...]
    substrate: Material

    @property
    def solids(self) -> list[Material]:
        """The materials from the top to the substrate."""
        return [*(layer.material for layer in self.layers), self.substrate]

    @property
    def film(self) -> Layer | None:
        """The layer whose shortening is reported, the top one; None without layers."""
        return self.layers[0] if self.layers else None

    @property
    def surface(self) -> Material:
        """The material that the indenter touches."""
        return self.solids[0]

    @property
    def creeps_far(self) -> bool:
        """True if creep may have an effect at any distance from a load: that of a half-space or of a substrate."""
        return not self.layers or not isinstance(self.substrate, Elastic)

    def film_creep(self) -> Spectrum:
        """The creep of the film on a rigid base, which multiplies ``film_shape``; of a body with a film."""
        assert self.film is not None
        return film_creep(self.film.material)

    def film_shape(self, wavenumber: Array) -> Array:
        """alpha N of the film on a rigid base over its creep, at wavenumbers [rad/m]; zero without a film."""
        if self.film is None:
            return jnp.zeros_like(wavenumber)
        return film_shape(self.film.material, wavenumber * self.film.thickness)

    def long_wave_compliance(self, t: Array | float) -> Array:
        """Return the compliance [1/Pa] at a time t [s] of the substrate, for contacts much wider than the layers."""
        return surface_creep(self.substrate).creep(t)

    def short_wave_compliance(self, t: Array | float) -> Array:
        """Return the compliance [1/Pa] at a time t [s] of the top layer, for contacts much narrower than it."""
        return surface_creep(self.surface).creep(t)

    def relaxed_compliance(self) -> Array:
        """Return the relaxed compliance of the substrate without its steady-state flow [1/Pa], which is never zero."""
        creep = surface_creep(self.substrate)
        return creep.instantaneous + jnp.sum(jnp.where(creep.rates > 0.0, creep.amplitudes, 0.0))

    def is_fluid(self) -> Array:
        """Return whether the surface displacement grows without limit under a load, () bool."""
        return jnp.any(jnp.stack([may_flow(solid) for solid in self.solids]))

    def has_zero_instantaneous_compliance(self) -> Array | bool:
        """Return whether a solid has J(0) = 0 and does not respond to a step load instantaneously.

        The result is a bool where the class of the material determines it.
        """
        if any(isinstance(solid, KelvinVoigt) for solid in self.solids):
            return True
        return _has_zero_instantaneous_compliance(self.solids)

    def stiffness_ratio(self) -> Array:
        """The largest initial modulus of a layer over that of a solid below it, (); zero without layers."""
        return (
            stiffness_contrast(LayeredHalfSpace(self.layers, self.substrate))
            if self.layers
            else jnp.zeros(())
        )


def limits_of(body: LayeredHalfSpace) -> BodyLimits:
    """Return the facts about a body that has passed ``checked_body``."""
    return BodyLimits(body.sublayers(), body.substrate)


@jax.jit  # one program of every check instead of one for each operation
def _has_zero_instantaneous_compliance(solids: list[Material]) -> Array:
    return jnp.any(jnp.stack([solid.spectrum().instantaneous == 0.0 for solid in solids]))
