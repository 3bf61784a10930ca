"""Student's t, the law of an error whose size is estimated; the normal law where it is known (dof infinite).

Squares of them are the laws F(1, dof) and chi2(1). From scipy.special: scipy.stats takes half a second to import.
"""

import math

import numpy as np
from scipy import special


def quantile(share: float, dof: float = math.inf) -> float:
    """The value below which that share of t lies."""
    return float(special.ndtri(share) if math.isinf(dof) else special.stdtrit(dof, share))


def two_sided(level: float, dof: float = math.inf) -> float:
    """The value that |t| stays below with probability ``level``."""
    return quantile(0.5 + 0.5 * level, dof)


def share_within(values: np.ndarray, dof: float = math.inf) -> np.ndarray:
    """The probability that |t| stays below each value >= 0."""
    return 2.0 * (special.ndtr(values) if math.isinf(dof) else special.stdtr(dof, values)) - 1.0
