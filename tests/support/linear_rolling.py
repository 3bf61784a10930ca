"""Rolling without slip over an ellipse of contact, between equal half-spaces, by a spectral method of its own.

Tractions of the form polynomial/sqrt(1 - r^2) on the ellipse move its surface by a polynomial of the same degree (L. A.
Galin; J. J. Kalker, On the rolling contact of two elastic bodies in the presence of dry friction, thesis, Delft 1967). With
the coordinates scaled to the unit disc, s = sqrt(1 - r^2) and l - m even, the functions

    phi_lm = P_l^m(s)/s e^(i m t)   have the transform   2 pi (-i)^m i^(l-m) P_l^m(0) j_l(k) e^(i m phi),

and int j_l j_l' dk = 0 for l - l' even and not zero, so that the compliance f(phi)/k couples only equal degrees l. Rolling
along x without slip leaves a displacement a xi x + k(y), and the free functions k follow from a traction without a
singularity at the leading edge. It converges fast: 5 digits at degree 16.
"""

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.polynomial.legendre import leggauss
from scipy.special import gammaln, lpmv


def _legendre(degree, order, s):
    """P_l^m(s), with an integral of the square over 0 to 1 of 1 for l - m even."""
    size = (2 * degree + 1) * np.exp(gammaln(degree - order + 1) - gammaln(degree + order + 1))
    return np.sqrt(size) * lpmv(order, degree, s)


def forces(a, b, nu, degree=16):
    """Forces (F_x, F_y) and moments of unit creepage along x, of one along y, and of unit spin, for G = 1: (3, 2) and (3,).

    a, b: half-axes along the direction of rolling and across. The body's traction is opposed to its slip, which the creepage
    of the other body over it causes: all are the force and moment on the body.
    """
    angles = 2.0 * np.pi * np.arange(256) / 256
    kx, ky = np.cos(angles) / a, np.sin(angles) / b
    k = np.hypot(kx, ky)
    ex, ey = kx / k, ky / k
    L, T = 2.0 * (1.0 - nu), 2.0  # of both bodies
    compliance = (
        np.array([[L * ex**2 + T * ey**2, (L - T) * ex * ey], [(L - T) * ex * ey, T * ex**2 + L * ey**2]]) / k
    )
    harmonics = np.fft.fft(compliance, axis=-1) * (2.0 * np.pi / 256)

    # the displacements asked for, and those that cost no slip
    s, weights = leggauss(degree + 4)
    s, weights = (s + 1.0) / 2.0, weights / 2.0
    around = 2 * degree + 8
    t = 2.0 * np.pi * np.arange(around) / around
    r = np.sqrt(1.0 - s**2)
    x, y = r[:, None] * np.cos(t), r[:, None] * np.sin(t)
    none = np.zeros_like(x)
    asked = [(-a * x, none), (none, -a * x), (a * x * b * y, -((a * x) ** 2) / 2.0)]
    powers = [Chebyshev.basis(j)(y) for j in range(degree + 1)]
    moved = np.array([*asked, *((p, none) for p in powers), *((none, p) for p in powers)])
    moved = np.fft.fft(moved, axis=-1) / around

    # degree by degree: the tractions, and what of them is singular at the leading edge
    edge, edge_weights = leggauss(4 * degree + 8)
    edge, edge_weights = edge * np.pi / 2.0, edge_weights * np.pi / 2.0
    singular = np.zeros((len(moved), 2, edge.size), complex)
    tractions = []
    for l in range(degree + 1):
        m = np.arange(-l, l + 1, 2)
        at_s = np.array([_legendre(l, abs(order), s) for order in m])
        at_edge = np.array([_legendre(l, abs(order), np.zeros(1))[0] for order in m])
        wanted = 2.0 * np.pi * np.einsum("ms,s,fcsm->fcm", at_s, weights, moved[..., m % around])
        transform = 2.0 * np.pi * (-1j) ** np.abs(m) * 1j ** (l - np.abs(m)) * at_edge
        block = np.einsum(
            "ijmn,m,n->imjn", harmonics[..., (m[:, None] - m) % 256], transform.conj(), transform
        )
        block *= np.pi / (2.0 * (2 * l + 1)) / (4.0 * np.pi**2)
        size = 2 * m.size
        found = np.linalg.solve(block.reshape(size, size), wanted.reshape(-1, size).T).T.reshape(
            -1, 2, m.size
        )
        tractions.append(found)
        singular += np.einsum("fcm,m,mt->fct", found, at_edge, np.exp(1j * m[:, None] * edge))

    force = 2.0 * np.pi * a * b * tractions[0][:, :, 0].real
    lever = 2.0 * np.pi * np.sum(weights * _legendre(1, 1, s) * r)
    minus, plus = np.moveaxis(tractions[1], 2, 0)
    moment = (
        a * b * lever * (a * (plus + minus).real[:, 1] / 2.0 - b * (1j * (plus - minus)).real[:, 0] / 2.0)
    )

    rows = (singular.real * np.sqrt(edge_weights)).reshape(len(moved), -1)
    free = np.linalg.lstsq(rows[3:].T, -rows[:3].T, rcond=1e-13)[0].T
    return force[:3] + free @ force[3:], moment[:3] + free @ moment[3:]
