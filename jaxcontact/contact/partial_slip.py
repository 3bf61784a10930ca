"""Normal and tangential contact together: pressure bounds the traction, traction moves the pressure.

    g = gap + K_zz p + K_zt q - approach >= 0,  p >= 0,  p g = 0      (``contact.normal``)
    s = K_tt q + K_tz p + drift - shift,  |q| <= mu p, ...            (``contact.friction``)

In each round the normal problem is solved under a normal displacement y that stands for K_zt q, and then the tangential
problem under its pressure (P. D. Panagiotopoulos, Ing. Arch. 44 (1975) 421). The solution is a fixed point of
y -> K_zt q(y). Plain iteration brings the error down by a factor of about the friction coefficient times Dundurs' beta;
the next y is extrapolated from the last rounds (D. G. Anderson, J. ACM 12 (1965) 547), and the step is shortened while the
error does not fall. Where solids are similar K_zt and K_tz vanish and one round is all.

The error of a round is that of both problems at once: the error of the tangential problem, and that of the pressure under
the new traction. Every round solves both to a share of the latter error of the round before, which is what is left of the
coupling; the share is less while the error does not fall. Before the first round it is taken as the coefficient of
friction times the coupling of the operator. So unlike solids are solved loosely at first, and similar solids to the
tolerance at once, by a search that is not interrupted. Products of the operator are handed from round to round, and with
the result. The rounds take place in a window around the contact if that leaves enough of the grid free, and end on the
whole grid, where a single round is enough unless the contact has outgrown the window.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact.contact import friction, normal
from jaxcontact.contact.friction import TangentialProblem, TangentialSolution
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.contact.window import Corner, cut, paste, place
from jaxcontact.operators.base import TractionOperator

LOOSE = 1e-2  # largest tolerance of a round
TIGHTER = 0.1  # tolerance of a round over the error of coupling before it and the share of the step
FINAL = 0.3  # of the tolerance: both problems are not solved to less, and in the first round not to less than all of it
ROUNDS = 60
KEPT = 5  # rounds that the next y is extrapolated from
PARALLEL = 1e-12  # of the squared sine below which the changes of two rounds are taken for one
SLOW = 0.9  # an error that falls to more than this share of the one before shortens the next step
SHORTER, LONGER, SHORTEST = 0.5, 2.0, 0.1


@pytree
class SlipProblem:
    """One step, all of order one.

    operator; gap (nx, ny) and drift (2, nx, ny), with all earlier history in them; coefficient of friction (nx, ny);
    target () and tangential_target (2,); lowest: of the profile, ().
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

    def under(self, normal_shift: Array | float) -> Problem:
        """The normal problem under a normal displacement (nx, ny) by the traction."""
        return Problem(
            self.operator.normal, self.gap + normal_shift, self.target, self.lowest, self.load_controlled
        )

    def sheared(self, pressure: Array, tangential_shift: Array | float) -> TangentialProblem:
        """The tangential problem under a pressure and the tangential displacement (2, nx, ny) by it."""
        bound, target = self.coefficient * pressure, self.tangential_target
        return TangentialProblem(
            self.operator, bound, self.drift + tangential_shift, target, self.tangential_load_controlled
        )


class Round(NamedTuple):
    """Result of a round of the iteration between pressure and traction.

    tangential_shift (2, nx, ny) and normal_shift (nx, ny): K_tz p and K_zt q, zero where they are not coupled; taken:
    iterations of all rounds, (); rounds (); settled: whether both problems hold at once.
    """

    normal: Solution
    tangential: TangentialSolution
    tangential_shift: Array
    normal_shift: Array
    taken: Array
    rounds: Array
    settled: Array


class _RoundSearch(NamedTuple):
    """A round; y, and K_zt q - y after it, of this and earlier rounds, (KEPT, nx, ny) each, newest first; the share of the
    change that is taken; the error; the part of it that is due to coupling."""

    round: Round
    given: Array
    change: Array
    share: Array
    error: Array
    unsettled: Array


def solve(
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
    inside = _rounds(
        _in_window(problem, part, corner), part(pressure), part(traction), tolerance, max_iterations, fits
    )
    on_grid = lambda found, start: jnp.where(fits, paste(found, corner, start.shape), start)
    pressure = on_grid(inside.normal.pressure, pressure)
    traction = on_grid(inside.tangential.traction, traction)
    taken = inside.taken
    found = _rounds(problem, pressure, traction, tolerance, max_iterations - taken, jnp.ones((), bool))
    return found._replace(taken=taken + found.taken, rounds=inside.rounds + found.rounds)


def _in_window(problem: SlipProblem, part: Callable[[Array], Array], corner: Corner) -> SlipProblem:
    """Return the problem without the cells outside the window at a corner; part: what of a field lies inside."""
    return replace(
        problem,
        operator=problem.operator.restricted(corner),
        gap=part(problem.gap),
        drift=part(problem.drift),
        coefficient=part(problem.coefficient),
    )


def _rounds(
    problem: SlipProblem,
    pressure: Array,
    traction: Array,
    tolerance: Array,
    max_iterations: Array,
    needed: Array,
) -> Round:
    """Solve on the grid of the problem; without a round if it is not ``needed``, otherwise by at least one."""
    if not problem.coupled:
        limit = jnp.where(needed, max_iterations, 0)
        return _uncoupled(problem, pressure, traction, tolerance, limit)

    def going(s: _RoundSearch) -> Array:
        more = ~s.round.settled & (s.round.taken < max_iterations) & (s.round.rounds < ROUNDS)
        return needed & (more | (s.round.rounds == 0))

    further = lambda s: _further_round(problem, s, tolerance, max_iterations)
    return jax.lax.while_loop(going, further, _begin(problem, pressure, traction)).round


def _further_round(
    problem: SlipProblem, s: _RoundSearch, tolerance: Array, max_iterations: Array
) -> _RoundSearch:
    """Solve the normal problem under the extrapolated normal displacement, then the tangential one under its pressure."""
    left, before, again = max_iterations - s.round.taken, s.round, s.round.rounds > 0
    least = jnp.where(again, FINAL, 1.0) * tolerance
    y, goal = _next(s), jnp.maximum(jnp.minimum(TIGHTER * s.share * s.unsettled, LOOSE), least)
    pressed = normal.solve_further(problem.under(y), before.normal, again, goal, left)
    tangential_shift = jax.lax.cond(
        again & jnp.all(pressed.pressure == before.normal.pressure),
        lambda: before.tangential_shift,
        lambda: problem.operator.tangential_from_normal(pressed.pressure),
    )
    tangential, start = problem.sheared(pressed.pressure, tangential_shift), before.tangential
    left = left - pressed.iterations
    sheared = friction.solve(tangential, start.traction, start.displacement, goal, left)
    normal_shift = jax.lax.cond(
        jnp.all(sheared.traction == start.traction),
        lambda: before.normal_shift,
        lambda: problem.operator.normal_from_tangential(sheared.traction),
    )
    pressed = _under_new_traction(problem, pressed, normal_shift)
    error = jnp.maximum(pressed.error, jnp.where(friction.held(tangential), sheared.error, 0.0))
    taken = before.taken + pressed.iterations + sheared.iterations
    settled = error <= tolerance
    found = Round(pressed, sheared, tangential_shift, normal_shift, taken, before.rounds + 1, settled)
    slow = (error > SLOW * s.error) & again
    share = jnp.clip(jnp.where(slow, SHORTER, LONGER) * s.share, SHORTEST, 1.0)
    given, changes = _pushed(s.given, y), _pushed(s.change, normal_shift - y)
    return _RoundSearch(found, given, changes, share, error, pressed.error)


def _uncoupled(
    problem: SlipProblem, pressure: Array, traction: Array, tolerance: Array, max_iterations: Array
) -> Round:
    """Solve both problems once."""
    first = _begin(problem, pressure, traction).round
    unknown = jnp.zeros((), bool)
    pressed = normal.solve_further(problem.under(0.0), first.normal, unknown, tolerance, max_iterations)
    tangential, start = problem.sheared(pressed.pressure, 0.0), first.tangential
    left = max_iterations - pressed.iterations
    sheared = friction.solve(tangential, traction, start.displacement, tolerance, left)
    taken = pressed.iterations + sheared.iterations
    return Round(
        pressed,
        sheared,
        first.tangential_shift,
        first.normal_shift,
        taken,
        jnp.ones((), int),
        jnp.ones((), bool),
    )


def _begin(problem: SlipProblem, pressure: Array, traction: Array) -> _RoundSearch:
    """Before the first round: y is that of the start."""
    zero, none, one = jnp.zeros((), int), jnp.zeros_like(pressure), jnp.ones(())
    pair = jnp.zeros_like(traction)
    operator = problem.operator
    along = (
        operator.displaced if problem.coupled else lambda q: (operator.tangential_from_tangential(q), none)
    )
    displacement, normal_shift = along(traction)
    pressed = Solution(pressure, none, jnp.zeros(()), one, zero)
    sheared = TangentialSolution(traction, displacement, pair, pressure > 0.0, jnp.zeros(2), one, zero)
    first = Round(pressed, sheared, pair, normal_shift, zero, zero, jnp.zeros((), bool))
    blank = jnp.zeros((KEPT, *pressure.shape))
    unsettled = jnp.max(problem.coefficient) * operator.coupling()
    return _RoundSearch(first, _pushed(blank, normal_shift), blank, one, one, unsettled)


def _pushed(kept: Array, newest: Array) -> Array:
    """The newest field in front of those kept, the last of which goes."""
    return jnp.concatenate([newest[None], kept[:-1]])


def _next(s: _RoundSearch) -> Array:
    """y of the next round: of all mixtures of the kept ones, that whose change is least in the mean, and a share of it."""
    change = jnp.where(s.round.normal.pressure > 0.0, s.change, 0.0).reshape(KEPT, -1)
    size = jnp.sqrt(jnp.sum(change**2, 1))
    used = size > 0.0
    unit = change / jnp.where(used, size, 1.0)[:, None]
    weight = jnp.where(used, size[0] / jnp.where(used, size, 1.0), 0.0)
    gram = unit @ unit.T + jnp.diag(jnp.where(used, PARALLEL, 1.0))
    mixture = weight * jnp.linalg.solve(gram, weight)
    total = jnp.sum(mixture)
    newest = jnp.zeros(KEPT).at[0].set(1.0)
    mixture = jnp.where(total > 0.0, mixture / jnp.where(total > 0.0, total, 1.0), newest)
    return jnp.tensordot(mixture, s.given + s.share * s.change, 1)


def _under_new_traction(problem: SlipProblem, pressed: Solution, normal_shift: Array) -> Solution:
    """A solution of the normal problem with the approach and the error that it has under another traction."""
    now, p, u = problem.under(normal_shift), pressed.pressure, pressed.displacement
    approach = normal.approach_of(now, p, u)
    error = normal.stopping_error(now, p, u, u + now.gap - approach, approach)
    if problem.load_controlled:
        error = jnp.where(problem.target > 0.0, error, 0.0)
    return replace(pressed, approach=approach, error=error)
