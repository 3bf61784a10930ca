"""How much each point counts: the error that is taken for granted in a fit."""

from typing import Any

import numpy as np


def choose_weights(y: np.ndarray, weights: str | None, sigma: Any) -> tuple[np.ndarray, str]:
    """Weights (n,) [1/unit of y] and their label; ValueError unless exactly one choice is made."""
    if (weights is None) == (sigma is None):
        raise ValueError('weights: choose "relative", "absolute" or sigma=...; the choice decides the answer')
    if sigma is not None:
        spread = np.broadcast_to(np.asarray(sigma, dtype=float), y.shape)
        if not np.all(np.isfinite(spread) & (spread > 0)):
            raise ValueError("sigma: expected finite values > 0")
        return 1.0 / spread, "sigma"
    if weights == "relative":
        if np.any(y <= 0):
            raise ValueError("weights: relative weights need data > 0; use absolute weights or sigma")
        return 1.0 / y, weights
    if weights == "absolute":
        return np.full(y.shape, 1.0 / np.max(np.abs(y))), weights
    raise ValueError(f'weights: expected "relative" or "absolute", got {weights!r}')
