"""Continuous relaxation spectrum from a relaxation modulus, or from storage and loss moduli."""

import dataclasses
import json
import math
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from fitting.data.moduli import OscillationData, RelaxationData
from fitting.data.weights import nonnegative
from fitting.fits.modulus import weighted_sample
from fitting.fits.prony import MaxwellSeries
from fitting.inference import noise
from fitting.inference.result import plain
from fitting.inference.sample import Curve, Evidence, Solved, reweighted_until_stable
from fitting.models.structure import Compressibility
from fitting.views import sheet, text

# Search for a continuous relaxation spectrum: regularised least squares with the smoothness of highest evidence.
#
# The data are y = A H + g e with the spectrum H > 0 at m times, and an equilibrium modulus g >= 0. The coordinates
# are log H and g, and the minimum of
#
#     |w (y - A H - g e)|^2 + lambda |D log H|^2,      D the second differences,
#
# is the most probable spectrum if the noise is normal and D log H is normal about 0. lambda maximises the evidence,
#
#     lambda^((m - 2)/2) |J^T J + lambda D^T D|^(-1/2) P^(-(n - 3)/2),     P the minimum, J the Jacobian
#
# (D. J. C. MacKay, Neural Comput. 4 (1992) 415; A. Takeh, S. Shanbhag, Appl. Rheol. 23 (2013) 24628, for log H). The
# two polynomials that D does not see, and g, have no prior.


SMOOTHNESS = np.geomspace(1e-4, 1e8, 25)  # trial lambdas, over the square of the noise at the first fit
NEXT = 10.0 ** np.array([0.5, 0.0, -0.5])  # trial lambdas over that of the last search, with other weights
DEEP = 1e-10  # least spectrum over the largest modulus
NONE = 1e-8  # relaxing part of the modulus below which there is no spectrum; that of the least one is 1e-9
NEAR = 1e-8  # relative tolerance of the searches
EVALUATIONS = 200  # of a search, after which it has not converged
EXACT = 1e-6  # least mean square of the residuals over that of the data, of a discrete spectrum


class LinearSpectrum(NamedTuple):
    """The problem with A (n, m), e (n,) zero without an equilibrium modulus, and y (n,); largest: modulus of the data."""

    A: np.ndarray
    e: np.ndarray
    y: np.ndarray
    largest: float

    def weighted(self, w: np.ndarray) -> "LinearSpectrum":
        """Return the problem with every row multiplied by its weight (n,)."""
        return self._replace(A=w[:, None] * self.A, e=w * self.e, y=w * self.y)


class SpectrumOptimum(NamedTuple):
    """The most probable spectrum: log H (m,), g, residual (n,), Jacobian (n, m + 1) with respect to log H and g/largest,
    precision (m + 1, m + 1) over the variance of the noise, lambda, that variance, and whether the search converged. log H
    is -inf without a spectrum."""

    log: np.ndarray
    equilibrium: float
    residual: np.ndarray
    jacobian: np.ndarray
    precision: np.ndarray
    smoothness: float
    variance: float
    converged: bool


def search(problem: LinearSpectrum, last: SpectrumOptimum | None = None) -> SpectrumOptimum:
    """Return the most probable spectrum at the smoothness of highest evidence; last: that of similar weights."""
    m, solid = problem.A.shape[1], bool(np.any(problem.e))
    D = np.diff(np.eye(m), 2, axis=0)
    found: list[tuple[float, SpectrumOptimum]] = []
    if last is None:
        # the noise is the mean square of the residuals of an unregularised spectrum >= 0
        A = np.column_stack([problem.A, problem.e])
        off = A @ nonnegative(A, problem.y) - problem.y
        variance = max(float(off @ off) / problem.y.size, EXACT * float(np.mean(problem.y**2)))
        trials = variance * SMOOTHNESS[::-1]
        best = np.append(np.full(m, np.log(problem.largest / m)), 0.1)
    else:
        # the smoothness is relative to the weights, of which the noise at the last spectrum is the measure
        off = problem.A @ np.exp(last.log) + last.equilibrium * problem.e - problem.y
        before = max(float(last.residual @ last.residual), 1e-300)
        trials = last.smoothness * float(off @ off) / before * NEXT
        best = np.append(last.log, last.equilibrium / problem.largest)
    for smoothness in trials:  # from the smoothest, whose minimum is unique
        one, evidence = _optimum(problem, D, float(smoothness), best, solid)
        best = np.append(one.log, one.equilibrium / problem.largest)
        found.append((evidence, one))
    optimum = max(found, key=lambda pair: pair[0])[1]
    if not solid or np.sum(problem.A @ np.exp(optimum.log)) > NONE * np.sum(np.abs(problem.y)):
        return optimum

    # a modulus that does not relax: the plateau alone, by least squares
    plateau = float(problem.e @ problem.y / (problem.e @ problem.e))
    residual = plateau * problem.e - problem.y
    jacobian = np.column_stack([np.zeros_like(problem.A), problem.largest * problem.e])
    return optimum._replace(
        log=np.full(m, -np.inf), equilibrium=plateau, residual=residual, jacobian=jacobian,
        precision=jacobian.T @ jacobian, variance=float(residual @ residual) / (problem.y.size - 1), converged=True,
    )  # fmt: skip


def _optimum(
    problem: LinearSpectrum, D: np.ndarray, smoothness: float, start: np.ndarray, solid: bool
) -> tuple[SpectrumOptimum, float]:
    """Return the optimum at a smoothness, and the logarithm of its evidence up to a constant."""
    # 1. Least squares of exp(x), the spectrum, with its second differences of log H as further residuals.
    A, e, y, largest = problem
    m, root = A.shape[1], np.sqrt(smoothness)
    bend = np.column_stack([root * D, np.zeros(len(D))])

    def jacobian(x: np.ndarray) -> np.ndarray:
        return np.column_stack([A * np.exp(x[:-1]), largest * e])

    low = np.append(np.full(m, np.log(DEEP * largest)), 0.0)
    high = np.append(np.full(m, np.log(1e4 * largest)), 10.0)
    found = least_squares(
        lambda x: np.append(A @ np.exp(x[:-1]) + largest * x[-1] * e - y, bend @ x),
        np.clip(start, low + 1e-9, high - 1e-9), lambda x: np.vstack([jacobian(x), bend]), (low, high),
        xtol=NEAR, ftol=NEAR, gtol=1e-14, max_nfev=EVALUATIONS,
    )  # fmt: skip

    # 2. The evidence of this smoothness: the integral of the likelihood over the spectrum, by its curvature at the optimum.
    J = jacobian(found.x)
    free = np.arange(m + 1) < m + (solid and found.x[-1] > 1e-8)
    precision = J.T @ J + bend.T @ bend
    P, n = 2.0 * found.cost, y.size
    _, volume = np.linalg.slogdet(precision[np.ix_(free, free)])
    evidence = 0.5 * ((m - 2) * np.log(smoothness) - volume - (n - 3) * np.log(P))
    residual, at = found.fun[:n], float(found.x[-1] * largest) if free[-1] else 0.0
    variance, converged = P / (n - 3), found.status != 0
    optimum = SpectrumOptimum(
        found.x[:-1], at, residual, J * free, precision, smoothness, variance, converged
    )
    return optimum, float(evidence)


def posterior_covariance(found: SpectrumOptimum) -> tuple[np.ndarray, np.ndarray]:
    """Return the covariance of log H (m, m), and the resolution matrix (m, m): the response of the estimate of log H at
    one time to a change of it at another one."""
    m = found.log.size
    free = np.any(found.jacobian != 0.0, axis=0)
    inverse = np.zeros_like(found.precision)
    inverse[np.ix_(free, free)] = np.linalg.pinv(
        found.precision[np.ix_(free, free)], rcond=1e-14, hermitian=True
    )
    resolution = inverse @ (found.jacobian.T @ found.jacobian)
    return found.variance * inverse[:m, :m], resolution[:m, :m]


NAMES, COLOURS = ("G'", "G''"), (sheet.VIOLET, sheet.GREEN)  # of the figure
PER_DECADE = 8  # times of the spectrum
BEYOND = 1.0  # decades by which they exceed the range of the data at either end
KNOWN = math.log(2.0)  # standard deviation of log H up to which the data resolve it
SHIFTED = 0.5  # distance [decades] from a time to the centre of what the data show of it


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SpectrumFit(Evidence):
    """A continuous relaxation spectrum H(tau), the times at which the data determine it, and the ``Evidence`` of its
    residuals.

    Attributes:
        tau (m,): relaxation times [s]; H (m,): the spectrum, and low, high (m,): the ends of its intervals [Pa]; all are
            zero, with a note, where the modulus is constant.
        resolved (m,): bool, the times at which the data determine log H to a standard deviation of log 2.
        width (m,): width [decades] at which the estimate shows a sharp line of the true spectrum, nan where not resolved.
        equilibrium: Ge [Pa], 0 where it was not fitted. It includes all parts that relax after the time range of the data.
        material: the equivalent ``jc.Prony``.
        smoothness: the weight of the curvature of log H, that of the highest Bayesian evidence.
        data, weights, level, notes, curve: as in ``Fit``.
    """

    tau: np.ndarray
    H: np.ndarray
    low: np.ndarray
    high: np.ndarray
    resolved: np.ndarray
    width: np.ndarray
    equilibrium: float
    material: Any
    smoothness: float
    data: Any
    weights: str
    level: float
    notes: tuple[str, ...]
    curve: Curve

    @property
    def relaxed(self) -> bool:
        """True if the data are a relaxation modulus over time."""
        return isinstance(self.data, RelaxationData)

    @property
    def abscissa(self) -> tuple[str, str]:
        """The symbol and the unit of the abscissa of the data."""
        return ("t", "s") if self.relaxed else ("omega", "rad/s")

    @property
    def verdict(self) -> str:
        """The verdict on the goodness of fit, "accepted" or "rejected"; ``refused`` has the reasons for a rejection."""
        return "rejected" if self.refused else "accepted"

    @property
    def limits(self) -> tuple[float, float]:
        """The shortest and the longest resolved time [s], nan if there is none."""
        known = self.tau[self.resolved]
        return (float(known[0]), float(known[-1])) if known.size else (math.nan, math.nan)

    def __repr__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        """Return the result as text for the terminal."""
        (_, _, x, _), (symbol, unit) = self.curve, self.abscissa
        first, last = self.limits
        resolved = (
            f"resolved from {first:.4g} to {last:.4g} s; elsewhere the curve continues it smoothly"
            if self.resolved.any()
            else "no spectrum: the modulus does not relax"
            if not self.H.any()
            else "resolved nowhere: the curve is the smoothest that agrees with the data"
        )
        lines = [
            f"relaxation spectrum of {x.size} values, {symbol} = {x.min():.4g} to {x.max():.4g} {unit}; weights:"
            f" {self.weights}",
            f"  {resolved}",
        ]
        some = np.flatnonzero(self.resolved)[:: PER_DECADE // 2]
        lines += [
            f"  H({self.tau[k]:.4g} s) = {self.H[k]:.4g} Pa, {100 * self.level:g} % interval {self.low[k]:.4g} to"
            f" {self.high[k]:.4g} Pa; a line appears {self.width[k]:.2g} decades wide"
            for k in some
        ]
        if self.equilibrium > 0.0:
            lines.append(f"  Ge = {self.equilibrium:.4g} Pa, with all that relaxes later than the data")
        lines += [*text.quality(self), *text.verdict(self)]
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def plot(self, path: Any = None) -> Any:
        """Return a figure of the moduli with the fit and of the spectrum with its band; saved where a path is given."""
        _, _, x, y = self.curve
        parts = [
            np.split(one, 1 if self.relaxed else 2) for one in (x, y, self.fitted, sheet.deviations(self))
        ]

        def panel(top: Any, bottom: Any) -> None:
            for k, name in enumerate(("G(t)",) if self.relaxed else NAMES):
                at, measured, fitted, residual = (part[k] for part in parts)
                on = (at > 0.0) & (measured > 0.0)
                top.loglog(at[on], measured[on], ".", markersize=4, color=COLOURS[k], label=name)
                top.loglog(at[at > 0.0], fitted[at > 0.0], color=COLOURS[k], linewidth=1.0)
                bottom.semilogx(at[at > 0.0], residual[at > 0.0], ".", markersize=4, color=COLOURS[k])
            top.set_ylabel("modulus [Pa]")
            over = "t [s]" if self.relaxed else "ω [rad/s]"
            bottom.set(xlabel=over, ylabel=sheet.RESIDUAL)

        def spectrum(axes: Any) -> None:
            """Plot the spectrum, dashed where the data do not resolve it."""
            if not self.H.any():
                axes.semilogx(self.tau, self.H, color=sheet.VIOLET)
                axes.set(xlabel="τ [s]", ylabel="H [Pa]")
                return
            axes.loglog(self.tau, self.H, "--", color="0.6", label="not resolved")
            axes.loglog(self.tau, np.where(self.resolved, self.H, np.nan), color=sheet.VIOLET, label="H")
            band = [np.where(self.resolved, end, np.nan) for end in (self.low, self.high)]
            axes.fill_between(self.tau, *band, alpha=0.3, label=f"{100 * self.level:g} % band")
            known = self.high[self.resolved] if self.resolved.any() else self.H
            least = 0.2 * self.H[self.resolved].min() if self.resolved.any() else None
            axes.set(xlabel="τ [s]", ylabel="H [Pa]", ylim=(least, 3.0 * known.max()))
            axes.legend(fontsize="small")

        return sheet.draw(self, path, panel, (spectrum,), lines=())

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values for JSON."""
        rows = {name: plain(getattr(self, name)) for name in ("tau", "H", "low", "high", "width")}
        units = {"tau": "tau_s", "H": "H_Pa", "low": "low_Pa", "high": "high_Pa", "width": "width_decades"}
        return {units[name]: row for name, row in rows.items()} | {
            "resolved": self.resolved.tolist(), "resolved_s": plain(self.limits), "Ge_Pa": self.equilibrium,
            "smoothness": self.smoothness, "level": self.level, "weights": self.weights, "r2": plain(self.r2),
            "noise": self.noise, "verdict": self.verdict, "verdict_in_words": text.in_words(self),
            "reasons": list(self.refused), "notes": list(self.notes),
        }  # fmt: skip

    def to_json(self) -> str:
        """Return ``to_dict`` as JSON text."""
        return json.dumps(self.to_dict(), indent=2)


def fit_spectrum(
    data: RelaxationData | OscillationData, *, weights: str | None = None, sigma: Any = None,
    equilibrium: bool = True, nu: float = 0.3, level: float = 0.95,
) -> SpectrumFit:  # fmt: skip
    """Fit a continuous relaxation spectrum H(tau) to a relaxation modulus, or to storage and loss moduli.

        G(t) = Ge + int H exp(-t/tau) d ln tau,    G*(omega) = Ge + int H i omega tau/(1 + i omega tau) d ln tau

    log H is taken as smooth, as much as makes the data most probable (``fitting/fits/spectrum.py``). The
    intervals hold at each time under this assumption. The data resolve a spectrum over little more than the reciprocal of
    their frequencies, and no detail that is narrower than ``width``.

    Args:
        data: the modulus over time, or the moduli over frequency.
        weights: as in ``fit_relaxation`` ("estimated" by default) or ``fit_oscillation`` ("proportional" by default); or
        sigma: the known standard deviation [Pa], a number or (n,), or (2, n) as in ``fit_oscillation``.
        equilibrium: whether an equilibrium modulus Ge is fitted; otherwise it is 0 and the body flows.
        nu: Poisson's ratio that the returned material is given.
        level: confidence level of the intervals.

    Returns:
        The spectrum with its intervals, what the data resolve, and the equivalent ``jc.Prony``.

    Raises:
        ValueError: data of another type, two choices of weights, or fewer than 8 values.

    Example:
        >>> omega = np.geomspace(1e-2, 1e2, 25)
        >>> G = np.asarray(jc.Maxwell(1e5, 1e5, nu=0.5).complex_modulus(omega))
        >>> fit = fitting.fit_spectrum(fitting.OscillationData(omega, G.real, G.imag), equilibrium=False)
        >>> print(f"most at {fit.tau[np.argmax(fit.H)]:.0f} s")
        most at 1 s
    """
    if not isinstance(data, RelaxationData | OscillationData):
        raise ValueError(f"data: expected RelaxationData or OscillationData, got {type(data).__name__}")
    relaxed = isinstance(data, RelaxationData)
    if weights is None and sigma is None and getattr(data, "scatter", None) is None:
        weights = "estimated" if relaxed else "proportional"
    _, sample, _ = weighted_sample(data, weights, sigma)
    if sample.t.size < 8:
        raise ValueError(f"data: expected at least 8 values for a spectrum, got {sample.t.size}")
    at = np.asarray(data.t if isinstance(data, RelaxationData) else data.omega)

    # 1. Times of the spectrum (m,) [s], beyond the range of the data, and the linear problem.
    known = at[at > 0.0]
    ends = np.log10([known.min(), known.max()] if relaxed else [1.0 / known.max(), 1.0 / known.min()])
    count = max(int(PER_DECADE * (ends[1] - ends[0] + 2.0 * BEYOND)), 8)
    tau = np.logspace(ends[0] - BEYOND, ends[1] + BEYOND, count)
    step = math.log(tau[1] / tau[0])
    A, e = _kernel(relaxed, at, tau)
    unweighted = LinearSpectrum(
        A * step, e * equilibrium, sample.measured, float(np.max(np.abs(sample.measured)))
    )

    # 2. The spectrum, with weights that are consistent with it.
    start = _solved(search(unweighted.weighted(sample.weights)), sample.weights)
    again = lambda weights: _solved(search(unweighted.weighted(weights), start.search_result), weights)
    solved = reweighted_until_stable(sample, start, again, start.theta.size)
    found, assessment = solved.search_result, sample.assess(solved, solved.theta.size, level)
    quality = assessment.evidence
    if not found.converged:
        why = f"the search for the spectrum did not converge within {EVALUATIONS} evaluations"
        quality = dataclasses.replace(quality, refused=(*quality.refused, why))

    # 3. The equivalent series as the material.
    series = MaxwellSeries.with_times(tau, found.equilibrium > 0.0)
    moduli = step * np.exp(found.log)
    moduli = np.append(found.equilibrium, moduli) if found.equilibrium > 0.0 else moduli
    material = series.material(series.parameters(moduli), Compressibility("nu", nu))
    flat = (
        []
        if np.isfinite(found.log).any()
        else [f"the modulus is constant within {NONE:g}: no spectrum, H = 0"]
    )
    fields = vars(quality) | _spectrum(found, tau, quality.widening, level)
    return SpectrumFit(
        **fields, material=material, data=data, weights=sample.label, level=level,
        notes=(*data.notes, *flat, *sample.noise_notes(assessment), *quality.doubts),
        curve=sample.curve(solved.kept),
    )  # fmt: skip


def _kernel(relaxed: bool, at: np.ndarray, tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the response (n, m) to each time and that (n,) to an equilibrium modulus; G' followed by G''."""
    x = np.outer(at, 1.0 / tau if relaxed else tau)
    if relaxed:
        return np.exp(-x), np.ones(at.size)
    lorentz = 1.0 / (1.0 + x**2)
    return np.concatenate([x**2 * lorentz, x * lorentz]), np.repeat([1.0, 0.0], at.size)


def _solved(found: SpectrumOptimum, w: np.ndarray) -> Solved:
    """Return an optimum with weights (n,) as that of as many parameters as the data determine."""
    _, resolution = posterior_covariance(found)
    p = int(np.clip(round(np.trace(resolution)), 1, w.size - 2))
    U, S, _ = np.linalg.svd(found.jacobian, full_matrices=False)
    on = np.ones(w.size, dtype=bool)
    return Solved(
        np.zeros(p), found.residual, U[:, :p] * S[:p], np.ones(p, dtype=bool), on, w, search_result=found
    )


def _spectrum(found: SpectrumOptimum, tau: np.ndarray, widening: float, level: float) -> dict[str, Any]:
    """Return the fields on the spectrum and its resolution."""
    cov, resolution = posterior_covariance(found)
    sd, place = np.sqrt(np.diag(cov)) * widening, np.log10(tau)
    weight = np.abs(resolution) + 1e-300
    weight /= weight.sum(1, keepdims=True)
    centre = weight @ place
    # at half height of a normal curve
    width = 2.355 * np.sqrt(np.maximum(weight @ place**2 - centre**2, 0.0))
    resolved = (sd < KNOWN) & (np.abs(centre - place) < SHIFTED) & np.isfinite(found.log)
    z = noise.two_sided(level)
    with np.errstate(over="ignore"):
        H, low, high = np.exp(found.log), np.exp(found.log - z * sd), np.exp(found.log + z * sd)
    return {
        "tau": tau, "H": H, "low": low, "high": high, "resolved": resolved, "width": np.where(resolved, width, np.nan),
        "equilibrium": found.equilibrium, "smoothness": found.smoothness,
    }  # fmt: skip
