"""The figures of a run: the scalars that a summary and a table of cases have, each with its unit in its name."""

from typing import Any

import numpy as np

from jaxcontact.results.summaries import component

FIGURES = {  # where a result has them: name, unit
    "approach": "m",
    "load": "N",
    "peak_pressure": "Pa",
    "contact_radius": "m",
    "contact_area": "m2",
    "film_strain": "m_per_m",
    "tangential_force": "N",
    "hysteresis_force": "N",
    "coulomb_force": "N",
    "friction_coefficient": "N_per_N",
    "tangential_load_x": "N",
    "tangential_load_y": "N",
    "tangential_displacement_x": "m",
    "tangential_displacement_y": "m",
    "creepage_x": "m_per_m",
    "creepage_y": "m_per_m",
    "sticking_share": "m2_per_m2",
    "power": "W",
    "hysteresis_power": "W",
    "friction_power": "W",
    "dissipated": "J",
}


def values_of(result: Any) -> dict[str, np.ndarray]:
    """Those of ``FIGURES`` that a result has."""
    values = {"peak_pressure": np.max(np.asarray(result.pressure), axis=(-2, -1))}
    for name in FIGURES:
        vector, _, axis = name.rpartition("_")
        if hasattr(result, name):
            values[name] = np.asarray(getattr(result, name))
        elif axis in ("x", "y") and hasattr(result, vector):
            values[name] = component(getattr(result, vector), axis)
    return values


def figures_in(values: dict[str, np.ndarray], over_time: bool) -> dict[str, float]:
    """Values of ``FIGURES`` by name and unit: over time the first, last and largest."""
    figures: dict[str, float] = {}
    for name, unit in FIGURES.items():
        if name not in values:
            continue
        course = values[name]
        if not over_time:
            figures[f"{name}_{unit}"] = float(course)
        elif course.ndim == 0:  # save = "last"
            figures[f"{name}_end_{unit}"] = float(course)
        else:
            picked = {"start": 0, "end": -1, "largest": int(np.argmax(np.abs(course)))}
            figures |= {f"{name}_{when}_{unit}": float(course[i]) for when, i in picked.items()}
    return figures


def lines_of(summary: dict[str, Any]) -> list[str]:
    """The figures of a summary as lines of text."""
    lines = []
    for name, unit in FIGURES.items():
        shown = "" if "_per_" in unit else unit
        values = [summary.get(f"{name}{when}_{unit}") for when in ("_start", "_end", "_largest", "")]
        start, end, largest, held = ("" if value is None else f"{value:.6g}" for value in values)
        course = f"{start} -> {end} {shown}".strip() + (
            f", largest {largest} {shown}".rstrip() if largest else ""
        )
        if end or held:
            lines.append(f"  {name.replace('_', ' '):25s} {course if end else f'{held} {shown}'}".rstrip())
    return lines
