"""From the optimum of a search in coordinates to what is said of a material in SI."""

from collections.abc import Callable
from typing import Any

import numpy as np
from jax.tree_util import Partial

from fitting.coordinates import NUISANCES, Space
from fitting.nonlinear import Best
from fitting.result import Estimate, Landscape
from fitting.uncertainty import covariance, log_covariance


def inside_box(space: Space, theta: np.ndarray) -> np.ndarray:
    """Which coordinates are off their bounds, (m,) bool."""
    low, high = space.bounds
    return (theta > low) & (theta < high)


def estimate(
    space: Space, best: Best, moves: Callable[[str], np.ndarray], ends: np.ndarray, spread: float,
    residual: Callable[[Any], Any] | None,
) -> Estimate:  # fmt: skip
    """The scaling undone, for the material; moves(name) (m,): of the coordinates; ends (m, 2); spread: s; residual
    (n,): of the coordinates, None where it is dear."""
    own, theta, unit = space.material, best.theta, space.unit[space.material]
    low, high = space.bounds
    inside, slope = inside_box(space, theta), space.slope(theta) * unit
    J = np.zeros((best.residual.size, theta.size))
    J[:, space.free] = best.jacobian
    whole = covariance(J, low < high, spread)[np.ix_(own, own)]
    by_log = (J * inside)[:, own] * np.where(space.logarithmic, 1.0, theta)[own]
    spans = np.stack([space.opened(end) for end in ends.T], -1)
    return Estimate(
        space.to_si(theta)[own], space.opened(theta) * unit, spans * unit[:, None],
        whole * np.outer(slope, slope),
        log_covariance(_projected(by_log, (J * inside)[:, ~own]), inside[own], spread),
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
