"""The paper's conversion of a response function to influence coefficients (its Eqs. 7-10, Table 1).

The continuous transform of the coefficients is the response N times the transform of a unit cell,

    C~(m, n) = N(m, n) Y(m, n),       Y = 4 sin(m dx/2) sin(n dy/2)/(m n),

sampled on chi times more cells than the grid has (same dx), summed over aliases,

    C^(m_i, n_j) = 1/(dx dy) sum_{rx, ry = -AL}^{AL} C~(m_i - 2 pi rx/dx, n_j - 2 pi ry/dy),

with the mean of N over the cell around the origin, by 64-point Gauss quadrature, in place of its
infinite value there; then transformed back, taking the real part of the central part. The sum must be truncated
at AL, and the domain of chi cells is periodic: with chi = 16, AL = 2 the error is 0.2 to
2 % in the central coefficient and 4 % in the far field. This is a reference for the solver's faster method, which does
not use it.
"""

from collections.abc import Callable

import numpy as np

Response = Callable[[np.ndarray], np.ndarray]
"""A function of alpha (any shape) [rad/m] that returns alpha N [1/Pa]."""


def coefficients(
    scaled_response: Response,
    shape: tuple[int, int],
    spacing: tuple[float, float],
    *,
    chi: int = 16,
    aliases: int = 2,
) -> np.ndarray:
    """Return the influence coefficients [m/Pa] at offsets (i, j) >= 0, (nx, ny).

    chi: extension factor, a power of 2 (the paper: 16); aliases: AL (not given in the paper).
    """
    (nx, ny), (dx, dy) = shape, spacing
    m = 2.0 * np.pi * np.fft.fftfreq(chi * nx, dx)
    n = 2.0 * np.pi * np.fft.fftfreq(chi * ny, dy)
    total = np.zeros((m.size, n.size))
    for rx in range(-aliases, aliases + 1):
        for ry in range(-aliases, aliases + 1):
            shifted_m = m[:, None] - 2.0 * np.pi * rx / dx
            shifted_n = n[None, :] - 2.0 * np.pi * ry / dy
            total += _cell_transform(scaled_response, shifted_m, shifted_n, spacing)
    total[0, 0] = _origin(scaled_response, m[1], n[1]) * dx * dy + total[0, 0]
    return np.fft.ifft2(total / (dx * dy)).real[:nx, :ny]


def _cell_transform(
    respond: Response, m: np.ndarray, n: np.ndarray, spacing: tuple[float, float]
) -> np.ndarray:
    """Return N Y, with zero at the origin."""
    alpha = np.hypot(m, n)
    at_origin = alpha == 0.0
    safe = np.where(at_origin, 1.0, alpha)
    Y = (
        spacing[0]
        * spacing[1]
        * np.sinc(m * spacing[0] / (2 * np.pi))
        * np.sinc(n * spacing[1] / (2 * np.pi))
    )
    return np.where(at_origin, 0.0, respond(safe) / safe * Y)


def _origin(respond: Response, dm: float, dn: float) -> float:
    """Return the mean of N over |m| < dm/2, |n| < dn/2 by 8 x 8 Gauss points."""
    points, weights = np.polynomial.legendre.leggauss(8)
    m, n = np.meshgrid(points * dm / 2.0, points * dn / 2.0, indexing="ij")
    alpha = np.hypot(m, n)
    return float(np.sum(np.outer(weights, weights) * respond(alpha) / alpha) / 4.0)
