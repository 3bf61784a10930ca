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
from pathlib import Path
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting.cli import batch_command, force_command
from fitting.io import afm
from fitting.io.places import Place
from fitting.views import map_picture, output, report
from fitting.views.shell_words import in_flags

RESULTS = ("map.csv", "map.png", "summary.json")
STORE = "curves"  # folder of the stored fits
LOCAL = ("command", "directory", "force", "file", "processes")  # options that do not change a fit
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
    force_command.add_sample(parser)
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> int:
    """Fit the curves that are missing, and write table and figure; a curve that cannot be fitted does not stop others."""
    for path in options.file:
        if not Path(path).exists():
            raise ValueError(f"{path}: expected a file or a folder, got neither")
    files, left = batch_command.files_of(options.file)
    cases = [case for file in files for case in _curves(Path(file))]
    _, assumed = force_command.tip_of(options)
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
    output.write_json(options.directory / "summary.json", _summary(options, given, points))
    output.write_table(options.directory / "map.csv", *_table(points))
    output.write(
        options.directory / "map.png",
        lambda path: map_picture.draw(points).savefig(path, dpi=150, format="png"),
    )
    for line in [*([assumed] if assumed else []), *(f"note: {note}" for note in left)]:
        print(line)
    _report(points)
    print(f"in {options.directory}: map.csv, map.png, summary.json")
    failed = sum(one.verdict == "failed" for one in points)
    if failed:
        print(f"{failed} of {len(points)} curves could not be fitted")
    return batch_command.FAILED if failed else 0


def _curves(file: Path) -> list[dict[str, Any]]:
    """Return the cases of a file, one for each curve; a file that cannot be read is one case, which fails."""
    try:
        places = afm.places(file)
    except ValueError:
        places = [Place(0, math.nan, math.nan)]
    plain = lambda value: None if math.isnan(value) else value
    stamp = file.stat().st_mtime_ns
    several = len(places) > 1
    return [
        {
            "file": str(file.resolve()), "changed": stamp, "curve": one.curve, "choose": several,
            "x": plain(one.x), "y": plain(one.y),
        }
        for one in places
    ]  # fmt: skip


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
            found = force_command.fitted(options, case["file"], case["curve"] if case["choose"] else None)
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


def _accepted(points: list[MapPoint]) -> np.ndarray:
    """Return Young's moduli of the accepted fits."""
    return np.array([one.E for one in points if one.verdict == "accepted"])


def _noted(points: list[MapPoint]) -> list[str]:
    """Return each kind of note, with the number of its curves and the note of the first."""
    return report.counted(
        ((NUMBERS.sub("0", note), note) for one in points for note in one.notes), len(points)
    )


def _report(points: list[MapPoint]) -> None:
    """Print the numbers of accepted and rejected curves, the moduli, the notes, and the reasons."""
    E = _accepted(points)
    print(f"{E.size} of {len(points)} curves accepted")
    if E.size:
        low, middle, high = np.percentile(E, [25, 50, 75])
        print(f"E = {middle:.4g} Pa (median), {low:.4g} to {high:.4g} Pa (half of them)")
    for line in _noted(points):
        print(f"note: {line}")
    for one in points:
        if one.verdict != "accepted":
            print(f"{Path(one.file).name}, curve {one.curve}: {one.verdict}: {one.reason}")


def _summary(options: argparse.Namespace, given: dict[str, Any], points: list[MapPoint]) -> dict[str, Any]:
    E = _accepted(points)
    quartiles = [float(v) for v in np.percentile(E, [25, 50, 75])] if E.size else None
    return {
        "paths": list(options.file), "options": {name: value for name, value in given.items() if value is not None},
        "curves": len(points), "accepted": int(E.size), "youngs_modulus_Pa_quartiles": quartiles,
        "notes": _noted(points),
    }  # fmt: skip


def _table(points: list[MapPoint]) -> tuple[list[str], list[list[Any]]]:
    """Return the names and one row for each curve."""
    units = {"x": "m", "y": "m", "E": "Pa", "low": "Pa", "high": "Pa", "contact": "m", "depth": "m"}
    shown = {"low": "E low", "high": "E high", "contact": "contact point"}
    names = [field.name for field in dataclasses.fields(MapPoint)]
    heads = [f"{shown.get(name, name)} [{units[name]}]" if name in units else name for name in names]
    return heads, [[*(getattr(one, name) for name in names[:-1]), "; ".join(one.notes)] for one in points]
