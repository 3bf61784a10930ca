"""Coverage of the 95 % intervals of fits to thin bonded samples: force curves with an unknown contact point, creep of a gel.

    python -m tests.benchmarks.thin_coverage [--sets 200] [--seed 0]

The force curves are those of a ball up to chi = sqrt(R d)/h = 1.5 with a tilted baseline; the noise has a standard
deviation of 0.2 % of the load and 0.05 % of the largest load, or constantly 0.2 % of the largest load. The bead on the gel
is loaded in a second and held for a minute; the noise is 0.2 % of the largest depth. All are solutions by another method
than the package's (``tests/support/thin_samples.py``).

Every parameter has the mean and the standard deviation of the relative error of its estimates, its largest one, the share of
the intervals that hold the truth, and in parentheses the standard deviation that least squares with the true weights have
in the linearised model (Cramer and Rao's bound), from differences of the curves of that other method.
"""

import argparse
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import fitting
import jaxcontact as jc
from fitting.inference.result import Fit
from tests.support import thin_samples as samples

STEP = 1e-4  # of a parameter's logarithm, and of a contact point over the largest depth


class Case(NamedTuple):
    """curve: measured values (n,) of the parameters (p,), the first of which are the material's, over the true values for
    these, and 0 for nuisances; sd (n,) of the noise; fit: that of measured values; truth of the material."""

    curve: Callable[[np.ndarray], np.ndarray]
    nuisances: int
    sd: np.ndarray
    fit: Callable[[np.ndarray], Fit]
    truth: dict[str, float]


def force_case(nu: float, proportional: float, floor: float) -> Case:
    """A force curve: G, and contact point, baseline and tilt."""
    depth, load = samples.thin(nu, 1.5)
    top, below = load.max(), samples.Z > 0.0

    def curve(p: np.ndarray) -> np.ndarray:
        moved = np.interp(depth - p[1] * depth.max(), depth, load)
        return p[0] * moved + top * (0.1 + p[2] + (0.05 + p[3]) * samples.T)

    fit = lambda y: fitting.fit_force(
        samples.curve(y, depth), indenter=jc.Sphere(samples.RADIUS), nu=nu, thickness=samples.LAYER
    )
    sd = np.hypot(proportional * load * below, floor * top)
    return Case(curve, 3, sd, fit, {"G": samples.E / 2.0 / (1.0 + nu)})


def gel_case() -> Case:
    """Creep of a gel: G1, G2 and eta2."""
    load, depth = samples.gel_creep(samples.TIMES, **samples.GEL)
    true = np.array(list(samples.GEL.values()))
    fit = lambda y: fitting.fit_indentation(
        samples.gel_data(load, y), "StandardLinearSolid", indenter=jc.Sphere(samples.BEAD), nu=samples.GEL_NU,
        thickness=samples.HEIGHT,
    )  # fmt: skip
    curve = lambda p: samples.gel_creep(samples.TIMES, *(p * true))[1]
    return Case(curve, 0, 0.002 * depth.max() * (samples.TIMES > 0), fit, samples.GEL)


def bound(case: Case) -> np.ndarray:
    """Standard deviations (p,) of the material's relative errors for known weights."""
    material = len(case.truth)
    at = np.append(np.ones(material), np.zeros(case.nuisances))
    steps = STEP * np.eye(at.size)
    slopes = np.stack([(case.curve(at + one) - case.curve(at - one)) / (2.0 * STEP) for one in steps], -1)
    known = case.sd > 0.0
    scaled = slopes[known] / case.sd[known, None]
    return np.sqrt(np.diag(np.linalg.inv(scaled.T @ scaled)))[:material]


def table(case: Case, sets: int, seed: int) -> str:
    """Return a row of the results."""
    clean = case.curve(np.append(np.ones(len(case.truth)), np.zeros(case.nuisances)))
    off, held, refused = [], [], 0
    for k in range(sets):
        noise = case.sd * np.random.default_rng([seed, k]).standard_normal(clean.size)
        found = case.fit(clean + noise)
        refused += bool(found.refused)
        off.append([100.0 * (found.values[name] / value - 1.0) for name, value in case.truth.items()])
        held.append(
            [found.intervals[n][0] <= value <= found.intervals[n][1] for n, value in case.truth.items()]
        )
    error, least = np.array(off), 100.0 * bound(case)
    rows = zip(case.truth, error.T, 100.0 * np.mean(held, 0), least, strict=True)
    parts = [
        f"{name}: mean {e.mean():+.3f}, sd {e.std(ddof=1):.3f} ({sd:.3f}), largest {abs(e).max():.2f} %, held {share:.1f} %"
        for name, e, share, sd in rows
    ]
    return f"{'; '.join(parts)}; rejected {100.0 * refused / sets:.1f} %"


def cases() -> dict[str, Callable[[], Case]]:
    """All rows."""
    found: dict[str, Callable[[], Case]] = {}
    for nu in (0.3, 0.5):
        found[f"force, nu {nu}, noise of the load"] = lambda nu=nu: force_case(nu, 0.002, 0.0005)
        found[f"force, nu {nu}, constant noise"] = lambda nu=nu: force_case(nu, 0.0, 0.002)
    return found | {"gel, creep": gel_case}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for name, case in cases().items():
        print(f"{name}: {table(case(), options.sets, options.seed)}", flush=True)


if __name__ == "__main__":
    main()
