"""Errors of the amplitude and of the phase of a complex modulus, estimated separately.

A rheometer measures |G*| and the phase. The error of the amplitude multiplies G' and G'' by one factor, so that these have
independent errors of equal size only if the relative error of |G*| happens to equal that of the phase. The fit with
relative weights is therefore continued in the coordinates

    ln|G*| and arg G*,     with standard deviations s_1 and s_2,

whose variances are RSS_i/nu_i with the degrees of freedom nu_i of each group (its points less their leverages), by
iteration (H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545).
"""

import dataclasses
import math
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import Partial
from scipy import stats

from fitting.data.moduli import OscillationData, RelaxationData
from fitting.inference.conclusion import Conclusion, FitProblem, conclude, solution
from fitting.inference.correlation import basis
from fitting.inference.evidence import Sample, Solved, coefficient_of_determination
from fitting.inference.noise import Noise
from fitting.inference.two_scales import TwoScales, degrees_of_freedom
from fitting.models.search_space import Landscape
from fitting.search import nonlinear
from fitting.search.nonlinear import Objective

TURNS, STILL = 12, 0.01  # iterations for the two scales, and their relative change at convergence
FEW = 2.0  # least degrees of freedom of a scale
LEAST = 1e-3  # least ratio of the two scales
LABEL = "relative, |G*| and phase separately"


class PolarSample(Sample):
    """The logarithm of |G*| followed by the phase, with weights from their two error scales."""

    def noise(self, solved: Solved, p: int) -> Noise:
        """Return the noise model, in which the degrees of freedom are those of both scales."""
        found, Q, second = super().noise(solved, p), basis(solved.jacobian), self.blocks > 0
        inside = basis(solved.jacobian[:, solved.inside])
        dof = degrees_of_freedom(inside, second)
        return found._replace(calibration=TwoScales(Q, second, dof, found.dof))


class Polar(NamedTuple):
    """A modulus in Cartesian form, and its weights: y (n,) complex and cartesian (2n,), of the residuals of an objective;
    weights (2n,): of ln|G*| and of the phase."""

    y: np.ndarray
    cartesian: np.ndarray
    weights: np.ndarray

    def residual(self, cartesian: Array) -> Array:
        """Return the weighted residuals (2n,) of ln|G*| and of the phase from those (2n,) of G' and G''."""
        return residual_of(cartesian, self.y, self.cartesian, self.weights)

    def objective(self, own: Objective) -> Objective:
        """Return the objective in ln|G*| and phase of one in G' and G''."""
        n = self.y.size

        def slopes(theta: np.ndarray, free: np.ndarray) -> np.ndarray:
            off = np.asarray(own.residual(theta)) / self.cartesian
            J = np.asarray(own.jacobian(theta, free)) / self.cartesian[:, None]
            by_log = (J[:n] + 1j * J[n:]) / (self.y + off[:n] + 1j * off[n:])[:, None]
            return np.concatenate([by_log.real, by_log.imag]) * self.weights[:, None]

        of = lambda theta: self.residual(own.residual(theta))
        return Objective(of, slopes, own.lower, own.upper, floor=1e-26 * float(np.sum(self.weights**2)))

    def landscape(self, own: Landscape) -> Landscape:
        """Return the residuals as a function of the parameters, of those in G' and G''."""
        run = Partial(_of_values, own.residual, self.y, self.cartesian, self.weights)
        return own._replace(residual=run)


def residual_of(cartesian: Array, y: Array, divided: Array, weights: Array) -> Array:
    """Return the weighted residuals (2n,) of ln|G*| and of the phase, from residuals (2n,) of G' and G'' with weights
    ``divided``."""
    off = cartesian / divided
    ratio = 1.0 + (off[: y.size] + 1j * off[y.size :]) / y
    return weights * jnp.concatenate([jnp.log(jnp.abs(ratio)), jnp.angle(ratio)])


def _of_values(own: Any, y: Array, divided: Array, weights: Array, values: Array) -> Array:
    """Return the weighted residuals (2n,) at values of the parameters."""
    return residual_of(own(values), y, divided, weights)


def concluded(problem: FitProblem, solved: Solved) -> Conclusion:
    """Return the fields of the fit of a modulus, with separate errors of |G*| and phase if its weights are relative."""
    other, found = _separated(problem, solved)
    if other is problem:
        return conclude(problem, solved._replace(notes=(*solved.notes, *common_errors(problem.data, solved))))
    result = conclude(other, found)
    return result._replace(fields=result.fields | _cartesian(result.fields, problem))


def _separated(problem: FitProblem, solved: Solved) -> tuple[FitProblem, Solved]:
    """Return the problem and the solution with the errors of |G*| and of the phase estimated separately.

    They are returned unchanged where weights other than relative ones were chosen, the residuals are rounding, or there
    are too few points.
    """
    sample, n, data = problem.sample, problem.sample.t.size // 2, problem.data
    unchanged = problem, solved
    if isinstance(data, RelaxationData) or sample.label != "relative":
        return unchanged
    if not sample.real(solved.residual, problem.p):
        return unchanged
    y = sample.measured[:n] + 1j * sample.measured[n:]
    second = np.arange(2 * n) >= n
    best, own = solved.whole
    polar, scales = Polar(y, solved.weights, np.ones(2 * n)), np.ones(2)
    for _ in range(TURNS):
        objective = polar.objective(own)
        best = nonlinear.minimise(objective, best.theta)
        inside = solution(objective, best, polar.weights).inside
        dof = np.array(degrees_of_freedom(basis(best.jacobian[:, inside]), second))
        if dof.min() < FEW:
            return unchanged
        off = (best.residual / polar.weights).reshape(2, n)
        new = np.sqrt(np.maximum(np.sum(off**2, 1) / dof, 1e-300))
        new = np.maximum(new, LEAST * new.max())
        pooled = math.sqrt(float(np.mean(new**2)))  # so that the weighted residuals are relative errors
        polar, last, scales = polar._replace(weights=np.repeat(pooled / new, n)), scales, new
        if np.all(np.abs(new / last - 1.0) < STILL):
            break
    return _final(problem, solved, polar, scales)


def _final(
    problem: FitProblem, solved: Solved, polar: Polar, scales: np.ndarray
) -> tuple[FitProblem, Solved]:
    """Return problem and solution with the final scales (2,)."""
    first, own = solved.whole
    objective = polar.objective(own)
    best = nonlinear.minimise(objective, first.theta)
    best = best._replace(starts=first.starts, agreed=first.agreed, others=first.others)
    y, old = polar.y, problem.sample
    logs = np.append(np.log(np.abs(y) / np.abs(y).max()), np.angle(y))
    blocks = np.repeat([0, 1], y.size)
    sample = PolarSample.of(("ln|G*|, phase", "-", old.t, logs), polar.weights, LABEL, blocks)
    note = f"standard deviation of a point, estimated: {100 * scales[0]:.2g} % of |G*| and {scales[1]:.2g} rad of the phase"
    found = solution(objective, best, polar.weights)._replace(notes=(*solved.notes, note))
    r2 = coefficient_of_determination(
        old.measured, old.measured + np.asarray(own.residual(best.theta)) / solved.weights
    )
    against = () if r2 > 0.0 else (f"the model describes the data no better than a constant: R2 = {r2:.3g}",)
    assert solved.landscape is not None
    found = found._replace(landscape=polar.landscape(solved.landscape), against=against)
    return dataclasses.replace(problem, sample=sample), found


def _cartesian(fields: dict[str, Any], problem: FitProblem) -> dict[str, Any]:
    """Return those fields of a fit in ln|G*| and phase that are reported in G' and G'', and AIC and BIC, in which the two
    scales count as parameters."""
    sample = problem.sample
    n, logs = sample.t.size // 2, fields["fitted"]
    size = np.abs(sample.measured[:n] + 1j * sample.measured[n:])
    model = size.max() * np.exp(logs[:n] + 1j * logs[n:])
    fitted = np.append(model.real, model.imag)
    off = (logs - fields["curve"][3]).reshape(2, n)
    fit = n * float(np.sum(np.log(np.maximum(np.mean(off**2, 1), 1e-300))))
    p = problem.p + 2
    return {
        "curve": sample.curve(np.ones(2 * n, dtype=bool)), "fitted": fitted,
        "residuals": (fitted - sample.measured) / np.tile(size, 2),
        "r2": coefficient_of_determination(sample.measured, fitted),
        "aic": fit + 2 * p, "bic": fit + p * math.log(2 * n),
    }  # fmt: skip


def common_errors(data: RelaxationData | OscillationData, solved: Solved) -> tuple[str, ...]:
    """Return a note where G' and G'' of a frequency have the same error, that of the amplitude.

    A fit takes them as independent, with the mean variance of amplitude and phase. What the amplitude alone determines
    then has an interval that is too short by the square root of the variance of the amplitude over this mean.
    """
    if isinstance(data, RelaxationData):
        return ()
    n = data.omega.size
    off = solved.residual / solved.weights
    relative = (off[:n] + 1j * off[n:]) / data.shear
    size, phase = (float(np.mean(part**2)) for part in (relative.real, relative.imag))
    if not size > phase * stats.f.ppf(0.99, n, n):
        return ()
    short = math.sqrt(2.0 * size / (size + phase))
    return (
        f"errors of |G*| ({100 * math.sqrt(size):.2g} %) exceed those of the phase ({math.sqrt(phase):.2g} rad), so that G'"
        f" and G'' have common errors: the intervals may be up to {short:.2g} times too short",
    )
