"""Cleaning of a series of numbers: rows left out, sorted or split, each with a note."""

import itertools
from collections.abc import Sequence

import numpy as np

from fitting.data.curves import window_note
from fitting.io.columns import SI, Series, fail

LOSS = 0.1  # largest fraction of rows that may be left out
LEAST = 5  # least number of rows of a run of increasing times, and of the overlap of two runs
Segment = int | str | Sequence[int | str] | None


def runs(series: Series) -> list[Series]:
    """Return the series split where its clock starts again: long runs of increasing times over the same range.

    Frequencies may decrease in each run.
    """
    t = series.clock
    t = -t if np.sum(np.diff(t) < 0) > 0.5 * t.size else t
    known = np.flatnonzero(np.isfinite(t))
    back = known[1:][np.diff(t[known]) < 0]
    if not back.size:
        return [series]
    pieces = np.split(np.arange(t.size), back)
    long = [piece for piece in pieces if piece.size >= LEAST]
    enough = sum(piece.size for piece in long) > (1 - LOSS) * t.size
    if not (enough and any(_overlap(t[a], t[b]) for a, b in itertools.pairwise(long))):
        return [series]
    parts = [series.pick(piece) for piece in pieces]
    return [part._replace(name=f"{part.name} from line {part.lines[0]}".strip()) for part in parts]


def _overlap(first: np.ndarray, second: np.ndarray) -> bool:
    """Return whether two runs cover the same times."""
    begin, end = max(np.nanmin(first), np.nanmin(second)), min(np.nanmax(first), np.nanmax(second))
    return all(np.sum((run >= begin) & (run <= end)) >= LEAST for run in (first, second))


def choose(path: str, option: str, parts: list[Series], segment: Segment) -> Series:
    """Return one of several curves of a file, or several joined, by position or name.

    Raises:
        ValueError: several curves and no choice, or an unknown choice; the message names the option.
    """
    names = ", ".join(f"{k} ({part.name or f'line {part.lines[0]}'})" for k, part in enumerate(parts))
    if segment is None:
        if len(parts) > 1:
            raise ValueError(
                f"{path}: expected one curve, got {len(parts)}: choose with {option}= among {names[:200]}"
            )
        return parts[0]
    several = [segment] if isinstance(segment, int | str) else list(segment)
    chosen = [_one(path, option, parts, one, names) for one in several]
    return join(chosen).say(
        f"{option} taken: {', '.join(part.name or str(part.lines[0]) for part in chosen)}"
    )


def _one(path: str, option: str, parts: list[Series], choice: int | str, names: str) -> Series:
    if isinstance(choice, int):
        hits = parts[choice : choice + 1] if choice >= 0 else []
    else:
        hits = [part for part in parts if part.name.lower() == choice.lower()]
        hits = hits or [part for part in parts if choice.lower() in part.name.lower()]
    if len(hits) != 1:
        raise ValueError(f"{path}: {option}: expected one of {names[:200]}; got {choice!r}")
    return hits[0]


def join(parts: list[Series]) -> Series:
    """Return the curves concatenated."""
    values = {key: np.concatenate([part.values[key] for part in parts]) for key in parts[0].values}
    marks = tuple(mark for part in parts for mark in part.marks)
    lines = np.concatenate([part.lines for part in parts])
    return parts[0]._replace(lines=lines, values=values, marks=marks)


def window(series: Series, limits: tuple[float | None, float | None] | None) -> Series:
    """Return the rows from limits[0] to limits[1], in seconds of the file's clock (or rad/s); None is no limit."""
    if limits is None:
        return series
    begin, end = limits
    low, high = -np.inf if begin is None else begin, np.inf if end is None else end
    if not low < high:
        raise ValueError(f"window: expected (begin, end) with begin < end, got {limits!r}")
    t = series.clock + series.zero
    keep = ~((t < low) | (t > high))
    if keep.sum() < LEAST:
        raise ValueError(
            f"window: expected at least {LEAST} points from {np.nanmin(t):.4g} to {np.nanmax(t):.4g}, got {keep.sum()} of"
            f" {t.size}"
        )
    return series.pick(keep).say(window_note(limits, SI[next(iter(series.values))], keep))


def complete(path: str, series: Series, positive: tuple[str, ...] = ()) -> Series:
    """Return the rows without missing cells and, in columns of ``positive``, with values > 0.

    Raises:
        ValueError: more than a tenth of the rows would be left out.
    """
    keep = np.ones(series.lines.size, dtype=bool)
    for key, values in series.values.items():
        label = series.columns[key].label if key in series.columns else key
        checks = [(np.isnan(values), "an empty or NaN cell", "numbers")]
        if key in positive:
            checks.append((values <= 0, "a value <= 0", "values > 0"))
        for bad, what, expected in checks:
            if not bad.any():
                continue
            line = int(series.lines[np.argmax(bad)])
            if bad.sum() > LOSS * bad.size:
                some = f"{what} in {bad.sum()} of {bad.size} rows"
                fail(
                    path, line, label, f"expected {expected}, got {some}; window=(begin, end) selects others"
                )
            series = series.say(f"{label}: {bad.sum()} rows with {what} left out, the first in line {line}")
            keep &= ~bad
    return series.pick(keep)


def ordered(series: Series) -> Series:
    """Return the rows sorted by time, with a note on rows that were out of order or repeated."""
    t = series.values["t"]
    back, same = int(np.sum(np.diff(t) < 0)), int(np.sum(np.diff(np.sort(t)) == 0))
    if back:
        series = series.pick(np.argsort(t, kind="stable"))
        series = series.say(f"times sorted: {back} of {t.size} steps went back")
    return series.say(f"{same} repeated times kept as repeated measurements") if same else series


def check_times(path: str, series: Series) -> Series:
    """Return the series; ValueError where times are negative."""
    early = series.values["t"] < 0
    if np.any(early):
        line, first = int(series.lines[np.argmax(early)]), series.values["t"][early][0]
        what = f"expected times >= 0, got {first:g} s; window=(0, None) leaves them out"
        fail(path, line, series.columns["t"].label, what)
    return series
