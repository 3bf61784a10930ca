"""Search of the fit of an adhesive force curve, approach and retraction, of an elastic half-space or film.

The load is fitted as a function of the measured depth. On a half-space the model is a closed form
(``fitting.models.adhesive_curve``), otherwise ``jc.indent`` with a law of adhesion. Coordinates are the logarithms of shear
modulus, work of adhesion and strength or range, over starting values that follow from the lowest and the highest point of
the curve, and the contributions of the instrument to the depth.
"""

import math
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.data.indentation import IndentationData
from fitting.data.pull_off import PullOff
from fitting.models.adhesive_curve import MaugisDugdale, load_at
from fitting.models.coordinates import NUISANCES
from fitting.models.search_space import ParameterSpace
from fitting.models.structure import ParameterList, limits
from fitting.search import padding
from fitting.search.nonlinear import Objective
from fitting.search.press import Instrument

WIDE = 7.0  # of the logarithms of modulus and work about their starting values
PARAMETERS = (
    -5.0,
    4.0,
)  # of the logarithm of Maugis's parameter, or of the range of a law over its starting value
STARTS = -2.0, 0.0, 2.0  # of the logarithm of Maugis's parameter
ACROSS = 5.0  # width of the grid over the largest contact radius


class ExponentialSolid(NamedTuple):
    """An elastic solid of shear modulus G [Pa] with an ``ExponentialAdhesion`` of work [J/m2] and range [m]."""

    G: float
    work: float
    range: float


UNITS = {"G": "Pa", "work": "J/m2", "strength": "Pa", "range": "m"}
MODELS = {jc.DugdaleAdhesion: MaugisDugdale, jc.ExponentialAdhesion: ExponentialSolid}


def structure_of_model(model: type) -> ParameterList:
    """Return the list of parameters of a model."""
    return ParameterList.of(model, {name: UNITS[name] for name in model._fields})  # type: ignore[attr-defined]


class Body(NamedTuple):
    """What is pressed: Poisson's ratio, the ball, and of a film its thickness [m] and its substrate; None: a half-space."""

    nu: float
    ball: Any
    thickness: float | None = None
    substrate: Any = None

    def modulus(self, G: Any) -> Any:
        """Return E* [Pa] of the contact of the ball with a half-space of shear modulus G [Pa]."""
        return 2.0 / ((1.0 - self.nu) / G + self.own)

    @property
    def own(self) -> float:
        """The compliance (1 - nu)/G of the ball [1/Pa]."""
        with jax.ensure_compile_time_eval():  # a number inside jit as well
            return float(self.ball.compliance())

    def pressed(self, G: Any) -> jc.LayeredHalfSpace:
        """Return the body of shear modulus G."""
        solid = jc.Elastic(G, self.nu)
        if self.thickness is None:
            return jc.LayeredHalfSpace([], solid)
        return jc.LayeredHalfSpace([jc.Layer(solid, self.thickness)], self.substrate)


class AdhesiveTest(NamedTuple):
    """A force curve ready for a search.

    data; seen: its ``PullOff``; body; law: a law of adhesion whose parameters the solver starts from, or None for a closed
    form; model: the class of the parameters; weights (n,) [1/N], 0 out of contact; cells: along a side of the grid.
    """

    data: IndentationData
    seen: PullOff
    body: Body
    law: Any
    model: type
    weights: np.ndarray
    cells: int

    def start(self) -> dict[str, float]:
        """Return starting values: the lowest load is that of JKR, and the modulus follows from the highest point."""
        R, pull = float(self.body.ball.radius), self.seen.force
        work = pull / (1.5 * math.pi * R)
        top = float(self.data.load.max())
        of_unit_modulus = self._jkr_depth(top, work) - self._jkr_depth(-pull * (1.0 - 1e-9), work)
        low = float(self.data.depth[np.flatnonzero(self.data.segments == "retract")][self._lowest()])
        way = max(float(self.data.depth.max()) - low, 1e-3 * float(np.ptp(self.data.depth)))
        modulus = (of_unit_modulus / way) ** 1.5
        own = self.body.own
        G = (1.0 - self.body.nu) / max(2.0 / modulus - own, 0.1 / modulus)
        values = {"G": G, "work": work}
        if self.model is MaugisDugdale and self.law is None:
            K = 4.0 * modulus / 3.0  # lambda = 1
            values["strength"] = float(0.5 * np.cbrt(math.pi * work * K**2 / R))
        elif self.law is not None:
            values |= {name: float(getattr(self.law, name)) for name in self.model._fields[1:]}  # type: ignore[attr-defined]
        return values

    def first_touch(self) -> float:
        """Return the measured depth [m] at which the surfaces would touch without adhesion, at the starting values."""
        values = self.start()
        E = float(self.body.modulus(values["G"]))
        return float(self.data.depth.max()) - self._jkr_depth(float(self.data.load.max()), values["work"], E)

    def _lowest(self) -> int:
        return int(np.argmin(self.data.load[np.flatnonzero(self.data.segments == "retract")]))

    def _jkr_depth(self, load: float, work: float, modulus: float = 1.0) -> float:
        """Return the approach [m] of JKR under a load [N]."""
        R = float(self.body.ball.radius)
        pull = 3.0 * math.pi * work * R
        a = np.cbrt(0.75 * R / modulus * (load + pull + math.sqrt(max(2.0 * pull * load + pull**2, 0.0))))
        return float(a**2 / R - math.sqrt(2.0 * math.pi * a * work / modulus))

    def space(self, table: dict[str, tuple[float, float]], instrument: Instrument) -> ParameterSpace:
        """Return the coordinates of the search."""
        structure, start = structure_of_model(self.model), self.start()
        unit = np.array([start[name] for name in structure.where])
        rows = [
            _row(table[name], unit[i], PARAMETERS if i > 1 else (-WIDE, WIDE))
            for i, name in enumerate(structure.where)
        ]
        depth, load = float(np.ptp(self.data.depth)), float(np.ptp(self.data.load))
        sizes = depth / np.array([1.0, float(np.ptp(self.data.t)), load])
        box = np.concatenate([np.array(rows), instrument.box(sizes)])
        own = np.arange(len(box)) < structure.size
        return ParameterSpace(
            structure=structure, lower=box[:, 0], upper=box[:, 1], unit=np.append(unit, sizes), logarithmic=own,
            material=own, names=(*structure.where, *NUISANCES), open=np.ones((len(box), 2), dtype=bool),
        )  # fmt: skip

    def starts(self, space: ParameterSpace) -> list[np.ndarray]:
        """Return starting coordinates, for the closed form with a strength at several of them."""
        k = space.structure.size
        theta = np.zeros(space.lower.size)
        theta[k] = self.first_touch() / space.unit[k]
        several = STARTS if self.model is MaugisDugdale and self.law is None else (0.0,)
        rows = [np.where(np.arange(theta.size) == 2, shift, theta) if k > 2 else theta for shift in several]
        return [np.clip(row, *space.bounds) for row in rows]

    def objective(self, space: ParameterSpace, weights: np.ndarray) -> Objective:
        """Return the least squares over the coordinates."""
        n = self.data.t.size
        run, slopes = self._closed(space, weights) if self.law is None else self._solved(space, weights)
        return Objective(
            lambda theta: np.asarray(run(theta))[:n],
            lambda theta, free: np.asarray(slopes(theta, free))[:n],
            *space.bounds,
            ftol=1e-12 if self.law is None else 1e-4, close=2e-3 if self.law is None else 3e-2,
            floor=1e-26 * float(np.sum((weights * self.data.load) ** 2)),
        )  # fmt: skip

    def _closed(
        self, space: ParameterSpace, weights: np.ndarray
    ) -> tuple[Callable[..., Any], Callable[..., Any]]:
        """Return residuals and Jacobian of the closed form, of which numbers of points share a program."""
        t, depth, load = (padding.repeated(x) for x in self._samples())
        body = jnp.array([self.body.nu, self.body.own, float(self.body.ball.radius)])
        given = (padding.without_weight(weights), t, depth, load, space.unit, body)
        return lambda theta: _residual(theta, *given), lambda theta, free: _slopes(theta, *given)[:, free]

    def _solved(
        self, space: ParameterSpace, weights: np.ndarray
    ) -> tuple[Callable[..., Any], Callable[..., Any]]:
        """Return residuals and Jacobian of the contact solver."""
        times, depth, load = self._samples()
        unit, k, grid = jnp.asarray(space.unit), space.structure.size, self.grid()

        def residual(theta: Array) -> Array:
            approach = depth - _offset(theta[k:] * unit[k:], times, load)
            history = self.pressed(jnp.exp(theta[:k]) * unit[:k], approach, grid)
            return jnp.where(weights > 0.0, weights * (history.load - load), 0.0)

        run = jax.jit(residual)
        pushed = jax.jit(lambda theta, along: jax.jvp(residual, (theta,), (along,))[1])

        def slopes(theta: np.ndarray, free: np.ndarray) -> np.ndarray:
            return np.stack([np.asarray(pushed(theta, np.eye(theta.size)[i])) for i in free], -1)

        return run, slopes

    def pressed(self, values: Any, approach: Any, grid: jc.Grid) -> Any:
        """Return the history of the contact for parameters (3,), in SI, at approaches (n,) [m]."""
        G, work, last = values
        return jc.indent(
            self.body.pressed(G), self.body.ball, jc.Approach(approach), self._samples()[0], grid=grid,
            adhesion=type(self.law)(work, last), save="last", tolerance=1e-6, max_iterations=2000,
        )  # fmt: skip

    def failures(self, space: ParameterSpace, theta: np.ndarray) -> tuple[str, ...]:
        """Return the statuses in words of the fitted points at which the contact solver failed at a vector theta."""
        times, depth, load = self._samples()
        k = space.structure.size
        si = space.to_si(theta)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they become reasons against the fit
            history = self.pressed(si[:k], depth - np.asarray(_offset(si[k:], times, load)), self.grid())
        codes = np.asarray(history.status)[self.weights > 0.0]
        return tuple(
            f"the contact solver: {jc.Status(int(code)).message}" for code in np.unique(codes[codes > 0])
        )

    def _samples(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return times from the first point [s], depth [m] and load [N], (n,) each."""
        return self.data.t - self.data.t[0], self.data.depth, self.data.load

    def _width(self) -> float:
        """Return the width of the grid [m]."""
        values = self.start()
        R, E = float(self.body.ball.radius), float(self.body.modulus(values["G"]))
        pull = 3.0 * math.pi * values["work"] * R
        load = float(self.data.load.max())
        a = np.cbrt(0.75 * R / E * (load + pull + math.sqrt(max(2.0 * pull * load + pull**2, 0.0))))
        return ACROSS * float(a)

    def grid(self) -> jc.Grid:
        """Return the grid of the solver, whose width follows from the contact at the starting values."""
        return jc.Grid.square(n=self.cells, width=self._width())


def _row(given: tuple[float, float], unit: float, whole: tuple[float, float]) -> tuple[float, float]:
    """Return the bounds of a logarithm, those of the parameter where they are given and else those of the search."""
    low, high = given
    return (math.log(low / unit) if low > 0.0 else whole[0]), (
        math.log(high / unit) if math.isfinite(high) else whole[1]
    )


def table_of(
    model: type, fixed: dict[str, float] | None, bounds: dict[str, tuple] | None
) -> dict[str, tuple[float, float]]:
    """Return the bounds of the parameters of a model."""
    return limits(structure_of_model(model), fixed, bounds)


def _offset(instrument: Array, t: Array, load: Array) -> Array:
    """Return the contribution of the instrument to the depth [m], (n,)."""
    point, drift, machine = instrument
    return point + drift * t + machine * load


@jax.jit
def _residual(
    theta: Array, weights: Array, t: Array, depth: Array, load: Array, unit: Array, body: Array
) -> Array:  # fmt: skip
    """Return the weighted residuals (n,) of the closed form; body: Poisson's ratio, compliance and radius of the ball."""
    values, (nu, own, radius) = jnp.exp(theta[:-3]) * unit[:-3], body
    approach = depth - _offset(theta[-3:] * unit[-3:], t, load)
    approach = jnp.where(weights > 0.0, approach, 0.0)
    strength = values[2] if values.size > 2 else None
    model = load_at(approach, 2.0 / ((1.0 - nu) / values[0] + own), values[1], radius, strength)
    return weights * (model - load)


@jax.jit
def _slopes(theta: Array, *given: Array) -> Array:
    """Return the Jacobian (n, m) of the residuals."""
    return jax.jacfwd(lambda at: _residual(at, *given))(jnp.asarray(theta))
