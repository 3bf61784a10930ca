"""From the blocks of a table to curves in SI: columns by their names and units, series of numbers, and their cleaning.

A file is read in steps: lines, cells, decimal mark, and blocks with their headers (``table.py``); then the columns in SI by
their names and units, one curve for each block or step. Corrections that lose no information are made and recorded in
``notes``: rows out of order are sorted, repeated times are kept as repeated measurements, rows with an empty cell or J <= 0
are left out if they are at most a tenth, and a column without a unit is taken as SI. Everything else is a ValueError of one
line that names the file, the line, the column, and the option that would read it.
"""

import itertools
import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple, NoReturn

import numpy as np

from fitting.data import units as unit_table
from fitting.data.contact import sample_noise, smooth
from fitting.data.curves import window_note
from fitting.data.table import (
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
    marks: list[str] = []
    if "segment" in block.kinds:
        place = block.kinds.index("segment")
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


TIME = Wanted("t", ("step time", "time"))
COMPLIANCE = Wanted("J", ("compliance", "tensile compliance"))
CREEP_MODULUS = Wanted("creep_modulus", ("creep modulus", "shear creep modulus"))
MODULUS = Wanted("modulus", ("relaxation modulus", "modulus", "tensile modulus"))
STORAGE = Wanted("storage", ("storage modulus", "tensile storage modulus"))
LOAD = Wanted("load", ("load",))
DEPTH = Wanted("depth", ("depth", "delta"))
# For each kind of data: the columns that identify it (one of each tuple of names must be present), its name in messages, and
# its reader. A file contains the first kind whose columns it has.
HOLDINGS = (
    ((("contact stiffness", "stiffness"), ("depth",)), "a contact stiffness", "read_stiffness"),
    (((*COMPLIANCE.names,),), "a creep compliance", "read_creep"),
    (((*CREEP_MODULUS.names,),), "a creep modulus", "read_creep"),
    ((("relaxation modulus",),), "a relaxation modulus", "read_relaxation"),
    (((*STORAGE.names,),), "a storage modulus", "read_oscillation"),
    ((("complex modulus", "tensile complex modulus"),), "a complex modulus", "read_oscillation"),
    (((*LOAD.names,), (*DEPTH.names,)), "load and depth", "read_indentation"),
    ((("time", "step time"), ("thickness",)), "a thickness over time", "read_growth"),
)
DRIFT = 5.0  # largest range of the temperatures [K] of a curve
# what an instrument finds itself and states above a curve, with the kinds of the units
FOUND = {
    "modulus": "stress", "tensile modulus": "stress", "reduced modulus": "stress", "contact area": "area",
    "contact stiffness": "stiffness", "stiffness": "stiffness",
}  # fmt: skip
OF = {
    "sigma": 1,
    "sigma_load": 1,
    "sigma_depth": 2,
}  # place, among the wanted columns, of the quantity of an error


def curves_of(
    table: Table, wanted: Sequence[Wanted], reader: str = "", choice: Any = None, divided: bool = False
) -> list[Series]:
    """Return the curves of a file: its blocks that have all wanted columns, split where the clock starts again.

    A block that cannot be read is a curve with an ``error``, which is raised only if that curve is chosen.

    reader: the public function, for a message that names another one which reads the file; choice: the name or position
    of the chosen curve: of blocks with that name no others are read; divided: whether a column that numbers segments
    divides a block.
    """
    texts = [choice] if isinstance(choice, str) else (choice if isinstance(choice, Sequence) else [])
    texts = [one.lower() if isinstance(one, str) else "" for one in texts]
    named = [block for block in table.blocks if any(text and text in block.name.lower() for text in texts)]
    blocks = having(table, *wanted)
    lacking = [block for block in table.blocks if block not in blocks]
    if named and all(texts):
        table = table._replace(blocks=named)
        blocks = having(table, *wanted)
    if not blocks and reader and not table.columns:
        check_holdings(table, next(what for _, what, own in HOLDINGS if own == reader), reader)
    if not blocks:  # report what the longest block lacks
        blocks = [max(table.blocks, key=lambda block: len(block.rows))]
        if len(blocks[0].rows) < LEAST < blocks[0].width:
            raise ValueError(
                f"{table.path}: expected a row for each time, got {len(blocks[0].rows)} rows of {blocks[0].width} "
                "cells: transpose the table"
            )
        if blocks[0].header is None:
            example = {one.key: k for k, one in enumerate(wanted)}
            line, got = blocks[0].rows[0][0], table.columns or "none"
            raise ValueError(
                f"{table.path}: line {line}: no header, expected the places of the columns, columns={example} for instance, "
                f"and units= where these are not SI; got {got}"
            )
    found = []
    for block in blocks:
        try:
            places = {one.key: locate(table, block, one) for one in wanted}
            for key, place in OF.items():
                if key in places and places[key].unit is None:
                    places[key] = places[key]._replace(factor=places[wanted[place].key].factor, notes=())
            if len({column.place for column in places.values()}) < len(places):
                raise ValueError(f"{table.path}: columns: expected different columns for {list(places)}")
            curve = series(table, block, places)
        except ValueError as error:
            if len(blocks) == 1:
                raise
            lines = np.array([line for line, _ in block.rows])
            found.append(Series(block.name, lines, {}, {}, block.before, (), (), error=str(error)))
            continue
        pieces = by_segment(curve) if divided else [curve]
        found += [run for piece in pieces for run in runs(piece)]
    others = [block for block in lacking if block not in blocks and len(block.rows) > 1]
    if not others:
        return found
    first, last = others[0].rows[0][0], others[-1].rows[-1][0]
    return [
        part.say(f"{len(others)} other blocks of numbers, lines {first} to {last}, not read")
        for part in found
    ]


def heated(table: Table, taken: Series, most: float | None) -> Series:
    """Return a curve with a note where its column of temperatures changes by more than ``DRIFT``; ValueError where it
    changes by more than ``most`` [K], as in a temperature ramp, which is no test of a material at one temperature."""
    lines = set(taken.lines.tolist())
    for block in table.blocks:
        if block.header is None or "temperature" not in block.kinds:
            continue
        place = block.kinds.index("temperature")
        T = block.numbers(place, lines, table.dialect.decimal)
        if T.size != taken.lines.size:
            continue
        T = T[np.isfinite(T)]
        if T.size < 2 or np.ptp(T) <= DRIFT:
            continue
        label = block.header.cells[place]
        ends = f"{T.min():g} to {T.max():g}"
        if most is not None:
            raise ValueError(
                f"{table.path}: column {label!r}: expected one temperature within a curve, got {ends}: window= or segment="
                " selects one, and fit_master superposes sweeps at several"
            )
        taken = taken.say(f"{label} changes from {ends}: the material is taken to be the same")
    return taken


def check_holdings(table: Table, expected: str, own: str) -> None:
    """Raise ValueError where a file, none of whose blocks has what a reader expects, holds what another one reads."""
    kinds = [set(block.kinds) for block in table.blocks]
    for needed, what, reader in HOLDINGS:
        if any(all(found & set(names) for names in needed) for found in kinds):
            if reader != own:
                raise ValueError(f"{table.path}: expected {expected}, got {what}: {reader} reads it")
            return


def stated_number(pattern: str, text: str) -> float | None:
    """Return a number that the text above the columns states, or None."""
    found = re.findall(pattern, text)
    try:
        return float(found[-1]) if found else None
    except ValueError:
        return None


def stated_facts(text: str) -> tuple[str, ...]:
    """Return notes on a modulus, a contact area or a stiffness that the text above the columns states, as the instrument
    found it: "Reduced modulus (GPa): 3.1", "E[eff] (Pa)\t1234", "S = 12.1 uN/nm"."""
    notes = []
    for line in text.splitlines():
        name, mark, rest = re.match(r"((?:\[[^\]]*\]|[^:=\t;])*)([:=\t;]?)(.*)", line.strip()).groups()  # type: ignore[union-attr]
        name = name.strip()
        cells = rest.strip(" :=\t;").replace(";", " ").split()
        heading = read_heading(name)
        kind = "tensile modulus" if re.match(r"E\[(?:eff|v=)", name) else heading.kind
        value = number(cells[0], ".") if mark and cells else None
        if kind not in FOUND or value is None or len(cells) > 2:
            continue
        unit = (re.findall(r"\(([^()]*)\)\s*$", name) or cells[1:] or [heading.unit or ""])[0].strip("[]()")
        if unit_table.is_unit(FOUND[kind], unit):
            notes.append(
                f"the instrument states {name}: {value * unit_table.factor(FOUND[kind], unit):.4g} {SI[FOUND[kind]]}"
            )
    return tuple(notes)


def once(notes: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(notes))


def build(path: str, cls: type, **fields: Any) -> Any:
    try:
        return cls(**fields)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


LOSS = 0.1  # largest fraction of rows that may be left out
SAME = 5e-3  # relative difference of measured frequencies that are one
STILL = 3  # least number of rows at one frequency beside a sweep
LEAST = 5  # least number of rows of a run of increasing times, and of the overlap of two runs
Segment = int | str | Sequence[int | str] | None


def runs(series: Series) -> list[Series]:
    """Return the series split where its clock starts again: long runs of increasing times over the same range.

    Frequencies may decrease in each run.
    """
    t = series.clock
    t = -t if np.sum(np.diff(t) < 0) > 0.5 * t.size else t
    known = np.flatnonzero(np.isfinite(t))
    back = known[1:][np.diff(t[known]) < 0]
    if not back.size:
        return [series]
    pieces = np.split(np.arange(t.size), back)
    long = [piece for piece in pieces if piece.size >= LEAST]
    if not sum(piece.size for piece in long) > (1 - LOSS) * t.size:
        return [series]

    def overlap(first: np.ndarray, second: np.ndarray) -> bool:
        begin, end = max(np.nanmin(first), np.nanmin(second)), min(np.nanmax(first), np.nanmax(second))
        return all(np.sum((run >= begin) & (run <= end)) >= LEAST for run in (first, second))

    if not any(overlap(t[a], t[b]) for a, b in itertools.pairwise(long)):
        return [series]
    parts = [series.pick(piece) for piece in pieces]
    return [part._replace(name=f"{part.name} from line {part.lines[0]}".strip()) for part in parts]


def by_segment(series: Series) -> list[Series]:
    """Return the series split where the column that numbers its segments changes ("1|1, 1|2, ..., 2|1": at 2).

    It is whole where most of the marks have less than ``LEAST`` rows, since these number points and not segments.
    """
    marks = np.array([mark.partition("|")[0].strip() for mark in series.marks])
    cuts = np.flatnonzero(marks[1:] != marks[:-1]) + 1
    pieces = np.split(np.arange(marks.size), cuts)
    if not cuts.size or sum(piece.size for piece in pieces if piece.size >= LEAST) < 0.5 * marks.size:
        return [series]
    return [series.pick(piece)._replace(name=f"{series.name} {marks[piece[0]]}".strip()) for piece in pieces]


def sweeps(series: Series) -> tuple[list[Series], list[Series]]:
    """Return the parts of a series over frequency in which it moves, and those in which it stands still.

    It stands still in a test over time, strain or temperature before or after a sweep: at least three rows at one
    frequency, and more than twice as many as at most other frequencies, which a sweep may repeat.
    """
    omega = series.clock
    # measured frequencies are never quite the same
    moved = ~(np.abs(np.diff(omega)) <= SAME * np.abs(omega[:-1]))
    pieces = np.split(np.arange(omega.size), np.flatnonzero(moved) + 1)
    usual = float(np.median([piece.size for piece in pieces]))
    # not a dense sweep
    narrow = [np.ptp(omega[piece]) <= 2.0 * SAME * np.abs(omega[piece[0]]) for piece in pieces]
    long = [
        piece.size >= STILL and piece.size > 2.0 * usual and one
        for piece, one in zip(pieces, narrow, strict=True)
    ]
    if not any(long):
        still = len(pieces) == 1 and omega.size >= STILL and narrow[0]
        return ([], [series]) if still else ([series], [])
    groups: list[tuple[bool, list[np.ndarray]]] = []
    for piece, stands in zip(pieces, long, strict=True):
        if groups and not stands and not groups[-1][0]:
            groups[-1][1].append(piece)
        else:
            groups.append((stands, [piece]))
    parts = [(stands, series.pick(np.concatenate(some))) for stands, some in groups]
    named = [
        (stands, one._replace(name=f"{one.name} from line {one.lines[0]}".strip())) for stands, one in parts
    ]
    return [one for stands, one in named if not stands], [one for stands, one in named if stands]


def turned(series: Series) -> list[Series]:
    """Return the parts of a sweep that goes up and down again, each of at least ``LEAST`` rows in one direction."""
    way = np.sign(np.diff(series.clock))
    steps = np.flatnonzero(way)  # the frequency at which it turns may be measured twice
    cuts = steps[1:][way[steps[1:]] != way[steps[:-1]]]
    pieces = np.split(np.arange(series.clock.size), cuts)
    if not cuts.size or min(piece.size for piece in pieces) < LEAST:
        return [series]
    return [
        series.pick(one)._replace(name=f"{series.name} from line {series.lines[one[0]]}".strip())
        for one in pieces
    ]


def choose(path: str, option: str, parts: list[Series], segment: Segment) -> Series:
    """Return one of several curves of a file, or several joined, by position or name.

    Raises:
        ValueError: several curves and no choice, or an unknown choice; the message names the option.
    """
    names = ", ".join(f"{k} ({part.name or f'line {part.lines[0]}'})" for k, part in enumerate(parts))

    def one(choice: int | str) -> Series:
        if isinstance(choice, int):
            hits = parts[choice : choice + 1] if choice >= 0 else []
        else:
            hits = [part for part in parts if part.name.lower() == choice.lower()]
            hits = hits or [part for part in parts if choice.lower() in part.name.lower()]
        if len(hits) != 1:
            raise ValueError(f"{path}: {option}: expected one of {names[:200]}; got {choice!r}")
        return _read(hits[0])

    if segment is None:
        if len(parts) > 1:
            raise ValueError(
                f"{path}: expected one curve, got {len(parts)}: choose with {option}= among {names[:200]}"
            )
        return _read(parts[0])
    several = [segment] if isinstance(segment, int | str) else list(segment)
    chosen = [one(choice) for choice in several]
    return join(chosen).say(
        f"{option} taken: {', '.join(part.name or str(part.lines[0]) for part in chosen)}"
    )


def _read(part: Series) -> Series:
    """Return a curve; ValueError where it could not be read."""
    if part.error:
        raise ValueError(part.error)
    return part


def join(parts: list[Series]) -> Series:
    """Return the curves concatenated."""
    values = {key: np.concatenate([part.values[key] for part in parts]) for key in parts[0].values}
    marks = tuple(mark for part in parts for mark in part.marks)
    lines = np.concatenate([part.lines for part in parts])
    return parts[0]._replace(lines=lines, values=values, marks=marks)


def window(series: Series, limits: tuple[float | None, float | None] | None) -> Series:
    """Return the rows from limits[0] to limits[1], in seconds of the file's clock (or rad/s); None is no limit."""
    if limits is None:
        return series
    begin, end = limits
    low, high = -np.inf if begin is None else begin, np.inf if end is None else end
    if not low < high:
        raise ValueError(f"window: expected (begin, end) with begin < end, got {limits!r}")
    t = series.clock + series.zero
    keep = ~((t < low) | (t > high))
    if keep.sum() < LEAST:
        raise ValueError(
            f"window: expected at least {LEAST} points from {np.nanmin(t):.4g} to {np.nanmax(t):.4g}, got {keep.sum()} of"
            f" {t.size}"
        )
    return series.pick(keep).say(window_note(limits, SI[next(iter(series.values))], keep))


def complete(path: str, series: Series, positive: tuple[str, ...] = ()) -> Series:
    """Return the rows without missing cells and, in columns of ``positive``, with values > 0.

    Raises:
        ValueError: more than a tenth of the rows would be left out.
    """
    keep = np.ones(series.lines.size, dtype=bool)
    for key, values in series.values.items():
        label = series.columns[key].label if key in series.columns else key
        checks = [(np.isnan(values), "an empty or NaN cell", "numbers")]
        if key in positive:
            checks.append((values <= 0, "a value <= 0", "values > 0"))
        for bad, what, expected in checks:
            if not bad.any():
                continue
            line = int(series.lines[np.argmax(bad)])
            if bad.sum() > LOSS * bad.size:
                some = f"{what} in {bad.sum()} of {bad.size} rows"
                fail(
                    path, line, label, f"expected {expected}, got {some}; window=(begin, end) selects others"
                )
            series = series.say(f"{label}: {bad.sum()} rows with {what} left out, the first in line {line}")
            keep &= ~bad
    return series.pick(keep)


def ordered(series: Series) -> Series:
    """Return the rows sorted by time, with a note on rows that were out of order or repeated."""
    t = series.values["t"]
    back, same = int(np.sum(np.diff(t) < 0)), int(np.sum(np.diff(np.sort(t)) == 0))
    if back:
        series = series.pick(np.argsort(t, kind="stable"))
        series = series.say(f"times sorted: {back} of {t.size} steps went back")
    return series.say(f"{same} repeated times kept as repeated measurements") if same else series


def check_times(path: str, series: Series) -> Series:
    """Return the series; ValueError where times are negative."""
    early = series.values["t"] < 0
    if np.any(early):
        line, first = int(series.lines[np.argmax(early)]), series.values["t"][early][0]
        what = f"expected times >= 0, got {first:g} s; window=(0, None) leaves them out"
        fail(path, line, series.columns["t"].label, what)
    return series


# Check that a column of compliance is a creep compliance: strain over stress is J(t) only under a constant stress.
#
# Under a varying stress, strain = int J(t - s) d stress(s) (L. Boltzmann, Ann. Phys. 241 (1878) 430), and the
# compliance that an instrument writes is the quotient of strain and stress at the same time. The strain is then
# recovered as their product and fitted under the measured stress.


STEADY = 0.01  # relative variation of a constant stress or strain about its median
SURE = 3.0  # significant variation in standard deviations of its noise
ENDED = 0.05  # fraction of its maximum below which the stress has ended


def settle(path: str, series: Series, end: float | None) -> Series:
    """Return the compliance alone where the stress beside it is constant, otherwise strain and stress.

    Args:
        path: for messages.
        series: with "J" and "stress", and "strain" if the file has it.
        end: last time of the requested rows on the file's clock [s], None for all.

    Raises:
        ValueError: the stress ends, and there is no strain.
    """
    t, J, stress = (series.values[key] for key in ("t", "J", "stress"))
    known = np.isfinite(t) & np.isfinite(J) & np.isfinite(stress)
    known &= (t + series.zero) <= (np.inf if end is None else end)
    # constant where its running median stays at its median
    size = np.abs(stress[known & (J > 0)])
    steady = size.size < 3
    if not steady:
        level = float(np.median(size))
        steady = bool(np.max(np.abs(smooth(size) - level)) <= max(STEADY * level, SURE * sample_noise(size)))
    if steady:
        return _keep(series, ("t", "J", "sigma"), ("stress", "strain"))
    label = series.columns["stress"].label
    if "strain" in series.values and "sigma" not in series.values:
        series = _keep(series, ("t", "strain", "stress"), ("J",))
        return series.say(
            f"{label} varies: the strain is fitted under it, and the compliance beside it is not taken"
        )
    loaded = known & (np.cumsum(known & (np.abs(stress) > ENDED * np.nanmax(np.abs(stress)))) > 0)
    ends = loaded & (np.abs(stress) <= ENDED * np.nanmax(np.abs(stress)))
    if np.any(ends):
        begin, last = t[loaded][0] + series.zero, t[ends][0] + series.zero
        raise ValueError(
            f"{path}: column {label!r}: expected a strain beside a stress that ends, got a compliance alone: "
            f"window=({begin:g}, {last:g}) selects the part before its end"
        )
    # strain = compliance times stress
    compliance = series.columns["J"]
    values = {"t": t, "strain": J * stress, "stress": stress}
    if "sigma" in series.values:
        values["sigma"] = series.values["sigma"] * np.abs(stress)
    columns: dict[str, Column] = {key: series.columns[key] for key in values if key in series.columns}
    series = series._replace(values=values, columns=columns | {"strain": compliance})
    return series.say(f"{label} varies: {compliance.label} times it is the strain, which is fitted under it")


def _keep(series: Series, keys: tuple[str, ...], dropped: tuple[str, ...]) -> Series:
    """Return some of the columns, without the notes on those that are not used."""
    notes = {note for key in dropped if key in series.columns for note in series.columns[key].notes}
    used = {note for key in keys if key in series.columns for note in series.columns[key].notes}
    return series._replace(
        values={key: series.values[key] for key in keys if key in series.values},
        columns={key: series.columns[key] for key in keys if key in series.columns},
        notes=tuple(note for note in series.notes if note not in notes - used),
    )
