"""Hydrodynamic drag on a cantilever, from the baselines of approach and retraction.

A cantilever that moves through a liquid with the speed v is bent by a force proportional to it (J. Alcaraz et al., Langmuir
18 (2002) 716), so that the baselines of approach and retraction differ:

    load = a + b t + c depth + drag v(t)      away from the contact,     v = d depth/dt.

The four numbers are fitted by least squares to both baselines. At constant speed the drag is part of the baseline of an
approach; where the speed changes during the contact, it is not, and the modulus has an error without this correction.
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from fitting.data.contact import signs
from fitting.data.indentation import IndentationData
from fitting.inference.correlation import lag_one

AWAY = 0.5  # distance of the baselines from the contact, over the largest depth below it
FEW = 10  # fewest points of each baseline
NEAR = 0.02  # points to each side from which a speed is found, as a fraction of the points of its segment
SEGMENTS = ("approach", "retract")


class Drag(NamedTuple):
    """coefficient, sd: drag over speed and its standard deviation [N s/m], > 0 against the motion in the signs of the
    file; gap: mean difference of the baselines [N]; speed (n,) of the points [m/s]."""

    coefficient: float
    sd: float
    gap: float
    speed: np.ndarray

    def subtracted(self, data: IndentationData, more: float = 0.0) -> IndentationData:
        """Return the curve without the drag, whose coefficient may be changed by ``more``."""
        return dataclasses.replace(data, load=data.load - (self.coefficient + more) * self.speed)

    @property
    def note(self) -> str:
        """A note on what was subtracted."""
        return (
            f"hydrodynamic drag {self.coefficient:.3g} N s/m (sd {self.sd:.1g}) subtracted: the baselines of approach and"
            f" retraction differ by {1e12 * self.gap:.3g} pN"
        )


def drag_of(data: IndentationData, contact: float) -> Drag:
    """Return the drag of a curve with its contact at a depth [m] in the sign of the file; ValueError without both
    baselines."""
    speed, marks = _speeds(data), data.segments
    load = data.load - np.median(data.load[: max(data.load.size // 10, 5)])
    inward, _ = signs(load, data.depth)
    below = inward * (data.depth - contact)
    away = below < -AWAY * below.max()
    sides = [away & (marks == name) for name in SEGMENTS]
    if min(side.sum() for side in sides) < FEW:
        got = " and ".join(f"{int(side.sum())}" for side in sides)
        raise ValueError(
            f"drag: expected at least {FEW} points of baseline in approach and retraction, got {got}"
        )
    on = sides[0] | sides[1]
    unit = np.array([1.0, np.ptp(data.t), np.ptp(data.depth), np.max(np.abs(speed[on])) or 1.0])
    A = np.column_stack([np.ones(on.sum()), data.t[on], data.depth[on], speed[on]]) / unit
    x, *_ = np.linalg.lstsq(A, data.load[on], rcond=None)
    off = data.load[on] - A @ x
    rho = max(lag_one(off, marks[on] == SEGMENTS[1]), 0.0)
    variance = float(off @ off) / (on.sum() - 4) * (1.0 + rho) / (1.0 - rho)
    sd = math.sqrt(variance * np.linalg.pinv(A.T @ A)[3, 3]) / unit[3]
    first, second = (float(np.mean(speed[side])) for side in sides)
    c = float(x[3] / unit[3])
    return Drag(c, sd, abs(c * (first - second)), speed)


def _speeds(data: IndentationData) -> np.ndarray:
    """Return the speeds (n,) [m/s] from points of the same segment to both sides of each."""
    marks, found = data.segments, np.zeros(data.t.size)
    for part in np.split(np.arange(data.t.size), np.flatnonzero(marks[1:] != marks[:-1]) + 1):
        reach = max(int(NEAR * part.size), 2)
        place = np.arange(part.size)
        low, high = part[np.maximum(place - reach, 0)], part[np.minimum(place + reach, part.size - 1)]
        span = data.t[high] - data.t[low]
        found[part] = np.where(
            span > 0, (data.depth[high] - data.depth[low]) / np.where(span > 0, span, 1.0), 0.0
        )
    return found
