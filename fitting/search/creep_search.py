"""Optimum and profiles of a creep curve as compiled programs; ``batch.py`` runs the same for many curves.

Variable projection (``varpro.py``) finds the optimum to the resolution of its grid of tau; Gauss-Newton steps with
exact Jacobians in the logarithms of the compliances remove the remaining error.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.data.curves import CreepData
from fitting.models.history import History, Step, columns, merge
from fitting.models.structure import Structure
from fitting.search import padding, varpro
from jaxcontact._compile.kept_traces import Program

STEPS = 3  # number of Gauss-Newton steps


class Scaled(NamedTuple):
    """A dimensionless problem with the units that undo its scaling: ``compliance`` [1/Pa] and ``time`` [s]."""

    problem: varpro.TauSearch
    compliance: float
    time: float


def scale(data: CreepData, weight: np.ndarray, structure: Structure, table: dict) -> Scaled:
    """Return the dimensionless problem, padded."""
    y, size = data.response, float(np.max(np.abs(data.response)))
    span, (stressed, stress) = float(data.t[-1]), basis(data)
    unit = size / stress
    box = structure.box(table) / structure.units(unit, span)[:, None]
    y, weight = padding.repeated(y / size), padding.without_weight(weight * size)
    return Scaled(varpro.search(y, weight, stressed, data.t / span, box), unit, span)


def basis(data: CreepData) -> tuple[Step | History, float]:
    """Return the padded stress, scaled by its largest value and the duration, and that value [Pa]; a unit step for J
    data."""
    span = float(data.t[-1])
    t = padding.repeated(data.t / span)
    if data.J is not None:
        return Step(t), 1.0
    knots, values = data.stress
    stress = float(np.max(np.abs(values)))
    return merge(t, padding.repeated(knots / span), padding.repeated(values / stress)), stress


class Optimum(NamedTuple):
    """An optimum: parts (4,) = (j0, j2, f, j2/tau), tau, weighted residual (n,), cost over the grid of tau."""

    parts: Array
    tau: Array
    residual: Array
    cost: Array


@Program
def minimise(problem: varpro.TauSearch) -> Optimum:
    """Return the least-squares solution: variable projection, then Gauss-Newton in log parameters."""
    _, x, tau, cost = varpro.solve(problem)
    start = jnp.append(x, x[1] / tau)
    lower, upper = problem.limits
    active = strictly_inside(start, lower, upper)
    parts = jnp.clip(_polish(problem, start, tau, active), lower, upper)
    residual = _residual(problem, parts, tau)
    better = residual @ residual <= jnp.sum(_residual(problem, start, tau) ** 2)
    parts = jnp.where(better, parts, start)
    tau = _tau(parts, tau)
    return Optimum(parts, tau, _residual(problem, parts, tau), cost)


def strictly_inside(parts: Array, lower: Array, upper: Array) -> Array:
    """Return which compliances are off their bounds and nonzero, (4,) bool."""
    return (parts > lower * (1 + 1e-9)) & (parts < upper * (1 - 1e-9)) & (parts > 0)


def _tau(parts: Array, tau: Array) -> Array:
    """Return tau = j2/(j2/tau), or the given one where there is no retarded part."""
    some = (parts[1] > 0) & (parts[3] > 0)
    return jnp.where(some, parts[1] / jnp.where(some, parts[3], 1.0), tau)


def _residual(problem: varpro.TauSearch, parts: Array, tau: Array) -> Array:
    return varpro.weighted_columns(problem, _tau(parts, tau)) @ parts[:3] - problem.weights * problem.data


@Program
def jacobian(problem: varpro.TauSearch, optimum: Optimum) -> Array:
    """Return the exact derivative of the weighted model with respect to parts, (n, 4); at j2 = 0 tau is held."""
    return jax.jacfwd(lambda parts: _residual(problem, parts, optimum.tau))(optimum.parts)


@Program
def residuals(problem: varpro.TauSearch, optimum: Optimum) -> Array:
    """Return the weighted residuals (n,) of a problem at the optimum of another."""
    return _residual(problem, optimum.parts, optimum.tau)


def residuals_at(problem: varpro.TauSearch, values: Array) -> Array:
    """Return the weighted residuals (n,) at the compliances of a material, (2,) or (4,), all > 0."""
    parts = jnp.zeros(4).at[np.asarray(varpro.PLACES[values.size])].set(values)
    return _residual(problem, parts, jnp.ones(()))


def inside_jacobian(problem: varpro.TauSearch, optimum: Optimum) -> np.ndarray:
    """Return the columns (n, k) of ``jacobian`` for the compliances off their bounds."""
    inside = strictly_inside(optimum.parts, *problem.limits)
    return np.asarray(jacobian(problem, optimum))[:, np.asarray(inside)]


def _polish(problem: varpro.TauSearch, start: Array, tau: Array, active: Array) -> Array:
    """Refine ``start`` by Gauss-Newton steps in the logarithms of the active parts; the other parts are held.

    Variable projection leaves an error of 1e-4 in tau, which converges quadratically in ``STEPS`` steps. Their number
    is fixed, so that a batch of curves does not wait for the slowest.
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


@Program
def profile(problem: varpro.TauSearch, optimum: Optimum, level: Array, times: Array) -> Array:
    """Return profile-likelihood extents (m, 2) of (j0, j2, f, j2/tau, slope0, J(times)...) over RSS <= level, () or
    (m,).

    slope0 is the initial slope of J; the upper end is infinite where open.
    """
    problem = problem._replace(origin=optimum.parts[:3])

    def rows(tau: Array) -> Array:
        base = jnp.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])
        slope = jnp.stack([jnp.array([0.0, 1 / tau, 0]), jnp.array([0.0, 1 / tau, 1.0])])
        return jnp.concatenate([base, slope, columns(Step(times), jnp.reshape(1.0 / tau, 1))])

    one = lambda most, d: varpro.extents(problem, optimum.tau, optimum.cost, most, d)
    if jnp.ndim(level) == 0:
        ends, reach = one(level, rows)
        return _opened(ends, reach, problem)
    single = lambda i: one(level[i], lambda tau: jax.lax.dynamic_slice_in_dim(rows(tau), i, 1))
    ends, reach = jax.lax.map(single, jnp.arange(level.size))
    return _opened(ends[:, 0], reach.T, problem)


def _opened(ends: Array, reach: Array, problem: varpro.TauSearch) -> Array:
    """Return extents (m, 2) with an infinite end where they grow with tau without limit.

    If every tau up to the upper end of the search fits, j2 has no upper limit; if every tau down to the lower end does,
    neither 1/eta2 = j2/tau nor the initial slope has one.
    """
    low, high = jnp.log(problem.tau)
    slow = (reach[1] >= high) & ~jnp.isfinite(problem.upper[1])
    fast = (reach[0] <= low) & ~jnp.isfinite(problem.ratio[1])
    slow, fast = (jnp.broadcast_to(side, ends.shape[:1]) for side in (slow, fast))
    place = jnp.arange(ends.shape[0])
    open_end = jnp.where(place == 1, slow, ((place == 3) | (place == 4)) & fast)
    return ends.at[:, 1].set(jnp.where(open_end, jnp.inf, ends[:, 1]))
