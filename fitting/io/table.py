"""Blocks of numbers in a text; an export may hold several, each with its own header."""

import itertools
import os
import re
from collections import Counter
from typing import NamedTuple

from fitting.data import units
from fitting.io.cells import Dialect, choose, is_data, is_missing, number, split
from fitting.io.header import Header, before_gap, find_header, known
from fitting.io.names import read_heading
from fitting.io.text import Line, read_lines

Row = tuple[int, list[str]]
LEAST = 5  # fewest numbers in a line of a table that lies on its side
FEW = 5  # rows, or a tenth of those before, of a table of statistics after the curve
ASIDE = {
    "omega": "Frequency",
    "t": "Time",
    "depth": "Depth",
}  # abscissae of such a table whose numbers carry their units
FOREIGN = 3  # number of lines in another dialect that is not accidental
NAMES = (
    r"(?m)^\[step\]\s*\n(?P<name>.+)",  # TRIOS
    r"(?m)^segment:\s*(?P<name>\S.*)",  # JPK
    r"(?m)^<(?P<name>(?!/|END |INFO|DATA|DIVIDER|Mach-1)[^<>\n]+)>",  # Mach-1
    r"(?im)^(?P<name>interval)l?\b[^:\n]*(?:point|punkte)[^:\n]*:\W*(?P<number>\d+)",  # Anton Paar
)


class Block(NamedTuple):
    """A block of numbers.

    name: of the step, interval or segment, "" if it has none; before: the text above; header; width: number of cells of
    a complete row; rows: (line, cells) of numbers, and of text between or after them.
    """

    name: str
    before: str
    header: Header | None
    width: int
    rows: list[Row]


class Table(NamedTuple):
    """The blocks of a file and its dialect."""

    path: str
    dialect: Dialect
    blocks: list[Block]


def read_table(path: str | os.PathLike, decimal: str | None = None, columns: dict | None = None) -> Table:
    """Split a file into blocks, each of which begins with a line of known column names.

    Args:
        path: of a text file.
        decimal: the decimal mark, "." or ",", if it is ambiguous.
        columns: of the caller; tables side by side are one block where they have positions, which are those of the file.

    Raises:
        ValueError: no file, no text, no rows of numbers.
    """
    name = os.fspath(path)
    if decimal not in (None, ".", ","):
        raise ValueError(f"decimal: expected '.' or ',', got {decimal!r}")
    lines = read_lines(path)
    dialect = choose(name, lines, decimal)
    blocks: list[Block] = []
    groups = _groups(lines, dialect)
    for k, (before, rows) in enumerate(groups):
        _check_words(name, before, dialect)
        header = find_header(before, _width(rows), dialect.separator) if rows else None
        text = "\n".join(line.text for line in before)
        sheet = any(line.text.strip() == "[step]" for line in before)
        if sheet and not rows and blocks:
            continue  # a sheet of words
        if (
            not blocks
            or sheet
            or (header and (known(header.cells) or _after(blocks[-1], groups[k:], dialect)))
        ):
            width = len(header.cells) if header else _width(rows)
            blocks.append(Block(_name(text), text, header, width, list(rows)))
        else:
            blocks[-1].rows.extend(_as_rows(before, dialect) + rows)
    if not any(block.header and known(block.header.cells) > 1 for block in blocks):
        blocks = _on_side(lines, dialect) or blocks
    if not any(isinstance(one, int) for one in (columns or {}).values()):
        blocks = [part for block in blocks for part in _apart(block, dialect)]
    return Table(name, dialect, blocks)


def _after(last: Block, groups: list[tuple[list[Line], list[Row]]], dialect: Dialect) -> bool:
    """Return whether all that follows a block is small beside it and has no known names: statistics of the curve."""
    headers = [find_header(before, _width(rows), dialect.separator) for before, rows in groups if rows]
    few = sum(len(rows) for _, rows in groups) <= min(max(FEW, len(last.rows) // 10), len(last.rows) // 2)
    return few and not any(header and known(header.cells) for header in headers)


def _on_side(lines: list[Line], dialect: Dialect) -> list[Block]:
    """Return the tables of a file whose quantities stand in lines: a known name, then numbers, at least two such lines.

    The line above the first may have the abscissa, with a unit in each cell ("0.1 Hz", "1 Hz").
    """
    found: list[Block] = []
    group: list[tuple[Line, str, list[str]]] = []
    abscissa: tuple[Line, str, list[str]] | None = None
    before: list[str] = []
    for line in [*lines, Line(0, "", False)]:
        cells = split(line.text, dialect.separator)
        while cells and not cells[-1]:
            cells.pop()
        name, values = (cells[0], cells[1:]) if cells else ("", [])
        if values and any(units.is_unit(kind, values[0].strip("[]() ")) for kind in units.KINDS if values[0]):
            name, values = f"{name} [{values[0].strip('[]() ')}]", values[1:]
        numbers = sum(number(cell, dialect.decimal) is not None for cell in values)
        fits = numbers >= LEAST and number(name, dialect.decimal) is None and bool(name)
        if fits and all(is_missing(cell) or number(cell, dialect.decimal) is not None for cell in values):
            group.append((line, name, values))
            continue
        every = ([abscissa] if abscissa else []) + group
        kinds = [kind for _, name, _ in every if (kind := read_heading(name).kind)]
        if len(kinds) > 1 and len(set(kinds)) == len(kinds) and len(every) == len({one[1] for one in every}):
            width, first = len(every), every[0][0].number
            longest = max(len(values) for *_, values in every)
            columns = [values + [""] * (longest - len(values)) for *_, values in every]
            text = "\n".join(before)
            rows = [(first, list(row)) for row in zip(*columns, strict=True)]
            found.append(
                Block(_name(text), text, Header([one[1] for one in every], [""] * width, first), width, rows)
            )
        if group:
            group, before = [], []
        before.append(line.text)
        abscissa = _abscissa(line, cells, dialect)
    return found


def _abscissa(line: Line, cells: list[str], dialect: Dialect) -> tuple[Line, str, list[str]] | None:
    """Return (line, name, numbers) of a line whose cells are numbers with one and the same unit, None for another line."""
    parts = [cell.rpartition(" ") for cell in cells[1:] if cell]
    unit = {last for _, _, last in parts}
    if (
        len(parts) < LEAST
        or len(unit) != 1
        or any(number(one, dialect.decimal) is None for one, _, _ in parts)
    ):
        return None
    text = unit.pop()
    kind = next((kind for kind in ASIDE if units.is_unit(kind, text)), None)
    known_name = cells[0] if read_heading(cells[0]).kind else ASIDE.get(kind or "")
    return (line, f"{known_name} [{text}]", [one for one, _, _ in parts]) if known_name and kind else None


def _apart(block: Block, dialect: Dialect) -> list[Block]:
    """Return the tables that stand side by side in a block, whose names repeat ("X, Y, X, Y"), each with its own rows.

    The line above the names may have the name of each table over its first column.
    """
    if block.header is None:
        return [block]
    cells = [re.sub(r"\.\d+$", "", cell) for cell in block.header.cells]  # pandas numbers equal names
    labels = [cell and f"{cell}\n{unit}" for cell, unit in zip(cells, block.header.units, strict=True)]
    first = next((label for label in labels if label), "")
    starts = [k for k, label in enumerate(labels) if label == first]
    ends = [*starts[1:], len(labels)]
    groups = [labels[a:b] for a, b in zip(starts, ends, strict=True)]
    for group in groups:
        while group and not group[-1]:
            group.pop()
    size = len(groups[0])
    if (
        len(starts) < 2
        or size < 2
        or any(group != groups[0] for group in groups)
        or len(set(groups[0])) < size
    ):
        return [block]
    above = [split(line, dialect.separator) for line in block.before.splitlines()]
    named = [
        row
        for row in above
        if {k for k, cell in enumerate(row) if cell} == set(starts) and row != block.header.cells
    ]
    found = []
    for start in starts:
        rows = [(line, row[start : start + size]) for line, row in block.rows]
        rows = [(line, row) for line, row in rows if not all(map(is_missing, row))]
        name = named[-1][start] if named else f"columns {start + 1} to {start + size}"
        header = block.header._replace(
            cells=cells[start : start + size], units=block.header.units[start : start + size]
        )
        if rows:
            found.append(Block(f"{block.name} {name}".strip(), block.before, header, size, rows))
    return found


def _groups(lines: list[Line], dialect: Dialect) -> list[tuple[list[Line], list[Row]]]:
    """Return groups of text lines, each with the rows of numbers that follow."""
    rows = [(line, split(line.text, dialect.separator)) for line in lines]
    runs = itertools.groupby(rows, lambda row: not row[0].remark and _is_row(row[1], dialect.decimal))
    groups: list[tuple[list[Line], list[Row]]] = [([], [])]
    for numbers, run in runs:
        if numbers:
            groups[-1][1].extend((line.number, cells) for line, cells in run)
        else:
            groups.append(([line for line, _ in run], []))
    return [group for group in groups if any(group)]


def _is_row(cells: list[str], decimal: str) -> bool:
    """Return whether cells are a row of numbers, which may have words beside the table, beyond an empty cell."""
    own = before_gap(cells)
    return is_data(cells, decimal) or (len(own) > 1 and _all_numbers(own, decimal))


def _check_words(path: str, lines: list[Line], dialect: Dialect) -> None:
    """Raise ValueError where the text between numbers consists of numbers in another dialect."""
    for other in itertools.starmap(Dialect, itertools.product(",;\t", ".,")):
        cells = [split(line.text, other.separator) for line in lines if not line.remark]
        hits = [row for row in cells if len(row) > 1 and _all_numbers(row, other.decimal)]
        if other != dialect and len(hits) >= FOREIGN:
            raise ValueError(
                f"{path}: line {lines[0].number}: expected one separator and decimal mark throughout, got others in "
                f"{len(hits)} lines: write all lines in one dialect"
            )


def _all_numbers(row: list[str], decimal: str) -> bool:
    return all(number(cell, decimal) is not None for cell in row)


def _as_rows(lines: list[Line], dialect: Dialect) -> list[Row]:
    """Return text lines as rows, except remarks."""
    return [(line.number, split(line.text, dialect.separator)) for line in lines if not line.remark]


def _width(rows: list[Row]) -> int:
    """Return the most common number of cells."""
    return Counter(len(cells) for _, cells in rows).most_common(1)[0][0]


def _name(text: str) -> str:
    """Return the name that the lines above a block state."""
    found = [match.groupdict() for pattern in NAMES for match in re.finditer(pattern, text)]
    if not found:
        return ""
    return " ".join(filter(None, (found[-1]["name"].strip(), found[-1].get("number"))))
