"""Indenters: their undeformed profile over the grid, and what they are made of.

A profile is the gap [m] to the flat body when the indenter just touches it, (nx, ny), zero at the first
touch. ``material=None`` is rigid; an indenter's own material is elastic and acts as a half-space.
"""

import abc
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact import _checks
from jaxcontact._pytree import pytree
from jaxcontact.controls import Control, Load
from jaxcontact.grid import Grid
from jaxcontact.layers import LayeredHalfSpace, check_material, long_wave_compliance
from jaxcontact.materials import Elastic

OUT_OF_REACH = 1e3  # gap beside a punch, in grid widths: no contact there


class Indenter(abc.ABC):
    """What presses on the body."""

    material: Elastic | None

    @abc.abstractmethod
    def profile(self, grid: Grid) -> Array:
        """Gap at first touch [m], (nx, ny)."""

    @abc.abstractmethod
    def check(self, grid: Grid) -> None:
        """ValueError for values or shapes that cannot be."""

    @abc.abstractmethod
    def estimated_radius(self, body: LayeredHalfSpace, control: Control, times: np.ndarray) -> float:
        """About the largest contact radius [m] over the history, for choosing a grid."""

    def compliance(self) -> Array:
        """(1 - nu)/G of the indenter [1/Pa], zero when rigid."""
        if self.material is None:
            return jnp.zeros(())
        return (1.0 - self.material.nu) / jnp.asarray(self.material.G, dtype=float)


@pytree
class Sphere(Indenter):
    """A ball, as a paraboloid: profile (x^2 + y^2)/(2 R).  radius: R [m]."""

    radius: Array | float
    material: Elastic | None = None

    def profile(self, grid: Grid) -> Array:
        x, y = grid.coordinates()
        return (x**2 + y**2) / (2.0 * self.radius)

    def check(self, grid: Grid) -> None:
        _check_elastic(self.material)
        _checks.positive("sphere radius [m]", self.radius)

    def estimated_radius(self, body: LayeredHalfSpace, control: Control, times: np.ndarray) -> float:
        """(a_s^4 + a_f^4)^(1/4) of the ball on the substrate (Hertz) and on the film alone.

        The film alone is a half-space or a bed of springs, whichever gives the smaller contact.
        """
        R, value = float(self.radius), float(np.max(np.asarray(control.value)))
        if not isinstance(control, Load):
            return float(np.sqrt(2.0 * R * max(value, 0.0)))
        substrate = float(long_wave_compliance(body) + self.compliance())
        duration = float(times[-1] - times[0])
        if not body.layers:
            substrate = float((1.0 - body.substrate.nu) * body.substrate.creep(duration) + self.compliance())
        hertz = (3.0 * value * R * substrate / 8.0) ** (1.0 / 3.0)
        if not body.layers:
            return hertz
        film, nu = body.layers[0], float(body.layers[0].material.nu)
        J = float(film.material.creep(duration))
        thick = (3.0 * value * R * ((1.0 - nu) * J + float(self.compliance())) / 8.0) ** (1.0 / 3.0)
        springs = J * float(film.thickness) * (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))
        thin = (4.0 * R * springs * value / np.pi) ** 0.25
        return max(float((hertz**4 + min(thin, thick) ** 4) ** 0.25), thick if thick < hertz else 0.0)


@pytree
class Cylinder(Indenter):
    """A punch whose end is a cylinder along y: profile x^2/(2 R) over |y| <= length/2, no contact beyond.

    radius: R [m]; length [m], which cuts between cells: a derivative with respect to it is zero.
    """

    radius: Array | float
    length: Array | float
    material: Elastic | None = None

    def profile(self, grid: Grid) -> Array:
        x, y = grid.coordinates()
        return jnp.where(jnp.abs(y) <= self.length / 2.0, x**2 / (2.0 * self.radius), _far(grid))

    def check(self, grid: Grid) -> None:
        _check_elastic(self.material)
        _checks.positive("cylinder radius [m]", self.radius)
        _checks.positive("cylinder length [m]", self.length)

    def estimated_radius(self, body: LayeredHalfSpace, control: Control, times: np.ndarray) -> float:
        """Half the length, or the half-width of the line contact on the softer of film and substrate."""
        value = float(np.max(np.asarray(control.value)))
        J = float(body.surface_material().creep(float(times[-1] - times[0])))
        width = np.sqrt(2.0 * float(self.radius) * max(value, 0.0))
        if isinstance(control, Load):
            A = (1.0 - float(body.surface_material().nu)) * J + float(self.compliance())
            width = np.sqrt(2.0 * value / float(self.length) * float(self.radius) * A / np.pi)
        return max(float(width), float(self.length) / 2.0)


@pytree
class FlatPunch(Indenter):
    """A flat-ended circular punch: profile 0 within ``radius`` [m], no contact beyond.

    The radius cuts between cells: a derivative with respect to it is zero.
    """

    radius: Array | float
    material: Elastic | None = None

    def profile(self, grid: Grid) -> Array:
        x, y = grid.coordinates()
        return jnp.where(x**2 + y**2 <= jnp.asarray(self.radius) ** 2, 0.0, _far(grid))

    def check(self, grid: Grid) -> None:
        _check_elastic(self.material)
        _checks.positive("punch radius [m]", self.radius)

    def estimated_radius(self, body: LayeredHalfSpace, control: Control, times: np.ndarray) -> float:
        """The punch's own radius."""
        return float(self.radius)


@pytree
class HeightField(Indenter):
    """Measured or made heights (nx, ny) [m] on the grid; larger heights touch first."""

    heights: Array
    material: Elastic | None = None

    def profile(self, grid: Grid) -> Array:
        heights = jnp.asarray(self.heights, dtype=float)
        return jnp.max(heights) - heights

    def check(self, grid: Grid) -> None:
        _check_elastic(self.material)
        shape = np.shape(self.heights)
        _checks.require(
            shape == tuple(grid.shape), f"heights: expected shape {tuple(grid.shape)}, got {shape}"
        )

    def estimated_radius(self, body: LayeredHalfSpace, control: Control, times: np.ndarray) -> float:
        raise ValueError(
            "Grid.around: a HeightField comes with its own grid; expected Grid(shape=heights.shape, spacing=(dx, dy))"
        )


def _far(grid: Grid) -> Any:
    return OUT_OF_REACH * grid.width[0]


def _check_elastic(material: Elastic | None) -> None:
    if material is not None:
        _checks.require(
            isinstance(material, Elastic),
            f"indenter material: expected Elastic or None, got {type(material).__name__}",
        )
        check_material("indenter", material)
