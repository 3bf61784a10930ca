"""Force curves of a viscoelastic half-space by quadrature of Ting's integrals, with numpy and scipy alone.

The tip approaches at a constant speed up to the largest depth d1 at the time t1, and goes back as fast. With the force P of
an elastic sample of unit modulus, size depth^p/(1 - nu) on a half-space,

    approach     force = int_0^t G(t - s) dP(s)
    retraction   force = int_0^m G(t - s) dP(s),     int_m^t G(t - s) d depth(s) = 0     (force 0 if m < 0)

Source: T. C. T. Ting, J. Appl. Mech. 33 (1966) 845. The integrals over power laws of the time up to the present, and of the
square root of the depth from the first contact on, are taken in variables in which they are smooth.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq
from scipy.special import gamma

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
PANELS = 8


def solid(G0: float, Ginf: float, tau: float) -> Callable[[np.ndarray], np.ndarray]:
    """Relaxation modulus of the standard linear solid, of relaxation time tau."""
    return lambda t: Ginf + (G0 - Ginf) * np.exp(-t / tau)


def kelvin_voigt(G: float, V: float, alpha: float) -> Callable[[np.ndarray], np.ndarray]:
    """Relaxation modulus of a spring G beside a springpot V; of the latter alone for G = 0."""
    return lambda t: G + V * np.maximum(t, 1e-300) ** -alpha / gamma(1.0 - alpha)


def integral(f: Callable, begin: float, end: float, power: float) -> float:
    """Integral of f(s, end - s) over (begin, end), with end - s = (end - begin) u^power; panels halve towards the end."""
    u = np.concatenate([[0.0], 0.5 ** np.arange(PANELS, -1.0, -1.0)])
    half, mid = 0.5 * np.diff(u), 0.5 * (u[1:] + u[:-1])
    u = mid[:, None] + half[:, None] * NODES
    size = end - begin
    gap = size * u**power
    return float(np.sum(half[:, None] * WEIGHTS * f(end - gap, gap) * size * power * u ** (power - 1.0)))


def half_space(size: float, p: float, nu: float) -> Callable[[np.ndarray], np.ndarray]:
    """dP/d depth of a half-space."""
    return lambda depth: size / (1.0 - nu) * p * depth ** (p - 1.0)


def force(
    t: np.ndarray, G: Callable, largest: float, turn: float, slope: Callable, power: float
) -> np.ndarray:
    """Force (n,) [N] at t (n,) [s] from first contact on, 0 before; slope: dP/d depth; power: 1/(1 - alpha) of a law with
    alpha, else 1."""
    found, speed = np.zeros(t.size), largest / turn
    for i, now in enumerate(t):
        if now <= 0.0:
            continue
        last = now
        if now > turn:
            back = integral(lambda s, gap: G(gap), turn, now, power)
            since = now - turn
            reached = lambda m, since=since, back=back: (
                integral(lambda s, gap: G(since + gap), m, turn, power) - back
            )
            if reached(0.0) <= 0.0:
                continue
            last = brentq(reached, 0.0, turn, xtol=1e-14 * turn, rtol=1e-13)
        # s = r^2, for the square root of the depth at first contact
        end, since = np.sqrt(last), now - last
        rate = lambda r, gap, end=end, since=since: (
            G(since + gap * (end + r)) * slope(speed * r * r) * speed * 2.0 * r
        )
        found[i] = integral(rate, 0.0, end, power)
    return found


def held(
    t: np.ndarray, G: Callable, largest: float, turn: float, slope: Callable, power: float
) -> np.ndarray:
    """Force (n,) [N] at t (n,) [s] of an approach up to the time ``turn`` and a hold of the largest depth; else as
    ``force``."""
    found, speed = np.zeros(t.size), largest / turn
    for i, now in enumerate(t):
        last = min(now, turn)
        if last <= 0.0:
            continue
        end, since = np.sqrt(last), now - last
        rate = lambda r, gap, end=end, since=since: (
            G(since + gap * (end + r)) * slope(speed * r * r) * speed * 2.0 * r
        )
        found[i] = integral(rate, 0.0, end, power)
    return found
