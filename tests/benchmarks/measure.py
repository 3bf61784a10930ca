"""One problem in a process of its own: its cost in convolutions, its memory, and what was compiled for it.

    python -m tests.benchmarks.measure PROBLEM N STEPS

Prints one line of JSON. The unit is one convolution: pruned, real, N x N zero-padded to 2N x 2N, timed in this process.
Two figures for the cost: ``ratio``, the time of a step over that of the unit, with everything in it; and ``counted``,
transforms of fields as they run, half a convolution each, those of a window by its part of the cells. The second does not
depend on what else the machine does.
"""

import json
import os
import resource
import sys
import time
from collections.abc import Callable
from typing import Any

os.environ.pop("JAX_COMPILATION_CACHE_DIR", None)  # what is compiled is counted

import jax
import jax.numpy as jnp
import numpy as np

from jaxcontact.operators import spectral
from tests.benchmarks.problems import COUNTED, PROBLEMS

UNITS, RUNS = 50, 3
COMPILED = "/jax/core/compile/backend_compile_duration"


def median_time(call: Callable[[], Any], repeats: int) -> float:
    """Median wall time [s] of a call that has been compiled."""
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        jax.block_until_ready(call())
        seconds.append(time.perf_counter() - began)
    return float(np.median(seconds))


def unit(n: int) -> float:
    """The time [s] of one convolution."""
    field = jnp.ones((n, n))
    spectrum, convolve = spectral.kernel_spectrum(field), jax.jit(spectral.convolve)
    jax.block_until_ready(convolve(spectrum, field))
    return median_time(lambda: convolve(spectrum, field), UNITS)


class Programs:
    """How many programs jax has compiled, and for how long [s]."""

    def __init__(self) -> None:
        self.count, self.seconds = 0, 0.0
        jax.monitoring.register_event_duration_secs_listener(self._heard)

    def _heard(self, event: str, seconds: float, **_: Any) -> None:
        if event == COMPILED:
            self.count, self.seconds = self.count + 1, self.seconds + seconds


def counted(run: Callable[[], Any], n: int) -> dict[str, float]:
    """Transforms that a run makes, in convolutions of the whole grid; and applications of the preconditioner."""
    found = {"convolutions": 0.0, "preconditioned": 0.0}

    def counting(function: Callable, name: str, cells: Callable[..., float]) -> Callable:
        def noted(*arguments: Any) -> Any:
            amount = cells(*arguments)
            jax.debug.callback(lambda: found.update({name: found[name] + amount}))
            return function(*arguments)

        return noted

    forward = lambda field, *_: 0.5 * np.prod(field.shape) / n**2
    back = lambda spectrum, shape, *_: 0.5 * np.prod((*spectrum.shape[:-2], *shape)) / n**2
    once = lambda spectrum, field, *_: np.prod(field.shape) / n**2
    kept = spectral.transform, spectral.inverse, spectral.apply_circulant
    spectral.transform = counting(kept[0], "convolutions", forward)
    spectral.inverse = counting(kept[1], "convolutions", back)
    spectral.apply_circulant = counting(kept[2], "preconditioned", once)
    jax.clear_caches()
    jax.block_until_ready(run())  # compiles, and evaluates what is constant
    jax.effects_barrier()
    found.update(dict.fromkeys(found, 0.0))
    jax.block_until_ready(run())
    jax.effects_barrier()
    return found


def measure(name: str, n: int, steps: int) -> dict[str, Any]:
    """Everything that is known of one problem."""
    programs, convolution = Programs(), unit(n)
    before, spent = programs.count, programs.seconds
    problem = PROBLEMS[name](n, steps)
    began = time.perf_counter()
    jax.block_until_ready(problem.run())
    first = time.perf_counter() - began
    compiled, compiling = programs.count - before, programs.seconds - spent
    seconds = median_time(problem.run, RUNS)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    found = {
        "problem": name, "n": n, "steps": problem.steps, "convolution_ms": 1e3 * convolution,
        "ratio": seconds / problem.steps / convolution, "seconds": seconds, "first_call_s": first,
        "programs": compiled, "compiling_s": compiling, "memory_MB": memory,
    }  # fmt: skip
    if name in COUNTED:
        found |= {key: value / problem.steps for key, value in counted(problem.run, n).items()}
    return found


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))))
