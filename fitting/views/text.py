"""Lines of text that report a ``Fit`` of any kind."""

import math
import re
from collections.abc import Iterable, Sequence
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


def key(name: str, unit: str) -> str:
    """Return a name with its unit, for files: G1_Pa, eta1_Pa_s, J1_1_per_Pa, fluidity_1_per_Pa_s."""
    words = unit.replace("/", "_per_").replace(" ", "_")
    return f"{name}_{words}".replace("(", "").replace(")", "").rstrip("_")


def layer(thickness: float | None, unbonded: bool, substrate: Any = None, word: str = "layer") -> str:
    """Return the sample on which a modulus is conditional: a layer of a thickness [m] on a base, or a half-space; word: for
    the layer."""
    if thickness is None:
        return "a half-space"
    base = "a rigid base" if substrate is None else f"a base of {float(substrate.G):.4g} Pa in shear"
    return f"a {word} of {thickness:.4g} m {'loose on' if unbonded else 'bonded to'} {base}"


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


# Text representation of objects: each array by its length, range and unit.


def described(head: str, rows: Iterable[tuple[str, Any, str]], notes: Sequence[str] = ()) -> str:
    """Return a heading with lines of name, range and unit, without rows whose value is None, and a line for each note."""
    lines = [line(name, values, unit) for name, values, unit in rows if values is not None]
    return "\n".join([head, *lines, *(f"  note: {note}" for note in notes)])


def line(name: str, values: Any, unit: str = "") -> str:
    """Return a line with the number, or with the range and the shape of an array."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        text = str(values)
    elif array.size == 1:
        text = f"{array.item():.5g} {unit}"
    elif array.size == 0:
        text = "none"
    else:
        shape = " x ".join(map(str, array.shape))
        text = f"{np.min(array):.5g} to {np.max(array):.5g} {unit}".rstrip() + f" ({shape})"
    return f"  {name:14s} {text}".rstrip()


# Messages of the readers and fits for the shell: flags in place of keyword arguments.


# names of options at the head of a message, and their flags
HEADS = {
    **{name: f"--{name.replace('_', '-')}" for name in (
        "adhesion", "contact_point", "control", "convention", "curve", "drag", "drift", "exclude", "induction", "law",
        "layer", "level", "processes", "machine_compliance", "model", "nu", "segment", "sensitivity", "thickness", "sigma",
        "ramp", "spring_constant", "start", "stress", "tau", "temperature", "weights", "window", "bulk_modulus", "viscosity",
    )},
    "columns, units, decimal": "--column, --unit, --decimal",
    "fixed, bounds": "--fix, --bound", "fixed": "--fix", "bounds": "--bound", "sigma": "--weights", "columns": "--column",
    "units": "--unit", "per_decade": "--resample", "times": "--times", "substrate": "--substrate-modulus",
}  # fmt: skip
# patterns of options elsewhere in a message, and their flags
FLAGS = (
    (
        rf"(^|: )({'|'.join(HEADS)}): (?=expected|goes|\"|\w+ has )",
        lambda found: f"{found[1]}{HEADS[found[2]]}: ",
    ),
    (r"\b(fixed|bounds)\['?([^'\]]+)'?\]", lambda found: f"{HEADS[found[1]]} {found[2]}"),
    (r"\berrors\['(\w+)'\]", lambda found: f"--{found[1].replace('_', '-')}-error"),
    (r"columns=\{'(\w+)': \.\.\.\}", r"--column \1=HEADER"),
    (r"columns=\{'(\w+)': '([^']*)'\}", r"--column \1=\2"),
    (
        r"columns=\{((?:'\w+': \d+(?:, )?)+)\} for instance",
        lambda found: re.sub(r"'(\w+)': (\d+),?", r"--column \1=\2", found[1]),
    ),
    (r"columns\['(\w+)'\]", r"--column \1"),
    (r"units=\{'(\w+)': \.\.\.\}", r"--unit \1=..."),
    (r"units=\{'(\w+)': '([^']*)'\}", r"--unit \1=\2"),
    (r"\bunits=", "--unit"),
    (r"window=\(None, ([^)]*)\)", r"--window :\1"),
    (r"window=\(([^,]*), None\)", r"--window \1:"),
    (r"window=\(([^,]*), ([^)]*)\)", r"--window \1:\2"),
    (r"decimal='\.' or ','", "--decimal . or --decimal ,"),
    (r"convention='D'; got convention='?([^']*)'?$", r"--tension; got --convention \1"),
    (r"convention='[DE]' and nu=|convention='D', nu=|\bnu=(?= for [JE])", "--tension NU"),
    (r"\bnu=(\S+), bulk_modulus=(\S+)", r"--nu \1, --bulk-modulus \2"),
    (r"\bof nu and bulk_modulus", "of --nu and --bulk-modulus"),
    (r"\bcontact=\"([\w-]+)\"", r"--contact \1"),
    (r"\bcontrol=\"(\w+)\"", r"--control \1"),
    (r"(?<!-)\b(start|segment|curve|stress)=", r"--\1="),
    (r"--(start|segment|curve|stress)=(?=[\s,;:]|$)", r"--\1"),
    (r"\bspring_constant=", "--spring-constant"),
    (r"\bmodel= fits", "--model fits"),
    (r"\bsensitivity=", "--sensitivity"),
    (r"\btemperature= ", "--temperature "),
    (r"\bdrag=\"fit\"", "--drag fit"),
    (r"\binduction=\"fit\"", "--induction fit"),
    (r"\bor sigma(=\.\.\.)?", "or a standard deviation"),
    (r"--segment=\(\"(\w+)\", \"(\w+)\"\)", r"--segment \1 --segment \2"),
    (r"\bindenter: (?=expected a radius)", "--radius, --punch: "),
    (r"\bin_contact\((film=True)?\)", "--in-contact"),
    (r"\bin_contact\(depth\)", "--in-contact DEPTH"),
    (r"\bdata\.(?=--)", ""),
    (r"\bread_(creep|growth|relaxation|oscillation|indentation|stiffness)\b", r"jaxcontact fit \1"),
    (r"\bfit_prony\(data\) (.*) \(jaxcontact fit prony\)", r"jaxcontact fit prony \1"),
    (r"\bfit_prony\b", "jaxcontact fit prony"),
    (
        r"take load and depth from afmformats and make IndentationData\([^)]*\)",
        "export times, load and depth as text",
    ),
    (r"\bjc\.", ""),
    (r"\bgot None\b", "got none"),
    (r"\bgot \{('[^}]*)\}", lambda found: "got " + re.sub(r"'(\w+)': '?([^',]*)'?", r"\1=\2", found[1])),
)


def in_flags(message: str) -> str:
    """Return a message of the readers and fits, of one or several lines, with each option replaced by its flag."""
    for pattern, flag in FLAGS:
        message = re.sub(pattern, flag, message, flags=re.MULTILINE)  # type: ignore[call-overload]
    return message
