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

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import replace
from jaxcontact.contact import normal
from jaxcontact.contact.adhesive_model import Goal, Model, Move, minimised
from jaxcontact.contact.adhesive_state import (
    SearchState,
    SearchTools,
    Start,
    energy_of,
    faces_of,
    first_state,
    moved_by,
    pasted,
    seen_on_grid,
    stopping_error,
    tools_of,
)
from jaxcontact.contact.law import UNILATERAL
from jaxcontact.contact.normal import Problem, Solution

ROUNDS = 4  # of minimisations of one model, each with the cells held that would have penetrated
COARSEST = 0.1  # reduction of the residual by a minimisation far from the end
FORCING = 10.0  # times the error: the square of the reduction by a minimisation near the end
ENOUGH = 0.5  # of the tolerance, below which a minimisation need not go
BOUND_ITERATIONS = 100  # after which it is only taken if it has lowered the energy
BOUND = 1e-5  # error of the contact without adhesion that bounds the energy, over that of the state it starts from
SHORTER, LEAST_PART = 0.3, 1e-6  # of a step
SMALL_PART = 0.05  # below it the next model is the upper bound
ROUNDING = 1e-14  # of the energies, up to which a rise is none
BESIDE = (
    1e-6  # of the gap that the largest traction closes, up to which the extended operator is the operator
)
LOST = 3  # iterations without contact under a tensile load that make a separation


def _iterate(problem: Problem, tools: SearchTools, tolerance: Array, s: SearchState) -> SearchState:
    """Return the state after one step of Newton's method, or of the bound from above after a step of little use."""
    bounded, newton = partial(_bounded, problem, tools), partial(_newton, problem, tools, tolerance)
    return jax.lax.cond(s.part < SMALL_PART, bounded, newton, s)


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
    contact, taken = normal.solve_on_grid(hard, start, BOUND * s.error, jnp.asarray(BOUND_ITERATIONS))
    new = first_state(problem, tools, Start(contact - attraction, contact > 0.0, jnp.asarray(False)))
    lost = jnp.where(problem.load_controlled & (target <= 0.0), LOST, 0)
    new = new._replace(lost=lost, bent=s.bent)
    lower = (energy_of(problem, new) <= energy_of(problem, s)) | (s.iterations == 0) | (lost > 0)
    kept = jax.tree.map(lambda a, b: jnp.where(lower, a, b), new, s._replace(part=jnp.ones(())))
    return kept._replace(iterations=s.iterations + taken + 1)


def _newton(problem: Problem, tools: SearchTools, tolerance: Array, s: SearchState) -> SearchState:
    """Return the state after one step of Newton's method."""
    seen = seen_on_grid(problem, tools, s)
    held, gap, approach = seen.contact, seen.gap, s.approach
    lost = jnp.zeros((), int)
    if problem.load_controlled:
        some = jnp.any(held)
        closest = jnp.min(gap)
        lost = jnp.where(some, 0, s.lost + 1)
        held = jnp.where(some, held, gap <= closest)
        rise = jnp.where(some, 0.0, closest)
        gap, approach = gap - rise, approach + rise
    reduction = jnp.minimum(COARSEST, jnp.sqrt(FORCING * s.error))
    nx, ny = gap.shape
    moved = moved_by(problem, tools.cell, s.pressure[:nx, :ny], s.displacement[:nx, :ny])
    goal = Goal(reduction, ENOUGH * tolerance * moved, jnp.zeros(()))
    move, count, bent = _newton_move(problem, tools, (seen.pressure, gap, held), goal)
    part = _usable_part(problem, s, gap, move)
    displacement = s.displacement + part * move.displacement
    # not a sum of changes, which has the rounding of the largest: the surfaces may have separated
    pressure = tools.inverse(displacement)
    new = SearchState(
        displacement,
        pressure,
        approach + part * move.approach,
        s.error,
        part,
        lost,
        s.bent | bent,
        s.iterations + jnp.maximum(count, 1),
    )
    return new._replace(error=stopping_error(problem, tools, new, seen_on_grid(problem, tools, new)))


def _newton_move(
    problem: Problem, tools: SearchTools, at: tuple[Array, Array, Array], goal: Goal
) -> tuple[Move, Array, Array]:
    """Return a step that penetrates nowhere and lowers the model, the directions that it took, and whether one was bent.

    at: pressure (mx, my), gap and held cells (nx, ny).
    """
    pressure, gap, held = at
    nx, ny = gap.shape
    attraction = problem.law.traction(jnp.maximum(gap, 0.0))
    stiffness = problem.law.stiffness(jnp.maximum(gap, 0.0))
    tiny = 1e-10 * tools.cell * problem.law.law.largest_traction
    reach = problem.law.law.work / problem.law.law.largest_traction
    at_wall = partial(_at_wall, problem, tools, gap)

    def minimise(held: Array, move: Move, goal: Goal) -> tuple[Move, Array, Array, Goal]:
        model = Model(tools.inverse, problem.law, stiffness, faces_of(problem, held, pressure.shape))
        load = problem.target if problem.load_controlled else 0.0
        unbalanced = model.balanced(pressure, attraction, load) + model.tractions(*move)
        return minimised(model, tools.operator, move, -unbalanced, goal, reach)

    def around(state: tuple[Any, ...]) -> tuple[Any, ...]:
        held, move, _, rounds, count, bent, goal = state
        move, taken, bends, goal = minimise(held, move, goal)
        crossing = (gap + move.displacement[:nx, :ny] - move.approach < -tiny) & ~held
        again = jnp.any(crossing)
        held = held | crossing
        move = jax.lax.cond(again, at_wall, lambda _, move: move, held, move)
        return held, move, again, rounds + 1, count + taken, bent | bends, goal

    zero = jnp.zeros_like(pressure)
    first = at_wall(held, Move(zero, zero, jnp.zeros(())))
    none = jnp.zeros((), int)
    state = (held, first, jnp.asarray(True), none, none, jnp.asarray(False), goal)
    _, move, _, _, count, bent, _ = jax.lax.while_loop(lambda s: s[2] & (s[3] < ROUNDS), around, state)
    return move, count, bent


def _at_wall(problem: Problem, tools: SearchTools, gap: Array, held: Array, move: Move) -> Move:
    """Return a move (mx, my) with the held cells (nx, ny) at a gap of zero."""
    (nx, ny), padded = gap.shape, move.displacement.shape
    wall = jnp.where(held, move.approach - gap - move.displacement[:nx, :ny], 0.0)
    displacement = move.displacement + faces_of(problem, held, padded).lift(pasted(wall, padded))
    return Move(displacement, tools.inverse(displacement), move.approach)


def _usable_part(problem: Problem, s: SearchState, gap: Array, move: Move) -> Array:
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


def _search(
    problem: Problem, tools: SearchTools, start: Start, tolerance: Array, max_iterations: Array
) -> SearchState:
    first = first_state(problem, tools, start)
    gone = lambda s: jnp.asarray(problem.load_controlled) & (s.lost >= LOST) & (problem.target <= 0.0)
    going = lambda s: (s.error > tolerance) & (s.iterations < max_iterations) & ~gone(s)
    return jax.lax.while_loop(going, lambda s: _iterate(problem, tools, tolerance, s), first)


def solve(problem: Problem, start: Start, tolerance: Array, max_iterations: Array) -> Solution:
    """Solve from a start; the iterations (directions of conjugate gradients) stop at the tolerance or the maximum.

    Under a load that no contact can carry, and under a tensile or no load if the start has no contact, there is no
    pressure, ``separated`` is true, and the approach is that of first touch.
    """
    tools = tools_of(problem)
    load = problem.load_controlled
    apart = load and ((problem.target <= 0.0) & ~(start.none | jnp.any(start.contact)))
    s = _search(problem, tools, start, tolerance, jnp.where(apart, 0, max_iterations))
    seen = seen_on_grid(problem, tools, s)
    nx, ny = problem.gap.shape
    displacement, approach = s.displacement[:nx, :ny], s.approach
    if all(problem.operator.periodic):
        mean = jnp.mean(displacement)
        displacement, approach = displacement - mean, approach - mean
    pressure = seen.pressure[:nx, :ny]
    strength = problem.law.law.largest_traction
    padding = tools.operator(seen.pressure.at[:nx, :ny].set(0.0))[:nx, :ny]
    differing = problem.operator(pressure) + padding - displacement
    beside = jnp.max(jnp.abs(differing)) / (tools.cell * strength)
    error = jnp.maximum(stopping_error(problem, tools, s, seen), jnp.where(beside > BESIDE, beside, 0.0))
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
