"""Fields on the contact, continued beyond it, so that an inverse on the whole grid serves on the contact as well.

With K_cc the operator between the cells in contact,

    <r, K_cc^-1 r> = min <w, K^-1 w>    over the fields w that equal r in contact,

so that a preconditioner E^T K^-1 E is the better, the less energy the continued field E r has. Continued by zero, a field
that varies slowly jumps at every edge of the contact; its energy then exceeds the least one in proportion to its
wavelength, and the number of iterations increases with the size of the grid. Here cells outside the contact are given
averages of the cells around them. With the averages r_l of the field (zero outside) and c_l of the contact (one or zero)
over blocks of 3^l cells,

    E_l = r_l + (1 - c_l) U E_(l+1),    r_(l+1) = D r_l,    c_(l+1) = D c_l,    U = 9 D^T,

D an average over a block and then over the blocks around it. Far from small spots the averages, and with them E r, fall to
zero, as the field of least energy does. Explicit extensions by levels are due to S. V. Nepomnyaschikh,
Sov. J. Numer. Anal. Math. Modelling 6 (1991) 151.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.operators import distributed

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
    if distributed.devices() > 1:
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
