"""Segments of an indentation curve (approach, hold, retract), as marked in the file or inferred from the curve."""

from collections.abc import Sequence

import numpy as np
import scipy

SEGMENTS = ("approach", "hold", "retract")
WORDS = {  # parts of names, looked for in this order: "unload" before "load"
    "retract": ("retract", "retrace", "unload", "withdraw", "entlast", "rückzug", "true"),
    "hold": ("hold", "pause", "dwell", "halte", "intermediate"),
    "approach": ("approach", "extend", "trace", "load", "belast", "annäher", "false"),
}
REACHED = 0.97  # fraction of the largest load at which a hold may begin
NEAR = 0.8  # fraction of the largest load from which on its knee is sought
FEWEST = 4  # number of points of either line of a knee
STILL = 0.1  # largest rate in a hold over the rate before it
FALLS = 0.2  # least fraction of the largest load that a retract removes
SMOOTH = 5  # number of samples in a running median


def named(name: str) -> str | None:
    """Return the segment that a name means ("extend", "Hold Segment Type", "Entlastung"), or None."""
    for segment, words in WORDS.items():
        if any(word in name.lower() for word in words):
            return segment
    return None


def label(marks: Sequence[str], load: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Return the segments (n,) of marks (n,): by name, or for numbered ones by the change of load and depth."""
    found = {mark: named(mark) for mark in dict.fromkeys(marks)}
    every = np.asarray(marks)
    for mark in found:
        if found[mark] is None:
            found[mark] = _behaviour(load[every == mark], depth[every == mark], np.ptp(depth), np.ptp(load))
    return np.array([found[mark] for mark in marks])


def _behaviour(load: np.ndarray, depth: np.ndarray, way: float, force: float) -> str:
    """Return "retract" where depth and load fall, "hold" where one of them is constant, otherwise "approach"."""
    deeper, harder = (depth[-1] - depth[0]) / (way or 1.0), (load[-1] - load[0]) / (force or 1.0)
    if min(abs(deeper), abs(harder)) < STILL and max(deeper, harder) < 0.5:
        return "hold"
    return "retract" if deeper + harder < 0 else "approach"


def infer(t: np.ndarray, load: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Return the segments (n,) of an unmarked curve t, load, depth (n,), load and depth positive inwards.

    The curve retracts after its largest depth if the load falls there. A hold begins at the end of the rise, the knee of
    the load or of the depth near the largest load, if load or depth then changes ten times more slowly than before. Where
    there is no such knee, it begins where the load first comes near its maximum.
    """
    P, h = smooth(load), smooth(depth)
    deepest = h.size - int(np.argmax(h[::-1] >= h.max() - 3 * noise(depth)))
    stop = deepest if P[-1] < P[deepest - 1] - FALLS * P.max() else h.size
    start = int(np.argmax(P[:stop] >= REACHED * P[:stop].max()))
    segments = np.full(t.size, SEGMENTS[0], dtype="<U8")
    # the last part of a ramp before its end is as long as a short hold, and would hide it
    rise = int(np.argmax(P[:stop] >= NEAR * P[:stop].max()))
    knees = [_knee(t, y, rise, stop) for y in (load, depth)]
    held = [knee > start and _still(t, y, knee, stop) for knee, y in zip(knees, (P, h), strict=True)]
    if held[0] or held[1]:
        start = knees[0] if held[0] else knees[1]
    if _still(t, P, start, stop):
        level = np.median(P[start:stop])
        stop = (
            stop if stop == h.size else start + int(np.flatnonzero(P[start:stop] >= REACHED * level)[-1]) + 1
        )
        segments[start:stop] = SEGMENTS[1]
    elif _still(t, h, start, stop):
        segments[start:stop] = SEGMENTS[1]
    segments[stop:] = SEGMENTS[2]
    return segments


def _knee(t: np.ndarray, y: np.ndarray, start: int, stop: int) -> int:
    """Return the first point of the second of two straight lines that fit y best from start to stop, ``start`` where there
    are too few points."""
    n = stop - start
    if n < 2 * FEWEST:
        return start
    x, z = t[start:stop] - t[start], y[start:stop] - y[start]
    x, z = x / max(x[-1], 1e-300), z / max(float(np.ptp(z)), 1e-300)

    def misfit(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the residual sum of squares (n,) of the line through the first k + 1 points."""
        k = np.arange(1, x.size + 1)
        mx, mz = np.cumsum(x) / k, np.cumsum(z) / k
        xx, xz, zz = (np.cumsum(a * b) / k - m for a, b, m in ((x, x, mx**2), (x, z, mx * mz), (z, z, mz**2)))
        return k * np.maximum(zz - xz**2 / np.maximum(xx, 1e-300), 0.0)

    before, after = misfit(x, z), misfit(x[::-1], z[::-1])[::-1]
    splits = np.arange(FEWEST, n - FEWEST + 1)  # numbers of points of the first line
    return start + int(splits[np.argmin(before[splits - 1] + after[splits])])


def _still(t: np.ndarray, y: np.ndarray, start: int, stop: int) -> bool:
    """Return whether y changes much more slowly from start to stop than during its rise before."""
    if stop - start < 3 or t[stop - 1] == t[start]:
        return False
    rise = int(np.argmax(y >= y[0] + STILL * (y[start] - y[0])))
    rate = abs(y[stop - 1] - y[start]) / (t[stop - 1] - t[start])
    return start == 0 or bool(rate * (t[start] - t[rise]) < STILL * abs(y[start] - y[rise]))


def smooth(y: np.ndarray) -> np.ndarray:
    """Return the running median."""
    return scipy.ndimage.median_filter(y, size=SMOOTH, mode="nearest")


def noise(y: np.ndarray) -> float:
    """Return the standard deviation of white noise on a smooth curve, from its second differences."""
    return float(np.median(np.abs(np.diff(y, 2)))) / 0.6745 / 6**0.5
