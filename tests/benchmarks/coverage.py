"""Coverage of the 95 % intervals of fits, from simulated data sets.

Curves of 60 points: creep, relaxation, both together, and the indentation of a half-space by a ball under constant load;
two models, ratios J0/J(T) of the instantaneous to the final compliance, five kinds of noise with a standard deviation of
1 %, and even and logarithmic times. The responses are computed here independently of the package. Further rows of creep have
few points ("8 points"), noise that is larger at the beginning ("falling" in proportion to the time, "stepped" from 3 % to
0.6 %), two joined runs with a common factor of 1 % each ("2 runs"), and a stated standard deviation that is a multiple of
the true one ("sigma x 0.5").

    python -m tests.benchmarks.coverage [--sets 400] [--only TEXT] [--seed 0] [--points 60] [-o FILE]

Every row has the coverage of each parameter's 95 % interval over the accepted fits, and the share of rejected ones. In
parentheses is the coverage, in the same data sets, of intervals that know the noise: of generalised least squares in the
linearised model with the true covariance. Its expectation is 95 %, so its deviation from that shows what chance has done.

A row is chosen by the beginning of its text; ``--only "sigma x 0.5"`` runs a single one. A wrong standard deviation must
also be named: the share of fits whose notes or verdict name it is printed.

The standard error of 400 sets is 1.1 %, so that some of the 492 coverages of the whole table are outside 92 to 98 % by
chance. Therefore a row of 400 sets with a coverage outside is repeated with 2000 fresh sets (1000 is added to the seed, so
that none of the first is among them). Both lines are printed, and the second one decides. Rows are printed, and with ``-o``
appended to a file, as soon as they are finished. The exit status is 1 if a coverage is outside 92 to 98 %.
"""

import argparse
import itertools
import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import fitting
import jaxcontact as jc
from fitting.inference.result import Fit

POINTS, SIZE, COMPLIANCE, DURATION = 60, 0.01, 1e-6, 100.0
SHARES = (2, 6, 21)  # J(T)/J0
NOISES = ("constant", "relative", "correlated", "mixed", "heavy-tailed")
RHO = 0.6
RADIUS, LOAD, NU = 1e-3, 1e-2, 0.3  # [m], [N]
RANGE = 0.92, 0.98
NORMAL = 1.959964  # 97.5 % quantile of the normal distribution
TOGETHER = "creep", "relaxation"
AGAIN, FRESH = 2000, 1000  # sets of a repeated row, and what is added to its seed


class Row(NamedTuple):
    """A case of the table."""

    model: str
    share: int
    noise: str
    times: str
    experiment: str = "creep"
    case: str = ""

    def __str__(self) -> str:
        case = f"{self.model:20s} 1/{self.share:<3d} {self.noise:13s} {self.times:5s}"
        case = case if self.experiment == "creep" else f"{self.experiment} {case}"
        return f"{self.case} {case}" if self.case else case

    @property
    def points(self) -> int | None:
        """Number of points of a short curve, None for that of the other rows."""
        return int(self.case.split()[0]) if self.case.endswith("points") else None

    @property
    def stated(self) -> float | None:
        """Stated over true standard deviation, None where none is stated."""
        return float(self.case.split()[-1]) if self.case.startswith("sigma") else None

    @property
    def runs(self) -> int:
        """Number of joined runs."""
        return int(self.case.split()[0]) if self.case.endswith("runs") else 1


class Covered(NamedTuple):
    """{parameter: share of the intervals that hold the truth}, the same of intervals that know the noise, share of fits
    refused, number of sets, and share of the fits whose notes or verdict name the stated sigma."""

    held: dict[str, float]
    known: dict[str, float]
    refused: float
    sets: int
    named: float = 0.0


def rows() -> Iterator[Row]:
    """All cases. Fits with relaxation are ten times as slow, and one model and two kinds of noise are enough of them."""
    models, when = ("StandardLinearSolid", "Burgers"), ("even", "log")
    for case in itertools.product(models, SHARES, NOISES, when):
        yield Row(*case)
    for case in itertools.product(models, SHARES, NOISES, when):
        yield Row(*case, "indentation")
    for case in itertools.product(models[:1], SHARES, NOISES[:2], when):
        yield Row(*case, "relaxation")
    for case in itertools.product(models[:1], SHARES, NOISES[:2], when):
        yield Row(*case, "together")
    solid = models[:1]
    for count, *case in itertools.product((6, 8, 10, 12), solid, SHARES[1:2], NOISES[:2], when):
        yield Row(*case, case=f"{count} points")
    for case in itertools.product(solid, SHARES[1:2], ("falling", "stepped"), when):
        yield Row(*case)
    for case in itertools.product(solid, SHARES[1:2], NOISES[1:2], when):
        yield Row(*case, case="2 runs")
    for factor, *case in itertools.product((0.5, 1, 2), solid, SHARES[1:2], NOISES[:1], when):
        yield Row(*case, case=f"sigma x {factor}")


def truth(row: Row) -> dict[str, float]:
    """Parameters [Pa, Pa s] with J(T) near ``COMPLIANCE``."""
    J0 = COMPLIANCE / row.share
    rest, tau = COMPLIANCE - J0, DURATION / 5.0
    flow = 0.4 if row.model == "Burgers" else 0.0
    J2 = (1.0 - flow) * rest / -np.expm1(-DURATION / tau)
    found = {"G1": 1.0 / J0, "G2": 1.0 / J2, "eta2": tau / J2}
    return found | ({"eta1": DURATION / (flow * rest)} if flow else {})


def times(row: Row, points: int = POINTS) -> np.ndarray:
    """(n,) [s]. The load of an indentation steps on at its first sample, which is one more, at zero."""
    points = row.points or points
    found = np.linspace(DURATION / points, DURATION, points)
    if row.times == "log":
        found = np.geomspace(1e-3 * DURATION, DURATION, points)
    found = np.append(0.0, found) if row.experiment == "indentation" else found
    return np.repeat(found[:: row.runs], row.runs)


def creep(t: np.ndarray, G1: float, G2: float, eta2: float, eta1: float = np.inf) -> np.ndarray:
    """J(t) [1/Pa]."""
    return 1.0 / G1 - np.expm1(-t * G2 / eta2) / G2 + t / eta1


def relaxation(t: np.ndarray, G1: float, G2: float, eta2: float) -> np.ndarray:
    """G(t) [Pa] of a standard linear solid."""
    final = G1 * G2 / (G1 + G2)
    return final + (G1 - final) * np.exp(-t * (G1 + G2) / eta2)


def response(kind: str, t: np.ndarray, material: dict[str, float]) -> np.ndarray:
    """J(t) [1/Pa], G(t) [Pa], or the depth [m] of a ball: d^(3/2) = 3 (1 - nu) J(t) P/(8 R^(1/2)) (Lee and Radok)."""
    if kind == "relaxation":
        return relaxation(t, **material)
    J = creep(t, **material)
    return J if kind == "creep" else (3 * (1 - NU) * J * LOAD / (8 * np.sqrt(RADIUS))) ** (2 / 3)


def curves(row: Row, t: np.ndarray, **material: float) -> list[np.ndarray]:
    """The responses that are fitted together, one except in the rows of that name; of the true material, except for the
    parameters given."""
    kinds = TOGETHER if row.experiment == "together" else (row.experiment,)
    return [response(kind, t, truth(row) | material) for kind in kinds]


def fit(row: Row, t: np.ndarray, y: np.ndarray, *others: np.ndarray) -> Fit:
    """The fit of a curve, or of creep and relaxation."""
    if others:
        tests = fitting.CreepData(t=t, J=y), fitting.RelaxationData(t=t, modulus=others[0])
        return fitting.fit_together(tests, row.model)
    if row.experiment == "creep":
        sigma = (
            None
            if row.stated is None
            else row.stated * deviation(row.noise, response("creep", t, truth(row)))
        )
        return fitting.fit_creep(fitting.CreepData(t=t, J=y, start=0.0), row.model, sigma=sigma)
    if row.experiment == "relaxation":
        return fitting.fit_relaxation(fitting.RelaxationData(t=t, modulus=y), row.model)
    data = fitting.IndentationData(t=t, load=np.full(t.size, LOAD), depth=y)
    return fitting.fit_indentation(
        data, row.model, indenter=jc.Sphere(radius=RADIUS), nu=NU, weights="estimated"
    )


def deviation(kind: str, J: np.ndarray) -> np.ndarray:
    """Standard deviations (n,) [1/Pa] of the errors: 1 % of the largest J, 1 % of J, or both; or 3 % of J at first and
    0.6 % at last."""
    largest = float(J.max())
    if kind in ("constant", "heavy-tailed"):
        return np.full(J.size, SIZE * largest)
    if kind in ("falling", "stepped"):
        place = np.arange(J.size) / (J.size - 1.0)
        return J * (0.03 * 0.2**place if kind == "falling" else np.where(place < 1 / 3, 0.03, 0.006))
    return SIZE * (np.hypot(0.2 * largest, J) if kind == "mixed" else J)


def noise(kind: str, J: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Errors (n,) [1/Pa]: white, or an AR(1) series of correlation ``RHO``."""
    white = rng.standard_normal(J.size)
    if kind == "heavy-tailed":  # Student's t of 5 degrees of freedom, of unit variance
        white = rng.standard_t(5.0, J.size) * np.sqrt(3.0 / 5.0)
    if kind == "correlated":
        for i in range(1, J.size):
            white[i] = RHO * white[i - 1] + np.sqrt(1.0 - RHO**2) * white[i]
    return deviation(kind, J) * white


def noisy(kind: str, clean: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A response with errors, all of whose values are positive."""
    found = np.zeros(1)
    while np.any(found <= 0.0):
        found = clean + noise(kind, clean, rng)
    return found


def linearised(row: Row, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The estimator of log parameters with the true covariance of the noise (p, n), and its standard errors (p,)."""
    clean, true, ln = curves(row, t), truth(row), 1e-5
    ends = [
        [np.concatenate(curves(row, t, **{name: value * np.exp(way * ln)})) for way in (-1.0, 1.0)]
        for name, value in true.items()
    ]
    slopes = np.stack([(up - down) / (2.0 * ln) for down, up in ends], -1)
    lags = np.abs(np.subtract.outer(np.arange(t.size), np.arange(t.size)))
    correlation = RHO**lags if row.noise == "correlated" else np.eye(t.size)
    sd = np.concatenate([deviation(row.noise, one) for one in clean])
    whole = np.kron(np.eye(len(clean)), correlation) * np.outer(sd, sd)
    if row.runs > 1:
        together = np.subtract.outer(np.arange(t.size), np.arange(t.size)) % row.runs == 0
        whole = whole + SIZE**2 * np.outer(clean[0], clean[0]) * together
    inverse = np.linalg.inv(whole)
    covariance = np.linalg.inv(slopes.T @ inverse @ slopes)
    return covariance @ slopes.T @ inverse, np.sqrt(np.diag(covariance))


def covered(row: Row, sets: int, seed: int = 0, points: int = POINTS) -> Covered:
    """Return the coverage of a row from a number of simulated curves."""
    t, true = times(row, points), truth(row)
    clean, held, known, refused, index = curves(row, t), [], [], 0, list(rows()).index(row)
    named = 0
    estimator, error = linearised(row, t)
    for k in range(sets):
        rng = np.random.default_rng([seed, index, k])
        measured = [noisy(row.noise, one, rng) for one in clean]
        if row.runs > 1:
            factor = 1.0 + SIZE * rng.standard_normal(row.runs)
            measured = [one + (np.tile(factor, t.size // row.runs) - 1.0) * clean[0] for one in measured]
        found = fit(row, t, *measured)
        refused += bool(found.refused)
        named += any("stated sigma" in words for words in (*found.refused, *found.notes))
        if not found.refused:
            held.append([found.intervals[n][0] <= v <= found.intervals[n][1] for n, v in true.items()])
            off = estimator @ (np.concatenate(measured) - np.concatenate(clean))
            known.append(np.abs(off) <= NORMAL * error)
    shares = [dict(zip(true, np.mean(x, axis=0).tolist(), strict=True)) for x in (held, known)]
    return Covered(*shares, refused / sets, sets, named / sets)


def line(row: Row, found: Covered) -> tuple[str, int]:
    """Return a line of the table, and the number of its values that are outside the range."""
    wrong = [n for n, share in found.held.items() if not RANGE[0] <= share <= RANGE[1]]
    shares = "  ".join(f"{n} {100 * x:5.1f} ({100 * found.known[n]:4.1f})" for n, x in found.held.items())
    mark = f"  outside: {', '.join(wrong)}" if wrong else ""
    named = "" if row.stated is None else f"  sigma named {100 * found.named:5.1f}"
    return f"{row}  {shares}  rejected {100 * found.refused:4.1f}{named}{mark}", len(wrong)


def tell(text: str, path: str | None) -> None:
    """Print a line, and append it to a file if there is one."""
    print(text, flush=True)
    if path:
        with open(path, "a") as file:
            print(text, file=file)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=400, help="simulated curves of each row")
    parser.add_argument("--only", default="", help="rows whose text begins with this")
    parser.add_argument("--seed", type=int, default=0, help="of the noise")
    parser.add_argument("--points", type=int, default=POINTS, help="of a curve")
    parser.add_argument("-o", "--output", help="file to which finished rows are appended")
    options, outside = parser.parse_args(), 0
    plain = lambda text: " ".join(text.split())
    chosen = [row for row in rows() if plain(str(row)).startswith(plain(options.only))]
    if not chosen:
        parser.error(
            f"--only: expected the beginning of a row such as {plain(str(next(rows())))!r}, got {options.only!r}"
        )
    error = 100.0 * np.sqrt(0.95 * 0.05 / options.sets)
    print(f"coverage of 95 % intervals [%], {options.sets} sets a row: standard error {error:.1f}")
    for row in chosen:
        text, wrong = line(row, covered(row, options.sets, options.seed, options.points))
        tell(text, options.output)
        if wrong and options.sets < AGAIN:
            text, wrong = line(row, covered(row, AGAIN, options.seed + FRESH, options.points))
            tell(f"{text}  (repeated with {AGAIN} fresh sets)", options.output)
        outside += wrong
    print(f"{outside} outside {100 * RANGE[0]:g} to {100 * RANGE[1]:g} %")
    return int(outside > 0)


if __name__ == "__main__":
    sys.exit(main())
