"""Quantiles of Student's t distribution, and of the normal distribution for infinite degrees of freedom.

The squares of these variables have the distributions F(1, dof) and chi2(1). The functions come from scipy.special,
because scipy.stats takes half a second to import.
"""

import math

import numpy as np
from scipy import special


def quantile(share: float, dof: float = math.inf) -> float:
    """Return the value below which t lies with probability ``share``."""
    return float(special.ndtri(share) if math.isinf(dof) else special.stdtrit(dof, share))


def two_sided(level: float, dof: float = math.inf) -> float:
    """Return the value that |t| stays below with probability ``level``."""
    return quantile(0.5 + 0.5 * level, dof)


def share_within(values: np.ndarray, dof: float = math.inf) -> np.ndarray:
    """Return the probability that |t| stays below each value >= 0."""
    return 2.0 * (special.ndtr(values) if math.isinf(dof) else special.stdtr(dof, values)) - 1.0
