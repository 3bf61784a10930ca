"""Kernels of one film whose thickness varies in the plane, on an elastic half-space.

The response of one layer depends on alpha h alone, with rates and a mix that are those of every thickness. Its images are
therefore made once: for another thickness their depths change in proportion, and their heights stay.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support.pytree import pytree, replace
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
from jaxcontact.operators.varying import ThicknessSeries, VaryingFamily
from jaxcontact.response.body import sideways_compliance
from jaxcontact.response.influence.images import Images
from jaxcontact.response.influence.periodic import wavenumbers
from jaxcontact.response.limits import limits_of
from jaxcontact.response.time.separable import DEFAULT_NODES, check_times, products

DEFAULT_TERMS = 6
SHORTEST_WAVE = 8.0  # cells: shorter waves carry little of a pressure that the grid resolves
WAVES, THICKNESSES = 24, 17  # at which the error of the series is measured


@pytree
class VaryingKernels:
    """Discretised response of a body with a film of varying thickness, and an indenter, on a grid.

    body: with a film of one thickness; uniform: its kernels, for all that does not depend on the thickness; spectra and
    circulant (n, M + 1, ...): as in ``VaryingFamily``; film_series (n, nx, ny): as in ``VaryingFilm``; slopes (M + 1,): of
    the displacement under a mean pressure over the thickness; series_error: the largest relative error of the series, ().
    """

    body: LayeredHalfSpace
    uniform: Kernels
    series: ThicknessSeries
    spectra: Array
    circulant: Array
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
        family = VaryingFamily(self.spectra, self.circulant, shares, uneven, periodic)
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
    terms: int = DEFAULT_TERMS,
) -> VaryingKernels:
    """Build the kernels for all values of a thickness [m]; body: with a film of any one thickness."""
    expansion = compiled_expansion(body, nodes=nodes)
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
    cell = grid.spacing[0] if grid.plane_strain else jnp.minimum(*grid.spacing)
    series = ThicknessSeries.of(thickness, cell, terms)

    def node(h: Array) -> tuple[Array, Array, Array]:
        family, coefficients = on_grid(grid, Images(scaled.depths * (h / reference), scaled.heights))
        strains = coefficients[1] * uniform.scale.length / h
        return family.members.spectrum, family.members.circulant, strains

    spectra, circulant, strains = map(series.coefficients, jax.lax.map(node, series.nodes()))
    bed = _bed(scaled) / reference * uniform.scale.length
    slopes = jnp.zeros(len(spectra[0])).at[0].set(uniform.film.weights[0] * bed).at[1].set(bed)
    error = jax.lax.stop_gradient(_series_error(series, expansion, uniform, reference, grid))
    return VaryingKernels(body, uniform, series, spectra, circulant, strains, slopes, error)


_assembled = Program(assembled, ("nodes", "terms"), fast_compile=True)


def _bed(images: Images) -> Array:
    """Return the displacement of a film on a rigid base under a uniform pressure, over the response of its creep, ()."""
    heights = images.heights[1]
    return (heights[:-1] - heights[-1]) @ jnp.diff(images.depths, prepend=0.0)


def _series_error(
    series: ThicknessSeries, expansion: Expansion, uniform: Kernels, reference: Array, grid: Grid
) -> Array:
    """Return the largest error of the series relative to the response, over waves that the grid resolves, times and
    thicknesses in the range of the series."""
    width = grid.width[0] if grid.plane_strain else jnp.maximum(*grid.width)
    cell = grid.spacing[0] if grid.plane_strain else jnp.minimum(*grid.spacing)
    alpha = 2.0 * jnp.pi / jnp.exp(jnp.linspace(jnp.log(SHORTEST_WAVE * cell), jnp.log(width), WAVES))
    times = check_times(expansion.separable.rates)[:, None]
    images = expansion.images

    def response(h: Array) -> Array:
        at = Images(images.depths * (h / reference), images.heights).at(alpha)
        return products(expansion.separable, at, times)

    checked = series.spread(THICKNESSES)
    exact, nodes = jax.vmap(response)(checked), jax.vmap(response)(series.nodes())
    found = jnp.tensordot(series.shares(checked).T, series.coefficients(nodes), 1)
    return jnp.max(jnp.abs(found / exact - 1.0))
