"""The command ``jaxcontact fit batch``: fits of many curves, with a folder for each, one table and one HTML page."""

import argparse
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from tqdm import tqdm

from fitting.cli import batch_page, kinds
from fitting.inference.result import Fit
from fitting.io.folders import curves_in
from fitting.views import output, report
from fitting.views.shell_words import in_flags

RESULTS = ("summary.json", "table.csv", "report.html")
FAILED = 3  # exit status where a part of the inputs could not be fitted


class FileFit(NamedTuple):
    """Result of one file: its fit, or the error message instead; folder: of the results."""

    file: str
    folder: str
    fit: Fit | None
    error: str | None


def run(options: argparse.Namespace) -> int:
    """Fit every file; a file that cannot be read or fitted is listed with the reason and does not stop the others.

    The exit status is 3 where a file could not be fitted, as that of ``jaxcontact sweep``.
    """
    options = kinds.checked(options)
    options.file, notes = files_of(options.file)
    folders = folders_of(options.file)
    written = [f"{folder}/{name}" for folder in folders for name in output.RESULTS]
    output.check_directory(options, (*RESULTS, *written))
    files = tqdm(options.file, "fitting", unit="file", disable=None, leave=False)
    found = [_outcome(options, path, folder) for path, folder in zip(files, folders, strict=True)]
    if all(one.error for one in found):
        raise ValueError(
            f"{found[0].error} (and no other file could be fitted)" if found[1:] else str(found[0].error)
        )
    for note in notes:
        print(f"note: {note}")
    for one in found:
        print(one.error if one.fit is None else f"{one.file}: {one.fit.verdict}, {report.in_words(one.fit)}")
    rows = [
        {"file": one.file, "folder": one.folder, "error": one.error} | (one.fit.to_dict() if one.fit else {})
        for one in found
    ]
    output.write_json(
        options.directory / "summary.json", {"model": options.model, "fits": rows, "notes": notes}
    )
    output.write_table(options.directory / "table.csv", *_table(rows, [one.fit for one in found]))
    output.write_text(options.directory / "report.html", batch_page.page(options.model, found, options.kind))
    print(f"in {options.directory}: report.html, summary.json, table.csv, and a folder for each fit")
    failed = sum(one.fit is None for one in found)
    if failed:
        print(f"{failed} of {len(found)} files could not be fitted")
    return FAILED if failed else 0


def files_of(paths: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the files, with those of each folder that may hold curves in place of it, and notes on the others."""
    found = [curves_in(path) if Path(path).is_dir() else ([path], "") for path in paths]
    return [file for files, _ in found for file in files], [note for _, note in found if note]


def _outcome(options: argparse.Namespace, file: str, folder: str) -> FileFit:
    """Return the fit of a file, after writing its results, or the error."""
    try:
        found = kinds.fitted(options, file)
    except ValueError as error:
        return FileFit(file, folder, None, in_flags(str(error)))
    output.leave(found, options.directory / folder, {"file": file})
    return FileFit(file, folder, found, None)


def folders_of(files: Sequence[str]) -> list[str]:
    """Return a folder for the results of each file; all differ on any system, and none leaves the output directory.

    The folder is named after the file without its suffix. If that is empty, the name of one of the results of the
    batch, or equal to that of another file up to case, it is prefixed by the position of the file.

    Example:
        >>> folders_of(["x/a.csv", "y/a.csv", "1_a.csv", "...csv", "report.html.csv"])
        ['0_a', '1_a_', '1_a', '3_', '4_report.html']
    """
    names = [_plain(Path(file).stem) for file in files]
    plain = [name.casefold() for name in names]
    alone = [bool(name) and plain.count(name) == 1 and name not in RESULTS for name in plain]
    taken = {name for name, single in zip(plain, alone, strict=True) if single}
    found = []
    for place, (name, single) in enumerate(zip(names, alone, strict=True)):
        folder = name if single else f"{place}_{name}"
        while not single and folder.casefold() in taken:
            folder += "_"
        taken.add(folder.casefold())
        found.append(folder)
    return found


def _plain(name: str) -> str:
    """Return a name without characters that some system does not allow, and without dots and blanks at its ends."""
    return re.sub(r'[<>:"/\\|?*\x00-\x1f]', "_", name).strip(". ")


def _table(rows: list[dict[str, Any]], fits: list[Fit | None]) -> tuple[list[str], list[list[Any]]]:
    """Return the names and one row for each file: parameters with their intervals, and the verdict or the error."""
    keys = list(next(row["parameters"] for row in rows if not row["error"]))
    first = next(fit for fit in fits if fit)
    units = {first.structure.key(name): (name, first.structure.unit(name)) for name in first.values}
    heads = [
        f"{units[key][0]}{end} [{units[key][1] or '-'}]" for key in keys for end in ("", " low", " high")
    ]
    table = []
    for row in rows:
        if row["error"]:
            table.append([row["file"], *[None] * len(heads), "failed", row["error"]])
            continue
        spans = [(row["parameters"].get(key), *row["intervals"].get(key, (None, None))) for key in keys]
        table.append(
            [row["file"], *(x for span in spans for x in span), row["verdict"], "; ".join(row["reasons"])]
        )
    return ["file", *heads, "verdict", "reason"], table
