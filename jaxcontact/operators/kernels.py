"""Kernels: the response of body and indenter on a grid, ready for the march in time."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.programs import Program
from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, static, value_in_words
from jaxcontact._support.reductions import total
from jaxcontact._support.scale import Scale
from jaxcontact.bodies.body import LayeredHalfSpace, checked_body
from jaxcontact.bodies.grid import Grid, check_grid
from jaxcontact.bodies.materials import Material
from jaxcontact.indenters.shapes import Indenter, checked_indenter
from jaxcontact.operators import spectral
from jaxcontact.operators.convolution import Convolutions
from jaxcontact.operators.coupled import CoupledFamily, Tangential
from jaxcontact.response.coefficients import (
    SurfaceKernels,
    TangentialImages,
    influence_coefficients,
    periodic_coefficients,
    periodic_response,
    strip_coefficients,
    tangential_coefficients,
    tangential_lines,
)
from jaxcontact.response.half_space import Response, Separable
from jaxcontact.response.images import Images, image_errors
from jaxcontact.response.in_time import DEFAULT_NODES, check_times, products
from jaxcontact.response.normal import BodyLimits, limits_of, response_of
from jaxcontact.response.tangential import TangentialExpansion, half_space_shares, tangential_expansion

# The shortening of a film at the deepest point of a contact, over its thickness there.


@pytree
class Film:
    """A film of one thickness on a rigid base.

    coefficients: displacement at offsets (i, j) >= 0 under a unit pressure on one cell, times the film's modulus, over its
    thickness, (nx, ny); weights [1/A] of the pressure and of the history fields, (1 + K,).
    """

    coefficients: Array
    weights: Array

    def strain(self, pressure: Array, history: Array) -> Array:
        """Return the strain at the deepest point, (), from the pressure (nx, ny) and the history fields (K, nx, ny)."""
        return deepest_strain(self.coefficients, _hereditary(self.weights, pressure, history))


@pytree
class VaryingFilm:
    """A film whose thickness varies in the plane.

    series: of the coefficients of ``Film`` in Chebyshev polynomials of the thickness, (n, nx, ny); shares: the
    polynomials of the thickness at each cell, (n, nx, ny); present: cells with a film, (nx, ny) bool; weights: as there.
    """

    series: Array
    shares: Array
    present: Array
    weights: Array

    def strain(self, pressure: Array, history: Array) -> Array:
        """Return the strain at the deepest point with a film, as if the film were as thick everywhere as it is there."""
        total = _hereditary(self.weights, pressure, history)
        i, j = _deepest(jnp.where(self.present, total, -jnp.inf))
        coefficients = jnp.tensordot(self.shares[:, i, j], self.series, 1)
        found = jnp.sum(_around(coefficients, i, j) * total)
        return jnp.where(jnp.any(self.present), found, 0.0)


def deepest_strain(coefficients: Array, strain: Array) -> Array:
    """Return the shortening of a film on a rigid base at the deepest point of the hereditary integral, both (nx, ny)."""
    return total(_around(coefficients, *_deepest(strain)) * strain)


def _hereditary(weights: Array, pressure: Array, history: Array) -> Array:
    """Return the hereditary integral of the pressure, (nx, ny)."""
    return weights[0] * pressure + jnp.tensordot(weights[1:], history, 1)


def _deepest(strain: Array) -> tuple[Array, Array]:
    """Return the indices of the first largest value: first its row, which takes a quarter of the time of both at once."""
    i = jnp.argmax(jnp.max(strain, axis=1))
    return i, jnp.argmax(strain[i])


def _around(coefficients: Array, i: Array, j: Array) -> Array:
    """Return the coefficients at the offsets of all cells from cell (i, j)."""
    nx, ny = coefficients.shape
    return coefficients[jnp.abs(jnp.arange(nx) - i)][:, jnp.abs(jnp.arange(ny) - j)]


SAME = 1e-9  # relative difference within which two cell sizes are equal
MOST_STIFF = 1e6  # film over substrate modulus up to which images are measured


class Errors(NamedTuple):
    """Relative errors of the response on a grid: of shared rates, of images, and of the series in the thickness of a
    film that varies in the plane, () each; horizon: the latest time for which they hold [s], ()."""

    separation: Array
    images: Array
    horizon: Array
    thickness: Array | float = 0.0


@pytree
class Kernels:
    """Discretised response of a body and an indenter on a grid; made by ``jaxcontact.kernels``, passed as ``kernels=``.

    family: the operators C_0 and S_m, (M + 1); rates: lambda_k [1/s], (K,); mix: (M, K), see ``response.half_space``;
    separation_error: relative error of sharing the rates between wavenumbers, at times up to ``horizon`` [s], (), inf for
    most bodies; image_errors: relative errors of the
    images between the wavenumbers where they are fitted, at times spread around the rates, (t, 2): time [s], error;
    at_zero: the S_m at wavenumber zero, (M,); grid: that of the operators; nodes: see ``kernels``; rigid_base: whether the
    displacement of a periodic grid has a mean.
    """

    family: Convolutions
    rates: Array
    mix: Array
    film: Film | None
    scale: Scale
    separation_error: Array
    horizon: Array
    image_errors: Array
    at_zero: Array
    grid: Grid
    nodes: int = static()
    rigid_base: bool = static(default=False)

    def __repr__(self) -> str:
        rates = "none" if self.rates.size == 0 else f"{value_in_words(self.rates)} 1/s"
        rows = [
            f"Kernels on {self.grid!r}",
            f"  {self.mix.shape[0]} shapes and an instantaneous response, nodes={self.nodes}",
            f"  decay rates {rates}",
            f"  separation error {value_in_words(self.separation_error)}",
            f"  image error {value_in_words(self.image_error)}",
        ]
        return "\n".join(rows)

    @property
    def image_error(self) -> Array:
        """The largest of ``image_errors``, ()."""
        return jnp.max(self.image_errors[:, 1])

    def delayed_shares(self, pressure: Array) -> Array:
        """Return <p, lambda_k C_k p>/<p, C_0 p> [1/s] of a pressure (nx, ny), (K,), from the periodic operators nearest to
        C_0 and S_m; zero without pressure."""
        circulants, shape = self.family.circulants(pressure), pressure.shape
        periodic = self.grid.periodic
        if all(periodic) and not self.rigid_base:  # the displacement is measured from the mean
            pressure = pressure - jnp.mean(pressure)
        waves = spectral.transform(pressure, (True, True))
        squares = jnp.sum(circulants * (waves.real**2 + waves.imag**2), -1)
        energies = squares @ spectral.both_signs(shape[1])
        some = energies[0] > 0.0
        shares = self.mix.T @ energies[1:] / jnp.where(some, energies[0], 1.0)
        return jnp.where(some, jnp.maximum(shares, 0.0), 0.0)

    def errors(self, duration: Array | float = jnp.inf) -> Errors:
        """Return the errors reported for a run of a duration [s]."""
        images = largest_until(self.image_errors, jnp.minimum(duration, self.horizon))
        return Errors(self.separation_error, images, self.horizon)


def largest_until(errors: Array, last: Array) -> Array:
    """Return the largest of errors (t, 2), each behind its time [s], up to a last time, and at least of the earliest, ()."""
    times, each = errors.T
    return jnp.max(jnp.where(times <= jnp.maximum(last, jnp.min(times)), each, 0.0))


@pytree
class ImageKernels:
    """Step by step, for kernels at any lag: the operators of all steps of the staircase; film_coefficients: as in
    ``Film``; image_error: as in ``Kernels``."""

    family: Convolutions
    film_coefficients: Array | None
    scale: Scale
    image_error: Array


def kernels(body: LayeredHalfSpace, indenter: Indenter, grid: Grid, *, nodes: int = DEFAULT_NODES) -> Kernels:
    """Compute the kernels of a body, an indenter and a grid, for use in several runs (``indent(kernels=...)``).

    Args:
        body: a ``LayeredHalfSpace``.
        indenter: the indenter, of which only the material is used.
        grid: the ``Grid`` of the runs.
        nodes: number of common decay rates in each band of rates, static, 1 to 8. With two, the error of the displacement
            is 4e-7 for a film a tenth as stiff as its substrate and 3e-4 for a film as stiff as its substrate; use more for
            a stiffer film. The measured error is ``separation_error``. For several layers, or on a viscoelastic
            substrate, each node stands for 12 rates spread over the times of the materials, and for 4 coefficient
            functions; for 18 and 10 if a layer that does not flow lies over one that may, in which case the response is
            valid up to the time ``horizon``.

    Returns:
        ``Kernels``.

    Raises:
        ValueError: an invalid or unsupported body, indenter or grid.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> ball, grid = jc.Sphere(radius=5e-3), jc.Grid.square(n=16, width=500e-6)
        >>> ready = jc.kernels(glass, ball, grid)
        >>> history = jc.indent(glass, ball, jc.Load(20.0), [0.0], grid=grid, kernels=ready)
    """
    body, valid = checked_body(body)
    valid = valid & check_grid(grid) & checked_indenter(indenter, grid) & check_stiffness(body)
    checks.whole("nodes", nodes, 1, 8)
    built = compiled_build(*as_float64((body, indenter, grid)), nodes=nodes)
    return built if valid is True else jax.tree.map(lambda a: jnp.where(valid, a, jnp.nan), built)


def check_kernels(kernels: Kernels, grid: Grid) -> Verdict:
    """Kernels of that grid."""
    built = kernels.grid
    checks.require(
        tuple(built.shape) == tuple(grid.shape),
        f"kernels: expected those of a grid of {tuple(grid.shape)} cells, got {tuple(built.shape)}",
    )
    checks.require(
        built.periodic == grid.periodic,
        f"kernels: expected those of a grid with periodic={grid.periodic}, got periodic={built.periodic}",
    )
    pairs = zip(built.spacing, grid.spacing, strict=True)
    near = jnp.stack([jnp.isclose(a, b, rtol=SAME, atol=0.0) for a, b in pairs])
    if not is_concrete(near):
        return jnp.all(near)
    ours, theirs = (tuple(float(f"{float(d):.10g}") for d in g.spacing) for g in (built, grid))
    checks.require(bool(np.all(near)), f"kernels: expected those of cells of {theirs} m, got {ours} m")
    return True


def check_stiffness(body: LayeredHalfSpace) -> Verdict:
    """A film that images can stand for: not more than a million times as stiff as its substrate."""
    ratio = limits_of(body).stiffness_ratio()
    if not is_concrete(ratio):
        return ratio <= MOST_STIFF
    checks.require(
        float(ratio) <= MOST_STIFF * (1.0 + 1e-9),
        f"layer: expected at most {MOST_STIFF:g} times the substrate's modulus, got {float(ratio):.4g} times:"
        " the response of a stiffer film cannot be put on a grid",
    )
    return True


def scale_of(limits: BodyLimits, indenter: Indenter, grid: Grid) -> Scale:
    """Return dx, and the compliance of a very wide contact, which is held constant in derivatives.

    The length is not held: it is by dx itself that cells are counted, also where no unit is converted, as in the cells that
    a velocity passes in a second.
    """
    compliance = jax.lax.stop_gradient(limits.relaxed_compliance() + indenter.compliance())
    return Scale(jnp.asarray(grid.spacing[0]), compliance, jnp.asarray(grid.cell_area))


class Expansion(NamedTuple):
    """Grid-independent part of the kernels: the response as a sum of products, its images (M + 1, J + 1), and errors
    (t, 2)."""

    separable: Separable
    images: Images
    errors: Array


def expansion(body: LayeredHalfSpace, nodes: int) -> Expansion:
    """Return the expansion of a body, with ``nodes`` as in ``kernels``."""
    response = response_of(body)
    separable = response.separate(nodes)
    images = _images(response, separable)
    return Expansion(separable, images, _image_errors(response, separable, images))


def assembled(
    body: LayeredHalfSpace, indenter: Indenter, grid: Grid, expansion: Expansion, nodes: int
) -> Kernels:
    """The kernels of a body's expansion, with the indenter's compliance, on a grid."""
    limits, (separable, _, errors) = limits_of(body), expansion
    scale = scale_of(limits, indenter, grid)
    mean = None
    if body.substrate is None:
        mean = separable.terms[:, 0] * body.height / scale.length
        mean = mean.at[0].divide(scale.compliance)
    family, coefficients = on_grid(grid, scaled_images(expansion, indenter, scale), mean)
    mix = separable.mix / scale.compliance
    film = None
    if limits.film is not None:
        weights = separable.film / scale.compliance
        film = Film(coefficients[1] * scale.length / limits.film.thickness, weights)
    at_zero = separable.terms[1:, 0]
    horizon = jnp.asarray(separable.horizon)
    return Kernels(
        family,
        separable.rates,
        mix,
        film,
        scale,
        separable.error,
        horizon,
        errors,
        at_zero,
        grid,
        nodes,
        mean is not None,
    )


def scaled_images(expansion: Expansion, indenter: Indenter, scale: Scale) -> Images:
    """Return the images of C_0, with the indenter's compliance, and of the shapes, scaled; depths in m."""
    images = expansion.images
    heights = images.heights.at[0].add(indenter.compliance()) / scale.length
    return Images(images.depths, heights.at[0].divide(scale.compliance))


def build(body: LayeredHalfSpace, indenter: Indenter, grid: Grid, nodes: int = DEFAULT_NODES) -> Kernels:
    """``kernels`` without checks, for use inside jit."""
    return assembled(body, indenter, grid, expansion(body, nodes), nodes)


def compiled_build(
    body: LayeredHalfSpace, indenter: Indenter, grid: Grid, nodes: int = DEFAULT_NODES
) -> Kernels:
    """``build`` in two programs: an expensive one, the same for all grids, and one for each shape of them."""
    return _assembled(body, indenter, grid, compiled_expansion(body, nodes=nodes), nodes=nodes)


compiled_expansion = Program(expansion, ("nodes",))
_assembled = Program(assembled, ("nodes",))


def on_grid(grid: Grid, images: Images, mean: Array | None = None) -> tuple[Convolutions, Array]:
    """The operators of images, heights (m, J + 1), and their coefficients at offsets (i, j) >= 0, (m, nx, ny).

    mean: displacement under a uniform pressure of one, of bodies on a rigid base, (m,); None: relative to the mean.
    """
    if all(grid.periodic):
        response = periodic_response(grid, images, 0.0 if mean is None else mean)
        family = Convolutions.of_spectra(response, with_mean=mean is not None)
        return family, periodic_coefficients(grid, images, mean)
    coefficients = (strip_coefficients if any(grid.periodic) else influence_coefficients)(grid, images)
    return Convolutions.of(coefficients, grid.periodic), coefficients


def _images(response: Response, separable: Separable) -> Images:
    """The images of C_0 and of the shapes, (M + 1, J + 1)."""
    swapped = lambda a: jnp.concatenate([a[1:2], a[:1], a[2:]])  # the film's shape is to be the first
    images = response.expand_shapes(swapped(separable.terms))
    return Images(images.depths, swapped(images.heights))


def _image_errors(response: Response, separable: Separable, images: Images) -> Array:
    """Return time and error at times spread around every rate, (t, 2)."""
    response, separable, images = jax.lax.stop_gradient((response, separable, images))
    times, wavenumbers = check_times(separable.rates), response.wavenumbers()
    exact = products(separable, separable.terms, times[:, None])
    fitted = products(separable, images.at(wavenumbers), times[:, None])
    return jnp.stack([times, image_errors(fitted, exact)], -1)


def build_images(body: LayeredHalfSpace, indenter: Indenter, grid: Grid) -> ImageKernels:
    """The steps of the staircase one by one."""
    response, limits = response_of(body), limits_of(body)
    scale = scale_of(limits, indenter, grid)
    on_base = response.expand_shapes(limits.film_shape(response.wavenumbers())[None])
    unit = jnp.eye(on_base.depths.size + 1) / (scale.length * scale.compliance)
    family, _ = on_grid(grid, Images(on_base.depths, unit))
    film = None if limits.film is None else on_grid(grid, on_base)[1][0] / limits.film.thickness
    return ImageKernels(family, film, scale, _quasi_elastic_error(response, limits.surface))


def _quasi_elastic_error(response: Response, surface: Material) -> Array:
    """Return the largest error at times spread around the rates of the surface."""
    response, surface = jax.lax.stop_gradient((response, surface))
    times, wavenumbers = check_times(surface.spectrum().rates)[:, None], response.wavenumbers()
    values = response.quasi_elastic(wavenumbers, times, times)
    return jnp.max(image_errors(response.expand(values).at(wavenumbers), values))


def image_weights(
    body: LayeredHalfSpace, indenter: Indenter, start: Array, end: Array, *, quasi_elastic: bool
) -> Array:
    """Heights (..., J + 1) [1/Pa] of the staircase for the mean response over lags start to end, both (...)."""
    response = response_of(body)
    respond = response.quasi_elastic if quasi_elastic else response.step
    values = respond(response.wavenumbers(), start[..., None], end[..., None])
    return response.expand(values).heights + indenter.compliance()


# Kernels of traction: the response of body and indenter in three directions on a grid, ready for the march.


@pytree
class TractionKernels:
    """normal: as in ``indent``; family: the tangential operators C_0 and S_m; rates [1/s], (K,); mix (M, K); expansion: the
    tangential response that they come from.

    The tangential rates are their own; what a pressure draws along, too, is remembered at them.
    """

    normal: Kernels
    family: CoupledFamily
    rates: Array
    mix: Array
    expansion: TangentialExpansion

    def errors(self, duration: Array | float = jnp.inf) -> Errors:
        """Return the errors of a run of a duration [s], the larger ones of the normal and the tangential response."""
        return joint_errors(self.normal, self.expansion, duration)


def joint_errors(
    normal: Kernels, expansion: TangentialExpansion, duration: Array | float = jnp.inf
) -> Errors:
    """Return the larger errors of a normal and a tangential response in a run of a duration [s]."""
    errors = normal.errors(duration)
    images = largest_until(expansion.image_errors, jnp.minimum(duration, errors.horizon))
    separation = jnp.maximum(errors.separation, expansion.separation_error)
    return Errors(separation, jnp.maximum(errors.images, images), errors.horizon)


def assembled_traction(
    normal: Kernels, expansion: TangentialExpansion, indenter: Indenter, grid: Grid, *, coupled: bool
) -> TractionKernels:
    """Return the kernels of an expansion on a grid; ``normal``: those of the same body, indenter and grid.

    Tangential compliances of the two solids add, while their couplings of normal and tangential subtract.
    """
    coefficients = scaled_coefficients(expansion, indenter, grid, normal.scale)
    family = CoupledFamily(Tangential.of(coefficients, coupled=coupled, periodic=grid.periodic))
    mix = expansion.separable.mix / normal.scale.compliance
    return TractionKernels(normal, family, expansion.separable.rates, mix, expansion)


def compiled_traction(
    body: LayeredHalfSpace, indenter: Indenter, grid: Grid, *, coupled: bool
) -> TractionKernels:
    """Return the kernels of a body, an indenter and a grid; the programs of the expansions hold for all grids."""
    normal = compiled_build(body, indenter, grid)
    return _assembled_tractions(normal, _expansion(body), indenter, grid, coupled=coupled)


_expansion = Program(tangential_expansion)
_assembled_tractions = Program(assembled_traction, ("coupled",))


def scaled_coefficients(
    expansion: TangentialExpansion, indenter: Indenter, grid: Grid, scale: Scale
) -> SurfaceKernels:
    """The coefficients of C_0, with the indenter's, and of the S_m, (M + 1, nx, ny) in cells."""
    images = expansion.images
    weights = images.weights.at[:, 0, 0].add(_of_indenter(indenter))
    coefficients_of = tangential_lines if grid.plane_strain else tangential_coefficients
    coefficients = coefficients_of(grid, TangentialImages(images.depths, weights))
    scaled = jax.tree.map(lambda a: a / scale.length, coefficients)
    return jax.tree.map(lambda a: a.at[0].divide(scale.compliance), scaled)


def _of_indenter(indenter: Indenter) -> Array:
    """Return the contribution of the indenter to alpha (L, T, K) [1/Pa], (3,)."""
    if indenter.material is None:
        return jnp.zeros(3)
    shares = half_space_shares(indenter.material) * jnp.array([1.0, 1.0, -1.0])
    return shares * indenter.material.spectrum().instantaneous
