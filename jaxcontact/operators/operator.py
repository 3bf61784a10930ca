"""The linear operator from pressure to displacement on a grid, and families of such operators, to be mixed.

    u = sum over the entries (i, j, k) of  f_i F^-1[ K_k F(f_j p) ],      f_0 = 1,  f_1, f_2, ...: weights at each cell

F is the transform on the grid, zero-padded along axes that are not periodic (``operators.spectral``). With one entry
(0, 0, 0) this is a half-space or a film of one thickness; K_0 is real at rest, where the kernel is even, and complex in
motion over a body that remembers. With f_1 = mu, the entries (0, 0, 0) and (0, 1, 1) add the displacement under tractions
of friction that varies over the surface (``operators.kernels``). With f_n = T_n, polynomials of the thickness, the
entries (0, n, n) and (n, 0, n) are a film whose thickness varies (``operators.kernels``).

Transposed, K_k is its conjugate and i and j are exchanged. Spectra that are real stay real.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import scipy
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact.operators import spectral

Linear = Callable[[Array], Array]
Corner = tuple[Array, Array]  # indices in the grid of the first cell of a window
OnContact = Callable[
    [Array, Array], Array
]  # function of a field that is zero outside some cells, and of these cells
Entry = tuple[int, int, int]  # (i, j, k) of the formula above
SINGLE: tuple[Entry, ...] = ((0, 0, 0),)

FLOOR = 1e-3  # smallest eigenvalue of the preconditioned circulant, over the mean size of its eigenvalues
# largest number of cells along a side of a grid without a window, on which residuals are not continued beyond the contact
SMALL = 64
LEAST = 1e-6  # smallest eigenvalue of an extended operator, over the largest
WRAPPED: spectral.Periodic = (True, True)


def series_entries(count: int) -> tuple[Entry, ...]:
    """Return the entries of the operator of a series of ``count`` terms, whose spectra are K_0 and K_n/2."""
    both = [((0, n, n), (n, 0, n)) for n in range(1, count)]
    return (*SINGLE, *(entry for pair in both for entry in pair))


@pytree
class Operator:
    """The operator u = K p of the formula at the head of the module, p and u (nx, ny), scaled.

    spectra (n, my/2 + 1, mx): of K_0, K_1, ... on the padded grid, real or complex; circulant (ny/2 + 1, nx), real where
    the spectra are: of the periodic operator nearest to the mean of this one on the grid itself; weights (m, nx, ny): f_1,
    f_2, ..., or None; lift (nx, ny): displacement by a mean pressure of one less its mean, where weights vary on a grid
    that is periodic along both axes, else None; window: the operator on a smaller grid without its weights, for searches,
    or None; wide: as circulant, on the grid of ``spectral.wide_shape``, for the preconditioner alone, or None; periodic:
    axes without padding; entries: of the module.
    """

    spectra: Array
    circulant: Array
    weights: Array | None = None
    lift: Array | None = None
    window: Operator | None = None
    wide: Array | None = None
    periodic: spectral.Periodic = static(default=spectral.FREE)
    entries: tuple[Entry, ...] = static(default=SINGLE)

    @property
    def symmetric(self) -> bool:
        """Whether <p, K q> = <q, K p> by its structure (static): even kernels, each weight on both sides."""
        return not jnp.iscomplexobj(self.spectra) and self._mutual == self.entries

    @property
    def _mutual(self) -> tuple[Entry, ...]:
        """The entries whose exchange is an entry as well."""
        return tuple((i, j, k) for i, j, k in self.entries if (j, i, k) in self.entries)

    def __call__(self, pressure: Array) -> Array:
        """Return u = K p."""
        lifts = None if self.lift is None else [self.lift]
        return superposed([self.spectra], [pressure], self, lifts)

    def tangent(self, change: Operator, pressure: Array) -> Array:
        """Return the change of K p, (nx, ny); change: the operator with the tangents of its leaves in their place."""
        if self.weights is None:  # linear in its other leaves
            return change(pressure)
        return jax.jvp(lambda operator: operator(pressure), (self,), (change,))[1]

    def transpose(self) -> Operator:
        """Return K^T; with one kernel it is the operator of the opposite motion."""
        if self.symmetric:
            return self
        turned = jax.tree.map(jnp.conj, self)
        return replace(turned, entries=tuple((j, i, k) for i, j, k in self.entries))

    def even(self) -> Operator:
        """Return the symmetric part that consists of the even kernels of mutual entries; a search may start from it."""
        if self.symmetric:
            return self
        spectra = self.spectra[: 1 + max(k for *_, k in self._mutual)].real
        weights = self.weights if any(i for i, *_ in self._mutual) else None
        return Operator(
            spectra, self.circulant.real, weights, self.lift, periodic=self.periodic, entries=self._mutual
        )

    def uniform(self) -> Operator:
        """Return an operator of one even kernel near this one, for searches (``contact.adhesive``).

        Its kernel is that of the ``even`` entries with one weight each: the average of the mean weight and the weight in the
        stiffest cell. With the mean weights alone searches may not converge; with those of the stiffest cell they take more
        iterations.
        """
        even, weights = [entry for entry in self.entries if entry in self._mutual], self.weights
        spectra = self.spectra.real
        if even == list(SINGLE) or weights is None:
            return Operator(spectra[:1], self.circulant.real, periodic=self.periodic)
        # the compliance of each cell in a surface that has its weights everywhere
        shares = jnp.concatenate([jnp.ones_like(weights[:1]), weights]).reshape(1 + len(weights), -1)
        my = spectral.padded_shape(weights.shape[-2:], self.periodic)[1]
        mixed = lambda f, each: _sum([f[i] * f[j] * each[k] for i, j, k in even])
        compliance = mixed(shares, jnp.sum(spectral.both_signs(my)[:, None] * spectra, (-2, -1)))
        mean = jnp.mean(shares, 1)
        near = (shares[:, jnp.argmin(compliance)] + mean) / 2.0
        spectrum = mixed(near, spectra)
        circulant = spectrum.at[0, 0].set(jnp.max(spectrum))
        if not all(self.periodic):
            size = lambda f: jnp.sum(jnp.abs(mixed(f, spectra)))
            circulant = self.circulant.real * (size(near) / size(mean))
        return Operator(spectrum[None], circulant, periodic=self.periodic)

    def plus(self, other: Operator) -> Operator:
        """Return K + K' on one grid, for the two surfaces of a contact, which have equal pressure.

        K' has a single kernel, or the weights and entries of K.
        """
        assert other.entries in (SINGLE, self.entries) and other.lift is None and self.entries[0] == SINGLE[0]
        both = lambda a, b: None if a is None or b is None else a + b
        count = len(other.spectra)
        window = None if self.window is None or other.window is None else self.window.plus(other.window)
        return replace(
            self,
            spectra=jnp.concatenate([self.spectra[:count] + other.spectra, self.spectra[count:]]),
            circulant=self.circulant + other.circulant,
            window=window,
            wide=both(self.wide, other.wide),
        )

    def plus_even(self, share: Array | float) -> Operator:
        """Return K + share K_even, with K_even of ``even``."""
        kept = {k for *_, k in self._mutual}
        shares = share * jnp.asarray([float(k in kept) for k in range(len(self.spectra))])
        spectra = self.spectra + shares[:, None, None] * self.spectra.real
        more = lambda tree: jax.tree.map(lambda a: a + share * a.real, tree)
        circulant, lift, window, wide = more((self.circulant, self.lift, self.window, self.wide))
        return replace(self, spectra=spectra, circulant=circulant, lift=lift, window=window, wide=wide)

    def preconditioner(self) -> Linear:
        """Return a cheap approximate inverse; symmetric and positive where K is.

        It is the inverse of the circulant, whose small and negative real parts are raised. A circulant on the grid itself
        makes cells at opposite sides neighbours: for rough surfaces with 35 % of 256 x 256 cells in contact, also at the
        sides, the search then takes 39 iterations; with the circulant on a wider grid (``wide``) it takes 26.
        """
        circulant = self.circulant if self.wide is None else self.wide
        raised = jnp.maximum(circulant.real, FLOOR * jnp.mean(jnp.abs(circulant)))
        if jnp.iscomplexobj(circulant):
            raised = jax.lax.complex(raised, circulant.imag)
        inverse = 1.0 / raised

        def approximate(r: Array) -> Array:
            around = None if self.wide is None else spectral.wide_shape(r.shape, self.periodic)
            return spectral.apply_circulant(inverse, r, around)

        return approximate

    def preconditioner_on_contact(self) -> OnContact:
        """Return the approximate inverse for fields that are zero outside given cells, continued beyond them
        (``continuing``).

        It takes fewer iterations than ``preconditioner``, each of which costs more. That one is returned on periodic grids,
        so that cells divided among devices give the results of one device to rounding; and on grids of ``SMALL`` sides,
        where it takes two iterations more, as much time, and half the time of compilation.
        """
        inverse = self.preconditioner()
        rows, nx = self.circulant.shape[-2:]  # of a spectrum: ny/2 + 1 rows
        plain = all(self.periodic) or max(2 * (rows - 1), nx) <= SMALL
        return unchanged(inverse) if plain else continuing(inverse)

    def confined_compliance(self, shape: tuple[int, ...]) -> Array:
        """Return the displacement of a cell over its own pressure if no other cell moves, (); shape: of the grid.

        It is the harmonic mean of the eigenvalues.
        """
        circulant = self.circulant.real
        inverse = 1.0 / jnp.maximum(circulant, FLOOR * _mean_over_waves(circulant, shape))
        return shape[0] * shape[1] / jnp.sum(spectral.both_signs(shape[1])[:, None] * inverse)

    def cell_ratio(self, shape: tuple[int, ...]) -> Array | float:
        """Return the displacement under pressures that alternate from cell to cell along y, over that along x, ().

        It is the ratio dy/dx of the sides of a cell on a half-space, and 1 on a body that responds locally or where there is
        only one cell along an axis. shape: of the grid.
        """
        (nx, ny), circulant = shape, self.circulant.real
        if min(nx, ny) == 1:
            return 1.0
        floor = FLOOR * _mean_over_waves(circulant, shape)
        along_x, along_y = _shortest(circulant[..., 0, : nx // 2 + 1], nx), _shortest(circulant[..., 0], ny)
        return jnp.maximum(along_y, floor) / jnp.maximum(along_x, floor)

    def cell_compliance(self, shape: tuple[int, ...]) -> Array:
        """Return the displacement of a cell over its own pressure if no other cell has pressure, (); shape: of the grid."""
        return _mean_over_waves(self.circulant.real, shape)

    def window_shape(self, shape: tuple[int, ...]) -> tuple[int, int] | None:
        """Return the shape of a smaller grid for the start of a search within a grid of ``shape``, or None."""
        return None if self.window is None else window_shape(shape, self.periodic)

    def restricted(self, corner: Corner) -> Operator:
        """Return the operator on the window of ``window_shape`` whose first cell is ``corner``, with the weights there and
        without derivative."""
        assert self.window is not None
        if self.weights is None:
            return self.window
        held = jax.lax.stop_gradient(self.weights)
        part = window_shape(held.shape[-2:], self.periodic)
        assert part is not None
        return replace(self.window, weights=cut(held, corner, part))

    def extended(self, shape: tuple[int, ...]) -> Extended:
        """Return an operator on a larger grid that has an inverse, and acts between the cells of ``shape`` as this one, as
        contact with adhesion needs: the periodic operator on the padded grid. Of one even kernel.

        The kernel at offsets that no two cells have is free: it is filled so that kernel and slope are continuous, which
        keeps the spectrum positive for half-spaces and most layers (measured: films of 0.001 to 10 times the modulus of
        their base, and thin ones of 100 times). What is not positive is raised to ``LEAST`` of the largest. On a grid
        that is periodic along both axes the mean is as soft as the softest of the waves.
        """
        assert self.entries == SINGLE and self.symmetric
        padded = spectral.padded_shape(shape, self.periodic)
        spectrum = self.circulant
        if not all(self.periodic):
            kernel = spectral.inverse(self.spectra[0].astype(complex), padded, WRAPPED)
            for axis, wraps in enumerate(self.periodic):
                kernel = kernel if wraps else _filled(kernel, shape[axis], axis)
            spectrum = spectral.transform(kernel, WRAPPED).real
            spectrum = jnp.maximum(spectrum, LEAST * jnp.max(spectrum))
        wrapped = lambda spectrum: Operator(spectrum[None], spectrum, periodic=WRAPPED)
        return Extended(wrapped(spectrum), wrapped(1.0 / spectrum), padded)


class Extended(NamedTuple):
    """An operator on a larger grid of ``shape``, whose first cells are those of the grid, and its inverse; symmetric,
    positive.
    """

    operator: Linear
    inverse: Linear
    shape: tuple[int, int]


def superposed(
    spectra: Sequence[Array], fields: Sequence[Array], at: Operator | Family, lifts: Sequence[Array] | None
) -> Array:
    """Return sum_m K_m f_m, (nx, ny), with one transform back for all of them.

    spectra, and lifts or None: those of each K_m, with the weights and entries of ``at``.
    """
    shape, periodic = fields[0].shape, at.periodic
    weights = [] if at.weights is None else _each(at.weights)
    sides = sorted({j for _, j, _ in at.entries})

    # for each i the products K_k F(f_j p), which are summed before they are transformed back; where spectra are real, real
    # and imaginary parts apart, so that they are not made complex
    parts_of = (lambda wave: (wave,)) if any(map(jnp.iscomplexobj, spectra)) else (lambda w: (w.real, w.imag))
    products: dict[int, list[tuple[Array, ...]]] = {i: [] for i, *_ in at.entries}
    for each, field in zip(spectra, fields, strict=True):
        varying = field if lifts is None else field - jnp.mean(field)
        weighted = [weights[j - 1] * varying if j else varying for j in sides]
        if len(weighted) == 1:
            waves = [spectral.transform(weighted[0], periodic)]
        else:
            waves = _each(spectral.transform(jnp.stack(weighted), periodic))
        kernels, parts = _each(each), dict(zip(sides, map(parts_of, waves), strict=True))
        for i, j, k in at.entries:
            products[i].append(tuple(kernels[k] * part for part in parts[j]))
    sums = [[_sum(list(part)) for part in zip(*products[i], strict=True)] for i in products]
    spectra_of = [part[0] if len(part) == 1 else jax.lax.complex(*part) for part in sums]

    # back to the cells, all at once, and each times its f_i
    if len(spectra_of) == 1:
        moved = [spectral.inverse(spectra_of[0], shape, periodic)]
    else:
        moved = _each(spectral.inverse(jnp.stack(spectra_of), shape, periodic))
    total = _sum([weights[i - 1] * field if i else field for i, field in zip(products, moved, strict=True)])
    if lifts is None:
        return total
    # displacement is from the mean, but for what a mean pressure lifts and, by reciprocity, what lifts the mean
    total = total - jnp.mean(total)
    return total + _sum(
        [lift * jnp.mean(p) + jnp.mean(lift * p) for lift, p in zip(lifts, fields, strict=True)]
    )


def _sum(parts: list[Array]) -> Array:
    return functools.reduce(jnp.add, parts)


def _each(stacked: Array) -> list[Array]:
    """Return the parts of an array along its first axis; in reverse mode they are joined, not added up as slices are."""
    parts = jax.lax.split(stacked, (1,) * len(stacked))
    return [jnp.reshape(part, stacked.shape[1:]) for part in parts]


def _mean_over_waves(circulant: Array, shape: tuple[int, ...]) -> Array:
    """Return the mean of the real circulant of a grid (nx, ny) over all waves, ()."""
    return jnp.sum(spectral.both_signs(shape[1])[:, None] * circulant) / (shape[0] * shape[1])


def _shortest(eigenvalues: Array, n: int) -> Array:
    """Return the eigenvalue of the wave that alternates from cell to cell, from those of the waves 0 to n//2 of n cells.

    The kernel of a circulant has a kink at the offset of half the grid, which changes the eigenvalues of successive waves
    with alternating signs. Of an even number of cells, the mean of the two shortest waves is therefore taken.
    """
    return jnp.mean(eigenvalues[-2:]) if n % 2 == 0 and n > 2 else eigenvalues[-1]


def _filled(kernel: Array, n: int, axis: int) -> Array:
    """Return a periodic even kernel whose values at offsets of n cells and more continue those below.

    By a parabola, even about the largest offset, with the value at offset n - 1 and the slope of the last two.
    """
    m = kernel.shape[axis]
    at = lambda i: jax.lax.index_in_dim(kernel, i, axis)
    offsets = jnp.arange(m) - m / 2
    last = n - 1 - m / 2
    curvature = (at(n - 1) - at(n - 2)) / (2.0 * (last - 0.5))
    shape = [1, 1]
    shape[axis] = m
    parabola = at(n - 1) + curvature * (offsets**2 - last**2).reshape(shape)
    return jnp.where((jnp.abs(offsets) < -last).reshape(shape), parabola, kernel)


@pytree
class Family:
    """Operators K_m on one grid with common weights, of which ``combined`` returns weighted sums.

    spectra (M, n, my/2 + 1, mx), circulants (M, n, ny/2 + 1, nx) and wide (M, ...): as in ``Operator``, circulants of every
    kernel, where f_0, f_1, ... stand before them (``nearest``); weights (n - 1, nx, ny); lifts (M, nx, ny); window: of the
    smaller grid, without weights and window.
    """

    spectra: Array
    circulants: Array
    weights: Array | None = None
    lifts: Array | None = None
    window: Family | None = None
    wide: Array | None = None
    periodic: spectral.Periodic = static(default=spectral.FREE)
    entries: tuple[Entry, ...] = static(default=SINGLE)

    @classmethod
    def of(cls, kernels: Array, periodic: spectral.Periodic = spectral.FREE) -> Family:
        """Return the operators of kernels (M, nx, ny) at offsets (i, j) >= 0, even in both; of one period along a
        periodic axis.

        The window and the wide circulant are without derivative, since only searches use them.
        """
        of = lambda k: (
            spectral.kernel_spectrum(k, periodic)[:, None],
            spectral.circulant_spectrum(k)[:, None],
        )
        held, window, wide = jax.lax.stop_gradient(kernels), None, None
        part = window_shape(kernels.shape[-2:], periodic)
        if part is not None:
            window = cls(*of(held[..., : part[0], : part[1]]), periodic=periodic)
        around = spectral.wide_shape(kernels.shape[-2:], periodic)
        if around is not None:
            wide = spectral.circulant_spectrum(held, around)
        return cls(*of(kernels), window=window, wide=wide, periodic=periodic)

    @classmethod
    def of_spectra(cls, spectra: Array) -> Family:
        """Periodic along both axes, from spectra (M, ny/2 + 1, nx), zero at wavenumber zero but on a rigid base.

        Where it is zero the preconditioner takes the mean for the softest of the waves.
        """
        softest, mean = jnp.max(spectra, (1, 2)), spectra[:, 0, 0]
        circulants = spectra.at[:, 0, 0].set(jnp.where(mean == 0.0, softest, mean))
        return cls(spectra[:, None], circulants[:, None], periodic=WRAPPED)

    @property
    def spectrum(self) -> Array:
        """The spectra of operators of one kernel, (M, my/2 + 1, mx)."""
        return self.spectra[:, 0]

    @property
    def circulant(self) -> Array:
        """The circulants of operators of one kernel, (M, ny/2 + 1, nx)."""
        return self.circulants[:, 0]

    def combined(self, weights: Sequence[Array | float], shares: Array | None = None) -> Operator:
        """Return sum_m weights_m K_m, one weight for each; shares: of f_1, f_2, ... in its circulant, else their means."""
        if shares is None and self.weights is not None:
            shares = jnp.mean(self.weights, (1, 2))
        # term by term: at a time, all members and their tangents would leave the processor's cache
        mixed: Callable[..., Any] = lambda a: (
            None if a is None else sum(w * part for w, part in zip(weights, _each(a), strict=True))
        )
        circulant = mixed(self.circulant)
        if shares is not None:
            circulant = circulant + jnp.tensordot(shares, mixed(self.circulants[:, 1:]), 1)
        window = None if self.window is None else jax.lax.stop_gradient(self.window.combined(weights, shares))
        lift, wide = mixed(self.lifts), mixed(self.wide)
        return Operator(
            mixed(self.spectra), circulant, self.weights, lift, window, wide, self.periodic, self.entries
        )

    def nearest(self, pressure: Array) -> Array:
        """Return the spectra of the periodic operators nearest to all K_m under a pressure, (M, ny/2 + 1, nx)."""
        if self.weights is None:
            return self.circulant
        total = jnp.sum(pressure)
        shares = jnp.sum(self.weights * pressure, (1, 2)) / jnp.where(total > 0.0, total, 1.0)
        return self.circulant + jnp.einsum("n,mnyx->myx", shares, self.circulants[:, 1:])

    def superposed(self, fields: Array) -> Array:
        """Return the displacement sum_m K_m f_m for fields (n, nx, ny), one for each of the last n members."""
        if not len(fields):
            return jnp.zeros(fields.shape[-2:])
        last = lambda a: None if a is None else _each(a)[-len(fields) :]
        return superposed(last(self.spectra), _each(fields), self, last(self.lifts))


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


def unchanged(inverse: Linear) -> OnContact:
    """Return an inverse on the grid as one on a contact, without regard to its cells."""
    return lambda field, cells: inverse(field)


def continuing(inverse: Linear) -> OnContact:
    """Return E^T K^-1 E, not yet zero outside the contact, from an inverse on the grid; symmetric.

    If the cells are divided among devices E is left out: its averages would be exchanged.
    """
    if spectral.devices() > 1:
        return unchanged(inverse)

    def on_contact(field: Array, cells: Array) -> Array:
        # r_l of every level, 1 - c_l of all but the coarsest
        fields, shares = [field], [cells.astype(float)]
        for _ in range(LEVELS):
            fields.append(_averaged(fields[-1]))
        for _ in range(LEVELS - 1):
            shares.append(_averaged(shares[-1]))
        outside = [1.0 - share for share in shares]

        # E r, from the coarsest level to the finest
        continued = fields[-1]
        for r, free in zip(fields[-2::-1], outside[::-1], strict=True):
            continued = r + free * _spread(continued, r.shape)

        # E^T z: z_(l+1) = D (1 - c_l) z_l to the coarsest level, and the sum of all back to the finest
        moved = [inverse(continued)]
        for free in outside:
            moved.append(_averaged(free * moved[-1]))
        gathered = moved[-1]
        for z in moved[-2::-1]:
            gathered = z + _spread(gathered, z.shape)
        return gathered

    return on_contact


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


# A window of the grid that holds the contact.
#
# Most contacts leave a good part of the grid free, so that the search for the pressure may run on a smaller grid: the window
# of the operator, put around the contact. The solution in the window is exact there. The search always ends on the whole
# grid, where it goes on if the window was too small.


def window_shape(
    shape: tuple[int, ...], periodic: spectral.Periodic = spectral.FREE
) -> tuple[int, int] | None:
    """Return the shape of a window: about three quarters of the grid along axes that are not periodic, at half the cost.

    There is none, None, on grids of ``SMALL`` sides, where it saves no time and doubles what is compiled of each search; nor
    if the cells are divided among devices, where each search would move its part of the grid.
    """
    if max(shape) <= SMALL or spectral.devices() > 1:
        return None
    sides = list(shape)
    for axis, (n, wraps) in enumerate(zip(shape, periodic, strict=True)):
        if not wraps:
            sides[axis] = min(n, 2 * scipy.fft.next_fast_len(-(-3 * n // 8)))
    return sides[0], sides[1]


def place(mask: Array, shape: tuple[int, int]) -> tuple[Corner, Array]:
    """Return the first cell of a window around the cells of the mask, and whether all of them are within it; False for an
    empty mask.
    """
    corner, fits = [], jnp.asarray(True)
    for axis, length in enumerate(shape):
        touched, n = jnp.any(mask, 1 - axis), mask.shape[axis]
        first, last = jnp.argmax(touched), n - 1 - jnp.argmax(touched[::-1])
        width = last - first + 1
        corner.append(jnp.clip(first - (length - width) // 2, 0, n - length))
        fits = fits & (width <= length)
    return (corner[0], corner[1]), fits


def cut(field: Array, corner: Corner, shape: tuple[int, int]) -> Array:
    """Return the part of a field (..., nx, ny) in the window."""
    leading = field.shape[:-2]
    return jax.lax.dynamic_slice(field, (*[0] * len(leading), *corner), (*leading, *shape))


def paste(part: Array, corner: Corner, shape: tuple[int, ...]) -> Array:
    """Return a field of a shape (..., nx, ny) with this part in the window, and zero outside."""
    start = (*[0] * len(shape[:-2]), *corner)
    return jax.lax.dynamic_update_slice(jnp.zeros(shape, part.dtype), part, start)
