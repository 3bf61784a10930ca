"""The stepper of a normal contact: the memory predicts, the contact is solved, the memory is updated.

It knows neither the kind of memory nor that of the kernels.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact._support.reductions import largest, total, totals
from jaxcontact._support.status import Status, most_serious
from jaxcontact.contact.adhesive import Attraction, Start, with_given
from jaxcontact.contact.edge import contact_cells, memory_factor
from jaxcontact.contact.implicit import solve_adhesive, solve_adhesive_in_turn, solve_contact
from jaxcontact.contact.law import UNILATERAL, Hardness
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.history.memory import Memory
from jaxcontact.history.time_loop import Lapse, Outcome, StepError, Stepper, Steps, after_step, present

# A step of the march with adhesion: the branch that it follows, and the jumps where a branch ends.
#
# Each step starts from the state before it, so that the solution stays on its branch while there is one. Whether it
# did is told by the energy. With the body's displacement split into K p, of the step's operator K, and the rest,
# which belongs to the gap h = surface - approach, an equilibrium that changes smoothly has
#
#     dE = -<p, dh>     under an approach,      d(E - load x approach) = -<p, d surface> - approach d load     under a load,
#
# and over a step the trapezoidal rule meets this to a part of <dp, dh> (or of <dp, d surface> + d load d approach): a
# monotonic relation between them cannot miss it by more than half. The energy lost is that released. A step is a jump
# if the search met an unstable state and more than ``SMOOTH`` of that product was lost; if more than half was lost,
# since a search may pass a jump without meeting such a state (seen at jumps into contact); or if a tensile load has
# separated the surfaces (whose energy is then without bound, and not counted). Measured on a ball at Tabor numbers of
# 0.5 and 2, smooth steps of a quarter of the approach at pull-off lose less than 0.07 of it where unstable states
# were met, jumps 0.12 to 1.2. Jumps of a part of the contact that are small beside the change of the whole in the
# same step are not seen, nor is the jump into contact of a first step.


SMOOTH = 0.1  # a smooth change loses less than this part of <dp, dh>
CERTAIN = 5.0  # a loss of this times that, half of <dp, dh>, is a jump also where no unstable state was met
LEAST = 1e-4  # a loss below this part of the energy of the attraction is no jump
CURVED = 3.0  # a paraboloid whose gap grows by the range over n cells is attracted on average as at a gap 1/(3 n^2) wider
# contact modulus E* times the confined compliance of a half-space over the side of a cell, by which E* is found from the
# operator; True: plane strain
CONFINED = {False: 0.83, True: 1.27}


class Adhering(NamedTuple):
    """The state at the end of a step: surface (profile and displacement), pressure and contact (nx, ny); approach; none:
    whether there is none yet; jumps and their energy since the start, and the work done on the body, ()."""

    surface: Array
    pressure: Array
    contact: Array
    approach: Array
    none: Array
    jumps: Array
    energy: Array
    work: Array


def at_rest(law: Any, profile: Array) -> Adhering | None:
    """Return the state before the first step; None for a law without attraction."""
    if not isinstance(law, Attraction):
        return None
    zero, number = jnp.zeros_like(profile), jnp.zeros(())
    return Adhering(zero, zero, zero > 0.0, number, jnp.asarray(True), jnp.zeros((), int), number, number)


def solve_step(
    problem: Problem, guess: Array, before: Adhering | None, tolerance: Array, max_iterations: Array
) -> tuple[Solution, Adhering | None, dict[str, Array]]:
    """Solve the contact of a step; return the solution, the state it leaves, and numbers of the result."""
    if before is None:
        return solve_contact(problem, guess, tolerance, max_iterations), None, {}

    # 1. The contact with adhesion, from the state before, of the law as the cells can resolve it. A pressure that is
    # extrapolated from a contact that has gone, or over a much longer step, is no start. Operators that are not of one even
    # kernel, and friction, take a sequence of contacts.
    even = problem.operator.even()
    law = replace(problem.law, law=problem.law.law.resolved(even.cell_compliance(problem.gap.shape)))
    problem = replace(problem, law=law)
    apart = ~jnp.any(before.contact)
    far = largest(jnp.abs(guess - before.pressure)) > largest(jnp.abs(before.pressure))
    guess = jnp.where(apart | far, before.pressure, guess)
    start = Start(guess, before.contact, before.none)
    one_kernel = problem.operator.symmetric and problem.operator.weights is None and problem.drag is None
    method = solve_adhesive if one_kernel else solve_adhesive_in_turn
    found = method(problem, start, tolerance, max_iterations)
    held, last = jax.lax.stop_gradient((problem, found))
    if not problem.operator.symmetric or problem.drag is not None:
        # an energy belongs to the even part, which has the rest in its gap
        held = with_given(held, last.pressure, last.carried)
        last = replace(last, displacement=held.operator(last.pressure))
    assert last.separated is not None and last.unstable is not None

    # 2. The energy that the step released: E before - E after (``fallen``), E = 1/2 <p, K p> - sum int s dg [- load x
    # approach] with the operator of the step, and the work done on it in between by the trapezoidal rule. ``moved`` is the
    # change of the surface apart from K p, ``change`` the product <dp, dh> of which a smooth step loses a part.
    p, q = before.pressure, last.pressure
    displacement_before = held.operator(p)
    gap = jnp.maximum(held.gap + last.displacement - last.approach, 0.0)
    attracted = held.law.energy(jnp.maximum(before.surface - before.approach, 0.0))
    later = held.law.energy(gap)
    fallen = 0.5 * (jnp.sum(p * displacement_before) - jnp.sum(q * last.displacement)) - attracted + later
    moved = held.gap - (before.surface - displacement_before)
    climb = last.approach - before.approach
    load, more = jnp.sum(p + q) / 2.0, jnp.sum(q - p)
    if held.load_controlled:
        fallen = fallen + jnp.sum(q) * last.approach - jnp.sum(p) * before.approach
        work = -0.5 * jnp.sum((p + q) * moved) - 0.5 * (last.approach + before.approach) * more
        change = jnp.sum(jnp.abs((q - p) * moved)) + jnp.abs(more * climb)
    else:
        work = -0.5 * jnp.sum((p + q) * moved) + load * climb
        change = jnp.sum(jnp.abs((q - p) * (moved - climb)))
    released = fallen + work

    # 3. A jump: the surfaces have separated, or more was released than a smooth change may seem to.
    smooth = SMOOTH * change + LEAST * jnp.maximum(attracted, later)
    separated = last.separated & jnp.any(before.contact)
    left = ~before.none & (released > jnp.where(last.unstable, 1.0, CERTAIN) * smooth)

    # 4. The state after the step, with the work that the pressure does on the body, by the trapezoidal rule.
    surface = held.gap + last.displacement
    way = surface - jnp.where(before.none, held.gap, before.surface)
    after = Adhering(
        surface,
        q,
        last.carried > 0.0,
        last.approach,
        jnp.asarray(False),
        before.jumps + (separated | left),
        before.energy + jnp.where(left & ~separated, released, 0.0),
        before.work + 0.5 * jnp.sum((p + q) * way),
    )

    # 5. The cells over which the gap grows by the range of the attraction, at its curvature. Between the centres of cells
    # the gap is linear (``contact.adhesive``), so that where it has second differences d from cell to cell, it is on
    # average sum(d)/12 too wide. This decides for a long range on a stiff body, whose gap is that of the undeformed bodies;
    # else the zone at the edge of contact does.
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
    modulus = CONFINED[guess.shape[1] == 1] / even.confined_compliance(guess.shape)
    zone = jnp.minimum(law.law.zone_length(modulus), over_range)
    return found, after, {"jumps": after.jumps, "jump_energy": after.energy, "cohesive_cells": zone}


LEAST_ACROSS = 3
LEAST_CELLS = 0.25 * math.pi * LEAST_ACROSS**2
# gap over the width of the grid from which the indenter has no surface: half of that beside a punch (``indenters.shapes``)
BESIDE = 500.0
LOAD_MET = 1e-6  # largest difference of the sum of pressures from the load, relative to it, in a solution


class PressCarry(NamedTuple):
    """The carry: the memory's fields, the last pressure (nx, ny), and its rate of change over the last step; adhering: the
    last state of a contact with adhesion, None without; judged: the error of the time steps, None without memory; dent: what
    surfaces that yield have lost for good at each cell, (nx, ny), None without a hardness.
    """

    memory: Any
    pressure: Array
    rate: Array
    adhering: Adhering | None
    judged: StepError | None
    dent: Array | None = None


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
        return self.memory.inherits or isinstance(self.law, Hardness)

    def start(self) -> PressCarry:
        zero = jnp.zeros_like(self.profile)
        fields = self.memory.start(zero.shape)
        judged = (
            StepError.none(self.memory.delayed(fields, zero).rates.size, zero.shape)
            if self.memory.inherits
            else None
        )
        dent = zero if isinstance(self.law, Hardness) else None
        return PressCarry(fields, zero, zero, at_rest(self.law, zero), judged, dent)

    def advance(self, carry: PressCarry, step: Steps) -> tuple[PressCarry, Outcome]:
        # 1. What earlier pressure has left, and the operator of this step. The gap contains the former, and what stays:
        # growth raises the surface, a dent lowers it.
        operator, earlier, fields, raised, drag = self.memory.predict(carry.memory, carry.pressure, step.more)
        lowest, gap = jnp.min(self.profile), self.profile + earlier - raised
        if carry.dent is not None:
            gap = gap + carry.dent

        # 2. The contact, from the pressure extrapolated over the step.
        problem = Problem(operator, gap, step.target, lowest, self.load_controlled, self.law, drag)
        guess = jax.lax.stop_gradient(carry.pressure + carry.rate * step.dt)
        solution, adhering, of_adhesion = solve_step(
            problem, guess, carry.adhering, self.tolerance, self.max_iterations
        )
        pressure = solution.pressure

        # 3. The memory takes the new pressure up, and with friction on adhesion the traction of what contact carries.
        if drag is not None:
            step = step._replace(more=step.more._replace(sheared=drag.traction(solution.carried)))
        fields = self.memory.update(fields, pressure, step.more)
        rate = jax.lax.stop_gradient(pressure - carry.pressure) / jnp.where(step.dt > 0.0, step.dt, jnp.inf)

        # 4. Numbers and fields of the result.
        numbers = contact_outcome(problem, solution, earlier if self.memory.inherits else None) | {
            "status": status_of(problem, solution, self.tolerance, self.edges)
        }
        if adhering is not None:
            of_adhesion |= self._energies(adhering, fields, pressure)
        numbers |= self.memory.observe(fields, pressure, step.more) | of_adhesion
        shown = {
            "pressure": numbers.pop("pressure"),
            "displacement": earlier - raised + solution.displacement,
        }
        if "indenter_displacement" in numbers:
            shown["indenter_displacement"] = numbers.pop("indenter_displacement")
        if drag is not None:
            shown["contact_pressure"] = solution.carried
        dent = self._dented(carry.dent, problem, solution)
        if dent is not None:  # a displacement that stays
            shown |= {"displacement": shown["displacement"] + dent, "dent": dent}

        # 5. The error of the time steps.
        lapse = self._lapse(step, numbers["contact_area"])
        if adhering is not None:
            lapse = lapse._replace(touches=numbers["contact_area"] > 0.0)
        judged = self._judged(carry, fields, pressure, lapse)
        numbers["time_step_error"] = jnp.zeros(()) if judged is None else judged.estimate
        return PressCarry(fields, pressure, rate, adhering, judged, dent), Outcome(shown, numbers)

    def _dented(self, dent: Array | None, problem: Problem, solution: Solution) -> Array | None:
        """Return the dent after a step whose gap holds the dent before it: deeper where the cells yield."""
        if dent is None:
            return None
        return dent + self.law.dent(
            solution.pressure, problem.gap + solution.displacement - solution.approach
        )

    def _judged(self, carry: PressCarry, fields: Any, pressure: Array, lapse: Lapse) -> StepError | None:
        """Return the error of the time steps after a step, from the fields after it and its new pressure."""
        if carry.judged is None:
            return None
        delayed = self.memory.delayed(*jax.lax.stop_gradient((fields, present(carry.pressure, pressure))))
        return after_step(carry.judged, delayed, carry.pressure, pressure, lapse, self.load_controlled)

    def _lapse(self, step: Steps, contact_area: Array) -> Lapse:
        """Return the time in a step; contact_area: scaled."""
        return Lapse(step.dt)

    def _energies(self, adhering: Adhering, fields: Any, pressure: Array) -> dict[str, Array]:
        """Return the energy that the body has dissipated under a contact with adhesion."""
        stored = self.memory.stored_energy(*jax.lax.stop_gradient((fields, pressure)))
        return {"viscous_energy": adhering.work - stored}


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
    # surfaces that yield cannot carry any load
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
