"""Axisymmetric elastic contact on a half-space in closed form: Hertz's sphere and the flat circular punch.

Every function takes the total compliance A = sum over both bodies of (1 - nu)/G = 2/E* [1/Pa]; a rigid body contributes
zero. Lengths in m, loads in N, pressures in Pa. Source: K. L. Johnson, Contact Mechanics (1985), Eqs. 3.35 and
3.39 to 3.42 (sphere), 3.34 and 3.36 (punch).
"""

import numpy as np


def compliance(*bodies):
    """Return A = sum (1 - nu)/G [1/Pa] over `bodies`, each (shear modulus [Pa], Poisson's ratio)."""
    return sum((1.0 - nu) / G for G, nu in bodies)


def contact_radius(load, radius, compliance):
    """Return a = (3 W R A / 8)^(1/3) [m] (Johnson Eq. 4.22)."""
    return np.cbrt(3.0 * np.asarray(load) * radius * compliance / 8.0)


def approach(load, radius, compliance):
    """Return delta = a^2 / R [m] (Johnson Eq. 4.23)."""
    return contact_radius(load, radius, compliance) ** 2 / radius


def load_for_approach(approach, radius, compliance):
    """Return W = 8 sqrt(R) delta^(3/2) / (3 A) [N]; zero before first touch."""
    return 8.0 * np.sqrt(radius) * np.maximum(approach, 0.0) ** 1.5 / (3.0 * compliance)


def peak_pressure(load, radius, compliance):
    """Return p0 = 3 W / (2 pi a^2) [Pa] (Johnson Eq. 4.24)."""
    return 1.5 * load / (np.pi * contact_radius(load, radius, compliance) ** 2)


def pressure(r, load, radius, compliance):
    """Return p(r) = p0 sqrt(1 - r^2/a^2) [Pa], zero outside the contact."""
    a = contact_radius(load, radius, compliance)
    profile = np.sqrt(np.maximum(1.0 - (np.asarray(r) / a) ** 2, 0.0))
    return peak_pressure(load, radius, compliance) * profile


def displacement(r, load, radius, compliance):
    """Return the sum of both surfaces' displacements at distance r [m] (Johnson Eq. 3.41a, 3.42a).

    Inside u = (2 a^2 - r^2)/(2 R) = delta - r^2/(2R);
    outside u = [(2 a^2 - r^2) asin(a/r) + a sqrt(r^2 - a^2)] / (pi R).
    """
    a = contact_radius(load, radius, compliance)
    r = np.abs(np.asarray(r, dtype=float))
    out = np.maximum(r, a)
    outside = ((2 * a**2 - out**2) * np.arcsin(a / out) + a * np.sqrt(out**2 - a**2)) / (np.pi * radius)
    return np.where(r <= a, (2 * a**2 - r**2) / (2 * radius), outside)


def punch_approach(load, punch_radius, compliance):
    """Return delta = W A / (4 a) [m] of a flat circular punch of radius a."""
    return load * compliance / (4.0 * punch_radius)


def punch_pressure(r, load, punch_radius):
    """Return p = W / (2 pi a sqrt(a^2 - r^2)) [Pa] under a flat circular punch, zero outside; infinite at its edge."""
    r = np.asarray(r, dtype=float)
    inside = np.abs(r) < punch_radius
    root = np.sqrt(np.where(inside, punch_radius**2 - r**2, 1.0))
    return np.where(inside, load / (2.0 * np.pi * punch_radius * root), 0.0)
