"""Draw the pictures of the README beside this file: python docs/gallery/draw.py [NAME ...]."""

import re
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fitting
import jaxcontact as jc
import matplotlib.style
import numpy as np
from jaxcontact.results.figures import contact_section
from matplotlib.axes import Axes
from matplotlib.figure import Figure

HERE = Path(__file__).parent
STEEL = jc.Elastic.from_young(210e9, nu=0.3)
GLASS = jc.Elastic.from_young(70e9, nu=0.22)
POLYMER = jc.Burgers(G1=1e9, G2=2e9, eta1=2e13, eta2=1.2e12, nu=0.38)
COATED = jc.LayeredHalfSpace([jc.Layer(POLYMER, thickness=5e-6)], substrate=GLASS)
BALL = jc.Sphere(radius=0.5e-3, material=STEEL)
HOUR = np.linspace(0.0, 3600.0, 31)


def small(title: str, xlabel: str, ylabel: str) -> tuple[Figure, Axes]:
    """Return a figure of the gallery with one panel."""
    figure = Figure(figsize=(3.3, 2.5), layout="constrained")
    ax = figure.subplots()
    ax.set(title=title, xlabel=xlabel, ylabel=ylabel)
    return figure, ax


def image(
    ax: Axes, field: np.ndarray, half_width: float, half_height: float, label: str
) -> None:
    """Draw a map (nx, ny) over the plane, in micrometres, with its colour bar."""
    extent = (-half_width * 1e6, half_width * 1e6, -half_height * 1e6, half_height * 1e6)
    shown = ax.imshow(np.asarray(field).T, origin="lower", extent=extent, aspect="equal")
    ax.figure.colorbar(shown, ax=ax, label=label, shrink=0.85)


def front() -> Figure:
    """The run of the README, by its own lines: a section, the pressure, and the approach over time."""
    readme = (HERE.parents[1] / "README.md").read_text(encoding="utf-8")
    run: dict[str, Any] = {}
    exec(re.findall(r"```python\n(.*?)```", readme, re.DOTALL)[0], run)
    history, grid = run["history"], run["grid"]
    middle = grid.shape[1] // 2
    figure = Figure(figsize=(8.8, 2.8), layout="constrained")
    section, left, right = figure.subplots(1, 3, width_ratios=(1.0, 1.1, 0.9))
    contact_section(section, history, run["body"]).set_title("after an hour")
    x = np.asarray(grid.axes()[0]) * 1e6
    for step in (0, 3, 10, 30):
        line = (
            np.asarray(history.pressure[step, :, middle - 1 : middle + 1]).mean(1) * 1e-6
        )
        left.plot(x, line, label=f"{HOUR[step] / 60:.0f} min")
    left.set(
        title="pressure across the contact",
        xlabel="x [µm]",
        ylabel="pressure [MPa]",
        xlim=(-12, 12),
        ylim=(0, None),
    )
    left.legend(loc="upper right", fontsize="small", handlelength=1.5)
    right.plot(HOUR / 60, np.asarray(history.approach) * 1e9, color="C1", ls="-")
    right.set(
        title="approach of the ball",
        xlabel="time [min]",
        ylabel="approach [nm]",
        xlim=(0, 60),
        ylim=(0, 90),
        xticks=range(0, 61, 20),
    )
    return figure


def start() -> Figure:
    """The sheet of the first example of start.md, with the stress below the surface."""
    coating = jc.StandardLinearSolid(G1=1e9, G2=0.5e9, eta2=3e11, nu=0.4)
    body = jc.LayeredHalfSpace([jc.Layer(coating, thickness=20e-6)], substrate=GLASS)
    ball, load, times = (
        jc.Sphere(5e-3, STEEL),
        jc.Load(0.05),
        np.linspace(0.0, 3600.0, 13),
    )
    grid = jc.Grid.around(body, ball, load, times, n=32)
    history = jc.indent(body, ball, load, times, grid=grid, substeps=4)
    depths = np.linspace(0.0, 60e-6, 31)
    return history.plot(
        body, jc.subsurface(body, grid, history.pressure, times=times, depths=depths)
    )


def creep() -> Figure:
    times = np.append(0.0, np.geomspace(1.0, 1e5, 24))
    figure, ax = small("Creep of coatings", "time [s]", "contact radius [µm]")
    for thickness in (1e-6, 5e-6, 25e-6):
        body = jc.LayeredHalfSpace([jc.Layer(POLYMER, thickness)], substrate=GLASS)
        grid = jc.Grid.square(64, 60e-6)
        history = jc.indent(body, BALL, jc.Load(5e-3), times, grid=grid, save="last")
        ax.semilogx(
            times[1:],
            np.asarray(history.contact_radius)[1:] * 1e6,
            label=f"{thickness * 1e6:.0f} µm",
        )
    ax.legend(title="thickness")
    return figure


def rough() -> Figure:
    grid = jc.Grid((128, 128), (0.5e-6, 0.5e-6), periodic=True)
    heights = jc.self_affine(
        grid, hurst=0.8, rms_slope=0.02, shortest=4e-6, longest=32e-6, seed=3
    )
    body = jc.LayeredHalfSpace([jc.Layer(POLYMER, 5e-6)], substrate=GLASS)
    history = jc.indent(
        body,
        jc.HeightField(heights, STEEL),
        jc.Load(0.06),
        [0.0, 3600.0],
        grid=grid,
        save="last",
    )
    figure, ax = small("Rough contact after 1 h", "x [µm]", "y [µm]")
    image(
        ax,
        np.where(history.pressure > 0, history.pressure * 1e-6, np.nan),
        32e-6,
        32e-6,
        "pressure [MPa]",
    )
    return figure


def sliding() -> Figure:
    rubber = jc.StandardLinearSolid(G1=2e6, G2=1e6, eta2=2e3, nu=0.49)
    body, grid = jc.LayeredHalfSpace([], rubber), jc.Grid.square(96, 2.6e-3)
    figure, ax = small(
        "Sliding on rubber", "x, sliding to the right [mm]", "pressure [kPa]"
    )
    for speed in (1e-3, 0.1, 10.0):
        steady = jc.slide_steady(
            body, jc.Sphere(2e-3), jc.Load(0.05), velocity=speed, grid=grid
        )
        line = np.asarray(steady.pressure[:, 47:49]).mean(1) * 1e-3
        ax.plot(np.asarray(grid.axes()[0]) * 1e3, line, label=f"{speed:g} m/s")
    ax.set(xlim=(-0.7, 0.7), ylim=(0, 650), xticks=(-0.5, 0.0, 0.5))
    ax.legend(loc="upper left", fontsize="small", handlelength=1.5)
    return figure


def fretting() -> Figure:
    grid = jc.Grid.square(48, 160e-6)
    stroke = 4e-7 * np.interp(np.linspace(0, 5, 31), [0, 1, 3, 5], [0, 1, -1, 1])
    moved = jc.TangentialDisplacement(np.stack([stroke, 0 * stroke], 1))
    times, ball = np.arange(31.0), jc.Sphere(5e-3, STEEL)
    body = jc.LayeredHalfSpace([], STEEL)
    history = jc.shear(
        body,
        ball,
        jc.Load(10.0),
        moved,
        times,
        friction=0.5,
        grid=grid,
        save="last",
        coupled=False,
    )
    figure, ax = small("Fretting loop", "displacement [µm]", "tangential force [N]")
    ax.plot(stroke * 1e6, np.asarray(history.tangential_load)[:, 0])
    for limit in (-5.0, 5.0):  # friction coefficient times load
        ax.axhline(limit, color="0.6", lw=0.8, ls=":")
    ax.text(0.4, 4.9, "limit of friction", ha="right", va="top", fontsize="small")
    return figure


def rolling() -> Figure:
    body, ball = jc.LayeredHalfSpace([], STEEL), jc.Sphere(10e-3, STEEL)
    grid = jc.Grid.square(64, 0.5e-3)
    state = jc.roll_steady(
        body,
        ball,
        jc.Load(100.0),
        velocity=1.0,
        creepage=(1.5e-3, 0.0),
        friction=0.3,
        grid=grid,
    )
    figure, ax = small(
        "Rolling: stick and slip", "x, rolling to the right [µm]", "y [µm]"
    )
    size = np.where(
        state.pressure > 0, np.linalg.norm(state.traction, axis=0) * 1e-6, np.nan
    )
    image(ax, size, 0.25e-3, 0.25e-3, "traction [MPa]")
    x, y = (np.asarray(a) * 1e6 for a in grid.axes())
    ax.contour(x, y, np.asarray(state.stick, float).T, [0.5], colors="white")
    for place, name, colour in ((-133.0, "slip", "black"), (50.0, "stick", "white")):
        ax.text(
            place, 0.0, name, color=colour, ha="center", va="center", fontsize="small"
        )
    return figure


def subsurface() -> Figure:
    grid, depths = jc.Grid.square(64, 60e-6), np.linspace(0.2e-6, 15e-6, 48)
    history = jc.indent(COATED, BALL, jc.Load(20e-3), [0.0], grid=grid, save="last")
    stress = (
        np.asarray(
            jc.subsurface(COATED, grid, history.pressure, depths=depths).von_mises[
                :, :, 32
            ]
        )
        * 1e-6
    )
    figure, ax = small("Stress in coating and glass", "x [µm]", "depth [µm]")
    x = np.asarray(grid.axes()[0]) * 1e6
    shown = ax.pcolormesh(x, depths * 1e6, stress, shading="gouraud")
    ax.axhline(5.0, color="white", lw=1, ls="--")
    for depth, name in ((4.6, "coating"), (6.4, "glass")):
        ax.text(-19.0, depth, name, color="white", fontsize="small")
    deepest, along = np.unravel_index(np.argmax(stress), stress.shape)
    ax.plot(x[along], depths[deepest] * 1e6, "w+", ms=9)
    ax.set(xlim=(-20, 20), ylim=(15, 0))
    figure.colorbar(shown, ax=ax, label="von Mises [MPa]")
    return figure


def fit() -> Figure:
    t = np.geomspace(1.0, 3600.0, 40)
    J = np.asarray(POLYMER.creep(t)) * (
        1.0 + 0.03 * np.random.default_rng(5).standard_normal(t.size)
    )
    found = fitting.fit_creep(fitting.CreepData(t=t, J=J), model=jc.Burgers)
    dense = np.geomspace(1.0, 2e4, 100)
    low, high = (np.asarray(a) * 1e9 for a in found.band(dense))
    figure, ax = small("Fit and its 95 % band", "time [s]", "J [1/GPa]")
    ax.semilogx(t, J * 1e9, ".", ms=5, color="black", ls="none")
    ax.semilogx(dense, np.asarray(found.predict(dense)) * 1e9, color="C1", ls="-")
    ax.fill_between(dense, low, high, color="C1", alpha=0.25, lw=0)
    return figure


def sweep() -> Figure:
    grid, loads, thicknesses = (
        jc.Grid.square(48, 40e-6),
        np.linspace(1e-3, 6e-3, 9),
        np.geomspace(0.5e-6, 20e-6, 9),
    )
    peaks = np.zeros((9, 9))
    for i, thickness in enumerate(thicknesses):
        body = jc.LayeredHalfSpace([jc.Layer(POLYMER, thickness)], substrate=GLASS)
        for j, load in enumerate(loads):
            history = jc.indent(
                body, BALL, jc.Load(load), [0.0, 3600.0], grid=grid, save="last"
            )
            peaks[i, j] = float(history.pressure.max()) * 1e-6
    figure, ax = small("Peak pressure after 1 h", "load [mN]", "thickness [µm]")
    shown = ax.contourf(loads * 1e3, thicknesses * 1e6, peaks, 12)
    ax.set_yscale("log")
    ax.set_yticks([0.5, 1, 2, 5, 10, 20], ["0.5", "1", "2", "5", "10", "20"])
    ax.minorticks_off()
    figure.colorbar(shown, ax=ax, label="pressure [MPa]")
    return figure


def growth() -> Figure:
    grid, times = jc.Grid.square(49, 400e-6), np.linspace(0.0, 3600.0, 25)
    material = jc.StandardLinearSolid(G1=16e9, G2=16e9, eta2=5e12, nu=0.3)
    grows = jc.StressActivated(
        rate=1e-2,
        activation_energy=0.65 * 1.602176634e-19,
        activation_volume=40e-30,
        temperature=373.0,
        stress="shear",
    )
    history = jc.rub(
        jc.LayeredHalfSpace([jc.Layer(material, thickness=0.0)], STEEL),
        jc.Sphere(9.525e-3, STEEL),
        jc.Load(60.0),
        times,
        velocity=0.1,
        friction=0.1,
        law=grows + jc.ProportionalRemoval(1e-3),
        grid=grid,
    )
    figure, ax = small("Growth of a tribofilm", "x [µm]", "thickness [nm]")
    for step in (2, 6, 24):
        line = np.asarray(history.thickness[step, :, 24]) * 1e9
        ax.plot(
            np.asarray(grid.axes()[0]) * 1e6, line, label=f"{times[step] / 60:.0f} min"
        )
    ax.set(xlim=(-200, 200), ylim=(0, 60))
    ax.legend(ncols=3, loc="upper center", fontsize="small", handlelength=1.5)
    return figure


PICTURES: dict[str, Callable[[], Figure]] = {
    draw.__name__: draw
    for draw in (
        front,
        start,
        creep,
        rough,
        sliding,
        fretting,
        rolling,
        subsurface,
        fit,
        sweep,
        growth,
    )
}


def main(names: list[str]) -> None:
    warnings.simplefilter("ignore")
    jc.enable_compilation_cache()
    with matplotlib.style.context("jaxcontact.style"):
        for name in names or PICTURES:
            PICTURES[name]().savefig(
                HERE / f"{name}.png", dpi=110 if name == "start" else 200
            )


if __name__ == "__main__":
    main(sys.argv[1:])
