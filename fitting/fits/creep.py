"""Fit of a material to creep data; the intervals are profile likelihoods (``evidence.py``).

The fit is deterministic and needs no start: ``creep_search.py``.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from jax.tree_util import Partial

import jaxcontact as jc
from fitting.data.curves import CreepData
from fitting.data.weights import choose_weights
from fitting.fits import fractional
from fitting.fits.fractional import Law, creep_structure
from fitting.inference import evidence
from fitting.inference.estimating import off_bounds, settled
from fitting.inference.evidence import Judged, Sample, Solved
from fitting.inference.result import Estimate, Fit, Landscape, findings, linear_band, plain
from fitting.inference.unsupported import Supported, keep_all, leave_out
from fitting.models.structure import Structure, Volume, limits
from fitting.search import creep_search, nonlinear, padding, profiles
from fitting.search.creep_search import Optimum, Scaled
from fitting.search.uncertainty import covariance, linear_sd, log_covariance
from fitting.search.varpro import PLACES, TauSearch
from fitting.views import report


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CreepFit(Fit):
    """The fit of a creep curve; ``Fit`` has what it shares with other fits.

    Attributes:
        combinations: {name: (value, sd, low, high)} of J0 [1/Pa], slope0 = 1/eta1 + 1/eta2 [1/(Pa s)] and
            J(T) [1/Pa], which stay known where single parameters do not; none of a fractional law.
        kept: (n,) bool, the points that count, which ``fitted`` and ``residuals`` are of.
        point_weights: (n,) [1/unit of the data], what the residuals were multiplied by, of all points.
        options: those that ``fit_creep`` was given.
        profile: (2, m) limits of J [1/Pa] at times (m,) [s].
    """

    combinations: dict[str, tuple[float, float, float, float]]
    kept: np.ndarray
    point_weights: np.ndarray
    options: dict[str, Any]
    profile: Callable[[Any], np.ndarray] = dataclasses.field(repr=False)

    def band(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        """Limits (low, high) of J(t) [1/Pa] at the fit's level, t (m,) [s]: of the profile likelihood, or for a
        fractional law linearised in log J."""
        low, high = self.profile(np.atleast_1d(np.asarray(t, dtype=float)))
        return low, high

    def compare(self, *others: type | str) -> "Comparison":
        """This fit's data, weights, fixed values and bounds with other models too; see ``fitting.compare``."""
        return compare(self.data, [self.model, *others], **self.options)

    def to_dict(self) -> dict[str, Any]:
        """As ``Fit.to_dict``, with the combinations."""
        combinations = {name: plain(row) for name, row in self.combinations.items()}
        return super().to_dict() | {"combinations": combinations, "convention": self.data.convention}

    def _choices(self) -> list[str]:
        return [*super()._choices(), f"compliance: {self.data.convention}"]

    def _conditions(self) -> list[str]:
        if not self.refused or not self.misfit:
            return []
        return [
            "  next: fit_prony(data) takes as many retardation times as the data ask for (jaxcontact fit prony)"
        ]

    def _combination_lines(self) -> list[str]:
        units = {"slope0": "1/(Pa s)"}
        return [
            f"  {name:6s} = {value:11.5g} {units.get(name, '1/Pa')}, sd {sd:.2g}, {report.span(low, high)}"
            for name, (value, sd, low, high) in self.combinations.items()
        ]


def measured_curve(data: CreepData) -> tuple[str, str, np.ndarray, np.ndarray]:
    """(name, unit, times, values) of a creep curve."""
    name, unit = ("J", "1/Pa") if data.J is not None else ("strain", "-")
    return name, unit, data.t, data.response


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
    """Fit a material to a creep curve. Deterministic; no start is needed.

    On real data the choice of weights moves the moduli by factors; the summary says which were taken.

    Args:
        data: the curve, n points.
        model: a material class with at most one retardation time, or a fractional one, or its name; ``fit_prony``
            takes more. The material that comes back of a fractional law is its cut (``jc.Springpot.prony``) to the
            times of the data, and no point is left out of its fit.
        weights: "estimated" (the default without a sigma): errors a + b J, estimated from the data
            (``weights.py``) and then from the residuals (``noise.py``), and points that nothing beside them supports
            left out (``unsupported.py``);
            "relative" (errors proportional to the data); "absolute" (one error for all).
        sigma: the standard deviation, a number or (n,) [unit of the data], taken as known; that of the
            data where they have one. Of data that were resampled, ``scatter`` is the default.
        fixed: {parameter: value} [Pa, Pa s] of any subset.
        bounds: {parameter: (low, high)} [Pa, Pa s] of any subset, None for an open side.
        nu: Poisson's ratio to carry along; creep in shear does not see it.
        level: of the intervals.

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
    """As ``fit_creep``; given (n,): estimated weights to take as they are, without leaving a point out."""
    weight, label = fit_weights(data, options["weights"], options["sigma"])
    name, unit, t, measured = measured_curve(data)
    sample = Sample.of(t, measured, weight if given is None else given, label)
    if isinstance(structure, Law):
        return _fit_law(data, sample, structure, options, given is not None)
    table, level = limits(structure, options["fixed"], options["bounds"]), options["level"]
    p = sum(low < high for low, high in table.values())
    evidence.check(level, data.t.size, p)
    scaled = creep_search.scale(data, sample.weights, structure, table)
    choose = leave_out if label == "estimated" and given is None else keep_all
    solve = lambda weights: _solve(_with_weights(scaled, weights, data), weights, choose)
    solved = solve(sample.weights)
    if given is None:
        solved = evidence.settled(sample, solved, solve, p)
    on, (problem, best) = solved.kept, solved.whole
    sample, scaled = sample._replace(weights=solved.weights).some(on), scaled._replace(problem=problem)
    judged = evidence.judge(sample, solved.residual[on], solved.jacobian[on], solved.inside, p, level)
    profile, free = _profile(problem, best, judged, scaled.time), _free(problem)
    ends = profile(data.t[-1:])
    found = _estimate(structure, scaled, best, ends, judged.slopes)
    names = {PLACES[structure.size][place]: name for name, place in structure.where.items()}
    fields = findings(
        structure,
        table,
        level,
        Volume.of(options["nu"], None),
        judged,
        found,
        [names.get(int(i), "") for i in free],
    )
    said = _said(data, solved.kept, label, solved.weights, judged.evidence.noise)
    return CreepFit(
        **fields | {"notes": (*data.notes, *said, *fields["notes"])}, data=data, weights=label, duration=scaled.time,
        curve=(name, unit, sample.t, sample.measured), options=options, kept=on, point_weights=solved.weights,
        combinations=_combinations(scaled, best, ends, judged.slopes),
        profile=lambda t: profile(t)[5:].T * scaled.compliance,
    )  # fmt: skip


def _with_weights(scaled: Scaled, weights: np.ndarray, data: CreepData) -> TauSearch:
    """The problem with weights (n,) [1/unit of the response]."""
    padded = padding.without_weight(weights * float(np.max(np.abs(data.response))))
    return scaled.problem._replace(weights=padded)


def _solve(problem: TauSearch, weights: np.ndarray, choose: Callable[..., Supported]) -> Solved:
    """The optimum of the points that ``choose`` leaves, with residuals and slopes of all."""
    (kept, fewer, best), n, free = choose(problem, weights.size), weights.size, _free(problem)
    residual, J = (
        np.asarray(creep_search.residuals(problem, best)),
        np.asarray(creep_search.jacobian(problem, best)),
    )
    inside = np.asarray(creep_search.strictly_inside(best.parts, *problem.limits))
    return Solved(residual[:n], J[:n, free], inside[free], kept, weights, (fewer, best))


def _free(problem: TauSearch) -> np.ndarray:
    """Places of the compliances that are fitted, among (j0, j2, f, j2/tau)."""
    lower, upper = (np.asarray(side) for side in problem.limits)
    return np.flatnonzero(lower < upper)


def _fit_law(data: CreepData, sample: Sample, law: Law, options: dict, given: bool) -> CreepFit:
    """As ``fit_creep``, of a fractional law."""
    table, level = fractional.orders(limits(law, options["fixed"], options["bounds"])), options["level"]
    p = sum(low < high for low, high in table.values())
    evidence.check(level, data.t.size, p)
    curve = fractional.Crept.of(data, sample.weights)
    law = dataclasses.replace(law, span=curve.span)
    of = lambda weights: fractional.Crept.of(data, weights).objective(law, table)
    best = nonlinear.minimise_from(of(sample.weights), curve.starts(law))
    if not given:
        sample, best, _ = settled(sample, of, best)
    objective = of(sample.weights)
    judged = evidence.judge(sample, best.residual, best.jacobian, off_bounds(objective, best), p, level)
    ends = profiles.profile(objective, best, judged.levels())
    found = fractional.estimate(curve, law, table, best, ends, judged.slopes)
    kept = np.ones(sample.t.size, dtype=bool)
    names = np.array(list(law.where))[objective.free]
    fields = findings(law, table, level, Volume.of(options["nu"], None), judged, found, names)
    said = _said(data, kept, sample.label, sample.weights, judged.evidence.noise)
    return CreepFit(
        **fields | {"notes": (*data.notes, *said, *law.notes, *fields["notes"])}, data=data, weights=sample.label,
        duration=curve.duration, curve=measured_curve(data), options=options, kept=kept, combinations={},
        point_weights=sample.weights, profile=lambda t: np.stack(linear_band(law, found, level, t)),
    )  # fmt: skip


def fit_weights(data: CreepData, weights: str | None, sigma: Any) -> tuple[np.ndarray, str]:
    """Weights (n,) and their label: those that were asked for, else by the errors that the data have, else estimated."""
    if weights is None and sigma is None:
        sigma = data.error
        weights = "estimated" if sigma is None and data.scatter is None else None
    return choose_weights(data.t, data.response, weights, sigma, data.scatter)


def _profile(problem: TauSearch, best: Optimum, judged: Judged, unit: float) -> Callable[[Any], np.ndarray]:
    """Extents (m, 2) at times (k,) [s] as ``creep_search.profile`` has them, compiled for a few k."""
    free = _free(problem)

    def at(t: np.ndarray) -> np.ndarray:
        times = padding.repeated(t / unit) if t.size > 1 else t / unit
        levels = judged.levels(_gradients(best, times)[free])
        same = np.ptp(levels) <= 1e-12 * levels[0]
        some = creep_search.profile(problem, best, levels[0] if same else levels, times)
        return np.asarray(some)[: 5 + t.size]

    return at


def _gradients(best: Optimum, times: np.ndarray) -> np.ndarray:
    """Return the gradients of j0, j2, f, j2/tau, slope0 and J(times) by (j0, j2, f, j2/tau), (4, m), scaled."""
    (_, j2, _, _), tau = np.asarray(best.parts), float(best.tau)
    decay, one = np.exp(-times / tau), np.ones(times.size)
    # with tau = j2/ratio, d tau = tau (dj2/j2 - dratio/ratio)
    turn = -decay * times / tau if j2 > 0 else 0.0 * times
    creep = np.stack([one, 1.0 - decay + turn, times, -turn * tau])
    return np.column_stack([np.eye(4), [0.0, 0.0, 1.0, 1.0], creep])


def _said(data: CreepData, kept: np.ndarray, label: str, weight: np.ndarray, noise: float) -> list[str]:
    """Notes on an estimated error and on points that were left out."""
    if label != "estimated":
        return []
    floor = math.sqrt(max(float(np.min(weight**-2 - data.response**2)), 0.0))
    unit = "1/Pa" if data.J is not None else "of strain"
    notes = [
        f"standard deviation of a point, estimated: {100 * noise:.2g} % of it and {noise * floor:.2g} {unit}"
    ]
    times = ", ".join(f"{t:.4g}" for t in data.t[~kept][:5])
    left = (
        f"{np.sum(~kept)} of {kept.size} points left out, which nothing beside them supports: t = {times} s"
    )
    return notes if kept.all() else [*notes, left]


def _estimate(
    structure: Structure, scaled: Scaled, best: Optimum, ends: np.ndarray, slopes: np.ndarray
) -> Estimate:
    """The scaling undone, for the compliances that the material has; slopes (m, k) of those that are fitted."""
    own, unit = PLACES[structure.size], structure.units(scaled.compliance, scaled.time)
    parts, J = np.asarray(best.parts)[own], _whole(slopes, scaled.problem)[:, own]
    lower, upper = (np.asarray(side)[own] for side in scaled.problem.limits)
    inside = creep_search.strictly_inside(parts, lower, upper)
    return Estimate(
        parts * unit, parts * unit, ends[own] * unit[:, None],
        covariance(J, lower < upper) * np.outer(unit, unit),
        log_covariance(J * parts, inside), lambda name: np.zeros(parts.size),
        Landscape(
            Partial(creep_search.residuals_at, scaled.problem), parts, np.stack([lower, upper], -1), unit
        ),
    )  # fmt: skip


def _whole(slopes: np.ndarray, problem: TauSearch) -> np.ndarray:
    """Slopes (m, 4) from those of the compliances that are fitted (m, k)."""
    whole = np.zeros((len(slopes), 4))
    whole[:, _free(problem)] = slopes
    return whole


def _combinations(scaled: Scaled, best: Optimum, ends: np.ndarray, slopes: np.ndarray) -> dict:
    """J0 [1/Pa], slope0 [1/(Pa s)] and J(T) [1/Pa]: (value, sd, low, high)."""
    (j0, j2, f, ratio), tau = np.asarray(best.parts), float(best.tau)
    lower, upper = scaled.problem.limits
    gradients = _gradients(best, np.ones(1))[:, [0, 4, 5]].T
    sd = linear_sd(_whole(slopes, scaled.problem), gradients, np.asarray(lower < upper))
    values = [j0, ratio + f, j0 - j2 * math.expm1(-1.0 / tau) + f]
    units = scaled.compliance * np.array([1.0, 1.0 / scaled.time, 1.0])
    rows = zip(("J0", "slope0", "J(T)"), values, sd, ends[[0, 4, 5]], units, strict=True)
    return {name: tuple(float(u) for u in (v * k, s * k, *(e * k))) for name, v, s, e, k in rows}


def _r2(fit: Fit) -> str:
    """For a table, "-" where it is not defined."""
    return "-" if math.isnan(fit.r2) else f"{fit.r2:.6f}"


class Comparison(NamedTuple):
    """Fits of one data set; as text a table.

    Attributes:
        fits: lowest BIC first.
    """

    fits: tuple[CreepFit, ...]

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
    data: CreepData,
    models: Sequence[type | str] = ("Maxwell", "StandardLinearSolid", "Burgers"),
    fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None,
    **options: Any,
) -> Comparison:
    """Fit several models to one creep curve; print the result for a table.

    All have the same points and the same estimated weights: those of the model with the most parameters.

    Args:
        data: the curve.
        models: material classes or their names.
        fixed: as in ``fit_creep``; goes to every model that has the parameter.
        bounds: likewise.
        options: the other keywords of ``fit_creep``.

    Returns:
        The fits, lowest BIC first.

    Raises:
        ValueError: as ``fit_creep``, or a parameter that no model has.

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
    richest = max(own, key=lambda model: len(own[model]))
    first = fit_creep(data, richest, **each[richest], **options)
    data, given = _points(data, first.kept), first.point_weights[first.kept]
    others = [
        _fit(data, creep_structure(model), first.options | each[model], given)
        for model in own
        if model != richest
    ]
    return Comparison(tuple(sorted([first, *others], key=lambda fit: fit.bic)))


def _points(data: CreepData, kept: np.ndarray) -> CreepData:
    """Some of the points, (n,) bool."""
    some = {name: getattr(data, name) for name in ("t", "J", "strain", "sigma")}
    return dataclasses.replace(data, **{k: v if v is None else v[kept] for k, v in some.items()})
