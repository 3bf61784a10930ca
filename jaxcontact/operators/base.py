"""Interface of an operator from pressure to displacement on a grid, as used by contact and memory.

An operator is linear in its leaves as well as in the pressure, so that ``change(p)``, with the tangents of the leaves in
their place, is the tangent of ``operator(p)``; one that is not overrides ``tangent``. Padding, spectra and the shape of
the grid are its own affair.
"""

from __future__ import annotations

import abc
from collections.abc import Sequence
from typing import NamedTuple

from jax import Array

from jaxcontact.operators.continued import Linear as Linear
from jaxcontact.operators.continued import OnContact, continuing, unchanged

Corner = tuple[Array, Array]  # the lowest cell of a window in its grid


class Operator(abc.ABC):
    """p (nx, ny) -> u (nx, ny), scaled."""

    symmetric: bool  # of the class: whether <p, K q> = <q, K p>
    periodic: tuple[bool, bool]  # along x, along y

    @abc.abstractmethod
    def __call__(self, pressure: Array) -> Array:
        """u = K p."""

    def tangent(self, change: Operator, pressure: Array) -> Array:
        """Return the change of K p, (nx, ny); change: the operator with the tangents of its leaves in their place."""
        return change(pressure)

    @abc.abstractmethod
    def transpose(self) -> Operator:
        """K^T."""

    @abc.abstractmethod
    def preconditioner(self) -> Linear:
        """A cheap approximate inverse, made once for many uses; symmetric and positive where K is."""

    def preconditioner_on_contact(self) -> OnContact:
        """The same for fields that are zero outside given cells, of contacts of any shape; it costs more.

        On periodic grids the plain inverse, so that cells divided among devices give the results of one to rounding.
        """
        inverse = self.preconditioner()
        return unchanged(inverse) if all(self.periodic) else continuing(inverse)

    @abc.abstractmethod
    def confined_compliance(self, shape: tuple[int, ...]) -> Array:
        """Displacement over its own pressure of a cell whose neighbours all stay where they are, (); shape: the grid's."""

    @abc.abstractmethod
    def cell_ratio(self, shape: tuple[int, ...]) -> Array | float:
        """Displacement under pressures that alternate from cell to cell along y, over that along x, (); shape: the grid's.

        The ratio dy/dx of the sides of a cell on a half-space, 1 on a body that responds locally.
        """

    @abc.abstractmethod
    def window_shape(self, shape: tuple[int, ...]) -> tuple[int, int] | None:
        """Return the shape of a smaller grid for the start of a search within a grid of ``shape``, or None."""

    @abc.abstractmethod
    def restricted(self, corner: Corner) -> Operator:
        """The same operator on the window of ``window_shape`` at a corner of the grid, without derivative."""

    @abc.abstractmethod
    def even(self) -> Operator:
        """The even part, symmetric."""

    @abc.abstractmethod
    def plus_even(self, share: Array | float) -> Operator:
        """K and a share of its even part."""


class InvertibleOperator(Operator):
    """An operator that has an inverse on a larger grid, as contact with adhesion needs."""

    @abc.abstractmethod
    def extended(self, shape: tuple[int, ...]) -> Extended:
        """Return an operator on a larger grid that has an inverse, and acts between the cells of ``shape`` as this one."""

    @abc.abstractmethod
    def cell_compliance(self) -> Array:
        """Return the displacement over its own pressure of a cell whose neighbours are free, ()."""


class SplitOperator(Operator):
    """An operator whose even part has an inverse on a larger grid, as contact with adhesion needs of a moving body."""

    @abc.abstractmethod
    def even(self) -> InvertibleOperator:
        """The even part, symmetric."""

    @abc.abstractmethod
    def odd(self) -> Operator:
        """The odd part, antisymmetric: K less ``even``."""


class Extended(NamedTuple):
    """An operator on a larger grid of ``shape``, whose first cells are those of the grid, and its inverse; symmetric,
    positive.
    """

    operator: Linear
    inverse: Linear
    shape: tuple[int, int]


class TractionOperator(abc.ABC):
    """Traction on the cells -> displacement in three directions, scaled; the z direction has an operator of its own.

    q: tangential traction on the body, (2, nx, ny); p: pressure, (nx, ny).
    """

    normal: Operator  # p -> displacement into the body under it

    @abc.abstractmethod
    def tangential_from_tangential(self, q: Array) -> Array:
        """Tangential displacement under a tangential traction, (2, nx, ny); symmetric and positive."""

    @abc.abstractmethod
    def tangential_from_normal(self, p: Array) -> Array:
        """Tangential displacement under a pressure, (2, nx, ny)."""

    @abc.abstractmethod
    def normal_from_tangential(self, q: Array) -> Array:
        """Normal displacement under a tangential traction, (nx, ny): the transpose of ``tangential_from_normal``."""

    @abc.abstractmethod
    def displaced(self, q: Array) -> tuple[Array, Array]:
        """Return ``tangential_from_tangential`` and ``normal_from_tangential`` of a traction."""

    @abc.abstractmethod
    def preconditioner(self, added: Array) -> Linear:
        """Return a cheap approximate inverse of ``tangential_from_tangential`` plus constants (m,); symmetric, positive.

        Each acts on fields of its own, (m, 2, nx, ny).
        """

    @abc.abstractmethod
    def local(self) -> Array:
        """The mean eigenvalue of ``tangential_from_tangential``, ()."""

    @abc.abstractmethod
    def largest(self) -> Array:
        """Return roughly the largest eigenvalue of ``tangential_from_tangential``, ()."""

    @abc.abstractmethod
    def coupling(self) -> Array:
        """Return roughly the norm of ``normal_from_tangential`` over that of ``tangential_from_tangential``, ()."""

    @abc.abstractmethod
    def window_shape(self, shape: tuple[int, ...]) -> tuple[int, int] | None:
        """Return the shape of a smaller grid for the start of a search within a grid of ``shape``, or None."""

    @abc.abstractmethod
    def restricted(self, corner: Corner) -> TractionOperator:
        """Return the same operator on the window of ``window_shape`` at a corner of the grid, without derivative."""


class Family(abc.ABC):
    """Several operators K_m on one grid, to be mixed."""

    @abc.abstractmethod
    def combined(self, weights: Sequence[Array | float]) -> Operator:
        """sum_m weights_m K_m, one weight for each."""

    @abc.abstractmethod
    def circulants(self, pressure: Array) -> Array:
        """Return the spectra of the periodic operators nearest to all K_m under a pressure, (m, ny/2 + 1, nx)."""

    @abc.abstractmethod
    def total(self, fields: Array) -> Array:
        """sum_m K_m f_m of fields (n, nx, ny), one for each of the last n members."""
