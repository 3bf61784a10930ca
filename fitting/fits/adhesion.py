"""Fit of the modulus and the work of adhesion to an adhesive force curve, approach and retraction."""

from __future__ import annotations

import collections
import dataclasses
import functools
import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.data.contact import runs_of
from fitting.data.curves import check_kind
from fitting.data.indentation import (
    IndentationData,
    PullOff,
    check_signs,
    paraboloid_note,
    probe_of,
    read_pull_off,
    zeroed,
)
from fitting.inference import noise, verdict
from fitting.inference.result import Conclusion, Fit, FitProblem, conclude, least_squares, plain
from fitting.inference.sample import Deviation, Sample, Solved, judged_by_size
from fitting.models.adhesive_contact import (
    JKR,
    Extent,
    FilmOnBase,
    FilmSeries,
    MaugisDugdale,
    largest_tension,
    load_at,
    series_of,
)
from fitting.models.adhesive_contact import film_largest_tension as film_tension
from fitting.models.adhesive_contact import film_load_at as film_load
from fitting.models.parameters import NUISANCES, Parameters, instrument_offset
from fitting.models.structure import Compressibility, ParameterList, Sought, limits, resolve
from fitting.search import nonlinear
from fitting.search.nonlinear import Objective, inverse, minimise_from, moved
from fitting.search.press import Coating, Instrument, indentation_weights, march_times, polygon
from fitting.views import sheet, text
from jaxcontact._support.prefixes import told_apart

# Search of the fit of an adhesive force curve, approach and retraction, of an elastic half-space or film.
#
# The load is fitted as a function of the measured depth by a closed form (``fitting.models.adhesive_contact``), on a
# film by that of ``fitting.models.adhesive_contact``. Coordinates are the logarithms of shear modulus, work of
# adhesion and strength, over starting values that follow from the lowest and the highest point of the curve, and the
# contributions of the instrument to the depth.


WIDE = 7.0  # of the logarithms of modulus and work about their starting values
PARAMETERS = -5.0, 4.0  # of the logarithm of Maugis's parameter over its starting value
STARTS: tuple[float, ...] = (-2.0, 0.0, 2.0)  # of the logarithm of Maugis's parameter
MODULI: tuple[float, ...] = (
    -1.5,
    0.0,
    1.5,
)  # of the logarithm of the modulus of a film, over that of a half-space
WIDER = 1.5  # of the largest contact radius that is expected


UNITS = {"G": "Pa", "work": "J/m2", "strength": "Pa"}


def structure_of_model(model: type) -> ParameterList:
    """Return the list of parameters of a model."""
    return ParameterList.of(model, {name: UNITS[name] for name in model._fields})  # type: ignore[attr-defined]


class Body(NamedTuple):
    """The bodies in contact: Poisson's ratio of the half-space or film, the ball, and the film on its base, if any."""

    nu: float
    ball: Any
    film: FilmOnBase | None = None

    def modulus(self, G: Any) -> Any:
        """Return E* [Pa] of the contact of the ball with a half-space of shear modulus G [Pa]."""
        return 2.0 / ((1.0 - self.nu) / G + self.own)

    @property
    def own(self) -> float:
        """The compliance (1 - nu)/G of the ball [1/Pa]."""
        if self.ball.material is None:
            return 0.0
        with jax.ensure_compile_time_eval():  # a number inside jit as well
            return float(self.ball.compliance())


class AdhesiveTest(NamedTuple):
    """A force curve ready for a search.

    data; seen: its ``PullOff``; body; model: the class of the parameters; weights (n,) [1/N], 0 out of contact.
    """

    data: IndentationData
    seen: PullOff
    body: Body
    model: type
    weights: np.ndarray

    def start(self) -> dict[str, float]:
        """Return starting values: the lowest load is that of JKR, and the modulus follows from the highest point."""
        R, pull = float(self.body.ball.radius), self.seen.force
        work = pull / (1.5 * math.pi * R)
        top = float(self.data.load.max())
        of_unit_modulus = self._jkr_depth(top, work) - self._jkr_depth(-pull * (1.0 - 1e-9), work)
        retract = np.flatnonzero(self.data.segments == "retract")
        low = float(self.data.depth[retract][np.argmin(self.data.load[retract])])
        way = max(float(self.data.depth.max()) - low, 1e-3 * float(np.ptp(self.data.depth)))
        modulus = (of_unit_modulus / way) ** 1.5
        own = self.body.own
        G = (1.0 - self.body.nu) / max(2.0 / modulus - own, 0.1 / modulus)
        values = {"G": G, "work": work}
        if self.model is MaugisDugdale:
            K = 4.0 * modulus / 3.0  # lambda = 1
            values["strength"] = float(0.5 * np.cbrt(math.pi * work * K**2 / R))
        return values

    def first_touch(self) -> float:
        """Return the measured depth [m] at which the surfaces would touch without adhesion, at the starting values."""
        values = self.start()
        E = float(self.body.modulus(values["G"]))
        return float(self.data.depth.max()) - self._jkr_depth(float(self.data.load.max()), values["work"], E)

    def _jkr_depth(self, load: float, work: float, modulus: float = 1.0) -> float:
        """Return the approach [m] of JKR under a load [N]."""
        R = float(self.body.ball.radius)
        pull = 3.0 * math.pi * work * R
        a = np.cbrt(0.75 * R / modulus * (load + pull + math.sqrt(max(2.0 * pull * load + pull**2, 0.0))))
        return float(a**2 / R - math.sqrt(2.0 * math.pi * a * work / modulus))

    def space(self, table: dict[str, tuple[float, float]], instrument: Instrument) -> Parameters:
        """Return the coordinates of the search."""
        structure, start, sizes = structure_of_model(self.model), self.start(), sizes_of(self.data)
        rows = [
            log_bounds(table[name], start[name], PARAMETERS if i > 1 else (-WIDE, WIDE))
            for i, name in enumerate(structure.where)
        ]
        nuisances = instrument.box(sizes)
        if isinstance(instrument.contact_point, str):  # about the measured depths, whose zero is arbitrary
            nuisances[0] += float(self.data.depth.min()) / sizes[0] + np.array([0.0, 1.0])
        return space_of(structure, start, sizes, np.concatenate([np.array(rows), nuisances]))

    def starts(self, space: Parameters) -> list[np.ndarray]:
        """Return starting coordinates, for the closed form with a strength at several of them."""
        k = space.structure.size
        theta = np.zeros(space.lower.size)
        theta[k] = self.first_touch() / space.unit[k]
        place, several = 0, MODULI
        if self.body.film is None:
            place, several = 2, STARTS if self.model is MaugisDugdale else STARTS[1:2]
        rows = [np.where((np.arange(theta.size) == place) & (place < k), shift, theta) for shift in several]
        return [np.clip(row, *space.bounds) for row in rows]

    def objective(self, space: Parameters, weights: np.ndarray) -> Objective:
        """Return the least squares over the coordinates."""
        n = self.data.t.size
        times = self.data.t - self.data.t[0]
        samples = tuple(nonlinear.repeated(x) for x in (times, self.data.depth, self.data.load))
        body = jnp.array([self.body.nu, self.body.own, float(self.body.ball.radius)])
        padded = nonlinear.without_weight(weights)  # so that numbers of points share a program
        inputs, film = (padded > 0.0, samples, space.unit, body), self.body.film
        if film is None:
            return Objective.of(_load, inputs, samples[2], padded, space, points=slice(n))
        size = film.thickness, self._extent(film)

        def about(theta: Any) -> Any:
            """Return the inputs with the series about a modulus."""
            log_G = float(theta[0]) + math.log(space.unit[0])
            series = series_of(log_G, self.body.nu, self.body.own, film, size[1])
            return inputs, series, float(theta[0]), size

        return Objective.of(_film_load, about, samples[2], padded, space, points=slice(n))

    def pull_off(self, space: Parameters, theta: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the largest tension [N] of the curve at a point, and the derivative (m,) of its logarithm by the
        coordinates."""
        nu, own, radius, film = self.body.nu, self.body.own, float(self.body.ball.radius), self.body.film
        unit, k = jnp.asarray(space.unit), space.structure.size

        def log_force(logs: Array) -> Array:
            values = jnp.exp(logs) * unit[:k]
            if film is None:
                strength = values[2] if k > 2 else None
                modulus = 2.0 / ((1.0 - nu) / values[0] + own)
                return jnp.log(largest_tension(modulus, values[1], radius, strength))
            size = film.thickness, self._extent(film)
            log_G = float(theta[0]) + math.log(space.unit[0])
            series = series_of(log_G, nu, own, film, size[1])
            body = (1.0 - nu) / values[0] + own, values[1], radius
            return jnp.log(film_tension(logs[0] - float(theta[0]), series, body, size))

        log, slope = jax.value_and_grad(log_force)(jnp.asarray(theta[:k]))
        return math.exp(float(log)), np.append(np.asarray(slope), np.zeros(theta.size - k))

    def _extent(self, film: FilmOnBase) -> Extent:
        """Return a range beyond the contact radius of the deepest point for any base, equal for similar curves."""
        radius, values = float(self.body.ball.radius), self.start()
        depth = float(np.ptp(self.data.depth[self.seen.contact]))
        neck = np.cbrt(math.pi * values["work"] * radius**2 / float(self.body.modulus(values["G"])))
        widest = WIDER * (math.sqrt(2.0 * radius * depth) + neck) / film.thickness
        return Extent(
            2.0 ** math.ceil(math.log2(widest)), 1.0 + math.exp(round(math.log(values["G"] / film.base)))
        )


def sizes_of(data: IndentationData) -> np.ndarray:
    """Return units (3,) of contact point [m], drift [m/s] and machine compliance [m/N]: each moves by the whole depth."""
    depth, load = float(np.ptp(data.depth)), float(np.ptp(data.load))
    return depth / np.array([1.0, float(np.ptp(data.t)), load])


def log_bounds(given: tuple[float, float], unit: float, widest: tuple[float, float]) -> tuple[float, float]:
    """Return the bounds of a logarithm, those of the parameter where they are given and else those of the search."""
    low, high = given
    return (math.log(low / unit) if low > 0.0 else widest[0]), (
        math.log(high / unit) if math.isfinite(high) else widest[1]
    )


def space_of(
    structure: ParameterList, start: dict[str, float], sizes: np.ndarray, box: np.ndarray
) -> Parameters:
    """Return the coordinates: logarithms of the parameters over their starting values, and the instrument's contributions.

    sizes (3,): units of the latter; box (k + 3, 2): bounds of all.
    """
    unit = np.array([start[name] for name in structure.where])
    own = np.arange(len(box)) < structure.size
    return Parameters.of(
        structure, box, unit=np.append(unit, sizes), logarithmic=own, material=own, nuisances=tuple(NUISANCES)
    )


def table_of(
    model: type, fixed: dict[str, float] | None, bounds: dict[str, tuple] | None
) -> dict[str, tuple[float, float]]:
    """Return the bounds of the parameters of a model."""
    return limits(structure_of_model(model), fixed, bounds)


def _load(theta: Array, inputs: tuple[Array, tuple[Array, Array, Array], Array, Array]) -> Array:
    """Return the load (n,) [N] of the closed form.

    inputs: points with a weight (n,) bool; times, depths and loads, (n,); units; Poisson's ratio, and compliance and
    radius of the ball.
    """
    fitted, (t, depth, load), unit, (nu, own, radius) = inputs
    values = jnp.exp(theta[:-3]) * unit[:-3]
    approach = depth - instrument_offset(theta * unit, t, load)
    approach = jnp.where(fitted, approach, 0.0)
    strength = values[2] if values.size > 2 else None
    return load_at(approach, 2.0 / ((1.0 - nu) / values[0] + own), values[1], radius, strength)


def _film_load(theta: Array, inputs: tuple[tuple, FilmSeries, Array, tuple[Array, Extent]]) -> Array:
    """Return the load (n,) [N] on a film; inputs: those of ``_load``, and the series for a coordinate of its modulus."""
    (fitted, (t, depth, load), unit, (nu, own, radius)), series, at, size = inputs
    G, work = jnp.exp(theta[:2]) * unit[:2]
    approach = jnp.where(fitted, depth - instrument_offset(theta * unit, t, load), 0.0)
    return film_load(approach, theta[0] - at, series, ((1.0 - nu) / G + own, work, radius), size)


# Judgement of an adhesive force curve: systematic deviations from the model by their size. The model is fitted again
# to the shallower and to the deeper half of the contact, and, without a range of the attraction (JKR), with one
# (``inference/verdict.py``).


CHANGE = 0.4  # of the logarithm of modulus or work between half the contact and the whole, beyond which a fit is rejected
TREND = 0.05  # likewise, trend of the residuals over the largest force in contact
FEW = 8  # fewest points in half the contact
# points out of contact beside a jump into or out of contact, as a number and as a fraction
OFF, BESIDE = 5, 0.05


def fault(data: IndentationData, contact: np.ndarray, deviations: np.ndarray) -> str:
    """Return which fault an adhesive force curve has: no indentation, spikes, a jump, or a step before the contact; "" if
    none.

    contact (n,) bool: the points in contact; deviations (n,) [N]: the model, which is zero out of contact, less the load.
    The surfaces jump into contact and part abruptly, which is no fault: approach and retraction are judged in contact and
    out of it, each without the points next to the change.
    """
    load, approach = data.load, data.segments == "approach"
    largest, change = float(np.max(np.abs(load[contact]))), float(np.ptp((load + deviations)[contact]))
    scatter = float(np.std(deviations[contact]))
    if change < verdict.SEEN * scatter:
        return f"no indentation: the force changes by {change:.3g} N in contact, the noise is {scatter:.3g} N"
    spiky, highest, jumped = 0, 0.0, 0.0
    for part in (approach & ~contact, approach & contact, ~approach & contact, ~approach & ~contact):
        own = deviations[part]
        beside = verdict.BESIDE if contact[part].any() else max(OFF, math.ceil(BESIDE * own.size))
        own = own[beside : own.size - beside]
        if own.size < FEW:
            continue
        own = own - np.median(own)
        count, high = verdict.spikes(own, largest, own.size)
        spiky, highest = spiky + int(count), max(highest, float(high))
        jumped = max(jumped, float(verdict.jump(own, largest, own.size)))
    # the first loads in contact are tensions, or small: the load rises continuously from the first touch on
    first = load[approach & contact][: verdict.BESIDE]
    stepped = float(first.min()) / largest if first.size and np.any(approach & ~contact) else 0.0
    if stepped > verdict.SPIKE:
        return (
            f"a step before the contact: the load is {100 * stepped:.3g} % of the largest force where it leaves the"
            " baseline, which a contact does not reach at once: correct the baseline, or measure again"
        )
    return verdict.spiked_or_jumped(spiky, highest, jumped)


def deviation(
    test: AdhesiveTest, problem: FitProblem, solved: Solved, with_range: Callable[[], np.ndarray] | None
) -> Deviation:
    """Return the systematic deviation of a solved curve.

    with_range: returns the coordinates (m,) of the fit with a range of the attraction; None where the model has one.
    """
    # the trend of the residuals of either segment over the largest force
    contact, depth = test.seen.contact, test.data.depth
    largest = float(np.max(np.abs(test.data.load[contact])))
    trends = {"approach": 0.0, "retract": 0.0}
    for mark in trends:
        some = contact & (test.data.segments == mark)
        if np.any(some):
            trends[mark] = verdict.trend(solved.residual[some] / solved.weights[some]) / largest

    # a fault of the instrument, from which neither modulus nor work follows
    deviations = np.where(contact, solved.residual / np.where(contact, solved.weights, 1.0), -test.data.load)
    broken = fault(test.data, contact, deviations)
    if broken:
        return Deviation(np.zeros(solved.theta.size), (broken,))

    # fits of the shallower and of the deeper half, and with a range of the attraction
    def refits() -> list[np.ndarray | None]:
        found: list[np.ndarray | None] = []
        middle = 0.5 * (depth[contact].min() + depth[contact].max())
        for deep in (False, True):
            some = contact & ((depth >= middle) == deep)
            if np.sum(some) < FEW:
                return [None]
            half = test.objective(problem.space, np.where(some, solved.weights, 0.0))
            found.append(nonlinear.minimise(half, solved.theta).theta)
        return found if with_range is None else [*found, with_range()]

    def words(trend: float, changes: np.ndarray, rejected: bool) -> str:
        """Return the size of the trend and of the changes of modulus and work, and what it may mean."""
        G, work = (100.0 * math.expm1(change) for change in np.max(np.abs(changes), axis=0))
        other = " or a range of the attraction" if test.model is JKR and test.body.film is None else ""
        said = (
            f"the residuals have a trend of {100 * trend:.1f} % of the largest force ({trend * largest:.3g} N); with half"
            f" the contact{other} G changes by {G:.1f} % and work by {work:.1f} %"
        )
        if not rejected:
            return f"{said}, which the intervals include"
        if trends["approach"] > TREND:
            return (
                f"{said}: approach and retraction may have different works of adhesion, as an edge that advances and one"
                ' that recedes often have: fit the retraction alone (data.only("retract"))'
            )
        return (
            f"{said}: the sample may creep, be a film on a base, or be rough, the ball may have another radius, or the"
            " attraction a range that the model does not have"
        )

    size, limits = (lambda: max(trends.values())), (TREND, CHANGE)
    logs = lambda theta: theta[:2]  # of modulus and work
    return judged_by_size(problem, solved, size, refits, logs, limits, words)


# Search of the fit of an adhesive force curve, approach, dwell and retraction, of a viscoelastic film on a base.
#
# A receding edge on a viscoelastic solid has no closed form, so that the contact solver is the model: the measured
# depth is prescribed over the whole history, and the load at the points in contact is fitted. The range of the
# attraction (or its strength) is held, because the curve in contact hardly determines it. Coordinates are the
# logarithms of the parameters of the material and of the work of adhesion, over starting values, and the
# contributions of the instrument to the depth.
#
# The difference between the load on a grid of twice the cells with steps of half the length and that on the grid of
# the search, at the optimum, is added to the model, and the fit is repeated. What this changes in the coordinates,
# divided by ``REMAINING``, remains as a systematic error.


CELLS, FINER = 32, 2  # cells along a side, and the factor on cells and steps of the run that corrects
REMAINING = 3.0  # change over the error that remains after it: of a second order, a third
MARGIN = 2.2  # width of the grid over the diameter of the contact that is expected
ITERATIONS = 1000  # of the solver in a step
SHARES: dict[type, tuple[float, ...]] = {
    jc.Maxwell: (1.0, 0.5),
    jc.StandardLinearSolid: (0.5, 0.5),
    jc.Burgers: (0.4, 0.4, 0.2),
}  # of springs and flow in the compliance of the start at the end of the curve
TIMES = 0.03, 0.3  # retardation times of the starts over the duration


@functools.cache
def structure_with_work(material: type) -> ParameterList:
    """Return the list of the parameters of a film's material and of the work of adhesion."""
    own = resolve(material)
    units = {name: own.unit(name) for name in own.where} | {"work": "J/m2"}
    return ParameterList.of(collections.namedtuple(material.__name__, units), units)  # type: ignore[misc]


class AdhesiveFilm(NamedTuple):
    """The bodies in contact: Poisson's ratio and coating of the film, ball, and the law of adhesion at the start."""

    nu: Any
    coating: Coating
    ball: Any
    law: Any


class Run(NamedTuple):
    """Inputs of the solver beside the coordinates: times (m,) [s] of the march and depth there [m]; t, load, (n,): the
    samples; correction (n,) [N]: added to the model; unit: of the coordinates."""

    film: AdhesiveFilm
    grid: jc.Grid
    times: Array
    depth: Array
    t: Array
    load: Array
    correction: Array
    unit: Array


class CreepingFilm(NamedTuple):
    """A force curve ready for a search.

    data; seen: its ``PullOff``; film; material: the class; start: {parameter: value}; weights (n,) [1/N], 0 out of contact.
    """

    data: IndentationData
    seen: PullOff
    film: AdhesiveFilm
    material: type
    start: dict[str, float]
    weights: np.ndarray

    def space(self, table: dict[str, tuple[float, float]], instrument: Instrument) -> Parameters:
        """Return the coordinates of the search."""
        structure, sizes = structure_with_work(self.material), sizes_of(self.data)
        rows = [log_bounds(table[name], self.start[name], (-WIDE, WIDE)) for name in structure.where]
        return space_of(structure, self.start, sizes, np.concatenate([np.array(rows), instrument.box(sizes)]))

    def starts(self, space: Parameters) -> list[np.ndarray]:
        """Return starting coordinates, for each of ``TIMES`` where there is a retardation time."""
        theta, names = np.zeros(space.lower.size), list(space.structure.where)
        if "eta2" not in names:
            return [np.clip(theta, *space.bounds)]
        place = np.arange(theta.size) == names.index("eta2")
        return [np.clip(np.where(place, math.log(time), theta), *space.bounds) for time in TIMES]

    def run(self, space: Parameters, width: float, finer: int = 1) -> Run:
        """Return the inputs of the solver on a grid of a width [m], with ``finer`` times the cells and the steps."""
        since = self.data.t - self.data.t[0]
        size = float(np.ptp(self.data.depth))
        knots = march_times(since, self.data.depth / size)
        depth = polygon(since, self.data.depth / size, knots) * size
        # between the knots
        steps = np.interp(np.arange((knots.size - 1) * finer + 1) / finer, np.arange(knots.size), knots)
        grid = jc.Grid.square(n=CELLS * finer, width=width)
        numbers = Run(
            self.film, grid, steps, np.interp(steps, knots, depth), since, self.data.load, np.zeros(since.size),
            space.unit,
        )  # fmt: skip
        return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=float), numbers)

    def objective(self, space: Parameters, weights: np.ndarray, run: Run) -> Objective:
        """Return the least squares over the coordinates."""
        linearised = lambda theta: linearise(theta, space.free, weights, run, self.material)
        return Objective.of_one_program(linearised, space.bounds, ftol=1e-5)

    def correction(self, theta: np.ndarray, space: Parameters, run: Run) -> np.ndarray:
        """Return the load on a finer grid with shorter steps less that of a run, (n,) [N]."""
        finer = self.run(space, float(run.grid.width[0]), FINER)
        own = linearise(theta, space.free, self.weights, run, self.material)[2][0]
        return np.asarray(loads(theta, finer, self.material)[0] - own + run.correction)


def starting_values(material: type, G: float, work: float, duration: float) -> dict[str, float]:
    """Return starting values of a material whose compliance at the end is 1/G, with eta2 for a time of the duration [s]."""
    spring, *more = SHARES[material]
    if material is jc.Maxwell:
        return {"G": G, "eta": G * duration / more[0], "work": work}
    values = {"G1": G / spring, "G2": G / more[0]}
    if material is jc.Burgers:
        values["eta1"] = G * duration / more[1]
    return values | {"eta2": G / more[0] * duration, "work": work}


def with_work(law: Any, work: Any) -> Any:
    """Return the law of the same range, or strength, with another work of adhesion [J/m2]."""
    if isinstance(law, jc.DugdaleAdhesion):
        return jc.DugdaleAdhesion(work, law.strength)
    return jc.ExponentialAdhesion(work, law.range)


@functools.partial(jax.jit, static_argnames=("material",))
def loads(theta: Array, run: Run, material: type) -> tuple[Array, Array, Array]:
    """Return the load at the samples (n,) [N], with the correction; status and cells across the attraction's zone, (m,)."""
    film, names = run.film, structure_with_work(material).where
    values = dict(zip(names, jnp.exp(theta[:-3]) * run.unit[:-3], strict=True))
    law = with_work(film.law, values.pop("work"))
    point, drift, machine = theta[-3:] * run.unit[-3:]
    offset = point + drift * run.t + machine * run.load
    control = jc.Approach(run.depth - jnp.interp(run.times, run.t, offset))
    found = jc.indent(
        film.coating.body(material(**values, nu=film.nu)), film.ball, control, run.times, grid=run.grid, adhesion=law,
        save="last", max_iterations=ITERATIONS,
    )  # fmt: skip
    assert isinstance(found, jc.AdhesiveHistory)
    return jnp.interp(run.t, run.times, found.load) + run.correction, found.status, found.cohesive_cells


@functools.partial(jax.jit, static_argnames=("material",))
def linearise(
    theta: Array, free: Array, weights: Array, run: Run, material: type
) -> tuple[Array, Array, tuple[Array, Array, Array]]:
    """Return the weighted residuals (n,), their Jacobian (n, k) with respect to the coordinates at the places ``free`` (k,),
    0 out of contact, and what ``loads`` returns."""

    def some(x: Array) -> tuple[Array, tuple[Array, Array, Array]]:
        found = loads(theta.at[free].set(x), run, material)
        return found[0], found

    slopes, found = jax.jacfwd(some, has_aux=True)(theta[free])
    jacobian = jnp.where(weights[:, None] > 0.0, weights[:, None] * slopes, 0.0)
    return weights * (found[0] - run.load), jacobian, found


Interval = tuple[float, float, float]

TENSION = 0.02  # of the tension on a film, by which a curve of the solver at a Tabor number of 3 exceeded JKR
FILM_NOTE = (
    f"on a film the attraction is taken to have no range; the intervals allow for {100 * TENSION:g} % of the tension, as a"
    " Tabor number of 3 may change it, and with a longer range the work is too large by more"
)


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class AdhesiveFit(Fit):
    """Result of the fit of an adhesive force curve; the attributes common to all fits are documented in ``Fit``.

    Its parameters are "G" [Pa], "work" [J/m2] and, where the attraction has a range, "strength" [Pa]; of a film that creeps
    those of its material and "work".

    Attributes:
        law: the law of adhesion with the fitted parameters and what was held of it; None for an attraction of short range
            (JKR).
        tabor_number: (R w^2/(E*^2 z^3))^(1/3) of the fitted law, z = w/s(0); nan without a range.
        pull_off: (value, low, high) [N]: the largest tension of the fitted curve, 3/2 pi w R for JKR on a half-space. The
            lowest reading is no estimate of it, since the noise selects it.
        separation_work: (value, low, high) [J]: the work of the tension of the retraction, read from the curve without a
            model; the interval includes the distance between the last point in contact and the next.
        nu, indenter, film: given quantities on which the parameters are conditional; film: None for a half-space, else
            thickness [m], and modulus [Pa] and Poisson's ratio of the base.
        nuisances: {contact_point [m], drift [m/s], machine_compliance [m/N]: (value, low, high)} of those that were
            fitted.
        kept: (n,) bool, the points in contact, which were fitted.
        runs: (forward, gradient) numbers of evaluations of the model.
        starts: (number of local searches, number that reached this minimum).
        seconds: wall time of the whole fit [s].
        contact_model: why this model of the contact, where ``fit_force`` chose it with ``adhesion="auto"``; None else.
    """

    law: Any
    tabor_number: float
    pull_off: Interval
    separation_work: Interval
    nu: float
    indenter: Any
    film: FilmOnBase | None
    nuisances: dict[str, Interval]
    kept: np.ndarray
    runs: tuple[int, int]
    starts: tuple[int, int]
    seconds: float
    contact_model: Any = None

    def plot(self, path: Any = None) -> Any:
        """Return a figure of load over depth with the fit, and of the residuals; save it where a path is given."""
        data, kept = self.data, self.kept
        depth, load = data.depth * 1e9, data.load * 1e9

        def panel(top: Any, bottom: Any) -> None:
            top.axhline(0.0, color="0.8", linewidth=0.8)
            if not kept.all():
                away = depth[~kept], load[~kept]
                top.plot(*away, ".", markersize=3, color="0.8", label="out of contact, not fitted")
            for name, colour in (("approach", sheet.VIOLET), ("hold", sheet.GREEN), ("retract", sheet.BLUE)):
                on = kept & (data.segments == name)
                if on.any():
                    top.plot(depth[on], load[on], ".", markersize=3, color=colour, label=name)
                    bottom.plot(depth[on], sheet.deviations(self)[on[kept]], ".", markersize=3, color=colour)
            order, label = np.argsort(depth[kept]), self.model.__name__
            top.plot(depth[kept][order], 1e9 * self.fitted[order], color="black", linewidth=1.0, label=label)
            top.axhline(-1e9 * self.pull_off[0], color="0.4", linewidth=0.8, linestyle="--", label="pull-off")
            top.set(ylabel="load [nN]")
            bottom.set(xlabel="depth [nm]", ylabel=sheet.RESIDUAL)

        return sheet.draw(self, path, panel)

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with pull-off and work of separation, the Tabor number and what was held."""
        return super().to_dict() | {
            "pull_off_N": plain(self.pull_off), "separation_work_J": plain(self.separation_work),
            "tabor_number": plain(self.tabor_number), "poisson_ratio": self.nu,
            "film_thickness_m": None if self.film is None else self.film.thickness, **probe_of(self.indenter).key,
            "nuisances": {text.key(name, NUISANCES[name]): plain(row) for name, row in self.nuisances.items()},
            "starts": self.starts[0], "starts_agreed": self.starts[1],
            "forward_runs": self.runs[0], "gradient_runs": self.runs[1], "time_s": self.seconds,
            **({} if self.contact_model is None else {"contact_model": self.contact_model.to_dict()}),
        }  # fmt: skip

    def _choices(self) -> list[str]:
        return ["depth control", *super()._choices(), probe_of(self.indenter).words]

    def _nuisance_lines(self) -> list[str]:
        rows = self.nuisances.items()
        return [
            f"  {name} = {v:.5g} {NUISANCES[name]}, {low:.4g} to {high:.4g}" for name, (v, low, high) in rows
        ]

    def _combination_lines(self) -> list[str]:
        percent = f"{100 * self.level:g} % interval"
        read = (("pull-off force", "N", self.pull_off), ("work of separation", "J", self.separation_work))
        lines = [
            f"  {name} = {v:.5g} {unit}, {percent} {low:.5g} to {high:.5g}"
            for name, unit, (v, low, high) in read
        ]
        if math.isfinite(self.tabor_number):
            lines.append(f"  Tabor number {self.tabor_number:.3g}")
        return lines

    def _conditions(self) -> list[str]:
        runs = f"{self.runs[0]} forward and {self.runs[1]} gradient runs in {self.seconds:.3g} s"
        body = "a half-space"
        if self.film is not None:
            body = f"a film of {self.film.thickness:.4g} m on a base of G = {self.film.base:.4g} Pa"
        chosen = [] if self.contact_model is None else self.contact_model.lines()
        return [*chosen, f"  the parameters are conditional on nu = {self.nu:.4g} and {body}; {runs}"]


def is_law(adhesion: Any) -> bool:
    """Return whether an ``adhesion=`` is a law of adhesion, whose work is fitted and whose range is held."""
    return isinstance(adhesion, jc.ExponentialAdhesion | jc.DugdaleAdhesion)


def check_fitted(adhesion: Any, model: Any, film: bool, control: Any) -> None:
    """Raise ValueError for what a fit of a closed form does not take."""
    if getattr(model, "__name__", model) not in ("Elastic", "elastic"):
        raise ValueError(
            f"model: expected Elastic with a fit of the work of adhesion, got {getattr(model, '__name__', model)!r}: a"
            " receding edge on a viscoelastic solid has no closed form; pass a law of adhesion for a film that creeps, or a"
            " known work for the approach alone"
        )
    if control != "depth":
        raise ValueError(f'control: expected "depth" with a fit of the work of adhesion, got {control!r}')
    if film and adhesion.lower() != "jkr":
        raise ValueError(f'adhesion: expected "JKR" with a layer, got {adhesion!r}')


def body_of(indenter: Any, nu: Any, layer: Any = None, substrate: Any = None) -> Body:
    """Return what is pressed; ValueError for anything but a ball on a half-space, or on a film on an elastic base."""
    if not isinstance(indenter, jc.Sphere):
        raise ValueError(f"adhesion: expected a Sphere, got {type(indenter).__name__}")
    nu = float(Compressibility.of(nu, None).value)
    if layer is None and substrate is None:
        return Body(nu, indenter)
    if not isinstance(layer, int | float | np.number) or not 0.0 < float(layer) < math.inf:
        raise ValueError(
            f"layer: expected a thickness > 0 m with a fit of the work of adhesion, got {layer!r}"
        )
    if not isinstance(substrate, jc.Elastic) or substrate.nu is None:
        raise ValueError(
            f"substrate: expected Elastic with nu beside a fit of the work of adhesion, got {substrate!r}"
        )
    return Body(nu, indenter, FilmOnBase(float(layer), float(substrate.G), float(substrate.nu)))


def read_adhesive(
    data: IndentationData, ball: Any, weights: str | None, sigma: Any
) -> tuple[IndentationData, float, PullOff, np.ndarray, str]:
    """Return a curve with the zero of its load after the pull-off, the standard deviation of that zero [N], the pull-off,
    and the weights (n,) [1/N] of the points, 0 out of contact, with their label."""
    check_kind(data, IndentationData)
    if weights not in (None, "absolute"):
        raise ValueError(
            f'weights: expected None, "absolute" or sigma with adhesion, got {weights!r}: a load that changes its sign'
            " has no error in proportion to it"
        )
    data, zero_sd = zeroed(data)
    check_signs(data, float(ball.radius))
    seen = read_pull_off(data, zero_sd)
    return data, zero_sd, seen, *indentation_weights(data, seen.contact, "depth", weights, sigma)


def fit_adhesive(
    data: IndentationData, adhesion: str, body: Body, *, instrument: Instrument, weights: str | None = None,
    sigma: Any = None, fixed: dict[str, float] | None = None, bounds: dict[str, tuple] | None = None, level: float = 0.95,
) -> AdhesiveFit:  # fmt: skip
    """Fit G, the work of adhesion and, with "fit" (Maugis) but not with "JKR", the strength of the attraction; the keywords
    are those of ``fit_indentation``."""
    started = time.perf_counter()
    film, radius = body.film, float(body.ball.radius)

    # 1. A film that may be softer or stiffer than its base can have the same curve on either side.
    if film is not None and "G" not in (fixed or {}):
        low, high = (bounds or {}).get("G") or (None, None)
        if not ((high is not None and high <= film.base) or (low is not None and low >= film.base)):
            raise ValueError(
                f"bounds: expected an upper bound of G up to that of the base, {film.base:.4g} Pa, for a softer film, or a"
                f" lower bound from it on for a stiffer one, with a fit of the work of adhesion, got {(low, high)!r}: a film"
                " softer and one stiffer than the base can have the same curve"
            )
    data, zero_sd, seen, point_weights, label = read_adhesive(data, body.ball, weights, sigma)
    model = {"jkr": JKR, "fit": MaugisDugdale}[adhesion.lower()]
    test = AdhesiveTest(data, seen, body, model, point_weights)

    # 2. The search; each segment of the curve is a series of its own.
    table = table_of(model, fixed, bounds)
    space = test.space(table, instrument)
    sought = Sought(space.structure, table, Compressibility.of(body.nu, None))
    blocks = runs_of(data.segments)
    sample = Sample.of(("load", "N", data.t, data.load), point_weights, label, blocks, own_trends=True)
    problem = FitProblem(data, sought, space, sample, float(np.ptp(data.t)), level)
    solved = least_squares(problem, lambda weights: test.objective(space, weights), test.starts(space))
    best, objective = solved.search_result
    change = lambda load: moved(best, objective.free, solved.weights * load)

    def with_range() -> np.ndarray:
        """Return the coordinates (m,) of the fit of Maugis's theory, without that of the strength."""
        other = test._replace(model=MaugisDugdale)
        ranged = other.space(table_of(other.model, fixed, bounds), instrument)
        found = minimise_from(other.objective(ranged, solved.weights), other.starts(ranged))
        return np.delete(found.theta, MaugisDugdale._fields.index("strength"))

    # 3. The error of the zero of the load, and systematic deviations: a trend, and on a film a range of the attraction.
    solved = solved._replace(kept=seen.contact, shift=change(np.full(data.load.size, zero_sd)))
    off = deviation(test, problem, solved, with_range if model is JKR and film is None else None)
    systematic, notes = off.systematic, off.notes
    if film is not None:
        by_range = np.abs(change(TENSION * np.minimum(data.load, 0.0)))
        systematic, notes = systematic + by_range, (*notes, FILM_NOTE)
    solved = solved._replace(systematic=systematic, against=off.against, notes=(*solved.notes, *notes))
    found = conclude(problem, solved)
    values, intervals = found.common.values, found.common.intervals
    G, work = values["G"], values["work"]

    # 4. The law of adhesion, none for JKR, and whether the curve determines its range.
    law, tabor, notes = None, math.nan, found.common.notes
    if model is not JKR:
        of = lambda law: float(law.tabor_number(radius, body.modulus(G)))
        law = jc.DugdaleAdhesion(work, values["strength"])
        tabor = of(law)
        if not found.common.identified["strength"]:
            low, high = intervals["strength"]
            ends = [of(jc.DugdaleAdhesion(work, s)) if 0.0 < s < math.inf else s for s in (low, high)]
            notes = (
                *notes,
                f"the range of the attraction is not identified: strength {text.span(low, high)} Pa, a Tabor number"
                f" {text.span(*ends)}; the interval of the work of adhesion allows for it",
            )

    # 5. The largest tension of the fitted curve. On a half-space with JKR it is 3/2 pi w R, whose interval is that of
    # the work; otherwise it depends on the other parameters too, and its interval is that of its logarithm by
    # linearisation.
    if film is None and model is JKR:
        unit = 1.5 * math.pi * radius
        low, high = intervals["work"]
        pull_off = unit * work, unit * low, unit * high
    else:
        force, slope = test.pull_off(space, best.theta)
        pull_off = interval_of_tension(force, slope[space.free], solved, found)

    deepest = float(data.depth.max() - space.to_si(best.theta)[space.names.index("contact_point")])
    return found.fit(
        AdhesiveFit, material=jc.Elastic(G, body.nu), law=law, tabor_number=tabor,
        notes=(*notes, *paraboloid_note(body.ball, deepest)), pull_off=pull_off,
        separation_work=seen.separation_work(noise.two_sided(level)), nu=body.nu, indenter=body.ball,
        film=film, nuisances=space.fitted_nuisances(best.theta, found.ends), kept=seen.contact,
        starts=(best.starts, best.agreed),
        runs=(objective.residual_runs, objective.jacobian_runs), seconds=time.perf_counter() - started,
    )  # fmt: skip


def interval_of_tension(force: float, slope: np.ndarray, solved: Any, concluded: Conclusion) -> Interval:
    """Return a force with its interval, linearised in its logarithm.

    slope (k,): derivative of log force with respect to the free coordinates.
    """
    best, objective = solved.search_result
    inside = (best.theta > objective.lower)[objective.free] & (best.theta < objective.upper)[objective.free]
    slope = np.where(inside, slope, 0.0)
    rise = float(concluded.assessment.levels(slope[:, None])[0]) - best.rss
    spread = slope[inside] @ inverse(best.jacobian[:, inside]) @ slope[inside]
    systematic = (
        0.0 if solved.systematic is None else float(np.abs(slope) @ np.abs(solved.systematic)[objective.free])
    )
    shift = 0.0 if solved.shift is None else float(slope @ solved.shift[objective.free])
    far = noise.two_sided(concluded.common.level) * shift
    growth = math.exp(math.hypot(math.sqrt(max(rise * spread, 0.0)), far) + systematic)
    return force, force / growth, force * growth


# Fit of a viscoelastic film and the work of adhesion to an adhesive force curve: approach, dwell and retraction.


WIDER_GRID, WIDENINGS = 1.3, 4  # of the grid, where the contact reaches its edge
FEW_COHESIVE = 3  # cells across the zone of attraction, as in the notes of ``indent``
BAD = jc.Status.NOT_CONVERGED, jc.Status.INHERITED


def fit_creeping_film(
    data: IndentationData, law: Any, model: Any, *, control: Any, indenter: Any, nu: Any, thickness: Any, substrate: Any,
    instrument: Instrument, weights: str | None, sigma: Any, fixed: dict[str, float] | None,
    bounds: dict[str, tuple] | None, level: float,
) -> AdhesiveFit:  # fmt: skip
    """Fit the material and the work of adhesion of a film, with the range or strength of the law held.

    law: a law of adhesion, whose work is the start; thickness [m] of the film; the other arguments are those of
    ``fit_indentation``.
    """
    started = time.perf_counter()

    # 1. The material, and bounds that keep it softer than its base: a stiffer film can have the same curve.
    if thickness is None and substrate is None:
        raise ValueError(
            f'adhesion: expected "fit", "JKR" or a work of adhesion [J/m2] on a half-space, got {law!r}'
        )
    material = resolve(model).model
    if material not in SHARES:
        elastic = ': adhesion="JKR" fits an elastic film' if material is jc.Elastic else ""
        raise ValueError(
            f"model: expected one of {sorted(known.__name__ for known in SHARES)} with a law of adhesion, got"
            f" {material.__name__}{elastic}"
        )
    if control != "depth":
        raise ValueError(f'control: expected "depth" with a law of adhesion, got {control!r}')
    spring = "G" if material is jc.Maxwell else "G1"
    most = ((bounds or {}).get(spring) or (None, None))[1]
    if isinstance(substrate, jc.Elastic) and (most is None or not most <= float(substrate.G)):
        raise ValueError(
            f"bounds: expected an upper bound of {spring} up to the modulus of the base, {float(substrate.G):.4g} Pa, got"
            f" {most!r}: a film softer and one stiffer than the base can have the same curve"
        )

    # 2. Starting values: the modulus of a half-space with the same curve, and the contact radius that it has.
    body = body_of(indenter, nu, thickness, substrate)
    data, zero_sd, seen, point_weights, label = read_adhesive(data, body.ball, weights, sigma)
    half_space = AdhesiveTest(data, seen, Body(body.nu, body.ball), JKR, point_weights)
    G, work, duration = half_space.start()["G"], float(law.work), float(np.ptp(data.t))
    R = float(body.ball.radius)
    neck = np.cbrt(math.pi * work * R**2 / float(body.modulus(G)))
    radius = float(math.sqrt(R * float(np.ptp(data.depth[seen.contact]))) + neck)
    film = AdhesiveFilm(body.nu, Coating.of(thickness, None, substrate), body.ball, law)
    test = CreepingFilm(
        data, seen, film, material, starting_values(material, G, work, duration), point_weights
    )

    # 3. The search on a grid that is widened while the contact reaches its edge.
    structure = structure_with_work(material)
    table = limits(structure, fixed, bounds)
    space = test.space(table, instrument)
    blocks = runs_of(data.segments)
    sample = Sample.of(("load", "N", data.t, data.load), point_weights, label, blocks)
    sought = Sought(structure, table, Compressibility.of(body.nu, None))
    problem = FitProblem(data, sought, space, sample, duration, level)

    def searched(run: Run, starts: list[np.ndarray]) -> Solved:
        return least_squares(problem, lambda weights: test.objective(space, weights, run), starts)

    def statuses_and_cells(solved: Solved) -> tuple[np.ndarray, float]:
        """Return statuses up to the last point in contact, and the fewest cells across the zone of attraction (finer
        grid)."""
        last = float(run.t[np.flatnonzero(seen.contact)[-1]])
        _, status, cells = linearise(solved.theta, space.free, point_weights, run, material)[2]
        reached = np.asarray(run.times) <= last
        return np.asarray(status)[reached], FINER * float(np.min(np.asarray(cells)[reached]))

    run, starts = test.run(space, 2.0 * MARGIN * radius), test.starts(space)
    for _ in range(WIDENINGS):
        coarse = searched(run, starts)
        statuses, _ = statuses_and_cells(coarse)
        if not np.any(statuses == jc.Status.AT_EDGE):
            break
        run, starts = test.run(space, WIDER_GRID * float(run.grid.width[0])), [coarse.theta]

    # 4. The same with the correction of the finer grid. What it changes gives the systematic errors of the coordinates, to
    # which the error of the zero of the load is added.
    run = run._replace(correction=test.correction(coarse.theta, space, run))
    solved = searched(run, [coarse.theta])
    (first, first_objective), (best, objective) = coarse.search_result, solved.search_result
    objective.residual_runs += first_objective.residual_runs
    objective.jacobian_runs += first_objective.jacobian_runs
    discretisation = np.abs(solved.theta - coarse.theta) / REMAINING
    shift = moved(best, objective.free, solved.weights * zero_sd)

    # 5. Reasons against a fit whose model is not solved at all times in contact, or not resolved.
    statuses, cells = statuses_and_cells(solved)
    not_converged = int(np.sum(np.isin(statuses, BAD)))
    at_edge = int(np.sum(statuses == jc.Status.AT_EDGE))
    against = []
    if not_converged:
        against.append(
            f"the contact of the best fit did not converge at {not_converged} of {statuses.size} times"
        )
    if at_edge:
        against.append(f"the contact of the best fit reaches the edge of the grid at {at_edge} times")
    if cells < FEW_COHESIVE:
        against.append(
            f"{told_apart(cells, FEW_COHESIVE)}"
            f" cells across the zone of attraction at the edge of contact, and below {FEW_COHESIVE} the fit"
            " depends on the grid: give a law of longer range, which hardly changes the pull-off at Tabor numbers above 3"
        )
    solved = solved._replace(
        shift=shift, systematic=discretisation, kept=seen.contact, against=tuple(against)
    )
    concluded = conclude(problem, solved)

    # 6. The fitted law and material, and the largest tension: the lowest load of the fitted curve in contact, with its
    # slope by the coordinates from that row of the Jacobian.
    values = dict(concluded.common.values)
    law = with_work(law, values.pop("work"))
    fitted = material(**values, nu=body.nu)
    tabor = float(law.tabor_number(R, body.modulus(1.0 / float(fitted.creep(0.0)))))
    outside = np.full(data.t.size, np.inf)
    load = data.load + np.divide(best.residual, solved.weights, out=outside, where=solved.weights > 0.0)
    lowest = int(np.argmin(load))
    force = -float(load[lowest])
    slope = -best.jacobian[lowest] / (solved.weights[lowest] * force)
    note = (
        f"the range of the attraction is held at {float(law.characteristic_range):.3g} m; grid of {CELLS} x {CELLS} cells"
        f" over {float(run.grid.width[0]):.3g} m, corrected by a finer one"
    )
    return concluded.fit(
        AdhesiveFit, material=fitted, law=law, tabor_number=tabor, notes=(*concluded.common.notes, note),
        pull_off=interval_of_tension(force, slope, solved, concluded),
        separation_work=seen.separation_work(noise.two_sided(level)), nu=body.nu, indenter=body.ball, film=body.film,
        nuisances=space.fitted_nuisances(best.theta, concluded.ends), kept=seen.contact,
        runs=(objective.residual_runs, objective.jacobian_runs), starts=(first.starts, first.agreed),
        seconds=time.perf_counter() - started,
    )  # fmt: skip
