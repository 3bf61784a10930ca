"""From the optimum of a search in coordinates to what is said of a material in SI."""

from collections.abc import Callable
from typing import Any

import numpy as np
from jax.tree_util import Partial

from fitting.inference import evidence
from fitting.inference.evidence import Sample, Solved
from fitting.inference.result import Estimate, Landscape, findings
from fitting.models.coordinates import NUISANCES, Space
from fitting.models.structure import Volume
from fitting.search import nonlinear, profiles
from fitting.search.nonlinear import Best, Objective
from fitting.search.uncertainty import covariance, log_covariance


def inside_box(space: Space, theta: np.ndarray) -> np.ndarray:
    """Which coordinates are off their bounds, (m,) bool."""
    low, high = space.bounds
    return (theta > low) & (theta < high)


def off_bounds(objective: Objective, best: Best) -> np.ndarray:
    """Return which of the free coordinates are off their bounds, (k,) bool."""
    return ((best.theta > objective.lower) & (best.theta < objective.upper))[objective.free]


def settled(
    sample: Sample, of: Callable[[np.ndarray], Objective], best: Best
) -> tuple[Sample, Best, Objective]:
    """The optimum whose weights agree with its residuals (``evidence.settled``), from that with the sample's weights;
    of(weights (n,)): the objective."""

    def solved(weights: np.ndarray, best: Best, objective: Objective) -> Solved:
        inside = off_bounds(objective, best)
        kept = np.ones(weights.size, dtype=bool)
        return Solved(best.residual, best.jacobian, inside, kept, weights, (best, objective))

    def solve(weights: np.ndarray) -> Solved:
        objective = of(weights)
        found = nonlinear.minimise(objective, best.theta)
        again = found._replace(starts=best.starts, agreed=best.agreed, others=best.others)
        return solved(weights, again, objective)

    first = solved(sample.weights, best, of(sample.weights))
    found = evidence.settled(sample, first, solve, best.jacobian.shape[1])
    return sample._replace(weights=found.weights), *found.whole


def conclude(
    space: Space, table: dict, volume: Volume, sample: Sample, best: Best, objective: Objective, level: float,
    moves: Callable[[str], np.ndarray] | None = None, residual: Callable[[Any], Any] | None = None,
    kept: np.ndarray | None = None, left: Any = 0.0, against: tuple[str, ...] = (),
) -> tuple[dict[str, Any], np.ndarray]:  # fmt: skip
    """The fields of a ``Fit`` from the optimum of a search in coordinates, and the ends (m, 2) of their intervals.

    sample: the points kept (n,) bool of those that the objective has, of all without; moves and residual: as in
    ``estimate``; left (m,): a bias of the coordinates that the intervals have to hold; against: further
    reasons to refuse the fit.
    """
    on = np.ones(best.residual.size, dtype=bool) if kept is None else kept
    inside = off_bounds(objective, best)
    judged = evidence.judge(sample, best.residual[on], best.jacobian[on], inside, space.free.size, level)
    ends = profiles.profile(objective, best, judged.levels()) + np.outer(
        left * np.ones(len(space.box)), (-1.0, 1.0)
    )
    ends = np.clip(ends, *(bound[:, None] for bound in space.bounds))
    reasons = (*judged.evidence.refused, *against)
    judged = judged._replace(evidence=judged.evidence._replace(refused=reasons))
    still = lambda name: np.zeros(best.theta.size)
    found = estimate(space, best, moves or still, ends, judged.slopes, residual)
    names = [space.names[i] for i in space.free]
    return findings(space.structure, table, level, volume, judged, found, names), ends


def estimate(
    space: Space, best: Best, moves: Callable[[str], np.ndarray], ends: np.ndarray,
    slopes: np.ndarray, residual: Callable[[Any], Any] | None,
) -> Estimate:  # fmt: skip
    """The scaling undone, for the material; moves(name) (m,): of the coordinates; ends (m, 2); slopes (n, k): of
    the free coordinates, as ``evidence.Conclusion`` has them; residual (n,): of the coordinates, None where it is dear."""
    own, theta, unit = space.material, best.theta, space.unit[space.material]
    low, high = space.bounds
    inside, slope = inside_box(space, theta), space.slope(theta) * unit
    J = np.zeros((len(slopes), theta.size))
    J[:, space.free] = slopes
    whole = covariance(J, low < high)[np.ix_(own, own)]
    by_log = (J * inside)[:, own] * np.where(space.logarithmic, 1.0, theta)[own]
    spans = np.stack([space.opened(end) for end in ends.T], -1)
    return Estimate(
        space.to_si(theta)[own], space.opened(theta) * unit, spans * unit[:, None],
        whole * np.outer(slope, slope),
        log_covariance(_projected(by_log, (J * inside)[:, ~own]), inside[own]),
        lambda name: moves(name)[own] * slope,
        residual and _landscape(space, theta, residual),
    )  # fmt: skip


def _landscape(space: Space, theta: np.ndarray, residual: Callable[[Any], Any]) -> Landscape:
    best = np.append(space.compliances(theta), theta[~space.material])
    run = Partial(lambda values: residual(space.vector(values)))
    return Landscape(run, best, space.box, space.unit, tuple(NUISANCES))


def _projected(J: np.ndarray, others: np.ndarray) -> np.ndarray:
    """J (n, m) less its part along the columns of others (n, k) that are not zero."""
    Q = np.linalg.qr(others[:, np.any(others != 0.0, axis=0)])[0]
    return J - Q @ (Q.T @ J)
