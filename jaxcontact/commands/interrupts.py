"""What ends a run from outside: Ctrl-C, and the signals of a batch system or a closed terminal, in one way."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType

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
