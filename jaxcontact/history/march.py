"""The march in time: at each step the memory predicts, the contact is solved, the memory is updated.

State is an explicit carry: a march may stop after any step and go on from its carry.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._pytree import pytree, static
from jaxcontact.contact.implicit import KEPT, solve_contact
from jaxcontact.contact.normal import Problem

NOT_CONVERGED, AT_EDGE, TOO_COARSE = 1, 2, 3


@pytree
class Setup:
    """All that stays the same during a march, scaled (``kernels.Units``)."""

    memory: Any
    profile: Array
    tolerance: Array
    max_iterations: Array
    load_controlled: bool = static()


class Steps(NamedTuple):
    """What drives the inner steps: dt [s], the target of the control, and the memory's own input."""

    dt: Array
    target: Array
    memory: Any


class Carry(NamedTuple):
    """The memory's fields, the last pressure (nx, ny), and its rate of change over the last step."""

    memory: Any
    pressure: Array
    rate: Array


class Outcome(NamedTuple):
    """One step, scaled: fields (nx, ny) and scalars; see ``results.ContactHistory``."""

    pressure: Any
    displacement: Any
    approach: Array
    total: Array
    cells: Array
    smooth_cells: Array
    film_strain: Array
    iterations: Array
    error: Array
    status: Array
    observed: Any  # by the memory, see its ``observe``


def start(setup: Setup) -> Carry:
    """No pressure, no history."""
    zero = jnp.zeros_like(setup.profile)
    return Carry(setup.memory.start(setup.profile.shape), zero, zero)


def advance(setup: Setup, carry: Carry, steps: Steps) -> tuple[Carry, Outcome]:
    """One inner step."""
    operator, fields = setup.memory.predict(carry.memory, carry.pressure, steps.memory)
    problem = Problem(
        spectrum=operator.spectrum,
        circulant=operator.circulant,
        window=operator.window,
        gap=setup.profile + operator.earlier,
        target=steps.target,
        lowest=jnp.min(setup.profile),
        load_controlled=setup.load_controlled,
    )
    guess = jax.lax.stop_gradient(carry.pressure + carry.rate * steps.dt)
    solution = solve_contact(problem, guess, setup.tolerance, setup.max_iterations)
    pressure = solution.pressure
    fields = setup.memory.update(fields, pressure, steps.memory)
    rate = jax.lax.stop_gradient(pressure - carry.pressure) / jnp.where(steps.dt > 0.0, steps.dt, jnp.inf)
    converged = solution.error <= setup.tolerance
    outcome = Outcome(
        pressure=pressure,
        displacement=operator.earlier + solution.displacement,
        approach=solution.approach,
        total=jnp.sum(pressure),
        cells=jnp.sum(pressure > 0.0).astype(float),
        smooth_cells=smooth_cells(pressure),
        film_strain=film_strain(setup.memory, fields, pressure, steps.memory),
        iterations=solution.iterations,
        error=solution.error,
        status=status_of(pressure, converged),
        observed=setup.memory.observe(fields, pressure, steps.memory),
    )
    return Carry(fields, pressure, rate), outcome


def smooth_cells(pressure: Array) -> Array:
    """(9/8) (sum p)^2 / sum p^2: the cells in a Hertzian contact of the same sum p and sum p^2."""
    squares = jnp.sum(pressure**2)
    return 9.0 / 8.0 * jnp.sum(pressure) ** 2 / jnp.where(squares > 0.0, squares, 1.0)


def status_of(pressure: Array, converged: Array) -> Array:
    """0 fine, 1 not converged, 2 contact at the grid's edge, 3 fewer than three cells across."""
    active = pressure > 0.0
    edge = jnp.any(active[0]) | jnp.any(active[-1]) | jnp.any(active[:, 0]) | jnp.any(active[:, -1])
    cells = jnp.sum(active)
    coarse = (cells > 0) & (cells < 0.25 * jnp.pi * 3.0**2)
    status = jnp.where(coarse, TOO_COARSE, 0)
    status = jnp.where(edge, AT_EDGE, status)
    return jnp.where(converged, status, NOT_CONVERGED)


def film_strain(memory: Any, fields: Any, pressure: Array, step: Any) -> Array:
    """Shortening of the film over its thickness at its deepest point, the film on a rigid base."""
    coefficients = memory.film_coefficients()
    if coefficients is None:
        return jnp.zeros(())
    return deepest_strain(coefficients, memory.film_shear_strain(fields, pressure, step))


def deepest_strain(coefficients: Array, strain: Array) -> Array:
    """The film on a rigid base at the deepest point of the hereditary integral, both (nx, ny)."""
    nx, ny = strain.shape
    deepest = jnp.unravel_index(jnp.argmax(strain), strain.shape)
    row = jnp.abs(jnp.arange(nx) - deepest[0])
    column = jnp.abs(jnp.arange(ny) - deepest[1])
    return jnp.sum(coefficients[row][:, column] * strain)


def march(
    setup: Setup, carry: Carry, steps: Steps, save: str | Callable[[Outcome], Any]
) -> tuple[Carry, Outcome, Outcome]:
    """March on from a carry, over steps whose leading axes are (nt, substeps).

    Returns the carry, the outcomes at the end of each row, stacked over nt (with the fields replaced by
    what ``save`` makes of them), and the last outcome whole. Reverse mode keeps each row's carry and pressure.
    """
    keep = jax.checkpoint_policies.save_only_these_names(KEPT)

    def inner(state: tuple[Carry, Outcome], step: Steps) -> tuple[tuple[Carry, Outcome], None]:
        return advance(setup, state[0], step), None

    def outer(state: tuple[Carry, Outcome], row: Steps) -> tuple[tuple[Carry, Outcome], Outcome]:
        if row.dt.shape[0] == 1:
            state = advance(setup, state[0], jax.tree.map(lambda a: a[0], row))
        else:
            state = jax.lax.scan(jax.checkpoint(inner, policy=keep), state, row)[0]
        return state, saved(state[1], save)

    rows = jax.checkpoint(outer, policy=keep)
    (carry, last), outcomes = jax.lax.scan(rows, (carry, blank(setup, steps)), steps)
    return carry, outcomes, last


def march_from_rest(
    setup: Setup, steps: Steps, save: str | Callable[[Outcome], Any], checkpoint: str = "pressures"
) -> tuple[Outcome, Outcome]:
    """The whole march, without history before it: outcomes and the last outcome, as ``march``.

    Reverse mode goes back in blocks of about sqrt(nt) rows, of which the first carry alone is kept.
    checkpoint: "pressures" keeps the pressures of all inner steps as well, so that no contact is solved
    again; "blocks" keeps those of one block at a time and solves every contact twice.
    """

    def block(state: tuple[Carry, Outcome], rows: Steps) -> tuple[tuple[Carry, Outcome], Outcome]:
        carry, outcomes, last = march(setup, state[0], rows, save)
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
    return jax.tree.map(lambda a: jnp.delete(a, slice(1, 1 + padding), axis=0), outcomes)


def saved(outcome: Outcome, save: str | Callable[[Outcome], Any]) -> Outcome:
    """The outcome with only the fields that are to be kept."""
    if save == "all":
        return outcome
    kept = None if isinstance(save, str) else save(outcome)
    return outcome._replace(pressure=kept, displacement=None)


def blank(setup: Setup, steps: Steps) -> Outcome:
    """An outcome of the right shapes to start the march with."""
    zero, one = jnp.zeros_like(setup.profile), jnp.zeros(())
    integer = jnp.zeros((), int)
    first = jax.tree.map(lambda a: a[(0,) * 2], steps.memory)
    observed = jax.eval_shape(setup.memory.observe, setup.memory.start(zero.shape), zero, first)
    observed = jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), observed)
    return Outcome(zero, zero, one, one, one, one, one, integer, one, integer, observed)
