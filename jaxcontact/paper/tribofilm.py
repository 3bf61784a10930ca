"""The paper's Table 4, and Figs. 9 to 12: a steel ball on a viscoelastic tribofilm on steel, at rest.

The choice J = 2 phi: the paper's Eq. (14) fits phi(t) = 1/1.5 + (1 - exp(-0.02778 t/241.8))/0.02778 + t/6297.2
[1/GPa, t in s] and substitutes it, after Johnson, for 1/(2G). A shear creep compliance replaces
1/G, so J = 2 phi: every modulus and viscosity of Eq. (14) is halved here. Only then are the paper's own
figures reproduced: the approach of the film as a half-space under 60 N is 36.130 um with J = 2 phi (the paper prints
36.1380) and 22.90 um with J = phi.
"""

import functools
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from jaxcontact.paper import comparison
from jaxcontact.paper.comparison import (
    EXACT,
    PAPER,
    Reproduction,
    Row,
    Trace,
    compared,
    described,
    press,
    report,
    worst,
)
from jaxcontact.reference import hertz, lee_radok

NU = 0.3
STEEL = jc.Elastic.from_young(210e9, nu=NU)
RADIUS = 19.05e-3 / 2.0  # [m]
BALL = jc.Sphere(radius=RADIUS, material=STEEL)
BALL_COMPLIANCE = (1.0 - NU) / (210e9 / 2.6)  # (1 - nu)/G of the ball [1/Pa]
THICKNESS = 150e-9  # [m]
FILM = jc.Burgers(G1=1.5e9 / 2, G2=0.02778e9 / 2, eta1=6297.2e9 / 2, eta2=241.8e9 / 2, nu=NU)
ON_STEEL = jc.LayeredHalfSpace([jc.Layer(FILM, thickness=THICKNESS)], substrate=STEEL)
HALF_SPACE = jc.LayeredHalfSpace([], substrate=FILM)

DURATION = 7200.0  # [s]
STEPS = 120
TIMES = DURATION * (jnp.arange(STEPS + 1) / STEPS) ** 2  # dense where the film creeps and relaxes fastest
SHOWN = (0, 15, 30, 60, 90, 120)  # steps at 0, 1.9, 7.5, 30, 67.5 and 120 min

REMARKS = (
    "Linear theory is inaccurate at film strains above 0.2: such figures are results of the model, not predictions for"
    " the film.",
    "Poisson's ratio is constant, so the film creeps in volume as well as in shear: its compliance under a"
    " wide contact grows 33-fold in 7200 s. With an elastic bulk modulus (1.625 GPa) it would grow 1.6-fold,"
    " and at 60 N the final approach would be 2.571 um and p0 1.15 GPa, instead of 3.352 um and 0.668 GPa.",
)


@lru_cache(maxsize=8)
def creep(film_on_steel: bool, load: float, n: int) -> Trace:
    """Simulate a constant load [N] for 7200 s, on the film on steel or on the film as a half-space."""
    return _run(film_on_steel, jc.Load(load), n)


@lru_cache(maxsize=8)
def relaxation(film_on_steel: bool, approach: float, n: int) -> Trace:
    """Simulate a constant approach [um] for 7200 s, on the film on steel or on the film as a half-space."""
    return _run(film_on_steel, jc.Approach(approach * 1e-6), n)


def _run(film_on_steel: bool, control: jc.Load | jc.Approach, n: int) -> Trace:
    body = ON_STEEL if film_on_steel else HALF_SPACE
    return press(body, BALL, control, TIMES, jc.Grid.around(body, BALL, control, TIMES, n=n))


def _draw_pressures(name: str, found: dict[str, Trace], directory: Path) -> None:
    """Draw the pressure along x at six times, one panel per run, of which the first one is on the half-space."""
    figure, axes = comparison.panels(len(found))
    for i, (ax, (run, trace)) in enumerate(zip(axes, found.items(), strict=True)):
        comparison.over_time(ax, trace, trace.pressure / 1e9, SHOWN)
        title = f"{run} on the film" if i else run
        comparison.finish(ax, "x [µm]", "pressure [GPa]", title.replace("um", "µm"))
    comparison.save(figure, directory / f"{name}.png")


# Fig. 9: creep under a constant load, of the film as a half-space (a) and of the film on steel (b to d).
#
# References: at t = 0 Hertz (a) and the axisymmetric Abel solution (b to d, ``reference.abel``), and the
# approaches that the paper then uses in Table 5; in time Lee and Radok for the half-space, and for 60 N
# on the film an independent time-marching solution. The shapes are those that the paper describes.

LOADED, LOADS = "(a) half-space, 60 N", {"(b) 60 N": 60.0, "(c) 10 N": 10.0, "(d) 500 N": 500.0}
REFERENCES_9 = {
    f"{LOADED}: approach at 0 s [um]": 36.1299,
    f"{LOADED}: approach at 0 s, printed [um]": 36.1380,
    f"{LOADED}: load [N]": 60.0,
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


def _simulate_9(n: int) -> dict[str, Trace]:
    """Simulate the four creep runs."""
    found = {name: creep(True, load, n) for name, load in LOADS.items()}
    return {LOADED: creep(False, 60.0, n), **found}


def _compare_9(found: dict[str, Trace], references: Mapping[str, float]) -> list[Row]:
    """Compare the half-space, each load on the film, and the paper's statements on all three."""
    # The half-space: Lee and Radok's solution for a step load. A spike: the highest pressure at the last time is near the
    # edge and exceeds that at the centre.
    trace, R = found[LOADED], RADIUS
    load, J = references[f"{LOADED}: load [N]"], FILM.creep
    a = lee_radok.step_radius(trace.times, J, load, R, NU, BALL_COMPLIANCE)
    last = trace.pressure[-1]
    top = int(np.argmax(last))
    excess = float(last[top] / last[len(last) // 2] - 1.0)
    spike = trace.distance[top] > EDGE * trace.radius[-1] and excess > 0.0
    first, approach = float(trace.approach[0] * 1e6), worst(trace.approach / (a**2 / R))
    against = functools.partial(compared, references)
    over_time = f"{LOADED}: approach over Lee and Radok's, worst of all times"
    radius, quarter = f"{LOADED}: contact radius over theirs, worst", 0.25 * (trace.x[1] - trace.x[0]) / a[0]
    resolved = f"{LOADED}: spike at 7200 s over the pressure at the centre"
    rows = [
        against(f"{LOADED}: approach at 0 s [um]", first, 0.0005, comparison.GRID),
        against(f"{LOADED}: approach at 0 s, printed [um]", first, 0.003, "the paper's own grid", PAPER),
        Row(over_time, EXACT, 1.0, approach, 0.0005, comparison.GRID),
        Row(radius, EXACT, 1.0, worst(trace.radius / a), float(quarter), comparison.COARSE),
        described(f"{LOADED}: contact grows all the time", comparison.never_falls(trace.radius)),
        described(f"{LOADED}: spikes grow at the edge", spike),
        report(resolved, 1.0 + excess, "as resolved by this grid"),
    ]

    for name in LOADS:
        trace = found[name]
        first = trace.approach[0] * 1e6
        # without spikes the pressure along x decreases from the centre outwards
        halves = [p[len(p) // 2 :] for p in trace.pressure]
        domed = all(comparison.never_rises(half, slack=1e-6) for half in halves)
        rows += [
            against(f"{name}: approach at 0 s [um]", first, 0.0005, comparison.GRID),
            against(f"{name}: approach at 0 s, printed [um]", first, 0.003, comparison.BIAS, PAPER),
            against(f"{name}: p0 at 0 s [GPa]", trace.peak[0] / 1e9, 0.002, comparison.OFF_AXIS),
            against(f"{name}: a at 0 s [um]", trace.radius[0] * 1e6, 0.003, comparison.CELLS),
            described(f"{name}: pressure falls all the time", comparison.never_rises(trace.peak)),
            described(f"{name}: contact grows all the time", comparison.never_falls(trace.radius)),
            described(f"{name}: no spikes at the edge", domed),
            report(f"{name}: film strain at 0 s [-]", trace.strain[0], comparison.STRAINED),
            report(f"{name}: film strain at 7200 s [-]", trace.strain[-1], comparison.STRAINED),
        ]

    trace, reason = found["(b) 60 N"], "the march's own step and printed digits"
    rows += [
        against("(b) 60 N: approach at 7200 s [um]", trace.approach[-1] * 1e6, 0.003, reason, MARCH),
        against("(b) 60 N: p0 at 7200 s [GPa]", trace.peak[-1] / 1e9, 0.003, reason, MARCH),
        against("(b) 60 N: a at 7200 s [um]", trace.radius[-1] * 1e6, 0.003, reason, MARCH),
    ]
    drops = [found[name].peak[-1] / found[name].peak[0] for name in ("(c) 10 N", "(b) 60 N", "(d) 500 N")]
    rows.append(described("film: pressure falls the more the lower the load", drops[0] < drops[1] < drops[2]))
    return [*rows, comparison.solved(found.values())]


FIGURE_9 = Reproduction(
    "figure_9", "Fig. 9: creep under a constant load", REFERENCES_9, _simulate_9, _compare_9,
    functools.partial(_draw_pressures, "figure_9"), REMARKS,
)  # fmt: skip


# Fig. 10 and Table 5: relaxation at a constant approach, of the film as a half-space (a) and on steel (b to d).
#
# References: at t = 0 Hertz (a) and the axisymmetric Abel solution at the given approach (b to d). In time, the contact on
# the half-space is constant, so load and pressure follow the relaxation modulus of film and
# ball in series, again a Burgers material. The contact on the film grows towards the radius sqrt(2 R approach)
# of a completely relaxed film, 220 um for (b), which it does not reach within two hours.

HELD = "(a) half-space, 36.1380 um"
APPROACHES = {"(b) 2.5468 um": 2.5468, "(c) 0.7796 um": 0.7796, "(d) 10.4002 um": 10.4002}
REFERENCES_10 = {
    f"{HELD}: load at 0 s [N]": 60.0201,
    f"{HELD}: G1 [GPa]": 0.75,
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


def _simulate_10(n: int) -> dict[str, Trace]:
    """Simulate the four relaxation runs."""
    found = {name: relaxation(True, value, n) for name, value in APPROACHES.items()}
    return {HELD: relaxation(False, 36.1380, n), **found}


def _compare_10(found: dict[str, Trace], references: Mapping[str, float]) -> list[Row]:
    """Compare the half-space, each approach on the film, and the paper's statements on all three."""
    # The half-space: the load follows G(t)/G(0) of the film in series with the steel ball, whose compliance adds to 1/G1 at
    # equal nu.
    trace, film = found[HELD], FILM
    added = 1e-9 / references[f"{HELD}: G1 [GPa]"] + BALL_COMPLIANCE / (1.0 - NU)
    series = jc.Burgers(G1=1.0 / added, G2=film.G2, eta1=film.eta1, eta2=film.eta2, nu=film.nu)
    G = np.asarray(series.relaxation(trace.times))
    against, stepping = functools.partial(compared, references), "121 times, second order in the step"
    follows = worst(trace.load / trace.load[0] / (G / G[0]))
    area = worst(trace.radius / trace.radius[0])
    rows = [
        against(f"{HELD}: load at 0 s [N]", trace.load[0], 0.001, comparison.GRID),
        Row(f"{HELD}: load over its relaxation modulus, worst", EXACT, 1.0, follows, 0.005, stepping),
        Row(f"{HELD}: contact radius over the first, worst", PAPER, 1.0, area, 0.001, comparison.CELLS),
        described(f"{HELD}: pressure relaxes all the time", comparison.never_rises(trace.peak)),
    ]

    growth = {}
    for name in APPROACHES:
        trace, held = found[name], "constant approach"
        # the contact never shrinks, and grows less in each quarter of the time than in the one before
        quarters = np.diff(np.interp(np.linspace(0.0, trace.times[-1], 5), trace.times, trace.radius))
        levels_off = comparison.never_falls(trace.radius) and quarters[-1] > 0.0
        levels_off = levels_off and np.all(np.diff(quarters) < 0.0)
        growth[name] = trace.radius[-1] / trace.radius[0]
        rows += [
            against(f"{name}: load at 0 s [N]", trace.load[0], 0.001, comparison.GRID),
            against(f"{name}: p0 at 0 s [GPa]", trace.peak[0] / 1e9, 0.002, comparison.OFF_AXIS),
            against(f"{name}: a at 0 s [um]", trace.radius[0] * 1e6, 0.003, comparison.CELLS),
            described(f"{name}: pressure relaxes all the time", comparison.never_rises(trace.peak)),
            described(f"{name}: contact grows and levels off", levels_off),
            described(f"{name}: contact stays below its limit", trace.radius[-1] < 1.001 * _limit(trace)),
            report(f"{name}: p0 at 7200 s over p0 at 0 s [-]", trace.peak[-1] / trace.peak[0], held),
            report(f"{name}: a at 7200 s over a at 0 s [-]", growth[name], held),
            report(f"{name}: film strain at 0 s [-]", trace.strain[0], comparison.STRAINED),
            report(f"{name}: film strain at 7200 s [-]", trace.strain[-1], comparison.STRAINED),
        ]

    limit = _limit(found["(b) 2.5468 um"]) * 1e6
    key = "(b) 2.5468 um: limit sqrt(2 R approach) [um]"
    rows.append(against(key, limit, 0.003, "printed digits", PAPER))
    falls = growth["(c) 0.7796 um"] > growth["(b) 2.5468 um"] > growth["(d) 10.4002 um"]
    rows.append(described("film: contact grows the more the smaller the approach", falls))
    return [*rows, comparison.solved(found.values())]


def _limit(trace: Trace) -> float:
    """Return sqrt(2 R approach) [m], the contact radius on a film without resistance."""
    return float(np.sqrt(2.0 * RADIUS * trace.approach[-1]))


FIGURE_10 = Reproduction(
    "figure_10", "Fig. 10, Table 5: relaxation at a constant approach", REFERENCES_10, _simulate_10, _compare_10,
    functools.partial(_draw_pressures, "figure_10"), REMARKS,
)  # fmt: skip


# Fig. 11: the surface at a constant approach, of the film on steel (a) and of the film as a half-space (b).
#
# The figure shows the sum of both surfaces' displacements, which in the contact equals the ball's
# shape; the ball contributes about 1 % on the half-space. References: Hertz's displacement inside and outside
# the contact for the half-space, at all times; for the film, at t = 0 and in its limit, the ball's shape.

SURFACE, CONSTANT = "(a) film, 2.5468 um", "(b) half-space, 36.1380 um"
REFERENCES_11 = {
    f"{SURFACE}: displacement on the axis [um]": 2.5468,
    f"{CONSTANT}: load at 0 s [N]": 60.0201,
}


def _simulate_11(n: int) -> dict[str, Trace]:
    """Simulate two of the runs of Fig. 10."""
    return {SURFACE: relaxation(True, 2.5468, n), CONSTANT: relaxation(False, 36.1380, n)}


def _compare_11(found: dict[str, Trace], references: Mapping[str, float]) -> list[Row]:
    """Compare the film, whose surface conforms to the ball increasingly, and the half-space, whose surface is constant."""
    film, half = found[SURFACE], found[CONSTANT]

    # The film: the ball's shape on the axis, and the mean distance between ball and surface over |x| < sqrt(2 R approach).
    inside = film.distance < np.sqrt(2.0 * RADIUS * film.approach[0])
    ball = film.distance**2 / (2.0 * RADIUS)
    gap = np.mean((ball - film.approach[:, None] + film.displacement)[:, inside], axis=1)
    on_axis, middle = f"{SURFACE}: displacement on the axis [um]", len(film.x) // 2
    depth = (film.displacement[:, middle] + ball[middle]) * 1e6
    depth = references[on_axis] * worst(depth / references[on_axis])

    # The half-space: Hertz's displacement inside and outside the contact, at all times.
    load, against = f"{CONSTANT}: load at 0 s [N]", functools.partial(compared, references)
    A = (1.0 - NU) * float(FILM.creep(0.0)) + BALL_COMPLIANCE
    surface = hertz.displacement(half.distance, references[load], RADIUS, A)
    ratio = worst((half.displacement / surface).ravel())
    moved = float(np.max(np.abs(half.displacement - half.displacement[0])) / half.approach[0])
    along = f"{CONSTANT}: displacement along x over Hertz's, worst of all positions and times"
    unchanged = f"{CONSTANT}: surface unchanged (moves by less than 0.01 % of the approach)"
    conformal = f"{SURFACE}: increasingly conformal (mean gap within 220 um falls)"
    return [
        against(on_axis, depth, 0.0005, comparison.GRID),
        described(conformal, comparison.never_rises(gap)),
        report(f"{SURFACE}: mean gap within 220 um at 0 s [nm]", gap[0] * 1e9, "zero is conformal"),
        report(f"{SURFACE}: mean gap within 220 um at 7200 s [nm]", gap[-1] * 1e9, "zero is conformal"),
        report(f"{SURFACE}: film strain at 7200 s [-]", film.strain[-1], comparison.STRAINED),
        against(load, half.load[0], 0.001, comparison.GRID),
        Row(along, EXACT, 1.0, ratio, 0.001, comparison.GRID),
        described(unchanged, moved < 1e-4),
        report(f"{CONSTANT}: largest change over the approach [-]", moved, "zero is unchanged"),
        comparison.solved(found.values()),
    ]


def _draw_11(found: dict[str, Trace], directory: Path) -> None:
    """Draw the surface along x at six times, downwards into the body, with the ball at its constant approach."""
    figure, axes = comparison.panels(2)
    for ax, (name, trace) in zip(axes, found.items(), strict=True):
        comparison.over_time(ax, trace, -trace.displacement * 1e6, SHOWN)
        ball = (trace.distance**2 / (2.0 * RADIUS) - trace.approach[0]) * 1e6
        ax.plot(trace.x * 1e6, ball, "k:", linewidth=1.0, label="ball")
        ax.set_ylim(-1.05e6 * trace.approach[0], 0.25e6 * trace.approach[0])
        comparison.finish(ax, "x [µm]", "surface [µm]", name.replace("um", "µm"))
    comparison.save(figure, directory / "figure_11.png")


FIGURE_11 = Reproduction(
    "figure_11",
    "Fig. 11: surface at a constant approach",
    REFERENCES_11,
    _simulate_11,
    _compare_11,
    _draw_11,
    REMARKS,
)


# Fig. 12: two extreme constant approaches on the film, 50 um (a) and 0.01 nm (b).
#
# (a) The film has little effect at first (Hertz on steel); then the contact grows. (b) The contact radius is a few times
# the film's thickness and stays constant while the pressure relaxes. References: Hertz, and the axisymmetric
# Abel solution (``reference.abel``): at t = 0 with the modulus G(0), and for (b) at 7200 s by its inverse
# Laplace transform at the final contact radius, 0.0028111 MPa. An elastic film of modulus G(7200 s) gives the
# same, one of 1/J(7200 s) gives 0.0052 MPa: at a constant approach the relaxation modulus determines the pressure.

DEEP, SHALLOW = "(a) 50 um", "(b) 0.01 nm"
REFERENCES_12 = {
    f"{DEEP}: p0 at 0 s, Hertz on steel [GPa]": 5.322,
    f"{DEEP}: p0 at 0 s [GPa]": 5.28632,
    f"{DEEP}: a at 0 s [um]": 695.958,
    f"{SHALLOW}: p0 at 0 s [MPa]": 0.158992,
    f"{SHALLOW}: a at 0 s [um]": 0.408256,
    f"{SHALLOW}: p0 at 7200 s [MPa]": 0.0028111,
    f"{SHALLOW}: a at 7200 s [um]": 0.415485,
}


def _simulate_12(n: int) -> dict[str, Trace]:
    """Simulate both relaxation runs."""
    return {DEEP: relaxation(True, 50.0, n), SHALLOW: relaxation(True, 1e-5, n)}


def _compare_12(found: dict[str, Trace], references: Mapping[str, float]) -> list[Row]:
    """Compare (a) with Hertz and check its growth; check in (b) that the contact is constant and relaxes."""
    deep, shallow, against = found[DEEP], found[SHALLOW], functools.partial(compared, references)
    grows = comparison.never_falls(deep.radius) and deep.radius[-1] > deep.radius[0]
    return [
        against(
            f"{DEEP}: p0 at 0 s, Hertz on steel [GPa]",
            deep.peak[0] / 1e9,
            0.01,
            "the film reduces it by 0.7 %",
        ),
        against(f"{DEEP}: p0 at 0 s [GPa]", deep.peak[0] / 1e9, 0.002, comparison.OFF_AXIS),
        against(f"{DEEP}: a at 0 s [um]", deep.radius[0] * 1e6, 0.003, comparison.CELLS),
        described(f"{DEEP}: contact grows", grows),
        report(f"{DEEP}: a at 7200 s [um]", deep.radius[-1] * 1e6, "constant approach"),
        report(f"{DEEP}: film strain at 0 s [-]", deep.strain[0], comparison.STRAINED),
        report(f"{DEEP}: film strain at 7200 s [-]", deep.strain[-1], comparison.STRAINED),
        against(f"{SHALLOW}: p0 at 0 s [MPa]", shallow.peak[0] / 1e6, 0.002, comparison.OFF_AXIS),
        against(f"{SHALLOW}: a at 0 s [um]", shallow.radius[0] * 1e6, 0.003, comparison.CELLS),
        against(f"{SHALLOW}: p0 at 7200 s [MPa]", shallow.peak[-1] / 1e6, 0.003, "121 times"),
        against(f"{SHALLOW}: a at 7200 s [um]", shallow.radius[-1] * 1e6, 0.003, comparison.CELLS),
        described(f"{SHALLOW}: contact stays within 3 %", np.ptp(shallow.radius) < 0.03 * shallow.radius[0]),
        described(f"{SHALLOW}: pressure relaxes all the time", comparison.never_rises(shallow.peak)),
        report(f"{SHALLOW}: film strain at 0 s [-]", shallow.strain[0], "small"),
        comparison.solved(found.values()),
    ]


def _draw_12(found: dict[str, Trace], directory: Path) -> None:
    """Draw the pressure along x at six times."""
    figure, axes = comparison.panels(2)
    comparison.over_time(axes[0], found[DEEP], found[DEEP].pressure / 1e9, SHOWN)
    comparison.over_time(axes[1], found[SHALLOW], found[SHALLOW].pressure / 1e6, SHOWN)
    comparison.finish(axes[0], "x [µm]", "pressure [GPa]", "(a) 50 µm on the film")
    comparison.finish(axes[1], "x [µm]", "pressure [MPa]", "(b) 0.01 nm on the film")
    comparison.save(figure, directory / "figure_12.png")


FIGURE_12 = Reproduction(
    "figure_12", "Fig. 12: extreme approaches", REFERENCES_12, _simulate_12, _compare_12, _draw_12, REMARKS
)
