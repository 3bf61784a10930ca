"""The driver of long runs: a march in blocks of steps, with progress, that keeps what is finished.

``jaxcontact.indent`` is one compiled call and tells nothing until it ends. Here the same march runs in
blocks of one static length, each from the carry of the one before, so that there is one compilation,
a count of finished steps after every block, and something to keep when a run is stopped.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxcontact._experiment import Experiment, Plan, reported
from jaxcontact.controls import Control
from jaxcontact.grid import Grid
from jaxcontact.history import march as marching
from jaxcontact.indentation import planned
from jaxcontact.indenters import Indenter
from jaxcontact.layers import LayeredHalfSpace
from jaxcontact.results import ContactHistory

BLOCK = 5  # steps: short enough for a lively bar, long enough that calling the block costs nothing


@dataclass(frozen=True)
class Simulation:
    """What a driven run gives back: the steps that were finished, and why it ended.

    history: of the finished steps, which are all fine. pressure_line [Pa], displacement_line [m]: along x
    at the row of cells nearest to y = 0, (n, nx); peak_pressure [Pa]: (n,); requested: the number of steps
    asked for; status: 0, or that of the step that stopped the run (see ``ContactHistory``), which is
    not in the history; interrupted: stopped by Ctrl-C.
    """

    history: ContactHistory | None
    pressure_line: np.ndarray
    displacement_line: np.ndarray
    peak_pressure: np.ndarray
    requested: int
    status: int
    interrupted: bool


class Kept(NamedTuple):
    """What is kept of a block, scaled: outcomes with or without fields, the last step's, lines, peaks."""

    outcomes: marching.Outcome
    last: marching.Outcome
    pressure_line: np.ndarray
    displacement_line: np.ndarray
    peak: np.ndarray


def simulate(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    times: Any,
    *,
    grid: Grid,
    tolerance: float = 1e-8,
    max_iterations: int = 500,
    save: str = "all",
    substeps: int = 1,
    correspondence: str = "exact",
    progress: Callable[[int], Any] | None = None,
) -> Simulation:
    """``jaxcontact.indent`` in blocks; the arguments are those of ``indent``, save is "all" or "last".

    progress: called after each block with the number of steps that it finished. The run stops at the
    first step that is not fine, and at a KeyboardInterrupt, with the finished steps kept.

    Raises ValueError as ``indent`` does, before anything is computed; warns as it does.
    """
    experiment = Experiment.of(
        body, indenter, control, times, grid=grid, tolerance=tolerance, max_iterations=max_iterations,
        save=save, substeps=substeps, correspondence=correspondence,
    )  # fmt: skip
    plan = _plan(experiment)
    parts, status, interrupted = _collect(plan, save, progress or _silent)
    history = _history(parts, plan, experiment)
    if history is not None:
        reported(history, plan.separation, None)
    lines = _lines(parts, grid.shape[0], float(plan.scale.compliance), float(plan.scale.length))
    return Simulation(history, *lines, len(plan.steps.dt), status, interrupted)


_plan = jax.jit(planned)


@jax.jit
def run_block(
    setup: marching.Setup, carry: marching.Carry, steps: marching.Steps
) -> tuple[marching.Carry, marching.Outcome]:
    """One compiled block: leading axes of ``steps`` (BLOCK, substeps)."""
    carry, outcomes, _ = marching.march(setup, carry, steps, lambda outcome: outcome)
    return carry, outcomes


def _silent(count: int) -> None:
    """No progress wanted."""


def _collect(plan: Plan, save: str, progress: Callable[[int], Any]) -> tuple[list[Kept], int, bool]:
    """March block by block until the end, the first bad step or Ctrl-C; status and interruption."""
    parts: list[Kept] = []
    carry = marching.start(plan.setup)
    blocks, padding = marching.in_blocks(plan.steps, BLOCK)
    try:
        for index in range(len(blocks.dt)):
            block = jax.tree.map(lambda a, i=index: a[i], blocks)
            carry, outcomes = run_block(plan.setup, carry, block)
            outcomes = marching.without_padding(outcomes, padding) if index == 0 else outcomes
            outcomes = jax.tree.map(np.asarray, outcomes)
            bad = np.flatnonzero(outcomes.status)
            fine = jax.tree.map(lambda a, end=bad[0] if bad.size else None: a[:end], outcomes)
            if fine.status.size:
                parts.append(_keep(fine, save))
                progress(fine.status.size)
            if bad.size:
                return parts, int(outcomes.status[bad[0]]), False
    except KeyboardInterrupt:
        return parts, 0, True
    return parts, 0, False


def _keep(fine: marching.Outcome, save: str) -> Kept:
    middle = fine.pressure.shape[2] // 2
    last = jax.tree.map(lambda a: a[-1], fine)
    kept = fine if save == "all" else fine._replace(pressure=None, displacement=None)
    lines = (np.array(fine.pressure[:, :, middle]), np.array(fine.displacement[:, :, middle]))
    return Kept(kept, last, *lines, np.max(fine.pressure, axis=(1, 2)))


def _history(parts: list[Kept], plan: Plan, experiment: Experiment) -> ContactHistory | None:
    """The finished steps in SI units, or None when there are none."""
    if not parts:
        return None
    outcomes = jax.tree.map(lambda *a: np.concatenate(a), *[part.outcomes for part in parts])
    times = experiment.times[: outcomes.status.size]
    return ContactHistory(**plan.history(experiment.grid, times, outcomes, parts[-1].last))


def _lines(
    parts: list[Kept], nx: int, compliance: float, length: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pressure lines [Pa], displacement lines [m] and peak pressures [Pa]."""
    pressure = [np.zeros((0, nx))] + [part.pressure_line for part in parts]
    displacement = [np.zeros((0, nx))] + [part.displacement_line for part in parts]
    peak = [np.zeros(0)] + [part.peak for part in parts]
    scaled = (np.concatenate(pressure), np.concatenate(displacement), np.concatenate(peak))
    return scaled[0] / compliance, scaled[1] * length, scaled[2] / compliance
