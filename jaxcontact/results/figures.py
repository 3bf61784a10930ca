"""The figure that a result's ``plot`` returns.

The attribute ``view`` of a result selects its figure. Figures read the fields of a result without importing its class,
so that the modules of results may import this one.
"""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from jaxcontact.results import plotting
from jaxcontact.results.picture_style import styled
from jaxcontact.results.rough_figures import is_round, rough_figure

PANEL_WIDTH, PANEL_HEIGHT = 4.4, 3.8  # [inches]


@styled
def figure_of(result: Any) -> Figure:
    """Return the figure of a result."""
    return FIGURES[result.view](result)


@styled
def overview_of(history: Any) -> Figure | None:
    """Return the figure of stick and slip zones, or of a rough contact; None if profiles and time series show the result."""
    if history.view == "shear":
        return shear_figure(history)
    if history.grid.plane_strain or is_round(history):
        return None
    return rough_figure(history)


def contact_figure(history: Any) -> Figure:
    """Pressure profiles and time series; for a contact that is not axisymmetric, maps and statistics."""
    if history.grid.plane_strain or is_round(history):
        return plotting.overview(history)
    return rough_figure(history)


def shear_figure(history: Any) -> Figure:
    """Stick and slip zones, tractions along the x axis, and the loop of tangential load against displacement."""
    figure = Figure(figsize=(3.0 * PANEL_WIDTH, PANEL_HEIGHT), layout="constrained")
    axes = figure.subplots(1, 3)
    plotting.stick_and_slip(axes[0], history)
    plotting.tractions_on_the_axis(axes[1], history)
    plotting.tangential_loop(axes[2], history)
    figure.suptitle(f"stick, slip and tractions at t = {float(history.times[-1]):g} s", fontsize="medium")
    return figure


def rolling_figure(state: Any) -> Figure:
    """Stick and slip zones, and tractions along the x axis."""
    figure = Figure(figsize=(2.2 * PANEL_WIDTH, PANEL_HEIGHT), layout="constrained")
    axes = figure.subplots(1, 2)
    plotting.stick_and_slip(axes[0], state)
    plotting.tractions_on_the_axis(axes[1], state)
    plotting.velocity_arrow(axes[0], state.velocity)
    return figure


def steady_sliding_figure(state: Any) -> Figure:
    """The pressure map, and the pressure along x at y = 0; in plane strain only the latter."""
    x, y = state.grid.axes()
    pressure = np.asarray(state.pressure)
    line = pressure[:, pressure.shape[1] // 2]
    if state.grid.plane_strain:
        figure = Figure(figsize=(1.4 * PANEL_WIDTH, PANEL_HEIGHT), layout="constrained")
        plotting.pressure_line(figure.add_subplot(), x, line)
        return figure
    figure = Figure(figsize=(2.2 * PANEL_WIDTH, PANEL_HEIGHT), layout="constrained")
    axes = figure.subplots(1, 2)
    plotting.pressure_map(axes[0], x, y, pressure)
    plotting.velocity_arrow(axes[0], state.velocity)
    plotting.pressure_line(axes[1], x, line)
    return figure


def interior_figure(inside: Any) -> Figure:
    """The von Mises stress in the vertical section along x through its maximum, and against depth at the maximum."""
    _, place = inside.peak
    x, y = (np.asarray(axis) for axis in inside.grid.axes())
    i, j = int(np.argmin(np.abs(x - float(place[0])))), int(np.argmin(np.abs(y - float(place[1]))))
    stress, depths = np.asarray(inside.von_mises), np.asarray(inside.depths)
    figure = Figure(figsize=(2.4 * PANEL_WIDTH, PANEL_HEIGHT), layout="constrained")
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
