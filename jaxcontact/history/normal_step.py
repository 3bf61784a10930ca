"""One step in time of a normal contact, ``PressStepper.advance``.

The memory predicts the displacement that earlier pressure has left, the contact is solved on it, and the memory is updated.
The step is the same for every kind of memory (``history.memory``). The contact with adhesion is at the end of the module.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact._support.reductions import largest, lowest_point, total, totals
from jaxcontact._support.status import Status, most_serious
from jaxcontact.contact.adhesive import Attraction, Start, with_given
from jaxcontact.contact.edge import contact_cells, memory_factor
from jaxcontact.contact.implicit import solve_attracted, solve_contact
from jaxcontact.contact.law import UNILATERAL, Hardness
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.history.memory import Memory
from jaxcontact.history.time_loop import Lapse, Outcome, StepError, Stepper, Steps, after_step, present
from jaxcontact.operators.operator import Operator

LEAST_ACROSS = 3  # cells across a contact, below which it is too coarse
LEAST_CELLS = 0.25 * math.pi * LEAST_ACROSS**2  # cells of a circle with that diameter
# gap in numbers of cells along x, above which there is no surface opposite, as beside a punch (``indenters.shapes``)
BESIDE = 500.0
LOAD_MET = 1e-6  # largest difference of the sum of pressures from the load, relative to it, in a solution


class PressCarry(NamedTuple):
    """The state of a normal contact between two steps.

    memory: the fields of the memory; pressure: of the last step, (nx, ny), and rate: its change over the length of that
    step; adhesion_state: None without adhesion; time_step_error: None of an elastic body; dent: the permanent indentation of
    surfaces that yield, (nx, ny), None without a hardness.
    """

    memory: Any
    pressure: Array
    rate: Array
    adhesion_state: AdhesionState | None
    time_step_error: StepError | None
    dent: Array | None = None


@pytree
class PressStepper(Stepper):
    """The step of a normal contact, scaled; ``Steps.more`` is the input of the memory.

    windowed: as in ``Problem``, static; edges: as in ``status_of``, static; law: a ContactLaw, or an Attraction.
    """

    memory: Memory
    profile: Array
    tolerance: Array
    max_iterations: Array
    load_controlled: bool = static()
    edges: tuple[bool, bool] = static()
    law: Any = UNILATERAL
    windowed: bool = static(default=True)

    @property
    def inherits(self) -> bool:
        return self.memory.inherits or isinstance(self.law, Hardness)

    def start(self) -> PressCarry:
        zero = jnp.zeros_like(self.profile)
        fields = self.memory.start(zero.shape)
        time_step_error = (
            StepError.none(self.memory.delayed(fields, zero).rates.size, zero.shape)
            if self.memory.inherits
            else None
        )
        dent = zero if isinstance(self.law, Hardness) else None
        return PressCarry(fields, zero, zero, initial_adhesion(self.law, zero), time_step_error, dent)

    def advance(self, carry: PressCarry, step: Steps) -> tuple[PressCarry, Outcome]:
        # 1. The operator of this step, and the displacement that earlier pressure has left. It belongs to the gap, as do
        # growth, which raises the surface, and a dent, which lowers it.
        operator, earlier, fields, raised, drag = self.memory.predict(carry.memory, carry.pressure, step.more)
        lowest, gap = lowest_point(self.profile), self.profile + earlier - raised
        if carry.dent is not None:
            gap = gap + carry.dent

        # 2. The contact, by ``solve_contact``, with adhesion by ``solve_attracted``; the search starts from the pressure
        # extrapolated over the step.
        problem = Problem(
            operator, gap, step.target, lowest, self.load_controlled, self.law, drag, self.windowed
        )
        guess = jax.lax.stop_gradient(carry.pressure + carry.rate * step.dt)
        solution, adhesion_state, adhesion_numbers = solve_step(
            problem, guess, carry.adhesion_state, self.tolerance, self.max_iterations
        )
        pressure = solution.pressure

        # 3. The memory with the new pressure. In sliding with adhesion, friction is that of the contact pressure alone.
        if drag is not None:
            step = step._replace(more=step.more._replace(sheared=drag.traction(solution.carried)))
        fields = self.memory.update(fields, pressure, step.more)
        rate = jax.lax.stop_gradient(pressure - carry.pressure) / jnp.where(step.dt > 0.0, step.dt, jnp.inf)

        # 4. Numbers and fields of the result.
        numbers = contact_outcome(problem, solution, earlier if self.memory.inherits else None) | {
            "status": status_of(problem, solution, self.tolerance, self.edges)
        }
        if adhesion_state is not None:
            adhesion_numbers |= self._energies(adhesion_state, fields, pressure)
        numbers |= self.memory.observe(fields, pressure, step.more) | adhesion_numbers
        shown = {
            "pressure": numbers.pop("pressure"),
            "displacement": earlier - raised + solution.displacement,
        }
        if "indenter_displacement" in numbers:
            shown["indenter_displacement"] = numbers.pop("indenter_displacement")
        if drag is not None:
            shown["contact_pressure"] = solution.carried
        dent = self._dented(carry.dent, problem, solution)
        if dent is not None:  # a permanent displacement
            shown |= {"displacement": shown["displacement"] + dent, "dent": dent}

        # 5. The error of the time steps.
        lapse = self._lapse(step, numbers["contact_area"])
        if adhesion_state is not None:
            lapse = lapse._replace(touches=numbers["contact_area"] > 0.0)
        time_step_error = self._time_step_error(carry, fields, pressure, lapse)
        numbers["time_step_error"] = jnp.zeros(()) if time_step_error is None else time_step_error.estimate
        after = PressCarry(fields, pressure, rate, adhesion_state, time_step_error, dent)
        return after, Outcome(shown, numbers)

    def _dented(self, dent: Array | None, problem: Problem, solution: Solution) -> Array | None:
        """Return the dent after a step, deeper where cells yield; the gap of the problem contains the dent before it."""
        if dent is None:
            return None
        return dent + self.law.dent(
            solution.pressure, problem.gap + solution.displacement - solution.approach
        )

    def _time_step_error(
        self, carry: PressCarry, fields: Any, pressure: Array, lapse: Lapse
    ) -> StepError | None:
        """Return the error of the time steps after a step, from the memory's fields after it and its new pressure."""
        if carry.time_step_error is None:
            return None
        delayed = self.memory.delayed(*jax.lax.stop_gradient((fields, present(carry.pressure, pressure))))
        return after_step(
            carry.time_step_error, delayed, carry.pressure, pressure, lapse, self.load_controlled
        )

    def _lapse(self, step: Steps, contact_area: Array) -> Lapse:
        """Return the time in a step; contact_area: scaled."""
        return Lapse(step.dt)

    def _energies(self, adhesion_state: AdhesionState, fields: Any, pressure: Array) -> dict[str, Array]:
        """Return the energy that the body has dissipated under a contact with adhesion."""
        stored = self.memory.stored_energy(*jax.lax.stop_gradient((fields, pressure)))
        return {"viscous_energy": adhesion_state.work - stored}


def contact_outcome(problem: Problem, solution: Solution, earlier: Array | None = None) -> dict[str, Array]:
    """Collect the scaled result fields of one solved contact, by the names of a result.

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
    """Return whether the error is within the tolerance and all ``found`` numbers are finite, (); False for an error of
    nan."""
    total = sum((jnp.sum(values) for values in found), start=jnp.zeros(()))
    return (error <= tolerance) & jnp.isfinite(total)


def plane_strain(field: Array) -> bool:
    """Return whether a field (nx, ny) is that of a problem in plane strain, uniform along y."""
    return field.shape[1] == 1


def status_of(
    problem: Problem, solution: Solution, tolerance: Array, edges: tuple[bool, bool] = (True, True)
) -> Array:
    """Return the status of a contact by itself, without what it inherits of earlier steps: the most serious of a response or
    a result that is not finite, surfaces that a tensile load has separated, a load above the hardness, no convergence,
    contact (or attraction) at the edge of the grid, and too few cells in contact.

    edges: whether contact at the sides across x, and across y, would continue beyond the grid, static.
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
        # without adhesion every pressure of the search has the given sum, with it only the solution, within the tolerance
        least = LOAD_MET if solution.separated is None else jnp.maximum(LOAD_MET, tolerance)
        met = met & (jnp.abs(load - problem.target) <= least * size)
    coarse = some & (cells < (LEAST_ACROSS if plane_strain(active) else LEAST_CELLS))
    if not plane_strain(active):
        # a long contact has many cells, and few across: columns and rows of the grid in which there is any
        across = [jnp.sum(jnp.any(active, axis)) for axis in (0, 1)]
        coarse = coarse | (some & (jnp.minimum(*across) < LEAST_ACROSS))
    separated = jnp.asarray(False) if solution.separated is None else solution.separated
    finite = jnp.isfinite(problem.operator.confined_compliance(p.shape)) & (
        jnp.isfinite(moved + size) | separated
    )
    # surfaces that yield carry at most the hardness times the area opposite the indenter
    yielded = []
    if isinstance(problem.law, Hardness) and problem.load_controlled:
        reached = problem.gap - problem.lowest < BESIDE * p.shape[0]
        yielded = [(~problem.law.carries(problem.target, reached), Status.LOAD_ABOVE_HARDNESS)]
    return most_serious(
        (~finite, Status.NOT_FINITE),
        (separated, Status.PULLED_OFF),
        *yielded,
        (~met, Status.NOT_CONVERGED),
        (edge, Status.AT_EDGE),
        (coarse, Status.TOO_COARSE),
    )


# A step with adhesion: the solution follows its branch of equilibria, and jumps where the branch ends.
#
# Each search starts from the state of the previous step, so that the solution stays on its branch while the branch exists.
# The energy shows whether it did. With the displacement of the body split into K p, of the operator K of the step, and the
# rest, which belongs to the gap h = surface - approach, an equilibrium that changes smoothly obeys
#
#     dE = -<p, dh>     under an approach,      d(E - load x approach) = -<p, d surface> - approach d load     under a load.
#
# Integrated over a step by the trapezoidal rule, the right side has an error of a part of the product P = <dp, dh> (under a
# load <dp, d surface> + d load d approach), of at most half of it where p is a monotonic function of h. The energy that is
# missing beyond that was released in a jump. A step is a jump
#
# - if the search met an unstable state, and more than ``SMOOTH`` P is missing;
# - if more than ``SMOOTH`` x ``CERTAIN`` P = P/2 is missing: a search may pass a jump without meeting an unstable state, as
#   at jumps into contact;
# - if a tensile load has separated the surfaces. Their energy is then not bounded, and is not counted.
#
# Measured on a ball at Tabor numbers of 0.5 and 2, with steps of a quarter of the approach at pull-off: where unstable
# states were met, less than 0.07 P is missing in smooth steps, and 0.12 to 1.2 P in jumps. Not found are jumps of a part of
# the contact that are small compared with the change of the whole in the same step, and the jump into contact of a first
# step.


SMOOTH = 0.1  # part of P that may be missing in a smooth change
CERTAIN = 5.0  # factor on ``SMOOTH`` where no unstable state was met
LEAST = 1e-4  # missing energy, over that of the attraction, below which there is no jump
# where the gap of a paraboloid grows by the range of the attraction over n cells, it is taken too wide by 1/(3 n^2) ranges
CURVED = 3.0
# contact modulus E* times the confined compliance of a half-space, over the side of a cell, by which E* follows from the
# operator; True: plane strain
CONFINED = {False: 0.83, True: 1.27}


class AdhesionState(NamedTuple):
    """The state of a contact with adhesion at the end of a step, with which the next one begins.

    surface: profile and displacement, pressure, and contact, whether cells touch, (nx, ny) each; approach (); none: whether
    no step has been made yet, (); jumps: their number since the start, energy: what they have released, and work: what the
    pressure has done on the body, () each.
    """

    surface: Array
    pressure: Array
    contact: Array
    approach: Array
    none: Array
    jumps: Array
    energy: Array
    work: Array


def initial_adhesion(law: Any, profile: Array) -> AdhesionState | None:
    """Return the ``AdhesionState`` before the first step, None for a law without attraction."""
    if not isinstance(law, Attraction):
        return None
    zero, number = jnp.zeros_like(profile), jnp.zeros(())
    return AdhesionState(
        zero, zero, zero > 0.0, number, jnp.asarray(True), jnp.zeros((), int), number, number
    )


def solve_step(
    problem: Problem, guess: Array, before: AdhesionState | None, tolerance: Array, max_iterations: Array
) -> tuple[Solution, AdhesionState | None, dict[str, Array]]:
    """Solve the contact of a step, with or without adhesion.

    before: the ``AdhesionState`` of the previous step, None without adhesion. Return the solution, the state after the step,
    and the numbers of the result that adhesion adds.
    """
    if before is None:  # without adhesion
        return solve_contact(problem, guess, tolerance, max_iterations), None, {}

    # 1. The contact, with the law as the cells can resolve it. The search starts from the extrapolated pressure, or from the
    # previous one if there was no contact or the extrapolation changes the pressure by more than its largest value.
    problem = replace(problem, law=resolved(problem.law, problem.operator, problem.gap.shape))
    apart = ~jnp.any(before.contact)
    far = largest(jnp.abs(guess - before.pressure)) > largest(jnp.abs(before.pressure))
    guess = jnp.where(apart | far, before.pressure, guess)
    start = Start(guess, before.contact, before.none)
    found = solve_attracted(problem, start, tolerance, max_iterations)
    held, last = jax.lax.stop_gradient((problem, found))
    if not problem.operator.symmetric or problem.drag is not None:
        # only the even part of the operator has an energy; the displacement by the rest is put into its gap
        held = with_given(held, last.pressure, last.carried)
        last = replace(last, displacement=held.operator(last.pressure))
    assert last.separated is not None and last.unstable is not None

    # 2. The energy that is missing (``released``): the decrease of E = 1/2 <p, K p> - sum int s dg [- load x approach], with
    # the operator of the step, plus the work done in the step by the trapezoidal rule. ``moved`` is the change of the
    # surface apart from K p, ``product`` is P of the comment above.
    p, q = before.pressure, last.pressure
    displacement_before = held.operator(p)
    gap = jnp.maximum(held.gap + last.displacement - last.approach, 0.0)
    attracted = held.law.energy(jnp.maximum(before.surface - before.approach, 0.0))
    later = held.law.energy(gap)
    decrease = 0.5 * (jnp.sum(p * displacement_before) - jnp.sum(q * last.displacement)) - attracted + later
    moved = held.gap - (before.surface - displacement_before)
    approach_change = last.approach - before.approach
    load, load_change = jnp.sum(p + q) / 2.0, jnp.sum(q - p)
    if held.load_controlled:
        decrease = decrease + jnp.sum(q) * last.approach - jnp.sum(p) * before.approach
        work = -0.5 * jnp.sum((p + q) * moved) - 0.5 * (last.approach + before.approach) * load_change
        product = jnp.sum(jnp.abs((q - p) * moved)) + jnp.abs(load_change * approach_change)
    else:
        work = -0.5 * jnp.sum((p + q) * moved) + load * approach_change
        product = jnp.sum(jnp.abs((q - p) * (moved - approach_change)))
    released = decrease + work

    # 3. A jump: the surfaces have separated, or more energy is missing than the error of the trapezoidal rule.
    smooth = SMOOTH * product + LEAST * jnp.maximum(attracted, later)
    separated = last.separated & jnp.any(before.contact)
    jumped = ~before.none & (released > jnp.where(last.unstable, 1.0, CERTAIN) * smooth)

    # 4. The state after the step, with the work of the pressure on the body, by the trapezoidal rule.
    surface = held.gap + last.displacement
    way = surface - jnp.where(before.none, held.gap, before.surface)
    after = AdhesionState(
        surface,
        q,
        last.carried > 0.0,
        last.approach,
        jnp.asarray(False),
        before.jumps + (separated | jumped),
        before.energy + jnp.where(jumped & ~separated, released, 0.0),
        before.work + 0.5 * jnp.sum((p + q) * way),
    )

    numbers = {
        "jumps": after.jumps,
        "jump_energy": after.energy,
        "cohesive_cells": cohesive_cells(problem, found),
    }
    return found, after, numbers


def resolved(law: Attraction, operator: Operator, shape: tuple[int, int]) -> Attraction:
    """Return a law of attraction as the cells of a grid can resolve it."""
    return replace(law, law=law.law.resolved(operator.even().cell_compliance(shape)))


def cohesive_cells(problem: Problem, solution: Solution) -> Array:
    """Return the resolution of the attraction in a contact whose law is ``resolved``, ().

    It is the smaller of the cells along the cohesive zone at the edge of the contact, and the cells along which the gap
    grows by the range of the attraction, from its curvature. The latter is smaller for a long range on a stiff body. The gap
    is taken as linear between the centres of cells (``contact.adhesive``), so that where it has second differences d from
    cell to cell, it is on average sum(d)/12 too wide.
    """
    held, last = jax.lax.stop_gradient((problem, solution))
    gap = jnp.maximum(held.gap + last.displacement - last.approach, 0.0)
    attraction = jnp.where(last.carried > 0.0, 0.0, held.law.law.traction(gap))
    second = lambda axis: jnp.pad(
        jnp.diff(gap, 2, axis), [(1, 1) if k == axis and n > 2 else (0, 0) for k, n in enumerate(gap.shape)]
    )
    bent = sum((second(axis) for axis in (0, 1) if gap.shape[axis] > 2), start=jnp.zeros_like(gap))
    sum_ = jnp.sum(attraction)
    wider = jnp.sum(attraction * bent) / 12.0 / jnp.where(sum_ > 0.0, sum_, 1.0)
    some = (sum_ > 0.0) & (wider > 0.0)
    reach = held.law.law.characteristic_range / (CURVED * jnp.where(some, wider, 1.0))
    over_range = jnp.where(some, jnp.sqrt(jnp.where(some, reach, 1.0)), jnp.inf)
    modulus = CONFINED[plane_strain(gap)] / problem.operator.even().confined_compliance(gap.shape)
    return jnp.minimum(problem.law.law.zone_length(modulus), over_range)
