"""The figure that a result's ``plot`` returns: one sheet of panels for each kind of result.

The attribute ``view`` of a result selects its sheet. Figures read the fields of a result without importing its class,
so that the modules of results may import this one.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from jaxcontact._support.prefixes import prefixed
from jaxcontact.bodies.body import LayeredHalfSpace
from jaxcontact.results import plotting
from jaxcontact.results.plotting import (
    COLOURS,
    CONSTANT,
    against_time,
    pressure_map,
    scale_of,
    styled,
    time_axis,
    time_series,
)
from jaxcontact.results.surface_statistics import contact_clusters, contact_statistics, pressure_histogram

# The picture of a contact with adhesion: load against approach, with its hysteresis and jumps.


SAME = 0.02  # of its range: a difference between the ends of a closed path


def load_against_approach(ax: Axes, history: Any) -> Axes:
    """Plot load [N] against approach [m], with jumps dashed.

    If the path ends where it began, the area that it encloses is the energy lost: it is shaded, and stands in the title with
    the parts that are lost in jumps and in the body.
    """
    approach, load = np.asarray(history.approach), np.asarray(history.load)
    (x_unit, x_name), (y_unit, y_name) = scale_of(approach, "m"), scale_of(load, "N")
    x, y, colour = approach / x_unit, load / y_unit, colormaps[COLOURS](0.3)
    jumped = np.flatnonzero(np.diff(np.asarray(history.jumps)) > 0)
    if _closed(x) and _closed(y):
        ax.fill(x, y, color=colour, alpha=0.15, lw=0.0, label="hysteresis")
        # the energy lost in the cycle, in jumps and, where it is known, in the body
        lost = float(
            np.sum(0.5 * (load[1:] + load[:-1]) * np.diff(approach))
        )  # int P d(approach), the work done on it
        jumps, body = (float(np.asarray(a)[-1]) for a in (history.jump_energy, history.viscous_energy))
        words = f"lost {_short(lost, 'J')}\nin jumps {_short(jumps, 'J')}"
        ax.set_title(
            words if np.isnan(body) else f"{words}, in the body {_short(body, 'J')}", fontsize="medium"
        )
    broken = jumped + 1  # a line that is interrupted at the jumps
    ax.plot(
        np.insert(x, broken, np.nan), np.insert(y, broken, np.nan), marker=".", ms=3, color=colour, lw=1.4
    )
    for i in jumped:
        ax.plot(
            x[i : i + 2],
            y[i : i + 2],
            "--",
            color="#a09000",
            lw=1.4,
            label="jump" if i == jumped[0] else None,
        )
    ax.axhline(0.0, color="0.7", lw=0.8, zorder=0)
    ax.set(xlabel=f"approach [{x_name}]", ylabel=f"load [{y_name}]")
    if ax.get_legend_handles_labels()[1]:
        ax.legend(loc="upper left")
    return ax


def _closed(values: np.ndarray) -> bool:
    """Return whether a path ends where it began."""
    return bool(abs(values[-1] - values[0]) < SAME * np.ptp(values))


# Pictures of the von Mises stress below the surface, with interfaces and maximum marked.


def section_of_stress(ax: Axes, inside: Any) -> Axes:
    """Draw the von Mises stress in the vertical section along x through its maximum, which is marked by a cross."""
    _, place = inside.peak
    j = _cell(inside, place)[1]
    vertical_cut(ax, inside.grid.axes()[0], inside.depths, np.asarray(inside.von_mises)[:, :, j])
    _mark(ax, inside)
    return ax


def stress_over_depth(ax: Axes, inside: Any) -> Axes:
    """Plot the von Mises stress below the point of its maximum against depth."""
    _, place = inside.peak
    i, j = _cell(inside, place)
    over_depth(ax, inside.depths, np.asarray(inside.von_mises)[:, i, j])
    depth_unit, _ = scale_of(inside.depths, "m")
    for depth in _interfaces(inside):
        ax.axhline(depth / depth_unit, color="0.4", lw=1.0, ls="--")
    ax.set_title("below the +")  # which marks the maximum in the section beside it
    return ax


def _cell(inside: Any, place: Any) -> tuple[int, int]:
    """Return the indices of the cell at a place (x, y, z) [m]."""
    x, y = (np.asarray(axis) for axis in inside.grid.axes())
    return int(np.argmin(np.abs(x - float(place[0])))), int(np.argmin(np.abs(y - float(place[1]))))


def _interfaces(inside: Any) -> np.ndarray:
    """Return the depths [m] of the interfaces between the depths that are drawn."""
    depths = np.asarray(inside.depths)
    found = np.asarray(() if inside.interfaces is None else inside.interfaces, dtype=float)
    return found[(found > np.min(depths)) & (found < np.max(depths))]


def _mark(ax: Axes, inside: Any) -> None:
    """Mark the interfaces by dashed lines and the maximum by a cross, with its value in the title."""
    largest, place = inside.peak
    depths = np.asarray(inside.depths)
    if depths.size == 1:
        return
    (x_unit, _), (z_unit, _) = scale_of(inside.grid.axes()[0], "m"), scale_of(depths, "m")
    for depth in _interfaces(inside):
        ax.axhline(depth / z_unit, color="white", lw=1.0, ls="--")
    ax.plot(
        float(place[0]) / x_unit, float(place[2]) / z_unit, "+", color="white", ms=10, mew=1.6, clip_on=False
    )
    lines = ", dashed: interface" if _interfaces(inside).size else ""
    ax.set_title(f"+ {prefixed(float(f'{float(largest):.4g}'), 'Pa')}{lines}")


def vertical_cut(ax: Axes, x: Any, depths: Any, stress: Any) -> Axes:
    """Draw a map of the von Mises stress (nz, nx) [Pa] over x and depth [m], surface at the top; for one depth, a line."""
    (s_unit, s_name), (x_unit, x_name) = scale_of(stress, "Pa"), scale_of(x, "m")
    z_unit, z_name = scale_of(depths, "m")
    x, z, values = np.asarray(x) / x_unit, np.asarray(depths) / z_unit, np.asarray(stress) / s_unit
    ax.set_xlabel(f"x [{x_name}]")
    if z.size == 1:
        ax.plot(x, values[0], color=colormaps[COLOURS](0.3), lw=1.6)
        ax.set(ylabel=f"von Mises stress [{s_name}]", ylim=(0.0, None))
        return ax
    mesh = ax.pcolormesh(x, z, values, cmap=COLOURS, vmin=0.0, shading="gouraud", rasterized=True)
    ax.figure.colorbar(mesh, ax=ax, label=f"von Mises stress [{s_name}]", pad=0.02)
    ax.set(ylabel=f"depth [{z_name}]", ylim=(float(np.max(z)), float(np.min(z))))
    return ax


def over_depth(ax: Axes, depths: Any, stress: Any) -> Axes:
    """Plot the von Mises stress (nz,) [Pa] against depth [m], with the surface at the top."""
    (s_unit, s_name), (z_unit, z_name) = scale_of(stress, "Pa"), scale_of(depths, "m")
    z = np.asarray(depths) / z_unit
    ax.plot(np.asarray(stress) / s_unit, z, marker=".", ms=4, color=colormaps[COLOURS](0.3), lw=1.6)
    ax.set(xlabel=f"von Mises stress [{s_name}]", ylabel=f"depth [{z_name}]", xlim=(0.0, None))
    ax.invert_yaxis()
    return ax


# A drawing of a contact in cross-section, with its dimensions, for the figures of results.


REACH = 2.2  # half-width of the drawing over that of the contact
MOST_LAYERS = 4  # that are drawn one by one
DEPTH = 1.1  # height of the body in the drawing over that of the surfaces
LINE = 0.16  # height of a line of text on the indenter over the span of the drawing
ARROW = {"arrowstyle": "<->", "color": "black", "lw": 1.0, "shrinkA": 0.0, "shrinkB": 0.0}
SMALL: dict[str, Any] = {"fontsize": "small", "color": "black"}
Sizes = tuple[float, float, float, float]  # half-width, lowest and highest point, and their difference [m]
INDENTER, BODY, LAYER = "#b8c2cc", "#d3cbbd", "#ecdcae"  # each with a contrast above 7 to black text


def last_map(field: Any) -> np.ndarray:
    """Return a map (nx, ny) of the last time, from a field (nt, nx, ny) or (nx, ny)."""
    values = np.asarray(field)
    return values[-1] if values.ndim == 3 else values


def contact_section(
    ax: Axes,
    result: Any,
    body: LayeredHalfSpace | None = None,
    indenter: Any = None,
    single: bool = True,
) -> Axes:
    """Draw indenter and deformed surface along x at y = 0 and the last time, with load, approach and width of contact.

    Lengths along x are to scale, heights are enlarged, and layers, named where ``body`` or ``indenter`` is given, are not to
    scale. The displacement of both surfaces is drawn on the body, so that the indenter keeps its shape; a dashed line is the
    dent that would be left without load. The film that is rubbed is drawn as it has grown, in the scale of the heights, on
    the body or on the indenter. single: the contact is one patch around x = 0, whose approach and width are drawn as arrows.
    """
    x, outline, surface = _lines(result)
    low = float(np.min(surface))
    high = max(float(np.max(outline)), -0.4 * low)
    span = max(high - low, np.finfo(float).tiny)
    film, on_indenter = _film(result, body), _on_indenter(result)
    names = _names_of(None if film is not None and on_indenter else indenter)
    bottom, top = (
        low - DEPTH * span,
        high + (0.6 + LINE * len(names)) * span,
    )  # the load is written below the names
    if film is not None and not on_indenter and body is not None:
        body = LayeredHalfSpace([], body.substrate)
    _draw_indenter(ax, x, outline, (top, span), None if film is not None and on_indenter else indenter)
    _draw_body(ax, x, surface, (bottom, low - 0.42 * span), body)
    if film is not None:
        here = np.isin(np.asarray(result.grid.axes()[0]), x)
        edge, side = (outline, film) if on_indenter else (surface, -film)
        ax.fill_between(x, edge, edge + side[here], color=LAYER, lw=0.0)
        ax.plot(x, edge + side[here], color="black", ls="-", lw=0.6)
        thickest = f"film up to {_short(float(film.max()), 'm')}{' on the indenter' if on_indenter else ''}"
        ax.text(0.0, low - 0.32 * span, thickest, ha="center", va="top", **SMALL)
    ax.plot(x, outline, color="black", ls="-", lw=1.0)
    ax.plot(x, surface, color="black", ls="-", lw=1.0)
    ax.plot(x[[0, -1]], [0.0, 0.0], color="black", ls=":", lw=0.8)
    if getattr(result, "dent", None) is not None:
        here = np.isin(np.asarray(result.grid.axes()[0]), x)
        dent = last_map(result.dent)[here, result.grid.shape[1] // 2]
        ax.plot(x, -dent, color="black", ls="--", lw=0.9)
    sizes = (float(x[-1]), low, high, span)
    _draw_load(ax, result, sizes)
    _draw_motion(ax, result, sizes)
    if single:
        _draw_dimensions(ax, result, sizes)
    times = getattr(result, "times", None)
    when = "" if times is None else f" at t = {float(np.asarray(times)[-1]):g} s"
    ax.set(xlim=(x[0], x[-1]), ylim=(bottom, top), title=f"section{when}, heights enlarged")
    ax.set_axis_off()
    return ax


def _on_indenter(result: Any) -> bool:
    """Return whether what is rubbed is on the indenter."""
    return getattr(result, "initial_indenter_film", None) is not None


def _film(result: Any, body: LayeredHalfSpace | None) -> np.ndarray | None:
    """Return the thickness (nx,) of the one layer of a surface that is rubbed, at y = 0 and the last time.

    None elsewhere, and where material is worn off the indenter, whose thickness is negative.
    """
    thickness = getattr(result, "thickness", None)
    if thickness is None or not (_on_indenter(result) or body is None or len(body.sublayers()) == 1):
        return None
    film = last_map(thickness)[:, result.grid.shape[1] // 2]
    return film if np.min(film) >= 0.0 < np.max(film) else None


def _lines(result: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return x, the outline of the indenter and the height of the surface at y = 0 around the contact, in metres."""
    x, middle = np.asarray(result.grid.axes()[0]), result.grid.shape[1] // 2
    row = lambda field: last_map(field)[:, middle]
    moved = getattr(result, "moved_profile", None)
    approach = float(np.asarray(result.approach).ravel()[-1])
    outline = row(result.profile if moved is None else moved) - approach
    surface = -row(result.displacement)
    # a displacement less the growth: what has grown changes the indenter, not the body
    if _on_indenter(result):
        grown = row(result.thickness) - row(result.initial_indenter_film)
        outline, surface = outline - grown, surface - grown
    touched = np.abs(x[row(result.pressure) != 0.0])
    reach = min(REACH * float(np.max(touched, initial=0.0)) or np.inf, float(x[-1]))
    shown = np.abs(x) <= max(reach, 3.0 * float(x[1] - x[0]))
    return x[shown], outline[shown], surface[shown]


def _draw_indenter(
    ax: Axes, x: np.ndarray, outline: np.ndarray, above: tuple[float, float], indenter: Any
) -> None:
    """Fill the indenter above its outline up to a height, and name its layers; above: that height and the span of the
    drawing."""
    top, span = above
    surface = None if indenter is None else indenter.surface()
    lower = outline
    for _ in () if surface is None else surface.sublayers()[:MOST_LAYERS]:
        upper = np.minimum(lower + 0.12 * span, top)
        ax.fill_between(x, lower, upper, color=LAYER, lw=0.0)
        ax.plot(x, upper, color="black", ls="-", lw=0.6)
        lower = upper
    ax.fill_between(x, lower, top, color=INDENTER, lw=0.0)
    ax.text(0.98 * x[-1], top, "\n".join(_names_of(indenter)[::-1]), ha="right", va="top", **SMALL)


def _draw_body(
    ax: Axes,
    x: np.ndarray,
    surface: np.ndarray,
    below: tuple[float, float],
    body: LayeredHalfSpace | None,
) -> None:
    """Fill the body below its surface, and name its layers in the heights ``below`` (bottom, top)."""
    (bottom, top), names = below, _names(body)
    edges = np.linspace(top, bottom, len(names) + 1)
    upper: Any = surface
    for i, name in enumerate(names):
        lower = edges[i + 1]
        substrate = i == len(names) - 1
        ax.fill_between(x, lower, upper, color=BODY if substrate else LAYER, lw=0.0)
        height = 0.5 * (edges[i] + lower)
        ax.text(0.98 * x[0], height, name, va="center", fontsize="small", color="black")
        if not substrate:
            ax.plot(x[[0, -1]], [lower, lower], color="black", ls="-", lw=0.6)
        upper = lower


def _names_of(indenter: Any) -> list[str]:
    """Return a line of text on each layer of an indenter, that at its surface first; none of an unknown one."""
    if indenter is None:
        return []
    surface = indenter.surface()
    if surface is not None:
        return _names(surface)
    return ["rigid" if indenter.material is None else _material(indenter.material)]


def _names(body: LayeredHalfSpace | None) -> list[str]:
    """Return a line of text on each layer of a body, the top one first, and on its substrate."""
    if body is None:
        return [""]
    layers = body.sublayers()
    names = [
        f"{_material(layer.material)}, {_thickness(layer.thickness)}{'' if layer.bonded else ', loose'}"
        for layer in layers
    ]
    if len(names) > MOST_LAYERS:
        total = float(sum(np.max(layer.thickness) for layer in layers))
        names = [f"{len(names)} layers, {prefixed(total, 'm')}"]
    return [*names, "rigid base" if body.substrate is None else _material(body.substrate)]


def _thickness(thickness: Any) -> str:
    values = np.asarray(thickness, dtype=float)
    return f"{'up to ' if values.ndim else ''}{prefixed(float(np.max(values)), 'm')}"


def _material(material: Any) -> str:
    """Return the class of a material and its shear modulus at once, where it has one."""
    compliance = float(material.creep(0.0))
    if not compliance > 0.0:
        return type(material).__name__
    return f"{type(material).__name__}, G = {_short(1.0 / compliance, 'Pa')}"


def _last(result: Any, name: str) -> float:
    return float(np.asarray(getattr(result, name)).ravel()[-1])


def _draw_load(ax: Axes, result: Any, sizes: Sizes) -> None:
    """Draw the load, if there is one, as an arrow, and write its value, the approach and the radius of a ball."""
    half, _, high, span = sizes
    load = _last(result, "load")
    arrow = ARROW | {"arrowstyle": "->" if load >= 0.0 else "<-", "lw": 1.8}
    if load != 0.0:
        ax.annotate("", (0.0, high + 0.05 * span), (0.0, high + 0.55 * span), arrowprops=arrow)
    radius = float(np.asarray(getattr(result.diagnostics, "ball_radius", np.inf)))
    lines = [f"load {_short(load, 'N')}", f"approach {_short(_last(result, 'approach'), 'm')}"]
    x, profile = np.asarray(result.grid.axes()[0]), last_map(result.profile)
    rise = np.ptp(profile[:, profile.shape[1] // 2])
    if 0.0 < radius < np.inf and abs(x[-1] ** 2 / (2.0 * radius) - rise) < 0.1 * rise:  # not of an ellipsoid
        lines.append(f"radius {_short(radius, 'm')}")
    ax.text(0.06 * half, high + 0.56 * span, "\n".join(lines), va="top", **SMALL)


def _draw_dimensions(ax: Axes, result: Any, sizes: Sizes) -> None:
    """Draw the approach and the width of the contact as arrows."""
    half, low, _, span = sizes
    approach, radius = _last(result, "approach"), _last(result, "contact_radius")
    if abs(approach) > 0.1 * span:
        ax.annotate("", (0.0, -approach), (0.0, 0.0), arrowprops=ARROW)
        ax.text(0.03 * half, -0.5 * approach, "\N{GREEK SMALL LETTER DELTA}", va="center", **SMALL)
    if radius > 0.0:
        # the edges of the contact: a circle's from its area, which is finer than cells; elsewhere those of the cells
        x, cell = np.asarray(result.grid.axes()[0]), float(result.grid.spacing[0])
        pressed = x[last_map(result.pressure)[:, result.grid.shape[1] // 2] > 0.0]
        edges, words = (0.0, 0.0), "2a"
        if pressed.size:
            edges = float(pressed[0]) - 0.5 * cell, float(pressed[-1]) + 0.5 * cell
        if abs(edges[0] + edges[1]) > 2.0 * cell:
            words = "contact"
        else:
            edges = (-radius, radius)
        height = low - 0.1 * span
        ax.annotate("", (edges[0], height), (edges[1], height), arrowprops=ARROW)
        ax.text(
            0.5 * (edges[0] + edges[1]), height - 0.05 * span, f"{words} = {_short(edges[1] - edges[0], 'm')}",
            ha="center", va="top", **SMALL,
        )  # fmt: skip


def _short(value: float, unit: str) -> str:
    """Return a value with four digits."""
    return prefixed(float(f"{value:.4g}"), unit)


def _draw_motion(ax: Axes, result: Any, sizes: Sizes) -> None:
    """Draw an arrow for the velocity, or otherwise the tangential load, of the indenter along x."""
    half, _, high, span = sizes
    name, unit = ("velocity", "m/s") if hasattr(result, "velocity") else ("tangential_load", "N")
    along = float(np.reshape(getattr(result, name, (0.0, 0.0)), (-1, 2))[-1, 0])
    if along == 0.0:
        return
    tail, tip = np.array([-0.92, -0.5] if along > 0.0 else [-0.5, -0.92]) * half
    height = high + 0.45 * span
    ax.annotate("", (tip, height), (tail, height), arrowprops=ARROW | {"arrowstyle": "->", "lw": 1.8})
    text = f"{name.replace('_', ' ')}\n{_short(abs(along), unit)}"
    ax.text(-0.92 * half, height - 0.06 * span, text, va="top", **SMALL)


# The figure of a rough contact: maps of pressure, gap and contact, and their statistics.


SLENDER = 4.0  # aspect ratio of the grid above which a map fills its panel
BINS = 40


def is_round(history: Any) -> bool:
    """Return whether the profile increases with the distance from the centre of the grid alone, as for a ball or a punch."""
    x, y = (np.asarray(axis) for axis in history.grid.axes())
    profile = np.asarray(history.profile).ravel()
    outwards = profile[np.argsort(np.hypot(x[:, None], y).ravel())]
    return bool(np.min(np.diff(outwards)) >= -1e-6 * np.max(outwards))


def rough_figure(
    history: Any, body: LayeredHalfSpace | None = None, inside: Any = None, indenter: Any = None
) -> Figure:
    """Maps of pressure, gap and contact at the last time, above area against load, pressure distribution and section.

    body: names the layers in the section; inside: a fourth panel shows the stress in the body.
    """
    figure = Figure(figsize=(13.5, 7.4), layout="constrained")
    # one grid per row: in a single grid with spanning columns matplotlib below 3.11 leaves no room for some maps
    rows = figure.add_gridspec(2, 1, height_ratios=(1.15, 1.0))
    above, below = rows[0].subgridspec(1, 3), rows[1].subgridspec(1, 3 if inside is None else 4)
    maps = [figure.add_subplot(above[i]) for i in range(3)]
    graphs = [figure.add_subplot(below[i]) for i in range(below.ncols)]
    x, y = history.grid.axes()
    time = f"{float(history.times[-1]):g} s"
    pressure_map(maps[0], x, y, last_map(history.pressure), f"pressure at {time}")
    gap = np.maximum(last_map(history.gap), 0.0)
    plotting.quantity_map(maps[1], x, y, gap, "gap", f"gap at {time}")
    contact_map(maps[2], history)
    for ax in maps:
        _fit(ax, history)
    area_against_load(graphs[0], history)
    pressure_distribution(graphs[1], history)
    contact_section(graphs[2], history, body, indenter, single=False)
    if inside is not None:
        section_of_stress(graphs[3], inside)
    return figure


def contact_map(ax: Axes, history: Any) -> Axes:
    """Draw the cells in contact at the last time, with the largest patch highlighted."""
    clusters = contact_clusters(history)
    x, y = (np.asarray(axis) for axis in history.grid.axes())
    unit, name = scale_of(x, "m")
    kind = np.where(clusters.labels == 1, 2, np.minimum(clusters.labels, 1))
    colours = ListedColormap(["0.94", colormaps[COLOURS](0.55), colormaps[COLOURS](0.1)])
    mesh = ax.pcolormesh(x / unit, y / unit, kind.T, cmap=colours, vmin=-0.5, vmax=2.5, shading="nearest")
    mesh.set_rasterized(True)
    bar = ax.figure.colorbar(mesh, ax=ax, ticks=[0, 1, 2], shrink=0.8, pad=0.02)
    bar.ax.set_yticklabels(["open", "touching", "largest\npatch"])
    patches = "1 patch" if clusters.count == 1 else f"{clusters.count} patches"
    share = float(np.mean(clusters.labels > 0))
    ax.set(xlabel=f"x [{name}]", ylabel=f"y [{name}]", title=f"{100.0 * share:.3g} % in contact, {patches}")
    return ax


def _fit(ax: Axes, history: Any) -> None:
    """Set an equal aspect ratio unless the grid is slender."""
    sides = sorted(float(width) for width in history.grid.width)
    ax.set_aspect("equal" if sides[1] < SLENDER * sides[0] else "auto")


def area_against_load(ax: Axes, history: Any) -> Axes:
    """Plot contact area over nominal area against the mean pressure, or against time at constant load.

    The area is that of the cells in contact and, where the fields of all times are kept, that corrected for the cells on
    the contact boundary.
    """
    nominal = float(history.grid.width[0] * history.grid.width[1])
    mean = np.asarray(history.load) / nominal
    constant = np.ptp(mean) <= CONSTANT * np.max(mean)
    unit, name = scale_of(mean, "Pa")
    abscissa = np.asarray(history.times) if constant else mean / unit
    shares = {"cells in contact": np.asarray(history.contact_area) / nominal}
    if np.ndim(history.pressure) == 3:
        shares["corrected at the contact boundary"] = np.asarray(
            contact_statistics(history).corrected_fraction
        )
    for shade, (label, share) in zip((0.75, 0.2), shares.items(), strict=False):
        ax.plot(abscissa, share, marker=".", ms=4, lw=1.4, color=colormaps[COLOURS](shade), label=label)
    ax.set(xlabel=f"mean pressure [{name}]", ylabel="contact area over nominal area")
    if constant:
        time_axis(ax, abscissa)
    ax.set_title(f"mean pressure {mean[0] / unit:.4g} {name}" if constant else "")
    ax.set_ylim(bottom=0.0)
    ax.legend()
    return ax


def pressure_distribution(ax: Axes, history: Any) -> Axes:
    """Plot the pressure distribution over the nominal area at the first time with contact and at the last."""
    histogram = pressure_histogram(history, BINS)
    edges, density = np.asarray(histogram.edges), np.atleast_2d(histogram.density)
    unit, name = scale_of(edges, "Pa")
    touching = np.flatnonzero(np.any(density > 0.0, 1))
    times = np.asarray(history.times)[-len(density) :]
    for shade, i in zip((0.75, 0.2), touching[[0, -1]] if len(touching) > 1 else touching, strict=False):
        colour = colormaps[COLOURS](shade)
        ax.stairs(density[i] * unit, edges / unit, color=colour, lw=1.6, label=f"{times[i]:g} s")
    ax.set(xlabel=f"pressure [{name}]", ylabel=f"area density of pressure [1/{name}]")
    ax.set_ylim(bottom=0.0)
    ax.set_xlim(left=0.0)
    if len(touching):
        ax.legend()
    return ax


PANEL_WIDTH, PANEL_HEIGHT = 4.4, 3.7  # [inches]
MOST_IN_A_ROW = 4

Panel = Callable[[Axes], Any]


@styled
def figure_of(
    result: Any, body: LayeredHalfSpace | None = None, inside: Any = None, indenter: Any = None
) -> Figure:
    """Return the figure of a result; with the names of the layers of body and indenter, and with the stress ``inside`` the
    body."""
    draw = FIGURES[result.view]
    return draw(result) if result.view in ("interior", "deflection") else draw(result, body, inside, indenter)


@styled
def overview_of(history: Any) -> Figure | None:
    """Return the figure of stick and slip zones, of a film that forms, of adhesion or of a rough contact; None if profiles
    and time series show the result.
    """
    if history.view in ("shear", "rubbing", "adhesion"):
        return FIGURES[history.view](history, None, None, None)
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


def _section(result: Any, body: Any, inside: Any, indenter: Any) -> list[Panel]:
    """The panels that every sheet has: the contact in cross-section and, where it is given, the stress below it."""
    stress: list[Panel] = [] if inside is None else [lambda ax: section_of_stress(ax, inside)]
    return [lambda ax: contact_section(ax, result, body, indenter), *stress]


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


def contact_figure(history: Any, body: Any, inside: Any, indenter: Any) -> Figure:
    """Section, pressure profiles and time series; for a contact that is not axisymmetric, maps and statistics."""
    if not _is_line_or_round(history):
        return rough_figure(history, body, inside, indenter)
    below, constant = _over_time(history)
    return _sheet([[*_section(history, body, inside, indenter), _profiles(history)], *below], constant)


def rubbing_figure(history: Any, body: Any, inside: Any, indenter: Any) -> Figure:
    """The film in cross-section over time, its growth, and maps of thickness, pressure and temperature side by side.

    In plane strain, where a map is a line, the maps are left out; where only the last map was kept, so is the growth.
    """
    x, y = history.grid.axes()
    thickness, times = np.asarray(history.thickness), np.asarray(history.times)
    over_time = thickness.ndim == 3
    lines = thickness[..., thickness.shape[-1] // 2].reshape(-1, thickness.shape[-2])
    maps_of = ("thickness", "pressure", "temperature")
    names = [name for name in maps_of if getattr(history, name, None) is not None]
    film: list[Panel] = [lambda ax: plotting.film_section(ax, x, lines, times if over_time else times[-1:])]
    growth: list[Panel] = [lambda ax: plotting.growth_curves(ax, history)] if over_time else []
    last = lambda name: np.asarray(getattr(history, name)).reshape(-1, *history.grid.shape)[-1]
    maps: list[Panel] = [
        lambda ax, name=name: plotting.quantity_map(ax, x, y, last(name), name)  # type: ignore[misc]
        for name in names
    ]
    rows = [[*film, *growth, *_section(history, body, inside, indenter)]]
    return _sheet(rows if history.grid.plane_strain else [*rows, maps], f"film at t = {float(times[-1]):g} s")


@styled
def film_of(x: Any, lines: Mapping[str, Any], times: Any) -> Figure | None:
    """Return the figure of a film in cross-section over time, from the lines of a run; None if none of its film forms."""
    if "thickness_line" not in lines:
        return None
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    plotting.film_section(figure.add_subplot(), x, lines["thickness_line"], times)
    return figure


def adhesive_figure(history: Any, body: Any, inside: Any, indenter: Any) -> Figure:
    """Section, pressure with tension, and load against approach; maps and statistics if it is not axisymmetric."""
    if not _is_line_or_round(history):
        return rough_figure(history, body, inside, indenter)
    below, constant = _over_time(history, ("contact radius", "peak pressure", "approach", "load"))
    path: Panel = lambda ax: load_against_approach(ax, history)
    return _sheet([[*_section(history, body, inside, indenter), _profiles(history), path], *below], constant)


def shear_figure(history: Any, body: Any, inside: Any, indenter: Any) -> Figure:
    """Stick and slip zones, tractions along x and the loop of the tangential load, above section and time series."""
    above: list[Panel] = [
        lambda ax: plotting.stick_and_slip(ax, history),
        lambda ax: plotting.tractions_on_the_axis(ax, history),
        lambda ax: plotting.tangential_loop(ax, history),
    ]
    series, constant = _over_time(history, ("tangential load", "dissipated by friction"))
    below = [*_section(history, body, inside, indenter), *(panel for row in series for panel in row)]
    when = f"t = {float(history.times[-1]):g} s"
    if history.grid.plane_strain:
        above = above[1:]
    return _sheet([above, below], f"stick, slip and tractions at {when}{'; ' * bool(constant)}{constant}")


def rolling_figure(state: Any, body: Any, inside: Any, indenter: Any) -> Figure:
    """Stick and slip zones, tractions along the x axis, and the contact in cross-section."""

    def zones(ax: Axes) -> None:
        plotting.velocity_arrow(plotting.stick_and_slip(ax, state), state.velocity)

    tractions: Panel = lambda ax: plotting.tractions_on_the_axis(ax, state)
    shown: list[Panel] = [zones, tractions]
    if state.grid.plane_strain:
        shown = [tractions]
    elif float(np.asarray(state.spin)) != 0.0:
        shown = [zones, lambda ax: plotting.moment_over_the_radius(ax, state), tractions]
    return _sheet([[*shown, *_section(state, body, inside, indenter)]])


def steady_sliding_figure(state: Any, body: Any, inside: Any, indenter: Any) -> Figure:
    """The pressure map, the pressure along x at y = 0, and the contact in cross-section; no map in plane strain."""
    x, y = state.grid.axes()
    pressure = np.asarray(state.pressure)

    def pressure_map(ax: Axes) -> None:
        plotting.velocity_arrow(plotting.pressure_map(ax, x, y, pressure), state.velocity)

    line: Panel = lambda ax: plotting.pressure_line(ax, x, pressure[:, pressure.shape[1] // 2])
    shown = [line] if state.grid.plane_strain else [pressure_map, line]
    return _sheet([[*shown, *_section(state, body, inside, indenter)]])


def interior_figure(inside: Any) -> Figure:
    """The von Mises stress in the vertical section along x through its maximum, and against depth at the maximum."""
    figure = Figure(figsize=(2.4 * PANEL_WIDTH, PANEL_HEIGHT), layout="constrained")
    axes = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    section_of_stress(axes[0], inside)
    stress_over_depth(axes[1], inside)
    return figure


def deflection_figure(under: Any) -> Figure:
    """The displacement of the surface at the last time, and along x at y = 0 at all times; no map in plane strain."""
    (x, y), displacement = (np.asarray(axis) for axis in under.grid.axes()), np.asarray(under.displacement)
    line = displacement[:, :, displacement.shape[2] // 2]
    (unit, name), (x_unit, x_name) = scale_of(line, "m"), scale_of(x, "m")

    def along_x(ax: Axes) -> None:
        plotting.time_lines(ax, x / x_unit, line / unit, under.times)
        ax.set(xlabel=f"x [{x_name}]", ylabel=f"displacement into the body [{name}]")
        ax.invert_yaxis()

    at_last: Panel = lambda ax: _fit(plotting.quantity_map(ax, x, y, displacement[-1], "displacement"), under)
    return _sheet([[along_x] if under.grid.plane_strain else [at_last, along_x]])


FIGURES: dict[str, Callable[..., Figure]] = {  # by the attribute ``view`` of a result
    "contact": contact_figure,
    "adhesion": adhesive_figure,
    "shear": shear_figure,
    "rubbing": rubbing_figure,
    "rolling": rolling_figure,
    "steady sliding": steady_sliding_figure,
    "interior": interior_figure,
    "deflection": deflection_figure,
}
