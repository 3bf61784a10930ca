"""The command line: ``jaxcontact``, the same as ``python -m jaxcontact``.

Exit status: 0; 1 when a comparison with the paper does not hold; 2 for bad input, a contact at the grid's
edge or a grid too coarse; 3 when a solve did not converge or cases of a
study failed; 130 after Ctrl-C, 143 after SIGTERM, 129 after SIGHUP.
What goes wrong is one line on stderr.
"""

import argparse
import contextlib
import io
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from jaxcontact._compile.compilation_cache import enable_compilation_cache, local_folder
from jaxcontact._compile.kept_traces import UntrustedFolderError, kept_traces
from jaxcontact._support.version import __version__
from jaxcontact.commands import look
from jaxcontact.commands.completion import SHELLS, completing
from jaxcontact.commands.interrupts import exit_status, signal_of, signals_interrupt
from jaxcontact.commands.run import run
from jaxcontact.commands.status import BAD_INPUT, complain, tell
from jaxcontact.commands.sweep import run_study
from jaxcontact.files.case_schema import KINDS
from jaxcontact.files.chosen_times import ALL, FEW, LAST
from jaxcontact.paper import REPRODUCTIONS

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"

CASE_HELP = "a case file in SI units, or the name of one that comes with the package; see: jaxcontact cases"

STUDY_HELP = "a case file with a table [sweep] of what varies, or the name of one that comes with the package"

EXAMPLES = (
    "jaxcontact run tribofilm_creep -o out        # a case that comes with the package",
    "jaxcontact new mine.toml                     # a case of your own, to change",
    "jaxcontact check mine.toml                   # valid? grid and steps fine enough?",
    "jaxcontact sweep film_map -o study           # many cases of one, in one table",
    "jaxcontact fit creep film.csv -o film        # material parameters from data",
    "jaxcontact reproduce figure_4 -o paper       # against the paper",
)
OF_RUN = (
    "jaxcontact run polymer_coating -o out        # a case that comes with the package",
    "jaxcontact run mine.toml -o out --save all   # one of your own, with maps of all times however large",
    "jaxcontact run mine.toml -o out --resume     # go on where it was stopped",
    "jaxcontact run --show tribofilm_creep        # print it with all defaults",
)
OF_CHECK = (
    "jaxcontact check tribofilm_creep             # a case that comes with the package",
    "jaxcontact check mine.toml                   # one of your own: memory, disk and time steps too",
)
OF_NEW = (
    "jaxcontact new mine.toml                     # an indentation",
    "jaxcontact new shear mine.toml               # normal and tangential load, with friction",
)
OF_SWEEP = (
    "jaxcontact sweep film_map -o study           # a study that comes with the package",
    "jaxcontact sweep mine.toml -o study --processes 4",
)
OF_PLOT = (
    "jaxcontact plot out/result.npz               # out/result.png",
    "jaxcontact plot out/result.npz -o creep.svg",
)
OF_CONVERT = (
    "jaxcontact convert out/result.npz -o out.pvd # for ParaView: a film of all times",
    "jaxcontact convert out/result.npz -o out.nc  # for xarray and MATLAB",
)
OF_REPRODUCE = (
    "jaxcontact reproduce figure_4 -o paper       # one of them, and paper/report.html",
    "jaxcontact reproduce -o paper                # all: some minutes",
)


def main(arguments: list[str] | None = None) -> int:
    """Run a command; its exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        with signals_interrupt():
            return _dispatch(arguments)
    except (ValueError, OSError, ImportError, MemoryError) as error:
        return complain(str(error), BAD_INPUT)
    except KeyboardInterrupt as interrupt:
        return complain(f"interrupted by {signal_of(interrupt).name}", exit_status(interrupt))


def _dispatch(arguments: list[str]) -> int:
    with contextlib.ExitStack() as kept:
        try:
            enable_compilation_cache()
            if (folder := local_folder()) is not None:
                kept.enter_context(kept_traces(folder / "traces"))
        except UntrustedFolderError as error:
            tell(f"jaxcontact: warning: {error}", sys.stderr)
        except OSError:  # a home that cannot be written: compile, as ever
            pass
        return _command(arguments)


def _command(arguments: list[str]) -> int:
    if arguments[:1] == ["fit"]:
        from fitting.cli import command  # it takes a second to import, which the others need not wait for

        return command.main(arguments[1:])
    options = _parser().parse_args(arguments)
    return options.command(options)


def _parser_with_fits() -> argparse.ArgumentParser:
    """The parser with those of the fits, which otherwise parse by themselves."""
    from fitting.cli import command

    return _parser(command.add_parser)


def _parser(add_fits: Callable[[Commands], None] = lambda kinds: None) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="jaxcontact",
        description="Time-dependent contact with a layered body.",
        epilog=_examples(EXAMPLES),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"jaxcontact {__version__}")
    parser.add_argument(
        "--completion",
        choices=SHELLS,
        action=completing(_parser_with_fits),
        help='for a shell: eval "$(jaxcontact --completion bash)"',
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_run(commands)
    _add_case_commands(commands)
    _add_sweep(commands)
    fit = commands.add_parser("fit", help="material parameters from creep or indentation data")
    add_fits(fit.add_subparsers(metavar="KIND"))
    _add_result_commands(commands)
    command = _add(commands, "reproduce", "compare with the paper's figures and tables", OF_REPRODUCE)
    names = f"of figures and tables, all when absent: {', '.join(REPRODUCTIONS)}"
    command.add_argument("names", nargs="*", metavar="NAME", help=names)
    _add_output(command, required=True)
    command.set_defaults(command=_reproduce)
    commands.add_parser("cite", help="how to cite").set_defaults(command=look.cite)
    return parser


def _add(commands: Commands, name: str, what: str, examples: tuple[str, ...]) -> argparse.ArgumentParser:
    """A command, with examples at the end of its help."""
    return commands.add_parser(
        name,
        help=what,
        description=f"{what[0].upper()}{what[1:]}.",
        epilog=_examples(examples),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def _examples(lines: tuple[str, ...]) -> str:
    return "\n  ".join(["examples:", *lines])


def _add_run(commands: Commands) -> None:
    command = _add(commands, "run", "run a case file", OF_RUN)
    command.add_argument("case", type=look.case_path, metavar="CASE.toml", help=CASE_HELP)
    command.add_argument("--show", action="store_true", help="print it with all defaults, and do not run")
    command.add_argument(
        "--save",
        choices=(ALL, FEW, LAST),
        help="maps of all times, of nine at most, of the last; when absent as the case says, or all up to 32 MB, else nine",
    )
    how = _add_output(command, required=False)
    how.add_argument("--resume", action="store_true", help="go on with the run that was stopped in DIR")
    command.set_defaults(command=run)


def _add_case_commands(commands: Commands) -> None:
    command = _add(commands, "new", "write a case file to begin with", OF_NEW)
    kinds = tuple(KINDS)
    command.add_argument(
        "kind",
        nargs="?",
        choices=kinds,
        default=kinds[0],
        metavar="KIND",
        help=f"{', '.join(kinds)}; {kinds[0]} when absent",
    )
    command.add_argument("file", type=Path, metavar="FILE.toml", help="the file to write")
    command.add_argument("--force", action="store_true", help="overwrite FILE")
    command.set_defaults(command=look.new)
    command = _add(commands, "check", "validate a case file without running it", OF_CHECK)
    command.add_argument("case", type=look.case_path, metavar="CASE.toml", help=CASE_HELP)
    command.set_defaults(command=look.check)
    command = commands.add_parser("cases", help="list the case files that come with the package")
    command.set_defaults(command=look.cases)


def _add_sweep(commands: Commands) -> None:
    command = _add(commands, "sweep", "run the many cases of a study", OF_SWEEP)
    command.add_argument("study", type=look.case_path, metavar="STUDY.toml", help=STUDY_HELP)
    command.add_argument(
        "-o",
        dest="directory",
        type=Path,
        metavar="DIR",
        required=True,
        help="where results go, or are already",
    )
    command.add_argument("--force", action="store_true", help="leave cases out of the table that is there")
    where = command.add_mutually_exclusive_group()
    where.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster, as tcp://host:8786")
    where.add_argument(
        "--processes", type=int, metavar="N", help="of this machine; one for each core when absent"
    )
    command.set_defaults(command=run_study)


def _add_result_commands(commands: Commands) -> None:
    plot = _add(commands, "plot", "draw a saved result", OF_PLOT)
    plot.add_argument("-o", dest="picture", type=Path, metavar="FILE", help=".png, .svg or .pdf")
    plot.set_defaults(command=look.plot)
    convert = _add(commands, "convert", "write a saved result for another program", OF_CONVERT)
    kinds = ".pvd for ParaView, .nc (NetCDF) or .npz (numpy)"
    convert.add_argument("-o", dest="file", type=Path, metavar="FILE", required=True, help=kinds)
    convert.set_defaults(command=look.convert)
    for command in (plot, convert):
        command.add_argument("result", type=Path, metavar="RESULT", help="a result.npz, or a .nc file")
        command.add_argument("--force", action="store_true", help="overwrite FILE")


def _add_output(parser: argparse.ArgumentParser, required: bool) -> "argparse._MutuallyExclusiveGroup":
    """Where results go; the group of ways to go on in a directory that is not empty."""
    parser.add_argument(
        "-o", dest="directory", type=Path, metavar="DIR", required=required, help="where results go"
    )
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--force", action="store_true", help="overwrite what is in DIR")
    return how


def _reproduce(options: argparse.Namespace) -> int:
    """Compare with the paper; the exit status of the comparison."""
    from jaxcontact.paper import reproduce

    return reproduce.main(options.names, options.directory, force=options.force)


def enter() -> None:
    """``main`` as the shell calls it, which ends the process."""
    if isinstance(
        sys.stdout, io.TextIOWrapper
    ):  # a console without some letter of a file name shows its number
        sys.stdout.reconfigure(errors="backslashreplace")
    status = main()
    if status > 128:  # what jax still computes at that moment may crash the interpreter's own way out
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


if __name__ == "__main__":
    enter()
