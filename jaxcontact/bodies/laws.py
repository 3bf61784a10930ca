"""Laws of film growth and wear: the rate of change of the thickness from pressure, thickness and temperature.

A law is a frozen pytree with a method ``rate(step)`` that returns dh/dt [m/s], (nx, ny), where ``step`` is a
``RubbingState``. The laws of this module can be added, to each other and to any such object:

    @jax.tree_util.register_dataclass
    @dataclasses.dataclass(frozen=True)
    class Oxidation:
        speed: float                                   # [m/s]

        def rate(self, step):
            return self.speed * jnp.exp(-step.thickness / 1e-9)

    law = Oxidation(1e-12) + jc.Archard(1e-18)

The thickness of a film that wears does not become negative.
"""

from __future__ import annotations

import abc
import functools
import inspect
from typing import TYPE_CHECKING, Any, TypeVar

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import Base, is_concrete, pytree, static
from jaxcontact.bodies.grid import Grid

BOLTZMANN = 1.380649e-23  # J/K, exact
MOST_ENERGY, MOST_VOLUME = 1e-17, 1e-24  # J and m3 of one molecule; 62 eV and 1000 nm3
PER_MOLECULE = "in J per molecule: 1 eV is 1.602e-19 J, 1 kJ/mol is 1.661e-21 J"
IN_CUBIC_METRES = "in m3 per molecule: 1 nm3 is 1e-27 m3"
T = TypeVar("T")


@pytree
class RubbingState:
    """The state of the contact at one time, the argument of a law, in SI units.

    pressure [Pa], gap [m], thickness [m] of the film (with ``wears="indenter"``: what has formed on the indenter, negative
    where it is worn), friction_stress [Pa] = friction x pressure, plus ``shear_strength`` where the surfaces touch:
    (nx, ny); speed [m/s], (); temperature [K], (nx, ny), None unless the rubbing has ``thermal=``; time [s], ().
    """

    pressure: Array
    gap: Array
    thickness: Array
    friction_stress: Array
    speed: Array
    temperature: Array | None
    time: Array


class KineticLaw(Base):
    """Base class of the laws, which can be added."""

    def rate(self, step: RubbingState) -> Array:
        """Return the rate of change of the thickness, dh/dt [m/s], (nx, ny)."""
        raise NotImplementedError

    def check(self) -> Verdict:
        """Return whether the parameters are in range; ValueError where known values are not."""
        return True

    def __add__(self, other: Any) -> SumOfLaws:
        return SumOfLaws(_terms(self) + _terms(other))

    def __radd__(self, other: Any) -> SumOfLaws:
        return SumOfLaws(_terms(other) + _terms(self))


@pytree
class SumOfLaws(KineticLaw):
    """Several laws at once; made by adding them."""

    terms: tuple[Any, ...]

    def rate(self, step: RubbingState) -> Array:
        return sum((term.rate(step) for term in self.terms), start=jnp.zeros_like(step.pressure))

    def check(self) -> Verdict:
        valid: Verdict = True
        for term in self.terms:
            valid = valid & check_law(term, heated=True)
        return valid


def _terms(law: Any) -> tuple[Any, ...]:
    return law.terms if isinstance(law, SumOfLaws) else (law,)


def _with_rate(cls: type[T]) -> type[T]:
    """Let the constructor of a law take the field ``rate_constant`` as ``rate``.

    The field cannot have that name, since it is the name of the method that every law has.
    """
    construct, field = cls.__init__, "rate_constant"

    @functools.wraps(construct)
    def constructor(self: T, *args: Any, **given: Any) -> None:
        if "rate" in given:
            given = {field if name == "rate" else name: value for name, value in given.items()}
        construct(self, *args, **given)

    signature = inspect.signature(construct)
    renamed = [p.replace(name="rate") if p.name == field else p for p in signature.parameters.values()]
    constructor.__signature__ = signature.replace(parameters=renamed)  # type: ignore[attr-defined]
    cls.__init__ = constructor  # type: ignore[method-assign, assignment]
    return cls


@_with_rate
@pytree
class StressActivated(KineticLaw):
    """Growth activated by stress and temperature where there is contact.

        dh/dt = rate exp(-(activation_energy - activation_volume stress)/(k T))

    Source: N. N. Gosvami et al., Science 348 (2015) 102; J. Zhang, H. Spikes, Tribol. Lett. 63 (2016) 24 (shear stress).

    Args:
        rate: rate constant [m/s] > 0; the field is ``rate_constant``, since ``rate`` is a method.
        activation_energy: of one molecule [J] >= 0, at most 1e-17 (62 eV).
        activation_volume: of one molecule [m3], at most 1e-24 (1000 nm3).
        temperature: T [K] > 0, with a note below 200 K; None: that of the contact, with ``thermal=``.
        stress: "pressure", or "shear" for friction x pressure; static.

    Example:
        >>> law = jc.StressActivated(
        ...     rate=1e-2, activation_energy=1.2e-19, activation_volume=4e-30, temperature=373.0, stress="shear"
        ... ) + jc.Archard(coefficient=1e-20)
    """

    rate_constant: Array | float
    activation_energy: Array | float
    activation_volume: Array | float
    temperature: Array | float | None
    stress: str = static(default="pressure")

    if TYPE_CHECKING:

        def __init__(
            self,
            rate: Array | float,
            activation_energy: Array | float,
            activation_volume: Array | float,
            temperature: Array | float | None,
            stress: str = "pressure",
        ) -> None: ...

    def rate(self, step: RubbingState) -> Array:
        stress = step.pressure if self.stress == "pressure" else step.friction_stress
        temperature = step.temperature if self.temperature is None else self.temperature
        assert temperature is not None  # ``check_law``
        energy = self.activation_energy - self.activation_volume * stress
        grown = self.rate_constant * jnp.exp(-energy / (BOLTZMANN * temperature))
        return jnp.where(step.pressure > 0.0, grown, 0.0)

    def check(self) -> Verdict:
        checks.one_of("StressActivated stress", self.stress, "pressure", "shear")
        valid = checks.positive("StressActivated rate [m/s]", self.rate_constant)
        valid = valid & check_activation("StressActivated", self.activation_energy)
        volume = "StressActivated activation_volume [m3]"
        valid = valid & checks.finite(volume, self.activation_volume)
        valid = valid & checks.at_most(volume, self.activation_volume, MOST_VOLUME, IN_CUBIC_METRES)
        if self.temperature is None:
            return valid
        return valid & checks.positive("StressActivated temperature [K]", self.temperature)


@_with_rate
@pytree
class ProportionalRemoval(KineticLaw):
    """Removal in proportion to the thickness where there is contact: dh/dt = -rate h, h > 0.

    Where an indenter is worn below its first surface (h < 0) there is no film to remove.

    Args:
        rate: rate constant [1/s] >= 0; the field is ``rate_constant``, since ``rate`` is a method.

    Example:
        >>> law = jc.ProportionalRemoval(rate=1e-3)
    """

    rate_constant: Array | float

    if TYPE_CHECKING:

        def __init__(self, rate: Array | float) -> None: ...

    def rate(self, step: RubbingState) -> Array:
        film = (step.pressure > 0.0) & (step.thickness >= 0.0)
        return jnp.where(film, -self.rate_constant * step.thickness, 0.0)

    def check(self) -> Verdict:
        return checks.non_negative("ProportionalRemoval rate [1/s]", self.rate_constant)


@pytree
class Archard(KineticLaw):
    """Wear in proportion to pressure and path: dh/dt = -coefficient pressure |velocity|.

    The volume worn is coefficient x load x path. Removal in proportion to the work of friction is this law with the volume
    per work times the coefficient of friction, if that is one number. Source: J. F. Archard, J. Appl. Phys. 24 (1953) 981.

    Args:
        coefficient: wear volume per load and path [1/Pa] >= 0.

    Example:
        >>> law = jc.Archard(1e-16)
    """

    coefficient: Array | float

    def rate(self, step: RubbingState) -> Array:
        return -self.coefficient * step.pressure * step.speed

    def check(self) -> Verdict:
        return checks.non_negative("Archard coefficient [1/Pa]", self.coefficient)


def check_activation(owner: str, energy: Any) -> Verdict:
    """Return whether an activation energy is that of a molecule [J]; ValueError where a known one is not."""
    name = f"{owner} activation_energy [J]"
    return checks.non_negative(name, energy) & checks.at_most(name, energy, MOST_ENERGY, PER_MOLECULE)


def temperatures_of(law: Any) -> list[Any]:
    """Return the temperatures that a law gives [K]."""
    given = [term.temperature for term in _terms(law) if isinstance(term, StressActivated)]
    return [temperature for temperature in given if temperature is not None]


def is_sheared(law: Any) -> bool:
    """Return whether a law contains growth that is driven by the shear stress of friction."""
    return any(isinstance(term, StressActivated) and term.stress == "shear" for term in _terms(law))


def check_hardness(hardness: Any, shape: tuple[int, ...]) -> Verdict:
    """Check a hardness: pressures above zero, a number or of shape ``shape``; raise ValueError otherwise."""
    checks.number_or_field("hardness [Pa]", hardness, shape)
    return checks.positive("hardness [Pa]", hardness)


def check_law(law: Any, *, heated: bool) -> Verdict:
    """Return whether a law's parameters are in range; ValueError for what is no law, or needs a temperature without heat."""
    rate = getattr(law, "rate", None)
    checks.require(
        callable(rate), f"law: expected an object with a method rate(step), got {type(law).__name__}"
    )
    for term in _terms(law):
        known = heated or not isinstance(term, StressActivated) or term.temperature is not None
        checks.require(known, "law: expected a temperature, or thermal=, for StressActivated, got None")
    return law.check() if isinstance(law, KineticLaw) else True


# Laws of adhesion: the attraction between two surfaces as a function of the gap between them.
#
# Two surfaces at a gap g >= 0 attract each other with a traction s(g) >= 0, whose work of separation is
#
#     w = int_0^infinity s(g) dg.
#
# Where they touch, contact carries a pressure p_c >= 0 as well, and the pressure on the body is the sum p = p_c -
# s(g), which is negative where attraction prevails. The range z = w/s(0) of the attraction relative to the
# deformation that it causes decides between the limits of a paraboloid of radius R: of short range (K. L. Johnson, K.
# Kendall, A. D. Roberts, Proc. R. Soc. Lond. A 324 (1971) 301), with a pull-off force of 1.5 pi w R, and of long
# range (B. V. Derjaguin, V. M. Muller, Y. P. Toporov, J. Colloid Interface Sci. 53 (1975) 314), with 2 pi w R.
# Between them lies the Tabor number (R w^2/(E*^2 z^3))^(1/3) (D. Tabor, J. Colloid Interface Sci. 58 (1977) 2).


# half-width of the ramp at the end of Dugdale's attraction, over (compliance of a cell) x (strength)
RAMP = 1.2


# gaps at which a law of one's own is checked, and relative differences allowed
OWN_GAPS, OWN_ROUNDING = 13, 1e-6


class Adhesion(Base, abc.ABC):
    """The interface of a law of adhesion: attraction and energy as functions of the gap, cell by cell.

    A law of one's own is a subclass with a field or property ``work`` and these two methods, from which the rest follows.
    The attraction is continuous, does not increase with the gap, and vanishes at large gaps.
    """

    work: Array | float

    @abc.abstractmethod
    def traction(self, gap: Array) -> Array:
        """Return the attraction s(g) >= 0 [Pa] at gaps g >= 0 [m]."""

    @abc.abstractmethod
    def energy(self, gap: Array) -> Array:
        """Return the work of separation from a gap g to infinity, int_g^infinity s dg [J/m^2]."""

    @property
    def largest_traction(self) -> Array:
        """The attraction at a gap of zero [Pa], ()."""
        return self.traction(jnp.zeros(()))

    def stiffness(self, gap: Array) -> Array:
        """Return -ds/dg >= 0 [Pa/m]."""
        gap = jnp.asarray(gap, float)
        return -jax.jvp(self.traction, (gap,), (jnp.ones_like(gap),))[1]

    def scaled(self, length: Array, compliance: Array) -> ScaledAdhesion:
        """Return the law in units of a length [m] and of the inverse of a compliance [1/Pa]."""
        return ScaledAdhesion(self, length, compliance)

    def resolved(self, cell_compliance: Array) -> Adhesion:
        """Return the law that cells of a compliance (displacement over pressure) can resolve."""
        return self

    @property
    def characteristic_range(self) -> Array:
        """The characteristic range of the attraction, w/s(0) [m]."""
        return jnp.asarray(self.work) / self.largest_traction

    def tabor_number(self, radius: Any, modulus: Any) -> Array:
        """Return (R w^2/(E*^2 z^3))^(1/3), z = w/s(0), for a ball of radius R [m] and a contact modulus E* [Pa]."""
        spread = jnp.asarray(radius) * jnp.asarray(self.work) ** 2 / jnp.asarray(modulus) ** 2
        return jnp.cbrt(spread) / self.characteristic_range

    def zone_length(self, modulus: Any) -> Array:
        """Return the length pi E* w/(4 s(0)^2) [m] of the zone at a crack's edge in which the surfaces still attract."""
        return jnp.pi * jnp.asarray(modulus) * jnp.asarray(self.work) / (4.0 * self.largest_traction**2)


@pytree
class ExponentialAdhesion(Adhesion):
    """Attraction that decays exponentially with the gap, s = (work/range) exp(-g/range).

    Args:
        work: work of adhesion [J/m^2] > 0.
        range: decay length of the attraction [m] > 0.

    Example:
        >>> law = jc.ExponentialAdhesion(work=50e-3, range=2e-9)
        >>> f"{law.traction(0.0) / 1e6:.0f} MPa in contact, {law.traction(2e-9) / 1e6:.1f} MPa at a gap of 2 nm"
        '25 MPa in contact, 9.2 MPa at a gap of 2 nm'
    """

    work: Array | float
    range: Array | float

    @property
    def largest_traction(self) -> Array:
        return jnp.asarray(self.work) / self.range

    def traction(self, gap: Array) -> Array:
        return self.largest_traction * jnp.exp(-gap / self.range)

    def energy(self, gap: Array) -> Array:
        return self.work * jnp.exp(-gap / self.range)

    def stiffness(self, gap: Array) -> Array:
        return self.largest_traction / self.range * jnp.exp(-gap / self.range)


@pytree
class DugdaleAdhesion(Adhesion):
    """Uniform attraction up to a gap: s = strength for g < work/strength, zero beyond (D. Maugis, J. Colloid
    Interface Sci. 150 (1992) 243).

    The solver replaces the jump to zero by a linear ramp of the same work, as steep as the cells of the grid can follow:
    its half-width is 1.2 times the displacement of a cell under the strength.

    Args:
        work: work of adhesion [J/m^2] > 0.
        strength: attraction within its range [Pa] > 0.

    Example:
        >>> law = jc.DugdaleAdhesion(work=50e-3, strength=20e6)
        >>> f"{law.traction(2.4e-9):.0f} Pa, {law.traction(2.6e-9):.0f} Pa"
        '20000000 Pa, 0 Pa'
    """

    work: Array | float
    strength: Array | float

    @property
    def largest_traction(self) -> Array:
        return jnp.asarray(self.strength)

    @property
    def _end(self) -> Array:
        """The gap up to which the surfaces attract each other."""
        return jnp.asarray(self.work) / self.strength

    def traction(self, gap: Array) -> Array:
        return jnp.where(gap < self._end, jnp.asarray(self.strength), 0.0)

    def energy(self, gap: Array) -> Array:
        return self.strength * jnp.maximum(self._end - gap, 0.0)

    def stiffness(self, gap: Array) -> Array:
        return jnp.zeros_like(jnp.asarray(gap, float))

    def resolved(self, cell_compliance: Array) -> RampedAttraction:
        ramp = jnp.minimum(RAMP * cell_compliance * self.strength, self._end)
        return RampedAttraction(self.work, self.strength, ramp)


@pytree
class RampedAttraction(Adhesion):
    """Dugdale's attraction with a linear ramp to zero of the same work; ramp: its half-width, at most work/strength."""

    work: Array | float
    strength: Array | float
    ramp: Array | float

    @property
    def largest_traction(self) -> Array:
        return jnp.asarray(self.strength)

    @property
    def _start(self) -> Array:
        """The gap at which the ramp begins."""
        return jnp.asarray(self.work) / self.strength - self.ramp

    def _left(self, gap: Array) -> Array:
        """Return the share of the strength that is left at a gap."""
        return jnp.clip(1.0 - (gap - self._start) / (2.0 * self.ramp), 0.0, 1.0)

    def traction(self, gap: Array) -> Array:
        return self.strength * self._left(gap)

    def energy(self, gap: Array) -> Array:
        before = jnp.maximum(self._start - gap, 0.0)
        return self.strength * (before + self.ramp * self._left(gap) ** 2)

    def stiffness(self, gap: Array) -> Array:
        left = self._left(gap)
        return jnp.where((left > 0.0) & (left < 1.0), self.strength / (2.0 * self.ramp), 0.0)


@pytree
class ScaledAdhesion(Adhesion):
    """A law in units of a length and of the inverse of a compliance."""

    law: Adhesion
    length: Array
    compliance: Array

    @property
    def work(self) -> Array:  # type: ignore[override]
        return self.law.work * self.compliance / self.length

    @property
    def largest_traction(self) -> Array:
        return self.law.largest_traction * self.compliance

    def traction(self, gap: Array) -> Array:
        return self.law.traction(gap * self.length) * self.compliance

    def energy(self, gap: Array) -> Array:
        return self.law.energy(gap * self.length) * (self.compliance / self.length)

    def stiffness(self, gap: Array) -> Array:
        return self.law.stiffness(gap * self.length) * (self.compliance * self.length)

    def resolved(self, cell_compliance: Array) -> ScaledAdhesion:
        cell = cell_compliance * self.length * self.compliance
        return ScaledAdhesion(self.law.resolved(cell), self.length, self.compliance)


def check_adhesion(law: Any) -> Verdict:
    """Check a law of adhesion; ValueError for anything else, or parameters out of range."""
    checks.require(
        isinstance(law, Adhesion) and hasattr(law, "work"),
        "adhesion: expected ExponentialAdhesion, DugdaleAdhesion, a subclass of jc.abc.Adhesion with its work, or None, got"
        f" {law!r}",
    )
    good = checks.positive("adhesion: work [J/m^2]", law.work)
    if isinstance(law, ExponentialAdhesion):
        return good & checks.positive("adhesion: range [m]", law.range)
    good = good & checks.positive("adhesion: strength [Pa]", law.largest_traction)
    if isinstance(law, DugdaleAdhesion):
        return good

    # of a law of one's own, at some gaps: the attraction falls, and is the slope of the energy, which at a gap of zero is
    # the work
    gaps = law.characteristic_range * jnp.linspace(0.0, 3.0, OWN_GAPS)
    attraction, energy, reach = law.traction(gaps), law.energy(gaps), gaps[1]
    slope = -jax.jvp(law.energy, (gaps,), (jnp.ones_like(gaps),))[1]
    rises = jnp.max(jnp.diff(attraction)) > OWN_ROUNDING * attraction[0]
    misses = jnp.max(jnp.abs(slope - attraction)) > OWN_ROUNDING * attraction[0]
    misses = misses | (jnp.abs(energy[0] - law.work) > OWN_ROUNDING * law.work)
    sound = ~(rises | misses) & jnp.all(jnp.isfinite(energy)) & (reach > 0.0)
    if is_concrete(law, sound):
        checks.require(
            bool(sound),
            "adhesion: expected a traction that does not increase with the gap, an energy whose slope is -traction, and"
            f" which is the work at a gap of zero, got {law!r}",
        )
        return good
    return good & sound


def check_shear_strength(strength: Any, shape: tuple[int, ...], *, adhesive: bool) -> Verdict:
    """Check the shear strength of an adhesive contact: a number or of shape ``shape``, not negative."""
    checks.require(
        adhesive, f"shear_strength: expected None without adhesion, got {strength!r}: friction= is for that"
    )
    checks.number_or_field("shear_strength [Pa]", strength, shape)
    return checks.non_negative("shear_strength [Pa]", strength)


# Shift factors of time-temperature superposition: all times of a material are multiplied by a_T(T).
#
# A law is a frozen pytree with a method ``log_factor(temperature)`` that returns ln a_T; ``ArrheniusShift`` and
# ``WLFShift`` are two. Source: J. D. Ferry, Viscoelastic Properties of Polymers, 3rd ed., 1980, ch. 11.


@pytree
class ArrheniusShift:
    """The shift factor of a thermally activated viscosity: ln a_T = activation_energy/k (1/T - 1/reference).

    Args:
        activation_energy: of one molecule [J] >= 0, at most 1e-17 (62 eV).
        reference: temperature at which the material has its own times [K] > 0.

    Example:
        >>> shift = jc.ArrheniusShift(activation_energy=1.6e-19, reference=373.0)
        >>> f"{np.exp(shift.log_factor(393.0)):.3f}"
        '0.206'
    """

    activation_energy: Array | float
    reference: Array | float

    def log_factor(self, temperature: Array | float) -> Array:
        """Return ln a_T at a temperature [K] of any shape."""
        inverse = 1.0 / jnp.asarray(temperature, float) - 1.0 / self.reference
        return self.activation_energy / BOLTZMANN * inverse

    def check(self) -> Verdict:
        """Return whether the values are in range; raises ValueError for values that are not traced and are out of range."""
        valid = check_activation("ArrheniusShift", self.activation_energy)
        return valid & checks.positive("ArrheniusShift reference [K]", self.reference)


@pytree
class WLFShift:
    """The shift factor of Williams, Landel and Ferry: log10 a_T = -c1 (T - reference)/(c2 + T - reference).

    It holds above T = reference - c2, where the times become infinite; there and below ln a_T is inf.

    Args:
        c1: > 0.
        c2: [K] > 0.
        reference: temperature at which the material has its own times [K] > 0.

    Example:
        >>> shift = jc.WLFShift(c1=17.44, c2=51.6, reference=373.0)
        >>> f"{np.exp(shift.log_factor(383.0)):.2e}"
        '1.48e-03'
    """

    c1: Array | float
    c2: Array | float
    reference: Array | float

    def log_factor(self, temperature: Array | float) -> Array:
        """Return ln a_T at a temperature [K] of any shape."""
        above = jnp.asarray(temperature, float) - self.reference
        flows = self.c2 + above > 0.0
        return jnp.where(
            flows, -jnp.log(10.0) * self.c1 * above / jnp.where(flows, self.c2 + above, 1.0), jnp.inf
        )

    def check(self) -> Verdict:
        """Return whether the values are in range; raises ValueError for values that are not traced and are out of range."""
        valid = checks.positive("WLFShift c1", self.c1) & checks.positive("WLFShift c2 [K]", self.c2)
        return valid & checks.positive("WLFShift reference [K]", self.reference)


# Heating of a rubbed surface by friction.


@pytree
class Thermal:
    """Heating of the rubbed surface by friction, as the steady flash temperature of a half-space at each time.

    The temperature is T = ambient + rise, where the rise is that of ``flash_temperature`` under the flux share x friction x
    pressure x speed. In ``rub`` the contact does not move over the film, and the rise is that at zero velocity. In ``slide``
    it is that of a flux which moves over the body with the indenter.

    With ``shift`` the temperature changes the creep of the body: at each instant all its times are multiplied by one factor,
    that of the mean temperature of the contact (``history.growth_step``). Differences of temperature within the contact do
    not affect the creep, nor does temperature change the moduli.

    Args:
        ambient: temperature far from the contact [K] > 0.
        conductivity: thermal conductivity of the body [W/(m K)] > 0.
        share: fraction of the frictional heat that enters the body, from 0 to 1.
        shift: None, or the law of the shift factor of the body's times: ``ArrheniusShift``, ``WLFShift``, or a frozen pytree
            with ``log_factor(temperature)``.
        diffusivity: thermal diffusivity of the body [m2/s] > 0, for ``slide``; ``rub`` does not use it.

    Example:
        >>> steel_at_100_degrees = jc.Thermal(ambient=373.0, conductivity=46.0, share=0.5)
    """

    ambient: Array | float
    conductivity: Array | float
    share: Array | float = 1.0
    shift: Any = None
    diffusivity: Array | float | None = None

    def check(self) -> Verdict:
        """Return whether the values are in range; raises ValueError for values that are not traced and are out of range."""
        valid = checks.positive("Thermal ambient [K]", self.ambient)
        valid = valid & checks.positive("Thermal conductivity [W/(m K)]", self.conductivity)
        valid = valid & checks.between("Thermal share", self.share, -1e-12, 1.0)
        if self.diffusivity is not None:
            valid = valid & checks.positive("Thermal diffusivity [m2/s]", self.diffusivity)
        if self.shift is None:
            return valid
        checks.require(
            callable(getattr(self.shift, "log_factor", None)),
            f"Thermal shift: expected None or an object with a method log_factor, got {type(self.shift).__name__}",
        )
        valid = valid & (self.shift.check() if hasattr(self.shift, "check") else True)
        name = "ln a_T of Thermal shift at ambient, inf where the body has infinite times"
        return valid & checks.finite(name, self.shift.log_factor(self.ambient))


def check_thermal(thermal: Any, grid: Grid, verb: str) -> Verdict:
    """Check None, or a ``Thermal`` on a grid that is not periodic."""
    if thermal is None:
        return True
    checks.require(
        isinstance(thermal, Thermal), f"thermal: expected Thermal or None, got {type(thermal).__name__}"
    )
    checks.require(
        not any(grid.periodic),
        f"grid: expected a grid that is not periodic: {verb} with thermal supports free space only, got"
        f" periodic={grid.periodic}",
    )
    return thermal.check()
