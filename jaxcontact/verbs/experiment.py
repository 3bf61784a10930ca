"""What all verbs share: one check of what is given, one preparation, one way back to SI.

A verb makes an ``Experiment`` of its arguments, brings it to a ``Plan`` with the memory of its own kind, and
marches; or solves one contact with the pieces. Options are named here, once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace, static
from jaxcontact._support.scale import Scale
from jaxcontact._support.status import LARGEST_ERROR, Status
from jaxcontact.history import march as marching
from jaxcontact.history.march import Outcome, Setup, Steps
from jaxcontact.history.memory import Memory
from jaxcontact.indenters.shapes import HeightField, Indenter, checked_indenter
from jaxcontact.inputs.controls import Control, Load, check_control
from jaxcontact.inputs.grid import Grid, check_grid
from jaxcontact.inputs.layers import LayeredHalfSpace, checked_body
from jaxcontact.operators.kernels import Errors, Kernels, check_kernels, check_stiffness, compiled_build
from jaxcontact.response.body import response_of
from jaxcontact.response.stack import solids
from jaxcontact.results.contact import ContactStep, marked
from jaxcontact.results.notes import Diagnostics, announce

Save = str | Callable[[ContactStep], Any]
LOOSEST = 1e-2  # tolerance


@dataclass(frozen=True)
class Options:
    """What is static in a run; the meaning of each stands in ``indent``."""

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
    """What is to be computed, checked: SI units, float64; valid: None, or whether traced values are in range.

    thicknesses: of layers that grow or wear, over times, (nt, layers) [m]; None: they stay as they are.
    """

    body: LayeredHalfSpace
    indenter: Indenter
    control: Control
    times: Array
    grid: Grid
    tolerance: Array
    max_iterations: Array
    kernels: Kernels | None
    valid: Array | None
    options: Options = static()
    thicknesses: Array | None = None

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
        **options: Any,
    ) -> Experiment:
        """Check all that verbs have in common; ValueError for what cannot be computed."""
        body, valid = checked_body(body)
        valid = valid & check_grid(grid) & checked_indenter(indenter, grid)
        valid = valid & checks.not_decreasing("times [s]", times) & check_control(control, np.shape(times)[0])
        valid = valid & checks.between("tolerance", tolerance, 0.0, LOOSEST)
        if is_concrete(max_iterations):
            checks.whole("max_iterations", np.asarray(max_iterations).item(), 1, 10**9)
        static_options = Options(**options)
        static_options.check()
        if kernels is not None:
            exact = static_options.correspondence == "exact"
            checks.require(exact, 'kernels: expected correspondence="exact" with them')
            valid = valid & check_kernels(kernels, grid)
        valid = valid & check_stiffness(body) & _can_be_dented(body, indenter, static_options.correspondence)
        valid = valid & _can_be_reached(control, indenter, grid)
        given = as_float64((body, indenter, control, times, grid, tolerance))
        known = None if valid is True else jnp.asarray(valid)
        return cls(*given, jnp.asarray(max_iterations, int), kernels, known, static_options)

    def also(self, verdict: Verdict) -> Experiment:
        """The experiment with one more condition on values that are not known yet."""
        if verdict is True:
            return self
        return replace(self, valid=jnp.asarray(verdict if self.valid is None else self.valid & verdict))

    def with_kernels(self) -> Experiment:
        """The experiment with its kernels built, unless they are given or the way of its march needs none."""
        if self.kernels is not None or self.options.correspondence != "exact":
            return self
        return replace(self, kernels=compiled_build(self.body, self.indenter, self.grid))

    @property
    def ready_kernels(self) -> Kernels:
        """Those given or built."""
        assert self.kernels is not None
        return self.kernels

    @property
    def load_controlled(self) -> bool:
        return isinstance(self.control, Load)

    @property
    def duration(self) -> Array:
        """From the first time to the last [s]."""
        return self.times[-1] - self.times[0]

    @property
    def edges(self) -> tuple[bool, bool]:
        """Whether contact at the sides of the grid across x, and across y, would go on beyond it."""
        along_x, along_y = (not self.indenter.fills_grid and not wraps for wraps in self.grid.periodic)
        return along_x, along_y

    def target(self, scale: Scale) -> Array:
        """The control, scaled: the sum of pressures or the approach."""
        return scale.from_si("load" if self.load_controlled else "approach", self.control.value)

    def plan(self, memory: Memory, inputs: Any, scale: Scale, errors: Errors) -> Plan:
        """Ready to march, with a memory and its inputs (nt, substeps, ...)."""
        profile = self.indenter.profile(self.grid) / scale.length
        setup = Setup(memory, profile, self.tolerance, self.max_iterations, self.load_controlled, self.edges)
        substeps = self.options.substeps
        targets = fine_values(jnp.broadcast_to(self.target(scale), self.times.shape), substeps)
        steps = Steps(fine_steps(self.times, substeps), targets, inputs)
        return Plan(setup, steps, scale, errors)


def _can_be_dented(body: LayeredHalfSpace, indenter: Indenter, correspondence: str) -> Verdict:
    """A surface with J(0) = 0 needs an elastic indenter, and, as a film, the quasi-elastic way; a bulk modulus the exact."""
    bulky = any(solid.bulk_modulus is not None for solid in solids(body))
    checks.require(
        correspondence == "exact" or not bulky,
        f'correspondence: expected "exact" with a bulk modulus, got "{correspondence}": it would be 5 % off',
    )
    response = response_of(body)
    rigid = response.rigid_at_first()
    alone, film = indenter.material is None, response.film() is not None and correspondence == "exact"
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


def _can_be_reached(control: Control, indenter: Indenter, grid: Grid) -> Verdict:
    """On a periodic grid the mean of the surface stays where it is, and so does the mean gap."""
    if isinstance(control, Load) or not all(grid.periodic):
        return True
    highest = jnp.mean(indenter.profile(grid))
    inside = jnp.max(jnp.asarray(control.value)) < highest
    if not is_concrete(control, highest):
        return inside
    checks.require(
        bool(inside),
        f"Approach [m]: expected less than {float(highest):g} on a periodic grid, the mean gap at first touch, got"
        f" {float(np.max(control.value)):g}: the surface does not sink in the mean, and is all in contact there",
    )
    return True


def fine_steps(times: Array, substeps: int) -> Array:
    """The inner steps [s], (nt, substeps); the first row has no length."""
    before = jnp.append(times[:1], times[:-1])
    return (times - before)[:, None] / substeps * jnp.ones(substeps)


def fine_values(values: Array, substeps: int) -> Array:
    """Values (nt,) at the ends of the inner steps, (nt, substeps), linear between times."""
    before = jnp.append(values[:1], values[:-1])
    share = jnp.arange(1, substeps + 1) / substeps
    return before[:, None] + (values - before)[:, None] * share


@pytree
class Plan:
    """A march to be made: its setup, its steps (nt, substeps), its scale, and the errors of its kernels."""

    setup: Setup
    steps: Steps
    scale: Scale
    errors: Errors

    def march(self, options: Options) -> tuple[Outcome, Outcome]:
        """From rest: the outcomes of all times, with what ``options.save`` keeps, and the last one whole."""
        return marching.march_from_rest(self.setup, self.steps, self.kept(options.save), options.checkpoint)

    def kept(self, save: Save) -> marching.Keep:
        """What a march keeps of an outcome: all of it, its scalars, or what a function makes of it in SI."""
        if save == "all":
            return lambda outcome: outcome
        value = (lambda outcome: save(self.seen(outcome))) if callable(save) else lambda outcome: None
        return lambda outcome: outcome._replace(pressure=None, displacement=None, saved=value(outcome))

    def seen(self, outcome: Outcome) -> ContactStep:
        """An outcome in SI, for a user's function."""
        fields = {k: v for k, v in outcome._asdict().items() if k not in ("saved", "more")}
        gap = self.setup.profile + outcome.displacement - outcome.approach
        return ContactStep(**self.scale.to_si(gap=gap, **fields))

    def history(self, grid: Grid, times: Array, outcomes: Outcome, last: Outcome) -> dict[str, Any]:
        """The fields of a ``ContactHistory``, from outcomes over times; fields of the last where not kept."""
        fields = outcomes if outcomes.pressure is not None else last
        given = outcomes._replace(pressure=fields.pressure, displacement=fields.displacement)._asdict()
        saved, _ = given.pop("saved"), given.pop("more")
        in_si = self.scale.to_si(profile=self.setup.profile, **given)
        return {"times": times, "grid": grid, "saved": saved, **in_si}


def finished(result: Any, errors: Errors, experiment: Experiment) -> Any:
    """Return a result with the diagnostics that its notes need, nan throughout where values were out of range."""
    single = jnp.asarray(not isinstance(experiment.indenter, HeightField))
    told = Diagnostics(errors.separation, errors.images, single, jnp.zeros((), int))
    return marked(replace(result, status=_doubted(result, errors), diagnostics=told), experiment.valid)


def reported(result: Any, errors: Errors, experiment: Experiment) -> Any:
    """Return a finished result, and issue its notes as warnings to the caller of the verb."""
    result = finished(result, errors, experiment)
    announce(result, stacklevel=3)
    return result


def _doubted(result: Any, errors: Errors) -> Array:
    """Return the status, with the steps marked that are known to be off; a steady state lasts as long as its grid passes."""
    if hasattr(result, "times"):
        return doubted(result.status, result.times - result.times[0], errors)
    speed = jnp.sqrt(jnp.sum(jnp.asarray(result.velocity) ** 2))
    width = jnp.max(jnp.stack(result.grid.width))
    return doubted(result.status, width / jnp.where(speed > 0.0, speed, 1.0), errors)


def doubted(status: Array, elapsed: Array, errors: Errors) -> Array:
    """Return the status, with those marked that are fine but for a response known to be off by more than 1 %."""
    off = (jnp.maximum(errors.separation, errors.images) > LARGEST_ERROR) | (elapsed > errors.horizon)
    return jnp.where(off & (status == Status.FINE), int(Status.NOT_RESOLVED), status)
