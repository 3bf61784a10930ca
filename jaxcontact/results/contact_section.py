"""A drawing of a contact in cross-section, with its dimensions, for the figures of results."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from jaxcontact._support.prefixes import prefixed
from jaxcontact.inputs.layers import LayeredHalfSpace

REACH = 2.2  # half-width of the drawing over that of the contact
MOST_LAYERS = 4  # that are drawn one by one
DEPTH = 1.1  # height of the body in the drawing over that of the surfaces
ARROW = {"arrowstyle": "<->", "color": "black", "lw": 1.0, "shrinkA": 0.0, "shrinkB": 0.0}
SMALL: dict[str, Any] = {"fontsize": "small", "color": "black"}
Sizes = tuple[float, float, float, float]  # half-width, lowest and highest point, and their difference [m]
INDENTER, BODY, LAYER = "#b8c2cc", "#d3cbbd", "#ecdcae"  # each with a contrast above 7 to black text


def last_map(field: Any) -> np.ndarray:
    """Return a map (nx, ny) of the last time, from a field (nt, nx, ny) or (nx, ny)."""
    values = np.asarray(field)
    return values[-1] if values.ndim == 3 else values


def contact_section(ax: Axes, result: Any, body: LayeredHalfSpace | None = None, single: bool = True) -> Axes:
    """Draw indenter and deformed surface along x at y = 0 and the last time, with load, approach and width of contact.

    Lengths along x are to scale, heights are enlarged, and layers, named where ``body`` is given, are not to scale. The
    displacement of both surfaces is drawn on the body, so that the indenter keeps its shape. single: the contact is one
    patch around x = 0, whose approach and width are drawn as arrows.
    """
    x, outline, surface = _lines(result)
    low = float(np.min(surface))
    high = max(float(np.max(outline)), -0.4 * low)
    span = max(high - low, np.finfo(float).tiny)
    bottom, top = low - DEPTH * span, high + 0.6 * span
    ax.fill_between(x, outline, top, color=INDENTER, lw=0.0)
    _draw_body(ax, x, surface, (bottom, low - 0.42 * span), body)
    ax.plot(x, outline, color="black", ls="-", lw=1.0)
    ax.plot(x, surface, color="black", ls="-", lw=1.0)
    ax.plot(x[[0, -1]], [0.0, 0.0], color="black", ls=":", lw=0.8)
    sizes = (float(x[-1]), low, high, span)
    _draw_load(ax, result, sizes)
    _draw_motion(ax, result, sizes)
    if single:
        _draw_dimensions(ax, result, sizes)
    ax.set(xlim=(x[0], x[-1]), ylim=(bottom, top), title=_title(result))
    ax.set_axis_off()
    return ax


def _lines(result: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return x, the outline of the indenter and the height of the surface at y = 0 around the contact, in metres."""
    x, middle = np.asarray(result.grid.axes()[0]), result.grid.shape[1] // 2
    row = lambda field: last_map(field)[:, middle]
    moved = getattr(result, "moved_profile", None)
    approach = float(np.asarray(result.approach).ravel()[-1])
    outline = row(result.profile if moved is None else moved) - approach
    touched = np.abs(x[row(result.pressure) != 0.0])
    reach = min(REACH * float(np.max(touched, initial=0.0)) or np.inf, float(x[-1]))
    shown = np.abs(x) <= max(reach, 3.0 * float(x[1] - x[0]))
    return x[shown], outline[shown], -row(result.displacement)[shown]


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


def _names(body: LayeredHalfSpace | None) -> list[str]:
    """Return a line of text on each layer of a body, the top one first, and on its substrate."""
    if body is None:
        return [""]
    layers = body.sublayers()
    names = [f"{_material(layer.material)}, {_thickness(layer.thickness)}" for layer in layers]
    if len(names) > MOST_LAYERS:
        total = float(sum(np.max(layer.thickness) for layer in layers))
        names = [f"{len(names)} layers, {prefixed(total, 'm')}"]
    return [*names, _material(body.substrate)]


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
    """Draw the load as an arrow, with its value, the radius of a ball and the approach."""
    half, _, high, span = sizes
    load = _last(result, "load")
    arrow = ARROW | {"arrowstyle": "->" if load >= 0.0 else "<-", "lw": 1.8}
    ax.annotate("", (0.0, high + 0.05 * span), (0.0, high + 0.55 * span), arrowprops=arrow)
    radius = float(np.asarray(getattr(result.diagnostics, "ball_radius", np.inf)))
    lines = [f"load {_short(load, 'N')}", f"approach {_short(_last(result, 'approach'), 'm')}"]
    if np.isfinite(radius) and radius > 0.0:
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
        height = low - 0.1 * span
        ax.annotate("", (-radius, height), (radius, height), arrowprops=ARROW)
        ax.text(
            0.0, height - 0.05 * span, f"2a = {_short(2.0 * radius, 'm')}", ha="center", va="top", **SMALL
        )


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


def _title(result: Any) -> str:
    times = getattr(result, "times", None)
    when = "" if times is None else f" at t = {float(np.asarray(times)[-1]):g} s"
    return f"section{when}, heights enlarged"
