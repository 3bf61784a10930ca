"""Load over approach of an adhesive ball on an elastic film on an elastic base, for an attraction of short range.

The Abel transform g of the pressure of a contact of radius a is linear in the approach and in 1/R (``layered_contact.py``).
With adhesion it does not vanish at the edge: there g = -sqrt(pi A a w), with the work of adhesion w and A = (1 - nu)/G of
the film plus that of the ball, since g(a)^2 is the energy release rate of the edge as a crack, and an edge sees the surface
alone. On a half-space this is the theory of K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. Lond. A 324 (1971) 301.
With f, F of the right side 1 and b, B of tau^2 (values at the edge and integrals),

    approach = (b a^2/R - sqrt(pi A a w))/f,      load = 4 a/A (F approach - B a^2/R).

The logarithms of f, b, F and B are Chebyshev series in log(1 + s a/h), with s of the size of 1 + G/G_base.
"""

import functools
import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.models.layered_contact import Base, paraboloid_terms
from fitting.models.thin_layer import clenshaw

RADII = 500  # of contact, between which the branch is interpolated
LEAST = 1e-3  # smallest radius over the largest
NODES, DEGREE = 40, 30  # radii that are solved, and degree of the series
SPACING = 0.125  # of log G, between which the series are cubic
STEP = 1e-30  # of log G, imaginary


class FilmOnBase(NamedTuple):
    """An elastic film: thickness [m]; modulus G [Pa] and Poisson's ratio of the base."""

    thickness: float
    base: float
    base_nu: float


class Extent(NamedTuple):
    """Range of the series: the largest a/h, and s."""

    widest: float
    stretch: float


class FilmSeries(NamedTuple):
    """Series of the four terms (4, m) and their derivatives with respect to log G."""

    values: np.ndarray
    slopes: np.ndarray


def series_of(log_G: float, nu: float, own: float, film: FilmOnBase, extent: Extent) -> FilmSeries:
    """Return the series for the logarithm of the film's shear modulus [Pa]; own: (1 - nu)/G [1/Pa] of the ball.

    They are cubic in log G between multiples of ``SPACING``, with values and derivatives there.
    """
    k, t = divmod(log_G / SPACING, 1.0)
    (y0, m0), (y1, m1) = (_solved(int(k) + i, nu, own, film, extent) for i in (0, 1))
    rise, m0, m1 = y1 - y0, SPACING * m0, SPACING * m1
    bend, twist = 3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise
    values = y0 + t * (m0 + t * (bend + t * twist))
    return FilmSeries(values, (m0 + t * (2.0 * bend + 3.0 * t * twist)) / SPACING)


@functools.lru_cache(maxsize=512)
def _solved(k: int, nu: float, own: float, film: FilmOnBase, extent: Extent) -> FilmSeries:
    """Return the series for log G = k ``SPACING``."""
    G, moved = math.exp(k * SPACING), 1.0 + 1j * STEP
    base = Base(G / film.base * moved, film.base_nu, own * G / (1.0 - nu) * moved)
    x = np.append(-1.0, -np.cos(np.pi * np.arange(1, NODES + 1) / NODES))
    ratios = np.expm1(0.5 * (x + 1.0) * math.log1p(extent.stretch * extent.widest)) / extent.stretch
    terms = np.array([paraboloid_terms(ratio, nu, base) for ratio in ratios[1:]])
    logs = np.log(np.concatenate([np.array([[1.0, 1.0, 1.0, 1.0 / 3.0]]), terms]))
    fit = lambda y: np.polynomial.chebyshev.chebfit(x, y, DEGREE).T
    return FilmSeries(fit(logs.real), fit(logs.imag / STEP))


def load_at(
    approach: Array,
    change: Array,
    series: FilmSeries,
    body: tuple[Array, Array, Array],
    size: tuple[Array, Extent],
) -> Array:
    """Return the load [N] (n,) at approaches (n,) [m].

    change: of log G from that of the series; body: A [1/Pa], the work of adhesion [J/m2] and the ball's radius [m]; size:
    thickness [m] and range of the series.
    """
    values = jnp.asarray(series.values) + change * jnp.asarray(series.slopes)
    largest = size[0] * size[1].widest
    of = functools.partial(_contact, values, body, size)
    coarse = largest * jnp.geomspace(LEAST, 1.0, RADII)
    end = jax.lax.stop_gradient(coarse[jnp.argmin(of(coarse)[1])])
    radii = end + (largest - end) * jnp.linspace(0.0, 1.0, RADII) ** 2
    loads, approaches = of(radii)
    beyond = approach - approaches[0]
    scale = jax.lax.stop_gradient(jnp.max(jnp.abs(approaches)))
    # the approach is quadratic in the radius at the end of the branch
    way = lambda d: jnp.sqrt(jnp.maximum(d / scale, 1e-12))
    inside = jnp.interp(way(beyond), way(approaches - approaches[0]), loads)
    stiffness = jax.lax.stop_gradient((loads[1] - loads[0]) / (approaches[1] - approaches[0]))
    return jnp.where(beyond > 0.0, inside, loads[0] + jnp.abs(stiffness) * beyond)


def largest_tension(
    change: Array, series: FilmSeries, body: tuple[Array, Array, Array], size: tuple[Array, Extent]
) -> Array:
    """Return the largest tension [N] of the stable branch under a given approach; arguments as of ``load_at``.

    The radius of contact at which the load is least is held constant in derivatives.
    """
    values = jnp.asarray(series.values) + change * jnp.asarray(series.slopes)
    largest = size[0] * size[1].widest
    of = functools.partial(_contact, values, body, size)
    coarse = largest * jnp.geomspace(LEAST, 1.0, RADII)
    loads, approaches = jax.lax.stop_gradient(of(coarse))
    first = jnp.argmin(approaches)  # below this radius contacts are not stable
    k = jnp.argmin(jnp.where(jnp.arange(RADII) >= first, loads, jnp.inf))
    near = coarse[jnp.maximum(k - 1, first)], coarse[jnp.minimum(k + 1, RADII - 1)]
    return -jnp.min(of(jax.lax.stop_gradient(jnp.linspace(*near, RADII)))[0])


def _contact(
    values: Array, body: tuple[Array, Array, Array], size: tuple[Array, Extent], a: Array
) -> tuple[Array, Array]:
    """Return load and approach (k,) of contacts of radius a (k,)."""
    (A, work, radius), (thickness, (widest, stretch)) = body, size
    x = 2.0 * jnp.log1p(stretch * a / thickness) / jnp.log1p(stretch * widest) - 1.0
    flat, ball, force, curved = (jnp.exp(clenshaw(row, x)) for row in values)
    approach = (ball * a**2 / radius - jnp.sqrt(jnp.pi * A * a * work)) / flat
    return 4.0 * a / A * (force * approach - curved * a**2 / radius), approach
