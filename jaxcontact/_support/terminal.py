"""What a command shows on the terminal: progress, wrong usage, and the warnings of a run, which it collects."""

import argparse
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, NoReturn, Self, TextIO

from tqdm import tqdm


def working(what: str, file: TextIO | None = None) -> Any:
    """Show a line that describes the work in progress; a context manager."""
    return tqdm(desc=what, bar_format="{desc} ...", file=file, disable=None, leave=False)


class Progress:
    """A progress bar on stderr over ``total`` units, of which ``done`` were done before; a context manager.

    It is silent if the stream is not a terminal (``disable=None``). The first steps include compilation: until they are
    done the bar reads "compiling", and its rate and remaining time are measured from the steps after them.
    """

    def __init__(self, total: int, unit: str, done: int = 0, file: TextIO | None = None) -> None:
        self._options = {"total": total, "unit": unit, "file": file, "disable": None, "leave": False}
        self._done, self._bar = done, tqdm(desc="compiling", initial=done, **self._options)
        self._compiling = True

    def advance(self, count: int) -> None:
        """Report that ``count`` more units are done."""
        self._done += count
        if self._compiling:
            self._compiling = False
            self._bar.close()
            self._bar = tqdm(initial=self._done, **self._options)
        else:
            self._bar.update(count)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.close()


BAD_USAGE = 2


class Parser(argparse.ArgumentParser):
    """A parser that ends a wrong call with one line, without the list of all options."""

    def error(self, message: str) -> NoReturn:
        """Print the message and the command that explains the options, and exit with status 2."""
        self.exit(BAD_USAGE, f"{self.prog}: error: {message}; {self.prog} --help explains the options\n")


# Warnings that a piece of code issues are recorded, safe for several threads at once.

_lock = threading.Lock()
_own = threading.local()
_active = 0
_filters: warnings.catch_warnings | None = None


@contextmanager
def recorded_warnings() -> Iterator[list[Any]]:
    """Collect the messages of all warnings issued by this thread in a list, instead of showing them.

    ``warnings.catch_warnings(record=True)`` replaces the hook of the whole process, so that two threads that leave it in
    a different order than they entered it lose warnings permanently. Here one hook serves all threads. Every warning is
    recorded, including one shown before; a thread that records nothing shows its warnings as usual. The list holds the
    arguments of ``warnings.warn``: a ``Note`` of this package or text.
    """
    outer = getattr(_own, "messages", None)
    messages: list[Any] = []
    _own.messages = messages
    _enter()
    try:
        yield messages
    finally:
        _leave()
        _own.messages = outer


def _enter() -> None:
    global _active, _filters
    with _lock:
        if _active == 0:
            _filters = warnings.catch_warnings()
            _filters.__enter__()
            warnings.simplefilter("always")
            show = warnings.showwarning
            warnings.showwarning = lambda *args, **kwargs: _record(show, *args, **kwargs)
        _active += 1


def _leave() -> None:
    global _active, _filters
    with _lock:
        _active -= 1
        if _active == 0 and _filters is not None:
            _filters.__exit__(None, None, None)
            _filters = None


def _record(show: Any, message: Any, *args: Any, **kwargs: Any) -> None:
    messages = getattr(_own, "messages", None)
    if messages is None:
        show(message, *args, **kwargs)
    else:
        messages.append(message.args[0] if len(message.args) == 1 else str(message))
