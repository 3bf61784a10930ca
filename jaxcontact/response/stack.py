"""The surface response of any stack of layers on a half-space or a rigid base, elastic or viscoelastic.

At a wavevector of length alpha the displacement of the surface is (r along the wavevector, s transverse, z into the body)

    u_r = L t_r + i K p,      u_z = -i K t_r + N p,      u_s = T t_s

under tractions t_r, t_s and a pressure p. For a half-space of shear compliance j = 1/G

    alpha (L, K, N, T) = j (1 - nu, 1/2 - nu, 1 - nu, 1).

A layer (A, B, C of ``two_port``) changes the compliance S = alpha [[L, K], [K, N]] of its foundation to

    S' = j A + B X B^T,      X = (S^-1 + C/j)^-1 = (j^2 S + j det S adj C)/(j^2 + j tr(C S) + det C det S),

for elastic solids a sum of positive definite terms: nothing overflows and nothing cancels, whatever the thickness. A
rigid base is S = 0. A layer that slides on its foundation without friction has another two-port (``loose_port``), of the
same form. Compared with 60-digit arithmetic, for random stacks of up to three layers, stiffness ratios up to 1e16 and
alpha h from 1e-8 to 1e3, the error is 2e-15 (for K relative to the square root of L N).

In time the correspondence principle replaces j by s J(s), with J(s) the Laplace transform of the creep compliance,
and makes the nu of a solid with a bulk modulus a function of s. The response to a pressure step
at t = 0 is the inverse transform of N(s)/s, computed on Talbot's contour with 14 points (constants: J. A. C. Weideman,
SIAM J. Numer. Anal. 44 (2006) 2342).
"""

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.programs import Program
from jaxcontact._support.exponential import phi1
from jaxcontact.bodies.body import Layer, LayeredHalfSpace
from jaxcontact.bodies.materials import Elastic, KelvinVoigt, Material, Rigid, Spectrum, parallel_creep

# A single layer as a two-port between its two surfaces, for each wavenumber.
#
# With the layer's top loaded by tractions t and its bottom displaced by u_b, the top is displaced by u and the layer
# exerts on its foundation the tractions t_b,
#
#     alpha u = A j t + B alpha u_b,      t_b = B^T t - C alpha u_b / j,        j = 1/G,
#
# in which
#
#     A  compliance of the layer on a rigid base,
#     B  share of the bottom's displacement that reaches the top (and of the top's traction, the bottom),
#     C  stiffness that the layer with a free top adds to its foundation
#
# depend on x = alpha h and nu alone. In the plane of the wavevector each is 2 x 2 over (in-plane, normal),
# with u_r = i u and t_r = i t for the in-plane pair, which makes all entries real: for theta = exp(-2 x),
# kappa = 3 - 4 nu, D = kappa (1 + theta^2) + (kappa^2 + 1 + 4 x^2) theta, E = 1 - theta,
#
#     4 D A / (kappa + 1) = [[kappa (1 - theta^2) + 4 x theta,   .  ], [  .  , (kappa - 1)(1 - theta^2) + f3]]
#     4 D A_12            = kappa (kappa - 1) E^2 - 8 x^2 theta
#     D C                 = [[(kappa + 1)(1 - theta^2 + 4 x theta), (kappa - 1) E^2 + 8 x^2 theta],
#                            [                  .                 , (kappa + 1) f3               ]]
#     D det C             = 4 f4
#     2 D e^x B / (kappa + 1) = [[(kappa + 1)(1 + theta) - 2 x E, (kappa - 1) E + 2 x (1 + theta)],
#                                [(kappa - 1) E - 2 x (1 + theta), (kappa + 1)(1 + theta) + 2 x E]]
#
# with f3 = 1 - theta^2 - 4 x theta and f4 = E^2 - 4 x^2 theta (``differences``). In the transverse direction A = C =
# tanh x and B = 1/cosh x. Nothing overflows, and no diagonal entry suffers from cancellation at any thickness.
# Source: the matrix exponential of the equations of equilibrium of one layer, rearranged; derived here.


SERIES_BELOW = 0.7
SINH = [1.0 / math.factorial(2 * n + 3) for n in range(9)]


class TwoPort(NamedTuple):
    """A and C as (11, 12, 22) and B as (11, 12, 21, 22), dimensionless; tanh and sech: the transverse A = C and B."""

    A: tuple[Array, Array, Array]
    B: tuple[Array, Array, Array, Array]
    C: tuple[Array, Array, Array]
    det_C: Array
    tanh: Array
    sech: Array


def two_port(x: Array, nu: Array | float) -> TwoPort:
    """Return A, B and C of a layer of x = alpha h >= 0, with entries of the shape of x; nu real or complex."""
    kappa = 3.0 - 4.0 * nu
    theta = jnp.exp(-2.0 * x)
    E, E2, both = -jnp.expm1(-2.0 * x), -jnp.expm1(-4.0 * x), 1.0 + theta
    f3, f4 = differences(x)
    xt, xxt = 4.0 * x * theta, 8.0 * x**2 * theta
    D = kappa * (1.0 + theta**2) + (kappa**2 + 1.0) * theta + 0.5 * xxt
    C = (kappa + 1.0) / D
    B, kE, kE2 = 0.5 * jnp.exp(-x) * C, (kappa - 1.0) * E, (kappa - 1.0) * E**2
    xE, xboth = 2.0 * x * E, 2.0 * x * both
    return TwoPort(
        A=(
            0.25 * C * (kappa * E2 + xt),
            0.25 * (kappa * kE2 - xxt) / D,
            0.25 * C * ((kappa - 1.0) * E2 + f3),
        ),
        B=(
            B * ((kappa + 1.0) * both - xE),
            B * (kE + xboth),
            B * (kE - xboth),
            B * ((kappa + 1.0) * both + xE),
        ),
        C=(C * (E2 + xt), (kE2 + xxt) / D, C * f3),
        det_C=4.0 * f4 / D,
        tanh=E / both,
        sech=2.0 * jnp.exp(-x) / both,
    )


# A layer whose lower side is free of shear (``Layer.bonded`` False) has the same form with, for q = 1 - theta^2 + 4 x theta,
#
#     q A = [[(1 - nu) (1 + theta)^2, (1/2 - nu) q - 4 (1 - nu) x theta], [ . , (1 - nu) (1 - theta)^2]]
#     q e^x B / 2 = [[0, x (1 - theta)], [0, (1 - theta) + x (1 + theta)]],      (1 - nu) q C = [[0, 0], [0, f4]]
#
# and in the transverse direction A = 1/tanh x, B = C = 0: from the entries above with t_b,r = 0 as the condition for u_b,r,
# and simplified; derived here. At x = 0 the layer is a free membrane, of infinite compliance along the surface.


LEAST_X = 1e-40  # alpha h that stands for zero in a loose layer, whose compliance along the surface is as 1/x


def loose_port(x: Array, nu: Array | float) -> TwoPort:
    """Return A, B and C of a layer with a lower side free of shear, x = alpha h >= 0; in the transverse direction ``tanh``
    is A, and B and C are zero."""
    x = jnp.where(x > LEAST_X, x, LEAST_X)
    theta = jnp.exp(-2.0 * x)
    E, both, xt = -jnp.expm1(-2.0 * x), 1.0 + theta, 4.0 * x * theta
    q = -jnp.expm1(-4.0 * x) + xt
    decay, zero, nu_left = 2.0 * jnp.exp(-x) / q, jnp.zeros_like(x * nu), 1.0 - nu
    return TwoPort(
        A=(nu_left * both**2 / q, (0.5 - nu) - nu_left * xt / q, nu_left * E**2 / q),
        B=(zero, decay * x * E + zero, zero, decay * (E + x * both) + zero),
        C=(zero, zero, differences(x)[1] / (nu_left * q)),
        det_C=zero,
        tanh=both / E + zero,
        sech=zero,
    )


def port_of(x: Array, nu: Array | float, loose: Array | bool) -> TwoPort:
    """Return ``loose_port`` where ``loose`` and else ``two_port``."""
    if isinstance(loose, bool):
        return loose_port(x, nu) if loose else two_port(x, nu)
    free, held = loose_port(x, nu), two_port(jnp.where(loose, 1.0, x), nu)
    return jax.tree.map(lambda a, b: jnp.where(loose, a, b), free, held)


def uniaxial(nu: Array | float) -> Array | float:
    """Return a layer's compliance in uniaxial strain over J h: (1 - 2 nu)/(2 (1 - nu))."""
    return (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))


def differences(x: Array) -> tuple[Array, Array]:
    """Return f3 = 1 - theta^2 - 4 x theta and f4 = (1 - theta)^2 - 4 x^2 theta, to round-off at all x."""
    small = x < SERIES_BELOW
    low, high = jnp.where(small, x, 0.0), jnp.where(small, SERIES_BELOW, x)
    theta, (of_double, of_single) = jnp.exp(-2.0 * low), _sinh_excess(jnp.stack([2.0 * low, low]))
    f3 = 2.0 * theta * of_double
    f4 = 4.0 * theta * of_single * (jnp.sinh(low) + low)
    theta = jnp.exp(-2.0 * high)
    g3 = -jnp.expm1(-4.0 * high) - 4.0 * high * theta
    g4 = jnp.expm1(-2.0 * high) ** 2 - 4.0 * high**2 * theta
    return jnp.where(small, f3, g3), jnp.where(small, f4, g4)


def _sinh_excess(y: Array) -> Array:
    """Return sinh(y) - y for 0 <= y < 1.4, by its series."""
    squared, series = y**2, jnp.full_like(y, SINH[-1])
    for coefficient in SINH[-2::-1]:
        series = series * squared + coefficient
    return y * squared * series


SHORT = 0.25  # largest ratio of an interval's length to its end for which the contour of its end is accurate throughout


# Half of Talbot's contour of 28 points: points z and weights w with f(t) = Re sum w F(z/t)/t, each (14,).
ANGLES = np.pi * (2.0 * np.arange(14) + 1.0) / 28
COT = 1.0 / np.tan(0.6407 * ANGLES)
POINTS = 28 * (0.5017 * ANGLES * COT - 0.6122 + 0.2645j * ANGLES)
WEIGHTS = -2j * np.exp(POINTS) * (0.5017 * (COT - 0.6407 * ANGLES * (1.0 + COT**2)) + 0.2645j)


class SurfaceCompliance(NamedTuple):
    """The functions alpha L, alpha K, alpha N and alpha T of the module's formulas [1/Pa]."""

    in_plane: Array
    coupling: Array
    normal: Array
    transverse: Array


def surface_compliance(
    compliances: Array, poissons: Array, thicknesses: Array, wavenumber: Array, loose: Array | None = None
) -> SurfaceCompliance:
    """Return alpha (L, K, N, T) [1/Pa] of a stack, the top layer first and the half-space last.

    compliances: j = 1/G [1/Pa], real or complex, zero for a rigid layer, (layers + 1, ...); poissons:
    (layers + 1, ...); thicknesses: (layers, ...) [m]; wavenumber: alpha >= 0 [rad/m], (...): all broadcast
    behind the first axis; loose: whether each layer slides on what is below it, (layers,), None if none does. At
    alpha = 0 the result is that of the half-space.
    """
    compliances, poissons, thicknesses = map(jnp.asarray, (compliances, poissons, thicknesses))
    wavenumber = jnp.asarray(wavenumber, float)
    j, nu = compliances[-1], poissons[-1]
    shape = jnp.broadcast_shapes(j.shape, nu.shape, thicknesses.shape[1:], wavenumber.shape)
    entries = (j * (1.0 - nu), j * (0.5 - nu), j * (1.0 - nu), j * jnp.ones_like(nu))
    base = SurfaceCompliance(*(jnp.broadcast_to(entry, shape) for entry in entries))

    @jax.checkpoint
    def cover(below: SurfaceCompliance, layer: tuple[Array, ...]) -> tuple[SurfaceCompliance, None]:
        j, nu, thickness, *slides = layer
        return covered(below, j, port_of(wavenumber * thickness, nu, slides[0] if slides else False)), None

    layers = compliances[:-1], poissons[:-1], thicknesses, *(() if loose is None else (loose,))
    return jax.lax.scan(cover, base, layers, reverse=True)[0]


def covered(below: SurfaceCompliance, j: Array, port: TwoPort) -> SurfaceCompliance:
    """Return the surface compliance after adding one layer on top."""
    (A11, A12, A22), (B11, B12, B21, B22), (C11, C12, C22) = port.A, port.B, port.C
    L, K, N, T = below
    # X = (j^2 S + j det S adj C)/(j^2 + j tr(C S) + det C det S), of the foundation S and the layer's C
    det = L * N - K**2
    total = j**2 + j * (C11 * L + 2.0 * C12 * K + C22 * N) + port.det_C * det
    rigid = total == 0.0  # a rigid layer of zero thickness, which has no effect, or on a rigid base
    share = j / jnp.where(rigid, 1.0, total)
    X11 = jnp.where(rigid, L, share * (j * L + det * C22))
    X12 = jnp.where(rigid, K, share * (j * K - det * C12))
    X22 = jnp.where(rigid, N, share * (j * N + det * C11))
    # S' = j A + B X B^T, and in the transverse direction T' = j tanh x + sech^2 x j T/(j + T tanh x)
    across = j + port.tanh * T
    zero = across == 0.0
    return SurfaceCompliance(
        j * A11 + B11**2 * X11 + 2.0 * B11 * B12 * X12 + B12**2 * X22,
        j * A12 + B11 * B21 * X11 + (B11 * B22 + B12 * B21) * X12 + B12 * B22 * X22,
        j * A22 + B21**2 * X11 + 2.0 * B21 * B22 * X12 + B22**2 * X22,
        j * port.tanh + port.sech**2 * jnp.where(zero, T, j * T / jnp.where(zero, 1.0, across)),
    )


def solids(body: LayeredHalfSpace) -> list[Material]:
    """Return the materials of the layers, the top one first, and of the substrate."""
    return [*(layer.material for layer in body.sublayers()), body.base]


def loose_layers(body: LayeredHalfSpace) -> Array | None:
    """Return whether each layer slides on what is below it, (layers,) bool, or None if none does."""
    return jnp.array([not layer.bonded for layer in body.sublayers()]) if body.loose else None


class Spectra(NamedTuple):
    """The ``materials.Spectrum`` of all solids stacked on a first axis, padded with zeros.

    instantaneous [1/Pa] and fluidity [1/(Pa s)]: (layers + 1,); amplitudes [1/Pa] and rates [1/s]:
    (layers + 1, longest).
    """

    instantaneous: Array
    amplitudes: Array
    rates: Array
    fluidity: Array


def spectra(body: LayeredHalfSpace) -> Spectra:
    """Return the spectra of the layers' materials, the top one first, and of the substrate's."""
    each = [solid.spectrum() for solid in solids(body)]
    longest = max(spectrum.rates.size for spectrum in each)
    rows = []
    for one in each:
        more = (0, longest - one.rates.size)
        flow = jnp.zeros(()) if one.fluidity is None else one.fluidity
        rows.append((one.instantaneous, jnp.pad(one.amplitudes, more), jnp.pad(one.rates, more), flow))
    return Spectra(*map(jnp.stack, zip(*rows, strict=True)))


def compliances(spectra: Spectra, period: Array) -> Array:
    """Return s J(s) = J0 + fluidity/s + sum_i J_i/(1 + tau_i s) [1/Pa] of every solid, (layers + 1, ...).

    period: 1/s [s], (...), real or complex; zero gives J0.
    """

    def one(solid: Spectra) -> Array:
        z = solid.rates * jnp.asarray(period)[..., None]
        return solid.instantaneous + solid.fluidity * period + (z / (1.0 + z)) @ solid.amplitudes

    return jax.vmap(one)(spectra)


def alpha_LKNT(body: LayeredHalfSpace, wavenumber: Array, compliances: Array) -> SurfaceCompliance:
    """Return alpha (L, K, N, T) [1/Pa] of the body's geometry with the given shear compliances, (layers + 1, ...).

    At alpha = 0 it is that of the half-space. On a rigid base, where it would be zero, it is there the displacement under
    a uniform traction over that and over the thickness of all layers: of the sum of their h j along the surface and of
    (1 - 2 nu)/(2 (1 - nu)) h j under a pressure, under which no layer widens, be it bonded or not.
    """
    each = [solid.nu_at(j) for solid, j in zip(solids(body), compliances, strict=True)]
    poissons = jnp.stack(jnp.broadcast_arrays(*each))  # (layers + 1,) if none depends on its compliance
    thicknesses = jnp.asarray([layer.thickness for layer in body.layers], float)
    found = surface_compliance(compliances, poissons, thicknesses, wavenumber, loose_layers(body))
    if body.substrate is not None:
        return found
    shares = thicknesses / jnp.sum(thicknesses)
    of_uniform = [share * j for share, j in zip(shares, compliances[:-1], strict=True)]
    along = sum(of_uniform)
    across = sum(uniaxial(nu) * each for nu, each in zip(poissons[:-1], of_uniform, strict=True))
    uniform = SurfaceCompliance(along, jnp.zeros_like(along), across, along)
    return SurfaceCompliance(
        *(jnp.where(wavenumber == 0.0, a, b) for a, b in zip(uniform, found, strict=True))
    )


@functools.partial(Program, optimised=False)  # of every check
def uniform_compliance(body: LayeredHalfSpace) -> Array:
    """Return the compliance of layers on a rigid base under a uniform pressure at first, over their thickness [1/Pa], ()."""
    return alpha_N(body, jnp.zeros(()), spectra(body).instantaneous)


def alpha_N(body: LayeredHalfSpace, wavenumber: Array, compliances: Array) -> Array:
    """Return alpha N [1/Pa] with the arguments of ``alpha_LKNT``."""
    return alpha_LKNT(body, wavenumber, compliances).normal


def step_response(body: LayeredHalfSpace, wavenumber: Array, t: Array | float) -> Array:
    """Return alpha N(alpha, t) [1/Pa]: the response at t >= 0 [s] to a unit pressure step at t = 0.

    wavenumber [rad/m] and t broadcast. The difference from the closed form of one layer is 4e-14 relative, over
    14 decades of time.
    """
    return jnp.real(_on_contour(body, wavenumber, jnp.asarray(t, float)) @ (WEIGHTS / POINTS))


def mean_response(
    body: LayeredHalfSpace, wavenumber: Array, start: Array | float, end: Array | float
) -> Array:
    """Return the mean of ``step_response`` over start <= t <= end [s]; its value where the two coincide.

    All arguments broadcast. The difference from the closed form of one layer is 7e-13 relative.
    """
    wavenumber, start, end = (jnp.asarray(a, float) for a in (wavenumber, start, end))
    return mean_in_time(lambda t: _on_contour(body, wavenumber, t), start, end)


def mean_in_time(on_contour: Callable[[Array], Array], start: Array, end: Array) -> Array:
    """Return the mean over start <= t <= end [s] of a function given on the contour of a time as (..., points).

    A short interval is integrated on the contour of its end; a long one is the difference of two integrals from t = 0.
    """
    length = 1.0 - jnp.where(end == 0.0, 1.0, start / jnp.where(end == 0.0, 1.0, end))  # relative to the end
    early = jnp.where(start > 0.0, start, end)  # multiplied by zero below; avoids division by a zero J(0)
    late, early = jax.lax.map(on_contour, jnp.stack(jnp.broadcast_arrays(end, early)))
    within = jnp.real(jnp.sum(late * phi1(POINTS * length[..., None]) * (WEIGHTS / POINTS), -1))
    integral = lambda values, t: t * jnp.real(values @ (WEIGHTS / POINTS**2))
    difference = integral(late, end) - integral(early, start)
    short = length <= SHORT
    return jnp.where(short, within, difference / jnp.where(short, 1.0, end - start))


def step_responses(body: LayeredHalfSpace, wavenumber: Array, t: Array | float) -> SurfaceCompliance:
    """Return alpha (L, K, N, T) [1/Pa] as ``step_response`` returns alpha N; K is accurate relative to the root of L N."""
    wavenumber, t = jnp.asarray(wavenumber, float), jnp.asarray(t, float)
    on_contour = alpha_LKNT(body, wavenumber[..., None], compliances_on_contour(body, t))
    return SurfaceCompliance(*(jnp.real(entry @ (WEIGHTS / POINTS)) for entry in on_contour))


def _on_contour(body: LayeredHalfSpace, wavenumber: Array, t: Array) -> Array:
    """Return alpha N at the points of the contour for time t, (..., points) complex."""
    return alpha_N(body, jnp.asarray(wavenumber, float)[..., None], compliances_on_contour(body, t))


def compliances_on_contour(body: LayeredHalfSpace, t: Array) -> Array:
    """Return the compliances of the solids at the contour points for time t, (layers + 1, ..., points) complex."""
    return compliances(spectra(body), t[..., None] / POINTS)


# Materials with an elastic volume response: compliances of half-space and film, in time and at a frequency.
#
# With the shear compliance j = 1/G and the bulk modulus K in place of a constant nu, the half-space has
#
#     (1 - nu) j = j/2 + (3/2)/(G + 3 K),
#
# and a layer in uniaxial strain, per unit thickness,
#
#     (1 - 2 nu)/(2 (1 - nu)) j = 1/(K + 4 G/3) = (3/4)/(G + 3 K/4):
#
# the material itself, and the material in parallel with springs. In time each is a sum of exponentials, exactly.


def nu_at_first(material: Material) -> Array:
    """Return Poisson's ratio of the instantaneous elastic response, ()."""
    return material.nu_at(material.spectrum().instantaneous)


def surface_creep(material: Material) -> Spectrum:
    """Return the creep of the surface of a half-space: (1 - nu) j."""
    if material.bulk_modulus is None:
        return _scaled(material.spectrum(), 1.0 - nu_at_first(material))
    return _with_springs(material.spectrum(), 0.5, 1.5, 3.0 * material.bulk_modulus)


def uniaxial_strain_creep(material: Material) -> Spectrum:
    """Return the creep of a layer in uniaxial strain, per unit thickness."""
    if material.bulk_modulus is None:
        return _scaled(material.spectrum(), uniaxial(nu_at_first(material)))
    return _with_springs(material.spectrum(), 0.0, 0.75, 0.75 * material.bulk_modulus)


def film_creep(layer: Layer) -> Spectrum:
    """Return the creep that belongs to ``film_shape``."""
    if layer.material.bulk_modulus is None:
        return layer.material.spectrum()
    return uniaxial_strain_creep(layer.material) if layer.bonded else surface_creep(layer.material)


def film_shape(layer: Layer, wavenumber: Array) -> Array:
    """Return alpha N of a layer on a rigid base over its ``film_creep``, at wavenumbers [rad/m].

    The product of the two is exact for a constant nu and for a loose layer, whose response is 1 - nu times a function of the
    wavenumber. With a bulk modulus, that of a bonded one is exact at t = 0 and in the limit of waves much longer than its
    thickness.
    """
    nu, x = nu_at_first(layer.material), wavenumber * layer.thickness
    own = port_of(x, nu, not layer.bonded).A[2]
    if layer.material.bulk_modulus is None:
        return own
    return own / (uniaxial(nu) if layer.bonded else 1.0 - nu)


def film_compliance(layer: Layer, j: Array) -> Array:
    """Return ``film_creep`` at the frequency at which the shear compliance is j [1/Pa]."""
    bulk = layer.material.bulk_modulus
    if bulk is None:
        return j
    return 3.0 * j / (3.0 * bulk * j + 4.0) if layer.bonded else j / 2.0 + 1.5 * j / (1.0 + 3.0 * bulk * j)


def _scaled(spectrum: Spectrum, factor: Array | float) -> Spectrum:
    flow = None if spectrum.fluidity is None else factor * spectrum.fluidity
    return Spectrum(factor * spectrum.instantaneous, factor * spectrum.amplitudes, spectrum.rates, flow)


def _with_springs(spectrum: Spectrum, free: float, parallel: float, stiffness: Array) -> Spectrum:
    """Return free times the material plus ``parallel`` times the material in parallel with springs [Pa]."""
    alone = _scaled(spectrum, free)
    start, amplitudes, rates = parallel_creep(spectrum, jnp.asarray(stiffness, float))
    return Spectrum(
        alone.instantaneous + parallel * start,
        jnp.concatenate([alone.amplitudes, parallel * amplitudes]),
        jnp.concatenate([alone.rates, rates]),
        alone.fluidity if free else None,
    )


# Facts about a body that follow from its materials, whatever the formula of its response.
#
# The compliance for contacts much wider than the layers is that of the substrate, and for contacts much narrower than the
# top layer that of its material, both as half-spaces (``surface_creep``).


def top_layer(body: LayeredHalfSpace) -> Layer | None:
    """Return the layer whose shortening is reported, or None for a half-space."""
    layers = body.sublayers()
    return layers[0] if layers else None


def surface_material(body: LayeredHalfSpace) -> Material:
    """Return the material that the indenter touches."""
    return solids(body)[0]


def creeps(solid: Material) -> bool:
    """Return whether materials of this class may creep."""
    spectrum = solid.spectrum()
    return spectrum.rates.size > 0 or spectrum.fluidity is not None


def has_fluidity(solid: Material) -> bool:
    """Return whether materials of this class may have steady-state flow."""
    return solid.spectrum().fluidity is not None


def creeps_far(body: LayeredHalfSpace) -> bool:
    """Return whether creep may have an effect at any distance from a load: that of a half-space or of a substrate."""
    return not body.layers or not isinstance(body.substrate, Elastic | None)


def long_wave_compliance(body: LayeredHalfSpace, t: Array | float) -> Array:
    """Return the compliance [1/Pa] at a time t [s] of the substrate, for contacts much wider than the layers; zero on a
    rigid base."""
    return surface_creep(body.base).creep(t)


def short_wave_compliance(body: LayeredHalfSpace, t: Array | float) -> Array:
    """Return the compliance [1/Pa] at a time t [s] of the top layer, for contacts much narrower than it."""
    return surface_creep(surface_material(body)).creep(t)


def relaxed_compliance(body: LayeredHalfSpace) -> Array:
    """Return the relaxed compliance of the substrate, or of the top layer on a rigid base, without its steady-state flow
    [1/Pa], which is never zero."""
    creep = surface_creep(surface_material(body) if body.substrate is None else body.substrate)
    return creep.instantaneous + jnp.sum(jnp.where(creep.rates > 0.0, creep.amplitudes, 0.0))


def is_fluid(body: LayeredHalfSpace) -> Array:
    """Return whether the surface displacement grows without limit under a load, () bool."""
    fluidities = [solid.spectrum().fluidity for solid in solids(body)]
    return jnp.any(jnp.stack([jnp.asarray(0.0 if each is None else each) > 0.0 for each in fluidities]))


def has_zero_instantaneous_compliance(body: LayeredHalfSpace) -> Array | bool:
    """Return whether a solid has J(0) = 0 and does not respond to a step load instantaneously.

    The result is a bool where the class of the material determines it. A rigid base does not count.
    """
    return any(isinstance(solid, KelvinVoigt) for solid in solids(body)) or _rigidity_at_first(body)[0]


def stiffness_ratio(body: LayeredHalfSpace) -> Array:
    """Return the largest modulus at first of a layer over that of a solid below it, without derivative, (); zero without
    layers. Solids that are rigid at first are left aside."""
    return _rigidity_at_first(body)[1]


@functools.partial(Program, optimised=False)  # one program of every check instead of one for each operation
def _rigidity_at_first(body: LayeredHalfSpace) -> tuple[Array, Array]:
    """Return whether a solid that can deform does not do so at first, and ``stiffness_ratio``."""
    compliances = jax.lax.stop_gradient(spectra(body).instantaneous)
    deforms = np.array([not isinstance(solid, Rigid) for solid in solids(body)])
    above, softest_below = compliances[:-1], jax.lax.cummax(compliances, reverse=True)[1:]
    ratios = jnp.where(above > 0.0, softest_below / jnp.where(above > 0.0, above, 1.0), 0.0)
    return jnp.any(deforms & (compliances == 0.0)), jnp.max(ratios, initial=0.0)
