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

    The curve retracts after its largest depth if the load falls there. A hold begins where the load first comes near
    its maximum, if load or depth then changes ten times more slowly than before.
    """
    P, h = smooth(load), smooth(depth)
    deepest = h.size - int(np.argmax(h[::-1] >= h.max() - 3 * noise(depth)))
    stop = deepest if P[-1] < P[deepest - 1] - FALLS * P.max() else h.size
    start = int(np.argmax(P[:stop] >= REACHED * P[:stop].max()))
    segments = np.full(t.size, SEGMENTS[0], dtype="<U8")
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
