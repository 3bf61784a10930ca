"""Recording of the warnings that a piece of code issues, safe for several threads at once."""

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

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
