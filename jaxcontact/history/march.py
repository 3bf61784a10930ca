"""The march in time of a stepper: rows of inner steps, what is kept of them, and what reverse mode keeps.

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
