"""Load over approach of an adhesive ball on an elastic half-space: Johnson, Kendall and Roberts, and Maugis.

With E* = 2/((1 - nu)/G + C_ball), K = 4 E*/3 and the work of adhesion w, in units of (pi w R^2/K)^(1/3) for radii, pi w R
for loads and (pi^2 w^2 R/K^2)^(1/3) for approaches (D. Maugis, J. Colloid Interface Sci. 150 (1992) 243):

    lambda a^2/2 [q + (q^2 - 1) t] + 4 lambda^2 a/3 [q t - m + 1] = 1,   q = sqrt(m^2 - 1),   t = arctan q,
    P = a^3 - lambda a^2 [q + m^2 t],   approach = a^2 - 4/3 lambda a q,   lambda = 2 s0 (R/(pi w K^2))^(1/3),

for contact up to the radius a and Dugdale's attraction s0 up to the radius m a. In the limit of short range (JKR) P = a^3 -
a sqrt(6 a) and approach = a^2 - 2/3 sqrt(6 a), which is solved in closed form: a = z^2 with z^4 - c z = approach, c = 2/3
sqrt(6) (``largest_root``).

Under a given approach the stable branch has the larger radius. It ends where the approach is least; below, the curve goes on
with that radius, dP/d(approach) = 2 E* a, so that a fit can pass through parameters whose branch ends too early.
"""

import functools
import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.data.contact import sample_noise
from fitting.models.thin_layer import Base, clenshaw, paraboloid_terms
from jaxcontact._support.prefixes import told_apart

NECK = 2.0 / 3.0 * math.sqrt(6.0)  # c of the equation of z
RADII = 500  # points of the branch between which it is interpolated, of relative error 1e-5
COARSE = 400  # radii among which the end of the branch is sought
LEAST = 1e-3  # smallest radius of contact
BISECTIONS = 60
SMALLEST, LARGEST = 1e-9, 1e9  # of q


class JKR(NamedTuple):
    """An elastic half-space of shear modulus G [Pa] and a work of adhesion [J/m2] of short range."""

    G: float
    work: float


class MaugisDugdale(NamedTuple):
    """An elastic half-space of shear modulus G [Pa], a work of adhesion [J/m2] and the strength [Pa] of Dugdale's law."""

    G: float
    work: float
    strength: float


def load_at(approach: Array, modulus: Array, work: Array, radius: float, strength: Array | None) -> Array:
    """Return the load [N] (n,) of a contact at approaches (n,) [m]; modulus: E* [Pa]; strength: None for JKR."""
    K = 4.0 * modulus / 3.0
    depth = jnp.cbrt(jnp.pi**2 * work**2 * radius / K**2)
    parameter = None if strength is None else 2.0 * strength * jnp.cbrt(radius / (jnp.pi * work * K**2))
    return jnp.pi * work * radius * scaled_load(approach / depth, parameter)


@jax.custom_jvp
def largest_root(d: Array, k: Array) -> Array:
    """Return the largest real root z of z^4 - k z = d, for k >= 0 and a d at which there is one; not for d = k = 0.

    With u^3 + 4 d u = k^2, the resolvent, z^4 - k z - d = (z^2 - sqrt(u) z + v) (z^2 + sqrt(u) z + w); of u = A - B, A B =
    4 d/3, A^3 - B^3 = k^2, the form k^2/S, S = A^2 + A B + B^2, is free of cancellation.
    """
    A = jnp.cbrt(0.5 * k**2 + jnp.sqrt(jnp.maximum(0.25 * k**4 + (4.0 / 3.0 * d) ** 3, 0.0)))
    B = 4.0 / 3.0 * d / A
    S = A**2 + A * B + B**2
    u = k**2 / S
    return 0.5 * (jnp.sqrt(u) + jnp.sqrt(jnp.maximum(2.0 * jnp.sqrt(S) - u, 0.0)))


@largest_root.defjvp
def _slope_of_root(at: tuple[Array, Array], change: tuple[Array, Array]) -> tuple[Array, Array]:
    (d, k), (dd, dk) = at, change
    z = largest_root(d, k)
    # infinite where z is a double root
    return z, (dd + z * dk) / jnp.maximum(4.0 * z**3 - k, 1e-6 * k)


def scaled_load(approach: Array, parameter: Array | None) -> Array:
    """Return the load (n,) at approaches (n,), in the units of the module; parameter: lambda, None for JKR."""
    if parameter is None:
        end = 6.0 ** (-1.0 / 3.0)
        beyond = approach - (end**2 - NECK * math.sqrt(end))
        z = largest_root(jnp.where(beyond > 0.0, approach, 1.0), jnp.asarray(NECK))
        line = end**3 - math.sqrt(6.0 * end**3) + 1.5 * end * beyond
        return jnp.where(beyond > 0.0, z**6 - math.sqrt(6.0) * z**3, line)
    largest = jnp.sqrt(jnp.maximum(jnp.max(approach), 0.0) + 2.0) + 2.0
    end = jax.lax.stop_gradient(_end(parameter))
    radii = end + (jax.lax.stop_gradient(largest) - end) * jnp.linspace(0.0, 1.0, RADII)
    loads, approaches = _contact(radii, parameter)
    beyond = approach - approaches[0]
    # the approach is quadratic in the radius at the end of the branch
    way = lambda d: jnp.sqrt(jnp.maximum(d, 1e-12))
    inside = jnp.interp(way(beyond), way(approaches - approaches[0]), loads)
    return jnp.where(beyond > 0.0, inside, loads[0] + 1.5 * end * beyond)


def largest_tension(modulus: Array, work: Array, radius: float, strength: Array | None) -> Array:
    """Return the largest tension [N] of the stable branch under a given approach; arguments as of ``load_at``.

    It is 3/2 pi w R in the limit of JKR. The radius of contact at which the load is least is held constant in derivatives,
    which is exact, as the derivative of the load by the radius is zero there or the radius is that of the end of the branch.
    """
    if strength is None:
        return 1.5 * jnp.pi * work * radius
    parameter = 2.0 * strength * jnp.cbrt(radius / (jnp.pi * work * (4.0 * modulus / 3.0) ** 2))
    end = jax.lax.stop_gradient(_end(parameter))
    radii = end * jnp.geomspace(1.0, 4.0 / end, RADII)
    for _ in range(2):  # a grid of radii, and one between the neighbours of its best
        k = jnp.argmin(jax.lax.stop_gradient(_contact(radii, parameter)[0]))
        radii = jnp.linspace(radii[jnp.maximum(k - 1, 0)], radii[jnp.minimum(k + 1, RADII - 1)], RADII)
    return -jnp.pi * work * radius * jnp.min(_contact(jax.lax.stop_gradient(radii), parameter)[0])


def _end(parameter: Array) -> Array:
    """Return the radius at which the stable branch ends."""
    radii = jnp.geomspace(LEAST, 2.0, COARSE)
    return radii[jnp.argmin(_contact(radii, parameter)[1])]


def _contact(a: Array, parameter: Array) -> tuple[Array, Array]:
    """Return load and approach (k,) of contacts of radius a (k,)."""
    q = _outer(a, parameter)
    load = a**3 - parameter * a**2 * (q + (1.0 + q**2) * jnp.arctan(q))
    return load, a**2 - 4.0 / 3.0 * parameter * a * q


def _outer(a: Array, parameter: Array) -> Array:
    """Return q (k,) by bisection of its logarithm, with a last step of Newton's method that carries the derivatives."""

    def missed(q: Array, a: Array, parameter: Array) -> Array:
        t = jnp.arctan(q)
        far = parameter * a**2 / 2.0 * (q + (q**2 - 1.0) * t)
        # m - 1 without cancellation
        return far + 4.0 * parameter**2 * a / 3.0 * (q * t - q**2 / (1.0 + jnp.sqrt(1.0 + q**2))) - 1.0

    def halved(_: int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        low, high = ends
        middle = 0.5 * (low + high)
        small = missed(jnp.exp(middle), *held) < 0.0
        return jnp.where(small, middle, low), jnp.where(small, high, middle)

    held = jax.lax.stop_gradient((a, parameter))
    ends = jnp.full_like(a, jnp.log(SMALLEST)), jnp.full_like(a, jnp.log(LARGEST))
    q = jnp.exp(jax.lax.fori_loop(0, BISECTIONS, halved, ends)[0])
    slope = jax.vmap(jax.grad(missed), (0, 0, None))(q, *held)
    return q - missed(q, a, parameter) / slope


# Load over approach of an adhesive ball on an elastic film on an elastic base, for an attraction of short range.
#
# The Abel transform g of the pressure of a contact of radius a is linear in the approach and in 1/R
# (``thin_layer.py``). With adhesion it does not vanish at the edge: there g = -sqrt(pi A a w), with the work of
# adhesion w and A = (1 - nu)/G of the film plus that of the ball, since g(a)^2 is the energy release rate of the edge
# as a crack, and an edge sees the surface alone. On a half-space this is the theory of K. L. Johnson, K. Kendall, A.
# D. Roberts, Proc. R. Soc. Lond. A 324 (1971) 301. With f, F of the right side 1 and b, B of tau^2 (values at the
# edge and integrals),
#
#     approach = (b a^2/R - sqrt(pi A a w))/f,      load = 4 a/A (F approach - B a^2/R).
#
# The logarithms of f, b, F and B are Chebyshev series in log(1 + s a/h), with s of the size of 1 + G/G_base.


FILM_RADII = 500  # of contact, between which the branch is interpolated
FILM_LEAST = 1e-3  # smallest radius over the largest
NODES, DEGREE = 40, 30  # radii that are solved, and degree of the series
SPACING = 0.125  # of log G, between which the series are cubic
STEP = 1e-30  # of log G, imaginary


class FilmOnBase(NamedTuple):
    """An elastic film: thickness [m]; modulus G [Pa] and Poisson's ratio of the base."""

    thickness: float
    base: float
    base_nu: float


class Extent(NamedTuple):
    """Range of the series: the largest a/h, and s."""

    widest: float
    stretch: float


class FilmSeries(NamedTuple):
    """Series of the four terms (4, m) and their derivatives with respect to log G."""

    values: np.ndarray
    slopes: np.ndarray


def series_of(log_G: float, nu: float, own: float, film: FilmOnBase, extent: Extent) -> FilmSeries:
    """Return the series for the logarithm of the film's shear modulus [Pa]; own: (1 - nu)/G [1/Pa] of the ball.

    They are cubic in log G between multiples of ``SPACING``, with values and derivatives there.
    """
    k, t = divmod(log_G / SPACING, 1.0)
    (y0, m0), (y1, m1) = (_solved(int(k) + i, nu, own, film, extent) for i in (0, 1))
    rise, m0, m1 = y1 - y0, SPACING * m0, SPACING * m1
    bend, twist = 3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise
    values = y0 + t * (m0 + t * (bend + t * twist))
    return FilmSeries(values, (m0 + t * (2.0 * bend + 3.0 * t * twist)) / SPACING)


@functools.lru_cache(maxsize=512)
def _solved(k: int, nu: float, own: float, film: FilmOnBase, extent: Extent) -> FilmSeries:
    """Return the series for log G = k ``SPACING``."""
    G, moved = math.exp(k * SPACING), 1.0 + 1j * STEP
    base = Base(G / film.base * moved, film.base_nu, own * G / (1.0 - nu) * moved)
    x = np.append(-1.0, -np.cos(np.pi * np.arange(1, NODES + 1) / NODES))
    ratios = np.expm1(0.5 * (x + 1.0) * math.log1p(extent.stretch * extent.widest)) / extent.stretch
    terms = np.array([paraboloid_terms(ratio, nu, base) for ratio in ratios[1:]])
    logs = np.log(np.concatenate([np.array([[1.0, 1.0, 1.0, 1.0 / 3.0]]), terms]))
    fit = lambda y: np.polynomial.chebyshev.chebfit(x, y, DEGREE).T
    return FilmSeries(fit(logs.real), fit(logs.imag / STEP))


def film_load_at(
    approach: Array,
    change: Array,
    series: FilmSeries,
    body: tuple[Array, Array, Array],
    size: tuple[Array, Extent],
) -> Array:
    """Return the load [N] (n,) at approaches (n,) [m].

    change: of log G from that of the series; body: A [1/Pa], the work of adhesion [J/m2] and the ball's radius [m]; size:
    thickness [m] and range of the series.
    """
    values = jnp.asarray(series.values) + change * jnp.asarray(series.slopes)
    largest = size[0] * size[1].widest
    of = functools.partial(_film_contact, values, body, size)
    coarse = largest * jnp.geomspace(FILM_LEAST, 1.0, FILM_RADII)
    end = jax.lax.stop_gradient(coarse[jnp.argmin(of(coarse)[1])])
    radii = end + (largest - end) * jnp.linspace(0.0, 1.0, FILM_RADII) ** 2
    loads, approaches = of(radii)
    beyond = approach - approaches[0]
    scale = jax.lax.stop_gradient(jnp.max(jnp.abs(approaches)))
    # the approach is quadratic in the radius at the end of the branch
    way = lambda d: jnp.sqrt(jnp.maximum(d / scale, 1e-12))
    inside = jnp.interp(way(beyond), way(approaches - approaches[0]), loads)
    stiffness = jax.lax.stop_gradient((loads[1] - loads[0]) / (approaches[1] - approaches[0]))
    return jnp.where(beyond > 0.0, inside, loads[0] + jnp.abs(stiffness) * beyond)


def film_largest_tension(
    change: Array, series: FilmSeries, body: tuple[Array, Array, Array], size: tuple[Array, Extent]
) -> Array:
    """Return the largest tension [N] of the stable branch under a given approach; arguments as of ``load_at``.

    The radius of contact at which the load is least is held constant in derivatives.
    """
    values = jnp.asarray(series.values) + change * jnp.asarray(series.slopes)
    largest = size[0] * size[1].widest
    of = functools.partial(_film_contact, values, body, size)
    coarse = largest * jnp.geomspace(FILM_LEAST, 1.0, FILM_RADII)
    loads, approaches = jax.lax.stop_gradient(of(coarse))
    first = jnp.argmin(approaches)  # below this radius contacts are not stable
    k = jnp.argmin(jnp.where(jnp.arange(FILM_RADII) >= first, loads, jnp.inf))
    near = coarse[jnp.maximum(k - 1, first)], coarse[jnp.minimum(k + 1, FILM_RADII - 1)]
    return -jnp.min(of(jax.lax.stop_gradient(jnp.linspace(*near, FILM_RADII)))[0])


def _film_contact(
    values: Array, body: tuple[Array, Array, Array], size: tuple[Array, Extent], a: Array
) -> tuple[Array, Array]:
    """Return load and approach (k,) of contacts of radius a (k,)."""
    (A, work, radius), (thickness, (widest, stretch)) = body, size
    x = 2.0 * jnp.log1p(stretch * a / thickness) / jnp.log1p(stretch * widest) - 1.0
    flat, ball, force, curved = (jnp.exp(clenshaw(row, x)) for row in values)
    approach = (ball * a**2 / radius - jnp.sqrt(jnp.pi * A * a * work)) / flat
    return 4.0 * a / A * (force * approach - curved * a**2 / radius), approach


# Adhesive contact of a ball with a viscoelastic half-space: the theory of Johnson, Kendall and Roberts (JKR).
#
# An elastic contact of radius a under the load P, E* = 2 G/(1 - nu) [Pa] and the work of adhesion w [J/m2], is that
# of Hertz minus that of a flat punch retracted until the energy release rate at the edge equals w (K. L. Johnson, K.
# Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301; K. L. Johnson, Contact Mechanics, 1985, sec. 5.5):
#
#     depth = a^2/R - sqrt(2 pi a w/E*),     P = 2 E* (a depth - a^3/(3 R)).
#
# While a grows, each point comes into contact once and stays in contact, so the correspondence of Lee and Radok
# (``halfspace.py``) holds with any history of depth and a, and gives P = int 2 G(t - s)/(1 - nu) d(a depth - a^3/(3
# R))(s). The shape of the gap outside is the elastic one of this depth and a. The effective compliance at the edge
# follows from the work of the adhesive forces while the gap closes there: E* is that of J(t_r), t_r the time in which
# the edge advances by the length of the adhesive zone (R. A. Schapery, Int. J. Fract. 39 (1989) 163; C.-Y. Hui, J. M.
# Baney, E. J. Kramer, Langmuir 14 (1998) 6570; J. A. Greenwood, K. L. Johnson, J. Colloid Interface Sci. 296 (2006)
# 284). Forces of short range close the gap at once, which gives J(0), the value used here. The opposite limit is
# J(t), because t_r is no longer than the contact has lasted.
#
# None of this holds for a receding edge. Scaled, with alpha = a^2/(R depth_unit), y = alpha^(3/4) and the neck kappa
# = sqrt(6 pi w R/load_unit J), J of the edge:
#
#     int J dP = y^2 - kappa y,     depth = alpha - 2/3 kappa alpha^(1/4).


FALL = 0.02  # fraction of the largest depth or area by which a growing contact may fall
FEW, FEW_SHARE = 5, 0.02  # points that may be out of contact, as a number and as a fraction of all
SURE = 5.0  # significant fall of the load in standard deviations of its noise
RANGE = 0.5e-9  # range of the adhesive forces [m], for Tabor's parameter
ZONES = 3.0  # zone lengths by which an edge at rest creeps in such a time (computed with a cohesive zone)
SHORT = 5.0  # Tabor's parameter above which the JKR limit applies
WIDE = 0.4  # contact radius over that of the ball up to which the ball is nearly a paraboloid


def root(square: Array) -> Array:
    """Return the square root, 0 with slope 0 at and below zero."""
    return jnp.where(square > 0.0, jnp.sqrt(jnp.where(square > 0.0, square, 1.0)), 0.0)


def under_load(total: Array, neck: Array) -> tuple[Array, Array]:
    """Return scaled (depth, alpha), (n,), from int J dP (n,); both are 0 where the load has detached the contact."""
    y = 0.5 * (neck + root(neck**2 + 4.0 * total))
    touches = y > 0.0
    safe = jnp.where(touches, y, 1.0)
    alpha = jnp.where(touches, safe ** (4.0 / 3.0), 0.0)
    return alpha - 2.0 / 3.0 * neck * jnp.where(touches, safe ** (1.0 / 3.0), 0.0), alpha


def at_depth(depth: Array, neck: Array) -> tuple[Array, Array]:
    """Return scaled (y^2 - kappa y, alpha), (n,), at depth >= 0 (n,).

    z = alpha^(1/4) is the largest root of z^4 - 2/3 kappa z = depth.
    """
    flat = (depth <= 0.0) & (neck <= 0.0)
    z = jnp.where(flat, 0.0, largest_root(jnp.where(flat, 1.0, depth), 2.0 / 3.0 * neck))
    return z**6 - neck * z**3, z**4


def check(adhesion: Any, data: Any, indenter: Any, control: str, model: type) -> float:
    """Return the work of adhesion [J/m2]; ValueError where the theory does not apply to the test."""
    known = np.ndim(adhesion) == 0 and np.asarray(adhesion).dtype.kind in "fiu"
    if not known or not 0.0 <= adhesion < math.inf:
        raise ValueError(f"adhesion: expected a work of adhesion >= 0 J/m2, got {adhesion!r}")
    if adhesion == 0.0:
        return 0.0
    if not isinstance(indenter, jc.Sphere):
        raise ValueError(f"adhesion: expected a Sphere, got {type(indenter).__name__}")
    if model is jc.KelvinVoigt:
        raise ValueError(
            "adhesion: a Kelvin-Voigt solid has J(0) = 0, for which adhesion has no effect: expected"
            " StandardLinearSolid or another"
        )
    _check_curve(float(adhesion), data, float(indenter.radius), control)
    return float(adhesion)


def _check_curve(adhesion: float, data: Any, radius: float, control: str) -> None:
    """Raise ValueError unless there is contact from the first sample on, and the contact grows."""
    load, top = data.load, int(np.argmax(data.load)) + 1
    if not load.max() > 0.0:
        raise ValueError(f"adhesion: expected a load above zero, got {load.max():g} N at most")
    pull = math.pi * adhesion * radius
    if control == "load" and load.min() < -1.5 * pull:
        raise ValueError(
            f"adhesion: expected no load below the pull-off of {adhesion:g} J/m2, {-1.5 * pull:.4g} N, got"
            f" {load.min():.4g} N"
        )
    early, dip = int(np.sum(data.depth < 0.0)), float(load[0] - load[:top].min())
    if early > max(FEW, FEW_SHARE * load.size) or dip > 2.0 / 3.0 * pull + SURE * sample_noise(load):
        raise ValueError(
            f"adhesion: expected a curve from the jump into contact on, got {early} points at a depth below zero and"
            f" a load that falls by {dip:.3g} N before it rises: leave out the earlier points"
        )
    fall = float(np.max(np.maximum.accumulate(data.depth) - data.depth))
    if control == "depth" and fall > FALL * data.depth.max():
        raise ValueError(
            f"adhesion: expected a growing contact, got a depth that falls by {fall:.3g} m: leave out the retract"
        )


def against(alpha: np.ndarray) -> tuple[str, ...]:
    """Return the reasons for rejecting a fit: alpha (n,), proportional to the contact area, falls."""
    fall = float(np.max(np.maximum.accumulate(alpha) - alpha) / np.max(alpha))
    if fall <= FALL:
        return ()
    return (
        f"the contact shrinks (area falls by {100 * fall:.1f} %): the edge recedes, for which the model"
        " of adhesion does not hold",
    )


def doubts(adhesion: float, radius: float, widest: float, modulus: float, lives: float) -> tuple[str, ...]:
    """Return notes on deviations of a fit from JKR theory.

    radius of the ball and widest contact [m]; modulus: instantaneous E* [Pa]; lives: duration of the test in times of
    doubling of J(0). Tabor's parameter (R w^2/(E*^2 z^3))^(1/3), z the range of the forces (D. Tabor, J. Colloid
    Interface Sci. 58 (1977) 2), is large where the range is short compared with the elastic displacement. An edge at
    rest creeps by a few lengths pi/4 E* z^2/w of Dugdale's zone in each creep time of the material.
    """
    tabor = (radius * adhesion**2 / (modulus**2 * RANGE**3)) ** (1.0 / 3.0)
    notes = []
    if tabor < SHORT:
        notes.append(
            f"Tabor's parameter is {told_apart(tabor, SHORT)}"
            f" for forces of range {RANGE * 1e9:g} nm: below {SHORT:g} JKR overestimates"
            " adhesion"
        )
    crept = ZONES * 0.25 * math.pi * modulus * RANGE**2 / adhesion * lives / widest
    if crept > FALL:
        notes.append(
            f"the edge may creep by a further {100 * crept:.2g} % of the contact, which the model"
            " neglects: see the slow edge"
        )
    if widest > WIDE * radius:
        notes.append(
            f"the contact radius is {told_apart(widest / radius, WIDE)}"
            f" of that of the ball: beyond {WIDE:g} JKR does not hold for a ball,"
            " and surface tension may matter"
        )
    return tuple(notes)
