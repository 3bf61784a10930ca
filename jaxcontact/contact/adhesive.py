"""Normal contact with adhesion on the grid, by a projected Newton method for the displacement.

    p = K^-1 u = p_c - s(g),     g = u + gap - approach >= 0,     p_c >= 0,     p_c g = 0,

with the attraction s of ``contact.attraction``. A solution is a local minimum of the energy

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

The stopping error is the largest of the traction that is left over on cells that do not touch (and in the padding), over the
largest traction; of the gaps of held cells over the displacement of a cell under it; and of what the load is missed by. To
it is added by how much K on the padded grid is not that on the grid, where layers make it indefinite there.

Under a tensile load without any cell in contact there is no stable state: the surfaces have separated.

Sources: projected Newton and conjugate gradients: J. Nocedal, S. J. Wright, Numerical Optimization, 2006, sec. 7.1
and 16.7; the bound from above, whose minimisation lowers the energy: D. R. Hunter, K. Lange, Am. Stat. 58 (2004) 30.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact.contact import normal
from jaxcontact.contact.attraction import Attraction
from jaxcontact.contact.law import UNILATERAL
from jaxcontact.contact.normal import Problem, Solution, masked_mean
from jaxcontact.operators.base import Linear

ROUNDS = 4  # of minimisations of one model, each with the cells held that would have penetrated
MOST_DIRECTIONS = 80  # of conjugate gradients in one minimisation
COARSEST = 0.1  # reduction of the residual by a minimisation
BOUND_ITERATIONS = 100  # after which it is only taken if it has lowered the energy
BOUND = 1e-4  # error of the contact without adhesion that bounds the energy
CLOSE = (
    1e-3  # of the gap that the largest traction closes: up to there a cell under pressure is taken to touch
)
SHORTER, LEAST_PART = 0.3, 1e-6  # of a step
SMALL_PART = 0.2  # below it the next model is the upper bound
ROUNDING = 1e-14  # of the energies, up to which a rise is none
BESIDE = (
    1e-6  # of the gap that the largest traction closes, up to which the extended operator is the operator
)
LOST = 3  # iterations without contact under a tensile load that make a separation


class Start(NamedTuple):
    """Where a search begins: pressure and cells in contact (nx, ny), of a similar state; none: there is no such state."""

    pressure: Array
    contact: Array
    none: Array


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


class _State(NamedTuple):
    displacement: Array  # (mx, my)
    pressure: Array  # K^-1 times it
    approach: Array
    error: Array
    part: Array  # of the last step that was taken
    lost: Array  # iterations in a row without contact
    bent: Array  # whether a direction of negative curvature was met
    iterations: Array


class _Inner(NamedTuple):
    change: Array
    lifted: Array  # K^-1 times it
    residual: Array
    direction: Array
    descent: Array
    taken: Array
    bent: Array
    going: Array


def minimised(
    model: Model, preconditioner: Linear, start: Move, residual: Array, reduction: Array, reach: Array
) -> tuple[Move, Array, Array]:
    """Return the minimum of the model, the iterations taken and whether it has none, from a start that leaves
    ``residual`` of the tractions.

    They end at a direction of negative curvature, which is followed as far as the attraction reaches.
    """
    faces = model.faces
    inverse = lambda r: faces(preconditioner(r))
    z = inverse(residual)
    goal = reduction**2 * jnp.sum(residual * z)

    def step(s: _Inner) -> _Inner:
        lifted = model.inverse(s.direction)
        tangent = model.tractions(s.direction, lifted, faces.approach(s.direction))
        curvature = jnp.sum(s.direction * tangent)
        bent = curvature <= 0.0
        far = reach / jnp.max(jnp.abs(s.direction))
        size = jnp.where(bent, far, s.descent / jnp.where(bent, 1.0, curvature))
        change, total = s.change + size * s.direction, s.lifted + size * lifted
        left = s.residual - size * tangent
        z = inverse(left)
        new = jnp.sum(left * z)
        direction = z + (new / jnp.where(s.descent > 0.0, s.descent, 1.0)) * s.direction
        going = ~bent & (new > goal) & (s.taken + 1 < MOST_DIRECTIONS)
        return _Inner(change, total, left, direction, new, s.taken + 1, bent, going)

    zero = jnp.zeros_like(z)
    descent = jnp.sum(residual * z)
    first = _Inner(zero, zero, residual, z, descent, jnp.zeros((), int), jnp.asarray(False), descent > 0.0)
    found = jax.lax.while_loop(lambda s: s.going, step, first)
    move = Move(
        start.displacement + found.change,
        start.pressure + found.lifted,
        start.approach + faces.approach(found.change),
    )
    return move, found.taken, found.bent


class _Tools(NamedTuple):
    """What stays the same during a search: the extended operator, its inverse and its grid, and the cell's compliance."""

    operator: Linear
    inverse: Linear
    shape: tuple[int, int]
    cell: Array


def tools_of(problem: Problem) -> _Tools:
    """Return the extended operator of a problem, its inverse and its grid, and the compliance of a cell."""
    return _Tools(*problem.operator.extended(problem.gap.shape), problem.operator.cell_compliance())


def faces_of(problem: Problem, held: Array, padded: tuple[int, ...]) -> HeldCells:
    """Return the space of displacements in which the given cells (nx, ny) are held."""
    of_zero_mean = all(problem.operator.periodic) and not problem.load_controlled
    return HeldCells(_pasted(held, padded), problem.load_controlled, of_zero_mean)


def _pasted(field: Array, padded: tuple[int, ...]) -> Array:
    nx, ny = field.shape
    return jnp.zeros(padded, field.dtype).at[:nx, :ny].set(field)


class _Look(NamedTuple):
    """A state in the cells of the grid: gap and attraction (nx, ny); pressure (mx, my) and its excess p_c; contact."""

    gap: Array
    attraction: Array
    pressure: Array
    excess: Array
    contact: Array


def _look(problem: Problem, tools: _Tools, s: _State) -> _Look:
    nx, ny = problem.gap.shape
    law, cell = problem.law, tools.cell
    gap = s.displacement[:nx, :ny] + problem.gap - s.approach
    attraction = law.traction(jnp.maximum(gap, 0.0))
    pressure = s.pressure
    strength = law.law.largest_traction
    close = lambda excess: gap <= cell * jnp.minimum(excess / 2.0, CLOSE * strength)
    touches = lambda excess: (excess > 0.0) & close(excess)
    if all(problem.operator.periodic) and not problem.load_controlled:  # up to a mean pressure
        apart = ~touches(jnp.ones_like(gap) * strength)
        pressure = pressure - masked_mean(pressure + attraction, apart)
        pressure = pressure - masked_mean(pressure + attraction, ~touches(pressure + attraction))
    excess = pressure[:nx, :ny] + attraction
    return _Look(gap, attraction, pressure, excess, touches(excess))


def _error(problem: Problem, tools: _Tools, seen: _Look) -> Array:
    """Return the stopping error of the module's docstring."""
    nx, ny = problem.gap.shape
    inside = seen.pressure[:nx, :ny]
    strength = problem.law.law.largest_traction
    largest = jnp.maximum(strength, jnp.max(jnp.abs(inside)))
    outside = jnp.max(jnp.abs(seen.pressure.at[:nx, :ny].set(0.0)))
    unbalanced = jnp.maximum(jnp.max(jnp.where(seen.contact, 0.0, jnp.abs(seen.excess))), outside)
    open_gap = jnp.max(jnp.where(seen.contact, jnp.maximum(seen.gap, 0.0), 0.0)) / tools.cell
    error = jnp.maximum(unbalanced, open_gap) / largest
    if problem.load_controlled:
        carried = jnp.sum(jnp.abs(seen.excess) + seen.attraction)
        missed = jnp.abs(jnp.sum(inside) - problem.target) / carried
        error = jnp.maximum(error, missed)
    return error


def _iterate(problem: Problem, tools: _Tools, s: _State) -> _State:
    """Return the state after one step of Newton's method, or of the bound from above after a step of little use."""
    bounded, newton = partial(_bounded, problem, tools), partial(_newton, problem, tools)
    return jax.lax.cond(s.part < SMALL_PART, bounded, newton, s)


def _bounded(problem: Problem, tools: _Tools, s: _State) -> _State:
    """Return the contact without adhesion under the attraction that the state has, which has no more energy.

    Under a tensile load greater than the attraction there is none. The first state of all, without a start, is that under a
    load of the same size at least.
    """
    gap = _look(problem, tools, s).gap
    attraction = problem.law.traction(jnp.maximum(gap, 0.0))
    target = problem.target
    if problem.load_controlled:
        target = target + jnp.sum(attraction)
        target = jnp.where(s.iterations > 0, target, jnp.maximum(target, jnp.abs(problem.target)))
    surface = problem.gap - problem.operator(attraction)
    hard = replace(problem, law=UNILATERAL, gap=surface, target=target)
    nx, ny = gap.shape
    start = jnp.maximum(s.pressure[:nx, :ny] + attraction, 0.0)
    contact, taken = normal.solve_on_grid(hard, start, jnp.asarray(BOUND), jnp.asarray(BOUND_ITERATIONS))
    new = _first(problem, tools, Start(contact - attraction, contact > 0.0, jnp.asarray(False)))
    lost = jnp.where(problem.load_controlled & (target <= 0.0), LOST, 0)
    new = new._replace(lost=lost, bent=s.bent)
    lower = (_energy(problem, new) <= _energy(problem, s)) | (s.iterations == 0) | (lost > 0)
    kept = jax.tree.map(lambda a, b: jnp.where(lower, a, b), new, s._replace(part=jnp.ones(())))
    return kept._replace(iterations=s.iterations + taken + 1)


def _energy(problem: Problem, s: _State) -> Array:
    """Return the energy of a state, ()."""
    nx, ny = problem.gap.shape
    gap = jnp.maximum(s.displacement[:nx, :ny] + problem.gap - s.approach, 0.0)
    stored = 0.5 * jnp.sum(s.displacement * s.pressure) - problem.law.energy(gap)
    return stored - problem.target * s.approach if problem.load_controlled else stored


def _newton(problem: Problem, tools: _Tools, s: _State) -> _State:
    """Return the state after one step of Newton's method."""
    seen = _look(problem, tools, s)
    held, gap, approach = seen.contact, seen.gap, s.approach
    lost = jnp.zeros((), int)
    if problem.load_controlled:
        some = jnp.any(held)
        closest = jnp.min(gap)
        lost = jnp.where(some, 0, s.lost + 1)
        held = jnp.where(some, held, gap <= closest)
        rise = jnp.where(some, 0.0, closest)
        gap, approach = gap - rise, approach + rise
    move, count, bent = _newton_move(problem, tools, (seen.pressure, gap, held), s.error)
    part = _usable_part(problem, s, gap, move)
    new = _State(
        s.displacement + part * move.displacement,
        s.pressure + part * move.pressure,
        approach + part * move.approach,
        s.error,
        part,
        lost,
        s.bent | bent,
        s.iterations + count,
    )
    return new._replace(error=_error(problem, tools, _look(problem, tools, new)))


def _newton_move(
    problem: Problem, tools: _Tools, at: tuple[Array, Array, Array], error: Array
) -> tuple[Move, Array, Array]:
    """Return a step that penetrates nowhere and lowers the model, the directions that it took, and whether one was bent.

    at: pressure (mx, my), gap and held cells (nx, ny).
    """
    pressure, gap, held = at
    nx, ny = gap.shape
    attraction = problem.law.traction(jnp.maximum(gap, 0.0))
    stiffness = problem.law.stiffness(jnp.maximum(gap, 0.0))
    tiny = 1e-10 * tools.cell * problem.law.law.largest_traction
    reduction = jnp.minimum(COARSEST, jnp.sqrt(error))
    reach = problem.law.law.work / problem.law.law.largest_traction

    def minimise(held: Array, move: Move) -> tuple[Move, Array, Array]:
        model = Model(tools.inverse, problem.law, stiffness, faces_of(problem, held, pressure.shape))
        load = problem.target if problem.load_controlled else 0.0
        unbalanced = model.balanced(pressure, attraction, load) + model.tractions(*move)
        return minimised(model, tools.operator, move, -unbalanced, reduction, reach)

    def at_wall(held: Array, move: Move) -> Move:
        """Return the move with held cells at the wall."""
        wall = jnp.where(held, move.approach - gap - move.displacement[:nx, :ny], 0.0)
        lifted = faces_of(problem, held, pressure.shape).lift(_pasted(wall, pressure.shape))
        displacement = move.displacement + lifted
        return Move(displacement, tools.inverse(displacement), move.approach)

    def around(state: tuple[Any, ...]) -> tuple[Any, ...]:
        held, move, _, rounds, count, bent = state
        move, taken, bends = minimise(held, move)
        crossing = (gap + move.displacement[:nx, :ny] - move.approach < -tiny) & ~held
        again = jnp.any(crossing)
        held = held | crossing
        move = jax.lax.cond(again, at_wall, lambda _, move: move, held, move)
        return held, move, again, rounds + 1, count + taken, bent | bends

    zero = jnp.zeros_like(pressure)
    first = at_wall(held, Move(zero, zero, jnp.zeros(())))
    none = jnp.zeros((), int)
    state = (held, first, jnp.asarray(True), none, none, jnp.asarray(False))
    _, move, _, _, count, bent = jax.lax.while_loop(lambda s: s[2] & (s[3] < ROUNDS), around, state)
    return move, count, bent


def _usable_part(problem: Problem, s: _State, gap: Array, move: Move) -> Array:
    """Return the part of a step that does not raise the energy, one or less; zero if there is none.

    The elastic energy is a parabola along the step, so that no convolution is needed.
    """
    nx, ny = gap.shape
    change = move.displacement[:nx, :ny] - move.approach
    slope, bend = jnp.sum(s.pressure * move.displacement), jnp.sum(move.pressure * move.displacement)
    slope = slope - (problem.target * move.approach if problem.load_controlled else 0.0)
    before = problem.law.energy(gap)
    scale = jnp.abs(before) + jnp.abs(slope) + jnp.abs(bend) + jnp.abs(jnp.sum(s.pressure * s.displacement))
    shrinking = change < 0.0
    room = jnp.where(shrinking, jnp.maximum(gap, 0.0) / jnp.where(shrinking, -change, 1.0), jnp.inf)
    tight = shrinking & (gap + change < -1e-9 * jnp.max(jnp.abs(change)))
    longest = jnp.minimum(1.0, jnp.min(jnp.where(tight, room, jnp.inf)))

    def rise(part: Array) -> Array:
        left = jnp.maximum(gap + part * change, 0.0)
        return part * slope + 0.5 * part**2 * bend - (problem.law.energy(left) - before)

    shorter = lambda part: (rise(part) > ROUNDING * scale) & (part > LEAST_PART)
    part = jax.lax.while_loop(shorter, lambda part: SHORTER * part, longest)
    return jnp.where(part > LEAST_PART, part, 0.0)


def _search(problem: Problem, tools: _Tools, start: Start, tolerance: Array, max_iterations: Array) -> _State:
    first = _first(problem, tools, start)
    gone = lambda s: jnp.asarray(problem.load_controlled) & (s.lost >= LOST) & (problem.target <= 0.0)
    going = lambda s: (s.error > tolerance) & (s.iterations < max_iterations) & ~gone(s)
    return jax.lax.while_loop(going, lambda s: _iterate(problem, tools, s), first)


def _first(problem: Problem, tools: _Tools, start: Start) -> _State:
    """Return the state that a search begins with: of the start's pressure, without penetration."""
    nx, ny = problem.gap.shape
    zero = jnp.zeros(tools.shape)
    displacement = tools.operator(zero.at[:nx, :ny].set(start.pressure))
    surface = displacement[:nx, :ny] + problem.gap
    if problem.load_controlled:
        approach = jnp.where(jnp.any(start.contact), masked_mean(surface, start.contact), jnp.min(surface))
    else:
        approach = problem.target
    gap = jnp.where(start.contact, 0.0, jnp.maximum(surface - approach, 0.0))
    if all(problem.operator.periodic) and not problem.load_controlled:
        gap = gap * (jnp.mean(problem.gap) - approach) / jnp.mean(gap)
    displacement = displacement.at[:nx, :ny].set(gap + approach - problem.gap)
    one, none = jnp.ones(()), jnp.zeros((), int)
    part = jnp.where(start.none & problem.load_controlled, 0.0, 1.0)  # the bound comes first
    s = _State(displacement, tools.inverse(displacement), approach, one, part, none, jnp.asarray(False), none)
    return s._replace(error=_error(problem, tools, _look(problem, tools, s)))


def solve(problem: Problem, start: Start, tolerance: Array, max_iterations: Array) -> Solution:
    """Solve from a start; the iterations (directions of conjugate gradients) stop at the tolerance or the maximum.

    Under a load that no contact can carry, and under a tensile or no load if the start has no contact, there is no
    pressure, ``separated`` is true, and the approach is that of first touch.
    """
    tools = tools_of(problem)
    load = problem.load_controlled
    apart = load and ((problem.target <= 0.0) & ~(start.none | jnp.any(start.contact)))
    s = _search(problem, tools, start, tolerance, jnp.where(apart, 0, max_iterations))
    s = s._replace(pressure=tools.inverse(s.displacement))
    seen = _look(problem, tools, s)
    nx, ny = problem.gap.shape
    displacement, approach = s.displacement[:nx, :ny], s.approach
    if all(problem.operator.periodic):
        mean = jnp.mean(displacement)
        displacement, approach = displacement - mean, approach - mean
    pressure = seen.pressure[:nx, :ny]
    strength = problem.law.law.largest_traction
    beside = jnp.max(jnp.abs(problem.operator(pressure) - displacement)) / (tools.cell * strength)
    error = jnp.maximum(_error(problem, tools, seen), jnp.where(beside > BESIDE, beside, 0.0))
    separated = jnp.asarray(False)
    if load:
        separated = apart | (problem.target <= 0.0) & (s.lost >= LOST)
    found = Solution(
        pressure,
        displacement,
        approach,
        error,
        s.iterations,
        jnp.where(seen.contact, seen.excess, 0.0),
        separated,
        s.bent,
    )
    if not load:
        return found
    zero = jnp.zeros_like(pressure)
    first_touch = jnp.min(problem.gap) - problem.lowest
    nothing = Solution(zero, zero, first_touch, jnp.zeros(()), s.iterations, zero, separated, s.bent)
    return jax.tree.map(lambda a, b: jnp.where(separated, a, b), nothing, found)


@pytree
class AdhesiveTangent:
    """The problem linearised at a solution, for ``contact.implicit``; gap: of the solution, (nx, ny)."""

    model: Model
    operator: Linear
    gap: Array

    @classmethod
    def of(cls, problem: Problem, found: Solution) -> AdhesiveTangent:
        """Linearise at a solution."""
        tools = tools_of(problem)
        gap = jnp.where(found.carried > 0.0, 0.0, found.displacement + problem.gap - found.approach)
        faces = faces_of(problem, found.carried > 0.0, tools.shape)
        model = Model(tools.inverse, problem.law, problem.law.stiffness(jnp.maximum(gap, 0.0)), faces)
        return cls(model, tools.operator, gap)

    def moved(self, wall: Array, approach: Array) -> Move:
        """Return the displacement that holds the cells in contact at the wall, which moves (nx, ny); linear."""
        displacement = self.model.faces.lift(_pasted(wall, self.model.faces.held.shape))
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
