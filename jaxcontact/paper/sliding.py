"""Figs. 13 to 15 and Table 6: the fourteen sliding runs, with one pixel per step as in the paper, and one on a finer grid.

The speed is taken as pixel over step, as in the table (1611 um/s in rows 15e and f, where it prints
1661: only 1611 is one pixel in 5 ms). At W = 60 N and 0.0336 um/s the contact outgrows the paper's window, so that
row has 320 cells of the same size per side. Where the contact on the film is at most 64 cells across, the window is
smaller than the paper's, with cells of the same size: the peaks of three of these runs differ by less
than 3e-5 from those with 256 cells per side. On a half-space the history that left the window is missing: see
``truncation_bound`` in the tables.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from jaxcontact.paper import comparison, tribofilm
from jaxcontact.paper.comparison import (
    DESCRIBED,
    Reproduction,
    Row,
    compared,
    described,
    report,
    worst,
)

STEADY = "slide_steady, the steady state itself"
PIXELS = "the paper's pixel size, no cell centre on the axis"


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
    centre: np.ndarray
    radius: np.ndarray
    approach: np.ndarray
    load: np.ndarray
    friction: np.ndarray
    strain: np.ndarray
    truncation_bound: np.ndarray
    status: np.ndarray
    steady: float

    def edges(self, step: int) -> tuple[float, float]:
        """Return the rear and the front edge of the contact along the middle row [m]."""
        touching = self.x[self.pressure[step] > 0.0]
        return float(touching[0]), float(touching[-1])


@lru_cache(maxsize=16)
def slide(name: str, n: int) -> SlidingRun:
    """Simulate one row of Table 6, on n cells for the paper's 256."""
    row = PASSES[name]
    body = tribofilm.ON_STEEL if row.film else tribofilm.HALF_SPACE
    grid = jc.Grid.square(round(n * row.widen), 256 * row.widen * row.pixel * 1e-6)
    times = jnp.arange(round(row.duration / row.step) + 1) * row.step
    # the pressure along x on the row nearest to the axis, and the largest pressure
    middle_row = lambda step: (step.pressure[:, step.pressure.shape[1] // 2], jnp.max(step.pressure))
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


def settled(name: str, found: SlidingRun) -> Row:
    """Return the row that compares the last peak with the steady state."""
    quantity = f"{name}: p0 at the end [GPa]"
    last = float(found.peak[-1]) / 1e9
    return Row(quantity, STEADY, found.steady / 1e9, last, 0.005, "the remaining transient")


def _of_figure(
    figure: int,
    text: str,
    names: Sequence[str],
    references: Mapping[str, float],
    compare: Callable[[dict[str, SlidingRun], Mapping[str, float]], list[Row]],
    shown: Callable[[SlidingRun], Any],
    limits: Callable[[SlidingRun], tuple[float, float] | None],
) -> Reproduction:
    """Return a figure of sliding runs: the pressure along x, one panel a run.

    compare: the rows of the figure, to which one on failed steps is added; shown: steps of a run that are drawn;
    limits: of its x axis [um], None for the whole window.
    """

    def simulate(n: int) -> dict[str, SlidingRun]:
        return {name: slide(name, n) for name in names}

    def draw(found: dict[str, SlidingRun], directory: Path) -> None:
        sheet, axes = comparison.panels(len(names))
        for ax, (name, run) in zip(axes, found.items(), strict=True):
            comparison.over_time(ax, run, run.pressure / 1e9, shown(run))
            if (ends := limits(run)) is not None:
                ax.set_xlim(*ends)
            comparison.finish(ax, "x in the direction of sliding [µm]", "pressure [GPa]", title(name))
        for empty in sheet.axes[len(axes) :]:
            empty.set_visible(False)
        comparison.save(sheet, directory / f"figure_{figure}.png")

    def compare_and_check(found: dict[str, SlidingRun], expected: Mapping[str, float]) -> list[Row]:
        # in no run a step failed to converge (status 1) or reached the edge of the grid (2)
        bad = sum(int(np.sum((found[name].status == 1) | (found[name].status == 2))) for name in names)
        return [*compare(found, expected), described("steps not converged or at the grid's edge", bad == 0)]

    return Reproduction(
        f"figure_{figure}",
        f"Fig. {figure}{text}",
        references,
        simulate,
        compare_and_check,
        draw,
        tribofilm.REMARKS,
    )


def _at(*shares: float) -> Callable[[SlidingRun], Any]:
    """Return a function that gives the steps at shares of a run."""
    return lambda run: np.unique(np.round(len(run.times[1:]) * np.array(shares)).astype(int))


# Fig. 13: sliding over the film as a half-space at 0.4028 um/s for 240 min, under a load (a) and an approach (b).
#
# At t = 0 the reference for both is Hertz; beyond, the paper describes shapes. The part of the history that left the
# window, 8.4 first contact radii wide, is missing: ``truncation_bound`` is a bound on its displacement.


def _compare_13(found: dict[str, SlidingRun], references: Mapping[str, float]) -> list[Row]:
    """Compare with Hertz at first, then with the shapes described."""
    load, held = found["13a"], found["13b"]
    first = {"13a: approach at 0 s [um]": load.approach[0] * 1e6, "13b: load at 0 s [N]": held.load[0]}
    rows = [
        compared(references, key, value, 0.003, "62 cells across the contact") for key, value in first.items()
    ]
    rows += [
        described("13a: pressure shifts to the leading side", load.centre[-1] > 0.1 * load.radius[-1]),
        described("13a: spike at the leading edge", _spike(load)),
        described(
            "13a: contact shifts in the sliding direction", sum(load.edges(-1)) > 0.2 * load.radius[-1]
        ),
        described("13b: pressure relaxes", held.load[-1] < 0.5 * held.load[0]),
        described("13b: the rear of the contact shrinks", held.edges(-1)[0] > 0.5 * held.edges(0)[0]),
        described("13b: spike at the leading edge", _spike(held)),
    ]
    for name in ("13a", "13b"):
        rows += reports(name, found[name])[:3]
        share = found[name].truncation_bound[-1] / found[name].approach[-1]
        rows.append(
            report(f"{name}: bound on the history outside the window, over the approach [-]", share, "-")
        )
    return rows


def _spike(run: SlidingRun) -> bool:
    """Return whether the largest pressure at the last time lies in the front fifth of the contact."""
    rear, front = run.edges(-1)
    return bool(run.x[np.argmax(run.pressure[-1])] > front - 0.2 * (front - rear))


FIGURE_13 = _of_figure(
    13,
    ": sliding over the film as a half-space",
    ("13a", "13b"),
    {"13a: approach at 0 s [um]": 36.130, "13b: load at 0 s [N]": 60.0201},
    _compare_13,
    shown=lambda run: (0, 1, 3, 10, 30, 100, 300),
    limits=lambda run: (-1500.0, 2000.0),
)

# Fig. 14: sliding over the film at 0.034 (a, b), 0.81 (c, d) and 6.4 um/s (e, f), under 1 N and 60 N.
#
# References: at t = 0 the axisymmetric solution; at the end the steady state, if the run is long enough to reach it (c to
# f). The shapes are the paper's: marked relaxation and shift in a and b, small changes in c and d, hardly any in e and f.

MARKED, SMALL, HARDLY = 0.1, 0.1, 0.02  # relative change of the peak


def _compare_14(found: dict[str, SlidingRun], references: Mapping[str, float]) -> list[Row]:
    """Compare the first and the last peak, then the shapes."""
    change = {name: abs(float(run.peak[-1] / run.peak[0] - 1.0)) for name, run in found.items()}
    shift = {name: float(run.centre[-1] / run.radius[-1]) for name, run in found.items()}
    rows = [compared(references, "14b: p0 at 0 s [GPa]", found["14b"].peak[0] / 1e9, 0.005, PIXELS)]
    rows += [settled(name, found[name]) for name in ("14c", "14d", "14e", "14f")]
    rows += [
        described(f"{name}: marked relaxation and shift", change[name] > MARKED and shift[name] > 0.05)
        for name in ("14a", "14b")
    ]
    rows += [
        described(f"{name}: small changes, no shift", change[name] < SMALL and shift[name] < 0.05)
        for name in ("14c", "14d")
    ]
    rows += [described(f"{name}: hardly any change", change[name] < HARDLY) for name in ("14e", "14f")]
    for name in found:
        rows += reports(name, found[name])
    return rows


FIGURE_14 = _of_figure(
    14,
    ": sliding over the film up to 6.4 um/s",
    ("14a", "14b", "14c", "14d", "14e", "14f"),
    {"14b: p0 at 0 s [GPa]": 1.16724},
    _compare_14,
    shown=_at(0.0, 0.05, 0.1, 0.25, 0.5, 1.0),
    limits=lambda run: None,
)

# Fig. 15: sliding over the film at 0.40 (a, b), 12.9 (c, d) and 1611 um/s (e, f), under 1 N and 60 N.
#
# Together with Figs. 13 and 14 these are the fourteen rows of Table 6. At W = 1 N and 0.40 um/s the contact is only four of
# the paper's pixels of 19.3 um across; the same run on a pixel of 1.611 um is added ("15a, fine"). At the end every
# run has reached the steady state; e and f, in 2000 steps, are also the same at 1, 5 and 10 s.

FAST = ("15e", "15f")


def _compare_15(found: dict[str, SlidingRun], references: Mapping[str, float]) -> list[Row]:
    """Compare the first and the last peak, and the paper's statements on e and f."""
    rows = [compared(references, "15d: p0 at 0 s [GPa]", found["15d"].peak[0] / 1e9, 0.005, PIXELS)]
    rows += [settled(name, found[name]) for name in found]
    for name in FAST:
        run = found[name]
        at = [int(np.argmin(np.abs(run.times - t))) for t in (1.0, 5.0, 10.0)]
        same = worst(run.peak[at] / run.peak[at[-1]])
        quantity = f"{name}: p0 at 1 and 5 s over p0 at 10 s, worst"
        rows.append(Row(quantity, DESCRIBED, 1.0, same, 1e-4, "the same in the paper's picture"))
    change = lambda name: abs(float(found[name].peak[-1] / found[name].peak[0] - 1.0))
    rows += [described(f"{name}: no change at all", change(name) < 1e-3) for name in FAST]
    across = 2.0 * float(found["15a"].radius[0]) / (PASSES["15a"].pixel * 1e-6)
    rows.append(report("15a: cells across the contact at 0 s [-]", across, "too few: see 15a, fine"))
    for name in found:
        rows += reports(name, found[name])
    return rows


FIGURE_15 = _of_figure(
    15,
    ", Table 6: sliding over the film up to 1.6 mm/s",
    ("15a", "15a, fine", "15b", "15c", "15d", "15e", "15f"),
    {"15d: p0 at 0 s [GPa]": 1.16724},
    _compare_15,
    shown=_at(0.0, 0.1, 0.5, 1.0),
    limits=lambda run: (-1.6e6 * float(np.max(run.radius)), 1.6e6 * float(np.max(run.radius))),
)
