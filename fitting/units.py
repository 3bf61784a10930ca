"""Units of a column: their text and the factor to SI."""

import re

PREFIX = {"": 1.0, "G": 1e9, "M": 1e6, "k": 1e3, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12}
TIME = {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0,
        "minutes": 60.0, "h": 3600.0, "hr": 3600.0, "hours": 3600.0,
        "d": 86400.0, "days": 86400.0}  # fmt: skip
FORCE = {prefix + "N": factor for prefix, factor in PREFIX.items() if prefix != "G"}
LENGTH = {prefix + "m": PREFIX[prefix] for prefix in ("", "m", "u", "n", "p")}
STRESS = {prefix + "Pa": factor for prefix, factor in PREFIX.items() if prefix in ("", "k", "M", "G", "m")}
STRAIN = {"-": 1.0, "1": 1.0, "": 1.0, "m/m": 1.0, "%": 1e-2, "mm/mm": 1.0}
COMPLIANCE = {f"1/{unit}": 1.0 / factor for unit, factor in STRESS.items()}
KINDS = {"t": TIME, "J": COMPLIANCE, "strain": STRAIN, "stress": STRESS, "load": FORCE, "depth": LENGTH}


def factor(kind: str, text: str) -> float:
    """Factor from unit ``text`` to SI for a column of ``kind``; KeyError if it is not one.

    "1/MPa", "MPa^-1", "MPa⁻¹", "MPa-1", "1_per_MPa" and "per MPa" are one unit;
    the micro sign may be µ, μ or u.
    """
    return KINDS[kind][_plain(text)]


def accepted(kind: str) -> str:
    """The units of a kind, for a message."""
    return ", ".join(unit for unit in KINDS[kind] if unit)


def _plain(text: str) -> str:
    unit = (
        text.strip()
        .replace("µ", "u")
        .replace("μ", "u")
        .replace("⁻¹", "^-1")
        .replace(" ", "")
        .replace("**", "^")
    )
    unit = re.sub(r"^(?:1_?)?per_?", "1/", unit)
    inverse = re.fullmatch(r"\(?([A-Za-z]+)\)?\^?\(?-1\)?", unit)
    return f"1/{inverse.group(1)}" if inverse else unit
