"""The figure that ``plot`` of a result shows, and the pictures that a run leaves.

A result names its figure by its attribute ``view``; it is read by its fields alone, so that results may import this module.
"""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from jaxcontact.results import plotting
from jaxcontact.results.picture_style import styled
from jaxcontact.results.rough_figures import is_round, rough_figure

WIDE, HIGH = 4.4, 3.8  # of a panel [inches]


@styled
def figure_of(result: Any) -> Figure:
    """Return the one figure of a result."""
    return FIGURES[result.view](result)


@styled
def pictures_of(result: Any) -> dict[str, Figure]:
    """The pictures of a run, by file name: its figure, and of a history its course in time."""
    if not hasattr(result, "times"):
        return {"contact.png": figure_of(result)}
    return {"overview.png": figure_of(result), "pressure_map.png": map_figure(result)} | (
        {"history.png": plotting.history_figure(result)} if result.view == "shear" else {}
    )


def map_figure(history: Any) -> Figure:
    """Pressure of the first and the last time, or of the last alone with ``save="last"``; in plane strain a line."""
    pressure, times = np.asarray(history.pressure), np.asarray(history.times)
    if history.grid.plane_strain:
        lines = pressure.reshape(-1, pressure.shape[-2])
        return plotting.profiles_figure(history.grid.axes()[0], lines, times[-len(lines) :])
    fields = [pressure] if pressure.ndim == 2 else [pressure[0], pressure[-1]]
    titles = [f"t = {time:g} s" for time in (times[0], times[-1])][-len(fields) :]
    x, y = history.grid.axes()
    return plotting.maps_figure(x, y, fields, titles)


def contact_figure(history: Any) -> Figure:
    """Profiles of the pressure over its course in time; of a contact that is not round, maps and statistics."""
    if history.grid.plane_strain or is_round(history):
        return plotting.overview(history)
    return rough_figure(history)


def shear_figure(history: Any) -> Figure:
    """Stick and slip, tractions along the axis, and the loop of load and displacement."""
    figure = Figure(figsize=(3.0 * WIDE, HIGH), layout="constrained")
    axes = figure.subplots(1, 3)
    plotting.stick_and_slip(axes[0], history)
    plotting.tractions_on_the_axis(axes[1], history)
    plotting.tangential_loop(axes[2], history)
    figure.suptitle(f"stick, slip and tractions at t = {float(history.times[-1]):g} s", fontsize="medium")
    return figure


def rolling_figure(state: Any) -> Figure:
    """Stick and slip, and tractions along the axis."""
    figure = Figure(figsize=(2.2 * WIDE, HIGH), layout="constrained")
    axes = figure.subplots(1, 2)
    plotting.stick_and_slip(axes[0], state)
    plotting.tractions_on_the_axis(axes[1], state)
    plotting.way_of(axes[0], state.velocity)
    return figure


def steady_sliding_figure(state: Any) -> Figure:
    """The pressure over the plane, and along x at y = 0; in plane strain along x alone."""
    x, y = state.grid.axes()
    pressure = np.asarray(state.pressure)
    line = pressure[:, pressure.shape[1] // 2]
    if state.grid.plane_strain:
        figure = Figure(figsize=(1.4 * WIDE, HIGH), layout="constrained")
        plotting.pressure_line(figure.add_subplot(), x, line)
        return figure
    figure = Figure(figsize=(2.2 * WIDE, HIGH), layout="constrained")
    axes = figure.subplots(1, 2)
    plotting.pressure_map(axes[0], x, y, pressure)
    plotting.way_of(axes[0], state.velocity)
    plotting.pressure_line(axes[1], x, line)
    return figure


def interior_figure(inside: Any) -> Figure:
    """Von Mises stress in the vertical cut along x through its largest value, and over the depth there."""
    _, place = inside.peak
    x, y = (np.asarray(axis) for axis in inside.grid.axes())
    i, j = int(np.argmin(np.abs(x - float(place[0])))), int(np.argmin(np.abs(y - float(place[1]))))
    stress, depths = np.asarray(inside.von_mises), np.asarray(inside.depths)
    figure = Figure(figsize=(2.4 * WIDE, HIGH), layout="constrained")
    axes = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    plotting.vertical_cut(axes[0], x, depths, stress[:, :, j])
    plotting.over_depth(axes[1], depths, stress[:, i, j])
    return figure


FIGURES = {  # by the attribute ``view`` of a result
    "contact": contact_figure,
    "shear": shear_figure,
    "rolling": rolling_figure,
    "steady sliding": steady_sliding_figure,
    "interior": interior_figure,
}
