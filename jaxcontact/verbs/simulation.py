"""The driver of long runs: a march in blocks of steps that are handed out as they finish.

``jaxcontact.indent`` is one compiled call and tells nothing until it ends. Here the same march runs in
blocks of one static length, each from the carry of the one before, so that there is one compilation,
something to keep after every block, and a place to go on from when a run was stopped.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support.pytree import pytree
from jaxcontact.history import march as marching
from jaxcontact.results.contact import AdhesiveHistory, ContactHistory
from jaxcontact.verbs.experiment import Experiment, Plan, doubted
from jaxcontact.verbs.indent import planned

BLOCK = 5  # steps: short enough for a lively bar, long enough that calling the block costs nothing


@dataclass(frozen=True)
class FinishedBlock:
    """What a run has finished since the block before.

    history: of the steps that are fine, with all their fields, in numpy arrays and SI units; status: 0, or that
    of the step that ends the run (see ``ContactHistory``), which is not in the history; carry: the leaves
    of what the march goes on from.
    """

    history: ContactHistory
    status: int
    carry: list[np.ndarray]


@pytree
class Simulation:
    """A march that is ready to start; ``prepare`` makes it."""

    experiment: Experiment
    plan: Plan

    def blocks(self, done: int = 0, carry: Sequence[np.ndarray] | None = None) -> Iterator[FinishedBlock]:
        """The blocks after the first ``done``, which ended with ``carry``; the first bad step ends them.

        A march that goes on from a carry gives bit for bit what it would have given without a stop.
        """
        state, blocks, padding = _begun(self.plan)
        if carry is not None:
            state = jax.tree.unflatten(jax.tree.structure(state), [jnp.asarray(leaf) for leaf in carry])
        on_host = jax.device_get(self)  # numpy: each operation of jax outside run_block would be a program
        blocks, padding = jax.device_get((blocks, padding))
        for index in range(done, len(blocks.dt)):
            state, outcomes = run_block(self.plan.setup, state, jax.tree.map(lambda a, i=index: a[i], blocks))
            outcomes = jax.device_get(outcomes)
            if index == 0:
                outcomes = jax.tree.map(lambda a: np.delete(a, np.s_[1 : 1 + padding], axis=0), outcomes)
            first = max(0, index * BLOCK - padding)
            block = on_host._block(first, outcomes, jax.device_get(jax.tree.leaves(state)))
            yield block
            if block.status:
                return

    def _block(self, first: int, outcomes: marching.Outcome, carry: list[np.ndarray]) -> FinishedBlock:
        """The fine steps of a block, of which ``first`` is the first, in SI units."""
        elapsed = self.experiment.times[first : first + outcomes.status.size] - self.experiment.times[0]
        status = np.asarray(doubted(outcomes.status, elapsed, self.plan.errors))
        outcomes = outcomes._replace(status=status)
        bad = np.flatnonzero(status)
        count = int(bad[0]) if bad.size else outcomes.status.size
        fine = jax.tree.map(lambda a: a[:count], outcomes)
        times = self.experiment.times[first : first + count]
        history = self.plan.history(self.experiment.grid, times, fine, fine)
        kind = ContactHistory if self.experiment.adhesion is None else AdhesiveHistory
        in_numpy = jax.tree.map(np.asarray, kind(**history))
        return FinishedBlock(in_numpy, int(outcomes.status[bad[0]]) if bad.size else 0, carry)


def prepare(*case: Any, **options: Any) -> Simulation:
    """``jaxcontact.indent`` made ready to run in blocks; the arguments are those of ``indent``.

    Raises ValueError as ``indent`` does, before anything is computed.
    """
    return ready(Experiment.of(*case, **options))


def ready(experiment: Experiment) -> Simulation:
    """The march of an experiment, made ready."""
    experiment = experiment.with_kernels()
    return Simulation(experiment, _plan(experiment))


def first_block(experiment: Experiment) -> tuple[Plan, marching.Carry, marching.Outcome]:
    """The plan of a march and what its first block gives, scaled; for their shapes."""
    plan = ready(experiment).plan
    state, blocks, _ = _begun(plan)
    return plan, *run_block(plan.setup, state, jax.tree.map(lambda a: a[0], blocks))


_plan = Program(planned)


@Program
def _begun(plan: Plan) -> tuple[marching.Carry, marching.Steps, int]:
    """The carry before the first step, the steps in blocks, and how many rows are added to the first."""
    return marching.start(plan.setup), *marching.in_blocks(plan.steps, BLOCK)


@Program
def run_block(
    setup: marching.Setup, carry: marching.Carry, steps: marching.Steps
) -> tuple[marching.Carry, marching.Outcome]:
    """One compiled block: leading axes of ``steps`` (BLOCK, substeps)."""
    carry, outcomes, _ = marching.march(setup, carry, steps, lambda outcome: outcome)
    return carry, outcomes
