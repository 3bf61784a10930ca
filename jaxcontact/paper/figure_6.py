"""Fig. 6 and Table 3: a rigid ball on a Maxwell layer so thick that it is a half-space, or of negligible thickness.

Table 3 gives 1/(2G) of the material, as Table 4 does for the film (see ``tribofilm``): J = 2 phi, so G and eta are
half of the printed values. Only so is its a_v0 = 131.5206 um, which is 2^(1/3) times the Hertz radius on steel,
reproduced.

References: Lee and Radok's half-space under a step load (the contact radius grows as (1 + t/tau)^(1/3), the
approach as its square), and Hertz on steel.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

import jaxcontact as jc
from jaxcontact.paper import comparison
from jaxcontact.paper.comparison import EXACT, PAPER, Reproduction, Row, Trace, press, worst
from jaxcontact.reference import lee_radok

NU, RADIUS, LOAD, TAU, POINTS = 0.3, 3.5e-3, 100.0, 1.0, 41
G = 80.77e9 / 2.0
A0, AV0 = 104.388e-6, 131.5206e-6  # printed values, used only for the width of the grids
THICK, THIN = 1e4, 1e-5  # h/a0
TIMES = np.linspace(0.0, 2.0 * TAU, POINTS)
REFERENCES = {
    "a_v0 [um]": 131.5206,
    "p_v0 [GPa]": 2.7603,
    "tau [s]": TAU,
    "a0 [um]": 104.388,
    "p0 [GPa]": 4.3817,
}
STEPPING = "41 points, second order in the step"


class Layers(NamedTuple):
    """The contacts on the thick layer and on the thin one."""

    thick: Trace
    thin: Trace


def simulate(n: int) -> Layers:
    """Simulate both thicknesses over 2 tau."""
    final = 3.0 ** (1.0 / 3.0) * AV0
    return Layers(_run(THICK, 2.3 * final, n), _run(THIN, 2.6 * A0, n))


def _run(ratio: float, width: float, n: int) -> Trace:
    layer = jc.Layer(jc.Maxwell(G=G, eta=G * TAU, nu=NU), thickness=ratio * A0)
    body = jc.LayeredHalfSpace([layer], substrate=jc.Elastic.from_young(210e9, nu=NU))
    return press(body, jc.Sphere(radius=RADIUS), jc.Load(LOAD), TIMES, jc.Grid.square(n=n, width=width))


def compare(found: Layers, references: Mapping[str, float]) -> list[Row]:
    """Compare with Table 3 at t = 0, then check the growth on the thick layer (a) and its absence on the thin one (b)."""
    thick, thin, tau = found.thick, found.thin, references["tau [s]"]

    # (a) Lee and Radok's half-space under a step load.
    a, p = references["a_v0 [um]"], references["p_v0 [GPa]"]
    radius = 1e-6 * a * (1.0 + thick.times / tau) ** (1.0 / 3.0)
    peak = np.array([np.max(_lee_radok(thick, a * 1e-6, tau, t)) for t in thick.times])
    field = _lee_radok(thick, a * 1e-6, tau, thick.times[-1])
    distance = 1.0 + float(np.sum(np.abs(thick.pressure[-1] - field)) / np.sum(field))
    rows = [
        Row("(a) a_v0 [um]", PAPER, a, thick.radius[0] * 1e6, 0.003, comparison.CELLS),
        Row("(a) p_v0 [GPa]", PAPER, p, thick.peak[0] / 1e9, 0.002, comparison.OFF_AXIS),
    ]
    for what, ratios, within, why in (
        ("contact radius", thick.radius / radius, 0.003, comparison.CELLS),
        ("approach", thick.approach / (radius**2 / RADIUS), 0.0005, comparison.GRID),
        ("peak pressure", thick.peak / peak, 0.002, STEPPING),
    ):
        name = f"(a) {what} over its closed form, worst of 41"
        rows.append(Row(name, EXACT, 1.0, worst(ratios), within, why))
    rows.append(Row("(a) pressure along x at 2 tau, 1 + L1 distance", EXACT, 1.0, distance, 0.001, STEPPING))

    # (b) Hertz on steel at all times.
    a, p = references["a0 [um]"], references["p0 [GPa]"]
    radii, peaks = a * worst(thin.radius * 1e6 / a), p * worst(thin.peak / 1e9 / p)
    approach = worst(thin.approach / ((a * 1e-6) ** 2 / RADIUS))
    return [
        *rows,
        Row("(b) a0 [um], worst of 41", PAPER, a, radii, 0.003, comparison.CELLS),
        Row("(b) p0 [GPa], worst of 41", PAPER, p, peaks, 0.002, comparison.OFF_AXIS),
        Row("(b) approach over Hertz's, worst of 41", EXACT, 1.0, approach, 0.0005, comparison.GRID),
        comparison.solved(found),
    ]


def _lee_radok(trace: Trace, first: float, tau: float, t: float) -> np.ndarray:
    """Return the pressure along the middle row at a time [Pa], (n,)."""
    radius = lambda s: first * (1.0 + np.asarray(s) / tau) ** (1.0 / 3.0)
    return lee_radok.pressure(trace.distance, t, lambda s: G * np.exp(-s / tau), radius, RADIUS, NU)


def draw(found: Layers, directory: Path) -> None:
    """Draw the pressure along x at five times, with Lee and Radok's at the last one."""
    figure, axes = comparison.panels(2)
    steps = np.linspace(0, POINTS - 1, 5).astype(int)
    for ax, trace in zip(axes, found, strict=True):
        labels = [rf"t = {trace.times[i] / TAU:g} $\tau$" for i in steps]
        comparison.profiles(ax, trace.x * 1e6, trace.pressure[steps] / 1e9, labels)
    exact = _lee_radok(found.thick, AV0, TAU, found.thick.times[-1])
    axes[0].plot(found.thick.x * 1e6, exact / 1e9, "k:", linewidth=1.0, label=r"closed form, 2 $\tau$")
    comparison.finish(axes[0], "x [µm]", "pressure [GPa]", "(a) Maxwell layer, h/a$_0$ = 10$^4$")
    comparison.finish(axes[1], "x [µm]", "pressure [GPa]", "(b) h/a$_0$ = 10$^{-5}$: all times on one curve")
    comparison.save(figure, directory / "figure_6.png")


CASE = Reproduction(
    "figure_6", "Fig. 6, Table 3: rigid ball on a Maxwell layer", REFERENCES, simulate, compare, draw
)
