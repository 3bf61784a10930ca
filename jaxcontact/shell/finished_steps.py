"""The finished steps of a run in a folder, where they outlive whatever ends the run.

One file for each block of steps, written once, and two checkpoints, which are replaced in turns: each says how many
blocks count, and has what the march goes on from. Whenever a run is killed, what the later checkpoint counts is whole,
and the run can go on from there. Where a disk has damaged it, the run goes on from the other one, a block before. At the
end the results are written: result.npz, course.npz, summary.json and the pictures.
"""

import functools
import hashlib
import json
import shutil
import warnings
import zipfile
import zlib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxcontact._support.fields import (
    FIELDS,
    TIME,
    arrays_of,
    following_from_maps,
    numbers_of,
    stored_fields,
)
from jaxcontact._support.files import Stacked, read_npz, write_npz, write_whole
from jaxcontact._support.fingerprint import source_digest
from jaxcontact._support.version import __version__
from jaxcontact.bodies.grid import Grid
from jaxcontact.results import storage
from jaxcontact.results.contact import ContactHistory
from jaxcontact.results.summaries import figures_in, values_of
from jaxcontact.shell.case_file import Case, caption_of, case_text, write_under
from jaxcontact.shell.case_schema import COURSE, FEW, at_times, time_series_of
from jaxcontact.simulate.run import FinishedBlock

CHECKPOINTS = ("checkpoint.npz", "checkpoint_of_odd.npz")  # after an even and an odd number of blocks
SLIP = "slip"  # the map that is a sum over the time since the map before


@dataclass(frozen=True)
class StoredFields:
    """The names of what is stored of a kind of result: fields over the grid at each time, of the whole run, numbers at each
    time, and lines and numbers at each time that follow from the maps."""

    maps: tuple[str, ...]
    whole: tuple[str, ...]
    series: tuple[str, ...]
    lines: tuple[str, ...]

    @classmethod
    def of(cls, kind: type) -> "StoredFields":
        names = stored_fields(kind)
        whole = tuple(name for name in names if TIME[0] not in FIELDS[name].dimensions)
        maps = tuple(name for name in names if name not in whole and FIELDS[name].is_map)
        series = tuple(name for name in names if name not in (*maps, *whole))
        return cls(maps, whole, series, following_from_maps(kind, names))

    def among(self, names: Collection[str]) -> "StoredFields":
        """Return those of some names: fields that may be None are not stored where they are."""
        kept = (
            tuple(n for n in group if n in names)
            for group in (self.maps, self.whole, self.series, self.lines)
        )
        return StoredFields(*kept)


@dataclass(frozen=True)
class ResumePoint:
    """Progress of a run.

    blocks, steps: how many are finished; status: of the step that ended the run, 0 for none; seconds: what it
    took so far; carry: what the march goes on from.
    """

    blocks: int = 0
    steps: int = 0
    status: int = 0
    seconds: float = 0.0
    carry: list[np.ndarray] | None = None


@dataclass(frozen=True)
class FinishedRun:
    """The finished steps, together.

    history: of the kind of the experiment, with the maps of the last step; chosen: the indices of the times of ``maps``,
    none for those of the last alone; first_pressure (nx, ny) [Pa]: of the first of them; lines: those of
    ``following_from_maps``, over all times.
    """

    history: ContactHistory
    chosen: np.ndarray
    first_pressure: np.ndarray | None
    maps: dict[str, Stacked]
    lines: dict[str, np.ndarray]


def fingerprint(case: Case) -> str:
    """Return a digest that two cases share only if they give the same result: of every number, and of the sources."""
    given = (case.body, case.indenter, case.control, case.times, case.grid, case.motion)
    leaves, structure = jax.tree.flatten(given)
    words = (
        f"{source_digest('jaxcontact')} {case.kind} {structure} {sorted(case.options.items())} {case.kept}"
    )
    numbers = b"".join(
        leaf.encode() if isinstance(leaf, str) else np.asarray(leaf, dtype=float).tobytes() for leaf in leaves
    )
    return hashlib.sha256(words.encode() + numbers).hexdigest()


@dataclass(frozen=True)
class FinishedSteps:
    """The finished steps in ``folder`` of the case with that ``fingerprint``; chosen: the times whose maps are kept; kind:
    of result."""

    folder: Path
    fingerprint: str
    chosen: np.ndarray
    kind: type[ContactHistory] = ContactHistory

    def remove(self) -> None:
        """Forget them all."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def resume_point(self) -> ResumePoint:
        """Return how far the run has come; warns where that is less than it was, since a file is damaged.

        Raises:
            ValueError: the steps are those of another case, or no run can go on from what is left of them.
        """
        # 1. The checkpoints that can be read, and how far each of them is.
        paths = [self.folder / name for name in CHECKPOINTS]
        found: dict[Path, dict[str, np.ndarray] | None] = {}
        for path in filter(Path.exists, paths):
            try:
                found[path] = read_npz(path)
            except (ValueError, FileNotFoundError):
                found[path] = None
        known = [checkpoint for checkpoint in found.values() if checkpoint is not None]
        if any(str(checkpoint["case"]) != self.fingerprint for checkpoint in known):
            raise ValueError(
                f"{self.folder}: found the steps of another case or --save, or of another state of jaxcontact;"
                " accepted with --resume: those of this one; --force starts anew"
            )
        if not found and not self._block(1).exists():  # killed before the first checkpoint, or not yet begun
            return ResumePoint()
        standings = []
        for checkpoint in known:
            blocks, steps, status = checkpoint["counts"].tolist()
            carry = [checkpoint[name] for name in sorted(checkpoint) if name.startswith("carry")]
            standings.append(ResumePoint(blocks, steps, status, float(checkpoint["seconds"]), carry))

        # 2. The first blocks of steps that can be read, up to the first that cannot.
        written = len([*self.folder.glob("[0-9]*.npz")])
        count = max((each.blocks for each in standings), default=written)
        whole = next((index for index in range(count) if not _intact(self._block(index))), count)
        damaged = [path for path in found if found[path] is None]
        damaged += [self._block(whole)] if whole < count else []

        # 3. The furthest checkpoint whose blocks can all be read.
        usable = [each for each in standings if each.blocks <= whole]
        if not usable:
            kept = f"; the first {whole} blocks of steps beside it are whole, and numpy.load reads them"
            raise ValueError(
                f"{(damaged or paths)[-1]}: missing or damaged, and no checkpoint before it is left to go on from"
                f"{kept if whole else ''}; --force starts anew"
            )
        furthest = max(usable, key=lambda resume_point: resume_point.blocks)
        if damaged:
            names = " and ".join(str(path) for path in damaged)
            warnings.warn(
                f"{names}: damaged; {furthest.steps} finished steps are whole, and the run goes on from there"
            )
        return furthest

    def add(self, before: ResumePoint, block: FinishedBlock, seconds: float) -> ResumePoint:
        """Keep a block; how far the run has then come."""
        count = block.history.times.size
        if not count:
            return replace(before, status=block.status)
        now = ResumePoint(before.blocks + 1, before.steps + count, block.status, seconds, block.carry)
        steps = np.isin(before.steps + np.arange(count), self.chosen)
        # the arrays, and the lines and numbers that follow from the maps, see ``FinishedRun``
        arrays, history = arrays_of(block.history), block.history
        middle = history.grid.shape[1] // 2
        following = following_from_maps(type(history), stored_fields(type(history)))
        for line in following:
            values = getattr(history, line.removesuffix("_line"), None) if FIELDS[line].is_map else None
            if values is not None:
                arrays[line] = np.asarray(values)[:, :, middle]
        arrays |= {name: values for name, values in numbers_of(history).items() if name in following}
        # the slip of each step is that since the last step whose maps are kept
        if SLIP in arrays and self.chosen.size:
            slip = arrays[SLIP] = arrays[SLIP].copy()
            if before.steps and before.steps - 1 not in self.chosen:
                slip[0] += read_npz(self._checkpoint(before.blocks), SLIP)[SLIP]
            for index in range(1, count):
                if not steps[index - 1]:
                    slip[index] += slip[index - 1]
        fields = StoredFields.of(self.kind).among(arrays)
        last = {name: arrays[name] for name in fields.whole} | {
            name: arrays[name][-1] for name in fields.maps
        }
        kept = {name: arrays[name] for name in (*fields.series, *fields.lines)}
        kept |= {name: arrays[name][steps] for name in fields.maps}
        self.folder.mkdir(exist_ok=True)
        write_whole(self._block(before.blocks), lambda path: write_npz(path, kept))
        # the checkpoint after them: what the march goes on from, and the fields of the last step
        counts = [now.blocks, now.steps, now.status]
        facts = {"case": self.fingerprint, "counts": counts, "seconds": now.seconds}
        facts |= {f"carry_{index:03}": leaf for index, leaf in enumerate(now.carry or [])}
        write_whole(self._checkpoint(now.blocks), lambda path: write_npz(path, facts | last))
        return now

    def together(self, count: int, grid: Grid) -> FinishedRun:
        """Return all steps of the first blocks, of which there is one at least."""
        checkpoint, fields = self._checkpoint(count), StoredFields.of(self.kind)
        last = read_npz(checkpoint, *fields.whole, *fields.maps)
        blocks = [self._block(index) for index in range(count)]
        fields = fields.among(last | read_npz(blocks[0], *fields.series, *fields.lines))
        # what has a value or a line for each step, of all blocks
        parts = [read_npz(block, *fields.series, *fields.lines) for block in blocks]
        series = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        lines = {name: series.pop(name) for name in fields.lines}
        history = self.kind(**series, **last, saved=None, grid=grid)
        if not self.chosen.size:
            return FinishedRun(history, self.chosen, None, {}, lines)
        end = history.times.size - 1  # a run that was stopped ends at none of the chosen
        chosen = np.append(self.chosen[self.chosen < end], end)
        files = blocks if end in self.chosen else [*blocks, checkpoint]
        maps = {  # read a block at a time, when they are written
            name: Stacked(
                (chosen.size, *last[name].shape),
                last[name].dtype,
                functools.partial(_parts, files, name, last[name].ndim),
            )
            for name in fields.maps
        }
        return FinishedRun(history, chosen, next(_parts(blocks, "pressure", 2))[0], maps, lines)

    def _block(self, index: int) -> Path:
        return self.folder / f"{index:06}.npz"

    def _checkpoint(self, blocks: int) -> Path:
        return self.folder / CHECKPOINTS[blocks % 2]


def _intact(path: Path) -> bool:
    """Return whether every array of a file has the check sum that it was written with."""
    try:
        with zipfile.ZipFile(path) as file:
            return file.testzip() is None
    except (OSError, zipfile.BadZipFile, zlib.error):
        return False


def _parts(files: list[Path], name: str, ndim: int) -> Iterator[np.ndarray]:
    """The maps of a block at a time; the one of the checkpoint, of ``ndim`` axes, has no axis of time."""
    for file in files:
        maps = read_npz(file, name)[name]
        yield maps[None] if maps.ndim == ndim else maps


AXES = {"x": "(nx,) cell centres [m]", "y": "(ny,) cell centres [m]"}
NOTES = {  # notes and diagnostics, stored with any result
    "notes": "warnings about the result, one per line",
    "separation_error": "relative error of the decay rates shared by all wavenumbers [1]",
    "image_error": "relative error of the response on the grid [1]",
    "single_contact": "1 if the indenter makes a single contact, 0 if it is rough",
    "widenings": "how often the grid was widened",
    "refined": "number of substeps that were chosen automatically, 0 if they were given",
    "unjudged": "1 if part of the error by the time steps has no estimate",
    "thickness_error": "relative error of the series in a thickness that varies in the plane [1]",
    "thickness_slope": "largest slope of a thickness that varies in the plane [1]",
    "narrow_growth": "largest growth of a cell above all its neighbours over the largest growth [1]",
    "relative_step_error": "error by the time steps over the largest change of the thickness [1]",
    "step_limit": "relative_step_error above which there is a note [1]",
    "stiff_film": "1 if a film whose thickness varies in the plane is stiffer than its base, 0 if not",
    "bare_from": "first time at which a part of the contact was worn to the base, inf if at none [s]",
    "bare_share": "largest share of the contact over which the base was bare [1]",
    "ball_radius": "radius of a ball or a cylinder, inf for any other indenter [m]",
    "roller_length": "length of a cylinder on the grid, inf for any other indenter [m]",
    "elongation": "cells along the longer side of the contact over cells across it, 1 of a cylinder [1]",
    "walled": "1 if the hysteresis force leaves out walls of the indenter",
    "size_error": "relative error of a size of the indenter that is rounded to whole cells [1]",
    "steep_share": "share of steps between neighbouring heights with a slope above 1 [1]",
    "coldest": "lowest temperature given for growth or heat, inf without any [K]",
}


@dataclass(frozen=True)
class Report:
    """The data that a run writes.

    result: gives its kind and its grid; arrays: those of result.npz; course: those of course.npz, empty if result.npz
    has all times; values: of the fields that summaries show, (nt,) each, or () for a single time; pictures: by file name.
    """

    result: Any
    arrays: dict[str, np.ndarray | Stacked]
    course: dict[str, np.ndarray]
    values: dict[str, np.ndarray]
    pictures: dict[str, Any]


def of_steps(run: FinishedRun, kept: str) -> Report:
    """Return the report of an experiment over time, from its finished steps."""
    values = values_of(run.history) | run.lines
    whole = arrays_of(run.history) | numbers_of(run.history) | run.lines
    course = time_series_of(whole) if kept == FEW else {}
    arrays = at_times(whole, run.chosen) | run.maps if run.maps else whole
    return Report(run.history, arrays, course, values, pictures(run))


def of_result(result: Any) -> Report:
    """Return the report of a steady state."""
    from jaxcontact.results import figures

    whole: dict[str, Any] = {**arrays_of(result), **numbers_of(result)}
    return Report(result, whole, {}, values_of(result), {"contact.png": figures.figure_of(result)})


def write_results(report: Report, directory: Path, case: Case, facts: dict[str, Any]) -> dict[str, Any]:
    """Write the arrays, the summary and the pictures of a run, and return the summary.

    facts: further entries of the summary. Each file is either complete or unchanged.
    """
    notes = storage.notes_of(report.result)
    stored = meanings(report.arrays) | {name: text for name, text in NOTES.items() if name in notes}
    described: dict[str, Any] = {"pictures": list(report.pictures), "arrays_in_result_npz": stored}
    described |= {"arrays_in_course_npz": meanings(report.course)} if report.course else {}
    figures = figures_in(report.values, hasattr(report.result, "times"))
    times = np.atleast_1d(np.asarray(getattr(report.result, "times", 0.0)))
    extent: dict[str, Any] = {
        "jaxcontact_version": __version__,
        "experiment": case.kind,
        "steps_requested_count": case.times.size,
        "steps_finished_count": times.size,
        "iterations_total_count": int(np.sum(report.result.iterations)),
        "grid_cells_count": list(report.result.grid.shape),
        "cell_size_m": [float(size) for size in report.result.grid.spacing],
    }
    if hasattr(report.result, "times"):
        extent |= {"time_start_s": float(times[0]), "time_end_s": float(times[-1])}
    summary = facts | extent | figures | described
    notes |= {"case": case_text(case)}
    write_whole(directory / "result.npz", lambda path: write_npz(path, report.arrays | notes))
    (directory / COURSE).unlink(missing_ok=True)  # of an earlier run that --force overwrites
    if report.course:
        write_whole(directory / COURSE, lambda path: write_npz(path, report.course))
    text = json.dumps(summary, indent=2, ensure_ascii=False) + "\n"
    write_whole(directory / "summary.json", lambda path: path.write_text(text, encoding="utf-8"))
    for name, figure in report.pictures.items():
        write_under(figure, caption_of(case))
        write_picture(directory / name, figure)
    return summary


def write_picture(path: Path, figure: Any) -> None:
    """Write a figure in the format given by the suffix of ``path``."""
    kind = path.suffix.removeprefix(".")
    write_whole(path, lambda partial: figure.savefig(partial, dpi=150, format=kind))


def meanings(all_arrays: Mapping[str, np.ndarray | Stacked]) -> dict[str, str]:
    """Return shape, unit and meaning of each array in a file."""
    fields = {
        name: f"({', '.join(field.dimensions_of(len(values.shape)))}) {field.meaning} [{field.symbol}]"
        for name, values in all_arrays.items()
        if (field := FIELDS.get(name))
    }
    axes = {name: text for name, text in AXES.items() if name in all_arrays}
    return axes | fields


def pictures(run: FinishedRun) -> dict[str, Any]:
    """Return the pictures of an experiment over time by file name."""
    from jaxcontact.results import figures, plotting  # matplotlib; what only checks a case starts without it

    history = run.history
    x = history.grid.axes()[0]
    times, middle = np.asarray(history.times), history.grid.shape[1] // 2
    profile = np.asarray(history.profile)[:, middle]
    map_figure = None
    if not history.grid.plane_strain:  # where a map is a line
        maps = [(history.times[-1], history.pressure)]
        if run.first_pressure is not None:
            maps.insert(0, (history.times[0], run.first_pressure))
        titles = [f"t = {float(time):g} s" for time, _ in maps]
        map_figure = plotting.maps_figure(*history.grid.axes(), [field for _, field in maps], titles)
    own = {
        "pressure_profiles.png": plotting.profiles_figure(x, run.lines["pressure_line"], times),
        "pressure_map.png": map_figure,
        "history.png": plotting.history_figure(history),
        "surface.png": plotting.surface_figure(
            x, profile, run.lines["displacement_line"], history.approach, times
        ),
        "film.png": figures.film_of(x, run.lines, times),
        "overview.png": figures.overview_of(history),
    }
    return {name: figure for name, figure in own.items() if figure is not None}
