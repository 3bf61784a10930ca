"""The data of a fit with their weights, and the evidence from its residuals: noise, intervals and goodness of fit.

An interval holds the values for which the smallest residual sum of squares (RSS) exceeds the minimum by no more
than a given level. For white noise of known relative weights that level is F s^2, F the quantile of F(1, n - p) and
s^2 = RSS/(n - p), or chi^2 where sigma is given (D. M. Bates, D. G. Watts, Nonlinear Regression Analysis, 1988,
sec. 6.1). Where the noise may be correlated, or its dependence on the values was estimated, each coordinate has a
level of its own (``noise.py``). ``verdict.py`` rejects a model whose residuals show that it does not describe the
data.

A standard deviation that the user states is compared with the residuals: their RSS has a chi-square distribution
with n - p degrees of freedom where it is right. Where its value is improbable on either side, a note says so and
the intervals follow from the scatter of the residuals instead.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from scipy import special

from fitting.inference import noise
from fitting.inference.noise import BEYOND_CHANCE, Noise, basis, lag_one
from fitting.inference.verdict import STATED, TOO_FEW, contradicted, no_better, reasons, scattered
from fitting.models.parameters import Landscape
from fitting.search.nonlinear import Best, Objective

FLAT = 1e-9  # relative range of values below which they are constant to rounding
ROUNDING = 1e-13  # fraction of the data's sum of squares below which a rise of RSS is rounding
NEGLIGIBLE = 1e-8  # fraction of the data's sum of squares below which no fit is rejected
EXACT = 1e-20  # fraction of the data's sum of squares below which residuals are rounding
REWEIGHTINGS = 4  # reweighting iterations at most
SAME = 0.05  # relative change of estimated weights at convergence
CONSTANT = 1e-3  # relative change at convergence of weights in proportion to the fitted values
PROPORTIONAL = 1e-6  # largest relative deviation of weights from the reciprocals of measured values
BIASED = 0.5  # bias over standard error of a common factor above which a note is given
ALIKE = 2.0  # standard errors of a correlation of neighbours above which no change of the noise along the curve is tested
# minus twice the log likelihood that a change of the noise along the curve must exceed: chi-square with a degree of freedom
# for each coefficient of the change, at the probability of as high a likelihood where the noise does not change
BETTER = float(special.chdtri(noise.DEGREE + 1, 0.05))
FAINT = 1e-6  # ratio of the terms of an error model below which the smaller one is left out
# RSS per degree of freedom, with a stated sigma, below which data are taken as free of noise
NOISELESS = 1e-4
APART = 0.01  # probability by noise alone below which a difference between runs is significant
LEAST = 0.1, 1e-9  # smallest fitted value in a weight, over the measured one and over the largest one

Curve = tuple[str, str, np.ndarray, np.ndarray]  # name, unit, abscissa (n,), values (n,)


class Sample(NamedTuple):
    """The data of a fit as a curve, with their weights.

    name, unit: of the measured quantity; t (n,) [s], or another abscissa in its unit; measured (n,); weights (n,)
    [1/unit of measured], 0 for a point that is not fitted, and their label; blocks (n,): integers, equal for points of
    one series; final: whether the weights are used unchanged; paired: whether the second half of the values are the
    imaginary parts of the first; own_trends: whether the fit judges the trends of the residuals itself, by their size, in
    place of the common tests.
    """

    name: str
    unit: str
    t: np.ndarray
    measured: np.ndarray
    weights: np.ndarray
    label: str
    blocks: np.ndarray
    final: bool = False
    paired: bool = False
    own_trends: bool = False

    @classmethod
    def of(
        cls, curve: Curve, weights: np.ndarray, label: str, blocks: np.ndarray | None = None, paired: bool = False,
        own_trends: bool = False,
    ) -> "Sample":  # fmt: skip
        """Return the sample of a curve (name, unit, t, measured), one series unless blocks (n,) are given."""
        blocks = np.zeros(weights.size, dtype=int) if blocks is None else blocks
        return cls(*curve, weights, label, blocks, paired=paired, own_trends=own_trends)

    @property
    def abscissa(self) -> tuple[str, str]:
        """The symbol and the unit of t; paired values are those of an oscillation."""
        return ("omega", "rad/s") if self.paired else ("t", "s")

    @property
    def known(self) -> bool:
        """True if the weights are the reciprocals of known standard deviations."""
        return self.label == "sigma"

    @property
    def proportional(self) -> bool:
        """True if the errors are a fraction of the fitted values."""
        return self.label == "proportional"

    @property
    def adjustable(self) -> bool:
        """True if the weights follow from a fit: from its residuals, or as a fraction of its values."""
        return self.label in ("estimated", "proportional") and not self.final

    @property
    def fewest_points(self) -> int:
        """Number of fitted points."""
        return int(np.count_nonzero(self.weights))

    @property
    def size(self) -> float:
        """Weighted sum of squares of the data."""
        return float(np.sum((self.weights * self.measured) ** 2))

    def curve(self, kept: np.ndarray) -> Curve:
        """Return (name, unit, t, measured) of the points kept (n,) bool."""
        return self.name, self.unit, self.t[kept], self.measured[kept]

    def of_solution(self, solved: "Solved") -> tuple["Sample", "Solved"]:
        """Return the fitted points with the weights of a solution, and the solution restricted to them."""
        on = solved.kept
        return self._replace(weights=solved.weights).only(on), solved.only(on)

    def only(self, on: np.ndarray) -> "Sample":
        """Return the sample of the points ``on`` (n,) bool."""
        return self._replace(
            t=self.t[on], measured=self.measured[on], weights=self.weights[on], blocks=self.blocks[on]
        )

    def noise(self, solved: "Solved", p: int) -> Noise:
        """Return the noise model of the residuals of a fit of p parameters to all these points.

        Runs at equal abscissae that were joined are series of their own, each with a common factor as a random error.
        """
        # 1. The residuals, of joined runs without the runs' own factors, in which neighbours are those of a run.
        residual, slopes = solved.residual, self.smooth(solved.residual, solved.jacobian)
        fitted, real, runs = self.measured + residual / self.weights, self.real(residual, p), None
        labels = None if self.final else noise.runs_of(self.t, self.blocks)
        order, blocks = np.arange(residual.size), self.blocks
        if labels is not None and real:
            runs = noise.compared(residual, self.weights * fitted, labels, p, self.known)
            residual = residual - runs.offset
            blocks = self.blocks * (int(labels.max()) + 1) + labels
            order = np.argsort(blocks, kind="stable")

        # 2. The error models that are tried: constant weighted errors, or of estimated weights (a^2 + (b f)^2)^(1/2).
        shapes, ratios = np.ones((1, self.t.size)), np.zeros(1)
        if self.label == "estimated":
            # a/b from nearly zero to nearly infinite
            size = np.abs(fitted)
            high = noise.BEYOND * float(size.max())
            low = max(float(size.min()) / noise.BEYOND, noise.LEAST * high)
            ratios = np.geomspace(low, high, max(math.ceil(math.log(high / low) / noise.STEP), 2) + 1)
            shapes = np.hypot(ratios[:, None], fitted)
            shapes *= self.weights
        if runs is not None:
            shapes = shapes[:, order]
        tried = noise.ErrorModels(shapes, ratios)
        given = residual[order], slopes[order], solved.inside, blocks[order], tried, p

        # 3. Their probabilities with those of correlations; the size of the noise is as stated, or that of the residuals.
        dof = residual.size - p
        rss = float(residual @ residual)
        # a stated standard deviation that the scatter contradicts is replaced by that of the residuals
        side = 0 if self.final or not self.known else contradicted(rss, dof)
        found = noise.noise_model(*given, self.known and not side, real)
        correlated = BEYOND_CHANCE / math.sqrt(residual.size)
        if side < 0 and (found.lag1 > correlated or rss < NOISELESS * dof):
            # smaller than stated, but no noise of its own: nothing better is known than what was stated
            real = rss > 0.5 * dof
            found = noise.noise_model(*given, True, real)

        # 4. Changes along the curve, beyond those that follow from the fitted values: of the estimated error model, or of
        # one of its two terms alone where that describes the residuals better.
        if real and not self.final:
            size, best = float(np.max(np.abs(fitted))), None
            bases = (found.ratio, FAINT * size, size / FAINT) if self.label == "estimated" else (None,)
            for ratio in bases:
                shape = np.ones(residual.size) if ratio is None else np.hypot(ratio, fitted) * self.weights
                shape = shape / math.sqrt(float(np.mean(shape**2)))
                own = basis(slopes[:, solved.inside] / shape[:, None])
                changes = noise.variation(residual / shape, own, self.t, p)
                spreads = shape if changes is None else shape * changes.sizes
                # minus twice the log likelihood, up to a constant
                level = residual / spreads
                cost = 2.0 * float(np.sum(np.log(spreads))) + residual.size * math.log(float(level @ level))
                if best is None:  # the reference: the estimated error model without a change
                    reference = residual / shape
                    best = 2.0 * float(np.sum(np.log(shape))) + residual.size * math.log(
                        float(reference @ reference)
                    )
                    best -= BETTER * float(noise.excess(level))
                # where neighbours are alike, it is the model that changes along the curve, not the noise
                raw, even = (lag_one((residual / one)[order], blocks[order]) for one in (shape, spreads))
                if (
                    changes is None
                    or cost > best
                    or raw > 2.0 * ALIKE / math.sqrt(residual.size)
                    or even > ALIKE / math.sqrt(residual.size)
                ):
                    continue
                rows = shapes if ratio is None else np.hypot(ratio, fitted)[None] * self.weights
                tried = noise.ErrorModels(rows[:, order], np.array([0.0 if ratio is None else ratio]))
                one = residual[order], slopes[order], solved.inside, blocks[order], tried, p
                along = changes._replace(sizes=changes.sizes[order], candidates=changes.candidates[:, order])
                best, changed = cost, noise.noise_model(*one, False, real, along)
                found = changed._replace(sizes=changes.sizes, spreads=spreads)

        # 5. The factors of joined runs as a further random error; copies of a measurement have the same error.
        same = noise.copies(self.t, self.measured, fitted)
        if same > 1.0:
            return found._replace(copies=same, variance=same * found.variance, runs=runs)
        if runs is not None:
            found = noise.between_runs(found, runs, basis(slopes[order]), self.weights * fitted, order)
        return found

    def assess(self, solved: "Solved", p: int, level: float) -> "Assessment":
        """Return the evidence from the residuals of a fit of p parameters, for intervals at a level."""
        points, at_points = self.of_solution(solved)
        return assess(points, at_points, points.noise(at_points, p), p, level)

    def reweighed(self, found: "Solved", p: int) -> np.ndarray:
        """Return the weights (n,) that follow from a solution.

        Errors that are proportional to the values are a fraction of the fitted ones, because a reading that is too low by
        chance would get a larger weight than one that is too high, and the fit would be too low by the variance of the
        relative error. The limit is the maximum of the likelihood of a gamma distribution (P. McCullagh, J. A. Nelder,
        Generalized Linear Models, 1989, chapter 8).
        """
        fitted = self.measured + found.residual / found.weights
        if self.proportional:
            size, ratio, least = self.magnitude(self.measured), *LEAST
            lowest = np.maximum(ratio * size, least * float(np.max(size)))
            own = self.magnitude(fitted) if self.paired else np.sign(self.measured) * fitted
            return 1.0 / np.maximum(own, lowest)
        points, at_points = self.of_solution(found)
        if not points.real(at_points.residual, p):
            return found.weights
        model = points.noise(at_points, p)
        sizes = np.ones(fitted.size)
        if model.sizes is not None:  # points that are left out are given the size of their neighbours
            sizes = np.interp(np.arange(fitted.size), np.flatnonzero(found.kept), model.sizes)
        return 1.0 / (np.hypot(model.ratio, fitted) * sizes)

    def smooth(self, residual: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
        """Return the Jacobian (n, k) for relative weights taken from fitted values, because weights from noisy data add
        noise to it."""
        if self.label != "relative":
            return jacobian
        return jacobian * (self.measured / (self.measured + residual / self.weights))[:, None]

    def agree(self, one: np.ndarray, other: np.ndarray) -> bool:
        """Return whether weights (n,) agree closely enough to end the iteration."""
        return bool(np.max(np.abs(np.log(one / other))) <= (CONSTANT if self.proportional else SAME))

    def magnitude(self, values: np.ndarray) -> np.ndarray:
        """Return the absolute values (n,), of a pair those of the complex number."""
        return np.tile(np.hypot(*np.split(values, 2)), 2) if self.paired else np.abs(values)

    def spread(self) -> float:
        """Return the sum of the log variances of points over those of the measured values, 0 where they do not follow from
        the fitted ones."""
        if not self.proportional:
            return 0.0
        return -2.0 * float(np.sum(np.log(self.weights * self.magnitude(self.measured))))

    def bias(self, deviation: float) -> tuple[str, ...]:
        """Return a note where weights from the measured values make a fit too low by more than half a standard error.

        A reading that is too low by chance gets the larger weight. For relative errors s of n points a common factor of
        the curve is then too low by s^2, and its standard error is s/sqrt(n). deviation: of the weighted residuals.
        """
        on = self.weights > 0.0
        sizes = (self.weights * self.magnitude(self.measured))[on]
        own = float(sizes[0])
        if np.ptp(self.weights[on]) == 0.0 or own == 0.0 or np.ptp(sizes) > PROPORTIONAL * own:
            return ()
        s = deviation / own
        ratio = s * math.sqrt(sizes.size)
        if ratio < BIASED:
            return ()
        return (
            f"weights from the measured values make this fit about {100 * s**2:.2g} % too low ({ratio:.1f} standard errors);"
            ' "proportional" weights, which follow the fitted values, do not',
        )

    def real(self, residual: np.ndarray, p: int) -> bool:
        """Return whether weighted residuals exceed rounding; otherwise they carry no information."""
        return float(residual @ residual) > EXACT * self.size

    def noise_notes(self, assessment: "Assessment") -> tuple[str, ...]:
        """Return notes on the noise of the points: the two terms of an estimated error, or the bias of the weights."""
        deviation = assessment.evidence.noise
        if self.known or self.label == "relative":
            return self.bias(deviation)
        if self.label != "estimated":
            return ()
        # the weights are 1/((a/b)^2 + f^2)^(1/2) of the fitted values f, so that the weighted residuals have the standard
        # deviation b
        ratio = assessment.noise.ratio
        unit = "of strain" if self.unit == "-" else self.unit
        return (
            f"standard deviation of a point, estimated: {100 * deviation:.2g} % of its value and"
            f" {deviation * ratio:.2g} {unit}",
        )


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Evidence:
    """Measures of how well a model describes the data of its fit.

    fitted, residuals (n,): response and weighted residuals; rss: weighted residual sum of squares; noise: standard
    deviation of the weighted residuals (a fraction of the data for relative weights); lag1: correlation of neighbouring
    residuals; misfit: whether lag1 is significant; widening: factor on the intervals due to possible correlation of the
    noise; refused: the reasons why the fit is rejected, () if it is accepted. r2 (unweighted), nan for constant data;
    aic, bic; p: number of free parameters. chi2: RSS per degree of freedom where standard deviations were stated, near
    1 if they are right, nan otherwise; stated: whether the intervals follow from stated standard deviations; agrees: False
    where the residuals contradict these; doubts: what the noise of the data does otherwise than assumed, as notes.
    """

    fitted: np.ndarray
    residuals: np.ndarray
    rss: float
    noise: float
    lag1: float
    misfit: bool
    widening: float
    refused: tuple[str, ...]
    r2: float
    aic: float
    bic: float
    p: int
    chi2: float = math.nan
    stated: bool = False
    agrees: bool = True
    doubts: tuple[str, ...] = ()


class Assessment(NamedTuple):
    """Evidence of a fit with the quantities from which its intervals follow.

    evidence; slopes (m, k): the whitened Jacobian of the free coordinates, whose normal matrix is the inverse of their
    covariance; noise: the model of the noise; level: confidence level; rss: the smallest residual sum of squares, and
    least: the rise of it that is rounding.
    """

    evidence: Evidence
    slopes: np.ndarray
    noise: Noise
    level: float
    rss: float
    least: float

    def levels(self, gradients: np.ndarray | None = None) -> np.ndarray:
        """Return the RSS (q,) that bounds the intervals of functions of the free coordinates with gradients (k, q), by
        default of the coordinates themselves."""
        some = np.eye(self.noise.columns.shape[1]) if gradients is None else gradients
        return self.rss + np.maximum(self.noise.rises(some, self.level), self.least)


class Minimum(NamedTuple):
    """The result of a search by ``search/nonlinear.py``: its best minimum, and the objective that it minimised."""

    best: Best
    objective: Objective


Search = TypeVar("Search")


class Solved(NamedTuple, Generic[Search]):
    """A least-squares solution with further results of its search.

    theta (m,): coordinates; residual (n,): weighted; jacobian (n, k): of the free coordinates; inside (k,) bool: the
    free coordinates that are not at a bound; kept (n,) bool: the fitted points; weights (n,); find_ends(assessment):
    interval ends (m, 2) of the coordinates, with further rows that the search adds, and the number of searches along the
    intervals that did not converge; search_result: a ``Minimum``, or (``TauProblem``, ``Optimum``) of a variable
    projection, or that of a search of the fit's own.

    notes; moves(name) (m,): derivative of the coordinates with respect to a quantity that was held; landscape: the
    residuals as a function of the parameters, None where they are expensive; shift (m,): change of the
    coordinates by one standard deviation of a cause that is independent of the noise; systematic (m,): the systematic
    error of the coordinates, which the intervals must include; against: reasons for rejection beyond those of the residuals.
    """

    theta: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    inside: np.ndarray
    kept: np.ndarray
    weights: np.ndarray
    find_ends: Callable[[Assessment], tuple[np.ndarray, int]] | None = None
    search_result: Search = None  # type: ignore[assignment]  # not given where nothing reads it
    notes: Sequence[str] = ()
    moves: Callable[[str], np.ndarray] | None = None
    landscape: Landscape | None = None
    shift: np.ndarray | None = None
    systematic: np.ndarray | None = None
    against: tuple[str, ...] = ()

    def only(self, on: np.ndarray) -> "Solved":
        """Return the solution restricted to the points ``on`` (n,) bool."""
        return self._replace(
            residual=self.residual[on],
            jacobian=self.jacobian[on],
            kept=self.kept[on],
            weights=self.weights[on],
        )


def check_count(level: float, n: int, p: int) -> None:
    """Raise ValueError unless intervals at this level can be found from n points with p parameters."""
    if not 0.0 < level < 1.0:
        raise ValueError(f"level: expected between 0 and 1, got {level!r}")
    if n <= p:
        raise ValueError(f"data: expected more points than the {p} free parameters, got {n}")


def assess(
    sample: Sample, solved: Solved, found: Noise, p: int, level: float, Q: np.ndarray | None = None
) -> Assessment:
    """Return the evidence of a fit of p parameters to all points of a sample, with the estimated noise model.

    Q (n, k): where the sample is part of the data, the rows for its points of orthonormal columns that span the Jacobian
    of all data.
    """
    residuals, jacobian, inside = solved.residual, solved.jacobian, solved.inside
    own = basis(sample.smooth(residuals, jacobian[:, inside])) if Q is None else Q
    at_bound = Q is None and not np.all(inside)
    of_all = basis(sample.smooth(residuals, jacobian)) if at_bound else None
    measured, weights, n, known = sample.measured, sample.weights, sample.t.size, sample.known
    rss, dof = float(residuals @ residuals), n - p
    fitted, scale = measured + residuals / weights, math.sqrt(rss / dof)
    r2 = math.nan  # of data that are constant to rounding
    if np.ptp(measured) > FLAT * np.max(np.abs(measured)):
        total = float(np.sum((measured - measured.mean()) ** 2))
        r2 = 1.0 - float(np.sum((measured - fitted) ** 2)) / total
    # deviations that stay within the stated error and have a trend are no evidence against the model
    real = sample.real(residuals, p) and not (found.known and rss <= 0.5 * dof)
    misfit = bool(real and found.lag1 > BEYOND_CHANCE / math.sqrt(n))

    # Reasons for a rejection: the residuals, without the factors of runs and each run as a series of its own, ...
    why: tuple[str, ...] = ()
    if real and rss > NEGLIGIBLE * sample.size and not sample.own_trends:
        level_residuals, order, blocks = residuals, np.arange(n), sample.blocks
        if found.runs is not None:
            level_residuals = residuals - found.runs.offset
            blocks = sample.blocks * found.runs.factors.size + found.runs.labels
            order = np.argsort(blocks, kind="stable")
        sizes = None if found.spreads is None else found.spreads[order]
        of_all = None if of_all is None else of_all[order]
        why = reasons(
            level_residuals[order],
            own[order],
            found,
            sample.t[order],
            blocks[order],
            sample.abscissa,
            sizes,
            of_all,
        )
    # ... and too little of the data explained, in a fit of any kind: R2, or its counterpart with the weights of the
    # points, is not positive, unless the model is a constant, which the tests for a trend judge; or the standard
    # deviation of the points exceeds the fitted values, as quadratic means of weighted values.
    if real:
        few = []
        mean = float(np.sum(weights**2 * measured) / np.sum(weights**2))
        about = float(np.sum((weights * (measured - mean)) ** 2))
        off = weights * (fitted - measured)
        weighted_rss = float(off @ off)
        constant = p <= 1 and np.ptp(fitted) <= FLAT * np.max(np.abs(fitted))
        if not constant and (r2 <= 0.0 or weighted_rss >= about * (1.0 - FLAT)):
            worst = r2 if r2 <= 0.0 else 1.0 - weighted_rss / max(about, 1e-300)
            few.append(no_better(worst))
        scatter, signal = (
            math.sqrt(weighted_rss / max(dof, 1)),
            math.sqrt(float(np.mean((weights * fitted) ** 2))),
        )
        if scatter > signal:
            few.append(scattered(scatter / max(signal, 1e-300)))
        why = (*few, *why)

    # What the noise does otherwise than assumed.
    widening, doubts = found.widening(level, 1.0 if found.known else scale), []
    stated, side = known and not sample.final, 0
    if stated:
        apart = rss if found.runs is None else rss - float(found.runs.offset @ found.runs.offset)
        side = contradicted(apart, dof)
        if side:
            low, high = (special.chdtri(dof, share) / dof for share in (1.0 - STATED, STATED))
            size = "small, or the model is incomplete" if side > 0 else "large"
            doubts.append(
                f"the stated sigma is too {size}: chi2 per degree of freedom is {apart / dof:.3g}, expected {low:.2g} to"
                f" {high:.2g}; intervals follow from {'the stated sigma' if found.known else 'the scatter'}"
            )
    if found.sizes is not None:
        first, last = found.sizes[np.argmin(sample.t)], found.sizes[np.argmax(sample.t)]
        most = float(np.max(found.sizes) / np.min(found.sizes))
        doubts.append(
            f"the noise changes along {sample.abscissa[0]}, at the end to {last / first:.2g} times that at the beginning, in"
            f" all by a factor of {most:.2g}; the intervals allow for it"
        )
    if found.copies > 1.0:
        doubts.append(
            f"most points are copies of others, {found.copies:.3g} of each, as of a file or a curve that was taken twice:"
            f" they count once, with intervals {math.sqrt(found.copies):.3g} times as wide"
        )
    elif found.runs is not None:
        runs, m = found.runs, found.runs.factors.size
        which = "significantly, " if runs.chance < APART else "not significantly, "
        doubts.append(
            f"{m} joined runs at equal abscissae differ {which}by a factor of {100.0 * float(np.ptp(runs.factors)):.2g} %"
            f" (error of a run {100.0 * runs.error:.2g} %, probability by chance {runs.chance:.2g}); the intervals include"
            f" the variation between runs, of which {m} runs tell little"
        )
    if misfit:
        doubts.append(
            "MISFIT: the residuals are significantly correlated; intervals were widened by a factor of"
            f" {widening:.2g} and hold only if the model does"
        )

    # AIC and BIC for Gaussian errors, up to a constant common to all models of the same data and weights: -2 log L is
    # rss where sigma is known and n log(rss/n) otherwise, with one more parameter for it, and the log variances of
    # the points.
    likelihood = sample.spread() + (rss if known else n * math.log(max(rss, 1e-300) / n))
    count = p if known else p + 1
    evidence = Evidence(
        fitted=fitted, residuals=residuals, rss=rss, noise=scale, lag1=found.lag1, misfit=misfit, widening=widening,
        refused=why, r2=r2, aic=likelihood + 2 * count, bic=likelihood + count * math.log(n), p=p,
        chi2=rss / dof if stated else math.nan, stated=found.known, agrees=not side, doubts=tuple(doubts),
    )  # fmt: skip
    slopes = found.whitened(jacobian, (1.0 if found.known else scale) * widening)
    return Assessment(evidence, slopes, found, level, rss, ROUNDING * sample.size)


def reweighted_until_stable(
    sample: Sample, first: Solved[Search], solve: Callable[[np.ndarray], Solved[Search]], p: int
) -> Solved[Search]:
    """Return the solution whose weights are consistent with it, from a first one; solve: function of the weights (n,)."""
    return all_reweighted_until_stable([sample], [first], lambda weights: [solve(weights[0])], p)[0]


def all_reweighted_until_stable(
    samples: Sequence[Sample], first: list[Solved[Search]],
    solve: Callable[[list[np.ndarray]], list[Solved[Search]]], p: int,
) -> list[Solved[Search]]:  # fmt: skip
    """Return solutions whose weights are consistent with them, from initial solutions.

    solve: function from the weights (n,) of each sample to their solutions. Estimated weights follow from the variance of
    the noise averaged over its posterior (``noise.py``), proportional ones from the fitted values; others are kept.
    """
    found, one = first, samples[0]
    for turn in range(REWEIGHTINGS if one.adjustable else 0):
        weights = [sample.reweighed(last, p) for sample, last in zip(samples, found, strict=True)]
        same = all(one.agree(new, last.weights) for new, last in zip(weights, found, strict=True))
        if same and (turn or one.proportional):
            break
        found = solve(weights)
    return found


# Trends that are judged by their size.
#
# A measured curve of a real sample, as of a microscope or a nanoindenter, is never described to within its noise
# where that is small, so that a trend of the residuals alone is no reason for a rejection. Where the common tests
# find one, the model is fitted again to parts of the points. The intervals are widened by the largest change of each
# parameter, and the fit is rejected if the parameters of interest change by more than a limit, or the trend exceeds
# another one.


class Deviation(NamedTuple):
    """The systematic deviation of a fit.

    systematic (m,): change of the coordinates that the intervals must include; against: reasons for rejection; notes;
    trended: whether a trend of the residuals is the reason.
    """

    systematic: np.ndarray
    against: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    trended: bool = False


def judged_by_size(
    problem: Any, solved: Solved, size: Callable[[], float], refits: Callable[[], Sequence[np.ndarray | None]],
    watched: Callable[[np.ndarray], np.ndarray], limits: tuple[float, float],
    words: Callable[[float, np.ndarray, bool], str],
) -> Deviation:  # fmt: skip
    """Return the systematic deviation of a fit whose sample has ``own_trends``.

    size(): of the trend; refits(): coordinates (m,) of fits to parts of the points, None with too few; watched: function of
    the coordinates that returns the quantities (k,) whose changes are judged; limits: of the trend, and of their changes;
    words(trend, changes, rejected): the reason or the note, with changes (r, k) from each refit to the fit to all points.
    """
    # 1. Whether the common tests would reject the fit, and the fits to parts of the points if so.
    nothing, common = np.zeros(solved.theta.size), problem.sample._replace(own_trends=False)
    if not common.assess(solved, problem.p, problem.level).evidence.refused:
        return Deviation(nothing)
    found = refits()
    if any(one is None for one in found):
        return Deviation(nothing, (TOO_FEW,))

    # 2. The changes from these fits to that to all points, of all coordinates and of the watched quantities.
    systematic = np.max(np.abs(solved.theta - np.array(found)), axis=0)
    changes, trend = watched(solved.theta) - np.array([watched(one) for one in found]), size()

    # 3. A reason for a rejection beyond the limits, otherwise a note.
    rejected = bool(trend > limits[0] or float(np.max(np.abs(changes))) > limits[1])
    said = (words(trend, changes, rejected),)
    return Deviation(systematic, said, trended=True) if rejected else Deviation(systematic, notes=said)
