"""Discrete convolution with even kernels by zero-padded FFT (DC-FFT).

A kernel is given by its values at non-negative offsets, K[i, j] = K(i dx, j dy), i < nx, j < ny, and
is even in both. Its spectrum on the padded grid is then real. Only rows that are not zero are
transformed, and only rows that are wanted are transformed back (exact, and about 1.5 times faster).
Spectra are stored with the axes swapped, (..., my/2 + 1, mx), so that every transform runs along the
last axis. Source: S. B. Liu, Q. Wang, G. Liu, Wear 243 (2000) 101, the DC-FFT.

Along a periodic axis there is no padding: its length is that of the grid, odd or even, and the kernel's values are those
at all offsets of a period.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import scipy
from jax import Array
from jax.sharding import PartitionSpec

# Transforms of fields whose cells are divided among devices.
#
# A field (nx, ny) is divided along x, its spectrum (my/2 + 1, mx) along the wavenumbers of y. Each device transforms
# the rows that it has along y, exchanges blocks with all others once (``all_to_all``), so that it then has all x for
# a part of the wavenumbers, and transforms along x. No device ever holds a whole field. The compiler alone would
# gather the whole field on every device before each transform.
#
# The division is requested by a mesh of devices with the axis ``AXIS``, which is set around a call:
#
#     with jax.set_mesh(jax.sharding.Mesh(jax.devices(), ("cells",))): ...
#
# Source: the slab decomposition, for example of M. Frigo, S. G. Johnson, Proc. IEEE 93 (2005) 216, section on
# parallel transforms.


AXIS = "cells"
"""The name of the axis of a mesh over whose devices the cells of a grid are divided."""


def devices() -> int:
    """Return the number of devices among which the cells of a grid are divided: 1 without a mesh that has ``AXIS``.

    Raises ValueError for an axis of explicit type, with which jax asks for the division of every intermediate array.
    """
    mesh = jax.sharding.get_abstract_mesh()
    if AXIS in mesh.explicit_axes:
        raise ValueError(
            f'mesh: expected an axis "{AXIS}" of type Auto, as of jax.sharding.Mesh, found type Explicit'
        )
    return mesh.shape[AXIS] if AXIS in mesh.auto_axes else 1


def _divided(function: Callable[[Array], Array], field: Array) -> Array:
    """Apply a function to the parts of an array (..., m, n) that is divided along its axis m; so is the result."""
    parts = PartitionSpec(*(None for _ in field.shape[:-2]), AXIS, None)
    return jax.shard_map(function, in_specs=parts, out_specs=parts, axis_names={AXIS})(field)


def _turned(rows: Array) -> Array:
    """Return the part (..., n/d, m) of the transposed array on this device, from its part (..., m/d, n)."""
    first = rows.ndim - 2
    return jnp.swapaxes(jax.lax.all_to_all(rows, AXIS, first + 1, first, tiled=True), -1, -2)


def _filled(array: Array, axis: int, count: int) -> Array:
    """Return an array with zeros after it along an axis (-1 or -2), so that its length is a multiple of ``count``."""
    fill = [(0, -array.shape[axis] % count), (0, 0)]
    return jnp.pad(array, [(0, 0)] * (array.ndim - 2) + (fill if axis == -2 else fill[::-1]))


def distributed_transform(field: Array, padded: tuple[int, int]) -> Array:
    """Return the spectrum (..., my/2 + 1, mx) of fields (..., nx, ny) padded with zeros to (mx, my)."""
    mx, my = padded
    count = devices()

    def of_part(part: Array) -> Array:
        rows = jnp.fft.rfft(part, n=my, axis=-1)
        return jnp.fft.fft(_turned(_filled(rows, -1, count))[..., : field.shape[-2]], n=mx, axis=-1)

    return _divided(of_part, _filled(field, -2, count))[..., : my // 2 + 1, :]


def distributed_inverse(spectrum: Array, shape: tuple[int, ...], my: int) -> Array:
    """Return the (..., nx, ny) part of the field, of length my along y, with a spectrum (..., my/2 + 1, mx)."""
    nx, ny = shape
    count = devices()

    def of_part(part: Array) -> Array:
        rows = jnp.fft.ifft(part, axis=-1)[..., :nx]
        return jnp.fft.irfft(_turned(_filled(rows, -1, count))[..., : my // 2 + 1], n=my, axis=-1)[..., :ny]

    return _divided(of_part, _filled(spectrum, -2, count))[..., :nx, :]


Periodic = tuple[bool, bool]  # along x, along y
MARGIN = 8  # cells around a grid, over which the inverse of a response falls to little (with 64 it serves no better)
FREE: Periodic = (False, False)


def padded_shape(shape: tuple[int, ...], periodic: Periodic = FREE) -> tuple[int, int]:
    """The smallest fast even lengths that keep the convolution from wrapping around: >= 2 n - 1.

    Along a periodic axis, where it shall wrap around: n.
    """
    (nx, ny), (x, y) = shape, periodic
    return nx if x else 2 * scipy.fft.next_fast_len(nx), ny if y else 2 * scipy.fft.next_fast_len(ny)


def kernel_spectrum(kernel: Array, periodic: Periodic = FREE) -> Array:
    """Spectrum (..., my/2 + 1, mx), real, of kernels (..., nx, ny) for ``convolve``."""
    mx, my = padded_shape(kernel.shape[-2:], periodic)
    whole = _all_offsets(kernel, my, periodic[1])
    if devices() > 1:
        whole = jnp.swapaxes(_all_offsets(jnp.swapaxes(whole, -1, -2), mx, periodic[0]), -1, -2)
        return distributed_transform(whole, (mx, my)).real
    rows = jnp.swapaxes(jnp.fft.rfft(whole).real, -1, -2)
    half = jnp.fft.rfft(_all_offsets(rows, mx, periodic[0])).real
    return jnp.concatenate([half, half[..., (mx - 1) // 2 : 0 : -1]], -1)


def _all_offsets(kernel: Array, length: int, periodic: bool) -> Array:
    """A kernel that is even in its last axis at the offsets of both signs, (..., length).

    Offsets that no pair of cells has are zero.
    """
    if periodic:
        return kernel
    middle = jnp.zeros((*kernel.shape[:-1], length - 2 * kernel.shape[-1] + 1))
    return jnp.concatenate([kernel, middle, kernel[..., :0:-1]], -1)


def transform(field: Array, periodic: Periodic = FREE) -> Array:
    """Spectrum (..., my/2 + 1, mx) of fields (..., nx, ny), zero-padded."""
    mx, my = padded_shape(field.shape[-2:], periodic)
    if field.size == 0:  # see ``inverse``
        return jnp.zeros((*field.shape[:-2], my // 2 + 1, mx), complex)
    if devices() > 1:
        return distributed_transform(field, (mx, my))
    rows = jnp.swapaxes(jnp.fft.rfft(field, n=my, axis=-1), -1, -2)
    return jnp.fft.fft(rows, n=mx, axis=-1)


def inverse(spectrum: Array, shape: tuple[int, ...], periodic: Periodic = FREE) -> Array:
    """The (..., nx, ny) part of the field with this spectrum.

    No transform is made of no fields, as of an elastic body that remembers none: on a machine with one core, jaxlib 0.10.1
    does not find LAPACK for a program that contains one.
    """
    (nx, ny), (_, my) = shape, padded_shape(shape, periodic)
    if spectrum.size == 0:
        return jnp.zeros((*spectrum.shape[:-2], nx, ny))
    if devices() > 1:
        return distributed_inverse(spectrum, shape, my)
    rows = jnp.fft.ifft(spectrum, axis=-1)[..., :nx]
    return jnp.fft.irfft(jnp.swapaxes(rows, -1, -2), n=my, axis=-1)[..., :ny]


def convolve(spectrum: Array, field: Array, periodic: Periodic = FREE) -> Array:
    """sum_j K(i - j) f_j over the cells of the grid, (..., nx, ny); spectrum from ``kernel_spectrum``."""
    return inverse(scaled(spectrum, transform(field, periodic)), field.shape[-2:], periodic)


def scaled(spectrum: Array, other: Array) -> Array:
    """Return the product of a spectrum, which is real for even kernels, and a complex one.

    A real one is not made complex first, which takes as long as the product.
    """
    if jnp.iscomplexobj(spectrum):
        return spectrum * other
    return jax.lax.complex(spectrum * other.real, spectrum * other.imag)


def both_signs(my: int) -> Array:
    """Return the multiplicity of each row of a spectrum, (my/2 + 1,): one at zero and at the highest wavenumber of even
    my."""
    row = jnp.arange(my // 2 + 1)
    return jnp.where((row == 0) | (2 * row == my), 1.0, 2.0)


def circulant_spectrum(kernel: Array, shape: tuple[int, int] | None = None) -> Array:
    """Spectrum (..., my/2 + 1, mx) of the periodic operator nearest to the kernel on the grid itself, or one of a shape.

    It takes the offsets up to half the grid (Strang's circulant): cheap, and close enough to
    the true operator for a preconditioner.
    """
    for axis, m in zip((kernel.ndim - 2, kernel.ndim - 1), shape or kernel.shape[-2:], strict=True):
        near = jax.lax.slice_in_dim(kernel, 0, m // 2 + 1, axis=axis)
        far = jax.lax.slice_in_dim(kernel, 1, (m + 1) // 2, axis=axis)
        kernel = jnp.concatenate([near, jnp.flip(far, axis)], axis)
    return kernel_spectrum(kernel, (True, True))


def apply_circulant(spectrum: Array, field: Array, shape: tuple[int, int] | None = None) -> Array:
    """Multiply by a circulant spectrum on the grid itself, or one of a shape around it, (..., nx, ny) -> (..., nx, ny)."""
    nx, ny = field.shape[-2:]
    mx, my = shape or (nx, ny)
    if devices() > 1:
        return distributed_inverse(scaled(spectrum, distributed_transform(field, (mx, my))), (nx, ny), my)
    rows = jnp.swapaxes(jnp.fft.rfft(field, n=my, axis=-1), -1, -2)
    rows = jnp.fft.ifft(scaled(spectrum, jnp.fft.fft(rows, n=mx, axis=-1)), axis=-1)[..., :nx]
    return jnp.fft.irfft(jnp.swapaxes(rows, -1, -2), n=my, axis=-1)[..., :ny]


def wide_shape(shape: tuple[int, ...], periodic: Periodic = FREE) -> tuple[int, int] | None:
    """Return the shape of a grid that is wider by at least ``MARGIN`` cells along axes that are not periodic.

    A circulant on it hardly joins opposite sides of the grid. None if there is no such axis, or one of too few cells.
    """
    sides = list(shape)
    for axis, (n, wraps) in enumerate(zip(shape, periodic, strict=True)):
        if not wraps:
            sides[axis] = 2 * scipy.fft.next_fast_len((n + 1) // 2 + MARGIN // 2)
            if sides[axis] // 2 >= n:  # kernels are known at offsets below n
                return None
    return None if all(periodic) else (sides[0], sides[1])
