"""The response of a stack in time as a sum of products: alpha N(alpha, t) ~ C_0(alpha) + sum_k C_k(alpha) f_k(t).

Where several solids creep, the decay rates of the surface fill bands and move with the wavenumber. Fixed
rates lambda_k, some four a decade, serve all of them to a known error,

    alpha N ~ C_0 + sum_k C_k (1 - exp(-lambda_k t)) + flow t,

or, at the complex frequency s, with compliances s J(s) in the recursion of ``response.stack``,

    alpha N ~ C_0 + sum_k lambda_k C_k/(s + lambda_k) + flow/s.

C_0 is the response under the compliances at t = 0, and exact. The top layer's own creep on a rigid base,
A_22 J(t), is taken out with the rates of its material (with a bulk modulus, ``response.stack.film_shape`` and
``film_creep``). The rest R(s, alpha), at frequencies s = i omega over
the band, is nearly of low rank: what it is at any wavenumber is a combination of what it is at a few,

    R(s, alpha) ~ sum_m R(s, alpha_m) S_m(alpha),

which a QR decomposition with column pivots picks, and only there are the lambda_k C_k found. Both steps are
linear least squares. The combination also has to hold when any one solid changes, or the derivatives with
respect to one of three equal layers, which the response itself cannot tell apart, would be 2 % of the
response off: so it is fitted to a second body besides, in which each solid's clock runs at another speed
(then 1e-6).

Largest error relative to the response, over all wavenumbers and from a tenth of the shortest to ten times
the longest of the times 1/lambda_k, for 24 rates and 8 shapes:

    the paper's film as three equal layers          2e-7
    it with a bulk modulus, as one layer            2e-7
    rubber of 7 decades on glass, two layers        3e-7
    the paper's film on a Maxwell half-space        2e-8
    three Maxwell layers on a Maxwell half-space    7e-6
    coating on rubber, 80 times to 80 000 times
    as stiff as it                                  6e-3

A layer that does not flow over a solid that does has no slowest rate: the longer the wave, the slower it sinks.
With 36 rates and 20 shapes, up to the horizon:

    elastic layer on a Maxwell half-space           4e-5
    it 100 times as stiff, or as soft               9e-5
    elastic layer on a fluid layer on steel         2e-6
    standard solid on a Burgers half-space          2e-4

Choices are made for rounded parameters, so that values are smooth: central differences with steps of 1e-5 agree with
derivatives to 1e-9, and both modes to round-off.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import replace
from jaxcontact.bodies.body import LayeredHalfSpace
from jaxcontact.bodies.materials import Material, Rigid, Spectrum
from jaxcontact.response.half_space import Separable, own_creep
from jaxcontact.response.images import Images, Ladder, decomposed, fit_images, fit_wavenumbers, image_depths
from jaxcontact.response.stack import (
    Spectra,
    SurfaceCompliance,
    alpha_N,
    compliances,
    film_compliance,
    film_creep,
    film_shape,
    loose_layers,
    nu_at_first,
    solids,
    spectra,
    step_response,
    surface_compliance,
    uniaxial,
)

# The band of decay rates of a body, and the body with rounded parameters by which it and other choices are made.
#
# Rates, frequencies, weights and picked wavenumbers are choices of the expansion
# that carry no derivative. They are made for a body whose parameters are rounded to powers of 2^(1/8), so that they
# stay the same while a parameter changes by less than a few per cent: values are then smooth in the parameters and
# finite differences agree with derivatives.


MARGIN = 2.0  # factor by which the rates reach beyond those of the solids
SAMPLED = 10.0  # factor by which the frequencies reach beyond the rates
SOFT = 3.0  # compliance that a layer finds in its surroundings, over that of the softest other solid
REACH = 1e4  # factor by which the rates reach below those of the solids where there is no slowest one
MORE_RATES, MORE_SHAPES = 1.5, 2.5  # factors of the numbers of rates and shapes where there is no slowest one
HORIZON = 0.05  # latest time over the longest 1/rate where there is no slowest one
ROUNDING = 8.0  # steps of the rounding in a factor of two


class Window(NamedTuple):
    """rates: common rates [1/s], (K,); period: 1/s [s] at the sampled frequencies, (2 K,) imaginary; times [s] at which
    the error is measured, (K,); horizon: the latest time for which the expansion is made [s], () inf without one."""

    rates: Array
    period: Array
    times: Array
    horizon: Array


def creeps(solid: Material) -> bool:
    spectrum = solid.spectrum()
    return spectrum.rates.size > 0 or spectrum.fluidity is not None


def has_fluidity(solid: Material) -> bool:
    """Return whether materials of this class may have steady-state flow."""
    return solid.spectrum().fluidity is not None


def rounded(body: LayeredHalfSpace) -> LayeredHalfSpace:
    """Return the body with rounded parameters, without derivative."""
    layers = [
        replace(layer, material=_rounded_material(layer.material), thickness=_power(layer.thickness))
        for layer in body.sublayers()
    ]
    return replace(body, layers=tuple(layers), substrate=body.substrate and _rounded_material(body.substrate))


def _rounded_material(material: Material) -> Material:
    """Round a material; of nu its distance from 1/2 is rounded."""
    given = {name: value for name, value in vars(material).items() if value is not None}
    change = {
        n: 0.5 - _power(0.5 - jnp.asarray(v, float)) if n == "nu" else _power(v) for n, v in given.items()
    }
    return replace(material, **change)


def _power(value: Array | float) -> Array:
    """Round to the nearest power of 2^(1/8); zero stays zero."""
    value = jax.lax.stop_gradient(jnp.asarray(value, float))
    return jnp.where(value > 0.0, jnp.exp2(jnp.round(ROUNDING * jnp.log2(value)) / ROUNDING), 0.0)


def may_have_no_slowest(body: LayeredHalfSpace) -> bool:
    """Return whether a solid may flow below a layer that may not, according to their classes.

    The rates of such a body have no lower bound: its layer resists bending the less, the longer the wave.
    """
    each = solids(body)
    may_rest = [not has_fluidity(solid) or "fluidity" in solid.may_be_zero for solid in each]
    return any(
        may_rest[i] and has_fluidity(each[j]) for i in range(len(each)) for j in range(i + 1, len(each))
    )


def horizon(body: LayeredHalfSpace) -> Array:
    """Return the latest time for which an expansion is made [s], () inf where the rates have a lower bound."""
    flowing = spectra(body).fluidity > 0.0
    # a solid that flows below a layer that does not
    no_slowest = (jnp.cumsum(~flowing[:-1]) > 0) & flowing[1:]
    return jnp.where(jnp.any(no_slowest), HORIZON * REACH / band(body)[0], jnp.inf)


def window(body: LayeredHalfSpace, count: int) -> Window:
    """Return ``count`` rates for a rounded body, and what goes with them."""
    (low, high), last = band(body), horizon(body)
    endless = jnp.isfinite(last)
    low = jnp.where(endless, low / REACH, low)
    lowest = jnp.where(endless, low * SAMPLED, low / SAMPLED)
    latest = jnp.where(endless, last, SAMPLED / low)
    period = -1j / spread(lowest, high * SAMPLED, 2 * count)
    return Window(spread(low, high, count), period, spread(1.0 / (high * SAMPLED), latest, count), last)


def spread(low: Array, high: Array, count: int) -> Array:
    """Return points evenly spaced in their logarithm, (count,)."""
    return low * (high / low) ** jnp.linspace(0.0, 1.0, count)


def band(body: LayeredHalfSpace) -> tuple[Array, Array]:
    """Lowest and highest common rate [1/s] for the body's solids, () each.

    The poles of a stack lie where some moduli s/h(s) are positive and others negative, between the
    retardation and the relaxation rates of its solids. Only a fluid, whose retardation takes for ever, is
    held by the springs around it, and by that of its volume.
    """
    each = spectra(body)
    if body.substrate is None:  # a rigid base has no rate and holds nothing back
        each = jax.tree.map(lambda a: a[:-1], each)
    first, total = each.instantaneous, each.instantaneous + jnp.sum(each.amplitudes, -1)
    volume = [1.0 / solid.bulk_modulus for solid in solids(body) if solid.bulk_modulus is not None]
    softest = jnp.max(jnp.concatenate([total, jnp.asarray(volume, float)]))
    slowest = each.fluidity / (total + SOFT * softest)
    stiff = jnp.where(first > 0.0, first, jnp.min(jnp.where(first > 0.0, first, 1e-3 * total)) / SOFT)
    given = each.fluidity + jnp.sum(each.amplitudes * each.rates, -1)
    fastest = jnp.max(each.rates, -1, initial=0.0) + given / stiff
    rates = jnp.concatenate([each.rates.ravel(), slowest, fastest])
    high = jnp.max(rates)
    low = jnp.min(jnp.where(rates > 0.0, rates, jnp.inf))
    moves = high > 0.0
    return jnp.where(moves, low, 1.0) / MARGIN, jnp.where(moves, high, 1.0) * MARGIN


# Positions of the images of a layered body, and the reference response of their fit.
#
# A film that is G times as stiff as what lies below bends under waves of h G^(1/3) and resists stretching under waves
# of h G, so images reach several times that far. What a fit is weighted by is the response at first of a body whose
# moduli and thicknesses, relative to the top layer's, are rounded to powers of two: it does not follow the body, so
# the images are linear in the response, without noise in finite differences.


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
    """The solids from the top to the half-space: compliances at first and in the end [1/Pa], Poisson's ratios, and whether
    each is rigid, (layers + 1,); thicknesses [m], (layers,), and whether layers are loose, likewise or None. In the end is
    at the ``horizon`` or, without one, at first."""

    compliances: Array
    final: Array
    poissons: Array
    thicknesses: Array
    rigid: Array
    loose: Array | None


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
    rigid = jnp.array([isinstance(solid, Rigid) for solid in each])
    return jax.lax.stop_gradient(Solids(first, final, poissons, thicknesses, rigid, loose_layers(body)))


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
    return fit_images(long_waves_kept(body, values), *_ladders(solids, _normal_sizes([_unrelaxed(solids)])))


def expand_shapes(body: LayeredHalfSpace, shapes: Array) -> Images:
    """Images of C_0 and the S_m, (M + 2, n), the film's shape before them: that relative to the response of the top layer on
    a rigid base, C_0 to the body's response at first and the others to that in the end."""
    solids = solids_of(body)
    first = _unrelaxed(solids)
    film = first._replace(compliances=jnp.zeros_like(first.compliances).at[0].set(1.0))
    ladders = _ladders(solids, _normal_sizes([film, first, _relaxed(solids)]))
    shapes = long_waves_kept(body, shapes)
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
    values = long_waves_kept(body, values)
    pairs = zip(values, ladders[:3], ladders[3:], strict=True)
    fitted = [_joined([entry[:1], entry[1:]], [first, last]) for entry, first, last in pairs]
    return Images(fitted[0].depths, jnp.stack([images.heights for images in fitted]))


def long_waves_kept(body: LayeredHalfSpace, values: Array) -> Array:
    """Return responses (..., n) with, on a rigid base, their limit for long waves at wavenumber zero in place of that under
    a uniform traction (``response.stack.alpha_LKNT``)."""
    return values if body.substrate is not None else values.at[..., 0].set(0.0)


def _joined(values: list[Array], ladders: list[Ladder]) -> Images:
    """Fit images of values (m, n), each array on its own ladder."""
    fitted = [fit_images(some, ladder) for some, ladder in zip(values, ladders, strict=True)]
    return Images(fitted[0].depths, jnp.concatenate([images.heights for images in fitted]))


def _unrelaxed(solids: Solids) -> Solids:
    """Return the body with the instantaneous compliances, rounded, whose response gives the weights."""
    return _rounded_solids(solids, solids.compliances)


def _relaxed(solids: Solids) -> Solids:
    """Return the body with the relaxed compliances, rounded, whose response gives the weights."""
    return _rounded_solids(solids, solids.final)


def _rounded_solids(solids: Solids, compliances: Array) -> Solids:
    """Round the ratios of compliances and of thicknesses to powers of two, and Poisson's ratios."""
    rounded = lambda a: a[0] * jnp.exp2(jnp.round(jnp.log2(a / a[0])))
    poissons = jnp.minimum(jnp.round(STEPS * solids.poissons) / STEPS, LARGEST)
    soft = rounded(jnp.maximum(compliances, jnp.max(compliances) / STIFFEST))
    soft = jnp.where(solids.rigid, 0.0, soft)
    return solids._replace(
        compliances=soft, final=soft, poissons=poissons, thicknesses=rounded(solids.thicknesses)
    )


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
    return surface_compliance(rough.compliances, rough.poissons, rough.thicknesses, wavenumber, rough.loose)


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


# The response in time as a sum of products: alpha N(alpha, t) ~ C_0(alpha) + sum_k C_k(alpha) f_k(t).
#
# The decay rates of a layered body depend weakly on the wavenumber, through the stiffness c_j(alpha) of
# ``response.normal``: each lies in a band [rho(c_min), rho(c_max)]. Within a band
#
#     exp(-rho t) ~ sum_m l_m(log rho) exp(-lambda_m t),
#
# with l_m the Lagrange polynomials on Chebyshev nodes log lambda_m. All wavenumbers then share the rates
# lambda_m, and the hereditary integral becomes a handful of fields
#
#     eta_k' = p - lambda_k eta_k,      u = C_0 * p + sum_k lambda_k C_k * eta_k,
#
# where an unlimited flow is lambda = 0 with the fluidity for lambda C. The film's own creep is one shape
# in alpha for all its rates, so fields are mixed before they meet a kernel. For the paper's film one node
# a band is good to 4e-8, two to 5e-11; for a film as stiff as its substrate two give 3e-4, three 8e-5.


DEFAULT_NODES = 2
CHECK_TIMES = np.geomspace(1e-3, 1e2, 16)


def separate_bands(
    start: Array,
    film: Array,
    spectrum: Spectrum,
    amplitude: Array,
    rho: Array,
    nodes: int,
    exact: Callable[[Array], Array],
) -> Separable:
    """The separable form of start + film sum_i J_i (...) + sum_jk amplitude_jk (1 - exp(-rho_jk t)).

    start, film: (n,) over wavenumbers; spectrum: of the film; amplitude [1/Pa] and rho [1/s]: (n, elements,
    bands); nodes: rates a band, static; exact: the response at times (m, 1), to measure the error.
    """
    own_rates, fluidities = own_creep(spectrum)
    shapes, rates = [film], [own_rates]
    points, least = np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes), float(np.finfo(float).tiny)
    for k in range(rho.shape[-1]):
        # A material that may flow but has no fluidity, or one too small for its rates to be normal numbers, has a band of
        # zeros: it is kept as the one rate zero with rho itself, so that the derivative with respect to the fluidity is
        # there.
        still = jnp.max(rho[..., k]) <= least
        log_rho = jnp.log(jnp.where(still, 1.0, jnp.maximum(rho[..., k], least)))

        # Chebyshev nodes log lambda_m of the band, and the Lagrange polynomials l_m(log rho) times lambda_m.
        low, high = jnp.min(log_rho), jnp.max(log_rho)
        middle, half = (low + high) / 2.0, jnp.maximum((high - low) / 2.0, 1e-6)
        xi = (log_rho - middle) / half
        common, shares = jnp.exp(middle + half * points), []
        for m in range(nodes):
            value = jnp.ones_like(xi)
            for other in np.delete(points, m):
                value = value * (xi - other) / (points[m] - other)
            shares.append(common[m] * value)
        each = jnp.stack(shares)
        flow = jnp.where(still, jnp.zeros_like(each).at[0].set(rho[..., k]), each)

        shapes += list(jnp.sum(amplitude[..., k] * flow, -1))
        rates.append(jnp.where(still, 0.0, common))
    bands = jnp.eye(len(shapes) - 1)
    mix = jnp.zeros((len(shapes), own_rates.size + len(shapes) - 1))
    mix = mix.at[0, : own_rates.size].set(fluidities).at[1:, own_rates.size :].set(bands)
    own = jnp.append(spectrum.instantaneous, mix[0])
    result = Separable(jnp.concatenate(rates), jnp.stack([start, *shapes]), mix, own, jnp.zeros(()))
    return replace(result, error=separation_error(result, exact))


def separation_error(separable: Separable, exact: Callable[[Array], Array]) -> Array:
    """Largest relative deviation from the exact response at times spread around every rate."""
    times = check_times(separable.rates)[:, None]
    return jnp.max(relative_errors(products(separable, separable.terms, times), exact(times)))


def relative_errors(found: Array, exact: Array) -> Array:
    """Return |found - exact|/exact, zero where both are zero, as of a body that cannot be compressed on a rigid base."""
    return jnp.abs(found - exact) / jnp.where(exact == 0.0, 1.0, exact)


def check_times(rates: Array) -> Array:
    """Times [s] spread around every rate [1/s], zero without any."""
    positive = jnp.where(rates > 0.0, rates, jnp.max(rates, initial=1.0))
    return (jnp.asarray(CHECK_TIMES)[:, None] / positive).ravel() if rates.size else jnp.zeros(1)


def products(separable: Separable, terms: Array, times: Array) -> Array:
    """The sum of products at times (t, 1) of terms (M + 1, n) in the place of its own, (t, n)."""
    growth = times * phi1(times * separable.rates)
    return terms[0] + growth @ separable.mix.T @ terms[1:]


DEFAULT_RATES, DEFAULT_SHAPES = 32, 12
CLOCKS = 4.0  # the fastest over the slowest clock of the second body
SHARE = 0.1  # weight of the second body in the combination
CUTOFF = 1e-12  # singular values below this part of the largest are discarded
SHAPE_CUTOFF = (
    1e-9  # the same in the fit of the shapes: smaller ones are rounding, and derivatives would follow it
)
CANDIDATES = 120  # wavenumbers of which some are picked, about
STRIDE = 4  # the error is measured at every fourth wavenumber


def separate(
    body: LayeredHalfSpace, wavenumber: Array, rates: int = DEFAULT_RATES, shapes: int = DEFAULT_SHAPES
) -> Separable:
    """Expand the response of a body with at least one layer at the wavenumbers >= 0, (n,) [rad/m].

    rates: number of common rates besides those of the top layer's material; shapes: number of shapes besides the top
    layer's own; both static, and more of them where the rates have no lower bound. Rates, picked
    wavenumbers and weights carry no derivative, all else does.
    """
    top = body.sublayers()[0]
    wavenumber = jnp.asarray(wavenumber, float)
    own, at_once = film_shapes(body, wavenumber), film_creep(top).instantaneous
    if not any(creeps(solid) for solid in solids(body)):
        start = alpha_N(body, wavenumber, spectra(body).instantaneous)
        return Separable(
            jnp.zeros(0), jnp.stack([start, own]), jnp.zeros((1, 0)), at_once[None], jnp.zeros(())
        )
    if may_have_no_slowest(body):
        rates, shapes = int(MORE_RATES * rates), int(MORE_SHAPES * shapes)
    rough = rounded(body)
    chosen = window(rough, rates)
    alike = wavenumber * jax.lax.stop_gradient(jnp.asarray(top.thickness)) / rough.layers[0].thickness
    expected, samples = _sampled(rough, alike, chosen.period), _sampled(body, wavenumber, chosen.period)
    weights = weights_of(expected.response)
    common, fluidities = common_rates(body, chosen.rates)
    terms, mix = fitted(samples.rest, expected.rest, weights, chosen, common, shapes)
    result = Separable(
        rates=common,
        terms=jnp.concatenate([jnp.stack([samples.start, own]), terms]),
        mix=jnp.concatenate([fluidities[None], mix]),
        film=jnp.append(at_once, fluidities),
        error=jnp.zeros(()),
        horizon=chosen.horizon,
    )
    # the largest relative deviation from the exact response at some of the wavenumbers, without derivative
    body, held, times = *jax.lax.stop_gradient((body, result)), chosen.times[:, None]
    summed = products(held, held.terms[:, ::STRIDE], times)
    exact = step_response(body, wavenumber[::STRIDE], times)
    return replace(result, error=jnp.max(relative_errors(summed, exact)))


def fitted(
    rest: Array,
    expected: Array,
    weights: Array,
    chosen: Window,
    rates: Array,
    shapes: int,
) -> tuple[Array, Array]:
    """Return the shapes S_m (shapes, n) and the mix (shapes, K) of lambda_k C_k = sum_m mix[m, k] S_m.

    rest: ``Samples.rest`` of n responses, (r, n); expected: the same of the rounded body, by which responses are picked;
    weights: ``weights_of`` those, (r, n); rates: lambda_k [1/s], (K,).
    """
    # R(s, alpha) ~ sum_m R(s, alpha_m) S_m(alpha): responses picked by the rounded body, and the S_m by least squares.
    stride = max(1, rest.shape[1] // CANDIDATES)
    picked = stride * picks(expected[:, ::stride], weights[:, ::stride], shapes)
    few = rest[:, picked]
    of_few = lambda target, weight: combination(few, target, weight, SHAPE_CUTOFF)
    terms = jax.vmap(of_few, (1, 1), 1)(rest, weights)
    # R(s, alpha_m) ~ sum_k mix[m, k]/(s + lambda_k), by least squares.
    unit = jnp.where(rates > 0.0, rates, chosen.rates[0])
    basis = as_real(unit / (1.0 / chosen.period[:, None] + rates))
    first = slice(len(basis))
    mix = jax.vmap(combination, (None, 1, 1), 1)(basis, few[first], weights[first, picked])
    mix = (mix * unit[:, None]).T

    # Shapes, and more so their derivatives, are large in combinations that the mix hardly contains. The sum does not feel
    # them, but the images of each shape have a rounding error relative to it, with which derivatives by Poisson's ratio
    # were up to a fifth of the response off. In the principal directions of the mix, in which each shape has the size of
    # the response for which it stands, a large combination comes with a small factor. The directions carry no derivative.
    size = jnp.sqrt(jnp.sum(jax.lax.stop_gradient(mix) ** 2, 1, keepdims=True))
    size = jnp.where(size > 0.0, size, 1.0)
    principal = decomposed((mix / size).T).right
    return principal @ (size * terms), principal @ (mix / size)


class Samples(NamedTuple):
    """The rest R of the module's formula at frequencies, [1/Pa].

    start: C_0, (n,); rest: of the body at all frequencies, real parts above imaginary ones, and below them that of
    the second body at every other, (r, n); response: of the body, complex, (s, n).
    """

    start: Array
    rest: Array
    response: Array


def _sampled(body: LayeredHalfSpace, wavenumber: Array, period: Array) -> Samples:
    """Compute both bodies at the frequencies s = 1/period, (s,)."""
    j = sampled_compliances(spectra(body), period)
    response = alpha_N(body, wavenumber, j[..., None])
    own, film = film_shapes(body, wavenumber), film_compliance(body.sublayers()[0], j[0])
    return samples_of(response, own * (film[1:] - film[0])[:, None])


def film_shapes(body: LayeredHalfSpace, wavenumber: Array) -> Array:
    """Return ``film_shape`` of the top layer at wavenumbers (n,) [rad/m], of a body on a rigid base at wavenumber zero its
    shortening under a uniform pressure over that, its creep and the thickness of all layers."""
    top = body.sublayers()[0]
    shape = film_shape(top, wavenumber)
    if body.substrate is not None:
        return shape
    nu = nu_at_first(top.material)
    creep = film_creep(top).instantaneous
    alone = uniaxial(nu) * top.material.spectrum().instantaneous * top.thickness / (creep * body.height)
    return jnp.where(wavenumber == 0.0, alone, shape)


def sampled_compliances(spectra: Spectra, period: Array) -> Array:
    """Compliances [1/Pa] at t = 0, at 1/s = period, and of the second body, (layers + 1, 1 + 3/2 period.size).

    A solid that is rigid at first is taken as it is at the highest frequency.
    """
    first = spectra.instantaneous
    first = jnp.where(first > 0.0, first, compliances(spectra, jnp.min(jnp.abs(period))))
    speeds = CLOCKS ** jnp.linspace(-0.5, 0.5, first.size)
    second = spectra._replace(rates=spectra.rates * speeds[:, None], fluidity=spectra.fluidity * speeds)
    each = [first[:, None], compliances(spectra, period), compliances(second, period[::2])]
    return jnp.concatenate(each, 1)


def samples_of(responses: Array, known: Array | float = 0.0) -> Samples:
    """Return the samples of responses (1 + 3/2 s, n) at ``sampled_compliances``.

    known: the part that is not to be fitted, (3/2 s, n).
    """
    start, response = jnp.real(responses[0]), responses[1:]
    rest, count = response - start - known, 2 * (len(response) // 3)
    return Samples(start, jnp.concatenate([as_real(rest[:count]), as_real(rest[count:])]), response[:count])


def weights_of(sizes: Array) -> Array:
    """Return weights that make the rows of ``Samples.rest`` relative to sizes at the frequencies, (s, n), without
    derivative, (r, n)."""
    sizes = jnp.abs(jax.lax.stop_gradient(sizes))
    relative = jnp.where(sizes > 0.0, 1.0 / jnp.where(sizes > 0.0, sizes, 1.0), 0.0)
    second = SHARE * relative[::2]
    return jnp.concatenate([relative, relative, second, second])


def as_real(values: Array) -> Array:
    return jnp.concatenate([jnp.real(values), jnp.imag(values)])


def picks(matrix: Array, weights: Array, count: int) -> Array:
    """Return the indices of columns of a matrix (r, n) that stand for all, (count,), greedily.

    Next comes the column that those before represent worst, each column with its own weights, (r, n).
    """
    matrix, weights = jax.lax.stop_gradient((matrix, weights))

    def take(state: tuple[Array, Array], m: Array) -> tuple[tuple[Array, Array], Array]:
        rest, bases = state  # (r, n) and, for each column, orthonormal directions, (count, r, n)
        best = jnp.argmax(jnp.sum(rest**2, 0))
        direction = weights * matrix[:, best, None]
        direction = direction / jnp.sqrt(jnp.maximum(jnp.sum(direction**2, 0), jnp.finfo(float).tiny))
        for _ in range(2):  # once more against round-off
            direction = direction - jnp.einsum(
                "krn,kn->rn", bases, jnp.einsum("krn,rn->kn", bases, direction)
            )
        size = jnp.sqrt(jnp.sum(direction**2, 0))
        direction = jnp.where(size > CUTOFF, direction / jnp.where(size > CUTOFF, size, 1.0), 0.0)
        rest = rest - direction * jnp.sum(direction * rest, 0)
        return (rest, bases.at[m].set(direction)), best

    start = (weights * matrix, jnp.zeros((count, *matrix.shape)))
    return jax.lax.scan(take, start, jnp.arange(count))[1]


def combination(matrix: Array, target: Array, weights: Array, cutoff: float = CUTOFF) -> Array:
    """Return the x (m,) for least sum of (weights (matrix x - target))^2, matrix (r, m), target and weights (r,).

    The decomposition carries no derivative: two steps of refinement give those by the target and by the matrix times x,
    and a last one, whose value is zero, that by the matrix in the normal equations, so that first derivatives are those of
    the solution whatever its residual.
    """
    matrix, target = weights[:, None] * matrix, weights * target
    held = jax.lax.stop_gradient(matrix)
    size = jnp.sqrt(jnp.sum(held**2, 0))
    size = jnp.where(size > 0.0, size, 1.0)
    matrix, held = matrix / size, held / size
    singular = decomposed(held)
    x = singular.truncated(target, cutoff)
    for _ in range(2):
        x = x + singular.truncated(target - matrix @ x, cutoff)
    residual = jax.lax.stop_gradient(target - matrix @ x)
    x = x + singular.normal((matrix - held).T @ residual, cutoff)
    return x / size


def pivots(matrix: Array, count: int) -> Array:
    """Indices of the columns that a QR decomposition with column pivots takes first, (count,)."""

    def take(rest: Array, _: None) -> tuple[Array, Array]:
        sizes = jnp.sum(rest**2, 0)
        best = jnp.argmax(sizes)
        direction = rest[:, best] / jnp.sqrt(jnp.where(sizes[best] > 0.0, sizes[best], 1.0))
        return rest - jnp.outer(direction, direction @ rest), best

    return jax.lax.scan(take, jax.lax.stop_gradient(matrix), None, count)[1]


def least_squares(matrix: Array, target: Array) -> Array:
    """The least-squares solution; each of the two steps of refinement carries one order of derivatives."""
    singular = decomposed(matrix)
    change = lambda rest: singular.truncated(rest.T, CUTOFF).T
    solution = change(target)
    for _ in range(2):
        solution = solution + change(target - matrix @ solution)
    return solution


def common_rates(body: LayeredHalfSpace, grid: Array) -> tuple[Array, Array]:
    """The top layer's rates, the grid and zero for a flow [1/s], and the top layer's fluidities, (K,) each."""
    top = film_creep(body.sublayers()[0])
    rates = jnp.concatenate([top.rates, grid])
    fluidities = jnp.concatenate([top.rates * top.amplitudes, jnp.zeros_like(grid)])
    if not any(has_fluidity(solid) for solid in solids(body)):
        return rates, fluidities
    flow = 0.0 if top.fluidity is None else top.fluidity
    return jnp.append(rates, 0.0), jnp.append(fluidities, flow)
