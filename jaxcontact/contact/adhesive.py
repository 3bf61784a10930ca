"""Normal contact with adhesion on the grid, by a projected Newton method for the displacement.

    p = K^-1 u = p_c - s(g),     g = u + gap - approach >= 0,     p_c >= 0,     p_c g = 0,

with the attraction s (``Attraction``). A solution is a local minimum of the energy

    E = 1/2 <u, K^-1 u> - sum int_g^infinity s dg  [- load x approach]

over displacements that leave no gap negative; under a given load the approach is an unknown as well. There may be several.
The method lowers the energy from the state it starts with, so that a march follows its branch of solutions to its end, and
then jumps to a state of lower energy.

The displacement lives on the padded grid of the convolution, where K is circulant and K^-1 a division of spectra; in the
padding the pressure is zero. An iteration takes the cells that touch under a positive p_c as held at the wall, and on the
others minimises the quadratic model of the energy, by conjugate gradients preconditioned by K between projections. Cells
that would penetrate are held and the model is minimised again, up to ``ROUNDS`` times. Of the step as much is taken as
lowers the energy, which needs no convolution. The model may have directions of negative curvature, which the conjugate
gradients follow or stop at. Where little of a step was usable, the next one holds the attraction as it is and solves the
contact without adhesion under it (``contact.normal``). Since the attraction falls with the gap, the energy with its
linear part alone bounds the energy from above, so that this cannot raise it.

Under a given load the cells that are held move with the indenter, as one unknown. On a grid periodic along both axes
the mean displacement is zero: under a given approach steps have zero mean, under a given load it is subtracted from
displacement and approach in the end.

The stopping error is dimensionless:

    max( largest displacement K r under the traction r that is left over, largest gap of held cells ) / u_m,

where r is p + s on cells that do not touch and p in the padding, and u_m is the mean of |u|, weighted by |p|. The approach,
which measures displacements without adhesion (``contact.normal``), is not suitable: on a stiff body, or between separated
surfaces, it may exceed all displacements, and tractions of any size would be accepted. Under a load, the difference between
the load and the sum of p, over the sum of |p|, is an error as well. Where layers make K on the padded grid indefinite, the
amount by which it differs from K on the grid is added to the error.

Under a tensile load without any cell in contact there is no stable state: the surfaces have separated.

Sources: projected Newton and conjugate gradients: J. Nocedal, S. J. Wright, Numerical Optimization, 2006, sec. 7.1
and 16.7; the bound from above, whose minimisation lowers the energy: D. R. Hunter, K. Lange, Am. Stat. 58 (2004) 30.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact._support.reductions import lowest_point
from jaxcontact.contact import normal
from jaxcontact.contact.friction import largest_traction
from jaxcontact.contact.krylov import conjugate_gradients
from jaxcontact.contact.law import UNILATERAL
from jaxcontact.contact.normal import Problem, Solution, masked_mean
from jaxcontact.operators.operator import Linear, Operator

# Attraction between the surfaces on the grid: tractions and energy of a field of gaps.
#
# A law of adhesion is averaged over 2 x 2 points inside each square of four cells' centres, with the gap bilinear
# between them (Gauss-Legendre points; two points between neighbours in plane strain). Taken at the centres alone, a
# short-ranged law would hold the edge of contact at rows of cells, and a contact would separate at too high a
# tension. The tractions are the derivative of the averaged energy with respect to the gaps, so that they are
# conservative on the grid as well.


# Where the grid ends an attraction matters above the first part of its largest traction if, over all cells of the grid, it
# would be more than the second part of the load that the contact carries.
WEAK, NEGLIGIBLE = 0.01, 1e-3
POINTS = 0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5


class CohesiveLaw(Protocol):
    """Interface of a law of adhesion (``bodies.laws``), scaled: functions of the gap, cell by cell."""

    @property
    def work(self) -> Array | float:
        """The work of adhesion int_0^infinity s dg, ()."""

    @property
    def largest_traction(self) -> Array:
        """The attraction at a gap of zero, ()."""

    @property
    def characteristic_range(self) -> Array:
        """The work over the largest traction, ()."""

    def traction(self, gap: Array) -> Array:
        """Return the attraction s(g) >= 0."""

    def energy(self, gap: Array) -> Array:
        """Return int_g^infinity s dg."""

    def stiffness(self, gap: Array) -> Array:
        """Return -ds/dg >= 0."""

    def resolved(self, cell_compliance: Array) -> Any:
        """Return the law as cells of a compliance can resolve it."""

    def zone_length(self, modulus: Any) -> Array:
        """Return the length of the zone of attraction at the edge of contact."""


@pytree
class Attraction:
    """A scaled law of adhesion, averaged on the cells of a grid; periodic: along x and y."""

    law: CohesiveLaw
    periodic: tuple[bool, bool] = static()

    def touching(self, contact_pressure: Array) -> Array:
        """Return the cells in contact, (nx, ny) bool."""
        return contact_pressure > 0.0

    def acting(self, contact_pressure: Array, gap: Array) -> Array:
        """Return the cells that touch, or attract each other by more than ``WEAK`` and ``NEGLIGIBLE``, (nx, ny) bool."""
        attraction = self.traction(jnp.maximum(gap, 0.0))
        matters = attraction * attraction.size > NEGLIGIBLE * jnp.sum(contact_pressure)
        return self.touching(contact_pressure) | (attraction > WEAK * self.law.largest_traction) & matters

    def energy(self, gap: Array) -> Array:
        """Return the sum over cells of int_g^infinity s dg, ()."""
        points, weights = self._points(gap), _weights(gap.shape, self.periodic)
        return jnp.sum(weights * self.law.energy(points))

    def traction(self, gap: Array) -> Array:
        """Return the attraction of each cell, (nx, ny) >= 0."""
        return self._spread(gap, self.law.traction(self._points(gap)))

    def stiffness(self, gap: Array) -> Array:
        """Return -ds/dg at the points of a field of gaps, for ``softened``."""
        return self.law.stiffness(self._points(gap))

    def softened(self, stiffness: Array, change: Array) -> Array:
        """Return the decrease of the cells' attraction, (nx, ny), for a change of the gaps; linear and symmetric."""
        return self._spread(change, stiffness * self._points(change))

    def explicit(self, change: CohesiveLaw, gap: Array) -> Array:
        """Return the change of the cells' attraction for a change of the law's parameters, (nx, ny)."""
        points = self._points(gap)
        return self._spread(gap, jax.jvp(lambda law: law.traction(points), (self.law,), (change,))[1])

    def _points(self, gap: Array) -> Array:
        """Return the gaps at the points, (2, 2, squares along x, squares along y)."""
        return _between(_between(gap, 0, self.periodic[0]), 2, self.periodic[1])

    def _spread(self, gap: Array, values: Array) -> Array:
        """Return what the cells take of values at the points, (nx, ny): the transpose of ``_points``, weighted."""
        weighted = _weights(gap.shape, self.periodic) * values
        return jax.linear_transpose(self._points, gap)(weighted)[0]


def _between(field: Array, axis: int, wraps: bool) -> Array:
    """Return a field at the points between neighbours along an axis, with a new first axis of the points."""
    if field.shape[axis] == 1:
        return field[None]
    ahead = [(0, 0)] * field.ndim
    ahead[axis] = (0, 1) if wraps else (1, 1)
    padded = jnp.pad(field, ahead, mode="wrap" if wraps else "edge")
    here = jax.lax.slice_in_dim(padded, 0, padded.shape[axis] - 1, axis=axis)
    there = jax.lax.slice_in_dim(padded, 1, padded.shape[axis], axis=axis)
    return jnp.stack([(1.0 - t) * here + t * there for t in POINTS])


def _weights(shape: tuple[int, ...], periodic: tuple[bool, bool]) -> Array:
    """Return the part of a cell that each point stands for, (squares along x, squares along y)."""
    x, y = (
        jnp.ones(1)
        if n == 1
        else 0.5 * (jnp.ones(n) if wraps else jnp.ones(n + 1).at[jnp.array([0, n])].set(0.5))
        for n, wraps in zip(shape, periodic, strict=True)
    )
    return x[:, None] * y[None, :]


# The quadratic model of the energy of an adhesive contact.
#
# Some cells are held at the wall; displacements change in the space that this leaves. The model is K^-1 less the
# softening by the attraction, and may have directions of negative curvature.


class Move(NamedTuple):
    """A change of the displacement on the padded grid, of K^-1 times it, and of the approach."""

    displacement: Array
    pressure: Array
    approach: Array


@pytree
class HeldCells:
    """The space in which displacements change while some cells are held at the wall.

    held: (mx, my) bool. Under a load the held cells move together, with the approach; under an approach on a periodic grid
    (``of_zero_mean``) changes have zero mean.
    """

    held: Array
    load_controlled: bool = static()
    of_zero_mean: bool = static()

    def __call__(self, values: Array) -> Array:
        """Return the orthogonal projection onto the space."""
        free = jnp.where(self.held, 0.0, values)
        if self.of_zero_mean:
            return free - jnp.where(self.held, 0.0, masked_mean(values, ~self.held))
        if self.load_controlled:
            return free + jnp.where(self.held, masked_mean(values, self.held), 0.0)
        return free

    def lift(self, values: Array) -> Array:
        """Return a displacement with the given values on the held cells, and of zero mean where it must be."""
        held = jnp.where(self.held, values, 0.0)
        if not self.of_zero_mean:
            return held
        spread = -jnp.sum(held) / jnp.maximum(jnp.sum(~self.held), 1)
        return held + jnp.where(self.held, 0.0, spread)

    def approach(self, change: Array) -> Array:
        """Return the approach that goes with a displacement of the space, ()."""
        return masked_mean(change, self.held) if self.load_controlled else jnp.zeros(())


@pytree
class Model:
    """The tangent of the tractions at a state: K^-1 less the softening by attraction.

    stiffness: of the attraction at its points.
    """

    inverse: Linear
    attraction: Attraction
    stiffness: Array
    faces: HeldCells

    def __call__(self, change: Array) -> Array:
        """Return the change of the tractions for a displacement of the space, projected; symmetric."""
        return self.tractions(change, self.inverse(change), self.faces.approach(change))

    def tractions(self, displacement: Array, pressure: Array, approach: Array) -> Array:
        """Return the change of the tractions for a displacement, K^-1 times it and an approach, projected."""
        nx, ny = self.shape
        softened = self.attraction.softened(self.stiffness, displacement[:nx, :ny] - approach)
        return self.balanced(pressure, -softened)

    def balanced(self, pressure: Array, attraction: Array, load: Array | float = 0.0) -> Array:
        """Return pressures (mx, my) and attraction (nx, ny) that are not balanced by contact or load, projected."""
        nx, ny = self.shape
        left = pressure.at[:nx, :ny].add(jnp.where(self.faces.held[:nx, :ny], 0.0, attraction))
        if self.faces.load_controlled:
            apart = jnp.sum(jnp.where(self.faces.held[:nx, :ny], 0.0, attraction)) + load
            left = left - jnp.where(self.faces.held, apart / jnp.maximum(jnp.sum(self.faces.held), 1), 0.0)
        return self.faces(left)

    @property
    def shape(self) -> tuple[int, int]:
        """Cells of the grid inside the padded one."""
        squares, periodic = self.stiffness.shape[-2:], self.attraction.periodic
        nx, ny = (n if wraps else n - 1 for n, wraps in zip(squares, periodic, strict=True))
        return nx, ny


# The state of a search for an adhesive contact: its gaps and tractions on the grid, its stopping error and its
# energy.


CLOSE = 1e-3  # a cell under pressure touches up to this part of the gap that the largest traction closes
FAINT = 1e-6  # least displacement that counts, relative to that of a cell under the largest attraction
VANISHING = 1e-10  # largest traction over the pressure, below which ``CLOSE`` is relative to the pressure
# accuracy of gaps at the usual tolerance, relative to the approach, since they are differences
RESOLVED = 1e-8


class Start(NamedTuple):
    """Initial pressure and contact cells (nx, ny) of a search, from a similar state; none: there is no such state."""

    pressure: Array
    contact: Array
    none: Array


class SearchState(NamedTuple):
    """The state of a search after an iteration, on the padded grid."""

    displacement: Array  # (mx, my)
    pressure: Array  # K^-1 times it
    approach: Array
    error: Array
    part: Array  # of the last step that was taken
    lost: Array  # iterations in a row without contact
    bent: Array  # whether a direction of negative curvature was met
    iterations: Array


class SearchTools(NamedTuple):
    """Constants of a search: the extended operator, its inverse and its grid, and the cell's compliance."""

    operator: Linear
    inverse: Linear
    shape: tuple[int, int]
    cell: Array


def tools_of(problem: Problem) -> SearchTools:
    """Return the extended operator of a problem, its inverse and its grid, and the compliance of a cell."""
    operator = problem.operator
    return SearchTools(*operator.extended(problem.gap.shape), operator.cell_compliance(problem.gap.shape))


def faces_of(problem: Problem, held: Array, padded: tuple[int, ...]) -> HeldCells:
    """Return the space of displacements in which the given cells (nx, ny) are held."""
    of_zero_mean = all(problem.operator.periodic) and not problem.load_controlled
    return HeldCells(pasted(held, padded), problem.load_controlled, of_zero_mean)


def pasted(field: Array, padded: tuple[int, ...]) -> Array:
    """Return a field (nx, ny) on the padded grid, zero in the padding."""
    nx, ny = field.shape
    return jnp.zeros(padded, field.dtype).at[:nx, :ny].set(field)


class StateOnGrid(NamedTuple):
    """A state in the cells of the grid: gap and attraction (nx, ny); pressure (mx, my) and its excess p_c; contact."""

    gap: Array
    attraction: Array
    pressure: Array
    excess: Array
    contact: Array


def seen_on_grid(problem: Problem, tools: SearchTools, s: SearchState) -> StateOnGrid:
    """Return gap, attraction, pressure and contact of a state in the cells of the grid. A cell touches if its p_c is
    positive and its gap small beside what p_c closes."""
    nx, ny = problem.gap.shape
    law, cell = problem.law, tools.cell
    gap = s.displacement[:nx, :ny] + problem.gap - s.approach
    attraction = law.traction(jnp.maximum(gap, 0.0))
    pressure = s.pressure
    # gaps are differences of displacements: the rounding of these is more than what a vanishing attraction closes
    strength = jnp.maximum(law.law.largest_traction, VANISHING * jnp.max(jnp.abs(pressure)))
    close = lambda excess: gap <= cell * jnp.minimum(excess / 2.0, CLOSE * strength)
    touches = lambda excess: (excess > 0.0) & close(excess)
    if all(problem.operator.periodic) and not problem.load_controlled:  # up to a mean pressure
        apart = ~touches(jnp.ones_like(gap) * strength)
        pressure = pressure - masked_mean(pressure + attraction, apart)
        pressure = pressure - masked_mean(pressure + attraction, ~touches(pressure + attraction))
    excess = pressure[:nx, :ny] + attraction
    return StateOnGrid(gap, attraction, pressure, excess, touches(excess))


def stopping_error(problem: Problem, tools: SearchTools, s: SearchState, seen: StateOnGrid) -> Array:
    """Return the stopping error of the module."""
    nx, ny = problem.gap.shape
    left = seen.pressure.at[:nx, :ny].set(jnp.where(seen.contact, 0.0, seen.excess))
    unbalanced = jnp.max(jnp.abs(tools.operator(left)[:nx, :ny]))
    opened = jnp.max(jnp.where(seen.contact, jnp.maximum(seen.gap, 0.0), 0.0))
    moved = moved_by(problem, tools.cell, s.pressure[:nx, :ny], s.displacement[:nx, :ny])
    rounded = RESOLVED * jnp.abs(s.approach - problem.lowest)
    error = jnp.maximum(unbalanced / moved, opened / jnp.maximum(moved, rounded))
    if problem.load_controlled:
        inside = seen.pressure[:nx, :ny]
        size = jnp.maximum(jnp.sum(jnp.abs(inside)), jnp.finfo(float).tiny)
        missed = jnp.abs(jnp.sum(inside) - problem.target) / size
        error = jnp.maximum(error, missed)
    return error


def moved_by(problem: Problem, cell: Array, pressure: Array, displacement: Array) -> Array:
    """Return the mean displacement, weighted by the size of the pressure, or if it is larger ``FAINT`` of that of a cell
    under the largest attraction, ().

    pressure, displacement: (nx, ny); cell: the compliance of a cell.
    """
    size = jnp.abs(pressure)
    total = jnp.sum(size)
    mean = jnp.sum(size * jnp.abs(displacement)) / jnp.where(total > 0.0, total, 1.0)
    return jnp.maximum(mean, FAINT * cell * problem.law.law.largest_traction)


def energy_of(problem: Problem, s: SearchState) -> Array:
    """Return the energy of a state, ()."""
    nx, ny = problem.gap.shape
    gap = jnp.maximum(s.displacement[:nx, :ny] + problem.gap - s.approach, 0.0)
    stored = 0.5 * jnp.sum(s.displacement * s.pressure) - problem.law.energy(gap)
    return stored - problem.target * s.approach if problem.load_controlled else stored


def first_state(problem: Problem, tools: SearchTools, start: Start) -> SearchState:
    """Return the state that a search begins with: of the start's pressure, without penetration."""
    nx, ny = problem.gap.shape
    zero = jnp.zeros(tools.shape)
    displacement = tools.operator(zero.at[:nx, :ny].set(start.pressure))
    of_zero_mean = all(problem.operator.periodic) and not problem.load_controlled
    if of_zero_mean:
        displacement = displacement - jnp.mean(displacement)
    surface = displacement[:nx, :ny] + problem.gap
    if problem.load_controlled:
        approach = jnp.where(
            jnp.any(start.contact), masked_mean(surface, start.contact), lowest_point(surface)
        )
    else:
        approach = problem.target
    gap = jnp.where(start.contact, 0.0, jnp.maximum(surface - approach, 0.0))
    if of_zero_mean:
        free = (~start.contact | jnp.all(start.contact)).astype(gap.dtype)
        gap = jnp.where(jnp.any(gap > 0.0), gap, free)  # an extrapolated pressure may close all gaps
        gap = gap * (jnp.mean(problem.gap) - approach) / jnp.mean(gap)
    displacement = displacement.at[:nx, :ny].set(gap + approach - problem.gap)
    one, none = jnp.ones(()), jnp.zeros((), int)
    part = jnp.where(start.none & problem.load_controlled, 0.0, 1.0)  # the bound comes first
    s = SearchState(
        displacement, tools.inverse(displacement), approach, one, part, none, jnp.asarray(False), none
    )
    return s._replace(error=stopping_error(problem, tools, s, seen_on_grid(problem, tools, s)))


MOST_DIRECTIONS = 80  # most directions of conjugate gradients in one minimisation
ROUNDS = 4  # minimisations of one model, each with the cells held that would have penetrated
COARSEST = 0.1  # reduction of the residual by a minimisation far from the end
FORCING = 10.0  # square of the reduction by a minimisation near the end, over the error
ENOUGH = 0.5  # displacement under the residual at which a minimisation stops, over that of the tolerance
BOUND_ITERATIONS = 100  # most iterations of the contact that bounds the energy, taken only if it lowers it
BOUND = 1e-5  # error of the contact without adhesion that bounds the energy, over that of the state it starts from
SHORTER, LEAST_PART = 0.3, 1e-6  # factor by which a step is shortened, and its least part
SMALL_PART = 0.05  # the next model is the upper bound if less of a step than this was usable
ROUNDING = 1e-14  # relative rise of the energies that counts as none
# largest difference of the extended operator, relative to the gap that the largest traction closes
BESIDE = 1e-6
LOST = 3  # iterations without contact under a tensile load that make a separation


def _bounded(problem: Problem, tools: SearchTools, s: SearchState) -> SearchState:
    """Return the contact without adhesion under the attraction that the state has, which has no more energy.

    Under a tensile load greater than the attraction there is none. The first state of all, without a start, is that under a
    load of the same size at least.
    """
    seen = seen_on_grid(problem, tools, s)
    attraction, target = seen.attraction, problem.target
    if problem.load_controlled:
        target = target + jnp.sum(attraction)
        target = jnp.where(s.iterations > 0, target, jnp.maximum(target, jnp.abs(problem.target)))
    surface = problem.gap - problem.operator(attraction)
    hard = replace(problem, law=UNILATERAL, gap=surface, target=target)
    # only of cells that touch: from tractions that are not balanced elsewhere the search took hundreds of iterations
    start = jnp.where(seen.contact, seen.excess, 0.0)
    found = normal.solve_on_grid(hard, start, BOUND * s.error, jnp.asarray(BOUND_ITERATIONS))
    contact = found.pressure
    new = first_state(problem, tools, Start(contact - attraction, contact > 0.0, jnp.asarray(False)))
    lost = jnp.where(problem.load_controlled & (target <= 0.0), LOST, 0)
    new = new._replace(lost=lost, bent=s.bent)
    lower = (energy_of(problem, new) <= energy_of(problem, s)) | (s.iterations == 0) | (lost > 0)
    kept = jax.tree.map(lambda a, b: jnp.where(lower, a, b), new, s._replace(part=jnp.ones(())))
    return kept._replace(iterations=s.iterations + found.iterations + 1)


def _newton(problem: Problem, tools: SearchTools, tolerance: Array, s: SearchState) -> SearchState:
    """Return the state after one step of the projected Newton method of the module."""
    law, seen, (nx, ny) = problem.law, seen_on_grid(problem, tools, s), problem.gap.shape

    # 1. Cells that touch under a positive p_c are held at the wall. Under a load without any, those of the least gap are,
    # at the approach at which they touch: the indenter needs cells to push.
    held, gap, approach, lost = seen.contact, seen.gap, s.approach, jnp.zeros((), int)
    if problem.load_controlled:
        some, closest = jnp.any(held), jnp.min(gap)
        lost = jnp.where(some, 0, s.lost + 1)
        held = jnp.where(some, held, gap <= closest)
        rise = jnp.where(some, 0.0, closest)
        gap, approach = gap - rise, approach + rise

    # 2. The quadratic model of the energy there. The smaller the error, the further it is minimised: for
    # quadratic convergence at the end, without wasted directions in the beginning.
    load = problem.target if problem.load_controlled else 0.0
    attraction, stiffness = law.traction(jnp.maximum(gap, 0.0)), law.stiffness(jnp.maximum(gap, 0.0))
    reach = law.law.work / law.law.largest_traction
    reduction = jnp.minimum(COARSEST, jnp.sqrt(FORCING * s.error))
    moved = moved_by(problem, tools.cell, s.pressure[:nx, :ny], s.displacement[:nx, :ny])
    tiny = 1e-10 * tools.cell * law.law.largest_traction

    def at_wall(held: Array, move: Move) -> Move:
        wall = jnp.where(held, move.approach - gap - move.displacement[:nx, :ny], 0.0)
        lifted = faces_of(problem, held, tools.shape).lift(pasted(wall, tools.shape))
        displacement = move.displacement + lifted
        return Move(displacement, tools.inverse(displacement), move.approach)

    def minimise(state: tuple[Any, ...]) -> tuple[Any, ...]:
        # 3. Conjugate gradients, preconditioned by K between projections. They end at a direction of negative curvature,
        # which is followed as far as the attraction reaches.
        held, move, _, rounds, count, bent, goal = state
        model = Model(tools.inverse, law, stiffness, faces_of(problem, held, tools.shape))

        def tangent(direction: Array) -> tuple[Array, Array]:
            pressure = tools.inverse(direction)
            return model.tractions(direction, pressure, model.faces.approach(direction)), pressure

        unbalanced = model.balanced(seen.pressure, attraction, load) + model.tractions(*move)
        inverse = lambda r: model.faces(tools.operator(r))
        found = conjugate_gradients(
            tangent,
            inverse,
            -unbalanced,
            reduction,
            MOST_DIRECTIONS,
            goal=goal,
            enough=ENOUGH * tolerance * moved,
            reach=reach,
        )
        move = Move(
            move.displacement + found.x,
            move.pressure + found.image,
            move.approach + model.faces.approach(found.x),
        )
        # 4. Cells that would penetrate are held as well, and the rest is minimised again, to the same residual. Beyond a
        # direction of negative curvature more may be left than in the beginning: a repetition has a goal of its own.
        crossing = (gap + move.displacement[:nx, :ny] - move.approach < -tiny) & ~held
        again, held = jnp.any(crossing), held | crossing
        move = jax.lax.cond(again, at_wall, lambda _, move: move, held, move)
        goal = jnp.where(found.bent, 0.0, found.goal)
        return held, move, again, rounds + 1, count + found.iterations, bent | found.bent, goal

    zero, none = jnp.zeros(tools.shape), jnp.zeros((), int)
    first = held, at_wall(held, Move(zero, zero, jnp.zeros(()))), jnp.asarray(True), none, none
    going = lambda state: state[2] & (state[3] < ROUNDS)
    found = jax.lax.while_loop(going, minimise, (*first, jnp.asarray(False), jnp.zeros(())))
    _, move, _, _, count, bent, _ = found

    # 5. The part of the step that does not raise the energy, one at most, zero if there is none: no farther than to the
    # wall, and shortened while E rises. The elastic energy is a parabola along the step, so that this needs no convolution.
    change = move.displacement[:nx, :ny] - move.approach
    slope = jnp.sum(s.pressure * move.displacement) - load * move.approach
    bend = jnp.sum(move.pressure * move.displacement)
    before = law.energy(gap)
    scale = jnp.abs(before) + jnp.abs(slope) + jnp.abs(bend) + jnp.abs(jnp.sum(s.pressure * s.displacement))
    shrinking = change < 0.0
    room = jnp.where(shrinking, jnp.maximum(gap, 0.0) / jnp.where(shrinking, -change, 1.0), jnp.inf)
    tight = shrinking & (gap + change < -1e-9 * jnp.max(jnp.abs(change)))

    def rises(part: Array) -> Array:
        attracted = law.energy(jnp.maximum(gap + part * change, 0.0)) - before
        return part * slope + 0.5 * part**2 * bend - attracted > ROUNDING * scale

    shorter = lambda part: rises(part) & (part > LEAST_PART)
    longest = jnp.minimum(1.0, jnp.min(jnp.where(tight, room, jnp.inf)))
    part = jax.lax.while_loop(shorter, lambda part: SHORTER * part, longest)
    part = jnp.where(part > LEAST_PART, part, 0.0)

    # 6. The pressure anew from the displacement: a sum of changes would have the rounding of the largest of them, and the
    # surfaces may have separated since.
    displacement = s.displacement + part * move.displacement
    new = SearchState(
        displacement,
        tools.inverse(displacement),
        approach + part * move.approach,
        s.error,
        part,
        lost,
        s.bent | bent,
        s.iterations + jnp.maximum(count, 1),
    )
    return new._replace(error=stopping_error(problem, tools, new, seen_on_grid(problem, tools, new)))


def solve(problem: Problem, start: Start, tolerance: Array, max_iterations: Array) -> Solution:
    """Solve from a start; the iterations (directions of conjugate gradients) stop at the tolerance or the maximum.

    Under a load that no contact can carry, and under a tensile or no load if the start has no contact, there is no
    pressure, ``separated`` is true, and the approach is that of first touch.
    """
    tools, load, (nx, ny) = tools_of(problem), problem.load_controlled, problem.gap.shape
    apart = load and ((problem.target <= 0.0) & ~(start.none | jnp.any(start.contact)))
    limit = jnp.where(apart, 0, max_iterations)

    def going(s: SearchState) -> Array:
        gone = jnp.asarray(load) & (s.lost >= LOST) & (problem.target <= 0.0)
        return (s.error > tolerance) & (s.iterations < limit) & ~gone

    # a step of Newton's method, or of the bound from above after a step of little use
    bounded = lambda s: _bounded(problem, tools, s)
    newton = lambda s: _newton(problem, tools, tolerance, s)
    step = lambda s: jax.lax.cond(s.part < SMALL_PART, bounded, newton, s)
    s = jax.lax.while_loop(going, step, first_state(problem, tools, start))

    seen = seen_on_grid(problem, tools, s)
    displacement, approach = s.displacement[:nx, :ny], s.approach
    if all(problem.operator.periodic):  # displacements are relative to their mean
        mean = jnp.mean(displacement)
        displacement, approach = displacement - mean, approach - mean
    pressure = seen.pressure[:nx, :ny]
    # the error by which the operator on the padded grid differs from that of the problem, if it is not small
    padding = tools.operator(seen.pressure.at[:nx, :ny].set(0.0))[:nx, :ny]
    differing = problem.operator(pressure) + padding - displacement
    off = jnp.max(jnp.abs(differing))
    beside = off / (tools.cell * problem.law.law.largest_traction)
    # of a faint attraction the gap that it closes is less than the rounding of displacements
    beside = jnp.minimum(beside, off / moved_by(problem, tools.cell, pressure, s.displacement[:nx, :ny]))
    error = jnp.maximum(stopping_error(problem, tools, s, seen), jnp.where(beside > BESIDE, beside, 0.0))
    separated = apart | (problem.target <= 0.0) & (s.lost >= LOST) if load else jnp.asarray(False)
    carried = jnp.where(seen.contact, seen.excess, 0.0)
    found = Solution(pressure, displacement, approach, error, s.iterations, carried, separated, s.bent)
    if not load:
        return found
    zero, first_touch = jnp.zeros_like(pressure), lowest_point(problem.gap) - problem.lowest
    nothing = Solution(zero, zero, first_touch, jnp.zeros(()), s.iterations, zero, separated, s.bent)
    return jax.tree.map(lambda a, b: jnp.where(separated, a, b), nothing, found)


# Normal contact with adhesion of other operators: bodies with a memory that the indenter moves over, and films whose
# thickness varies in the plane.
#
# With friction the traction follows the pressure that contact carries, not the net pressure, and displaces the surface along
# the normal as well (``Drag``): this displacement belongs to v, too.
#
# Where the operator K of a step is not symmetric no energy belongs to the contact, and where it is not that of one even
# kernel it has no inverse on the padded grid. Let U be an even operator of one kernel near K (``Operator.uniform``). With
# the displacement v = (K - U) p given,
#
#     v -> (K - U) p,     p of the contact with adhesion of the operator U and the gap  gap + v,
#
# has both, and its fixed point is the contact sought. The map alone need not contract. On a body that moves U^-1 (K - U)
# has imaginary eigenvalues, of up to 1.4 for E0/Einf = 10 where much of the creep happens within a step. Over a film the
# eigenvalues are real; with the U of its stiffest place they would be positive, up to the ratio of the compliances less one,
# and a state that is stable with K would be stable with U as well. The next v is therefore the combination of the last
# ``DEPTH`` results of the map, of weights whose sum is one, for which the same combination of their changes is smallest
# (D. G. Anderson, J. ACM 12 (1965) 547). For a linear map this is GMRES with few directions. On an elastic body of one
# thickness v is zero. Where the search does not converge within ``max_iterations`` the error says so.


@pytree
class Drag:
    """The traction of a sliding contact with adhesion, coefficient p_c + strength where the surfaces touch, and the normal
    displacement that it causes, by the operator of a traction along the motion; all scaled.

    coefficient, strength: () or (nx, ny).
    """

    displacement: Operator
    coefficient: Array
    strength: Array

    def traction(self, carried: Array) -> Array:
        """Return the traction under a contact pressure, (nx, ny)."""
        return largest_traction(self.coefficient, carried, self.strength)

    def __call__(self, carried: Array) -> Array:
        """Return the normal displacement under a contact pressure, (nx, ny)."""
        return self.displacement(self.traction(carried))

    def change(self, carried: Array) -> Array:
        """Return the change of the displacement for one of the contact pressure, (nx, ny); linear."""
        return self.displacement(self.coefficient * carried)


PART = 0.1  # error to which a contact is solved, over that of the last repetition
DEPTH = 10  # results that are combined; with 6 it does not converge where the eigenvalues reach 2
SINGULAR = 1e-12  # two combinations may differ by this part of the largest square of a change


class _Repeated(NamedTuple):
    """The contact after a repetition, the larger of its error and of the change of v, and the iterations so far.

    next: v of the next repetition; results, changes: of the map, (DEPTH, nx, ny); repetitions: so far.
    """

    found: Solution
    error: Array
    iterations: Array
    next: Array
    results: Array
    changes: Array
    repetitions: Array


def with_given(problem: Problem, pressure: Array, carried: Array) -> Problem:
    """Return the problem of the uniform operator, with v of a pressure and a contact pressure as a part of the gap."""
    uniform = problem.operator.uniform()
    given = displaced(problem, pressure, carried) - uniform(pressure)
    return replace(problem, operator=uniform, gap=problem.gap + given, drag=None)


def displaced(problem: Problem, pressure: Array, carried: Array) -> Array:
    """Return the displacement under a pressure and the drag of a contact pressure, (nx, ny)."""
    by_pressure = problem.operator(pressure)
    return by_pressure if problem.drag is None else by_pressure + problem.drag(carried)


def solve_in_turn(problem: Problem, start: Start, tolerance: Array, max_iterations: Array) -> Solution:
    """Solve from a start, by repetitions of the contact with a displacement given."""
    uniform = problem.operator.uniform()
    cell = uniform.cell_compliance(problem.gap.shape)
    rest = lambda pressure, carried: displaced(problem, pressure, carried) - uniform(pressure)

    def repeat(s: _Repeated) -> _Repeated:
        # the contact under the displacement of the last combination, solved to a part of the error before
        repeated = s.repetitions > 0
        contact = jnp.where(repeated, s.found.carried > 0.0, start.contact)
        own = Start(s.found.pressure, contact, start.none & ~repeated)
        goal = jnp.maximum(0.5 * tolerance, jnp.minimum(PART * s.error, 1e-2))
        given = replace(problem, operator=uniform, gap=problem.gap + s.next, drag=None)
        found = solve(given, own, goal, max_iterations - s.iterations)

        # what the solution itself displaces, beside what was given; the error is the larger of the two errors
        result = rest(found.pressure, found.carried)
        change = result - s.next
        moved = moved_by(problem, cell, found.pressure, found.displacement)
        error = jnp.maximum(found.error, jnp.max(jnp.abs(change)) / moved)
        assert found.unstable is not None and s.found.unstable is not None

        # Anderson's combination: of weights w with sum 1, |sum_j w_j change_j|^2 is least for (C^T C) w ~ 1
        place = s.repetitions % DEPTH
        results, changes = s.results.at[place].set(result), s.changes.at[place].set(change)
        known = jnp.arange(DEPTH) < s.repetitions + 1
        products = jnp.einsum("ixy,jxy->ij", changes, changes)
        least = SINGULAR * jnp.max(jnp.diag(products)) + jnp.finfo(float).tiny
        matrix = products + jnp.diag(jnp.where(known, least, 1.0))
        weights = jnp.linalg.solve(matrix, known.astype(float))
        return _Repeated(
            replace(found, unstable=found.unstable | s.found.unstable),
            error,
            s.iterations + jnp.maximum(found.iterations, 1),
            jnp.tensordot(weights / jnp.sum(weights), results, 1),
            results,
            changes,
            s.repetitions + 1,
        )

    def going(s: _Repeated) -> Array:
        assert s.found.separated is not None
        return (s.error > tolerance) & (s.iterations < max_iterations) & ~s.found.separated

    zero, none, no = jnp.zeros_like(start.pressure), jnp.zeros((), int), jnp.asarray(False)
    nothing = Solution(start.pressure, zero, jnp.zeros(()), jnp.zeros(()), none, zero, no, no)
    empty = jnp.zeros((DEPTH, *zero.shape))
    # the attraction of a start is not known, and its drag is left out
    before = problem.operator(start.pressure) - uniform(start.pressure)
    first = _Repeated(nothing, jnp.asarray(jnp.inf), none, before, empty, empty, none)
    last = jax.lax.while_loop(going, repeat, first)
    found = last.found
    displacement = displaced(problem, found.pressure, found.carried)
    # of separated surfaces the approach is that of first touch, without the displacement that was given
    first_touch = lowest_point(problem.gap) - problem.lowest
    approach = jnp.where(found.separated, first_touch, found.approach)
    return replace(
        found, displacement=displacement, approach=approach, error=last.error, iterations=last.iterations
    )


# An adhesive contact linearised at a solution, for its derivatives (``contact.implicit``).


@pytree
class AdhesiveTangent:
    """The problem linearised at a solution, for ``contact.implicit``; gap: of the solution, (nx, ny)."""

    model: Model
    operator: Linear
    gap: Array

    @classmethod
    def at_solution(cls, problem: Problem, found: Solution) -> AdhesiveTangent:
        """Linearise at a solution."""
        tools = tools_of(problem)
        gap = jnp.where(found.carried > 0.0, 0.0, found.displacement + problem.gap - found.approach)
        faces = faces_of(problem, found.carried > 0.0, tools.shape)
        model = Model(tools.inverse, problem.law, problem.law.stiffness(jnp.maximum(gap, 0.0)), faces)
        return cls(model, tools.operator, gap)

    def moved(self, wall: Array, approach: Array) -> Move:
        """Return the displacement that holds the cells in contact at the wall, which moves (nx, ny); linear."""
        displacement = self.model.faces.lift(pasted(wall, self.model.faces.held.shape))
        return Move(displacement, self.model.inverse(displacement), approach)

    def added(self, move: Move, change: Array) -> Move:
        """Return a move with one of the space added; linear."""
        total = move.displacement + change
        return Move(total, self.model.inverse(total), move.approach + self.model.faces.approach(change))

    def unbalanced(self, move: Move, forcing: Array, explicit: Array, load: Array) -> Array:
        """Return the tractions that a move leaves, projected, with changes of surface, attraction and load; linear."""
        tractions = jnp.zeros_like(move.pressure)
        attraction = explicit - self.model.attraction.softened(self.model.stiffness, forcing)
        given = load if self.model.faces.load_controlled else 0.0
        return self.model.tractions(*move) + self.model.balanced(tractions, attraction, given)

    def result(self, move: Move, forcing: Array, explicit: Array) -> tuple[Array, Array, Array, Array]:
        """Return the changes of pressure, displacement, approach and attraction for the whole move; linear."""
        nx, ny = self.gap.shape
        displacement, pressure = move.displacement[:nx, :ny], move.pressure[:nx, :ny]
        change = displacement + forcing - move.approach
        attraction = explicit - self.model.attraction.softened(self.model.stiffness, change)
        faces, approach = self.model.faces, move.approach
        if faces.of_zero_mean:
            pressure = pressure - masked_mean(pressure + attraction, ~faces.held)
        elif all(self.model.attraction.periodic):
            mean = jnp.mean(displacement)
            displacement, approach = displacement - mean, approach - mean
        return pressure, displacement, approach, attraction
