"""Test of the residuals of several curves for a shape that they have in common.

A model that lacks an effect (an induction time, a drift, a wrong probe) leaves residuals of the same shape in every curve.
Each curve alone may hide it in its noise, and the correlation of neighbouring residuals may be as small as chance leaves
it; summed over the curves the shape remains, while the noise averages out.

The shape is a polynomial in the abscissa with equal coefficients in all curves, in units of the weighted residuals. It is
made orthogonal to the Jacobian of the fit, and its coefficients are compared with zero by an F test. Where the noise is
white, the denominator is the variance of the residuals that remain. Where it is correlated, the denominator is the variance
of the coefficients among the curves, which the correlation increases as it does that of their sum.
"""

import numpy as np
from scipy import special

CHANCE = 1e-3  # probability that noise alone has a common shape
DEGREES = 5  # of the polynomial, beside the constant
FLAT = 1e-8  # part of a column outside the Jacobian below which it is rounding


def common_shape(
    residual: np.ndarray, jacobian: np.ndarray, curve: np.ndarray, x: np.ndarray, white: bool = True
) -> tuple[float, np.ndarray]:
    """Return the probability that noise alone has a common shape as large, and the shape (n,) in the residuals.

    The probability is 1 with a single curve, or where too few points are left to judge.

    Args:
        residual: (n,) weighted residuals of all curves.
        jacobian: (n, k) derivatives of the residuals with respect to the fitted coordinates.
        curve: (n,) integers, equal for points of one curve.
        x: (n,) abscissa, which is scaled to -1 .. 1 over all curves; a logarithm where the curves cover decades.
        white: whether the noise of neighbouring points is independent.
    """
    labels, place = np.unique(curve, return_inverse=True)
    nothing = 1.0, np.zeros(residual.size)
    span = float(np.ptp(x))
    if labels.size < 2 or span == 0.0:
        return nothing
    Q = np.linalg.qr(jacobian[:, np.any(jacobian != 0.0, axis=0)])[0]
    outside = lambda A: A - Q @ (Q.T @ A)
    shapes = np.polynomial.legendre.legvander(2.0 * (x - x.min()) / span - 1.0, DEGREES)
    U, s, _ = np.linalg.svd(outside(shapes), full_matrices=False)
    U = U[:, s > FLAT * max(float(s[0]), FLAT * float(np.linalg.norm(shapes)))]
    q = U.shape[1]
    shape = U @ (U.T @ residual)
    rise = float(shape @ shape)
    if white:
        dof = residual.size - Q.shape[1] - q
        left = float(residual @ residual) - rise
    else:
        # each curve with coefficients of its own: what they explain beyond the common ones
        own = np.concatenate([shapes * (place == k)[:, None] for k in range(labels.size)], axis=1)
        V, s, _ = np.linalg.svd(outside(own), full_matrices=False)
        V = V[:, s > FLAT * max(float(s[0]), FLAT * float(np.linalg.norm(own)))]
        dof = V.shape[1] - q
        left = float(np.sum((V.T @ residual) ** 2)) - rise
    if q == 0 or dof < 1:
        return nothing
    return float(special.fdtrc(q, dof, rise / q * dof / max(left, 1e-300))), shape


def reason(
    residual: np.ndarray, jacobian: np.ndarray, curve: np.ndarray, x: np.ndarray, white: bool = True
) -> tuple[str, ...]:
    """Return the reason for rejecting a fit whose curves have residuals of a common shape, () if they have none; arguments
    as of ``common_shape``."""
    chance, shape = common_shape(residual, jacobian, curve, x, white)
    if not chance < CHANCE:
        return ()
    share = float(np.sqrt(np.sum(shape**2) / np.sum(residual**2)))
    return (
        f"the residuals of the {np.unique(curve).size} curves have a common shape, {100 * share:.2g} % of them in size,"
        f" which noise has with a probability of {chance:.1g}: the model lacks an effect that all curves show",
    )
