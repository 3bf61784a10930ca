"""Tests of the goodness of fit: a fit is rejected where its residuals show that the model does not describe the data."""

import math
from typing import NamedTuple

import numpy as np

from fitting.inference import student
from fitting.inference.correlation import BEYOND_CHANCE, RHO, within
from fitting.inference.noise import Noise

CHANCE = 1e-3  # probability of an outlier in a series of Gaussian noise
MATTERS = 1.0  # standard errors by which a relevant outlier moves the fit
ISOLATED = 0.5  # largest residual of a neighbour over that of an isolated outlier
FLAT = 1e-9


class Places(NamedTuple):
    """The places of points in their data: abscissa t (n,) in ``unit``, blocks (n,) of neighbours, and its symbol."""

    t: np.ndarray
    blocks: np.ndarray
    symbol: str
    unit: str


def reasons(
    residuals: np.ndarray, Q: np.ndarray, noise: Noise, r2: float, fitted: np.ndarray, at: Places
) -> tuple[str, ...]:
    """Return the reasons for rejecting a fit, () if there are none.

    residuals (weighted), fitted: (n,); Q (n, k): orthonormal columns that span the Jacobian, or their rows for these
    points where they are part of the data.
    """
    t, blocks, symbol, unit = at
    found = []
    constant = np.ptp(fitted) <= FLAT * np.max(np.abs(fitted))
    if r2 <= 0.0 and not (constant and noise.white):
        found.append(f"the model describes the data no better than a constant: R2 = {r2:.3g}")
    if noise.likeliest == RHO[-1]:
        found.append(f"the residuals follow a trend: correlation of neighbours beyond {RHO[-1]:.2f}")
    elif abs(noise.left) > BEYOND_CHANCE / math.sqrt(residuals.size):
        found.append(
            f"the residuals are systematic: lag-1 correlation {noise.lag1:.2f}, and {noise.left:.2f} after an"
            " AR(1) noise is subtracted"
        )
    slip = slipped(residuals, Q.shape[1], blocks)
    if slip is not None:
        found.append(
            f"the curve slips between {symbol} = {t[slip]:.4g} and {t[slip + 1]:.4g} {unit}: one jump of the residuals"
        )
    points = [i for i in outlying(residuals, Q, blocks) if _moves(residuals, Q, i) > MATTERS]
    if points:
        times = ", ".join(f"{t[i]:.4g}" for i in points[:3])
        found.append(
            f"outliers affect the fit: {len(points)} of {t.size} points, at {symbol} = {times} {unit}: leave them out, or"
            " give their uncertainty by sigma"
        )
    return tuple(found)


def outlying(residuals: np.ndarray, Q: np.ndarray, blocks: np.ndarray | None = None) -> list[int]:
    """Return the isolated points whose externally studentised residual is significant after Bonferroni correction.

    Q (n, k): as of ``reasons``; blocks (n,) of neighbours, None for a single block.
    """
    n = residuals.size
    left = 1.0 - np.minimum(np.sum(Q * Q, 1), 1.0 - 1e-12)
    dof = n - Q.shape[1] - 1
    if dof < 1:
        return []
    others = np.maximum(residuals @ residuals - residuals**2 / left, 1e-300) / dof
    score = np.abs(residuals) / np.sqrt(others * left)
    far = np.flatnonzero(score > student.two_sided(1.0 - CHANCE / n, dof))
    return [int(i) for i in far if isolated(residuals, i, blocks)]


def slipped(residuals: np.ndarray, k: int, blocks: np.ndarray | None = None) -> int | None:
    """Return the point before a single significant jump of the residuals of k parameters; None if there is none.

    Differences of neighbours are small where a model is only slightly wrong, or the noise correlated; a slip of the
    instrument makes a single large one (a spike makes two, the steps of a digital display many). The jump is
    studentised by the other differences, with Bonferroni correction. blocks (n,): only points of one block are
    neighbours; None for a single block.
    """
    same = within(_one(residuals) if blocks is None else blocks)
    jumps = np.where(same, np.diff(residuals), 0.0)
    count = int(same.sum())
    dof = count - k - 1
    if dof < 1:
        return None
    i = int(np.argmax(np.abs(jumps)))
    rest = np.delete(jumps, i)
    far = student.two_sided(1.0 - CHANCE / count, dof) * math.sqrt(rest @ rest / dof)
    single = np.max(np.abs(rest)) <= ISOLATED * abs(jumps[i])
    between = 0 < i < jumps.size - 1 and same[i - 1] and same[i + 1]
    return i if between and single and abs(jumps[i]) > far else None


def isolated(residuals: np.ndarray, i: int, blocks: np.ndarray | None = None) -> bool:
    """Return whether at most one neighbour of the same block deviates to the same side by half as much."""
    blocks = _one(residuals) if blocks is None else blocks
    beside = [j for j in (i - 1, i + 1) if 0 <= j < residuals.size and blocks[j] == blocks[i]]
    near = residuals[beside] * np.sign(residuals[i])
    return bool(np.sum(near > ISOLATED * abs(residuals[i])) <= (near.size > 1))


def _one(residuals: np.ndarray) -> np.ndarray:
    """Return the labels (n,) of a single block."""
    return np.zeros(residuals.size, dtype=int)


def _moves(residuals: np.ndarray, Q: np.ndarray, i: int) -> float:
    """Return the number of standard errors by which the fitted value changes when the point is left out."""
    own = min(float(Q[i] @ Q[i]), 1.0 - 1e-12)
    others = (residuals @ residuals - residuals[i] ** 2 / (1.0 - own)) / max(
        residuals.size - Q.shape[1] - 1, 1
    )
    return float(abs(residuals[i]) * math.sqrt(own) / ((1.0 - own) * math.sqrt(max(others, 1e-300))))
