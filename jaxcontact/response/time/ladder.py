"""Positions of the images of a layered body, and the reference response of their fit.

A film that is G times as stiff as what lies below bends under waves of h G^(1/3) and resists stretching under waves
of h G, so images reach several times that far. What a fit is weighted by is the response at first of a body whose moduli and
thicknesses, relative to the top layer's, are rounded to powers of two: it does not follow the body, so the images
are linear in the response, without noise in finite differences.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.response.influence.images import Images, Ladder, fit_images, fit_wavenumbers, image_depths
from jaxcontact.response.stack import SurfaceCompliance, solids, surface_compliance
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


def farthest_image(body: LayeredHalfSpace, times: Array) -> Array:
    """Return the depth [m], (), down to which images lie for responses after each of the times [s], (t,)."""
    each = solids_of(body)
    creep = jnp.stack([solid.creep(times) for solid in solids(body)], 1)
    late = jax.lax.stop_gradient(jnp.where(creep > 0.0, creep, each.compliances))
    stretched = jax.vmap(lambda final: _reach(each._replace(final=final))[1])(late)
    return STRETCHING * jnp.max(stretched)


def wavenumbers(body: LayeredHalfSpace) -> Array:
    """Return the wavenumbers (n,) [rad/m] at which the response is evaluated for its images."""
    return _wavenumbers(solids_of(body))


def _wavenumbers(solids: Solids) -> Array:
    return fit_wavenumbers(solids.thicknesses[0], jnp.sum(solids.thicknesses))


def expand(body: LayeredHalfSpace, values: Array) -> Images:
    """Images of responses at ``wavenumbers``, (..., n), relative to the body's response at first."""
    solids = solids_of(body)
    return fit_images(values, *_ladders(solids, _normal_sizes([_unrelaxed(solids)])))


def expand_shapes(body: LayeredHalfSpace, shapes: Array) -> Images:
    """Images of C_0 and the S_m, (M + 2, n), the film's shape before them: that relative to the response of the top layer on
    a rigid base, C_0 to the body's response at first and the others to that in the end."""
    solids = solids_of(body)
    first = _unrelaxed(solids)
    film = first._replace(compliances=jnp.zeros_like(first.compliances).at[0].set(1.0))
    ladders = _ladders(solids, _normal_sizes([film, first, _relaxed(solids)]))
    return _joined([shapes[:1], shapes[1:2], shapes[2:]], ladders)


def expand_tangential(body: LayeredHalfSpace, values: Array) -> Images:
    """Images of C_0 and the S_m of alpha (L, T, K), (3, M + 1, n), heights (3, M + 1, J + 1).

    Those of L and T are fitted relative to themselves, C_0 at first and the others in the end, those of K to the root of
    L N.
    """
    solids = solids_of(body)

    def sizes(wavenumber: Array) -> Array:
        each = [_responses(rough, wavenumber) for rough in (_unrelaxed(solids), _relaxed(solids))]
        return jnp.concatenate([jnp.stack([L, T, jnp.sqrt(L * N)]) for L, _, N, T in each])

    ladders = _ladders(solids, sizes, densely=True)
    pairs = zip(values, ladders[:3], ladders[3:], strict=True)
    fitted = [_joined([entry[:1], entry[1:]], [first, last]) for entry, first, last in pairs]
    return Images(fitted[0].depths, jnp.stack([images.heights for images in fitted]))


def _joined(values: list[Array], ladders: list[Ladder]) -> Images:
    """Fit images of values (m, n), each array on its own ladder."""
    fitted = [fit_images(some, ladder) for some, ladder in zip(values, ladders, strict=True)]
    return Images(fitted[0].depths, jnp.concatenate([images.heights for images in fitted]))


def _unrelaxed(solids: Solids) -> Solids:
    """Return the body with the instantaneous compliances, rounded, whose response gives the weights."""
    return _rounded(solids, solids.compliances)


def _relaxed(solids: Solids) -> Solids:
    """Return the body with the relaxed compliances, rounded, whose response gives the weights."""
    return _rounded(solids, solids.final)


def _rounded(solids: Solids, compliances: Array) -> Solids:
    """Round the ratios of compliances and of thicknesses to powers of two, and Poisson's ratios."""
    rounded = lambda a: a[0] * jnp.exp2(jnp.round(jnp.log2(a / a[0])))
    poissons = jnp.minimum(jnp.round(STEPS * solids.poissons) / STEPS, LARGEST)
    soft = rounded(jnp.maximum(compliances, jnp.max(compliances) / STIFFEST))
    return Solids(soft, soft, poissons, rounded(solids.thicknesses))


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


def _responses(rough: Solids, wavenumber: Array) -> SurfaceCompliance:
    return surface_compliance(rough.compliances, rough.poissons, rough.thicknesses, wavenumber)


def _normal_sizes(bodies: list[Solids]) -> Callable[[Array], Array]:
    """Return alpha N of each of the bodies, (m, n) at wavenumbers (n,)."""
    return lambda wavenumber: jnp.stack([_responses(rough, wavenumber).normal for rough in bodies])


def _ladders(solids: Solids, sizes: Callable[[Array], Array], *, densely: bool = False) -> list[Ladder]:
    """Return ladders for images relative to each of the sizes, (m, n) at wavenumbers (n,).

    densely: whether depths lie as closely for the waves that stretch layers as for those that bend them.
    """
    bent, stretched = _reach(solids)
    last = STRETCHING * stretched
    dense = jnp.maximum(SHALLOWEST * jnp.sum(solids.thicknesses), last if densely else BENDING * bent)
    depths = image_depths(FIRST * solids.thicknesses[0], dense, last)
    alpha, between = _wavenumbers(solids), 1.0 / jnp.sqrt(depths[1:] * depths[:-1])
    at_nodes, at_steps = jnp.split(sizes(jnp.append(alpha[1:-1], between)), [alpha.size - 2], -1)
    return [Ladder(alpha, depths, *each) for each in zip(at_nodes, at_steps, strict=True)]
