"""Time-temperature superposition: shift factors of curves at several temperatures, and the law that they follow."""

import dataclasses
import functools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy import special

import jaxcontact as jc
from fitting.data.creep import CreepData
from fitting.data.curves import given_twice
from fitting.data.moduli import OscillationData, RelaxationData
from fitting.fits.growth import BOLTZMANN
from fitting.inference import noise
from fitting.inference.result import Conclusion, Fit, FitProblem, conclude, least_squares, plain
from fitting.inference.sample import Assessment, Sample
from fitting.models.parameters import Parameters
from fitting.models.structure import ParameterList, Sought, limits
from fitting.search import nonlinear
from fitting.search.nonlinear import Objective, linear_sd
from fitting.views import sheet

# Master curve of time-temperature superposition: a cubic spline over the logarithm of the reduced frequency.
#
# A curve measured at temperature T, of complex moduli G*(omega) or of a modulus G(t), lies on the master curve f if
#
#     ln b_T G(omega, T) = f(ln omega + ln a_T),
#
# with the shift factor a_T of the times and the vertical factor b_T of the moduli. For moduli over frequency, f has
# two parts, ln |G*| and the phase angle, so that errors in proportion to |G*| are equal in both; for moduli over
# time, omega is 1/t. Each part is a cubic B-spline with equidistant knots over the range of the shifted data. Source:
# J. D. Ferry, Viscoelastic Properties of Polymers, 3rd ed., 1980, ch. 11.


class Sweeps(NamedTuple):
    """Curves at several temperatures one after the other.

    temperature (m,) [K], increasing; reference: place of the reference among them; x (n,): logarithm of the frequency
    [rad/s], or of 1/t; y (n,): logarithm of the modulus [Pa], or phase angle [rad]; which, part, block (n,): place of the
    temperature, 1 for a phase angle, and number of the measured curve.
    """

    temperature: np.ndarray
    reference: int
    x: np.ndarray
    y: np.ndarray
    which: np.ndarray
    part: np.ndarray
    block: np.ndarray

    @property
    def parts(self) -> int:
        """Number of parts of the master curve, 1 or 2."""
        return int(self.part.max()) + 1

    @property
    def others(self) -> np.ndarray:
        """Places (m - 1,) of the temperatures other than the reference."""
        return np.delete(np.arange(self.temperature.size), self.reference)


class Master(NamedTuple):
    """A master curve at given shifts.

    values, slope (n, parts (K + 3)): basis of the coefficients at the shifted data, with a block for each part, and its
    derivative with respect to the place u in knot intervals; u (n,); ends: smallest and largest shifted x, and their curves.
    """

    values: np.ndarray
    slope: np.ndarray
    u: np.ndarray
    ends: tuple[float, float, int, int]


def spline_basis(u: np.ndarray, intervals: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the cubic B-splines (n, intervals + 3) at places u (n,) in knot intervals, and their derivatives."""
    i = np.clip(np.floor(u), 0, intervals - 1).astype(int)
    t = u - i
    four = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], -1) / 6.0
    rise = np.stack([-((1 - t) ** 2), 3 * t**2 - 4 * t, -3 * t**2 + 2 * t + 1, t**2], -1) / 2.0
    values, slope = np.zeros((2, u.size, intervals + 3))
    rows, columns = np.arange(u.size)[:, None], i[:, None] + np.arange(4)
    values[rows, columns], slope[rows, columns] = four, rise
    return values, slope


def master(sweeps: Sweeps, shifts: np.ndarray, intervals: int) -> Master:
    """Return the basis of the master curve at ln a_T (m,)."""
    x = sweeps.x + shifts[sweeps.which]
    first, last = int(np.argmin(x)), int(np.argmax(x))
    u = intervals * (x - x[first]) / (x[last] - x[first])
    ends = float(x[first]), float(x[last]), int(sweeps.which[first]), int(sweeps.which[last])
    # the columns of each part of a point stand in a block of their own, (n, parts k)
    on = [(sweeps.part == k)[:, None] for k in range(sweeps.parts)]
    both = [np.concatenate([one * here for here in on], axis=1) for one in spline_basis(u, intervals)]
    return Master(both[0], both[1], u, ends)


def by_shift(found: Master, coefficients: np.ndarray, sweeps: Sweeps, intervals: int) -> np.ndarray:
    """Return the derivative (n, m) of the master curve at the data with respect to ln a_T, knots moving included."""
    low, high, first, last = found.ends
    rise = found.slope @ coefficients * intervals / (high - low)
    count, share = sweeps.temperature.size, found.u / intervals
    own = np.eye(count)[sweeps.which]
    own[:, first] -= 1.0 - share
    own[:, last] -= share
    return rise[:, None] * own


@dataclasses.dataclass(frozen=True, eq=False)
class ShiftStructure(ParameterList):
    """A law of the shift factor about a reference temperature [K] as the list of its parameters; ``dict`` for no law."""

    reference: float = 0.0

    def material(self, values: dict[str, Any], volume: Any) -> Any:
        """Return the law, or the shift factors by name where there is none."""
        return values if self.model is dict else self.model(**values, reference=self.reference)


@functools.partial(jax.jit, static_argnames="law")
def log_factors(law: type, parameters: Any, reference: Any, temperature: Any) -> tuple[Any, Any]:
    """Return ln a_T (m,) of a law at temperatures (m,), and the derivatives (m, k) by the logarithms of its parameters."""
    shifts = lambda z: law(*jnp.exp(z), reference).log_factor(temperature)
    z = jnp.log(jnp.asarray(parameters, dtype=float))
    return shifts(z), jax.jacfwd(shifts)(z)


# Preparation of curves at several temperatures for their superposition.


KINDS = (OscillationData, RelaxationData, CreepData)
SAME = 0.5  # difference [K] below which temperatures are one
LEAST = 3  # fewest temperatures
CONSTANT = 1e-9  # change of the logarithm of a modulus, and of a phase, by rounding


def checked(data: Any) -> tuple[Any, ...]:
    """Return the curves; ValueError unless they are of one kind and have their temperatures."""
    several = tuple(data) if isinstance(data, Sequence) else ()
    kinds = sorted({type(one).__name__ for one in several}) or [type(data).__name__]
    if len(kinds) > 1 or not all(isinstance(one, KINDS) for one in several) or not several:
        names = ", ".join(kind.__name__ for kind in KINDS)
        raise ValueError(f"data: expected a list of curves of one kind of {names}, got {', '.join(kinds)}")
    without = sum(one.temperature is None for one in several)
    if without:
        raise ValueError(
            f"data: expected the temperature of every curve, got none for {without} of {len(several)}"
        )
    if isinstance(several[0], CreepData) and any(one.J is None for one in several):
        raise ValueError("data: expected creep curves with a compliance J, got strain under a stress history")
    if (same := given_twice(several)) is not None:
        raise ValueError(f"data: expected different curves, got the same one at {same[0]} and {same[1]}")
    return several


def sweeps_of(curves: tuple[Any, ...], reference: float | None) -> Sweeps:
    """Return the logarithms of all curves; ValueError for fewer than three temperatures, or where no curve changes."""
    T = np.array([one.temperature for one in curves])
    order = np.argsort(T, kind="stable")
    new = np.diff(T[order], prepend=-np.inf) > SAME
    group = np.empty(T.size, dtype=int)
    group[order] = np.cumsum(new) - 1
    mean = np.bincount(group, T) / np.bincount(group)
    if mean.size < LEAST:
        raise ValueError(f"data: expected curves at {LEAST} or more temperatures, got {mean.size}")
    place = mean.size // 2 if reference is None else int(np.argmin(np.abs(mean - reference)))
    if reference is not None and not abs(mean[place] - reference) <= SAME + 0.5 * float(
        np.max(np.diff(mean))
    ):
        raise ValueError(
            f"reference: expected a temperature from {mean[0]:.5g} to {mean[-1]:.5g} K, got {reference!r}"
        )
    rows = [(x, y, part, k) for k, one in enumerate(curves) for x, y, part in _parts(one)]
    if all(np.ptp(y) <= CONSTANT for _, y, _, _ in rows):
        raise ValueError(
            f"data: expected moduli that change with time or frequency, got {len(curves)} constant curves: they show no"
            " shift"
        )
    of = lambda place: np.concatenate([np.broadcast_to(row[place], row[0].shape) for row in rows])
    block = of(3).astype(int)
    return Sweeps(mean, place, of(0), of(1), group[block], of(2).astype(int), block)


def _parts(one: Any) -> list[tuple[np.ndarray, np.ndarray, int]]:
    """Return (x, y, part) of the parts of a curve: ln |G*| and phase, ln G(t), or -ln J(t)."""
    if isinstance(one, OscillationData):
        x, G = np.log(one.omega), one.shear
        return [(x, np.log(np.abs(G)), 0), (x, np.angle(G), 1)]
    values = one.shear if isinstance(one, RelaxationData) else one.compliance
    known = (one.t > 0) & (values > 0)
    if np.sum(known) < 5:
        raise ValueError(
            f"data: expected at least 5 points with values > 0 at times > 0 in every curve, got {np.sum(known)}"
            f" at {one.temperature:.5g} K"
        )
    sign = 1.0 if isinstance(one, RelaxationData) else -1.0
    return [(-np.log(one.t[known]), sign * np.log(values[known]), 0)]


# Search for the shift factors of time-temperature superposition, or for the parameters of their law.
#
# The coordinates are those of the shift (ln a_T of every temperature but the reference, or logarithms of the
# parameters of a law), the logarithms of the vertical factors where these are fitted, and the coefficients of the
# master curve. All but the first enter linearly.


LAWS = {
    "WLF": (jc.WLFShift, {"c1": "", "c2": "K"}),
    "Arrhenius": (jc.ArrheniusShift, {"activation_energy": "J"}),
}
INTERVALS = (2, 3, 4, 5, 6, 8, 10, 13, 16, 20, 25, 32, 40)  # numbers of knot intervals that are tried
PER_POINT = 0.25  # largest number of coefficients per point
STEPS = 241  # number of trial shifts of two neighbouring curves
SHARED = 0.2  # least overlap of two curves, as a fraction of the narrower one
REACH = 0.5  # bound of ln a_T about its start, as a fraction of the curve's width
EDGE = 25.0  # bound of the logarithm of a parameter of a law, about its start
WIDE = np.geomspace(1.0, 1e4, 60)  # trial values of c2 [K] above its lower bound


@dataclasses.dataclass(frozen=True, eq=False)
class Shifting:
    """A way to shift the curves: every temperature by a factor of its own (law None), or by a law.

    sweeps: the curves; law: of ``LAWS``, or None; vertical: whether vertical factors are fitted; intervals: number of knot
    intervals of the master curve; start (m,): ln a_T to start from; table: bounds of the parameters of the law.
    """

    sweeps: Sweeps
    law: str | None
    vertical: bool
    intervals: int
    start: np.ndarray
    table: dict[str, tuple[float, float]] = dataclasses.field(default_factory=dict)

    @property
    def structure(self) -> ShiftStructure:
        """The parameters that are sought."""
        T, own = self.sweeps.temperature, self.sweeps.reference
        if self.law is None:
            names = {f"a({T[k]:.6g} K)": "" for k in self.sweeps.others}
            return ShiftStructure.of(dict, names)
        law, dimensions = LAWS[self.law]
        return dataclasses.replace(ShiftStructure.of(law, dimensions), reference=float(T[own]))

    @property
    def count(self) -> tuple[int, int, int]:
        """Numbers of the coordinates of the shift, of vertical factors, and of coefficients."""
        m = self.sweeps.temperature.size - 1
        return len(self.structure.where), m if self.vertical else 0, self.sweeps.parts * (self.intervals + 3)

    def space(self) -> Parameters:
        """Return the search space about the start."""
        structure, (k, v, c) = self.structure, self.count
        own = self._law_box() if self.law else self._factor_box()
        free = np.tile([-np.inf, np.inf], (v + c, 1))
        first = np.arange(k + v + c) < k
        return Parameters.of(structure, np.concatenate([own, free]), logarithmic=first, material=first)

    def _factor_box(self) -> np.ndarray:
        """Bounds (m - 1, 2) of ln a_T within which a curve keeps its neighbours."""
        x, which = self.sweeps.x, self.sweeps.which
        width = np.array([np.ptp(x[which == k]) for k in self.sweeps.others])
        return self.start[self.sweeps.others][:, None] + REACH * np.outer(width, (-1.0, 1.0))

    def _law_box(self) -> np.ndarray:
        """Bounds (k, 2) of the logarithms of the parameters; c2 keeps every temperature above that of infinite times."""
        box = self.law_start()[:, None] + np.array([-EDGE, EDGE])
        if self.law == "WLF":
            box[1, 0] = max(box[1, 0], np.log(least_c2(self.sweeps)))
        with np.errstate(divide="ignore"):
            given = np.log([self.table[name] for name in self.structure.where])
        held = given[:, 0] == given[:, 1]
        box = np.stack([np.maximum(box[:, 0], given[:, 0]), np.minimum(box[:, 1], given[:, 1])], -1)
        return np.where(held[:, None], given, box)

    def law_start(self) -> np.ndarray:
        """Return the logarithms (k,) of the parameters that fit the starting ln a_T best."""
        T, T0 = self.sweeps.temperature, self.sweeps.temperature[self.sweeps.reference]
        if self.law == "Arrhenius":
            return np.log(
                [max(_slope((1.0 / T - 1.0 / T0) / BOLTZMANN, self.start)[0], 1e-3 * BOLTZMANN * T0)]
            )
        above = T - T0
        trials = least_c2(self.sweeps) + WIDE
        found = [(_slope(-np.log(10.0) * above / (c2 + above), self.start), c2) for c2 in trials]
        (c1, _), c2 = min((one for one in found), key=lambda one: one[0][1])
        return np.log([max(c1, 1e-3), c2])

    def shifts(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ln a_T (m,) and its derivatives (m, k) by the coordinates of the shift."""
        T, place, k = self.sweeps.temperature, self.sweeps.reference, self.count[0]
        if self.law is None:
            return np.insert(theta[:k], place, 0.0), np.insert(np.eye(k), place, 0.0, axis=0)
        found = log_factors(LAWS[self.law][0], np.exp(theta[:k]), T[place], T)
        return np.asarray(found[0]), np.asarray(found[1])

    def verticals(self, theta: np.ndarray) -> np.ndarray:
        """Return ln b_T (m,)."""
        k, v, _ = self.count
        some = theta[k : k + v] if self.vertical else np.zeros(self.sweeps.temperature.size - 1)
        return np.insert(some, self.sweeps.reference, 0.0)

    def columns(self, basis: np.ndarray) -> np.ndarray:
        """Return the derivatives (n, v + c) of the residuals by the linear coordinates, with the basis of a ``Master``."""
        if not self.vertical:
            return basis
        by_log_b = -(
            np.eye(self.sweeps.temperature.size)[self.sweeps.which] * (self.sweeps.part == 0)[:, None]
        )
        return np.concatenate([by_log_b[:, self.sweeps.others], basis], axis=1)

    def linear(self, shifts: np.ndarray) -> tuple[np.ndarray, float]:
        """Return the best linear coordinates (v + c,) at ln a_T (m,), and their RSS; inf where data leave some open."""
        A = self.columns(master(self.sweeps, shifts, self.intervals).values)
        z, _, rank, _ = np.linalg.lstsq(A, self.sweeps.y, rcond=1e-10)
        return z, float(np.sum((A @ z - self.sweeps.y) ** 2)) if rank == A.shape[1] else np.inf

    def first(self) -> np.ndarray:
        """Return the coordinates of the start."""
        own = self.start[self.sweeps.others]
        if self.law:
            own = np.clip(self.law_start(), *self._law_box().T)
        theta = np.append(own, np.zeros(sum(self.count[1:])))
        return np.append(own, self.linear(self.shifts(theta)[0])[0])

    def residual(self, theta: np.ndarray) -> np.ndarray:
        """Return the master curve minus the data (n,), in logarithms and radians."""
        found = master(self.sweeps, self.shifts(theta)[0], self.intervals)
        return self.columns(found.values) @ theta[self.count[0] :] - self.sweeps.y

    def slopes(self, theta: np.ndarray) -> np.ndarray:
        """Return the derivative (n, k + v + c) of the residuals."""
        shifts, inner = self.shifts(theta)
        found, (k, v, _) = master(self.sweeps, shifts, self.intervals), self.count
        moved = by_shift(found, theta[k + v :], self.sweeps, self.intervals) @ inner
        return np.concatenate([moved, self.columns(found.values)], axis=1)

    def objective(self, weights: np.ndarray) -> Objective:
        """Return the least-squares objective for weights (n,)."""
        space = self.space()
        return Objective(
            lambda theta: weights * self.residual(theta),
            lambda theta, free: weights[:, None] * self.slopes(theta)[:, free],
            *space.bounds,
            floor=1e-26 * float(np.sum((weights * self.sweeps.y) ** 2)),
        )

    def resolved(self) -> "Shifting":
        """Return the same with the number of knot intervals of lowest AIC at the start.

        The BIC takes fewer, with which the stiffness of the spline biases the shifts by more than their errors.
        """
        return min((dataclasses.replace(self, intervals=k) for k in INTERVALS), key=lambda one: one.aic())

    def aic(self) -> float:
        """Return the AIC at the starting shifts, for few points (C. M. Hurvich, C.-L. Tsai, Biometrika 76 (1989) 297); inf
        where the data do not determine every coefficient."""
        n, p = self.sweeps.y.size, sum(self.count[1:])
        if p > PER_POINT * n:
            return np.inf
        rss = self.linear(self.start)[1]
        return n * np.log(max(rss, 1e-26 * float(np.sum(self.sweeps.y**2)))) + 2.0 * p * n / (n - p - 1.0)


def least_c2(sweeps: Sweeps) -> float:
    """Return the lower bound of c2 [K]: 1 K beyond the lowest temperature."""
    return max(float(sweeps.temperature[sweeps.reference] - sweeps.temperature.min()), 0.0) + 1.0


def _slope(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return the slope of the line through zero closest to y, and its sum of squares."""
    slope = float(x @ y / (x @ x))
    return slope, float(np.sum((y - slope * x) ** 2))


def initial_shifts(sweeps: Sweeps) -> np.ndarray:
    """Return ln a_T (m,) that bring each curve onto its neighbour."""
    between = [_between(sweeps, k) for k in range(sweeps.temperature.size - 1)]
    total = np.append(0.0, np.cumsum(between))
    return total - total[sweeps.reference]


def _between(sweeps: Sweeps, k: int) -> float:
    """Return the shift of curve k + 1 that brings it onto curve k."""
    one, two = (_curves(sweeps, place) for place in (k, k + 1))
    widths = [np.ptp(curve[0][0]) for curve in (one, two)]
    reach = max(widths) + min(widths) * (1.0 - 2.0 * SHARED)
    middle = 0.5 * (one[0][0].min() + one[0][0].max() - two[0][0].min() - two[0][0].max())
    trials = middle + np.linspace(-0.5, 0.5, STEPS) * reach
    return float(trials[np.argmin([_distance(one, two, shift) for shift in trials])])


def _curves(sweeps: Sweeps, place: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return (x, y) of each part of the curves at one temperature, in the order of x."""
    found = []
    for part in range(sweeps.parts):
        on = (sweeps.which == place) & (sweeps.part == part)
        order = np.argsort(sweeps.x[on], kind="stable")
        found.append((sweeps.x[on][order], sweeps.y[on][order]))
    return found


def _distance(one: list, two: list, shift: float) -> float:
    """Return the mean square difference of two curves over their overlap, of which the second is shifted."""
    total = 0.0
    for (x, y), (x_two, y_two) in zip(one, two, strict=True):
        moved = x_two + shift
        low, high = max(x[0], moved[0]), min(x[-1], moved[-1])
        if high <= low:
            return np.inf
        at = np.linspace(low, high, 40)
        total += float(np.mean((np.interp(at, x, y) - np.interp(at, moved, y_two)) ** 2))
    return total


# Verdict on a superposition: whether the shifted curves agree, and whether their shifts follow a law.


CHANCE = 1e-3  # probability that a difference is found significant by chance
# rms difference of curves, relative to the modulus, that repeated loading of a rheometer leaves
SIMILAR = 0.03
NEGLIGIBLE = 1e-6  # likewise, below which a difference is rounding or the flexibility of the spline
STRAYED = 0.05  # probability above which a deviation from a law counts as chance in the intervals
WITHIN = 0.5  # rms deviation from a law [K] that the temperature control of a rheometer leaves


def apart(shifting: Shifting, theta: np.ndarray) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the reason why curves with free shift factors do not superpose, and a note on smaller differences; () if
    there are none.

    A parabola in x is added to every part of every curve; the curves do not superpose where these describe the residuals
    better than chance and differ by more than rheometers do.
    """
    sweeps, residual, J = shifting.sweeps, shifting.residual(theta), shifting.slopes(theta)
    Q = np.linalg.qr(J)[0]
    A = _parabolas(sweeps)
    A -= Q @ (Q.T @ A)
    U, s, _ = np.linalg.svd(A, full_matrices=False)
    U = U[:, s > 1e-6 * s[0]]
    systematic = U @ (U.T @ residual)
    rise, q = float(systematic @ systematic), U.shape[1]
    rss, dof = float(residual @ residual) - rise, residual.size - J.shape[1] - q
    rms = float(np.sqrt(rise / residual.size))
    if rms <= NEGLIGIBLE or not exceeds(rise, q, rss, dof):
        return (), ()
    size = np.sqrt(np.bincount(sweeps.which, systematic**2) / np.bincount(sweeps.which))
    worst = int(np.argmax(size))
    text = (
        f"with the best shift factors the curves differ systematically by {100 * rms:.2g} % of the modulus, most at"
        f" {sweeps.temperature[worst]:.5g} K ({100 * size[worst]:.2g} %)"
    )
    if rms <= SIMILAR:
        return (), (f"{text}, which is within the {100 * SIMILAR:g} % of repeated loading of a rheometer",)
    hint = "" if shifting.vertical else "; vertical factors may help"
    return (f"the curves do not superpose: {text}{hint}",), ()


def gaps(shifting: Shifting, theta: np.ndarray) -> tuple[str, ...]:
    """Return the reasons why shift factors are not determined: temperatures between which no values of the modulus are
    common, and factors at the end of their search; () if there are none.

    Curves that share no value cannot be brought onto each other. With vertical factors, which change the values, they must
    share a range of the shifted abscissa.
    """
    # 1. The range of values of each curve (with vertical factors, of the shifted abscissa), and gaps in their union.
    sweeps, found = shifting.sweeps, []
    shift = shifting.shifts(theta)[0]
    first = sweeps.part == 0
    values = (sweeps.x + shift[sweeps.which]) if shifting.vertical else sweeps.y
    ends = np.array(
        [
            (values[on].min(), values[on].max())
            for on in (first & (sweeps.which == k) for k in range(shift.size))
        ]
    )
    order = np.argsort(ends[:, 0])
    reached = np.maximum.accumulate(ends[order, 1])
    for k in np.flatnonzero(ends[order[1:], 0] > reached[:-1] + SIMILAR):
        below = order[: k + 1][np.argmax(ends[order[: k + 1], 1])]
        one, two = sorted((sweeps.temperature[below], sweeps.temperature[order[k + 1]]))
        found.append(
            f"the curves at {one:.5g} and {two:.5g} K do not overlap: their shift factors follow from the smoothness of the"
            " master curve alone; measure at temperatures between them, or over more decades"
        )

    # 2. Factors at an end of their search.
    low, high = (bound[: shifting.count[0]] for bound in shifting.space().bounds)
    width = high - low
    own = theta[: shifting.count[0]]
    at_end = np.flatnonzero((own - low < 1e-6 * width) | (high - own < 1e-6 * width))
    if at_end.size:
        shown = ", ".join(f"{sweeps.temperature[sweeps.others[k]]:.5g} K" for k in at_end)
        found.append(
            f"the shift factors at {shown} are at the end of their search: the curves do not determine them"
        )
    return tuple(found)


def _parabolas(sweeps: Sweeps) -> np.ndarray:
    """Return the columns 1, x and x^2 of every part of every curve, (n, k)."""
    columns = []
    for block in np.unique(sweeps.block):
        for part in range(sweeps.parts):
            on = (sweeps.block == block) & (sweeps.part == part)
            x = np.where(on, sweeps.x - np.mean(sweeps.x[on]), 0.0)
            columns += [on.astype(float), x, x**2]
    return np.stack(columns, -1)


def exceeds(rise: float, q: int, rss: float, dof: int, chance: float = CHANCE) -> bool:
    """Return whether q further parameters lower the RSS by more than chance (F test); rss: with them, of dof."""
    return bool(dof > 0 and special.fdtrc(q, dof, max(rise, 0.0) / q * dof / max(rss, 1e-300)) < chance)


def deviation(temperature: np.ndarray, law: np.ndarray, free: np.ndarray) -> float:
    """Return the rms deviation of free ln a_T (m,) from those of a law, as a temperature [K].

    A factor common to all temperatures, such as the error of the reference curve, is no deviation.
    """
    off = free - law - np.mean(free - law)
    return float(np.sqrt(np.mean((off / np.gradient(law, temperature)) ** 2)))


def strayed(
    temperature: np.ndarray, place: int, law: np.ndarray, rise: np.ndarray, slopes: np.ndarray, away: float
) -> np.ndarray:
    """Return how errors of every temperature (m,), of the size that the deviation from a law shows, change its coordinates
    (k, m).

    law (m,): ln a_T; rise (m, k): its derivatives; place: of the reference temperature; slopes (n, c): derivatives of the
    residuals with free shift factors, which come first; away: deviation [K]. The squares of a row add up to the variance.
    """
    m, k = rise.shape
    others = np.delete(np.arange(m), place)
    Q = np.linalg.qr(slopes[:, m - 1 :])[0]
    root = slopes[:, : m - 1] - Q @ (Q.T @ slopes[:, : m - 1])
    moved = np.eye(m)[others] - np.eye(m)[place]  # an error of the reference moves all others
    size = away * np.sqrt(m / (m - 1.0 - k)) * np.abs(np.gradient(law, temperature))
    return np.linalg.lstsq(root @ rise[others], root @ moved, rcond=None)[0] * size


# Figure of a time-temperature superposition: master curve, shift factors, residuals, and van Gurp-Palmen plot.


FINE = 300  # points of a line
RADIAN = 180.0 / np.pi  # degrees


LABEL = "equal errors relative to the modulus"
ERRANT = (
    "the shift factors deviate from the law by {:.2g} K (rms), more than chance: the intervals include errors of the"
    " temperatures of this size"
)
COLD = 230.0  # K, below which a set of temperatures is more often one in degrees Celsius
ROUNDED = 0.01  # deviation from a law [K] below which the temperatures are taken as exact
AVOGADRO = 6.02214076e23  # 1/mol, exact


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MasterFit(Fit):
    """Result of time-temperature superposition; the attributes common to all fits are documented in ``Fit``.

    ``material`` is the law of the shift factor, a ``jc.WLFShift`` or ``jc.ArrheniusShift``, and the parameters are "c1"
    and "c2" [K], or "activation_energy" [J]. ``curve`` and ``fitted`` are natural logarithms: ln G or -ln J,
    and for moduli over frequency ln |G*| followed by the phase [rad].

    Attributes:
        temperatures: (m,) [K], increasing.
        factors: (m, 3) shift factor a_T of each curve with the limits of its interval, fitted without a law.
        vertical: (m,) vertical factor b_T of each curve, 1 where none is fitted.
        reference: temperature [K] at which a_T = 1.
        deviation: rms deviation of the factors from the law, as a temperature [K].
        shifting, theta: the search, and the coordinates of its optimum.
    """

    temperatures: np.ndarray
    factors: np.ndarray
    vertical: np.ndarray
    reference: float
    deviation: float
    shifting: Shifting = dataclasses.field(repr=False)
    theta: np.ndarray = dataclasses.field(repr=False)
    slopes: np.ndarray = dataclasses.field(repr=False)
    strayed: np.ndarray = dataclasses.field(repr=False)

    @property
    def oscillation(self) -> bool:
        """True if the data are moduli over frequency."""
        return isinstance(self.data[0], OscillationData)

    @property
    def quantity(self) -> tuple[str, str]:
        """Name and unit of the superposed quantity."""
        if self.oscillation:
            return "G', G''", "Pa"
        return ("J", "1/Pa") if isinstance(self.data[0], CreepData) else ("G", "Pa")

    @property
    def law_factors(self) -> np.ndarray:
        """Shift factors a_T (m,) by the law."""
        return np.exp(self.shifting.shifts(self.theta)[0])

    @property
    def abscissa(self) -> tuple[str, str]:
        """The symbol and the unit of the abscissa of the master curve."""
        return "ln(omega a_T)", "rad/s"

    def covariance(self) -> np.ndarray:
        """Return the covariance of the parameters (k, k), errors of the temperatures included where they are seen."""
        errors = self.estimate.best[:, None] * self.strayed
        return super().covariance() + errors @ errors.T

    def factor(self, temperature: float) -> tuple[float, float, float]:
        """Return a_T by the law at a temperature [K], and the limits of its interval."""
        found = log_factors(self.model, list(self.values.values()), self.reference, np.array([temperature]))
        log, gradient = float(found[0][0]), np.zeros((1, self.theta.size))
        gradient[0, : len(self.values)] = np.asarray(found[1])[0]
        free = self.shifting.space().free
        sd = linear_sd(self.slopes, gradient[:, free], np.ones(free.size, dtype=bool))[0]
        own = float(np.linalg.norm(gradient[0, : len(self.values)] @ self.strayed))
        wide = noise.two_sided(self.level) * math.hypot(float(sd), own)
        with np.errstate(over="ignore"):
            return math.exp(log), float(np.exp(log - wide)), float(np.exp(log + wide))

    def predict(self, at: Any, temperature: float | None = None) -> np.ndarray:
        """Return the modulus of the master curve at a temperature [K], by default the reference; nan outside the data.

        Where vertical factors were fitted, that of the temperature is interpolated; it is nan outside the temperatures.

        at (k,): angular frequencies [rad/s], for G' + i G'' [Pa]; or times [s], for G(t) [Pa] or J(t) [1/Pa].
        """
        T = self.reference if temperature is None else temperature
        at = np.asarray(at, dtype=float)
        log = math.log(self.factor(T)[0])
        values = self._master((np.log(at) if self.oscillation else -np.log(at)) + log)
        if self.shifting.vertical:
            lift = np.interp(T, self.temperatures, np.log(self.vertical), left=np.nan, right=np.nan)
            values = values - lift * (np.arange(len(values)) == 0)[:, None]  # nan in every part
        return self._moduli(values)

    def _moduli(self, values: np.ndarray) -> np.ndarray:
        """Return the moduli (k,) of the parts of the master curve (parts, k)."""
        if self.oscillation:
            return np.exp(values[0] + 1j * values[1])
        return np.exp(-values[0] if self.quantity[0] == "J" else values[0])

    def line(self, points: int) -> np.ndarray:
        """Return reduced frequencies or times over the range of the master curve, evenly spaced in their logarithm."""
        low, high, *_ = master(self.shifting.sweeps, np.log(self.law_factors), 1).ends
        ends = (low, high) if self.oscillation else (-high, -low)
        return np.exp(np.linspace(ends[0] + 1e-9, ends[1] - 1e-9, points))

    def shifted(self, temperature: float) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return the data of one of ``temperatures``, shifted by the law: reduced frequencies [rad/s] or times [s] (k,), and
        moduli or compliances (k,), G' and G'' for an oscillation."""
        k = int(np.argmin(np.abs(self.temperatures - temperature)))
        if not abs(self.temperatures[k] - temperature) <= SAME:
            shown = ", ".join(f"{T:.5g}" for T in self.temperatures)
            raise ValueError(f"temperature: expected one of {shown} K, got {temperature:g}")
        s = self.shifting.sweeps
        on = (s.which == k) & (s.part == 0)
        x = s.x[on] + math.log(self.law_factors[k])
        size = s.y[on] + math.log(self.vertical[k])
        if not self.oscillation:
            return np.exp(-x), [self._moduli(size[None])]
        G = self._moduli(np.stack([size, s.y[(s.which == k) & (s.part == 1)]]))
        return np.exp(x), [G.real, G.imag]

    def _master(self, x: np.ndarray) -> np.ndarray:
        """Return the parts of the master curve at logarithms x (k,) of reduced frequencies, (parts, k)."""
        one, theta = self.shifting, self.theta
        low, high, *_ = master(one.sweeps, one.shifts(theta)[0], one.intervals).ends
        u = one.intervals * (x - low) / (high - low)
        known = (u >= -1e-9) & (u <= one.intervals + 1e-9)
        parts = theta[sum(one.count[:2]) :].reshape(one.sweeps.parts, -1)
        return np.where(known, parts @ spline_basis(np.where(known, u, 0.0), one.intervals)[0].T, np.nan)

    def band(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        """Raise ValueError: a law of shift factors has no band of J(t). ``factor`` returns its interval."""
        raise ValueError("band: expected factor(temperature) of a master curve, which has an interval")

    def plot(self, path: Any = None) -> Any:
        """Return a figure of the master curve, the shift factors and the van Gurp-Palmen plot; save it where a path is
        given."""
        from matplotlib import colormaps

        T, (name, unit) = self.temperatures, self.quantity
        colours = colormaps["viridis"](np.linspace(0.0, 0.92, T.size))
        over = "ω a_T [rad/s]" if self.oscillation else "t/a_T [s]"

        def panel(top: Any, bottom: Any) -> None:
            """Plot the shifted data with the master curve, and the residuals in percent of the modulus."""
            for one, colour in zip(T, colours, strict=True):
                at, (first, *second) = self.shifted(one)
                label = f"{one:.4g} K"
                top.loglog(at, first, linestyle="", color=colour, label=label, marker=".", markersize=5)
                for row in second:
                    top.loglog(at, row, linestyle="", color=colour, marker="o", markersize=3, mfc="none")
            line = self.line(FINE)
            found = self.predict(line)
            rows = (found.real, found.imag) if self.oscillation else (found,)
            names = ("G' (dots)", "G'' (circles)") if self.oscillation else ("master curve",)
            for row, of, colour in zip(rows, names, ("black", "0.5"), strict=False):
                top.loglog(line, row, color=colour, linewidth=1.0, label=of)
            top.set(ylabel=f"{name} [{unit}]")
            sweeps = self.shifting.sweeps
            x = sweeps.x + np.log(self.law_factors)[sweeps.which]
            x = np.exp(x * (1.0 if self.oscillation else -1.0))
            for k, colour in enumerate(colours):
                on = sweeps.which == k
                bottom.semilogx(x[on], -100.0 * self.residuals[on], ".", markersize=4, color=colour)
            of = "|G*|" if self.oscillation else name
            bottom.set(xlabel=f"{over} at {self.reference:.5g} K", ylabel=f"residual [% of {of}]")

        def factors(axes: Any) -> None:
            """Plot the free shift factors with their intervals, and the law with its band."""
            fine = np.linspace(T[0], T[-1], 80)
            law = np.array([self.factor(t) for t in fine])
            band = f"{100 * self.level:g} % band"
            axes.fill_between(fine, law[:, 1], law[:, 2], color="0.6", alpha=0.4, label=band)
            axes.semilogy(fine, law[:, 0], color="0.2", label=self.model.__name__)
            for t, (a, low, high), colour in zip(T, self.factors, colours, strict=True):
                ends = [[a - low], [high - a]]
                axes.errorbar(t, a, ends, fmt="o", markersize=4, capsize=4, color=colour)
            axes.set(xlabel="temperature [K]", ylabel="shift factor a_T [-]", yscale="log")
            axes.legend(fontsize="small")

        def measured(axes: Any) -> None:
            """Plot the data as measured: over time, or the phase angle over |G*| (van Gurp and Palmen), where curves that
            superpose coincide without any shift of times."""
            for one in self.data:
                colour = colours[int(np.argmin(np.abs(T - one.temperature)))]
                if self.oscillation:
                    G = one.shear
                    axes.semilogx(np.abs(G), RADIAN * np.angle(G), ".", markersize=4, color=colour)
                else:
                    values = one.compliance if name == "J" else one.shear
                    axes.loglog(one.t, values, ".", markersize=4, color=colour)
            if self.oscillation:
                axes.set(
                    xlabel="|G*| [Pa]", ylabel="phase angle [°]", title="van Gurp-Palmen plot, not shifted"
                )
            else:
                axes.set(xlabel="t [s]", ylabel=f"{name} [{unit}]", title="as measured")
            axes.title.set_fontsize("small")

        return sheet.draw(self, path, panel, (factors, measured))

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with the shift factors of every temperature."""
        rows = [
            {
                "temperature_K": plain(T),
                "a_T": plain(a),
                "low": plain(low),
                "high": plain(high),
                "b_T": plain(b),
            }
            for T, (a, low, high), b in zip(self.temperatures, self.factors, self.vertical, strict=True)
        ]
        own = {"reference_K": self.reference, "deviation_K": plain(self.deviation), "factors": rows}
        return super().to_dict() | own

    def _points(self) -> str:
        curves = len(np.unique(self.shifting.sweeps.block))
        T = self.temperatures
        return f"{curves} curves, {self.curve[2].size} values, T = {T[0]:.5g} to {T[-1]:.5g} K"

    def _combination_lines(self) -> list[str]:
        lines = [f"  shift factors about {self.reference:.5g} K, with {100 * self.level:g} % intervals:"]
        for T, (a, low, high), b in zip(self.temperatures, self.factors, self.vertical, strict=True):
            vertical = f", b_T = {b:.4g}" if self.shifting.vertical else ""
            lines.append(f"    {T:.5g} K: a_T = {a:.4g}, {low:.4g} to {high:.4g}{vertical}")
        lines.append(f"  rms deviation of the factors from the law: {self.deviation:.2g} K")
        if "activation_energy" in self.values:
            ends = (self.values["activation_energy"], *self.intervals["activation_energy"])
            E, low, high = (1e-3 * AVOGADRO * value for value in ends)
            lines.append(f"  activation energy {E:.4g} kJ/mol, {low:.4g} to {high:.4g} kJ/mol")
        return lines


def fit_master(
    data: Sequence[Any], law: str = "WLF", *, reference: float | None = None, vertical: bool = False,
    fixed: dict[str, float] | None = None, bounds: dict[str, tuple] | None = None, level: float = 0.95,
) -> MasterFit:  # fmt: skip
    """Superpose curves at several temperatures, and fit the law of their shift factors.

        b_T G(omega, T) = G(a_T omega, T0)
        WLF: log10 a_T = -c1 (T - T0)/(c2 + T - T0),     Arrhenius: ln a_T = activation_energy/k (1/T - 1/T0)

    All curves are described by one smooth master curve, a spline whose number of knots is chosen by AIC. It is fitted
    first with a free shift factor for each temperature, which gives ``factors`` and shows whether the curves superpose,
    then with the law. Errors are taken as equal relative to the modulus, |G*| of an oscillation.

    Source: J. D. Ferry, Viscoelastic Properties of Polymers, 3rd ed., 1980, ch. 11.

    Args:
        data: at least three curves of one kind, ``OscillationData``, ``RelaxationData`` or ``CreepData`` with J, each with
            its ``temperature``; several at one temperature are shifted together.
        law: "WLF" or "Arrhenius".
        reference: T0 [K], of which the nearest measured temperature is taken; by default the median.
        vertical: whether vertical factors b_T are fitted too; they are 1 otherwise.
        fixed: {parameter: value} of the law, of any subset.
        bounds: {parameter: (low, high)}, None for an open side.
        level: confidence level of the intervals.

    Returns:
        The law with the intervals of its parameters, ready for ``jc.Thermal``, and the shift factors. It is rejected where
        the curves do not superpose, or do not follow the law.

    Raises:
        ValueError: data of other or mixed kinds or without temperatures, fewer than three temperatures, or bad values.

    Example:
        >>> law, omega, curves = jc.WLFShift(c1=8.0, c2=100.0, reference=400.0), np.geomspace(0.1, 100.0, 19), []
        >>> for T in (380.0, 400.0, 420.0, 440.0):
        ...     s = 1j * omega * float(np.exp(law.log_factor(T)))
        ...     G = 1e5 * s / (1 + s) + 1e6 * s / (50 + s)
        ...     curves.append(fitting.OscillationData(omega, G.real, G.imag, temperature=T))
        >>> fit = fitting.fit_master(curves, reference=400.0)
        >>> print(f"c1 = {fit.values['c1']:.1f}, c2 = {fit.values['c2']:.0f} K")
        c1 = 8.0, c2 = 100 K
    """
    law = {name.casefold(): name for name in LAWS}.get(str(law).casefold(), law)
    if law not in LAWS:
        raise ValueError(f"law: expected one of {', '.join(LAWS)}, got {law!r}")

    # 1. The superposition with a free shift factor at each temperature, from which the law starts.
    curves = checked(data)
    sweeps = sweeps_of(curves, reference)
    free = _superposed(curves, Shifting(sweeps, None, vertical, 0, initial_shifts(sweeps)), level)

    # 2. The superposition by the law, with a c2 at which the times are finite at every temperature of the data.
    lawful = dataclasses.replace(free.shifting, law=law, start=free.shifts)
    lawful = dataclasses.replace(lawful, table=limits(lawful.structure, fixed, bounds))
    most, low = lawful.table.get("c2", (0.0, math.inf))[1], sweeps.temperature.min()
    least = sweeps.temperature[sweeps.reference] - low
    if not most > least:
        raise ValueError(
            f"c2: expected more than {least:.5g} K, since the times become infinite c2 below the reference and the lowest"
            f" temperature is {low:.5g} K; got {most:g}"
        )
    found = _superposed(curves, lawful, level, free)

    # 3. The fit by the law, with the free shift factors and their intervals.
    own, T, place = free.found.common, sweeps.temperature, sweeps.reference
    ends = np.array([own.intervals[name] for name in own.values])
    factors = np.insert(np.column_stack([list(own.values.values()), ends]), place, 1.0, axis=0)
    sd = found.found.common.sd_log
    by_temperature = np.linalg.norm(found.by_temperature, axis=1).tolist()
    return found.found.fit(
        MasterFit, temperatures=T, factors=factors, vertical=np.exp(found.shifting.verticals(found.theta)),
        reference=float(T[place]), deviation=deviation(T, found.shifts, free.shifts), shifting=found.shifting,
        theta=found.theta, slopes=found.found.assessment.slopes, strayed=found.by_temperature,
        sd_log={name: math.hypot(sd[name], error) for name, error in zip(sd, by_temperature, strict=True)},
    )  # fmt: skip


class Superposed(NamedTuple):
    """A finished superposition: the search, its optimum theta and ln a_T (m,), the conclusion, and the changes (k, m) of the
    coordinates of a law by the errors of the temperatures."""

    shifting: Shifting
    theta: np.ndarray
    shifts: np.ndarray
    found: Conclusion
    by_temperature: np.ndarray


def _superposed(
    curves: tuple, shifting: Shifting, level: float, free: Superposed | None = None
) -> Superposed:
    """Return the best superposition; one by a law is rejected where it deviates from that with free factors."""
    # 1. The search. Without a law the number of knots is chosen again at the shifts found.
    if free is None:
        shifting = shifting.resolved()
        first = nonlinear.minimise(shifting.objective(np.ones(shifting.sweeps.y.size)), shifting.first())
        shifting = dataclasses.replace(shifting, start=shifting.shifts(first.theta)[0]).resolved()
    sweeps, space, k = shifting.sweeps, shifting.space(), shifting.count[0]
    curve = ("ln |G*|, phase" if sweeps.parts > 1 else "ln G", "-", sweeps.x, sweeps.y)
    series = 2 * sweeps.block + sweeps.part
    sample = Sample.of(curve, np.ones(sweeps.y.size), LABEL, series, own_trends=True)
    table = shifting.table or dict.fromkeys(shifting.structure.where, (0.0, math.inf))
    sought, duration = Sought(shifting.structure, table, None), float(np.exp(-sweeps.x.min()))
    problem = FitProblem(curves, sought, space, sample, duration, level)
    solved = least_squares(problem, shifting.objective, [shifting.first()])
    best, objective = solved.search_result
    shifts, slopes = shifting.shifts(best.theta)

    # 2. Of a law: reasons against the superposition itself, the deviation from the law, and what errors of the
    # temperatures of this size change in its coordinates, where it is more than chance (for the normal quantile).
    by_temperature = np.zeros((k, shifts.size))
    if free is None:
        against, notes = apart(shifting, best.theta)
        against = (*gaps(shifting, best.theta), *against)
    else:
        own, of_law = free.found.assessment.evidence, space.free[space.free < k]
        q = shifts.size - 1 - of_law.size  # further parameters of free factors
        away = deviation(sweeps.temperature, shifts, free.shifts)
        rise, dof = best.rss - own.rss, best.residual.size - own.p
        against, notes = free.found.common.refused, free.found.common.notes
        if q > 0 and away > WITHIN and exceeds(rise, q, own.rss, dof):
            against = (
                *against,
                f"the shift factors do not follow the {shifting.law} law: they deviate by {away:.2g} K (rms), more than"
                f" chance and more than the {WITHIN:g} K that temperature control leaves",
            )
        if q > 0 and of_law.size and away > ROUNDED and exceeds(rise, q, own.rss, dof, STRAYED):
            by_temperature[of_law] = strayed(
                sweeps.temperature, sweeps.reference, shifts, slopes[:, of_law], free.found.assessment.slopes, away
            )  # fmt: skip
            by_temperature *= noise.two_sided(level, q) / noise.two_sided(level)
        if np.any(by_temperature):
            notes = (*notes, ERRANT.format(away))
    T = sweeps.temperature
    if T[-1] < COLD:
        notes = (
            f"the temperatures are {T[0]:.5g} to {T[-1]:.5g} K: if they are in °C, add 273.15, or law and reference are"
            " wrong",
            *notes,
        )
    notes = (*(note for one in curves for note in one.notes), *notes)

    # 3. The intervals, of the coordinates of the shift by profiles, which include the errors of the temperatures.
    def find_ends(assessment: Assessment) -> tuple[np.ndarray, int]:
        traced = np.arange(best.theta.size) < k
        ends, unfinished = nonlinear.profile(objective, best, assessment.levels(), traced)
        theta, extra = best.theta[:k], noise.two_sided(level) * np.linalg.norm(by_temperature, axis=1)
        low, high = theta - ends[:k, 0], ends[:k, 1] - theta
        wide = np.stack([theta - np.hypot(low, extra), theta + np.hypot(high, extra)], -1)
        bounded = np.clip(wide, space.lower[:k, None], space.upper[:k, None])
        return np.concatenate([bounded, ends[k:]]), unfinished

    found = conclude(problem, solved._replace(find_ends=find_ends, against=against, notes=notes))
    return Superposed(shifting, best.theta, shifts, found, by_temperature)
