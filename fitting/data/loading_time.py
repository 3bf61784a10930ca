"""Time of loading of a creep test: as given by the caller or shown in the file, otherwise an error that asks for it."""

import numpy as np

from fitting.data.cleaning import STEADY, Series
from fitting.data.contact import sample_noise, smooth
from fitting.data.curves import counts_from_zero

ZERO = 0.01  # fraction of the largest stress below which the stress is zero
NOTHING = 1e-6  # fraction of it that is certainly zero
JUMP = 0.1  # change between samples at a jump, as a fraction of the largest stress
FALL = 0.2  # fraction of its maximum by which a creep curve may fall
SURE = 3.0  # significant fall in standard deviations of the noise
LEAST = 5  # number of samples below which no check is made
REST = 3  # number of samples before the load from which the zero of the strain is taken


def shift(path: str, series: Series, start: float | None) -> Series:
    """Return the series with times from the start of the load [s], without earlier rows; unchanged for None.

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


def from_rest(series: Series, start: float | None) -> Series:
    """Return the series with the strain counted from that before the load, the zero of the strain, where at least ``REST``
    rows show it: those before ``start`` [s], or without a stress. It must stand still there; if not, a note says so.

    The last of these rows is not used, since it may belong to the rise of the load.
    """
    t, strain, stress = (series.values[key] for key in ("t", "strain", "stress"))
    known = np.isfinite(t) & np.isfinite(strain) & np.isfinite(stress)
    if not known.any():
        return series
    idle = np.abs(stress) <= ZERO * np.max(np.abs(stress[known]))
    begin = np.min(t[known & ~idle], initial=np.inf) if start is None else start
    rest = np.flatnonzero(known & idle & (t < begin))[:-1]
    if rest.size < REST:
        return series
    level, size = float(np.median(strain[rest])), float(np.max(np.abs(strain[known])))
    if abs(level) <= max(ZERO * size, SURE * sample_noise(strain[rest])):
        return series
    if np.ptp(smooth(strain[rest])) > JUMP * abs(level):
        return series.say(
            f"the strain before the load changes, {strain[rest[0]]:.3g} to {strain[rest[-1]]:.3g}: not subtracted"
        )
    say = f"the strain before the load, {level:.3g}, is subtracted: {rest.size} rows without a stress"
    return series._replace(values=series.values | {"strain": strain - level}).say(say)


def after_rise(
    series: Series, label: str, strain: np.ndarray, start: float | None
) -> tuple[Series, float | None]:
    """Return a relaxation modulus without the rows in which the strain beside it rises, and the time of the step [s].

    The modulus of an instrument, stress over strain, is int G(t - s) d strain(s)/strain. After a rise that is linear over a
    time T this is G at the time since the middle of the rise, but for the factor sinh(x)/x, x = T/(2 tau), of each
    relaxation time tau: 1 % for T = tau/2. Without a ``start`` the step is therefore there.

    label, strain (n,): heading and magnitudes of the column of strain, in any unit, nan where there is none.
    """
    t = series.values["t"]
    known = np.isfinite(t) & np.isfinite(strain)
    level = float(np.median(strain[known])) if np.count_nonzero(known) >= LEAST else 0.0
    if level == 0.0:
        return series, start
    allowed = max(STEADY * level, SURE * sample_noise(strain[known]))
    # the rows that rise, before the first at the level; the course of all others is constant
    first = int(np.argmax(known & (np.abs(strain - level) <= allowed)))
    rising = np.flatnonzero(known[:first] & (strain[:first] < level))
    known[rising] = False
    away = float(np.max(np.abs(smooth(strain[known]) - level)))
    if away > allowed:
        say = f"{label} varies by up to {100.0 * away / level:.2g} %: the modulus is taken as that of a step"
        series = series.say(say)
    if not np.any(strain[rising] > ZERO * level):  # a step between two rows
        return series, start
    if start is None:
        course = np.maximum.accumulate(np.append(strain[rising], level))
        times = np.append(t[rising], t[first])
        if course[0] > level / 2.0 and counts_from_zero(np.unique(t[np.isfinite(t)])):
            course, times = np.append(0.0, course), np.append(0.0, times)
        if course[0] <= level / 2.0:
            start = float(np.interp(level / 2.0, course, times))
    middle = "" if start is None else f", {start:.4g} s is taken as the time of the step"
    later = series.pick(slice(first, None))
    return later.say(f"{label} rises until {t[first]:.4g} s: {first} rows left out{middle}"), start


def check_clock(path: str, series: Series, start: float | None) -> None:
    """Raise ValueError unless t counts from the load, since J(t) and G(t) are functions of the time since loading.

    Args:
        path: for messages.
        series: all rows of the file, before a window is taken.
        start: time of loading given by the caller.

    Raises:
        ValueError: no start is given, and the clock may have started before the load; the message names both options.
    """
    t = np.unique(series.values["t"][np.isfinite(series.values["t"])])
    if start is None and series.columns["t"].name != "step time" and not counts_from_zero(t):
        raise ValueError(
            f"{path}: expected t to count from the load, got a first sample at {t[0]:g} s: give start={t[0]:g} if the load "
            "began with it, start=0 if t counts from the load"
        )


def loaded(path: str, series: Series, start: float | None) -> tuple[Series, tuple[np.ndarray, np.ndarray]]:
    """Return the strain from the start of the stress on, and the stress (knots [s], values [Pa]), piecewise linear.

    With a start (after ``shift``) the stress steps there to its first value. Otherwise, if it is zero at
    first, it rises between two samples; if it is present from the first sample on, it steps at the zero of a
    clock that appears to start with it, or rises from there if its first values lie on a line through the origin.

    Raises:
        ValueError: the file does not show when the stress began; the message names ``start``.
    """
    t, stress = series.values["t"], series.values["stress"]
    # the first sample under stress; for a slow rise, the beginning of the rise
    size = np.abs(stress)
    largest = np.max(size)
    first = int(np.argmax(size > ZERO * largest))
    if first > 0:
        least = max(NOTHING * largest, SURE * sample_noise(size[: first + 2]) if first > 1 else 0.0)
        while (
            first > 0
            and size[first - 1] > least
            and (first == 1 or size[first - 1] - size[first - 2] > least)
        ):
            first -= 1
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
            f"{path}: stress: expected the beginning of the stress in the file, got a stress from the first sample on, at"
            f" {t[0]:g} s: give the time of loading, start= [s]"
        )
    # a sloping line through the first stresses that passes through zero at t = 0
    few = slice(0, LEAST)
    slope, at_zero = (
        np.polyfit(t[few], stress[few], 1)
        if t[0] > 0.0 and np.unique(t[few]).size == LEAST
        else (0.0, np.inf)
    )
    if abs(slope * t[0]) > JUMP * abs(stress[0]) and abs(at_zero) < JUMP * abs(stress[0]):
        series = series.say("the stress is taken to rise from zero at t = 0; if not, give start=")
        return series, (np.append(0.0, t), np.append(0.0, stress))
    return series.say("the stress is taken to begin at t = 0; if not, give start="), _step(t, stress)


def check_course(path: str, t: np.ndarray, y: np.ndarray, stress: np.ndarray | None = None) -> None:
    """Raise ValueError if a compliance, or a strain under a constant stress, falls as in a recovery.

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
    if fall > FALL * course[top] and fall > SURE * sample_noise(y):
        last = t[np.argmax(np.abs(y))]
        raise ValueError(
            f"{path}: expected a creep curve that rises, got one that falls after {last:g} s: a recovery? "
            f"window=(0, {last:.6g}) selects the creep"
        )


def _step(t: np.ndarray, stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a stress that steps at t = 0 to its first value."""
    return np.concatenate([[0.0], t]), np.concatenate([stress[:1], stress])
