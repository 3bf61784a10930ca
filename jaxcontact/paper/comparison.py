"""What a reproduction consists of: a case, its rows, and how they are printed and written."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

EXACT = "exact solution"
PAPER = "paper"
DESCRIBED = "described in the paper"
BIAS = "the paper's kernel is 0.16 to 0.19 % too stiff for the film"
GRID = "discretisation at N = 256"
CELLS = "the edge is found to a few hundredths of a cell"
COARSE = "a quarter of a cell at 0 s"
OFF_AXIS = "no cell centre on the axis at even N"


@dataclass(frozen=True)
class Row:
    """One comparison. quantity: with its unit in brackets. tolerance: relative; None for yes or no.

    expected None makes it a report: nothing to compare with, it always holds.
    """

    quantity: str
    source: str
    expected: float | bool | None
    found: float | bool
    tolerance: float | None = None
    reason: str = ""

    @property
    def difference(self) -> float | None:
        """found/expected - 1; None where there is nothing to divide."""
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
    """One figure of the paper.

    simulate(n) runs it on n x n cells; compare(simulated, references) gives the rows;
    draw(simulated, directory) draws. The references stand apart, so that a wrong one can be tried.
    """

    name: str
    title: str
    references: Mapping[str, float]
    simulate: Callable[[int], Any]
    compare: Callable[[Any, Mapping[str, float]], list[Row]]
    draw: Callable[[Any, Path], None]
    remarks: tuple[str, ...] = ()


def described(quantity: str, found: Any) -> Row:
    """A shape that the paper describes: it must be so."""
    return Row(quantity, DESCRIBED, True, bool(found), reason="yes or no")


def solved(traces: Any) -> Row:
    """Every step of every trace converged, inside the grid and fine enough."""
    fine = all(trace.fine for trace in traces)
    return Row("every step converged inside the grid", "solver", True, fine, reason="yes or no")


def report(quantity: str, found: Any, reason: str) -> Row:
    """A figure that stands beside the others, without a reference."""
    return Row(quantity, "-", None, float(found), reason=reason)


def as_dict(row: Row) -> dict[str, Any]:
    """A row for summary.json."""
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
    """The rows, aligned."""
    lines = [HEADER, *(_cells(row) for row in rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(HEADER))]
    return "\n".join(
        "  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip() for line in lines
    )


def _cells(row: Row) -> tuple[str, ...]:
    holds = "-" if row.expected is None else ("yes" if row.holds else "NO")
    difference = "-" if row.difference is None else f"{100.0 * row.difference:+.4f} %"
    tolerance = "-" if row.tolerance is None else f"{100.0 * row.tolerance:.3g} %"
    expected, found = _value(row.expected), _value(row.found)
    return row.quantity, row.source, expected, found, difference, tolerance, holds, row.reason


def _value(value: float | bool | None) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}"


def worst(ratios: Any) -> float:
    """The one of many ratios that is furthest from 1."""
    ratios = np.asarray(ratios)
    return float(ratios[np.argmax(np.abs(ratios - 1.0))])


def never_rises(values: Any, slack: float = 1e-9) -> bool:
    """True if a series only falls, up to ``slack`` of its largest value."""
    values = np.asarray(values)
    return bool(np.all(np.diff(values) <= slack * np.max(np.abs(values))))


def never_falls(values: Any, slack: float = 1e-9) -> bool:
    """True if a series only rises, up to ``slack`` of its largest value."""
    return never_rises(-np.asarray(values), slack)
