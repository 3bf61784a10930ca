"""The end of every fit: what its residuals say of the noise, of the intervals and of the model.

An interval holds the values whose best residual sum of squares (RSS) rises by no more than a level above the least.
For white noise of known weights that is F s^2, F the quantile of F(1, n - p) and s^2 = RSS/(n - p), or chi^2 where
sigma is given (D. M. Bates, D. G. Watts, Nonlinear Regression Analysis, 1988, sec. 6.1). Where the noise may be
correlated, or its dependence on the values was estimated, each coordinate has a level of its own (``noise.py``).
``verdict.py`` refuses a wrong model.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from fitting.inference import noise, student
from fitting.inference.correlation import BEYOND_CHANCE
from fitting.inference.noise import Noise
from fitting.inference.verdict import reasons

NOT_DETERMINED = 0.5  # sd of a log parameter above which its value says nothing
ROUNDING = 1e-13  # share of the data's sum of squares below which a rise of RSS cannot be told
NEGLIGIBLE = 1e-8  # the same, below which a misfit is no reason to refuse
EXACT = 1e-20  # share of the data's sum of squares below which residuals are rounding
FLAT = 1e-9  # range of the data over their size below which R2 is not defined
TURNS, SAME = 4, 0.05  # of estimating the weights, and the relative change of them that is none


class Sample(NamedTuple):
    """The data of a fit: t (n,) [s], or another abscissa in its unit; measured (n,); weights (n,) [1/unit of measured]
    and their label; blocks (n,): integers, equal for points that are neighbours in one series."""

    t: np.ndarray
    measured: np.ndarray
    weights: np.ndarray
    label: str
    blocks: np.ndarray

    @classmethod
    def of(
        cls,
        t: np.ndarray,
        measured: np.ndarray,
        weights: np.ndarray,
        label: str,
        blocks: np.ndarray | None = None,
    ) -> "Sample":
        """One series unless blocks are given."""
        return cls(t, measured, weights, label, np.zeros(t.size, dtype=int) if blocks is None else blocks)

    @property
    def known(self) -> bool:
        """Whether the weights are the reciprocals of known standard deviations."""
        return self.label == "sigma"

    @property
    def size(self) -> float:
        """Weighted sum of squares of the data."""
        return float(np.sum((self.weights * self.measured) ** 2))

    def some(self, kept: np.ndarray) -> "Sample":
        """The points kept (n,) bool."""
        return self._replace(
            **{name: getattr(self, name)[kept] for name in ("t", "measured", "weights", "blocks")}
        )

    def noise(self, residual: np.ndarray, jacobian: np.ndarray, inside: np.ndarray, p: int) -> Noise:
        """The noise of weighted residuals (n,), from the Jacobian (n, k) of the free coordinates, of which some are
        ``inside`` (k,) their bounds; p: parameters."""
        fitted, shapes, floors = (
            self.measured + residual / self.weights,
            np.ones((1, self.t.size)),
            np.zeros(1),
        )
        if self.label == "estimated":
            floors = noise.floors_for(fitted)
            shapes = np.hypot(floors[:, None], fitted) * self.weights
        slopes, real = self.smooth(residual, jacobian), self.real(residual, p)
        return noise.judge(residual, slopes, inside, self.blocks, shapes, floors, p, self.known, real)

    def reweighed(self, found: "Solved", p: int) -> np.ndarray:
        """Estimated weights (n,) from a solution with the sample's weights."""
        on = found.kept
        some, residual, fitted = (
            self.some(on),
            found.residual[on],
            self.measured + found.residual / self.weights,
        )
        if not some.real(residual, p):
            return self.weights
        return 1.0 / np.hypot(some.noise(residual, found.jacobian[on], found.inside, p).floor, fitted)

    def smooth(self, residual: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
        """A Jacobian (n, k) as with the relative weights of fitted values: those of noisy data put noise into it."""
        if self.label != "relative":
            return jacobian
        return jacobian * (self.measured / (self.measured + residual / self.weights))[:, None]

    def real(self, residual: np.ndarray, p: int) -> bool:
        """Whether weighted residuals are more than rounding, or more than what the stated sigma accounts for: else they
        are no sign of anything."""
        rss = float(residual @ residual)
        return rss > (0.5 * (residual.size - p) if self.known else EXACT * self.size)


class Evidence(NamedTuple):
    """fitted, residuals (n,): response and weighted residuals; rss: weighted; noise: its standard deviation;
    lag1; misfit: lag1 is beyond chance; widening of the intervals; refused: why the fit does not stand, () if
    it does; r2 (unweighted), nan for constant data; aic, bic; p: free parameters."""

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


class Judged(NamedTuple):
    """evidence; slopes (m, k): the Jacobian of the free coordinates whose normal matrix is the inverse of their
    covariance; levels(gradients) (q,): of RSS that bound the intervals of functions of the free coordinates with
    gradients (k, q), of the coordinates themselves without."""

    evidence: Evidence
    slopes: np.ndarray
    levels: Callable[..., np.ndarray]


class Solved(NamedTuple):
    """A least squares solution: weighted residual (n,), jacobian (n, k) of the free coordinates, of which some are
    ``inside`` (k,) their bounds; kept (n,) bool: the points that count; weights (n,); whole: what the search returned."""

    residual: np.ndarray
    jacobian: np.ndarray
    inside: np.ndarray
    kept: np.ndarray
    weights: np.ndarray
    whole: Any


def check(level: float, n: int, p: int) -> None:
    """ValueError unless intervals at this level can be found from n points with p parameters."""
    if not 0.0 < level < 1.0:
        raise ValueError(f"level: expected between 0 and 1, got {level!r}")
    if n <= p:
        raise ValueError(f"data: expected more points than the {p} free parameters, got {n}")


def judge(
    sample: Sample, residual: np.ndarray, jacobian: np.ndarray, inside: np.ndarray, p: int, level: float
) -> Judged:
    """Judge weighted residuals (n,) of p parameters; jacobian (n, k): of the free coordinates, of which some are
    ``inside`` (k,) their bounds; level: of the intervals."""
    return judged(sample, residual, jacobian, inside, sample.noise(residual, jacobian, inside, p), p, level)


def judged(
    sample: Sample,
    residual: np.ndarray,
    jacobian: np.ndarray,
    inside: np.ndarray,
    found: Noise,
    p: int,
    level: float,
) -> Judged:
    """As ``judge``, with the noise that was found."""
    rss, least = float(residual @ residual), ROUNDING * sample.size

    def levels(gradients: np.ndarray | None = None) -> np.ndarray:
        some = np.eye(jacobian.shape[1]) if gradients is None else gradients
        return rss + np.maximum(found.rises(some, level), least)

    quality = _weigh(sample, residual, sample.smooth(residual, jacobian[:, inside]), found, p, level)
    spread = (1.0 if sample.known else quality.noise) * quality.widening
    return Judged(quality, found.whitened(jacobian, spread), levels)


def settled(sample: Sample, first: Solved, solve: Callable[[np.ndarray], Solved], p: int) -> Solved:
    """The solution whose weights, where they are estimated, agree with its residuals, from a first one; solve takes
    weights (n,). The weights are those of the mean variance of the noise over all that is likely (``noise.py``)."""
    found = first
    for turn in range(TURNS if sample.label == "estimated" else 0):
        weights = sample._replace(weights=found.weights).reweighed(found, p)
        if turn and close(weights, found.weights):
            break
        found = solve(weights)
    return found


def close(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether weights (n,) agree so far that no further turn is needed."""
    return bool(np.max(np.abs(np.log(one / other))) <= SAME)


def _weigh(
    sample: Sample, residuals: np.ndarray, jacobian: np.ndarray, found: Noise, p: int, level: float
) -> Evidence:
    """Gather; jacobian (n, k): of the coordinates off their bounds."""
    measured, n, rss, known = sample.measured, sample.t.size, float(residuals @ residuals), sample.known
    real = sample.real(residuals, p)
    fitted = measured + residuals / sample.weights
    r2 = coefficient_of_determination(measured, fitted)
    misfit = bool(real and found.lag1 > BEYOND_CHANCE / math.sqrt(n))
    matters = real and rss > NEGLIGIBLE * sample.size
    why = reasons(residuals, jacobian, found, r2, fitted, sample.t, sample.blocks) if matters else ()
    scale = math.sqrt(rss / (n - p))
    aic, bic = criteria(rss, n, p, known)
    widening = found.widening(level, 1.0 if known else scale)
    return Evidence(fitted, residuals, rss, scale, found.lag1, misfit, widening, why, r2, aic, bic, p)


def coefficient_of_determination(measured: np.ndarray, fitted: np.ndarray) -> float:
    """R2, nan where the data are constant to rounding."""
    if np.ptp(measured) <= FLAT * np.max(np.abs(measured)):
        return math.nan
    total = float(np.sum((measured - measured.mean()) ** 2))
    return 1.0 - float(np.sum((measured - fitted) ** 2)) / total


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
