"""``jaxcontact run``: march through a case, keep each block of steps as it finishes, write the results."""

import argparse
import sys
import time
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from jaxcontact._experiment import reported
from jaxcontact._status import Status
from jaxcontact.commands.interrupts import exit_status, signal_of
from jaxcontact.commands.status import BAD_INPUT, FINE, NOT_CONVERGED, complain, tell
from jaxcontact.files import advice, run_directory
from jaxcontact.files.case_file import Case, read_case
from jaxcontact.files.case_text import case_text
from jaxcontact.files.finished_steps import FinishedRun, FinishedSteps, Standing, fingerprint
from jaxcontact.simulation import prepare


@dataclass(frozen=True)
class Ending:
    """How a march ended: how far it has come, with what, the signal that stopped it, warnings of one line each."""

    standing: Standing
    run: FinishedRun | None
    interrupt: KeyboardInterrupt | None
    notes: list[str]

    @property
    def status(self) -> int:
        """The exit status."""
        if self.interrupt is not None:
            return exit_status(self.interrupt)
        return {0: FINE, 1: NOT_CONVERGED}.get(self.standing.status, BAD_INPUT)


def run(options: argparse.Namespace) -> int:
    """Read the case, then show it or march and write; the exit status."""
    case = read_case(options.case)
    if options.show:
        print(case_text(case), end="")
        return FINE
    if options.directory is None:
        return complain("run: -o: missing; accepted: -o DIR, where results go, or --show", BAD_INPUT)
    advice.check(case, options.case)
    advice.check_disk(case, options.case, options.directory)
    return _run_into(options.directory, case, options)


def _run_into(directory: Path, case: Case, options: argparse.Namespace) -> int:
    kept = case.options.get("save", "all")
    steps = FinishedSteps(directory / run_directory.UNFINISHED, fingerprint(case), kept)
    with run_directory.claimed(directory, force=options.force, resume=options.resume) as taken:
        if not options.resume:
            steps.remove()
        ending = _march(case, steps)
        spared = taken and not options.resume and ending.status == BAD_INPUT
        if ending.run is not None and not spared:
            _write(ending.run, case, ending, options)
        if ending.interrupt is None:
            steps.remove()
    for note in ending.notes:
        tell(f"jaxcontact: warning: {note}", sys.stderr)
    return _finish(ending, case, options)


def _march(case: Case, steps: FinishedSteps) -> Ending:
    """March on from the finished steps, with a bar on stderr."""
    standing, interrupt, run = steps.standing(), None, None
    began = time.perf_counter() - standing.seconds
    # disable=None: silent when stderr is not a terminal; the delay: none for a short run
    bar = tqdm(
        total=case.times.size, initial=standing.steps, unit="step", disable=None, delay=2.0, leave=False
    )
    with warnings.catch_warnings(record=True) as caught, bar:
        warnings.simplefilter("always")
        given = (case.body, case.indenter, case.control, case.times)
        simulation = prepare(*given, grid=case.grid, **case.options)
        try:
            for block in simulation.blocks(standing.blocks, standing.carry) if standing.status == 0 else ():
                standing = steps.add(standing, block, time.perf_counter() - began)
                bar.update(block.history.times.size)
        except KeyboardInterrupt as error:
            interrupt, standing = error, steps.standing()
        if standing.steps:
            run = steps.together(case.grid)
            reported(run.history, simulation.plan.errors, None)
    notes = [" ".join(str(warning.message).split()) for warning in caught]
    return Ending(standing, run, interrupt, notes)


def _write(run: FinishedRun, case: Case, ending: Ending, options: argparse.Namespace) -> None:
    """The results of the finished steps into the directory, the main figures on stdout."""
    from jaxcontact.files.run_results import write_results  # matplotlib takes a second to import

    facts = {
        "case": options.case.name,
        "status": ending.standing.status,
        "status_meaning": Status(ending.standing.status).message,
        "interrupted": ending.interrupt is not None,
        "warnings": ending.notes,
        "wall_time_s": ending.standing.seconds,
    }
    _report(write_results(run, options.directory, case, facts), options.directory)


def _finish(ending: Ending, case: Case, options: argparse.Namespace) -> int:
    """Say why a run ended early; the exit status."""
    if ending.status == FINE:
        return FINE
    done, requested = ending.standing.steps, case.times.size
    if ending.interrupt is not None:
        reason = f"{done} of {requested} steps are finished"
        if done:
            reason += f"; jaxcontact run {options.case} -o {options.directory} --resume goes on"
        name = signal_of(ending.interrupt).name
        return complain(f"{options.case}: interrupted by {name}: {reason}", ending.status)
    key = {1: "solver", 2: "grid.width", 3: "grid.n"}[ending.standing.status]
    meaning = Status(ending.standing.status).message
    return complain(f"{options.case}: {key}: step {done + 1} of {requested}: {meaning}", ending.status)


def _report(summary: dict[str, Any], directory: Path) -> None:
    """The main figures on stdout."""
    rows = [f"{summary['steps_finished_count']} of {summary['steps_requested_count']} steps, in {directory}:"]
    for name, unit in (("approach", "m"), ("load", "N"), ("peak_pressure", "Pa"), ("contact_radius", "m")):
        start, end = (summary[f"{name}_{when}_{unit}"] for when in ("start", "end"))
        rows.append(f"  {name.replace('_', ' '):15s} {start:.6g} -> {end:.6g} {unit}")
    rows.append("pictures: " + ", ".join(str(directory / name) for name in summary["pictures"]))
    tell("\n".join(rows), sys.stdout)
