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
NEAR = 1.0 - 1e-9  # of the bound: a smaller traction is not taken to slip
SMALL = 1e-6
LEAST = 1e-12  # free directions, in parts of their number: fewer are none
FULL = 0.6  # of a step: if the energy is least beyond this share, the whole step is taken
ROUNDING = 1e-14  # of the work of friction: a smaller change of the energy is rounding
LEVELS, LEVELLED = 60, 1e-14  # most evaluations for the shift, and the error of the sum, in parts of the sum of bounds
OVERSHOOT, SHORTER = 0.5, 0.3


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


class _Level(NamedTuple):
    level: Array
    missing: Array
    step: Array
    share: Array
    count: Array


def _excess(bound: Array, y: Array, total: Array, level: Array) -> tuple[Array, Array]:
    """sum clip(y + level) - total and the Newton step of level that would bring it to zero."""
    z = y + level[:, None, None]
    size = length(z)
    outside = size > bound
    safe = jnp.where(size > 0.0, size, 1.0)
    weight = jnp.where(outside, bound / safe, jnp.where(bound > 0.0, 1.0, 0.0))
    excess = jnp.sum(weight * z, (1, 2)) - total
    nx, ny = jnp.where(outside, z / safe, 0.0)
    all_, turns = jnp.sum(weight), weight * nx
    xx, xy, yy = all_ - jnp.sum(turns * nx), -jnp.sum(turns * ny), all_ - jnp.sum(weight * ny**2)
    least = LEAST * all_
    xx, yy = xx + least, yy + least
    det = xx * yy - xy**2
    det = jnp.where(det > 0.0, det, 1.0)
    step = -jnp.stack([yy * excess[0] - xy * excess[1], xx * excess[1] - xy * excess[0]]) / det
    most = jnp.max(jnp.where(bound > 0.0, size + bound, 0.0))
    long = jnp.sqrt(jnp.sum(step**2))
    return excess, step * jnp.minimum(1.0, most / jnp.where(long > 0.0, long, 1.0))


def level_of(bound: Array, y: Array, total: Array, start: Array) -> Array:
    """The vector (2,) that, added to all of y, gives clipped tractions of this sum."""
    room = jnp.sum(bound)

    def going(s: _Level) -> Array:
        return (jnp.max(jnp.abs(s.missing)) > LEVELLED * room) & (s.count < LEVELS)

    def improve(s: _Level) -> _Level:
        tried = s.level + s.share * s.step
        missing, step = _excess(bound, y, total, tried)
        slope, before = jnp.sum(missing * s.step), jnp.sum(s.missing * s.step)
        good = slope <= -OVERSHOOT * before
        pick = lambda new, old: jnp.where(good, new, old)
        share = jnp.where(good, 1.0, SHORTER * s.share)
        return _Level(pick(tried, s.level), pick(missing, s.missing), pick(step, s.step), share, s.count + 1)

    first = _Level(start, *_excess(bound, y, total, start), jnp.ones(()), jnp.zeros((), int))
    return jax.lax.while_loop(going, improve, first).level


def preconditioner(operator: TractionOperator, free: FreeDirections) -> Linear:
    """That of the operator, within the free directions; cells of large curvature are moved by that alone."""
    inverse = operator.preconditioner()
    weight = jnp.sqrt(1.0 / (1.0 + free.curvature / operator.local()))
    return lambda r: free(weight * inverse(weight * free(r)))


class _Iterate(NamedTuple):
    """traction and its displacement; shift, slip, error; length of the next gradient step; iterations."""

    traction: Array
    displacement: Array
    shift: Array
    slip: Array
    error: Array
    length: Array
    iterations: Array


def _admissible(problem: TangentialProblem, y: Array) -> Array:
    """The tractions within their discs, and of the given sum, that are nearest to y."""
    if problem.load_controlled:
        y = y + level_of(problem.bound, y, problem.target, jnp.zeros(2))[:, None, None]
    return clipped(y, problem.bound)


def _assessed(problem: TangentialProblem, q: Array, u: Array, shift: Array, step: Array, count: Array) -> _Iterate:
    b, moved, local = problem.bound, u + problem.drift, problem.operator.local()
    shift = problem.target
    if problem.load_controlled:
        shift = local * level_of(b, q - moved / local, problem.target, shift / local)
    slip = moved - shift[:, None, None]
    squares = jnp.sum(b**2)
    compliance = jnp.maximum(local, jnp.sum(b * length(u)) / jnp.where(squares > 0.0, squares, 1.0))
    wrong = compliance * jnp.sum(b * length(q - clipped(q - slip / compliance, b)))
    size = jnp.sum(b * (length(u) + length(problem.drift))) + SMALL * local * squares
    error = jnp.where(size > 0.0, wrong / jnp.where(size > 0.0, size, 1.0), jnp.where(wrong > 0.0, 1.0, 0.0))
    return _Iterate(q, u, shift, slip, error, step, count)


def _moved_to(problem: TangentialProblem, s: _Iterate, q: Array, count: Array) -> _Iterate:
    """Towards q as far as the energy falls."""
    step = q - s.traction
    lifted = problem.operator.along(step)
    slope, curvature = jnp.sum(step * s.slip), jnp.sum(step * lifted)
    some = curvature > 0.0
    part = jnp.where(some, jnp.clip(-slope / jnp.where(some, curvature, 1.0), 0.0, 1.0), 1.0)
    least = ROUNDING * jnp.sum(problem.bound * length(s.slip))
    part = jnp.where((part > FULL) | (slope + 0.5 * curvature < least), 1.0, part)
    long = jnp.where(some, jnp.sum(step**2) / jnp.where(some, curvature, 1.0), s.length)
    q, u = jnp.where(part == 1.0, q, s.traction + part * step), s.displacement + part * lifted
    return _assessed(problem, q, u, s.shift, long, count)


def _gradient_step(problem: TangentialProblem, s: _Iterate) -> _Iterate:
    return _moved_to(problem, s, _admissible(problem, s.traction - s.length * s.slip), s.iterations + 1)


def _newton_step(problem: TangentialProblem, s: _Iterate, limit: Array) -> _Iterate:
    free = free_directions(problem, s.traction, s.slip)
    lifted = lambda q: free(problem.operator.along(q) + free.curvature * q)
    inverse = preconditioner(problem.operator, free)
    change, count, _ = conjugate_gradients(lifted, inverse, free(-s.slip), REDUCTION, limit)
    new = _moved_to(problem, s, _admissible(problem, s.traction + change), s.iterations + count + 1)
    return new._replace(length=s.length)


def solve(
    problem: TangentialProblem, start: Array, tolerance: Array, max_iterations: Array
) -> TangentialSolution:
    """Solve from start tractions (2, nx, ny); ``iterations`` counts convolutions.

    A sum that friction cannot hold is not searched for. The caller finds in ``error`` whether the tolerance was met.
    """
    bound, contact, held = problem.bound, problem.bound > 0.0, jnp.ones((), bool)
    begin = clipped(start, bound)
    if problem.load_controlled:
        asked = length(problem.target[:, None, None])[0, 0]
        held = asked < jnp.sum(bound)
        slides = bound * (problem.target / jnp.where(asked > 0.0, asked, 1.0))[:, None, None]
        level = level_of(jnp.where(held, bound, 0.0), start, problem.target, jnp.zeros(2))
        begin = jnp.where(held, clipped(start + level[:, None, None], bound), slides)

    def improve(s: _Iterate) -> _Iterate:
        s = _gradient_step(problem, s)
        limit = jnp.minimum(INNER, max_iterations - s.iterations)
        return jax.lax.cond(s.error > tolerance, lambda s: _newton_step(problem, s, limit), lambda s: s, s)

    going = lambda s: (s.error > tolerance) & (s.iterations < max_iterations) & held
    local = problem.operator.local()
    shift = jnp.zeros(2)
    first = _assessed(problem, begin, problem.operator.along(begin), shift, 1.0 / local, jnp.zeros((), int))
    s = jax.lax.while_loop(going, improve, first)
    stick = contact & ~free_directions(problem, s.traction, s.slip).slips
    slip = jnp.where(contact, s.slip, 0.0)
    error = jnp.where(held, s.error, 1.0)
    return TangentialSolution(s.traction, s.displacement, slip, stick, s.shift, error, s.iterations)
