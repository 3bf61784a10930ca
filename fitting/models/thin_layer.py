"""Elastic indentation of a layer on a rigid base, bonded to it or loose, by a ball, a cone or a flat punch.

The force on an indenter at a given depth is that on a half-space (``data/indentation.py``) times a factor f(chi, nu), with

    chi = sqrt(R depth)/h  (ball of radius R),     depth tan(half-angle)/h  (cone),     R/h  (flat punch)

for a layer of thickness h. The factor is that of ``contact_factors``, solved for a set of a/h and of nu; log f is
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

# Elastic contact of a ball, a cone or a flat punch with a layer bonded to a rigid or elastic base.
#
# The contact of radius a follows from the normal compliance of the layered body at the wavenumber q (Y. Hannah, Q. J.
# Mech. Appl. Math. 4 (1951) 94; I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47; N. N. Lebedev, Ya. S. Ufliand, J. Appl.
# Math. Mech. 22 (1958) 442; E. R. M. O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235). With kappa = 3 - 4 nu, x = q
# h and the modulus m of the layer over that of the base, the compliance is (1 - nu)/G H(x)/q,
#
#     H = (1 + 4 k x e - l k e^2)/((1 - l e)(1 - k e) - 4 k x^2 e),     e = exp(-2 x),
#     k = (m - 1)/(m + kappa),     l = 1 - (1 + kappa)/(1 + m kappa_base);     m = 0 is a rigid base.
#
# A layer that slides on the base without friction and does not lift off has (``jaxcontact.response.stack``), with
# q = 1 - e^2 + 4 x e, f = (1 - e)^2 - 4 x^2 e and S = m (1 - nu_base)/(1 - nu),
#
#     H = (1 - e)^2/q + (4 e/q^2) (1 - e + x (1 + e))^2 S/(1 + S f/q).
#
# The Abel transform g of the pressure satisfies, at t = tau a,
#
#     g(tau) + (2/pi) int_0^inf (H(y h/a) - 1) cos(y tau) int_0^1 g(s) cos(y s) ds dy = depth - profile(tau),
#
# where the profile is t^2/R for the ball, (pi/2) t/tan(half-angle) for the cone and 0 for the punch. g(1) = 0
# determines the depth of a ball and of a cone, and the force is proportional to int_0^1 g. An elastic tip adds its
# compliance (1 - nu)/G to that of the layer at every wavenumber. The equation is solved by Nystrom's method on Gauss
# nodes.
#
# The stiffness dF/d depth of a ball or a cone is that of the punch of the same contact radius, since the pressure
# added by a further approach is that of a punch.


NODES = 16, 3, 56  # of the contact radius: at least, for each thickness of it, and at most
DECAY = 17.0  # wavenumber times thickness beyond which H is 1 to rounding
LEAST_PANELS = 14  # of wavenumbers
HALVINGS = 8  # of the first panel, for the long waves that an elastic base changes


class Base(NamedTuple):
    """The base of a layer and the tip on it.

    ratio: shear modulus of the layer over that of the base, 0 for a rigid one; nu: Poisson's ratio of the base; tip:
    compliance (1 - nu)/G of the tip over that of the layer; bonded: False for a layer that slides on it.
    """

    ratio: complex = 0.0
    nu: float = 0.3
    tip: complex = 0.0
    bonded: bool = True


RIGID = Base()


def compliance(x: np.ndarray, nu: complex, base: Base = RIGID) -> np.ndarray:
    """Return H(x) - 1 of the layer; x = wavenumber times thickness."""
    kappa, e, less = 3.0 - 4.0 * nu, np.exp(-2.0 * x), -np.expm1(-2.0 * x)
    if not base.bonded:
        q, soft = less * (1.0 + e) + 4.0 * x * e, base.ratio * (1.0 - base.nu) / (1.0 - nu)
        below = 4.0 * e * (less + x * (1.0 + e)) ** 2 / q**2 * soft
        f = np.where(x < 0.05, 4.0 / 3.0 * e * x**4 * (1.0 + 2.0 / 15.0 * x**2), less**2 - 4.0 * x**2 * e)
        return -2.0 * e * (less + 2.0 * x) / q + below / (1.0 + soft * f / q)
    one_less_k = (1.0 + kappa) / (base.ratio + kappa)
    one_less_l = (1.0 + kappa) / (1.0 + base.ratio * (3.0 - 4.0 * base.nu))
    k, l = 1.0 - one_less_k, 1.0 - one_less_l
    below = (less + one_less_l * e) * (less + one_less_k * e) - 4.0 * k * x**2 * e
    return e * (4.0 * k * x * (1.0 + x) + k + l - 2.0 * k * l * e) / below


def contact_factors(ratio: float, nu: complex, base: Base = RIGID) -> dict[str, tuple[complex, complex]]:
    """Return {kind: (chi, f)} for a contact radius over the thickness: chi of the module, and the force over that
    on a half-space of the layer, with the same tip, at the same depth."""
    (flat, ball, cone), force = _edges_and_forces(ratio, nu, base)
    d, e = ball / flat, cone / flat
    return {
        "ball": (ratio * d**0.5, 1.5 * (d * force[0] - force[1]) / d**1.5),
        "cone": (ratio * e, np.pi * (e * force[0] - force[2]) / e**2),
        "punch": (ratio, force[0]),
    }


def paraboloid_terms(ratio: float, nu: complex, base: Base = RIGID) -> np.ndarray:
    """Return g(1) and int_0^1 g for right sides 1 and tau^2, (4,), for a contact radius over the thickness; on a half-space
    1, 1, 1 and 1/3."""
    edges, force = _edges_and_forces(ratio, nu, base)
    return np.array([edges[0], edges[1], force[0], force[1]])


def _edges_and_forces(ratio: float, nu: complex, base: Base) -> tuple[np.ndarray, np.ndarray]:
    """Return g(1) and int_0^1 g for right sides 1, tau^2 and (pi/2) tau, (3,) each."""
    count = min(NODES[0] + int(NODES[1] * ratio), NODES[2])
    tau, weights = panels(np.array([0.0, 1.0]), count)
    edges = np.linspace(0.0, 1.0, max(int(DECAY * ratio / 7.0), LEAST_PANELS) + 1)
    if base.ratio != 0.0:
        edges = np.concatenate([[0.0], edges[1] * 2.0 ** np.arange(-HALVINGS, 0.0), edges[1:]])
    x, steps = panels(edges, 10)
    cosines = np.cos(np.outer(DECAY * ratio * x, np.append(tau, 1.0)))
    strength = DECAY * ratio * steps * compliance(DECAY * x, nu, base) / (1.0 + base.tip)
    kernel = (2.0 / np.pi) * (cosines.T * strength) @ (cosines[:, :-1] * weights)
    sides = np.stack([np.ones(count), tau**2, 0.5 * np.pi * tau], -1)
    g = np.linalg.solve(np.eye(count) + kernel[:-1], sides)
    return np.array([1.0, 1.0, 0.5 * np.pi]) - kernel[-1] @ g, weights @ g


_gauss = functools.lru_cache(maxsize=64)(np.polynomial.legendre.leggauss)


def panels(edges: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss nodes and weights on the panels between edges."""
    s, w = _gauss(order)
    half, middle = 0.5 * np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    return (middle[:, None] + half[:, None] * s).ravel(), (half[:, None] * w).ravel()


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

    def over(self, depth: float) -> "ThinLayer":
        """Return the factor over depths in units of ``depth``."""
        return self._replace(scale=self.scale * depth**self.power)

    def scaled(self, depth: float) -> "ThinLayer":
        """Return the factor over depths in units of ``depth``, divided by its value there."""
        own = self.over(depth)
        return own._replace(series=own.series.at[0].add(-own.log_factor(1.0)))


def thin_layer_factor(indenter: Any, depth: Any, thickness: Any, nu: Any, *, unbonded: bool = False) -> Array:
    """Return the force on an indenter at a given depth in a layer, over that on a half-space of the material.

    The layer is bonded to a rigid base or slides on it, and is elastic and linear; the exact axisymmetric solution is
    tabulated (``fitting/models/thin_layer.py``) with an error below 1e-6. It is differentiable with respect to every
    argument.

    Args:
        indenter: a ``jc.Sphere``, ``jc.Cone`` or ``jc.FlatPunch``; its material is taken as rigid.
        depth: [m] >= 0, of any shape.
        thickness: of the layer [m].
        nu: Poisson's ratio, 0 to 0.5.
        unbonded: whether the layer slides on its base without friction, not lifting off.

    Returns:
        The factor, of the shape of ``depth``; nan where the depth is not >= 0, or sqrt(R depth)/thickness of a ball,
        depth tan(half-angle)/thickness of a cone or R/thickness of a punch exceeds 10.

    Raises:
        ValueError: another indenter, a thickness that is not positive, or nu outside 0 to 0.5.

    Example:
        >>> ball = jc.Sphere(radius=10e-6)
        >>> print(f"{fitting.thin_layer_factor(ball, 1e-6, thickness=5e-6, nu=0.5):.4f}")
        2.7448
    """
    if not isinstance(thickness, jax.core.Tracer):
        check(float(thickness), _known(nu))
    found = ThinLayer.of(indenter, thickness, nu, Base(bonded=not unbonded)).factor(depth)
    return jnp.where(jnp.asarray(depth, dtype=float) >= 0.0, found, jnp.nan)


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


def check_unbonded(unbonded: Any, thickness: Any) -> None:
    """Raise ValueError unless ``unbonded`` is a truth value, and True for a layer alone."""
    if not isinstance(unbonded, bool | np.bool_):
        raise ValueError(f"unbonded: expected True or False, got {unbonded!r}")
    if unbonded and thickness is None:
        raise ValueError("unbonded: expected False without a layer, got True")


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


@jax.jit  # one program, also for a summary that evaluates it hundreds of times
def clenshaw(series: Array, x: Array) -> Array:
    """Return the sum of a Chebyshev series (m,) at x of any shape."""

    def step(carry: tuple[Array, Array], c: Array) -> tuple[tuple[Array, Array], None]:
        one, two = carry
        return (c + 2.0 * x * one - two, one), None

    zero = jnp.zeros_like(x)
    (one, two), _ = jax.lax.scan(step, (zero, zero), jnp.flip(series[1:]))
    return series[0] + x * one - two


# Approximations in common use for the indentation of a thin incompressible sample bonded to its base, for comparison.
#
# The factor on the force of a half-space is a polynomial in chi (of the module):
#
#     ball   E. K. Dimitriadis et al., Biophys. J. 82 (2002) 2798
#            P. D. Garcia, R. Garcia, Biophys. J. 114 (2018) 2923
#            R. S. Chadwick, SIAM J. Appl. Math. 62 (2002) 1520 (the limit of a very thin sample)
#     cone, punch   Garcia and Garcia


GARCIA = "Garcia and Garcia 2018"
FACTORS: dict[str, dict[str, tuple[float, ...]]] = {
    "ball": {
        "Dimitriadis 2002": (1.0, 1.133, 1.283, 0.769, 0.0975),
        GARCIA: (1.0, 1.133, 1.497, 1.469, 0.755),
        "Chadwick 2002": (0.0, 0.0, 0.0, 1.1781),
    },
    "cone": {GARCIA: (1.0, 0.721, 0.650, 0.491, 0.225)},
    "punch": {GARCIA: (1.0, 1.133, 1.283, 0.598, -0.291)},
}


class PolynomialLayer(NamedTuple):
    """A factor that is a polynomial in chi = scale depth^power; series (m,): coefficients from the constant on."""

    series: Array
    scale: Array | float
    power: Array | float

    def factor(self, depth: Array) -> Array:
        """Return the factor at depths > 0 of any shape."""
        return jnp.polyval(jnp.flip(jnp.asarray(self.series)), self.scale * depth**self.power)


def approximations(indenter: Any, thickness: float | None, nu: float) -> dict[str, PolynomialLayer]:
    """Return {name: factor} of the approximations for an indenter; none on a half-space or for nu other than 0.5."""
    if thickness is None or nu != 0.5:
        return {}
    exact = ThinLayer.of(indenter, thickness, nu)
    return {
        name: PolynomialLayer(jnp.asarray(coefficients), exact.scale, exact.power)
        for name, coefficients in FACTORS[kind_of(indenter)].items()
    }
