"""Steady flash temperature of a half-space under a moving heat flux.

A flux q(x, y) [W/m2] enters the surface of a half-space and moves over it with the velocity v; no other heat crosses
the surface. In the frame of the flux, where it has become steady, the temperature rise of the surface is

    T(x) = sqrt(kappa)/(k sqrt(pi)) int_0^inf [1/(2 pi kappa s^2)] int q(x') exp(-|x - x' + v s^2|^2/(4 kappa s^2)) dx' ds,

with the conductivity k, the diffusivity kappa, and s the square root of the time since the heat entered: the sum over
instantaneous sources (H. S. Carslaw, J. C. Jaeger, Conduction of Heat in Solids, 1959, sec. 10.4 and 10.7). A flux that
is uniform over a rectangular cell leaves a product of differences of error functions,

    T = q 2 sqrt(kappa)/(k sqrt(pi)) int_0^inf X(s) Y(s) ds,
    X(s) = (1/2) {erf[(x + v_x s^2 + dx/2)/(2 sqrt(kappa) s)] - erf[(x + v_x s^2 - dx/2)/(2 sqrt(kappa) s)]},

and Y(s) likewise, so that the coefficients of all offsets are one product of matrices over the nodes of a quadrature.
At v = 0 they are the steady kernel 1/(2 pi k r) integrated over the cell.

Quadrature. In s the edges of X and Y are smooth over sqrt(kappa)/|v| where the cell passes by, and over their own
distance from zero where the heat spreads. The trapezoidal rule in

    u = s |v|/(PASSING sqrt(kappa)) + asinh(s/s_0)/SPREADING,      s_0 = the shorter side of a cell/(4 sqrt(kappa)),

resolves both; the integrand is even in u, and the rule converges exponentially. The number of nodes is fixed by the
shape of the grid. It covers cells with a Peclet number |v| d/(2 kappa), d the longer side, of up to ``HIGHEST``.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import erf

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict, require
from jaxcontact._support.pytree import as_float64
from jaxcontact.inputs.grid import Grid, check_grid

PASSING, SPREADING = 0.7, 0.2  # steps of the quadrature, relative to the two lengths that it resolves
HIGHEST = 500.0  # Peclet number of a cell
FARTHEST = (
    1e10  # upper limit of s/s_0; the remainder of the integral is below this share of a cell's own rise
)
PASSED = 7.0  # standard deviations of a source's spread after which it contributes nothing
NEWTON = 60  # iterations that invert u(s); it starts from above on a convex function and cannot fail


def flash_temperature(
    heat_flux: Array, grid: Grid, *, velocity: Any, conductivity: Any, diffusivity: Any
) -> Array:
    """Compute the steady rise of surface temperature under a heat flux that moves over a half-space.

        T(k) = q(k)/(conductivity sqrt(|k|^2 - i k . v/diffusivity))

    is its Fourier transform for a flux of any form. The rise is computed for a non-periodic half-space by the
    superposition of uniform fluxes on the cells (``verbs.flash_temperature``). The flux moves with ``velocity`` over the
    body; behind it the body is hotter. At zero velocity the result is the steady state under a constant flux. In a
    contact with friction, the flux is the fraction of friction coefficient x pressure x |velocity| that enters the body.
    The result is differentiable with respect to flux, velocity, conductivity and diffusivity.

    Args:
        heat_flux: [W/m2], (nx, ny) on the grid.
        grid: a ``Grid`` that is not periodic, or one in plane strain (one cell along a periodic y), which represents a
            band of infinite length along y.
        velocity: velocity of the flux over the body [m/s]: a number along x, or (2,). In plane strain it must not be zero,
            since the temperature under a stationary band grows without limit.
        conductivity: thermal conductivity of the body [W/(m K)] > 0.
        diffusivity: thermal diffusivity of the body [m2/s] > 0.

    Returns:
        Temperature rise [K], (nx, ny), at the cell centres.

    Raises:
        ValueError: shapes or values out of range, or a Peclet number |velocity| d/(2 diffusivity) of a cell of the
            longer side d above 500, for which the grid has to be finer.

    Example:
        >>> grid = jc.Grid.square(n=32, width=3.2e-3)
        >>> x, y = grid.coordinates()
        >>> disc = np.where(x**2 + y**2 < 1e-6, 1e6, 0.0)           # 1 MW/m2 on a radius of 1 mm
        >>> rise = jc.flash_temperature(disc, grid, velocity=0.0, conductivity=50.0, diffusivity=1.4e-5)
        >>> f"{rise.max():.1f} K"                                    # Carslaw and Jaeger: q a/k = 20 K at the centre
        '20.0 K'
    """
    valid = _check(heat_flux, grid, velocity, conductivity, diffusivity)
    velocity = jnp.asarray(velocity, float)
    given = as_float64((heat_flux, grid.spacing, velocity, conductivity, diffusivity))
    rise = _rise(*given, periodic_y=bool(grid.periodic[1]))
    return jnp.where(jnp.asarray(valid), rise, jnp.nan)


def coefficients_at_rest(grid: Grid) -> Array:
    """Return the steady rise per uniform flux on one cell times the conductivity [m], at offsets (i, j) >= 0, (nx, ny).

    That of a flux at rest on a grid that is not periodic.
    """
    nx, ny = grid.shape
    flux = jnp.zeros((2 * nx - 1, 2 * ny - 1)).at[nx - 1, ny - 1].set(1.0)
    given = as_float64((flux, grid.spacing, np.zeros(()), 1.0, 1.0))
    return _rise(*given, periodic_y=False)[nx - 1 :, ny - 1 :]


def _check(heat_flux: Any, grid: Grid, velocity: Any, conductivity: Any, diffusivity: Any) -> Verdict:
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
    return valid & _check_peclet(grid, velocity, diffusivity)


def _check_peclet(grid: Grid, velocity: Any, diffusivity: Any) -> Verdict:
    """Check that the quadrature resolves the passage of a cell and, in plane strain, that the flux moves along x."""
    along_x, along_y = _components(jnp.asarray(velocity, float))
    dx, dy = grid.spacing
    if grid.plane_strain:
        moving = checks.positive("|velocity| along x [m/s] in plane strain", abs(along_x))
        longest, speed = dx, abs(along_x)
    else:
        moving, longest, speed = True, jnp.maximum(dx, dy), jnp.hypot(along_x, along_y)
    name = "Peclet number |velocity| d/(2 diffusivity) of a cell (a finer grid lowers it)"
    return moving & checks.between(name, speed * longest / (2.0 * diffusivity), -1.0, HIGHEST)


def _components(velocity: Array) -> tuple[Any, Any]:
    """Return the components of a velocity along x and y."""
    return (velocity, jnp.zeros_like(velocity)) if jnp.ndim(velocity) == 0 else (velocity[0], velocity[1])


@partial(jax.jit, static_argnames="periodic_y")
def _rise(
    heat_flux: Array,
    spacing: Any,
    velocity: Array,
    conductivity: Array,
    diffusivity: Array,
    *,
    periodic_y: bool,
) -> Array:
    """Convolve the flux with the rise per unit flux on one cell, zero-padded against wrap-around."""
    nx, ny = heat_flux.shape
    speeds = _components(velocity)
    s, ds = _nodes(heat_flux.shape, spacing, speeds, diffusivity, periodic_y)
    along_x = _passage(nx, spacing[0], speeds[0], diffusivity, s)
    along_y = jnp.ones((1, s.size)) if periodic_y else _passage(ny, spacing[1], speeds[1], diffusivity, s)
    coefficients = (along_x * ds) @ along_y.T
    padded = (2 * nx - 1 + nx, 2 * ny - 1 + ny)
    spectrum = jnp.fft.rfft2(coefficients, padded) * jnp.fft.rfft2(heat_flux, padded)
    field = jnp.fft.irfft2(spectrum, padded)[nx - 1 : 2 * nx - 1, ny - 1 : 2 * ny - 1]
    return field * 2.0 * jnp.sqrt(diffusivity / jnp.pi) / conductivity


def _passage(n: int, d: Array, speed: Array, diffusivity: Array, s: Array) -> Array:
    """Return X(s) of the module at the offsets -(n - 1) d, ..., (n - 1) d, (2 n - 1, nodes)."""
    edges = (jnp.arange(2 * n) - n + 0.5)[:, None] * d
    spread = 2.0 * jnp.sqrt(diffusivity) * s
    at_start = s == 0.0  # where an instantaneous source has not spread yet
    argument = (edges + speed * s**2) / jnp.where(at_start, 1.0, spread)
    return 0.5 * jnp.diff(erf(jnp.where(at_start, jnp.sign(edges) * jnp.inf, argument)), axis=0)


def _nodes(
    shape: tuple[int, int], spacing: Any, speeds: Any, diffusivity: Array, periodic_y: bool
) -> tuple[Array, Array]:
    """Return the nodes s (m,) [s^(1/2)] of the trapezoidal rule in u and their weights ds (m,).

    They carry no derivative: the rule is exact to rounding for any nodes as dense.
    """
    (dx, dy), (along_x, along_y), diffusivity = jax.lax.stop_gradient((spacing, speeds, diffusivity))
    if periodic_y:  # neither a length nor a velocity along y matters
        dy, along_y = dx, 0.0
    root, speed = jnp.sqrt(diffusivity), jnp.hypot(along_x, along_y)
    start = jnp.minimum(dx, dy) / (4.0 * root)
    moving, safe = speed > 0.0, jnp.where(speed > 0.0, speed, 1.0)
    width = jnp.hypot(shape[0] * dx, shape[1] * dy)
    last = jnp.where(moving, jnp.sqrt(width / safe) + 2.0 * PASSED * root / safe, jnp.inf)
    last = jnp.minimum(last, FARTHEST * start)
    rate = start * speed / (PASSING * root)  # u = rate sinh(w) + w/SPREADING with s = start sinh(w)
    count = _count(shape)
    u_of = lambda w: rate * jnp.sinh(w) + w / SPREADING
    u = jnp.linspace(0.0, 1.0, count) * u_of(jnp.arcsinh(last / start))
    w = jnp.minimum(u * SPREADING, jnp.arcsinh(u / jnp.where(rate > 0.0, rate, 1e-300)))
    slope = lambda w: rate * jnp.cosh(w) + 1.0 / SPREADING
    w = jax.lax.fori_loop(0, NEWTON, lambda _, w: w - (u_of(w) - u) / slope(w), w)
    ds = start * jnp.cosh(w) / slope(w) * (u[1] - u[0])
    return start * jnp.sinh(w), ds.at[0].multiply(0.5)


def _count(shape: tuple[int, int]) -> int:
    """Return the number of nodes at which the step in u is at most one for every speed in range."""
    passing = np.sqrt(2.0 * HIGHEST * np.hypot(*shape)) + 2.0 * PASSED
    return int(np.ceil(passing / PASSING + np.arcsinh(FARTHEST) / SPREADING)) + 1
