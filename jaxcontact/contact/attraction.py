"""Attraction between the surfaces on the grid: tractions and energy of a field of gaps.

A law of adhesion is averaged over 2 x 2 points inside each square of four cells' centres, with the gap bilinear between
them (Gauss-Legendre points; two points between neighbours in plane strain). Taken at the centres alone, a short-ranged
law would hold the edge of contact at rows of cells, and a contact would separate at too high a tension. The tractions are
the derivative of the averaged energy with respect to the gaps, so that they are conservative on the grid as well.
"""

from __future__ import annotations

from typing import Any, Protocol

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, static

WEAK = 0.01  # of the largest traction: what is below does not matter where the grid ends
POINTS = 0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5


class CohesiveLaw(Protocol):
    """Interface of a law of adhesion (``inputs.adhesion``), scaled: functions of the gap, cell by cell."""

    @property
    def largest_traction(self) -> Array:
        """The attraction at a gap of zero, ()."""

    @property
    def characteristic_range(self) -> Array:
        """The work over the largest traction, ()."""

    def traction(self, gap: Array) -> Array:
        """Return the attraction s(g) >= 0."""

    def energy(self, gap: Array) -> Array:
        """Return int_g^infinity s dg."""

    def stiffness(self, gap: Array) -> Array:
        """Return -ds/dg >= 0."""

    def resolved(self, cell_compliance: Array) -> Any:
        """Return the law as cells of a compliance can resolve it."""

    def zone_length(self, modulus: Any) -> Array:
        """Return the length of the zone of attraction at the edge of contact."""


@pytree
class Attraction:
    """A scaled law of adhesion, averaged on the cells of a grid; periodic: along x and y."""

    law: CohesiveLaw
    periodic: tuple[bool, bool] = static()

    def touching(self, contact_pressure: Array) -> Array:
        """Return the cells in contact, (nx, ny) bool."""
        return contact_pressure > 0.0

    def acting(self, contact_pressure: Array, gap: Array) -> Array:
        """Return the cells that touch or attract each other by more than ``WEAK`` of the largest traction, (nx, ny) bool."""
        attracted = self.traction(jnp.maximum(gap, 0.0)) > WEAK * self.law.largest_traction
        return self.touching(contact_pressure) | attracted

    def energy(self, gap: Array) -> Array:
        """Return the sum over cells of int_g^infinity s dg, ()."""
        points, weights = self._points(gap), _weights(gap.shape, self.periodic)
        return jnp.sum(weights * self.law.energy(points))

    def traction(self, gap: Array) -> Array:
        """Return the attraction of each cell, (nx, ny) >= 0."""
        return self._spread(gap, self.law.traction(self._points(gap)))

    def stiffness(self, gap: Array) -> Array:
        """Return -ds/dg at the points of a field of gaps, for ``softened``."""
        return self.law.stiffness(self._points(gap))

    def softened(self, stiffness: Array, change: Array) -> Array:
        """Return the decrease of the cells' attraction, (nx, ny), for a change of the gaps; linear and symmetric."""
        return self._spread(change, stiffness * self._points(change))

    def explicit(self, change: CohesiveLaw, gap: Array) -> Array:
        """Return the change of the cells' attraction for a change of the law's parameters, (nx, ny)."""
        points = self._points(gap)
        return self._spread(gap, jax.jvp(lambda law: law.traction(points), (self.law,), (change,))[1])

    def _points(self, gap: Array) -> Array:
        """Return the gaps at the points, (2, 2, squares along x, squares along y)."""
        return _between(_between(gap, 0, self.periodic[0]), 2, self.periodic[1])

    def _spread(self, gap: Array, values: Array) -> Array:
        """Return what the cells take of values at the points, (nx, ny): the transpose of ``_points``, weighted."""
        weighted = _weights(gap.shape, self.periodic) * values
        return jax.linear_transpose(self._points, gap)(weighted)[0]


def _between(field: Array, axis: int, wraps: bool) -> Array:
    """Return a field at the points between neighbours along an axis, with a new first axis of the points."""
    if field.shape[axis] == 1:
        return field[None]
    ahead = [(0, 0)] * field.ndim
    ahead[axis] = (0, 1) if wraps else (1, 1)
    padded = jnp.pad(field, ahead, mode="wrap" if wraps else "edge")
    here = jax.lax.slice_in_dim(padded, 0, padded.shape[axis] - 1, axis=axis)
    there = jax.lax.slice_in_dim(padded, 1, padded.shape[axis], axis=axis)
    return jnp.stack([(1.0 - t) * here + t * there for t in POINTS])


def _weights(shape: tuple[int, ...], periodic: tuple[bool, bool]) -> Array:
    """Return the part of a cell that each point stands for, (squares along x, squares along y)."""
    along = [_widths(n, wraps) for n, wraps in zip(shape, periodic, strict=True)]
    return along[0][:, None] * along[1][None, :]


def _widths(n: int, wraps: bool) -> Array:
    if n == 1:
        return jnp.ones(1)
    return 0.5 * (jnp.ones(n) if wraps else jnp.ones(n + 1).at[jnp.array([0, n])].set(0.5))
