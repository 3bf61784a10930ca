"""The files that a run writes to its directory: result.npz, course.npz, summary.json and the pictures."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jaxcontact._support.fields import FIELDS
from jaxcontact._support.files import Stacked, write_npz, write_whole
from jaxcontact._support.version import __version__
from jaxcontact.results import figures, labels, plotting, storage
from jaxcontact.results.summaries import figures_in, values_of
from jaxcontact.shell.case_file import Case, caption_of, case_text, write_under
from jaxcontact.shell.case_keys import COURSE, FEW, at_times, time_series_of
from jaxcontact.shell.finished_steps import FinishedRun

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
    whole = labels.arrays_of(run.history) | labels.numbers_of(run.history) | run.lines
    course = time_series_of(whole) if kept == FEW else {}
    arrays = at_times(whole, run.chosen) | run.maps if run.maps else whole
    return Report(run.history, arrays, course, values, pictures(run))


def of_result(result: Any) -> Report:
    """Return the report of a steady state."""
    whole: dict[str, Any] = {**labels.arrays_of(result), **labels.numbers_of(result)}
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
