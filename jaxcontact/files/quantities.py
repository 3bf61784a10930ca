"""Quantities with units as text, "150 nm" or "2.5 mN", converted to SI units.

The conversion is decimal throughout, so that "150 nm" is the floating-point number 150e-9 exactly.
"""

import math
import re
from decimal import Decimal

from jaxcontact._support.prefixes import PREFIXES

MICRO = str.maketrans("µμ", "uu")


def _prefixed(unit: str, sign: int = 1) -> dict[str, Decimal]:
    """Return the unit with each of the prefixes; sign -1 for a reciprocal unit."""
    return {unit.replace("?", prefix): Decimal(10) ** (sign * power) for prefix, power in PREFIXES.items()}


LENGTHS = {"nm": Decimal("1e-9"), **_prefixed("?m"), "cm": Decimal("1e-2")}
TIMES = {"s": Decimal(1), "min": Decimal(60), "h": Decimal(3600), "d": Decimal(86400)}
ELECTRONVOLT, AVOGADRO = Decimal("1.602176634e-19"), Decimal("6.02214076e23")  # exact, SI 2019
UNITS = {  # by the SI unit of a key: the units accepted after a number
    "m": LENGTHS,
    "s": TIMES | {f"{prefix}s": Decimal(10) ** PREFIXES[prefix] for prefix in ("m", "u", "n")},
    "N": _prefixed("?N"),
    "Pa": _prefixed("?Pa"),
    "Pa s": _prefixed("?Pa s"),
    "1/Pa": _prefixed("1/?Pa", -1),
    "1/(Pa s)": _prefixed("1/(?Pa s)", -1),
    "m/s": {f"{length}/{time}": LENGTHS[length] / TIMES[time] for length in LENGTHS for time in TIMES},
    "1/s": {f"1/{unit}": 1 / size for unit, size in TIMES.items()},
    "J": {"J": Decimal(1), "eV": ELECTRONVOLT, "kJ/mol": Decimal(1000) / AVOGADRO},
    "m3": {"m3": Decimal(1), "nm3": Decimal("1e-27"), "A3": Decimal("1e-30"), "Å3": Decimal("1e-30")},
    "K": {"K": Decimal(1)},
    "W/(m K)": {"W/(m K)": Decimal(1)},
    "m2/s": {"m2/s": Decimal(1), "mm2/s": Decimal("1e-6")},
    "J/m2": {f"{energy}/{area}": size for energy, size in _prefixed("?J").items() for area in ("m2", "m^2")}
    | {f"{force}/m": size for force, size in _prefixed("?N").items()},
    "rad": {"rad": Decimal(1), "mrad": Decimal("1e-3"), "deg": Decimal(math.pi) / 180},
}
NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*(.*?)\s*")


def in_si(text: str, unit: str) -> float:
    """Return the quantity in ``unit``. Raises ValueError for another dimension or a missing unit."""
    found = NUMBER.fullmatch(text)
    known = UNITS[unit]
    written = " ".join(found.group(2).translate(MICRO).split()) if found else ""
    if found is None or written not in known:
        raise ValueError(f'text with a unit: "1 {next(iter(known))}", {", ".join(list(known)[1:6])}, ...')
    return float(Decimal(found.group(1)) * known[written])
