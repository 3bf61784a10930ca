"""Fig. 10 and Table 5: relaxation at a constant approach, of the film as a half-space (a) and on steel (b to d).

References: at t = 0 Hertz (a) and the axisymmetric Abel solution at the given approach (b to d). In time, the contact on
the half-space is constant, so load and pressure follow the relaxation modulus of film and
ball in series, again a Burgers material. The contact on the film grows towards the radius sqrt(2 R approach)
of a completely relaxed film, 220 um for (b), which it does not reach within two hours.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

import jaxcontact as jc
from jaxcontact.paper import comparison, tribofilm
from jaxcontact.paper.comparison import EXACT, PAPER, Reproduction, Row, described, report, worst
from jaxcontact.paper.tribofilm import Trace

HALF, APPROACHES = (
    "(a) half-space, 36.1380 um",
    {"(b) 2.5468 um": 2.5468, "(c) 0.7796 um": 0.7796, "(d) 10.4002 um": 10.4002},
)
REFERENCES = {
    f"{HALF}: load at 0 s [N]": 60.0201,
    f"{HALF}: G1 [GPa]": 0.75,
    "(b) 2.5468 um: load at 0 s [N]": 59.8277,
    "(b) 2.5468 um: p0 at 0 s [GPa]": 1.16610,
    "(b) 2.5468 um: a at 0 s [um]": 160.057,
    "(b) 2.5468 um: limit sqrt(2 R approach) [um]": 220.0,
    "(c) 0.7796 um: load at 0 s [N]": 9.97543,
    "(c) 0.7796 um: p0 at 0 s [GPa]": 0.630250,
    "(c) 0.7796 um: a at 0 s [um]": 89.874,
    "(d) 10.4002 um: load at 0 s [N]": 498.646,
    "(d) 10.4002 um: p0 at 0 s [GPa]": 2.39176,
    "(d) 10.4002 um: a at 0 s [um]": 319.774,
}


def simulate(n: int) -> dict[str, Trace]:
    """Simulate the four relaxation runs."""
    found = {name: tribofilm.relaxation(True, value, n) for name, value in APPROACHES.items()}
    return {HALF: tribofilm.relaxation(False, 36.1380, n), **found}


def compare(found: dict[str, Trace], references: Mapping[str, float]) -> list[Row]:
    """Compare the half-space, each approach on the film, and the paper's statements on all three."""
    # The half-space: the load follows G(t)/G(0) of the film in series with the steel ball, whose compliance adds to 1/G1 at
    # equal nu.
    trace, film = found[HALF], tribofilm.FILM
    added = 1e-9 / references[f"{HALF}: G1 [GPa]"] + tribofilm.BALL_COMPLIANCE / (1.0 - tribofilm.NU)
    series = jc.Burgers(G1=1.0 / added, G2=film.G2, eta1=film.eta1, eta2=film.eta2, nu=film.nu)
    G = np.asarray(series.relaxation(trace.times))
    load, stepping = f"{HALF}: load at 0 s [N]", "121 times, second order in the step"
    follows = worst(trace.load / trace.load[0] / (G / G[0]))
    area = worst(trace.radius / trace.radius[0])
    rows = [
        Row(load, EXACT, references[load], float(trace.load[0]), 0.001, comparison.GRID),
        Row(f"{HALF}: load over its relaxation modulus, worst", EXACT, 1.0, follows, 0.005, stepping),
        Row(f"{HALF}: contact radius over the first, worst", PAPER, 1.0, area, 0.001, comparison.CELLS),
        described(f"{HALF}: pressure relaxes all the time", comparison.never_rises(trace.peak)),
    ]

    growth = {}
    for name in APPROACHES:
        trace, held = found[name], "constant approach"
        exact = {
            f"{name}: load at 0 s [N]": (trace.load[0], 0.001, comparison.GRID),
            f"{name}: p0 at 0 s [GPa]": (trace.peak[0] / 1e9, 0.002, comparison.OFF_AXIS),
            f"{name}: a at 0 s [um]": (trace.radius[0] * 1e6, 0.003, comparison.CELLS),
        }
        # the contact never shrinks, and grows less in each quarter of the time than in the one before
        quarters = np.diff(np.interp(np.linspace(0.0, trace.times[-1], 5), trace.times, trace.radius))
        levels_off = comparison.never_falls(trace.radius) and quarters[-1] > 0.0
        levels_off = levels_off and np.all(np.diff(quarters) < 0.0)
        growth[name] = trace.radius[-1] / trace.radius[0]
        rows += [Row(key, EXACT, references[key], float(value), *why) for key, (value, *why) in exact.items()]
        rows += [
            described(f"{name}: pressure relaxes all the time", comparison.never_rises(trace.peak)),
            described(f"{name}: contact grows and levels off", levels_off),
            described(f"{name}: contact stays below its limit", trace.radius[-1] < 1.001 * _limit(trace)),
            report(f"{name}: p0 at 7200 s over p0 at 0 s [-]", trace.peak[-1] / trace.peak[0], held),
            report(f"{name}: a at 7200 s over a at 0 s [-]", growth[name], held),
            report(f"{name}: film strain at 0 s [-]", trace.strain[0], comparison.STRAINED),
            report(f"{name}: film strain at 7200 s [-]", trace.strain[-1], comparison.STRAINED),
        ]

    key = "(b) 2.5468 um: limit sqrt(2 R approach) [um]"
    limit = _limit(found["(b) 2.5468 um"]) * 1e6
    rows.append(Row(key, PAPER, references[key], limit, 0.003, "printed digits"))
    falls = growth["(c) 0.7796 um"] > growth["(b) 2.5468 um"] > growth["(d) 10.4002 um"]
    rows.append(described("film: contact grows the more the smaller the approach", falls))
    return [*rows, comparison.solved(found.values())]


def _limit(trace: Trace) -> float:
    """Return sqrt(2 R approach) [m], the contact radius on a film without resistance."""
    return float(np.sqrt(2.0 * tribofilm.RADIUS * trace.approach[-1]))


def draw(found: dict[str, Trace], directory: Path) -> None:
    """Draw the pressure along x at six times, one panel per run."""
    figure, axes = comparison.panels(4)
    for ax, (name, trace) in zip(axes, found.items(), strict=True):
        comparison.over_time(ax, trace, trace.pressure / 1e9, tribofilm.SHOWN)
        title = name if name == HALF else f"{name} on the film"
        comparison.finish(ax, "x [µm]", "pressure [GPa]", title.replace("um", "µm"))
    comparison.save(figure, directory / "figure_10.png")


CASE = Reproduction(
    "figure_10",
    "Fig. 10, Table 5: relaxation at a constant approach",
    REFERENCES,
    simulate,
    compare,
    draw,
    tribofilm.REMARKS,
)
