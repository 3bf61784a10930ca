"""The canonical form of a material: its creep compliance as a sum of exponentials, and its relaxation modes.

    J(t) = J0 + sum_i J_i (1 - exp(-t/tau_i)) + fluidity t

has the Laplace transform s J(s) = h(s)/s, where

    h(s) = s J0 + fluidity + sum_i (J_i/tau_i) s/(s + 1/tau_i).

The relaxation modulus has the transform G(s) = 1/h(s), so that with the roots -rho_k of h

    G(t) = sum_k exp(-rho_k t) / h'(-rho_k),      all rho_k real and >= 0, all terms positive

(from J(s) G(s) = 1/s^2). In parallel with a spring c the compliance is again of that form: 1/(s (G(s) + c)) is the
transform of

    J_c(t) = J0/(1 + c J0) + sum_k a_k (1 - exp(-rho_k t)),

with rho_k the relaxation rates of the material with a compliance 1/c in series, and a_k = w_k/c^2, where w_k are the
weights of that relaxation: all terms are positive.

A material given by its relaxation, G(t) = Ge + sum_i G_i exp(-r_i t), has its retardation rates at the zeros rho_k of

    G*(-rho) = -rho F(rho),      F(rho) = sum_i G_i/(r_i - rho) - Ge/rho,

one between each two neighbours of 0, r_1, r_2, ..., and the compliances J_k = 1/(rho_k^2 F'(rho_k)) there.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import mean_decay
from jaxcontact._support.pytree import as_float64, pytree

BISECTIONS = 100  # a root is found to 1e-30 of the interval between rates
# fraction of the lowest retardation rate below which the root of a fluid is computed by ``_slowest``
SLOW = 1e-3


@pytree
class Spectrum:
    """The canonical form of a material, as used by the response functions and the time stepping.

    instantaneous: J0 [1/Pa], (); amplitudes: J_i [1/Pa], (n,); rates: 1/tau_i [1/s], (n,);
    fluidity [1/(Pa s)], (), or None for a material that cannot flow (known from its class).
    """

    instantaneous: Array
    amplitudes: Array
    rates: Array
    fluidity: Array | None = None

    def creep(self, t: Array | float) -> Array:
        """Return J(t) [1/Pa] for t of any shape."""
        t = jnp.asarray(as_float64(t))
        delayed = -jnp.expm1(-t[..., None] * self.rates) @ self.amplitudes
        flow = 0.0 if self.fluidity is None else self.fluidity * t
        return self.instantaneous + delayed + flow

    def transform(self, s: Array | complex) -> Array:
        """Return h(s) = s^2 J(s) [1/(Pa s)], real or complex s."""
        s = jnp.asarray(s)
        terms = jnp.sum(self.amplitudes * self.rates * s[..., None] / (s[..., None] + self.rates), -1)
        flow = 0.0 if self.fluidity is None else self.fluidity
        return s * self.instantaneous + flow + terms

    def mean_creep(self, start: Array, end: Array) -> Array:
        """Return the mean of J(t) [1/Pa] over start <= t <= end, times of any shape."""
        decay = mean_decay(self.rates, start[..., None], end[..., None])
        flow = 0.0 if self.fluidity is None else self.fluidity * (start + end) / 2.0
        return self.instantaneous + jnp.sum(self.amplitudes * (1.0 - decay), -1) + flow


LEAST_GAP = (
    300.0  # logarithm of the interval between two rates over the smallest distance of a zero from its ends
)
LEAST_PART = 1e-100  # of the instantaneous modulus, that replaces moduli of zero so that every zero lies between two rates


def from_relaxation(equilibrium: Array | float, moduli: Array, rates: Array) -> Spectrum:
    """Return the spectrum of the material that relaxes as G(t) = Ge + sum_i G_i exp(-r_i t), with k retarded parts.

    equilibrium: Ge [Pa], (), >= 0; moduli: G_i [Pa], (k,), >= 0; rates: r_i [1/s], (k,), different and ascending. Without
    Ge the body flows with the viscosity sum_i G_i/r_i, and the first part is zero, with an arbitrary rate.

    A zero is found as the distance d from the nearer of its two neighbours r_i, with the differences r_j - rho formed as
    (r_j - r_i) - d. Neither these nor the sum F lose digits, over any number of decades of rates.
    """
    total = equilibrium + jnp.sum(moduli)
    flows = jnp.asarray(equilibrium <= 0.0)
    least = LEAST_PART * jax.lax.stop_gradient(total)
    weights = jnp.concatenate([jnp.stack([jnp.where(flows, least, equilibrium)]), jnp.maximum(moduli, least)])
    poles = jnp.concatenate([jnp.zeros(1), rates])

    # F rises from -inf to inf between neighbours: its sign at the middle tells the nearer one, the origin of d
    gap = jnp.diff(poles)
    middle = poles[:-1] + gap / 2.0
    left = jax.lax.stop_gradient(jnp.sum(weights / (poles - middle[:, None]), -1) > 0.0)
    origin, sign = jnp.where(left, poles[:-1], poles[1:]), jnp.where(left, 1.0, -1.0)
    apart = poles - origin[:, None]
    sums = lambda weights, differences: jnp.sum(weights / differences, -1)

    # bisection of the logarithm of d between the origin and the middle
    def halve(_: int, ends: tuple[Array, Array], weights: Array, apart: Array) -> tuple[Array, Array]:
        low, high = ends
        log = (low + high) / 2.0
        beyond = sign * sums(weights, apart - (sign * jnp.exp(log))[:, None]) < 0.0
        return jnp.where(beyond, log, low), jnp.where(beyond, high, log)

    constants = jax.lax.stop_gradient((weights, apart))
    high = jax.lax.stop_gradient(jnp.log(gap / 2.0))
    low, high = jax.lax.fori_loop(
        0, BISECTIONS, lambda i, e: halve(i, e, *constants), (high - LEAST_GAP, high)
    )
    d = jnp.exp((low + high) / 2.0)

    # Newton steps carry the first and second derivatives; F'(rho) = sum_i weights_i/(r_i - rho)^2 > 0
    for _ in range(2):
        differences = apart - (sign * d)[:, None]
        d = d - sign * sums(weights, differences) / sums(weights / differences, differences)
    differences = apart - (sign * d)[:, None]
    rho = origin + sign * d
    parts = 1.0 / rho / (rho * sums(weights / differences, differences))

    first = flows & (jnp.arange(rho.size) == 0)
    flow = jnp.where(flows, 1.0 / jnp.sum(weights[1:] / rates), 0.0)
    return Spectrum(1.0 / total, jnp.where(first, 0.0, parts), jnp.where(first, rates[0] / 2.0, rho), flow)


def relaxation_modes(spectrum: Spectrum, extra: Array | float = 0.0) -> tuple[Array, Array]:
    """Return the relaxation rates rho_k [1/s], ascending, and weights w_k [Pa]: G(t) = G(inf) + sum w_k exp(-rho_k t).

    ``extra`` [1/Pa], any shape, is a compliance added to J0: that of a spring in series with the
    material. Both results have shape ``extra.shape + (m,)`` with m = n + 1 if the material can flow, n if it
    cannot. The rates of the spectrum must ascend, and J0 + extra > 0.

    With s_0 = 0 before the rho_k of a material that cannot flow, the roots interlace with the rates,
    s_0 <= r_1 <= s_1 <= ... <= s_n, and

        w_k = 1/(J0 + extra) prod_{i <= k} (s_k - r_i)/(s_k - s_{i-1}) prod_{i > k} (r_i - s_k)/(s_i - s_k),

    with factors between 0 and 1: a branch of zero compliance, or with the retardation time of another, has weight zero.
    """
    extra = jnp.asarray(extra, dtype=float)
    total = (spectrum.instantaneous + extra)[..., None]
    rho = _roots(spectrum, total)
    zero = jnp.zeros((*rho.shape[:-1], 1))
    roots = rho if spectrum.fluidity is not None else jnp.concatenate([zero, rho], -1)
    n = spectrum.rates.shape[0]
    weight = jnp.ones_like(roots)
    for i in range(n):
        others = jnp.where(jnp.arange(n + 1) > i, roots[..., i : i + 1], roots[..., i + 1 : i + 2])
        gap = others - roots
        factor = (spectrum.rates[i] - roots) / jnp.where(gap == 0.0, 1.0, gap)
        weight = weight * jnp.where(gap == 0.0, 0.0, factor)
    return rho, (weight if spectrum.fluidity is not None else weight[..., 1:]) / total


def _roots(spectrum: Spectrum, total: Array) -> Array:
    """Return the rho_k by bisection of the intervals between the rates, and Newton steps that carry the derivatives."""
    rates, weights = spectrum.rates, spectrum.amplitudes * spectrum.rates
    if spectrum.fluidity is not None:
        rates = jnp.append(jnp.zeros_like(spectrum.fluidity), rates)
        weights = jnp.append(spectrum.fluidity, weights)
    if rates.shape[0] == 0:
        return jnp.zeros((*total.shape[:-1], 0))
    constants = jax.lax.stop_gradient((rates, weights, total))
    rho = _bisected(*constants)
    if spectrum.fluidity is not None:
        rho = rho.at[..., 0].set(_slowest(*constants, rho[..., 0]))
    for _ in range(2):
        rho = _newton(rates, weights, total, rho)
    return rho


@jax.jit  # traced once for both steps
def _newton(rates: Array, weights: Array, total: Array, rho: Array) -> Array:
    """Return rho after a Newton step towards a zero of ``_characteristic``; no step where its derivative is zero."""
    value, slope = jax.jvp(lambda r: _characteristic(rates, weights, total, r), (rho,), (jnp.ones_like(rho),))
    return rho - value / jnp.where(slope == 0.0, jnp.inf, slope)


def _bisected(rates: Array, weights: Array, total: Array) -> Array:
    """Return the zeros of total + sum_i weights_i/(r_i - rho), which rises between the r_i; an end where there is none."""
    top = rates[-1:] + jnp.sum(weights) / total
    high = jnp.concatenate([jnp.broadcast_to(rates[1:], (*top.shape[:-1], rates.size - 1)), top], -1)
    low = jnp.broadcast_to(rates, high.shape)

    def halve(_: int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        low, high = ends
        # the geometric mean, since neighbouring rates may be tens of decades apart
        middle = jnp.where(low > 0.0, jnp.sqrt(low) * jnp.sqrt(high), (low + high) / 2.0)
        gap = rates - middle[..., None]
        below = total + jnp.sum(weights / jnp.where(gap == 0.0, jnp.inf, gap), -1) < 0.0
        return jnp.where(below, middle, low), jnp.where(below, high, middle)

    low, high = jax.lax.fori_loop(0, BISECTIONS, halve, (low, high))
    return (low + high) / 2.0


def _slowest(rates: Array, weights: Array, total: Array, rho: Array) -> Array:
    """Refine the lowest root of a material that may flow, (...), where it lies far below the retardation rates.

    The root is proportional to the fluidity w_0, the weight of the rate r_0 = 0, in

        rho = w_0/(total + sum_{i > 0} w_i/(r_i - rho)),

    which preserves its relative accuracy: it is exactly zero without a fluidity. Bisection alone leaves 1e-30 of r_1.
    """
    slow = rho < SLOW * jnp.min(rates[1:], initial=jnp.inf)
    gaps = rates[1:] - jnp.where(slow, rho, 0.0)[..., None]
    own = weights[0] / (total[..., 0] + jnp.sum(weights[1:] / jnp.where(gaps > 0.0, gaps, jnp.inf), -1))
    return jnp.where(slow, own, rho)


def _characteristic(rates: Array, weights: Array, total: Array, rho: Array) -> Array:
    """Return (total + sum_i weights_i/(r_i - rho)) prod_i (r_i - rho)/(r_i + rho), for rho (..., m).

    It is expanded so that nothing is divided by r_i - rho, which is zero for a branch of zero compliance.
    """
    size = jax.lax.stop_gradient(rates + rho[..., None])
    size = jnp.where(size == 0.0, 1.0, size)
    factors = (rates - rho[..., None]) / size
    value = total * jnp.prod(factors, -1)
    for i in range(rates.shape[0]):
        value = value + weights[i] / size[..., i] * jnp.prod(jnp.delete(factors, i, axis=-1), -1)
    return value


def parallel_creep(spectrum: Spectrum, stiffness: Array) -> tuple[Array, Array, Array]:
    """Return the creep of a material in parallel with springs c, J_c(t) = start + sum_k a_k (1 - exp(-rho_k t)).

    Returns start [1/Pa], (...); a [1/Pa], (..., m); rho [1/s], (..., m) for stiffness (...) [Pa].
    """
    rho, weight = relaxation_modes(spectrum, 1.0 / stiffness)
    J0 = spectrum.instantaneous
    return J0 / (1.0 + stiffness * J0), weight / stiffness[..., None] ** 2, rho
