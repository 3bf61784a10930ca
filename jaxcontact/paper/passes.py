"""Table 6: the fourteen sliding runs, with one pixel per step as in the paper, and one run on a finer grid.

The speed is taken as pixel over step, as in the table (1611 um/s in rows 15e and f, where it prints
1661: only 1611 is one pixel in 5 ms). At W = 60 N and 0.0336 um/s the contact outgrows the paper's window, so that
row has 320 cells of the same size per side. Where the contact on the film is at most 64 cells across, the window is
smaller than the paper's, with cells of the same size: the peaks of three of these runs differ by less
than 3e-5 from those with 256 cells per side. On a half-space the history that left the window is missing: see
``truncation_bound`` in the tables.
"""

import warnings
from functools import lru_cache
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from jaxcontact.paper import comparison, tribofilm
from jaxcontact.paper.comparison import DESCRIBED, EXACT, Row, report

STEADY = "slide_steady, the steady state itself"


class Pass(NamedTuple):
    """The parameters of a sliding run.

    film: on steel if true, else as a half-space; control; pixel [um]; duration and step [s]; widen: cells per side over
    256.
    """

    film: bool
    control: Any
    pixel: float
    duration: float
    step: float
    widen: float = 1.0

    @property
    def speed(self) -> float:
        """The speed [m/s] of one pixel per step."""
        return self.pixel * 1e-6 / self.step


ONE, SIXTY = 1.0, 60.0
PASSES = {
    "13a": Pass(False, jc.Load(SIXTY), 19.3324, 14400.0, 48.0),
    "13b": Pass(False, jc.Approach(36.1380e-6), 19.3324, 14400.0, 48.0),
    "14a": Pass(True, jc.Load(ONE), 1.6110, 14400.0, 48.0),
    "14b": Pass(True, jc.Load(SIXTY), 1.6110, 14400.0, 48.0, 1.25),
    "15a": Pass(True, jc.Load(ONE), 19.3324, 14400.0, 48.0, 0.375),
    "15a, fine": Pass(True, jc.Load(ONE), 1.6110, 2000.0, 4.0, 0.5),
    "15b": Pass(True, jc.Load(SIXTY), 19.3324, 14400.0, 48.0, 0.375),
    "14c": Pass(True, jc.Load(ONE), 1.6110, 120.0, 2.0, 0.375),
    "14d": Pass(True, jc.Load(SIXTY), 1.6110, 600.0, 2.0),
    "14e": Pass(True, jc.Load(ONE), 1.6110, 60.0, 0.25, 0.375),
    "14f": Pass(True, jc.Load(SIXTY), 1.6110, 120.0, 0.25),
    "15c": Pass(True, jc.Load(ONE), 1.6110, 60.0, 0.125, 0.375),
    "15d": Pass(True, jc.Load(SIXTY), 1.6110, 60.0, 0.125),
    "15e": Pass(True, jc.Load(ONE), 8.0551, 10.0, 0.005, 0.375),
    "15f": Pass(True, jc.Load(SIXTY), 8.0551, 10.0, 0.005, 0.375),
}


class SlidingRun(NamedTuple):
    """A sliding run along the middle row of cells: x (n,) [m], pressure (nt, n) [Pa]; the other fields are (nt,).

    steady is the peak of the steady state [Pa].
    """

    times: np.ndarray
    x: np.ndarray
    pressure: np.ndarray
    peak: np.ndarray
    leading: np.ndarray
    centre: np.ndarray
    radius: np.ndarray
    approach: np.ndarray
    load: np.ndarray
    friction: np.ndarray
    strain: np.ndarray
    truncation_bound: np.ndarray
    status: np.ndarray
    steady: float

    @property
    def converged(self) -> bool:
        """True if every step converged, within the grid and with enough cells."""
        return bool(np.all(self.status == 0))

    def edges(self, step: int) -> tuple[float, float]:
        """Return the rear and the front edge of the contact along the middle row [m]."""
        touching = self.x[self.pressure[step] > 0.0]
        return float(touching[0]), float(touching[-1])


def middle_row(outcome: Any) -> Any:
    """Return the pressure along x on the row nearest to the axis, and the largest pressure."""
    return outcome.pressure[:, outcome.pressure.shape[1] // 2], jnp.max(outcome.pressure)


@lru_cache(maxsize=16)
def slide(name: str, n: int) -> SlidingRun:
    """Simulate one row of Table 6, on n cells for the paper's 256."""
    row = PASSES[name]
    body = tribofilm.ON_STEEL if row.film else tribofilm.HALF_SPACE
    grid = jc.Grid.square(round(n * row.widen), 256 * row.widen * row.pixel * 1e-6)
    times = jnp.arange(round(row.duration / row.step) + 1) * row.step
    kernels = jc.kernels(body, tribofilm.BALL, grid, nodes=1)  # a relative error of 4e-8 for this film
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run = jc.slide(
            body, tribofilm.BALL, row.control, times, velocity=row.speed, grid=grid,
            tolerance=1e-7, save=middle_row, kernels=kernels,
        )  # fmt: skip
        steady = np.nan
        if row.film:
            found = jc.slide_steady(body, tribofilm.BALL, row.control, velocity=row.speed, grid=grid)
            steady = float(jnp.max(found.pressure))
    profile, peak = (np.asarray(a) for a in run.saved)
    return SlidingRun(
        times=np.asarray(times),
        x=np.asarray(grid.axes()[0]),
        pressure=profile,
        peak=peak,
        leading=np.asarray(run.leading_peak),
        centre=np.asarray(run.pressure_centre[:, 0]),
        radius=np.asarray(run.contact_radius),
        approach=np.asarray(run.approach),
        load=np.asarray(run.load),
        friction=np.asarray(run.friction_coefficient),
        strain=np.asarray(run.film_strain),
        truncation_bound=np.asarray(run.truncation_bound),
        status=np.asarray(run.status),
        steady=steady,
    )


def title(name: str) -> str:
    """Return the title of a panel."""
    row = PASSES[name]
    what = f"W = {row.control.value:g} N" if isinstance(row.control, jc.Load) else "approach 36.138 µm"
    return f"({name[2:]}) {'film' if row.film else 'half-space'}, {what}, {row.speed * 1e6:.4g} µm/s"


def reports(name: str, found: SlidingRun) -> list[Row]:
    """Return the rows of a run that have no reference."""
    change = float(found.peak[-1] / found.peak[0] - 1.0)
    return [
        report(f"{name}: p0 at the end over p0 at 0 s, less 1 [-]", change, "-"),
        report(f"{name}: shift of the pressure centre over a [-]", found.centre[-1] / found.radius[-1], "-"),
        report(f"{name}: friction coefficient at the end [-]", found.friction[-1], "hysteresis alone"),
        report(f"{name}: largest film strain [-]", np.max(found.strain), comparison.STRAINED),
    ]


def settled(name: str, found: SlidingRun, tolerance: float) -> Row:
    """Return the row that compares the last peak with the steady state."""
    quantity = f"{name}: p0 at the end [GPa]"
    return Row(
        quantity,
        STEADY,
        found.steady / 1e9,
        float(found.peak[-1]) / 1e9,
        tolerance,
        "the remaining transient",
    )


def first_peak(name: str, found: SlidingRun, expected: float) -> Row:
    """Return the row that compares the first peak with the axisymmetric solution."""
    pixels = "the paper's pixel size, no cell centre on the axis"
    return Row(f"{name}: p0 at 0 s [GPa]", EXACT, expected, float(found.peak[0]) / 1e9, 0.005, pixels)


def unsolved(names: Any, found: Any) -> Row:
    """Return the row that requires that in no run a step failed to converge or reached the edge of the grid."""
    bad = sum(int(np.sum((found[name].status == 1) | (found[name].status == 2))) for name in names)
    return Row("steps not converged or at the grid's edge", DESCRIBED, True, bad == 0, reason="yes or no")
