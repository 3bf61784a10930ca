"""Normal and tangential contact together: pressure bounds the traction, traction moves the pressure.

    g = gap + K_zz p + K_zt q - approach >= 0,  p >= 0,  p g = 0      (``contact.normal``)
    s = K_tt q + K_tz p + drift - shift,  |q| <= mu p, ...            (``contact.friction``)

The one is solved with the other's last result until both hold at once (P. D. Panagiotopoulos, Ing. Arch. 44 (1975)
421). Each round brings the error down by a factor of about the friction coefficient times Dundurs' beta; where solids
are similar K_zt and K_tz vanish and one round is all.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._pytree import pytree, static
from jaxcontact.contact import friction, normal
from jaxcontact.contact.friction import TangentialProblem, TangentialSolution
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.operators.base import TractionOperator

LOOSE, TIGHTER = 1e-3, 0.2  # tolerance of the first round, and how it falls from round to round
ROUNDS = 60


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

    def pressed(self, traction: Array) -> Problem:
        """The normal problem under a traction."""
        gap = self.gap + self.operator.sunk(traction) if self.coupled else self.gap
        return Problem(self.operator.normal, gap, self.target, self.lowest, self.load_controlled)

    def sheared(self, pressure: Array) -> TangentialProblem:
        """The tangential problem under a pressure."""
        drift = self.drift + self.operator.drawn(pressure) if self.coupled else self.drift
        bound = self.coefficient * pressure
        target = self.tangential_target
        return TangentialProblem(self.operator, bound, drift, target, self.tangential_load_controlled)


class Round(NamedTuple):
    """What a round found; taken: iterations of all rounds, (); rounds (); settled: this one had nothing to change."""

    normal: Solution
    tangential: TangentialSolution
    taken: Array
    rounds: Array
    settled: Array


def solve(
    problem: SlipProblem, pressure: Array, traction: Array, tolerance: Array, max_iterations: Array
) -> Round:
    """Solve from a start pressure and traction. The caller finds in both ``error`` whether the tolerance was met."""

    def again(pressure: Array, traction: Array, taken: Array, rounds: Array, goal: Array) -> Round:
        left = max_iterations - taken
        pressed = normal.solve(problem.pressed(traction), pressure, goal, left)
        sheared = friction.solve(problem.sheared(pressed.pressure), traction, goal, left - pressed.iterations)
        used = pressed.iterations + sheared.iterations
        settled = (used == 0) & (goal <= tolerance)
        return Round(pressed, sheared, taken + used, rounds + 1, settled)

    zero = jnp.zeros((), int)
    if not problem.coupled:
        return again(pressure, traction, zero, zero, tolerance)
    goal_of = lambda rounds: jnp.maximum(tolerance, LOOSE * TIGHTER**rounds)
    going = lambda r: ~r.settled & (r.taken < max_iterations) & (r.rounds < ROUNDS)
    further = lambda r: again(
        r.normal.pressure, r.tangential.traction, r.taken, r.rounds, goal_of(r.rounds.astype(float))
    )
    return jax.lax.while_loop(going, further, again(pressure, traction, zero, zero, goal_of(0.0)))
