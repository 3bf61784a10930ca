"""How often the intervals of ``fitting.fit_master`` hold the truth.

Simulated storage and loss moduli of a polymer melt at seven temperatures, 16 frequencies each, with an error relative to
|G*|; creep compliances and relaxation moduli at the same temperatures. The moduli are sums over a power law of relaxation
times, and the shift factors are written here again.

    python -m tests.benchmarks.master_coverage [--sets 200] [--only TEXT]

Every row has the coverage of the 95 % intervals of the parameters and of a shift factor without a law, over the accepted
fits, and the share of rejected ones. The exit status is 1 if a coverage is outside 88 to 99 %: with vertical factors, on
moduli that are nearly a power of the frequency, shifts along both axes are nearly alike, and the intervals are too short.
"""

import argparse
import sys

import numpy as np

import fitting

TEMPERATURES = (380.0, 390.0, 400.0, 410.0, 420.0, 430.0, 440.0)  # K
REFERENCE = 400.0
TRUTH = {"WLF": {"c1": 8.0, "c2": 100.0}, "Arrhenius": {"activation_energy": 3.2e-19}}
TAU = np.geomspace(1e-4, 1e2, 25)  # s
G = 1e5 * TAU**-0.3  # Pa
ROWS = {
    "WLF, oscillation, 2 %": ("WLF", "oscillation", 0.02, False),
    "WLF, oscillation, vertical": ("WLF", "oscillation", 0.02, True),
    "Arrhenius, oscillation, 1 %": ("Arrhenius", "oscillation", 0.01, False),
    "WLF, relaxation, 1 %": ("WLF", "relaxation", 0.01, False),
}
RANGE = 0.88, 0.99


def shift(law: str, T: float) -> float:
    """Shift factor a_T of the laws of ``TRUTH``."""
    if law == "WLF":
        return 10.0 ** (-8.0 * (T - REFERENCE) / (100.0 + T - REFERENCE))
    return float(np.exp(3.2e-19 / 1.380649e-23 * (1.0 / T - 1.0 / REFERENCE)))


def simulated(law: str, kind: str, noise: float, lifted: bool, rng: np.random.Generator) -> list:
    """Return a curve with errors at every temperature; lifted: moduli in proportion to the temperature."""
    found = []
    for T in TEMPERATURES:
        a, b = shift(law, T), T / REFERENCE if lifted else 1.0
        omega = np.geomspace(0.1, 100.0, 16)
        error = 1.0 + noise * rng.standard_normal(16)
        if kind == "relaxation":
            t = 1.0 / omega[::-1]
            modulus = b * np.exp(-t[:, None] / (a * TAU)) @ G * error
            found.append(fitting.RelaxationData(t, modulus, temperature=T))
            continue
        s = 1j * a * omega[:, None] * TAU
        complex_modulus = b * (s / (1.0 + s)) @ G * (error + 1j * noise * rng.standard_normal(16))
        found.append(
            fitting.OscillationData(omega, complex_modulus.real, complex_modulus.imag, temperature=T)
        )
    return found


def covered(row: str, sets: int, seed: int = 0) -> tuple[dict[str, float], float]:
    """Return {quantity: share of the intervals that hold the truth} and the share of fits refused."""
    law, kind, noise, vertical = ROWS[row]
    held, refused, place = [], 0, TEMPERATURES.index(430.0)
    for k in range(sets):
        data = simulated(law, kind, noise, vertical, np.random.default_rng([seed, k]))
        fit = fitting.fit_master(data, law, reference=REFERENCE, vertical=vertical)
        if fit.refused:
            refused += 1
            continue
        ends = fit.intervals | {"a(430 K)": tuple(fit.factors[place, 1:])}
        truth = TRUTH[law] | {"a(430 K)": shift(law, 430.0)}
        held.append({name: low <= truth[name] <= high for name, (low, high) in ends.items()})
    return {name: float(np.mean([one[name] for one in held])) for name in held[0]}, refused / sets


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--only", default="")
    options, wrong = parser.parse_args(), 0
    for row in (row for row in ROWS if options.only in row):
        held, refused = covered(row, options.sets)
        wrong += sum(not RANGE[0] <= share <= RANGE[1] for share in held.values())
        shares = ", ".join(f"{name} {100 * share:.1f} %" for name, share in held.items())
        print(f"{row}: {shares}; rejected {100 * refused:.1f} %", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
