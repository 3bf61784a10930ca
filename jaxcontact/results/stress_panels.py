"""Pictures of the von Mises stress below the surface, with interfaces and maximum marked."""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes

from jaxcontact._support.prefixes import prefixed
from jaxcontact.results.picture_style import COLOURS, scale_of


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
