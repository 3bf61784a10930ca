"""The commands that run no simulation: ``cases``, ``new``, ``check``, ``plot``, ``convert`` and ``cite``.

Each imports what it needs, since ``cases`` and ``cite`` need no jax, which takes most of a second to import.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from jaxcontact._support import version
from jaxcontact._support.files import read_npz, write_whole
from jaxcontact._support.terminal import BAD_INPUT, FINE, print_error, tell

CASES = Path(__file__).parents[1] / "cases"


def case_path(text: str) -> Path:
    """Return the path of a case file, given by its path or, if it comes with the package, by name: ``tribofilm_creep``."""
    named = () if Path(text).exists() else CASES.rglob("*.toml")
    packaged = [path for path in named if path.stem == text]
    return packaged[0] if packaged else Path(text)


def cases(options: argparse.Namespace) -> int:
    """List the ready-made cases (for ``run``) and studies (for ``sweep``) with name, title and file."""
    for path in [*sorted(CASES.glob("*.toml")), *sorted((CASES / "studies").glob("*.toml"))]:
        title = path.read_text(encoding="utf-8").splitlines()[0].lstrip("# ")
        print(f"{path.stem}: {title}\n    {path}")
    return FINE


def new(options: argparse.Namespace) -> int:
    """Write a case file from a template."""
    from jaxcontact.shell.case_file import template

    if options.file.exists() and not options.force:
        raise ValueError(f"{options.file}: already exists; choose another name, or --force to overwrite it")
    text = template(options.kind, CASES, str(options.file))
    write_whole(options.file, lambda path: path.write_text(text, encoding="utf-8"))
    print(f"{options.file}: change it, then: jaxcontact check {options.file}")
    return FINE


def check(options: argparse.Namespace) -> int:
    """Validate a case without running it; warnings about its result go to stderr and are not errors."""
    from jaxcontact.shell import advice
    from jaxcontact.shell.case_file import CaseError, case_of, mistakes_in_tables, read_tables

    tables = read_tables(options.case)
    try:
        case = case_of(tables, options.case)
    except CaseError as error:  # and all others that the file has, in one go
        others = (f"{options.case}: {mistake}" for mistake in mistakes_in_tables(tables))
        for mistake in dict.fromkeys([str(error), *others]):
            print_error(mistake, BAD_INPUT)
        return BAD_INPUT
    advice.check_completely(case, options.case)
    notes = advice.advice(case)
    for note in notes:
        tell(f"jaxcontact: warning: {options.case}: {note}", sys.stderr)
    verdict = "can run" if not notes else f"can run, with {len(notes)} warning{'s' * (len(notes) > 1)}"
    tell(f"{options.case}: {verdict}: {advice.describe(case)}", sys.stdout)
    for words in filter(None, (advice.describe_strain(case), advice.describe_adhesion(case))):
        tell(f"{options.case}: {words}", sys.stdout)
    return FINE


def plot(options: argparse.Namespace) -> int:
    """Write a picture of a saved result."""
    from jaxcontact.results import storage

    picture = options.picture or options.result.with_suffix(".png")
    accepted = sorted("." + kind for kind in ("png", "svg", "pdf"))
    if picture.suffix not in accepted:
        raise ValueError(f"{picture}: found {picture.suffix or 'no ending'}, accepted: {', '.join(accepted)}")
    _check_new(picture, options.force)
    from jaxcontact.shell.finished_steps import write_picture

    write_picture(picture, storage.read_result(options.result).plot())
    print(picture)
    _report_few(options.result)
    return FINE


def convert(options: argparse.Namespace) -> int:
    """Write a saved result in another file format."""
    from jaxcontact.results import storage

    _check_new(options.file, options.force)
    print(storage.write_result(storage.read_result(options.result), options.file))
    _report_few(options.result)
    return FINE


def _report_few(result: Path) -> None:
    """Report the number of times with maps, if a run kept a few, on stderr, since stdout names the file."""
    from jaxcontact.shell.case_schema import COURSE

    course = result.with_name(COURSE)
    if result.name == "result.npz" and course.exists():
        few, every = (read_npz(path, "times")["times"].size for path in (result, course))
        tell(
            f"{result}: {few} of {every} times, those with maps; {course} has the scalars of all", sys.stderr
        )


def _check_new(path: Path, force: bool) -> None:
    if not path.parent.is_dir():
        raise ValueError(
            f"{path}: found no folder {path.parent}, accepted: a file name in an existing folder"
        )
    from jaxcontact.results.storage import pieces_folder

    if path.suffix == ".pvd":  # it names files in a folder beside it
        pieces = sorted(pieces_folder(path).glob(f"{path.stem}_*.vtr"))
        path = pieces[0] if pieces and not path.exists() else path
    if path.exists() and not force:
        raise ValueError(f"{path}: already exists; choose another name with -o, or --force to overwrite it")


def cite(options: argparse.Namespace) -> int:
    """Print how to cite the package and its paper."""
    print(version.cite())
    return FINE


# The option ``jaxcontact --completion SHELL``: scripts for tab completion of commands, options and files.


SHELLS = ("bash", "zsh", "fish")
OF_PATHS = ("FILE", "RESULT", "CASE", "STUDY", "DIR")  # prefixes of the metavariables of paths


def completing(make: Callable[[], argparse.ArgumentParser]) -> type[argparse.Action]:
    """Return an action that prints the completion script for a shell, for the parser that ``make`` returns, and exits."""

    class Completion(argparse.Action):
        def __call__(
            self, parser: argparse.ArgumentParser, namespace: Any, shell: Any, flag: Any = None
        ) -> None:
            print(completion(make(), shell))
            parser.exit()

    return Completion


def completion(parser: argparse.ArgumentParser, shell: str) -> str:
    """Return a completion script for the shell."""
    from jaxcontact._support.fields import extra

    shtab = extra("shtab", "completion")
    for action in _actions(parser):
        name = str(action.metavar or "")
        if name.startswith(OF_PATHS):
            action.complete = shtab.DIRECTORY if name == "DIR" else shtab.FILE  # type: ignore[attr-defined]
    script: str = shtab.complete(parser, shell)
    return script


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield the actions of a parser and of its commands."""
    for action in parser._actions:  # argparse has no public way to list them
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
