"""The readers of indentation curves: delimited text of any instrument, and force curves of microscopes."""

import dataclasses
import itertools
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.data.contact import UNTIMED, label, named, tip_depth
from fitting.data.indentation import ERRORS, LEAVE_OUT, IndentationData
from fitting.read import cleaning, force_curves
from fitting.read.columns import Wanted, having
from fitting.read.curves import (
    DEPTH,
    LOAD,
    build,
    curves_of,
    once,
    stated_facts,
    stated_number,
)
from fitting.read.table import is_data, read_table

CLOCK = Wanted("t", ("time", "step time"))
HEIGHT = Wanted("height", ("height", "smoothed height", "commanded height"))
SEPARATION = Wanted("separation", ("separation",))
AIR = 5  # number of points before contact below which no note is made
SPRING_FACT = r"(?im)^(?:spring\s?constant|k \(N/m\))[\s:=,]*([0-9.eE+-]+)(?:\s*N/m)?\s*$"  # JPK, Optics11


def read_indentation(
    path: str | os.PathLike, *, columns: dict | None = None, units: dict | None = None,
    segment: str | Sequence[str] | None = None, window: tuple[float | None, float | None] | None = None,
    curve: int | str | None = None, spring_constant: float | None = None, decimal: str | None = None,
) -> IndentationData:  # fmt: skip
    """Read time, load and depth of an indentation, or of a force curve.

    The curve is returned as measured; its method ``in_contact`` removes the points before contact.
    The depth of a force curve without one is the separation of tip and sample with the other sign, or else follows from
    the height and the cantilever, depth = z - load/k, counted from the first sample.

    Args:
        path: a text file (Hysitron, Optics11, Agilent, CSM, JPK text and others), or a force curve of a
            microscope: of Bruker, of Asylum (ARDF; Igor with igor2), or (JPK, HDF5) through the library afmformats.
        columns: as in ``read_creep``, with the keys "t", "load", "depth", "height", "separation" (of tip and sample), and
            "sigma_depth" and "sigma_load" for columns of standard deviations, in the unit of depth or load if they have
            none of their own.
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
        ImportError: a microscope's format without afmformats, or igor2.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "hold.txt"
        >>> rows = "".join(f"{t}\\t2\\t{3 + t}\\n" for t in range(6))
        >>> _ = file.write_text("Time (s)\\tLoad (uN)\\tDepth (nm)\\n" + rows)
        >>> print(fitting.read_indentation(file).load.max())
        2e-06
    """
    if force_curves.is_force_curve(path):
        _require_no_text_options(path, columns or units or decimal)
        found = force_curves.read(path, curve, spring_constant)
        data = build(os.fspath(path), IndentationData, **found)
    else:
        data = _indentation_text(path, columns, units, curve, spring_constant, decimal)
    data = data.only(segment) if isinstance(segment, str) else data.only(*(segment or ()))
    data = data.window(*window) if window else data
    before = data.contact.before
    if before <= AIR:
        return data
    note = f"{before} of {data.t.size} points are before contact: {LEAVE_OUT}"
    return dataclasses.replace(data, notes=(*data.notes, note))


def read_force(
    path: str | os.PathLike, *, curve: int | str | None = None, spring_constant: float | None = None,
    sensitivity: float | None = None, columns: dict | None = None, units: dict | None = None,
    window: tuple[float | None, float | None] | None = None, decimal: str | None = None,
) -> IndentationData:  # fmt: skip
    """Read a force curve for ``fit_force``, with its baseline and all segments.

    Args:
        path: a force curve of Bruker (NanoScope: a ramp or a force volume), of Asylum (ARDF; an Igor wave with igor2), or
            of JPK, AFM Workshop or HDF5 through the library afmformats, or a text file as in ``read_indentation``, which
            needs no times here.
        curve: which of several curves in the file, by position from 0 or by name.
        spring_constant: of the cantilever [N/m], where the file does not state it.
        sensitivity: of the deflection [m/V], where the file does not state it.
        columns, units, decimal: as in ``read_indentation``, for a text file.
        window: (begin, end) [s] of the file's clock, None for an open side.

    Returns:
        The curve in SI. If the file has no times, the points are numbered in their place, with a note.

    Raises:
        ValueError: a file that cannot be read, in a message of one line.
        ImportError: a microscope's format without afmformats, or igor2.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "curve.txt"
        >>> rows = "".join(f"{t}\\t{max(t - 9, 0)}\\t{10 * t}\\n" for t in range(20))
        >>> _ = file.write_text("Time (s)\\tLoad (nN)\\tDepth (nm)\\n" + rows)
        >>> print(fitting.read_force(file).load.max())
        1e-08
    """
    if force_curves.is_force_curve(path) or force_curves.is_force_text(path):
        _require_no_text_options(path, columns or units or decimal)
        data = build(
            os.fspath(path),
            IndentationData,
            **force_curves.read(path, curve, spring_constant, sensitivity, untimed=True),
        )
    else:
        given = path, columns, units, curve, spring_constant, decimal
        data = _indentation_text(*given, untimed=True)
        if "depth" not in (columns or {}) and np.ptp(data.depth[: data.depth.size // 20 + 2]) == 0.0:
            # Optics11 writes zeros before its own contact point, where a baseline needs the way
            data = _indentation_text(*given, untimed=True, raised=True)
    return data.window(*window) if window else data


def _require_no_text_options(path: str | os.PathLike, given: Any) -> None:
    """Raise ValueError if options for text files are given with a force curve of a microscope."""
    if given:
        raise ValueError(
            f"{os.fspath(path)}: columns, units, decimal: expected none for a force curve; they apply to text files"
        )


def _indentation_text(
    path: str | os.PathLike, columns: dict | None, units: dict | None, curve: int | str | None,
    spring_constant: float | None, decimal: str | None, untimed: bool = False, raised: bool = False,
) -> IndentationData:  # fmt: skip
    """Read a text file with all segments, without selection.

    untimed: whether a file without times is accepted; raised: whether a height is preferred to a depth.
    """
    keys = ("t", "load", "depth", "height", "separation", *ERRORS)
    table = read_table(path, decimal, columns, units, keys)
    untimed = untimed and not having(table, CLOCK)
    if untimed and "t" not in table.columns:
        # with a last column of times that numbers the rows
        blocks, count, places = [], itertools.count(), table.columns
        for block in table.blocks:
            rows = [(line, cells + [""] * (block.width - len(cells))) for line, cells in block.rows]
            rows = [
                (line, [*cells, str(next(count))] if is_data(cells, table.dialect.decimal) else cells)
                for line, cells in rows
            ]
            head = block.header
            if head:
                head = head._replace(cells=[*head.cells, "time"], units=[*head.units, "s"])
            else:
                places = {**places, "t": block.width}
            blocks.append(block._replace(header=head, width=block.width + 1, rows=rows))
        table = table._replace(blocks=blocks, columns=places, units={**table.units, "t": "s"})
    # the depth in its own column, or the separation of tip and sample, or the height of the base
    way = DEPTH
    if "height" in table.columns:
        way = HEIGHT
    elif not having(table, DEPTH) or raised or "separation" in table.columns:
        way = next((one for one in (SEPARATION, HEIGHT) if having(table, one)), DEPTH)
    errors = [
        Wanted(key, kind.names)
        for key, kind in zip(ERRORS, (DEPTH, LOAD), strict=True)
        if key in table.columns
    ]
    parts = curves_of(table, (CLOCK, LOAD, way, *errors), "read_indentation", curve)
    parts = [
        part._replace(marks=(part.name,) * part.lines.size) if named(part.name) else part for part in parts
    ]
    one = all(named(part.name) and not part.error for part in parts) and curve is None
    taken = cleaning.join(parts) if one else cleaning.choose(table.path, "curve", parts, curve)
    taken = cleaning.ordered(cleaning.complete(table.path, taken))
    t, load = taken.values["t"], taken.values["load"]
    depth = taken.values[way.key]
    if way is SEPARATION:
        depth, taken = -depth, taken.say(f"depth from {taken.columns[way.key].label!r}, with the other sign")
    if way is HEIGHT:
        k = spring_constant or stated_number(SPRING_FACT, taken.before)
        depth, note = tip_depth(table.path, t, load, depth, k)
        taken = taken.say(note) if note else taken
    marks = label(taken.marks, load, depth) if taken.marks else None
    notes = once((*taken.notes, *stated_facts(taken.before), *([UNTIMED] if untimed else [])))
    known = {key: taken.values[key] for key in ERRORS if key in taken.values}
    return build(
        table.path,
        IndentationData,
        t=t,
        load=load,
        depth=depth,
        marks=marks,
        notes=notes,
        numbered=untimed,
        **known,
    )
