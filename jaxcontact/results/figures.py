"""The figure that a result's ``plot`` returns.

The attribute ``view`` of a result selects its figure. Figures read the fields of a result without importing its class,
so that the modules of results may import this one.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from jaxcontact.results import plotting
from jaxcontact.results.adhesion_figures import adhesion_figure
from jaxcontact.results.picture_style import styled
from jaxcontact.results.rough_figures import is_round, rough_figure

PANEL_WIDTH, PANEL_HEIGHT = 4.4, 3.8  # [inches]


@styled
def figure_of(result: Any) -> Figure:
    """Return the figure of a result."""
    return FIGURES[result.view](result)


@styled
def overview_of(history: Any) -> Figure | None:
    """Return the figure of stick and slip zones, of a film that forms, of adhesion or of a rough contact; None if profiles
    and time series show the result.
    """
    if history.view in ("shear", "rubbing", "adhesion"):
        return FIGURES[history.view](history)
    if history.grid.plane_strain or is_round(history):
        return None
    return rough_figure(history)


def contact_figure(history: Any) -> Figure:
    """Pressure profiles and time series; for a contact that is not axisymmetric, maps and statistics."""
    if history.grid.plane_strain or is_round(history):
        return plotting.overview(history)
    return rough_figure(history)


def rubbing_figure(history: Any) -> Figure:
    """The film in cross-section over time, its growth, and maps of thickness, pressure and temperature side by side.

    In plane strain, where a map is a line, the maps are left out; where only the last map was kept, so is the growth.
    """
    x, y = history.grid.axes()
    thickness, times = np.asarray(history.thickness), np.asarray(history.times)
    over_time = thickness.ndim == 3
    lines = thickness[..., thickness.shape[-1] // 2].reshape(-1, thickness.shape[-2])
    names = [name for name in plotting.MAPS if getattr(history, name, None) is not None]
    rows = 1 if history.grid.plane_strain else 2
    figure = Figure(figsize=(1.05 * PANEL_WIDTH * len(names), rows * PANEL_HEIGHT), layout="constrained")
    above, *below = figure.subfigures(rows, 1, squeeze=False)[:, 0]
    axes = above.subplots(1, 1 + over_time, squeeze=False)[0]
    plotting.film_section(axes[0], x, lines, times if over_time else times[-1:])
    if over_time:
        plotting.growth_curves(axes[1], history)
    for panels in below:
        for ax, name in zip(panels.subplots(1, len(names)), names, strict=True):
            values = np.asarray(getattr(history, name))
            plotting.quantity_map(ax, x, y, values[-1] if over_time else values, name)
    figure.suptitle(f"film at t = {float(times[-1]):g} s", fontsize="medium")
    return figure


@styled
def film_of(x: Any, lines: Mapping[str, Any], times: Any) -> Figure | None:
    """Return the figure of a film in cross-section over time, from the lines of a run; None if none of its film forms."""
    if "thickness_line" not in lines:
        return None
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    plotting.film_section(figure.add_subplot(), x, lines["thickness_line"], times)
    return figure


def adhesive_figure(history: Any) -> Figure:
    """Pressure with tension, and load against approach; for a contact that is not axisymmetric, maps and statistics."""
    if history.grid.plane_strain or is_round(history):
        return adhesion_figure(history)
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
    "adhesion": adhesive_figure,
    "shear": shear_figure,
    "rubbing": rubbing_figure,
    "rolling": rolling_figure,
    "steady sliding": steady_sliding_figure,
    "interior": interior_figure,
}
