"""Readers of delimited text: CSV, TSV and simple exports with lines before the header.

What is mended, because nothing is lost by it, and is always said in ``notes``: times out of order
are sorted; repeated times are kept as repeated measurements; rows with an empty or NaN cell, and
rows with J <= 0 (noise before the load, usually), are left out if they are at most a tenth of the
rows; a column without a unit is taken as SI. Everything else is a ValueError of one line that
names the file, the line and the column.
"""

import math
import os
import re
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from fitting import units as unit_table
from fitting.data import CONVENTIONS, CreepData, IndentationData

SYNONYMS = {
    "t": {"t", "time", "steptime", "testtime", "zeit"},
    "J": {"j", "j(t)", "jt", "compliance", "creepcompliance", "shearcompliance"},
    "strain": {"strain", "gamma", "shearstrain", "creepstrain"},
    "stress": {"stress", "shearstress", "tau"},
    "load": {"load", "force", "p", "f", "normalforce"},
    "depth": {"depth", "h", "indentation", "delta", "displacement", "indentationdepth"},
}
MISSING = {"", "nan", "na", "n/a", "null", "none", "-"}
LOSS = 0.1  # share of rows that may be left out


class Table(NamedTuple):
    """The header and data rows of a file: path, header cells or None, header's line, (line, cells) rows."""

    path: str
    header: list[str] | None
    line: int
    rows: list[tuple[int, list[str]]]
    comma: bool


class Column(NamedTuple):
    """Where a quantity is: position, name as shown, factor to SI, note or None."""

    place: int
    label: str
    factor: float
    note: str | None


def read_creep(
    path: str | os.PathLike, *, columns: dict | None = None, units: dict | None = None, convention: str = "J"
) -> CreepData:
    """Read time and compliance ("t [s]", "J [1/GPa]", "Creep Compliance [MPa^-1]", "J_1_per_Pa", ...).

    columns: {"t": header or zero-based position, "J": ...} where the header does not say it; units:
    {"t": "h", "J": "1/MPa"}, which take precedence over the header. Returns SI data. A file with
    strain and stress columns in place of J gives data with that stress history. Raises ValueError.
    """
    if convention not in CONVENTIONS:
        raise ValueError(f"convention: expected one of {sorted(CONVENTIONS)}, got {convention!r}")
    table = load(path, ("t", "J", "strain", "stress"), columns)
    wanted = (
        ("t", "J")
        if _has(table, "J", columns) or not _has(table, "strain", columns)
        else ("t", "strain", "stress")
    )
    arrays, notes = gather(table, wanted, columns, units, positive=("J",))
    if len(wanted) == 2:
        return _build(table, CreepData, notes, t=arrays[0], J=arrays[1], convention=convention)
    return _build(
        table, CreepData, notes, t=arrays[0], strain=arrays[1], stress=arrays[2], convention=convention
    )


def read_indentation(
    path: str | os.PathLike, *, columns: dict | None = None, units: dict | None = None
) -> IndentationData:
    """Read time, load and depth ("time_s", "force_N", "Depth (nm)", "Load (µN)", ...); as ``read_creep``."""
    table = load(path, ("t", "load", "depth"), columns)
    arrays, notes = gather(table, ("t", "load", "depth"), columns, units)
    return _build(table, IndentationData, notes, t=arrays[0], load=arrays[1], depth=arrays[2])


def _build(table: Table, cls: type, notes: list[str], **fields: object) -> Any:
    try:
        return cls(notes=tuple(notes), **fields)
    except ValueError as error:
        raise ValueError(f"{table.path}: {error}") from None


def load(path: str | os.PathLike, kinds: tuple[str, ...], columns: dict | None) -> Table:
    """Split a file into header and rows. The header is the last line before the numbers that has letters."""
    name = os.fspath(path)
    for key in columns or {}:
        if key not in kinds:
            raise ValueError(f"{name}: columns: expected keys among {list(kinds)}, got {key!r}")
    lines = [(k, text) for k, text in enumerate(_text(name).splitlines(), 1) if text.strip()]
    lines = [(k, text) for k, text in lines if not text.lstrip().startswith("#")]
    if not lines:
        raise ValueError(f"{name}: expected a table, got an empty file")
    separator, comma = _separator([text for _, text in lines])
    cells = [(k, _split(text, separator)) for k, text in lines]
    first = next((i for i, (_, row) in enumerate(cells) if len(row) > 1 and _numeric(row, comma)), None)
    if first is None:
        raise ValueError(f"{name}: line {lines[-1][0]}: expected rows of at least two numbers, got none")
    header = cells[first - 1] if first else None
    if header and len(header[1]) < 2:
        header = None
    return Table(name, header[1] if header else None, header[0] if header else 0, cells[first:], comma)


def _text(name: str) -> str:
    """The file's text: UTF-8 with or without mark, UTF-16 with mark, else Latin-1."""
    try:
        raw = Path(name).read_bytes()
    except OSError as error:
        raise ValueError(f"{name}: cannot be read: {error.strerror}") from None
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16", errors="replace")
    if b"\0" in raw:
        raise ValueError(f"{name}: expected delimited text, got binary data")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _separator(lines: list[str]) -> tuple[str | None, bool]:
    """(separator, whether the comma is a decimal mark); None is any white space."""
    body = lines[len(lines) // 2 :]
    for separator in ("\t", ";"):
        if all(separator in line for line in body):
            return separator, not any("." in line for line in body) and any("," in line for line in body)
    return ("," if all("," in line for line in body) else None), False


def _split(text: str, separator: str | None) -> list[str]:
    return [cell.strip().strip('"') for cell in text.strip("\r\n ").split(separator)]


def _number(cell: str, comma: bool) -> float:
    return float(cell.replace(",", ".") if comma else cell)


def _numeric(row: list[str], comma: bool) -> bool:
    """A row of data: two numbers, or one beside cells that are missing."""
    count = _number_count(row, comma)
    return count >= 2 or (
        count == 1 and all(c.lower() in MISSING for c in row if not _number_count([c], comma))
    )


def _number_count(row: list[str], comma: bool) -> int:
    count = 0
    for cell in row:
        try:
            _number(cell, comma)
            count += 1
        except ValueError:
            pass
    return count


def _heading(cell: str) -> tuple[str, str | None]:
    """(plain name, unit or None) of "J [1/GPa]", "Depth (nm)", "time / s", "time_s", "J_1_per_Pa"."""
    bracket = re.fullmatch(r"(.*?)\s*[\[(]([^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])]\s*", cell)
    if bracket and bracket.group(1) and not (bracket.group(1).lower() == "j" and bracket.group(2) == "t"):
        return _plain(bracket.group(1)), bracket.group(2)
    for mark in (" / ", " in ", "_"):
        name, found, unit = cell.partition(mark)
        if found and _plain(name) in set().union(*SYNONYMS.values()):
            return _plain(name), unit
    return _plain(cell), None


def _plain(name: str) -> str:
    return re.sub(r"[\s_\-]", "", name).lower()


def _has(table: Table, kind: str, columns: dict | None) -> bool:
    return kind in (columns or {}) or any(_heading(cell)[0] in SYNONYMS[kind] for cell in table.header or [])


def locate(table: Table, kind: str, position: int, columns: dict | None, units: dict | None) -> Column:
    """Find the column of ``kind``; ``position`` serves only in a file without a header."""
    index, notes = _index(table, kind, position, columns)
    heading = table.header[index] if table.header else f"column {index + 1}"
    unit = (units or {}).get(kind)
    said = _heading(table.header[index])[1] if table.header else None
    text = unit if unit is not None else said
    if text is None:
        notes.append(f"{heading}: no unit, taken as {next(iter(unit_table.KINDS[kind]))}")
        return Column(index, heading, 1.0, "; ".join(notes))
    try:
        return Column(index, heading, unit_table.factor(kind, str(text)), "; ".join(notes) or None)
    except KeyError:
        accepted = unit_table.accepted(kind)
        _fail(table, table.line, heading, f"expected a unit among {accepted}; got {text!r}")


def _index(table: Table, kind: str, position: int, columns: dict | None) -> tuple[int, list[str]]:
    """Position of the column, and notes on how it was found."""
    choice = (columns or {}).get(kind)
    if isinstance(choice, int) and not isinstance(choice, bool):
        width = len(table.header or table.rows[0][1])
        if not 0 <= choice < width:
            raise ValueError(f"{table.path}: columns[{kind!r}]: expected 0 to {width - 1}, got {choice}")
        return choice, []
    if table.header is None:
        if choice is not None:
            raise ValueError(
                f"{table.path}: columns[{kind!r}]: the file has no header, expected a position, got {choice!r}"
            )
        if position >= len(table.rows[0][1]):
            _fail(
                table, table.rows[0][0], kind, f"expected {position + 1} columns, got {len(table.rows[0][1])}"
            )
        return position, [f"no header: column {position + 1} taken as {kind}"]
    if choice is not None:
        hits = [i for i, cell in enumerate(table.header) if cell == choice]
    else:
        hits = [i for i, cell in enumerate(table.header) if _heading(cell)[0] in SYNONYMS[kind]]
        known = [i for i in hits if _readable(kind, table.header[i])]
        hits = known or hits  # "Depth (nm)" beside "Depth (V)"
    if len(hits) != 1:
        found = "none" if not hits else " and ".join(repr(table.header[i]) for i in hits)
        _fail(
            table,
            table.line,
            kind,
            f"expected one column for {choice or kind!r} in {table.header}; got {found}",
        )
    return hits[0], []


def _readable(kind: str, cell: str) -> bool:
    unit = _heading(cell)[1]
    try:
        return unit is None or bool(unit_table.factor(kind, unit))
    except KeyError:
        return False


def gather(
    table: Table,
    kinds: tuple[str, ...],
    columns: dict | None,
    units: dict | None,
    positive: tuple[str, ...] = (),
) -> tuple[list[np.ndarray], list[str]]:
    """Columns of ``kinds`` in SI, mended, and the notes."""
    for key in units or {}:
        if key not in kinds:
            raise ValueError(f"{table.path}: units: expected keys among {list(kinds)}, got {key!r}")
    places = [_index(table, kind, k, columns)[0] for k, kind in enumerate(kinds)]
    if len(set(places)) < len(places):
        raise ValueError(f"{table.path}: columns: expected different columns for {list(kinds)}")
    found = [locate(table, kind, k, columns, units) for k, kind in enumerate(kinds)]
    values, lines = _values(table, found)
    notes = [c.note for c in found if c.note]
    keep = _kept(table, found, kinds, values, lines, positive, notes)
    values = values[keep]
    if np.any(values[:, 0] < 0):
        row = int(np.flatnonzero(keep)[np.argmax(values[:, 0] < 0)])
        _fail(
            table, lines[row], found[0].label, f"expected times >= 0, got {values[values[:, 0] < 0][0, 0]:g}"
        )
    values = _ordered(values, notes)
    return [values[:, k] * c.factor for k, c in enumerate(found)], notes


def _values(table: Table, found: list[Column]) -> tuple[np.ndarray, list[int]]:
    """Numbers as they stand (rows, columns), NaN where missing, and the lines they are from."""
    numbers = np.empty((len(table.rows), len(found)))
    for i, (line, row) in enumerate(table.rows):
        for k, column in enumerate(found):
            numbers[i, k] = _cell(table, line, row, column)
    return numbers, [line for line, _ in table.rows]


def _cell(table: Table, line: int, row: list[str], column: Column) -> float:
    if column.place >= len(row):
        _fail(table, line, column.label, f"expected {column.place + 1} columns or more, got {len(row)}")
    width = len(table.header) if table.header else len(table.rows[0][1])
    if len(row) > width and any(row[width:]):
        _fail(table, line, column.label, f"expected {width} columns, got {len(row)}")
    cell = row[column.place]
    if cell.lower() in MISSING:
        return math.nan
    try:
        value = _number(cell, table.comma)
    except ValueError:
        _fail(table, line, column.label, f"expected a number, got {cell[:40]!r}")
    if math.isinf(value):
        _fail(table, line, column.label, f"expected a finite number, got {cell!r}")
    return value


def _kept(
    table: Table, found: list[Column], kinds: tuple[str, ...], values: np.ndarray, lines: list[int],
    positive: tuple[str, ...], notes: list[str],
) -> np.ndarray:  # fmt: skip
    """Rows that stay: without missing cells, and with J > 0."""
    keep = np.ones(len(values), dtype=bool)
    for k, column in enumerate(found):
        checks = [(np.isnan(values[:, k]), "an empty or NaN cell", "numbers")]
        if kinds[k] in positive:
            checks.append((values[:, k] <= 0, "a value <= 0", "values > 0"))
        for bad, what, expected in checks:
            if not bad.any():
                continue
            line = lines[int(np.argmax(bad))]
            if bad.sum() > LOSS * len(values):
                _fail(
                    table,
                    line,
                    column.label,
                    f"expected {expected}, got {what} in {bad.sum()} of {len(bad)} rows",
                )
            notes.append(f"{column.label}: {bad.sum()} rows with {what} left out, the first in line {line}")
            keep &= ~bad
    return keep


def _ordered(values: np.ndarray, notes: list[str]) -> np.ndarray:
    """Rows by time, with a note on what was out of order or repeated."""
    back = int(np.sum(np.diff(values[:, 0]) < 0))
    if back:
        notes.append(f"times sorted: {back} of {len(values)} steps went back")
        values = values[np.argsort(values[:, 0], kind="stable")]
    same = int(np.sum(np.diff(values[:, 0]) == 0))
    if same:
        notes.append(f"{same} repeated times kept as repeated measurements")
    return values


def _fail(table: Table, line: int, column: str, what: str) -> NoReturn:
    raise ValueError(f"{table.path}: line {line}, column {column!r}: {what}")
