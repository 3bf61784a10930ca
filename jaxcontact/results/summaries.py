"""Text summaries of results of about ten lines, with a small picture in notebooks."""

import base64
import dataclasses
import io
from collections import Counter
from collections.abc import Iterable
from typing import Any

import jax
import numpy as np

from jaxcontact._support.fields import shown
from jaxcontact._support.prefixes import prefixed
from jaxcontact._support.pytree import is_concrete
from jaxcontact.results.notes import brief, has_numbers, message_of

NOISE = 1e-9
STATISTICS = {  # units of the fields of contact and surface statistics
    "mean_pressure": "Pa",
    "area_fraction": "",
    "corrected_fraction": "",
    "perimeter": "m",
    "mean_gap": "m",
    "rms_height": "m",
    "rms_slope": "",
    "rms_curvature": "1/m",
    "wavenumber": "rad/m",
    "spectrum": "m^4",
    "edges": "Pa",
    "density": "1/Pa",
    "count": "",
    "areas": "m^2",
    "heights": "m",
}


class InWords:
    """Base class whose ``repr`` lists the fields with the units of ``STATISTICS``."""

    def __repr__(self) -> str:
        names = (field.name for field in dataclasses.fields(self))  # type: ignore[arg-type]
        return words((name.replace("_", " "), getattr(self, name), STATISTICS[name]) for name in names)


def words(rows: Iterable[tuple[str, Any, str]]) -> str:
    """Return lines of name, value and unit: a number with an SI prefix, an array by its shape and range."""
    return "\n".join(f"{name:22s} {_value(value, unit)}".rstrip() for name, value, unit in rows)


def _value(value: Any, unit: str) -> str:
    if not is_concrete(value) or np.asarray(value).dtype.kind not in "biuf":
        return "no numbers"
    simple = unit.isalpha() or not unit  # no prefix on a power of a unit, which would be raised with it
    shown = lambda number: prefixed(float(number), unit) if simple else f"{float(number):.5g} {unit}"
    values = np.asarray(value)
    if values.size <= 1:
        return shown(values.ravel()[0]) if values.size else "none"
    shape = " x ".join(map(str, values.shape))
    return f"{shape} from {shown(values.min())} to {shown(values.max())}"


def is_one_result(result: Any) -> bool:
    """Return whether a result holds the known numbers of one run: it is not traced, batched or without arrays."""
    status = result.status
    whole = is_concrete(result) and hasattr(status, "shape") and hasattr(status, "__array__")
    return whole and np.ndim(status) == np.ndim(getattr(result, "times", 0.0)) < 2


def summary(result: Any) -> str:
    """Return the first, last and largest values of the main quantities, the grid and the convergence status, as text."""
    name = type(result).__name__
    if not is_one_result(result):
        head = f"{name} of status {getattr(result.status, 'shape', result.status)}: no single run"
        return "\n".join([head, *_notes(result)])
    with jax.ensure_compile_time_eval():  # so that a result with numbers is printed inside jit as well
        # what it is of, and over which times
        extent, columns = "", [""]
        if hasattr(result, "times"):
            times, columns = np.asarray(result.times), ["first", "last", "largest"]
            extent = f" of {times.size} times from {times[0]:g} to {times[-1]:g} s"
            extent = f" at {times[0]:g} s" if times.size == 1 else extent
        lines = [f"{name}{extent}{_cells(result.grid)}"]

        # its quantities, and whether they are found
        lines.append(" " * 20 + "".join(f"{column:>14s}" for column in columns))
        for quantity, field in shown().items():
            lines += _row(result, quantity, field.unit)
        counts = Counter(np.atleast_1d(np.asarray(result.status)).tolist())
        iterations = int(np.sum(np.asarray(result.iterations)))
        verdicts = [f"{count} {brief(message_of(code))}" for code, count in sorted(counts.items())]
        lines.append(f"{iterations} iterations; steps: " + "; ".join(verdicts))
        return "\n".join(line.rstrip() for line in [*lines, *_notes(result)] if line.strip())


def _notes(result: Any) -> list[str]:
    """Return the notes on a result, one line each."""
    return [f"note: {note}" for note in (result.notes if has_numbers(result) else ())]


def interior_summary(fields: Any) -> str:
    """Return a summary of fields below the surface: depths, the largest stresses and displacements, and the maximum."""
    name = type(fields).__name__
    if not is_concrete(fields) or np.ndim(fields.stress) != 5:
        return f"{name} of stress {np.shape(fields.stress)}: no single run"
    with jax.ensure_compile_time_eval():  # so that a result with numbers is printed inside jit as well
        depths, stress = np.asarray(fields.depths), np.asarray(fields.stress)
        extent = f"{depths.size} depths from {prefixed(depths.min(), 'm')} to {prefixed(depths.max(), 'm')}"
        peak, place = fields.peak
        where = ", ".join(prefixed(float(value), "m") for value in place)
        rows = [("von Mises stress", fields.von_mises, "Pa")]
        for i in range(3):  # the six independent entries of the symmetric tensor
            rows += [(f"sigma_{'xyz'[i]}{'xyz'[j]}", stress[:, i, j], "Pa") for j in range(i, 3)]
        rows += [(f"u_{axis}", fields.displacement[:, i], "m") for i, axis in enumerate("xyz")]
        lines = [f"{name} at {extent}{_cells(fields.grid)}", words(rows)]
        lines.append(f"peak of von Mises stress {prefixed(float(peak), 'Pa')} at (x, y, z) = ({where})")
        return "\n".join([*lines, *(f"note: {note}" for note in fields.notes)])


def _cells(grid: Any) -> str:
    size, (dx, dy) = grid.shape, map(float, grid.spacing)
    other = f" x {prefixed(dy, 'm')}" if dy != dx else ""
    return f" on {size[0]} x {size[1]} cells of {prefixed(dx, 'm')}{other}"


def _row(result: Any, field: str, unit: str) -> list[str]:
    unit = "" if "/" in unit else unit
    values = _values(result, field)
    if values is None or not_defined(values, field):
        return []
    # steps without a result: one of the quantities that every contact has is nan
    found = [np.asarray(getattr(result, name)) for name in ("approach", "smooth_area", "error")]
    lost = np.any(np.isnan(found), axis=0)
    if values.shape == lost.shape:  # of such a step a given load, say, is known, but it has not been reached
        values = np.where(lost, np.nan, values)
    elif not values.ndim and lost.ndim:  # at the last time only
        values = np.where(lost[-1], np.nan, values)
    picked: dict[str, Any] = {"": values}
    if values.ndim:
        size = np.where(np.isnan(values), -1.0, np.abs(values))
        picked = {"first": values[0], "last": values[-1], "largest": values[np.argmax(size)]}
    if hasattr(result, "times") and not values.ndim:  # at the last time only, with save="last"
        picked = {"first": None, "last": values}
    cells = ("" if value is None else prefixed(float(value), unit) for value in picked.values())
    name = field.replace("_", " ").replace("displacement", "shift")  # to fit the width of the column
    return [f"{name:20s}" + "".join(f" {cell:>13s}" for cell in cells)]


def _values(result: Any, field: str) -> np.ndarray | None:
    if field == "peak_pressure":
        return np.max(np.asarray(result.pressure), axis=(-2, -1))
    vector = field.removesuffix("_x").removesuffix("_y")
    if vector != field:
        return component(getattr(result, vector), field[-1]) if hasattr(result, vector) else None
    values = getattr(result, field, None)
    return None if values is None else np.asarray(values)


def not_defined(values: np.ndarray, field: str) -> bool:
    """Return whether a field has no meaning for a result: the Tabor number of an indenter that is no ball."""
    return field == "tabor_number" and bool(np.all(np.isnan(values)))


def component(vector: Any, axis: str) -> np.ndarray:
    """Return the x or y component of a vector (..., 2), zero where it is round-off relative to the largest entry."""
    values = np.asarray(vector)
    own = values[..., "xy".index(axis)]
    return np.where(np.abs(own) > NOISE * np.max(np.abs(values), initial=0.0), own, 0.0)


def html(result: Any) -> str:
    """Return the summary and, where the result can be plotted, a small picture, as HTML."""
    text = f"<pre>{summary(result)}</pre>"
    if not (is_one_result(result) and hasattr(result, "plot")):
        return text
    picture = io.BytesIO()
    result.plot().savefig(picture, dpi=60, format="png")
    data = base64.b64encode(picture.getvalue()).decode("ascii")
    return (
        f'{text}<img alt="pressure profiles, approach, load and radius" src="data:image/png;base64,{data}">'
    )


# The figures of a run: the scalars in a summary and in a table of cases, with units in their names.


def values_of(result: Any) -> dict[str, np.ndarray]:
    """Return the fields of a result that summaries show, by name; for vectors, by component."""
    values = {"peak_pressure": np.max(np.asarray(result.pressure), axis=(-2, -1))}
    for name in shown():
        vector, _, axis = name.rpartition("_")
        if getattr(result, name, None) is not None:
            values[name] = np.asarray(getattr(result, name))
        elif axis in ("x", "y") and hasattr(result, vector):
            values[name] = component(getattr(result, vector), axis)
    return {name: series for name, series in values.items() if not not_defined(series, name)}


def figures_in(values: dict[str, np.ndarray], over_time: bool) -> dict[str, float]:
    """Return the shown values by name and unit; for time series, the first, last and largest."""
    figures: dict[str, float] = {}
    for name, field in shown().items():
        if name not in values:
            continue
        series, unit = values[name], field.in_key
        if not over_time:
            figures[f"{name}_{unit}"] = float(series)
        elif series.ndim == 0:  # save = "last"
            figures[f"{name}_end_{unit}"] = float(series)
        else:
            picked = {"start": 0, "end": -1, "largest": int(np.argmax(np.abs(series)))}
            figures |= {f"{name}_{when}_{unit}": float(series[i]) for when, i in picked.items()}
    return figures


def lines_of(summary: dict[str, Any]) -> list[str]:
    """Return the figures of a summary as lines of text."""
    lines = []
    for name, field in shown().items():
        unit = field.in_key
        symbol = "" if "/" in field.unit else unit
        values = [summary.get(f"{name}{when}_{unit}") for when in ("_start", "_end", "_largest", "")]
        start, end, largest, steady = ("" if value is None else f"{value:.6g}" for value in values)
        change = f"{start} -> {end} {symbol}".strip() + (
            f", largest {largest} {symbol}".rstrip() if largest else ""
        )
        if end or steady:
            lines.append(f"  {name.replace('_', ' '):25s} {change if end else f'{steady} {symbol}'}".rstrip())
    return lines
