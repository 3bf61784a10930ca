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

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._exponential import mean_decay
from jaxcontact._pytree import pytree


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
    """Constant Poisson's ratio nu; creep in shear given by ``spectrum``."""

    nu: Array | float

    @abc.abstractmethod
    def spectrum(self) -> Spectrum:
        """The material's canonical form."""

    def creep(self, t: Array | float) -> Array:
        """Shear creep compliance J(t) [1/Pa], t >= 0 [s] of any shape."""
        return self.spectrum().creep(t)

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
    """J = 1/G.  G: shear modulus [Pa]; nu: Poisson's ratio."""

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
    """J(t) = 1/G + t/eta  (paper Eq. 11).  G [Pa], eta [Pa s]."""

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
    """J(t) = (1 - exp(-G t/eta))/G.  G [Pa], eta [Pa s].

    It is rigid at first: ``relaxation`` is G for t > 0 and leaves out the pulse eta delta(t).
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
    """J(t) = 1/G1 + (1 - exp(-G2 t/eta2))/G2.  G1, G2 [Pa], eta2 [Pa s]."""

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
    """J(t) = 1/G1 + (1 - exp(-G2 t/eta2))/G2 + t/eta1  (paper Eq. 13).  G1, G2 [Pa], eta1, eta2 [Pa s]."""

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

    J0 [1/Pa]; J [1/Pa] and tau [s] of shape (n,); fluidity [1/(Pa s)]. Times may be equal, and J_i zero.
    """

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
