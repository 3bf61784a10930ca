"""Final stage of every fit: from the optimum of a search to a material or law with intervals, verdict and notes.

A fit module makes a ``FitProblem`` (data, what is sought, sample), finds its optimum (``least_squares``, or a search of its
own that returns a ``Solved``), and hands both to ``conclude``:

    problem = FitProblem(data, sought, space, sample, duration, level)
    solved = least_squares(problem, objective_of_weights, starts)
    return conclude(problem, solved).fit(MyFit)
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from fitting.inference import verdict
from fitting.inference.noise import two_sided
from fitting.inference.result import Estimate, Fit, Parameters
from fitting.inference.verdict import Assessment, Evidence, Sample, Solved, explains
from fitting.models.search_space import SearchSpace
from fitting.models.structure import Sought
from fitting.search import nonlinear, profiles
from fitting.search.nonlinear import Best, Objective, covariance, inseparable, log_covariance

Kind = TypeVar("Kind", bound=Fit)


@dataclasses.dataclass(frozen=True, eq=False)
class FitProblem:
    """The data, the sought structure and the search space of one fit.

    data: as the user gave them; sought: the material or law with its bounds; space: the coordinates of the search;
    sample: the fitted curve, a ``Sample``, or several curves that are judged together (``joint_search.Tests``);
    duration: time [s] that the data cover; level: confidence level of the intervals. ValueError unless intervals at
    this level can be found from the number of points.
    """

    data: Any
    sought: Sought
    space: SearchSpace
    sample: Any
    duration: float
    level: float

    def __post_init__(self) -> None:
        verdict.check(self.level, self.sample.least_count, self.p)

    @property
    def p(self) -> int:
        """Number of free coordinates."""
        return self.space.free.size


class Conclusion(NamedTuple):
    """Fields of a finished fit, with the interval ends of its coordinates.

    fields: those of a ``Fit``; ends (m, 2): interval ends of the coordinates, followed by further rows that the search
    returned; assessment: the evidence, whitened Jacobian and levels from the residuals.
    """

    fields: dict[str, Any]
    ends: np.ndarray
    assessment: Assessment

    def fit(self, kind: type[Kind], **own: Any) -> Kind:
        """Return the fit as an instance of ``kind``, with its own fields, which override the common ones."""
        return kind(**self.fields | own)


def solution(objective: Objective, best: Best, weights: np.ndarray, kept: np.ndarray | None = None) -> Solved:
    """Return the optimum of an objective with weights (n,) in the form that ``conclude`` takes; kept (n,) bool: all by
    default."""
    inside = ((best.theta > objective.lower) & (best.theta < objective.upper))[objective.free]
    on = np.ones(best.residual.size, dtype=bool) if kept is None else kept
    profile = lambda assessment: profiles.profile(objective, best, assessment.levels())
    return Solved(best.theta, best.residual, best.jacobian, inside, on, weights, profile, (best, objective))


def least_squares(
    problem: FitProblem, objective: Callable[[np.ndarray], Objective], starts: Sequence[np.ndarray],
    few: Objective | None = None,
) -> Solved:  # fmt: skip
    """Return the lowest minimum from several starts, with weights that are consistent with its residuals.

    objective: function of the weights (n,) [1/unit of the sample]; few: the objective of some of very many points, on which
    the searches from all starts are made, so that all points are used in the last one alone.
    """
    weights = problem.sample.weights
    first = nonlinear.minimise_from(objective(weights) if few is None else few, starts)
    if few is not None:
        whole = nonlinear.minimise(objective(weights), first.theta)
        first = whole._replace(starts=first.starts, agreed=first.agreed, others=first.others)

    def again(changed: list[np.ndarray]) -> list[Solved]:
        own = objective(changed[0])
        best = nonlinear.minimise(own, first.theta)
        best = best._replace(starts=first.starts, agreed=first.agreed, others=first.others)
        return [solution(own, best, changed[0])]

    found = [solution(objective(weights), first, weights)]
    return verdict.settled([problem.sample], found, again, problem.p)[0]


def conclude(problem: FitProblem, solved: Solved) -> Conclusion:
    """Return the fields of a fit from the optimum of its search.

    The noise of the residuals is estimated (``noise.py``), the coordinates are profiled to the levels that follow, the
    goodness of fit is judged (``verdict.py``), and everything is converted to SI units for the material.
    """
    assert solved.profile is not None
    assessment = problem.sample.assess(solved, problem.p, problem.level)
    searched = solved.whole if isinstance(solved.whole, tuple) and isinstance(solved.whole[0], Best) else None
    before = searched[1].unfinished if searched else 0
    ends = solved.profile(assessment)
    if searched:
        notes, against = _on_search(searched[0], searched[1].unfinished - before)
        solved = solved._replace(notes=(*solved.notes, *notes), against=(*solved.against, *against))
    if solved.left is not None:
        widened = ends + np.outer(solved.left, (-1.0, 1.0))
        ends = np.clip(widened, *(bound[:, None] for bound in problem.space.bounds))
    # samples that leave the judgement of trends to the fit still have the rule for R2 and scatter
    quality, low = assessment.evidence, tuple[str, ...]()
    if isinstance(problem.sample, Sample):
        some, left = problem.sample.of_solution(solved)
        if some.real(left.residual, problem.p):
            low = explains(quality.fitted, some.measured, some.weights, problem.p, quality.r2)
    why = dict.fromkeys([*quality.refused, *solved.against, *low])
    quality = dataclasses.replace(quality, refused=tuple(why))
    found = _estimate(problem.space, solved, ends, assessment.slopes, two_sided(problem.level))
    assessment = assessment._replace(evidence=quality)
    return Conclusion(_fields(problem, solved, assessment, found), ends, assessment)


def _on_search(best: Best, unfinished: int) -> tuple[list[str], list[str]]:
    """Return notes and reasons for rejection that follow from the course of a search.

    unfinished: number of searches along the profiles of the intervals that did not converge.
    """
    notes, against = [], []
    if not best.converged:
        against.append(
            f"the search did not converge within {nonlinear.ITERATIONS} steps, so that the parameters need not be those of"
            " the least squares: give bounds, or hold what is known by fixed="
        )
    if best.starts > 2 and best.agreed == 1:
        notes.append(
            f"only 1 of {best.starts} starts reached the best minimum, so that a lower one may have been missed: narrow the"
            " bounds, or hold what is known by fixed="
        )
    if unfinished:
        notes.append(
            f"{unfinished} searches along the intervals did not converge within {nonlinear.ITERATIONS} steps: the intervals"
            " may be too short"
        )
    return notes, against


def with_intervals(problem: FitProblem, intervals: dict[str, Any], refused: Any) -> dict[str, Any]:
    """Return the fields of a fit that depend on its intervals, for intervals that were changed after ``conclude``."""
    found = verdict.identified(intervals, problem.sought.table, problem.level, refused)
    return {"intervals": intervals, "identified": found}


def _estimate(
    space: SearchSpace, solved: Solved, ends: np.ndarray, slopes: np.ndarray, quantile: float
) -> Estimate:
    """Undo the scaling; ends (m, 2): of the intervals; slopes (n, k): whitened Jacobian of the free coordinates
    (``evidence.Assessment``); quantile: of half an interval over the standard deviation."""
    own, theta, free, moves = space.material, solved.theta, space.free, solved.moves
    unit, slope, inside = space.unit[own], space.slope(theta), np.zeros(theta.size, dtype=bool)
    J, varied = np.zeros((len(slopes), theta.size)), np.isin(np.arange(theta.size), free)
    J[:, free], inside[free] = slopes, solved.inside
    by_log = (J * inside)[:, own] * space.by_log(theta)
    left = np.abs(0.0 if solved.left is None else solved.left)
    left = np.broadcast_to(left, len(ends))[: theta.size][own]
    return Estimate(
        space.values(theta) * unit, space.opened(theta) * unit, space.spans(theta, ends[: theta.size]),
        _with_systematic(covariance(J, varied)[np.ix_(own, own)], left / quantile) * np.outer(slope, slope),
        log_covariance(_projected(by_log, (J * inside)[:, ~own]), inside[own]),
        functools.partial(_moved, moves, own, slope), solved.landscape,
    )  # fmt: skip


def _moved(
    moves: Callable[[str], np.ndarray] | None, own: np.ndarray, slope: np.ndarray, name: str
) -> np.ndarray:
    """Return the derivative of the compliances [SI] with respect to a held quantity, zero where there is none."""
    return moves(name)[own] * slope if moves else np.zeros(slope.size)


def _with_systematic(noise: np.ndarray, more: np.ndarray) -> np.ndarray:
    """Return a covariance (m, m) with standard deviations that are larger by ``more`` (m,), at equal correlations."""
    sd = np.sqrt(np.maximum(np.diag(noise), 0.0))
    growth = 1.0 + np.divide(more, sd, out=np.zeros(sd.size), where=sd > 0.0)
    return noise * np.outer(growth, growth) + np.diag(np.where(sd > 0.0, 0.0, more**2))


def _projected(J: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return J (n, m) minus its projection on the nonzero columns of others (n, k)."""
    Q = np.linalg.qr(others[:, np.any(others != 0.0, axis=0)])[0]
    return J - Q @ (Q.T @ J)


def _fields(problem: FitProblem, solved: Solved, assessment: Assessment, found: Estimate) -> dict[str, Any]:
    """Return the fields of a ``Fit``."""
    sample, sought, data, quality = problem.sample, problem.sought, problem.data, assessment.evidence
    names = [problem.space.names[i] for i in problem.space.free]
    parameters = _parameters(sought, found, problem.level, quality)
    said = *getattr(data, "notes", ()), *sample.error(solved, assessment), *quality.doubts, *solved.notes
    together = inseparable(assessment.slopes, names, parameters.identified)
    return vars(quality) | vars(parameters) | {
        "structure": sought.structure, "data": data, "weights": sample.label, "level": problem.level,
        "duration": problem.duration, "curve": sample.curve(solved.kept), "estimate": found,
        "notes": tuple(dict.fromkeys([*said, *together])),
    }  # fmt: skip


def _parameters(sought: Sought, found: Estimate, level: float, quality: Evidence) -> Parameters:
    """Return the material parameters of an estimate."""
    structure, table, log = sought.structure, sought.table, found.log
    values = {name: float(value) for name, value in structure.parameters(found.opened).items()}
    intervals = structure.intervals(found.spans, table)
    fixed = tuple(name for name, (low, high) in table.items() if low == high)
    names = {place: name for name, place in structure.where.items()}
    sd = dict.fromkeys(values, math.inf)
    sd |= {names[place]: float(v) for place, v in zip(log.places, log.sd, strict=True)}
    return Parameters(
        material=structure.material(values, sought.volume), values=values, intervals=intervals,
        identified=verdict.identified(intervals, table, level, quality.refused), fixed=fixed,
        sd_log=sd | dict.fromkeys(fixed, 0.0), tau=structure.times(found.opened), condition=log.condition,
        weakest={names[place]: float(v) for place, v in zip(log.places, log.weakest, strict=True)},
        weakest_sd=log.weakest_sd,
    )  # fmt: skip
