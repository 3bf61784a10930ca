"""Fit of a material to creep data.

The search is deterministic and needs no initial guess, and intervals are profile likelihoods, both by variable projection
(``search/varpro.py``); the level of an interval follows from the noise of the residuals (``inference/sample.py``).
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.tree_util import Partial

import jaxcontact as jc
from fitting.data.creep import CreepData
from fitting.data.curves import check_kind, evaluation_times
from fitting.data.weights import choose_weights
from fitting.fits.laws import OwnCreepCurve, ScaledCreepCurve
from fitting.inference import noise, verdict
from fitting.inference.noise import basis
from fitting.inference.result import Comparison, Fit, FitProblem, conclude, linear_band, plain
from fitting.inference.sample import (
    Assessment,
    Sample,
    Solved,
    all_reweighted_until_stable,
    check_count,
    reweighted_until_stable,
)
from fitting.models.parameters import Landscape
from fitting.models.structure import Law, OwnLaw, Sought, Structure, creep_structure, limits, resolve
from fitting.search import nonlinear, varpro
from fitting.search.nonlinear import linear_sd
from fitting.search.varpro import Optimum, Scaled, TauProblem
from fitting.views import text
from fitting.views.text import described
from jaxcontact._support.pytree import require_real
from jaxcontact.bodies.materials import Material

# Detection of isolated outliers of a creep curve, such as a reading before the load or a spike.
#
# A fit may pass through a single influential point, which then shows no residual. So each point of high leverage, or
# with a large residual, is left out in turn, alone and with its neighbour, and the rest are fitted again. The point
# is dropped if its deleted residual is then larger than noise can explain (the externally studentised residual; R. D.
# Cook, S. Weisberg, Residuals and Influence in Regression, 1982, sec. 2.2) and the points around it agree with the
# fit.


MUCH = 0.3  # leverage above which a point is tried
TRIED = 4  # largest number of points of each kind that are tried
CHANCE = 1e-4  # probability of leaving out a point of a series of Gaussian noise
LEAST = 1e-2  # smallest relative deviation of a dropped point
MOST = 0.05  # largest fraction of the points that may be left out


def leave_out(problem: TauProblem, n: int) -> tuple[np.ndarray, TauProblem, Optimum]:
    """Return which of n points remain without outliers (n,) bool, the problem with zero weight on the others, and its
    optimum; those of all points if there are too many outliers. One outlier, or a pair, is dropped in each turn."""
    found = of_all_points = np.ones(n, dtype=bool), problem, varpro.minimise(problem)
    while True:
        kept, fewer, best = found
        fitted = np.flatnonzero(kept)
        # 1. The points to be tried: those of high leverage, alone and with the following point, and of large residual.
        jacobian, residual = varpro.inside_jacobian(fewer, best)[fitted], np.asarray(best.residual)[fitted]
        leverage = np.sum(basis(jacobian) ** 2, 1)
        decisive = [int(i) for i in np.argsort(-leverage)[:TRIED] if leverage[i] > MUCH]
        deviating = sorted(verdict.outlying(residual, basis(jacobian)), key=lambda i: -abs(residual[i]))[
            :TRIED
        ]
        trials = [[int(fitted[i])] for i in dict.fromkeys([*decisive, *deviating])]
        trials += [[int(fitted[i]), int(fitted[i + 1])] for i in decisive if i + 1 < fitted.size]

        # 2. A fit to the others for each of them; the one with the most significant deviation is kept as ``worst``.
        worst, highest = None, 1.0
        for points in trials:
            others, weights = kept.copy(), np.array(problem.weights)
            others[points] = False
            weights[:n][~others] = 0.0
            without = problem._replace(weights=weights)
            optimum = varpro.minimise(without)
            # deviations of all points, weighted, from the fit to the others
            rest, deviations = np.flatnonzero(others), np.asarray(varpro.residuals(problem, optimum))[:n]
            values = np.abs(deviations + np.asarray(problem.weights * problem.data)[:n])
            jacobian = varpro.inside_jacobian(problem, optimum)[:n]
            dof, least = rest.size - jacobian.shape[1], np.min(np.abs(deviations[points]))
            neighbours = [i for i in (min(points) - 1, max(points) + 1) if 0 <= i < n]
            enough_points = dof >= 2
            relevant = least >= LEAST * np.max(values[points])
            isolated = np.max(np.abs(deviations[neighbours])) <= verdict.ISOLATED * least
            if not (enough_points and relevant and isolated):
                continue
            # the smallest deleted residual over its limit of significance: above 1, and that of the trials before
            predicted = _prediction_variance(jacobian[rest], jacobian[points])
            variance = deviations[rest] @ deviations[rest] / dof * (1.0 + predicted)
            limit = noise.two_sided(1.0 - CHANCE / n, dof)
            score = float(np.min(np.abs(deviations[points]) / np.sqrt(variance + 1e-300))) / limit
            significant = score > highest
            if significant:
                worst, highest = (others, without, optimum), score

        # 3. End without a significant one, and give up with too many; otherwise go on without it.
        if worst is None:
            return found
        if np.sum(~worst[0]) > max(MOST * n, 2):
            return of_all_points
        found = worst


def _prediction_variance(jacobian: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return x (A^T A)^-1 x of rows x (m, k), the variance of a prediction there over that of a point, infinite along
    directions that the Jacobian A (n, k) does not determine."""
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    _, s, V = np.linalg.svd(jacobian / size, full_matrices=False)
    along = rows / size @ V.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(np.sum((along / np.where(s > 1e-9 * s[0], s, 0.0)) ** 2, 1), nan=math.inf)


# Profiles of a classical creep fit. A problem here is in the units of ``Scaled``.


SINGLY = 64  # up to this many times are profiled one by one, by the program of one time that every fit has compiled
OTHER_FUNCTIONS = 5  # functions before J(t) in a profile: j0, j2, f, j2/tau, slope0
COMBINATIONS = [0, 4, 5]  # the places of J0, slope0 and J at the first of the times in a profile
ROUND_OFF = 1e-14  # of a compliance in scaled units


def interval_ends(scaled: Scaled, best: Optimum, assessment: Assessment, t: np.ndarray) -> np.ndarray:
    """Return the ends (5 + k, 2) of the intervals of j0, j2, f, j2/tau, slope0 and J at times t (k,) [s], scaled, by
    ``varpro.profile``.

    Many times are padded so that only a few values of k are compiled.
    """
    times = t / scaled.time
    times = nonlinear.repeated(times) if t.size > SINGLY else times
    levels = assessment.levels(_gradients(best, times)[scaled.tau_problem.free])

    def run(which: np.ndarray, at: np.ndarray) -> np.ndarray:
        own = levels[which]
        same = np.ptp(own) <= 1e-12 * own[0]  # as they often are
        return np.asarray(varpro.profile(scaled.tau_problem, best, own[0] if same else own, at))

    if not 0 < t.size <= SINGLY:
        return run(np.arange(levels.size), times)[: OTHER_FUNCTIONS + t.size]
    first = np.arange(OTHER_FUNCTIONS)
    rows = [run(np.append(first, OTHER_FUNCTIONS + k), times[[k]]) for k in range(t.size)]
    return np.concatenate([rows[0], *(row[OTHER_FUNCTIONS:] for row in rows[1:])])


def creep_limits(scaled: Scaled, best: Optimum, assessment: Assessment, t: np.ndarray) -> np.ndarray:
    """Return the limits (2, k) of J [1/Pa] at times t (k,) [s]."""
    return interval_ends(scaled, best, assessment, t)[OTHER_FUNCTIONS:].T * scaled.compliance


def _gradients(best: Optimum, times: np.ndarray) -> np.ndarray:
    """Return the gradients of j0, j2, f, j2/tau, slope0 and J(times) with respect to (j0, j2, f, j2/tau), (4, m),
    scaled."""
    (_, j2, _, _), tau = np.asarray(best.parts), float(best.tau)
    decay, one = np.exp(-times / tau), np.ones(times.size)
    # J = j0 + j2 (1 - exp(-t/tau)) + f t with tau = j2/ratio, d tau = tau (dj2/j2 - dratio/ratio); by_tau: dJ/dlog tau/j2
    by_tau = -decay * times / tau if j2 > 0 else 0.0 * times
    creep = np.stack([one, 1.0 - decay + by_tau, times, -by_tau * tau])
    return np.column_stack([np.eye(4), [0.0, 0.0, 1.0, 1.0], creep])


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CreepFit(Fit):
    """Result of the fit of a creep curve; the attributes common to all fits are documented in ``Fit``.

    Attributes:
        combinations: {name: (value, sd, low, high)} of J0 [1/Pa], slope0 = 1/eta1 + 1/eta2 [1/(Pa s)] and J(T) [1/Pa],
            which stay identifiable where single parameters are not; empty for a fractional law.
        kept: (n,) bool, the points that were fitted; ``fitted`` and ``residuals`` have values at these points.
        point_weights: (n,) [1/unit of the data], the weights of the residuals of all points.
        sample: the curve with the weights with which the fit began; sought: the model with its bounds.
        profile: function that returns the limits (2, m) of J [1/Pa] at times (m,) [s].
    """

    combinations: dict[str, tuple[float, float, float, float]]
    kept: np.ndarray
    point_weights: np.ndarray
    sample: Sample = dataclasses.field(repr=False)
    sought: Sought = dataclasses.field(repr=False)
    profile: Callable[[Any], np.ndarray] = dataclasses.field(repr=False)

    def band(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the limits (low, high) of J(t) [1/Pa] at the level of the fit, t (m,) [s].

        They come from the profile likelihood, or for a fractional law from linearisation in log J.
        """
        low, high = self.profile(np.atleast_1d(evaluation_times(t)))
        return low, high

    def compare(self, *others: type | str | Material) -> Comparison:
        """Fit further models to the same data with the same weights, fixed values and bounds; see ``fitting.compare``."""
        models = [getattr(self.structure, "start", self.model), *others]
        table = self.sought.table.items()
        fixed = {name: low for name, (low, high) in table if low == high}
        bounds = {name: (low, high) for name, (low, high) in table if low < high}
        each = restrictions(self.data, models, fixed, bounds)
        return _compared(self.data, self.sample, _sought(each, self.sought.volume.value), self.level)

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with the combinations."""
        combinations = {name: plain(row) for name, row in self.combinations.items()}
        return super().to_dict() | {"combinations": combinations, "convention": self.data.convention}

    def _choices(self) -> list[str]:
        return [*super()._choices(), f"compliance: {self.data.convention}"]

    def _conditions(self) -> list[str]:
        if not self.refused or not self.misfit:
            return []
        return [
            "  next: fit_prony(data) chooses the number of retardation times from the data (jaxcontact fit prony)"
        ]

    def _combination_lines(self) -> list[str]:
        units = {"slope0": "1/(Pa s)"}
        return [
            f"  {name:6s} = {value:11.5g} {units.get(name, '1/Pa')}, sd {sd:.2g}, {text.span(low, high)}"
            for name, (value, sd, low, high) in self.combinations.items()
        ]


def fit_creep(
    data: CreepData,
    model: type | str | Material = jc.Burgers,
    *,
    weights: str | None = None,
    sigma: Any = None,
    fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None,
    nu: float = 0.3,
    level: float = 0.95,
) -> CreepFit:
    """Fit a material to a creep curve; the search is deterministic and needs no initial guess.

    On real data the choice of weights can change the moduli by a factor of two or more; the summary states the weights
    that were used.

    Args:
        data: the curve, n points.
        model: a material class with at most one retardation time, or a fractional one, or its name; ``fit_prony`` takes
            more. An instance of any material, of one's own too (``jaxcontact.abc.Material``), is the start of a
            search for all its numbers; it keeps its nu or bulk modulus whatever ``nu`` is. For a fractional law the
            returned material is its Prony approximation (``jc.Springpot.prony``) over the times of the data, and no
            point is left out of the fit.
        weights: "estimated" (the default without a sigma): standard deviation (a^2 + (b J)^2)^(1/2), a and b estimated
            from the data (``data/weights.py``) and then from the residuals (``inference/noise.py``), with isolated outliers
            left out;
            "proportional" (errors are a fraction of the fitted J); "relative" (of the measured J, which makes a fit too low
            by about the square of the relative error; a note says where this matters); "absolute" (one error for all).
        sigma: the known standard deviation, a number or (n,) [unit of the data]; by default the standard deviation that
            the data carry, if any. For resampled data, ``scatter`` is the default.
        fixed: {parameter: value} [Pa, Pa s] of any subset.
        bounds: {parameter: (low, high)} [Pa, Pa s] of any subset, None for an open side.
        nu: Poisson's ratio that the returned material is given; creep in shear does not depend on it.
        level: confidence level of the intervals.

    Returns:
        The material with its intervals, and how well the data determine it.

    Raises:
        ValueError: an unknown model or parameter, two choices of weights, or too few points.

    Example:
        >>> t = np.linspace(0.0, 10.0, 21)
        >>> data = fitting.CreepData(t=t, J=1e-6 * (1.0 + t))
        >>> fit = fitting.fit_creep(data, "Maxwell", weights="relative")
        >>> print(f"G = {fit.values['G']:.4g} Pa, eta = {fit.values['eta']:.4g} Pa s")
        G = 1e+06 Pa, eta = 1e+06 Pa s
    """
    structure = creep_structure(model, data)
    sample = creep_sample(data, weights, sigma)
    return _fit(data, sample, Sought.of(structure, fixed, bounds, nu), level)


def _fit(
    data: CreepData, first: Sample, sought: Sought, level: float, given: np.ndarray | None = None
) -> CreepFit:
    """Fit a creep curve.

    first: its sample, with the weights of the first search; given (n,): weights of an earlier fit, which are then used
    unchanged in place of these, with no point left out.
    """
    sample = first if given is None else first._replace(weights=given, final=True)
    structure = sought.structure
    if isinstance(structure, Law):
        # a fractional law, or a material of one's own
        search = (OwnCreepCurve if isinstance(structure, OwnLaw) else ScaledCreepCurve).of(data)
        solved, conclusion = search.concluded(data, sought, sample, search.duration, level)
        band = functools.partial(linear_band, conclusion.common.structure, conclusion.common.estimate, level)
        return conclusion.fit(
            CreepFit, sample=first, sought=sought, kept=solved.kept, point_weights=solved.weights, combinations={},
            profile=band,
        )  # fmt: skip

    # 1. The search in scaled units, over the compliances (j0, j2, f, j2/tau).
    scaled = varpro.scale(data, sample.weights, structure, sought.table)
    space = scaled.space(structure)
    n, size, free = data.t.size, float(np.max(np.abs(data.response))), space.free
    problem = FitProblem(data, sought, space, sample, scaled.time, level)

    def solve(weights: np.ndarray) -> Solved:
        """Return the optimum with weights (n,) [1/unit of the response], with residuals and Jacobian at all points."""
        weighted = scaled.tau_problem._replace(weights=nonlinear.without_weight(weights * size))
        if sample.label == "estimated" and not sample.final:  # isolated points may be left out
            kept, fewer, best = leave_out(weighted, n)
        else:
            kept, fewer, best = np.ones(n, dtype=bool), weighted, varpro.minimise(weighted)
        residual = np.asarray(varpro.residuals(weighted, best))[:n]
        jacobian = np.asarray(varpro.jacobian(weighted, best))[:n, free]
        inside = np.asarray(varpro.strictly_inside(best.parts, *weighted.limits))[free]
        own_scaled = scaled._replace(tau_problem=fewer)
        find_ends = lambda assessment: (interval_ends(own_scaled, best, assessment, data.t[-1:]), 0)
        return Solved(
            np.asarray(best.parts), residual, jacobian, inside, kept, weights, find_ends, (fewer, best)
        )  # fmt: skip

    # 2. The weights and the optimum follow from each other. fewer: the problem without the points that were left out.
    solved = reweighted_until_stable(sample, solve(sample.weights), solve, problem.p)
    (fewer, best), kept = solved.search_result, solved.kept
    scaled = scaled._replace(tau_problem=fewer)
    notes = []
    if not kept.all():
        times = ", ".join(f"{t:.4g}" for t in data.t[~kept][:5])
        notes.append(f"{np.sum(~kept)} of {n} points left out as isolated outliers: t = {times} s")

    # 3. Noise, intervals and goodness of fit; the landscape is for later sampling of the posterior.
    residual = Partial(varpro.residuals_at, fewer)
    own = space.material
    landscape = Landscape(
        residual, np.asarray(best.parts)[own], np.stack(space.bounds, -1)[own], space.unit[own]
    )
    conclusion = conclude(problem, solved._replace(notes=notes, landscape=landscape))

    # 4. J0, slope0 = 1/eta1 + 1/eta2 and J at the last time, which is 1 in scaled units, with their intervals; ends that are
    # zero have errors of round-off.
    (j0, j2, f, ratio), tau = np.asarray(best.parts), float(best.tau)
    slopes = np.zeros((len(conclusion.assessment.slopes), 4))
    slopes[:, free] = conclusion.assessment.slopes
    sd = linear_sd(slopes, _gradients(best, np.ones(1))[:, COMBINATIONS].T, np.isin(np.arange(4), free))
    values = np.array([j0, ratio + f, j0 - j2 * math.expm1(-1.0 / tau) + f])
    ends = np.where(conclusion.ends > ROUND_OFF, conclusion.ends, 0.0)[COMBINATIONS]
    units = scaled.compliance * np.array([1.0, 1.0 / scaled.time, 1.0])
    rows = np.column_stack([values, sd, ends]) * units[:, None]
    return conclusion.fit(
        CreepFit, sample=first, sought=sought, kept=kept, point_weights=solved.weights,
        combinations={name: tuple(row.tolist()) for name, row in zip(("J0", "slope0", "J(T)"), rows, strict=True)},
        profile=functools.partial(creep_limits, scaled, best, conclusion.assessment),
    )  # fmt: skip


def creep_sample(data: CreepData, weights: str | None, sigma: Any) -> Sample:
    """Return the curve with the requested weights; by default the known errors of the data, otherwise estimated ones."""
    check_kind(data, CreepData)
    if weights is None and sigma is None:
        sigma = data.error
        weights = "estimated" if sigma is None and data.scatter is None else None
    return Sample.of(data.curve, *choose_weights(data.t, data.response, weights, sigma, data.scatter))


def restrictions(
    data: Any, models: Sequence[Any], fixed: dict[str, float] | None, bounds: dict[str, tuple] | None
) -> list[tuple[Any, Structure, dict[str, dict]]]:
    """Return each model, its structure, and {"fixed": ..., "bounds": ...} with what applies to it.

    ValueError for a parameter of no model."""
    structures = [creep_structure(model, data) for model in models]
    own = {structure.model: (model, structure) for model, structure in zip(models, structures, strict=True)}
    known = set().union(*(structure.where for structure in structures))
    for name in [*(fixed or {}), *(bounds or {})]:
        if name not in known:
            raise ValueError(f"fixed, bounds: expected parameters among {sorted(known)}, got {name!r}")
    mine = lambda given, where: {name: v for name, v in (given or {}).items() if name in where}
    return [
        (model, structure, {"fixed": mine(fixed, structure.where), "bounds": mine(bounds, structure.where)})
        for model, structure in own.values()
    ]


def compare_creep(
    data: CreepData, each: list[tuple[Any, Structure, dict[str, dict]]], *, weights: str | None = None,
    sigma: Any = None, nu: float = 0.3, level: float = 0.95,
) -> Comparison:  # fmt: skip
    """Fit models to one creep curve; each: returned by ``restrictions``; further arguments as in ``fit_creep``."""
    return _compared(data, creep_sample(data, weights, sigma), _sought(each, nu), level)


def _sought(each: list[tuple[Any, Structure, dict[str, dict]]], nu: float) -> list[Sought]:
    """Return the materials that ``restrictions`` allow, with Poisson's ratio."""
    return [Sought.of(structure, own["fixed"], own["bounds"], nu) for _, structure, own in each]


def _compared(data: CreepData, sample: Sample, each: list[Sought], level: float) -> Comparison:
    """Fit materials to one creep curve with the points and the weights of the one with the most parameters."""
    richest = max(each, key=lambda sought: len(sought.structure.where))
    first = _fit(data, sample, richest, level)
    kept = first.kept
    points = {name: getattr(data, name) for name in ("t", "J", "strain", "sigma")}
    data = dataclasses.replace(data, **{k: v if v is None else v[kept] for k, v in points.items()})
    sample, weights = sample.only(kept), first.point_weights[kept]
    others = [_fit(data, sample, sought, level, weights) for sought in each if sought is not richest]
    return Comparison(tuple(sorted([first, *others], key=lambda fit: fit.bic)))


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
    # one problem with a leading axis; the times, the range of tau and the sides of the box are common to all
    varying = {name: np.stack([getattr(s.tau_problem, name) for s in scaled]) for name in VARYING}
    problems, own = scaled[0].tau_problem._replace(**varying), varpro.PLACES[structure.size]
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
    # the RSS allowed for each curve (m,), or for each of its profiled quantities (m, 5) where they differ; that of slope0 is
    # the largest of those of the coordinates
    levels = np.zeros((len(assessments), 5))
    levels[:, _free(problems)] = [one.levels() for one in assessments]
    levels = np.where(levels > 0.0, levels, levels.max(1, keepdims=True))
    if np.all(np.ptp(levels, axis=1) <= 1e-12 * levels[:, 0]):
        levels = levels[:, 0]
    ends = np.asarray(_profile_all(problems, best, levels))
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
