"""How correlated the noise of a series is, as far as its residuals tell, and what that does to intervals.

The noise is taken as white or as an AR(1) series of correlation rho; both are judged by the restricted
likelihood of the residuals (D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320), which knows that a fit of p
parameters takes correlation out of n residuals, much of it if n is 20. With Q an orthonormal basis of the
Jacobian's columns and V the correlation matrix, the variance of an estimate is trace(Q^T V Q)/p times that
of white noise in the mean over directions, and E[RSS] is n - trace(Q^T V Q) in place of n - p. Intervals
come from the mixture over all rho, by what the data and Jeffreys' prior d rho/sqrt(1 - rho^2) say of each.
"""

import math
from typing import NamedTuple

import numpy as np
import scipy

from fitting import student

RHO = np.tanh(np.linspace(0.0, 2.15, 31))  # up to 0.973
WHITE = 0.3  # prior share of white noise
BEYOND_CHANCE = 3.3  # standard errors 1/sqrt(n) of a correlation: one in two thousand series of white noise
MORE_LIKELY_THAN_NOT = 0.5


class Noise(NamedTuple):
    """lag1: correlation of neighbouring residuals about their mean; share (k,): probability of each of RHO;
    inflation (k,): factor on the variance of an estimate over s^2 of white noise; known_inflation: the same where
    sigma is known; likeliest: rho; left: correlation of neighbours that it leaves."""

    lag1: float
    share: np.ndarray
    inflation: np.ndarray
    known_inflation: np.ndarray
    likeliest: float
    left: float


def basis(jacobian: np.ndarray) -> np.ndarray:
    """Orthonormal columns (n, k) that span those of the Jacobian which are not zero."""
    size = np.linalg.norm(jacobian, axis=0)
    return np.linalg.qr(jacobian[:, size > 0] / size[size > 0])[0]


def lag_one(residual: np.ndarray) -> float:
    """Correlation of neighbours, about their mean."""
    r = residual - residual.mean()
    total = float(r @ r)
    return float(r[1:] @ r[:-1]) / total if total > 0 else 0.0


def judge(residual: np.ndarray, Q: np.ndarray, p: int) -> Noise:
    """The noise of residuals (n,) of a fit of p parameters whose Jacobian has the basis Q (n, k)."""
    n, k = Q.shape
    likelihood = np.array([_restricted(residual, Q, rho) for rho in RHO]) if residual.any() else 0.0 * RHO
    prior = np.sqrt(1.0 - RHO**2)  # d rho is (1 - rho^2) of the even steps in artanh(rho)
    prior *= (1.0 - WHITE) / prior.sum()
    prior[0] += WHITE
    share = prior * np.exp(likelihood - likelihood.max())
    trace = np.array([_trace(Q, rho) for rho in RHO])
    mean = trace / k if k else np.ones(RHO.size)
    rho = float(RHO[np.argmax(likelihood)])
    left = lag_one(residual[1:] - rho * residual[:-1])
    return Noise(lag_one(residual), share / share.sum(), mean * (n - k) / (n - trace), mean, rho, left)


def _restricted(residual: np.ndarray, Q: np.ndarray, rho: float) -> float:
    """Restricted log likelihood of rho, up to a constant; the inverse of V is tridiagonal."""
    n, k = Q.shape
    M = np.column_stack([Q, residual])
    inner = (1.0 + rho**2) * M.T @ M - rho * (M[1:].T @ M[:-1] + M[:-1].T @ M[1:])
    A = (inner - rho**2 * (np.outer(M[0], M[0]) + np.outer(M[-1], M[-1]))) / (1.0 - rho**2)
    rss = A[k, k] - A[k, :k] @ np.linalg.solve(A[:k, :k], A[:k, k])
    logdet = (n - 1) * math.log(1.0 - rho**2) + np.linalg.slogdet(A[:k, :k])[1]
    return -0.5 * (logdet + (n - k) * math.log(max(rss, 1e-300)))


def _trace(Q: np.ndarray, rho: float) -> float:
    """trace(Q^T V Q), V_ij = rho^|i - j|."""
    bands = np.outer([1.0, -rho], np.ones(len(Q)))
    past = scipy.linalg.solve_banded((1, 0), bands, Q)  # past[i] = Q[i] + rho past[i - 1]
    return float(2.0 * np.sum(Q * past) - np.sum(Q * Q))


def widening(noise: Noise, level: float, dof: float) -> float:
    """Factor on the allowed rise of RSS, 1 where the noise is more likely white than not."""
    if noise.share[0] > MORE_LIKELY_THAN_NOT:
        return 1.0
    factor = np.sqrt(noise.known_inflation if math.isinf(dof) else noise.inflation)
    single = student.two_sided(level, dof)
    # the half width in which the mixture over rho has the share ``level``
    short = lambda q: float(noise.share @ student.share_within(q / factor, dof)) - level
    low, high = 0.5 * single * factor.min(), 2.0 * single * factor.max()
    return max((scipy.optimize.brentq(short, low, high, rtol=1e-12) / single) ** 2, 1.0)
