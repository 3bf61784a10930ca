"""The result of an indentation fit."""

import dataclasses
import json
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats

from fitting import models, uncertainty
from fitting.data import IndentationData
from fitting.halfspace import FLOW, LOGS, parts
from fitting.nonlinear import inverse
from fitting.press import NUISANCES, Press
from fitting.result import criteria, identified, parameter_intervals

UNITS = {"contact_point": "m", "drift": "m/s", "machine_compliance": "m/N"}


@dataclasses.dataclass(frozen=True, eq=False)
class IndentationFit:
    """A fitted material and how well the indentation determines it; the names are those of ``CreepFit``.

    control: what drove the model; nu, indenter and film: what the moduli are conditional on.
    nuisances {contact_point [m], drift [m/s], machine_compliance [m/N]: (value, low, high)}.
    kept (n,) bool: the points fitted; fitted (n,), residuals: of those, response [m or N] and
    weighted. runs: (forward, gradient) evaluations of the model; seconds: for all of the fit.
    """

    material: Any
    model: type
    data: IndentationData
    indenter: Any
    nu: float
    control: str
    film: "Film"
    weights: str
    level: float
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    identified: dict[str, bool]
    sd_log: dict[str, float]
    nuisances: dict[str, tuple[float, float, float]]
    fixed: tuple[str, ...]
    tau: float
    duration: float
    t_over_tau: float
    condition: float
    weakest: dict[str, float]
    weakest_sd: float
    kept: np.ndarray
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
    runs: tuple[int, int]
    seconds: float
    notes: tuple[str, ...]
    _state: Any = dataclasses.field(repr=False)

    @property
    def curve(self) -> tuple[str, str, np.ndarray, np.ndarray]:
        """(name, unit, times, values) of what was fitted."""
        if self.control == "load":
            return "depth", "m", self.data.t[self.kept], self.data.depth[self.kept]
        return "load", "N", self.data.t[self.kept], self.data.load[self.kept]

    def predict(self, t: Any) -> np.ndarray:
        """Shear creep compliance J(t) [1/Pa] of the material, t [s] of any shape."""
        theta, _, press, _ = self._state
        return np.exp(np.asarray(_log_creep(theta, jnp.asarray(t) / press.duration))) * press.unit

    def band(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        """Limits (low, high) of J(t) [1/Pa] at the fit's level, t (m,) [s], linearised in log J."""
        theta, covariance, press, _ = self._state
        times = jnp.atleast_1d(jnp.asarray(t, dtype=float)) / press.duration
        slope = np.nan_to_num(np.asarray(jax.jacfwd(_log_creep)(theta, times)))
        spread = np.sqrt(np.einsum("ni,ij,nj->n", slope, covariance, slope))
        z = stats.norm.ppf(0.5 + 0.5 * self.level)
        best = self.predict(t)
        return best * np.exp(-z * spread), best * np.exp(z * spread)

    def summary(self) -> str:
        """The fit in words, for the terminal."""
        from fitting.report import indentation_summary

        return indentation_summary(self)

    def plot(self, path: Any = None) -> Any:
        """Figure of data, fit, residuals and J(t) with its band; saved where a path is given."""
        from fitting.report import indentation_figure

        return indentation_figure(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers with the unit in every key, ready for JSON; an infinite number is None."""
        keys = {name: f"{name}_{models.unit(name).replace(' ', '_')}" for name in self.values}
        clean = lambda v: None if v is None or not math.isfinite(v) else float(v)
        unit = lambda name: UNITS[name].replace("/", "_per_")
        return {
            "model": self.model.__name__, "control": self.control, "weights": self.weights,
            "level": self.level, "points": int(self.kept.sum()),
            "parameters": {keys[n]: clean(v) for n, v in self.values.items()},
            "intervals": {keys[n]: [clean(v) for v in pair] for n, pair in self.intervals.items()},
            "identified": dict(self.identified), "fixed": list(self.fixed),
            "nuisances": {f"{n}_{unit(n)}": [clean(v) for v in row] for n, row in self.nuisances.items()},
            "indenter_radius_m": float(self.indenter.radius), "poisson_ratio": self.nu,
            "film_thickness_m": clean(self.film.thickness),
            "bias_over_standard_error": dict(self.film.bias),
            "tau_s": clean(self.tau), "duration_s": self.duration,
            "duration_over_tau": clean(self.t_over_tau),
            "condition_log_parameters": clean(self.condition), "weakest_direction": dict(self.weakest),
            "r2": self.r2, "aic": clean(self.aic), "bic": clean(self.bic), "noise": self.noise,
            "lag1_residual_correlation": self.lag1, "misfit": self.misfit, "interval_widening": self.widening,
            "forward_runs": self.runs[0], "gradient_runs": self.runs[1], "time_s": self.seconds,
            "notes": [*self.data.notes, *self.notes],
        }  # fmt: skip

    def to_json(self) -> str:
        """``to_dict`` as text."""
        return json.dumps(self.to_dict(), indent=2)


class Film(NamedTuple):
    """thickness [m], substrate and grid of the solver, and {coordinate: discretisation bias left over
    standard error}; None and empty for a half-space."""

    thickness: float | None = None
    substrate: Any = None
    grid: Any = None
    bias: dict[str, float] = {}  # noqa: RUF012


class Quality(NamedTuple):
    """level of RSS that bounds the intervals; noise; lag1; widening of the allowed rise."""

    level: float
    noise: float
    lag1: float
    widening: float


def allowed(best: Any, press: Press, p: int, rule: float) -> Quality:
    """As ``creep.profile``: a rise of rule s^2, more where the residuals are correlated beyond chance."""
    known, r = press.label == "sigma", best.residual[press.kept]
    n, spread = r.size, r - r.mean()
    noise = math.sqrt(best.rss / (n - p))
    total = float(spread @ spread)
    lag1 = float(spread[1:] @ spread[:-1]) / total if total > 0 else 0.0
    size = float(np.sum((press.weights * press.measured) ** 2))
    real = best.rss > (0.5 * (n - p) if known else 1e-20 * size)
    share = min(lag1, 0.999)
    widening = (1 + share) / (1 - share) if lag1 > 3.3 / math.sqrt(n) and real else 1.0
    rise = max(rule * (1.0 if known else noise**2) * widening, 1e-13 * size)
    return Quality(best.rss + rise, noise, lag1, widening)


def build(
    press: Press, best: Any, free: np.ndarray, ends: np.ndarray, quality: Quality, level: float,
    runs: tuple[int, int], seconds: float, notes: list[str], film: Film,
    moves: Callable[[str], np.ndarray],
) -> IndentationFit:  # fmt: skip
    """Undo the scaling and gather everything that is said about a fit; moves(name) (7,): change of the
    coordinates with a nuisance held in the fit."""
    where, unit = (
        models.PARTS[press.model],
        press.unit * np.array([1, 1, 1 / press.duration, 1 / press.duration]),
    )
    compliances = _open(np.stack([_compliances(best.theta)] * 2, -1), np.stack([best.theta] * 2, -1), press)
    compliances = np.where(best.theta[:4] <= press.lower[:4], *compliances.T) * unit
    spans = _open(np.stack([_compliances(end) for end in ends.T], -1), ends, press) * unit[:, None]
    intervals = parameter_intervals(spans, where, press.table)
    spread = (1.0 if press.label == "sigma" else quality.noise) * math.sqrt(quality.widening)
    log = _log_covariance(best, free, press, spread)
    names = {part: name for name, part in where.items()}
    sd = {
        name: float(log.sd[log.parts.index(k)]) if k in log.parts else math.inf for name, k in where.items()
    }
    fixed = tuple(name for name, (low, high) in press.table.items() if low == high)
    tau = compliances[1] / compliances[3] if compliances[1] > 0 and compliances[3] > 0 else math.nan
    on, y = press.kept, press.measured * press.response_unit
    fitted = y[on] + best.residual[on] / press.weights[on] * press.response_unit
    aic, bic = criteria(best.rss, fitted.size, free.size, press.label == "sigma")
    total = float(np.sum((y[on] - y[on].mean()) ** 2))
    return IndentationFit(
        material=models.material(press.model, compliances, press.nu), model=press.model, data=press.data,
        indenter=press.indenter, nu=press.nu, control=press.control, film=film,
        weights=press.label, level=level,
        values={name: models.reciprocal(compliances[k]) for name, k in where.items()}, intervals=intervals,
        identified=identified(intervals, press.table, level),
        sd_log={name: 0.0 if name in fixed else sd[name] for name in where},
        nuisances=_nuisances(best, ends, free, press), fixed=fixed, tau=tau, duration=press.duration,
        t_over_tau=press.duration / tau, condition=log.condition,
        weakest={names[k]: float(v) for k, v in zip(log.parts, log.weakest, strict=True)},
        weakest_sd=log.weakest_sd, kept=on, fitted=fitted, residuals=best.residual[on], rss=best.rss,
        noise=quality.noise, lag1=quality.lag1, misfit=quality.widening > 1.0,
        widening=math.sqrt(quality.widening),
        r2=1.0 - float(np.sum((y[on] - fitted) ** 2)) / total if total > 0 else math.nan,
        aic=aic, bic=bic, p=free.size, runs=runs, seconds=seconds, notes=tuple(notes),
        _state=(best.theta, _covariance(best, free, spread), press, moves),
    )  # fmt: skip


def _compliances(theta: np.ndarray) -> np.ndarray:
    """(j0, j2, f, j2/tau), scaled, of the coordinates."""
    values = np.array(theta[:4], dtype=float)
    for i in LOGS:
        values[i] = math.exp(values[i])
    return values


def _open(spans: np.ndarray, ends: np.ndarray, press: Press) -> np.ndarray:
    """Compliances (4, 2) with 0 and inf at the edges of the search, where these are not bounds given."""
    limits = np.array([[1.0, 1.0]] * 4)
    for name, part in models.PARTS[press.model].items():
        limits[part] = press.table[name]
    low, high, ends = press.lower[:4], press.upper[:4], ends[:4]
    bottom = (ends[:, 0] <= low) & (low < high) & np.isinf(limits[:, 1])
    top = (ends[:, 1] >= high) & (low < high) & (limits[:, 0] == 0.0)
    return np.stack([np.where(bottom, 0.0, spans[:, 0]), np.where(top, math.inf, spans[:, 1])], -1)


def _nuisances(best: Any, ends: np.ndarray, free: np.ndarray, press: Press) -> dict:
    """(value, low, high) in SI of those that were fitted."""
    sizes = (press.depth_unit, press.depth_unit / press.duration, press.depth_unit / press.load_unit)
    rows = {
        name: (best.theta[i] * size, *(ends[i] * size))
        for (name, i), size in zip(NUISANCES.items(), sizes, strict=True)
        if i in free
    }
    return {name: tuple(float(v) for v in row) for name, row in rows.items()}


def _log_covariance(best: Any, free: np.ndarray, press: Press, spread: float) -> uncertainty.LogCovariance:
    """Of the logarithms of the parameters strictly in their box, the nuisances projected out."""
    inside = free[(best.theta[free] > press.lower[free]) & (best.theta[free] < press.upper[free])]
    columns = {i: best.jacobian[:, np.flatnonzero(free == i)[0]] for i in inside}
    others = [columns[i] for i in inside if i > 3]
    J = np.zeros((best.residual.size, 4))
    for i in inside[inside <= 3]:
        J[:, i] = columns[i] * (best.theta[FLOW] if i == FLOW else 1.0)
    if others:
        Q = np.linalg.qr(np.stack(others, -1))[0]
        J -= Q @ (Q.T @ J)
    return uncertainty.log_covariance(J, np.ones(4), np.isin(np.arange(4), inside), spread)


def _covariance(best: Any, free: np.ndarray, spread: float) -> np.ndarray:
    """Of all coordinates (7, 7), zero for those held; directions lost to rounding at their cut."""
    whole = np.zeros((7, 7))
    whole[np.ix_(free, free)] = inverse(best.jacobian) * spread**2
    return whole


@jax.jit
def _log_creep(theta: Any, t: Any) -> Any:
    """log J(t) of the coordinates, scaled."""
    j0, j2, f, k = parts(jnp.asarray(theta))
    return jnp.log(j0 - j2 * jnp.expm1(-t * k) + f * t)
