"""Contacts whose time steps are too long, good, or in between: the cases of the benchmark and the tests of the estimate.

The reference of a case is the same contact with ``FINER`` steps in the place of each.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import jaxcontact as jc

FINER = 64
FAINT = 0.1  # of the largest value: an error is relative to this where the value itself is smaller
GRID = jc.Grid.square(n=24, width=300e-6)
BALL = jc.Sphere(5e-3)
DEPTH = 1e-6
MU = 0.3  # coefficient of friction in ``shear``


@dataclass(frozen=True)
class Case:
    """A contact over time; load or approach: the control, at the times [s]; push: the tangential one of ``shear``."""

    name: str
    body: Any
    times: Any
    load: Any = None
    approach: Any = None
    indenter: Any = BALL
    velocity: Any = 0.0
    push: Any = None

    def run(self, **more):
        """Return its history."""
        control = jc.Load(self.load) if self.approach is None else jc.Approach(self.approach)
        given = self.body, self.indenter, control, self.times
        if self.push is not None:
            grid, more = jc.Grid.square(n=20, width=240e-6), more | {"friction": MU, "coupled": False}
            return jc.shear(*given[:3], self.push, self.times, grid=grid, tolerance=1e-7, **more)
        if np.any(self.velocity):
            return jc.slide(*given, velocity=self.velocity, grid=GRID, **more)
        return jc.indent(*given, grid=GRID, **more)

    def by(self, factor):
        """Return the case with the control times a factor."""
        times = lambda value: None if value is None else factor * value
        return replace(self, load=times(self.load), approach=times(self.approach))


def solid(ratio, retardation=1.0, modulus=1e9):
    """A standard solid of a ratio E0/Einf."""
    return jc.StandardLinearSolid(
        modulus, modulus / (ratio - 1.0), modulus / (ratio - 1.0) * retardation, 0.3
    )


def half_space(material):
    return jc.LayeredHalfSpace([], substrate=material)


def film(material, thickness=20e-6):
    return jc.LayeredHalfSpace([jc.Layer(material, thickness=thickness)], jc.Elastic(80e9, 0.3))


def spaced(first, last, n):
    return np.concatenate([[0.0], np.geomspace(first, last, n)])


def cases():
    """Yield the cases."""
    maxwell, slow = jc.Maxwell(5e8, 1e9, 0.4), jc.Maxwell(5e8, 1e10, 0.4)
    burgers = jc.Burgers(1e9, 2.5e8, 5e10, 2.5e8, 0.3)
    prony = jc.Prony(1e-9, np.array([1e-9, 2e-9, 4e-9]), np.array([0.1, 3.0, 100.0]), 0.4)
    stiff = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(5e9, 0.3), thickness=5e-6)], substrate=solid(5.0))
    ten, two, three, hundred = (half_space(solid(ratio)) for ratio in (10.0, 2.0, 3.0, 100.0))
    even = lambda last, n: np.linspace(0.0, last, n)
    ramp = even(2.0, 11)
    triangle = np.where(ramp < 1.0, ramp, 2.0 - ramp)
    fine, wave = even(2.0, 41), even(20.0, 41)
    hold = np.array([0.0, 0.5, 1.0, 2.0, 5.0, 10.0])
    yield Case("solid 10, 0 and 10 s, approach", ten, [0.0, 10.0], approach=DEPTH)
    yield Case("solid 10, 0 and 100 s, approach", ten, [0.0, 100.0], approach=DEPTH)
    yield Case("solid 10, 0, 3, 10, 100 s, approach", ten, [0.0, 3.0, 10.0, 100.0], approach=DEPTH)
    yield Case("solid 10, 7 geometric, approach", ten, spaced(0.01, 10.0, 7), approach=DEPTH)
    yield Case("solid 10, 16 geometric, approach", ten, spaced(0.01, 10.0, 16), approach=DEPTH)
    yield Case("solid 10, 41 geometric, approach", ten, spaced(0.01, 10.0, 40), approach=DEPTH)
    yield Case("solid 10, 11 even, approach", ten, even(10.0, 11), approach=DEPTH)
    yield Case("solid 100, 16 geometric, approach", hundred, spaced(1e-3, 10.0, 16), approach=DEPTH)
    yield Case("solid 2, 0 and 1 s, approach", two, [0.0, 1.0], approach=DEPTH)
    yield Case("solid 2, 5 even, approach", two, even(3.0, 5), approach=DEPTH)
    yield Case("solid 2, 11 even, approach", two, even(3.0, 11), approach=DEPTH)
    yield Case("solid 10, 0 and 10 s, load", ten, [0.0, 10.0], load=0.2)
    yield Case("solid 10, 0 and 1 s, load", ten, [0.0, 1.0], load=0.2)
    yield Case("solid 10, 16 geometric, load", ten, spaced(0.01, 10.0, 16), load=0.2)
    yield Case("solid 10, 11 even, load", ten, even(10.0, 11), load=0.2)
    yield Case("solid 2, 11 even, load", two, even(3.0, 11), load=0.5)
    yield Case("solid 10, ramp of approach", ten, ramp, approach=DEPTH * ramp / 2.0)
    yield Case("solid 10, fine ramp of approach", ten, fine, approach=DEPTH * fine / 2.0)
    yield Case("solid 10, ramp of load", ten, ramp, load=0.1 * ramp)
    yield Case("solid 2, triangle of approach", two, ramp, approach=DEPTH * triangle)
    yield Case("solid 2, triangle of load", two, ramp, load=0.5 * triangle + 0.01)
    yield Case("solid 10, ramp and hold, load", ten, hold, load=0.2 * np.minimum(hold, 1.0))
    yield Case("solid 10, ramp and hold, approach", ten, wave, approach=DEPTH * np.minimum(wave / 10.0, 1.0))
    yield Case("solid 10, oscillation of load", ten, wave, load=0.15 + 0.05 * np.sin(wave))
    yield Case("solid 3, oscillation of approach", three, wave, approach=DEPTH * (1.0 + 0.3 * np.sin(wave)))
    yield Case("Maxwell film, 0 and 1 s, approach", film(maxwell), [0.0, 1.0], approach=DEPTH / 3.0)
    yield Case("Maxwell film, 0 and 1 s, load", film(maxwell), [0.0, 1.0], load=1.0)
    yield Case(
        "Maxwell film, 10 geometric, approach", film(maxwell), spaced(0.03, 30.0, 10), approach=DEPTH / 3.0
    )
    yield Case("film of solid 10, 0 and 3 s, load", film(solid(10.0)), [0.0, 3.0], load=1.0)
    yield Case("film of solid 10, 5 even, approach", film(solid(10.0)), even(3.0, 5), approach=DEPTH / 3.0)
    yield Case("Maxwell, 9 even, load", half_space(slow), even(40.0, 9), load=0.2)
    yield Case("Maxwell, 9 even, approach", half_space(slow), even(60.0, 9), approach=DEPTH)
    yield Case("Burgers, 11 even, approach", half_space(burgers), even(50.0, 11), approach=DEPTH)
    yield Case("Burgers, 11 even, load", half_space(burgers), even(50.0, 11), load=0.1)
    yield Case("Prony, 6 geometric, approach", half_space(prony), spaced(0.1, 300.0, 6), approach=DEPTH)
    yield Case("Prony, 12 geometric, approach", half_space(prony), spaced(0.1, 300.0, 12), approach=DEPTH)
    yield Case("stiff film on solid 5, 6 even, approach", stiff, even(5.0, 6), approach=DEPTH)
    yield Case("stiff film on solid 5, 3 even, load", stiff, even(5.0, 3), load=0.5)


COURSES = ("hold", "grow", "ramp and hold", "triangle", "oscillate", "shrink", "quick")


def random_case(seed):
    """Return a contact at nine times, drawn with a seed: body, indenter, control and times."""
    draw = np.random.default_rng(seed)
    power = lambda low, high: float(10.0 ** draw.uniform(low, high))
    kind, place = (
        draw.choice(["solid", "solid", "Burgers", "Maxwell", "Prony"]),
        draw.choice(["half"] * 7 + ["film"] * 3),
    )
    if kind == "solid" or place == "film":
        ratio = power(np.log10(1.5), np.log10(30.0))
        kind, material = f"solid {ratio:.1f}", solid(ratio)
    elif kind == "Burgers":
        material = jc.Burgers(1e9, power(8.0, 9.0), power(9.3, 11.0), power(8.0, 9.0), 0.3)
    elif kind == "Maxwell":
        material = jc.Maxwell(1e9, power(8.7, 9.7), 0.4)
    else:
        material = jc.Prony(1e-9, 10.0 ** draw.uniform(-9.3, -8.0, 3), np.array([0.1, 1.0, 10.0]), 0.4)
    body = (
        half_space(material)
        if place == "half"
        else film(material, float(draw.choice([10e-6, 30e-6, 100e-6])))
    )
    shape = draw.choice(["ball", "ball", "ball", "cone", "punch"])
    indenter = {"ball": BALL, "cone": jc.Cone(np.pi / 2.0 - 0.0127), "punch": jc.FlatPunch(60e-6)}[shape]
    last, course = power(-0.7, 1.3), draw.choice(COURSES)
    times, s = np.linspace(0.0, last, 9), np.linspace(0.0, 1.0, 9)
    if course == "hold" or (course == "quick" and draw.random() < 0.5):
        times = spaced(last / power(1.0, 2.5), last, 8)
    values = {
        "hold": np.ones(9),
        "grow": s if draw.random() < 0.5 else 0.05 + 0.95 * s,
        "ramp and hold": np.minimum(1.0, 2.5 * s),
        "triangle": 1.05 - np.abs(2.0 * s - 1.0),
        "oscillate": 1.0 + draw.uniform(0.1, 0.8) * np.sin(draw.uniform(3.0, 12.0) * s),
        "shrink": 1.0 - 0.9 * s,
        "quick": 10.0 ** draw.uniform(-2.0, 0.0, 9),
    }[course]
    values, loaded = values / values.max(), bool(draw.random() < 0.55)
    velocity = power(-6.0, -4.0) if draw.random() < 0.1 and place == "half" and shape != "punch" else 0.0
    name = f"{seed}: {kind}, {place}, {shape}, {course}, {'load' if loaded else 'approach'}, {last:.2g} s"
    control = {"load": 0.2 * values} if loaded else {"approach": 1.2e-6 * values}
    case = Case(
        name + (", slides" if velocity else ""), body, times, indenter=indenter, velocity=velocity, **control
    )
    if shape == "punch":
        return case
    # the control that gives a radius of contact of five to nine cells
    wanted = draw.uniform(60e-6, 115e-6)
    for _ in range(6):
        radius = float(np.sqrt(np.max(case.run().contact_area) / np.pi))
        if 0.9 < radius / wanted < 1.1:
            break
        grown = (wanted / max(radius, 10e-6)) ** (3 if loaded else 2)
        case = case.by(float(np.clip(grown, 0.05, 20.0)))
    return case


def swaying_case(seed):
    """Return a slide whose velocity changes, in nine times, drawn with a seed."""
    draw = np.random.default_rng(seed)
    ratio, loaded = float(10.0 ** draw.uniform(np.log10(1.5), 1.0)), bool(draw.random() < 0.55)
    where = half_space if draw.random() < 0.7 else film
    last = float(10.0 ** draw.uniform(-0.5, 1.0))
    times, s = np.linspace(0.0, last, 9), np.linspace(0.0, 1.0, 9)
    way = 90e-6 * 10.0 ** draw.uniform(-1.0, 0.3)  # in a step; the contacts have radii of about 70 um
    speed = way * 8 / last
    course = draw.choice(["reverse", "oscillate", "random", "speed up", "turn"])
    along = {
        "reverse": np.where(s < draw.uniform(0.2, 0.8), 1.0, -1.0),
        "oscillate": np.sin(draw.uniform(3.0, 15.0) * s + draw.uniform(0.0, 6.0)),
        "random": draw.uniform(-1.0, 1.0, 9),
        "speed up": s**2,
        "turn": np.cos(draw.uniform(2.0, 9.0) * s),
    }[course]
    across = {"turn": np.sin(draw.uniform(2.0, 9.0) * s), "random": draw.uniform(-1.0, 1.0, 9)}.get(
        course, 0.0 * s
    )
    velocity = speed * np.stack([along, across], 1)
    place = np.concatenate([[[0.0, 0.0]], np.cumsum((velocity[1:] + velocity[:-1]) / 2.0, 0) * last / 8])
    velocity = velocity * min(1.0, 100e-6 / np.max(np.abs(place)))  # what has been passed stays on the grid
    control = {"load": 0.15 * np.ones(9)} if loaded else {"approach": 0.7e-6 * np.ones(9)}
    name = f"{seed}: solid {ratio:.1f}, {where.__name__}, {course}, {'load' if loaded else 'approach'}, {last:.2g} s"
    return Case(name, where(solid(ratio)), times, velocity=velocity, **control)


def sheared_case(seed):
    """Return a contact in partial slip at nine times, drawn with a seed."""
    draw = np.random.default_rng(seed)
    power, last = (
        lambda low, high: float(10.0 ** draw.uniform(low, high)),
        float(10.0 ** draw.uniform(-0.7, 1.0)),
    )
    kind, where = draw.choice(["solid", "Burgers"]), half_space if draw.random() < 0.5 else film
    material = solid(power(np.log10(1.5), np.log10(20.0)))
    if kind == "Burgers":
        material = jc.Burgers(1e9, power(8.3, 9.0), power(9.5, 11.0), power(8.0, 9.0), 0.3)
    normal = draw.choice(["hold", "ramp and hold", "grow"])
    course = draw.choice(["ramp", "hold", "step and hold", "oscillate"])
    times, s = np.linspace(0.0, last, 9), np.linspace(0.0, 1.0, 9)
    values = {"hold": np.ones(9), "ramp and hold": np.minimum(1.0, 0.2 + 2.0 * s), "grow": 0.3 + 0.7 * s}[
        normal
    ]
    along = {
        "ramp": s,
        "hold": np.ones(9),
        "step and hold": np.where(s > 0.3, 1.0, 0.0),
        "oscillate": np.sin(draw.uniform(3.0, 9.0) * s),
    }[course]
    loaded, pushed, size = bool(draw.random() < 0.5), bool(draw.random() < 0.5), draw.uniform(0.2, 0.6)
    control = {"load": 0.2 * values} if loaded else {"approach": 0.7e-6 * values}
    vector = np.stack([size * along, 0.0 * along], 1)
    push = jc.TangentialDisplacement(0.5e-6 * vector)
    if pushed:  # within friction at all times, of a contact that relaxes too
        push = jc.TangentialLoad(MU * 0.2 * vector * (values if loaded else 0.2 * values**1.5)[:, None])
    name = f"{seed}: {kind}, {where.__name__}, {normal} {'load' if loaded else 'approach'}, {course}"
    name += f" {'load' if pushed else 'displacement'}, {last:.2g} s"
    return Case(name, where(material), times, push=push, **control)


def error_of_totals(coarse, fine):
    """Return the largest error of tangential load and displacement over time, over the largest value of each."""
    pairs = [
        (getattr(run, name) for run in (coarse, fine))
        for name in ("tangential_load", "tangential_displacement")
    ]
    return max(float(np.max(np.abs(a - b)) / np.max(np.abs(b))) for a, b in pairs)


def error_of_traction(coarse, fine):
    """Return the largest error of the traction of any cell and time, over friction times the largest pressure then."""
    off, peak = np.max(np.abs(coarse.traction - fine.traction), (1, 2, 3)), np.asarray(fine.peak_pressure)
    return float(np.max(off / (MU * np.maximum(peak, FAINT * np.max(peak)))))


def largest_error(coarse, fine):
    """Return the largest error of the pressure of any cell and time, over the largest pressure at that time."""
    off, peak = np.max(np.abs(coarse.pressure - fine.pressure), (1, 2)), np.asarray(fine.peak_pressure)
    return float(np.max(off / np.maximum(peak, FAINT * np.max(peak))))


def true_error(coarse, fine):
    """Return the largest relative error of approach and load, or of the pressure of any cell."""
    pairs = (coarse.approach, fine.approach), (coarse.load, fine.load)
    off = lambda a, b: np.max(np.abs(a - b) / np.maximum(np.abs(b), FAINT * np.max(np.abs(b))))
    return max(largest_error(coarse, fine), *(off(np.asarray(a), np.asarray(b)) for a, b in pairs))


def reference(case):
    """Return the history with short steps."""
    return case.run(substeps=FINER)
