"""Adhesive contact of a ball with a viscoelastic half-space: the theory of Johnson, Kendall and Roberts (JKR).

An elastic contact of radius a under the load P, E* = 2 G/(1 - nu) [Pa] and the work of adhesion w [J/m2], is that of
Hertz minus that of a flat punch retracted until the energy release rate at the edge equals w (K. L. Johnson, K.
Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301; K. L. Johnson, Contact Mechanics, 1985, sec. 5.5):

    depth = a^2/R - sqrt(2 pi a w/E*),     P = 2 E* (a depth - a^3/(3 R)).

While a grows, each point comes into contact once and stays in contact, so the correspondence of Lee and Radok
(``halfspace.py``) holds with any history of depth and a, and gives P = int 2 G(t - s)/(1 - nu) d(a depth - a^3/(3
R))(s). The shape of the gap outside is the elastic one of this depth and a. The effective compliance at the edge
follows from the work of the adhesive forces while the gap closes there: E* is that of J(t_r), t_r the time in which the
edge advances by the length of the adhesive zone (R. A. Schapery, Int. J. Fract. 39 (1989) 163; C.-Y. Hui, J. M. Baney,
E. J. Kramer, Langmuir 14 (1998) 6570; J. A. Greenwood, K. L. Johnson, J. Colloid Interface Sci. 296 (2006) 284). Forces
of short range close the gap at once, which gives J(0), the value used here. The opposite limit is J(t), because t_r is
no longer than the contact has lasted.

None of this holds for a receding edge. Scaled, with alpha = a^2/(R depth_unit), y = alpha^(3/4) and the neck kappa =
sqrt(6 pi w R/load_unit J), J of the edge:

    int J dP = y^2 - kappa y,     depth = alpha - 2/3 kappa alpha^(1/4).
"""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.data.segments import noise
from jaxcontact._support.prefixes import told_apart

STEPS = 30  # Newton steps from above; about ten suffice
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

    z = alpha^(1/4) is the largest root of z^4 - 2/3 kappa z = depth. Newton's method converges to it from above; its
    last step carries the derivative.
    """
    pull = 2.0 / 3.0 * neck
    flat = (depth <= 0.0) & (pull <= 0.0)
    depth, pull = jnp.where(flat, 1.0, depth), jnp.where(flat, 0.0, pull)
    above = jnp.maximum(depth, 0.0) ** 0.25 + pull ** (1.0 / 3.0)
    step = lambda z, d, k: z - (z**4 - k * z - d) / (4.0 * z**3 - k)
    fixed = jax.lax.stop_gradient((above, depth, pull))
    z = jax.lax.fori_loop(0, STEPS, lambda _, z: step(z, *fixed[1:]), fixed[0])
    z = jnp.where(flat, 0.0, step(z, depth, pull))
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
    if early > max(FEW, FEW_SHARE * load.size) or dip > 2.0 / 3.0 * pull + SURE * noise(load):
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
