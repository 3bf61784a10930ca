"""Cleaning of a series of numbers: rows left out, sorted or split, each with a note."""

import itertools
from collections.abc import Sequence

import numpy as np

from fitting.data.contact import sample_noise, smooth
from fitting.data.curves import window_note
from fitting.read.columns import SI, Column, Series, fail

LOSS = 0.1  # largest fraction of rows that may be left out
SAME = 5e-3  # relative difference of measured frequencies that are one
STILL = 3  # least number of rows at one frequency beside a sweep
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
    if not sum(piece.size for piece in long) > (1 - LOSS) * t.size:
        return [series]

    def overlap(first: np.ndarray, second: np.ndarray) -> bool:
        begin, end = max(np.nanmin(first), np.nanmin(second)), min(np.nanmax(first), np.nanmax(second))
        return all(np.sum((run >= begin) & (run <= end)) >= LEAST for run in (first, second))

    if not any(overlap(t[a], t[b]) for a, b in itertools.pairwise(long)):
        return [series]
    parts = [series.pick(piece) for piece in pieces]
    return [part._replace(name=f"{part.name} from line {part.lines[0]}".strip()) for part in parts]


def divided(series: Series) -> list[Series]:
    """Return the series split where the column that numbers its segments changes ("1|1, 1|2, ..., 2|1": at 2).

    It is whole where most of the marks have less than ``LEAST`` rows, since these number points and not segments.
    """
    marks = np.array([mark.partition("|")[0].strip() for mark in series.marks])
    cuts = np.flatnonzero(marks[1:] != marks[:-1]) + 1
    pieces = np.split(np.arange(marks.size), cuts)
    if not cuts.size or sum(piece.size for piece in pieces if piece.size >= LEAST) < 0.5 * marks.size:
        return [series]
    return [series.pick(piece)._replace(name=f"{series.name} {marks[piece[0]]}".strip()) for piece in pieces]


def sweeps(series: Series) -> tuple[list[Series], list[Series]]:
    """Return the parts of a series over frequency in which it moves, and those in which it stands still.

    It stands still in a test over time, strain or temperature before or after a sweep: at least three rows at one
    frequency, and more than twice as many as at most other frequencies, which a sweep may repeat.
    """
    omega = series.clock
    # measured frequencies are never quite the same
    moved = ~(np.abs(np.diff(omega)) <= SAME * np.abs(omega[:-1]))
    pieces = np.split(np.arange(omega.size), np.flatnonzero(moved) + 1)
    usual = float(np.median([piece.size for piece in pieces]))
    # not a dense sweep
    narrow = [np.ptp(omega[piece]) <= 2.0 * SAME * np.abs(omega[piece[0]]) for piece in pieces]
    long = [
        piece.size >= STILL and piece.size > 2.0 * usual and one
        for piece, one in zip(pieces, narrow, strict=True)
    ]
    if not any(long):
        still = len(pieces) == 1 and omega.size >= STILL and narrow[0]
        return ([], [series]) if still else ([series], [])
    groups: list[tuple[bool, list[np.ndarray]]] = []
    for piece, stands in zip(pieces, long, strict=True):
        if groups and not stands and not groups[-1][0]:
            groups[-1][1].append(piece)
        else:
            groups.append((stands, [piece]))
    parts = [(stands, series.pick(np.concatenate(some))) for stands, some in groups]
    named = [
        (stands, one._replace(name=f"{one.name} from line {one.lines[0]}".strip())) for stands, one in parts
    ]
    return [one for stands, one in named if not stands], [one for stands, one in named if stands]


def turned(series: Series) -> list[Series]:
    """Return the parts of a sweep that goes up and down again, each of at least ``LEAST`` rows in one direction."""
    way = np.sign(np.diff(series.clock))
    steps = np.flatnonzero(way)  # the frequency at which it turns may be measured twice
    cuts = steps[1:][way[steps[1:]] != way[steps[:-1]]]
    pieces = np.split(np.arange(series.clock.size), cuts)
    if not cuts.size or min(piece.size for piece in pieces) < LEAST:
        return [series]
    return [
        series.pick(one)._replace(name=f"{series.name} from line {series.lines[one[0]]}".strip())
        for one in pieces
    ]


def choose(path: str, option: str, parts: list[Series], segment: Segment) -> Series:
    """Return one of several curves of a file, or several joined, by position or name.

    Raises:
        ValueError: several curves and no choice, or an unknown choice; the message names the option.
    """
    names = ", ".join(f"{k} ({part.name or f'line {part.lines[0]}'})" for k, part in enumerate(parts))

    def one(choice: int | str) -> Series:
        if isinstance(choice, int):
            hits = parts[choice : choice + 1] if choice >= 0 else []
        else:
            hits = [part for part in parts if part.name.lower() == choice.lower()]
            hits = hits or [part for part in parts if choice.lower() in part.name.lower()]
        if len(hits) != 1:
            raise ValueError(f"{path}: {option}: expected one of {names[:200]}; got {choice!r}")
        return _read(hits[0])

    if segment is None:
        if len(parts) > 1:
            raise ValueError(
                f"{path}: expected one curve, got {len(parts)}: choose with {option}= among {names[:200]}"
            )
        return _read(parts[0])
    several = [segment] if isinstance(segment, int | str) else list(segment)
    chosen = [one(choice) for choice in several]
    return join(chosen).say(
        f"{option} taken: {', '.join(part.name or str(part.lines[0]) for part in chosen)}"
    )


def _read(part: Series) -> Series:
    """Return a curve; ValueError where it could not be read."""
    if part.error:
        raise ValueError(part.error)
    return part


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


# Check that a column of compliance is a creep compliance: strain over stress is J(t) only under a constant stress.
#
# Under a varying stress, strain = int J(t - s) d stress(s) (L. Boltzmann, Ann. Phys. 241 (1878) 430), and the
# compliance that an instrument writes is the quotient of strain and stress at the same time. The strain is then
# recovered as their product and fitted under the measured stress.


STEADY = 0.01  # relative variation of a constant stress about its median
SURE = 3.0  # significant variation in standard deviations of its noise
ENDED = 0.05  # fraction of its maximum below which the stress has ended


def settle(path: str, series: Series, end: float | None) -> Series:
    """Return the compliance alone where the stress beside it is constant, otherwise strain and stress.

    Args:
        path: for messages.
        series: with "J" and "stress", and "strain" if the file has it.
        end: last time of the requested rows on the file's clock [s], None for all.

    Raises:
        ValueError: the stress ends, and there is no strain.
    """
    t, J, stress = (series.values[key] for key in ("t", "J", "stress"))
    known = np.isfinite(t) & np.isfinite(J) & np.isfinite(stress)
    known &= (t + series.zero) <= (np.inf if end is None else end)
    # constant where its running median stays at its median
    size = np.abs(stress[known & (J > 0)])
    steady = size.size < 3
    if not steady:
        level = float(np.median(size))
        steady = bool(np.max(np.abs(smooth(size) - level)) <= max(STEADY * level, SURE * sample_noise(size)))
    if steady:
        return _keep(series, ("t", "J", "sigma"), ("stress", "strain"))
    label = series.columns["stress"].label
    if "strain" in series.values and "sigma" not in series.values:
        series = _keep(series, ("t", "strain", "stress"), ("J",))
        return series.say(
            f"{label} varies: the strain is fitted under it, and the compliance beside it is not taken"
        )
    loaded = known & (np.cumsum(known & (np.abs(stress) > ENDED * np.nanmax(np.abs(stress)))) > 0)
    ends = loaded & (np.abs(stress) <= ENDED * np.nanmax(np.abs(stress)))
    if np.any(ends):
        begin, last = t[loaded][0] + series.zero, t[ends][0] + series.zero
        raise ValueError(
            f"{path}: column {label!r}: expected a strain beside a stress that ends, got a compliance alone: "
            f"window=({begin:g}, {last:g}) selects the part before its end"
        )
    # strain = compliance times stress
    compliance = series.columns["J"]
    values = {"t": t, "strain": J * stress, "stress": stress}
    if "sigma" in series.values:
        values["sigma"] = series.values["sigma"] * np.abs(stress)
    columns: dict[str, Column] = {key: series.columns[key] for key in values if key in series.columns}
    series = series._replace(values=values, columns=columns | {"strain": compliance})
    return series.say(f"{label} varies: {compliance.label} times it is the strain, which is fitted under it")


def _keep(series: Series, keys: tuple[str, ...], dropped: tuple[str, ...]) -> Series:
    """Return some of the columns, without the notes on those that are not used."""
    notes = {note for key in dropped if key in series.columns for note in series.columns[key].notes}
    used = {note for key in keys if key in series.columns for note in series.columns[key].notes}
    return series._replace(
        values={key: series.values[key] for key in keys if key in series.values},
        columns={key: series.columns[key] for key in keys if key in series.columns},
        notes=tuple(note for note in series.notes if note not in notes - used),
    )
