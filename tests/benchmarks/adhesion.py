"""Adhesive contacts against closed forms and published theories.

python -m tests.benchmarks.adhesion [speeds] [fast] [layers] [iterations] [zone]

speeds: pull-off load over six decades of retraction speed after a long dwell on a standard linear solid with E0/Einf = 3.
    Published theory: a Dugdale zone at the edge of a receding contact is that of a crack that runs at the speed v (R. A.
    Schapery, Int. J. Fract. 11 (1975) 141 and 369; J. A. Greenwood, J. Phys. D 37 (2004) 2557), in a contact that is
    relaxed elsewhere (J. A. Greenwood, K. L. Johnson, Philos. Mag. A 43 (1981) 697). It holds where v tau is much smaller
    than the contact. Limit of high speeds: a peeling Abel density (docs/theory.md).
fast: the limit of high speeds for E0/Einf = 10.
layers: pull-off load on films against the theory of Johnson, Kendall and Roberts on layers, at three Tabor numbers.
iterations: iterations of a step with adhesion over those of the same step without.
zone: pull-off load of an elastic half-space at a Tabor number of 5 over the cells across the zone of attraction.
"""

import sys
import time
import warnings

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

import jaxcontact as jc
from jaxcontact.reference import abel, maugis

WORK, RADIUS, G, NU = 50e-3, 5e-6, 1e6, 0.5
E = 2.0 * G / (1.0 - NU)
UNITS = maugis.units(WORK, RADIUS, E)
BALL = jc.Sphere(RADIUS)
REACH = np.cbrt(RADIUS * WORK**2 / E**2)  # range of a Tabor number of 1
UNIT_ZONE = (
    0.25 * np.pi / np.cbrt(0.75 * np.pi)
)  # pi E* w/(4 s0^2) over the unit of radius, at a Tabor number of 1
DWELL = 1e6  # relaxation times
SPEEDS = 1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0  # units of approach per relaxation time
STEPS = 60, 120, 120, 80, 60, 60


def solid(ratio):
    """A half-space of relaxed modulus G and ``ratio`` times that at once, with a retardation time of 1 s."""
    delayed = 1.0 / (1.0 / G - 1.0 / (ratio * G))
    return jc.LayeredHalfSpace([], jc.StandardLinearSolid(ratio * G, delayed, delayed, nu=NU))


def dugdale(tabor):
    return jc.DugdaleAdhesion(WORK, WORK * tabor / REACH)


def indent(body, control, times, n, width, law, **options):
    """Load in units, and the history."""
    grid = jc.Grid.square(n=n, width=width * UNITS.radius)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        history = jc.indent(body, BALL, control, times, grid=grid, adhesion=law, save="last", **options)
    return np.asarray(history.load) / UNITS.load, history


def approach(values):
    return jc.Approach(np.asarray(values) * UNITS.approach)


def retracted(ratio, tabor, dwell, speed, n, width, steps, end):
    """Lowest load of a retraction at a speed [units of approach per retardation time] after a long dwell."""
    path = np.concatenate([[dwell, dwell], np.linspace(dwell, end, steps + 1)[1:]])
    times = np.concatenate([[0.0, DWELL], DWELL + (dwell - path[2:]) / speed])
    loads, history = indent(solid(ratio), approach(path), times, n, width, dugdale(tabor))
    return float(loads.min()), history


def crack(ratio):
    """Effective over true work of adhesion, and v tau over the zone length of the relaxed solid, of a running crack.

    w = s0 int C(c (1 - x)/v) dg_e(x) over a zone of length c, with the opening g_e of an elastic one, whose slope is
    1/2 ln((1 + sqrt x)/(1 - sqrt x)); the relaxed solid around it releases 4 s0^2 c/(pi Einf).
    """
    transit = np.geomspace(1e4, 1e-5, 200)  # c/(v tau)

    def work(transit):
        creep = lambda t: 1.0 / ratio + (1.0 - 1.0 / ratio) * -np.expm1(-t)
        slope = lambda y: creep(transit * (1.0 - y * y)) * np.arctanh(y) * 2.0 * y  # x = y^2
        return 1.0 / quad(slope, 0.0, 1.0, limit=200)[0]

    gain = np.array([work(t) for t in transit])
    return gain, gain / transit


def peeled(ratio, tabor, dwell, speed):
    """Lowest load, in units, of a contact that is relaxed but for its edge, which recedes as a crack."""
    gain, rate = crack(ratio)
    rate = np.log(rate * UNIT_ZONE / tabor**2)
    a = brentq(lambda a: float(maugis.jkr(a)[1]) - dwell, 0.9, 5.0)
    depth, lowest, longest = dwell, 0.0, 2e-4 / speed
    while a > 0.3:
        g = (1.5 * (a * a - depth)) ** 2 / (6.0 * a)  # depth = a^2 - 2/3 sqrt(6 a g)
        lowest = min(lowest, a**3 - a * np.sqrt(6.0 * a * g))
        v = 0.0 if g <= gain[0] else np.exp(np.interp(g, gain, rate)) if g < gain[-1] else 1e12
        step = min(longest, 1e-3 / max(v, 1e-12))
        a, depth = a - v * step, depth - speed * step
    return lowest


def peeled_at_once(ratio, dwell):
    """Lowest load, in units, and its approach, without time to relax: docs/theory.md."""
    slow, quick = 2.0 / E, 2.0 / (ratio * E)
    a1 = brentq(lambda a: float(maugis.jkr(a)[1]) - dwell, 0.9, 9.0) * UNITS.radius
    density = lambda s: 2.0 / (np.pi * slow) * (dwell * UNITS.approach - s**2 / RADIUS)
    drop = lambda a: density(a) + np.sqrt(4.0 * a * WORK / (np.pi * quick))
    whole = lambda a: 2.0 / (np.pi * slow) * (dwell * UNITS.approach * a - a**3 / (3.0 * RADIUS))
    load = lambda a: 2.0 * np.pi * (whole(a) - a * drop(a))
    a = minimize_scalar(load, bounds=(0.05 * a1, a1), method="bounded", options={"xatol": 1e-9 * a1}).x
    return load(a) / UNITS.load, dwell - np.pi * quick / 2.0 * drop(a) / UNITS.approach, a1 / UNITS.radius


def speeds(tabor=3.0, n=128, dwell=1.0):
    print(f"speeds: E0/Einf = 3, Tabor number {tabor:g} of the relaxed solid, {n} cells over 4.5 units")
    found = []
    for speed, steps in zip(SPEEDS, STEPS, strict=True):
        lowest, history = retracted(3.0, tabor, dwell, speed, n, 4.5, steps, -1.7)
        theory = peeled(3.0, tabor, dwell, speed)
        print(
            f"  {speed:7g}: {lowest:8.4f}, published {theory:8.4f}, {100 * (lowest / theory - 1):+.1f} %;"
            f" {float(history.cohesive_cells.min()):.2g} cells, {int(np.sum(history.status != 0))} failed",
            flush=True,
        )
        found.append(lowest)
    limit = peeled_at_once(3.0, dwell)[0]
    print(
        f"  monotonic: {bool(np.all(np.diff(found) < 0.0))}; slowest {found[0] / -1.5 - 1:+.2%} of -1.5;",
        end="",
    )
    print(f" fastest {found[-1] / limit - 1:+.2%} of the limit {limit:.4f}")


def fast(tabor=4.0, ratio=10.0, dwell=4.0):
    print(f"fast: E0/Einf = {ratio:g}, Tabor number {tabor:g} of the relaxed solid")
    lowest, at, a1 = peeled_at_once(ratio, dwell)
    part = np.array([0.3, 0.6, 0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2])
    path = np.concatenate([[dwell, dwell], dwell + (at - dwell) * part])
    times = np.concatenate([[0.0, DWELL], DWELL + 1e-7 * np.arange(1, part.size + 1)])
    for n in (64, 128):
        loads, history = indent(solid(ratio), approach(path), times, n, 2.5 * a1, dugdale(tabor))
        zone = float(history.cohesive_cells[1])
        print(
            f"  {n} cells: {loads.min():.4f}, theory {lowest:.4f}, {100 * (loads.min() / lowest - 1):+.2f} %;"
            f" relaxed zone {zone:.2g} cells, {int(np.sum(history.status != 0))} failed",
            flush=True,
        )


def layered_path(ratio, thickness):
    """Body, reference pull-off load, radius and approaches of a film of ``ratio`` times the modulus of its base."""
    layered = abel.Layered(G, NU, thickness * UNITS.radius, G / ratio, 0.3)
    of = lambda a: abel.adhesive_contact(a * UNITS.radius, layered, RADIUS, WORK)
    a = minimize_scalar(lambda a: of(a).load, bounds=(0.2, 3.0), method="bounded").x
    at, reach = (of(x).approach / UNITS.approach for x in (a, 1.3 * a))
    path = at + (reach - at) * np.array([1.0, 0.6, 0.3, 0.1, 0.05, 0.0, -0.05])
    film = jc.Layer(jc.Elastic(G, NU), thickness * UNITS.radius)
    body = jc.LayeredHalfSpace([film], jc.Elastic(G / ratio, 0.3))
    return body, of(a).load / UNITS.load, a, np.append(max(path[0], 0.2), path)


def layers(tabors=(1.5, 3.0, 5.0), n=128):
    print(f"layers: exponential attraction, {n} cells; thickness in units of radius")
    for ratio in (0.1, 10.0):
        for thickness in (0.3, 1.0, 3.0):
            body, lowest, a, path = layered_path(ratio, thickness)
            off = []
            for tabor in tabors:
                law = jc.ExponentialAdhesion(WORK, REACH / tabor)
                loads, history = indent(
                    body, approach(path), np.arange(path.size * 1.0), n, 3.6 * a, law, max_iterations=1000
                )
                failed = int(np.sum(history.status != 0))
                off.append(
                    f"{100 * (loads.min() / lowest - 1):+.2f} %" + f" ({failed} failed)" * (failed > 0)
                )
            print(
                f"  modulus ratio {ratio:4g}, h/a {thickness / a:.2f}: pull-off {lowest:.4f}; "
                + ", ".join(off)
            )
            sys.stdout.flush()


def iterations(n=128):
    print(f"iterations of 40 steps from an approach of 2 to -0.3 units, {n} cells: median, largest; seconds")
    path = np.linspace(2.0, -0.3, 41)
    grid = jc.Grid.square(n=n, width=5.0 * UNITS.radius)
    for name, law in [("none", None)] + [
        (f"Tabor number {t:g}", jc.ExponentialAdhesion(WORK, REACH / t)) for t in (0.3, 1.0, 3.0, 5.0)
    ]:
        depths = path[path > 0.05] if law is None else path
        run = lambda depths=depths, law=law: jc.indent(
            jc.LayeredHalfSpace([], jc.Elastic(G, NU)), BALL, approach(depths), np.arange(depths.size * 1.0),
            grid=grid, adhesion=law, save="last",
        )  # fmt: skip
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run()
            start = time.perf_counter()
            history = run()
            took = time.perf_counter() - start
        steps = np.asarray(history.iterations)[1:]
        print(
            f"  {name}: {np.median(steps):.0f}, {steps.max()}; {took / depths.size * 1e3:.0f} ms a step",
            flush=True,
        )


def zone(tabor=5.0):
    print("zone: exponential attraction on a half-space, Tabor number 5, down past the lowest load")
    path = np.concatenate([[1.0, 0.3], np.linspace(-0.25, -0.75, 9)])
    for n in (32, 64, 128):
        loads, history = indent(
            jc.LayeredHalfSpace([], jc.Elastic(G, NU)), approach(path), np.arange(path.size * 1.0), n, 4.2,
            jc.ExponentialAdhesion(WORK, REACH / tabor),
        )  # fmt: skip
        print(
            f"  {n} cells, {float(history.cohesive_cells[0]):.2f} across the zone: {loads.min() / -1.5 - 1:+.2%}"
        )


if __name__ == "__main__":
    for name in sys.argv[1:] or ("speeds", "fast", "layers", "iterations", "zone"):
        globals()[name]()
