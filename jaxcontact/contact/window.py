"""A window of the grid that holds the contact.

Most contacts leave a good part of the grid free, so that the search for the pressure may run on a
smaller grid: the window of the operator, put around the contact. What it finds is exact
there; the whole grid has the last word, and the search goes on there where the window was too small.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.operators.base import Corner as Corner


def place(mask: Array, shape: tuple[int, int]) -> tuple[Corner, Array]:
    """The lowest cell of a window around the cells of the mask, and whether it holds them all.

    An empty mask does not fit any window: there is nothing to search for in it.
    """
    (x, fits_x), (y, fits_y) = (_along(jnp.any(mask, 1 - axis), shape[axis]) for axis in (0, 1))
    return (x, y), fits_x & fits_y


def _along(touched: Array, length: int) -> tuple[Array, Array]:
    """The same for one axis, touched: (n,)."""
    n = touched.size
    first, last = jnp.argmax(touched), n - 1 - jnp.argmax(touched[::-1])
    width = last - first + 1
    return jnp.clip(first - (length - width) // 2, 0, n - length), width <= length


def cut(field: Array, corner: Corner, shape: tuple[int, int]) -> Array:
    """The part of a field (..., nx, ny) in the window."""
    leading = field.shape[:-2]
    return jax.lax.dynamic_slice(field, (*(0 for _ in leading), *corner), (*leading, *shape))


def paste(part: Array, corner: Corner, shape: tuple[int, ...]) -> Array:
    """A field of a shape (..., nx, ny) with this part in the window, and zero outside."""
    start = (*(0 for _ in shape[:-2]), *corner)
    return jax.lax.dynamic_update_slice(jnp.zeros(shape, part.dtype), part, start)
