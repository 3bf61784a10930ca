"""From a body to its response: the one place that knows which formula holds for which body."""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact.inputs.layers import LayeredHalfSpace, checked_body
from jaxcontact.inputs.materials import Elastic, Material
from jaxcontact.response.base import Response
from jaxcontact.response.half_space import HalfSpace
from jaxcontact.response.layered import Stack
from jaxcontact.response.one_layer import OneLayer


def response_of(body: LayeredHalfSpace) -> Response:
    """The response of a body that has passed ``checked_body``."""
    if not body.layers:
        return HalfSpace(body.substrate)
    layers = body.sublayers()
    if len(layers) == 1 and _keeps_nu(layers[0].material) and isinstance(body.substrate, Elastic):
        return OneLayer(layers[0], body.substrate)
    return Stack(layers, body.substrate)


def _keeps_nu(material: Material) -> bool:
    """Whether its Poisson's ratio is the same at all times: given, or that of an elastic solid."""
    return material.bulk_modulus is None or isinstance(material, Elastic)


def normal_response(body: LayeredHalfSpace, k: Array, t: Array | float = 0.0) -> Array:
    """N(k, t): normal surface displacement per amplitude of a pressure wave that steps on at t = 0.

    At k = 0 the response of a half-space is infinite, and ``inf`` is what comes back, with zero derivative;
    k N stays finite. Source: the paper's Appendix A (u_z under p) with the correspondence principle of its
    section 2.3 made exact.

    Args:
        body: a ``LayeredHalfSpace``.
        k: wavenumber [rad/m], >= 0, of any shape.
        t: time [s], >= 0; broadcasts with k.

    Returns:
        N [m/Pa] of the broadcast shape; nan where jit or vmap brought a value outside its range.

    Raises:
        ValueError: a body that cannot be computed, a negative k or a negative t.

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
