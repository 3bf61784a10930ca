"""The stepper of a contact with friction: the memory of tractions predicts, both contacts are solved.

Every step inherits tractions, displacements and work from the steps before, also on an elastic body.

Friction work. Where a cell slips the traction has the size of the bound b = mu p, against the slip s. Over a step the
bound is taken as linear,

    change of work per area = (b_before + b_after)/2 |s|,

which is of second order in the step, never negative, and exact at constant pressure however long the step is. (The mean of
the tractions themselves would not be: over a reversal of the slip it is zero.) In a step without length, where control and
tangential control jump together, the pressure is taken to come first, so that the bound is b_after throughout.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, static
from jaxcontact._support.status import Status, most_serious
from jaxcontact.contact.friction import Round, SlipProblem, length
from jaxcontact.contact.implicit import solve_partial_slip
from jaxcontact.contact.normal import Problem
from jaxcontact.history.memory import Memory
from jaxcontact.history.normal_step import contact_outcome, solved, status_of
from jaxcontact.history.time_loop import Lapse, Outcome, StepError, Stepper, Steps, after_step, present


class ShearCarry(NamedTuple):
    """The carry: the memory's fields; traction (3, nx, ny) of q_x, q_y and p, and its rate; moved (2, nx, ny): the
    tangential displacement; shift (2,) of the indenter; work (nx, ny): friction work per area; judged: the errors of the
    time steps in the pressure and in the tangential traction, empty without memory."""

    memory: Any
    traction: Array
    rate: Array
    moved: Array
    shift: Array
    work: Array
    judged: tuple[StepError, ...]


@pytree
class ShearStepper(Stepper):
    """A contact with friction, scaled; coefficient: of friction, (nx, ny); the further input of its steps is the target of
    the tangential control, (2,)."""

    summed = ("slip",)

    memory: Memory
    profile: Array
    tolerance: Array
    max_iterations: Array
    coefficient: Array
    load_controlled: bool = static()
    edges: tuple[bool, bool] = static()  # as in ``status_of``
    tangential_load_controlled: bool = static()
    coupled: bool = static()

    def start(self) -> ShearCarry:
        shape = self.profile.shape
        zeros = lambda *axes: jnp.zeros((*axes, *shape))
        fields = self.memory.start(shape)
        count = self.memory.delayed(fields, zeros()).rates.size
        judged = (StepError.none(count, shape), StepError.none(count, (2, *shape))) if count else ()
        return ShearCarry(fields, zeros(3), zeros(3), zeros(2), jnp.zeros(2), zeros(), judged)

    def advance(self, carry: ShearCarry, step: Steps) -> tuple[ShearCarry, Outcome]:
        operator, earlier, fields, _ = self.memory.predict(carry.memory, carry.traction, step.dt)
        problem = SlipProblem(
            operator=operator,
            gap=self.profile + earlier[2],
            drift=earlier[:2] - carry.moved,
            coefficient=self.coefficient,
            target=step.target,
            tangential_target=step.more - (0.0 if self.tangential_load_controlled else carry.shift),
            lowest=jnp.min(self.profile),
            load_controlled=self.load_controlled,
            tangential_load_controlled=self.tangential_load_controlled,
            coupled=self.coupled,
        )
        before = carry.traction[2]
        guess = before + carry.rate[2] * step.dt
        found = solve_partial_slip(problem, guess, carry.traction[:2], self.tolerance, self.max_iterations)
        p, sheared = found.normal.pressure, found.tangential
        traction = jnp.concatenate([sheared.traction, p[None]])
        moves = jnp.any(p > 0.0) | (not self.tangential_load_controlled)
        carry = ShearCarry(
            memory=self.memory.update(fields, traction, step.dt),
            traction=traction,
            rate=jax.lax.stop_gradient(traction - carry.traction)
            / jnp.where(step.dt > 0.0, step.dt, jnp.inf),
            moved=earlier[:2] + sheared.displacement + found.tangential_shift,
            shift=carry.shift + jnp.where(moves, sheared.shift, 0.0),
            work=carry.work + self._friction_work(found, before, step.dt),
            judged=self._judged(carry, traction, step.dt),
        )
        strain = self.memory.observe(carry.memory, traction, step.dt)
        return carry, self._outcome(problem, found, carry, earlier[2], strain)

    def _judged(self, carry: ShearCarry, traction: Array, dt: Array) -> tuple[StepError, ...]:
        """Return the errors of the time steps after a step, from the traction at its end, both with the delayed compliance
        under the pressure."""
        if not carry.judged:
            return ()
        before, lapse = carry.traction, Lapse(dt)
        along = jax.lax.stop_gradient(present(before[2], traction[2]))
        delayed = self.memory.delayed(carry.memory, along)
        pressed = after_step(carry.judged[0], delayed, before[2], traction[2], lapse, self.load_controlled)
        given = self.tangential_load_controlled
        sheared = after_step(carry.judged[1], delayed, before[:2], traction[:2], lapse, given)
        return pressed, sheared

    def overall(self, carry: ShearCarry) -> dict[str, Array]:
        return {"friction_work": carry.work}

    def _friction_work(self, found: Round, before: Array, dt: Array) -> Array:
        """Return the friction work of a step per area, (nx, ny); before: the pressure at its beginning."""
        after = found.normal.pressure
        mean = jnp.where(dt > 0.0, (before + after) / 2.0, after)
        slip = jnp.where(found.tangential.stick, 0.0, length(found.tangential.slip))
        return self.coefficient * mean * slip  # a stuck cell's slip is what the solver left

    def _outcome(
        self,
        problem: SlipProblem,
        found: Round,
        carry: ShearCarry,
        normal_shift: Array,
        strain: dict[str, Array],
    ) -> Outcome:
        """Return the outcome; normal_shift: the normal displacement left by earlier traction, (nx, ny)."""
        pressed, sheared = found.normal, found.tangential
        under, earlier = problem.under(found.normal_shift), normal_shift + found.normal_shift
        numbers = contact_outcome(under, pressed, normal_shift) | strain
        fields = {
            "pressure": numbers.pop("pressure"),
            "displacement": earlier + pressed.displacement,
            "traction": sheared.traction,
            "slip": sheared.slip,
            "stick": sheared.stick,
        }
        numbers |= {
            "iterations": found.taken,
            "time_step_error": jnp.max(jnp.stack([jnp.zeros(()), *(each.estimate for each in carry.judged)])),
            "error": jnp.maximum(pressed.error, sheared.error),
            "tangential_load": self._load(problem, sheared.traction),
            "tangential_displacement": carry.shift,
            "dissipated": jnp.sum(carry.work),
            "status": self._status(problem, under, found),
        }
        return Outcome(fields, numbers)

    def _load(self, problem: SlipProblem, traction: Array) -> Array:
        """Return the sum of the tractions; where it is given, with the derivative of what is given, free of rounding."""
        total = jnp.sum(traction, (1, 2))
        if not self.tangential_load_controlled:
            return total
        return problem.tangential_target + jax.lax.stop_gradient(total - problem.tangential_target)

    def _status(self, problem: SlipProblem, under: Problem, found: Round) -> Array:
        """Return the status of the normal contact, unless the tangential one has no solution, or none was found."""
        status = status_of(under, found.normal, self.tolerance, self.edges)
        tangential = found.tangential
        met = solved(tangential.error, self.tolerance, tangential.traction, tangential.slip, tangential.shift)
        status = most_serious((~met, Status.NOT_CONVERGED), status=status)
        if not self.tangential_load_controlled:
            return status
        asked = length(problem.tangential_target[:, None, None])[0, 0]
        room = jnp.sum(problem.coefficient * found.normal.pressure)
        return most_serious(((asked > 0.0) & (asked >= room), Status.GROSS_SLIP), status=status)
