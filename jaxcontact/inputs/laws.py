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

import functools
import inspect
from typing import TYPE_CHECKING, Any, TypeVar

import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import pytree, static

BOLTZMANN = 1.380649e-23  # J/K, exact
MOST_ENERGY, MOST_VOLUME = 1e-17, 1e-24  # J and m3 of one molecule; 62 eV and 1000 nm3
PER_MOLECULE = "in J per molecule: 1 eV is 1.602e-19 J, 1 kJ/mol is 1.661e-21 J"
IN_CUBIC_METRES = "in m3 per molecule: 1 nm3 is 1e-27 m3"
T = TypeVar("T")


@pytree
class RubbingState:
    """The state of the contact at one time, the argument of a law, in SI units.

    pressure [Pa], gap [m], thickness [m] of the film (with ``wears="indenter"``: what has formed on the indenter, negative
    where it is worn), friction_stress [Pa] = friction x pressure: (nx, ny); speed [m/s], (); temperature [K], (nx, ny), None
    unless the rubbing has ``thermal=``; time [s], ().
    """

    pressure: Array
    gap: Array
    thickness: Array
    friction_stress: Array
    speed: Array
    temperature: Array | None
    time: Array


class KineticLaw:
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
    """Removal in proportion to the thickness where there is contact: dh/dt = -rate h.

    Args:
        rate: rate constant [1/s] >= 0; the field is ``rate_constant``, since ``rate`` is a method.

    Example:
        >>> law = jc.ProportionalRemoval(rate=1e-3)
    """

    rate_constant: Array | float

    if TYPE_CHECKING:

        def __init__(self, rate: Array | float) -> None: ...

    def rate(self, step: RubbingState) -> Array:
        return jnp.where(step.pressure > 0.0, -self.rate_constant * step.thickness, 0.0)

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
