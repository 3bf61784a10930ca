"""Closed forms for a ball on a half-space of similar material in partial slip under a constant normal load.

They are exact for nu = 0; for other Poisson's ratios the slip is not exactly opposed to the traction, an error of a few
percent.

References:
    C. Cattaneo, Rend. Accad. Naz. Lincei 27 (1938) 342; R. D. Mindlin, J. Appl. Mech. 16 (1949) 259; R. D. Mindlin,
    H. Deresiewicz, J. Appl. Mech. 20 (1953) 327; K. L. Johnson, Contact Mechanics (1985), sections 7.2 and 7.4.
"""

import numpy as np


def stick_radius(a, share):
    """Return c [m] for a tangential load that is ``share`` of the friction limit, with contact radius a [m]."""
    return a * (1.0 - share) ** (1.0 / 3.0)


def traction(r, a, peak, share):
    """Return q [Pa] along the load at r [m]; peak: friction coefficient times largest pressure [Pa]."""
    c = stick_radius(a, share)
    dome = lambda radius: np.sqrt(np.maximum(1.0 - (r / radius) ** 2, 0.0))
    return peak * (dome(a) - c / a * dome(c))


def displacement(a, limit, share, compliance):
    """Return the tangential displacement of the ball [m].

    limit: friction coefficient times normal load [N]; compliance: sum of (2 - nu)/G [1/Pa].
    """
    return 3.0 * limit / (16.0 * a) * compliance * (1.0 - (1.0 - share) ** (2.0 / 3.0))


def loop_energy(a, limit, share, compliance):
    """Return the energy dissipated in one cycle between -share and share of the friction limit [J]."""
    rest = 1.0 - share
    bracket = 1.0 - rest ** (5.0 / 3.0) - 5.0 / 6.0 * share * (1.0 + rest ** (2.0 / 3.0))
    return 9.0 * limit**2 / (10.0 * a) * compliance * bracket
