"""Growth curves of films, thickness over time at one stress and one temperature; and their reader."""

import dataclasses
import math
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.data import cleaning, loading_time
from fitting.data.cleaning import TIME, Wanted, build, curves_of, once
from fitting.data.curves import array, deviations, times
from fitting.data.table import read_table
from fitting.views.text import described

COLD = 200.0  # K, below which a temperature was probably given in degrees Celsius
WEAK, THICK = 1e5, 1e-4  # Pa and m: a stress below, a thickness above are probably in other units


@dataclasses.dataclass(frozen=True, eq=False)
class GrowthData:
    """Thickness of a film over time, under a constant stress at a constant temperature.

    Curves at several stresses and temperatures are given to ``fit_growth`` as a list of these objects.

    Args:
        t: (n,) time since growth began [s], >= 0, not decreasing; n is at least 5.
        thickness: (n,) [m], with at least one value > 0.
        stress: the stress that drives the growth [Pa] >= 0; the pressure or the shear stress, depending on the law that is
            to be fitted.
        temperature: [K] > 0. A note is added below 200 K, since such values are usually in degrees Celsius; likewise
            for a stress below 1e5 Pa and a thickness above 1e-4 m.
        sigma: (n,) standard deviations of the thickness [m], or one value for all, if they are known.
        initial: thickness at t = 0 [m] >= 0.
        load: normal load [N] > 0, for a fit with the pressure of the contact; ``stress`` is then a nominal one, from which
            the search starts.
        notes: remarks on the data, which are repeated in the notes of a fit.

    Raises:
        ValueError: values out of range, with the expected and the received value.

    Example:
        >>> data = fitting.GrowthData(t=[0, 60, 120, 180, 240], thickness=[0, 4e-9, 7e-9, 9e-9, 1e-8],
        ...                           stress=2e8, temperature=373.0)
        >>> print(data.t.size, data.stress)
        5 200000000.0
    """

    t: np.ndarray
    thickness: np.ndarray
    stress: float = dataclasses.field(kw_only=True)
    temperature: float = dataclasses.field(kw_only=True)
    sigma: Any = None
    initial: float = 0.0
    load: float | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)
        put("t", times(self.t))
        if self.t[0] < 0:
            raise ValueError(f"t: expected times >= 0, got {self.t[0]:g}")
        put("thickness", array("thickness", self.thickness, self.t))
        if not np.any(self.thickness > 0):
            raise ValueError(f"thickness: expected some values > 0 m, got at most {self.thickness.max():g}")
        put("stress", _number("stress", self.stress, "Pa", 0.0))
        put("temperature", _number("temperature", self.temperature, "K", math.ulp(0.0)))
        put("initial", _number("initial", self.initial, "m", 0.0))
        if self.load is not None:
            put("load", _number("load", self.load, "N", math.ulp(0.0)))
        if self.sigma is not None:
            spread = np.full(self.t.size, self.sigma) if np.ndim(self.sigma) == 0 else self.sigma
            put("sigma", deviations("sigma", spread, self.t))
        doubts = [
            (self.temperature < COLD, f"temperature {self.temperature:g} K: expected in K, not in °C"),
            (0.0 < self.stress < WEAK, f"stress {self.stress:g} Pa: expected in Pa, not in MPa or GPa"),
            (
                self.thickness.max() > THICK,
                f"thickness up to {self.thickness.max():g} m: expected in m, not in nm",
            ),
        ]
        put("notes", (*self.notes, *(words for doubtful, words in doubts if doubtful)))

    def __repr__(self) -> str:
        rows = [
            ("t", self.t, "s"),
            ("thickness", self.thickness, "m"),
            ("sigma", self.sigma, "m"),
            ("initial", self.initial or None, "m"),
        ]
        head = f"GrowthData: {self.t.size} points at {self.stress:.5g} Pa and {self.temperature:.5g} K"
        return described(head, rows, self.notes)


def _number(name: str, value: Any, unit: str, least: float) -> float:
    """A finite number of at least ``least``; ValueError with its name otherwise."""
    known = np.ndim(value) == 0 and np.asarray(value).dtype.kind in "fiu"
    if not (known and least <= float(value) < math.inf):
        sign = ">=" if least == 0.0 else ">"
        raise ValueError(f"{name}: expected a number {sign} 0 {unit}, got {value!r}")
    return float(value)


THICKNESS = Wanted("thickness", ("thickness", "depth"))  # "h" alone is the name of a depth


def read_growth(
    path: str | os.PathLike, *, stress: float, temperature: float, columns: dict | None = None,
    units: dict | None = None, initial: float = 0.0, start: float | None = None,
    segment: int | str | Sequence[int | str] | None = None,
    window: tuple[float | None, float | None] | None = None, decimal: str | None = None,
) -> GrowthData:  # fmt: skip
    """Read time and thickness of a film from a text file, one curve at one stress and one temperature.

    Args:
        path: a text file.
        stress: the stress that drives the growth [Pa].
        temperature: [K].
        columns: columns that the header does not identify: {"t": header or position from 0, "thickness": ...}, and
            {"sigma": ...} for a column of standard deviations of the thickness.
        units: {"t": "min", "thickness": "nm"}; they take precedence over the header.
        initial: thickness at t = 0 [m].
        start: time [s] on the file's clock at which the growth began, which is subtracted; 0 by default.
        segment: the step or interval of a file with several, by name or position from 0; several are joined.
        window: (begin, end) [s] of the file's clock, None for an open side.
        decimal: the decimal mark, "." or ",", if it is ambiguous.

    Returns:
        The curve in SI, with notes on what was read and corrected.

    Raises:
        ValueError: a file that cannot be read, in a message of one line.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "film.csv"
        >>> _ = file.write_text("t [min],thickness [nm]\\n" + "".join(f"{t},{2 * t}\\n" for t in range(1, 7)))
        >>> data = fitting.read_growth(file, stress=3e8, temperature=373.0)
        >>> print(data.t[0], data.thickness[0])
        60.0 2e-09
    """
    table = read_table(path, decimal, columns, units, ("t", "thickness", "sigma"))
    wanted = [TIME, THICKNESS] + ([Wanted("sigma", THICKNESS.names)] if "sigma" in table.columns else [])
    parts = curves_of(table, wanted, "read_growth")
    taken = cleaning.choose(table.path, "segment", parts, segment)
    taken = loading_time.shift(table.path, taken, start)
    taken = cleaning.ordered(cleaning.complete(table.path, cleaning.window(taken, window)))
    values = cleaning.check_times(table.path, taken).values
    return build(
        table.path, GrowthData, t=values["t"], thickness=values["thickness"], sigma=values.get("sigma"),
        stress=stress, temperature=temperature, initial=initial, notes=once(taken.notes),
    )  # fmt: skip
