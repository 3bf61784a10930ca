"""The tangential contact problem at a given pressure: Coulomb friction, by Newton's method on sets of stick and slip.

In a step the surface slips over the indenter by

    s = K_tt q + drift - shift,

drift: what all but q has moved it by since the last step, shift: the indenter's own step. Coulomb's law with the
bound b = friction coefficient x pressure,

    |q| <= b,      s = 0 where |q| < b,      s = -k q, k >= 0, where |q| = b,

is the optimality of 1/2 <q, K_tt q> + <drift - shift, q> on discs, a convex problem (P. D. Panagiotopoulos, Ing.
Arch. 44 (1975) 421). The shift is given, or the sum of the tractions is, and the shift its multiplier.

The law is q = clip(q - s/c) on the discs, for any c > 0. Each pass takes the cells on the rim that this would clip as
slipping, with tractions that may turn but not grow, and all others in contact as sticking, solves the linearised problem

    P (K_tt + k) P dq = -P s,      P: the free directions, and under a given sum their zero-sum part,

by preconditioned conjugate gradients to a fraction, and clips the tractions to their discs. The term k, the slip over
the bound, comes from the curvature of the rim. It converges in 5 to 10 passes where projected gradients take hundreds of
steps (Cattaneo and Mindlin at 256 x 256: 373). Source: derived here as a semismooth Newton method (as for contact: S.
Hueeber, G. Stadler, B. Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572).

The stopping error is dimensionless: sum(b |s| + q . s)/sum b, zero if and only if the law holds, over a mean
displacement; and the missing part of a given sum over sum b.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._pytree import pytree, static
from jaxcontact.contact.linear import conjugate_gradients
from jaxcontact.operators.base import Linear, TractionOperator

REDUCTION = 0.1  # of the residual, by the linear solve on one division into sets
INNER = 20  # most of its iterations
SLIPS = 1e-12  # of the bound: a traction that misses less is as large as it may be
NEAR = 0.99  # of the bound: farther from it no cell is taken to slip
LEAST = 1e-12  # free directions, in parts of their number: fewer are none


@pytree
class TangentialProblem:
    """A step to be solved, all of order one.

    operator; bound (nx, ny); drift (2, nx, ny); target (2,): sum of the tractions, or the shift.
    """

    operator: TractionOperator
    bound: Array
    drift: Array
    target: Array
    load_controlled: bool = static()


@pytree
class TangentialSolution:
    """traction, displacement (of K_tt q alone), slip: (2, nx, ny); stick (nx, ny); shift (2,); error (); iterations ()."""

    traction: Array
    displacement: Array
    slip: Array
    stick: Array
    shift: Array
    error: Array
    iterations: Array


class FreeDirections(NamedTuple):
    """Where tractions may go: contact (nx, ny); slips (nx, ny); normal (2, nx, ny) of the discs, zero where the cell
    sticks; curvature k (nx, ny); load_controlled: whether their sum is held."""

    contact: Array
    slips: Array
    normal: Array
    curvature: Array
    load_controlled: bool

    def along(self, v: Array) -> Array:
        """v without what leads out of the discs, zero off contact."""
        return jnp.where(self.contact, v - jnp.sum(v * self.normal, 0) * self.normal, 0.0)

    def push(self, total: Array) -> Array:
        """The vector (2,) which, the same on all cells, makes free tractions of this sum; zero if none are free."""
        x, y = self.normal
        cells = jnp.sum(self.contact)
        xx, yy, xy = cells - jnp.sum(x**2), cells - jnp.sum(y**2), -jnp.sum(x * y)
        least = LEAST * (xx + yy)
        xx, yy = jnp.where(cells > 0, xx + least, 1.0), jnp.where(cells > 0, yy + least, 1.0)
        det = xx * yy - xy**2
        push = jnp.stack([yy * total[0] - xy * total[1], xx * total[1] - xy * total[0]])
        return push / jnp.where(det > 0.0, det, jnp.inf)

    def uniform(self, total: Array) -> Array:
        """Those tractions."""
        return self.along(jnp.broadcast_to(self.push(total)[:, None, None], self.normal.shape))

    def __call__(self, v: Array) -> Array:
        """The projection P of the module's formulas."""
        v = self.along(v)
        return v - self.uniform(jnp.sum(v, (1, 2))) if self.load_controlled else v


def length(v: Array) -> Array:
    """|v| of a field of vectors (2, nx, ny), with zero derivative at zero."""
    squares = jnp.sum(v**2, 0)
    some = squares > 0.0
    return jnp.where(some, jnp.sqrt(jnp.where(some, squares, 1.0)), 0.0)


def clipped(q: Array, bound: Array) -> Array:
    """Tractions within their discs, none of them turned."""
    size = length(q)
    return q * jnp.where(size > bound, bound / jnp.where(size > 0.0, size, 1.0), 1.0)


def free_directions(problem: TangentialProblem, q: Array, slip: Array) -> FreeDirections:
    """From tractions within their discs and the slip that they come with."""
    bound, contact = problem.bound, problem.bound > 0.0
    size = length(q)
    normal = q / jnp.where(size > 0.0, size, 1.0)
    outwards = -jnp.sum(slip * normal, 0)
    slips = contact & (size >= NEAR * bound) & (size + outwards / problem.operator.local() > bound)
    curvature = jnp.where(slips, jnp.maximum(outwards, 0.0) / jnp.where(contact, bound, 1.0), 0.0)
    return FreeDirections(contact, slips, jnp.where(slips, normal, 0.0), curvature, problem.load_controlled)


def shift_of(problem: TangentialProblem, q: Array, moved: Array) -> Array:
    """The shift (2,): as given, or the mean movement, by what is missing to slip; of all in contact if nothing is."""
    if not problem.load_controlled:
        return problem.target
    contact = problem.bound > 0.0
    missing = jnp.where(contact, 1.0 - length(q) / jnp.where(contact, problem.bound, 1.0), 0.0)
    weight = jnp.where(jnp.any(missing > SLIPS), jnp.maximum(missing, 0.0), contact)
    return jnp.sum(weight * moved, (1, 2)) / jnp.maximum(jnp.sum(weight), LEAST)


class _Pass(NamedTuple):
    traction: Array
    displacement: Array
    slip: Array
    shift: Array
    error: Array
    iterations: Array


def _assessed(problem: TangentialProblem, q: Array, count: Array) -> _Pass:
    u = problem.operator.along(q)
    moved = u + problem.drift
    shift = shift_of(problem, q, moved)
    slip = moved - shift[:, None, None]
    b, room = problem.bound, jnp.sum(problem.bound)
    size = jnp.sum(b * (length(u) + length(problem.drift))) + room * length(shift[:, None, None])[0, 0]
    wrong = jnp.sum(b * length(slip) + jnp.sum(q * slip, 0))
    error = jnp.where(size > 0.0, wrong / jnp.where(size > 0.0, size, 1.0), 0.0)
    if problem.load_controlled:
        missing = jnp.max(jnp.abs(problem.target - jnp.sum(q, (1, 2))))
        error = jnp.maximum(
            error, jnp.where(missing > 0.0, missing / jnp.where(room > 0.0, room, missing), 0.0)
        )
    return _Pass(q, u, slip, shift, error, count)


def preconditioner(operator: TractionOperator, free: FreeDirections) -> Linear:
    """That of the operator, within the free directions; cells of large curvature are moved by that alone."""
    inverse = operator.preconditioner()
    weight = jnp.sqrt(1.0 / (1.0 + free.curvature / operator.local()))
    return lambda r: free(weight * inverse(weight * free(r)))


def linear_step(
    problem: TangentialProblem,
    free: FreeDirections,
    right: Array,
    reduction: Array | float,
    limit: Array | int,
) -> tuple[Array, Array]:
    """dq with P (K_tt + k) P dq = P right to a relative residual, and the iterations taken."""
    lifted = lambda q: free(problem.operator.along(q) + free.curvature * q)
    inverse = preconditioner(problem.operator, free)
    return conjugate_gradients(lifted, inverse, free(right), reduction, limit)[:2]


def solve(
    problem: TangentialProblem, start: Array, tolerance: Array, max_iterations: Array
) -> TangentialSolution:
    """Solve from start tractions (2, nx, ny); ``iterations`` counts those of the linear solves.

    A sum that friction cannot hold is not searched for. The caller finds in ``error`` whether the tolerance was met.
    """
    held = jnp.ones((), bool)
    if problem.load_controlled:
        held = length(problem.target[:, None, None])[0, 0] < jnp.sum(problem.bound)

    def improve(s: _Pass) -> _Pass:
        free = free_directions(problem, s.traction, s.slip)
        first = jnp.where(free.slips, problem.bound * free.normal - s.traction, 0.0)
        if problem.load_controlled:
            first = first + free.uniform(problem.target - jnp.sum(s.traction + first, (1, 2)))
        right = -s.slip - problem.operator.along(first) - free.curvature * first
        limit = jnp.minimum(INNER, max_iterations - s.iterations)
        change, count = linear_step(problem, free, right, REDUCTION, limit)
        q = clipped(s.traction + first + change, problem.bound)
        return _assessed(problem, q, s.iterations + jnp.maximum(count, 1))

    going = lambda s: (s.error > tolerance) & (s.iterations < max_iterations) & held
    first = _assessed(problem, clipped(start, problem.bound), jnp.zeros((), int))
    s = jax.lax.while_loop(going, improve, first)
    contact = problem.bound > 0.0
    stick = contact & ~free_directions(problem, s.traction, s.slip).slips
    slip = jnp.where(contact, s.slip, 0.0)
    return TangentialSolution(s.traction, s.displacement, slip, stick, s.shift, s.error, s.iterations)
