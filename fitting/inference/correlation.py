"""AR(1) noise in blocks of data: quadratic forms with its correlation matrix for a grid of rho, and lag-1 correlations.

The correlation matrix V has V_ij = rho^|i - j| within a block (a segment of a test, G' or G'', one of several curves)
and 0 between blocks. Blocks are consecutive points with equal labels, (n,) integers.
"""

import math

import numpy as np
import scipy

from fitting.search.uncertainty import ROUNDING

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
    near = turned[..., 1:][..., same] @ M[..., :-1, :][..., same, :]
    rho = RHO[:, None, None]
    inner = (1.0 + rho**2) * (turned @ M)[..., None, :, :]
    inner = inner - rho * (near + np.swapaxes(near, -1, -2))[..., None, :, :]
    return (inner - rho**2 * ((turned * ends) @ M)[..., None, :, :]) / (1.0 - rho**2)


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


def log_determinant(blocks: np.ndarray) -> np.ndarray:
    """Return log |V| for every RHO, (k,)."""
    return np.sum(within(blocks)) * np.log1p(-(RHO**2))
