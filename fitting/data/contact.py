"""Detection of first contact in an indentation curve: the zeros of time, depth and load, and the signs of load and
depth.

Before contact the load is constant. After it the load on a half-space depends on the depth as

    load = b + c (depth - d)^p,   p = 3/2 for a ball (``probe.py``).

A film adds higher powers of the depth with positive coefficients (E. K. Dimitriadis et al., Biophys. J. 82 (2002) 2798:
powers 3/2, 2, 5/2, 3, 7/2 for a ball), and creep during the approach lowers the power. A sum of powers with
coefficients >= 0 covers all these cases. A curve has points before contact only if no such sum that begins at its first
sample describes the initial rise of the load to within its scatter; for a half-space the powers end at p, if p alone
describes the rise from some depth on. Then d is that of the single power p where this describes the data as well as the
sum, else that of the sum. A curve that was cut at d is described by the same law from its first sample on, so nothing
more is found before contact in it.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy

from fitting.data.segments import noise, smooth

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
    moved = abs(way) > SURE * noise(depth)
    back = way * (depth[first:][:LEAST][-1] - depth[max(first - 1, 0)]) < 0.0
    whole = FirstTouch(float(t[0]), 0.0, 0.0, 1, 1, 0)
    if at is None and (force.max() <= PRESENT * abs(base) or not moved or back or changed.sum() < LEAST):
        return whole
    depth_sign, load_sign = signs(load - base, depth)
    x, y = depth_sign * depth, load_sign * (load - base)
    top = int(np.argmax(y >= ONSET * y.max())) + 1
    rise = Rise(x[:top], y[:top], power)
    course = smooth(x[:top])
    lifted = course[0] - course.min() > SURE * noise(depth)  # then the curve did not begin in contact
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
        variance = max(squares / n * together, noise(self.y / self._range) ** 2, ROUGH**2)
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
            c = scipy.optimize.nnls(A, b)[0]
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
