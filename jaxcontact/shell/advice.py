"""Checks of a case before it runs: memory and disk space, cells across the contact, time steps against relaxation times."""

import dataclasses
import math
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jax import Array

from jaxcontact._support.fields import FIELDS, VECTOR, stored_fields
from jaxcontact._support.files import UNFINISHED
from jaxcontact._support.prefixes import told_apart
from jaxcontact._support.pytree import replace
from jaxcontact.bodies.body import LayeredHalfSpace, checked_body, thickest
from jaxcontact.bodies.controls import Load
from jaxcontact.bodies.materials import Spectrum, relaxation_modes
from jaxcontact.history.time_loop import FAINT
from jaxcontact.indenters.predicted_contact import predicted, softening
from jaxcontact.indenters.shapes import HeightField, Sphere
from jaxcontact.response.stack import (
    long_wave_compliance,
    short_wave_compliance,
    solids,
    surface_creep,
    surface_material,
    top_layer,
)
from jaxcontact.results.notes import DEEP, FEW_CELLS, FEW_COHESIVE, STEP_ERROR, STRAIN_LIMIT
from jaxcontact.shell.case_file import Case, CaseError, tables_named
from jaxcontact.shell.case_schema import FEW, KINDS, chosen, maps_of
from jaxcontact.shell.finished_steps import StoredFields
from jaxcontact.simulate.run import BLOCK, Experiment, first_block

# Checks of a case with adhesion before it runs: the Tabor number, and the cells across the contact and its edge.
#
# The contact of a ball is estimated by the theory of Johnson, Kendall and Roberts (K. L. Johnson, Contact Mechanics,
# 1985, section 5.5) on two half-spaces, of the substrate and of the material at the surface, at the first and at the
# last time.


LONG, SHORT = long_wave_compliance, short_wave_compliance
COARSE = "cells across the {which} contact: fewer than {few} are too coarse; accepted: grid.n of about {n}"
WIDER = "grid.width: the contact may grow to {contact:.3g} m, found {width:.3g} m; accepted: a wider grid"


def describe_adhesion(case: Case) -> str:
    """Return the Tabor number of a ball at the first and the last time in one line; empty without adhesion or a ball."""
    law = case.motion.get("adhesion")
    if law is None or not isinstance(case.indenter, Sphere):
        return ""
    numbers = [float(law.tabor_number(case.indenter.radius, 2.0 / c)) for c in _compliances(case, SHORT)]
    at_once, at_last = (f"{number:.2g}" for number in numbers)
    values = (
        at_once
        if at_once == at_last
        else f"{at_once} at first, {at_last} with the compliance at the last time"
    )
    return f"Tabor number of the surface: {values} (short range above 5, long range below 0.1)"


def adhesion_advice(case: Case) -> Iterator[str]:
    """Warn of a grid too coarse for the attraction at the edge, or for the contact of a ball, or too narrow for it."""
    law, dx = case.motion["adhesion"], max(float(spacing) for spacing in case.grid.spacing)
    modulus = 2.0 / max(max(_compliances(case, SHORT)), 1e-300)
    cells = float(law.zone_length(modulus)) / dx
    if cells < FEW_COHESIVE:
        n = math.ceil(max(case.grid.shape) * FEW_COHESIVE / cells)
        yield (
            f"grid.n: about {told_apart(cells, FEW_COHESIVE)}"
            f" cells across the zone of attraction at the edge of contact: below"
            f" {FEW_COHESIVE} pull-off depends on the grid; accepted: grid.n of about {n} or more, or a longer range"
        )
    if not isinstance(case.indenter, Sphere):
        return
    width = min(float(width) for width in case.grid.width)
    largest = 2.0 * max(_radius(case, c) for side in (LONG, SHORT) for c in _compliances(case, side))
    if largest / dx < FEW_CELLS:
        n = math.ceil(FEW_CELLS * width / largest) if largest > 0.0 else max(case.grid.shape)
        cells = math.floor(10.0 * largest / dx) / 10.0
        yield f"grid.n: about {cells:.1f} {COARSE.format(which='largest', few=FEW_CELLS, n=n)} or more"
    if largest > width:
        yield WIDER.format(contact=largest, width=width)


def _compliances(case: Case, side: Callable[[LayeredHalfSpace, float], Array]) -> list[float]:
    """Return (1 - nu) J [1/Pa] of the substrate (``LONG``) or the surface (``SHORT``), with the ball's, first and last."""
    body, own = checked_body(case.body)[0], float(case.indenter.compliance())
    return [float(side(body, t)) + own for t in (0.0, float(case.times[-1] - case.times[0]))]


def _radius(case: Case, compliance: float) -> float:
    """Return the radius [m] of a ball's contact with a half-space under the largest load or approach; 0 without contact."""
    work, R = float(case.motion["adhesion"].work), float(case.indenter.radius)  # type: ignore[attr-defined]
    value, modulus = float(np.max(np.asarray(case.control.value))), 2.0 / max(compliance, 1e-300)
    if isinstance(case.control, Load):
        pull = 3.0 * math.pi * work * R
        if value < -pull / 2.0:
            return 0.0
        apparent = value + pull + math.sqrt(max(2.0 * pull * value + pull**2, 0.0))
        return (0.75 * R * apparent / modulus) ** (1.0 / 3.0)
    neck = 2.0 * math.pi * work / modulus
    least = (R * math.sqrt(neck) / 4.0) ** (2.0 / 3.0)  # of the lowest approach
    approach = lambda a: a**2 / R - math.sqrt(neck * a)
    if value < approach(least):
        return 0.0
    from scipy.optimize import brentq  # takes a third of a second to import

    high = 4.0 * (least + math.sqrt(R * abs(value)))
    return float(brentq(lambda a: approach(a) - value, least, high))


# The memory and disk space that a run needs, computed beforehand, and what the machine has.
#
# Memory: the process with its compiler; the kernels, the state and the fields of a block of steps, whose shapes
# jax gives without computing; and the work arrays of the compiled programs, in units of the kernels. The finished
# steps are on disk: once in blocks, together with the state after the last block and the one before, and at
# the end a second time as one file.


# measured with jax 0.10.1 on a CPU: resident memory, and the work arrays reported by the compiler
PROCESS = 0.6e9  # bytes
# bytes for each byte of the tables of the direct superposition, while they are computed
SUPERPOSITION = 210.0
HEADERS = 4.3e3  # bytes of the names and shapes of arrays in a file


@dataclass(frozen=True)
class Footprint:
    """The peak requirements of a run, in bytes.

    memory: within a factor of 1.5 of measured values; disk: just before the run ends.
    """

    memory: float
    disk: float


def footprint_of(case: Case) -> Footprint:
    """Return the requirements of a run of the case."""
    experiment = case.experiment()
    if experiment is None:  # a steady state: the work arrays of one program and the fields of its result
        field, count = 8.0 * case.grid.shape[0] * case.grid.shape[1], maps_of(stored_fields(case.result), 1)
        memory = PROCESS + (KINDS[case.kind].memory + 3.0 * count) * field
        return Footprint(memory, count * field + 8.0 * 20 + HEADERS)
    # a run in blocks of steps
    plan, *block = jax.eval_shape(first_block, experiment)
    kernels, steps, carry, outcomes = (_bytes(tree) for tree in (plan.stepper, plan.steps, *block))
    work = KINDS[case.kind].memory * kernels
    if experiment.correspondence == "quasi-elastic":
        work = max(work, SUPERPOSITION * steps)
    (nx, ny), stored = case.grid.shape, StoredFields.of(case.result)
    kept = chosen(case.kept, case.times.size).size
    numbers = sum(1 + (FIELDS[name].dimensions == VECTOR) for name in stored.series)
    each, whole = _bytes(block[1].fields) / BLOCK, 8.0 * nx * ny * len(stored.whole)
    line = 8.0 * (2 * nx + numbers + 3)  # with radius, peak and verdict
    maps, lines = each * kept, line * case.times.size
    memory = PROCESS + kernels + steps + 2.0 * (carry + outcomes) + work + 3.0 * lines
    headers = HEADERS * (case.times.size / BLOCK + 3.0)
    duplicates = line * kept if case.kept == FEW else 0.0  # in result.npz and in course.npz
    disk = (
        2.0 * (maps + lines)
        + duplicates
        + 2.0 * carry
        + 3.0 * whole
        + (2.0 if kept else 3.0) * each
        + headers
    )
    return Footprint(memory, disk)


def machine_memory() -> float:
    """Return the bytes of memory of the machine or of the container; inf if the system does not report them."""
    if not hasattr(os, "sysconf") or "SC_PHYS_PAGES" not in os.sysconf_names:
        return math.inf
    return min(float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")), container_memory())


def container_memory(groups: Path = Path("/sys/fs/cgroup"), own: Path = Path("/proc/self/cgroup")) -> float:
    """Return the smallest limit of this process's control group (version 2) and those above it."""
    try:
        path = next(line[4:] for line in own.read_text().splitlines() if line.startswith("0::/"))
    except (OSError, StopIteration):
        return math.inf
    files = [groups / part / "memory.max" for part in (Path(path), *Path(path).parents)]
    limits = [file.read_text().strip() for file in files if file.is_file()]
    return min((float(limit) for limit in limits if limit != "max"), default=math.inf)


def _bytes(tree: Any) -> float:
    return sum(math.prod(leaf.shape) * leaf.dtype.itemsize for leaf in jax.tree.leaves(tree))


THICK = 1000.0  # thickness over the grid's width
SPRINGS, FINER = 48, 24  # of the bed for the error of the time steps, and parts of a step in its reference
RELAXED = 1e30  # s: longer than any relaxation time


def check(case: Case, path: Path) -> None:
    """Check an experiment over time, or what steady states have in common, and the memory needed.

    Raises CaseError, which names the file.
    """
    try:
        if case.experiment() is None:
            Experiment.of(**case.arguments())
        needed, has = footprint_of(case).memory, machine_memory()
        if needed > has:
            raise ValueError(
                f"grid: found a run that needs about {in_bytes(needed)} of memory, accepted: up to the {in_bytes(has)}"
                " of this machine; fewer cells (or fewer times, if quasi-elastic) need less"
            )
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
    there = next(path for path in (directory, *directory.absolute().parents) if path.exists())
    own = sum(path.stat().st_size for path in (directory / UNFINISHED).glob("*"))
    needed, has = footprint_of(case).disk, float(shutil.disk_usage(there).free + own)
    if needed > has:
        raise CaseError(
            f"{path}: {directory}: found a run that needs {in_bytes(needed)} on disk, accepted: up to the"
            f' {in_bytes(has)} of free space; solver.save = "last" or fewer cells need less'
        )


def in_bytes(size: float) -> str:
    """Return a size as text with two digits, in MB or GB."""
    number, unit = (size / 1e6, "MB") if size < 1e8 else (size / 1e9, "GB")
    return f"{number:.2g} {unit}" if number < 100 else f"{number:.0f} {unit}"


def advice(case: Case) -> list[str]:
    """Return one line for each likely fault of the result; an empty list if there is none."""
    found = []
    # a layer so thick that an error of the unit is likely: the substrate below it has no effect
    width, thickness = max(float(width) for width in case.grid.width), thickest(case.body)
    if thickness > THICK * width:
        found.append(
            f"layer.thickness: found {thickness:g} m, {thickness / width:.2g} times the grid's width: a half-space"
            ' for this contact; accepted: text with its unit too, "150 nm"'
        )
    # a film strain beyond the range of linear theory, of which a run warns too
    strain = estimated_strain(case)
    if strain is not None and strain > STRAIN_LIMIT:
        found.append(
            f"layer: the film may be shortened by {told_apart(strain, STRAIN_LIMIT)}"
            f" of its thickness: above {STRAIN_LIMIT} linear theory"
            " is inaccurate; a lower load or approach reduces the strain"
        )
    contact = adhesion_advice if "adhesion" in case.motion else _grid_advice
    return [*found, *contact(case), *_time_advice(case)]


def describe_strain(case: Case) -> str:
    """Return the estimated film strain in one line, or that there is no estimate; an empty string without a film."""
    if top_layer(checked_body(case.body_for_estimates)[0]) is None:
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
    spectrum = surface_material(checked_body(case.body_for_estimates)[0]).spectrum()
    # its retardation times are finite, but not its relaxation times
    kelvin_voigt = float(spectrum.instantaneous) == 0.0
    rates = np.asarray(spectrum.rates if kelvin_voigt else relaxation_modes(spectrum)[0])
    return float(1.0 / np.max(rates)) if rates.size and np.max(rates) > 0.0 else math.inf


def _time_advice(case: Case) -> Iterator[str]:
    """Warn of an error of more than 1 % by the steps in time, as it is foretold for a bed of springs."""
    given, times = case.options.get("substeps", 1), np.asarray(case.times, float)
    if KINDS[case.kind].times is None or times.size < 2:
        return
    # the topmost solid that creeps from a compliance above zero: steps can be judged by it alone
    for solid in solids(checked_body(case.body_for_estimates)[0]):
        creep = surface_creep(solid)
        flows = creep.fluidity is not None and float(creep.fluidity) > 0.0
        grows = flows or bool(np.any(np.asarray(creep.amplitudes) > 0.0))
        if float(creep.instantaneous) > 0.0 and grows:
            break
    else:
        return
    # In series with all that is elastic under the contact, the indenter included: its creep then grows at first as the
    # compliance of all does. That of the material by itself for a rough indenter.
    radius = 0.0 if isinstance(case.indenter, HeightField) else _predicted_radius(case, times)
    if radius > 0.0:
        fastest = float(np.max(creep.rates, initial=0.0))
        soon = 0.1 / fastest if fastest > 0.0 else 1e-2 * float(times[-1] - times[0])
        alone = float(creep.creep(soon)) / float(creep.instantaneous) - 1.0
        outline = case.indenter.outline()
        part = softening(case.body_for_estimates, outline, radius, soon) / alone if alone > 0.0 else 1.0
        creep = replace(creep, instantaneous=creep.instantaneous / max(part, 1e-9))
    values = np.broadcast_to(np.asarray(case.control.value, float), times.shape)
    error = lambda substeps: foretold_step_error(
        creep, times, values, isinstance(case.control, Load), substeps
    )
    found = error(given)
    if found <= STEP_ERROR:
        return
    share = f"{100.0 * found:.0f}" if found >= 0.1 else f"{100.0 * found:.2g}"
    needed = next((n for n in (2, 4, 8, 16, 32, 64) if n > given and error(n) <= STEP_ERROR), None)
    remedy = "" if needed is None else f", or solver.substeps = {needed} or more"
    yield (
        f"times: steps of up to {np.max(np.diff(times)) / given:.3g} s may cause an error of the pressure of about"
        f" {share} % (shortest relaxation time {fastest_time(case):.3g} s); accepted: shorter steps, logarithmic"
        f" spacing{remedy}"
    )


def foretold_step_error(
    creep: Spectrum, times: np.ndarray, values: np.ndarray, load_controlled: bool, substeps: int = 1
) -> float:
    """Return the largest relative error of load or peak pressure by steps in which the pressure is linear, for a paraboloid
    on a bed of springs that creep alike.

    The bed has ``SPRINGS`` springs in contact at most; the same steps, each divided in ``FINER`` parts that are shortest
    at its start, are the reference. Contacts of a half-space relax alike at all places, and thin films are such beds.
    """
    rates, shares = np.asarray(creep.rates), np.asarray(creep.rates * creep.amplitudes)
    if creep.fluidity is not None:
        rates, shares = np.append(rates, 0.0), np.append(shares, float(creep.fluidity))
    shares = shares / float(creep.instantaneous)
    heights = np.arange(SPRINGS) + 0.5
    if load_controlled:
        softer = float(creep.creep(times[-1] - times[0])) / float(creep.instantaneous)
        unit = np.max(values) * softer / (SPRINGS**2 / 2.0)
    else:
        unit = np.max(values) / SPRINGS
    if not unit > 0.0:
        return 0.0
    even = np.arange(1, substeps + 1) / substeps
    graded = (np.arange(1, FINER + 1) / FINER) ** 2
    fine = ((np.arange(substeps)[:, None] + graded) / substeps).ravel()
    coarse, exact = (
        _on_springs(rates, shares, heights, times, values / unit, load_controlled, s) for s in (even, fine)
    )
    errors = []
    for a, b in ((coarse.max(1), exact.max(1)), (coarse.sum(1), exact.sum(1))):  # peaks and loads
        errors.append(np.max(np.abs(a - b) / np.maximum(b, FAINT * np.max(b)), initial=0.0))
    return float(max(errors))


def _on_springs(
    rates: np.ndarray,
    shares: np.ndarray,
    heights: np.ndarray,
    times: np.ndarray,
    values: np.ndarray,
    load_controlled: bool,
    parts: np.ndarray,
) -> np.ndarray:
    """Return the pressures of the springs at the times, (nt, n); parts: ends of the inner steps, in parts of a step."""
    pressure, eta, found = np.zeros_like(heights), np.zeros((rates.size, heights.size)), []
    for row, value in enumerate(values):
        before, start = (values[row - 1], times[row - 1]) if row else (value, times[0])
        last = 0.0
        for part in parts if row else parts[-1:]:
            dt = (times[row] - start) * (part - last)
            z = np.maximum(rates * dt, 1e-6)  # below it the quotients are those of zero to six digits
            decay = np.exp(-z)
            mean = -np.expm1(-z) / z
            old, new = (mean - decay) / z, (1.0 - mean) / z
            small = z < 1e-3
            old, new = np.where(small, 0.5 - z / 3.0, old), np.where(small, 0.5 - z / 6.0, new)
            eta = decay[:, None] * eta + dt * old[:, None] * pressure
            compliance, gap = 1.0 + dt * shares @ new, heights + shares @ eta
            target = before + (value - before) * part
            approach = target
            if load_controlled:  # at which the overlaps with the first 1, 2, ... springs sum to the load
                overlaps = np.cumsum(np.sort(gap)) + compliance * target
                approach = np.min(overlaps / np.arange(1, gap.size + 1))
            pressure = np.maximum(approach - gap, 0.0) / compliance
            eta = eta + dt * new[:, None] * pressure
            last = part
        found.append(pressure)
    return np.array(found)
