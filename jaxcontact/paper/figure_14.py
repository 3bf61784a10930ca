"""Fig. 14: sliding over the film at 0.034 (a, b), 0.81 (c, d) and 6.4 um/s (e, f), under 1 N and 60 N.

References: at t = 0 the axisymmetric solution; at the end the steady state, if the run is long enough to reach it (c to
f). The shapes are the paper's: marked relaxation and shift in a and b, small changes in c and d, hardly any
in e and f.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxcontact.paper import passes, pictures, tribofilm
from jaxcontact.paper.comparison import Reproduction, Row, described
from jaxcontact.paper.passes import SlidingRun

NAMES = ("14a", "14b", "14c", "14d", "14e", "14f")
SETTLED = NAMES[2:]
REFERENCES = {"14b: p0 at 0 s [GPa]": 1.16724}
MARKED, SMALL, HARDLY = 0.1, 0.1, 0.02  # relative change of the peak


def simulate(n: int) -> dict[str, SlidingRun]:
    """Simulate all six runs."""
    return {name: passes.slide(name, n) for name in NAMES}


def compare(found: dict[str, SlidingRun], references: Mapping[str, float]) -> list[Row]:
    """Compare the first and the last peak, then the shapes."""
    change = {name: abs(float(run.peak[-1] / run.peak[0] - 1.0)) for name, run in found.items()}
    shift = {name: float(run.centre[-1] / run.radius[-1]) for name, run in found.items()}
    rows = [passes.first_peak("14b", found["14b"], references["14b: p0 at 0 s [GPa]"])]
    rows += [passes.settled(name, found[name], 0.005) for name in SETTLED]
    rows += [
        described(f"{name}: marked relaxation and shift", change[name] > MARKED and shift[name] > 0.05)
        for name in ("14a", "14b")
    ]
    rows += [
        described(f"{name}: small changes, no shift", change[name] < SMALL and shift[name] < 0.05)
        for name in ("14c", "14d")
    ]
    rows += [described(f"{name}: hardly any change", change[name] < HARDLY) for name in ("14e", "14f")]
    for name in NAMES:
        rows += passes.reports(name, found[name])
    return [*rows, passes.unsolved(NAMES, found)]


def draw(found: dict[str, SlidingRun], directory: Path) -> None:
    """Draw the pressure along x at six times, one panel per run."""
    figure, axes = pictures.panels(6)
    for ax, (name, run) in zip(axes, found.items(), strict=True):
        steps = np.unique(
            np.round(len(run.times[1:]) * np.array([0.0, 0.05, 0.1, 0.25, 0.5, 1.0])).astype(int)
        )
        pictures.over_time(ax, run, run.pressure / 1e9, steps)
        pictures.finish(ax, "x in the direction of sliding [µm]", "pressure [GPa]", passes.title(name))
    pictures.save(figure, directory / "figure_14.png")


CASE = Reproduction(
    "figure_14",
    "Fig. 14: sliding over the film up to 6.4 um/s",
    REFERENCES,
    simulate,
    compare,
    draw,
    tribofilm.REMARKS,
)
