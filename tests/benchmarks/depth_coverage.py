"""Coverage of the 95 % intervals of the modulus over the depth, where the fit of a force curve is rejected for a trend.

    python -m tests.benchmarks.depth_coverage [--sets 200] [--seed 0] [--only WORDS]

The samples have a stated local modulus over the depth, or are films on stiff and soft bases
(``tests/support/depth_laws.py``). The noise is 0.1 and 1 % of the largest force, 1 % in proportion to the force, and 0.3 %
with a correlation of 0.6 of neighbours. Every row has the share of the intervals at the five depths that hold the apparent
modulus at their depth, the root mean square errors in percent, and the share of the fits that have a table.
"""

import argparse

import numpy as np

import fitting
from tests.support import depth_laws

NOISES = (("constant", 0.001), ("constant", 0.01), ("proportional", 0.01), ("correlated", 0.003))


def row(shape: str, noise: str, size: float, sets: int, seed: int) -> str:
    """Return a row of the results."""
    found = []
    for k in range(sets):
        data, tip = depth_laws.curve(shape, noise, size, 10_000 * seed + k)
        fit = fitting.fit_force(data, indenter=tip, nu=depth_laws.NU)
        if fit.modulus_over_depth:
            found.append(depth_laws.held(fit, shape))
    name = f"{shape:22s} {noise:12s} {100 * size:4.1f} %"
    if not found:
        return f"{name}  no table"
    share = 100.0 * np.mean([inside for inside, _ in found], 0)
    error = 100.0 * np.sqrt(np.mean([off**2 for _, off in found], 0))
    cells = "".join(f"{s:6.1f}" for s in share), "".join(f"{e:6.1f}" for e in error)
    return f"{name}  held{cells[0]}   error{cells[1]}   tables {100.0 * len(found) / sets:.0f} %"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    for shape in depth_laws.SHAPES:
        for noise, size in NOISES:
            if options.only in f"{shape} {noise}":
                print(row(shape, noise, size, options.sets, options.seed), flush=True)


if __name__ == "__main__":
    main()
