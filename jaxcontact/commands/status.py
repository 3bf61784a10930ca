"""Exit statuses, and the line on stderr that accompanies those other than 0."""

import os
import re
import sys
from typing import TextIO

FINE, BAD_INPUT, NOT_CONVERGED = 0, 2, 3  # 128 + the signal after an interrupt: see ``interrupts``

COLOURS = {"error": 31, "warning": 33, "can run": 32}  # red, yellow, green: ANSI codes


def print_error(message: str, status: int) -> int:
    """Print an error in one line on stderr, and return the status."""
    tell(f"jaxcontact: error: {' '.join(message.split())}", sys.stderr)
    return status


def tell(text: str, stream: TextIO) -> None:
    """Print a text, ignoring a closed terminal (after a hangup), so that the exit status is still returned."""
    try:
        print(_coloured(text, stream), file=stream, flush=True)
    except OSError:
        os.dup2(
            os.open(os.devnull, os.O_WRONLY), stream.fileno()
        )  # otherwise the flush at exit fails as well


def _coloured(text: str, stream: TextIO) -> str:
    """Return the text with its verdict in colour on a terminal, unless NO_COLOR is set (https://no-color.org)."""
    if not stream.isatty() or os.environ.get("NO_COLOR"):
        return text
    verdict = rf"(?<=: )({'|'.join(COLOURS)})(?=[:,])"
    return re.sub(verdict, lambda found: f"\x1b[{COLOURS[found[0]]}m{found[0]}\x1b[0m", text, count=1)
