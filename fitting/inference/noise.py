"""Estimate of the variance and correlation of the noise of a fit's data, and the intervals that follow.

The covariance matrix of the weighted noise is s^2 D V D. V is the identity or that of an AR(1) series of correlation
rho. D is the identity for weights that the user chose; for estimated weights it holds the standard
deviations (a^2 + (b f)^2)^(1/2) of fitted values f, times the weights, on a grid of a/b. rho and a/b are estimated by
the restricted likelihood of the residuals (D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320), which accounts for the
variance and correlation that a fit of p parameters removes from n residuals. For estimated weights the estimates have
the covariance s^2 A D V D A^T, with A the linearised estimator, whatever the weights were; for chosen weights the
variance is averaged over the k directions of the fit, since rho alone biases single directions. Intervals come from the
mixture of Student's t distributions over all rho and a/b, weighted by the likelihood and Jeffreys' prior
d rho/sqrt(1 - rho^2), uniform in log(a/b), which accounts for the uncertainty of both. Where a/b was estimated, their
widths are calibrated (``Calibration``). Where the residuals have heavy tails, the likelihood of a/b is tempered by the
variance of its score.

The noise may also change along the curve, as where an instrument settles, and may differ between repeated runs that were
joined. Both are estimated (``variation`` and ``between_runs``) and enter the covariance in the same way. Where the noise
changes is uncertain too, and the mixture goes over the changes that are likely (``Changes``).
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy
from scipy import special

from fitting.search.nonlinear import ROUNDING

# AR(1) noise in blocks of data: quadratic forms with its correlation matrix for a grid of rho, and lag-1
# correlations.
#
# The correlation matrix V has V_ij = rho^|i - j| within a block (a segment of a test, G' or G'', one of several
# curves) and 0 between blocks. Blocks are consecutive points with equal labels, (n,) integers.


RHO = np.tanh(np.linspace(0.0, 2.15, 31))  # up to 0.973
BEYOND_CHANCE = 3.3  # standard errors 1/sqrt(n) of a correlation: one in two thousand series of white noise


def basis(jacobian: np.ndarray) -> np.ndarray:
    """Return orthonormal columns (n, k) that span those of the Jacobian; k is its numerical rank."""
    size = np.linalg.norm(jacobian, axis=0)
    U, s, _ = np.linalg.svd(jacobian[:, size > 0] / size[size > 0], full_matrices=False)
    return U[:, s > ROUNDING * s.max(initial=0.0)]


def within(blocks: np.ndarray) -> np.ndarray:
    """Return whether each point and the next one are in the same block, (n - 1,) bool."""
    return blocks[1:] == blocks[:-1]


def lag_one(residual: np.ndarray, blocks: np.ndarray) -> float:
    """Return the correlation of neighbouring residuals of a block about their common mean."""
    r = residual - residual.mean()
    total, same = float(r @ r), within(blocks)
    return float(r[1:][same] @ r[:-1][same]) / total if total > 0 else 0.0


def inverse_forms(M: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Return M^T V^-1 M of columns M (..., n, m) for every RHO, (..., k, m, m); V^-1 is tridiagonal."""
    same = within(blocks)
    turned = np.swapaxes(M, -1, -2)
    ends = np.append(True, ~same).astype(int) + np.append(~same, True)
    later, earlier = turned[..., 1:], M[..., :-1, :]
    if not np.all(same):
        later, earlier = later[..., same], earlier[..., same, :]
    near = later @ earlier
    at = np.flatnonzero(ends)
    rho = RHO[:, None, None]
    inner = (1.0 + rho**2) * (turned @ M)[..., None, :, :]
    inner = inner - rho * (near + np.swapaxes(near, -1, -2))[..., None, :, :]
    return (inner - rho**2 * ((turned[..., at] * ends[at]) @ M[..., at, :])[..., None, :, :]) / (1.0 - rho**2)


def forms(M: np.ndarray, rho: float, blocks: np.ndarray) -> np.ndarray:
    """Return M^T V M (..., m, m) of columns M (..., n, m) for one rho."""
    flat = np.moveaxis(M, -2, 0).reshape(M.shape[-2], -1)
    bands = np.stack([np.ones(len(flat)), np.append(-rho * within(blocks), 0.0)])
    # past[i] = M[i] + rho past[i - 1] within a block
    past = np.moveaxis(
        scipy.linalg.solve_banded((1, 0), bands, flat).reshape(-1, *M.shape[:-2], M.shape[-1]), 0, -2
    )
    half = np.swapaxes(M, -1, -2) @ past
    return half + np.swapaxes(half, -1, -2) - np.swapaxes(M, -1, -2) @ M


def coloured(white: np.ndarray, rho: float, blocks: np.ndarray) -> np.ndarray:
    """Return AR(1) series (..., n) of unit variance from independent standard normal numbers (..., n)."""
    found, same = white.copy(), within(blocks)
    for i in np.flatnonzero(same if rho else ~same & same):
        found[..., i + 1] = rho * found[..., i] + math.sqrt(1.0 - rho**2) * white[..., i + 1]
    return found


def whitened(series: np.ndarray, rho: float, blocks: np.ndarray) -> np.ndarray:
    """Return independent numbers of unit variance (..., n) from AR(1) series (..., n) of unit variance."""
    found, same = series.copy(), np.append(False, within(blocks))
    if rho:
        found[..., same] -= rho * series[..., :-1][..., same[1:]]
        found[..., same] /= math.sqrt(1.0 - rho**2)
    return found


def log_likelihood(residual: np.ndarray, weights: np.ndarray, blocks: np.ndarray) -> float:
    """Return the largest log likelihood of weighted residuals (n,) as AR(1) noise of any size, up to a constant.

    It is -n/2 log(sum e^2/n) - m/2 log(1 - rho^2) + sum log w, with the numbers e of ``whitened``, m pairs of neighbours and
    the weights w, largest over the correlations rho of ``RHO``.
    """
    pairs, size = int(np.sum(within(blocks))), residual.size

    def of_noise(rho: float) -> float:
        e = whitened(residual, rho, blocks)
        return -0.5 * size * math.log(max(float(e @ e) / size, 1e-300)) - 0.5 * pairs * math.log1p(-(rho**2))

    return float(np.sum(np.log(weights))) + max(of_noise(float(rho)) for rho in RHO)


def chance_of_gain(gain: float, size: int, dof: int) -> float:
    """Return the probability that one more parameter, of no meaning, raises ``log_likelihood`` by more than ``gain``.

    For white noise of n = size points the gain is n/2 log(1 + F/dof), with F of the distribution F(1, dof) and dof the
    degrees of freedom with that parameter: 2 gain has the distribution chi2(1) for many points alone, by which probabilities
    of 0.1 % would be 2 % for six points and three parameters.
    """
    # by how much the sum of squares is larger without it, F/dof
    more = math.expm1(min(2.0 * max(gain, 0.0) / size, 700.0))
    return float(special.fdtrc(1.0, dof, dof * more))


# Quantiles of Student's t distribution, and of the normal distribution for infinite degrees of freedom.
#
# The squares of these variables have the distributions F(1, dof) and chi2(1). The functions come from scipy.special,
# because scipy.stats takes half a second to import.


NEWTON, CLOSE, TINY_SPREAD = 30, 1e-5, 1e-100
FAR, NODES = 12.0, 4096  # table of probabilities: inverse hyperbolic sine of the largest |t|, and its size


def two_sided(level: float, dof: float = math.inf) -> float:
    """Return the value that |t| stays below with probability ``level``."""
    share = 0.5 + 0.5 * level
    return float(special.ndtri(share) if math.isinf(dof) else special.stdtrit(dof, share))


def share_within(values: np.ndarray, dof: float = math.inf) -> np.ndarray:
    """Return the probability that |t| stays below each value >= 0."""
    return 2.0 * (special.ndtr(values) if math.isinf(dof) else special.stdtr(dof, values)) - 1.0


def share_and_slope(values: np.ndarray, dof: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the probability that |t| stays below each value >= 0, and its derivative."""
    if math.isinf(dof):
        density = np.exp(-0.5 * values**2) / math.sqrt(2.0 * math.pi)
    else:
        front = special.gammaln(0.5 * dof + 0.5) - special.gammaln(0.5 * dof) - 0.5 * math.log(math.pi * dof)
        density = np.exp(front - 0.5 * (dof + 1.0) * np.log1p(values**2 / dof))
    return share_within(values, dof), 2.0 * density


@functools.cache
def _table(dof: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return values of |t|, the probability that |t| stays below them, and its slopes between them."""
    values = np.sinh(np.linspace(0.0, FAR, NODES))
    shares = share_within(values, dof)
    return values, shares, np.append(np.diff(shares) / np.diff(values), 0.0)


def tabulated(values: np.ndarray, dof: float) -> tuple[np.ndarray, np.ndarray]:
    """Return ``share_and_slope`` to 1e-5, in a tenth of the time, from a table."""
    nodes, shares, slopes = _table(dof)
    at = np.minimum((np.arcsinh(values) * ((NODES - 1) / FAR)).astype(int), NODES - 1)
    slope = slopes[at]
    return shares[at] + slope * (values - nodes[at]), slope


def mixture_half_width(
    share: np.ndarray, variance: np.ndarray, level: float, dof: float, law: Callable = share_and_slope
) -> np.ndarray:
    """Return the half widths (..., q) that contain a probability ``level`` of mixtures of t with shares (..., m) and
    variances (..., m, q).

    law: ``share_and_slope`` or ``tabulated``. The probability is a concave function of the half width, so Newton's
    method approaches the solution from below after its first step.
    """
    root, single = np.sqrt(variance), two_sided(level, dof)
    if share.shape[-1] == 1:
        return single * root[..., 0, :]
    mean = lambda of_models: np.einsum("...m,...mq->...q", share, of_models)
    low, some = single * root.min(-2), np.maximum(root, TINY_SPREAD)
    found = np.maximum(single * np.sqrt(mean(variance)), TINY_SPREAD)
    for _ in range(NEWTON):
        below, slope = law(found[..., None, :] / some, dof)
        change = (mean(below) - level) / np.maximum(mean(slope / some), TINY_SPREAD)
        found = np.maximum(found - change, low)
        if np.all(np.abs(change) <= CLOSE * found):
            break
    return found


# Calibration of the widths of intervals where the dependence of the noise on the values was estimated.
#
# The mixture of Student's t distributions over the noise models has the stated coverage on average
# over its prior, but not at every true ratio a/b: where few values are small, the intervals contain the truth too
# often at a = 0, and too seldom at a/b near the smallest values. So half widths are multiplied by a factor exp(g), a
# function of the estimated a/b, that makes the coverage as nearly equal to the level as possible at every true a/b.
# This is prepivoting (R. Beran, Biometrika 74 (1987) 457), with a level that holds over a range of the nuisance
# parameter rather than at its estimate alone (G. Elliott, U. K. Mueller, M. W. Watson, Econometrica 83 (2015) 771).
#
# For every a/b on a grid, data sets of the linearised model are simulated, and their noise and weights are estimated
# as those of the fit. Given the ratios of the residuals, on which everything else depends, the generalised
# least-squares estimate with the true covariance, over its standard error, has Student's t distribution; so it is
# integrated in closed form, and few data sets suffice. g is piecewise linear in the logarithm of the estimated a/b.
# It minimises the squared deviations of the coverage from the level, with a penalty on its size and its second
# differences. The random numbers are always the same.


MARGIN = 8.0  # factor by which the grid of a/b is shortened at both ends
NUMBERS, FEWEST, MOST = 8000, 16, 128  # random numbers for each a/b, and limits of its number of data sets
LARGEST = 2000  # number of points above which nothing is calibrated
CALIBRATION_FEW = 3  # number of noise models below which nothing is calibrated
KNOTS, TAIL = 7, 0.02  # of g, and the share of the estimated a/b below the first and above the last
ACCURACY, SIZE = (
    0.05,
    0.3,
)  # of the logarithm of a width: accuracy aimed at, and size that g and its bends may have
TURNS, CALIBRATION_REACH = 8, 0.5  # Gauss-Newton steps for g, and the longest
REWEIGHED = 3  # estimates of a/b, each with the weights of the previous one
TINY = 1e-300


def nearest_coverage(
    covered: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], size: int, level: float, unit: float
) -> np.ndarray:
    """Return g (size,) at the knots for which the coverages are nearest to the level, by Gauss-Newton steps.

    covered: the coverages (m,) of g, and their slopes (m, size); unit: of their deviations, as ``SIZE`` is that of g.
    """
    penalty = np.concatenate([np.eye(size), np.diff(np.eye(size), 2, axis=0)]) / SIZE
    g = np.zeros(size)
    for _ in range(TURNS):
        coverage, slope = covered(g)
        rise = np.concatenate([slope / unit, penalty])
        short = np.append((level - coverage) / unit, -penalty @ g)
        step = np.linalg.lstsq(rise, short, rcond=None)[0]
        g = g + np.clip(step, -CALIBRATION_REACH, CALIBRATION_REACH)
    return g


@dataclasses.dataclass(frozen=True, eq=False)
class Calibration:
    """The linearised model of a fit with the noise models that were tried.

    residual (n,): weighted; Q (n, k): orthonormal columns that span the weighted Jacobian; shapes (m, n): standard
    deviations of the weighted noise up to a factor; ratios, count (m,): their a/b, and the number of noise models that
    each represents; rho: correlation of neighbours in blocks (n,); p: number of parameters.
    """

    residual: np.ndarray
    Q: np.ndarray
    shapes: np.ndarray
    ratios: np.ndarray
    count: np.ndarray
    rho: float
    blocks: np.ndarray
    p: int

    @classmethod
    def of(
        cls, residual: np.ndarray, Q: np.ndarray, shapes: np.ndarray, ratios: np.ndarray, rho: float,
        blocks: np.ndarray, p: int,
    ) -> "Calibration | None":  # fmt: skip
        """Return the calibration of a fit, None where the noise has hardly more than one model, or the points are many.

        The outermost noise models are the same but for their scale, and the last one that is kept represents them.
        """
        inner = np.flatnonzero((ratios >= MARGIN * ratios[0]) & (ratios <= ratios[-1] / MARGIN))
        if inner.size < CALIBRATION_FEW or len(Q) > LARGEST or not Q.size:
            return None
        count = np.ones(inner.size)
        count[0] += inner[0]
        count[-1] += ratios.size - 1 - inner[-1]
        return cls(residual, Q, shapes[inner], ratios[inner], count, rho, blocks, p)

    def factors(self, directions: np.ndarray, level: float) -> np.ndarray:
        """Return the factors (q,) on the half widths of intervals, at a level, of linear functions of the coordinates.

        directions (k, q): the functions have the errors directions^T Q^T e, e (n,) the weighted noise.
        """
        (n, k), true = self.Q.shape, np.arange(len(self.ratios))
        spread, roots, (share, scale, at, _, rss, least, best), hats, own = self._simulated
        # half widths, and distances of the estimates from the generalised least-squares ones with the true noise
        # model, over the standard errors of the latter: (m, s, q) for s simulated data sets of each true a/b
        variance = np.einsum("kq,ijkl,lq->ijq", directions, spread, directions, optimize=True)
        half = mixture_half_width(share, scale[..., None] * variance[at], level, float(n - self.p), tabulated)
        error = np.stack([np.linalg.norm(np.linalg.solve(R.T, directions), axis=0) for R in roots])
        error = error[:, None] * np.sqrt(rss[true, :, true] / (n - k))[..., None]
        estimate = np.take_along_axis(least, at[..., None, None], -2)[..., 0, :]
        half, off = half / error, (estimate - best[true, :, true]) @ directions / error

        # g at the knots for the coverage nearest to the level at every true a/b
        z, dof, found = two_sided(level, float(n - k)), float(n - k), []
        unit = ACCURACY * z * float(tabulated(np.array(z), dof)[1])
        for one, away in zip(np.moveaxis(half, -1, 0), np.moveaxis(off, -1, 0), strict=True):

            def covered(
                g: np.ndarray, one: np.ndarray = one, away: np.ndarray = away
            ) -> tuple[np.ndarray, np.ndarray]:
                width = one * np.exp(hats @ g)
                low, high = width - away, width + away
                below, slope_low = tabulated(np.abs(low), dof)
                above, slope_high = tabulated(np.abs(high), dof)
                coverage = 0.5 * np.mean(np.sign(low) * below + np.sign(high) * above, 1)
                slope = np.einsum("ms,msk->mk", 0.5 * width * (slope_low + slope_high), hats) / one.shape[1]
                return coverage, slope

            found.append(own @ nearest_coverage(covered, hats.shape[-1], level, unit))
        return np.exp(found)

    @functools.cached_property
    def _simulated(self) -> tuple:
        """Return what the intervals of all functions share.

        spread (m, m, k, k): covariance of the coefficients of Q with the weights of one noise model and the noise of
        another; the triangular factors (k, k) of the whitened Q with each; the estimates from simulated data sets (m, s),
        s for each true a/b; hat functions of the estimated a/b, for these (m, s, K) and for the data (K,).
        """
        Q, shapes, rho, blocks = self.Q, self.shapes, self.rho, self.blocks
        (n, k), m = Q.shape, len(self.ratios)
        # QR factors of Q with the weights of each noise model, and whitened
        plain = [np.linalg.qr(Q / shape[:, None]) for shape in shapes]
        white = [np.linalg.qr(whitened((Q / shape[:, None]).T, rho, blocks).T) for shape in shapes]
        log_determinant = np.array(
            [
                2.0 * (np.sum(np.log(shape)) + np.sum(np.log(np.abs(np.diag(R)))))
                for shape, (_, R) in zip(shapes, white, strict=True)
            ]
        )
        ratio = shapes[None] / shapes[:, None]
        inner = forms(np.stack([U for U, _ in plain])[:, None] * ratio[..., None], rho, blocks)
        expected = np.sum(ratio**2, -1) - np.trace(inner, axis1=-2, axis2=-1)  # RSS
        back = np.stack([np.linalg.inv(R) for _, R in plain])[:, None]
        spread = back @ inner @ np.swapaxes(back, -1, -2)

        def estimated(e: np.ndarray) -> tuple[np.ndarray, ...]:
            """Return the estimates from weighted noise e (..., n), as a fit finds them.

            share, scale (..., m): probability of each noise model, and its variance; at (...): index of the weights;
            log_ratio (...): of a/b; rss (..., m): by generalised least squares with each noise model; least, best (..., m,
            k): coefficients of Q by least squares with each of the weights, and by generalised least squares.
            """
            fits = []
            for shape, (U, R_plain), (V, R_white) in zip(shapes, plain, white, strict=True):
                y = e / shape
                c, turned = y @ U, whitened(y, rho, blocks)
                residual, d = y - c @ U.T, turned @ V
                rss = np.sum(turned**2, -1) - np.sum(d**2, -1)
                least, best = c @ np.linalg.inv(R_plain).T, d @ np.linalg.inv(R_white).T
                fits.append((np.sum(residual**2, -1), excess(residual), least, rss, best))
            squares, tails, least, rss, best = (
                np.moveaxis(np.stack(x), 0, e.ndim - 1) for x in zip(*fits, strict=True)
            )
            likelihood = -0.5 * (log_determinant + (n - k) * np.log(np.maximum(rss, TINY)))
            log_ratio, at = np.zeros(e.shape[:-1]), np.full(e.shape[:-1], m // 2)
            for _ in range(REWEIGHED):
                own = np.take_along_axis(squares, at[..., None], -1)
                scale = own * (n - k) / (n - self.p) / expected[at]
                tempered = likelihood / np.take_along_axis(tails, at[..., None], -1)
                share = np.exp(tempered - tempered.max(-1, keepdims=True)) * self.count
                share /= share.sum(-1, keepdims=True)
                mean = (share * scale) @ self.ratios**2 / np.maximum(np.sum(share * scale, -1), TINY)
                log_ratio = 0.5 * np.log(mean)
                at = np.argmin(np.abs(np.log(self.ratios) - log_ratio[..., None]), -1)
            return share, scale, at, log_ratio, rss, least, best

        numbers = np.random.default_rng(0).standard_normal((m, min(max(NUMBERS // n, FEWEST), MOST), n))
        drawn = estimated(shapes[:, None, :] * coloured(numbers, rho, blocks))
        low, high = np.quantile(drawn[3], (TAIL, 1.0 - TAIL)).tolist()
        knots = np.linspace(low, high, KNOTS)
        hats = lambda log_ratio: np.stack([np.interp(log_ratio, knots, one) for one in np.eye(KNOTS)], -1)
        return spread, [R for _, R in white], drawn, hats(drawn[3]), hats(estimated(self.residual)[3])


def excess(residual: np.ndarray) -> np.ndarray:
    """Return 1 + kappa/2, kappa the excess kurtosis of residuals (..., n), at least 1.

    This is the variance of the score of a scale relative to that of Gaussian noise, by which heavy tails weaken a
    likelihood of scales.
    """
    residual = residual - residual.mean(-1, keepdims=True)
    # of residuals beyond 1e77 the fourth power would be infinite
    square = (residual / np.maximum(np.max(np.abs(residual), -1, keepdims=True), TINY)) ** 2
    return np.maximum(0.5 * np.mean(square**2, -1) / np.maximum(np.mean(square, -1) ** 2, TINY) - 0.5, 1.0)


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
STEPPED = 40  # places of a step of the variance at most, over which intervals are averaged
STEPS, REACH = 60, 1.0  # Fisher scoring steps for this polynomial at most, and the longest
FEW, RAGGED = (
    5,
    0.1,
)  # fewest abscissae of repeated runs, and share of them that may have another number of points
ALIKE = 0.1  # prior probability that repeated runs do not differ beyond their noise
APART = np.geomspace(0.3, 300.0, 40)  # trial standard deviations between runs, over the error of one of them
TRUE_VARIATIONS = np.geomspace(0.3, 100.0, 18)  # the same, for which intervals are calibrated
WEIGHT_STEP = 0.05  # difference of logarithms below which two directions have the same calibration
SCORES = -14.0, 16.0, 160  # logarithms of the scores for which half widths are tabulated
RUN_KNOTS = math.log(0.1), math.log(1e4), 9  # logarithms of the scores, over m - 1, at which g is fitted
RUN_NODES, SIZE_NODES = 48, 8  # quantiles of the differences of runs, and of the estimated size of the noise


class ErrorModels(NamedTuple):
    """The error models that are tried: their diagonals D (m, n), and the ratios a/b of their two terms (m,)."""

    shapes: np.ndarray
    ratios: np.ndarray


class Changes(NamedTuple):
    """Noise that changes along the curve.

    sizes (n,): the likeliest standard deviations relative to those of the error model, of unit quadratic mean; candidates
    (m, n): these and others that are as likely but for a factor of ``NEGLIGIBLE``, with the logarithms of their prior
    probabilities up to a constant (m,), and the number of parameters (m,) that were fitted to the residuals.
    """

    sizes: np.ndarray
    candidates: np.ndarray
    prior: np.ndarray
    parameters: np.ndarray


class Noise(NamedTuple):
    """The posterior of the noise model of a fit.

    lag1: correlation of neighbouring residuals about their mean; likeliest: the most likely rho;
    lag1_of_innovations: that of what remains after an AR(1) series of that rho is subtracted; white: whether the noise is
    more likely white than not.
    share (m,): probability of each noise model in the mixture; variance (m, k, k): its covariance in the space of the
    Jacobian's columns, of weighted residuals; columns (k, p): the Jacobian in that space; dof: degrees of freedom of s,
    infinite where the variance is known; ratio: a/b averaged over the mixture. sizes (n,): standard deviations along the
    curve relative to those of the error model, and spreads (n,): of the weighted residuals up to a factor, None where they
    do not change; runs, between: None where no repeated runs are joined; copies: number of points of one measurement.
    """

    lag1: float
    likeliest: float
    lag1_of_innovations: float
    white: bool
    share: np.ndarray
    variance: np.ndarray
    columns: np.ndarray
    dof: float
    ratio: float
    calibration: Calibration | None = None
    sizes: np.ndarray | None = None
    spreads: np.ndarray | None = None
    runs: "Runs | None" = None
    between: "Between | None" = None
    copies: float = 1.0

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
        half = mixture_half_width(self.share, variance, level, self.dof)
        if self.calibration is not None and np.any(size > 0):
            half[size > 0] *= self.calibration.factors(directions[:, size > 0], level)
        if self.between is not None and np.any(size > 0):
            half[size > 0] *= self.between.factors(directions[:, size > 0], level)
        return half**2

    def widening(self, level: float, scale: float) -> float:
        """Return the mean ratio of interval widths to those for white noise.

        scale: standard deviation of the weighted residuals; the mean is over the directions.
        """
        if not self.columns.size:
            return 1.0
        mean = np.trace(self.variance, axis1=1, axis2=2)[:, None] / len(self.columns)
        half = float(mixture_half_width(self.share, mean, level, self.dof)[0])
        found = half / max(scale, 1e-300) / two_sided(level, self.dof)
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
    p: int, known: bool, real: bool = True, changes: Changes | None = None,
) -> Noise:  # fmt: skip
    """Return the noise model of weighted residuals (n,) in blocks (n,), from the Jacobian (n, k) of the free
    coordinates.

    changes: of the noise along the curve, relative to the single error model that is tried (``variation``).

    inside (k,): coordinates that are not at a bound; p: number of parameters; known: whether the variance of the noise
    is known; real: whether the residuals exceed rounding.
    """
    # 1. The likelihood of every error model and correlation, (models, RHO), without the directions that the fit takes up.
    shapes, ratios = tried
    level = residual
    if changes is not None:
        level, shapes = residual / (shapes[0] * changes.sizes), shapes * changes.candidates
        ratios = np.repeat(ratios, len(shapes))
    n, rss, Q = residual.size, float(residual @ residual), basis(jacobian)
    likelihood = np.tile(np.where(RHO > 0.0, -np.inf, 0.0), (len(shapes), 1))  # white
    if real:
        # the restricted log likelihood of every shape and RHO up to a constant, from the triangular factor of [Q,
        # r]^T V^-1 [Q, r]
        own = basis(jacobian[:, inside])
        k, unit = own.shape[1], math.sqrt(rss / n) or 1.0
        columns = np.column_stack([own, residual / unit])
        if n > MANY:  # one shape at a time, since all of them together would take gigabytes
            products = np.stack([inverse_forms(columns / shape[:, None], blocks) for shape in shapes])
        else:
            products = inverse_forms(columns / shapes[:, :, None], blocks)
        factor = np.linalg.cholesky(products + 1e-14 * np.eye(k + 1))
        diagonal = np.diagonal(factor, axis1=-2, axis2=-1)
        logdet = (
            np.sum(within(blocks)) * np.log1p(-(RHO**2))
            + 2.0 * np.array([np.sum(np.log(shape)) for shape in shapes])[:, None]
        )
        logdet = logdet + 2.0 * np.sum(np.log(diagonal[..., :k]), -1)
        likelihood = -0.5 * (logdet + (n - k) * np.log(diagonal[..., k] ** 2))
        best = likelihood.max(1, keepdims=True)
        likelihood = likelihood - best + best / (excess(level) if len(shapes) > 1 else 1.0)
        if changes is not None:
            likelihood = likelihood + changes.prior[:, None]

    # 2. The mixture: shares of the likelihood times the prior, and white noise alone where that is more likely. The grid of
    # RHO is uniform in artanh(rho), so that d rho is proportional to 1 - rho^2.
    prior = np.sqrt(1.0 - RHO**2)
    prior *= (1.0 - WHITE) / prior.sum()
    prior[0] += WHITE
    share = np.exp(likelihood - likelihood.max()) * prior
    rho = float(RHO[np.argmax(likelihood.max(0))])
    white = bool(share[:, 0].sum() > MORE_LIKELY_THAN_NOT * share.sum())
    # so few points do not tell correlated noise from white, and the prior of its correlation would decide
    white = white or n - p < SHORT
    share[:, 1:] *= not white
    places = np.argwhere(share > NEGLIGIBLE * share.max())
    share = share[tuple(places.T)] / share[tuple(places.T)].sum()

    # 3. The covariance of the coefficients of Q: Q^T D V D Q of each noise model that remains, times s^2.
    spread = np.zeros((len(places), Q.shape[1], Q.shape[1]))
    square = np.einsum("mn,mn->m", shapes, shapes)[places[:, 0]]
    for j in np.unique(places[:, 1]):
        here, one = places[:, 1] == j, float(RHO[j])
        if n > MANY:
            spread[here] = [forms(Q * shapes[i][:, None], one, blocks) for i in places[here, 0]]
        else:
            spread[here] = forms(Q * shapes[places[here, 0]][:, :, None], one, blocks)
    if len(shapes) == 1 and changes is None:
        # the mean over the directions is accurate in short strongly correlated series too
        each = np.trace(spread, axis1=1, axis2=2) / max(Q.shape[1], 1)
        spread = each[:, None, None] * np.eye(Q.shape[1])
    # s^2 from E[RSS], reduced by the fit
    scale = rss * (n - Q.shape[1]) / (n - p) / (square - np.trace(spread, axis1=1, axis2=2))
    ratio = math.sqrt(float(share * scale @ ratios[places[:, 0]] ** 2 / max(float(share @ scale), 1e-300)))
    variance = spread * (1.0 if known else scale[:, None, None])
    if changes is not None:
        variance = about_estimate(residual, Q, shapes, places, blocks, n - p, changes.parameters)

    # 4. Correlations of neighbours, before and after the AR(1) noise is subtracted.
    same = within(blocks)
    after = lag_one((level[1:] - rho * level[:-1])[same], blocks[1:][same])
    return Noise(
        lag_one(level, blocks), rho, after, white, share, variance, Q.T @ jacobian,
        math.inf if known else float(n - p), ratio,
        Calibration.of(residual, Q, shapes, ratios, 0.0 if white else rho, blocks, p) if real and changes is None else None,
        None if changes is None else changes.sizes,
    )  # fmt: skip


def about_estimate(
    residual: np.ndarray, Q: np.ndarray, shapes: np.ndarray, places: np.ndarray, blocks: np.ndarray, dof: int,
    parameters: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Return the mean square errors (m, k, k) of the coefficients of Q about their estimates, for noise models that were
    found by the same residuals (n,).

    Of each noise model the residuals determine how far its generalised least-squares estimate, which has the least
    variance, is from the estimate of the fit. The square of that distance is added to the variance. The variance of the
    fit's estimate before the residuals are known would be much larger than the square where points have large weights that
    have large errors in another noise model, since such points are seen to have small ones. places (m, 2): of the model
    in shapes and of the correlation in ``RHO``; dof: degrees of freedom of the residuals; parameters: of each of the shapes.
    """
    k, found = Q.shape[1], np.empty((len(places), Q.shape[1], Q.shape[1]))
    columns = np.column_stack([Q, residual])
    for i in np.unique(places[:, 0]):
        products = inverse_forms(columns / shapes[i][:, None], blocks)
        for m in np.flatnonzero(places[:, 0] == i):
            one = products[places[m, 1]]
            inverse = np.linalg.inv(one[:k, :k])
            away = inverse @ one[:k, k]
            found[m] = (one[k, k] - one[k, :k] @ away) / dof * inverse
            # weights and variances that were fitted to the same residuals make both smaller, by two degrees of freedom
            # for each parameter of the change to leading order
            found[m] = found[m] / max(1.0 - 2.0 * parameters[i] / max(dof, 1), 0.5) + np.outer(away, away)
    return found


def variation(
    residual: np.ndarray, Q: np.ndarray, t: np.ndarray, p: int, with_largest: bool = False
) -> Changes | None:
    """Return the standard deviations of noise that changes along the abscissa t (n,), with those that are nearly as likely;
    None where they do not change significantly.

    The logarithm of the variance is a quadratic polynomial of the rank of t, or has one step, whichever is more likely. Both
    are fitted to the squared residuals over 1 - leverage, which have gamma distributions (generalised linear model with a
    logarithmic link; M. Aitkin, Appl. Statist. 36 (1987) 332). The likelihood ratio against a constant variance, divided
    by the variance of its score where the tails are heavy, has a chi-square distribution with two degrees of freedom for
    the polynomial, and about that with three for a step whose place is sought (D. W. K. Andrews, Econometrica 61 (1993)
    821). A change is accepted at the level ``CHANGES`` for each of the two; with fewer than ``ENOUGH`` degrees of freedom
    of the residuals none is sought. with_largest: whether the largest residual counts as any other; otherwise the
    change must be significant without it as well.
    """
    # 1. Residuals over 1 - leverage, and the ranks of their abscissae.
    n = residual.size
    if n - p < ENOUGH or np.unique(t).size < ENOUGH:
        return None
    # a single large residual is an outlier and no change: what is found must be there without it
    most = int(np.argmax(np.abs(residual)))
    others = np.arange(n) != most
    if not with_largest and variation(residual[others], Q[others], t[others], p, with_largest=True) is None:
        return None
    one_minus_leverage = np.maximum(1.0 - np.sum(Q * Q, 1), 1e-3)
    square = residual**2 / one_minus_leverage
    square = square / max(float(square.mean()), TINY)
    # equal abscissae have the mean of their ranks
    _, places, count = np.unique(t, return_inverse=True, return_counts=True)
    rank = (np.cumsum(count) - 0.5 * (count + 1))[places] / (n - 1.0)
    columns = np.polynomial.legendre.legvander(2.0 * rank - 1.0, DEGREE)

    # 2. The polynomial of the log variance, by Fisher scoring with halved steps.
    found, project = np.zeros(DEGREE + 1), np.linalg.solve(columns.T @ columns, columns.T)
    loss = lambda log: float(np.sum(log + square * np.exp(-np.clip(log, -60.0, 60.0))))
    for _ in range(STEPS):
        # Fisher's information of the logarithm of a variance is one half, whatever its value
        pull = square * np.exp(-np.clip(columns @ found, -60.0, 60.0)) - 1.0
        step = np.clip(project @ pull, -REACH, REACH)
        while loss(columns @ (found + step)) > loss(columns @ found) and np.max(np.abs(step)) > 1e-6:
            step = 0.5 * step
        found = found + step
        if np.max(np.abs(step)) <= 1e-6:
            break
    smooth = columns @ found

    # 3. The step: the mean square before and after each place at which the variance may have one.
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

    # 4. The likelier of both that is significant, and what else is likely: a step at any other place, at most ``STEPPED`` of
    # them, and the polynomial. A place has the prior probability of one of all places, a further parameter a factor of e.
    chosen = None
    for log, dof in ((smooth, DEGREE), (stepped, DEGREE + 1))[: 2 if costs.size else 1]:
        # of the likelihood ratio the part that heavy tails leave
        tails = float(excess(residual / np.sqrt(one_minus_leverage) * np.exp(-0.5 * log)))
        chance = float(special.chdtrc(dof, max(n - loss(log), 0.0) / tails))
        if chance <= CHANGES and (chosen is None or loss(log) + 2.0 * dof < loss(chosen) + 2.0 * DEGREE):
            chosen = log
    if chosen is None:
        return None
    # The place of a step is no parameter of a candidate, since the mixture goes over all places; of many points those near
    # the step are a small share, and the likeliest change is enough.
    logs, prior, parameters = [smooth], [-float(DEGREE)], [DEGREE]
    if n > MANY:
        logs, parameters = [chosen], [DEGREE if chosen is smooth else 1]
    elif costs.size:
        near = np.flatnonzero(costs <= costs[at] - 2.0 * math.log(NEGLIGIBLE))
        some = near[np.unique(np.linspace(0, near.size - 1, STEPPED).astype(int))]
        for k in some:
            logs.append(np.empty(n))
            logs[-1][along] = np.log(np.where(np.arange(n) < before[k], first[k], last[k]) + TINY)
        prior += [math.log(near.size / some.size / costs.size) - 1.0] * some.size
        parameters += [1] * some.size
    sizes = np.exp(0.5 * np.array([chosen, *logs]))
    sizes = sizes / np.sqrt(np.mean(sizes**2, 1))[:, None]
    return Changes(sizes[0], sizes[1:], np.array(prior), np.array(parameters))


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


def copies(t: np.ndarray, measured: np.ndarray, fitted: np.ndarray) -> float:
    """Return the mean number of points (n,) that are the same measurement, 1 unless most points have a copy: the same
    abscissa, measured and fitted value, as of a file or a curve that was taken twice."""
    near = fitted.astype(np.float32)  # equal but for rounding
    size = np.unique(np.stack([t, measured, near], -1), axis=0, return_counts=True)[1]
    copied = float(size[size > 1].sum()) > 0.5 * t.size
    return t.size / size.size if copied else 1.0


def compared(residual: np.ndarray, weighted: np.ndarray, labels: np.ndarray, p: int, known: bool) -> Runs:
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


def shares_of_variation(score: np.ndarray, m: int, dof: float) -> tuple[np.ndarray, np.ndarray]:
    """Return trial standard deviations (k,) between m runs, over the error of one, and their probabilities (..., k).

    score (...): sum of the squares of the runs' factors over their error; dof: degrees of freedom of this error, infinite
    where it is known. Trial values are 0, with the prior probability ``ALIKE``, and ``APART``, uniform in the logarithm.
    """
    ratio = np.append(0.0, APART)
    prior = np.append(ALIKE, np.full(APART.size, (1.0 - ALIKE) / APART.size))
    logs = np.log(prior) - 0.5 * (m - 1) * np.log1p(ratio**2)
    rest = np.asarray(score)[..., None] / (1.0 + ratio**2)
    logs = logs - (0.5 * rest if math.isinf(dof) else 0.5 * (dof + m - 1) * np.log1p(rest / dof))
    share = np.exp(logs - logs.max(-1, keepdims=True))
    return ratio, share / share.sum(-1, keepdims=True)


class Between(NamedTuple):
    """Calibration of the widths of intervals that include the variation between m joined runs.

    The mixture over the unknown variation has the stated coverage on average over its prior. At a given variation it has
    more where the runs hardly differ, and where a parameter has other errors as large as that of the common factor (the
    sum of a normal and a wide t distribution: of two runs up to 98 or 100 %). So half widths are multiplied by exp(g), as
    those of ``Calibration``, with g a function of the logarithm of the score of ``shares_of_variation``.

    dof: as there; score: of the data; noise, variation (k, k): covariance of the noise alone, and of the error of one run's
    factor as a common factor.
    """

    m: int
    dof: float
    score: float
    noise: np.ndarray
    variation: np.ndarray

    def factors(self, directions: np.ndarray, level: float) -> np.ndarray:
        """Return the factors (q,) on half widths, at a level, of functions of the directions (k, q)."""
        noise, variation = (
            np.einsum("kq,kl,lq->q", directions, V, directions) for V in (self.noise, self.variation)
        )
        weight = 0.5 * np.log(np.clip(variation / np.maximum(noise, TINY), 1e-6, 1e6))
        found = [runs_calibrated(self.m, self.dof, level, round(w / WEIGHT_STEP)) for w in weight.tolist()]
        return np.exp([np.interp(math.log(max(self.score, TINY)), knots, g) for knots, g in found])


@functools.lru_cache(256)
def runs_calibrated(m: int, dof: float, level: float, weight: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the knots of the logarithm of the score, and g there, for a direction.

    weight: logarithm of the standard deviation of one run's error as a common factor over that of the noise, in units
    of ``WEIGHT_STEP``.
    """
    lam, true = math.exp(WEIGHT_STEP * weight), np.append(0.0, TRUE_VARIATIONS)
    # half widths of the mixture, over the standard deviation of the noise, for all scores
    scores = np.linspace(*SCORES)
    ratio, share = shares_of_variation(np.exp(scores), m, dof)
    variance = np.broadcast_to(1.0 + lam**2 * ratio**2, share.shape)[..., None]
    half = np.log(mixture_half_width(share, variance, level, dof, tabulated)[..., 0])
    # scores (r, u, s) for every true variation: chi-squared differences of runs, and a chi-squared estimate of the noise
    middles = lambda count: (np.arange(count) + 0.5) / count
    squares = special.chdtri(m - 1, middles(RUN_NODES))[:, None]
    estimate = np.ones(1) if math.isinf(dof) else special.chdtri(dof, middles(SIZE_NODES)) / dof
    score = np.log((1.0 + true[:, None, None] ** 2) * squares / estimate)
    spread = np.sqrt(1.0 + lam**2 * true**2)[:, None, None]
    half = np.exp(np.interp(score, scores, half)) * np.sqrt(estimate) / spread
    knots = np.log(m - 1) + np.linspace(*RUN_KNOTS)
    hats = np.stack([np.interp(score, knots, one) for one in np.eye(knots.size)], -1)

    def covered(g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        width = half * np.exp(hats @ g)
        inside, slope = share_and_slope(width, math.inf)
        return inside.mean((1, 2)), np.mean((width * slope)[..., None] * hats, (1, 2))

    z = two_sided(level)
    unit = ACCURACY * z * float(share_and_slope(np.array(z), math.inf)[1])
    return knots, nearest_coverage(covered, knots.size, level, unit)


def between_runs(found: Noise, runs: Runs, Q: np.ndarray, weighted: np.ndarray, order: np.ndarray) -> Noise:
    """Return the noise with a common factor of each run as a further random error.

    The standard deviation of the factors is unknown, and m runs determine it with m - 1 degrees of freedom only. The
    mixture goes over its values (``shares_of_variation``); where the runs differ by much more than their noise, the
    intervals become those of Student's t distribution with m - 1 degrees of freedom. ``Between`` makes their coverage as
    nearly the stated one as possible for every variation. Q (n, k): the basis in which the variance of the noise is given,
    of the points in ``order`` (n,); weighted (n,): as in ``compared``.
    """
    m = runs.factors.size
    score = float(np.sum((runs.factors / runs.error) ** 2))
    ratio, share = shares_of_variation(np.array(score), m, found.dof)
    directions = np.stack([Q.T @ np.where(runs.labels == r, weighted, 0.0)[order] for r in range(m)], -1)
    more = runs.error**2 * directions @ directions.T
    both = share[:, None] * found.share
    variance = found.variance + ratio[:, None, None, None] ** 2 * more
    kept = both > NEGLIGIBLE * both.max()
    mean = np.einsum("m,mkl->kl", found.share, found.variance)
    return found._replace(
        share=both[kept] / both[kept].sum(), variance=variance[kept], runs=runs,
        between=Between(m, found.dof, score, mean, more),
    )  # fmt: skip


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
