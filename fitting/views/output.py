"""Output files of a fit command, summary.json, curve.csv and fit.png, each written atomically."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fitting.views.shell_words import in_flags
from jaxcontact._support.npz import write_whole as write

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


def finish(options: argparse.Namespace, found: Any, more: dict[str, Any] | None = None) -> int:
    """Print the summary and write the results."""
    print(in_flags(found.summary()))
    leave(found, options.directory, {"file": Path(options.file).name} | (more or {}))
    print(f"in {options.directory}: summary.json, curve.csv, fit.png")
    return 0


def leave(found: Any, directory: Path, more: dict[str, Any]) -> None:
    """Write the summary, the curve and the figure of a fit."""
    directory.mkdir(parents=True, exist_ok=True)
    write_json(directory / "summary.json", found.to_dict() | more)
    write(directory / "curve.csv", lambda path: _curve(found, path))
    write(directory / "fit.png", lambda path: found.plot().savefig(path, dpi=150, format="png"))


def write_json(path: Path, values: dict[str, Any]) -> None:
    """Write values as JSON."""
    write_text(path, json.dumps(values, indent=2, ensure_ascii=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8."""
    write(path, lambda partial: partial.write_text(text, encoding="utf-8", errors="backslashreplace"))


def _curve(fit: Any, path: Path) -> None:
    """Write time or frequency, data, fit and residual of every fitted point, the fit minus the data, in the unit of the data
    and in standard deviations, those that were given or else estimated with the fit."""
    name, unit, t, measured = fit.curve
    header = (
        "{} [{}]".format(*fit.abscissa)
        + f",{name} [{unit}],fitted [{unit}],residual [{unit}],residual [standard deviations]"
    )
    deviations = fit.residuals if fit.weights == "sigma" else fit.residuals / max(fit.noise or 0.0, 1e-300)
    columns = np.column_stack([t, measured, fit.fitted, fit.fitted - measured, deviations])
    np.savetxt(path, columns, delimiter=",", header=header, comments="")
