"""The grid, and the conventions that every other module follows.

Space. Cells are rectangles of ``spacing`` (dx, dy); cell (i, j) of an (nx, ny) grid has its centre
at x = (i - (nx - 1)/2) dx, y = (j - (ny - 1)/2) dy, so the origin is the centre of the grid and its
width is nx dx. Arrays over space are (nx, ny), over time and space (nt, nx, ny).

Signs. z points into the body. Pressure is positive in compression. The displacement is the sum of those of both
surfaces, each into its own body, positive under pressure. The gap is profile + displacement - approach, and is never
negative.

Transforms. Wavenumbers are in rad/m; f^(k) = sum_x f(x) exp(-i k x) as in ``numpy.fft``. A response
function N(k) [m/Pa] is the amplitude of displacement per amplitude of pressure at |k|.

Periodic axes. All fields repeat along a periodic axis. Along both axes, pressure is
the trigonometric polynomial through its values at the cells, and the response is N(k) itself at the wavevectors
of the grid (without a factor for the cell's shape: a single wave is then exact), with N(0) = 0: displacement is
relative to the mean of the body's surface, which a mean pressure does not move, and so is the approach.
Along one axis alone, pressure is that polynomial along it and constant over each cell along the other, and
displacement is relative to that of the surface at a distance of one grid width, along the free axis, from a line load on
a half-space (the displacement under a line load varies with the logarithm of the distance and has no finite value at
infinity). One cell along a periodic y is plane strain, with loads in N on the width dy.

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
from jaxcontact._support.pytree import pytree, require_real, static

MARGIN = 2.0  # width of the grid over the expected width of the contact


@pytree
class Grid:
    """A grid of rectangular cells in the plane of the contact, centred at the origin.

    Args:
        shape: number of cells (nx, ny), at least 4 each, static. One cell along a periodic y represents plane strain.
        spacing: cell sizes (dx, dy) [m] > 0.
        periodic: whether the grid is periodic, (along x, along y) or one value for both, static. The reference of the
            displacement in each case is defined in ``bodies.grid``.

    Example:
        >>> grid = jc.Grid(shape=(64, 32), spacing=(1e-6, 2e-6))
        >>> jc.Grid.square(n=64, width=64e-6).cell_area == 1e-12
        True
    """

    shape: tuple[int, int] = static()
    spacing: tuple[Any, Any]
    periodic: Any = static(default=False)

    def __post_init__(self) -> None:
        if isinstance(self.periodic, bool):  # a static field: equal grids must compare equal
            object.__setattr__(self, "periodic", (self.periodic, self.periodic))

    @classmethod
    def square(cls, n: int, width: Any, *, periodic: Any = False) -> Grid:
        """Return n x n cells over width x width [m], periodic as in ``Grid``. Raises ValueError for fewer than 4 cells."""
        require(n == int(n) and n >= 4, f"Grid.square: n: expected a whole number of at least 4, got {n}")
        return cls(shape=(n, n), spacing=(width / n, width / n), periodic=periodic)

    @classmethod
    def around(cls, body: Any, indenter: Any, control: Any, times: Any, n: int = 256) -> Grid:
        """Choose an n x n grid wide enough for the contact at all times (concrete values only).

        The contact takes 10 to 60 % of the width of the grid along x and along y, according to an estimate of its largest
        half-widths. The cells under a long roller are therefore rectangles that are not squares. If the contact
        nevertheless reaches the edge, the status of the result is 2.
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
        require_real("times", times)
        shape = np.shape(times)
        require(
            len(shape) == 1 and shape[0] > 0,
            f"Grid.around: times: expected a 1-d array of times [s], got shape {shape}",
        )
        try:
            half = np.asarray(indenter.half_widths(body, control, np.asarray(times, dtype=float)))
        except (jax.errors.ConcretizationTypeError, jax.errors.TracerArrayConversionError):
            raise ValueError(
                "Grid.around: expected known values, got values traced by jit, vmap or grad;"
                " choose the grid outside of it, wide enough for all of them"
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
        """The width of the grid (nx dx, ny dy) [m]."""
        return self.shape[0] * self.spacing[0], self.shape[1] * self.spacing[1]

    @property
    def plane_strain(self) -> bool:
        """True if the grid has one cell along y, so that all fields are uniform along y."""
        return self.shape[1] == 1

    @property
    def cell_area(self) -> Any:
        """The area of a cell, dx dy [m^2]."""
        return self.spacing[0] * self.spacing[1]

    def axes(self) -> tuple[Array, Array]:
        """Return the cell centres along x, (nx,), and along y, (ny,) [m]."""
        (nx, ny), (dx, dy) = self.shape, self.spacing
        return (jnp.arange(nx) - (nx - 1) / 2) * dx, (jnp.arange(ny) - (ny - 1) / 2) * dy

    def coordinates(self) -> tuple[Array, Array]:
        """Return x as (nx, 1) and y as (1, ny) [m], which broadcast to the grid."""
        x, y = self.axes()
        return x[:, None], y[None, :]


@pytree
class MovedGrid(Grid):
    """A grid with its coordinates counted from a point (x, y) [m] other than its centre.

    Along a periodic axis they lie within half a width of that point.
    """

    centre: tuple[Any, Any] = (0.0, 0.0)

    def axes(self) -> tuple[Array, Array]:
        away = (a - c for a, c in zip(super().axes(), self.centre, strict=True))
        nearest = lambda a, width: a - width * jnp.round(jax.lax.stop_gradient(a) / width)
        parts = zip(away, self.width, self.periodic, strict=True)
        along_x, along_y = (nearest(a, width) if wraps else a for a, width, wraps in parts)
        return along_x, along_y


def check_grid(grid: Grid) -> Verdict:
    """Check for at least 4 x 4 cells, or 4 x 1, and a positive spacing whose square does not overflow."""
    require(isinstance(grid, Grid), f"grid: expected a Grid, got {type(grid).__name__}")
    both = isinstance(grid.periodic, tuple) and [type(each) for each in grid.periodic] == [bool, bool]
    require(both, f"grid periodic: expected True, False or two of them, got {grid.periodic!r}")
    line = tuple(grid.shape[1:]) == (1,) and grid.periodic[1]
    good = len(grid.shape) == 2 and all(isinstance(n, int) and n >= 4 for n in grid.shape[: 1 if line else 2])
    require(good, f"grid shape: expected two whole numbers of at least 4, got {grid.shape}")
    require(len(grid.spacing) == 2, f"grid spacing: expected (dx, dy), got {grid.spacing}")
    along_x, along_y = (checks.between("grid spacing [m]", d, 1e-30, 1e30) for d in grid.spacing)
    return along_x & along_y


def check_free_along_x(grid: Grid, verb: str) -> None:
    """Check that the grid is not periodic along x, for functions restricted to free space and plane strain."""
    require(
        not any(grid.periodic) or (grid.plane_strain and not grid.periodic[0]),
        f"grid: expected a grid not periodic along x, and along y in plane strain only, in {verb}, got"
        f" periodic={grid.periodic} with {tuple(grid.shape)} cells",
    )
