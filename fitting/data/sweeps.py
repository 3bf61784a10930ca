"""Reader of tests at several temperatures, for their superposition: one curve for each temperature of a file."""

import math
import os
import re
from typing import Any

import numpy as np

from fitting.data.cleaning import (
    COMPLIANCE,
    CREEP_MODULUS,
    DRIFT,
    MODULUS,
    STORAGE,
    TIME,
    Series,
    Wanted,
    curves_of,
    having,
)
from fitting.data.creep import creep_of, wanted_of
from fitting.data.curves import since_load
from fitting.data.moduli import (
    ANGLE,
    COMPLEX,
    FACTOR,
    LOSS,
    OMEGA,
    check_relaxing,
    oscillation_of,
    pair_of,
    relaxation_of,
    swept,
)
from fitting.data.table import Table, read_heading, read_table
from fitting.data.units import CELSIUS

TEMPERATURE = Wanted("temperature", ("temperature",))
ZERO = 273.15  # K, of the Celsius scale
STEP = 1.5  # change [K] between neighbouring rows that begins a test at another temperature
LEAST = 5  # fewest points of a curve
DEGREES = "|".join(map(re.escape, sorted((*CELSIUS, "K"), key=len, reverse=True)))
STATED = (
    rf"(?im)\bT(?:emp(?:eratur(?:e)?)?)?\s*[=:]\s*(?P<value>-?\d+(?:[.,]\d+)?)\s*(?P<unit>{DEGREES})\b",
    r"(?m)\bT=(?P<value>-?\d+(?:\.\d+)?);(?P<unit>)",  # RepTate, in °C
)
IN_NAME = rf"(?P<value>-?\d+(?:[.,]\d+)?)\s*(?P<unit>{DEGREES})(?![A-Za-z])"  # "Frequency sweep 130 °C"


def read_sweeps(
    path: str | os.PathLike, *, temperature: float | None = None, columns: dict | None = None,
    units: dict | None = None, convention: str | None = None, nu: float | None = None,
    window: tuple[float | None, float | None] | None = None, decimal: str | None = None,
) -> list[Any]:  # fmt: skip
    """Read tests at one or several temperatures, for ``fit_master``.

    The file has storage and loss moduli, a relaxation modulus, a creep compliance or a creep modulus. A column of
    temperatures gives that of each test, which begins where the frequencies or times start again or the temperature
    changes by more than 1.5 K; otherwise the temperature is that in the name of the step or in the text above it.

    Args:
        path: a text file.
        temperature: [K] of the whole file, which takes precedence over what it states.
        columns: columns that the header does not identify, as in ``read_oscillation``, ``read_relaxation`` and
            ``read_creep``, and {"temperature": header or position from 0}.
        units: as there; {"temperature": "C"} or "K" for a column without a unit.
        convention: as there; None is tension where nu is given, and shear without it.
        nu: Poisson's ratio of a tensile test.
        window: (begin, end) of the angular frequencies [rad/s] or times [s], None for an open side.
        decimal: the decimal mark, "." or ",", if it is ambiguous.

    Returns:
        A list of curves in SI, each with its ``temperature``.

    Raises:
        ValueError: a file that cannot be read, that states no temperature, whose temperature changes by more than 5 K
            within a curve, or whose times go on from one relaxation or creep test to the next, in a message of one line.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "melt.csv"
        >>> rows = "".join(f"{w},{w * a},{9 * a},{T}\\n" for T, a in ((130, 2), (150, 1)) for w in range(1, 7))
        >>> _ = file.write_text("omega [rad/s],G' [kPa],G'' [kPa],T [°C]\\n" + rows)
        >>> [one.temperature for one in fitting.read_sweeps(file)]
        [403.15, 423.15]
    """
    pairs = (one.key for one in (STORAGE, LOSS, COMPLEX, ANGLE, FACTOR))
    keys = ("t", "modulus", "J", "creep_modulus", "sigma", "omega", TEMPERATURE.key, *pairs)
    table = read_table(path, decimal, columns, units, keys)
    some = lambda wanted: bool(having(table, wanted))
    crept = (some(COMPLIANCE) or some(CREEP_MODULUS)) and not some(STORAGE)
    relaxed = some(MODULUS) and not crept and not some(STORAGE)
    if crept:
        wanted = tuple(one for one in wanted_of(table, None) if one.key not in ("stress", "strain"))
    else:
        wanted = (TIME, MODULUS) if relaxed else (OMEGA, *pair_of(table))
    found: list[Any] = []
    # the first column of temperatures
    headings = (enumerate(block.header.cells if block.header else []) for block in table.blocks)
    hits = (k for cells in headings for k, cell in cells if read_heading(cell).kind == TEMPERATURE.key)
    place = next(hits, None)
    if temperature is None and (place is not None or TEMPERATURE.key in table.columns):
        wanted = (*wanted, TEMPERATURE)
        table = table._replace(columns={TEMPERATURE.key: place, **table.columns})
    # the curves of the file, cut where the temperature changes
    parts: list[Series] = []
    for part in curves_of(table, wanted, divided=True):
        T = part.values.get(TEMPERATURE.key, np.zeros(part.lines.size))
        cuts = np.flatnonzero(np.abs(np.diff(T)) > STEP) + 1
        # a modulus or a compliance is a function of the time since its own step
        if cuts.size and "t" in part.values:
            raise ValueError(
                f"{table.path}: t: expected times that start again with the step at each temperature, got times that go on"
                f" at {part.values['t'][cuts[0]]:g} s, where it changes from {T[cuts[0] - 1]:g} to {T[cuts[0]]:g}:"
                " subtract the time of each step"
            )
        parts += [part.pick(rows) for rows in np.split(np.arange(T.size), cuts)] if cuts.size else [part]
    for part in parts if crept or relaxed else swept(parts, math.inf):
        if part.error:
            raise ValueError(part.error)
        held = _held(table, part) if temperature is None else temperature
        part = part._replace(values={k: v for k, v in part.values.items() if k != TEMPERATURE.key})
        if part.lines.size < LEAST:
            continue
        if crept:
            given = convention or ("J" if nu is None else "D")
            found.append(creep_of(table, part, given, nu, None, None, window, held))
        elif relaxed:
            part = part.say(*since_load(np.unique(part.values["t"]), None)[1])
            given = convention or ("G" if nu is None else "E")
            check_relaxing(table, part)
            found.append(relaxation_of(table.path, part, given, nu, 0.0, window, held))
        else:
            given = convention or ("G" if nu is None else "E")
            found.append(oscillation_of(table, part, given, nu, window, held))
    if not found:
        raise ValueError(
            f"{table.path}: expected curves of at least {LEAST} points at one temperature, got none"
        )
    return found


def _held(table: Table, part: Series) -> float:
    """Return the temperature of a curve [K]: the median of its column, or what its name or the text above it states."""
    path, T = table.path, part.values.get(TEMPERATURE.key)
    if T is None:
        patterns = [(IN_NAME, part.name), *((one, part.before) for one in STATED)]
        for pattern, text in patterns:
            hits = {(m["value"].replace(",", "."), m["unit"]) for m in re.finditer(pattern, text)}
            if len(hits) == 1:
                value, unit = hits.pop()
                return round(float(value) + (0.0 if unit.casefold() == "k" else ZERO), 6)
        raise ValueError(
            f"{path}: temperature: expected a column, or a step or a line that states it, got none: give temperature= [K]"
        )
    column = part.columns[TEMPERATURE.key]
    unit = str(table.units.get(TEMPERATURE.key, column.unit or ""))
    if not unit:
        raise ValueError(
            f"{path}: column {column.label!r}: expected a temperature in °C or K, got neither: give"
            " units={'temperature': 'C'} or 'K'"
        )
    if np.nanmax(T) - np.nanmin(T) > DRIFT:
        raise ValueError(
            f"{path}: column {column.label!r}: expected one temperature within a curve, got {np.nanmin(T):g} to"
            f" {np.nanmax(T):g}: a ramp cannot be superposed"
        )
    zero = 0.0 if unit.strip("[]() ").casefold() == "k" else ZERO
    return round(float(np.nanmedian(T)) + zero, 6)
