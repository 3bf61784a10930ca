"""Quantiles of Student's t distribution, and of the normal distribution for infinite degrees of freedom.

The squares of these variables have the distributions F(1, dof) and chi2(1). The functions come from scipy.special,
because scipy.stats takes half a second to import.
"""

import functools
import math
from collections.abc import Callable

import numpy as np
from scipy import special

NEWTON, CLOSE, TINY = 30, 1e-5, 1e-100
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


def share_and_slope(values: np.ndarray, dof: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the probability that |t| stays below each value >= 0, and its derivative."""
    if math.isinf(dof):
        density = np.exp(-0.5 * values**2) / math.sqrt(2.0 * math.pi)
    else:
        front = special.gammaln(0.5 * dof + 0.5) - special.gammaln(0.5 * dof) - 0.5 * math.log(math.pi * dof)
        density = np.exp(front - 0.5 * (dof + 1.0) * np.log1p(values**2 / dof))
    return share_within(values, dof), 2.0 * density


@functools.cache
def _table(dof: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return values of |t|, the probability that |t| stays below them, and its slopes between them."""
    values = np.sinh(np.linspace(0.0, FAR, NODES))
    shares = share_within(values, dof)
    return values, shares, np.append(np.diff(shares) / np.diff(values), 0.0)


def tabulated(values: np.ndarray, dof: float) -> tuple[np.ndarray, np.ndarray]:
    """Return ``share_and_slope`` to 1e-5, in a tenth of the time, from a table."""
    nodes, shares, slopes = _table(dof)
    at = np.minimum((np.arcsinh(values) * ((NODES - 1) / FAR)).astype(int), NODES - 1)
    slope = slopes[at]
    return shares[at] + slope * (values - nodes[at]), slope


def mixture_half_width(
    share: np.ndarray, variance: np.ndarray, level: float, dof: float, law: Callable = share_and_slope
) -> np.ndarray:
    """Return the half widths (..., q) that contain a probability ``level`` of mixtures of t with shares (..., m) and
    variances (..., m, q).

    law: ``share_and_slope`` or ``tabulated``. The probability is a concave function of the half width, so Newton's
    method approaches the solution from below after its first step.
    """
    root, single = np.sqrt(variance), two_sided(level, dof)
    if share.shape[-1] == 1:
        return single * root[..., 0, :]
    mean = lambda of_models: np.einsum("...m,...mq->...q", share, of_models)
    low, some = single * root.min(-2), np.maximum(root, TINY)
    found = np.maximum(single * np.sqrt(mean(variance)), TINY)
    for _ in range(NEWTON):
        below, slope = law(found[..., None, :] / some, dof)
        change = (mean(below) - level) / np.maximum(mean(slope / some), TINY)
        found = np.maximum(found - change, low)
        if np.all(np.abs(change) <= CLOSE * found):
            break
    return found
