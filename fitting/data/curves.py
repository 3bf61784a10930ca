"""Checks that the arrays of all measured curves pass, and whether their times count from the load."""

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from jaxcontact._support.pytree import require_real

# Detection of whether the times of a curve count from the load, since J(t) and G(t) are functions of the time since
# loading.
#
# The clock of an instrument may have started earlier. Then the first time is late: many sample intervals after zero
# where samples are evenly spaced. Times whose spacing grows in proportion to them, as in logarithmic sampling, count
# from the load whatever the first of them is. Late times of even spacing may count from the load too, with the first
# samples left out, and the times alone do not distinguish the two cases, so the caller must decide.


LATE = 5.0  # largest first time, in sample intervals, if the clock starts with the load
EVENLY = 2.5  # the same for even spacing, where one or two samples may be missing
EVEN = 0.2  # largest relative difference of even spacings
FIRST = 9  # number of spacings examined
ALIKE = 0.3  # relative tolerance of spacing that grows with time


def counts_from_zero(t: np.ndarray) -> bool:
    """Return whether the clock appears to start with the load: an early first sample, or growing spacing."""
    different = np.unique(t[np.isfinite(t)])
    if different.size < 3:
        return True
    gaps = np.diff(different)
    first = gaps[:FIRST]
    even = first.max() - first.min() < EVEN * first.max()
    if different[0] <= (EVENLY if even else LATE) * gaps[0] * (1.0 + 1e-9):
        return True
    middle = different.size // 2
    grown = (different[middle + 1] - different[middle]) / gaps[0]
    return bool(abs(grown / (different[middle] / different[0]) - 1) < ALIKE and grown > 1 + ALIKE)


def since_load(t: np.ndarray, start: float | None) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the times (n,) since the load, which began at ``start`` [s] on their clock, and notes.

    Without a start the times count from the load, and a note says so if their spacing suggests otherwise.

    Raises:
        ValueError: a start after the first of the times.
    """
    if start is None:
        note = (
            f"t begins late, at {t[0]:g} s, and is taken as the time since the load;"
            f" give start={t[0]:g} if the load began then, start=0 if not"
        )
        return t, () if counts_from_zero(t) else (note,)
    if not (np.isfinite(start) and start <= t[0]):
        raise ValueError(f"start: expected a time not after the first of t, {t[0]:g} s, got {start!r}")
    return t - start, ()


def array(name: str, value: object, like: np.ndarray | None = None) -> np.ndarray:
    """Return a finite float array (n,), n >= 5; ValueError with its name otherwise."""
    require_real(name, value)
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: expected numbers, got {type(value).__name__}") from None
    if array.ndim != 1 or array.size < 5:
        raise ValueError(f"{name}: expected a 1-d array of at least 5 values, got shape {array.shape}")
    if like is not None and array.shape != like.shape:
        raise ValueError(f"{name}: expected {like.size} values as in t, got {array.size}")
    if not np.all(np.isfinite(array)):
        k = int(np.argmax(~np.isfinite(array)))
        raise ValueError(f"{name}: expected finite values, got {array[k]} at index {k}")
    array.setflags(write=False)
    return array


def check_kind(data: object, kind: type) -> None:
    """Raise ValueError unless the data are of this kind."""
    if not isinstance(data, kind):
        raise ValueError(f"data: expected {kind.__name__}, got {type(data).__name__}")


def given_twice(data: Sequence[Any]) -> tuple[int, int] | None:
    """Return the places of two curves of a list that are the same, None where all are different."""
    arrays = [
        [np.asarray(value) for value in vars(one).values() if isinstance(value, np.ndarray | float)]
        for one in data
    ]
    for (i, first), (j, second) in itertools.combinations(enumerate(arrays), 2):
        if len(first) == len(second) and all(map(np.array_equal, first, second)):
            return i, j
    return None


def window_note(limits: tuple[float | None, float | None], unit: str, keep: np.ndarray) -> str:
    """Return the note on the points keep (n,) bool that lie between limits, None for an open side."""
    begin, end = (
        word if one is None else f"{one:g} {unit}"
        for one, word in zip(limits, ("the first", "the last"), strict=True)
    )
    return f"window from {begin} to {end} taken: {keep.sum()} of {keep.size} points"


def deviations(name: str, value: object, like: np.ndarray) -> np.ndarray:
    """Return standard deviations (n,), > 0."""
    found = array(name, value, like)
    if np.any(found <= 0):
        raise ValueError(f"{name}: expected standard deviations > 0, got {found.min():g}")
    return found


def times(value: object) -> np.ndarray:
    """Return times (n,) that do not decrease, at least 5 of them different; ValueError otherwise."""
    t = array("t", value)
    if np.any(np.diff(t) < 0):
        raise ValueError("t: expected times that do not decrease; the readers sort, the data classes do not")
    if np.unique(t).size < 5:
        raise ValueError(f"t: expected at least 5 different times, got {np.unique(t).size}")
    return t


def evaluation_times(value: Any) -> np.ndarray:
    """Return times [s], or frequencies, of any shape at which a fitted curve is evaluated; ValueError unless all are finite
    and >= 0."""
    require_real("t", value)
    try:
        t = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"t: expected finite times (or frequencies) >= 0, got {value!r}") from None
    wrong = t[~(np.isfinite(t) & (t >= 0.0))]
    if wrong.size:
        raise ValueError(f"t: expected finite times (or frequencies) >= 0, got {wrong[0]:g}")
    return t


def absolute(temperature: Any) -> float | None:
    """Return a temperature [K], or None where none is given; ValueError unless it is > 0 K."""
    if temperature is None:
        return None
    known = np.ndim(temperature) == 0 and np.asarray(temperature).dtype.kind in "fiu"
    if not (known and 0.0 < float(temperature) < math.inf):
        raise ValueError(f"temperature: expected a number > 0 K, got {temperature!r}")
    return float(temperature)
