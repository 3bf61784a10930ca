"""Measured surfaces from instrument files, read by the library SurfaceTopography (the extra ``surfaces``).

It reads some forty formats of microscopes, profilers and interferometers: SDF, X3P, GWY, OPD, SUR, DI, PLU and others.
Source: M. C. Roettger and others, Surf. Topogr.: Metrol. Prop. 10 (2022) 035032.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import is_concrete, require_real, value_in_words
from jaxcontact.bodies.grid import Grid, check_grid

SAME = 1e-6  # relative difference within which two cell sizes are equal


class _Surface(NamedTuple):
    """The fields of a ``Surface``, whose constructor cannot be changed in a named tuple itself."""

    heights: np.ndarray
    grid: Grid


class Surface(_Surface):
    """A measured surface.

    heights: (nx, ny) [m], larger towards the opposing body; grid: a ``Grid`` of the file's cells.
    """

    __slots__ = ()

    def __new__(cls, heights: np.ndarray, grid: Grid) -> Surface:
        require_real("heights", heights)
        return super().__new__(cls, heights, grid)

    def __repr__(self) -> str:
        return f"Surface(heights={value_in_words(self.heights)} m, grid={self.grid!r})"


def read_surface(
    path: str | Path,
    grid: Grid | None = None,
    *,
    unit: str | None = None,
    fill: bool = False,
    width: float | None = None,
) -> Surface:
    """Read heights and cells from an instrument's file, for a ``HeightField``; needs ``jaxcontact[surfaces]``.

    Heights are as in the file, in metres: no plane is subtracted, and no missing point is filled unless that is asked for.
    The grid is periodic where the file says that its surface is.

    Args:
        path: a file of any format that SurfaceTopography reads; of several channels, the first height channel is used.
        grid: the grid of a run, which the file must match in shape and cells; None: the grid of the file.
        unit: of the lengths of a file that states none, such as "um".
        fill: whether points without a height get the solution of Laplace's equation between their neighbours (the mean of
            the four neighbours at each of them), at most half of all points.
        width: along y [m] of a line scan, which is then a surface of constant height along y: its grid (n, 1) is periodic
            along y, for plane strain.

    Returns:
        ``Surface``: (heights, grid); with ``grid`` given, that grid.

    Raises:
        ValueError: a file that cannot be read, is no map of heights, has points without a height, does not give
            its unit or its size, or does not match the grid; the message names the argument that reads it.
        ImportError: SurfaceTopography is not installed.

    Example:
        >>> heights, grid = jc.read_surface("scan.x3p")  # doctest: +SKIP
        >>> rough = jc.HeightField(heights, steel)  # doctest: +SKIP
    """
    surface = _read(_library(), Path(path), unit, fill, width)
    if grid is None:
        return surface
    own = surface.grid
    checks.require(
        tuple(grid.shape) == own.shape, f"{path}: expected {tuple(grid.shape)} heights, got {own.shape}"
    )
    checks.require(
        np.allclose(grid.spacing, own.spacing, rtol=SAME, atol=0.0),
        f"{path}: expected cells of {_cells(grid)} m, got {_cells(own)} m",
    )
    return Surface(surface.heights, grid)


def _read(library: Any, path: Path, unit: str | None, fill: bool, width: float | None) -> Surface:
    """Return the map of heights of a file."""
    try:
        reader = library.open_topography(str(path))
        topography = reader.topography()
        stated = topography.unit
        if unit is not None and stated is None:
            topography = reader.topography(unit=unit)
    except (OSError, ImportError):
        raise
    except Exception as error:  # each reader of the library raises its own errors
        reason = str(error).partition("\n")[0] or type(error).__name__
        raise ValueError(
            f"{path}: expected a surface that SurfaceTopography reads: {reason.rstrip(':. ')};"
            " a table of heights in metres is jc.HeightField(numpy.loadtxt(file))"
        ) from error
    checks.require(
        unit is None or stated is None,
        f"{path}: unit: expected none for a file that states its unit, {stated!r}, got {unit!r}",
    )
    checks.require(
        topography.unit is not None,
        f'{path}: expected a unit of its lengths, got none: give unit="um" or another',
    )

    # a map of heights, or a line that is as wide as said
    in_metres = topography.to_unit("m")
    if topography.dim == 1:
        checks.require(
            width is not None and topography.is_uniform,
            f"{path}: expected a map of heights, got a line of {in_metres.nb_grid_pts[0]} points: "
            + (
                "width= [m] makes it a surface of constant height along y, for plane strain"
                if topography.is_uniform
                else "its points are not equally spaced: interpolate it, and give jc.HeightField the heights (n, 1)"
            ),
        )
        checks.positive(f"{path}: width", width)
    else:
        checks.require(width is None, f"{path}: width: expected none for a map of heights, got {width!r}")

    # points without a height are refused, or filled
    heights = np.ma.masked_invalid(in_metres.heights())
    missing = int(np.ma.count_masked(heights))
    checks.require(
        missing == 0 or (fill and 2 * missing <= heights.size),
        f"{path}: expected a height at every point, got {missing} of {heights.size} without:"
        + (
            " at most half of them can be filled"
            if fill
            else " fill=True fills them from their neighbours, or cut them with the instrument's software"
        ),
    )
    periodic = bool(in_metres.is_periodic)
    values = np.array(heights.filled(0.0), float)
    mask = np.ma.getmaskarray(heights)
    if topography.dim == 1:
        spacing = (float(in_metres.pixel_size[0]), float(width or 0.0))
        surface = Surface(values[:, None], Grid((values.size, 1), spacing, (periodic, True)))
        return surface._replace(heights=_filled(surface.heights, mask[:, None], (periodic, False)))
    dx, dy = (float(d) for d in in_metres.pixel_size)
    return Surface(_filled(values, mask, (periodic, periodic)), Grid(values.shape, (dx, dy), periodic))


def _filled(heights: np.ndarray, mask: np.ndarray, periodic: tuple[bool, bool]) -> np.ndarray:
    """Return heights (nx, ny) [m] whose points of the mask are the mean of their neighbours, by a sparse linear solve."""
    if not mask.any():
        return heights
    # the equation of each missing point: n h - (sum of its missing neighbours) = sum of its known neighbours
    place = np.full(mask.shape, -1)
    place[mask] = np.arange(mask.sum())
    rows, columns, entries = [], [], []
    right, count = np.zeros(mask.sum()), np.zeros(mask.sum())
    i, j = np.nonzero(mask)
    for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        a, b = i + di, j + dj
        a, b = (a % mask.shape[0] if periodic[0] else a), (b % mask.shape[1] if periodic[1] else b)
        inside = (a >= 0) & (a < mask.shape[0]) & (b >= 0) & (b < mask.shape[1])
        own = place[i, j][inside]
        other = place[a[inside], b[inside]]
        np.add.at(count, own, 1.0)
        np.add.at(right, own[other < 0], heights[a[inside][other < 0], b[inside][other < 0]])
        rows.append(own[other >= 0])
        columns.append(other[other >= 0])
        entries.append(np.full(int(np.sum(other >= 0)), -1.0))
    every = np.arange(count.size)
    sparse = importlib.import_module("scipy.sparse.linalg")  # takes a while, and is needed here alone
    matrix = importlib.import_module("scipy.sparse").csr_matrix(
        (
            np.concatenate([*entries, count]),
            (np.concatenate([*rows, every]), np.concatenate([*columns, every])),
        )
    )
    whole = heights.copy()
    whole[mask] = sparse.spsolve(matrix, right)
    return whole


def _cells(grid: Grid) -> tuple[float, ...]:
    return tuple(float(f"{float(d):.10g}") for d in grid.spacing)


def _library() -> Any:
    try:
        return importlib.import_module("SurfaceTopography")
    except ImportError as error:
        raise ImportError(
            "read_surface needs SurfaceTopography; install it with: pip install 'jaxcontact[surfaces]'"
        ) from error


# Self-affine rough surfaces.
#
# A surface of given power spectrum is filtered white noise, a sum of independent Gaussian waves at the wavevectors k
# of the grid with
#
#     C(k) = <|h^(k)|^2> ~ k^(-2 - 2 H)      2 pi/longest <= |k| <= 2 pi/shortest,
#     C(k) = C(2 pi/longest)                 0 < |k| < 2 pi/longest,
#     C(k) = 0                               beyond, and for the mean.
#
# The heights are Gaussian and periodic along both axes. Source: B. N. J. Persson, O. Albohr, U. Tartaglino,
# A. I. Volokitin, E. Tosatti, J. Phys.: Condens. Matter 17 (2005) R1.


ROUNDING = 1e-9  # relative tolerance in comparisons of wavelengths with those of the grid


def self_affine(
    grid: Grid, hurst: float = 0.8, rms_slope: Any = 0.1, *, shortest: float, longest: float, seed: int = 0
) -> Array:
    """Generate the heights of a random self-affine surface, for a ``HeightField``; the module gives the spectrum.

    The slope is that of the trigonometric polynomial through the heights, rms over both directions,
    sqrt(mean |grad h|^2), and is met exactly. The random numbers are those of ``numpy.random.RandomState``, whose
    stream numpy guarantees: a seed gives the same surface on every machine, up to round-off.

    Args:
        grid: a ``Grid``; concrete. The heights are periodic over it, so that a periodic grid can use them as they are.
        hurst: H, 0 to 1.
        rms_slope: >= 0; the heights are proportional to it.
        shortest: shortest wavelength [m], from two cells to the grid's width; eight cells or more resolve it.
        longest: wavelength [m] above which the spectrum is flat, up to the grid's width.
        seed: whole number from 0 to 2^32 - 1.

    Returns:
        Heights (nx, ny) [m] of mean zero.

    Raises:
        ValueError: an argument outside these ranges.

    Example:
        >>> grid = jc.Grid(shape=(64, 64), spacing=(1e-6, 1e-6), periodic=True)
        >>> heights = jc.self_affine(grid, hurst=0.8, rms_slope=0.1, shortest=4e-6, longest=32e-6)
        >>> rough = jc.HeightField(heights)
    """
    valid = _check(grid, hurst, rms_slope, shortest, longest, seed)
    k = _wavenumbers(grid)
    within = (k > 0.0) & (k <= 2.0 * np.pi / shortest * (1.0 + ROUNDING))
    amplitude = np.where(within, np.maximum(k, 2.0 * np.pi / longest) ** (-1.0 - hurst), 0.0)
    spectrum = np.fft.fft2(np.random.RandomState(seed).standard_normal(grid.shape)) * amplitude
    slope = np.sqrt(np.sum((k * np.abs(spectrum)) ** 2)) / k.size  # by Parseval
    return jnp.asarray(np.fft.ifft2(spectrum).real / slope) * jnp.where(valid, rms_slope, jnp.nan)


def _wavenumbers(grid: Grid) -> np.ndarray:
    """Return |k| of the grid's waves [rad/m], (nx, ny)."""
    along_x, along_y = (np.fft.fftfreq(n, float(d)) for n, d in zip(grid.shape, grid.spacing, strict=True))
    return 2.0 * np.pi * np.hypot(along_x[:, None], along_y)


def _check(grid: Grid, hurst: float, rms_slope: Any, shortest: float, longest: float, seed: int) -> Verdict:
    """Raise ValueError for arguments that define no such surface."""
    check_grid(grid)
    checks.require(
        is_concrete(grid) and not grid.plane_strain,
        f"grid: expected a known spacing and more than one cell along y, got {tuple(grid.shape)} cells",
    )
    checks.between("hurst", hurst, 0.0, 1.0)
    two_cells, width = 2.0 * max(map(float, grid.spacing)), max(map(float, grid.width))
    checks.between("shortest [m]", shortest, two_cells * (1.0 - ROUNDING), width)
    checks.between("longest [m]", longest, shortest * (1.0 - ROUNDING), width * (1.0 + ROUNDING))
    checks.whole("seed", seed, 0, 2**32 - 1)
    return checks.non_negative("rms_slope", rms_slope)
