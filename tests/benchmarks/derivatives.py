"""Derivatives of every verb by every leaf of its arguments: forward and reverse mode, and central differences.

    python -m tests.benchmarks.derivatives [SCENARIO ...] [--leaves]

A scenario is a verb with its arguments. Its leaves are found by flattening these, so that none is forgotten: a number is
changed in proportion to itself, each entry of a short array in proportion to its largest, and a long array (heights, maps,
fields) in two directions, a smooth one and an uneven one. Each field of the result is a term of its own: a sum over its
entries with fixed unequal weights, each entry divided by its own size plus a tenth of the mean one, so that small entries
count as large ones do. Contacts are solved to ``tolerance=1e-11``. Differences are relative to the entry or to a thousandth
of the term's largest. Of three steps, and of differences of fourth and sixth order, the central difference that is
closest counts: long steps suffer from truncation, above all of the contact area, whose slope changes within a thousandth
where a cell is near the edge, and short ones from what the solver and the separation in time leave (1e-10 of a displacement
on a film, so that a step of 1e-5 leaves 1e-5 of it; 5e-10 where film and base both creep, whatever the tolerance of the
solver). Where all of them are off by more than is allowed, the slopes of polynomials by least squares count as well, of
degree 7 through 41 values within 2 % and within 0.04 %: they have an eighth of the noise at a step of 1e-3 and six tenths
of that at 1e-4, without their truncation. Grids have an odd number of cells, so that no two cells share the peak.

Leaves on which a result does not depend are listed in the scenario, with the reason; any other leaf must have a derivative
that is not zero. Fields without a derivative by definition are those of ``NO_DERIVATIVE``.
"""

import argparse
import dataclasses
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from jaxcontact._compile.programs import compiler_options
from jaxcontact._support.fields import FIELDS, INSIDE

LONG, STEPS = 2e-3, (1e-3, 1e-4, 1e-5)
SIXTH = 2e-2  # step of the difference of sixth order, which takes three of them: for what is smooth, but not accurate
FLOOR = 1e-3  # of a term's largest derivative: smaller ones are compared with this
WITHIN, VALUES, DEGREE = (2e-2, 4e-4), 41, 7  # polynomials through many values: for what is noisy
BOUND = 1e-5  # the largest difference between a derivative and its central difference,
MODES = 1e-6  # and between the modes
SHORT = 8  # entries: of longer arrays two directions are taken
ACCURATE = {"tolerance": 1e-11}

NO_DERIVATIVE = {
    "contact_area": "a number of cells",
    "sticking_share": "a ratio of numbers of cells",
    "cohesive_cells": "a report on the grid",
    "tabor_number": "a report on the regime",
    "error": "an error of the solver",
    "step_error": "an estimate of an error",
    "time_step_error": "an estimate of an error",
    "truncation_bound": "an estimate of an error",
    "response_error": "an estimate of an error",
    "jump_energy": "the sum over jumps, held in derivatives",
    "viscous_energy": "a balance that includes the jumps, held in derivatives",
    "stored_energy": "held in derivatives",
}
NO_EFFECT = "does not enter: "


class Scenario(NamedTuple):
    """A verb, its differentiated and its fixed arguments; constant: leaves without effect and why; bound and
    modes: where they are wider than ``BOUND`` and ``MODES``, with the reason beside them."""

    verb: Callable[..., Any]
    leaves: dict[str, Any]
    fixed: dict[str, Any]
    constant: dict[str, str] = {}  # noqa: RUF012
    bound: float = BOUND
    modes: float = MODES


def terms_of(result: Any) -> dict[str, jax.Array]:
    """Return the fields of a result that have a derivative, by name."""
    if isinstance(result, tuple) and not hasattr(result, "_fields"):
        return {f"[{i}]": value for i, value in enumerate(result)}
    if not dataclasses.is_dataclass(result):
        return {"result": result}
    declared = INSIDE if hasattr(result, "depths") else FIELDS
    names = [n for n in declared if n not in NO_DERIVATIVE and not n.endswith("_line") and hasattr(result, n)]
    values = {name: getattr(result, name) for name in names}
    return {
        name: value
        for name, value in values.items()
        if value is not None and jnp.issubdtype(jnp.asarray(value).dtype, jnp.floating)
    }


class Direction(NamedTuple):
    """A change of one leaf: its name, the number of the leaf, and the change by which q = 1 moves it."""

    name: str
    leaf: int
    change: np.ndarray


def directions(leaves: Any) -> list[Direction]:
    """Return the changes of all leaves of a tree."""
    found = []
    for number, (path, leaf) in enumerate(jax.tree_util.tree_flatten_with_path(leaves)[0]):
        name = jax.tree_util.keystr(path).replace("['", "", 1).replace("']", "", 1)
        value = np.asarray(leaf, float)
        largest = np.max(np.abs(value)) or 1.0
        if value.ndim == 0:
            found.append(Direction(name, number, np.asarray(value if value else 1.0)))
        elif value.size <= SHORT:
            for index in np.ndindex(value.shape):
                change = np.zeros(value.shape)
                change[index] = largest
                found.append(Direction(f"{name}[{', '.join(map(str, index))}]", number, change))
        else:
            places = np.meshgrid(*(np.linspace(-1.0, 1.0, n) for n in value.shape), indexing="ij")
            smooth = 0.1 * largest * np.cos(sum((1.3 + 0.4 * i) * x for i, x in enumerate(places)) + 0.3)
            uneven = 0.01 * largest * np.random.default_rng(7).uniform(-1.0, 1.0, value.shape)
            # what is the same all along the track is changed all along it
            even = [i for i in range(value.ndim) if np.all(np.ptp(value, axis=i) == 0.0)]
            if len(even) < value.ndim:
                for i in even:
                    smooth = np.broadcast_to(smooth.take([0], i), value.shape)
                    uneven = np.broadcast_to(uneven.take([0], i), value.shape)
            found += [
                Direction(f"{name} smooth", number, smooth),
                Direction(f"{name} uneven", number, uneven),
            ]
    return found


class Table(NamedTuple):
    """Derivatives of terms (m,) by leaves (n,), each (m, n), and the differences of each by size."""

    terms: list[str]
    leaves: list[str]
    forward: np.ndarray
    between_modes: np.ndarray
    from_differences: np.ndarray
    status: np.ndarray
    seconds: float

    def worst(self, differences: np.ndarray) -> str:
        i, j = np.unravel_index(np.nanargmax(differences), differences.shape)
        return f"{differences[i, j]:.0e} ({self.terms[i]} by {self.leaves[j]})"


def measured(scenario: Scenario) -> Table:
    """Differentiate a scenario in both modes and by central differences."""
    began = time.process_time()
    flat, tree = jax.tree.flatten(scenario.leaves)
    flat, changes = [jnp.asarray(leaf, float) for leaf in flat], directions(scenario.leaves)

    def solved(q: jax.Array) -> tuple[dict[str, jax.Array], jax.Array]:
        moved = list(flat)
        for each, amount in zip(changes, q, strict=True):
            moved[each.leaf] = moved[each.leaf] + amount * each.change
        result = scenario.verb(**jax.tree.unflatten(tree, moved), **scenario.fixed)
        return terms_of(result), jnp.asarray(getattr(result, "status", 0))

    # runs take a hundredth of the time of their compilation
    compiled = partial(jax.jit, compiler_options=compiler_options(optimised=False))
    at, run = jnp.zeros(len(changes)), compiled(solved)
    values, status = run(at)
    weights = {}
    for name, value in values.items():
        size = np.abs(np.asarray(value))
        mean = np.mean(size) or 1.0
        uneven = 1.5 + np.cos(0.7 * np.arange(size.size) + 0.3).reshape(size.shape)
        weights[name] = uneven / (size + 0.1 * mean) / size.size

    def weighted(found: dict[str, jax.Array]) -> jax.Array:
        return jnp.stack([jnp.sum(weight * found[name]) for name, weight in weights.items()])

    def outputs(q: jax.Array) -> jax.Array:
        return weighted(solved(q)[0])

    # one direction and one term at a time: what is batched takes twice as long to compile
    along = compiled(lambda change: jax.jvp(outputs, (at,), (change,))[1])
    back = compiled(lambda weights: jax.vjp(outputs, at)[1](weights)[0])
    at_change = lambda q: np.asarray(weighted(run(q)[0]))
    forward = np.stack([np.asarray(along(each)) for each in jnp.eye(at.size)], 1)
    reverse = np.stack([np.asarray(back(each)) for each in jnp.eye(len(values))])
    size = np.maximum(np.abs(forward), FLOOR * np.max(np.abs(forward), 1, keepdims=True))
    size = np.where(size > 0.0, size, 1.0)
    slopes = {}
    for step in (LONG, *STEPS, SIXTH, 2.0 * SIXTH, 3.0 * SIXTH):
        ways = [at_change(at.at[i].add(step)) - at_change(at.at[i].add(-step)) for i in range(at.size)]
        slopes[step] = np.stack(ways, 1) / (2.0 * step)
    tried = [slopes[step] for step in STEPS]
    # of fourth and of sixth order
    tried.append((4.0 * slopes[STEPS[0]] - slopes[LONG]) / 3.0)
    tried.append((15.0 * slopes[SIXTH] - 6.0 * slopes[2.0 * SIXTH] + slopes[3.0 * SIXTH]) / 10.0)
    # the longest steps are nan where they leave the range of a leaf
    nearest = np.fmin.reduce([np.abs(each - forward) / size for each in tried])
    for i in np.flatnonzero(np.any(~(nearest < scenario.bound), 0)):
        for reach in WITHIN:
            places = np.linspace(-1.0, 1.0, VALUES)
            along_it = np.stack([at_change(at.at[i].add(reach * place)) for place in places])
            slope = np.polynomial.polynomial.polyfit(places, np.nan_to_num(along_it), DEGREE)[1] / reach
            slope[np.any(~np.isfinite(along_it), 0)] = np.nan
            nearest[:, i] = np.fmin(nearest[:, i], np.abs(slope - forward[:, i]) / size[:, i])
    names = [each.name for each in changes]
    between = np.abs(reverse - forward) / size
    spent = time.process_time() - began
    return Table(list(values), names, forward, between, nearest, np.asarray(status), spent)


def faults(scenario: Scenario, table: Table) -> list[str]:
    """Return what is wrong with a table, nothing where it agrees."""
    found = []
    for kind, differences, bound in (
        ("modes", table.between_modes, scenario.modes),
        ("central difference", table.from_differences, scenario.bound),
    ):
        for i, j in np.argwhere(~(differences < bound)):
            found.append(
                f"{kind}: {table.terms[i]} by {table.leaves[j]} {differences[i, j]:.1e}, is {table.forward[i, j]:.4g}"
            )
    still = {name for name, column in zip(table.leaves, table.forward.T, strict=True) if not np.any(column)}
    expected = {
        name for name in table.leaves if any(name == c or name.startswith(c) for c in scenario.constant)
    }
    found += [f"no derivative by {name}" for name in sorted(still - expected)]
    found += [f"a derivative by {name}, which is listed as without" for name in sorted(expected - still)]
    if np.any(table.status):
        found.append(f"status {np.unique(table.status)}")
    return found


# ---- the scenarios ------------------------------------------------------------------------------------------------------

BODY, LAYER, STEEL = jc.LayeredHalfSpace, jc.Layer, jc.Elastic(80e9, 0.3)
SLS = jc.StandardLinearSolid(1e9, 0.6e9, 12e9, nu=0.4)
SOFT = jc.StandardLinearSolid(2e9, 1e9, 40e9, nu=0.35)
BURGERS = jc.Burgers(G1=1e9, G2=0.8e9, eta1=60e9, eta2=8e9, nu=0.38)
RUBBER = jc.StandardLinearSolid(1e6, 1e6, 1e6, nu=0.48)
BALL = jc.Sphere(5e-3, jc.Elastic(60e9, 0.25))
TIMES = np.array([0.0, 8.0, 20.0])
GRID = jc.Grid((15, 13), (13e-6, 15e-6))
LINE = jc.Grid((21, 1), (9e-6, 1e-3), periodic=(False, True))
WAVES = jc.Grid((12, 10), (10e-6, 11e-6), periodic=(True, True))
AT_ONCE = np.zeros(1)
AS_LONG = {"indenter.length": NO_EFFECT + "it is the length of the grid"}


def bumps(grid: jc.Grid, depth: float, radius: float | None = None) -> np.ndarray:
    """Return heights (nx, ny) [m]: waves without symmetry, on a ball or not."""
    x, y = (np.asarray(a) for a in grid.coordinates())
    wide, long = (float(w) for w in grid.width)
    across = 1.0 + 0.5 * np.cos(2 * np.pi * y / long - 0.3)
    waves = depth * (np.cos(2 * np.pi * x / wide + 0.4) * across + 0.3 * np.sin(4 * np.pi * x / wide))
    return waves if radius is None else waves - (x**2 + y**2) / (2 * radius)


def uneven_film(grid: jc.Grid, thickness: float) -> np.ndarray:
    """Return a thickness (nx, ny) [m] that varies by a fifth."""
    x, y = (np.asarray(a) for a in grid.coordinates())
    return thickness * (1.0 + 0.2 * np.cos(x / 70e-6 + 0.3) * np.cos(y / 80e-6))


def hill(grid: jc.Grid, size: float) -> np.ndarray:
    """Return a field (nx, ny) with one smooth, unsymmetric hill that vanishes nowhere."""
    x, y = (np.asarray(a) for a in grid.coordinates())
    a, b = (float(w) / 4 for w in grid.width)
    return size * (0.05 + np.exp(-((x - 0.2 * a) ** 2) / a**2 - (y + 0.1 * b) ** 2 / b**2))


def pressed(
    body: Any, control: Any, indenter: Any = BALL, grid: jc.Grid = GRID, times: Any = TIMES, **more: Any
) -> Any:
    """Return the leaves of an indentation."""
    return {"body": body, "indenter": indenter, "control": control, "times": times, "grid": grid, **more}


def in_a_plane(verb: Callable[..., Any]) -> Callable[..., Any]:
    """Return a verb under a cylinder as long as the grid, as it has to be: its length is that of the spacing along y."""

    def solved(*, indenter: Any, grid: jc.Grid, **given: Any) -> Any:
        return verb(indenter=dataclasses.replace(indenter, length=grid.width[1]), grid=grid, **given)

    return solved


def series_indented(*, body: Any, **given: Any) -> Any:
    """``indent`` of a half-space of a fractional law, by the series of its retardation times."""
    return jc.indent(BODY([], body.prony(1.0, 40.0)), **given)


RISING = jc.Load(np.array([0.6, 1.0, 0.9]) * 0.12)
FALL = jc.Approach(np.array([0.9, 1.2, 1.1]) * 0.6e-6)
ARCHARD = jc.Archard(5e-14)
GROWTH = jc.StressActivated(rate=0.001, activation_energy=1.0e-19, activation_volume=2e-28, temperature=373.0)

SCENARIOS: dict[str, Scenario] = {
    # ---- indent
    "indent, creeping film on a creeping base": Scenario(
        jc.indent, pressed(BODY([LAYER(SLS, 6e-6)], SOFT), RISING), ACCURATE,
        # the displacement by the thickness of the film, 0.006 of itself: the operators of the delayed response alone, under
        # a fixed pressure, have derivatives by it that differ by 1e-9 to 1e-8 of the displacement (at once by 1e-13)
        modes=5e-6,
    ),
    "indent, approach, elastic film on a Maxwell half-space": Scenario(
        jc.indent, pressed(BODY([LAYER(jc.Elastic(3e9, 0.3), 20e-6)], jc.Maxwell(2e9, 400e9, 0.4)), FALL), ACCURATE,
        # loads after the first have a noise of 5e-7, also where the spacing alone changes (the first: 1e-14): it is that of
        # the operators of the delayed response, and central differences end at it
        bound=1e-2, modes=1e-3,
    ),
    "indent, film whose thickness changes with time": Scenario(
        jc.indent, pressed(BODY([LAYER(BURGERS, np.array([6e-6, 7e-6, 6.5e-6]))], STEEL), RISING), ACCURATE
    ),
    "indent, thickness map under a rough ball": Scenario(
        jc.indent,
        pressed(BODY([LAYER(SLS, uneven_film(GRID, 8e-6))], STEEL), RISING,
                jc.HeightField(bumps(GRID, 2e-8, 5e-3), STEEL)),
        ACCURATE,
    ),
    "indent, thickness map that changes with time": Scenario(
        jc.indent,
        pressed(BODY([LAYER(SLS, uneven_film(GRID, 8e-6) * np.array([1.0, 1.1, 1.05])[:, None, None])], STEEL), RISING),
        ACCURATE,
    ),
    "indent, periodic and rough": Scenario(
        jc.indent,
        pressed(BODY([], SOFT), jc.Load(np.array([0.06, 0.1, 0.09])), jc.HeightField(bumps(WAVES, 2e-7), STEEL), WAVES),
        ACCURATE,
    ),
    "indent, periodic film": Scenario(
        jc.indent,
        pressed(BODY([LAYER(SLS, 6e-6)], STEEL), jc.Load(np.array([0.2, 0.3, 0.25])),
                jc.HeightField(bumps(WAVES, 2e-7), STEEL), WAVES),
        ACCURATE,
    ),
    "indent, plane strain": Scenario(
        in_a_plane(jc.indent),
        pressed(BODY([LAYER(SLS, 12e-6)], SOFT), jc.Load(np.array([0.5, 0.9, 0.8])),
                jc.Cylinder(5e-3, 1e-3, STEEL), LINE),
        ACCURATE,
        AS_LONG,
        # the displacement by the thickness; not by the tolerance of the systems of derivatives, of which it is independent
        modes=3e-6,
    ),
    "indent, bulk modulus": Scenario(
        jc.indent,
        pressed(BODY([LAYER(jc.Burgers(1e9, 0.8e9, 60e9, 8e9, bulk_modulus=4e9), 8e-6)], STEEL), RISING),
        ACCURATE,
    ),
    "indent, bulk modulus of a half-space": Scenario(
        jc.indent,
        pressed(BODY([], jc.StandardLinearSolid(2e9, 1e9, 40e9, bulk_modulus=6e9)), RISING),
        ACCURATE,
    ),
    "indent, Prony series": Scenario(
        jc.indent,
        pressed(BODY([LAYER(jc.Prony(1e-9, np.array([0.6e-9, 0.8e-9]), np.array([3.0, 30.0]), 0.4, 1e-12), 8e-6)],
                     STEEL), RISING),
        ACCURATE,
    ),
    "indent, quasi-elastic": Scenario(
        jc.indent, pressed(BODY([LAYER(BURGERS, 8e-6)], STEEL), RISING), ACCURATE | {"correspondence": "quasi-elastic"}
    ),
    "indent, exponential adhesion": Scenario(
        jc.indent,
        pressed(BODY([], RUBBER), jc.Load(np.array([1e-4, 2e-4, 1.5e-4])), jc.Sphere(2e-3),
                jc.Grid((17, 15), (19e-6, 21e-6)), np.array([0.0, 0.3, 0.7]),
                adhesion=jc.ExponentialAdhesion(20e-3, 0.5e-6)),
        ACCURATE,
    ),
    "indent, Dugdale adhesion": Scenario(
        jc.indent,
        pressed(BODY([], RUBBER), jc.Load(np.array([1e-4, 2e-4, 1.5e-4])), jc.Sphere(2e-3),
                jc.Grid((17, 15), (19e-6, 21e-6)), np.array([0.0, 0.3, 0.7]),
                adhesion=jc.DugdaleAdhesion(20e-3, 2e4)),
        ACCURATE,
    ),
    "indent, fractional half-space": Scenario(
        series_indented, pressed(jc.FractionalMaxwell(2e9, 30e9, 0.5, 0.4), RISING), ACCURATE
    ),
    "indent, cone on two films": Scenario(
        jc.indent,
        pressed(BODY([LAYER(SLS, 5e-6), LAYER(BURGERS, 9e-6)], STEEL), jc.Load(np.array([0.4, 0.5, 0.45])),
                jc.Cone(1.54, STEEL), times=np.array([0.0, 4.0, 10.0])),
        ACCURATE,
        # a film that does not flow over one that does: the weights of the delayed response nearly cancel, and the
        # displacement far from the contact, 0.001 of itself by the viscosities, has a noise of 1e-7 to 1e-6
        bound=3e-3, modes=5e-4,
    ),
    "indent, punch on a Kelvin-Voigt solid": Scenario(
        jc.indent,
        pressed(BODY([], jc.KelvinVoigt(1e9, 10e9, 0.4)), jc.Load(np.array([0.1, 0.2, 0.25])),
                jc.FlatPunch(55e-6, STEEL)),
        ACCURATE,
        {"indenter.radius": NO_EFFECT + "it is rounded to whole cells"},
    ),
    # ---- slide
    "slide, half-space": Scenario(
        jc.slide, pressed(BODY([], SOFT), RISING, velocity=np.array([1.2e-6, 0.7e-6])), ACCURATE
    ),
    "slide, film on a creeping base with friction": Scenario(
        jc.slide,
        pressed(BODY([LAYER(SLS, 10e-6)], SOFT), RISING,
                times=np.array([0.0, 2.0, 5.0]), velocity=np.array([[1e-6, 0.5e-6], [2e-6, 0.3e-6], [1.5e-6, 0.2e-6]]),
                friction=0.3),
        ACCURATE,
    ),
    "slide, heated": Scenario(
        jc.slide,
        pressed(BODY([], SOFT), RISING, velocity=2e-6, friction=0.3,
                thermal=jc.Thermal(300.0, 2e-4, 0.7, jc.ArrheniusShift(1e-19, 300.0), 1e-9)),
        ACCURATE,
    ),
    "slide, adhesive": Scenario(
        jc.slide,
        pressed(BODY([], RUBBER), jc.Load(np.array([1e-4, 2e-4, 1.5e-4])), jc.Sphere(2e-3),
                jc.Grid((17, 15), (19e-6, 21e-6)), np.array([0.0, 0.3, 0.7]), velocity=2e-5,
                adhesion=jc.ExponentialAdhesion(20e-3, 0.5e-6)),
        ACCURATE,
    ),
    "slide, plane strain": Scenario(
        in_a_plane(jc.slide),
        pressed(BODY([LAYER(SLS, 12e-6)], STEEL), jc.Load(np.array([0.5, 0.9, 0.8])), jc.Cylinder(5e-3, 1e-3, STEEL),
                LINE, velocity=1.5e-6),
        ACCURATE,
        AS_LONG,
    ),
    "slide, periodic": Scenario(
        jc.slide,
        pressed(BODY([], SOFT), jc.Load(np.array([0.06, 0.1, 0.09])), jc.HeightField(bumps(WAVES, 2e-7), STEEL), WAVES,
                velocity=np.array([1.2e-6, 0.7e-6])),
        ACCURATE,
    ),
    # ---- slide_steady
    "slide_steady, half-space": Scenario(
        jc.slide_steady,
        {"body": BODY([], SOFT), "indenter": BALL, "control": jc.Load(0.12),
         "velocity": np.array([2e-6, 1e-6]), "grid": GRID},
        ACCURATE,
    ),
    "slide_steady, film on a creeping base with friction": Scenario(
        jc.slide_steady,
        {"body": BODY([LAYER(SLS, 10e-6)], SOFT), "indenter": BALL, "control": jc.Approach(0.6e-6), "velocity": 2e-6,
         "grid": GRID, "friction": 0.3},
        ACCURATE,
        # entries of 1e-4 to 1e-3 of the term's largest: the weights of the delayed response nearly cancel, as in "indent,
        # creeping film on a creeping base"
        bound=2e-5, modes=1e-5,
    ),
    "slide_steady, thickness across the track": Scenario(
        jc.slide_steady,
        {"body": BODY([LAYER(SLS, np.broadcast_to(uneven_film(GRID, 8e-6)[:1], GRID.shape))], STEEL), "indenter": BALL,
         "control": jc.Load(0.12), "velocity": 2e-6, "grid": GRID},
        ACCURATE,
    ),
    "slide_steady, plane strain": Scenario(
        in_a_plane(jc.slide_steady),
        {"body": BODY([], SOFT), "indenter": jc.Cylinder(5e-3, 1e-3, STEEL), "control": jc.Load(0.8), "velocity": 2e-6,
         "grid": LINE},
        ACCURATE,
        AS_LONG,
    ),
    "slide_steady, periodic": Scenario(
        jc.slide_steady,
        {"body": BODY([], SOFT), "indenter": jc.HeightField(bumps(WAVES, 2e-7), STEEL), "control": jc.Load(0.1),
         "velocity": np.array([1.2e-6, 0.7e-6]), "grid": WAVES},
        ACCURATE,
    ),
    # ---- shear
    "shear, elastic and coupled": Scenario(
        jc.shear,
        pressed(BODY([], jc.Elastic(2e9, 0.3)), jc.Load(0.12), times=np.array([0.0, 1.0]),
                tangential=jc.TangentialLoad(np.array([[0.004, 0.001], [0.015, 0.006]])), friction=0.3),
        ACCURATE,
    ),
    "shear, creeping film by displacement": Scenario(
        jc.shear,
        pressed(BODY([LAYER(SLS, 10e-6)], SOFT), RISING,
                tangential=jc.TangentialDisplacement(np.array([[3e-8, 1e-8], [1e-7, 0.4e-7], [1.5e-7, 0.2e-7]])),
                friction=0.4),
        ACCURATE | {"coupled": False},
        # the slip, a small difference of displacements, has a noise of 8e-10: of its smallest derivatives that is 1e-4
        bound=2e-4, modes=3e-6,
    ),
    "shear, plane strain": Scenario(
        in_a_plane(jc.shear),
        pressed(BODY([], SOFT), jc.Load(np.array([0.5, 0.9, 0.8])), jc.Cylinder(5e-3, 1e-3, STEEL), LINE,
                tangential=jc.TangentialLoad(np.array([[0.03, 0.0], [0.1, 0.0], [0.15, 0.0]])), friction=0.4),
        # at 1e-11 the difference of the peak pressure by the spacing, 0.002 of it, is 2e-5 off
        {"tolerance": 1e-12},
        AS_LONG,
    ),
    # ---- roll_steady
    "roll_steady, creeping half-space": Scenario(
        jc.roll_steady,
        {"body": BODY([], SOFT), "indenter": BALL, "control": jc.Load(0.12), "velocity": 2e-6,
         "creepage": np.array([2e-3, 1e-3]), "friction": 0.3, "grid": GRID},
        ACCURATE | {"coupled": False},
    ),
    "roll_steady, film, coupled, a force": Scenario(
        jc.roll_steady,
        {"body": BODY([LAYER(SLS, 10e-6)], STEEL), "indenter": BALL, "control": jc.Load(0.12),
         "velocity": np.array([2e-6, 1e-6]), "creepage": jc.TangentialLoad(np.array([0.012, 0.005])), "friction": 0.3,
         "grid": GRID},
        ACCURATE,
    ),
    "roll_steady, plane strain": Scenario(
        in_a_plane(jc.roll_steady),
        {"body": BODY([], SOFT), "indenter": jc.Cylinder(5e-3, 1e-3, STEEL), "control": jc.Load(0.8), "velocity": 2e-6,
         "creepage": np.array([1e-3, 0.0]), "friction": 0.3, "grid": LINE},
        ACCURATE | {"coupled": False},
        AS_LONG,
    ),
    # ---- rub
    "rub, worn film that creeps": Scenario(
        jc.rub,
        pressed(BODY([LAYER(SLS, 8e-6)], STEEL), jc.Load(0.12),
                velocity=np.array([1e-3, 2e-3, 1.5e-3])[:, None] * [[1.0, 0.2]], law=ARCHARD, friction=0.2),
        ACCURATE,
    ),
    "rub, growth and removal, heated": Scenario(
        jc.rub,
        pressed(BODY([LAYER(jc.Elastic(1e9, 0.4), uneven_film(GRID, 8e-6))], STEEL), RISING, velocity=1e-3, friction=0.2,
                law=jc.StressActivated(0.2, 9e-20, 3e-28, None, stress="shear") + jc.ProportionalRemoval(1e-3),
                thermal=jc.Thermal(330.0, 1e-2, 0.7), thickest=20e-6),
        ACCURATE,
        {"thickest": NO_EFFECT + "kernels are computed up to it, and the film stays below"},
    ),
    "rub, growth at a given temperature": Scenario(
        jc.rub,
        pressed(BODY([LAYER(BURGERS, 8e-6)], STEEL), FALL, velocity=1e-3, law=GROWTH + jc.ProportionalRemoval(1e-3)),
        ACCURATE,
        {"velocity": NO_EFFECT + "without friction and heat, growth and removal follow stress and thickness alone"},
    ),
    "rub, along a path": Scenario(
        jc.rub,
        pressed(BODY([LAYER(SLS, 8e-6)], STEEL), jc.Load(0.05), law=ARCHARD,
                path=np.array([[-8e-6, 0.0], [0.0, 1e-6], [6e-6, 2e-6]])),
        ACCURATE | {"substeps": 4},
    ),
    "rub, worn indenter": Scenario(
        jc.rub,
        pressed(BODY([], SOFT), jc.Load(0.12), velocity=1e-3, law=ARCHARD),
        # at 1e-11 the difference of the peak pressure by the spacing is 1.3e-5 off
        {"tolerance": 1e-12, "wears": "indenter"},
    ),
    # ---- without a contact; depths end at the surface, at which central differences do not exist
    "subsurface, elastic films": Scenario(
        jc.subsurface,
        {"body": BODY([LAYER(jc.Elastic(1e9, 0.4), 30e-6), LAYER(jc.Elastic(5e9, 0.3), 20e-6)], STEEL), "grid": GRID,
         "pressure": hill(GRID, 1e7), "traction": np.stack([hill(GRID, 2e6), hill(GRID, -1e6)]),
         "depths": np.array([0.1e-6, 3e-6, 20e-6, 60e-6])},
        {},
    ),
    "subsurface, after a history": Scenario(
        jc.subsurface,
        {"body": BODY([LAYER(SLS, 30e-6)], SOFT), "grid": GRID,
         "pressure": np.stack([hill(GRID, 1e7), hill(GRID, 1.4e7), hill(GRID, 0.8e7)]), "times": TIMES,
         "depths": np.array([0.1e-6, 3e-6, 60e-6])},
        {},
    ),
    "subsurface, half-space": Scenario(
        jc.subsurface,
        {"body": BODY([], jc.Elastic(1e9, 0.4)), "grid": GRID, "pressure": hill(GRID, 1e7),
         "traction": np.stack([hill(GRID, 2e6), hill(GRID, -1e6)]), "depths": np.array([0.1e-6, 3e-6, 60e-6])},
        {},
    ),
    "flash_temperature, oblique": Scenario(
        jc.flash_temperature,
        {"heat_flux": hill(GRID, 1e6), "grid": GRID, "velocity": np.array([1.2, 0.4]), "conductivity": 46.0,
         "diffusivity": 1.2e-5},
        {},
    ),
    "flash_temperature, film": Scenario(
        jc.flash_temperature,
        {"heat_flux": hill(GRID, 1e6), "grid": GRID, "velocity": 1.2, "conductivity": 46.0, "diffusivity": 1.2e-5,
         "film": jc.ThermalFilm(20e-6, 1.0, 5e-7)},
        {},
    ),
    "flash_temperature, plane strain": Scenario(
        jc.flash_temperature,
        {"heat_flux": hill(LINE, 1e6), "grid": LINE, "velocity": 1.2, "conductivity": 46.0, "diffusivity": 1.2e-5},
        {},
        {"grid.spacing[1]": NO_EFFECT + "the band is as long as wanted"},
    ),
    "heat_partition": Scenario(
        jc.heat_partition,
        {"heat_flux": hill(GRID, 1e6), "grid": GRID, "first": jc.ThermalBody(46.0, 1.2e-5, np.array([1.2, 0.3]), 320.0),
         "second": jc.ThermalBody(1.0, 5e-7, -0.3, 300.0, jc.ThermalFilm(20e-6, 3.0, 1e-6))},
        {},
    ),
}  # fmt: skip


def main() -> None:
    """Print a line for each scenario: leaves, terms, and the largest differences."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "scenarios", nargs="*", metavar="SCENARIO", help="beginnings of names; all when absent"
    )
    parser.add_argument("--leaves", action="store_true", help="also name what disagrees")
    options = parser.parse_args()
    print(f"{'scenario':58s}{'leaves':>7}{'terms':>6}  {'modes':55s} central differences", flush=True)
    chosen = [name for start in options.scenarios or [""] for name in SCENARIOS if name.startswith(start)]
    for name in dict.fromkeys(chosen):
        scenario = SCENARIOS[name]
        table = measured(scenario)
        modes, central = table.worst(table.between_modes), table.worst(table.from_differences)
        print(f"{name:58s}{len(table.leaves):7d}{len(table.terms):6d}  {modes:55s} {central}", flush=True)
        for fault in faults(scenario, table) if options.leaves else ():
            print(f"    {fault}", flush=True)
        jax.clear_caches()


if __name__ == "__main__":
    main()
