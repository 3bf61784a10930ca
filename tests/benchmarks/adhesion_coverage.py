"""Coverage of the intervals of fits of the work of adhesion, for attractions of short and of finite range.

python -m tests.benchmarks.adhesion_coverage [SETS [PART OF THE NAME]]
"""

import sys

import numpy as np

import fitting
import jaxcontact as jc
from jaxcontact.reference import maugis
from tests.support.force_curves import NU, RADIUS, SHIFT, UNITS, WORK, E, G, branch, force_curve

CASES = {  # lambda, the model that is fitted, the contact point, noise over the pull-off force
    "JKR by JKR": (None, "JKR", "fit"),
    "JKR by JKR, noise of 2 %": (None, "JKR", "fit", 0.02),
    "JKR by JKR, noise of 5 %": (None, "JKR", "fit", 0.05),
    "JKR by JKR, noise of 8 %": (None, "JKR", "fit", 0.08),
    "lambda = 1, contact point known": (1.0, "fit", SHIFT),
    "lambda = 1, contact point fitted": (1.0, "fit", "fit"),
    "lambda = 0.3, contact point fitted": (0.3, "fit", "fit"),
    "JKR by Maugis, contact point fitted": (None, "fit", "fit"),
}


def covered(parameter, model, contact_point, noise, seed):
    """Whether the intervals contain the truth: G, work, the pull-off force and, for a finite range, strength."""
    approach, load = branch(parameter)
    pull_off, tension = -float(load.min()), np.minimum(load, 0.0)
    given = {"indenter": jc.Sphere(RADIUS), "nu": NU, "control": "depth", "contact_point": contact_point}
    curve = force_curve(parameter, noise=noise * pull_off, seed=seed)
    fit = fitting.fit_indentation(curve, "Elastic", adhesion=model, **given)
    truth = {"G": G, "work": WORK}
    if parameter is not None:
        truth["strength"] = maugis.strength(parameter, WORK, RADIUS, E)
    inside = {
        name: fit.intervals[name][0] <= value <= fit.intervals[name][1] for name, value in truth.items()
    }
    for name, (_, low, high), value in (
        ("pull-off force", fit.pull_off, pull_off * UNITS.load),
        (
            "work of separation",
            fit.separation_work,
            -np.trapezoid(tension, approach) * UNITS.load * UNITS.approach,
        ),
    ):
        inside[name] = low <= value <= high
    return inside | {
        "accepted": fit.verdict == "accepted",
        "range identified": fit.identified.get("strength", False),
    }


def main(sets, only=""):
    for name, case in CASES.items():
        if only not in name:
            continue
        parameter, model, point, noise = (*case, 0.01 / 1.5)[:4]
        rows = [covered(parameter, model, point, noise, seed) for seed in range(sets)]
        shares = {key: 100.0 * np.mean([row[key] for row in rows]) for key in rows[0]}
        print(f"{name}: " + ", ".join(f"{key} {share:.1f} %" for key, share in shares.items()), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200, *sys.argv[2:3])
