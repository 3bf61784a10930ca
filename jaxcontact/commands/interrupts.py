"""What ends a run from outside: Ctrl-C, and the signals of a batch system or a closed terminal, in one way."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from types import FrameType
from typing import TypeVar

T = TypeVar("T")

ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


class Stopped(KeyboardInterrupt):
    """A signal has asked for the end; handled wherever Ctrl-C is."""

    def __init__(self, signum: int) -> None:
        super().__init__()
        self.signum = signum


def signal_of(interrupt: KeyboardInterrupt) -> signal.Signals:
    """The signal behind an interrupt."""
    return signal.Signals(getattr(interrupt, "signum", signal.SIGINT))


def exit_status(interrupt: KeyboardInterrupt) -> int:
    """As a shell reports it: 128 + the signal; 130 after Ctrl-C."""
    return 128 + signal_of(interrupt)


@contextlib.contextmanager
def signals_interrupt() -> Iterator[None]:
    """Within, SIGTERM and SIGHUP raise ``Stopped``; one that is ignored (nohup) stays ignored."""
    here = threading.current_thread() is threading.main_thread()  # the only one that may set handlers
    before = {signum: signal.getsignal(signum) for signum in ENDING if here}
    taken = {signum: handler for signum, handler in before.items() if handler is not signal.SIG_IGN}
    for signum in taken:
        signal.signal(signum, _raise)
    try:
        yield
    finally:
        for signum, handler in taken.items():
            signal.signal(signum, handler)


def _raise(signum: int, frame: FrameType | None) -> None:
    raise Stopped(signum)


def interruptible(compute: Callable[[], T]) -> T:
    """What ``compute`` returns, from a thread of its own: a compiled program hears no signal, the one that waits does."""
    future: Future[T] = Future()

    def work() -> None:
        try:
            future.set_result(compute())
        except BaseException as error:
            future.set_exception(error)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(0.1)  # not for good: the system may hand the signal to any thread
    return future.result()
