"""Where an indentation curve enters contact: the zero of time and depth, and the zero and signs of the load.

Before contact the load is constant. After it, as long as it is small, it follows the indenter:
load = b + c (depth - d)^power, 3/2 for a ball (``probe.py``), of which a creeping material alters c, not the power.
Least squares over the points before contact and the first of the load together give b, c and d.
"""

from typing import NamedTuple

import numpy as np
import scipy

from fitting.segments import noise

ONSET = 0.15  # share of the largest load up to which the law is fitted
SCAN = 61  # depths tried for the contact
LEAST = 5  # first points, whose median is the load in air
PRESENT = 0.5  # change of the load over its first value, at most, if the curve begins in contact
SURE = 5.0  # standard deviations of its noise by which the depth changes for sure
FEW = 2  # points before contact


class FirstTouch(NamedTuple):
    """t [s], depth [m]: of the first contact; load [N]: the baseline; load_sign, depth_sign: +1 or -1, which
    make compression and indentation positive; before: samples before contact. t, depth, load as measured."""

    t: float
    depth: float
    load: float
    load_sign: int
    depth_sign: int
    before: int


def find_contact(
    t: np.ndarray, load: np.ndarray, depth: np.ndarray, at: float | None = None, power: float = 1.5
) -> FirstTouch:
    """First contact of a curve that approaches, t, load, depth (n,), at depth ``at`` [m] if that is known.

    A curve that begins in contact, with the load there from the start or no way before it rises, has nothing
    before contact, and its load and depth are left as they are. So has a hold whose load changes only in its last
    samples, or while the indenter comes back.
    """
    base = float(np.median(load[:LEAST]))
    force = np.abs(load - base)
    changed = force >= ONSET * force.max()
    first = int(np.argmax(changed))
    way = depth[first] - depth[0]
    moved = abs(way) > SURE * noise(depth)
    back = way * (depth[first:][:LEAST][-1] - depth[max(first - 1, 0)]) < 0.0
    whole = FirstTouch(float(t[0]), 0.0, 0.0, 1, 1, 0)
    if at is None and (force.max() <= PRESENT * abs(base) or not moved or back or changed.sum() < LEAST):
        return whole
    depth_sign, load_sign = signs(load - base, depth)
    x, y = depth_sign * depth, load_sign * (load - base)
    top = int(np.argmax(y >= ONSET * y.max())) + 1
    point = _least_squares(x[:top], y[:top], power) if at is None else depth_sign * at
    before = int(np.flatnonzero(x[:top] <= point).max(initial=-1)) + 1
    if before < FEW and at is None:
        return whole
    offset = base + load_sign * _fit(x[:top], y[:top], point, power)[1]
    began = np.interp(point, x[before - 1 : before + 1], t[before - 1 : before + 1]) if before else t[0]
    return FirstTouch(float(began), depth_sign * point, offset, load_sign, depth_sign, before)


def signs(load: np.ndarray, depth: np.ndarray) -> tuple[int, int]:
    """(of the depth, of the load), +1 or -1: a tip moves in before the load rises, and is pushed back where
    it is deepest. load (n,) counts from its baseline.
    """
    first = int(np.argmax(np.abs(load) >= ONSET * np.abs(load).max()))
    inward = -1 if depth[first] < depth[0] else 1
    deepest = int(np.argmax(inward * depth))
    return inward, -1 if load[deepest] < 0 else 1


def _least_squares(x: np.ndarray, y: np.ndarray, power: float) -> float:
    """The depth of contact: the best of a scan, then a minimum between its neighbours."""
    trial = np.linspace(x.min(), x[-1], SCAN)
    best = int(np.argmin([_fit(x, y, point, power)[0] for point in trial]))
    low, high = trial[max(best - 1, 0)], trial[min(best + 1, SCAN - 1)]
    error = lambda share: _fit(x, y, low + share * (high - low), power)[0]
    # it stops at an absolute 1e-5
    found = scipy.optimize.minimize_scalar(error, bounds=(0.0, 1.0), method="bounded")
    return float(low + found.x * (high - low))


def _fit(x: np.ndarray, y: np.ndarray, point: float, power: float) -> tuple[float, float]:
    """(sum of squares over the range of y squared, b) of y = b + c (x - point)^power, c >= 0."""
    past, unit = np.maximum(x - point, 0.0) / (np.ptp(x) or 1.0), np.ptp(y) or 1.0
    law, y = past**power, y / unit
    mean, mid = law.mean(), y.mean()
    law -= mean
    square = np.sum(law * law)
    slope = max(np.sum(law * y) / square, 0.0) if square > 0 else 0.0
    return float(np.sum((y - mid - slope * law) ** 2)), float(mid - slope * mean) * unit


def tip_depth(
    path: str, t: np.ndarray, load: np.ndarray, height: np.ndarray, spring_constant: float | None
) -> tuple[np.ndarray, str]:
    """Depth of the tip of a cantilever, depth = z - load/k with z the way of its base towards the sample.

    The sign of z is that of the way before the load rises.

    Args:
        path: for messages.
        t: (n,) [s].
        load: (n,) [N].
        height: (n,) [m] of the base, either sign.
        spring_constant: k [N/m].

    Returns:
        (depth (n,) [m] from the first sample on, a note).

    Raises:
        ValueError: no spring constant, or not positive.
    """
    if spring_constant is None or not spring_constant > 0:
        raise ValueError(
            f"{path}: no depth, and a height needs the cantilever's spring_constant= > 0 [N/m]; "
            f"got {spring_constant!r}"
        )
    force = load - np.median(load[:LEAST])
    sign, _ = signs(force, height)
    depth = sign * (height - height[0]) - force / spring_constant
    return depth, f"depth from the height and load/k, k = {spring_constant:g} N/m, zero at the first sample"
