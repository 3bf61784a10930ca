"""What a run leaves in its directory: result.npz, summary.json and the pictures."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from jaxcontact import labels, plotting
from jaxcontact._version import __version__
from jaxcontact.files import storage
from jaxcontact.files.case_file import Case
from jaxcontact.files.case_text import case_text
from jaxcontact.files.finished_steps import FinishedRun
from jaxcontact.files.npz import Stacked, write_npz, write_whole

AXES = {"x": "(nx,) cell centres [m]", "y": "(ny,) cell centres [m]"}
BESIDE = {
    "peak_pressure": "(nt,) [Pa]",
    "contact_radius": "(nt,) [m]",
    "pressure_line": "(nt, nx) pressure at the row of cells nearest to y = 0 [Pa]",
    "displacement_line": "(nt, nx) displacement of both surfaces at that row [m]",
}  # the fields of the history


def write_results(run: FinishedRun, directory: Path, case: Case, facts: dict[str, Any]) -> dict[str, Any]:
    """Write the arrays, the summary and the pictures of the finished steps; the summary.

    facts: what else the summary is to say. Each file is complete or as it was before.
    """
    figures, all_arrays = pictures(run), arrays(run)
    described = {"pictures": list(figures), "arrays_in_result_npz": meanings(all_arrays)}
    summary = facts | summarise(run, case) | described
    notes = {storage.KIND: "ContactHistory", "case": case_text(case)}
    write_whole(directory / "result.npz", lambda path: write_npz(path, all_arrays | notes))
    text = json.dumps(summary, indent=2, ensure_ascii=False) + "\n"
    write_whole(directory / "summary.json", lambda path: path.write_text(text, encoding="utf-8"))
    for name, figure in figures.items():
        write_picture(directory / name, figure)
    return summary


def write_picture(path: Path, figure: Any) -> None:
    """A figure in the format that the ending of ``path`` names."""
    kind = path.suffix.removeprefix(".")
    write_whole(path, lambda partial: figure.savefig(partial, dpi=150, format=kind))


def arrays(run: FinishedRun) -> dict[str, np.ndarray | Stacked]:
    """The fields of the history, and what ``BESIDE`` has."""
    own = {
        "peak_pressure": run.peak_pressure,
        "contact_radius": np.asarray(run.history.contact_radius),
        "pressure_line": run.pressure_line,
        "displacement_line": run.displacement_line,
    }
    return labels.arrays_of(run.history) | run.maps | own


def meanings(all_arrays: dict[str, np.ndarray | Stacked]) -> dict[str, str]:
    """Shape, unit and meaning of each array in result.npz."""
    fields = {
        name: f"({', '.join(labels.dimensions(name, len(values.shape)))}) {meaning} [{unit}]"
        for name, values in all_arrays.items()
        if name in labels.FIELDS
        for _, unit, meaning in [labels.FIELDS[name]]
    }
    return AXES | fields | BESIDE


def summarise(run: FinishedRun, case: Case) -> dict[str, Any]:
    """The figures of a run, each with its unit at the end of its key."""
    history = run.history
    ends: dict[str, Any] = {
        "approach_{}_m": history.approach,
        "load_{}_N": history.load,
        "peak_pressure_{}_Pa": run.peak_pressure,
        "contact_radius_{}_m": history.contact_radius,
        "contact_area_{}_m2": history.contact_area,
        "film_strain_{}_m_per_m": history.film_strain,
    }
    summary = _extent(run, case)
    for key, values in ends.items():
        summary[key.format("start")] = float(values[0])
        summary[key.format("end")] = float(values[-1])
    return summary


def _extent(run: FinishedRun, case: Case) -> dict[str, Any]:
    """How many steps, and on which grid."""
    history = run.history
    return {
        "jaxcontact_version": __version__,
        "steps_requested_count": case.times.size,
        "steps_finished_count": len(history.times),
        "iterations_total_count": int(np.sum(history.iterations)),
        "grid_cells_count": list(history.grid.shape),
        "cell_size_m": [float(size) for size in history.grid.spacing],
        "time_start_s": float(history.times[0]),
        "time_end_s": float(history.times[-1]),
    }


def pictures(run: FinishedRun) -> dict[str, Any]:
    """The pictures of a run, by file name."""
    history = run.history
    x, y = history.grid.axes()
    times, middle = np.asarray(history.times), history.grid.shape[1] // 2
    maps = [(times[-1], history.pressure)]
    if run.first_pressure is not None:
        maps.insert(0, (times[0], run.first_pressure))
    fields, titles = [field for _, field in maps], [f"t = {time:g} s" for time, _ in maps]
    profile = np.asarray(history.profile)[:, middle]
    return {
        "pressure_profiles.png": plotting.profiles_figure(x, run.pressure_line, times),
        "pressure_map.png": plotting.maps_figure(x, y, fields, titles),
        "history.png": plotting.history_figure(history),
        "surface.png": plotting.surface_figure(x, profile, run.displacement_line, history.approach, times),
    }
