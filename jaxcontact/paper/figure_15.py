"""Fig. 15: sliding over the film at 0.40 (a, b), 12.9 (c, d) and 1611 um/s (e, f), under 1 N and 60 N.

Together with Figs. 13 and 14 these are the fourteen rows of Table 6. At W = 1 N and 0.40 um/s the contact is only four of
the paper's pixels of 19.3 um across; the same run on a pixel of 1.611 um is added ("15a, fine"). At the end every
run has reached the steady state; e and f are also the same at 1, 5 and 10 s.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxcontact.paper import passes, pictures, tribofilm
from jaxcontact.paper.comparison import DESCRIBED, Reproduction, Row, described, report, worst
from jaxcontact.paper.passes import SlidingRun

NAMES = ("15a", "15a, fine", "15b", "15c", "15d", "15e", "15f")
FAST = ("15e", "15f")
REFERENCES = {"15d: p0 at 0 s [GPa]": 1.16724}


def simulate(n: int) -> dict[str, SlidingRun]:
    """Simulate all seven runs, with 2000 steps in e and f."""
    return {name: passes.slide(name, n) for name in NAMES}


def compare(found: dict[str, SlidingRun], references: Mapping[str, float]) -> list[Row]:
    """Compare the first and the last peak, and the paper's statements on e and f."""
    rows = [passes.first_peak("15d", found["15d"], references["15d: p0 at 0 s [GPa]"])]
    rows += [passes.settled(name, found[name], 0.005) for name in NAMES]
    for name in FAST:
        run = found[name]
        at = [int(np.argmin(np.abs(run.times - t))) for t in (1.0, 5.0, 10.0)]
        same = worst(run.peak[at] / run.peak[at[-1]])
        quantity = f"{name}: p0 at 1 and 5 s over p0 at 10 s, worst"
        rows.append(Row(quantity, DESCRIBED, 1.0, same, 1e-4, "the same in the paper's picture"))
    change = lambda name: abs(float(found[name].peak[-1] / found[name].peak[0] - 1.0))
    rows += [described(f"{name}: no change at all", change(name) < 1e-3) for name in FAST]
    across = 2.0 * float(found["15a"].radius[0]) / (passes.PASSES["15a"].pixel * 1e-6)
    rows.append(report("15a: cells across the contact at 0 s [-]", across, "too few: see 15a, fine"))
    for name in NAMES:
        rows += passes.reports(name, found[name])
    return [*rows, passes.unsolved(NAMES, found)]


def draw(found: dict[str, SlidingRun], directory: Path) -> None:
    """Draw the pressure along x at six times, one panel per run."""
    figure, axes = pictures.panels(7)
    for ax, (name, run) in zip(axes, found.items(), strict=True):
        steps = np.unique(np.round(len(run.times[1:]) * np.array([0.0, 0.1, 0.5, 1.0])).astype(int))
        pictures.over_time(ax, run, run.pressure / 1e9, steps)
        reach = 1.6e6 * float(np.max(run.radius))
        ax.set_xlim(-reach, reach)
        pictures.finish(ax, "x in the direction of sliding [µm]", "pressure [GPa]", passes.title(name))
    for empty in figure.axes[len(axes) :]:
        empty.set_visible(False)
    pictures.save(figure, directory / "figure_15.png")


CASE = Reproduction(
    "figure_15",
    "Fig. 15, Table 6: sliding over the film up to 1.6 mm/s",
    REFERENCES,
    simulate,
    compare,
    draw,
    tribofilm.REMARKS,
)
