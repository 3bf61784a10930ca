"""What a run leaves in its directory: summary.json, result.npz and the pictures."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from jaxcontact import plotting
from jaxcontact._version import __version__
from jaxcontact.files import storage
from jaxcontact.files.case_file import Case
from jaxcontact.files.case_text import case_text
from jaxcontact.files.storage import write_whole
from jaxcontact.results import STATUS_MEANING, ContactHistory
from jaxcontact.simulation import Simulation

LINES = {
    "peak_pressure": "(nt,) [Pa]",
    "contact_radius": "(nt,) [m]",
    "pressure_line": "(nt, nx) pressure at the row of cells nearest to y = 0 [Pa]",
    "displacement_line": "(nt, nx) displacement of both surfaces at that row [m]",
}  # beside the fields of the history


class DirectoryTakenError(ValueError):
    """The directory holds something already; the message is one line for the user."""


def claim(directory: Path, force: bool) -> bool:
    """Make sure that results may go to ``directory``; True when it holds something already.

    Raises DirectoryTakenError when it does and ``force`` is false, and when it cannot be one.
    """
    if directory.exists() and not directory.is_dir():
        raise DirectoryTakenError(f"{directory}: found a file, accepted: a directory, new or empty")
    taken = directory.is_dir() and any(directory.iterdir())
    if taken and not force:
        raise DirectoryTakenError(f"{directory}: found a directory that is not empty; --force overwrites it")
    return taken


def write_results(run: Simulation, directory: Path, facts: dict[str, Any], case: Case) -> dict[str, Any]:
    """Write the arrays, the summary and the pictures of a run with finished steps; the summary.

    facts: what else the summary is to say. Each file is complete or as it was before.
    """
    directory.mkdir(parents=True, exist_ok=True)
    figures = pictures(run)
    summary = facts | summarise(run) | {"pictures": list(figures), "arrays_in_result_npz": meanings(run)}
    notes = {storage.KIND: "ContactHistory", "case": case_text(case)}
    write_whole(directory / "result.npz", lambda path: storage.write_npz(path, arrays(run), notes))
    text = json.dumps(summary, indent=2, ensure_ascii=False) + "\n"
    write_whole(directory / "summary.json", lambda path: path.write_text(text, encoding="utf-8"))
    for name, figure in figures.items():
        write_picture(directory / name, figure)
    return summary


def write_picture(path: Path, figure: Any) -> None:
    """A figure in the format that the ending of ``path`` names."""
    kind = path.suffix.removeprefix(".")
    write_whole(path, lambda partial: figure.savefig(partial, dpi=150, format=kind))


def arrays(run: Simulation) -> dict[str, np.ndarray]:
    """The fields of the history, and what ``LINES`` has beside them."""
    assert run.history is not None
    own = {
        "peak_pressure": run.peak_pressure,
        "contact_radius": np.asarray(run.history.contact_radius),
        "pressure_line": run.pressure_line,
        "displacement_line": run.displacement_line,
    }
    return storage.arrays_of(run.history) | own


def meanings(run: Simulation) -> dict[str, str]:
    """Shape, unit and meaning of each array in result.npz."""
    axes = {"x": "(nx,) cell centres [m]", "y": "(ny,) cell centres [m]"}
    fields = {
        name: f"({', '.join(storage.dimensions(name, values.ndim))}) {meaning} [{unit}]"
        for name, values in arrays(run).items()
        if name in storage.FIELDS
        for _, unit, meaning in [storage.FIELDS[name]]
    }
    return axes | fields | LINES


def summarise(run: Simulation) -> dict[str, Any]:
    """The figures of a run, each with its unit at the end of its key."""
    history = run.history
    assert history is not None
    ends: dict[str, Any] = {
        "approach_{}_m": history.approach,
        "load_{}_N": history.load,
        "peak_pressure_{}_Pa": run.peak_pressure,
        "contact_radius_{}_m": history.contact_radius,
        "contact_area_{}_m2": history.contact_area,
        "film_strain_{}_m_per_m": history.film_strain,
    }
    summary = _state(run, history)
    for key, values in ends.items():
        summary[key.format("start")] = float(values[0])
        summary[key.format("end")] = float(values[-1])
    return summary


def _state(run: Simulation, history: ContactHistory) -> dict[str, Any]:
    """How the run ended and on which grid."""
    dx, dy = (float(value) for value in history.grid.spacing)
    return {
        "jaxcontact_version": __version__,
        "status": run.status,
        "status_meaning": STATUS_MEANING[run.status],
        "interrupted": run.interrupted,
        "steps_requested_count": run.requested,
        "steps_finished_count": len(history.times),
        "iterations_total_count": int(np.sum(history.iterations)),
        "grid_cells_count": list(history.grid.shape),
        "cell_size_m": [dx, dy],
        "time_start_s": float(history.times[0]),
        "time_end_s": float(history.times[-1]),
    }


def pictures(run: Simulation) -> dict[str, Any]:
    """The pictures of a run, by file name."""
    history = run.history
    assert history is not None
    x, y = history.grid.axes()
    times, middle = np.asarray(history.times), history.grid.shape[1] // 2
    profile = np.asarray(history.profile)[:, middle]
    fields = [history.pressure] if history.pressure.ndim == 2 else [history.pressure[0], history.pressure[-1]]
    titles = [f"t = {t:g} s" for t in (times[0], times[-1])][-len(fields) :]
    return {
        "pressure_profiles.png": plotting.profiles_figure(x, run.pressure_line, times),
        "pressure_map.png": plotting.maps_figure(x, y, fields, titles),
        "history.png": plotting.history_figure(history),
        "surface.png": plotting.surface_figure(x, profile, run.displacement_line, history.approach, times),
    }
