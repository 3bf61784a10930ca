"""Indenter geometry: P = size depth^power/((1 - nu) J) on a half-space of compliance J.

    ball of radius R            P = 8 sqrt(R)/3 depth^(3/2)/((1 - nu) J)         (Hertz)
    cone of half-angle a        P = 4 tan(a)/pi depth^2/((1 - nu) J)             (Love; Sneddon)
    flat punch of radius R      P = 4 R depth/((1 - nu) J)                       (Boussinesq)

Source: I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47. A pyramid is replaced by the cone of equal area at every depth
(``jc.Cone.berkovich``). For a viscoelastic half-space J is replaced by the hereditary integral of Lee and Radok.
"""

import functools
import math
import operator
from collections.abc import Callable
from typing import Any, NamedTuple

import jaxcontact as jc

WIDE = 1.0 / 3.0  # contact radius over the radius of a ball
FORCE, STIFFNESS = 1.0 / 10.0, 1.0 / 6.0  # orders of ``paraboloid_note``


class Probe(NamedTuple):
    """Law of an indenter.

    power, size: of the formula in the module's docstring; widest: function from a depth [m] to the largest contact
    radius [m], also on a film; words: description; key: name of its size in the JSON, with the value.
    """

    power: float
    size: float
    widest: Callable[[float], float]
    words: str
    key: dict[str, float]


def probe_of(indenter: Any) -> Probe:
    """Return the law of an indenter; ValueError unless it is a ball, a cone or a flat punch of valid size."""
    if isinstance(indenter, jc.Cone):
        angle = float(indenter.half_angle)
        if not 0.0 < angle < 0.5 * math.pi:
            raise ValueError(f"indenter: expected a half-angle between 0 and pi/2, got {angle:g}")
        slope = math.tan(angle)
        words = f"cone of half-angle {math.degrees(angle):.4g} degrees"
        return Probe(
            2.0, 4.0 * slope / math.pi, functools.partial(operator.mul, slope), words,
            {"indenter_half_angle_rad": angle},
        )  # fmt: skip
    if not isinstance(indenter, jc.Sphere | jc.FlatPunch):
        raise ValueError(f"indenter: expected a Sphere, a Cone or a FlatPunch, got {type(indenter).__name__}")
    radius = float(indenter.radius)
    if not radius > 0:
        raise ValueError(f"indenter: expected a radius > 0, got {indenter.radius}")
    key = {"indenter_radius_m": radius}
    if isinstance(indenter, jc.FlatPunch):
        return Probe(
            1.0, 4.0 * radius, functools.partial(_constant, radius), f"flat punch of R = {radius:.4g} m", key
        )
    widest = functools.partial(_ball, radius)
    return Probe(1.5, 8.0 * math.sqrt(radius) / 3.0, widest, f"ball of R = {radius:.4g} m", key)


def _constant(radius: float, depth: float) -> float:
    """Return the contact radius [m] of a punch, which does not depend on the depth [m]."""
    return radius


def _ball(radius: float, depth: float) -> float:
    """Return the largest contact radius [m] of a ball at a depth [m]."""
    return math.sqrt(1.5 * radius * depth)


def paraboloid_note(
    indenter: Any, depth: float, order: float = FORCE, *, thickness: float | None = None
) -> tuple[str, ...]:
    """Return a note where a ball is pressed in so deep [m] that a paraboloid does not describe it, on a half-space or a
    layer of a thickness [m].

    On a half-space the fitted quantity is that of the paraboloid times 1 - order depth/R - ..., with the order 1/10 of the
    force and 1/6 of its derivative by the depth, from the exact solution of I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47.
    The contact with a bonded layer is wider, on an incompressible one by about

        a^2 = R depth (1 + 1.16 chi/(1 + 0.18 chi)),     chi = sqrt(R depth)/thickness,

    a fit to the solution in ``jaxcontact.reference.abel``.
    """
    if not isinstance(indenter, jc.Sphere) or not depth > 0.0:
        return ()
    radius = float(indenter.radius)
    share, chi = depth / radius, math.sqrt(radius * depth) / (thickness or math.inf)
    wide = math.sqrt(share * (1.0 + 1.16 * chi / (1.0 + 0.18 * chi)))
    if not wide > WIDE:
        return ()
    error = f"on a half-space the modulus is up to {100.0 * order * share:.2g} % too low"
    if thickness is None:
        return (
            f"the depth reaches {share:.2g} of the radius of the ball, for which the model has a paraboloid: {error}",
        )
    return (
        f"the contact radius reaches up to {wide:.2g} of the radius of the ball, for which the model has a paraboloid:"
        f" {error}, on a thin sample the error is not known",
    )
