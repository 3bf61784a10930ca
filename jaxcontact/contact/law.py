"""The contact law: the pressures that a cell may carry, and the gap that belongs to each.

A law states which cells are in contact, which may change, and which gaps belong to which pressures; all else in ``contact``
is the same for every law. The law in general use is hard contact without adhesion,

    p >= 0,      g >= 0,      p g = 0      (A. Signorini; K. L. Johnson, Contact Mechanics, 1985, sec. 5.9),

and the energy 1/2 <p, K p> + <p, gap - approach> is lowest among the admissible pressures. ``Hardness`` bounds the pressure
of surfaces that yield. A law may bound it in other ways as long as its admissible pressures are a convex set, cell by
cell. Attraction across a gap is no such bound: ``contact.adhesive``.
"""

from __future__ import annotations

import abc
from typing import ClassVar

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support import reductions
from jaxcontact._support.pytree import pytree, replace
from jaxcontact.operators.operator import cut

SHIFTS = 60  # most steps of the search for a uniform shift of pressures; it takes about five
BALANCED = 1e-15  # difference of a sum of pressures from the given one, over it, at which that search stops


class ContactLaw(abc.ABC):
    """The interface of a contact law; its parameters, if any, are leaves in the scale of the problem.

    homogeneous: whether every positive multiple of admissible pressures is admissible; prescribes: whether the law
    gives the pressure of some cells in contact, which then do not follow from a gap of zero.
    """

    homogeneous: ClassVar[bool]
    prescribes: ClassVar[bool] = False

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

    def prescribed_change(self, change: ContactLaw, pressure: Array) -> Array:
        """Return the change of the pressures that the law prescribes, for a change of the law, (nx, ny)."""
        return jnp.zeros_like(pressure)

    def in_window(self, corner: Array, shape: tuple[int, int]) -> ContactLaw:
        """Return the law of the cells of a window (``operators.operator``): itself, unless it varies over the surface."""
        return self


@pytree
class Unilateral(ContactLaw):
    """Hard contact without adhesion: p >= 0, g >= 0, p g = 0."""

    homogeneous = True

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


@pytree
class Hardness(ContactLaw):
    """Hard contact of surfaces that yield: 0 <= p <= H; g >= 0 where p = 0, g = 0 between, and g <= 0 where p = H.

    limit: the hardness H, a number or (nx, ny). Cells are elastic and perfectly plastic, each by itself: the overlap -g that
    the elastic surfaces cannot close at p = H is filled by a dent of this depth, which stays. The pressure of least energy
    obeys these conditions; the set of admissible pressures is a box, on which the conjugate gradients of ``contact.normal``
    and the active sets of ``contact.nonsymmetric`` work as they do for p >= 0.
    Source: A. Almqvist, F. Sahlin, R. Larsson, S. Glavatskih, Tribology International 40 (2007) 574.
    """

    limit: Array

    homogeneous = False
    prescribes = True

    def touching(self, pressure: Array) -> Array:
        return pressure > 0.0

    def free(self, pressure: Array) -> Array:
        return (pressure > 0.0) & (pressure < self.limit)

    def may_change(self, pressure: Array, gap: Array) -> Array:
        more = (pressure > 0.0) | (gap < 0.0)
        return more & ~((pressure >= self.limit) & (gap <= 0.0))

    def admissible(self, pressure: Array) -> Array:
        return jnp.clip(pressure, 0.0, self.limit)

    def balanced(self, pressure: Array, total: Array, cells: Array) -> Array:
        """Return the nearest admissible pressure of the given sum: clip(p + c, 0, H) on the cells that may change, on all
        of them where those cannot carry the sum, and H everywhere if nothing can.
        """
        held = reductions.total(jnp.where(cells, self.limit, self.admissible(pressure)))
        some = cells | (held < total)
        shifted = lambda c: self.admissible(jnp.where(some, pressure + c, pressure))

        # The sum rises with c, and is linear but where a cell becomes free or saturated: Newton's method between bounds,
        # which are halved where a step of it would leave them. At the upper bound each cell is at H or at the whole sum.
        def step(state: tuple[Array, ...]) -> tuple[Array, ...]:
            c, low, high, _, count = state
            found = shifted(c)
            excess, slope = reductions.totals(found, some & self.free(found))
            excess = excess - total
            low, high = jnp.where(excess < 0.0, c, low), jnp.where(excess < 0.0, high, c)
            newton = c - excess / jnp.where(slope > 0.0, slope, 1.0)
            inside = (slope > 0.0) & (newton > low) & (newton < high)
            after = jnp.where(inside, newton, (low + high) / 2.0)
            done = jnp.abs(excess) <= BALANCED * total
            return jnp.where(done, c, after), low, high, done, count + 1

        reach = reductions.largest(jnp.abs(pressure)) + jnp.minimum(jnp.max(self.limit), total)
        first = jnp.zeros(()), -reach, reach, jnp.asarray(False), jnp.zeros((), int)
        going = lambda state: ~state[3] & (state[4] < SHIFTS)
        found = shifted(jax.lax.while_loop(going, step, first)[0])
        return jnp.where(total > 0.0, found, 0.0)  # no shift reaches a sum of zero to rounding

    def longest(self, pressure: Array, step: Array) -> Array:
        room = jnp.where(step < 0.0, pressure, self.limit - pressure)
        size = jnp.where(step == 0.0, 1.0, jnp.abs(step))
        return reductions.smallest(jnp.where(step == 0.0, jnp.inf, room / size))

    def violation(self, pressure: Array, gap: Array) -> Array:
        inside = jnp.where(pressure >= self.limit, jnp.maximum(gap, 0.0), jnp.abs(gap))
        return jnp.where(pressure > 0.0, inside, jnp.maximum(-gap, 0.0))

    def prescribed_change(self, change: ContactLaw, pressure: Array) -> Array:
        return jnp.where(pressure >= self.limit, change.limit, 0.0)  # type: ignore[attr-defined]

    def in_window(self, corner: Array, shape: tuple[int, int]) -> Hardness:
        return self if self.limit.ndim == 0 else replace(self, limit=cut(self.limit, corner, shape))

    def dent(self, pressure: Array, gap: Array) -> Array:
        """Return by how much the dent deepens: the overlap that is left at p = H, (nx, ny)."""
        return jnp.where(pressure >= self.limit, jnp.maximum(-gap, 0.0), 0.0)

    def carries(self, load: Array, cells: Array) -> Array:
        """Return whether the cells (nx, ny) bool can carry a load, the sum of their pressures, ()."""
        return load <= reductions.total(jnp.where(cells, self.limit, 0.0))


UNILATERAL = Unilateral()
