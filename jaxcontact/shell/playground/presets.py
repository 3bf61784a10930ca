"""The contacts of the page and the limits of its sliders, in SI units."""

import math
from dataclasses import dataclass

SPAN = 10.0
"""A slider goes from its default over this number to its default times this number."""

HOUR = 3600.0


@dataclass(frozen=True)
class Preset:
    """An example of the page: a body that is pressed onto a film on a substrate.

    indenter, film, substrate: their names on the page; nu: Poisson's ratio of the film; values: the default of each
    slider, by name. Of these stiffness is the shear modulus at first [Pa]; softening the growth of the compliance within
    the delay [s], as a share of the first; flow the time [s] in which it flows as much as its first strain; thickness
    and radius are in m; load in N, or N/m on a roller.
    """

    indenter: str
    film: str
    nu: float
    substrate: str
    values: dict[str, float]


PRESETS = {
    "ZDDP film on steel": Preset(
        "ball", "film", 0.3, "steel",
        {"load": 10e-3, "radius": 1e-3, "thickness": 150e-9, "stiffness": 2e9, "softening": 4.0, "delay": 100.0,
         "flow": 2.0 * HOUR},
    ),
    "Gel under a bead": Preset(
        "bead", "gel", 0.49, "glass",
        {"load": 1e-9, "radius": 25e-6, "thickness": 50e-6, "stiffness": 1e3, "softening": 1.0, "delay": 10.0,
         "flow": 10.0 * HOUR},
    ),
    "Rubber roller": Preset(
        "roller", "rubber", 0.49, "steel",
        {"load": 1e3, "radius": 50e-3, "thickness": 10e-3, "stiffness": 1e6, "softening": 0.5, "delay": 10.0,
         "flow": 100.0 * HOUR},
    ),
}  # fmt: skip


def checked(request: object) -> tuple[str, dict[str, float]]:
    """Return the preset and the values of a request; ValueError, in one line, if it is not one of the page's sliders."""
    if not isinstance(request, dict) or request.keys() != {"preset", "values"}:
        raise ValueError("request: expected an object with preset and values")
    name, values = request["preset"], request["values"]
    if not isinstance(name, str) or name not in PRESETS:
        raise ValueError(f"preset: expected one of {', '.join(PRESETS)}, got {str(name)[:40]!r}")
    defaults = PRESETS[name].values
    if not isinstance(values, dict) or values.keys() != defaults.keys():
        raise ValueError(f"values: expected an object with {', '.join(defaults)}")
    return name, {key: _within(key, values[key], default) for key, default in defaults.items()}


def _within(key: str, value: object, default: float) -> float:
    low, high = default / SPAN, default * SPAN
    number = value if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan
    if low * (1.0 - 1e-9) <= number <= high * (1.0 + 1e-9):
        return float(number)
    raise ValueError(f"{key}: expected a number from {low:g} to {high:g}, got {str(value)[:40]}")
