"""Measured surfaces from instrument files, read by the library SurfaceTopography (the extra ``surfaces``).

It reads some forty formats of microscopes, profilers and interferometers: SDF, X3P, GWY, OPD, SUR, DI, PLU and others.
Source: M. C. Roettger and others, Surf. Topogr.: Metrol. Prop. 10 (2022) 035032.
"""

import importlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from jaxcontact._support import checks
from jaxcontact._support.pytree import value_in_words
from jaxcontact.inputs.grid import Grid

SAME = 1e-6  # relative difference within which two cell sizes are equal


class Surface(NamedTuple):
    """A measured surface.

    heights: (nx, ny) [m], larger towards the opposing body; grid: a ``Grid`` of the file's cells.
    """

    heights: np.ndarray
    grid: Grid

    def __repr__(self) -> str:
        return f"Surface(heights={value_in_words(self.heights)} m, grid={self.grid!r})"


def read_surface(path: str | Path, grid: Grid | None = None) -> Surface:
    """Read heights and cells from an instrument's file, for a ``HeightField``; needs ``jaxcontact[surfaces]``.

    Heights are as in the file, in metres: no plane is subtracted, and no missing point is filled. The grid is periodic
    where the file says that its surface is.

    Args:
        path: a file of any format that SurfaceTopography reads; of several channels, the first height channel is used.
        grid: the grid of a run, which the file must match in shape and cells; None: the grid of the file.

    Returns:
        ``Surface``: (heights, grid); with ``grid`` given, that grid.

    Raises:
        ValueError: a file that cannot be read, is no map of heights, has points without a height, does not give
            its unit or its size, or does not match the grid.
        ImportError: SurfaceTopography is not installed.

    Example:
        >>> heights, grid = jc.read_surface("scan.x3p")  # doctest: +SKIP
        >>> rough = jc.HeightField(heights, steel)  # doctest: +SKIP
    """
    surface = _read(_library(), Path(path))
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


def _read(library: Any, path: Path) -> Surface:
    """Return the map of heights of a file."""
    try:
        topography = library.open_topography(str(path)).topography()
    except (OSError, ImportError):
        raise
    except Exception as error:  # each reader of the library raises its own errors
        reason = str(error).partition("\n")[0] or type(error).__name__
        raise ValueError(
            f"{path}: expected a surface that SurfaceTopography reads: {reason.rstrip(': ')};"
            " a table of heights in metres is jc.HeightField(numpy.loadtxt(file))"
        ) from error
    checks.require(topography.dim == 2, f"{path}: expected a map of heights, got a line")
    checks.require(topography.unit is not None, f"{path}: expected a unit of its lengths, got none")
    in_metres = topography.to_unit("m")
    heights = np.ma.masked_invalid(in_metres.heights())
    missing = int(np.ma.count_masked(heights))
    checks.require(
        missing == 0,
        f"{path}: expected a height at every point, got {missing} of {heights.size} without:"
        " fill or cut them with the instrument's software or SurfaceTopography",
    )
    spacing = tuple(float(d) for d in in_metres.pixel_size)
    return Surface(np.array(heights, float), Grid(heights.shape, spacing, bool(in_metres.is_periodic)))


def _cells(grid: Grid) -> tuple[float, ...]:
    return tuple(float(f"{float(d):.10g}") for d in grid.spacing)


def _library() -> Any:
    try:
        return importlib.import_module("SurfaceTopography")
    except ImportError as error:
        raise ImportError(
            "read_surface needs SurfaceTopography; install it with: pip install 'jaxcontact[surfaces]'"
        ) from error
