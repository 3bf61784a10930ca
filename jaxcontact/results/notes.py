"""Notes on a result, as text: warnings about its accuracy and validity.

The compiled core stores only numbers (the fields of a result and its ``Diagnostics``), which pass through jit, vmap, grad
and ``lax.map`` like any others. The words are formed from them when ``result.notes`` is read, so that a result computed
inside a transformation has the same notes as one of a plain call, which issues them as warnings.
"""

import math
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxcontact._support.prefixes import told_apart
from jaxcontact._support.pytree import is_concrete, pytree
from jaxcontact._support.status import Status

STRAIN_LIMIT = 0.2
SEPARATION_LIMIT = 1e-3
IMAGE_LIMIT = 1e-4
FEW_CELLS = 10
SERIES_LIMIT = 1e-3
STEP_ERROR = 1e-2  # of the pressure: its error by the time steps
STEPS = 0.1  # of the largest change of the thickness: its error by the time steps
NARROW = 0.3  # of the growth that a cell may have above all its neighbours
STEEP, STEEP_STIFF = 0.2, 0.1  # slopes of a film's thickness, of one softer and of one stiffer than its base
STEEPEST = (
    0.5  # share of the steps between heights with a slope above 1: those of a punch with walls are fewer
)
COLD = 200.0  # K, below which a temperature was probably given in degrees Celsius
FEW_COHESIVE = 3  # cells across the zone of attraction
DEEP = 1.0 / 3.0  # contact radius over the radius of a ball, which is computed as a paraboloid
ROUNDED = 0.02  # of a size of the indenter: its error by whole cells
TRAPPING = 0.18  # at a compliance of a cell x strength^2/work of 5


class Note(str):
    """The text of a note.

    kind: the words common to all notes on the same matter; severity: a number that is largest for the worst note.
    """

    kind: str
    severity: float

    def __new__(cls, text: str, kind: str, severity: float = 0.0) -> "Note":
        note = super().__new__(cls, text)
        note.kind, note.severity = kind, severity
        return note

    def __getnewargs__(self) -> tuple[str, str, float]:  # type: ignore[override]
        return str(self), self.kind, self.severity


@pytree
class Diagnostics:
    """The numbers other than fields that notes depend on, () each.

    separation_error: relative error of the decay rates shared by all wavenumbers; image_error: relative error of the
    response on the grid; single_contact: whether the indenter makes a single contact, so that too few cells across it
    deserve a note (a rough surface has patches of all sizes); widenings: how often ``grid="auto"`` was widened; refined:
    number of substeps that ``substeps="auto"`` has led to, zero without it, and unjudged: whether a part of the error by
    the time steps has no estimate; of a film whose thickness varies in the plane: thickness_error: relative error of the
    series in the thickness, thickness_slope: the largest slope between two cells, stiff_film: whether it is stiffer than
    its base, narrow_growth: how far a cell has grown beyond all its neighbours, relative to the largest growth;
    relative_step_error: of a film or an indenter that is rubbed in place, the error by the time steps relative to the
    largest change of its thickness, and step_limit: the error above which there is a note; bare_from [s]: the
    first time at which a film that wears is worn to its base at a place that is then in contact, inf if at none, and
    bare_share: the largest share of the contact over which the base is bare; ball_radius [m]: of a ``Sphere`` or a
    ``Cylinder``, or that which an ``Ellipsoid`` counts as in the note on its depth, inf for any other indenter;
    roller_length [m]: of a ``Cylinder`` on the grid, inf for any other indenter; elongation: of the contact of any other
    indenter, the number of cells across it along its longer direction over that along its shorter one; walled: whether
    walls of the indenter are met in a slide, whose part of hysteresis_force is missing; size_error: relative
    error of a size of the indenter that is rounded to whole cells; steep_share: of a ``HeightField``, the share of steps
    between neighbouring cells with a slope above 1, along the axis where it is larger; coldest [K]: the lowest
    temperature that a law of growth or ``Thermal`` is given, inf without any.
    """

    separation_error: Any = np.float64(0.0)
    image_error: Any = np.float64(0.0)
    single_contact: Any = np.bool_(False)
    widenings: Any = np.int64(0)
    refined: Any = np.int64(0)
    unjudged: Any = np.bool_(False)
    thickness_error: Any = np.float64(0.0)
    thickness_slope: Any = np.float64(0.0)
    stiff_film: Any = np.bool_(False)
    narrow_growth: Any = np.float64(0.0)
    relative_step_error: Any = np.float64(0.0)
    step_limit: Any = np.float64(STEPS)
    bare_from: Any = np.float64(np.inf)
    bare_share: Any = np.float64(0.0)
    ball_radius: Any = np.float64(np.inf)
    roller_length: Any = np.float64(np.inf)
    elongation: Any = np.float64(1.0)
    walled: Any = np.bool_(False)
    coldest: Any = np.float64(np.inf)
    size_error: Any = np.float64(0.0)
    steep_share: Any = np.float64(0.0)


class _Run(NamedTuple):
    """The numbers of one run that notes depend on: those over time, (nt,), cell_area, side (that of a cell along x) and
    width (), and its diagnostics."""

    status: np.ndarray
    film_strain: np.ndarray
    contact_area: np.ndarray
    times: np.ndarray
    jumps: np.ndarray
    cohesive_cells: np.ndarray
    time_step_error: np.ndarray
    cell_area: np.ndarray
    side: np.ndarray
    width: np.ndarray
    told: Diagnostics


def notes_of(result: Any) -> tuple[Note, ...]:
    """Return the notes on a result; for a batch of runs (``jax.vmap``), the worst note of each kind, with a count of
    runs.

    Raises ValueError where the numbers are not known (inside jit, vmap or grad).
    """
    if not has_numbers(result):
        raise ValueError(
            "notes: expected a result with known values, got one traced by jit, vmap or grad; read them outside of it"
        )
    plane_strain = result.grid.plane_strain
    found = {index: list(_notes(run, plane_strain)) for index, run in _runs(result)}
    if () in found:
        return tuple(found[()])

    # of a batch the worst note of each kind, with the number of runs that have one and the index of its own run
    summed = []
    for kind in dict.fromkeys(note.kind for notes in found.values() for note in notes):
        matching = [(note, index) for index, notes in found.items() for note in notes if note.kind == kind]
        worst, index = max(matching, key=lambda one: one[0].severity)
        run = index[0] if len(index) == 1 else index
        text = f"{len(matching)} of {len(found)} runs, worst in run {run}: {worst}"
        summed.append(Note(text, kind, float(len(matching))))
    return tuple(summed)


def has_numbers(result: Any) -> bool:
    """Return whether the values of a result are known: it is neither traced nor a structure without arrays."""
    return is_concrete(result) and hasattr(result.status, "__array__")


def announce(result: Any, stacklevel: int) -> None:
    """Issue the notes on a result as warnings; do nothing while the result is traced by jit, vmap or grad.

    stacklevel: that of ``warnings.warn``, counted from the caller.
    """
    for note in notes_of(result) if has_numbers(result) else ():
        warnings.warn(note, stacklevel=stacklevel + 1)


def kind_of(note: str) -> str:
    """Return the kind of a note; the kind of any other warning is its own text."""
    return note.kind if isinstance(note, Note) else note


def in_one_line(note: str) -> str:
    """Return a note or any other warning without line breaks."""
    return note if isinstance(note, Note) else " ".join(str(note).split())


def counts_in_words(kinds: Iterable[Iterable[str]], total: int, unit: str) -> list[str]:
    """Return lines such as "35 of 36 cases: film strain above 0.2", the most frequent first; kinds: those of each case."""
    counts = Counter(kind for each in kinds for kind in dict.fromkeys(each))
    return [f"{count} of {total} {unit}: {kind}" for kind, count in counts.most_common()]


def _runs(result: Any) -> Iterator[tuple[tuple[int, ...], _Run]]:
    """Yield the runs in a result, each with its index along the leading axes added by vmap."""
    over_time = hasattr(result, "times")
    batch = np.shape(result.status)[:-1] if over_time else np.shape(result.status)
    steps = np.shape(result.status)[len(batch) :]
    strain, on_indenter = result.film_strain, getattr(result, "indenter_film_strain", None)
    if on_indenter is not None:
        strain = np.maximum(np.asarray(strain), np.asarray(on_indenter))

    # numbers over time, with what stands for those that a result does not have, and numbers of a whole run
    given = lambda name, otherwise: (
        otherwise if getattr(result, name, None) is None else getattr(result, name)
    )
    series = {
        "status": result.status,
        "film_strain": strain,
        "contact_area": result.contact_area,
        "times": given("times", 0.0),
        "jumps": given("jumps", 0),
        "cohesive_cells": given("cohesive_cells", np.inf),
        "time_step_error": given("time_step_error", 0.0),
    }
    series = {name: np.broadcast_to(np.asarray(a), batch + steps) for name, a in series.items()}
    grid = jax.tree.map(np.asarray, result.grid)  # for numpy, which compiles nothing
    single = {
        "cell_area": grid.cell_area,
        "side": grid.spacing[0],
        "width": grid.width[0],
    } | vars(result.diagnostics)
    single = {name: np.broadcast_to(np.asarray(a), batch) for name, a in single.items()}
    for index in np.ndindex(batch):
        own = {name: np.atleast_1d(a[index]) for name, a in series.items()}
        told = {name: a[index] for name, a in single.items()}
        sizes = {name: told.pop(name) for name in ("cell_area", "side", "width")}
        yield index, _Run(**own, **sizes, told=Diagnostics(**told))


def _notes(run: _Run, plane_strain: bool) -> Iterator[Note]:
    """Yield the notes on one run."""
    told = run.told
    # 1. Statuses, and the strain of a film.
    size = run.status.size
    for code in np.unique(run.status[run.status > 0]).tolist():
        steps = np.flatnonzero(run.status == code)
        first = f", the first is {_step(run, steps[0])}" if size > 1 else ""
        message = message_of(code)
        yield Note(f"{steps.size} of {size} steps{first}: {message}", brief(message), steps.size / size)
    strain = np.where(np.isnan(run.film_strain), -np.inf, run.film_strain)
    step = int(np.argmax(strain))
    if strain[step] > STRAIN_LIMIT:
        yield Note(
            f"film strain reaches {told_apart(strain[step], STRAIN_LIMIT)}"
            f"{_at(run, step)}: above {STRAIN_LIMIT} linear theory is inaccurate",
            f"film strain above {STRAIN_LIMIT}",
            float(strain[step]),
        )

    # 2. Errors of the response, of the time steps, and of effects that not every run has.
    separation, images = float(told.separation_error), float(told.image_error)
    if separation > SEPARATION_LIMIT:
        yield Note(
            f"the shared decay rates have a relative error of up to {told_apart(separation, SEPARATION_LIMIT, 1)}"
            ": pass kernels with more nodes",
            f"error of the shared decay rates above {SEPARATION_LIMIT:g}",
            separation,
        )
    if images > IMAGE_LIMIT:
        yield Note(
            f"the response on the grid has a relative error of up to {told_apart(images, IMAGE_LIMIT, 1)}"
            ": its fit by images is inaccurate",
            f"error of the response on the grid above {IMAGE_LIMIT:g}",
            images,
        )
    yield from _of_time_steps(run)
    yield from _of_thickness(run)
    yield from _of_adhesion(run)

    # 3. Cells across the smallest contact of the run; a rough contact has patches of all sizes. With adhesion the largest
    # contact counts: one may shrink to nothing before it separates, and the cells across the zone of attraction matter then.
    if told.single_contact:
        adheres = bool(np.any(np.isfinite(run.cohesive_cells)))
        area = np.where(run.contact_area > 0.0, run.contact_area, 0.0 if adheres else np.inf)
        step = int((np.argmax if adheres else np.argmin)(area))
        # the cells of a roller's contact are a rectangle, those of another one an ellipse, whose shorter axis counts
        cells = area[step] / float(run.cell_area)
        across = cells if plane_strain else 2.0 * np.sqrt(cells / (np.pi * told.elongation))
        if np.isfinite(told.roller_length):
            across = area[step] / told.roller_length / run.side
        if 0.0 < across < FEW_CELLS:
            which = "largest" if adheres else "smallest"
            yield Note(
                f"only {math.floor(10.0 * across) / 10.0:.1f} cells across the {which} contact{_at(run, step)}:"
                f" fewer than {FEW_CELLS} are too coarse",
                f"fewer than {FEW_CELLS} cells across the contact",
                -float(across),
            )

    # 4. A ball or a roller pressed in so deep that its surface in the contact is no parabola. In an elliptic contact of area
    # pi a b the half-axis b along the smaller radius R is the deeper one: a/b is nearly the ratio of the radii to 2/3, so
    # that b/R is sqrt(a b) over R times the ratio to 1/3.
    area = np.where(np.isnan(run.contact_area), 0.0, run.contact_area)
    step, roller = int(np.argmax(area)), bool(np.isfinite(told.roller_length))
    reach = area[step] / (2.0 * told.roller_length) if roller else np.sqrt(area[step] / np.pi)
    share = float(reach / told.ball_radius)
    if share > DEEP:
        half, indenter, shape = ("radius", "ball", "paraboloid")
        if roller:
            half, indenter, shape = ("half-width", "roller", "parabola")
        yield Note(
            f"the contact {half} reaches {told_apart(share, DEEP)} of the {indenter}'s radius{_at(run, step)}:"
            f" above a third a {shape}, which stands for the {indenter}, and the theory of small strains are inaccurate",
            f"contact {half} above a third of the {indenter}'s radius",
            share,
        )

    # 5. The input: sizes in whole cells, heights in another unit, temperatures, and a grid that was widened.
    if told.size_error > ROUNDED:
        share = 100.0 * float(told.size_error)
        yield Note(
            f"the length or radius of the indenter is rounded to whole cells, by {told_apart(share, 100.0 * ROUNDED)}"
            " %: use a finer grid, or cells that divide it",
            f"size of the indenter rounded by more than {100.0 * ROUNDED:g} %",
            share,
        )
    if told.steep_share > STEEPEST:
        share = float(told.steep_share)
        yield Note(
            f"{100.0 * share:.0f} % of the steps between neighbouring heights have a slope above 1, where the theory of"
            " small slopes is inaccurate: heights and the cells of the grid are both in metres",
            f"more than {100.0 * STEEPEST:.0f} % of the slopes of the heights above 1",
            share,
        )
    if told.walled:
        yield Note(
            "the indenter has slopes above 1 along the motion at its contact (the wall of a punch): hysteresis_force,"
            " tangential_force and friction_coefficient leave out their part; in steady sliding the force is"
            " hysteresis_power over the speed, which slide_steady takes",
            "the hysteresis force leaves out slopes above 1",
        )
    if told.coldest < COLD:
        text = f"a temperature of {float(told.coldest):g} K was given: temperatures are in kelvin, not in °C"
        yield Note(text, f"a temperature below {COLD:g} K", -float(told.coldest))
    if told.widenings:
        text = f'grid="auto": widened {int(told.widenings)} times, to {float(run.width):.3g} m'
        yield Note(text, 'grid="auto": widened', float(told.widenings))


def _of_time_steps(run: _Run) -> Iterator[Note]:
    """Return notes on the error of the pressure by the time steps, and on what of it ``substeps="auto"`` cannot know."""
    told = run.told
    error = np.where(np.isnan(run.time_step_error), 0.0, run.time_step_error)
    step = int(np.argmax(error))
    if error[step] > STEP_ERROR and not np.any(run.status == Status.STEP_TOO_LONG):
        yield Note(
            f"the time steps have an estimated error of {100.0 * error[step]:.2g} % of the pressure{_at(run, step)}:"
            f" {_more_steps(run)}",
            f"estimated error of the pressure by the time steps above {100.0 * STEP_ERROR:.0f} %",
            float(error[step]),
        )
    if told.refined and told.unjudged:
        yield Note(
            f'substeps="auto" has taken {int(told.refined)} substeps without an estimate of a part of their error, that of a'
            " thickness given over time or of numbers that are not finite: compare with more substeps",
            'substeps="auto" without an estimate of a part of the error',
            float(told.refined),
        )


def _more_steps(run: _Run) -> str:
    """Return the remedy for steps that are too long."""
    if run.told.refined:
        return 'substeps="auto" has no smaller ones: use more times'
    return 'use more substeps, or substeps="auto"'


def _of_thickness(run: _Run) -> Iterator[Note]:
    """A film whose thickness varies in the plane or in time."""
    told = run.told
    error, slope = float(told.thickness_error), float(told.thickness_slope)
    if told.relative_step_error > told.step_limit and not np.any(run.status == Status.STEP_TOO_LONG):
        error_of_steps, limit_of_steps = (
            100.0 * float(told.relative_step_error),
            100.0 * float(told.step_limit),
        )
        yield Note(
            f"the time steps have an estimated error of {told_apart(error_of_steps, limit_of_steps)} % of the largest change"
            f" of the thickness: {_more_steps(run)}",
            f"estimated error of the thickness by the time steps above {100.0 * float(told.step_limit):.0f} %",
            float(told.relative_step_error),
        )
    limit, film = (STEEP_STIFF, "stiff") if told.stiff_film else (STEEP, "soft")
    if slope > limit:
        yield Note(
            f"the film's thickness varies with a slope of {told_apart(slope, limit)}: above {limit}"
            " the error of the displacement of a"
            f" {film} film exceeds 1 to 2 %",
            f"slope of the film's thickness above {limit}",
            slope,
        )
    if told.bare_share > 0.0:
        share = float(told.bare_share)
        yield Note(
            f"the film is worn to its base from t = {float(told.bare_from):g} s on, over up to {100.0 * share:.2g} % of the"
            " contact: the law takes nothing from the base, so that less material is lost than it says",
            "film worn to its base",
            share,
        )
    if told.narrow_growth > NARROW:
        share = 100.0 * float(told.narrow_growth)
        yield Note(
            f"the film has grown peaks of a single cell, {share:.0f} % of its growth above all neighbours: where growth"
            " increases by its own relief, its peaks depend on the grid",
            "growth in peaks of a single cell",
            share,
        )
    if error > SERIES_LIMIT:
        yield Note(
            f"the series in the film's thickness has a relative error of up to {told_apart(error, SERIES_LIMIT, 1)}:"
            " the range of thicknesses is too wide relative to the cell size",
            f"error of the series in the film's thickness above {SERIES_LIMIT:g}",
            error,
        )


def _of_adhesion(run: _Run) -> Iterator[Note]:
    """Return notes on jumps, and on a grid that does not resolve the attraction at the edge of contact."""
    steps = np.flatnonzero(np.diff(run.jumps, prepend=0) > 0)
    if steps.size:
        first = _at(run, int(steps[0])).replace(", at", ", first at")
        text = (
            f"the contact jumps in {steps.size} of {run.status.size} steps{first}: derivatives exclude a change of the"
            " time of jumps"
        )
        yield Note(text, "the contact jumps", float(steps.size))
    cells = float(np.min(run.cohesive_cells))
    if cells < FEW_COHESIVE:
        worse = ", and the edge may be pinned at rows of cells" if cells < TRAPPING else ""
        yield Note(
            f"{told_apart(cells, FEW_COHESIVE)} cells across the zone of attraction at the edge of contact: below"
            f" {FEW_COHESIVE} pull-off depends on the grid{worse}",
            f"fewer than {FEW_COHESIVE} cells across the zone of attraction",
            -cells,
        )


def message_of(code: float) -> str:
    """Return the message of a status; a file written by a later version may contain a status unknown here."""
    known = code in set(Status)
    return Status(int(code)).message if known else f"status {code:g}, unknown to this version"


def brief(message: str) -> str:
    """Return the first part of a status message, without reasons and remedies."""
    return message.partition(":")[0]


def _at(run: _Run, step: int) -> str:
    """Return the step and time of a history in words, or an empty string if there is only one step."""
    return f", at {_step(run, step)}" if run.status.size > 1 else ""


def _step(run: _Run, step: int) -> str:
    time = float(run.times[step])  # nan if an input value was out of range
    return f"step {step + 1} of {run.status.size}" + (f" (t = {time:g} s)" if np.isfinite(time) else "")
