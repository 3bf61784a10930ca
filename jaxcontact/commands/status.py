"""Exit statuses, and the one line on stderr that goes with those that are not 0."""

import os
import re
import sys
from typing import TextIO

FINE, BAD_INPUT, NOT_CONVERGED = 0, 2, 3  # and 128 + the signal: see ``interrupts``

COLOURS = {"error": 31, "warning": 33, "can run": 32}  # red, yellow, green, as terminals number them


def complain(message: str, status: int) -> int:
    """One line on stderr, whatever the message; the status, to return."""
    tell(f"jaxcontact: error: {' '.join(message.split())}", sys.stderr)
    return status


def tell(text: str, stream: TextIO) -> None:
    """Print, unless nobody listens any more: after a hangup the terminal is gone, and the status still counts."""
    try:
        print(_coloured(text, stream), file=stream, flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())  # or the flush at exit fails as well


def _coloured(text: str, stream: TextIO) -> str:
    """The verdict in colour on a terminal, unless its user says NO_COLOR (https://no-color.org)."""
    if not stream.isatty() or os.environ.get("NO_COLOR"):
        return text
    verdict = rf"(?<=: )({'|'.join(COLOURS)})(?=[:,])"
    return re.sub(verdict, lambda found: f"\x1b[{COLOURS[found[0]]}m{found[0]}\x1b[0m", text, count=1)
