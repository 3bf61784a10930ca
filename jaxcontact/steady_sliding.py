"""Steady sliding: the limit of a long run, as one contact problem."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact import _checks, spectral
from jaxcontact._pytree import as_float64, is_concrete, replace
from jaxcontact.contact import nonsymmetric
from jaxcontact.contact.implicit import solve_contact
from jaxcontact.contact.normal import Problem
from jaxcontact.controls import Approach, Control, Load
from jaxcontact.geometry import Indenter
from jaxcontact.grid import Grid
from jaxcontact.history.march import deepest_strain, smooth_cells, status_of
from jaxcontact.indentation import check_inputs, warn
from jaxcontact.kernels import build
from jaxcontact.layers import LayeredHalfSpace, checked_body
from jaxcontact.results import NOT_STEADY
from jaxcontact.sliding.observables import Observer
from jaxcontact.sliding.results import SteadySliding
from jaxcontact.sliding.steady import Track, doubled, extended, on_grid
from jaxcontact.sliding.track import as_array


def slide_steady(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    *,
    velocity: Array | float,
    grid: Grid,
    tolerance: Array | float = 1e-8,
    max_iterations: Array | int = 500,
) -> SteadySliding:
    """The contact of an indenter that has slid for ever at one velocity.

        u(x) = int_0^infinity dK/ds * p(x + v s) ds,   g = profile + u - approach >= 0,   p >= 0,   p g = 0

    velocity [m/s]: a number (along x) or (2,), of any size; the other arguments are those of ``indent``,
    control with a single value. One contact problem with a kernel that is not symmetric; differentiable as
    one.

    At rest a body that cannot flow is fully relaxed. Without a steady state there is a ValueError (under jit,
    status 6): a flowing body at rest, and a flowing half-space under a fixed approach. Under a load a flowing
    half-space has a steady pressure, while its approach drifts: see ``approach_drift`` of the result.

    Returns a ``SteadySliding``. Raises ValueError for what cannot be computed.
    """
    body, velocity = checked_body(body), as_array(velocity)
    check_steady(body, control, velocity)
    check_inputs(body, indenter, control, np.zeros(1), grid, "all", 1, "exact")
    result, separation = _run(
        *as_float64((body, indenter, control, velocity, grid, tolerance)), jnp.asarray(max_iterations)
    )
    warn(result, separation)
    return result


def check_steady(body: LayeredHalfSpace, control: Control, velocity: Array) -> None:
    """There is a steady state."""
    shape = np.shape(velocity)
    _checks.require(shape in ((), (2,)), f"velocity: expected a number or shape (2,), got shape {shape}")
    name, shape = type(control).__name__, np.shape(getattr(control, "value", 0.0))
    _checks.require(shape == (), f"{name}: expected one number in the steady state, got shape {shape}")
    flowing = flows(body)
    if not is_concrete(flowing, velocity):
        return
    speed = float(np.max(np.abs(np.asarray(velocity, dtype=float))))
    _checks.require(bool(np.isfinite(speed)), f"velocity [m/s]: expected finite, got {velocity}")
    if not bool(flowing):
        return
    _checks.require(
        speed > 0.0,
        "velocity [m/s]: expected not 0: the body flows without limit, so that at rest the contact grows"
        " for ever and there is no steady state",
    )
    _checks.require(
        bool(body.layers) or not isinstance(control, Approach),
        "control: expected a Load on a half-space that flows without limit: its surface sinks for ever, so"
        " that under a fixed approach the load falls to nothing and there is no steady state",
    )


def flows(body: LayeredHalfSpace) -> Array:
    """Whether the body flows without limit, ()."""
    fluidity = body.surface_material().spectrum().fluidity
    return jnp.zeros((), bool) if fluidity is None else jnp.asarray(fluidity) > 0.0


@jax.jit
def _run(body, indenter, control, velocity, grid, tolerance, max_iterations):
    """The compiled core: one trace for equal shapes and flags."""
    kernels = build(body, indenter, grid)
    units, ratio = kernels.units, grid.spacing[1] / grid.spacing[0]
    vector = jnp.stack([velocity, jnp.zeros(())]) if velocity.ndim == 0 else velocity
    if body.layers:
        point, shapes = None, extended(kernels, grid.shape)
    else:
        wide = replace(grid, shape=doubled(grid.shape))
        point, shapes = 1.0 - body.substrate.nu, build(body, indenter, wide).spectra[1:]
    track = Track(kernels, shapes, vector / units.length, ratio, point, grid.shape, velocity.ndim > 0)
    symbols, ones = track.symbols(), jnp.ones(kernels.rates.size)
    profile = indenter.profile(grid) / units.length
    load_controlled = isinstance(control, Load)
    scale = units.compliance / grid.cell_area if load_controlled else 1.0 / units.length
    problem = Problem(
        spectrum=track.without_history(0.0 * ones) + track.kernel(ones, symbols),
        circulant=track.circulant(),
        window=None,
        gap=profile,
        target=control.value * scale,
        lowest=jnp.min(profile),
        load_controlled=load_controlled,
    )
    start = nonsymmetric.cold_start(jax.lax.stop_gradient(problem))
    solution = solve_contact(problem, start, tolerance, max_iterations)
    result = _to_si(track, symbols, grid, profile, vector, solution, tolerance)
    endless = ~jnp.any(vector != 0.0) | (not body.layers and not load_controlled)
    status = jnp.where(flows(body) & endless, NOT_STEADY, result.status)
    return replace(result, status=status), kernels.separation_error


def _to_si(track: Track, symbols, grid, profile, velocity, solution, tolerance) -> SteadySliding:
    """The result in the user's units."""
    units, p = track.kernels.units, solution.pressure
    force = grid.cell_area / units.compliance
    speed = jnp.sum(velocity**2)
    direction = velocity / jnp.sqrt(jnp.where(speed > 0.0, speed, 1.0))
    pushed, centre, leading = Observer.of(profile, track.ratio).surface(p, direction)
    rates = track.kernels.rates
    # lambda_k C_k (p - lambda_k eta_k), the work of p on it
    speeds = track.without_history(jnp.ones_like(rates)) - track.without_history(jnp.zeros_like(rates))
    power = jnp.sum(p * spectral.convolve(speeds - track.kernel(rates, symbols), p))
    return SteadySliding(
        grid=grid,
        velocity=velocity,
        profile=profile * units.length,
        pressure=p / units.compliance,
        displacement=solution.displacement * units.length,
        approach=solution.approach * units.length,
        approach_drift=track.drift(jnp.sum(p)) * units.length,
        load=jnp.sum(p) * force,
        contact_area=jnp.sum(p > 0.0) * grid.cell_area,
        smooth_area=smooth_cells(p) * grid.cell_area,
        film_strain=_film_strain(track, symbols, p),
        lateral_force=pushed * force,
        tangential_force=-jnp.sum(pushed * direction) * force,
        pressure_centre=centre * units.length,
        leading_peak=leading / units.compliance,
        power=power * force * units.length,
        iterations=solution.iterations,
        error=solution.error,
        status=status_of(p, solution.error <= tolerance),
    )


def _film_strain(track: Track, symbols: Array, pressure: Array) -> Array:
    """Shortening of the film over its thickness at its deepest point."""
    film = track.kernels.film
    if film is None:
        return jnp.zeros(())
    symbol = jnp.tensordot(film.weights[1:], symbols, 1)
    strain = film.weights[0] * pressure + spectral.convolve(on_grid(symbol, track.shape), pressure)
    return deepest_strain(film.coefficients, strain)
