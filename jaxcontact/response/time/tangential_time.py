"""The tangential response in time as a sum of products, as ``response.time.separable`` has the normal one.

    f(alpha, t) = C_0(alpha) + sum_k lambda_k C_k(alpha) (1 - exp(-lambda_k t))/lambda_k,      f = alpha (L, T, K),

lambda_k C_k = sum_m mix[m, k] S_m. For a half-space all is one shape times the creep compliance, exactly. For layers that
creep the exact response (``response.stack``) is fitted at frequencies over the band of their rates, by the two linear
least-squares fits of ``response.time.rational``; the three functions share rates and shapes. The band, and the latest time
for which a fit is made where there is no slowest rate, are those of ``response.time.band``.

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

from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.inputs.materials import Material
from jaxcontact.response.half_space import own_creep
from jaxcontact.response.influence.tangential_coefficients import TangentialImages
from jaxcontact.response.stack import SurfaceCompliance, all_steps, scaled_responses, solids, spectra
from jaxcontact.response.time.band import MORE_RATES, Window, creeps, may_have_no_slowest, rounded, window
from jaxcontact.response.time.rational import (
    STRIDE,
    Samples,
    common_rates,
    fitted,
    sampled_compliances,
    samples_of,
    weights_of,
)
from jaxcontact.response.time.tangential_images import fit_images, fit_wavenumbers, images_at
from jaxcontact.response.volume import nu_at_first, surface_creep

RATES, SHAPES = 24, 12
MORE_SHAPES = 20  # shapes where there may be no slowest rate


@pytree
class TangentialSeparable:
    """rates: lambda_k [1/s], (K,); terms: C_0 and the S_m of alpha (L, T, K) at ``fit_wavenumbers``, (3, M + 1, n); mix:
    (M, K); lambda_k C_k = sum_m mix[m, k] S_m [1/(Pa s)]; times [s], (t,): at which errors are to be measured; horizon: the
    latest time for which the sum of products is made [s], () inf without one."""

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
    images = fit_images(body, separable.terms)
    return TangentialExpansion(separable, images, *_errors(body, separable, images))


def separate_tangential(body: LayeredHalfSpace) -> TangentialSeparable:
    """Return the sum of products of a body; of a layered one at fixed rates, and those of its top layer."""
    if not body.layers:
        return _of_half_space(body.substrate)
    wavenumber = fit_wavenumbers(body)
    if not any(creeps(solid) for solid in solids(body)):
        start = _entries(scaled_responses(body, wavenumber, spectra(body).instantaneous))
        return TangentialSeparable(jnp.zeros(0), start.reshape(3, 1, -1), jnp.zeros((0, 0)), jnp.zeros(1))
    rates, shapes = RATES, SHAPES
    if may_have_no_slowest(body):
        rates, shapes = int(MORE_RATES * rates), MORE_SHAPES
    rough = rounded(body)
    chosen = window(rough, rates)
    alike = wavenumber * jax.lax.stop_gradient(body.layers[0].thickness) / rough.layers[0].thickness
    expected, sizes = _sampled(rough, alike, chosen)
    samples, _ = _sampled(body, wavenumber, chosen)
    common, _ = common_rates(body, chosen.rates)
    terms, mix = fitted(samples.rest, expected.rest, weights_of(sizes), chosen, common, shapes)
    terms = jnp.concatenate([samples.start[None], terms]).reshape(shapes + 1, 3, -1)
    return TangentialSeparable(common, jnp.moveaxis(terms, 1, 0), mix, chosen.times, chosen.horizon)


def _sampled(body: LayeredHalfSpace, wavenumber: Array, chosen: Window) -> tuple[Samples, Array]:
    """Return the samples of alpha (L, T, K), one after the other, (r, 3 n), and their sizes at the frequencies, (s, 3 n)."""
    j = sampled_compliances(spectra(body), chosen.period)
    responses = scaled_responses(body, wavenumber, j[..., None])
    return samples_of(_entries(responses)), _sizes(responses)[1 : 1 + chosen.period.size]


def _entries(responses: SurfaceCompliance) -> Array:
    """Return alpha (L, T, K), one after the other, (..., 3 n)."""
    return jnp.concatenate([responses.in_plane, responses.transverse, responses.coupling], -1)


def _sizes(responses: SurfaceCompliance) -> Array:
    """Return the sizes to which errors of ``_entries`` are relative, (..., 3 n): |L|, |T| and the root of |L N|."""
    L, _, N, T = (jnp.abs(entry) for entry in responses)
    return jnp.concatenate([L, T, jnp.sqrt(L * N)], -1)


def _errors(
    body: LayeredHalfSpace, separable: TangentialSeparable, images: TangentialImages
) -> tuple[Array, Array]:
    """Measure both errors of an expansion, without derivative."""
    body, separable, images = jax.lax.stop_gradient((body, separable, images))
    times = separable.times[:, None]
    if not body.layers:
        return jnp.zeros(()), jnp.pad(times, ((0, 0), (0, 1)))
    wavenumber = fit_wavenumbers(body)
    some = jnp.arange(2, wavenumber.size - 1, STRIDE)  # between those at which images are fitted
    exact = all_steps(body, wavenumber[some], times)
    entries, sizes = _entries(exact), _sizes(exact)
    growth = times * phi1(times * separable.rates)
    summed = lambda terms: _rows(
        terms[:, 0] + jnp.einsum("tk,mk,cmn->tcn", growth, separable.mix, terms[:, 1:])
    )
    off = lambda terms: jnp.max(jnp.abs(summed(terms) - entries) / sizes, -1)
    separation = jnp.max(off(separable.terms[..., some]))
    return separation, jnp.stack([times[:, 0], off(images_at(images, wavenumber[some]))], -1)


def _rows(values: Array) -> Array:
    """Return fields (t, 3, n) with the last two axes as one."""
    return values.reshape(len(values), -1)


def half_space_shares(material: Material) -> Array:
    """alpha (L, T, K) over the compliance at first, with a constant nu over the creep compliance, (3,)."""
    nu = nu_at_first(material)
    return jnp.stack([1.0 - nu, jnp.ones(()), 0.5 - nu])


def _of_half_space(material: Material) -> TangentialSeparable:
    """One shape times the creep; with a bulk modulus one for the shear and one for the surface's creep.

    Then (1 - nu) j = S, (1/2 - nu) j = S - j/2, S of ``response.volume.surface_creep``.
    """
    if material.bulk_modulus is None:
        parts = [(half_space_shares(material), material.spectrum())]
    else:
        shear, surface = jnp.array([0.0, 1.0, -0.5]), jnp.array([1.0, 0.0, 1.0])
        parts = [(shear, material.spectrum()), (surface, surface_creep(material))]
    start = sum(share * creep.instantaneous for share, creep in parts)
    owned = [own_creep(creep) for _, creep in parts]
    rates = jnp.concatenate([each for each, _ in owned])
    if not rates.size:
        return TangentialSeparable(rates, jnp.reshape(start, (3, 1, 1)), jnp.zeros((0, 0)), jnp.zeros(1))
    terms = jnp.stack([start, *(share for share, _ in parts)], 1)[:, :, None]
    mix = jax.scipy.linalg.block_diag(*(flow for _, flow in owned))
    return TangentialSeparable(rates, terms, mix, jnp.zeros(1))
