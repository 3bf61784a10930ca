"""The figure that ``plot`` of a result shows.

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
def overview_of(history: Any) -> Figure | None:
    """Return the figure of stick and slip, or of a rough contact; None for what profiles and course in time show."""
    if history.view == "shear":
        return shear_figure(history)
    if history.grid.plane_strain or is_round(history):
        return None
    return rough_figure(history)


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
