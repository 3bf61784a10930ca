"""``jaxcontact run``: run a case and write the results.

An experiment over time marches in blocks of steps, each kept on disk as it finishes, and goes on from them. A steady
state is one compiled program, and its run is all or nothing: stopped, or not found, it leaves nothing.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from jaxcontact._support import files
from jaxcontact._support.status import Status
from jaxcontact._support.terminal import (
    BAD_INPUT,
    FINE,
    NOT_CONVERGED,
    Progress,
    exit_status,
    interruptible,
    print_error,
    recorded_warnings,
    signal_of,
    tell,
    working,
)
from jaxcontact.results.notes import in_one_line, kind_of
from jaxcontact.results.summaries import lines_of
from jaxcontact.shell import advice
from jaxcontact.shell.case_file import Case, CaseError, case_of, case_text, mistakes_in_tables, read_tables
from jaxcontact.shell.case_schema import KINDS, chosen
from jaxcontact.shell.finished_steps import FinishedRun, FinishedSteps, ResumePoint, fingerprint
from jaxcontact.simulate.run import Experiment, blocks, plan_of, reported

KEYS = {  # of the case file, which to change after a step that ended with that status
    Status.NOT_CONVERGED: "solver",
    Status.AT_EDGE: "grid.width",
    Status.TOO_COARSE: "grid.n",
    Status.MOVED_TOO_FAR: "solver.substeps",
    Status.REENTERED_TRACK: "grid.width",
    Status.NOT_STEADY: "experiment",
    Status.OUT_OF_RANGE: "experiment",
    Status.GROSS_SLIP: "control.tangential_load",
    Status.INHERITED: "solver",
    Status.NOT_FINITE: "experiment",
    Status.NOT_RESOLVED: "experiment",
    Status.STEP_TOO_LONG: "solver.substeps",
    Status.TOO_THICK: "solver.thickest",
    Status.PULLED_OFF: "control.load",
    Status.LOAD_ABOVE_HARDNESS: "grid.width",
}


@dataclass(frozen=True)
class Ending:
    """The end of a run: its progress, its results, the signal that stopped it, and warnings of one line each.

    run: the finished steps of an experiment over time, or the result of a steady state.
    """

    resume_point: ResumePoint
    run: Any
    interrupt: KeyboardInterrupt | None
    notes: list[str]

    @property
    def status(self) -> int:
        """The exit status."""
        if self.interrupt is not None:
            return exit_status(self.interrupt)
        return {0: FINE, 1: NOT_CONVERGED, Status.INHERITED: NOT_CONVERGED}.get(
            self.resume_point.status, BAD_INPUT
        )


def run(options: argparse.Namespace) -> int:
    """Read the case, then show it or march and write; the exit status."""
    tables = read_tables(options.case)
    # a directory that will be refused, unless another run is there, which ``claimed`` reports
    directory = options.directory
    if directory is not None and not (options.show or options.resume or (directory / files.LOCK).exists()):
        files.refuse_taken(directory, force=options.force, resume=False)
    if options.save is not None and isinstance(tables.setdefault("solver", {}), dict):
        tables["solver"]["save"] = options.save  # in place of that of the file
    try:
        case = case_of(tables, options.case)
    except CaseError as error:
        others = {f"{options.case}: {mistake}" for mistake in mistakes_in_tables(tables)} - {str(error)}
        hint = f"; and {len(others)} more, which jaxcontact check {options.case} lists" if others else ""
        raise CaseError(f"{error}{hint}") from error
    if options.show:
        print(case_text(case), end="")
        return FINE
    if options.directory is None:
        return print_error(
            "run: -o: missing; accepted: -o DIR, the directory of the results, or --show", BAD_INPUT
        )
    advice.check(case, options.case)
    advice.check_disk(case, options.case, options.directory)
    maps = chosen(case.kept, case.times.size)
    folder, result = options.directory / files.UNFINISHED, case.result
    steps = FinishedSteps(folder, fingerprint(case), maps, result)
    if options.resume and (ended := _ended(options.directory, steps.fingerprint)) is not None:
        count = f"{ended.resume_point.steps} of {case.times.size} steps are finished"
        tell(f"{options.directory}: {count}; --resume has nothing left to compute", sys.stdout)
        return _finish(ended, case, options)
    with files.claimed(options.directory, force=options.force, resume=options.resume) as taken:
        if not options.resume:
            steps.remove()
        experiment = case.experiment()
        ending = _at_once(case, options.case, steps) if experiment is None else _march(experiment, steps)
        spared = taken and not options.resume and ending.status == BAD_INPUT
        if ending.run is not None and not spared:
            _write(ending.run, case, ending, options, steps.fingerprint)
        if ending.interrupt is None:
            steps.remove()
    for note in ending.notes:
        tell(f"jaxcontact: warning: {note}", sys.stderr)
    return _finish(ending, case, options)


def _ended(directory: Path, digest: str) -> Ending | None:
    """Return the ending of a run of the same case that went to its own end in this directory; otherwise None."""
    try:
        summary = json.loads((directory / "summary.json").read_text(encoding="utf-8"))
        stopped = summary["interrupted"] or summary["case_digest"] != digest
        resume_point = ResumePoint(steps=summary["steps_finished_count"], status=summary["status"])
    except (OSError, ValueError, KeyError, TypeError):  # none, or one of an earlier version
        return None
    left = (directory / files.UNFINISHED).exists() or not (directory / "result.npz").exists()
    return None if stopped or left else Ending(resume_point, None, None, [])


@contextmanager
def _noted() -> Iterator[list[str]]:
    """Within, notes and other warnings become lines of the list."""
    lines: list[str] = []
    with recorded_warnings() as caught:
        try:
            yield lines
        finally:
            lines += [in_one_line(message) for message in caught]


def _at_once(case: Case, path: Path, steps: FinishedSteps) -> Ending:
    """Compute a steady state; it is a result only if it is fine."""
    steps.resume_point()  # no steps of another case are there to go on from
    began = time.perf_counter()
    with _noted() as notes, working(f"compiling and running {case.kind}"):
        try:
            result = interruptible(case.run)
        except KeyboardInterrupt as error:
            return Ending(ResumePoint(), None, error, notes)
        except ValueError as error:
            raise CaseError(f"{path}: {error}") from error
    status = int(result.status)
    resume_point = ResumePoint(steps=int(not status), status=status, seconds=time.perf_counter() - began)
    return Ending(resume_point, None if status else result, None, notes)


def _march(experiment: Experiment, steps: FinishedSteps) -> Ending:
    """March on from the finished steps, with a bar on stderr."""
    interrupt, run = None, None
    with _noted() as salvaged:
        resume_point = steps.resume_point()
    began = time.perf_counter() - resume_point.seconds
    with _noted() as notes, Progress(experiment.times.size, "step", resume_point.steps) as progress:
        notes += salvaged
        plan = plan_of(experiment)
        try:
            for block in (
                blocks(plan, resume_point.blocks, resume_point.carry) if resume_point.status == 0 else ()
            ):
                resume_point = steps.add(resume_point, block, time.perf_counter() - began)
                progress.advance(block.history.times.size)
        except KeyboardInterrupt as error:
            interrupt, resume_point = error, steps.resume_point()
        if resume_point.steps:
            run = steps.together(resume_point.blocks, experiment.grid)
            told = reported(run.history, plan.errors, experiment)
            run = replace(run, history=told)
    return Ending(resume_point, run, interrupt, notes)


def _write(run: Any, case: Case, ending: Ending, options: argparse.Namespace, digest: str) -> None:
    """The results into the directory, the main figures on stdout."""
    from jaxcontact.shell import finished_steps

    facts = {
        "case": options.case.name,
        "case_digest": digest,
        "status": ending.resume_point.status,
        "status_meaning": Status(ending.resume_point.status).message,
        "interrupted": ending.interrupt is not None,
        "warnings": ending.notes,
        "wall_time_s": ending.resume_point.seconds,
    }
    report = (
        finished_steps.of_steps(run, case.kept)
        if isinstance(run, FinishedRun)
        else finished_steps.of_result(run)
    )
    summary = finished_steps.write_results(report, options.directory, case, facts)
    rows = [
        f"{summary['steps_finished_count']} of {summary['steps_requested_count']} steps, in {options.directory}:"
    ]
    rows += lines_of(summary)
    rows += [f"note: {kind}" for kind in dict.fromkeys(map(kind_of, ending.notes))]
    if report.course and len(report.arrays["times"]) < len(report.course["times"]):
        counts = f"{len(report.arrays['times'])} of {len(report.course['times'])} times"
        rows.append(
            f"maps of {counts}: result.npz; lines and figures of all: course.npz (--save all: every map)"
        )
    rows.append("pictures: " + ", ".join(str(options.directory / name) for name in summary["pictures"]))
    tell("\n".join(rows), sys.stdout)


def _finish(ending: Ending, case: Case, options: argparse.Namespace) -> int:
    """Say why a run ended early; the exit status."""
    if ending.status == FINE:
        return FINE
    done, requested = ending.resume_point.steps, case.times.size
    if ending.interrupt is not None:
        reason = f"{done} of {requested} steps are finished"
        if done:
            reason += f"; jaxcontact run {options.case} -o {options.directory} --resume goes on"
        if KINDS[case.kind].march is None:
            reason = f"nothing is kept, since {case.kind} runs at once"
        name = signal_of(ending.interrupt).name
        return print_error(f"{options.case}: interrupted by {name}: {reason}", ending.status)
    status = Status(ending.resume_point.status)
    where = f"step {done + 1} of {requested}: " if requested > 1 else ""
    return print_error(f"{options.case}: {KEYS[status]}: {where}{status.message}", ending.status)
