"""Fig. 9: creep under a constant load, of the film as a half-space (a) and of the film on steel (b to d).

References: at t = 0 Hertz (a) and the axisymmetric Abel solution (b to d, ``reference.abel``), and the
approaches that the paper then uses in Table 5; in time Lee and Radok for the half-space, and for 60 N
on the film an independent time-marching solution. The shapes are those that the paper describes.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxcontact.paper import comparison, tribofilm
from jaxcontact.paper.comparison import EXACT, PAPER, Reproduction, Row, described, report, worst
from jaxcontact.paper.tribofilm import Trace
from jaxcontact.reference import lee_radok

HALF, LOADS = "(a) half-space, 60 N", {"(b) 60 N": 60.0, "(c) 10 N": 10.0, "(d) 500 N": 500.0}
REFERENCES = {
    f"{HALF}: approach at 0 s [um]": 36.1299,
    f"{HALF}: approach at 0 s, printed [um]": 36.1380,
    f"{HALF}: load [N]": 60.0,
    "(b) 60 N: approach at 0 s [um]": 2.55166,
    "(b) 60 N: approach at 0 s, printed [um]": 2.5468,
    "(b) 60 N: p0 at 0 s [GPa]": 1.16724,
    "(b) 60 N: a at 0 s [um]": 160.207,
    "(b) 60 N: approach at 7200 s [um]": 3.352,
    "(b) 60 N: p0 at 7200 s [GPa]": 0.668,
    "(b) 60 N: a at 7200 s [um]": 216.0,
    "(c) 10 N: approach at 0 s [um]": 0.780865,
    "(c) 10 N: approach at 0 s, printed [um]": 0.7796,
    "(c) 10 N: p0 at 0 s [GPa]": 0.630787,
    "(c) 10 N: a at 0 s [um]": 89.95,
    "(d) 500 N: approach at 0 s [um]": 10.41896,
    "(d) 500 N: approach at 0 s, printed [um]": 10.4002,
    "(d) 500 N: p0 at 0 s [GPa]": 2.39395,
    "(d) 500 N: a at 0 s [um]": 320.1,
}
MARCH = "independent march"
EDGE = 0.8  # fraction of the contact radius beyond which a maximum counts as a spike at the edge


def simulate(n: int) -> dict[str, Trace]:
    """Simulate the four creep runs."""
    found = {name: tribofilm.creep(True, load, n) for name, load in LOADS.items()}
    return {HALF: tribofilm.creep(False, 60.0, n), **found}


def compare(found: dict[str, Trace], references: Mapping[str, float]) -> list[Row]:
    """Compare the half-space, each load on the film, and the paper's statements on all three."""
    # The half-space: Lee and Radok's solution for a step load. A spike: the highest pressure at the last time is near the
    # edge and exceeds that at the centre.
    trace, R = found[HALF], tribofilm.RADIUS
    load, J = references[f"{HALF}: load [N]"], tribofilm.FILM.creep
    a = lee_radok.step_radius(trace.times, J, load, R, tribofilm.NU, tribofilm.BALL_COMPLIANCE)
    last = trace.pressure[-1]
    top = int(np.argmax(last))
    excess = float(last[top] / last[len(last) // 2] - 1.0)
    spike = trace.distance[top] > EDGE * trace.radius[-1] and excess > 0.0
    first, approach = float(trace.approach[0] * 1e6), worst(trace.approach / (a**2 / R))
    names = f"{HALF}: approach at 0 s [um]", f"{HALF}: approach at 0 s, printed [um]"
    over_time = f"{HALF}: approach over Lee and Radok's, worst of all times"
    radius, quarter = f"{HALF}: contact radius over theirs, worst", 0.25 * (trace.x[1] - trace.x[0]) / a[0]
    resolved = f"{HALF}: spike at 7200 s over the pressure at the centre"
    rows = [
        Row(names[0], EXACT, references[names[0]], first, 0.0005, comparison.GRID),
        Row(names[1], PAPER, references[names[1]], first, 0.003, "the paper's own grid"),
        Row(over_time, EXACT, 1.0, approach, 0.0005, comparison.GRID),
        Row(radius, EXACT, 1.0, worst(trace.radius / a), float(quarter), comparison.COARSE),
        described(f"{HALF}: contact grows all the time", comparison.never_falls(trace.radius)),
        described(f"{HALF}: spikes grow at the edge", spike),
        report(resolved, 1.0 + excess, "as resolved by this grid"),
    ]

    for name in LOADS:
        trace = found[name]
        compared = [
            ("approach at 0 s [um]", EXACT, trace.approach[0] * 1e6, 0.0005, comparison.GRID),
            ("approach at 0 s, printed [um]", PAPER, trace.approach[0] * 1e6, 0.003, comparison.BIAS),
            ("p0 at 0 s [GPa]", EXACT, trace.peak[0] / 1e9, 0.002, comparison.OFF_AXIS),
            ("a at 0 s [um]", EXACT, trace.radius[0] * 1e6, 0.003, comparison.CELLS),
        ]
        for what, source, value, tolerance, reason in compared:
            key = f"{name}: {what}"
            rows.append(Row(key, source, references[key], float(value), tolerance, reason))
        # without spikes the pressure along x decreases from the centre outwards
        halves = [p[len(p) // 2 :] for p in trace.pressure]
        domed = all(comparison.never_rises(half, slack=1e-6) for half in halves)
        rows += [
            described(f"{name}: pressure falls all the time", comparison.never_rises(trace.peak)),
            described(f"{name}: contact grows all the time", comparison.never_falls(trace.radius)),
            described(f"{name}: no spikes at the edge", domed),
            report(f"{name}: film strain at 0 s [-]", trace.strain[0], comparison.STRAINED),
            report(f"{name}: film strain at 7200 s [-]", trace.strain[-1], comparison.STRAINED),
        ]

    trace, reason = found["(b) 60 N"], "the march's own step and printed digits"
    marched = {
        "(b) 60 N: approach at 7200 s [um]": trace.approach[-1] * 1e6,
        "(b) 60 N: p0 at 7200 s [GPa]": trace.peak[-1] / 1e9,
        "(b) 60 N: a at 7200 s [um]": trace.radius[-1] * 1e6,
    }
    rows += [Row(key, MARCH, references[key], float(value), 0.003, reason) for key, value in marched.items()]
    drops = [found[name].peak[-1] / found[name].peak[0] for name in ("(c) 10 N", "(b) 60 N", "(d) 500 N")]
    rows.append(described("film: pressure falls the more the lower the load", drops[0] < drops[1] < drops[2]))
    return [*rows, comparison.solved(found.values())]


def draw(found: dict[str, Trace], directory: Path) -> None:
    """Draw the pressure along x at six times, one panel per run."""
    figure, axes = comparison.panels(4)
    for ax, (name, trace) in zip(axes, found.items(), strict=True):
        comparison.over_time(ax, trace, trace.pressure / 1e9, tribofilm.SHOWN)
        title = name if name == HALF else f"{name} on the film"
        comparison.finish(ax, "x [µm]", "pressure [GPa]", title)
    comparison.save(figure, directory / "figure_9.png")


CASE = Reproduction(
    "figure_9", "Fig. 9: creep under a constant load", REFERENCES, simulate, compare, draw, tribofilm.REMARKS
)
