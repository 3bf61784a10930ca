"""Preconditioned conjugate gradients for a linear system K x = b, K symmetric and positive on where b lives."""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.reductions import total
from jaxcontact.operators.base import Linear


def conjugate_gradients(
    operator: Linear, inverse: Linear, b: Array, reduction: Array | float, limit: Array | int
) -> tuple[Array, Array, Array]:
    """Solve operator(x) = b from zero; return x, the iterations taken, and whether the reduction is met.

    ``inverse``: the preconditioner; ``reduction``: of sqrt(<r, inverse r>); an iteration applies both once. A direction in
    which the operator is not positive ends the iterations, and the reduction is not met then.
    Source: M. R. Hestenes, E. Stiefel, J. Res. Natl. Bur. Stand. 49 (1952) 409.
    """
    z = inverse(b)
    descent = total(b * z)
    goal = reduction**2 * descent

    def step(state):
        x, r, direction, descent, count = state
        lifted = operator(direction)
        curvature = total(direction * lifted)
        size = descent / jnp.where(curvature > 0.0, curvature, 1.0)
        x, r = x + size * direction, r - size * lifted
        z = inverse(r)
        new = jnp.where(curvature > 0.0, total(r * z), jnp.nan)
        return x, r, z + (new / descent) * direction, new, count + 1

    going = lambda state: (state[3] > goal) & (state[4] < limit)
    first = jnp.zeros_like(b), b, z, descent, jnp.zeros((), int)
    x, _, _, descent, count = jax.lax.while_loop(going, step, first)
    return x, count, descent <= goal
