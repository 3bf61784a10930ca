"""The tangential contact problem at a given pressure: Coulomb friction, by steps that lower an energy.

In a step the surface slips over the indenter by

    s = K_tt q + drift - shift,

drift: the movement of the surface since the last step apart from that under q; shift: the step of the indenter.
Coulomb's law with the bound b = friction coefficient x pressure,

    |q| <= b,      s = 0 where |q| < b,      s = -k q, k >= 0, where |q| = b,

is the optimality of E = 1/2 <q, K_tt q> + <drift - shift, q> on discs, a convex problem (P. D. Panagiotopoulos, Ing.
Arch. 44 (1975) 421). The shift is given, or the sum of the tractions is, and the shift is its multiplier.

All iterates are admissible: within the discs, and of the given sum. Two kinds of steps take turns. A gradient step
goes towards the admissible tractions nearest to q - length x s, with the length of J. Barzilai and J. M. Borwein (IMA J.
Numer. Anal. 8 (1988) 141). A Newton step takes the cells on the rim whose slip opposes their traction as slipping, with
tractions that may turn but not grow, and all others in contact as sticking, solves the linearised problem

    P (K_tt + k) P dq = -P s,      P: the free directions, and under a given sum their zero-sum part,

by preconditioned conjugate gradients to a fraction, and goes towards the admissible tractions nearest to q + dq. The term
k, the slip over the bound, comes from the curvature of the rim. E is quadratic along a step, so that its least value there
is known from one application of K_tt, and a step is taken as far as E falls. The gradient steps make the method converge
from any admissible start (E. G. Birgin, J. M. Martinez, M. Raydan, SIAM J. Optim. 10 (2000) 1196), the Newton steps
make it fast; gradient projection followed by conjugate gradients on the free directions is due to J. J. More and G. Toraldo
(SIAM J. Optim. 1 (1991) 93), and on discs to Z. Dostal and T. Kozubek (Math. Program. 135 (2012) 195).

The admissible tractions of a given sum that are nearest to y are clip(y + level), with a vector level (2,) that makes up the
sum: a monotone equation, solved by a Newton method whose steps are shortened until they no longer overshoot.

The stopping error is dimensionless. With an elastic compliance c, the tractions of Coulomb's law are a fixed point of
q -> clip(q - s/c), and the error is sum(b c |q - clip(q - s/c)|)/sum(b (|K_tt q| + |drift|)): the mean slip of cells that
stick, and of cells that slip the mean error of the traction times c, over a mean displacement.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact.contact.linear import conjugate_gradients
from jaxcontact.operators.base import Linear, TractionOperator

REDUCTION = 0.1  # of the residual, by the linear solve of a Newton step
INNER = 20  # most of its iterations
ON_RIM = 1.0 - 1e-9  # of the bound: a smaller traction is not on the rim
LEAST = 1e-12  # free directions, in parts of their number: fewer are none
FULL = 0.6  # a step is taken as a whole if E is least beyond this share of it, so that cells arrive on their rims
ROUNDING = 1e-14  # in parts of the work of friction: a smaller change of E is rounding
SMALL = 1e-6  # share of what friction holds below which tractions need not be accurate in parts of themselves
LEVELS, LEVELLED = (
    60,
    1e-14,
)  # most evaluations for a level; error of the sum, in parts of the sum of all bounds
OVERSHOOT, SHORTER = (
    0.5,
    0.3,
)  # of the slope: a step for a level that leaves more of it is made shorter by this factor


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
    """Admissible directions of the tractions.

    contact (nx, ny); slips (nx, ny); normal (2, nx, ny) of the discs, zero where the cell sticks; curvature k (nx, ny);
    load_controlled: whether their sum is held.
    """

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
        cells = (1.0 + LEAST) * jnp.sum(self.contact)
        return _solved(cells - jnp.sum(x**2), cells - jnp.sum(y**2), -jnp.sum(x * y), total)

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
    """Return the admissible directions at tractions within their discs and the corresponding slip."""
    bound, contact = problem.bound, problem.bound > 0.0
    size = length(q)
    normal = q / jnp.where(size > 0.0, size, 1.0)
    outwards = -jnp.sum(slip * normal, 0)
    slips = contact & (size >= ON_RIM * bound) & (size + outwards / problem.operator.local() > bound)
    curvature = jnp.where(slips, jnp.maximum(outwards, 0.0) / jnp.where(contact, bound, 1.0), 0.0)
    return FreeDirections(contact, slips, jnp.where(slips, normal, 0.0), curvature, problem.load_controlled)


class _Level(NamedTuple):
    """A level (2,), what its sum is in excess, the Newton step from it, the share of that to be tried, evaluations."""

    level: Array
    excess: Array
    step: Array
    share: Array
    evaluations: Array


def _excess(bound: Array, y: Array, total: Array, level: Array) -> tuple[Array, Array]:
    """sum clip(y + level) - total, (2,), and the Newton step of the level towards zero."""
    z = y + level[:, None, None]
    size = length(z)
    outside, some = size > bound, jnp.where(size > 0.0, size, 1.0)
    weight = jnp.where(outside, bound / some, 1.0 * (bound > 0.0))
    excess = jnp.sum(weight * z, (1, 2)) - total
    x, y = jnp.where(outside, z / some, 0.0)
    cells = (1.0 + LEAST) * jnp.sum(weight)
    step = -_solved(
        cells - jnp.sum(weight * x**2), cells - jnp.sum(weight * y**2), -jnp.sum(weight * x * y), excess
    )
    farthest, far = jnp.max(jnp.where(bound > 0.0, size + bound, 0.0)), jnp.sqrt(jnp.sum(step**2))
    return excess, step * jnp.minimum(1.0, farthest / jnp.where(far > 0.0, far, 1.0))


def _solved(xx: Array, yy: Array, xy: Array, right: Array) -> Array:
    """The solution (2,) of a symmetric system; zero if it is singular."""
    det = xx * yy - xy**2
    adjoint = jnp.stack([yy * right[0] - xy * right[1], xx * right[1] - xy * right[0]])
    return adjoint / jnp.where(det > 0.0, det, jnp.inf)


def level_of(bound: Array, y: Array, total: Array, start: Array) -> Array:
    """Return the vector (2,) which, added to y (2, nx, ny) and clipped to the bounds (nx, ny), gives tractions of a sum.

    start: a guess, (2,). A sum that the bounds do not allow ends after the last evaluation.
    """
    room = jnp.sum(bound)

    def improve(s: _Level) -> _Level:
        tried = s.level + s.share * s.step
        excess, step = _excess(bound, y, total, tried)
        short_enough = jnp.sum(excess * s.step) <= -OVERSHOOT * jnp.sum(s.excess * s.step)
        new = _Level(tried, excess, step, jnp.ones(()), s.evaluations + 1)
        old = s._replace(share=SHORTER * s.share, evaluations=s.evaluations + 1)
        return jax.tree.map(lambda a, b: jnp.where(short_enough, a, b), new, old)

    going = lambda s: (jnp.max(jnp.abs(s.excess)) > LEVELLED * room) & (s.evaluations < LEVELS)
    first = _Level(start, *_excess(bound, y, total, start), jnp.ones(()), jnp.zeros((), int))
    return jax.lax.while_loop(going, improve, first).level


def admissible(problem: TangentialProblem, y: Array) -> Array:
    """Return the tractions within their discs, and of the given sum, that are nearest to y, (2, nx, ny)."""
    if problem.load_controlled:
        y = y + level_of(problem.bound, y, problem.target, jnp.zeros(2))[:, None, None]
    return clipped(y, problem.bound)


def preconditioner(operator: TractionOperator, free: FreeDirections) -> Linear:
    """Return the operator's preconditioner restricted to the free directions and weighted by the curvature."""
    inverse = operator.preconditioner()
    weight = jnp.sqrt(1.0 / (1.0 + free.curvature / operator.local()))
    return lambda r: free(weight * inverse(weight * free(r)))


class _Iterate(NamedTuple):
    """traction and displacement under it; shift; slip; error; length of the next gradient step; turn: steps taken, the
    start being the first; iterations."""

    traction: Array
    displacement: Array
    shift: Array
    slip: Array
    error: Array
    length: Array
    turn: Array
    iterations: Array


def _shift(problem: TangentialProblem, q: Array, moved: Array, guess: Array) -> Array:
    """The shift (2,): as given, or the one with which q is closest to Coulomb's law."""
    if not problem.load_controlled:
        return problem.target
    local = problem.operator.local()
    return local * level_of(problem.bound, q - moved / local, problem.target, guess / local)


def _error(problem: TangentialProblem, q: Array, u: Array, slip: Array) -> Array:
    """The dimensionless error of the module's formula; the compliance is the mean displacement over the mean bound."""
    b, local, squares = problem.bound, problem.operator.local(), jnp.sum(problem.bound**2)
    compliance = jnp.maximum(local, jnp.sum(b * length(u)) / jnp.where(squares > 0.0, squares, 1.0))
    wrong = compliance * jnp.sum(b * length(q - clipped(q - slip / compliance, b)))
    size = jnp.sum(b * (length(u) + length(problem.drift))) + SMALL * local * squares
    return jnp.where(wrong > 0.0, wrong / jnp.where(size > 0.0, size, 1.0), 0.0)


def _towards(problem: TangentialProblem, s: _Iterate, q: Array) -> _Iterate:
    """Towards admissible tractions as far as the energy falls; all the way to the start."""
    step = q - s.traction
    lifted = problem.operator.along(step)
    slope, curvature = jnp.sum(step * s.slip), jnp.sum(step * lifted)
    stiff = curvature > 0.0
    safe = jnp.where(stiff, curvature, 1.0)
    share = jnp.where(stiff, jnp.clip(-slope / safe, 0.0, 1.0), 1.0)
    rounding = ROUNDING * jnp.sum(problem.bound * length(s.slip))
    share = jnp.where((s.turn == 0) | (share > FULL) | (slope + 0.5 * curvature < rounding), 1.0, share)
    q, u = jnp.where(share == 1.0, q, s.traction + share * step), s.displacement + share * lifted
    moved = u + problem.drift
    shift = _shift(problem, q, moved, s.shift)
    slip = moved - shift[:, None, None]
    gradient_step = stiff & (s.turn % 2 == 1)
    size = jnp.where(gradient_step, jnp.sum(step**2) / safe, s.length)
    return _Iterate(
        q, u, shift, slip, _error(problem, q, u, slip), size, s.turn + 1, s.iterations + (s.turn > 0)
    )


def _newton_change(problem: TangentialProblem, s: _Iterate, limit: Array) -> tuple[Array, Array]:
    """dq of the linearised problem, (2, nx, ny), and the iterations that it took."""
    free = free_directions(problem, s.traction, s.slip)
    lifted = lambda q: free(problem.operator.along(q) + free.curvature * q)
    inverse = preconditioner(problem.operator, free)
    return conjugate_gradients(lifted, inverse, free(-s.slip), REDUCTION, limit)[:2]


def held(problem: TangentialProblem) -> Array:
    """Return whether friction can sustain the given sum of tractions, () bool."""
    if not problem.load_controlled:
        return jnp.ones((), bool)
    return jnp.sqrt(jnp.sum(problem.target**2)) < jnp.sum(problem.bound)


def solve(
    problem: TangentialProblem, start: Array, tolerance: Array, max_iterations: Array
) -> TangentialSolution:
    """Solve from start tractions (2, nx, ny), which need not be admissible; ``iterations`` counts applications of K_tt.

    Where friction cannot hold a given sum, all cells slip along it, and the error is one. The caller finds in ``error``
    whether the tolerance was met.
    """
    asked, possible, bound = problem.target, held(problem), problem.bound
    if problem.load_controlled:
        size = jnp.sqrt(jnp.sum(asked**2))
        sliding = bound * (asked / jnp.where(size > 0.0, size, 1.0))[:, None, None]
        start = jnp.where(possible, start, sliding)
        problem = replace(problem, target=jnp.where(possible, asked, jnp.sum(sliding, (1, 2))))

    def improve(s: _Iterate) -> _Iterate:
        limit = jnp.minimum(INNER, max_iterations - s.iterations)
        given = lambda: (start - s.traction, jnp.zeros((), int))
        gradient = lambda: (-s.length * s.slip, jnp.zeros((), int))
        kind = jnp.where(s.turn == 0, 0, 2 - s.turn % 2)
        change, count = jax.lax.switch(kind, [given, gradient, lambda: _newton_change(problem, s, limit)])
        s = s._replace(iterations=s.iterations + count)
        return _towards(problem, s, admissible(problem, s.traction + change))

    nothing, zero = jnp.zeros_like(start), jnp.zeros((), int)
    first = _Iterate(
        nothing, nothing, jnp.zeros(2), nothing, jnp.ones(()), 1.0 / problem.operator.local(), zero, zero
    )
    going = lambda s: (s.turn == 0) | ((s.error > tolerance) & (s.iterations < max_iterations) & possible)
    s = jax.lax.while_loop(going, improve, first)
    return _solution(problem, s, asked, possible)


def _solution(problem: TangentialProblem, s: _Iterate, asked: Array, possible: Array) -> TangentialSolution:
    """The result; where a sum is not held, the shift, which nothing determines, is the mean movement of the surface."""
    bound, contact = problem.bound, problem.bound > 0.0
    moved, room = s.displacement + problem.drift, jnp.sum(bound)
    mean = jnp.sum(bound * moved, (1, 2)) / jnp.where(room > 0.0, room, 1.0)
    shift = jnp.where(possible, s.shift, mean)
    slip = jnp.where(contact, moved - shift[:, None, None], 0.0)
    stick = contact & ~free_directions(problem, s.traction, slip).slips
    error = jnp.where(possible, s.error, jnp.where(jnp.any(asked != 0.0), 1.0, 0.0))
    return TangentialSolution(s.traction, s.displacement, slip, stick, shift, error, s.iterations)
