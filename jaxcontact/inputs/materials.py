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
from typing import Any, ClassVar, Self

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import as_float64, pytree, replace
from jaxcontact.inputs.spectrum import Spectrum, relaxation_modes

NU = float("0.3")  # the default, distinguished by its identity from a value of 0.3 passed by the user


class Material(abc.ABC):
    """Base class of materials: shear creep given by ``spectrum``, with a constant Poisson's ratio nu or a bulk modulus.

    Parameters are positive numbers, except those in ``may_be_zero`` and the ``lists``, which have a common length.
    """

    nu: Array | float | None
    bulk_modulus: Array | float | None
    may_be_zero: ClassVar[tuple[str, ...]] = ()
    lists: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        """Let a bulk modulus replace a nu that was not given."""
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

    def creep(self, t: Array | float) -> Array:
        """Return the shear creep compliance J(t) [1/Pa], t >= 0 [s] of any shape."""
        return self.spectrum().creep(t)

    def scaled(self, factor: Array | float) -> Self:
        """Return the material with all moduli and viscosities multiplied by ``factor``, with the same times and Poisson's
        ratio.

        The bulk modulus of an elastic volume response is multiplied as well.
        """
        compliances, unchanged = ("J0", "J", "fluidity"), ("nu", "tau")
        change = {
            name: _number(value) / factor if name in compliances else _number(value) * factor
            for name, value in vars(self).items()
            if name not in unchanged and value is not None
        }
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
        change = {}
        for name, value in vars(self).items():
            if name == "tau" or name.startswith("eta"):
                change[name] = jnp.asarray(value, float) * factor
            elif name == "fluidity":
                change[name] = jnp.asarray(value, float) / factor
        return replace(self, **change)

    def relaxation(self, t: Array | float) -> Array:
        """Return the shear relaxation modulus G(t) [Pa], t >= 0 [s] of any shape."""
        spectrum = self.spectrum()
        rho, weights = relaxation_modes(spectrum)
        decay = jnp.exp(-jnp.asarray(as_float64(t))[..., None] * rho)
        return self._elastic_part(spectrum) + decay @ weights

    def complex_modulus(self, omega: Array | float) -> Array:
        """Return the complex modulus G*(omega) = i omega G(i omega) [Pa], omega [rad/s] of any shape; omega > 0 for a
        fluid.
        """
        s = 1j * jnp.asarray(as_float64(omega))
        spectrum = self.spectrum()
        if spectrum.fluidity is not None:
            return s / spectrum.transform(s)
        parts = spectrum.amplitudes * (spectrum.rates / (s[..., None] + spectrum.rates))
        return 1.0 / (spectrum.instantaneous + jnp.sum(parts, -1))

    def laplace_compliance(self, s: Array | complex) -> Array:
        """Return the Laplace transform of J(t): J(s) = h(s)/s^2 [s/Pa], s [1/s] real or complex, Re s > 0."""
        return self.spectrum().transform(s) / jnp.asarray(s) ** 2

    @staticmethod
    def _elastic_part(spectrum: Spectrum) -> Array | float:
        """Return the relaxed modulus G(inf) of a solid: the contribution of the root rho = 0 of h, not in the modes; 0
        for a fluid.
        """
        if spectrum.fluidity is not None:
            return 0.0
        return 1.0 / (spectrum.instantaneous + jnp.sum(spectrum.amplitudes))


def _number(value: Any) -> Any:
    """Return a list of numbers as an array; anything else as it is."""
    return jnp.asarray(value, float) if isinstance(value, list | tuple) else value


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
        return cls(G=E / (2.0 * (1.0 + nu)), nu=nu)

    def spectrum(self) -> Spectrum:
        return Spectrum(1.0 / jnp.asarray(self.G, dtype=float), jnp.zeros(0), jnp.zeros(0))


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
