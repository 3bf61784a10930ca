"""Judgement of an adhesive force curve: systematic deviations from the model, their size, and their meaning.

As with other force curves (``force_verdict``), a curve of a real sample whose noise is small is never described to within
it, so that a trend of the residuals alone is no reason for a rejection. Where the common tests find one, the model is fitted
again to the shallower and to the deeper half of the contact, and, without a range of the attraction (JKR), with one. The
intervals are widened by the largest change of each parameter, and the fit is rejected if modulus or work change by more
than ``CHANGE`` or the trend exceeds ``TREND`` of the largest force.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from fitting.fits.force_verdict import Deviation
from fitting.inference.conclusion import FitProblem
from fitting.inference.evidence import Assessment, Sample, Solved
from fitting.models.adhesive_curve import JKR
from fitting.search import nonlinear
from fitting.search.adhesive_search import AdhesiveTest

CHANGE = 0.4  # of the logarithm of a parameter between half the contact and the whole
TREND = 0.05  # of the largest force, in size
WINDOW = 0.05  # fraction of the points in a running mean of the residuals
FEW = 8  # fewest points in half the contact


class AdhesiveSample(Sample):
    """The points of an adhesive force curve, whose trends this module judges in place of the common tests."""

    def assess(self, solved: Solved, p: int, level: float) -> Assessment:
        """Return the evidence without reasons for rejection."""
        found = super().assess(solved, p, level)
        return found._replace(evidence=dataclasses.replace(found.evidence, refused=()))


def deviation(
    test: AdhesiveTest, problem: FitProblem, solved: Solved, with_range: Callable[[], np.ndarray] | None
) -> Deviation:
    """Return the systematic deviation of a solved curve.

    with_range: returns the coordinates (m,) of the fit with a range of the attraction; None where the model has one.
    """
    nothing = np.zeros(solved.theta.size)
    if not Sample.assess(problem.sample, solved, problem.p, problem.level).evidence.refused:
        return Deviation(nothing, (), ())
    halves = [_half(test, problem, solved, deep) for deep in (False, True)]
    if any(half is None for half in halves):
        return Deviation(nothing, ("too few points in contact to judge the trend of the residuals",), ())
    others = halves if with_range is None else [*halves, with_range()]
    left = np.max(np.abs(np.array(others) - solved.theta), axis=0)
    trends = {mark: _trend(test, solved, mark) for mark in ("approach", "retract")}
    found = _words(test, max(trends.values()), left)
    if max(trends.values()) > TREND or np.max(left[:2]) > CHANGE:
        return Deviation(left, (f"{found}: {_meaning(trends)}",), ())
    return Deviation(left, (), (f"{found}, which the intervals include",))


def _words(test: AdhesiveTest, trend: float, left: np.ndarray) -> str:
    """Return the size of a trend and of the changes of modulus and work in words."""
    force = trend * _largest(test)
    G, work = (100.0 * math.expm1(change) for change in left[:2])
    other = " or a range of the attraction" if test.model is JKR and test.body.film is None else ""
    return (
        f"the residuals have a trend of {100 * trend:.1f} % of the largest force ({force:.3g} N); with half the contact"
        f"{other} G changes by {G:.1f} % and work by {work:.1f} %"
    )


def _largest(test: AdhesiveTest) -> float:
    """Return the largest force in contact, in size [N]."""
    return float(np.max(np.abs(test.data.load[test.seen.contact])))


def _trend(test: AdhesiveTest, solved: Solved, mark: str) -> float:
    """Return the largest running mean of the residuals of one segment in contact over the largest force; 0 without it."""
    some = test.seen.contact & (test.data.segments == mark)
    if not np.any(some):
        return 0.0
    deviations = solved.residual[some] / solved.weights[some]
    width = min(max(int(WINDOW * deviations.size), 3), deviations.size)
    mean = np.convolve(deviations, np.ones(width) / width, mode="valid")
    return float(np.max(np.abs(mean)) / _largest(test))


def _half(test: AdhesiveTest, problem: FitProblem, solved: Solved, deep: bool) -> np.ndarray | None:
    """Return the coordinates (m,) of the fit to the deeper or shallower half; None with too few points."""
    depth, contact = test.data.depth, test.seen.contact
    middle = 0.5 * (depth[contact].min() + depth[contact].max())
    some = contact & ((depth >= middle) == deep)
    if np.sum(some) < FEW:
        return None
    half = test.objective(problem.space, np.where(some, solved.weights, 0.0))
    half.lower, half.upper = (bound.copy() for bound in problem.space.bounds)
    return nonlinear.minimise(half, solved.theta).theta


def _meaning(trends: dict[str, float]) -> str:
    """Return what a trend may mean."""
    if trends["approach"] > TREND:
        return (
            "approach and retraction may have different works of adhesion, as an edge that advances and one that recedes"
            ' often have: fit the retraction alone (data.only("retract"))'
        )
    return (
        "the sample may creep, be a film on a base, or be rough, the ball may have another radius, or the attraction a range"
        " that the model does not have"
    )
