"""Fig. 4 and Table 2: a rigid ball on an elastic layer, as thick as the Hertz radius, of five stiffnesses.

Reference: O'Sullivan and King's problem by the axisymmetric Abel solution (``reference.abel``), as ratios to
Hertz on the substrate alone. The paper's domain, 2 a0 x 2 a0, is interpreted as half-widths, since the contact on the
softest layer extends to 1.447 a0.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

import jaxcontact as jc
from jaxcontact.paper import comparison
from jaxcontact.paper.comparison import PAPER, Reproduction, Row, Trace, compared, press
from jaxcontact.reference import hertz

NU, SUBSTRATE, RADIUS, LOAD = 0.3, 210e9, 18e-3, 20.0
COMPLIANCE = (1.0 - NU) / (SUBSTRATE / 2.6)
A0 = float(hertz.contact_radius(LOAD, RADIUS, COMPLIANCE))
P0 = float(hertz.peak_pressure(LOAD, RADIUS, COMPLIANCE))
D0 = float(hertz.approach(LOAD, RADIUS, COMPLIANCE))
RATIOS = (0.25, 0.5, 1.0, 2.0, 4.0)

# E1/E2: a/a0, approach/approach0, p(0)/p0, p(a/2)/p0
SOLUTION = {
    0.25: (1.44699739, 1.54468897, 0.50713761, 0.42198065),
    0.5: (1.20660765, 1.22712805, 0.70468227, 0.5998678),
    1.0: (1.0, 1.0, 1.0, 0.8660254),
    2.0: (0.81847754, 0.82686997, 1.47543690, 1.28769486),
    4.0: (0.65808788, 0.68206400, 2.28346598, 1.99200558),
}
NAMES = ("a/a0", "approach/approach0", "p(0)/p0", "p(a/2)/p0")
TOLERANCES = (0.003, 0.0005, 0.002, 0.002)
REASONS = (comparison.CELLS, comparison.GRID, comparison.OFF_AXIS, comparison.GRID)
REFERENCES = {
    "a0 [um]": 105.373,
    "p0 [MPa]": 860.03,
    **{
        f"{name} at E1/E2 = {ratio:g}": value
        for ratio, values in SOLUTION.items()
        for name, value in zip(NAMES, values, strict=True)
    },
}


def simulate(n: int) -> dict[float, Trace]:
    """Simulate the five contacts."""
    ball, grid = jc.Sphere(radius=RADIUS), jc.Grid.square(n=n, width=4.0 * A0)
    found = {}
    for ratio in RATIOS:
        layer = jc.Layer(jc.Elastic.from_young(ratio * SUBSTRATE, nu=NU), thickness=A0)
        body = jc.LayeredHalfSpace([layer], substrate=jc.Elastic.from_young(SUBSTRATE, nu=NU))
        found[ratio] = press(body, ball, jc.Load(LOAD), np.zeros(1), grid)
    return found


def compare(found: dict[float, Trace], references: Mapping[str, float]) -> list[Row]:
    """Compare Table 2 with a layer as stiff as its substrate, then each layer with the Abel solution."""
    same = found[1.0]
    rows = [
        compared(references, "a0 [um]", same.radius[0] * 1e6, TOLERANCES[0], REASONS[0], PAPER),
        compared(references, "p0 [MPa]", same.peak[0] / 1e6, TOLERANCES[2], REASONS[2], PAPER),
    ]
    for ratio, trace in found.items():
        ahead = trace.x > 0.0
        half = np.interp(0.5 * SOLUTION[ratio][0] * A0, trace.distance[ahead], trace.pressure[0][ahead])
        values = (trace.radius[0] / A0, trace.approach[0] / D0, trace.peak[0] / P0, half / P0)
        for name, value, tolerance, reason in zip(NAMES, values, TOLERANCES, REASONS, strict=True):
            rows.append(compared(references, f"{name} at E1/E2 = {ratio:g}", value, tolerance, reason))
    rows.append(comparison.solved(found.values()))
    return rows


def draw(found: dict[float, Trace], directory: Path) -> None:
    """Draw the pressure over p0 against x/a0, as in the paper's Fig. 4."""
    figure, (axes,) = comparison.panels(1)
    for i, (ratio, trace) in enumerate(found.items()):
        colour = comparison.colour(i, len(found))
        axes.plot(trace.x / A0, trace.pressure[0] / P0, color=colour, label=f"$E_1/E_2 = {ratio:g}$")
    comparison.finish(axes, "x / a$_0$", "pressure / p$_0$", "Elastic layer, h = a$_0$")
    axes.set_xlim(-1.75, 1.75)
    comparison.save(figure, directory / "figure_4.png")


CASE = Reproduction(
    "figure_4", "Fig. 4, Table 2: rigid ball on an elastic layer", REFERENCES, simulate, compare, draw
)
