"""An experiment: its checked arguments, its compiled march, at once or in blocks, and its finished result.

The way of every verb over time:

1. ``Experiment.of`` of its class raises each ``ValueError``, and makes SI units and float64 of the arguments;
2. ``with_kernels`` builds the response of the body on the grid, in compiled programs of their own;
3. ``planned`` makes the march of the arguments, the stepper and its steps, all scaled, and ``history.time_loop`` marches:
   in one compiled program (``marched``), or in blocks for ``jaxcontact run --resume`` (``blocks``);
4. ``finished`` adds the diagnostics for notes, and statuses for what response and time steps leave in error.

A steady state takes steps 1, 2 and 4.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.programs import Program
from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.fields import Scale
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace, static, untupled
from jaxcontact._support.status import LARGEST_ERROR, LARGEST_STEP_ERROR, REFINED, Status, most_serious
from jaxcontact.bodies.body import LayeredHalfSpace, ThicknessMap, checked_body
from jaxcontact.bodies.controls import Control, Load, check_control
from jaxcontact.bodies.grid import Grid, check_grid
from jaxcontact.bodies.laws import Adhesion, check_hardness
from jaxcontact.contact.law import Hardness
from jaxcontact.history.motion import TooFewSubstepsError
from jaxcontact.history.time_loop import (
    Carry,
    Outcome,
    Rows,
    Stepper,
    Steps,
    begin,
    begun,
    in_blocks,
    march,
    march_from_rest,
)
from jaxcontact.indenters.shapes import (
    Ellipsoid,
    HeightField,
    Indenter,
    Sphere,
    checked_indenter,
)
from jaxcontact.operators.kernels import (
    Errors,
    build,
    build_varying,
    check_kernels,
    check_stiffness,
)
from jaxcontact.response.stack import (
    has_zero_instantaneous_compliance,
    short_wave_compliance,
    solids,
    stiffness_ratio,
    top_layer,
    uniform_compliance,
)
from jaxcontact.results.contact import ContactHistory, ContactStep
from jaxcontact.results.notes import Diagnostics, announce

Save = str | Callable[[ContactStep], Any]

LOOSEST = 1e-2  # tolerance


@pytree
class Experiment:
    """The arguments of a verb after their checks, in SI units and float64; each is documented in ``indent``.

    kernels: those given or built, of the kind that the verb needs; None before. valid: None, or whether traced values are in
    range. film_map: the thickness of a film that varies in the plane; the layer of ``body`` is then as thick as it is at
    most. hardness: of surfaces that yield [Pa], or None.
    """

    body: LayeredHalfSpace
    indenter: Indenter
    control: Control
    times: Array
    grid: Grid
    tolerance: Array
    max_iterations: Array
    kernels: Any
    valid: Array | None
    film_map: ThicknessMap | None
    hardness: Array | None
    save: Save = static()
    substeps: int = static()
    correspondence: str = static()
    checkpoint: str = static()

    @classmethod
    def of(
        cls,
        body: LayeredHalfSpace,
        indenter: Indenter,
        control: Control,
        times: Any,
        grid: Grid,
        *,
        tolerance: Any = 1e-8,
        max_iterations: Any = 500,
        kernels: Any = None,
        save: Save = "all",
        substeps: int = 1,
        correspondence: str = "exact",
        checkpoint: str = "pressures",
        film_map: ThicknessMap | None = None,
        hardness: Any = None,
        adhesive: bool = False,
    ) -> Self:
        """Check what all verbs have in common; ValueError for what cannot be computed. adhesive: loads may be negative."""
        # 1. Each argument by itself.
        times = untupled(times)
        body, valid = checked_body(body)
        valid = valid & check_grid(grid)
        indenter, good = checked_indenter(indenter, grid)
        valid = valid & good & checks.not_decreasing("times [s]", times)
        valid = valid & check_control(control, np.shape(times)[0], adhesive=adhesive)
        if hardness is not None:
            valid = valid & check_hardness(hardness, grid.shape)
            checks.require(
                not adhesive,
                "hardness: expected None with adhesion, got a hardness: surfaces that yield are computed without attraction",
            )
        valid = valid & checks.between("tolerance", tolerance, 0.0, LOOSEST)
        if is_concrete(max_iterations):
            checks.whole("max_iterations", np.asarray(max_iterations).item(), 1, 10**9)
        known = save in ("all", "last") or callable(save)
        checks.require(known, f'save: expected "all", "last" or a function, got {save!r}')
        checks.whole("substeps", substeps, 1, 1000)
        checks.one_of("correspondence", correspondence, "exact", "quasi-elastic")
        checks.one_of("checkpoint", checkpoint, "pressures", "blocks")

        # 2. The surfaces that respond, on this grid. Where it has no sides, one on a rigid base has a mean displacement.
        own, exact = indenter.surface(), correspondence == "exact"
        surfaces = [body] if own is None else [body, own]
        on_base = [each for each in surfaces if each.substrate is None and all(grid.periodic)]
        for each in surfaces:
            valid = valid & check_stiffness(each)
        checks.require(
            not (adhesive and on_base),
            "adhesion: expected None for a body or an indenter on a rigid base and a grid that is periodic along both axes",
        )
        if kernels is not None:
            checks.require(exact, 'kernels: expected correspondence="exact" with them')
            valid = valid & check_kernels(kernels, body, grid, indenter)
            kernels = replace(kernels, made_of=None)  # so that all runs share a program

        # 3. What the paper's substitution of phi(t) for 1/(2G) cannot do.
        checks.require(
            exact or own is None,
            f'correspondence: expected "exact" with an indenter that creeps or is coated, got "{correspondence}"',
        )
        checks.require(
            exact or all(solid.bulk_modulus is None for solid in solids(body)),
            f'correspondence: expected "exact" with a bulk modulus, got "{correspondence}", whose error would reach 5 %',
        )
        checks.require(
            exact or not on_base,
            'correspondence: expected "exact" for a body on a rigid base and a grid that is periodic along both axes,'
            f' got "{correspondence}"',
        )

        # 4. Conditions for a contact to exist.
        valid = valid & check_instantaneous_compliance(body, indenter, exact=exact)
        map_over_times = film_map is not None and film_map.over_times
        if not isinstance(control, Load) and all(grid.periodic) and not map_over_times:
            highest = jnp.mean(profile_over_film(indenter, grid, film_map))
            valid = valid & check_approach_range(control, highest, on_base)

        body, indenter, control, times, grid, tolerance, film_map, hardness = as_float64(
            (body, indenter, control, times, grid, tolerance, film_map, hardness)
        )
        return cls(
            body=body,
            indenter=indenter,
            control=control,
            times=times,
            grid=grid,
            tolerance=tolerance,
            max_iterations=jnp.asarray(max_iterations, int),
            kernels=kernels,
            valid=None if valid is True else jnp.asarray(valid),
            film_map=film_map,
            hardness=hardness,
            save=save,
            substeps=substeps,
            correspondence=correspondence,
            checkpoint=checkpoint,
        )

    def also(self, verdict: Verdict) -> Self:
        """The experiment with one more condition on values that are not known yet."""
        if verdict is True:
            return self
        return replace(self, valid=jnp.asarray(verdict if self.valid is None else self.valid & verdict))

    def with_kernels(self) -> Self:
        """The experiment with its kernels built, unless they are given or the way of its march needs none."""
        if self.kernels is not None or self.correspondence != "exact":
            return self
        if self.film_map is not None:
            thickness = self.film_map.values
            return replace(self, kernels=build_varying(self.body, self.indenter, self.grid, thickness))
        return replace(self, kernels=build(self.body, self.indenter, self.grid))

    def planned(self) -> Plan:
        """Return the march of the experiment; a steady state has none."""
        raise NotImplementedError

    @property
    def changes_in_given_ways(self) -> bool:
        """Return whether the body changes in time as it is given, an effect that the error of the time steps leaves out."""
        return self.film_map is not None and self.film_map.over_times

    @property
    def temperatures(self) -> list[Any]:
        """The temperatures that the experiment is given [K]."""
        return []

    @property
    def profile(self) -> Array:
        """The gap before contact at an approach of zero [m], (nx, ny), over the film as it is at first."""
        return profile_over_film(self.indenter, self.grid, self.film_map)

    @property
    def surfaces(self) -> list[LayeredHalfSpace]:
        """The body, and the indenter where it creeps or is coated."""
        own = self.indenter.surface()
        return [self.body] if own is None else [self.body, own]

    @property
    def work(self) -> float:
        """The work of the march in cell steps (``Program``); that of direct superposition grows with the square of time."""
        steps = self.times.size * self.substeps
        return float(math.prod(self.grid.shape) * steps * (1 if self.correspondence == "exact" else steps))

    @property
    def load_controlled(self) -> bool:
        return isinstance(self.control, Load)

    @property
    def duration(self) -> Array:
        """Time from the first to the last step [s]."""
        return self.times[-1] - self.times[0]

    @property
    def edges(self) -> tuple[bool, bool]:
        """Return whether contact at the sides of the grid across x, and across y, would continue beyond the grid."""
        fills, (wraps_x, wraps_y) = self.indenter.fills_grid, self.grid.periodic
        return not (fills or wraps_x), not (fills or wraps_y)

    def target(self, scale: Scale) -> Array:
        """The control, scaled: the sum of pressures or the approach."""
        return scale.from_si("load" if self.load_controlled else "approach", self.control.value)

    def contact(self, scale: Scale) -> dict[str, Any]:
        """Return the fields of a stepper that the contact of every experiment has, with a law for surfaces that yield."""
        law = {}
        if self.hardness is not None:
            law = {"law": Hardness(scale.from_si("pressure", self.hardness))}
        return {
            "profile": self.profile / scale.length,
            "tolerance": self.tolerance,
            "max_iterations": self.max_iterations,
            "load_controlled": self.load_controlled,
            "edges": self.edges,
            **law,
        }

    def steps(self, scale: Scale, more: Any) -> Steps:
        """Return the inner steps, (nt, substeps), with the further input of their stepper, (nt, substeps, ...)."""
        targets = jnp.broadcast_to(self.target(scale), self.times.shape)
        return Steps(fine_steps(self.times, self.substeps), fine_values(targets, self.substeps), more)


def check_instantaneous_compliance(body: LayeredHalfSpace, indenter: Indenter, *, exact: bool) -> Verdict:
    """Check that a contact can begin: one of both surfaces gives way at once, and a film has a largest decay rate.

    A surface with J(0) = 0 is rigid at first. exact: whether the response is exact, which needs the largest rate of a film.
    """
    surface = indenter.surface()
    rigid, film = has_zero_instantaneous_compliance(body), exact and top_layer(body) is not None
    alone: Array | bool = indenter.material is None
    its_film = surface is not None and top_layer(surface) is not None
    if surface is not None:
        alone = has_zero_instantaneous_compliance(surface)
    if not is_concrete(rigid, alone):
        first, second = jnp.asarray(rigid), jnp.asarray(alone)
        return ~((first & second) | (first & film) | (second & its_film))
    checks.require(
        not (bool(rigid) and bool(alone)),
        "a Kelvin-Voigt surface has J(0) = 0 and is rigid at first: a rigid indenter cannot be pressed on it, not"
        " even by a load that rises from zero; expected an elastic indenter or a material with an instantaneous"
        " compliance",
    )
    checks.require(
        not ((bool(rigid) and film) or (bool(alone) and its_film)),
        "layer: a material with J(0) = 0 has no bound on its decay rates over a substrate; expected one with an"
        ' instantaneous compliance (StandardLinearSolid, say), or correspondence="quasi-elastic"',
    )
    return True


def check_approach_range(control: Control, highest: Array, on_base: Sequence[LayeredHalfSpace]) -> Verdict:
    """Check the approach on a grid that is periodic along both axes: less than the mean gap at first touch, ``highest`` [m].

    The mean displacement is zero there, so that at a larger approach all of the surface would be in contact; not so of
    surfaces on a rigid base, unless nothing on it can be compressed.
    """
    inside = jnp.max(jnp.asarray(control.value)) < highest
    for each in on_base:
        inside = inside | (uniform_compliance(each) > 0.0)
    if not is_concrete(control, highest, inside):
        return inside
    checks.require(
        bool(inside),
        f"Approach [m]: expected less than {float(highest):g} on a periodic grid, the mean gap at first touch,"
        f" got {float(np.max(control.value)):g}: the mean displacement is zero, so that all of the surface"
        " would be in contact",
    )
    return True


def profile_over_film(indenter: Indenter, grid: Grid, film_map: ThicknessMap | None) -> Array:
    """Return the gap before contact at an approach of zero [m], (nx, ny), over a film that stands on a flat base.

    The approach is zero at first touch of the film as it is at first: the lowest point of the gap is as low as that of the
    indenter alone.
    """
    profile = indenter.profile(grid)
    if film_map is None:
        return profile
    over = profile - film_map.at_first
    return over - (jnp.min(over) - jnp.min(profile))


def fine_steps(times: Array, substeps: int) -> Array:
    """The inner steps [s], (nt, substeps); the first row has no length."""
    before = jnp.append(times[:1], times[:-1])
    return (times - before)[:, None] / substeps * jnp.ones(substeps)


def fine_values(values: Array, substeps: int) -> Array:
    """Return values (nt, ...) at the ends of the inner steps, (nt, substeps, ...), linear between times."""
    before = jnp.concatenate([values[:1], values[:-1]])
    share = (jnp.arange(1, substeps + 1) / substeps).reshape(-1, *[1] * (values.ndim - 1))
    return before[:, None] + (values - before)[:, None] * share


def tabor_numbers(law: Adhesion, experiment: Experiment) -> Array:
    """Return the Tabor number of a ball with the compliance of the surface at each time, (nt,); nan without a ball."""
    times, indenter = experiment.times, experiment.indenter
    if not isinstance(indenter, Sphere):
        return jnp.full(times.shape, jnp.nan)
    since = times - times[0]
    compliance = short_wave_compliance(experiment.body, since)
    compliance = compliance + indenter.compliance_of_short_waves(since)
    return law.tabor_number(indenter.radius, 2.0 / compliance)


# The march: its plan, one compiled program for all of it, and the substeps that "auto" chooses.


ENERGIES = "jump_energy", "viscous_energy"  # without derivatives, those of their units included


@pytree
class Plan:
    """A march to be made, and what its result is made of.

    steps: (nt, substeps, ...); errors: of the kernels; course, beside: fields of the result that are known beforehand, in
    SI, with and without a first axis of time; makes: the result of its fields; step: the argument of a ``save`` function.
    """

    stepper: Stepper
    steps: Steps
    scale: Scale
    errors: Errors
    course: dict[str, Array]
    beside: dict[str, Any]
    makes: Callable[..., ContactHistory] = static(default=ContactHistory)
    step: type[ContactStep] = static(default=ContactStep)

    def result(
        self, outcomes: Outcome, carry: Carry, last: dict[str, Array], rows: slice = slice(None)
    ) -> ContactHistory:
        """Return the result for some rows from their outcomes; last: the fields where outcomes have none."""
        overall = {"profile": self.stepper.profile} | self.stepper.overall(carry.own)
        in_si = self.scale.to_si(**overall, **(outcomes.fields or last), **outcomes.numbers)
        in_si |= {name: jax.lax.stop_gradient(in_si[name]) for name in ENERGIES if name in in_si}
        course = {name: values[rows] for name, values in self.course.items()}
        told = Diagnostics(**self.stepper.told(carry.own))
        return self.makes(saved=outcomes.saved, diagnostics=told, **course, **self.beside, **in_si)


@functools.partial(Program, work=lambda experiment: experiment.work)
def _run(experiment: Experiment) -> tuple[ContactHistory, Errors]:
    """March over all times, compiled once for equal shapes and options; return the result and the errors of the kernels."""
    plan, save = experiment.planned(), experiment.save

    def kept(outcome: Outcome) -> Outcome:
        """Return what is saved of a time: all of it, its numbers, or also the value of a user's function of it in SI."""
        if save == "all":
            return outcome
        saved = None
        if callable(save):
            profile = outcome.fields.get("moved_profile", plan.stepper.profile)
            gap = profile + outcome.fields["displacement"] - outcome.numbers["approach"]
            in_si = plan.scale.to_si(gap=gap, **outcome.fields, **outcome.numbers)
            known = {each.name for each in fields(plan.step)} & in_si.keys()
            saved = save(plan.step(**{name: in_si[name] for name in known}))
        return outcome._replace(fields={}, saved=saved)

    state, outcomes = march_from_rest(plan.stepper, plan.steps, kept, experiment.checkpoint)
    return plan.result(outcomes, state.carry, state.last.fields), plan.errors


def marched(experiment: Experiment) -> Any:
    """Return the finished result of an experiment over time, without warnings."""
    result, errors = _run(experiment.with_kernels())
    return finished(result, errors, experiment)


def refined(
    make: Callable[[int], Any],
    substeps: int | str,
    solve: Callable[[Any], Any] = marched,
    exact: Callable[[Any, Any], bool] = lambda experiment, history: True,
) -> Any:
    """Return the history of an experiment with a number of substeps, or, with "auto", with the first of ``REFINED`` whose
    estimated errors by the time steps are below 1 %, or else with the last; without warnings.

    make: the experiment with so many substeps; solve: its history; exact: whether further errors of the time steps are
    small.
    """
    if substeps != "auto":
        return solve(make(substeps))  # type: ignore[arg-type]
    for count in REFINED:
        try:
            experiment = make(count)
        except TooFewSubstepsError:
            if count == REFINED[-1]:
                raise
            continue
        history = solve(experiment)
        checks.require(
            is_concrete(history.status), 'substeps: expected a number inside jit, vmap and grad, got "auto"'
        )
        unknown = not np.all(np.isfinite(history.time_step_error)) or experiment.changes_in_given_ways
        short = not np.any(np.asarray(history.time_step_error) > LARGEST_ERROR)
        if short and exact(experiment, history) and not np.any(history.status == Status.STEP_TOO_LONG):
            break
    told = replace(
        history.diagnostics,
        step_limit=np.float64(LARGEST_ERROR),
        refined=np.int64(count),
        unjudged=np.bool_(unknown),
    )
    return replace(history, diagnostics=told)


# The finished result: diagnostics for the notes, statuses for known errors, and nan where traced values were out of range.


ROUNDED = 1e-12  # change of a thickness, over it, that is rounding


def finished(result: Any, errors: Errors, experiment: Experiment) -> Any:
    """Return a result with the diagnostics that its notes need, nan throughout where values were out of range."""
    indenter = experiment.indenter
    radius: Any = jnp.inf
    if isinstance(indenter, Sphere):
        radius = indenter.radius
    elif isinstance(
        indenter, Ellipsoid
    ):  # of the ball whose share is that of the section of the smaller radius
        low, high = jnp.min(jnp.asarray(indenter.radii)), jnp.max(jnp.asarray(indenter.radii))
        radius = low * (high / low) ** (1.0 / 3.0)
    told = {
        "separation_error": errors.separation,
        "image_error": errors.images,
        "single_contact": jnp.asarray(not isinstance(experiment.indenter, HeightField)),
        "widenings": jnp.zeros((), int),
        "ball_radius": jax.lax.stop_gradient(jnp.asarray(radius, float)),
        "size_error": jax.lax.stop_gradient(experiment.indenter.size_error(experiment.grid)),
    }
    if experiment.temperatures:
        each = [jnp.min(jnp.asarray(value, float)) for value in experiment.temperatures]
        told["coldest"] = jax.lax.stop_gradient(jnp.min(jnp.stack(each)))
    if experiment.film_map is not None:
        told["thickness_error"] = jnp.asarray(errors.thickness)
        grown = getattr(result, "thickness", None)
        told |= _told_of_thickness(experiment.film_map, experiment.grid, experiment.body, grown)

    if hasattr(result, "times"):
        status = _doubted_until_now(result.status, result.times, errors, result.time_step_error)
    else:
        status = _doubted_in_a_passage(result.status, result.velocity, result.grid, errors)
    diagnostics = replace(result.diagnostics, **told)
    result, valid = replace(result, status=status, diagnostics=diagnostics), experiment.valid
    if valid is None:
        return result

    # values that could not be checked before the run: no number is returned where they are out of range
    status = jnp.where(valid, status, int(Status.OUT_OF_RANGE))
    masked = lambda a: jnp.where(valid, a, jnp.nan) if jnp.issubdtype(a.dtype, jnp.inexact) else a
    return replace(jax.tree.map(masked, result), status=status)


def reported(result: Any, errors: Errors, experiment: Experiment) -> Any:
    """Return a finished result, and issue its notes as warnings to the caller of the verb."""
    result = finished(result, errors, experiment)
    announce(result, stacklevel=3)
    return result


@functools.partial(Program, optimised=False)
def _told_of_thickness(
    film_map: ThicknessMap, grid: Grid, body: Any, thickness: Array | None
) -> dict[str, Array]:
    """Return the largest slope of a film's thickness, given or formed, whether the film is stiffer than its base, and how
    narrow its growth is; thickness: None of a film that does not grow."""
    maps = [film_map.values] if thickness is None else [film_map.values, thickness]
    axes = [axis for axis, n in enumerate(grid.shape) if n > 1]
    slopes = []
    for values in maps:
        for axis in axes:
            wraps = grid.periodic[axis]
            step = values - jnp.roll(values, 1, axis - 2) if wraps else jnp.diff(values, axis=axis - 2)
            slopes.append(jnp.max(jnp.abs(step)) / grid.spacing[axis])
    found = {
        "thickness_slope": jnp.max(jnp.stack(slopes)),
        "stiff_film": jnp.asarray(stiffness_ratio(body) > 1.0),
    }
    if thickness is None:
        return found

    # how far a cell has grown beyond all its neighbours, relative to the largest change
    last = thickness[-1] if thickness.ndim == 3 else thickness
    grown, least = last - film_map.at_first, ROUNDED * jnp.max(jnp.abs(last))
    grown = jnp.where(jnp.abs(grown) > least, grown, 0.0)
    highest = jnp.full_like(grown, -jnp.inf)
    for axis in axes:
        ends = [(1, 1) if other == axis else (0, 0) for other in (0, 1)]
        outside = {"mode": "wrap"} if grid.periodic[axis] else {"constant_values": -jnp.inf}
        padded = jnp.pad(grown, ends, **outside)
        for start in (0, 2):
            beside = jax.lax.slice_in_dim(padded, start, start + grown.shape[axis], axis=axis)
            highest = jnp.maximum(highest, beside)
    beyond, largest = jnp.max(grown - highest), jnp.max(jnp.abs(grown))
    narrow = jnp.where(largest > 0.0, beyond / jnp.where(largest > 0.0, largest, 1.0), 0.0)
    return found | {"narrow_growth": narrow}


@jax.jit
def _doubted_until_now(status: Array, times: Array, errors: Errors, step_error: Array) -> Array:
    """Return ``doubted`` at the times of a result, each with the errors of the response until then."""
    return doubted(status, times - times[0], errors, step_error)


@jax.jit
def _doubted_in_a_passage(status: Array, velocity: Array, grid: Grid, errors: Errors) -> Array:
    """Return ``doubted`` of a steady state, which lasts for one passage of its grid."""
    speed = jnp.sqrt(jnp.sum(jnp.asarray(velocity) ** 2))
    width = jnp.max(jnp.stack(grid.width))
    return doubted(status, width / jnp.where(speed > 0.0, speed, 1.0), errors)


@jax.jit  # one program instead of one for each operation
def doubted(status: Array, elapsed: Array, errors: Errors, step_error: Array | float = 0.0) -> Array:
    """Return the status, with ``NOT_RESOLVED`` where the error of the response exceeds 1 %, and ``STEP_TOO_LONG`` where that
    of the pressure by the time steps exceeds 10 %, unless it is more serious; later times do not inherit these."""
    largest = jnp.maximum(jnp.maximum(errors.separation, errors.images), errors.thickness)
    # an infinite error is that of a response which is not finite, and has this status
    off = ((largest > LARGEST_ERROR) & jnp.isfinite(largest)) | (elapsed > errors.horizon)
    return most_serious(
        (off, Status.NOT_RESOLVED), (step_error > LARGEST_STEP_ERROR, Status.STEP_TOO_LONG), status=status
    )


# The march in blocks, for ``jaxcontact run``.
#
# A verb such as ``jaxcontact.indent`` is one compiled call and tells nothing until it ends. Here the same march runs
# in blocks of steps of one static length, each from the carry of the one before, so that there is one compilation, something
# to keep after every block, and a place to go on from when a run was stopped.


BLOCK = 5  # steps: short enough for a lively bar, long enough that calling the block costs nothing


@dataclass(frozen=True)
class FinishedBlock:
    """The steps that a run has finished since the previous block.

    history: of the steps that are fine, with all their fields, in numpy arrays and SI units; status: 0, or that
    of the step that ends the run (see ``ContactHistory``), which is not in the history; carry: the leaves
    of what the march goes on from.
    """

    history: ContactHistory
    status: int
    carry: list[np.ndarray]


def ready(experiment: Experiment) -> Plan:
    """Return the march of an experiment, ready to start in blocks."""
    return _planned(experiment.with_kernels())


def blocks(plan: Plan, done: int = 0, carry: Sequence[np.ndarray] | None = None) -> Iterator[FinishedBlock]:
    """March on after the first ``done`` blocks, which ended with ``carry``, and hand out each block; the first bad step
    ends them.

    A march that goes on from a carry gives bit for bit what it would have given without a stop.
    """
    state, rows = _begun(plan)
    if carry is not None:
        state = jax.tree.unflatten(jax.tree.structure(state), [jnp.asarray(leaf) for leaf in carry])
    # numpy: each operation of jax outside run_block would be a program
    on_host, rows = jax.device_get((plan, rows))
    times = on_host.course["times"]
    for index in range(done, len(rows.exists)):
        state, outcomes = run_block(plan.stepper, state, jax.tree.map(lambda a, i=index: a[i], rows))
        outcomes, on_disk = jax.device_get((outcomes, state))

        # the status of each step that exists, and the steps before the first bad one
        first = index * BLOCK
        exist = min(BLOCK, times.size - first)
        elapsed = times[np.minimum(first + np.arange(BLOCK), times.size - 1)] - times[0]
        own, step_error = outcomes.numbers["status"], outcomes.numbers["time_step_error"]
        status = np.asarray(doubted(own, elapsed, on_host.errors, step_error))[:exist]
        bad = np.flatnonzero(status)
        count = int(bad[0]) if bad.size else status.size
        fine = jax.tree.map(lambda a, n=count: a[:n], outcomes)
        fine.numbers["status"] = jnp.asarray(status[:count])
        history = on_host.result(fine, on_disk, {}, slice(first, first + count))
        ended = int(status[bad[0]]) if bad.size else 0
        yield FinishedBlock(jax.tree.map(np.asarray, history), ended, jax.tree.leaves(on_disk))
        if ended:
            return


def first_block(experiment: Experiment) -> tuple[Plan, Carry, Outcome]:
    """Return the plan of a march and what its first block gives, scaled; for their shapes."""
    plan = ready(experiment)
    state, rows = _begun(plan)
    return plan, *run_block(plan.stepper, state, jax.tree.map(lambda a: a[0], rows))


@Program
def _planned(experiment: Experiment) -> Plan:
    return experiment.planned()


@Program
def _begun(plan: Plan) -> tuple[Carry, Rows]:
    """Return the carry before the first step, and the steps in blocks."""
    return begin(plan.stepper), in_blocks(plan.steps, BLOCK)


@Program
def run_block(stepper: Stepper, carry: Carry, rows: Rows) -> tuple[Carry, Outcome]:
    """One compiled block of ``BLOCK`` rows."""
    state, outcomes = march(stepper, begun(stepper, carry, rows.steps), rows, lambda outcome: outcome)
    return state.carry, outcomes
