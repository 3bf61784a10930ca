"""Draw the pictures of verification.md beside this file: python docs/comparisons/draw.py [NAME ...].

Points are results of jaxcontact, computed when the script runs; lines are closed forms or independent solutions
(jaxcontact/reference). Without names it draws all.png too, the picture of the README.
"""

import io
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jaxcontact as jc
import matplotlib.style
import numpy as np
from jaxcontact.reference import (
    abel,
    cattaneo_mindlin,
    hertz,
    hunter,
    lee_radok,
    maugis,
    ting,
)
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

HERE = Path(__file__).parent
NOW = np.zeros(1)
WIDTH = 1e-3  # of a slice in plane strain
POINTS = {"ls": "none", "marker": "o", "ms": 4, "mfc": "none", "color": "C1"}


def panel(title: str, xlabel: str, ylabel: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(3.5, 2.7), layout="constrained")
    ax = figure.subplots()
    ax.set(title=title, xlabel=xlabel, ylabel=ylabel)
    return figure, ax


def compare(ax: Axes, x: Any, exact: Any, at: Any, ours: Any, label: str = "") -> None:
    """Draw a reference as a line and our results as points."""
    ax.plot(x, exact, color="0.35", ls="-", lw=1.2, label=label or None)
    ax.plot(at, ours, **POINTS)


def line(n: int, width: float) -> jc.Grid:
    return jc.Grid((n, 1), (width / n, WIDTH), periodic=(False, True))


def layers() -> Figure:
    figure, ax = panel(
        "Layers: axisymmetric solution",
        "contact radius / thickness",
        "load / load on the substrate",
    )
    G, nu, h, R = 80e9, 0.3, 150e-6, 10e-3
    for ratio in (0.1, 4.0):
        solid = abel.Layered(ratio * G, nu, h, G, nu, 0.0)
        share = lambda radius, load: (
            load / (8.0 * radius**3 / (3.0 * R * hertz.compliance((G, nu))))
        )
        a = h * np.geomspace(0.1, 10.0, 25)
        exact = [share(one, abel.solve_radius(one, solid, R).load) for one in a]
        ours = []
        for one in a[2::4]:
            body = jc.LayeredHalfSpace(
                [jc.Layer(jc.Elastic(ratio * G, nu), h)], jc.Elastic(G, nu)
            )
            load = jc.Load(float(abel.solve_radius(one, solid, R).load))
            found = jc.indent(
                body, jc.Sphere(R), load, NOW, grid=jc.Grid.square(128, 2.6 * one)
            )
            ours.append(
                (
                    float(found.contact_radius[0]),
                    share(found.contact_radius[0], load.value),
                )
            )
        radii, shares = np.array(ours).T
        compare(ax, a / h, exact, radii / h, shares)
        ax.annotate(
            f"layer {ratio:g} times\nas stiff", (a[0] / h, exact[0]), xytext=(0, 10 if ratio < 1 else -30),
            textcoords="offset points", fontsize=8,
        )  # fmt: skip
    ax.set(xscale="log", yscale="log")
    return figure


def creep() -> Figure:
    figure, ax = panel("Maxwell half-space: Lee and Radok", "r [mm]", "pressure [MPa]")
    G, eta, nu, R, W = 1e9, 1e9, 0.3, 3.5e-3, 100.0
    film = jc.Maxwell(G, eta, nu)
    times = np.linspace(0.0, 2.0, 41)
    grid = jc.Grid.square(127, 1.4e-3)
    history = jc.indent(
        jc.LayeredHalfSpace([], film), jc.Sphere(R), jc.Load(W), times, grid=grid
    )
    x = np.asarray(grid.axes()[0])[63:]
    radius = lambda t: lee_radok.step_radius(t, film.creep, W, R, nu)
    for step in (0, 10, 40):
        r = np.linspace(0.0, 0.999 * float(radius(times[step])), 80)
        exact = lee_radok.pressure(r, times[step], film.relaxation, radius, R, nu)
        ours = np.asarray(history.pressure[step, 63:, 63])
        inside = x < r[-1]
        compare(ax, r * 1e3, exact * 1e-6, x[inside][::2] * 1e3, ours[inside][::2] * 1e-6)
        ax.annotate(
            f"{times[step] * G / eta:g} τ", (0.0, exact[0] * 1e-6), xytext=(2, 6),
            textcoords="offset points", fontsize=8,
        )  # fmt: skip
    ax.set(xlim=(0, None), ylim=(0, 280))
    return figure


def unloading() -> Figure:
    figure, ax = panel("Unloading: Ting", "time / relaxation time", "load [N]")
    G, eta, nu, R, turn, rate = 1e9, 1e9, 0.3, 3.5e-3, 1.0, 4e-6
    solid = jc.Maxwell(G, eta, nu)
    times = np.linspace(0.0, 1.8, 61)
    depth = lambda t: rate * np.minimum(t, 2.0 * turn - t)
    ball, body = jc.Sphere(R), jc.LayeredHalfSpace([], solid)
    control = jc.Approach(depth(times))
    grid = jc.Grid.around(body, ball, control, times, n=96)
    history = jc.indent(body, ball, control, times, grid=grid, save="last")
    speed = lambda t: np.where(np.asarray(t) < turn, rate, -rate)
    dense = np.linspace(0.01, 1.8, 90)
    exact = [ting.load(t, solid.relaxation, depth, speed, turn, R, nu) for t in dense]
    compare(ax, dense, exact, times[1::3], np.asarray(history.load)[1::3])
    ax.set(xlim=(0, None), ylim=(0, None))
    return figure


def sliding() -> Figure:
    figure, ax = panel(
        "Sliding on a standard solid: Hunter", "speed τ / half-width", "friction"
    )
    J0, J1, tau, nu, R, load = 1.0, 4.0, 1.0, 0.3, 1.0, 0.0084
    solid = jc.StandardLinearSolid(1.0 / J0, 1.0 / J1, tau / J1, nu)
    speeds = np.geomspace(3e-3, 3.0, 60)
    found = [hunter.of_load(load, v, R, J0, J1, tau, nu) for v in speeds]
    at = speeds[::6]
    grid = jc.Grid((384, 1), (0.5 / 384, 0.5), periodic=(False, True))
    ours = [
        float(
            jc.slide_steady(
                jc.LayeredHalfSpace([], solid),
                jc.Cylinder(R, 0.5),
                jc.Load(0.5 * load),
                velocity=v,
                grid=grid,
            ).friction_coefficient
        )
        for v in at
    ]
    wide = found[0].half_width
    compare(
        ax, speeds * tau / wide, [one.friction for one in found], at * tau / wide, ours
    )
    ax.set(xscale="log", ylim=(0, None))
    return figure


def slip() -> Figure:
    figure, ax = panel("Partial slip: Cattaneo and Mindlin", "x / a", "traction [MPa]")
    G, R, W, mu = 1e9, 10e-3, 10.0, 0.3
    body, ball = jc.LayeredHalfSpace([], jc.Elastic(G, 0.0)), jc.Sphere(R)
    a = float(hertz.contact_radius(W, R, 1.0 / G))
    peak = mu * float(hertz.peak_pressure(W, R, 1.0 / G))
    grid = jc.Grid.square(127, 2.4 * a)
    shares = np.array([0.3, 0.6, 0.9])
    push = jc.TangentialLoad(np.outer(shares * mu * W, [1.0, 0.0]))
    history = jc.shear(
        body,
        ball,
        jc.Load(W),
        push,
        np.arange(3.0),
        friction=mu,
        grid=grid,
        coupled=False,
    )
    x, r = np.asarray(grid.axes()[0]) / a, np.linspace(0.0, 1.0, 200)
    for step, share in enumerate(shares):
        ours = np.asarray(history.traction[step, 0, :, 63])
        exact = cattaneo_mindlin.traction(r * a, a, peak, share)
        shown = (x >= 0) & (x <= 1)
        compare(ax, r, exact * 1e-6, x[shown][::2], ours[shown][::2] * 1e-6)
        ax.annotate(
            f"{share:g} µW", (0.0, exact[0] * 1e-6), xytext=(2, 7),
            textcoords="offset points", fontsize=8,
        )  # fmt: skip
    ax.set(xlim=(0, 1.02), ylim=(0, None))
    return figure


def rolling() -> Figure:
    figure, ax = panel("Rolling: Carter", "creepage R / (µ a)", "force / (µ W)")
    G, nu, R, mu, a = 80e9, 0.3, 10e-3, 0.3, 1e-4
    load = np.pi * a**2 / (2.0 * R * 2.0 * (1.0 - nu) / G) * WIDTH
    steel = jc.Elastic(G, nu)
    at = np.array([0.05, 0.15, 0.3, 0.45, 0.6, 0.8, 0.95])
    ours = [
        float(
            jc.roll_steady(
                jc.LayeredHalfSpace([], steel),
                jc.Cylinder(R, WIDTH, steel),
                jc.Load(load),
                velocity=1.0,
                creepage=(share * mu * a / R, 0.0),
                friction=mu,
                grid=line(192, 3e-4),
                coupled=False,
            ).tangential_load[0]
        )
        / (mu * load)
        for share in at
    ]
    dense = np.linspace(0.0, 1.0, 80)
    compare(ax, dense, 1.0 - (1.0 - dense) ** 2, at, ours)
    ax.set(xlim=(0, 1), ylim=(0, 1.02))
    return figure


def wave() -> Figure:
    figure, ax = panel(
        "Wavy surface: Westergaard", "mean pressure / p*", "width of contact / wavelength"
    )
    G, nu, length, height = 1e9, 0.3, 1e-3, 1e-6
    full = np.pi * 2.0 * G / (1.0 - nu) * height / length
    grid = jc.Grid((256, 4), (length / 256, length / 256), periodic=True)
    x, y = grid.coordinates()
    surface = jc.HeightField(
        height * np.cos(2.0 * np.pi * np.asarray(x) / length) + 0.0 * np.asarray(y)
    )
    area = float(grid.width[0] * grid.width[1])
    at = np.array([0.01, 0.05, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95])
    ours = [
        float(
            jc.indent(
                jc.LayeredHalfSpace([], jc.Elastic(G, nu)),
                surface,
                jc.Load(share * full * area),
                NOW,
                grid=grid,
            ).smooth_area[0]
        )
        / area
        for share in at
    ]
    dense = np.linspace(0.0, 1.0, 200)
    compare(ax, dense, 2.0 / np.pi * np.arcsin(np.sqrt(dense)), at, ours)
    ax.set(xlim=(0, 1), ylim=(0, 1.02))
    return figure


def adhesion() -> Figure:
    figure, ax = panel("Adhesion: Maugis, λ = 1", "approach [nm]", "load [µN]")
    G, nu, R, work = 1e6, 0.5, 5e-6, 50e-3
    modulus = 2.0 * G / (1.0 - nu)
    units = maugis.units(work, R, modulus)
    load, approach = maugis.maugis(1.0, np.linspace(0.15, 2.2, 80))
    law = jc.DugdaleAdhesion(work, maugis.strength(1.0, work, R, modulus))
    at = units.approach * np.linspace(1.5, -0.4, 12)
    history = jc.indent(
        jc.LayeredHalfSpace([], jc.Elastic(G, nu)),
        jc.Sphere(R),
        jc.Approach(at),
        np.arange(float(at.size)),
        grid=jc.Grid.square(96, 4.9 * units.radius),
        adhesion=law,
    )
    compare(
        ax, approach * units.approach * 1e9, load * units.load * 1e6,
        at * 1e9, np.asarray(history.load) * 1e6,
    )  # fmt: skip
    ax.axhline(0.0, color="0.7", lw=0.8, ls="-")
    ax.set(xlim=(-110, 260), ylim=(-1.4, 1.0))
    return figure


PICTURES: dict[str, Callable[[], Figure]] = {
    draw.__name__: draw
    for draw in (layers, creep, unloading, sliding, slip, rolling, wave, adhesion)
}


def together(figures: list[Figure]) -> Image.Image:
    """Return the figures in rows of four, each redrawn smaller so that its letters are legible in a page."""
    parts = []
    for figure in figures:
        figure.set_size_inches(2.75, 2.45)
        ax = figure.axes[0]
        ax.set_title(ax.get_title().replace(": ", ":\n"), fontsize=9.5)
        for label in (ax.xaxis.label, ax.yaxis.label):
            label.set_fontsize(8.5)
        stream = io.BytesIO()
        figure.savefig(stream, dpi=160, format="png")
        parts.append(Image.open(stream).convert("RGB"))
    width, height = parts[0].size
    sheet = Image.new("RGB", (4 * width, -(-len(parts) // 4) * height), "white")
    for i, part in enumerate(parts):
        sheet.paste(part, (i % 4 * width, i // 4 * height))
    return sheet


def main(names: list[str]) -> None:
    warnings.simplefilter("ignore")
    jc.enable_compilation_cache()
    figures = []
    with matplotlib.style.context("jaxcontact.style"):
        for name in names or PICTURES:
            figures.append(PICTURES[name]())
            figures[-1].savefig(HERE / f"{name}.png", dpi=120)
            print(name, flush=True)
        if not names:
            together(figures).save(HERE / "all.png", optimize=True)


if __name__ == "__main__":
    main(sys.argv[1:])
