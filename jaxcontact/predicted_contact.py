"""What a ball does to a body, nearly, before anything is solved: the contact's radius and the film's strain.

The pressure is taken to be that of Hertz on a circle of radius a, p0 sqrt(1 - r^2/a^2), whose Hankel transform is
2 pi p0 a^2 (sin z - z cos z)/z^3, z = alpha a (K. L. Johnson, Contact Mechanics, 1985, section 3.4, has the pressure).
The surface then goes down by

    u(r) = p0 a int A(z/a, t) g(z) J_0(z r/a) dz,      g(z) = (sin z - z cos z)/z^3,      A = alpha N,

and a follows from one condition, that the ball of radius R touches in the middle and at the edge,

    u(0) - u(a) = a^2/(2 R),

with p0 = 3 W/(2 pi a^2), or at a given approach u(0). On a half-space both are exact (Hertz). The film's strain is u(0) on
the film on a rigid base, of creep J and shape F, over its thickness h:

    strain = J(t) p0 (a/h) int F(h z/a) g(z) dz,

with the pressure of the end for the whole history. Derived here; held against solved contacts.
"""

from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact.controls import Control, Load
from jaxcontact.indenters import Sphere
from jaxcontact.layers import LayeredHalfSpace, checked_body
from jaxcontact.response.base import Response
from jaxcontact.response.body import response_of
from jaxcontact.response.volume import film_shape

Z = np.geomspace(1e-4, 1e3, 3000)  # alpha a; what is left out beyond is 1e-6 of the middle's displacement
WEIGHTS = Z * np.log(Z[1] / Z[0])  # of a sum over them
TURN = 1e-2  # below it g is 1/3 to 1e-5
SPREAD = 1e4  # wavenumbers about those of the ball on film and on substrate, either way
BISECTIONS = 60


@dataclass(frozen=True)
class Predicted:
    """radius: of the contact at its largest [m]; film_strain: at its largest, 0 without a film.

    Beside solved contacts on single films of 0.0005 to 14 radii, softer and stiffer than the steel below, elastic and
    creeping, at given load or approach: at nu = 0.3 the radius was 0.92 to 1.02 and the strain 0.88 to 1.02 of the
    solved, at nu = 0.49, whose thin films press back most in the middle, 0.88 to 1.18 and 0.65 to 1.03.
    """

    radius: float
    film_strain: float


def predicted(body: LayeredHalfSpace, ball: Sphere, control: Control, times: np.ndarray) -> Predicted:
    """Radius and strain at the first or the last time, whichever is more, under the largest load or approach.

    body: its film, the top layer, of one thickness. The control is at its largest the whole time.
    """
    response = response_of(checked_body(body)[0])
    value = max(float(np.max(np.asarray(control.value))), 0.0)
    each = [
        _at(response, ball, isinstance(control, Load), value, t) for t in {0.0, float(times[-1] - times[0])}
    ]
    return Predicted(max(one.radius for one in each), max(one.film_strain for one in each))


def _at(response: Response, ball: Sphere, loaded: bool, value: float, t: float) -> Predicted:
    """After a time t [s] under a load [N], or at an approach [m]."""
    own, R = float(ball.compliance()), float(ball.radius)
    wide, narrow = (float(side(t)) + own for side in (response.wide, response.narrow))
    if value == 0.0 or max(wide, narrow) == 0.0:  # nothing presses, or both are rigid at first
        return Predicted(0.0, 0.0)
    hertz = [
        (3.0 * value * R * A / 8.0) ** (1.0 / 3.0) if loaded else (R * value) ** 0.5 for A in (wide, narrow)
    ]
    radii = np.array([a for a in hertz if a > 0.0])
    alpha = np.geomspace(1.0 / (SPREAD * radii.max()), SPREAD / radii.min(), 400)
    A = own + np.asarray(_step(response, alpha, t))
    surface = lambda a: _middle_and_edge(np.interp(np.log(Z / a), np.log(alpha), A))

    def too_small(a: float) -> bool:
        middle, edge = surface(a)
        p0 = 1.5 * value / (np.pi * a**2) if loaded else value / (a * middle)
        return p0 * a * (middle - edge) > a**2 / (2.0 * R)

    a = _bisected(too_small, 0.05 * radii.min(), 20.0 * radii.max())
    p0 = 1.5 * value / (np.pi * a**2) if loaded else value / (a * surface(a)[0])
    return Predicted(a, p0 * _strain_per_pressure(response, a, t))


@jax.jit  # where each operation would be a program of its own
def _step(response: Response, alpha: Array, t: Array) -> Array:
    return response.step(alpha, t, t)


def _strain_per_pressure(response: Response, a: float, t: float) -> float:
    film = response.film()
    if film is None:
        return 0.0
    h = float(film.thickness)
    shape = np.asarray(film_shape(film.material, jnp.asarray(h * Z / a)))
    return float(response.film_creep().creep(t)) * a / h * _middle_and_edge(shape)[0]


def _middle_and_edge(A: np.ndarray) -> tuple[float, float]:
    """The integrals of A g and of A g J_0(z) over z, A at ``Z``."""
    from scipy.special import j0

    with np.errstate(all="ignore"):
        g = np.where(Z < TURN, 1.0 / 3.0, (np.sin(Z) - Z * np.cos(Z)) / Z**3)
    return float(np.sum(A * g * WEIGHTS)), float(np.sum(A * g * j0(Z) * WEIGHTS))


def _bisected(too_small: Callable[[float], bool], low: float, high: float) -> float:
    """Where a condition that holds of small radii ceases to."""
    for _ in range(BISECTIONS):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if too_small(middle) else (low, middle)
    return float(np.sqrt(low * high))
