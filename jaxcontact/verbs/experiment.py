"""Common basis of the verbs: the validation of arguments, the preparation of an experiment and the conversion to SI.

A verb over time makes a ``TimedExperiment`` of its arguments, whose ``planned`` gives a ``Plan`` with the stepper of its
kind, and the march does the rest; a steady state is solved with the pieces. Options are named here, once.
"""

from __future__ import annotations

import abc
from typing import Any, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace, static, untupled
from jaxcontact._support.scale import Scale
from jaxcontact.history.march import Stepper, Steps
from jaxcontact.indenters.shapes import Indenter, checked_indenter
from jaxcontact.inputs.controls import Control, Load, check_control
from jaxcontact.inputs.grid import Grid, check_grid
from jaxcontact.inputs.layers import LayeredHalfSpace, ThicknessMap, checked_body
from jaxcontact.operators.kernels import Errors, Kernels, check_kernels, check_stiffness, compiled_build
from jaxcontact.operators.thickness_kernels import VaryingKernels, compiled_varying
from jaxcontact.operators.traction_kernels import TractionKernels
from jaxcontact.response.limits import limits_of
from jaxcontact.response.stack import solids
from jaxcontact.results.contact import ContactHistory, ContactStep
from jaxcontact.verbs.plan import Plan, fine_steps, fine_values
from jaxcontact.verbs.setup import ContactSetup, Options, Settings

LOOSEST = 1e-2  # tolerance


@pytree
class Experiment:
    """A validated experiment in SI units and float64; valid: None, or whether traced values are in range.

    film_map: the thickness of a film that varies in the plane; the layer of ``body`` is then as thick as it is at most.
    """

    body: LayeredHalfSpace
    indenter: Indenter
    control: Control
    times: Array
    grid: Grid
    tolerance: Array
    max_iterations: Array
    kernels: Kernels | VaryingKernels | TractionKernels | None
    valid: Array | None
    options: Options = static()
    film_map: ThicknessMap | None

    @classmethod
    def of(
        cls,
        setup: ContactSetup,
        settings: Settings,
        *,
        film_map: ThicknessMap | None = None,
        adhesive: bool = False,
    ) -> Self:
        """Check all that verbs have in common; ValueError for what cannot be computed. adhesive: loads may be negative."""
        indenter, control, times, grid = setup.indenter, setup.control, untupled(setup.times), setup.grid
        tolerance, max_iterations, kernels = settings.tolerance, settings.max_iterations, settings.kernels
        body, valid = checked_body(setup.body)
        valid = valid & check_grid(grid) & checked_indenter(indenter, grid)
        valid = valid & checks.not_decreasing("times [s]", times)
        valid = valid & check_control(control, np.shape(times)[0], adhesive=adhesive)
        valid = valid & checks.between("tolerance", tolerance, 0.0, LOOSEST)
        if is_concrete(max_iterations):
            checks.whole("max_iterations", np.asarray(max_iterations).item(), 1, 10**9)
        settings.options.check()
        if kernels is not None:
            exact = settings.options.correspondence == "exact"
            checks.require(exact, 'kernels: expected correspondence="exact" with them')
            valid = valid & check_kernels(kernels, grid)
        valid = valid & check_stiffness(body)
        valid = valid & _check_instantaneous_compliance(body, indenter, settings.options.correspondence)
        valid = valid & _check_approach_range(control, indenter, grid, film_map)
        given = as_float64((body, indenter, control, times, grid, tolerance))
        known = None if valid is True else jnp.asarray(valid)
        iterations = jnp.asarray(max_iterations, int)
        return cls(*given, iterations, kernels, known, settings.options, film_map=as_float64(film_map))

    def also(self, verdict: Verdict) -> Self:
        """The experiment with one more condition on values that are not known yet."""
        if verdict is True:
            return self
        return replace(self, valid=jnp.asarray(verdict if self.valid is None else self.valid & verdict))

    def with_kernels(self) -> Self:
        """The experiment with its kernels built, unless they are given or the way of its march needs none."""
        if self.kernels is not None or self.options.correspondence != "exact":
            return self
        if self.film_map is not None:
            thickness = self.film_map.values
            return replace(self, kernels=compiled_varying(self.body, self.indenter, self.grid, thickness))
        return replace(self, kernels=compiled_build(self.body, self.indenter, self.grid))

    @property
    def ready_kernels(self) -> Kernels:
        """Those given or built."""
        assert isinstance(self.kernels, Kernels)
        return self.kernels

    @property
    def varying_kernels(self) -> VaryingKernels:
        """The kernels of a film whose thickness varies in the plane."""
        assert isinstance(self.kernels, VaryingKernels)
        return self.kernels

    @property
    def profile(self) -> Array:
        """The gap before contact at an approach of zero [m], (nx, ny), over the film as it is at first."""
        return profile_over_film(self.indenter, self.grid, self.film_map)

    @property
    def load_controlled(self) -> bool:
        return isinstance(self.control, Load)

    @property
    def duration(self) -> Array:
        """Time from the first to the last step [s]."""
        return self.times[-1] - self.times[0]

    @property
    def edges(self) -> tuple[bool, bool]:
        """Return whether contact at the sides of the grid across x, and across y, would continue beyond the grid."""
        along_x, along_y = (not self.indenter.fills_grid and not wraps for wraps in self.grid.periodic)
        return along_x, along_y

    @property
    def temperatures(self) -> list[Any]:
        """The temperatures that the experiment is given [K]."""
        return []

    def target(self, scale: Scale) -> Array:
        """The control, scaled: the sum of pressures or the approach."""
        return scale.from_si("load" if self.load_controlled else "approach", self.control.value)


@pytree
class TimedExperiment(Experiment, abc.ABC):
    """The base of experiments over time."""

    @property
    def changes_in_given_ways(self) -> bool:
        """Return whether the body changes in time as it is given, an effect that the error of the time steps leaves out."""
        return self.film_map is not None and self.film_map.over_times

    @abc.abstractmethod
    def planned(self) -> Plan:
        """Return the march of the experiment."""

    def contact(self, scale: Scale) -> dict[str, Any]:
        """Return the fields of a stepper that the contact of every experiment has."""
        return {
            "profile": self.profile / scale.length,
            "tolerance": self.tolerance,
            "max_iterations": self.max_iterations,
            "load_controlled": self.load_controlled,
            "edges": self.edges,
        }

    def plan(self, stepper: Stepper, more: Any, scale: Scale, errors: Errors) -> Plan:
        """Return the march of a stepper, whose further input is ``more``, (nt, substeps, ...), to a ``ContactHistory``."""
        substeps = self.options.substeps
        targets = fine_values(jnp.broadcast_to(self.target(scale), self.times.shape), substeps)
        steps = Steps(fine_steps(self.times, substeps), targets, more)
        known = {"times": self.times}, {"grid": self.grid}
        return Plan(stepper, steps, scale, errors, *known, ContactHistory, ContactStep)


def _check_instantaneous_compliance(
    body: LayeredHalfSpace, indenter: Indenter, correspondence: str
) -> Verdict:
    """Require an elastic indenter for J(0) = 0, the quasi-elastic method for such a film, and the exact one with a bulk
    modulus."""
    bulky = any(solid.bulk_modulus is not None for solid in solids(body))
    checks.require(
        correspondence == "exact" or not bulky,
        f'correspondence: expected "exact" with a bulk modulus, got "{correspondence}", whose error would reach 5 %',
    )
    limits = limits_of(body)
    rigid = limits.has_zero_instantaneous_compliance()
    alone, film = indenter.material is None, limits.film is not None and correspondence == "exact"
    if not is_concrete(rigid):
        return ~(jnp.asarray(rigid) & (alone or film))
    checks.require(
        not (bool(rigid) and alone),
        "a Kelvin-Voigt surface has J(0) = 0 and is rigid at first: a rigid indenter cannot be pressed on it, not even by a"
        " load that rises from zero; expected an elastic indenter or a material with an instantaneous compliance",
    )
    checks.require(
        not (bool(rigid) and film),
        "layer: a material with J(0) = 0 has no bound on its decay rates over a substrate; expected one with an"
        ' instantaneous compliance (StandardLinearSolid, say), or correspondence="quasi-elastic"',
    )
    return True


def profile_over_film(indenter: Indenter, grid: Grid, film_map: ThicknessMap | None) -> Array:
    """Return the gap before contact at an approach of zero [m], (nx, ny), over a film that stands on a flat base.

    The approach is zero at first touch of the film as it is at first: the lowest point of the gap is as low as that of the
    indenter alone.
    """
    profile = indenter.profile(grid)
    if film_map is None:
        return profile
    over = profile - film_map.at_first
    return over - (jnp.min(over) - jnp.min(profile))


def _check_approach_range(
    control: Control, indenter: Indenter, grid: Grid, film_map: ThicknessMap | None
) -> Verdict:
    """Require an approach that is less than the mean gap on a periodic grid, where the mean displacement is zero."""
    if isinstance(control, Load) or not all(grid.periodic) or (film_map is not None and film_map.over_times):
        return True
    highest = jnp.mean(profile_over_film(indenter, grid, film_map))
    inside = jnp.max(jnp.asarray(control.value)) < highest
    if not is_concrete(control, highest):
        return inside
    checks.require(
        bool(inside),
        f"Approach [m]: expected less than {float(highest):g} on a periodic grid, the mean gap at first touch, got"
        f" {float(np.max(control.value)):g}: the mean displacement is zero, so that all of the surface would be in contact",
    )
    return True
