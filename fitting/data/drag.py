"""Viscous drag on a cantilever in liquid, from the baselines of approach and retraction.

    measured force = force on the sample + b d(depth)/dt

The drag bends a lever that moves through a liquid like a force on its tip, upwards in the approach and downwards in the
retraction, in proportion to the velocity of the tip (J. Alcaraz et al., Langmuir 18, 716, 2002). Far from the sample both
baselines are straight lines over depth with the same slope, whose distance is b times the difference of the velocities. A
drift of the deflection between approach and retraction cannot be told from drag, and b is taken as constant, although it
increases near the sample.
"""

from typing import Any, NamedTuple

import numpy as np

from fitting.data.contact import baseline, signs
from fitting.data.segments import smooth

FAR = 0.4  # part of the way to a load of ``RISEN`` times the largest, from its beginning, that is taken as baseline
RISEN = 0.15
LEAST = 10  # fewest points of a baseline
BLOCKS = 10  # of each baseline, for the error of its mean with correlated noise
DEGREES = 2 * BLOCKS - 3  # of freedom of the standard deviation
UNTIMED = (
    "the file has no times: the points are numbered in their place"  # note of a curve that has no velocity
)
SMOOTH = 200  # a velocity is the slope of a line through this part of a segment, on either side


class Drag(NamedTuple):
    """Drag coefficient b and its standard deviation sd [N s/m]; velocity [m/s] of the tip in the approach."""

    coefficient: float
    sd: float
    velocity: float


def find_drag(data: Any) -> Drag:
    """Return the drag that the baselines of an ``IndentationData`` have; ValueError without two baselines, or times."""
    _check_times(data)
    branches = {name: np.flatnonzero(data.segments == name) for name in ("approach", "retract")}
    if any(some.size < LEAST for some in branches.values()):
        raise ValueError("drag: expected a curve with approach and retraction, got one without")
    inward, pushed = _signs(data)
    t, load, depth = data.t, pushed * data.load, inward * data.depth
    first = branches["approach"]
    force = smooth(load[first]) - baseline(load[first])
    begin = max(depth[some].min() for some in branches.values())
    end = begin + FAR * (depth[first][np.argmax(force >= RISEN * force.max())] - begin)
    places = [some[(depth[some] >= begin) & (depth[some] <= end)] for some in branches.values()]
    speeds = [float(np.polyfit(t[some], depth[some], 1)[0]) if some.size >= LEAST else 0.0 for some in places]
    if not speeds[0] > 0.0 > speeds[1]:
        raise ValueError(
            f"drag: expected baselines of at least {LEAST} points in approach and retraction, got {places[0].size} and"
            f" {places[1].size} points with {speeds[0]:.3g} and {speeds[1]:.3g} m/s"
        )
    coefficient, sd = _offset([depth[some] for some in places], [load[some] for some in places], speeds)
    return Drag(coefficient, sd, speeds[0])


def without(data: Any, coefficient: float) -> np.ndarray:
    """Return the load (n,) [N] of an ``IndentationData`` without a drag [N s/m]; ValueError where it has no times."""
    _check_times(data)
    inward, pushed = _signs(data)
    return data.load - inward * pushed * coefficient * tip_velocity(data)


def _check_times(data: Any) -> None:
    """Raise ValueError for numbered points, whose velocity is not known."""
    if UNTIMED in data.notes:
        raise ValueError("drag: expected a curve with times, got points that are numbered in their place")


def _signs(data: Any) -> tuple[int, int]:
    """Return the signs of depth and load in the approach."""
    some = data.segments != "retract"
    load, depth = data.load[some], data.depth[some]
    return signs(load - baseline(load), depth)


def _offset(depths: list[np.ndarray], loads: list[np.ndarray], speeds: list[float]) -> tuple[float, float]:
    """Return the coefficient of the velocity in parallel lines over depth, and its standard deviation, which sums the
    residuals over blocks and thus allows for their correlation."""
    x = np.concatenate(depths)
    v = np.repeat(speeds, [one.size for one in depths])
    A = np.stack([np.ones(x.size), (x - x.mean()) / (np.ptp(x) or 1.0), v / speeds[0]], -1)
    inverse = np.linalg.pinv(A)
    y = np.concatenate(loads)
    found = inverse @ y
    parts = inverse[2] * (y - A @ found)
    cuts = [np.array_split(one, BLOCKS) for one in np.split(parts, [depths[0].size])]
    sums = np.array([block.sum() for branch in cuts for block in branch])
    count = sums.size
    return found[2] / speeds[0], float(np.sqrt(np.sum(sums**2) * count / DEGREES)) / speeds[0]


def tip_velocity(data: Any) -> np.ndarray:
    """Return the rate of the measured depth (n,) [m/s]: slopes of lines through neighbouring points of each segment."""
    segments = data.segments
    cuts = np.flatnonzero(segments[1:] != segments[:-1]) + 1
    parts = np.split(np.arange(data.t.size), cuts)
    return np.concatenate([_slopes(data.t[part], data.depth[part]) for part in parts])


def _slopes(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the slopes (n,) of lines through the points at most n/``SMOOTH`` places away; 0 where time stands still."""
    n, reach = t.size, max(t.size // SMOOTH, 3)
    low, high = np.maximum(np.arange(n) - reach, 0), np.minimum(np.arange(n) + reach + 1, n)
    t, y = t - t.mean(), y - y.mean()
    sums = [np.concatenate([[0.0], np.cumsum(q)]) for q in (t, y, t * y, t * t)]
    T, Y, TY, TT = ((total[high] - total[low]) / (high - low) for total in sums)
    spread = TT - T * T
    moving = spread > 1e-12 * np.max(TT, initial=0.0)
    return np.where(moving, (TY - T * Y) / np.where(moving, spread, 1.0), 0.0)
