"""Sliding in time: an indenter that moves over the body, in any direction and at any speed."""

from __future__ import annotations

from dataclasses import field
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import as_float64, pytree, replace
from jaxcontact._support.scale import Scale
from jaxcontact._support.status import Status, most_serious
from jaxcontact.bodies.body import LayeredHalfSpace
from jaxcontact.bodies.controls import Control
from jaxcontact.bodies.grid import Grid
from jaxcontact.bodies.laws import Adhesion, Thermal, check_adhesion, check_thermal
from jaxcontact.history.growth_step import Heated, in_reduced_time, reduced
from jaxcontact.history.memory import Motion, MovingMemory, Shift, moving_memory
from jaxcontact.history.motion import (
    FARTHEST,
    as_array,
    check_rubbing,
    checked_track,
    directions,
    over_times,
    shifts,
    speed_of,
)
from jaxcontact.history.normal_step import Adhering, PressCarry, PressStepper, plane_strain
from jaxcontact.history.time_loop import Lapse, Outcome, Steps, in_radii
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.operators import spectral
from jaxcontact.operators.heat import Solid, rise_coefficients
from jaxcontact.operators.kernels import Kernels, joint_errors, rub
from jaxcontact.results.contact import SlidingHistory, adhesive_sliding_history, sliding_history
from jaxcontact.results.notes import announce
from jaxcontact.simulate.experiment import (
    ContactSetup,
    Experiment,
    Options,
    Plan,
    Save,
    Settings,
    TimedExperiment,
    attraction_of,
    fine_steps,
    tabor_numbers,
)
from jaxcontact.simulate.run import refined
from jaxcontact.simulate.temperature import check_peclet

TRUNCATION_LIMIT = 0.01  # of the largest approach so far


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

    On a grid that is periodic along both axes no history leaves the grid. A step may then have any length, and the
    indenter encounters the tracks of its periodic images. In plane strain the velocity has one component.

    With ``thermal`` the temperature of the surface is the steady flash temperature under the present heat of friction, which
    moves over the body with the indenter. Its mean over the contact changes the times of the body, if ``thermal`` has a
    shift: one factor for the whole body.

    With adhesion, as in ``indent``, the surfaces slide without friction. Attraction at the rear edge, where they part, is
    resisted by a body that has had time to relax, and the edge dissipates energy: the hysteresis force is then that of
    the whole pressure, contact less attraction. Steps should move the indenter by a part of the zone of attraction.
    Each step solves contacts of the symmetric part of its response in turn (``contact.adhesive``), which converges
    for an E0/Einf of up to 10 whatever the step; beyond, the status of a long step may be 1, and more ``substeps`` help.

    A film whose thickness varies in the plane moves through the frame of the indenter, in which this function works; ``rub``
    with ``path`` computes its contact in the frame of the body, also without a law of growth or wear.

    Args:
        velocity: velocity of the indenter over the body [m/s]: a number (along x), (2,) for (vx, vy), or (nt, 2) over
            the times, linear between them. With a velocity along +x, the leading edge and the higher pressure are on the
            +x side. The motion starts with the load at times[0].
        friction: as in ``slide_steady``, along the velocity at the end of each inner step.
        thermal: None, or ``Thermal`` with a diffusivity; friction is then > 0, the velocity constant, and the grid not
            periodic.
        adhesion: as in ``indent``, without friction; None for surfaces without attraction.
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
    setup = ContactSetup(body, indenter, control, times, grid)
    settings = Settings(tolerance, max_iterations, kernels, Options(save, checkpoint=checkpoint))
    more = {"velocity": velocity, "friction": friction, "thermal": thermal, "adhesion": adhesion}
    history: SlidingHistory = refined(
        lambda settings: Sliding.of(setup, settings, **more), settings, substeps
    )
    announce(history, stacklevel=2)
    return history


@pytree
class Sliding(TimedExperiment):
    """A slide; velocity: as given to ``slide``; friction, thermal and adhesion: likewise, None without."""

    velocity: Array
    friction: Array | None
    thermal: Thermal | None
    adhesion: Adhesion | None = None

    @classmethod
    def of(  # type: ignore[override]
        cls,
        setup: ContactSetup,
        settings: Settings,
        *,
        velocity: Any,
        friction: Any = None,
        thermal: Any = None,
        adhesion: Any = None,
    ) -> Self:
        adheres = check_adhesion(adhesion)
        checks.require(
            adhesion is None or friction is None,
            f"friction: expected None with adhesion, got {friction!r}: Coulomb's law holds under pressure alone",
        )
        experiment = Experiment.of(setup, settings, adhesive=adhesion is not None)
        velocity = as_array(velocity)
        substeps, grid = experiment.options.substeps, experiment.grid
        valid = checked_track(velocity, setup.times, grid, substeps) & _check_heat(
            thermal, velocity, friction, grid
        )
        experiment = experiment.also(valid & adheres).also(check_rubbing(friction, grid))
        velocity, friction, thermal, adhesion = as_float64((velocity, friction, thermal, adhesion))
        more = {"velocity": velocity, "friction": friction, "thermal": thermal, "adhesion": adhesion}
        return cls(**vars(experiment), **more)

    def planned(self) -> Plan:
        """Return the march of the slide."""
        kernels, grid, substeps = self.ready_kernels, self.grid, self.options.substeps
        scale, contact = kernels.scale, self.contact(kernels.scale)
        memory = self._memory(kernels, contact["profile"])
        shift = shifts(self.velocity / scale.length, self.times, substeps)
        motion = Motion(
            fine_steps(self.times, substeps), shift, directions(self.velocity, self.times, substeps)
        )
        farthest = jnp.full(2, jnp.inf)
        if not all(grid.periodic):
            nx, ny = grid.shape
            farthest = FARTHEST * jnp.stack([nx * jnp.ones(()), ny * memory.ratio])
        friction, errors = jnp.zeros(()), kernels.errors(self.duration)
        if self.friction is not None and memory.rubbing is not None:
            friction, errors = self.friction, joint_errors(kernels, memory.rubbing.expansion, self.duration)
        stepper = SlideStepper(memory, **contact, farthest=farthest, heating=self._heating(scale))
        course, makes = {"velocity": over_times(self.velocity, self.times)}, sliding_history
        if self.adhesion is not None:
            stepper = replace(stepper, law=attraction_of(self.adhesion, self, scale))
            course["tabor_number"], makes = tabor_numbers(self.adhesion, self), adhesive_sliding_history
        beside = {"friction": jnp.broadcast_to(friction, grid.shape)}
        return self.plan(stepper, motion, scale, errors).to(makes, course=course, beside=beside)

    @property
    def temperatures(self) -> list[Any]:
        return [] if self.thermal is None else [self.thermal.ambient]

    def _heating(self, scale: Scale) -> Heating | None:
        """Return what heats the surface at each pressure, None without heat."""
        thermal = self.thermal
        if thermal is None or self.friction is None:
            return None
        nx, ny = self.grid.shape
        solid = Solid(thermal.conductivity, thermal.diffusivity)
        rises = rise_coefficients(self.grid.shape, self.grid.spacing, self.velocity, solid)
        mx, my = spectral.padded_shape((nx, ny))
        wrapped = jnp.zeros((mx, my)).at[: 2 * nx - 1, : 2 * ny - 1].set(rises)
        wrapped = jnp.roll(wrapped, (1 - nx, 1 - ny), (0, 1))
        heated = Heated(
            spectral.transform(wrapped, (True, True)), thermal.ambient, thermal.share, thermal.shift
        )
        speed = speed_of(over_times(self.velocity, self.times)[0])
        return Heating(heated, self.friction * speed * scale.unit("pressure"))

    def _memory(self, kernels: Kernels, profile: Array) -> MovingMemory:
        """Return the memory of a moving body, with the response to friction if there is any."""
        grid, rubbing = self.grid, None
        if self.friction is not None:
            rubbing = rub(self.body, self.indenter, grid, kernels.scale, self.friction)
        return moving_memory(kernels, profile, grid.spacing[1] / grid.spacing[0], rubbing)


@pytree
class Heating:
    """flux: heat of friction per area over a scaled pressure [W/m2], a number or (nx, ny)."""

    heated: Heated
    flux: Array


class SlideCarry(NamedTuple):
    """The carry: that of the contact; the largest approach so far; whether a step so far moved too far; shift: as
    ``Heated.shifted`` gives it, (3,)."""

    contact: PressCarry
    depth: Array
    far: Array
    shift: Array


@pytree
class SlideStepper(PressStepper):
    """A normal contact that moves over the body, and what makes its status that of a slide; farthest: the longest step along
    x and y that the scheme can bear [cells along x]."""

    farthest: Array = field(kw_only=True)
    heating: Heating | None = field(kw_only=True)

    def start(self) -> SlideCarry:  # type: ignore[override]
        return SlideCarry(super().start(), jnp.zeros(()), jnp.zeros((), bool), jnp.zeros(3))

    def advance(  # type: ignore[override]
        self, carry: SlideCarry, step: Steps
    ) -> tuple[SlideCarry, Outcome]:
        if self.heating is not None:
            motion = step.more._replace(dt=reduced(step.dt, carry.shift))
            contact, outcome = super().advance(carry.contact, step._replace(more=motion))
            shift, outcome = self._warmed(self.heating, carry.shift, step.dt, outcome)
            if contact.judged is not None:  # anew, with the temperature that the step has led to
                lapse = self._lapse(step, outcome.numbers["contact_area"])
                lapse = lapse._replace(assumed=motion.dt, found=in_reduced_time(step.dt, carry.shift, shift))
                judged = self._judged(carry.contact, contact.memory, contact.pressure, lapse)
                assert judged is not None
                contact = contact._replace(judged=judged)
                outcome = outcome._replace(numbers=outcome.numbers | {"time_step_error": judged.estimate})
        else:
            (contact, outcome), shift = super().advance(carry.contact, step), carry.shift
        approach, status = outcome.numbers["approach"], outcome.numbers["status"]
        depth = jnp.maximum(carry.depth, jnp.abs(jax.lax.stop_gradient(approach)))
        far = carry.far | self._moves_too_far(step.more.shift)
        back = reentered(contact.memory.overlaps, contact.memory.truncation_bound, depth)
        status = most_serious((far, Status.MOVED_TOO_FAR), (back, Status.REENTERED_TRACK), status=status)
        return SlideCarry(contact, depth, far, shift), outcome._replace(
            numbers=outcome.numbers | {"status": status}
        )

    def _lapse(self, step: Steps, contact_area: Array) -> Lapse:
        shift = step.more.shift
        way = jnp.abs(shift.x) if shift.y is None else jnp.hypot(shift.x, shift.y)
        return Lapse(step.dt, drift=in_radii(way, contact_area, plane_strain(self.profile)))

    def _energies(self, adhering: Adhering, fields: Any, pressure: Array) -> dict[str, Array]:
        """Return nothing: what a moving body dissipates is in the observables of its memory."""
        return {}

    def _warmed(self, heating: Heating, before: Array, dt: Array, outcome: Outcome) -> tuple[Array, Outcome]:
        """Return the shift after a step, and the outcome with the temperature and the power lost in real time."""
        pressure = outcome.fields["pressure"]
        temperature = heating.heated.temperature(heating.flux * pressure)
        shift = heating.heated.shifted(before, temperature, pressure, dt)
        lost = outcome.numbers["hysteresis_power"] * jnp.exp(-shift[0])
        fields = outcome.fields | {"temperature": temperature}
        return shift, outcome._replace(fields=fields, numbers=outcome.numbers | {"hysteresis_power": lost})

    def _moves_too_far(self, shift: Shift) -> Array:
        way = jnp.stack([shift.x, jnp.zeros(()) if shift.y is None else shift.y])
        return jnp.any(jnp.abs(way) > self.farthest * (1.0 + 1e-9))


def _check_heat(thermal: Any, velocity: Any, friction: Any, grid: Grid) -> Verdict:
    """Check heat in sliding: a diffusivity, friction, and a velocity at which a steady temperature can be computed."""
    valid = check_thermal(thermal, grid, "slide")
    if thermal is None:
        return valid
    shape = np.shape(velocity)
    checks.require(
        shape in ((), (2,)),
        f"velocity: expected a number or shape (2,) with thermal=, whose temperature is steady, got shape {shape}",
    )
    checks.require(
        friction is not None, "friction: expected a coefficient with thermal=, got None, which makes no heat"
    )
    checks.require(
        thermal.diffusivity is not None, "Thermal diffusivity [m2/s]: expected a number in slide, got None"
    )
    return valid & check_peclet(grid, velocity, thermal.diffusivity)


def reentered(overlaps: Array, bound: Array, depth: Array) -> Array:
    """Return whether the displacement missing in the contact, up to a bound, matters; depth: the largest approach so far."""
    return overlaps & (bound > TRUNCATION_LIMIT * depth)
