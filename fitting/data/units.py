"""Units of columns: their spellings and the factors to SI, one table for each quantity."""

import math
import re

from jaxcontact._support.prefixes import PREFIXES

PREFIX = {prefix: float(f"1e{power}") for prefix, power in PREFIXES.items()} | {"h": 1e2}
POUND = 0.45359237 * 9.80665  # of force [N]
KILOPOND = 9.80665  # [N]


def _prefixed(unit: str, prefixes: str) -> dict[str, float]:
    """Return the unit without and with each of the prefixes."""
    return {prefix + unit: PREFIX[prefix] for prefix in ("", *prefixes)}


CLOCK = ("hh:mm:ss", "h:mm:ss", "h:m:s", "h:min:s", "hms")  # of cells as 0:01:30, which are read as seconds
TIME = {
    "s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0, "d": 86400.0, "us": 1e-6, "ns": 1e-9,
    "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "Sek": 1.0, "Sekunde": 1.0, "Sekunden": 1.0,
    "msec": 1e-3, "mins": 60.0, "minute": 60.0, "minutes": 60.0, "Minute": 60.0, "Minuten": 60.0,
    "hr": 3600.0, "hrs": 3600.0, "hour": 3600.0, "hours": 3600.0,
    "Std": 3600.0, "Stunde": 3600.0, "Stunden": 3600.0,
    "day": 86400.0, "days": 86400.0, "Tag": 86400.0, "Tage": 86400.0, "Tagen": 86400.0, "week": 604800.0, "weeks": 604800.0,
    "seconde": 1.0, "secondes": 1.0, "heure": 3600.0, "heures": 3600.0, "jour": 86400.0, "jours": 86400.0,
    "segundo": 1.0, "segundos": 1.0, "seg": 1.0, "minuto": 60.0, "minutos": 60.0, "hora": 3600.0, "horas": 3600.0,
    "día": 86400.0, "días": 86400.0, "秒": 1.0, "分": 60.0, "時間": 3600.0, "日": 86400.0,
    **dict.fromkeys(CLOCK, 1.0),
}  # fmt: skip
FREQUENCY = {
    "rad/s": 1.0, "1/s": 1.0, **{unit: 2.0 * math.pi * PREFIX[unit[:-2]] for unit in ("Hz", "mHz", "kHz", "MHz")},
    "rad/sec": 1.0, "1/sec": 1.0,
}  # fmt: skip
FORCE = {
    **_prefixed("N", "munpkM"), "kgf": KILOPOND, "kp": KILOPOND, "gf": 1e-3 * KILOPOND,
    "mgf": 1e-6 * KILOPOND, "lbf": POUND, "dyn": 1e-5,
}  # fmt: skip
LENGTH = {
    **_prefixed("m", "munp"), "cm": 1e-2, "micron": 1e-6, "microns": 1e-6,
    "Angstrom": 1e-10, "angstrom": 1e-10, "Angstroms": 1e-10, "Å": 1e-10, "A": 1e-10,
}  # fmt: skip
AREA = {"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6, "um2": 1e-12, "nm2": 1e-18}
STRESS = {
    **_prefixed("Pa", "kMGmh"), "bar": 1e5, "mbar": 1e2, "psi": POUND / 0.0254**2,
    "ksi": 1e3 * POUND / 0.0254**2,
    **{f"{force}/{area}": FORCE[force] / AREA[area] for force in FORCE for area in AREA},
}  # fmt: skip
STRAIN = {
    "-": 1.0, "%": 1e-2, "m/m": 1.0, "1": 1.0, "": 1.0, "mm/mm": 1.0, "um/um": 1.0, "nm/nm": 1.0,
    "percent": 1e-2, "Prozent": 1e-2, "‰": 1e-3, "mm/m": 1e-3, "um/m": 1e-6, "ppm": 1e-6,
    "microstrain": 1e-6, "ustrain": 1e-6, "ue": 1e-6,
}  # fmt: skip
ANGLE = {
    "°": math.pi / 180.0, "deg": math.pi / 180.0, "rad": 1.0, "mrad": 1e-3, "degree": math.pi / 180.0,
    "degrees": math.pi / 180.0, "Grad": math.pi / 180.0,
}  # fmt: skip
CELSIUS = ("°C", "C", "degC", "deg C", "℃")
TEMPERATURE = {"K": 1.0, **dict.fromkeys(CELSIUS, 1.0)}  # of one degree; the zero of °C is not that of K
RATIO = {"-": 1.0, "1": 1.0, "": 1.0, "%": 1e-2}
STIFFNESS = {
    "N/m": 1.0,
    **{f"{force}/{length}": FORCE[force] / LENGTH[length] for force in ("N", "mN", "uN", "nN", "pN", "kN")
       for length in ("m", "mm", "um", "nm")},
}  # fmt: skip
COMPLIANCE = {
    **{f"1/{unit}": 1.0 / factor for unit, factor in STRESS.items() if "/" not in unit},
    **{f"{area}/{force}": AREA[area] / FORCE[force] for force in FORCE for area in AREA},
    "%/Pa": 1e-2, "%/kPa": 1e-5, "%/MPa": 1e-8,
}  # fmt: skip
CAPITALS = {("load", "MN")}  # ambiguous in indentation: mN written in capitals
KINDS = {
    "t": TIME,
    "omega": FREQUENCY,
    "J": COMPLIANCE,
    "strain": STRAIN,
    "stress": STRESS,
    "load": FORCE,
    "depth": LENGTH,
    "angle": ANGLE,
    "ratio": RATIO,
    "temperature": TEMPERATURE,
    "stiffness": STIFFNESS,
    "area": AREA,
}
SHOWN = {
    "t": 5,
    "omega": 4,
    "load": 6,
    "depth": 6,
    "stress": 5,
    "J": 5,
    "strain": 3,
    "angle": 3,
    "ratio": 2,
    "temperature": 2,
    "stiffness": 3,
    "area": 5,
}  # canonical ones come first
SIGNS = str.maketrans(
    {
        "µ": "u",
        "μ": "u",
        "ε": "e",
        "²": "2",
        "·": ".",
        "⋅": ".",
        "⁻": "-",
        "¹": "1",
        "−": "-",
        "$": "",
        "{": "",
        "}": "",
    }
)


def factor(kind: str, text: str) -> float:
    """Return the factor from unit ``text`` to SI for a column of ``kind``; KeyError if it is not a unit of that kind.

    "1/MPa", "MPa^-1", "MPa⁻¹", "MPa-1", "1_per_MPa", "per MPa" and "mm²/N" are one unit; the micro sign
    may be µ, μ or u. Upper and lower case may differ where no other unit is meant: "SEC", "kpa", but not
    "MPA", which may be mPa or MPa.

    Args:
        kind: of ``KINDS``: "t", "omega", "J", "strain", "stress", "load", "depth", "angle",
            "ratio", "temperature", "stiffness" or "area".
        text: the unit as written.

    Returns:
        The factor that converts a value to s, rad/s, 1/Pa, 1, Pa, N, m, rad, 1, K, N/m or m2.

    Raises:
        KeyError: the text is no unit of that kind.
    """
    unit = _plain(text)
    known = KINDS[kind]
    if unit in known and (kind, unit) not in CAPITALS:
        return known[unit]
    alike = {known[name] for name in known if name.lower() == unit.lower()}
    if len(alike) != 1:
        raise KeyError(text)
    return alike.pop()


def is_unit(kind: str, text: str) -> bool:
    """Return whether the text is a unit of the kind."""
    try:
        return factor(kind, text) > 0
    except KeyError:
        return False


def accepted(kind: str) -> str:
    """Return the usual units of a kind, for a message."""
    return ", ".join([*list(KINDS[kind])[: SHOWN[kind]], "..."])


def _plain(text: str) -> str:
    """Return a canonical spelling: inverses as "1/Pa", powers as "mm2", a product as "N.mm-2", no final dot."""
    unit = text.strip().translate(SIGNS).replace("**", "^").removesuffix(".")
    while re.fullmatch(r"\([^()]*\)|\[[^\[\]]*\]|\(\[[^\[\]]*\]\)", unit):
        unit = unit[1:-1]
    unit = re.sub(r"\s*([/^()-])\s*", r"\1", unit)
    unit = re.sub(r"[\s*]+", ".", unit)
    unit = re.sub(r"^(?:1[._])?per[._]", "1/", unit)
    inverse = re.fullmatch(r"\(?([^\W\d_]+)\)?\^?\(?-1\)?|1/\((\w+)\)", unit)
    if inverse:
        return f"1/{inverse.group(1) or inverse.group(2)}"
    product = re.fullmatch(r"(\w+)(?:\^2)?\.(\w+?)\^?\(?-([12])\)?", unit.replace("^2.", "2."))
    if product:
        above, below, power = product.groups()
        return f"{above}/{below}{power.strip('1')}"
    return unit.replace("^", "")
