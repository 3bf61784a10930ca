"""Running an experiment: its compiled march, the diagnostics of the result for its notes, and the warnings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support import checks
from jaxcontact._support.pytree import is_concrete, pytree, replace
from jaxcontact._support.status import LARGEST_ERROR, LARGEST_STEP_ERROR, Status, most_serious
from jaxcontact.history.motion import TooFewSubstepsError
from jaxcontact.history.time_loop import Carry, Outcome, Rows, Stepper, begin, begun, in_blocks, march
from jaxcontact.indenters.shapes import HeightField, Sphere
from jaxcontact.operators.kernels import Errors
from jaxcontact.response.normal import limits_of
from jaxcontact.results.contact import ContactHistory, nan_where_invalid
from jaxcontact.results.notes import announce
from jaxcontact.simulate.experiment import Experiment, Plan, Settings, TimedExperiment

REFINED = (1, 4, 16, 64)  # substeps that "auto" tries
ROUNDED = 1e-12  # change of a thickness, over it, that is rounding


@Program
def _run(experiment: TimedExperiment) -> tuple[ContactHistory, Errors]:
    """The compiled core of all experiments over time: one trace for equal shapes and options."""
    plan = experiment.planned()
    return plan.marched(experiment.options), plan.errors


def marched(experiment: TimedExperiment) -> Any:
    """Return the finished result of an experiment over time, without warnings."""
    result, errors = _run(experiment.with_kernels())
    return finished(result, errors, experiment)


def finished(result: Any, errors: Errors, experiment: Experiment) -> Any:
    """Return a result with the diagnostics that its notes need, nan throughout where values were out of range."""
    single = jnp.asarray(not isinstance(experiment.indenter, HeightField))
    radius = experiment.indenter.radius if isinstance(experiment.indenter, Sphere) else jnp.inf
    told = replace(
        result.diagnostics,
        separation_error=errors.separation,
        image_error=errors.images,
        single_contact=single,
        widenings=jnp.zeros((), int),
    )
    rounded = experiment.indenter.size_error(experiment.grid)
    told = replace(
        told, **jax.lax.stop_gradient({"ball_radius": jnp.asarray(radius, float), "size_error": rounded})
    )
    if experiment.temperatures:
        told = replace(told, coldest=_least(experiment.temperatures))
    if experiment.film_map is not None:
        told = replace(told, thickness_error=jnp.asarray(errors.thickness), **_steepness(experiment, result))
    return nan_where_invalid(
        replace(result, status=_doubted(result, errors), diagnostics=told), experiment.valid
    )


def refined(
    make: Callable[[Settings], TimedExperiment],
    settings: Settings,
    substeps: int | str,
    solve: Callable[[Any], Any] = marched,
    exact: Callable[[Any, Any], bool] = lambda experiment, history: True,
) -> Any:
    """Return the history of an experiment with a number of substeps, or, with "auto", with the first of ``REFINED`` whose
    estimated errors by the time steps are below 1 %, or else with the last; without warnings.

    make: the experiment with some settings; solve: its history; exact: whether further errors of the time steps are small.
    """
    with_substeps = lambda count: replace(settings, options=replace(settings.options, substeps=count))
    if substeps != "auto":
        return solve(make(with_substeps(substeps)))
    for count in REFINED:
        try:
            experiment = make(with_substeps(count))
        except TooFewSubstepsError:
            if count == REFINED[-1]:
                raise
            continue
        history = solve(experiment)
        checks.require(
            is_concrete(history.status), 'substeps: expected a number inside jit, vmap and grad, got "auto"'
        )
        unknown = not np.all(np.isfinite(history.time_step_error)) or experiment.changes_in_given_ways
        short = not np.any(np.asarray(history.time_step_error) > LARGEST_ERROR)
        if short and exact(experiment, history) and not np.any(history.status == Status.STEP_TOO_LONG):
            break
    told = replace(
        history.diagnostics,
        step_limit=np.float64(LARGEST_ERROR),
        refined=np.int64(count),
        unjudged=np.bool_(unknown),
    )
    return replace(history, diagnostics=told)


def _least(values: list[Any]) -> Array:
    """Return the least of some values, without derivative, ()."""
    return jax.lax.stop_gradient(jnp.min(jnp.stack([jnp.min(jnp.asarray(v, float)) for v in values])))


def _steepness(experiment: Experiment, result: Any) -> dict[str, Array]:
    """Return the largest slope of a film's thickness, given or formed, and whether the film is stiffer than its base."""
    assert experiment.film_map is not None
    grid, maps = experiment.grid, [experiment.film_map.values]
    if hasattr(result, "thickness"):
        maps.append(result.thickness)
    along = [axis for axis, n in enumerate(grid.shape) if n > 1]
    slopes = [
        jnp.max(jnp.abs(_differences(values, axis - 2, grid.periodic[axis]))) / grid.spacing[axis]
        for values in maps
        for axis in along
    ]
    ratio = limits_of(experiment.body).stiffness_ratio()
    found = {"thickness_slope": jnp.max(jnp.stack(slopes)), "stiff_film": jnp.asarray(ratio > 1.0)}
    if hasattr(result, "thickness"):
        last = result.thickness[-1] if result.thickness.ndim == 3 else result.thickness
        grown, least = last - experiment.film_map.at_first, ROUNDED * jnp.max(jnp.abs(last))
        found["narrow_growth"] = _narrowest(
            jnp.where(jnp.abs(grown) > least, grown, 0.0), along, grid.periodic
        )
    return found


def _narrowest(grown: Array, axes: list[int], periodic: tuple[bool, bool]) -> Array:
    """Return how far a cell has grown beyond all its neighbours along some axes, relative to the largest change, ()."""
    highest = jnp.full_like(grown, -jnp.inf)
    for axis in axes:
        ends = [(1, 1) if other == axis else (0, 0) for other in (0, 1)]
        padded = (
            jnp.pad(grown, ends, "wrap") if periodic[axis] else jnp.pad(grown, ends, constant_values=-jnp.inf)
        )
        for start in (0, 2):
            beside = jax.lax.slice_in_dim(padded, start, start + grown.shape[axis], axis=axis)
            highest = jnp.maximum(highest, beside)
    beyond, largest = jnp.max(grown - highest), jnp.max(jnp.abs(grown))
    return jnp.where(largest > 0.0, beyond / jnp.where(largest > 0.0, largest, 1.0), 0.0)


def _differences(values: Array, axis: int, periodic: bool) -> Array:
    """Return the differences between neighbours along an axis."""
    return values - jnp.roll(values, 1, axis) if periodic else jnp.diff(values, axis=axis)


def reported(result: Any, errors: Errors, experiment: Experiment) -> Any:
    """Return a finished result, and issue its notes as warnings to the caller of the verb."""
    result = finished(result, errors, experiment)
    announce(result, stacklevel=3)
    return result


def _doubted(result: Any, errors: Errors) -> Array:
    """Return the status with the known errors of the response; a steady state lasts for one passage of its grid."""
    if hasattr(result, "times"):
        return _doubted_until_now(result.status, result.times, errors, result.time_step_error)
    speed = jnp.sqrt(jnp.sum(jnp.asarray(result.velocity) ** 2))
    width = jnp.max(jnp.stack(result.grid.width))
    return doubted(result.status, width / jnp.where(speed > 0.0, speed, 1.0), errors)


@jax.jit
def _doubted_until_now(status: Array, times: Array, errors: Errors, step_error: Array) -> Array:
    """Return ``doubted`` at the times of a result, compiled as one program instead of one for each operation."""
    return doubted(status, times - times[0], errors, step_error)


def doubted(status: Array, elapsed: Array, errors: Errors, step_error: Array | float = 0.0) -> Array:
    """Return the status, with ``NOT_RESOLVED`` where the error of the response exceeds 1 %, and ``STEP_TOO_LONG`` where that
    of the pressure by the time steps exceeds 10 %, unless it is more serious; later times do not inherit these."""
    largest = jnp.maximum(jnp.maximum(errors.separation, errors.images), errors.thickness)
    # an infinite error is that of a response which is not finite, and has this status
    off = ((largest > LARGEST_ERROR) & jnp.isfinite(largest)) | (elapsed > errors.horizon)
    return most_serious(
        (off, Status.NOT_RESOLVED), (step_error > LARGEST_STEP_ERROR, Status.STEP_TOO_LONG), status=status
    )


# The driver of long runs: a march in blocks of steps that are handed out as they finish.
#
# A verb such as ``jaxcontact.indent`` is one compiled call and tells nothing until it ends. Here the same march runs
# in blocks of one static length, each from the carry of the one before, so that there is one compilation, something
# to keep after every block, and a place to go on from when a run was stopped.


BLOCK = 5  # steps: short enough for a lively bar, long enough that calling the block costs nothing


@dataclass(frozen=True)
class FinishedBlock:
    """The steps that a run has finished since the previous block.

    history: of the steps that are fine, with all their fields, in numpy arrays and SI units; status: 0, or that
    of the step that ends the run (see ``ContactHistory``), which is not in the history; carry: the leaves
    of what the march goes on from.
    """

    history: ContactHistory
    status: int
    carry: list[np.ndarray]


@pytree
class Simulation:
    """A march that is ready to start; ``ready`` makes it."""

    experiment: TimedExperiment
    plan: Plan

    def blocks(self, done: int = 0, carry: Sequence[np.ndarray] | None = None) -> Iterator[FinishedBlock]:
        """The blocks after the first ``done``, which ended with ``carry``; the first bad step ends them.

        A march that goes on from a carry gives bit for bit what it would have given without a stop.
        """
        state, blocks = _begun(self.plan)
        if carry is not None:
            state = jax.tree.unflatten(jax.tree.structure(state), [jnp.asarray(leaf) for leaf in carry])
        on_host = jax.device_get(self)  # numpy: each operation of jax outside run_block would be a program
        blocks = jax.device_get(blocks)
        for index in range(done, len(blocks.exists)):
            rows = jax.tree.map(lambda a, i=index: a[i], blocks)
            state, outcomes = run_block(self.plan.stepper, state, rows)
            block = on_host._block(index * BLOCK, jax.device_get(outcomes), jax.device_get(state))
            yield block
            if block.status:
                return

    def _block(self, first: int, outcomes: Outcome, carry: Carry) -> FinishedBlock:
        """Return the fine steps of a block, of which ``first`` is the first, in SI units."""
        times = self.plan.course["times"]
        elapsed = times[first : first + BLOCK] - times[0]
        own = outcomes.numbers["status"][: elapsed.size]  # fewer than those of a block that is filled up
        step_error = outcomes.numbers["time_step_error"][: elapsed.size]
        status = np.asarray(doubted(own, elapsed, self.plan.errors, step_error))
        bad = np.flatnonzero(status)
        count = int(bad[0]) if bad.size else status.size
        fine = jax.tree.map(lambda a: a[:count], outcomes)
        fine.numbers["status"] = jnp.asarray(status[:count])
        history = self.plan.result(fine, carry, {}, slice(first, first + count))
        in_numpy = jax.tree.map(np.asarray, history)
        return FinishedBlock(in_numpy, int(status[bad[0]]) if bad.size else 0, jax.tree.leaves(carry))


def ready(experiment: TimedExperiment) -> Simulation:
    """The march of an experiment, made ready."""
    experiment = experiment.with_kernels()
    return Simulation(experiment, _planned(experiment))


def first_block(experiment: TimedExperiment) -> tuple[Plan, Carry, Outcome]:
    """The plan of a march and what its first block gives, scaled; for their shapes."""
    plan = ready(experiment).plan
    state, blocks = _begun(plan)
    return plan, *run_block(plan.stepper, state, jax.tree.map(lambda a: a[0], blocks))


@Program
def _planned(experiment: TimedExperiment) -> Plan:
    return experiment.planned()


@Program
def _begun(plan: Plan) -> tuple[Carry, Rows]:
    """The carry before the first step, and the steps in blocks."""
    return begin(plan.stepper), in_blocks(plan.steps, BLOCK)


@Program
def run_block(stepper: Stepper, carry: Carry, rows: Rows) -> tuple[Carry, Outcome]:
    """One compiled block of ``BLOCK`` rows."""
    state, outcomes = march(stepper, begun(stepper, carry, rows.steps), rows, lambda outcome: outcome)
    return state.carry, outcomes
