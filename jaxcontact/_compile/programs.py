"""Compiled programs: functions with options of the compiler that make a first call fast."""

import functools
import os
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxcontact._support.pytree import is_concrete

FAST_COMPILE = {"xla_cpu_use_fusion_emitters": False, "xla_backend_optimization_level": 2}
"""Compiler options with which programs compile in half to three quarters of the time and run equally fast."""

UNOPTIMISED = FAST_COMPILE | {"xla_backend_optimization_level": 0}
"""Compiler options with which programs compile in less than half the time; a run takes two to three times as long."""


BRIEF = 1.6e6
"""Work, in cell steps, up to which a program is not optimised: its runs then lose a third of the time that its compilation
saves. A film of 128 x 128 cells at 31 times has three such calls."""


class Program:
    """A compiled function of pytrees of arrays and static keywords.

    It has the compiler options of ``FAST_COMPILE``, or of ``UNOPTIMISED`` if it is not ``optimised``. Within jax's
    transformations, where jax accepts no options for a part of a program, it is ``jax.jit`` of the function, ``compiled``.

    work: the work of a call in cell steps, a function of its arguments that reads shapes alone. A program that knows it is
    not optimised while the work of all calls with arguments of the same shapes is within ``BRIEF``, and is compiled again
    with the call that exceeds it. However many calls follow, all of them together then take less than twice the time of the
    better choice. Results agree to rounding.
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

    def __call__(self, *args: Any, **static: Any) -> Any:
        if not is_concrete(args, jnp.zeros(())):  # within a trace
            return self.compiled(*args, **static)
        chosen = self._compiled_fast if self.optimised else self._unoptimised
        if self.work is not None and unoptimised_options() != fast_compile_options():
            leaves, structure = jax.tree.flatten(args)
            each = tuple((np.shape(leaf), getattr(leaf, "dtype", type(leaf))) for leaf in leaves)
            shapes = structure, each, tuple(sorted(static.items()))
            done = self._done[shapes] = self._done.get(shapes, 0.0) + self.work(*args, **static)
            chosen = self._compiled_fast if done > BRIEF else self._unoptimised
        return chosen(*args, **static)

    @functools.cached_property
    def _compiled_fast(self) -> Callable[..., Any]:
        return self._with(fast_compile_options())

    @functools.cached_property
    def _unoptimised(self) -> Callable[..., Any]:
        return self._with(unoptimised_options())

    def _with(self, options: dict[str, Any]) -> Callable[..., Any]:
        return jax.jit(self.function, static_argnames=self.static_argnames, compiler_options=options)


@functools.cache
def fast_compile_options() -> dict[str, Any]:
    """Return ``FAST_COMPILE`` as far as it applies."""
    return _applicable(FAST_COMPILE)


@functools.cache
def unoptimised_options() -> dict[str, Any]:
    """Return ``UNOPTIMISED`` as far as it applies."""
    return _applicable(UNOPTIMISED)


def _applicable(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options that ``XLA_FLAGS`` does not set; none for other devices, or a compiler that does not know them."""
    chosen = os.environ.get("XLA_FLAGS", "")
    options = {name: value for name, value in options.items() if f"--{name}=" not in chosen}
    if jax.default_backend() != "cpu":
        return {}
    try:
        jax.jit(lambda: 0, compiler_options=options)()
    except jax.errors.JaxRuntimeError:
        return {}
    return options
