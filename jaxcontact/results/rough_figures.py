"""The figure of a rough contact: maps of pressure, gap and contact, and their statistics."""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.results.contact_section import contact_section
from jaxcontact.results.picture_style import COLOURS, scale_of, time_axis
from jaxcontact.results.plotting import pressure_map
from jaxcontact.results.rough_contact import contact_clusters, contact_statistics, pressure_histogram
from jaxcontact.results.stress_panels import section_of_stress
from jaxcontact.results.time_series import CONSTANT

SLENDER = 4.0  # aspect ratio of the grid above which a map fills its panel
BINS = 40


def is_round(history: Any) -> bool:
    """Return whether the profile increases with the distance from the centre of the grid alone, as for a ball or a punch."""
    x, y = (np.asarray(axis) for axis in history.grid.axes())
    profile = np.asarray(history.profile).ravel()
    outwards = profile[np.argsort(np.hypot(x[:, None], y).ravel())]
    return bool(np.min(np.diff(outwards)) >= -1e-6 * np.max(outwards))


def rough_figure(history: Any, body: LayeredHalfSpace | None = None, inside: Any = None) -> Figure:
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
    last = lambda field: np.asarray(field)[-1] if np.ndim(field) == 3 else np.asarray(field)
    pressure_map(maps[0], x, y, last(history.pressure), f"pressure at {time}")
    gap_map(maps[1], x, y, last(history.gap), f"gap at {time}")
    contact_map(maps[2], history)
    for ax in maps:
        _fit(ax, history)
    area_against_load(graphs[0], history)
    pressure_distribution(graphs[1], history)
    contact_section(graphs[2], history, body, single=False)
    if inside is not None:
        section_of_stress(graphs[3], inside)
    return figure


def gap_map(ax: Axes, x: Any, y: Any, gap: Any, title: str = "") -> Axes:
    """Draw a map of the gap (nx, ny) [m] over x and y [m]; the smallest gap is darkest."""
    (unit, name), (x_unit, x_name) = scale_of(gap, "m"), scale_of(x, "m")
    x, y = np.asarray(x) / x_unit, np.asarray(y) / x_unit
    values = np.maximum(np.asarray(gap).T, 0.0) / unit
    mesh = ax.pcolormesh(x, y, values, cmap=COLOURS, vmin=0.0, shading="nearest", rasterized=True)
    ax.figure.colorbar(mesh, ax=ax, label=f"gap [{name}]", shrink=0.8, pad=0.02)
    ax.set(xlabel=f"x [{x_name}]", ylabel=f"y [{x_name}]", title=title)
    return ax


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
