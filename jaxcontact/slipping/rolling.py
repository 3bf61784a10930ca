"""Steady rolling with friction, as the limit of rolling cell by cell."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact import _checks
from jaxcontact._checks import Verdict
from jaxcontact._experiment import Experiment, reported
from jaxcontact._pytree import as_float64, is_concrete
from jaxcontact._status import Status
from jaxcontact.contact.partial_slip import Round, SlipProblem, solve
from jaxcontact.controls import Control, TangentialControl, TangentialLoad, check_tangential
from jaxcontact.grid import Grid, check_free_along_x
from jaxcontact.history.march import contact_outcome, status_of
from jaxcontact.indenters import Indenter
from jaxcontact.layers import LayeredHalfSpace
from jaxcontact.operators.kernels import Errors
from jaxcontact.operators.traction_kernels import build_traction
from jaxcontact.response.tangential_time import check_no_creep
from jaxcontact.slipping.memory import TractionMemory
from jaxcontact.slipping.results import SteadyRolling
from jaxcontact.slipping.shearing import check_friction

STEADY = 1e-7  # change of the tractions from cell to cell, in parts of what friction holds
FARTHEST = 20  # grid lengths that are rolled


def roll_steady(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    *,
    velocity: Array | float,
    creepage: Array | TangentialLoad,
    friction: Array | float,
    grid: Grid,
    coupled: bool = True,
    tolerance: Array | float = 1e-8,
    max_iterations: Array | int = 2000,
) -> SteadyRolling:
    """The contact of an indenter that has rolled for ever in one direction, with creepage or a tangential force.

        slip/distance = -v/|v| . grad u - creepage,      |q| <= mu p,      slip = -k q, k >= 0, where |q| = mu p

    slip: of the body's surface over the indenter, u the sum of both surfaces' tangential displacements. Material flows
    through the contact from its leading edge, where it enters without traction. What is solved is a rolling start, cell
    by cell, until tractions change no more: u(x) less what it was a cell ahead is the slip over one cell, as in F. F. W.
    Kalker's transient contact, and each step is a partial-slip problem of ``shear``. The error is of first order in
    the cell; askew to the axes u is taken a cell ahead between its neighbours. There is no derivative through the start;
    ``shear`` has one.

    Args:
        body: a ``LayeredHalfSpace`` of elastic materials.
        indenter, grid: as in ``indent``.
        control: ``Load`` or ``Approach`` with a single value.
        velocity: of the indenter over the body [m/s], not zero: a number (along x) or (2,); for elastic bodies its
            direction counts alone.
        creepage: (xi_x, xi_y), slip velocity of the indenter over the body (as rigid bodies) over |v|; or a
            ``TangentialLoad`` with one vector, for the creepage that it takes.
        friction, coupled, tolerance, max_iterations: as in ``shear``, for each step of the start.

    Returns:
        A ``SteadyRolling``. Failure is data, as in ``shear``; status 6 where tractions still change after a way
        of 20 grid lengths.

    Raises:
        ValueError: what cannot be computed; a material that creeps.

    Example:
        >>> steel, grid = jc.Elastic.from_young(210e9, nu=0.3), jc.Grid.square(n=16, width=300e-6)
        >>> rail, wheel = jc.LayeredHalfSpace([], substrate=steel), jc.Sphere(9.5e-3, steel)
        >>> rolling = jc.roll_steady(
        ...     rail, wheel, jc.Load(20.0), velocity=1.0, creepage=(1e-3, 0.0), friction=0.3, grid=grid, coupled=False
        ... )
        >>> bool(0.0 < rolling.tangential_load[0] < 0.3 * 20.0)
        True
    """
    given = {"grid": grid, "tolerance": tolerance, "max_iterations": max_iterations}
    experiment = Experiment.of(body, indenter, control, np.zeros(1), **given)
    check_no_creep(experiment.body)
    check_free_along_x(grid, "roll_steady")
    verdict = _check_rolling(control, velocity, creepage) & check_friction(friction, grid)
    forced = isinstance(creepage, TangentialControl)
    value = creepage.value if isinstance(creepage, TangentialControl) else creepage
    speed, value, friction = (as_float64(jnp.asarray(a, float)) for a in (velocity, value, friction))
    experiment = experiment.also(verdict)
    result, errors = _run(experiment, speed, value, friction, forced=forced, coupled=bool(coupled))
    return reported(result, errors, experiment.valid)


def _check_rolling(control: Control, velocity: Any, creepage: Any) -> Verdict:
    """One value of each, and a direction."""
    shape = np.shape(getattr(control, "value", 0.0))
    _checks.require(
        shape == (), f"{type(control).__name__}: expected one number in the steady state, got shape {shape}"
    )
    shape = np.shape(velocity)
    _checks.require(shape in ((), (2,)), f"velocity: expected a number or shape (2,), got shape {shape}")
    largest = jnp.max(jnp.abs(velocity)) if not is_concrete(velocity) else np.max(np.abs(velocity))
    valid = _checks.positive("velocity [m/s] (its size)", largest)
    if isinstance(creepage, TangentialControl):
        _checks.require(
            isinstance(creepage, TangentialLoad),
            f"creepage: expected (x, y) or a TangentialLoad, got {creepage!r}",
        )
        return valid & check_tangential(creepage, 1)
    shape = np.shape(creepage)
    _checks.require(shape == (2,), f"creepage: expected (x, y) or a TangentialLoad, got shape {shape}")
    return valid & _checks.finite("creepage", creepage)


class _Rolled(NamedTuple):
    found: Round
    moved: Array
    change: Array
    cells: Array


def _compiled(
    experiment: Experiment, velocity: Array, value: Array, friction: Array, *, forced: bool, coupled: bool
) -> tuple[SteadyRolling, Errors]:
    """The compiled core: one trace for equal shapes and options."""
    kernels = build_traction(experiment.body, experiment.indenter, experiment.grid, coupled=coupled)
    scale, shape = kernels.normal.scale, experiment.grid.shape
    memory, no_time = TractionMemory(kernels), jnp.zeros(())
    rest = memory.predict(memory.start(shape), jnp.zeros((3, *shape)), no_time)
    profile = experiment.indenter.profile(experiment.grid) / scale.length
    vector = jnp.stack([velocity, jnp.zeros(())]) if velocity.ndim == 0 else velocity
    speed, spacing = jnp.sqrt(jnp.sum(vector**2)), jnp.stack(experiment.grid.spacing)
    way = jnp.min(spacing) / spacing[0]  # rolled in a step [cells along x]
    problem = SlipProblem(
        operator=rest.operator,
        gap=profile,
        drift=jnp.zeros((2, *shape)),
        coefficient=jnp.broadcast_to(friction, shape),
        target=experiment.target(scale),
        tangential_target=scale.from_si("tangential_load", value).reshape(2) if forced else way * value,
        lowest=jnp.min(profile),
        load_controlled=experiment.load_controlled,
        tangential_load_controlled=forced,
        coupled=coupled,
    )
    rolled = _rolled(
        problem, way * spacing[0] / spacing * vector / speed, experiment.tolerance, experiment.max_iterations
    )
    strain = memory.film_strain(rest.fields, rolled.found.normal.pressure, no_time)
    numbers = _numbers(problem, rolled, way, experiment.tolerance, experiment.edges) | {
        "film_strain": strain,
        "profile": profile,
    }
    in_si = scale.to_si(**numbers)
    power = speed * jnp.sum(in_si["tangential_load"] * in_si["creepage"])
    result = SteadyRolling(grid=experiment.grid, velocity=vector, power=power, **in_si)
    return result, kernels.normal.errors()


_run = jax.jit(_compiled, static_argnames=("forced", "coupled"))


def _rolled(problem: SlipProblem, cell: Array, tolerance: Array, limit: Array) -> _Rolled:
    """Cell by cell from rest until nothing changes."""
    shape = problem.gap.shape

    def further(state: _Rolled) -> _Rolled:
        p, q = state.found.normal.pressure, state.found.tangential.traction
        step = _with_drift(problem, -ahead(state.moved, cell))
        found = solve(step, p, q, tolerance, limit)
        moved = found.tangential.displacement
        if problem.coupled:
            moved = moved + problem.operator.drawn(found.normal.pressure)
        room = jnp.sum(problem.coefficient * found.normal.pressure)
        change = jnp.sum(jnp.abs(found.tangential.traction - q)) / jnp.where(room > 0.0, room, jnp.inf)
        return _Rolled(found, moved, change, state.cells + 1)

    nothing = jnp.zeros((2, *shape))
    first = solve(problem, jnp.zeros(shape), nothing, tolerance, limit)
    moved = first.tangential.displacement
    if problem.coupled:
        moved = moved + problem.operator.drawn(first.normal.pressure)
    going = lambda state: (state.change > STEADY) & (state.cells < FARTHEST * max(shape))
    start = _Rolled(first, moved, jnp.ones(()), jnp.zeros((), int))
    return jax.lax.while_loop(going, further, start)


def _with_drift(problem: SlipProblem, drift: Array) -> SlipProblem:
    return SlipProblem(**{**vars(problem), "drift": drift})


def ahead(field: Array, step: Array) -> Array:
    """A field (2, nx, ny) a step further, (2,) of at most a cell each way; linear between cells, and at the grid's end as
    on its last cell."""
    for axis, way in ((1, step[0]), (2, step[1])):
        field = field + jnp.abs(way) * (_next(field, axis, way > 0.0) - field)
    return field


def _next(field: Array, axis: int, forwards: Array) -> Array:
    """Of the neighbours along an axis, at the grid's end of the last cells."""
    first, last = jnp.take(field, jnp.array([0]), axis), jnp.take(field, jnp.array([-1]), axis)
    later = jnp.concatenate([jnp.delete(field, 0, axis), last], axis)
    earlier = jnp.concatenate([first, jnp.delete(field, -1, axis)], axis)
    return jnp.where(forwards, later, earlier)


def _numbers(
    problem: SlipProblem, rolled: _Rolled, way: Array, tolerance: Array, edges: tuple[bool, bool]
) -> dict[str, Array]:
    """All that is shown, scaled, by the names of the result."""
    pressed, sheared = rolled.found.normal, rolled.found.tangential
    status = status_of(problem.pressed(sheared.traction), pressed, tolerance, edges)
    fine = status == Status.FINE
    status = jnp.where(fine & (rolled.change > STEADY), int(Status.NOT_STEADY), status)
    status = jnp.where(fine & (sheared.error > tolerance), int(Status.NOT_CONVERGED), status)
    if problem.tangential_load_controlled:
        asked, room = problem.tangential_target, jnp.sum(problem.coefficient * pressed.pressure)
        held = jnp.sum(asked**2) < room**2
        status = jnp.where(held | ~jnp.any(asked != 0.0), status, int(Status.SLIDES))
    sunk = problem.operator.sunk(sheared.traction) if problem.coupled else 0.0
    return contact_outcome(pressed) | {
        "displacement": pressed.displacement + sunk,
        "traction": sheared.traction,
        "slip_ratio": sheared.slip / way,
        "stick": sheared.stick,
        "tangential_load": jnp.sum(sheared.traction, (1, 2)),
        "creepage": sheared.shift / way,
        "error": jnp.maximum(pressed.error, sheared.error),
        "iterations": rolled.found.taken,
        "status": status,
    }
