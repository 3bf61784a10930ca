"""Time of the gradient of a contact with respect to its whole height map, in forward runs.

A wavy ball on an elastic half-space, n x n heights; the least processor time of several runs after compilation (wall time
depends on the other programs of a machine). The memory is that of the compiled gradient of a film that creeps over 10 and
100 time steps, as XLA plans it, for both kinds of ``checkpoint``, and of the run alone.

    python -m tests.benchmarks.design_gradients [--n 256]
"""

import argparse
import time

import jax
import jax.numpy as jnp
import numpy as np

import jaxcontact as jc

SMALL = 64
POLYMER = jc.StandardLinearSolid(G1=1e9, G2=1e9, eta2=20e9, nu=0.4)


LOSSES = {
    "mean square of the pressure": lambda history: jnp.sum(history.pressure**2) / 1e16,
    "approach": lambda history: history.approach[-1] / 1e-6,
    "area": lambda history: history.smooth_area[-1] / 1e-8,
    "area and pressure": lambda history: history.smooth_area[-1] / 1e-8 + jnp.sum(history.pressure**2) / 1e16,
}


def pressed(heights, body, times, checkpoint="pressures"):
    """Return the history of a contact, of which the last time is kept."""
    grid, indenter = jc.Grid.square(heights.shape[0], 240e-6), jc.HeightField(heights)
    return jc.indent(body, indenter, jc.Load(0.5), times, grid=grid, save="last", checkpoint=checkpoint)


def surface(n):
    """Return heights (n, n) [m]."""
    x, y = jc.Grid.square(n, 240e-6).coordinates()
    return -(x**2 + y**2) / 10e-3 + 2e-8 * jnp.cos(x / 8e-6) * jnp.cos(y / 8e-6)


def fastest(function, *given, runs=10):
    """Return the shortest of several processor times [s] after a first call."""
    jax.block_until_ready(function(*given))
    times = []
    for _ in range(runs):
        began = time.process_time()
        jax.block_until_ready(function(*given))
        times.append(time.process_time() - began)
    return min(times)


def planned(body, steps, checkpoint):
    """Return the temporary memory of several time steps, in fields of ``SMALL`` x ``SMALL`` numbers.

    checkpoint: as of ``jc.indent``, for the gradient; None for the run alone.
    """
    times = np.linspace(0.0, 100.0, steps)
    run = lambda z: LOSSES["area and pressure"](pressed(z, body, times, checkpoint or "pressures"))
    plan = jax.jit(jax.grad(run) if checkpoint else run).lower(surface(SMALL)).compile().memory_analysis()
    return plan.temp_size_in_bytes / (8.0 * SMALL**2)


def main():
    """Print times and memory."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=256)
    parser.add_argument("--only", default="", help="time or memory")
    options = parser.parse_args()
    if options.only != "memory":
        n, half_space = options.n, jc.LayeredHalfSpace([], jc.Elastic(G=1e9, nu=0.4))
        for name, loss in LOSSES.items():
            one = lambda z, loss=loss: loss(pressed(z, half_space, np.zeros(1)))
            forward, gradient = (fastest(jax.jit(run), surface(n)) for run in (one, jax.value_and_grad(one)))
            print(
                f"{name}, {n * n} heights: forward {1e3 * forward:.1f} ms, value and gradient {1e3 * gradient:.1f} ms:"
                f" {gradient / forward:.2f} runs",
                flush=True,
            )
    if options.only == "time":
        return
    body = jc.LayeredHalfSpace([jc.Layer(POLYMER, 40e-6)], jc.Elastic.from_young(210e9, nu=0.3))
    for checkpoint in (None, "pressures", "blocks"):
        fields = [planned(body, steps, checkpoint) for steps in (10, 100)]
        name = f"gradient, checkpoint={checkpoint!r}" if checkpoint else "run"
        print(f"{name}: {fields[0]:.0f} and {fields[1]:.0f} fields for 10 and 100 steps", flush=True)


if __name__ == "__main__":
    main()
