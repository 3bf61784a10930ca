"""Detection of first contact in an indentation curve: the zeros of time, depth and load, and the signs of load and
depth; and the force curve of a cantilever, prepared for a fit.

Before contact the load is constant. After it the load on a half-space depends on the depth as

    load = b + c (depth - d)^p,   p = 3/2 for a ball (``data/indentation.py``).

A film adds higher powers of the depth with positive coefficients (E. K. Dimitriadis et al., Biophys. J. 82 (2002) 2798:
powers 3/2, 2, 5/2, 3, 7/2 for a ball), and creep during the approach lowers the power. A sum of powers with
coefficients >= 0 covers all these cases. A curve has points before contact only if no such sum that begins at its first
sample describes the initial rise of the load to within its scatter; for a half-space the powers end at p, if p alone
describes the rise from some depth on. Then d is that of the single power p where this describes the data as well as the
sum, else that of the sum. A curve that was cut at d is described by the same law from its first sample on, so nothing
more is found before contact in it.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy

from fitting.data.weights import nonnegative

# Segments of an indentation curve (approach, hold, retract), as marked in the file or inferred from the curve.


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
    for mark in [mark for mark, segment in found.items() if segment is None]:
        # changes over the ways of the curve: a hold where one of them is small, otherwise their sign decides
        P, h = load[every == mark], depth[every == mark]
        deeper, harder = (h[-1] - h[0]) / (np.ptp(depth) or 1.0), (P[-1] - P[0]) / (np.ptp(load) or 1.0)
        if min(abs(deeper), abs(harder)) < STILL and max(deeper, harder) < 0.5:
            found[mark] = "hold"
        else:
            found[mark] = "retract" if deeper + harder < 0 else "approach"
    return np.array([found[mark] for mark in marks])


def infer(t: np.ndarray, load: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Return the segments (n,) of an unmarked curve t, load, depth (n,), load and depth positive inwards.

    The curve retracts after its largest depth if the load falls there. A hold begins at the end of the rise, the knee of
    the load or of the depth near the largest load, if load or depth then changes ten times more slowly than before. Where
    there is no such knee, it begins where the load first comes near its maximum.
    """
    P, h = smooth(load), smooth(depth)
    deepest = h.size - int(np.argmax(h[::-1] >= h.max() - 3 * sample_noise(depth)))
    stop = deepest if P[-1] < P[deepest - 1] - FALLS * P.max() else h.size
    start = int(np.argmax(P[:stop] >= REACHED * P[:stop].max()))
    segments = np.full(t.size, SEGMENTS[0], dtype="<U8")
    # the last part of a ramp before its end is as long as a short hold, and would hide it
    rise = int(np.argmax(P[:stop] >= NEAR * P[:stop].max()))
    knees = [_knee(t, y, rise, stop) for y in (load, depth)]
    held = [knee > start and _still(t, y, knee, stop) for knee, y in zip(knees, (P, h), strict=True)]
    if any(held):
        # at a constant depth the load bends later than the depth, at a constant load the depth later than the load
        start = min(itertools.compress(knees, held))
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


def runs_of(marks: np.ndarray) -> np.ndarray:
    """Return the number of the run of equal marks to which each point belongs, (n,), from 0."""
    return np.cumsum(np.append(False, marks[1:] != marks[:-1]))


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


def sample_noise(y: np.ndarray) -> float:
    """Return the standard deviation of white noise on a smooth curve, from its second differences."""
    return float(np.median(np.abs(np.diff(y, 2)))) / 0.6745 / 6**0.5


ONSET = 0.15  # fraction of the largest load up to which the law is fitted
SCAN = 61  # number of trial depths for the contact
LEAST = 5  # number of first points, whose median is the load in air
PRESENT = 0.5  # largest relative change of the load if the curve begins in contact
SURE = 5.0  # significant change of the depth in standard deviations of its noise
FEW = 2  # least number of points before contact
POWERS = np.array([1 / 2, 2 / 3, 1, 4 / 3, 5 / 3, 2, 7 / 3])  # powers of the sum, in units of p
WORSE = 20.0  # excess of a rejected sum of squares, in variances of a point
INDEPENDENT = 10  # least effective number of correlated residuals
ROUGH = 1e-3  # least standard deviation over the range of the load, as no law is exact
MOST = 400  # largest number of points, or means of neighbours, on which laws are compared


class FirstTouch(NamedTuple):
    """First contact in a curve.

    t [s], depth [m]: of the first contact; load [N]: the baseline; load_sign, depth_sign: +1 or -1, which make
    compression and indentation positive; before: number of samples before contact. t, depth, load as measured.
    """

    t: float
    depth: float
    load: float
    load_sign: int
    depth_sign: int
    before: int


def find_contact(
    t: np.ndarray, load: np.ndarray, depth: np.ndarray, at: float | None = None, power: float = 1.5,
    film: bool = False,
) -> FirstTouch:  # fmt: skip
    """Return the first contact of an approach curve t, load, depth (n,), at depth ``at`` [m] if that is known.

    power: of the law of the half-space; film: whether the body may be a film, whose load rises more steeply.

    Nothing is before contact, and load and depth are not shifted, in a curve that begins in contact: the load is
    present from the start, the depth does not change before the load rises, or the law describes the rise from the
    first sample on. The same holds for a hold whose load changes only in its last samples, or while the indenter
    retracts.
    """
    base = float(np.median(load[:LEAST]))
    force = np.abs(load - base)
    changed = force >= ONSET * force.max()
    first = int(np.argmax(changed))
    way = depth[first] - depth[0]
    moved = abs(way) > SURE * sample_noise(depth)
    back = way * (depth[first:][:LEAST][-1] - depth[max(first - 1, 0)]) < 0.0
    from_the_start = FirstTouch(float(t[0]), 0.0, 0.0, 1, 1, 0)
    if at is None and (force.max() <= PRESENT * abs(base) or not moved or back or changed.sum() < LEAST):
        return from_the_start
    depth_sign, load_sign = signs(load - base, depth)
    x, y = depth_sign * depth, load_sign * (load - base)
    top = int(np.argmax(y >= ONSET * y.max())) + 1
    rise = Rise(x[:top], y[:top], power)
    course = smooth(x[:top])
    # a tip that first moves outwards was not yet in contact
    began_outside = course[0] - course.min() > SURE * sample_noise(depth)
    point = rise.contact(film, began_outside) if at is None else depth_sign * at
    before = int(np.flatnonzero(x[:top] <= point).max(initial=-1)) + 1
    if at is None and (before < FEW or point == -np.inf):
        return from_the_start
    offset = base + load_sign * rise.single(point).offset
    began = np.interp(point, x[before - 1 : before + 1], t[before - 1 : before + 1]) if before else t[0]
    return FirstTouch(float(began), depth_sign * point, offset, load_sign, depth_sign, before)


def baseline(load: np.ndarray) -> float:
    """Return the median of the first tenth of a force (n,), before contact."""
    return float(np.median(load[: max(load.size // 10, 5)]))


def directions(data: Any) -> tuple[int, int]:
    """Return the signs of depth and load in an ``IndentationData`` before its retraction."""
    some = data.segments != "retract"
    load, depth = data.load[some], data.depth[some]
    return signs(load - baseline(load), depth)


def signs(load: np.ndarray, depth: np.ndarray) -> tuple[int, int]:
    """Return the signs (of the depth, of the load), +1 or -1.

    A tip moves inwards before the load rises, and the load is compressive at the largest depth. load (n,) counts from
    its baseline.
    """
    first = int(np.argmax(np.abs(load) >= ONSET * np.abs(load).max()))
    inward = -1 if depth[first] < depth[0] else 1
    deepest = int(np.argmax(inward * depth))
    return inward, -1 if load[deepest] < 0 else 1


class Rising(NamedTuple):
    """A law fitted to the rise of the load: residual (n,), over the range of the load; offset: the load before contact."""

    residual: np.ndarray
    offset: float

    @property
    def squares(self) -> float:
        return float(self.residual @ self.residual)


class Rise(NamedTuple):
    """The initial rise of the load: x, y (n,) depth and load, positive inwards; power: of a half-space."""

    x: np.ndarray
    y: np.ndarray
    power: float

    def contact(self, film: bool, began_outside: bool) -> float:
        """Return the depth of first contact, -inf if the curve begins in contact, as it cannot with ``began_outside``."""
        few = self._thinned()
        if few.x.size <= LEAST and not began_outside:
            return -np.inf
        laws = {law: few._best(law) for law in (few.single, few.summed)}
        best = min(laws, key=lambda law: law(laws[law]).squares)
        # The largest sum of squares that is not rejected against that of the best law. The variance of a point is at least
        # that of the measured noise. Correlated residuals, as where the best law does not describe the data, reduce the
        # effective number of points.
        residual = best(laws[best]).residual
        squares, n = float(residual @ residual), residual.size
        lag = float(residual[1:] @ residual[:-1]) / squares if squares > 0 else 0.0
        together = min((1.0 + lag) / (1.0 - lag), n / INDEPENDENT) if lag > 0 else 1.0
        variance = max(squares / n * together, sample_noise(few.y / few._range) ** 2, ROUGH**2)
        allowed = squares + WORSE * variance
        simple = few.single(laws[few.single]).squares <= allowed
        highest = 1.0 if simple and not film else POWERS[-1]
        if not began_outside and few.summed(float(few.x[0]), highest).squares <= allowed:
            return -np.inf
        return self._best(self.single) if simple else laws[few.summed]

    def single(self, point: float) -> "Rising":
        """Return the least-squares fit of y = b + c (x - point)^p, c >= 0."""
        return self._fit(point, np.array([self.power]))

    def summed(self, point: float, highest: float = POWERS[-1]) -> "Rising":
        """Return the least-squares fit of y = b + sum_i c_i (x - point)^p_i, c_i >= 0, p_i up to ``highest`` p."""
        return self._fit(point, POWERS[highest >= POWERS] * self.power)

    @property
    def _range(self) -> float:
        return float(np.ptp(self.y)) or 1.0

    def _thinned(self) -> "Rise":
        """Return means of neighbouring samples, at most ``MOST``."""
        each = -(-self.x.size // MOST)
        if each == 1:
            return self
        begins = np.arange(0, self.x.size, each)
        mean = lambda values: np.add.reduceat(values, begins) / np.diff(np.append(begins, values.size))
        return self._replace(x=mean(self.x), y=mean(self.y))

    def _best(self, law: Callable[[float], "Rising"]) -> float:
        """Return the depth with the smallest sum of squares: the best of a scan, refined between its neighbours."""
        trial = np.linspace(self.x.min(), self.x[-1], SCAN)
        best = int(np.argmin([law(point).squares for point in trial]))
        low, high = trial[max(best - 1, 0)], trial[min(best + 1, SCAN - 1)]
        error = lambda share: law(low + share * (high - low)).squares
        # the tolerance is an absolute 1e-5, hence the scaled variable
        found = scipy.optimize.minimize_scalar(error, bounds=(0.0, 1.0), method="bounded")
        return float(low + found.x * (high - low))

    def _fit(self, point: float, powers: np.ndarray) -> "Rising":
        past, y = np.maximum(self.x - point, 0.0) / (np.ptp(self.x) or 1.0), self.y / self._range
        laws = past[:, None] ** powers
        means, mid = laws.mean(0), y.mean()
        A, b = laws - means, y - mid
        if powers.size == 1:
            square = np.sum(A * A)
            c = np.maximum(A.T @ b / square, 0.0) if square > 0 else np.zeros(1)
        else:
            c = nonnegative(A, b)
        return Rising(b - A @ c, float(mid - means @ c) * self._range)


def tip_depth(
    path: str, t: np.ndarray, load: np.ndarray, height: np.ndarray, spring_constant: float | None
) -> tuple[np.ndarray, str]:
    """Return the depth of the tip of a cantilever, depth = z - load/k, z the displacement of its base towards the sample.

    The sign of z follows from the displacement before the load rises.

    Args:
        path: for messages.
        t: (n,) [s].
        load: (n,) [N].
        height: (n,) [m] of the base, either sign.
        spring_constant: k [N/m].

    Returns:
        (depth (n,) [m] from the first sample on, a note).

    Raises:
        ValueError: no spring constant, or not positive.
    """
    if spring_constant is None or not spring_constant > 0:
        raise ValueError(
            f"{path}: no depth, and a height needs the cantilever's spring_constant= > 0 [N/m]; "
            f"got {spring_constant!r}"
        )
    force = load - np.median(load[:LEAST])
    sign, _ = signs(force, height)
    depth = sign * (height - height[0]) - force / spring_constant
    return depth, f"depth from the height and load/k, k = {spring_constant:g} N/m, zero at the first sample"


# Viscous drag on a cantilever in liquid, from the baselines of approach and retraction.
#
#     measured force = force on the sample + b d(depth)/dt
#
# The drag bends a lever that moves through a liquid like a force on its tip, upwards in the approach and downwards in
# the retraction, in proportion to the velocity of the tip (J. Alcaraz et al., Langmuir 18, 716, 2002). Far from the
# sample both baselines are straight lines over depth with the same slope, whose distance is b times the difference of
# the velocities. A drift of the deflection between approach and retraction cannot be told from drag, and b is taken
# as constant, although it increases near the sample.


FAR = 0.4  # part of the way to a load of ``RISEN`` times the largest, from its beginning, that is taken as baseline
RISEN = 0.15
LEAST_BASELINE = 10  # fewest points of a baseline
BLOCKS = 10  # of each baseline, for the error of its mean with correlated noise
DEGREES = 2 * BLOCKS - 3  # of freedom of the standard deviation
# note of a reader on a curve that has no velocity (``IndentationData.numbered``)
UNTIMED = "the file has no times: the points are numbered in their place"
SMOOTH_VELOCITY = 200  # a velocity is the slope of a line through this part of a segment, on either side


class Drag(NamedTuple):
    """Drag coefficient b and its standard deviation sd [N s/m]; velocity [m/s] of the tip in the approach."""

    coefficient: float
    sd: float
    velocity: float


LOST = 0.5  # fraction of the lowest load that is lost when the contact breaks
# points of the running median of the load, and points without tension after the contact
MEDIAN_WIDTH, IN_A_ROW = 5, 3


def held(load: np.ndarray) -> np.ndarray:
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


def find_drag(data: Any) -> Drag:
    """Return the drag that the baselines of an ``IndentationData`` have; ValueError without two baselines, or times."""
    _check_times(data)
    branches = {name: np.flatnonzero(data.segments == name) for name in ("approach", "retract")}
    if any(some.size < LEAST_BASELINE for some in branches.values()):
        raise ValueError("drag: expected a curve with approach and retraction, got one without")
    inward, pushed = directions(data)
    t, load, depth = data.t, pushed * data.load, inward * data.depth
    first = branches["approach"]
    force = smooth(load[first]) - baseline(load[first])
    begin = max(depth[some].min() for some in branches.values())
    end = begin + FAR * (depth[first][np.argmax(force >= RISEN * force.max())] - begin)
    back = branches["retract"]
    after = load[back] - np.median(load[back[-LEAST_BASELINE:]])
    if after.min() < -SURE * sample_noise(load):  # a tip that sticks: the baseline begins where it has parted
        stuck = held(after)
        end = begin if stuck.all() else min(end, depth[back[int(np.argmin(stuck))]])
    places = [some[(depth[some] >= begin) & (depth[some] <= end)] for some in branches.values()]
    speeds = [
        float(np.polyfit(t[some], depth[some], 1)[0]) if some.size >= LEAST_BASELINE else 0.0
        for some in places
    ]
    if not speeds[0] > 0.0 > speeds[1]:
        raise ValueError(
            f"drag: expected baselines of at least {LEAST_BASELINE} points in approach and retraction, got"
            f" {places[0].size} and {places[1].size} points with {speeds[0]:.3g} and {speeds[1]:.3g} m/s"
        )
    # The drag is the coefficient of the velocity in parallel lines over depth; its standard deviation sums the residuals
    # over blocks and thus allows for their correlation.
    x = np.concatenate([depth[some] for some in places])
    v = np.repeat(speeds, [some.size for some in places])
    A = np.stack([np.ones(x.size), (x - x.mean()) / (np.ptp(x) or 1.0), v / speeds[0]], -1)
    inverse, y = np.linalg.pinv(A), np.concatenate([load[some] for some in places])
    found = inverse @ y
    parts = inverse[2] * (y - A @ found)
    cuts = [np.array_split(one, BLOCKS) for one in np.split(parts, [places[0].size])]
    sums = np.array([block.sum() for branch in cuts for block in branch])
    sd = float(np.sqrt(np.sum(sums**2) * sums.size / DEGREES)) / speeds[0]
    return Drag(found[2] / speeds[0], sd, speeds[0])


def without(data: Any, coefficient: float) -> np.ndarray:
    """Return the load (n,) [N] of an ``IndentationData`` without a drag [N s/m]; ValueError where it has no times."""
    _check_times(data)
    inward, pushed = directions(data)
    return data.load - inward * pushed * coefficient * tip_velocity(data)


def _check_times(data: Any) -> None:
    """Raise ValueError for numbered points, whose velocity is not known."""
    if data.numbered:
        raise ValueError("drag: expected a curve with times, got points that are numbered in their place")


def tip_velocity(data: Any) -> np.ndarray:
    """Return the rate of the measured depth (n,) [m/s]: slopes of lines through neighbouring points of each segment."""
    segments = data.segments
    cuts = np.flatnonzero(segments[1:] != segments[:-1]) + 1
    parts = np.split(np.arange(data.t.size), cuts)
    return np.concatenate([_slopes(data.t[part], data.depth[part]) for part in parts])


def _slopes(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the slopes (n,) of lines through the points at most n/``SMOOTH`` places away; 0 where time stands still."""
    n, reach = t.size, max(t.size // SMOOTH_VELOCITY, 3)
    low, high = np.maximum(np.arange(n) - reach, 0), np.minimum(np.arange(n) + reach + 1, n)
    t, y = t - t.mean(), y - y.mean()
    sums = [np.concatenate([[0.0], np.cumsum(q)]) for q in (t, y, t * y, t * t)]
    T, Y, TY, TT = ((total[high] - total[low]) / (high - low) for total in sums)
    spread = TT - T * T
    moving = spread > 1e-12 * np.max(TT, initial=0.0)
    return np.where(moving, (TY - T * Y) / np.where(moving, spread, 1.0), 0.0)


# least drag in standard deviations, and as a part of the largest force, for a note
SEEN_DRAG, DRAG_PART = 4.0, 0.01


def check_drag(drag: Any) -> None:
    """Raise ValueError for anything but a coefficient of a drag, "fit" or None."""
    known = isinstance(drag, int | float | np.number) and 0.0 <= drag < np.inf
    if drag is not None and not (isinstance(drag, str) and drag == "fit") and not known:
        raise ValueError(f'drag: expected a coefficient >= 0 N s/m, "fit" or None, got {drag!r}')


def without_drag(data: Any, drag: float | str | None) -> tuple[Any, Drag | None, tuple[str, ...]]:
    """Return an ``IndentationData`` without drag, the drag that was subtracted, None without a correction, and notes;
    ValueError on bad input, and where the baselines show none.

    While the tip moves at a constant speed the drag is part of the baseline. In contact a soft lever slows the tip down, so
    that the drag decreases as the force increases.
    """
    if drag is None:
        try:
            found = find_drag(data)
        except ValueError:
            return data, None, ()
        shift = found.coefficient * found.velocity
        part = shift / float(np.ptp(data.load))
        if found.coefficient < SEEN_DRAG * found.sd or part < DRAG_PART:
            return data, None, ()
        note = (
            f"the baseline of the approach is {2e12 * shift:.3g} pN above that of the retraction, as by a drag of"
            f" {found.coefficient:.3g} N s/m on the lever in liquid, {100 * part:.2g} % of the largest force on either side:"
            ' drag="fit" subtracts it, which matters where the tip slows down in contact'
        )
        return data, None, (note,)
    check_drag(drag)
    if isinstance(drag, str):
        found = find_drag(data)
        if found.coefficient < -SEEN_DRAG * found.sd:
            raise ValueError(
                f"drag: expected a baseline of the approach above that of the retraction, got it"
                f" {-2e12 * found.coefficient * found.velocity:.3g} pN below: a drift, which is no drag"
            )
        found = found._replace(coefficient=max(found.coefficient, 0.0))
    else:
        found = Drag(float(drag), 0.0, 0.0)
    return data.without_drag(found.coefficient), found, ()


# The force curve of a cantilever as fits take it: signs, zeros, a baseline that is not too long, means of neighbours.


PICO = 1e12
LEAST_CURVE = 10  # fewest points of an approach
# running median of the load over the standard deviation of its noise below which there is no contact
QUIET = 3.0
BASE = 3.0  # longest baseline before and after the contact, in largest depths
NO_CONTACT = (
    "data: expected a force that rises with depth, got none: no contact in the curve, or a sample too stiff to"
    " indent"
)


class ForceCurve(NamedTuple):
    """A force curve: t [s], load [N] and depth [m] (n,), positive inwards, from the first point on; kept (n,) bool: points
    that are fitted, while all of them are history; marks (n,) of its parts, integers; parts: name of each.

    zero [m]: inward depth of the first point; inward: its sign in the file; each: number of samples in a point; notes.
    """

    t: np.ndarray
    load: np.ndarray
    depth: np.ndarray
    kept: np.ndarray
    marks: np.ndarray
    parts: tuple[str, ...]
    zero: float
    inward: int
    each: int
    notes: tuple[str, ...]

    @classmethod
    def approach(cls, data: Any) -> "ForceCurve":
        """Return the approach of an ``IndentationData`` up to its largest depth; ValueError for fewer than 10 points."""
        some = data.segments == "approach"
        marked = some.sum() >= LEAST_CURVE
        if not marked:  # up to the largest depth
            some = np.ones(data.t.size, dtype=bool)
        t, load, depth = data.t[some], data.load[some], data.depth[some]
        force = load - baseline(load)
        inward, pushed = signs(force, depth)
        if marked:  # on a stiff sample the largest depth may be where the tip snaps in
            pushed = -1 if force[-1] < 0 else 1
        zero, depth, load = float(inward * depth[0]), inward * (depth - depth[0]), pushed * load
        stop = int(np.argmax(depth)) + 1
        if stop < LEAST_CURVE:
            rise, scatter = float(np.max(np.abs(smooth(force)))), sample_noise(load)
            # the directions above follow from noise
            if some.sum() >= LEAST_CURVE and rise <= QUIET * scatter:
                raise ValueError(_no_rise(rise, scatter))
            raise ValueError(
                f"data: expected an approach of at least {LEAST_CURVE} points with a force that rises with depth, got {stop}"
                f" of {some.size} points up to the largest depth"
            )
        notes = () if stop == some.size else (f"approach: {stop} of {some.size} points",)
        kept, marks = np.ones(stop, dtype=bool), np.zeros(stop, dtype=int)
        return cls(
            t[:stop] - t[0], load[:stop], depth[:stop], kept, marks, ("approach",), zero, inward, 1,
            (*notes, *_turned(inward, pushed)),
        )  # fmt: skip

    @classmethod
    def whole(cls, data: Any) -> "ForceCurve":
        """Return all segments of an ``IndentationData``; ValueError without times, an approach, or contact."""
        if data.numbered:
            raise ValueError(
                "data: expected a curve with times for a viscoelastic model, got numbered points"
            )
        segments = data.segments
        first = segments == "approach"
        if first.sum() < LEAST_CURVE:
            raise ValueError(
                f"data: expected an approach of at least {LEAST_CURVE} points, got {int(first.sum())}"
            )
        force = data.load[first] - baseline(data.load[first])
        inward, pushed = signs(force, data.depth[first])
        load, depth = pushed * data.load, inward * data.depth
        rise, scatter = float(np.max(smooth(pushed * force))), sample_noise(data.load[first])
        if rise <= QUIET * scatter:
            raise ValueError(_no_rise(rise, scatter))
        marks = runs_of(segments)
        parts = tuple(str(segments[marks == mark][0]) for mark in range(marks[-1] + 1))
        zero, kept = float(depth[0]), np.ones(load.size, dtype=bool)
        notes = _turned(inward, pushed)
        return cls(data.t - data.t[0], load, depth - zero, kept, marks, parts, zero, inward, 1, notes)

    def near_contact(self, point: float) -> "ForceCurve":
        """Return the curve without the baselines further than ``BASE`` largest depths from a contact point [m]."""
        reach = point - BASE * (float(np.max(self.depth)) - point)
        inside = np.flatnonzero(self.depth >= reach)
        some = slice(inside[0], inside[-1] + 1)
        left = self.t.size - (some.stop - some.start)
        if not left:
            return self
        note = f"baseline: {left} points further than {BASE:g} largest depths from the contact left out"
        t, depth = self.t[some], self.depth[some]
        return self._replace(
            t=t - t[0], load=self.load[some], depth=depth - depth[0], kept=self.kept[some], marks=self.marks[some],
            zero=self.zero + float(depth[0]), notes=(*self.notes, note),
        )  # fmt: skip

    def thinned(self, most: int) -> "ForceCurve":
        """Return means of neighbouring points of each part, at most about ``most``."""
        each = -(-self.t.size // most)
        if each == 1:
            return self
        rows: list[tuple[np.ndarray, ...]] = []
        for mark in np.unique(self.marks):
            own = np.flatnonzero(self.marks == mark)
            count = own.size // each
            # the remainder is left out where it matters least, at the beginning and at the end
            own = own[own.size - count * each :] if not rows else own[: count * each]
            shaped = own.reshape(count, each)
            means = (y[shaped].mean(1) for y in (self.t, self.load, self.depth))
            rows.append((*means, self.kept[shaped].all(1), np.full(count, mark)))
        t, load, depth, kept, marks = (np.concatenate(one) for one in zip(*rows, strict=True))
        return self._replace(
            t=t - t[0], load=load, depth=depth - depth[0], kept=kept, marks=marks, zero=self.zero + float(depth[0]),
            each=each * self.each,
        )  # fmt: skip

    def recalibrated(self, change: float, spring_constant: float | None) -> "ForceCurve":
        """Return the curve with the sensitivity of the cantilever changed by a part of it; spring_constant [N/m]."""
        deflection = self.load / float(spring_constant or 1.0)
        depth = self.depth - change * (deflection - deflection[0])
        return self._replace(load=self.load * (1.0 + change), depth=depth)

    @property
    def remarks(self) -> tuple[str, ...]:
        """The notes, and one on points that are means."""
        if self.each == 1:
            return self.notes
        return (*self.notes, f"{int(self.kept.sum())} points are means of {self.each} samples each")


class ForceUnits(NamedTuple):
    """Units of a scaled force curve: load [N], depth [m], time [s] and compliance [1/Pa]."""

    load: float
    depth: float
    time: float
    compliance: float

    @classmethod
    def of(cls, curve: ForceCurve, depth: float, probe: Any, one_minus_nu: float) -> "ForceUnits":
        """Return the ranges of a curve with the largest depth [m], and the compliance with which a ``Probe`` on a half-space
        has the unit of load at the unit of depth."""
        load, T = float(np.ptp(curve.load)), float(curve.t[-1])
        compliance = probe.size * depth**probe.power / (one_minus_nu * load) if load > 0.0 else math.inf
        return cls(load, depth, T, compliance)

    def check(self) -> None:
        """Raise ValueError where nothing changes in the curve."""
        load, depth, T, _ = self
        if not (load > 0.0 and depth > 0.0 and T > 0.0):
            raise ValueError(
                f"data: expected load, depth and time to change, got ranges {load:g} N, {depth:g} m, {T:g} s"
            )


def _no_rise(rise: float, scatter: float) -> str:
    return (
        f"data: expected a force that rises with depth, got one within {rise:.2g} N of its baseline, where its"
        f" noise is {scatter:.2g} N: no contact in the curve"
    )


def _turned(inward: int, pushed: int) -> tuple[str, ...]:
    """Return notes on signs that were changed."""
    pairs = ("depth", inward), ("load", pushed)
    return tuple(f"{name} with the other sign" for name, sign in pairs if sign < 0)


# Errors of the calibration of a cantilever in the interval of a modulus.
#
# The force is k s V, with the spring constant k, the sensitivity s and the measured voltage V, and the depth is the
# height minus the deflection s V. The modulus is proportional to k; its change with s is found by fits to curves with
# s increased and decreased. Both errors are independent of the noise of the curve, so that in the logarithm of the
# modulus half an interval w becomes
#
#     (w^2 + z^2 (e_k^2 + (dlnG/dln s)^2 e_s^2))^(1/2)
#
# with the relative standard deviations e and the quantile z of the level.


STEP = 0.02  # relative change of the sensitivity in the difference quotient
KINDS = ("spring_constant", "sensitivity")


def by_sensitivity(logs: Callable[[float], Any]) -> Any:
    """Return the derivative of logarithms by that of the sensitivity; logs(change): of the fit to the curve
    ``recalibrated`` by a change."""
    return (logs(STEP) - logs(-STEP)) / math.log((1.0 + STEP) / (1.0 - STEP))


def calibration_in_words(errors: dict[str, float]) -> str:
    """Return the errors of a calibration as text."""
    kinds = ", ".join(f"{name.replace('_', ' ')} {100 * value:.3g} %" for name, value in errors.items())
    return f"calibration ({kinds})"
