"""Fig. 13: sliding over the film as a half-space at 0.4028 um/s for 240 min, under a load (a) and an approach (b).

At t = 0 the reference for both is Hertz; beyond, the paper describes shapes. The part of the history that left the
window, 8.4 first contact radii wide, is missing: ``truncation_bound`` is a bound on its displacement.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxcontact.paper import passes, pictures, tribofilm
from jaxcontact.paper.comparison import EXACT, Reproduction, Row, described, report
from jaxcontact.paper.passes import SlidingRun

NAMES = ("13a", "13b")
SHOWN = (0, 1, 3, 10, 30, 100, 300)
REFERENCES = {"13a: approach at 0 s [um]": 36.130, "13b: load at 0 s [N]": 60.0201}


def simulate(n: int) -> dict[str, SlidingRun]:
    """Simulate both runs of 300 steps."""
    return {name: passes.slide(name, n) for name in NAMES}


def compare(found: dict[str, SlidingRun], references: Mapping[str, float]) -> list[Row]:
    """Compare with Hertz at first, then with the shapes described."""
    load, held = found["13a"], found["13b"]
    first = {"13a: approach at 0 s [um]": load.approach[0] * 1e6, "13b: load at 0 s [N]": held.load[0]}
    reason = "62 cells across the contact"
    rows = [Row(key, EXACT, references[key], float(value), 0.003, reason) for key, value in first.items()]
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
    for name in NAMES:
        rows += passes.reports(name, found[name])[:3]
        share = found[name].truncation_bound[-1] / found[name].approach[-1]
        rows.append(
            report(f"{name}: bound on the history outside the window, over the approach [-]", share, "-")
        )
    return [*rows, passes.unsolved(NAMES, found)]


def _spike(run: SlidingRun) -> bool:
    """Return whether the largest pressure at the last time lies in the front fifth of the contact."""
    rear, front = run.edges(-1)
    return bool(run.x[np.argmax(run.pressure[-1])] > front - 0.2 * (front - rear))


def draw(found: dict[str, SlidingRun], directory: Path) -> None:
    """Draw the pressure along x at seven times."""
    figure, axes = pictures.panels(2)
    for ax, (name, run) in zip(axes, found.items(), strict=True):
        pictures.over_time(ax, run, run.pressure / 1e9, SHOWN)
        ax.set_xlim(-1500.0, 2000.0)
        pictures.finish(ax, "x in the direction of sliding [µm]", "pressure [GPa]", passes.title(name))
    pictures.save(figure, directory / "figure_13.png")


CASE = Reproduction(
    "figure_13",
    "Fig. 13: sliding over the film as a half-space",
    REFERENCES,
    simulate,
    compare,
    draw,
    tribofilm.REMARKS,
)
