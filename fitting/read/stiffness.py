"""Reader of continuous stiffness measurements, in the steps of ``curves.py``."""

import os
from typing import Any

import numpy as np

from fitting.data.stiffness import StiffnessData
from fitting.read import cleaning
from fitting.read.columns import Wanted, having, locate
from fitting.read.curves import DEPTH, LOAD, build, curves_of, once
from fitting.read.table import Table, read_table

STIFFNESS = Wanted("stiffness", ("contact stiffness", "stiffness"))
AREA = Wanted("area", ("contact area",))
# what the instrument found itself; the "Storage Mod." of nanoDMA is a reduced modulus
MODULI = {
    "reduced modulus": Wanted("reduced modulus", ("reduced modulus", "stated modulus")),
    "modulus": Wanted("modulus", ("tensile modulus", "modulus")),
}
EARLY = 0.5  # largest fraction of the rows at depths > 0 that are left out as before contact


def read_stiffness(
    path: str | os.PathLike, *, columns: dict | None = None, units: dict | None = None,
    curve: int | str | None = None, window: tuple[float | None, float | None] | None = None,
    decimal: str | None = None,
) -> StiffnessData:  # fmt: skip
    """Read depth, contact stiffness and, where a file has them, load and contact area of a continuous stiffness measurement.

    A modulus that the instrument computed is kept in ``stated``, and compared with that of a fit.

    Rows before contact, with a depth, load or stiffness <= 0, are left out, and so are those after the largest load (or
    depth, in a file without load): in the unloading and the drift hold there is no oscillation, and no stiffness.

    Args:
        path: a text file or a workbook (Agilent, KLA, Hysitron and others).
        columns: columns that the header does not identify: {"depth": header or position from 0, "stiffness": ...,
            "load": ..., "area": ...}, and {"sigma": ...} for a column of standard deviations of the stiffness.
        units: {"depth": "nm", "stiffness": "N/m", "load": "mN"}; they take precedence over the header.
        curve: which of several curves in the file, by position from 0 or by name.
        window: (begin, end) of the depth [m], None for an open side.
        decimal: the decimal mark, "." or ",", if it is ambiguous.

    Returns:
        The curve in SI, with notes on what was read and left out.

    Raises:
        ValueError: a file that cannot be read, in a message of one line.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "csm.csv"
        >>> rows = "".join(f"{d},{d**2},{2 * d}\\n" for d in range(9))
        >>> _ = file.write_text("Depth (nm),Load (uN),Stiffness (uN/nm)\\n" + rows)
        >>> data = fitting.read_stiffness(file)
        >>> print(data.depth.size, f"{data.stiffness[0]:.6g}")
        8 2000
    """
    table = read_table(path, decimal, columns, units, ("depth", "stiffness", "load", "area", "sigma"))
    wanted = [DEPTH, STIFFNESS]
    wanted += [LOAD] if having(table, *wanted, LOAD) else []
    wanted += [Wanted("sigma", STIFFNESS.names)] if "sigma" in table.columns else []
    wanted += [one for one in (AREA, *MODULI.values()) if _is_stated(table, one, wanted)]
    parts = curves_of(table, wanted, "read_stiffness", curve)
    taken = cleaning.choose(table.path, "curve", parts, curve)
    if AREA.key not in taken.values and having(table, AREA):
        taken = taken.say(
            "the contact area of the file is not used: it has no unit, which units={'area': 'um2'} gives, say"
        )
    taken = cleaning.window(taken, window)
    # up to the largest load, or depth
    pushed = taken.values.get("load", taken.values["depth"])
    end = int(np.argmax(np.where(np.isfinite(pushed), pushed, -np.inf))) + 1
    if end < pushed.size:
        note = f"{pushed.size - end} of {pushed.size} rows after the largest load left out"
        taken = taken.pick(slice(end)).say(note)
    # from the last row above the surface on
    above = np.flatnonzero(taken.values["depth"] <= 0.0)
    approach = int(above[-1]) + 1 if above.size else 0
    with np.errstate(invalid="ignore"):
        own = [values for key, values in taken.values.items() if key not in MODULI]
        outside = np.any([values <= 0.0 for values in own], axis=0)
    outside[:approach] = True
    left = outside[approach:]
    if left.sum() > EARLY * left.size or not left.size:
        raise ValueError(
            f"{table.path}: expected depth, load and stiffness > 0, got {outside.sum()} of {outside.size} rows"
            " without: check the columns, or choose a window"
        )
    if outside.any():
        taken = taken.pick(~outside).say(f"{outside.sum()} of {outside.size} rows before contact left out")
    for name in MODULI:  # missing where the instrument found none
        if name in taken.values and not np.all(np.isfinite(taken.values[name])):
            taken = taken._replace(values={key: one for key, one in taken.values.items() if key != name})
    values = cleaning.complete(table.path, taken).values
    fields: dict[str, Any] = {name: values.get(name) for name in ("load", "sigma", "area")}
    fields["stated"] = {name: values[name] for name in MODULI if name in values}
    return build(
        table.path, StiffnessData, depth=values["depth"], stiffness=values["stiffness"], notes=once(taken.notes), **fields
    )  # fmt: skip


def _is_stated(table: Table, one: Wanted, wanted: list[Wanted]) -> bool:
    """Return whether every block with the wanted columns has one more, in one column with a unit."""
    blocks = having(table, *wanted, one)
    if not blocks or len(blocks) < len(having(table, *wanted)):
        return False
    try:
        return all(locate(table, block, one).unit is not None for block in blocks)
    except ValueError:  # several columns
        return False
