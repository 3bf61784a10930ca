"""Isotropic linear materials in shear, elastic and viscoelastic.

One compliance is used throughout: the shear creep compliance

    J(t) = gamma(t) / tau0   [1/Pa],

the shear strain per unit of a shear stress that steps on at t = 0; J = 1/G for an elastic solid.
The paper writes phi(t) for 1/(2G) in its Eq. (14), so its film has J = 2 phi (its own Table 3 and
Fig. 10a come out only with that).

Every material is a special case of one spectrum (``Prony``),

    J(t) = J0 + sum_i J_i (1 - exp(-t/tau_i)) + fluidity t,

with Laplace transform s J(s) = h(s)/s, where

    h(s) = s J0 + fluidity + sum_i (J_i/tau_i) s/(s + 1/tau_i).

The relaxation modulus has the transform G(s) = 1/h(s), so that with the roots -rho_k of h

    G(t) = sum_k exp(-rho_k t) / h'(-rho_k),      all rho_k real and >= 0, all terms positive

(W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials,
1976, ch. 5, for the models; the root form follows from J(s) G(s) = 1/s^2).
"""

import abc
from typing import ClassVar, Self

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._exponential import mean_decay
from jaxcontact._pytree import pytree, replace


@pytree
class Spectrum:
    """The canonical form of a material: what the response functions and the march need.

    instantaneous: J0 [1/Pa], (); amplitudes: J_i [1/Pa], (n,); rates: 1/tau_i [1/s], (n,);
    fluidity [1/(Pa s)], (), or None for a material that cannot flow (known from its class).
    """

    instantaneous: Array
    amplitudes: Array
    rates: Array
    fluidity: Array | None = None

    def creep(self, t: Array | float) -> Array:
        """J(t) [1/Pa] for t of any shape."""
        t = jnp.asarray(t, dtype=float)
        delayed = -jnp.expm1(-t[..., None] * self.rates) @ self.amplitudes
        flow = 0.0 if self.fluidity is None else self.fluidity * t
        return self.instantaneous + delayed + flow

    def transform(self, s: Array | complex) -> Array:
        """h(s) = s^2 J(s) [1/(Pa s)], real or complex s."""
        s = jnp.asarray(s)
        terms = jnp.sum(self.amplitudes * self.rates * s[..., None] / (s[..., None] + self.rates), -1)
        flow = 0.0 if self.fluidity is None else self.fluidity
        return s * self.instantaneous + flow + terms

    def mean_creep(self, start: Array, end: Array) -> Array:
        """Mean of J(t) [1/Pa] over start <= t <= end, times of any shape."""
        decay = mean_decay(self.rates, start[..., None], end[..., None])
        flow = 0.0 if self.fluidity is None else self.fluidity * (start + end) / 2.0
        return self.instantaneous + jnp.sum(self.amplitudes * (1.0 - decay), -1) + flow


def relaxation_modes(spectrum: Spectrum, extra: Array | float = 0.0) -> tuple[Array, Array]:
    """Rates rho_k [1/s] of relaxation, ascending, and weights w_k [Pa]: G(t) = G(inf) + sum w_k exp(-rho_k t).

    ``extra`` [1/Pa], any shape, is a compliance added to J0: that of a spring in series with the
    material. Both have shape ``extra.shape + (m,)`` with m = n + 1 where the material can flow, n where it
    cannot. The rates of the spectrum ascend; J0 + extra > 0.

    With s_0 = 0 before the rho_k of a material that cannot flow, the roots interlace with the rates,
    s_0 <= r_1 <= s_1 <= ... <= s_n, and

        w_k = 1/(J0 + extra) prod_{i <= k} (s_k - r_i)/(s_k - s_{i-1}) prod_{i > k} (r_i - s_k)/(s_i - s_k),

    with factors between 0 and 1: a branch that is empty, or has the time of another, has weight zero.
    """
    extra = jnp.asarray(extra, dtype=float)
    total = (spectrum.instantaneous + extra)[..., None]
    rho = _roots(spectrum, total)
    still = jnp.zeros((*rho.shape[:-1], 1))
    roots = rho if spectrum.fluidity is not None else jnp.concatenate([still, rho], -1)
    n = spectrum.rates.shape[0]
    weight = jnp.ones_like(roots)
    for i in range(n):
        others = jnp.where(jnp.arange(n + 1) > i, roots[..., i : i + 1], roots[..., i + 1 : i + 2])
        gap = others - roots
        factor = (spectrum.rates[i] - roots) / jnp.where(gap == 0.0, 1.0, gap)
        weight = weight * jnp.where(gap == 0.0, 0.0, factor)
    return rho, (weight if spectrum.fluidity is not None else weight[..., 1:]) / total


def _roots(spectrum: Spectrum, total: Array) -> Array:
    """The rho_k, as eigenvalues of diag(1/tau) + v v^T/total; Newton steps carry the derivatives."""
    rates, weights = spectrum.rates, spectrum.amplitudes * spectrum.rates
    if spectrum.fluidity is not None:
        rates = jnp.append(jnp.zeros_like(spectrum.fluidity), rates)
        weights = jnp.append(spectrum.fluidity, weights)
    if rates.shape[0] == 0:
        return jnp.zeros((*total.shape[:-1], 0))
    v = jnp.sqrt(jax.lax.stop_gradient(weights))
    matrix = jnp.diag(jax.lax.stop_gradient(rates)) + v[:, None] * v / jax.lax.stop_gradient(total)[..., None]
    rho = jnp.maximum(jax.lax.stop_gradient(jnp.linalg.eigvalsh(matrix)), 0.0)
    for _ in range(2):
        value, slope = jax.jvp(
            lambda r: _characteristic(rates, weights, total, r), (rho,), (jnp.ones_like(rho),)
        )
        rho = rho - value / jnp.where(slope == 0.0, jnp.inf, slope)
    return rho


def _characteristic(rates: Array, weights: Array, total: Array, rho: Array) -> Array:
    """(total + sum_i weights_i/(r_i - rho)) prod_i (r_i - rho), in parts of each r_i + rho, of rho (..., m).

    Multiplied out: nothing is divided by r_i - rho, which is zero for an empty branch.
    """
    size = jax.lax.stop_gradient(rates + rho[..., None])
    size = jnp.where(size == 0.0, 1.0, size)
    factors = (rates - rho[..., None]) / size
    value = total * jnp.prod(factors, -1)
    for i in range(rates.shape[0]):
        value = value + weights[i] / size[..., i] * jnp.prod(jnp.delete(factors, i, axis=-1), -1)
    return value


class Material(abc.ABC):
    """Constant Poisson's ratio nu; creep in shear given by ``spectrum``.

    Parameters are numbers above zero, but for those of ``may_be_zero`` and the lists, all of one length.
    """

    nu: Array | float
    may_be_zero: ClassVar[tuple[str, ...]] = ()
    lists: ClassVar[tuple[str, ...]] = ()

    @abc.abstractmethod
    def spectrum(self) -> Spectrum:
        """The material's canonical form."""

    def creep(self, t: Array | float) -> Array:
        """Shear creep compliance J(t) [1/Pa], t >= 0 [s] of any shape."""
        return self.spectrum().creep(t)

    def scaled(self, factor: Array | float) -> Self:
        """The material ``factor`` times as stiff and as viscous, with the same times and Poisson's ratio."""
        less, kept = ("J0", "J", "fluidity"), ("nu", "tau")
        change = {
            name: value / factor if name in less else value * factor
            for name, value in vars(self).items()
            if name not in kept
        }
        return replace(self, **change)

    def relaxation(self, t: Array | float) -> Array:
        """Shear relaxation modulus G(t) [Pa], t >= 0 [s] of any shape."""
        spectrum = self.spectrum()
        rho, weights = relaxation_modes(spectrum)
        decay = jnp.exp(-jnp.asarray(t, dtype=float)[..., None] * rho)
        return self._elastic_part(spectrum) + decay @ weights

    def complex_modulus(self, omega: Array | float) -> Array:
        """G*(omega) = i omega G(i omega) [Pa], omega [rad/s] of any shape; omega > 0 for a fluid."""
        s = 1j * jnp.asarray(omega, dtype=float)
        spectrum = self.spectrum()
        if spectrum.fluidity is not None:
            return s / spectrum.transform(s)
        parts = spectrum.amplitudes * (spectrum.rates / (s[..., None] + spectrum.rates))
        return 1.0 / (spectrum.instantaneous + jnp.sum(parts, -1))

    def laplace_compliance(self, s: Array | complex) -> Array:
        """Laplace transform of J(t): J(s) = h(s)/s^2 [s/Pa], s [1/s] real or complex, Re s > 0."""
        return self.spectrum().transform(s) / jnp.asarray(s) ** 2

    @staticmethod
    def _elastic_part(spectrum: Spectrum) -> Array | float:
        """G at infinite time of a material that cannot flow: the root rho = 0 of h, left out above."""
        if spectrum.fluidity is not None:
            return 0.0
        return 1.0 / (spectrum.instantaneous + jnp.sum(spectrum.amplitudes))


@pytree
class Elastic(Material):
    """J = 1/G.

    Args:
        G: shear modulus [Pa] > 0.
        nu: Poisson's ratio, -1 < nu <= 0.5.

    Example:
        >>> steel = jc.Elastic.from_young(210e9, nu=0.3)
        >>> f"{steel.G / 1e9:.2f} GPa"
        '80.77 GPa'
    """

    G: Array | float
    nu: Array | float = 0.3

    @classmethod
    def from_young(cls, E: Array | float, nu: Array | float = 0.3) -> "Elastic":
        """From Young's modulus E [Pa]: G = E/(2(1 + nu))."""
        return cls(G=E / (2.0 * (1.0 + nu)), nu=nu)

    def spectrum(self) -> Spectrum:
        return Spectrum(1.0 / jnp.asarray(self.G, dtype=float), jnp.zeros(0), jnp.zeros(0))


@pytree
class Maxwell(Material):
    """J(t) = 1/G + t/eta.

    Source: the paper, Eq. (11).

    Args:
        G: shear modulus [Pa] > 0.
        eta: viscosity [Pa s] > 0.
        nu: Poisson's ratio, -1 < nu <= 0.5.

    Example:
        >>> pitch = jc.Maxwell(G=1e9, eta=1e11)
        >>> f"{pitch.relaxation(100.0) / 1e9:.3f} GPa"           # G exp(-G t/eta)
        '0.368 GPa'
    """

    G: Array | float
    eta: Array | float
    nu: Array | float = 0.3

    def spectrum(self) -> Spectrum:
        return Spectrum(
            1.0 / jnp.asarray(self.G, dtype=float), jnp.zeros(0), jnp.zeros(0),
            1.0 / jnp.asarray(self.eta, dtype=float),
        )  # fmt: skip


@pytree
class KelvinVoigt(Material):
    """J(t) = (1 - exp(-G t/eta))/G.

    It is rigid at first: ``relaxation`` is G for t > 0 and leaves out the pulse eta delta(t).

    Args:
        G: shear modulus [Pa] > 0.
        eta: viscosity [Pa s] > 0.
        nu: Poisson's ratio, -1 < nu <= 0.5.

    Example:
        >>> gel = jc.KelvinVoigt(G=1e3, eta=2e3, nu=0.5)
        >>> f"{gel.creep(2.0) * 1e3:.3f} 1/kPa"
        '0.632 1/kPa'
    """

    G: Array | float
    eta: Array | float
    nu: Array | float = 0.3

    def spectrum(self) -> Spectrum:
        G, eta = jnp.asarray(self.G, dtype=float), jnp.asarray(self.eta, dtype=float)
        return Spectrum(jnp.zeros_like(G), jnp.stack([1.0 / G]), jnp.stack([G / eta]))

    def relaxation(self, t: Array | float) -> Array:
        """G(t) = G for t > 0 [Pa]; the pulse eta delta(t) is left out."""
        return jnp.asarray(self.G, dtype=float) + jnp.zeros_like(jnp.asarray(t, dtype=float))


@pytree
class StandardLinearSolid(Material):
    """J(t) = 1/G1 + (1 - exp(-G2 t/eta2))/G2.

    Args:
        G1: modulus at first [Pa] > 0.
        G2: modulus of the delayed part [Pa] > 0.
        eta2: viscosity of the delayed part [Pa s] > 0.
        nu: Poisson's ratio, -1 < nu <= 0.5.

    Example:
        >>> rubber = jc.StandardLinearSolid(G1=2e6, G2=2e6, eta2=1e6, nu=0.5)
        >>> f"{rubber.relaxation(1e3) / 1e6:.2f} MPa"             # G1 G2/(G1 + G2) in the end
        '1.00 MPa'
    """

    G1: Array | float
    G2: Array | float
    eta2: Array | float
    nu: Array | float = 0.3

    def spectrum(self) -> Spectrum:
        G2, eta2 = jnp.asarray(self.G2, dtype=float), jnp.asarray(self.eta2, dtype=float)
        return Spectrum(
            1.0 / jnp.asarray(self.G1, dtype=float), jnp.stack([1.0 / G2]), jnp.stack([G2 / eta2])
        )


@pytree
class Burgers(Material):
    """J(t) = 1/G1 + (1 - exp(-G2 t/eta2))/G2 + t/eta1.

    Source: the paper, Eq. (13); its Eq. (14) gives phi = J/2 of the tribofilm below.

    Args:
        G1: modulus at first [Pa] > 0.
        G2: modulus of the delayed part [Pa] > 0.
        eta1: viscosity of the unlimited flow [Pa s] > 0.
        eta2: viscosity of the delayed part [Pa s] > 0.
        nu: Poisson's ratio, -1 < nu <= 0.5.

    Example:
        >>> film = jc.Burgers(G1=0.75e9, G2=13.89e6, eta1=3.1486e12, eta2=120.9e9, nu=0.3)
        >>> f"{film.creep(7200.0) / film.creep(0.0):.1f} times"
        '33.1 times'
    """

    G1: Array | float
    G2: Array | float
    eta1: Array | float
    eta2: Array | float
    nu: Array | float = 0.3

    def spectrum(self) -> Spectrum:
        G2, eta2 = jnp.asarray(self.G2, dtype=float), jnp.asarray(self.eta2, dtype=float)
        return Spectrum(
            1.0 / jnp.asarray(self.G1, dtype=float), jnp.stack([1.0 / G2]), jnp.stack([G2 / eta2]),
            1.0 / jnp.asarray(self.eta1, dtype=float),
        )  # fmt: skip


@pytree
class Prony(Material):
    """J(t) = J0 + sum_i J_i (1 - exp(-t/tau_i)) + fluidity t.

    Args:
        J0: compliance at first [1/Pa] >= 0.
        J: delayed compliances [1/Pa] >= 0, (n,).
        tau: their retardation times [s] > 0, (n,); some may be equal.
        nu: Poisson's ratio, -1 < nu <= 0.5.
        fluidity: rate of the unlimited flow [1/(Pa s)] >= 0.

    Example:
        >>> polymer = jc.Prony(J0=1e-9, J=np.array([2e-9, 5e-9]), tau=np.array([1.0, 100.0]))
        >>> f"{polymer.relaxation(1e6) / 1e6:.0f} MPa"            # 1/(J0 + sum J) in the end
        '125 MPa'
    """

    may_be_zero = ("J0", "J", "fluidity")
    lists = ("J", "tau")

    J0: Array | float
    J: Array
    tau: Array
    nu: Array | float = 0.3
    fluidity: Array | float = 0.0

    def spectrum(self) -> Spectrum:
        J, tau = jnp.atleast_1d(jnp.asarray(self.J, float)), jnp.atleast_1d(jnp.asarray(self.tau, float))
        order = jnp.argsort(-tau)
        return Spectrum(
            jnp.asarray(self.J0, dtype=float),
            J[order],
            1.0 / tau[order],
            jnp.asarray(self.fluidity, dtype=float),
        )
