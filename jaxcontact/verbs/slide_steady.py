"""Steady sliding: the limit of a long run, as one contact problem."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import as_float64, is_concrete, replace
from jaxcontact._support.status import Status, most_serious
from jaxcontact.contact import nonsymmetric
from jaxcontact.contact.implicit import solve_contact
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.history.observables import Observer
from jaxcontact.history.pressing import contact_outcome, status_of
from jaxcontact.history.track import as_array, check_along_x, check_rubbing
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.controls import Approach, Control
from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import LayeredHalfSpace, ThicknessMap, separate_map
from jaxcontact.operators.base import Operator
from jaxcontact.operators.kernels import Errors, Kernels
from jaxcontact.operators.moving import Moving
from jaxcontact.operators.rubbing import rub
from jaxcontact.operators.thickness_kernels import VaryingKernels
from jaxcontact.operators.traction_kernels import joint_errors
from jaxcontact.response.limits import limits_of
from jaxcontact.results.sliding import SteadySliding, with_totals
from jaxcontact.verbs.experiment import Experiment
from jaxcontact.verbs.running import reported
from jaxcontact.verbs.setup import ContactSetup, Settings
from jaxcontact.verbs.steady.film_wake import FilmWake, film_wake_of
from jaxcontact.verbs.steady.rubbed_wake import RubbedWake
from jaxcontact.verbs.steady.wake import Wake, doubled, wake_of

ALONG = 1e-9  # of the largest thickness: what a film may vary along the track


def slide_steady(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    *,
    velocity: Array | float,
    grid: Grid,
    tolerance: Array | float = 1e-8,
    max_iterations: Array | int = 500,
    kernels: Kernels | None = None,
    friction: Array | float | None = None,
) -> SteadySliding:
    """Compute the steady state of an indenter that slides over a body at constant velocity.

        u(x) = int_0^infinity dK/ds * p(x + v s) ds,   g = profile + u - approach >= 0,   p >= 0,   p g = 0

    The steady state is the solution of a single contact problem with an unsymmetric kernel, and is differentiable. At
    zero velocity a body without steady-state flow is fully relaxed. On a half-space with steady-state flow under a load
    the pressure is steady, while the approach grows; see ``approach_drift`` of the result.

    With friction, the traction mu p along the velocity also causes normal displacement unless the two solids are
    elastically similar, and changes the pressure, on elastic bodies too (K. L. Johnson, Contact Mechanics, 1985, section
    7.1).

    Args:
        velocity: velocity of the indenter over the body [m/s], of any magnitude: a number (along x) or (2,).
        body: as in ``indent``; the thickness of the only layer on an elastic substrate may also vary across the track,
            (nx, ny) with equal values along x, if the velocity is a number and there is no friction. The film's surface is
            then higher where it is thicker.
        indenter, grid, tolerance, max_iterations, kernels: as in ``indent``. Kernels of a half-space save little
            time, since its wake is computed on a larger grid.
        friction: coefficient of Coulomb friction mu >= 0, a number or (nx, ny) in the frame of the indenter; all of the
            contact slips. With None, and at zero velocity, there is no traction. ``friction_coefficient`` of the result is
            the total, which includes hysteresis.
        control: as in ``indent``, with a single value.

    Since there is no time integration, there are no arguments ``times``, ``save``, ``substeps`` and ``checkpoint``.

    Returns:
        A ``SteadySliding``; under jit, its status is 6 if there is no steady state. Warnings are as in ``indent``.

    Raises:
        ValueError: invalid or unsupported input; a case without steady state, i.e. a body with steady-state flow at zero
            velocity or on a periodic grid, or a half-space with such flow under a fixed approach or in plane strain; a
            viscoelastic half-space or substrate on a grid that is periodic along one axis with several cells along it.

    Example:
        >>> rubber = jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=1e6, G2=1e6, eta2=1e6, nu=0.5))
        >>> grid = jc.Grid.square(n=24, width=4e-3)
        >>> steady = jc.slide_steady(rubber, jc.Sphere(5e-3), jc.Load(0.1), velocity=5e-4, grid=grid)
        >>> bool(steady.friction_coefficient > 0.0)
        True
    """
    velocity = as_array(velocity)
    _check_single(control, velocity, grid)
    body, film_map, valid = separate_map(body, getattr(grid, "shape", ()), 1)
    setup = ContactSetup(body, indenter, control, np.zeros(1), grid)
    experiment = Experiment.of(setup, Settings(tolerance, max_iterations, kernels), film_map=film_map)
    experiment = experiment.also(check_steady(experiment, velocity)).also(check_rubbing(friction, grid))
    experiment = experiment.also(valid)
    if film_map is not None:
        experiment = experiment.also(_check_across(film_map, velocity, grid, friction, kernels))
    result, errors = _run(experiment.with_kernels(), as_float64(velocity), as_float64(friction))
    return reported(result, errors, experiment)


def _check_single(control: Control, velocity: Array, grid: Grid) -> None:
    """One velocity and one value of the control."""
    shape = np.shape(velocity)
    checks.require(shape in ((), (2,)), f"velocity: expected a number or shape (2,), got shape {shape}")
    check_along_x(shape, grid)
    name, shape = type(control).__name__, np.shape(getattr(control, "value", 0.0))
    checks.require(shape == (), f"{name}: expected one number in the steady state, got shape {shape}")


def _check_across(
    film_map: ThicknessMap, velocity: Array, grid: Grid, friction: Any, kernels: Kernels | None
) -> Verdict:
    """Check a film whose thickness varies across the track: it does not along it, and nothing is asked that needs one
    thickness."""
    thickness = film_map.values
    checks.require(
        np.shape(velocity) == () and not all(grid.periodic) and not film_map.over_times,
        "layer thickness in the plane: expected (nx, ny) with a number as velocity, along x, on a grid that is not"
        f" periodic along both axes, got shape {thickness.shape}, a velocity of shape {np.shape(velocity)}, periodic="
        f"{grid.periodic}",
    )
    checks.require(
        friction is None and kernels is None,
        "layer thickness in the plane: expected no friction and no kernels",
    )
    along = jnp.max(jnp.abs(thickness - thickness[:1]))
    if not is_concrete(along):
        return along <= ALONG * jnp.max(thickness)
    checks.require(
        bool(along <= ALONG * jnp.max(thickness)),
        "layer thickness [m]: expected one that varies along y alone, across the track, got changes along x by up to"
        f" {float(along):g}: the film would move through the frame of the indenter; rub with path= computes it",
    )
    return True


def check_steady(experiment: Experiment, velocity: Array) -> Verdict:
    """A finite velocity; ValueError where there is no steady state."""
    finite = checks.finite("velocity [m/s]", velocity)
    limits, grid = limits_of(experiment.body), experiment.grid
    checks.require(
        not limits.creeps_far or all(grid.periodic) or not any(grid.periodic) or grid.plane_strain,
        "grid: expected one that is periodic along both axes, along none, or in plane strain, under a half-space or"
        f" substrate that creeps, got periodic={grid.periodic} with {tuple(grid.shape)} cells; slide takes it",
    )
    fluid = limits.is_fluid()
    if not is_concrete(fluid, velocity) or not bool(fluid):
        return finite
    checks.require(
        bool(np.any(np.asarray(velocity) != 0.0)),
        "velocity [m/s]: expected not 0: the body flows without limit, so that at rest the contact grows"
        " indefinitely and there is no steady state",
    )
    checks.require(
        not _tilts_or_thins(experiment),
        "body: expected one that does not flow without limit, on this grid: in plane strain a half-space tilts indefinitely"
        " under an indenter, and on a periodic grid the body creeps indefinitely under the mean pressure",
    )
    checks.require(
        not limits.creeps_far or not isinstance(experiment.control, Approach),
        "control: expected a Load on a half-space or substrate that flows without limit: it creeps indefinitely, so that"
        " under a fixed approach the load decreases to zero and there is no steady state",
    )
    return finite


def _tilts_or_thins(experiment: Experiment) -> bool:
    """Return whether a fluid body could have no steady state on this grid."""
    grid, far_off = experiment.grid, limits_of(experiment.body).creeps_far
    return all(grid.periodic) or (grid.plane_strain and far_off)


@Program
def _run(experiment: Experiment, velocity: Array, friction: Array | None) -> tuple[SteadySliding, Errors]:
    """The compiled core: one trace for equal shapes and flags."""
    vector = jnp.stack([velocity, jnp.zeros(())]) if velocity.ndim == 0 else velocity
    kernels, wake = _kernels_and_wake(experiment, vector, across=velocity.ndim > 0)
    scale, symbols = wake.kernels.scale, wake.symbols()
    profile = experiment.profile / scale.length
    lowest, target = jnp.min(profile), experiment.target(scale)
    rubbed = _rubbed(experiment, wake, friction)
    operator: Operator = wake.operator(symbols)
    if isinstance(operator, Moving) and rubbed is not None:
        operator = rubbed.added_to(operator)
    problem = Problem(operator, profile, target, lowest, experiment.load_controlled)
    start = nonsymmetric.cold_start(jax.lax.stop_gradient(problem))
    solution = solve_contact(problem, start, experiment.tolerance, experiment.max_iterations)
    status = status_of(problem, solution, experiment.tolerance, experiment.edges)
    status = with_no_steady_state(status, experiment, vector)
    observer = Observer.of(
        experiment.indenter.profile(experiment.grid) / scale.length, wake.ratio, wake.periodic
    )
    fields = _fields(wake, symbols, problem, solution, rubbed, observer) | {"status": status}
    in_si = with_totals(scale.to_si(**fields), vector)
    errors = kernels.errors() if rubbed is None else joint_errors(wake.kernels, rubbed.rubbing.expansion)
    rubs = jnp.zeros(()) if friction is None else friction
    mu = jnp.broadcast_to(rubs, profile.shape)
    return SteadySliding(grid=experiment.grid, velocity=vector, friction=mu, **in_si), errors


def _kernels_and_wake(
    experiment: Experiment, velocity: Array, *, across: bool
) -> tuple[Kernels | VaryingKernels, Wake | FilmWake]:
    """Return the kernels of an experiment, and the wake at a velocity (2,) [m/s]."""
    if experiment.film_map is not None:
        varying = experiment.varying_kernels
        moved = velocity / varying.uniform.scale.length
        return varying, film_wake_of(experiment, varying, moved, experiment.film_map.values)
    kernels = experiment.ready_kernels
    return kernels, wake_of(experiment, kernels, velocity / kernels.scale.length, across=across)


def _rubbed(experiment: Experiment, wake: Wake | FilmWake, friction: Array | None) -> RubbedWake | None:
    """Return the wake with the contribution of friction, None without."""
    if friction is None or isinstance(wake, FilmWake):
        return None
    wide = replace(experiment.grid, shape=doubled(experiment.grid.shape, experiment.grid.periodic))
    rubbing = rub(experiment.body, experiment.indenter, wide, wake.kernels.scale, friction)
    return RubbedWake(wake, rubbing, wake.direction)


def with_no_steady_state(status: Array, experiment: Experiment, velocity: Array) -> Array:
    limits = limits_of(experiment.body)
    sinks = limits.creeps_far and not experiment.load_controlled
    endless = ~jnp.any(velocity != 0.0) | sinks | _tilts_or_thins(experiment)
    return most_serious((limits.is_fluid() & endless, Status.NOT_STEADY), status=status)


def _fields(
    wake: Wake | FilmWake, symbols: Array, problem: Problem, solution: Solution, rubbed: RubbedWake | None,
    observer: Observer,
) -> dict[str, Array]:  # fmt: skip
    """Return the observables of a steady contact, scaled, by the names of the result; observer: of the indenter."""
    p, direction, none = solution.pressure, wake.direction, jnp.zeros(())
    pushed, centre, leading = observer.surface(p, direction)
    hysteresis = none
    if wake.kernels.rates.size:
        by_traction = None if rubbed is None else rubbed.displacement(p)
        hysteresis = observer.hysteresis(p, by_traction, direction)
    return contact_outcome(problem, solution) | {
        "profile": problem.gap,
        "displacement": solution.displacement,
        "film_strain": wake.film_strain(symbols, p),
        "lateral_force": pushed,
        "hysteresis_force": hysteresis,
        "coulomb_force": none if rubbed is None else rubbed.coulomb_force(p),
        "approach_drift": wake.drift(jnp.sum(p)) + (none if rubbed is None else rubbed.drift(p)),
        "pressure_centre": centre,
        "leading_peak": leading,
        "hysteresis_power": wake.lost_power(symbols, p),
    }
