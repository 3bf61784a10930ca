"""Operators of an even kernel on a grid, by FFT, zero-padded along axes that are not periodic; and families of them."""

from __future__ import annotations

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact.operators import spectral
from jaxcontact.operators.base import Corner, Extended, Family, InvertibleOperator, Linear, SplitOperator

FLOOR = 1e-3  # of the largest eigenvalue ratio allowed in the preconditioner
LEAST = 1e-6  # of the largest eigenvalue that an extended operator has
WRAPPED: spectral.Periodic = (True, True)


@pytree
class Convolution(InvertibleOperator):
    """An even kernel, by its spectra, which are real.

    spectrum (my/2 + 1, mx): on the padded grid; circulant (ny/2 + 1, nx): of the periodic operator nearest to
    it on the grid itself; window: the same kernel on a smaller grid, or None; periodic: axes without padding; wide: as
    circulant, on the grid of ``spectral.wide_shape``, for the preconditioner alone, or None.
    """

    spectrum: Array
    circulant: Array
    window: Convolution | None
    periodic: spectral.Periodic = static(default=spectral.FREE)
    wide: Array | None = None

    symmetric = True

    def __call__(self, pressure: Array) -> Array:
        return spectral.convolve(self.spectrum, pressure, self.periodic)

    def transpose(self) -> Convolution:
        return self

    def preconditioner(self) -> Linear:
        """The inverse of a circulant, its small and negative eigenvalues raised.

        On the grid itself cells at opposite sides would be neighbours: of rough surfaces with 35 % of 256 x 256 cells in
        contact, also at the sides, the search would take 39 iterations; with the wide circulant it takes 26.
        """
        circulant = self.circulant if self.wide is None else self.wide
        shape = lambda r: None if self.wide is None else spectral.wide_shape(r.shape, self.periodic)
        inverse = 1.0 / jnp.maximum(circulant, FLOOR * jnp.mean(jnp.abs(circulant)))
        return lambda r: spectral.apply_circulant(inverse, r, shape(r))

    def confined_compliance(self, shape: tuple[int, ...]) -> Array:
        return confined_compliance(self.circulant, shape)

    def cell_ratio(self, shape: tuple[int, ...]) -> Array | float:
        return cell_ratio(self.circulant, shape)

    def cell_compliance(self, shape: tuple[int, ...]) -> Array:
        return _mean_over_waves(self.circulant, shape)

    def extended(self, shape: tuple[int, ...]) -> Extended:
        """Return the periodic operator on the padded grid and its inverse.

        The kernel at offsets that no two cells have is free: it is filled so that kernel and slope are continuous, which
        keeps the spectrum positive for half-spaces and most layers (measured: films of 0.001 to 10 times the modulus of
        their base, and thin ones of 100 times). What is not positive is raised to ``LEAST`` of the largest. On a grid
        that is periodic along both axes the mean is as soft as the softest of the waves.
        """
        padded = spectral.padded_shape(shape, self.periodic)
        spectrum = self.circulant
        if not all(self.periodic):
            kernel = spectral.inverse(self.spectrum.astype(complex), padded, WRAPPED)
            for axis, wraps in enumerate(self.periodic):
                kernel = kernel if wraps else _filled(kernel, shape[axis], axis)
            spectrum = spectral.transform(kernel, WRAPPED).real
            spectrum = jnp.maximum(spectrum, LEAST * jnp.max(spectrum))
        return Extended(_Wrapped(spectrum), _Wrapped(1.0 / spectrum), padded)

    def window_shape(self, shape: tuple[int, ...]) -> tuple[int, int] | None:
        none = self.window is None or spectral.devices() > 1
        return None if none else spectral.window_shape(shape, self.periodic)

    def restricted(self, corner: Corner) -> Convolution:
        assert self.window is not None
        return self.window

    def even(self) -> Convolution:
        return self

    def plus_even(self, share: Array | float) -> Convolution:
        return jax.tree.map(lambda a: (1.0 + share) * a, self)


@pytree
class _Wrapped:
    """A periodic operator by its spectrum (my/2 + 1, mx), on fields (mx, my)."""

    spectrum: Array

    def __call__(self, field: Array) -> Array:
        return spectral.convolve(self.spectrum, field, WRAPPED)


@pytree
class Convolutions(Family):
    """members: a ``Convolution`` whose leaves have a first axis, over the members."""

    members: Convolution

    @classmethod
    def of(cls, kernels: Array, periodic: spectral.Periodic = spectral.FREE) -> Convolutions:
        """Return the operators of kernels (m, nx, ny) at offsets (i, j) >= 0, even in both; of one period along a
        periodic axis.

        The window and the wide circulant are without derivative, since only searches use them. There is no window if the
        cells are divided among devices: each search would move its part of the grid.
        """
        nx, ny = spectral.window_shape(kernels.shape[-2:], periodic)
        part = jax.lax.stop_gradient(kernels[..., :nx, :ny])
        window = _members(part, None, periodic) if spectral.devices() == 1 else None
        around = spectral.wide_shape(kernels.shape[-2:], periodic)
        held = jax.lax.stop_gradient(kernels)
        wide = None if around is None else spectral.circulant_spectrum(held, around)
        return cls(replace(_members(kernels, window, periodic), wide=wide))

    @classmethod
    def of_spectra(cls, spectra: Array, *, with_mean: bool = False) -> Convolutions:
        """Periodic along both axes, from spectra (m, ny/2 + 1, nx).

        They are zero at wavenumber zero, but ``with_mean``; the preconditioner then takes the mean for the softest of the
        waves.
        """
        if with_mean:
            return cls(Convolution(spectra, spectra, None, (True, True)))
        softest = jnp.max(spectra, (1, 2))
        return cls(Convolution(spectra, spectra.at[:, 0, 0].set(softest), None, (True, True)))

    def combined(self, weights: Sequence[Array | float]) -> Convolution:
        # term by term: at a time, all members and their tangents would leave the processor's cache
        mixed = lambda a: sum(w * part for w, part in zip(weights, _each(a), strict=True))
        return jax.tree.map(mixed, self.members)

    def circulants(self, pressure: Array) -> Array:
        return self.members.circulant

    def total(self, fields: Array) -> Array:
        shape, periodic = fields.shape[-2:], self.members.periodic
        if not len(fields):
            return jnp.zeros(shape)
        spectra = _each(self.members.spectrum)[-len(fields) :]
        each = [spectral.transform(f, periodic) for f in _each(fields)]
        summed = lambda parts: sum(part * a for part, a in zip(spectra, parts, strict=True))
        real, imaginary = summed([a.real for a in each]), summed([a.imag for a in each])
        return spectral.inverse(jax.lax.complex(real, imaginary), shape, periodic)


def _each(stacked: Array) -> list[Array]:
    """Return the parts of an array along its first axis; in reverse mode they are joined, not added up as slices are."""
    parts = jax.lax.split(stacked, (1,) * len(stacked))
    return [jnp.reshape(part, stacked.shape[1:]) for part in parts]


def confined_compliance(circulant: Array, shape: tuple[int, ...]) -> Array:
    """Return ``Operator.confined_compliance`` from the real circulant of a grid (nx, ny): the harmonic mean."""
    floor = FLOOR * _mean_over_waves(circulant, shape)
    inverse = 1.0 / jnp.maximum(circulant, floor)
    return shape[0] * shape[1] / jnp.sum(spectral.both_signs(shape[1])[:, None] * inverse)


def cell_ratio(circulant: Array, shape: tuple[int, ...]) -> Array | float:
    """Return ``Operator.cell_ratio`` from the real circulant of a grid (nx, ny): the ratio of the shortest waves.

    1 where there is only one cell along an axis.
    """
    nx, ny = shape
    if min(nx, ny) == 1:
        return 1.0
    floor = FLOOR * _mean_over_waves(circulant, shape)
    along_x, along_y = _shortest(circulant[..., 0, : nx // 2 + 1], nx), _shortest(circulant[..., 0], ny)
    return jnp.maximum(along_y, floor) / jnp.maximum(along_x, floor)


def _shortest(eigenvalues: Array, n: int) -> Array:
    """Return the eigenvalue of the wave that alternates from cell to cell, from those of the waves 0 to n//2 of n cells.

    The kernel of a circulant has a kink at the offset of half the grid, which changes the eigenvalues of successive waves
    with alternating signs. Of an even number of cells, the mean of the two shortest waves is therefore taken.
    """
    return jnp.mean(eigenvalues[-2:]) if n % 2 == 0 and n > 2 else eigenvalues[-1]


def _mean_over_waves(circulant: Array, shape: tuple[int, ...]) -> Array:
    """Return the mean of the real circulant of a grid (nx, ny) over all waves, ()."""
    return jnp.sum(spectral.both_signs(shape[1])[:, None] * circulant) / (shape[0] * shape[1])


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


def _members(kernels: Array, window: Convolution | None, periodic: spectral.Periodic) -> Convolution:
    spectrum = spectral.kernel_spectrum(kernels, periodic)
    return Convolution(spectrum, spectral.circulant_spectrum(kernels), window, periodic)


# Operators of a kernel that is not even: those of an indenter that moves over a body with a memory.


@pytree
class Moving(SplitOperator):
    """A kernel that is not even: all as in ``Convolution``, but complex and without a window."""

    spectrum: Array
    circulant: Array
    periodic: spectral.Periodic = static(default=spectral.FREE)

    symmetric = False

    def __call__(self, pressure: Array) -> Array:
        return spectral.convolve(self.spectrum, pressure, self.periodic)

    def transpose(self) -> Moving:
        """The same with the motion reversed."""
        return jax.tree.map(jnp.conj, self)

    def preconditioner(self) -> Linear:
        """The inverse of the circulant, its real part raised to a floor above zero."""
        floor = FLOOR * jnp.mean(jnp.abs(self.circulant))
        inverse = 1.0 / jax.lax.complex(jnp.maximum(self.circulant.real, floor), self.circulant.imag)
        return lambda r: spectral.apply_circulant(inverse, r)

    def confined_compliance(self, shape: tuple[int, ...]) -> Array:
        return confined_compliance(self.circulant.real, shape)

    def cell_ratio(self, shape: tuple[int, ...]) -> Array | float:
        return cell_ratio(self.circulant.real, shape)

    def window_shape(self, shape: tuple[int, ...]) -> None:
        """None: the search runs on the whole grid."""
        return None

    def restricted(self, corner: Corner) -> Moving:
        """The whole: there is no window."""
        return self

    def even(self) -> Convolution:
        return Convolution(self.spectrum.real, self.circulant.real, None, self.periodic)

    def odd(self) -> Moving:
        return jax.tree.map(lambda a: 1j * a.imag, self)

    def plus_even(self, share: Array | float) -> Moving:
        return jax.tree.map(lambda a: a + share * a.real, self)
