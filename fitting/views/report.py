"""Lines of text that report a ``Fit`` of any kind."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

WIDER = 1.05  # widening of the intervals above which it is reported
CLEAR = 1.5  # mean square of the residuals of a third over that of any other, above which a trend has its place there
PLACES = {
    "s": ("short times", "intermediate times", "long times"),
    "rad/s": ("low frequencies", "intermediate frequencies", "high frequencies"),
    "m": ("small depths", "intermediate depths", "large depths"),
}  # by the unit of the abscissa
ENOUGH = 4.0  # duration over the longest retardation time above which flow and retardation are separable


def counted(notes: Iterable[tuple[str, str]], total: int) -> list[str]:
    """Return a line for each kind of note on ``total`` curves, with their number and the first; notes: (kind, note)."""
    kinds: dict[str, list[str]] = {}
    for kind, note in notes:
        kinds.setdefault(kind, []).append(note)
    return [f"{len(found)} of {total} curves, first: {found[0]}" for found in kinds.values()]


def parameter(fit: Any, name: str) -> str:
    """Return the line of a parameter with its interval, best value and status."""
    unit, value, (low, high) = fit.structure.unit(name), fit.values[name], fit.intervals[name]
    percent = f"{100 * fit.level:g} %"
    if name in fit.fixed:
        return f"  {name:5s} = {value:11.5g} {unit:5s} fixed"
    if fit.identified[name]:
        return f"  {name:5s} = {value:11.5g} {unit:5s} {percent} interval {_apart(low, high)}"
    # a parameter of a rejected model is something else than one that the data leave open
    word = "rejected" if fit.refused else "not identifiable"
    return f"  {name:5s} {word}: {span(low, high, unit)} ({percent}); best {value:.5g} {unit}".rstrip()


def _apart(low: float, high: float) -> str:
    """Return an interval as text, with five digits or as many, up to ten, as its ends differ by."""
    texts = ((f"{low:.{digits}g}", f"{high:.{digits}g}") for digits in range(5, 11))
    return " to ".join(next((pair for pair in texts if pair[0] != pair[1]), (f"{low:.5g}", f"{high:.5g}")))


def span(low: float, high: float, unit: str = "") -> str:
    """Return an interval as text with its unit and without its open sides; "any value" has no unit."""
    if low == 0 and math.isinf(high):
        return "any value"
    if low > 0 and math.isinf(high):
        text = f"> {low:.4g}"
    elif low == 0 and math.isfinite(high):
        text = f"< {high:.4g}"
    else:
        text = f"{low:.4g} to {high:.4g}"
    return f"{text} {unit}".rstrip()


def separation(fit: Any) -> list[str]:
    """Return lines on the duration relative to the retardation times, and on the weakest direction."""
    lines = []
    if math.isfinite(fit.t_over_tau):
        short = (
            "" if fit.t_over_tau >= ENOUGH else f"; below {ENOUGH:g} flow and retardation are not separable"
        )
        times = ", ".join(f"{tau:.5g}" for tau in np.atleast_1d(fit.tau))
        lines.append(f"  tau = {times} s, T/tau = {fit.t_over_tau:.3g}{short}")
    if fit.weakest:
        weak = " ".join(f"{v:+.2f} {name}" for name, v in fit.weakest.items())
        lines.append(
            f"  condition (log parameters) {fit.condition:.2g}; weakest: {weak}, sd {fit.weakest_sd:.2g}"
        )
    return lines


def quality(fit: Any) -> list[str]:
    """Return lines on how well the model describes the data."""
    r2 = "R2 not defined for constant data" if math.isnan(fit.r2) else f"R2 = {fit.r2:.6f}"
    lines = [f"  {r2}, AIC {fit.aic:.1f}, BIC {fit.bic:.1f}, lag-1 residual correlation {fit.lag1:.2f}"]
    if not math.isnan(fit.chi2):
        lines.append(
            f"  chi2 per degree of freedom {fit.chi2:.3g} with the stated sigma ({fit.fitted.size - fit.p} degrees)"
        )
    if not fit.misfit and fit.widening > WIDER:
        why = "its size or correlation is uncertain" if fit.weights == "estimated" else "it may be correlated"
        lines.append(f"  intervals were widened by a factor of {fit.widening:.2g} for the noise: {why}")
    return lines


def verdict(fit: Any) -> list[str]:
    """Return lines with the verdict and the reasons for a rejection."""
    line = f"  verdict: {fit.verdict}, {in_words(fit)}"
    if not fit.refused:
        return [line]
    reasons = (f"  REJECTED: {reason}" for reason in fit.refused)
    return [line, *reasons, "  no parameter is identified, since the fit is rejected"]


def in_words(fit: Any) -> str:
    """Return what the verdict means: "describes the data", or where the data have a trend that the model misses.

    The place of a trend is the third of the points, in the order of the abscissa, whose weighted residuals are largest.
    """
    if not fit.refused:
        words = "describes the data, with correlated residuals" if fit.misfit else "describes the data"
        return words if math.isnan(fit.chi2) or fit.agrees else f"{words}, but contradicts the stated sigma"
    if not fit.misfit:
        return "describes the data only in part" if fit.r2 > 0.0 else "does not describe the data"
    name, _, x, _ = fit.curve
    if fit.abscissa[1] not in PLACES or name == "response":  # several tests have no common abscissa
        return "misses a trend"
    thirds = np.array_split(fit.residuals[np.argsort(x, kind="stable")], 3)
    size = np.array([np.mean(third**2) for third in thirds])
    first = int(np.argmax(size))
    alone = size[first] > CLEAR * np.max(np.delete(size, first))
    return f"misses a trend {'at ' + PLACES[fit.abscissa[1]][first] if alone else 'throughout'}"
