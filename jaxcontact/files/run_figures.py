"""The figures of a run: the scalars in a summary and in a table of cases, with units in their names."""

from typing import Any

import numpy as np

from jaxcontact._support.fields import shown
from jaxcontact.results.summaries import component


def values_of(result: Any) -> dict[str, np.ndarray]:
    """Return the fields of a result that summaries show, by name; for vectors, by component."""
    values = {"peak_pressure": np.max(np.asarray(result.pressure), axis=(-2, -1))}
    for name in shown():
        vector, _, axis = name.rpartition("_")
        if hasattr(result, name):
            values[name] = np.asarray(getattr(result, name))
        elif axis in ("x", "y") and hasattr(result, vector):
            values[name] = component(getattr(result, vector), axis)
    return values


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
