"""SI prefixes, and numbers with the prefix that suits them."""

import math
import re

PREFIXES = {"": 0, "p": -12, "n": -9, "u": -6, "m": -3, "k": 3, "M": 6, "G": 9}
"""Powers of ten by their spelling on a keyboard; in figures and summaries u is written µ."""


PLAIN = re.compile(r"[A-Za-z]+(?![A-Za-z\d^])")


def fitting_prefix(value: float) -> tuple[float, str]:
    """Return the factor and the prefix with which a number lies between 1 and 1000, (1e-6, "µ") for 3.4e-6."""
    if not math.isfinite(value) or value == 0.0:
        return 1.0, ""
    power = 3 * math.floor(math.log10(abs(value)) / 3 + 1e-9)
    power = min(max(power, min(PREFIXES.values())), max(PREFIXES.values()))
    spelling = next(prefix for prefix, own in PREFIXES.items() if own == power)
    return 10.0**power, spelling.replace("u", "µ")


def prefixed(value: float, unit: str) -> str:
    """Return a number with five digits and a prefixed unit, 3.3554 µm.

    A unit that begins with a power takes no prefix, which would be raised to that power: 1.7e-10 m2. A number below a
    thousandth of the smallest prefix, mostly round-off, has three digits and no prefix: 6.27e-16 Pa.
    """
    factor, prefix = fitting_prefix(value) if PLAIN.match(unit) else (1.0, "")
    if prefix and 0.0 < abs(value / factor) < 1e-3:
        return f"{value:.3g} {unit}"
    return f"{value / factor:.5g} {prefix}{unit}".rstrip()


def told_apart(value: float, limit: float, digits: int = 2) -> str:
    """Return a number with at least so many digits, and as many as show on which side of a limit it lies: 0.2003 at 0.2."""
    rounded = [f"{value:.{more}g}" for more in range(digits, 17)]
    apart = (text for text in rounded if (float(text) > limit) == (value > limit) and float(text) != limit)
    return next(apart, rounded[-1])
