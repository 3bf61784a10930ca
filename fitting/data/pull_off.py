"""Contact and pull-off of an adhesive force curve, read from the curve itself without a model of the contact.

The zero of the load is that after the pull-off, at the end of the retraction (``zeroed``). On the approach the contact
begins with the jump that brings the load to its lowest value, or, where none is seen, where the load leaves its noise and
drift. On the retraction it ends where the load, after its lowest value, has lost ``LOST`` of it: a contact of short range
that is retracted at a given depth breaks at 5/9 of the lowest load (K. L. Johnson, Contact Mechanics, 1985, section 5.5),
and under a soft spring earlier.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from fitting.data.indentation import IndentationData
from fitting.data.segments import noise

SURE = 5.0  # standard deviations of the noise by which a load differs from zero
ONSET = 0.02  # fraction of the largest load, below which the zero of the load may drift
LOST = 0.5  # fraction of the lowest load that is lost when the contact breaks
NEAR = 0.92  # fraction of the lowest load within which points determine it
TAIL = 10  # part of the retraction at its end, 1/TAIL, out of contact
FLAT = (
    0.05  # change of the load along that part, relative to the lowest load, of a curve that is out of contact
)
MEDIAN = 1.25  # standard error of a median over that of a mean
FEWEST = 6  # points that determine it
MEDIAN_WIDTH, IN_A_ROW = (
    5,
    3,
)  # points of the running median of the load, and points without tension after the contact


class PullOff(NamedTuple):
    """Quantities read from an adhesive force curve.

    force [N]: an estimate of the largest tension of the retraction, from which searches start; it is too large by about a
    standard deviation of the noise, since it follows from the lowest readings. work [J] and its standard deviation by
    noise: that of the tension over the depth in which the retraction is in tension; work_end [J]: largest error of the work
    from the depth at which the contact breaks, which is known to within the distance of two points. contact (n,) bool: the
    points in contact.
    """

    force: float
    work: float
    work_sd: float
    work_end: float
    contact: np.ndarray

    def separation_work(self, quantile: float) -> tuple[float, float, float]:
        """Return the work of separation and the limits of its interval [J], at a quantile of the normal distribution."""
        half = quantile * self.work_sd + self.work_end
        return self.work, self.work - half, self.work + half


def zeroed(data: IndentationData) -> tuple[IndentationData, float]:
    """Return the curve with the load counted from its median at the end of the retraction, and the standard error of that
    zero [N]; the curve as it is, and 0, where this end is in contact or its load is zero within the noise.
    """
    back = np.flatnonzero(data.segments == "retract")
    if back.size < FEWEST:
        return data, 0.0
    tail = back[-max(back.size // TAIL, 4) :]
    zero, spread = float(np.median(data.load[tail])), noise(data.load) / np.sqrt(tail.size)
    first, second = np.array_split(data.load[tail], 2)
    change = abs(float(np.median(second) - np.median(first)))
    flat = change <= max(2.0 * SURE * spread, FLAT * abs(zero - float(data.load[back].min())))
    held = _held(data.load[back] - zero)
    if not flat or np.any(held[-tail.size :]):
        note = "the retraction ends in contact, so that the zero of the load is taken as given"
        return dataclasses.replace(data, notes=(*data.notes, note)), 0.0
    if abs(zero) < SURE * MEDIAN * spread:
        return data, 0.0
    note = f"zero of the load: {zero:.4g} N, the median of the last {tail.size} points of the retraction"
    return dataclasses.replace(data, load=data.load - zero, notes=(*data.notes, note)), MEDIAN * spread


def check_signs(data: IndentationData, radius: float) -> None:
    """Raise ValueError for an adhesive force curve whose load or depth has the wrong sign, or whose depth is larger than
    the radius of the ball [m], as in other units."""
    for name, sign, words in (("approach", 1.0, "grows"), ("retract", -1.0, "falls")):
        depth = data.depth[data.segments == name]
        if depth.size >= FEWEST and sign * (np.mean(depth[-2:]) - np.mean(depth[:2])) < 0.0:
            raise ValueError(
                f"depth: expected one that {words} during the {name}, got {depth[0]:.3g} to {depth[-1]:.3g} m: give the"
                " depth, and the load, with the other sign"
            )
    back = np.flatnonzero(data.segments == "retract")
    if back.size < FEWEST:
        return
    load, depth = data.load[back], data.depth[back]
    deep = np.argsort(depth)[-max(back.size // TAIL, 2) :]
    if float(np.mean(load[deep])) < float(np.median(load)):
        raise ValueError(
            f"load: expected the largest loads at the largest depths, got {np.mean(load[deep]):.3g} N there and"
            f" {np.median(load):.3g} N on average over the retraction: give the load with the other sign"
        )
    way = float(np.ptp(data.depth[_held_points(data)]))
    if way > radius:
        raise ValueError(
            f"depth: expected a contact less deep than the radius of the ball, {radius:.3g} m, got {way:.3g} m: expected a"
            " depth in m and not in mm, um or nm"
        )


def _held_points(data: IndentationData) -> np.ndarray:
    """Return the places of the points of the retraction in contact."""
    back = np.flatnonzero(data.segments == "retract")
    return back[_held(data.load[back])]


def read_pull_off(data: IndentationData) -> PullOff:
    """Return what an adhesive force curve tells without a model; ValueError for a curve without a pull-off."""
    marks, load = data.segments, data.load
    back = np.flatnonzero(marks == "retract")
    spread = noise(load)
    if back.size < FEWEST or not load[back].min() < -SURE * spread:
        found = "no retraction" if back.size < FEWEST else f"a lowest load of {load[back].min():.3g} N"
        raise ValueError(
            f"adhesion: expected a retraction with a tension above {SURE:g} standard deviations of the noise"
            f" ({SURE * spread:.3g} N), got {found}"
        )
    contact = np.ones(load.size, dtype=bool)
    contact[back] = _held(load[back])
    there = np.flatnonzero(marks == "approach")
    if there.size:
        contact[there] = _touched(load[there], spread)
    force = _lowest(data.depth[back], load[back], contact[back])
    return PullOff(force, *_work(data.depth[back], load[back], contact[back], spread), contact)


def _held(load: np.ndarray) -> np.ndarray:
    """Return which points (n,) of a retraction are in contact.

    The lowest load is that of a running median, and the contact has ended where several points in a row have lost their
    tension, so that the noise of one reading decides neither.
    """
    width = min(MEDIAN_WIDTH, load.size)
    padded = np.pad(load, (width // 2, width - 1 - width // 2), mode="edge")
    lowest = float(np.median(np.lib.stride_tricks.sliding_window_view(padded, width), axis=-1).min())
    first = int(np.argmin(load))
    beyond = np.append(load[first:], np.full(IN_A_ROW - 1, np.inf))
    lost = np.lib.stride_tricks.sliding_window_view(beyond > (1.0 - LOST) * lowest, IN_A_ROW).all(-1)
    end = first + int(np.argmax(lost)) if lost.any() else load.size
    return np.arange(load.size) < end


def _touched(load: np.ndarray, spread: float) -> np.ndarray:
    """Return which points (n,) of an approach are in contact."""
    least = max(SURE * spread, ONSET * float(load.max()))
    lowest = int(np.argmin(load))
    apart = np.flatnonzero(load <= least)
    first = int(apart[-1]) + 1 if apart.size else 0
    start = lowest if load[lowest] < -least else first
    return np.arange(load.size) >= start


def _lowest(depth: np.ndarray, load: np.ndarray, contact: np.ndarray) -> float:
    """Return an estimate of the largest tension, from a parabola through the points near it."""
    near = np.flatnonzero(contact & (load < NEAR * load.min()))
    lowest = int(np.argmin(load))
    if near.size < FEWEST:
        return -float(load[lowest])
    x = depth[near] - depth[lowest]
    x = x / max(float(np.ptp(x)), 1e-300)
    A = np.stack([np.ones(x.size), x, x**2], -1)
    return -float(np.min(A @ np.linalg.lstsq(A, load[near], rcond=None)[0]))


def _work(
    depth: np.ndarray, load: np.ndarray, contact: np.ndarray, spread: float
) -> tuple[float, float, float]:
    """Return the work of the tension, its standard deviation for noise that is independent from point to point, and its
    largest error from the depth at which the contact breaks, which is half way to the next point or up to that from it."""
    on = np.flatnonzero(contact)
    tension = np.flatnonzero(load[on] < 0.0)
    on = on[tension[0] :] if tension.size else on[:0]
    if on.size == 0:
        return 0.0, 0.0, 0.0
    steps = -np.diff(depth[on])
    weights = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))
    half = 0.5 * abs(float(depth[on[-1]] - depth[on[-1] + 1])) if on[-1] + 1 < depth.size else 0.0
    weights[-1] += half
    end = half * float(np.median(np.abs(load[on[-IN_A_ROW:]])))
    return -float(weights @ load[on]), float(spread * np.sqrt(np.sum(weights**2))), end
