"""The result of a creep fit."""

import dataclasses
import json
import math
from typing import Any

import jax.numpy as jnp
import numpy as np
from scipy import stats

from fitting import models, uncertainty
from fitting.data import CreepData

NOT_DETERMINED = 0.5  # sd of a log parameter above which its value says nothing
ENOUGH = 4.0  # T/tau from which the four Burgers parameters separate


@dataclasses.dataclass(frozen=True, eq=False)
class CreepFit:
    """A fitted material and how well the data determine it.

    material: the best fit (an infinite parameter where its compliance is zero); model its class.
    values, intervals, identified: {parameter: value | (low, high), inf on an open side | bool}, in
    Pa and Pa s; fixed parameters have (value, value). sd_log: {parameter: sd of its logarithm}, inf
    at an open end. tau [s]; duration [s]; t_over_tau. condition: of J^T J in log parameters;
    weakest: {parameter: component} of the least known direction; weakest_sd.
    combinations: {name: (value, sd, low, high)} for J0, slope0 = 1/eta1 + 1/eta2 and J(T), which stay
    known where single parameters do not. fitted, residuals (n,): response and weighted residuals.
    rss: weighted; noise: its standard deviation (share of the data for relative weights); lag1:
    correlation of neighbouring residuals; misfit: lag1 is beyond chance, and the intervals were
    widened by ``widening``, the square root of (1 + lag1)/(1 - lag1). r2 (unweighted), aic, bic.
    """

    material: Any
    model: type
    data: CreepData
    weights: str
    level: float
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    identified: dict[str, bool]
    sd_log: dict[str, float]
    fixed: tuple[str, ...]
    tau: float
    duration: float
    t_over_tau: float
    condition: float
    weakest: dict[str, float]
    weakest_sd: float
    combinations: dict[str, tuple[float, float, float, float]]
    fitted: np.ndarray
    residuals: np.ndarray
    rss: float
    noise: float
    lag1: float
    misfit: bool
    widening: float
    r2: float
    aic: float
    bic: float
    p: int
    _state: Any = dataclasses.field(repr=False)

    @property
    def curve(self) -> tuple[str, str, np.ndarray, np.ndarray]:
        """(name, unit, times, values) of what was fitted."""
        name, unit = ("J", "1/Pa") if self.data.J is not None else ("strain", "-")
        return name, unit, self.data.t, self.data.response

    def predict(self, t: Any) -> np.ndarray:
        """Shear creep compliance J(t) [1/Pa], t [s] of any shape; exact for infinite parameters too."""
        t, scaled, best = np.asarray(t, dtype=float), self._state[0], self._state[1]
        j0, j2, f, _ = np.asarray(best.parts) * scaled.compliance
        x = t / scaled.time
        return j0 - j2 * np.expm1(-x / float(best.tau)) + f * x

    def band(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        """Profile-likelihood limits (low, high) of J(t) [1/Pa] at the fit's level, t (m,) [s]."""
        from fitting.creep import profile

        scaled, best, rule, known, _ = self._state
        times = jnp.atleast_1d(jnp.asarray(t, dtype=float)) / scaled.time
        ends = np.asarray(profile(scaled.problem, best, rule, known, times).ends)[5:] * scaled.compliance
        return ends[:, 0], ends[:, 1]

    def compare(self, *others: type | str) -> Any:
        """This fit's data, weights, fixed values and bounds with other models too; see ``fitting.compare``."""
        from fitting.creep import compare

        sigma = 1.0 / np.asarray(self._state[0].problem.weights) * np.max(np.abs(self.data.response))
        choice = {"sigma": sigma} if self.weights == "sigma" else {"weights": self.weights}
        low_high = self._state[4]
        fixed = {name: self.values[name] for name in self.fixed}
        bounds = {name: pair for name, pair in low_high.items() if name not in fixed}
        return compare(
            self.data, [self.model, *others], level=self.level, fixed=fixed, bounds=bounds, **choice
        )

    def summary(self) -> str:
        """The fit in words, for the terminal."""
        from fitting.report import creep_summary

        return creep_summary(self)

    def plot(self, path: Any = None) -> Any:
        """Figure of data, fit, band and residuals; saved where a path is given."""
        from fitting.report import creep_figure

        return creep_figure(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers with the unit in every key, ready for JSON; an infinite number is None."""
        keys = {name: f"{name}_{models.unit(name).replace(' ', '_')}" for name in self.values}
        clean = lambda v: None if not math.isfinite(v) else float(v)
        return {
            "model": self.model.__name__, "weights": self.weights, "level": self.level,
            "points": self.data.t.size,
            "parameters": {keys[n]: clean(v) for n, v in self.values.items()},
            "intervals": {keys[n]: [clean(v) for v in pair] for n, pair in self.intervals.items()},
            "identified": dict(self.identified), "fixed": list(self.fixed),
            "tau_s": clean(self.tau), "duration_s": self.duration,
            "duration_over_tau": clean(self.t_over_tau),
            "condition_log_parameters": clean(self.condition), "weakest_direction": dict(self.weakest),
            "combinations": {n: [clean(v) for v in row] for n, row in self.combinations.items()},
            "r2": self.r2, "aic": clean(self.aic), "bic": clean(self.bic), "noise": self.noise,
            "lag1_residual_correlation": self.lag1, "misfit": self.misfit, "interval_widening": self.widening,
            "convention": self.data.convention, "notes": list(self.data.notes),
        }  # fmt: skip

    def to_json(self) -> str:
        """``to_dict`` as text."""
        return json.dumps(self.to_dict(), indent=2)


def build(
    data: CreepData, model: type, table: dict, weights: str, level: float, nu: float,
    scaled: Any, best: Any, shape: Any, p: int, rule: Any, known: Any,
) -> CreepFit:  # fmt: skip
    """Undo the scaling and gather everything that is said about a fit."""
    unit = scaled.compliance * np.array([1.0, 1.0, 1.0 / scaled.time, 1.0 / scaled.time])
    parts, where = np.asarray(best.parts) * unit, models.PARTS[model]
    n, rss, widening = data.t.size, float(best.rss), math.sqrt(float(shape.widening))
    noise = math.sqrt(rss / (n - p))
    spread = (1.0 if weights == "sigma" else noise) * widening
    low_high = open_ends(np.asarray(shape.ends), np.asarray(shape.reach), scaled.problem)
    intervals = parameter_intervals(low_high[:4] * unit[:, None], where, table)
    values = {name: models.reciprocal(parts[part]) for name, part in where.items()}
    log = _log_covariance(scaled, best, spread)
    names = {part: name for name, part in where.items()}
    tau = float(best.tau) * scaled.time if parts[1] > 0 else math.nan
    fitted = np.asarray(best.model) * np.max(np.abs(data.response))
    aic, bic = criteria(rss, n, p, weights == "sigma")
    total = float(np.sum((data.response - data.response.mean()) ** 2))
    return CreepFit(
        material=models.material(model, parts, nu), model=model, data=data, weights=weights, level=level,
        values=values, intervals=intervals, identified=identified(intervals, table, level),
        sd_log={name: _sd(log, part, table[name]) for name, part in where.items()},
        fixed=tuple(name for name, (low, high) in table.items() if low == high),
        tau=tau, duration=scaled.time, t_over_tau=scaled.time / tau, condition=log.condition,
        weakest={names[k]: float(v) for k, v in zip(log.parts, log.weakest, strict=True)},
        weakest_sd=log.weakest_sd, combinations=_combinations(scaled, best, low_high, unit, spread),
        fitted=fitted, residuals=np.asarray(best.residual), rss=rss, noise=noise, lag1=float(shape.lag1),
        misfit=widening > 1.0, widening=widening,
        r2=1.0 - float(np.sum((data.response - fitted) ** 2)) / total if total > 0 else math.nan,
        aic=aic, bic=bic, p=p, _state=(scaled, best, rule, known, table),
    )  # fmt: skip


def open_ends(ends: np.ndarray, reach: np.ndarray, problem: Any) -> np.ndarray:
    """Extents (m, 2) with an infinite end where they grow with tau without limit.

    If every tau up to the end of the search fits, j2 has no upper limit; if every tau down to the
    other end does, 1/eta2 = j2/tau has none, nor has the initial slope.
    """
    ends, (low, high) = ends.copy(), np.log(np.asarray(problem.tau))
    if reach[1] >= high and not np.isfinite(problem.upper[1]):
        ends[1, 1] = math.inf
    if reach[0] <= low and not np.isfinite(problem.ratio[1]):
        ends[3:5, 1] = math.inf
    return ends


def parameter_intervals(
    ends: np.ndarray, where: dict[str, int], table: dict
) -> dict[str, tuple[float, float]]:
    """Intervals of the parameters from the extents (4, 2) of their reciprocals, cut to the bounds."""
    result = {}
    for name, part in where.items():
        low, high = table[name]
        least, most = models.reciprocal(ends[part, 1]), models.reciprocal(max(ends[part, 0], 0.0))
        result[name] = (max(least, low), min(most, high))
    return result


def identified(intervals: dict, table: dict, level: float) -> dict[str, bool]:
    """Fixed, or closed on both sides, off the bounds, and no wider than sd(log) = 0.5 would be."""
    z = stats.norm.ppf(0.5 + 0.5 * level)
    result = {}
    for name, (low, high) in intervals.items():
        closed = table[name][0] < low and high < table[name][1]
        fixed = table[name][0] == table[name][1]
        result[name] = bool(fixed or (closed and math.log(high / low) < 2 * z * NOT_DETERMINED))
    return result


def _log_covariance(scaled: Any, best: Any, spread: float) -> uncertainty.LogCovariance:
    problem, parts = scaled.problem, np.asarray(best.parts)
    J = np.asarray(uncertainty.jacobian(problem, best.parts, best.tau))
    lower, upper = _limits(problem)
    inside = (parts > lower * (1 + 1e-9)) & (parts < upper * (1 - 1e-9)) & (parts > 0)
    return uncertainty.log_covariance(J, parts, inside, spread)


def _limits(problem: Any) -> tuple[np.ndarray, np.ndarray]:
    lower = np.append(np.asarray(problem.lower), problem.ratio[0])
    return lower, np.append(np.asarray(problem.upper), problem.ratio[1])


def _sd(log: uncertainty.LogCovariance, part: int, limits: tuple[float, float]) -> float:
    """sd of the log parameter: 0 where fixed, inf where it sits at a bound or an open end."""
    if limits[0] == limits[1]:
        return 0.0
    return float(log.sd[log.parts.index(part)]) if part in log.parts else math.inf


def _combinations(scaled: Any, best: Any, ends: np.ndarray, unit: np.ndarray, spread: float) -> dict:
    """J0 [1/Pa], slope0 [1/(Pa s)] and J(T) [1/Pa]: (value, sd, low, high)."""
    (j0, j2, f, ratio), tau = np.asarray(best.parts), float(best.tau)
    lower, upper = _limits(scaled.problem)
    decay = math.exp(-1.0 / tau)
    # d J(T): with tau = j2/ratio, d tau = tau (dj2/j2 - dratio/ratio)
    turn = -decay / tau if j2 > 0 else 0.0
    by_j2 = 1.0 - decay + turn
    by_ratio = -turn * tau
    gradients = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 1.0], [1.0, by_j2, 1.0, by_ratio]])
    J = np.asarray(uncertainty.jacobian(scaled.problem, best.parts, best.tau))
    sd = uncertainty.linear_sd(J, gradients, lower < upper, spread)
    values = [j0, ratio + f, j0 + j2 * (1.0 - decay) + f]
    rows = zip(("J0", "slope0", "J(T)"), values, sd, ends[[0, 4, 5]], unit[[0, 2, 0]], strict=True)
    return {name: tuple(float(u) for u in (v * k, s * k, *(e * k))) for name, v, s, e, k in rows}


def criteria(rss: float, n: int, p: int, known: bool) -> tuple[float, float]:
    """(AIC, BIC) of Gaussian errors, up to a constant common to all models of the same data and weights.

    -2 log L = rss where sigma is known, n log(rss/n) otherwise, with one more parameter for it.
    """
    if known:
        return rss + 2 * p, rss + p * math.log(n)
    fit = n * math.log(max(rss, 1e-300) / n)
    return fit + 2 * (p + 1), fit + (p + 1) * math.log(n)
