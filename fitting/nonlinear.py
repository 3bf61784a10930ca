"""Bounded least squares with exact Jacobians, and profile likelihoods by fitting again.

For models that are not linear in their compliances (``varpro.py`` is for those). The profile of a
coordinate is traced outwards: at each trial value the others are fitted again, and the square root
of the rise in RSS, which is nearly a straight line, is followed to the level (D. M. Bates,
D. G. Watts, Nonlinear Regression Analysis, 1988, sec. 6.1).
"""

import dataclasses
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import optimize

STEPS, CLOSE, MOST = 30, 2e-3, 4.0
START = 1e-3  # a first step in the units of a coordinate, where the Jacobian does not give one


@dataclasses.dataclass
class Objective:
    """residual(theta) (n,); jacobian(theta, free) (n, k): of the coordinates ``free``. Runs are counted.

    lower, upper (m,): the box; equal where a coordinate is fixed. ftol: share of RSS that is no change.
    """

    residual: Callable[[np.ndarray], np.ndarray]
    jacobian: Callable[[np.ndarray, np.ndarray], np.ndarray]
    lower: np.ndarray
    upper: np.ndarray
    ftol: float = 1e-12
    residual_runs: int = 0
    jacobian_runs: int = 0

    @property
    def free(self) -> np.ndarray:
        """Indices of the coordinates that are fitted."""
        return np.flatnonzero(self.upper > self.lower)

    def at(self, theta: np.ndarray) -> np.ndarray:
        """Weighted residuals (n,)."""
        self.residual_runs += 1
        return np.asarray(self.residual(theta))

    def slope(self, theta: np.ndarray, free: np.ndarray) -> np.ndarray:
        """Their Jacobian (n, k)."""
        self.jacobian_runs += 1
        return np.asarray(self.jacobian(theta, free))


class Best(NamedTuple):
    """theta (m,), residual (n,), jacobian (n, k) of the free coordinates, rss."""

    theta: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    rss: float


def minimise(objective: Objective, start: np.ndarray) -> Best:
    """The least squares in the box from ``start``; a coordinate goes to its bound if that costs nothing."""
    free = objective.free
    theta = _fit(objective, start, free)
    for i in free:
        trial = theta.copy()
        trial[i] = objective.lower[i]
        near = theta[i] - objective.lower[i] < 1e-6 * max(1.0, abs(theta[i]))
        if near and _rss(objective, trial) <= _rss(objective, theta) * (1 + objective.ftol):
            theta = trial
    residual = objective.at(theta)
    return Best(theta, residual, objective.slope(theta, free), float(residual @ residual))


def _rss(objective: Objective, theta: np.ndarray) -> float:
    residual = objective.at(theta)
    return float(residual @ residual)


def _fit(objective: Objective, start: np.ndarray, free: np.ndarray) -> np.ndarray:
    """theta with its coordinates ``free`` fitted."""
    if free.size == 0:
        return start
    low, high = objective.lower[free], objective.upper[free]
    whole = lambda x: _put(start, free, x)
    found = optimize.least_squares(
        lambda x: objective.at(whole(x)), _inside(start[free], low, high),
        jac=lambda x: objective.slope(whole(x), free),
        bounds=(low, high), x_scale="jac", ftol=objective.ftol, xtol=1e-10, gtol=1e-14, max_nfev=100,
    )  # fmt: skip
    return whole(found.x)


def _inside(x: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """A start strictly in the box."""
    room = 1e-9 * np.maximum(1.0, np.abs(x))
    low_room = np.minimum(low + room, 0.5 * (low + np.where(np.isfinite(high), high, low + 2 * room)))
    return np.clip(x, low_room, np.maximum(high - room, low_room))


def _put(theta: np.ndarray, free: np.ndarray, x: np.ndarray) -> np.ndarray:
    whole = theta.copy()
    whole[free] = x
    return whole


def profile(objective: Objective, best: Best, level: float) -> np.ndarray:
    """(m, 2): where the profile of each free coordinate reaches RSS = ``level``; its bound where it does not.

    Fixed coordinates keep their value.
    """
    ends = np.stack([best.theta, best.theta], -1)
    covariance = inverse(best.jacobian)
    for place, i in enumerate(objective.free):
        for side in (0, 1):
            ends[i, side] = _end(objective, best, covariance, place, (-1.0, 1.0)[side], level)
    return ends


def inverse(jacobian: np.ndarray) -> np.ndarray:
    """(J^T J)^-1 with its lost directions cut at 1e-9 of the largest singular value."""
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    _, s, V = np.linalg.svd(jacobian / size, full_matrices=False)
    root = V.T / np.maximum(s, 1e-9 * s[0]) / size[:, None]
    return root @ root.T


def _end(
    objective: Objective, best: Best, covariance: np.ndarray, place: int, side: float, level: float
) -> float:
    """The value of one coordinate, below or above its best, at which the profile reaches the level."""
    free = objective.free
    i, others = free[place], np.delete(free, place)
    along = np.delete(covariance[:, place] / covariance[place, place], place)
    bound = objective.lower[i] if side < 0 else objective.upper[i]
    first = best.theta[i]
    longest = MOST * max(1.0, abs(first) if objective.lower[i] >= 0.0 else 0.0)
    step = min(math.sqrt(max(level - best.rss, 0.0) * covariance[place, place]), longest)
    inner, outer = (first, 0.0, best.theta), None
    value = first + side * max(step, START)
    for _ in range(STEPS):
        value = side * min(side * value, side * bound)
        if side * (value - first) <= 0.0:
            return bound
        start = inner[2].copy()
        start[i] = value
        start[others] += along * (value - inner[0])
        start = np.clip(start, objective.lower, objective.upper)
        if not np.all(np.isfinite(objective.at(start))):
            outer = (value, 2.0)  # where the model has no value: half the way
            value = _next(first, inner, outer, side)
            continue
        theta = _fit(objective, start, others)
        height = math.sqrt(max(_rss(objective, theta) - best.rss, 0.0) / (level - best.rss))
        if abs(height - 1.0) < CLOSE:
            return value
        if height < 1.0:
            if value == bound:
                return bound
            inner = (value, height, theta)
        else:
            outer = (value, height)
        value = _next(first, inner, outer, side)
    return value


def _next(first: float, inner: tuple, outer: tuple | None, side: float) -> float:
    """The next trial: the straight line on through the last point, or between the two that enclose the level."""
    if outer is None:
        grow = min(1.0 / max(inner[1], 1e-3), 3.0)
        return first + side * max(1.02 * grow * abs(inner[0] - first), START)
    share = (1.0 - inner[1]) / (outer[1] - inner[1])
    return inner[0] + min(max(share, 0.05), 0.95) * (outer[0] - inner[0])
