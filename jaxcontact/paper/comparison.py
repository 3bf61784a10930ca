"""The parts of a reproduction: a run, a case, its rows of comparisons, and their printed and stored forms."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

import jaxcontact as jc
from jaxcontact._support.files import write_whole

EXACT = "exact solution"
PAPER = "paper"
DESCRIBED = "described in the paper"
BIAS = "the paper's kernel is 0.16 to 0.19 % too stiff for the film"
GRID = "discretisation at N = 256"
CELLS = "the edge is resolved to a few hundredths of a cell"
COARSE = "a quarter of a cell at 0 s"
OFF_AXIS = "no cell centre on the axis at even N"
STRAINED = "linear theory is inaccurate above 0.2"


@dataclass(frozen=True)
class Row:
    """A row of a table: one comparison.

    quantity: with its unit in brackets. tolerance: relative; None for a yes-or-no comparison.
    expected: None makes the row a report without a reference, which always holds.
    """

    quantity: str
    source: str
    expected: float | bool | None
    found: float | bool
    tolerance: float | None = None
    reason: str = ""

    @property
    def difference(self) -> float | None:
        """The relative difference found/expected - 1; None if there is no numerical reference."""
        if self.expected is None or isinstance(self.expected, bool):
            return None
        return float(self.found / self.expected - 1.0)

    @property
    def holds(self) -> bool:
        if self.expected is None:
            return True
        if self.difference is None or self.tolerance is None:
            return self.found is self.expected
        return abs(self.difference) <= self.tolerance


@dataclass(frozen=True)
class Reproduction:
    """The reproduction of one figure of the paper.

    simulate(n) runs it on n x n cells; compare(simulated, references) returns the rows;
    draw(simulated, directory) writes the pictures. The references are separate, so that tests can substitute wrong ones.
    """

    name: str
    title: str
    references: Mapping[str, float]
    simulate: Callable[[int], Any]
    compare: Callable[[Any, Mapping[str, float]], list[Row]]
    draw: Callable[[Any, Path], None]
    remarks: tuple[str, ...] = ()


def compared(
    references: Mapping[str, float],
    quantity: str,
    found: Any,
    tolerance: float,
    reason: str,
    source: str = EXACT,
) -> Row:
    """Return the row of a number whose reference has the name of the quantity."""
    return Row(quantity, source, references[quantity], float(found), tolerance, reason)


def described(quantity: str, found: Any) -> Row:
    """Return the row of a qualitative statement of the paper, which must hold."""
    return Row(quantity, DESCRIBED, True, bool(found), reason="yes or no")


def solved(traces: Any) -> Row:
    """Return the row that requires every step of every trace to have converged, within the grid and with enough cells."""
    converged = all(trace.converged for trace in traces)
    return Row("every step converged inside the grid", "solver", True, converged, reason="yes or no")


def report(quantity: str, found: Any, reason: str) -> Row:
    """Return the row of a figure without a reference."""
    return Row(quantity, "-", None, float(found), reason=reason)


def as_dict(row: Row) -> dict[str, Any]:
    """Return a row as a dictionary for summary.json."""
    return {
        "quantity": row.quantity,
        "source": row.source,
        "expected": row.expected,
        "found": row.found,
        "relative_difference": row.difference,
        "relative_tolerance": row.tolerance,
        "reason": row.reason,
        "holds": row.holds,
    }


HEADER = (
    "quantity",
    "source",
    "expected",
    "found",
    "difference",
    "tolerance",
    "holds",
    "reason of the tolerance",
)


def table(rows: list[Row]) -> str:
    """Return the rows as an aligned table of text."""
    lines = [HEADER, *(_cells(row) for row in rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(HEADER))]
    return "\n".join(
        "  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip() for line in lines
    )


def _cells(row: Row) -> tuple[str, ...]:
    holds = "-" if row.expected is None else ("yes" if row.holds else "NO")
    difference = "-" if row.difference is None else f"{100.0 * row.difference:+.4f} %"
    tolerance = "-" if row.tolerance is None else f"{100.0 * row.tolerance:.3g} %"
    expected, found = value_as_text(row.expected), value_as_text(row.found)
    return row.quantity, row.source, expected, found, difference, tolerance, holds, row.reason


def value_as_text(value: float | bool | None) -> str:
    """Return a value of a table: six digits, yes or no, or a dash."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}"


def worst(ratios: Any) -> float:
    """Return the ratio that deviates most from 1."""
    ratios = np.asarray(ratios)
    return float(ratios[np.argmax(np.abs(ratios - 1.0))])


def never_rises(values: Any, slack: float = 1e-9) -> bool:
    """Return whether a series never increases by more than ``slack`` of its largest value."""
    values = np.asarray(values)
    return bool(np.all(np.diff(values) <= slack * np.max(np.abs(values))))


def never_falls(values: Any, slack: float = 1e-9) -> bool:
    """Return whether a series never decreases by more than ``slack`` of its largest value."""
    return never_rises(-np.asarray(values), slack)


# An indentation run reduced to the data that figures need: the middle row of the fields, and scalars over time.


class Trace(NamedTuple):
    """A contact over time, along the middle row of cells.

    times (nt,) [s]; x (n,) and y [m] of that row; pressure [Pa] and displacement [m] along it, (nt, n); peak
    [Pa] of the whole field, approach [m], load [N], radius [m], strain, status: (nt,).
    """

    times: np.ndarray
    x: np.ndarray
    y: float
    pressure: np.ndarray
    displacement: np.ndarray
    peak: np.ndarray
    approach: np.ndarray
    load: np.ndarray
    radius: np.ndarray
    strain: np.ndarray
    status: np.ndarray

    @property
    def distance(self) -> np.ndarray:
        """The distance r (n,) [m] of the middle row's cells from the axis."""
        return np.hypot(self.x, self.y)

    @property
    def converged(self) -> bool:
        """True if every step converged, within the grid and with enough cells."""
        return bool(np.all(self.status == 0))


def press(body: Any, ball: Any, control: Any, times: Any, grid: jc.Grid) -> Trace:
    """Run ``jc.indent`` and reduce the fields; the film strain is reported in the table instead of a warning."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="film strain")
        history = jc.indent(body, ball, control, times, grid=grid)
    x, y = (np.asarray(axis) for axis in grid.axes())
    middle = len(y) // 2
    return Trace(
        times=np.asarray(history.times),
        x=x,
        y=float(y[middle]),
        pressure=np.asarray(history.pressure[:, :, middle]),
        displacement=np.asarray(history.displacement[:, :, middle]),
        peak=np.asarray(history.pressure.max(axis=(1, 2))),
        approach=np.asarray(history.approach),
        load=np.asarray(history.load),
        radius=np.asarray(history.contact_radius),
        strain=np.asarray(history.film_strain),
        status=np.asarray(history.status),
    )


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
