"""The parts of a run's computing time, from the profiler of jax.

    python -m tests.benchmarks.profile PROBLEM N [STEPS]

Prints, for each kind of operation, the number of operations per step, their time per step in units of one convolution
(see measure.py), and their share; and the operations that take most of the time. The times are those of the threads
that execute the compiled programs, added up. An operation that is repeated is counted with the 10th percentile of its
times, so that other programs on the machine change the result little. The profiler itself adds about a microsecond to
each operation, and loses operations of long runs: the number per step of the transforms tells whether it did.
"""

import re
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxcontact._compile.programs import optimised_at_once
from tests.benchmarks.measure import unit
from tests.benchmarks.problems import PROBLEMS

CONTAINERS = r"while|cond|call|Thunk|conditional|end:"
KINDS = {
    "transforms": r"fft",
    "sums and maxima": r"reduce|dot",  # sums are products with ones
    "copies, padding and cropping": r"copy|pad|slice|concatenate|transpose|broadcast",
    "linear algebra": r"svd|ynn|custom-call|qr|cholesky|triangular",
    "element by element": r"",
}
LISTED = 15


def operations(run: Callable[[], Any], folder: str) -> tuple[Counter, Counter]:
    """Number and time [s] of the operations of a run by their names in the compiled programs."""
    jax.block_until_ready(run())
    with jax.profiler.trace(folder):
        jax.block_until_ready(run())
    found = defaultdict(list)
    for path in Path(folder).rglob("*.xplane.pb"):
        for plane in jax.profiler.ProfileData.from_file(str(path)).planes:
            for line in (line for line in plane.lines if line.name.startswith("tf_XLA")):
                for event in line.events:
                    if not re.match(CONTAINERS, event.name):
                        found[event.name].append(event.duration_ns / 1e9)
    number = Counter({name: len(times) for name, times in found.items()})
    return number, Counter({name: len(times) * np.percentile(times, 10) for name, times in found.items()})


def kind_of(name: str) -> str:
    return next(kind for kind, pattern in KINDS.items() if re.search(pattern, name))


def table(name: str, n: int, steps: int) -> str:
    problem = PROBLEMS[name](n, steps)
    with tempfile.TemporaryDirectory() as folder, optimised_at_once():  # as in a run of any length
        number, seconds = operations(problem.run, folder)
    a_unit, whole = unit(n) * problem.steps, sum(seconds.values())
    lines = [f"{'':30s} {'per step':>9s} {'units':>7s} {'share':>6s}"]

    def row(label: str, names: list[str]) -> str:
        count, time = sum(number[each] for each in names), sum(seconds[each] for each in names)
        return f"{label:30s} {count / problem.steps:9.1f} {time / a_unit:7.2f} {time / whole:6.1%}"

    kinds = {kind: [op for op in number if kind_of(op) == kind] for kind in KINDS}
    lines += [row(kind, names) for kind, names in kinds.items()] + [row("all", list(number)), ""]
    lines += [row(op[:30], [op]) for op, _ in seconds.most_common(LISTED)]
    return "\n".join(lines)


if __name__ == "__main__":
    problem, n, *steps = sys.argv[1:]
    print(table(problem, int(n), int(steps[0]) if steps else 30))
