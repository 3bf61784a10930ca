"""The command ``jaxcontact fit map``: the force curves of a map, or of a folder, as one table and one figure.

The curves are fitted in processes by ``jaxcontact.sweep``, which stores each as soon as it is finished, so that the same
command continues a map that was stopped.
"""

import argparse
import dataclasses
import json
import math
import re
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
from tqdm import tqdm

import jaxcontact as jc
from fitting.cli import flags, kinds
from fitting.inference.result import Fit
from fitting.read import force_curves
from fitting.read.force_curves import Place, curves_in
from fitting.views import output, sheet, text
from fitting.views.text import counted, in_flags

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


# Figure of a map of force curves: modulus, contact point and verdict, over the place or the number of the curve.


COLOURS = {"accepted": "C0", "rejected": "C1", "failed": "0.6"}
SIZE = 5.0  # width of a map [inches]


@sheet.styled
def draw(points: Sequence[Any]) -> Any:
    """Return a Figure of a list of ``MapPoint``."""
    from matplotlib.figure import Figure

    x, y = (np.array([getattr(one, name) for one in points]) for name in ("x", "y"))
    figure = Figure(figsize=(3 * SIZE, SIZE), layout="constrained")
    axes = [figure.add_subplot(1, 3, k + 1) for k in range(3)]
    if np.all(np.isfinite(x) & np.isfinite(y)) and (np.ptp(x) > 0.0 or np.ptp(y) > 0.0):
        _maps(figure, axes, points, x - x.min(), y - y.min())
    else:
        _rows(axes, points)
    return figure


def _maps(figure: Any, axes: list[Any], points: Sequence[Any], x: np.ndarray, y: np.ndarray) -> None:
    """Draw modulus, contact point and verdict over the place."""
    from matplotlib.colors import LogNorm

    good = np.array([one.verdict == "accepted" for one in points])
    # squares that almost touch where the places are closest along an axis
    steps = np.concatenate([np.diff(np.unique(np.round(v, 12))) for v in (x, y)])
    spacing = float(steps.min()) if steps.size else 1.0
    side = 0.8 * 72.0 * SIZE * spacing / max(np.ptp(x), np.ptp(y), 1e-300)
    size = float(np.clip(0.7 * side, 3.0, 60.0)) ** 2
    for axes_, name, unit, values in (
        (axes[0], "Young's modulus", "Pa", np.array([one.E for one in points])),
        (axes[1], "contact point", "m", np.array([one.contact for one in points])),
    ):
        known = good & np.isfinite(values)
        axes_.scatter(x[~known], y[~known], s=size, marker="s", facecolor="none", edgecolor="0.7")
        if known.any():
            factor, shown = sheet.multiple(unit, float(np.max(np.abs(values[known]))))
            norm = LogNorm() if unit == "Pa" and np.ptp(values[known]) > 0.0 else None
            drawn = axes_.scatter(x[known], y[known], s=size, marker="s", c=values[known] / factor, norm=norm)
            figure.colorbar(drawn, ax=axes_, label=f"{name} [{shown}]")
        axes_.set_title(f"{name}; empty squares: not accepted", fontsize="medium")
    for verdict, colour in COLOURS.items():
        some = np.array([one.verdict == verdict for one in points])
        if some.any():
            axes[2].scatter(
                x[some], y[some], s=size, marker="s", color=colour, label=f"{verdict}: {some.sum()}"
            )
    axes[2].legend()
    for one in axes:
        one.set_aspect("equal", adjustable="datalim")
        sheet.axis_label(one.xaxis, "x", "m", x)
        sheet.axis_label(one.yaxis, "y", "m", y)


def _rows(axes: list[Any], points: Sequence[Any]) -> None:
    """Draw modulus with intervals, contact point and verdict over the number of the curve."""
    number = np.arange(len(points))
    for verdict, colour in COLOURS.items():
        some = np.array([one.verdict == verdict for one in points])
        E, low, high, contact = (
            np.array([getattr(one, name) for one in points])[some] for name in ("E", "low", "high", "contact")
        )
        ends = np.clip(np.where(np.isfinite([low, high]), [E - low, high - E], 0.0), 0.0, None)
        axes[0].errorbar(number[some], E, ends, fmt=".", color=colour, label=verdict if some.any() else None)
        axes[1].plot(number[some], contact, ".", color=colour)
        axes[2].bar([verdict], [some.sum()], color=colour)
    known = np.array([one.E for one in points if np.isfinite(one.E)])
    if known.size:
        axes[0].set_yscale("log")
    axes[0].set_ylabel("Young's modulus [Pa]")
    axes[0].legend()
    sheet.axis_label(
        axes[1].yaxis,
        "contact point",
        "m",
        np.array([one.contact for one in points if np.isfinite(one.contact)]),
    )
    axes[2].set_ylabel("number of curves")
    for one in axes[:2]:
        one.set_xlabel("number of the curve")


MAP_RESULTS = ("map.csv", "map.png", "summary.json")
STORE = "curves"  # folder of the stored fits
MAPPED = kinds.KINDS["force"]._replace(without=("curve", "polynomials", "model", "fixed", "adhesion"))
LOCAL = ("command", "kind", "directory", "force", "file", "processes")  # options that do not change a fit
NUMBERS = re.compile(r"\d[\d.]*(e[-+]?\d+)?")  # by which notes of one kind differ


@dataclasses.dataclass(frozen=True)
class MapPoint:
    """The fit of a curve: place [m], nan where unknown; E, low, high [Pa]; contact [m], a depth as measured; depth [m]: the
    largest; verdict: "accepted", "rejected" or "failed"; reason; notes of the fit."""

    file: str
    curve: int
    x: float
    y: float
    E: float = math.nan
    low: float = math.nan
    high: float = math.nan
    contact: float = math.nan
    depth: float = math.nan
    verdict: str = "failed"
    reason: str = ""
    notes: tuple[str, ...] = ()


def add_map(parser: Any) -> None:
    """Add the flags of ``fit map``."""
    what = "maps of force curves, single curves, or folders of them"
    parser.add_argument("file", metavar="PATH", nargs="+", help=what)
    parser.add_argument(
        "-o", dest="directory", type=Path, metavar="DIR", required=True, help="directory of the results"
    )
    parser.add_argument("--force", action="store_true", help="fit all curves again")
    each = "number of processes (one for each core)"
    parser.add_argument("--processes", type=int, metavar="N", help=each)
    flags.add(parser, MAPPED, flags.options_of(MAPPED))


def run_map(options: argparse.Namespace) -> int:
    """Fit the curves that are missing, and write table and figure; a curve that cannot be fitted does not stop others."""
    for path in options.file:
        if not Path(path).exists():
            raise ValueError(f"{path}: expected a file or a folder, got neither")
    files, left = files_of(options.file)
    # a case for each curve; a file that cannot be read is one case, which fails
    cases: list[dict[str, Any]] = []
    for file in map(Path, files):
        try:
            places = force_curves.places(file)
        except ValueError:
            places = [Place(0, math.nan, math.nan)]
        plain = lambda value: None if math.isnan(value) else value
        of_file = {"file": str(file.resolve()), "changed": file.stat().st_mtime_ns, "choose": len(places) > 1}
        cases += [of_file | {"curve": one.curve, "x": plain(one.x), "y": plain(one.y)} for one in places]
    assumed = kinds.check_contact(options)
    given = {name: value for name, value in vars(options).items() if name not in LOCAL}
    _check_directory(options, given)
    study = jc.sweep(
        _fitted(given),
        cases,
        options.directory / STORE,
        processes=options.processes,
        version=f"map {jc.__version__}",
    )
    points = [_point(case, study, k) for k, case in enumerate(cases)]
    E = np.array([one.E for one in points if one.verdict == "accepted"])
    quartiles = [float(v) for v in np.percentile(E, [25, 50, 75])] if E.size else None
    # each kind of note, with the number of its curves and the note of the first
    notes = counted(((NUMBERS.sub("0", note), note) for one in points for note in one.notes), len(points))
    summary = {
        "paths": list(options.file), "options": {name: value for name, value in given.items() if value is not None},
        "curves": len(points), "accepted": int(E.size), "youngs_modulus_Pa_quartiles": quartiles, "notes": notes,
    }  # fmt: skip
    output.write_json(options.directory / "summary.json", summary)
    units = {"x": "m", "y": "m", "E": "Pa", "low": "Pa", "high": "Pa", "contact": "m", "depth": "m"}
    shown = {"low": "E low", "high": "E high", "contact": "contact point"}
    names = [field.name for field in dataclasses.fields(MapPoint)]
    heads = [f"{shown.get(name, name)} [{units[name]}]" if name in units else name for name in names]
    rows = [[*(getattr(one, name) for name in names[:-1]), "; ".join(one.notes)] for one in points]
    output.write_table(options.directory / "map.csv", heads, rows)
    output.write(
        options.directory / "map.png",
        lambda path: draw(points).savefig(path, dpi=150, format="png"),
    )
    for line in [*([assumed] if assumed else []), *(f"note: {note}" for note in left)]:
        print(line)
    print(f"{E.size} of {len(points)} curves accepted")
    if quartiles:
        low, middle, high = quartiles
        print(f"E = {middle:.4g} Pa (median), {low:.4g} to {high:.4g} Pa (half of them)")
    for line in notes:
        print(f"note: {line}")
    for one in points:
        if one.verdict != "accepted":
            print(f"{Path(one.file).name}, curve {one.curve}: {one.verdict}: {one.reason}")
    print(f"in {options.directory}: map.csv, map.png, summary.json")
    failed = sum(one.verdict == "failed" for one in points)
    if failed:
        print(f"{failed} of {len(points)} curves could not be fitted")
    return FAILED if failed else 0


def _check_directory(options: argparse.Namespace, given: dict[str, Any]) -> None:
    """Raise ValueError unless the directory is new, empty, or that of a map with the same options."""
    directory: Path = options.directory
    known = directory / "options.json"
    text = json.dumps(given, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    if directory.is_dir() and any(directory.iterdir()):
        same = known.is_file() and known.read_text(encoding="utf-8") == text
        if not same and not options.force:
            what = "that is not empty and not of a map with these options"
            raise ValueError(f"{directory}: found a directory {what}; --force overwrites it")
        if options.force and (directory / STORE).is_dir():
            for path in (directory / STORE).glob("*"):
                path.unlink()
    directory.mkdir(parents=True, exist_ok=True)
    output.write_text(known, text)


def _fitted(given: dict[str, Any]) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """Return the function that fits one curve with these options."""

    def fitted(case: dict[str, Any]) -> dict[str, Any]:
        options = argparse.Namespace(**given)
        try:
            chosen = {"curve": case["curve"]} if case["choose"] else {}
            found = kinds.fitted(MAPPED, options, case["file"], **chosen)
        except ValueError as error:
            return {"numbers": np.full(5, np.nan), "words": _coded("failed", str(error))}
        numbers = [*found.youngs_modulus, found.nuisances["contact_point"][0], float(found.depth.max())]
        words = _coded(found.verdict, "; ".join(found.refused), found.notes)
        return {"numbers": np.array(numbers), "words": words}

    return fitted


def _coded(verdict: str, reason: str, notes: Sequence[str] = ()) -> np.ndarray:
    """Return texts as an array of bytes, since a study stores numbers."""
    return np.frombuffer(json.dumps([verdict, reason, list(notes)]).encode(), dtype=np.uint8)


def _point(case: dict[str, Any], study: Any, k: int) -> MapPoint:
    """Return the result of a case."""
    place = [math.nan if case[name] is None else case[name] for name in ("x", "y")]
    point = MapPoint(str(Path(case["file"])), case["curve"], *place)
    if k in study.failures:
        return dataclasses.replace(point, reason=study.failures[k])
    found = study[k]
    verdict, reason, notes = json.loads(found["words"].astype(np.uint8).tobytes())
    numbers = dict(zip(("E", "low", "high", "contact", "depth"), found["numbers"].tolist(), strict=True))
    said = tuple(in_flags(note) for note in notes)
    return dataclasses.replace(point, **numbers, verdict=verdict, reason=in_flags(reason), notes=said)
