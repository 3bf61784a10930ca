"""What the residuals of a fit say: one rule for every kind of fit.

An interval holds the values whose best residual sum of squares (RSS) rises by no more than F s^2 above
the least, F the quantile of F(1, n - p) and s^2 = RSS/(n - p); or by chi^2 where sigma is given (D. M.
Bates, D. G. Watts, Nonlinear Regression Analysis, 1988, sec. 6.1). Correlated residuals carry less
information, and a wrong model none: ``correlation.py`` widens, ``verdict.py`` refuses.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from fitting import correlation, student
from fitting.correlation import BEYOND_CHANCE, Noise
from fitting.verdict import reasons

NOT_DETERMINED = 0.5  # sd of a log parameter above which its value says nothing
ROUNDING = 1e-13  # share of the data's sum of squares below which a rise of RSS cannot be told
NEGLIGIBLE = 1e-8  # the same, below which a misfit is no reason to refuse
EXACT = 1e-20  # share of the data's sum of squares below which residuals are rounding


class Allowance(NamedTuple):
    """level: of RSS that bounds the intervals; noise: what the residuals are; widening: factor on the allowed
    rise; real: the residuals are more than rounding, or more than the stated sigma accounts for."""

    level: float
    noise: Noise
    widening: float
    real: bool


class Evidence(NamedTuple):
    """fitted, residuals (n,): response and weighted residuals; rss: weighted; noise: its standard deviation;
    lag1; misfit: lag1 is beyond chance; widening of the intervals; refused: why the fit does not stand, () if
    it does; r2 (unweighted); aic, bic; p: free parameters."""

    fitted: np.ndarray
    residuals: np.ndarray
    rss: float
    noise: float
    lag1: float
    misfit: bool
    widening: float
    refused: tuple[str, ...]
    r2: float
    aic: float
    bic: float
    p: int

    def spread(self, known: bool) -> float:
        """s of the weighted residuals that standard deviations are made with."""
        return (1.0 if known else self.noise) * self.widening


def check(level: float, n: int, p: int) -> None:
    """ValueError unless intervals at this level can be found from n points with p parameters."""
    if not 0.0 < level < 1.0:
        raise ValueError(f"level: expected between 0 and 1, got {level!r}")
    if n <= p:
        raise ValueError(f"data: expected more points than the {p} free parameters, got {n}")


def allow(
    residual: np.ndarray, jacobian: np.ndarray, p: int, size: float, level: float, known: bool
) -> Allowance:
    """Judge weighted residuals (n,) of p parameters, in the order of time.

    jacobian (n, k): of the parameters off their bounds; size: weighted sum of squares of the data; level: of
    the intervals; known: whether sigma is given.
    """
    n, rss = residual.size, float(residual @ residual)
    # residuals far below the stated sigma, or at rounding, are not a sign of anything
    real = rss > (0.5 * (n - p) if known else EXACT * size)
    noise = correlation.judge(residual, correlation.basis(jacobian), p)
    widening = correlation.widening(noise, level, np.inf if known else n - p) if real else 1.0
    rule = student.two_sided(level, math.inf if known else n - p) ** 2
    rise = rule * (1.0 if known else rss / (n - p)) * widening
    return Allowance(rss + max(rise, ROUNDING * size), noise, widening, real)


def weigh(
    allowed: Allowance, residuals: np.ndarray, weights: np.ndarray, measured: np.ndarray, p: int, known: bool,
    jacobian: np.ndarray, t: np.ndarray,
) -> Evidence:  # fmt: skip
    """Gather; residuals: weighted, weights [1/unit of the data], measured and t [s], all (n,); jacobian as in
    ``allow``."""
    n, rss, lag1 = measured.size, float(residuals @ residuals), allowed.noise.lag1
    fitted = measured + residuals / weights
    total = float(np.sum((measured - measured.mean()) ** 2))
    r2 = 1.0 - float(np.sum((measured - fitted) ** 2)) / total if total > 0 else math.nan
    misfit = bool(allowed.real and lag1 > BEYOND_CHANCE / math.sqrt(n))
    matters = allowed.real and rss > NEGLIGIBLE * float(np.sum((weights * measured) ** 2))
    why = reasons(residuals, jacobian, allowed.noise, r2, fitted, t) if matters else ()
    aic, bic = criteria(rss, n, p, known)
    return Evidence(
        fitted, residuals, rss, math.sqrt(rss / (n - p)), lag1, misfit, math.sqrt(allowed.widening), why, r2,
        aic, bic, p,
    )  # fmt: skip


def criteria(rss: float, n: int, p: int, known: bool) -> tuple[float, float]:
    """(AIC, BIC) of Gaussian errors, up to a constant common to all models of the same data and weights.

    -2 log L = rss where sigma is known, n log(rss/n) otherwise, with one more parameter for it.
    """
    if known:
        return rss + 2 * p, rss + p * math.log(n)
    fit = n * math.log(max(rss, 1e-300) / n)
    return fit + 2 * (p + 1), fit + (p + 1) * math.log(n)


def identified(intervals: dict, table: dict, level: float, refused: Any = ()) -> dict[str, bool]:
    """Fixed, or closed on both sides, off the bounds, and no wider than sd(log) = 0.5 would be, by a fit
    that is not refused."""
    z = student.two_sided(level)
    result = {}
    for name, (low, high) in intervals.items():
        closed = table[name][0] < low and high < table[name][1]
        narrow = closed and math.log(high / low) < 2 * z * NOT_DETERMINED
        result[name] = bool(table[name][0] == table[name][1] or (narrow and not refused))
    return result
