"""Quantiles of Student's t distribution, and of the normal distribution for infinite degrees of freedom.

The squares of these variables have the distributions F(1, dof) and chi2(1). The functions come from scipy.special,
because scipy.stats takes half a second to import.
"""

import functools
import math

import numpy as np
from scipy import special

NEWTON, TINY = 6, 1e-100
FAR, NODES = 12.0, 4096  # table of probabilities: inverse hyperbolic sine of the largest |t|, and its size


def quantile(share: float, dof: float = math.inf) -> float:
    """Return the value below which t lies with probability ``share``."""
    return float(special.ndtri(share) if math.isinf(dof) else special.stdtrit(dof, share))


def two_sided(level: float, dof: float = math.inf) -> float:
    """Return the value that |t| stays below with probability ``level``."""
    return quantile(0.5 + 0.5 * level, dof)


def share_within(values: np.ndarray, dof: float = math.inf) -> np.ndarray:
    """Return the probability that |t| stays below each value >= 0."""
    return 2.0 * (special.ndtr(values) if math.isinf(dof) else special.stdtr(dof, values)) - 1.0


@functools.cache
def _table(dof: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return values of |t|, the probability that |t| stays below them, and its slopes between them."""
    values = np.sinh(np.linspace(0.0, FAR, NODES))
    shares = share_within(values, dof)
    return values, shares, np.append(np.diff(shares) / np.diff(values), 0.0)


def fast_share_within(values: np.ndarray, dof: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the probability that |t| stays below each value >= 0, to 1e-5, and its derivative, from a table."""
    nodes, shares, slopes = _table(dof)
    at = np.minimum((np.arcsinh(values) * ((NODES - 1) / FAR)).astype(int), NODES - 1)
    slope = slopes[at]
    return shares[at] + slope * (values - nodes[at]), slope


def mixture_half_width(share: np.ndarray, variance: np.ndarray, level: float, dof: float) -> np.ndarray:
    """Return the half widths (..., q) that contain a probability ``level`` of mixtures of t with shares (..., m) and
    variances (..., m, q).

    The probability is a concave function of the half width, so Newton's method approaches it from below after one step.
    """
    root, single = np.sqrt(variance), two_sided(level, dof)
    if share.shape[-1] == 1:
        return single * root[..., 0, :]
    mean = lambda of_models: np.einsum("...m,...mq->...q", share, of_models)
    low, some = single * root.min(-2), np.maximum(root, TINY)
    found = np.maximum(single * np.sqrt(mean(variance)), TINY)
    for _ in range(NEWTON):
        below, slope = fast_share_within(found[..., None, :] / some, dof)
        found = np.maximum(found - (mean(below) - level) / np.maximum(mean(slope / some), TINY), low)
    return found
