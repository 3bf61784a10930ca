"""Kernels: the response of body and indenter on a grid, ready for the march in time.

    body -> ``expansion``: its response as images and rates, the same for every grid
         -> ``assembled``: influence coefficients of the images on a grid, their spectra, scaled -> ``Kernels``

What follows ``Kernels`` and its making is for particular contacts: the strain of a film, friction (``FrictionKernels``
where all of the contact slides, ``TractionKernels`` where it sticks in part), the quasi-elastic correspondence
(``ImageKernels``), and films whose thickness varies in the plane (``ThicknessSeries``).
"""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.programs import Program
from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.fields import Scale
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace, static, value_in_words
from jaxcontact._support.reductions import total
from jaxcontact.bodies.body import LayeredHalfSpace, checked_body
from jaxcontact.bodies.grid import Grid, check_grid
from jaxcontact.bodies.materials import Elastic
from jaxcontact.indenters.shapes import Indenter, checked_indenter
from jaxcontact.operators import spectral
from jaxcontact.operators.coupled import CoupledFamily, Tangential, spectrum
from jaxcontact.operators.operator import Family, Operator, series_entries
from jaxcontact.response.coefficients import (
    SurfaceKernels,
    TangentialImages,
    influence_coefficients,
    periodic_coefficients,
    periodic_response,
    strip_coefficients,
    tangential_coefficients,
    tangential_lines,
    wavenumbers,
)
from jaxcontact.response.images import Images, image_errors
from jaxcontact.response.in_time import DEFAULT_NODES, Separable, check_times, summed_products
from jaxcontact.response.normal import response_of, sideways_compliance
from jaxcontact.response.stack import (
    film_shape,
    relaxed_compliance,
    stiffness_ratio,
    surface_material,
    top_layer,
)
from jaxcontact.response.tangential import TangentialExpansion, half_space_shares, tangential_expansion

SAME = 1e-9  # relative difference within which two cell sizes, or two pressures, are equal
# largest modulus of a film over that of its substrate, up to which the error of images was measured
MOST_STIFF = 1e6


class Errors(NamedTuple):
    """Relative errors of the response on a grid: of shared rates, of images, and of the series in the thickness of a
    film that varies in the plane, () each; horizon: the latest time for which they hold [s], ()."""

    separation: Array
    images: Array
    horizon: Array
    thickness: Array | float = 0.0

    def joined(self, other: Errors) -> Errors:
        """Return the larger ones of two errors, which hold until the earlier one of their horizons."""
        return Errors(
            jnp.maximum(self.separation, other.separation),
            jnp.maximum(self.images, other.images),
            jnp.minimum(self.horizon, other.horizon),
            jnp.maximum(self.thickness, other.thickness),
        )


@pytree
class Kernels:
    """Discretised response of a body and an indenter on a grid; made by ``jaxcontact.kernels``, passed as ``kernels=``.

    family: the operators C_0 and S_m, (M + 1); rates: lambda_k [1/s], (K,); mix: (M, K), see ``response.in_time``;
    separation_error: relative error of sharing the rates between wavenumbers up to the horizon, (); horizon [s]: latest
    valid time, inf where there is no limit, (); image_errors: relative errors of the
    images between the wavenumbers where they are fitted, at times spread around the rates, (t, 2): time [s], error;
    at_zero: the S_m at wavenumber zero, (M,); grid: that of the operators; nodes: see ``kernels``; varying: for a film
    whose thickness varies in the plane, or None; all else is then of one thickness, until ``at``; indenter: the kernels of
    an indenter that creeps or is coated, in the same scale, or None: an elastic one is in C_0; rigid_base: whether the
    displacement of a periodic grid has a mean; made_of: the body and the indenter's material, with which a run compares its
    own, None within a run.
    """

    family: Family
    rates: Array
    mix: Array
    film_strain: FilmStrain | None
    scale: Scale
    separation_error: Array
    horizon: Array
    image_errors: Array
    at_zero: Array
    grid: Grid
    nodes: int = static()
    varying: VaryingThickness | None = None
    indenter: Kernels | None = None
    rigid_base: bool = static(default=False)
    made_of: Any = None

    def __repr__(self) -> str:
        rates = "none" if self.rates.size == 0 else f"{value_in_words(self.rates)} 1/s"
        rows = [
            f"Kernels on {self.grid!r}",
            f"  {self.mix.shape[0]} shapes and an instantaneous response, nodes={self.nodes}",
            f"  decay rates {rates}",
            f"  separation error {value_in_words(self.separation_error)}",
            f"  image error {value_in_words(self.image_error)}",
        ]
        if self.indenter is not None:
            rows += ["of the indenter:", *repr(self.indenter).splitlines()[1:]]
        return "\n".join(rows)

    @property
    def image_error(self) -> Array:
        """The largest of ``image_errors``, ()."""
        return jnp.max(self.image_errors[:, 1])

    def works(self, pressure: Array) -> Array:
        """Return <p, C_0 p> and <p, lambda_k C_k p> [1/s] of a pressure (nx, ny), (1 + K,), from the periodic operators
        nearest to C_0 and S_m."""
        circulants, shape = self.family.nearest(pressure), pressure.shape
        periodic = self.grid.periodic
        if all(periodic) and not self.rigid_base:  # the displacement is measured from the mean
            pressure = pressure - jnp.mean(pressure)
        waves = spectral.transform(pressure, (True, True))
        squares = jnp.sum(circulants * (waves.real**2 + waves.imag**2), -1)
        works = squares @ spectral.both_signs(shape[1])
        return jnp.concatenate([works[:1], self.mix.T @ works[1:]])

    def errors(self, duration: Array | float = jnp.inf) -> Errors:
        """Return the errors reported for a run of a duration [s]."""
        images = largest_until(self.image_errors, jnp.minimum(duration, self.horizon))
        thickness = 0.0 if self.varying is None else self.varying.error
        own = Errors(self.separation_error, images, self.horizon, thickness)
        return own if self.indenter is None else own.joined(self.indenter.errors(duration))

    def at(self, thickness: Array) -> Kernels:
        """Return the kernels for a thickness (nx, ny) [m] of a film that varies in the plane."""
        varying, lifts = self.varying, None
        assert varying is not None and self.film_strain is not None
        shares = varying.series.shares(thickness)
        if all(self.grid.periodic):
            # displacement by a mean pressure of one, less its mean, (M + 1, nx, ny)
            mean = jnp.mean(thickness)
            excess = (thickness - mean) / self.scale.length
            raised = sideways_compliance(varying.body, mean, wavenumbers(self.grid)) / self.scale.compliance
            lifts = varying.slopes[:, None, None] * excess
            lifts = lifts.at[0].add(-spectral.apply_circulant(raised, excess))
        family = replace(varying.family, weights=shares[1:], lifts=lifts)
        film = VaryingFilmStrain(varying.film_series, shares, thickness > 0.0, self.film_strain.weights)
        return replace(self, family=family, film_strain=film, varying=None)


def kernels(body: LayeredHalfSpace, indenter: Indenter, grid: Grid, *, nodes: int = DEFAULT_NODES) -> Kernels:
    """Compute the kernels of a body, an indenter and a grid, for use in several runs (``indent(kernels=...)``).

    Args:
        body: a ``LayeredHalfSpace``.
        indenter: the indenter, of which only the material is used; one that creeps or is coated has kernels of its own.
        grid: the ``Grid`` of the runs.
        nodes: number of common decay rates in each band of rates, static, 1 to 8. With two, the error of the displacement
            is 4e-7 for a film a tenth as stiff as its substrate and 3e-4 for a film as stiff as its substrate; use more for
            a stiffer film. The measured error is ``separation_error``. For several layers, or on a viscoelastic
            substrate, each node stands for 12 rates spread over the times of the materials, and for 4 coefficient
            functions; for 18 of each if a layer that does not flow lies over one that may, in which case the response is
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
    valid = valid & check_grid(grid)
    indenter, good = checked_indenter(indenter, grid)
    valid = valid & good & check_stiffness(body)
    surface = indenter.surface()
    if surface is not None:
        valid = valid & check_stiffness(surface)
    checks.whole("nodes", nodes, 1, 8)
    built = build(*as_float64((body, indenter, grid)), nodes=nodes)
    built = replace(built, made_of=solids_of(body, indenter))
    return built if valid is True else jax.tree.map(lambda a: jnp.where(valid, a, jnp.nan), built)


def solids_of(body: LayeredHalfSpace, indenter: Indenter) -> Any:
    """Return the tree of a body and of an indenter's material, with numbers and sequences of them as arrays (n,)."""
    many = lambda node: isinstance(node, list | tuple) and bool(node) and jax.tree_util.all_leaves(node)
    row = lambda value: jnp.ravel(jnp.asarray(value, jnp.float64))
    as_row = lambda node: jnp.concatenate([row(each) for each in node]) if many(node) else row(node)
    return jax.tree.map(as_row, (body, indenter.material), is_leaf=many)


def check_kernels(kernels: Kernels, body: LayeredHalfSpace, grid: Grid, indenter: Indenter) -> Verdict:
    """Check that kernels are those of a body, a grid and an indenter."""
    built, names = kernels.grid, ("of one that is elastic or rigid", "of one that creeps or is coated")
    has, needs = kernels.indenter is not None, indenter.surface() is not None
    checks.require(
        has == needs, f"kernels: expected those {names[needs]}, as the indenter is, got those {names[has]}"
    )
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
    made, own = kernels.made_of, solids_of(body, indenter)
    other = "kernels: expected those of this body and this material of the indenter, got those of"
    if made is not None:
        # of Maxwell and Kelvin-Voigt solids, or of layers that are bonded and loose, the numbers alone can be the same
        shapes = lambda tree: (jax.tree.structure(tree), [leaf.size for leaf in jax.tree.leaves(tree)])
        checks.require(shapes(made) == shapes(own), f"{other} other materials or layers")
        first, second = (jnp.concatenate(jax.tree.leaves(tree)) for tree in (made, own))
        equal = jnp.isclose(first, second, rtol=SAME, atol=0.0)
        if is_concrete(equal) and not np.all(equal):
            at = int(np.argmin(equal))
            raise ValueError(
                f"{other} another, with {float(first[at]):.10g} in the place of {float(second[at]):.10g}"
            )
        near = jnp.append(near, jnp.all(equal))
    if not is_concrete(near):
        return jnp.all(near)
    ours, theirs = (tuple(float(f"{float(d):.10g}") for d in g.spacing) for g in (built, grid))
    checks.require(bool(np.all(near)), f"kernels: expected those of cells of {theirs} m, got {ours} m")
    return True


def check_stiffness(body: LayeredHalfSpace) -> Verdict:
    """Check that a film is at most a million times as stiff as its substrate, up to which images are accurate."""
    ratio = stiffness_ratio(body)
    if not is_concrete(ratio):
        return ratio <= MOST_STIFF
    checks.require(
        float(ratio) <= MOST_STIFF * (1.0 + 1e-9),
        f"layer: expected at most {MOST_STIFF:g} times the substrate's modulus, got {float(ratio):.4g} times:"
        " the response of a stiffer film cannot be put on a grid",
    )
    return True


def build(body: LayeredHalfSpace, indenter: Indenter, grid: Grid, nodes: int = DEFAULT_NODES) -> Kernels:
    """Return ``kernels`` without checks, by two programs: an expensive one, the same for all grids, and one for each shape
    of a grid. An indenter that creeps or is coated has an expansion of its own."""
    surface, of_body = indenter.surface(), expansion(body, nodes=nodes)
    own = None if surface is None else expansion(surface, nodes=nodes)
    return assembled(body, indenter, grid, of_body, own, nodes=nodes)


def build_surface(body: LayeredHalfSpace, grid: Grid, scale: Scale, nodes: int = DEFAULT_NODES) -> Kernels:
    """Return the kernels of one surface alone, of a body or an indenter, in a scale; for use inside jit."""
    found = expansion(body, nodes=nodes)
    return _of_surface(body, grid, found, scaled_images(found, None, scale), scale, nodes)


def scale_of(body: LayeredHalfSpace, indenter: Indenter, grid: Grid) -> Scale:
    """Return the scale of a contact: dx, the area of a cell, and the compliance of a very wide contact, which is held
    constant in derivatives.

    The length is not held: it is by dx itself that cells are counted, also where no unit is converted, as in the cells that
    a velocity passes in a second.
    """
    compliance = jax.lax.stop_gradient(relaxed_compliance(body) + indenter.relaxed_compliance())
    return Scale(jnp.asarray(grid.spacing[0]), compliance, jnp.asarray(grid.cell_area))


class Expansion(NamedTuple):
    """Grid-independent part of the kernels: the response as a sum of products, its images (M + 1, J + 1), and errors
    (t, 2)."""

    separable: Separable
    images: Images
    errors: Array


EXPANDED = 5e4  # work of an expansion in cell steps (``Program``): 12 ms more if not optimised, and 1.2 s less to compile


@functools.partial(Program, static_argnames=("nodes",), work=lambda body, nodes: EXPANDED)
def expansion(body: LayeredHalfSpace, nodes: int) -> Expansion:
    """Return the expansion of a body, with ``nodes`` as in ``kernels``."""
    response = response_of(body)
    separable = response.separate(nodes)
    images = response.expand_separable(separable)

    # the errors of the images, at times spread around every rate
    response, held, fit = jax.lax.stop_gradient((response, separable, images))
    times, wavenumbers = check_times(held.rates), response.wavenumbers()
    exact = summed_products(held, held.terms, times[:, None])
    fitted = summed_products(held, fit.at(wavenumbers), times[:, None])
    errors = jnp.stack([times, image_errors(fitted, exact)], -1)
    return Expansion(separable, images, errors)


@functools.partial(
    Program,
    static_argnames=("nodes",),
    work=lambda body, indenter, grid, *_, nodes: 4.0 * math.prod(grid.shape),
)
def assembled(
    body: LayeredHalfSpace,
    indenter: Indenter,
    grid: Grid,
    expansion: Expansion,
    of_indenter: Expansion | None,
    nodes: int,
) -> Kernels:
    """Return the kernels on a grid from the expansion of the body.

    of_indenter: the expansion of an indenter that creeps or is coated, which has kernels of its own; None of any other,
    whose compliance is added to the body's.
    """
    scale, surface = scale_of(body, indenter, grid), indenter.surface()
    images = scaled_images(expansion, indenter, scale)
    kernels = _of_surface(body, grid, expansion, images, scale, nodes)
    if surface is None or of_indenter is None:
        return kernels
    images = scaled_images(of_indenter, None, scale)
    return replace(kernels, indenter=_of_surface(surface, grid, of_indenter, images, scale, nodes))


def _of_surface(
    body: LayeredHalfSpace, grid: Grid, expansion: Expansion, scaled: Images, scale: Scale, nodes: int
) -> Kernels:
    """Return the kernels of one surface, from its expansion and its images in the scale of the contact."""
    # C_0 and the S_m on the grid, with the displacement under a uniform pressure that a rigid base gives them
    top, (separable, _, errors) = top_layer(body), expansion
    mean = None
    if body.substrate is None:
        mean = separable.terms[:, 0] * body.height / scale.length
        mean = mean.at[0].divide(scale.compliance)
    family, coefficients = on_grid(grid, scaled, mean)
    # ``scaled_images`` divides C_0 [1/Pa] by the unit of compliance; the shapes S_m have no unit, and it is their weights in
    # time, ``mix`` and the film's own factors, that are divided by it
    mix = separable.mix / scale.compliance

    # the strain of the film, from S_1, the top layer's own shape
    film = None
    if top is not None:
        weights = separable.own_factors / scale.compliance
        film = FilmStrain(coefficients[1] * scale.length / top.thickness, weights)
    at_zero = separable.terms[1:, 0]
    horizon = jnp.asarray(separable.horizon)
    return Kernels(
        family=family,
        rates=separable.rates,
        mix=mix,
        film_strain=film,
        scale=scale,
        separation_error=separable.error,
        horizon=horizon,
        image_errors=errors,
        at_zero=at_zero,
        grid=grid,
        nodes=nodes,
        rigid_base=mean is not None,
    )


def scaled_images(expansion: Expansion, indenter: Indenter | None, scale: Scale) -> Images:
    """Return the images of C_0, with the compliance of an elastic indenter, and of the shapes, scaled; depths in m."""
    images, elastic = expansion.images, indenter is not None and indenter.surface() is None
    own = indenter.compliance() if indenter is not None and elastic else 0.0
    heights = images.heights.at[0].add(own) / scale.length
    return Images(images.depths, heights.at[0].divide(scale.compliance))


def on_grid(grid: Grid, images: Images, mean: Array | None = None) -> tuple[Family, Array]:
    """Return the operators of images of heights (m, J + 1), and their coefficients at offsets (i, j) >= 0, (m, nx, ny).

    mean: displacement under a uniform pressure of one, of bodies on a rigid base, (m,); None: relative to the mean.
    """
    if all(grid.periodic):
        response = periodic_response(grid, images, 0.0 if mean is None else mean)
        family = Family.of_spectra(response)
        return family, periodic_coefficients(grid, images, mean)
    coefficients = (strip_coefficients if any(grid.periodic) else influence_coefficients)(grid, images)
    return Family.of(coefficients, grid.periodic), coefficients


def largest_until(errors: Array, last: Array) -> Array:
    """Return the largest error up to a time [s], at least the earliest, (); errors: rows of time and error, (t, 2)."""
    times, each = errors.T
    return jnp.max(jnp.where(times <= jnp.maximum(last, jnp.min(times)), each, 0.0))


# The shortening of a film at the deepest point of a contact, over its thickness there.


@pytree
class FilmStrain:
    """The shortening of a film of one thickness, as if on a rigid base, over its thickness.

    coefficients: displacement at offsets (i, j) >= 0 under a unit pressure on one cell, times the film's modulus, over its
    thickness, (nx, ny); weights [1/A] of the pressure and of the history fields, (1 + K,).
    """

    coefficients: Array
    weights: Array

    def strain(self, pressure: Array, history: Array) -> Array:
        """Return the strain at the deepest point, (), from the pressure (nx, ny) and the history fields (K, nx, ny)."""
        return deepest_strain(self.coefficients, _hereditary(self.weights, pressure, history))


@pytree
class VaryingFilmStrain:
    """The shortening of a film whose thickness varies in the plane, over its thickness.

    series: of the coefficients of ``FilmStrain`` in Chebyshev polynomials of the thickness, (n, nx, ny); shares: the
    polynomials of the thickness at each cell, (n, nx, ny); present: cells with a film, (nx, ny) bool; weights: as in
    ``FilmStrain``.
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
    """Return the indices of the largest value; where many cells have it, as those that carry the hardness of a surface that
    yields, of one in their middle: in the row that has the most of them.
    """
    largest = jnp.max(strain)
    least = largest - SAME * jnp.abs(largest)
    number = jnp.sum(strain >= least, axis=1)
    i = _middle(number == jnp.max(number))
    return i, _middle(strain[i] >= least)


def _middle(some: Array) -> Array:
    """Return the index of the middle one of the true values of (n,)."""
    count = jnp.cumsum(some)
    return jnp.argmax(2 * count > count[-1])


def _around(coefficients: Array, i: Array, j: Array) -> Array:
    """Return the coefficients at the offsets of all cells from cell (i, j)."""
    nx, ny = coefficients.shape
    return coefficients[jnp.abs(jnp.arange(nx) - i)][:, jnp.abs(jnp.arange(ny) - j)]


# The normal displacement under the tractions of sliding friction, which come with the pressure.
#
# Where all of a contact slides along the unit vector e, the traction on the body is q = mu p e (C. A. Coulomb), and sinks
# the surface by K_zx * mu p e_x + K_zy * mu p e_y, kernels that are odd in the offset along the traction. They vanish for
# two similar solids, and are then no concern of the pressure. The surface of an indenter that creeps or is coated has
# kernels of the opposite sign, since the normal and the traction on it are both reversed.


@pytree
class FrictionKernels:
    """The normal displacement of a surface under the traction of a contact that slips everywhere, and mu.

    coefficient: mu, () or (nx, ny); normal_from_tangential: K_zx and K_zy of C_0 and of the S_m at offsets (i, j) >= 0,
    (M + 1, 2, nx, ny); rates lambda_k [1/s], (K,), mix (M, K), as in ``TractionKernels``; expansion: the tangential
    response that they come from.
    """

    coefficient: Array
    normal_from_tangential: Array
    rates: Array
    mix: Array
    expansion: TangentialExpansion

    @property
    def scale(self) -> Array:
        """The factor of the kernels, (): mu where it is one number, and the kernels then act on the pressure itself."""
        return self.coefficient if self.coefficient.ndim == 0 else jnp.ones(())

    @property
    def weights(self) -> Array | None:
        """The factor of the pressure before the kernels act on it, (nx, ny): mu where it varies, otherwise None."""
        return self.coefficient if self.coefficient.ndim else None

    def sheared(self, pressure: Array) -> Array:
        """Return the field on which the kernels act, (nx, ny)."""
        return pressure if self.weights is None else self.weights * pressure

    def coulomb_force(self, pressure: Array) -> Array:
        """Return the sum of mu p, ()."""
        return jnp.sum(self.coefficient * pressure)

    def added_to(self, operator: Operator, kernel: Array) -> Operator:
        """Return the operator of pressure and traction, from that of the pressure and the spectrum of the kernel.

        kernel: (my/2 + 1, mx), along the direction of sliding. The preconditioner stays that of the pressure.
        """
        if self.weights is None:
            return replace(operator, spectra=operator.spectra + kernel)
        spectra = jnp.concatenate([operator.spectra, kernel[None]])
        return replace(operator, spectra=spectra, weights=self.weights[None], entries=((0, 0, 0), (0, 1, 1)))

    def spectra(self, shape: tuple[int, int]) -> Array:
        """Return the spectra of ``scale`` K on the first cells, (M + 1, 2, my/2 + 1, mx)."""
        x, y = jnp.moveaxis(self.normal_from_tangential[..., : shape[0], : shape[1]], 1, 0)
        return self.scale * jnp.stack([spectrum(x, -1, 1), spectrum(y, 1, -1)], 1)

    def lasting(self, spectra: Array) -> Array:
        """Return the spectra of ``scale`` lambda_k C_k, (K, 2, my/2 + 1, mx), from those of ``spectra``."""
        return jnp.tensordot(self.mix.T, spectra[1:], 1)

    def point_strength(self) -> Array:
        """Return 2 pi ``scale`` lambda_k C_k at a distance of one straight ahead of a unit force, (K,)."""
        return self.scale * (self.expansion.separable.terms[2, 1:, 0] @ self.mix)


def friction_kernels_of_indenter(
    indenter: Indenter, grid: Grid, scale: Scale, coefficient: Array
) -> FrictionKernels | None:
    """Return the kernels of friction of an indenter that creeps or is coated, None of any other; for use inside jit."""
    surface = indenter.surface()
    if surface is None:
        return None
    return friction_kernels(mirrored(tangential_expansion(surface)), indenter, grid, scale, coefficient)


def friction_kernels(
    expansion: TangentialExpansion, indenter: Indenter, grid: Grid, scale: Scale, coefficient: Array
) -> FrictionKernels:
    """Return the kernels of friction of a body, with the compliance of an elastic indenter; for use inside jit."""
    coefficients = scaled_coefficients(expansion, indenter, grid, scale)
    # by reciprocity minus the displacement along x and y under a pressure
    normal_from_tangential = -jnp.stack([coefficients.x, coefficients.y], 1)
    mix = expansion.separable.mix / scale.compliance
    return FrictionKernels(coefficient, normal_from_tangential, expansion.separable.rates, mix, expansion)


# Kernels of traction: the response of body and indenter in three directions on a grid, ready for the march.


@pytree
class TractionKernels:
    """normal: as in ``indent``; family: the tangential operators C_0 and S_m; rates [1/s], (K,); mix (M, K); expansion: the
    tangential response that they come from; indenter: those of an indenter that creeps or is coated, or None.

    The tangential response has rates of its own, at which the tangential displacement under the pressure is remembered as
    well.
    """

    normal: Kernels
    family: CoupledFamily
    rates: Array
    mix: Array
    expansion: TangentialExpansion
    indenter: TractionKernels | None = None

    def errors(self, duration: Array | float = jnp.inf) -> Errors:
        """Return the errors of a run of a duration [s], the larger ones of the normal and the tangential response."""
        found = joint_errors(self.normal, self.expansion, duration=duration)
        return found if self.indenter is None else found.joined(self.indenter.errors(duration))


def joint_errors(
    normal: Kernels, *expansions: TangentialExpansion, duration: Array | float = jnp.inf
) -> Errors:
    """Return the larger errors of normal and tangential responses in a run of a duration [s]."""
    errors = normal.errors(duration)
    for expansion in expansions:
        images = largest_until(expansion.image_errors, jnp.minimum(duration, errors.horizon))
        errors = errors.joined(Errors(expansion.separation_error, images, errors.horizon))
    return errors


@functools.partial(
    Program,
    static_argnames=("coupled",),
    work=lambda normal, expansion, of_indenter, indenter, grid, coupled: 4.0 * math.prod(grid.shape),
)
def assembled_traction(
    normal: Kernels,
    expansion: TangentialExpansion,
    of_indenter: TangentialExpansion | None,
    indenter: Indenter,
    grid: Grid,
    *,
    coupled: bool,
) -> TractionKernels:
    """Return the kernels of the expansions of body and indenter on a grid; ``normal``: those of the same body, indenter and
    grid; of_indenter: of one that creeps or is coated, or None.

    Tangential compliances of the two solids add, while their couplings of normal and tangential subtract.
    """

    def of(normal: Kernels, expansion: TangentialExpansion) -> TractionKernels:
        coefficients = scaled_coefficients(expansion, indenter, grid, normal.scale)
        family = CoupledFamily(Tangential.of(coefficients, coupled=coupled, periodic=grid.periodic))
        mix = expansion.separable.mix / normal.scale.compliance
        return TractionKernels(normal, family, expansion.separable.rates, mix, expansion)

    kernels = of(normal, expansion)
    if of_indenter is None or normal.indenter is None:
        return kernels
    return replace(kernels, indenter=of(normal.indenter, mirrored(of_indenter)))


def mirrored(expansion: TangentialExpansion) -> TangentialExpansion:
    """Return the expansion of a surface that faces down, with the opposite coupling of normal and tangential."""
    separable, images = expansion.separable, expansion.images
    facing = lambda a: a * jnp.array([1.0, 1.0, -1.0])[:, None, None]  # of alpha (L, T, K)
    return expansion._replace(
        separable=replace(separable, terms=facing(separable.terms)),
        images=replace(images, weights=facing(images.weights)),
    )


def build_traction(
    body: LayeredHalfSpace, indenter: Indenter, grid: Grid, *, coupled: bool
) -> TractionKernels:
    """Return the kernels of a body, an indenter and a grid; the programs of the expansions hold for all grids."""
    normal, surface = build(body, indenter, grid), indenter.surface()
    own = None if surface is None else _tangential_program(surface)
    return assembled_traction(normal, _tangential_program(body), own, indenter, grid, coupled=coupled)


_tangential_program = Program(tangential_expansion, work=lambda body: EXPANDED)


def scaled_coefficients(
    expansion: TangentialExpansion, indenter: Indenter, grid: Grid, scale: Scale
) -> SurfaceKernels:
    """The coefficients of C_0, with the indenter's, and of the S_m, (M + 1, nx, ny) in cells."""
    images, weights = expansion.images, expansion.images.weights
    material = indenter.material
    if isinstance(material, Elastic):
        # its alpha (L, T, K) [1/Pa] is added; K has the opposite sign on a surface that faces down
        shares = half_space_shares(material) * jnp.array([1.0, 1.0, -1.0])
        weights = weights.at[:, 0, 0].add(shares * material.spectrum().instantaneous)
    coefficients_of = tangential_lines if grid.plane_strain else tangential_coefficients
    coefficients = coefficients_of(grid, TangentialImages(images.depths, weights))
    scaled = jax.tree.map(lambda a: a / scale.length, coefficients)
    return jax.tree.map(lambda a: a.at[0].divide(scale.compliance), scaled)


# Kernels whose weights of the images are given for each pair of times, as the quasi-elastic correspondence needs them
# (``history.memory.DirectMemory``).


@pytree
class ImageKernels:
    """The operators of the single steps of the staircase of ``response.images``, of which a kernel at any lag is a weighted
    sum.

    film_coefficients: as in ``FilmStrain``, or None; image_error: as in ``Kernels``.
    """

    family: Family
    film_coefficients: Array | None
    scale: Scale
    image_error: Array


def build_images(body: LayeredHalfSpace, indenter: Indenter, grid: Grid) -> ImageKernels:
    """Return the operators of the single steps of the staircase for a body and an indenter on a grid."""
    response, top, scale = response_of(body), top_layer(body), scale_of(body, indenter, grid)
    alpha = response.wavenumbers()
    shape = jnp.zeros_like(alpha) if top is None else film_shape(top, alpha)
    on_base = response.expand_shapes(jnp.zeros((0, alpha.size)), shape[None], jnp.zeros((0, alpha.size)))
    unit = jnp.eye(on_base.depths.size + 1) / (scale.length * scale.compliance)
    family, _ = on_grid(grid, Images(on_base.depths, unit))
    film = None if top is None else on_grid(grid, on_base)[1][0] / top.thickness

    # the largest error of the images, at times spread around the rates of the surface
    response, surface = jax.lax.stop_gradient((response, surface_material(body)))
    times, alpha = check_times(surface.spectrum().rates)[:, None], response.wavenumbers()
    values = response.quasi_elastic(alpha, times, times)
    error = jnp.max(image_errors(response.expand(values).at(alpha), values))
    return ImageKernels(family, film, scale, error)


def image_weights(
    body: LayeredHalfSpace, indenter: Indenter, start: Array, end: Array, *, quasi_elastic: bool
) -> Array:
    """Return the heights of the staircase for the mean response over the lags from start to end, (..., J + 1) [1/Pa]."""
    response = response_of(body)
    respond = response.quasi_elastic if quasi_elastic else response.mean_response
    values = respond(response.wavenumbers(), start[..., None], end[..., None])
    return response.expand(values).heights + indenter.compliance()


# Operators of a film whose thickness h varies in the plane.
#
# The body at a point is taken for a uniform one of the thickness there, and the operator is made symmetric. With the
# kernels as a series in the thickness, K(h) = sum_n T_n(xi(h)) K_n in Chebyshev polynomials,
#
#     u = 1/2 sum_n [T_n(xi(h)) K_n p + K_n (T_n(xi(h)) p)].
#
# The operator obeys reciprocity, <q, K p> = <p, K q>, and for a uniform thickness it is that of the uniform body. It
# is exact to first order in the slope of the thickness: a film with a slope of 0.06 is within 0.3 % of a finite
# element solution, one with 0.16 within 1 %.
#
# The variable of the series is xi ~ log(1 + h/c), c the size of a cell: linear in h where the film is thin on the
# grid, where the kernels are linear in h too, and logarithmic where it is thick, where they vary over lengths of the
# order of h. The nodes include both ends of the range, so that a bare base is exactly represented. A series of n terms
# costs n convolutions: three or four of them suffice where the film is thin on the grid.
#
# On a grid that is periodic along both axes the operator is that of the pressures and displacements of zero mean. A
# mean pressure p0 moves the surface by w(x) p0: without its mean, the film's compliance in uniaxial strain times its
# thickness less what the film, which presses sideways, lifts the surface where it is thick
# (``response.normal.sideways_compliance``). By reciprocity, displacement is then from the mean of the surface but for
# mean(w p).
#
# The response of one layer depends on alpha h alone, with rates and a mix that are those of every thickness. Its
# images are therefore made once: for another thickness their depths change in proportion, and their heights stay.


FINENESS = 256.0  # the range of log(1 + h/c) is rounded outwards to multiples of one over this
DEFAULT_TERMS = 6  # where the thickness is not known yet, within jit and grad
FEWER, MOST_TERMS = (3, 4, 5, 6, 8, 10), 12  # the first of these whose error is below ENOUGH, or the last
ENOUGH = 1e-5
THINNEST = 1e-9  # thickness in cells that stands for a film of no thickness
SHORTEST_WAVE = 8.0  # cells: shorter waves carry little of a pressure that the grid resolves
WAVES, THICKNESSES = 24, 17  # at which the error of the series is measured


@pytree
class ThicknessSeries:
    """The variable xi of the series in the thickness, and its nodes.

    length: c [m]; low, high: the range of log(1 + h/c) in which the series is made, (); count: its terms, static.
    """

    length: Array
    low: Array
    high: Array
    count: int = static()

    @classmethod
    def of(cls, thickness: Array, length: Array | float, count: int) -> ThicknessSeries:
        """Return the series for all values of a thickness.

        The range is rounded outwards, so that it does not follow small changes of the thickness, and carries no derivative.
        The length carries one, on which results do not depend but for the error of the series.
        """
        held = jax.lax.stop_gradient(jnp.log1p(jnp.asarray(thickness) / length))
        low, high = jnp.floor(FINENESS * jnp.min(held)), jnp.floor(FINENESS * jnp.max(held)) + 1.0
        return cls(jnp.asarray(length, float), low / FINENESS, high / FINENESS, count)

    def nodes(self) -> Array:
        """Return the thicknesses at which the kernels are to be known [m], (n,), all above zero."""
        return self._thickness(self._points())

    def spread(self, count: int) -> Array:
        """Return thicknesses over the whole range, ends included [m], (count,)."""
        return self._thickness(jnp.linspace(-1.0, 1.0, count))

    def shares(self, thickness: Array) -> Array:
        """Return T_0 to T_(n-1) of a thickness (...), (n, ...)."""
        middle, half = (self.low + self.high) / 2.0, (self.high - self.low) / 2.0
        return _polynomials((jnp.log1p(thickness / self.length) - middle) / half, self.count)

    def coefficients(self, values: Array) -> Array:
        """Return the coefficients of the series through values at the nodes, both (n, ...)."""
        ends = jnp.ones(self.count).at[jnp.array([0, -1])].set(0.5)
        matrix = 2.0 / (self.count - 1) * ends[:, None] * ends * _polynomials(self._points(), self.count)
        return jnp.tensordot(matrix, values, 1)

    def _points(self) -> Array:
        return jnp.cos(jnp.pi * jnp.arange(self.count) / (self.count - 1))

    def _thickness(self, xi: Array) -> Array:
        middle, half = (self.low + self.high) / 2.0, (self.high - self.low) / 2.0
        return self.length * jnp.expm1(middle + half * xi)


def _polynomials(xi: Array, count: int) -> Array:
    """Return the first Chebyshev polynomials of xi (...), (count, ...)."""
    values = [jnp.ones_like(xi), xi]
    for _ in range(count - 2):
        values.append(2.0 * xi * values[-1] - values[-2])
    return jnp.stack(values[:count])


@pytree
class VaryingThickness:
    """What the kernels of a film are made of for all values of its thickness.

    body: with a film of one thickness; series: in the thickness; family: the operators of the terms of the series, without
    its weights and lifts; film_series (n, nx, ny): as in ``VaryingFilmStrain``; slopes (M + 1,): of the displacement under a
    mean pressure over the thickness; error: the largest relative error of the series, ().
    """

    body: LayeredHalfSpace
    series: ThicknessSeries
    family: Family
    film_series: Array
    slopes: Array
    error: Array


# Kernels of a film whose thickness varies in the plane.


def build_varying(
    body: LayeredHalfSpace,
    indenter: Indenter,
    grid: Grid,
    thickness: Array,
    nodes: int = DEFAULT_NODES,
    terms: int | None = None,
) -> Kernels:
    """Build the kernels for all values of a thickness [m]; body: with a film of any one thickness.

    terms: of the series in the thickness; by default as many as its error requires, if the thickness is known.
    """
    of_body = expansion(body, nodes=nodes)
    if terms is None:
        terms = DEFAULT_TERMS
        if is_concrete(body, grid, of_body, thickness):
            ends = jnp.stack([jnp.min(thickness), jnp.max(thickness)])
            errors = np.asarray(series_errors(body, grid, of_body, ends))
            enough = np.flatnonzero(errors <= ENOUGH)
            terms = FEWER[enough[0]] if enough.size else MOST_TERMS
    surface = indenter.surface()
    own = None if surface is None else expansion(surface, nodes=nodes)
    return assembled_varying(body, indenter, grid, of_body, own, thickness, nodes=nodes, terms=terms)


@functools.partial(
    Program,
    static_argnames=("nodes", "terms"),
    work=lambda body, indenter, grid, *_, terms, **__: float(terms * math.prod(grid.shape)),
)
def assembled_varying(
    body: LayeredHalfSpace,
    indenter: Indenter,
    grid: Grid,
    expansion: Expansion,
    of_indenter: Expansion | None,
    thickness: Array,
    nodes: int,
    terms: int,
) -> Kernels:
    """Return the kernels from the expansion of a film of one thickness, and that of the indenter as in ``assembled``."""
    uniform = assembled(body, indenter, grid, expansion, of_indenter, nodes=nodes)
    scaled = scaled_images(expansion, indenter, uniform.scale)
    film = top_layer(body)
    assert film is not None and uniform.film_strain is not None
    reference = jnp.asarray(film.thickness, float)
    cell = cell_of(grid)
    series = ThicknessSeries.of(thickness, cell, terms)

    def node(h: Array) -> tuple[Family, Array]:
        family, coefficients = on_grid(grid, Images(scaled.depths * (h / reference), scaled.heights))
        strains = coefficients[1] * uniform.scale.length / jnp.maximum(h, THINNEST * cell)
        return replace(family, wide=None), strains

    nodes_of = jax.lax.map(node, jnp.maximum(series.nodes(), THINNEST * cell))
    family, strains = jax.tree.map(series.coefficients, nodes_of)
    family = _as_one(family, terms)

    # the displacement of a film on a rigid base under a uniform pressure, over the response of its creep and the thickness
    heights = scaled.heights[1]
    bed = (heights[:-1] - heights[-1]) @ jnp.diff(scaled.depths, prepend=0.0)
    bed = bed / reference * uniform.scale.length
    slopes = jnp.zeros(len(family.spectra)).at[0].set(uniform.film_strain.weights[0] * bed).at[1].set(bed)
    error = jax.lax.stop_gradient(_series_error(series, expansion, body, grid))
    return replace(uniform, varying=VaryingThickness(body, series, family, strains, slopes, error))


def _as_one(terms: Family, count: int) -> Family:
    """Return the operators of all terms from operators of one kernel for each, whose leaves have a first axis (n, ...)."""
    halves = jnp.full(count, 0.5).at[0].set(1.0)[:, None, None]
    together = lambda a: jnp.swapaxes(a[:, :, 0], 0, 1)
    window = None if terms.window is None else _as_one(terms.window, count)
    return replace(
        terms,
        spectra=halves * together(terms.spectra),
        circulants=together(terms.circulants),
        window=window,
        entries=series_entries(count),
    )


@functools.partial(Program, work=lambda *_: EXPANDED)
def series_errors(body: LayeredHalfSpace, grid: Grid, expansion: Expansion, thickness: Array) -> Array:
    """Return the errors of the series of ``FEWER`` terms, (6,)."""
    cell = cell_of(grid)
    error = lambda n: _series_error(ThicknessSeries.of(thickness, cell, n), expansion, body, grid)
    return jnp.stack([error(n) for n in FEWER])


def cell_of(grid: Grid) -> Array:
    """Return the shorter side of a cell that the fields vary along [m]."""
    return jnp.asarray(grid.spacing[0] if grid.plane_strain else jnp.minimum(*grid.spacing))


def _series_error(series: ThicknessSeries, expansion: Expansion, body: LayeredHalfSpace, grid: Grid) -> Array:
    """Return the largest error of the series relative to the response, over waves that the grid resolves, times and
    thicknesses in the range of the series."""
    width = grid.width[0] if grid.plane_strain else jnp.maximum(*grid.width)
    longest, shortest = jnp.log(width), jnp.log(SHORTEST_WAVE * cell_of(grid))
    alpha = 2.0 * jnp.pi / jnp.exp(jnp.linspace(shortest, longest, WAVES))
    times = check_times(expansion.separable.rates)[:, None]
    images, film = expansion.images, top_layer(body)
    assert film is not None
    reference = jnp.asarray(film.thickness, float)

    def response(h: Array) -> Array:
        at = Images(images.depths * (h / reference), images.heights).at(alpha)
        return summed_products(expansion.separable, at, times)

    checked = series.spread(THICKNESSES)
    exact, nodes = jax.vmap(response)(checked), jax.vmap(response)(series.nodes())
    found = jnp.tensordot(series.shares(checked).T, series.coefficients(nodes), 1)
    return jnp.max(jnp.abs(found / exact - 1.0))
