"""Indentation: a body and an indenter pressed on each other, in time."""

from __future__ import annotations

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace
from jaxcontact._support.scale import Scale
from jaxcontact._support.status import Status
from jaxcontact.contact.attraction import Attraction
from jaxcontact.history.growing import GrowingMemory, GrowthStep, ThicknessStep, VaryingMemory
from jaxcontact.history.memory import Memory
from jaxcontact.history.pressing import PressStepper
from jaxcontact.history.recursive import RecursiveMemory
from jaxcontact.history.superposition import DirectMemory, rows
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.adhesion import Adhesion, check_adhesion
from jaxcontact.inputs.controls import Control
from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import LayeredHalfSpace, ThicknessMap, body_at_first, separate_map
from jaxcontact.operators.kernels import Errors, Kernels, build_images
from jaxcontact.results.contact import AdhesiveHistory, ContactHistory
from jaxcontact.results.notes import announce
from jaxcontact.verbs.experiment import Plan, Save, TimedExperiment, fine_steps, fine_values, marched

WIDER, MOST_WIDENINGS = 1.5, 4  # of a grid that the contact outgrows


def indent(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    times: Array,
    *,
    grid: Grid | str,
    tolerance: Array | float = 1e-8,
    max_iterations: Array | int = 500,
    save: Save = "all",
    substeps: int = 1,
    correspondence: str = "exact",
    kernels: Kernels | None = None,
    checkpoint: str = "pressures",
    adhesion: Adhesion | None = None,
) -> ContactHistory:
    """Press an indenter on a body and follow the contact in time.

        u(x, t) = int_0^t K(x, t - s) * dp(x, s),   g = profile + u - approach >= 0,   p >= 0,   p g = 0

    All numbers in body, indenter and control are differentiable: differentiate a field of the result, not the
    whole (it has integers). Where a cell enters contact the derivative is that of the side on which it is
    out; without contact pressure, load and area have derivative zero. Second derivatives hold the area of
    contact: ``contact.implicit``. Source: Wang et al., Tribology Letters 2025, doi
    10.1007/s11249-025-01990-5, sections 2.2 to 2.4, with the correspondence principle made exact and the
    integral second order in time.

    Args:
        body: a ``LayeredHalfSpace``, SI units; a ``Layer`` may have a thickness (nt,) over the times, which costs
            kernels at each step, or (nx, ny) or (nt, nx, ny) in the plane; both take no ``kernels``: ``history.growing``,
            ``operators.varying``.
        indenter: ``Sphere``, ``Cone``, ``Cylinder``, ``FlatPunch`` or ``HeightField``.
        control: ``Load`` [N] or ``Approach`` [m], a number or (nt,), which steps on at times[0] and is linear
            between times.
        times: (nt,) [s], not decreasing; two equal times are a jump.
        grid: a ``Grid``; where it is periodic, displacement and approach are measured from the mean of the body's
            surface, in plane strain from the surface at a distance of one width of the grid. "auto", outside of jit, vmap
            and grad: ``Grid.around``, made wider, with a warning, for as long as the contact reaches its edge.
        tolerance: dimensionless, up to 0.01, see ``contact.normal``.
        max_iterations: of each contact.
        save: "all" keeps the fields of all times, "last" those of the last; a function of one step
            (``.pressure`` (nx, ny) [Pa], ``.gap``, ``.approach``, ...: ``results.ContactStep``) has its values
            stacked over time in ``saved``.
        substeps: inner steps between two times, static.
        correspondence: "exact" (recursion over common decay rates), or "quasi-elastic" (the paper's
            substitution of phi(t) for 1/(2G), by direct superposition; time grows with nt^2, memory with nt).
        kernels: from ``jaxcontact.kernels(body, indenter, grid)``, to skip building them; the response and its
            derivatives are then those of the kernels: ``body`` and ``indenter.material`` have none of their own.
        checkpoint: what reverse mode keeps: "pressures" (a field for each inner step, and no contact is solved
            again) or "blocks" (the state of every sqrt(nt)-th step, and every contact is solved twice): 2.7
            or 0.7 GB for 2000 steps at 256 x 256 cells with save="last".
        adhesion: ``ExponentialAdhesion`` or ``DugdaleAdhesion``; None: the surfaces do not attract each other. With it the
            control may be negative, the pressure is the sum of contact and attraction, and contact is where the gap is zero.
            A step follows the branch of solutions from the step before, and jumps where it ends (``contact.adhesive``). The
            tolerance is then the largest traction out of balance over the largest traction.

    Returns:
        A ``ContactHistory``, with adhesion an ``AdhesiveHistory``. Failure to converge is data: ``status`` and
        ``converged``. Its ``notes`` tell of film strain above 0.2, of fewer than 10 cells across the contact, of
        shared decay rates off by more than 1e-3, and of a response that is off on the grid by more than 1e-4; outside
        of jit, vmap and grad they are warnings as well.

    Raises:
        ValueError: what cannot be computed, before anything is; on a periodic grid, an approach beyond the mean gap at
            first touch.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> grid = jc.Grid.square(n=32, width=300e-6)
        >>> history = jc.indent(glass, jc.Sphere(5e-3), jc.Load(20.0), [0.0], grid=grid)
        >>> f"{history.approach[0] * 1e6:.2f} um"         # Hertz: (9 W^2 (1 - nu)^2/(64 G^2 R))^(1/3)
        '1.92 um'
    """
    options: dict[str, Any] = {
        "tolerance": tolerance,
        "max_iterations": max_iterations,
        "save": save,
        "substeps": substeps,
        "correspondence": correspondence,
        "kernels": kernels,
        "checkpoint": checkpoint,
        "adhesion": adhesion,
    }
    solve = _widening if isinstance(grid, str) else _solved
    history = solve(body, indenter, control, times, grid=grid, **options)
    announce(history, stacklevel=2)
    return history


def _solved(*given: Any, **options: Any) -> ContactHistory:
    """Return the history on a given grid, without warnings."""
    return marched(Indentation.of(*given, **options))


def _widening(*given: Any, grid: Any, **options: Any) -> ContactHistory:
    """Solve, on a wider grid of as many cells while the contact reaches the edge."""
    checks.require(
        grid == "auto" and options["kernels"] is None,
        f'grid: expected a Grid, or "auto" without kernels, got {grid!r}',
    )
    checks.require(is_concrete(*given), 'grid: expected a Grid inside jit, vmap and grad, got "auto"')
    grid = Grid.around(*given)
    for widened in range(MOST_WIDENINGS + 1):
        history = _solved(*given, grid=grid, **options)
        if widened == MOST_WIDENINGS or not np.any(np.asarray(history.status) == Status.AT_EDGE):
            break
        grid = replace(grid, spacing=tuple(WIDER * float(d) for d in grid.spacing))
    told = replace(history.diagnostics, widenings=jnp.asarray(widened))
    return replace(history, diagnostics=told)


@pytree
class Indentation(TimedExperiment):
    """An indentation; thicknesses: of layers that grow or wear, over times, (nt, layers) [m]; None: constant ones; adhesion:
    a law of adhesion, or None.
    """

    thicknesses: Array | None = None
    adhesion: Adhesion | None = None

    @classmethod
    def of(  # type: ignore[override]
        cls,
        body: LayeredHalfSpace,
        indenter: Indenter,
        control: Control,
        times: Any,
        *,
        adhesion: Adhesion | None = None,
        **options: Any,
    ) -> Self:
        good = check_adhesion(adhesion)
        body, thicknesses, thick = body_at_first(body, np.size(times))
        body, film_map, in_range = separate_map(
            body, getattr(options.get("grid"), "shape", ()), np.size(times)
        )
        checks.require(
            adhesion is None or film_map is None,
            "adhesion: expected None with a film whose thickness varies in the plane, got a law",
        )
        experiment = super().of(
            body, indenter, control, times, film_map=film_map, adhesive=adhesion is not None, **options
        )
        experiment = replace(experiment.also(good), adhesion=as_float64(adhesion))
        if thicknesses is None and film_map is None:
            return experiment
        plain = options.get("kernels") is None and experiment.options.correspondence == "exact"
        varies = "over times" if film_map is None else "in the plane"
        checks.require(plain, f'layer thickness {varies}: expected no kernels and correspondence="exact"')
        return replace(experiment.also(thick).also(in_range), thicknesses=thicknesses)

    def planned(self) -> Plan:
        """Return the march: by recursion, or by superposition where it is quasi-elastic."""
        if self.options.correspondence == "quasi-elastic":
            return self._superposed()
        dt = fine_steps(self.times, self.options.substeps)
        if self.film_map is not None:
            return self._varying(self.film_map, dt)
        kernels = self.ready_kernels
        memory: Memory = RecursiveMemory(kernels)
        more: Any = dt
        if self.thicknesses is not None:
            memory = GrowingMemory(self.body, self.indenter, self.grid, kernels)
            more = self._growth(self.thicknesses, dt)
        return self._pressed(memory, more, kernels.scale, kernels.errors(self.duration))

    def _pressed(self, memory: Memory, more: Any, scale: Scale, errors: Errors) -> Plan:
        if self.adhesion is None:
            return self.plan(PressStepper(memory, **self.contact(scale)), more, scale, errors)
        law = Attraction(self.adhesion.scaled(scale.length, scale.compliance), self.grid.periodic)
        stepper = PressStepper(memory, **self.contact(scale), law=law)
        return self.plan(stepper, more, scale, errors, makes=AdhesiveHistory)

    def _varying(self, film: ThicknessMap, dt: Array) -> Plan:
        """Return the march on a film whose thickness varies in the plane, and in time where it does."""
        kernels = self.varying_kernels
        scale, errors = kernels.uniform.scale, kernels.errors(self.duration)
        if not film.over_times:
            return self._pressed(RecursiveMemory(kernels.at(film.values)), dt, scale, errors)
        after = fine_values(film.values, self.options.substeps)
        flat = after.reshape(-1, *self.grid.shape)
        before = jnp.concatenate([flat[:1], flat[:-1]]).reshape(after.shape)
        memory = VaryingMemory(kernels, film.at_first)
        return self._pressed(memory, ThicknessStep(dt, before, after), scale, errors)

    def _growth(self, thicknesses: Array, dt: Array) -> GrowthStep:
        """Return the inner steps, (nt, substeps), with the thicknesses in the middle of each."""
        fine = fine_values(thicknesses, self.options.substeps)
        ends = fine.reshape(dt.size, -1)
        middle = (ends + jnp.concatenate([ends[:1], ends[:-1]])) / 2.0
        return GrowthStep(dt, middle.reshape(fine.shape))

    def _superposed(self) -> Plan:
        images = build_images(self.body, self.indenter, self.grid)
        when = fine_values(self.times, self.options.substeps)
        table: Any = rows(self.body, self.indenter, when.ravel(), quasi_elastic=True)
        table = jax.tree.map(lambda a: a.reshape(*when.shape, *a.shape[1:]), table)
        memory = DirectMemory(images, jnp.zeros(when.size))
        errors = Errors(jnp.zeros(()), images.image_error, jnp.asarray(jnp.inf))
        return self._pressed(memory, table, images.scale, errors)
