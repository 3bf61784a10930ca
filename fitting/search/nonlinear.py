"""Bounded nonlinear least squares with exact Jacobians, from one start or several, and profile likelihoods by repeated fits.

It is for models that are not linear in their compliances; those that are linear use ``varpro.py``.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy
from jax import Array

from fitting.models.parameters import Parameters

# Covariance, condition number and weakest direction from a Jacobian, by SVD.
#
# The rows of a Jacobian J are such that (J^T J)^-1 is the covariance of the parameters (``Noise.whitened``). A
# direction whose singular value is below rounding gives sd = inf for the parameters that it changes; it is not
# dropped as in a pseudo-inverse, which would report the least determined direction as the best determined one.


ALIKE = 0.9999  # correlation of two estimates above which only a combination of them is identifiable
ROUNDING = 1e-9  # singular values below this fraction of the largest are rounding


class LogCovariance(NamedTuple):
    """Uncertainty of the logarithms of the parameters that are strictly inside their bounds.

    places: theirs among the compliances; sd (k,) of the log parameters; condition: ratio of the extreme eigenvalues of
    J^T J; weakest (k,): unit vector of the least determined direction; weakest_sd: its standard deviation.
    """

    places: tuple[int, ...]
    sd: np.ndarray
    condition: float
    weakest: np.ndarray
    weakest_sd: float


def _directions(J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Singular values (k,) and right singular vectors (k, k) of J (n, k), also where it has fewer rows than columns."""
    missing = max(J.shape[1] - J.shape[0], 0)
    _, s, V = np.linalg.svd(np.pad(J, ((0, missing), (0, 0))), full_matrices=False)
    return s, V


def log_covariance(J: np.ndarray, inside: np.ndarray) -> LogCovariance:
    """Return the uncertainty from the Jacobian J (n, m) with respect to log compliances and the mask ``inside`` (m,)."""
    index = np.flatnonzero(inside)
    if index.size == 0:
        return LogCovariance((), np.zeros(0), math.nan, np.zeros(0), math.nan)
    s, V = _directions(J[:, index])
    lost = s <= ROUNDING * s[0]
    inverse = np.where(lost, np.inf, 1.0 / np.where(lost, 1.0, s))
    # components at rounding level are not counted in a lost direction
    share = np.where(np.abs(V) < 1e-6, 0.0, np.abs(V)) if lost.any() else np.abs(V)
    terms = np.where(share > 0, share, 0.0) * np.where(share > 0, inverse[:, None], 0.0)
    sd = np.sqrt(np.sum(terms**2, 0))
    condition = math.inf if lost.any() else float((s[0] / s[-1]) ** 2)
    weakest = V[-1] * np.sign(V[-1][np.argmax(np.abs(V[-1]))])
    return LogCovariance(tuple(index), sd, condition, weakest, float(inverse[-1]))


def linear_sd(J: np.ndarray, gradients: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Return the sd (k,) of functions of the compliances with ``gradients`` (k, m), by the delta method, f = 0
    included.

    ``free`` (m,) marks the compliances that were fitted, including those at their open end. Directions lost to rounding
    give inf where a function depends on them.
    """
    index = np.flatnonzero(free)
    size = np.linalg.norm(J[:, index], axis=0)
    index, size = index[size > 0], size[size > 0]
    s, V = _directions(J[:, index] / size)
    along = (gradients[:, index] / size) @ V.T
    lost = s <= ROUNDING * s[0]
    sd = np.sqrt(np.sum((along[:, ~lost] / s[~lost]) ** 2, -1))
    reach = np.abs(along[:, lost]).max(-1, initial=0.0)
    return np.where(reach > 1e-6 * np.linalg.norm(along, axis=-1), np.inf, sd)


def covariance(J: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Return the covariance (m, m) of the coordinates from their Jacobian J (n, m).

    It is zero for coordinates that are not ``free`` (m,) bool or have no effect.
    """
    found, places = np.zeros((free.size, free.size)), np.flatnonzero(free & np.any(J != 0.0, axis=0))
    found[np.ix_(places, places)] = inverse(J[:, places])
    return found


def inverse(jacobian: np.ndarray) -> np.ndarray:
    """Return (J^T J)^-1 with singular values cut at 1e-9 of the largest."""
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    s, V = _directions(jacobian / size)
    root = V.T / np.maximum(s, ROUNDING * s[0]) / size[:, None]
    return root @ root.T


def inseparable(J: np.ndarray, names: Sequence[str], identified: Mapping[str, bool]) -> tuple[str, ...]:
    """Return notes on parameters that are not identifiable because the data determine only a combination of them and
    others.

    J (n, k): the Jacobian of coordinates with ``names`` (k,), "" for those without one; identified: of the parameters.
    """
    places = [i for i in range(len(names)) if names[i] and np.any(J[:, i] != 0.0)]
    spread = inverse(J[:, places])
    size = np.sqrt(np.maximum(np.diag(spread), 1e-300))
    alike = np.abs(spread / np.outer(size, size)) > ALIKE
    groups = {tuple(names[places[j]] for j in np.flatnonzero(row)) for row in alike}
    lost = sorted(g for g in groups if len(g) > 1 and not all(identified.get(name, False) for name in g))
    return tuple(
        f"{', '.join(group[:-1])} and {group[-1]} are not determined separately: their effects on the data are nearly"
        " proportional; hold one of them at a known value"
        for group in lost
    )


ITERATIONS = 200  # of a local search, after which it has not converged
MANY = 1000  # number of residuals above which a Jacobian is replaced by its triangular factor
SAME = 1e-5  # relative difference of RSS below which two minima are the same


@dataclasses.dataclass
class Objective:
    """A bounded least-squares problem that counts its evaluations.

    residual(theta) (n,); jacobian(theta, free) (n, k): of the coordinates ``free``. lower, upper (m,): bounds, equal
    where a coordinate is fixed. ftol: relative change of RSS at convergence, floor: absolute one; close: tolerance of
    the square root of a rise of RSS.
    """

    residual: Callable[[np.ndarray], np.ndarray]
    jacobian: Callable[[np.ndarray, np.ndarray], np.ndarray]
    lower: np.ndarray
    upper: np.ndarray
    ftol: float = 1e-12
    floor: float = 0.0
    close: float = 1e-2
    residual_runs: int = 0
    jacobian_runs: int = 0

    @classmethod
    def of(
        cls, model: Callable[..., Array], inputs: Any, measured: Any, weights: Any, parameters: Parameters, *,
        points: Any = None, static: tuple = (), **tolerances: float,
    ) -> Objective:  # fmt: skip
        """Return the least squares of weights (model(theta, inputs, *static) - measured), all (n,), padded or not.

        model: a module function that jax traces; inputs: a pytree, or a function of theta that returns one; points: those
        of the n that are no padding, None for all; static: further hashable arguments of the model.
        """
        given = model, static, inputs, measured, weights, slice(None) if points is None else points
        floor = 1e-26 * float(np.sum((np.asarray(weights) * np.asarray(measured)) ** 2))
        return cls(
            functools.partial(_residual_at, *given), functools.partial(_slopes_at, *given), *parameters.bounds,
            **{"floor": floor, **tolerances},
        )  # fmt: skip

    @classmethod
    def of_one_program(
        cls, linearise: Callable[[np.ndarray], tuple[Any, ...]], bounds: Sequence[np.ndarray], **tolerances: float
    ) -> Objective:  # fmt: skip
        """Return the least squares whose weighted residuals and Jacobian are the first two results of linearise(theta)."""
        # of the last point, since the Jacobian is wanted where the residuals were found before
        found = functools.lru_cache(1)(lambda theta: linearise(np.frombuffer(theta)))
        residual, jacobian = (
            (lambda theta: found(theta.tobytes())[0]),
            (lambda theta, _: found(theta.tobytes())[1]),
        )
        return cls(residual, jacobian, *bounds, **tolerances)

    @property
    def free(self) -> np.ndarray:
        """Indices of the fitted coordinates."""
        return np.flatnonzero(self.upper > self.lower)

    def at(self, theta: np.ndarray) -> np.ndarray:
        """Return the weighted residuals (n,)."""
        self.residual_runs += 1
        return np.asarray(self.residual(theta))

    def slope(self, theta: np.ndarray) -> np.ndarray:
        """Return the Jacobian (n, k) of the residuals with respect to the free coordinates."""
        self.jacobian_runs += 1
        return np.asarray(self.jacobian(theta, self.free))


@functools.partial(jax.jit, static_argnames=("model", "static"))
def _residual(
    theta: Array, inputs: Any, measured: Array, weights: Array, model: Callable[..., Array], static: tuple
) -> Array:
    """Return weights (model - measured) at theta, (n,) with padding."""
    return weights * (model(theta, inputs, *static) - measured)


@functools.partial(jax.jit, static_argnames=("model", "static"))
def _slopes(theta: Array, free: Array, *given: Any, model: Callable[..., Array], static: tuple) -> Array:
    """Return the Jacobian (n, k) of ``_residual`` with respect to the coordinates at the places ``free`` (k,)."""
    varied = lambda values: _residual(theta.at[free].set(values), *given, model=model, static=static)
    return jax.jacfwd(varied)(theta[free])


def _residual_at(
    model: Callable[..., Array],
    static: tuple,
    inputs: Any,
    measured: Any,
    weights: Any,
    points: Any,
    theta: Any,
) -> Any:
    """Return the weighted residuals at theta (m,); a module function, so that fits can be pickled."""
    own = inputs(theta) if callable(inputs) else inputs
    found = _residual(theta, own, measured, weights, model=model, static=static)
    return found[points] if isinstance(found, jax.core.Tracer) else np.asarray(found)[points]


def _slopes_at(
    model: Callable[..., Array], static: tuple, inputs: Any, measured: Any, weights: Any, points: Any,
    theta: np.ndarray, free: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Return the Jacobian of these residuals with respect to the coordinates at the places ``free`` (k,)."""
    own = inputs(theta) if callable(inputs) else inputs
    found = _slopes(jnp.asarray(theta), free, own, measured, weights, model=model, static=static)
    return np.asarray(found)[points]


class Best(NamedTuple):
    """A minimum of an objective.

    theta (m,), residual (n,), jacobian (n, k) of the free coordinates, rss; starts, agreed: number of local searches
    and number of them that reached this minimum; others: theta (m,) of each higher minimum; converged: whether the search
    ended by its tolerance, or because no step lowers RSS, and not after ``ITERATIONS``; left: the fall of RSS that the
    linearised residuals still promise there.
    """

    theta: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    rss: float
    starts: int = 1
    agreed: int = 1
    others: tuple[np.ndarray, ...] = ()
    converged: bool = True
    left: float = 0.0

    def after(self, first: Best) -> Best:
        """Return the minimum as the end of a search from several starts, whose best minimum was ``first``."""
        return self._replace(starts=first.starts, agreed=first.agreed, others=first.others)


def moved(best: Best, free: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Return d theta/d x = -(J^T J)^-1 J^T dr/dx at the optimum, (m,), from the derivative (n,) of the residuals."""
    change = np.zeros(best.theta.size)
    change[free] = -inverse(best.jacobian) @ (best.jacobian.T @ slope)
    return change


def minimise(objective: Objective, start: np.ndarray) -> Best:
    """Return the least-squares solution in the box from ``start``."""
    return minimise_some(objective, start, objective.free, objective.floor)


def minimise_from(objective: Objective, starts: Sequence[np.ndarray]) -> Best:
    """Return the lowest of the minima from several starts, of which those with non-finite residuals are skipped."""
    sound = [start for start in starts if np.all(np.isfinite(objective.at(start)))]
    found = [minimise(objective, start) for start in sound]
    best = min(found, key=lambda one: one.rss)
    low = best.rss * (1.0 + SAME) + objective.floor
    agreed = sum(one.rss <= low for one in found)
    # the minima whose RSS differ, the lowest first
    kept: list[Best] = []
    for one in sorted(found, key=lambda one: one.rss):
        if not kept or one.rss > kept[-1].rss * (1.0 + SAME):
            kept.append(one)
    others = tuple(one.theta for one in kept[1:])
    return best._replace(starts=len(found), agreed=agreed, others=others)


def minimise_some(objective: Objective, start: np.ndarray, some: np.ndarray, floor: float) -> Best:
    """Minimise over some of the free coordinates: Levenberg-Marquardt, each step a bounded linear least-squares
    problem.

    The search ends where the predicted reduction of RSS is no more than ftol times RSS plus ``floor``, which costs no
    further evaluation.
    """
    theta, own = np.clip(start, objective.lower, objective.upper), np.isin(objective.free, some)
    residual, damping = objective.at(theta), 0.0
    if not np.all(np.isfinite(residual)):  # no step can be found from here
        return Best(theta, residual, np.zeros((residual.size, own.size)), math.inf)
    jacobian = objective.slope(theta)
    converged, left = some.size == 0, 0.0
    small = _reduced(jacobian[:, own], residual)
    for _ in range(ITERATIONS if some.size else 0):
        # 1. The step of least RSS of the linearised residuals, within the bounds; the end if it promises too little.
        rss, (J, r) = float(residual @ residual), small
        room = objective.lower[some] - theta[some], objective.upper[some] - theta[some]
        step = _step(J, r, *room, damping)
        expected = rss - float(np.sum((r + J @ step) ** 2))
        if expected <= objective.ftol * rss + floor or damping > 1e8:
            converged, left = True, expected
            break

        # 2. It is taken, with less damping, if RSS falls; otherwise it is tried again with more.
        trial = theta.copy()
        trial[some] = np.clip(theta[some] + step, objective.lower[some], objective.upper[some])
        after = objective.at(trial)
        with np.errstate(over="ignore"):  # of a step much too long
            lower = np.all(np.isfinite(after)) and float(after @ after) < rss
        if lower:
            # Less, the better the fall agrees with that of the linearised residuals (H. B. Nielsen, Damping parameter in
            # Marquardt's method, IMM-REP-1999-05, DTU 1999, eq. 2.5): in a curved valley the damping then stays, where one
            # divided by ten each time costs a rejected step for each that is taken.
            gain = (rss - float(after @ after)) / expected
            damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
            theta, residual, damping = trial, after, damping if damping > 1e-4 else 0.0
            jacobian = objective.slope(theta)
            small = _reduced(jacobian[:, own], residual)
        else:
            damping = max(10.0 * damping, 1e-3)
    return Best(theta, residual, jacobian, float(residual @ residual), converged=converged, left=left)


def _reduced(J: np.ndarray, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return J (n, k) and r (n,); of many residuals the k + 1 rows of R in [J, r] = Q R, with the same steps."""
    if r.size <= MANY or J.shape[1] == 0:
        return J, r
    R = np.asarray(np.linalg.qr(np.column_stack([J, r]), mode="r"))
    return R[:, :-1], R[:, -1]


def _step(J: np.ndarray, r: np.ndarray, low: np.ndarray, high: np.ndarray, damping: float) -> np.ndarray:
    """Return the minimiser of |J s + r|^2 + damping |D s|^2 with low <= s <= high, D the norms of the columns."""
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-150)
    A, b = J / size, -r
    if damping > 0.0:
        A = np.concatenate([A, np.sqrt(damping) * np.eye(size.size)])
        b = np.append(b, np.zeros(size.size))
    step = np.linalg.lstsq(A, b, rcond=1e-12)[0]
    low, high = low * size, high * size
    if np.any(step < low) or np.any(step > high):
        step = scipy.optimize.lsq_linear(A, b, (low, np.maximum(high, low + 1e-300)), method="bvls").x
    return np.clip(step, low, high) / size


# Padding of arrays to a few lengths, so that another number of points does not trigger a new compilation.
#
# A padded point repeats the last time and has zero weight.


LEAST = 32


def length(n: int) -> int:
    """Return the smallest of 32, 48, 64, 96, 128, 192 ... that is at least n."""
    size = LEAST
    while size < n:
        size *= 2
    return 3 * size // 4 if size > LEAST and n <= 3 * size // 4 else size


def repeated(values: np.ndarray) -> np.ndarray:
    """Return values (n,) padded with the last of them."""
    return np.pad(values, (0, length(values.size) - values.size), mode="edge")


def without_weight(weights: np.ndarray) -> np.ndarray:
    """Return weights (n,) padded with zeros."""
    return np.pad(weights, (0, length(weights.size) - weights.size))


# Profile likelihoods by repeated fits, for models that are not linear in their compliances. The profile of a coordinate
# is traced outwards: at each trial value the other coordinates are fitted again, starting on the tangent of the profile,
# and the square root of the rise in RSS, which is nearly linear in the coordinate, is followed to the level (D. M. Bates,
# D. G. Watts, Nonlinear Regression Analysis, 1988, sec. 6.1). Its slope is known at each trial value, and two trial
# values on each side mostly suffice. The smallest RSS at a value may belong to another branch of minima than the one that
# was followed. So at the end of a branch the other known minima are tried: those below the level and, unless the root
# rose nearly linearly, as it does on a single branch, all of them. A coordinate that the best fit has at a bound where
# the residuals hardly depend on it, as on the logarithm of a compliance without limit, does not leave this bound in a
# local search; so that a start from inside its bounds is tried at the end of a branch as well.

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
