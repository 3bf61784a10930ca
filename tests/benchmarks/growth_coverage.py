"""How often the intervals of ``fitting.fit_growth`` hold the truth.

Simulated growth of a film at three stresses and three temperatures, five curves of 20 points each, with a constant or a
relative error, fitted with the default weights and with those that match the error. The closed form is written here again.

    python -m tests.benchmarks.growth_coverage [--sets 400] [--only TEXT]

Every row has the coverage of each parameter's 95 % interval, and of that of the growth rate at the mean conditions, over
the accepted fits, and the share of rejected ones. The exit status is 1 if a coverage is outside 92 to 98 %.
"""

import argparse
import sys

import numpy as np

import fitting

# stress [Pa], temperature [K]
CONDITIONS = (
    (3e8, 353.0),
    (6e8, 353.0),
    (9e8, 353.0),
    (3e8, 373.0),
    (3e8, 393.0),
)
TRUTH = {"rate": 1e-2, "activation_energy": 1.2e-19, "activation_volume": 4e-30, "removal_rate": 5e-4}
T = np.linspace(360.0, 7200.0, 20)  # s
ROWS = {  # kind of the errors, weights, true induction time [s], the one of the fit
    "constant, estimated": ("constant", None, 0.0, None),
    "relative, estimated": ("relative", None, 0.0, None),
    "constant, absolute": ("constant", "absolute", 0.0, None),
    "relative, relative": ("relative", "relative", 0.0, None),
    "induction 900 s, fitted": ("constant", "absolute", 900.0, "fit"),
    "induction 900 s, estimated": ("constant", None, 900.0, "fit"),
    "induction 900 s, left out": ("constant", "absolute", 900.0, None),
}
SIZE = {"constant": 0.005, "relative": 0.03}  # of the greatest thickness of all curves, or of each point
RANGE = 0.92, 0.98


def growth_rate(stress: float, temperature: float) -> float:
    """Growth rate without removal [m/s]."""
    energy = TRUTH["activation_energy"] - TRUTH["activation_volume"] * stress
    return TRUTH["rate"] * np.exp(-energy / (1.380649e-23 * temperature))


def simulated(kind: str, rng: np.random.Generator, induction: float = 0.0) -> list[fitting.GrowthData]:
    """Return five curves with their errors."""
    removal, since = TRUTH["removal_rate"], np.maximum(T - induction, 0.0)
    grown = [growth_rate(*one) / removal * -np.expm1(-removal * since) for one in CONDITIONS]
    largest = max(float(h[-1]) for h in grown)
    curves = []
    for (stress, temperature), h in zip(CONDITIONS, grown, strict=True):
        error = SIZE[kind] * (largest if kind == "constant" else h) * rng.standard_normal(T.size)
        curves.append(fitting.GrowthData(T, h + error, stress=stress, temperature=temperature))
    return curves


def covered(row: str, sets: int, seed: int = 0) -> tuple[dict[str, float], float]:
    """Return {quantity: share of the intervals that hold the truth} and the share of fits refused."""
    kind, weights, induction, sought = ROWS[row]
    held, refused = [], 0
    for k in range(sets):
        rng = np.random.default_rng([seed, list(ROWS).index(row), k])
        fit = fitting.fit_growth(simulated(kind, rng, induction), weights=weights, induction=sought)
        refused += bool(fit.refused)
        if not fit.refused:
            _, low, high = fit.growth_rate()
            inside = {
                name: fit.intervals[name][0] <= v <= fit.intervals[name][1] for name, v in TRUTH.items()
            }
            inside["growth rate"] = low <= growth_rate(*fit.reference) <= high
            if sought is not None:
                inside["induction"] = fit.induction[1] <= induction <= fit.induction[2]
            held.append(inside)
    names = held[0] if held else ()
    return {name: float(np.mean([one[name] for one in held])) for name in names}, refused / sets


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=400, help="simulated experiments of each row")
    parser.add_argument("--only", default="", help="rows whose text contains this")
    options, outside = parser.parse_args(), 0
    error = 100.0 * np.sqrt(0.95 * 0.05 / options.sets)
    print(f"coverage of 95 % intervals [%], {options.sets} sets a row: standard error {error:.1f}")
    for row in ROWS:
        if options.only in row:
            found, refused = covered(row, options.sets)
            wrong = [name for name, share in found.items() if not RANGE[0] <= share <= RANGE[1]]
            outside += len(wrong)
            shares = "  ".join(f"{name} {100 * share:5.1f}" for name, share in found.items())
            mark = f"  outside: {', '.join(wrong)}" if wrong else ""
            print(f"{row:20s}  {shares}  refused {100 * refused:4.1f}{mark}", flush=True)
    print(f"{outside} outside {100 * RANGE[0]:g} to {100 * RANGE[1]:g} %")
    return int(outside > 0)


if __name__ == "__main__":
    sys.exit(main())
