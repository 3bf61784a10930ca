"""Indenters: their undeformed profile over the grid, and their material.

A profile is the gap [m] to the undeformed body when the indenter just touches it, (nx, ny), with minimum zero.
``material=None`` means rigid; else the indenter's material acts as a half-space, or its layers as those on a half-space
(a coated ball).
"""

import abc
import math
from typing import Any, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import Base, is_concrete, pytree, replace
from jaxcontact._support.reductions import lowest_point
from jaxcontact.bodies.body import LayeredHalfSpace, at_its_thickest, checked_body
from jaxcontact.bodies.controls import Control
from jaxcontact.bodies.grid import Grid
from jaxcontact.bodies.materials import Elastic, Material, check_material
from jaxcontact.indenters.predicted_contact import Outline, predicted
from jaxcontact.reference import hertz
from jaxcontact.response.stack import (
    is_fluid,
    long_wave_compliance,
    relaxed_compliance,
    short_wave_compliance,
    surface_creep,
)

ROLLER_END_FACTOR = 1.3  # approximate ratio of the half-width at the sharp ends of a roller to that elsewhere
OUT_OF_REACH = 1e3  # gap beside a punch, in grid widths, so that there is no contact there


class Indenter(Base, abc.ABC):
    """Base class of indenters.

    material: None for a rigid indenter, also where a subclass has no such field.
    fills_grid: whether the indenter ends at the grid's edge, so that contact there is contact at its own edge.
    """

    material: Material | LayeredHalfSpace | None = None
    fills_grid = False

    @abc.abstractmethod
    def profile(self, grid: Grid) -> Array:
        """Return the gap at first touch [m], (nx, ny)."""

    def check(self, grid: Grid) -> Verdict:
        """Return whether the dimensions are in range; raise ValueError for concrete values or shapes that are not."""
        return True

    def outline(self) -> Outline:
        """Return the properties that an estimate of the contact requires; concrete values only."""
        raise ValueError(
            f"Grid.around: expected an indenter with an outline, got {type(self).__name__} without one: define"
            " outline(), or choose the grid with Grid.square"
        )

    def half_widths(self, body: LayeredHalfSpace, control: Control, times: np.ndarray) -> tuple[float, float]:
        """Estimate the largest half-widths of the contact along x and y [m] over the history, for choosing a grid."""
        surface, estimated = self.surface(), self
        if surface is not None:  # as an elastic indenter of the largest compliance that it comes to have
            checked, t = checked_body(surface)[0], float(times[-1] - times[0])
            largest = max(float(long_wave_compliance(checked, t)), float(short_wave_compliance(checked, t)))
            estimated = replace(self, material=Elastic(G=0.5 / largest, nu=0.5))
        radius = predicted(at_its_thickest(body), estimated.outline(), control, times).radius
        return radius, radius

    def estimated_radius(self, body: LayeredHalfSpace, control: Control, times: np.ndarray) -> float:
        """Estimate the largest contact radius over the history [m]; for a long contact, half its length."""
        return max(self.half_widths(body, control, times))

    def size_error(self, grid: Grid) -> Array:
        """Return the relative error of a size that is rounded to whole cells, in size, ()."""
        return jnp.zeros(())

    def surface(self) -> LayeredHalfSpace | None:
        """Return the layers and the substrate of an indenter that creeps or is coated.

        None for a rigid indenter, and for an elastic half-space, whose ``compliance`` adds to that of the body.
        """
        if self.material is None or isinstance(self.material, Elastic):
            return None
        return (
            self.material
            if isinstance(self.material, LayeredHalfSpace)
            else LayeredHalfSpace([], self.material)
        )

    def compliance(self) -> Array:
        """Return (1 - nu)/G of an elastic indenter [1/Pa], zero if rigid; ValueError for one that creeps or is coated."""
        if self.material is None:
            return jnp.zeros(())
        checks.require(
            isinstance(self.material, Elastic),
            f"indenter material: expected Elastic or None, got {type(self.material).__name__}: one that creeps or is"
            " coated has no compliance of a single number",
        )
        return surface_creep(self.material).creep(0.0)

    def compliance_of_short_waves(self, t: Array | float) -> Array:
        """Return the compliance [1/Pa] at a time t [s] in contacts much narrower than the indenter's top layer."""
        surface = self.surface()
        return self.compliance() if surface is None else short_wave_compliance(surface, t)

    def flows(self) -> Array | bool:
        """Return whether the indenter's surface creeps without limit under a load, () bool."""
        surface = self.surface()
        return False if surface is None else is_fluid(surface)

    def relaxed_compliance(self) -> Array:
        """Return the relaxed compliance without steady-state flow [1/Pa] in contacts much wider than the layers."""
        surface = self.surface()
        return self.compliance() if surface is None else relaxed_compliance(surface)


def checked_indenter(indenter: Indenter, grid: Grid) -> tuple[Indenter, Verdict]:
    """Return the indenter with its graded layers cut into uniform ones, and whether its values are in range.

    Raises ValueError for one that cannot be used on this grid.
    """
    checks.require(
        isinstance(indenter, Indenter),
        "indenter: expected a Sphere, another indenter, or a subclass of jaxcontact.abc.Indenter, got"
        f" {type(indenter).__name__}",
    )
    checks.require(
        isinstance(indenter, Cylinder | HeightField) or not grid.plane_strain,
        f"indenter: expected a Cylinder or a HeightField in plane strain, got {type(indenter).__name__}",
    )
    valid, material = indenter.check(grid), indenter.material
    if material is None:
        return indenter, valid
    if isinstance(material, LayeredHalfSpace):
        layers, good = checked_body(material)
        return replace(indenter, material=layers), valid & good
    checks.require(
        isinstance(material, Material),
        f"indenter material: expected a material, a LayeredHalfSpace or None, got {type(material).__name__}",
    )
    return indenter, valid & check_material("indenter", material)


@pytree
class Sphere(Indenter):
    """A ball, approximated by a paraboloid: profile (x^2 + y^2)/(2 R).

    Args:
        radius: R [m] > 0.
        material: None for a rigid indenter; an ``Elastic`` material, one that creeps, or a ``LayeredHalfSpace`` (a coated
            ball).

    Example:
        >>> ball = jc.Sphere(radius=5e-3, material=jc.Elastic.from_young(210e9, nu=0.3))
        >>> film = jc.Layer(jc.Elastic.from_young(3e9, nu=0.4), thickness=10e-6)
        >>> coated_ball = jc.Sphere(5e-3, jc.LayeredHalfSpace([film], substrate=ball.material))
    """

    radius: Array | float
    material: Material | LayeredHalfSpace | None = None

    def profile(self, grid: Grid) -> Array:
        x, y = grid.coordinates()
        return (x**2 + y**2) / (2.0 * self.radius)

    def check(self, grid: Grid) -> Verdict:
        return checks.positive("sphere radius [m]", self.radius)

    def outline(self) -> Outline:
        R = float(self.radius)

        def hertz(A: float, value: float, loaded: bool) -> float:
            return (3.0 * value * R * A / 8.0) ** (1.0 / 3.0) if loaded else math.sqrt(R * value)

        return Outline(lambda a: a**2 / (2.0 * R), hertz, float(self.compliance()))


@pytree
class Ellipsoid(Indenter):
    """A ball with a radius of curvature of its own along each axis, as a railway wheel: profile x^2/(2 Rx) + y^2/(2 Ry).

    On a half-space the contact is an ellipse (``reference.hertz.ellipse``), longer along the axis of the larger radius.

    Args:
        radii: (Rx, Ry) [m] > 0, of the sections in the planes xz and yz.
        material: None for a rigid indenter, else as of ``Sphere``.

    Example:
        >>> wheel = jc.Ellipsoid(radii=(0.46, 0.3), material=jc.Elastic.from_young(210e9, nu=0.3))
    """

    radii: tuple[Array | float, Array | float] | Array
    material: Material | LayeredHalfSpace | None = None

    def profile(self, grid: Grid) -> Array:
        x, y = grid.coordinates()
        return x**2 / (2.0 * self.radii[0]) + y**2 / (2.0 * self.radii[1])

    def check(self, grid: Grid) -> Verdict:
        shape = jnp.shape(jnp.asarray(self.radii, float))
        checks.require(shape == (2,), f"ellipsoid radii: expected (Rx, Ry), got shape {shape}")
        return checks.positive("ellipsoid radii [m]", jnp.asarray(self.radii, float))

    def outline(self) -> Outline:
        """Return that of a ball whose radius is the geometric mean of both."""
        return Sphere(math.sqrt(float(self.radii[0]) * float(self.radii[1])), self.material).outline()

    def half_widths(self, body: LayeredHalfSpace, control: Control, times: np.ndarray) -> tuple[float, float]:
        """Return the half-axes of an ellipse with the axes' ratio of Hertz's contact, as large as the ball's circle."""
        mean, _ = super().half_widths(body, control, times)
        ratio = hertz.axes_ratio((float(self.radii[0]), float(self.radii[1])))
        return mean * math.sqrt(ratio), mean / math.sqrt(ratio)


@pytree
class Cone(Indenter):
    """A cone: profile r/tan(half-angle), with its tip at the centre of the grid.

    On a half-space the pressure is logarithmically singular at the tip, so that its cell value grows with the logarithm
    of the inverse cell size (A. E. H. Love, Q. J. Math. 10 (1939) 161).

    Args:
        half_angle: angle between axis and side [rad], above 0 and below pi/2.
        material: None for a rigid indenter, else as of ``Sphere``.

    Example:
        >>> tip = jc.Cone(half_angle=np.radians(80.0))
    """

    half_angle: Array | float
    material: Material | LayeredHalfSpace | None = None

    @classmethod
    def berkovich(cls, material: Material | LayeredHalfSpace | None = None) -> Self:
        """Return the cone with the area function of a Berkovich pyramid, 24.494 h^2 at each depth h: 70.3 degrees.

        Source: W. C. Oliver, G. M. Pharr, J. Mater. Res. 7 (1992) 1564.
        """
        return cls(math.atan(math.sqrt(24.494 / math.pi)), material)

    def profile(self, grid: Grid) -> Array:
        x, y = grid.coordinates()
        squared = x**2 + y**2
        off_tip = jnp.where(squared > 0.0, squared, 1.0)
        return jnp.where(squared > 0.0, jnp.sqrt(off_tip), 0.0) / jnp.tan(self.half_angle)

    def check(self, grid: Grid) -> Verdict:
        name, hint = "cone half-angle [rad]", "below pi/2, in radians"
        return checks.positive(name, self.half_angle) & checks.at_most(name, self.half_angle, 1.57, hint)

    def outline(self) -> Outline:
        slope = math.tan(float(self.half_angle))

        def hertz(A: float, value: float, loaded: bool) -> float:
            return math.sqrt(value * A * slope / math.pi) if loaded else 2.0 * value * slope / math.pi

        return Outline(lambda a: a / slope, hertz, float(self.compliance()), pointed=True)


@pytree
class Cylinder(Indenter):
    """A cylinder along y with flat ends: profile x^2/(2 R) over |y| <= length/2, no contact beyond.

    Args:
        radius: R [m] > 0.
        length: length along y [m] > 0, rounded to whole cells, so that the derivative with respect to it is zero.
        material: None for a rigid indenter, else as of ``Sphere``.

    Example:
        >>> roller = jc.Cylinder(radius=10e-3, length=2e-3)
    """

    radius: Array | float
    length: Array | float
    material: Material | LayeredHalfSpace | None = None

    def profile(self, grid: Grid) -> Array:
        x, y = grid.coordinates()
        return jnp.where(jnp.abs(y) <= self.length / 2.0, x**2 / (2.0 * self.radius), _far(grid))

    def check(self, grid: Grid) -> Verdict:
        valid = checks.positive("cylinder radius [m]", self.radius)
        valid = valid & checks.positive("cylinder length [m]", self.length)
        if grid.plane_strain:
            valid = valid & _spans(self.length, grid.width[1])
        return valid & _covers_a_cell("cylinder length [m]", self.length, self.profile(grid), grid)

    def size_error(self, grid: Grid) -> Array:
        if grid.plane_strain:  # uniform along its length
            return jnp.zeros(())
        _, y = grid.axes()
        within = jnp.minimum(jnp.asarray(self.length, float), grid.width[1])
        cells = jnp.sum(jnp.abs(y) <= jnp.asarray(self.length) / 2.0)
        return jnp.abs(cells * grid.spacing[1] / within - 1.0)

    def outline(self) -> Outline:
        R, length = float(self.radius), float(self.length)

        def hertz(A: float, value: float, loaded: bool) -> float:
            return math.sqrt(2.0 * value / length * R * A / math.pi) if loaded else math.sqrt(R * value)

        return Outline(lambda a: a**2 / (2.0 * R), hertz, float(self.compliance()), length)

    def half_widths(self, body: LayeredHalfSpace, control: Control, times: np.ndarray) -> tuple[float, float]:
        """Return estimates of the half-width of the line contact, with a margin for its ends, and of half its length."""
        return ROLLER_END_FACTOR * super().half_widths(body, control, times)[0], float(self.length) / 2.0


@pytree
class FlatPunch(Indenter):
    """A flat-ended circular punch: profile 0 within the radius, no contact beyond.

    Args:
        radius: radius [m] > 0, rounded to whole cells, so that the derivative with respect to it is zero.
        material: None for a rigid indenter, else as of ``Sphere``.

    Example:
        >>> punch = jc.FlatPunch(radius=1e-3)
    """

    radius: Array | float
    material: Material | LayeredHalfSpace | None = None

    def profile(self, grid: Grid) -> Array:
        x, y = grid.coordinates()
        return jnp.where(x**2 + y**2 <= jnp.asarray(self.radius) ** 2, 0.0, _far(grid))

    def size_error(self, grid: Grid) -> Array:
        """Return the relative error of the radius of a circle that is as large as the cells under the punch, ()."""
        area = jnp.sum(self.profile(grid) == 0.0) * grid.cell_area
        return jnp.abs(jnp.sqrt(area / math.pi) / self.radius - 1.0)

    def check(self, grid: Grid) -> Verdict:
        valid = checks.positive("punch radius [m]", self.radius)
        return valid & _covers_a_cell("punch radius [m]", self.radius, self.profile(grid), grid)

    def half_widths(self, body: LayeredHalfSpace, control: Control, times: np.ndarray) -> tuple[float, float]:
        """Return the radius of the punch."""
        return float(self.radius), float(self.radius)

    def outline(self) -> Outline:
        raise NotImplementedError("the contact of a flat punch is known")


@pytree
class HeightField(Indenter):
    """An indenter with measured or generated heights; larger heights touch first.

    On a periodic grid the heights are periodic. On any other grid the indenter is a block of the size of the grid, and the
    surface of the body beside it is free. It may therefore be in contact at the edge of the grid, which gives status 2 for
    other indenters. Heights that are part of a larger surface need a periodic grid or a margin that is not in contact.

    Args:
        heights: (nx, ny) [m], finite, on the grid.
        material: None for a rigid indenter, else as of ``Sphere``.

    Example:
        >>> wavy = jc.HeightField(1e-8 * np.cos(np.arange(16.0))[:, None] * np.ones(16))
    """

    heights: Array
    material: Material | LayeredHalfSpace | None = None
    fills_grid = True

    def profile(self, grid: Grid) -> Array:
        heights = jnp.asarray(self.heights, dtype=float)
        return -lowest_point(-heights, jnp.max(jnp.abs(heights))) - heights

    def check(self, grid: Grid) -> Verdict:
        shape = np.shape(self.heights)
        checks.require(
            shape == tuple(grid.shape),
            f"heights: expected shape {tuple(grid.shape)} as the grid, got {shape}",
        )
        return checks.finite("heights [m]", self.heights)

    def outline(self) -> Outline:
        raise ValueError(
            "Grid.around: a HeightField defines its own grid; expected Grid(shape=heights.shape, spacing=(dx, dy))"
        )


def _far(grid: Grid) -> Any:
    return OUT_OF_REACH * grid.width[0]


def _spans(length: Any, width: Any) -> Verdict:
    """Check in plane strain that a roller is at least as long as the cell is wide, since it has no ends there."""
    spans = jnp.asarray(length) >= jnp.asarray(width) * (1.0 - 1e-9)
    if not is_concrete(spans):
        return spans
    checks.require(
        bool(spans),
        f"cylinder length [m]: expected at least the width {float(width):g} of plane strain, got {float(length):g}",
    )
    return True


def _covers_a_cell(name: str, value: Any, profile: Array, grid: Grid) -> Verdict:
    """Check that some cell's centre lies under the indenter; a smaller one would touch nothing."""
    touches = jnp.min(profile) < _far(grid)
    if not is_concrete(touches):
        return touches
    cell = max(float(d) for d in grid.spacing)
    checks.require(
        bool(touches),
        f"{name}: expected a size that covers a cell's centre (cells are {cell:g} m), got {float(value):g}",
    )
    return True
