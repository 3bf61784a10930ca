"""Detection of the header of a block of numbers, and of a line of units, among the preceding lines."""

import re
from typing import NamedTuple

from fitting.data import units
from fitting.io.cells import number, split
from fitting.io.names import FACTOR, KINDS, read_heading
from fitting.io.text import Line


class Header(NamedTuple):
    """A header: cells: names, with units where they have them; units: of a line of units; line: number of the line of
    names."""

    cells: list[str]
    units: list[str]
    line: int


def find_header(lines: list[Line], width: int, separator: str | None) -> Header | None:
    """Return the line with the most known names over matching columns; without any, the last line of ``width`` words."""
    best: tuple[tuple, list[str]] | None = None
    for k, line in enumerate(lines):
        cells = _cells(line.text, width, separator)
        rank = (known(cells) > 0, len(cells) >= width, known(cells), k)
        if cells and (best is None or rank > best[0]):
            best = rank, cells
    if best is None:
        return None
    (*_, k), cells = best
    found = _units(lines[k + 1 :], cells, separator)
    if not any(found) and k > 0:
        above = _under(split(lines[k - 1].text, separator), len(cells))
        found = above if above and all(map(_fits, cells, above)) else found
    return Header(cells, _with_factors(lines[k + 1 :], found, separator), lines[k].number)


def _cells(text: str, width: int, separator: str | None) -> list[str]:
    """Return the line's cells as a header, [] if it is not one: matching names, else several names, else words."""
    every = [_trimmed(cells, width) for cells in ways_to_split(text, separator)]
    if separator is not None and not _may_be_header(every[0]):
        every[0] = before_gap(every[0])  # a stray number beside the table
    ways = [cells for cells in every if _may_be_header(cells)]
    for cells in ways:
        own = separator is not None and cells is every[0]
        if known(cells) and (len(cells) == width or (own and known(cells) >= 2)):
            return cells
    several = max(ways, key=known, default=[])
    if known(several) >= 2:
        return several
    return every[0] if every[0] in ways and len(every[0]) == width else []


def _may_be_header(cells: list[str]) -> bool:
    """Return whether there are at least two cells, no number, and not only units."""
    words = [cell.strip("[]() ") for cell in cells if cell]
    numbers = any(number(cell, mark) is not None for cell in cells for mark in ".,")
    return len(cells) >= 2 and not numbers and not all(map(_is_any_unit, words))


def before_gap(cells: list[str]) -> list[str]:
    """Return the cells up to the first empty one after a filled one: what stands beyond it is beside the table."""
    first = next((k for k, cell in enumerate(cells) if cell), 0)
    return cells[: next((k for k in range(first, len(cells)) if not cells[k]), len(cells))]


def _is_any_unit(text: str) -> bool:
    return any(units.is_unit(kind, text) for kind in units.KINDS)


def known(cells: list[str]) -> int:
    """Return the number of known names."""
    return sum(read_heading(cell).kind is not None for cell in cells)


def ways_to_split(text: str, separator: str | None) -> list[list[str]]:
    """Return the possible splits of a header, whose separator may differ from that of the numbers."""
    ways = [split(text, separator)] + [split(text, other) for other in ("\t", ";", ",")]
    ways.append(re.split(r"\t|\s{2,}", text.strip()))
    ways.append([a or b for a, b in re.findall(r'"([^"]*)"|(\S+)', text)])
    ways.append([cell.strip(" ,;") for cell in re.findall(r"[^\[(]+[\[(][^\])]*[\])]+", text)])
    ways.append(re.split(r"\s+(?![\[(])", text.strip()))
    return ways


def _trimmed(cells: list[str], width: int) -> list[str]:
    """Return the cells without empty ones at the end, and without a label ("columns:") that has no column."""
    while len(cells) > 1 and not cells[-1]:
        cells = cells[:-1]
    return cells[1:] if len(cells) == width + 1 and cells[0][-1:] in ("", ":") else cells


def _units(lines: list[Line], cells: list[str], separator: str | None) -> list[str]:
    """Return the units below the names, "" where there is none.

    They are taken from the line in which a known column has a unit of its kind, otherwise from the words directly above
    the numbers if there is one for each name; invalid ones are rejected when the column is read.
    """
    for line in lines:
        for texts in ways_to_split(line.text, separator):
            texts = _under(texts, len(cells))
            if texts and any(map(_fits, cells, texts)):
                return texts
    last = _under(split(lines[-1].text, separator), len(cells)) if lines and not lines[-1].remark else []
    words = [text for text in last if re.search(r"\w", text)]
    return last if words and len(words) == len([text for text in last if text]) else [""] * len(cells)


def _with_factors(lines: list[Line], found: list[str], separator: str | None) -> list[str]:
    """Return the units with powers of ten in the lines below ("x 1e-6 1/Pa"), which are rejected when the column is
    read."""
    for line in lines:
        cells = _under(split(line.text, separator), len(found))
        if any(map(FACTOR.search, cells)) and not cells[0].endswith(":"):  # a fact: "sensitivity: 4.8E-8"
            return [
                f"{cell} {unit}".strip() if FACTOR.search(cell) else unit
                for cell, unit in zip(cells, found, strict=True)
            ]
    return found


def _under(texts: list[str], width: int) -> list[str]:
    """Return the texts without brackets, one for each column; [] if they are too many or only one for several columns."""
    texts = [text.strip("[]() ") for text in _trimmed(texts, width)]
    if len(texts) > width and not texts[width]:
        texts = texts[:width]  # the others are beside the table
    return texts + [""] * (width - len(texts)) if 1 < len(texts) <= width else []


def _fits(cell: str, unit: str) -> bool:
    kind = read_heading(cell).kind
    return bool(unit) and kind in KINDS and units.is_unit(KINDS[kind], unit)
