"""Resampling of a long curve to means over steps of the logarithm of time, with their standard errors.

The mean of a curve over a bin is its value at the mean time plus half its curvature times the variance of the times.
The latter is subtracted, by means of the parabola through the means of five bins. Neighbouring samples may have
correlated noise: an AR(1) series whose correlation rho is estimated from the deviations from a parabola within the bins
of many samples. Then n of them are equivalent to n (1 - rho)/(1 + rho) independent ones (G. E. P. Box, G. M. Jenkins,
Time Series Analysis, 1976). This holds for a few samples only if they belong to a long series, so single samples in a
row are given the same reduced weight. Only the ratios of these errors are passed on: a fit estimates their size, and
any remaining correlation of the means, from its own residuals, as for any curve.
"""

import dataclasses
import math

import numpy as np

from fitting.data.contact import runs_of, sample_noise
from fitting.data.creep import CreepData
from fitting.data.indentation import IndentationData, origin_of
from fitting.data.moduli import RelaxationData
from fitting.data.weights import error_ratio
from fitting.inference.noise import BEYOND_CHANCE

FEW = 4  # number of samples in a bin below which they are kept unchanged
LONG = 30  # number of samples of a bin from which the correlation is estimated
STEP = 0.1  # change of the stress at a jump, as a fraction of its maximum
LATE = 0.15  # fraction of a time span after which its bins no longer grow
SURE, SAME = 3.0, 1e-6  # tolerances of reaching a level, in units of its noise and of its range
MOST = 0.99  # largest rho


Timed = CreepData | RelaxationData | IndentationData


def resample(data: Timed, per_decade: float = 20) -> Timed:
    """Average a curve over bins that are equal in the logarithm of time at first and equal in time later.

    Time counts from the loading of a creep curve and from each of its jumps, from the strain step of a relaxation, and
    from the start of each segment of an indentation; no bin crosses a boundary. After 15 % of each such span the bins no
    longer grow. The first and last samples of each span, and samples in bins of fewer than four, are kept unchanged.
    Known standard deviations become those of the means. Without them, ``scatter`` has the ratios of the errors of the
    means, which a fit uses as weights; correlation between neighbours is accounted for. Spikes are averaged into the
    mean of their bin.

    Args:
        data: the curve; an indentation ``in_contact``.
        per_decade: number of bins in each decade of time.

    Returns:
        The means, at the mean times of their samples, with a note.

    Raises:
        ValueError: data of another type, a number of bins that is not positive, or fewer than 5 points left.

    Example:
        >>> t = np.arange(1.0, 10001.0)
        >>> short = fitting.resample(fitting.CreepData(t=t, J=1e-6 * t**0.2))
        >>> print(short.t.size)
        115
    """
    if not isinstance(data, Timed):
        raise ValueError(
            f"data: expected CreepData, RelaxationData or IndentationData, got {type(data).__name__}"
        )
    if not (isinstance(per_decade, int | float | np.number) and 0.0 < per_decade < math.inf):
        raise ValueError(f"per_decade: expected a number > 0, got {per_decade!r}")
    if isinstance(data, RelaxationData):
        bins = _Bins(data.t, np.zeros(data.t.size, dtype=int), 0.0, float(per_decade))
        rho = bins.correlation(data.modulus)
        error = bins.error(np.hypot(error_ratio(data.t, data.modulus), data.modulus), rho)
        return dataclasses.replace(
            data, t=bins.mean(data.t), modulus=bins.value(data.modulus), scatter=error, notes=(*data.notes, bins.note(rho))
        )  # fmt: skip
    return (_creep if isinstance(data, CreepData) else _indentation)(data, float(per_decade))


def _creep(data: CreepData, per_decade: float) -> CreepData:
    values = data.strain if data.J is None else data.J
    # the interval between jumps of the stress in which a sample lies
    spell = np.zeros(data.t.size, dtype=int)
    if data.stress is not None:
        knots, level = data.stress
        jump = np.flatnonzero(np.abs(np.diff(level)) > STEP * np.max(np.abs(level)))
        cuts = np.unique(np.concatenate([knots[jump], knots[jump + 1]]))
        spell = np.searchsorted(cuts, data.t, side="right")
    bins = _Bins(data.t, spell, data.t[0] if data.stress else 0.0, per_decade)
    rho, known = bins.correlation(values), data.sigma is not None
    raw = data.sigma if known else np.hypot(error_ratio(data.t, values), values)
    error = bins.error(raw, rho)
    stress = data.stress
    if stress is not None and stress[0].size == data.t.size:  # measured with the strain
        stress = bins.mean(data.t), bins.value(stress[1])
    return CreepData(
        t=bins.mean(data.t), **{"strain" if data.J is None else "J": bins.value(values)}, stress=stress,
        convention=data.convention, nu=data.nu, notes=(*data.notes, bins.note(rho)), start=data.start,
        **{"sigma" if known else "scatter": error},
    )  # fmt: skip


def _indentation(data: IndentationData, per_decade: float) -> IndentationData:
    marks = data.segments
    # the segment of each sample; a hold marked before its level is reached is split there
    part, hold = runs_of(marks), np.flatnonzero(marks == "hold")
    if hold.size:
        late = hold[hold.size // 2 :]
        held = min((data.load, data.depth), key=lambda y: np.ptp(y[late]) / (np.ptp(y) or 1.0))
        off = np.abs(held[hold] - np.median(held[hold]))
        part[hold[np.argmax(off <= SURE * sample_noise(held) + SAME * np.ptp(held))] :] += 1
    bins = _Bins(data.t, part, data.t[0], per_decade)
    errors, rhos = {}, []
    for name, values, sigma in (
        ("depth", data.depth, data.sigma_depth),
        ("load", data.load, data.sigma_load),
    ):
        rhos.append(bins.correlation(values))
        raw = np.ones(data.t.size) if sigma is None else sigma
        errors[f"{'scatter' if sigma is None else 'sigma'}_{name}"] = bins.error(raw, rhos[-1])
    return IndentationData(
        t=bins.mean(data.t), load=bins.value(data.load), depth=bins.value(data.depth), marks=marks[bins.first],
        whole=data.whole_curve(), notes=(*data.notes, bins.note(max(rhos))),
        **origin_of(data), **errors,
    )  # fmt: skip


class _Bins:
    """Bins of a curve. which (n,): the bin of each sample; first, count (m,): first sample and number of samples of
    each bin."""

    def __init__(self, t: np.ndarray, spell: np.ndarray, begin: float, per_decade: float) -> None:
        starts = np.flatnonzero(np.diff(spell, prepend=spell[0] - 1))
        piece = np.cumsum(np.isin(np.arange(t.size), starts)) - 1
        since = t - np.append(begin, t[starts[1:]])[piece]
        ends = np.append(starts[1:], t.size) - 1
        turn = (since[ends] * LATE)[piece]
        with np.errstate(divide="ignore", invalid="ignore"):
            late = np.where(since > turn, (since / turn - 1.0) / math.log(10.0), 0.0)
            step = np.floor(per_decade * (np.log10(np.minimum(since, turn)) + late))
        new = np.append(True, (np.diff(spell) != 0) | (step[1:] != step[:-1]))
        new[starts] = True
        new[np.minimum(starts + 1, t.size - 1)] = True  # the first sample has a bin of its own
        new[ends] = True  # and so does the last
        which = np.cumsum(new) - 1
        new |= np.bincount(which)[which] < FEW
        self.which, self.first = np.cumsum(new) - 1, np.flatnonzero(new)
        self.count = np.bincount(self.which)
        self.t, self.per_decade, self.spell = t, per_decade, spell[self.first]

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Return the means (m,) of values (n,) over the bins."""
        return np.bincount(self.which, weights=values) / self.count

    def value(self, values: np.ndarray) -> np.ndarray:
        """Return the values (m,) at the mean times: the means of values (n,) minus the contribution of the curvature."""
        t, y = self.mean(self.t), self.mean(values)
        spread, bent = self.mean(self._centred(self.t) ** 2), np.zeros(t.size)
        for i in np.flatnonzero(spread > 0.0).tolist():
            near = np.arange(max(i - 2, 0), min(i + 3, t.size))
            near = near[self.spell[near] == self.spell[i]]
            if near.size > 3:
                x = (t[near] - t[i]) / np.ptp(t[near])
                bent[i] = np.polyfit(x, y[near], 2, w=np.sqrt(self.count[near]))[0] / np.ptp(t[near]) ** 2
        return y - bent * spread

    def error(self, single: np.ndarray, rho: float) -> np.ndarray:
        """Return the standard deviations (m,) of the means of samples with standard deviations ``single`` (n,)."""
        return np.sqrt(self.mean(single**2) / self.count * (1.0 + rho) / (1.0 - rho))

    def correlation(self, values: np.ndarray) -> float:
        """Return rho of the noise of values (n,), 0 where it is not significant or too few bins are large enough.

        For an AR(1) series the mean squares of y_(i+2) - y_i and y_(i+1) - y_i have the ratio 1 + rho, whatever its
        mean.
        """
        x = self._centred(self.t)
        rest = self._less(self._centred(values), x)
        rest = self._less(rest, self._less(self._centred(x * x), x))
        level = np.sqrt(np.bincount(self.which, weights=rest**2) / self.count)
        use = (self.count >= LONG) & (level > 0.0)
        rest = rest / np.where(use, level, 1.0)[self.which]
        near, far = (
            (rest[k:] - rest[:-k])[(self.which[k:] == self.which[:-k]) & use[self.which[k:]]] for k in (1, 2)
        )
        if far.size == 0:
            return 0.0
        rho = float(np.mean(far**2) / np.mean(near**2)) - 1.0
        return min(rho, MOST) if rho > 2.0 * BEYOND_CHANCE / math.sqrt(far.size) else 0.0

    def _centred(self, y: np.ndarray) -> np.ndarray:
        return y - self.mean(y)[self.which]

    def _less(self, y: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return y minus its projection on x in each bin, (n,)."""
        along, square = (np.bincount(self.which, weights=x * other) for other in (y, x))
        return y - x * (along / np.where(square > 0, square, 1.0))[self.which]

    def note(self, rho: float) -> str:
        """Return a note on the resampling."""
        means, n = int(np.sum(self.count > 1)), self.which.size
        shared = f"; noise of neighbours correlated by {rho:.2f}" if rho else ""
        decade = f"{self.per_decade:g} points a decade"
        return f"resampled, {decade}: {self.count.size} of {n} points left, {means} of them means{shared}"
