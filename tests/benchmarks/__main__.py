"""What everything costs: one command, a table, and JSON.

    python -m tests.benchmarks [--full] [-o FILE.json] [PROBLEM ...]

Each problem runs in a process of its own, with nothing compiled before. Without --full the cost of a step at 128 x 128, in
minutes; with it against size, to 2048 x 2048, and against steps, to 2000, which takes hours.
``measure`` says what the columns are, README.md beside this file what was found.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.benchmarks.problems import PROBLEMS

AT_ONCE = ("hertz", "coated", "rough, a tenth in contact", "rough, a third in contact")
QUICK = {"film": 30, "film, one program": 30, "film, reverse gradient": 30, "film, four tangents": 30,
         "slide": 30, "shear": 10}  # fmt: skip
COLUMNS = {
    "n": "n", "steps": "steps", "ratio": "ratio", "convolutions": "counted", "preconditioned": "precond.",
    "seconds": "seconds", "first_call_s": "first", "programs": "programs", "compiling_s": "compiling",
    "memory_MB": "MB",
}  # fmt: skip


def plan(names: list[str], full: bool) -> Iterator[tuple[str, int, int]]:
    """What is measured: problem, cells along each side, steps."""
    for name in names:
        if name in AT_ONCE:
            yield from ((name, n, 1) for n in ((128, 256, 512, 1024, 2048) if full else (128,)))
        elif not full:
            yield name, 128, QUICK[name]
        else:
            yield from ((name, n, 100) for n in (128, 256, 512))
            yield from ((name, 128, steps) for steps in (500, 2000) if name != "shear")


def measured(module: str, *arguments: object) -> dict[str, Any]:
    """The line of JSON of a process."""
    command = [sys.executable, "-m", f"tests.benchmarks.{module}", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        return {"problem": arguments[0], "n": arguments[1], "skipped": done.stderr.strip().splitlines()[-1]}
    return json.loads(done.stdout.splitlines()[-1])


def row(found: dict[str, Any]) -> str:
    """A measurement as a line of the table."""
    if "skipped" in found:
        return f"{found['problem']:28s} {found['n']:>6} skipped: {found['skipped']}"
    cells = (found.get(name, "") for name in COLUMNS)
    return f"{found['problem']:28s}" + "".join(
        f"{cell:>10.3g}" if isinstance(cell, float) else f"{cell:>10}" for cell in cells
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description="What everything costs.")
    parser.add_argument(
        "problems", nargs="*", metavar="PROBLEM", choices=[*PROBLEMS, []], help="all when absent"
    )
    parser.add_argument("--full", action="store_true", help="against size and steps; hours")
    parser.add_argument("-o", dest="file", type=Path, metavar="FILE.json", help="the figures as JSON")
    options = parser.parse_args()
    print(f"{'problem':28s}" + "".join(f"{heading:>10}" for heading in COLUMNS.values()), flush=True)
    found = []
    jobs: list[tuple] = [("measure", *job) for job in plan(options.problems or list(PROBLEMS), options.full)]
    jobs += [] if options.problems else [("others", n) for n in ((128, 256, 512) if options.full else (128,))]
    for job in jobs:
        found.append(measured(*job))
        print(row(found[-1]), flush=True)
        if options.file:
            options.file.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
