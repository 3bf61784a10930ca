"""The option ``jaxcontact --completion SHELL``: scripts for tab completion of commands, options and files."""

import argparse
from collections.abc import Callable, Iterator
from typing import Any

from jaxcontact.results.labels import extra

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
