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
the longest of the times 1/lambda_k, for 24 rates and 8 shapes:

    the paper's film as three equal layers          2e-7
    it with a bulk modulus, as one layer            2e-7
    rubber of 7 decades on glass, two layers        3e-7
    the paper's film on a Maxwell half-space        2e-8
    three Maxwell layers on a Maxwell half-space    7e-6
    coating on rubber, 80 times to 80 000 times
    as stiff as it                                  6e-3

A layer that does not flow over a solid that does has no slowest rate: the longer the wave, the slower it sinks
(``response.time.band``). With 36 rates and 20 shapes, up to the horizon:

    elastic layer on a Maxwell half-space           4e-5
    it 100 times as stiff, or as soft               9e-5
    elastic layer on a fluid layer on steel         2e-6
    standard solid on a Burgers half-space          2e-4

Choices are made for rounded parameters, so that values are smooth: central differences with steps of 1e-5 agree with
derivatives to 1e-9, and both modes to round-off.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import replace
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.response.base import Separable
from jaxcontact.response.influence.linear_fit import decomposed
from jaxcontact.response.stack import Spectra, compliances, scaled_response, solids, spectra, step
from jaxcontact.response.time.band import (
    MORE_RATES,
    MORE_SHAPES,
    Window,
    creeps,
    has_fluidity,
    may_have_no_slowest,
    rounded,
    window,
)
from jaxcontact.response.time.separable import products
from jaxcontact.response.volume import film_compliance, film_creep, film_shape

DEFAULT_RATES, DEFAULT_SHAPES = 32, 12
CLOCKS = 4.0  # the fastest over the slowest clock of the second body,
SHARE = 0.1  # and its weight in the combination
CUTOFF = 1e-12  # of singular values,
SHAPE_CUTOFF = 1e-9  # and of those in the fit of the shapes, which beyond it, and in reverse mode most, follow rounding
CANDIDATES = 120  # wavenumbers of which some are picked, about
STRIDE = 4  # every which wavenumber is one at which the error is measured


def separate(
    body: LayeredHalfSpace, wavenumber: Array, rates: int = DEFAULT_RATES, shapes: int = DEFAULT_SHAPES
) -> Separable:
    """Expand the response of a body with at least one layer at the wavenumbers >= 0, (n,) [rad/m].

    rates: number of common rates besides those of the top layer's material; shapes: number of shapes besides the top
    layer's own; both static, and more of them where the rates have no lower bound (``response.time.band``). Rates, picked
    wavenumbers and weights carry no derivative, all else does.
    """
    top = body.sublayers()[0]
    wavenumber = jnp.asarray(wavenumber, float)
    own, at_once = (
        film_shape(top.material, wavenumber * top.thickness),
        film_creep(top.material).instantaneous,
    )
    if not any(creeps(solid) for solid in solids(body)):
        start = scaled_response(body, wavenumber, spectra(body).instantaneous)
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
    return replace(result, error=_error(body, wavenumber, result, chosen.times[:, None]))


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
    stride = max(1, rest.shape[1] // CANDIDATES)
    picked = stride * picks(expected[:, ::stride], weights[:, ::stride], shapes)
    few = rest[:, picked]
    of_few = lambda target, weight: combination(few, target, weight, SHAPE_CUTOFF)
    terms = jax.vmap(of_few, (1, 1), 1)(rest, weights)
    unit = jnp.where(rates > 0.0, rates, chosen.rates[0])
    basis = as_real(unit / (1.0 / chosen.period[:, None] + rates))
    first = slice(len(basis))
    mix = jax.vmap(combination, (None, 1, 1), 1)(basis, few[first], weights[first, picked])
    return _uncancelled(terms, (mix * unit[:, None]).T)


def _uncancelled(terms: Array, mix: Array) -> tuple[Array, Array]:
    """Return combinations of the shapes, and their mix, whose products hardly cancel in the sum over the shapes.

    Shapes, and more so their derivatives, are large in combinations that the mix hardly contains. The sum does not feel
    them, but the images of each shape have a rounding error relative to it, with which derivatives by Poisson's ratio were
    up to a fifth of the response off. In the principal directions of the mix, in which each shape has the size of the
    response for which it stands, a large combination comes with a small factor. The directions carry no derivative.
    """
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
    response = scaled_response(body, wavenumber, j[..., None])
    top = body.sublayers()[0]
    own, film = film_shape(top.material, wavenumber * top.thickness), film_compliance(top.material, j[0])
    return samples_of(response, own * (film[1:] - film[0])[:, None])


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
    relative = 1.0 / jnp.abs(jax.lax.stop_gradient(sizes))
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
    top = film_creep(solids(body)[0])
    rates = jnp.concatenate([top.rates, grid])
    fluidities = jnp.concatenate([top.rates * top.amplitudes, jnp.zeros_like(grid)])
    if not any(has_fluidity(solid) for solid in solids(body)):
        return rates, fluidities
    flow = 0.0 if top.fluidity is None else top.fluidity
    return jnp.append(rates, 0.0), jnp.append(fluidities, flow)


def _error(body: LayeredHalfSpace, wavenumber: Array, response: Separable, times: Array) -> Array:
    """Largest relative deviation from ``step`` at the times, (t, 1), and every fourth wavenumber."""
    body, response = jax.lax.stop_gradient((body, response))
    separable = products(response, response.terms[:, ::STRIDE], times)
    return jnp.max(jnp.abs(separable / step(body, wavenumber[::STRIDE], times) - 1.0))
