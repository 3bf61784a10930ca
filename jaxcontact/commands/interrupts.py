"""Interruption of a run: Ctrl-C and the signals of a batch system or a closed terminal, handled alike."""

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


@contextlib.contextmanager
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
