"""What a run leaves in its directory: summary.json, result.npz and the pictures."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

import jaxcontact
from jaxcontact import plotting
from jaxcontact.results import STATUS_MEANING, ContactHistory
from jaxcontact.simulation import Simulation

ARRAYS = {
    "times": "(nt,) [s]",
    "x": "(nx,) cell centres [m]",
    "y": "(ny,) cell centres [m]",
    "approach": "(nt,) [m]",
    "load": "(nt,) [N]",
    "contact_area": "(nt,) count of cells [m^2]",
    "contact_radius": "(nt,) [m]",
    "smooth_area": "(nt,) [m^2]",
    "peak_pressure": "(nt,) [Pa]",
    "film_strain": "(nt,) shortening over thickness",
    "iterations": "(nt,)",
    "error": "(nt,) without unit",
    "profile": "(nx, ny) gap at first touch [m]",
    "pressure_line": "(nt, nx) pressure at the row of cells nearest to y = 0 [Pa]",
    "displacement_line": "(nt, nx) displacement of both surfaces at that row [m]",
    "pressure": "(nt, nx, ny), or (nx, ny) of the last time [Pa]",
    "displacement": "(nt, nx, ny), or (nx, ny) of the last time, of both surfaces [m]",
}


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


def save(run: Simulation, directory: Path, facts: dict[str, Any]) -> dict[str, Any]:
    """Write the arrays, the summary and the pictures of a run with finished steps; the summary.

    facts: what else the summary is to say. Each file is complete or as it was before.
    """
    directory.mkdir(parents=True, exist_ok=True)
    summary = facts | summarise(run)
    history = run.history
    assert history is not None
    _write(directory / "result.npz", lambda path: _write_arrays(path, arrays(run)))
    text = json.dumps(summary, indent=2, ensure_ascii=False) + "\n"
    _write(directory / "summary.json", lambda path: path.write_text(text, encoding="utf-8"))
    for name, figure in pictures(run).items():
        _write(directory / name, lambda path, figure=figure: figure.savefig(path, dpi=150, format="png"))
    return summary


def _write(path: Path, write: Any) -> None:
    """Write beside, then rename: a reader never meets half a file."""
    partial = path.with_name(path.name + ".part")
    write(partial)
    os.replace(partial, path)


def _write_arrays(path: Path, values: dict[str, np.ndarray]) -> None:
    with path.open("wb") as file:
        np.savez(file, **values)  # type: ignore[arg-type]


def arrays(run: Simulation) -> dict[str, np.ndarray]:
    """The arrays of ``ARRAYS``, by name."""
    history = run.history
    assert history is not None
    x, y = history.grid.axes()
    own = {
        "x": x,
        "y": y,
        "peak_pressure": run.peak_pressure,
        "pressure_line": run.pressure_line,
        "displacement_line": run.displacement_line,
    }
    return {name: np.asarray(own[name] if name in own else getattr(history, name)) for name in ARRAYS}


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
    return summary | {"arrays_in_result_npz": ARRAYS}


def _state(run: Simulation, history: ContactHistory) -> dict[str, Any]:
    """How the run ended and on which grid."""
    dx, dy = (float(value) for value in history.grid.spacing)
    return {
        "jaxcontact_version": jaxcontact.__version__,
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
