"""The curves of a table: its wanted columns in SI, one curve for each block or step, for all readers.

A file is read in steps, in ``fitting.read``: lines, cells, decimal mark, and blocks with their headers (``read.table``),
and the columns in SI by their names and units (``read.columns``). Corrections that lose no information are made and
recorded in ``notes``: rows out of order are sorted, repeated times are kept as repeated measurements, rows with an empty
cell or J <= 0 are left out if they are at most a tenth, and a column without a unit is taken as SI. Everything else is a
ValueError of one line that names the file, the line, the column, and the option that would read it.
"""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.data import units as unit_table
from fitting.read import cleaning
from fitting.read.columns import SI, Series, Wanted, having, locate, series
from fitting.read.table import Table, number, read_heading

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
        if len(blocks[0].rows) < cleaning.LEAST < blocks[0].width:
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
        pieces = cleaning.divided(curve) if divided else [curve]
        found += [run for piece in pieces for run in cleaning.runs(piece)]
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
        kinds = [read_heading(cell).kind for cell in block.header.cells] if block.header else []
        rows = [row for line, row in block.rows if line in lines]
        if "temperature" not in kinds or len(rows) != taken.lines.size:
            continue
        place = kinds.index("temperature")
        found = [number(row[place], table.dialect.decimal) for row in rows if place < len(row)]
        T = np.array([one for one in found if one is not None])
        if T.size < 2 or np.ptp(T) <= DRIFT:
            continue
        label = block.header.cells[place] if block.header else ""
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
    kinds = [
        {read_heading(cell).kind for cell in block.header.cells} for block in table.blocks if block.header
    ]
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
