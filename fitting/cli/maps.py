"""The commands ``jaxcontact fit batch`` and ``fit map``: many curves, as tables, figures and a report.

The curves of a map are fitted by ``fitting.fit_map``, which stores each batch as soon as it is finished, so that the same
command continues a map that was stopped.
"""

import argparse
import contextlib
import dataclasses
import json
import math
import re
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
from tqdm import tqdm

from fitting.cli import flags, kinds
from fitting.data import force_curves
from fitting.data.force_curves import Place, curves_in
from fitting.fits.force_map import fit_map
from fitting.inference.result import Fit
from fitting.views import output, text
from fitting.views.text import in_flags
from jaxcontact._support.terminal import exit_status, print_error, signal_of

# HTML report of a batch: a table of all fits, a small plot of each, and the files that failed.


STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1f24; max-width: 64rem; margin: 1.5rem auto; padding: 0 1rem }
h1 { font-size: 1.5rem; line-height: 1.25 } h2 { font-size: 1.15rem; margin-top: 2.2rem }
table { border-collapse: collapse; width: 100%; font-size: .87rem; font-variant-numeric: tabular-nums }
th, td { padding: .35rem .6rem; text-align: left; border-bottom: 1px solid #d8dee4; vertical-align: top }
th { background: #f4f6f8 } td, li, figcaption { overflow-wrap: anywhere } small { color: #57606a; display: block }
span.accepted { color: #0b5394; font-weight: 600 } span.rejected, .failed { color: #9a3412; font-weight: 600 }
.many { display: grid; grid-template-columns: repeat(auto-fill, minmax(11rem, 1fr)); gap: 1rem }
figure { margin: 0 } svg { width: 100%; height: auto; border: 1px solid #d8dee4 } figcaption { font-size: .85rem }
text { font: 9px system-ui, sans-serif; fill: #57606a } circle { fill: #57606a; opacity: .6 }
polyline { fill: none; stroke: #0b5394; stroke-width: 1.6 } .rejected polyline { stroke: #9a3412 }
@media (max-width: 40rem) {
  thead { display: none } tr { display: block; padding: .5rem 0; border-bottom: 2px solid #d8dee4 }
  td { display: grid; grid-template-columns: 6rem 1fr; border: 0; padding: .15rem 0 }
  td::before { content: attr(data-of); color: #57606a }
}
"""
WIDTH, HEIGHT, EDGE, FOOT = 200.0, 140.0, 6.0, 14.0  # size of a plot and its margins
MOST = 150  # largest number of plotted points of a curve


def page(model: str, outcomes: Sequence[Any], kind: str = "creep") -> str:
    """Return the HTML page of the outcomes, a sequence of ``FileFit``, for curves of a kind."""
    fits = [one for one in outcomes if one.fit is not None]
    failed = [one for one in outcomes if one.fit is None]
    accepted = sum(not one.fit.refused for one in fits)
    over = "over time" if kind != "oscillation" else "over the logarithm of the angular frequency"
    title = f"{escape(model)} fits of {len(outcomes)} {kind} curves"
    # a row for each fit; on a narrow screen each cell stands under the name of its column
    structure, names = fits[0].fit.structure, list(fits[0].fit.values)
    heads = ["file", *(f"{name} [{structure.unit(name)}]" for name in names), "verdict"]
    rows = []
    for one in fits:
        why = "".join(f"<small>{escape(reason)}</small>" for reason in one.fit.refused)
        verdict = f'<span class="{one.fit.verdict}">{one.fit.verdict}</span>, {text.in_words(one.fit)}{why}'
        cells = [
            f'<a href="{quote(one.folder)}/fit.png">{escape(one.file)}</a>',
            *(_parameter(one.fit, name) for name in names),
            f"<span>{verdict}</span>",
        ]
        marked = zip(heads, cells, strict=True)
        row = "".join(f'<td data-of="{escape(head, quote=True)}">{cell}</td>' for head, cell in marked)
        rows.append(f"<tr>{row}</tr>")
    head, lines = "".join(f"<th>{escape(one)}</th>" for one in heads), "\n".join(rows)
    reasons = "".join(f"<li>{escape(one.error)}</li>" for one in failed)
    body = [
        f"<h1>{title}</h1>",
        f"<p>Fits accepted: {accepted}; fits rejected: {len(fits) - accepted}; files that could not be read or fitted:"
        f" {len(failed)}. Intervals are those of the profile likelihood at {100 * fits[0].fit.level:g} %. No parameter is"
        " determined by a rejected fit.</p>",
        *([f'<h2 class="failed">Not fitted</h2>\n<ul>{reasons}</ul>'] if failed else []),
        "<h2>Parameters</h2>",
        f"<table><thead><tr>{head}</tr></thead>\n<tbody>\n{lines}\n</tbody></table>",
        "<h2>Curves</h2>",
        f"<p>Data (dots) and fit (line) {over}; the numbers in the corners are the limits of the axes.</p>",
        f'<div class="many">{"".join(map(_figure, fits))}</div>',
    ]
    view = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n{view}\n<title>{title}</title>\n'
        f"<style>{STYLE}</style>\n</head>\n<body>\n" + "\n".join(body) + "\n</body>\n</html>\n"
    )


def _parameter(fit: Any, name: str) -> str:
    """Return the value and interval of a parameter, or the interval alone if it is not determined."""
    if name in fit.fixed:
        return f"<span>{fit.values[name]:.4g}<small>held</small></span>"
    between = escape(text.span(*fit.intervals[name]))
    if fit.identified[name]:
        return f"<span>{fit.values[name]:.4g}<small>{between}</small></span>"
    return f"<span>not determined<small>{between}</small></span>"


def _figure(one: Any) -> str:
    """Return a small plot of data and fit of a curve."""
    name, unit, t, measured = one.fit.curve
    some = np.unique(np.linspace(0, t.size - 1, min(t.size, MOST)).round().astype(int))
    low, high = min(0.0, measured.min()), max(measured.max(), one.fit.fitted.max())
    symbol, over = one.fit.abscissa
    at = t if symbol == "t" else np.log(t)
    x = EDGE + (WIDTH - 2 * EDGE) * (at - at.min()) / np.ptp(at)
    place = lambda y: HEIGHT - FOOT - EDGE - (HEIGHT - 2 * FOOT - EDGE) * (y - low) / (high - low)
    data = "".join(f'<circle cx="{x[i]:.1f}" cy="{place(measured)[i]:.1f}" r="1.6"/>' for i in some)
    rows = np.split(some, np.flatnonzero(np.diff(x[some]) < 0) + 1)  # G' and G''
    lines = "".join(
        f'<polyline points="{" ".join(f"{x[i]:.1f},{place(one.fit.fitted)[i]:.1f}" for i in row)}"/>'
        for row in rows
    )
    corners = (
        f'<text x="4" y="11">{high:.3g} {escape(unit)}</text><text x="4" y="{HEIGHT - 4:g}">{low:.3g} at {t[0]:.3g} {over}'
        f'</text><text x="{WIDTH - 4:g}" y="{HEIGHT - 4:g}" text-anchor="end">{t[-1]:.4g} {over}</text>'
    )
    file, verdict = escape(Path(one.file).name, quote=True), one.fit.verdict
    return (
        f'<figure class="{verdict}"><svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img"'
        f' aria-label="{escape(name)} of {file}">'
        f"{data}{lines}{corners}</svg>\n"
        f'<figcaption>{file}: <span class="{verdict}">{verdict}</span></figcaption></figure>'
    )


# The command ``jaxcontact fit batch``: fits of many curves, with a folder for each, one table and one HTML page.


BATCH_RESULTS = ("summary.json", "table.csv", "report.html")
FAILED = 3  # exit status where a part of the inputs could not be fitted


class FileFit(NamedTuple):
    """Result of one file: its fit, or the error message instead; folder: of the results."""

    file: str
    folder: str
    fit: Fit | None
    error: str | None


def run_batch(options: argparse.Namespace) -> int:
    """Fit every file; a file that cannot be read or fitted is listed with the reason and does not stop the others.

    The exit status is 3 where a file could not be fitted, as that of ``jaxcontact sweep``.
    """
    kind, options = kinds.checked(options)
    options.file, notes = files_of(options.file)
    folders = folders_of(options.file)
    written = [f"{folder}/{name}" for folder in folders for name in output.RESULTS]
    output.check_directory(options, (*BATCH_RESULTS, *written))
    found: list[FileFit] = []
    files = tqdm(options.file, "fitting", unit="file", disable=None, leave=False)
    for file, folder in zip(files, folders, strict=True):
        try:
            fit = kinds.fitted(kind, options, file)
        except ValueError as error:
            found.append(FileFit(file, folder, None, in_flags(str(error))))
            continue
        output.leave(fit, options.directory / folder, {"file": file})
        found.append(FileFit(file, folder, fit, None))
    fits = [one.fit for one in found if one.fit]
    if not fits:
        raise ValueError(
            f"{found[0].error} (and no other file could be fitted)" if found[1:] else str(found[0].error)
        )
    for note in notes:
        print(f"note: {note}")
    for one in found:
        print(one.error if one.fit is None else f"{one.file}: {one.fit.verdict}, {text.in_words(one.fit)}")
    rows = [
        {"file": one.file, "folder": one.folder, "error": one.error} | (one.fit.to_dict() if one.fit else {})
        for one in found
    ]
    output.write_json(
        options.directory / "summary.json", {"model": options.model, "fits": rows, "notes": notes}
    )
    # a row for each file: parameters with their intervals, and the verdict, or the error
    structure = fits[0].structure
    keys = list(next(row["parameters"] for row in rows if not row["error"]))
    named = {structure.key(name): (name, structure.unit(name) or "-") for name in fits[0].values}
    heads = [f"{named[key][0]}{end} [{named[key][1]}]" for key in keys for end in ("", " low", " high")]
    table = []
    for row in rows:
        if row["error"]:
            table.append([row["file"], *[None] * len(heads), "failed", row["error"]])
            continue
        spans = [(row["parameters"].get(key), *row["intervals"].get(key, (None, None))) for key in keys]
        table.append(
            [row["file"], *(x for span in spans for x in span), row["verdict"], "; ".join(row["reasons"])]
        )
    output.write_table(options.directory / "table.csv", ["file", *heads, "verdict", "reason"], table)
    output.write_text(options.directory / "report.html", page(options.model, found, options.kind))
    print(f"in {options.directory}: report.html, summary.json, table.csv, and a folder for each fit")
    failed = len(found) - len(fits)
    if failed:
        print(f"{failed} of {len(found)} files could not be fitted")
    return FAILED if failed else 0


def files_of(paths: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the files, with those of each folder that may hold curves in place of it, and notes on the others."""
    found = [curves_in(path) if Path(path).is_dir() else ([path], "") for path in paths]
    return [file for files, _ in found for file in files], [note for _, note in found if note]


def folders_of(files: Sequence[str]) -> list[str]:
    """Return a folder for the results of each file; all differ on any system, and none leaves the output directory.

    The folder is named after the file without its suffix. If that is empty, the name of one of the results of the
    batch, or equal to that of another file up to case, it is prefixed by the position of the file.

    Example:
        >>> folders_of(["x/a.csv", "y/a.csv", "1_a.csv", "...csv", "report.html.csv"])
        ['0_a', '1_a_', '1_a', '3_', '4_report.html']
    """
    # without characters that some system does not allow, and without dots and blanks at the ends
    names = [re.sub(r'[<>:"/\\|?*\x00-\x1f]', "_", Path(file).stem).strip(". ") for file in files]
    plain = [name.casefold() for name in names]
    alone = [bool(name) and plain.count(name) == 1 and name not in BATCH_RESULTS for name in plain]
    taken = {name for name, single in zip(plain, alone, strict=True) if single}
    found = []
    for place, (name, single) in enumerate(zip(names, alone, strict=True)):
        folder = name if single else f"{place}_{name}"
        while not single and folder.casefold() in taken:
            folder += "_"
        taken.add(folder.casefold())
        found.append(folder)
    return found


# The command ``jaxcontact fit map``: the force curves of a map, or of a folder, in one table and one figure.


STORE = "curves"  # folder of the stored fits
MAP_RESULTS = ("map.csv", "map.nc", "map.png", "summary.json")
MAPPED = kinds.KINDS["force"]._replace(without=("curve", "polynomials", "model", "fixed", "adhesion"))
# options that do not change a fit
LOCAL = (
    "command",
    "kind",
    "directory",
    "force",
    "resume",
    "file",
    "processes",
)
REASONS = 20  # curves that are not accepted whose reasons are printed


def add_map(parser: Any) -> None:
    """Add the flags of ``fit map``."""
    what = "maps of force curves, single curves, or folders of them"
    parser.add_argument("file", metavar="PATH", nargs="+", help=what)
    parser.add_argument(
        "-o", dest="directory", type=Path, metavar="DIR", required=True, help="directory of the results"
    )
    parser.add_argument("--force", action="store_true", help="fit all curves again")
    resume = (
        "continue a map that was stopped, which must be in DIR (a map in DIR is continued without it too)"
    )
    parser.add_argument("--resume", action="store_true", help=resume)
    each = "number of batches of curves at a time (one for each core)"
    parser.add_argument("--processes", type=int, metavar="N", help=each)
    adhesive = "jkr: also fit the work of adhesion, to approach and retraction of a ball"
    parser.add_argument("--adhesion", type=str.lower, choices=("jkr",), help=adhesive)
    flags.add(parser, MAPPED, flags.options_of(MAPPED))


def run_map(options: argparse.Namespace) -> int:
    """Fit the curves that are missing, and write tables and figure; a curve that cannot be fitted does not stop others."""
    for path in options.file:
        if not Path(path).exists():
            raise ValueError(f"{path}: expected a file or a folder, got neither")
    assumed = kinds.check_contact(options)
    given = {name: value for name, value in vars(options).items() if name not in LOCAL}
    # the directory is new, empty, or that of a map with the same options
    directory: Path = options.directory
    known = directory / "options.json"
    text = json.dumps(given, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    same = known.is_file() and known.read_text(encoding="utf-8") == text
    if options.resume and not same:
        raise ValueError(f"--resume: expected a map with these options in {directory}, got none")
    if directory.is_dir() and any(directory.iterdir()):
        if not same and not options.force:
            what = "that is not empty and not of a map with these options"
            raise ValueError(f"{directory}: found a directory {what}; --force overwrites it")
        if options.force and (directory / STORE).is_dir():
            for path in (directory / STORE).glob("*"):
                path.unlink()
    files, left = files_of(options.file)
    output.check_directory(
        argparse.Namespace(directory=directory, force=True, file=files), (known.name, *MAP_RESULTS)
    )

    # The curves with their places; a file or a curve that cannot be read is one that fails.
    curves: list[Any] = []
    names: list[str] = []
    places: list[Place] = []
    arguments: dict[str, Any] = {}
    for file in tqdm(files, "reading", unit="file", disable=None, leave=False):
        try:
            found = force_curves.places(file)
        except ValueError:
            found = [Place(0, math.nan, math.nan)]
        for place in tqdm(found, "reading", unit="curve", disable=len(found) == 1 or None, leave=False):
            try:
                data, arguments = kinds.read(
                    MAPPED, options, file, **({"curve": place.curve} if len(found) > 1 else {})
                )
            except ValueError as error:
                curves.append(in_flags(str(error)))
            else:
                curves.append(data)
            names.append(str(Path(file).resolve()))
            places.append(place)
    if not arguments:
        raise ValueError(f"{curves[0]} (and no other curve could be read)" if curves[1:] else curves[0])
    x, y = (np.array([getattr(one, axis) for one in places]) for axis in "xy")
    directory.mkdir(parents=True, exist_ok=True)
    output.write_text(known, text)
    try:
        map_fit = fit_map(
            curves, **arguments, x=x, y=y, names=names, curve=np.array([one.curve for one in places]),
            adhesion=options.adhesion, store=directory / STORE, processes=options.processes, progress=True,
        )  # fmt: skip
    except KeyboardInterrupt as interrupt:
        count = len(list((directory / STORE).glob("*.npz")))
        reason = f"finished batches of curves: {count}; the same command with --resume continues"
        name = signal_of(interrupt).name
        return print_error(f"{directory}: interrupted by {name}: {reason}", exit_status(interrupt))
    except ValueError as error:  # wrong options leave no directory, in which the right ones would be refused
        if not same:
            known.unlink()
            with contextlib.suppress(OSError):  # unless it holds something else
                directory.rmdir()
        raise ValueError(in_flags(str(error))) from error
    map_fit = dataclasses.replace(
        map_fit, reasons=tuple(map(in_flags, map_fit.reasons)),
        notes=tuple(tuple(map(in_flags, one)) for one in map_fit.notes),
    )  # fmt: skip

    # The results in files, and printed.
    E = map_fit.youngs_modulus[map_fit.accepted]
    summary = map_fit.summary().splitlines()
    quartiles = [float(v) for v in np.percentile(E, [25, 50, 75])] if E.size else None
    output.write_json(options.directory / "summary.json", {
        "paths": list(options.file), "options": {name: value for name, value in given.items() if value is not None},
        "curves": len(curves), "accepted": int(E.size), "youngs_modulus_Pa_quartiles": quartiles,
        "shape": map_fit.shape, "notes": [line.removeprefix("note: ") for line in summary if line.startswith("note: ")],
    })  # fmt: skip
    map_fit.to_csv(options.directory / "map.csv")
    map_fit.plot(options.directory / "map.png")
    written = ["map.csv", "map.png", "summary.json"]
    try:
        map_fit.to_netcdf(options.directory / "map.nc")
    except ImportError as error:
        left = [*left, f"no map.nc: {error}"]
    else:
        written.insert(1, "map.nc")
    for line in [*([assumed] if assumed else []), *(f"note: {note}" for note in left), *summary]:
        print(line)
    bad = np.flatnonzero(~map_fit.accepted)
    for k in bad[:REASONS]:
        print(f"{Path(names[k]).name}, curve {places[k].curve}: {map_fit.verdict[k]}: {map_fit.reasons[k]}")
    if bad.size > REASONS:
        print(f"and {bad.size - REASONS} more, with their reasons in map.csv")
    print(f"in {options.directory}: {', '.join(written)}")
    failed = int(np.sum(map_fit.verdict == "failed"))
    if failed:
        print(f"{failed} of {len(curves)} curves could not be fitted")
    return FAILED if failed else 0
