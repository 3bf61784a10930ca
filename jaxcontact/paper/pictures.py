"""Helpers for the pictures of the reproductions: matplotlib figures without global state.

Colours run along viridis, as in ``plotting``, which colour-blind readers can distinguish; its palest end is omitted.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib import colormaps
from matplotlib.figure import Figure

from jaxcontact._support.files import write_whole

SIZE = (5.2, 4.0)  # of one panel, in inches
PALEST = 0.88


def panels(count: int, columns: int = 2) -> tuple[Figure, list[Any]]:
    """Return a figure with ``count`` panels, and their axes."""
    columns = min(columns, count)
    rows = -(-count // columns)
    figure = Figure(figsize=(SIZE[0] * columns, SIZE[1] * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel().tolist()
    return figure, axes[:count]


def colour(i: int, count: int) -> Any:
    """Return the i-th of ``count`` colours, dark to light."""
    return colormaps["viridis"](PALEST * i / max(count - 1, 1))


def profiles(axes: Any, x: Any, curves: Sequence[Any], labels: Sequence[str]) -> None:
    """Plot curves over x, dark to light in order."""
    for i, (curve, label) in enumerate(zip(curves, labels, strict=True)):
        axes.plot(x, curve, color=colour(i, len(curves)), linewidth=1.5, label=label)


def finish(axes: Any, x: str, y: str, title: str, legend: bool = True) -> None:
    """Add labels, a title, a light grid, and a legend outside the curves."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title, fontsize=10)
    axes.grid(color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)
    if legend:
        axes.legend(fontsize=8, frameon=False)


def save(figure: Figure, path: Path) -> None:
    """Write the figure as PNG."""
    write_whole(path, lambda partial: figure.savefig(partial, dpi=150, format="png"))


def over_time(axes: Any, trace: Any, curves: Any, steps: Sequence[int]) -> None:
    """Plot curves (nt, n) over x [um] at the chosen steps, each labelled with its time."""
    size, unit = (60.0, "min") if trace.times[-1] > 60.0 else (1.0, "s")
    labels = [f"{trace.times[i] / size:.3g} {unit}" for i in steps]
    profiles(axes, trace.x * 1e6, [curves[i] for i in steps], labels)
