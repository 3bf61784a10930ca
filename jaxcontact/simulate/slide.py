"""Sliding in time: an indenter that moves over the body, in any direction and at any speed.

From the top: the public function ``slide``; ``Sliding``, its checked arguments and the plan of its march; and
``SlideStepper``, the step of ``history.normal_step`` with heat and the statuses of sliding. The mathematics of a body that
moves past the contact is in ``history.memory`` (``MovingMemory``).
"""

from __future__ import annotations

from dataclasses import field
from functools import partial
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.fields import Scale
from jaxcontact._support.pytree import as_float64, pytree, replace
from jaxcontact._support.status import Status, most_serious
from jaxcontact.bodies.body import LayeredHalfSpace
from jaxcontact.bodies.controls import Control
from jaxcontact.bodies.grid import Grid
from jaxcontact.bodies.laws import (
    Adhesion,
    Thermal,
    check_thermal,
)
from jaxcontact.contact.law import Hardness
from jaxcontact.history.growth_step import Heated, in_reduced_time, reduced
from jaxcontact.history.memory import BothSurfaces, Memory, Motion, Way, moving_memory, with_indenter
from jaxcontact.history.motion import (
    FARTHEST,
    as_array,
    carried_past,
    check_shape_of_velocity,
    check_sliding_friction,
    checked_track,
    departures,
    directions,
    moves,
    over_times,
    speed_of,
)
from jaxcontact.history.normal_step import AdhesionState, PressCarry, PressStepper, plane_strain
from jaxcontact.history.time_loop import Bent, Lapse, Outcome, Steps, fine_steps, in_radii
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.operators import spectral
from jaxcontact.operators.heat import Solid, rise_coefficients
from jaxcontact.operators.kernels import Kernels, friction_kernels, friction_kernels_of_indenter, joint_errors
from jaxcontact.response.tangential import tangential_expansion
from jaxcontact.results.contact import SlidingHistory, adhesive_sliding_history, sliding_history
from jaxcontact.results.notes import announce
from jaxcontact.simulate.run import Experiment, Plan, Save, marched, refined
from jaxcontact.simulate.temperature import check_peclet

TRUNCATION_LIMIT = 0.01  # largest truncation bound, over the largest approach so far


def slide(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    times: Array,
    *,
    velocity: Array | float,
    grid: Grid,
    tolerance: Array | float = 1e-8,
    max_iterations: Array | int = 500,
    save: Save = "all",
    substeps: int | str = 1,
    kernels: Kernels | None = None,
    checkpoint: str = "pressures",
    friction: Array | float | None = None,
    thermal: Thermal | None = None,
    adhesion: Adhesion | None = None,
    hardness: Array | float | None = None,
    shear_strength: Array | float | None = None,
) -> SlidingHistory:
    """Compute the contact of an indenter that slides over a body, over time.

        u(x, t) = int_0^t K(x + X(t) - X(s), t - s) * dp(x, s),   g = profile + u - approach >= 0,  p >= 0,  p g = 0

    in the frame of the indenter, whose position over the body is X(t) = int velocity dt.

    The indenter may move by up to half the width of the grid in an inner step; use more ``substeps`` for longer steps. A
    steady pressure is convected without error for any step length. Otherwise the error is of second order in the step,
    which should be well below the contact radius while the pressure changes (with a step of 0.45 widths the initial
    error is about 10 %).

    The deformation that remains on the grid behind the indenter is included, also when the indenter returns to it. For
    a reversing motion the grid must be twice as wide as the sum of the stroke and the contact radius. The part of the
    history that leaves the grid is neglected, and the field ``truncation_bound`` of the result is a bound on its
    effect. The effect is negligible for a film (with a grid of twice the width the peak pressure changes by 1e-5), but
    is 4 % of peak pressure and approach for a half-space of the film's material in Wang et al. (Tribology Letters 2025,
    Table 4) after 4 h at 0.4 um/s on a grid of 5 mm. A track that leaves the grid and returns is rejected. If the
    contact returns to a place where history was neglected, the step has status 5.

    With friction, the traction mu p along the velocity also causes normal displacement and changes the pressure; see
    ``slide_steady``.

    The surface of an indenter that creeps or is coated is at rest in its own frame: it creeps as in ``indent``, and once
    relaxed takes no part in the hysteresis force. Powers and energies of the result are those of the body alone. With
    friction it remembers the traction, too, which moves its surface and that of the body in opposite directions.

    On a grid that is periodic along both axes no history leaves the grid. A step may then have any length, and the
    indenter encounters the tracks of its periodic images. In plane strain the velocity has one component.

    With ``thermal`` the temperature of the surface is the steady flash temperature under the present heat of friction, which
    moves over the body with the indenter. Its mean over the contact changes the times of the body, if ``thermal`` has a
    shift: one factor for the whole body.

    With adhesion, as in ``indent``, Coulomb's friction is mu times the pressure that contact carries, the net pressure
    plus the attraction (``contact_pressure`` of the result), beside a shear strength of the contact. Attraction at the
    rear edge, where the surfaces part, is resisted by a body that has had time to relax, and the edge dissipates
    energy: the hysteresis force is then that of the whole pressure, contact less attraction. Steps should move the
    indenter by a part of the zone of attraction. Each step solves contacts of the symmetric part of its response in
    turn (``contact.adhesive``), which converges for an E0/Einf of up to 10 whatever the step; beyond, the status of a
    long step may be 1, and more ``substeps`` help.

    With ``hardness``, as in ``indent``, the dent stays behind in the track: it moves through the frame of the indenter with
    the body, and the part that leaves the grid is lost. It is interpolated between cells (``history.motion.carried_past``),
    without error for steps of whole cells. Steps should move the indenter by a part of its contact, whose imprints else stay
    apart. hysteresis_force then contains the force that ploughs the track, also on an elastic body, and power leaves out
    the power that the dents take, the hardness times the growth of their volume.

    A film whose thickness varies in the plane moves through the frame of the indenter, in which this function works; ``rub``
    with ``path`` computes its contact in the frame of the body, also without a law of growth or wear.

    Args:
        velocity: velocity of the indenter over the body [m/s]: a number (along x), (2,) for (vx, vy), or (nt, 2) over
            the times, linear between them. With a velocity along +x, the leading edge and the higher pressure are on the
            +x side. The motion starts with the load at times[0]. An inner step has the mean of the velocities at its ends;
            ``time_step_error`` includes the error that this causes.
        friction: as in ``slide_steady``, along the velocity at the end of each inner step.
        thermal: None, or ``Thermal`` with a diffusivity; friction is then > 0, the velocity constant, and the grid not
            periodic.
        adhesion: as in ``indent``; None for surfaces without attraction. It is None with ``thermal``.
        shear_strength: as in ``slide_steady``, with adhesion.
        hardness: as in ``indent``; a map (nx, ny) is that of the body under the grid at the first time, which beyond the
            grid is as at its edge.
        body, indenter, control, times, grid, tolerance, max_iterations, save, substeps, kernels, checkpoint: as
            in ``indent``. There is no ``correspondence``, since the convection of the history requires the common decay
            rates of the exact response.

    Returns:
        A ``SlidingHistory``, with adhesion an ``AdhesiveSlidingHistory``; status, notes and warnings are as in ``indent``.

    Raises:
        ValueError: invalid or unsupported input, before the computation starts.

    Example:
        >>> rubber = jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=1e6, G2=1e6, eta2=1e6, nu=0.5))
        >>> grid, times = jc.Grid.square(n=24, width=4e-3), [0.0, 1.0, 2.0]
        >>> history = jc.slide(rubber, jc.Sphere(5e-3), jc.Load(0.1), times, velocity=5e-4, grid=grid)
        >>> bool(history.tangential_force[-1] > 0.0)             # a force that resists the motion
        True
    """
    make = lambda count: Sliding.of(
        body, indenter, control, times, grid, substeps=count, tolerance=tolerance, max_iterations=max_iterations, save=save,
        kernels=kernels, checkpoint=checkpoint, velocity=velocity, friction=friction, thermal=thermal, adhesion=adhesion,
        hardness=hardness, shear_strength=shear_strength,
    )  # fmt: skip
    history: SlidingHistory = refined(marched, make, substeps)
    announce(history, stacklevel=2)
    return history


@pytree
class Sliding(Experiment):
    """A slide; velocity: as given to ``slide``; the others likewise, None without."""

    velocity: Array
    friction: Array | None
    thermal: Thermal | None

    @classmethod
    def of(  # type: ignore[override]
        cls,
        body: LayeredHalfSpace,
        indenter: Indenter,
        control: Control,
        times: Any,
        grid: Grid,
        *,
        velocity: Any,
        friction: Any = None,
        thermal: Any = None,
        adhesion: Any = None,
        shear_strength: Any = None,
        **given: Any,
    ) -> Self:
        """Check the arguments of ``slide``; given: further arguments of ``Experiment.of``."""
        checks.require(
            adhesion is None or thermal is None,
            "thermal: expected None with adhesion, got Thermal: the heat of the pressure that contact carries is available"
            " in rub alone",
        )
        friction = 0.0 if friction is None and shear_strength is not None else friction
        experiment = Experiment.of(
            body, indenter, control, times, grid, adhesion=adhesion, shear_strength=shear_strength, **given
        )
        velocity = as_array(velocity)
        valid = checked_track(velocity, times, experiment.grid, experiment.substeps)
        valid = valid & check_thermal(thermal, experiment.grid, "slide")
        if thermal is not None:
            # one factor for all times, by the law of the body's material
            checks.require(
                thermal.shift is None or experiment.indenter.surface() is None,
                "indenter material: expected Elastic or None with a shift in thermal=, got"
                f" {type(experiment.indenter.material).__name__}",
            )
            # heat: a velocity at which the temperature is steady, friction, and a diffusivity
            check_shape_of_velocity(velocity, where=" with thermal=, whose temperature is steady")
            checks.require(
                friction is not None,
                "friction: expected a coefficient with thermal=, got None, which makes no heat",
            )
            checks.require(
                thermal.diffusivity is not None,
                "Thermal diffusivity [m2/s]: expected a number in slide, got None",
            )
            valid = valid & check_peclet(experiment.grid, velocity, thermal.diffusivity)
        rubs = check_sliding_friction(friction, experiment.grid, experiment.body, experiment.indenter)
        own = as_float64({"velocity": velocity, "friction": friction, "thermal": thermal})
        return cls(**vars(experiment.also(valid & rubs)), **own)

    def planned(self) -> Plan:
        """Return the march: the memory of a moving body, the heat of friction, and the motion in the inner steps."""
        kernels, grid, substeps = self.kernels, self.grid, self.substeps
        scale: Scale = kernels.scale
        contact = self.stepper_arguments(scale)

        # the response, with that of the traction mu p if there is friction
        sheared_body, sheared_indenter = None, None
        friction, errors = jnp.zeros(()), kernels.errors(self.duration)
        if self.friction is not None:
            coefficient = self.friction if self.adhesion is None else jnp.ones(grid.shape)
            sheared_body = friction_kernels(
                tangential_expansion(self.body), self.indenter, grid, scale, coefficient
            )
            sheared_indenter = friction_kernels_of_indenter(self.indenter, grid, scale, coefficient)
            expansions = [each.expansion for each in (sheared_body, sheared_indenter) if each is not None]
            friction, errors = self.friction, joint_errors(kernels, *expansions, duration=self.duration)
        ratio, shear = grid.spacing[1] / grid.spacing[0], None
        if self.adhesion is not None and self.friction is not None:
            strength = jnp.zeros(()) if self.shear_strength is None else self.shear_strength
            shear = (friction, scale.from_si("pressure", strength))
        remembers = lambda kernels, sheared: replace(
            moving_memory(kernels, contact["profile"], ratio, sheared), shear=shear
        )
        of_body = remembers(kernels, sheared_body)
        memory: Memory = with_indenter(of_body, kernels)
        if sheared_indenter is not None:  # the indenter remembers the traction, too, at rest
            memory = BothSurfaces((of_body, remembers(kernels.indenter, sheared_indenter)))

        # the motion; on a periodic grid a step may have any length
        move = moves(self.velocity / scale.length, self.times, substeps)
        motion = Motion(
            fine_steps(self.times, substeps),
            move,
            directions(self.velocity, self.times, substeps),
            departures(self.velocity / scale.length, self.times, substeps),
        )
        farthest = jnp.full(2, jnp.inf)
        if not all(grid.periodic):
            nx, ny = grid.shape
            farthest = FARTHEST * jnp.stack([nx * jnp.ones(()), ny * ratio])

        # the flash temperature under a pressure, by a convolution with the rise under a cell, whose middle is the origin
        heating = None
        if self.thermal is not None and self.friction is not None:
            thermal, (nx, ny) = self.thermal, grid.shape
            solid = Solid(thermal.conductivity, thermal.diffusivity)
            rises = rise_coefficients(grid.shape, grid.spacing, self.velocity, solid)
            wrapped = jnp.zeros(spectral.padded_shape((nx, ny))).at[: 2 * nx - 1, : 2 * ny - 1].set(rises)
            wrapped = jnp.roll(wrapped, (1 - nx, 1 - ny), (0, 1))
            response = spectral.transform(wrapped, (True, True))
            heated = Heated(response, thermal.ambient, thermal.share, thermal.shift)
            speed = speed_of(over_times(self.velocity, self.times)[0])
            heating = Heating(heated, self.friction * speed * scale.unit("pressure"))

        stepper = SlideStepper(memory, **contact, farthest=farthest, heating=heating)
        time_fields = {
            "times": self.times,
            "velocity": over_times(self.velocity, self.times),
        } | self.tabor_number
        result_class = sliding_history if self.adhesion is None else adhesive_sliding_history
        fixed_fields = {"grid": grid, "friction": jnp.broadcast_to(friction, grid.shape)}
        if shear is not None:
            fixed_fields["shear_strength"] = jnp.broadcast_to(strength, grid.shape)
        return Plan(
            stepper, self.steps(scale, motion), scale, errors, time_fields, fixed_fields, result_class
        )

    @property
    def temperatures(self) -> list[Any]:
        return [] if self.thermal is None else [self.thermal.ambient]


@pytree
class Heating:
    """flux: heat of friction per area over a scaled pressure [W/m2], a number or (nx, ny)."""

    heated: Heated
    flux: Array


class SlideCarry(NamedTuple):
    """The carry: that of the contact; the largest approach so far; whether a step so far moved too far; time_shift: as
    ``Heated.shifted`` gives it, (3,); way: of the indenter so far [cells along x], None without a hardness that varies.
    """

    contact: PressCarry
    depth: Array
    far: Array
    time_shift: Array
    way: Way | None = None


@pytree
class SlideStepper(PressStepper):
    """A normal contact that moves over the body, and what makes its status that of a slide; farthest: the longest step along
    x and y that the scheme can bear [cells along x]."""

    farthest: Array = field(kw_only=True)
    heating: Heating | None = field(kw_only=True)

    def start(self) -> SlideCarry:  # type: ignore[override]
        varies = isinstance(self.law, Hardness) and self.law.limit.ndim == 2
        way = Way(jnp.zeros(()), jnp.zeros(())) if varies else None
        return SlideCarry(super().start(), jnp.zeros(()), jnp.zeros((), bool), jnp.zeros(3), way)

    def advance(  # type: ignore[override]
        self, carry: SlideCarry, step: Steps
    ) -> tuple[SlideCarry, Outcome]:
        if carry.contact.dent is not None:
            # the body moves through the frame: its dent, from step to step, and its hardness, by the whole way
            memory = self._of_body
            periodic = memory.kernels.family.periodic
            past = partial(carried_past, ratio=memory.ratio, periodic=periodic)
            dent = past(carry.contact.dent, step.more.move, beyond="constant")
            carry = carry._replace(contact=carry.contact._replace(dent=dent))
            if carry.way is not None:
                x, y = step.more.move
                carry = carry._replace(
                    way=Way(carry.way.x + x, carry.way.y if y is None else carry.way.y + y)
                )
                law = replace(self.law, limit=past(self.law.limit, carry.way, beyond="edge"))
                return replace(self, law=law)._slid(carry, step)
        return self._slid(carry, step)

    def _slid(self, carry: SlideCarry, step: Steps) -> tuple[SlideCarry, Outcome]:
        """Return the carry and the outcome of a step under the dent and the hardness at its end."""
        # 1. The step of the contact, with heat in reduced time, extrapolated from the temperature before the step.
        if self.heating is not None:
            motion = step.more._replace(dt=reduced(step.dt, carry.time_shift))
            contact, outcome = super().advance(carry.contact, step._replace(more=motion))
            # the temperature under the new pressure, the shift of time that it makes, and the power lost in real time
            heated, pressure = self.heating.heated, outcome.fields["pressure"]
            temperature = heated.temperature(self.heating.flux * pressure)
            time_shift = heated.shifted(carry.time_shift, temperature, pressure, step.dt)
            lost = outcome.numbers["hysteresis_power"] * jnp.exp(-time_shift[0])
            numbers = outcome.numbers | {"hysteresis_power": lost}
            outcome = outcome._replace(fields=outcome.fields | {"temperature": temperature}, numbers=numbers)
            if contact.time_step_error is not None:  # anew, with the temperature that the step has led to
                lapse = self._lapse(step, outcome.numbers["contact_area"])
                lapse = lapse._replace(
                    assumed=motion.dt, found=in_reduced_time(step.dt, carry.time_shift, time_shift)
                )
                time_step_error = self._time_step_error(
                    carry.contact, contact.memory, contact.pressure, lapse
                )
                assert time_step_error is not None
                contact = contact._replace(time_step_error=time_step_error)
                outcome = outcome._replace(
                    numbers=outcome.numbers | {"time_step_error": time_step_error.estimate}
                )
        else:
            (contact, outcome), time_shift = super().advance(carry.contact, step), carry.time_shift

        # 2. The lateral force of a dented body ploughs, whether or not the body creeps.
        if contact.dent is not None:
            memory, fields = self._of_body, self.memory.of_body(contact.memory)
            parts = [memory.by_traction(fields, step.more, contact.dent.shape)]
            parts = [
                part for part in [*parts, outcome.fields.get("indenter_displacement")] if part is not None
            ]
            displaced = sum(parts[1:], start=parts[0]) if parts else None
            force = memory.observer.hysteresis(contact.pressure, displaced, step.more.direction)
            outcome = outcome._replace(numbers=outcome.numbers | {"hysteresis_force": force})

        # 3. The status of a slide: steps that are too long, and a track that re-enters the contact from beyond the grid.
        approach, status = outcome.numbers["approach"], outcome.numbers["status"]
        depth = jnp.maximum(carry.depth, jnp.abs(jax.lax.stop_gradient(approach)))
        moved = step.more.move
        way = jnp.stack([moved.x, jnp.zeros(()) if moved.y is None else moved.y])
        far = carry.far | jnp.any(jnp.abs(way) > self.farthest * (1.0 + 1e-9))
        track = self.memory.of_body(contact.memory)
        back = reentered(track.overlaps, track.truncation_bound, depth)
        status = most_serious((far, Status.MOVED_TOO_FAR), (back, Status.REENTERED_TRACK), status=status)
        return SlideCarry(contact, depth, far, time_shift, carry.way), outcome._replace(
            numbers=outcome.numbers | {"status": status}
        )

    @property
    def _of_body(self) -> Any:
        """The memory of the body, also where the indenter has one of its own."""
        return self.memory.memories[0] if isinstance(self.memory, BothSurfaces) else self.memory

    def _lapse(self, step: Steps, contact_area: Array) -> Lapse:
        move, aside, body = step.more.move, step.more.aside, self._of_body
        way = jnp.abs(move.x) if move.y is None else jnp.hypot(move.x, move.y)
        drift = in_radii(way, contact_area, plane_strain(self.profile))
        count = body.delayed_rates.size
        if isinstance(self.memory, BothSurfaces):  # what the indenter remembers stays in the contact
            indenter = self.memory.memories[1].delayed_rates.size
            drift = jnp.concatenate([jnp.broadcast_to(drift, (count,)), jnp.zeros(indenter)])
        bent = None
        if aside is not None:
            in_cells = lambda moved: jnp.stack([moved.x, moved.y / body.ratio])
            bent = Bent(in_cells(move), in_cells(aside), count, body.kernels.family.periodic)
        return Lapse(step.dt, drift=drift, bent=bent)

    def _energies(self, adhesion_state: AdhesionState, fields: Any, pressure: Array) -> dict[str, Array]:
        """Return nothing: what a moving body dissipates is in the observables of its memory."""
        return {}


def reentered(overlaps: Array, bound: Array, depth: Array) -> Array:
    """Return whether the displacement missing in the contact, up to a bound, matters; depth: the largest approach so far."""
    return overlaps & (bound > TRUNCATION_LIMIT * depth)
