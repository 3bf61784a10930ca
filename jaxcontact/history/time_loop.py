"""The loop over time of any stepper: rows of inner steps, the fields that are saved, and those that reverse mode stores.

A stepper describes one inner step of one kind of experiment:

    carry = stepper.start()                                the state before the first step
    carry, outcome = stepper.advance(carry, step)          one inner step

Everything else belongs to the march and holds for every stepper: rows of ``substeps`` inner steps, sums over a row, the
inheritance of failures, what ``save=`` keeps, blocks of rows, and the policy of reverse mode. The carry is explicit, so
that a march may stop after any row and continue from its carry with the same numbers.
"""

import abc
import math
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import ramps
from jaxcontact._support.reductions import totals
from jaxcontact._support.status import more_serious, passed_on, to_next_row
from jaxcontact.contact.implicit import KEPT


class Steps(NamedTuple):
    """The input of inner steps: dt [s], the target of the normal control, and further input of the stepper."""

    dt: Array
    target: Array
    more: Any


class Rows(NamedTuple):
    """Rows of inner steps: input of the stepper, a pytree with leading axes (rows, substeps), and whether each row exists.

    A row that does not exist fills up a block, and is skipped.
    """

    steps: Any
    exists: Array


class Outcome(NamedTuple):
    """One time of a march, scaled, by the names of a result.

    fields: over the grid, (..., nx, ny), kept as ``save=`` says; numbers: kept at all times, ``status`` among them; saved:
    the value of the function given as ``save=``.
    """

    fields: dict[str, Array]
    numbers: dict[str, Array]
    saved: Any = None


class Carry(NamedTuple):
    """The stepper's own carry, and the status that the next inner step inherits of earlier ones.

    failed: ``FINE`` if all steps before succeeded, the most serious status of the inner steps of this row so far, or
    ``INHERITED`` if only a step of an earlier row failed.
    """

    own: Any
    failed: Array


class March(NamedTuple):
    """A march after some row: the carry to continue from, and the last outcome with all its fields."""

    carry: Carry
    last: Outcome


Keep = Callable[[Outcome], Outcome]
PRESSURES = jax.checkpoint_policies.save_only_these_names(KEPT)


class Stepper(abc.ABC):
    """One inner step of one kind of experiment; see the module. A pytree; all scaled.

    profile: gap at first touch, (nx, ny); summed: names of fields that add up over the inner steps of a row.
    """

    profile: Array
    summed: ClassVar[tuple[str, ...]] = ()

    @property
    def inherits(self) -> bool:
        """True if a step depends on earlier ones (static)."""
        return True

    @abc.abstractmethod
    def start(self) -> Any:
        """Return the carry before the first step."""

    @abc.abstractmethod
    def advance(self, carry: Any, step: Any) -> tuple[Any, Outcome]:
        """Return the carry and the outcome of one inner step; its status is that of this step by itself."""

    def overall(self, carry: Any) -> dict[str, Array]:
        """Return fields of a result that have no axis of time, from the carry after the last step."""
        return {}

    def told(self, carry: Any) -> dict[str, Array]:
        """Return numbers for the notes (fields of ``Diagnostics``), from the carry after the last step."""
        return {}


def begin(stepper: Stepper) -> Carry:
    """Return the carry before the first step."""
    return Carry(stepper.start(), jnp.zeros((), int))


@partial(jax.jit, inline=True)
def _advance(stepper: Stepper, carry: Carry, step: Any) -> tuple[Carry, Outcome]:
    """Return one inner step with the failures that it inherits; traced once, however often it is called."""
    own, outcome = stepper.advance(carry.own, step)
    status = outcome.numbers["status"]
    failed = passed_on(status)
    if stepper.inherits:
        failed = more_serious(failed, carry.failed)
        status = more_serious(status, carry.failed)
    return Carry(own, failed), outcome._replace(numbers=outcome.numbers | {"status": status})


def march(stepper: Stepper, state: March, rows: Rows, kept: Keep) -> tuple[March, Outcome]:
    """March on over some rows: the march after them, and what ``kept`` returns of their outcomes, stacked.

    Reverse mode keeps the carry and the pressures of each row.
    """

    def inner(state: March, step: Any) -> tuple[March, None]:
        carry, outcome = _advance(stepper, state.carry, step)
        sums = {name: state.last.fields[name] + outcome.fields[name] for name in stepper.summed}
        return March(carry, outcome._replace(fields=outcome.fields | sums)), None

    def row(state: March, steps: Any) -> March:
        zeros = {name: jnp.zeros_like(state.last.fields[name]) for name in stepper.summed}
        last = state.last._replace(fields=state.last.fields | zeros)
        begun = March(state.carry._replace(failed=to_next_row(state.carry.failed)), last)
        if count_of(steps) == 1:
            return inner(begun, jax.tree.map(lambda a: a[0], steps))[0]
        return jax.lax.scan(jax.checkpoint(inner, policy=PRESSURES), begun, steps)[0]

    def outer(state: March, given: Rows) -> tuple[March, Outcome]:
        state = jax.lax.cond(given.exists, row, lambda state, _: state, state, given.steps)
        return state, kept(state.last)

    return jax.lax.scan(jax.checkpoint(outer, policy=PRESSURES), state, rows)


def march_from_rest(
    stepper: Stepper, steps: Any, kept: Keep, checkpoint: str = "pressures"
) -> tuple[March, Outcome]:
    """March over all rows from the start: the march after the last row, and what was kept, as ``march``.

    Reverse mode goes back in blocks of about sqrt(nt) rows, of which the first carry alone is kept.
    checkpoint: "pressures" keeps the pressures of all inner steps as well, so that no contact is solved
    again; "blocks" keeps those of one block at a time and solves every contact twice.
    """
    nt = count_of(steps)
    blocks = in_blocks(steps, math.isqrt(nt - 1) + 1)
    first = begun(stepper, begin(stepper), steps)
    policy = PRESSURES if checkpoint == "pressures" else None
    block = jax.checkpoint(lambda state, rows: march(stepper, state, rows, kept), policy=policy)
    state, outcomes = jax.lax.scan(block, first, blocks)
    return state, jax.tree.map(lambda a: a.reshape(-1, *a.shape[2:])[:nt], outcomes)


def count_of(steps: Any) -> int:
    """Return the length of the first axis of the input of steps."""
    return len(jax.tree.leaves(steps)[0])


def in_blocks(steps: Any, length: int) -> Rows:
    """Return rows in blocks of equal length, (blocks, length, ...); rows that do not exist fill up the last one."""
    nt = count_of(steps)
    padding = -nt % length
    filled = jax.tree.map(lambda a: jnp.concatenate([a, jnp.repeat(a[-1:], padding, axis=0)]), steps)
    rows = Rows(filled, jnp.arange(nt + padding) < nt)
    return jax.tree.map(lambda a: a.reshape(-1, length, *a.shape[1:]), rows)


def begun(stepper: Stepper, carry: Carry, steps: Any) -> March:
    """Return a march that is to go on from a carry; its last outcome has no meaning yet.

    steps: input of the stepper with leading axes (rows, substeps).
    """
    first = jax.tree.map(lambda a: a[0, 0], steps)
    shapes = jax.eval_shape(_advance, stepper, carry, first)[1]
    return March(carry, jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), shapes))


# The error of the time steps: an estimate that a march makes beside its steps, from what it has computed anyway.
#
# In a step the pressure is linear in time. What the step leaves out is the deviation of the pressure from that line.
# With kappa, the deviation in the middle of the step, taken as a parabola over the step, the internal variables of
# ``history.memory`` are off by
#
#     dt b(lambda_k dt) kappa,      b(z) = int_0^1 exp(-z (1 - s)) 4 s (1 - s) ds = 2/3/(1 + z/2 + z^2/6) nearly,
#
# and less for large z where a parabola would be steeper at the end of the step than the line.
#
# kappa = -dt/4 (dp - dp' dt/dt')/(dt + dt') from the increments of this step and the one before (primed), at most
# half of dp at each cell. In a step after a jump, which has none before it, the pressure is taken to follow a
# relaxation, f(t) = 1/(1 + sum_k s_k (1 - exp(-lambda_k t))/lambda_k): kappa = dp ((1 - f(dt/2))/(1 - f(dt)) - 1/2).
# A contact that forms in a step has a pressure that is steep at first: kappa = ARISING p. At the centre of a ball under a
# load that grows from zero p is as s^(1/3), with the same mean as a parabola of 3/8; under a growing approach it is as
# s^(1/2), 1/4; on a film that responds locally as s^(1/2) and s, 1/4 and 0.
#
# What becomes of an error is found in one number for each rate, x_k of the internal variables, and in y of the
# pressure, all along the pressure. With the shares s_k = <p, lambda_k C_k p>/<p, C_0 p> of the delayed compliances
# under the present pressure, the displacement in the contact, or its shape under a given load, stays as it is:
#
#     x_k' = y - lambda_k x_k + (the defects of the steps),      y + sum_k s_k x_k = 0,
#
# by the rule of the march. The estimate is |y|/(|p| + |y|), so that an error is forgotten as the body forgets it.
# Where the contact moves over the body by d of its radii in a step, lambda_k dt is larger by d: what it leaves behind
# matters no more. A step of reduced time that turns out to be another than was extrapolated has a further defect, the
# difference of the two updates of the internal variables.
#
# ``tests.benchmarks.time_steps`` compares the estimate with the largest error of approach, load and peak pressure.
# Before the bound on the slope was added it was within a factor of 2.1 of it in 26 of 29 contacts, ten of which, all
# under a load, reached the edge of the grid; the others were a ramp of the load from zero (0.4 of the error) and two
# films under a load (0.3 and 3.5). It is too large by up to ten times or more at single times whose error changes its
# sign.


FAINT = (
    0.1  # a pressure below this part of the largest one not yet forgotten has an error relative to that part
)
ARISING = 0.3  # deviation from a line, over the pressure at the end of a step, where a contact forms in it
HARDLY = 1e-3  # weight of the pressure before a step where that after it has none


class StepError(NamedTuple):
    """The errors of the module and what they are found from.

    variables (K,): x_k; pressure: y; remembered (K,): the internal variables along the pressure; size: of the last
    pressure; largest: of the largest one, as far as it is not forgotten; last: the length of the step before [s]; estimate:
    of the relative error of the present pressure; () each.
    """

    variables: Array
    pressure: Array
    remembered: Array
    size: Array
    largest: Array
    last: Array
    estimate: Array

    @classmethod
    def none(cls, count: int) -> "StepError":
        """Return the errors at the start, with that many rates."""
        return cls(
            jnp.zeros(count),
            *[jnp.zeros(count) if name == "remembered" else jnp.zeros(()) for name in cls._fields[1:]],
        )


class Delayed(NamedTuple):
    """The delayed compliance of a body under a pressure: rates lambda_k and shares s_k of the module [1/s], (K,) each."""

    rates: Array
    shares: Array


class Lapse(NamedTuple):
    """The time in a step [s], in which the pressure is linear; its reduced time, as it was extrapolated and as it turned
    out, both None where the body's time is that of the clock; drift: the way of the contact over the body, in its radii;
    touches: false where surfaces attract each other without contact, so that the gap gives the pressure.
    """

    dt: Array
    assumed: Array | None = None
    found: Array | None = None
    drift: Array | float = 0.0
    touches: Array | bool = True


def present(before: Array, after: Array) -> Array:
    """Return the pressure along which errors are measured: that after a step, or the one before where contact was lost."""
    return after + HARDLY * before


def in_radii(way: Array, contact_area: Array, plane_strain: bool) -> Array:
    """Return a way in radii of a contact, in plane strain in half-widths, all in cells; none without contact."""
    radius = contact_area / 2.0 if plane_strain else jnp.sqrt(contact_area / jnp.pi)
    return jnp.where(radius > 0.0, way / jnp.where(radius > 0.0, radius, 1.0), 0.0)


def after_step(
    error: StepError, delayed: Delayed, before: Array, after: Array, rate: Array, lapse: Lapse
) -> StepError:
    """Return the errors after a step, without derivative.

    before, after: pressure (..., nx, ny) or several components of a traction; rate: of its change over the step before.
    """
    given = jax.lax.stop_gradient((error, delayed, before, after, rate, lapse))
    error, (rates, shares), before, after, rate, lapse = given
    dt = lapse.dt
    own = dt if lapse.found is None else lapse.found  # the body's time
    z = rates * own + lapse.drift
    decay, old, new = ramps(z)

    # 1. The relaxation f of a unit pressure at a constant displacement after half the step, and after the step; ``bent`` is
    # the deviation of its middle from the line between its ends, per change.
    part = jnp.array([[0.5], [1.0]]) * z
    mean = jnp.where(part < 1e-6, 1.0, -jnp.expm1(-part) / jnp.where(part < 1e-6, 1.0, part))
    half, left = 1.0 / (1.0 + jnp.array([0.5, 1.0]) * own * (mean @ shares))
    bent = (1.0 - half) / jnp.where(left < 1.0, 1.0 - left, 1.0) - 0.5

    # 2. kappa, from the increments of this step and the one before; after a jump that of the relaxation; where a contact
    # forms, that of a pressure that is steep at first. Then its norm, with the sign of its part along the pressure.
    change = after - before
    following = -dt / 4.0 * (change - rate * dt) / jnp.where(dt > 0.0, dt + error.last, 1.0)
    following = jnp.clip(following, -jnp.abs(change) / 2.0, jnp.abs(change) / 2.0)
    kappa = jnp.where(error.last > 0.0, following, bent * change)
    if after.ndim == 2:  # a pressure alone: a traction may grow in proportion to time
        kappa = jnp.where(error.size > 0.0, kappa, ARISING * change)
    squared, off, along, turned = totals(after**2, kappa**2, present(before, after) * kappa, before * after)
    size, deviation = jnp.sqrt(squared), jnp.sign(along) * jnp.sqrt(off)
    turn = jnp.where(turned < 0.0, -1.0, 1.0)  # of a traction that has been reversed
    x, y, h = turn * error.variables, turn * error.pressure, turn * error.remembered

    # 3. The defect dt b(z) kappa. Where z is large the slope at the end of the step counts, 4 kappa of a parabola, but no
    # more than that of the line. A reduced time other than the extrapolated one adds the difference of both updates.
    whole = jnp.sqrt(jnp.maximum(squared + error.size**2 - 2.0 * turned, 0.0))
    flat = jnp.maximum(4.0 * jnp.abs(deviation), whole) / jnp.where(whole > 0.0, whole, 1.0)
    defect = own * 2.0 / 3.0 / (1.0 + z / 2.0 + flat * z**2 / 6.0) * deviation
    remembered = h
    if lapse.assumed is not None:
        pressed = turn * error.size
        remembered = decay * h + own * (old * pressed + new * size)
        decay_, old_, new_ = ramps(rates * lapse.assumed + lapse.drift)
        defect = defect + remembered - decay_ * h - lapse.assumed * (old_ * pressed + new_ * size)
    # 4. x and y at the end of the step, by the rule of the march, with y + sum_k s_k x_k = 0 where there is contact.
    free = decay * x + own * old * y + defect
    touching = (size + error.size > 0.0) & lapse.touches
    found = jnp.where(touching, -(shares @ free) / (1.0 + shares @ (own * new)), 0.0)
    largest = jnp.maximum(size, error.largest * left)
    scale = jnp.maximum(size + jnp.abs(found), FAINT * largest)
    estimate = jnp.where(scale > 0.0, jnp.abs(found) / jnp.where(scale > 0.0, scale, 1.0), 0.0)
    return StepError(free + own * new * found, found, remembered, size, largest, dt, estimate)
