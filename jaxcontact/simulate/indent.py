"""Indentation: a body and an indenter pressed on each other, in time."""

from __future__ import annotations

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.pytree import is_concrete, pytree, replace
from jaxcontact._support.status import Status
from jaxcontact.bodies.body import LayeredHalfSpace, body_at_first, separate_map
from jaxcontact.bodies.controls import Control
from jaxcontact.bodies.grid import Grid
from jaxcontact.bodies.laws import Adhesion
from jaxcontact.history.memory import (
    DirectMemory,
    GrowingMemory,
    GrowthStep,
    Memory,
    RecursiveMemory,
    ThicknessStep,
    VaryingMemory,
    rows,
    with_indenter,
)
from jaxcontact.history.normal_step import PressStepper
from jaxcontact.history.time_loop import Delayed, fine_steps, fine_values
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.operators.kernels import Errors, Kernels, build_images
from jaxcontact.response.stack import surface_creep, surface_material
from jaxcontact.results.contact import AdhesiveHistory, ContactHistory
from jaxcontact.results.notes import announce
from jaxcontact.simulate.run import (
    Experiment,
    Plan,
    Save,
    marched,
    refined,
)

# factor on the width of a grid that the contact outgrows, and how often it is applied
WIDER, MOST_WIDENINGS = 1.5, 4

# Work in cell steps up to which no search begins in a window, that of a single contact of 128 x 128 cells: without it a call
# takes 22 ms instead of 17, and the first one 2.6 s instead of 3.5.
SINGLE = 128**2


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
    substeps: int | str = 1,
    correspondence: str = "exact",
    kernels: Kernels | None = None,
    checkpoint: str = "pressures",
    adhesion: Adhesion | None = None,
    hardness: Array | float | None = None,
) -> ContactHistory:
    """Compute the contact of an indenter with a body under a prescribed load or approach over time.

        u(x, t) = int_0^t K(x, t - s) * dp(x, s),   g = profile + u - approach >= 0,   p >= 0,   p g = 0

    The fields of the result are differentiable with respect to all numbers in body, indenter and control. Differentiate a
    field and not the whole result, which contains integers. Where a cell is just entering contact, the derivative is the
    one-sided derivative with the cell outside. Without contact the derivatives of pressure, load and area are zero. Second
    derivatives are those at constant contact area (``contact.implicit``).

    Source: Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, sections 2.2 to 2.4, with the exact
    correspondence principle and a time integration of second order.

    Args:
        body: a ``LayeredHalfSpace`` in SI units. The thickness of a ``Layer`` may be (nt,), one value for each time,
            which requires new kernels at each step (``history.memory``), or (nx, ny) or (nt, nx, ny) if it varies in the
            plane (``operators.kernels``). With such a layer, ``kernels`` cannot be given.
        indenter: ``Sphere``, ``Cone``, ``Cylinder``, ``FlatPunch`` or ``HeightField``, rigid, elastic, or of a material that
            creeps or a ``LayeredHalfSpace`` (a coated ball): its surface then has a memory of its own, as the body has, and
            displacement and film strain in the result. Not with ``correspondence="quasi-elastic"``.
        control: ``Load`` [N] or ``Approach`` [m], a number or (nt,). It is applied as a step at times[0] and is linear
            between the times.
        times: (nt,) [s], not decreasing; two equal times define a step change.
        grid: a ``Grid``. On a grid that is periodic along both axes, displacement and approach are measured from the mean
            of the body's surface, and in plane strain from the surface at a distance of one width of the grid. "auto"
            takes ``Grid.around`` and, while the contact reaches the edge, a wider grid, with a warning; it cannot be used
            inside jit, vmap and grad.
        tolerance: stopping error of each contact problem, dimensionless, up to 0.01 (``contact.normal``).
        max_iterations: largest number of iterations of each contact problem.
        save: "all" keeps the fields of all times, "last" those of the last time. A function of one step
            (``.pressure`` (nx, ny) [Pa], ``.gap``, ``.approach``, ...: ``results.contact.ContactStep``) is called at each
            time, and its return values are stacked over time in ``saved``.
        substeps: number of inner steps between two times, static, or "auto", which repeats the run with 4, 16 and 64 of them
            until ``time_step_error`` is below 1 % at all times, with a note if it is not with 64. "auto" cannot be used
            inside jit, vmap and grad.
        correspondence: "exact" (recursion over common decay rates), or "quasi-elastic" (the substitution of phi(t) for
            1/(2G) in the paper, by direct superposition, with a computing time proportional to nt^2 and memory to nt).
        kernels: the result of ``jaxcontact.kernels(body, indenter, grid)``, which are then not computed again. The response
            and its derivatives are those of the kernels; the derivatives with respect to ``body`` and
            ``indenter.material`` are then zero.
        checkpoint: the quantities stored for the reverse mode: "pressures" (a field for each inner step; no contact is
            solved again) or "blocks" (the state at every sqrt(nt)-th step; every contact is solved twice). 2000 steps on
            256 x 256 cells with save="last" take 2.7 and 0.7 GB.
        adhesion: ``ExponentialAdhesion``, ``DugdaleAdhesion`` or a law of one's own (``jaxcontact.abc``); None for surfaces
            without attraction. With adhesion the
            control may be negative, the pressure is the contact pressure minus the attraction, and a cell is in contact if
            its gap is zero. The solution follows the branch of equilibria of the previous step, and jumps where this branch
            ends (``contact.adhesive``). On a film whose thickness varies in the plane a sequence of contacts is solved in
            each step; let the approach grow in several steps. The stopping error is then the largest displacement under
            the traction that is not balanced, over the mean displacement.
        hardness: H [Pa], a number or (nx, ny), of surfaces that yield: cells are elastic and perfectly plastic, 0 <= p <= H,
            and what the elastic surfaces cannot close at p = H stays as the ``dent`` of the body, from which unloading and
            later loading start (A. Almqvist et al., Tribology International 40 (2007) 574). A load above H times the area
            of the grid has status 15. None for surfaces that do not yield; it is None with adhesion.

    Returns:
        A ``ContactHistory``, with adhesion an ``AdhesiveHistory``. Failures are reported in ``status`` and ``converged``,
        not raised. Its ``notes`` report a film strain above 0.2, fewer than 10 cells across the contact, an error of the
        common decay rates above 1e-3, and an error of the response on the grid above 1e-4. Outside jit, vmap and grad
        the notes are also issued as warnings.

    Raises:
        ValueError: invalid or unsupported input, before the computation starts; on a grid that is periodic along both
            axes, an approach that is not less than the mean gap at first touch.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> grid = jc.Grid.square(n=32, width=300e-6)
        >>> history = jc.indent(glass, jc.Sphere(5e-3), jc.Load(20.0), [0.0], grid=grid)
        >>> f"{history.approach[0] * 1e6:.2f} um"         # Hertz: (9 W^2 (1 - nu)^2/(64 G^2 R))^(1/3)
        '1.92 um'
    """

    def solve_on(grid: Any) -> Any:
        make = lambda count: Indentation.of(
            body, indenter, control, times, grid, substeps=count, tolerance=tolerance, max_iterations=max_iterations,
            kernels=kernels, save=save, correspondence=correspondence, checkpoint=checkpoint, adhesion=adhesion,
            hardness=hardness,
        )  # fmt: skip
        return refined(marched, make, substeps)

    if not isinstance(grid, str):
        history = solve_on(grid)
    else:
        # "auto": wider grids with the same number of cells, while the contact reaches the edge
        checks.require(
            grid == "auto" and kernels is None,
            f'grid: expected a Grid, or "auto" without kernels, got {grid!r}',
        )
        concrete = is_concrete(body, indenter, control, times)
        checks.require(concrete, 'grid: expected a Grid inside jit, vmap and grad, got "auto"')
        tried = Grid.around(body, indenter, control, times)
        for widened in range(MOST_WIDENINGS + 1):
            history = solve_on(tried)
            if widened == MOST_WIDENINGS or not np.any(np.asarray(history.status) == Status.AT_EDGE):
                break
            tried = replace(tried, spacing=tuple(WIDER * float(d) for d in tried.spacing))
        diagnostics = replace(history.diagnostics, widenings=jnp.asarray(widened))
        history = replace(history, diagnostics=diagnostics)
    announce(history, stacklevel=2)
    return history


@pytree
class Indentation(Experiment):
    """The checked arguments of ``indent``.

    thicknesses: of layers that grow or wear, at each time, (nt, layers) [m], None where they are constant.
    """

    thicknesses: Array | None

    @classmethod
    def of(  # type: ignore[override]
        cls,
        body: LayeredHalfSpace,
        indenter: Indenter,
        control: Control,
        times: Any,
        grid: Grid,
        **given: Any,
    ) -> Self:
        """Check the arguments of ``indent``; given: further arguments of ``Experiment.of``."""
        # A thickness that varies over times or in the plane is separated from the body, whose layers have a constant one.
        count = np.size(times)
        body, thicknesses, thicknesses_valid = body_at_first(body, count)
        body, film_map, map_valid = separate_map(body, getattr(grid, "shape", ()), count)
        experiment = Experiment.of(body, indenter, control, times, grid, film_map=film_map, **given)
        if thicknesses is not None or film_map is not None:
            plain = experiment.kernels is None and experiment.correspondence == "exact"
            varies = "over times" if film_map is None else "in the plane"
            checks.require(plain, f'layer thickness {varies}: expected no kernels and correspondence="exact"')
            experiment = experiment.also(thicknesses_valid).also(map_valid)
        return cls(**vars(experiment), thicknesses=thicknesses)

    @property
    def has_prescribed_changes(self) -> bool:
        return self.thicknesses is not None or super().has_prescribed_changes

    def planned(self) -> Plan:
        """Return the plan: the memory of the body, the stepper of its contact, and the input of the steps.

        more: the input of the memory at each inner step: its length, and what changes in the body.
        """
        substeps, film = self.substeps, self.film_map
        dt: Array = fine_steps(self.times, substeps)
        memory: Memory
        more: Any = dt

        if self.correspondence == "quasi-elastic":
            # the paper's correspondence: direct superposition, with the responses at all lags for each step
            images = build_images(self.body, self.indenter, self.grid)
            when = fine_values(self.times, substeps)
            table: Any = rows(self.body, self.indenter, when.ravel(), quasi_elastic=True)
            more = jax.tree.map(lambda a: a.reshape(*when.shape, *a.shape[1:]), table)
            # the estimate of ``time_step_error`` takes the decay rates of the material at the surface
            creep = surface_creep(surface_material(self.body))
            rates, shares = creep.rates, creep.rates * creep.amplitudes / creep.instantaneous
            if creep.fluidity is not None:
                rates = jnp.append(rates, 0.0)
                shares = jnp.append(shares, creep.fluidity / creep.instantaneous)
            memory = DirectMemory(images, Delayed(rates, shares), when.size)
            scale, errors = images.scale, Errors(jnp.zeros(()), images.image_error, jnp.asarray(jnp.inf))
        elif film is not None:
            # a film whose thickness varies in the plane, or in the plane and in time
            scale, errors = self.kernels.scale, self.kernels.errors(self.duration)
            if not film.over_times:
                memory = RecursiveMemory(self.kernels.at(film.values))
            else:
                after = fine_values(film.values, substeps)
                flat = after.reshape(-1, *self.grid.shape)
                before = jnp.concatenate([flat[:1], flat[:-1]]).reshape(after.shape)
                memory, more = VaryingMemory(self.kernels, film.at_first), ThicknessStep(dt, before, after)
        else:
            # layers of constant thickness: recursion over the decay rates of the body
            scale, errors = self.kernels.scale, self.kernels.errors(self.duration)
            memory = RecursiveMemory(self.kernels)
            if self.thicknesses is not None:
                # layers that grow or wear: in each step kernels for the thicknesses in its middle
                fine = fine_values(self.thicknesses, substeps)
                ends = fine.reshape(dt.size, -1)
                middle = (ends + jnp.concatenate([ends[:1], ends[:-1]])) / 2.0
                memory = GrowingMemory(self.body, self.indenter, self.grid, self.kernels)
                more = GrowthStep(dt, middle.reshape(fine.shape))

        if self.kernels is not None:
            memory = with_indenter(memory, self.kernels)

        stepper = PressStepper(memory, **self.stepper_arguments(scale), windowed=self.work > SINGLE)
        steps = self.steps(scale, more)
        time_fields = {"times": self.times} | self.tabor_number
        result_class = ContactHistory if self.adhesion is None else AdhesiveHistory
        return Plan(stepper, steps, scale, errors, time_fields, {"grid": self.grid}, result_class)
