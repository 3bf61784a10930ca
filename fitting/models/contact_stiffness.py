"""Stiffness dF/d depth of an elastic contact with a half-space or with a layer bonded to a base.

On a half-space S = 4 G a/(1 - nu) at the contact radius a (G. M. Pharr, W. C. Oliver, F. R. Brotzen, J. Mater. Res. 7
(1992) 613), and on a layer that times the factor of a flat punch of the radius a (``layered_contact.py``), for any tip
of revolution, also after plastic flow. An elastic tip adds (1 - nu)/G to the compliance at every wavenumber.

The contact radius follows from the depth d of an elastic contact, on a half-space a^2 = R d of a ball and a = (2/pi) d
tan(half-angle) of a cone, or from the contact depth of W. C. Oliver, G. M. Pharr (J. Mater. Res. 7 (1992) 1564),

    h_c = d - epsilon load/S,     pi a^2 = A(h_c).
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

import jaxcontact as jc
from fitting.models.layered_contact import Base, contact_factors

WIDEST = 20.0  # contact radius over the thickness
NODES = 48  # contact radii that are solved
ROOM = (0.4, 2.0)  # factors by which their range exceeds that of a contact with a half-space
STEP = 1e-30  # of log G, imaginary
KINDS = {jc.Sphere: "ball", jc.Cone: "cone", jc.FlatPunch: "punch"}


@dataclasses.dataclass(frozen=True, eq=False)
class Tip:
    """The tip and the points at which it is in contact.

    indenter; kind: "ball", "cone" or "punch"; places (n,): depths [m] of an elastic contact, or contact radii [m];
    known: whether they are radii; beta: factor on the stiffness of a tip that is not of revolution.
    """

    indenter: Any
    kind: str
    places: np.ndarray
    known: bool
    beta: float

    @property
    def radii(self) -> np.ndarray:
        """Contact radii (n,) [m], on a half-space where they are not known."""
        if self.known or self.kind == "punch":
            return self.places
        if self.kind == "ball":
            return np.sqrt(float(self.indenter.radius) * self.places)
        return 2.0 / np.pi * self.places * math.tan(float(self.indenter.half_angle))

    @property
    def power(self) -> float:
        """Power of the thickness in the place of a given ratio of contact radius and thickness."""
        return 2.0 if self.kind == "ball" and not self.known else 1.0

    def place(self, found: dict[str, tuple[complex, complex]], ratio: float, thickness: float) -> complex:
        """Return the place at a contact radius over the thickness, from its ``contact_factors``."""
        if self.known or self.kind == "punch":
            return ratio * thickness
        chi = found[self.kind][0]
        if self.kind == "ball":
            return (chi * thickness) ** 2 / float(self.indenter.radius)
        return chi * thickness / math.tan(float(self.indenter.half_angle))


class Coated(NamedTuple):
    """The indented body: Poisson's ratio, and the modulus [Pa] and Poisson's ratio of the base of a layer.

    base: None for a half-space, inf for a rigid base; tip: compliance (1 - nu)/G of the tip [1/Pa].
    """

    nu: float
    base: float | None
    base_nu: float
    tip: float


def log_stiffness(G: float, thickness: float, body: Coated, tip: Tip) -> tuple[np.ndarray, np.ndarray]:
    """Return log S [N/m] at the places (n,), and its derivatives (n, 2) with respect to log G and log thickness; nan
    where the contact is wider than ``WIDEST`` thicknesses."""
    own = G / (1.0 - body.nu) * body.tip
    if body.base is None:
        log = np.log(4.0 * tip.beta * G * tip.radii / ((1.0 - body.nu) * (1.0 + own)))
        return log, np.stack([np.full(log.size, 1.0 / (1.0 + own)), np.zeros(log.size)], -1)
    place, stiffness = _nodes(G, thickness, body, tip)
    x, order = place.real, np.argsort(place.real)
    value = CubicSpline(x[order], stiffness.real[order], extrapolate=False)
    rise = value(x, 1)
    moved = (stiffness.imag - rise * place.imag) / STEP
    at = np.log(tip.places)
    by_G = CubicSpline(x[order], moved[order], extrapolate=False)(at)
    return value(at), np.stack([by_G, 1.0 - tip.power * value(at, 1)], -1)


def _nodes(G: float, thickness: float, body: Coated, tip: Tip) -> tuple[np.ndarray, np.ndarray]:
    """Return the logarithms of place and stiffness at ``NODES`` contact radii, with a complex step of log G."""
    own = G * (1.0 + 1j * STEP)
    share = (1.0 - body.nu) / own
    assert body.base is not None
    base = Base(own / body.base if math.isfinite(body.base) else 0.0, body.base_nu, body.tip / share)
    ends = np.array([tip.radii.min(), tip.radii.max()]) / thickness * ROOM
    ratios = np.geomspace(ends[0], min(ends[1], WIDEST), NODES)
    found = [contact_factors(ratio, body.nu, base) for ratio in ratios]
    places = [tip.place(one, ratio, thickness) for one, ratio in zip(found, ratios, strict=True)]
    factor = np.array([one["punch"][1] for one in found])
    stiffness = 4.0 * tip.beta * ratios * thickness * factor / (share * (1.0 + base.tip))
    return np.log(np.array(places, dtype=complex)), np.log(stiffness)


def contact_area(coefficients: Sequence[float], depth: np.ndarray) -> np.ndarray:
    """Return the area function c0 d^2 + c1 d + c2 d^(1/2) + c3 d^(1/4) + ... [m2] at contact depths (n,) [m]."""
    powers = np.append(2.0, 2.0 ** -np.arange(len(coefficients) - 1.0))
    return np.asarray(depth[:, None] ** powers @ np.asarray(coefficients, dtype=float))
