"""Laws of adhesion: the attraction between two surfaces as a function of the gap between them.

Two surfaces at a gap g >= 0 attract each other with a traction s(g) >= 0, whose work of separation is

    w = int_0^infinity s(g) dg.

Where they touch, contact carries a pressure p_c >= 0 as well, and the pressure on the body is the sum p = p_c - s(g), which
is negative where attraction prevails. The range z = w/s(0) of the attraction relative to the deformation that it causes
decides between the limits of a paraboloid of radius R: of short range (K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R.
Soc. Lond. A 324 (1971) 301), with a pull-off force of 1.5 pi w R, and of long range (B. V. Derjaguin, V. M. Muller,
Y. P. Toporov, J. Colloid Interface Sci. 53 (1975) 314), with 2 pi w R. Between them lies the Tabor number
(R w^2/(E*^2 z^3))^(1/3) (D. Tabor, J. Colloid Interface Sci. 58 (1977) 2).
"""

from __future__ import annotations

import abc
from typing import Any

import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import pytree

RAMP = (
    1.2  # half-width of the ramp at the end of Dugdale's attraction, over (compliance of a cell) x (strength)
)


class Adhesion(abc.ABC):
    """The interface of a law of adhesion: attraction, energy and stiffness as functions of the gap, cell by cell.

    Further laws can be defined as subclasses with these methods. The attraction must not increase with the gap.
    """

    work: Array | float

    @property
    @abc.abstractmethod
    def largest_traction(self) -> Array:
        """The attraction at a gap of zero [Pa], ()."""

    @abc.abstractmethod
    def traction(self, gap: Array) -> Array:
        """Return the attraction s(g) >= 0 [Pa] at gaps g >= 0 [m]."""

    @abc.abstractmethod
    def energy(self, gap: Array) -> Array:
        """Return the work of separation from a gap g to infinity, int_g^infinity s dg [J/m^2]."""

    @abc.abstractmethod
    def stiffness(self, gap: Array) -> Array:
        """Return -ds/dg >= 0 [Pa/m]."""

    @abc.abstractmethod
    def scaled(self, length: Array, compliance: Array) -> Adhesion:
        """Return the law in units of a length [m] and of the inverse of a compliance [1/Pa]."""

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

    def scaled(self, length: Array, compliance: Array) -> ExponentialAdhesion:
        return ExponentialAdhesion(self.work * compliance / length, self.range / length)


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

    def scaled(self, length: Array, compliance: Array) -> DugdaleAdhesion:
        return DugdaleAdhesion(self.work * compliance / length, self.strength * compliance)

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

    def scaled(self, length: Array, compliance: Array) -> RampedAttraction:
        return RampedAttraction(
            self.work * compliance / length, self.strength * compliance, self.ramp / length
        )


def check_adhesion(law: Any) -> Verdict:
    """Check a law of adhesion, or None for no adhesion; ValueError for anything else, or parameters out of range."""
    if law is None:
        return True
    checks.require(
        isinstance(law, Adhesion),
        f"adhesion: expected ExponentialAdhesion, DugdaleAdhesion or None, got {law!r}",
    )
    good = checks.positive("adhesion: work [J/m^2]", law.work)
    if isinstance(law, ExponentialAdhesion):
        return good & checks.positive("adhesion: range [m]", law.range)
    return good & checks.positive("adhesion: strength [Pa]", law.largest_traction)
