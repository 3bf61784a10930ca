"""Images as samples of independent values: means over blocks of pixels, and the variance of their noise.

Neighbouring pixels of a blurred or interpolated image are correlated, and as many values as pixels would make intervals
too short. The residuals of a first fit are averaged over blocks of b x b pixels, with the least b for which neighbouring
blocks are correlated by no more than ``ALLOWED``; what correlation is left along x raises the variance by 1 + 2 rho, and
that along y is taken into account as in any series (``noise.py``). The variance of a block mean is estimated from the
residuals of all blocks of the field, so that it holds whatever the correlation within the blocks. Frames of different
times are taken as independent.

The likelihood of a contact image is that of Bernoulli variables of probability P: its score is that of weighted residuals
(y - P)/sqrt(P (1 - P)), and the iteration on the weights converges to the estimate of maximum likelihood (P. McCullagh,
J. A. Nelder, Generalized Linear Models, 1989, sec. 2.5 and 9.2). A factor on the variance, estimated too, accounts for
correlated errors.
"""

from typing import NamedTuple

import numpy as np

ALLOWED = 0.12  # correlation of neighbouring blocks
SIZES = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32)
MOST = 16384  # blocks per field
LEAST = 64  # blocks per field, if it has so many pixels
SURE = 2.5  # standard errors of a correlation below which it is chance
SMALL = 1e-12


class Blocks(NamedTuple):
    """The blocks of a field: size b; kept (nt, mx, my) bool: those whose pixels are all measured; inflation: factor on the
    variance for the correlation along x."""

    size: int
    kept: np.ndarray
    inflation: float = 1.0

    @classmethod
    def of(cls, known: np.ndarray, size: int) -> "Blocks":
        """Return the blocks of pixels known (nt, nx, ny) bool."""
        return cls(size, _means(known.astype(float), size) == 1.0)

    def means(self, values: np.ndarray) -> np.ndarray:
        """Return the means (..., n) over the blocks that are kept, of values (..., nt, nx, ny)."""
        return _means(values, self.size)[..., self.kept]

    def lines(self) -> np.ndarray:
        """Return labels (n,), equal for the blocks of a line along y of a frame."""
        return np.broadcast_to(
            np.arange(self.kept[..., 0].size).reshape(*self.kept.shape[:2], 1), self.kept.shape
        )[self.kept]


def _means(values: np.ndarray, size: int) -> np.ndarray:
    """Return means over size x size pixels of values (..., nx, ny); incomplete blocks at the end are left out."""
    nx, ny = (n // size for n in values.shape[-2:])
    cut = values[..., : nx * size, : ny * size]
    return cut.reshape(*values.shape[:-2], nx, size, ny, size).mean((-3, -1))


def least_size(known: np.ndarray) -> int:
    """Return the size of blocks that leaves no more than ``MOST`` of them."""
    return next(size for size in SIZES if known.sum() <= MOST * size**2 or size == SIZES[-1])


def chosen(residual: np.ndarray, known: np.ndarray) -> Blocks:
    """Return the least blocks whose means are hardly correlated, from standardised residuals (nt, nx, ny) of pixels."""
    filled, least = np.where(known, residual, 0.0), least_size(known)
    for size in (size for size in SIZES if size >= least):
        blocks = Blocks.of(known, size)
        along_x, along_y = (_neighbours(_means(filled, size), blocks.kept, axis) for axis in (1, 2))
        allowed = max(ALLOWED, SURE / np.sqrt(max(blocks.kept.sum(), 1)))
        last = known.sum() < LEAST * (size + 1) ** 2
        if max(along_x, along_y) <= allowed or last:
            break
    return blocks._replace(inflation=1.0 + 2.0 * max(along_x, 0.0))


def _neighbours(values: np.ndarray, kept: np.ndarray, axis: int) -> float:
    """Return the correlation of neighbours along an axis of values (nt, mx, my)."""
    a, on = np.moveaxis(values, axis, 0), np.moveaxis(kept, axis, 0)
    both = on[1:] & on[:-1]
    total = float(np.mean(values[kept] ** 2)) if kept.any() else 0.0
    return float(np.mean((a[1:] * a[:-1])[both])) / total if total > 0 and both.any() else 0.0


def deviations(kind: str, residual: np.ndarray, shape: np.ndarray, fitted: np.ndarray) -> np.ndarray:
    """Return standard deviations (n,) of values from their residuals (n,).

    kind: "constant" up to ``shape`` (n,), or "estimated", (a^2 + b^2 fitted^2)^(1/2).
    """
    square = residual**2
    if kind == "estimated":
        shape = _mixed(square, fitted**2)
    return shape * np.sqrt(max(float(np.mean(square / shape**2)), SMALL**2))


def _mixed(square: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Return (a^2 + b^2 level)^(1/2), (n,), a and b >= 0 by iterated weighted least squares of squared residuals (n,)."""
    variance = np.full(square.size, square.mean() + SMALL)
    for _ in range(8):
        columns = np.stack([np.ones(level.size), level], -1) / variance[:, None]
        a, b = np.linalg.lstsq(columns, square / variance, rcond=None)[0]
        a, b = (0.0, np.sum(square) / np.sum(level)) if a <= 0 else (a, b) if b >= 0 else (square.mean(), 0.0)
        variance = np.maximum(a + b * level, 1e-6 * square.mean() + SMALL**2)
    return np.sqrt(variance)
