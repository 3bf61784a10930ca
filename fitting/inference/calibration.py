"""Calibration of the widths of intervals where the dependence of the noise on the values was estimated.

The mixture of Student's t distributions over the noise models (``noise.py``) has the stated coverage on average over
its prior, but not at every true ratio a/b: where few values are small, the intervals contain the truth too often at a =
0, and too seldom at a/b near the smallest values. So half widths are multiplied by a factor exp(g), a function of the
estimated a/b, that makes the coverage as nearly equal to the level as possible at every true a/b. This is prepivoting
(R. Beran, Biometrika 74 (1987) 457), with a level that holds over a range of the nuisance parameter rather than at its
estimate alone (G. Elliott, U. K. Mueller, M. W. Watson, Econometrica 83 (2015) 771).

For every a/b on a grid, data sets of the linearised model are simulated, and their noise and weights are estimated as
those of the fit. Given the ratios of the residuals, on which everything else depends, the generalised least-squares
estimate with the true covariance, over its standard error, has Student's t distribution; so it is integrated in closed
form, and few data sets suffice. g is piecewise linear in the logarithm of the estimated a/b. It minimises the squared
deviations of the coverage from the level, with a penalty on its size and its second differences. The random numbers are
always the same.
"""

import dataclasses
import functools
from typing import NamedTuple

import numpy as np

from fitting.inference import student
from fitting.inference.correlation import coloured, forms, whitened

MARGIN = 8.0  # factor by which the grid of a/b is shortened at both ends
NUMBERS, FEWEST, MOST = 8000, 16, 128  # random numbers for each a/b, and limits of its number of data sets
LARGEST = 2000  # number of points above which nothing is calibrated
FEW = 3  # number of noise models below which nothing is calibrated
KNOTS, TAIL = 7, 0.02  # of g, and the share of the estimated a/b below the first and above the last
ACCURACY, SIZE = (
    0.05,
    0.3,
)  # of the logarithm of a width: accuracy aimed at, and size that g and its bends may have
TURNS, REACH = 8, 0.5  # Gauss-Newton steps for g, and the longest
REWEIGHED = 3  # estimates of a/b, each with the weights of the previous one
TINY = 1e-300


@dataclasses.dataclass(frozen=True, eq=False)
class Calibration:
    """The linearised model of a fit with the noise models that were tried.

    residual (n,): weighted; Q (n, k): orthonormal columns that span the weighted Jacobian; shapes (m, n): standard
    deviations of the weighted noise up to a factor; floors, count (m,): their a/b, and the number of noise models that
    each represents; rho: correlation of neighbours in blocks (n,); p: number of parameters.
    """

    residual: np.ndarray
    Q: np.ndarray
    shapes: np.ndarray
    floors: np.ndarray
    count: np.ndarray
    rho: float
    blocks: np.ndarray
    p: int

    @classmethod
    def of(
        cls, residual: np.ndarray, Q: np.ndarray, shapes: np.ndarray, floors: np.ndarray, rho: float,
        blocks: np.ndarray, p: int,
    ) -> "Calibration | None":  # fmt: skip
        """Return the calibration of a fit, None where the noise has hardly more than one model, or the points are many.

        The outermost noise models are the same but for their scale, and the last one that is kept represents them.
        """
        inner = np.flatnonzero((floors >= MARGIN * floors[0]) & (floors <= floors[-1] / MARGIN))
        if inner.size < FEW or len(Q) > LARGEST or not Q.size:
            return None
        count = np.ones(inner.size)
        count[0] += inner[0]
        count[-1] += floors.size - 1 - inner[-1]
        return cls(residual, Q, shapes[inner], floors[inner], count, rho, blocks, p)

    def factors(self, directions: np.ndarray, level: float) -> np.ndarray:
        """Return the factors (q,) on the half widths of intervals, at a level, of linear functions of the coordinates.

        directions (k, q): the functions have the errors directions^T Q^T e, e (n,) the weighted noise.
        """
        models, drawn, (n, k) = self._models, self._drawn, self.Q.shape
        variance = drawn.scale[..., None] * models.variances(directions)[drawn.at]
        half = student.mixture_half_width(drawn.share, variance, level, float(n - self.p), student.tabulated)
        true = np.arange(len(self.floors))
        error = models.errors(directions)[:, None] * np.sqrt(drawn.rss[true, :, true] / (n - k))[..., None]
        least = np.take_along_axis(drawn.least, drawn.at[..., None, None], -2)[..., 0, :]
        half, off = half / error, (least - drawn.best[true, :, true]) @ directions / error
        hats, own = self._hats
        rows = zip(np.moveaxis(half, -1, 0), np.moveaxis(off, -1, 0), strict=True)
        return np.exp([own @ _flattest(*row, hats, level, float(n - k)) for row in rows])

    @functools.cached_property
    def _models(self) -> "_Models":
        return _Models.of(self.Q, self.shapes, self.rho, self.blocks)

    @functools.cached_property
    def _drawn(self) -> "_Estimates":
        """Estimates from the simulated data sets (m, s), s for each true a/b."""
        n, m = len(self.Q), len(self.floors)
        sets = min(max(NUMBERS // n, FEWEST), MOST)
        white = np.random.default_rng(0).standard_normal((m, sets, n))
        return self._estimates(self.shapes[:, None, :] * coloured(white, self.rho, self.blocks))

    @functools.cached_property
    def _hats(self) -> tuple[np.ndarray, np.ndarray]:
        """Hat functions of the estimated a/b, for the simulated data sets (m, s, K) and for the data (K,)."""
        drawn = self._drawn.floor
        low, high = np.quantile(drawn, (TAIL, 1.0 - TAIL)).tolist()
        knots = np.linspace(low, high, KNOTS)
        hats = lambda x: np.stack([np.interp(x, knots, one) for one in np.eye(KNOTS)], -1)
        return hats(drawn), hats(self._estimates(self.residual).floor)

    def _estimates(self, e: np.ndarray) -> "_Estimates":
        """Return the estimates from weighted noise e (..., n), as a fit finds them (``noise.py``)."""
        models, n, k = self._models, *self.Q.shape
        rows = zip(self.shapes, models.plain, models.whitened, strict=True)
        fits = [_both_fits(e / shape, plain, best, self.rho, self.blocks) for shape, plain, best in rows]
        squares, tails, least, rss, best = (
            np.moveaxis(np.stack(x), 0, e.ndim - 1) for x in zip(*fits, strict=True)
        )
        likelihood = -0.5 * (models.log_determinant + (n - k) * np.log(np.maximum(rss, TINY)))
        floor, at = np.zeros(e.shape[:-1]), np.full(e.shape[:-1], len(self.floors) // 2)
        for _ in range(REWEIGHED):
            own = np.take_along_axis(squares, at[..., None], -1)
            scale = own * (n - k) / (n - self.p) / models.expected[at]
            tempered = likelihood / np.take_along_axis(tails, at[..., None], -1)
            share = np.exp(tempered - tempered.max(-1, keepdims=True)) * self.count
            share /= share.sum(-1, keepdims=True)
            floor = 0.5 * np.log(
                (share * scale) @ self.floors**2 / np.maximum(np.sum(share * scale, -1), TINY)
            )
            at = np.argmin(np.abs(np.log(self.floors) - floor[..., None]), -1)
        return _Estimates(share, scale, at, floor, rss, least, best)


class _Estimates(NamedTuple):
    """Estimates from data sets (...).

    share (..., m): probability of each noise model, and scale (..., m), its variance; at (...): index of the weights;
    floor (...): logarithm of a/b; rss (..., m): by generalised least squares with each noise model; least, best (..., m,
    k): coefficients of Q by least squares with each of the weights, and by generalised least squares.
    """

    share: np.ndarray
    scale: np.ndarray
    at: np.ndarray
    floor: np.ndarray
    rss: np.ndarray
    least: np.ndarray
    best: np.ndarray


class _Models(NamedTuple):
    """Linear algebra of the noise models.

    plain, whitened: QR factors, (n, k) and (k, k), of Q with the weights of each model, and whitened; log_determinant
    (m,): of the covariances, before and after the fit; spread (m, m, k, k): covariance of the coefficients of Q with the
    weights of one model and the noise of another, and expected (m, m): RSS of this noise.
    """

    plain: list[tuple[np.ndarray, np.ndarray]]
    whitened: list[tuple[np.ndarray, np.ndarray]]
    log_determinant: np.ndarray
    spread: np.ndarray
    expected: np.ndarray

    @classmethod
    def of(cls, Q: np.ndarray, shapes: np.ndarray, rho: float, blocks: np.ndarray) -> "_Models":
        """Return those of standard deviations ``shapes`` (m, n) up to a factor."""
        plain = [np.linalg.qr(Q / shape[:, None]) for shape in shapes]
        best = [np.linalg.qr(whitened((Q / shape[:, None]).T, rho, blocks).T) for shape in shapes]
        log = [
            2.0 * (np.sum(np.log(s)) + np.sum(np.log(np.abs(np.diag(R)))))
            for s, (_, R) in zip(shapes, best, strict=True)
        ]
        ratio = shapes[None] / shapes[:, None]
        inner = forms(np.stack([U for U, _ in plain])[:, None] * ratio[..., None], rho, blocks)
        expected = np.sum(ratio**2, -1) - np.trace(inner, axis1=-2, axis2=-1)
        back = np.stack([np.linalg.inv(R) for _, R in plain])[:, None]
        return cls(plain, best, np.array(log), back @ inner @ np.swapaxes(back, -1, -2), expected)

    def variances(self, directions: np.ndarray) -> np.ndarray:
        """Return the variances (m, m, q) of functions with directions (k, q), by weights and by noise."""
        return np.einsum("kq,ijkl,lq->ijq", directions, self.spread, directions, optimize=True)

    def errors(self, directions: np.ndarray) -> np.ndarray:
        """Return the standard errors (m, q) of functions with directions (k, q) by generalised least squares."""
        return np.stack([np.linalg.norm(np.linalg.solve(R.T, directions), axis=0) for _, R in self.whitened])


def _both_fits(
    y: np.ndarray,
    plain: tuple[np.ndarray, np.ndarray],
    best: tuple[np.ndarray, np.ndarray],
    rho: float,
    blocks: np.ndarray,
) -> tuple[np.ndarray, ...]:
    """Return RSS, ``excess`` and coefficients (..., k) of the fit to y (..., n), and RSS and coefficients of that to the
    whitened y."""
    (U, R), (V, S) = plain, best
    c = y @ U
    residual, white = y - c @ U.T, whitened(y, rho, blocks)
    d = white @ V
    rss = np.sum(white**2, -1) - np.sum(d**2, -1)
    return np.sum(residual**2, -1), excess(residual), c @ np.linalg.inv(R).T, rss, d @ np.linalg.inv(S).T


def excess(residual: np.ndarray) -> np.ndarray:
    """Return 1 + kappa/2, kappa the excess kurtosis of residuals (..., n), at least 1.

    This is the variance of the score of a scale relative to that of Gaussian noise, by which heavy tails weaken a
    likelihood of scales.
    """
    square = (residual - residual.mean(-1, keepdims=True)) ** 2
    return np.maximum(0.5 * np.mean(square**2, -1) / np.maximum(np.mean(square, -1) ** 2, TINY) - 0.5, 1.0)


def _flattest(half: np.ndarray, off: np.ndarray, hats: np.ndarray, level: float, dof: float) -> np.ndarray:
    """Return g (K,) at the knots for the coverage nearest to the level at every true a/b.

    half, off (m, s): half widths, and distances of the estimates from the generalised least-squares ones, over the
    standard errors of the latter, which have dof degrees of freedom; hats (m, s, K).
    """
    z, size = student.two_sided(level, dof), hats.shape[-1]
    unit = ACCURACY * z * float(student.tabulated(np.array(z), dof)[1])
    g, penalty = np.zeros(size), np.concatenate([np.eye(size), np.diff(np.eye(size), 2, axis=0)]) / SIZE
    for _ in range(TURNS):
        width = half * np.exp(hats @ g)
        low, high = width - off, width + off
        below, slope_low = student.tabulated(np.abs(low), dof)
        above, slope_high = student.tabulated(np.abs(high), dof)
        covered = 0.5 * np.mean(np.sign(low) * below + np.sign(high) * above, 1)
        slope = np.einsum("ms,msk->mk", 0.5 * width * (slope_low + slope_high), hats) / half.shape[1]
        rise, short = (
            np.concatenate([slope / unit, penalty]),
            np.append((level - covered) / unit, -penalty @ g),
        )
        g = g + np.clip(np.linalg.lstsq(rise, short, rcond=None)[0], -REACH, REACH)
    return g
