"""Influence coefficients inside a body: stresses, strains and displacements at a depth under a loaded cell.

The transfer functions to a depth z (``response.interior``) decay like exp(-alpha z). Each function of the wavenumber is
written as images,

    f(alpha) = sum_j w_j exp(-z_j alpha) + w' alpha exp(-z alpha),      z_j >= z, z_0 = z,

a linear least-squares fit, exact for a half-space with z_0 alone. The depths z_j = z + constant follow z in derivatives: an
increase of z takes alpha f from f, which no sum of images at fixed depths could follow near the surface, where waves of all
lengths arrive. Stresses are of the size of alpha^2 f at a distance
1/alpha from a small load, and displacements of the size of alpha f. Errors at a wavenumber are therefore relative to

    max over beta <= alpha of |f(beta)| (beta/alpha)^p,      p = 2 for stresses, 1 for displacements,

with the largest of the components of stress, or of displacement, under the same component of traction, and the fit is
weighted accordingly. Images reach 1e3 times the thickness of all layers, and further where layers are much stiffer than
what lies below them or become so with time (``response.time.ladder``). Largest errors after a step, half way down an
elastic layer on a Maxwell half-space of the same modulus at first, after 100 and 4000 relaxation times: 1e-6 and 2e-5;
half a thickness below the layer: 1e-5 and 3e-4. A term exp(-z alpha) (i m)^a (i n)^b/alpha^(a + b) has
a closed form over a rectangular cell: 1/(2 pi) times the difference over its corners of

    1: atan(x y/(z r))      x: ln(y + r)      xx: atan(y z/(x r)) - atan(y/x)      xy: -ln(r + z)
    xxx: y/(r + z) - ln(y + r)      xxy: -x/(r + z)

and the same functions with x and y exchanged, r^2 = x^2 + y^2 + z^2; alpha exp(-z alpha) is minus the derivative in z. For
displacements there is one more factor 1/alpha: ``response.influence.tangential_coefficients``.
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
from jaxcontact.response.stack import solids
from jaxcontact.response.time.band import has_fluidity
from jaxcontact.response.time.interior_time import KernelsAtLags, Lags, kernels_at_lags, sampled
from jaxcontact.response.time.ladder import farthest_image

IMAGES, NODES = 64, 500
MORE_IMAGES = 96  # where a solid flows, so that another may become much stiffer than what lies below it
CLOSEST = 1e-3  # of all layers' thickness: how close to an interface the images resolve it
REACH = 1e3  # of all layers' thickness, to which images go at least
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


# the component of traction, 0 for r, 1 for z, 2 for s, and the power p of errors by function of ``Transfer``
CAUSES = np.array(["rzs".index(name[-1]) for name in Transfer._fields])
POWERS = np.array([1 if name.startswith("u") else 2 for name in Transfer._fields])
GROUPS, group_of = np.unique(np.stack([CAUSES, POWERS]), axis=1, return_inverse=True)
MEMBERS = [np.flatnonzero(group_of == g) for g in range(GROUPS.shape[1])]


class SubsurfaceImages(NamedTuple):
    """Images of ``KernelsAtLags.kernels`` at one depth.

    depths (J,) [m], z first; weights (13, M, J); slope_weights (13, M): w' of the module's formula, in m times the unit of
    the weights; shares (nt, M), as in ``KernelsAtLags``; deviations and sizes (nt, groups, s): largest deviation of the
    images and of the shares from the response at each lag, and the quantity that it is relative to, at some wavenumbers.
    """

    depths: Array
    weights: Array
    slope_weights: Array
    shares: Array
    deviations: Array
    sizes: Array

    def error(self, tractions: Array) -> Array:
        """Return the largest relative error, (), under changes of traction of sizes (nt, 3) of (q_x, q_y, p) [Pa].

        Deviations of all changes are added up, and so are their sizes.
        """
        sideways = jnp.maximum(tractions[:, 0], tractions[:, 1])
        changes = jnp.stack([sideways, tractions[:, 2], sideways], 1)[:, GROUPS[0]]
        off, size = (jnp.einsum("ng,ngs->gs", changes, each) for each in (self.deviations, self.sizes))
        return jnp.max(jnp.where(size > 0.0, off / jnp.where(size > 0.0, size, 1.0), 0.0))


def subsurface_images(body: LayeredHalfSpace, z: Array, lags: Lags | None) -> SubsurfaceImages:
    """Return the images for a depth z >= 0 [m], (), fitted at all wavenumbers but those by which errors are measured."""
    depths, nodes, length = _depths_and_nodes(body, z, lags)
    recalled = kernels_at_lags(body, nodes, z, lags)
    own = nodes * length * jnp.exp(-nodes * z)
    columns = jnp.concatenate([jnp.exp(-nodes[:, None] * depths), own[:, None]], 1)
    every = np.arange(nodes.size)
    tested = every[sampled(nodes.size)]
    among = np.setdiff1d(every, tested[1:]) if body.layers else every
    sizes = jnp.max(_sizes(jnp.moveaxis(recalled.kernels, 1, 0), nodes), 0)
    found = _fitted(columns[among], recalled.kernels[..., among], sizes[:, among])
    deviations, sizes = _deviations(recalled, found, columns[tested], nodes[tested])
    slopes = found[..., -1] * length
    # at the surface w' is zero, and what rounding leaves of it is not to be felt; its derivative by z is not zero
    slopes = jnp.where(z > 0.0, slopes, slopes - jax.lax.stop_gradient(slopes))
    return SubsurfaceImages(depths, found[..., :-1], slopes, recalled.shares, deviations, sizes)


def _sizes(kernels: Array, wavenumber: Array) -> Array:
    """Return what errors of kernels (..., 13, n) are relative to, (..., groups, n), without derivative."""
    kernels, wavenumber = jax.lax.stop_gradient((kernels, wavenumber / wavenumber[-1]))
    power = wavenumber ** GROUPS[1][:, None]
    largest = _largest(jnp.abs(kernels)) * power
    longer = jax.lax.cummax(largest, axis=largest.ndim - 1)
    return jnp.where(power > 0.0, longer / jnp.where(power > 0.0, power, 1.0), _largest(jnp.abs(kernels)))


def _largest(values: Array) -> Array:
    """Return the largest of the functions of each group, (..., groups, n), of values (..., 13, n)."""
    return jnp.stack([jnp.max(values[..., members, :], -2) for members in MEMBERS], -2)


def _fitted(columns: Array, kernels: Array, sizes: Array) -> Array:
    """Return the weights (13, M, J) of columns (n, J) for kernels (13, M, n), errors relative to sizes (groups, n).

    The decomposition and the first solution carry no derivative. Two steps of refinement, which are zero but for rounding,
    give those of the weights, one order each: a change of the kernels less that of the columns, which move with the depth,
    is fitted. Were the change of the kernels alone fitted first, to columns at rest, its large weights would have to cancel.
    """
    per_size = 1.0 / jnp.where(sizes > 0.0, sizes, 1.0)

    def of_group(members: np.ndarray, weights: Array) -> Array:
        matrix, target = columns * weights[:, None], kernels[members] * weights
        solved = decomposed(matrix)
        found = jax.lax.stop_gradient(solved.truncated(target, CUTOFF))
        for _ in range(2):
            found = found + solved.truncated(target - found @ matrix.T, CUTOFF)
        return found

    found = [of_group(*each) for each in zip(MEMBERS, per_size, strict=True)]
    return jnp.concatenate(found)[np.argsort(np.concatenate(MEMBERS))]


def _deviations(
    recalled: KernelsAtLags, weights: Array, columns: Array, wavenumber: Array
) -> tuple[Array, Array]:
    """Return ``deviations`` and ``sizes`` of ``SubsurfaceImages`` at wavenumbers (s,), without derivative."""
    recalled, weights = jax.lax.stop_gradient((recalled, weights))
    ours = jnp.einsum("nm,fmj,sj->nfs", recalled.shares, weights, columns)
    return _largest(jnp.abs(ours - recalled.exact)), _sizes(recalled.exact, wavenumber)


def _depths_and_nodes(body: LayeredHalfSpace, z: Array, lags: Lags | None) -> tuple[Array, Array, Array]:
    """Return the depths of the images [m], the wavenumbers of the fit, and the length to which w' is relative in the fit.

    A half-space needs one image. The depths have the derivative of z, all else has none.
    """
    held = jax.lax.stop_gradient(z)
    if not body.layers:
        scale = jnp.where(held > 0.0, held, 1.0)
        return jnp.reshape(z, 1), jnp.asarray(np.linspace(0.0, 10.0, 20)) / scale, scale
    interfaces = depths_of_interfaces(body)
    total = interfaces[-1]
    closest = jnp.maximum(jnp.min(jnp.abs(interfaces - held)), CLOSEST * total)
    times = jnp.zeros(1) if lags is None else lags.end
    reach = jnp.maximum(REACH * total, farthest_image(body, times))
    flowing = lags is not None and any(has_fluidity(solid) for solid in solids(body))
    span = jnp.linspace(0.0, 1.0, (MORE_IMAGES if flowing else IMAGES) - 1)
    below = jnp.append(0.0, closest * (reach / closest) ** span)
    shortest = SHORTEST / jnp.maximum(jnp.minimum(held, closest), CLOSEST * total)
    nodes = 1e-2 / reach * (shortest * reach / 1e-2) ** jnp.linspace(0.0, 1.0, NODES - 1)
    below, nodes, length = jax.lax.stop_gradient(
        (below, jnp.append(0.0, nodes), jnp.maximum(held, CLOSEST * total))
    )
    return z + below, nodes, length


def over_cells(
    grid: Grid, integrals: Callable[[Array, Array, Array], Kinds], z: Array
) -> tuple[Kinds, Kinds]:
    """Return the differences over a cell's corners at offsets (i, j) >= 0 of the functions, and of minus their
    z-derivatives.

    Lengths are in units of dx.
    """
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    x, y = jnp.arange(nx + 1)[:, None] - 0.5, (jnp.arange(ny + 1) - 0.5) * (dy / dx)
    z = jnp.asarray(z / dx)
    values, slopes = jax.jvp(lambda z: integrals(x, y, z), (z,), (-jnp.ones_like(z),))
    # without the barrier, fusion with the differences would compute and compile each logarithm four times
    values, slopes = jax.lax.optimization_barrier((values, slopes))
    difference = lambda f: jnp.diff(jnp.diff(f, axis=-1), axis=-2) / (2.0 * jnp.pi)
    return jax.tree.map(difference, values), jax.tree.map(difference, slopes)


def summed(
    grid: Grid,
    integrals: Callable[[Array, Array, Array], Kinds],
    functions: tuple[tuple[str, ...], ...],
    images: SubsurfaceImages,
) -> Kinds:
    """Return the sums over images of the named functions times their kinds, each (functions, kinds, M, nx, ny)."""
    index = [jnp.array([Transfer._fields.index(name) for name in group]) for group in functions]
    outer = lambda weights, kinds: tuple(
        jnp.einsum("fm,kxy->fkmxy", weights[i], kind) for i, kind in zip(index, kinds, strict=True)
    )
    value, slope = over_cells(grid, integrals, images.depths[0])
    start = jax.tree.map(
        jnp.add, outer(images.weights[..., 0], value), outer(images.slope_weights / grid.spacing[0], slope)
    )

    def add(total: Kinds, image: tuple[Array, Array]) -> tuple[Kinds, None]:
        more = outer(image[1], over_cells(grid, integrals, image[0])[0])
        return jax.tree.map(jnp.add, total, more), None

    return jax.lax.scan(add, start, (images.depths[1:], jnp.moveaxis(images.weights[..., 1:], -1, 0)))[0]
