"""The driver of long runs: a march in blocks of steps that are handed out as they finish.

A verb such as ``jaxcontact.indent`` is one compiled call and tells nothing until it ends. Here the same march runs in
blocks of one static length, each from the carry of the one before, so that there is one compilation,
something to keep after every block, and a place to go on from when a run was stopped.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support.pytree import pytree
from jaxcontact.history.march import Carry, Outcome, Rows, Stepper, begin, begun, in_blocks, march
from jaxcontact.results.contact import ContactHistory
from jaxcontact.verbs.experiment import TimedExperiment
from jaxcontact.verbs.plan import Plan
from jaxcontact.verbs.running import doubted

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
