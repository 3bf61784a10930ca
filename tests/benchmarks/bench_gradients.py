"""Cost of gradients of the 150-step creep run of Table 4 (W = 60 N, 150 nm, 120 min), in convolutions.

    python tests/benchmarks/bench_gradients.py [N ...]

One unit is one pruned N x N convolution timed in the same process. The reverse gradient is that of the
peak pressure at the end with respect to every leaf of body, indenter and control at once; the four
forward tangents are G1, G2, eta1 and eta2. Both include the forward run; compile time is apart.
"""

import resource
import sys
import warnings

import jax
import jax.numpy as jnp
from bench_creep import median_time

import jaxcontact as jc
from jaxcontact.operators import spectral

STEEL = jc.Elastic.from_young(210e9, nu=0.3)
BODY = jc.LayeredHalfSpace([jc.Layer(jc.Burgers(0.75e9, 13.89e6, 3.1486e12, 120.9e9, 0.3), 150e-9)], STEEL)
CASE = (BODY, jc.Sphere(radius=9.525e-3, material=STEEL), jc.Load(60.0))
STEPS = 150


def main(n: int) -> None:
    """Print seconds, convolutions a step and ratios for one grid."""
    times, grid = jnp.linspace(0.0, 7200.0, STEPS + 1), jc.Grid.square(n, 600e-6)

    def peak(case):
        return jnp.max(jc.indent(*case, times, grid=grid, save="last").pressure) / 1e9

    def tangents(scale):
        film = BODY.layers[0].material
        layer = lambda q: jc.Layer(jc.Burgers(*(scale * q), film.nu), BODY.layers[0].thickness)
        along = lambda q: peak((jc.LayeredHalfSpace([layer(q)], STEEL), *CASE[1:]))
        return jax.jacfwd(along)(jnp.array([film.G1, film.G2, film.eta1, film.eta2]))

    scaled = lambda scale: jax.tree.map(lambda a: jnp.asarray(a, float) * scale, CASE)
    spectrum, field = jc.kernels(CASE[0], CASE[1], grid).family.members.spectrum[0], jnp.ones((n, n))
    convolve = jax.jit(spectral.convolve)
    unit, _ = median_time(lambda: convolve(spectrum, field), 200)
    print(f"N = {n}: one convolution {unit * 1e3:.3f} ms")
    runs = {
        "forward": lambda s: peak(scaled(s)),
        "reverse": lambda s: jax.grad(lambda c: peak(c))(scaled(s)),
        "four tangents": tangents,
    }
    seconds = {}
    for name, run in runs.items():
        compiled = jax.jit(run)
        seconds[name], first = median_time(lambda f=compiled: f(1.0), 3)
        print(
            f"  {name:14s} {seconds[name]:6.2f} s, {seconds[name] / STEPS / unit:5.1f} convolutions a step, "
            f"{seconds[name] / seconds['forward']:.2f} of the forward run; first call {first:.1f} s"
        )
    print(f"  peak memory so far {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    for size in [int(a) for a in sys.argv[1:]] or [128, 256]:
        main(size)
