"""The entry point of the command line, which shows the page of ``jaxcontact play`` before it imports jax."""

import os
import sys


def enter() -> None:
    """Run the command line; ``jaxcontact play`` opens its page first."""
    if sys.argv[1:2] == ["play"]:
        # Before scipy is loaded, whose BLAS solves the small systems of a run: its threads wait for one another in a busy
        # loop, which takes up to a second of processor time per move where other programs use the processor as well.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        from jaxcontact_play.opening import open_early

        open_early(sys.argv[2:])
    from jaxcontact.__main__ import enter as run_command

    run_command()


if __name__ == "__main__":
    enter()
