"""The coupled operator: tractions in three directions -> displacements in three directions, by zero-padded FFT.

    | u_x |   | xx   xy   x  |   | q_x |
    | u_y | = | xy   yy   y  | * | q_y |
    | u_z |   | -x   -y   zz |   | p   |

xx, yy, zz are even in both offsets, xy odd in both, x and y odd in the offset along them alone (theory:
``response.coefficients``). So the spectra of x and y are imaginary, of all others real, and each
is kept as one real array. For similar solids x and y vanish, and need not be kept at all. In plane strain, with one
cell along a periodic y, xy and y vanish, and y is not padded.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, static
from jaxcontact.operators import spectral
from jaxcontact.operators.operator import FLOOR, Corner, Linear, Operator, window_shape
from jaxcontact.response.coefficients import SurfaceKernels


@pytree
class Tangential:
    """Spectra of tangential kernels: plane (..., 3, my/2 + 1, mx) of xx, yy and xy; coupling (..., 2, my/2 + 1, mx), the
    imaginary parts of x and y, or None; circulant (..., ny/2 + 1, nx) of the mean of xx and yy, window and periodic, as
    in ``Operator``."""

    plane: Array
    coupling: Array | None
    circulant: Array
    window: Tangential | None
    periodic: spectral.Periodic = static(default=spectral.FREE)

    @classmethod
    def of(
        cls, kernels: SurfaceKernels, *, coupled: bool, periodic: spectral.Periodic = spectral.FREE
    ) -> Tangential:
        """Return the operator of coefficients (..., nx, ny); along a periodic axis they are those of one cell.

        The window is without derivative, since only searches use it.
        """
        part, window = window_shape(kernels.xx.shape[-2:], periodic), None
        if part is not None:
            held = jax.tree.map(lambda a: jax.lax.stop_gradient(a[..., : part[0], : part[1]]), kernels)
            window = cls._of(held, None, coupled, periodic)
        return cls._of(kernels, window, coupled, periodic)

    @classmethod
    def _of(
        cls, k: SurfaceKernels, window: Tangential | None, coupled: bool, periodic: spectral.Periodic
    ) -> Tangential:
        of = lambda kernel, along_x, along_y: spectrum(kernel, along_x, along_y, periodic)
        plane = [of(k.xx, 1, 1).real, of(k.yy, 1, 1).real, of(k.xy, -1, -1).real]
        coupling = [of(k.x, -1, 1).imag, of(k.y, 1, -1).imag] if coupled else None
        return cls(
            jnp.stack(plane, -3),
            None if coupling is None else jnp.stack(coupling, -3),
            spectral.circulant_spectrum((k.xx + k.yy) / 2.0),
            window,
            periodic,
        )

    def transform(self, fields: Array) -> Array:
        """Spectra of fields (..., nx, ny)."""
        return spectral.transform(fields, self.periodic)

    def inverse(self, spectra: Array, shape: tuple[int, ...]) -> Array:
        """The fields of spectra, (..., nx, ny)."""
        return spectral.inverse(spectra, shape, self.periodic)


def spectrum(
    kernel: Array, parity_x: int, parity_y: int, periodic: spectral.Periodic = spectral.FREE
) -> Array:
    """Spectrum (..., my/2 + 1, mx) of kernels (..., nx, ny) at offsets >= 0; parity: 1 even, -1 odd in the offset."""
    padded = spectral.padded_shape(kernel.shape[-2:], periodic)
    for axis, length, parity in ((-2, padded[0], parity_x), (-1, padded[1], parity_y)):
        kernel = jnp.moveaxis(kernel, axis, -1)
        middle = jnp.zeros((*kernel.shape[:-1], length - 2 * kernel.shape[-1] + 1))
        kernel = jnp.concatenate([kernel, middle, parity * kernel[..., :0:-1]], -1)
        kernel = jnp.moveaxis(kernel, -1, axis)
    return spectral.transform(kernel, (True, True))


@pytree
class TractionOperator:
    """Traction on the cells -> displacement in three directions, scaled.

    normal: the entry zz, p -> displacement into the body under it; tangential: all others. q: tangential traction on the
    body, (2, nx, ny); p: pressure, (nx, ny).
    """

    normal: Operator
    tangential: Tangential

    def plus(self, other: TractionOperator) -> TractionOperator:
        """The sum of two surfaces under one traction, of one grid and both with couplings or both without."""
        tangential = jax.tree.map(jnp.add, self.tangential, other.tangential)
        return TractionOperator(self.normal.plus(other.normal), tangential)

    def tangential_from_tangential(self, q: Array) -> Array:
        """Tangential displacement under a tangential traction, (2, nx, ny); symmetric and positive."""
        return self.tangential.inverse(
            self._tangential_from_tangential(self.tangential.transform(q)), q.shape[-2:]
        )

    def tangential_from_normal(self, p: Array) -> Array:
        """Tangential displacement under a pressure, (2, nx, ny)."""
        if self.tangential.coupling is None:
            return jnp.zeros((2, *p.shape))
        coupling, pressed = self.tangential.coupling, self.tangential.transform(p)
        return self.tangential.inverse(
            jax.lax.complex(-coupling * pressed.imag, coupling * pressed.real), p.shape
        )

    def normal_from_tangential(self, q: Array) -> Array:
        """Normal displacement under a tangential traction, (nx, ny): the transpose of ``tangential_from_normal``."""
        if self.tangential.coupling is None:
            return jnp.zeros(q.shape[-2:])
        return self.tangential.inverse(
            self._normal_from_tangential(self.tangential.transform(q)), q.shape[-2:]
        )

    def displaced(self, q: Array) -> tuple[Array, Array]:
        """Return ``tangential_from_tangential`` and ``normal_from_tangential`` of a traction."""
        if self.tangential.coupling is None:
            return self.tangential_from_tangential(q), self.normal_from_tangential(q)
        spectra = self.tangential.transform(q)
        spectra = jnp.concatenate(
            [self._tangential_from_tangential(spectra), self._normal_from_tangential(spectra)[None]]
        )
        x, y, z = self.tangential.inverse(spectra, q.shape[-2:])
        return jnp.stack([x, y]), z

    def _tangential_from_tangential(self, spectra: Array) -> Array:
        """``tangential_from_tangential`` of spectra of a traction, (2, ...)."""
        xx, yy, xy = self.tangential.plane
        # real and imaginary parts apart: the real spectra of the kernels are not made complex
        moved = lambda x, y: jnp.stack([xx * x + xy * y, xy * x + yy * y])
        return jax.lax.complex(moved(*spectra.real), moved(*spectra.imag))

    def _normal_from_tangential(self, spectra: Array) -> Array:
        """``normal_from_tangential`` of spectra of a traction, (...)."""
        assert self.tangential.coupling is not None
        moved = lambda part: jnp.sum(self.tangential.coupling * part, 0)
        return jax.lax.complex(moved(spectra.imag), -moved(spectra.real))

    def preconditioner(self, added: Array) -> Linear:
        """Return a cheap approximate inverse of ``tangential_from_tangential`` plus constants (m,); symmetric, positive.

        Each acts on fields of its own, (m, 2, nx, ny): the inverse of the circulant plus a constant, whose small and
        negative eigenvalues are raised.
        """
        raised = jnp.maximum(self.tangential.circulant, FLOOR * self.local())
        inverse = (1.0 / (raised + added[:, None, None]))[:, None]
        return lambda r: spectral.apply_circulant(inverse, r)

    def local(self) -> Array:
        """The mean eigenvalue of ``tangential_from_tangential``, ()."""
        return jnp.mean(jnp.abs(self.tangential.circulant))

    def largest(self) -> Array:
        """Return roughly the largest eigenvalue of ``tangential_from_tangential``, ()."""
        return jnp.max(self.tangential.circulant)

    def coupling(self) -> Array:
        """Return roughly the norm of ``normal_from_tangential`` over that of ``tangential_from_tangential``, ()."""
        if self.tangential.coupling is None:
            return jnp.zeros(())
        return jnp.max(jnp.abs(self.tangential.coupling)) / self.largest()

    def window_shape(self, shape: tuple[int, ...]) -> tuple[int, int] | None:
        """Return the shape of a smaller grid for the start of a search within a grid of ``shape``, or None."""
        return None if self.tangential.window is None else self.normal.window_shape(shape)

    def restricted(self, corner: Corner) -> TractionOperator:
        """Return the same operator on the window of ``window_shape`` at a corner of the grid, without derivative."""
        assert self.tangential.window is not None
        return TractionOperator(self.normal.restricted(corner), self.tangential.window)


@pytree
class CoupledFamily:
    """Several tangential operators on one grid, to be mixed; members: their leaves have a first axis."""

    members: Tangential

    def combined(self, weights: Array) -> Tangential:
        """sum_m weights_m K_m, one weight for each."""
        return jax.tree.map(lambda a: jnp.tensordot(weights, a, 1), self.members)

    def tangential_from_earlier(self, fields: Array) -> Array:
        """Tangential displacement under all but the first member's fields, (M, 3, nx, ny) of q_x, q_y and p."""
        total = jnp.zeros((2, *fields.shape[-2:]))
        if not fields.shape[0]:
            return total
        x, y, p = jnp.moveaxis(self.members.transform(fields), 1, 0)
        xx, yy, xy = jnp.moveaxis(self.members.plane[1:], 1, 0)
        moved = jnp.stack([jnp.sum(xx * x + xy * y, 0), jnp.sum(xy * x + yy * y, 0)])
        if self.members.coupling is not None:
            moved = moved + jnp.sum(1j * self.members.coupling[1:] * p[:, None], 0)
        return self.members.inverse(moved, fields.shape[-2:])

    def normal_from_earlier(self, fields: Array) -> Array:
        """Normal displacement under the tangential ones of those fields, (nx, ny)."""
        if not fields.shape[0] or self.members.coupling is None:
            return jnp.zeros(fields.shape[-2:])
        tangential = self.members.transform(fields[:, :2])
        moved = jnp.sum(-1j * self.members.coupling[1:] * tangential, (0, 1))
        return self.members.inverse(moved, fields.shape[-2:])
