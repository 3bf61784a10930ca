"""Partition of the heat of friction between two bodies in contact, so that both surfaces have one temperature."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict, require
from jaxcontact._support.pytree import as_float64, pytree
from jaxcontact.contact.implicit import linear_solution
from jaxcontact.inputs.grid import Grid
from jaxcontact.operators.heat import Solid, apply_coefficients, rise_coefficients
from jaxcontact.verbs.flash_temperature import ThermalFilm, check_heat, covered

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
