"""Steady rolling with friction, as the limit of rolling cell by cell."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import as_float64, is_concrete
from jaxcontact._support.status import Status, most_serious
from jaxcontact.history.observables import Observer
from jaxcontact.history.pressing import contact_outcome, solved, status_of
from jaxcontact.history.recursive import RecursiveMemory
from jaxcontact.history.track import check_along_x
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.controls import (
    Control,
    TangentialControl,
    TangentialLoad,
    check_friction,
    check_tangential,
)
from jaxcontact.inputs.grid import Grid, check_free_along_x
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.operators.kernels import Errors
from jaxcontact.operators.traction_kernels import TractionKernels, compiled_traction
from jaxcontact.results.friction import SteadyRolling
from jaxcontact.verbs.experiment import Experiment
from jaxcontact.verbs.running import reported
from jaxcontact.verbs.setup import ContactSetup, Settings
from jaxcontact.verbs.slide_steady import check_steady, with_no_steady_state
from jaxcontact.verbs.steady.rolled import RolledSurface, creeping_surface, elastic_surface
from jaxcontact.verbs.steady.rolling_contact import Rolled, RollingContact
from jaxcontact.verbs.steady.wake import wake_of


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
    """Compute the steady state of an indenter that rolls over a body, with creepage or a tangential force.

        slip/distance = -v/|v| . grad u - creepage,      |q| <= mu p,      slip = -k q, k >= 0, where |q| = mu p

    Here slip is that of the body's surface over the indenter, v the velocity, and u the sum of the tangential displacements
    of both surfaces, which on a viscoelastic body includes the effect of all earlier tractions (``verbs.steady.rolled``).
    Material enters the contact without traction at the leading edge. The gradient is the difference between neighbouring
    cells along the track, interpolated for oblique directions, so that the error is of first order in the cell size. The
    steady state is the limit of transient rolling (``verbs.steady.rolling_contact``). Derivatives in both modes are those
    of the steady state at constant areas of contact, stick and slip.

    In plane strain a cylinder rolls along x; a creepage along y causes antiplane shear.

    Args:
        body: a ``LayeredHalfSpace``.
        indenter, grid: as in ``indent``; a grid that is periodic along both axes is rejected.
        control: ``Load`` or ``Approach`` with a single value.
        velocity: velocity of the indenter over the body [m/s], not zero: a number (along x) or (2,). For elastic bodies
            only its direction matters.
        creepage: (xi_x, xi_y), the slip velocity of the indenter over the body, both taken as rigid, over |v|; or a
            ``TangentialLoad`` with one vector, for which the creepage is computed.
        friction, coupled, tolerance, max_iterations: as in ``shear``; the limit applies to each step of the transient.

    Returns:
        A ``SteadyRolling``. Failures are reported in its status, as in ``shear``. It is 6 if the tractions still change
        after rolling over 20 lengths of the grid, or if ``slide_steady`` has no steady state.

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
    setup = ContactSetup(body, indenter, control, np.zeros(1), grid)
    experiment = Experiment.of(setup, Settings(tolerance, max_iterations))
    check_free_along_x(grid, "roll_steady")
    verdict = _check_rolling(control, velocity, creepage) & check_friction(friction, grid.shape)
    verdict = verdict & check_along_x(np.shape(velocity), grid) & check_steady(experiment, velocity)
    forced = isinstance(creepage, TangentialControl)
    value = creepage.value if isinstance(creepage, TangentialControl) else creepage
    speed, value, friction = (as_float64(jnp.asarray(a, float)) for a in (velocity, value, friction))
    experiment = experiment.also(verdict)
    kernels = compiled_traction(experiment.body, experiment.indenter, experiment.grid, coupled=bool(coupled))
    options = {"forced": forced, "coupled": bool(coupled)}
    result, errors = _run(experiment, kernels, speed, value, friction, **options)
    return reported(result, errors, experiment)


def _check_rolling(control: Control, velocity: Any, creepage: Any) -> Verdict:
    """One value of each, and a direction."""
    shape = np.shape(getattr(control, "value", 0.0))
    checks.require(
        shape == (), f"{type(control).__name__}: expected one number in the steady state, got shape {shape}"
    )
    shape = np.shape(velocity)
    checks.require(shape in ((), (2,)), f"velocity: expected a number or shape (2,), got shape {shape}")
    largest = jnp.max(jnp.abs(velocity)) if not is_concrete(velocity) else np.max(np.abs(velocity))
    valid = checks.positive("velocity [m/s] (its size)", largest)
    if isinstance(creepage, TangentialControl):
        checks.require(
            isinstance(creepage, TangentialLoad),
            f"creepage: expected (x, y) or a TangentialLoad, got {creepage!r}",
        )
        return valid & check_tangential(creepage, 1)
    shape = np.shape(creepage)
    checks.require(shape == (2,), f"creepage: expected (x, y) or a TangentialLoad, got shape {shape}")
    return valid & checks.finite("creepage", creepage)


def _compiled(
    experiment: Experiment,
    kernels: TractionKernels,
    velocity: Array,
    value: Array,
    friction: Array,
    *,
    forced: bool,
    coupled: bool,
) -> tuple[SteadyRolling, Errors]:
    """The compiled core: one trace for equal shapes and options."""
    scale, spacing = kernels.normal.scale, jnp.stack(experiment.grid.spacing)
    vector = jnp.stack([velocity, jnp.zeros(())]) if velocity.ndim == 0 else velocity
    speed, step = jnp.sqrt(jnp.sum(vector**2)), jnp.min(spacing)
    across = velocity.ndim > 0
    surface, observed = _surface(experiment, kernels, vector / scale.length, across=across, coupled=coupled)
    profile = experiment.indenter.profile(experiment.grid) / scale.length
    force = scale.from_si("tangential_load", value).reshape(2) if forced else value
    contact = RollingContact(
        surface=surface,
        profile=profile,
        coefficient=jnp.broadcast_to(friction, profile.shape),
        way=step / spacing * vector / speed,
        target=experiment.target(scale),
        tangential_target=force if forced else step / spacing[0] * value,
        tolerance=experiment.tolerance,
        max_iterations=experiment.max_iterations,
        load_controlled=experiment.load_controlled,
        tangential_load_controlled=forced,
        coupled=coupled,
    )
    rolled = contact.rolled()
    numbers = _numbers(contact, rolled, step / spacing[0], experiment.edges)
    numbers["status"] = with_no_steady_state(numbers["status"], experiment, vector)
    raised = _raised(contact, rolled, vector / speed, spacing[1] / spacing[0]) if coupled else jnp.zeros(())
    in_si = scale.to_si(**numbers, **observed(rolled.pressed.pressure), profile=profile, lateral_force=raised)
    in_si |= _powers(in_si, speed, in_si.pop("lateral_force"))
    return SteadyRolling(grid=experiment.grid, velocity=vector, **in_si), kernels.errors()


def _raised(contact: RollingContact, rolled: Rolled, direction: Array, ratio: Array) -> Array:
    """Return the force against the motion that the pressure needs where the traction raises the surface, scaled, ()."""
    by_traction = contact.surface.normal_from_tangential(rolled.sheared.traction)
    flat = Observer.of(jnp.zeros_like(contact.profile), ratio)
    return -flat.hysteresis(rolled.pressed.pressure, by_traction, direction)


def _powers(in_si: dict[str, Array], speed: Array, raised: Array) -> dict[str, Array]:
    """Return the powers, and the force of hysteresis, in SI units.

    Friction takes the work of the tangential force and, where the solids are unlike, of the pressure on a surface that the
    traction moves: -int q . slip = Q . creepage + int q . du/ds, and of u only the part due to the pressure is not zero on
    elastic bodies, whose integral is -int p dw/ds with the normal displacement w under the traction (Betti).
    """
    friction_power = speed * (jnp.sum(in_si["tangential_load"] * in_si["creepage"]) + raised)
    return {
        "friction_power": friction_power,
        "power": in_si["hysteresis_power"] + friction_power,
        "hysteresis_force": in_si["hysteresis_power"] / speed,
    }


_run = Program(_compiled, ("forced", "coupled"))


def _surface(
    experiment: Experiment, kernels: TractionKernels, velocity: Array, *, across: bool, coupled: bool
) -> tuple[RolledSurface, Callable[[Array], dict[str, Array]]]:
    """Return the surface, and its film strain and power of hysteresis as a function of the pressure, scaled.

    velocity: in cells per second.
    """
    if not kernels.normal.rates.size:
        memory, no_time = RecursiveMemory(kernels.normal), jnp.zeros(())
        nothing = jnp.zeros(experiment.grid.shape)
        no_history = memory.start(experiment.grid.shape)
        operator = memory.predict(no_history, nothing, no_time).operator
        return elastic_surface(kernels, operator), lambda p: {
            **memory.observe(no_history, p, no_time),
            "hysteresis_power": no_time,
        }
    wake = wake_of(experiment, kernels.normal, velocity, across=across)
    symbols = wake.symbols()
    surface = creeping_surface(experiment, kernels, wake, wake.operator(symbols), coupled=coupled)
    return surface, lambda p: {
        "film_strain": wake.film_strain(symbols, p),
        "hysteresis_power": wake.lost_power(symbols, p),
    }


def _numbers(
    contact: RollingContact, rolled: Rolled, way: Array, edges: tuple[bool, bool]
) -> dict[str, Array]:
    """All that is shown, scaled, by the names of the result."""
    pressed, sheared = rolled.pressed, rolled.sheared
    return contact_outcome(contact.pressed(sheared.traction), pressed) | {
        "displacement": pressed.displacement + contact.surface.normal_from_tangential(sheared.traction),
        "traction": sheared.traction,
        "slip_ratio": sheared.slip / way,
        "stick": sheared.stick,
        "tangential_load": jnp.sum(sheared.traction, (1, 2)),
        "creepage": sheared.shift / way,
        "error": jnp.maximum(pressed.error, sheared.error),
        "iterations": pressed.iterations + sheared.iterations,
        "status": _status(contact, rolled, edges),
    }


def _status(contact: RollingContact, rolled: Rolled, edges: tuple[bool, bool]) -> Array:
    """Return the status of the normal contact, or of the tangential one if that was not found or has no steady state."""
    pressed, sheared, tolerance = rolled.pressed, rolled.sheared, contact.tolerance
    status = status_of(contact.pressed(sheared.traction), pressed, tolerance, edges)
    met = solved(sheared.error, tolerance, sheared.traction, sheared.slip, sheared.shift)
    # without a solution, that rolling has not settled is no property of the body
    found = met & (status != Status.NOT_CONVERGED) & (status != Status.NOT_FINITE)
    status = most_serious(
        (found & ~rolled.steady, Status.NOT_STEADY), (~met, Status.NOT_CONVERGED), status=status
    )
    if not contact.tangential_load_controlled:
        return status
    asked, room = contact.tangential_target, jnp.sum(contact.coefficient * pressed.pressure)
    held = jnp.sum(asked**2) < room**2
    return most_serious((~held & jnp.any(asked != 0.0), Status.GROSS_SLIP), status=status)
