"""Reverse mode over 2000 steps at 256 x 256, save="last": seconds, and memory as planned and as measured.

    python tests/benchmarks/bench_long_gradient.py [N] [STEPS] [CHECKPOINT]

The gradient of the last peak pressure with respect to every leaf of body, indenter and control, for the case
of bench_gradients. CHECKPOINT: "pressures" or "blocks", see ``jaxcontact.indent``. Run it as a process of its own.
"""

import resource
import sys
import time
import warnings

import jax
import jax.numpy as jnp
from bench_gradients import CASE

import jaxcontact as jc


def main(n: int, steps: int, checkpoint: str) -> None:
    warnings.simplefilter("ignore")
    times, grid = jnp.linspace(0.0, 7200.0, steps + 1), jc.Grid.square(n, 600e-6)

    def peak(case):
        run = jc.indent(*case, times, grid=grid, save="last", checkpoint=checkpoint)
        return jnp.max(run.pressure) / 1e9

    case = jax.tree.map(lambda a: jnp.asarray(a, float), CASE)
    began = time.perf_counter()
    compiled = jax.jit(jax.grad(peak)).lower(case).compile()
    compiling = time.perf_counter() - began
    began = time.perf_counter()
    jax.block_until_ready(compiled(case))
    running = time.perf_counter() - began
    plan = compiled.memory_analysis().temp_size_in_bytes
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    print(
        f'{steps} steps at {n} x {n}, "{checkpoint}": {running:.0f} s, compilation {compiling:.0f} s;'
        f" {plan / 1e9:.2f} GB of temporaries planned, {used / 1e9:.2f} GB peak of the whole process"
    )


if __name__ == "__main__":
    given = sys.argv[1:] + ["256", "2000", "pressures"][len(sys.argv) - 1 :]
    main(int(given[0]), int(given[1]), given[2])
