"""The two runs of Fig. 15 e and f: 2000 steps at 1611 um/s, 256 x 256, tolerance 1e-6, save="last".

python tests/benchmarks/bench_slide.py [N] [STEPS] [NODES]

NODES: decay rates per band in the kernels; 1 is good to 4e-8 for this film (``separation_error``, printed), and
halves the number of fields; ``jc.slide`` without kernels takes 2.

The paper: about nine hours on six cores (for each or both). Seconds are printed for each run, the cost of a
step in convolutions (real, N x N zero-padded to 2N x 2N, timed in the same process), and the peak memory;
then the cost of the steady state of one speed. Run it as a process of its own.
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

PIXEL, SPEED, DT = 8.0551e-6, 1611e-6, 0.005


def timed(run, repeats):
    """First call with compilation, then the median of several [s]."""
    began = time.perf_counter()
    jax.block_until_ready(run())
    first = time.perf_counter() - began
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        result = jax.block_until_ready(run())
        seconds.append(time.perf_counter() - began)
    return first, float(np.median(seconds)), result


def main(n: int, steps: int, nodes: int) -> None:
    warnings.simplefilter("ignore")
    steel = jc.Elastic.from_young(210e9, nu=0.3)
    film = jc.Burgers(G1=0.75e9, G2=13.89e6, eta1=3.1486e12, eta2=120.9e9, nu=0.3)
    body = jc.LayeredHalfSpace([jc.Layer(film, thickness=150e-9)], substrate=steel)
    ball = jc.Sphere(radius=9.525e-3, material=steel)
    grid, times = jc.Grid.square(n, 256 * PIXEL), jnp.arange(steps + 1) * DT
    kernels, field = jc.kernels(body, ball, grid, nodes=nodes), jnp.ones((n, n))
    spectrum = kernels.family.members.spectrum[0]
    convolve = jax.jit(spectral.convolve)
    _, unit, _ = timed(lambda: convolve(spectrum, field), 200)
    print(f"one convolution {unit * 1e3:.3f} ms; separation error {float(kernels.separation_error):.1e}")
    for load in (1.0, 60.0):
        run = lambda load=load: jc.slide(
            body, ball, jc.Load(load), times,
            velocity=SPEED, grid=grid, tolerance=1e-6, save="last", kernels=kernels,
        )  # fmt: skip
        first, seconds, found = timed(run, 1)
        solve = float(jnp.mean(found.iterations))
        print(f"W = {load:g} N: {seconds:.1f} s for {steps} steps, first call {first:.1f} s;"
              f" {seconds / steps / unit:.1f} convolutions a step, {solve:.2f} iterations,"
              f" all converged {bool(np.all(np.asarray(found.status) != 1))}")  # fmt: skip
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    for speed in (1e-9, 1e-8, 4e-7, 1e-3):
        run = lambda speed=speed: jc.slide_steady(
            body, ball, jc.Load(60.0), velocity=speed, grid=jc.Grid.square(n, 620e-6)
        )
        first, seconds, found = timed(run, 3)
        print(f"steady at {speed:g} m/s: {seconds:.2f} s = {seconds / unit:.0f} convolutions with its kernels,"
              f" {int(found.iterations)} iterations, first call {first:.1f} s")  # fmt: skip


if __name__ == "__main__":
    main(*(int(a) for a in (sys.argv[1:] + ["256", "2000", "1"][len(sys.argv) - 1 :])))
