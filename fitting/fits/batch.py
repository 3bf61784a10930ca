"""Fits of many creep curves on one time grid in one compiled call."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from fitting.data.creep import CreepData
from fitting.data.weights import choose_weights
from fitting.inference import verdict
from fitting.inference.sample import Assessment, Sample, Solved, all_reweighted_until_stable, check_count
from fitting.models.structure import limits, resolve
from fitting.search import nonlinear, varpro
from fitting.search.varpro import Optimum
from fitting.views.text import described
from jaxcontact._support.pytree import require_real

VARYING = ("data", "weights", "lower", "upper", "ratio", "origin")


class BatchFit(NamedTuple):
    """Fits of m creep curves on one time grid.

    Attributes:
        values: {parameter: (m,)} [Pa, Pa s].
        intervals: {parameter: (m, 2)}, empty unless requested.
        lag1: lag-1 correlation of the residuals (m,), nan without intervals.
        refused: (m,) bool, True for fits that are rejected by their residuals (``fitting.inference.verdict``); False without
            intervals.
        notes: remarks on the data.
    """

    values: dict[str, np.ndarray]
    intervals: dict[str, np.ndarray]
    lag1: np.ndarray
    refused: np.ndarray
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        rows = [(name, values, "") for name, values in self.values.items()]
        rows += [(f"{name} interval", ends, "") for name, ends in self.intervals.items()]
        rows += [("lag1", self.lag1, ""), ("rejected", np.sum(self.refused), "")]
        return described(f"BatchFit: {self.refused.size} curves, parameters in Pa and Pa s", rows, self.notes)


def fit_creep_batch(
    t: Any, J: Any, model: type | str = jc.Burgers, *, weights: str, intervals: bool = False,
    fixed: dict[str, float] | None = None, bounds: dict[str, tuple] | None = None, level: float = 0.95,
    start: float | None = None,
) -> BatchFit:  # fmt: skip
    """Fit many curves on one time grid at once; each fit is that of ``fit_creep``.

    Args:
        t: times (n,) [s].
        J: one curve in each row, (m, n) [1/Pa].
        model: as in ``fit_creep``.
        weights: "estimated", "proportional", "relative" or "absolute"; no point is left out.
        intervals: whether to compute intervals too, which takes about ten times as long.
        fixed: as in ``fit_creep``, for all curves.
        bounds: as in ``fit_creep``, for all curves.
        level: confidence level of the intervals.
        start: as in ``CreepData``.

    Returns:
        Values, intervals and residual correlations.

    Raises:
        ValueError: as ``CreepData`` and ``fit_creep`` do.

    Example:
        >>> t = np.linspace(0.0, 10.0, 21)
        >>> many = fitting.fit_creep_batch(t, [1e-6 * (1 + t), 1e-6 * (2 + t)], "Maxwell", weights="relative")
        >>> print(np.round(many.values["G"]))
        [1000000.  500000.]
    """
    structure = resolve(model)
    table = limits(structure, fixed, bounds)
    require_real("J", J)
    curves = [CreepData(t=t, J=row, start=start) for row in np.atleast_2d(np.asarray(J, dtype=float))]
    notes = tuple(dict.fromkeys(note for curve in curves for note in curve.notes))
    p = sum(low < high for low, high in table.values())
    check_count(level, curves[0].t.size, p)
    samples = [
        Sample.of(curve.curve, *choose_weights(curve.t, curve.response, weights, None)) for curve in curves
    ]
    scaled = [varpro.scale(c, s.weights, structure, table) for c, s in zip(curves, samples, strict=True)]
    problems, own = _stack([s.tau_problem for s in scaled]), varpro.PLACES[structure.size]
    if intervals or samples[0].adjustable:
        solve = lambda weights: _solve(samples, problems, weights)
        found = all_reweighted_until_stable(samples, solve([one.weights for one in samples]), solve, p)
        problems, best = found[0].search_result
    else:  # the residuals are not needed
        best = _minimise_all(problems)
    unit = np.array([structure.units(s.compliance, s.time) for s in scaled])
    rows = [structure.parameters(row) for row in np.asarray(best.parts)[:, own] * unit]
    values = {name: np.array([row[name] for row in rows]) for name in structure.where}
    if not intervals:
        return BatchFit(values, {}, np.full(len(curves), np.nan), np.zeros(len(curves), dtype=bool), notes)
    assessments = [sample.assess(one, p, level) for sample, one in zip(samples, found, strict=True)]
    ends = np.asarray(_profile_all(problems, best, _levels(assessments, problems)))
    spans = ends[:, own] * unit[:, :, None]
    rows = [structure.intervals(row, table) for row in spans]
    gathered = {name: np.array([row[name] for row in rows]) for name in structure.where}
    lag1 = np.array([one.evidence.lag1 for one in assessments])
    refused = [
        bool(one.evidence.refused or verdict.too_stiff(structure, row))
        for one, row in zip(assessments, rows, strict=True)
    ]
    return BatchFit(values, gathered, lag1, np.array(refused), notes)


def _solve(samples: list[Sample], problems: varpro.TauProblem, weights: list[np.ndarray]) -> list[Solved]:
    """Return the optimum of each curve with weights (n,) [1/Pa]."""
    n, free = samples[0].t.size, _free(problems)
    sizes = [float(np.max(np.abs(sample.measured))) for sample in samples]
    rows = [nonlinear.without_weight(own * size) for own, size in zip(weights, sizes, strict=True)]
    problems = problems._replace(weights=np.stack(rows))
    best = _minimise_all(problems)
    parts, residual, J = (np.asarray(a) for a in (best.parts, best.residual, _jacobian_all(problems, best)))
    inside = np.asarray(varpro.strictly_inside(parts, *_limits_all(problems)))
    every, result = np.ones(n, dtype=bool), (problems, best)
    return [
        Solved(
            parts[k], residual[k, :n], J[k, :n][:, free], inside[k, free], every, own, search_result=result
        )
        for k, own in enumerate(weights)
    ]


def _free(problems: varpro.TauProblem) -> np.ndarray:
    """Return the places of the fitted compliances, which are the same for every curve."""
    lower, upper = (np.asarray(side)[0] for side in _limits_all(problems))
    return np.flatnonzero(lower < upper)


def _levels(assessments: list[Assessment], problems: varpro.TauProblem) -> np.ndarray:
    """Return the RSS allowed for each curve (m,), or for each of its profiled quantities (m, 5) where they differ.

    The level of slope0 is the largest of those of the coordinates.
    """
    levels = np.zeros((len(assessments), 5))
    levels[:, _free(problems)] = [one.levels() for one in assessments]
    levels = np.where(levels > 0.0, levels, levels.max(1, keepdims=True))
    same = np.all(np.ptp(levels, axis=1) <= 1e-12 * levels[:, 0])
    return levels[:, 0] if same else levels


def _stack(problems: list[varpro.TauProblem]) -> varpro.TauProblem:
    """Return one problem with a leading axis; the times, the range of tau and the sides of the box are common to all."""
    columns = {name: np.stack([getattr(q, name) for q in problems]) for name in VARYING}
    return problems[0]._replace(**columns)


def _axes(problems: varpro.TauProblem) -> varpro.TauProblem:
    """Return the axes of vmap: the common history and range stay unbatched, so their exponentials are shared."""
    return varpro.TauProblem(**{name: 0 if name in VARYING else None for name in problems._fields})


@jax.jit
def _minimise_all(problems: varpro.TauProblem) -> Optimum:
    return jax.vmap(varpro.minimise, in_axes=(_axes(problems),))(problems)


@jax.jit
def _limits_all(problems: varpro.TauProblem) -> tuple[jax.Array, jax.Array]:
    return jax.vmap(lambda q: q.limits, in_axes=(_axes(problems),))(problems)


@jax.jit
def _jacobian_all(problems: varpro.TauProblem, best: Optimum) -> jax.Array:
    return jax.vmap(varpro.jacobian, in_axes=(_axes(problems), 0))(problems, best)


@jax.jit
def _profile_all(problems: varpro.TauProblem, best: Optimum, level: jax.Array) -> jax.Array:
    one = lambda q, b, most: varpro.profile(q, b, most, jnp.zeros(0))
    return jax.vmap(one, in_axes=(_axes(problems), 0, 0))(problems, best, level)
