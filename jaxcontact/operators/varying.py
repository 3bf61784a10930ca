"""Operators of a film whose thickness h varies in the plane.

The body at a point is taken for a uniform one of the thickness there, and the operator is made symmetric. With the kernels
as a series in the thickness, K(h) = sum_n T_n(xi(h)) K_n in Chebyshev polynomials,

    u = 1/2 sum_n [T_n(xi(h)) K_n p + K_n (T_n(xi(h)) p)].

The operator obeys reciprocity, <q, K p> = <p, K q>, and for a uniform thickness it is that of the uniform body. It is exact
to first order in the slope of the thickness: a film with a slope of 0.06 is within 0.3 % of a finite element solution, one
with 0.16 within 1 %.

The variable of the series is xi ~ log(1 + h/c), c the size of a cell: linear in h where the film is thin on the grid, where
the kernels are linear in h too, and logarithmic where it is thick, where they vary over lengths of the order of h. The
nodes include both ends of the range, so that a bare base is answered as such. A series of n terms costs n convolutions:
three or four of them suffice where the film is thin on the grid (``operators.varying``).

On a grid that is periodic along both axes the operator is that of the pressures and displacements of zero mean. A mean
pressure p0 moves the surface by w(x) p0: without its mean, the film's compliance in uniaxial strain times its thickness less
what the film, which presses sideways, lifts the surface where it is thick (``response.body.sideways_compliance``). By
reciprocity, displacement is then from the mean of the surface but for mean(w p).
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support.pytree import is_concrete, pytree, replace, static
from jaxcontact.bodies.body import LayeredHalfSpace
from jaxcontact.bodies.grid import Grid
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.operators import spectral
from jaxcontact.operators.kernels import (
    Errors,
    Expansion,
    Kernels,
    VaryingFilm,
    compiled_expansion,
    on_grid,
    scaled_images,
)
from jaxcontact.operators.kernels import assembled as uniform_kernels
from jaxcontact.operators.operator import SINGLE, Entry, Family
from jaxcontact.response.coefficients import wavenumbers
from jaxcontact.response.images import Images
from jaxcontact.response.in_time import DEFAULT_NODES, check_times, products
from jaxcontact.response.normal import limits_of, sideways_compliance

FINENESS = 256.0  # the range of log(1 + h/c) is rounded outwards to multiples of one over this


def series_entries(count: int) -> tuple[Entry, ...]:
    """Return the entries of the operator of a series of ``count`` terms, whose spectra are K_0 and K_n/2."""
    both = [((0, n, n), (n, 0, n)) for n in range(1, count)]
    return (*SINGLE, *(entry for pair in both for entry in pair))


@pytree
class ThicknessSeries:
    """The variable xi of the module and its nodes.

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


# Kernels of one film whose thickness varies in the plane, on an elastic half-space.
#
# The response of one layer depends on alpha h alone, with rates and a mix that are those of every thickness. Its
# images are therefore made once: for another thickness their depths change in proportion, and their heights stay.


DEFAULT_TERMS = 6  # where the thickness is not known yet, within jit and grad
FEWER, MOST_TERMS = (3, 4, 5, 6), 8  # the first of these whose error is below ENOUGH, or the last
ENOUGH = 1e-5
THINNEST = 1e-9  # cells: stands for a film of no thickness
SHORTEST_WAVE = 8.0  # cells: shorter waves carry little of a pressure that the grid resolves
WAVES, THICKNESSES = 24, 17  # at which the error of the series is measured


@pytree
class VaryingKernels:
    """Discretised response of a body with a film of varying thickness, and an indenter, on a grid.

    body: with a film of one thickness; uniform: its kernels, for all that does not depend on the thickness; family: the
    operators of the terms of the series, without its weights and lifts; film_series (n, nx, ny): as in ``VaryingFilm``;
    slopes (M + 1,): of the displacement under a mean pressure over the thickness; series_error: the largest relative error
    of the series, ().
    """

    body: LayeredHalfSpace
    uniform: Kernels
    series: ThicknessSeries
    family: Family
    film_series: Array
    slopes: Array
    series_error: Array

    def errors(self, duration: Array | float = jnp.inf) -> Errors:
        """Return what a run of a duration [s] on them is told to be off by."""
        return self.uniform.errors(duration)._replace(thickness=self.series_error)

    def at(self, thickness: Array) -> Kernels:
        """Return the kernels for a thickness (nx, ny) [m]."""
        shares = self.series.shares(thickness)
        lifts = self._lifts(thickness) if all(self.uniform.grid.periodic) else None
        family = replace(self.family, weights=shares[1:], lifts=lifts)
        assert self.uniform.film is not None
        film = VaryingFilm(self.film_series, shares, thickness > 0.0, self.uniform.film.weights)
        return replace(self.uniform, family=family, film=film)

    def _lifts(self, thickness: Array) -> Array:
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

    def node(h: Array) -> tuple[Family, Array]:
        family, coefficients = on_grid(grid, Images(scaled.depths * (h / reference), scaled.heights))
        strains = coefficients[1] * uniform.scale.length / jnp.maximum(h, THINNEST * cell)
        return replace(family, wide=None), strains

    nodes_of = jax.lax.map(node, jnp.maximum(series.nodes(), THINNEST * cell))
    family, strains = jax.tree.map(series.coefficients, nodes_of)
    family = _as_one(family, terms)
    bed = _bed(scaled) / reference * uniform.scale.length
    slopes = jnp.zeros(len(family.spectra)).at[0].set(uniform.film.weights[0] * bed).at[1].set(bed)
    error = jax.lax.stop_gradient(_series_error(series, expansion, body, grid))
    return VaryingKernels(body, uniform, series, family, strains, slopes, error)


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
