"""Search for a continuous relaxation spectrum: regularised least squares with the smoothness of highest evidence.

The data are y = A H + g e with the spectrum H > 0 at m times, and an equilibrium modulus g >= 0. The coordinates are log H
and g, and the minimum of

    |w (y - A H - g e)|^2 + lambda |D log H|^2,      D the second differences,

is the most probable spectrum if the noise is normal and D log H is normal about 0. lambda maximises the evidence,

    lambda^((m - 2)/2) |J^T J + lambda D^T D|^(-1/2) P^(-(n - 3)/2),     P the minimum, J the Jacobian

(D. J. C. MacKay, Neural Comput. 4 (1992) 415; A. Takeh, S. Shanbhag, Appl. Rheol. 23 (2013) 24628, for log H). The two
polynomials that D does not see, and g, have no prior.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares, nnls

SMOOTHNESS = np.geomspace(1e-4, 1e8, 25)  # trial lambdas, over the square of the noise at the first fit
NEXT = 10.0 ** np.array([0.5, 0.0, -0.5])  # trial lambdas over that of the last search, with other weights
DEEP = 1e-10  # least spectrum over the largest modulus
NEAR = 1e-8  # relative tolerance of the searches
EVALUATIONS = 200  # of a search, after which it has not converged
EXACT = 1e-6  # least mean square of the residuals over that of the data, of a discrete spectrum


class LinearSpectrum(NamedTuple):
    """The problem with A (n, m), e (n,) zero without an equilibrium modulus, and y (n,); largest: modulus of the data."""

    A: np.ndarray
    e: np.ndarray
    y: np.ndarray
    largest: float

    def weighted(self, w: np.ndarray) -> "LinearSpectrum":
        """Return the problem with every row multiplied by its weight (n,)."""
        return self._replace(A=w[:, None] * self.A, e=w * self.e, y=w * self.y)


class SpectrumOptimum(NamedTuple):
    """The most probable spectrum: log H (m,), g, residual (n,), Jacobian (n, m + 1) with respect to log H and g/largest,
    precision (m + 1, m + 1) over the variance of the noise, lambda, that variance, and whether the search converged."""

    log: np.ndarray
    equilibrium: float
    residual: np.ndarray
    jacobian: np.ndarray
    precision: np.ndarray
    smoothness: float
    variance: float
    converged: bool


def search(problem: LinearSpectrum, last: SpectrumOptimum | None = None) -> SpectrumOptimum:
    """Return the most probable spectrum at the smoothness of highest evidence; last: that of similar weights."""
    m, solid = problem.A.shape[1], bool(np.any(problem.e))
    D = np.diff(np.eye(m), 2, axis=0)
    found: list[tuple[float, SpectrumOptimum]] = []
    if last is None:
        trials = _noise(problem) * SMOOTHNESS[::-1]
        best = np.append(np.full(m, np.log(problem.largest / m)), 0.1)
    else:
        trials = last.smoothness * NEXT
        best = np.append(last.log, last.equilibrium / problem.largest)
    for smoothness in trials:  # from the smoothest, whose minimum is unique
        one, evidence = _optimum(problem, D, float(smoothness), best, solid)
        best = np.append(one.log, one.equilibrium / problem.largest)
        found.append((evidence, one))
    return max(found, key=lambda pair: pair[0])[1]


def _noise(problem: LinearSpectrum) -> float:
    """Return the mean square of the residuals of an unregularised spectrum >= 0."""
    A = np.column_stack([problem.A, problem.e])
    rss = nnls(A, problem.y, maxiter=50 * A.shape[1])[1] ** 2
    return float(max(rss / problem.y.size, EXACT * np.mean(problem.y**2)))


def _optimum(
    problem: LinearSpectrum, D: np.ndarray, smoothness: float, start: np.ndarray, solid: bool
) -> tuple[SpectrumOptimum, float]:
    """Return the optimum at a smoothness, and the logarithm of its evidence up to a constant."""
    A, e, y, largest = problem
    m, root = A.shape[1], np.sqrt(smoothness)
    bend = np.column_stack([root * D, np.zeros(len(D))])

    def jacobian(x: np.ndarray) -> np.ndarray:
        return np.column_stack([A * np.exp(x[:-1]), largest * e])

    low = np.append(np.full(m, np.log(DEEP * largest)), 0.0)
    high = np.append(np.full(m, np.log(1e4 * largest)), 10.0)
    found = least_squares(
        lambda x: np.append(A @ np.exp(x[:-1]) + largest * x[-1] * e - y, bend @ x),
        np.clip(start, low + 1e-9, high - 1e-9), lambda x: np.vstack([jacobian(x), bend]), (low, high),
        xtol=NEAR, ftol=NEAR, gtol=1e-14, max_nfev=EVALUATIONS,
    )  # fmt: skip
    J = jacobian(found.x)
    free = np.arange(m + 1) < m + (solid and found.x[-1] > 1e-8)
    precision = J.T @ J + bend.T @ bend
    P, n = 2.0 * found.cost, y.size
    _, volume = np.linalg.slogdet(precision[np.ix_(free, free)])
    evidence = 0.5 * ((m - 2) * np.log(smoothness) - volume - (n - 3) * np.log(P))
    residual, at = found.fun[:n], float(found.x[-1] * largest) if free[-1] else 0.0
    variance, converged = P / (n - 3), found.status != 0
    optimum = SpectrumOptimum(
        found.x[:-1], at, residual, J * free, precision, smoothness, variance, converged
    )
    return optimum, float(evidence)


def posterior_covariance(found: SpectrumOptimum) -> tuple[np.ndarray, np.ndarray]:
    """Return the covariance of log H (m, m), and the resolution matrix (m, m): the response of the estimate of log H at
    one time to a change of it at another one."""
    m = found.log.size
    free = np.any(found.jacobian != 0.0, axis=0)
    inverse = np.zeros_like(found.precision)
    inverse[np.ix_(free, free)] = np.linalg.pinv(
        found.precision[np.ix_(free, free)], rcond=1e-14, hermitian=True
    )
    resolution = inverse @ (found.jacobian.T @ found.jacobian)
    return found.variance * inverse[:m, :m], resolution[:m, :m]
