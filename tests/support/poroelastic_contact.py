"""Indentation of a poroelastic half-space, solved numerically, and the formulas of Hu et al.

Nothing is shared with the package. An incompressible solvent in an elastic network of drained Poisson's ratio nu: a
pressure on the surface, whose pore pressure is zero, displaces it in the Laplace-Hankel domain by

    u/q = (1 + 1/(eta (1 + y) - 1))/(2 G k),      eta = (1 - nu)/(1 - 2 nu),  y = sqrt(1 + s/(D k^2))

(from the potentials of J. McNamee, R. E. Gibson, Q. J. Mech. Appl. Math. 13 (1960) 98), and after a step in time by
(1 + H(D k^2 t))/(2 G k) with H in closed form below. With the pressure q(k) = int_0^a phi(x) cos(k x) dx the contact
condition becomes an integral equation for phi on 0 < x < a(t) with memory, after Abel's transform of the shape of the
indenter. Lengths are in units of the contact radius of the hold, times in a^2/D, forces in 2 G a^2.

Under a sealed indenter the surface has a pore pressure pi inside the contact. With pi(k) = int_0^a psi(y) sin(k y) dy/k,

    2 G k u = q + h (q - pi),     flux/k = pi - sigma (q - pi)/(y + b),

where h = 1/(eta (1 + y) - 1), sigma = s/(D k^2) and b = nu/(1 - nu), and the flux is zero in the contact.
"""

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from scipy.special import erf, erfc, erfcx

BALL, CONE = (0.491, 0.908, 1.679), (0.493, 0.822, 1.348)


def hu(x, curve=BALL):
    """g(x) of Hu et al. (2010)."""
    return curve[0] * np.exp(-curve[1] * np.sqrt(x)) + (1 - curve[0]) * np.exp(-curve[2] * x)


def ramp_error(ramp, since):
    """By how much the superposition over the final contact is above the force under a sealed ball after a ramp, over
    F0 - Finf: a fit to ``Sealed`` for ramps of 0.01 to 0.1, times in a^2/D after the ramp."""
    return 0.27 * np.minimum(ramp, 1) * np.exp(-since / 0.45)


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


class Sealed:
    """The contact with an indenter that lets no solvent through, on a surface that is drained beside it."""

    def __init__(self, nu, n=40, reach=1.15):
        self.nu, self.n, self.h = nu, n, reach / n
        self.x, self.k = (np.arange(n) + 0.5) * self.h, np.arange(n)
        b = nu / (1 - nu)
        k = np.linspace(0, 7.0, 60001)
        step = k[1]
        # of R(k^2) = int_0^(k^2) P dT
        slope = 2 * np.exp(-(k**2)) * (1 / np.sqrt(np.pi) - b * k * erfcx(b * k))
        R, last = cumulative_trapezoid(slope, k, initial=0)[1:], 1 / (1 + b)
        k, to_come = k[1:], remaining(k[1:] ** 2, nu)
        w = np.full(k.size, step)
        w[-1] /= 2
        z = np.concatenate([np.linspace(0, 12, 600), np.geomspace(12.05, 2500, 500)])
        S, X, C = (np.empty(z.size) for _ in range(3))
        for i, one in enumerate(z):  # the half cell at k = 0 has the limit of the integrand
            sine, cosine = w * np.sin(k * one) / k, w * (1 - np.cos(k * one)) / k**2
            S[i] = (last - R) @ sine + step / 2 * last * one
            X[i] = to_come @ sine + step / 2 * (1 - 2 * nu) * one
            C[i] = (last - R) @ cosine + step / 4 * last * one**2
        self.S = CubicSpline(z, last * np.pi / 2 - S).antiderivative()
        self.H = CubicSpline(z, (1 - 2 * nu) * np.pi / 2 - X).antiderivative()
        self.C, self.X, self.end, self.last = (
            CubicSpline(z, last * np.pi * z / 2 - C),
            CubicSpline(z, X),
            z[-1],
            np.pi / 2 * (1 - 2 * nu),
        )

    def _matrices(self, minus, plus):
        """Return matrices of functions of x - y and of x + y from their values at the differences and sums of cells."""
        return minus[self.k[:, None] - self.k + self.n], plus[self.k[:, None] + self.k]

    def _at(self, function, lag, half):
        """Return an even function at the edges (half 0.5) or the centres of the cells, over the root of a time."""
        low, count = -self.n - half, 2 * self.n + (half == 0.5)
        unit = self.h / np.sqrt(lag)
        there = lambda e: function(np.minimum(np.abs(e) * unit, self.end))
        return there(low + np.arange(count)), there(1.0 - half + np.arange(count))

    def _edges(self, function, lag, sign):
        """Return int over y cells of (f'(x + y) + sign f'(x - y))/2 for an even antiderivative f."""
        if lag <= 0:
            return np.zeros((self.n, self.n))
        minus, plus = self._matrices(*(np.diff(one) for one in self._at(function, lag, 0.5)))
        return 0.5 * np.sqrt(lag) * (plus + sign * minus)

    def by_pressure(self, lag):
        """The delayed displacement by phi."""
        if lag <= 0:
            return np.zeros((self.n, self.n))
        unit = self.h / np.sqrt(lag)
        odd = lambda e: (
            np.sign(e) * np.where(np.abs(e) < self.end, self.X(np.minimum(np.abs(e), self.end)), self.last)
        )
        minus = np.diff(odd((np.arange(-self.n, self.n + 1) - 0.5) * unit))
        plus = np.diff(odd((np.arange(2 * self.n + 1) + 0.5) * unit))
        minus, plus = self._matrices(minus, plus)
        return self.last * np.eye(self.n) - 0.5 * (minus + plus)

    def volume_by_pore(self, lag):
        """The volume that has left by psi, after a time."""
        if lag <= 0:
            return np.zeros((self.n, self.n))
        minus, plus = self._matrices(*self._at(self.C, lag, 0.0))
        return 0.5 * np.sqrt(lag) * self.h * (plus - minus)

    def force(self, times, depth, shape, step=False, fixed=False):
        """Return the force (m,) at increasing times, from no contact, or from a step of a ball to depth 1, also with the
        radius of the contact ``fixed`` at that of the step."""
        n, eye = self.n, np.eye(self.n)
        by_pressure, by_pore = self.by_pressure, lambda lag: self._edges(self.H, lag, -1.0)
        out, out_pore = lambda lag: self._edges(self.S, lag, 1.0), self.volume_by_pore
        phi, psi, edge, found, at, increments, held = np.zeros(n), np.zeros(n), 1, [0.0], [], [], []
        if step:  # nothing has moved: pore pressure and pressure are equal
            phi, psi = 2 / np.pi * np.maximum(1 - self.x**2, 0), 4 / np.pi * self.x * (self.x < 1)
            edge, at, increments = int(np.sum(phi > 0)), [times[0]], [(phi, psi)]
            found = [2 * np.pi * phi.sum() * self.h]
        for m in range(1, len(times)):
            t, before = times[m], times[m - 1]
            lag = 0.5 * (t - before)
            K, L = by_pressure(lag), by_pore(lag)
            right = depth[m] - shape + K @ phi - L @ psi
            for s, (a, b) in zip(at, increments, strict=True):
                right = right - by_pressure(t - s) @ a + by_pore(t - s) @ b
            flow = np.zeros(n)
            for j, (a, b) in enumerate(held, 1):
                lags = (
                    (t - times[j - 1], 1),
                    (t - times[j], -1),
                    (before - times[j - 1], -1),
                    (before - times[j], 1),
                )
                for one, sign in lags:
                    flow += sign * (out(one) @ a - out_pore(one) @ b)
            dt = t - before
            M = np.block([[np.pi / 2 * eye + K, -L], [-out(dt), np.pi / 2 * dt * eye + out_pore(dt)]])

            def inside(k, M=M, right=right, flow=flow):
                on = np.r_[0:k, n : n + k]
                v = np.linalg.solve(M[np.ix_(on, on)], np.r_[right[:k], flow[:k]])
                return np.r_[v[:k], np.zeros(n - k)], np.r_[v[k:], np.zeros(n - k)]

            new = inside(edge)
            while not fixed and edge > 1 and new[0][edge - 1] < 0:
                edge -= 1
                new = inside(edge)
            while not fixed and edge < n and (wider := inside(edge + 1))[0][edge] > 0:
                edge, new = edge + 1, wider
            increments.append((new[0] - phi, new[1] - psi))
            at.append(t - lag)
            phi, psi = new
            held.append(new)
            found.append(2 * np.pi * phi.sum() * self.h)
        return np.array(found)
