"""Steady flash temperature of a half-space, or of a film on a base, under a moving heat flux (``operators.heat``)."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict, require
from jaxcontact._support.pytree import as_float64, pytree
from jaxcontact.bodies.grid import Grid, check_grid
from jaxcontact.contact.implicit import linear_solution
from jaxcontact.history.motion import check_shape_of_velocity
from jaxcontact.operators.heat import (
    HIGHEST,
    Covered,
    Solid,
    apply_coefficients,
    components,
    rise_coefficients,
)


@pytree
class ThermalFilm:
    """A heat-conducting film, in perfect thermal contact with the body below it.

    Args:
        thickness: [m] > 0.
        conductivity: thermal conductivity [W/(m K)] > 0.
        diffusivity: thermal diffusivity [m2/s] > 0.

    Example:
        >>> film = jc.ThermalFilm(thickness=2e-6, conductivity=1.0, diffusivity=5e-7)
    """

    thickness: Array | float
    conductivity: Array | float
    diffusivity: Array | float

    def check(self) -> Verdict:
        """Return whether the values are in range; raises ValueError for values that are not traced and are out of range."""
        valid = checks.positive("ThermalFilm thickness [m]", self.thickness)
        valid = valid & checks.positive("ThermalFilm conductivity [W/(m K)]", self.conductivity)
        return valid & checks.positive("ThermalFilm diffusivity [m2/s]", self.diffusivity)


def flash_temperature(
    heat_flux: Array,
    grid: Grid,
    *,
    velocity: Any,
    conductivity: Any,
    diffusivity: Any,
    film: ThermalFilm | None = None,
) -> Array:
    """Compute the steady rise of surface temperature under a heat flux that moves over a half-space, or a film on one.

        T(k) = q(k)/(conductivity sqrt(|k|^2 - i k . v/diffusivity))

    is its Fourier transform on a half-space, for a flux of any form. The rise is computed for a non-periodic half-space by
    the superposition of uniform fluxes on the cells (``operators.heat``). The flux moves with ``velocity`` over the body;
    behind it the body is hotter. At zero velocity the result is the steady state under a constant flux. In a contact with
    friction, the flux is the fraction of friction coefficient x pressure x |velocity| that enters the body. The result is
    differentiable with respect to flux, velocity, conductivities, diffusivities and thickness.

    With ``film`` the rise is that of the film's surface, in perfect thermal contact with the base (``operators.heat``). Its
    error was below 0.1 % of the largest rise under a moving square source on films of a half to eight cells, conducting a
    tenth to ten times as well as the base.

    Args:
        heat_flux: [W/m2], (nx, ny) on the grid.
        grid: a ``Grid`` that is not periodic, or one in plane strain (one cell along a periodic y), which represents a
            band of infinite length along y.
        velocity: velocity of the flux over the body [m/s]: a number along x, or (2,); with ``film`` along x. In plane strain
            it must not be zero, since the temperature under a stationary band grows without limit.
        conductivity: thermal conductivity of the body [W/(m K)] > 0.
        diffusivity: thermal diffusivity of the body [m2/s] > 0.
        film: None, or ``ThermalFilm`` on the body, whose conductivity and diffusivity are then those of the base.

    Returns:
        Temperature rise [K], (nx, ny), at the cell centres.

    Raises:
        ValueError: shapes or values out of range, a velocity across x with ``film``, or a Peclet number |velocity|
            d/(2 diffusivity) of a cell above 500, for which the grid has to be finer; d is the side along the motion, or
            for an oblique one (|velocity_x| dx + |velocity_y| dy)/|velocity|.

    Example:
        >>> grid = jc.Grid.square(n=32, width=3.2e-3)
        >>> x, y = grid.coordinates()
        >>> disc = np.where(x**2 + y**2 < 1e-6, 1e6, 0.0)           # 1 MW/m2 on a radius of 1 mm
        >>> rise = jc.flash_temperature(disc, grid, velocity=0.0, conductivity=50.0, diffusivity=1.4e-5)
        >>> f"{rise.max():.1f} K"                                    # Carslaw and Jaeger: q a/k = 20 K at the centre
        '20.0 K'
    """
    valid = check_heat(heat_flux, grid, velocity, conductivity, diffusivity, film)
    solids = Solid(conductivity, diffusivity), None if film is None else covered(film)
    flux, spacing, velocity, solids = as_float64(
        (heat_flux, grid.spacing, jnp.asarray(velocity, float), solids)
    )
    rises = rise_coefficients(
        tuple(grid.shape), spacing, velocity, *solids, periodic_y=bool(grid.periodic[1])
    )
    rise = apply_coefficients(rises, flux)
    return jnp.where(jnp.asarray(valid), rise, jnp.nan)


def covered(film: ThermalFilm) -> Covered:
    """Return the film in the form that ``operators.heat`` takes."""
    return Covered(film.thickness, Solid(film.conductivity, film.diffusivity))


def check_heat(
    heat_flux: Any, grid: Grid, velocity: Any, conductivity: Any, diffusivity: Any, film: Any
) -> Verdict:
    """Raise ``ValueError`` for what has no steady temperature; return whether traced values are in range."""
    valid = check_grid(grid)
    require(
        not any(grid.periodic) or (grid.plane_strain and not grid.periodic[0]),
        "grid: expected one that is not periodic, or one in plane strain, in flash_temperature, got"
        f" periodic={grid.periodic} with {tuple(grid.shape)} cells: the mean rise of a periodic flux has no limit",
    )
    shape = np.shape(heat_flux)
    require(
        shape == tuple(grid.shape),
        f"heat_flux [W/m2]: expected the grid's shape {tuple(grid.shape)}, got {shape}",
    )
    check_shape_of_velocity(velocity)
    valid = valid & checks.finite("heat_flux [W/m2]", heat_flux) & checks.finite("velocity [m/s]", velocity)
    valid = valid & checks.positive("conductivity [W/(m K)]", conductivity)
    valid = valid & checks.positive("diffusivity [m2/s]", diffusivity)
    if film is None:
        return valid & check_peclet(grid, velocity, diffusivity)
    require(isinstance(film, ThermalFilm), f"film: expected ThermalFilm or None, got {type(film).__name__}")
    across = abs(components(jnp.asarray(velocity, float))[1])
    valid = valid & checks.between("velocity across x [m/s] with film", across, -1.0, 0.0)
    valid = valid & film.check() & check_peclet(grid, velocity, film.diffusivity)
    return valid & check_peclet(grid, velocity, diffusivity)


def check_peclet(grid: Grid, velocity: Any, diffusivity: Any) -> Verdict:
    """Check that the quadrature resolves the passage of a cell and, in plane strain, that the flux moves along x."""
    along_x, along_y = components(jnp.asarray(velocity, float))
    dx, dy = grid.spacing
    if grid.plane_strain:
        moving = checks.positive("|velocity| along x [m/s] in plane strain", abs(along_x))
        passage = abs(along_x) * dx
    else:
        # |v| times the side along the motion; in any other direction the sides weighted by the components of the velocity
        moving, passage = True, abs(along_x) * dx + abs(along_y) * dy
    name = "Peclet number |velocity| d/(2 diffusivity) of a cell (a finer grid lowers it)"
    return moving & checks.between(name, passage / (2.0 * diffusivity), -1.0, HIGHEST)


# Partition of the heat of friction between two bodies in contact, so that both surfaces have one temperature.


TOLERANCE, RESTART, RESTARTS = 1e-10, 40, 25  # of GMRES


@pytree
class ThermalBody:
    """A heat-conducting half-space, and the velocity of the contact over it.

    Args:
        conductivity: thermal conductivity [W/(m K)] > 0.
        diffusivity: thermal diffusivity [m2/s] > 0.
        velocity: of the contact over this body [m/s]: a number along x, or (2,).
        ambient: temperature far from the contact, of both bodies on one scale [K].
        film: None, or a ``ThermalFilm`` on the body.

    Example:
        >>> disc = jc.ThermalBody(conductivity=46.0, diffusivity=1.2e-5, velocity=0.5)
    """

    conductivity: Array | float
    diffusivity: Array | float
    velocity: Any = 0.0
    ambient: Array | float = 0.0
    film: ThermalFilm | None = None

    def check(self, heat_flux: Any, grid: Grid) -> Verdict:
        """Return whether the values are in range for a flux on a grid; raises ValueError as ``flash_temperature`` does."""
        valid = check_heat(heat_flux, grid, self.velocity, self.conductivity, self.diffusivity, self.film)
        return valid & checks.finite("ThermalBody ambient [K]", self.ambient)


def heat_partition(
    heat_flux: Array, grid: Grid, first: ThermalBody, second: ThermalBody
) -> tuple[Array, Array]:
    """Return the heat flux into the first of two bodies, and the temperature of their common surface.

    The flux q is divided at each cell in contact, q > 0, so that the surfaces have one temperature there:

        T1 + K1 q1 = T2 + K2 (q - q1),      q1 = 0 where q = 0,

    with the rise K of ``flash_temperature`` of each body, and their ambient temperatures T. Without contact no heat passes.
    The flux into a body may be negative where the other is hotter. Source: J. C. Jaeger, Proc. R. Soc. NSW 76 (1942) 203;
    H. Blok, Wear 6 (1963) 483, with one temperature at each point in place of one at the hottest point alone.

    Args:
        heat_flux: heat of friction [W/m2] >= 0, (nx, ny) on the grid: friction coefficient x pressure x speed of slip.
        grid: as in ``flash_temperature``.
        first, second: ``ThermalBody``.

    Returns:
        Flux into the first body [W/m2], (nx, ny), and temperature of its surface [K], (nx, ny), which in contact is that of
        the second; nan throughout if the equations were not solved to 1e-8.

    Raises:
        ValueError: as in ``flash_temperature``, or a negative flux.

    Example:
        >>> grid = jc.Grid.square(n=16, width=1.6e-3)
        >>> x, y = grid.coordinates()
        >>> disc = np.where(x**2 + y**2 < 0.25e-6, 1e6, 0.0)
        >>> steel, glass = jc.ThermalBody(46.0, 1.2e-5), jc.ThermalBody(1.0, 5e-7)
        >>> into_steel, _ = jc.heat_partition(disc, grid, steel, glass)
        >>> f"{into_steel.max() / 1e6:.3f}"                        # at rest conductivities decide: 46/47
        '0.979'
    """
    for name, body in (("first", first), ("second", second)):
        require(isinstance(body, ThermalBody), f"{name}: expected a ThermalBody, got {type(body).__name__}")
    valid = first.check(heat_flux, grid) & second.check(heat_flux, grid)
    valid = valid & checks.non_negative("heat_flux [W/m2]", heat_flux)
    flux, spacing, bodies = as_float64((heat_flux, grid.spacing, (first, second)))
    found = _divided(flux, spacing, *bodies, periodic_y=bool(grid.periodic[1]))
    return tuple(jnp.where(jnp.asarray(valid), field, jnp.nan) for field in found)  # type: ignore[return-value]


@partial(jax.jit, static_argnames="periodic_y")
def _divided(
    flux: Array, spacing: Any, first: ThermalBody, second: ThermalBody, *, periodic_y: bool
) -> tuple[Array, Array]:
    """Solve for the flux into the first body at the cells with a flux, scaled by the rise of a cell."""
    shape, touching = flux.shape, flux > 0.0
    of_first, of_second = (
        rise_coefficients(
            shape,
            spacing,
            jnp.asarray(body.velocity),
            Solid(body.conductivity, body.diffusivity),
            None if body.film is None else covered(body.film),
            periodic_y=periodic_y,
        )
        for body in (first, second)
    )
    middle = tuple((n - 1) // 2 for n in of_first.shape)
    both = (of_first + of_second) / (of_first + of_second)[middle]
    unit = (of_first + of_second)[middle]
    apply = lambda q: jnp.where(touching, apply_coefficients(both, jnp.where(touching, q, 0.0)), q)
    excess = (apply_coefficients(of_second, flux) + second.ambient - first.ambient) / unit
    right = jnp.where(touching, excess, 0.0)
    own = linear_solution(apply, right, _solve)
    off = jnp.linalg.norm(apply(own) - right) > 1e-8 * jnp.linalg.norm(right)
    own = jnp.where(off, jnp.nan, own)
    return own, first.ambient + apply_coefficients(of_first, own)


def _solve(operator: Any, right: Array) -> Array:
    """Solve a linear equation by GMRES, to a tolerance relative to its own right-hand side.

    The derivative rule of ``jax.scipy.sparse.linalg.gmres`` takes the tolerance of the original equation for that of the
    adjoint one, which may be far larger than the solution.
    """
    return jax.scipy.sparse.linalg.gmres(
        operator,
        right,
        tol=TOLERANCE,
        atol=0.0,
        restart=RESTART,
        maxiter=RESTARTS,
        solve_method="incremental",
    )[0]
