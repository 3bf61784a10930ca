"""Fit of a material to creep data, with profile-likelihood intervals (``evidence.py``).

The search is deterministic and needs no initial guess (``creep_search.py``).
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from jax.tree_util import Partial

import jaxcontact as jc
from fitting.data.curves import CreepData, check_kind, evaluation_times
from fitting.data.indentation import IndentationData
from fitting.data.moduli import OscillationData, RelaxationData
from fitting.data.weights import choose_weights
from fitting.fits.fractional import Law, ScaledCreepCurve, creep_structure
from fitting.fits.indentation import fit_indentation
from fitting.fits.modulus import fit_oscillation, fit_relaxation
from fitting.inference import noise, verdict
from fitting.inference.conclusion import FitProblem, conclude, least_squares
from fitting.inference.noise import basis
from fitting.inference.result import Fit, linear_band, plain
from fitting.inference.verdict import Assessment, Sample, Solved, settled
from fitting.models.parameters import Landscape, Parameters
from fitting.models.structure import Sought, Structure
from fitting.search import nonlinear, varpro
from fitting.search.nonlinear import linear_sd
from fitting.search.varpro import PLACES, Optimum, Scaled, TauSearch
from fitting.views import text

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


class SupportedPoints(NamedTuple):
    """The points of a creep curve that remain after outliers are dropped.

    kept (n,) bool: the remaining points; problem: with zero weight on the others; best: its optimum.
    """

    kept: np.ndarray
    problem: varpro.TauSearch
    best: Optimum


def keep_all(problem: varpro.TauSearch, n: int) -> SupportedPoints:
    """Return the optimum of all points."""
    return SupportedPoints(np.ones(n, dtype=bool), problem, varpro.minimise(problem))


def leave_out(problem: varpro.TauSearch, n: int) -> SupportedPoints:
    """Return the optimum without outliers, or of all points if there are too many outliers."""
    found = whole = keep_all(problem, n)
    while (worse := _worst(problem, found)) is not None:
        if np.sum(~worse.kept) > max(MOST * n, 2):
            return whole
        found = worse
    return found


def _worst(problem: varpro.TauSearch, now: SupportedPoints) -> SupportedPoints | None:
    """Return the state without the most significant outliers, None if there are none."""
    found, highest = None, 1.0
    for points in _candidates(now):
        trial = _without(problem, now.kept, points)
        score = _score(problem, trial, points)
        if score > highest:
            found, highest = trial, score
    return found


def _without(problem: varpro.TauSearch, kept: np.ndarray, points: list[int]) -> SupportedPoints:
    kept = kept.copy()
    kept[points] = False
    weights = np.array(problem.weights)
    weights[: kept.size][~kept] = 0.0
    fewer = problem._replace(weights=weights)
    return SupportedPoints(kept, fewer, varpro.minimise(fewer))


def _candidates(now: SupportedPoints) -> list[list[int]]:
    """Return points of high leverage or large residual, alone and, of the first kind, with the following point."""
    on = np.flatnonzero(now.kept)
    J = varpro.inside_jacobian(now.problem, now.best)[on]
    residual, say = np.asarray(now.best.residual)[on], np.sum(basis(J) ** 2, 1)
    much = [int(i) for i in np.argsort(-say)[:TRIED] if say[i] > MUCH]
    off = sorted(verdict.outlying(residual, basis(J)), key=lambda i: -abs(residual[i]))[:TRIED]
    alone = [[int(on[i])] for i in dict.fromkeys([*much, *off])]
    return alone + [[int(on[i]), int(on[i + 1])] for i in much if i + 1 < on.size]


def _score(problem: varpro.TauSearch, trial: SupportedPoints, points: list[int]) -> float:
    """Return the smallest deleted residual over its significance limit; 0 where the neighbouring points deviate too."""
    n, on = trial.kept.size, np.flatnonzero(trial.kept)
    away = np.asarray(varpro.residuals(problem, trial.best))[:n]
    value = np.abs(away + np.asarray(problem.weights * problem.data)[:n])
    J = varpro.inside_jacobian(problem, trial.best)[:n]
    dof = on.size - J.shape[1]
    beside = [i for i in (min(points) - 1, max(points) + 1) if 0 <= i < n]
    size = np.min(np.abs(away[points]))
    if dof < 2 or size < LEAST * np.max(value[points]):
        return 0.0
    if np.max(np.abs(away[beside])) > verdict.ISOLATED * size:
        return 0.0
    variance = away[on] @ away[on] / dof * (1.0 + _spread(J[on], J[points]))
    limit = noise.two_sided(1.0 - CHANCE / n, dof)
    return float(np.min(np.abs(away[points]) / np.sqrt(variance + 1e-300))) / limit


def _spread(J: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return x (J^T J)^-1 x of rows x (m, k), infinite along directions that J (n, k) does not determine."""
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    _, s, V = np.linalg.svd(J / size, full_matrices=False)
    along = rows / size @ V.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(np.sum((along / np.where(s > 1e-9 * s[0], s, 0.0)) ** 2, 1), nan=math.inf)


# Search of a classical creep fit in the form that ``conclusion.py`` takes: optimum, profiles and combinations.


SINGLY = 64  # most times of which each has a run of its own, with the program that every fit compiles for its duration
OTHER_FUNCTIONS = 5  # functions before J(t) in a profile
ROUND_OFF = 1e-14  # of a compliance in scaled units


@dataclasses.dataclass(frozen=True, eq=False)
class CreepSearch:
    """A creep curve in scaled units, and the rule that selects the fitted points."""

    data: CreepData
    structure: Structure
    scaled: Scaled
    choose: Callable[..., SupportedPoints]

    @classmethod
    def of(cls, data: CreepData, sought: Sought, sample: Sample) -> "CreepSearch":
        """Return the search for a classical material; points are left out where the weights are estimated."""
        scaled = varpro.scale(data, sample.weights, sought.structure, sought.table)
        return cls(data, sought.structure, scaled, leave_out if sample.robust else keep_all)

    @property
    def space(self) -> Parameters:
        """The compliances (j0, j2, f, j2/tau), over their units."""
        compliance, time = self.scaled.compliance, self.scaled.time
        box = np.stack([np.asarray(side) for side in self.scaled.problem.limits], -1)
        unit = compliance / np.array([1.0, 1.0, time, time])
        own = np.isin(np.arange(4), PLACES[self.structure.size])
        open_sides = np.stack([box[:, 0] == 0.0, np.isinf(box[:, 1])], -1)
        return Parameters.of(self.structure, box, unit=unit, material=own, open=open_sides)

    def solve(self, weights: np.ndarray) -> Solved:
        """Return the optimum with weights (n,) [1/unit of the response], with the residuals and the Jacobian at all
        points."""
        padded = nonlinear.without_weight(weights * float(np.max(np.abs(self.data.response))))
        problem, n = self.scaled.problem._replace(weights=padded), weights.size
        kept, fewer, best = self.choose(problem, n)
        residual = np.asarray(varpro.residuals(problem, best))[:n]
        free, inside = places(problem), varpro.strictly_inside(best.parts, *problem.limits)
        J = np.asarray(varpro.jacobian(problem, best))[:n, free]
        found = Extents(fewer, best, self.scaled)
        return Solved(
            np.asarray(best.parts), residual, J, np.asarray(inside)[free], kept, weights,
            lambda assessment: found.at(assessment, self.data.t[-1:]), found,
        )  # fmt: skip


def places(problem: TauSearch) -> np.ndarray:
    """Return the places of the fitted compliances among (j0, j2, f, j2/tau)."""
    lower, upper = (np.asarray(side) for side in problem.limits)
    return np.flatnonzero(lower < upper)


class Extents(NamedTuple):
    """Profile likelihoods about the optimum of a problem in the units ``scaled``."""

    problem: TauSearch
    best: Optimum
    scaled: Scaled

    def at(self, assessment: Assessment, t: np.ndarray) -> np.ndarray:
        """Return the ends (5 + k, 2) of the intervals of ``creep_search.profile`` at times t (k,) [s].

        Many times are padded so that only a few values of k are compiled.
        """
        times = t / self.scaled.time
        times = nonlinear.repeated(times) if t.size > SINGLY else times
        levels = assessment.levels(self._gradients(times)[places(self.problem)])
        if not 0 < t.size <= SINGLY:
            return self._profile(levels, times)[: OTHER_FUNCTIONS + t.size]
        each = range(OTHER_FUNCTIONS, levels.size)
        rows = [
            self._profile(levels[[*range(OTHER_FUNCTIONS), k]], times[[k - OTHER_FUNCTIONS]]) for k in each
        ]
        return np.concatenate([rows[0], *(row[OTHER_FUNCTIONS:] for row in rows[1:])])

    def _profile(self, levels: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return the ends (5 + k, 2) at scaled times (k,) for levels (5 + k,), which are often the same."""
        same = np.ptp(levels) <= 1e-12 * levels[0]
        return np.asarray(varpro.profile(self.problem, self.best, levels[0] if same else levels, times))

    def creep(self, assessment: Assessment, t: np.ndarray) -> np.ndarray:
        """Return the limits (2, k) of J [1/Pa] at times t (k,) [s]."""
        return self.at(assessment, t)[OTHER_FUNCTIONS:].T * self.scaled.compliance

    def combinations(self, ends: np.ndarray, slopes: np.ndarray) -> dict[str, Any]:
        """Return {name: (value, sd, low, high)} of J0 [1/Pa], slope0 [1/(Pa s)] and J(T) [1/Pa], with T the duration.

        ends (6, 2): the interval ends at T, scaled, of which those that are zero have errors of round-off; slopes (m, k):
        the whitened Jacobian of the fitted compliances.
        """
        (j0, j2, f, ratio), tau = np.asarray(self.best.parts), float(self.best.tau)
        free, whole = places(self.problem), np.zeros((len(slopes), 4))
        whole[:, free] = slopes
        gradients = self._gradients(np.ones(1))[:, [0, 4, 5]].T
        sd = linear_sd(whole, gradients, np.isin(np.arange(4), free))
        values = [j0, ratio + f, j0 - j2 * math.expm1(-1.0 / tau) + f]
        ends = np.where(ends > ROUND_OFF, ends, 0.0)[[0, 4, 5]]
        units = self.scaled.compliance * np.array([1.0, 1.0 / self.scaled.time, 1.0])
        rows = zip(("J0", "slope0", "J(T)"), values, sd, ends, units, strict=True)
        return {name: tuple(float(u) for u in (v * k, s * k, *(e * k))) for name, v, s, e, k in rows}

    def landscape(self, space: Parameters) -> Landscape:
        """Return the residuals as a function of the compliances of the material."""
        own = space.material
        residual = Partial(varpro.residuals_at, self.problem)
        box = np.stack(space.bounds, -1)[own]
        return Landscape(residual, np.asarray(self.best.parts)[own], box, space.unit[own])

    def _gradients(self, times: np.ndarray) -> np.ndarray:
        """Return the gradients of j0, j2, f, j2/tau, slope0 and J(times) with respect to (j0, j2, f, j2/tau), (4, m),
        scaled."""
        (_, j2, _, _), tau = np.asarray(self.best.parts), float(self.best.tau)
        decay, one = np.exp(-times / tau), np.ones(times.size)
        # with tau = j2/ratio, d tau = tau (dj2/j2 - dratio/ratio)
        turn = -decay * times / tau if j2 > 0 else 0.0 * times
        creep = np.stack([one, 1.0 - decay + turn, times, -turn * tau])
        return np.column_stack([np.eye(4), [0.0, 0.0, 1.0, 1.0], creep])


# for data other than a creep curve: the fit, and the weights in a comparison of models unless others are given
OTHERS: dict[type, tuple[Callable[..., Any], str]] = {
    RelaxationData: (fit_relaxation, "proportional"),
    OscillationData: (fit_oscillation, "proportional"),
    IndentationData: (fit_indentation, "absolute"),
}


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CreepFit(Fit):
    """Result of the fit of a creep curve; the attributes common to all fits are documented in ``Fit``.

    Attributes:
        combinations: {name: (value, sd, low, high)} of J0 [1/Pa], slope0 = 1/eta1 + 1/eta2 [1/(Pa s)] and J(T) [1/Pa],
            which stay identifiable where single parameters are not; empty for a fractional law.
        kept: (n,) bool, the points that were fitted; ``fitted`` and ``residuals`` have values at these points.
        point_weights: (n,) [1/unit of the data], the weights of the residuals of all points.
        options: the options that ``fit_creep`` was given.
        profile: function that returns the limits (2, m) of J [1/Pa] at times (m,) [s].
    """

    combinations: dict[str, tuple[float, float, float, float]]
    kept: np.ndarray
    point_weights: np.ndarray
    options: dict[str, Any]
    profile: Callable[[Any], np.ndarray] = dataclasses.field(repr=False)

    def band(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the limits (low, high) of J(t) [1/Pa] at the level of the fit, t (m,) [s].

        They come from the profile likelihood, or for a fractional law from linearisation in log J.
        """
        low, high = self.profile(np.atleast_1d(evaluation_times(t)))
        return low, high

    def compare(self, *others: type | str) -> "Comparison":
        """Fit further models to the same data with the same weights, fixed values and bounds; see ``fitting.compare``."""
        return compare(self.data, [self.model, *others], **self.options)

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
    model: type | str = jc.Burgers,
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
            more. For a fractional law the returned material is its Prony approximation (``jc.Springpot.prony``) over
            the times of the data, and no point is left out of the fit.
        weights: "estimated" (the default without a sigma): errors a + b J, estimated from the data (``weights.py``) and
            then from the residuals (``noise.py``), with isolated outliers left out (``unsupported.py``);
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
    options = {"weights": weights, "sigma": sigma, "fixed": fixed, "bounds": bounds, "nu": nu, "level": level}
    return _fit(data, creep_structure(model), options)


def _fit(data: CreepData, structure: Structure, options: dict, given: np.ndarray | None = None) -> CreepFit:
    """Fit a creep curve as ``fit_creep`` does; given (n,): estimated weights to use unchanged, without leaving a point
    out."""
    sample = creep_sample(data, options["weights"], options["sigma"])
    if given is not None:
        sample = sample._replace(weights=given, final=True)
    sought = Sought.of(structure, options["fixed"], options["bounds"], options["nu"])
    fit = _fit_law if isinstance(structure, Law) else _fit_classical
    return fit(data, sought, sample, options)


def _fit_classical(data: CreepData, sought: Sought, sample: Sample, options: dict) -> CreepFit:
    """Fit a material with at most one retardation time."""
    search = CreepSearch.of(data, sought, sample)
    problem = FitProblem(data, sought, search.space, sample, search.scaled.time, options["level"])
    first, again = search.solve(sample.weights), lambda weights: [search.solve(weights[0])]
    (solved,) = settled([sample], [first], again, problem.p)
    extents, kept = solved.whole, solved.kept
    landscape = extents.landscape(search.space)
    found = conclude(problem, solved._replace(notes=_left_out(data, kept), landscape=landscape))
    return found.fit(
        CreepFit, options=options, kept=kept, point_weights=solved.weights,
        combinations=extents.combinations(found.ends, found.assessment.slopes),
        profile=functools.partial(extents.creep, found.assessment),
    )  # fmt: skip


def _fit_law(data: CreepData, sought: Sought, sample: Sample, options: dict) -> CreepFit:
    """Fit a fractional law."""
    curve = ScaledCreepCurve.of(data, sample.weights)
    sought = curve.bounded(sought)
    law, space = sought.structure, curve.space(sought)
    assert isinstance(law, Law)
    problem = FitProblem(data, sought, space, sample, curve.duration, options["level"])
    solved = least_squares(
        problem, lambda weights: ScaledCreepCurve.of(data, weights).objective(space), curve.starts(law)
    )
    landscape = space.landscape(solved.theta, solved.whole[1].residual, relative=True)
    found = conclude(problem, solved._replace(notes=law.notes, landscape=landscape))
    band = functools.partial(linear_band, law, found.fields["estimate"], options["level"])
    return found.fit(
        CreepFit, options=options, kept=solved.kept, point_weights=solved.weights, combinations={},
        profile=band,
    )  # fmt: skip


def _left_out(data: CreepData, kept: np.ndarray) -> list[str]:
    """Return a note on the points that were left out, those not in ``kept`` (n,) bool."""
    times = ", ".join(f"{t:.4g}" for t in data.t[~kept][:5])
    left = f"{np.sum(~kept)} of {kept.size} points left out as isolated outliers: t = {times} s"
    return [] if kept.all() else [left]


def creep_sample(data: CreepData, weights: str | None, sigma: Any) -> Sample:
    """Return the curve with the requested weights; by default the known errors of the data, otherwise estimated ones."""
    check_kind(data, CreepData)
    if weights is None and sigma is None:
        sigma = data.error
        weights = "estimated" if sigma is None and data.scatter is None else None
    return Sample.of(data.curve, *choose_weights(data.t, data.response, weights, sigma, data.scatter))


def _r2(fit: Fit) -> str:
    """Return R2 as text for a table, "-" where it is not defined."""
    return "-" if math.isnan(fit.r2) else f"{fit.r2:.6f}"


class Comparison(NamedTuple):
    """Fits of several models to one data set; its text is a table.

    Attributes:
        fits: the fits, lowest BIC first.
    """

    fits: tuple[Any, ...]

    def __str__(self) -> str:
        head = f"{'model':22s}{'parameters':>11s}{'R2':>12s}{'AIC':>12s}{'BIC':>12s}{'lag-1':>8s}  misfit  verdict"
        rows = [
            f"{f.model.__name__:22s}{f.p:11d}{_r2(f):>12s}{f.aic:12.1f}{f.bic:12.1f}{f.lag1:8.2f}"
            f"  {'yes' if f.misfit else 'no':6s}  {f.verdict}"
            for f in self.fits
        ]
        return "\n".join([head, *rows])

    def __repr__(self) -> str:
        return str(self)


def compare(
    data: CreepData | RelaxationData | OscillationData | IndentationData,
    models: Sequence[type | str] = ("Maxwell", "StandardLinearSolid", "Burgers"),
    fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None,
    **options: Any,
) -> Comparison:
    """Fit several models to one creep curve, relaxation modulus, frequency sweep or indentation; the printed result is a
    table.

    All fits of a creep curve use the points and the weights of the model with the most parameters. Those of a modulus take
    "proportional" weights by default, whose errors are a fraction of each model's own values and whose variances AIC and
    BIC include, and those of an indentation "absolute" ones; "relative" weights or a sigma may be given for both.

    Args:
        data: the curve.
        models: material classes or their names.
        fixed: as in ``fit_creep``; applied to every model that has the parameter.
        bounds: as ``fixed``.
        options: the other keywords of ``fit_creep``, ``fit_relaxation``, ``fit_oscillation`` or ``fit_indentation``.

    Returns:
        The fits, lowest BIC first.

    Raises:
        ValueError: as these fits, a parameter that no model has, or estimated weights with a modulus or an
            indentation.

    Example:
        >>> t = np.linspace(0.0, 10.0, 21)
        >>> data = fitting.CreepData(t=t, J=1e-6 * (1.0 + t))
        >>> table = fitting.compare(data, ["Maxwell", "Elastic"], weights="relative")
        >>> [fit.model.__name__ for fit in table.fits]
        ['Maxwell', 'Elastic']
    """
    own = {structure.model: structure.where for structure in map(creep_structure, models)}
    known = set().union(*own.values())
    for name in [*(fixed or {}), *(bounds or {})]:
        if name not in known:
            raise ValueError(f"fixed, bounds: expected parameters among {sorted(known)}, got {name!r}")
    mine = lambda given, where: {name: v for name, v in (given or {}).items() if name in where}
    each = {
        model: {"fixed": mine(fixed, where), "bounds": mine(bounds, where)} for model, where in own.items()
    }
    if type(data) in OTHERS:
        return Comparison(_of_others(data, each, options))
    richest = max(own, key=lambda model: len(own[model]))
    first = fit_creep(data, richest, **each[richest], **options)
    data, given = _points(data, first.kept), first.point_weights[first.kept]
    others = [
        _fit(data, creep_structure(model), first.options | each[model], given)
        for model in own
        if model != richest
    ]
    return Comparison(tuple(sorted([first, *others], key=lambda fit: fit.bic)))


def _of_others(data: Any, each: dict[type, dict], options: dict) -> tuple:
    """Return the fits of a modulus or an indentation by several models with weights of one kind, lowest BIC first."""
    fit, usual = OTHERS[type(data)]
    given = dict(options)
    if given.get("weights") is None and given.get("sigma") is None:
        given["weights"] = usual
    if given.get("weights") == "estimated":
        raise ValueError(
            'weights: expected "proportional", "relative", "absolute" or a sigma to compare models of a modulus or an'
            " indentation, got 'estimated'"
        )
    found = [fit(data, model, **own, **given) for model, own in each.items()]
    return tuple(sorted(found, key=lambda one: one.bic))


def _points(data: CreepData, kept: np.ndarray) -> CreepData:
    """Return the data at the selected points, (n,) bool."""
    some = {name: getattr(data, name) for name in ("t", "J", "strain", "sigma")}
    return dataclasses.replace(data, **{k: v if v is None else v[kept] for k, v in some.items()})
