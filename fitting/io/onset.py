"""When the load of a creep test began: as the caller says, as the file shows, or a question to the caller."""

import numpy as np

from fitting.data.clock import counts_from_zero
from fitting.data.segments import noise, smooth
from fitting.io.columns import Series

ZERO = 0.01  # share of the largest stress below which there is none
NOTHING = 1e-6  # share of it that is zero for sure
JUMP = 0.1  # share of the largest stress by which it changes from sample to sample in a jump
FALL = 0.2  # share of its largest by which a creep curve may fall
SURE = 3.0  # standard deviations of the noise by which it then falls for sure
LEAST = 5  # samples below which nothing is judged


def shift(path: str, series: Series, start: float | None) -> Series:
    """Times from the start of the load [s] on; rows before it are left out. None: the series as it is.

    Raises:
        ValueError: a start that is not before the last sample.
    """
    if start is None:
        return series
    t = series.values["t"]
    if not (np.isfinite(start) and start < np.nanmax(t)):
        raise ValueError(f"{path}: start: expected a time before the last, {np.nanmax(t):g} s; got {start!r}")
    later = series.pick(~(t < start))
    later = later._replace(values=later.values | {"t": later.values["t"] - start}, zero=series.zero + start)
    left = series.lines.size - later.lines.size
    note = f"; {left} rows before it left out" if left else ""
    return later.say(f"the load begins at {start:g} s of the file's clock, t counts from there{note}")


def check_clock(path: str, series: Series, start: float | None) -> None:
    """Whether t counts from the load, of which J(t) and G(t) are functions: the clock of a long test need not.

    Args:
        path: for messages.
        series: all rows of the file, before a window is taken.
        start: of the load, as the caller says.

    Raises:
        ValueError: no start is given, and the clock may run from before the load; it names both ways on.
    """
    t = np.unique(series.values["t"][np.isfinite(series.values["t"])])
    if start is None and series.columns["t"].name != "step time" and not counts_from_zero(t):
        raise ValueError(
            f"{path}: expected t to count from the load, got a first sample at {t[0]:g} s: give start={t[0]:g} if the load "
            "began with it, start=0 if t counts from the load"
        )


def loaded(path: str, series: Series, start: float | None) -> tuple[Series, tuple[np.ndarray, np.ndarray]]:
    """Strain from the start of the stress on, and the stress: (knots [s], values [Pa]), linear in between.

    With a start (``shift`` went before) the stress steps there to its first value. Else, where it is zero
    at first, it rises between two samples; where it is there from the first sample on, it steps at the zero
    of a clock that seems to start with it, or rises from there if its first values are on a line through it.

    Raises:
        ValueError: the file does not tell when the stress began; names ``start``.
    """
    t, stress = series.values["t"], series.values["stress"]
    largest = np.max(np.abs(stress))
    first = _first(np.abs(stress))
    later = np.abs(np.diff(stress[first:])) > JUMP * largest
    if np.any(later):
        between = t[first:][np.argmax(later)], t[first:][np.argmax(later) + 1]
        series = series.say(
            f"the stress changes between {between[0]:g} and {between[1]:g} s, taken as linear"
        )
    if start is not None:
        return series.pick(slice(first, None)), _step(t[first:], stress[first:])
    if first > 0:
        begin, end = float(t[first - 1]), float(t[first])
        series = shift(path, series.pick(slice(first - 1, None)), begin)
        series = series.say(f"the stress rises between {begin:g} and {end:g} s; if it is a step, give start=")
        return series, (series.values["t"], series.values["stress"])
    if series.columns["t"].name != "step time" and not counts_from_zero(t):
        raise ValueError(
            f"{path}: stress: expected to see it begin, got it from the first sample on, at {t[0]:g} s: say "
            "when it began, start= [s]"
        )
    if _ramps(t, stress):
        series = series.say("the stress is taken to rise from zero at t = 0; if not, give start=")
        return series, (np.append(0.0, t), np.append(0.0, stress))
    return series.say("the stress is taken to begin at t = 0; if not, give start="), _step(t, stress)


def check_course(path: str, t: np.ndarray, y: np.ndarray, stress: np.ndarray | None = None) -> None:
    """A compliance, or a strain under a constant stress, may not fall as in a recovery.

    Raises:
        ValueError: it falls by a fifth, or strain and stress have opposite signs.
    """
    if stress is not None:
        if np.median(y) * np.median(stress) < 0:
            raise ValueError(f"{path}: strain: expected the sign of the stress, got the opposite")
        if np.ptp(stress) > ZERO * np.max(np.abs(stress)):
            return
    if t.size < LEAST:
        return
    course = smooth(np.abs(y))
    top = int(np.argmax(course))
    fall = course[top] - course[top:].min()
    if fall > FALL * course[top] and fall > SURE * noise(y):
        last = t[np.argmax(np.abs(y))]
        raise ValueError(
            f"{path}: expected a creep curve that rises, got one that falls after {last:g} s: a recovery? "
            f"window=(0, {last:.6g}) takes the creep"
        )


def _first(stress: np.ndarray) -> int:
    """The first sample under stress, (n,) >= 0: on a slow rise to ``ZERO`` of the largest, where the rise begins."""
    first = int(np.argmax(stress > ZERO * stress.max()))
    if first == 0:
        return 0
    least = max(NOTHING * stress.max(), SURE * noise(stress[: first + 2]) if first > 1 else 0.0)
    while (
        first > 0
        and stress[first - 1] > least
        and (first == 1 or stress[first - 1] - stress[first - 2] > least)
    ):
        first -= 1
    return first


def _ramps(t: np.ndarray, stress: np.ndarray) -> bool:
    """Whether a line through the first stresses, which is not level, goes through zero at t = 0."""
    few = slice(0, LEAST)
    if t[0] <= 0.0 or np.unique(t[few]).size < LEAST:
        return False
    slope, at_zero = np.polyfit(t[few], stress[few], 1)
    return bool(abs(slope * t[0]) > JUMP * abs(stress[0]) and abs(at_zero) < JUMP * abs(stress[0]))


def _step(t: np.ndarray, stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A stress that steps at t = 0 to its first value."""
    return np.concatenate([[0.0], t]), np.concatenate([stress[:1], stress])
