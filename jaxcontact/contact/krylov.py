"""Krylov methods for the linear systems of a contact.

Conjugate gradients for K x = b, K symmetric and positive on the cells where b lives; BiCGSTAB for a K that is not symmetric.
Operators and preconditioners are functions of fields, projected by the caller onto the cells and the mean that may change.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.reductions import total
from jaxcontact.operators.operator import Linear


class Minimum(NamedTuple):
    """A result of ``conjugate_gradients``.

    x; image: of it, as the operator returns for a direction; iterations (); met: whether ``goal`` is met; bent: whether the
    search ended in a direction of negative curvature; goal: the value of <r, inverse r> that was to be reached.
    """

    x: Array
    image: Any
    iterations: Array
    met: Array
    bent: Array
    goal: Array


def conjugate_gradients(
    operator: Callable[[Array], tuple[Array, Any]],
    inverse: Linear,
    b: Array,
    reduction: Array | float,
    limit: Array | int,
    *,
    goal: Array | float = 0.0,
    enough: Array | None = None,
    reach: Array | None = None,
) -> Minimum:
    """Solve K x = b from x = 0: the minimum of <x, K x>/2 - <b, x>.

    Source: M. R. Hestenes, E. Stiefel, J. Res. Natl. Bur. Stand. 49 (1952) 409; in a direction of negative curvature:
    J. Nocedal, S. J. Wright, Numerical Optimization, 2006, section 7.1.

    Args:
        operator: a direction d -> K d, and any further image of d, linear in it, whose value for x is wanted, or None.
        inverse: the preconditioner, r -> z. An iteration applies both once.
        reduction: of the norm sqrt(<r, z>).
        limit: the largest number of iterations; there is one at least if it is not zero.
        goal: the value of <r, z> to reach instead of that by ``reduction``, where it is positive.
        enough: the largest |z| at which the iterations stop in any case.
        reach: how far to go, at most at any cell, in a direction of negative curvature, which ends the iterations; not at
            all without it.
    """
    z = inverse(b)
    descent = total(b * z)
    goal = jnp.where(jnp.asarray(goal) > 0.0, goal, reduction**2 * descent)

    def step(state: tuple[Any, ...]) -> tuple[Any, ...]:
        x, image, r, direction, descent, count, _, _ = state
        product, also = operator(direction)
        curvature = total(direction * product)
        bent = curvature <= 0.0
        # the least of the parabola along the direction, or as far as it may go where there is none
        size = descent / jnp.where(bent, 1.0, curvature)
        size = jnp.where(bent, 0.0 if reach is None else reach / jnp.max(jnp.abs(direction)), size)
        x, image = jax.tree.map(lambda sum_, part: sum_ + size * part, (x, image), (direction, also))
        r = r - size * product
        z = inverse(r)
        new = total(r * z)
        # conjugate to all directions before it
        direction = z + (new / jnp.where(descent > 0.0, descent, 1.0)) * direction
        going = ~bent & (new > goal) & (count + 1 < limit)
        if enough is not None:
            going = going & (jnp.max(jnp.abs(z)) > enough)
        return x, image, r, direction, new, count + 1, bent, going

    zero = jnp.zeros_like(b)
    nothing = jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), jax.eval_shape(operator, b)[1])
    start = (
        zero,
        nothing,
        b,
        z,
        descent,
        jnp.zeros((), int),
        jnp.asarray(False),
        (descent > 0.0) & (limit > 0),
    )
    x, image, _, _, descent, count, bent, _ = jax.lax.while_loop(lambda state: state[-1], step, start)
    return Minimum(x, image, count, (descent <= goal) & ~bent, bent, goal)


def bicgstab(
    operator: Linear, inverse: Linear, b: Array, reduction: Array | float, limit: Array | int
) -> tuple[Array, Array, Array]:
    """Return x with operator(x) = b to a relative residual, the iterations taken, and whether the reduction is met.

    The preconditioner acts from the right; an iteration applies each of both twice.
    Source: H. A. van der Vorst, SIAM J. Sci. Stat. Comput. 13 (1992) 631, with b as the shadow residual.
    """
    goal, zero, one = reduction**2 * jnp.sum(b**2), jnp.zeros_like(b), jnp.ones(())
    safe = lambda value: jnp.where(value == 0.0, 1.0, value)

    def going(state: tuple[Array, ...]) -> Array:
        _, r, _, _, rho, _, omega, count = state
        return (jnp.sum(r**2) > goal) & (count < limit) & (rho != 0.0) & (omega != 0.0)

    def step(state: tuple[Array, ...]) -> tuple[Array, ...]:
        x, r, d, v, before, size, omega, count = state
        # the direction of biconjugate gradients, and the step along it after which r is orthogonal to b
        rho = jnp.sum(b * r)
        d = r + (rho / before) * (size / omega) * (d - omega * v)
        direction = inverse(d)
        v = operator(direction)
        size = rho / safe(jnp.sum(b * v))
        half = r - size * v
        # one step of least residual from there
        correction = inverse(half)
        t = operator(correction)
        omega = jnp.sum(t * half) / safe(jnp.sum(t**2))
        x = x + size * direction + omega * correction
        return x, half - omega * t, d, v, rho, size, omega, count + 1

    start = zero, b, zero, zero, one, one, one, jnp.zeros((), int)
    x, r, *_, count = jax.lax.while_loop(going, step, start)
    return x, count, jnp.sum(r**2) <= goal
