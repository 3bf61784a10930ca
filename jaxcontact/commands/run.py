"""``jaxcontact run``: march through a case and write what was finished."""

import argparse
import sys
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jaxcontact.commands.status import BAD_INPUT, FINE, INTERRUPTED, NOT_CONVERGED, complain

if TYPE_CHECKING:
    from jaxcontact.files.case_file import Case
    from jaxcontact.simulation import Simulation


def run(options: argparse.Namespace) -> int:
    """Read the case, then show it or march and write; the exit status."""
    from jaxcontact.files.case_file import read_case
    from jaxcontact.files.case_text import case_text

    case = read_case(options.case)
    if options.show:
        print(case_text(case), end="")
        return FINE
    if options.directory is None:
        return complain("run: -o: missing; accepted: -o DIR, where results go, or --show", BAD_INPUT)
    return _march(case, options)


def _march(case: "Case", options: argparse.Namespace) -> int:
    from jaxcontact.files import run_directory

    taken = run_directory.claim(options.directory, options.force)
    started = time.perf_counter()
    result, notes = _simulate(case, str(options.case))
    for note in notes:
        print(f"jaxcontact: warning: {note}", file=sys.stderr)
    if result.history is not None and not (taken and _exit_status(result) == BAD_INPUT):
        facts = {"case": options.case.name, "warnings": notes, "wall_time_s": time.perf_counter() - started}
        _report(run_directory.write_results(result, options.directory, facts, case), options.directory)
    return _finish(result, options.case)


def _simulate(case: "Case", name: str) -> tuple["Simulation", list[str]]:
    """The run with a bar on stderr, and its warnings, one line each."""
    from tqdm import tqdm

    from jaxcontact.simulation import simulate

    # disable=None: silent when stderr is not a terminal; the delay: none for a short run
    bar = tqdm(total=case.times.size, unit="step", disable=None, delay=2.0, leave=False)
    with warnings.catch_warnings(record=True) as caught, bar:
        warnings.simplefilter("always")
        try:
            result = simulate(
                case.body,
                case.indenter,
                case.control,
                case.times,
                grid=case.grid,
                progress=bar.update,
                **case.options,
            )
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from error
    return result, [" ".join(str(warning.message).split()) for warning in caught]


def _exit_status(result: "Simulation") -> int:
    if result.interrupted:
        return INTERRUPTED
    return {0: FINE, 1: NOT_CONVERGED}.get(result.status, BAD_INPUT)


def _finish(result: "Simulation", case: Path) -> int:
    """Say why a run ended early; the exit status."""
    from jaxcontact.results import STATUS_MEANING

    done = 0 if result.history is None else len(result.history.times)
    status = _exit_status(result)
    if status == FINE:
        return FINE
    if result.interrupted:
        return complain(f"{case}: interrupted: {done} of {result.requested} steps are finished", status)
    key = {1: "solver", 2: "grid.width", 3: "grid.n"}[result.status]
    return complain(
        f"{case}: {key}: step {done + 1} of {result.requested}: {STATUS_MEANING[result.status]}", status
    )


def _report(summary: dict[str, Any], directory: Path) -> None:
    """The main figures on stdout."""
    print(f"{summary['steps_finished_count']} of {summary['steps_requested_count']} steps, in {directory}:")
    for name, unit in (("approach", "m"), ("load", "N"), ("peak_pressure", "Pa"), ("contact_radius", "m")):
        start, end = (summary[f"{name}_{when}_{unit}"] for when in ("start", "end"))
        print(f"  {name.replace('_', ' '):15s} {start:.6g} -> {end:.6g} {unit}")
    print("pictures: " + ", ".join(str(directory / name) for name in summary["pictures"]))
