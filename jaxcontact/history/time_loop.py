"""The loop over time, the march, of any stepper; and the estimate of the error of the time steps (second half).

A stepper describes one inner step of one kind of experiment:

    carry = stepper.start()                                the state before the first step
    carry, outcome = stepper.advance(carry, step)          one inner step

The march provides the rest for every stepper: rows of ``substeps`` inner steps, one row for each time of the result; sums
over a row; the statuses that later steps inherit; what ``save=`` keeps; blocks of rows; and what reverse mode stores. All
state is in the carry, so that a march may stop after any row and continue from its carry with equal results.
"""

import abc
import math
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jax.scipy.ndimage import map_coordinates

from jaxcontact._support.exponential import ramps
from jaxcontact._support.pytree import pytree, static
from jaxcontact._support.status import more_serious, passed_on, to_next_row
from jaxcontact.contact.implicit import KEPT


class Steps(NamedTuple):
    """The input of inner steps: dt: length [s]; target: the load or approach, scaled; more: further input of the stepper."""

    dt: Array
    target: Array
    more: Any


def fine_steps(times: Array, substeps: int) -> Array:
    """Return the lengths of the inner steps [s], (nt, substeps); those of the first row are zero."""
    before = jnp.append(times[:1], times[:-1])
    return (times - before)[:, None] / substeps * jnp.ones(substeps)


def at_fine_times(values: Array, substeps: int) -> tuple[Array, Array]:
    """Return values (nt, ...), linear between times, at the start and at the end of every inner step, (nt, substeps, ...)
    each."""
    before = jnp.concatenate([values[:1], values[:-1]])
    share = (jnp.arange(substeps + 1) / substeps).reshape(-1, *[1] * (values.ndim - 1))
    fine = before[:, None] + (values - before)[:, None] * share
    return fine[:, :-1], fine[:, 1:]


def fine_values(values: Array, substeps: int) -> Array:
    """Return values (nt, ...), linear between times, at the ends of the inner steps, (nt, substeps, ...)."""
    return at_fine_times(values, substeps)[1]


class Rows(NamedTuple):
    """Rows of inner steps.

    steps: input of the stepper, a pytree with leading axes (rows, substeps); exists: False for rows that only fill the last
    block, which are skipped, (rows,); None where there are none.
    """

    steps: Any
    exists: Array | None


class Outcome(NamedTuple):
    """The results of a march at one time, scaled, under the names of the fields of the result.

    fields: over the grid, (..., nx, ny), kept as ``save=`` says; numbers: kept at all times, ``status`` among them; saved:
    the value of the function given as ``save=``, or None.
    """

    fields: dict[str, Array]
    numbers: dict[str, Array]
    saved: Any = None


class Carry(NamedTuple):
    """The carry of the stepper, ``own``, and the status that the next inner step inherits of earlier ones, ``failed``.

    failed: ``FINE`` if all steps before succeeded, the most serious status of the inner steps of this row so far, or
    ``INHERITED`` if only a step of an earlier row failed.
    """

    own: Any
    failed: Array


class March(NamedTuple):
    """The state of a march after a row: the carry with which it continues, and the last outcome with all its fields."""

    carry: Carry
    last: Outcome


Keep = Callable[[Outcome], Outcome]
PRESSURES = jax.checkpoint_policies.save_only_these_names(KEPT)
FEW_ROWS = 8  # number of rows up to which all may be in one block


class Stepper(abc.ABC):
    """The interface of one inner step (head of the module). A stepper is a pytree, and all its numbers are scaled.

    profile: gap at first touch, (nx, ny); summed: names of fields that are summed over the inner steps of a row.
    """

    profile: Array
    summed: ClassVar[tuple[str, ...]] = ()

    @property
    def inherits(self) -> bool:
        """Whether a step depends on earlier ones, so that it inherits their failures (static)."""
        return True

    @abc.abstractmethod
    def start(self) -> Any:
        """Return the carry before the first step."""

    @abc.abstractmethod
    def advance(self, carry: Any, step: Any) -> tuple[Any, Outcome]:
        """Return the carry and the outcome of one inner step, whose status is that of this step alone."""

    def overall(self, carry: Any) -> dict[str, Array]:
        """Return fields of a result that have no axis of time, from the carry after the last step."""
        return {}

    def for_notes(self, carry: Any) -> dict[str, Array]:
        """Return numbers for the notes (fields of ``Diagnostics``), from the carry after the last step."""
        return {}


def first_carry(stepper: Stepper) -> Carry:
    """Return the carry before the first step."""
    return Carry(stepper.start(), jnp.zeros((), int))


@partial(jax.jit, inline=True)
def _advance(stepper: Stepper, carry: Carry, step: Any) -> tuple[Carry, Outcome]:
    """Return the carry and the outcome of an inner step, with inherited statuses; jit avoids that it is traced
    repeatedly."""
    own, outcome = stepper.advance(carry.own, step)
    status = outcome.numbers["status"]
    failed = passed_on(status)
    if stepper.inherits:
        failed = more_serious(failed, carry.failed)
        status = more_serious(status, carry.failed)
    return Carry(own, failed), outcome._replace(numbers=outcome.numbers | {"status": status})


def march(stepper: Stepper, state: March, rows: Rows, kept: Keep) -> tuple[March, Outcome]:
    """Return the march after some further rows, and the stacked values of ``kept`` for their outcomes.

    Reverse mode stores the carry and the pressures of each row.
    """

    def inner(state: March, step: Any) -> tuple[March, None]:
        carry, outcome = _advance(stepper, state.carry, step)
        sums = {name: state.last.fields[name] + outcome.fields[name] for name in stepper.summed}
        return March(carry, outcome._replace(fields=outcome.fields | sums)), None

    def row(state: March, steps: Any) -> March:
        zeros = {name: jnp.zeros_like(state.last.fields[name]) for name in stepper.summed}
        last = state.last._replace(fields=state.last.fields | zeros)
        cleared = March(state.carry._replace(failed=to_next_row(state.carry.failed)), last)
        if count_of(steps) == 1:
            return inner(cleared, jax.tree.map(lambda a: a[0], steps))[0]
        return jax.lax.scan(jax.checkpoint(inner, policy=PRESSURES), cleared, steps)[0]

    def outer(state: March, given: Rows) -> tuple[March, Outcome]:
        if given.exists is None:
            state = row(state, given.steps)
        else:
            state = jax.lax.cond(given.exists, row, lambda state, _: state, state, given.steps)
        return state, kept(state.last)

    return jax.lax.scan(jax.checkpoint(outer, policy=PRESSURES), state, rows)


def march_from_rest(
    stepper: Stepper, steps: Any, kept: Keep, checkpoint: str = "pressures"
) -> tuple[March, Outcome]:
    """Return the march after all rows, from the start, and the stacked values of ``kept`` for their outcomes.

    The rows are divided into blocks of about sqrt(nt), since reverse mode then stores the carry at the beginning of each
    block alone. Where nt has a divisor that is not much larger, no rows fill the last block: the conditional that skips them
    takes a fourth of the time to trace a derivative. checkpoint: "pressures" stores the pressures of all inner steps too, so
    that no contact is solved again; "blocks" those of one block at a time, and every contact is solved twice.
    """
    nt = count_of(steps)
    shortest = math.isqrt(nt - 1) + 1
    longest = max(min(nt, FEW_ROWS), shortest * 3 // 2)
    divisors = (length for length in range(shortest, longest + 1) if nt % length == 0)
    length = next(divisors, shortest)
    blocks = in_blocks(steps, length)
    if nt % length == 0:
        blocks = blocks._replace(exists=None)
    first = before_rows(stepper, first_carry(stepper), steps)
    policy = PRESSURES if checkpoint == "pressures" else None
    block = jax.checkpoint(lambda state, rows: march(stepper, state, rows, kept), policy=policy)
    state, outcomes = jax.lax.scan(block, first, blocks)
    return state, jax.tree.map(lambda a: a.reshape(-1, *a.shape[2:])[:nt], outcomes)


def count_of(steps: Any) -> int:
    """Return the length of the first axis of the input of steps."""
    return len(jax.tree.leaves(steps)[0])


def in_blocks(steps: Any, length: int) -> Rows:
    """Return the rows in blocks, (blocks, length, ...); the last block is filled with rows that do not exist."""
    nt = count_of(steps)
    padding = -nt % length
    filled = jax.tree.map(lambda a: jnp.concatenate([a, jnp.repeat(a[-1:], padding, axis=0)]), steps)
    rows = Rows(filled, jnp.arange(nt + padding) < nt)
    return jax.tree.map(lambda a: a.reshape(-1, length, *a.shape[1:]), rows)


def before_rows(stepper: Stepper, carry: Carry, steps: Any) -> March:
    """Return the march with a carry before some rows; its last outcome is zero, until a row has been computed.

    steps: input of the stepper with leading axes (rows, substeps).
    """
    first = jax.tree.map(lambda a: a[0, 0], steps)
    shapes = jax.eval_shape(_advance, stepper, carry, first)[1]
    return March(carry, jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), shapes))


# The estimate of the error of the time steps, ``time_step_error``.
#
# In each step the march takes the pressure p as linear in time. The estimate repeats the step at every cell with ``FINER``
# shorter steps, without solving a contact, and compares the two pressures at its end.
#
# 1. The equation of a cell. With the shares s_k = <p, lambda_k C_k p>/<p, C_0 p> of the delayed compliances under the
#    present pressure, the displacement is u = C_0 * q with
#
#        q = p + sum_k s_k eta_k,      eta_k' = p - lambda_k eta_k.
#
#    q is the pressure of the same contact on an elastic body. It depends on the shape of the indenter and on the control
#    alone, whereas the change of p within a step depends on the body too (relaxation). q is known before and after the step,
#    and the short steps need it in between. All cells have equal rates and shares, so that a short step is the product with
#    one matrix of (K + 1) x (K + 1).
#
# 2. The path of q within the step, as a function of a pace from 0 to 1 (``_path``).
#    - Pace. A given approach is linear in time, and the pace is time. Under a given load the sum of p is linear in time,
#      from which the sum Q of q follows; the pace is such that the sum of q along the path is Q.
#    - A contact that grows or shrinks as that of a ball does: q^2 is linear inside the contact, as (a^2 - r^2) is with a^2
#      linear in the approach. In a cell that enters contact the change of q^2 is the one with which the first of these cells
#      enters at the start of the step.
#    - A contact of constant area, a punch, and a film that responds locally: q is linear. These are recognised by the change
#      of q^2 inside the contact over the largest q^2 of cells that enter or leave, which is 1 for a ball on a half-space and
#      many times more for them (between ``EVEN`` and ``EVEN + 2`` the two paths are mixed). A new contact is that of a punch
#      if q is larger at its edge than inside: all cells enter at once.
#    - Tangential tractions, and the tractions of an attraction, are linear.
#
# 3. Errors of earlier steps. The differences x_k of the eta_k and y of the pressure at the end of a step are the initial
#    values of the next one, so that an error decays as the memory of the body does. A cell that has left contact keeps its
#    x_k, which decay. Under a given load the sum of y is made zero: the difference is distributed over the cells in contact.
#
# 4. Motion. Where the contact moves over the body by d of its radii in a step, lambda_k dt is increased by d, since what it
#    leaves behind has no further effect. Where the velocity changes, the march takes its mean; the difference between what
#    the pressure leaves on the true way (``Bent``) and on the straight one is added to the eta_k. Where the length of a step
#    in reduced time follows from the result (temperature), the march has extrapolated it, and the short steps have the true
#    one.
#
# 5. The estimate is the largest |y| over the largest p + y, or the relative error of the sums if that is larger. It is exact
#    where q is constant, as in a relaxation at a constant approach. Elsewhere the path of q is approximate, and a part
#    ``CAUTION`` of the error is added. On large grids it is evaluated at no more than ``SAMPLES`` cells along each axis.
#
# Accuracy. Ratio of the estimate to the largest error of the pressure at any cell and time, over its largest value (from
# steps 16 to 32 times shorter), at 5, 25, 50, 75 and 95 % of the contacts. Without CAUTION:
#
#     0.44, 0.86, 1.0, 1.5, 2.7     in 181 contacts solved by a dense matrix (half-spaces, films, beds of springs; balls,
#                                   cones, punches, waves; solids of E0/Einf 1.5 to 30, Burgers, Maxwell, Prony; all kinds
#                                   of loads and approaches in 9 times, errors of 0.1 to 100 %); with it 0.56 and 3.5 at 5
#                                   and 95 %
#     0.62, 0.94, 1.0, 1.2, 1.8     in 35 such contacts by ``indent`` and ``slide`` (``tests.benchmarks.time_steps
#                                   --random``); with it 0.8 and 2.3 at 5 and 95 %
#
# With CAUTION:
#
#     0.53, 0.86, 1.0, 1.4, 1.8     in 40 slides whose velocity changes, errors of 1 to 100 % (``--sway``); here CAUTION is
#                                   added for the change of the way as well
#     0.54, 1.0, 1.5, 2.0, 2.6      in 23 contacts in partial slip (``--shear``), of pressure and of tangential load and
#                                   displacement
#
# The estimate is too small by more than a factor of two for contacts that shrink to a few cells, for punches on films whose
# pressure spreads under a load, and, by up to 17, for the tangential traction of single cells: it does not follow the slip,
# which depends on the path of the loads on an elastic body too. It is too large, by up to a factor of twenty for errors of
# 0.3 to 1 %, for contacts that are about to separate, where the error of the sum decides.


FINER = 8  # number of short steps in a step
SAMPLES = 48  # largest number of cells along each axis at which the error is evaluated
EVEN = 3.0  # change of q^2 inside a contact over that at its edge, above which q is linear and q^2 is not
FAINT = 0.1  # part of the largest remembered pressure to which the error of a smaller pressure is relative
ASIDE = 16  # points of the integral along the way of a step in which the velocity changes
SAME = 1e-3  # relative change of a sum of pressures below which it does not determine the pace
CAUTION = 0.3  # part of the error that is added where q changes, for the error of its path
CHANGED = 0.1  # change of q in a step over its largest value from which all of CAUTION is added
HARDLY = 1e-3  # weight of the pressure before a step in ``present``


class StepError(NamedTuple):
    """The error of the time steps after a step, at the sampled cells, (mx, my), in the symbols of the comment above.

    remembered: the eta_k of the march, (K, ..., mx, my); variables: the differences x_k, of equal shape; pressure: the
    difference y, (..., mx, my); largest: the largest pressure so far, and doubt: the largest share of ``CAUTION`` so far,
    both decaying as the memory of the body does, (); estimate: ``time_step_error``, ().
    """

    remembered: Array
    variables: Array
    pressure: Array
    largest: Array
    doubt: Array
    estimate: Array

    @classmethod
    def none(cls, count: int, shape: tuple[int, ...]) -> "StepError":
        """Return the error before the first step, zero; count: number of rates; shape: of pressure or tractions, (...,
        nx, ny)."""
        zero = _sampled(jnp.zeros(shape))
        zeros = jnp.zeros((count, *zero.shape))
        return cls(zeros, zeros, zero, *jnp.zeros(3))


class Delayed(NamedTuple):
    """The delayed compliance of a body under a pressure: rates lambda_k and shares s_k of the comment above [1/s], (K,)
    each."""

    rates: Array
    shares: Array


class Lapse(NamedTuple):
    """The duration of a step and the motion of the contact in it.

    dt: time [s], in which the pressure is linear; assumed, found: its reduced time, as extrapolated by the march and as it
    follows from the result [s], both None without time-temperature shift; drift: the way of the contact over the body in
    radii of the contact; touches: False where surfaces attract each other without contact, so that the gap determines the
    pressure; bent: the way of a contact whose velocity changes in the step, or None.
    """

    dt: Array
    assumed: Array | None = None
    found: Array | None = None
    drift: Array | float = 0.0
    touches: Array | bool = True
    bent: "Bent | None" = None


@pytree
class Bent:
    """The way of a contact over the body in a step in which the velocity changes, [cells along x and y].

    move: the way with the mean velocity, which the march takes, (2,); aside: distance of the true way from it in the middle
    of the step, (2,); rates: the number of rates that belong to the body, which are the first ones; periodic: axes along
    which the grid is periodic; both static.
    """

    move: Array
    aside: Array
    rates: int = static()
    periodic: tuple[bool, bool] = static()


def present(before: Array, after: Array) -> Array:
    """Return the pressure under which compliances are compared: after a step, or before it where contact was lost."""
    return after + HARDLY * before


def in_radii(way: Array, contact_area: Array, plane_strain: bool) -> Array:
    """Return a way [cells] over the radius of a contact (in plane strain its half-width); 0 without contact."""
    radius = contact_area / 2.0 if plane_strain else jnp.sqrt(contact_area / jnp.pi)
    return jnp.where(radius > 0.0, way / jnp.where(radius > 0.0, radius, 1.0), 0.0)


def _sampled(field: Array) -> Array:
    """Return at most ``SAMPLES`` cells along each axis of a grid, evenly spaced, of a field (..., nx, ny)."""
    x, y = (-(-n // SAMPLES) for n in field.shape[-2:])
    return field[..., x // 2 :: x, y // 2 :: y]


def after_step(
    error: StepError, delayed: Delayed, before: Array, after: Array, lapse: Lapse, loaded: bool
) -> StepError:
    """Return the error after a step, without derivative.

    before, after: pressure (nx, ny), or components of a traction, (..., nx, ny), before and after the step; loaded: whether
    their sums are given (load control), and not the displacement.
    """
    error, delayed, before, after, lapse = jax.lax.stop_gradient((error, delayed, before, after, lapse))
    (rates, shares), p0, p1 = delayed, _sampled(before), _sampled(after)
    own = lapse.dt if lapse.found is None else lapse.found  # duration in the reduced time of the body
    tau = jnp.arange(1, FINER + 1) / FINER
    # from the start of the step, (FINER, K)
    decay, old, new = ramps(tau[:, None] * (rates * own + lapse.drift))

    # 1. The internal variables eta_k of the march, and q before and after the step.
    weights, lasted = (decay[-1], old[-1], new[-1]), own
    if lapse.assumed is not None:
        weights, lasted = ramps(rates * lapse.assumed + lapse.drift), lapse.assumed
    over_cells = lambda weight: weight.reshape(-1, *[1] * p0.ndim)
    eta, left_over = error.remembered, over_cells(weights[0]) * error.remembered
    remembered = left_over + lasted * (over_cells(weights[1]) * p0 + over_cells(weights[2]) * p1)
    q0, q1 = p0 + jnp.tensordot(shares, eta, 1), p1 + jnp.tensordot(shares, remembered, 1)

    # 2. The path of q, and its values at the ends of the short steps.
    path = _path(p0, p1, q0, q1, jnp.tensordot(shares, left_over, 1))
    pace = jnp.broadcast_to(tau.reshape(-1, *[1] * (p0.ndim - 2)), (FINER, *p0.shape[:-2]))
    if loaded:
        # the sum Q(tau) of q under a sum of pressures that is linear in time
        cells = (-2, -1)
        load, change, held = jnp.sum(p0, cells), jnp.sum(p1 - p0, cells), jnp.sum(eta, cells)
        loads = load + pace * change
        by_old, by_new = (
            (w @ shares * tau * own).reshape(pace.shape[:1] + (1,) * (p0.ndim - 2)) for w in (old, new)
        )
        sums = loads * (1.0 + by_new) + load * by_old + jnp.tensordot(decay * shares, held, 1)
        first, last = jnp.sum(q0, cells), sums[-1]
        moves = jnp.abs(last - first) > SAME * jnp.abs(last)
        run = jnp.clip((sums - first) / jnp.where(moves, last - first, 1.0), 0.0, 1.0)
        # the pace at which the sum along the path, taken as a power of the pace by its value in the middle, is Q
        places = jnp.array([0.0, 0.5, 1.0]).reshape(3, *[1] * p0.ndim)
        start, middle, end = jnp.sum(path(places), cells)
        bends = jnp.abs(end - start) > SAME * jnp.abs(end)
        half = jnp.where(bends, (middle - start) / jnp.where(bends, end - start, 1.0), 0.5)
        pace = jnp.where(moves, run ** (-1.0 / jnp.log2(jnp.clip(half, 0.1, 0.9))), pace)
    q = path(pace[..., None, None]).at[-1].set(q1)

    # 3. The short steps of (eta_k, p), each with the next q. A last cell has a unit pressure that relaxes at a constant q.
    short, a, b = own / FINER, decay[0], own / FINER * new[0]
    free = jnp.concatenate([jnp.diag(a), (short * old[0])[:, None]], 1)
    pressed = jnp.append(b, 1.0) / (1.0 + shares @ b)
    step = jnp.concatenate([free, jnp.zeros((1, len(rates) + 1))]) - jnp.outer(pressed, shares @ free)
    state = jnp.concatenate([eta + error.variables, (p0 + error.pressure)[None]])
    with_unit = lambda fields, unit: jnp.concatenate([fields.reshape(len(fields), -1), unit], 1)
    state = with_unit(state, jnp.zeros((len(rates) + 1, 1)).at[-1].set(1.0))
    short_step = lambda state, q: (step @ state + pressed[:, None] * q, None)
    state, _ = jax.lax.scan(short_step, state, with_unit(q, jnp.ones((FINER, 1))))
    relaxed = state[-1, -1]  # what is left of a unit pressure at a constant q
    state = state[:, :-1].reshape(-1, *p0.shape)

    # 4. The differences between short steps and march, with what the true way leaves instead of the straight one.
    strayed = jnp.zeros(())
    if lapse.bent is not None:
        count = lapse.bent.rates
        left = _left_aside(before, after, rates[:count], own, lapse.bent)
        risen = jnp.tensordot(shares[:count], left, 1)
        state = state.at[:count].add(left).at[-1].add(-risen / (1.0 + shares @ b))
        strayed = jnp.max(jnp.abs(risen))
    touched = (p0 != 0.0) | (p1 != 0.0)
    variables = jnp.where(touched, state[:-1] - remembered, over_cells(decay[-1]) * error.variables)
    # a cell that has left contact although its q has risen by more than p: its pressure has relaxed to zero too early
    overshot = (p0 > 0.0) & (p1 == 0.0) & (q1 - q0 > p0)
    off = jnp.where(((p1 != 0.0) | overshot) & lapse.touches, state[-1] - p1, 0.0)
    if p1.ndim == 2:
        off = jnp.where(p1 >= 0.0, jnp.maximum(off, -p1), off)
    if loaded:
        missing = jnp.sum(off, (-2, -1), keepdims=True)
        off = off - jnp.where(p1 != 0.0, missing, 0.0) / jnp.maximum(
            jnp.sum(p1 != 0.0, (-2, -1), keepdims=True), 1
        )

    # 5. The estimate: of the largest error and of that of the sum.
    size, right, wrong = jnp.max(jnp.abs(p1)), jnp.max(jnp.abs(p1 + off)), jnp.max(jnp.abs(off))
    largest = jnp.maximum(size, error.largest * relaxed)
    scale = jnp.maximum(right, FAINT * largest)
    sum_off, all_of_it = jnp.sum(off, (-2, -1)), jnp.sum(jnp.abs(p1 + off))
    in_sum = jnp.max(jnp.abs(sum_off)) * right / jnp.where(all_of_it > 0.0, all_of_it, jnp.inf)
    changed = lambda by: jnp.minimum(by / jnp.maximum(CHANGED * jnp.max(jnp.abs(q1)), 1e-300), 1.0)
    unsure = changed(jnp.max(jnp.abs(q1 - q0))) + changed(strayed)
    doubt = jnp.maximum(jnp.where(own > 0.0, unsure, 0.0), error.doubt * relaxed)
    found = (1.0 + CAUTION * doubt) * jnp.maximum(wrong, in_sum)
    estimate = jnp.where(scale > 0.0, found / jnp.where(scale > 0.0, scale, 1.0), 0.0)
    return StepError(remembered, variables, off, largest, doubt, estimate)


def _left_aside(before: Array, after: Array, rates: Array, dt: Array, bent: Bent) -> Array:
    """Return the difference of eta_k at the end of a step between the true way of the contact and the straight one, (K, mx,
    my).

    With X(s) the true way, of an even acceleration, and Y(s) that of the mean velocity, it is the integral over the step of
    exp(-lambda_k (dt - s)) (p(x + X(dt) - X(s), s) - p(x + Y(dt) - Y(s), s)), by the midpoint rule.
    """
    mode = "wrap" if all(bent.periodic) else "constant"
    places = jnp.stack([_sampled(place) for place in jnp.indices(before.shape)])

    def at(total: Array, tau: Array) -> tuple[Array, None]:
        pressure = before + tau * (after - before)
        straight = places + ((1.0 - tau) * bent.move)[:, None, None]
        true = straight - (4.0 * tau * (1.0 - tau) * bent.aside)[:, None, None]
        there, here = (map_coordinates(pressure, list(each), 1, mode) for each in (true, straight))
        return total + jnp.tensordot(jnp.exp(-rates * dt * (1.0 - tau)), there - here, 0), None

    start = jnp.zeros((len(rates), *places.shape[1:]))
    return dt / ASIDE * jax.lax.scan(at, start, (jnp.arange(ASIDE) + 0.5) / ASIDE)[0]


def _path(p0: Array, p1: Array, q0: Array, q1: Array, left_over: Array) -> Callable[[Array | float], Array]:
    """Return the function of the pace, from 0 to 1, that gives q within a step (2. of the comment above).

    p0, p1, q0, q1: p and q before and after the step; left_over: q at its end if there were no pressure in the step.
    """
    if p0.ndim > 2:  # tractions
        return lambda pace: q0 + (q1 - q0) * pace
    entered, both = (p0 == 0.0) & (p1 > 0.0), (p0 > 0.0) & (p1 > 0.0)
    # q above ``base``, before and after the step: a cell that was in contact earlier keeps what earlier pressure left
    base = jnp.where(entered, jnp.minimum(left_over, q1), 0.0)
    from_, to = jnp.where(entered, 0.0, q0), q1 - base
    count = jnp.sum(both)
    # in a new contact with a punch, whose edge carries more than its middle, all cells enter at once
    inner = entered & jnp.all(
        jnp.stack([jnp.roll(entered, by, axis) for axis in (0, 1) for by in (1, -1)]), 0
    )
    mean = lambda cells: jnp.sum(jnp.where(cells, to, 0.0)) / jnp.maximum(jnp.sum(cells), 1)
    punch = (count == 0) & jnp.any(inner) & (mean(entered & ~inner) > mean(inner))

    # q^2 is linear inside; the first cell that enters does so at the start of the step, the others later
    first = jnp.where(punch, to, jnp.max(jnp.where(entered, to, 0.0)))
    at_edge = jnp.maximum(jnp.max(first), jnp.max(jnp.where((p0 > 0.0) & (p1 == 0.0), q0, 0.0)))
    squares_before, squares_after = jnp.where(entered, jnp.minimum(to**2 - first**2, 0.0), from_**2), to**2

    # the share of a linear q in place of a linear q^2, from the change of q^2 inside over that at the edge
    inside = jnp.sum(jnp.where(both, jnp.abs(squares_after - squares_before), 0.0)) / jnp.maximum(count, 1)
    even = (inside - EVEN * at_edge**2) / jnp.where(at_edge > 0.0, 2.0 * at_edge**2, 1.0)
    even = jnp.where(at_edge > 0.0, jnp.clip(even, 0.0, 1.0), 1.0)
    even = jnp.where(count > 0, even, jnp.where(punch, 1.0, 0.0))
    low = jnp.where(entered, to - first, from_)
    attracted = jnp.minimum(from_, to) < 0.0

    def path(pace: Array | float) -> Array:
        straight = low + (to - low) * pace
        squares = jnp.sqrt(jnp.maximum(squares_before + (squares_after - squares_before) * pace, 0.0))
        mixed = (1.0 - even) * squares + even * jnp.maximum(straight, 0.0)
        return base + jnp.where(attracted, straight, mixed)

    return path
