"""Steady rolling with friction, as the limit of rolling cell by cell.

From the top: ``RolledSurface``, the operator of tractions that are steady in the frame of the indenter; ``RollingContact``,
the laws of contact and friction and the steps to the steady state; and the public function ``roll_steady``, whose program
``_run`` finds the state and computes forces and powers.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.programs import Program
from jaxcontact._support import checks
from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace, static
from jaxcontact._support.reductions import lowest_point
from jaxcontact._support.status import Status, most_serious
from jaxcontact.bodies.body import LayeredHalfSpace, check_bonded
from jaxcontact.bodies.controls import (
    Control,
    TangentialControl,
    TangentialLoad,
    check_friction,
    check_tangential,
)
from jaxcontact.bodies.grid import Grid, check_free_along_x
from jaxcontact.bodies.laws import Adhesion
from jaxcontact.contact import friction, nonsymmetric
from jaxcontact.contact.adhesive import Attraction, Start
from jaxcontact.contact.friction import TangentialProblem, TangentialSolution, largest_traction
from jaxcontact.contact.implicit import implied, known_contact, solve_attracted, solve_contact
from jaxcontact.contact.law import UNILATERAL
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.history.memory import Observer, RecursiveMemory
from jaxcontact.history.motion import as_vector, check_along_x, check_shape_of_velocity, unit_vectors
from jaxcontact.history.normal_step import cohesive_cells, contact_outcome, resolved, solved, status_of
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.operators.coupled import Tangential, TractionOperator
from jaxcontact.operators.kernels import Errors, TractionKernels, build_traction, scaled_coefficients
from jaxcontact.operators.operator import Operator
from jaxcontact.results.contact import SteadyRolling
from jaxcontact.simulate.run import Experiment, reported
from jaxcontact.simulate.slide_steady import (
    Wake,
    check_steady,
    doubled,
    spectrum_on_grid,
    wake_of,
    with_no_steady_state,
)

# Displacement due to the past tractions of steady rolling: ``simulate.slide_steady`` in three directions.
#
# Tractions that are steady in the frame of the indenter have left, at each rate lambda_k, a history eta_k, and the
# displacement of the surface is
#
#     u = C_0 * t + sum_k lambda_k C_k * eta_k,      t = (q_x, q_y, p),
#
# with the entries of ``operators.coupled``. On an elastic body that is C_0 alone. What lies farther behind than the
# grid is long is felt as points, or in plane strain as lines: of alpha (L, T, K) at wavenumber zero
#
#     xx:  (L y^2 + T x^2)/(2 pi r^3),      xy:  (T - L) x y/(2 pi r^3),      x:  -K x/(2 pi r^2),
#
# or xx: -L ln(r^2)/(2 pi), yy: -T ln(r^2)/(2 pi), x: -K sign(x)/2 (see ``response.coefficients``
# and ``tangential_lines``). Of the displacement along the surface rolling takes differences along the track alone, so
# that it is known but for a constant where a body flows or in plane strain.


@pytree
class RolledSurface:
    """Tractions on the cells -> displacement of a surface that they have rolled over for ever, scaled.

    normal: p -> displacement under it; plane (3, my/2 + 1, mx): spectra of xx, yy, xy; coupling (2, my/2 + 1, mx): of x
    and y, or None; relaxed: the operator of tractions that have stood for as long as the grid takes to pass.
    """

    normal: Operator
    plane: Array
    coupling: Array | None
    relaxed: TractionOperator

    def moved(self, q: Array, p: Array) -> Array:
        """Tangential displacement, (2, nx, ny)."""
        tangential = self.relaxed.tangential
        xx, yy, xy = self.plane
        x, y = tangential.transform(q)
        spectra = jnp.stack([xx * x + xy * y, xy * x + yy * y])
        if self.coupling is not None:
            spectra = spectra + self.coupling * tangential.transform(p)
        return tangential.inverse(spectra, p.shape)

    def plus(self, other: RolledSurface) -> RolledSurface:
        """The sum of two surfaces under one traction, both with couplings or both without."""
        coupling = None
        if self.coupling is not None and other.coupling is not None:
            coupling = self.coupling + other.coupling
        relaxed = self.relaxed.plus(other.relaxed)
        return RolledSurface(self.normal.plus(other.normal), self.plane + other.plane, coupling, relaxed)

    def normal_from_tangential(self, q: Array) -> Array:
        """Normal displacement under a tangential traction, (nx, ny)."""
        if self.coupling is None:
            return jnp.zeros(q.shape[-2:])
        tangential = self.relaxed.tangential
        return tangential.inverse(-jnp.sum(self.coupling * tangential.transform(q), 0), q.shape[-2:])


def elastic_surface(kernels: TractionKernels, normal: Operator) -> RolledSurface:
    """Return the surface with its instantaneous response alone."""
    tangential = kernels.family.combined(jnp.zeros(1 + len(kernels.mix)).at[0].set(1.0))
    coupling = None if tangential.coupling is None else 1j * tangential.coupling
    return RolledSurface(normal, tangential.plane, coupling, TractionOperator(normal, tangential))


def creeping_surface(
    experiment: Experiment, kernels: TractionKernels, wake: Wake, normal: Operator, *, coupled: bool
) -> RolledSurface:
    """Return the surface with the wake of past tractions; ``wake`` is that of the pressure."""
    grid, scale, at_once = experiment.grid, kernels.normal.scale, elastic_surface(kernels, normal)
    wide = replace(grid, shape=doubled(grid.shape, grid.periodic))
    coefficients = scaled_coefficients(kernels.expansion, experiment.indenter, wide, scale)
    shapes = Tangential.of(coefficients, coupled=coupled, periodic=grid.periodic)
    lasting = kernels.expansion.separable.terms[:, 1:, 0] @ kernels.mix
    track = _Track(wake, kernels.rates, kernels.mix, lasting)
    time = wake.crossing_time
    stood = jnp.append(1.0, kernels.mix @ (time * phi1(kernels.rates * time)))
    relaxed = TractionOperator(normal, kernels.family.combined(stood))
    plane, coupling = at_once.plane + track.spectra(shapes.plane, track.far_plane()), None
    if at_once.coupling is not None and shapes.coupling is not None:
        coupling = at_once.coupling + track.spectra(1j * shapes.coupling, track.far_coupling())
    return RolledSurface(normal, plane, coupling, relaxed)


@pytree
class _Track:
    """The track of past tractions at tangential rates (K,).

    mix: (M, K); lasting (3, K): lambda_k C_k of alpha (L, T, K) at wavenumber zero.
    """

    wake: Wake
    rates: Array
    mix: Array
    lasting: Array

    def spectra(self, shapes: Array, far: list[Array]) -> Array:
        """Return the wake of entries from the spectra of S_m on the doubled grid and the response to far sources.

        shapes: (M + 1, n, MY/2 + 1, MX); far: n fields (mx, my).
        """
        mixed = jnp.tensordot(self.mix, self.wake.passage(self.rates), 1)
        shape, periodic = self.wake.shape, self.wake.periodic
        near = jnp.sum(shapes[1:] * mixed[:, None], 0)
        return jnp.stack([spectrum_on_grid(n, shape, periodic, f) for n, f in zip(near, far, strict=True)])

    def far_plane(self) -> list[Array]:
        """xx, yy and xy, (mx, my) each."""
        L, T, _ = self.lasting * (self._cell() / (2.0 * math.pi))
        sum_of = lambda strengths, felt: jnp.tensordot(strengths, felt, 1)
        if self.wake.line:
            felt = self.wake.varying(
                self.rates, lambda x, y: -jnp.log(_square(x, y)), lambda r: -2.0 * jnp.log(r)
            )
            return [sum_of(L, felt), sum_of(T, felt), sum_of(0.0 * L, felt)]
        (ex, ey), cube = self.wake.direction, lambda x, y: _square(x, y) ** 1.5
        xx = self.wake.beyond(self.rates, lambda x, y: x**2 / cube(x, y), ex**2)
        yy = self.wake.beyond(self.rates, lambda x, y: y**2 / cube(x, y), ey**2)
        xy = self.wake.beyond(self.rates, lambda x, y: x * y / cube(x, y), ex * ey)
        return [sum_of(L, yy) + sum_of(T, xx), sum_of(T, yy) + sum_of(L, xx), sum_of(T - L, xy)]

    def far_coupling(self) -> list[Array]:
        """x and y, (mx, my) each."""
        strength = -self.lasting[2] * self._cell()
        ex, ey = self.wake.direction
        if self.wake.line:
            flows = self.rates == 0.0
            rates, length = jnp.where(flows, 1.0, self.rates), jnp.exp(-self.rates * self.wake.crossing_time)
            felt = jnp.sum(jnp.where(flows, 0.0, strength * length / rates)) * ex / 2.0
            return [felt, jnp.zeros(())]
        x = self.wake.beyond(self.rates, lambda x, y: x / _square(x, y), ex)
        y = self.wake.beyond(self.rates, lambda x, y: y / _square(x, y), ey)
        return [jnp.tensordot(strength / (2.0 * math.pi), each, 1) for each in (x, y)]

    def _cell(self) -> Array | float:
        """Area of a cell in squares of its side along x, or in plane strain its side; nothing where creep ends far off."""
        if not self.wake.far_off:
            return 0.0
        return 1.0 if self.wake.line else self.wake.ratio


def _square(x: Array, y: Array) -> Array:
    """r^2 of places far off."""
    return jnp.maximum(x**2 + y**2, 1.0)


# Pressure and traction of a contact in steady rolling, found as the limit of rolling cell by cell.
#
# With u the tangential displacement under tractions that are steady, and (S u)(x) = u(x + d), d the distance rolled in a
# step, the displacement of the same material one step earlier, the slip in a step is
#
#     s = (1 - S) u(q, p) - turn - shift,      |q| <= mu p,      s = -k q, k >= 0, where |q| = mu p,
#
# with the turn by the spin and the shift by the creepage in a step.
#
# It is solved in steps. With M the operator of tractions that are constant during one passage of the grid,
#
#     s = M q_new + (1 - S) u(q_old, p) - M q_old - turn - shift
#
# is a problem of ``contact.friction``, and its limit the steady state. On an elastic body M q - S M q_old is the slip
# itself after one more cell, as in J. J. Kalker's transient contact. On any other a step brings the tractions closer
# in the norm of M if |(1 - S) C|^2 < 2 M Re (1 - S) C for the response C to each wave, that is |C|^2/Re C < M: one
# over the real part of its complex modulus is less than its compliance after a long time. The way to the limit has no
# meaning there.
#
# With coupling the pressure under the traction is found before each step, with adhesion from that before; otherwise once.
# With adhesion mu p is replaced by mu p_c + tau in cells that touch, and by zero elsewhere (``friction.largest_traction``).


STEADY = 1e-7  # relative change of the tractions from step to step at which the state counts as steady,
SETTLED = 10.0  # or this many times the tolerance, if that is less,
ROUNDED = 1e-9  # but not less than rounding may leave with coupled solids and films
SMALL = 1e-6  # part of the friction bound to which the change of smaller tractions is relative
FINER = 1e-2  # tolerance of each step over that of the result, so that its error is below the change that is tested
COLD = -1  # number of steps that stands for a state without a first guess of the pressure
FARTHEST = 20  # largest distance that is rolled, in lengths of the grid


class Rolled(NamedTuple):
    """The state after some steps.

    pressed, sheared: the last normal and tangential solution; change: of the tractions in the last step, over their sum;
    steps: number of steps made; ended: whether the pressure under the last tractions is found too. () each.
    """

    pressed: Solution
    sheared: TangentialSolution
    change: Array
    steps: Array
    ended: Array


@pytree
class RollingContact:
    """Inputs of a rolling contact that are constant from step to step, all of order one.

    surface; profile and coefficient of friction (nx, ny); strength: shear strength of a contact with adhesion, () or
    (nx, ny), zero without; way of a step, along each axis in its cells, (2,); turn (2, nx, ny): displacement of the indenter
    in a step due to its spin; target and tangential_target of ``contact.friction``; law: an ``Attraction`` with adhesion.
    """

    surface: RolledSurface
    profile: Array
    coefficient: Array
    strength: Array
    way: Array
    turn: Array
    target: Array
    tangential_target: Array
    tolerance: Array
    max_iterations: Array
    load_controlled: bool = static()
    tangential_load_controlled: bool = static()
    coupled: bool = static()
    law: Any = UNILATERAL

    @property
    def adheres(self) -> bool:
        return isinstance(self.law, Attraction)

    def pressed(self, traction: Array) -> Problem:
        """The normal problem under a traction."""
        gap = self.profile + self.surface.normal_from_tangential(traction)
        lowest = lowest_point(self.profile)
        return Problem(self.surface.normal, gap, self.target, lowest, self.load_controlled, self.law)

    def bound(self, pressed: Solution) -> Array:
        """The largest traction under a normal contact, (nx, ny)."""
        return largest_traction(self.coefficient, pressed.carried, self.strength)

    def sheared(self, traction: Array, pressed: Solution) -> tuple[TangentialProblem, Array]:
        """Return the tangential problem of the next step, after a traction, and the relaxed displacement under that."""
        moved, relaxed = self.surface.moved(traction, pressed.pressure), self.surface.relaxed
        displacement = relaxed.tangential_from_tangential(traction)
        drift = moved - ahead(moved, self.way) - displacement - self.turn
        bound, target = self.bound(pressed), self.tangential_target
        contact, forced = pressed.carried > 0.0, self.tangential_load_controlled
        problem = TangentialProblem(relaxed, bound, contact, drift, target, forced)
        return problem, displacement

    def steady(self, state: Rolled) -> Array:
        """True if a state no longer changes, ()."""
        return state.change <= jnp.clip(SETTLED * self.tolerance, ROUNDED, STEADY)

    def rolled(self) -> Rolled:
        """The steady state, with its derivatives: what sticks, slips and touches is held."""
        # 1. Step by step until nothing changes. A symmetric normal problem needs no other operator for its first guess, and
        # finds it in the loop: each search is compiled for itself. With adhesion it begins from a distance.
        held_fixed, shape = jax.lax.stop_gradient(self), self.profile.shape
        nothing, zero = jnp.zeros((2, *shape)), jnp.zeros_like(self.profile)
        guess, steps, none, no = zero, COLD, jnp.zeros((), int), jnp.zeros((), bool)
        if self.adheres:
            steps = 0
        elif not self.surface.normal.symmetric:
            guess, steps = nonsymmetric.cold_start(held_fixed.pressed(nothing)), 0
        pressed = Solution(guess, zero, jnp.zeros(()), jnp.ones(()), none)
        if self.adheres:
            pressed = replace(pressed, contact_pressure=zero, separated=no, unstable=no)
        sheared = TangentialSolution(nothing, nothing, nothing, zero > 0.0, jnp.zeros(2), jnp.ones(()), none)
        before = Rolled(pressed, sheared, jnp.ones(()), none + steps, no)
        found = jax.lax.while_loop(lambda state: ~state.ended, held_fixed._further, before)

        # 2. The derivatives of the state that was found.
        found = jax.lax.stop_gradient(found)
        pressed = found.pressed
        if not self.coupled:  # its derivatives, which do not depend on those of the traction
            pressed = known_contact(self.pressed(found.sheared.traction), pressed)
        held = _Held(self, found.sheared.stick, pressed)
        traction, shift = implied(_law, held, (found.sheared.traction, found.sheared.shift))
        pressed = held.pressed(traction)
        # the slip that was found, with the derivatives of its formula in contact
        slip = held.slip(traction, shift, pressed.pressure)
        slip = (
            jnp.where(found.pressed.carried > 0.0, slip - jax.lax.stop_gradient(slip), 0.0)
            + found.sheared.slip
        )
        return found._replace(
            pressed=pressed, sheared=replace(found.sheared, traction=traction, shift=shift, slip=slip)
        )

    def _further(self, state: Rolled) -> Rolled:
        """Find the pressure under the last traction, and then the traction of the next step, unless the state is steady.

        Without coupling the first pressure stays.
        """
        cold, first = state.steps == COLD, state.steps == 0
        # the distance rolled in cells; an oblique step may be less than a cell along each axis
        rolled = state.steps * jnp.max(jnp.abs(jax.lax.stop_gradient(self.way)))
        ends = self.steady(state) | (rolled >= FARTHEST * max(self.profile.shape))
        tolerance = jnp.where(first | ends, 1.0, FINER) * self.tolerance
        tolerance = jnp.where(cold, nonsymmetric.COLD_TOLERANCE, tolerance)
        limit = jnp.where(cold, nonsymmetric.COLD_ITERATIONS, self.max_iterations)
        problem = self.pressed(state.sheared.traction)
        if self.adheres:
            start = Start(state.pressed.pressure, state.pressed.carried > 0.0, first)
            press = lambda: solve_attracted(problem, start, tolerance, limit)
        else:
            press = lambda: solve_contact(problem, state.pressed.pressure, tolerance, limit)
        pressed = press() if self.coupled else jax.lax.cond(state.steps <= 0, press, lambda: state.pressed)
        # the last search only renews the pressure: its iterations are not those of a step
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
        problem, displacement = self.sheared(traction, state.pressed)
        sheared = friction.solve(problem, traction, displacement, FINER * self.tolerance, self.max_iterations)
        size = jnp.maximum(jnp.sum(jnp.abs(sheared.traction)), SMALL * jnp.sum(problem.bound))
        change = jnp.sum(jnp.abs(sheared.traction - traction)) / jnp.where(size > 0.0, size, jnp.inf)
        change = jnp.where(state.steps > 0, change, 1.0)
        return state._replace(sheared=sheared, change=change, steps=state.steps + 1)


@pytree
class _Held:
    """Data of a steady state: the contact, the cells that stick, (nx, ny) bool, and the normal contact found,
    with its derivatives where it does not depend on the traction."""

    contact: RollingContact
    stick: Array
    found: Solution

    def pressed(self, traction: Array) -> Solution:
        """The normal contact found, with its derivatives by the traction under which it was found."""
        if not self.contact.coupled:
            return self.found
        return known_contact(self.contact.pressed(traction), self.found)

    def slip(self, traction: Array, shift: Array, pressure: Array) -> Array:
        """Return the slip in a step, (2, nx, ny), under this traction and pressure."""
        moved = self.contact.surface.moved(traction, pressure)
        return moved - ahead(moved, self.contact.way) - self.contact.turn - shift[:, None, None]


def _law(held: _Held, state: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return the residual of the steady state: slip where cells stick, elsewhere q + b slip/|slip| with the bound b."""
    traction, shift = state
    contact, pressed = held.contact, held.pressed(traction)
    slip = held.slip(traction, shift, pressed.pressure)
    size = friction.length(slip)
    sliding = traction + contact.bound(pressed) * slip / jnp.where(size > 0.0, size, 1.0)
    asked = jnp.sum(traction, (1, 2)) if contact.tangential_load_controlled else shift
    return jnp.where(held.stick, slip, sliding), asked - contact.tangential_target


def ahead(field: Array, step: Array) -> Array:
    """A field (2, nx, ny) a step further, (2,) of at most a cell each way; linear between cells, and at the grid's end as
    on its last cell.

    By a component of zero the derivative is the mean of those on either side, the central difference of the field.
    """
    for axis, way in ((1, step[0]), (2, step[1])):
        first, last = jnp.take(field, jnp.array([0]), axis), jnp.take(field, jnp.array([-1]), axis)
        later = jnp.concatenate([jnp.delete(field, 0, axis), last], axis)
        earlier = jnp.concatenate([first, jnp.delete(field, -1, axis)], axis)
        field = field + jnp.maximum(way, 0.0) * (later - field) + jnp.minimum(way, 0.0) * (field - earlier)
    return field


def roll_steady(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    *,
    velocity: Array | float,
    creepage: Array | TangentialLoad,
    friction: Array | float,
    grid: Grid,
    spin: Array | float = 0.0,
    coupled: bool = True,
    tolerance: Array | float = 1e-8,
    max_iterations: Array | int = 2000,
    adhesion: Adhesion | None = None,
    shear_strength: Array | float | None = None,
) -> SteadyRolling:
    """Compute the steady state of an indenter that rolls over a body, with creepage or a tangential force, and spin.

        slip/distance = -v/|v| . grad u - creepage - spin (-y, x)
        |q| <= mu p,      slip = -k q, k >= 0, where |q| = mu p

    With adhesion the bound mu p is replaced by mu p_c + tau where the surfaces touch, and by zero elsewhere, with the
    pressure p_c that contact carries and the shear strength tau. Here slip is that of the body's surface over the indenter,
    v the velocity, and u the sum of the tangential displacements of both surfaces, which on a viscoelastic body includes the
    effect of all earlier tractions. Material enters the contact without traction at the leading edge. The gradient is the
    difference between neighbouring cells along the track, interpolated for oblique directions, so that the error is of first
    order in the cell size. The steady state is the limit of transient rolling, and derivatives in both modes are those of
    the steady state at constant areas of contact, stick and slip.

    In plane strain a cylinder rolls along x; a creepage along y causes antiplane shear.

    Args:
        body: a ``LayeredHalfSpace``.
        indenter, grid: as in ``indent``; a grid that is periodic along both axes is rejected. The surface of an indenter
            that creeps or is coated moves through the contact as the body's does, with a wake of its own.
        control: ``Load`` or ``Approach`` with a single value.
        velocity: velocity of the indenter over the body [m/s], not zero: a number (along x) or (2,). For elastic bodies
            only its direction matters.
        creepage: (xi_x, xi_y), the slip velocity of the indenter over the body, both taken as rigid, over |v|; or a
            ``TangentialLoad`` with one vector, for which the creepage is computed.
        spin: rotation of the indenter over the body from x to y about its axis, both taken as rigid, over the distance
            rolled [1/m]; a wheel whose axle is inclined by an angle g to the surface has sin(g)/radius. 0 in plane strain.
        friction, coupled, tolerance, max_iterations: as in ``shear``; the limit applies to each step of the transient.
        adhesion: as in ``indent``; the control may then be negative. p_c is the net pressure plus the attraction
            (``contact_pressure`` of the result). The surfaces approach from a distance, as in ``slide_steady``, which states
            on what bodies the search converges. With ``coupled`` the traction changes the pressure, and what touches.
        shear_strength: tau, with adhesion alone: as in ``shear``, but with every value of ``coupled``.

    Returns:
        A ``SteadyRolling``. Failures are reported in its status, as in ``shear``. It is 6 if the tractions still change
        after rolling over 20 lengths of the grid, or if ``slide_steady`` has no steady state. With adhesion it has
        ``contact_pressure`` and others.

    Raises:
        ValueError: invalid or unsupported input, or a case without steady state, as in ``slide_steady``.

    Example:
        >>> steel, grid = jc.Elastic.from_young(210e9, nu=0.3), jc.Grid.square(n=16, width=300e-6)
        >>> rail, wheel = jc.LayeredHalfSpace([], substrate=steel), jc.Sphere(9.5e-3, steel)
        >>> rolling = jc.roll_steady(
        ...     rail, wheel, jc.Load(20.0), velocity=1.0, creepage=(1e-3, 0.0), friction=0.3, grid=grid, coupled=False
        ... )
        >>> bool(0.0 < rolling.tangential_load[0] < 0.3 * 20.0)
        True
    """
    experiment = Experiment.of(
        body, indenter, control, np.zeros(1), grid, tolerance=tolerance, max_iterations=max_iterations, adhesion=adhesion,
        shear_strength=shear_strength,
    )  # fmt: skip
    check_free_along_x(grid, "roll_steady")
    for each in experiment.surfaces:
        check_bonded(each, "roll_steady")

    # one value of the control, one direction, and a creepage or a tangential load
    shape = np.shape(getattr(control, "value", 0.0))
    checks.require(
        shape == (), f"{type(control).__name__}: expected one number in the steady state, got shape {shape}"
    )
    check_shape_of_velocity(velocity)
    fastest = jnp.max(jnp.abs(velocity)) if not is_concrete(velocity) else np.max(np.abs(velocity))
    valid = checks.positive("velocity [m/s] (its size)", fastest)
    forced = isinstance(creepage, TangentialControl)
    if isinstance(creepage, TangentialControl):
        checks.require(
            isinstance(creepage, TangentialLoad),
            f"creepage: expected (x, y) or a TangentialLoad, got {creepage!r}",
        )
        valid, value = valid & check_tangential(creepage, 1), creepage.value
    else:
        value, shape = creepage, np.shape(creepage)
        checks.require(shape == (2,), f"creepage: expected (x, y) or a TangentialLoad, got shape {shape}")
        valid = valid & checks.finite("creepage", creepage)
    valid = valid & check_friction(friction, grid.shape)
    valid = valid & check_along_x(np.shape(velocity), grid)
    for each in experiment.surfaces:
        valid = valid & check_steady(experiment, each, velocity)
    checks.require(np.shape(spin) == (), f"spin: expected one number, got shape {np.shape(spin)}")
    checks.require(
        not grid.plane_strain or (is_concrete(spin) and float(spin) == 0.0),
        f"spin [1/m]: expected 0 in plane strain, got {spin}",
    )
    experiment = experiment.also(valid & checks.finite("spin [1/m]", spin))

    speed, value, friction, spin = (jnp.asarray(as_float64(a)) for a in (velocity, value, friction, spin))
    kernels = build_traction(experiment.body, experiment.indenter, experiment.grid, coupled=bool(coupled))
    options = {"forced": forced, "coupled": bool(coupled)}
    result, errors = _run(experiment, kernels, speed, value, friction, spin, **options)
    return reported(result, errors, experiment)


@functools.partial(
    Program,
    static_argnames=("forced", "coupled"),
    work=lambda experiment, *_, **__: 700.0 * experiment.work,
)
def _run(
    experiment: Experiment,
    kernels: TractionKernels,
    velocity: Array,
    value: Array,
    friction: Array,
    spin: Array,
    *,
    forced: bool,
    coupled: bool,
) -> tuple[SteadyRolling, Errors]:
    """Solve the rolling contact, compiled once for equal shapes and options, and observe it."""
    grid, scale, spacing = experiment.grid, kernels.normal.scale, jnp.stack(experiment.grid.spacing)
    vector = as_vector(velocity)
    speed = jnp.sqrt(jnp.sum(vector**2))
    direction, step = unit_vectors(vector), spacing[0] if velocity.ndim == 0 else jnp.min(spacing)

    # the surface, elastic or with the wake of the tractions, and what it shows of a pressure: of the body, and of an
    # indenter that creeps or is coated, which moves through the contact with the same velocity
    def rolled_over(
        body: LayeredHalfSpace, kernels: TractionKernels
    ) -> tuple[RolledSurface, Callable[[Array], dict[str, Array]]]:
        if not kernels.normal.rates.size:
            memory, no_time = RecursiveMemory(kernels.normal), jnp.zeros(())
            no_history = memory.start(grid.shape)
            operator = memory.predict(no_history, jnp.zeros(grid.shape), no_time).operator
            observe = lambda p: {**memory.observe(no_history, p, no_time), "hysteresis_power": no_time}
            return elastic_surface(kernels, operator), observe
        moved = vector / scale.length
        wake = wake_of(body, grid, kernels.normal, moved, across=velocity.ndim > 0)
        symbols = wake.symbols()
        surface = creeping_surface(experiment, kernels, wake, wake.operator(symbols), coupled=coupled)
        return surface, lambda p: {
            "film_strain": wake.film_strain(symbols, p),
            "hysteresis_power": wake.lost_power(symbols, p),
        }

    surface, observe_body = rolled_over(experiment.body, kernels)
    of_indenter, own = None, experiment.indenter.surface()
    if own is not None and kernels.indenter is not None:
        of_indenter, observe_indenter = rolled_over(own, kernels.indenter)
        surface = surface.plus(of_indenter)

    # with adhesion a law of attraction in the place of hard contact, and the shear strength
    law: Any = UNILATERAL
    strength = jnp.zeros(())
    if experiment.shear_strength is not None:
        strength = scale.from_si("pressure", experiment.shear_strength)
    if experiment.adhesion is not None:
        law = resolved(experiment.attraction(scale), surface.normal, grid.shape)

    # the contact, in steps of a cell along x, or in other directions of the shorter side of a cell
    profile = experiment.indenter.profile(grid) / scale.length
    force = scale.from_si("tangential_load", value).reshape(2) if forced else value
    distance = step / spacing[0]  # rolled in a step, in sides of a cell along x
    x, y = (jnp.broadcast_to(each, grid.shape) for each in grid.coordinates())
    contact = RollingContact(
        surface=surface,
        profile=profile,
        coefficient=jnp.broadcast_to(friction, profile.shape),
        strength=strength,
        way=step / spacing * direction,
        turn=distance * spin * jnp.stack([-y, x]),
        target=experiment.target(scale),
        tangential_target=force if forced else distance * value,
        tolerance=experiment.tolerance,
        max_iterations=experiment.max_iterations,
        load_controlled=experiment.load_controlled,
        tangential_load_controlled=forced,
        coupled=coupled,
        law=law,
    )
    rolled = contact.rolled()
    pressed, sheared = rolled.pressed, rolled.sheared
    problem = contact.pressed(sheared.traction)
    by_traction = surface.normal_from_tangential(sheared.traction)
    numbers = contact_outcome(problem, pressed) | {
        "displacement": pressed.displacement + by_traction,
        "traction": sheared.traction,
        "slip_ratio": sheared.slip / distance,
        "stick": sheared.stick,
        "tangential_load": jnp.sum(sheared.traction, (1, 2)),
        "creepage": sheared.shift / distance,
        "error": jnp.maximum(pressed.error, sheared.error),
        "iterations": pressed.iterations + sheared.iterations,
    }

    # the status of the normal contact, or of the tangential one if that was not found or has no steady state; without a
    # solution, that rolling has not settled is no property of the body
    status = status_of(problem, pressed, experiment.tolerance, experiment.edges)
    met = solved(sheared.error, experiment.tolerance, sheared.traction, sheared.slip, sheared.shift)
    found = met & (status != Status.NOT_CONVERGED) & (status != Status.NOT_FINITE)
    status = most_serious(
        (found & ~contact.steady(rolled), Status.NOT_STEADY), (~met, Status.NOT_CONVERGED), status=status
    )
    if forced:
        wanted, most = contact.tangential_target, jnp.sum(contact.bound(pressed))
        held = jnp.sum(wanted**2) < most**2
        status = most_serious((~held & jnp.any(wanted != 0.0), Status.GROSS_SLIP), status=status)
    for each in experiment.surfaces:
        status = with_no_steady_state(status, experiment, each, vector)
    numbers["status"] = status

    if experiment.adhesion is not None:
        numbers |= {
            "contact_pressure": pressed.carried,
            "shear_strength": jnp.broadcast_to(strength, profile.shape),
            "cohesive_cells": cohesive_cells(problem, pressed),
        } | {name: values[0] for name, values in experiment.tabor_number.items()}

    # what each surface shows of the pressure; both lose power
    numbers |= observe_body(pressed.pressure)
    if of_indenter is not None:
        its_own = observe_indenter(pressed.pressure)
        numbers["hysteresis_power"] = numbers["hysteresis_power"] + its_own["hysteresis_power"]
        moved = of_indenter.normal(pressed.pressure) + of_indenter.normal_from_tangential(sheared.traction)
        numbers |= {"indenter_film_strain": its_own["film_strain"], "indenter_displacement": moved}

    # Friction takes the work of the tangential force and of the moment and, where the solids are unlike, of the pressure on
    # a surface that the traction moves: -int q . slip = Q . creepage + M spin + int q . du/ds, and of u only the part due to
    # the pressure is not zero on elastic bodies, whose integral is -int p dw/ds with the normal displacement w under the
    # traction (Betti): the power of a force ``coupling_force`` against the motion.
    coupling_force = jnp.zeros(())
    if coupled:
        flat = Observer.of(jnp.zeros_like(profile), spacing[1] / spacing[0])
        coupling_force = -flat.hysteresis(pressed.pressure, by_traction, direction)
    in_si = scale.to_si(**numbers, profile=profile, lateral_force=coupling_force)
    coupling_force = in_si.pop("lateral_force")
    q_x, q_y = in_si["traction"]
    moment = grid.cell_area * jnp.sum(x * q_y - y * q_x)
    by_creepage = jnp.sum(in_si["tangential_load"] * in_si["creepage"])
    friction_power = speed * (by_creepage + moment * spin + coupling_force)
    in_si |= {
        "spin": spin,
        "moment": moment,
        "friction_power": friction_power,
        "power": in_si["hysteresis_power"] + friction_power,
        "hysteresis_force": in_si["hysteresis_power"] / speed,
    }
    return SteadyRolling(grid=grid, velocity=vector, **in_si), kernels.errors()
