"""The grid, and the conventions that every other module follows.

Space. Cells are rectangles of ``spacing`` (dx, dy); cell (i, j) of an (nx, ny) grid has its centre
at x = (i - (nx - 1)/2) dx, y = (j - (ny - 1)/2) dy, so the origin is the middle of the grid and its
width is nx dx. Arrays over space are (nx, ny), over time and space (nt, nx, ny).

Signs. z points into the body. Pressure is positive in compression. Displacement is that of both
surfaces towards each other's inside, positive under pressure. The gap is
profile + displacement - approach, and is never negative.

Transforms. Wavenumbers are in rad/m; f^(k) = sum_x f(x) exp(-i k x) as in ``numpy.fft``. A response
function N(k) [m/Pa] is the amplitude of displacement per amplitude of pressure at |k|.

Periodic axes. What is on the grid repeats itself without end along a periodic axis. Along both, pressure is
the trigonometric polynomial through its values at the cells, and the response is N(k) itself at the wavevectors
of the grid (no factor for the cells: a single wave is then exact), with N(0) = 0: displacement is
that from the mean of the body's surface, on which a mean pressure does nothing, and the approach is measured from it.
Along one axis alone, pressure is that polynomial along it and constant over each cell along the other, and
displacement is that from the surface at one width of the grid, along the free axis, from a line load on a half-space
(a line load moves all places up to there by the logarithm of the distance, and would move far places without
limit). With one cell along a periodic y all is plane strain, with loads in N on the width dy.

Units. SI at the public boundary; any consistent set gives the same answer.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict, require
from jaxcontact._support.pytree import pytree, static

MARGIN = 2.0  # half the grid over the expected half-width of the contact, which then takes half of the width


@pytree
class Grid:
    """Rectangular cells in the plane of the contact; see the module for the place of each.

    Args:
        shape: (nx, ny), at least 4 each; static. One cell along a periodic y is plane strain.
        spacing: (dx, dy) [m] > 0.
        periodic: along x and y, static: True for both; see the module for what displacement then means.

    Example:
        >>> grid = jc.Grid(shape=(64, 32), spacing=(1e-6, 2e-6))
        >>> jc.Grid.square(n=64, width=64e-6).cell_area == 1e-12
        True
    """

    shape: tuple[int, int] = static()
    spacing: tuple[Any, Any]
    periodic: Any = static(default=False)

    def __post_init__(self) -> None:
        if isinstance(self.periodic, bool):  # static, so that of two equal grids it must be equal
            object.__setattr__(self, "periodic", (self.periodic, self.periodic))

    @classmethod
    def square(cls, n: int, width: Any) -> Grid:
        """n x n cells over width x width [m]. Raises ValueError for fewer than 4 cells."""
        require(n == int(n) and n >= 4, f"Grid.square: n: expected a whole number of at least 4, got {n}")
        return cls(shape=(n, n), spacing=(width / n, width / n))

    @classmethod
    def around(cls, body: Any, indenter: Any, control: Any, times: Any, n: int = 256) -> Grid:
        """Choose an n x n grid wide enough for the contact at all times (concrete values only).

        The contact takes 10 to 60 % of the grid's width along x and along y, by the indenter's estimate of its largest
        half-widths: the cells under a long roller are rectangles. Should the contact reach the edge all the same, the
        result's status says so.
        """
        given = (
            ("body", body, "substrate"),
            ("indenter", indenter, "profile"),
            ("control", control, "value"),
        )
        for name, value, attribute in given:
            require(
                hasattr(value, attribute),
                f"Grid.around: {name}: expected in the order body, indenter, control, times,"
                f" got {type(value).__name__}",
            )
        try:
            half = np.asarray(indenter.half_widths(body, control, np.asarray(times, dtype=float)))
        except (jax.errors.ConcretizationTypeError, jax.errors.TracerArrayConversionError):
            raise ValueError(
                "Grid.around: expected values that are known, got some that jit, vmap or grad trace;"
                " choose the grid outside, wide enough for all of them"
            ) from None
        if not np.all(np.isfinite(half) & (half > 0.0)):
            raise ValueError(
                f"Grid.around: expected a load or an approach > 0 at some time, got a contact of {half.min()} m"
            )
        across, along = (2.0 * MARGIN * float(width) for width in half)
        cls.square(n, across)  # for the check of n
        return cls(shape=(n, n), spacing=(across / n, along / n))

    @property
    def width(self) -> tuple[Any, Any]:
        """(nx dx, ny dy) [m]."""
        return self.shape[0] * self.spacing[0], self.shape[1] * self.spacing[1]

    @property
    def plane_strain(self) -> bool:
        """Whether all is the same along y."""
        return self.shape[1] == 1

    @property
    def cell_area(self) -> Any:
        """dx dy [m^2]."""
        return self.spacing[0] * self.spacing[1]

    def axes(self) -> tuple[Array, Array]:
        """Cell centres along x, (nx,), and along y, (ny,) [m]."""
        (nx, ny), (dx, dy) = self.shape, self.spacing
        return (jnp.arange(nx) - (nx - 1) / 2) * dx, (jnp.arange(ny) - (ny - 1) / 2) * dy

    def coordinates(self) -> tuple[Array, Array]:
        """x as (nx, 1) and y as (1, ny) [m], which broadcast to the grid."""
        x, y = self.axes()
        return x[:, None], y[None, :]


def check_grid(grid: Grid) -> Verdict:
    """At least 4 x 4 cells, or 4 x 1; spacing above zero and no more than can be multiplied."""
    require(isinstance(grid, Grid), f"grid: expected a Grid, got {type(grid).__name__}")
    _check_periodic(grid)
    line = tuple(grid.shape[1:]) == (1,) and grid.periodic[1]
    good = len(grid.shape) == 2 and all(isinstance(n, int) and n >= 4 for n in grid.shape[: 1 if line else 2])
    require(good, f"grid shape: expected two whole numbers of at least 4, got {grid.shape}")
    require(len(grid.spacing) == 2, f"grid spacing: expected (dx, dy), got {grid.spacing}")
    along_x, along_y = (checks.between("grid spacing [m]", d, 1e-30, 1e30) for d in grid.spacing)
    return along_x & along_y


def _check_periodic(grid: Grid) -> None:
    good = isinstance(grid.periodic, tuple) and [type(along) for along in grid.periodic] == [bool, bool]
    require(good, f"grid periodic: expected True, False or two of them, got {grid.periodic!r}")


def check_not_periodic(grid: Grid, verb: str) -> None:
    """For what knows free space alone."""
    require(
        not any(grid.periodic),
        f"grid: expected one that is not periodic in {verb}, which knows free space alone, got periodic={grid.periodic}",
    )


def check_free_along_x(grid: Grid, verb: str) -> None:
    """For what knows free space and plane strain."""
    require(
        not any(grid.periodic) or (grid.plane_strain and not grid.periodic[0]),
        f"grid: expected one that is not periodic along x, and along y in plane strain alone, in {verb}, got"
        f" periodic={grid.periodic} with {tuple(grid.shape)} cells",
    )
