"""Indentation: the public function, from material to result in one call."""

import functools
import warnings
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact import _checks
from jaxcontact._pytree import as_float64, is_concrete
from jaxcontact.controls import Approach, Control, Load
from jaxcontact.geometry import Indenter
from jaxcontact.grid import Grid
from jaxcontact.history import march as marching
from jaxcontact.history.recursive import RecursiveMemory
from jaxcontact.history.superposition import DirectMemory, rows
from jaxcontact.kernels import Kernels, build, build_superposition, check_grid
from jaxcontact.layers import LayeredHalfSpace, checked_body, is_rigid_at_first
from jaxcontact.results import STATUS_MEANING, ContactHistory

STRAIN_LIMIT = 0.2
SEPARATION_LIMIT = 1e-3
FEW_CELLS = 10


def indent(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    times: Array,
    *,
    grid: Grid,
    tolerance: Array | float = 1e-8,
    max_iterations: Array | int = 500,
    save: str | Callable[[Any], Any] = "all",
    substeps: int = 1,
    correspondence: str = "exact",
    kernels: Kernels | None = None,
    checkpoint: str = "pressures",
) -> ContactHistory:
    """Press an indenter on a body and follow the contact in time.

        u(x, t) = int_0^t K(x, t - s) * dp(x, s),   g = profile + u - approach >= 0,   p >= 0,   p g = 0

    body, indenter, control: pytrees, all numbers in them differentiable, SI units. control: ``Load`` [N] or
    ``Approach`` [m], a number or (nt,), which steps on at times[0] and is linear between times.
    times: (nt,) [s], not decreasing; two equal times are a jump. grid: ``Grid``.

    tolerance: dimensionless, see ``contact.normal``. save: "all" keeps the fields of all times, "last" those
    of the last; a function of a step's outcome (``.pressure``, ``.displacement``, in ``kernels.Units``) has
    its values stacked over time in ``saved``. substeps: inner steps between two times, static.
    correspondence: "exact" (recursion over common decay rates), or "quasi-elastic" (the paper's
    substitution of phi(t) for 1/(2G), by direct superposition; time grows with nt^2, memory with nt).
    kernels: from ``jaxcontact.kernels(body, indenter, grid)``, to skip building them; the response and its
    derivatives are then those of the kernels, and ``body`` and ``indenter.material`` have none of their own.
    checkpoint: what reverse mode keeps: "pressures" (a field for each inner step, and no contact is solved
    again) or "blocks" (the state of every sqrt(nt)-th step, and every contact is solved twice): 2.7 or
    0.7 GB for 2000 steps at 256 x 256 cells with save="last".

    Returns a ``ContactHistory``; differentiate a field of it, not the whole (it has integers). Where a cell
    enters contact the derivative is that of the side on which it is out; without contact pressure, load
    and area have derivative zero. Second derivatives hold the area of contact: ``contact.implicit``.
    Raises ValueError for what cannot be computed, before anything is. Failure to converge is data:
    ``status`` and ``converged``. Warns of film strain above 0.2, of fewer than 10 cells across the
    contact, and of shared decay rates that are off by more than 1e-3.

    Source: Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, sections 2.2 to 2.4,
    with the correspondence principle made exact and the integral second order in time.
    """
    body = checked_body(body)
    check_inputs(body, indenter, control, times, grid, save, substeps, correspondence)
    _checks.require(
        checkpoint in ("pressures", "blocks"),
        f'checkpoint: expected "pressures" or "blocks", got {checkpoint!r}',
    )
    if kernels is not None:
        check_kernels(kernels, grid, correspondence)
    result, separation = _run(
        *as_float64((body, indenter, control, times, grid, tolerance)),
        jnp.asarray(max_iterations),
        kernels,
        save=save,
        substeps=substeps,
        quasi_elastic=correspondence == "quasi-elastic",
        checkpoint=checkpoint,
    )
    warn(result, separation)
    return result


def check_inputs(body, indenter, control, times, grid, save, substeps, correspondence) -> None:
    _checks.require(
        isinstance(indenter, Indenter), f"indenter: expected a Sphere, ..., got {type(indenter).__name__}"
    )
    check_grid(grid)
    indenter.check(grid)
    _checks.not_decreasing("times [s]", times)
    check_control(control, np.shape(times)[0])
    _checks.require(
        save in ("all", "last") or callable(save), f'save: expected "all", "last" or a function, got {save!r}'
    )
    _checks.require(
        isinstance(substeps, int) and 1 <= substeps <= 1000, f"substeps: expected 1 to 1000, got {substeps}"
    )
    _checks.require(
        correspondence in ("exact", "quasi-elastic"),
        f'correspondence: expected "exact" or "quasi-elastic", got {correspondence!r}',
    )
    _checks.require(
        not (is_rigid_at_first(body) and indenter.material is None),
        "a Kelvin-Voigt surface has J(0) = 0: a rigid indenter cannot be pressed on it in a step;"
        " expected an elastic indenter or a material with an instantaneous compliance",
    )
    _checks.require(
        not (is_rigid_at_first(body) and body.layers and correspondence == "exact"),
        "layer: a material with J(0) = 0 has no bound on its decay rates over a substrate; expected one with an"
        ' instantaneous compliance (StandardLinearSolid, say), or correspondence="quasi-elastic"',
    )


def check_control(control: Control, nt: int) -> None:
    """A Load or Approach, a number or (nt,); a load not negative and somewhere positive."""
    _checks.require(
        isinstance(control, Load | Approach), f"control: expected Load or Approach, got {control!r}"
    )
    name = type(control).__name__
    shape = np.shape(control.value)
    _checks.require(
        shape in ((), (nt,)), f"{name}: expected a number or shape ({nt},) as times, got shape {shape}"
    )
    if is_concrete(control):
        values = np.asarray(control.value, dtype=float)
        _checks.require(bool(np.all(np.isfinite(values))), f"{name}: expected finite values, got {values}")
        if isinstance(control, Load):
            _checks.non_negative("Load [N]", values)
            _checks.require(
                bool(np.any(values > 0)), f"Load [N]: expected > 0 at some time, got {np.max(values):g}"
            )


def check_kernels(kernels: Kernels, grid: Grid, correspondence: str) -> None:
    """Kernels of that grid, for the exact correspondence."""
    _checks.require(correspondence == "exact", 'kernels: expected correspondence="exact" with them')
    shape = (kernels.circulants.shape[-1], (kernels.circulants.shape[-2] - 1) * 2)
    fits = shape[0] == grid.shape[0] and abs(shape[1] - grid.shape[1]) <= 1
    _checks.require(fits, f"kernels: expected those of a grid of {grid.shape} cells, got about {shape}")
    if is_concrete(kernels.units, grid):
        built, given = float(kernels.units.length), float(grid.spacing[0])
        _checks.require(
            np.isclose(built, given), f"kernels: expected those of cells of {given:g} m, got {built:g} m"
        )


@functools.partial(jax.jit, static_argnames=("save", "substeps", "quasi_elastic", "checkpoint"))
def _run(
    body,
    indenter,
    control,
    times,
    grid,
    tolerance,
    max_iterations,
    kernels,
    *,
    save,
    substeps,
    quasi_elastic,
    checkpoint,
):
    """The compiled core: one trace for equal shapes and flags."""
    setup, steps, units, separation = prepare(
        body, indenter, control, times, grid, tolerance, max_iterations, kernels, substeps, quasi_elastic
    )
    outcomes, last = marching.march_from_rest(setup, steps, save, checkpoint)
    return to_si(times, grid, setup, units, outcomes, last, save), separation


def prepare(
    body, indenter, control, times, grid, tolerance, max_iterations, kernels, substeps, quasi_elastic
):
    """Everything the march needs: its setup, its steps, the units, and the error of shared rates."""
    fine, dt = fine_times(times, substeps)
    if quasi_elastic:
        images = build_superposition(body, indenter, grid)
        memory: Any = DirectMemory(images, jnp.zeros(fine.size))
        inputs: Any = rows(body, indenter, fine.ravel(), quasi_elastic=True)
        inputs = jax.tree.map(lambda a: a.reshape(*fine.shape, *a.shape[1:]), inputs)
        units, separation = images.units, jnp.zeros(())
    else:
        kernels = build(body, indenter, grid) if kernels is None else kernels
        memory, inputs = RecursiveMemory(kernels), dt
        units, separation = kernels.units, kernels.separation_error
    load_controlled = isinstance(control, Load)
    scale = units.compliance / grid.cell_area if load_controlled else 1.0 / units.length
    targets = fine_values(control.value * scale, times, substeps)
    setup = marching.Setup(
        memory, indenter.profile(grid) / units.length, tolerance, max_iterations, load_controlled
    )
    return setup, marching.Steps(dt, targets, inputs), units, separation


def fine_times(times: Array, substeps: int) -> tuple[Array, Array]:
    """Inner times and their steps, (nt, substeps); the first row has no length."""
    before = jnp.append(times[:1], times[:-1])
    share = jnp.arange(1, substeps + 1) / substeps
    dt = (times - before)[:, None] / substeps * jnp.ones(substeps)
    return before[:, None] + (times - before)[:, None] * share, dt


def fine_values(value: Array, times: Array, substeps: int) -> Array:
    """The control at the inner times, (nt, substeps), linear between times."""
    values = jnp.broadcast_to(value, times.shape)
    before = jnp.append(values[:1], values[:-1])
    share = jnp.arange(1, substeps + 1) / substeps
    return before[:, None] + (values - before)[:, None] * share


def to_si(times, grid, setup, units, outcomes, last, save) -> ContactHistory:
    """The result in the user's units."""
    fields = outcomes if save == "all" else last
    return ContactHistory(
        times=times,
        grid=grid,
        profile=setup.profile * units.length,
        pressure=fields.pressure / units.compliance,
        displacement=fields.displacement * units.length,
        saved=outcomes.pressure if callable(save) else None,
        approach=outcomes.approach * units.length,
        load=outcomes.total * grid.cell_area / units.compliance,
        contact_area=outcomes.cells * grid.cell_area,
        smooth_area=outcomes.smooth_cells * grid.cell_area,
        film_strain=outcomes.film_strain,
        iterations=outcomes.iterations,
        error=outcomes.error,
        status=outcomes.status,
    )


def warn(result: ContactHistory, separation: Array) -> None:
    """Say what a user should know of a finished run; silent under jit, grad and vmap."""
    if not is_concrete(result, separation):
        return
    status, strain = np.asarray(result.status), float(jnp.max(result.film_strain))
    for code in sorted(set(status[status > 0].tolist())):
        count = int(np.sum(status == code))
        warnings.warn(f"{count} of {status.size} steps: {STATUS_MEANING[code]}", stacklevel=3)
    if strain > STRAIN_LIMIT:
        text = f"film strain reaches {strain:.2g}: above {STRAIN_LIMIT} the linear theory is stretched"
        warnings.warn(text, stacklevel=3)
    if float(separation) > SEPARATION_LIMIT:
        text = f"shared decay rates are off by up to {float(separation):.1g}: pass kernels with more nodes"
        warnings.warn(text, stacklevel=3)
    area = np.asarray(result.contact_area)[np.asarray(result.contact_area) > 0.0]
    across = 2.0 * np.sqrt(np.min(area) / np.pi / float(result.grid.cell_area)) if area.size else np.inf
    if across < FEW_CELLS:
        warnings.warn(
            f"only {across:.1f} cells across the smallest contact: below {FEW_CELLS} it is coarse",
            stacklevel=3,
        )
