"""Checks of a case with adhesion before it runs: the Tabor number, and the cells across the contact and its edge.

The contact of a ball is estimated by the theory of Johnson, Kendall and Roberts (K. L. Johnson, Contact Mechanics, 1985,
section 5.5) on two half-spaces, of the substrate and of the material at the surface, at the first and at the last time.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np
from jax import Array
from scipy.optimize import brentq

from jaxcontact._support.prefixes import told_apart
from jaxcontact.files.case_file import Case
from jaxcontact.indenters.shapes import Sphere
from jaxcontact.inputs.controls import Load
from jaxcontact.inputs.layers import checked_body
from jaxcontact.response.limits import BodyLimits, limits_of
from jaxcontact.results.notes import FEW_CELLS, FEW_COHESIVE

LONG, SHORT = BodyLimits.long_wave_compliance, BodyLimits.short_wave_compliance
COARSE = "cells across the {which} contact: fewer than {few} are too coarse; accepted: grid.n of about {n}"
WIDER = "grid.width: the contact may grow to {contact:.3g} m, found {width:.3g} m; accepted: a wider grid"


def describe_adhesion(case: Case) -> str:
    """Return the Tabor number of a ball at the first and the last time in one line; empty without adhesion or a ball."""
    law = case.motion.get("adhesion")
    if law is None or not isinstance(case.indenter, Sphere):
        return ""
    numbers = [float(law.tabor_number(case.indenter.radius, 2.0 / c)) for c in _compliances(case, SHORT)]
    at_once, at_last = (f"{number:.2g}" for number in numbers)
    values = (
        at_once
        if at_once == at_last
        else f"{at_once} at first, {at_last} with the compliance at the last time"
    )
    return f"Tabor number of the surface: {values} (short range above 5, long range below 0.1)"


def adhesion_advice(case: Case) -> Iterator[str]:
    """Warn of a grid too coarse for the attraction at the edge, or for the contact of a ball, or too narrow for it."""
    law, dx = case.motion["adhesion"], max(float(spacing) for spacing in case.grid.spacing)
    modulus = 2.0 / max(max(_compliances(case, SHORT)), 1e-300)
    cells = float(law.zone_length(modulus)) / dx
    if cells < FEW_COHESIVE:
        n = math.ceil(max(case.grid.shape) * FEW_COHESIVE / cells)
        yield (
            f"grid.n: about {told_apart(cells, FEW_COHESIVE)}"
            f" cells across the zone of attraction at the edge of contact: below"
            f" {FEW_COHESIVE} pull-off depends on the grid; accepted: grid.n of about {n} or more, or a longer range"
        )
    if not isinstance(case.indenter, Sphere):
        return
    width = min(float(width) for width in case.grid.width)
    largest = 2.0 * max(_radius(case, c) for side in (LONG, SHORT) for c in _compliances(case, side))
    if largest / dx < FEW_CELLS:
        n = math.ceil(FEW_CELLS * width / largest) if largest > 0.0 else max(case.grid.shape)
        cells = math.floor(10.0 * largest / dx) / 10.0
        yield f"grid.n: about {cells:.1f} {COARSE.format(which='largest', few=FEW_CELLS, n=n)} or more"
    if largest > width:
        yield WIDER.format(contact=largest, width=width)


def _compliances(case: Case, side: Callable[[BodyLimits, float], Array]) -> list[float]:
    """Return (1 - nu) J [1/Pa] of the substrate (``LONG``) or the surface (``SHORT``), with the ball's, first and last."""
    limits, own = limits_of(checked_body(case.body)[0]), float(case.indenter.compliance())
    return [float(side(limits, t)) + own for t in (0.0, float(case.times[-1] - case.times[0]))]


def _radius(case: Case, compliance: float) -> float:
    """Return the radius [m] of a ball's contact with a half-space under the largest load or approach; 0 without contact."""
    work, R = float(case.motion["adhesion"].work), float(case.indenter.radius)  # type: ignore[attr-defined]
    value, modulus = float(np.max(np.asarray(case.control.value))), 2.0 / max(compliance, 1e-300)
    if isinstance(case.control, Load):
        pull = 3.0 * math.pi * work * R
        if value < -pull / 2.0:
            return 0.0
        apparent = value + pull + math.sqrt(max(2.0 * pull * value + pull**2, 0.0))
        return (0.75 * R * apparent / modulus) ** (1.0 / 3.0)
    neck = 2.0 * math.pi * work / modulus
    least = (R * math.sqrt(neck) / 4.0) ** (2.0 / 3.0)  # of the lowest approach
    approach = lambda a: a**2 / R - math.sqrt(neck * a)
    if value < approach(least):
        return 0.0
    high = 4.0 * (least + math.sqrt(R * abs(value)))
    return float(brentq(lambda a: approach(a) - value, least, high))
