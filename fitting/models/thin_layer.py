"""Elastic indentation of a layer bonded to a rigid base, by a ball, a cone or a flat punch.

The force on an indenter at a given depth is that on a half-space (``data/probe.py``) times a factor f(chi, nu), with

    chi = sqrt(R depth)/h  (ball of radius R),     depth tan(half-angle)/h  (cone),     R/h  (flat punch)

for a layer of thickness h. The factor is that of ``layered_contact.py``, solved for a set of a/h and of nu; log f is
represented by Chebyshev polynomials in log(1 + chi) and nu. Since
the base is rigid and nu is constant, the modulus is a common factor, so that the same function of the depth gives the
creep of a viscoelastic layer by the integral of Lee and Radok.

Error of f below 1e-6 for chi up to ``LARGEST`` and 0 <= nu <= 0.5.
"""

import functools
import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.models.layered_contact import RIGID, Base, contact_factors

LARGEST = 10.0  # largest chi of the table
WIDEST = 20.0  # largest a/h
RADII, DEGREE = 64, 34  # number of radii that are solved, and degree in log(1 + chi)
BEYOND = 1.15  # end of the samples, where the table ends at 1
STEP = 1e-30  # of nu, imaginary
KINDS = ("ball", "cone", "punch")


def kind_of(indenter: Any) -> str:
    """Return "ball", "cone" or "punch"; ValueError for another indenter."""
    for cls, kind in zip((jc.Sphere, jc.Cone, jc.FlatPunch), KINDS, strict=True):
        if isinstance(indenter, cls):
            return kind
    raise ValueError(f"indenter: expected a Sphere, a Cone or a FlatPunch, got {type(indenter).__name__}")


class ThinLayer(NamedTuple):
    """The factor f of one indenter on a layer as a function of the depth.

    series (m,): coefficients of the table; chi = scale depth^power [depth in m].
    """

    series: Array
    scale: Array | float
    power: Array | float

    @classmethod
    def of(cls, indenter: Any, thickness: Any, nu: Any, base: Base = RIGID) -> "ThinLayer":
        """Return the factor for an indenter, a thickness [m] and Poisson's ratio; nu may be differentiated but not
        traced by jit, because its table is computed outside."""
        kind = kind_of(indenter)
        at = _known(nu)
        value, slope = (jnp.asarray(row) for row in table(at, base)[kind])
        series = value + slope * (nu - at)
        if kind == "ball":
            return cls(series, jnp.sqrt(indenter.radius) / thickness, 0.5)
        if kind == "cone":
            return cls(series, jnp.tan(indenter.half_angle) / thickness, 1.0)
        return cls(series, indenter.radius / thickness, 0.0)

    def chi(self, depth: Any) -> Array:
        """Return chi at depths >= 0 [m] of any shape."""
        depth = jnp.asarray(depth, dtype=float)
        positive = depth > 0.0
        return jnp.where(positive, self.scale * jnp.where(positive, depth, 1.0) ** self.power, 0.0)

    def log_factor(self, depth: Any) -> Array:
        """Return log f at depths >= 0 [m] of any shape, that of ``LARGEST`` where chi is larger."""
        chi = jnp.minimum(self.chi(depth), LARGEST)
        return clenshaw(self.series, 2.0 * jnp.log1p(chi) / math.log1p(LARGEST) - 1.0)

    def factor(self, depth: Any) -> Array:
        """Return f at depths >= 0 [m] of any shape; nan where chi exceeds ``LARGEST``."""
        return jnp.where(self.chi(depth) <= LARGEST, jnp.exp(self.log_factor(depth)), jnp.nan)

    def scaled(self, depth: float) -> "ThinLayer":
        """Return the factor over depths in units of ``depth``, divided by its value there."""
        own = self._replace(scale=self.scale * depth**self.power)
        return own._replace(series=own.series.at[0].add(-own.log_factor(1.0)))


def thin_layer_factor(indenter: Any, depth: Any, thickness: Any, nu: Any) -> Array:
    """Return the force on an indenter at a given depth in a bonded layer, over that on a half-space of the material.

    The layer is bonded to a rigid base, and is elastic and linear; the exact axisymmetric solution is tabulated
    (``fitting/models/thin_layer.py``) with an error below 1e-6. It is differentiable with respect to every argument.

    Args:
        indenter: a ``jc.Sphere``, ``jc.Cone`` or ``jc.FlatPunch``; its material is taken as rigid.
        depth: [m] >= 0, of any shape.
        thickness: of the layer [m].
        nu: Poisson's ratio, 0 to 0.5.

    Returns:
        The factor, of the shape of ``depth``; nan where sqrt(R depth)/thickness of a ball, depth tan(half-angle)/
        thickness of a cone or R/thickness of a punch exceeds 10.

    Raises:
        ValueError: another indenter, a thickness that is not positive, or nu outside 0 to 0.5.

    Example:
        >>> ball = jc.Sphere(radius=10e-6)
        >>> print(f"{fitting.thin_layer_factor(ball, 1e-6, thickness=5e-6, nu=0.5):.4f}")
        2.7448
    """
    if not isinstance(thickness, jax.core.Tracer):
        check(float(thickness), _known(nu))
    return ThinLayer.of(indenter, thickness, nu).factor(depth)


def _known(nu: Any) -> float:
    """Return the value of Poisson's ratio, which may carry a derivative; ValueError where jit hides it."""
    if not isinstance(nu, jax.core.Tracer):
        return float(nu)
    try:
        return float(jax.lax.stop_gradient(nu))
    except jax.errors.ConcretizationTypeError:
        raise ValueError("nu: expected a number that is known outside jit, got a traced one") from None


def check(thickness: float, nu: float) -> None:
    """Raise ValueError unless the layer has a positive thickness and Poisson's ratio is between 0 and 0.5."""
    if not 0.0 < thickness < math.inf:
        raise ValueError(f"thickness: expected > 0 m, got {thickness!r}")
    if not 0.0 <= nu <= 0.5:
        raise ValueError(f"nu: expected 0 to 0.5 for a thin layer, got {nu!r}")


@functools.lru_cache(maxsize=64)
def table(nu: float, base: Base = RIGID, by_base: bool = False) -> dict[str, np.ndarray]:
    """Return {kind: (2, DEGREE + 1)}: the Chebyshev coefficients of log f in 2 log(1 + chi)/log(1 + LARGEST) - 1, and
    their derivative with respect to nu, or to the logarithm of the modulus of the layer over that of the base. It is a
    complex step. They are computed once for each nu and base."""
    radii = np.expm1(np.log1p(WIDEST) * 0.5 * (1.0 - np.cos(np.pi * np.arange(1, RADII + 1) / RADII)))
    varied = base._replace(ratio=base.ratio * (1.0 + 1j * STEP))
    moved = (nu, varied) if by_base else (nu + 1j * STEP, base)
    solved = [contact_factors(radius, *moved) for radius in radii]
    return {kind: _series(*np.array([one[kind] for one in solved]).T) for kind in KINDS}


def _series(chi: np.ndarray, factor: np.ndarray) -> np.ndarray:
    """Return the coefficients (2, DEGREE + 1) from samples (n,) with a complex step; f is 1 at chi = 0."""
    chi, log = np.append(0.0, chi), np.append(0.0, np.log(factor))
    place = 2.0 * np.log1p(chi) / math.log1p(LARGEST) - 1.0
    inside = place.real <= BEYOND
    fit = lambda x, y: np.polynomial.Chebyshev.fit(x[inside], y[inside], DEGREE, domain=[-1.0, 1.0])
    value = fit(place.real, log.real)
    # the derivative at constant chi, whose samples move with nu as well
    change = (log.imag - value.deriv()(place.real) * place.imag) / STEP
    return np.stack([value.coef, fit(place.real, change).coef])


def clenshaw(series: Array, x: Array) -> Array:
    """Return the sum of a Chebyshev series (m,) at x of any shape."""

    def step(carry: tuple[Array, Array], c: Array) -> tuple[tuple[Array, Array], None]:
        one, two = carry
        return (c + 2.0 * x * one - two, one), None

    zero = jnp.zeros_like(x)
    (one, two), _ = jax.lax.scan(step, (zero, zero), jnp.flip(series[1:]))
    return series[0] + x * one - two
