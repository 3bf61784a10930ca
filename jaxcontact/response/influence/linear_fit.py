"""Linear least squares whose matrix carries no derivative, so that solutions are linear in what is fitted.

Many matrices (under ``jax.vmap``) are decomposed one after the other: jaxlib spreads a batch of decompositions over
the threads that run the program and waits for them in one of those, so that two batches at once on two cores wait for
each other for ever (jaxlib 0.10.1).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jax.custom_batching import sequential_vmap


class Decomposition(NamedTuple):
    """matrix = left diag(values) right: left (n, m), values (m,) from the largest, right (m, m)."""

    left: Array
    values: Array
    right: Array

    def truncated(self, target: Array, cutoff: float) -> Array:
        """The least x (..., m) for least |matrix x - target|, targets (..., n).

        Singular values less than ``cutoff`` of the largest are left out.
        """
        kept = self.values > cutoff * self.values[0]
        return (
            jnp.where(kept, 1.0 / jnp.where(kept, self.values, 1.0), 0.0) * (target @ self.left) @ self.right
        )

    def normal(self, target: Array, cutoff: float) -> Array:
        """The x (m,) with matrix^T matrix x = target (m,), less what ``truncated`` leaves out."""
        kept = self.values > cutoff * self.values[0]
        return (
            jnp.where(kept, 1.0 / jnp.where(kept, self.values, 1.0), 0.0) ** 2 * (self.right @ target)
        ) @ self.right

    def damped(self, target: Array, damping: float) -> Array:
        """The x (..., m) for least |matrix x - target|^2 + damping^2 |x|^2, targets (..., n)."""
        return self.values / (self.values**2 + damping**2) * (target @ self.left) @ self.right


def decomposed(matrix: Array) -> Decomposition:
    """Of a matrix (n, m), n >= m."""
    return _one_by_one(jax.lax.stop_gradient(matrix))


@sequential_vmap
def _one_by_one(matrix: Array) -> Decomposition:
    return Decomposition(*jnp.linalg.svd(matrix, full_matrices=False))
