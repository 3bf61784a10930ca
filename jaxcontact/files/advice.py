"""What is worth knowing of a case before it runs: room for it, cells across the contact, steps against relaxation."""

import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path

import jax
import numpy as np

from jaxcontact.files.case_file import Case, CaseError, layer_tables
from jaxcontact.files.case_schema import KINDS
from jaxcontact.files.footprint import disk_room, footprint_of, machine_memory
from jaxcontact.indenters.predicted_contact import predicted
from jaxcontact.indenters.shapes import Sphere
from jaxcontact.inputs.layers import checked_body, thickest
from jaxcontact.inputs.spectrum import relaxation_modes
from jaxcontact.response.body import response_of
from jaxcontact.results.notes import FEW_CELLS, STRAIN_LIMIT
from jaxcontact.verbs.experiment import Experiment

THICK = 1000.0  # thickness over the grid's width
PRESSED = ("indentation", "shear")  # experiments in which the ball stays where it is
COARSE = "cells across the first contact: below {few} it is coarse; accepted: grid.n of about {n}"


def check(case: Case, path: Path) -> None:
    """Check an experiment over time, or what steady states have in common, and the memory of this machine.

    Raises CaseError, which names the file.
    """
    try:
        if case.experiment() is None:
            Experiment.of(case.body, case.indenter, case.control, case.times, grid=case.grid, **case.options)
        _check_memory(case)
    except ValueError as error:
        raise CaseError(f"{path}: {error}") from error


def check_whole(case: Case, path: Path) -> None:
    """Everything that a run would refuse before it computes: its function is traced, which takes seconds."""
    check(case, path)
    if KINDS[case.kind].march is not None:  # which refuses no more
        return
    try:
        jax.eval_shape(case.run)
    except ValueError as error:
        raise CaseError(f"{path}: {error}") from error


def check_disk(case: Case, path: Path, directory: Path) -> None:
    """The directory's disk has room for the run, finished steps that are there included. Raises CaseError."""
    needed, has = footprint_of(case).disk, disk_room(directory)
    if needed > has:
        raise CaseError(
            f"{path}: {directory}: found a run that needs {in_bytes(needed)} on disk, accepted: up to the"
            f' {in_bytes(has)} that are free; solver.save = "last" or fewer cells need less'
        )


def _check_memory(case: Case) -> None:
    needed, has = footprint_of(case).memory, machine_memory()
    if needed > has:
        raise ValueError(
            f"grid: found a run that needs about {in_bytes(needed)} of memory, accepted: up to the {in_bytes(has)}"
            " of this machine; fewer cells, or fewer times when quasi-elastic, need less"
        )


def in_bytes(size: float) -> str:
    """A size of two digits, in MB or GB."""
    number, unit = (size / 1e6, "MB") if size < 1e8 else (size / 1e9, "GB")
    return f"{number:.2g} {unit}" if number < 100 else f"{number:.0f} {unit}"


def advice(case: Case) -> list[str]:
    """One line for each thing that may spoil the result; none for a case without fault."""
    return [*_layer_advice(case), *_strain_advice(case), *_grid_advice(case), *_time_advice(case)]


def describe_strain(case: Case) -> str:
    """The film's strain to come, in one line, or for what it is not foretold; empty without a film."""
    if response_of(checked_body(case.body)[0]).film() is None:
        return ""
    strain = foretold_strain(case)
    if strain is None:
        return f"film strain: foretold for a ball pressed on one film, not for this ({case.kind})"
    return f"film strain: about {strain:.2g} at its largest, to a factor of 1.5"


def foretold_strain(case: Case) -> float | None:
    """The film's largest strain, of a ball pressed on one film; None for all else."""
    alone = len(layer_tables(case.tables)) == 1
    if not (alone and isinstance(case.indenter, Sphere) and case.kind in PRESSED):
        return None
    return predicted(case.body, case.indenter.outline(), case.control, case.times).film_strain


def describe(case: Case) -> str:
    """The size of a case in one line."""
    nx, ny = case.grid.shape
    wide, high = (float(width) * 1e6 for width in case.grid.width)
    needed = footprint_of(case)
    steady = KINDS[case.kind].times is None
    times = "a steady state" if steady else f"{len(case.times)} times to {case.times[-1]:g} s"
    return (
        f"{times}, {nx} x {ny} cells over {wide:.4g} x {high:.4g} um,"
        f" about {in_bytes(needed.memory)} of memory, {in_bytes(needed.disk)} on disk"
    )


def _layer_advice(case: Case) -> Iterator[str]:
    """Of a layer so thick that a slip of the unit is likely: nothing below it is felt."""
    width, thickness = max(float(width) for width in case.grid.width), thickest(case.body)
    if thickness > THICK * width:
        yield (
            f"layer.thickness: found {thickness:g} m, {thickness / width:.2g} times the grid's width: a half-space"
            ' for this contact; accepted: text with its unit too, "150 nm"'
        )


def _strain_advice(case: Case) -> Iterator[str]:
    """Of a film that will be shortened by more than linear theory is made for, as a run warns too."""
    strain = foretold_strain(case)
    if strain is not None and strain > STRAIN_LIMIT:
        yield (
            f"layer: the film may be shortened by {strain:.2g} of its thickness: above {STRAIN_LIMIT} the linear theory"
            " is stretched; a lower load or approach strains it less"
        )


def _grid_advice(case: Case) -> Iterator[str]:
    """Of a ball: the contact at the first loaded time, in cells, and the largest, against the grid."""
    if not isinstance(case.indenter, Sphere):
        return
    first, largest = (
        first_radius(case),
        predicted(case.body, case.indenter.outline(), case.control, case.times).radius,
    )
    dx = max(float(spacing) for spacing in case.grid.spacing)
    width = min(float(width) for width in case.grid.width)
    if 2.0 * first / dx < FEW_CELLS:
        n = math.ceil(FEW_CELLS * width / (2.0 * first))
        yield f"grid.n: about {2.0 * first / dx:.1f} {COARSE.format(few=FEW_CELLS, n=n)} or more"
    if 2.0 * largest > width:
        yield (
            f"grid.width: the contact may grow to {2.0 * largest:.3g} m, found {width:.3g} m;"
            " accepted: a wider grid, or no width at all"
        )


def first_radius(case: Case) -> float:
    """About the contact radius [m] when the indenter first presses."""
    values = np.broadcast_to(np.asarray(case.control.value, dtype=float), case.times.shape)
    index = int(np.argmax(values > 0.0))
    control = dataclasses.replace(case.control, value=values[index])  # type: ignore[type-var]
    return case.indenter.estimated_radius(case.body, control, case.times[index : index + 1])


def fastest_time(case: Case) -> float:
    """The shortest relaxation time [s] of the material that is pressed on; inf for an elastic one."""
    spectrum = response_of(checked_body(case.body)[0]).surface().spectrum()
    rigid_at_first = float(spectrum.instantaneous) == 0.0  # Kelvin-Voigt: only its retardation is finite
    rates = np.asarray(spectrum.rates if rigid_at_first else relaxation_modes(spectrum)[0])
    return float(1.0 / np.max(rates)) if rates.size and np.max(rates) > 0.0 else math.inf


def _time_advice(case: Case) -> Iterator[str]:
    """Steps that begin within one relaxation time of the first contact, or over which the control moves."""
    fastest, steps = fastest_time(case), np.diff(case.times)
    values = np.broadcast_to(np.asarray(case.control.value, dtype=float), case.times.shape)
    matters = (case.times[:-1] - case.times[0] < fastest) | (np.diff(values) != 0.0)
    longest = float(np.max(steps[matters], initial=0.0)) / case.options.get("substeps", 1)
    if longest > fastest:
        yield (
            f"times: steps of up to {longest:.3g} s where the fastest relaxation takes {fastest:.3g} s;"
            f" accepted: shorter steps, logarithmic spacing, or solver.substeps ="
            f" {math.ceil(longest * case.options.get('substeps', 1) / fastest)} or more"
        )
