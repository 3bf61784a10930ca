"""Coverage of the intervals of fits of the work of adhesion, for attractions of short and of finite range.

python -m tests.benchmarks.adhesion_coverage [SETS]
"""

import sys

import numpy as np

import fitting
import jaxcontact as jc
from jaxcontact.reference import maugis
from tests.support.force_curves import NU, RADIUS, SHIFT, WORK, E, G, force_curve

CASES = {  # lambda, the model that is fitted, the contact point
    "JKR by JKR": (None, "JKR", "fit"),
    "lambda = 1, contact point known": (1.0, "fit", SHIFT),
    "lambda = 1, contact point fitted": (1.0, "fit", "fit"),
    "lambda = 0.3, contact point fitted": (0.3, "fit", "fit"),
    "JKR by Maugis, contact point fitted": (None, "fit", "fit"),
}


def covered(parameter, model, contact_point, seed):
    """Whether the intervals contain the truth: G, work and, for a finite range, strength."""
    given = {"indenter": jc.Sphere(RADIUS), "nu": NU, "control": "depth", "contact_point": contact_point}
    fit = fitting.fit_indentation(force_curve(parameter, seed=seed), "Elastic", adhesion=model, **given)
    truth = {"G": G, "work": WORK}
    if parameter is not None:
        truth["strength"] = maugis.strength(parameter, WORK, RADIUS, E)
    inside = {
        name: fit.intervals[name][0] <= value <= fit.intervals[name][1] for name, value in truth.items()
    }
    return inside | {
        "accepted": fit.verdict == "accepted",
        "range identified": fit.identified.get("strength", False),
    }


def main(sets):
    for name, case in CASES.items():
        rows = [covered(*case, seed) for seed in range(sets)]
        shares = {key: 100.0 * np.mean([row[key] for row in rows]) for key in rows[0]}
        print(f"{name}: " + ", ".join(f"{key} {share:.1f} %" for key, share in shares.items()), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
