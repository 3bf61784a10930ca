"""How often the intervals of ``fitting.fit_creep`` hold the truth, with the default weights.

Simulated creep curves of 60 points: two models, shares J0/J(T) of the instantaneous compliance in the final one, five
kinds of noise with a standard deviation of 1 %, and even and logarithmic times. The compliances are written here again.

    python -m tests.benchmarks.coverage [--sets 400] [--only TEXT]

Every row has the coverage of each parameter's 95 % interval over the accepted fits, and the share of rejected ones.
The exit status is 1 if a coverage is outside 92 to 98 %.
"""

import argparse
import itertools
import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import fitting

POINTS, SIZE, COMPLIANCE, DURATION = 60, 0.01, 1e-6, 100.0
SHARES = (2, 6, 21)  # J(T)/J0
NOISES = ("constant", "relative", "correlated", "mixed", "heavy-tailed")
RHO = 0.6
RANGE = 0.92, 0.98


class Row(NamedTuple):
    """A case of the table."""

    model: str
    share: int
    noise: str
    times: str

    def __str__(self) -> str:
        return f"{self.model:20s} 1/{self.share:<3d} {self.noise:13s} {self.times:5s}"


class Covered(NamedTuple):
    """{parameter: share of the intervals that hold the truth}, share of fits refused, and number of sets."""

    held: dict[str, float]
    refused: float
    sets: int


def rows() -> Iterator[Row]:
    """All cases."""
    for case in itertools.product(("StandardLinearSolid", "Burgers"), SHARES, NOISES, ("even", "log")):
        yield Row(*case)


def truth(row: Row) -> dict[str, float]:
    """Parameters [Pa, Pa s] with J(T) near ``COMPLIANCE``."""
    J0 = COMPLIANCE / row.share
    rest, tau = COMPLIANCE - J0, DURATION / 5.0
    flow = 0.4 if row.model == "Burgers" else 0.0
    J2 = (1.0 - flow) * rest / -np.expm1(-DURATION / tau)
    found = {"G1": 1.0 / J0, "G2": 1.0 / J2, "eta2": tau / J2}
    return found | ({"eta1": DURATION / (flow * rest)} if flow else {})


def times(row: Row) -> np.ndarray:
    """(n,) [s]."""
    if row.times == "even":
        return np.linspace(DURATION / POINTS, DURATION, POINTS)
    return np.geomspace(1e-3 * DURATION, DURATION, POINTS)


def creep(t: np.ndarray, G1: float, G2: float, eta2: float, eta1: float = np.inf) -> np.ndarray:
    """J(t) [1/Pa]."""
    return 1.0 / G1 - np.expm1(-t * G2 / eta2) / G2 + t / eta1


def noise(kind: str, J: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Errors (n,) [1/Pa]: of 1 % of the largest J, of 1 % of J (also with the correlation ``RHO`` of an AR(1) series),
    or of both."""
    white, largest = rng.standard_normal(J.size), float(J.max())
    if kind == "constant":
        return SIZE * largest * white
    if kind == "relative":
        return SIZE * J * white
    if kind == "mixed":
        return SIZE * np.hypot(0.2 * largest, J) * white
    if kind == "heavy-tailed":  # Student's t of 5 degrees of freedom, of unit variance
        return SIZE * largest * rng.standard_t(5.0, J.size) * np.sqrt(3.0 / 5.0)
    for i in range(1, J.size):
        white[i] = RHO * white[i - 1] + np.sqrt(1.0 - RHO**2) * white[i]
    return SIZE * J * white


def covered(row: Row, sets: int, seed: int = 0) -> Covered:
    """Fit so many simulated curves."""
    t, true = times(row), truth(row)
    J, held, refused, index = creep(t, **true), [], 0, list(rows()).index(row)
    for k in range(sets):
        rng, y = np.random.default_rng([seed, index, k]), np.zeros(1)
        while np.any(y <= 0.0):  # a compliance is positive
            y = J + noise(row.noise, J, rng)
        fit = fitting.fit_creep(fitting.CreepData(t=t, J=y), row.model)
        refused += bool(fit.refused)
        if not fit.refused:
            held.append([fit.intervals[n][0] <= v <= fit.intervals[n][1] for n, v in true.items()])
    shares = np.mean(held, axis=0).tolist()
    return Covered(dict(zip(true, shares, strict=True)), refused / sets, sets)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=400, help="simulated curves of each row")
    parser.add_argument("--only", default="", help="rows whose text contains this")
    options, outside = parser.parse_args(), 0
    error = 100.0 * np.sqrt(0.95 * 0.05 / options.sets)
    print(f"coverage of 95 % intervals [%], {options.sets} sets a row: standard error {error:.1f}")
    for row in rows():
        if options.only in str(row):
            found = covered(row, options.sets)
            wrong = [n for n, share in found.held.items() if not RANGE[0] <= share <= RANGE[1]]
            outside += len(wrong)
            shares = "  ".join(f"{n} {100 * share:5.1f}" for n, share in found.held.items())
            mark = f"  outside: {', '.join(wrong)}" if wrong else ""
            print(f"{row}  {shares}  refused {100 * found.refused:4.1f}{mark}", flush=True)
    print(f"{outside} outside {100 * RANGE[0]:g} to {100 * RANGE[1]:g} %")
    return int(outside > 0)


if __name__ == "__main__":
    sys.exit(main())
