"""Draws the sketches of the theory pages beside this file: python docs/sketches/draw.py."""

from collections.abc import Callable
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

HERE = Path(__file__).parent
INK, BODY, FILM, BALL, MARK = "#222222", "#c9ced6", "#7fb8ad", "#e8e3d8", "#31688e"
GLASSY, MEMORY = "#440154", "#21918c"

# the same file from the same code: no dates, no random names; text as outlines, so that no font is asked for
matplotlib.rcParams.update(
    {"svg.hashsalt": "jaxcontact", "svg.fonttype": "path", "font.size": 11}
)


def arrow(
    ax: Axes, tail: tuple, tip: tuple, style: str = "->", colour: str = INK
) -> None:
    ax.annotate(
        "", tip, tail, arrowprops={"arrowstyle": style, "color": colour, "lw": 1.4}
    )


def plain(ax: Axes, xlim: tuple, ylim: tuple) -> None:
    ax.set(xlim=xlim, ylim=ylim, aspect="equal")
    ax.axis("off")


def pressed_surface(x: np.ndarray, depth: float, half: float) -> np.ndarray:
    """A paraboloid in contact, and outside it the surface of an elastic half-space (Hertz)."""
    r = np.maximum(np.abs(x) / half, 1.0)
    outside = ((2.0 - r**2) * np.arcsin(1.0 / r) + np.sqrt(r**2 - 1.0)) / np.pi
    return np.where(
        np.abs(x) < half, -depth * (1.0 - 0.5 * (x / half) ** 2), -depth * outside
    )


def ball_on_layers(ax: Axes, half: float, depth: float) -> None:
    """The bodies of the first sketch."""
    x = np.linspace(-5.0, 5.0, 201)
    surface = pressed_surface(x, depth, half)
    ax.fill_between(x, -3.4, -1.4, color=BODY, lw=0)
    ax.fill_between(x, -1.4, surface, color=FILM, lw=0)
    ball = -depth + 0.5 * depth * (x / half) ** 2
    inside = ball < 2.1
    ax.fill_between(x[inside], ball[inside], 2.1, color=BALL, lw=0)
    ax.plot(x[inside], ball[inside], color=INK, lw=1.2)
    ax.plot(x, surface, color=INK, lw=1.2)


def conventions(ax: Axes) -> None:
    """Ball, film and substrate; axes and signs."""
    ball_on_layers(ax, half=1.9, depth=0.8)
    ax.plot([-5.0, 5.0], [0.0, 0.0], color=INK, lw=0.8, ls=":")
    for x in np.linspace(-1.5, 1.5, 7):
        height = np.sqrt(1.0 - (x / 1.9) ** 2)
        foot = -0.8 * (1.0 - 0.5 * (x / 1.9) ** 2)
        arrow(ax, (x, foot + 0.9 * height), (x, foot), colour=MARK)
    ax.text(0.0, 0.42, "p > 0", color=MARK, ha="center")
    arrow(ax, (0.0, 3.0), (0.0, 2.15))
    ax.text(0.15, 2.6, "W")
    arrow(ax, (-4.6, 0.0), (-4.6, -1.4), "<->")
    ax.text(-4.45, -0.85, "h")
    ax.text(4.9, -0.95, "layer: J(t), ν", ha="right")
    ax.text(4.9, -2.6, "substrate", ha="right")
    ax.text(0.0, 1.45, "indenter: profile f(x, y)", ha="center")
    arrow(ax, (4.0, -0.17), (4.0, 0.98), "<->")
    ax.text(4.15, 0.3, "gap g")
    arrow(ax, (-4.2, -2.0), (-3.2, -2.0))
    arrow(ax, (-4.2, -2.0), (-4.2, -3.0))
    ax.text(-3.1, -2.1, "x")
    ax.text(-4.05, -3.05, "z, u")
    plain(ax, (-5.0, 5.0), (-3.4, 3.1))


def memory(axes: np.ndarray) -> None:
    """Pressure in two steps, the creep due to each, and their sum."""
    t = np.linspace(0.0, 10.0, 600)
    creep = lambda s: np.where(s >= 0.0, 0.35 + 0.65 * (1.0 - np.exp(-s / 2.2)), 0.0)
    load = 0.6 * (t >= 1.0) + 0.4 * (t >= 5.0)
    axes[0].plot(t, load, color=INK)
    axes[0].set(ylabel="pressure p")
    parts = [0.6 * creep(t - 1.0), 0.4 * creep(t - 5.0)]
    axes[1].plot(t, sum(parts), color=INK, label="u, sum")
    axes[1].plot(t, parts[0], color=GLASSY, ls="--", label="first step")
    axes[1].plot(t, parts[1], color=MEMORY, ls=":", lw=2.0, label="second step")
    axes[1].set(ylabel="displacement u")
    axes[1].legend(frameon=False, loc="upper left", fontsize=9)
    step = np.array(
        [
            np.trapezoid(load[:i] * np.exp(-(t[i] - t[:i]) / 2.2), t[:i])
            for i in range(1, t.size)
        ]
    )
    axes[2].plot(t[1:], step / 2.2, color=MEMORY)
    axes[2].plot(t, load, color=INK, lw=0.8, ls="--")
    axes[2].set(ylabel="field λη")
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.set(xlabel="time", xticks=[], yticks=[], ylim=(-0.03, 1.15), xlim=(0.0, 10.0))


def moving(ax: Axes) -> None:
    """The frame of a moving indenter: leading edge at +x, the history behind."""
    x = np.linspace(-6.0, 6.0, 241)
    half, depth = 1.5, 0.8
    ball = -depth + 0.5 * depth * (x / half) ** 2
    ahead = pressed_surface(x, depth, half)
    behind = -0.62 * np.exp((x + 1.0) / 2.6)
    surface = np.where(x > -1.0, np.minimum(ahead, 0.0), behind)
    surface = np.where((x > -1.0) & (x < half), ball, surface)
    ax.fill_between(x, -2.2, surface, color=FILM, lw=0)
    inside = ball < 1.6
    ax.fill_between(x[inside], ball[inside], 1.6, color=BALL, lw=0)
    ax.plot(x[inside], ball[inside], color=INK, lw=1.2)
    ax.plot(x, surface, color=INK, lw=1.2)
    s = np.linspace(-1.0, half, 200)
    pressure = np.sqrt(np.maximum((s + 1.0) * (half - s), 0.0)) * (1.0 + 0.45 * s)
    ax.plot(s, -0.35 + pressure, color=MARK, lw=1.6)
    ax.text(0.25, 0.3, "p", color=MARK)
    arrow(ax, (2.9, 1.35), (4.3, 1.35))
    ax.text(4.4, 1.27, "velocity v")
    ax.text(-5.9, -1.55, "recovery behind\nthe contact: η(x − v s)")
    ax.text(2.3, -0.95, "leading edge:\nundeformed material")
    arrow(ax, (2.25, -0.55), (1.6, -0.25))
    plain(ax, (-6.0, 6.6), (-2.2, 1.7))


def slipping(axes: np.ndarray) -> None:
    """Stick within, slip at the rim: tractions of Cattaneo and Mindlin, and the loop of a cycle."""
    x, stick = np.linspace(-1.0, 1.0, 301), 0.6
    bound = np.sqrt(1.0 - x**2)
    traction = bound - stick * np.sqrt(np.maximum(1.0 - (x / stick) ** 2, 0.0))
    axes[0].axvspan(-stick, stick, color=FILM, alpha=0.35, lw=0)
    axes[0].plot(x, bound, color=INK, ls="--", label="μ p")
    axes[0].plot(x, traction, color=GLASSY, label="traction q")
    axes[0].text(0.0, 0.08, "stick", ha="center")
    axes[0].text(0.8, 0.08, "slip", ha="center")
    axes[0].legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 0.98), ncols=2)
    axes[0].set(xlabel="x / a", ylabel="traction", xticks=[-1, 0, 1], yticks=[])
    load, most = np.linspace(-0.8, 0.8, 200), 0.8
    first = lambda q: 1.0 - (1.0 - q) ** (2.0 / 3.0)
    turn = lambda q: (
        2.0 * (1.0 - (most - q) / 2.0) ** (2.0 / 3.0) - (1.0 - most) ** (2.0 / 3.0) - 1.0
    )
    axes[1].plot(
        first(np.linspace(0.0, most, 100)),
        np.linspace(0.0, most, 100),
        color=INK,
        ls="--",
    )
    axes[1].plot(turn(load), load, color=GLASSY)
    axes[1].plot(-turn(-load), load, color=GLASSY)
    axes[1].fill_betweenx(load, turn(load), -turn(-load), color=FILM, alpha=0.35, lw=0)
    axes[1].text(0.05, -0.6, "area: dissipation")
    axes[1].set(
        xlabel="tangential displacement", ylabel="tangential load", xticks=[], yticks=[]
    )
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)


def draw(name: str, size: tuple[float, float], columns: int, sketch: Callable) -> None:
    figure = Figure(figsize=size, layout="constrained")
    sketch(figure.subplots(1, columns))
    figure.savefig(HERE / f"{name}.svg", metadata={"Date": None})


if __name__ == "__main__":
    draw("conventions", (7.0, 4.5), 1, conventions)
    draw("memory", (8.4, 2.6), 3, memory)
    draw("moving", (7.2, 2.3), 1, moving)
    draw("slipping", (7.2, 2.9), 2, slipping)
