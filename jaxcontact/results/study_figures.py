"""The figure of a parameter study: one result over the values that its cases vary."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxcontact.results.picture_style import COLOURS, styled

EQUAL = 1e-6  # relative difference between equal steps or ratios


def study_figure(cases: Sequence[Mapping[str, Any]], values: np.ndarray, name: str) -> Figure:
    """Return a figure of values (n,), one of each case, over the one or two numbers that the cases vary."""
    return studies_figure(cases, {name: values})


@styled
def studies_figure(cases: Sequence[Mapping[str, Any]], values: Mapping[str, np.ndarray]) -> Figure:
    """Return a figure with a panel for each name of values (n,)."""
    figure = Figure(figsize=(5.2 * len(values), 3.9), layout="constrained")
    for ax, (name, own) in zip(np.atleast_1d(figure.subplots(1, len(values))), values.items(), strict=True):
        draw_study(ax, cases, own, name)
    return figure


def draw_study(ax: Axes, cases: Sequence[Mapping[str, Any]], values: np.ndarray, name: str) -> None:
    """Draw values (n,) over the varied numbers: a line over one, a map over two."""
    varied = varied_numbers(cases)
    if not 1 <= len(varied) <= 2:
        raise ValueError(f"cases: expected one or two numbers that vary, got {sorted(varied) or 'none'}")
    (x_name, x), *second = varied.items()
    ax.set_xlabel(x_name)
    if second:
        ((y_name, y),) = second
        ax.set(ylabel=y_name, title=name)
        _draw_map(ax, x, y, values)
        return
    order = np.argsort(x)
    ax.plot(x[order], values[order], marker=".", color=colormaps[COLOURS](0.3), ls="-")
    ax.set(ylabel=name, xscale=_scale(np.unique(x)), ylim=(0.0, None) if np.nanmin(values) >= 0.0 else None)


def varied_numbers(cases: Sequence[Mapping[str, Any]]) -> dict[str, np.ndarray]:
    """Return the numbers that differ between cases, (n,) by name; ValueError if something else differs."""
    found = {}
    for name in dict.fromkeys(key for case in cases for key in case):
        values = [case.get(name) for case in cases]
        if all(value == values[0] for value in values):
            continue
        if not all(isinstance(value, int | float) for value in values):
            raise ValueError(
                f"cases: expected numbers that vary, got {name} with values such as {values[0]!r}"
            )
        found[name] = np.array(values, dtype=float)
    return found


def _draw_map(ax: Axes, x: np.ndarray, y: np.ndarray, values: np.ndarray) -> None:
    """Draw a map of values (n,) at the points x, y (n,); cells without a case are empty."""
    (across, i), (along, j) = np.unique(x, return_inverse=True), np.unique(y, return_inverse=True)
    table = np.full((along.size, across.size), np.nan)
    table[j, i] = values
    scales = _scale(across), _scale(along)
    edges = [_edges(axis, scale) for axis, scale in zip((across, along), scales, strict=True)]
    mesh = ax.pcolormesh(*edges, table, cmap=COLOURS, rasterized=True)
    ax.figure.colorbar(mesh, ax=ax, pad=0.02)
    ax.set(xscale=scales[0], yscale=scales[1])


def _scale(values: np.ndarray) -> str:
    """Return "log" where sorted values have equal ratios, otherwise "linear"."""
    if values.size < 3 or values[0] <= 0.0:
        return "linear"
    steps = np.diff(np.log(values))
    return "log" if np.ptp(steps) <= EQUAL * steps[0] else "linear"


def _edges(values: np.ndarray, scale: str) -> np.ndarray:
    """Return the edges of cells around sorted values, half-way between neighbours on the scale of their axis."""
    where = np.log(values) if scale == "log" else values
    if where.size == 1:
        width = abs(where[0]) or 1.0
        edges = where[0] + width * np.array([-0.5, 0.5])
    else:
        middle = 0.5 * (where[1:] + where[:-1])
        edges = np.concatenate(
            [[1.5 * where[0] - 0.5 * where[1]], middle, [1.5 * where[-1] - 0.5 * where[-2]]]
        )
    return np.exp(edges) if scale == "log" else edges
