"""Rubbing: an indenter pressed and rubbed on a film that its contact makes and takes away, in place or along a path."""

from __future__ import annotations

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace, static
from jaxcontact._support.scale import Scale
from jaxcontact._support.status import LARGEST_ERROR
from jaxcontact.bodies.body import LayeredHalfSpace, ThicknessMap, over_the_plane, separate_map
from jaxcontact.bodies.controls import Control, check_friction
from jaxcontact.bodies.grid import Grid, MovedGrid
from jaxcontact.bodies.laws import SumOfLaws, Thermal, check_law, check_thermal, is_sheared, temperatures_of
from jaxcontact.history.growth_step import Heated, RubStep, RubStepper, Track, check_path
from jaxcontact.history.memory import Memory, RecursiveMemory, VaryingMemory
from jaxcontact.history.motion import as_array, at_fine_times, mean_speed, over_times, speed_of
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.operators import spectral
from jaxcontact.operators.heat import coefficients_at_rest
from jaxcontact.operators.kernels import compiled_varying
from jaxcontact.results.contact import RubbedStep, RubbingHistory
from jaxcontact.results.notes import announce
from jaxcontact.simulate.experiment import (
    ContactSetup,
    Experiment,
    Options,
    Plan,
    Save,
    Settings,
    TimedExperiment,
    fine_steps,
    fine_values,
    profile_over_film,
)
from jaxcontact.simulate.run import marched, refined

REACH = 0.125  # cells: a film that may grow has kernels up to this thickness at least


def rub(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    times: Array,
    *,
    velocity: Array | float | None = None,
    law: Any,
    grid: Grid,
    path: Array | None = None,
    friction: Array | float = 0.0,
    wears: str = "film",
    thermal: Thermal | None = None,
    thickest: Array | float | None = None,
    tolerance: Array | float = 1e-8,
    max_iterations: Array | int = 500,
    save: Save = "all",
    substeps: int | str = 1,
    checkpoint: str = "pressures",
) -> RubbingHistory:
    """Compute the growth and wear of a film, or the wear of an indenter, in a contact that is rubbed.

        dh/dt = law(p, h, T, v),      h >= 0

    at each point. The pressure p is that of the contact on the film with its present thickness, including its creep and its
    relief. With ``velocity`` the film does not move relative to the indenter. With ``path`` the indenter moves over the
    body, once, repeatedly or back and forth, and leaves a wear track: all fields, thickness and creep included, are those of
    the body, which stays in place on the grid. New film material is free of strain at the pressure under which
    it forms, and the removal of material causes no displacement (``history.memory``). The effect of friction on the
    pressure is neglected.

    Thickness and pressure are consistent with each other to second order in the time step (``history.growth_step``). Removal
    in proportion to the thickness is exact for steps of any length; otherwise the method is explicit. ``step_error`` of the
    result is an estimate of the error, and a step that is too long for the law has status 12. The step is usually limited
    by wear at the scale of a cell: the wear coefficient x |velocity| x dt must be less than about twice the displacement of
    a cell per unit of pressure on it, with its neighbours held.

    Derivatives are those of the discrete steps. After a step of status 12, in which small changes grow without bound, they
    are those with the state after this step held: as finite as the values, and as little to be relied on.

    Args:
        body: one ``Layer`` on an ``Elastic`` substrate, with a thickness >= 0, a number or (nx, ny); with wears="indenter"
            any body whose layers have one thickness each.
        velocity: rubbing velocity [m/s]: a number, (2,), or (nt, 2) over the times, linear between them; only its
            magnitude matters. Either this or ``path``.
        path: position of the indenter's axis on the grid [m] over the times, (nt,) along x or (nt, 2), linear between
            them; the speed is that along the path. The indenter is a ``Sphere``, ``Cone`` or ``Cylinder``, the grid holds
            the whole track, and along a periodic axis the path may go around, as on a disc. A step by more than a quarter
            of the half-width of the contact has status 12; at a tenth the depth that Archard's law leaves after a single
            passage is accurate to about 1 %, and its sum over the cells is exact; laws that do not vanish at the edge of the
            contact deviate by up to 5 % at single cells. ``thermal`` and wears="indenter" are for rubbing in place.
        law: rate of change of the thickness: ``StressActivated``, ``ProportionalRemoval``, ``Archard``, sums of them, or any
            frozen pytree with a method ``rate(step)`` that returns (nx, ny) [m/s], where step is an
            ``inputs.laws.RubbingState``. None: the thickness stays as it is, and the film creeps.
        friction: coefficient of friction, a number or (nx, ny), which gives the shear stress and the frictional heat; above
            zero with ``thermal`` or a growth by shear stress.
        wears: "film" if the law changes the thickness of the film, "indenter" if it changes the profile of the indenter.
        thermal: ``Thermal`` to compute the temperature of the surface, or None.
        thickest: largest thickness for which kernels are computed [m]; by default twice the initial one, and at least an
            eighth of a cell. The status is 13 if the film becomes thicker.
        substeps: number of inner steps between two times, static, or "auto", which repeats the run with 4, 16 and 64 of
            them until no step has status 12, ``step_error`` is below 1 % of the largest change of the thickness, and
            ``time_step_error`` below 1 %; there is a note if they are not with 64. "auto" cannot be used inside jit, vmap
            and grad.
        indenter, control, times, grid, tolerance, max_iterations, save, checkpoint: as in ``indent``.

    Returns:
        A ``RubbingHistory``; status, notes and warnings are as in ``indent``.

    Raises:
        ValueError: invalid or unsupported input, before the computation starts.

    Example:
        >>> film = jc.Layer(jc.Elastic(G=1e9, nu=0.3), thickness=100e-9)
        >>> body = jc.LayeredHalfSpace([film], substrate=jc.Elastic.from_young(210e9))
        >>> grid, times = jc.Grid.square(n=24, width=200e-6), [0.0, 50.0, 100.0]
        >>> worn = jc.rub(body, jc.Sphere(5e-3), jc.Load(5.0), times, velocity=0.1, law=jc.Archard(4e-18), grid=grid)
        >>> volume = (worn.thickness[0] - worn.thickness[-1]).sum() * grid.cell_area
        >>> f"{volume * 1e18:.1f} um3"                     # 4e-18/Pa x 5 N x 10 m
        '200.0 um3'
    """
    setup, options = ContactSetup(body, indenter, control, times, grid), Options(save, checkpoint=checkpoint)
    settings = Settings(tolerance, max_iterations, options=options)
    conditions = RubConditions(velocity, path, law, friction, thermal, thickest, wears)
    make = lambda settings: RubExperiment.of(setup, settings, conditions)
    history: RubbingHistory = refined(make, settings, substeps, _noted, _is_short)
    announce(history, stacklevel=2)
    return history


def _noted(rubs: RubExperiment) -> RubbingHistory:
    """Return the finished history, in place with its error relative to the largest change of the thickness."""
    history: RubbingHistory = marched(rubs)
    if not rubs.conditions.in_place:  # the sum of the largest errors of places far apart
        return history
    change = jnp.max(jnp.abs(history.thickness - rubs.at_first))
    share = jnp.where(change > 0.0, history.step_error[-1] / jnp.where(change > 0.0, change, 1.0), 0.0)
    told = replace(history.diagnostics, relative_step_error=jax.lax.stop_gradient(share))
    return replace(history, diagnostics=told)


def _is_short(rubs: RubExperiment, history: RubbingHistory) -> bool:
    """Return whether the error of the thickness by the time steps is below 1 % of its largest change."""
    change = float(jnp.max(jnp.abs(history.thickness - rubs.at_first)))
    return float(history.step_error[-1]) <= LARGEST_ERROR * change


@pytree
class RubConditions:
    """The motion of a rubbed contact, the law of growth or wear, and friction and heat; fields as in ``rub``."""

    velocity: Any = None
    path: Any = None
    law: Any = None
    friction: Any = 0.0
    thermal: Thermal | None = None
    thickest: Any = None
    wears: str = static(default="film")

    @property
    def in_place(self) -> bool:
        """True if the film does not move relative to the indenter."""
        return self.path is None

    def checked(self, setup: ContactSetup) -> tuple[Self, Verdict]:
        """Return the conditions with positions of shape (nt, 2) and a law, and whether traced values are in range."""
        law, heated = SumOfLaws(()) if self.law is None else self.law, self.thermal is not None
        valid = check_law(law, heated=heated) & check_friction(self.friction, setup.grid.shape)
        velocity, path, moves = _motion(self.velocity, self.path, np.shape(setup.times)[0])
        valid = valid & moves & check_thermal(self.thermal, setup.grid, "rub")
        if path is not None:
            valid = valid & check_path(path, setup.times, setup.indenter, setup.grid)
            plain = self.wears == "film" and not heated
            checks.require(plain, 'path: expected None with thermal= or wears="indenter", got positions')
        rubs = not is_concrete(self.friction) or bool(np.any(np.asarray(self.friction) > 0.0))
        checks.require(
            rubs or not (heated or is_sheared(law)),
            "friction: expected a coefficient > 0 with thermal= or growth by shear stress, got 0",
        )
        return replace(self, velocity=velocity, path=path, law=law), valid


@pytree
class RubExperiment(TimedExperiment):
    """A rubbing under ``conditions``, whose ``thickest`` is a number and whose path is None or (nt, 2)."""

    conditions: RubConditions

    @classmethod
    def of(  # type: ignore[override]
        cls, setup: ContactSetup, settings: Settings, conditions: RubConditions
    ) -> Self:
        body, film_map, valid = _film(setup.body, conditions.wears, setup.grid, np.size(setup.times))
        experiment = Experiment.of(replace(setup, body=body), settings, film_map=film_map)
        conditions, in_range = conditions.checked(setup)
        if conditions.thickest is None:
            conditions = replace(conditions, thickest=_reach(film_map, setup.grid))
        valid = valid & in_range & checks.positive("thickest [m]", conditions.thickest)
        return cls(**vars(experiment.also(valid)), conditions=as_float64(conditions))

    def with_kernels(self) -> Self:
        """Return the experiment with kernels for all thicknesses up to ``thickest``."""
        stays = isinstance(self.conditions.law, SumOfLaws) and not self.conditions.law.terms
        if self.film_map is None or stays:
            return super().with_kernels()
        thickness = jnp.stack([jnp.zeros(()), self.conditions.thickest])
        return replace(self, kernels=compiled_varying(self.body, self.indenter, self.grid, thickness))

    def planned(self) -> Plan:
        """Return the march of the rubbing."""
        memory, scale, errors = self._memory()
        course = {} if self.conditions.in_place else {"position": self.conditions.path}
        stepper = RubStepper(
            memory,
            **self.contact(scale),
            kinetics=self.conditions.law,
            friction=self.conditions.friction,
            at_first=self.at_first,
            thickest=self.conditions.thickest,
            scale=scale,
            heated=self._heated(),
            track=self._track(scale),
            of_film=self.conditions.wears == "film",
        )
        return self.plan(stepper, self._inputs(), scale, errors).to(RubbingHistory, RubbedStep, course=course)

    @property
    def at_first(self) -> Array:
        """The thickness at the first time [m], (nx, ny); of an indenter that wears zero."""
        return jnp.zeros(self.grid.shape) if self.film_map is None else self.film_map.values

    @property
    def temperatures(self) -> list[Any]:
        law, thermal = self.conditions.law, self.conditions.thermal
        return temperatures_of(law) + ([] if thermal is None else [thermal.ambient])

    @property
    def profile(self) -> Array:
        """As of every experiment; with a path at its first position."""
        if self.conditions.in_place:
            return super().profile
        grid, first = self.grid, tuple(self.conditions.path[0])
        moved = MovedGrid(grid.shape, grid.spacing, grid.periodic, first)
        return profile_over_film(self.indenter, moved, self.film_map)

    def _track(self, scale: Scale) -> Track | None:
        """Return the way of the indenter, None where it stays in place."""
        path = self.conditions.path
        return None if path is None else Track(self.indenter, self.grid, path[0], scale.length)

    def _memory(self) -> tuple[Memory, Scale, Any]:
        if self.film_map is None:
            kernels = self.ready_kernels
            return RecursiveMemory(kernels), kernels.scale, kernels.errors(self.duration)
        varying = self.varying_kernels
        memory = VaryingMemory(varying, self.film_map.values)
        return memory, varying.scale, varying.errors(self.duration)

    def _inputs(self) -> RubStep:
        """Return the further input of the steps, (nt, substeps)."""
        substeps = self.options.substeps
        if not self.conditions.in_place:
            return self._along(self.conditions.path, substeps)
        assert self.conditions.velocity is not None
        start, end = at_fine_times(over_times(self.conditions.velocity, self.times), substeps)
        before, after, mean = speed_of(start), speed_of(end), mean_speed(start, end)
        ends = (before + after) / 2.0
        share = jnp.where(ends > 0.0, mean / jnp.where(ends > 0.0, ends, 1.0), 1.0)
        steps, when = fine_steps(self.times, substeps), fine_values(self.times, substeps)
        return RubStep(steps, share * before, share * after, share, when)

    def _along(self, path: Array, substeps: int) -> RubStep:
        """Return the further input of the steps along a path, at a constant velocity between two times."""
        steps, when = fine_steps(self.times, substeps), fine_values(self.times, substeps)
        ends = fine_values(path, substeps)
        flat = ends.reshape(-1, 2)
        move = (flat - jnp.concatenate([flat[:1], flat[:-1]])).reshape(ends.shape)
        speed = speed_of(move) / jnp.where(steps > 0.0, steps, jnp.inf)
        return RubStep(steps, speed, speed, jnp.ones_like(speed), when, ends, move)

    def _heated(self) -> Heated | None:
        thermal = self.conditions.thermal
        if thermal is None:
            return None
        rises = coefficients_at_rest(self.grid.shape, self.grid.spacing) / thermal.conductivity
        return Heated(spectral.kernel_spectrum(rises), thermal.ambient, thermal.share, thermal.shift)


def rubbed(setup: ContactSetup, settings: Settings, **conditions: Any) -> RubExperiment:
    """Return the checked experiment of conditions that are given by the names of the arguments of ``rub``."""
    return RubExperiment.of(setup, settings, RubConditions(**conditions))


def _film(
    body: LayeredHalfSpace, wears: str, grid: Grid, count: int
) -> tuple[LayeredHalfSpace, ThicknessMap | None, Verdict]:
    """Return the body, the thickness of the film that wears (None where the indenter does), and whether it is in range."""
    checks.one_of("wears", wears, "film", "indenter")
    if wears == "indenter":
        return body, None, True
    body = over_the_plane(body, getattr(grid, "shape", ()))
    body, film_map, valid = separate_map(body, grid.shape, count)
    checks.require(
        film_map is not None and not film_map.over_times,
        "body: expected one Layer of a thickness that is a number or (nx, ny) in rub",
    )
    return body, film_map, valid


def _motion(velocity: Any, path: Any, count: int) -> tuple[Any, Any, Verdict]:
    """Return velocity and path (count, 2), one of them None, and whether they are in range."""
    checks.require(
        (velocity is None) != (path is None),
        f"velocity: expected either velocity or path, got {'neither' if path is None else 'both'}",
    )
    if path is None:
        velocity = as_array(velocity)
        return velocity, None, _check_velocity(velocity, (count,))
    shape = np.shape(path)
    checks.require(
        shape in ((count,), (count, 2)),
        f"path [m]: expected shape ({count},) or ({count}, 2) as times, got {shape}",
    )
    # known values stay so inside jit, where operations of jax trace them
    numbers: Any = np if is_concrete(path) else jnp
    along_x = numbers.asarray(path, float)
    both = numbers.stack([along_x, numbers.zeros(count)], -1) if along_x.ndim == 1 else along_x
    return None, both, checks.finite("path [m]", path)


def _check_velocity(velocity: Any, times: tuple[int, ...]) -> Verdict:
    shape, nt = np.shape(velocity), times[0]
    checks.require(
        shape in ((), (2,), (nt, 2)),
        f"velocity: expected a number, shape (2,) or ({nt}, 2) as times, got shape {shape}",
    )
    return checks.finite("velocity [m/s]", velocity)


def _reach(film_map: ThicknessMap | None, grid: Grid) -> Array | float:
    """Return the thickness for which kernels are made unless it is given [m]."""
    if film_map is None:
        return 1.0
    cell = grid.spacing[0] if grid.plane_strain else jnp.minimum(*grid.spacing)
    return jnp.maximum(2.0 * jnp.max(film_map.values), REACH * cell)
