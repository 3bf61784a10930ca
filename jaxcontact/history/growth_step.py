"""The stepper of a contact whose surfaces form and wear by a law: the thickness and the pressure of each step are found
together.

    dh/dt = r(p, h, T, v),      p: contact on the film as it is,      h >= 0 of a film.

One step is an exponential method of Heun, of second order. With s = max(0, -dr/dh) at the pressure at the start of the step,
r = N - s h, phi_1(z) = (1 - exp(-z))/z and phi_2(z) = (1 - phi_1(z))/z at z = s dt,

    h* = h_n + dt phi_1 r_n                         with its pressure p*,
    h_(n+1) = h* + dt phi_2 (N* - N_n)              with its pressure p_(n+1)

(S. M. Cox, P. C. Matthews, J. Comput. Phys. 176 (2002) 430). Removal in proportion to the thickness is exact for any step,
and a steady state of growth and removal is one of the method. Both contacts have the operator of the film as it is in the
middle of the step by its first estimate. The first contact is solved to a tolerance ``PREDICTED`` times that of the run:
what is left enters the thickness times the change in a step. The step's error is estimated by the larger of
dt phi_2 |N_(n+1) - N*|, what a further correction would still change, and of dt^3/12 |d^2 N/dt^2| from this step and the one
before: both are of third order.

With a shift factor the body creeps in reduced time (``Heated``).

Where the indenter moves over the body, thickness, internal variables and all other fields are those of the body, and the
indenter's profile is moved to its place at the end of each step. What a cell receives in a passage is then summed by the
trapezoidal rule, with a relative error of about 0.4 (move/half-width)^(3/2) for Hertz's pressure. A step that moves by more
than a quarter of the half-width has the same status as one that is too long for the law.

The scheme is explicit in the pressure. Wear that flattens single cells faster than the step, or growth that accelerates by
its own relief, makes the estimate grow. A step whose estimate is above ``LARGEST_ERROR`` of the largest
thickness, or of the approach where that is larger, has a status that says so. Perturbations then grow from step to step, and
with them the derivatives, which would overflow while the values stay bounded: in the derivatives of later steps the state
after such a step is held.
"""

from __future__ import annotations

from dataclasses import field
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.exponential import phi1, ramps
from jaxcontact._support.fields import Scale
from jaxcontact._support.pytree import is_concrete, pytree, replace, static
from jaxcontact._support.reductions import lowest_point
from jaxcontact._support.status import LARGEST_ERROR, Status, most_serious
from jaxcontact.bodies.grid import Grid, MovedGrid
from jaxcontact.bodies.laws import RubbingState
from jaxcontact.contact.law import Hardness
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.history.memory import ThicknessStep
from jaxcontact.history.normal_step import (
    AdhesionState,
    PressCarry,
    PressStepper,
    contact_outcome,
    plane_strain,
    solve_step,
    status_of,
)
from jaxcontact.history.time_loop import Lapse, Outcome, Steps, in_radii
from jaxcontact.indenters.shapes import Cone, Cylinder, Ellipsoid, Indenter, Sphere
from jaxcontact.operators import spectral

# Temperature of a surface that friction heats, and the reduced time in which a body creeps at it.
#
# With a shift factor a_T the body creeps in reduced time, d xi = dt/a_T, at the mean temperature of the contact: that
# in the middle of a step is extrapolated from the two steps before. A step much longer than the one before it has the
# temperature at its start: after a load that rises quickly and then stays, the temperature does not go on rising.


@pytree
class Heated:
    """Temperature of the surface where friction heats it.

    spectrum: of the rise per heat flux on a cell [K m2/W], for ``spectral.convolve``; ambient [K], (); share: of the heat
    of friction that enters the body, (); shift: None, or the law of the shift factor of the body's times.
    """

    spectrum: Array
    ambient: Array
    share: Array
    shift: Any = None

    def rise(self, flux: Array) -> Array:
        """Return the rise of the temperature [K] under the heat flux of friction [W/m2], (nx, ny)."""
        return spectral.convolve(self.spectrum, self.share * flux)

    def temperature(self, flux: Array) -> Array:
        """Return the temperature [K] under the heat flux of friction [W/m2], (nx, ny)."""
        return self.ambient + self.rise(flux)

    def log_shift(self, temperature: Array, pressure: Array) -> Array:
        """Return the log of the shift factor at the mean temperature of the contact, without contact at ambient, ()."""
        if self.shift is None:
            return jnp.zeros(())
        touching = pressure > 0.0
        cells = jnp.sum(touching)
        rise = jnp.sum(jnp.where(touching, temperature - self.ambient, 0.0)) / jnp.maximum(cells, 1)
        return self.shift.log_factor(self.ambient + rise)

    def shifted(self, before: Array, temperature: Array | None, pressure: Array, dt: Array) -> Array:
        """Return the log of the shift factor at the end of a step, its rate of change over the step, and dt, (3,)."""
        if self.shift is None or temperature is None:
            return before
        now = self.log_shift(temperature, pressure)
        rate = (now - before[0]) / jnp.where(dt > 0.0, dt, jnp.inf)
        return jnp.stack([now, rate, dt])


def reduced(dt: Array, time_shift: Array) -> Array:
    """Return the reduced time of a step, from the log of the shift factor and its rate of change over the step before, and
    the length of that step. In a step that is longer the extrapolation is less by the square of the ratio.
    """
    before, rate, last = time_shift
    extrapolated = jnp.minimum(dt, last**2 / jnp.where(dt > 0.0, dt, jnp.inf))
    return dt * jnp.exp(-before - rate * extrapolated / 2.0)


def in_reduced_time(dt: Array, before: Array, after: Array) -> Array:
    """Return the reduced time of a step whose shift factor at its end is known, its logarithm linear in between; before,
    after: as ``Heated.shifted`` gives them.
    """
    return dt * jnp.exp(-before[0]) * phi1(after[0] - before[0])


# The way of an indenter over a body whose fields stay in place.


LONGEST = 1 / 4  # largest move of the indenter in a step, over the half-width of the contact


@pytree
class Track:
    """The way of an indenter over the body.

    start: its first position [m], (2,), where the gap is the stepper's profile; length: the scale of lengths [m].
    """

    indenter: Indenter
    grid: Grid
    start: Array
    length: Array

    def rise(self, position: Array) -> Array:
        """Return what the profile of the indenter at a position is above that at the start, scaled, (nx, ny)."""
        return (self._profile(position) - self._profile(self.start)) / self.length

    def _profile(self, position: Array) -> Array:
        grid = self.grid
        return self.indenter.profile(MovedGrid(grid.shape, grid.spacing, grid.periodic, tuple(position)))

    def carried(self, pressure: Array, move: Array) -> Array:
        """Return a pressure moved with the indenter by whole cells, from which a search may start."""
        cells = jnp.round(jax.lax.stop_gradient(move / jnp.stack(self.grid.spacing))).astype(int)
        return jnp.roll(pressure, (cells[0], cells[1]), (0, 1))

    def leaps(self, move: Array, touching: Array) -> Array:
        """Return whether a move is more than ``LONGEST`` of the half-width of the contact in its direction.

        The half-widths along x and y are those of the cells ``touching``, (nx, ny); along y there is none in plane strain.
        """
        dx, dy = self.grid.spacing
        half = jnp.stack([jnp.sum(jnp.any(touching, 1)) * dx, jnp.sum(jnp.any(touching, 0)) * dy]) / 2.0
        share = move / jnp.where(half > 0.0, half, jnp.inf)
        return jnp.sum((share[:1] if self.grid.plane_strain else share) ** 2) > LONGEST**2


def check_path(path: Any, times: Any, indenter: Any, grid: Grid, *, in_its_frame: bool) -> Verdict:
    """Check a path (nt, 2): no jump, and, unless the fields are those in the frame of the indenter, on the grid where it
    ends there, with an indenter whose profile can be moved."""
    checks.require(
        in_its_frame or isinstance(indenter, Sphere | Ellipsoid | Cone | Cylinder),
        f"indenter: expected a Sphere, Ellipsoid, Cone or Cylinder with path, got {type(indenter).__name__}",
    )
    if not is_concrete(path, times, grid):
        return True
    still, moves = np.diff(np.asarray(times, float)) == 0.0, np.any(np.diff(path, axis=0) != 0.0, 1)
    checks.require(not np.any(still & moves), "path [m]: expected no move between two equal times, got one")
    if in_its_frame:
        return True
    for axis, name in enumerate("xy"):
        half, farthest = float(grid.width[axis]) / 2.0, float(np.max(np.abs(path[:, axis])))
        checks.require(
            grid.periodic[axis] or farthest < half,
            f"path [m]: expected positions within {half:g} of the centre of the grid along {name}, got {farthest:g}",
        )
        if not grid.periodic[axis]:
            continue
        # a path around a periodic axis that starts again on the other side: long moves back between short ones forward
        moves = np.diff(path[:, axis])
        forward = np.sign(np.sum(np.sign(moves)))
        long = (np.abs(moves) > half) & (moves * forward < 0.0)
        checks.require(
            not np.any(long) or np.any(np.abs(moves[~long]) > half),
            f"path [m]: expected positions that go on around the periodic axis {name}, beyond the grid, or moves of at most"
            f" half its width, {half:g}, got one of {moves[np.argmax(long)]:g} back: they seem to start again",
        )
    return True


# tolerance of the first contact of a step over that of the second; its largest value
PREDICTED, LOOSEST = 100.0, 1e-2


NEVER_BARE = np.array([np.inf, 0.0])


class RubStep(NamedTuple):
    """The further input of a step: dt [s]; the speed at its start and its end [m/s], both times ``share``, so that their
    mean is that of the step, also where the direction changes in it; the time at its end [s]; the indenter's position at its
    end and its move in the step [m], (2,) each, None where it stays in place.
    """

    dt: Array
    speed_before: Array
    speed: Array
    share: Array
    time: Array
    position: Array | None = None
    move: Array | None = None


class RubCarry(NamedTuple):
    """The carry: that of the contact; the state after the last step, and its rise of the temperature over the speed
    [K s/m], (nx, ny), None without heat; work of friction per area [J/m2], (nx, ny); error: sum
    of the estimates of all steps so far [m], (); bare: the first time at which a part of the contact was worn to the base
    [s], and the largest such share of it, (2,); time_shift: as ``Heated.shifted`` gives it, (3,); slopes: mean
    rates of change over the last step of the law's rate and of the thickness, (2, nx, ny), and last: its length [s].
    """

    contact: PressCarry
    state: RubbingState
    warming: Array | None
    work: Array
    error: Array
    bare: Array
    time_shift: Array
    slopes: Array
    last: Array


class SolvedRub(NamedTuple):
    """A solved contact on one estimate of the thickness [m].

    raised: by how much growth has raised the surface, (nx, ny), scaled; warming: as in ``RubCarry``; rate: of growth by the
    law [m/s]; adhesion_state and adhesion_numbers: returned by ``solve_step``.
    """

    problem: Problem
    solution: Solution
    raised: Array
    state: RubbingState
    warming: Array | None
    rate: Array
    adhesion_state: AdhesionState | None
    adhesion_numbers: dict[str, Array]


@pytree
class RubStepper(PressStepper):
    """A contact that is rubbed.

    kinetics: as in ``bodies.laws``; friction, and strength of a contact with adhesion [Pa]: a number or (nx, ny), the latter
    None for zero; at_first: thickness at the start [m], (nx, ny); thickest: what the kernels are made for [m]; heated: None
    without heat; of_film: whether the film on the body forms and wears (its memory takes a ``ThicknessStep``) or the
    indenter, whose thickness may be negative; exchanged: the film is that of the indenter, which stands in the place of the
    body.
    """

    kinetics: Any = field(kw_only=True)
    friction: Array = field(kw_only=True)
    strength: Array | None = field(kw_only=True)
    at_first: Array = field(kw_only=True)
    thickest: Array = field(kw_only=True)
    scale: Scale = field(kw_only=True)
    heated: Heated | None = field(kw_only=True)
    track: Track | None = field(kw_only=True)
    of_film: bool = static(kw_only=True)
    exchanged: bool = static(kw_only=True, default=False)

    @property
    def inherits(self) -> bool:
        return True

    def start(self) -> RubCarry:  # type: ignore[override]
        zero, none = jnp.zeros_like(self.profile), jnp.zeros(())
        warming = None if self.heated is None else zero
        state = RubbingState(zero, zero, self.at_first, zero, none, self._temperature(warming, none), none)
        return RubCarry(
            super().start(),
            state,
            warming,
            zero,
            none,
            NEVER_BARE,
            jnp.zeros(3),
            jnp.stack([zero, zero]),
            none,
        )

    def advance(  # type: ignore[override]
        self, carry: RubCarry, step: Steps
    ) -> tuple[RubCarry, Outcome]:
        contact, dt = carry.contact, step.dt
        per_time = lambda change: change / jnp.where(dt > 0.0, dt, jnp.inf)

        # 1. The film at the start of the step, at the speed at that time: its rate r_n and relaxation s = max(0, -dr/dh).
        speed = step.more.speed_before
        state = replace(carry.state, speed=speed, temperature=self._temperature(carry.warming, speed))
        of_thickness = lambda thickness: self.kinetics.rate(replace(state, thickness=thickness))
        along = jnp.ones_like(state.thickness)
        known, (rate, slope) = state.thickness, jax.jvp(of_thickness, (state.thickness,), (along,))
        relaxation = jnp.maximum(-slope, 0.0)
        one, two = phi1(relaxation * dt), ramps(relaxation * dt)[2]  # phi_1 and phi_2 of the module
        guessed = self._changed(known, dt * one * rate)

        # 2. The contact before its pressure is known: on the surface as it was at first, with the operator of the film in
        # the middle of the step by the first estimate, in the reduced time of the body.
        own = reduced(dt, carry.time_shift)
        driven = ThicknessStep(own, known, guessed) if self.of_film else own
        predicted = self.memory.predict(contact.memory, contact.pressure, driven)
        profile = self.profile
        if self.track is not None:
            profile = profile + self.track.rise(step.more.position)
        lowest, gap = lowest_point(profile), profile + predicted.earlier
        if contact.dent is not None:
            gap = gap + contact.dent
        problem = Problem(predicted.operator, gap, step.target, lowest, self.load_controlled, self.law)

        # 3. h* = h_n + dt phi_1 r_n with its pressure p*, loosely; then h_(n+1) = h* + dt phi_2 (N* - N_n), N = r + s h.
        if self.track is None:
            start = contact.pressure + contact.rate * dt
        else:
            start = self.track.carried(contact.pressure, step.more.move)
        tolerance = jnp.minimum(PREDICTED * self.tolerance, LOOSEST)
        first = self._rubbed(problem, guessed, start, contact.adhesion_state, step, tolerance)
        change = first.rate - rate + relaxation * (first.state.thickness - known)
        thickness = self._changed(known, dt * (one * rate + two * change))
        again = first.solution.pressure
        second = self._rubbed(problem, thickness, again, contact.adhesion_state, step, self.tolerance)
        pressure, solution = second.solution.pressure, second.solution

        # 4. The error of the step: the larger of dt phi_2 |N_(n+1) - N*| and dt^3/12 |d^2 N/dt^2|.
        change = second.rate - first.rate + relaxation * (second.state.thickness - first.state.thickness)
        corrected = self._changed(second.state.thickness, dt * two * change)
        slopes = per_time(jnp.stack([second.rate - rate, second.state.thickness - known]))
        bend = slopes[0] - carry.slopes[0] + relaxation * (slopes[1] - carry.slopes[1])
        bend = jnp.where((dt > 0.0) & (carry.last > 0.0), 2.0 * bend / (dt + carry.last), 0.0)
        missed = jnp.abs(corrected - second.state.thickness)
        estimate = jax.lax.stop_gradient(jnp.max(jnp.maximum(missed, dt**3 / 12.0 * jnp.abs(bend))))

        # 5. A step is too long for the law by its estimate, or for the move of the indenter.
        surface = jnp.abs(solution.approach) * self.scale.length
        too_long = estimate > LARGEST_ERROR * jnp.maximum(jnp.max(jnp.abs(second.state.thickness)), surface)
        if self.track is not None:
            touching = (
                jnp.where(jnp.any(solution.carried > 0.0), solution.carried, carry.state.pressure) > 0.0
            )
            too_long = too_long | self.track.leaps(step.more.move, touching)

        # 6. The memory, the work of friction by the trapezoidal rule, the shift factor, and the error of the time steps.
        fields = self.memory.update(predicted.fields, pressure, driven)
        fluxes = carry.state.friction_stress * step.more.speed_before
        fluxes = fluxes + second.state.friction_stress * step.more.speed
        time_shift, lapse = carry.time_shift, self._lapse(step, jnp.sum(solution.carried > 0.0))
        if self.heated is not None:
            time_shift = self.heated.shifted(time_shift, second.state.temperature, solution.carried, dt)
            if self.heated.shift is not None:
                lapse = lapse._replace(assumed=own, found=in_reduced_time(dt, carry.time_shift, time_shift))
        if second.adhesion_state is not None:
            lapse = lapse._replace(touches=jnp.any(solution.carried > 0.0))
        time_step_error = self._time_step_error(contact, fields, pressure, lapse)
        pressed = contact._replace(
            memory=fields,
            pressure=pressure,
            rate=jax.lax.stop_gradient(per_time(pressure - contact.pressure)),
            time_step_error=time_step_error,
            adhesion_state=second.adhesion_state,
            dent=self._dented(contact.dent, second.problem, solution),
        )

        # 7. Where the base is bare: cells in contact that had a film at first and have none.
        bare = carry.bare
        if self.of_film:
            under_pressure = second.state.pressure > 0.0
            worn = under_pressure & (second.state.thickness <= 0.0) & (self.at_first > 0.0)
            share = jnp.sum(worn) / jnp.maximum(jnp.sum(under_pressure), 1)
            since = jnp.where(share > 0.0, jnp.minimum(bare[0], second.state.time), bare[0])
            bare = jax.lax.stop_gradient(jnp.stack([since, jnp.maximum(bare[1], share)]))

        after = RubCarry(
            contact=pressed,
            state=second.state,
            warming=second.warming,
            work=carry.work + dt / 2.0 * fluxes,
            error=carry.error + estimate,
            bare=bare,
            time_shift=time_shift,
            slopes=jax.lax.stop_gradient(slopes),
            last=dt,
        )

        numbers = contact_outcome(second.problem, solution, predicted.earlier)
        numbers |= {
            "time_step_error": jnp.zeros(()) if time_step_error is None else time_step_error.estimate,
            "iterations": first.solution.iterations + solution.iterations,
            "status": most_serious(
                (too_long, Status.STEP_TOO_LONG),
                (jnp.asarray(self.of_film) & (jnp.max(thickness) > self.thickest), Status.TOO_THICK),
                status=status_of(second.problem, solution, self.tolerance, self.edges),
            ),
            "step_error": after.error / self.scale.length,
        }
        numbers |= self.memory.observe(fields, pressure, driven) | second.adhesion_numbers
        shown = {
            "pressure": numbers.pop("pressure"),
            "displacement": predicted.earlier - second.raised + solution.displacement,
            "thickness": thickness / self.scale.length,
        }
        if "indenter_displacement" in numbers:
            shown["indenter_displacement"] = numbers.pop("indenter_displacement")
        if self.exchanged:
            shown["indenter_displacement"] = shown["displacement"] - shown["indenter_displacement"]
            own, others = numbers["film_strain"], numbers["indenter_film_strain"]
            numbers |= {"film_strain": others, "indenter_film_strain": own}
        if pressed.dent is not None:
            shown |= {"displacement": shown["displacement"] + pressed.dent, "dent": pressed.dent}
        if second.adhesion_state is not None:
            shown["contact_pressure"] = solution.carried
        if self.track is not None:
            shown["moved_profile"] = profile
        temperature = self._temperature(second.warming, step.more.speed / step.more.share)
        if temperature is not None:  # at the speed at the end of the step
            shown["temperature"] = temperature
        held = jax.tree.map(lambda a: jnp.where(too_long, jax.lax.stop_gradient(a), a), after)
        return held, Outcome(shown, numbers)

    def _lapse(self, step: Steps, contact_area: Array) -> Lapse:
        if self.track is None or step.more.move is None:
            return Lapse(step.dt)
        way = jnp.sqrt(jnp.sum(step.more.move**2)) / self.scale.length
        return Lapse(step.dt, drift=in_radii(way, contact_area, plane_strain(self.profile)))

    def overall(self, carry: RubCarry) -> dict[str, Array]:
        """Return the work of friction, scaled as results are."""
        return {"friction_work": carry.work / self.scale.unit("friction_work")}

    def for_notes(self, carry: RubCarry) -> dict[str, Array]:
        """Return the time from which the base is bare, and the share of the contact over which it is."""
        return {"bare_from": carry.bare[0], "bare_share": carry.bare[1]}

    def _changed(self, thickness: Array, change: Array) -> Array:
        """Return the thickness after a change [m]; that of a film ends at zero."""
        return jnp.maximum(thickness + change, 0.0) if self.of_film else thickness + change

    def _rubbed(
        self,
        problem: Problem,
        thickness: Array,
        guess: Array,
        before: AdhesionState | None,
        step: Steps,
        tolerance: Array,
    ) -> SolvedRub:
        """Return the contact on a film of a thickness, and the rate of the law in it; problem: without its change; before:
        with adhesion, the state at the end of the last step. The law sees the pressure that contact carries."""
        raised = (thickness - self.at_first) / self.scale.length
        problem = replace(problem, gap=problem.gap - raised)
        start = jax.lax.stop_gradient(guess)
        solution, adhesion_state, adhesion_numbers = solve_step(
            problem, start, before, tolerance, self.max_iterations
        )
        gap = problem.gap + solution.displacement - solution.approach
        if isinstance(self.law, Hardness):
            gap = gap + self.law.dent(solution.pressure, gap)
        si = self.scale.to_si(pressure=solution.carried, gap=gap)
        friction_stress = self.friction * si["pressure"]
        if self.strength is not None:
            friction_stress = friction_stress + jnp.where(solution.carried > 0.0, self.strength, 0.0)
        warming = None if self.heated is None else self.heated.rise(friction_stress)
        state = RubbingState(
            pressure=si["pressure"],
            gap=si["gap"],
            thickness=thickness,
            friction_stress=friction_stress,
            speed=step.more.speed,
            temperature=self._temperature(warming, step.more.speed),
            time=step.more.time,
        )
        rate = self.kinetics.rate(state)
        return SolvedRub(problem, solution, raised, state, warming, rate, adhesion_state, adhesion_numbers)

    def _temperature(self, warming: Array | None, speed: Array) -> Array | None:
        """Return the temperature at a speed [K], (nx, ny), None without heat: its rise is proportional to the speed."""
        if self.heated is None or warming is None:
            return None
        return self.heated.ambient + warming * speed
