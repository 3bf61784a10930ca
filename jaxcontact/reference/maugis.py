"""Adhesive contact of a paraboloid with an elastic half-space, in closed form: Maugis and Dugdale, JKR.

In units of a* = (pi w R^2/K)^(1/3) for radii, pi w R for loads and (pi^2 w^2 R/K^2)^(1/3) for approaches, K = 4 E*/3, with
lambda = 2 s0 (R/(pi w K^2))^(1/3) for Dugdale's attraction s0 up to a gap w/s0, contact of radius a and attraction up to the
radius m a:

    lambda a^2/2 [sqrt(m^2 - 1) + (m^2 - 2) t] + 4 lambda^2 a/3 [sqrt(m^2 - 1) t - m + 1] = 1,     t = arctan sqrt(m^2 - 1),
    P = a^3 - lambda a^2 [sqrt(m^2 - 1) + m^2 t],     approach = a^2 - 4/3 lambda a sqrt(m^2 - 1).

Source: D. Maugis, J. Colloid Interface Sci. 150 (1992) 243. Short range (lambda -> infinity): K. L. Johnson, K.
Kendall, A. D. Roberts, Proc. R. Soc. Lond. A 324 (1971) 301: P = a^3 - a sqrt(6 a), approach = a^2 - 2/3 sqrt(6 a).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq


class MaugisUnits(NamedTuple):
    """The units of the dimensionless solution: radius [m], load [N], approach [m]."""

    radius: float
    load: float
    approach: float


def units(work: float, radius: float, modulus: float) -> MaugisUnits:
    """Return the units for a work of adhesion [J/m^2], a ball's radius [m] and a contact modulus E* [Pa]."""
    K = 4.0 * modulus / 3.0
    return MaugisUnits(
        float(np.cbrt(np.pi * work * radius**2 / K)),
        np.pi * work * radius,
        float(np.cbrt(np.pi**2 * work**2 * radius / K**2)),
    )


def strength(parameter: float, work: float, radius: float, modulus: float) -> float:
    """Return Dugdale's attraction [Pa] for a parameter lambda."""
    K = 4.0 * modulus / 3.0
    return float(parameter / 2.0 * np.cbrt(np.pi * work * K**2 / radius))


def maugis(parameter: float, a: ArrayLike) -> tuple[NDArray, NDArray]:
    """Return load and approach, in units, for contacts of radius a > 0, in units."""
    a = np.asarray(a, float)
    m = np.array([_outer(parameter, one) for one in a.ravel()]).reshape(a.shape)
    root = np.sqrt(m**2 - 1.0)
    load = a**3 - parameter * a**2 * (root + m**2 * np.arctan(root))
    return load, a**2 - 4.0 / 3.0 * parameter * a * root


def _outer(parameter: float, a: float) -> float:
    """Return m, over which radius of contact the attraction ends."""

    def work(m: float) -> float:
        root = np.sqrt(m**2 - 1.0)
        t = np.arctan(root)
        far = parameter * a**2 / 2.0 * (root + (m**2 - 2.0) * t)
        return far + 4.0 * parameter**2 * a / 3.0 * (root * t - m + 1.0) - 1.0

    high = 2.0
    while work(high) < 0.0:
        high *= 2.0
    return float(brentq(work, 1.0, high, xtol=1e-14, rtol=1e-14))


def jkr(a: ArrayLike) -> tuple[NDArray, NDArray]:
    """Return load and approach, in units, for contacts of radius a, in units, in the limit of short range."""
    a = np.asarray(a, float)
    return a**3 - a * np.sqrt(6.0 * a), a**2 - 2.0 / 3.0 * np.sqrt(6.0 * a)
