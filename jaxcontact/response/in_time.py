"""The response in time as a sum of products, alpha N(alpha, t) ~ C_0(alpha) + sum_k C_k(alpha) f_k(t), and that of a stack.

The march in time needs a response in this form, ``Separable``. A half-space and a film on an elastic
substrate (``response.normal``) have it in closed form; that of any other stack of layers is found here.

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

picked one after the other (``picks``), and only there are the lambda_k C_k found. Both steps (``fitted``) are linear least
squares. The combination also has to hold when any one solid changes, or the derivatives with
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
Its response is not of low rank, and each of 36 rates and a flow has a shape of its own (``fitted_to_rates``). Its largest
error up to the horizon, and in brackets that of its images up to 1 and 20 times the longest relaxation time:

    elastic layer on a Maxwell half-space           1e-6 (2e-7, 2e-6)
    standard solid on a Burgers half-space          2e-5 (5e-7, 1e-6)
    elastic layer on a fluid layer on steel         1e-6 (5e-7, 1e-5)
    standard solid on a Burgers layer on steel      2e-5 (1e-6, 5e-6)

Images of a plate on a thin fluid layer, which sinks at rates as the fourth power of the wavenumber, cannot follow it much
longer: after 500 relaxation times they are 6e-4 off. Derivatives have ten to twenty times the error.

Choices are made for rounded parameters, so that values are smooth: central differences with steps of 1e-5 agree with
derivatives to 1e-9, and both modes to round-off.
"""

import abc
from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import pytree, replace
from jaxcontact.bodies.body import Layer, LayeredHalfSpace
from jaxcontact.bodies.materials import Material, Rigid
from jaxcontact.response.images import (
    DAMPING,
    Images,
    Ladder,
    decomposed,
    fit_images,
    fit_wavenumbers,
    image_depths,
    log_spaced,
)
from jaxcontact.response.stack import (
    Spectra,
    SurfaceCompliance,
    alpha_N,
    compliances,
    creeps,
    film_compliance,
    film_creep,
    film_shape,
    has_fluidity,
    loose_layers,
    mean_response,
    nu_at_first,
    solids,
    spectra,
    step_response,
    surface_compliance,
    uniaxial,
)

# The form of a response that the march in time needs (``Separable``), and the interface of every kind of response
# (``Response``): ``normal.HalfSpace``, ``normal.OneLayer``, and below ``Stack``.


QUADRATURE_NODES, QUADRATURE_WEIGHTS = np.polynomial.legendre.leggauss(5)  # for means over a time interval
DEFAULT_NODES = 2  # decay rates a band
CHECK_TIMES = np.geomspace(1e-3, 1e2, 16)  # over 1/rate: where errors are measured


@pytree
class Separable:
    """The response alpha N(alpha, t) as a sum of products of functions of wavenumber and of time.

    At the wavenumbers of the response,

        u = C_0 * p + sum_k lambda_k C_k * eta_k,     eta_k' = p - lambda_k eta_k,
        lambda_k C_k = sum_m mix[m, k] S_m [1/(Pa s)].

    rates: lambda_k [1/s], (K,), zero for steady-state viscous flow; terms: C_0 and M shapes S_m, (M + 1, n); mix: (M, K).
    S_1 is that of the top layer on a rigid base (of a half-space: a number), and own_factors its factors: at once [1/Pa]
    and, as in mix, for each rate [1/(Pa s)], (K + 1,). error: the largest relative error of the sum of products, over
    wavenumbers and over times up to the horizon, (); horizon: the latest time for which the sum is valid [s], (), inf if
    there is no limit.
    """

    rates: Array
    terms: Array
    mix: Array
    own_factors: Array
    error: Array
    horizon: Array | float = float("inf")


def relative_errors(found: Array, exact: Array) -> Array:
    """Return |found - exact|/exact, zero where both are zero, as of a body that cannot be compressed on a rigid base."""
    return jnp.abs(found - exact) / jnp.where(exact == 0.0, 1.0, exact)


def check_times(rates: Array) -> Array:
    """Times [s] spread around every rate [1/s], zero without any."""
    positive = jnp.where(rates > 0.0, rates, jnp.max(rates, initial=1.0))
    return (jnp.asarray(CHECK_TIMES)[:, None] / positive).ravel() if rates.size else jnp.zeros(1)


def summed_products(separable: Separable, terms: Array, times: Array) -> Array:
    """Return alpha N at times (t, 1) from a sum of products with terms (M + 1, n) in the place of its own, (t, n)."""
    growth = times * phi1(times * separable.rates)
    return terms[0] + growth @ separable.mix.T @ terms[1:]


class Response(abc.ABC):
    """The normal response of one kind of body: alpha N(alpha, t) [1/Pa], N = displacement/pressure.

    The pressure is a unit step at t = 0; ``start`` and ``end`` [s] are the limits of a mean over time.
    """

    @abc.abstractmethod
    def mean_response(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return the mean of alpha N over start <= t <= end; arguments broadcast; wavenumber >= 0 [rad/m].

        At wavenumber zero it is that of the substrate alone, with zero derivative with respect to the wavenumber. On a
        rigid base it is there the displacement under a uniform pressure over that and over the thickness of all layers.
        """

    @abc.abstractmethod
    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return ``mean_response`` with 1/J(t) in place of moduli in the elastic response (the paper, section 2.3)."""

    @abc.abstractmethod
    def wavenumbers(self) -> Array:
        """Return the wavenumbers at which ``expand`` needs the response, (n,) [rad/m]; they carry no derivative."""

    @abc.abstractmethod
    def separate(self, nodes: int) -> Separable:
        """Return the sum of products with ``nodes`` decay rates per band, static."""

    @abc.abstractmethod
    def expand(self, values: Array) -> Images:
        """Return images of responses given at ``wavenumbers``, (..., n) [any unit]; errors are relative to the
        response."""

    @abc.abstractmethod
    def expand_shapes(self, start: Array, film: Array, rest: Array) -> Images:
        """Return images, at the depths of ``expand``, of C_0, of the top layer's shape S_1 and of the other S_m.

        Each has a first axis, (m, n) with m >= 0; the heights are in that order, (M, J + 1).
        """

    def expand_separable(self, separable: Separable) -> Images:
        """Return images of C_0 and of all shapes of ``separate``, heights (M + 1, J + 1)."""
        return self.expand_shapes(separable.terms[:1], separable.terms[1:2], separable.terms[2:])


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
MORE_RATES = 1.5  # factor of the number of rates where there is no slowest one
HORIZON = 0.05  # latest time over the longest 1/rate where there is no slowest one
ROUNDING = 8.0  # steps of the rounding in a factor of two


class RateBand(NamedTuple):
    """The decay rates of an expansion, and where it is fitted and measured.

    rates: common rates [1/s], (K,); period: 1/s [s] at the sampled frequencies, (2 K,) imaginary; times [s] at which
    the error is measured, (K,); horizon: the latest time for which the expansion is made [s], () inf without one.
    """

    rates: Array
    period: Array
    times: Array
    horizon: Array


def rounded(body: LayeredHalfSpace) -> LayeredHalfSpace:
    """Return the body with rounded parameters, without derivative."""
    layers = [
        replace(layer, material=_rounded_material(layer.material), thickness=rounded_number(layer.thickness))
        for layer in body.sublayers()
    ]
    return replace(body, layers=tuple(layers), substrate=body.substrate and _rounded_material(body.substrate))


def _rounded_material(material: Material) -> Material:
    """Round a material; of nu its distance from 1/2 is rounded."""
    given = {name: value for name, value in vars(material).items() if value is not None}
    change = {
        n: 0.5 - rounded_number(0.5 - jnp.asarray(v, float)) if n == "nu" else rounded_number(v)
        for n, v in given.items()
    }
    return replace(material, **change)


def rounded_number(value: Array | float) -> Array:
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
    return jnp.where(jnp.any(no_slowest), HORIZON * REACH / rate_limits(body)[0], jnp.inf)


def rate_band(body: LayeredHalfSpace, count: int) -> RateBand:
    """Return ``count`` rates for a rounded body, and what goes with them."""
    (low, high), last = rate_limits(body), horizon(body)
    endless = jnp.isfinite(last)
    low = jnp.where(endless, low / REACH, low)
    lowest = jnp.where(endless, low * SAMPLED, low / SAMPLED)
    latest = jnp.where(endless, last, SAMPLED / low)
    period = -1j / log_spaced(lowest, high * SAMPLED, 2 * count)
    times = log_spaced(1.0 / (high * SAMPLED), latest, count)
    return RateBand(log_spaced(low, high, count), period, times, last)


def rate_limits(body: LayeredHalfSpace) -> tuple[Array, Array]:
    """Return the lowest and the highest common rate [1/s] for the body's solids, () each.

    The poles of a stack lie where some moduli s/h(s) are positive and others negative, between the
    retardation and the relaxation rates of its solids. Only a fluid, whose retardation takes for ever, is
    held back by the solids around it and, with a bulk modulus, by that.
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


# The sum of products: rates, shapes and their mix, from the response at frequencies.


CLOCKS = 4.0  # the fastest over the slowest clock of the second body
SHARE = 0.1  # weight of the second body in the combination
CUTOFF = 1e-12  # part of the largest singular value below which others are discarded
SHAPE_CUTOFF = 1e-9  # CUTOFF in the fit of the shapes: smaller values are rounding
SLOPE_CUTOFF = 1e-10  # least cutoff in derivatives: smaller singular values magnify rounding
CANDIDATES = 120  # wavenumbers of which some are picked, about
STRIDE = 4  # the error is measured at every fourth wavenumber


def separate(body: LayeredHalfSpace, wavenumber: Array, rates: int, shapes: int) -> Separable:
    """Return alpha N of a body with at least one layer as a sum of products, at the wavenumbers >= 0, (n,) [rad/m].

    rates: number of common rates besides those of the top layer's material; shapes: number of shapes besides the top
    layer's own; both static. Where there is no slowest rate there are ``MORE_RATES`` as many, each with a shape
    (``fitted_to_rates``). Rates, picked wavenumbers and weights carry no derivative, all else does.
    """
    # 1. The top layer's own shape, whose factor is the creep of its material; of an elastic body there is nothing else.
    top = body.sublayers()[0]
    wavenumber = jnp.asarray(wavenumber, float)
    own, at_once = film_shapes(body, wavenumber), film_creep(top).instantaneous
    if not any(creeps(solid) for solid in solids(body)):
        start = alpha_N(body, wavenumber, spectra(body).instantaneous)
        return Separable(
            jnp.zeros(0), jnp.stack([start, own]), jnp.zeros((1, 0)), at_once[None], jnp.zeros(())
        )

    # 2. The rest of the response at the frequencies that the range of its decay rates needs.
    rough, endless = rounded(body), may_have_no_slowest(body)
    chosen = rate_band(rough, int(MORE_RATES * rates) if endless else rates)
    samples = _sampled(body, wavenumber, chosen.period)
    common, fluidities = common_rates(body, chosen.rates)

    # 3. Shapes and their mix: one shape for each rate, or the few that reproduce a body with rounded numbers.
    if endless:
        terms, mix = fitted_to_rates(samples.rest, chosen, common)
    else:
        alike = wavenumber * jax.lax.stop_gradient(jnp.asarray(top.thickness)) / rough.layers[0].thickness
        expected = _sampled(rough, alike, chosen.period)
        weights = weights_of(expected.response)
        terms, mix = fitted(samples.rest, expected.rest, weights, chosen, common, shapes)
    result = Separable(
        rates=common,
        terms=jnp.concatenate([jnp.stack([samples.start, own]), terms]),
        mix=jnp.concatenate([fluidities[None], mix]),
        own_factors=jnp.append(at_once, fluidities),
        error=jnp.zeros(()),
        horizon=chosen.horizon,
    )

    # 4. The largest relative deviation from the exact response at some of the wavenumbers, without derivative
    body, held, times = *jax.lax.stop_gradient((body, result)), chosen.times[:, None]
    summed = summed_products(held, held.terms[:, ::STRIDE], times)
    exact = step_response(body, wavenumber[::STRIDE], times)
    return replace(result, error=jnp.max(relative_errors(summed, exact)))


def fitted_to_rates(rest: Array, chosen: RateBand, rates: Array) -> tuple[Array, Array]:
    """Return shapes (M, n) and their mix (M, K) where there is no slowest rate: one shape for each rate but the top layer's.

    rest: ``Samples.rest`` of n responses, (r, n); rates: ``common_rates``, (K,).

    With r_m the chosen rates, ascending, and r_M = 0 for the flow,

        R(s, alpha) ~ sum_m S_m(alpha) unit_m/(s + r_m),      unit_m = r_m, but the lowest of the chosen rates for the flow,

    by damped least squares at the frequencies, with weights |s|^(1/2) that are the same for all wavenumbers: the S_m are a
    fixed matrix times R, and as smooth in the wavenumber as R is. The fit holds for whatever decays at rates in the band, so
    for derivatives too.
    """
    of_top_layer = rates.size - chosen.rates.size - 1
    each = jax.lax.stop_gradient(rates[of_top_layer:])
    unit = jnp.where(each > 0.0, each, chosen.rates[0])
    s = 1.0 / chosen.period
    weights = jnp.sqrt(jnp.tile(jnp.abs(s), 2))[:, None]
    terms = smoothly_fitted(weights * as_real(unit / (s[:, None] + each)), weights * rest[: 2 * s.size])
    return terms, jnp.pad(jnp.diag(unit), ((0, 0), (of_top_layer, 0)))


SMOOTHING = 1e-6  # damping of a fit, over the largest singular value


def smoothly_fitted(matrix: Array, target: Array) -> Array:
    """Return the x (m, n) of damped least squares |matrix x - target|, matrix (r, m) without derivative, target (r, n).

    Columns of the matrix are scaled to one. Two steps of refinement take away the error of the damping where the matrix
    determines x. Nothing is cut off, so that x is linear in the target and does not jump.
    """
    matrix = jax.lax.stop_gradient(matrix)
    size = jnp.sqrt(jnp.sum(matrix**2, 0))
    matrix = matrix / size
    singular = decomposed(matrix)
    x = jnp.zeros((matrix.shape[1], target.shape[1]))
    for _ in range(3):
        x = x + singular.damped((target - matrix @ x).T, SMOOTHING * singular.values[0]).T
    return x / size[:, None]


def fitted(
    rest: Array,
    expected: Array,
    weights: Array,
    chosen: RateBand,
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
    """Return the samples of alpha N of a body and of its second body at the frequencies s = 1/period, (s,)."""
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
    """Return compliances [1/Pa] at t = 0, at 1/s = period, and of the second body, (layers + 1, 1 + 3/2 period.size).

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
    """Return the real parts above the imaginary parts, (2 r, ...)."""
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

    The decomposition and the first solution carry no derivative: two steps of refinement give those by the target less the
    matrix times x, one order each, and a last one, whose value is zero, that by the matrix in the normal equations, so that
    first derivatives are those of the solution whatever its residual. Were the change of the target alone fitted first, to
    a matrix at rest, its large x would have to cancel.
    """
    matrix, target = weights[:, None] * matrix, weights * target
    held = jax.lax.stop_gradient(matrix)
    size = jnp.sqrt(jnp.sum(held**2, 0))
    size = jnp.where(size > 0.0, size, 1.0)
    matrix, held = matrix / size, held / size
    singular = decomposed(held)
    x, cutoff = jax.lax.stop_gradient(singular.truncated(target, cutoff)), max(cutoff, SLOPE_CUTOFF)
    for _ in range(2):
        x = x + singular.truncated(target - matrix @ x, cutoff)
    residual = jax.lax.stop_gradient(target - matrix @ x)
    x = x + singular.normal((matrix - held).T @ residual, cutoff)
    return x / size


def common_rates(body: LayeredHalfSpace, chosen: Array) -> tuple[Array, Array]:
    """Return the rates of an expansion, the top layer's, the chosen ones and zero where a solid may flow [1/s], and the top
    layer's fluidity at each, (K,) each."""
    top = film_creep(body.sublayers()[0])
    rates = jnp.concatenate([top.rates, chosen])
    fluidities = jnp.concatenate([top.rates * top.amplitudes, jnp.zeros_like(chosen)])
    if not any(has_fluidity(solid) for solid in solids(body)):
        return rates, fluidities
    flow = 0.0 if top.fluidity is None else top.fluidity
    return jnp.append(rates, 0.0), jnp.append(fluidities, flow)


# Positions of the images of a layered body, and the reference response of their fit.
#
# A film that is G times as stiff as what lies below bends under waves of h G^(1/3) and resists stretching under waves
# of h G, so images reach several times that far. What a fit is weighted by is the response at first of a body whose
# moduli and thicknesses, relative to the top layer's, are rounded to powers of two: it does not follow the body, so
# the images are linear in the response, without noise in finite differences.


FIRST = 1.6  # least depth of an image over the thickness of the top layer
SHALLOWEST = 30.0  # depth down to which images always lie closely, over the thickness of all layers
BENDING = 13.0  # depth down to which images lie closely, over the longest bending wave
STRETCHING = 50.0  # depth down to which images lie at all, over the longest wave of stretching
STIFFEST = 2.0e6  # ratio of moduli beyond which images reach no farther
STEPS = 8.0  # steps of a rounded Poisson's ratio in a unit
LARGEST = 0.498  # the largest rounded Poisson's ratio, at which a confined layer still has some compliance


class StackConstants(NamedTuple):
    """Constants of the solids that set the depths of the images, from the top to the half-space, without derivative.

    compliances at first and final ones, at the ``horizon`` or, without one, at first [1/Pa], Poisson's ratios, and whether
    each solid is rigid, (layers + 1,); thicknesses [m] and whether layers are loose, (layers,), or None if none is.
    """

    compliances: Array
    final: Array
    poissons: Array
    thicknesses: Array
    rigid: Array
    loose: Array | None


def stack_constants(body: LayeredHalfSpace) -> StackConstants:
    """Return the constants of a body."""
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
    return jax.lax.stop_gradient(
        StackConstants(first, final, poissons, thicknesses, rigid, loose_layers(body))
    )


def farthest_image(body: LayeredHalfSpace, times: Array) -> Array:
    """Return the depth [m], (), down to which images lie for responses after each of the times [s], (t,)."""
    constants = stack_constants(body)
    creep = jnp.stack([solid.creep(times) for solid in solids(body)], 1)
    late = jax.lax.stop_gradient(jnp.where(creep > 0.0, creep, constants.compliances))
    stretched = jax.vmap(lambda final: _reach(constants._replace(final=final))[1])(late)
    return STRETCHING * jnp.max(stretched)


def wavenumbers(body: LayeredHalfSpace) -> Array:
    """Return the wavenumbers (n,) [rad/m] at which the response is evaluated for its images."""
    thicknesses = stack_constants(body).thicknesses
    return fit_wavenumbers(thicknesses[0], jnp.sum(thicknesses))


def expand_tangential(body: LayeredHalfSpace, values: Array) -> Images:
    """Return images of C_0 and the S_m of alpha (L, T, K), (3, M + 1, n), heights (3, M + 1, J + 1).

    Images of L and T are relative to the responses L and T of the body, those of K to the root of L N: for C_0 as it is at
    first, for the S_m as it is in the end.
    """
    constants = stack_constants(body)
    ends = [_rounded_compliances(constants, j) for j in (constants.compliances, constants.final)]
    responses = _rough_responses(constants, jnp.stack(ends, 1))

    def sizes(wavenumber: Array) -> Array:
        L, _, N, T = responses(wavenumber)
        return jnp.concatenate(jnp.stack([L, T, jnp.sqrt(L * N)], 1))

    # C_0 of L, T and K, each relative to one size, and their S_m, relative to the other three
    values = long_waves_kept(body, values)
    groups = [*values[:, :1], *values[:, 1:]]
    found = images_relative_to(sizes, groups, constants, densely=True)
    start, rest = found.heights[:3, None], found.heights[3:]
    rest = rest.reshape(3, values.shape[1] - 1, rest.shape[-1])  # none of an elastic body
    return Images(found.depths, jnp.concatenate([start, rest], 1))


def long_waves_kept(body: LayeredHalfSpace, values: Array) -> Array:
    """Return responses (..., n) with, on a rigid base, their limit for long waves at wavenumber zero in place of that under
    a uniform traction (``response.stack.alpha_LKNT``)."""
    return values if body.substrate is not None else values.at[..., 0].set(0.0)


def _rounded_compliances(constants: StackConstants, compliances: Array) -> Array:
    """Return compliances (layers + 1,) whose ratios are rounded to powers of two, zero where a solid is rigid."""
    soft = _to_power_of_two(jnp.maximum(compliances, jnp.max(compliances) / STIFFEST))
    return jnp.where(constants.rigid, 0.0, soft)


def _to_power_of_two(a: Array) -> Array:
    return a[0] * jnp.exp2(jnp.round(jnp.log2(a / a[0])))


def _reach(constants: StackConstants) -> tuple[Array, Array]:
    """Return the lengths of the waves under which layers bend and are stretched over what lies below [m], () each.

    Of thickness t, R times as stiff as a solid below them: t R^(1/3) and t R; over a layer of thickness d, whose
    springs give way first, (R t^3 d)^(1/4), or (R t^3 d^3)^(1/6) if they are incompressible, and (R t d)^(1/2).
    """
    j, d = jnp.maximum(constants.final, jnp.max(constants.final) / STIFFEST), constants.thicknesses
    ratio = j[1:] / jax.lax.cummin(j[:-1])
    t, d = jnp.cumsum(d), jnp.append(d[1:], jnp.inf)
    on_layer = jnp.maximum((ratio * t**3 * d) ** 0.25, (ratio * t**3 * d**3) ** (1.0 / 6.0))
    bent = jnp.minimum(t * jnp.cbrt(ratio), on_layer)
    return jnp.max(bent), jnp.max(jnp.minimum(t * ratio, jnp.sqrt(ratio * t * d)))


def _rough_responses(constants: StackConstants, compliances: Array) -> Callable[[Array], SurfaceCompliance]:
    """Return what gives the elastic responses of m bodies, (m, n) each at wavenumbers (n,), from the compliances of their
    solids, (layers + 1, m); their thicknesses, and Poisson's ratios, are the same and rounded."""
    poissons = jnp.minimum(jnp.round(STEPS * constants.poissons) / STEPS, LARGEST)
    thicknesses = _to_power_of_two(constants.thicknesses)
    return lambda wavenumber: surface_compliance(
        compliances[..., None], poissons, thicknesses, wavenumber, constants.loose
    )


def stacked_ladders(
    constants: StackConstants, sizes: Callable[[Array], Array], *, densely: bool = False
) -> Ladder:
    """Return ladders for images relative to each of the sizes, (m, n) at wavenumbers (n,): one with sizes (m, ...).

    densely: whether depths lie as closely for the waves that stretch layers as for those that bend them.
    """
    bent, stretched = _reach(constants)
    deepest = STRETCHING * stretched
    dense = jnp.maximum(SHALLOWEST * jnp.sum(constants.thicknesses), deepest if densely else BENDING * bent)
    depths = image_depths(FIRST * constants.thicknesses[0], dense, deepest)
    between = 1.0 / jnp.sqrt(depths[1:] * depths[:-1])
    alpha = fit_wavenumbers(constants.thicknesses[0], jnp.sum(constants.thicknesses))
    at_nodes, at_steps = jnp.split(sizes(jnp.append(alpha[1:-1], between)), [alpha.size - 2], -1)
    return Ladder(alpha, depths, at_nodes, at_steps)


def images_relative_to(
    sizes: Callable[[Array], Array],
    groups: Sequence[Array],
    constants: StackConstants,
    *,
    densely: bool = False,
) -> Images:
    """Return images of groups of responses, (m, n) each, heights one behind the other; the errors of each group are relative
    to one of the sizes; sizes, densely: as in ``stacked_ladders``."""
    most = max(len(group) for group in groups)
    filled = jnp.stack([jnp.pad(group, ((0, most - len(group)), (0, 0))) for group in groups])
    ladders = stacked_ladders(constants, sizes, densely=densely)
    found = zip(groups, fitted_heights(ladders, filled), strict=True)
    return Images(ladders.depths, jnp.concatenate([heights[: len(group)] for group, heights in found]))


def fitted_heights(ladders: Ladder, values: Array, damping: float = DAMPING) -> Array:
    """Return the heights (m, ..., J + 1) of images of responses (m, ..., n), by ladders of ``stacked_ladders``."""

    def fit(values: Array, at_nodes: Array, at_steps: Array) -> Array:
        return fit_images(values, replace(ladders, at_nodes=at_nodes, at_steps=at_steps), damping).heights

    return jax.vmap(fit)(values, ladders.at_nodes, ladders.at_steps)


# Images of the shapes where there is no slowest rate.
#
# Long waves then settle at rates that go with a power of the wavenumber: the third for a plate on a fluid half-space, the
# fourth on a thin fluid layer. What decays at one rate is a peak in the wavenumber too narrow for images, while the response
# at any one time is smooth. And it grows by up to 1e4 in time, at some wavenumbers and not at others: images of the shapes
# relative to the response in the end would be in error by a tenth of the response soon after the load. So images are fitted
# to the delayed response u at a number of times, each relative to the response then, and those of the shapes follow by
# damped least squares in time, u(t_j)/t_j = sum_m g_m(t_j)/t_j S_m.


STEADY = 1e-11  # damping of the heights at each time: they have to vary steadily from one to the next


def images_in_time(
    body: LayeredHalfSpace,
    rates: Array,
    mix: Array,
    last: Array | float,
    shapes: Array,
    sizes: Callable[[SurfaceCompliance], list[Array]],
    *,
    densely: bool = False,
) -> tuple[Array, Array]:
    """Return the depths (J,) and the heights (c, M, J + 1) of images of the shapes of c responses, (c, M, n).

    rates: lambda_k [1/s], (K,), and mix (M, K), as in ``Separable``; last: latest time [s], inf without one; sizes: what
    errors of each response are relative to, from the functions of ``response.stack``; densely: as in ``stacked_ladders``.
    """
    rates, mix, last = jax.lax.stop_gradient((rates, mix, last))
    lowest = jnp.min(jnp.where(rates > 0.0, rates, jnp.inf))
    latest = jnp.where(jnp.isfinite(last), last, SAMPLED / lowest)
    times = log_spaced(1.0 / (SAMPLED * jnp.max(rates)), latest, rates.size)
    growth = phi1(times[:, None] * rates) @ mix.T  # g_m(t_j)/t_j, (t, M)
    constants, rough = stack_constants(body), rounded(body)

    # the size of the response at each time: elastic, of the rounded creep compliances then
    then = jnp.stack([solid.creep(times) for solid in solids(rough)])
    then = jnp.maximum(then, jnp.max(then, 0) / STIFFEST)
    then = jnp.where(constants.rigid[:, None], 0.0, then)
    responses = _rough_responses(constants, then)
    ladders = stacked_ladders(
        constants, lambda alpha: jnp.concatenate(sizes(responses(alpha))), densely=densely
    )

    slopes = jnp.concatenate(list(growth @ long_waves_kept(body, shapes)))  # u(t_j)/t_j of all, (c t, n)
    heights = fitted_heights(ladders, slopes, STEADY)
    beside = jnp.concatenate(jnp.split(heights, len(shapes)), -1)
    found = jnp.split(smoothly_fitted(growth, beside), len(shapes), -1)
    return ladders.depths, jnp.stack(found)


def expand_tangential_in_time(
    body: LayeredHalfSpace, rates: Array, mix: Array, last: Array | float, terms: Array
) -> Images:
    """Return images as ``expand_tangential`` does, where there is no slowest rate, heights (3, M + 1, J + 1).

    terms: (3, M + 1, n); rates, mix, last: as in ``images_in_time``.
    """
    first = expand_tangential(body, terms[:, :1])
    sizes = lambda each: [each.in_plane, each.transverse, jnp.sqrt(each.in_plane * each.normal)]
    depths, heights = images_in_time(body, rates, mix, last, terms[:, 1:], sizes, densely=True)
    return Images(depths, jnp.concatenate([first.heights, heights], 1))


class Layered(Response):
    """The response of layers on a substrate or a rigid base, whose images lie at depths chosen by its layers alone."""

    @property
    @abc.abstractmethod
    def body(self) -> LayeredHalfSpace:
        """The layers, the top one first, and what is below them."""

    def wavenumbers(self) -> Array:
        return wavenumbers(self.body)

    def expand(self, values: Array) -> Images:
        constants = stack_constants(self.body)
        at_first = _rounded_compliances(constants, constants.compliances)
        responses = _rough_responses(constants, at_first[:, None])
        ladders = stacked_ladders(constants, lambda alpha: responses(alpha).normal)
        return Images(ladders.depths, fitted_heights(ladders, long_waves_kept(self.body, values)[None])[0])

    def expand_shapes(self, start: Array, film: Array, rest: Array) -> Images:
        """Return images whose errors are relative to responses: of C_0 to the body's at first, of S_1 to that of the top
        layer on a rigid base, and of the others to the body's in the end."""
        constants = stack_constants(self.body)
        first, final = (_rounded_compliances(constants, j) for j in (constants.compliances, constants.final))
        on_base = np.eye(len(first))[0]
        responses = _rough_responses(constants, jnp.stack([first, on_base, final], 1))
        groups = [long_waves_kept(self.body, each) for each in (start, film, rest)]
        return images_relative_to(lambda alpha: responses(alpha).normal, groups, constants)


RATES_A_NODE, SHAPES_A_NODE = 12, 4


@pytree
class Stack(Layered):
    """Any layers on a substrate or a rigid base, by recursion; layers: the top one first.

    For one layer on an elastic substrate it agrees with the closed form of ``response.normal`` to 1e-12.
    """

    layers: tuple[Layer, ...]
    substrate: Material | None

    @property
    def body(self) -> LayeredHalfSpace:
        return LayeredHalfSpace(self.layers, self.substrate)

    def mean_response(self, wavenumber: Array, start: Array, end: Array) -> Array:
        return mean_response(self.body, wavenumber, start, end)

    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return the mean over an interval by five-point Gauss quadrature."""
        wavenumber, start, end = (jnp.asarray(a, float)[..., None] for a in (wavenumber, start, end))
        t = (start + end) / 2.0 + (end - start) / 2.0 * QUADRATURE_NODES
        compliances = jnp.stack([solid.creep(t) for solid in solids(self.body)])
        return jnp.sum(alpha_N(self.body, wavenumber, compliances) * QUADRATURE_WEIGHTS, -1) / 2.0

    def separate(self, nodes: int) -> Separable:
        """Return a sum of products with fixed rates, about four per decade."""
        return separate(self.body, self.wavenumbers(), RATES_A_NODE * nodes, SHAPES_A_NODE * nodes)

    def expand_separable(self, separable: Separable) -> Images:
        """Return images relative to the response in the end or, where there is no slowest rate, at each time."""
        if not may_have_no_slowest(self.body):
            return super().expand_separable(separable)
        start, film, rest = separable.terms[:1], separable.terms[1:2], separable.terms[2:]
        first = self.expand_shapes(start, film, rest[:0])
        depths, heights = images_in_time(
            self.body,
            separable.rates,
            separable.mix[1:],
            separable.horizon,
            rest[None],
            lambda responses: [responses.normal],
        )
        return Images(depths, jnp.concatenate([first.heights, heights[0]]))
