"""Facts about a body that follow from its solids, whatever the formula of its response.

Contacts far wider than the layers meet the substrate, contacts far narrower than the top layer meet its material. Both
are half-spaces, of compliance (1 - nu) J(t) at a constant Poisson's ratio (``response.volume.surface_creep``).
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
        """Whether creep may be felt at any distance from a load: that of a half-space or of a substrate."""
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

    def wide(self, t: Array | float) -> Array:
        """Compliance [1/Pa] that a contact far wider than the layers meets after a time t [s]."""
        return surface_creep(self.substrate).creep(t)

    def narrow(self, t: Array | float) -> Array:
        """Compliance [1/Pa] that a contact far narrower than the top layer meets after a time t [s]."""
        return surface_creep(self.surface).creep(t)

    def long_term(self) -> Array:
        """``wide`` after a very long time, without unlimited flow [1/Pa]: a scale that is never zero."""
        creep = surface_creep(self.substrate)
        return creep.instantaneous + jnp.sum(jnp.where(creep.rates > 0.0, creep.amplitudes, 0.0))

    def flows(self) -> Array:
        """Whether the surface sinks without limit under a load, () bool."""
        return jnp.any(jnp.stack([may_flow(solid) for solid in self.solids]))

    def rigid_at_first(self) -> Array | bool:
        """Whether a solid has J(0) = 0, so that a step load cannot deform it at once; a bool where its class tells."""
        if any(isinstance(solid, KelvinVoigt) for solid in self.solids):
            return True
        return _rigid_at_first(self.solids)

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
def _rigid_at_first(solids: list[Material]) -> Array:
    return jnp.any(jnp.stack([solid.spectrum().instantaneous == 0.0 for solid in solids]))
