"""The 150-step creep run of Table 4 (W = 60 N, 150 nm, 120 min, N = 256), in convolutions and in seconds.

    python tests/benchmarks/bench_creep.py [N]

One unit is one pruned N x N convolution timed in the same process; everything is included (kernels,
history, contact), compile time apart. Prints the end point and the peak memory too.
"""

import resource
import sys
import time
import warnings

import jax
import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from jaxcontact.operators import spectral


def median_time(run, repeats):
    """Median wall time [s] of a call, after one that compiles; and the time of that first call."""
    started = time.perf_counter()
    jax.block_until_ready(run())
    first = time.perf_counter() - started
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        jax.block_until_ready(run())
        times.append(time.perf_counter() - started)
    return float(np.median(times)), first


def main(n: int) -> None:
    warnings.simplefilter("ignore")
    steel = jc.Elastic.from_young(210e9, nu=0.3)
    film = jc.Burgers(G1=0.75e9, G2=13.89e6, eta1=3.1486e12, eta2=120.9e9, nu=0.3)
    body = jc.LayeredHalfSpace([jc.Layer(film, thickness=150e-9)], substrate=steel)
    ball = jc.Sphere(radius=9.525e-3, material=steel)
    times, grid = jnp.linspace(0.0, 7200.0, 151), jc.Grid.square(n, 600e-6)
    run = lambda: jc.indent(body, ball, jc.Load(60.0), times, grid=grid, save="last")
    seconds, first = median_time(run, 5)
    spectrum, field = jc.kernels(body, ball, grid).family.members.spectrum[0], jnp.ones((n, n))
    convolve = jax.jit(spectral.convolve)
    unit, _ = median_time(lambda: convolve(spectrum, field), 200)
    result = run()
    print(f"N = {n}: {seconds:.2f} s for 150 steps, first call with compilation {first:.1f} s")
    print(f"one convolution {unit * 1e3:.3f} ms; {seconds / 150 / unit:.1f} convolutions a step")
    print(f"mean iterations {float(jnp.mean(result.iterations)):.2f}")
    print(
        f"approach {float(result.approach[-1]) * 1e6:.4f} um, p0 {float(jnp.max(result.pressure)) / 1e9:.4f} GPa"
    )
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 256)
