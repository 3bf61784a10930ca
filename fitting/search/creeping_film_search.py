"""Search of the fit of an adhesive force curve, approach, dwell and retraction, of a viscoelastic film on a base.

A receding edge on a viscoelastic solid has no closed form, so that the contact solver is the model: the measured depth is
prescribed over the whole history, and the load at the points in contact is fitted. The range of the attraction (or its
strength) is held, because the curve in contact hardly determines it. Coordinates are the logarithms of the parameters of the
material and of the work of adhesion, over starting values, and the contributions of the instrument to the depth.

The difference between the load on a grid of twice the cells with steps of half the length and that on the grid of the
search, at the optimum, is added to the model, and the fit is repeated. What this changes in the coordinates, divided by
``LEFT``, remains as a systematic error.
"""

from __future__ import annotations

import collections
import functools
import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.data.indentation import IndentationData
from fitting.data.pull_off import PullOff
from fitting.models.search_space import ParameterSpace
from fitting.models.structure import ParameterList, resolve
from fitting.search.adhesive_search import WIDE, log_bounds, sizes_of, space_of
from fitting.search.layered import Coating, march_times, polygon
from fitting.search.nonlinear import Objective
from fitting.search.press import Instrument

CELLS, FINER = 32, 2  # cells along a side, and the factor on cells and steps of the run that corrects
LEFT = 3.0  # second order: of the change, a third remains
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

    data; seen: its ``PullOff``; film; material: the class; start: {parameter: value}; radius: of the contact that is
    expected [m]; weights (n,) [1/N], 0 out of contact.
    """

    data: IndentationData
    seen: PullOff
    film: AdhesiveFilm
    material: type
    start: dict[str, float]
    radius: float
    weights: np.ndarray

    def space(self, table: dict[str, tuple[float, float]], instrument: Instrument) -> ParameterSpace:
        """Return the coordinates of the search."""
        structure, sizes = structure_with_work(self.material), sizes_of(self.data)
        rows = [log_bounds(table[name], self.start[name], (-WIDE, WIDE)) for name in structure.where]
        return space_of(structure, self.start, sizes, np.concatenate([np.array(rows), instrument.box(sizes)]))

    def starts(self, space: ParameterSpace) -> list[np.ndarray]:
        """Return starting coordinates, for each of ``TIMES`` where there is a retardation time."""
        theta, names = np.zeros(space.lower.size), list(space.structure.where)
        if "eta2" not in names:
            return [np.clip(theta, *space.bounds)]
        place = np.arange(theta.size) == names.index("eta2")
        return [np.clip(np.where(place, math.log(time), theta), *space.bounds) for time in TIMES]

    def run(self, space: ParameterSpace, width: float, finer: int = 1) -> Run:
        """Return the inputs of the solver on a grid of a width [m], with ``finer`` times the cells and the steps."""
        since = self.data.t - self.data.t[0]
        size = float(np.ptp(self.data.depth))
        knots = march_times(since, self.data.depth / size)
        depth = polygon(since, self.data.depth / size, knots) * size
        steps = np.interp(
            np.arange((knots.size - 1) * finer + 1) / finer, np.arange(knots.size), knots
        )  # between the knots
        grid = jc.Grid.square(n=CELLS * finer, width=width)
        numbers = Run(
            self.film, grid, steps, np.interp(steps, knots, depth), since, self.data.load, np.zeros(since.size),
            space.unit,
        )  # fmt: skip
        return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=float), numbers)

    def objective(self, space: ParameterSpace, weights: np.ndarray, run: Run) -> Objective:
        """Return the least squares over the coordinates."""
        weighted = jnp.asarray(weights)
        return Objective(
            lambda theta: np.asarray(weighted * (loads(theta, run, self.material)[0] - run.load)),
            lambda theta, free: np.asarray(_slopes(theta, jnp.asarray(free), weighted, run, self.material)),
            *space.bounds, ftol=1e-5, close=1e-2,
        )  # fmt: skip

    def correction(self, theta: np.ndarray, space: ParameterSpace, run: Run) -> np.ndarray:
        """Return the load on a finer grid with shorter steps less that of a run, (n,) [N]."""
        finer = self.run(space, float(run.grid.width[0]), FINER)
        difference = loads(theta, finer, self.material)[0] - loads(theta, run, self.material)[0]
        return np.asarray(difference + run.correction)


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
def _slopes(theta: Array, free: Array, weights: Array, run: Run, material: type) -> Array:
    """Return the Jacobian (n, k) of the residuals at the points in contact; 0 elsewhere."""
    at = jnp.asarray(theta)
    slopes = jax.jacfwd(lambda some: loads(at.at[free].set(some), run, material)[0])(at[free])
    return jnp.where(weights[:, None] > 0.0, weights[:, None] * slopes, 0.0)
