"""Contact stiffness over depth, from continuous stiffness measurement, validated and in SI units; and its reader."""

import dataclasses
import os
from typing import Any

import numpy as np

from fitting.data import cleaning
from fitting.data.cleaning import DEPTH, LOAD, Wanted, build, curves_of, having, locate, once
from fitting.data.curves import array, deviations, window_note
from fitting.data.table import Table, read_table
from fitting.views.text import described

STATED = ("reduced modulus", "modulus")


@dataclasses.dataclass(frozen=True, eq=False)
class StiffnessData:
    """Contact stiffness of a nanoindentation over depth, from an oscillation of the load while it increases.

    Args:
        depth: (n,) [m] > 0.
        stiffness: (n,) storage stiffness of the contact [N/m] > 0, without that of the instrument.
        load: (n,) mean load [N] > 0, for the contact depth of Oliver and Pharr; None if unknown.
        sigma: (n,) standard deviations of the stiffness [N/m], or one value for all, if they are known.
        area: (n,) projected contact area [m2] > 0 that the instrument states, of which a fit takes the contact radius.
        stated: what the instrument found itself, to compare: {"reduced modulus": (n,), "modulus": (n,)} [Pa] or one of them.
        notes: remarks on the data, which are repeated in the notes of a fit.

    Raises:
        ValueError: values out of range, with the expected and the received value.

    Example:
        >>> data = fitting.StiffnessData(depth=[1e-7, 2e-7, 3e-7, 4e-7, 5e-7], stiffness=[1e4, 2e4, 3e4, 4e4, 5e4])
        >>> print(data.depth.size)
        5
    """

    depth: np.ndarray
    stiffness: np.ndarray
    load: np.ndarray | None = None
    sigma: Any = None
    area: np.ndarray | None = None
    stated: Any = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)
        put("depth", _positive("depth", "m", array("depth", self.depth)))
        put("stiffness", _positive("stiffness", "N/m", array("stiffness", self.stiffness, self.depth)))
        if self.load is not None:
            put("load", _positive("load", "N", array("load", self.load, self.depth)))
        if self.sigma is not None:
            spread = np.full(self.depth.size, self.sigma) if np.ndim(self.sigma) == 0 else self.sigma
            put("sigma", deviations("sigma", spread, self.depth))
        if self.area is not None:
            put("area", _positive("area", "m2", array("area", self.area, self.depth)))
        for name in self.stated or {}:
            if name not in STATED:
                raise ValueError(f"stated: expected keys among {', '.join(STATED)}, got {name!r}")
        put(
            "stated",
            {name: array(f"stated[{name!r}]", one, self.depth) for name, one in (self.stated or {}).items()},
        )

    def __repr__(self) -> str:
        rows = [("depth", self.depth, "m"), ("load", self.load, "N"), ("stiffness", self.stiffness, "N/m")]
        rows += [("sigma", self.sigma, "N/m"), ("area", self.area, "m2")]
        rows += [(f"stated {name}", values, "Pa") for name, values in self.stated.items()]
        return described(f"StiffnessData: {self.depth.size} points", rows, self.notes)

    def window(self, begin: float | None = None, end: float | None = None) -> "StiffnessData":
        """Return the points with depths from ``begin`` to ``end`` [m], None for an open side.

        Returns:
            The points, with a note.

        Raises:
            ValueError: begin is not before end, or fewer than 5 points.

        Example:
            >>> depth = np.linspace(1e-8, 1e-6, 100)
            >>> data = fitting.StiffnessData(depth=depth, stiffness=1e11 * depth)
            >>> print(data.window(5e-8).depth.size)
            96
        """
        low, high = -np.inf if begin is None else begin, np.inf if end is None else end
        if not low < high:
            raise ValueError(f"window: expected begin < end, got {begin!r} and {end!r}")
        keep = (self.depth >= low) & (self.depth <= high)
        if keep.sum() < 5:
            raise ValueError(f"window: expected at least 5 points, got {keep.sum()} of {keep.size}")
        names = ("depth", "stiffness", "load", "sigma", "area")
        some = {name: None if (y := getattr(self, name)) is None else y[keep] for name in names}
        some["stated"] = {name: values[keep] for name, values in self.stated.items()}
        return StiffnessData(**some, notes=(*self.notes, window_note((begin, end), "m", keep)))


def _positive(name: str, unit: str, values: np.ndarray) -> np.ndarray:
    """Return the values; ValueError unless all are > 0."""
    if np.any(values <= 0):
        k = int(np.argmax(values <= 0))
        raise ValueError(f"{name}: expected values > 0 {unit}, got {values[k]:g} at index {k}")
    return values


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
