"""Search for the shift factors of time-temperature superposition, or for the parameters of their law.

The coordinates are those of the shift (ln a_T of every temperature but the reference, or logarithms of the parameters of a
law), the logarithms of the vertical factors where these are fitted, and the coefficients of the master curve. All but the
first enter linearly.
"""

import dataclasses

import numpy as np

import jaxcontact as jc
from fitting.models.kinetics import BOLTZMANN
from fitting.models.master_curve import ShiftStructure, Sweeps, by_shift, log_factors, master
from fitting.models.search_space import ParameterSpace
from fitting.search.nonlinear import Objective

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

    def space(self) -> ParameterSpace:
        """Return the search space about the start."""
        structure, (k, v, c) = self.structure, self.count
        own = self._law_box() if self.law else self._factor_box()
        free = np.tile([-np.inf, np.inf], (v + c, 1))
        lower, upper = np.concatenate([own, free]).T
        first = np.arange(k + v + c) < k
        return ParameterSpace(
            structure=structure, lower=lower, upper=upper, unit=np.ones(lower.size), logarithmic=first, material=first,
            names=(*structure.where, *[""] * (v + c)), open=np.stack([first, first], -1),
        )  # fmt: skip

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
        lifted = -(np.eye(self.sweeps.temperature.size)[self.sweeps.which] * (self.sweeps.part == 0)[:, None])
        return np.concatenate([lifted[:, self.sweeps.others], basis], axis=1)

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
