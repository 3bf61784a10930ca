"""An estimate of the contact radius and the film strain, made before the contact is solved.

The pressure is assumed to be that of Hertz on a circle of radius a, p0 sqrt(1 - r^2/a^2), whose Hankel transform is
2 pi p0 a^2 (sin z - z cos z)/z^3, z = alpha a (K. L. Johnson, Contact Mechanics, 1985, section 3.4, gives the pressure).
The surface displacement is then

    u(r) = p0 a int A(z/a, t) g(z) J_0(z r/a) dz,      g(z) = (sin z - z cos z)/z^3,      A = alpha N,

and a follows from one condition, that the ball of radius R touches at the centre and at the edge,

    u(0) - u(a) = a^2/(2 R),

with p0 = 3 W/(2 pi a^2) under a load W, or from a given approach u(0). On a half-space both are exact (Hertz). For any
other axisymmetric profile, the profile at a replaces a^2/(2 R). Under a roller the pressure is p0 sqrt(1 - x^2/b^2), with
the transform pi p0 b J_1(z)/z, and

    u(x) = p0 b int A(z/b, t) g(z) cos(z x/b) dz,      g(z) = J_1(z)/z^2,

with p0 = 2 P/(pi b) under a load P per length, leaving out waves longer than the roller. Under a pointed indenter the
pressure of Hertz is far off where a stiff coating bends. There the pressures of concentric rings are those under which the
surface has the shape of the indenter, and a is the radius at which the pressure at the edge changes its sign: it is
compressive at the edge of a disc that is too small, and tensile if it is too large (K. L. Johnson, section 5.1).

The film strain is the displacement u(0) of the film on a rigid base, of creep J and shape F, over its thickness h:

    strain = J(t) p0 (a/h) int F(h z/a) g(z) dz,

with the final pressure taken for the whole history. Derived here; compared with solved contacts.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact.bodies.body import LayeredHalfSpace, checked_body
from jaxcontact.bodies.controls import Control, Load
from jaxcontact.response.in_time import Response
from jaxcontact.response.normal import response_of
from jaxcontact.response.stack import (
    film_creep,
    film_shape,
    long_wave_compliance,
    short_wave_compliance,
    top_layer,
)

Z = np.geomspace(1e-4, 1e3, 3000)  # alpha a; the omitted part is 1e-6 of the displacement at the centre
WEIGHTS = Z * np.log(Z[1] / Z[0])  # of the quadrature over Z
SERIES_BELOW = 1e-2  # z below which g is 1/3 or 1/(2 z) to 1e-5
# factor between the inverse contact radii, on film and on substrate, and the extreme wavenumbers
WAVENUMBER_RANGE = 1e4
BISECTIONS = 60
LONGEST = 2.0  # alpha times the roller's length below which waves are left out
RINGS = 24
RIDGE = 1e-9  # compliance of springs on the rings relative to the sum of theirs; a film may be rigid for short waves
SHARPEST = 200.0  # z above which waves are damped, much shorter than the width of a ring


@dataclass(frozen=True)
class Predicted:
    """The estimated largest contact radius [m] and the largest film strain, 0 without a film.

    Compared with solved contacts on single films of thickness 0.0005 to 14 contact radii, softer and stiffer than the
    steel below, elastic and creeping, at given load or approach: at nu = 0.3 the radius was 0.92 to 1.02 and the strain
    0.88 to 1.02 of the solved values; at nu = 0.49, where thin films resist compression most at the centre, 0.88 to 1.18
    and 0.65 to 1.03.
    """

    radius: float
    film_strain: float


@dataclass(frozen=True)
class Outline:
    """The properties of an indenter that an estimate of its contact requires.

    depth: profile [m] as a function of radius or half-width [m]; hertz: function (compliance, value, loaded) that returns
    the contact radius [m] on a half-space of a compliance [1/Pa] under a load [N], or at an approach [m]; compliance: of
    the indenter [1/Pa]; length: of a roller [m], None for an axisymmetric indenter; pointed: whether its slope is not zero
    at its axis.
    """

    depth: Callable[[float], float]
    hertz: Callable[[float, float, bool], float]
    compliance: float
    length: float | None = None
    pointed: bool = False


def predicted(body: LayeredHalfSpace, outline: Outline, control: Control, times: np.ndarray) -> Predicted:
    """Estimate radius and strain at the first or the last time, whichever is larger, under the largest load or approach.

    body: its top layer is taken as the film, of uniform thickness. The control is taken at its maximum for the whole
    history.
    """
    checked = checked_body(body)[0]
    response = response_of(checked)
    value = max(float(np.max(np.asarray(control.value))), 0.0)
    instants = {0.0, float(times[-1] - times[0])}
    each = [_at(response, checked, outline, isinstance(control, Load), value, t) for t in instants]
    return Predicted(max(one.radius for one in each), max(one.film_strain for one in each))


def softening(body: LayeredHalfSpace, outline: Outline, radius: float, t: float) -> float:
    """Return by how much body and indenter together soften in a time t [s] under a contact of a radius [m], relative to
    their instantaneous compliance; the compliance is that at the wavenumber 1.5/radius."""
    alpha, response = jnp.asarray([1.5 / radius]), response_of(checked_body(body)[0])
    at_first, later = (float(_alpha_N(response, alpha, time)[0]) + outline.compliance for time in (0.0, t))
    return later / at_first - 1.0


def _at(
    response: Response, body: LayeredHalfSpace, outline: Outline, loaded: bool, value: float, t: float
) -> Predicted:
    """Return the estimate after a time t [s] under a load [N], or at an approach [m]."""
    own = outline.compliance
    wide, narrow = (float(side(body, t)) + own for side in (long_wave_compliance, short_wave_compliance))
    if value == 0.0 or max(wide, narrow) == 0.0:  # no load, or both instantaneous compliances are zero
        return Predicted(0.0, 0.0)
    radii = np.array([a for a in (outline.hertz(A, value, loaded) for A in (wide, narrow)) if a > 0.0])
    alpha = np.geomspace(1.0 / (WAVENUMBER_RANGE * radii.max()), WAVENUMBER_RANGE / radii.min(), 400)
    A = own + np.asarray(_alpha_N(response, alpha, t))

    def compliance(a: float) -> np.ndarray:
        return np.interp(np.log(Z / a), np.log(alpha), A)

    def surface(a: float) -> tuple[float, float]:
        if outline.length is not None:
            return _line(compliance(a), LONGEST * a / outline.length)
        return _round(compliance(a))

    def peak(a: float) -> float:
        if not loaded:
            return value / (a * surface(a)[0])
        if outline.length is not None:
            return 2.0 * value / (np.pi * a * outline.length)
        return 1.5 * value / (np.pi * a**2)

    def too_small(a: float) -> bool:
        if outline.pointed:
            return _edge_pressure(compliance(a), outline.depth, a, value, loaded) > 0.0
        centre, edge = surface(a)
        return peak(a) * a * (centre - edge) > outline.depth(a)

    # The radius at which the disc ceases to be too small, by bisection of its logarithm.
    low, high = 0.01 * radii.min(), 100.0 * radii.max()
    for _ in range(BISECTIONS):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if too_small(middle) else (low, middle)
    a = float(np.sqrt(low * high))

    # The film strain J(t) p0 (a/h) int F(h z/a) g(z) dz.
    top = top_layer(body)
    if outline.length is not None or top is None:
        return Predicted(a, 0.0)
    shape = np.asarray(film_shape(top, jnp.asarray(Z / a)))
    of_pressure = float(film_creep(top).creep(t)) * a / float(top.thickness) * _round(shape)[0]
    return Predicted(a, peak(a) * of_pressure)


@jax.jit  # otherwise each operation is compiled separately
def _alpha_N(response: Response, alpha: Array, t: Array) -> Array:
    return response.mean_response(alpha, t, t)


def _round(A: np.ndarray) -> tuple[float, float]:
    """Return the integrals of A g and of A g J_0(z) over z, with A given at ``Z``."""
    centre, edge = _round_weights()
    return float(A @ centre), float(A @ edge)


@functools.cache
def _round_weights() -> tuple[np.ndarray, np.ndarray]:
    """Return the weights of A in the integrals of A g and of A g J_0(z)."""
    from scipy.special import j0

    with np.errstate(all="ignore"):
        g = np.where(Z < SERIES_BELOW, 1.0 / 3.0, (np.sin(Z) - Z * np.cos(Z)) / Z**3)
    return g * WEIGHTS, g * j0(Z) * WEIGHTS


def _line(A: np.ndarray, least: float) -> tuple[float, float]:
    """Return the integrals of A g and of A g cos(z) over z >= least for a roller, with A given at ``Z``."""
    from scipy.special import j1

    g = np.where(least > Z, 0.0, j1(Z) / Z**2)
    return float(np.sum(A * g * WEIGHTS)), float(np.sum(A * g * np.cos(Z) * WEIGHTS))


def _edge_pressure(
    A: np.ndarray, depth: Callable[[float], float], a: float, value: float, loaded: bool
) -> float:
    """Return the pressure [Pa] at the edge of a disc of radius a that touches everywhere, with A given at ``Z``.

    It is extrapolated from the two outermost rings, so that it is exact on a bed of springs. depth: profile [m] as a
    function of radius; value: load [N], or the approach [m].
    """
    middles, areas, pressures, displacements = _rings()
    one_ring = a * (displacements * (A * WEIGHTS)) @ pressures.T
    if not np.any(one_ring):  # rigid for such short waves: contact is at the centre only
        return -np.inf
    one_ring += RIDGE * np.trace(one_ring) * np.eye(RINGS)
    shape = np.array([depth(a * r) for r in middles])
    per_approach, of_shape = np.linalg.solve(one_ring, np.stack([np.ones(RINGS), shape], 1)).T
    if loaded:
        value = (value / a**2 + areas @ of_shape) / (areas @ per_approach)
    pressure = value * per_approach - of_shape
    return float(1.5 * pressure[-1] - 0.5 * pressure[-2])


@functools.cache
def _rings() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the radii of the middles of the rings within 1 (m,), their areas (m,), the transforms of unit pressure on each
    of them at ``Z``, divided by z, (m, z), and J_0 at their middles (m, z)."""
    from scipy.special import j0, j1

    ends = np.linspace(0.0, 1.0, RINGS + 1)
    middles = (ends[1:] + ends[:-1]) / 2.0
    discs = ends[:, None] * j1(ends[:, None] * Z) / Z * np.exp(-((Z / SHARPEST) ** 2))
    return middles, np.pi * np.diff(ends**2), np.diff(discs, axis=0), j0(middles[:, None] * Z)
