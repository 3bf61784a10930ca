"""Indentation of a poroelastic half-space with a drained surface, solved numerically, and the formulas of Hu et al.

Nothing is shared with the package. An incompressible solvent in an elastic network of drained Poisson's ratio nu: a
pressure on the surface, whose pore pressure is zero, displaces it in the Laplace-Hankel domain by

    u/q = (1 + 1/(eta (1 + y) - 1))/(2 G k),      eta = (1 - nu)/(1 - 2 nu),  y = sqrt(1 + s/(D k^2))

(from the potentials of J. McNamee, R. E. Gibson, Q. J. Mech. Appl. Math. 13 (1960) 98), and after a step in time by
(1 + H(D k^2 t))/(2 G k) with H in closed form below. With the pressure q(k) = int_0^a phi(x) cos(k x) dx the contact
condition becomes an integral equation for phi on 0 < x < a(t) with memory, after Abel's transform of the shape of the
indenter. Lengths are in units of the contact radius of the hold, times in a^2/D, forces in 2 G a^2.
"""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import erf, erfc, erfcx

BALL, CONE = (0.491, 0.908, 1.679), (0.493, 0.822, 1.348)


def hu(x, curve=BALL):
    """g(x) of Hu et al. (2010)."""
    return curve[0] * np.exp(-curve[1] * np.sqrt(x)) + (1 - curve[0]) * np.exp(-curve[2] * x)


def remaining(T, nu):
    """Return H(inf) - H(T), the part of the compliance that is still to come."""
    b, eta, root = nu / (1 - nu), (1 - nu) / (1 - 2 * nu), np.sqrt(T)
    parts = (1 + erf(root)) / (2 * (1 + b)) - erfc(root) / (2 * (1 - b))
    return 1 - 2 * nu - (parts + b / (1 - b * b) * np.exp(-T) * erfcx(b * root)) / eta


class Drained:
    """The contact with a half-space of Poisson's ratio nu, on n cells of x up to ``reach`` contact radii."""

    def __init__(self, nu, n=100, reach=1.15):
        self.nu, self.n, self.h = nu, n, reach / n
        self.x = (np.arange(n) + 0.5) * self.h
        k = np.linspace(1e-6, 7.0, 20001)
        z = np.concatenate([np.linspace(0, 12, 1200), np.linspace(12.1, 60, 500)])
        weights = np.gradient(k) * np.where((k == k[0]) | (k == k[-1]), 0.5, 1.0)
        integrals = np.array([np.sum(weights * remaining(k**2, nu) * np.sin(k * one) / k) for one in z])
        self.spline, self.last = CubicSpline(z, integrals), np.pi / 2 * remaining(0.0, nu)

    def integral(self, z):
        """Return int_0^z of the cosine transform of ``remaining``."""
        size = np.abs(z)
        return np.sign(z) * np.where(size < 60, self.spline(np.minimum(size, 60.0)), self.last)

    def kernel(self, lag):
        """Return the displacement (n, n) at x by phi of one at y after a time."""
        if lag <= 0:
            return np.pi / 2 * np.eye(self.n)
        k, unit = np.arange(self.n), self.h / np.sqrt(lag)
        minus = np.diff(self.integral((np.arange(-self.n, self.n + 1) - 0.5) * unit))
        plus = np.diff(self.integral((np.arange(2 * self.n + 1) + 0.5) * unit))
        both = minus[k[:, None] - k + self.n] + plus[k[:, None] + k]
        return np.pi * (1 - self.nu) * np.eye(self.n) - 0.5 * both

    def force(self, times, depth, shape):
        """Return the force (m,) at increasing times for depths (m,) of an indenter with Abel's transform ``shape`` (n,)."""
        phi, increments, at, found, edge = np.zeros(self.n), [], [], [], 1
        for m, t in enumerate(times):
            middle = t if m == 0 or times[m] == times[m - 1] else 0.5 * (t + times[m - 1])
            K = self.kernel(t - middle)
            past = sum(
                (self.kernel(t - s) @ d for s, d in zip(at, increments, strict=True)), np.zeros(self.n)
            )
            right = depth[m] - shape - past + K @ phi
            inside = lambda k, K=K, right=right: np.append(
                np.linalg.solve(K[:k, :k], right[:k]), np.zeros(self.n - k)
            )
            new = np.zeros(self.n)
            if depth[m] > 0:
                new = inside(edge)
                while edge > 1 and new[edge - 1] < 0:  # the contact ends where phi does
                    edge -= 1
                    new = inside(edge)
                while edge < self.n and (wider := inside(edge + 1))[edge] > 0:
                    edge, new = edge + 1, wider
            increments.append(new - phi)
            at.append(middle)
            phi = new
            found.append(2 * np.pi * np.sum(phi) * self.h)
        return np.array(found)
