"""Detection of first contact in an indentation curve: the zeros of time, depth and load, and the signs of load and
depth.

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

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy

from fitting.data.nonnegative import nonnegative

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
    deepest = h.size - int(np.argmax(h[::-1] >= h.max() - 3 * sample_noise(depth)))
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
    whole = FirstTouch(float(t[0]), 0.0, 0.0, 1, 1, 0)
    if at is None and (force.max() <= PRESENT * abs(base) or not moved or back or changed.sum() < LEAST):
        return whole
    depth_sign, load_sign = signs(load - base, depth)
    x, y = depth_sign * depth, load_sign * (load - base)
    top = int(np.argmax(y >= ONSET * y.max())) + 1
    rise = Rise(x[:top], y[:top], power)
    course = smooth(x[:top])
    lifted = course[0] - course.min() > SURE * sample_noise(depth)  # then the curve did not begin in contact
    point = rise.contact(film, lifted) if at is None else depth_sign * at
    before = int(np.flatnonzero(x[:top] <= point).max(initial=-1)) + 1
    if at is None and (before < FEW or point == -np.inf):
        return whole
    offset = base + load_sign * rise.single(point).offset
    began = np.interp(point, x[before - 1 : before + 1], t[before - 1 : before + 1]) if before else t[0]
    return FirstTouch(float(began), depth_sign * point, offset, load_sign, depth_sign, before)


def baseline(load: np.ndarray) -> float:
    """Return the median of the first tenth of a force (n,), before contact."""
    return float(np.median(load[: max(load.size // 10, 5)]))


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

    def contact(self, film: bool, lifted: bool) -> float:
        """Return the depth of first contact, -inf if the curve begins in contact."""
        few = self._thinned()
        if few.x.size <= LEAST and not lifted:
            return -np.inf
        laws = {law: few._best(law) for law in (few.single, few.summed)}
        best = min(laws, key=lambda law: law(laws[law]).squares)
        allowed = few._allowed(best(laws[best]).residual)
        simple = few.single(laws[few.single]).squares <= allowed
        highest = 1.0 if simple and not film else POWERS[-1]
        if not lifted and few.summed(float(few.x[0]), highest).squares <= allowed:
            return -np.inf
        return self._best(self.single) if simple else laws[few.summed]

    def _allowed(self, residual: np.ndarray) -> float:
        """Return the largest sum of squares that is not rejected against that of the best law, whose residual is given,
        (n,).

        The variance of a point is at least that of the measured noise. Correlated residuals, as where the best law does
        not describe the data, reduce the effective number of points.
        """
        squares, n = float(residual @ residual), residual.size
        lag = float(residual[1:] @ residual[:-1]) / squares if squares > 0 else 0.0
        together = min((1.0 + lag) / (1.0 - lag), n / INDEPENDENT) if lag > 0 else 1.0
        variance = max(squares / n * together, sample_noise(self.y / self._range) ** 2, ROUGH**2)
        return squares + WORSE * variance

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


def find_drag(data: Any) -> Drag:
    """Return the drag that the baselines of an ``IndentationData`` have; ValueError without two baselines, or times."""
    _check_times(data)
    branches = {name: np.flatnonzero(data.segments == name) for name in ("approach", "retract")}
    if any(some.size < LEAST_BASELINE for some in branches.values()):
        raise ValueError("drag: expected a curve with approach and retraction, got one without")
    inward, pushed = _signs(data)
    t, load, depth = data.t, pushed * data.load, inward * data.depth
    first = branches["approach"]
    force = smooth(load[first]) - baseline(load[first])
    begin = max(depth[some].min() for some in branches.values())
    end = begin + FAR * (depth[first][np.argmax(force >= RISEN * force.max())] - begin)
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
    coefficient, sd = _offset([depth[some] for some in places], [load[some] for some in places], speeds)
    return Drag(coefficient, sd, speeds[0])


def without(data: Any, coefficient: float) -> np.ndarray:
    """Return the load (n,) [N] of an ``IndentationData`` without a drag [N s/m]; ValueError where it has no times."""
    _check_times(data)
    inward, pushed = _signs(data)
    return data.load - inward * pushed * coefficient * tip_velocity(data)


def _check_times(data: Any) -> None:
    """Raise ValueError for numbered points, whose velocity is not known."""
    if data.numbered:
        raise ValueError("drag: expected a curve with times, got points that are numbered in their place")


def _signs(data: Any) -> tuple[int, int]:
    """Return the signs of depth and load in the approach."""
    some = data.segments != "retract"
    load, depth = data.load[some], data.depth[some]
    return signs(load - baseline(load), depth)


def _offset(depths: list[np.ndarray], loads: list[np.ndarray], speeds: list[float]) -> tuple[float, float]:
    """Return the coefficient of the velocity in parallel lines over depth, and its standard deviation, which sums the
    residuals over blocks and thus allows for their correlation."""
    x = np.concatenate(depths)
    v = np.repeat(speeds, [one.size for one in depths])
    A = np.stack([np.ones(x.size), (x - x.mean()) / (np.ptp(x) or 1.0), v / speeds[0]], -1)
    inverse = np.linalg.pinv(A)
    y = np.concatenate(loads)
    found = inverse @ y
    parts = inverse[2] * (y - A @ found)
    cuts = [np.array_split(one, BLOCKS) for one in np.split(parts, [depths[0].size])]
    sums = np.array([block.sum() for branch in cuts for block in branch])
    count = sums.size
    return found[2] / speeds[0], float(np.sqrt(np.sum(sums**2) * count / DEGREES)) / speeds[0]


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
