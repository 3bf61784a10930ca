"""Pictures of results: functions that draw into given Axes, and functions that return whole figures.

Only the modules of pictures in this folder and those of ``paper`` import matplotlib. Figures are made without
``pyplot``, so there is no global state and no window; a notebook shows a figure that is the last value of a cell.
"""

import functools
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, ParamSpec, TypeVar

import numpy as np
from matplotlib import colormaps
from matplotlib import style as matplotlib_style
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import FuncNorm, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from jaxcontact._support.fields import FIELDS
from jaxcontact._support.prefixes import fitting_prefix, prefixed

# The common style of all pictures, and the representation of time.
#
# The file ``style.mplstyle`` defines lines, legends and frames; ``matplotlib.style.use("jaxcontact.style")`` applies
# it to any picture. Colours are those of viridis, which remain distinct for colour-blind readers and ordered in
# greyscale.


COLOURS = "viridis"
STYLE = "jaxcontact.style"
# a part of the duration: where the middle one of the times after zero is earlier, times and their colours are logarithmic;
# of times with equal ratios it is where they span 1.2 decades, of evenly spaced ones it is half
EARLY = 0.25
CROWDED = 0.5  # share of the times in a tenth of the duration above which colours follow their order
P = ParamSpec("P")
R = TypeVar("R")


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function that makes whole figures so that it draws in the common style."""

    @functools.wraps(draw)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> R:
        with matplotlib_style.context(STYLE):
            return draw(*args, **kwargs)

    return wrapper


def scale_of(values: Any, unit: str) -> tuple[float, str]:
    """Return the factor and the symbol of the multiple of an SI unit in which the largest value lies between 1 and 1000."""
    finite = np.abs(np.asarray(values, dtype=float))
    factor, prefix = fitting_prefix(float(np.max(finite)) if finite.size else 0.0)
    return factor, prefix + unit


def shows_decades(times: Any) -> bool:
    """Return whether times [s] span decades: none is negative, and most of them are early."""
    times = np.asarray(times, dtype=float)
    later = times[times > 0.0]
    return bool(times[0] >= 0.0 and times.size > 3 and np.median(later) < EARLY * times[-1])


def first_after_zero(times: Any) -> float:
    """Return the first time [s] above zero, where a logarithmic axis begins."""
    times = np.asarray(times, dtype=float)
    return float(np.min(times[times > 0.0]))


def colours_of_time(times: Any) -> ScalarMappable:
    """Return a sequential colour map of times [s]: logarithmic where they span decades, and in their order where most lie
    in a tenth of the duration.
    """
    times = np.asarray(times, dtype=float)
    low, high = float(times[0]), float(times[-1])
    # times of which most lie in some tenth of the duration would have colours that are alike
    inside = np.searchsorted(times, times + 0.1 * (high - low), side="right") - np.arange(times.size)
    if shows_decades(times):
        norm: Normalize = LogNorm(first_after_zero(times), high)
    elif times.size > 3 and np.max(inside) > CROWDED * times.size:
        different = np.unique(times)
        order = np.linspace(0.0, 1.0, different.size)
        norm = FuncNorm(
            (lambda t: np.interp(t, different, order), lambda c: np.interp(c, order, different)), low, high
        )
    else:
        norm = Normalize(low, high if high > low else low + 1.0)
    return ScalarMappable(norm, colormaps[COLOURS].resampled(256))


def time_axis(ax: Axes, times: Any) -> None:
    """Make the horizontal axis one of time [s], logarithmic (linear below the first time above 0) if times span decades."""
    ax.set_xlabel("time [s]")
    if shows_decades(times):
        ax.set_xscale("symlog", linthresh=first_after_zero(times), linscale=0.5)
        ax.set_xlim(float(np.min(times)), None)


# Pictures of scalar quantities of a history over time.


# relative change below which a quantity counts as constant: the figures of its value are the same
CONSTANT = 1e-4


DRAWN = {  # the fields that figures show over time, and their labels
    "approach": "approach",
    "load": "load",
    "contact_radius": "contact radius",
    "peak_pressure": "peak pressure",
    "tangential_force": "force against the motion",
    "tangential_load": "tangential load",
    "dissipated": "dissipated by friction",
}


class TimeSeries(NamedTuple):
    """A quantity over time with the name and the unit that a figure shows."""

    name: str
    values: Any
    unit: str

    @property
    def varies(self) -> bool:
        return bool(np.ptp(self.values) > CONSTANT * np.max(np.abs(self.values)))

    def __str__(self) -> str:
        """The name and the value of a quantity that is constant."""
        return f"{self.name} {prefixed(float(f'{np.max(self.values):.4g}'), self.unit)}"


def time_series(history: Any) -> tuple[list[TimeSeries], str]:
    """Return the time series to plot, and a line of text on those that are constant.

    The series are approach, load, contact radius and peak pressure, and for sliding and shear the friction quantities. If
    any series varies, only those that vary are returned.
    """
    series = [
        TimeSeries(label, _values(history, name), FIELDS[name].unit)
        for name, label in DRAWN.items()
        if hasattr(history, name)
    ]
    if not any(one.varies for one in series):
        return series, ""
    return [one for one in series if one.varies], ", ".join(str(one) for one in series if not one.varies)


def _values(history: Any, name: str) -> np.ndarray:
    """Return a field over time, (nt,); of a tangential load, its component along its largest value."""
    return along_the_largest(history)[1] if name == "tangential_load" else np.asarray(getattr(history, name))


def along_the_largest(history: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return tangential displacement and load along the line of the largest tangential load, (nt,) each.

    The larger component of the direction is positive, so that a load along x has the sign of its x component.
    """
    load, displacement = np.asarray(history.tangential_load), np.asarray(history.tangential_displacement)
    largest = load[np.argmax(np.sum(load**2, 1))]
    largest = largest * np.sign(largest[np.argmax(np.abs(largest))])
    direction = largest / max(float(np.sqrt(np.sum(largest**2))), np.finfo(float).tiny)
    return displacement @ direction, load @ direction


def against_time(ax: Axes, times: Any, values: Any, name: str, unit: str) -> Axes:
    """Plot a scalar quantity of the history against time [s].

    The axis begins at zero, so that neither rounding nor a small change is enlarged to the whole height.
    """
    values, (factor, symbol) = np.asarray(values), scale_of(values, unit)
    ax.plot(times, values / factor, color=colormaps[COLOURS](0.3), lw=1.6, marker=".", ms=3)
    ax.set_ylabel(f"{name} [{symbol}]")
    time_axis(ax, times)
    ax.ticklabel_format(axis="y", useOffset=False)
    low, high = float(np.min(values)) / factor, float(np.max(values)) / factor
    if low == high == 0.0:
        ax.set_ylim(-1.0, 1.0)
    elif low >= 0.0:
        ax.set_ylim(0.0, 1.08 * high)
    elif high <= 0.0:
        ax.set_ylim(1.08 * low, 0.0)
    else:
        ax.axhline(0.0, color="0.7", lw=0.8, ls="-", zorder=0)
    return ax


@styled
def history_figure(history: Any) -> Figure:
    """Time series of the main quantities: one panel for each that varies, the constant ones in the title."""
    series, constant = time_series(history)
    figure = Figure(figsize=(3.6 * len(series), 3.4), layout="constrained")
    for ax, one in zip(np.atleast_1d(figure.subplots(1, len(series))), series, strict=True):
        against_time(ax, history.times, one.values, one.name, one.unit)
    figure.suptitle(constant, fontsize="medium")
    return figure


MOST_LINES, MOST_ARROWS = 40, 24
ABSENT = 1e-6  # of the largest pressure: a traction that is not drawn
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
    bar = ax.figure.colorbar(colours, ax=ax, label="time [s]", pad=0.02)
    if isinstance(colours.norm, FuncNorm):
        bar.set_ticks(np.asarray(colours.norm.inverse(np.linspace(0.0, 1.0, 6))))
        bar.ax.yaxis.set_major_formatter(lambda value, _: f"{value:.4g}")
    return ax


def pressure_profiles(ax: Axes, x: Any, pressure: Any, times: Any) -> Axes:
    """Draw the pressure [Pa] along x [m] at each of the times [s], as in the paper's Fig. 9; pressure (nt, nx)."""
    (p_unit, p_name), (x_unit, x_name) = scale_of(pressure, "Pa"), scale_of(x, "m")
    time_lines(ax, np.asarray(x) / x_unit, np.asarray(pressure) / p_unit, times)
    ax.set(xlabel=f"x [{x_name}]", ylabel=f"pressure [{p_name}]")
    ax.set_xlim(*_around_contact(np.asarray(x) / x_unit, pressure))
    ax.set_ylim(bottom=None if np.min(pressure) < 0.0 else 0.0)
    return ax


def _around_contact(x: np.ndarray, pressure: Any) -> tuple[float, float]:
    """Return limits of x, symmetric about zero, that enclose all contact and attraction with a margin."""
    pressure = np.asarray(pressure)
    least = TENSION * np.max(np.abs(pressure)) if np.min(pressure) < 0.0 else 0.0
    touched = np.any(np.abs(pressure) > least, axis=0)
    reach = 1.15 * float(np.max(np.abs(x[touched]))) if np.any(touched) else float(np.max(np.abs(x)))
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


MAPS = {"thickness": "m", "pressure": "Pa", "temperature": "K", "displacement": "m", "gap": "m"}  # with units


def pressure_map(ax: Axes, x: Any, y: Any, pressure: Any, title: str = "", highest: Any = None) -> Axes:
    """Draw a map of pressure (nx, ny) [Pa] over x and y [m], with a colour bar up to ``highest`` [Pa]."""
    highest = np.max(pressure) if highest is None else highest
    lowest = min(float(np.min(pressure)), 0.0)
    return _map(ax, x, y, pressure, ("pressure", "Pa"), (lowest, float(highest)), title)


def quantity_map(ax: Axes, x: Any, y: Any, values: Any, name: str, title: str = "") -> Axes:
    """Draw a map (nx, ny) of one of ``MAPS``; the colours of a temperature and of an indenter's wear begin at the least."""
    low, high = float(np.min(values)), float(np.max(values))
    low = low if name == "temperature" else min(low, 0.0)
    return _map(ax, x, y, values, (name, MAPS[name]), (low, high), title)


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
    touching, stick, slip = last(result.in_contact, 2), last(result.stick, 2) > 0.0, last(slipped, 3)
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
        if np.any(np.abs(line) > ABSENT * np.max(np.abs(pressure))):
            ax.plot(x / x_unit, line / p_unit, style, color=colormaps[COLOURS](shade), lw=1.6, label=label)
    stick = np.asarray(result.stick)[..., middle].reshape(-1, x.size)[-1]
    lowest, highest = ax.get_ylim()
    ax.fill_between(x / x_unit, lowest, highest, where=stick > 0.0, step="mid", color="0.9", zorder=0)
    ax.set(xlabel=f"x [{x_name}]", ylabel=f"pressure, traction [{p_name}]", ylim=(lowest, highest))
    ax.text(0.02, 0.98, "shaded: sticks", transform=ax.transAxes, va="top", fontsize="small")
    ax.set_xlim(*_around_contact(x / x_unit, pressure[None]))
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return ax


def moment_over_the_radius(ax: Axes, state: Any) -> Axes:
    """Plot the moment of the traction about the normal within a distance of the indenter's axis, up to that of all of it."""
    x, y = (np.asarray(axis) for axis in state.grid.axes())
    traction, cell = np.asarray(state.traction), float(state.grid.cell_area)
    turning = (x[:, None] * traction[1] - y * traction[0]).ravel() * cell
    radius = np.hypot(x[:, None], y).ravel()
    order = np.argsort(radius, kind="stable")
    within, r = np.cumsum(turning[order]), radius[order]
    (m_unit, m_name), (r_unit, r_name) = scale_of(within, "N m"), scale_of(x, "m")
    ax.plot(r / r_unit, within / m_unit, color=colormaps[COLOURS](0.3), lw=1.6)
    touching = radius[np.asarray(state.pressure).ravel() > 0.0]
    ax.set(
        xlabel=f"distance from the axis [{r_name}]",
        ylabel=f"moment within it [{m_name}]",
        xlim=(0.0, 1.15 * float(np.max(touching, initial=float(r[1]))) / r_unit),
        title=f"moment about the normal {float(np.asarray(state.moment)) / m_unit:.4g} {m_name}",
    )
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

    Lines differ in colour and dashes, and begin with different parts of their dashes, so that of two that coincide both are
    seen; parameters that never reach 1 % of the largest sensitivity are left out.
    """
    figure = Figure(figsize=(4.6 * len(tables) + 1.8, 3.8), layout="constrained")
    axes = figure.subplots(1, len(tables), squeeze=False)[0]
    largest = [np.max(np.nan_to_num(np.abs([t[i] for t in tables.values()]))) for i in range(len(parameters))]
    shown = [i for i, size in enumerate(largest) if size >= 0.01 * max(largest)]
    colours = colormaps[COLOURS](np.linspace(0.0, 0.92, len(shown)))
    for ax, (name, table) in zip(axes, tables.items(), strict=True):
        for order, (i, colour) in enumerate(zip(shown, colours, strict=True)):
            gaps = ((), (3.7, 1.6), (1.0, 1.65), (6.4, 1.6, 1.0, 1.6))[order % 4]
            dashes: Any = (2.65 * (order // 4), gaps) if gaps else "-"
            ax.plot(times, table[i], linestyle=dashes, color=colour, lw=1.8, label=parameters[i])
        ax.axhline(0.0, color="0.7", lw=0.8, zorder=0)
        ax.set_title(name)
        time_axis(ax, times)
    axes[0].set_ylabel("d log(output) / d log(parameter)")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right center", fontsize=9)
    return figure


# The figure of a parameter study: one result over the values that its cases vary.


MOST_TICKS = 8  # values of an axis that have a tick each
EQUAL = 1e-6  # relative difference between equal steps or ratios


@styled
def studies_figure(cases: Sequence[Mapping[str, Any]], values: Mapping[str, np.ndarray]) -> Figure:
    """Return a figure of values (n,), one of each case, over the one or two numbers that the cases vary: a panel a name."""
    figure = Figure(figsize=(5.2 * len(values), 3.9), layout="constrained")
    for ax, (name, own) in zip(np.atleast_1d(figure.subplots(1, len(values))), values.items(), strict=True):
        draw_study(ax, cases, own, name)
    return figure


def draw_study(ax: Axes, cases: Sequence[Mapping[str, Any]], values: np.ndarray, name: str) -> None:
    """Draw values (n,) over the varied numbers: a line over one, a map over two.

    A name that ends with a unit in brackets is that of an axis in a multiple of the unit; the name of a field of a result
    has its unit. Axes of few values have their ticks at these.
    """
    varied = varied_numbers(cases)
    if not 1 <= len(varied) <= 2:
        raise ValueError(f"cases: expected one or two numbers that vary, got {sorted(varied) or 'none'}")
    if name in FIELDS:
        name = f"{name.replace('_', ' ')} [{FIELDS[name].symbol}]"
    (x_name, x), *second = (_in_multiples(*one) for one in varied.items())
    name, values = _in_multiples(name, values)
    ax.set_xlabel(x_name)
    if second:
        ((y_name, y),) = second
        ax.set(ylabel=y_name, title=name)
        _draw_map(ax, x, y, values)
        _ticks_at(ax.yaxis, y)
    else:
        order = np.argsort(x)
        ax.plot(x[order], values[order], marker=".", color=colormaps[COLOURS](0.3), ls="-")
        low = 0.0 if np.nanmin(values) >= 0.0 else None
        ax.set(ylabel=name, xscale=_scale(np.unique(x)), ylim=(low, None))
    _ticks_at(ax.xaxis, x)


def _in_multiples(name: str, values: np.ndarray) -> tuple[str, np.ndarray]:
    """Return the name and values of an axis with an SI prefix, for a name such as "layer.thickness [m]"."""
    found = re.fullmatch(r"(.*) \[([A-Za-z]+)\]", name)
    if found is None or found[2] in ("rad", "m2", "m3"):
        return name, values
    factor, symbol = scale_of(values[np.isfinite(values)], found[2])
    return f"{found[1]} [{symbol}]", values / factor


def _ticks_at(axis: Any, values: np.ndarray) -> None:
    """Put the ticks of an axis at its values, where these are few."""
    few = np.unique(values)
    if few.size <= MOST_TICKS:
        axis.set_major_locator(FixedLocator(few))
        axis.set_major_formatter(lambda value, _: f"{value:.4g}")
        axis.set_minor_locator(NullLocator())


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
