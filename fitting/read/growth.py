"""Reader of growth curves of films, in the steps of ``curves.py``."""

import os
from collections.abc import Sequence

from fitting.data.growth import GrowthData
from fitting.read import cleaning, loading_time
from fitting.read.columns import Wanted
from fitting.read.curves import TIME, build, curves_of, once
from fitting.read.table import read_table

THICKNESS = Wanted("thickness", ("thickness", "depth"))  # "h" alone is the name of a depth


def read_growth(
    path: str | os.PathLike, *, stress: float, temperature: float, columns: dict | None = None,
    units: dict | None = None, initial: float = 0.0, start: float | None = None,
    segment: int | str | Sequence[int | str] | None = None,
    window: tuple[float | None, float | None] | None = None, decimal: str | None = None,
) -> GrowthData:  # fmt: skip
    """Read time and thickness of a film from a text file, one curve at one stress and one temperature.

    Args:
        path: a text file.
        stress: the stress that drives the growth [Pa].
        temperature: [K].
        columns: columns that the header does not identify: {"t": header or position from 0, "thickness": ...}, and
            {"sigma": ...} for a column of standard deviations of the thickness.
        units: {"t": "min", "thickness": "nm"}; they take precedence over the header.
        initial: thickness at t = 0 [m].
        start: time [s] on the file's clock at which the growth began, which is subtracted; 0 by default.
        segment: the step or interval of a file with several, by name or position from 0; several are joined.
        window: (begin, end) [s] of the file's clock, None for an open side.
        decimal: the decimal mark, "." or ",", if it is ambiguous.

    Returns:
        The curve in SI, with notes on what was read and corrected.

    Raises:
        ValueError: a file that cannot be read, in a message of one line.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "film.csv"
        >>> _ = file.write_text("t [min],thickness [nm]\\n" + "".join(f"{t},{2 * t}\\n" for t in range(1, 7)))
        >>> data = fitting.read_growth(file, stress=3e8, temperature=373.0)
        >>> print(data.t[0], data.thickness[0])
        60.0 2e-09
    """
    table = read_table(path, decimal, columns, units, ("t", "thickness", "sigma"))
    wanted = [TIME, THICKNESS] + ([Wanted("sigma", THICKNESS.names)] if "sigma" in table.columns else [])
    parts = curves_of(table, wanted, "read_growth")
    taken = cleaning.choose(table.path, "segment", parts, segment)
    taken = loading_time.shift(table.path, taken, start)
    taken = cleaning.ordered(cleaning.complete(table.path, cleaning.window(taken, window)))
    values = cleaning.check_times(table.path, taken).values
    return build(
        table.path, GrowthData, t=values["t"], thickness=values["thickness"], sigma=values.get("sigma"),
        stress=stress, temperature=temperature, initial=initial, notes=once(taken.notes),
    )  # fmt: skip
