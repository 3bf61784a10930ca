"""Checks of a case before it runs: memory and disk space, cells across the contact, time steps against relaxation times."""

import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path

import jax
import numpy as np

from jaxcontact._support.prefixes import told_apart
from jaxcontact.files.adhesion_advice import COARSE, WIDER, adhesion_advice
from jaxcontact.files.case_file import Case
from jaxcontact.files.case_schema import KINDS
from jaxcontact.files.case_tables import CaseError, tables_named
from jaxcontact.files.footprint import disk_room, footprint_of, machine_memory
from jaxcontact.indenters.predicted_contact import predicted
from jaxcontact.indenters.shapes import Sphere
from jaxcontact.inputs.layers import checked_body, thickest
from jaxcontact.inputs.spectrum import relaxation_modes
from jaxcontact.response.limits import limits_of
from jaxcontact.results.notes import DEEP, FEW_CELLS, STRAIN_LIMIT
from jaxcontact.verbs.experiment import Experiment

THICK = 1000.0  # thickness over the grid's width
RELAXED = 1e30  # s: longer than any relaxation time


def check(case: Case, path: Path) -> None:
    """Check an experiment over time, or what steady states have in common, and the memory needed.

    Raises CaseError, which names the file.
    """
    try:
        if case.experiment() is None:
            setup, settings, _ = case.arguments()
            Experiment.of(setup, settings)
        _check_memory(case)
    except ValueError as error:
        raise CaseError(f"{path}: {error}") from error


def check_completely(case: Case, path: Path) -> None:
    """Check everything that a run would reject before it computes, by tracing its function, which takes seconds."""
    check(case, path)
    if KINDS[case.kind].march is not None:  # ``check`` is complete for it
        return
    try:
        jax.eval_shape(case.run)
    except ValueError as error:
        raise CaseError(f"{path}: {error}") from error


def check_disk(case: Case, path: Path, directory: Path) -> None:
    """Check that the disk has room for the run, counting finished steps already in the directory. Raises CaseError."""
    needed, has = footprint_of(case).disk, disk_room(directory)
    if needed > has:
        raise CaseError(
            f"{path}: {directory}: found a run that needs {in_bytes(needed)} on disk, accepted: up to the"
            f' {in_bytes(has)} of free space; solver.save = "last" or fewer cells need less'
        )


def _check_memory(case: Case) -> None:
    needed, has = footprint_of(case).memory, machine_memory()
    if needed > has:
        raise ValueError(
            f"grid: found a run that needs about {in_bytes(needed)} of memory, accepted: up to the {in_bytes(has)}"
            " of this machine; fewer cells (or fewer times, if quasi-elastic) need less"
        )


def in_bytes(size: float) -> str:
    """Return a size as text with two digits, in MB or GB."""
    number, unit = (size / 1e6, "MB") if size < 1e8 else (size / 1e9, "GB")
    return f"{number:.2g} {unit}" if number < 100 else f"{number:.0f} {unit}"


def advice(case: Case) -> list[str]:
    """Return one line for each likely fault of the result; an empty list if there is none."""
    contact = adhesion_advice if "adhesion" in case.motion else _grid_advice
    return [*_layer_advice(case), *_strain_advice(case), *contact(case), *_time_advice(case)]


def describe_strain(case: Case) -> str:
    """Return the estimated film strain in one line, or that there is no estimate; an empty string without a film."""
    if limits_of(checked_body(case.body_for_estimates)[0]).film is None:
        return ""
    strain = estimated_strain(case)
    if strain is None:
        kind = f"{case.kind} with adhesion" if "adhesion" in case.motion else case.kind
        return f"film strain: estimated only for a ball pressed on a single film, not for this case ({kind})"
    return f"film strain: about {told_apart(strain, STRAIN_LIMIT)} at its largest, within a factor of 1.5"


def estimated_strain(case: Case) -> float | None:
    """Return the estimated largest film strain for a ball pressed on a single film without adhesion; None otherwise."""
    single_film = len(tables_named("layer", case.tables)) == 1 and "adhesion" not in case.motion
    if not (single_film and isinstance(case.indenter, Sphere) and KINDS[case.kind].stationary):
        return None
    return predicted(case.body_for_estimates, case.indenter.outline(), case.control, case.times).film_strain


def describe(case: Case) -> str:
    """Return the size of a case in one line."""
    nx, ny = case.grid.shape
    width_x, width_y = (float(width) * 1e6 for width in case.grid.width)
    needed = footprint_of(case)
    steady = KINDS[case.kind].times is None
    times = "a steady state" if steady else f"{len(case.times)} times to {case.times[-1]:g} s"
    return (
        f"{times}, {nx} x {ny} cells over {width_x:.4g} x {width_y:.4g} um,"
        f" about {in_bytes(needed.memory)} of memory, {in_bytes(needed.disk)} on disk"
    )


def _layer_advice(case: Case) -> Iterator[str]:
    """Warn of a layer so thick that an error of the unit is likely: the substrate below it has no effect."""
    width, thickness = max(float(width) for width in case.grid.width), thickest(case.body)
    if thickness > THICK * width:
        yield (
            f"layer.thickness: found {thickness:g} m, {thickness / width:.2g} times the grid's width: a half-space"
            ' for this contact; accepted: text with its unit too, "150 nm"'
        )


def _strain_advice(case: Case) -> Iterator[str]:
    """Warn of a film strain beyond the range of linear theory, as a run does too."""
    strain = estimated_strain(case)
    if strain is not None and strain > STRAIN_LIMIT:
        yield (
            f"layer: the film may be shortened by {told_apart(strain, STRAIN_LIMIT)}"
            f" of its thickness: above {STRAIN_LIMIT} linear theory"
            " is inaccurate; a lower load or approach reduces the strain"
        )


def _grid_advice(case: Case) -> Iterator[str]:
    """Warn of a ball's contact that is too coarse at the first loaded time, or wider than the grid at its largest."""
    if not isinstance(case.indenter, Sphere):
        return
    first, largest = (
        first_radius(case),
        _predicted_radius(case, times_for_estimates(case)),
    )
    dx = max(float(spacing) for spacing in case.grid.spacing)
    width = min(float(width) for width in case.grid.width)
    if 2.0 * first / dx < FEW_CELLS:
        n = math.ceil(FEW_CELLS * width / (2.0 * first))
        cells = math.floor(20.0 * first / dx) / 10.0  # so that what is shown is below the limit as well
        yield f"grid.n: about {cells:.1f} {COARSE.format(which='first', few=FEW_CELLS, n=n)} or more"
    if 2.0 * largest > width:
        yield (
            WIDER.format(contact=2.0 * largest, width=width)
            + ", or no width, so that it is chosen automatically"
        )
    share = largest / float(case.indenter.radius)
    if share > DEEP:
        yield (
            f"indenter.radius: the contact radius may reach {told_apart(share, DEEP)}"
            " of the ball's radius: above a third a paraboloid,"
            " which stands for the ball, is inaccurate"
        )


def _predicted_radius(case: Case, times: np.ndarray) -> float:
    return predicted(case.body_for_estimates, case.indenter.outline(), case.control, times).radius


def times_for_estimates(case: Case) -> np.ndarray:
    """Return the times [s] between which the body relaxes: those of the case or, in a steady state, of a crossing.

    A material point is loaded for the time in which the contact moves by its own diameter, which is estimated from the
    contact on the body at once and, with that time, again.
    """
    if KINDS[case.kind].times is not None:
        return case.times
    speed = float(np.linalg.norm(np.atleast_1d(np.asarray(case.motion["velocity"], dtype=float))))
    if speed == 0.0:
        return np.array([0.0, RELAXED])
    times = np.zeros(1)
    for _ in range(2):
        times = np.array([0.0, 2.0 * _predicted_radius(case, times) / speed])
    return times


def first_radius(case: Case) -> float:
    """Return the estimated contact radius [m] at the first loaded time."""
    if KINDS[case.kind].times is None:
        return _predicted_radius(case, times_for_estimates(case))
    values = np.broadcast_to(np.asarray(case.control.value, dtype=float), case.times.shape)
    index = int(np.argmax(values > 0.0))
    control = dataclasses.replace(case.control, value=values[index])  # type: ignore[type-var]
    return case.indenter.estimated_radius(case.body_for_estimates, control, case.times[index : index + 1])


def fastest_time(case: Case) -> float:
    """Return the shortest relaxation time [s] of the material at the surface; inf for an elastic one."""
    spectrum = limits_of(checked_body(case.body_for_estimates)[0]).surface.spectrum()
    kelvin_voigt = (
        float(spectrum.instantaneous) == 0.0
    )  # its retardation times are finite, but not its relaxation times
    rates = np.asarray(spectrum.rates if kelvin_voigt else relaxation_modes(spectrum)[0])
    return float(1.0 / np.max(rates)) if rates.size and np.max(rates) > 0.0 else math.inf


def _time_advice(case: Case) -> Iterator[str]:
    """Warn of steps longer than the shortest relaxation time just after first contact, or while the control changes."""
    fastest, steps = fastest_time(case), np.diff(case.times)
    values = np.broadcast_to(np.asarray(case.control.value, dtype=float), case.times.shape)
    matters = (case.times[:-1] - case.times[0] < fastest) | (np.diff(values) != 0.0)
    longest = float(np.max(steps[matters], initial=0.0)) / case.options.get("substeps", 1)
    if longest > fastest:
        yield (
            f"times: steps of up to {longest:.3g} s where the shortest relaxation time is {fastest:.3g} s;"
            f" accepted: shorter steps, logarithmic spacing, or solver.substeps ="
            f" {math.ceil(longest * case.options.get('substeps', 1) / fastest)} or more"
        )
