"""Many creep curves on one time grid in one compiled call."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from fitting import models, varpro
from fitting.creep import choose_weights, minimise, profile, scale, threshold
from fitting.data import CreepData
from fitting.result import open_ends, parameter_intervals

VARYING = ("data", "weights", "lower", "upper", "ratio")


class BatchFit(NamedTuple):
    """values {parameter: (m,)}, intervals {parameter: (m, 2)} (empty unless asked for), lag1 (m,)."""

    values: dict[str, np.ndarray]
    intervals: dict[str, np.ndarray]
    lag1: np.ndarray


def fit_creep_batch(
    t: Any, J: Any, model: type | str = jc.Burgers, *, weights: str, intervals: bool = False,
    fixed: dict[str, float] | None = None, bounds: dict[str, tuple] | None = None, level: float = 0.95,
) -> BatchFit:  # fmt: skip
    """Fit the rows of J (m, n) [1/Pa] at the times t (n,) [s]; the same fit as ``fit_creep`` of each.

    Raises ValueError as ``CreepData`` and ``fit_creep`` do.
    """
    model = models.resolve(model)
    table = models.limits(model, fixed, bounds)
    curves = [CreepData(t=t, J=row) for row in np.atleast_2d(np.asarray(J, dtype=float))]
    scaled = [
        scale(curve, choose_weights(curve.response, weights, None)[0], model, table) for curve in curves
    ]
    problems = _stack([s.problem for s in scaled])
    best = _minimise_all(problems)
    unit = np.array([s.compliance for s in scaled])[:, None] * np.array(
        [1, 1, 1 / scaled[0].time, 1 / scaled[0].time]
    )
    where, parts = models.PARTS[model], np.asarray(best.parts) * unit
    with np.errstate(divide="ignore"):
        values = {name: 1.0 / parts[:, part] for name, part in where.items()}
    if not intervals:
        return BatchFit(values, {}, np.full(len(curves), np.nan))
    p = sum(low < high for low, high in table.values())
    shape = _profile_all(problems, best, jnp.asarray(threshold(level, len(curves[0].t), p, False)))
    ends, reach = np.asarray(shape.ends), np.asarray(shape.reach)
    rows = [
        parameter_intervals(open_ends(ends[i], reach[i], s.problem)[:4] * unit[i][:, None], where, table)
        for i, s in enumerate(scaled)
    ]
    gathered = {name: np.array([row[name] for row in rows]) for name in where}
    return BatchFit(values, gathered, np.asarray(shape.lag1))


def _stack(problems: list[varpro.Problem]) -> varpro.Problem:
    """One problem with a leading axis; times, range of tau and sides of the box are common to all."""
    columns = {name: np.stack([getattr(q, name) for q in problems]) for name in VARYING}
    return problems[0]._replace(**columns)


def _axes(problems: varpro.Problem) -> varpro.Problem:
    """What vmap runs over: the common basis and range stay unbatched, so their exponentials are shared."""
    return varpro.Problem(**{name: 0 if name in VARYING else None for name in problems._fields})


@jax.jit
def _minimise_all(problems: varpro.Problem) -> Any:
    return jax.vmap(minimise, in_axes=(_axes(problems),))(problems)


@jax.jit
def _profile_all(problems: varpro.Problem, best: Any, rule: jax.Array) -> Any:
    one = lambda q, b: profile(q, b, rule, jnp.asarray(False), jnp.zeros(0))
    return jax.vmap(one, in_axes=(_axes(problems), 0))(problems, best)
