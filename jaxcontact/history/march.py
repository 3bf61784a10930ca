"""The march in time: at each step the memory predicts, the contact is solved, the memory is updated.

State is an explicit carry: a march may stop after any step and go on from its carry. What the memory is made
of, and what the kernels are, the march does not know.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, static
from jaxcontact._support.status import Status, first_of, inherited, passed_on, to_next_row
from jaxcontact.contact.edge import contact_cells, memory_factor
from jaxcontact.contact.implicit import KEPT
from jaxcontact.contact.law import UNILATERAL
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.history.adhering import at_rest, numbers_of_rest, solve_step
from jaxcontact.history.memory import Memory

LEAST_ACROSS = 3
LEAST_CELLS = 0.25 * math.pi * LEAST_ACROSS**2
LOAD_MET = 1e-6  # of the load: a sum of pressures farther from it is no solution


@pytree
class Setup:
    """All that stays the same during a march, scaled (``_support.scale``)."""

    memory: Memory
    profile: Array
    tolerance: Array
    max_iterations: Array
    load_controlled: bool = static()
    edges: tuple[bool, bool] = static()  # as in ``status_of``
    law: Any = UNILATERAL  # a ContactLaw, or an Attraction


class Steps(NamedTuple):
    """What drives the inner steps: dt [s], the target of the control, and the memory's own input."""

    dt: Array
    target: Array
    memory: Any


class Carry(NamedTuple):
    """The memory's fields, the last pressure (nx, ny), and its rate of change over the last step.

    failed: what the next inner step inherits of failures, a ``Status``: ``FINE`` if there were none, that of the last
    failed inner step of this row, or ``INHERITED`` if it lies in an earlier row. adhering: the last state of a contact with
    adhesion (``history.adhering``), None without.
    """

    memory: Any
    pressure: Array
    rate: Array
    failed: Array
    adhering: Any


class Outcome(NamedTuple):
    """One step, scaled: fields (nx, ny) and scalars by the names of a result; more: of the memory's own; adhesion:
    scalars of a contact with adhesion by the names of its result, None without.
    """

    pressure: Any
    displacement: Any
    saved: Any
    approach: Array
    load: Array
    contact_area: Array
    smooth_area: Array
    film_strain: Array
    iterations: Array
    error: Array
    status: Array
    more: Any
    adhesion: Any


Keep = Callable[[Outcome], Outcome]


def start(setup: Setup) -> Carry:
    """No pressure, no history."""
    zero = jnp.zeros_like(setup.profile)
    fields, adhering = setup.memory.start(setup.profile.shape), at_rest(setup.law, setup.profile)
    return Carry(fields, zero, zero, jnp.zeros((), int), adhering)


def advance(setup: Setup, carry: Carry, steps: Steps) -> tuple[Carry, Outcome]:
    """One inner step."""
    operator, earlier, fields = setup.memory.predict(carry.memory, carry.pressure, steps.memory)
    lowest = jnp.min(setup.profile)
    gap = setup.profile + earlier
    problem = Problem(operator, gap, steps.target, lowest, setup.load_controlled, setup.law)
    guess = jax.lax.stop_gradient(carry.pressure + carry.rate * steps.dt)
    solution, adhering, told = solve_step(
        problem, guess, carry.adhering, setup.tolerance, setup.max_iterations
    )
    pressure = solution.pressure
    fields = setup.memory.update(fields, pressure, steps.memory)
    rate = jax.lax.stop_gradient(pressure - carry.pressure) / jnp.where(steps.dt > 0.0, steps.dt, jnp.inf)
    observed = setup.memory.observe(fields, pressure, steps.memory)
    status = status_of(problem, solution, setup.tolerance, setup.edges)
    if setup.memory.inherits:
        status = inherited(status, carry.failed)
    outcome = Outcome(
        displacement=earlier + solution.displacement,
        saved=None,
        film_strain=observed.film_strain,
        status=status,
        more=observed.more,
        adhesion=told,
        **contact_outcome(problem, solution, earlier),
    )
    return Carry(fields, pressure, rate, passed_on(status), adhering), outcome


def contact_outcome(problem: Problem, solution: Solution, earlier: Array | None = None) -> dict[str, Array]:
    """Return what a solved contact says by itself, scaled, by the names of a result.

    earlier: the displacement (nx, ny) left by earlier pressure; None without memory.
    """
    p, u, operator = solution.pressure, solution.displacement, problem.operator
    gap = problem.gap + u - solution.approach
    compliance = operator.held_compliance()
    if earlier is not None:
        compliance = compliance * memory_factor(earlier, u, operator.periodic)
    return {
        "pressure": p,
        "approach": solution.approach,
        "load": jnp.sum(p),
        "contact_area": jnp.sum(problem.law.touching(solution.carried)).astype(float),
        "smooth_area": contact_cells(solution.carried, gap, compliance, operator.periodic),
        "iterations": solution.iterations,
        "error": solution.error,
    }


def solved(error: Array, tolerance: Array, *found: Array) -> Array:
    """Return whether the tolerance was met and everything found is finite, (); not so where the error is nan."""
    total = sum((jnp.sum(values) for values in found), start=jnp.zeros(()))
    return (error <= tolerance) & jnp.isfinite(total)


def plane_strain(field: Array) -> bool:
    """Whether a field (nx, ny) is the same along y."""
    return field.shape[1] == 1


def status_of(
    problem: Problem, solution: Solution, tolerance: Array, edges: tuple[bool, bool] = (True, True)
) -> Array:
    """Return the status of a contact by itself, the first that holds of: a response that is not finite, surfaces that a
    tensile load has separated, no convergence, contact (or attraction) at the grid's edge, too few cells in it.

    edges: whether contact at the sides across x, and across y, goes on where the grid does not, static.
    """
    pressed, active = problem.target > 0.0, problem.law.acting(solution.pressure, solution.carried)
    touching = problem.law.touching(solution.carried)
    first_and_last = lambda axis: jnp.any(jnp.take(active, jnp.array([0, -1]), axis=axis))
    edge = jnp.any(jnp.stack([jnp.asarray(there) & first_and_last(axis) for axis, there in enumerate(edges)]))
    cells, met = jnp.sum(active), solved(solution.error, tolerance, solution.approach, solution.displacement)
    some = jnp.any(touching)
    if problem.load_controlled:
        some = some | pressed
        size = jnp.sum(jnp.abs(solution.pressure))
        met = met & (jnp.abs(jnp.sum(solution.pressure) - problem.target) <= LOAD_MET * size)
    coarse = some & (cells < (LEAST_ACROSS if plane_strain(active) else LEAST_CELLS))
    finite = jnp.isfinite(problem.operator.held_compliance())
    separated = jnp.asarray(False) if solution.separated is None else solution.separated
    return first_of(
        (~finite, Status.NOT_FINITE),
        (separated, Status.PULLED_OFF),
        (~met, Status.NOT_CONVERGED),
        (edge, Status.AT_EDGE),
        (coarse, Status.TOO_COARSE),
    )


def march(setup: Setup, carry: Carry, steps: Steps, kept: Keep) -> tuple[Carry, Outcome, Outcome]:
    """March on from a carry, over steps whose leading axes are (nt, substeps).

    Returns the carry, what ``kept`` keeps of the outcome at the end of each row, stacked over nt, and the last
    outcome whole. Reverse mode keeps each row's carry and pressure.
    """
    keep = jax.checkpoint_policies.save_only_these_names(KEPT)

    def inner(state: tuple[Carry, Outcome], step: Steps) -> tuple[tuple[Carry, Outcome], None]:
        return advance(setup, state[0], step), None

    def outer(state: tuple[Carry, Outcome], row: Steps) -> tuple[tuple[Carry, Outcome], Outcome]:
        begun = state[0]._replace(failed=to_next_row(state[0].failed))
        if row.dt.shape[0] == 1:
            state = advance(setup, begun, jax.tree.map(lambda a: a[0], row))
        else:
            state = jax.lax.scan(jax.checkpoint(inner, policy=keep), (begun, state[1]), row)[0]
        return state, kept(state[1])

    rows = jax.checkpoint(outer, policy=keep)
    (carry, last), outcomes = jax.lax.scan(rows, (carry, blank(setup, steps)), steps)
    return carry, outcomes, last


def march_from_rest(
    setup: Setup, steps: Steps, kept: Keep, checkpoint: str = "pressures"
) -> tuple[Outcome, Outcome]:
    """The whole march, without history before it: outcomes and the last outcome, as ``march``.

    Reverse mode goes back in blocks of about sqrt(nt) rows, of which the first carry alone is kept.
    checkpoint: "pressures" keeps the pressures of all inner steps as well, so that no contact is solved
    again; "blocks" keeps those of one block at a time and solves every contact twice.
    """

    def block(state: tuple[Carry, Outcome], rows: Steps) -> tuple[tuple[Carry, Outcome], Outcome]:
        carry, outcomes, last = march(setup, state[0], rows, kept)
        return (carry, last), outcomes

    length = math.isqrt(len(steps.dt) - 1) + 1
    blocks, padding = in_blocks(steps, length)
    keep = jax.checkpoint_policies.save_only_these_names(KEPT) if checkpoint == "pressures" else None
    first = (start(setup), blank(setup, steps))
    (_, last), outcomes = jax.lax.scan(jax.checkpoint(block, policy=keep), first, blocks)
    outcomes = jax.tree.map(lambda a: a.reshape(-1, *a.shape[2:]), outcomes)
    return without_padding(outcomes, padding), last


def in_blocks(steps: Steps, length: int) -> tuple[Steps, int]:
    """Rows in blocks of equal length, (blocks, length, substeps), and the number of rows added.

    Added are repeats of the first row of a march from rest, which takes no time: its contact is found
    again and nothing changes. (A row without contact would change nothing either, but what ``save``
    makes of it need not be finite, and then its derivative is not, however little is made of it.)
    """
    padding = -len(steps.dt) % length
    padded = jax.tree.map(lambda a: jnp.concatenate([jnp.repeat(a[:1], padding, axis=0), a]), steps)
    return jax.tree.map(lambda a: a.reshape(-1, length, *a.shape[1:]), padded), padding


def without_padding(outcomes: Outcome, padding: int) -> Outcome:
    """The first row as it was first found, and those after its repeats."""
    return jax.tree.map(lambda a: jnp.concatenate([a[:1], a[1 + padding :]]), outcomes)


def blank(setup: Setup, steps: Steps) -> Outcome:
    """An outcome of the right shapes to start the march with."""
    zero, one, whole = jnp.zeros_like(setup.profile), jnp.zeros(()), jnp.zeros((), int)
    first = jax.tree.map(lambda a: a[(0,) * 2], steps.memory)
    observed = jax.eval_shape(setup.memory.observe, setup.memory.start(zero.shape), zero, first)
    more = jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), observed.more)
    told = numbers_of_rest(setup.law)
    return Outcome(zero, zero, None, one, one, one, one, one, whole, one, whole, more, told)
