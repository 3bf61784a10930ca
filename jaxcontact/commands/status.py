"""Exit statuses, and the one line on stderr that goes with those that are not 0."""

import os
import sys
from typing import TextIO

FINE, BAD_INPUT, NOT_CONVERGED = 0, 2, 3  # and 128 + the signal: see ``interrupts``


def complain(message: str, status: int) -> int:
    """One line on stderr, whatever the message; the status, to return."""
    tell(f"jaxcontact: error: {' '.join(message.split())}", sys.stderr)
    return status


def tell(text: str, stream: TextIO) -> None:
    """Print, unless nobody listens any more: after a hangup the terminal is gone, and the status still counts."""
    try:
        print(text, file=stream, flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())  # or the flush at exit fails as well
