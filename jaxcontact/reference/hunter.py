"""Steady rolling or sliding of a rigid cylinder over a standard linear solid, frictionless, plane strain.

With J(t) = J0 + J1 (1 - exp(-t/tau)), the body moving past the cylinder in +x at speed v and the contact
-a <= x <= a, the condition on the slope of the surface gives

    g(s) = (c0 + c1 s + c2 (2 s^2 - 1))/sqrt(1 - s^2),     p(s) = zeta int_{-1}^s exp(-zeta (s - r)) g(r) dr,

s = x/a, zeta = a/(tau' v), tau' = tau J0/(J0 + J1), c2 = -a/(2 beta), beta = R (1 - nu)(J0 + J1), and with
modified Bessel functions at zeta and at z = a/(tau v)

    c0 I0(zeta) + c1 I1(zeta) + c2 I2(zeta) = 0,     c0 K0(z) - c1 K1(z) + c2 K2(z) = 0.

Source: S. C. Hunter, J. Appl. Mech. 28 (1961) 611.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ive, kve

NODES, WEIGHTS = np.polynomial.legendre.leggauss(400)


@dataclass(frozen=True)
class LineContact:
    """The solution of a line contact.

    half_width a [m]; load per length P' [N/m]; apex x0 [m]: position of the cylinder's axis from the centre of the
    contact; friction: horizontal force over load, positive; coefficients c0, c1, c2; zeta.
    """

    half_width: float
    load: float
    apex: float
    friction: float
    coefficients: tuple[float, float, float]
    zeta: float

    def pressure(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return p(x) [Pa], x (n,) [m] from the centre of the contact, with the body moving in +x."""
        s = np.clip(np.asarray(x, float) / self.half_width, -1.0, 1.0)
        end = np.arccos(-s)[:, None]
        angle = end * (NODES + 1.0) / 2.0
        c0, c1, c2 = self.coefficients
        g = c0 - c1 * np.cos(angle) + c2 * np.cos(2.0 * angle)
        decay = np.exp(-self.zeta * (s[:, None] + np.cos(angle)))
        return np.asarray(self.zeta * np.sum(WEIGHTS * decay * g, axis=1) * end[:, 0] / 2.0)


def of_half_width(
    a: float, speed: float, radius: float, J0: float, J1: float, tau: float, nu: float
) -> LineContact:
    """Return the contact of half-width a [m] at a speed > 0 [m/s]; J0, J1 [1/Pa], tau [s]."""
    relaxation = tau * J0 / (J0 + J1)
    beta = radius * (1.0 - nu) * (J0 + J1)
    zeta, z = a / (relaxation * speed), a / (tau * speed)
    c2 = -a / (2.0 * beta)
    matrix = np.array([[ive(0, zeta), ive(1, zeta)], [kve(0, z), -kve(1, z)]])
    c0, c1 = np.linalg.solve(matrix, -c2 * np.array([ive(2, zeta), kve(2, z)]))
    load = np.pi * a * c0
    apex = tau * speed + beta * c1
    moment = np.pi * a**2 * c1 / 2.0 + relaxation * speed * load
    return LineContact(a, load, apex, (apex - moment / load) / radius, (c0, c1, c2), zeta)


def of_load(
    load: float, speed: float, radius: float, J0: float, J1: float, tau: float, nu: float
) -> LineContact:
    """Return the contact under a load per length [N/m]; its half-width lies between those of the elastic limits."""
    width = lambda J: float(np.sqrt(2.0 * load * radius * (1.0 - nu) * J / np.pi))
    contact = lambda a: of_half_width(a, speed, radius, J0, J1, tau, nu)
    a = brentq(lambda a: contact(a).load - load, 0.999 * width(J0), 1.001 * width(J0 + J1), xtol=1e-14)
    return contact(float(a))
