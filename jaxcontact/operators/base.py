"""Interface of an operator from pressure to displacement on a grid, as used by contact and memory.

An operator is linear in its leaves as well as in the pressure, so that ``change(p)``, with the tangents of the leaves in
their place, is the tangent of ``operator(p)``; one that is not overrides ``tangent``. Padding, spectra and the shape of
the grid are its own affair.
"""

from __future__ import annotations

import abc
from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.operators import spectral

# Fields on the contact, continued beyond it, so that an inverse on the whole grid serves on the contact as well.
#
# With K_cc the operator between the cells in contact,
#
#     <r, K_cc^-1 r> = min <w, K^-1 w>    over the fields w that equal r in contact,
#
# so that a preconditioner E^T K^-1 E is the better, the less energy the continued field E r has. Continued by zero, a
# field that varies slowly jumps at every edge of the contact; its energy then exceeds the least one in proportion to
# its wavelength, and the number of iterations increases with the size of the grid. Here cells outside the contact are
# given averages of the cells around them. With the averages r_l of the field (zero outside) and c_l of the contact
# (one or zero) over blocks of 3^l cells,
#
#     E_l = r_l + (1 - c_l) U E_(l+1),    r_(l+1) = D r_l,    c_(l+1) = D c_l,    U = 9 D^T,
#
# D an average over a block and then over the blocks around it. Far from small spots the averages, and with them E r,
# fall to zero, as the field of least energy does. Explicit extensions by levels are due to S. V. Nepomnyaschikh, Sov.
# J. Numer. Anal. Math. Modelling 6 (1991) 151.


BLOCK, LEVELS = 3, 3

Linear = Callable[[Array], Array]
OnContact = Callable[[Array, Array], Array]  # of a field that is zero outside some cells, and these cells


def unchanged(inverse: Linear) -> OnContact:
    """Return an inverse on the grid that takes no notice of the contact."""
    return lambda field, cells: inverse(field)


def continuing(inverse: Linear) -> OnContact:
    """Return E^T K^-1 E, not yet zero outside the contact, from an inverse on the grid; symmetric.

    If the cells are divided among devices E is left out: its averages would be exchanged.
    """
    if spectral.devices() > 1:
        return unchanged(inverse)

    def on_contact(field: Array, cells: Array) -> Array:
        outside = _outside(cells)
        return _gathered(inverse(_continued(field, outside)), outside)

    return on_contact


def _outside(cells: Array) -> list[Array]:
    """Return 1 - c_l of every level."""
    shares = [cells.astype(float)]
    for _ in range(LEVELS - 1):
        shares.append(_averaged(shares[-1]))
    return [1.0 - share for share in shares]


def _continued(field: Array, outside: list[Array]) -> Array:
    """Return E r."""
    if not outside:
        return field
    around = _continued(_averaged(field), outside[1:])
    return field + outside[0] * _spread(around, field.shape)


def _gathered(field: Array, outside: list[Array]) -> Array:
    """Return E^T z."""
    if not outside:
        return field
    return field + _spread(_gathered(_averaged(outside[0] * field), outside[1:]), field.shape)


def _averaged(field: Array) -> Array:
    """Return D r, (nx, ny) -> (nx/3, ny/3), rounded up; the field is zero beyond the grid."""
    sums = jax.lax.reduce_window(
        field, 0.0, jax.lax.add, (BLOCK, BLOCK), (BLOCK, BLOCK), [(0, -n % BLOCK) for n in field.shape]
    )
    return _around(sums) / BLOCK**2


def _spread(blocks: Array, shape: tuple[int, ...]) -> Array:
    """Return U r, on a grid of a shape."""
    (kx, ky), (nx, ny) = blocks.shape, shape
    cells = jnp.broadcast_to(_around(blocks)[:, None, :, None], (kx, BLOCK, ky, BLOCK))
    return cells.reshape(BLOCK * kx, BLOCK * ky)[:nx, :ny]


def _around(blocks: Array) -> Array:
    """Return the average over each block and the eight around it, zero beyond the grid; symmetric."""
    return jax.lax.reduce_window(blocks, 0.0, jax.lax.add, (3, 3), (1, 1), "SAME") / 9.0


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
    def cell_compliance(self, shape: tuple[int, ...]) -> Array:
        """Return the displacement over its own pressure of a cell whose neighbours are free, (); shape: the grid's."""


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
