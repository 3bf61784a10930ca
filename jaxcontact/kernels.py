"""Kernels: the response of body and indenter on a grid, ready for the march in time.

Inside, lengths are in units of dx and compliances in units of A, the compliance of a very wide contact,
so that coefficients, pressures and gaps are of order one whatever the user's units.
"""

import functools

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact import _checks, spectral
from jaxcontact._pytree import as_float64, pytree
from jaxcontact.frf.normal import layer_modes, quasi_elastic_response, scaled_response
from jaxcontact.frf.separable import DEFAULT_NODES, SeparableResponse, separate
from jaxcontact.geometry import Indenter
from jaxcontact.grid import Grid
from jaxcontact.influence import (
    BEYOND,
    Images,
    fit_images,
    fit_wavenumbers,
    half_space_images,
    image_coefficients,
    image_depths,
    influence_coefficients,
    quantised,
    surface_coefficients,
)
from jaxcontact.layers import LayeredHalfSpace, checked_body, long_wave_compliance


@pytree
class Units:
    """length [m] and compliance [1/Pa] that are one inside."""

    length: Array
    compliance: Array


@pytree
class Film:
    """For the film's shortening: coefficients of the film on a rigid base, times its modulus, over its
    thickness, (nx, ny); weights [1/A] of the pressure and of the history fields, (1 + K,)."""

    coefficients: Array
    weights: Array


@pytree
class Kernels:
    """What ``jaxcontact.indent`` takes as ``kernels=`` to skip building them again.

    spectra, circulants, window: of C_0 and of the shapes S_m, (M + 1, ...), see ``spectral``; rates: lambda_k
    [1/s], (K,); mix: (M, K), see ``frf.separable``; separation_error: relative error of sharing the rates between
    wavenumbers, ().
    """

    spectra: Array
    circulants: Array
    window: spectral.Window | None
    rates: Array
    mix: Array
    film: Film | None
    units: Units
    separation_error: Array


@pytree
class Superposition:
    """Image by image, for the direct superposition: spectra (J, ...), circulants (J, ...), depths (J,)."""

    spectra: Array
    circulants: Array
    depths: Array
    film_coefficients: Array | None
    units: Units


def kernels(body: LayeredHalfSpace, indenter: Indenter, grid: Grid, *, nodes: int = DEFAULT_NODES) -> Kernels:
    """Build the kernels of a body, an indenter and a grid, to be used again by ``indent(kernels=...)``.

    nodes: decay rates per band that all wavenumbers share, static, 1 to 8. Two are good to 4e-7 of the
    displacement for a film a tenth as stiff as its substrate and to 3e-4 for one as stiff; take more
    for a stiffer film (``separation_error`` says how good they are).

    Raises ValueError for a body, an indenter or a grid that cannot be computed.
    """
    body = checked_body(body)
    check_grid(grid)
    indenter.check(grid)
    _checks.require(1 <= nodes <= 8, f"nodes: expected 1 to 8, got {nodes}")
    return _build_jitted(as_float64(body), as_float64(indenter), as_float64(grid), nodes=nodes)


def check_grid(grid: Grid) -> None:
    """At least 4 x 4 cells, spacing above zero."""
    _checks.require(isinstance(grid, Grid), f"grid: expected a Grid, got {type(grid).__name__}")
    good = len(grid.shape) == 2 and all(isinstance(n, int) and n >= 4 for n in grid.shape)
    _checks.require(good, f"grid shape: expected two whole numbers of at least 4, got {grid.shape}")
    _checks.require(len(grid.spacing) == 2, f"grid spacing: expected (dx, dy), got {grid.spacing}")
    _checks.positive("grid spacing [m]", grid.spacing)


def units_of(body: LayeredHalfSpace, indenter: Indenter, grid: Grid) -> Units:
    """dx, and the compliance of a very wide contact; held constant in derivatives."""
    compliance = long_wave_compliance(body) + indenter.compliance()
    return jax.tree.map(jax.lax.stop_gradient, Units(jnp.asarray(grid.spacing[0]), compliance))


def build(body: LayeredHalfSpace, indenter: Indenter, grid: Grid, nodes: int = DEFAULT_NODES) -> Kernels:
    """``kernels`` without checks, for use inside jit."""
    units = units_of(body, indenter, grid)
    response, images = _fitted(body, nodes)
    images = Images(images.depths, images.weights.at[0, 0].add(indenter.compliance()))
    coefficients = influence_coefficients(grid, images) / units.length
    scaled = coefficients.at[0].divide(units.compliance)
    mix = response.mix / units.compliance
    film = None
    if body.layers:
        weights = jnp.append(body.layers[0].material.spectrum().instantaneous / units.compliance, mix[0])
        film = Film(coefficients[1] * units.length / body.layers[0].thickness, weights)
    return Kernels(
        spectra=spectral.kernel_spectrum(scaled),
        circulants=spectral.circulant_spectrum(scaled),
        window=spectral.windowed(scaled),
        rates=response.rates,
        mix=mix,
        film=film,
        units=units,
        separation_error=response.error,
    )


_build_jitted = functools.partial(jax.jit, static_argnames=("nodes",))(build)


def _fitted(body: LayeredHalfSpace, nodes: int) -> tuple[SeparableResponse, Images]:
    """The separable response and the images of each of its terms."""
    if not body.layers:
        response = separate(body, jnp.ones(1), nodes)
        return response, half_space_images(response.terms[:, 0])
    h = body.layers[0].thickness
    response = separate(body, fit_wavenumbers(h), nodes)
    depths, A = image_depths(stiffness_ratio(body)), long_wave_compliance(body)
    first = fit_images(response.terms[0], A, quantised(A / response.terms[0, -1]), depths, h)
    shapes = fit_images(response.terms[1:], jnp.zeros(len(response.terms) - 1), 0.0, depths, h)
    return response, Images(first.depths, jnp.concatenate([first.weights[None], shapes.weights]))


def stiffness_ratio(body: LayeredHalfSpace) -> Array:
    """Film over substrate modulus at first; a film that is rigid at first counts as 1e3."""
    film = body.layers[0].material.spectrum().instantaneous
    substrate = body.substrate.spectrum().instantaneous
    return jnp.minimum(substrate / jnp.where(film > 0.0, film, substrate * 1e-3), 1e3)


def film_coefficients(body: LayeredHalfSpace, grid: Grid) -> Array:
    """Shortening of the film over its thickness, on a rigid base, per unit of J p on a cell, (nx, ny)."""
    h = body.layers[0].thickness
    film = layer_modes(body, fit_wavenumbers(h)).film
    images = fit_images(film, jnp.zeros(()), 0.0, image_depths(stiffness_ratio(body)), h)
    return influence_coefficients(grid, images) / h


def build_superposition(body: LayeredHalfSpace, indenter: Indenter, grid: Grid) -> Superposition:
    """The images one by one, for kernels at any lag."""
    units = units_of(body, indenter, grid)
    depths = jnp.zeros(1)
    if body.layers:
        depths = jnp.append(depths, body.layers[0].thickness * image_depths(stiffness_ratio(body)))
    images = jax.lax.map(lambda z: image_coefficients(grid, z), depths[1:])
    each = jnp.concatenate([surface_coefficients(grid)[None], images]) / (units.length * units.compliance)
    film = film_coefficients(body, grid) if body.layers else None
    return Superposition(
        spectral.kernel_spectrum(each), spectral.circulant_spectrum(each), depths, film, units
    )


def image_weights(
    body: LayeredHalfSpace, indenter: Indenter, start: Array, end: Array, *, quasi_elastic: bool
) -> Array:
    """Weights (..., J) [1/Pa] of the images for the mean response over lags start to end, both (...)."""
    respond = quasi_elastic_response if quasi_elastic else scaled_response
    if not body.layers:
        weights = respond(body, jnp.ones(()), start, end)[..., None]
    else:
        h = body.layers[0].thickness
        values = respond(body, fit_wavenumbers(h), start[..., None], end[..., None])
        A, last = long_wave_compliance(body), respond(body, BEYOND / h, jnp.max(start), jnp.max(end))
        depths = image_depths(stiffness_ratio(body))
        weights = fit_images(values, A * jnp.ones_like(start), quantised(A / last), depths, h).weights
    return weights.at[..., 0].add(indenter.compliance())
