"""Fractional materials: creep as a power of time, and its cut to retardation times for the solver.

A springpot of quasi-property V [Pa s^alpha] and order 0 < alpha < 1 lies between a spring and a dashpot:

    J(t) = t^alpha/(V Gamma(1 + alpha)).

Its retardation times fill the whole axis. With the rate r = exp(w) and with E_alpha of Mittag-Leffler, x = t/tau,

    t^alpha/Gamma(1 + alpha) = sin(pi alpha)/pi int r^-alpha (1 - exp(-r t)) dw,
    1 - E_alpha(-x^alpha) = 1/(pi alpha) int_0^(pi alpha) (1 - exp(-x r)) dtheta,
    r^alpha = sin(theta)/sin(pi alpha - theta).

The second is the first but for theta = pi alpha/(1 + exp(-alpha w)), in which its rates become those of the first far
from tau, and its density a smooth bump for every alpha. Over w, step h, the trapezoid rule errs by exp(-pi^2/h), as
the integrand is analytic for |Im w| < pi/2: so a sum of exponentials represents either law. Rates too fast for the
times that are asked for act as a spring, and those too slow as a dashpot and one retardation time, which have the
same first three derivatives at t = 0.

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
from jaxcontact._support.pytree import pytree, replace
from jaxcontact.inputs.materials import NU, Material, Prony

REACH = 80.0  # e-folds of rates summed beyond those that are kept, before a closed form takes over
FINE = 0.4  # step of the sum for J(t) itself: an error of exp(-pi^2/0.4) = 2e-11
MOST = 0.999  # greatest alpha that a spectrum of modes is summed for
NEAR_ONE = (
    1e-7  # what alpha of a power law is kept below one by in its cut, which changes J(t) by no more a decade
)


class Fractional(abc.ABC):
    """What the fractional laws share: J(t), and their cut to retardation times."""

    V: Array | float
    alpha: Array | float
    nu: Array | float | None
    bulk_modulus: Array | float | None

    __post_init__ = Material.__post_init__  # a bulk modulus takes the place of a nu that was not given

    @abc.abstractmethod
    def creep(self, t: Array | float) -> Array:
        """Shear creep compliance J(t) [1/Pa], t >= 0 [s] of any shape."""

    def shifted(self, factor: Array | float) -> Self:
        """Return the material with all its times multiplied by ``factor`` > 0: J(t; factor) = J(t/factor).

        The quasi-property V becomes V factor^alpha; the modulus stays.
        """
        return replace(self, V=self.V * jnp.asarray(factor, float) ** self.alpha)

    _most: ClassVar[float] = MOST  # greatest alpha of a cut
    _stretch: ClassVar[float] = 0.0  # e-folds by which w may be longer than the logarithm of the rates

    @property
    def _spring(self) -> Array | float:
        """Compliance of a spring in series [1/Pa]."""
        return 0.0

    @abc.abstractmethod
    def _density(self, w: Array) -> tuple[Array, Array]:
        """Logarithm of the rate [1/s], and compliance per w [1/Pa], at w of any shape."""

    @abc.abstractmethod
    def _place(self, log_rate: Array) -> Array:
        """w of a rate."""

    @abc.abstractmethod
    def _above(self, w: Array, step: Array | float) -> Array:
        """Compliance of the modes w, w + step, w + 2 step ... [1/Pa]."""

    def prony(self, shortest: float, longest: float, tolerance: float = 1e-5) -> Prony:
        """The material of retardation times that creeps alike between two times, for the solver.

        Its J(t) is within ``tolerance`` of this one's, relatively, for shortest <= t <= longest and
        0.05 <= alpha <= 0.95; before, it is stiffer than a spring of a share of J(shortest) and softer than
        J(shortest); after, it flows. It takes about log(1/tolerance)/4 retardation times a decade, and a few.

        Args:
            shortest: the first time that matters [s] > 0, such as the first step of a run.
            longest: the last time that matters [s].
            tolerance: relative error of J(t), 1e-8 to 0.1.

        Returns:
            A ``Prony``, differentiable with respect to the parameters.

        Raises:
            ValueError: times or a tolerance out of range, a parameter that is not > 0, or alpha not between 0 and 1.

        Example:
            >>> gel = jc.Springpot(V=1e3, alpha=0.2, nu=0.5)
            >>> cut = gel.prony(1e-3, 1e3)
            >>> f"{float(cut.creep(2.0) / gel.creep(2.0)):.4f}"
            '1.0000'
        """
        self._check(shortest, longest, tolerance)
        return self._summable()._sum(shortest, longest, tolerance)

    def _summable(self) -> "Fractional":
        """The law with an order whose spectrum can be summed."""
        return self

    def _sum(self, shortest: float, longest: float, tolerance: float) -> Prony:
        """As ``prony``."""
        step = math.pi**2 / math.log(1.0 / tolerance)
        slow = -math.log(longest) - math.log(1.0 / tolerance) / 3.0
        fast = math.log(math.log(1.0 / tolerance) / shortest)
        n = math.ceil((fast - slow + self._stretch) / step)
        return self._cut(slow, step, n, math.ceil(REACH / step))

    @functools.partial(jax.jit, static_argnames=("n", "beyond"))
    def _cut(self, slow: Array | float, step: Array | float, n: int, beyond: int) -> Prony:
        """n modes from the logarithm of a rate on, and what stands for those beyond them on either side."""
        first = jax.lax.stop_gradient(self._place(jnp.asarray(slow)))
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
        """Fluidity [1/(Pa s)], compliance [1/Pa] and rate [1/s] that stand for the modes at w and all below."""
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
        checks.between("alpha", self.alpha, 0.0, self._most)


class PowerLaw(Fractional):
    """The modes of a springpot, alone or with a spring in series."""

    _most: ClassVar[float] = 1.0

    def _summable(self) -> "PowerLaw":
        return replace(self, alpha=jnp.minimum(self.alpha, 1.0 - NEAR_ONE))

    def _density(self, w: Array) -> tuple[Array, Array]:
        return w, jnp.sin(jnp.pi * self.alpha) / (jnp.pi * self.V) * jnp.exp(-self.alpha * w)

    def _place(self, log_rate: Array) -> Array:
        return log_rate

    def _above(self, w: Array, step: Array | float) -> Array:
        return step * self._density(w)[1] / -jnp.expm1(-self.alpha * step)


@pytree
class Springpot(PowerLaw):
    """J(t) = t^alpha/(V Gamma(1 + alpha)): a power law.

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
        """J(t) [1/Pa], t >= 0 [s] of any shape."""
        return power(t, self.alpha) / self.V


@pytree
class FractionalMaxwell(PowerLaw):
    """J(t) = 1/G + t^alpha/(V Gamma(1 + alpha)): a spring and a springpot in series.

    Args:
        G: shear modulus at first [Pa] > 0.
        V: quasi-property of the springpot [Pa s^alpha] > 0.
        alpha: its order, 0 < alpha < 1.
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
        """J(t) [1/Pa], t >= 0 [s] of any shape."""
        return 1.0 / self.G + power(t, self.alpha) / self.V

    @property
    def _spring(self) -> Array | float:
        return 1.0 / self.G


@pytree
class FractionalKelvinVoigt(Fractional):
    """J(t) = (1 - E_alpha(-(t/tau)^alpha))/G, tau^alpha = V/G: a spring and a springpot in parallel.

    Args:
        G: shear modulus in the end [Pa] > 0.
        V: quasi-property of the springpot [Pa s^alpha] > 0.
        alpha: its order, 0 < alpha < 1.
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
        """J(t) [1/Pa], t >= 0 [s] of any shape, to 1e-9 of it."""
        t = jnp.asarray(t, dtype=float)
        some = t > 0.0
        log_t = jnp.log(jnp.where(some, t, 1.0))[..., None]
        centre = jax.lax.stop_gradient(self._place(-log_t))
        w = centre + FINE * jnp.arange(-REACH / FINE, REACH / FINE)
        log_rates, density = self._density(w)
        delayed = -jnp.expm1(-jnp.exp(log_rates + log_t))
        J = FINE * jnp.sum(density * delayed, -1) + self._above(w[..., -1] + FINE, FINE)
        return jnp.where(some, J, 0.0)

    _stretch = 6.4  # for alpha up to 0.95

    @property
    def _log_tau(self) -> Array:
        return jnp.log(jnp.asarray(self.V, dtype=float) / self.G) / self.alpha

    def _density(self, w: Array) -> tuple[Array, Array]:
        angle, log_p, log_q = jnp.pi * self.alpha, -softplus(-self.alpha * w), -softplus(self.alpha * w)
        log_sine = lambda log_share: jnp.log(jnp.sin(angle * jnp.exp(log_share)))
        log_rate = (log_sine(log_p) - log_sine(log_q)) / self.alpha - self._log_tau
        return log_rate, self.alpha / self.G * jnp.exp(log_p + log_q)

    def _place(self, log_rate: Array) -> Array:
        y = jnp.exp(self.alpha * (log_rate + self._log_tau))
        sine, cosine = jnp.sin(jnp.pi * self.alpha), jnp.cos(jnp.pi * self.alpha)
        return jnp.log(jnp.arctan2(sine, 1.0 / y + cosine) / jnp.arctan2(sine, y + cosine)) / self.alpha

    def _above(self, w: Array, step: Array | float) -> Array:
        """The integral of the logistic density from half a step before, and the first term of what it is off by."""
        width = self.alpha * step
        q = jnp.exp(-softplus(self.alpha * w - width / 2.0))
        return (q + width**2 / 24.0 * q * (1.0 - q) * (2.0 * q - 1.0)) / self.G


def power(t: Array | float, alpha: Array | float) -> Array:
    """t^alpha/Gamma(1 + alpha), t >= 0 of any shape; derivatives too are finite at t = 0."""
    t, alpha = jnp.asarray(t, dtype=float), jnp.asarray(alpha, dtype=float)
    some = t > 0.0
    return jnp.where(some, jnp.exp(alpha * jnp.log(jnp.where(some, t, 1.0)) - gammaln(1.0 + alpha)), 0.0)
