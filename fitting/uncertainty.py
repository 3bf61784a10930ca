"""What the Jacobian says: covariance by SVD, condition number, weakest direction, combinations.

The covariance is that of the log parameters, s^2 (J^T J)^-1 by the singular values of J. A
direction whose singular value drowns in rounding gives sd = inf for the parameters it moves; it is
never dropped as a pseudo-inverse would, which reports what is least known as best known.
"""

import math
from typing import NamedTuple

import numpy as np

ROUNDING = 1e-9  # singular values below this share of the largest are noise of the arithmetic


class LogCovariance(NamedTuple):
    """Of the parameters strictly inside their bounds.

    places: theirs among the compliances; sd (k,) of the log parameters; condition: ratio of the extreme
    eigenvalues of J^T J; weakest (k,): unit vector of the least known direction; weakest_sd: its
    standard deviation.
    """

    places: tuple[int, ...]
    sd: np.ndarray
    condition: float
    weakest: np.ndarray
    weakest_sd: float


def log_covariance(J: np.ndarray, inside: np.ndarray, spread: float) -> LogCovariance:
    """From the Jacobian J (n, m) with respect to log compliances and the mask ``inside`` (m,).

    ``spread`` is s of the residuals.
    """
    index = np.flatnonzero(inside)
    if index.size == 0:
        return LogCovariance((), np.zeros(0), math.nan, np.zeros(0), math.nan)
    _, s, V = np.linalg.svd(J[:, index], full_matrices=False)
    lost = s <= ROUNDING * s[0]
    inverse = np.where(lost, np.inf, 1.0 / np.where(lost, 1.0, s))
    # a component at rounding level does not take part in a lost direction
    share = np.where(np.abs(V) < 1e-6, 0.0, np.abs(V)) if lost.any() else np.abs(V)
    terms = np.where(share > 0, share, 0.0) * np.where(share > 0, inverse[:, None], 0.0)
    sd = spread * np.sqrt(np.sum(terms**2, 0))
    condition = math.inf if lost.any() else float((s[0] / s[-1]) ** 2)
    weakest = V[-1] * np.sign(V[-1][np.argmax(np.abs(V[-1]))])
    return LogCovariance(tuple(index), sd, condition, weakest, spread * float(inverse[-1]))


def linear_sd(J: np.ndarray, gradients: np.ndarray, free: np.ndarray, spread: float) -> np.ndarray:
    """sd of functions of the compliances with ``gradients`` (k, m), (k,): delta method with f = 0 allowed.

    ``free`` (m,) marks the compliances that were fitted, at their open end too. Directions lost to
    rounding give inf where a function depends on them.
    """
    index = np.flatnonzero(free)
    size = np.linalg.norm(J[:, index], axis=0)
    index, size = index[size > 0], size[size > 0]
    _, s, V = np.linalg.svd(J[:, index] / size, full_matrices=False)
    along = (gradients[:, index] / size) @ V.T
    lost = s <= ROUNDING * s[0]
    sd = spread * np.sqrt(np.sum((along[:, ~lost] / s[~lost]) ** 2, -1))
    reach = np.abs(along[:, lost]).max(-1, initial=0.0)
    return np.where(reach > 1e-6 * np.linalg.norm(along, axis=-1), np.inf, sd)


def covariance(J: np.ndarray, free: np.ndarray, spread: float) -> np.ndarray:
    """Of the coordinates (m, m), from their Jacobian J (n, m); zero for those not ``free`` (m,) bool or without effect."""
    whole, places = np.zeros((free.size, free.size)), np.flatnonzero(free & np.any(J != 0.0, axis=0))
    whole[np.ix_(places, places)] = inverse(J[:, places]) * spread**2
    return whole


def inverse(jacobian: np.ndarray) -> np.ndarray:
    """(J^T J)^-1 with its lost directions cut at 1e-9 of the largest singular value."""
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    _, s, V = np.linalg.svd(jacobian / size, full_matrices=False)
    root = V.T / np.maximum(s, ROUNDING * s[0]) / size[:, None]
    return root @ root.T
