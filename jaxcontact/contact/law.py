"""The contact law: the pressures that a cell may carry, and the gap that belongs to each.

A law states which cells are in contact, which may change, and which gaps belong to which pressures; all else in ``contact``
is the same for every law. The law in use is hard contact without adhesion,

    p >= 0,      g >= 0,      p g = 0      (A. Signorini; K. L. Johnson, Contact Mechanics, 1985, sec. 5.9),

and the energy 1/2 <p, K p> + <p, gap - approach> is lowest among the admissible pressures. A law may bound the pressure
in other ways as long as its admissible pressures are a convex set, cell by cell. Attraction across a gap is no such bound:
``contact.adhesive``.
"""

from __future__ import annotations

import abc
from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from jaxcontact._support import reductions
from jaxcontact._support.pytree import pytree


class ContactLaw(abc.ABC):
    """The interface of a contact law; its parameters, if any, are leaves in the scale of the problem.

    homogeneous: whether every positive multiple of admissible pressures is admissible; prescribes: whether the law
    gives the pressure of some cells in contact, which then do not follow from a gap of zero.
    """

    homogeneous: ClassVar[bool]
    prescribes: ClassVar[bool]

    @abc.abstractmethod
    def touching(self, pressure: Array) -> Array:
        """Return the cells in contact, (nx, ny) bool."""

    def acting(self, contact_pressure: Array, gap: Array) -> Array:
        """Return the cells in which the surfaces act on each other, (nx, ny) bool: those in contact."""
        return self.touching(contact_pressure)

    @abc.abstractmethod
    def free(self, pressure: Array) -> Array:
        """Return the cells in contact whose gap is zero and whose pressure follows from that, (nx, ny) bool."""

    @abc.abstractmethod
    def may_change(self, pressure: Array, gap: Array) -> Array:
        """Return the cells whose pressure an iteration may change, (nx, ny) bool."""

    @abc.abstractmethod
    def admissible(self, pressure: Array) -> Array:
        """Return the nearest admissible pressure, cell by cell."""

    @abc.abstractmethod
    def balanced(self, pressure: Array, total: Array, cells: Array) -> Array:
        """Return an admissible pressure of the given sum, near another one; cells (nx, ny) bool: those that may change."""

    @abc.abstractmethod
    def longest(self, pressure: Array, step: Array) -> Array:
        """Return the largest factor () with which a step from an admissible pressure stays admissible."""

    @abc.abstractmethod
    def violation(self, pressure: Array, gap: Array) -> Array:
        """Return by how much the gap of each cell differs from what the law allows at its pressure, (nx, ny) >= 0."""

    @abc.abstractmethod
    def prescribed_change(self, change: ContactLaw, pressure: Array) -> Array:
        """Return the change of the pressures that the law prescribes, for a change of the law, (nx, ny)."""


@pytree
class Unilateral(ContactLaw):
    """Hard contact without adhesion: p >= 0, g >= 0, p g = 0."""

    homogeneous = True
    prescribes = False

    def touching(self, pressure: Array) -> Array:
        return pressure > 0.0

    def free(self, pressure: Array) -> Array:
        return pressure > 0.0

    def may_change(self, pressure: Array, gap: Array) -> Array:
        return (pressure > 0.0) | (gap < 0.0)

    def admissible(self, pressure: Array) -> Array:
        return jnp.maximum(pressure, 0.0)

    def balanced(self, pressure: Array, total: Array, cells: Array) -> Array:
        pressure = self.admissible(pressure)
        return pressure * (total / reductions.total(pressure))

    def longest(self, pressure: Array, step: Array) -> Array:
        falls = step < 0.0
        return reductions.smallest(jnp.where(falls, pressure / jnp.where(falls, -step, 1.0), jnp.inf))

    def violation(self, pressure: Array, gap: Array) -> Array:
        return jnp.where(pressure > 0.0, jnp.abs(gap), jnp.maximum(-gap, 0.0))

    def prescribed_change(self, change: ContactLaw, pressure: Array) -> Array:
        return jnp.zeros_like(pressure)


UNILATERAL = Unilateral()
