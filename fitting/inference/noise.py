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

The noise may also change along the curve, as where an instrument settles, and may differ between repeated runs that were
joined. Both are estimated (``variation`` and ``between_runs``) and enter the covariance in the same way.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import special

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
SHORT = 12  # degrees of freedom below which noise is taken as white
DEGREE = 2  # of the polynomial that describes the logarithm of a variance along the curve
ENOUGH = 15  # degrees of freedom below which no change of the variance along the curve is sought
SIDE = 0.1  # smallest share of the points on one side of a step of the variance
CHANGES = 0.0025  # probability of finding a change of either kind in noise of constant variance
STEPS, REACH = 60, 1.0  # Fisher scoring steps for this polynomial at most, and the longest
FEW, RAGGED = (
    5,
    0.1,
)  # fewest abscissae of repeated runs, and share of them that may have another number of points
TINY = 1e-300
ALIKE = 0.1  # prior probability that repeated runs do not differ beyond their noise
APART = np.geomspace(0.3, 300.0, 40)  # trial standard deviations between runs, over the error of one of them


class ErrorModels(NamedTuple):
    """The error models that are tried: their diagonals D (m, n), and the ratios a/b of their two terms (m,)."""

    shapes: np.ndarray
    floors: np.ndarray


class Noise(NamedTuple):
    """The posterior of the noise model of a fit.

    lag1: correlation of neighbouring residuals about their mean; likeliest: the most likely rho; left: lag-1
    correlation that remains after an AR(1) series of that rho; white: whether the noise is more likely white than not.
    share (m,): probability of each noise model in the mixture; variance (m, k, k): its covariance in the space of the
    Jacobian's columns, of weighted residuals; columns (k, p): the Jacobian in that space; dof: degrees of freedom of s,
    infinite where the variance is known; floor: a/b averaged over the mixture. sizes (n,): standard deviations along the
    curve relative to those of the error model, and spreads (n,): of the weighted residuals up to a factor, None where they
    do not change; runs: None where no repeated runs are
    joined.
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
    sizes: np.ndarray | None = None
    spreads: np.ndarray | None = None
    runs: "Runs | None" = None

    @property
    def known(self) -> bool:
        """True if the variance was taken as known."""
        return math.isinf(self.dof)

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
    p: int, known: bool, real: bool = True, sizes: np.ndarray | None = None,
) -> Noise:  # fmt: skip
    """Return the noise model of weighted residuals (n,) in blocks (n,), from the Jacobian (n, k) of the free
    coordinates.

    sizes (n,): standard deviations along the curve relative to those that are tried (``variation``).

    inside (k,): coordinates that are not at a bound; p: number of parameters; known: whether the variance of the noise
    is known; real: whether the residuals exceed rounding.
    """
    shapes, floors = tried
    shapes = shapes if sizes is None else shapes * sizes
    n, rss, Q = residual.size, float(residual @ residual), basis(jacobian)
    likelihood = np.tile(np.where(RHO > 0.0, -np.inf, 0.0), (len(shapes), 1))  # white
    if real:
        likelihood = _restricted(residual, basis(jacobian[:, inside]), blocks, shapes)
        best = likelihood.max(1, keepdims=True)
        likelihood = likelihood - best + best / (excess(residual) if len(shapes) > 1 else 1.0)
    share = np.exp(likelihood - likelihood.max()) * _prior()
    rho = float(RHO[np.argmax(likelihood.max(0))])
    white = bool(share[:, 0].sum() > MORE_LIKELY_THAN_NOT * share.sum())
    # so few points do not tell correlated noise from white, and the prior of its correlation would decide
    white = white or n - p < SHORT
    share[:, 1:] *= not white
    places = np.argwhere(share > NEGLIGIBLE * share.max())
    share = share[tuple(places.T)] / share[tuple(places.T)].sum()
    spread, square = _spread(Q, blocks, shapes, places), shapes[places[:, 0]] ** 2
    if len(shapes) == 1 and sizes is None:
        # the mean over the directions is accurate in short strongly correlated series too
        each = np.trace(spread, axis1=1, axis2=2) / max(Q.shape[1], 1)
        spread = each[:, None, None] * np.eye(Q.shape[1])
    # s^2 from E[RSS], reduced by the fit
    scale = rss * (n - Q.shape[1]) / (n - p) / (square.sum(1) - np.trace(spread, axis1=1, axis2=2))
    floor = math.sqrt(float(share * scale @ floors[places[:, 0]] ** 2 / max(float(share @ scale), 1e-300)))
    variance = spread * (1.0 if known else scale[:, None, None])
    if sizes is not None:
        # weights and variances that were fitted to the same residuals make both smaller, by two degrees of freedom for
        # each parameter of the change to leading order
        variance = variance / max(1.0 - 2.0 * (DEGREE + 1) / max(n - p, 1), 0.5)
    level = residual if sizes is None else residual / shapes[0]
    return Noise(
        lag_one(level, blocks), rho, _left(level, rho, blocks), white, share, variance, Q.T @ jacobian,
        math.inf if known else float(n - p), floor,
        Calibration.of(residual, Q, shapes, floors, 0.0 if white else rho, blocks, p) if real else None, sizes,
    )  # fmt: skip


def variation(
    residual: np.ndarray, Q: np.ndarray, t: np.ndarray, p: int, whole: bool = False
) -> np.ndarray | None:
    """Return the standard deviations (n,) of noise that changes along the abscissa t (n,), relative to their quadratic
    mean; None where they do not change significantly.

    The logarithm of the variance is a quadratic polynomial of the rank of t, or has one step, whichever is more likely. Both
    are fitted to the squared residuals over 1 - leverage, which have gamma distributions (generalised linear model with a
    logarithmic link; M. Aitkin, Appl. Statist. 36 (1987) 332). The likelihood ratio against a constant variance, divided
    by the variance of its score where the tails are heavy, has a chi-square distribution with two degrees of freedom for
    the polynomial, and about that with three for a step whose place is sought (D. W. K. Andrews, Econometrica 61 (1993)
    821). A change is accepted at the level ``CHANGES`` for each of the two; with fewer than ``ENOUGH`` degrees of freedom
    of the residuals none is sought. whole: whether the largest residual counts as any other; otherwise the change must be
    significant without it as well.
    """
    n = residual.size
    if n - p < ENOUGH or np.unique(t).size < ENOUGH:
        return None
    # a single large residual is an outlier and no change: what is found must be there without it
    most = int(np.argmax(np.abs(residual)))
    others = np.arange(n) != most
    if not whole and variation(residual[others], Q[others], t[others], p, whole=True) is None:
        return None
    left = np.maximum(1.0 - np.sum(Q * Q, 1), 1e-3)
    square = residual**2 / left
    square = square / max(float(square.mean()), TINY)
    # equal abscissae have the mean of their ranks
    _, places, count = np.unique(t, return_inverse=True, return_counts=True)
    rank = (np.cumsum(count) - 0.5 * (count + 1))[places] / (n - 1.0)
    columns = np.polynomial.legendre.legvander(2.0 * rank - 1.0, DEGREE)
    found = np.zeros(DEGREE + 1)
    loss = lambda log: float(np.sum(log + square * np.exp(-np.clip(log, -60.0, 60.0))))
    for _ in range(STEPS):
        # Fisher's information of the logarithm of a variance is one half, whatever its value
        pull = square * np.exp(-np.clip(columns @ found, -60.0, 60.0)) - 1.0
        step = np.clip(np.linalg.lstsq(columns, pull, rcond=None)[0], -REACH, REACH)
        while loss(columns @ (found + step)) > loss(columns @ found) and np.max(np.abs(step)) > 1e-6:
            step = 0.5 * step
        found = found + step
        if np.max(np.abs(step)) <= 1e-6:
            break
    smooth = columns @ found
    # the mean square before and after each place at which the variance may have a step
    ranked, along = np.unique(rank), np.argsort(rank, kind="stable")
    before = np.searchsorted(rank[along], ranked[1:])
    before = before[(before >= SIDE * n) & (before <= (1.0 - SIDE) * n)]
    sums = np.append(0.0, np.cumsum(square[along]))
    first, last = sums[before] / before, (sums[-1] - sums[before]) / (n - before)
    costs = before * np.log(np.maximum(first, TINY)) + (n - before) * np.log(np.maximum(last, TINY)) + n
    at = int(np.argmin(costs)) if costs.size else 0
    stepped = np.empty(n)
    if costs.size:
        stepped[along] = np.log(np.where(np.arange(n) < before[at], first[at], last[at]) + TINY)
    chosen = None
    for log, dof in ((smooth, DEGREE), (stepped, DEGREE + 1))[: 2 if costs.size else 1]:
        # of the likelihood ratio the part that heavy tails leave
        tails = float(excess(residual / np.sqrt(left) * np.exp(-0.5 * log)))
        chance = float(special.chdtrc(dof, max(n - loss(log), 0.0) / tails))
        if chance <= CHANGES and (chosen is None or loss(log) + 2.0 * dof < loss(chosen) + 2.0 * DEGREE):
            chosen = log
    if chosen is None:
        return None
    sizes = np.exp(0.5 * chosen)
    return sizes / math.sqrt(float(np.mean(sizes**2)))


class Runs(NamedTuple):
    """Repeated runs at equal abscissae that were joined to one curve.

    labels (n,): the run of each point, from 0; factors (m,): deviation of each run from their mean as a common factor;
    error: standard deviation of such a factor from the noise alone; chance: probability of as large a difference of runs
    that have nothing but noise; offset (n,): what the factors add to the weighted residuals.
    """

    labels: np.ndarray
    factors: np.ndarray
    error: float
    chance: float
    offset: np.ndarray


def runs_of(t: np.ndarray, blocks: np.ndarray) -> np.ndarray | None:
    """Return the run (n,) of each point of joined runs at equal abscissae t (n,), None where there are none.

    Points of a block with equal abscissae are in the order of their runs, as a stable sort leaves them. They are runs if
    all but one in ten of at least ``FEW`` abscissae of every block have equally many points, two or more.
    """
    order = np.lexsort((np.arange(t.size), t, blocks))
    same = np.append(False, (np.diff(t[order]) == 0.0) & (np.diff(blocks[order]) == 0))
    group = np.cumsum(~same) - 1
    count = np.bincount(group)
    m = int(np.median(count))
    if m < 2 or count.size < FEW or np.mean(count != m) > RAGGED:
        return None
    first = np.flatnonzero(~same)
    labels = np.empty(t.size, dtype=int)
    labels[order] = np.minimum(np.arange(t.size) - first[group], m - 1)
    return labels


def compared(
    residual: np.ndarray, Q: np.ndarray, weighted: np.ndarray, labels: np.ndarray, p: int, known: bool
) -> Runs:
    """Return the differences of runs (n,) from the weighted residuals (n,) about a fit to all of them.

    weighted (n,): fitted values times their weights, which a common factor of a run changes in proportion. The ratio of
    the mean squares between and within the runs has an F distribution where the runs have nothing but noise (analysis of
    variance), a chi-square one where the variance is known.
    """
    m, n = int(labels.max()) + 1, residual.size
    size = np.bincount(labels, weighted**2, m)
    factors = np.bincount(labels, weighted * residual, m) / np.maximum(size, TINY)
    # as residuals measure: fitted minus measured
    factors = -(factors - float(size @ factors) / max(float(size.sum()), TINY))
    offset = -weighted * factors[labels]
    between, rest = float(size @ factors**2), residual - offset
    dof = n - p - (m - 1)
    scale = 1.0 if known or dof < 1 else float(rest @ rest) / dof
    score = between / max(scale, TINY)
    above = special.chdtrc(m - 1, score) if known or dof < 1 else special.fdtrc(m - 1, dof, score / (m - 1))
    return Runs(labels, factors, math.sqrt(scale / max(float(size.mean()), TINY)), float(above), offset)


def between_runs(found: Noise, runs: Runs, Q: np.ndarray, weighted: np.ndarray, order: np.ndarray) -> Noise:
    """Return the noise with a common factor of each run as a further random error.

    The standard deviation of the factors is unknown, and m runs determine it with m - 1 degrees of freedom only. The
    mixture goes over its values ``APART`` times the error of the factor of a run, uniform in their logarithm, and zero
    with the prior probability ``ALIKE``; where the runs differ by much more than their noise, the intervals become those
    of Student's t distribution with m - 1 degrees of freedom. In simulations of 2, 3 and 5 runs the 95 % intervals of a
    common factor hold the truth in 92 to 98 % where the runs differ by twice the error of a run or more, and in more
    than that, up to 100 %, where they do not differ. Q (n, k): the basis in which the variance of the noise is given, of
    the points in ``order`` (n,); weighted (n,): as in ``compared``.
    """
    m = runs.factors.size
    score = float(np.sum((runs.factors / runs.error) ** 2))
    ratio = np.append(0.0, APART)
    prior = np.append(ALIKE, np.full(APART.size, (1.0 - ALIKE) / APART.size))
    logs = np.log(prior) - 0.5 * (m - 1) * np.log1p(ratio**2)
    if found.known:
        logs -= 0.5 * score / (1.0 + ratio**2)
    else:
        logs -= 0.5 * (found.dof + m - 1) * np.log1p(score / (1.0 + ratio**2) / found.dof)
    share = np.exp(logs - logs.max())
    share /= share.sum()
    directions = np.stack([Q.T @ np.where(runs.labels == r, weighted, 0.0)[order] for r in range(m)], -1)
    more = runs.error**2 * directions @ directions.T
    both = share[:, None] * found.share
    variance = found.variance + ratio[:, None, None, None] ** 2 * more
    kept = both > NEGLIGIBLE * both.max()
    return found._replace(share=both[kept] / both[kept].sum(), variance=variance[kept], runs=runs)


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
