"""Result of a fit: a material or law, how well the data determine it, and the last stage of every fit that makes it.

A fit module makes a ``FitProblem`` (data, what is sought, sample), finds its optimum (``least_squares``, or a search of its
own that returns a ``Solved``), and hands both to ``conclude``, which adds intervals, verdict and notes:

    problem = FitProblem(data, sought, space, sample, duration, level)
    solved = least_squares(problem, objective_of_weights, starts)
    return conclude(problem, solved).fit(MyFit)
"""

import dataclasses
import functools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from fitting.data.curves import evaluation_times
from fitting.data.indentation import probe_of
from fitting.inference import noise, verdict
from fitting.inference.noise import two_sided
from fitting.inference.sample import (
    Assessment,
    Curve,
    Evidence,
    Minimum,
    Solved,
    check_count,
    reweighted_until_stable,
)
from fitting.models.parameters import Landscape, Parameters
from fitting.models.structure import Sought, Structure
from fitting.search import nonlinear
from fitting.search.nonlinear import Best, LogCovariance, Objective, covariance, inseparable, log_covariance
from fitting.views import sheet, text
from jaxcontact.bodies.materials import Spectrum


class Estimate(NamedTuple):
    """Result of a search in SI units, in the order of the structure's list of compliances.

    best (m,); opened (m,): the same with 0 or inf at an open end; spans (m, 2): interval ends; covariance (m, m), zero
    for what was held, with the systematic errors that the intervals include; log: covariance of the log parameters by
    noise alone; moves(name) (m,): derivative of the compliances with respect to a quantity that was held; landscape: None
    where the residuals require the contact solver.
    """

    best: np.ndarray
    opened: np.ndarray
    spans: np.ndarray
    covariance: np.ndarray
    log: LogCovariance
    moves: Callable[[str], np.ndarray]
    landscape: Landscape | None


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Fit(Evidence):
    """A fitted material and how well the data determine it: its parameters, and the ``Evidence`` of its residuals.

    material: the best fit (an infinite parameter where its compliance is zero). values, intervals, identified:
    {parameter: value | (low, high), inf on an open side | bool}, in Pa and Pa s, or 1/Pa and 1/(Pa s) of a series;
    fixed parameters have (value, value). sd_log {parameter: sd of its logarithm}, inf at an open end. tau [s]: the
    retardation time, nan where there is none, (k,) of a series. condition: condition number of J^T J in log parameters;
    weakest {parameter: component} of the least determined direction; weakest_sd: its standard deviation.

    structure: of the material, and model: its class; data: as they were given; weights: their label; level: confidence
    level of the intervals; duration: time [s] that the data cover; notes: on the data and on the fit. curve: (name,
    unit, times, values) of the fitted quantity; estimate: the result in compliances, for further use of the fit.
    """

    material: Any
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    identified: dict[str, bool]
    sd_log: dict[str, float]
    fixed: tuple[str, ...]
    tau: Any
    condition: float
    weakest: dict[str, float]
    weakest_sd: float
    structure: Structure
    data: Any
    weights: str
    level: float
    duration: float
    notes: tuple[str, ...]
    curve: Curve
    estimate: Estimate = dataclasses.field(repr=False)

    @property
    def model(self) -> type:
        """The class of the material."""
        return self.structure.model

    @property
    def abscissa(self) -> tuple[str, str]:
        """The symbol and the unit of the abscissa of the data."""
        return "t", "s"

    @property
    def since(self) -> np.ndarray:
        """Times of the data, counted from the first one [s]."""
        return self.curve[2] - self.curve[2][0]

    @property
    def t_over_tau(self) -> float:
        """Ratio of the duration to the longest retardation time, nan where there is none, inf if it is 0."""
        longest = float(np.max(self.tau))
        return self.duration / longest if longest != 0.0 else math.inf

    @property
    def verdict(self) -> str:
        """The verdict on the goodness of fit, "accepted" or "rejected"; ``refused`` has the reasons for a rejection."""
        return "rejected" if self.refused else "accepted"

    def compliances(self) -> Spectrum:
        """Return the compliances of the material as found by the search, finite where a parameter is infinite."""
        return self.structure.compliances(jnp.asarray(self.estimate.best))

    def covariance(self) -> np.ndarray:
        """Return the covariance of the list of compliances (m, m) [SI], zero for those that were held."""
        return self.estimate.covariance

    def moves(self, name: str) -> np.ndarray:
        """Return the derivative of the compliances (m,) [SI] with respect to a quantity that was held in the fit.

        Raises ValueError if the fit has no such quantity."""
        return self.estimate.moves(name)

    def predict(self, t: Any) -> np.ndarray:
        """Return the shear creep compliance J(t) [1/Pa] at t [s] of any shape; exact for infinite parameters too.

        Raises ValueError for times < 0."""
        return np.asarray(self.compliances().creep(jnp.asarray(evaluation_times(t))))

    def band(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the limits (low, high) of J(t) [1/Pa] at the fit's level, t (m,) [s], linearised in log J.

        Raises ValueError for times < 0."""
        return linear_band(self.structure, self.estimate, self.level, t)

    def __repr__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        """Return the result as text for the terminal."""
        lines = [
            "; ".join([f"{self.model.__name__} fit of {self._points()}", *self._choices()]),
            *(text.parameter(self, name) for name in self.values),
            *self._nuisance_lines(),
        ]
        lines += [
            *text.separation(self),
            *self._combination_lines(),
            *text.quality(self),
            *text.verdict(self),
        ]
        return "\n".join([*lines, *self._conditions(), *(f"note: {note}" for note in self.notes)])

    def _points(self) -> str:
        """Return the number and range of the fitted points, for the first line of the summary."""
        t, (over, unit) = self.curve[2], self.abscissa
        return f"{t.size} points, {over} = {t[0]:.4g} to {t[-1]:.4g} {unit}"

    def _choices(self) -> list[str]:
        """Return the user's choices, for the first line of the summary."""
        return [f"weights: {self.weights}"]

    def _nuisance_lines(self) -> list[str]:
        return []

    def _combination_lines(self) -> list[str]:
        return []

    def _conditions(self) -> list[str]:
        """Return the conditions under which the result holds."""
        return []

    def plot(self, path: Any = None) -> Any:
        """Return a figure of data, fit, band, residuals and verdict; save it where a path is given."""
        return sheet.draw_material(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers with the unit in every key, ready for JSON; an infinite number is None."""
        keys = {name: self.structure.key(name) for name in self.values}
        return {
            "model": self.model.__name__, "weights": self.weights, "level": self.level,
            "points": self.fitted.size,
            "parameters": {keys[n]: plain(v) for n, v in self.values.items()},
            "intervals": {keys[n]: [plain(v) for v in pair] for n, pair in self.intervals.items()},
            "identified": dict(self.identified), "fixed": list(self.fixed),
            "tau_s": plain(self.tau), "duration_s": self.duration,
            "duration_over_tau": plain(self.t_over_tau),
            "condition_log_parameters": plain(self.condition), "weakest_direction": dict(self.weakest),
            "r2": plain(self.r2), "aic": plain(self.aic), "bic": plain(self.bic), "noise": self.noise,
            "verdict": self.verdict, "verdict_in_words": text.in_words(self), "reasons": list(self.refused),
            "chi2_per_degree_of_freedom": plain(self.chi2),
            "lag1_residual_correlation": self.lag1, "misfit": self.misfit, "interval_widening": self.widening,
            "notes": list(self.notes),
        }  # fmt: skip

    def to_json(self) -> str:
        """Return ``to_dict`` as JSON text."""
        return json.dumps(self.to_dict(), indent=2)


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ElasticFit(Fit):
    """The fit of an elastic modulus to a curve over depth; ``Fit`` has what it shares with other fits.

    Attributes:
        youngs_modulus: (value, low, high) of E = 2 (1 + nu) G [Pa].
        indenter, nu, thickness [m], substrate: given quantities on which the modulus is conditional; thickness is None for
            a half-space, substrate for a rigid base; unbonded: whether the layer slides on it.
    """

    indenter: Any
    nu: float
    thickness: float | None
    substrate: Any
    unbonded: bool
    youngs_modulus: tuple[float, float, float]

    @property
    def abscissa(self) -> tuple[str, str]:
        """The symbol and the unit of the abscissa."""
        return "depth", "m"

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with Young's modulus and the given quantities."""
        E = dict(zip(("value", "low", "high"), map(plain, self.youngs_modulus), strict=True))
        return super().to_dict() | {
            "youngs_modulus_Pa": E, "poisson_ratio": self.nu, "thickness_m": plain(self.thickness),
            **({"unbonded": True} if self.unbonded else {}), **probe_of(self.indenter).key,
        }  # fmt: skip

    def _choices(self) -> list[str]:
        return [*super()._choices(), probe_of(self.indenter).words]

    def _combination_lines(self) -> list[str]:
        E, low, high = self.youngs_modulus
        return [f"  E     = {E:11.5g} Pa    {100 * self.level:g} % interval {low:.5g} to {high:.5g}"]


class Comparison(NamedTuple):
    """Fits of several models to one data set; its text is a table.

    Attributes:
        fits: the fits, lowest BIC first.
    """

    fits: tuple[Any, ...]

    def __str__(self) -> str:
        head = f"{'model':22s}{'parameters':>11s}{'R2':>12s}{'AIC':>12s}{'BIC':>12s}{'lag-1':>8s}  misfit  verdict"
        r2 = lambda f: "-" if math.isnan(f.r2) else f"{f.r2:.6f}"  # not defined for constant data
        rows = [
            f"{f.model.__name__:22s}{f.p:11d}{r2(f):>12s}{f.aic:12.1f}{f.bic:12.1f}{f.lag1:8.2f}"
            f"  {'yes' if f.misfit else 'no':6s}  {f.verdict}"
            for f in self.fits
        ]
        return "\n".join([head, *rows])

    def __repr__(self) -> str:
        return str(self)

    def plot(self, path: Any = None) -> Any:
        """Return a figure of the data with all models, and the residuals of each; save it where a path is given."""
        return sheet.draw_models(self.fits, path)


def plain(value: Any) -> Any:
    """Return a number for JSON, None where it is infinite or missing; of an array, a list of them."""
    if np.ndim(value):
        return [plain(v) for v in value]
    return None if value is None or not math.isfinite(value) else float(value)


def linear_band(structure: Structure, found: Estimate, level: float, t: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the limits (low, high) of J(t) [1/Pa] at a level, t (m,) [s], linearised in log J."""
    times = jnp.atleast_1d(jnp.asarray(evaluation_times(t)))
    log_creep = lambda values: jnp.log(structure.compliances(values).creep(times))
    slope = np.nan_to_num(np.asarray(jax.jacfwd(log_creep)(jnp.asarray(found.best))))
    spread = np.sqrt(np.einsum("ni,ij,nj->n", slope, found.covariance, slope))
    z = noise.two_sided(level)
    best = np.asarray(structure.compliances(jnp.asarray(found.best)).creep(times))
    with np.errstate(over="ignore"):
        return best * np.exp(-z * spread), best * np.exp(z * spread)


Kind = TypeVar("Kind", bound=Fit)


@dataclasses.dataclass(frozen=True, eq=False)
class FitProblem:
    """The data, the sought structure and the search space of one fit.

    data: as the user gave them; sought: the material or law with its bounds; space: the coordinates of the search;
    sample: the fitted curve, a ``Sample``, or several curves that are judged together (``together.Tests``);
    duration: time [s] that the data cover; level: confidence level of the intervals. ValueError unless intervals at
    this level can be found from the number of points.
    """

    data: Any
    sought: Sought
    space: Parameters
    sample: Any
    duration: float
    level: float

    def __post_init__(self) -> None:
        check_count(self.level, self.sample.fewest_points, self.p)

    @property
    def p(self) -> int:
        """Number of free coordinates."""
        return self.space.free.size


class Conclusion(NamedTuple):
    """A finished fit without what is special to its kind, and the interval ends of its coordinates.

    common: with all fields that every ``Fit`` has, as ``conclude`` sets them; ends (m, 2): interval ends of the coordinates,
    followed by further rows that the search returned; assessment: the evidence, whitened Jacobian and levels from the
    residuals.
    """

    common: Fit
    ends: np.ndarray
    assessment: Assessment

    def fit(self, kind: type[Kind], **own: Any) -> Kind:
        """Return the fit as an instance of ``kind``, with its own fields, which override the common ones."""
        every = {field.name: getattr(self.common, field.name) for field in dataclasses.fields(Fit)}
        return kind(**every | own)


def solution(
    objective: Objective, best: Best, weights: np.ndarray, kept: np.ndarray | None = None
) -> Solved[Minimum]:
    """Return the optimum of an objective with weights (n,) in the form that ``conclude`` takes; kept (n,) bool: all by
    default."""
    inside = ((best.theta > objective.lower) & (best.theta < objective.upper))[objective.free]
    on = np.ones(best.residual.size, dtype=bool) if kept is None else kept
    find_ends = lambda assessment: nonlinear.profile(objective, best, assessment.levels())
    minimum = Minimum(best, objective)
    return Solved(best.theta, best.residual, best.jacobian, inside, on, weights, find_ends, minimum)


def least_squares(
    problem: FitProblem, objective: Callable[[np.ndarray], Objective], starts: Sequence[np.ndarray],
    few: Objective | None = None,
) -> Solved[Minimum]:  # fmt: skip
    """Return the lowest minimum from several starts, with weights that are consistent with its residuals.

    objective: function of the weights (n,) [1/unit of the sample]; few: the objective of some of very many points, on which
    the searches from all starts are made, so that all points are used in the last one alone.
    """
    weights = problem.sample.weights
    first = nonlinear.minimise_from(objective(weights) if few is None else few, starts)
    if few is not None:
        first = nonlinear.minimise(objective(weights), first.theta).after(first)

    def again(weights: np.ndarray) -> Solved[Minimum]:
        own = objective(weights)
        return solution(own, nonlinear.minimise(own, first.theta).after(first), weights)

    found = solution(objective(weights), first, weights)
    return reweighted_until_stable(problem.sample, found, again, problem.p)


def conclude(problem: FitProblem, solved: Solved) -> Conclusion:
    """Return the fit with all common fields, from the optimum of its search.

    The noise of the residuals is estimated (``noise.py``), the coordinates are profiled to the levels that follow, the
    goodness of fit is judged (``verdict.py``), and everything is converted to SI units for the material.
    """
    assert solved.find_ends is not None
    data, sample, space, level = problem.data, problem.sample, problem.space, problem.level
    structure, table = problem.sought.structure, problem.sought.table
    theta, own, free = solved.theta, space.material, space.free
    assessment = sample.assess(solved, problem.p, level)
    slopes, quality = assessment.slopes, assessment.evidence
    own_trends = getattr(sample, "own_trends", False)

    # The ends of the intervals, and what the course of the searches says about them and about the optimum.
    notes, against = list(solved.notes), list(solved.against)
    ends, unfinished = solved.find_ends(assessment)
    if isinstance(solved.search_result, Minimum):
        best = solved.search_result.best
        if not best.converged:
            against.append(
                f"the search did not converge within {nonlinear.ITERATIONS} steps, so that the parameters need not be those"
                " of the least squares: give bounds, or hold what is known by fixed="
            )
        if best.starts > 2 and best.agreed == 1:
            notes.append(
                f"only 1 of {best.starts} starts reached the best minimum, so that a lower one may have been missed: narrow"
                " the bounds, or hold what is known by fixed="
            )
    if unfinished:
        notes.append(
            f"{unfinished} searches along the intervals did not converge within {nonlinear.ITERATIONS} steps: the"
            " intervals may be too short"
        )
    box = [side[:, None] for side in space.bounds]
    if solved.shift is not None:  # half an interval w becomes (w^2 + (z shift)^2)^(1/2)
        half = np.hypot(ends - theta[:, None], two_sided(level) * solved.shift[:, None])
        ends = np.clip(theta[:, None] + half * np.array([-1.0, 1.0]), *box)
    if solved.systematic is not None:  # a systematic deviation, which the noise does not include
        ends = np.clip(ends + np.outer(solved.systematic, (-1.0, 1.0)), *box)
    # the meaning of a trend that the fit judges comes before what is common to all fits
    why = [*against, *quality.refused] if own_trends else [*quality.refused, *against]
    quality = dataclasses.replace(quality, refused=tuple(dict.fromkeys(why)))

    # Covariance of the values in SI. Standard deviations are increased by systematic deviations at equal
    # correlations.
    J, varied = np.zeros((len(slopes), theta.size)), np.isin(np.arange(theta.size), free)
    J[:, free] = slopes
    unit, values = space.unit[own], space.values(theta)
    slope = np.where(space.logarithmic[own], values, 1.0) * unit  # of the values in SI by the coordinates
    spread = covariance(J, varied)[np.ix_(own, own)]
    if solved.shift is not None:
        spread = spread + np.outer(solved.shift[own], solved.shift[own])
    systematic = np.abs(0.0 if solved.systematic is None else solved.systematic) / two_sided(level)
    systematic = np.broadcast_to(systematic, len(ends))[: theta.size][own]
    sd = np.sqrt(np.maximum(np.diag(spread), 0.0))
    growth = 1.0 + np.divide(systematic, sd, out=np.zeros(sd.size), where=sd > 0.0)
    spread = spread * np.outer(growth, growth) + np.diag(np.where(sd > 0.0, 0.0, systematic**2))

    # Uncertainty of the logarithms by noise alone: the Jacobian with respect to them of what lies inside the bounds,
    # without the part that the nuisance parameters can take up.
    inside = np.zeros(theta.size, dtype=bool)
    inside[free] = solved.inside
    by_log, others = (
        (J * inside)[:, own] * np.where(space.logarithmic, 1.0, theta)[own],
        (J * inside)[:, ~own],
    )
    Q = np.linalg.qr(others[:, np.any(others != 0.0, axis=0)])[0]
    log = log_covariance(by_log - Q @ (Q.T @ by_log), inside[own])

    # The parameters of the material or law, from its list of compliances or values.
    found = Estimate(
        values * unit, space.opened(theta) * unit, space.spans(theta, ends[: theta.size]),
        spread * np.outer(slope, slope), log, functools.partial(_moved, solved.moves, own, slope), solved.landscape,
    )  # fmt: skip
    parameters = {name: float(value) for name, value in structure.parameters(found.opened).items()}
    intervals = structure.intervals(found.spans, table)
    quality = dataclasses.replace(
        quality, refused=(*quality.refused, *verdict.too_stiff(structure, intervals))
    )
    identified = verdict.identified(intervals, table, level, quality.refused)
    fixed = tuple(name for name, (low, high) in table.items() if low == high)
    names = {place: name for name, place in structure.where.items()}
    sd_log = dict.fromkeys(parameters, math.inf)
    sd_log |= {names[place]: float(v) for place, v in zip(log.places, log.sd, strict=True)}
    said = *getattr(data, "notes", ()), *sample.noise_notes(assessment), *quality.doubts, *notes
    together = inseparable(slopes, [space.names[i] for i in free], identified)
    common = Fit(
        **vars(quality),  # every field of ``Evidence``
        material=structure.material(parameters, problem.sought.volume), values=parameters,
        intervals=intervals, identified=identified, fixed=fixed,
        sd_log=sd_log | dict.fromkeys(fixed, 0.0), tau=structure.times(found.opened),
        condition=log.condition, weakest_sd=log.weakest_sd,
        weakest={names[place]: float(v) for place, v in zip(log.places, log.weakest, strict=True)},
        structure=structure, data=data, weights=sample.label, level=level,
        duration=problem.duration, curve=sample.curve(solved.kept), estimate=found,
        notes=tuple(dict.fromkeys([*said, *together])),
    )  # fmt: skip
    return Conclusion(common, ends, assessment._replace(evidence=quality))


def _moved(
    moves: Callable[[str], np.ndarray] | None, own: np.ndarray, slope: np.ndarray, name: str
) -> np.ndarray:
    """Return the derivative of the compliances [SI] with respect to a held quantity, zero where there is none."""
    return moves(name)[own] * slope if moves else np.zeros(slope.size)


def no_moves(fit: str, name: str) -> np.ndarray:
    """Raise ValueError: the change of the parameters of a fit, named in words, with a held quantity is not computed."""
    raise ValueError(f"spread: {fit} is conditional on its {name}; fit at other values of it")


def widened(
    fit: Fit, problem: FitProblem, spread: Mapping[str, float], moves: Sequence[np.ndarray], note: str
) -> Fit:
    """Return a fit with further standard deviations of the logarithms of its parameters, which are independent of the
    noise: half an interval w of a logarithm becomes (w^2 + (z sd)^2)^(1/2), z the quantile of the level.

    moves: of each independent cause the change of the values of ``Estimate`` [SI] by one standard deviation, (m,), whose
    products are added to the covariance.
    """
    z, intervals = two_sided(problem.level), {}
    for name, value in fit.values.items():
        (low, high), far = fit.intervals[name], z * spread[name]
        if far == 0.0:
            intervals[name] = low, high
            continue
        down = math.exp(math.hypot(math.log(value / low), far)) if 0.0 < low <= value else math.inf
        closed = 0.0 < value <= high < math.inf
        up = math.exp(math.hypot(math.log(high / value), far)) if closed else math.inf
        intervals[name] = (value / down, value * up)
    identified = verdict.identified(intervals, problem.sought.table, problem.level, fit.refused)
    sd_log = {name: math.hypot(fit.sd_log[name], sd) for name, sd in spread.items()}
    covariance = fit.estimate.covariance + sum(np.outer(one, one) for one in moves)
    return dataclasses.replace(
        fit, intervals=intervals, identified=identified, sd_log=sd_log, notes=(*fit.notes, note),
        estimate=fit.estimate._replace(covariance=covariance),
    )  # fmt: skip
