"""Fractional materials: creep as a power of time, and its approximation by retardation times for the solver.

A springpot of quasi-property V [Pa s^alpha] and order 0 < alpha < 1 lies between a spring and a dashpot:

    J(t) = t^alpha/(V Gamma(1 + alpha)).

Its retardation times form a continuous spectrum over the whole time axis. With the rate r = exp(w), the Mittag-Leffler
function E_alpha and x = t/tau,

    t^alpha/Gamma(1 + alpha) = sin(pi alpha)/pi int r^-alpha (1 - exp(-r t)) dw,
    1 - E_alpha(-x^alpha) = 1/(pi alpha) int_0^(pi alpha) (1 - exp(-x r)) dtheta,
    r^alpha = sin(theta)/sin(pi alpha - theta).

With the substitution theta = pi alpha/(1 + exp(-alpha w)), the rates of the second integral approach those of the first
far from tau, and its density is a smooth peak for every alpha. With a step h in w, the error of the trapezoidal rule is
exp(-pi^2/h), as the integrand is analytic for |Im w| < pi/2: so a sum of exponentials represents either law. Rates too
fast for the requested times act as a spring, and those too slow as a dashpot and one retardation time that have the same
first three derivatives at t = 0.

Sources: A. Jaishankar, G. H. McKinley, Power-law rheology in the bulk and at the interface, Proc. R. Soc. A 469
(2013) 20120284 (the laws); R. Gorenflo, F. Mainardi, Fractional Calculus, in Fractals and Fractional Calculus in
Continuum Mechanics, 1997, sec. 3 (their spectra); L. N. Trefethen, J. A. C. Weideman, SIAM Rev. 56 (2014) 385 (the rule).
"""

import abc
import functools
import math
from typing import ClassVar, Self

import jax
import jax.numpy as jnp
from jax import Array
from jax.nn import softplus
from jax.scipy.special import gammaln

from jaxcontact._support import checks
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace
from jaxcontact.inputs.materials import NU, Material, Prony

TAIL = 80.0  # range of the logarithm of rates summed beyond the modes kept; a closed form gives the rest
FINE_STEP = 0.4  # step of the sum for J(t) itself: an error of exp(-pi^2/0.4) = 2e-11
LARGEST_ORDER = 0.999  # largest alpha whose spectrum can be summed
USUAL_ORDER = 0.95  # alpha of which the range suffices for all below
# least 1 - alpha used for the series of a power law; it changes J(t) by as much per decade at most
NEAR_ONE = 1e-7


class Fractional(abc.ABC):
    """Base class of the fractional laws: J(t), and its approximation by a Prony series."""

    V: Array | float
    alpha: Array | float
    nu: Array | float | None
    bulk_modulus: Array | float | None

    __post_init__ = Material.__post_init__  # a bulk modulus replaces the default nu

    @abc.abstractmethod
    def creep(self, t: Array | float) -> Array:
        """Return the shear creep compliance J(t) [1/Pa], t >= 0 [s] of any shape."""

    def shifted(self, factor: Array | float) -> Self:
        """Return the material with all its times multiplied by ``factor`` > 0: J(t; factor) = J(t/factor).

        The quasi-property V becomes V factor^alpha; the modulus does not change.
        """
        return replace(self, V=self.V * jnp.asarray(factor, float) ** self.alpha)

    _largest_order: ClassVar[float] = LARGEST_ORDER  # largest alpha of a series

    @property
    def _extra_range(self) -> float:
        """The amount by which the range of w may exceed that of the logarithm of the rates."""
        return 0.0

    @property
    def _spring(self) -> Array | float:
        """The compliance of a spring in series [1/Pa]."""
        return 0.0

    @abc.abstractmethod
    def _density(self, w: Array) -> tuple[Array, Array]:
        """Return the logarithm of the rate [1/s] and the compliance per unit of w [1/Pa], at w of any shape."""

    @abc.abstractmethod
    def _position(self, log_rate: Array) -> Array:
        """Return the w of a rate, from the logarithm of the rate."""

    @abc.abstractmethod
    def _above(self, w: Array, step: Array | float) -> Array:
        """Return the total compliance of the modes at w, w + step, w + 2 step ... [1/Pa]."""

    def prony(self, shortest: float, longest: float, tolerance: float = 1e-5) -> Prony:
        """Approximate the material by retardation times that give the same creep between two times, for the solver.

        The J(t) of the series is within a relative ``tolerance`` of the fractional law for shortest <= t <= longest and
        0.05 <= alpha. At shorter times its compliance tends to a positive limit below J(shortest); at longer times the
        series flows steadily. It takes about log(1/tolerance)/4 retardation times per decade, and a few more.

        Args:
            shortest: the shortest time of interest [s] > 0, such as the first step of a run.
            longest: the longest time of interest [s].
            tolerance: relative error of J(t), 1e-8 to 0.1.

        Returns:
            A ``Prony``, differentiable with respect to the parameters.

        Raises:
            ValueError: times or a tolerance out of range, a parameter that is not > 0, or alpha not between 0 and 1.

        Example:
            >>> gel = jc.Springpot(V=1e3, alpha=0.2, nu=0.5)
            >>> series = gel.prony(1e-3, 1e3)
            >>> f"{float(series.creep(2.0) / gel.creep(2.0)):.4f}"
            '1.0000'
        """
        self._check(shortest, longest, tolerance)
        return self._summable()._sum(shortest, longest, tolerance)

    def _summable(self) -> "Fractional":
        """Return the law with an order whose spectrum can be summed."""
        return self

    def _sum(self, shortest: float, longest: float, tolerance: float) -> Prony:
        """Return the series of ``prony`` without checks."""
        step = math.pi**2 / math.log(1.0 / tolerance)
        slow = -math.log(longest) - math.log(1.0 / tolerance) / 3.0
        fast = math.log(math.log(1.0 / tolerance) / shortest)
        n = math.ceil((fast - slow + self._extra_range) / step)
        return self._series(slow, step, n, math.ceil(TAIL / step))

    @functools.partial(jax.jit, static_argnames=("n", "beyond"))
    def _series(self, slow: Array | float, step: Array | float, n: int, beyond: int) -> Prony:
        """Return a series of n modes from the rate exp(slow) on, with terms that represent the modes on either side."""
        first = jax.lax.stop_gradient(self._position(jnp.asarray(slow)))
        flow, last, rate = self._below(first - step * jnp.arange(1, beyond), step)
        log_rates, density = self._density(first + step * jnp.arange(n + beyond))
        J = step * density
        return Prony(
            J0=self._spring + jnp.sum(J[n:]) + self._above(first + step * (n + beyond), step),
            J=jnp.append(J[:n], last),
            tau=1.0 / jnp.append(jnp.exp(log_rates[:n]), rate),
            nu=self.nu, fluidity=flow, bulk_modulus=self.bulk_modulus,
        )  # fmt: skip

    def _below(self, w: Array, step: Array | float) -> tuple[Array, Array, Array]:
        """Return fluidity [1/(Pa s)], compliance [1/Pa] and rate [1/s] that represent the modes at w and all slower ones."""
        log_rates, density = self._density(w)
        unit, ratio = jnp.exp(log_rates[0]), jnp.exp(log_rates - log_rates[0])
        flows = step * density * ratio
        decay = flows[-1] / flows[-2]
        all_flows = jnp.sum(flows) + flows[-1] * decay / (1.0 - decay)
        second, rate = flows @ ratio, (flows @ ratio**2) / (flows @ ratio)
        return unit * (all_flows - second / rate), second / rate**2, unit * rate

    def _check(self, shortest: float, longest: float, tolerance: float) -> None:
        checks.positive("shortest", shortest)
        checks.require(
            shortest < longest < math.inf,
            f"longest: expected more than shortest = {shortest:g} s, got {longest:g}",
        )
        checks.between("tolerance", tolerance, 0.999e-8, 0.1)
        for name in ("G", "V"):
            if hasattr(self, name):
                checks.positive(name, getattr(self, name))
        checks.between("alpha", self.alpha, 0.0, self._largest_order)


class PowerLaw(Fractional):
    """Base class of the laws whose spectrum is that of a springpot, alone or with a spring in series."""

    _largest_order: ClassVar[float] = 1.0

    def _summable(self) -> "PowerLaw":
        return replace(self, alpha=jnp.minimum(self.alpha, 1.0 - NEAR_ONE))

    def _density(self, w: Array) -> tuple[Array, Array]:
        return w, jnp.sin(jnp.pi * self.alpha) / (jnp.pi * self.V) * jnp.exp(-self.alpha * w)

    def _position(self, log_rate: Array) -> Array:
        return log_rate

    def _above(self, w: Array, step: Array | float) -> Array:
        return step * self._density(w)[1] / -jnp.expm1(-self.alpha * step)


@pytree
class Springpot(PowerLaw):
    """A springpot, whose creep is a power law: J(t) = t^alpha/(V Gamma(1 + alpha)).

    Args:
        V: quasi-property [Pa s^alpha] > 0.
        alpha: order, 0 (a spring) < alpha < 1 (a dashpot).
        nu: Poisson's ratio, -1 < nu <= 0.5.
        bulk_modulus: K [Pa] > 0 of an elastic volume response, in place of nu.

    Example:
        >>> cell = jc.Springpot(V=500.0, alpha=0.25)
        >>> f"{float(cell.creep(16.0) / cell.creep(1.0)):.3f}"
        '2.000'
    """

    V: Array | float
    alpha: Array | float
    nu: Array | float | None = NU
    bulk_modulus: Array | float | None = None

    def creep(self, t: Array | float) -> Array:
        """Return J(t) [1/Pa], t >= 0 [s] of any shape."""
        return power(t, self.alpha) / self.V


@pytree
class FractionalMaxwell(PowerLaw):
    """A spring and a springpot in series: J(t) = 1/G + t^alpha/(V Gamma(1 + alpha)).

    Args:
        G: instantaneous shear modulus [Pa] > 0.
        V: quasi-property of the springpot [Pa s^alpha] > 0.
        alpha: order of the springpot, 0 < alpha < 1.
        nu: Poisson's ratio, -1 < nu <= 0.5.
        bulk_modulus: K [Pa] > 0 of an elastic volume response, in place of nu.

    Example:
        >>> clay = jc.FractionalMaxwell(G=1e6, V=2e6, alpha=0.5)
        >>> f"{float(clay.creep(0.0)):.1e} 1/Pa"
        '1.0e-06 1/Pa'
    """

    G: Array | float
    V: Array | float
    alpha: Array | float
    nu: Array | float | None = NU
    bulk_modulus: Array | float | None = None

    def creep(self, t: Array | float) -> Array:
        """Return J(t) [1/Pa], t >= 0 [s] of any shape."""
        return 1.0 / self.G + power(t, self.alpha) / self.V

    @property
    def _spring(self) -> Array | float:
        return 1.0 / self.G


@pytree
class FractionalKelvinVoigt(Fractional):
    """A spring and a springpot in parallel: J(t) = (1 - E_alpha(-(t/tau)^alpha))/G, tau^alpha = V/G.

    Args:
        G: relaxed shear modulus [Pa] > 0.
        V: quasi-property of the springpot [Pa s^alpha] > 0.
        alpha: order of the springpot, 0 < alpha < 1.
        nu: Poisson's ratio, -1 < nu <= 0.5.
        bulk_modulus: K [Pa] > 0 of an elastic volume response, in place of nu.

    Example:
        >>> gel = jc.FractionalKelvinVoigt(G=1e3, V=2e3, alpha=0.5)
        >>> f"{float(gel.creep(4.0)) * 1e3:.4f} 1/kPa"        # 1 - exp(1) erfc(1)
        '0.5724 1/kPa'
    """

    G: Array | float
    V: Array | float
    alpha: Array | float
    nu: Array | float | None = NU
    bulk_modulus: Array | float | None = None

    @jax.jit
    def creep(self, t: Array | float) -> Array:
        """Return J(t) [1/Pa] to a relative 1e-9, t >= 0 [s] of any shape."""
        t = as_float64(t)
        positive = t > 0.0
        log_t = jnp.log(jnp.where(positive, t, 1.0))[..., None]
        centre = jax.lax.stop_gradient(self._position(-log_t))
        w = centre + FINE_STEP * jnp.arange(-TAIL / FINE_STEP, TAIL / FINE_STEP)
        log_rates, density = self._density(w)
        delayed = -jnp.expm1(-jnp.exp(log_rates + log_t))
        J = FINE_STEP * jnp.sum(density * delayed, -1) + self._above(w[..., -1] + FINE_STEP, FINE_STEP)
        return jnp.where(positive, J, 0.0)

    @property
    def _extra_range(self) -> float:
        """As in the base class; far from tau on either side w exceeds the logarithm by log(pi alpha/sin(pi alpha))/alpha.

        It is constant for most orders, which share a compiled program; within jit it suffices for every order.
        """
        if not is_concrete(self.alpha):
            return self._excess(self._largest_order)
        return self._excess(max(float(self.alpha), USUAL_ORDER))

    @staticmethod
    def _excess(alpha: float) -> float:
        return 2.0 / alpha * math.log(math.pi * alpha / math.sin(math.pi * alpha))

    @property
    def _log_tau(self) -> Array:
        return jnp.log(jnp.asarray(self.V, dtype=float) / self.G) / self.alpha

    def _density(self, w: Array) -> tuple[Array, Array]:
        angle, log_p, log_q = jnp.pi * self.alpha, -softplus(-self.alpha * w), -softplus(self.alpha * w)
        log_sine = lambda log_share: jnp.log(jnp.sin(angle * jnp.exp(log_share)))
        log_rate = (log_sine(log_p) - log_sine(log_q)) / self.alpha - self._log_tau
        return log_rate, self.alpha / self.G * jnp.exp(log_p + log_q)

    def _position(self, log_rate: Array) -> Array:
        y = jnp.exp(self.alpha * (log_rate + self._log_tau))
        sine, cosine = jnp.sin(jnp.pi * self.alpha), jnp.cos(jnp.pi * self.alpha)
        return jnp.log(jnp.arctan2(sine, 1.0 / y + cosine) / jnp.arctan2(sine, y + cosine)) / self.alpha

    def _above(self, w: Array, step: Array | float) -> Array:
        """Return the integral of the logistic density from half a step below w, with the first term of its error."""
        width = self.alpha * step
        q = jnp.exp(-softplus(self.alpha * w - width / 2.0))
        return (q + width**2 / 24.0 * q * (1.0 - q) * (2.0 * q - 1.0)) / self.G


def power(t: Array | float, alpha: Array | float) -> Array:
    """Return t^alpha/Gamma(1 + alpha), t >= 0 of any shape; its derivatives are finite at t = 0 as well."""
    t, alpha = as_float64(t), as_float64(alpha)
    positive = t > 0.0
    return jnp.where(
        positive, jnp.exp(alpha * jnp.log(jnp.where(positive, t, 1.0)) - gammaln(1.0 + alpha)), 0.0
    )
