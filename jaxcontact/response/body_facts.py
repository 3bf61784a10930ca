"""Facts about a body that follow from its materials, whatever the formula of its response.

The compliance for contacts much wider than the layers is that of the substrate, and for contacts much narrower than the top
layer that of its material. Both are compliances of half-spaces, (1 - nu) J(t) at a constant Poisson's ratio
(``response.stack.surface_creep``).
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.bodies.body import Layer, LayeredHalfSpace
from jaxcontact.bodies.materials import Elastic, KelvinVoigt, Material, Rigid
from jaxcontact.response.stack import solids, spectra, surface_creep


def top_layer(body: LayeredHalfSpace) -> Layer | None:
    """Return the layer whose shortening is reported, or None for a half-space."""
    layers = body.sublayers()
    return layers[0] if layers else None


def surface_material(body: LayeredHalfSpace) -> Material:
    """Return the material that the indenter touches."""
    return solids(body)[0]


def creeps(solid: Material) -> bool:
    """Return whether materials of this class may creep."""
    spectrum = solid.spectrum()
    return spectrum.rates.size > 0 or spectrum.fluidity is not None


def has_fluidity(solid: Material) -> bool:
    """Return whether materials of this class may have steady-state flow."""
    return solid.spectrum().fluidity is not None


def creeps_far(body: LayeredHalfSpace) -> bool:
    """Return whether creep may have an effect at any distance from a load: that of a half-space or of a substrate."""
    return not body.layers or not isinstance(body.substrate, Elastic | None)


def long_wave_compliance(body: LayeredHalfSpace, t: Array | float) -> Array:
    """Return the compliance [1/Pa] at a time t [s] of the substrate, for contacts much wider than the layers; zero on a
    rigid base."""
    return surface_creep(body.base).creep(t)


def short_wave_compliance(body: LayeredHalfSpace, t: Array | float) -> Array:
    """Return the compliance [1/Pa] at a time t [s] of the top layer, for contacts much narrower than it."""
    return surface_creep(surface_material(body)).creep(t)


def relaxed_compliance(body: LayeredHalfSpace) -> Array:
    """Return the relaxed compliance of the substrate, or of the top layer on a rigid base, without its steady-state flow
    [1/Pa], which is never zero."""
    creep = surface_creep(surface_material(body) if body.substrate is None else body.substrate)
    return creep.instantaneous + jnp.sum(jnp.where(creep.rates > 0.0, creep.amplitudes, 0.0))


def is_fluid(body: LayeredHalfSpace) -> Array:
    """Return whether the surface displacement grows without limit under a load, () bool."""
    fluidities = [solid.spectrum().fluidity for solid in solids(body)]
    return jnp.any(jnp.stack([jnp.asarray(0.0 if each is None else each) > 0.0 for each in fluidities]))


def has_zero_instantaneous_compliance(body: LayeredHalfSpace) -> Array | bool:
    """Return whether a solid has J(0) = 0 and does not respond to a step load instantaneously.

    The result is a bool where the class of the material determines it. A rigid base does not count.
    """
    deforming = [solid for solid in solids(body) if not isinstance(solid, Rigid)]
    return any(isinstance(solid, KelvinVoigt) for solid in deforming) or _any_zero_at_first(deforming)


@jax.jit  # one program of every check instead of one for each operation
def _any_zero_at_first(solids: list[Material]) -> Array:
    return jnp.any(jnp.stack([solid.spectrum().instantaneous == 0.0 for solid in solids]))


@jax.jit  # as above
def stiffness_ratio(body: LayeredHalfSpace) -> Array:
    """Return the largest modulus at first of a layer over that of a solid below it, without derivative, (); zero without
    layers. Solids that are rigid at first are left aside."""
    compliances = jax.lax.stop_gradient(spectra(body).instantaneous)
    above, softest_below = compliances[:-1], jax.lax.cummax(compliances, reverse=True)[1:]
    ratios = jnp.where(above > 0.0, softest_below / jnp.where(above > 0.0, above, 1.0), 0.0)
    return jnp.max(ratios, initial=0.0)
