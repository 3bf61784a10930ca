"""The state of a search for an adhesive contact: its gaps and tractions on the grid, its stopping error and its energy."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxcontact.contact.adhesive_model import HeldCells
from jaxcontact.contact.normal import Problem, masked_mean
from jaxcontact.operators.base import InvertibleOperator, Linear

CLOSE = (
    1e-3  # of the gap that the largest traction closes: up to there a cell under pressure is taken to touch
)
FAINT = 1e-6  # of the displacement of a cell under the largest attraction: a displacement that matters
RESOLVED = 1e-8  # of the approach: the accuracy of gaps at the usual tolerance, since they are differences


class Start(NamedTuple):
    """Initial pressure and contact cells (nx, ny) of a search, from a similar state; none: there is no such state."""

    pressure: Array
    contact: Array
    none: Array


class SearchState(NamedTuple):
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
    assert isinstance(operator, InvertibleOperator)
    return SearchTools(*operator.extended(problem.gap.shape), operator.cell_compliance())


def faces_of(problem: Problem, held: Array, padded: tuple[int, ...]) -> HeldCells:
    """Return the space of displacements in which the given cells (nx, ny) are held."""
    of_zero_mean = all(problem.operator.periodic) and not problem.load_controlled
    return HeldCells(pasted(held, padded), problem.load_controlled, of_zero_mean)


def pasted(field: Array, padded: tuple[int, ...]) -> Array:
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
    return StateOnGrid(gap, attraction, pressure, excess, touches(excess))


def stopping_error(problem: Problem, tools: SearchTools, s: SearchState, seen: StateOnGrid) -> Array:
    """Return the stopping error of the docstring of ``contact.adhesive``."""
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
        approach = jnp.where(jnp.any(start.contact), masked_mean(surface, start.contact), jnp.min(surface))
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
