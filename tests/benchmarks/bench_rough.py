"""Area over load of a self-affine surface on an elastic half-space: kappa = A E* slope/W as the load falls.

Persson's theory has sqrt(8/pi) = 1.596 (B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840), asperities sqrt(2 pi) = 2.507
(A. W. Bush, R. D. Gibson, T. R. Thomas, Wear 35 (1975) 87), calculations 2.0 to 2.2 (S. Hyun, L. Pei, J.-F. Molinari,
M. O. Robbins, Phys. Rev. E 70 (2004) 026117; of several authors "slightly greater than 2", as reviewed in Tribol. Lett. 66
(2018), doi 10.1007/s11249-018-1061-7), less the broader the spectrum is. Beside it stands the area
less the part (pi - 1 + ln 2)/24 of the cells along its rim: V. A. Yastrebov, G. Anciaux, J.-F. Molinari, Tribol. Int.
114 (2017) 161.

    python tests/benchmarks/bench_rough.py [cells along each side, 1024] [shortest wave in cells, 8]
"""

import sys
import time

import jax
import jax.numpy as jnp
import numpy as np

import jaxcontact as jc

RIM = (np.pi - 1.0 + np.log(2.0)) / 24.0
LOADS = np.array([0.08, 0.04, 0.02, 0.01, 0.005])  # mean pressure over E* slope


def rim(pressure):
    """Sides between cells in and out of contact."""
    inside = pressure > 0.0
    return sum(jnp.sum(inside != jnp.roll(inside, 1, axis)) for axis in (0, 1))


def main(n, cells):
    slope, contact_modulus = 0.1, 1e9
    grid = jc.Grid(shape=(n, n), spacing=(1e-6, 1e-6), periodic=True)
    heights = jc.self_affine(
        grid, hurst=0.8, rms_slope=slope, shortest=cells * 1e-6, longest=n / 4 * 1e-6, seed=0
    )
    body = jc.LayeredHalfSpace([], jc.Elastic(G=contact_modulus / 4.0, nu=0.5))
    load = jc.Load(LOADS * contact_modulus * slope * (n * 1e-6) ** 2)
    count = lambda step: {"cells": jnp.sum(step.pressure > 0.0), "rim": rim(step.pressure)}
    start = time.perf_counter()
    history = jc.indent(
        body,
        jc.HeightField(heights),
        load,
        np.arange(float(LOADS.size)),
        grid=grid,
        save=count,
        tolerance=1e-6,
    )
    jax.block_until_ready(history.pressure)
    print(f"{n} x {n}: {time.perf_counter() - start:.0f} s, status {np.unique(history.status)}")
    for i, load in enumerate(LOADS):
        area, edge = (float(history.saved[key][i]) / n**2 for key in ("cells", "rim"))
        print(
            f"p/(E* slope) {load:.3f}: A/A0 {area:.4f}, kappa {area / load:.3f},"
            f" less the rim {(area - RIM * edge) / load:.3f}, iterations {int(history.iterations[i])}"
        )


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    main(*(given + [1024, 8][len(given) :]))
