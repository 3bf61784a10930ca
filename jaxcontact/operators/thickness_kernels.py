"""Kernels of one film whose thickness varies in the plane, on an elastic half-space.

The response of one layer depends on alpha h alone, with rates and a mix that are those of every thickness. Its images are
therefore made once: for another thickness their depths change in proportion, and their heights stay.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support.pytree import is_concrete, pytree, replace
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.operators import spectral
from jaxcontact.operators.film import VaryingFilm
from jaxcontact.operators.kernels import (
    Errors,
    Expansion,
    Kernels,
    compiled_expansion,
    on_grid,
    scaled_images,
)
from jaxcontact.operators.kernels import assembled as uniform_kernels
from jaxcontact.operators.varying import ThicknessSeries, VaryingFamily, WindowSpectra
from jaxcontact.response.body import sideways_compliance
from jaxcontact.response.influence.images import Images
from jaxcontact.response.influence.periodic import wavenumbers
from jaxcontact.response.limits import limits_of
from jaxcontact.response.time.separable import DEFAULT_NODES, check_times, products

DEFAULT_TERMS = 6  # where the thickness is not known yet, within jit and grad
FEWER, MOST_TERMS = (3, 4, 5, 6), 8  # the first of these whose error is below ENOUGH, or the last
ENOUGH = 1e-5
THINNEST = 1e-9  # cells: stands for a film of no thickness
SHORTEST_WAVE = 8.0  # cells: shorter waves carry little of a pressure that the grid resolves
WAVES, THICKNESSES = 24, 17  # at which the error of the series is measured


@pytree
class VaryingKernels:
    """Discretised response of a body with a film of varying thickness, and an indenter, on a grid.

    body: with a film of one thickness; uniform: its kernels, for all that does not depend on the thickness; spectra and
    circulant (n, M + 1, ...) and window: as in ``VaryingFamily``; film_series (n, nx, ny): as in ``VaryingFilm``;
    slopes (M + 1,): of the displacement under a mean pressure over the thickness; series_error: the largest relative error
    of the series, ().
    """

    body: LayeredHalfSpace
    uniform: Kernels
    series: ThicknessSeries
    spectra: Array
    circulant: Array
    window: WindowSpectra | None
    film_series: Array
    slopes: Array
    series_error: Array

    def errors(self, duration: Array | float = jnp.inf) -> Errors:
        """Return what a run of a duration [s] on them is told to be off by."""
        return self.uniform.errors(duration)._replace(thickness=self.series_error)

    def at(self, thickness: Array) -> Kernels:
        """Return the kernels for a thickness (nx, ny) [m]."""
        shares, periodic = self.series.shares(thickness), self.uniform.grid.periodic
        uneven = self._uneven(thickness) if all(periodic) else jnp.zeros((self.slopes.size, 1, 1))
        family = VaryingFamily(self.spectra, self.circulant, shares, uneven, self.window, periodic)
        assert self.uniform.film is not None
        film = VaryingFilm(self.film_series, shares, thickness > 0.0, self.uniform.film.weights)
        return replace(self.uniform, family=family, film=film)

    def _uneven(self, thickness: Array) -> Array:
        """Return the displacement by a mean pressure of one, less its mean, of all members, (M + 1, nx, ny)."""
        scale, mean = self.uniform.scale, jnp.mean(thickness)
        excess = (thickness - mean) / scale.length
        raised = sideways_compliance(self.body, mean, wavenumbers(self.uniform.grid)) / scale.compliance
        shortened = self.slopes[:, None, None] * excess
        return shortened.at[0].add(-spectral.apply_circulant(raised, excess))


def compiled_varying(
    body: LayeredHalfSpace,
    indenter: Indenter,
    grid: Grid,
    thickness: Array,
    nodes: int = DEFAULT_NODES,
    terms: int | None = None,
) -> VaryingKernels:
    """Build the kernels for all values of a thickness [m]; body: with a film of any one thickness.

    terms: of the series in the thickness; by default as many as its error requires, if the thickness is known.
    """
    expansion = compiled_expansion(body, nodes=nodes)
    if terms is None:
        terms = _terms_for(body, grid, expansion, thickness)
    return _assembled(body, indenter, grid, expansion, thickness, nodes=nodes, terms=terms)


def assembled(
    body: LayeredHalfSpace,
    indenter: Indenter,
    grid: Grid,
    expansion: Expansion,
    thickness: Array,
    nodes: int,
    terms: int,
) -> VaryingKernels:
    """Return the kernels from the expansion of a film of one thickness."""
    uniform = uniform_kernels(body, indenter, grid, expansion, nodes)
    scaled = scaled_images(expansion, indenter, uniform.scale)
    film = limits_of(body).film
    assert film is not None and uniform.film is not None
    reference = jnp.asarray(film.thickness, float)
    cell = cell_of(grid)
    series = ThicknessSeries.of(thickness, cell, terms)

    def node(h: Array) -> tuple[Array, Array, WindowSpectra | None, Array]:
        family, coefficients = on_grid(grid, Images(scaled.depths * (h / reference), scaled.heights))
        strains = coefficients[1] * uniform.scale.length / jnp.maximum(h, THINNEST * cell)
        members, part = family.members, family.members.window
        window = None if part is None else WindowSpectra(part.spectrum, part.circulant)
        return members.spectrum, members.circulant, window, strains

    nodes_of = jax.lax.map(node, jnp.maximum(series.nodes(), THINNEST * cell))
    spectra, circulant, window, strains = jax.tree.map(series.coefficients, nodes_of)
    bed = _bed(scaled) / reference * uniform.scale.length
    slopes = jnp.zeros(len(spectra[0])).at[0].set(uniform.film.weights[0] * bed).at[1].set(bed)
    error = jax.lax.stop_gradient(_series_error(series, expansion, body, grid))
    return VaryingKernels(body, uniform, series, spectra, circulant, window, strains, slopes, error)


_assembled = Program(assembled, ("nodes", "terms"))


def _terms_for(body: LayeredHalfSpace, grid: Grid, expansion: Expansion, thickness: Array) -> int:
    """Return how many terms the series for a thickness needs."""
    if not is_concrete(body, grid, expansion, thickness):
        return DEFAULT_TERMS
    ends = jnp.stack([jnp.min(thickness), jnp.max(thickness)])
    errors = np.asarray(_series_errors(body, grid, expansion, ends))
    return next((n for n, error in zip(FEWER, errors, strict=True) if error <= ENOUGH), MOST_TERMS)


def series_errors(body: LayeredHalfSpace, grid: Grid, expansion: Expansion, thickness: Array) -> Array:
    """Return the errors of the series of ``FEWER`` terms, (4,)."""
    cell = cell_of(grid)
    error = lambda n: _series_error(ThicknessSeries.of(thickness, cell, n), expansion, body, grid)
    return jnp.stack([error(n) for n in FEWER])


_series_errors = Program(series_errors)


def cell_of(grid: Grid) -> Array:
    """Return the shorter side of a cell that the fields vary along [m]."""
    return jnp.asarray(grid.spacing[0] if grid.plane_strain else jnp.minimum(*grid.spacing))


def _bed(images: Images) -> Array:
    """Return the displacement of a film on a rigid base under a uniform pressure, over the response of its creep, ()."""
    heights = images.heights[1]
    return (heights[:-1] - heights[-1]) @ jnp.diff(images.depths, prepend=0.0)


def _series_error(series: ThicknessSeries, expansion: Expansion, body: LayeredHalfSpace, grid: Grid) -> Array:
    """Return the largest error of the series relative to the response, over waves that the grid resolves, times and
    thicknesses in the range of the series."""
    width = grid.width[0] if grid.plane_strain else jnp.maximum(*grid.width)
    longest, shortest = jnp.log(width), jnp.log(SHORTEST_WAVE * cell_of(grid))
    alpha = 2.0 * jnp.pi / jnp.exp(jnp.linspace(shortest, longest, WAVES))
    times = check_times(expansion.separable.rates)[:, None]
    images, film = expansion.images, limits_of(body).film
    assert film is not None
    reference = jnp.asarray(film.thickness, float)

    def response(h: Array) -> Array:
        at = Images(images.depths * (h / reference), images.heights).at(alpha)
        return products(expansion.separable, at, times)

    checked = series.spread(THICKNESSES)
    exact, nodes = jax.vmap(response)(checked), jax.vmap(response)(series.nodes())
    found = jnp.tensordot(series.shares(checked).T, series.coefficients(nodes), 1)
    return jnp.max(jnp.abs(found / exact - 1.0))
