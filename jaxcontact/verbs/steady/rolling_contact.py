"""Pressure and traction of a contact that rolls for ever, found as the limit of rolling cell by cell.

With u the tangential displacement under tractions that are steady (``verbs.steady.rolled``), S the shift by the way
of a step, to the material that is one step behind, the slip in a step is

    s = (1 - S) u(q, p) - shift,      |q| <= mu p,      s = -k q, k >= 0, where |q| = mu p.

It is solved in steps: with M the operator of tractions that have stood for as long as the grid takes to pass,

    s = M q_new + (1 - S) u(q_old, p) - M q_old - shift

is a problem of ``contact.friction``, and its limit the steady state. On an elastic body M q - S M q_old is the slip itself
after one more cell, as in J. J. Kalker's transient contact. On any other a step brings the tractions closer in the norm
of M if |(1 - S) C|^2 < 2 M Re (1 - S) C for the response C to each wave, that is |C|^2/Re C < M: one over the real part
of its complex modulus is less than its compliance after a long time. The way to the limit has no meaning there.

The pressure under the traction is found before each step.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact.contact import friction, nonsymmetric
from jaxcontact.contact.friction import TangentialProblem, TangentialSolution
from jaxcontact.contact.implicit import implied, known_contact, solve_contact
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.verbs.steady.rolled import RolledSurface

STEADY = 1e-7  # change of the tractions from step to step, in parts of what they are,
SMALL = 1e-6  # or, where they are smaller, of this share of what friction holds
FINER = 1e-2  # of the tolerance, in each step: what it leaves in the tractions must be less than a change that counts
COLD = -1  # steps of a state without a first guess of the pressure
FARTHEST = 20  # grid lengths that are rolled


class Rolled(NamedTuple):
    """After some steps, (): the last contact; the change of the tractions in it, in parts of them; whether the pressure
    under them is found as well."""

    pressed: Solution
    sheared: TangentialSolution
    change: Array
    steps: Array
    ended: Array

    @property
    def steady(self) -> Array:
        """True if the state no longer changes, ()."""
        return self.change <= STEADY


@pytree
class RollingContact:
    """Inputs of a rolling contact that are constant from step to step, all of order one.

    surface; profile and coefficient of friction (nx, ny); way of a step, along each axis in its cells, (2,); target and
    tangential_target of ``contact.partial_slip``.
    """

    surface: RolledSurface
    profile: Array
    coefficient: Array
    way: Array
    target: Array
    tangential_target: Array
    tolerance: Array
    max_iterations: Array
    load_controlled: bool = static()
    tangential_load_controlled: bool = static()
    coupled: bool = static()

    def pressed(self, traction: Array) -> Problem:
        """The normal problem under a traction."""
        gap = self.profile + self.surface.normal_from_tangential(traction)
        return Problem(self.surface.normal, gap, self.target, jnp.min(self.profile), self.load_controlled)

    def sheared(self, traction: Array, pressure: Array) -> tuple[TangentialProblem, Array]:
        """Return the tangential problem of the next step, after a traction, and the relaxed displacement under that."""
        moved, relaxed = self.surface.moved(traction, pressure), self.surface.relaxed
        displacement = relaxed.tangential_from_tangential(traction)
        drift = moved - ahead(moved, self.way) - displacement
        bound, target = self.coefficient * pressure, self.tangential_target
        problem = TangentialProblem(relaxed, bound, drift, target, self.tangential_load_controlled)
        return problem, displacement

    def rolled(self) -> Rolled:
        """The steady state, with its derivatives: what sticks, slips and touches is held."""
        found = jax.lax.stop_gradient(jax.lax.stop_gradient(self)._rolled())
        held = _Held(self, found.sheared.stick, found.pressed)
        traction, shift = implied(_law, held, (found.sheared.traction, found.sheared.shift))
        pressed = held.pressed(traction)
        slip = held.slip(traction, shift, pressed.pressure)
        slip = (
            jnp.where(found.pressed.pressure > 0.0, slip - jax.lax.stop_gradient(slip), 0.0)
            + found.sheared.slip
        )
        return found._replace(
            pressed=pressed, sheared=replace(found.sheared, traction=traction, shift=shift, slip=slip)
        )

    def _rolled(self) -> Rolled:
        """Step by step until nothing changes.

        A symmetric normal problem needs no other operator for its first guess, and finds it in the loop: each search is
        compiled for itself.
        """
        nothing, zero, none = (
            jnp.zeros((2, *self.profile.shape)),
            jnp.zeros_like(self.profile),
            jnp.zeros((), int),
        )
        guess, steps = (zero, COLD) if self.surface.normal.symmetric else (self._cold_start(nothing), 0)
        pressed = Solution(guess, zero, jnp.zeros(()), jnp.ones(()), none)
        sheared = TangentialSolution(nothing, nothing, nothing, zero > 0.0, jnp.zeros(2), jnp.ones(()), none)
        before = Rolled(pressed, sheared, jnp.ones(()), none + steps, jnp.zeros((), bool))
        return jax.lax.while_loop(lambda state: ~state.ended, self._further, before)

    def _cold_start(self, traction: Array) -> Array:
        return nonsymmetric.cold_start(self.pressed(traction))

    def _further(self, state: Rolled) -> Rolled:
        """Find the pressure under the last traction, and then the traction of the next step, unless the state is steady.

        Without coupling the first pressure stays.
        """
        cold, first = state.steps == COLD, state.steps == 0
        ends = state.steady | (state.steps >= FARTHEST * max(self.profile.shape))
        tolerance = jnp.where(first | ends, 1.0, FINER) * self.tolerance
        tolerance = jnp.where(cold, nonsymmetric.COLD_TOLERANCE, tolerance)
        limit = jnp.where(cold, nonsymmetric.COLD_ITERATIONS, self.max_iterations)
        problem = self.pressed(state.sheared.traction)
        press = lambda: solve_contact(problem, state.pressed.pressure, tolerance, limit)
        pressed = press() if self.coupled else jax.lax.cond(state.steps <= 0, press, lambda: state.pressed)
        iterations = jnp.where(ends, state.pressed.iterations, pressed.iterations)
        state = state._replace(pressed=replace(pressed, iterations=iterations), ended=ends)
        return jax.lax.cond(
            ends | cold,
            lambda: state._replace(steps=jnp.maximum(state.steps, 0)),
            lambda: self._sheared(state),
        )

    def _sheared(self, state: Rolled) -> Rolled:
        """Roll on by a step under the pressure."""
        traction = state.sheared.traction
        problem, displacement = self.sheared(traction, state.pressed.pressure)
        sheared = friction.solve(problem, traction, displacement, FINER * self.tolerance, self.max_iterations)
        size = jnp.maximum(jnp.sum(jnp.abs(sheared.traction)), SMALL * jnp.sum(problem.bound))
        change = jnp.sum(jnp.abs(sheared.traction - traction)) / jnp.where(size > 0.0, size, jnp.inf)
        change = jnp.where(state.steps > 0, change, 1.0)
        return state._replace(sheared=sheared, change=change, steps=state.steps + 1)


@pytree
class _Held:
    """Data of a steady state: the contact, the cells that stick, (nx, ny) bool, and the normal contact found."""

    contact: RollingContact
    stick: Array
    found: Solution

    def pressed(self, traction: Array) -> Solution:
        """The normal contact found, with its derivatives by the traction under which it was found."""
        return known_contact(self.contact.pressed(traction), self.found)

    def slip(self, traction: Array, shift: Array, pressure: Array) -> Array:
        """Return the slip in a step, (2, nx, ny), under this traction and pressure."""
        moved = self.contact.surface.moved(traction, pressure)
        return moved - ahead(moved, self.contact.way) - shift[:, None, None]


def _law(held: _Held, state: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return the residual of the steady state: slip where cells stick, elsewhere q + mu p slip/|slip|."""
    traction, shift = state
    contact, pressure = held.contact, held.pressed(traction).pressure
    slip = held.slip(traction, shift, pressure)
    size = jnp.sqrt(jnp.sum(slip**2, 0))
    sliding = traction + contact.coefficient * pressure * slip / jnp.where(size > 0.0, size, 1.0)
    asked = jnp.sum(traction, (1, 2)) if contact.tangential_load_controlled else shift
    return jnp.where(held.stick, slip, sliding), asked - contact.tangential_target


def ahead(field: Array, step: Array) -> Array:
    """A field (2, nx, ny) a step further, (2,) of at most a cell each way; linear between cells, and at the grid's end as
    on its last cell."""
    for axis, way in ((1, step[0]), (2, step[1])):
        field = field + jnp.abs(way) * (_next(field, axis, way > 0.0) - field)
    return field


def _next(field: Array, axis: int, forwards: Array) -> Array:
    """Return the values of the neighbours along an axis; at the end of the grid, those of the last cells."""
    first, last = jnp.take(field, jnp.array([0]), axis), jnp.take(field, jnp.array([-1]), axis)
    later = jnp.concatenate([jnp.delete(field, 0, axis), last], axis)
    earlier = jnp.concatenate([first, jnp.delete(field, -1, axis)], axis)
    return jnp.where(forwards, later, earlier)
