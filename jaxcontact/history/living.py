"""The stepper of a contact whose surfaces form and wear by a law: the thickness and the pressure of each step are found
together.

    dh/dt = r(p, h, T, v),      p: contact on the film as it is,      h >= 0 of a film.

One step of the method of Heun, of second order:

    h* = h_n + dt r_n                               with its pressure p*,
    h_(n+1) = h_n + dt/2 (r_n + r*)                 with its pressure p_(n+1).

Both contacts have the operator of the film as it is in the middle of the step by its first estimate. The step's error is
estimated by dt/2 |r_(n+1) - r*|, what the trapezoidal rule would still change: it is of third order.

The scheme is explicit. A law that is stiff for the step, a removal rate k with k dt > 2, say, or wear that flattens single
cells faster than the step, makes the estimate grow. A step whose estimate is above ``LARGEST_ERROR`` of the largest
thickness, or of the approach where that is larger, has a status that says so.
"""

from __future__ import annotations

from dataclasses import field
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact._support.scale import Scale
from jaxcontact._support.status import Status, first_of
from jaxcontact.contact.implicit import solve_contact
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.history.growing import ThicknessStep
from jaxcontact.history.march import Outcome, Steps
from jaxcontact.history.pressing import PressCarry, PressStepper, contact_outcome, status_of
from jaxcontact.inputs.laws import RubbingState
from jaxcontact.operators import spectral

LARGEST_ERROR = 0.01  # of the largest thickness, or of the approach where that is larger


class RubStep(NamedTuple):
    """The further input of a step: dt [s]; the speed at its start and its end [m/s]; the time at its end [s]."""

    dt: Array
    speed_before: Array
    speed: Array
    time: Array


class RubCarry(NamedTuple):
    """The carry: that of the contact; thickness [m] and its rate [m/s], work of friction per area [J/m2]: (nx, ny);
    error: sum of the estimates of all steps so far [m], ()."""

    contact: PressCarry
    thickness: Array
    rate: Array
    work: Array
    error: Array


@pytree
class Heated:
    """Temperature of the surface where friction heats it.

    spectrum: of the rise per heat flux on a cell [K m2/W], for ``spectral.convolve``; ambient [K], (); share: of the heat
    of friction that enters the body, ().
    """

    spectrum: Array
    ambient: Array
    share: Array

    def temperature(self, flux: Array) -> Array:
        """Return the temperature [K] under the heat flux of friction [W/m2], (nx, ny)."""
        return self.ambient + spectral.convolve(self.spectrum, self.share * flux)


class Awaited(NamedTuple):
    """A step before its pressure is known: the contact without the change of the surface, the displacement left by earlier
    pressure, and the memory's fields and input."""

    problem: Problem
    earlier: Array
    fields: Any
    driven: Any


class SolvedRub(NamedTuple):
    """A solved contact on one estimate of the thickness [m]; raised (nx, ny), scaled; rate [m/s] by the law."""

    problem: Problem
    solution: Solution
    raised: Array
    state: RubbingState
    rate: Array


@pytree
class RubStepper(PressStepper):
    """A contact that is rubbed.

    kinetics: as in ``inputs.laws``; friction: a number or (nx, ny); at_first: thickness at the start [m], (nx, ny);
    thickest: what the kernels are made for [m]; heated: None without heat; of_film: whether the film on the body forms and
    wears (its memory takes a ``ThicknessStep``) or the indenter, whose thickness may be negative.
    """

    kinetics: Any = field(kw_only=True)
    friction: Array = field(kw_only=True)
    at_first: Array = field(kw_only=True)
    thickest: Array = field(kw_only=True)
    scale: Scale = field(kw_only=True)
    heated: Heated | None = field(kw_only=True)
    of_film: bool = static(kw_only=True)

    @property
    def inherits(self) -> bool:
        return True

    def start(self) -> RubCarry:  # type: ignore[override]
        zero = jnp.zeros_like(self.profile)
        return RubCarry(super().start(), self.at_first, zero, zero, jnp.zeros(()))

    def advance(  # type: ignore[override]
        self, carry: RubCarry, step: Steps
    ) -> tuple[RubCarry, Outcome]:
        contact, dt = carry.contact, step.dt
        guessed = self._changed(carry.thickness, dt * carry.rate)
        coming = self._predicted(carry, guessed, step)
        first = self._rubbed(coming, guessed, contact.pressure + contact.rate * dt, step)
        thickness = self._changed(carry.thickness, dt * (carry.rate + first.rate) / 2.0)
        second = self._rubbed(coming, thickness, first.solution.pressure, step)
        corrected = self._changed(thickness, dt * (second.rate - first.rate) / 2.0)
        estimate = jax.lax.stop_gradient(jnp.max(jnp.abs(corrected - thickness)))
        pressure = second.solution.pressure
        fields = self.memory.update(coming.fields, pressure, coming.driven)
        slope = jax.lax.stop_gradient(pressure - contact.pressure) / jnp.where(dt > 0.0, dt, jnp.inf)
        before = self._flux(contact.pressure, step.more.speed_before)
        work = carry.work + dt / 2.0 * (before + self._flux(pressure, step.more.speed))
        pressed = contact._replace(memory=fields, pressure=pressure, rate=slope)
        carry = RubCarry(pressed, thickness, second.rate, work, carry.error + estimate)
        return carry, self._outcome(carry, coming, first, second, estimate)

    def overall(self, carry: RubCarry) -> dict[str, Array]:
        """Return the work of friction, scaled as results are."""
        return {"friction_work": carry.work / self.scale.unit("friction_work")}

    def _changed(self, thickness: Array, change: Array) -> Array:
        """Return the thickness after a change [m]; that of a film ends at zero."""
        return jnp.maximum(thickness + change, 0.0) if self.of_film else thickness + change

    def _predicted(self, carry: RubCarry, guessed: Array, step: Steps) -> Awaited:
        """Return the step on a surface as it was at first, with the operator of the film in the middle of the step."""
        driven = ThicknessStep(step.dt, carry.thickness, guessed) if self.of_film else step.dt
        found = self.memory.predict(carry.contact.memory, carry.contact.pressure, driven)
        lowest, gap = jnp.min(self.profile), self.profile + found.earlier
        problem = Problem(found.operator, gap, step.target, lowest, self.load_controlled, self.law)
        return Awaited(problem, found.earlier, found.fields, driven)

    def _rubbed(self, coming: Awaited, thickness: Array, guess: Array, step: Steps) -> SolvedRub:
        """Return the contact on a film of a thickness, and the rate of the law in it."""
        raised = (thickness - self.at_first) / self.scale.length
        problem = replace(coming.problem, gap=coming.problem.gap - raised)
        start = jax.lax.stop_gradient(guess)
        solution = solve_contact(problem, start, self.tolerance, self.max_iterations)
        gap = problem.gap + solution.displacement - solution.approach
        flux = self._flux(solution.pressure, step.more.speed)
        si = self.scale.to_si(pressure=solution.pressure, gap=gap)
        state = RubbingState(
            pressure=si["pressure"],
            gap=si["gap"],
            thickness=thickness,
            friction_stress=self.friction * si["pressure"],
            speed=step.more.speed,
            temperature=None if self.heated is None else self.heated.temperature(flux),
            time=step.more.time,
        )
        return SolvedRub(problem, solution, raised, state, self.kinetics.rate(state))

    def _flux(self, pressure: Array, speed: Array) -> Array:
        """Return the power of friction per area [W/m2], from a scaled pressure."""
        return self.friction * pressure * self.scale.unit("pressure") * speed

    def _outcome(
        self, carry: RubCarry, coming: Awaited, first: SolvedRub, second: SolvedRub, estimate: Array
    ) -> Outcome:
        solution, state = second.solution, second.state
        numbers = contact_outcome(second.problem, solution, coming.earlier)
        numbers |= {
            "iterations": first.solution.iterations + solution.iterations,
            "status": self._status(second, estimate),
            "step_error": carry.error / self.scale.length,
        }
        numbers |= self.memory.observe(carry.contact.memory, solution.pressure, coming.driven)
        displacement = coming.earlier - second.raised + solution.displacement
        thickness = state.thickness / self.scale.length
        shown = {"pressure": numbers.pop("pressure"), "displacement": displacement, "thickness": thickness}
        if state.temperature is not None:
            shown["temperature"] = state.temperature
        return Outcome(shown, numbers)

    def _status(self, found: SolvedRub, estimate: Array) -> Array:
        """Return the status of the contact, or, where it is fine, that of the step and of the thickness."""
        own = status_of(found.problem, found.solution, self.tolerance, self.edges)
        thickness = found.state.thickness
        surface = jnp.abs(found.solution.approach) * self.scale.length
        largest = LARGEST_ERROR * jnp.maximum(jnp.max(jnp.abs(thickness)), surface)
        kinetic = first_of(
            (estimate > largest, Status.STEP_TOO_LONG),
            (jnp.asarray(self.of_film) & (jnp.max(thickness) > self.thickest), Status.TOO_THICK),
        )
        return jnp.where(own == Status.FINE, kinetic, own)
