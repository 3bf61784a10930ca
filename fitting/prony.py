"""Fit of a series of Kelvin-Voigt elements with given retardation times: ``jc.Prony``.

    J(t) = J0 + sum_i J_i (1 - exp(-t/tau_i)) + fluidity t

is linear in what is sought, and everything is >= 0: a bounded linear least squares with one optimum.
Single elements of a series are often not determined although their sum is; the intervals say which.
"""

import dataclasses
import math
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting import nonlinear
from fitting.creep import choose_weights, threshold
from fitting.data import CreepData
from fitting.result import criteria


@dataclasses.dataclass(frozen=True, eq=False)
class PronyFit:
    """material: ``jc.Prony``. values {"J0" [1/Pa], "J1".. [1/Pa], "fluidity" [1/(Pa s)]}: those fitted;
    intervals {name: (low, high)}: profile likelihoods, 0 where a compliance has no lower limit;
    tau (k,) [s]; fitted, residuals (n,); rss, noise, lag1, misfit, r2, aic, bic as in ``CreepFit``."""

    material: jc.Prony
    data: CreepData
    weights: str
    level: float
    tau: np.ndarray
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    fitted: np.ndarray
    residuals: np.ndarray
    rss: float
    noise: float
    lag1: float
    misfit: bool
    r2: float
    aic: float
    bic: float

    def predict(self, t: Any) -> np.ndarray:
        """J(t) [1/Pa], t [s] of any shape."""
        return np.asarray(self.material.creep(np.asarray(t, dtype=float)))

    def summary(self) -> str:
        """The fit in words, for the terminal."""
        head = f"Prony fit of {self.data.t.size} points; weights: {self.weights}; {self.tau.size} given times"
        lines = [head]
        for name, value in self.values.items():
            low, high = self.intervals[name]
            unit = "1/(Pa s)" if name == "fluidity" else "1/Pa"
            times = f", tau = {self.tau[int(name[1:]) - 1]:.4g} s" if name[1:] not in ("0", "luidity") else ""
            known = f"{low:.4g} to {high:.4g}" if low > 0 else f"not above {high:.4g}"
            lines.append(f"  {name:8s} = {value:11.5g} {unit}, {100 * self.level:g} % {known}{times}")
        lines.append(f"  R2 = {self.r2:.6f}, BIC {self.bic:.1f}, lag-1 residual correlation {self.lag1:.2f}")
        return "\n".join(
            [*lines, *(["  MISFIT: residuals are correlated beyond chance"] if self.misfit else [])]
        )


def fit_prony(
    data: CreepData, tau: Any, *, weights: str | None = None, sigma: Any = None, instantaneous: bool = True,
    flow: bool = True, nu: float = 0.3, level: float = 0.95,
) -> PronyFit:  # fmt: skip
    """Fit a series at the retardation times ``tau`` (k,) [s] to a compliance J(t); weights as in ``fit_creep``.

    instantaneous, flow: whether J0 and the fluidity are sought, else 0. Raises ValueError on bad input.
    """
    tau = np.unique(np.asarray(tau, dtype=float))
    if data.J is None:
        raise ValueError("data: expected J, got strain and stress")
    if tau.ndim != 1 or tau.size == 0 or not np.all(np.isfinite(tau) & (tau > 0)):
        raise ValueError(f"tau: expected times > 0, got {tau}")
    weight, label = choose_weights(data.response, weights, sigma)
    columns, names = _columns(data.t, tau, instantaneous, flow)
    n, p, known = data.t.size, len(names), label == "sigma"
    if n <= p:
        raise ValueError(f"data: expected more points than the {p} compliances sought, got {n}")
    size = np.linalg.norm(weight[:, None] * columns, axis=0)
    A, y = weight[:, None] * columns / size, weight * data.response
    objective = nonlinear.Objective(
        lambda x: A @ x - y, lambda x, free: A[:, free], np.zeros(p), np.full(p, np.inf),
        floor=1e-26 * float(y @ y),
    )  # fmt: skip
    best = nonlinear.minimise(objective, np.maximum(np.linalg.lstsq(A, y, rcond=None)[0], 0.0))
    noise, r = math.sqrt(best.rss / (n - p)), best.residual - best.residual.mean()
    lag1 = float(r[1:] @ r[:-1] / (r @ r)) if r @ r > 0 else 0.0
    misfit = lag1 > 3.3 / math.sqrt(n) and best.rss > 1e-20 * float(y @ y)
    share = min(lag1, 0.999) if misfit else 0.0
    rise = threshold(level, n, p, known) * (1.0 if known else noise**2) * (1 + share) / (1 - share)
    ends = nonlinear.profile(objective, best, best.rss + max(rise, 1e-13 * float(y @ y)))
    x, spans = best.theta / size, ends / size[:, None]
    fitted = data.response + best.residual / weight
    aic, bic = criteria(best.rss, n, p, known)
    values = dict(zip(names, map(float, x), strict=True))
    total = float(np.sum((data.response - data.response.mean()) ** 2))
    material = jc.Prony(
        J0=values.get("J0", 0.0), J=np.array([values[f"J{k + 1}"] for k in range(tau.size)]), tau=tau, nu=nu,
        fluidity=values.get("fluidity", 0.0),
    )  # fmt: skip
    intervals = {name: (float(a), float(b)) for name, (a, b) in zip(names, spans, strict=True)}
    return PronyFit(
        material, data, label, level, tau, values, intervals, fitted, best.residual, best.rss, noise, lag1, misfit,
        1.0 - float(np.sum((data.response - fitted) ** 2)) / total if total > 0 else math.nan, aic, bic,
    )  # fmt: skip


def _columns(t: np.ndarray, tau: np.ndarray, instantaneous: bool, flow: bool) -> tuple[np.ndarray, list[str]]:
    """Response to each unit compliance (n, p), and their names."""
    delayed = -np.expm1(-t[:, None] / tau)
    columns, names = [delayed], [f"J{k + 1}" for k in range(tau.size)]
    if instantaneous:
        columns, names = [np.ones((t.size, 1)), *columns], ["J0", *names]
    if flow:
        columns, names = [*columns, t[:, None]], [*names, "fluidity"]
    return np.concatenate(columns, axis=1), names
