"""Influence coefficients inside a body: stresses, strains and displacements at a depth under a loaded cell.

The transfer functions to a depth z (``response.interior``) decay like exp(-alpha z). Each function of the wavenumber is
written as images,

    f(alpha) = sum_j w_j exp(-z_j alpha) + w' alpha z exp(-z alpha),      z_j >= z, z_0 = z,

a linear least-squares fit, exact for a half-space with z_0 alone. A term exp(-z alpha) (i m)^a (i n)^b/alpha^(a + b) has
a closed form over a rectangular cell: 1/(2 pi) times the difference over its corners of

    1: atan(x y/(z r))      x: ln(y + r)      xx: atan(y z/(x r)) - atan(y/x)      xy: -ln(r + z)
    xxx: y/(r + z) - ln(y + r)      xxy: -x/(r + z)

and the same functions with x and y exchanged, r^2 = x^2 + y^2 + z^2; alpha z exp(-z alpha) is minus z times the
derivative in z. For displacements there is one more factor 1/alpha: ``response.influence.tangential_coefficients``.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.response.influence.linear_fit import decomposed
from jaxcontact.response.influence.tangential_coefficients import of_image, on_surface
from jaxcontact.response.interior import Transfer, depths_of_interfaces
from jaxcontact.response.time.interior_time import Lags, recall

IMAGES, NODES = 64, 500
CLOSEST = 1e-3  # smallest resolved distance from an interface, over the thickness of all layers
DEEPEST = 1e3  # depth of the deepest image over the thickness of all layers
CUTOFF = 1e-13
SHORTEST = 40.0  # alpha z beyond which the transfer functions are negligible

Kinds = tuple[Array, ...]  # corner functions by the number of letters, (kinds, ...)


def gradients(x: Array, y: Array, z: Array) -> Kinds:
    """Return 2 pi times the integrals of the module's formulas: 1; x, y; xx, xy, yy; xxx, xxy, xyy, yyy. x and y not
    zero.
    """
    r = jnp.sqrt(x**2 + y**2 + z**2)
    log_x, log_y = jnp.log(x + r), jnp.log(y + r)
    xx = jnp.arctan(y * z / (x * r)) - jnp.arctan(y / x)
    yy = jnp.arctan(x * z / (y * r)) - jnp.arctan(x / y)
    along_x, along_y = x / (r + z), y / (r + z)
    return (
        jnp.arctan2(x * y, z * r)[None],
        jnp.stack([log_y, log_x]),
        jnp.stack([xx, -jnp.log(r + z), yy]),
        jnp.stack([along_y - log_y, -along_x, -along_y, along_x - log_x]),
    )


def displacements(x: Array, y: Array, z: Array) -> Kinds:
    """Return the corresponding integrals for displacements, in units of x: x, y; m^2, m n and n^2 over alpha^2."""
    k = jax.tree.map(jnp.add, on_surface(x, y), of_image(x, y, z))
    return jnp.stack([k.x, k.y]), jnp.stack([k.xx, k.xy, k.yy])


# the functions of a ``Transfer`` that multiply the kinds of ``gradients`` and of ``displacements``
OF_GRADIENTS = (("t_zz",), ("t_rz", "t_zr"), ("t_rr", "t_ss", "e_rz"), ("e_rr", "e_ss"))
OF_DISPLACEMENTS = (("u_rz", "u_zr"), ("u_rr", "u_ss", "u_zz"))


class Buried(NamedTuple):
    """Images of ``Recalled.kernels`` at one depth.

    depths (J,) [m], z first; weights (13, M, J); slope_weights (13, M): w' of the module's formula; shares (nt, M), as in
    ``Recalled``.
    """

    depths: Array
    weights: Array
    slope_weights: Array
    shares: Array


def bury(body: LayeredHalfSpace, z: Array, lags: Lags | None) -> Buried:
    """Fit the images for a depth z >= 0 [m], ()."""
    depths, nodes = _depths_and_nodes(body, z)
    recalled = recall(body, nodes, z, lags)
    scale = jnp.max(jnp.abs(recalled.kernels), -1, keepdims=True)
    scale = jax.lax.stop_gradient(jnp.where(scale > 0.0, scale, 1.0))
    derivative = nodes * z * jnp.exp(-nodes * z)
    columns = jnp.concatenate([jnp.exp(-nodes[:, None] * depths), derivative[:, None]], 1)
    weights = scale * decomposed(columns).truncated(recalled.kernels / scale, CUTOFF)
    return Buried(depths, weights[..., :-1], weights[..., -1], recalled.shares)


def _depths_and_nodes(body: LayeredHalfSpace, z: Array) -> tuple[Array, Array]:
    """Return the depths of the images, and the wavenumbers at which they are fitted; a half-space needs one image."""
    if not body.layers:
        scale = jnp.where(z > 0.0, z, 1.0)
        return jnp.reshape(z, 1), jnp.asarray(np.linspace(0.0, 10.0, 20)) / scale
    interfaces = depths_of_interfaces(body)
    total = interfaces[-1]
    closest = jnp.maximum(jnp.min(jnp.abs(interfaces - z)), CLOSEST * total)
    span = jnp.linspace(0.0, 1.0, IMAGES - 1)
    depths = jnp.append(z, z + closest * (DEEPEST * total / closest) ** span)
    shortest = SHORTEST / jnp.maximum(jnp.minimum(z, closest), CLOSEST * total)
    nodes = (
        1e-2 / (DEEPEST * total) * (shortest * DEEPEST * total / 1e-2) ** jnp.linspace(0.0, 1.0, NODES - 1)
    )
    return jax.lax.stop_gradient((depths, jnp.append(0.0, nodes)))


def over_cells(
    grid: Grid, integrals: Callable[[Array, Array, Array], Kinds], z: Array
) -> tuple[Kinds, Kinds]:
    """Return the differences over a cell's corners at offsets (i, j) >= 0 of the functions, and of -z times their
    z-derivatives.

    Lengths are in units of dx.
    """
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    x, y = jnp.arange(nx + 1)[:, None] - 0.5, (jnp.arange(ny + 1) - 0.5) * (dy / dx)
    z = jnp.asarray(z / dx)
    values, slopes = jax.jvp(lambda z: integrals(x, y, z), (z,), (-z,))
    # without the barrier, fusion with the differences would compute and compile each logarithm four times
    values, slopes = jax.lax.optimization_barrier((values, slopes))
    difference = lambda f: jnp.diff(jnp.diff(f, axis=-1), axis=-2) / (2.0 * jnp.pi)
    return jax.tree.map(difference, values), jax.tree.map(difference, slopes)


def summed(
    grid: Grid,
    integrals: Callable[[Array, Array, Array], Kinds],
    functions: tuple[tuple[str, ...], ...],
    images: Buried,
) -> Kinds:
    """Return the sums over images of the named functions times their kinds, each (functions, kinds, M, nx, ny)."""
    index = [jnp.array([Transfer._fields.index(name) for name in group]) for group in functions]
    outer = lambda weights, kinds: tuple(
        jnp.einsum("fm,kxy->fkmxy", weights[i], kind) for i, kind in zip(index, kinds, strict=True)
    )
    value, slope = over_cells(grid, integrals, images.depths[0])
    start = jax.tree.map(jnp.add, outer(images.weights[..., 0], value), outer(images.slope_weights, slope))

    def add(total: Kinds, image: tuple[Array, Array]) -> tuple[Kinds, None]:
        more = outer(image[1], over_cells(grid, integrals, image[0])[0])
        return jax.tree.map(jnp.add, total, more), None

    return jax.lax.scan(add, start, (images.depths[1:], jnp.moveaxis(images.weights[..., 1:], -1, 0)))[0]
