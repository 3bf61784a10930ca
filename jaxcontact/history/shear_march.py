"""The march in time of a contact with friction: at each step the memory predicts, both contacts are solved.

As ``history.march``, of which it takes what a normal contact says; the carry is explicit here, too. Every step inherits
tractions, displacements and work from the steps before, also on an elastic body.

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
from jaxcontact._support.status import Status, inherited, passed_on, to_next_row
from jaxcontact.contact.friction import length
from jaxcontact.contact.implicit import solve_partial_slip
from jaxcontact.contact.partial_slip import Round, SlipProblem
from jaxcontact.history.march import contact_outcome, solved, status_of
from jaxcontact.history.tractions import TractionFields, TractionMemory


@pytree
class ShearSetup:
    """All that stays the same during a march, scaled; coefficient: of friction, (nx, ny)."""

    memory: TractionMemory
    profile: Array
    coefficient: Array
    tolerance: Array
    max_iterations: Array
    load_controlled: bool = static()
    tangential_load_controlled: bool = static()
    coupled: bool = static()
    edges: tuple[bool, bool] = static()  # as in ``status_of``


class ShearStep(NamedTuple):
    """What drives the inner steps: dt [s], and the targets of both controls, () and (2,)."""

    dt: Array
    target: Array
    tangential: Array


class ShearCarry(NamedTuple):
    """fields of the memory; traction (3, nx, ny) of q_x, q_y and p; rate (nx, ny): of the pressure; moved (2, nx, ny): the
    tangential displacement; shift (2,) of the indenter; work (nx, ny): friction work per area; failed: as in
    ``history.march.Carry``."""

    fields: TractionFields
    traction: Array
    rate: Array
    moved: Array
    shift: Array
    work: Array
    failed: Array


class ShearOutcome(NamedTuple):
    """One step, scaled, by the names of a result; slip: since the time before."""

    fields: dict[str, Any]
    numbers: dict[str, Array]


def start(setup: ShearSetup) -> ShearCarry:
    """No traction, no history."""
    zero, pair = jnp.zeros_like(setup.profile), jnp.zeros((2, *setup.profile.shape))
    fields = setup.memory.start(setup.profile.shape)
    failed = jnp.zeros((), int)
    return ShearCarry(fields, jnp.zeros((3, *zero.shape)), zero, pair, jnp.zeros(2), zero, failed)


def advance(setup: ShearSetup, carry: ShearCarry, step: ShearStep) -> tuple[ShearCarry, ShearOutcome]:
    """One inner step."""
    memory = setup.memory
    operator, sunk, drawn, fields = memory.predict(carry.fields, carry.traction, step.dt)
    before = 0.0 if setup.tangential_load_controlled else carry.shift
    problem = SlipProblem(
        operator=operator,
        gap=setup.profile + sunk,
        drift=drawn - carry.moved,
        coefficient=setup.coefficient,
        target=step.target,
        tangential_target=step.tangential - before,
        lowest=jnp.min(setup.profile),
        load_controlled=setup.load_controlled,
        tangential_load_controlled=setup.tangential_load_controlled,
        coupled=setup.coupled,
    )
    guess = carry.traction[2] + carry.rate * step.dt
    found = solve_partial_slip(problem, guess, carry.traction[:2], setup.tolerance, setup.max_iterations)
    p, q, slip = found.normal.pressure, found.tangential.traction, found.tangential.slip
    traction = jnp.concatenate([q, p[None]])
    fields = memory.update(fields, traction, step.dt)
    moved = drawn + found.tangential.displacement + (operator.drawn(p) if setup.coupled else 0.0)
    rate = (p - carry.traction[2]) / jnp.where(step.dt > 0.0, step.dt, jnp.inf)
    shift = carry.shift + jnp.where(
        jnp.any(p > 0.0) | (not setup.tangential_load_controlled), found.tangential.shift, 0.0
    )
    slipping = jnp.where(
        found.tangential.stick, 0.0, length(slip)
    )  # a stuck cell's slip is what the solver left
    work = carry.work + _friction_work(setup.coefficient, carry.traction[2], p, slipping, step.dt)
    status = inherited(_status(setup, problem, found), carry.failed)
    carry = ShearCarry(fields, traction, rate, moved, shift, work, passed_on(status))
    numbers = {"film_strain": memory.film_strain(fields, p, step.dt), "status": status}
    return carry, _outcome(setup, problem, found, carry, sunk, numbers)


def _friction_work(coefficient: Array, before: Array, after: Array, slip: Array, dt: Array) -> Array:
    """Return the friction work of a step per area, (nx, ny), from the pressures at its ends and the length of the slip."""
    mean = jnp.where(dt > 0.0, (before + after) / 2.0, after)
    return coefficient * mean * slip


def _outcome(
    setup: ShearSetup,
    problem: SlipProblem,
    found: Round,
    carry: ShearCarry,
    sunk: Array,
    numbers: dict[str, Array],
) -> ShearOutcome:
    pressed, sheared = found.normal, found.tangential
    said = contact_outcome(problem.pressed(sheared.traction), pressed, sunk)
    earlier = sunk + (problem.operator.sunk(sheared.traction) if setup.coupled else 0.0)
    fields = {
        "pressure": said.pop("pressure"),
        "displacement": earlier + pressed.displacement,
        "traction": sheared.traction,
        "slip": sheared.slip,
        "stick": sheared.stick,
    }
    numbers |= said | {
        "iterations": found.taken,
        "error": jnp.maximum(pressed.error, sheared.error),
        "tangential_load": _load(setup, problem, sheared.traction),
        "tangential_displacement": carry.shift,
        "dissipated": jnp.sum(carry.work),
    }
    return ShearOutcome(fields, numbers)


def _load(setup: ShearSetup, problem: SlipProblem, traction: Array) -> Array:
    """The sum of the tractions; where it is given, with the derivative of what is given, free of rounding."""
    total = jnp.sum(traction, (1, 2))
    if not setup.tangential_load_controlled:
        return total
    return problem.tangential_target + jax.lax.stop_gradient(total - problem.tangential_target)


def _status(setup: ShearSetup, problem: SlipProblem, found: Round) -> Array:
    """That of the normal contact, unless the tangential one has none, or was not found."""
    status = status_of(problem.pressed(found.tangential.traction), found.normal, setup.tolerance, setup.edges)
    tangential = found.tangential
    met = solved(tangential.error, setup.tolerance, tangential.traction, tangential.slip, tangential.shift)
    status = jnp.where(met | (status == Status.NOT_FINITE), status, int(Status.NOT_CONVERGED))
    if not setup.tangential_load_controlled:
        return status
    asked = length(problem.tangential_target[:, None, None])[0, 0]
    room = jnp.sum(problem.coefficient * found.normal.pressure)
    return jnp.where((asked > 0.0) & (asked >= room), int(Status.SLIDES), status)


def _with_slip(outcome: ShearOutcome, slip: Array) -> ShearOutcome:
    return outcome._replace(fields=outcome.fields | {"slip": slip})


def march(
    setup: ShearSetup, steps: ShearStep, *, all_fields: bool
) -> tuple[ShearOutcome, dict[str, Any], ShearCarry]:
    """March from rest over steps whose leading axes are (nt, substeps).

    all_fields: whether outcomes keep their fields. Returns the outcomes over time, the fields of the last one, and the last
    carry.
    """

    def inner(state: tuple[ShearCarry, ShearOutcome], step: ShearStep) -> tuple[Any, None]:
        carry, outcome = advance(setup, state[0], step)
        return (carry, _with_slip(outcome, outcome.fields["slip"] + state[1].fields["slip"])), None

    def outer(state: tuple[ShearCarry, ShearOutcome], row: ShearStep) -> tuple[Any, ShearOutcome]:
        fresh = _with_slip(state[1], jnp.zeros_like(state[1].fields["slip"]))
        begun = state[0]._replace(failed=to_next_row(state[0].failed))
        state = jax.lax.scan(inner, (begun, fresh), row)[0]
        return state, state[1] if all_fields else state[1]._replace(fields={})

    first = start(setup)
    blank = jax.eval_shape(lambda: advance(setup, first, jax.tree.map(lambda a: a[0, 0], steps))[1])
    blank = jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), blank)
    (carry, last), outcomes = jax.lax.scan(outer, (first, blank), steps)
    return outcomes, last.fields, carry
