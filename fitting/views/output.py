"""Output files of a fit command, summary.json, curve.csv and fit.png, each written atomically."""

import argparse
import csv
import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fitting.views import sheet
from fitting.views.text import in_flags
from jaxcontact._support.files import write_whole as write

RESULTS = ("summary.json", "curve.csv", "fit.png")


def check_directory(options: argparse.Namespace, names: Sequence[str] = RESULTS) -> None:
    """Raise ValueError where results of these names may not or cannot be written in the directory."""
    directory: Path = options.directory
    if directory.exists() and not directory.is_dir():
        raise ValueError(f"{directory}: found a file, accepted: a directory, new or empty")
    if directory.is_dir() and any(directory.iterdir()) and not options.force:
        raise ValueError(f"{directory}: found a directory that is not empty; --force overwrites it")
    files = [options.file] if isinstance(options.file, str) else options.file
    inputs = {Path(file).resolve(): file for file in files}
    for name in names:
        path = (directory / name).resolve()
        if path in inputs:
            raise ValueError(
                f"{inputs[path]}: expected another directory than {directory}, where {name} would replace it"
            )
        above = [one for one in path.parents if one.is_relative_to(directory.resolve())]
        if path.is_dir() or any(one.exists() and not one.is_dir() for one in above):
            raise ValueError(
                f"{directory / name}: expected room for a file, found a folder there or a file above it"
            )


def finish(
    options: argparse.Namespace, found: Any, more: dict[str, Any] | None = None, picture: Any = None
) -> int:
    """Print the summary and write the results."""
    print(in_flags(found.summary()))
    leave(found, options.directory, {"file": Path(options.file).name} | (more or {}), picture)
    print(f"in {options.directory}: summary.json, curve.csv, fit.png")
    return 0


def leave(found: Any, directory: Path, more: dict[str, Any], picture: Any = None) -> None:
    """Write the summary, the curve and the figure of a fit; picture: a figure in place of its own."""
    directory.mkdir(parents=True, exist_ok=True)
    write_json(directory / "summary.json", found.to_dict() | more)
    _curve(found, directory / "curve.csv")
    write(directory / "fit.png", lambda path: (picture or found.plot()).savefig(path, dpi=150, format="png"))


def write_json(path: Path, values: dict[str, Any]) -> None:
    """Write values as JSON."""
    write_text(path, json.dumps(values, indent=2, ensure_ascii=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8."""
    write(path, lambda partial: partial.write_text(text, encoding="utf-8", errors="backslashreplace"))


def write_table(path: Path, names: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table as CSV with one line of names, each with its unit in brackets; nan and None are empty cells."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(names)
    for row in rows:
        cells = [v.item() if isinstance(v, np.generic) else v for v in row]
        table.writerow(
            ["" if v is None or v != v else f"{v:.12g}" if isinstance(v, float) else v for v in cells]
        )
    write_text(path, text.getvalue())


def _curve(fit: Any, path: Path) -> None:
    """Write time or frequency, data, fit and residual of every fitted point.

    The residual is in standard deviations, those that were given or else estimated with the fit.

    Several quantities over one abscissa (G' and G'') have columns of their own; several tests, or temperatures, have their
    names in a column.
    """
    name, unit, x, measured = fit.curve
    over = "{} [{}]".format(*fit.abscissa)
    deviations = -sheet.deviations(fit)
    residual = "residual [standard deviations]"
    if hasattr(fit, "curves") and name == "response":  # tests with abscissae of their own
        tests = [
            (at, one, part, own, own_unit, "rad/s" if "," in own else "s")
            for own, own_unit, t, y, best in fit.curves
            for part, at, one in _stacked(own, t, np.column_stack([y, best]))
        ]
        count = np.cumsum([0, *(at.size for at, *_ in tests)])
        joint = [
            (part, own_unit, at[k], over_unit, one[k, 0], one[k, 1], deviations[count[j] + k])
            for j, (at, one, part, _, own_unit, over_unit) in enumerate(tests)
            for k in range(at.size)
        ]
        names = [
            "quantity",
            "unit",
            "abscissa",
            "unit of the abscissa",
            "measured",
            "fitted",
            residual,
        ]
        write_table(path, names, joint)
        return
    values = np.column_stack([measured, fit.fitted, deviations])
    sizes = [_points(one) for one in fit.data] if isinstance(fit.data, tuple | list) else []
    if sum(sizes) == x.size:  # several curves, of a master curve or of the growth of films
        curve = np.repeat(np.arange(len(sizes)), sizes)
        held = np.repeat([one.temperature for one in fit.data], sizes)
        quantity = [own for n in sizes for own in np.repeat(name.split(", "), n // len(name.split(", ")))]
        # the measured frequencies or times of a master curve, which are not shifted
        if over.startswith("ln("):
            swept = hasattr(fit.data[0], "omega")
            over, x = ("omega [rad/s]", np.exp(x)) if swept else ("t [s]", np.exp(-x))
        shown = "-" if "," in name else unit
        names = ["curve", "temperature [K]", "quantity", over, f"measured [{shown}]", f"fitted [{shown}]"]
        rows = [(*row[:4], *row[4]) for row in zip(curve, held, quantity, x, values, strict=True)]
        write_table(path, [*names, residual], rows)
        return
    parts = _stacked(name, x, values)
    at = np.unique(np.concatenate([t for _, t, _ in parts])) if len(parts) > 1 else x
    names, columns = [over], [at]
    for column in range(values.shape[1]):
        for part, t, one in parts:
            own = f" {part}" if len(parts) > 1 else ""
            labels = f"{part} [{unit}]", f"fitted{own} [{unit}]", f"residual{own} [standard deviations]"
            names.append(labels[column])
            if len(parts) == 1:
                columns.append(one[:, column])
                continue
            full = np.full(at.size, np.nan)  # a point may be left out of one of them
            full[np.searchsorted(at, t)] = one[:, column]
            columns.append(full)
    write_table(path, names, zip(*columns, strict=True))


def _stacked(name: str, x: np.ndarray, values: np.ndarray) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return (name, abscissa, values) of the quantities that a curve has one after the other ("G', G''"), each of which
    begins where the abscissa starts again."""
    names = name.split(", ")
    cuts = np.flatnonzero(np.diff(x) < 0) + 1
    if len(names) == 1 or cuts.size != len(names) - 1:
        return [(name, x, values)]
    return list(zip(names, np.split(x, cuts), np.split(values, cuts), strict=True))


def _points(one: Any) -> int:
    """Return the number of fitted values of one of several curves: those of a master curve are logarithms."""
    if hasattr(one, "omega"):
        return int(2 * one.omega.size)
    if hasattr(one, "thickness"):
        return int(one.t.size)
    values = one.modulus if hasattr(one, "modulus") else one.J
    return int(np.sum((one.t > 0) & (values > 0)))
