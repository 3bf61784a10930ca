"""Ting's solution for a rigid sphere on a viscoelastic half-space at a prescribed depth delta(t) with one maximum.

`relaxation` is G(t) [Pa], `depth` delta(t) [m] from delta(0) = 0 and `rate` its derivative [m/s], numpy callables;
`peak_time` [s] is the time of the largest depth. Poisson's ratio nu is constant. Source: T. C. T. Ting, J. Appl. Mech. 33
(1966) 845.
"""

import numpy as np
from scipy.optimize import brentq

from jaxcontact.reference.lee_radok import graded

NODES, WEIGHTS = graded(16)


def _integral(function, start, end):
    """Return the integral over [start, end] of a function that is not smooth at the end."""
    return float(np.sum((end - start) * WEIGHTS * function(start + (end - start) * NODES)))


def _memory(start, t, relaxation, rate, peak_time):
    """Return int_start^t G(t - tau) delta'(tau) dtau [Pa m], split at the peak time, where the rate may jump."""

    def integrand(tau):
        return relaxation(t - tau) * rate(tau)

    turn = min(max(peak_time, start), t)
    return _integral(integrand, start, turn) + _integral(integrand, turn, t)


def matching_time(t, relaxation, rate, peak_time):
    """Return t1(t) [s], the time of loading with the same contact radius: int_t1^t G(t - tau) delta' dtau = 0.

    It is t itself during loading, and 0 once contact is lost.
    """
    if t <= peak_time:
        return t
    if _memory(0.0, t, relaxation, rate, peak_time) <= 0.0:
        return 0.0
    return brentq(_memory, 0.0, peak_time, args=(t, relaxation, rate, peak_time), xtol=1e-14 * t, rtol=1e-14)


def contact_radius(t, relaxation, depth, rate, peak_time, radius):
    """Return a(t) = sqrt(R delta(t1(t))) [m]."""
    return np.sqrt(radius * depth(matching_time(t, relaxation, rate, peak_time)))


def load(t, relaxation, depth, rate, peak_time, radius, nu):
    """Return W = 8 sqrt(R)/(3 (1 - nu)) int_0^t1(t) G(t - tau) d(delta^(3/2)) [N], for loading (t1 = t) and unloading.

    The variable sqrt(tau) removes the square-root singularity of a depth that starts linearly.
    """
    last = matching_time(t, relaxation, rate, peak_time)

    def integrand(root):
        tau = root**2
        return relaxation(t - tau) * 1.5 * np.sqrt(depth(tau)) * rate(tau) * 2.0 * root

    return 8.0 * np.sqrt(radius) / (3.0 * (1.0 - nu)) * _integral(integrand, 0.0, np.sqrt(last))
