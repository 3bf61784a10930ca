"""Columns of a quantity in a block: their place and unit, and their numbers in SI."""

import math
from typing import Any, NamedTuple, NoReturn

import numpy as np

from fitting.data import units as unit_table
from fitting.read.table import (
    CLOCK,
    FACTOR,
    KINDS,
    LOGARITHM,
    Block,
    Heading,
    Row,
    Table,
    is_missing,
    number,
    read_heading,
)

SI = {
    "t": "s", "omega": "rad/s", "J": "1/Pa", "strain": "-", "stress": "Pa", "load": "N", "depth": "m",
    "angle": "rad", "ratio": "-",
    "temperature": "K", "stiffness": "N/m", "area": "m2",
}  # fmt: skip
# infinity and not-a-number of instruments according to SCPI-99, sec. 7.2.1.4 and 7.2.1.5
OVERLOAD = (9.9e37, 9.91e37)
NONE = 1e300  # nanoindenters write the largest number of a computer, or nearly, where there is no value
# largest numbers in SI, beyond which numbers without a unit are not in SI, and the units that are suggested then
LARGEST = {"load": (1e7, ("mN", "uN", "nN")), "depth": (1.0, ("um", "nm"))}
# quantities of which a column named as one is never taken for another
EXCLUSIVE = (
    {"time", "step time"}, {"compliance", "tensile compliance"}, {"strain", "tensile strain"},
    {"stress", "tensile stress"}, {"relaxation modulus"}, {"storage modulus", "tensile storage modulus"},
    {"loss modulus", "tensile loss modulus"}, {"complex modulus", "tensile complex modulus"}, {"viscosity"},
    {"angular frequency", "frequency"}, {"shear rate"}, {"temperature"}, {"load"}, {"stiffness", "contact stiffness"},
)  # fmt: skip
FOOTER = 3  # lines of text after the numbers that may be left out, or a tenth of the rows


class Wanted(NamedTuple):
    """A wanted quantity: key: of ``columns`` and ``units``; names: acceptable kinds of names, in order of preference."""

    key: str
    names: tuple[str, ...]


class Column(NamedTuple):
    """A column of a block.

    place: from 0; label: as shown; name: the kind of its name, None if unknown; shown: its normalised name; factor: to
    SI; notes; unit: as written, None without one.
    """

    place: int
    label: str
    name: str | None
    shown: str
    factor: float
    notes: tuple[str, ...]
    unit: str | None


class Series(NamedTuple):
    """Columns of a block in SI, NaN where a cell is missing.

    name: of the block; lines (n,): of the file; values: key to (n,); columns: key to Column;
    before: the text above the block; marks: cells of the segment column, or (); notes; zero: where t = 0
    is on the file's clock [s]; error: why the block could not be read, "" if it was.
    """

    name: str
    lines: np.ndarray
    values: dict[str, np.ndarray]
    columns: dict[str, Column]
    before: str
    marks: tuple[str, ...]
    notes: tuple[str, ...]
    zero: float = 0.0
    error: str = ""

    @property
    def clock(self) -> np.ndarray:
        """The abscissa (n,), which is the first column."""
        return next(iter(self.values.values()))

    def pick(self, rows: Any) -> "Series":
        """Return some of the rows."""
        marks = tuple(np.asarray(self.marks)[rows]) if self.marks else ()
        values = {key: array[rows] for key, array in self.values.items()}
        return self._replace(lines=self.lines[rows], values=values, marks=marks)

    def say(self, *notes: str) -> "Series":
        """Return the series with further notes."""
        return self._replace(notes=(*self.notes, *notes))


def fail(path: str, line: int, column: str, what: str) -> NoReturn:
    """Raise a ValueError of one line that names the file, the line and the column."""
    raise ValueError(f"{path}: line {line}, column {column!r}: {what}")


def having(table: Table, *wanted: Wanted) -> list[Block]:
    """Return the blocks that have a column for each wanted quantity."""

    def has(block: Block, one: Wanted) -> bool:
        choice, cells = table.columns.get(one.key), block.header.cells if block.header else []
        if choice is None:
            return any(read_heading(cell).kind in one.names for cell in cells)
        return choice < block.width if isinstance(choice, int) else choice in cells

    return [block for block in table.blocks if all(has(block, one) for one in wanted)]


def locate(table: Table, block: Block, wanted: Wanted) -> Column:
    """Return the column of the wanted quantity, with the factor of its unit.

    Raises:
        ValueError: no column, several equally suitable ones, or an unknown unit.
    """
    # 1. Its place and the kind of its name: where the caller says, or by the names of the header.
    key, choice, kind = wanted.key, table.columns.get(wanted.key), None
    cells = block.header.cells if block.header else []
    notes: tuple[str, ...] = ()
    if isinstance(choice, int):
        if not 0 <= choice < block.width:
            raise ValueError(f"{table.path}: columns[{key!r}]: expected 0 to {block.width - 1}, got {choice}")
        place, kind = choice, read_heading(cells[choice]).kind if block.header else None
    else:
        assert block.header is not None  # ensured by ``having``
        kinds = [read_heading(cell).kind for cell in cells]
        hits: list[int] = []
        if choice is not None:
            hits = [i for i, cell in enumerate(cells) if cell == choice]
        elif (kind := next(filter(kinds.__contains__, wanted.names), None)) is not None:
            # the preferred name that is there; columns with a readable unit precede others such as "Depth (V)"
            hits = [i for i, own in enumerate(kinds) if own == kind]
            units = {i: read_heading(cells[i]).unit or block.header.units[i] for i in hits}
            fine = [i for i, unit in units.items() if not unit or unit_table.is_unit(KINDS[kind], unit)]
            hits = fine or hits
        if len(hits) != 1:
            found = "none" if not hits else " and ".join(repr(cells[i]) for i in hits)
            for cell in cells:
                if not hits and read_heading(cell).kind is None:
                    _check_plain(table.path, block.header.line, cell, key, {})
            shown = ", ".join(repr(cell) for cell in cells[:12])
            alike = len({cells[i] for i in hits}) < len(hits)  # then the header does not tell them apart
            give = f"columns={{{key!r}: {hits[0]}}} for instance" if alike else f"columns={{{key!r}: ...}}"
            what = f"expected one column for {choice or key!r} in {shown}; got {found}; give {give}"
            fail(table.path, block.header.line, key, what)
        place = hits[0]
        kind = kind or kinds[place]
        # another column would have been suitable
        others = [cells[i] for i, own in enumerate(kinds) if i != place and own in wanted.names]
        if others and len(wanted.names) > 1:
            notes = (f"{cells[place]!r} taken, not {others[0]!r}",)

    # 2. What its heading states, which must not contradict it, and its unit.
    label, heading, line = f"column {place + 1}", Heading("", None, None), block.rows[0][0]
    if block.header and place < len(block.header.cells):
        label, line = block.header.cells[place], block.header.line
        heading = read_heading(label)
        under = block.header.units[place]
        heading = heading._replace(unit=heading.unit if heading.unit is not None else under or None)
        _check_plain(table.path, line, label, wanted.key, table.units)
        # a heading that states another quantity than ``columns``, such as a stress for a modulus, since their units are the
        # same and the numbers do not show it; a symbol of one or two letters states none
        own, stated = (
            next((k for k, names in enumerate(EXCLUSIVE) if one in names), None)
            for one in (wanted.names[0], heading.kind)
        )
        if own is not None and stated is not None and own != stated and len(heading.name) > 2:
            what = f"expected a {wanted.names[0]}, got a {heading.kind} according to the heading"
            what = f"columns[{wanted.key!r}]: {what}: name another column, or correct the heading"
            fail(table.path, line, label, what)
    text = table.units.get(wanted.key, heading.unit)
    quantity = KINDS[wanted.names[0]]
    if text is None:
        notes = (*notes, f"{label}: no unit, taken as {SI[quantity]}")
        return Column(place, label, kind, heading.name, 1.0, notes, None)
    try:
        factor = unit_table.factor(quantity, str(text))
    except KeyError:
        accepted = unit_table.accepted(quantity)
        fail(table.path, line, label, f"expected a unit among {accepted}; got {text!r}")
    return Column(place, label, kind, heading.name, factor, notes, str(text))


def _check_plain(path: str, line: int, label: str, key: str, units: dict) -> None:
    """Raise ValueError for a name of logarithms or, without a given unit, of numbers multiplied by a power of ten."""
    if LOGARITHM.match(label):
        fail(
            path, line, label, "expected the quantity itself, got a function of it: write its values instead"
        )
    if FACTOR.search(label) and key not in units:
        what = "expected a unit without a power of ten, got one: give the unit of the numbers"
        fail(path, line, label, f"{what}, units={{{key!r}: ...}}")


def series(table: Table, block: Block, found: dict[str, Column]) -> Series:
    """Return the numbers of a block; lines of text after them are left out and noted.

    Raises:
        ValueError: a cell that is not a number, with its line and column.
    """
    time, decimal = next(iter(found.values())), table.dialect.decimal
    is_word = lambda cell: not is_missing(cell) and number(cell, decimal) is None
    # lines of text after the numbers: no number in the cell of the time, and a word somewhere
    rows = list(block.rows)
    while rows:
        last = rows[-1][1]
        timed = time.place < len(last) and number(last[time.place], decimal) is not None
        if timed or not any(map(is_word, last)):
            break
        rows.pop()
    left = block.rows[len(rows) :]
    if len(left) > max(FOOTER, len(rows) // 10):
        fail(table.path, left[0][0], time.label, f"expected numbers, got {' '.join(left[0][1])[:40]!r}")
    notes = tuple(f"line {line} left out: {' '.join(row)[:40]!r}" for line, row in left)
    own = [column.place for column in found.values()]
    while rows and all(k >= len(rows[-1][1]) or is_missing(rows[-1][1][k]) for k in own):
        rows = rows[:-1]  # a longer curve stands beside this one
    values = {
        key: np.array([_cell(table, block, row, column) for row in rows]) for key, column in found.items()
    }
    notes = (*(note for column in found.values() for note in column.notes), *notes)
    beside = [(line, cell) for line, row in rows for cell in row[block.width + 1 :] if cell]
    if beside:
        notes = (*notes, f"{len(beside)} cells beside the table left out, the first in line {beside[0][0]}")
    for key, column in found.items():
        values[key] = values[key] * column.factor
        # numbers without a unit that are too large for SI, such as a depth of 1500 m
        if key in LARGEST and column.unit is None:
            largest, (limit, likely) = float(np.nanmax(np.abs(values[key]), initial=0.0)), LARGEST[key]
            if largest > limit:
                given = " or ".join(f"units={{{key!r}: {unit!r}}}" for unit in likely)
                raise ValueError(
                    f"{table.path}: column {column.label!r}: no unit, and {largest:g} {SI[key]} is too large: give {given}"
                )
    # the column of segments, in which an empty cell repeats the one above
    names = [read_heading(cell).kind for cell in block.header.cells] if block.header else []
    marks: list[str] = []
    if "segment" in names:
        place = names.index("segment")
        for _, cells in rows:
            again = marks[-1] if marks else ""
            marks.append(cells[place] if place < len(cells) and cells[place] else again)
    lines = np.array([line for line, _ in rows])
    return Series(block.name, lines, values, found, block.before, tuple(marks), notes)


def _cell(table: Table, block: Block, row: Row, column: Column) -> float:
    line, cells = row
    if column.place >= len(cells) or any(cells[block.width : block.width + 1]):
        what = f"expected {block.width} columns, got {len(cells)}: name each column once in the header"
        fail(table.path, line, column.label, what)
    cell = cells[column.place]
    if is_missing(cell):
        return math.nan
    value = number(cell, table.dialect.decimal)
    if value is None:
        fail(table.path, line, column.label, f"expected a number, got {cell[:40]!r}")
    if CLOCK.fullmatch(cell) and column.factor != 1.0:
        fail(
            table.path,
            line,
            column.label,
            f"expected a number of {column.unit}, got a time as hh:mm:ss, {cell!r}",
        )
    if math.isinf(value):
        fail(table.path, line, column.label, f"expected a finite number, got {cell!r}")
    return math.nan if abs(value) in OVERLOAD or abs(value) > NONE else value
