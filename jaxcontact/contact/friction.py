"""The tangential contact problem at a given pressure: Coulomb friction, by steps that lower an energy.

In a step the surface slips over the indenter by

    s = K_tt q + drift - shift,

drift: the movement of the surface since the last step apart from that under q; shift: the step of the indenter.
Coulomb's law with the bound b = friction coefficient x pressure,

    |q| <= b,      s = 0 where |q| < b,      s = -k q, k >= 0, where |q| = b,

is the optimality of E = 1/2 <q, K_tt q> + <drift - shift, q> on discs, a convex problem (P. D. Panagiotopoulos, Ing.
Arch. 44 (1975) 421). The shift is given, or the sum of the tractions is, and the shift is its multiplier.

All iterates are admissible: within the discs, and of the given sum. They are found by a conjugate gradient method on the
free directions, in analogy to that of ``contact.normal``. Cells on the rim whose slip opposes their traction slip; their
traction may turn but not grow. All others in contact stick. The direction d is that of Polak and Ribiere for

    P (K_tt + k) P d = P s,      P: the free directions, and under a given sum their zero-sum part,

with k, the slip over the bound, from the curvature of the rim. The traction that is tried is the admissible one nearest
to q - length x d, where cells that slip are first moved outwards by their slip over the mean eigenvalue of K_tt, so that
they stay on the rim when the sum is restored. E is quadratic along the way to it, so that one application of K_tt gives
E there: the whole step is taken if it is nearly of the length of least E, otherwise the part of it with the least E. A
direction in which E does not decrease is replaced by a step towards the admissible tractions nearest to q - length x s,
with the length of J. Barzilai and J. M. Borwein (IMA J. Numer. Anal. 8 (1988) 141), in which E always decreases (E. G.
Birgin, J. M. Martinez, M. Raydan, SIAM J. Optim. 10 (2000) 1196), and the directions start afresh with a shorter length.

The preconditioner is a sum of two circulant operators, the inverses of K_tt and of K_tt + k' with a constant k'. Cells
that stick use the first, cells that slip by more than k' times their bound the second, and the others a mixture of both
(weights in the logarithm of k). With the first alone the number of iterations grows with the grid, because k is far
larger than the eigenvalues of short waves, and far smaller than those of long ones.

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
from jaxcontact.contact import normal
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.operators.coupled import TractionOperator
from jaxcontact.operators.operator import Linear, cut, paste, place

NEAR_RIM = 0.9  # a traction below this part of the bound is not on the rim
LEAST = 1e-12  # fewer free directions than this part of the cells count as none
LENGTH = 0.5  # length of the first trial step, relative to the preconditioned slip
NEARLY = 0.8  # if E is least beyond this part of a step, the whole step is taken, so that cells arrive on their rims
LENGTHENED = 0.3, 3.0  # bounds of the change of the length from step to step
LENGTHS = 0.05, 5.0  # bounds of the length
STRONG, STRONG_SHARE = 8.0, 0.05  # k' over the mean eigenvalue of K_tt, or over the largest if that is more
WEAK = 0.3  # k over the mean eigenvalue of K_tt from which the weights begin to change
ROUNDING = 1e-14  # a change of E below this part of the work of friction is rounding
MET = 1e-12  # an excess below this part of the bound, or of the sum of all bounds, is rounding
SMALL = 1e-6  # share of what friction holds below which tractions need not be accurate relative to themselves
# most evaluations for a level; error of the sum relative to the sum of all bounds
LEVELS, LEVELLED = 60, 1e-14
# a step that leaves more than this part of the slope is shortened by the factor
OVERSHOOT, SHORTER_STEP = 0.5, 0.3


@pytree
class TangentialProblem:
    """A step to be solved, all of order one.

    operator; bound (nx, ny); contact (nx, ny): where the surfaces touch, also without friction; drift (2, nx, ny); target
    (2,): sum of the tractions, or the shift.
    """

    operator: TractionOperator
    bound: Array
    contact: Array
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

    contact (nx, ny): where there is a disc; slips (nx, ny); normal (2, nx, ny) of the discs, zero where the cell sticks;
    outwards (2, nx, ny): the direction in which a traction grows with its disc, the normal, and against the slip where there
    is no disc yet, as without friction; curvature k (nx, ny); load_controlled: whether their sum is held.
    """

    contact: Array
    slips: Array
    normal: Array
    outwards: Array
    curvature: Array
    load_controlled: bool

    def along(self, v: Array) -> Array:
        """Return v without what leads out of the discs, zero off contact."""
        return jnp.where(self.contact, v - jnp.sum(v * self.normal, 0) * self.normal, 0.0)

    def push(self, total: Array) -> Array:
        """Return the vector (2,) which, the same on all cells, makes free tractions of this sum; zero if none are free."""
        x, y = self.normal
        cells = (1.0 + LEAST) * jnp.sum(self.contact)
        return _solve_symmetric(cells - jnp.sum(x**2), cells - jnp.sum(y**2), -jnp.sum(x * y), total)

    def uniform(self, total: Array) -> Array:
        """Return free tractions that are equal on all cells and of this sum."""
        return self.along(jnp.broadcast_to(self.push(total)[:, None, None], self.normal.shape))

    def __call__(self, v: Array) -> Array:
        """Return the projection P v of the module's formulas."""
        v = self.along(v)
        return v - self.uniform(jnp.sum(v, (1, 2))) if self.load_controlled else v


def length(v: Array) -> Array:
    """Return |v| of a field of vectors (2, nx, ny), with zero derivative at zero."""
    squares = jnp.sum(v**2, 0)
    some = squares > 0.0
    return jnp.where(some, jnp.sqrt(jnp.where(some, squares, 1.0)), 0.0)


def largest_traction(coefficient: Array, carried: Array, strength: Array) -> Array:
    """Return the bound of the traction, (nx, ny): mu p_c of the pressure that contact carries and, where the surfaces
    touch, a shear strength (zero without adhesion)."""
    return coefficient * carried + jnp.where(carried > 0.0, strength, 0.0)


def clipped(q: Array, bound: Array) -> Array:
    """Return tractions shortened to their discs |q| <= bound, none of them turned."""
    size = length(q)
    return q * jnp.where(size > bound, bound / jnp.where(size > 0.0, size, 1.0), 1.0)


def free_directions(problem: TangentialProblem, q: Array, slip: Array) -> FreeDirections:
    """Return the admissible directions at tractions within their discs and the corresponding slip."""
    bound, contact = problem.bound, problem.bound > 0.0
    size, slipped = length(q), length(slip)
    normal = q / jnp.where(size > 0.0, size, 1.0)
    driven = -jnp.sum(slip * normal, 0)
    slips = contact & (size >= NEAR_RIM * bound) & (size + driven / problem.operator.local() > bound)
    curvature = jnp.where(slips, jnp.maximum(driven, 0.0) / jnp.where(contact, bound, 1.0), 0.0)
    normal = jnp.where(slips, normal, 0.0)
    against = -slip / jnp.where(slipped > 0.0, slipped, 1.0)
    outwards = jnp.where(problem.contact & ~contact, against, normal)
    return FreeDirections(contact, slips, normal, outwards, curvature, problem.load_controlled)


def _solve_symmetric(xx: Array, yy: Array, xy: Array, right: Array) -> Array:
    """Return the solution (2,) of a symmetric 2 x 2 system; zero if it is singular."""
    det = xx * yy - xy**2
    return (jnp.stack([yy, xx]) * right - xy * right[::-1]) / jnp.where(det > 0.0, det, jnp.inf)


@jax.jit  # so that it is traced once for each shape
def level_of(bound: Array, y: Array, total: Array, start: Array) -> Array:
    """Return the vector (2,) which, added to y (2, nx, ny) and clipped to the bounds (nx, ny), gives tractions of a sum.

    start: a guess, (2,). A sum that the bounds do not allow ends after the last evaluation.
    """
    room = jnp.sum(bound)

    def improve(state: tuple[Array, ...]) -> tuple[Array, ...]:
        level, excess, step, share, evaluations = state
        tried = level + share * step

        # the excess of the sum, and Newton's step from its derivative: w (1 - n n^T) with n the direction of a traction
        # outside its disc, w = b/|z| there, and 1 inside; no farther than to where all tractions are on their rims
        z = y + tried[:, None, None]
        size = length(z)
        outside, some = size > bound, jnp.where(size > 0.0, size, 1.0)
        weight = jnp.where(outside, bound / some, 1.0 * (bound > 0.0))
        left = jnp.sum(weight * z, (1, 2)) - total
        nx, ny = jnp.where(outside, z / some, 0.0)
        cells = (1.0 + LEAST) * jnp.sum(weight)
        xx, yy = cells - jnp.sum(weight * nx**2), cells - jnp.sum(weight * ny**2)
        newton = -_solve_symmetric(xx, yy, -jnp.sum(weight * nx * ny), left)
        farthest, far = jnp.max(jnp.where(bound > 0.0, size + bound, 0.0)), jnp.sqrt(jnp.sum(newton**2))
        newton = newton * jnp.minimum(1.0, farthest / jnp.where(far > 0.0, far, 1.0))

        # a step that overshoots is taken back, and a part of it is tried
        accepted = jnp.sum(left * step) <= -OVERSHOOT * jnp.sum(excess * step)
        accepted = accepted | (evaluations == 0)
        new, old = (tried, left, newton, jnp.ones(())), (level, excess, step, SHORTER_STEP * share)
        return *(jnp.where(accepted, a, b) for a, b in zip(new, old, strict=True)), evaluations + 1

    going = lambda state: (jnp.max(jnp.abs(state[1])) > LEVELLED * room) & (state[4] < LEVELS)
    first = start, jnp.full(2, 1.0 + room), jnp.zeros(2), jnp.ones(()), jnp.zeros((), int)
    return jax.lax.while_loop(going, improve, first)[0]


def admissible(problem: TangentialProblem, y: Array) -> Array:
    """Return the tractions within their discs, and of the given sum, that are nearest to y, (2, nx, ny)."""
    if problem.load_controlled:
        y = y + level_of(problem.bound, y, problem.target, jnp.zeros(2))[:, None, None]
    return clipped(y, problem.bound)


def is_admissible(problem: TangentialProblem, q: Array) -> Array:
    """Return whether tractions are within their discs, and of the given sum, but for rounding, () bool."""
    fits = jnp.all(length(q) <= (1.0 + MET) * problem.bound)
    if not problem.load_controlled:
        return fits
    missing = jnp.max(jnp.abs(jnp.sum(q, (1, 2)) - problem.target))
    return fits & (missing <= MET * jnp.sum(problem.bound))


def preconditioner(operator: TractionOperator, free: FreeDirections) -> Linear:
    """Return the approximate inverse of P (K_tt + k) P in the free directions; see the module."""
    local = operator.local()
    strong = jnp.maximum(STRONG * local, STRONG_SHARE * operator.largest())
    log = lambda k: jnp.log1p(k / (WEAK * local))
    share = jnp.clip(log(free.curvature) / log(strong), 0.0, 1.0)
    beyond = jnp.minimum((strong + local) / (free.curvature + local), 1.0)
    weights = jnp.sqrt(jnp.stack([1.0 - share, share * beyond]))[:, None]
    inverse = operator.preconditioner(jnp.stack([jnp.zeros_like(strong), strong]))
    return lambda r: free(jnp.sum(weights * inverse(weights * free(r)), 0))


class _Iterate(NamedTuple):
    """traction and displacement under it; shift; slip; error; iterations; the last direction, the slip from which it was
    found, and <direction, slip>, zero to start afresh; length of the next step along a direction; steepest: whether the
    next step is along the slip, of length ``steepest_length``."""

    traction: Array
    displacement: Array
    shift: Array
    slip: Array
    error: Array
    iterations: Array
    direction: Array
    earlier: Array
    descent: Array
    length: Array
    steepest: Array
    steepest_length: Array


def _shift(problem: TangentialProblem, q: Array, moved: Array, guess: Array) -> Array:
    """Return the shift (2,): as given, or the one with which q is closest to Coulomb's law.

    moved: K_tt q + drift, so that clip(q - (moved - shift)/c) has the given sum, c the mean eigenvalue of K_tt.
    """
    if not problem.load_controlled:
        return problem.target
    local = problem.operator.local()
    return local * level_of(problem.bound, q - moved / local, problem.target, guess / local)


def _error(problem: TangentialProblem, q: Array, u: Array, slip: Array) -> Array:
    """Return the dimensionless error of the module's formula; the compliance is the mean displacement over the mean bound.

    u: K_tt q, (2, nx, ny).
    """
    b, local, squares = problem.bound, problem.operator.local(), jnp.sum(problem.bound**2)
    compliance = jnp.maximum(local, jnp.sum(b * length(u)) / jnp.where(squares > 0.0, squares, 1.0))
    wrong = compliance * jnp.sum(b * length(q - clipped(q - slip / compliance, b)))
    size = jnp.sum(b * (length(u) + length(problem.drift))) + SMALL * local * squares
    return jnp.where(wrong > 0.0, wrong / jnp.where(size > 0.0, size, 1.0), 0.0)


def friction_can_hold(problem: TangentialProblem) -> Array:
    """Return whether friction can sustain the given sum of tractions, () bool."""
    if not problem.load_controlled:
        return jnp.ones((), bool)
    return jnp.sqrt(jnp.sum(problem.target**2)) < jnp.sum(problem.bound)


def solve(
    problem: TangentialProblem, start: Array, displacement: Array, tolerance: Array, max_iterations: Array
) -> TangentialSolution:
    """Solve from start tractions (2, nx, ny), which need not be admissible, and the displacement K_tt q under them.

    Each iteration applies K_tt once; the first leads to admissible tractions. Where friction cannot hold a given sum, all
    cells slip along it, and the error is one. The caller finds in ``error`` whether the tolerance was met.
    """
    # ``sliding`` are the tractions of a sum that friction cannot hold: all cells slip along it
    operator, bound = problem.operator, problem.bound
    asked, possible, sliding = problem.target, friction_can_hold(problem), start
    if problem.load_controlled:
        size = jnp.sqrt(jnp.sum(asked**2))
        sliding = bound * (asked / jnp.where(size > 0.0, size, 1.0))[:, None, None]
        problem = replace(problem, target=jnp.where(possible, asked, jnp.sum(sliding, (1, 2))))

    def improve(s: _Iterate) -> _Iterate:
        q, slip = s.traction, s.slip

        # 1. The conjugate direction of Polak and Ribiere in the free directions, from the preconditioned slip.
        free = free_directions(problem, q, slip)
        z = preconditioner(operator, free)(slip)
        descent = jnp.sum(z * slip)
        some = s.descent > 0.0
        beta = (descent - jnp.sum(z * s.earlier)) / jnp.where(some, s.descent, 1.0)
        direction = free(z + jnp.where(some, jnp.maximum(beta, 0.0), 0.0) * s.direction)

        # 2. The traction that is tried: the admissible one nearest to a step along it, with slipping cells moved outwards;
        # after a direction in which E does not decrease, to one along the slip; sliding where the sum cannot be held.
        to_rim = jnp.where(free.slips, bound - length(q), 0.0) * free.normal
        outwards = 1.0 + free.curvature / operator.local()
        y = jnp.where(
            s.steepest, q - s.steepest_length * slip, (q - s.length * direction + to_rim) * outwards
        )
        tried = admissible(problem, jnp.where(possible, y, sliding))

        # 3. The part of the step at which E is least: dE/dx = <step, s> + x <step, K_tt step>. All of it from tractions
        # that are not admissible, or if it is nearly the whole. ``bent`` is that part along the curved rim, where
        # slipping cells turn: it decides on the length of the next step.
        step = tried - q
        displacement_of_step = operator.tangential_from_tangential(step)  # the product of the iteration
        slope, curvature = jnp.sum(step * slip), jnp.sum(step * displacement_of_step)
        turning = jnp.where(s.steepest, 0.0, jnp.sum(free.curvature * jnp.sum(step**2, 0)))
        stiff, rounding = curvature > 0.0, ROUNDING * jnp.sum(bound * length(slip))
        straight = jnp.where(stiff, -slope / jnp.where(stiff, curvature, 1.0), 1.0)
        bent = (turning / 2.0 - slope) / jnp.where(stiff, curvature + turning, 1.0)
        bent = jnp.where(stiff, bent, 1.0)
        lower = (slope + curvature / 2.0 <= rounding) & ((bent > NEARLY) | (jnp.abs(slope) <= rounding))
        whole = jnp.isinf(s.error) | lower | (straight > NEARLY)
        share = jnp.where(whole, 1.0, jnp.maximum(straight, 0.0))

        # 4. The slip there, with the shift as given or as the multiplier of the sum. The steepest step has the length of
        # Barzilai and Borwein, <step, step>/<step, K_tt step>.
        q = jnp.where(whole, tried, q + share * step)
        u = s.displacement + share * displacement_of_step
        moved = u + problem.drift
        shift = _shift(problem, q, moved, s.shift)
        new = moved - shift[:, None, None]
        conjugate = ~s.steepest & (share > 0.0)
        longer = jnp.clip(s.length * jnp.clip(bent, *LENGTHENED), *LENGTHS)
        steepest_length = jnp.sum(step**2) / jnp.where(stiff, curvature, jnp.inf)
        return _Iterate(
            q, u, shift, new, _error(problem, q, u, new), s.iterations + 1,
            direction=direction, earlier=slip, descent=jnp.where(conjugate, descent, 0.0),
            length=jnp.where(s.steepest, s.length, longer), steepest=~s.steepest & (share == 0.0),
            steepest_length=jnp.where(s.steepest & stiff, steepest_length, s.steepest_length),
        )  # fmt: skip

    moved, nothing = displacement + problem.drift, jnp.zeros_like(start)
    shift = _shift(problem, start, moved, jnp.zeros(2))
    slip = moved - shift[:, None, None]
    error = jnp.where(is_admissible(problem, start), _error(problem, start, displacement, slip), jnp.inf)
    first = _Iterate(
        start, displacement, shift, slip, error, jnp.zeros((), int),
        direction=nothing, earlier=nothing, descent=jnp.zeros(()), length=jnp.asarray(LENGTH),
        steepest=jnp.zeros((), bool), steepest_length=1.0 / operator.local(),
    )  # fmt: skip
    further = lambda s: (s.error > tolerance) & (s.iterations < max_iterations) & possible
    s = jax.lax.while_loop(lambda s: jnp.isinf(s.error) | further(s), improve, first)

    # Where a sum is not held nothing determines the shift: it is the mean movement of the surface.
    moved, room = s.displacement + problem.drift, jnp.sum(bound)
    mean = jnp.sum(bound * moved, (1, 2)) / jnp.where(room > 0.0, room, 1.0)
    shift = jnp.where(possible, s.shift, mean)
    slip = jnp.where(problem.contact, moved - shift[:, None, None], 0.0)
    free = free_directions(problem, s.traction, slip)
    stick = free.contact & ~free.slips
    error = jnp.where(possible, s.error, jnp.where(jnp.any(asked != 0.0), 1.0, 0.0))
    taken = jnp.where(possible, s.iterations, 0)
    return TangentialSolution(s.traction, s.displacement, slip, stick, shift, error, taken)


# Normal and tangential contact together: pressure bounds the traction, traction moves the pressure.
#
#     g = gap + K_zz p + K_zt q - approach >= 0,  p >= 0,  p g = 0      (``contact.normal``)
#     s = K_tt q + K_tz p + drift - shift,  |q| <= mu p, ...            (``solve``)
#
# In each round the normal problem is solved under a normal displacement y that stands for K_zt q, and then the
# tangential problem under its pressure (P. D. Panagiotopoulos, Ing. Arch. 44 (1975) 421). The solution is a fixed
# point of y -> K_zt q(y). Plain iteration brings the error down by a factor of about the friction coefficient times
# Dundurs' beta; the next y is extrapolated from the last rounds (D. G. Anderson, J. ACM 12 (1965) 547), and the step
# is shortened while the error does not fall. Where solids are similar K_zt and K_tz vanish and one round is all.
#
# The error of a round is that of both problems at once: the error of the tangential problem, and that of the pressure
# under the new traction. Every round solves both to a share of the latter error of the round before, which is what is
# left of the coupling; the share is less while the error does not fall. Before the first round it is taken as the
# coefficient of friction times the coupling of the operator. So unlike solids are solved loosely at first, and
# similar solids to the tolerance at once, by a search that is not interrupted. Products of the operator are handed
# from round to round, and with the result. The rounds take place in a window around the contact if that leaves enough
# of the grid free, and end on the whole grid, where a single round is enough unless the contact has outgrown the
# window.


LOOSE = 1e-2  # largest tolerance of a round
TIGHTER = 0.1  # tolerance of a round over the error of coupling before it and the share of the step
FINAL = 0.3  # least tolerance of both problems over that of the whole; in the first round it is the whole
ROUNDS = 60
KEPT = 5  # rounds that the next y is extrapolated from
PARALLEL = 1e-12  # changes of two rounds whose squared sine is below this count as parallel
SLOW = 0.9  # an error that falls to more than this share of the one before shortens the next step
SHORTER, LONGER, SHORTEST = 0.5, 2.0, 0.1


@pytree
class SlipProblem:
    """One step, all of order one.

    operator; gap (nx, ny) and drift (2, nx, ny), with all earlier history in them; coefficient of friction (nx, ny);
    target () and tangential_target (2,); lowest: of the profile, (); coupled: whether K_zt and K_tz are kept.
    """

    operator: TractionOperator
    gap: Array
    drift: Array
    coefficient: Array
    target: Array
    tangential_target: Array
    lowest: Array
    load_controlled: bool = static()
    tangential_load_controlled: bool = static()
    coupled: bool = static()

    def under(self, normal_by_traction: Array | float) -> Problem:
        """Return the normal problem under a normal displacement (nx, ny) by the traction."""
        return Problem(
            self.operator.normal,
            self.gap + normal_by_traction,
            self.target,
            self.lowest,
            self.load_controlled,
        )

    def sheared(self, pressure: Array, tangential_by_pressure: Array | float) -> TangentialProblem:
        """Return the tangential problem under a pressure and the tangential displacement (2, nx, ny) by it."""
        bound, target = self.coefficient * pressure, self.tangential_target
        drift = self.drift + tangential_by_pressure
        return TangentialProblem(
            self.operator, bound, pressure > 0.0, drift, target, self.tangential_load_controlled
        )


class Round(NamedTuple):
    """Result of a round of the iteration between pressure and traction.

    tangential_by_pressure (2, nx, ny) and normal_by_traction (nx, ny): K_tz p and K_zt q, zero where they are not coupled;
    taken: iterations of all rounds, (); rounds (); settled: whether both problems hold at once.
    """

    normal: Solution
    tangential: TangentialSolution
    tangential_by_pressure: Array
    normal_by_traction: Array
    taken: Array
    rounds: Array
    settled: Array


class _RoundSearch(NamedTuple):
    """A round; given: y, and change: K_zt q - y after it, of this and earlier rounds, (KEPT, nx, ny) each, newest first;
    share: of the change that is taken next; error of both problems; unsettled: the part of it that is due to coupling."""

    round: Round
    given: Array
    change: Array
    share: Array
    error: Array
    unsettled: Array


def solve_partial_slip(
    problem: SlipProblem, pressure: Array, traction: Array, tolerance: Array, max_iterations: Array
) -> Round:
    """Solve from a start pressure and traction, in a window around the contact if there is one, and on the whole grid.

    The caller finds in both ``error`` whether the tolerance was met.
    """
    shape = problem.operator.window_shape(pressure.shape)
    if shape is None:
        return _rounds(problem, pressure, traction, tolerance, max_iterations, jnp.ones((), bool))
    pressure = normal.usable_start(problem.under(0.0), pressure)
    corner, fits = place(pressure > 0.0, shape)
    part = lambda field: cut(field, corner, shape)
    within = replace(
        problem,
        operator=problem.operator.restricted(corner),
        gap=part(problem.gap),
        drift=part(problem.drift),
        coefficient=part(problem.coefficient),
    )
    inside = _rounds(within, part(pressure), part(traction), tolerance, max_iterations, fits)
    on_grid = lambda found, start: jnp.where(fits, paste(found, corner, start.shape), start)
    pressure = on_grid(inside.normal.pressure, pressure)
    traction = on_grid(inside.tangential.traction, traction)
    taken = inside.taken
    found = _rounds(problem, pressure, traction, tolerance, max_iterations - taken, jnp.ones((), bool))
    return found._replace(taken=taken + found.taken, rounds=inside.rounds + found.rounds)


def _rounds(
    problem: SlipProblem,
    pressure: Array,
    traction: Array,
    tolerance: Array,
    max_iterations: Array,
    needed: Array,
) -> Round:
    """Solve on the grid of the problem; without a round if it is not ``needed``, otherwise by at least one."""
    operator = problem.operator
    zero, field, one = jnp.zeros((), int), jnp.zeros_like(pressure), jnp.ones(())
    pair, no = jnp.zeros_like(traction), jnp.zeros((), bool)

    # Before the first round: the start, whose displacements are not known except for those under its traction.
    if problem.coupled:
        displacement, normal_by_traction = operator.displaced(traction)
    else:
        displacement, normal_by_traction = operator.tangential_from_tangential(traction), field
    pressed = Solution(pressure, field, jnp.zeros(()), one, zero)
    sheared = TangentialSolution(traction, displacement, pair, pressure > 0.0, jnp.zeros(2), one, zero)

    if not problem.coupled:  # both problems once
        limit = jnp.where(needed, max_iterations, 0)
        pressed = normal.solve_further(problem.under(0.0), pressed, no, tolerance, limit)
        tangential, left = problem.sheared(pressed.pressure, 0.0), limit - pressed.iterations
        sheared = solve(tangential, traction, displacement, tolerance, left)
        taken = pressed.iterations + sheared.iterations
        return Round(pressed, sheared, pair, field, taken, jnp.ones((), int), jnp.ones((), bool))

    newest_first = lambda kept, newest: jnp.concatenate([newest[None], kept[:-1]])

    def further(s: _RoundSearch) -> _RoundSearch:
        left, before, again = max_iterations - s.round.taken, s.round, s.round.rounds > 0

        # 1. y: of all mixtures, of weights of sum one, of the kept rounds that whose change is least in the mean over the
        # cells in contact (Anderson), and a share of that change.
        change = jnp.where(before.normal.pressure > 0.0, s.change, 0.0).reshape(KEPT, -1)
        size = jnp.sqrt(jnp.sum(change**2, 1))
        used = size > 0.0
        unit = change / jnp.where(used, size, 1.0)[:, None]
        weight = jnp.where(used, size[0] / jnp.where(used, size, 1.0), 0.0)
        gram = unit @ unit.T + jnp.diag(jnp.where(used, PARALLEL, 1.0))
        mixture = weight * jnp.linalg.solve(gram, weight)
        total = jnp.sum(mixture)
        newest = jnp.zeros(KEPT).at[0].set(1.0)
        mixture = jnp.where(total > 0.0, mixture / jnp.where(total > 0.0, total, 1.0), newest)
        y = jnp.tensordot(mixture, s.given + s.share * s.change, 1)

        # 2. The normal problem under y, then the tangential one under its pressure, to a share of the error of coupling.
        # Products of a pressure or traction that has not changed are those of the round before.
        least = jnp.where(again, FINAL, 1.0) * tolerance
        goal = jnp.maximum(jnp.minimum(TIGHTER * s.share * s.unsettled, LOOSE), least)
        pressed = normal.solve_further(problem.under(y), before.normal, again, goal, left)
        p, u = pressed.pressure, pressed.displacement
        tangential_by_pressure = jax.lax.cond(
            again & jnp.all(p == before.normal.pressure),
            lambda: before.tangential_by_pressure,
            lambda: operator.tangential_from_normal(p),
        )
        tangential, start = problem.sheared(p, tangential_by_pressure), before.tangential
        sheared = solve(tangential, start.traction, start.displacement, goal, left - pressed.iterations)
        normal_by_traction = jax.lax.cond(
            jnp.all(sheared.traction == start.traction),
            lambda: before.normal_by_traction,
            lambda: operator.normal_from_tangential(sheared.traction),
        )

        # 3. The error of both at once: that of the pressure under the new traction, and that of the traction.
        now = problem.under(normal_by_traction)
        approach = normal.approach_of(now, p, u)
        unsettled = normal.stopping_error(now, p, u, u + now.gap - approach, approach)
        if problem.load_controlled:
            unsettled = jnp.where(problem.target > 0.0, unsettled, 0.0)
        pressed = replace(pressed, approach=approach, error=unsettled)
        error = jnp.maximum(unsettled, jnp.where(friction_can_hold(tangential), sheared.error, 0.0))

        # 4. The next step is shorter while the error does not fall.
        share = jnp.where((error > SLOW * s.error) & again, SHORTER, LONGER) * s.share
        taken = before.taken + pressed.iterations + sheared.iterations
        settled = error <= tolerance
        found = Round(
            pressed, sheared, tangential_by_pressure, normal_by_traction, taken, before.rounds + 1, settled
        )
        given, changes = newest_first(s.given, y), newest_first(s.change, normal_by_traction - y)
        return _RoundSearch(found, given, changes, jnp.clip(share, SHORTEST, 1.0), error, unsettled)

    def going(s: _RoundSearch) -> Array:
        more = ~s.round.settled & (s.round.taken < max_iterations) & (s.round.rounds < ROUNDS)
        return needed & (more | (s.round.rounds == 0))

    before = Round(pressed, sheared, pair, normal_by_traction, zero, zero, no)
    blank = jnp.zeros((KEPT, *pressure.shape))
    unsettled = jnp.max(problem.coefficient) * operator.coupling()
    first = _RoundSearch(before, newest_first(blank, normal_by_traction), blank, one, one, unsettled)
    return jax.lax.while_loop(going, further, first).round
