"""The normal response of a body by wavenumber: its formula, that of a half-space, and the function for users."""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.pytree import pytree
from jaxcontact.bodies.body import LayeredHalfSpace, checked_body
from jaxcontact.bodies.materials import Elastic, Material
from jaxcontact.response.images import Images
from jaxcontact.response.in_time import Response, Separable, Stack
from jaxcontact.response.one_layer import OneLayer
from jaxcontact.response.stack import nu_at_first, surface_compliance, surface_creep


@pytree
class HalfSpace(Response):
    """A half-space of one material, elastic or viscoelastic: alpha N = (1 - nu) J(t) at every wavenumber.

    J. Boussinesq; the correspondence is exact. With a bulk modulus in place of nu, the creep is ``stack.surface_creep``,
    which is exact as well.
    """

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
        creep, share = surface_creep(self.material), jnp.ones(())
        # the factor apart, so that S_1 is multiplied by the material's own creep
        if self.material.bulk_modulus is None:
            creep, share = self.material.spectrum(), 1.0 - nu_at_first(self.material)
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


def response_of(body: LayeredHalfSpace) -> Response:
    """Return the response of a body that has passed ``checked_body``."""
    if not body.layers:
        return HalfSpace(body.base)
    layers = body.sublayers()
    if len(layers) == 1 and isinstance(body.substrate, Elastic | None):
        film = layers[0].material
        # the closed form needs a Poisson's ratio that is independent of time: prescribed, or that of an elastic solid
        if film.bulk_modulus is None or isinstance(film, Elastic):
            return OneLayer(layers[0], body.substrate)
    return Stack(layers, body.substrate)


def sideways_compliance(body: LayeredHalfSpace, thickness: Array, wavenumber: Array) -> Array:
    """Return how far a uniform pressure lifts the surface where a film is thicker, over pressure and excess of thickness,
    for excesses that are waves of a wavenumber [rad/m], [1/Pa] of its shape.

    Under a pressure p the film, which cannot widen, presses sideways with s p, s = nu/(1 - nu). Where its thickness exceeds
    the mean ``thickness`` [m] by h', equilibrium along the surface needs the traction s p dh'/dx, to which the body with a
    film of the mean thickness responds: by s alpha K(alpha) p h', K the coupling of ``response.stack``, at first. It is
    exact to first order in h'.
    """
    (film,), base = body.sublayers(), body.base
    solids = film.material, base
    compliances = jnp.stack([solid.spectrum().instantaneous for solid in solids])
    poissons = jnp.stack([nu_at_first(solid) for solid in solids])
    ones = jnp.ones_like(wavenumber)
    everywhere = lambda a: a[:, None, None] * ones
    found = surface_compliance(
        everywhere(compliances), everywhere(poissons), thickness * ones[None], wavenumber
    )
    return poissons[0] / (1.0 - poissons[0]) * found.coupling


def normal_response(body: LayeredHalfSpace, k: Array, t: Array | float = 0.0) -> Array:
    """Return N(k, t): normal surface displacement per amplitude of a pressure wave applied as a step at t = 0.

    At k = 0 the response of a half-space is infinite, and ``inf`` is returned, with zero derivative;
    k N stays finite. On a rigid base (substrate None) it is the displacement under a uniform pressure over that, the sum
    of h J (1 - 2 nu)/(2 (1 - nu)) of the layers, which cannot widen. It is the limit for long waves if all layers are
    bonded; along a long wave a loose layer can widen, and N tends to h J (1 - nu)/2 (one layer). Source:
    Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, Appendix A (u_z under p), with the correspondence
    principle of section 2.3 applied exactly.

    Args:
        body: a ``LayeredHalfSpace``.
        k: wavenumber [rad/m], >= 0, of any shape.
        t: time [s], >= 0; broadcasts with k.

    Returns:
        N [m/Pa] of the broadcast shape; nan where a value traced by jit or vmap is outside its range.

    Raises:
        ValueError: an invalid or unsupported body, a negative k or a negative t.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> float(jc.normal_response(glass, 1e6) * 1e6)     # (1 - nu)/G
        2.5e-11
    """
    body, valid = checked_body(body)
    valid = valid & checks.non_negative("k [rad/m]", k) & checks.non_negative("t [s]", t)
    k, t = jnp.asarray(k, float), jnp.asarray(t, float)
    safe, response = jnp.where(k == 0.0, 1.0, k), response_of(body)
    if body.substrate is None:
        scaled = response.mean_response(*jnp.broadcast_arrays(k, t, t))
        found = scaled * jnp.where(k == 0.0, body.height, 1.0 / safe)
    else:
        found = jnp.where(k == 0.0, jnp.inf, response.mean_response(safe, t, t) / safe)
    return jnp.where(valid, found, jnp.nan)
