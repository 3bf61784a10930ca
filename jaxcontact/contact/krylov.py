"""Preconditioned conjugate gradients for a linear system K x = b, K symmetric and positive on where b lives."""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.reductions import total
from jaxcontact.operators.operator import Corner as Corner
from jaxcontact.operators.operator import Linear


def conjugate_gradients(
    operator: Linear, inverse: Linear, b: Array, reduction: Array | float, limit: Array | int
) -> tuple[Array, Array, Array]:
    """Solve operator(x) = b from zero; return x, the iterations taken, and whether the reduction is met.

    ``inverse``: the preconditioner; ``reduction``: of sqrt(<r, inverse r>); an iteration applies both once. A direction in
    which the operator is not positive ends the iterations, and the reduction is not met then.
    Source: M. R. Hestenes, E. Stiefel, J. Res. Natl. Bur. Stand. 49 (1952) 409.
    """
    z = inverse(b)
    descent = total(b * z)
    goal = reduction**2 * descent

    def step(state):
        x, r, direction, descent, count = state
        lifted = operator(direction)
        curvature = total(direction * lifted)
        size = descent / jnp.where(curvature > 0.0, curvature, 1.0)
        x, r = x + size * direction, r - size * lifted
        z = inverse(r)
        new = jnp.where(curvature > 0.0, total(r * z), jnp.nan)
        return x, r, z + (new / descent) * direction, new, count + 1

    going = lambda state: (state[3] > goal) & (state[4] < limit)
    first = jnp.zeros_like(b), b, z, descent, jnp.zeros((), int)
    x, _, _, descent, count = jax.lax.while_loop(going, step, first)
    return x, count, descent <= goal


# A window of the grid that holds the contact.
#
# Most contacts leave a good part of the grid free, so that the search for the pressure may run on a
# smaller grid: the window of the operator, put around the contact. What it finds is exact
# there; the whole grid has the last word, and the search goes on there where the window was too small.


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
