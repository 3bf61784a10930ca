"""Padding of arrays to a few lengths, so that another number of points does not trigger a new compilation.

A padded point repeats the last time and has zero weight.
"""

import numpy as np

LEAST = 32


def length(n: int) -> int:
    """Return the smallest of 32, 48, 64, 96, 128, 192 ... that is at least n."""
    size = LEAST
    while size < n:
        size *= 2
    return 3 * size // 4 if size > LEAST and n <= 3 * size // 4 else size


def repeated(values: np.ndarray) -> np.ndarray:
    """Return values (n,) padded with the last of them."""
    return np.pad(values, (0, length(values.size) - values.size), mode="edge")


def without_weight(weights: np.ndarray) -> np.ndarray:
    """Return weights (n,) padded with zeros."""
    return np.pad(weights, (0, length(weights.size) - weights.size))
