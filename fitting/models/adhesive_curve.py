"""Load over approach of an adhesive ball on an elastic half-space: Johnson, Kendall and Roberts, and Maugis.

With E* = 2/((1 - nu)/G + C_ball), K = 4 E*/3 and the work of adhesion w, in units of (pi w R^2/K)^(1/3) for radii, pi w R
for loads and (pi^2 w^2 R/K^2)^(1/3) for approaches (D. Maugis, J. Colloid Interface Sci. 150 (1992) 243):

    lambda a^2/2 [q + (q^2 - 1) t] + 4 lambda^2 a/3 [q t - m + 1] = 1,   q = sqrt(m^2 - 1),   t = arctan q,
    P = a^3 - lambda a^2 [q + m^2 t],   approach = a^2 - 4/3 lambda a q,   lambda = 2 s0 (R/(pi w K^2))^(1/3),

for contact up to the radius a and Dugdale's attraction s0 up to the radius m a. In the limit of short range (JKR) P = a^3 -
a sqrt(6 a) and approach = a^2 - 2/3 sqrt(6 a).

Under a given approach the stable branch has the larger radius. It ends where the approach is least; below, the curve goes on
with that radius, dP/d(approach) = 2 E* a, so that a fit can pass through parameters whose branch ends too early.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

RADII = 500  # points of the branch between which it is interpolated, of relative error 1e-5
COARSE = 400  # radii among which the end of the branch is sought
LEAST = 1e-3  # smallest radius of contact
BISECTIONS = 60
SMALLEST, LARGEST = 1e-9, 1e9  # of q


class JKR(NamedTuple):
    """An elastic half-space of shear modulus G [Pa] and a work of adhesion [J/m2] of short range."""

    G: float
    work: float


class MaugisDugdale(NamedTuple):
    """An elastic half-space of shear modulus G [Pa], a work of adhesion [J/m2] and the strength [Pa] of Dugdale's law."""

    G: float
    work: float
    strength: float


def load_at(approach: Array, modulus: Array, work: Array, radius: float, strength: Array | None) -> Array:
    """Return the load [N] (n,) of a contact at approaches (n,) [m]; modulus: E* [Pa]; strength: None for JKR."""
    K = 4.0 * modulus / 3.0
    depth = jnp.cbrt(jnp.pi**2 * work**2 * radius / K**2)
    parameter = None if strength is None else 2.0 * strength * jnp.cbrt(radius / (jnp.pi * work * K**2))
    return jnp.pi * work * radius * scaled_load(approach / depth, parameter)


def scaled_load(approach: Array, parameter: Array | None) -> Array:
    """Return the load (n,) at approaches (n,), in the units of the module; parameter: lambda, None for JKR."""
    largest = jnp.sqrt(jnp.maximum(jnp.max(approach), 0.0) + 2.0) + 2.0
    end = jax.lax.stop_gradient(_end(parameter))
    radii = end + (jax.lax.stop_gradient(largest) - end) * jnp.linspace(0.0, 1.0, RADII)
    loads, approaches = _contact(radii, parameter)
    beyond = approach - approaches[0]
    # the approach is quadratic in the radius at the end of the branch
    way = lambda d: jnp.sqrt(jnp.maximum(d, 1e-12))
    inside = jnp.interp(way(beyond), way(approaches - approaches[0]), loads)
    return jnp.where(beyond > 0.0, inside, loads[0] + 1.5 * end * beyond)


def largest_tension(modulus: Array, work: Array, radius: float, strength: Array | None) -> Array:
    """Return the largest tension [N] of the stable branch under a given approach; arguments as of ``load_at``.

    The radius of contact at which the load is least is held constant in derivatives, which is exact, as the derivative of
    the load by the radius is zero there or the radius is that of the end of the branch.
    """
    K = 4.0 * modulus / 3.0
    parameter = None if strength is None else 2.0 * strength * jnp.cbrt(radius / (jnp.pi * work * K**2))
    end = jax.lax.stop_gradient(_end(parameter))
    radii = end * jnp.geomspace(1.0, 4.0 / end, RADII)
    for _ in range(2):  # a grid of radii, and one between the neighbours of its best
        k = jnp.argmin(jax.lax.stop_gradient(_contact(radii, parameter)[0]))
        radii = jnp.linspace(radii[jnp.maximum(k - 1, 0)], radii[jnp.minimum(k + 1, RADII - 1)], RADII)
    return -jnp.pi * work * radius * jnp.min(_contact(jax.lax.stop_gradient(radii), parameter)[0])


def _end(parameter: Array | None) -> Array:
    """Return the radius at which the stable branch ends."""
    if parameter is None:
        return jnp.asarray(6.0 ** (-1.0 / 3.0))
    radii = jnp.geomspace(LEAST, 2.0, COARSE)
    return radii[jnp.argmin(_contact(radii, parameter)[1])]


def _contact(a: Array, parameter: Array | None) -> tuple[Array, Array]:
    """Return load and approach (k,) of contacts of radius a (k,)."""
    if parameter is None:
        return a**3 - a * jnp.sqrt(6.0 * a), a**2 - 2.0 / 3.0 * jnp.sqrt(6.0 * a)
    q = _outer(a, parameter)
    load = a**3 - parameter * a**2 * (q + (1.0 + q**2) * jnp.arctan(q))
    return load, a**2 - 4.0 / 3.0 * parameter * a * q


def _outer(a: Array, parameter: Array) -> Array:
    """Return q (k,) by bisection of its logarithm, with a last step of Newton's method that carries the derivatives."""

    def missed(q: Array, a: Array, parameter: Array) -> Array:
        t = jnp.arctan(q)
        far = parameter * a**2 / 2.0 * (q + (q**2 - 1.0) * t)
        # m - 1 without cancellation
        return far + 4.0 * parameter**2 * a / 3.0 * (q * t - q**2 / (1.0 + jnp.sqrt(1.0 + q**2))) - 1.0

    def halved(_: int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        low, high = ends
        middle = 0.5 * (low + high)
        small = missed(jnp.exp(middle), *held) < 0.0
        return jnp.where(small, middle, low), jnp.where(small, high, middle)

    held = jax.lax.stop_gradient((a, parameter))
    ends = jnp.full_like(a, jnp.log(SMALLEST)), jnp.full_like(a, jnp.log(LARGEST))
    q = jnp.exp(jax.lax.fori_loop(0, BISECTIONS, halved, ends)[0])
    slope = jax.vmap(jax.grad(missed), (0, 0, None))(q, *held)
    return q - missed(q, a, parameter) / slope
