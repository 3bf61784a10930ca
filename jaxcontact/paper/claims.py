"""The conclusions of the paper's sections 4 and 5 on the tribofilm, each checked by a separate computation."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from jaxcontact.paper import comparison, sliding, speed_map, tribofilm
from jaxcontact.paper.comparison import Reproduction, Row, described, report

LOADS = (10.0, 60.0, 500.0)


def simulate(n: int) -> dict[str, Any]:
    """Simulate creep under three loads, the slow sliding runs under two, and the speed maps."""
    return {
        "creep": {load: tribofilm.creep(True, load, n) for load in LOADS},
        "slow": {name: sliding.slide(name, n) for name in ("14a", "14b", "14c", "14d")},
        "map": {load: speed_map.sweep(load, n) for load in speed_map.LOADS},
    }


def compare(found: dict[str, Any], references: Mapping[str, float]) -> list[Row]:
    """Compare each claim with the computed figures."""
    del references  # the claims have no reference values
    drop = {load: float(1.0 - run.peak[-1] / run.peak[0]) for load, run in found["creep"].items()}
    onset = {load: run.speed_of_change(0.01) * 1e6 for load, run in found["map"].items()}
    time = {name: settling_time(run) for name, run in found["slow"].items()}
    rows = [
        described(
            "low loads creep more (share of the peak lost in 120 min)",
            bool(np.all(np.diff(list(drop.values())) < 0.0)),
        )
    ]
    for load, run in found["creep"].items():
        rows.append(
            report(f"W = {load:g} N: share of the peak lost in 120 min [-]", drop[load], "indentation")
        )
        rows.append(
            report(f"W = {load:g} N: film strain at 120 min [-]", run.strain[-1], comparison.STRAINED)
        )
    rows.append(
        described(
            "time-dependent only below about 1 um/s", all(0.5 < speed < 2.0 for speed in onset.values())
        )
    )
    for load, speed in onset.items():
        at = int(np.argmin(np.abs(speed_map.SPEEDS - 1e-6)))
        strain = found["map"][load].strain[at]
        rows.append(report(f"W = {load:g} N: peak 1 % low at [um/s]", speed, "steady state"))
        rows.append(report(f"W = {load:g} N: film strain at 1 um/s [-]", strain, "steady state"))
    for low, high in (("14a", "14b"), ("14c", "14d")):
        speed = sliding.PASSES[low].speed * 1e6
        claim = f"the high load takes longer to become steady, at {speed:.3g} um/s"
        rows.append(described(claim, time[high] > time[low]))
        rows += [
            report(f"{name}: time until within 0.5 % of the steady peak [s]", time[name], "-")
            for name in (low, high)
        ]
        rows += [
            report(f"{name}: film strain at the end [-]", found["slow"][name].strain[-1], "-")
            for name in (low, high)
        ]
    return rows


def settling_time(run: sliding.SlidingRun) -> float:
    """Return the time [s] after which the peak stays within 0.5 % of that of the steady state; infinite if it never does."""
    outside = np.flatnonzero(np.abs(run.peak / run.steady - 1.0) > 5e-3)
    return float(np.append(run.times, np.inf)[outside[-1] + 1]) if outside.size else 0.0


def draw(found: dict[str, Any], directory: Path) -> None:
    """Draw the peak relative to its first value against time: at rest, and during slow sliding."""
    figure, axes = comparison.panels(2)
    creep = found["creep"]
    for i, (load, run) in enumerate(creep.items()):
        colour = comparison.colour(i, len(creep))
        axes[0].plot(run.times / 60.0, run.peak / run.peak[0], color=colour, label=f"{load:g} N")
    for i, (name, run) in enumerate(found["slow"].items()):
        colour = comparison.colour(i, len(found["slow"]))
        axes[1].plot(
            run.times[1:] / 60.0, run.peak[1:] / run.peak[0], color=colour, label=sliding.title(name)[4:]
        )
    axes[1].set_xscale("log")
    for ax, title in zip(axes, ("indentation", "sliding"), strict=True):
        comparison.finish(ax, "time [min]", "peak pressure over the first [-]", title)
    comparison.save(figure, directory / "claims.png")


CASE = Reproduction(
    "claims", "The paper's conclusions, sections 4 and 5", {}, simulate, compare, draw, tribofilm.REMARKS
)
