"""Compiled programs: functions with options of the compiler that make a first call fast, and their release in time."""

import contextlib
import contextvars
import functools
import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxcontact._compile.collection import paused_collection
from jaxcontact._compile.transformed import (
    differentiable,
    encloses_tracers,
    is_real,
    is_recorded,
    members,
)
from jaxcontact._support.pytree import is_concrete

FAST_COMPILE = {
    "xla_cpu_use_fusion_emitters": False,
    "xla_backend_optimization_level": 2,
    "xla_cpu_parallel_codegen_split_count": 1,
    "xla_disable_hlo_passes": "rematerialization,tree_reduction_rewriter",  # jax disables the first; sums take as long
}
"""Compiler options with which programs compile in half to three quarters of the time and run equally fast."""

UNOPTIMISED = FAST_COMPILE | {"xla_backend_optimization_level": 0}
"""Compiler options with which programs compile in less than half the time; a run takes two to three times as long."""


BRIEF = 1.6e6
"""Work, in cell steps, up to which a program is not optimised: its runs then lose a third of the time that its compilation
saves. A film of 128 x 128 cells at 31 times has three such calls."""

DERIVATIVE = 0.25
"""Share of the work of a program that counts for its derivatives: not to optimise them saves 13 s for a film, against 3 s
for the program itself, and a gradient then takes three times as long."""

_AT_ONCE = contextvars.ContextVar("optimised_at_once", default=False)


@contextlib.contextmanager
def optimised_at_once() -> Iterator[None]:
    """Optimise programs from their first call on: no rounding then depends on what the process did before."""
    token = _AT_ONCE.set(True)
    try:
        yield
    finally:
        _AT_ONCE.reset(token)


class Program:
    """A compiled function of pytrees of arrays and static keywords.

    It has the compiler options of ``FAST_COMPILE``, or of ``UNOPTIMISED`` if it is not ``optimised``, and so have its
    derivatives and batches outside jit (``transformed``). As a part of what jax records, for which it accepts no options, it
    is ``jax.jit`` of the function, ``compiled``.

    work: the work of a call in cell steps, a function of its arguments that reads shapes alone; for a batch it is that of
    one member, and the members are counted. A program that knows it is not optimised while the work of all calls with
    arguments of the same shapes is within ``BRIEF``, and is compiled again with the call that exceeds it. However many calls
    follow, all of them together then take less than twice the time of the better choice. Results agree to rounding. Within
    ``optimised_at_once`` each is optimised.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        static_argnames: tuple[str, ...] = (),
        optimised: bool = True,
        work: Callable[..., float] | None = None,
    ):
        functools.update_wrapper(self, function)
        self.function, self.static_argnames, self.optimised = function, static_argnames, optimised
        self.compiled = jax.jit(function, static_argnames=static_argnames)
        self.work, self._done = work, dict[Any, float]()
        self._with_options = dict[bool, Callable[..., Any]]()  # whether optimised: the function compiled so
        self._compiled = set[tuple[bool, Any]]()  # whether optimised, and the shapes of the arguments
        self._differentiable = dict[Any, Callable[..., Any]]()  # by the shapes of the arguments

    def __call__(self, *args: Any, **static: Any) -> Any:
        if not is_concrete(jax.device_put(0.0)):  # jax records the call
            return self.compiled(*args, **static)
        if is_concrete(args):
            return self._called(*args, **static)
        key, leaves = self._shapes(args, static)
        if is_recorded(leaves):
            return self.compiled(*args, **static)
        structure = key[0]
        if key not in self._differentiable:
            # Only jit takes arrays of a transformation that are no arguments. Each result has a cotangent then, by the
            # barrier: without those of some, jax 0.10.1 gives a scan in such a function cotangents of other shapes.
            if encloses_tracers(structure):
                return jax.tree.map(_with_tangent, self.compiled(*args, **static))
            given = lambda leaves: jax.tree.unflatten(structure, leaves)
            self._differentiable[key] = differentiable(
                lambda leaves: self.function(*given(leaves), **static),
                lambda leaves: self._called(*given(leaves), **static),
                self._derived(args, static),
            )
        return self._differentiable[key](leaves)

    def _shapes(self, args: Any, static: dict[str, Any]) -> tuple[Any, list[Any]]:
        """Return what tells the calls of one compiled function from those of others, and the arrays of the arguments."""
        leaves, structure = jax.tree.flatten(args)
        each = tuple((np.shape(leaf), getattr(leaf, "dtype", type(leaf))) for leaf in leaves)
        return (structure, each, tuple(sorted(static.items()))), leaves

    def _called(self, *args: Any, **static: Any) -> Any:
        """The result of the program with options."""
        optimised = self.optimised
        shapes, leaves = self._shapes(args, static)
        if self.work is not None and not _AT_ONCE.get() and compiler_options(False) != compiler_options():
            work = members(leaves) * self.work(*args, **static)
            done = self._done[shapes] = self._done.get(shapes, 0.0) + work
            optimised = done > BRIEF
        if optimised not in self._with_options:
            options = compiler_options(optimised)
            self._with_options[optimised] = jax.jit(
                self.function, static_argnames=self.static_argnames, compiler_options=options
            )
        call = self._with_options[optimised]
        if (optimised, shapes) in self._compiled:
            return call(*args, **static)
        with paused_collection():
            found = call(*args, **static)
        self._compiled.add((optimised, shapes))
        return found

    def _derived(self, args: Any, static: dict[str, Any]) -> Callable[[Callable[..., Any], int], "Program"]:
        """Return what makes a program of a function of a derivative of this one, of so many members in one call."""
        work = None if self.work is None else DERIVATIVE * self.work(*args, **static)

        def derived(function: Callable[..., Any], members: int) -> Program:
            if work is None:
                return Program(function, optimised=self.optimised)
            return Program(function, work=lambda *_: members * work)

        return derived


def _with_tangent(array: Any) -> Any:
    """Return a real array with a tangent and a cotangent that are arrays, also where they are zero; others unchanged."""
    return jax.lax.optimization_barrier(array) if is_real(array) else array


@functools.cache
def compiler_options(optimised: bool = True) -> dict[str, Any]:
    """Return ``FAST_COMPILE`` or ``UNOPTIMISED`` without what ``XLA_FLAGS`` sets; nothing for other devices, or for a
    compiler that does not know them."""
    chosen, wanted = os.environ.get("XLA_FLAGS", ""), FAST_COMPILE if optimised else UNOPTIMISED
    known = _known_options()
    return {name: value for name, value in wanted.items() if known and f"--{name}=" not in chosen}


@functools.cache
def _known_options() -> bool:
    """Return whether the compiler is that of a CPU and knows the names of the options."""
    if jax.default_backend() != "cpu":
        return False
    try:
        jax.jit(lambda: 0, compiler_options=FAST_COMPILE)()
    except jax.errors.JaxRuntimeError:
        return False
    return True


# Release of compiled programs before a process reaches Linux's limit of memory maps.
#
# XLA keeps a few memory maps for each kernel of a program that it compiled for a CPU, some 440 for the first contact on a
# new grid, for as long as jax keeps the program. Linux allows a process 65,530 of them (``vm.max_map_count``); beyond, an
# allocation fails wherever it is made, and the process ends in a segmentation fault. The maps are therefore counted after
# compilations, of whatever part of the process, and jax's caches are cleared before half of the limit is reached. Programs
# that are still needed are compiled again, or read from the cache on disk, when they are next called: results do not change.

COMPILATION = "/jax/core/compile/backend_compile_duration"
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
        if event != COMPILATION or not self._busy.acquire(blocking=False):
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
def watch_memory_maps() -> MapWatch | None:
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


watch_memory_maps()
