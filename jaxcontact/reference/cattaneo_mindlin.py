"""A ball on a half-space in partial slip under a constant normal load, similar solids: closed forms.

Exact for nu = 0; for other Poisson's ratios slip is not quite opposed to traction, an error of some percent.

References:
    C. Cattaneo, Rend. Accad. Naz. Lincei 27 (1938) 342; R. D. Mindlin, J. Appl. Mech. 16 (1949) 259; R. D. Mindlin,
    H. Deresiewicz, J. Appl. Mech. 20 (1953) 327; K. L. Johnson, Contact Mechanics (1985), sections 7.2 and 7.4.
"""

import numpy as np


def stick_radius(a, share):
    """c [m] for a tangential load ``share`` times what friction can hold, contact radius a [m]."""
    return a * (1.0 - share) ** (1.0 / 3.0)


def traction(r, a, peak, share):
    """q [Pa] along the load at r [m]; peak: friction coefficient times largest pressure [Pa]."""
    c = stick_radius(a, share)
    dome = lambda radius: np.sqrt(np.maximum(1.0 - (r / radius) ** 2, 0.0))
    return peak * (dome(a) - c / a * dome(c))


def displacement(a, held, share, compliance):
    """Of the ball [m]; held: friction coefficient times normal load [N]; compliance: sum of (2 - nu)/G [1/Pa]."""
    return 3.0 * held / (16.0 * a) * compliance * (1.0 - (1.0 - share) ** (2.0 / 3.0))


def loop_energy(a, held, share, compliance):
    """Lost in one cycle between -share and share of what friction can hold [J]."""
    rest = 1.0 - share
    bracket = 1.0 - rest ** (5.0 / 3.0) - 5.0 / 6.0 * share * (1.0 + rest ** (2.0 / 3.0))
    return 9.0 * held**2 / (10.0 * a) * compliance * bracket
