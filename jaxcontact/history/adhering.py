"""A step of the march with adhesion: the branch that it follows, and the jumps where a branch ends.

Each step starts from the state before it, so that the solution stays on its branch while there is one. Whether it did is
told by the energy. With the body's displacement split into K p, of the step's operator K, and the rest, which belongs to the
gap h = surface - approach, an equilibrium that changes smoothly has

    dE = -<p, dh>     under an approach,      d(E - load x approach) = -<p, d surface> - approach d load     under a load,

and over a step the trapezoidal rule meets this to a part of <dp, dh> (or of <dp, d surface> + d load d approach): a
monotonic relation between them cannot miss it by more than half. The energy lost is that released. A step is a jump if the
search met an unstable state and more than ``SMOOTH`` of that product was lost; if more than half was lost, since a search
may pass a jump without meeting such a state (seen at jumps into contact); or if a tensile load has separated the surfaces
(whose energy is then without bound, and not counted). Measured on a ball at Tabor numbers of 0.5 and 2, smooth steps of a
quarter of the approach at pull-off lose less than 0.07 of it where unstable states were met, jumps 0.12 to 1.2. Jumps of a
part of the contact that are small beside the change of the whole in the same step are not seen, nor is the jump into contact
of a first step.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import replace
from jaxcontact._support.reductions import largest
from jaxcontact.contact.adhesive_sliding import frozen
from jaxcontact.contact.adhesive_state import Start
from jaxcontact.contact.attraction import Attraction
from jaxcontact.contact.implicit import solve_adhesive, solve_adhesive_sliding, solve_contact
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.operators.base import InvertibleOperator

SMOOTH = 0.1  # of <dp, dh>: an energy that a smooth change does not lose
CERTAIN = 5.0  # times that, half of <dp, dh>: a jump also where no unstable state was met
LEAST = 1e-4  # of the energy of the attraction: a loss of less is no jump
CURVED = 3.0  # a paraboloid whose gap grows by the range over n cells is attracted on average as at a gap 1/(3 n^2) wider
HELD = {
    False: 0.83,
    True: 1.27,
}  # contact modulus times held compliance over the side of a cell; True: plane strain


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
    """Solve the contact of a step; return the solution, the state it leaves and what is told of it."""
    if before is None:
        return solve_contact(problem, guess, tolerance, max_iterations), None, {}
    whole, even = problem, problem.operator.even()
    assert isinstance(even, InvertibleOperator)
    law = replace(problem.law, law=problem.law.law.resolved(even.cell_compliance()))
    problem = replace(problem, law=law)
    # what is extrapolated from a contact that has gone, or over a much longer step, is none
    apart = ~jnp.any(before.contact)
    far = largest(jnp.abs(guess - before.pressure)) > largest(jnp.abs(before.pressure))
    guess = jnp.where(apart | far, before.pressure, guess)
    start = Start(guess, before.contact, before.none)
    method = solve_adhesive if problem.operator.symmetric else solve_adhesive_sliding
    solution = method(problem, start, tolerance, max_iterations)
    if not problem.operator.symmetric:  # its energy is that of the even part
        problem = frozen(problem, solution.pressure)
    assert solution.separated is not None and solution.unstable is not None
    held = jax.lax.stop_gradient((problem, solution))
    released, smooth = _released(*held, before)
    separated = solution.separated & jnp.any(before.contact)
    left = ~before.none & (released > jnp.where(solution.unstable, 1.0, CERTAIN) * smooth)
    jumped = separated | left
    after = Adhering(
        held[0].gap + held[1].displacement,
        held[1].pressure,
        held[1].carried > 0.0,
        held[1].approach,
        jnp.asarray(False),
        before.jumps + jumped,
        before.energy + jnp.where(left & ~separated, released, 0.0),
        before.work + _body_work(*held, before),
    )
    modulus = HELD[guess.shape[1] == 1] / even.confined_compliance(guess.shape)
    zone = jnp.minimum(law.law.zone_length(modulus), _cells_of_the_range(*held))
    numbers = {"jumps": after.jumps, "jump_energy": after.energy, "cohesive_cells": zone}
    displacement = solution.displacement + problem.gap - whole.gap
    return replace(solution, displacement=displacement), after, numbers


def _body_work(problem: Problem, solution: Solution, before: Adhering) -> Array:
    """Return the work that the pressure does on the body in a step, by the trapezoidal rule, ()."""
    surface = jnp.where(before.none, problem.gap, before.surface)
    moved = problem.gap + solution.displacement - surface
    return 0.5 * jnp.sum((before.pressure + solution.pressure) * moved)


def _cells_of_the_range(problem: Problem, solution: Solution) -> Array:
    """Return the number of cells over which the gap grows by the range of the attraction, at its curvature there.

    Between the centres of cells the gap is linear (``contact.attraction``), so that where it has second differences d from
    cell to cell, it is on average sum(d)/12 too wide. This decides for a long range on a stiff body, whose gap is that of
    the undeformed bodies.
    """
    gap = jnp.maximum(problem.gap + solution.displacement - solution.approach, 0.0)
    attraction = jnp.where(solution.carried > 0.0, 0.0, problem.law.law.traction(gap))
    second = lambda axis: jnp.pad(
        jnp.diff(gap, 2, axis), [(1, 1) if k == axis and n > 2 else (0, 0) for k, n in enumerate(gap.shape)]
    )
    bent = sum((second(axis) for axis in (0, 1) if gap.shape[axis] > 2), start=jnp.zeros_like(gap))
    total = jnp.sum(attraction)
    wider = jnp.sum(attraction * bent) / 12.0 / jnp.where(total > 0.0, total, 1.0)
    some = (total > 0.0) & (wider > 0.0)
    reach = problem.law.law.characteristic_range / (CURVED * jnp.where(some, wider, 1.0))
    return jnp.where(some, jnp.sqrt(jnp.where(some, reach, 1.0)), jnp.inf)


def _released(problem: Problem, solution: Solution, before: Adhering) -> tuple[Array, Array]:
    """Return the energy that a step released, and how much of it a smooth change may seem to release."""
    p, q = before.pressure, solution.pressure
    lifted = problem.operator(p)
    surface, gap = problem.gap, before.surface - before.approach
    elastic = 0.5 * (jnp.sum(p * lifted) - jnp.sum(q * solution.displacement))
    attraction = lambda g: problem.law.energy(jnp.maximum(g, 0.0))
    later = attraction(problem.gap + solution.displacement - solution.approach)
    fallen = elastic - attraction(gap) + later
    moved = surface - (before.surface - lifted)
    climb = solution.approach - before.approach
    load, more = jnp.sum(p + q) / 2.0, jnp.sum(q - p)
    if problem.load_controlled:
        fallen = fallen + jnp.sum(q) * solution.approach - jnp.sum(p) * before.approach
        work = -0.5 * jnp.sum((p + q) * moved) - 0.5 * (solution.approach + before.approach) * more
        change = jnp.sum(jnp.abs((q - p) * moved)) + jnp.abs(more * climb)
    else:
        work = -0.5 * jnp.sum((p + q) * moved) + load * climb
        change = jnp.sum(jnp.abs((q - p) * (moved - climb)))
    # E before - E after, and the work done on it in between
    released = fallen + work
    return released, SMOOTH * change + LEAST * jnp.maximum(attraction(gap), later)
