"""Segments of an indentation curve, approach, hold, retract: as the file marks them, or the course shows."""

from collections.abc import Sequence

import numpy as np
import scipy

SEGMENTS = ("approach", "hold", "retract")
WORDS = {  # parts of names, looked for in this order: "unload" before "load"
    "retract": ("retract", "retrace", "unload", "withdraw", "entlast", "rückzug", "true"),
    "hold": ("hold", "pause", "dwell", "halte", "intermediate"),
    "approach": ("approach", "extend", "trace", "load", "belast", "annäher", "false"),
}
REACHED = 0.97  # share of the largest load at which a hold may begin
STILL = 0.1  # a rate in a hold over the rate before it
FALLS = 0.2  # share of the largest load that a retract takes off at least
SMOOTH = 5  # samples in a running median


def named(name: str) -> str | None:
    """The segment that a name means: "extend", "Hold Segment Type", "Entlastung"; None for none."""
    for segment, words in WORDS.items():
        if any(word in name.lower() for word in words):
            return segment
    return None


def label(marks: Sequence[str], load: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Segments (n,) of marks (n,): by name; numbered ones by what the depth does in them."""
    found = {mark: named(mark) for mark in dict.fromkeys(marks)}
    every = np.asarray(marks)
    for mark in found:
        if found[mark] is None:
            found[mark] = _behaviour(load[every == mark], depth[every == mark], np.ptp(depth), np.ptp(load))
    return np.array([found[mark] for mark in marks])


def _behaviour(load: np.ndarray, depth: np.ndarray, way: float, force: float) -> str:
    """Retract: depth and load fall; hold: one of them stays; approach: else."""
    deeper, harder = (depth[-1] - depth[0]) / (way or 1.0), (load[-1] - load[0]) / (force or 1.0)
    if min(abs(deeper), abs(harder)) < STILL and max(deeper, harder) < 0.5:
        return "hold"
    return "retract" if deeper + harder < 0 else "approach"


def infer(t: np.ndarray, load: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Segments (n,) of an unmarked curve, t, load, depth (n,), load and depth positive inwards.

    The curve retracts after its greatest depth, if the load falls there. It is held from where the load
    first comes near its greatest, if load or depth then change ten times slower than before.
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
    """Whether y changes much slower from start to stop than on its rise before."""
    if stop - start < 3 or t[stop - 1] == t[start]:
        return False
    rise = int(np.argmax(y >= y[0] + STILL * (y[start] - y[0])))
    rate = abs(y[stop - 1] - y[start]) / (t[stop - 1] - t[start])
    return start == 0 or bool(rate * (t[start] - t[rise]) < STILL * abs(y[start] - y[rise]))


def smooth(y: np.ndarray) -> np.ndarray:
    """A running median."""
    return scipy.ndimage.median_filter(y, size=SMOOTH, mode="nearest")


def noise(y: np.ndarray) -> float:
    """Standard deviation of white noise on a smooth curve, from its second differences."""
    return float(np.median(np.abs(np.diff(y, 2)))) / 0.6745 / 6**0.5
