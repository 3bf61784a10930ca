"""Exit statuses, and the one line on stderr that goes with those that are not 0."""

import sys

FINE, BAD_INPUT, NOT_CONVERGED, INTERRUPTED = 0, 2, 3, 130


def complain(message: str, status: int) -> int:
    """One line on stderr, whatever the message; the status, to return."""
    print(f"jaxcontact: error: {' '.join(message.split())}", file=sys.stderr)
    return status
