"""Figure of a map of force curves: modulus, contact point and verdict, over the place or the number of the curve."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.views import axis_units

COLOURS = {"accepted": "C0", "rejected": "C1", "failed": "0.6"}
SIZE = 5.0  # width of a map [inches]


def draw(points: Sequence[Any]) -> Any:
    """Return a Figure of a list of ``map_command.MapPoint``."""
    from matplotlib.figure import Figure

    x, y = (np.array([getattr(one, name) for one in points]) for name in ("x", "y"))
    figure = Figure(figsize=(3 * SIZE, SIZE), layout="constrained")
    axes = [figure.add_subplot(1, 3, k + 1) for k in range(3)]
    if np.all(np.isfinite(x) & np.isfinite(y)) and (np.ptp(x) > 0.0 or np.ptp(y) > 0.0):
        _maps(figure, axes, points, x - x.min(), y - y.min())
    else:
        _rows(axes, points)
    return figure


def _maps(figure: Any, axes: list[Any], points: Sequence[Any], x: np.ndarray, y: np.ndarray) -> None:
    """Draw modulus, contact point and verdict over the place."""
    from matplotlib.colors import LogNorm

    good = np.array([one.verdict == "accepted" for one in points])
    side = 0.8 * 72.0 * SIZE * _spacing(x, y) / max(np.ptp(x), np.ptp(y), 1e-300)
    size = float(np.clip(0.7 * side, 3.0, 60.0)) ** 2
    for axes_, name, unit, values in (
        (axes[0], "Young's modulus", "Pa", np.array([one.E for one in points])),
        (axes[1], "contact point", "m", np.array([one.contact for one in points])),
    ):
        known = good & np.isfinite(values)
        axes_.scatter(x[~known], y[~known], s=size, marker="s", facecolor="none", edgecolor="0.7")
        if known.any():
            factor, shown = axis_units.multiple(unit, float(np.max(np.abs(values[known]))))
            norm = LogNorm() if unit == "Pa" and np.ptp(values[known]) > 0.0 else None
            drawn = axes_.scatter(x[known], y[known], s=size, marker="s", c=values[known] / factor, norm=norm)
            figure.colorbar(drawn, ax=axes_, label=f"{name} [{shown}]")
        axes_.set_title(f"{name}; empty squares: not accepted", fontsize="medium")
    for verdict, colour in COLOURS.items():
        some = np.array([one.verdict == verdict for one in points])
        axes[2].scatter(x[some], y[some], s=size, marker="s", color=colour, label=f"{verdict}: {some.sum()}")
    axes[2].legend()
    for one in axes:
        one.set_aspect("equal", adjustable="datalim")
        axis_units.label(one.xaxis, "x", "m", x)
        axis_units.label(one.yaxis, "y", "m", y)


def _spacing(x: np.ndarray, y: np.ndarray) -> float:
    """Return the least distance between places along an axis [m]."""
    steps = np.concatenate([np.diff(np.unique(np.round(v, 12))) for v in (x, y)])
    return float(steps.min()) if steps.size else 1.0


def _rows(axes: list[Any], points: Sequence[Any]) -> None:
    """Draw modulus with intervals, contact point and verdict over the number of the curve."""
    number = np.arange(len(points))
    for verdict, colour in COLOURS.items():
        some = np.array([one.verdict == verdict for one in points])
        E, low, high, contact = (
            np.array([getattr(one, name) for one in points])[some] for name in ("E", "low", "high", "contact")
        )
        ends = np.clip(np.where(np.isfinite([low, high]), [E - low, high - E], 0.0), 0.0, None)
        axes[0].errorbar(number[some], E, ends, fmt=".", color=colour, label=verdict)
        axes[1].plot(number[some], contact, ".", color=colour)
        axes[2].bar([verdict], [some.sum()], color=colour)
    known = np.array([one.E for one in points if np.isfinite(one.E)])
    if known.size:
        axes[0].set_yscale("log")
    axes[0].set_ylabel("Young's modulus [Pa]")
    axes[0].legend()
    axis_units.label(
        axes[1].yaxis,
        "contact point",
        "m",
        np.array([one.contact for one in points if np.isfinite(one.contact)]),
    )
    axes[2].set_ylabel("number of curves")
    for one in axes[:2]:
        one.set_xlabel("number of the curve")
