"""Bounded least squares with exact Jacobians, and profile likelihoods by fitting again.

For models that are not linear in their compliances (``varpro.py`` is for those). The profile of a
coordinate is traced outwards: at each trial value the others are fitted again, and the square root
of the rise in RSS, which is nearly a straight line, is followed to the level (D. M. Bates,
D. G. Watts, Nonlinear Regression Analysis, 1988, sec. 6.1).
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy import optimize

from fitting.uncertainty import inverse

STEPS, ITERATIONS, MOST = 30, 60, 4.0
NEGLIGIBLE = 1e-4  # share of the allowed rise by which a profile may be above the least
SAME = 1e-5  # share of RSS by which two minima are one
START = 1e-3  # a first step in the units of a coordinate, where the Jacobian does not give one


@dataclasses.dataclass
class Objective:
    """residual(theta) (n,); jacobian(theta, free) (n, k): of the coordinates ``free``. Runs are counted.

    lower, upper (m,): the box; equal where a coordinate is fixed. ftol: share of RSS that is no change, floor: RSS that
    is none; close: error allowed of the square root of a rise.
    """

    residual: Callable[[np.ndarray], np.ndarray]
    jacobian: Callable[[np.ndarray, np.ndarray], np.ndarray]
    lower: np.ndarray
    upper: np.ndarray
    ftol: float = 1e-12
    floor: float = 0.0
    close: float = 2e-3
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

    def slope(self, theta: np.ndarray, some: np.ndarray) -> np.ndarray:
        """Their Jacobian (n, k) with respect to some of the free coordinates; all are taken, by one program."""
        self.jacobian_runs += 1
        return np.asarray(self.jacobian(theta, self.free))[:, np.isin(self.free, some)]


class Best(NamedTuple):
    """theta (m,), residual (n,), jacobian (n, k) of the free coordinates, rss; starts, agreed: how many minima
    were sought, and how many of them are as low as this."""

    theta: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    rss: float
    starts: int = 1
    agreed: int = 1


def moved(best: Best, free: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """d theta/d x = -(J^T J)^-1 J^T dr/dx at the optimum, (m,), from the slope (n,) of the residuals."""
    change = np.zeros(best.theta.size)
    change[free] = -inverse(best.jacobian) @ (best.jacobian.T @ slope)
    return change


def minimise(objective: Objective, start: np.ndarray) -> Best:
    """The least squares in the box from ``start``."""
    return _fit(objective, start, objective.free, objective.floor)


def minimise_from(objective: Objective, starts: Sequence[np.ndarray]) -> Best:
    """The lowest of the minima from several starts, of which some may have no value."""
    sound = [start for start in starts if np.all(np.isfinite(objective.at(start)))]
    found = [minimise(objective, start) for start in sound]
    best = min(found, key=lambda one: one.rss)
    low = best.rss * (1.0 + SAME) + objective.floor
    return best._replace(starts=len(found), agreed=sum(one.rss <= low for one in found))


def _fit(objective: Objective, start: np.ndarray, free: np.ndarray, floor: float) -> Best:
    """With the coordinates ``free`` fitted: Levenberg-Marquardt, each step a bounded linear least squares.

    It ends where the step would change RSS by no more than ftol of it and ``floor``, which costs no further run.
    """
    theta = np.clip(start, objective.lower, objective.upper)
    residual, damping = objective.at(theta), 0.0
    jacobian = objective.slope(theta, free)
    for _ in range(ITERATIONS if free.size else 0):
        rss = float(residual @ residual)
        step = _step(
            jacobian,
            residual,
            objective.lower[free] - theta[free],
            objective.upper[free] - theta[free],
            damping,
        )
        expected = rss - float(np.sum((residual + jacobian @ step) ** 2))
        if expected <= objective.ftol * rss + floor or damping > 1e8:
            break
        trial = theta.copy()
        trial[free] = np.clip(theta[free] + step, objective.lower[free], objective.upper[free])
        after = objective.at(trial)
        if np.all(np.isfinite(after)) and float(after @ after) < rss:
            theta, residual, damping = trial, after, 0.1 * damping if damping > 1e-4 else 0.0
            jacobian = objective.slope(theta, free)
        else:
            damping = max(10.0 * damping, 1e-3)
    return Best(theta, residual, jacobian, float(residual @ residual))


def _step(J: np.ndarray, r: np.ndarray, low: np.ndarray, high: np.ndarray, damping: float) -> np.ndarray:
    """min |J s + r|^2 + damping |D s|^2 with low <= s <= high, D the norms of the columns."""
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-150)
    A, b = J / size, -r
    if damping > 0.0:
        A = np.concatenate([A, np.sqrt(damping) * np.eye(size.size)])
        b = np.append(b, np.zeros(size.size))
    step = np.linalg.lstsq(A, b, rcond=1e-12)[0]
    low, high = low * size, high * size
    if np.any(step < low) or np.any(step > high):
        step = optimize.lsq_linear(A, b, (low, np.maximum(high, low + 1e-300)), method="bvls").x
    return np.clip(step, low, high) / size


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


def _end(
    objective: Objective, best: Best, covariance: np.ndarray, place: int, side: float, level: float
) -> float:
    """The value of one coordinate, below or above its best, at which the profile reaches the level."""
    free, negligible = objective.free, max(NEGLIGIBLE * (level - best.rss), objective.floor)
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
        found = _fit(objective, start, others, negligible)
        theta, rise = found.theta, found.rss - best.rss
        # where the model has no value, half the way
        height = math.sqrt(max(rise, 0.0) / (level - best.rss)) if math.isfinite(rise) else 3.0
        if abs(height - 1.0) < objective.close:
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
