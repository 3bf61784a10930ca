"""Coordinates, residuals and starting values of the search for growth kinetics.

The search is over log rate, activation energy over k T0, activation volume over k T0/s0 and removal rate times the
duration, with T0 a mean temperature and s0 the largest stress of the data. The logarithm of the growth rate is linear in
the first three, so that the valley in which they compensate each other is straight, and the search and its profiles follow
it however narrow the range of temperatures and stresses is.
"""

import dataclasses
import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy
from jax import Array

from fitting.data.growth import GrowthData
from fitting.data.weights import choose_weights
from fitting.inference.evidence import Sample
from fitting.models.kinetics import BOLTZMANN, DIMENSIONS, GrowthKinetics
from fitting.models.rubbed_contact import RubbedContact
from fitting.models.search_space import ParameterSpace
from fitting.models.structure import ParameterList
from fitting.search import padding
from fitting.search.nonlinear import Objective
from jaxcontact._support.exponential import phi1

LARGEST = 200.0  # activation energy and work of the stress over k T0 at which the search ends
REACH = 230.0  # of log rate, likewise, about the logarithm of a growth rate of the data
OPEN = 100.0  # of both, beyond which the end of an interval is that of the search and not of the data
SAME = 1e-6  # singular value below which conditions are the same
FASTEST = 1e4  # removal rate times the duration
STARTS = (0.0, 0.3, 3.0, 30.0)  # removal rates times the duration
WAITS = (0.0, 0.1, 0.25, 0.5)  # induction times of the starts over the duration
LATEST = 0.95  # induction time over the duration at which the search ends
EXPECTED = (20.0, 1.0)  # energy and work over k T0 to start from where the data do not determine them
IN_CONTACT = 1e-9  # relative change of the sum of squares at convergence with a contact, solved to 1e-8
WEAK = 1e-3  # weight of these beside the logarithm of a growth rate
STRUCTURE = ParameterList.of(
    GrowthKinetics, DIMENSIONS, zeros=("activation_energy", "activation_volume", "removal_rate")
)


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class GrowthSpace(ParameterSpace):
    """Coordinates log rate, energy, work, removal and induction time.

    lost: places of those that the conditions of the curves leave open.
    """

    lost: tuple[int, ...] = ()

    def spans(self, theta: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return the ends of the intervals: open for what is lost, and where an end is that of the search."""
        middle = np.array([0.5 * (self.lower[0] + self.upper[0]), 0.0, 0.0, np.nan, np.nan])[:, None]
        away = (np.abs(ends - middle) >= OPEN) & (self.lower < self.upper)[:, None]
        away[list(self.lost)] = True
        return super().spans(theta, np.where(away, np.stack(self.bounds, -1), ends))


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
        repeat = lambda name: np.repeat([getattr(one, name) for one in data], count)
        stress, temperature, initial = (repeat(name) for name in ("stress", "temperature", "initial"))
        t, measured = (np.concatenate([getattr(one, name) for one in data]) for name in ("t", "thickness"))
        return cls(data, t, measured, stress, temperature, initial, np.repeat(np.arange(len(data)), count))

    @property
    def duration(self) -> float:
        """Duration of the longest curve [s]."""
        return float(self.t.max())

    @property
    def mean_temperature(self) -> float:
        """Harmonic mean temperature of all points [K]."""
        return 1.0 / float(np.mean(1.0 / self.temperature))

    @property
    def reference(self) -> tuple[float, float]:
        """Mean conditions (stress [Pa], temperature [K]), at which 1/T and stress/T have their mean over all points."""
        mean = self.mean_temperature
        return float(np.mean(self.stress / self.temperature)) * mean, mean

    @property
    def unit(self) -> np.ndarray:
        """SI values (5,) of coordinates of one."""
        energy, end = BOLTZMANN * self.mean_temperature, self.duration
        return np.array([1.0, energy, energy / (float(self.stress.max()) or 1.0), 1.0 / end, end])

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

    def space(self, table: dict[str, tuple[float, float]], induction: str | float | None) -> ParameterSpace:
        """Return the box of the search from the bounds of the parameters; induction: as in ``fit_growth``."""
        middle = math.log(float(np.max(np.abs(self.measured))) / self.duration)
        whole = [(middle - REACH, middle + REACH), (0.0, LARGEST), (0.0, LARGEST), (0.0, FASTEST)]
        logarithmic = np.arange(4) == 0
        with np.errstate(divide="ignore"):
            given = [
                np.log(table[name]) if log else np.array(table[name])
                for name, log in zip(table, logarithmic, strict=True)
            ]
        rows = [
            _within(own, bound / unit) for own, bound, unit in zip(whole, given, self.unit[:4], strict=True)
        ]
        held = 0.0 if induction is None else induction
        waits = (0.0, LATEST) if isinstance(held, str) else (held / self.duration,) * 2
        lower, upper = np.array([*rows, waits]).T
        own = np.arange(5) < 4
        space = GrowthSpace(
            structure=STRUCTURE, lower=lower, upper=upper, unit=self.unit, logarithmic=np.arange(5) == 0,
            material=own, names=(*STRUCTURE.where, "induction"), open=np.ones((5, 2), dtype=bool),
        )  # fmt: skip
        lost = self.lost(table)
        bounded = any(table[list(DIMENSIONS)[i]] != (0.0, math.inf) for i in lost)
        return space if bounded else dataclasses.replace(space, lost=lost)

    def objective(self, space: ParameterSpace, weights: np.ndarray) -> Objective:
        """Return the least squares over the coordinates (5,)."""
        columns = (self.t, self.measured, self.stress, self.temperature, self.initial)
        arrays = (*map(padding.repeated, columns), padding.without_weight(weights), self.unit)
        n = self.t.size
        return Objective(
            lambda theta: np.asarray(_residual(theta, *arrays))[:n],
            lambda theta, free: np.asarray(_slopes(theta, *arrays))[:n, free],
            *space.bounds,
            floor=1e-26 * float(np.sum((weights * self.measured) ** 2)),
        )

    def objective_in(self, contact: RubbedContact, space: ParameterSpace, weights: np.ndarray) -> Objective:
        """Return the least squares with the pressure of a contact, curve by curve."""
        ends = np.cumsum([one.t.size for one in self.data])[:-1]
        given = [
            (CurveInContact(one.t, one.thickness, one.load, one.temperature, one.initial), weight, self.unit)
            for one, weight in zip(self.data, np.split(weights, ends), strict=True)
        ]
        each = lambda function, theta: np.concatenate(
            [np.asarray(function(theta, contact, *curve)) for curve in given]
        )
        return dataclasses.replace(
            self.objective(space, weights),
            residual=lambda theta: each(_residual_in, theta),
            jacobian=lambda theta, free: each(_slopes_in, theta)[:, free],
            ftol=IN_CONTACT,
        )

    def starts(self, space: ParameterSpace) -> list[np.ndarray]:
        """Return coordinates (5,) for several removal rates and induction times: growth rates of the curves, and their
        regression."""
        lower, upper = space.bounds
        removal = np.unique(np.clip(STARTS, lower[3], upper[3]))
        waits = np.unique(np.clip(WAITS if upper[4] > lower[4] else lower[4:], lower[4], upper[4]))
        found = [
            np.append(self._regression(decay, wait, lower[:3], upper[:3]), [decay, wait])
            for decay in removal
            for wait in waits
        ]
        return [np.clip(one, lower, upper) for one in found]

    def _regression(self, removal: float, wait: float, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """Log rate, energy and work (3,) within bounds, for a removal rate and an induction time over the duration."""
        since = np.maximum(self.t - wait * self.duration, 0.0)
        decay = removal * since / self.duration
        grown, rest = since * np.asarray(phi1(decay)), self.measured - self.initial * np.exp(-decay)
        of_curve = lambda values: np.bincount(self.which, values)
        speed = of_curve(grown * rest) / of_curve(grown**2)
        A = self._design()
        y = np.log(np.maximum(speed, 1e-3 * np.max(np.abs(speed))))
        A, y = np.concatenate([A, WEAK * np.eye(3)[1:]]), np.append(y, WEAK * np.array(EXPECTED))
        free, x = lower < upper, lower.copy()
        if free.any():
            rest = y - A[:, ~free] @ x[~free]
            x[free] = scipy.optimize.lsq_linear(A[:, free], rest, (lower[free], upper[free])).x
        return x

    def _design(self) -> np.ndarray:
        """Derivative (curves, 3) of the log growth rate of each curve with respect to log rate, energy and work."""
        first = np.unique(self.which, return_index=True)[1]
        over = self.mean_temperature / self.temperature[first]
        return np.stack(
            [np.ones(first.size), -over, over * self.stress[first] / (self.stress.max() or 1.0)], -1
        )

    def lost(self, table: dict[str, tuple[float, float]]) -> tuple[int, ...]:
        """Return the places of the parameters that the conditions of the curves do not determine, whatever the errors."""
        free = [i for i, name in enumerate(list(DIMENSIONS)[:3]) if table[name][0] < table[name][1]]
        A = self._design()[:, free]
        rank = lambda columns: np.linalg.matrix_rank(columns, tol=SAME)
        return tuple(i for k, i in enumerate(free) if rank(np.delete(A, k, 1)) == rank(A))

    def notes(self, table: dict[str, tuple[float, float]]) -> list[str]:
        """Return a note on such parameters."""
        lost = ", ".join(list(DIMENSIONS)[i] for i in self.lost(table))
        temperatures, stresses = (np.unique(values).size for values in (self.temperature, self.stress))
        note = (
            f"temperatures: {temperatures}, stresses: {stresses}: the curves do not determine {lost} separately, only the"
            " growth rate; hold what is known by fixed=, or add curves at other temperatures or stresses"
        )
        return [note] if lost else []


def _within(whole: tuple[float, float], given: np.ndarray) -> tuple[float, float]:
    """The range of a coordinate cut to its bounds, beyond which it is moved where they lie outside."""
    low, high = map(float, given)
    if low == high:
        return low, high
    size = whole[1] - whole[0]
    least = whole[0] if high > whole[0] else high - size
    most = whole[1] if low < whole[1] else low + size
    return max(least, low), min(most, high)


def to_si(theta: Array, unit: Array) -> Array:
    """Parameters (4,) of coordinates, or with the induction time (5,)."""
    return jnp.append(jnp.exp(theta[:1]), theta[1:]) * unit[: theta.size]


@jax.jit
def _residual(
    theta: Array, t: Array, measured: Array, stress: Array, temperature: Array, initial: Array, weight: Array, unit: Array
) -> Array:  # fmt: skip
    """Weighted residuals (n,)."""
    *parameters, induction = to_si(theta, unit)
    since = jnp.maximum(t - induction, 0.0)
    return weight * (GrowthKinetics(*parameters).thickness(since, stress, temperature, initial) - measured)


class CurveInContact(NamedTuple):
    """A growth curve that was measured in a contact under a load [N]; times and thicknesses (n,)."""

    t: Array
    thickness: Array
    load: Array
    temperature: Array
    initial: Array


@jax.jit
def _residual_in(
    theta: Array, contact: RubbedContact, curve: CurveInContact, weight: Array, unit: Array
) -> Array:
    """Return the weighted residuals (n,) of one curve in a contact."""
    kinetics = GrowthKinetics(*to_si(theta[:4], unit))
    given = {"load": curve.load, "temperature": curve.temperature, "initial": curve.initial}
    return weight * (contact.thickness(kinetics, curve.t, **given) - curve.thickness)


@jax.jit
def _slopes_in(theta: Array, *given: Any) -> Array:
    """Return the Jacobian (n, 4) of the residuals."""
    return jax.jacfwd(lambda at: _residual_in(at, *given))(jnp.asarray(theta))


@jax.jit
def _slopes(theta: Array, *arrays: Array) -> Array:
    """Return the Jacobian (n, 4) of the residuals."""
    return jax.jacfwd(lambda at: _residual(at, *arrays))(jnp.asarray(theta))
