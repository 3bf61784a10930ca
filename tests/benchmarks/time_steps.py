"""The estimate of the error of the time steps against runs with 64 steps in the place of each.

    python -m tests.benchmarks.time_steps
    python -m tests.benchmarks.time_steps --random 60     # contacts drawn at random, half an hour
    python -m tests.benchmarks.time_steps --sway 40       # slides whose velocity changes, three minutes
    python -m tests.benchmarks.time_steps --shear 24      # contacts in partial slip, eight minutes

A row has the true error of approach, load and the pressure of any cell, the largest estimate, their ratio, whether a time
has status 12, and what ``jaxcontact check`` foretells from the rates of the top material and the times. The reference
shares the march with the run that it judges, but not the estimate; the foretold error shares nothing with either. Of random
contacts the true error is the largest one of the pressure of any cell, from ``FINER_RANDOM`` steps for each; in partial
slip that of the tangential load and displacement counts too, and that of the traction of any cell is given beside it.
"""

import argparse
import warnings

import numpy as np

import jaxcontact as jc
from jaxcontact.response.stack import surface_creep
from jaxcontact.shell.advice import foretold_step_error
from tests.support.time_steps import (
    cases,
    error_of_totals,
    error_of_traction,
    largest_error,
    random_case,
    reference,
    sheared_case,
    swaying_case,
    true_error,
)

FINER_RANDOM = 16
SMALL = 1e-3  # a true error below this has no ratio


def foretold(case):
    """Return the error that is foretold for the top material that creeps."""
    solids = [*(layer.material for layer in case.body.layers), case.body.substrate]
    material = next(solid for solid in solids if not isinstance(solid, jc.Elastic))
    loaded = case.approach is None
    times = np.asarray(case.times, float)
    values = np.broadcast_to(np.asarray(case.load if loaded else case.approach, float), times.shape)
    return foretold_step_error(surface_creep(material), times, values, loaded)


def drawn(draw, count):
    """Print the errors of contacts drawn at random, and quantiles of the ratio of the estimate to the true error."""
    ratios = []
    for seed in range(count):
        case = draw(seed)
        coarse, fine = case.run(), case.run(substeps=FINER_RANDOM)
        true, found = largest_error(coarse, fine), float(np.max(coarse.time_step_error))
        others = np.setdiff1d(np.unique(np.concatenate([coarse.status, fine.status])), [0, 3, 12])
        failed = "  status " + ", ".join(map(str, others)) if others.size else ""
        if case.push is not None:
            true = max(true, error_of_totals(coarse, fine))
            failed = f"  traction {error_of_traction(coarse, fine):.1e}" + failed
        print(f"{case.name:70s} {true:8.1e} {found:8.1e} {found / max(true, 1e-12):8.2f}{failed}", flush=True)
        if true > SMALL and not others.size:
            ratios.append(found / true)
    print("quantiles 5, 25, 50, 75, 95 %:", np.round(np.quantile(ratios, [0.05, 0.25, 0.5, 0.75, 0.95]), 2))


def main():
    """Print the table."""
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--random", type=int, metavar="N", help="N contacts drawn at random in the place of the list"
    )
    parser.add_argument("--sway", type=int, metavar="N", help="N slides whose velocity changes, likewise")
    parser.add_argument("--shear", type=int, metavar="N", help="N contacts in partial slip, likewise")
    options = parser.parse_args()
    drawings = (random_case, options.random), (swaying_case, options.sway), (sheared_case, options.shear)
    for draw, count in drawings:
        if count is not None:
            return drawn(draw, count)
    print(f"{'case':42s} {'true':>8s} {'estimate':>8s} {'ratio':>6s} {'status':>6s} {'foretold':>8s}")
    for case in cases():
        coarse, fine = case.run(), reference(case)
        true, found = true_error(coarse, fine), float(np.max(coarse.time_step_error))
        others = np.setdiff1d(np.unique(np.concatenate([coarse.status, fine.status])), [0, 3, 9, 12])
        failed = "  status " + ", ".join(map(str, others)) if others.size else ""
        status = "12" if np.any(coarse.status == jc.Status.STEP_TOO_LONG) else "0"
        row = (
            f"{case.name:42s} {true:8.1e} {found:8.1e} {found / true:6.2f} {status:>6s} {foretold(case):8.1e}"
        )
        print(row + failed, flush=True)


if __name__ == "__main__":
    main()
