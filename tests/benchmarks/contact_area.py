"""Errors of ``smooth_area`` and of its slope for Hertz contacts at random places on the grid.

A paraboloid on an elastic half-space, with contacts of 3 to 80 cells across within a tenth. A row has the root mean square
and mean error of the radius in cells, the largest and the root mean square error of the area, and those of dA/d log W.

    python -m tests.benchmarks.contact_area
"""

import jax
import jax.numpy as jnp
import numpy as np

import jaxcontact as jc

MODULUS, NU, CURVATURE = 2.0, 0.25, 1e3  # E* of the half-space, and the radius of the paraboloid in cells
BODY = jc.LayeredHalfSpace([], jc.Elastic(0.5 * MODULUS * (1.0 - NU), NU))
# cells across, of the grid, number
CASES = (
    (3, 12, 24),
    (5, 12, 24),
    (10, 24, 24),
    (20, 40, 16),
    (40, 72, 12),
    (80, 128, 10),
)


def solver(n):
    """Return a function from log load and centre (2,) to the area in cells, with its slope."""
    grid, at = jc.Grid.square(n, float(n)), jnp.arange(n) - (n - 1) / 2

    def area(log_load, centre):
        square = (at[:, None] - centre[0]) ** 2 + (at[None, :] - centre[1]) ** 2
        surface, load = jc.HeightField(-square / (2.0 * CURVATURE)), jc.Load(jnp.exp(log_load))
        return jc.indent(BODY, surface, load, [0.0], grid=grid, tolerance=1e-10).smooth_area[0]

    return jax.jit(jax.value_and_grad(area))


def main():
    """Print the table."""
    print("across  radius rms  mean [cells]  area largest  rms  slope rms  mean [%]")
    for across, n, count in CASES:
        solved, rng, errors = solver(n), np.random.default_rng(n + across), []
        for _ in range(count):
            a, centre = across / 2 * (1.0 + 0.1 * (2.0 * rng.random() - 1.0)), rng.random(2) - 0.5
            area, slope = solved(np.log(4.0 / 3.0 * MODULUS * a**3 / CURVATURE), centre)
            exact = np.pi * a**2
            errors.append((np.sqrt(area / np.pi) - a, area / exact - 1.0, slope / (2.0 / 3.0 * exact) - 1.0))
        errors = np.array(errors, dtype=float)
        (r, A, s), (r0, _, s0) = np.sqrt(np.mean(errors**2, 0)), np.mean(errors, 0)
        most = np.max(np.abs(errors[:, 1]))
        print(
            f"{across:6d}  {r:10.4f} {r0:+13.4f}  {100 * most:12.3f} {100 * A:.3f} {100 * s:9.2f} {100 * s0:+9.2f}"
        )


if __name__ == "__main__":
    main()
