"""Blocks of numbers in a text; an export may hold several, each with its own header."""

import itertools
import os
import re
from collections import Counter
from typing import NamedTuple

from fitting.io.cells import Dialect, choose, is_data, number, split
from fitting.io.header import Header, find_header, known
from fitting.io.text import Line, read_lines

Row = tuple[int, list[str]]
FOREIGN = 3  # number of lines in another dialect that is not accidental
NAMES = (
    r"(?m)^\[step\]\s*\n(?P<name>.+)",  # TRIOS
    r"(?m)^segment:\s*(?P<name>\S.*)",  # JPK
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


def read_table(path: str | os.PathLike, decimal: str | None = None) -> Table:
    """Split a file into blocks, each of which begins with a line of known column names.

    Args:
        path: of a text file.
        decimal: the decimal mark, "." or ",", if it is ambiguous.

    Raises:
        ValueError: no file, no text, no rows of numbers.
    """
    name = os.fspath(path)
    if decimal not in (None, ".", ","):
        raise ValueError(f"decimal: expected '.' or ',', got {decimal!r}")
    lines = read_lines(path)
    dialect = choose(name, lines, decimal)
    blocks: list[Block] = []
    for before, rows in _groups(lines, dialect):
        _check_words(name, before, dialect)
        header = find_header(before, _width(rows), dialect.separator) if rows else None
        if not blocks or (header and known(header.cells)):
            text = "\n".join(line.text for line in before)
            width = len(header.cells) if header else _width(rows)
            blocks.append(Block(_name(text), text, header, width, list(rows)))
        else:
            blocks[-1].rows.extend(_as_rows(before, dialect) + rows)
    return Table(name, dialect, blocks)


def _groups(lines: list[Line], dialect: Dialect) -> list[tuple[list[Line], list[Row]]]:
    """Return groups of text lines, each with the rows of numbers that follow."""
    rows = [(line, split(line.text, dialect.separator)) for line in lines]
    runs = itertools.groupby(rows, lambda row: not row[0].remark and is_data(row[1], dialect.decimal))
    groups: list[tuple[list[Line], list[Row]]] = [([], [])]
    for numbers, run in runs:
        if numbers:
            groups[-1][1].extend((line.number, cells) for line, cells in run)
        else:
            groups.append(([line for line, _ in run], []))
    return [group for group in groups if any(group)]


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
