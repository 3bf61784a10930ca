"""The figure that a result's ``plot`` returns: one sheet of panels for each kind of result.

The attribute ``view`` of a result selects its sheet. Figures read the fields of a result without importing its class,
so that the modules of results may import this one.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.results import plotting, stress_panels
from jaxcontact.results.adhesion_figures import load_against_approach
from jaxcontact.results.contact_section import contact_section
from jaxcontact.results.picture_style import styled
from jaxcontact.results.rough_figures import is_round, rough_figure
from jaxcontact.results.time_series import against_time, time_series

PANEL_WIDTH, PANEL_HEIGHT = 4.4, 3.7  # [inches]
MOST_IN_A_ROW = 4

Panel = Callable[[Axes], Any]


@styled
def figure_of(result: Any, body: LayeredHalfSpace | None = None, inside: Any = None) -> Figure:
    """Return the figure of a result; with the names of the body's layers, and with the stress ``inside`` the body."""
    draw = FIGURES[result.view]
    return draw(result) if result.view == "interior" else draw(result, body, inside)


@styled
def overview_of(history: Any) -> Figure | None:
    """Return the figure of stick and slip zones, of a film that forms, of adhesion or of a rough contact; None if profiles
    and time series show the result.
    """
    if history.view in ("shear", "rubbing", "adhesion"):
        return FIGURES[history.view](history, None, None)
    return None if _is_line_or_round(history) else rough_figure(history)


def _is_line_or_round(history: Any) -> bool:
    return history.grid.plane_strain or is_round(history)


def _sheet(rows: list[list[Panel]], title: str = "") -> Figure:
    """Return a figure with rows of panels; the panels of a row have equal widths."""
    width = PANEL_WIDTH * max(2, *(min(len(row), 3) for row in rows))
    figure = Figure(figsize=(width, PANEL_HEIGHT * len(rows)), layout="constrained")
    parts = figure.subfigures(len(rows), 1, squeeze=False)[:, 0]
    for part, row in zip(parts, rows, strict=True):
        for ax, draw in zip(part.subplots(1, len(row), squeeze=False)[0], row, strict=True):
            draw(ax)
    figure.suptitle(title, fontsize="medium")
    return figure


def _section(result: Any, body: Any, inside: Any) -> list[Panel]:
    """The panels that every sheet has: the contact in cross-section and, where it is given, the stress below it."""
    stress: list[Panel] = [] if inside is None else [lambda ax: stress_panels.section_of_stress(ax, inside)]
    return [lambda ax: contact_section(ax, result, body), *stress]


def _profiles(history: Any) -> Panel:
    """Pressure along x over time; with ``save="last"`` only that of the last time."""
    pressure, times = np.asarray(history.pressure), np.asarray(history.times)
    if pressure.ndim == 2:
        pressure, times = pressure[None], times[-1:]
    line = pressure[:, :, pressure.shape[2] // 2]
    return lambda ax: plotting.pressure_profiles(ax, history.grid.axes()[0], line, times)


def _over_time(history: Any, only: tuple[str, ...] = ()) -> tuple[list[list[Panel]], str]:
    """Rows of time series, and a line of text on those that are constant; only: names of series, all if there are none."""
    series, constant = time_series(history)
    shown = [one for one in series if not only or one.name in only]
    panels: list[Panel] = [
        lambda ax, one=one: against_time(ax, history.times, one.values, one.name, one.unit)  # type: ignore[misc]
        for one in shown
    ]
    rows = -(-len(panels) // MOST_IN_A_ROW)
    size = -(-len(panels) // max(rows, 1))
    return [panels[i : i + size] for i in range(0, len(panels), max(size, 1))], constant


def contact_figure(history: Any, body: Any, inside: Any) -> Figure:
    """Section, pressure profiles and time series; for a contact that is not axisymmetric, maps and statistics."""
    if not _is_line_or_round(history):
        return rough_figure(history, body, inside)
    below, constant = _over_time(history)
    return _sheet([[*_section(history, body, inside), _profiles(history)], *below], constant)


def rubbing_figure(history: Any, body: Any, inside: Any) -> Figure:
    """The film in cross-section over time, its growth, and maps of thickness, pressure and temperature side by side.

    In plane strain, where a map is a line, the maps are left out; where only the last map was kept, so is the growth.
    """
    x, y = history.grid.axes()
    thickness, times = np.asarray(history.thickness), np.asarray(history.times)
    over_time = thickness.ndim == 3
    lines = thickness[..., thickness.shape[-1] // 2].reshape(-1, thickness.shape[-2])
    names = [name for name in plotting.MAPS if getattr(history, name, None) is not None]
    film: list[Panel] = [lambda ax: plotting.film_section(ax, x, lines, times if over_time else times[-1:])]
    growth: list[Panel] = [lambda ax: plotting.growth_curves(ax, history)] if over_time else []
    last = lambda name: np.asarray(getattr(history, name)).reshape(-1, *history.grid.shape)[-1]
    maps: list[Panel] = [
        lambda ax, name=name: plotting.quantity_map(ax, x, y, last(name), name)  # type: ignore[misc]
        for name in names
    ]
    rows = [[*film, *growth, *_section(history, body, inside)]]
    return _sheet(rows if history.grid.plane_strain else [*rows, maps], f"film at t = {float(times[-1]):g} s")


@styled
def film_of(x: Any, lines: Mapping[str, Any], times: Any) -> Figure | None:
    """Return the figure of a film in cross-section over time, from the lines of a run; None if none of its film forms."""
    if "thickness_line" not in lines:
        return None
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    plotting.film_section(figure.add_subplot(), x, lines["thickness_line"], times)
    return figure


def adhesive_figure(history: Any, body: Any, inside: Any) -> Figure:
    """Section, pressure with tension, and load against approach; maps and statistics if it is not axisymmetric."""
    if not _is_line_or_round(history):
        return rough_figure(history, body, inside)
    below, constant = _over_time(history, ("contact radius", "peak pressure", "approach", "load"))
    path: Panel = lambda ax: load_against_approach(ax, history)
    return _sheet([[*_section(history, body, inside), _profiles(history), path], *below], constant)


def shear_figure(history: Any, body: Any, inside: Any) -> Figure:
    """Stick and slip zones, tractions along x and the loop of the tangential load, above section and time series."""
    above: list[Panel] = [
        lambda ax: plotting.stick_and_slip(ax, history),
        lambda ax: plotting.tractions_on_the_axis(ax, history),
        lambda ax: plotting.tangential_loop(ax, history),
    ]
    series, constant = _over_time(history, ("tangential load", "dissipated by friction"))
    below = [*_section(history, body, inside), *(panel for row in series for panel in row)]
    when = f"t = {float(history.times[-1]):g} s"
    if history.grid.plane_strain:
        above = above[1:]
    return _sheet([above, below], f"stick, slip and tractions at {when}{'; ' * bool(constant)}{constant}")


def rolling_figure(state: Any, body: Any, inside: Any) -> Figure:
    """Stick and slip zones, tractions along the x axis, and the contact in cross-section."""

    def zones(ax: Axes) -> None:
        plotting.velocity_arrow(plotting.stick_and_slip(ax, state), state.velocity)

    tractions: Panel = lambda ax: plotting.tractions_on_the_axis(ax, state)
    shown = [tractions] if state.grid.plane_strain else [zones, tractions]
    return _sheet([[*shown, *_section(state, body, inside)]])


def steady_sliding_figure(state: Any, body: Any, inside: Any) -> Figure:
    """The pressure map, the pressure along x at y = 0, and the contact in cross-section; no map in plane strain."""
    x, y = state.grid.axes()
    pressure = np.asarray(state.pressure)

    def pressure_map(ax: Axes) -> None:
        plotting.velocity_arrow(plotting.pressure_map(ax, x, y, pressure), state.velocity)

    line: Panel = lambda ax: plotting.pressure_line(ax, x, pressure[:, pressure.shape[1] // 2])
    shown = [line] if state.grid.plane_strain else [pressure_map, line]
    return _sheet([[*shown, *_section(state, body, inside)]])


def interior_figure(inside: Any) -> Figure:
    """The von Mises stress in the vertical section along x through its maximum, and against depth at the maximum."""
    figure = Figure(figsize=(2.4 * PANEL_WIDTH, PANEL_HEIGHT), layout="constrained")
    axes = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    stress_panels.section_of_stress(axes[0], inside)
    stress_panels.stress_over_depth(axes[1], inside)
    return figure


FIGURES: dict[str, Callable[..., Figure]] = {  # by the attribute ``view`` of a result
    "contact": contact_figure,
    "adhesion": adhesive_figure,
    "shear": shear_figure,
    "rubbing": rubbing_figure,
    "rolling": rolling_figure,
    "steady sliding": steady_sliding_figure,
    "interior": interior_figure,
}
