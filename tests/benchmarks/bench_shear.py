"""Partial slip of a rough elastic contact: convolutions of one scalar field, and seconds, uncoupled and coupled.

    python tests/benchmarks/bench_shear.py [CELLS]       512 unless given

Forward and inverse transforms of fields are counted as they run, half a convolution each. The paper's own figures at 512 x
512 on six cores are 140 s uncoupled and 300 s coupled. Printed besides: a fretting cycle of 40 steps at 128 x 128.
"""

import sys
import time

import jax
import numpy as np

import jaxcontact as jc
from jaxcontact.operators import spectral

COUNTED = {"halves": 0}


def counting(function):
    """The transform, with its fields counted at run time."""

    def counted(field, *rest):
        count = int(np.prod(field.shape[:-2]))
        jax.debug.callback(lambda: COUNTED.update(halves=COUNTED["halves"] + count))
        return function(field, *rest)

    return counted


def rough(n, width, wavelengths=(1 / 8, 1 / 16, 1 / 32, 1 / 64)):
    """A ball with waves of random phases on it, slopes alike."""
    rng = np.random.default_rng(0)
    grid = jc.Grid.square(n, width)
    x, y = (np.asarray(a) for a in grid.coordinates())
    heights = -(x**2 + y**2) / (2 * 10e-3)
    for part in wavelengths:
        for angle in rng.uniform(0, np.pi, 6):
            along = (x * np.cos(angle) + y * np.sin(angle)) * 2 * np.pi / (part * width)
            heights = heights + 2e-4 * part * width * np.cos(along + rng.uniform(0, 2 * np.pi))
    return grid, heights


def measured(name, run):
    """Seconds of a second call, and what it counted."""
    run()
    COUNTED["halves"], began = 0, time.perf_counter()
    history = run()
    jax.block_until_ready(history.traction)
    jax.effects_barrier()
    seconds = time.perf_counter() - began
    contact, stick = np.asarray(history.pressure) > 0, np.asarray(history.stick)
    print(
        f"{name}: {COUNTED['halves'] / 2:.0f} convolutions, {seconds:.1f} s, iterations"
        f" {np.sum(np.asarray(history.iterations))}, status {np.unique(np.asarray(history.status))}, contact"
        f" {np.mean(contact):.3f} of the cells, {np.sum(stick) / np.sum(contact):.2f} of it sticks",
        flush=True,
    )


def main(n):
    spectral.transform, spectral.inverse = counting(spectral.transform), counting(spectral.inverse)
    grid, heights = rough(n, 600e-6)
    body = jc.LayeredHalfSpace([], jc.Elastic.from_young(210e9, 0.3))
    for coupled in (False, True):
        push = jc.TangentialLoad((6.0, 0.0))
        measured(
            f"rough, {n} x {n}, {'coupled' if coupled else 'uncoupled'}",
            lambda coupled=coupled, push=push: jc.shear(
                body, jc.HeightField(heights), jc.Load(40.0), push, [0.0], friction=0.3, grid=grid,
                coupled=coupled, save="last", tolerance=1e-6,
            ),
        )  # fmt: skip
    phase = np.linspace(0.0, 2 * np.pi, 41)
    cycle = jc.TangentialLoad(np.stack([8.0 * np.sin(phase), 0 * phase], 1))
    ball, fine = jc.Sphere(10e-3), jc.Grid.square(128, 400e-6)
    measured(
        "fretting, 40 steps, 128 x 128, coupled",
        lambda: jc.shear(
            body, ball, jc.Load(40.0), cycle, phase, friction=0.3, grid=fine, save="last", tolerance=1e-6
        ),
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 512)
