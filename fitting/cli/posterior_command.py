"""The command ``jaxcontact fit posterior``: draws from the posterior of the parameters of a fit."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from fitting.after.posterior import draw, posterior
from fitting.cli import flags, kinds
from fitting.views import output
from fitting.views.text import in_flags

FILES = ("posterior.csv", "posterior.png")


def add_posterior(parser: Any) -> None:
    """Add the flags of ``fit posterior`` beyond those of the fit."""
    parser.add_argument(
        "--samples", type=int, default=1000, metavar="N", help="draws of each of four chains (1000)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="K", help="of the random numbers (0)")


def run(options: argparse.Namespace) -> int:
    """Fit the curve, draw from the posterior, print the intervals of both, and write them."""
    options = kinds.checked(options)
    output.check_directory(options, (*output.RESULTS, *FILES))
    fit = kinds.fitted(options, options.file)
    with flags.about(options.file):
        found = posterior(fit, samples=options.samples, seed=options.seed)
    print(in_flags(fit.summary()))
    print(found.summary())
    output.leave(fit, options.directory, {"file": Path(options.file).name, "posterior": _plain(found)})
    units = {name: fit.structure.unit(name) for name in found.samples}
    header = ",".join(f"{name} [{unit}]" for name, unit in units.items())
    rows = np.column_stack(list(found.samples.values()))
    save = lambda path: np.savetxt(path, rows, delimiter=",", header=header, comments="")
    output.write(options.directory / FILES[0], save)
    figure = draw(found, units, fit.intervals, fit.level)
    output.write(options.directory / FILES[1], lambda path: figure.savefig(path, dpi=150, format="png"))
    print(f"in {options.directory}: {', '.join(FILES)}, and summary.json, curve.csv, fit.png of the fit")
    return 0


def _plain(found: Any) -> dict[str, Any]:
    """Return the intervals and the measures of mixing for JSON."""
    key = found.fit.structure.key
    return {
        "medians": {key(name): value for name, value in found.medians.items()},
        "intervals": {key(name): list(ends) for name, ends in found.intervals.items()},
        "prior": {key(name): list(ends) for name, ends in found.prior.items()},
        "not_bounded_by_the_data": list(found.open), "r_hat": dict(found.r_hat),
        "effective_draws": dict(found.ess), "divergent": found.divergent,
    }  # fmt: skip
