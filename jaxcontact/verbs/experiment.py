"""Common basis of the verbs: the validation of arguments, the preparation of an experiment and the conversion to SI.

A verb over time makes a ``TimedExperiment`` of its arguments, whose ``planned`` gives a ``Plan`` with the stepper of its
kind, and the march does the rest; a steady state is solved with the pieces. Options are named here, once.
"""

from __future__ import annotations

import abc
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace, static
from jaxcontact._support.scale import Scale
from jaxcontact._support.status import LARGEST_ERROR, Status
from jaxcontact.history.march import Carry, Keep, Outcome, Stepper, Steps, march_from_rest
from jaxcontact.indenters.shapes import HeightField, Indenter, Sphere, checked_indenter
from jaxcontact.inputs.controls import Control, Load, check_control
from jaxcontact.inputs.grid import Grid, check_grid
from jaxcontact.inputs.layers import LayeredHalfSpace, ThicknessMap, checked_body
from jaxcontact.operators.kernels import Errors, Kernels, check_kernels, check_stiffness, compiled_build
from jaxcontact.operators.thickness_kernels import VaryingKernels, compiled_varying
from jaxcontact.operators.traction_kernels import TractionKernels
from jaxcontact.response.limits import limits_of
from jaxcontact.response.stack import solids
from jaxcontact.results.contact import ContactHistory, ContactStep, nan_where_invalid
from jaxcontact.results.notes import Diagnostics, announce

Save = str | Callable[[ContactStep], Any]
LOOSEST = 1e-2  # tolerance
ROUNDED = 1e-12  # change of a thickness, over it, that is rounding


@dataclass(frozen=True)
class Options:
    """Static options of a run; their meaning is documented in ``indent``."""

    save: Save = "all"
    substeps: int = 1
    correspondence: str = "exact"
    checkpoint: str = "pressures"

    def check(self) -> None:
        """Raises ValueError for an option that is not there."""
        known = self.save in ("all", "last") or callable(self.save)
        checks.require(known, f'save: expected "all", "last" or a function, got {self.save!r}')
        checks.whole("substeps", self.substeps, 1, 1000)
        checks.one_of("correspondence", self.correspondence, "exact", "quasi-elastic")
        checks.one_of("checkpoint", self.checkpoint, "pressures", "blocks")


@pytree
class Experiment:
    """A validated experiment in SI units and float64; valid: None, or whether traced values are in range.

    film_map: the thickness of a film that varies in the plane; the layer of ``body`` is then as thick as it is at most.
    """

    body: LayeredHalfSpace
    indenter: Indenter
    control: Control
    times: Array
    grid: Grid
    tolerance: Array
    max_iterations: Array
    kernels: Kernels | VaryingKernels | TractionKernels | None
    valid: Array | None
    options: Options = static()
    film_map: ThicknessMap | None

    @classmethod
    def of(
        cls,
        body: LayeredHalfSpace,
        indenter: Indenter,
        control: Control,
        times: Any,
        *,
        grid: Grid,
        tolerance: Any = 1e-8,
        max_iterations: Any = 500,
        kernels: Kernels | None = None,
        film_map: ThicknessMap | None = None,
        adhesive: bool = False,
        **options: Any,
    ) -> Self:
        """Check all that verbs have in common; ValueError for what cannot be computed. adhesive: loads may be negative."""
        body, valid = checked_body(body)
        valid = valid & check_grid(grid) & checked_indenter(indenter, grid)
        valid = valid & checks.not_decreasing("times [s]", times)
        valid = valid & check_control(control, np.shape(times)[0], adhesive=adhesive)
        valid = valid & checks.between("tolerance", tolerance, 0.0, LOOSEST)
        if is_concrete(max_iterations):
            checks.whole("max_iterations", np.asarray(max_iterations).item(), 1, 10**9)
        static_options = Options(**options)
        static_options.check()
        if kernels is not None:
            exact = static_options.correspondence == "exact"
            checks.require(exact, 'kernels: expected correspondence="exact" with them')
            valid = valid & check_kernels(kernels, grid)
        valid = valid & check_stiffness(body)
        valid = valid & _check_instantaneous_compliance(body, indenter, static_options.correspondence)
        valid = valid & _check_approach_range(control, indenter, grid, film_map)
        given = as_float64((body, indenter, control, times, grid, tolerance))
        known = None if valid is True else jnp.asarray(valid)
        iterations = jnp.asarray(max_iterations, int)
        return cls(*given, iterations, kernels, known, static_options, film_map=as_float64(film_map))

    def also(self, verdict: Verdict) -> Self:
        """The experiment with one more condition on values that are not known yet."""
        if verdict is True:
            return self
        return replace(self, valid=jnp.asarray(verdict if self.valid is None else self.valid & verdict))

    def with_kernels(self) -> Self:
        """The experiment with its kernels built, unless they are given or the way of its march needs none."""
        if self.kernels is not None or self.options.correspondence != "exact":
            return self
        if self.film_map is not None:
            thickness = self.film_map.values
            return replace(self, kernels=compiled_varying(self.body, self.indenter, self.grid, thickness))
        return replace(self, kernels=compiled_build(self.body, self.indenter, self.grid))

    @property
    def ready_kernels(self) -> Kernels:
        """Those given or built."""
        assert isinstance(self.kernels, Kernels)
        return self.kernels

    @property
    def varying_kernels(self) -> VaryingKernels:
        """The kernels of a film whose thickness varies in the plane."""
        assert isinstance(self.kernels, VaryingKernels)
        return self.kernels

    @property
    def profile(self) -> Array:
        """The gap before contact at an approach of zero [m], (nx, ny), over the film as it is at first."""
        return profile_over_film(self.indenter, self.grid, self.film_map)

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
        along_x, along_y = (not self.indenter.fills_grid and not wraps for wraps in self.grid.periodic)
        return along_x, along_y

    @property
    def temperatures(self) -> list[Any]:
        """The temperatures that the experiment is given [K]."""
        return []

    def target(self, scale: Scale) -> Array:
        """The control, scaled: the sum of pressures or the approach."""
        return scale.from_si("load" if self.load_controlled else "approach", self.control.value)


@pytree
class TimedExperiment(Experiment, abc.ABC):
    """The base of experiments over time."""

    @abc.abstractmethod
    def planned(self) -> Plan:
        """Return the march of the experiment."""

    def contact(self, scale: Scale) -> dict[str, Any]:
        """Return the fields of a stepper that the contact of every experiment has."""
        return {
            "profile": self.profile / scale.length,
            "tolerance": self.tolerance,
            "max_iterations": self.max_iterations,
            "load_controlled": self.load_controlled,
            "edges": self.edges,
        }

    def plan(
        self,
        stepper: Stepper,
        more: Any,
        scale: Scale,
        errors: Errors,
        *,
        makes: Callable[..., ContactHistory] = ContactHistory,
        step: type[ContactStep] = ContactStep,
        course: dict[str, Array] | None = None,
        beside: dict[str, Array] | None = None,
    ) -> Plan:
        """Return the march of a stepper, whose further input is ``more``, (nt, substeps, ...); the rest as in ``Plan``."""
        substeps = self.options.substeps
        targets = fine_values(jnp.broadcast_to(self.target(scale), self.times.shape), substeps)
        steps = Steps(fine_steps(self.times, substeps), targets, more)
        course = {"times": self.times} | (course or {})
        return Plan(stepper, steps, scale, errors, course, {"grid": self.grid} | (beside or {}), makes, step)


def _check_instantaneous_compliance(
    body: LayeredHalfSpace, indenter: Indenter, correspondence: str
) -> Verdict:
    """Require an elastic indenter for J(0) = 0, the quasi-elastic method for such a film, and the exact one with a bulk
    modulus."""
    bulky = any(solid.bulk_modulus is not None for solid in solids(body))
    checks.require(
        correspondence == "exact" or not bulky,
        f'correspondence: expected "exact" with a bulk modulus, got "{correspondence}", whose error would reach 5 %',
    )
    limits = limits_of(body)
    rigid = limits.has_zero_instantaneous_compliance()
    alone, film = indenter.material is None, limits.film is not None and correspondence == "exact"
    if not is_concrete(rigid):
        return ~(jnp.asarray(rigid) & (alone or film))
    checks.require(
        not (bool(rigid) and alone),
        "a Kelvin-Voigt surface has J(0) = 0 and is rigid at first: a rigid indenter cannot be pressed on it, not even by a"
        " load that rises from zero; expected an elastic indenter or a material with an instantaneous compliance",
    )
    checks.require(
        not (bool(rigid) and film),
        "layer: a material with J(0) = 0 has no bound on its decay rates over a substrate; expected one with an"
        ' instantaneous compliance (StandardLinearSolid, say), or correspondence="quasi-elastic"',
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


def _check_approach_range(
    control: Control, indenter: Indenter, grid: Grid, film_map: ThicknessMap | None
) -> Verdict:
    """Require an approach that is less than the mean gap on a periodic grid, where the mean displacement is zero."""
    if isinstance(control, Load) or not all(grid.periodic) or (film_map is not None and film_map.over_times):
        return True
    highest = jnp.mean(profile_over_film(indenter, grid, film_map))
    inside = jnp.max(jnp.asarray(control.value)) < highest
    if not is_concrete(control, highest):
        return inside
    checks.require(
        bool(inside),
        f"Approach [m]: expected less than {float(highest):g} on a periodic grid, the mean gap at first touch, got"
        f" {float(np.max(control.value)):g}: the mean displacement is zero, so that all of the surface would be in contact",
    )
    return True


def fine_steps(times: Array, substeps: int) -> Array:
    """The inner steps [s], (nt, substeps); the first row has no length."""
    before = jnp.append(times[:1], times[:-1])
    return (times - before)[:, None] / substeps * jnp.ones(substeps)


def fine_values(values: Array, substeps: int) -> Array:
    """Return values (nt, ...) at the ends of the inner steps, (nt, substeps, ...), linear between times."""
    before = jnp.concatenate([values[:1], values[:-1]])
    share = (jnp.arange(1, substeps + 1) / substeps).reshape(-1, *[1] * (values.ndim - 1))
    return before[:, None] + (values - before)[:, None] * share


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
    makes: Callable[..., ContactHistory] = static()
    step: type[ContactStep] = static()

    def marched(self, options: Options) -> ContactHistory:
        """Return the result of the whole march, with the fields that ``options.save`` keeps."""
        state, outcomes = march_from_rest(
            self.stepper, self.steps, self.kept(options.save), options.checkpoint
        )
        return self.result(outcomes, state.carry, state.last.fields)

    def kept(self, save: Save) -> Keep:
        """Return what a march keeps of an outcome: all of it, its numbers, or also the value of a function of it in SI."""
        if save == "all":
            return lambda outcome: outcome
        value = (lambda outcome: save(self.seen(outcome))) if callable(save) else lambda outcome: None
        return lambda outcome: outcome._replace(fields={}, saved=value(outcome))

    def seen(self, outcome: Outcome) -> ContactStep:
        """Return an outcome in SI, for a user's function."""
        profile = outcome.fields.get("moved_profile", self.stepper.profile)
        gap = profile + outcome.fields["displacement"] - outcome.numbers["approach"]
        in_si = self.scale.to_si(gap=gap, **outcome.fields, **outcome.numbers)
        known = {field.name for field in fields(self.step)} & in_si.keys()
        return self.step(**{name: in_si[name] for name in known})

    def result(
        self, outcomes: Outcome, carry: Carry, last: dict[str, Array], rows: slice = slice(None)
    ) -> ContactHistory:
        """Return the result for some rows from their outcomes; last: the fields where outcomes have none."""
        overall = {"profile": self.stepper.profile} | self.stepper.overall(carry.own)
        in_si = self.scale.to_si(**overall, **(outcomes.fields or last), **outcomes.numbers)
        course = {name: values[rows] for name, values in self.course.items()}
        return self.makes(saved=outcomes.saved, **course, **self.beside, **in_si)


@Program
def _run(experiment: TimedExperiment) -> tuple[ContactHistory, Errors]:
    """The compiled core of all experiments over time: one trace for equal shapes and options."""
    plan = experiment.planned()
    return plan.marched(experiment.options), plan.errors


def marched(experiment: TimedExperiment) -> Any:
    """Return the finished result of an experiment over time, without warnings."""
    result, errors = _run(experiment.with_kernels())
    return finished(result, errors, experiment)


def finished(result: Any, errors: Errors, experiment: Experiment) -> Any:
    """Return a result with the diagnostics that its notes need, nan throughout where values were out of range."""
    single = jnp.asarray(not isinstance(experiment.indenter, HeightField))
    radius = experiment.indenter.radius if isinstance(experiment.indenter, Sphere) else jnp.inf
    told = Diagnostics(errors.separation, errors.images, single, jnp.zeros((), int))
    rounded = experiment.indenter.size_error(experiment.grid)
    told = replace(
        told, **jax.lax.stop_gradient({"ball_radius": jnp.asarray(radius, float), "size_error": rounded})
    )
    if experiment.temperatures:
        told = replace(told, coldest=_least(experiment.temperatures))
    if experiment.film_map is not None:
        told = replace(told, thickness_error=jnp.asarray(errors.thickness), **_steepness(experiment, result))
    return nan_where_invalid(
        replace(result, status=_doubted(result, errors), diagnostics=told), experiment.valid
    )


def _least(values: list[Any]) -> Array:
    """Return the least of some values, without derivative, ()."""
    return jax.lax.stop_gradient(jnp.min(jnp.stack([jnp.min(jnp.asarray(v, float)) for v in values])))


def _steepness(experiment: Experiment, result: Any) -> dict[str, Array]:
    """Return the largest slope of a film's thickness, given or formed, and whether the film is stiffer than its base."""
    assert experiment.film_map is not None
    grid, maps = experiment.grid, [experiment.film_map.values]
    if hasattr(result, "thickness"):
        maps.append(result.thickness)
    along = [axis for axis, n in enumerate(grid.shape) if n > 1]
    slopes = [
        jnp.max(jnp.abs(_differences(values, axis - 2, grid.periodic[axis]))) / grid.spacing[axis]
        for values in maps
        for axis in along
    ]
    ratio = limits_of(experiment.body).stiffness_ratio()
    found = {"thickness_slope": jnp.max(jnp.stack(slopes)), "stiff_film": jnp.asarray(ratio > 1.0)}
    if hasattr(result, "thickness"):
        last = result.thickness[-1] if result.thickness.ndim == 3 else result.thickness
        grown, least = last - experiment.film_map.at_first, ROUNDED * jnp.max(jnp.abs(last))
        found["narrow_growth"] = _narrowest(
            jnp.where(jnp.abs(grown) > least, grown, 0.0), along, grid.periodic
        )
    return found


def _narrowest(grown: Array, axes: list[int], periodic: tuple[bool, bool]) -> Array:
    """Return how far a cell has grown beyond all its neighbours along some axes, relative to the largest change, ()."""
    highest = jnp.full_like(grown, -jnp.inf)
    for axis in axes:
        ends = [(1, 1) if other == axis else (0, 0) for other in (0, 1)]
        padded = (
            jnp.pad(grown, ends, "wrap") if periodic[axis] else jnp.pad(grown, ends, constant_values=-jnp.inf)
        )
        for start in (0, 2):
            beside = jax.lax.slice_in_dim(padded, start, start + grown.shape[axis], axis=axis)
            highest = jnp.maximum(highest, beside)
    beyond, largest = jnp.max(grown - highest), jnp.max(jnp.abs(grown))
    return jnp.where(largest > 0.0, beyond / jnp.where(largest > 0.0, largest, 1.0), 0.0)


def _differences(values: Array, axis: int, periodic: bool) -> Array:
    """Return the differences between neighbours along an axis."""
    return values - jnp.roll(values, 1, axis) if periodic else jnp.diff(values, axis=axis)


def reported(result: Any, errors: Errors, experiment: Experiment) -> Any:
    """Return a finished result, and issue its notes as warnings to the caller of the verb."""
    result = finished(result, errors, experiment)
    announce(result, stacklevel=3)
    return result


def _doubted(result: Any, errors: Errors) -> Array:
    """Return the status with the known errors of the response; a steady state lasts for one passage of its grid."""
    if hasattr(result, "times"):
        return doubted(result.status, result.times - result.times[0], errors)
    speed = jnp.sqrt(jnp.sum(jnp.asarray(result.velocity) ** 2))
    width = jnp.max(jnp.stack(result.grid.width))
    return doubted(result.status, width / jnp.where(speed > 0.0, speed, 1.0), errors)


def doubted(status: Array, elapsed: Array, errors: Errors) -> Array:
    """Return the status, with ``NOT_RESOLVED`` in place of ``FINE`` where the error of the response exceeds 1 %."""
    largest = jnp.maximum(jnp.maximum(errors.separation, errors.images), errors.thickness)
    off = (largest > LARGEST_ERROR) | (elapsed > errors.horizon)
    return jnp.where(off & (status == Status.FINE), int(Status.NOT_RESOLVED), status)
