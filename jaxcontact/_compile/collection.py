"""Python's search for unreachable objects, paused while jax records and compiles a program."""

import contextlib
import gc
from collections.abc import Iterator


@contextlib.contextmanager
def paused_collection() -> Iterator[None]:
    """Pause the search for objects that are unreachable but refer to each other.

    What jax records stays reachable, some 500,000 objects for the gradient of a shear, and each search goes through all of
    them: a tenth of the time of a first result. Where the search is switched off it stays so.
    """
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
