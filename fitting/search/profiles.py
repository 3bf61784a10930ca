"""Profile likelihoods by fitting again, for models that are not linear in their compliances.

The profile of a coordinate is traced outwards: at each trial value the others are fitted again, from where the tangent
of the profile leads, and the square root of the rise in RSS, which is nearly a straight line, is followed to the level
(D. M. Bates, D. G. Watts, Nonlinear Regression Analysis, 1988, sec. 6.1). The least RSS at a value may belong to
another branch of minima than the one that was followed; so where one branch ends, the others known are tried, unless
the root rose as the straight line that a single branch makes it.
"""

import dataclasses
import functools
import math
from typing import NamedTuple

import numpy as np

from fitting.search.nonlinear import Best, Objective, minimise_some

STEPS, MOST = 30, 4.0
NEGLIGIBLE = 1e-4  # share of the allowed rise by which a profile may be above the least
START = 1e-3  # a first step in the units of a coordinate, where the Jacobian does not give one
STRAIGHT = 0.1  # share by which an end may be off that of the straight line
BRANCHES, LOWER = 8, 0.02  # changes of branch, and how far below the level another has to be


def profile(
    objective: Objective, best: Best, levels: np.ndarray, traced: np.ndarray | None = None
) -> np.ndarray:
    """Return the ends (m, 2) at which the profile of each free coordinate reaches its level of RSS, ``levels`` (k,), or its
    bound where it does not.

    traced (m,) bool: coordinates whose profiles are followed, all unless given; the ends of the others are those of the
    linearised model. Fixed coordinates keep their value.
    """
    ends = np.stack([best.theta, best.theta], -1)
    heights = [float(np.sum(objective.at(theta) ** 2)) for theta in best.others]
    for i, level in zip(objective.free, levels.tolist(), strict=True):
        rivals = [theta for theta, rss in zip(best.others, heights, strict=True) if rss < level]
        sides = [_Side(objective, best, rivals, level, int(i), sign) for sign in (-1.0, 1.0)]
        ends[i] = [side.end() if traced is None or traced[i] else side.straight_end() for side in sides]
    return ends


class Point(NamedTuple):
    """Of a profile: the value of its coordinate, the square root of the rise in RSS over that allowed, and the fit of
    the others there."""

    value: float
    height: float
    fit: Best


@dataclasses.dataclass(frozen=True)
class _Side:
    """The profile of coordinate i below (sign -1) or above (1) its best; rivals: other minima below the level."""

    objective: Objective
    best: Best
    rivals: list[np.ndarray]
    level: float
    i: int
    sign: float

    @property
    def bound(self) -> float:
        """Of the coordinate, on this side."""
        return float((self.objective.lower if self.sign < 0 else self.objective.upper)[self.i])

    @property
    def first(self) -> float:
        """The coordinate at its best."""
        return float(self.best.theta[self.i])

    def end(self) -> float:
        """The outermost value at which a known branch reaches the level."""
        value = self._walk(Point(self.first, 0.0, self.best))
        straight = abs(value - self.first - self.sign * self._line) < STRAIGHT * self._line
        several = [] if self.best.starts == 1 else [self.best.theta, *self.best.others]
        for _ in range(BRANCHES):
            lower = None if value == self.bound else self._lower(value, self.rivals if straight else several)
            if lower is None:
                break
            value = self._walk(lower)
        return value

    def straight_end(self) -> float:
        """Return the value at which the linearised model reaches the level, or the bound."""
        return self.sign * min(self.sign * self.first + self._line, self.sign * self.bound)

    @functools.cached_property
    def _line(self) -> float:
        """Distance to the level along the straight line."""
        return math.sqrt(max(self.level - self.best.rss, 0.0)) / max(self._tangent(self.best)[1], 1e-300)

    def _lower(self, value: float, minima: list[np.ndarray]) -> Point | None:
        """A point below the level at the value, or at a minimum beyond it."""
        for theta in minima:
            found = self._at(self.sign * max(self.sign * value, self.sign * theta[self.i]), theta)
            if found.height < 1.0 - LOWER:
                return found
        return None

    def _at(self, value: float, start: np.ndarray) -> Point:
        """The others fitted at a value, from a start."""
        start, allowed = start.copy(), self.level - self.best.rss
        start[self.i] = value
        others = np.setdiff1d(self.objective.free, self.i)
        fit = minimise_some(self.objective, start, others, max(NEGLIGIBLE * allowed, self.objective.floor))
        # where the model has no value, half the way
        rise = fit.rss - self.best.rss
        return Point(value, math.sqrt(max(rise, 0.0) / allowed) if math.isfinite(rise) else 3.0, fit)

    def _walk(self, inner: Point) -> float:
        """Outwards from a point: the value at which the branch that it is on reaches the level."""
        outer, value = None, self._next(inner, None)
        tangent = self._tangent(inner.fit)[0]
        for _ in range(STEPS):
            value = self.sign * min(self.sign * value, self.sign * self.bound)
            if self.sign * (value - self.first) <= 0.0:
                return self.bound
            found = self._at(value, inner.fit.theta + tangent * (value - inner.value))
            if abs(found.height - 1.0) < self.objective.close or (found.height < 1.0 and value == self.bound):
                return value
            if found.height < 1.0:
                inner, tangent = found, self._tangent(found.fit)[0]
            else:
                outer = found
            value = self._next(inner, outer)
        return value

    def _tangent(self, fit: Best) -> tuple[np.ndarray, float]:
        """Change (m,) of the coordinates with this one along the profile, and the slope of the root of RSS there."""
        free, change = self.objective.free, np.zeros(fit.theta.size)
        inside = (fit.theta > self.objective.lower) & (fit.theta < self.objective.upper)
        others, own = inside[free] & (free != self.i), fit.jacobian[:, free == self.i][:, 0]
        J = fit.jacobian[:, others]
        change[free[others]] = -np.linalg.lstsq(J, own, rcond=1e-12)[0]
        return change, float(np.linalg.norm(own + J @ change[free[others]]))

    def _next(self, inner: Point, outer: Point | None) -> float:
        """The next trial: the straight line on through the last point, or between the two that enclose the level."""
        if outer is not None:
            share = (1.0 - inner.height) / (outer.height - inner.height)
            return inner.value + min(max(share, 0.05), 0.95) * (outer.value - inner.value)
        if inner.fit is self.best:
            longest = MOST * max(1.0, abs(self.first) if self.objective.lower[self.i] >= 0.0 else 0.0)
            step = min(self._line, longest)
        else:
            step = 1.02 * min(1.0 / max(inner.height, 1e-3), 3.0) * abs(inner.value - self.first)
        return self.first + self.sign * max(step, START)
