"""Errors of the calibration of a cantilever in the interval of a modulus.

The force is k s V, with the spring constant k, the sensitivity s and the measured voltage V, and the depth is the height
minus the deflection s V. The modulus is proportional to k; its change with s is found by fits to curves with s increased
and decreased. Both errors are independent of the noise of the curve, so that in the logarithm of the modulus half an
interval w becomes

    (w^2 + z^2 (e_k^2 + (dlnG/dln s)^2 e_s^2))^(1/2)

with the relative standard deviations e and the quantile z of the level.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from fitting.fits.force_search import ApproachCurve
from fitting.inference import student
from fitting.inference.conclusion import FitProblem, with_intervals

STEP = 0.02  # relative change of the sensitivity in the difference quotient
KINDS = ("spring_constant", "sensitivity")


def check(errors: dict[str, float] | None, spring_constant: float | None) -> dict[str, float]:
    """Return the relative standard deviations; ValueError for unknown or bad ones."""
    for name, value in (errors or {}).items():
        if name not in KINDS:
            raise ValueError(f"errors: expected keys among {', '.join(KINDS)}, got {name!r}")
        if not (isinstance(value, int | float) and 0.0 <= value < 1.0):
            raise ValueError(
                f"errors[{name!r}]: expected a relative standard deviation from 0 to 1, got {value!r}"
            )
    if "sensitivity" in (errors or {}) and not (spring_constant or 0.0) > 0.0:
        raise ValueError(
            "spring_constant: expected the spring constant of the cantilever [N/m] with an error of the sensitivity,"
            f" got {spring_constant!r}"
        )
    return errors or {}


def calibrated(
    fields: dict[str, Any], problem: FitProblem, approach: ApproachCurve, errors: dict[str, float],
    spring_constant: float | None, modulus: Callable[[ApproachCurve], float],
) -> dict[str, Any]:  # fmt: skip
    """Return the fields of a fit that the errors of the calibration change; modulus: G [Pa] of another approach."""
    slope = 0.0
    if errors.get("sensitivity"):
        ends = [
            modulus(_scaled(approach, sign * STEP, float(spring_constant or 1.0))) for sign in (1.0, -1.0)
        ]
        slope = math.log(ends[0] / ends[1]) / math.log((1.0 + STEP) / (1.0 - STEP))
    total = math.hypot(errors.get("spring_constant", 0.0), slope * errors.get("sensitivity", 0.0))
    given = ", ".join(f"{name.replace('_', ' ')} {100 * value:.3g} %" for name, value in errors.items())
    return widened(fields, problem, total, f"calibration ({given})")


def widened(fields: dict[str, Any], problem: FitProblem, total: float, cause: str) -> dict[str, Any]:
    """Return the fields of a fit that a further standard deviation of log G, independent of the noise, changes."""
    if not total:
        return {}
    G, (low, high), z = fields["values"]["G"], fields["intervals"]["G"], student.two_sided(problem.level)
    grow = lambda ratio: (
        math.exp(math.hypot(math.log(ratio), z * total)) if 0.0 < ratio < math.inf else math.inf
    )
    intervals = {"G": (G / grow(G / low) if low > 0.0 else 0.0, G * grow(high / G))}
    note = f"the interval of the modulus includes the standard deviation of the {cause}, {100 * total:.3g} % of the modulus"
    estimate = fields["estimate"]
    covariance = estimate.covariance + np.diag((total * estimate.best) ** 2)  # of 1/G
    return {
        **with_intervals(problem, intervals, fields["refused"]),
        "estimate": estimate._replace(covariance=covariance),
        "sd_log": {"G": math.hypot(fields["sd_log"]["G"], total)},
        "notes": (*fields["notes"], note),
    }


def _scaled(approach: ApproachCurve, change: float, spring_constant: float) -> ApproachCurve:
    """Return the approach with a sensitivity that is larger by a relative change."""
    deflection = approach.load / spring_constant
    depth = approach.depth - change * (deflection - deflection[0])
    return approach._replace(load=approach.load * (1.0 + change), depth=depth)
