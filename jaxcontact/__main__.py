"""The command line: ``jaxcontact``, the same as ``python -m jaxcontact``.

Exit status: 0; 1 if a comparison with the paper does not hold; 2 for bad input, a contact at the grid's
edge or a grid that is too coarse; 3 if a solve did not converge or cases of a
study failed; 130 after Ctrl-C, 143 after SIGTERM, 129 after SIGHUP, 141 if the output is no longer read.
Errors are reported in one line on stderr, by ``check`` in a line for each mistake of a case file.
"""

import argparse
import contextlib
import gc
import io
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

from jaxcontact._support.terminal import (
    BAD_INPUT,
    Parser,
    exit_status,
    print_error,
    signal_of,
    signals_interrupt,
)
from jaxcontact._support.version import __version__
from jaxcontact.shell import look

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"

CASE_HELP = "a case file in SI units, or the name of one that comes with the package; see: jaxcontact cases"

STUDY_HELP = (
    "a case file with a table [sweep] of the keys that vary, or the name of one that comes with the package"
)

EXAMPLES = (
    "jaxcontact run tribofilm_creep -o out        # a case that comes with the package",
    "jaxcontact new mine.toml                     # write a template of a case file",
    "jaxcontact check mine.toml                   # validate the case, its grid and its time steps",
    "jaxcontact sweep film_map -o study           # variations of a case, in one table",
    "jaxcontact fit creep film.csv -o film        # material parameters from data",
    "jaxcontact reproduce figure_4 -o paper       # compare with the figures of Wang et al. (2025)",
)
OF_RUN = (
    "jaxcontact run polymer_coating -o out        # a case that comes with the package",
    "jaxcontact run mine.toml -o out --save all   # a case of your own, with maps at all times, whatever their size",
    "jaxcontact run mine.toml -o out --resume     # continue a run that was stopped",
    "jaxcontact run --show tribofilm_creep        # print a case with all defaults",
)
OF_CHECK = (
    "jaxcontact check tribofilm_creep             # a case that comes with the package",
    "jaxcontact check mine.toml                   # a case of your own",
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
    "jaxcontact convert out/result.npz -o out.pvd # for ParaView: an animation over all times",
    "jaxcontact convert out/result.npz -o out.nc  # for xarray and MATLAB",
)
OF_PLAY = (
    "jaxcontact play                              # in the browser",
    "jaxcontact play --port 8800 --no-browser     # for ssh -L 8800:127.0.0.1:8800 from another machine",
)
OF_REPRODUCE = (
    "jaxcontact reproduce figure_4 -o paper       # one figure, and paper/report.html",
    "jaxcontact reproduce -o paper                # all figures, which takes minutes",
)


def main(arguments: list[str] | None = None) -> int:
    """Run a command and return its exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        with signals_interrupt():
            return _dispatch(arguments)
    except BrokenPipeError:  # whoever reads the output, such as head, has enough of it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for the flush at exit
        return 128 + signal.SIGPIPE if hasattr(signal, "SIGPIPE") else BAD_INPUT
    except (ValueError, OSError, ImportError, MemoryError) as error:
        return print_error(str(error), BAD_INPUT)
    except KeyboardInterrupt as interrupt:
        return print_error(f"interrupted by {signal_of(interrupt).name}", exit_status(interrupt))


def _dispatch(arguments: list[str]) -> int:
    named = next((word for word in arguments if word in COMMANDS), "")
    if arguments[:1] == ["fit"]:
        from fitting.cli import command  # takes a second to import, which other commands do not need

        _use_compiled_programs()
        return command.main(arguments[1:])
    options = _parser(named).parse_args(arguments)
    if named not in ("cases", "cite"):
        _use_compiled_programs()
    return options.command(options)


def _use_compiled_programs() -> None:
    from jaxcontact._compile.compilation_cache import enable_compilation_cache

    with contextlib.suppress(OSError):  # the cache folder cannot be written: compile without it
        enable_compilation_cache()


def _parser_with_fits() -> argparse.ArgumentParser:
    """Return the parser including the commands of the fits, which otherwise have a parser of their own."""
    from fitting.cli import command

    return _parser(add_fits=command.add_parser)


def _parser(
    named: str | None = None, add_fits: Callable[[Commands], None] = lambda kinds: None
) -> argparse.ArgumentParser:
    """Return the parser, in which only the command ``named`` has its options, or each if it is None.

    The options of a command may need jax, which takes most of a second to import: ``jaxcontact --help`` does not.
    """
    parser = Parser(
        prog="jaxcontact",
        description="Time-dependent contact with viscoelastic and layered bodies.",
        epilog=_examples(EXAMPLES),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"jaxcontact {__version__}")
    parser.add_argument(
        "--completion",
        choices=look.SHELLS,
        action=look.completing(_parser_with_fits),
        help='print the completion script of a shell, for: eval "$(jaxcontact --completion bash)"',
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for name, (what, examples, add_options) in COMMANDS.items():
        if name == "fit":
            add_fits(commands.add_parser(name, help=what).add_subparsers(metavar="KIND"))
            continue
        more: dict[str, Any] = {}
        if examples:
            more = {
                "epilog": _examples(examples),
                "formatter_class": argparse.RawDescriptionHelpFormatter,
            }
        command = commands.add_parser(name, help=what, description=f"{what[0].upper()}{what[1:]}.", **more)
        if named in (None, name):
            add_options(command)
    return parser


def _examples(lines: tuple[str, ...]) -> str:
    return "\n  ".join(["examples:", *lines])


def _add_run(command: argparse.ArgumentParser) -> None:
    from jaxcontact.shell.case_schema import ALL, FEW, LAST
    from jaxcontact.shell.run import run

    command.add_argument("case", type=look.case_path, metavar="CASE.toml", help=CASE_HELP)
    command.add_argument(
        "--show", action="store_true", help="print the case with all defaults and do not run it"
    )
    command.add_argument(
        "--save",
        choices=(ALL, FEW, LAST),
        help="times of the stored maps: all, nine, or the last; by default as in the case, or all up to 32 MB, else nine",
    )
    how = _add_output(command, required=False)
    how.add_argument(
        "--resume",
        action="store_true",
        help="continue the run that was stopped in DIR; a finished one is left as it is",
    )
    command.set_defaults(command=run)


def _add_new(command: argparse.ArgumentParser) -> None:
    from jaxcontact.shell.case_schema import KINDS

    kinds = tuple(KINDS)
    command.add_argument(
        "kind",
        nargs="?",
        choices=kinds,
        default=kinds[0],
        metavar="KIND",
        help=f"{', '.join(kinds)}; by default {kinds[0]}",
    )
    command.add_argument("file", type=Path, metavar="FILE.toml", help="the file to write")
    command.add_argument("--force", action="store_true", help="overwrite FILE")
    command.set_defaults(command=look.new)


def _add_check(command: argparse.ArgumentParser) -> None:
    command.add_argument("case", type=look.case_path, metavar="CASE.toml", help=CASE_HELP)
    command.set_defaults(command=look.check)


def _add_sweep(command: argparse.ArgumentParser) -> None:
    from jaxcontact.shell.sweep import run_study

    command.add_argument("study", type=look.case_path, metavar="STUDY.toml", help=STUDY_HELP)
    command.add_argument(
        "-o",
        dest="directory",
        type=Path,
        metavar="DIR",
        required=True,
        help="directory of the results, new or of the same study",
    )
    command.add_argument("--force", action="store_true", help="replace a table that has other cases")
    where = command.add_mutually_exclusive_group()
    where.add_argument(
        "--scheduler", metavar="ADDRESS", help="address of a Dask scheduler, such as tcp://host:8786"
    )
    where.add_argument(
        "--processes",
        type=int,
        metavar="N",
        help="number of processes on this machine; by default one per core",
    )
    command.set_defaults(command=run_study)


def _add_plot(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "-o",
        dest="picture",
        type=Path,
        metavar="FILE",
        help="figure to write, .png, .svg or .pdf; by default RESULT with .png",
    )
    _add_result(command)
    command.set_defaults(command=look.plot)


def _add_convert(command: argparse.ArgumentParser) -> None:
    kinds = "file to write: .pvd for ParaView, .nc (NetCDF) or .npz (numpy)"
    command.add_argument("-o", dest="file", type=Path, metavar="FILE", required=True, help=kinds)
    _add_result(command)
    command.set_defaults(command=look.convert)


def _add_result(command: argparse.ArgumentParser) -> None:
    command.add_argument("result", type=Path, metavar="RESULT", help="a result.npz, or a .nc file")
    command.add_argument("--force", action="store_true", help="overwrite FILE")


def _add_play(command: argparse.ArgumentParser) -> None:
    port = "port of the page; by default a free one"
    command.add_argument("--port", type=_port_number, default=0, metavar="N", help=port)
    browser = "print the address and open no browser"
    command.add_argument("--no-browser", dest="browser", action="store_false", help=browser)
    command.set_defaults(command=_play)


def _port_number(text: str) -> int:
    """Return a port from its text; 0 lets the system choose one."""
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"expected a whole number from 0 to 65535, got {text!r}")
    return int(text)


def _add_reproduce(command: argparse.ArgumentParser) -> None:
    from jaxcontact.paper import REPRODUCTIONS

    names = f"figures and tables to reproduce, by default all: {', '.join(REPRODUCTIONS)}"
    command.add_argument("names", nargs="*", metavar="NAME", help=names)
    _add_output(command, required=True)
    command.set_defaults(command=_reproduce)


def _add_output(parser: argparse.ArgumentParser, required: bool) -> "argparse._MutuallyExclusiveGroup":
    """Add the directory of the results, and return the group of options for a directory that is not empty."""
    parser.add_argument(
        "-o", dest="directory", type=Path, metavar="DIR", required=required, help="directory of the results"
    )
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--force", action="store_true", help="overwrite the contents of DIR")
    return how


def _reproduce(options: argparse.Namespace) -> int:
    """Compare with the paper, and return the exit status of the comparison."""
    from jaxcontact.paper import reproduce

    return reproduce.main(options.names, options.directory, force=options.force)


def _play(options: argparse.Namespace) -> int:
    """Serve the page with sliders until an interrupt."""
    # imported here, since it makes materials that other commands do not need
    from jaxcontact.shell.playground.server import play

    return play(options)


COMMANDS: dict[str, tuple[str, tuple[str, ...], Callable[[argparse.ArgumentParser], None]]] = {
    "run": ("run a case file", OF_RUN, _add_run),
    "new": ("write a template of a case file", OF_NEW, _add_new),
    "check": ("validate a case file without running it", OF_CHECK, _add_check),
    "cases": (
        "list the case files that come with the package",
        (),
        lambda command: command.set_defaults(command=look.cases),
    ),
    "sweep": ("run all cases of a study", OF_SWEEP, _add_sweep),
    "fit": ("identify material parameters from measured curves", (), lambda command: None),
    "plot": ("draw a saved result", OF_PLOT, _add_plot),
    "convert": ("write a saved result for another program", OF_CONVERT, _add_convert),
    "play": ("move sliders in a browser while the solver follows", OF_PLAY, _add_play),
    "reproduce": (
        "compare with the figures and tables of Wang et al. (2025)",
        OF_REPRODUCE,
        _add_reproduce,
    ),
    "cite": (
        "print the citations of this package and of Wang et al. (2025) in BibTeX",
        (),
        lambda command: command.set_defaults(command=look.cite),
    ),
}
"""Each command: its summary, the examples at the end of its help, and the function that adds its options."""


def enter() -> None:
    """Run ``main`` as the shell's entry point, and end the process."""
    gc.set_threshold(20_000, 10, 10)  # tracing creates many objects, hardly any of which are garbage
    if isinstance(sys.stdout, io.TextIOWrapper):  # escape letters of file names that the console cannot show
        sys.stdout.reconfigure(errors="backslashreplace")
    status = main()
    if status > 128:  # a computation of jax still in progress could crash the interpreter's normal exit
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


if __name__ == "__main__":
    enter()
