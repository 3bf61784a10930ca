"""Flow ramps and flow curves in the export of a rheometer, which are no creep tests although they have stress and strain."""

import re

import numpy as np

from fitting.io.cells import number
from fitting.io.columns import Series
from fitting.io.names import read_heading
from fitting.io.table import Block, Table

NAMED = re.compile(
    r"flow\s*(?:ramp|sweep|curve|step)|shear\s*rate\s*(?:ramp|sweep)|viscosity\s*curve|flie(?:ß|ss)kurve|viskositätskurve"
    r"|courbe\s*d.écoulement|curva\s*de\s*flujo|流動曲線|フローカーブ",
    re.IGNORECASE,
)
RISE = 1.5  # least factor of the stress from the first quarter to the middle, and from there to the end


def sorted_out(table: Table, parts: list[Series], chosen: bool) -> list[Series]:
    """Return the curves of a creep file without its flow ramps, all of them where some are ``chosen`` by the caller.

    Raises:
        ValueError: the file has nothing else.
    """
    blocks = [block for block in table.blocks if _flows(block, table.dialect.decimal)]
    lines = {line for block in blocks for line, _ in block.rows}
    flowing = [part for part in parts if int(part.lines[0]) in lines]
    if not flowing or chosen:
        return parts
    left = [part for part in parts if int(part.lines[0]) not in lines]
    if not left:
        refuse(table.path, flowing[0])
    names = ", ".join(part.name or f"line {part.lines[0]}" for part in flowing)
    return [part.say(f"flow ramps left out: {names}") for part in left]


def check(table: Table, part: Series) -> None:
    """Raise ValueError for a chosen curve that is a flow ramp."""
    blocks = [block for block in table.blocks if any(line == part.lines[0] for line, _ in block.rows)]
    if blocks and _flows(blocks[0], table.dialect.decimal):
        refuse(table.path, part)


def refuse(path: str, part: Series) -> None:
    """Raise ValueError that says why a curve is no creep test."""
    name = f" ({part.name})" if part.name else ""
    raise ValueError(
        f"{path}: line {part.lines[0]}: expected a creep test, got a flow ramp{name}, whose rate is changed: it has no"
        " compliance, and its viscosity is not fitted here"
    )


def _flows(block: Block, decimal: str) -> bool:
    """Return whether a block has the name of a flow ramp, or a viscosity and a rate beside a stress that keeps changing."""
    if NAMED.search(block.name):
        return True
    kinds = [read_heading(cell).kind for cell in block.header.cells] if block.header else []
    if not {"viscosity", "shear rate", "stress"} <= set(kinds):
        return False
    place = kinds.index("stress")
    found = [number(row[place], decimal) for _, row in block.rows if place < len(row)]
    stress = np.abs([value for value in found if value is not None])
    if stress.size < 8:
        return False
    quarter, middle, last = stress[stress.size // 4], stress[stress.size // 2], stress[-1]
    low, high = min(quarter, last), max(quarter, last)
    return bool(low > 0.0 and RISE * low <= middle and RISE * middle <= high)
