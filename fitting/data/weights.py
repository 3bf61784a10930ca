"""Weights of the data points, given, assumed, or estimated from the data; and least squares with values >= 0.

An estimated error has the variance a^2 + (b y)^2: readings near zero have the noise a of the instrument, large ones an
error proportional to their value. a/b maximises the likelihood of the deviations of four successive points from a
parabola under Student's t distribution, which is robust against outliers; it does not depend on the model to be fitted.
A fit begins with these weights and then updates them from its residuals (``inference/sample.py``). b follows from the
residuals of the fit. Proportional weights begin with the measured values, and become those of the fitted ones in the same
way; relative weights remain those of the measured values.
"""

from typing import Any

import numpy as np
import scipy

from jaxcontact._support.pytree import require_real

KINDS = ("estimated", "proportional", "relative", "absolute")
RATIOS = np.append(0.0, np.geomspace(1e-6, 10.0, 57))  # trial values of a/b over the largest value
TAILS = 3.0  # degrees of freedom of Student's t
SCALES = 20  # iterations for its scale
FAR = 1e30  # ratio of a standard deviation and the largest value, either way, beyond which no number is meant
FEW = 8  # number of differences below which nothing is estimated
MANY = 5000  # number of differences above which no more are used: they give the first weights, which the fit improves


def choose_weights(
    t: np.ndarray, y: np.ndarray, weights: str | None, sigma: Any, scatter: Any = None
) -> tuple[np.ndarray, str]:
    """Return weights (n,) [1/unit of y] of values y (n,) at t (n,), and their label; ValueError unless one choice is
    made.

    scatter (n,): standard deviations up to a factor, used if nothing else is chosen.
    """
    if weights is None and sigma is None and scatter is not None:
        return 1.0 / scatter, "averaged"
    weights = check_weights(weights, sigma)
    if sigma is not None:
        require_real("sigma", sigma)
        if np.shape(sigma) not in ((), y.shape):
            raise ValueError(f"sigma: expected a number or {y.size} values, got shape {np.shape(sigma)}")
        try:
            spread = np.broadcast_to(np.asarray(sigma, dtype=float), y.shape)
        except (TypeError, ValueError):
            raise ValueError(f"sigma: expected a number or {y.size} values, got {sigma!r}") from None
        if not np.all(np.isfinite(spread) & (spread > 0)):
            raise ValueError("sigma: expected finite values > 0")
        size = float(np.max(np.abs(y)))
        if size > 0.0 and not np.all((spread > size / FAR) & (spread < size * FAR)):
            raise ValueError(
                f"sigma: expected standard deviations in the unit of the data, whose largest value is {size:.3g}, got"
                f" {spread.min():.3g} to {spread.max():.3g}"
            )
        return 1.0 / spread, "sigma"
    if weights == "estimated":
        return 1.0 / np.hypot(error_ratio(t, y), y), weights
    if weights in ("proportional", "relative"):
        if np.any(y <= 0):
            raise ValueError(f'weights: "{weights}" needs data > 0; take "estimated", "absolute" or sigma')
        return 1.0 / y, weights
    return np.full(y.shape, 1.0 / np.max(np.abs(y))), "absolute"


def check_weights(weights: str | None, sigma: Any, kinds: tuple[str, ...] = KINDS) -> str | None:
    """Return the kind of weights in lower case, None with a sigma; ValueError unless one choice is made, of these kinds."""
    known = f"weights: expected one of {', '.join(kinds)}"
    if weights is not None and not isinstance(weights, str):
        kind = type(weights).__name__
        raise ValueError(f"{known}, got {kind}: sigma= takes standard deviations, weights are 1/sigma")
    if (weights is None) == (sigma is None):
        raise ValueError(f"{known}, or sigma=...; got both or none")
    if weights is not None and weights.lower() not in kinds:
        raise ValueError(f"{known}, got {weights!r}")
    return None if weights is None else weights.lower()


def error_ratio(t: np.ndarray, y: np.ndarray) -> float:
    """Return a/b [unit of y], > 0 where values are zero; the largest value where there are too few points."""
    size = float(np.max(np.abs(y)))
    if y.size > MANY:  # groups of neighbours, as far apart as leaves ``MANY`` differences
        starts = np.linspace(0, y.size - 4, MANY).astype(int)
        groups = starts[:, None] + np.arange(4)
        rough, level = of_groups(t[groups], y[groups] / size)
    else:
        rough, level = differences(t, y / size)
    if rough.size < FEW or not np.any(rough):
        return size
    ratios = RATIOS[RATIOS > 0] if np.any(np.abs(y) <= 1e-12 * size) else RATIOS

    # The log likelihood (k,) of the differences under Student's t for each ratio, up to a constant, at the best scale of the
    # standard deviations (k, m), by fixed-point iteration of the likelihood equation.
    shape = np.hypot(ratios[:, None], level)
    square = (rough / np.maximum(shape, 1e-300)) ** 2
    scale = np.median(square, 1, keepdims=True) + 1e-300
    for _ in range(SCALES):
        scale = np.mean((TAILS + 1.0) * square / (TAILS + square / scale), 1, keepdims=True) + 1e-300
    terms = 0.5 * (TAILS + 1.0) * np.log1p(square / (TAILS * scale)) + np.log(shape) + 0.5 * np.log(scale)
    return size * float(ratios[np.argmax(-np.sum(terms, 1))])


def differences(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return third divided differences of unit norm and the mean |y| of their points, both (m,), skipping equal times."""
    windows = np.lib.stride_tricks.sliding_window_view
    return of_groups(windows(t, 4), windows(y, 4))


def of_groups(x: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return these of groups (m, 4) of neighbouring points."""
    apart = np.all(np.diff(x, axis=1) > 0, axis=1)
    x, values = x[apart], values[apart]
    gaps = x[:, :, None] - x[:, None, :] + np.eye(4) * np.ptp(x, axis=1)[:, None, None]
    weight = 1.0 / np.prod(gaps, -1)
    weight /= np.linalg.norm(weight, axis=1)[:, None]
    return np.sum(weight * values, 1), np.mean(np.abs(values), 1)


MOST = 50  # iterations of the method of Lawson and Hanson, times the number of columns


def nonnegative(A: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return x (k,) >= 0 of least |A x - y|, A (n, k).

    The method of C. L. Lawson and R. J. Hanson (Solving Least Squares Problems, 1974) may cycle where columns are nearly
    alike; the method of R. J. Stark and P. L. Parker (bounded variables, Comput. Stat. 10 (1995) 129), which starts from the
    solution without bounds, then takes its place.
    """
    try:
        return np.asarray(scipy.optimize.nnls(A, y, maxiter=MOST * A.shape[1])[0])
    except RuntimeError:
        most = MOST * A.shape[1]
        found = scipy.optimize.lsq_linear(A, y, bounds=(0.0, np.inf), method="bvls", tol=1e-14, max_iter=most)
        return np.maximum(found.x, 0.0)
