"""What ``plot`` of a result shows, and the pictures that a run leaves: one figure for each kind of result."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from jaxcontact.results import plotting
from jaxcontact.results.contact import ContactHistory
from jaxcontact.results.friction import ShearHistory, SteadyRolling
from jaxcontact.results.interior import InteriorFields
from jaxcontact.results.picture_style import styled
from jaxcontact.results.rough_figures import is_round, rough_figure
from jaxcontact.results.sliding import SteadySliding

WIDE, HIGH = 4.4, 3.8  # of a panel [inches]


@styled
def figure_of(result: Any) -> Figure:
    """The one figure of a result."""
    if isinstance(result, ShearHistory):
        return shear_figure(result)
    if isinstance(result, SteadyRolling):
        return rolling_figure(result)
    if isinstance(result, SteadySliding):
        return steady_sliding_figure(result)
    if isinstance(result, InteriorFields):
        return interior_figure(result)
    if result.grid.plane_strain or is_round(result):
        return plotting.overview(result)
    return rough_figure(result)


@styled
def pictures_of(result: Any) -> dict[str, Figure]:
    """The pictures of a run, by file name: its figure, and of a history its course in time."""
    if not isinstance(result, ContactHistory):
        return {"contact.png": figure_of(result)}
    return {"overview.png": figure_of(result), "pressure_map.png": map_figure(result)} | (
        {"history.png": plotting.history_figure(result)} if isinstance(result, ShearHistory) else {}
    )


def map_figure(history: ContactHistory) -> Figure:
    """Pressure of the first and the last time, or of the last alone with ``save="last"``; in plane strain a line."""
    pressure, times = np.asarray(history.pressure), np.asarray(history.times)
    if history.grid.plane_strain:
        lines = pressure.reshape(-1, pressure.shape[-2])
        return plotting.profiles_figure(history.grid.axes()[0], lines, times[-len(lines) :])
    fields = [pressure] if pressure.ndim == 2 else [pressure[0], pressure[-1]]
    titles = [f"t = {time:g} s" for time in (times[0], times[-1])][-len(fields) :]
    return plotting.maps_figure(*history.grid.axes(), fields, titles)


def shear_figure(history: ShearHistory) -> Figure:
    """Stick and slip, tractions along the axis, and the loop of load and displacement."""
    figure = Figure(figsize=(3.0 * WIDE, HIGH), layout="constrained")
    axes = figure.subplots(1, 3)
    plotting.stick_and_slip(axes[0], history)
    plotting.tractions_on_the_axis(axes[1], history)
    plotting.tangential_loop(axes[2], history)
    figure.suptitle(f"stick, slip and tractions at t = {float(history.times[-1]):g} s", fontsize="medium")
    return figure


def rolling_figure(state: SteadyRolling) -> Figure:
    """Stick and slip, and tractions along the axis."""
    figure = Figure(figsize=(2.2 * WIDE, HIGH), layout="constrained")
    axes = figure.subplots(1, 2)
    plotting.stick_and_slip(axes[0], state)
    plotting.tractions_on_the_axis(axes[1], state)
    plotting.way_of(axes[0], state.velocity)
    return figure


def steady_sliding_figure(state: SteadySliding) -> Figure:
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


def interior_figure(inside: InteriorFields) -> Figure:
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
