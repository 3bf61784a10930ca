"""Covariance, condition number and weakest direction from a Jacobian, by SVD.

The rows of a Jacobian J are such that (J^T J)^-1 is the covariance of the parameters (``Noise.whitened``). A
direction whose singular value drowns in rounding gives sd = inf for the parameters it moves; it is
never dropped as a pseudo-inverse would, which reports what is least known as best known.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

ALIKE = 0.9999  # correlation of two estimates from which the data know only a combination of them
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


def _directions(J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Singular values (k,) and right singular vectors (k, k) of J (n, k), also where it has fewer rows than columns."""
    missing = max(J.shape[1] - J.shape[0], 0)
    _, s, V = np.linalg.svd(np.pad(J, ((0, missing), (0, 0))), full_matrices=False)
    return s, V


def log_covariance(J: np.ndarray, inside: np.ndarray) -> LogCovariance:
    """From the Jacobian J (n, m) with respect to log compliances and the mask ``inside`` (m,)."""
    index = np.flatnonzero(inside)
    if index.size == 0:
        return LogCovariance((), np.zeros(0), math.nan, np.zeros(0), math.nan)
    s, V = _directions(J[:, index])
    lost = s <= ROUNDING * s[0]
    inverse = np.where(lost, np.inf, 1.0 / np.where(lost, 1.0, s))
    # a component at rounding level does not take part in a lost direction
    share = np.where(np.abs(V) < 1e-6, 0.0, np.abs(V)) if lost.any() else np.abs(V)
    terms = np.where(share > 0, share, 0.0) * np.where(share > 0, inverse[:, None], 0.0)
    sd = np.sqrt(np.sum(terms**2, 0))
    condition = math.inf if lost.any() else float((s[0] / s[-1]) ** 2)
    weakest = V[-1] * np.sign(V[-1][np.argmax(np.abs(V[-1]))])
    return LogCovariance(tuple(index), sd, condition, weakest, float(inverse[-1]))


def linear_sd(J: np.ndarray, gradients: np.ndarray, free: np.ndarray) -> np.ndarray:
    """sd of functions of the compliances with ``gradients`` (k, m), (k,): delta method with f = 0 allowed.

    ``free`` (m,) marks the compliances that were fitted, at their open end too. Directions lost to
    rounding give inf where a function depends on them.
    """
    index = np.flatnonzero(free)
    size = np.linalg.norm(J[:, index], axis=0)
    index, size = index[size > 0], size[size > 0]
    s, V = _directions(J[:, index] / size)
    along = (gradients[:, index] / size) @ V.T
    lost = s <= ROUNDING * s[0]
    sd = np.sqrt(np.sum((along[:, ~lost] / s[~lost]) ** 2, -1))
    reach = np.abs(along[:, lost]).max(-1, initial=0.0)
    return np.where(reach > 1e-6 * np.linalg.norm(along, axis=-1), np.inf, sd)


def covariance(J: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Of the coordinates (m, m), from their Jacobian J (n, m); zero for those not ``free`` (m,) bool or without effect."""
    whole, places = np.zeros((free.size, free.size)), np.flatnonzero(free & np.any(J != 0.0, axis=0))
    whole[np.ix_(places, places)] = inverse(J[:, places])
    return whole


def inverse(jacobian: np.ndarray) -> np.ndarray:
    """(J^T J)^-1 with its lost directions cut at 1e-9 of the largest singular value."""
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    s, V = _directions(jacobian / size)
    root = V.T / np.maximum(s, ROUNDING * s[0]) / size[:, None]
    return root @ root.T


def inseparable(J: np.ndarray, names: Sequence[str], identified: Mapping[str, bool]) -> tuple[str, ...]:
    """Notes on parameters that are not identified because the data depend on a combination of them and others alone.

    J (n, k): the Jacobian of coordinates with ``names`` (k,), "" for those without one; identified: of the parameters.
    """
    places = [i for i in range(len(names)) if names[i] and np.any(J[:, i] != 0.0)]
    spread = inverse(J[:, places])
    size = np.sqrt(np.maximum(np.diag(spread), 1e-300))
    alike = np.abs(spread / np.outer(size, size)) > ALIKE
    groups = {tuple(names[places[j]] for j in np.flatnonzero(row)) for row in alike}
    lost = sorted(g for g in groups if len(g) > 1 and not all(identified.get(name, False) for name in g))
    return tuple(
        f"{', '.join(group[:-1])} and {group[-1]} are not determined separately: their effects on the data are nearly"
        " proportional; hold one of them at a known value"
        for group in lost
    )
