"""Linear least squares whose matrix carries no derivative, so that solutions are linear in the target.

A batch of matrices (under ``jax.vmap``) is decomposed one after the other: jaxlib distributes a batch of decompositions
over the threads that run the program and waits for them in one of those threads, so that two simultaneous batches on two
cores deadlock (jaxlib 0.10.1).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jax.custom_batching import sequential_vmap


class Decomposition(NamedTuple):
    """A singular value decomposition, matrix = left diag(values) right.

    left (n, m), values (m,) in descending order, right (m, m).
    """

    left: Array
    values: Array
    right: Array

    def truncated(self, target: Array, cutoff: float) -> Array:
        """Return the x (..., m) of least norm that minimises |matrix x - target|, targets (..., n).

        Singular values below ``cutoff`` times the largest are discarded.
        """
        kept = self.values > cutoff * self.values[0]
        return (
            jnp.where(kept, 1.0 / jnp.where(kept, self.values, 1.0), 0.0) * (target @ self.left) @ self.right
        )

    def normal(self, target: Array, cutoff: float) -> Array:
        """Return the x (m,) with matrix^T matrix x = target (m,), without the components that ``truncated`` discards."""
        kept = self.values > cutoff * self.values[0]
        return (
            jnp.where(kept, 1.0 / jnp.where(kept, self.values, 1.0), 0.0) ** 2 * (self.right @ target)
        ) @ self.right

    def damped(self, target: Array, damping: float) -> Array:
        """Return the x (..., m) that minimises |matrix x - target|^2 + damping^2 |x|^2, targets (..., n)."""
        return self.values / (self.values**2 + damping**2) * (target @ self.left) @ self.right


def decomposed(matrix: Array) -> Decomposition:
    """Return the decomposition of a matrix (n, m), n >= m."""
    return _one_by_one(jax.lax.stop_gradient(matrix))


@sequential_vmap
def _one_by_one(matrix: Array) -> Decomposition:
    return Decomposition(*jnp.linalg.svd(matrix, full_matrices=False))
