"""Plot axes with SI prefixes that suit their values: 3.5 1/GPa and 120 nm rather than 3.5e-9 1/Pa and 1.2e-7 m."""

from typing import Any

import numpy as np

from jaxcontact._support.prefixes import fitting_prefix


def label(axis: Any, name: str, unit: str, values: np.ndarray) -> None:
    """Label a matplotlib axis of values in an SI unit, with ticks in a multiple of that unit."""
    factor, unit = multiple(unit, float(np.max(np.abs(values), initial=0.0)))
    axis.set_label_text(f"{name} [{unit}]")
    if factor != 1.0:
        axis.set_major_formatter(lambda value, _: f"{value / factor:g}")


def multiple(unit: str, largest: float) -> tuple[float, str]:
    """Return (factor, unit) in which the largest value is 1 to 1000; units other than Pa, 1/Pa, N and m are unchanged."""
    if unit == "1/Pa":
        factor, prefixed = multiple("Pa", 1e3 / largest if largest > 0.0 else 1.0)
        return 1.0 / factor, f"1/{prefixed}"
    if unit not in ("Pa", "N", "m"):
        return 1.0, unit
    factor, prefix = fitting_prefix(largest)
    return factor, prefix + unit
