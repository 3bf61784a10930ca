"""Where the images of a layered body lie, and what they are fitted relative to.

A film that is G times as stiff as what lies below bends under waves of h G^(1/3) and resists stretching under waves
of h G, so images reach several times that far. What a fit is weighted by is the response at first of a body whose moduli and
thicknesses, relative to the top layer's, are rounded to powers of two: it does not follow the body, so the images
are linear in the response, without noise in finite differences.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.response.influence.images import Images, Ladder, fit_images, fit_wavenumbers, image_depths
from jaxcontact.response.stack import solids, surface_compliance
from jaxcontact.response.time.band import horizon, may_have_no_slowest
from jaxcontact.response.volume import nu_at_first

FIRST = 1.6  # least depth over the thickness of the top layer
SHALLOWEST = 30.0  # depth over all layers down to which images always lie closely
BENDING = 13.0  # the same over the longest bending wave
STRETCHING = 50.0  # depth down to which they lie at all, over the longest wave of stretching
STIFFEST = 2.0e6  # ratio of moduli beyond which they reach no farther
STEPS, LARGEST = (
    8.0,
    0.498,
)  # of the rounded Poisson's ratio: in a unit, and the last, whose weight is not yet zero


class Solids(NamedTuple):
    """The solids from the top to the half-space: compliances at first and in the end [1/Pa], Poisson's ratios,
    (layers + 1,); thicknesses [m], (layers,). In the end is the horizon of ``response.time.band`` or, without one, at
    first."""

    compliances: Array
    final: Array
    poissons: Array
    thicknesses: Array


def solids_of(body: LayeredHalfSpace) -> Solids:
    """Without derivative."""
    each = solids(body)
    first = jnp.stack([solid.spectrum().instantaneous for solid in each])
    poissons = jnp.stack([nu_at_first(solid) for solid in each])
    thicknesses = jnp.stack([jnp.asarray(layer.thickness, float) for layer in body.layers])
    final = first
    if may_have_no_slowest(body):
        last = horizon(body)
        late = jnp.stack([solid.creep(jnp.where(jnp.isfinite(last), last, 0.0)) for solid in each])
        final = jnp.where(jnp.isfinite(last), late, first)
    return jax.lax.stop_gradient(Solids(first, final, poissons, thicknesses))


@jax.jit  # of every check, where each operation would be a program of its own
def stiffness_contrast(body: LayeredHalfSpace) -> Array:
    """The largest modulus at first over one of those below it, (), solids aside that are rigid at first."""
    compliances = solids_of(body).compliances
    softest_below, above = jax.lax.cummax(compliances, reverse=True)[1:], compliances[:-1]
    return jnp.max(jnp.where(above > 0.0, softest_below / jnp.where(above > 0.0, above, 1.0), 0.0))


def wavenumbers(body: LayeredHalfSpace) -> Array:
    """Where the response is to be known for its images, (n,) [rad/m]."""
    return _wavenumbers(solids_of(body))


def _wavenumbers(solids: Solids) -> Array:
    return fit_wavenumbers(solids.thicknesses[0], jnp.sum(solids.thicknesses))


def expand(body: LayeredHalfSpace, values: Array) -> Images:
    """Images of responses at ``wavenumbers``, (..., n), relative to the body's response at first."""
    solids = solids_of(body)
    return fit_images(values, *_ladders(solids, _rounded(solids).compliances[None]))


def expand_shapes(body: LayeredHalfSpace, shapes: Array) -> Images:
    """Images of shapes (M, n), the first one relative to that of the top layer on a rigid base, the others to the body's
    response at first."""
    solids = solids_of(body)
    whole = _rounded(solids).compliances
    film = jnp.zeros_like(whole).at[0].set(1.0)
    to_film, to_whole = _ladders(solids, jnp.stack([film, whole]))
    first, others = fit_images(shapes[:1], to_film), fit_images(shapes[1:], to_whole)
    return Images(first.depths, jnp.concatenate([first.heights, others.heights]))


def _rounded(solids: Solids) -> Solids:
    """The body that gives the weights."""
    rounded = lambda a: a[0] * jnp.exp2(jnp.round(jnp.log2(a / a[0])))
    poissons = jnp.minimum(jnp.round(STEPS * solids.poissons) / STEPS, LARGEST)
    soft = jnp.maximum(solids.compliances, jnp.max(solids.compliances) / STIFFEST)
    return Solids(rounded(soft), rounded(soft), poissons, rounded(solids.thicknesses))


def _reach(solids: Solids) -> tuple[Array, Array]:
    """Lengths of the waves under which layers bend and are stretched over what lies below [m], () each.

    Of thickness t, R times as stiff as a solid below them: t R^(1/3) and t R; over a layer of thickness d, whose
    springs give way first, (R t^3 d)^(1/4), or (R t^3 d^3)^(1/6) if they are incompressible, and (R t d)^(1/2).
    """
    j, d = jnp.maximum(solids.final, jnp.max(solids.final) / STIFFEST), solids.thicknesses
    ratio = j[1:] / jax.lax.cummin(j[:-1])
    t, d = jnp.cumsum(d), jnp.append(d[1:], jnp.inf)
    on_layer = jnp.maximum((ratio * t**3 * d) ** 0.25, (ratio * t**3 * d**3) ** (1.0 / 6.0))
    bent = jnp.minimum(t * jnp.cbrt(ratio), on_layer)
    return jnp.max(bent), jnp.max(jnp.minimum(t * ratio, jnp.sqrt(ratio * t * d)))


def _ladders(solids: Solids, compliances: Array) -> list[Ladder]:
    """For images relative to the response of the rounded body with each of the compliances [1/Pa], (m, layers + 1)."""
    bent, stretched = _reach(solids)
    dense = jnp.maximum(SHALLOWEST * jnp.sum(solids.thicknesses), BENDING * bent)
    depths = image_depths(FIRST * solids.thicknesses[0], dense, STRETCHING * stretched)
    alpha, between = _wavenumbers(solids), 1.0 / jnp.sqrt(depths[1:] * depths[:-1])
    rough, where = _rounded(solids), jnp.append(alpha[1:-1], between)
    size = lambda j: surface_compliance(j, rough.poissons, rough.thicknesses, where).normal
    at_nodes, at_steps = jnp.split(jax.vmap(size)(compliances), [alpha.size - 2], -1)
    return [Ladder(alpha, depths, *sizes) for sizes in zip(at_nodes, at_steps, strict=True)]
