"""Elastic contact on a half-space in closed form: Hertz's sphere and ellipsoid, and the flat circular punch.

Every function takes the total compliance A = sum over both bodies of (1 - nu)/G = 2/E* [1/Pa]; a rigid body contributes
zero. Lengths in m, loads in N, pressures in Pa. Source: K. L. Johnson, Contact Mechanics (1985), Eqs. 3.35 and
3.39 to 3.42 (sphere), 4.26 to 4.32 (ellipsoid), 3.34 and 3.36 (punch).
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


def axes_ratio(radii):
    """Return a/b, the half-axis of the ellipse of contact along x over that along y, of an indenter with radii (Rx, Ry).

    The longer half-axis, along the larger radius, and the shorter one, of ratio k >= 1, satisfy

        (k^2 E(e) - K(e))/(K(e) - E(e)) = Rlarge/Rsmall,      e^2 = 1 - 1/k^2,

    with the complete elliptic integrals K and E (Johnson Eq. 4.28).
    """
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    larger, smaller = max(radii), min(radii)

    def excess(log_k):
        k = np.exp(log_k)
        m = 1.0 - 1.0 / k**2
        return np.log((k**2 * ellipe(m) - ellipk(m)) / (ellipk(m) - ellipe(m))) - np.log(larger / smaller)

    # K - E cancels; log k is odd in the logarithm of the ratio, so that the error is 1e-9
    if larger / smaller < 1.001:
        k = (larger / smaller) ** (2.0 / 3.0)
    else:
        k = np.exp(brentq(excess, 1e-6, np.log(larger / smaller) + 1.0, xtol=1e-14))
    return float(k if radii[0] >= radii[1] else 1.0 / k)


def ellipse(load, radii, compliance):
    """Return the half-axes (a, b) [m] along x and y of the contact under a load, and the approach [m].

    With the longer half-axis l, the shorter s and e^2 = 1 - (s/l)^2, the peak pressure 3 W/(2 pi a b) and E* = 2/A,

        p0 = E*/(2 Rlarge) l^2 e^2/(s (K(e) - E(e))),      approach = p0 s K(e)/E*

    (Johnson Eqs. 4.26 to 4.32); equal radii are those of a ball.
    """
    from scipy.special import ellipe, ellipk

    ratio = axes_ratio(radii)
    k = max(ratio, 1.0 / ratio)
    if k - 1.0 < 1e-6:
        a = contact_radius(load, radii[0], compliance)
        return a, a, a**2 / radii[0]
    m = 1.0 - 1.0 / k**2
    K, E = ellipk(m), ellipe(m)
    # 3 W/(2 pi l s) = l^2 e^2/(A Rlarge s (K - E)) with s = l/k
    longer = np.cbrt(3.0 * load * compliance * max(radii) * (K - E) / (2.0 * np.pi * m))
    shorter = longer / k
    approach = 1.5 * load / (np.pi * longer * shorter) * shorter * K * compliance / 2.0
    return (longer, shorter, approach) if ratio >= 1.0 else (shorter, longer, approach)


def punch_approach(load, punch_radius, compliance):
    """Return delta = W A / (4 a) [m] of a flat circular punch of radius a."""
    return load * compliance / (4.0 * punch_radius)


def punch_pressure(r, load, punch_radius):
    """Return p = W / (2 pi a sqrt(a^2 - r^2)) [Pa] under a flat circular punch, zero outside; infinite at its edge."""
    r = np.asarray(r, dtype=float)
    inside = np.abs(r) < punch_radius
    root = np.sqrt(np.where(inside, punch_radius**2 - r**2, 1.0))
    return np.where(inside, load / (2.0 * np.pi * punch_radius * root), 0.0)
