"""Pictures of results: functions that draw into given Axes, and functions that return whole figures.

Only the modules of pictures in this folder and those of ``paper`` import matplotlib. Figures are made without
``pyplot``, so there is no global state and no window; a notebook shows a figure that is the last value of a cell.
"""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from jaxcontact.results.picture_style import COLOURS, colours_of_time, scale_of, styled, time_axis
from jaxcontact.results.time_series import along_the_largest

MOST_LINES, MOST_ARROWS = 40, 24
TENSION = 0.02  # of the largest pressure: a tension that is shown


def pick(count: int) -> np.ndarray:
    """Return the indices of at most about ``MOST_LINES`` of ``count`` lines, evenly spaced, including the first and the
    last.

    Uneven spacing would look like an event between two times.
    """
    step = -(-count // MOST_LINES)
    return np.unique(np.append(np.arange(0, count, step), count - 1))


def time_lines(ax: Axes, x: Any, lines: Any, times: Any) -> Axes:
    """Draw lines (nt, nx) over x, coloured by time [s], with a colour bar."""
    times = np.asarray(times, dtype=float)
    colours = colours_of_time(times)
    low, high = colours.norm.vmin, colours.norm.vmax
    for index in pick(len(times)):
        ax.plot(x, lines[index], "-", color=colours.to_rgba(np.clip(times[index], low, high)), lw=1.2)
    figure = ax.figure
    figure.colorbar(colours, ax=ax, label="time [s]", pad=0.02)
    return ax


def pressure_profiles(ax: Axes, x: Any, pressure: Any, times: Any) -> Axes:
    """Draw the pressure [Pa] along x [m] at each of the times [s], as in the paper's Fig. 9; pressure (nt, nx)."""
    (p_unit, p_name), (x_unit, x_name) = scale_of(pressure, "Pa"), scale_of(x, "m")
    time_lines(ax, np.asarray(x) / x_unit, np.asarray(pressure) / p_unit, times)
    ax.set(xlabel=f"x [{x_name}]", ylabel=f"pressure [{p_name}]")
    ax.set_xlim(*_around_contact(np.asarray(x) / x_unit, pressure))
    ax.set_ylim(bottom=None if np.min(pressure) < 0.0 else 0.0)
    return ax


def _around_contact(x: np.ndarray, pressure: Any, margin: float = 1.15) -> tuple[float, float]:
    """Return limits of x, symmetric about zero, that enclose all contact and attraction with a margin."""
    pressure = np.asarray(pressure)
    least = TENSION * np.max(np.abs(pressure)) if np.min(pressure) < 0.0 else 0.0
    touched = np.any(np.abs(pressure) > least, axis=0)
    reach = float(np.max(np.abs(x[touched]))) * margin if np.any(touched) else float(np.max(np.abs(x)))
    reach = max(reach, 2.0 * float(x[1] - x[0]))
    return -reach, reach


def surface_deformation(ax: Axes, x: Any, profile: Any, displacement: Any, approach: Any, times: Any) -> Axes:
    """Draw the surface height -u along x at each of the times [s], with the undeformed indenter dashed, as in the paper's
    Fig. 11.

    x, profile (nx,), displacement u (nt, nx) [m]; approach (nt,) [m]. The displacement is that of both surfaces, so that
    surface and outline coincide in contact.
    """
    (z_unit, z_name), (x_unit, x_name) = scale_of(displacement, "m"), scale_of(x, "m")
    x, surface = np.asarray(x) / x_unit, -np.asarray(displacement) / z_unit
    time_lines(ax, x, surface, times)
    for index, style in ((0, ":"), (-1, "--")):
        outline = (np.asarray(profile) - np.asarray(approach)[index]) / z_unit
        label = f"indenter at {np.asarray(times)[index]:g} s"
        ax.plot(x, outline, color="black", lw=1.0, ls=style, label=label)
    low, high = float(np.min(surface)), float(np.max(surface))
    ax.set_ylim(low - 0.15 * (high - low), high + 0.45 * (high - low) + 1e-9)
    ax.set(xlabel=f"x [{x_name}]", ylabel=f"height of the surface [{z_name}]")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return ax


MAPS = {"thickness": "m", "pressure": "Pa", "temperature": "K"}  # of a film that forms, with units


def pressure_map(ax: Axes, x: Any, y: Any, pressure: Any, title: str = "", highest: Any = None) -> Axes:
    """Draw a map of pressure (nx, ny) [Pa] over x and y [m], with a colour bar up to ``highest`` [Pa]."""
    highest = np.max(pressure) if highest is None else highest
    lowest = min(float(np.min(pressure)), 0.0)
    return _map(ax, x, y, pressure, ("pressure", "Pa"), (lowest, float(highest)), title)


def quantity_map(ax: Axes, x: Any, y: Any, values: Any, name: str) -> Axes:
    """Draw a map (nx, ny) of one of ``MAPS``; the colours of a temperature and of an indenter's wear begin at the least."""
    low, high = float(np.min(values)), float(np.max(values))
    return _map(ax, x, y, values, (name, MAPS[name]), (low if name == "temperature" else min(low, 0.0), high))


def _map(
    ax: Axes,
    x: Any,
    y: Any,
    values: Any,
    quantity: tuple[str, str],
    limits: tuple[float, float],
    title: str = "",
) -> Axes:
    """Draw a map of a quantity (name, unit) over x and y [m], with a colour bar between the limits."""
    (name, own), (low, high) = quantity, limits
    (unit, symbol), (x_unit, x_name) = scale_of((low, high), own), scale_of(x, "m")
    x, y = np.asarray(x) / x_unit, np.asarray(y) / x_unit
    scaled, low, high = np.asarray(values).T / unit, low / unit, high / unit
    mesh = ax.pcolormesh(x, y, scaled, cmap=COLOURS, vmin=low, vmax=high, shading="nearest", rasterized=True)
    ax.figure.colorbar(mesh, ax=ax, label=f"{name} [{symbol}]", shrink=0.8, pad=0.02)
    ax.set(xlabel=f"x [{x_name}]", ylabel=f"y [{x_name}]", title=title, aspect="equal")
    return ax


def film_section(ax: Axes, x: Any, thickness: Any, times: Any) -> Axes:
    """Draw the thickness (nt, nx) [m] of a film along x [m] at each of the times [s]."""
    (h_unit, h_name), (x_unit, x_name) = scale_of(thickness, "m"), scale_of(x, "m")
    if len(times) > 1:
        time_lines(ax, np.asarray(x) / x_unit, np.asarray(thickness) / h_unit, times)
    else:
        ax.plot(np.asarray(x) / x_unit, np.asarray(thickness)[0] / h_unit, color=colormaps[COLOURS](0.3))
    ax.set(xlabel=f"x [{x_name}]", ylabel=f"thickness [{h_name}]")
    return ax


def growth_curves(ax: Axes, history: Any) -> Axes:
    """Plot the largest thickness of a film, that in the middle of the grid, and the mean over the contact, over time."""
    thickness, touching = np.asarray(history.thickness), np.asarray(history.pressure) > 0.0
    middle = tuple(n // 2 for n in history.grid.shape)
    cells = np.maximum(np.sum(touching, (1, 2)), 1)
    curves = {
        "largest": np.max(thickness, (1, 2)),
        "in the middle": thickness[:, middle[0], middle[1]],
        "mean in contact": np.sum(np.where(touching, thickness, 0.0), (1, 2)) / cells,
    }
    unit, name = scale_of(thickness, "m")
    for shade, style, (label, values) in zip((0.2, 0.5, 0.75), ("-", "--", ":"), curves.items(), strict=True):
        ax.plot(history.times, values / unit, style, color=colormaps[COLOURS](shade), lw=1.6, label=label)
    ax.set_ylabel(f"thickness [{name}]")
    time_axis(ax, history.times)
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return ax


@styled
def profiles_figure(x: Any, pressure: Any, times: Any) -> Figure:
    """A figure of pressure profiles over time."""
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    pressure_profiles(figure.add_subplot(), x, pressure, times)
    return figure


@styled
def surface_figure(x: Any, profile: Any, displacement: Any, approach: Any, times: Any) -> Figure:
    """A figure of the surface deformation over time."""
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    surface_deformation(figure.add_subplot(), x, profile, displacement, approach, times)
    return figure


@styled
def maps_figure(x: Any, y: Any, fields: list[Any], titles: list[str]) -> Figure:
    """A figure of pressure maps (nx, ny) [Pa] side by side with a common colour scale."""
    highest = max(float(np.max(field)) for field in fields)
    figure = Figure(figsize=(4.6 * len(fields), 3.9), layout="constrained")
    for ax, field, title in zip(np.atleast_1d(figure.subplots(1, len(fields))), fields, titles, strict=True):
        pressure_map(ax, x, y, field, title, highest)
    return figure


def stick_and_slip(ax: Axes, result: Any) -> Axes:
    """Draw a map of the stick and slip zones (at the last time of a history), with arrows of the slip of the body."""
    x, y = (np.asarray(axis) for axis in result.grid.axes())
    unit, name = scale_of(x, "m")
    last = lambda field, ndim: np.asarray(field)[-1] if np.ndim(field) > ndim else np.asarray(field)
    slipped = result.slip if hasattr(result, "slip") else result.slip_ratio
    touching, stick, slip = last(result.pressure, 2) > 0.0, last(result.stick, 2) > 0.0, last(slipped, 3)
    state = np.where(touching, np.where(stick, 2.0, 1.0), 0.0)
    colours = ListedColormap(["white", colormaps[COLOURS](0.75), colormaps[COLOURS](0.2)])
    mesh = ax.pcolormesh(x / unit, y / unit, state.T, cmap=colours, vmin=-0.5, vmax=2.5, shading="nearest")
    bar = ax.figure.colorbar(mesh, ax=ax, ticks=[0, 1, 2], shrink=0.8, pad=0.02)
    bar.ax.set_yticklabels(["open", "slips", "sticks"])
    some = np.zeros_like(touching)
    some[:: -(-len(x) // MOST_ARROWS), :: -(-len(y) // MOST_ARROWS)] = True
    i, j = np.nonzero(some & touching & ~stick & np.any(slip != 0.0, 0))
    if i.size:
        ax.quiver(x[i] / unit, y[j] / unit, slip[0, i, j], slip[1, i, j], angles="xy", width=4e-3)
        ax.set_title("arrows: slip of the body past the indenter")
    ax.set(xlabel=f"x [{name}]", ylabel=f"y [{name}]", aspect="equal")
    return ax


def tractions_on_the_axis(ax: Axes, result: Any) -> Axes:
    """Draw pressure and tangential tractions (at the last time of a history) along x, on the row of cells nearest to y =
    0, with the cells that stick shaded.
    """
    x, middle = np.asarray(result.grid.axes()[0]), result.grid.shape[1] // 2
    pressure = np.asarray(result.pressure)[..., middle].reshape(-1, x.size)[-1]
    traction = np.asarray(result.traction)[..., middle].reshape(-1, 2, x.size)[-1]
    (p_unit, p_name), (x_unit, x_name) = scale_of(pressure, "Pa"), scale_of(x, "m")
    lines = {"pressure": (pressure, "-"), "traction x": (traction[0], "--"), "traction y": (traction[1], ":")}
    for shade, (label, (line, style)) in zip((0.2, 0.5, 0.75), lines.items(), strict=True):
        ax.plot(x / x_unit, line / p_unit, style, color=colormaps[COLOURS](shade), lw=1.6, label=label)
    stick = np.asarray(result.stick)[..., middle].reshape(-1, x.size)[-1]
    lowest, highest = ax.get_ylim()
    ax.fill_between(
        x / x_unit, lowest, highest, where=(stick > 0.0) & (pressure > 0.0), step="mid", color="0.9", zorder=0
    )
    ax.set(xlabel=f"x [{x_name}]", ylabel=f"pressure, traction [{p_name}]", ylim=(lowest, highest))
    ax.text(0.02, 0.98, "shaded: sticks", transform=ax.transAxes, va="top", fontsize="small")
    ax.set_xlim(*_around_contact(x / x_unit, pressure[None]))
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return ax


def tangential_loop(ax: Axes, history: Any) -> Axes:
    """Plot tangential load against displacement, along the line of the largest tangential load."""
    displacement, load = along_the_largest(history)
    (f_unit, f_name), (x_unit, x_name) = scale_of(load, "N"), scale_of(displacement, "m")
    ax.plot(displacement / x_unit, load / f_unit, marker=".", ms=3, color=colormaps[COLOURS](0.3))
    ax.set(xlabel=f"tangential displacement [{x_name}]", ylabel=f"tangential load [{f_name}]")
    return ax


def velocity_arrow(ax: Axes, velocity: Any) -> Axes:
    """Draw an arrow in the corner of a map along the velocity (2,) of the indenter over the body; none at rest."""
    velocity = np.asarray(velocity, dtype=float)
    if np.any(velocity != 0.0):
        step = 0.07 * velocity / np.sqrt(np.sum(velocity**2))
        tip, tail = (0.1 + step[0], 0.93 + step[1]), (0.1 - step[0], 0.93 - step[1])
        style = {"arrowstyle": "->", "color": "0.5", "lw": 1.6}
        ax.annotate("", tip, tail, xycoords="axes fraction", textcoords="axes fraction", arrowprops=style)
        ax.text(0.2, 0.93, "velocity", transform=ax.transAxes, va="center", color="0.5", fontsize="small")
    return ax


def pressure_line(ax: Axes, x: Any, pressure: Any) -> Axes:
    """Plot the pressure (nx,) [Pa] along x [m]."""
    (p_unit, p_name), (x_unit, x_name) = scale_of(pressure, "Pa"), scale_of(x, "m")
    x = np.asarray(x) / x_unit
    ax.plot(x, np.asarray(pressure) / p_unit, color=colormaps[COLOURS](0.3), lw=1.6)
    ax.set(xlabel=f"x [{x_name}]", ylabel=f"pressure [{p_name}]", xlim=_around_contact(x, [pressure]))
    ax.set_ylim(bottom=0.0)
    return ax


@styled
def sensitivities(times: Any, parameters: tuple[str, ...], tables: dict[str, Any]) -> Figure:
    """A figure of d log(output)/d log(parameter) over time [s], one panel for the table (m, nt) of each output.

    Lines differ in colour and dashes; parameters that never reach 1 % of the largest sensitivity are left out.
    """
    figure = Figure(figsize=(4.6 * len(tables) + 1.8, 3.8), layout="constrained")
    axes = figure.subplots(1, len(tables), squeeze=False)[0]
    largest = [np.max(np.nan_to_num(np.abs([t[i] for t in tables.values()]))) for i in range(len(parameters))]
    shown = [i for i, size in enumerate(largest) if size >= 0.01 * max(largest)]
    colours = colormaps[COLOURS](np.linspace(0.0, 0.92, len(shown)))
    for ax, (name, table) in zip(axes, tables.items(), strict=True):
        for order, (i, colour) in enumerate(zip(shown, colours, strict=True)):
            style = ("-", "--", ":", "-.")[order % 4]
            ax.plot(times, table[i], style, color=colour, lw=1.8, label=parameters[i])
        ax.axhline(0.0, color="0.7", lw=0.8, zorder=0)
        ax.set_title(name)
        time_axis(ax, times)
    axes[0].set_ylabel("d log(output) / d log(parameter)")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right center", fontsize=9)
    return figure
