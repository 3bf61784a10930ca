"""Profile likelihoods by repeated fits, for models that are not linear in their compliances.

The profile of a coordinate is traced outwards: at each trial value the other coordinates are fitted again, starting on
the tangent of the profile, and the square root of the rise in RSS, which is nearly linear in the coordinate, is
followed to the level (D. M. Bates, D. G. Watts, Nonlinear Regression Analysis, 1988, sec. 6.1). Its slope is known at
each trial value, and two trial values on each side mostly suffice. The smallest RSS at a value may belong to another
branch of minima than the one that was followed. So at the end of a branch the other known minima are tried: those below
the level and, unless the root rose nearly linearly, as it does on a single branch, all of them. A coordinate that the
best fit has at a bound where the residuals hardly depend on it, as on the logarithm of a compliance without limit, does not
leave this bound in a local search; so that a start from inside its bounds is tried at the end of a branch as well.
"""

import dataclasses
import functools
import math
from typing import NamedTuple

import numpy as np

from fitting.search.nonlinear import Best, Objective, minimise_some

STEPS = 30  # trial values at most, on the way of one branch to the level
FARTHER = 2.0  # longest further step, over the distance from the best value
MONOTONE = 3.0  # largest slope of a monotonic cubic at its ends, over that of the straight line
BESIDE = 0.05  # least distance of a trial value from one that is known, over that between the two that enclose the level
MEET = 1e-9  # distance of the points that enclose the level, over that from the best value, at which a profile jumps there
MOST = 4.0  # longest first step, over the best value of the coordinate or 1, whichever is larger
NEGLIGIBLE = 3e-3  # fall of RSS that a fit along a profile may leave over, as a fraction of the allowed rise
START = 1e-3  # smallest first step, in units of the coordinate
STRAIGHT = 0.1  # relative deviation of an end from that of the straight line on a single branch
BRANCHES = 8  # changes to another branch of minima at most
LOWER = 0.02  # a branch is changed to where its height is below 1 by more than this
NEAR = 0.1  # distance of two points, over that from the best value, within which the height of one branch is nearly linear


def profile(
    objective: Objective, best: Best, levels: np.ndarray, traced: np.ndarray | None = None
) -> tuple[np.ndarray, int]:
    """Return the interval ends (m, 2), the values at which the profile of each free coordinate reaches its level of
    RSS, and the number of fits along the profiles, and of ends, that were not found.

    levels (k,): one for each free coordinate. An end is the bound where the level is not reached. Fixed coordinates
    keep their value. traced (m,) bool: coordinates whose profiles are followed, by default all; the ends of the others
    are those of the linearised model.
    """
    ends, unfinished = np.stack([best.theta, best.theta], -1), 0
    levels_of_others = [float(np.sum(objective.at(theta) ** 2)) for theta in best.others]
    for i, level in zip(objective.free, levels.tolist(), strict=True):
        rivals = [theta for theta, rss in zip(best.others, levels_of_others, strict=True) if rss < level]
        sides = [_Side(objective, best, rivals, level, int(i), sign) for sign in (-1.0, 1.0)]
        ends[i] = [side.end() if traced is None or traced[i] else side.straight_end() for side in sides]
        unfinished += sum(side.unfinished for side in sides)
    return ends, unfinished


class Point(NamedTuple):
    """A point of a profile.

    value: of its coordinate; height: square root of the rise in RSS over the allowed one; slope: the derivative of the
    height, outwards, nan where it is not known; fit: of the other coordinates there.
    """

    value: float
    height: float
    slope: float
    fit: Best


@dataclasses.dataclass
class _Side:
    """One side of the profile of coordinate i, below (sign -1) or above (1) its best value; rivals: other minima below
    the level; unfinished: fits on this side that did not converge, and ends that were not found."""

    objective: Objective
    best: Best
    rivals: list[np.ndarray]
    level: float
    i: int
    sign: float
    unfinished: int = 0

    @property
    def bound(self) -> float:
        """Bound of the coordinate on this side."""
        return float((self.objective.lower if self.sign < 0 else self.objective.upper)[self.i])

    @property
    def first(self) -> float:
        """Best value of the coordinate."""
        return float(self.best.theta[self.i])

    def end(self) -> float:
        """Return the outermost value at which a known branch reaches the level."""
        value = self._walk(Point(self.first, 0.0, 1.0 / max(self._line, 1e-300), self.best))
        straight = abs(value - self.first - self.sign * self._line) < STRAIGHT * self._line
        several = [] if self.best.starts == 1 else [self.best.theta, *self.best.others]
        inside = self._from_flat_bounds()
        for _ in range(BRANCHES):
            if value == self.bound:
                break
            # a point below the level at this value, or at another minimum beyond it
            points = (
                self._at(self.sign * max(self.sign * value, self.sign * theta[self.i]), theta)
                for theta in [*(self.rivals if straight else several), *inside]
            )
            lower = next((point for point in points if point.height < 1.0 - LOWER), None)
            if lower is None:
                break
            value = self._walk(lower)
        return value

    def _from_flat_bounds(self) -> list[np.ndarray]:
        """Return the best coordinates with those at a bound moved to the middle of their range where the slope promises no
        change of the residuals over this range by as much as the level; [] where there is none."""
        free, theta = self.objective.free, self.best.theta.copy()
        lower, upper = self.objective.lower[free], self.objective.upper[free]
        at_bound = (theta[free] <= lower) | (theta[free] >= upper)
        some = np.flatnonzero(at_bound & np.isfinite(lower) & np.isfinite(upper) & (free != self.i))
        change = np.linalg.norm(self.best.jacobian[:, some], axis=0) * (upper[some] - lower[some])
        flat = some[change < math.sqrt(max(self.level - self.best.rss, 0.0))]
        theta[free[flat]] = 0.5 * (lower[flat] + upper[flat])
        return [theta] if flat.size else []

    def straight_end(self) -> float:
        """Return the value at which the linearised model reaches the level, or the bound."""
        return self.sign * min(self.sign * self.first + self._line, self.sign * self.bound)

    @functools.cached_property
    def _line(self) -> float:
        """Distance to the level along the straight line."""
        across = float(np.linalg.norm(self._along(self.best)[1]))
        return math.sqrt(max(self.level - self.best.rss, 0.0)) / max(across, 1e-300)

    def _at(self, value: float, start: np.ndarray) -> Point:
        """Return the point of the profile at a value, with the other coordinates fitted from a start."""
        start, allowed = start.copy(), self.level - self.best.rss
        start[self.i] = value
        others = np.setdiff1d(self.objective.free, self.i)
        fit = minimise_some(self.objective, start, others, max(NEGLIGIBLE * allowed, self.objective.floor))
        self.unfinished += not fit.converged

        # the height, without the fall of RSS that the search has left over
        rise = fit.rss - fit.left - self.best.rss
        if not math.isfinite(rise):  # a height of 3 shortens the step
            return Point(value, 3.0, math.nan, fit)
        height = math.sqrt(max(rise, 0.0) / allowed)

        # h' = r . w/(allowed h), since d RSS/d value = 2 r . w (envelope theorem), with w the part of the coordinate's
        # column that the others cannot take up
        half = self.sign * float(fit.residual @ self._along(fit)[1])
        return Point(value, height, half / (allowed * height) if height > 0.0 else math.nan, fit)

    def _walk(self, inner: Point) -> float:
        """Return the value at which the branch reaches the level, going outwards from a point on it."""
        outer, compared, value = None, None, self._next(inner, None)
        along = self._along(inner.fit)[0]
        for _ in range(STEPS):
            value = self.sign * min(self.sign * value, self.sign * self.bound)
            if self.sign * (value - self.first) <= 0.0:  # the best value is at its bound
                return self.bound
            found = self._at(value, inner.fit.theta + along * (value - inner.value))
            if found.height < 1.0 and value == self.bound:
                return value
            if abs(found.height - 1.0) < self.objective.close:
                rest = (1.0 - found.height) / found.slope if found.slope > 0.0 else 0.0
                return self.sign * min(self.sign * value + rest, self.sign * self.bound)
            if found.height < 1.0:
                inner, along = found, self._along(found.fit)[0]
            else:
                outer = found

            # a tangent that stays below the level up to an outer point close by: where the branch of the inner point is
            # below the level there too, the outer point is on a higher one, and the way goes on beyond it
            if outer is not None and outer is not compared:
                gap = outer.value - inner.value
                ahead = inner.height + inner.slope * abs(gap)
                if abs(gap) < NEAR * abs(inner.value - self.first) and ahead < 1.0 - LOWER:
                    compared, beside = outer, self._at(outer.value, inner.fit.theta + along * gap)
                    if beside.height < 1.0:
                        inner, outer, along = beside, None, self._along(beside.fit)[0]

            # where the height jumps past the level, as at a point that leaves the stable branch of a contact, the two points
            # that enclose it meet
            if outer is not None and abs(outer.value - inner.value) <= MEET * abs(outer.value - self.first):
                return inner.value
            value = self._next(inner, outer)
        self.unfinished += 1
        return value

    def _along(self, fit: Best) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivative (m,) of the coordinates along the profile, 0 of its own, and that of the residuals (n,)."""
        free, change = self.objective.free, np.zeros(fit.theta.size)
        inside = (fit.theta > self.objective.lower) & (fit.theta < self.objective.upper)
        others, own = inside[free] & (free != self.i), fit.jacobian[:, free == self.i][:, 0]
        J = fit.jacobian[:, others]
        change[free[others]] = -np.linalg.lstsq(J, own, rcond=1e-12)[0]
        return change, own + J @ change[free[others]]

    def _next(self, inner: Point, outer: Point | None) -> float:
        """Return the next trial value: extrapolated from the last point, or interpolated between the two that enclose the
        level."""
        if inner.fit is self.best and outer is None:
            longest = MOST * max(1.0, abs(self.first) if self.objective.lower[self.i] >= 0.0 else 0.0)
            return self.first + self.sign * max(min(self._line, longest), START)
        if outer is None:  # along the tangent of the height
            distance = abs(inner.value - self.first)
            ahead = (1.0 - inner.height) / inner.slope if inner.slope > 0.0 else math.inf
            return inner.value + self.sign * max(min(ahead, FARTHER * distance), START)

        # between the two: the value as a cubic of the height where that increases throughout (F. N. Fritsch, R. E. Carlson,
        # SIAM J. Numer. Anal. 17 (1980) 238); else, at a kink, along a tangent that stays between them, or linear
        rise, between = outer.height - inner.height, outer.value - inner.value
        share = (1.0 - inner.height) / rise
        slopes = [math.nan, math.nan]
        for place, point in enumerate((inner, outer)):
            if point.slope > 0.0:
                slopes[place] = self.sign * rise / (point.slope * between)
        if all(0.0 < slope <= MONOTONE for slope in slopes):
            left = 1.0 - share
            return inner.value + between * (
                share**2 * (3.0 - 2.0 * share) + share * left * (left * slopes[0] - share * slopes[1])
            )
        along_tangents = (share * slopes[0], 1.0 - (1.0 - share) * slopes[1])
        near, far = along_tangents if share < 0.5 else along_tangents[::-1]
        inside = [each for each in (near, far) if BESIDE < each < 1.0 - BESIDE]
        return inner.value + between * (inside[0] if inside else min(max(share, BESIDE), 1.0 - BESIDE))
