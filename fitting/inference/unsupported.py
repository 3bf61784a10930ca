"""Detection of isolated outliers of a creep curve, such as a reading before the load or a spike.

A fit may pass through a single influential point, which then shows no residual. So each point of high leverage, or with
a large residual, is left out in turn, alone and with its neighbour, and the rest are fitted again. The point is dropped
if its deleted residual is then larger than noise can explain (the externally studentised residual; R. D. Cook, S.
Weisberg, Residuals and Influence in Regression, 1982, sec. 2.2) and the points around it agree with the fit.
"""

import math
from typing import NamedTuple

import numpy as np

from fitting.inference import student, verdict
from fitting.inference.correlation import basis
from fitting.search import creep_search, varpro
from fitting.search.creep_search import Optimum

MUCH = 0.3  # leverage above which a point is tried
TRIED = 4  # largest number of points of each kind that are tried
CHANCE = 1e-4  # probability of leaving out a point of a series of Gaussian noise
LEAST = 1e-2  # smallest relative deviation of a dropped point
MOST = 0.05  # largest fraction of the points that may be left out


class SupportedPoints(NamedTuple):
    """The points of a creep curve that remain after outliers are dropped.

    kept (n,) bool: the remaining points; problem: with zero weight on the others; best: its optimum.
    """

    kept: np.ndarray
    problem: varpro.TauSearch
    best: Optimum


def keep_all(problem: varpro.TauSearch, n: int) -> SupportedPoints:
    """Return the optimum of all points."""
    return SupportedPoints(np.ones(n, dtype=bool), problem, creep_search.minimise(problem))


def leave_out(problem: varpro.TauSearch, n: int) -> SupportedPoints:
    """Return the optimum without outliers, or of all points if there are too many outliers."""
    found = whole = keep_all(problem, n)
    while (worse := _worst(problem, found)) is not None:
        if np.sum(~worse.kept) > max(MOST * n, 2):
            return whole
        found = worse
    return found


def _worst(problem: varpro.TauSearch, now: SupportedPoints) -> SupportedPoints | None:
    """Return the state without the most significant outliers, None if there are none."""
    found, highest = None, 1.0
    for points in _candidates(now):
        trial = _without(problem, now.kept, points)
        score = _score(problem, trial, points)
        if score > highest:
            found, highest = trial, score
    return found


def _without(problem: varpro.TauSearch, kept: np.ndarray, points: list[int]) -> SupportedPoints:
    kept = kept.copy()
    kept[points] = False
    weights = np.array(problem.weights)
    weights[: kept.size][~kept] = 0.0
    fewer = problem._replace(weights=weights)
    return SupportedPoints(kept, fewer, creep_search.minimise(fewer))


def _candidates(now: SupportedPoints) -> list[list[int]]:
    """Return points of high leverage or large residual, alone and, of the first kind, with the following point."""
    on = np.flatnonzero(now.kept)
    J = creep_search.inside_jacobian(now.problem, now.best)[on]
    residual, say = np.asarray(now.best.residual)[on], np.sum(basis(J) ** 2, 1)
    much = [int(i) for i in np.argsort(-say)[:TRIED] if say[i] > MUCH]
    off = sorted(verdict.outlying(residual, J), key=lambda i: -abs(residual[i]))[:TRIED]
    alone = [[int(on[i])] for i in dict.fromkeys([*much, *off])]
    return alone + [[int(on[i]), int(on[i + 1])] for i in much if i + 1 < on.size]


def _score(problem: varpro.TauSearch, trial: SupportedPoints, points: list[int]) -> float:
    """Return the smallest deleted residual over its significance limit; 0 where the neighbouring points deviate too."""
    n, on = trial.kept.size, np.flatnonzero(trial.kept)
    away = np.asarray(creep_search.residuals(problem, trial.best))[:n]
    value = np.abs(away + np.asarray(problem.weights * problem.data)[:n])
    J = creep_search.inside_jacobian(problem, trial.best)[:n]
    dof = on.size - J.shape[1]
    beside = [i for i in (min(points) - 1, max(points) + 1) if 0 <= i < n]
    size = np.min(np.abs(away[points]))
    if dof < 2 or size < LEAST * np.max(value[points]):
        return 0.0
    if np.max(np.abs(away[beside])) > verdict.ISOLATED * size:
        return 0.0
    variance = away[on] @ away[on] / dof * (1.0 + _spread(J[on], J[points]))
    limit = student.two_sided(1.0 - CHANCE / n, dof)
    return float(np.min(np.abs(away[points]) / np.sqrt(variance + 1e-300))) / limit


def _spread(J: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return x (J^T J)^-1 x of rows x (m, k), infinite along directions that J (n, k) does not determine."""
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    _, s, V = np.linalg.svd(J / size, full_matrices=False)
    along = rows / size @ V.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(np.sum((along / np.where(s > 1e-9 * s[0], s, 0.0)) ** 2, 1), nan=math.inf)
