"""What the residuals of a fit say: one rule for every kind of fit.

An interval holds the values whose best residual sum of squares (RSS) rises by no more than F s^2 above
the least, F the quantile of F(1, n - p) and s^2 = RSS/(n - p); or by chi^2 where sigma is given (D. M.
Bates, D. G. Watts, Nonlinear Regression Analysis, 1988, sec. 6.1). Residuals that are correlated beyond
chance carry less information: with the correlation r of neighbours the allowed rise is
(1 + r)/(1 - r) times as large, the variance of a mean of an AR(1) series over that of independent ones.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy import stats

NOT_DETERMINED = 0.5  # sd of a log parameter above which its value says nothing
BEYOND_CHANCE = 3.3  # standard errors 1/sqrt(n) of a correlation: one in two thousand series of white noise
ROUNDING = 1e-13  # share of the data's sum of squares below which a rise of RSS cannot be told


class Allowance(NamedTuple):
    """level of RSS that bounds the intervals; lag1: correlation of neighbouring residuals; widening: factor
    on the allowed rise."""

    level: Array
    lag1: Array
    widening: Array


class Evidence(NamedTuple):
    """fitted, residuals (n,): response and weighted residuals; rss: weighted; noise: its standard deviation;
    lag1; misfit: lag1 is beyond chance; widening of the intervals; r2 (unweighted); aic, bic; p: free
    parameters."""

    fitted: np.ndarray
    residuals: np.ndarray
    rss: float
    noise: float
    lag1: float
    misfit: bool
    widening: float
    r2: float
    aic: float
    bic: float
    p: int

    def spread(self, known: bool) -> float:
        """s of the weighted residuals that standard deviations are made with."""
        return (1.0 if known else self.noise) * self.widening


def threshold(level: float, n: int, p: int, known: bool) -> float:
    """Allowed rise of RSS: chi^2 where sigma is known, else F, to be multiplied by s^2; ValueError if too few
    points."""
    if not 0.0 < level < 1.0:
        raise ValueError(f"level: expected between 0 and 1, got {level!r}")
    if n <= p:
        raise ValueError(f"data: expected more points than the {p} free parameters, got {n}")
    return float(stats.chi2.ppf(level, 1) if known else stats.f.ppf(level, 1, n - p))


@jax.jit
def allow(residual: Array, p: Array, size: Array, rule: Array, known: Array) -> Allowance:
    """Judge weighted residuals (n,) of p parameters; size: weighted sum of squares of the data.

    rule: of ``threshold``; known: whether sigma is given.
    """
    n, rss, lag1 = residual.shape[0], residual @ residual, _lag_one(residual)
    r = jnp.minimum(lag1, 0.999)
    # residuals far below the stated sigma, or at rounding, are not a sign of anything
    real = rss > jnp.where(known, 0.5 * (n - p), 1e-20 * size)
    widening = jnp.where((lag1 > BEYOND_CHANCE / jnp.sqrt(n)) & real, (1 + r) / (1 - r), 1.0)
    rise = rule * jnp.where(known, 1.0, rss / (n - p)) * widening
    return Allowance(rss + jnp.maximum(rise, ROUNDING * size), lag1, widening)


def _lag_one(residual: Array) -> Array:
    """Correlation of neighbouring residuals, about their mean."""
    r = residual - jnp.mean(residual)
    total = jnp.sum(r * r)
    return jnp.where(total > 0, jnp.sum(r[1:] * r[:-1]) / jnp.where(total > 0, total, 1.0), 0.0)


def weigh(
    allowed: Allowance, residuals: np.ndarray, weights: np.ndarray, measured: np.ndarray, p: int, known: bool
) -> Evidence:
    """Gather; residuals: weighted, weights [1/unit of the data] and measured, all (n,)."""
    n, rss, widening = measured.size, float(residuals @ residuals), math.sqrt(float(allowed.widening))
    fitted = measured + residuals / weights
    total = float(np.sum((measured - measured.mean()) ** 2))
    r2 = 1.0 - float(np.sum((measured - fitted) ** 2)) / total if total > 0 else math.nan
    noise, lag1 = math.sqrt(rss / (n - p)), float(allowed.lag1)
    aic, bic = criteria(rss, n, p, known)
    return Evidence(fitted, residuals, rss, noise, lag1, widening > 1.0, widening, r2, aic, bic, p)


def criteria(rss: float, n: int, p: int, known: bool) -> tuple[float, float]:
    """(AIC, BIC) of Gaussian errors, up to a constant common to all models of the same data and weights.

    -2 log L = rss where sigma is known, n log(rss/n) otherwise, with one more parameter for it.
    """
    if known:
        return rss + 2 * p, rss + p * math.log(n)
    fit = n * math.log(max(rss, 1e-300) / n)
    return fit + 2 * (p + 1), fit + (p + 1) * math.log(n)


def identified(intervals: dict, table: dict, level: float) -> dict[str, bool]:
    """Fixed, or closed on both sides, off the bounds, and no wider than sd(log) = 0.5 would be."""
    z = stats.norm.ppf(0.5 + 0.5 * level)
    result = {}
    for name, (low, high) in intervals.items():
        closed = table[name][0] < low and high < table[name][1]
        fixed = table[name][0] == table[name][1]
        result[name] = bool(fixed or (closed and math.log(high / low) < 2 * z * NOT_DETERMINED))
    return result
