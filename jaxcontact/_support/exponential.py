"""Integrals of the exponential function, such as (1 - exp(-z))/z, for real and complex arguments, and the Mittag-Leffler
function, a mean of exponentials (``mittag_leffler``).

    phi1(z) = int_0^1 exp(-z s) ds           = (1 - exp(-z))/z
    phi2(z) = int_0^1 (1 - s) exp(-z s) ds   = (1 - phi1)/z
    psi(z)  = int_0^1 s exp(-z s) ds         = (phi1 - exp(-z))/z

for Re z >= 0, z = 0 included, with finite derivatives. Near zero, where the right sides cancel, Taylor series are used:
the relative error is at most 3e-14 (tests: 40-digit values).
"""

import math

import jax
import jax.numpy as jnp
from jax import Array
from jax.nn import softplus
from jax.scipy.special import gammaln

SERIES_BELOW = 0.1  # value of |Re z| + |Im z| below which the series are used
PHI2 = [(-1.0) ** n / math.factorial(n + 2) for n in range(10)]


def _split_near_zero(z: Array) -> tuple[Array, Array, Array]:
    """Return a mask of z near zero, the series of phi2 there, and z with those entries replaced by one."""
    size = jnp.abs(z.real) + jnp.abs(z.imag) if jnp.iscomplexobj(z) else jnp.abs(z)
    small = size < SERIES_BELOW
    low = jnp.where(small, z, 0.0)
    series = jnp.full_like(low, PHI2[-1])
    for coefficient in PHI2[-2::-1]:
        series = series * low + coefficient
    return small, series, jnp.where(small, 1.0, z)


@jax.jit  # so that it is traced once for each shape
def phi1(z: Array) -> Array:
    """Return (1 - exp(-z))/z, the mean of exp(-z s) over 0 <= s <= 1."""
    small, series, safe = _split_near_zero(z)
    return jnp.where(small, 1.0 - z * series, (1.0 - jnp.exp(-safe)) / safe)


@jax.jit  # as for ``phi1``
def ramps(z: Array) -> tuple[Array, Array, Array]:
    """Return exp(-z), psi(z) and phi2(z), computed with one exponential.

    For a quantity that decays at the rate z and has a source that is linear in time over a unit of time, these are the
    factors, at its end, of the initial value and of the source's values at the start and at the end.
    """
    small, series, safe = _split_near_zero(z)
    decay = jnp.exp(-safe)
    mean = (1.0 - decay) / safe
    start = jnp.where(small, 1.0 - (1.0 + z) * series, (mean - decay) / safe)
    end = jnp.where(small, series, (1.0 - mean) / safe)
    return jnp.where(small, 1.0 - z * (1.0 - z * series), decay), start, end


def mean_decay(rate: Array, start: Array, end: Array) -> Array:
    """Return the mean of exp(-rate t) over start <= t <= end; its value where the two coincide."""
    return jnp.exp(-rate * start) * phi1(rate * (end - start))


# The Mittag-Leffler function of a negative argument, E_alpha(-x) = sum_k (-x)^k/Gamma(1 + alpha k), 0 < alpha <= 1.
#
# It falls from 1 to 0 as x grows, as exp(-x) for alpha = 1 and as 1/(x Gamma(1 - alpha)) for large x else. With
# u = x^(1/alpha) it is a mean of exponentials over rates r,
#
#     E_alpha(-x) = 1/(pi alpha) int_0^(pi alpha) exp(-u r) dtheta,      r^alpha = sin(theta)/sin(pi alpha - theta)
#
# (R. Gorenflo, F. Mainardi, Fractional Calculus, in Fractals and Fractional Calculus in Continuum Mechanics, 1997, sec.
# 3). With theta = pi alpha p, p = 1/(1 + exp(-alpha w)), the integrand is analytic in |Im w| < pi/2 and all terms of its
# trapezoidal rule are positive, so that no digits are lost at any argument. The same holds for 1 - E, of 1 - exp(-u r).

STEP = 0.3  # of w: an error of exp(-pi^2/0.3) = 5e-15
# range of w about that of the rate 1/u, without the plateau of the rates for alpha near 1
LEFT, RIGHT = 40.0, 45.0
PLATEAU = 34.0  # its half-length in w at 1 - alpha = 1e-15
NEAR_ONE = 1e-15  # least 1 - alpha of the sum
LEAST = 1e-150  # x below which E = 1 - x/Gamma(1 + alpha)


@jax.jit
def mittag_leffler(x: Array | float, alpha: Array | float) -> tuple[Array, Array]:
    """Return E_alpha(-x) and 1 - E_alpha(-x), both to a relative 1e-11, for x >= 0 and 0 < alpha <= 1.

    The shapes of the arguments broadcast. The derivatives with respect to both are accurate too, except that with respect
    to alpha at alpha = 1, which is zero.
    """
    x, alpha = jnp.broadcast_arrays(jnp.asarray(x, float), jnp.asarray(alpha, float))
    below = 1.0 - alpha
    inside, small, endless = below > NEAR_ONE, x < LEAST, x == jnp.inf
    a = jnp.where(inside, alpha, 0.5)[..., None]
    rest = 1.0 - a
    log_x = jnp.log(jnp.where(small | endless, 1.0, x))[..., None]

    # 1. The place w of the rate 1/u, in closed form; nothing depends on it beyond rounding.
    y = jnp.exp(-log_x)
    sine, cosine = jnp.sin(jnp.pi * jnp.minimum(a, rest)), jnp.cos(jnp.pi * a)
    inverse = jnp.where(y > 0.0, 1.0 / y, jnp.inf)
    share = jnp.arctan2(sine, inverse + cosine) / jnp.arctan2(sine, y + cosine)
    centre = jax.lax.stop_gradient(jnp.log(share) / a)
    w = centre + STEP * jnp.arange(-(LEFT + PLATEAU) / STEP, (RIGHT + PLATEAU) / STEP)

    # 2. Rates and density alpha p q at each w; sin(pi alpha p) is formed from the nearer of the zeros 0 and pi of the sine.
    log_p, log_q = -softplus(-a * w), -softplus(a * w)
    p, q = jnp.exp(log_p), jnp.exp(log_q)
    log_sine = lambda log_own, own, other: jnp.where(
        own > 0.5,
        jnp.log(jnp.sin(jnp.pi * (rest + a * other))),
        log_own + jnp.log(jnp.pi * a * jnp.sinc(a * jnp.where(own > 0.5, 0.5, own))),
    )
    log_rate = (log_sine(log_p, p, q) - log_sine(log_q, q, p) + log_x) / a  # of u r
    ur = jnp.exp(jnp.minimum(log_rate, 700.0))
    density = STEP * a * jnp.exp(log_p + log_q)

    # 3. The sums, with all slower rates (exp(-u r) = 1) or all faster ones (exp(-u r) = 0) beyond the range.
    slow = _tail(-a[..., 0] * (w[..., 0] - STEP), a[..., 0] * STEP)
    fast = _tail(a[..., 0] * (w[..., -1] + STEP), a[..., 0] * STEP)
    decay = jnp.sum(density * jnp.exp(-ur), -1) + slow
    rise = jnp.sum(density * -jnp.expm1(-ur), -1) + fast
    early = rise < decay
    decay, rise = jnp.where(early, 1.0 - rise, decay), jnp.where(early, rise, 1.0 - decay)

    # 4. The limits of a small, and of an infinite argument.
    first = jnp.where(endless, 1.0, x) / jnp.exp(gammaln(1.0 + alpha))
    decay = jnp.where(small, 1.0 - first, jnp.where(inside, decay, jnp.exp(-x)))
    rise = jnp.where(small, first, jnp.where(inside, rise, -jnp.expm1(-x)))
    return jnp.where(endless, 0.0, decay), jnp.where(endless, 1.0, rise)


def _tail(v: Array, step: Array) -> Array:
    """Return step (f(v) + f(v + step) + ...) of the logistic density f = p (1 - p).

    By the midpoint rule with the first terms of its error: int_(v - step/2)^inf f + step^2/24 f' - 7 step^4/5760 f''' at
    v - step/2.
    """
    q = jnp.exp(-softplus(v - step / 2.0))  # 1 - p
    f = q * (1.0 - q)
    slope = f * (2.0 * q - 1.0)
    third = slope * (1.0 - 12.0 * f)
    return q + step**2 / 24.0 * slope - 7.0 * step**4 / 5760.0 * third
