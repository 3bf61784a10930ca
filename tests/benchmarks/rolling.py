"""Kalker's coefficients of elliptic contacts beside a spectral solution of the linear theory.

    python -m tests.benchmarks.rolling                  # ratios of half-axes from 0.1 to 10; 48 and 96 cells
    python -m tests.benchmarks.rolling --cells 32 64 --poisson 0.25 --ratios 1 2

Equal solids roll with a creepage so small against friction that nothing slips. C11 and C22 are the forces along and across
the rolling direction over G a b times the creepage, C23 the force across over G (a b)^(3/2) times the spin; a is the
half-axis along the rolling direction. The grid has as many cells along each axis, and is 1.2 times as wide as the contact.
Its edge runs between cells, so that the error is of the first order in the cell: the last column extrapolates it to none.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import jaxcontact as jc
from jaxcontact.reference import hertz

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from linear_rolling import forces

RATIOS, POISSON = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0), (0.0, 0.25, 0.5)
G, LOAD, SMALL = 80e9, 10.0, 1e-4


def coefficients(ratio: float, nu: float, cells: int) -> np.ndarray:
    """Return C11, C22 and C23 of a contact of this ratio of the half-axis along the rolling direction to that across; nan
    where rolling has not settled."""
    excess = lambda log: np.log(hertz.axes_ratio((np.exp(log), 1.0))) - np.log(ratio)
    wide = np.exp(brentq(excess, -12.0, 12.0))
    radii, solid = (10e-3 * np.sqrt(wide), 10e-3 / np.sqrt(wide)), jc.Elastic(G, nu)
    a, b = hertz.ellipse(LOAD, radii, 2.0 * (1.0 - nu) / G)[:2]
    size = np.sqrt(a * b)
    grid = jc.Grid((cells, cells), (2.4 * a / cells, 2.4 * b / cells))
    found = []
    for creepage, spin, place in (
        ((SMALL, 0.0), 0.0, 0),
        ((0.0, SMALL), 0.0, 1),
        ((0.0, 0.0), SMALL / size, 1),
    ):
        run = jc.roll_steady(
            jc.LayeredHalfSpace([], solid), jc.Ellipsoid(radii, solid), jc.Load(LOAD), velocity=1.0,
            creepage=creepage, spin=spin, friction=50.0, grid=grid, coupled=False,
        )  # fmt: skip
        force = float(run.tangential_load[place]) if bool(run.converged) else np.nan
        found.append(force / (SMALL * G * size**2))
    return np.abs(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs=2, default=(48, 96))
    parser.add_argument("--poisson", type=float, nargs="+", default=POISSON)
    parser.add_argument("--ratios", type=float, nargs="+", default=RATIOS)
    asked = parser.parse_args()
    coarse, fine = asked.cells
    print(
        f"| a/b | nu | C11, C22, C23 | {coarse} cells [%] | {fine} cells [%] | extrapolated [%] |\n|---|---|---|---|---|---|"
    )
    for nu in asked.poisson:
        for ratio in asked.ratios:
            linear, _ = forces(np.sqrt(ratio), 1.0 / np.sqrt(ratio), nu)
            exact = np.abs([linear[0, 0], linear[1, 1], linear[2, 1]])
            first, second = (coefficients(ratio, nu, cells) for cells in (coarse, fine))
            limit = (fine * second - coarse * first) / (fine - coarse)
            shown = ", ".join(f"{c:.4f}" for c in exact)
            errors = (", ".join(f"{100 * e:+.2f}" for e in c / exact - 1.0) for c in (first, second, limit))
            print(f"| {ratio:g} | {nu:g} | {shown} | {' | '.join(errors)} |", flush=True)


if __name__ == "__main__":
    main()
