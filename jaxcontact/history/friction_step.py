"""The stepper of a contact with friction: the memory of tractions predicts, pressure and traction are solved.

Every step inherits tractions, displacements and work from the steps before, also on an elastic body.

Friction work. Where a cell slips the traction has the size of the bound b = mu p, against the slip s. Over a step the
bound is taken as linear,

    change of work per area = (b_before + b_after)/2 |s|,

which is of second order in the step, never negative, and exact at constant pressure however long the step is. (The mean of
the tractions themselves would not be: over a reversal of the slip it is zero.) In a step without length, where control and
tangential control jump together, the pressure is taken to come first, so that the bound is b_after throughout.

With adhesion the bound is b = mu p_c + tau in the cells that touch, of the pressure p_c that contact carries (the net
pressure plus the attraction) and a shear strength tau, and the tractions are taken not to change the pressure: each problem
is solved once, the normal one as in ``indent``.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact._support.reductions import lowest_point
from jaxcontact._support.status import Status, most_serious
from jaxcontact.contact.friction import Round, SlipProblem, TangentialProblem, largest_traction, length
from jaxcontact.contact.implicit import solve_partial_slip, solve_tangential
from jaxcontact.contact.law import UNILATERAL
from jaxcontact.history.memory import Memory
from jaxcontact.history.normal_step import (
    AdhesionState,
    contact_outcome,
    initial_adhesion,
    solve_step,
    solved,
    status_of,
)
from jaxcontact.history.time_loop import Lapse, Outcome, StepError, Stepper, Steps, after_step, present
from jaxcontact.operators.coupled import TractionOperator


class ShearCarry(NamedTuple):
    """The state of a contact with friction between two steps.

    memory: the fields of the memory; traction: q_x, q_y and p, (3, nx, ny), and its rate; moved: the tangential
    displacement, (2, nx, ny); shift: of the indenter, (2,); work: of friction per area, (nx, ny); time_step_error: of
    pressure and of tangential traction, empty of an elastic body; adhesion_state, and bound (nx, ny): the largest traction
    of each cell, both None without adhesion.
    """

    memory: Any
    traction: Array
    rate: Array
    moved: Array
    shift: Array
    work: Array
    time_step_error: tuple[StepError, ...]
    adhesion_state: AdhesionState | None = None
    bound: Array | None = None


@pytree
class ShearStepper(Stepper):
    """A contact with friction, scaled; coefficient: of friction, (nx, ny); coupled: whether traction and pressure move the
    surface in each other's direction; strength: the shear strength of a contact with adhesion, (nx, ny), None without; the
    further input of its steps is the target of the tangential control, (2,)."""

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
    law: Any = UNILATERAL  # or an Attraction
    strength: Array | None = None

    def start(self) -> ShearCarry:
        shape = self.profile.shape
        zeros = lambda *axes: jnp.zeros((*axes, *shape))
        fields = self.memory.start(shape)
        count = self.memory.delayed(fields, zeros()).rates.size
        time_step_error = (StepError.none(count, shape), StepError.none(count, (2, *shape))) if count else ()
        carry = ShearCarry(fields, zeros(3), zeros(3), zeros(2), jnp.zeros(2), zeros(), time_step_error)
        if self.strength is None:
            return carry
        return carry._replace(adhesion_state=initial_adhesion(self.law, zeros()), bound=zeros())

    def advance(self, carry: ShearCarry, step: Steps) -> tuple[ShearCarry, Outcome]:
        dt, before = step.dt, carry.traction[2]

        # 1. The contact problem, with the displacement that earlier tractions have left. The drift is the movement of the
        # surface since the last step, without that under the traction of this step. A given tangential displacement is
        # counted from the start, and the shift from the last step on.
        operator, earlier, fields, *_ = self.memory.predict(carry.memory, carry.traction, dt)
        problem = SlipProblem(
            operator=operator,
            gap=self.profile + earlier[2],
            drift=earlier[:2] - carry.moved,
            coefficient=self.coefficient,
            target=step.target,
            tangential_target=step.more - (0.0 if self.tangential_load_controlled else carry.shift),
            lowest=lowest_point(self.profile),
            load_controlled=self.load_controlled,
            tangential_load_controlled=self.tangential_load_controlled,
            coupled=self.coupled,
        )

        # 2. Pressure and traction, from an extrapolated pressure and the last traction; bounds: b before and after the step.
        guess = before + carry.rate[2] * dt
        adhesion_state: AdhesionState | None = None
        adhesion_numbers: dict[str, Array] = {}
        if self.strength is None:
            found = solve_partial_slip(
                problem, guess, carry.traction[:2], self.tolerance, self.max_iterations
            )
            pressed = found.normal
            bounds = self.coefficient * before, self.coefficient * pressed.pressure
        else:
            # with adhesion the pressure first, as in ``indent``: the traction does not change it
            normal = replace(problem.under(0.0), law=self.law)
            guess = jax.lax.stop_gradient(guess)
            pressed, adhesion_state, adhesion_numbers = solve_step(
                normal, guess, carry.adhesion_state, self.tolerance, self.max_iterations
            )
            # then the traction, within b = mu p_c + tau where the surfaces touch
            assert carry.bound is not None and isinstance(operator, TractionOperator)
            carried, start = pressed.carried, carry.traction[:2]
            bound = largest_traction(self.coefficient, carried, self.strength)
            bounds = carry.bound, bound
            tangential = TangentialProblem(
                operator,
                bound,
                carried > 0.0,
                problem.drift,
                problem.tangential_target,
                self.tangential_load_controlled,
            )
            displacement = operator.tangential_from_tangential(start)
            left = self.max_iterations - pressed.iterations
            sheared = solve_tangential(tangential, start, displacement, self.tolerance, left)
            uncoupled = jnp.zeros_like(start)
            found = Round(
                normal=pressed,
                tangential=sheared,
                tangential_by_pressure=uncoupled,
                normal_by_traction=uncoupled[0],
                taken=pressed.iterations + sheared.iterations,
                rounds=jnp.ones((), int),
                settled=jnp.ones((), bool),
            )
        sheared, p = found.tangential, pressed.pressure
        traction = jnp.concatenate([sheared.traction, p[None]])

        # 3. The work of friction (formula at the head of the module). The slip of a cell that sticks is an error of the
        # solver.
        mean = jnp.where(dt > 0.0, (bounds[0] + bounds[1]) / 2.0, bounds[1])
        slip = jnp.where(sheared.stick, 0.0, length(sheared.slip))
        work = carry.work + mean * slip

        # 4. The errors of the time steps, both with the delayed compliance under the pressure.
        time_step_error: tuple[StepError, ...] = ()
        if carry.time_step_error:
            lapse, along = Lapse(dt), jax.lax.stop_gradient(present(before, p))
            if adhesion_state is not None:
                lapse = lapse._replace(touches=jnp.any(pressed.carried > 0.0))
            delayed = self.memory.delayed(carry.memory, along)
            time_step_error = (
                after_step(carry.time_step_error[0], delayed, before, p, lapse, self.load_controlled),
                after_step(
                    carry.time_step_error[1],
                    delayed,
                    carry.traction[:2],
                    traction[:2],
                    lapse,
                    self.tangential_load_controlled,
                ),
            )

        # 5. The state after the step. Under a given tangential load an indenter without contact stays where it is, since
        # nothing determines its shift.
        moves = jnp.any(pressed.carried > 0.0) | (not self.tangential_load_controlled)
        rate = jax.lax.stop_gradient(traction - carry.traction) / jnp.where(dt > 0.0, dt, jnp.inf)
        carry = ShearCarry(
            memory=self.memory.update(fields, traction, dt),
            traction=traction,
            rate=rate,
            moved=earlier[:2] + sheared.displacement + found.tangential_by_pressure,
            shift=carry.shift + jnp.where(moves, sheared.shift, 0.0),
            work=work,
            time_step_error=time_step_error,
            adhesion_state=adhesion_state,
            bound=None if self.strength is None else bounds[1],
        )

        # 6. The status of the normal contact, unless the tangential one has no solution, or none was found. There is none
        # for a given load that exceeds the sum of the bounds.
        under = replace(problem.under(found.normal_by_traction), law=self.law)
        total = jnp.sum(sheared.traction, (1, 2))
        met = solved(sheared.error, self.tolerance, sheared.traction, sheared.slip, sheared.shift)
        status = status_of(under, pressed, self.tolerance, self.edges)
        status = most_serious((~met, Status.NOT_CONVERGED), status=status)
        if self.tangential_load_controlled:
            given = length(problem.tangential_target[:, None, None])[0, 0]
            largest = jnp.sum(bounds[1])
            status = most_serious(((given > 0.0) & (given >= largest), Status.GROSS_SLIP), status=status)
            # with the derivative of the given load, free of rounding
            total = problem.tangential_target + jax.lax.stop_gradient(total - problem.tangential_target)

        # 7. Fields and numbers of the result.
        numbers = contact_outcome(under, pressed, earlier[2])
        numbers |= self.memory.observe(carry.memory, traction, dt)
        shown = {
            "pressure": numbers.pop("pressure"),
            "displacement": earlier[2] + found.normal_by_traction + pressed.displacement,
            "traction": sheared.traction,
            "slip": sheared.slip,
            "stick": sheared.stick,
        }
        if "indenter_displacement" in numbers:
            shown["indenter_displacement"] = numbers.pop("indenter_displacement")
        if self.strength is not None:
            shown["contact_pressure"] = pressed.carried
        numbers |= adhesion_numbers
        numbers |= {
            "iterations": found.taken,
            "time_step_error": jnp.max(
                jnp.stack([jnp.zeros(()), *(each.estimate for each in time_step_error)])
            ),
            "error": jnp.maximum(pressed.error, sheared.error),
            "tangential_load": total,
            "tangential_displacement": carry.shift,
            "dissipated": jnp.sum(work),
            "status": status,
        }
        return carry, Outcome(shown, numbers)

    def overall(self, carry: ShearCarry) -> dict[str, Array]:
        return {"friction_work": carry.work}
