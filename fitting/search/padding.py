"""Arrays padded to a few lengths, so that another number of points does not compile again.

A padded point repeats the last time and has no weight.
"""

import numpy as np

LEAST = 32


def length(n: int) -> int:
    """The least of 32, 48, 64, 96, 128, 192 ... that holds n."""
    size = LEAST
    while size < n:
        size *= 2
    return 3 * size // 4 if size > LEAST and n <= 3 * size // 4 else size


def repeated(values: np.ndarray) -> np.ndarray:
    """Values (n,) and the last of them again, up to the padded length."""
    return np.pad(values, (0, length(values.size) - values.size), mode="edge")


def without_weight(weights: np.ndarray) -> np.ndarray:
    """Weights (n,) and zeros."""
    return np.pad(weights, (0, length(weights.size) - weights.size))
