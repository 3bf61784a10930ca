"""Fit of a material to creep data.

The start is deterministic (variable projection, ``varpro.py``) and already the optimum but for the
grid of tau; Gauss-Newton steps with exact Jacobians in the logarithms of the parameters remove that; the
intervals are profile
likelihoods: {parameter: min RSS over the others <= RSS_min (1 + F/(n - p))} with F the quantile of
F(1, n - p), or RSS <= RSS_min + chi^2 where sigma is given (D. M. Bates, D. G. Watts, Nonlinear
Regression Analysis, 1988, sec. 6.1).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy import stats

import jaxcontact as jc
from fitting import models, varpro
from fitting.data import CreepData
from fitting.history import History, Step, columns, merge
from fitting.models import PARTS, resolve
from fitting.result import CreepFit, build

STEPS = 3  # of Gauss-Newton


class Scaled(NamedTuple):
    """A problem in its own units: ``compliance`` [1/Pa] and ``time`` [s] undo it."""

    problem: varpro.Problem
    compliance: float
    time: float


def fit_creep(
    data: CreepData,
    model: type | str = jc.Burgers,
    *,
    weights: str | None = None,
    sigma: Any = None,
    fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None,
    nu: float = 0.3,
    level: float = 0.95,
) -> CreepFit:
    """Fit ``model`` (a material class or its name) to creep data.

    weights: "relative" (errors proportional to the data), "absolute" (one error for all), or
    sigma = the standard deviation, a number or (n,) [unit of the data], taken as known. One must be
    chosen: on real data the choice moves the moduli by factors. fixed {name: value} and bounds
    {name: (low, high)}, None for an open side, in Pa and Pa s, of any subset; nu is carried, creep
    in shear does not see it; level of the intervals. Deterministic. Raises ValueError on bad input.
    """
    model = models.resolve(model)
    table = models.limits(model, fixed, bounds)
    weight, label = choose_weights(data.response, weights, sigma)
    if not 0.0 < level < 1.0:
        raise ValueError(f"level: expected between 0 and 1, got {level!r}")
    free = [name for name, (low, high) in table.items() if low < high]
    if data.t.size <= len(free):
        raise ValueError(
            f"data: expected more points than the {len(free)} free parameters, got {data.t.size}"
        )
    scaled = scale(data, weight, model, table)
    p, known = len(free), label == "sigma"
    optimum = minimise(scaled.problem)
    rule = jnp.asarray(threshold(level, data.t.size, p, known))
    shape = profile(scaled.problem, optimum, rule, jnp.asarray(known), jnp.ones(1))
    return build(data, model, table, label, level, nu, scaled, optimum, shape, p, rule, jnp.asarray(known))


def compare(
    data: CreepData,
    models: Sequence[type | str] = ("Maxwell", "StandardLinearSolid", "Burgers"),
    fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None,
    **options: Any,
) -> "Comparison":
    """Fit each of ``models`` with the options of ``fit_creep``; print the result for the table.

    fixed and bounds go to every model that has the parameter; ValueError for one that no model has.
    """
    classes = [resolve(model) for model in models]
    known = {name for model in classes for name in PARTS[model]}
    for name in [*(fixed or {}), *(bounds or {})]:
        if name not in known:
            raise ValueError(f"fixed, bounds: expected parameters among {sorted(known)}, got {name!r}")
    mine = lambda given, model: {name: v for name, v in (given or {}).items() if name in PARTS[model]}
    fits = tuple(
        fit_creep(data, model, fixed=mine(fixed, model), bounds=mine(bounds, model), **options)
        for model in classes
    )
    return Comparison(tuple(sorted(fits, key=lambda fit: fit.bic)))


class Comparison(NamedTuple):
    """Fits of one data set, lowest BIC first."""

    fits: tuple[CreepFit, ...]

    def __str__(self) -> str:
        head = f"{'model':22s}{'parameters':>11s}{'R2':>12s}{'AIC':>12s}{'BIC':>12s}{'lag-1':>8s}  misfit"
        rows = [
            f"{f.model.__name__:22s}{f.p:11d}{f.r2:12.6f}{f.aic:12.1f}{f.bic:12.1f}{f.lag1:8.2f}"
            f"  {'yes' if f.misfit else 'no'}"
            for f in self.fits
        ]
        return "\n".join([head, *rows])


def choose_weights(y: np.ndarray, weights: str | None, sigma: Any) -> tuple[np.ndarray, str]:
    """Weights (n,) [1/unit of y] and their label; ValueError unless exactly one choice is made."""
    if (weights is None) == (sigma is None):
        raise ValueError('weights: choose "relative", "absolute" or sigma=...; the choice decides the answer')
    if sigma is not None:
        spread = np.broadcast_to(np.asarray(sigma, dtype=float), y.shape)
        if not np.all(np.isfinite(spread) & (spread > 0)):
            raise ValueError("sigma: expected finite values > 0")
        return 1.0 / spread, "sigma"
    if weights == "relative":
        if np.any(y <= 0):
            raise ValueError("weights: relative weights need data > 0; use absolute weights or sigma")
        return 1.0 / y, weights
    if weights == "absolute":
        return np.full(y.shape, 1.0 / np.max(np.abs(y))), weights
    raise ValueError(f'weights: expected "relative" or "absolute", got {weights!r}')


def scale(data: CreepData, weight: np.ndarray, model: type, table: dict) -> Scaled:
    """The dimensionless problem."""
    y, size = data.response, float(np.max(np.abs(data.response)))
    span = float(data.t[-1])
    if data.J is not None:
        basis: Step | History = Step(data.t / span)
        stress = 1.0
    else:
        knots, values = data.stress
        stress = float(np.max(np.abs(values)))
        basis = merge(data.t / span, knots / span, values / stress)
    unit = size / stress
    box = models.compliance_box(model, table) / np.array([unit, unit, unit / span, unit / span])[:, None]
    problem = varpro.Problem(
        y / size, weight * size, basis, box[:3, 0], box[:3, 1], box[3],
        tau_range(data.t / span, box), varpro.sides(box[:, 0], box[:, 1]),
    )  # fmt: skip
    return Scaled(problem, unit, span)


def tau_range(t: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Retardation times worth trying, cut to what the bounds allow.

    Below t_first/40 and above 300 times the last time the curve no longer depends on tau (to 1e-17
    and to 2e-3 of a term that flow and spring already carry).
    """
    first = np.min(t[t > 0])
    low, high = first / 40.0, 300.0
    if box[1, 1] == 0.0:
        return np.array([1.0, 1.0])  # no retarded part: any value serves
    with np.errstate(divide="ignore", invalid="ignore"):
        least = box[1, 0] / box[3, 1] if box[1, 0] > 0 and np.isfinite(box[3, 1]) else 0.0
        most = box[1, 1] / box[3, 0] if box[3, 0] > 0 and np.isfinite(box[1, 1]) else np.inf
    low, high = max(low, least) if least > 0 else low, min(high, most)
    return (
        np.array([low, high])
        if low <= high
        else np.array([least or most, most if np.isfinite(most) else least])
    )


def threshold(level: float, n: int, p: int, known: bool) -> float:
    """Allowed rise of RSS for an interval: chi^2 where sigma is known, else F times s^2 (as a factor)."""
    return float(stats.chi2.ppf(level, 1) if known else stats.f.ppf(level, 1, n - p))


class Optimum(NamedTuple):
    """parts (4,) = (j0, j2, f, j2/tau), tau, rss, model and residual (n,), cost over the grid of tau."""

    parts: Array
    tau: Array
    rss: Array
    model: Array
    residual: Array
    cost: Array


@jax.jit
def minimise(problem: varpro.Problem) -> Optimum:
    """The least weighted squares: variable projection, then Gauss-Newton in log parameters."""
    _, x, tau, cost = varpro.solve(problem)
    start = jnp.append(x, x[1] / tau)
    lower = jnp.append(problem.lower, problem.ratio[0])
    upper = jnp.append(problem.upper, problem.ratio[1])
    active = (start > lower * (1 + 1e-9)) & (start < upper * (1 - 1e-9)) & (start > 0)
    parts = jnp.clip(_polish(problem, start, tau, active), lower, upper)
    residual = _residual(problem, parts, tau)
    better = residual @ residual <= jnp.sum(_residual(problem, start, tau) ** 2)
    parts = jnp.where(better, parts, start)
    tau = _tau(parts, tau)
    residual = _residual(problem, parts, tau)
    model = columns(problem.basis, tau) @ parts[:3]
    return Optimum(parts, tau, residual @ residual, model, residual, cost)


def _tau(parts: Array, tau: Array) -> Array:
    """tau = j2/(j2/tau), or the given one where there is no retarded part."""
    some = (parts[1] > 0) & (parts[3] > 0)
    return jnp.where(some, parts[1] / jnp.where(some, parts[3], 1.0), tau)


def _residual(problem: varpro.Problem, parts: Array, tau: Array) -> Array:
    return varpro.weighted_columns(problem, _tau(parts, tau)) @ parts[:3] - problem.weights * problem.data


def _polish(problem: varpro.Problem, start: Array, tau: Array, active: Array) -> Array:
    """Gauss-Newton from ``start`` in log of the active parts; the others stay as they are.

    Variable projection leaves an error of 1e-4 in tau, which ``STEPS`` squares away. Their number is
    fixed, so that many curves at once do not wait for the slowest.
    """

    def residual(u: Array) -> Array:
        return _residual(problem, jnp.where(active, jnp.exp(u), start), tau)

    def step(_: int, u: Array) -> Array:
        r, J = residual(u), jax.jacfwd(residual)(u)
        size = jnp.where(active, jnp.sqrt(jnp.maximum(jnp.sum(J * J, 0), 1e-300)), 1.0)
        J = J / size
        A = J.T @ J + jnp.diag(jnp.where(active, 1e-13, 1.0))
        trial = u - jnp.clip(jnp.linalg.solve(A, J.T @ r) / size, -1.0, 1.0)
        after = residual(trial)
        return jnp.where(after @ after < r @ r, trial, u)

    u = jax.lax.fori_loop(0, STEPS, step, jnp.log(jnp.where(active, start, 1.0)))
    return jnp.where(active, jnp.exp(u), start)


class Profile(NamedTuple):
    """ends (m, 2) of (j0, j2, f, j2/tau, slope0, J(times)...); reach (2,) of log tau; level of RSS;
    lag1: residual correlation; widening: factor on the allowed rise for correlated residuals."""

    ends: Array
    reach: Array
    level: Array
    lag1: Array
    widening: Array


@jax.jit
def profile(problem: varpro.Problem, optimum: Optimum, rule: Array, known: Array, times: Array) -> Profile:
    """Profile-likelihood extents of the parts, of the initial slope and of J at ``times``."""
    n = problem.data.shape[0]
    lag1 = lag_one(optimum.residual)
    # correlated residuals carry less information: variance times (1 + r)/(1 - r) (AR(1))
    r = jnp.minimum(lag1, 0.999)
    p = jnp.sum(problem.upper > problem.lower) + (problem.ratio[1] > problem.ratio[0])
    unit = jnp.where(known, 1.0, optimum.rss / (n - p))
    # residuals far below the stated sigma, or at rounding, are not a sign of anything
    size = jnp.sum((problem.weights * problem.data) ** 2)
    real = optimum.rss > jnp.where(known, 0.5 * (n - p), 1e-20 * size)
    widening = jnp.where((lag1 > 3.3 / jnp.sqrt(n)) & real, (1 + r) / (1 - r), 1.0)
    # rounding of the normal equations limits what a noise-free curve can resolve
    floor = 1e-13 * size
    level = optimum.rss + jnp.maximum(rule * unit * widening, floor)

    def rows(tau: Array) -> Array:
        base = jnp.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])
        slope = jnp.stack([jnp.array([0.0, 1 / tau, 0]), jnp.array([0.0, 1 / tau, 1.0])])
        return jnp.concatenate([base, slope, columns(Step(times), tau)])

    ends, reach = varpro.extents(problem, optimum.tau, optimum.cost, level, rows)
    return Profile(ends, reach, level, lag1, widening)


def lag_one(residual: Array) -> Array:
    """Correlation of neighbouring residuals, about their mean."""
    r = residual - jnp.mean(residual)
    total = jnp.sum(r * r)
    return jnp.where(total > 0, jnp.sum(r[1:] * r[:-1]) / jnp.where(total > 0, total, 1.0), 0.0)
