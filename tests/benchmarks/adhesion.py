"""Adhesive contacts against closed forms and published theories.

python -m tests.benchmarks.adhesion [speeds] [fast] [layers] [iterations] [resolved] [zone]

speeds: pull-off load over five decades of retraction speed after a long dwell on a standard linear solid with E0/Einf = 3.
    Published theories: see ``tests.support.peeling``.
fast: the limit of high speeds for E0/Einf = 10.
layers: pull-off load on films against the theory of Johnson, Kendall and Roberts on layers, at three Tabor numbers.
iterations: iterations of a step with adhesion over those of the same step without; resolved: on a grid with three cells
    across the zone of attraction at a Tabor number of 5.
zone: pull-off load of an elastic half-space at a Tabor number of 5 over the cells across the zone of attraction.
"""

import sys
import time
import warnings

import numpy as np
from scipy.optimize import minimize_scalar

import jaxcontact as jc
from jaxcontact.reference import abel
from tests.support.peeling import (
    BALL,
    DWELL,
    NU,
    RADIUS,
    REACH,
    UNITS,
    WORK,
    G,
    approaching,
    dugdale,
    indent,
    peeled,
    peeled_at_once,
    retracted,
    solid,
)

SPEEDS = 1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0  # units of approach per relaxation time
STEPS = 60, 120, 120, 80, 60, 60


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
        loads, history = indent(solid(ratio), approaching(path), times, n, 2.5 * a1, dugdale(tabor))
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
                    body, approaching(path), np.arange(path.size * 1.0), n, 3.6 * a, law, max_iterations=1000
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


def resolved():
    iterations(384, 2.9, 0.35, 12)


def iterations(n=128, width=5.0, top=2.0, steps=40):
    print(
        f"iterations of {steps} steps from an approach of {top:g} to -0.3 units, {n} cells: median, largest; seconds"
    )
    path = np.linspace(top, -0.3, steps + 1)
    grid = jc.Grid.square(n=n, width=width * UNITS.radius)
    for name, law in [("none", None)] + [
        (f"Tabor number {t:g}", jc.ExponentialAdhesion(WORK, REACH / t)) for t in (0.3, 1.0, 3.0, 5.0)
    ]:
        depths = path[path > 0.05] if law is None else path
        run = lambda depths=depths, law=law: jc.indent(
            jc.LayeredHalfSpace([], jc.Elastic(G, NU)), BALL, approaching(depths), np.arange(depths.size * 1.0),
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
            jc.LayeredHalfSpace([], jc.Elastic(G, NU)), approaching(path), np.arange(path.size * 1.0), n, 4.2,
            jc.ExponentialAdhesion(WORK, REACH / tabor),
        )  # fmt: skip
        print(
            f"  {n} cells, {float(history.cohesive_cells[0]):.2f} across the zone: {loads.min() / -1.5 - 1:+.2%}"
        )


if __name__ == "__main__":
    for name in sys.argv[1:] or ("speeds", "fast", "layers", "iterations", "resolved", "zone"):
        globals()[name]()
