"""Coefficients of the steady surface temperature under a moving heat flux: rise per uniform flux on one cell.

A flux q(x, y) [W/m2] enters the surface of a half-space and moves over it with the velocity v; no other heat crosses
the surface. In the frame of the flux, where it has become steady, the temperature rise at a depth z is

    T(x) = sqrt(kappa)/(k sqrt(pi)) int_0^inf [1/(2 pi kappa s^2)] exp(-z^2/(4 kappa s^2))
           int q(x') exp(-|x - x' + v s^2|^2/(4 kappa s^2)) dx' ds,

with the conductivity k, the diffusivity kappa, and s the square root of the time since the heat entered: the sum over
instantaneous sources (H. S. Carslaw, J. C. Jaeger, Conduction of Heat in Solids, 1959, sec. 10.4 and 10.7). A flux that
is uniform over a rectangular cell leaves a product of differences of error functions,

    T = q 2 sqrt(kappa)/(k sqrt(pi)) int_0^inf X(s) Y(s) exp(-z^2/(4 kappa s^2)) ds,
    X(s) = (1/2) {erf[(x + v_x s^2 + dx/2)/(2 sqrt(kappa) s)] - erf[(x + v_x s^2 - dx/2)/(2 sqrt(kappa) s)]},

and Y(s) likewise, so that the coefficients of all offsets are one product of matrices over the nodes of a quadrature.
At v = 0 they are the steady kernel 1/(2 pi k r) integrated over the cell.

Quadrature. In s the edges of X and Y are smooth over sqrt(kappa)/|v| where the cell passes by, and over their own
distance from zero where the heat spreads. The trapezoidal rule in

    u = s |v|/(PASSING sqrt(kappa)) + asinh(s/s_0)/SPREADING,

with s_0 the shorter side of a cell, or the depth where that is less, over 4 sqrt(kappa), resolves both; the integrand is
even in u, and the rule converges exponentially. The number of nodes is fixed by the shape of the grid. It covers cells
with a Peclet number (|v_x| dx + |v_y| dy)/(2 kappa), that of the side along the motion, of up to ``HIGHEST``.

Film. With the film's thickness h, conductivity k1 and diffusivity kappa1, those of its base k2 and kappa2, and
s_j = sqrt(|k|^2 - i k . v/kappa_j), the rise in wavenumbers is that of heat conduction across two layers,

    T/q = (1 + r exp(-2 s1 h))/(k1 s1 (1 - r exp(-2 s1 h))),      r = (k1 s1 - k2 s2)/(k1 s1 + k2 s2).

It is computed as the part that half-spaces of both materials give in closed form,

    1/(k1 s1) - exp(-s1 z)/(k1 s1) + exp(-s2 z)/(k2 s2),      z = h (1 + k1/k2),

and a remainder, which decays exponentially at wavelengths below h and, at rest, also vanishes at those far above. For a
flux that moves along x the remainder is even along y. It is transformed to the cells by Gauss's quadrature over
wavenumbers up to ``FINER`` times the largest that the grid resolves, again as products of matrices.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import erf

PASSING, SPREADING = 0.7, 0.2  # steps of the quadrature, relative to the two lengths that it resolves
HIGHEST = 500.0  # Peclet number of a cell
FARTHEST = 1e10  # upper limit of s/s_0 at the surface; the remainder is below this share of a cell's own rise
THINNEST = 1e-5  # smallest depth that the quadrature resolves, in cells
PASSED = 7.0  # standard deviations of a source's spread after which it contributes nothing
NEWTON = 60  # iterations that invert u(s); it starts from above on a convex function and cannot fail
FINER, HALVED, NODES = 4, 24, 6  # wavenumbers of the remainder of a film, see ``_wavenumbers``


class Solid(NamedTuple):
    """conductivity [W/(m K)] and diffusivity [m2/s] of a solid."""

    conductivity: Array
    diffusivity: Array


class Covered(NamedTuple):
    """A film: its thickness [m] and its solid."""

    thickness: Array
    solid: Solid


@partial(jax.jit, static_argnames=("shape", "periodic_y"))
def rise_coefficients(
    shape: tuple[int, int],
    spacing: Any,
    velocity: Array,
    base: Solid,
    film: Covered | None = None,
    *,
    periodic_y: bool = False,
) -> Array:
    """Return the rise per uniform flux on one cell [K m2/W] at the offsets -(n - 1) ... (n - 1) of cells, (2 nx - 1,
    2 ny - 1); periodic_y: in plane strain, (2 nx - 1, 1).
    """
    below = partial(_half_space, shape, spacing, components(velocity), periodic_y=periodic_y)
    if film is None:
        return below(base)
    depth = film.thickness * (1.0 + film.solid.conductivity / base.conductivity)
    known = below(film.solid) - below(film.solid, depth) + below(base, depth)
    return known + _remainder(shape, spacing, components(velocity)[0], base, film, periodic_y)


def components(velocity: Array) -> tuple[Any, Any]:
    """Return the components of a velocity along x and y."""
    return (velocity, jnp.zeros_like(velocity)) if jnp.ndim(velocity) == 0 else (velocity[0], velocity[1])


def _half_space(
    shape: tuple[int, int],
    spacing: Any,
    speeds: Any,
    solid: Solid,
    depth: Array | None = None,
    *,
    periodic_y: bool,
) -> Array:
    """Return the coefficients of a half-space at a depth [m], None for the surface."""
    nx, ny = shape
    diffusivity = solid.diffusivity
    s, ds = _nodes(shape, spacing, speeds, diffusivity, depth, periodic_y)
    if depth is not None:
        later = jnp.where(s > 0.0, s, 1.0)
        ds = ds * jnp.where(s > 0.0, jnp.exp(-(depth**2) / (4.0 * diffusivity * later**2)), 0.0)
    along_x = _passage(nx, spacing[0], speeds[0], diffusivity, s)
    along_y = jnp.ones((1, s.size)) if periodic_y else _passage(ny, spacing[1], speeds[1], diffusivity, s)
    return (along_x * ds) @ along_y.T * (2.0 * jnp.sqrt(diffusivity / jnp.pi) / solid.conductivity)


def _remainder(
    shape: tuple[int, int], spacing: Any, speed: Array, base: Solid, film: Covered, periodic_y: bool
) -> Array:
    """Return the coefficients of the module's remainder, which is even along y: the flux moves along x."""
    (k_x, w_x), (k_y, w_y) = (_wavenumbers(n, d) for n, d in zip(shape, spacing, strict=True))
    x, y = (jnp.arange(1 - n, n) * d for n, d in zip(shape, spacing, strict=True))
    along_y = w_y[:, None] * jnp.cos(k_y[:, None] * y)
    if periodic_y:
        k_y, along_y = jnp.zeros(1), jnp.ones((1, 1))

    # the module's remainder at wavenumbers above zero
    k1, k2 = film.solid.conductivity, base.conductivity
    root = lambda solid: jnp.sqrt(k_x[:, None] ** 2 + k_y**2 - 1j * k_x[:, None] * speed / solid.diffusivity)
    s1, s2 = root(film.solid), root(base)
    h, depth = film.thickness, film.thickness * (1.0 + k1 / k2)
    back = (k1 * s1 - k2 * s2) / (k1 * s1 + k2 * s2) * jnp.exp(-2.0 * s1 * h)
    whole = (1.0 + back) / (k1 * s1 * (1.0 - back))
    values = whole + jnp.expm1(-s1 * depth) / (k1 * s1) - jnp.exp(-s2 * depth) / (k2 * s2)
    return ((w_x * jnp.exp(1j * x[:, None] * k_x)) @ values).real @ along_y


def _wavenumbers(n: int, d: Array) -> tuple[Array, Array]:
    """Return positive wavenumbers (m,) up to ``FINER`` times the largest that n cells of size d resolve, and their weights
    in the integral over all wavenumbers of the transform of a uniform flux on one cell, over 2 pi.

    Panels of Gauss's quadrature: the waves e^(i k x) turn once in a panel at the largest offset x; the lowest panel is
    halved ``HALVED`` times, since the remainder of a moving source varies over all scales above zero.
    """
    ends = np.arange(1, FINER * n // 2 + 1) * 2.0 / n
    ends = np.concatenate([[0.0], ends[0] * 2.0 ** -np.arange(HALVED, 0, -1.0), ends]) * np.pi
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    half = np.diff(ends)[:, None] / 2.0
    k, w = (ends[:-1, None] + half * (1.0 + nodes)).ravel(), (half * weights).ravel()
    return jnp.asarray(k) / d, jnp.asarray(w * np.sinc(k / (2.0 * np.pi)) / np.pi)


def apply_coefficients(coefficients: Array, flux: Array) -> Array:
    """Return the rise under a flux (nx, ny): a convolution, zero-padded against wrap-around."""
    nx, ny = flux.shape
    padded = (2 * nx - 1 + nx, 2 * ny - 1 + ny)
    spectrum = jnp.fft.rfft2(coefficients, padded) * jnp.fft.rfft2(flux, padded)
    first_x, first_y = (coefficients.shape[0] - 1) // 2, (coefficients.shape[1] - 1) // 2
    return jnp.fft.irfft2(spectrum, padded)[first_x : first_x + nx, first_y : first_y + ny]


def coefficients_at_rest(shape: tuple[int, int], spacing: Any) -> Array:
    """Return the steady rise per uniform flux on one cell times the conductivity [m], at offsets (i, j) >= 0, (nx, ny).

    That of a flux at rest on a grid that is not periodic.
    """
    solid = Solid(jnp.ones(()), jnp.ones(()))
    spacing = tuple(jnp.asarray(d, float) for d in spacing)
    return rise_coefficients(shape, spacing, jnp.zeros(()), solid)[shape[0] - 1 :, shape[1] - 1 :]


def _passage(n: int, d: Array, speed: Array, diffusivity: Array, s: Array) -> Array:
    """Return X(s) of the module at the offsets -(n - 1) d, ..., (n - 1) d, (2 n - 1, nodes)."""
    edges = (jnp.arange(2 * n) - n + 0.5)[:, None] * d
    spread = 2.0 * jnp.sqrt(diffusivity) * s
    at_start = s == 0.0  # where an instantaneous source has not spread yet
    argument = (edges + speed * s**2) / jnp.where(at_start, 1.0, spread)
    return 0.5 * jnp.diff(erf(jnp.where(at_start, jnp.sign(edges) * jnp.inf, argument)), axis=0)


def _nodes(
    shape: tuple[int, int],
    spacing: Any,
    speeds: Any,
    diffusivity: Array,
    depth: Array | None,
    periodic_y: bool,
) -> tuple[Array, Array]:
    """Return the nodes s (m,) [s^(1/2)] of the trapezoidal rule in u and their weights ds (m,).

    They carry no derivative: the rule is exact to rounding for any nodes as dense.
    """
    given = spacing, speeds, diffusivity, depth
    (dx, dy), (along_x, along_y), diffusivity, depth = jax.lax.stop_gradient(given)
    if periodic_y:  # neither a length nor a velocity along y matters
        dy, along_y = dx, 0.0
    root, speed = jnp.sqrt(diffusivity), jnp.hypot(along_x, along_y)
    shortest = cell = jnp.minimum(dx, dy)
    if depth is not None:
        shortest = jnp.clip(depth, THINNEST * cell, cell)
    start, farthest = shortest / (4.0 * root), FARTHEST * cell / (4.0 * root)
    moving, safe = speed > 0.0, jnp.where(speed > 0.0, speed, 1.0)
    # |v| x the grid's width along the motion
    along = jnp.abs(along_x) * shape[0] * dx + jnp.abs(along_y) * shape[1] * dy
    last = jnp.where(moving, jnp.sqrt(along) / safe + 2.0 * PASSED * root / safe, jnp.inf)
    last = jnp.minimum(last, farthest)
    rate = start * speed / (PASSING * root)  # u = rate sinh(w) + w/SPREADING with s = start sinh(w)
    count = _count(shape, 1.0 if depth is None else THINNEST)
    u_of = lambda w: rate * jnp.sinh(w) + w / SPREADING
    u = jnp.linspace(0.0, 1.0, count) * u_of(jnp.arcsinh(last / start))
    w = jnp.minimum(u * SPREADING, jnp.arcsinh(u / jnp.where(rate > 0.0, rate, 1e-300)))
    slope = lambda w: rate * jnp.cosh(w) + 1.0 / SPREADING
    w = jax.lax.fori_loop(0, NEWTON, lambda _, w: w - (u_of(w) - u) / slope(w), w)
    ds = start * jnp.cosh(w) / slope(w) * (u[1] - u[0])
    return start * jnp.sinh(w), ds.at[0].multiply(0.5)


def _count(shape: tuple[int, int], thinnest: float) -> int:
    """Return the number of nodes at which the step in u is at most one for every speed and depth in range."""
    passing = np.sqrt(2.0 * HIGHEST * np.hypot(*shape)) + 2.0 * PASSED
    return int(np.ceil(passing / PASSING + np.arcsinh(FARTHEST / thinnest) / SPREADING)) + 1
