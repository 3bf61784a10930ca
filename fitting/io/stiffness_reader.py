"""Reader of continuous stiffness measurements, in the steps of ``curves.py``."""

import os

import numpy as np

from fitting.data.stiffness import StiffnessData
from fitting.io import mending
from fitting.io.columns import Series, Wanted, has
from fitting.io.curves import DEPTH, LOAD, build, checked_options, curves_of, once
from fitting.io.table import read_table

STIFFNESS = Wanted("stiffness", ("stiffness",))
EARLY = 0.5  # largest fraction of rows before contact that are left out


def read_stiffness(
    path: str | os.PathLike, *, columns: dict | None = None, units: dict | None = None,
    curve: int | str | None = None, window: tuple[float | None, float | None] | None = None,
    decimal: str | None = None,
) -> StiffnessData:  # fmt: skip
    """Read depth, contact stiffness and, where a file has it, load of a continuous stiffness measurement.

    Rows before contact, with a depth, load or stiffness <= 0, are left out.

    Args:
        path: a text file or a workbook (Agilent, KLA, Hysitron and others).
        columns: columns that the header does not identify: {"depth": header or position from 0, "stiffness": ...,
            "load": ...}, and {"sigma": ...} for a column of standard deviations of the stiffness.
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
    table = read_table(path, decimal)
    columns, units = checked_options(table, columns, units, ("depth", "stiffness", "load", "sigma"))
    wanted = [DEPTH, STIFFNESS]
    loaded = any(all(has(block, one, columns) for one in (*wanted, LOAD)) for block in table.blocks)
    wanted += [LOAD] if loaded else []
    wanted += [Wanted("sigma", STIFFNESS.names)] if "sigma" in columns else []
    taken = mending.choose(table.path, "curve", curves_of(table, tuple(wanted), columns, units), curve)
    taken = _in_contact(table.path, mending.window(taken, window))
    values = mending.complete(table.path, taken).values
    fields = {name: values.get(name) for name in ("load", "sigma")}
    return build(
        table.path, StiffnessData, depth=values["depth"], stiffness=values["stiffness"], notes=once(taken.notes), **fields
    )  # fmt: skip


def _in_contact(path: str, taken: Series) -> Series:
    """Return the rows in contact; ValueError where most are not."""
    with np.errstate(invalid="ignore"):
        before = np.any([values <= 0.0 for values in taken.values.values()], axis=0)
    if before.sum() > EARLY * before.size:
        raise ValueError(
            f"{path}: expected depth, load and stiffness > 0, got {before.sum()} of {before.size} rows without: check the"
            " columns, or choose a window"
        )
    if not before.any():
        return taken
    return taken.pick(~before).say(f"{before.sum()} of {before.size} rows before contact left out")
