"""The stepper of a normal contact: the memory predicts, the contact is solved, the memory is updated.

What the memory is made of, and what the kernels are, it does not know.
"""

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, static
from jaxcontact._support.reductions import total, totals
from jaxcontact._support.status import Status, most_serious
from jaxcontact.contact.edge import contact_cells, memory_factor
from jaxcontact.contact.law import UNILATERAL
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.history.adhering import Adhering, at_rest, solve_step
from jaxcontact.history.march import Outcome, Stepper, Steps
from jaxcontact.history.memory import Memory

LEAST_ACROSS = 3
LEAST_CELLS = 0.25 * math.pi * LEAST_ACROSS**2
LOAD_MET = 1e-6  # of the load: a sum of pressures farther from it is no solution


class PressCarry(NamedTuple):
    """The carry: the memory's fields, the last pressure (nx, ny), and its rate of change over the last step; adhering: the
    last state of a contact with adhesion, None without.
    """

    memory: Any
    pressure: Array
    rate: Array
    adhering: Adhering | None


@pytree
class PressStepper(Stepper):
    """A normal contact, scaled; the further input of its steps is that of the memory."""

    memory: Memory
    profile: Array
    tolerance: Array
    max_iterations: Array
    load_controlled: bool = static()
    edges: tuple[bool, bool] = static()  # as in ``status_of``
    law: Any = UNILATERAL  # a ContactLaw, or an Attraction

    @property
    def inherits(self) -> bool:
        return self.memory.inherits

    def start(self) -> PressCarry:
        zero = jnp.zeros_like(self.profile)
        return PressCarry(self.memory.start(zero.shape), zero, zero, at_rest(self.law, zero))

    def advance(self, carry: PressCarry, step: Steps) -> tuple[PressCarry, Outcome]:
        operator, earlier, fields, raised = self.memory.predict(carry.memory, carry.pressure, step.more)
        lowest, gap = jnp.min(self.profile), self.profile + earlier - raised
        problem = Problem(operator, gap, step.target, lowest, self.load_controlled, self.law)
        guess = jax.lax.stop_gradient(carry.pressure + carry.rate * step.dt)
        solution, adhering, told = solve_step(
            problem, guess, carry.adhering, self.tolerance, self.max_iterations
        )
        pressure = solution.pressure
        fields = self.memory.update(fields, pressure, step.more)
        rate = jax.lax.stop_gradient(pressure - carry.pressure) / jnp.where(step.dt > 0.0, step.dt, jnp.inf)
        numbers = contact_outcome(problem, solution, earlier if self.inherits else None) | {
            "status": status_of(problem, solution, self.tolerance, self.edges)
        }
        if adhering is not None:
            told |= self._energies(adhering, fields, pressure)
        numbers |= self.memory.observe(fields, pressure, step.more) | told
        shown = {
            "pressure": numbers.pop("pressure"),
            "displacement": earlier - raised + solution.displacement,
        }
        return PressCarry(fields, pressure, rate, adhering), Outcome(shown, numbers)

    def _energies(self, adhering: Adhering, fields: Any, pressure: Array) -> dict[str, Array]:
        """Return the energy that the body has dissipated under a contact with adhesion."""
        stored = self.memory.stored_energy(*jax.lax.stop_gradient((fields, pressure)))
        return {"viscous_energy": adhering.work - stored}


def contact_outcome(problem: Problem, solution: Solution, earlier: Array | None = None) -> dict[str, Array]:
    """Return what a solved contact says by itself, scaled, by the names of a result.

    earlier: the displacement (nx, ny) left by earlier pressure; None without memory.
    """
    p, u, operator = solution.pressure, solution.displacement, problem.operator
    gap = problem.gap + u - solution.approach
    compliance = operator.confined_compliance(p.shape)
    if earlier is not None:
        compliance = compliance * memory_factor(earlier, u, operator.periodic)
    return {
        "pressure": p,
        "approach": solution.approach,
        "load": total(p),
        "contact_area": total(problem.law.touching(solution.carried)),
        "smooth_area": contact_cells(
            solution.carried, gap, compliance, operator.periodic, operator.cell_ratio(p.shape)
        ),
        "iterations": solution.iterations,
        "error": solution.error,
    }


def solved(error: Array, tolerance: Array, *found: Array) -> Array:
    """Return whether the tolerance was met and everything found is finite, (); not so where the error is nan."""
    total = sum((jnp.sum(values) for values in found), start=jnp.zeros(()))
    return (error <= tolerance) & jnp.isfinite(total)


def plane_strain(field: Array) -> bool:
    """Return whether a field (nx, ny) is that of a problem in plane strain, uniform along y."""
    return field.shape[1] == 1


def status_of(
    problem: Problem, solution: Solution, tolerance: Array, edges: tuple[bool, bool] = (True, True)
) -> Array:
    """Return the status of a contact by itself: fine, a response or a result that is not finite, surfaces that a tensile
    load has separated, no convergence, contact (or attraction) at the grid's edge, or too few cells in it.

    edges: whether contact at the sides across x, and across y, goes on where the grid does not, static.
    """
    gap = problem.gap + solution.displacement - solution.approach
    pressed, active = problem.target > 0.0, problem.law.acting(solution.carried, gap)
    first_and_last = lambda axis: jnp.any(jnp.take(active, jnp.array([0, -1]), axis=axis))
    edge = jnp.any(jnp.stack([jnp.asarray(there) & first_and_last(axis) for axis, there in enumerate(edges)]))
    p, touching = solution.pressure, problem.law.touching(solution.carried)
    cells, touched, load, size, moved = totals(active, touching, p, jnp.abs(p), solution.displacement)
    some, met = touched > 0.0, solved(solution.error, tolerance, solution.approach, moved)
    if problem.load_controlled:
        some = some | pressed
        # without adhesion each pressure is brought to the load; with it the load is met with the tolerance
        least = LOAD_MET if solution.separated is None else jnp.maximum(LOAD_MET, tolerance)
        met = met & (jnp.abs(load - problem.target) <= least * size)
    coarse = some & (cells < (LEAST_ACROSS if plane_strain(active) else LEAST_CELLS))
    separated = jnp.asarray(False) if solution.separated is None else solution.separated
    finite = jnp.isfinite(problem.operator.confined_compliance(p.shape)) & (
        jnp.isfinite(moved + size) | separated
    )
    return most_serious(
        (~finite, Status.NOT_FINITE),
        (separated, Status.PULLED_OFF),
        (~met, Status.NOT_CONVERGED),
        (edge, Status.AT_EDGE),
        (coarse, Status.TOO_COARSE),
    )
