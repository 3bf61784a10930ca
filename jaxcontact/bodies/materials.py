"""Isotropic linear materials in shear, elastic and viscoelastic.

One compliance is used throughout: the shear creep compliance

    J(t) = gamma(t) / tau0   [1/Pa],

the shear strain per unit of a shear stress applied as a step at t = 0; J = 1/G for an elastic solid.
The paper writes phi(t) for 1/(2G) in its Eq. (14), so its film has J = 2 phi (only with this factor are its own Table 3
and Fig. 10a reproduced).

The volume response is one of two kinds. With a constant Poisson's ratio nu, the volume compliance creeps in proportion
to the shear compliance; with a bulk modulus K it is elastic, and

    nu(s) = (3 K j - 2)/(6 K j + 2),      j = s J(s),

tends to 1/2 as the shear stiffness relaxes to zero: a fluid is incompressible in the limit. The models: W. N. Findley,
J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976, ch. 5.
"""

import abc
import functools
import math
from typing import ClassVar, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.nn import softplus
from jax.scipy.special import gammaln

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.exponential import mean_decay, mittag_leffler
from jaxcontact._support.pytree import Base, as_float64, is_concrete, pytree, replace
from jaxcontact.bodies import finite_elements

# The canonical form of a material: its creep compliance as a sum of exponentials, and its relaxation modes.
#
#     J(t) = J0 + sum_i J_i (1 - exp(-t/tau_i)) + fluidity t
#
# has the Laplace transform s J(s) = h(s)/s, where
#
#     h(s) = s J0 + fluidity + sum_i (J_i/tau_i) s/(s + 1/tau_i).
#
# The relaxation modulus has the transform G(s) = 1/h(s), so that with the roots -rho_k of h
#
#     G(t) = sum_k exp(-rho_k t) / h'(-rho_k),      all rho_k real and >= 0, all terms positive
#
# (from J(s) G(s) = 1/s^2). In parallel with a spring c the compliance is again of that form: 1/(s (G(s) + c)) is the
# transform of
#
#     J_c(t) = J0/(1 + c J0) + sum_k a_k (1 - exp(-rho_k t)),
#
# with rho_k the relaxation rates of the material with a compliance 1/c in series, and a_k = w_k/c^2, where w_k are
# the weights of that relaxation: all terms are positive.
#
# A material given by its relaxation, G(t) = Ge + sum_i G_i exp(-r_i t), has its retardation rates at the zeros rho_k
# of
#
#     G*(-rho) = -rho F(rho),      F(rho) = sum_i G_i/(r_i - rho) - Ge/rho,
#
# one between each two neighbours of 0, r_1, r_2, ..., and the compliances J_k = 1/(rho_k^2 F'(rho_k)) there.


BISECTIONS = 100  # a root is found to 1e-30 of the interval between rates
SLOW = 1e-3  # the root of a fluid below this part of the lowest retardation rate follows from its fluidity


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

    def rates_and_fluidities(self) -> tuple[Array, Array]:
        """Return the rates 1/tau_i [1/s] and their fluidities J_i/tau_i [1/(Pa s)], steady-state flow last with rate 0."""
        rates, fluidities = self.rates, self.amplitudes * self.rates
        if self.fluidity is None:
            return rates, fluidities
        return jnp.append(rates, 0.0), jnp.append(fluidities, self.fluidity)


# logarithm of the interval between two rates over the smallest distance of a zero from its ends
LEAST_GAP = 300.0
MANY = 32  # retardation rates above which a product over them is a loop of the program
LEAST_PART = 1e-100  # part of the instantaneous modulus in place of moduli of zero, so that a zero lies between all rates


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
    total = (spectrum.instantaneous + jnp.asarray(extra, dtype=float))[..., None]
    rates, parts = spectrum.rates, spectrum.amplitudes * spectrum.rates
    if spectrum.fluidity is not None:  # a rate zero for the flow
        rates = jnp.append(jnp.zeros_like(spectrum.fluidity), rates)
        parts = jnp.append(spectrum.fluidity, parts)

    rho = jnp.zeros((*total.shape[:-1], 0))
    if rates.shape[0] > 0:
        # 1. Zeros of total + sum_i parts_i/(r_i - rho), which rises between the r_i, by bisection; an end where there is
        # none. By the geometric mean, since neighbouring rates may be tens of decades apart.
        r, w, J = jax.lax.stop_gradient((rates, parts, total))
        top = r[-1:] + jnp.sum(w) / J
        high = jnp.concatenate([jnp.broadcast_to(r[1:], (*top.shape[:-1], r.size - 1)), top], -1)

        def halve(_: int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
            low, high = ends
            middle = jnp.where(low > 0.0, jnp.sqrt(low) * jnp.sqrt(high), (low + high) / 2.0)
            gap = r - middle[..., None]
            below = J + jnp.sum(w / jnp.where(gap == 0.0, jnp.inf, gap), -1) < 0.0
            return jnp.where(below, middle, low), jnp.where(below, high, middle)

        low, high = jax.lax.fori_loop(0, BISECTIONS, halve, (jnp.broadcast_to(r, high.shape), high))
        rho = (low + high) / 2.0

        # 2. The lowest root of a fluid, far below the retardation rates, is in proportion to the fluidity w_0, the part of
        # the rate r_0 = 0, in rho = w_0/(total + sum_{i > 0} w_i/(r_i - rho)). This preserves its relative accuracy: it is
        # exactly zero without a fluidity. Bisection alone leaves 1e-30 of r_1.
        if spectrum.fluidity is not None:
            lowest = rho[..., 0]
            slow = lowest < SLOW * jnp.min(r[1:], initial=jnp.inf)
            gaps = r[1:] - jnp.where(slow, lowest, 0.0)[..., None]
            own = w[0] / (J[..., 0] + jnp.sum(w[1:] / jnp.where(gaps > 0.0, gaps, jnp.inf), -1))
            rho = rho.at[..., 0].set(jnp.where(slow, own, lowest))

        # 3. Newton steps carry the first and second derivatives.
        for _ in range(2):
            rho = _newton(rates, parts, total, rho)

    # 4. The weights of the formula above.
    zero = jnp.zeros((*rho.shape[:-1], 1))
    roots = rho if spectrum.fluidity is not None else jnp.concatenate([zero, rho], -1)
    n = spectrum.rates.shape[0]

    def times_factor(weight: Array, i: Array | int) -> tuple[Array, None]:
        others = jnp.where(jnp.arange(n + 1) > i, roots[..., i, None], roots[..., i + 1, None])
        gap = others - roots
        factor = (spectrum.rates[i] - roots) / jnp.where(gap == 0.0, 1.0, gap)
        return weight * jnp.where(gap == 0.0, 0.0, factor), None

    weight = jnp.ones_like(roots)
    if n > MANY:  # each factor of the product below is a program of its own where nothing is compiled
        weight, _ = jax.lax.scan(times_factor, weight, jnp.arange(n))
    for i in range(n if n <= MANY else 0):
        weight, _ = times_factor(weight, i)
    return rho, (weight if spectrum.fluidity is not None else weight[..., 1:]) / total


@jax.jit  # traced once for both steps
def _newton(rates: Array, weights: Array, total: Array, rho: Array) -> Array:
    """Return rho (..., m) after a Newton step towards a zero of

        (total + sum_i weights_i/(r_i - rho)) prod_i (r_i - rho)/(r_i + rho),

    expanded so that nothing is divided by r_i - rho, which is zero for a branch of zero compliance.
    """

    def characteristic(rho: Array) -> Array:
        size = jax.lax.stop_gradient(rates + rho[..., None])
        size = jnp.where(size == 0.0, 1.0, size)
        factors = (rates - rho[..., None]) / size
        value = total * jnp.prod(factors, -1)
        if rates.shape[0] > MANY:
            # the products without one factor are those before it times those behind it
            one = jnp.ones_like(factors[..., :1])
            ahead = jnp.concatenate([one, jnp.cumprod(factors[..., :-1], -1)], -1)
            behind = jnp.concatenate([jnp.flip(jnp.cumprod(jnp.flip(factors[..., 1:], -1), -1), -1), one], -1)
            return value + jnp.sum(weights / size * ahead * behind, -1)
        for i in range(rates.shape[0]):
            value = value + weights[i] / size[..., i] * jnp.prod(jnp.delete(factors, i, axis=-1), -1)
        return value

    value, slope = jax.jvp(characteristic, (rho,), (jnp.ones_like(rho),))
    return rho - value / jnp.where(slope == 0.0, jnp.inf, slope)


def parallel_creep(spectrum: Spectrum, stiffness: Array) -> tuple[Array, Array, Array]:
    """Return the creep of a material in parallel with springs c, J_c(t) = start + sum_k a_k (1 - exp(-rho_k t)).

    Returns start [1/Pa], (...); a [1/Pa], (..., m); rho [1/s], (..., m) for stiffness (...) [Pa].
    """
    # 1/(g + c) = 1/c - 1/c^2/(1/c + 1/g): the modulus 1/(1/c + 1/g) is that of the material in series with the spring, so
    # that J_c(t) = 1/c - G_series(t)/c^2, with the rates rho_k of G_series and a_k = w_k/c^2
    rho, weight = relaxation_modes(spectrum, 1.0 / stiffness)
    J0 = spectrum.instantaneous
    return J0 / (1.0 + stiffness * J0), weight / stiffness[..., None] ** 2, rho


NU = float("0.3")  # the default, distinguished by its identity from a value of 0.3 passed by the user


class Material(Base, abc.ABC):
    """Base class of materials: shear creep given by ``spectrum``, with a constant Poisson's ratio nu or a bulk modulus.

    Parameters are positive numbers, except those in ``may_be_zero`` and the ``lists``, which have a common length.
    """

    nu: Array | float | None
    bulk_modulus: Array | float | None = None  # also where a subclass has no such field
    may_be_zero: ClassVar[tuple[str, ...]] = ()
    lists: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        """Let a bulk modulus replace a nu that was not given."""
        if not hasattr(self, "nu"):
            name = type(self).__name__
            raise TypeError(f"{name}: expected a field of Poisson's ratio, such as nu: float = 0.3, got none")
        if self.bulk_modulus is not None and self.nu is NU:
            object.__setattr__(self, "nu", None)

    @abc.abstractmethod
    def spectrum(self) -> Spectrum:
        """Return the retardation spectrum of the material."""

    def nu_at(self, compliance: Array) -> Array:
        """Return Poisson's ratio for a shear compliance j [1/Pa], which is complex at a frequency.

        It is ``nu``, or (3 K j - 2)/(6 K j + 2) with the bulk modulus K."""
        if self.bulk_modulus is None:
            return jnp.asarray(self.nu, float)
        stiff = 3.0 * self.bulk_modulus * compliance
        return (stiff - 2.0) / (2.0 * stiff + 2.0)

    def _check_evaluated(self, t: Array | float = 0.0) -> None:
        """Check the parameters and the times of an evaluation, where their values are known."""
        if is_concrete(self, t):
            check_material("material", self)
            checks.since_loading("t", t)

    def creep(self, t: Array | float) -> Array:
        """Return the shear creep compliance J(t) [1/Pa], t >= 0 [s] of any shape; ValueError for a negative t."""
        self._check_evaluated(t)
        return self.spectrum().creep(t)

    def scaled(self, factor: Array | float) -> Self:
        """Return the material with all moduli and viscosities multiplied by ``factor``, with the same times and Poisson's
        ratio.

        The bulk modulus of an elastic volume response is multiplied as well.
        """
        checks.positive("factor", factor)
        compliances, unchanged = ("J0", "J", "fluidity"), ("nu", "tau")
        change = {}
        for name, value in vars(self).items():
            if name not in unchanged and value is not None:
                number = jnp.asarray(value, float) if isinstance(value, list | tuple) else value
                change[name] = number / factor if name in compliances else number * factor
        return replace(self, **change)

    def shifted(self, factor: Array | float) -> Self:
        """Return the material with all its times multiplied by ``factor`` > 0: J(t; factor) = J(t/factor).

        Moduli do not change and viscosities are multiplied by ``factor``. This is time-temperature superposition with the
        shift factor a_T = factor (J. D. Ferry, Viscoelastic Properties of Polymers, 1980, ch. 11).

        Example:
            >>> melt = jc.Maxwell(G=1e5, eta=1e6)
            >>> cold = melt.shifted(10.0)
            >>> f"{cold.creep(50.0) / melt.creep(5.0):.2f}"
            '1.00'
        """
        checks.positive("factor", factor)
        change = {}
        for name, value in vars(self).items():
            if name == "tau" or name.startswith("eta"):
                change[name] = jnp.asarray(value, float) * factor
            elif name == "fluidity":
                change[name] = jnp.asarray(value, float) / factor
        return replace(self, **change)

    def relaxation(self, t: Array | float) -> Array:
        """Return the shear relaxation modulus G(t) [Pa], t >= 0 [s] of any shape; ValueError for a negative t."""
        self._check_evaluated(t)
        spectrum = self.spectrum()
        rho, weights = relaxation_modes(spectrum)
        decay = jnp.exp(-jnp.asarray(as_float64(t))[..., None] * rho) @ weights
        if spectrum.fluidity is not None:
            return decay
        # the relaxed modulus of a solid, that of the root rho = 0 of h, which is not among the modes
        return 1.0 / (spectrum.instantaneous + jnp.sum(spectrum.amplitudes)) + decay

    def complex_modulus(self, omega: Array | float) -> Array:
        """Return the complex modulus G*(omega) = i omega G(i omega) [Pa], omega [rad/s] of any shape; omega > 0 for a
        fluid.
        """
        self._check_evaluated()
        s = 1j * jnp.asarray(as_float64(omega))
        spectrum = self.spectrum()
        if spectrum.fluidity is not None:
            return s / spectrum.transform(s)
        parts = spectrum.amplitudes * (spectrum.rates / (s[..., None] + spectrum.rates))
        return 1.0 / (spectrum.instantaneous + jnp.sum(parts, -1))

    def laplace_compliance(self, s: Array | complex) -> Array:
        """Return the Laplace transform of J(t): J(s) = h(s)/s^2 [s/Pa], s [1/s] real or complex, Re s > 0."""
        self._check_evaluated()
        return self.spectrum().transform(s) / jnp.asarray(s) ** 2

    def _prony_table(self, long_term: float) -> finite_elements.Table:
        """Return the relaxation modulus as a table for a finite-element program."""
        check_material("material", self)
        spectrum = self.spectrum()
        rho, weights = relaxation_modes(spectrum)
        relaxed: Array | float = 0.0
        if spectrum.fluidity is None:
            relaxed = 1.0 / (spectrum.instantaneous + jnp.sum(spectrum.amplitudes))
        if float(spectrum.instantaneous) == 0.0:
            weights = jnp.full_like(rho, jnp.inf)  # an impulse at t = 0
        given = self.nu, self.bulk_modulus
        return finite_elements.table(type(self).__name__, relaxed, weights, rho, *given, long_term)

    def to_abaqus(
        self,
        name: str = "MATERIAL",
        *,
        units: str = "m",
        density: float | None = None,
        long_term: float = 0.0,
    ) -> str:
        """Return the material as keywords of Abaqus, with the convention in comments (``*ELASTIC, MODULI=INSTANTANEOUS`` and
        ``*VISCOELASTIC, TIME=PRONY`` with g_i = G_i/G0 and k_i = K_i/K0).

        A fluid (Maxwell, Burgers) has sum g_i = 1. Abaqus takes it with the instantaneous moduli used here, but neither with
        MODULI=LONG TERM nor in a step that uses the long-term modulus; ``long_term`` leaves a small one.

        Args:
            name: of the material in Abaqus.
            units: "m" (SI), "mm" (N, tonne, MPa) or "um" (uN, kg, MPa); time is in s.
            density: [kg/m3], to be written as well.
            long_term: least ratio of the moduli at long times and at t = 0, 0 to 0.5.

        Raises:
            ValueError: an infinite modulus at t = 0 (Kelvin-Voigt), or values out of range.

        Example:
            >>> rubber = jc.StandardLinearSolid(G1=2e6, G2=2e6, eta2=1e6, nu=0.45)
            >>> print(rubber.to_abaqus("RUBBER", units="mm").split("TIME=PRONY")[1].strip())
            0.5, 0.5, 0.25
        """
        return finite_elements.abaqus(self._prony_table(long_term), name, units, density)

    def to_ansys(
        self, number: int = 1, *, units: str = "m", density: float | None = None, long_term: float = 0.0
    ) -> str:
        """Return the material as commands of ANSYS, with the convention in comments (``MP,EX`` and ``PRXY`` at t = 0, and
        ``TB,PRONY`` with alpha_i = G_i/G0, for the shear and, with a constant Poisson's ratio, for the bulk modulus).

        A fluid has sum alpha_i = 1; where ANSYS refuses that, ``long_term=1e-6`` leaves a small long-term modulus.

        Args:
            number: of the material in ANSYS.
            units, density, long_term: as in ``to_abaqus``.

        Raises:
            ValueError: as ``to_abaqus``.

        Example:
            >>> rubber = jc.StandardLinearSolid(G1=2e6, G2=2e6, eta2=1e6, bulk_modulus=1e9)
            >>> print(rubber.to_ansys(3).splitlines()[-1])
            TBDATA,1,0.5,0.25
        """
        return finite_elements.ansys(self._prony_table(long_term), number, units, density)

    def to_comsol(self, *, density: float | None = None, long_term: float = 0.0) -> str:
        """Return the branches of COMSOL's generalized Maxwell model as a table (SI), with the elastic part in comments.

        G and K of the elastic material are those of long times. A fluid has G = 0 there, with which COMSOL has no stationary
        solution; ``long_term`` leaves a small modulus.

        Args:
            density, long_term: as in ``to_abaqus``.

        Raises:
            ValueError: as ``to_abaqus``.

        Example:
            >>> rubber = jc.StandardLinearSolid(G1=2e6, G2=2e6, eta2=1e6, bulk_modulus=1e9)
            >>> print(rubber.to_comsol().splitlines()[-1])
            1 1000000.0 0.25
        """
        return finite_elements.comsol(self._prony_table(long_term), density)


def check_material(where: str, material: Material) -> Verdict:
    """Check the parameters of a material.

    Moduli and viscosities are > 0, and either nu is in (-1, 0.5] or a bulk modulus is given; each is one number. The
    lists of a spectrum have one shape.
    """
    remedy = ": use its prony(shortest, longest)" if hasattr(material, "prony") else ""
    checks.require(
        isinstance(material, Material),
        f"{where}: expected a material (Elastic, Burgers, Maxwell, ...), got {type(material).__name__}{remedy}",
    )
    kind = type(material).__name__
    # a class with its own ``__init__`` may have no nu
    nu, K = getattr(material, "nu", None), material.bulk_modulus
    checks.require(
        (nu is None) != (K is None),
        f"{where} {kind}: expected one of nu and bulk_modulus, got {'neither' if nu is None else 'both'}",
    )
    valid = True if nu is None else checks.poisson_ratio(f"{where} nu", nu)
    given = {name: value for name, value in vars(material).items() if value is not None}
    for name, value in given.items():
        listed = name in material.lists
        checks.require(
            np.ndim(value) <= listed,
            f"{where} {kind} {name}: expected {'a list' if listed else 'a number'}, got shape {np.shape(value)}",
        )
        if name != "nu":
            check = checks.non_negative if name in material.may_be_zero else checks.positive
            valid = valid & check(f"{where} {kind} {name}", value)
    shapes = [np.shape(getattr(material, name)) for name in material.lists]
    checks.require(
        len(set(shapes)) <= 1,
        f"{where} {kind}: expected {' and '.join(material.lists)} of one shape, got {' and '.join(map(str, shapes))}",
    )
    return valid


@pytree
class Elastic(Material):
    """An elastic solid: J = 1/G.

    Args:
        G: shear modulus [Pa] > 0.
        nu: Poisson's ratio, -1 < nu <= 0.5.
        bulk_modulus: K [Pa] > 0 of an elastic volume response, in place of nu.

    Example:
        >>> steel = jc.Elastic.from_young(210e9, nu=0.3)
        >>> f"{steel.G / 1e9:.2f} GPa"
        '80.77 GPa'
    """

    G: Array | float
    nu: Array | float | None = NU
    bulk_modulus: Array | float | None = None

    @classmethod
    def from_young(cls, E: Array | float, nu: Array | float = 0.3) -> "Elastic":
        """Return the solid with Young's modulus E [Pa]: G = E/(2(1 + nu))."""
        checks.poisson_ratio("nu", nu)
        return cls(G=E / (2.0 * (1.0 + nu)), nu=nu)

    def spectrum(self) -> Spectrum:
        return Spectrum(1.0 / jnp.asarray(self.G, dtype=float), jnp.zeros(0), jnp.zeros(0))


@pytree
class Rigid(Material):
    """A solid that does not deform, J = 0: the base of a body whose substrate is None."""

    nu: Array | float | None = NU
    bulk_modulus: Array | float | None = None

    def spectrum(self) -> Spectrum:
        return Spectrum(jnp.zeros(()), jnp.zeros(0), jnp.zeros(0))


@pytree
class Maxwell(Material):
    """A Maxwell fluid: J(t) = 1/G + t/eta.

    Source: Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, Eq. (11).

    Args:
        G: shear modulus [Pa] > 0.
        eta: viscosity [Pa s] > 0.
        nu: Poisson's ratio, -1 < nu <= 0.5.
        bulk_modulus: K [Pa] > 0 of an elastic volume response, in place of nu.

    Example:
        >>> pitch = jc.Maxwell(G=1e9, eta=1e11)
        >>> f"{pitch.relaxation(100.0) / 1e9:.3f} GPa"           # G exp(-G t/eta)
        '0.368 GPa'
    """

    G: Array | float
    eta: Array | float
    nu: Array | float | None = NU
    bulk_modulus: Array | float | None = None

    def spectrum(self) -> Spectrum:
        return Spectrum(
            1.0 / jnp.asarray(self.G, dtype=float), jnp.zeros(0), jnp.zeros(0),
            1.0 / jnp.asarray(self.eta, dtype=float),
        )  # fmt: skip


@pytree
class KelvinVoigt(Material):
    """A Kelvin-Voigt solid: J(t) = (1 - exp(-G t/eta))/G.

    Its instantaneous compliance is zero: ``relaxation`` is G for t > 0 and omits the impulse eta delta(t).

    Args:
        G: shear modulus [Pa] > 0.
        eta: viscosity [Pa s] > 0.
        nu: Poisson's ratio, -1 < nu <= 0.5.
        bulk_modulus: K [Pa] > 0 of an elastic volume response, in place of nu.

    Example:
        >>> gel = jc.KelvinVoigt(G=1e3, eta=2e3, nu=0.5)
        >>> f"{gel.creep(2.0) * 1e3:.3f} 1/kPa"
        '0.632 1/kPa'
    """

    G: Array | float
    eta: Array | float
    nu: Array | float | None = NU
    bulk_modulus: Array | float | None = None

    def spectrum(self) -> Spectrum:
        G, eta = jnp.asarray(self.G, dtype=float), jnp.asarray(self.eta, dtype=float)
        return Spectrum(jnp.zeros_like(G), jnp.stack([1.0 / G]), jnp.stack([G / eta]))

    def relaxation(self, t: Array | float) -> Array:
        """Return G(t) = G for t > 0 [Pa]; the impulse eta delta(t) is omitted."""
        self._check_evaluated(t)
        return jnp.asarray(self.G, dtype=float) + jnp.zeros_like(as_float64(t))


@pytree
class StandardLinearSolid(Material):
    """A standard linear solid: J(t) = 1/G1 + (1 - exp(-G2 t/eta2))/G2.

    Args:
        G1: instantaneous modulus [Pa] > 0.
        G2: modulus of the delayed part [Pa] > 0.
        eta2: viscosity of the delayed part [Pa s] > 0.
        nu: Poisson's ratio, -1 < nu <= 0.5.
        bulk_modulus: K [Pa] > 0 of an elastic volume response, in place of nu.

    Example:
        >>> rubber = jc.StandardLinearSolid(G1=2e6, G2=2e6, eta2=1e6, nu=0.5)
        >>> f"{rubber.relaxation(1e3) / 1e6:.2f} MPa"             # the relaxed modulus G1 G2/(G1 + G2)
        '1.00 MPa'
    """

    G1: Array | float
    G2: Array | float
    eta2: Array | float
    nu: Array | float | None = NU
    bulk_modulus: Array | float | None = None

    def spectrum(self) -> Spectrum:
        G2, eta2 = jnp.asarray(self.G2, dtype=float), jnp.asarray(self.eta2, dtype=float)
        return Spectrum(
            1.0 / jnp.asarray(self.G1, dtype=float), jnp.stack([1.0 / G2]), jnp.stack([G2 / eta2])
        )


@pytree
class Burgers(Material):
    """A Burgers fluid: J(t) = 1/G1 + (1 - exp(-G2 t/eta2))/G2 + t/eta1.

    Source: Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, Eq. (13). The example is the
    tribofilm of Eq. (14), which states phi = J/2.

    Args:
        G1: instantaneous modulus [Pa] > 0.
        G2: modulus of the delayed part [Pa] > 0.
        eta1: viscosity of the steady-state flow [Pa s] > 0.
        eta2: viscosity of the delayed part [Pa s] > 0.
        nu: Poisson's ratio, -1 < nu <= 0.5.
        bulk_modulus: K [Pa] > 0 of an elastic volume response, in place of nu.

    Example:
        >>> film = jc.Burgers(G1=0.75e9, G2=13.89e6, eta1=3.1486e12, eta2=120.9e9, nu=0.3)
        >>> f"{film.creep(7200.0) / film.creep(0.0):.1f} times"
        '33.1 times'
    """

    G1: Array | float
    G2: Array | float
    eta1: Array | float
    eta2: Array | float
    nu: Array | float | None = NU
    bulk_modulus: Array | float | None = None

    def spectrum(self) -> Spectrum:
        G2, eta2 = jnp.asarray(self.G2, dtype=float), jnp.asarray(self.eta2, dtype=float)
        return Spectrum(
            1.0 / jnp.asarray(self.G1, dtype=float), jnp.stack([1.0 / G2]), jnp.stack([G2 / eta2]),
            1.0 / jnp.asarray(self.eta1, dtype=float),
        )  # fmt: skip


@pytree
class Prony(Material):
    """A generalized Kelvin-Voigt material: J(t) = J0 + sum_i J_i (1 - exp(-t/tau_i)) + fluidity t.

    Args:
        J0: instantaneous compliance [1/Pa] >= 0.
        J: delayed compliances [1/Pa] >= 0, (n,).
        tau: their retardation times [s] > 0, (n,); some may be equal.
        nu: Poisson's ratio, -1 < nu <= 0.5.
        fluidity: inverse of the steady-flow viscosity [1/(Pa s)] >= 0.
        bulk_modulus: K [Pa] > 0 of an elastic volume response, in place of nu.

    Example:
        >>> polymer = jc.Prony(J0=1e-9, J=np.array([2e-9, 5e-9]), tau=np.array([1.0, 100.0]))
        >>> f"{polymer.relaxation(1e6) / 1e6:.0f} MPa"            # the relaxed modulus 1/(J0 + sum J)
        '125 MPa'
    """

    may_be_zero = ("J0", "J", "fluidity")
    lists = ("J", "tau")

    J0: Array | float
    J: Array
    tau: Array
    nu: Array | float | None = NU
    fluidity: Array | float = 0.0
    bulk_modulus: Array | float | None = None

    def spectrum(self) -> Spectrum:
        J, tau = jnp.atleast_1d(jnp.asarray(self.J, float)), jnp.atleast_1d(jnp.asarray(self.tau, float))
        order = jnp.argsort(-tau)
        return Spectrum(
            jnp.asarray(self.J0, dtype=float),
            J[order],
            1.0 / tau[order],
            jnp.asarray(self.fluidity, dtype=float),
        )


# Fractional materials: creep as a power of time, and its approximation by retardation times for the solver.
#
# A springpot of quasi-property V [Pa s^alpha] and order 0 < alpha < 1 lies between a spring and a dashpot:
#
#     J(t) = t^alpha/(V Gamma(1 + alpha)),   G(t) = V t^-alpha/Gamma(1 - alpha),   G*(omega) = V (i omega)^alpha.
#
# With springs the modulus at a Laplace variable s follows from V s^alpha as with a dashpot, and creep and relaxation from
# the Mittag-Leffler function E_alpha(-x) (``_support/exponential.py``): 1/(s (G + V s^alpha)) is the transform of
# (1 - E_alpha(-(G/V) t^alpha))/G.
#
# Its retardation times form a continuous spectrum over the whole time axis. With the rate r = exp(w), the
# Mittag-Leffler function E_alpha and x = t/tau,
#
#     t^alpha/Gamma(1 + alpha) = sin(pi alpha)/pi int r^-alpha (1 - exp(-r t)) dw,
#     1 - E_alpha(-x^alpha) = 1/(pi alpha) int_0^(pi alpha) (1 - exp(-x r)) dtheta,
#     r^alpha = sin(theta)/sin(pi alpha - theta).
#
# With the substitution theta = pi alpha/(1 + exp(-alpha w)), the rates of the second integral approach those of the
# first far from tau, and its density is a smooth peak for every alpha. With a step h in w, the error of the
# trapezoidal rule is exp(-pi^2/h), as the integrand is analytic for |Im w| < pi/2: so a sum of exponentials
# represents either law. Rates too fast for the requested times act as a spring, and those too slow as a dashpot and
# one retardation time that have the same first three derivatives at t = 0.
#
# Sources: A. Jaishankar, G. H. McKinley, Power-law rheology in the bulk and at the interface, Proc. R. Soc. A 469
# (2013) 20120284 (the laws); R. Gorenflo, F. Mainardi, Fractional Calculus, in Fractals and Fractional Calculus in
# Continuum Mechanics, 1997, sec. 3 (their spectra); L. N. Trefethen, J. A. C. Weideman, SIAM Rev. 56 (2014) 385 (the
# rule).


TAIL = 80.0  # range of the logarithm of rates summed beyond the modes kept; a closed form gives the rest
LARGEST_ORDER = 0.999  # largest alpha whose spectrum can be summed
USUAL_ORDER = 0.95  # alpha of which the range suffices for all below
# least 1 - alpha used for the series of a power law; it changes J(t) by as much per decade at most
NEAR_ONE = 1e-7


class Fractional(abc.ABC):
    """Base class of the fractional laws: J(t), G(t) and G*(omega), and their approximation by a Prony series."""

    V: Array | float
    alpha: Array | float
    nu: Array | float | None
    bulk_modulus: Array | float | None

    __post_init__ = Material.__post_init__  # a bulk modulus replaces the default nu

    @abc.abstractmethod
    def creep(self, t: Array | float) -> Array:
        """Return the shear creep compliance J(t) [1/Pa], t >= 0 [s] of any shape."""

    @abc.abstractmethod
    def relaxation(self, t: Array | float) -> Array:
        """Return the shear relaxation modulus G(t) [Pa], t >= 0 [s] of any shape."""

    @abc.abstractmethod
    def _operational_modulus(self, s: Array) -> Array:
        """Return s G(s) [Pa] at real or complex s [1/s], with the Laplace transform G(s) of G(t)."""

    def complex_modulus(self, omega: Array | float) -> Array:
        """Return the complex modulus G*(omega) = i omega G(i omega) [Pa], omega > 0 [rad/s] of any shape."""
        self._check_evaluated()
        return self._operational_modulus(1j * jnp.asarray(as_float64(omega)))

    def laplace_compliance(self, s: Array | complex) -> Array:
        """Return the Laplace transform of J(t) [s/Pa], s [1/s] real or complex, Re s > 0: J(s) = 1/(s^2 G(s))."""
        self._check_evaluated()
        s = jnp.asarray(s)
        return 1.0 / (s * self._operational_modulus(s))

    def _element(self, s: Array) -> Array:
        """Return V s^alpha [Pa]."""
        return self.V * jnp.exp(self.alpha * jnp.log(s))

    def shifted(self, factor: Array | float) -> Self:
        """Return the material with all its times multiplied by ``factor`` > 0: J(t; factor) = J(t/factor).

        The quasi-property V becomes V factor^alpha; the modulus does not change.
        """
        checks.positive("factor", factor)
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

    def _prony_table(
        self, shortest: float, longest: float, tolerance: float, long_term: float
    ) -> finite_elements.Table:
        """Return the relaxation modulus of the series between two times as a table, with its error in words."""
        found = self.prony(shortest, longest, tolerance)._prony_table(0.0)
        solid = isinstance(self, Retarded)
        return finite_elements.of_law(
            found, type(self).__name__, self.relaxation, solid, shortest, longest, tolerance, long_term
        )

    def to_abaqus(
        self, shortest: float, longest: float, name: str = "MATERIAL", *, tolerance: float = 1e-3, units: str = "m",
        density: float | None = None, long_term: float = 0.0,
    ) -> str:  # fmt: skip
        """Return the law between two times as keywords of Abaqus, by the series of ``prony``, with the error of G(t)
        in a comment.

        Args:
            shortest, longest, tolerance: as in ``prony``.
            name, units, density, long_term: as in ``jc.StandardLinearSolid.to_abaqus``.

        Raises:
            ValueError: values out of range.

        Example:
            >>> gel = jc.Springpot(V=1e3, alpha=0.2, nu=0.5)
            >>> print(gel.to_abaqus(1e-2, 1e2).splitlines()[4].split(" of the law")[0])
            ** Springpot from 0.01 to 100 s: G(t) of this table is within 0.0045
        """
        found = self._prony_table(shortest, longest, tolerance, long_term)
        return finite_elements.abaqus(found, name, units, density)

    def to_ansys(
        self, shortest: float, longest: float, number: int = 1, *, tolerance: float = 1e-3, units: str = "m",
        density: float | None = None, long_term: float = 0.0,
    ) -> str:  # fmt: skip
        """Return the law between two times as commands of ANSYS; arguments and errors as ``to_abaqus``, with the
        number of the material in place of a name."""
        found = self._prony_table(shortest, longest, tolerance, long_term)
        return finite_elements.ansys(found, number, units, density)

    def to_comsol(
        self, shortest: float, longest: float, *, tolerance: float = 1e-3, density: float | None = None,
        long_term: float = 0.0,
    ) -> str:  # fmt: skip
        """Return the law between two times as a table for COMSOL; arguments and errors as ``to_abaqus``."""
        return finite_elements.comsol(self._prony_table(shortest, longest, tolerance, long_term), density)

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
        self._check_evaluated()
        checks.between("alpha", self.alpha, 0.0, self._largest_order)

    def _check_evaluated(self, t: Array | float = 0.0) -> None:
        """Check the parameters and the times of an evaluation, where their values are known."""
        if is_concrete(self, t):
            for name in ("G", "G1", "G2", "V"):
                if hasattr(self, name):
                    checks.positive(name, getattr(self, name))
            checks.between("alpha", self.alpha, 0.0, 1.0)
            checks.since_loading("t", t)


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
        self._check_evaluated(t)
        return power(t, self.alpha) / self.V

    def relaxation(self, t: Array | float) -> Array:
        """Return G(t) = V t^-alpha/Gamma(1 - alpha) [Pa], infinite at t = 0, t >= 0 [s] of any shape."""
        self._check_evaluated(t)
        return self.V * inverse_power(t, self.alpha)

    def _operational_modulus(self, s: Array) -> Array:
        return self._element(s)


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
        self._check_evaluated(t)
        return 1.0 / self.G + power(t, self.alpha) / self.V

    def relaxation(self, t: Array | float) -> Array:
        """Return G(t) = G E_alpha(-(G/V) t^alpha) [Pa], t >= 0 [s] of any shape."""
        self._check_evaluated(t)
        return self.G * mittag_leffler(_argument(t, self.alpha, self.G / self.V), self.alpha)[0]

    def _operational_modulus(self, s: Array) -> Array:
        pot = self._element(s)
        return self.G * pot / (self.G + pot)

    @property
    def _spring(self) -> Array | float:
        return 1.0 / self.G


class Retarded(Fractional):
    """Base class of a spring and a springpot in parallel, alone or with a spring in series.

    With the spring G of the pair, 1 - E_alpha(-(G/V) t^alpha) is the retarded part of the creep times G.
    """

    @property
    @abc.abstractmethod
    def _delayed(self) -> Array | float:
        """The modulus of the spring beside the springpot [Pa]."""

    def creep(self, t: Array | float) -> Array:
        """Return J(t) [1/Pa], t >= 0 [s] of any shape."""
        self._check_evaluated(t)
        x = _argument(t, self.alpha, self._delayed / self.V)
        return self._spring + mittag_leffler(x, self.alpha)[1] / self._delayed

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
        return jnp.log(jnp.asarray(self.V, dtype=float) / self._delayed) / self.alpha

    def _density(self, w: Array) -> tuple[Array, Array]:
        angle, log_p, log_q = jnp.pi * self.alpha, -softplus(-self.alpha * w), -softplus(self.alpha * w)
        log_sine = lambda log_share: jnp.log(jnp.sin(angle * jnp.exp(log_share)))
        log_rate = (log_sine(log_p) - log_sine(log_q)) / self.alpha - self._log_tau
        return log_rate, self.alpha / self._delayed * jnp.exp(log_p + log_q)

    def _position(self, log_rate: Array) -> Array:
        y = jnp.exp(self.alpha * (log_rate + self._log_tau))
        sine, cosine = jnp.sin(jnp.pi * self.alpha), jnp.cos(jnp.pi * self.alpha)
        return jnp.log(jnp.arctan2(sine, 1.0 / y + cosine) / jnp.arctan2(sine, y + cosine)) / self.alpha

    def _above(self, w: Array, step: Array | float) -> Array:
        """Return the integral of the logistic density from half a step below w, with the first term of its error."""
        width = self.alpha * step
        q = jnp.exp(-softplus(self.alpha * w - width / 2.0))
        return (q + width**2 / 24.0 * q * (1.0 - q) * (2.0 * q - 1.0)) / self._delayed


@pytree
class FractionalKelvinVoigt(Retarded):
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

    @property
    def _delayed(self) -> Array | float:
        return self.G

    def relaxation(self, t: Array | float) -> Array:
        """Return G(t) = G + V t^-alpha/Gamma(1 - alpha) [Pa], infinite at t = 0, t >= 0 [s] of any shape."""
        self._check_evaluated(t)
        return self.G + self.V * inverse_power(t, self.alpha)

    def _operational_modulus(self, s: Array) -> Array:
        return self.G + self._element(s)


@pytree
class FractionalZener(Retarded):
    """A fractional standard linear solid, a spring in series with a spring and a springpot in parallel:

        J(t) = 1/G1 + (1 - E_alpha(-(t/tau)^alpha))/G2,     tau^alpha = V/G2.

    Its modulus relaxes from G1 to Ge = G1 G2/(G1 + G2), G(t) = Ge + (G1 - Ge) E_alpha(-(G1 + G2) t^alpha/V) (F. Mainardi,
    Fractional Calculus and Waves in Linear Viscoelasticity, 2010, sec. 3.4). For alpha = 1 it is ``StandardLinearSolid``.

    Args:
        G1: instantaneous modulus [Pa] > 0.
        G2: modulus of the delayed part [Pa] > 0.
        V: quasi-property of the springpot of the delayed part [Pa s^alpha] > 0.
        alpha: order of the springpot, 0 < alpha < 1.
        nu: Poisson's ratio, -1 < nu <= 0.5.
        bulk_modulus: K [Pa] > 0 of an elastic volume response, in place of nu.

    Example:
        >>> tissue = jc.FractionalZener(G1=3e3, G2=1.5e3, V=2e3, alpha=0.4, nu=0.5)
        >>> f"{float(tissue.relaxation(0.0)):.0f} Pa, {float(tissue.relaxation(10.0)):.0f} Pa"
        '3000 Pa, 1223 Pa'
    """

    G1: Array | float
    G2: Array | float
    V: Array | float
    alpha: Array | float
    nu: Array | float | None = NU
    bulk_modulus: Array | float | None = None

    @property
    def _delayed(self) -> Array | float:
        return self.G2

    @property
    def _spring(self) -> Array | float:
        return 1.0 / self.G1

    def relaxation(self, t: Array | float) -> Array:
        """Return G(t) [Pa], t >= 0 [s] of any shape."""
        self._check_evaluated(t)
        whole = self.G1 + self.G2
        x = _argument(t, self.alpha, whole / self.V)
        return self.G1 / whole * (self.G2 + self.G1 * mittag_leffler(x, self.alpha)[0])

    def _operational_modulus(self, s: Array) -> Array:
        below = self.G2 + self._element(s)
        return self.G1 * below / (self.G1 + below)


def _argument(t: Array | float, alpha: Array | float, factor: Array | float) -> Array:
    """Return factor t^alpha, t >= 0 of any shape; its derivatives are finite at t = 0 as well."""
    t, alpha = as_float64(t), as_float64(alpha)
    positive = t > 0.0
    return jnp.where(positive, factor * jnp.exp(alpha * jnp.log(jnp.where(positive, t, 1.0))), 0.0)


def inverse_power(t: Array | float, alpha: Array | float) -> Array:
    """Return t^-alpha/Gamma(1 - alpha), t >= 0 of any shape; infinite at t = 0."""
    t, alpha = as_float64(t), as_float64(alpha)
    positive = t > 0.0
    return jnp.where(
        positive, jnp.exp(-alpha * jnp.log(jnp.where(positive, t, 1.0)) - gammaln(1.0 - alpha)), jnp.inf
    )


def power(t: Array | float, alpha: Array | float) -> Array:
    """Return t^alpha/Gamma(1 + alpha), t >= 0 of any shape; its derivatives are finite at t = 0 as well."""
    return _argument(t, alpha, jnp.exp(-gammaln(1.0 + as_float64(alpha))))
