"""Search of the fit of an adhesive force curve, approach and retraction, of an elastic half-space or film.

The load is fitted as a function of the measured depth by a closed form (``fitting.models.adhesive_curve``), on a film by
that of ``fitting.models.adhesive_film``. Coordinates are the logarithms of shear modulus, work of adhesion and strength,
over starting values that follow from the lowest and the highest point of the curve, and the contributions of the instrument
to the depth.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.data.indentation import IndentationData
from fitting.data.pull_off import PullOff
from fitting.models.adhesive_curve import MaugisDugdale, largest_tension, load_at
from fitting.models.adhesive_film import Extent, FilmOnBase, FilmSeries, series_of
from fitting.models.adhesive_film import largest_tension as film_tension
from fitting.models.adhesive_film import load_at as film_load
from fitting.models.coordinates import NUISANCES
from fitting.models.search_space import ParameterSpace
from fitting.models.structure import ParameterList, limits
from fitting.search import padding
from fitting.search.nonlinear import Objective
from fitting.search.press import Instrument

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
        with jax.ensure_compile_time_eval():  # a number inside jit as well
            return float(self.ball.compliance())


class AdhesiveTest(NamedTuple):
    """A force curve ready for a search.

    data; seen: its ``PullOff``; body; model: the class of the parameters; weights (n,) [1/N], 0 out of contact; zero: bound
    on the error of the zero of the load [N].
    """

    data: IndentationData
    seen: PullOff
    body: Body
    model: type
    weights: np.ndarray
    zero: float

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
        if self.model is MaugisDugdale:
            K = 4.0 * modulus / 3.0  # lambda = 1
            values["strength"] = float(0.5 * np.cbrt(math.pi * work * K**2 / R))
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
        structure, start, sizes = structure_of_model(self.model), self.start(), sizes_of(self.data)
        rows = [
            log_bounds(table[name], start[name], PARAMETERS if i > 1 else (-WIDE, WIDE))
            for i, name in enumerate(structure.where)
        ]
        nuisances = instrument.box(sizes)
        if isinstance(instrument.contact_point, str):  # about the measured depths, whose zero is arbitrary
            nuisances[0] += float(self.data.depth.min()) / sizes[0] + np.array([0.0, 1.0])
        return space_of(structure, start, sizes, np.concatenate([np.array(rows), nuisances]))

    def starts(self, space: ParameterSpace) -> list[np.ndarray]:
        """Return starting coordinates, for the closed form with a strength at several of them."""
        k = space.structure.size
        theta = np.zeros(space.lower.size)
        theta[k] = self.first_touch() / space.unit[k]
        place, several = 0, MODULI
        if self.body.film is None:
            place, several = 2, STARTS if self.model is MaugisDugdale else STARTS[1:2]
        rows = [np.where((np.arange(theta.size) == place) & (place < k), shift, theta) for shift in several]
        return [np.clip(row, *space.bounds) for row in rows]

    def objective(self, space: ParameterSpace, weights: np.ndarray) -> Objective:
        """Return the least squares over the coordinates."""
        n = self.data.t.size
        times = self.data.t - self.data.t[0]
        samples = tuple(padding.repeated(x) for x in (times, self.data.depth, self.data.load))
        body = jnp.array([self.body.nu, self.body.own, float(self.body.ball.radius)])
        given = (
            padding.without_weight(weights),
            samples,
            space.unit,
            body,
        )  # numbers of points share a program
        residual, slopes = self._functions(space)
        return Objective(
            lambda theta: np.asarray(residual(theta, *given))[:n],
            lambda theta, free: np.asarray(slopes(theta, *given)[:, free])[:n],
            *space.bounds,
            ftol=1e-12, close=2e-3, floor=1e-26 * float(np.sum((weights * self.data.load) ** 2)),
        )  # fmt: skip

    def pull_off(self, space: ParameterSpace, theta: np.ndarray) -> tuple[float, np.ndarray]:
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

    def _functions(self, space: ParameterSpace) -> tuple[Callable[..., Array], Callable[..., Array]]:
        """Return the residuals and their Jacobian as functions of the coordinates and the arrays of ``objective``."""
        film = self.body.film
        if film is None:
            return _residual, _slopes
        size = film.thickness, self._extent(film)

        def at(theta: np.ndarray) -> tuple[FilmSeries, float, tuple[float, Extent]]:
            log_G = float(theta[0]) + math.log(space.unit[0])
            return series_of(log_G, self.body.nu, self.body.own, film, size[1]), float(theta[0]), size

        return (
            lambda theta, *given: _film_residual(theta, *at(theta), *given),
            lambda theta, *given: _film_slopes(theta, *at(theta), *given),
        )

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


def log_bounds(given: tuple[float, float], unit: float, whole: tuple[float, float]) -> tuple[float, float]:
    """Return the bounds of a logarithm, those of the parameter where they are given and else those of the search."""
    low, high = given
    return (math.log(low / unit) if low > 0.0 else whole[0]), (
        math.log(high / unit) if math.isfinite(high) else whole[1]
    )


def space_of(
    structure: ParameterList, start: dict[str, float], sizes: np.ndarray, box: np.ndarray
) -> ParameterSpace:
    """Return the coordinates: logarithms of the parameters over their starting values, and the instrument's contributions.

    sizes (3,): units of the latter; box (k + 3, 2): bounds of all.
    """
    unit = np.array([start[name] for name in structure.where])
    own = np.arange(len(box)) < structure.size
    return ParameterSpace(
        structure=structure, lower=box[:, 0], upper=box[:, 1], unit=np.append(unit, sizes), logarithmic=own,
        material=own, names=(*structure.where, *NUISANCES), open=np.ones((len(box), 2), dtype=bool),
    )  # fmt: skip


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
    theta: Array, weights: Array, samples: tuple[Array, Array, Array], unit: Array, body: Array
) -> Array:
    """Return the weighted residuals (n,) of the closed form.

    samples: times, depths and loads, (n,); body: Poisson's ratio, and compliance and radius of the ball.
    """
    values, (nu, own, radius), (t, depth, load) = jnp.exp(theta[:-3]) * unit[:-3], body, samples
    approach = depth - _offset(theta[-3:] * unit[-3:], t, load)
    approach = jnp.where(weights > 0.0, approach, 0.0)
    strength = values[2] if values.size > 2 else None
    model = load_at(approach, 2.0 / ((1.0 - nu) / values[0] + own), values[1], radius, strength)
    return weights * (model - load)


@jax.jit
def _film_residual(
    theta: Array, series: FilmSeries, at: Array, size: tuple[Array, Extent],
    weights: Array, samples: tuple[Array, Array, Array], unit: Array, body: Array,
) -> Array:  # fmt: skip
    """Return the weighted residuals (n,) on a film; series: for the coordinate ``at`` of its modulus."""
    (G, work), (nu, own, radius), (t, depth, load) = jnp.exp(theta[:2]) * unit[:2], body, samples
    approach = depth - _offset(theta[-3:] * unit[-3:], t, load)
    approach = jnp.where(weights > 0.0, approach, 0.0)
    model = film_load(approach, theta[0] - at, series, ((1.0 - nu) / G + own, work, radius), size)
    return weights * (model - load)


@jax.jit
def _film_slopes(theta: Array, *given: Any) -> Array:
    """Return the Jacobian (n, m) of the residuals on a film."""
    return jax.jacfwd(lambda at: _film_residual(at, *given))(jnp.asarray(theta))


@jax.jit
def _slopes(theta: Array, *given: Array) -> Array:
    """Return the Jacobian (n, m) of the residuals."""
    return jax.jacfwd(lambda at: _residual(at, *given))(jnp.asarray(theta))
