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

With a shift factor the body creeps in reduced time (``history.growth_step``).

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
from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import is_concrete, pytree, replace, static
from jaxcontact._support.scale import Scale
from jaxcontact._support.status import LARGEST_ERROR, Status, most_serious
from jaxcontact.bodies.grid import Grid, MovedGrid
from jaxcontact.bodies.laws import RubbingState
from jaxcontact.contact.implicit import solve_contact
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.history.memory import ThicknessStep
from jaxcontact.history.normal_step import PressCarry, PressStepper, contact_outcome, plane_strain, status_of
from jaxcontact.history.time_loop import Lapse, Outcome, Steps, in_radii
from jaxcontact.indenters.shapes import Cone, Cylinder, Indenter, Sphere
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


def reduced(dt: Array, shift: Array) -> Array:
    """Return the reduced time of a step, from the log of the shift factor and its rate of change over the step before, and
    the length of that step. In a step that is longer the extrapolation is less by the square of the ratio.
    """
    before, rate, last = shift
    extrapolated = jnp.minimum(dt, last**2 / jnp.where(dt > 0.0, dt, jnp.inf))
    return dt * jnp.exp(-before - rate * extrapolated / 2.0)


def in_reduced_time(dt: Array, before: Array, after: Array) -> Array:
    """Return the reduced time of a step whose shift factor at its end is known, its logarithm linear in between; before,
    after: as ``Heated.shifted`` gives them.
    """
    return dt * jnp.exp(-before[0]) * phi1(after[0] - before[0])


# The way of an indenter over a body whose fields stay in place.


LONGEST = 1 / 4  # of the half-width of the contact: what the indenter may move in a step


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


def check_path(path: Any, times: Any, indenter: Any, grid: Grid) -> Verdict:
    """Check a path (nt, 2): no jump, on the grid where it ends there, and an indenter whose profile can be moved."""
    checks.require(
        isinstance(indenter, Sphere | Cone | Cylinder),
        f"indenter: expected a Sphere, Cone or Cylinder with path, got {type(indenter).__name__}",
    )
    if not is_concrete(path, times, grid):
        return True
    still, moves = np.diff(np.asarray(times, float)) == 0.0, np.any(np.diff(path, axis=0) != 0.0, 1)
    checks.require(not np.any(still & moves), "path [m]: expected no move between two equal times, got one")
    for axis, name in enumerate("xy"):
        half, farthest = float(grid.width[axis]) / 2.0, float(np.max(np.abs(path[:, axis])))
        checks.require(
            grid.periodic[axis] or farthest < half,
            f"path [m]: expected positions within {half:g} of the centre of the grid along {name}, got {farthest:g}",
        )
        if grid.periodic[axis]:
            _check_goes_on(np.diff(path[:, axis]), half, name)
    return True


def _check_goes_on(moves: np.ndarray, half: float, name: str) -> None:
    """Raise ValueError for a path around a periodic axis that starts again on the other side of the grid: single long moves
    (nt - 1,) back between short ones forward."""
    forward = np.sign(np.sum(np.sign(moves)))
    long = (np.abs(moves) > half) & (moves * forward < 0.0)
    checks.require(
        not np.any(long) or np.any(np.abs(moves[~long]) > half),
        f"path [m]: expected positions that go on around the periodic axis {name}, beyond the grid, or moves of at most half"
        f" its width, {half:g}, got one of {moves[np.argmax(long)]:g} back: they seem to start again",
    )


PREDICTED, LOOSEST = (
    100.0,
    1e-2,
)  # the tolerance of the first contact of a step over that of the second; at most


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
    [s], and the largest such share of it, (2,); shift: as ``Heated.shifted`` gives it, (3,); slopes: as
    ``_slopes`` over the last step, and last: its length [s].
    """

    contact: PressCarry
    state: RubbingState
    warming: Array | None
    work: Array
    error: Array
    bare: Array
    shift: Array
    slopes: Array
    last: Array


class Known(NamedTuple):
    """The film at the start of a step: thickness [m], its rate [m/s] at the speed at that time, and the relaxation s of the
    module [1/s], (nx, ny).
    """

    thickness: Array
    rate: Array
    relaxation: Array


class PredictedStep(NamedTuple):
    """A step before its pressure is known: the contact without the change of the surface, its profile, the displacement left
    by earlier pressure, and the memory's fields and input."""

    problem: Problem
    profile: Array
    earlier: Array
    fields: Any
    driven: Any


class SolvedRub(NamedTuple):
    """A solved contact on one estimate of the thickness [m]; raised (nx, ny), scaled; warming as in ``RubCarry``; rate [m/s]
    by the law."""

    problem: Problem
    solution: Solution
    raised: Array
    state: RubbingState
    warming: Array | None
    rate: Array


@pytree
class RubStepper(PressStepper):
    """A contact that is rubbed.

    kinetics: as in ``bodies.laws``; friction: a number or (nx, ny); at_first: thickness at the start [m], (nx, ny);
    thickest: what the kernels are made for [m]; heated: None without heat; of_film: whether the film on the body forms and
    wears (its memory takes a ``ThicknessStep``) or the indenter, whose thickness may be negative.
    """

    kinetics: Any = field(kw_only=True)
    friction: Array = field(kw_only=True)
    at_first: Array = field(kw_only=True)
    thickest: Array = field(kw_only=True)
    scale: Scale = field(kw_only=True)
    heated: Heated | None = field(kw_only=True)
    track: Track | None = field(kw_only=True)
    of_film: bool = static(kw_only=True)

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
        contact, dt, known = carry.contact, step.dt, self._known(carry, step)
        guessed = self._changed(known.thickness, dt * _weights(known.relaxation * dt)[0] * known.rate)
        predicted = self._predicted(carry, guessed, step)
        tolerance = jnp.minimum(PREDICTED * self.tolerance, LOOSEST)
        first = self._rubbed(predicted, guessed, self._expected(contact, step), step, tolerance)
        thickness = self._changed(known.thickness, _second_order(known, first, dt))
        second = self._rubbed(predicted, thickness, first.solution.pressure, step, self.tolerance)
        estimate = jax.lax.stop_gradient(self._estimate(carry, known, first, second, dt))
        pressure = second.solution.pressure
        fields = self.memory.update(predicted.fields, pressure, predicted.driven)
        slope = jax.lax.stop_gradient(pressure - contact.pressure) / jnp.where(dt > 0.0, dt, jnp.inf)
        fluxes = self._flux(contact.pressure, step.more.speed_before) + self._flux(pressure, step.more.speed)
        work = carry.work + dt / 2.0 * fluxes
        pressed = contact._replace(memory=fields, pressure=pressure, rate=slope)
        shift = carry.shift
        if self.heated is not None:
            shift = self.heated.shifted(shift, second.state.temperature, pressure, dt)
        lapse = self._lapse(step, jnp.sum(pressure > 0.0))
        if self.heated is not None and self.heated.shift is not None:
            assumed, found = reduced(dt, carry.shift), in_reduced_time(dt, carry.shift, shift)
            lapse = lapse._replace(assumed=assumed, found=found)
        pressed = pressed._replace(judged=self._judged(contact, fields, pressure, lapse))
        error, slopes = carry.error + estimate, jax.lax.stop_gradient(_slopes(known, second, dt))
        bare = jax.lax.stop_gradient(self._bare(carry.bare, second.state))
        carry = RubCarry(pressed, second.state, second.warming, work, error, bare, shift, slopes, dt)
        too_long = self._too_long(second, contact.pressure, estimate, step)
        outcome = self._outcome(carry, predicted, first, second, too_long, step)
        carry = jax.tree.map(lambda a: jnp.where(too_long, jax.lax.stop_gradient(a), a), carry)
        return carry, self._warmed(outcome, second, step)

    def _lapse(self, step: Steps, contact_area: Array) -> Lapse:
        if self.track is None or step.more.move is None:
            return Lapse(step.dt)
        way = jnp.sqrt(jnp.sum(step.more.move**2)) / self.scale.length
        return Lapse(step.dt, drift=in_radii(way, contact_area, plane_strain(self.profile)))

    def overall(self, carry: RubCarry) -> dict[str, Array]:
        """Return the work of friction, scaled as results are."""
        return {"friction_work": carry.work / self.scale.unit("friction_work")}

    def told(self, carry: RubCarry) -> dict[str, Array]:
        """Return the time from which the base is bare, and the share of the contact over which it is."""
        return {"bare_from": carry.bare[0], "bare_share": carry.bare[1]}

    def _bare(self, before: Array, state: RubbingState) -> Array:
        """Return ``RubCarry.bare`` after a step: cells in contact that had a film at first and have none."""
        if not self.of_film:
            return before
        pressed = state.pressure > 0.0
        worn = pressed & (state.thickness <= 0.0) & (self.at_first > 0.0)
        share = jnp.sum(worn) / jnp.maximum(jnp.sum(pressed), 1)
        first = jnp.where(share > 0.0, jnp.minimum(before[0], state.time), before[0])
        return jnp.stack([first, jnp.maximum(before[1], share)])

    def _expected(self, contact: PressCarry, step: Steps) -> Array:
        """Return the pressure from which the search of a step starts."""
        if self.track is not None:
            return self.track.carried(contact.pressure, step.more.move)
        return contact.pressure + contact.rate * step.dt

    def _changed(self, thickness: Array, change: Array) -> Array:
        """Return the thickness after a change [m]; that of a film ends at zero."""
        return jnp.maximum(thickness + change, 0.0) if self.of_film else thickness + change

    def _predicted(self, carry: RubCarry, guessed: Array, step: Steps) -> PredictedStep:
        """Return the step on a surface as it was at first, with the operator of the film in the middle of the step."""
        dt = reduced(step.dt, carry.shift)
        driven = ThicknessStep(dt, carry.state.thickness, guessed) if self.of_film else dt
        found = self.memory.predict(carry.contact.memory, carry.contact.pressure, driven)
        profile = self.profile
        if self.track is not None:
            profile = profile + self.track.rise(step.more.position)
        lowest, gap = jnp.min(profile), profile + found.earlier
        problem = Problem(found.operator, gap, step.target, lowest, self.load_controlled, self.law)
        return PredictedStep(problem, profile, found.earlier, found.fields, driven)

    def _rubbed(
        self, predicted: PredictedStep, thickness: Array, guess: Array, step: Steps, tolerance: Array
    ) -> SolvedRub:
        """Return the contact on a film of a thickness, and the rate of the law in it."""
        raised = (thickness - self.at_first) / self.scale.length
        problem = replace(predicted.problem, gap=predicted.problem.gap - raised)
        start = jax.lax.stop_gradient(guess)
        solution = solve_contact(problem, start, tolerance, self.max_iterations)
        gap = problem.gap + solution.displacement - solution.approach
        si = self.scale.to_si(pressure=solution.pressure, gap=gap)
        friction_stress = self.friction * si["pressure"]
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
        return SolvedRub(problem, solution, raised, state, warming, self.kinetics.rate(state))

    def _known(self, carry: RubCarry, step: Steps) -> Known:
        """Return the film at the start of a step, from the state after the step before."""
        speed = step.more.speed_before
        state = replace(carry.state, speed=speed, temperature=self._temperature(carry.warming, speed))
        return Known(state.thickness, self.kinetics.rate(state), self._relaxation(state))

    def _temperature(self, warming: Array | None, speed: Array) -> Array | None:
        """Return the temperature at a speed [K], (nx, ny), None without heat: its rise is proportional to the speed."""
        if self.heated is None or warming is None:
            return None
        return self.heated.ambient + warming * speed

    def _warmed(self, outcome: Outcome, found: SolvedRub, step: Steps) -> Outcome:
        """Return an outcome with the temperature at the speed at the end of the step."""
        temperature = self._temperature(found.warming, step.more.speed / step.more.share)
        if temperature is None:
            return outcome
        return outcome._replace(fields=outcome.fields | {"temperature": temperature})

    def _estimate(
        self, carry: RubCarry, known: Known, first: SolvedRub, second: SolvedRub, dt: Array
    ) -> Array:
        """Return the error of a step in the thickness [m], (), the larger of the two of the module."""
        relaxation, thickness = known.relaxation, second.state.thickness
        change = second.rate - first.rate + relaxation * (thickness - first.state.thickness)
        corrected = self._changed(thickness, dt * _weights(relaxation * dt)[1] * change)
        now, before = _slopes(known, second, dt), carry.slopes
        bend = 2.0 * (now[0] - before[0] + relaxation * (now[1] - before[1])) / (dt + carry.last)
        bend = jnp.where((dt > 0.0) & (carry.last > 0.0), bend, 0.0)
        return jnp.max(jnp.maximum(jnp.abs(corrected - thickness), dt**3 / 12.0 * jnp.abs(bend)))

    def _relaxation(self, state: RubbingState) -> Array:
        """Return how fast the law relaxes the thickness at a fixed pressure, max(0, -dr/dh) [1/s], (nx, ny)."""
        rate = lambda thickness: self.kinetics.rate(replace(state, thickness=thickness))
        _, slope = jax.jvp(rate, (state.thickness,), (jnp.ones_like(state.thickness),))
        return jnp.maximum(-slope, 0.0)

    def _flux(self, pressure: Array, speed: Array) -> Array:
        """Return the power of friction per area [W/m2], from a scaled pressure."""
        return self.friction * pressure * self.scale.unit("pressure") * speed

    def _outcome(
        self,
        carry: RubCarry,
        predicted: PredictedStep,
        first: SolvedRub,
        second: SolvedRub,
        too_long: Array,
        step: Steps,
    ) -> Outcome:
        solution, state = second.solution, second.state
        numbers = contact_outcome(second.problem, solution, predicted.earlier)
        judged = carry.contact.judged
        numbers |= {
            "time_step_error": jnp.zeros(()) if judged is None else judged.estimate,
            "iterations": first.solution.iterations + solution.iterations,
            "status": self._status(second, too_long),
            "step_error": carry.error / self.scale.length,
        }
        numbers |= self.memory.observe(carry.contact.memory, solution.pressure, predicted.driven)
        displacement = predicted.earlier - second.raised + solution.displacement
        thickness = state.thickness / self.scale.length
        shown = {"pressure": numbers.pop("pressure"), "displacement": displacement, "thickness": thickness}
        if self.track is not None:
            shown["moved_profile"] = predicted.profile
        return Outcome(shown, numbers)

    def _too_long(self, found: SolvedRub, before: Array, estimate: Array, step: Steps) -> Array:
        """Return whether a step is too long for the law, or for the move of the indenter, ()."""
        surface = jnp.abs(found.solution.approach) * self.scale.length
        largest = LARGEST_ERROR * jnp.maximum(jnp.max(jnp.abs(found.state.thickness)), surface)
        leaps = jnp.zeros((), bool)
        if self.track is not None:
            after = found.solution.pressure
            leaps = self.track.leaps(step.more.move, jnp.where(jnp.any(after > 0.0), after, before) > 0.0)
        return (estimate > largest) | leaps

    def _status(self, found: SolvedRub, too_long: Array) -> Array:
        """Return the most serious of the statuses of the contact, of the step and of the thickness."""
        own = status_of(found.problem, found.solution, self.tolerance, self.edges)
        thickest = jnp.max(found.state.thickness)
        return most_serious(
            (too_long, Status.STEP_TOO_LONG),
            (jnp.asarray(self.of_film) & (thickest > self.thickest), Status.TOO_THICK),
            status=own,
        )


def _second_order(known: Known, first: SolvedRub, dt: Array) -> Array:
    """Return the change of the thickness over a step [m] by the method of the module."""
    one, two = _weights(known.relaxation * dt)
    change = first.rate - known.rate + known.relaxation * (first.state.thickness - known.thickness)
    return dt * (one * known.rate + two * change)


def _slopes(known: Known, found: SolvedRub, dt: Array) -> Array:
    """Return the mean rates of change over a step of the law's rate and of the thickness, (2, nx, ny)."""
    change = jnp.stack([found.rate - known.rate, found.state.thickness - known.thickness])
    return change / jnp.where(dt > 0.0, dt, jnp.inf)


def _weights(z: Array) -> tuple[Array, Array]:
    """Return phi_1(z) = (1 - exp(-z))/z and phi_2(z) = (1 - phi_1(z))/z of the module, z >= 0; 1 and 1/2 at zero."""
    small = z < 1e-3
    safe = jnp.where(small, 1.0, z)
    first = jnp.where(small, 1.0 - z / 2.0 + z**2 / 6.0 - z**3 / 24.0, -jnp.expm1(-safe) / safe)
    second = jnp.where(
        small, 0.5 - z / 6.0 + z**2 / 24.0 - z**3 / 120.0, (1.0 + jnp.expm1(-safe) / safe) / safe
    )
    return first, second
