"""Elastic contact of a ball, a cone or a flat punch with a layer bonded to a rigid or elastic base.

The contact of radius a follows from the normal compliance of the layered body at the wavenumber q (Y. Hannah, Q. J. Mech.
Appl. Math. 4 (1951) 94; I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47; N. N. Lebedev, Ya. S. Ufliand, J. Appl. Math. Mech.
22 (1958) 442; E. R. M. O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235). With kappa = 3 - 4 nu, x = q h and the
modulus m of the layer over that of the base, the compliance is (1 - nu)/G H(x)/q,

    H = (1 + 4 k x e - l k e^2)/((1 - l e)(1 - k e) - 4 k x^2 e),     e = exp(-2 x),
    k = (m - 1)/(m + kappa),     l = 1 - (1 + kappa)/(1 + m kappa_base);     m = 0 is a rigid base.

The Abel transform g of the pressure satisfies, at t = tau a,

    g(tau) + (2/pi) int_0^inf (H(y h/a) - 1) cos(y tau) int_0^1 g(s) cos(y s) ds dy = depth - profile(tau),

where the profile is t^2/R for the ball, (pi/2) t/tan(half-angle) for the cone and 0 for the punch. g(1) = 0 determines the
depth of a ball and of a cone, and the force is proportional to int_0^1 g. An elastic tip adds its compliance (1 - nu)/G to
that of the layer at every wavenumber. The equation is solved by Nystrom's method on Gauss nodes.

The stiffness dF/d depth of a ball or a cone is that of the punch of the same contact radius, since the pressure added by
a further approach is that of a punch.
"""

import functools
from typing import NamedTuple

import numpy as np

NODES = 16, 3, 56  # of the contact radius: at least, for each thickness of it, and at most
DECAY = 17.0  # wavenumber times thickness beyond which H is 1 to rounding
LEAST_PANELS = 14  # of wavenumbers
HALVINGS = 8  # of the first panel, for the long waves that an elastic base changes


class Base(NamedTuple):
    """The base of a layer and the tip on it.

    ratio: shear modulus of the layer over that of the base, 0 for a rigid one; nu: Poisson's ratio of the base; tip:
    compliance (1 - nu)/G of the tip over that of the layer.
    """

    ratio: complex = 0.0
    nu: float = 0.3
    tip: complex = 0.0


RIGID = Base()


def compliance(x: np.ndarray, nu: complex, base: Base = RIGID) -> np.ndarray:
    """Return H(x) - 1 of the bonded layer; x = wavenumber times thickness."""
    kappa, e, less = 3.0 - 4.0 * nu, np.exp(-2.0 * x), -np.expm1(-2.0 * x)
    one_less_k = (1.0 + kappa) / (base.ratio + kappa)
    one_less_l = (1.0 + kappa) / (1.0 + base.ratio * (3.0 - 4.0 * base.nu))
    k, l = 1.0 - one_less_k, 1.0 - one_less_l
    below = (less + one_less_l * e) * (less + one_less_k * e) - 4.0 * k * x**2 * e
    return e * (4.0 * k * x * (1.0 + x) + k + l - 2.0 * k * l * e) / below


def contact_factors(ratio: float, nu: complex, base: Base = RIGID) -> dict[str, tuple[complex, complex]]:
    """Return {kind: (chi, f)} for a contact radius over the thickness: chi of ``thin_layer.py``, and the force over that
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
