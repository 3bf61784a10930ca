"""Estimate of the variance and correlation of the noise of a fit's data, and the intervals that follow.

The covariance matrix of the weighted noise is s^2 D V D. V is the identity or that of an AR(1) series of correlation
rho (``correlation.py``). D is the identity for weights that the user chose; for estimated weights it holds the standard
deviations (a^2 + (b f)^2)^(1/2) of fitted values f, times the weights, on a grid of a/b. rho and a/b are estimated by
the restricted likelihood of the residuals (D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320), which accounts for the
variance and correlation that a fit of p parameters removes from n residuals. For estimated weights the estimates have
the covariance s^2 A D V D A^T, with A the linearised estimator, whatever the weights were; for chosen weights each
direction is given the mean of this over the directions. Intervals come from the mixture of Student's t distributions
over all rho and a/b, weighted by the likelihood and Jeffreys' prior d rho/sqrt(1 - rho^2), uniform in log(a/b), which
accounts for the uncertainty of both. Where a/b was estimated, their widths are calibrated (``calibration.py``). Where
the residuals have heavy tails, the likelihood of a/b is tempered by the variance of its score.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fitting.inference import student
from fitting.inference.calibration import Calibration, excess
from fitting.inference.correlation import RHO, basis, forms, inverse_forms, lag_one, log_determinant, within
from fitting.search.uncertainty import ROUNDING

WHITE = 0.3  # prior probability of white noise
MORE_LIKELY_THAN_NOT = 0.5
NEGLIGIBLE = 1e-5  # probability relative to the largest below which a noise model is left out of the mixture
LEAST_SPREAD = 1e-100  # spread assumed for residuals that are all zero; its inverse square is still finite
MANY = 5000  # number of points above which error models are evaluated one after the other
STEP = 0.5  # step of log(a/b)
BEYOND = 64.0  # factor by which the grid of a/b extends beyond the smallest and the largest value
LEAST = 1e-5  # lower limit of a/b over its largest value


class ErrorModels(NamedTuple):
    """The error models that are tried: their diagonals D (m, n), and the ratios a/b of their two terms (m,)."""

    shapes: np.ndarray
    floors: np.ndarray


class Noise(NamedTuple):
    """The posterior of the noise model of a fit.

    lag1: correlation of neighbouring residuals about their mean; likeliest: the most likely rho; left: lag-1
    correlation that remains after an AR(1) series of that rho; white: whether the noise is more likely white than not.
    share (m,): probability of each noise model in the mixture; variance (m, k, k): its covariance in the space of the
    Jacobian's columns, of weighted residuals; columns (k, p): the Jacobian in that space; dof: degrees of freedom of s;
    floor: a/b averaged over the mixture.
    """

    lag1: float
    likeliest: float
    left: float
    white: bool
    share: np.ndarray
    variance: np.ndarray
    columns: np.ndarray
    dof: float
    floor: float
    calibration: Calibration | None = None

    def rises(self, gradients: np.ndarray, level: float) -> np.ndarray:
        """Return the rise of RSS (q,) that bounds the intervals, at a level, of functions of the free coordinates.

        gradients (p, q): of the functions with respect to the free coordinates.
        """
        directions = np.linalg.pinv(self.columns, rcond=1e-9).T @ gradients
        size = np.linalg.norm(directions, axis=0)
        directions = directions / np.where(size > 0, size, 1.0)
        variance = np.einsum("kq,mkl,lq->mq", directions, self.variance, directions)
        mean = np.trace(self.variance, axis1=1, axis2=2) / max(len(self.columns), 1)
        variance = np.where(size > 0, variance, mean[:, None])
        half = student.mixture_half_width(self.share, variance, level, self.dof)
        if self.calibration is not None and np.any(size > 0):
            half[size > 0] *= self.calibration.factors(directions[:, size > 0], level)
        return half**2

    def widening(self, level: float, scale: float) -> float:
        """Return the mean ratio of interval widths to those for white noise.

        scale: standard deviation of the weighted residuals; the mean is over the directions.
        """
        if not self.columns.size:
            return 1.0
        mean = np.trace(self.variance, axis1=1, axis2=2)[:, None] / len(self.columns)
        half = float(student.mixture_half_width(self.share, mean, level, self.dof)[0])
        found = half / max(scale, 1e-300) / student.two_sided(level, self.dof)
        return 1.0 if abs(found - 1.0) < ROUNDING else found

    def whitened(self, jacobian: np.ndarray, spread: float) -> np.ndarray:
        """Return the Jacobian (n, p) whitened so that its normal matrix is the inverse covariance of the coordinates.

        spread: s of the weighted residuals, widened, where it is the same in all directions.
        """
        mean = np.einsum("m,mkl->kl", self.share, self.variance)
        if not mean.size or np.allclose(
            mean, mean[0, 0] * np.eye(len(mean)), rtol=1e-9, atol=1e-9 * mean[0, 0]
        ):
            return jacobian / max(spread, LEAST_SPREAD)
        values, vectors = np.linalg.eigh(mean)
        return (vectors.T @ self.columns) / np.sqrt(values)[:, None]


def noise_model(
    residual: np.ndarray, jacobian: np.ndarray, inside: np.ndarray, blocks: np.ndarray, tried: ErrorModels,
    p: int, known: bool, real: bool = True,
) -> Noise:  # fmt: skip
    """Return the noise model of weighted residuals (n,) in blocks (n,), from the Jacobian (n, k) of the free
    coordinates.

    inside (k,): coordinates that are not at a bound; p: number of parameters; known: whether the variance of the noise
    is known; real: whether the residuals exceed rounding.
    """
    shapes, floors = tried
    n, rss, Q = residual.size, float(residual @ residual), basis(jacobian)
    likelihood = np.tile(np.where(RHO > 0.0, -np.inf, 0.0), (len(shapes), 1))  # white
    if real:
        likelihood = _restricted(residual, basis(jacobian[:, inside]), blocks, shapes)
        best = likelihood.max(1, keepdims=True)
        likelihood = likelihood - best + best / (excess(residual) if len(shapes) > 1 else 1.0)
    share = np.exp(likelihood - likelihood.max()) * _prior()
    rho = float(RHO[np.argmax(likelihood.max(0))])
    white = bool(share[:, 0].sum() > MORE_LIKELY_THAN_NOT * share.sum())
    share[:, 1:] *= not white
    places = np.argwhere(share > NEGLIGIBLE * share.max())
    share = share[tuple(places.T)] / share[tuple(places.T)].sum()
    spread, square = _spread(Q, blocks, shapes, places), shapes[places[:, 0]] ** 2
    if len(shapes) == 1:  # the mean over the directions is accurate in short strongly correlated series too
        each = np.trace(spread, axis1=1, axis2=2) / max(Q.shape[1], 1)
        spread = each[:, None, None] * np.eye(Q.shape[1])
    # s^2 from E[RSS], reduced by the fit
    scale = rss * (n - Q.shape[1]) / (n - p) / (square.sum(1) - np.trace(spread, axis1=1, axis2=2))
    floor = math.sqrt(float(share * scale @ floors[places[:, 0]] ** 2 / max(float(share @ scale), 1e-300)))
    variance = spread * (1.0 if known else scale[:, None, None])
    return Noise(
        lag_one(residual, blocks), rho, _left(residual, rho, blocks), white, share, variance, Q.T @ jacobian,
        math.inf if known else float(n - p), floor,
        Calibration.of(residual, Q, shapes, floors, 0.0 if white else rho, blocks, p) if real else None,
    )  # fmt: skip


def _left(residual: np.ndarray, rho: float, blocks: np.ndarray) -> float:
    """Return the lag-1 correlation that remains after an AR(1) series of correlation rho is subtracted."""
    same = within(blocks)
    return lag_one((residual[1:] - rho * residual[:-1])[same], blocks[1:][same])


def joined(
    noises: Sequence[Noise], jacobian: np.ndarray, shares: Sequence[float], lag1: float, dof: float
) -> Noise:
    """Return the noise of several independent tests, with the Jacobian (n, k) of all of them.

    shares: factors on the variance of each test; a mixture of noise models within a test is replaced by its mean.
    """
    Q = basis(jacobian)
    columns = Q.T @ jacobian
    back = np.linalg.pinv(columns, rcond=1e-9)
    variance = np.zeros((1, Q.shape[1], Q.shape[1]))
    for one, factor in zip(noises, shares, strict=True):
        own = one.columns @ back
        variance[0] += factor * own.T @ np.einsum("m,mkl->kl", one.share, one.variance) @ own
    white = all(one.white for one in noises)
    return Noise(lag1, 0.0, 0.0, white, np.ones(1), variance, columns, dof, 0.0)


def floors_for(fitted: np.ndarray) -> np.ndarray:
    """Return the values of a/b (m,) tried for fitted values (n,), from nearly zero to nearly infinite."""
    size = np.abs(fitted)
    high = BEYOND * float(size.max())
    low = max(float(size.min()) / BEYOND, LEAST * high)
    return np.geomspace(low, high, max(math.ceil(math.log(high / low) / STEP), 2) + 1)


def _prior() -> np.ndarray:
    """Return the prior weight of every RHO (k,).

    The grid is uniform in artanh(rho), so d rho is proportional to 1 - rho^2.
    """
    prior = np.sqrt(1.0 - RHO**2)
    prior *= (1.0 - WHITE) / prior.sum()
    prior[0] += WHITE
    return prior


def _restricted(residual: np.ndarray, Q: np.ndarray, blocks: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Return the restricted log likelihood (m, k) of every shape and RHO, up to a constant."""
    n, k = Q.shape
    unit = math.sqrt(float(residual @ residual) / n) or 1.0
    columns = np.column_stack([Q, residual / unit])
    if n > MANY:  # one shape at a time, since all of them together would take gigabytes
        found = np.stack([inverse_forms(columns / shape[:, None], blocks) for shape in shapes])
    else:
        found = inverse_forms(columns / shapes[:, :, None], blocks)
    factor = np.linalg.cholesky(found + 1e-14 * np.eye(k + 1))
    diagonal = np.diagonal(factor, axis1=-2, axis2=-1)
    rss = diagonal[..., k] ** 2
    logdet = log_determinant(blocks) + 2.0 * np.sum(np.log(shapes), 1)[:, None]
    logdet = logdet + 2.0 * np.sum(np.log(diagonal[..., :k]), -1)
    return -0.5 * (logdet + (n - k) * np.log(rss))


def _spread(Q: np.ndarray, blocks: np.ndarray, shapes: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return Q^T D V D Q (m, k, k) for (shape, rho) at ``places`` (m, 2)."""
    found = np.zeros((len(places), Q.shape[1], Q.shape[1]))
    for j in np.unique(places[:, 1]):
        here = places[:, 1] == j
        own, rho = places[here, 0], float(RHO[j])
        if len(Q) > MANY:
            found[here] = [forms(Q * shape[:, None], rho, blocks) for shape in shapes[own]]
        else:
            found[here] = forms(Q * shapes[own][:, :, None], rho, blocks)
    return found
