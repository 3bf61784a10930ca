"""The terminal of a command: the lines it prints for progress, errors and wrong usage, the signals that end it, and the
warnings of a run, collected in a list."""

import argparse
import functools
import os
import re
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, NoReturn, Self, TextIO, TypeVar

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


# Exit statuses, and the line on stderr that accompanies those other than 0.


FINE, BAD_INPUT, NOT_CONVERGED = 0, 2, 3  # 128 + the signal after an interrupt: see ``interruptible``

COLOURS = {"error": 31, "warning": 33, "can run": 32}  # red, yellow, green: ANSI codes


def print_error(message: str, status: int) -> int:
    """Print an error in one line on stderr, and return the status."""
    tell(f"jaxcontact: error: {' '.join(message.split())}", sys.stderr)
    return status


def tell(text: str, stream: TextIO) -> None:
    """Print a text, ignoring a closed terminal (after a hangup), so that the exit status is still returned."""
    try:
        if stream.isatty() and not os.environ.get("NO_COLOR"):  # the verdict in colour (https://no-color.org)
            verdict = rf"(?<=: )({'|'.join(COLOURS)})(?=[:,])"
            text = re.sub(verdict, lambda found: f"\x1b[{COLOURS[found[0]]}m{found[0]}\x1b[0m", text, count=1)
        print(text, file=stream, flush=True)
    except OSError:
        # otherwise the flush at exit fails as well
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


# Interruption of a run: Ctrl-C and the signals of a batch system or a closed terminal, handled alike.


T = TypeVar("T")

ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


class Stopped(KeyboardInterrupt):
    """A request to stop by a signal, handled wherever Ctrl-C is."""

    def __init__(self, signum: int) -> None:
        super().__init__()
        self.signum = signum


def signal_of(interrupt: KeyboardInterrupt) -> signal.Signals:
    """Return the signal that caused an interrupt."""
    return signal.Signals(getattr(interrupt, "signum", signal.SIGINT))


def exit_status(interrupt: KeyboardInterrupt) -> int:
    """Return the exit status as a shell reports it: 128 + the signal; 130 after Ctrl-C."""
    return 128 + signal_of(interrupt)


@contextmanager
def signals_interrupt() -> Iterator[None]:
    """Raise ``Stopped`` on SIGTERM and SIGHUP within this context; a signal that is ignored (nohup) stays ignored."""
    in_main = threading.current_thread() is threading.main_thread()  # only the main thread may set handlers
    before = {signum: signal.getsignal(signum) for signum in ENDING if in_main}
    replaced = {signum: handler for signum, handler in before.items() if handler is not signal.SIG_IGN}
    for signum in replaced:
        signal.signal(signum, _raise)
    try:
        yield
    finally:
        for signum, handler in replaced.items():
            signal.signal(signum, handler)


def _raise(signum: int, frame: FrameType | None) -> None:
    raise Stopped(signum)


def interruptible(compute: Callable[[], T]) -> T:
    """Return ``compute()``, run in a separate thread, so that signals are handled while a compiled program runs."""
    future: Future[T] = Future()

    def work() -> None:
        try:
            future.set_result(compute())
        except BaseException as error:
            future.set_exception(error)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(0.1)  # with a timeout, since the system may deliver the signal to any thread
    return future.result()


class Parser(argparse.ArgumentParser):
    """A parser that ends a wrong call with one line, without the list of all options."""

    def error(self, message: str) -> NoReturn:
        """Print the message and the command that explains the options, and exit with status 2."""
        self.exit(BAD_INPUT, f"{self.prog}: error: {message}; {self.prog} --help explains the options\n")


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
    global _active, _filters

    def record(show: Any, message: Any, *args: Any, **kwargs: Any) -> None:
        listening = getattr(_own, "messages", None)  # of the thread that warns
        if listening is None:
            show(message, *args, **kwargs)
        else:
            listening.append(message.args[0] if len(message.args) == 1 else str(message))

    outer = getattr(_own, "messages", None)
    messages: list[Any] = []
    _own.messages = messages
    with _lock:
        if _active == 0:
            _filters = warnings.catch_warnings()
            _filters.__enter__()
            warnings.simplefilter("always")
            warnings.showwarning = functools.partial(record, warnings.showwarning)
        _active += 1
    try:
        yield messages
    finally:
        with _lock:
            _active -= 1
            if _active == 0 and _filters is not None:
                _filters.__exit__(None, None, None)
                _filters = None
        _own.messages = outer
