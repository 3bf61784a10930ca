"""Readers of creep and indentation files: delimited text of any instrument, and force curves of microscopes.

A file is read in steps, one module of ``fitting.io`` for each: lines (``text``), cells and decimal mark (``cells``),
blocks with headers and units (``table``, ``header``, ``names``), columns in SI (``columns``). Corrections that lose no
information are made and recorded in ``notes``: rows out of order are sorted, repeated times are kept as repeated
measurements, rows with an empty cell or J <= 0 are left out if they are at most a tenth, and a column without a unit is
taken as SI. Everything else is a ValueError of one line that names the file, the line, the column, and the option that
would read it.
"""

import dataclasses
import os
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.data import units as unit_table
from fitting.data.contact import tip_depth
from fitting.data.curves import CONVENTIONS, CreepData
from fitting.data.indentation import ERRORS, IndentationData
from fitting.data.segments import label, named
from fitting.io import afm, constancy, mending, onset
from fitting.io.cells import number
from fitting.io.columns import Series, Wanted, has, locate, series
from fitting.io.names import kind_of, says_shear
from fitting.io.table import Table, read_table

TIME = Wanted("t", ("step time", "time"))
COMPLIANCE = Wanted("J", ("compliance", "tensile compliance"))
STRAIN = Wanted("strain", ("strain", "tensile strain"))
STRESS = Wanted("stress", ("stress", "tensile stress"))
MODULUS = Wanted("modulus", ("relaxation modulus",))
STORAGE = Wanted("storage", ("storage modulus", "tensile storage modulus"))
SWEEP = Wanted("sweep", (*STORAGE.names, "complex modulus", "tensile complex modulus"))
CLOCK = Wanted("t", ("time", "step time"))
LOAD = Wanted("load", ("load",))
DEPTH = Wanted("depth", ("depth", "delta"))
OF = {
    "sigma": 1,
    "sigma_load": 1,
    "sigma_depth": 2,
}  # place, among the wanted columns, of the quantity of an error
HEIGHT = Wanted("height", ("height", "smoothed height", "commanded height"))
AIR = 5  # number of points before contact below which no note is made
STRESS_FACT = r"(?im)\bstress=([0-9.eE+-]+)\s*;"  # RepTate, in Pa
STATED = re.compile(
    r"\W*(?P<name>[^:=;,\t\d]+?)\s*[:=;,\t]+\s*(?P<value>[-+\d.,eE]+)[\s;,\t]*[\[(]?(?P<unit>[^\s;,\])]+)\W*"
)
SPRING_FACT = r"(?im)^(?:spring\s?constant|k \(N/m\))[\s:=,]*([0-9.eE+-]+)(?:\s*N/m)?\s*$"  # JPK, Optics11


def read_creep(
    path: str | os.PathLike, *, columns: dict | None = None, units: dict | None = None, convention: str = "J",
    nu: float | None = None, stress: float | None = None, start: float | None = None,
    segment: int | str | Sequence[int | str] | None = None,
    window: tuple[float | None, float | None] | None = None, decimal: str | None = None,
) -> CreepData:  # fmt: skip
    """Read time and compliance, or time, strain and stress, of a creep test.

    A stress column beside a compliance determines its meaning: J(t) if the stress is constant; if it varies, the
    compliance is the quotient of strain and stress, and the strain is used with the measured stress.

    Args:
        path: a text file: CSV, TSV, exports of rheometers (TRIOS, Anton Paar, RepTate) and others.
        columns: places of columns that the header does not identify: {"t": header or position from 0, "J": ...,
            "strain": ..., "stress": ...}, and {"sigma": ...} for a column of standard deviations of J or strain, in the
            unit of these if it has none of its own.
        units: {"t": "h", "J": "1/MPa"}; they take precedence over the header.
        convention: meaning of the compliance: "J" = gamma/tau in shear, "1/(2G)", or "D" = strain/stress in
            tension, which needs nu.
        nu: Poisson's ratio of a tensile test, J = 2 (1 + nu) D; required for a column that is named as tensile
            ("D(t)", "tensile strain").
        stress: the constant stress [Pa] of a file that has strain alone.
        start: time of loading [s] on the file's clock. Without it the file must show it, and a note states the
            time used.
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
        >>> _ = file.write_text("t [min],J [1/MPa]\\n" + "".join(f"{t},{2 + t}\\n" for t in range(1, 7)))
        >>> data = fitting.read_creep(file)
        >>> print(data.t[0], data.J[0])
        60.0 3e-06
    """
    if convention not in CONVENTIONS:
        raise ValueError(f"convention: expected one of {sorted(CONVENTIONS)}, got {convention!r}")
    table = read_table(path, decimal)
    columns, units = checked_options(table, columns, units, ("t", "J", "strain", "stress", "sigma"))
    wanted = _what(table, columns, stress)
    if "sigma" in columns:
        wanted = (*wanted, Wanted("sigma", wanted[1].names))
    if COMPLIANCE in wanted:
        wanted = (*wanted, *_beside(table, columns, units))
    taken = mending.choose(table.path, "segment", curves_of(table, wanted, columns, units), segment)
    if "J" in taken.values and "stress" in taken.values:
        taken = constancy.settle(table.path, taken, window and window[1])
    convention, taken = _tension(table, taken, convention, nu)
    taken = onset.shift(table.path, taken, start)
    fields: dict[str, Any] = {"convention": convention, "nu": nu}
    if "J" in taken.values:
        onset.check_clock(table.path, taken, start)
        taken = mending.complete(table.path, mending.window(taken, window), positive=("J",))
        taken = mending.check_times(table.path, mending.ordered(taken))
        fields |= {"J": taken.values["J"], "start": 0.0}
        onset.check_course(table.path, taken.values["t"], fields["J"])
    else:
        taken = mending.ordered(mending.complete(table.path, _stressed(table, taken, stress)))
        taken, fields["stress"] = onset.loaded(table.path, taken, start)
        taken = mending.window(taken, window)
        taken = mending.check_times(table.path, taken)
        fields["strain"] = taken.values["strain"]
        onset.check_course(table.path, taken.values["t"], fields["strain"], fields["stress"][1])
    fields["sigma"] = taken.values.get("sigma")
    return build(table.path, CreepData, t=taken.values["t"], notes=once(taken.notes), **fields)


def read_indentation(
    path: str | os.PathLike, *, columns: dict | None = None, units: dict | None = None,
    segment: str | Sequence[str] | None = None, window: tuple[float | None, float | None] | None = None,
    curve: int | str | None = None, spring_constant: float | None = None, decimal: str | None = None,
) -> IndentationData:  # fmt: skip
    """Read time, load and depth of an indentation, or of a force curve.

    The curve is returned as measured; its method ``in_contact`` removes the points before contact.
    The depth of a force curve without one follows from the height and the cantilever, depth = z - load/k, counted
    from the first sample.

    Args:
        path: a text file (Hysitron, Optics11, Agilent, CSM, JPK text and others), or a force curve of a
            microscope (JPK, Igor, HDF5) through the library afmformats.
        columns: as in ``read_creep``, with the keys "t", "load", "depth", "height", and "sigma_depth" and "sigma_load"
            for columns of standard deviations, in the unit of depth or load if they have none of their own.
        units: {"load": "uN", "depth": "nm"}; they take precedence over the header.
        segment: the selected segments: "approach", "hold", "retract", or several of them.
        window: (begin, end) [s] of the file's clock, None for an open side.
        curve: which of several curves in the file, by position from 0 or by name.
        spring_constant: of the cantilever [N/m], where the file does not state it.
        decimal: the decimal mark, "." or ",", if it is ambiguous.

    Returns:
        The curve in SI, with notes on what was read and corrected.

    Raises:
        ValueError: a file that cannot be read, in a message of one line.
        ImportError: a microscope's format without afmformats.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "hold.txt"
        >>> rows = "".join(f"{t}\\t2\\t{3 + t}\\n" for t in range(6))
        >>> _ = file.write_text("Time (s)\\tLoad (uN)\\tDepth (nm)\\n" + rows)
        >>> print(fitting.read_indentation(file).load.max())
        2e-06
    """
    if afm.is_force_curve(path):
        if columns or units or decimal:
            raise ValueError(
                f"{os.fspath(path)}: columns, units, decimal: expected none for a force curve; they apply to text files"
            )
        found = afm.read(path, curve, spring_constant)
        data = build(os.fspath(path), IndentationData, **found)
    else:
        data = _indentation_text(path, columns, units, curve, spring_constant, decimal)
    data = data.only(segment) if isinstance(segment, str) else data.only(*(segment or ()))
    data = data.window(*window) if window else data
    before = data.contact.before
    if before <= AIR:
        return data
    note = f"{before} of {data.t.size} points are before contact: in_contact() leaves them out"
    return dataclasses.replace(data, notes=(*data.notes, note))


def read_force(
    path: str | os.PathLike, *, curve: int | str | None = None, spring_constant: float | None = None,
    sensitivity: float | None = None, columns: dict | None = None, units: dict | None = None,
    window: tuple[float | None, float | None] | None = None, decimal: str | None = None,
) -> IndentationData:  # fmt: skip
    """Read a force curve for ``fit_force``, with its baseline and all segments.

    Args:
        path: a force curve of JPK, Asylum (Igor), Bruker, AFM Workshop, HDF5 or NT-MDT through the library afmformats, or
            a text file as in ``read_indentation``.
        curve: which of several curves in the file, by position from 0 or by name.
        spring_constant: of the cantilever [N/m], where the file does not state it.
        sensitivity: of the deflection [m/V], where the file does not state it.
        columns, units, decimal: as in ``read_indentation``, for a text file.
        window: (begin, end) [s] of the file's clock, None for an open side.

    Returns:
        The curve in SI. If the file has no times, the points are numbered in their place, with a note.

    Raises:
        ValueError: a file that cannot be read, in a message of one line.
        ImportError: a microscope's format without afmformats.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "curve.txt"
        >>> rows = "".join(f"{t}\\t{max(t - 9, 0)}\\t{10 * t}\\n" for t in range(20))
        >>> _ = file.write_text("Time (s)\\tLoad (nN)\\tDepth (nm)\\n" + rows)
        >>> print(fitting.read_force(file).load.max())
        1e-08
    """
    if afm.is_force_curve(path) or afm.is_force_text(path):
        if columns or units or decimal:
            raise ValueError(
                f"{os.fspath(path)}: columns, units, decimal: expected none for a force curve; they apply to text files"
            )
        data = build(
            os.fspath(path),
            IndentationData,
            **afm.read(path, curve, spring_constant, sensitivity, untimed=True),
        )
    else:
        data = _indentation_text(path, columns, units, curve, spring_constant, decimal)
    return data.window(*window) if window else data


def _indentation_text(
    path: str | os.PathLike, columns: dict | None, units: dict | None, curve: int | str | None,
    spring_constant: float | None, decimal: str | None,
) -> IndentationData:  # fmt: skip
    """Read a text file with all segments, without selection."""
    table = read_table(path, decimal)
    columns, units = checked_options(table, columns, units, ("t", "load", "depth", "height", *ERRORS))
    raised = not any(has(block, DEPTH, columns) for block in table.blocks) and any(
        has(block, HEIGHT, columns) for block in table.blocks
    )
    errors = [
        Wanted(key, kind.names) for key, kind in zip(ERRORS, (DEPTH, LOAD), strict=True) if key in columns
    ]
    parts = curves_of(table, (CLOCK, LOAD, HEIGHT if raised else DEPTH, *errors), columns, units)
    parts = [
        part._replace(marks=(part.name,) * part.lines.size) if named(part.name) else part for part in parts
    ]
    one = all(named(part.name) for part in parts) and curve is None
    taken = mending.join(parts) if one else mending.choose(table.path, "curve", parts, curve)
    taken = mending.ordered(mending.complete(table.path, taken))
    t, load = taken.values["t"], taken.values["load"]
    if raised:
        k = spring_constant or _fact(SPRING_FACT, taken.before)
        depth, note = tip_depth(table.path, t, load, taken.values["height"], k)
        taken = taken.say(note)
    else:
        depth = taken.values["depth"]
    marks = label(taken.marks, load, depth) if taken.marks else None
    notes = once(taken.notes)
    known = {key: taken.values[key] for key in ERRORS if key in taken.values}
    return build(table.path, IndentationData, t=t, load=load, depth=depth, marks=marks, notes=notes, **known)


def checked_options(table: Table, columns: dict | None, units: dict | None, keys: tuple) -> tuple[dict, dict]:
    """Return the two dictionaries; ValueError for unknown keys."""
    for name, given in (("columns", columns), ("units", units)):
        for key in given or {}:
            if key not in keys:
                raise ValueError(f"{table.path}: {name}: expected keys among {list(keys)}, got {key!r}")
    chosen = list((columns or {}).values())
    if len(set(chosen)) < len(chosen):
        raise ValueError(f"{table.path}: columns: expected different columns, got {columns}")
    return columns or {}, units or {}


def _what(table: Table, columns: dict, stress: float | None) -> tuple[Wanted, ...]:
    """Return the wanted columns: compliance where a block has it, otherwise strain and stress."""
    some = lambda *wanted: any(all(has(block, one, columns) for one in wanted) for block in table.blocks)
    if some(COMPLIANCE) or not some(STRAIN):
        for others, what, reader in (
            ((MODULUS,), "a relaxation modulus", "read_relaxation"),
            ((STORAGE,), "a storage modulus", "read_oscillation"),
            ((SWEEP,), "a complex modulus", "read_oscillation"),
            ((LOAD, DEPTH), "load and depth", "read_indentation"),
        ):
            if not some(COMPLIANCE) and some(*others) and "J" not in columns:
                raise ValueError(
                    f"{table.path}: expected a creep compliance or strain and stress, got {what}: {reader} reads it"
                )
        return TIME, COMPLIANCE
    alone = stress is not None or _stated_stress(table.blocks[0].before) is not None
    if not some(STRAIN, STRESS) and not alone and "strain" not in columns:
        raise ValueError(
            f"{table.path}: column 'stress': expected one beside the strain, got none: give stress= [Pa]"
        )
    return (TIME, STRAIN, STRESS) if some(STRAIN, STRESS) else (TIME, STRAIN)


def _beside(table: Table, columns: dict, units: dict) -> list[Wanted]:
    """Return the stress, and the strain, in the columns beside a compliance; empty where the stress is missing or
    ambiguous."""
    blocks = [block for block in table.blocks if has(block, COMPLIANCE, columns)]

    def told(wanted: Wanted) -> bool:
        try:
            return bool(blocks) and all(locate(table, block, wanted, columns, units) for block in blocks)
        except (ValueError, AssertionError):
            return False

    return [wanted for wanted in (STRESS, STRAIN) if told(wanted)] if told(STRESS) else []


def curves_of(table: Table, wanted: tuple[Wanted, ...], columns: dict, units: dict) -> list[Series]:
    """Return the curves of a file: its blocks that have all wanted columns, split where the clock starts again."""
    blocks = [block for block in table.blocks if all(has(block, one, columns) for one in wanted)]
    if not blocks:  # report what the longest block lacks
        blocks = [max(table.blocks, key=lambda block: len(block.rows))]
        if len(blocks[0].rows) < mending.LEAST < blocks[0].width:
            raise ValueError(
                f"{table.path}: expected a row for each time, got {len(blocks[0].rows)} rows of {blocks[0].width} "
                "cells: transpose the table"
            )
        if blocks[0].header is None:
            example = {one.key: k for k, one in enumerate(wanted)}
            line, got = blocks[0].rows[0][0], columns or "none"
            raise ValueError(
                f"{table.path}: line {line}: no header, expected positions, columns={example} for instance, "
                f"and units=; got {got}"
            )
    found = []
    for block in blocks:
        places = {one.key: locate(table, block, one, columns, units) for one in wanted}
        for key, place in OF.items():
            if key in places and any("no unit" in note for note in places[key].notes):
                places[key] = places[key]._replace(factor=places[wanted[place].key].factor, notes=())
        if len({column.place for column in places.values()}) < len(places):
            raise ValueError(f"{table.path}: columns: expected different columns for {list(places)}")
        found += mending.runs(series(table, block, places))
    others = [block for block in table.blocks if block not in blocks and len(block.rows) > 1]
    if not others:
        return found
    first, last = others[0].rows[0][0], others[-1].rows[-1][0]
    return [
        part.say(f"{len(others)} other blocks of numbers, lines {first} to {last}, not read")
        for part in found
    ]


def _stressed(table: Table, taken: Series, stress: float | None) -> Series:
    """Return the series with a stress, from the file or the caller."""
    if "stress" in taken.values:
        if stress is not None:
            raise ValueError(
                f"{table.path}: stress: expected none for a file with a column of stress, got {stress!r}"
            )
        return taken
    value = _stated_stress(taken.before) if stress is None else float(stress)
    if not value or not np.isfinite(value):
        raise ValueError(f"{table.path}: stress: expected a stress in Pa that is not zero, got {value!r}")
    values = taken.values | {"stress": np.full(taken.lines.size, value)}
    return taken._replace(values=values).say(f"constant stress {value:g} Pa")


def _tension(table: Table, taken: Series, convention: str, nu: float | None) -> tuple[str, Series]:
    """Return the convention that the columns declare; a tensile test is never taken as shear."""
    columns = [taken.columns[key] for key in ("J", "strain", "stress") if key in taken.columns]
    tensile = [column.label for column in columns if (column.name or "").startswith("tensile")]
    if tensile and nu is None:
        raise ValueError(
            f"{table.path}: column {tensile[0]!r}: a tensile test needs nu= for J = 2 (1 + nu) D, got none"
        )
    if tensile and convention == "1/(2G)":
        raise ValueError(f"{table.path}: convention: expected 'D' for {tensile[0]!r}, got {convention!r}")
    if tensile:
        return "D", taken.say(f"{tensile[0]}: tension, J = 2 (1 + nu) D with nu = {nu:g}")
    if nu is not None and convention != "D":
        raise ValueError(
            f"{table.path}: nu: goes with tension, convention='D'; got convention={convention!r}"
        )
    silent = [column.label for column in columns if not says_shear(column.shown)]
    if convention == "J" and len(silent) == len(columns):
        return convention, taken.say(f"{silent[0]}: taken as shear; for tension give convention='D' and nu=")
    return convention, taken


def _fact(pattern: str, text: str) -> float | None:
    """Return a number that the text above the columns states, or None."""
    found = re.findall(pattern, text)
    try:
        return float(found[-1]) if found else None
    except ValueError:
        return None


def _stated_stress(text: str) -> float | None:
    """Return the one stress [Pa] that the text above the columns states with its unit ("Stress: 100 Pa"), or None."""
    found = set()
    for line in text.splitlines():
        parts = STATED.fullmatch(line)
        kind = parts and kind_of(parts["name"])
        if parts and kind in STRESS.names and unit_table.is_unit("stress", parts["unit"]):
            value = number(parts["value"], ".")
            value = number(parts["value"], ",") if value is None else value
            found |= set() if value is None else {value * unit_table.factor("stress", parts["unit"])}
    return found.pop() if len(found) == 1 else _fact(STRESS_FACT, text)


def once(notes: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(notes))


def build(path: str, cls: type, **fields: Any) -> Any:
    try:
        return cls(**fields)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
