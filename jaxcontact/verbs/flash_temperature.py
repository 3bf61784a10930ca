"""Steady flash temperature of a half-space, or of a film on a base, under a moving heat flux (``operators.heat``)."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict, require
from jaxcontact._support.pytree import as_float64, pytree
from jaxcontact.inputs.grid import Grid, check_grid
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
    require(
        np.shape(velocity) in ((), (2,)),
        f"velocity [m/s]: expected a number or shape (2,), got {np.shape(velocity)}",
    )
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
