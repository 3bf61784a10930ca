"""Grids that tell the error of the grid in a fit to fields.

The error of pressures, gaps and parameters falls with the square of the size of the cells, but for a part that oscillates
with the place of the edge of contact among the cells. With images f on cells of a size H, and f' on cells of a size r H,
the error is estimated as (Richardson's extrapolation)

    f(0) - f = (f' - f)/(1 - r^2).

The mean over two finer grids of slightly different widths corrects the images of the fit. Coarser grids are used to begin
the search.
"""

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp

import jaxcontact as jc
from fitting.models.imaging import sampled
from fitting.models.pressing import PressedImages

WIDER = 1.0, 1.03, 1.06, 1.09, 1.12  # widths, over that of the fit, of grids of half the cells
COARSER = 1 / 2, 3 / 4  # cells along each axis, over those of the fit, where the width cannot differ
FINER = (2.0, 1.0), (2.0, 1.06)  # cells along each axis and width of the finer grids, over those of the fit
FINER_HERE = (2.0, 1.0), (1.5, 1.0)  # the same where the width cannot differ

Press = Callable[[Any, jc.Grid], PressedImages]


class Finer(NamedTuple):
    """The contact on a finer grid; share: r^2, the part of the error that it leaves."""

    pressing: PressedImages
    share: float


def coarser(press: Press, indenter: Any, grid: jc.Grid) -> tuple[PressedImages, ...]:
    """Return the contact on coarser grids, with different places of the edge of contact among their cells."""
    changes = [(share, 1.0) for share in COARSER] if _fixed(indenter, grid) else [(0.5, w) for w in WIDER]
    return tuple(_pressed(press, indenter, grid, *change) for change in changes)


def finer(press: Press, indenter: Any, grid: jc.Grid) -> tuple[Finer, ...]:
    """Return the contact on finer grids."""
    changes = FINER_HERE if _fixed(indenter, grid) else FINER
    return tuple(
        Finer(_pressed(press, indenter, grid, *change), (change[1] / change[0]) ** 2) for change in changes
    )


def _fixed(indenter: Any, grid: jc.Grid) -> bool:
    """Return whether the width is a period, or the heights of the indenter are not known beyond it."""
    return any(grid.periodic) or isinstance(indenter, jc.HeightField)


def _pressed(press: Press, indenter: Any, grid: jc.Grid, share: float, wider: float) -> PressedImages:
    """Return the contact on a grid of another width with a share of the cells along each axis."""
    shape = tuple(max(int(share * n), 4) for n in grid.shape)
    spacing = tuple(wider * d * n / m for d, n, m in zip(grid.spacing, grid.shape, shape, strict=True))
    own = jc.Grid(shape, spacing, grid.periodic)
    return press(_on_grid(indenter, grid, own), own)


def _on_grid(indenter: Any, grid: jc.Grid, own: jc.Grid) -> Any:
    """Return the indenter for another grid of the same width: heights between cells follow by cubic convolution."""
    if not isinstance(indenter, jc.HeightField):
        return indenter
    heights = sampled(jnp.asarray(indenter.heights), grid, *own.coordinates())
    return dataclasses.replace(indenter, heights=heights)
