"""The Mittag-Leffler function of a negative argument, E_alpha(-x) = sum_k (-x)^k/Gamma(1 + alpha k), 0 < alpha <= 1.

It falls from 1 to 0 as x grows, as exp(-x) for alpha = 1 and as 1/(x Gamma(1 - alpha)) for large x else. With
u = x^(1/alpha) it is a mean of exponentials over rates r,

    E_alpha(-x) = 1/(pi alpha) int_0^(pi alpha) exp(-u r) dtheta,      r^alpha = sin(theta)/sin(pi alpha - theta)

(R. Gorenflo, F. Mainardi, Fractional Calculus, in Fractals and Fractional Calculus in Continuum Mechanics, 1997, sec.
3). With theta = pi alpha p, p = 1/(1 + exp(-alpha w)), the integrand is analytic in |Im w| < pi/2 and all terms of its
trapezoidal rule are positive, so that no digits are lost at any argument. The same holds for 1 - E, of 1 - exp(-u r).
"""

import jax
import jax.numpy as jnp
from jax import Array
from jax.nn import softplus
from jax.scipy.special import gammaln

STEP = 0.3  # of w: an error of exp(-pi^2/0.3) = 5e-15
LEFT, RIGHT = (
    40.0,
    45.0,
)  # range of w about that of the rate 1/u, without the plateau of the rates for alpha near 1
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
    inside, small = below > NEAR_ONE, x < LEAST
    a = jnp.where(inside, alpha, 0.5)[..., None]
    rest = 1.0 - a
    log_x = jnp.log(jnp.where(small, 1.0, x))[..., None]

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

    first = x / jnp.exp(gammaln(1.0 + alpha))
    decay = jnp.where(small, 1.0 - first, jnp.where(inside, decay, jnp.exp(-x)))
    return decay, jnp.where(small, first, jnp.where(inside, rise, -jnp.expm1(-x)))


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
