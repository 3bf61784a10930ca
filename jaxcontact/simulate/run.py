"""An experiment: its checked arguments, its compiled march (in one program or in blocks of steps), and its finished result.

The stages of every public function that computes a history:

1. ``Experiment.of`` of its class checks the arguments, which raises ``ValueError``, and converts numbers to float64;
2. ``with_kernels`` builds the response of the body on the grid, in compiled programs of their own;
3. ``planned`` makes a ``Plan``: the stepper and the input of its steps, scaled. ``history.time_loop`` computes the steps, in
   one compiled program (``marched``), or in blocks for ``jaxcontact run --resume`` (``blocks``);
4. ``finished`` adds the diagnostics for the notes, and the statuses of known errors of the response and of the time steps.

A steady state (``slide_steady``, ``roll_steady``) has stages 1, 2 and 4.
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
from jaxcontact._support.reductions import lowest_point
from jaxcontact._support.status import LARGEST_ERROR, LARGEST_STEP_ERROR, REFINED, Status, most_serious
from jaxcontact.bodies.body import LayeredHalfSpace, ThicknessMap, checked_body
from jaxcontact.bodies.controls import Control, Load, check_control
from jaxcontact.bodies.grid import Grid, check_grid
from jaxcontact.bodies.laws import Adhesion, check_adhesion, check_hardness, check_shear_strength
from jaxcontact.contact.adhesive import Attraction
from jaxcontact.contact.law import Hardness
from jaxcontact.history.memory import Observer
from jaxcontact.history.motion import TooFewSubstepsError
from jaxcontact.history.time_loop import (
    Carry,
    Outcome,
    Rows,
    Stepper,
    Steps,
    before_rows,
    count_of,
    fine_steps,
    fine_values,
    first_carry,
    in_blocks,
    march,
    march_from_rest,
)
from jaxcontact.indenters.shapes import (
    Cylinder,
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

LOOSEST = 1e-2  # largest tolerance that is accepted


@pytree
class Experiment:
    """The arguments of a public function after their checks, in SI units and float64; each is documented in ``indent``.

    kernels: given by the user or built by ``with_kernels``, None until then. valid: whether the values that jax traces are
    in range, (), None where all values are known. film_map: the thickness of a film that varies in the plane, or None; the
    layer of ``body`` has its largest thickness. hardness: of surfaces that yield [Pa], or None. adhesion: a law, or None;
    shear_strength: of an adhesive contact [Pa], a number or (nx, ny), or None.
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
    adhesion: Adhesion | None
    shear_strength: Array | None
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
        adhesion: Any = None,
        shear_strength: Any = None,
    ) -> Self:
        """Check the arguments that several public functions have in common; ValueError for what cannot be computed."""
        # 1. Each argument by itself.
        times = untupled(times)
        body, valid = checked_body(body)
        valid = valid & check_grid(grid)
        indenter, good = checked_indenter(indenter, grid)
        valid = valid & good & checks.not_decreasing("times [s]", times)
        # surfaces that attract each other can be pulled, by a negative load
        adhesive = adhesion is not None
        if adhesive:
            valid = valid & check_adhesion(adhesion)
        if shear_strength is not None:
            valid = valid & check_shear_strength(shear_strength, grid.shape, adhesive=adhesive)
        valid = valid & check_control(control, np.shape(times)[0], adhesive=adhesive)
        if hardness is not None:
            valid = valid & check_hardness(hardness, grid.shape)
            checks.require(
                not adhesive,
                "hardness: expected None with adhesion, got a hardness: surfaces that yield are computed without attraction",
            )
        valid = valid & checks.between("tolerance", tolerance, 0.0, LOOSEST)
        if is_concrete(max_iterations):
            max_iterations = np.asarray(max_iterations)
            checks.whole("max_iterations", max_iterations.item(), 1, 10**9)
        known = save in ("all", "last") or callable(save)
        checks.require(known, f'save: expected "all", "last" or a function, got {save!r}')
        checks.whole("substeps", substeps, 1, 1000)
        checks.one_of("correspondence", correspondence, "exact", "quasi-elastic")
        checks.one_of("checkpoint", checkpoint, "pressures", "blocks")

        # 2. The deformable surfaces: the body, and an indenter that creeps or is coated. On a grid that is periodic along
        # both axes a surface on a rigid base has a mean displacement, and others have none.
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

        # 3. Bodies for which the paper's substitution of phi(t) for 1/(2G) is not defined or not accurate.
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

        numbers = as_float64(
            dict(
                body=body,
                indenter=indenter,
                control=control,
                times=times,
                grid=grid,
                tolerance=tolerance,
                film_map=film_map,
                hardness=hardness,
                adhesion=adhesion,
                shear_strength=shear_strength,
            )
        )
        return cls(
            **numbers,
            max_iterations=max_iterations.astype(int),
            kernels=kernels,
            valid=None if valid is True else jnp.asarray(valid),
            save=save,
            substeps=substeps,
            correspondence=correspondence,
            checkpoint=checkpoint,
        )

    def also(self, verdict: Verdict) -> Self:
        """Return the experiment with a further condition on traced values, which are known only when the program runs."""
        if verdict is True:
            return self
        return replace(self, valid=jnp.asarray(verdict if self.valid is None else self.valid & verdict))

    def with_kernels(self) -> Self:
        """Return the experiment with kernels: those of the user, built here, or None with the quasi-elastic
        correspondence."""
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
    def has_prescribed_changes(self) -> bool:
        """Whether the thickness of the film is prescribed over time, an effect that ``time_step_error`` does not include."""
        return self.film_map is not None and self.film_map.over_times

    @property
    def temperatures(self) -> list[Any]:
        """The temperatures among the arguments [K]."""
        return []

    @property
    def profile(self) -> Array:
        """The gap before contact at an approach of zero [m], (nx, ny), over a film of its first thickness."""
        return profile_over_film(self.indenter, self.grid, self.film_map)

    @property
    def surfaces(self) -> list[LayeredHalfSpace]:
        """The body, and the indenter where it creeps or is coated."""
        own = self.indenter.surface()
        return [self.body] if own is None else [self.body, own]

    @property
    def work(self) -> float:
        """The number of cells times steps (``Program``); direct superposition costs the square of the number of steps."""
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

    def attraction(self, scale: Scale) -> Attraction:
        """Return the law of adhesion, scaled, on the cells of the grid."""
        assert self.adhesion is not None
        return Attraction(self.adhesion.scaled(scale.length, scale.compliance), self.grid.periodic)

    @property
    def tabor_number(self) -> dict[str, Array]:
        """The field ``tabor_number`` of the result, none without adhesion: of a ball with the compliance of the surface at
        each time, (nt,), and nan of other indenters."""
        if self.adhesion is None:
            return {}
        since = self.times - self.times[0]
        if not isinstance(self.indenter, Sphere):
            return {"tabor_number": jnp.full(since.shape, jnp.nan)}
        compliance = short_wave_compliance(self.body, since)
        compliance = compliance + self.indenter.compliance_of_short_waves(since)
        return {"tabor_number": self.adhesion.tabor_number(self.indenter.radius, 2.0 / compliance)}

    def stepper_arguments(self, scale: Scale) -> dict[str, Any]:
        """Return the arguments that every stepper has in common; ``law`` only for surfaces that yield or attract each
        other, since hard contact is the law of a stepper that is given none."""
        law: dict[str, Any] = {}
        if self.hardness is not None:
            law = {"law": Hardness(scale.from_si("pressure", self.hardness))}
        if self.adhesion is not None:
            law = {"law": self.attraction(scale)}
        return {
            "profile": self.profile / scale.length,
            "tolerance": self.tolerance,
            "max_iterations": self.max_iterations,
            "load_controlled": self.load_controlled,
            "edges": self.edges,
            **law,
        }

    def steps(self, scale: Scale, more: Any) -> Steps:
        """Return the inner steps, (nt, substeps); more: the further input of the stepper at each, (nt, substeps, ...)."""
        targets = jnp.broadcast_to(self.target(scale), self.times.shape)
        return Steps(fine_steps(self.times, self.substeps), fine_values(targets, self.substeps), more)


def check_instantaneous_compliance(body: LayeredHalfSpace, indenter: Indenter, *, exact: bool) -> Verdict:
    """Check that a surface has an instantaneous compliance, and each film one of its own.

    A surface with J(0) = 0 is rigid at first, and two rigid surfaces have no contact area. The decay rates of a film with
    J(0) = 0 have no upper bound, which the exact correspondence needs (``exact``).
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
    """Return the gap before contact at an approach of zero [m], (nx, ny), over a film on a flat base.

    The approach is zero where the indenter first touches the film of the first thickness: the lowest
    point of the gap is as low as that of the indenter alone.
    """
    profile = indenter.profile(grid)
    if film_map is None:
        return profile
    over = profile - film_map.at_first
    cell = grid.spacing[0]
    return over - (lowest_point(over, cell) - lowest_point(profile, cell))


# The march: its plan, the compiled program of all its steps, and the choice of ``substeps="auto"``.


ENERGIES = "jump_energy", "viscous_energy"  # fields without derivatives, also with respect to the scale


@pytree
class Plan:
    """A march that is ready to be computed, and what its result consists of besides the outcomes of the steps.

    steps: input of the stepper, (nt, substeps, ...); errors: of the kernels; time_fields, fixed_fields: fields of the result
    that are known beforehand, in SI, with and without a first axis of time; result_class: the class of the result, or a
    function of its fields; step: the class of the argument of a ``save`` function.
    """

    stepper: Stepper
    steps: Steps
    scale: Scale
    errors: Errors
    time_fields: dict[str, Array]
    fixed_fields: dict[str, Any]
    result_class: Callable[..., ContactHistory] = static(default=ContactHistory)
    step: type[ContactStep] = static(default=ContactStep)

    def result(
        self, outcomes: Outcome, carry: Carry, last: dict[str, Array], rows: slice = slice(None)
    ) -> ContactHistory:
        """Return the result for some rows from their outcomes; last: the fields of the last row, for outcomes without
        fields."""
        overall = {"profile": self.stepper.profile} | self.stepper.overall(carry.own)
        in_si = self.scale.to_si(**overall, **(outcomes.fields or last), **outcomes.numbers)
        in_si |= {name: jax.lax.stop_gradient(in_si[name]) for name in ENERGIES if name in in_si}
        time_fields = {name: values[rows] for name, values in self.time_fields.items()}
        diagnostics = Diagnostics(**self.stepper.for_notes(carry.own))
        return self.result_class(
            saved=outcomes.saved, diagnostics=diagnostics, **time_fields, **self.fixed_fields, **in_si
        )


@functools.partial(Program, work=lambda experiment: experiment.work)
def _run(experiment: Experiment) -> tuple[ContactHistory, Errors]:
    """March over all times, compiled once for equal shapes and options; return the result and the errors of the kernels."""
    plan, save = experiment.planned(), experiment.save

    def kept(outcome: Outcome) -> Outcome:
        """Return what ``save=`` keeps of a time: everything, the numbers, or these and the value of the user's function."""
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
    solve: Callable[[Any], Any],
    make: Callable[[int], Any],
    substeps: int | str,
    accurate: Callable[[Any, Any], bool] = lambda experiment, history: True,
) -> Any:
    """Return the history that ``solve`` returns of an experiment with a number of substeps.

    With "auto" the numbers of ``REFINED`` are tried one after the other until ``time_step_error`` is below 1 % at all times;
    the history of the last one is returned if it is not. solve: ``marched``, or a function that adds to what it returns;
    make: function of the number of substeps that returns the experiment; accurate: function of experiment and history that
    returns whether errors of the time steps that ``time_step_error`` does not include are small.
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
        unknown = not np.all(np.isfinite(history.time_step_error)) or experiment.has_prescribed_changes
        short = not np.any(np.asarray(history.time_step_error) > LARGEST_ERROR)
        if short and accurate(experiment, history) and not np.any(history.status == Status.STEP_TOO_LONG):
            break
    diagnostics = replace(
        history.diagnostics,
        step_limit=np.float64(LARGEST_ERROR),
        refined=np.int64(count),
        unjudged=np.bool_(unknown),
    )
    return replace(history, diagnostics=diagnostics)


# The finished result: diagnostics for the notes, statuses of known errors, and nan where traced values were out of range.


ROUNDED = 1e-12  # relative change of a thickness below which it counts as rounding


def finished(result: Any, errors: Errors, experiment: Experiment) -> Any:
    """Return a result with diagnostics for its notes and statuses of known errors; all nan where values were out of
    range."""
    indenter = experiment.indenter
    found = {
        "separation_error": errors.separation,
        "image_error": errors.images,
        "single_contact": np.bool_(not isinstance(indenter, HeightField)),
        "widenings": np.int64(0),
    } | _sizes(indenter, experiment.grid)
    if experiment.temperatures:
        each = [jnp.min(jnp.asarray(value, float)) for value in experiment.temperatures]
        found["coldest"] = jax.lax.stop_gradient(jnp.min(jnp.stack(each)))
    if isinstance(indenter, HeightField):
        found["steep_share"] = _steep_share(
            jax.lax.stop_gradient(jnp.asarray(indenter.heights, float)), experiment.grid
        )
    if hasattr(result, "times") and hasattr(result, "hysteresis_force"):
        found["walled"] = _meets_walls(result, indenter)
    if experiment.film_map is not None:
        found["thickness_error"] = jnp.asarray(errors.thickness)
        grown = getattr(result, "thickness", None)
        found |= _thickness_diagnostics(experiment.film_map, experiment.grid, experiment.body, grown)

    if hasattr(result, "times"):
        status = _status_of_march(result.status, result.times, errors, result.time_step_error)
    else:
        status = _status_of_passage(result.status, result.velocity, result.grid, errors)
    diagnostics = replace(result.diagnostics, **found)
    result, valid = replace(result, status=status, diagnostics=diagnostics), experiment.valid
    if valid is None:
        return result

    return _only_where(valid, result)


@functools.partial(Program, optimised=False)
def _only_where(valid: Array, result: Any) -> Any:
    """Return a result whose numbers are nan, with the status ``OUT_OF_RANGE``, unless values that could not be checked
    before the run are in range."""
    status = jnp.where(valid, result.status, int(Status.OUT_OF_RANGE))
    masked = lambda a: jnp.where(valid, a, jnp.nan) if jnp.issubdtype(a.dtype, jnp.inexact) else a
    return replace(jax.tree.map(masked, result), status=status)


def reported(result: Any, errors: Errors, experiment: Experiment) -> Any:
    """Return a finished result, and issue its notes as warnings to the caller of the verb."""
    result = finished(result, errors, experiment)
    announce(result, stacklevel=3)
    return result


@functools.partial(Program, optimised=False)
def _sizes(indenter: Indenter, grid: Grid) -> dict[str, Array]:
    """Return what notes say of the size of an indenter or compare with that of the contact, by the names of diagnostics,
    without derivatives."""
    dx, dy = grid.spacing
    radius: Any = jnp.inf
    roller_length: Any = jnp.inf
    longer: Any = dx / dy  # cells along y over cells along x that cross the contact
    if isinstance(indenter, Sphere):
        radius = indenter.radius
    elif isinstance(indenter, Cylinder):
        radius, roller_length = indenter.radius, jnp.minimum(indenter.length, grid.width[1])
    elif isinstance(indenter, Ellipsoid):
        # the radius of a ball with the same error, which is governed by the section of the smaller radius
        low, high = jnp.min(jnp.asarray(indenter.radii)), jnp.max(jnp.asarray(indenter.radii))
        radius = low * (high / low) ** (1.0 / 3.0)
        # the axes of the contact, nearly in the ratio of the radii to 2/3
        longer = longer * (indenter.radii[1] / indenter.radii[0]) ** (2.0 / 3.0)
    found = {
        "ball_radius": jnp.asarray(radius, float),
        "roller_length": jnp.asarray(roller_length, float),
        "elongation": jnp.maximum(longer, 1.0 / longer),
        "size_error": indenter.size_error(grid),
    }
    return jax.lax.stop_gradient(found)


@functools.partial(Program, optimised=False)
def _steep_share(heights: Array, grid: Grid) -> Array:
    """Return the share of steps between neighbouring cells with a slope above 1, along the axis where it is larger, ()."""
    return jnp.max(jnp.stack([jnp.mean(each > 1.0) for each in _slopes(heights, grid)]))


def _slopes(values: Array, grid: Grid) -> list[Array]:
    """Return the sizes of the slopes between neighbouring cells of a field (..., nx, ny), along each axis with several."""
    found = []
    for axis, wraps in enumerate(grid.periodic):
        if grid.shape[axis] > 1:
            step = values - jnp.roll(values, 1, axis - 2) if wraps else jnp.diff(values, axis=axis - 2)
            found.append(jnp.abs(step) / grid.spacing[axis])
    return found


@functools.partial(Program, optimised=False)
def _meets_walls(result: Any, indenter: Indenter) -> Array:
    """Return whether a slide has a force at walls of the indenter, which ``hysteresis_force`` leaves out, ()."""
    grid = result.grid
    dx, dy = grid.spacing
    pressed = jnp.any(result.pressure != 0.0, tuple(range(result.pressure.ndim - 2)))
    observer = Observer.of(indenter.profile(grid) / dx, dy / dx, grid.periodic)
    resisted = jnp.any(result.hysteresis_power > 0.0) | (result.dent is not None)
    return observer.walled(pressed, jnp.any(result.velocity != 0.0, 0)) & resisted


@functools.partial(Program, optimised=False)
def _thickness_diagnostics(
    film_map: ThicknessMap, grid: Grid, body: Any, thickness: Array | None
) -> dict[str, Array]:
    """Return the diagnostics of a film whose thickness varies in the plane: its largest slope, whether the film is stiffer
    than its base, and the largest growth of a cell beyond all its neighbours over the largest growth; thickness: of a film
    that grows, (nt, nx, ny) or (nx, ny), or None."""
    maps = [film_map.values] if thickness is None else [film_map.values, thickness]
    found = {
        "thickness_slope": jnp.max(
            jnp.stack([jnp.max(each) for values in maps for each in _slopes(values, grid)])
        ),
        "stiff_film": jnp.asarray(stiffness_ratio(body) > 1.0),
    }
    if thickness is None:
        return found

    # how far a cell has grown beyond all its neighbours, relative to the largest change
    last = thickness[-1] if thickness.ndim == 3 else thickness
    grown, least = last - film_map.at_first, ROUNDED * jnp.max(jnp.abs(last))
    grown = jnp.where(jnp.abs(grown) > least, grown, 0.0)
    highest = jnp.full_like(grown, -jnp.inf)
    for axis in [axis for axis, n in enumerate(grid.shape) if n > 1]:
        ends = [(1, 1) if other == axis else (0, 0) for other in (0, 1)]
        outside = {"mode": "wrap"} if grid.periodic[axis] else {"constant_values": -jnp.inf}
        padded = jnp.pad(grown, ends, **outside)
        for start in (0, 2):
            beside = jax.lax.slice_in_dim(padded, start, start + grown.shape[axis], axis=axis)
            highest = jnp.maximum(highest, beside)
    beyond, largest = jnp.max(grown - highest), jnp.max(jnp.abs(grown))
    narrow = jnp.where(largest > 0.0, beyond / jnp.where(largest > 0.0, largest, 1.0), 0.0)
    return found | {"narrow_growth": narrow}


@functools.partial(Program, optimised=False)
def _status_of_march(status: Array, times: Array, errors: Errors, step_error: Array) -> Array:
    """Return ``with_error_statuses`` for a history: the response is in error beyond its horizon."""
    return with_error_statuses(status, times - times[0], errors, step_error)


@functools.partial(Program, optimised=False)
def _status_of_passage(status: Array, velocity: Array, grid: Grid, errors: Errors) -> Array:
    """Return ``with_error_statuses`` for a steady state, whose duration is that of one passage of the grid."""
    speed = jnp.sqrt(jnp.sum(jnp.asarray(velocity) ** 2))
    width = jnp.max(jnp.stack(grid.width))
    return with_error_statuses(status, width / jnp.where(speed > 0.0, speed, 1.0), errors)


@functools.partial(Program, optimised=False)  # one program instead of one for each operation
def with_error_statuses(
    status: Array, elapsed: Array, errors: Errors, step_error: Array | float = 0.0
) -> Array:
    """Return the status, raised to ``NOT_RESOLVED`` where the error of the response exceeds 1 %, and to ``STEP_TOO_LONG``
    where the error of the pressure by the time steps exceeds 10 %. Later times do not inherit these two."""
    largest = jnp.maximum(jnp.maximum(errors.separation, errors.images), errors.thickness)
    # where the error is infinite the response is not finite, and the step has the status NOT_FINITE already
    off = ((largest > LARGEST_ERROR) & jnp.isfinite(largest)) | (elapsed > errors.horizon)
    return most_serious(
        (off, Status.NOT_RESOLVED), (step_error > LARGEST_STEP_ERROR, Status.STEP_TOO_LONG), status=status
    )


# The march in blocks, for ``jaxcontact run``.
#
# A public function such as ``jaxcontact.indent`` is one compiled call without output until it ends. Here the same march runs
# in blocks of ``BLOCK`` steps, each of which begins with the carry of the previous one. All blocks share one compiled
# program; after each of them its results can be stored, and a run that was stopped continues from the last stored block.


# steps in a block: few enough for a smooth progress bar, enough that the call of a block costs little
BLOCK = 5


@dataclass(frozen=True)
class FinishedBlock:
    """The steps that a run has finished since the previous block.

    history: of the steps with status 0, with all their fields, in numpy arrays and SI units; status: 0, or that of the
    step that ends the run (see ``ContactHistory``), which is not in the history; carry: the leaves of the carry with which
    the march continues.
    """

    history: ContactHistory
    status: int
    carry: list[np.ndarray]


def plan_of(experiment: Experiment) -> Plan:
    """Return the plan of an experiment, with its kernels, for ``blocks``."""
    return _planned(experiment.with_kernels())


def blocks(plan: Plan, done: int = 0, carry: Sequence[np.ndarray] | None = None) -> Iterator[FinishedBlock]:
    """Yield each block after the first ``done`` ones, which ended with ``carry``; a step of another status than 0 is the
    last.

    A march that continues from a carry gives results that are equal, bit for bit, to those without a stop.
    """
    state, rows = _carry_and_blocks(plan)
    if carry is not None:
        state = jax.tree.unflatten(jax.tree.structure(state), [jnp.asarray(leaf) for leaf in carry])
    # as numpy arrays, since each operation of jax outside run_block would be compiled as a program
    on_host, rows = jax.device_get((plan, rows))
    times = on_host.time_fields["times"]
    for index in range(done, count_of(rows.steps)):
        state, outcomes = run_block(plan.stepper, state, jax.tree.map(lambda a, i=index: a[i], rows))
        outcomes, on_disk = jax.device_get((outcomes, state))

        # the status of each step that exists, and the steps before the first bad one
        first = index * BLOCK
        exist = min(BLOCK, times.size - first)
        elapsed = times[np.minimum(first + np.arange(BLOCK), times.size - 1)] - times[0]
        own, step_error = outcomes.numbers["status"], outcomes.numbers["time_step_error"]
        status = np.asarray(with_error_statuses(own, elapsed, on_host.errors, step_error))[:exist]
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
    """Return the plan of a march with the carry and the outcome of its first block, scaled, whose shapes are needed."""
    plan = plan_of(experiment)
    state, rows = _carry_and_blocks(plan)
    return plan, *run_block(plan.stepper, state, jax.tree.map(lambda a: a[0], rows))


@Program
def _planned(experiment: Experiment) -> Plan:
    return experiment.planned()


@Program
def _carry_and_blocks(plan: Plan) -> tuple[Carry, Rows]:
    """Return the carry before the first step, and the steps in blocks."""
    return first_carry(plan.stepper), in_blocks(plan.steps, BLOCK)


@Program
def run_block(stepper: Stepper, carry: Carry, rows: Rows) -> tuple[Carry, Outcome]:
    """Return the carry and the outcomes of one block of ``BLOCK`` rows."""
    state, outcomes = march(stepper, before_rows(stepper, carry, rows.steps), rows, lambda outcome: outcome)
    return state.carry, outcomes
