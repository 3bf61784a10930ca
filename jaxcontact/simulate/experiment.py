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

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace, static, untupled
from jaxcontact._support.scale import Scale
from jaxcontact.bodies.body import LayeredHalfSpace, ThicknessMap, checked_body
from jaxcontact.bodies.controls import Control, Load, check_control
from jaxcontact.bodies.grid import Grid, check_grid
from jaxcontact.bodies.laws import Adhesion
from jaxcontact.contact.adhesive import Attraction
from jaxcontact.history.time_loop import Carry, Keep, Outcome, Stepper, Steps, march_from_rest
from jaxcontact.indenters.shapes import Indenter, Sphere, checked_indenter
from jaxcontact.operators.kernels import (
    Errors,
    Kernels,
    TractionKernels,
    check_kernels,
    check_stiffness,
    compiled_build,
    compiled_varying,
)
from jaxcontact.response.normal import limits_of
from jaxcontact.response.stack import solids
from jaxcontact.results.contact import ContactHistory, ContactStep
from jaxcontact.results.notes import Diagnostics

# The arguments of the verbs: the contact that is given, and the settings of its solution, both before validation.


Save = str | Callable[[ContactStep], Any]


@dataclass(frozen=True)
class ContactSetup:
    """The contact that a verb is given, not yet validated; the fields are documented in ``indent``."""

    body: LayeredHalfSpace
    indenter: Indenter
    control: Control
    times: Any
    grid: Grid


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


@dataclass(frozen=True)
class Settings:
    """The settings of a solution, not yet validated; the fields are documented in ``indent``."""

    tolerance: Any = 1e-8
    max_iterations: Any = 500
    kernels: Kernels | None = None
    options: Options = Options()


# The march of an experiment: its stepper and its steps, and the fields of its result that are known beforehand.


ENERGIES = "jump_energy", "viscous_energy"  # without derivatives, those of their units included


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

    def to(
        self,
        makes: Callable[..., ContactHistory],
        step: type[ContactStep] = ContactStep,
        *,
        course: dict[str, Array] | None = None,
        beside: dict[str, Any] | None = None,
    ) -> Self:
        """Return the march to another result, with further fields that are known beforehand."""
        course, beside = self.course | (course or {}), self.beside | (beside or {})
        return replace(self, makes=makes, step=step, course=course, beside=beside)

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
        in_si |= {name: jax.lax.stop_gradient(in_si[name]) for name in ENERGIES if name in in_si}
        course = {name: values[rows] for name, values in self.course.items()}
        told = Diagnostics(**self.stepper.told(carry.own))
        return self.makes(saved=outcomes.saved, diagnostics=told, **course, **self.beside, **in_si)


LOOSEST = 1e-2  # tolerance


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
    kernels: Kernels | TractionKernels | None
    valid: Array | None
    options: Options = static()
    film_map: ThicknessMap | None

    @classmethod
    def of(
        cls,
        setup: ContactSetup,
        settings: Settings,
        *,
        film_map: ThicknessMap | None = None,
        adhesive: bool = False,
    ) -> Self:
        """Check all that verbs have in common; ValueError for what cannot be computed. adhesive: loads may be negative."""
        indenter, control, times, grid = setup.indenter, setup.control, untupled(setup.times), setup.grid
        tolerance, max_iterations, kernels = settings.tolerance, settings.max_iterations, settings.kernels
        body, valid = checked_body(setup.body)
        valid = valid & check_grid(grid) & checked_indenter(indenter, grid)
        valid = valid & checks.not_decreasing("times [s]", times)
        valid = valid & check_control(control, np.shape(times)[0], adhesive=adhesive)
        valid = valid & checks.between("tolerance", tolerance, 0.0, LOOSEST)
        if is_concrete(max_iterations):
            checks.whole("max_iterations", np.asarray(max_iterations).item(), 1, 10**9)
        settings.options.check()
        if kernels is not None:
            exact = settings.options.correspondence == "exact"
            checks.require(exact, 'kernels: expected correspondence="exact" with them')
            valid = valid & check_kernels(kernels, grid)
        valid = valid & check_stiffness(body)
        valid = valid & _check_instantaneous_compliance(body, indenter, settings.options.correspondence)
        valid = valid & _check_approach_range(control, indenter, grid, film_map)
        given = as_float64((body, indenter, control, times, grid, tolerance))
        known = None if valid is True else jnp.asarray(valid)
        iterations = jnp.asarray(max_iterations, int)
        return cls(*given, iterations, kernels, known, settings.options, film_map=as_float64(film_map))

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
    def varying_kernels(self) -> Kernels:
        """The kernels of a film whose thickness varies in the plane."""
        assert isinstance(self.kernels, Kernels) and self.kernels.varying is not None
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

    @property
    def changes_in_given_ways(self) -> bool:
        """Return whether the body changes in time as it is given, an effect that the error of the time steps leaves out."""
        return self.film_map is not None and self.film_map.over_times

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

    def plan(self, stepper: Stepper, more: Any, scale: Scale, errors: Errors) -> Plan:
        """Return the march of a stepper, whose further input is ``more``, (nt, substeps, ...), to a ``ContactHistory``."""
        substeps = self.options.substeps
        targets = fine_values(jnp.broadcast_to(self.target(scale), self.times.shape), substeps)
        steps = Steps(fine_steps(self.times, substeps), targets, more)
        known = {"times": self.times}, {"grid": self.grid}
        return Plan(stepper, steps, scale, errors, *known, ContactHistory, ContactStep)


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


# The scaled law of adhesion of an experiment over time, and its Tabor numbers.


def attraction_of(law: Adhesion, experiment: Experiment, scale: Scale) -> Attraction:
    """Return a law of adhesion on the grid of an experiment, scaled."""
    return Attraction(law.scaled(scale.length, scale.compliance), experiment.grid.periodic)


def tabor_numbers(law: Adhesion, experiment: Experiment) -> Array:
    """Return the Tabor number of a ball with the compliance of the surface at each time, (nt,); nan without a ball."""
    times, indenter = experiment.times, experiment.indenter
    if not isinstance(indenter, Sphere):
        return jnp.full(times.shape, jnp.nan)
    compliance = limits_of(experiment.body).short_wave_compliance(times - times[0]) + indenter.compliance()
    return law.tabor_number(indenter.radius, 2.0 / compliance)
