"""Judgement of a force curve: systematic deviations from the model, their size, and their meaning.

A measured force curve of a real sample is never described to within its noise, so that a trend of the residuals alone is
no reason for a rejection. Where the common tests find one (``inference/verdict.py``), the modulus is fitted again to the
shallower half of the indentation. The intervals are widened by the change of the parameters, and the fit is rejected if the
modulus changes by more than ``CHANGE`` or the trend exceeds ``TREND`` of the largest force.
"""

import math
from typing import NamedTuple

import numpy as np

from fitting.fits.force_search import ForceProblem
from fitting.inference.conclusion import FitProblem
from fitting.inference.evidence import Sample, Solved
from fitting.models.force_curve import indentation_force
from fitting.search import nonlinear

CHANGE = 0.4  # of the logarithm of the modulus between half the depth and the whole
TREND = 0.05  # of the largest force
WINDOW = 0.05  # fraction of the points in a running mean of the residuals
SEEN = 5.0  # least indentation force in standard deviations of the baseline
SHORT = 0.02  # least baseline, as a fraction of the depth of the curve
FEW = 8  # fewest points in contact
HALF = 0.5  # of the largest depth


class Deviation(NamedTuple):
    """left (5,): change of the coordinates that the intervals must include; against: reasons for rejection; notes."""

    left: np.ndarray
    against: tuple[str, ...]
    notes: tuple[str, ...]


def deviation(problem: FitProblem, force: ForceProblem, solved: Solved) -> Deviation:
    """Return the systematic deviation of a solved force curve."""
    nothing = np.zeros(solved.theta.size)
    missing = _missing(force, solved)
    if missing:
        return Deviation(nothing, missing, ())
    found = Sample.assess(problem.sample, solved, problem.p, problem.level).evidence
    if not found.refused:
        return Deviation(nothing, (), ())
    trend, softer = _trend(force, solved), _change(force, solved)
    if softer is None:
        return Deviation(nothing, ("too few points in contact to judge the trend of the residuals",), ())
    size = f"a trend of {100 * trend:.1f} % of the largest force ({trend * force.units[0] * 1e12:.3g} pN)"
    change = math.expm1(abs(softer[0]))
    way = "falls" if softer[0] > 0 else "rises"
    if trend > TREND or abs(softer[0]) > CHANGE:
        why = f"the residuals have {size}, and the modulus {way} by {100 * change:.0f} % from half the depth to the whole"
        return Deviation(np.abs(softer), (f"{why}: {_meaning(softer[0], force)}",), ())
    note = (
        f"the residuals have {size}; the intervals include the change of the modulus from half the depth to the whole,"
        f" by which it {way} by {100 * change:.1f} %: {_meaning(softer[0], force)}"
    )
    return Deviation(np.abs(softer), (), (note,))


def _missing(force: ForceProblem, solved: Solved) -> tuple[str, ...]:
    """Return the reasons why a curve has no indentation, or no baseline."""
    curve, theta = force.curve, solved.theta
    outside = np.asarray(curve.depth) < theta[2]
    if outside.sum() < max(5, SHORT * outside.size):
        return (
            f"the contact is among the first points ({int(outside.sum())} before it): the curve has no baseline, so that"
            " the contact point is not determined",
        )
    if (~outside).sum() < FEW:
        return (f"no indentation: {int((~outside).sum())} points after the contact point",)
    deviations = solved.residual / solved.weights / force.units[0]
    noise = float(np.std(deviations[outside]))
    pushed = float(indentation_force(theta, curve.depth[-1] - theta[2], curve))
    if pushed < SEEN * noise:
        return (
            f"no indentation: the force rises by {pushed * force.units[0] * 1e12:.3g} pN, the noise of the baseline is"
            f" {noise * force.units[0] * 1e12:.3g} pN",
        )
    return ()


def _trend(force: ForceProblem, solved: Solved) -> float:
    """Return the largest running mean of the residuals in contact over the largest force."""
    deviations = solved.residual / solved.weights / force.units[0]
    width = max(int(WINDOW * deviations.size), 3)
    mean = np.convolve(deviations, np.ones(width) / width, mode="valid")
    return float(np.max(np.abs(mean)))


def _change(force: ForceProblem, solved: Solved) -> np.ndarray | None:
    """Return the coordinates (5,) of the fit to all points minus those of the fit up to half the largest depth."""
    depth, theta = np.asarray(force.curve.depth), solved.theta
    some = depth - theta[2] <= HALF * (depth[-1] - theta[2])
    if np.sum(some & (depth > theta[2])) < 5:
        return None
    objective = force.objective(np.where(some, solved.weights, 0.0))
    objective.lower, objective.upper = (bound.copy() for bound in force.space.bounds)
    return theta - nonlinear.minimise(objective, theta).theta


def _meaning(softer: float, force: ForceProblem) -> str:
    """Return what a change of the modulus with depth may mean, in a microscopist's words."""
    if softer > 0:
        return (
            "the sample seems to soften with depth: adhesion or repulsion near the contact, a tip blunter than assumed, or"
            " a stiff surface; fit a larger depth, or check the tip"
        )
    if force.setup.thickness is None:
        return (
            "the sample seems to stiffen with depth: a thin sample on a hard base (give its --thickness), a brush or"
            " membrane above it, or a tip sharper than assumed"
        )
    return "the sample seems to stiffen with depth: thinner than given, a brush above it, or large strains"
