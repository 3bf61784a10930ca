"""Statistics of rough surfaces: heights, slopes, curvatures and the power spectrum.

Along a periodic axis, derivatives are those of the trigonometric polynomial through the heights, and the spectrum is that
of its waves. Along any other axis they are finite differences of interior cells, and the spectrum uses a Hann window,
which smooths it: a spectrum k^(-2 - 2 H) is returned as (1 + 2 (1 + H)^2/(3 m^2)) k^(-2 - 2 H) at the m-th wave of a
square. Heights on a periodic axis that do not match at its two ends have a step there, which adds to slopes, curvatures
and spectrum; a warning says so if its root mean square is above ``STEP`` times that of the differences between neighbours.
The two-dimensional spectrum

    C(k) = <|h^(k)|^2> dx dy/(nx ny),      mean h^2 = integral of C(k) d^2k/(2 pi)^2,

is averaged over directions. Source: B. N. J. Persson, O. Albohr, U. Tartaglino, A. I. Volokitin, E. Tosatti, J. Phys.:
Condens. Matter 17 (2005) R1 (whose C is this one over (2 pi)^2).
"""

from __future__ import annotations

import math
import warnings
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import scipy
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.pytree import is_concrete, pytree
from jaxcontact.bodies.grid import Grid, check_grid
from jaxcontact.results.summaries import STATISTICS, InWords, is_one_result, words

STEP = 4.0  # of the differences between neighbours: a step where a periodic axis begins again


@pytree
class SurfaceStatistics(InWords):
    """Statistics of a rough surface.

    rms_height () [m] with respect to the mean height; rms_slope (), sqrt(mean |grad h|^2); rms_curvature () [1/m], that of
    the mean curvature (h_xx + h_yy)/2; spectrum (n,) [m^4]: the power spectral density C, averaged over rings in the plane
    of wavevectors, which are as wide as the smallest |k| of the grid; wavenumber (n,) [rad/m]: the mean |k| of each ring.
    """

    rms_height: np.ndarray
    rms_slope: np.ndarray
    rms_curvature: np.ndarray
    wavenumber: np.ndarray
    spectrum: np.ndarray


def surface_statistics(heights: Any, grid: Grid) -> SurfaceStatistics:
    """Compute the statistics of heights on a grid, such as those of a ``HeightField`` (formulas at the head of this module).

    Args:
        heights: (nx, ny) [m], with known values (not inside jit).
        grid: the ``Grid`` of the heights. Whether it is periodic decides how derivatives and spectrum are computed. Heights
            that do not match at the ends of a periodic axis have a step there, and a warning is issued.

    Returns:
        ``SurfaceStatistics``.

    Raises:
        ValueError: heights of another shape or not finite, or traced arguments.

    Example:
        >>> grid = jc.Grid(shape=(64, 64), spacing=(1e-6, 1e-6), periodic=True)
        >>> heights = jc.self_affine(grid, rms_slope=0.1, shortest=8e-6, longest=32e-6)
        >>> round(float(jc.surface_statistics(heights, grid).rms_slope), 9)
        0.1
    """
    h = _checked(heights, grid)
    for axis in np.flatnonzero(grid.periodic).tolist():
        # a step where a periodic axis begins again
        size = lambda change: float(np.sqrt(np.mean(change**2)))
        step, usual = size(np.take(h, 0, axis) - np.take(h, -1, axis)), size(np.diff(h, axis=axis))
        if step > STEP * usual:
            warnings.warn(
                f"the heights do not match at the two ends of the periodic {'xy'[axis]} axis: a step of {step:.3g} m,"
                f" {usual:.3g} m between neighbours, adds to slopes, curvatures and spectrum; give a grid that is not"
                " periodic",
                stacklevel=2,
            )
    h = h - np.mean(h)
    (dx, dy), (x, y) = map(float, grid.spacing), grid.periodic
    slopes = _derivative(h, -2, dx, x, 1), _derivative(h, -1, dy, y, 1)
    bend_x = _inside(_derivative(h, -2, dx, x, 2), -1, y)
    bend_y = _inside(_derivative(h, -1, dy, y, 2), -2, x)
    return SurfaceStatistics(
        np.sqrt(np.mean(h**2)),
        np.sqrt(np.mean(slopes[0] ** 2) + np.mean(slopes[1] ** 2)),
        np.sqrt(np.mean(((bend_x + bend_y) / 2.0) ** 2)),
        *_spectrum(h, grid),
    )


def _derivative(h: np.ndarray, axis: int, spacing: float, periodic: bool, order: int) -> np.ndarray:
    """Return a derivative along an axis; along an axis that is not periodic it is shorter by ``order``."""
    if not periodic:
        return np.diff(h, order, axis) / spacing**order
    k = np.moveaxis(2.0 * np.pi * np.fft.fftfreq(h.shape[axis], spacing)[:, None], 0, axis)
    return np.fft.ifft((1j * k) ** order * np.fft.fft(h, axis=axis), axis=axis).real


def _inside(field: np.ndarray, axis: int, periodic: bool) -> np.ndarray:
    """Return the field without the first and last cell along an axis that is not periodic."""
    return field if periodic else np.moveaxis(np.moveaxis(field, axis, 0)[1:-1], 0, axis)


def _spectrum(h: np.ndarray, grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Return wavenumbers [rad/m] and C [m^4] of the module, averaged over rings, up to the highest wave of both axes."""
    waves_of_axes = [
        2.0 * np.pi * np.fft.fftfreq(n, float(d)) for n, d in zip(grid.shape, grid.spacing, strict=True)
    ]
    k = np.hypot(waves_of_axes[0][:, None], waves_of_axes[1])
    width, highest = min(a[1] for a in waves_of_axes), min(np.max(np.abs(a)) for a in waves_of_axes)
    ring = np.rint(k / width).astype(int)
    count = int(np.rint(highest / width))
    # ring 0 holds the mean, which is zero, and all higher waves
    ring = np.where(ring <= count, ring, 0).ravel()
    sums = lambda values: np.bincount(ring, values.ravel(), count + 1)[1:]

    # a window (nx, ny) of mean square one: a Hann window along axes that are not periodic
    hann = lambda n: np.sqrt(8.0 / 3.0) * np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2
    x, y = (np.ones(n) if wraps else hann(n) for n, wraps in zip(grid.shape, grid.periodic, strict=True))
    waves, transformed = sums(np.ones(k.shape)), np.fft.fft2(h * (x[:, None] * y))
    squares = (transformed.real**2 + transformed.imag**2) * grid.cell_area / h.size
    return sums(k) / waves, sums(squares) / waves


def _checked(heights: Any, grid: Grid) -> np.ndarray:
    """Return the heights as floats, after checking them against the grid."""
    check_grid(grid)
    checks.require(
        is_concrete(heights, grid) and not grid.plane_strain,
        f"heights, grid: expected known values and more than one cell along y, got {tuple(grid.shape)} cells",
    )
    checks.require(
        np.shape(heights) == tuple(grid.shape),
        f"heights: expected shape {tuple(grid.shape)}, got {np.shape(heights)}",
    )
    checks.finite("heights [m]", heights)
    return np.asarray(heights, float)


# Statistics of rough contacts: real contact area, pressure distribution and contact patches.
#
# The nominal area A0 is that of the grid. Cells under pressure are in contact, with adhesion those whose gap is zero.
# The contact boundary runs along the sides between them and open neighbours; the sides of a grid that is not periodic
# do not count. Counting whole cells overestimates the area by part of the cells that the boundary crosses: with S
# cell sides along the boundary, the area is
#
#     A = dx dy (n - (pi - 1 + ln 2)/24 S)
#
# for boundaries of all directions and cells that are nearly square. Source: V. A. Yastrebov, G. Anciaux, J.-F.
# Molinari, Tribol. Int. 114 (2017) 161, Eq. (7).


AREA_CORRECTION = (math.pi - 1.0 + math.log(2.0)) / 24.0  # in cells, per cell side on the contact boundary
MOST_BINS = 10_000


@pytree
class ContactStatistics(InWords):
    """Mean values over the nominal area at each time, (nt,), or () for fields at one time.

    ``area_fraction`` over ``mean_pressure`` gives contact area against load.

    mean_pressure [Pa]: load over nominal area; area_fraction: cells in contact over all cells; corrected_fraction: area
    fraction with a correction for the cells on the contact boundary, defined at the head of this module (in plane strain
    no correction is needed, and it equals ``area_fraction``); perimeter [m]: length of the contact boundary, estimated as
    pi/4 of the length of the cell sides along it, which is correct on average over all directions; mean_gap [m]: mean over
    the nominal area, including the contact.
    """

    mean_pressure: Array
    area_fraction: Array
    corrected_fraction: Array
    perimeter: Array
    mean_gap: Array


@pytree
class PressureHistogram(InWords):
    """The pressure distribution over the nominal area.

    edges [Pa], (bins + 1,): limits of the bins, from zero, or with adhesion from the largest tension, to the largest
    pressure of all times; density [1/Pa], (nt, bins), or (bins,) for fields at one time: share of the nominal area per
    unit of pressure. Only cells under pressure or tension are counted: without adhesion the integral of the density is
    the area fraction. The integral of density times pressure is the mean pressure to within half a bin.
    """

    edges: Array
    density: Array


@pytree
class ContactClusters:
    """Patches of contact: sets of cells in contact that are connected by their sides.

    labels (nx, ny): 0 outside contact, 1 in the largest patch, and so on by decreasing area; areas (n,) [m^2]: areas of the
    cells in each patch.
    """

    labels: np.ndarray
    areas: np.ndarray

    def __repr__(self) -> str:
        names = ("count", "areas")
        return words((name, getattr(self, name), STATISTICS[name]) for name in names)

    @property
    def count(self) -> int:
        """The number of patches."""
        return int(self.areas.size)


def contact_statistics(result: Any) -> ContactStatistics:
    """Compute the area fraction in contact, the mean pressure and the mean gap; see ``ContactStatistics``.

    Args:
        result: the result of ``indent``, ``slide``, ``slide_steady`` and similar functions. It may be traced by jit, grad
            and vmap. The derivatives of numbers of cells are zero; those of the mean gap and the mean pressure are not.

    Returns:
        ``ContactStatistics``.

    Raises:
        ValueError: result is not the result of a contact.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> ball, grid = jc.Sphere(radius=5e-3), jc.Grid.square(n=16, width=500e-6)
        >>> history = jc.indent(glass, ball, jc.Load(20.0), [0.0], grid=grid)
        >>> area_against_load = jc.contact_statistics(history)
    """
    _check_contact(result)
    grid, pressure = result.grid, result.pressure
    counted = jnp.mean(result.in_contact, (-2, -1), dtype=float)
    along_x, along_y = _boundary_sides(result.in_contact, grid)
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    excess = 0.0 if grid.plane_strain else AREA_CORRECTION * (along_x + along_y) / (nx * ny)
    return ContactStatistics(
        mean_pressure=jnp.mean(pressure, (-2, -1)),
        area_fraction=counted,
        corrected_fraction=counted - excess,
        perimeter=along_y * dy if grid.plane_strain else math.pi / 4.0 * (along_x * dx + along_y * dy),
        mean_gap=jnp.mean(result.gap, (-2, -1)),
    )


def pressure_histogram(result: Any, bins: int = 50) -> PressureHistogram:
    """Compute the distribution of pressure over the nominal area; see ``PressureHistogram``.

    Args:
        result: the result of ``indent``, ``slide``, ``slide_steady`` and the like.
        bins: number of bins of equal width, static, 1 to 10000.

    Returns:
        ``PressureHistogram``.

    Raises:
        ValueError: result is not the result of a contact, or bins is out of range.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> ball, grid = jc.Sphere(radius=5e-3), jc.Grid.square(n=16, width=500e-6)
        >>> history = jc.indent(glass, ball, jc.Load(20.0), [0.0], grid=grid)
        >>> histogram = jc.pressure_histogram(history, bins=40)
        >>> area_fraction = histogram.density[-1] @ np.diff(histogram.edges)
    """
    _check_contact(result)
    checks.whole("bins", bins, 1, MOST_BINS)
    pressure = result.pressure
    lowest, highest = (
        jnp.minimum(jnp.min(pressure), 0.0),
        jnp.maximum(jnp.max(pressure), jnp.finfo(float).tiny),
    )
    edges = jnp.linspace(lowest, highest, bins + 1)
    maps = pressure.reshape(-1, pressure.shape[-2] * pressure.shape[-1])
    share = (
        jax.vmap(lambda p: jnp.histogram(p, edges, weights=jnp.where(p != 0.0, 1.0, 0.0))[0])(maps)
        / maps.shape[-1]
    )
    return PressureHistogram(edges, (share / jnp.diff(edges)).reshape(*pressure.shape[:-2], bins))


def contact_clusters(result: Any, step: int = -1) -> ContactClusters:
    """Find the patches of contact at one of the times; on a periodic grid they continue across its sides.

    Args:
        result: the result of one run, with known values (not inside jit).
        step: index of the time; -1 or 0 if the result holds the fields of one time only.

    Returns:
        ``ContactClusters``.

    Raises:
        ValueError: not the result of a contact, a batch of runs, or a time whose field was not kept.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> ball, grid = jc.Sphere(radius=5e-3), jc.Grid.square(n=16, width=500e-6)
        >>> history = jc.indent(glass, ball, jc.Load(20.0), [0.0], grid=grid)
        >>> jc.contact_clusters(history).count
        1
    """
    _check_contact(result)
    checks.require(
        is_one_result(result),
        "result: expected the result of one run, outside jit,"
        f" got a status of shape {getattr(getattr(result, 'status', None), 'shape', None)}",
    )
    maps = np.asarray(result.in_contact)
    maps = maps if maps.ndim == 3 else maps[None]
    checks.whole("step", step, -len(maps), len(maps) - 1)
    labels = scipy.ndimage.label(maps[step])[0]

    # patches (0 to n) that touch across a periodic side are one
    wraps = result.grid.periodic
    sides = [(labels[0], labels[-1])] * wraps[0] + [(labels[:, 0], labels[:, -1])] * wraps[1]
    pairs = np.concatenate(
        [np.stack([a, b])[:, (a > 0) & (b > 0)] for a, b in sides] + [np.zeros((2, 0), int)], 1
    )
    size = labels.max() + 1
    links = scipy.sparse.coo_array((np.ones(pairs.shape[1]), tuple(pairs)), shape=(size, size))
    _, patches = scipy.sparse.csgraph.connected_components(links, directed=False)
    labels = patches[labels]  # open cells, label 0, form the first component
    cells = np.bincount(labels.ravel())[1:]
    order = np.argsort(-cells, kind="stable")
    rank = np.zeros(cells.size + 1, int)
    rank[1 + order] = 1 + np.arange(cells.size)
    return ContactClusters(rank[labels], cells[order] * float(result.grid.cell_area))


def _boundary_sides(touching: Array, grid: Grid) -> tuple[Array, Array]:
    """Count the sides between cells in contact and open cells, (...): those parallel to x and those parallel to y."""
    neighbour_x = touching != jnp.roll(touching, 1, -2)
    neighbour_y = touching != jnp.roll(touching, 1, -1)
    if not grid.periodic[0]:
        neighbour_x = neighbour_x[..., 1:, :]
    if not grid.periodic[1]:
        neighbour_y = neighbour_y[..., 1:]
    return jnp.sum(neighbour_y, (-2, -1)), jnp.sum(neighbour_x, (-2, -1))


def _check_contact(result: Any) -> None:
    """Raise ValueError unless the result has a contact and a gap on a grid."""
    checks.require(
        all(hasattr(result, name) for name in ("in_contact", "gap", "grid")),
        f"result: expected the result of indent, slide, slide_steady, ..., got {type(result).__name__}",
    )
