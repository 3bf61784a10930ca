"""The command ``jaxcontact fit batch``: many creep curves, a folder for each fit, one table and one page for all."""

import argparse
import csv
import io
from pathlib import Path
from typing import Any, NamedTuple

from tqdm import tqdm

from fitting import batch_page, flags, output
from fitting.creep import CreepFit, fit_creep


class FileFit(NamedTuple):
    """Of one file: its fit, or the error in its place; folder: of the results."""

    file: str
    folder: str
    fit: CreepFit | None
    error: str | None


def run(options: argparse.Namespace) -> int:
    """Fit every file; one that cannot be read or fitted is listed with the reason, and stops nothing."""
    output.check_directory(options)
    files = tqdm(options.file, "fitting", unit="file", disable=None, leave=False)
    found = [_outcome(options, path) for path in files]
    if all(one.error for one in found):
        raise ValueError(
            f"{found[0].error} (and none of the other files)" if found[1:] else str(found[0].error)
        )
    for one in found:
        print(one.error if one.fit is None else f"{one.file}: {one.fit.verdict}")
    rows = [{"file": one.file, "error": one.error} | (one.fit.to_dict() if one.fit else {}) for one in found]
    output.write_json(options.directory / "summary.json", {"model": options.model, "fits": rows})
    output.write_text(options.directory / "table.csv", _table(rows))
    output.write_text(options.directory / "report.html", batch_page.page(options.model, found))
    print(f"in {options.directory}: report.html, summary.json, table.csv, and a folder for each fit")
    return 0


def _outcome(options: argparse.Namespace, file: str) -> FileFit:
    """The fit of a file, left in its folder, or an error."""
    folder = _folder(options.file, file)
    try:
        data, given = flags.crept(options, file)
        found = fit_creep(data, options.model, **given, **flags.known(options))
    except ValueError as error:
        return FileFit(file, folder, None, flags.in_flags(str(error)))
    output.leave(found, options.directory / folder, {"file": file})
    return FileFit(file, folder, found, None)


def _folder(files: list[str], file: str) -> str:
    """The file's name without its ending, with its position where another has the same."""
    names = [Path(one).stem for one in files]
    name = Path(file).stem
    return name if names.count(name) == 1 else f"{files.index(file)}_{name}"


def _table(rows: list[dict[str, Any]]) -> str:
    """One line for each file: parameters with their intervals, and the verdict or the error."""
    names = list(next(row["parameters"] for row in rows if not row["error"]))
    head = ["file", *(f"{name}{end}" for name in names for end in ("", "_low", "_high")), "verdict", "reason"]
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(head)
    for row in rows:
        if row["error"]:
            table.writerow([row["file"], *[""] * 3 * len(names), "failed", row["error"]])
            continue
        spans = [(row["parameters"][name], *row["intervals"][name]) for name in names]
        numbers = ["" if x is None else f"{x:.6g}" for span in spans for x in span]
        table.writerow([row["file"], *numbers, row["verdict"], "; ".join(row["reasons"])])
    return text.getvalue()
