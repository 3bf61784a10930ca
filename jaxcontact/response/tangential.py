"""The tangential response in time as a sum of products, as ``response.in_time`` has the normal one.

    f(alpha, t) = C_0(alpha) + sum_k lambda_k C_k(alpha) (1 - exp(-lambda_k t))/lambda_k,      f = alpha (L, T, K),

lambda_k C_k = sum_m mix[m, k] S_m, with L, T and K as in ``frequency_response``. For a half-space each is a number times its
creep compliance, exactly (two such products with a bulk modulus). For layers that creep the exact response
(``response.stack``) is fitted at frequencies over the band of their rates, by the two linear least-squares fits of
``response.in_time``; the three functions share rates and shapes. The band, and what is different where there is no slowest
rate (a shape for each rate, images at each time, a latest time), are those of ``response.in_time``.

Errors are measured at times up to ten times the longest 1/lambda_k, or up to that latest time: of L and T relative to
themselves, of K relative to the root of L N, N the normal response. Largest ones over all wavenumbers, images included:

    elastic layer on a Maxwell half-space           3e-4
    it 100 times as stiff, or as soft               1e-3
    standard solid on a Burgers half-space          4e-4
    three layers that creep on an elastic one       2e-5
    elastic layer on a fluid layer on one ten times
    as stiff                                        1e-2
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import as_float64, is_concrete, pytree
from jaxcontact.bodies.body import LayeredHalfSpace, check_bonded, checked_body
from jaxcontact.bodies.materials import Material
from jaxcontact.response import in_time
from jaxcontact.response.coefficients import TangentialImages
from jaxcontact.response.images import Images, expected_sizes
from jaxcontact.response.in_time import (
    MORE_RATES,
    STRIDE,
    RateBand,
    Samples,
    common_rates,
    expand_tangential_in_time,
    fitted,
    fitted_to_rates,
    may_have_no_slowest,
    rate_band,
    rounded,
    sampled_compliances,
    samples_of,
    weights_of,
)
from jaxcontact.response.stack import (
    SurfaceCompliance,
    alpha_LKNT,
    creeps,
    nu_at_first,
    solids,
    spectra,
    step_responses,
    surface_creep,
)

# The tangential response of a body as images: alpha (L, T, K) as sums of real exponentials in the wavenumber.
#
# Each of the functions L, T and K of ``response.stack`` is written as
#
#     f(alpha) = f(0) + sum_j w_j (exp(-z_j alpha) - 1)
#
# with the staircases of ``response.images``: w_j is the difference of two successive heights. Depths and
# wavenumbers are those of ``response.in_time``, so that the images reach as far below a layer that becomes much
# stiffer than what lies below it. A half-space is one image on its surface, exactly.


def tangential_wavenumbers(body: LayeredHalfSpace) -> Array:
    """Return the wavenumbers (n,) [rad/m] at which ``tangential_images`` takes a response: zero first, for a half-space zero
    alone."""
    return in_time.wavenumbers(body) if body.layers else jnp.zeros(1)


def tangential_images(body: LayeredHalfSpace, values: Array) -> TangentialImages:
    """Return least-squares images of alpha (L, T, K), given at ``tangential_wavenumbers``, (3, M + 1, n) [any unit].

    The matrix does not depend on the values, so that the images are linear in them. Not for layers without a slowest rate.
    """
    if not body.layers:
        return TangentialImages(jnp.zeros(1), values)
    return _as_exponentials(in_time.expand_tangential(body, values))


def _as_exponentials(stairs: Images) -> TangentialImages:
    """Return the staircases of ``response.images`` as f(0) and the weights w_j of the formula above."""
    weights = jnp.concatenate([stairs.heights[..., -1:], jnp.diff(stairs.heights, axis=-1)], -1)
    return TangentialImages(jnp.append(0.0, stairs.depths), weights)


def images_at(images: TangentialImages, wavenumber: Array) -> Array:
    """Return alpha (L, T, K) of images at wavenumbers (n,) [rad/m], (3, ..., n)."""
    decayed = jnp.expm1(-images.depths[1:, None] * wavenumber)
    return images.weights[..., :1] + images.weights[..., 1:] @ decayed


RATES, SHAPES = 24, 12


@pytree
class TangentialSeparable:
    """The sum of products of alpha (L, T, K), the counterpart of ``response.in_time.Separable``.

    rates: lambda_k [1/s], (K,); terms: C_0 and the S_m of alpha (L, T, K) at ``tangential_wavenumbers``, (3, M + 1, n); mix:
    (M, K); lambda_k C_k = sum_m mix[m, k] S_m [1/(Pa s)]; times [s], (t,): at which errors are to be measured; horizon: the
    latest time for which the sum of products is made [s], () inf without one.
    """

    rates: Array
    terms: Array
    mix: Array
    times: Array
    horizon: Array | float = float("inf")


class TangentialExpansion(NamedTuple):
    """Grid-independent part of the tangential kernels.

    separable: the sum of products; images: (3, M + 1, J + 1); separation_error: the largest relative error of the sum
    of products, (); image_errors: (t, 2), time [s] and largest relative error of the images at that time.
    """

    separable: TangentialSeparable
    images: TangentialImages
    separation_error: Array
    image_errors: Array


def tangential_expansion(body: LayeredHalfSpace) -> TangentialExpansion:
    """Return the sum of products of a body and its images, with their errors."""
    separable = separate_tangential(body)
    if body.layers and separable.rates.size and may_have_no_slowest(body):
        images = _as_exponentials(
            expand_tangential_in_time(
                body, separable.rates, separable.mix, separable.horizon, separable.terms
            )
        )
    else:
        images = tangential_images(body, separable.terms)
    return TangentialExpansion(separable, images, *_errors(body, separable, images))


def separate_tangential(body: LayeredHalfSpace) -> TangentialSeparable:
    """Return the sum of products of a body, that of a layered one with the rates ``response.in_time.common_rates``."""
    if not body.layers:
        # One shape times the creep; with a bulk modulus one for the shear and one for the creep S of the surface
        # (``response.stack.surface_creep``), since then (1 - nu) j = S and (1/2 - nu) j = S - j/2.
        material = body.base
        if material.bulk_modulus is None:
            parts = [(half_space_shares(material), material.spectrum())]
        else:
            shear, surface = jnp.array([0.0, 1.0, -0.5]), jnp.array([1.0, 0.0, 1.0])
            parts = [(shear, material.spectrum()), (surface, surface_creep(material))]
        start = sum(share * creep.instantaneous for share, creep in parts)
        owned = [creep.rates_and_fluidities() for _, creep in parts]
        own_rates = jnp.concatenate([each for each, _ in owned])
        if not own_rates.size:
            at_once = jnp.reshape(start, (3, 1, 1))
            return TangentialSeparable(own_rates, at_once, jnp.zeros((0, 0)), jnp.zeros(1))
        terms = jnp.stack([start, *(share for share, _ in parts)], 1)[:, :, None]
        mix = jax.scipy.linalg.block_diag(*(flow for _, flow in owned))
        return TangentialSeparable(own_rates, terms, mix, jnp.zeros(1))

    wavenumber = tangential_wavenumbers(body)
    if not any(creeps(solid) for solid in solids(body)):
        start = _entries(alpha_LKNT(body, wavenumber, spectra(body).instantaneous))
        return TangentialSeparable(jnp.zeros(0), start.reshape(3, 1, -1), jnp.zeros((0, 0)), jnp.zeros(1))
    rough, endless = rounded(body), may_have_no_slowest(body)
    chosen = rate_band(rough, int(MORE_RATES * RATES) if endless else RATES)
    samples, _ = _sampled(body, wavenumber, chosen)
    common, _ = common_rates(body, chosen.rates)
    if endless:
        terms, mix = fitted_to_rates(samples.rest, chosen, common)
    else:
        alike = wavenumber * jax.lax.stop_gradient(body.layers[0].thickness) / rough.layers[0].thickness
        expected, sizes = _sampled(rough, alike, chosen)
        terms, mix = fitted(samples.rest, expected.rest, weights_of(sizes), chosen, common, SHAPES)
    terms = jnp.concatenate([samples.start[None], terms]).reshape(len(terms) + 1, 3, -1)
    return TangentialSeparable(common, jnp.moveaxis(terms, 1, 0), mix, chosen.times, chosen.horizon)


def _sampled(body: LayeredHalfSpace, wavenumber: Array, chosen: RateBand) -> tuple[Samples, Array]:
    """Return the samples of alpha (L, T, K), one after the other, (r, 3 n), and their sizes at the frequencies, (s, 3 n)."""
    j = sampled_compliances(spectra(body), chosen.period)
    responses = alpha_LKNT(body, wavenumber, j[..., None])
    return samples_of(_entries(responses)), _sizes(responses)[1 : 1 + chosen.period.size]


def _entries(responses: SurfaceCompliance) -> Array:
    """Return alpha (L, T, K), one after the other, (..., 3 n)."""
    return jnp.concatenate([responses.in_plane, responses.transverse, responses.coupling], -1)


def _sizes(responses: SurfaceCompliance) -> Array:
    """Return the sizes to which errors of ``_entries`` are relative, (..., 3 n): alpha times |L|, |T| and |L N|^(1/2)."""
    L, _, N, T = (jnp.abs(entry) for entry in responses)
    return jnp.concatenate([L, T, jnp.sqrt(L * N)], -1)


def _errors(
    body: LayeredHalfSpace, separable: TangentialSeparable, images: TangentialImages
) -> tuple[Array, Array]:
    """Return the separation error and the image errors of ``TangentialExpansion``, without derivative."""
    body, separable, images = jax.lax.stop_gradient((body, separable, images))
    times = separable.times[:, None]
    if not body.layers:
        return jnp.zeros(()), jnp.pad(times, ((0, 0), (0, 1)))
    wavenumber = tangential_wavenumbers(body)
    some = jnp.arange(2, wavenumber.size - 1, STRIDE)  # between those at which images are fitted
    exact = step_responses(body, wavenumber[some], times)
    entries, sizes = _entries(exact), _sizes(exact)
    growth = times * phi1(times * separable.rates)
    sizes = expected_sizes(sizes.reshape(len(sizes), 3, -1)).reshape(sizes.shape)

    def off(terms: Array) -> Array:
        summed = terms[:, 0] + jnp.einsum("tk,mk,cmn->tcn", growth, separable.mix, terms[:, 1:])
        return jnp.max(jnp.abs(summed.reshape(len(summed), -1) - entries) / sizes, -1)

    separation = jnp.max(off(separable.terms[..., some]))
    return separation, jnp.stack([times[:, 0], off(images_at(images, wavenumber[some]))], -1)


def half_space_shares(material: Material) -> Array:
    """Return alpha (L, T, K) of a half-space over its compliance at first; with a constant nu over J(t) at any t, (3,)."""
    nu = nu_at_first(material)
    return jnp.stack([1.0 - nu, jnp.ones(()), 0.5 - nu])


# All nine entries of the surface response at a wavevector.


def frequency_response(body: LayeredHalfSpace, kx: Array, ky: Array, t: Array | float = 0.0) -> Array:
    """Return the displacement (x, y, z) of the surface per amplitude of a traction wave (x, y, z) applied as a step at t
    = 0.

    With alpha^2 = kx^2 + ky^2, c = kx/alpha, s = ky/alpha and the four functions L (in the plane of the
    wavevector), T (transverse), N (normal) and K (coupling) of ``response.stack``, each of (alpha, t),

            | L c^2 + T s^2    (L - T) c s      i K c |
        u = | (L - T) c s      L s^2 + T c^2    i K s | t
            | -i K c           -i K s           N     |

    for fields exp(i (kx x + ky y)), z into the body and tractions on the body: (sigma_xz, sigma_yz, sigma_zz) =
    -t, t_z the pressure. The matrix is Hermitian (reciprocity). For a half-space alpha (L, K, N, T) = J (1 - nu,
    1/2 - nu, 1 - nu, 1).

    Source: Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, Appendix A, whose nine functions agree
    with these after correction of its misprints: Eq. (1) must read sigma_xz = -q_x (the functions are for a traction +q_x
    on the body); B-bar(2),m in R3 to R6 must be B(2),m; theta is exp(-2 alpha h), with nu_1, nu_2 those of coating and
    substrate. In their printed form they overflow for thick layers and lose all significant digits for
    thin ones; this function uses the recursion of ``response.stack``, whose relative error is 4e-14 at all times.

    At the wavevector zero the displacement of a half-space is unbounded, and the direction is undefined. The diagonal
    entries are then ``inf``, and the others 0, which is their mean over all directions; the derivatives are zero. On a
    rigid base the diagonal entries are those under uniform tractions, h J summed over the layers, and that of
    ``normal_response``; a layer that is not bonded has none along the surface, and the wavevector zero is refused.

    Args:
        body: a ``LayeredHalfSpace``.
        kx, ky: components of the wavevector [rad/m], of shapes that broadcast.
        t: time [s], >= 0, of a shape that broadcasts with them.

    Returns:
        (..., 3, 3) complex [m/Pa], displacement first; nan where a value traced by jit or vmap is outside its range.

    Raises:
        ValueError: an invalid or unsupported body, a wavevector that is not finite, or a negative t.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> response = jc.frequency_response(glass, 1e6, 0.0)
        >>> response.shape, f"{response[1, 1].real * 1e6:.4e}"     # 1/G in the transverse direction
        ((3, 3), '3.3333e-11')
    """
    body, valid = checked_body(body)
    valid = valid & checks.finite("kx [rad/m]", kx) & checks.finite("ky [rad/m]", ky)
    if body.loose:
        somewhere = (jnp.asarray(kx) == 0.0) & (jnp.asarray(ky) == 0.0)
        if is_concrete(somewhere) and bool(jnp.any(somewhere)):
            check_bonded(body, "wavevector zero")
    valid = valid & checks.non_negative("t [s]", t)
    body, kx, ky, t = as_float64((body, kx, ky, t))
    return jnp.where(valid, _response(body, *jnp.broadcast_arrays(kx, ky, t)), jnp.nan)


@jax.jit
def _response(body: LayeredHalfSpace, kx: Array, ky: Array, t: Array) -> Array:
    at_zero = (kx == 0.0) & (ky == 0.0)
    kx = jnp.where(at_zero, 1.0, kx)
    alpha = jnp.hypot(kx, ky)
    (L, K, N, T), c, s = step_responses(body, alpha, t), kx / alpha, ky / alpha
    rows = [
        [L * c**2 + T * s**2, (L - T) * c * s, 1j * K * c],
        [(L - T) * c * s, L * s**2 + T * c**2, 1j * K * s],
        [-1j * K * c, -1j * K * s, N],
    ]
    matrix = jnp.stack([jnp.stack([entry + 0j for entry in row], -1) for row in rows], -2)
    response = matrix / alpha[..., None, None]
    uniform = jnp.where(jnp.eye(3, dtype=bool), jnp.inf, 0.0)
    if body.substrate is None:
        along, _, normal, across = step_responses(body, jnp.zeros_like(alpha), t)
        own = jnp.stack([along, across, normal], -1) * body.height
        uniform = own[..., None] * jnp.eye(3)
    return jnp.where(at_zero[..., None, None], uniform, response)
