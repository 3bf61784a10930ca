"""Fit of growth kinetics to the thickness of a film over time, at one or several stresses and temperatures.

The search is over log rate, activation energy over k T0, activation volume over k T0/s0 and removal rate times the
duration, with T0 and s0 a mean temperature and the largest stress of the data. The logarithm of the growth rate is linear
in the first three, so that the direction in which they compensate each other is straight. It is also the reason why
the growth rate at the mean conditions of the data is known much better than the rate, which is that at infinite temperature.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy
from jax import Array

from fitting.data.growth import GrowthData
from fitting.data.weights import choose_weights
from fitting.inference import student
from fitting.inference.conclusion import FitProblem, conclude, least_squares
from fitting.inference.evidence import Sample
from fitting.inference.result import Fit, plain
from fitting.models.kinetics import BOLTZMANN, DIMENSIONS, GrowthKinetics
from fitting.models.search_space import ParameterSpace
from fitting.models.structure import ParameterList, Sought, limits
from fitting.search import padding
from fitting.search.nonlinear import Objective
from fitting.search.uncertainty import linear_sd
from fitting.views import growth_picture, report

LARGEST = 200.0  # activation energy and work of the stress, over k T0
FASTEST = 1e4  # removal rate times the duration
REACH = 230.0  # of log rate about that of the growth rate
STARTS = (0.0, 0.3, 3.0, 30.0)  # removal rates times the duration
EXPECTED, WEAK = (
    (20.0, 1.0),
    1e-3,
)  # energy and work that are started from where the data do not say, and its weight
STRUCTURE = ParameterList.of(
    GrowthKinetics, DIMENSIONS, zeros=("activation_energy", "activation_volume", "removal_rate")
)


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class GrowthFit(Fit):
    """The fit of growth kinetics; ``Fit`` has what it shares with other fits.

    Its parameters are "rate" [m/s], "activation_energy" [J], "activation_volume" [m3] and "removal_rate" [1/s], its
    ``material`` is a ``GrowthKinetics``, and ``data`` a tuple of curves. ``curve``, ``fitted`` and ``residuals`` hold all
    curves one after the other.

    Attributes:
        reference: (stress [Pa], temperature [K]) of the mean conditions of the data.
        starts: (sought, agreed): minima that were sought, and those as low as this one.
    """

    reference: tuple[float, float]
    starts: tuple[int, int]
    slopes: np.ndarray = dataclasses.field(repr=False)

    def growth_rate(
        self, stress: float | None = None, temperature: float | None = None
    ) -> tuple[float, float, float]:
        """Return the growth rate without removal R [m/s] and the ends of its interval, linearised in log R, at a stress [Pa]
        and a temperature [K], each by default that of ``reference``."""
        at = [
            own if given is None else given
            for given, own in zip((stress, temperature), self.reference, strict=True)
        ]
        best = float(self.material.growth_rate(*at))
        spread = self._spread(lambda kinetics: jnp.log(kinetics.growth_rate(*at)))
        with np.errstate(over="ignore"):
            return best, best * float(np.exp(-spread)), best * float(np.exp(spread))

    def predict(self, t: Any, stress: Any = None, temperature: Any = None, initial: Any = 0.0) -> np.ndarray:
        """Return the thickness [m] at times t [s], of any shape, from an initial one [m]; stress [Pa] and temperature [K]:
        by default those of ``reference``."""
        return np.asarray(self._thickness(t, stress, temperature, initial)(self.material))

    def band(
        self, t: Any, stress: Any = None, temperature: Any = None, initial: Any = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the limits (low, high) of the thickness [m] at the fit's level, linearised; arguments as in ``predict``."""
        run = self._thickness(np.atleast_1d(t), stress, temperature, initial)
        best, spread = np.asarray(run(self.material)), self._spread(run)
        return np.maximum(best - spread, 0.0), best + spread

    def _thickness(
        self, t: Any, stress: Any, temperature: Any, initial: Any
    ) -> Callable[[GrowthKinetics], Array]:
        own = self.reference
        at = own[0] if stress is None else stress, own[1] if temperature is None else temperature
        return lambda kinetics: kinetics.thickness(t, *at, initial)

    def _spread(self, run: Callable[[GrowthKinetics], Array]) -> np.ndarray:
        """Half the interval of a function of the kinetics, at the fit's level."""
        names = list(self.values)
        free = [i for i, name in enumerate(names) if name not in self.fixed]
        best, unit = self.estimate.best, self._units()
        moved = lambda z: run(GrowthKinetics(*_si(z, jnp.asarray(unit))))
        z = np.append(np.log(best[:1]), best[1:] / unit[1:])
        gradient = np.asarray(jax.jacfwd(moved)(jnp.asarray(z)))
        sd = linear_sd(self.slopes, np.atleast_2d(gradient)[:, free], np.ones(len(free), dtype=bool))
        return student.two_sided(self.level) * sd.reshape(gradient.shape[:-1])

    def _units(self) -> np.ndarray:
        return Curves.of(self.data).unit

    def plot(self, path: Any = None) -> Any:
        """Figure of the curves with the fit, the residuals and the parameters; saved where a path is given."""
        return growth_picture.draw(self, path)

    def to_dict(self) -> dict[str, Any]:
        """As ``Fit.to_dict``, with the conditions of the curves and the growth rate at their mean."""
        curves = [
            {"stress_Pa": one.stress, "temperature_K": one.temperature, "points": one.t.size}
            for one in self.data
        ]
        rate = dict(zip(("value", "low", "high"), map(plain, self.growth_rate()), strict=True))
        stress, temperature = self.reference
        at = {"stress_Pa": stress, "temperature_K": temperature, "growth_rate_m_per_s": rate}
        own = {"curves": curves, "reference": at, "starts": self.starts[0], "starts_agreed": self.starts[1]}
        return super().to_dict() | own

    def _points(self) -> str:
        several = f"{len(self.data)} curves, " if len(self.data) > 1 else ""
        return f"{several}{super()._points()}"

    def _combination_lines(self) -> list[str]:
        best, low, high = self.growth_rate()
        stress, temperature = self.reference
        interval = report.span(low, high) if math.isfinite(high) else "not determined"
        return [
            f"  growth rate at {stress:.4g} Pa and {temperature:.4g} K = {best:.5g} m/s, {100 * self.level:g} %"
            f" interval {interval}"
        ]

    def _conditions(self) -> list[str]:
        return [f"  {self.starts[1]} of {self.starts[0]} starts came to this minimum"]


def fit_growth(
    data: GrowthData | Sequence[GrowthData], *, weights: str | None = None, fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None, level: float = 0.95,
) -> GrowthFit:  # fmt: skip
    """Fit rate, activation energy, activation volume and removal rate to growth curves of a film.

        dh/dt = rate exp(-(activation_energy - activation_volume stress)/(k T)) - removal_rate h

    with the stress and the temperature T of each curve, which are constant. All curves have one law of errors. The
    activation energy takes two temperatures, and the activation volume two stresses; otherwise the fit says that they are not
    determined, unless they are held. Thicknesses that have reached their steady value determine growth over removal only.

    Source: N. N. Gosvami et al., Science 348 (2015) 102; J. Zhang, H. Spikes, Tribol. Lett. 63 (2016) 24.

    Args:
        data: one ``GrowthData``, or a sequence of them for several stresses and temperatures.
        weights: "estimated" (the default without standard deviations in the data): errors a + b h, estimated;
            "relative" (errors in proportion to the thickness) or "absolute" (one error for all).
        fixed: {parameter: value} of any subset of "rate" [m/s], "activation_energy" [J], "activation_volume" [m3] and
            "removal_rate" [1/s]; all but the rate may be 0.
        bounds: {parameter: (low, high)} of any subset, None for an open side.
        level: of the intervals.

    Returns:
        The kinetics with their intervals, and how well the data determine them.

    Raises:
        ValueError: other data, standard deviations in some of the curves only, unknown parameters, two choices of weights,
            or too few points.

    Example:
        >>> t, kinetics = np.linspace(0.0, 3600.0, 13), fitting.GrowthKinetics(1e-2, 1.2e-19, 4e-30, 5e-4)
        >>> data = [fitting.GrowthData(t, kinetics.thickness(t, stress, temperature), stress=stress, temperature=temperature)
        ...         for stress, temperature in [(3e8, 353.0), (9e8, 353.0), (3e8, 393.0)]]
        >>> fit = fitting.fit_growth(data, weights="absolute")
        >>> print(f"{fit.values['activation_energy']:.4g} J, {fit.values['activation_volume']:.4g} m3")
        1.2e-19 J, 4e-30 m3
    """
    curves = Curves.of(_checked(data))
    sample = curves.sample(weights)
    sought = Sought(STRUCTURE, limits(STRUCTURE, fixed, bounds), None)
    space = curves.space(sought.table)
    problem = FitProblem(curves.data, sought, space, sample, curves.duration, level)
    solved = least_squares(problem, lambda weights: curves.objective(space, weights), curves.starts(space))
    best, _ = solved.whole
    notes = [note for one in curves.data for note in one.notes] + curves.notes(sought.table)
    found = conclude(problem, solved._replace(notes=notes))
    return found.fit(
        GrowthFit, reference=curves.reference, starts=(best.starts, best.agreed), slopes=found.judged.slopes
    )


def _checked(data: Any) -> tuple[GrowthData, ...]:
    """The curves; ValueError for other data."""
    several = (
        (data,) if isinstance(data, GrowthData) else tuple(data) if isinstance(data, list | tuple) else ()
    )
    if not several or not all(isinstance(one, GrowthData) for one in several):
        got = ", ".join(type(one).__name__ for one in several) or type(data).__name__
        raise ValueError(f"data: expected one GrowthData or a list of them, got {got}")
    known = [one.sigma is not None for one in several]
    if any(known) and not all(known):
        raise ValueError(f"sigma: expected in all curves or in none, got {sum(known)} of {len(known)}")
    return several


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class GrowthSpace(ParameterSpace):
    """Coordinates log rate, energy, work and removal."""

    def spans(self, theta: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """As of any law, and open for the rate where energy or volume reach the end of the search, not a bound: the rate
        compensates them."""
        rate, energy, work = ends[:3, 1]
        ends = ends.copy()
        if self.lower[0] < self.upper[0]:
            ends[0, 1] = self.upper[0] if energy >= LARGEST else rate
            ends[0, 0] = self.lower[0] if work >= LARGEST else ends[0, 0]
        return super().spans(theta, ends)


class Curves(NamedTuple):
    """Growth curves one after the other: each array (n,), in SI; which: the curve of a point."""

    data: tuple[GrowthData, ...]
    t: np.ndarray
    measured: np.ndarray
    stress: np.ndarray
    temperature: np.ndarray
    initial: np.ndarray
    which: np.ndarray

    @classmethod
    def of(cls, data: tuple[GrowthData, ...]) -> "Curves":
        """Return the points of all curves."""
        count = [one.t.size for one in data]
        own = (
            np.repeat([getattr(one, name) for one in data], count)
            for name in ("stress", "temperature", "initial")
        )
        t, measured = (np.concatenate([getattr(one, name) for one in data]) for name in ("t", "thickness"))
        return cls(data, t, measured, *own, np.repeat(np.arange(len(data)), count))

    @property
    def duration(self) -> float:
        """Of the longest curve [s]."""
        return float(self.t.max())

    @property
    def mean_temperature(self) -> float:
        """Of all points, harmonic [K]."""
        return 1.0 / float(np.mean(1.0 / self.temperature))

    @property
    def reference(self) -> tuple[float, float]:
        """Mean conditions (stress [Pa], temperature [K]), at which 1/T and stress/T have their mean over all points."""
        mean = self.mean_temperature
        return float(np.mean(self.stress / self.temperature)) * mean, mean

    @property
    def unit(self) -> np.ndarray:
        """SI values (4,) of coordinates of one."""
        energy = BOLTZMANN * self.mean_temperature
        return np.array([1.0, energy, energy / (float(self.stress.max()) or 1.0), 1.0 / self.duration])

    def sample(self, weights: str | None) -> Sample:
        """Return the points with their weights."""
        spread = None
        if self.data[0].sigma is not None:
            spread = np.concatenate([one.sigma for one in self.data])
        if weights is None and spread is None:
            weights = "estimated"
        apart = self.t - 2.0 * self.duration * self.which  # so that no difference spans two curves
        point_weights, label = choose_weights(apart, self.measured, weights, None if weights else spread)
        return Sample.of(("thickness", "m", self.t, self.measured), point_weights, label, self.which)

    def space(self, table: dict[str, tuple[float, float]]) -> ParameterSpace:
        """Return the box of the search from the bounds of the parameters."""
        middle = math.log(float(np.max(np.abs(self.measured))) / self.duration)
        whole = [(middle - REACH, middle + REACH), (0.0, LARGEST), (0.0, LARGEST), (0.0, FASTEST)]
        logarithmic = np.arange(4) == 0
        with np.errstate(divide="ignore"):
            given = [
                np.log(table[name]) if log else np.array(table[name])
                for name, log in zip(table, logarithmic, strict=True)
            ]
        rows = [_within(own, bound / unit) for own, bound, unit in zip(whole, given, self.unit, strict=True)]
        return GrowthSpace.of(STRUCTURE, np.array(rows), logarithmic, self.unit)

    def objective(self, space: ParameterSpace, weights: np.ndarray) -> Objective:
        """Return the least squares over the coordinates (4,)."""
        columns = (self.t, self.measured, self.stress, self.temperature, self.initial)
        arrays = (*map(padding.repeated, columns), padding.without_weight(weights), self.unit)
        n = self.t.size
        return Objective(
            lambda theta: np.asarray(_residual(theta, *arrays))[:n],
            lambda theta, free: np.asarray(_slopes(theta, *arrays))[:n, free],
            *space.bounds,
            floor=1e-26 * float(np.sum((weights * self.measured) ** 2)),
        )

    def starts(self, space: ParameterSpace) -> list[np.ndarray]:
        """Return coordinates (4,) for several removal rates: growth rates of the curves, and their regression."""
        lower, upper = space.bounds
        removal = np.unique(np.clip(STARTS, lower[3], upper[3]))
        found = [np.append(self._regression(decay, lower[:3], upper[:3]), decay) for decay in removal]
        return [np.clip(one, lower, upper) for one in found]

    def _regression(self, removal: float, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """Log rate, energy and work (3,) within bounds, for a removal rate times the duration."""
        decay = removal * self.t / self.duration
        grown = (
            self.t
            * np.asarray(GrowthKinetics(1.0, 0.0, 0.0, 1.0).thickness(decay, 0.0, 1.0))
            / np.maximum(decay, 1e-300)
        )
        grown, rest = np.where(decay > 0.0, grown, self.t), self.measured - self.initial * np.exp(-decay)
        of_curve = lambda values: np.bincount(self.which, values)
        speed = of_curve(grown * rest) / of_curve(grown**2)
        first = np.unique(self.which, return_index=True)[1]
        over = self.mean_temperature / self.temperature[first]
        work = over * self.stress[first] / (self.stress.max() or 1.0)
        A = np.stack([np.ones(speed.size), -over, work], -1)
        y = np.log(np.maximum(speed, 1e-3 * np.max(np.abs(speed))))
        A, y = np.concatenate([A, WEAK * np.eye(3)[1:]]), np.append(y, WEAK * np.array(EXPECTED))
        free, x = lower < upper, lower.copy()
        if free.any():
            rest = y - A[:, ~free] @ x[~free]
            x[free] = scipy.optimize.lsq_linear(A[:, free], rest, (lower[free], upper[free])).x
        return x

    def notes(self, table: dict[str, tuple[float, float]]) -> list[str]:
        """Return what data at one temperature or one stress do not determine."""
        said, many = [], {"activation_energy": ("temperature", "K"), "activation_volume": ("stress", "Pa")}
        for name, (condition, unit) in many.items():
            values = np.unique(getattr(self, condition))
            if values.size == 1 and table[name][0] < table[name][1] and table["rate"][0] < table["rate"][1]:
                said.append(
                    f"all curves are at one {condition}, {values[0]:.4g} {unit}: {name} is not determined, and rate only with"
                    " it; the growth rate is; hold it at a known value by fixed=, or add a curve at another"
                    f" {condition}"
                )
        return said


def _within(whole: tuple[float, float], given: np.ndarray) -> tuple[float, float]:
    """The range of a coordinate cut to its bounds, beyond which it is moved where they lie outside."""
    low, high = map(float, given)
    if low == high:
        return low, high
    size = whole[1] - whole[0]
    least = whole[0] if high > whole[0] else high - size
    most = whole[1] if low < whole[1] else low + size
    return max(least, low), min(most, high)


def _si(theta: Array, unit: Array) -> Array:
    """Parameters (4,) of coordinates."""
    return jnp.append(jnp.exp(theta[:1]), theta[1:]) * unit


@jax.jit
def _residual(
    theta: Array, t: Array, measured: Array, stress: Array, temperature: Array, initial: Array, weight: Array, unit: Array
) -> Array:  # fmt: skip
    """Weighted residuals (n,)."""
    return weight * (GrowthKinetics(*_si(theta, unit)).thickness(t, stress, temperature, initial) - measured)


@jax.jit
def _slopes(theta: Array, *arrays: Array) -> Array:
    """Their Jacobian (n, 4)."""
    return jax.jacfwd(lambda at: _residual(at, *arrays))(jnp.asarray(theta))
