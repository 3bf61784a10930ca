"""Parts common to the fits of a series of given times, which are linear in values >= 0."""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy
from jax import Array
from jax.tree_util import Partial

from fitting.inference.evidence import Sample, Solved
from fitting.models.search_space import Landscape, SearchSpace
from fitting.models.structure import Sought
from fitting.search.nonlinear import Objective

PER_DECADE = 3  # largest number of automatically chosen times per decade


def space_of(sought: Sought, columns: np.ndarray) -> SearchSpace:
    """Return the search space of the values, each scaled so that its weighted response (n,) of columns has norm one."""
    norms = np.linalg.norm(columns, axis=0)
    unit = 1.0 / np.where(norms > 0.0, norms, 1.0)
    box = sought.structure.box(sought.table) / unit[:, None]
    return SearchSpace.linear(sought.structure, box, unit, np.ones(unit.size, dtype=bool))


def objective(A: np.ndarray, y: np.ndarray, space: SearchSpace) -> Objective:
    """Return the least-squares objective |A x - y|^2 for x >= 0."""
    return Objective(
        lambda x: A @ x - y, lambda x, free: A[:, free], *space.bounds, floor=1e-26 * float(y @ y)
    )


def chosen_times(
    span: tuple[float, float], most: int, columns: Callable[[np.ndarray], np.ndarray], sample: Sample
) -> np.ndarray:
    """Return the times (k,) [s] of lowest BIC for k = 1, 2, ..., counting only nonzero values as parameters.

    span: shortest and longest time [s] of the data; most: largest k by the number of points; columns(tau) (n, m): response
    to each value set to one.
    """
    first, last = span
    most = int(np.clip(PER_DECADE * np.log10(last / first), 1, most))
    y, found = sample.weights * sample.measured, []
    for k in range(1, most + 1):
        tau = first * (last / first) ** ((np.arange(k) + 0.5) / k)
        A = sample.weights[:, None] * columns(tau)
        size = np.linalg.norm(A, axis=0)
        x, residual = scipy.optimize.nnls(A / size, y)
        misfit = residual**2 if sample.known else y.size * np.log(max(residual**2, 1e-26 * float(y @ y)))
        found.append((misfit + np.sum(x > 0) * np.log(y.size), tau))
    return min(found, key=lambda one: one[0])[1]


def landscape(space: SearchSpace, solved: Solved, A: np.ndarray, y: np.ndarray) -> Landscape:
    """Return the residuals as a function of the values, each scaled so that it alone gives a response of the norm of y
    (n,)."""
    free, y, J = space.upper > space.lower, solved.weights * y, solved.weights[:, None] * A
    unit = np.linalg.norm(y) / np.where(free, np.linalg.norm(J, axis=0), np.linalg.norm(y))
    box = np.where(free[:, None], [0.0, np.inf], 0.0)
    return Landscape(Partial(_residual, J * unit, y), solved.theta * space.unit / unit, box, unit)


def _residual(A: Array, y: Array, values: Any) -> Array:
    return A @ values - y
