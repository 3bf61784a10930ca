"""Release of compiled programs before a process reaches Linux's limit of memory maps.

XLA keeps a few memory maps for each kernel of a program that it compiled for a CPU, some 440 for the first contact on a
new grid, for as long as jax keeps the program. Linux allows a process 65,530 of them (``vm.max_map_count``); beyond, an
allocation fails wherever it is made, and the process ends in a segmentation fault. The maps are therefore counted after
compilations, of whatever part of the process, and jax's caches are cleared before half of the limit is reached. Programs
that are still needed are compiled again, or read from the cache on disk, when they are next called: results do not change.
"""

import functools
import os
import threading
import time
from pathlib import Path
from typing import Any

import jax

COMPILED = "/jax/core/compile/backend_compile_duration"
"""jax's event after each compilation, programs read from the cache on disk included."""

SHARE = 0.5  # of the limit, at which programs are released
COUNTING = 0.05  # largest share of the time of compilation that is spent on counting maps


class MapWatch:
    """A listener of jax's events that counts the maps of the process and clears jax's caches in time.

    limit: the largest number of maps that the system allows; maps: a file with one line for each map of this process.
    """

    def __init__(self, limit: int, maps: Path):
        self.limit, self.maps = limit, maps
        self.allowed = SHARE * limit  # number of maps at which programs are released
        self.compiling = self.counting = 0.0  # seconds since the last count, and of the last count
        self.releases = 0
        self._busy = threading.Lock()

    def __call__(self, event: str, duration: float, **_: Any) -> None:
        """Count the maps after a compilation that took ``duration`` [s], unless that was done a moment ago.

        A program has maps in proportion to the time of its compilation, about one in 4 ms, or one in 0.2 ms where it is
        read from the disk; between two counts, at most 20 times their duration apart, a process gains a few thousand.
        """
        # another thread counts at this moment
        if event != COMPILED or not self._busy.acquire(blocking=False):
            return
        try:
            self.compiling += duration
            if self.compiling * COUNTING < self.counting:
                return
            start = time.perf_counter()
            found = self._count()
            self.compiling, self.counting = 0.0, time.perf_counter() - start
            if found < self.allowed:
                return
            # Programs that run or are being traced, in this or another thread, are held by their callers, so jax's caches
            # can be cleared at any time. Maps that remain are of other kinds: a quarter of what is then left to the limit
            # is allowed before the next release, since otherwise every compilation would clear the caches.
            jax.clear_caches()
            self.releases += 1
            left = self._count()
            self.allowed = max(SHARE * self.limit, left + 0.25 * (self.limit - left))
        finally:
            self._busy.release()

    def _count(self) -> int:
        """Return the number of maps of this process, 0 where they cannot be read."""
        try:
            return self.maps.read_bytes().count(b"\n")
        except OSError:
            return 0


@functools.cache
def watch() -> MapWatch | None:
    """Release programs in time in this process; None on systems without a list of maps, which have no such limit."""
    maps = Path("/proc/self/maps")
    try:
        limit = int(Path("/proc/sys/vm/max_map_count").read_text())
    except (OSError, ValueError):
        return None
    if not os.access(maps, os.R_OK):
        return None
    found = MapWatch(limit, maps)
    jax.monitoring.register_event_duration_secs_listener(found)
    return found
