"""The selection of the response formula for a body."""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact.inputs.layers import LayeredHalfSpace, checked_body
from jaxcontact.inputs.materials import Elastic, Material
from jaxcontact.response.base import Response
from jaxcontact.response.half_space import HalfSpace
from jaxcontact.response.layered import Stack
from jaxcontact.response.one_layer import OneLayer
from jaxcontact.response.stack import surface_compliance
from jaxcontact.response.volume import nu_at_first


def response_of(body: LayeredHalfSpace) -> Response:
    """Return the response of a body that has passed ``checked_body``."""
    if not body.layers:
        return HalfSpace(body.substrate)
    layers = body.sublayers()
    if len(layers) == 1 and _has_constant_nu(layers[0].material) and isinstance(body.substrate, Elastic):
        return OneLayer(layers[0], body.substrate)
    return Stack(layers, body.substrate)


def _has_constant_nu(material: Material) -> bool:
    """Return whether Poisson's ratio is independent of time: prescribed, or that of an elastic solid."""
    return material.bulk_modulus is None or isinstance(material, Elastic)


def sideways_compliance(body: LayeredHalfSpace, thickness: Array, wavenumber: Array) -> Array:
    """Return how far a uniform pressure lifts the surface where a film is thicker, over pressure and excess of thickness,
    for excesses that are waves of a wavenumber [rad/m], [1/Pa] of its shape.

    Under a pressure p the film, which cannot widen, presses sideways with s p, s = nu/(1 - nu). Where its thickness exceeds
    the mean ``thickness`` [m] by h', equilibrium along the surface needs the traction s p dh'/dx, to which the body with a
    film of the mean thickness responds: by s alpha K(alpha) p h', K the coupling of ``response.stack``, at first. It is
    exact to first order in h'.
    """
    (film,), base = body.sublayers(), body.substrate
    solids = film.material, base
    compliances = jnp.stack([solid.spectrum().instantaneous for solid in solids])
    poissons = jnp.stack([nu_at_first(solid) for solid in solids])
    ones = jnp.ones_like(wavenumber)
    spread = lambda a: a[:, None, None] * ones
    found = surface_compliance(spread(compliances), spread(poissons), thickness * ones[None], wavenumber)
    return poissons[0] / (1.0 - poissons[0]) * found.coupling


def normal_response(body: LayeredHalfSpace, k: Array, t: Array | float = 0.0) -> Array:
    """Return N(k, t): normal surface displacement per amplitude of a pressure wave applied as a step at t = 0.

    At k = 0 the response of a half-space is infinite, and ``inf`` is returned, with zero derivative;
    k N stays finite. Source: Wang et al., Tribology Letters 2025,
    doi 10.1007/s11249-025-01990-5, Appendix A (u_z under p), with the correspondence principle of section 2.3 applied
    exactly.

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
    safe = jnp.where(k == 0.0, 1.0, k)
    response = jnp.where(k == 0.0, jnp.inf, response_of(body).step(safe, t, t) / safe)
    return jnp.where(valid, response, jnp.nan)
