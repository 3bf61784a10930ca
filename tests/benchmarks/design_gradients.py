"""Time of the gradient of a contact with respect to its whole height map, in forward runs.

A wavy ball on an elastic half-space, n x n heights; the fastest of several runs after compilation. The memory is that of
the compiled gradient of a film that creeps over 100 time steps, as XLA plans it, for both kinds of ``checkpoint``.

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


def measure(heights, body, times, checkpoint="pressures"):
    """Return contact area and weighted pressure in one number."""
    n = heights.shape[0]
    grid, surface = jc.Grid.square(n, 240e-6), jc.HeightField(heights)
    history = jc.indent(body, surface, jc.Load(0.5), times, grid=grid, save="last", checkpoint=checkpoint)
    return history.smooth_area[-1] / 1e-8 + jnp.sum(history.pressure**2) / 1e16


def surface(n):
    """Return heights (n, n) [m]."""
    x, y = jc.Grid.square(n, 240e-6).coordinates()
    return -(x**2 + y**2) / 10e-3 + 2e-8 * jnp.cos(x / 8e-6) * jnp.cos(y / 8e-6)


def fastest(function, *given, runs=5):
    """Return the shortest of several times [s] after a first call."""
    jax.block_until_ready(function(*given))
    times = []
    for _ in range(runs):
        began = time.perf_counter()
        jax.block_until_ready(function(*given))
        times.append(time.perf_counter() - began)
    return min(times)


def planned(body, steps, checkpoint):
    """Return the temporary memory of a gradient over several time steps, in fields of ``SMALL`` x ``SMALL`` numbers."""
    times = np.linspace(0.0, 100.0, steps)
    run = jax.jit(jax.grad(lambda z: measure(z, body, times, checkpoint)))
    plan = run.lower(surface(SMALL)).compile().memory_analysis()
    return plan.temp_size_in_bytes / (8.0 * SMALL**2)


def main():
    """Print times and memory."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=256)
    n = parser.parse_args().n
    half_space, heights = jc.LayeredHalfSpace([], jc.Elastic(G=1e9, nu=0.4)), surface(n)
    one = lambda z: measure(z, half_space, np.zeros(1))
    forward, gradient = fastest(jax.jit(one), heights), fastest(jax.jit(jax.value_and_grad(one)), heights)
    print(
        f"{n * n} heights: forward {forward:.3f} s, value and gradient {gradient:.3f} s: {gradient / forward:.2f} runs"
    )
    body = jc.LayeredHalfSpace([jc.Layer(POLYMER, 40e-6)], jc.Elastic.from_young(210e9, nu=0.3))
    for steps in (10, 100):
        for checkpoint in ("pressures", "blocks"):
            fields = planned(body, steps, checkpoint)
            print(f"{steps} steps, checkpoint={checkpoint!r}: {fields:.0f} fields of {SMALL} x {SMALL}")


if __name__ == "__main__":
    main()
