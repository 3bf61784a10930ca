"""Statistics of a contact whose area is in many places: how much touches, how it is pressed, and how it hangs together.

The nominal area A0 is that of the grid. Cells under pressure are in contact, and the rim of the contact runs along the
sides between them and their neighbours that are open; sides of a grid that is not periodic are no rim. Counting whole
cells takes too many of those that the rim crosses: with S sides of cells along the rim, the area is

    A = dx dy (n - (pi - 1 + ln 2)/24 S)

for contact edges of all directions and cells that are nearly square. Source: V. A. Yastrebov, G. Anciaux, J.-F. Molinari,
Tribol. Int. 114 (2017) 161, Eq. (7).
"""

from __future__ import annotations

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import scipy
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.grid import Grid
from jaxcontact.results.summaries import STATISTICS, InWords, is_one_result, words

RIM = (math.pi - 1.0 + math.log(2.0)) / 24.0  # of a cell, for each of its sides along the rim
MOST_BINS = 10_000


@pytree
class ContactStatistics(InWords):
    """Of each time, (nt,); () of fields at one time. ``area_fraction`` over ``mean_pressure`` is area against load.

    mean_pressure [Pa]: load over nominal area; area_fraction: cells in contact over all; corrected_fraction: the same
    less the error at the rim, see the module (in plane strain there is no such error to first order, and it is
    the counted one); perimeter [m]: length of the rim, pi/4 of that of the cells' sides, as for edges of
    all directions; mean_gap [m]: over the nominal area, contact included.
    """

    mean_pressure: Array
    area_fraction: Array
    corrected_fraction: Array
    perimeter: Array
    mean_gap: Array


@pytree
class PressureHistogram(InWords):
    """Share of the nominal area by its pressure.

    edges [Pa], (bins + 1,): from zero to the largest pressure of all times; density [1/Pa], (nt, bins), (bins,) of
    fields at one time: of contact alone, so that its integral is the area fraction and that of density times pressure the
    mean pressure.
    """

    edges: Array
    density: Array


@pytree
class ContactClusters:
    """Patches of contact whose cells share sides.

    labels (nx, ny): 0 where open, 1 in the largest patch, then by falling area; areas (n,) [m^2], by counting cells.
    """

    labels: np.ndarray
    areas: np.ndarray

    def __repr__(self) -> str:
        names = ("count", "areas")
        return words((name, getattr(self, name), STATISTICS[name]) for name in names)

    @property
    def count(self) -> int:
        """How many."""
        return int(self.areas.size)


def contact_statistics(result: Any) -> ContactStatistics:
    """Area, pressure and gap in the mean, over the nominal area of the grid; see ``ContactStatistics``.

    Args:
        result: what ``indent``, ``slide``, ``slide_steady`` ... give back. Under jit, grad and vmap as well; counts
            of cells have no derivative, the mean gap and pressure have.

    Returns:
        ``ContactStatistics``.

    Raises:
        ValueError: something else.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> ball, grid = jc.Sphere(radius=5e-3), jc.Grid.square(n=16, width=500e-6)
        >>> history = jc.indent(glass, ball, jc.Load(20.0), [0.0], grid=grid)
        >>> area_against_load = jc.contact_statistics(history)
    """
    _check_contact(result)
    grid, pressure = result.grid, result.pressure
    counted = jnp.mean(pressure > 0.0, (-2, -1), dtype=float)
    along_x, along_y = _rim(pressure > 0.0, grid)
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    excess = 0.0 if grid.plane_strain else RIM * (along_x + along_y) / (nx * ny)
    return ContactStatistics(
        mean_pressure=jnp.mean(pressure, (-2, -1)),
        area_fraction=counted,
        corrected_fraction=counted - excess,
        perimeter=along_y * dy if grid.plane_strain else math.pi / 4.0 * (along_x * dx + along_y * dy),
        mean_gap=jnp.mean(result.gap, (-2, -1)),
    )


def pressure_histogram(result: Any, bins: int = 50) -> PressureHistogram:
    """How much of the nominal area bears which pressure; see ``PressureHistogram``.

    Args:
        result: what ``indent``, ``slide``, ``slide_steady`` ... give back.
        bins: of equal width, static, 1 to 10000.

    Returns:
        ``PressureHistogram``.

    Raises:
        ValueError: another result or number of bins.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> ball, grid = jc.Sphere(radius=5e-3), jc.Grid.square(n=16, width=500e-6)
        >>> history = jc.indent(glass, ball, jc.Load(20.0), [0.0], grid=grid)
        >>> spread = jc.pressure_histogram(history, bins=40)
        >>> area_fraction = spread.density[-1] @ np.diff(spread.edges)
    """
    _check_contact(result)
    checks.whole("bins", bins, 1, MOST_BINS)
    pressure = result.pressure
    edges = jnp.linspace(0.0, jnp.maximum(jnp.max(pressure), jnp.finfo(float).tiny), bins + 1)
    maps = pressure.reshape(-1, pressure.shape[-2] * pressure.shape[-1])
    share = (
        jax.vmap(lambda p: jnp.histogram(p, edges, weights=jnp.where(p > 0.0, 1.0, 0.0))[0])(maps)
        / maps.shape[-1]
    )
    return PressureHistogram(edges, (share / jnp.diff(edges)).reshape(*pressure.shape[:-2], bins))


def contact_clusters(result: Any, step: int = -1) -> ContactClusters:
    """The patches of contact at one of the times; on a periodic grid they go on across its sides.

    Args:
        result: of one run, with values (not inside jit).
        step: which of the times; the last one alone, where the result has no other's fields.

    Returns:
        ``ContactClusters``.

    Raises:
        ValueError: another result, many runs in one, a time whose field it does not have.

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
        "result: expected that of one run, outside jit,"
        f" got a status of shape {getattr(getattr(result, 'status', None), 'shape', None)}",
    )
    maps = np.asarray(result.pressure)
    maps = maps if maps.ndim == 3 else maps[None]
    checks.whole("step", step, -len(maps), len(maps) - 1)
    labels = _joined(scipy.ndimage.label(maps[step] > 0.0)[0], result.grid)
    cells = np.bincount(labels.ravel())[1:]
    order = np.argsort(-cells, kind="stable")
    rank = np.zeros(cells.size + 1, int)
    rank[1 + order] = 1 + np.arange(cells.size)
    return ContactClusters(rank[labels], cells[order] * float(result.grid.cell_area))


def _joined(labels: np.ndarray, grid: Grid) -> np.ndarray:
    """Labels 0 to n of patches, those that touch across a periodic side made one."""
    sides = [(labels[0], labels[-1])] * grid.periodic[0] + [(labels[:, 0], labels[:, -1])] * grid.periodic[1]
    pairs = np.concatenate(
        [np.stack([a, b])[:, (a > 0) & (b > 0)] for a, b in sides] + [np.zeros((2, 0), int)], 1
    )
    size = labels.max() + 1
    links = scipy.sparse.coo_array((np.ones(pairs.shape[1]), tuple(pairs)), shape=(size, size))
    _, patches = scipy.sparse.csgraph.connected_components(links, directed=False)
    return patches[labels]  # open cells, 0, are the first component


def _rim(touching: Array, grid: Grid) -> tuple[Array, Array]:
    """Sides between cells in contact and open ones (...): those along x and those along y."""
    neighbour_x = touching != jnp.roll(touching, 1, -2)
    neighbour_y = touching != jnp.roll(touching, 1, -1)
    if not grid.periodic[0]:
        neighbour_x = neighbour_x[..., 1:, :]
    if not grid.periodic[1]:
        neighbour_y = neighbour_y[..., 1:]
    return jnp.sum(neighbour_y, (-2, -1)), jnp.sum(neighbour_x, (-2, -1))


def _check_contact(result: Any) -> None:
    """What has a pressure and a gap on a grid."""
    checks.require(
        all(hasattr(result, name) for name in ("pressure", "gap", "grid")),
        f"result: expected that of indent, slide, slide_steady, ..., got {type(result).__name__}",
    )
