"""Transfer functions to a depth: traction and displacement inside a stack under surface tractions, by wavenumber.

The plane at depth z divides the body in two. With A, B, C of ``response.stack`` and the compliance S of all that lies
below each layer (``response.stack``), the layers above the plane transmit

    t_below = j (j + C S)^-1 B^T t_above,      alpha u = S t,

layer by layer from the surface to the plane. In the plane of the wavevector these are 2 x 2 over (in-plane, normal)
with t_r = i tau, u_r = i U; in the transverse direction they are scalars. For a depth within the substrate, the
half-space itself is divided at that depth.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact.bodies.body import LayeredHalfSpace
from jaxcontact.bodies.grid import Grid
from jaxcontact.response.coefficients import of_image, on_surface
from jaxcontact.response.images import decomposed, log_spaced
from jaxcontact.response.in_time import farthest_image, rounded_number
from jaxcontact.response.stack import (
    SurfaceCompliance,
    TwoPort,
    compliances_on_contour,
    covered,
    has_fluidity,
    loose_layers,
    mean_in_time,
    nu_at_first,
    port_of,
    solids,
    spectra,
    surface_compliance,
    uniaxial_strain_creep,
)

Entries = tuple[Array, Array, Array, Array, Array]  # rr, rz, zr, zz, ss


class Transfer(NamedTuple):
    """Transfer functions from surface tractions to a depth; entries (out, in), r in the plane, z normal, s transverse.

    t_rr, t_rz, t_zr, t_zz, t_ss: to tractions; u_rr, ...: to alpha times displacement [1/Pa]; e_rr, e_rz, e_ss: u times
    the shear modulus at the depth, from which the in-plane stresses are formed.
    """

    t_rr: Array
    t_rz: Array
    t_zr: Array
    t_zz: Array
    t_ss: Array
    u_rr: Array
    u_rz: Array
    u_zr: Array
    u_zz: Array
    u_ss: Array
    e_rr: Array
    e_rz: Array
    e_ss: Array


def depths_of_interfaces(body: LayeredHalfSpace) -> Array:
    """Return the depths of the interfaces [m], (layers,)."""
    return jnp.cumsum(jnp.asarray([layer.thickness for layer in body.layers], float))


def poisson_at(body: LayeredHalfSpace, z: Array) -> Array:
    """Return Poisson's ratio at a depth z [m]; at an interface, that of the solid below."""
    return _poissons(body)[_solid_at(body, z)]


def _solid_at(body: LayeredHalfSpace, z: Array) -> Array:
    """Return the number of the solid at a depth, of that below at an interface, but never a rigid base's."""
    depths = depths_of_interfaces(body)
    return jnp.sum((depths if body.substrate is not None else depths[:-1]) <= z)


def _poissons(body: LayeredHalfSpace) -> Array:
    return jnp.stack([nu_at_first(solid) for solid in solids(body)])


def transfer(body: LayeredHalfSpace, wavenumber: Array, z: Array, compliances: Array) -> Transfer:
    """Return the transfer functions at wavenumbers alpha >= 0 [rad/m] to the depth z [m], ().

    compliances: shear compliances of the solids [1/Pa], real or complex, (layers + 1, ...), which broadcast with the
    wavenumbers behind the first axis.
    """
    j, alpha = compliances, wavenumber
    bottom = depths_of_interfaces(body)
    top = jnp.append(0.0, bottom)
    # above the plane: all of the layers on top of its solid, and the part z - top of this one. It is chosen by number, so
    # that at the surface and at an interface the derivative by z is that below, and not half of it
    count, here = jnp.arange(top.size), _solid_at(body, z)
    whole = jnp.append(jnp.diff(top), 0.0)
    above = jnp.where(count < here, whole, jnp.where(count == here, z - top, 0.0))
    per_solid = lambda a: jnp.reshape(a, (-1, *[1] * (j.ndim - 1)))
    nu, below = per_solid(_poissons(body)), per_solid(jnp.diff(top) - above[:-1])
    # a loose layer slides at its lower side: whole above the plane or in its part below it
    loose, slides = loose_layers(body), [not layer.bonded for layer in body.layers] + [False]
    over = j if body.substrate is not None else j[:-1]  # no plane is in a rigid base
    whole_above = [count[i] < here if slides[i] else False for i in range(len(over))]
    ports = [port_of(alpha * above[i], nu[i], whole_above[i]) for i in range(len(over))]
    loose = None if loose is None else loose & (count[:-1] >= here)
    compliance = [surface_compliance(j, nu, below, alpha, loose)]  # of the solids below the plane
    # of the solids below each layer above the plane
    for port, own in zip(ports[::-1], over[::-1], strict=True):
        compliance.insert(0, covered(compliance[0], own, port))
    one, zero = jnp.ones_like(compliance[0].normal), jnp.zeros_like(compliance[0].normal)
    t: Entries = (one, zero, zero, one, one)
    for port, own, foundation in zip(ports, over, compliance[1:], strict=True):
        t = _transmitted(port, own, foundation, t)
    L, K, N, T = compliance[-1]
    rr, rz, zr, zz, ss = t
    u = L * rr + K * zr, L * rz + K * zz, K * rr + N * zr, K * rz + N * zz, T * ss
    local = j[_solid_at(body, z)]
    return Transfer(*t, *u, u[0] / local, u[1] / local, u[4] / local)


def _transmitted(port: TwoPort, j: Array, below: SurfaceCompliance, t: Entries) -> Entries:
    """Return the tractions below a layer from those on top of it, both (rr, rz, zr, zz, ss)."""
    (B11, B12, B21, B22), (C11, C12, C22) = port.B, port.C
    L, K, N, T = below
    D11, D12 = j + C11 * L + C12 * K, C11 * K + C12 * N
    D21, D22 = C12 * L + C22 * K, j + C12 * K + C22 * N
    det = D11 * D22 - D12 * D21
    share = j / jnp.where(det == 0.0, 1.0, det)

    def through(r: Array, z: Array) -> tuple[Array, Array]:
        r, z = B11 * r + B21 * z, B12 * r + B22 * z
        return share * (D22 * r - D12 * z), share * (D11 * z - D21 * r)

    rr, rz, zr, zz, ss = t
    (rr, zr), (rz, zz) = through(rr, zr), through(rz, zz)
    across = j + port.tanh * T
    return rr, rz, zr, zz, ss * port.sech * j / jnp.where(across == 0.0, 1.0, across)


# Fields at a depth of a viscoelastic body after a history of tractions on its surface.
#
# With a traction t that is linear between times t_n and steps on at the first, what is at a depth at the last time T
# is
#
#     sum_n F_n * (t(t_n) - t(t_(n-1))),      F_n: the mean of F(alpha, lag) over T - t_n <= lag <= T - t_(n-1),
#
# F the step responses of ``transfer`` by the correspondence principle, on the contour of ``response.stack``;
# strain is multiplied by the modulus there, so that no relaxation is left to be done. All F_n are nearly combinations
# of a few,
#
#     F_n ~ sum_m shares_nm F_(n_m),
#
# which a QR decomposition with column pivots picks, from some wavenumbers, so that the tractions of the past are
# mixed into as many fields before they meet a kernel. Largest error of a function over lags and wavenumbers, of its
# largest value: the paper's film 1e-11; two layers and a substrate that creep over nine decades 4e-10 for equal time
# steps, 6e-5 for lags from a millionth of the time to all of it.


KEPT = 16  # lags whose kernels stand for all
SAMPLED = 32  # wavenumbers by which these lags are picked
SHARES_CUTOFF = 1e-12  # singular values of the lags below this part of the largest are discarded


class Lags(NamedTuple):
    """Bounds [s] of how long ago the tractions changed, (nt,) each; None: now, so that the body is as stiff as at first."""

    start: Array
    end: Array


class KernelsAtLags(NamedTuple):
    """The kernels F of the formula above at the picked lags.

    kernels: the functions of ``Transfer``, (13, M, n); shares (nt, M); exact: F_n at all lags, (nt, 13, s), at the
    wavenumbers of ``sampled``, by which errors are measured.
    """

    kernels: Array
    shares: Array
    exact: Array


def lags_before_the_last(times: Array) -> Lags:
    """Return the lags of the changes between times (nt,) [s]; the first change is the step at times[0]."""
    ago = times[-1] - times
    return Lags(ago, jnp.append(ago[:1], ago[:-1]))


def sampled(count: int) -> slice:
    """Return which of ``count`` wavenumbers those are at which all lags are computed, about ``SAMPLED`` of them."""
    return slice(None, None, -(-count // SAMPLED))


def pivots(matrix: Array, count: int) -> Array:
    """Return the indices of the columns that a QR decomposition with column pivots takes first, (count,)."""

    def take(rest: Array, _: None) -> tuple[Array, Array]:
        sizes = jnp.sum(rest**2, 0)
        best = jnp.argmax(sizes)
        direction = rest[:, best] / jnp.sqrt(jnp.where(sizes[best] > 0.0, sizes[best], 1.0))
        return rest - jnp.outer(direction, direction @ rest), best

    return jax.lax.scan(take, jax.lax.stop_gradient(matrix), None, count)[1]


def kernels_at_lags(body: LayeredHalfSpace, wavenumber: Array, z: Array, lags: Lags | None) -> KernelsAtLags:
    """Return the kernels at wavenumbers (n,) [rad/m] for the depth z [m], ()."""
    some = sampled(wavenumber.size)
    if lags is None:  # the elastic response
        kernels = jnp.stack(transfer(body, wavenumber, z, spectra(body).instantaneous[:, None]))
        return KernelsAtLags(kernels[:, None], jnp.ones((1, 1)), kernels[None, :, some])
    exact = jax.lax.map(lambda lag: _mean(body, wavenumber[some], z, Lags(*lag)), tuple(lags))

    # The lags that stand for all, and their shares in each, from a QR decomposition with column pivots.
    count = exact.shape[0]
    picked, shares = jnp.arange(count), jnp.eye(count)
    if count > KEPT:
        scale = jnp.max(jnp.abs(jax.lax.stop_gradient(exact)), (0, 2), keepdims=True)
        rows = (exact / jnp.where(scale > 0.0, scale, 1.0)).reshape(count, -1)
        picked = pivots(rows.T, KEPT)
        # by least squares; each of the two steps of refinement carries one order of derivatives
        few = rows[picked].T
        singular = decomposed(few)
        shares = singular.truncated(rows, SHARES_CUTOFF)
        for _ in range(2):
            shares = shares + singular.truncated(rows - shares @ few.T, SHARES_CUTOFF)
    means = jax.lax.map(lambda n: _mean(body, wavenumber, z, Lags(lags.start[n], lags.end[n])), picked)
    return KernelsAtLags(jnp.moveaxis(means, 0, 1), shares, exact)


def _mean(body: LayeredHalfSpace, wavenumber: Array, z: Array, lag: Lags) -> Array:
    """The mean over one interval of lags, (13, n)."""

    def on_contour(t: Array) -> Array:
        soft = compliances_on_contour(body, t)[:, None]
        return jnp.stack(transfer(body, wavenumber[:, None], z, soft))

    return mean_in_time(on_contour, lag.start, lag.end)


def of_uniform(body: LayeredHalfSpace, z: Array, changes: Array, lags: Lags | None) -> Array:
    """Return the displacement (x, y, z) at a depth z [m] of layers on a rigid base under uniform tractions, (3,).

    Under these the layers between the depth and the base are sheared, and shortened without widening. changes: of (q_x, q_y,
    p), (nt, 3) [Pa], as in ``kernels_at_lags``.
    """
    bottom = depths_of_interfaces(body)
    below = jnp.maximum(bottom - jnp.maximum(jnp.append(0.0, bottom[:-1]), z), 0.0)
    total = jnp.zeros(3)
    for layer, part in zip(body.sublayers(), below, strict=True):
        each = layer.material.spectrum(), uniaxial_strain_creep(layer.material)
        along, across = (
            one.instantaneous[None] if lags is None else one.mean_creep(lags.start, lags.end) for one in each
        )
        total = total + part * jnp.sum(jnp.stack([along, along, across], 1) * changes, 0)
    return total


# Influence coefficients inside a body: stresses, strains and displacements at a depth under a loaded cell.
#
# The transfer functions to a depth z decay like exp(-alpha z). Each function of the
# wavenumber is written as images,
#
#     f(alpha) = sum_j w_j exp(-z_j alpha) + w' alpha exp(-z alpha),      z_j >= z, z_0 = z,
#
# a linear least-squares fit, exact for a half-space with z_0 alone. The depths z_j = z + constant follow z in
# derivatives: an increase of z takes alpha f from f, which no sum of images at fixed depths could follow near the
# surface, where waves of all lengths arrive. Stresses are of the size of alpha^2 f at a distance 1/alpha from a small
# load, and displacements of the size of alpha f. Errors at a wavenumber are therefore relative to
#
#     max over beta <= alpha of |f(beta)| (beta/alpha)^p,      p = 2 for stresses, 1 for displacements,
#
# with the largest of the components of stress, or of displacement, under the same component of traction, and the fit
# is weighted accordingly. Images reach 1e3 times the thickness of all layers, and further where layers are much
# stiffer than what lies below them or become so with time (``response.in_time``). Largest errors after a step,
# half way down an elastic layer on a Maxwell half-space of the same modulus at first, after 100 and 4000 relaxation
# times: 1e-6 and 2e-5; half a thickness below the layer: 1e-5 and 3e-4. A term exp(-z alpha) (i m)^a (i n)^b/alpha^(a
# + b) has a closed form over a rectangular cell: 1/(2 pi) times the difference over its corners of
#
#     1: atan(x y/(z r))      x: ln(y + r)      xx: atan(y z/(x r)) - atan(y/x)      xy: -ln(r + z)
#     xxx: y/(r + z) - ln(y + r)      xxy: -x/(r + z)
#
# and the same functions with x and y exchanged, r^2 = x^2 + y^2 + z^2; alpha exp(-z alpha) is minus the derivative in
# z. For displacements there is one more factor 1/alpha: ``response.coefficients``.


IMAGES, NODES = 64, 500
MORE_IMAGES = 96  # where a solid flows, so that another may become much stiffer than what lies below it
CLOSEST = 1e-3  # of all layers' thickness: how close to an interface the images resolve it
REACH = 1e3  # of all layers' thickness, to which images go at least
CUTOFF = 1e-13
SHORTEST = 40.0  # alpha z beyond which the transfer functions are negligible

Kinds = tuple[Array, ...]  # corner functions by the number of letters, (kinds, ...)


def gradients(x: Array, y: Array, z: Array) -> Kinds:
    """Return 2 pi times the integrals of the formulas above: 1; x, y; xx, xy, yy; xxx, xxy, xyy, yyy. x and y not
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


# In plane strain the same functions are integrals over y as well: with l = ln(x^2 + z^2) and a = atan(x/z) the differences
# over y tend to
#
#     1: 2 a      x: -l      xx: -2 a      xxx: l      all with a y: 0
#
# and those with one more factor 1/alpha to the F and H of ``response.coefficients.tangential_lines``, with its datum d.


def line_gradients(x: Array, _y: Array, z: Array) -> Kinds:
    """Return the kinds of ``gradients`` in plane strain, y without meaning; x not zero."""
    angle, log, zero = 2.0 * jnp.arctan2(x, z), jnp.log(x**2 + z**2), jnp.zeros_like(x)
    return (
        angle[None],
        jnp.stack([-log, zero]),
        jnp.stack([-angle, zero, zero]),
        jnp.stack([log, zero, zero, zero]),
    )


def line_displacements(x: Array, _y: Array, z: Array, datum: int | None = None) -> Kinds:
    """Return the kinds of ``displacements`` in plane strain, relative to the surface at the distance d, ``datum`` cells or
    one width of the grid, from a line load; x, in units of dx, at the edges of all its cells."""
    datum, zero = datum or x.shape[0] - 1, jnp.zeros_like(x)
    even = 2.0 * x - x * jnp.log((x**2 + z**2) / datum**2) - 2.0 * z * jnp.arctan2(x, z)
    odd = z * jnp.log(x**2 + z**2) - 2.0 * x * jnp.arctan2(x, z)
    return jnp.stack([odd, zero]), jnp.stack([even, zero, zero])


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

    depths (J,) [m], z first; weights (13, M, J); slope_weights (13, M): w' of the formula above, in m times the unit of
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

    # Weights (13, M, J + 1) of the columns, by least squares relative to the sizes. The decomposition and the first solution
    # carry no derivative. Two steps of refinement, which are zero but for rounding, give those of the weights, one order
    # each: a change of the kernels less that of the columns, which move with the depth, is fitted. Were the change of the
    # kernels alone fitted first, to columns at rest, its large weights would have to cancel.
    chosen, per_group = columns[among], []
    per_size = 1.0 / jnp.where(sizes > 0.0, sizes, 1.0)
    for members, relative in zip(MEMBERS, per_size[:, among], strict=True):
        matrix, target = chosen * relative[:, None], recalled.kernels[members][..., among] * relative
        solved = decomposed(matrix)
        weights = jax.lax.stop_gradient(solved.truncated(target, CUTOFF))
        for _ in range(2):
            weights = weights + solved.truncated(target - weights @ matrix.T, CUTOFF)
        per_group.append(weights)
    found = jnp.concatenate(per_group)[np.argsort(np.concatenate(MEMBERS))]

    # The deviations at wavenumbers that were not fitted, without derivative.
    exact, held, shares = jax.lax.stop_gradient((recalled.exact, found, recalled.shares))
    ours = jnp.einsum("nm,fmj,sj->nfs", shares, held, columns[tested])
    deviations, sizes = _largest(jnp.abs(ours - exact)), _sizes(exact, nodes[tested])
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


def _depths_and_nodes(body: LayeredHalfSpace, z: Array, lags: Lags | None) -> tuple[Array, Array, Array]:
    """Return the depths of the images [m], the wavenumbers of the fit, and the length to which w' is relative in the fit.

    A half-space needs one image. The depths have the derivative of z, all else has none, and is made for rounded lengths, as
    the choices of ``response.in_time`` are: differences by the depth then agree with derivatives.
    """
    held = jax.lax.stop_gradient(z)
    if not body.layers:
        scale = jnp.where(held > 0.0, held, 1.0)
        return jnp.reshape(z, 1), jnp.asarray(np.linspace(0.0, 10.0, 20)) / scale, scale
    interfaces = depths_of_interfaces(body)
    total = interfaces[-1]
    closest = rounded_number(jnp.maximum(jnp.min(jnp.abs(interfaces - held)), CLOSEST * total))
    times = jnp.zeros(1) if lags is None else lags.end
    reach = rounded_number(jnp.maximum(REACH * total, farthest_image(body, times)))
    total, held = rounded_number(total), rounded_number(held)
    flowing = lags is not None and any(has_fluidity(solid) for solid in solids(body))
    below = jnp.append(0.0, log_spaced(closest, reach, (MORE_IMAGES if flowing else IMAGES) - 1))
    shortest = SHORTEST / jnp.maximum(jnp.minimum(held, closest), CLOSEST * total)
    nodes = log_spaced(1e-2 / reach, shortest, NODES - 1)
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
    y = y[:1] if grid.plane_strain else y
    z = jnp.asarray(z / dx)
    values, slopes = jax.jvp(lambda z: integrals(x, y, z), (z,), (-jnp.ones_like(z),))
    # without the barrier, fusion with the differences would compute and compile each logarithm four times
    values, slopes = jax.lax.optimization_barrier((values, slopes))
    across = lambda f: f if grid.plane_strain else jnp.diff(f, axis=-1)
    difference = lambda f: jnp.diff(across(f), axis=-2) / (2.0 * jnp.pi)
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
