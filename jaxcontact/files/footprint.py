"""The memory and disk space that a run needs, computed beforehand, and what the machine has.

Memory: the process with its compiler; the kernels, the state and the fields of a block of steps, whose shapes
jax gives without computing; and the work arrays of the compiled programs, in units of the kernels. The finished
steps are on disk: once in blocks, together with the state after the last block and the one before, and at
the end a second time as one file.
"""

import math
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax

from jaxcontact._compile.kept_traces import shapes
from jaxcontact._support.fields import FIELDS, VECTOR
from jaxcontact._support.run_directory import UNFINISHED
from jaxcontact.files.case_file import Case
from jaxcontact.files.case_schema import KINDS
from jaxcontact.files.chosen_times import FEW, chosen, maps_of
from jaxcontact.files.finished_steps import StoredFields
from jaxcontact.results.labels import stored_fields
from jaxcontact.verbs.experiment import TimedExperiment
from jaxcontact.verbs.simulation import BLOCK, first_block

# measured with jax 0.10.1 on a CPU: resident memory, and the work arrays reported by the compiler
PROCESS = 0.6e9  # bytes
# bytes for each byte of the tables of the direct superposition, while they are computed
SUPERPOSITION = 210.0
HEADERS = 4.3e3  # bytes of the names and shapes of arrays in a file


@dataclass(frozen=True)
class Footprint:
    """The peak requirements of a run, in bytes.

    memory: within a factor of 1.5 of measured values; disk: just before the run ends.
    """

    memory: float
    disk: float


def footprint_of(case: Case) -> Footprint:
    """Return the requirements of a run of the case."""
    experiment = case.experiment()
    return _at_once(case) if experiment is None else _in_blocks(case, experiment)


def _at_once(case: Case) -> Footprint:
    """Return the requirements of a steady state, one compiled program: its work arrays and the fields of its result."""
    field, maps = (
        8.0 * case.grid.shape[0] * case.grid.shape[1],
        maps_of(stored_fields(KINDS[case.kind].result), 1),
    )
    memory = PROCESS + (KINDS[case.kind].memory + 3.0 * maps) * field
    return Footprint(memory, maps * field + 8.0 * 20 + HEADERS)


def _in_blocks(case: Case, experiment: TimedExperiment) -> Footprint:
    """Return the requirements of a run in blocks of steps."""
    plan, *block = shapes(first_block, experiment)
    kernels, steps, carry, outcomes = (_bytes(tree) for tree in (plan.stepper, plan.steps, *block))
    work = KINDS[case.kind].memory * kernels
    if experiment.options.correspondence == "quasi-elastic":
        work = max(work, SUPERPOSITION * steps)
    (nx, ny), stored = case.grid.shape, StoredFields.of(KINDS[case.kind].result)
    kept = chosen(case.kept, case.times.size).size
    numbers = sum(1 + (FIELDS[name].dimensions == VECTOR) for name in stored.series)
    each, whole = _bytes(block[1].fields) / BLOCK, 8.0 * nx * ny * len(stored.whole)
    line = 8.0 * (2 * nx + numbers + 3)  # with radius, peak and verdict
    maps, lines = each * kept, line * case.times.size
    memory = PROCESS + kernels + steps + 2.0 * (carry + outcomes) + work + 3.0 * lines
    headers = HEADERS * (case.times.size / BLOCK + 3.0)
    duplicates = line * kept if case.kept == FEW else 0.0  # in result.npz and in course.npz
    disk = (
        2.0 * (maps + lines)
        + duplicates
        + 2.0 * carry
        + 3.0 * whole
        + (2.0 if kept else 3.0) * each
        + headers
    )
    return Footprint(memory, disk)


def disk_room(directory: Path) -> float:
    """Return the bytes that a run in this directory may use: free disk space plus the size of its finished steps."""
    there = next(path for path in (directory, *directory.absolute().parents) if path.exists())
    own = sum(path.stat().st_size for path in (directory / UNFINISHED).glob("*"))
    return float(shutil.disk_usage(there).free + own)


def machine_memory() -> float:
    """Return the bytes of memory of the machine or of the container; inf if the system does not report them."""
    if not hasattr(os, "sysconf") or "SC_PHYS_PAGES" not in os.sysconf_names:
        return math.inf
    return min(float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")), container_memory())


def container_memory(groups: Path = Path("/sys/fs/cgroup"), own: Path = Path("/proc/self/cgroup")) -> float:
    """Return the smallest limit of this process's control group (version 2) and those above it."""
    try:
        path = next(line[4:] for line in own.read_text().splitlines() if line.startswith("0::/"))
    except (OSError, StopIteration):
        return math.inf
    files = [groups / part / "memory.max" for part in (Path(path), *Path(path).parents)]
    limits = [file.read_text().strip() for file in files if file.is_file()]
    return min((float(limit) for limit in limits if limit != "max"), default=math.inf)


def _bytes(tree: Any) -> float:
    return sum(math.prod(leaf.shape) * leaf.dtype.itemsize for leaf in jax.tree.leaves(tree))
