"""The response of a stack in time as a sum of products: alpha N(alpha, t) ~ C_0(alpha) + sum_k C_k(alpha) f_k(t).

Where several solids creep, the decay rates of the surface fill bands and move with the wavenumber. Fixed
rates lambda_k, some four a decade, serve all of them to a known error,

    alpha N ~ C_0 + sum_k C_k (1 - exp(-lambda_k t)) + flow t,

or, at the complex frequency s, with compliances s J(s) in the recursion of ``response.stack``,

    alpha N ~ C_0 + sum_k lambda_k C_k/(s + lambda_k) + flow/s.

C_0 is the response under the compliances at t = 0, and exact. The top layer's own creep on a rigid base,
A_22 J(t), is taken out with the rates of its material (with a bulk modulus, ``response.volume.film_shape`` and
``film_creep``). The rest R(s, alpha), at frequencies s = i omega over
the band, is nearly of low rank: what it is at any wavenumber is a combination of what it is at a few,

    R(s, alpha) ~ sum_m R(s, alpha_m) S_m(alpha),

which a QR decomposition with column pivots picks, and only there are the lambda_k C_k found. Both steps are
linear least squares. The combination also has to hold when any one solid changes, or the derivatives with
respect to one of three equal layers, which the response itself cannot tell apart, would be 2 % of the
response off: so it is fitted to a second body besides, in which each solid's clock runs at another speed
(then 1e-6).

Largest error relative to the response, over all wavenumbers and from a tenth of the shortest to ten times
the longest of the times 1/lambda_k, for 24 rates and 8 shapes, 32 and 12, and 48 and 20:

    the paper's film as three equal layers       2e-7    9e-10   2e-12
    it with a bulk modulus, as one layer         2e-7    6e-9    1e-11
    rubber of 7 decades on glass                 7e-7    2e-7    5e-9
    three different films on steel               7e-6    4e-7    3e-10
    the paper's film on a Maxwell half-space     2e-6    2e-8    8e-12
    coating on rubber, 80 times to 80 000 times
    as stiff as it                               6e-3    6e-4    7e-6
    solid on a fluid layer on steel              9e-2    8e-2    8e-2

The last has no slowest rate: the longer the wave, the slower it sinks.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._pytree import replace
from jaxcontact.layers import LayeredHalfSpace
from jaxcontact.materials import Material
from jaxcontact.response.base import Separable
from jaxcontact.response.linear_fit import decomposed
from jaxcontact.response.separable import products
from jaxcontact.response.stack import Spectra, compliances, scaled_response, solids, spectra, step
from jaxcontact.response.volume import film_compliance, film_creep, film_shape

DEFAULT_RATES, DEFAULT_SHAPES = 32, 12
MARGIN = 2.0  # by how much the rates reach beyond those of the solids,
SAMPLED = 10.0  # and the frequencies beyond the rates
SOFT = 3.0  # compliance that a layer finds in its surroundings, over that of the softest other solid
CLOCKS = 4.0  # the fastest over the slowest clock of the second body,
SHARE = 0.1  # and its weight in the combination
CUTOFF = 1e-12  # of singular values


def separate(
    body: LayeredHalfSpace, wavenumber: Array, rates: int = DEFAULT_RATES, shapes: int = DEFAULT_SHAPES
) -> Separable:
    """The separable form of a body with at least one layer at the wavenumbers >= 0, (n,) [rad/m].

    rates: number of common rates besides those of the top layer's material; shapes: number of shapes besides
    the top layer's own; both static. Rates, picked wavenumbers and weights carry no derivative, all else does.
    """
    top = body.sublayers()[0]
    own = film_shape(top.material, wavenumber * top.thickness)
    if not any(creeps(solid) for solid in solids(body)):
        start = scaled_response(body, wavenumber, spectra(body).instantaneous)
        return Separable(jnp.zeros(0), jnp.stack([start, own]), jnp.zeros((1, 0)), jnp.zeros(()))
    low, high = band(jax.lax.stop_gradient(body))
    samples = _sampled(body, wavenumber, own, low / SAMPLED, high * SAMPLED, 2 * rates)
    both = jnp.concatenate([samples.rest, SHARE * samples.second])
    picked = pivots(both, shapes)
    terms = least_squares(both[:, picked], both) / samples.scale
    common, fluidities = _rates(body, _spread(low, high, rates))
    unit = jnp.where(common > 0.0, common, low)
    basis = _as_real(samples.weights * unit / (1.0 / samples.period[:, None] + common))
    mix = least_squares(basis, samples.rest[:, picked]) * unit[:, None]
    result = Separable(
        rates=common,
        terms=jnp.concatenate([jnp.stack([samples.start, own]), terms]),
        mix=jnp.concatenate([fluidities[None], mix.T]),
        error=jnp.zeros(()),
    )
    times = _spread(1.0 / (high * SAMPLED), SAMPLED / low, rates)[:, None]
    return replace(result, error=_error(body, wavenumber, result, times))


def creeps(solid: Material) -> bool:
    spectrum = solid.spectrum()
    return spectrum.rates.size > 0 or spectrum.fluidity is not None


def flows(solid: Material) -> bool:
    return solid.spectrum().fluidity is not None


def band(body: LayeredHalfSpace) -> tuple[Array, Array]:
    """Lowest and highest common rate [1/s] for the body's solids, () each.

    The poles of a stack lie where some moduli s/h(s) are positive and others negative, between the
    retardation and the relaxation rates of its solids. Only a fluid, whose retardation takes for ever, is
    held by the springs around it, and by that of its volume.
    """
    each = spectra(body)
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


def _spread(low: Array, high: Array, count: int) -> Array:
    """Points evenly spaced in their logarithm, (count,)."""
    return low * (high / low) ** jnp.linspace(0.0, 1.0, count)


class Samples(NamedTuple):
    """The rest R of the module's formula, weighted to be about one where it is as large as the response.

    period: 1/s [s], (s,) imaginary; start: C_0 [1/Pa], (n,); rest: (2 s, n), real parts above imaginary ones;
    second: of the second body, (s, n); weights of the frequencies, (s, 1); scale: of the wavenumbers, (n,).
    """

    period: Array
    start: Array
    rest: Array
    second: Array
    weights: Array
    scale: Array


def _sampled(
    body: LayeredHalfSpace, wavenumber: Array, own: Array, lowest: Array, highest: Array, count: int
) -> Samples:
    """Both bodies at frequencies between the two, the second one at every other."""
    period = -1j / _spread(lowest, highest, count)
    j = _sampled_compliances(spectra(body), period, 1.0 / highest)
    response = scaled_response(body, wavenumber, j[..., None])
    start, response = jnp.real(response[0]), response[1:]
    film = film_compliance(body.sublayers()[0].material, j[0])
    rest = response - start - own * (film[1:] - film[0])[:, None]
    weights, scale = _weights(response[:count])
    second = _as_real(weights[::2] * rest[count:]) * scale
    return Samples(period, start, _as_real(weights * rest[:count]) * scale, second, weights, scale)


def _sampled_compliances(spectra: Spectra, period: Array, shortest: Array) -> Array:
    """Compliances [1/Pa] at t = 0, at 1/s = period, and of the second body, (layers + 1, 1 + 3/2 period.size).

    A solid that is rigid at first is taken as it is at 1/s = shortest.
    """
    first = spectra.instantaneous
    first = jnp.where(first > 0.0, first, compliances(spectra, shortest))
    speeds = CLOCKS ** jnp.linspace(-0.5, 0.5, first.size)
    second = spectra._replace(rates=spectra.rates * speeds[:, None], fluidity=spectra.fluidity * speeds)
    each = [first[:, None], compliances(spectra, period), compliances(second, period[::2])]
    return jnp.concatenate(each, 1)


def _weights(response: Array) -> tuple[Array, Array]:
    """Weights of frequencies, (s, 1), and wavenumbers, (n,), whose product is about 1/|response|, (s, n)."""
    size = jnp.abs(jax.lax.stop_gradient(response))
    weights = jnp.exp(-jnp.mean(jnp.log(size / size[-1]), -1, keepdims=True))
    return weights, 1.0 / jnp.max(weights * size, 0)


def _as_real(values: Array) -> Array:
    return jnp.concatenate([jnp.real(values), jnp.imag(values)])


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


def _rates(body: LayeredHalfSpace, grid: Array) -> tuple[Array, Array]:
    """The top layer's rates, the grid and zero for a flow [1/s], and the top layer's fluidities, (K,) each."""
    top = film_creep(solids(body)[0])
    rates = jnp.concatenate([top.rates, grid])
    fluidities = jnp.concatenate([top.rates * top.amplitudes, jnp.zeros_like(grid)])
    if not any(flows(solid) for solid in solids(body)):
        return rates, fluidities
    flow = 0.0 if top.fluidity is None else top.fluidity
    return jnp.append(rates, 0.0), jnp.append(fluidities, flow)


def _error(body: LayeredHalfSpace, wavenumber: Array, response: Separable, times: Array) -> Array:
    """Largest relative deviation from ``step`` at the times, (t, 1), and every fourth wavenumber."""
    body, response = jax.lax.stop_gradient((body, response))
    separable = products(response, response.terms[:, ::4], times)
    return jnp.max(jnp.abs(separable / step(body, wavenumber[::4], times) - 1.0))
