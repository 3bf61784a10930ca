"""Time-temperature superposition: shift factors of curves at several temperatures, and the law that they follow."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from fitting.data.curves import CreepData
from fitting.data.moduli import OscillationData
from fitting.fits.master_data import SAME, checked, sweeps_of
from fitting.fits.master_search import LAWS, Shifting, initial_shifts
from fitting.fits.master_verdict import (
    STRAYED,
    MasterSample,
    apart,
    deviation,
    exceeds,
    gaps,
    off_law,
    strayed,
)
from fitting.inference import student
from fitting.inference.conclusion import Conclusion, FitProblem, conclude, least_squares
from fitting.inference.result import Fit, plain
from fitting.models.master_curve import basis, log_factors, master
from fitting.models.structure import Sought, limits
from fitting.search import nonlinear, profiles
from fitting.search.nonlinear import Best
from fitting.search.uncertainty import linear_sd
from fitting.views import master_picture

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
        wide = student.two_sided(self.level) * math.hypot(float(sd), own)
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
        return np.where(known, parts @ basis(np.where(known, u, 0.0), one.intervals)[0].T, np.nan)

    def band(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        """Raise ValueError: a law of shift factors has no band of J(t). ``factor`` returns its interval."""
        raise ValueError("band: expected factor(temperature) of a master curve, which has an interval")

    def plot(self, path: Any = None) -> Any:
        """Return a figure of the master curve, the shift factors and the van Gurp-Palmen plot; save it where a path is
        given."""
        return master_picture.draw(self, path)

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
            lifted = f", b_T = {b:.4g}" if self.shifting.vertical else ""
            lines.append(f"    {T:.5g} K: a_T = {a:.4g}, {low:.4g} to {high:.4g}{lifted}")
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
    curves = checked(data)
    sweeps = sweeps_of(curves, reference)
    free = _superposed(curves, Shifting(sweeps, None, vertical, 0, initial_shifts(sweeps)), level)
    lawful = dataclasses.replace(free.shifting, law=law, start=free.shifts)
    lawful = dataclasses.replace(lawful, table=limits(lawful.structure, fixed, bounds))
    _check_c2(lawful)
    found = _superposed(curves, lawful, level, free)
    return _finished(found, free)


def _check_c2(lawful: Shifting) -> None:
    """Raise ValueError for fixed or bounded c2 [K] with which the times are infinite at a temperature of the data."""
    most, low = lawful.table.get("c2", (0.0, math.inf))[1], lawful.sweeps.temperature.min()
    least = lawful.sweeps.temperature[lawful.sweeps.reference] - low
    if not most > least:
        raise ValueError(
            f"c2: expected more than {least:.5g} K, since the times become infinite c2 below the reference and the lowest"
            f" temperature is {low:.5g} K; got {most:g}"
        )


class Superposed(NamedTuple):
    """A finished superposition: the search, its optimum theta and ln a_T (m,), the conclusion, and ``_strayed``."""

    shifting: Shifting
    theta: np.ndarray
    shifts: np.ndarray
    found: Conclusion
    strayed: np.ndarray


def _superposed(
    curves: tuple, shifting: Shifting, level: float, free: Superposed | None = None
) -> Superposed:
    """Return the best superposition; one by a law is rejected where it deviates from that with free factors."""
    if free is None:  # the number of knots is chosen again at the shifts found
        shifting = shifting.resolved()
        first = nonlinear.minimise(shifting.objective(np.ones(shifting.sweeps.y.size)), shifting.first())
        shifting = dataclasses.replace(shifting, start=shifting.shifts(first.theta)[0]).resolved()
    sweeps = shifting.sweeps
    curve = ("ln |G*|, phase" if sweeps.parts > 1 else "ln G", "-", sweeps.x, sweeps.y)
    sample = MasterSample.of(curve, np.ones(sweeps.y.size), LABEL, 2 * sweeps.block + sweeps.part)
    table = shifting.table or dict.fromkeys(shifting.structure.where, (0.0, math.inf))
    sought, duration = Sought(shifting.structure, table, None), float(np.exp(-sweeps.x.min()))
    problem = FitProblem(curves, sought, shifting.space(), sample, duration, level)
    solved = least_squares(problem, shifting.objective, [shifting.first()])
    best, objective = solved.whole
    traced = np.arange(best.theta.size) < shifting.count[0]
    shifts = shifting.shifts(best.theta)[0]
    own = (
        np.zeros((shifting.count[0], shifts.size)) if free is None else _strayed(free, shifting, best, level)
    )
    profile = lambda assessment: _widened(
        profiles.profile(objective, best, assessment.levels(), traced), best.theta, own, problem
    )
    against, notes = apart(shifting, best.theta) if free is None else _off(free, shifting, best, shifts)
    if free is None:
        against = (*gaps(shifting, best.theta), *against)
    if free is not None and np.any(own):
        notes = (*notes, ERRANT.format(deviation(sweeps.temperature, shifts, free.shifts)))
    notes = (*(note for one in curves for note in one.notes), *_cold(sweeps.temperature), *notes)
    found = conclude(problem, solved._replace(profile=profile, against=against, notes=notes))
    return Superposed(shifting, best.theta, shifts, found, own)


def _cold(temperature: np.ndarray) -> tuple[str, ...]:
    """Return a note on temperatures (m,) that may be in degrees Celsius."""
    if temperature[-1] >= COLD:
        return ()
    ends = f"{temperature[0]:.5g} to {temperature[-1]:.5g} K"
    return (f"the temperatures are {ends}: if they are in °C, add 273.15, or law and reference are wrong",)


def _strayed(free: Superposed, lawful: Shifting, best: Best, level: float) -> np.ndarray:
    """Return the changes (k, m) of the coordinates of a law by errors of the temperatures, for the normal quantile; zero
    where the deviation from the law is chance."""
    shifts, inner = lawful.shifts(best.theta)
    some = np.flatnonzero(lawful.space().free < lawful.count[0])
    q, found = shifts.size - 1 - some.size, np.zeros(inner.T.shape)
    own, T, place = free.found.assessment.evidence, lawful.sweeps.temperature, lawful.sweeps.reference
    dof = best.residual.size - own.p
    away, slopes = deviation(T, shifts, free.shifts), free.found.assessment.slopes
    if not (q > 0 and some.size and away > ROUNDED):
        return found
    if not exceeds(best.rss - own.rss, q, own.rss, dof, STRAYED):
        return found
    rows = lawful.space().free[some]
    found[rows] = strayed(T, place, shifts, inner[:, rows], slopes, away)
    return found * student.two_sided(level, q) / student.two_sided(level)


def _widened(ends: np.ndarray, theta: np.ndarray, own: np.ndarray, problem: FitProblem) -> np.ndarray:
    """Return interval ends (k, 2) that include the changes ``own`` (k, m) of the coordinates."""
    k = len(own)
    extra = student.two_sided(problem.level) * np.linalg.norm(own, axis=1)
    low, high = theta[:k] - ends[:k, 0], ends[:k, 1] - theta[:k]
    wide = np.stack([theta[:k] - np.hypot(low, extra), theta[:k] + np.hypot(high, extra)], -1)
    bounds = problem.space
    return np.concatenate([np.clip(wide, bounds.lower[:k, None], bounds.upper[:k, None]), ends[k:]])


def _off(
    free: Superposed, lawful: Shifting, best: Best, shifts: np.ndarray
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the reasons against a law: those against the superposition itself, and the deviation from the law; and
    notes."""
    own, whole = free.found.assessment.evidence, free.found.fields
    q = free.shifting.count[0] - lawful.space().free.size + sum(lawful.count[1:])
    away = deviation(lawful.sweeps.temperature, shifts, free.shifts)
    dof = best.residual.size - own.p
    off = off_law(str(lawful.law), away, best.rss - own.rss, q, own.rss, dof) if q > 0 else ()
    return (*whole["refused"], *off), whole["notes"]


def _finished(lawful: Superposed, free: Superposed) -> MasterFit:
    """Return the fit by a law, with the free shift factors and their intervals."""
    own, T, place = free.found.fields, lawful.shifting.sweeps.temperature, lawful.shifting.sweeps.reference
    ends = np.array([own["intervals"][name] for name in own["values"]])
    factors = np.insert(np.column_stack([list(own["values"].values()), ends]), place, 1.0, axis=0)
    sd = lawful.found.fields["sd_log"]
    errors = zip(sd.items(), np.linalg.norm(lawful.strayed, axis=1).tolist(), strict=True)
    return lawful.found.fit(
        MasterFit, temperatures=T, factors=factors, vertical=np.exp(lawful.shifting.verticals(lawful.theta)),
        reference=float(T[place]), deviation=deviation(T, lawful.shifts, free.shifts), shifting=lawful.shifting,
        theta=lawful.theta, slopes=lawful.found.assessment.slopes, strayed=lawful.strayed,
        sd_log={name: math.hypot(own, one) for (name, own), one in errors},
    )  # fmt: skip
