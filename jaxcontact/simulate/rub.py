"""Rubbing: an indenter pressed and rubbed on a film that forms and wears in the contact, in place or along a path.

The public function ``rub``, and ``RubExperiment``, its checked arguments and the plan of its march. The step in time, with
the growth of the film, is ``history.growth_step``, and the laws of growth and wear are in ``bodies.laws``.
"""

from __future__ import annotations

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace, static
from jaxcontact._support.status import LARGEST_ERROR
from jaxcontact.bodies.body import LayeredHalfSpace, ThicknessMap, over_the_plane, separate_map
from jaxcontact.bodies.controls import Control, check_friction
from jaxcontact.bodies.grid import Grid, MovedGrid
from jaxcontact.bodies.laws import (
    Adhesion,
    SumOfLaws,
    Thermal,
    check_law,
    check_thermal,
    is_sheared,
    temperatures_of,
)
from jaxcontact.history.growth_step import Heated, RubStep, RubStepper, Track, check_path
from jaxcontact.history.memory import Memory, RecursiveMemory, VaryingMemory, with_indenter
from jaxcontact.history.motion import (
    as_array,
    check_shape_of_velocity,
    mean_speed,
    over_times,
    speed_of,
)
from jaxcontact.history.time_loop import at_fine_times, fine_steps, fine_values
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.operators import spectral
from jaxcontact.operators.heat import coefficients_at_rest
from jaxcontact.operators.kernels import build_varying
from jaxcontact.response.stack import creeps, solids
from jaxcontact.results.contact import RubbedStep, RubbingHistory
from jaxcontact.results.notes import announce
from jaxcontact.simulate.run import (
    Experiment,
    Plan,
    Save,
    marched,
    profile_over_film,
    refined,
)

REACH = 0.125  # least thickness, in cells, up to which a film that may grow has kernels


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
    hardness: Array | float | None = None,
    adhesion: Adhesion | None = None,
    shear_strength: Array | float | None = None,
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
            them; the speed is that along the path. The indenter is a ``Sphere``, ``Ellipsoid``, ``Cone`` or ``Cylinder``,
            the grid holds the whole track, and along a periodic axis the path may go around, as on a disc. A step by more
            than a quarter of the half-width of the contact has status 12; at a tenth the depth that Archard's law leaves
            after a single passage is accurate to about 1 %, and its sum over the cells is exact; laws that do not vanish at
            the edge of the contact deviate by up to 5 % at single cells. ``thermal`` is for rubbing in place. With
            wears="indenter" the body neither creeps nor yields, fields are those in the frame of the indenter, which may
            have any shape, and nothing of the track is kept.
        law: rate of change of the thickness: ``StressActivated``, ``ProportionalRemoval``, ``Archard``, sums of them, or any
            frozen pytree with a method ``rate(step)`` that returns (nx, ny) [m/s], where step is an
            ``bodies.laws.RubbingState``. None: the thickness stays as it is, and the film creeps.
        friction: coefficient of friction, a number or (nx, ny), which gives the shear stress and the frictional heat; with
            ``thermal`` or a growth by shear stress it or ``shear_strength`` is above zero.
        wears: "film" if the law changes the thickness of the film on the body, "indenter" if it changes that of the coating
            of the indenter, one ``Layer`` on an ``Elastic`` substrate, or without a coating its profile.
        thermal: ``Thermal`` to compute the temperature of the surface, or None.
        thickest: largest thickness for which kernels are computed [m]; by default twice the initial one, and at least an
            eighth of a cell. The status is 13 if the film becomes thicker.
        substeps: number of inner steps between two times, static, or "auto", which repeats the run with 4, 16 and 64 of
            them until no step has status 12, ``step_error`` is below 1 % of the largest change of the thickness, and
            ``time_step_error`` below 1 %; there is a note if they are not with 64. "auto" cannot be used inside jit, vmap
            and grad.
        hardness: as in ``indent``, in the frame of the body: with ``path`` the dent is that of the track. With
            wears="indenter" it is of the body too. A film that wears keeps its dent, which wear deepens.
        adhesion: as in ``indent``. Growth, wear, friction and its heat depend on the pressure that the contact carries,
            the net pressure plus the attraction (``contact_pressure`` of the result), which is the pressure that a
            law is given.
        shear_strength: with adhesion, a shear stress tau [Pa] >= 0, a number or (nx, ny), of all of the contact, beside that
            of Coulomb's law: the shear stress that heats and that drives growth is mu p_c + tau where the surfaces touch.
            None for zero. The cells that touch count whole, as in ``shear``.
        indenter, control, times, grid, tolerance, max_iterations, save, checkpoint: as in ``indent``. An indenter that
            creeps or is coated is for rubbing in place, unless it is itself what wears.

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
    make = lambda count: RubExperiment.of(
        body, indenter, control, times, grid, substeps=count, velocity=velocity, law=law, path=path, friction=friction,
        wears=wears, thermal=thermal, thickest=thickest, tolerance=tolerance, max_iterations=max_iterations, save=save,
        checkpoint=checkpoint, hardness=hardness, adhesion=adhesion, shear_strength=shear_strength,
    )  # fmt: skip
    history: RubbingHistory = refined(_noted, make, substeps, _is_short)
    announce(history, stacklevel=2)
    return history


def _noted(rubs: RubExperiment) -> RubbingHistory:
    """Return the finished history, in place with its error relative to the largest change of the thickness."""
    history: RubbingHistory = marched(rubs)
    if rubs.moves:  # the sum of the largest errors of places far apart
        return history
    share = _share_of_change(history.step_error[-1], history.thickness, rubs.at_first)
    told = replace(history.diagnostics, relative_step_error=jax.lax.stop_gradient(share))
    return replace(history, diagnostics=told)


@jax.jit
def _share_of_change(error: Array, thickness: Array, at_first: Array) -> Array:
    """Return an error [m] over the largest change of the thickness (t, nx, ny), 0 without a change."""
    change = jnp.max(jnp.abs(thickness - at_first))
    return jnp.where(change > 0.0, error / jnp.where(change > 0.0, change, 1.0), 0.0)


def _is_short(rubs: RubExperiment, history: RubbingHistory) -> bool:
    """Return whether the error of the thickness by the time steps is below 1 % of its largest change."""
    change = float(jnp.max(jnp.abs(history.thickness - rubs.at_first)))
    return float(history.step_error[-1]) <= LARGEST_ERROR * change


@pytree
class RubExperiment(Experiment):
    """A rubbing; further fields as in ``rub``: velocity or path (nt, 2), the other None; thickest is a number."""

    velocity: Any
    path: Any
    law: Any
    friction: Any
    thermal: Thermal | None
    thickest: Any
    wears: str = static()
    exchanged: bool = static()

    @classmethod
    def of(  # type: ignore[override]
        cls,
        body: LayeredHalfSpace,
        indenter: Indenter,
        control: Control,
        times: Any,
        grid: Grid,
        *,
        velocity: Any = None,
        path: Any = None,
        law: Any = None,
        friction: Any = 0.0,
        thermal: Thermal | None = None,
        thickest: Any = None,
        shear_strength: Any = None,
        wears: str = "film",
        **given: Any,
    ) -> Self:
        """Check the arguments of ``rub``; given: further arguments of ``Experiment.of``."""
        # the film that wears; where the indenter does, any body
        film_map: ThicknessMap | None = None
        valid: checks.Verdict = True
        checks.one_of("wears", wears, "film", "indenter")
        moved, exchanged = body, False
        own = getattr(indenter, "material", None)
        if wears == "indenter" and isinstance(own, LayeredHalfSpace):
            # pressed together both surfaces are alike: the film on the indenter wears in the place of that on a body
            checks.require(
                isinstance(body, LayeredHalfSpace),
                f"body: expected a LayeredHalfSpace, got {type(body).__name__}",
            )
            body, indenter, exchanged = own, replace(indenter, material=body), True
        if wears == "film" or exchanged:
            body = over_the_plane(body, getattr(grid, "shape", ()))
            body, film_map, valid = separate_map(body, grid.shape, np.size(times))
            checks.require(
                film_map is not None and not film_map.over_times,
                f"{'indenter material' if exchanged else 'body'}: expected one Layer of a thickness that is a number or"
                " (nx, ny) in rub",
            )
        experiment = Experiment.of(
            body, indenter, control, times, grid, film_map=film_map, shear_strength=shear_strength, **given
        )
        if experiment.indenter.surface() is not None:
            moves, warms = (
                path is not None and wears == "film",
                thermal is not None and thermal.shift is not None,
            )
            checks.require(
                not (moves or warms),
                "indenter material: expected Elastic or None with path= and a film on the body, and with a shift in"
                f" thermal=, got {type(indenter.material).__name__}",
            )

        # the law, and the motion: a velocity in place, or positions (nt, 2)
        law, heated, count = SumOfLaws(()) if law is None else law, thermal is not None, np.shape(times)[0]
        valid = valid & check_law(law, heated=heated) & check_friction(friction, grid.shape)
        checks.require(
            (velocity is None) != (path is None),
            f"velocity: expected either velocity or path, got {'neither' if path is None else 'both'}",
        )
        if path is None:
            velocity = as_array(velocity)
            check_shape_of_velocity(velocity, count)
            valid = valid & checks.finite("velocity [m/s]", velocity) & check_thermal(thermal, grid, "rub")
        else:
            shape = np.shape(path)
            checks.require(
                shape in ((count,), (count, 2)),
                f"path [m]: expected shape ({count},) or ({count}, 2) as times, got {shape}",
            )
            valid = valid & checks.finite("path [m]", path)
            # known values stay so inside jit, where operations of jax trace them
            numbers: Any = np if is_concrete(path) else jnp
            path = numbers.asarray(path, float)
            path = numbers.stack([path, numbers.zeros(count)], -1) if path.ndim == 1 else path
            in_its_frame = wears == "indenter"
            valid = valid & check_thermal(thermal, grid, "rub")
            valid = valid & check_path(path, times, indenter, grid, in_its_frame=in_its_frame)
            checks.require(not heated, "path: expected None with thermal=, got positions")
            # in the frame of the indenter a body that does not creep, alike everywhere, is at rest in effect
            checks.require(
                not in_its_frame
                or not (any(map(creeps, solids(moved))) or given.get("hardness") is not None),
                'path: expected None with wears="indenter" on a body that creeps or yields, got positions',
            )
        stresses = friction, 0.0 if shear_strength is None else shear_strength
        rubs = not is_concrete(stresses) or any(np.any(np.asarray(each) > 0.0) for each in stresses)
        checks.require(
            rubs or not (heated or is_sheared(law)),
            "friction: expected a coefficient > 0 with thermal= or growth by shear stress, or shear_strength > 0 with"
            " adhesion, got 0",
        )

        # the thickness for which kernels are made, unless it is given
        if thickest is None and film_map is None:
            thickest = 1.0
        elif thickest is None:
            cell = grid.spacing[0] if grid.plane_strain else jnp.minimum(*grid.spacing)
            thickest = jnp.maximum(2.0 * jnp.max(film_map.values), REACH * cell)  # type: ignore[union-attr]
        valid = valid & checks.positive("thickest [m]", thickest)
        own = dict(
            velocity=velocity, path=path, law=law, friction=friction, thermal=thermal, thickest=thickest
        )
        return cls(**vars(experiment.also(valid)), **as_float64(own), wears=wears, exchanged=exchanged)

    @property
    def moves(self) -> bool:
        """True if the indenter moves over the grid, whose fields are then those of the body."""
        return self.path is not None and self.wears == "film"

    def with_kernels(self) -> Self:
        """Return the experiment with kernels for all thicknesses up to ``thickest``."""
        stays = isinstance(self.law, SumOfLaws) and not self.law.terms
        if self.film_map is None or stays:
            return super().with_kernels()
        thickness = jnp.stack([jnp.zeros(()), self.thickest])
        return replace(self, kernels=build_varying(self.body, self.indenter, self.grid, thickness))

    def planned(self) -> Plan:
        """Return the march: the memory of the body, the law with its heat, and the motion in the inner steps."""
        # the memory of the body, of a film that varies with a series in its thickness
        kernels, grid, substeps = self.kernels, self.grid, self.substeps
        memory: Memory
        if self.film_map is None:
            memory, scale = RecursiveMemory(kernels), kernels.scale
        else:
            memory, scale = VaryingMemory(kernels, self.film_map.values), kernels.scale
        memory = with_indenter(memory, kernels)

        # speed and length of way of the inner steps: in place from the velocity, else constant between two times
        dt, when = fine_steps(self.times, substeps), fine_values(self.times, substeps)
        time_fields = {"times": self.times} | self.tabor_number
        if self.path is None:
            start, end = at_fine_times(over_times(self.velocity, self.times), substeps)
            before, after, mean = speed_of(start), speed_of(end), mean_speed(start, end)
            ends = (before + after) / 2.0
            share = jnp.where(ends > 0.0, mean / jnp.where(ends > 0.0, ends, 1.0), 1.0)
            motion, track = RubStep(dt, share * before, share * after, share, when), None
        else:
            places = fine_values(self.path, substeps)
            flat = places.reshape(-1, 2)
            move = (flat - jnp.concatenate([flat[:1], flat[:-1]])).reshape(places.shape)
            speed = speed_of(move) / jnp.where(dt > 0.0, dt, jnp.inf)
            motion, track = RubStep(dt, speed, speed, jnp.ones_like(speed), when), None
            if self.moves:
                motion = motion._replace(position=places, move=move)
                track = Track(self.indenter, grid, self.path[0], scale.length)
                time_fields["position"] = self.path

        # the temperature that the heat of friction causes
        heated, thermal = None, self.thermal
        if thermal is not None:
            rises = coefficients_at_rest(grid.shape, grid.spacing) / thermal.conductivity
            response = spectral.kernel_spectrum(rises)
            heated = Heated(response, thermal.ambient, thermal.share, thermal.shift)
        stepper = RubStepper(
            memory,
            **self.stepper_arguments(scale),
            kinetics=self.law,
            friction=self.friction,
            strength=self.shear_strength,
            at_first=self.at_first,
            thickest=self.thickest,
            scale=scale,
            heated=heated,
            track=track,
            of_film=self.wears == "film" or self.exchanged,
            exchanged=self.exchanged,
        )
        errors = kernels.errors(self.duration)
        fixed_fields: dict[str, Any] = {"grid": grid}
        if self.wears == "indenter":
            fixed_fields["initial_indenter_film"] = self.at_first
        steps = self.steps(scale, motion)
        return Plan(stepper, steps, scale, errors, time_fields, fixed_fields, RubbingHistory, RubbedStep)

    @property
    def at_first(self) -> Array:
        """The thickness at the first time [m], (nx, ny); of an indenter that wears zero."""
        return jnp.zeros(self.grid.shape) if self.film_map is None else self.film_map.values

    @property
    def temperatures(self) -> list[Any]:
        return temperatures_of(self.law) + ([] if self.thermal is None else [self.thermal.ambient])

    @property
    def profile(self) -> Array:
        """As of every experiment; with a path at its first position."""
        if not self.moves:
            return super().profile
        grid, first = self.grid, tuple(self.path[0])
        moved = MovedGrid(grid.shape, grid.spacing, grid.periodic, first)
        return profile_over_film(self.indenter, moved, self.film_map)
