"""Coverage of the 95 % intervals of viscoelastic fits to approach and retraction of force curves.

    python -m tests.benchmarks.force_history_coverage [--sets 60] [--seed 0] [--only WORDS] [--hold] [-o FILE]

The curves are quadratures of Ting's integrals (``tests/support/ting_curves.py``) for a ball and a cone, three models, and
times of approach from 0.1 to 10 relaxation times (of the fractional laws, of one second). They have a baseline before and
after the contact that drifts, and noise of 1 % of the largest load. Contact point and baseline are fitted with the material.
With ``--hold`` the tip stays at the largest depth for twice the time of the approach, and there is no retraction.

Every row has for each parameter the share of the intervals that hold the truth, that of the intervals that are closed, and
the median of their half width in percent; then the share of the sets in which all intervals hold (0.95^3 = 86 % for three
independent ones), that of rejected fits, and the seconds of a fit.
"""

import argparse
import itertools
import json
import time
from pathlib import Path

import numpy as np

import fitting
import jaxcontact as jc
from tests.support import ting_curves

RADIUS, ANGLE, DEEP, NU, POINTS, NOISE = 5e-6, 1.0, 1e-6, 0.5, 200, 0.01
TIPS = {
    "ball": (jc.Sphere(RADIUS), 1.5, 8.0 * np.sqrt(RADIUS) / 3.0),
    "cone": (jc.Cone(ANGLE), 2.0, 4.0 * np.tan(ANGLE) / np.pi),
}
# parameters, relaxation modulus, and the power 1/(1 - alpha) of its quadrature
SLS = {"G1": 2000.0, "G2": 2000.0, "eta2": 4000.0}  # G0 = 2 kPa, Ginf = 1 kPa, relaxation time 1 s
KELVIN_VOIGT = {"G": 500.0, "V": 1000.0, "alpha": 0.3}
SPRINGPOT = {"V": 1000.0, "alpha": 0.2}
MODELS = {
    "StandardLinearSolid": (SLS, ting_curves.solid(2000.0, 1000.0, 1.0), 1.0),
    "FractionalKelvinVoigt": (KELVIN_VOIGT, ting_curves.kelvin_voigt(500.0, 1000.0, 0.3), 1.0 / 0.7),
    "Springpot": (SPRINGPOT, ting_curves.kelvin_voigt(0.0, 1000.0, 0.2), 1.0 / 0.8),
}
APPROACHES = (0.1, 1.0, 10.0)  # [s]


def clean(model: str, tip: str, turn: float, hold: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s], depths [m] and forces [N] of a curve in contact for ``turn`` [s], which then goes back or holds."""
    (_, p, size), (_, G, power) = TIPS[tip], MODELS[model]
    before, slope = 0.8 * turn, ting_curves.half_space(size, p, NU)
    if hold:
        t = np.linspace(0.0, before + 3.0 * turn, POINTS)
        depth = DEEP * np.minimum((t - before) / turn, 1.0)
        return t, depth, ting_curves.held(t - before, G, DEEP, turn, slope, power)
    t = np.linspace(0.0, 2.0 * (turn + before), POINTS)
    since = t - before
    depth = DEEP * np.where(since < turn, since / turn, 2.0 - since / turn)
    return t, depth, ting_curves.force(since, G, DEEP, turn, slope, power)


def row(model: str, tip: str, turn: float, sets: int, seed: int, hold: bool, kept: Path | None) -> str:
    """Return a row of the results, with the sets that ``kept`` holds, and add the others to it."""
    t, depth, force = clean(model, tip, turn, hold)
    truth, top = MODELS[model][0], force.max()
    lines = kept.read_text().splitlines() if kept and kept.exists() else []
    known = {tuple(one.pop("set")): one for one in map(json.loads, lines)}
    held, closed, widths, refused, spent = [], [], [], 0, 0.0
    for k in range(sets):
        place = (tip, model, turn, hold, seed, k)
        if place not in known:
            noise = NOISE * top * np.random.default_rng([seed, k]).standard_normal(t.size)
            data = fitting.IndentationData(
                t=t, load=force + noise + top * (0.1 + 0.02 * t / t[-1]), depth=depth
            )
            begun = time.process_time()
            fit = fitting.fit_force(data, indenter=TIPS[tip][0], nu=NU, model=model)
            known[place] = {
                "ends": [[float(end) for end in fit.intervals[name]] for name in truth],
                "rejected": bool(fit.refused), "seconds": time.process_time() - begun,
            }  # fmt: skip
            if kept:
                with kept.open("a") as file:
                    file.write(json.dumps({"set": place, **known[place]}) + "\n")
        one = known[place]
        ends, values = np.array(one["ends"]), np.array(list(truth.values()))
        refused, spent = refused + one["rejected"], spent + one["seconds"]
        held.append((ends[:, 0] <= values) & (values <= ends[:, 1]))
        closed.append((ends[:, 0] > 0.0) & np.isfinite(ends[:, 1]))
        widths.append(50.0 * (ends[:, 1] - ends[:, 0]) / values)
    rows = zip(truth, np.mean(held, 0), np.mean(closed, 0), np.median(widths, 0), strict=True)
    parts = [
        f"{n}: held {100 * h:.1f} %, closed {100 * c:.0f} %, half width {w:.2g} %" for n, h, c, w in rows
    ]
    parts.append(f"all held {100.0 * np.mean(np.all(held, 1)):.1f} %")
    return f"{'; '.join(parts)}; rejected {100.0 * refused / sets:.1f} %; {spent / sets:.2f} s a fit"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="rows whose name has these words")
    parser.add_argument("--hold", action="store_true", help="approach and hold")
    parser.add_argument(
        "-o", type=Path, metavar="FILE", help="keeps the fits, and those it has are not made again"
    )
    options = parser.parse_args()
    for tip, model, turn in itertools.product(TIPS, MODELS, APPROACHES):
        name = f"{tip}, {model}, approach of {turn:g} s{' and hold' if options.hold else ''}"
        if all(word in name for word in options.only.split()):
            found = row(model, tip, turn, options.sets, options.seed, options.hold, options.o)
            print(f"{name}: {found}", flush=True)


if __name__ == "__main__":
    main()
