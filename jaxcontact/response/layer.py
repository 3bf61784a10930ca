"""A single layer as a two-port between its two surfaces, for each wavenumber.

With the layer's top loaded by tractions t and its bottom displaced by u_b, the top is displaced by u and the layer
exerts on its foundation the tractions t_b,

    alpha u = A j t + B alpha u_b,      t_b = B^T t - C alpha u_b / j,        j = 1/G,

in which

    A  compliance of the layer on a rigid base,
    B  share of the bottom's displacement that reaches the top (and of the top's traction, the bottom),
    C  stiffness that the layer with a free top adds to its foundation

depend on x = alpha h and nu alone. In the plane of the wavevector each is 2 x 2 over (in-plane, normal),
with u_r = i u and t_r = i t for the in-plane pair, which makes all entries real: for theta = exp(-2 x),
kappa = 3 - 4 nu, D = kappa (1 + theta^2) + (kappa^2 + 1 + 4 x^2) theta, E = 1 - theta,

    4 D A / (kappa + 1) = [[kappa (1 - theta^2) + 4 x theta,   .  ], [  .  , (kappa - 1)(1 - theta^2) + f3]]
    4 D A_12            = kappa (kappa - 1) E^2 - 8 x^2 theta
    D C                 = [[(kappa + 1)(1 - theta^2 + 4 x theta), (kappa - 1) E^2 + 8 x^2 theta],
                           [                  .                 , (kappa + 1) f3               ]]
    D det C             = 4 f4
    2 D e^x B / (kappa + 1) = [[(kappa + 1)(1 + theta) - 2 x E, (kappa - 1) E + 2 x (1 + theta)],
                               [(kappa - 1) E - 2 x (1 + theta), (kappa + 1)(1 + theta) + 2 x E]]

with f3 = 1 - theta^2 - 4 x theta and f4 = E^2 - 4 x^2 theta (``differences``). In the transverse direction A = C = tanh x
and B = 1/cosh x. Nothing overflows, and no diagonal entry suffers from cancellation at any thickness. Source: the matrix
exponential of the equations of equilibrium of one layer, rearranged; derived here.
"""

import math
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

SERIES_BELOW = 0.7
SINH = [1.0 / math.factorial(2 * n + 3) for n in range(9)]


class TwoPort(NamedTuple):
    """A and C as (11, 12, 22) and B as (11, 12, 21, 22), dimensionless; tanh and sech: the transverse A = C and B."""

    A: tuple[Array, Array, Array]
    B: tuple[Array, Array, Array, Array]
    C: tuple[Array, Array, Array]
    det_C: Array
    tanh: Array
    sech: Array


def two_port(x: Array, nu: Array | float) -> TwoPort:
    """Return A, B and C of a layer of x = alpha h >= 0, with entries of the shape of x; nu real or complex."""
    kappa = 3.0 - 4.0 * nu
    theta = jnp.exp(-2.0 * x)
    E, E2, both = -jnp.expm1(-2.0 * x), -jnp.expm1(-4.0 * x), 1.0 + theta
    f3, f4 = differences(x)
    xt, xxt = 4.0 * x * theta, 8.0 * x**2 * theta
    D = kappa * (1.0 + theta**2) + (kappa**2 + 1.0) * theta + 0.5 * xxt
    C = (kappa + 1.0) / D
    B, kE, kE2 = 0.5 * jnp.exp(-x) * C, (kappa - 1.0) * E, (kappa - 1.0) * E**2
    xE, xboth = 2.0 * x * E, 2.0 * x * both
    return TwoPort(
        A=(
            0.25 * C * (kappa * E2 + xt),
            0.25 * (kappa * kE2 - xxt) / D,
            0.25 * C * ((kappa - 1.0) * E2 + f3),
        ),
        B=(
            B * ((kappa + 1.0) * both - xE),
            B * (kE + xboth),
            B * (kE - xboth),
            B * ((kappa + 1.0) * both + xE),
        ),
        C=(C * (E2 + xt), (kE2 + xxt) / D, C * f3),
        det_C=4.0 * f4 / D,
        tanh=E / both,
        sech=2.0 * jnp.exp(-x) / both,
    )


def uniaxial(nu: Array | float) -> Array | float:
    """Return a layer's compliance in uniaxial strain over J h: (1 - 2 nu)/(2 (1 - nu))."""
    return (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))


def differences(x: Array) -> tuple[Array, Array]:
    """Return f3 = 1 - theta^2 - 4 x theta and f4 = (1 - theta)^2 - 4 x^2 theta, to round-off at all x."""
    small = x < SERIES_BELOW
    low, high = jnp.where(small, x, 0.0), jnp.where(small, SERIES_BELOW, x)
    theta = jnp.exp(-2.0 * low)
    f3 = 2.0 * theta * _sinh_excess(2.0 * low)
    f4 = 4.0 * theta * _sinh_excess(low) * (jnp.sinh(low) + low)
    theta = jnp.exp(-2.0 * high)
    g3 = -jnp.expm1(-4.0 * high) - 4.0 * high * theta
    g4 = jnp.expm1(-2.0 * high) ** 2 - 4.0 * high**2 * theta
    return jnp.where(small, f3, g3), jnp.where(small, f4, g4)


def _sinh_excess(y: Array) -> Array:
    """Return sinh(y) - y for 0 <= y < 1.4, by its series."""
    squared, series = y**2, jnp.full_like(y, SINH[-1])
    for coefficient in SINH[-2::-1]:
        series = series * squared + coefficient
    return y * squared * series
