"""Transforms of fields whose cells are divided among devices.

A field (nx, ny) is divided along x, its spectrum (my/2 + 1, mx) along the wavenumbers of y. Each device transforms the
rows that it has along y, exchanges blocks with all others once (``all_to_all``), so that it then has all x for a part of
the wavenumbers, and transforms along x. No device ever holds a whole field. The compiler alone would gather the whole
field on every device before each transform.

The division is requested by a mesh of devices with the axis ``AXIS``, which is set around a call:

    with jax.set_mesh(jax.sharding.Mesh(jax.devices(), ("cells",))): ...

Source: the slab decomposition, for example of M. Frigo, S. G. Johnson, Proc. IEEE 93 (2005) 216, section on parallel
transforms.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array
from jax.sharding import PartitionSpec

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


def transform(field: Array, padded: tuple[int, int]) -> Array:
    """Return the spectrum (..., my/2 + 1, mx) of fields (..., nx, ny) padded with zeros to (mx, my)."""
    mx, my = padded
    count = devices()

    def of_part(part: Array) -> Array:
        rows = jnp.fft.rfft(part, n=my, axis=-1)
        return jnp.fft.fft(_turned(_filled(rows, -1, count))[..., : field.shape[-2]], n=mx, axis=-1)

    return _divided(of_part, _filled(field, -2, count))[..., : my // 2 + 1, :]


def inverse(spectrum: Array, shape: tuple[int, ...], my: int) -> Array:
    """Return the (..., nx, ny) part of the field, of length my along y, with a spectrum (..., my/2 + 1, mx)."""
    nx, ny = shape
    count = devices()

    def of_part(part: Array) -> Array:
        rows = jnp.fft.ifft(part, axis=-1)[..., :nx]
        return jnp.fft.irfft(_turned(_filled(rows, -1, count))[..., : my // 2 + 1], n=my, axis=-1)[..., :ny]

    return _divided(of_part, _filled(spectrum, -2, count))[..., :nx, :]
