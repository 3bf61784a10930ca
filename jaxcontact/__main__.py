"""The command line: ``jaxcontact``, the same as ``python -m jaxcontact``.

Exit status: 0; 2 for bad input, a contact at the grid's edge or a grid too coarse; 3 when a solve did
not converge; 130 after Ctrl-C. What goes wrong is one line on stderr.
"""

import argparse
import sys
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jaxcontact.case_file import Case
    from jaxcontact.simulation import Simulation

FINE, BAD_INPUT, NOT_CONVERGED, INTERRUPTED = 0, 2, 3, 130


def main(arguments: list[str] | None = None) -> int:
    """Run a command; its exit status."""
    options = _parser().parse_args(arguments)
    try:
        return options.command(options)
    except (ValueError, OSError) as error:
        return _complain(str(error), BAD_INPUT)
    except KeyboardInterrupt:
        return _complain("interrupted before a step was finished: nothing written", INTERRUPTED)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="jaxcontact", description="Time-dependent contact with a layered body."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    run = commands.add_parser("run", help="run a case file")
    run.add_argument(
        "case", type=Path, metavar="CASE.toml", help="the case, in SI units; see: jaxcontact cases"
    )
    _add_output(run)
    run.set_defaults(command=_run)
    reproduce = commands.add_parser("reproduce", help="compare with the paper's figures and tables")
    reproduce.add_argument("names", nargs="*", metavar="NAME", help="figures and tables; all when absent")
    _add_output(reproduce)
    reproduce.set_defaults(command=_reproduce)
    cases = commands.add_parser("cases", help="list the case files that come with the package")
    cases.set_defaults(command=_cases)
    return parser


def _add_output(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-o", dest="directory", type=Path, metavar="DIR", required=True, help="where results go"
    )
    parser.add_argument("--force", action="store_true", help="overwrite what is in DIR")


def _complain(message: str, status: int) -> int:
    """One line on stderr, whatever the message."""
    print(f"jaxcontact: error: {' '.join(message.split())}", file=sys.stderr)
    return status


def _run(options: argparse.Namespace) -> int:
    """Read the case, march, write what was finished."""
    from jaxcontact import saving
    from jaxcontact.case_file import read_case

    case = read_case(options.case)
    taken = saving.claim(options.directory, options.force)
    started = time.perf_counter()
    run, notes = _simulate(case, str(options.case))
    for note in notes:
        print(f"jaxcontact: warning: {note}", file=sys.stderr)
    if run.history is not None and not (taken and _exit_status(run) == BAD_INPUT):
        facts = {"case": options.case.name, "warnings": notes, "wall_time_s": time.perf_counter() - started}
        _report(saving.save(run, options.directory, facts), options.directory)
    return _finish(run, options.case)


def _simulate(case: "Case", name: str) -> tuple["Simulation", list[str]]:
    """The run with a bar on stderr, and its warnings, one line each."""
    from tqdm import tqdm

    from jaxcontact.simulation import simulate

    # disable=None: silent when stderr is not a terminal; the delay: none for a short run
    bar = tqdm(total=case.times.size, unit="step", disable=None, delay=2.0, leave=False)
    with warnings.catch_warnings(record=True) as caught, bar:
        warnings.simplefilter("always")
        try:
            run = simulate(
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
    return run, [" ".join(str(warning.message).split()) for warning in caught]


def _exit_status(run: "Simulation") -> int:
    if run.interrupted:
        return INTERRUPTED
    return {0: FINE, 1: NOT_CONVERGED}.get(run.status, BAD_INPUT)


def _finish(run: "Simulation", case: Path) -> int:
    """Say why a run ended early; the exit status."""
    from jaxcontact.results import STATUS_MEANING

    done = 0 if run.history is None else len(run.history.times)
    status = _exit_status(run)
    if status == FINE:
        return FINE
    if run.interrupted:
        return _complain(f"{case}: interrupted: {done} of {run.requested} steps are finished", status)
    key = {1: "solver", 2: "grid.width", 3: "grid.n"}[run.status]
    return _complain(
        f"{case}: {key}: step {done + 1} of {run.requested}: {STATUS_MEANING[run.status]}", status
    )


def _report(summary: dict[str, Any], directory: Path) -> None:
    """The main figures on stdout."""
    print(f"{summary['steps_finished_count']} of {summary['steps_requested_count']} steps, in {directory}:")
    for name, unit in (("approach", "m"), ("load", "N"), ("peak_pressure", "Pa"), ("contact_radius", "m")):
        start, end = (summary[f"{name}_{when}_{unit}"] for when in ("start", "end"))
        print(f"  {name.replace('_', ' '):15s} {start:.6g} -> {end:.6g} {unit}")


def _reproduce(options: argparse.Namespace) -> int:
    """Compare with the paper; the exit status of the comparison."""
    from jaxcontact.cases import reproduce

    return reproduce.main(options.names, options.directory, force=options.force)


def _cases(options: argparse.Namespace) -> int:
    """Each ready-made case file and the first line of its comment."""
    for path in sorted((Path(__file__).parent / "cases").glob("*.toml")):
        title = path.read_text(encoding="utf-8").splitlines()[0].lstrip("# ")
        print(f"{path}\n    {title}")
    return FINE


if __name__ == "__main__":
    sys.exit(main())
