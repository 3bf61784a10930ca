"""Continuous relaxation spectrum from a relaxation modulus, or from storage and loss moduli."""

import dataclasses
import json
import math
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting.data.moduli import OscillationData, RelaxationData
from fitting.fits.modulus import weighted_sample
from fitting.inference import student
from fitting.inference.evidence import Curve, Evidence, Solved, settled
from fitting.inference.result import plain
from fitting.models.maxwell_series import MaxwellSeries
from fitting.models.structure import Volume
from fitting.search.spectrum_search import (
    EVALUATIONS,
    LinearSpectrum,
    SpectrumOptimum,
    posterior_covariance,
    search,
)
from fitting.views import report, spectrum_picture

PER_DECADE = 8  # times of the spectrum
BEYOND = 1.0  # decades by which they exceed the range of the data at either end
KNOWN = math.log(2.0)  # standard deviation of log H up to which the data resolve it
SHIFTED = 0.5  # distance [decades] from a time to the centre of what the data show of it


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SpectrumFit(Evidence):
    """A continuous relaxation spectrum H(tau), the times at which the data determine it, and the ``Evidence`` of its
    residuals.

    Attributes:
        tau (m,): relaxation times [s]; H (m,): the spectrum, and low, high (m,): the ends of its intervals [Pa].
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
        lines = [
            f"relaxation spectrum of {x.size} values, {symbol} = {x.min():.4g} to {x.max():.4g} {unit}; weights:"
            f" {self.weights}",
            f"  resolved from {first:.4g} to {last:.4g} s; elsewhere the curve continues it smoothly",
        ]
        some = np.flatnonzero(self.resolved)[:: PER_DECADE // 2]
        lines += [
            f"  H({self.tau[k]:.4g} s) = {self.H[k]:.4g} Pa, {100 * self.level:g} % interval {self.low[k]:.4g} to"
            f" {self.high[k]:.4g} Pa; a line appears {self.width[k]:.2g} decades wide"
            for k in some
        ]
        if self.equilibrium > 0.0:
            lines.append(f"  Ge = {self.equilibrium:.4g} Pa, with all that relaxes later than the data")
        lines += [*report.quality(self), *report.verdict(self)]
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def plot(self, path: Any = None) -> Any:
        """Return a figure of the moduli with the fit and of the spectrum with its band; saved where a path is given."""
        return spectrum_picture.draw(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values for JSON."""
        rows = {name: plain(getattr(self, name)) for name in ("tau", "H", "low", "high", "width")}
        units = {"tau": "tau_s", "H": "H_Pa", "low": "low_Pa", "high": "high_Pa", "width": "width_decades"}
        return {units[name]: row for name, row in rows.items()} | {
            "resolved": self.resolved.tolist(), "resolved_s": plain(self.limits), "Ge_Pa": self.equilibrium,
            "smoothness": self.smoothness, "level": self.level, "weights": self.weights, "r2": plain(self.r2),
            "noise": self.noise, "verdict": self.verdict, "verdict_in_words": report.in_words(self),
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

    log H is taken as smooth, as much as makes the data most probable (``fitting/search/spectrum_search.py``). The
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
    tau = _times(relaxed, at)
    step = math.log(tau[1] / tau[0])
    A, e = _kernel(relaxed, at, tau)
    unweighted = LinearSpectrum(
        A * step, e * equilibrium, sample.measured, float(np.max(np.abs(sample.measured)))
    )
    start = _solved(search(unweighted.weighted(sample.weights)), sample.weights)
    again = lambda weights: [_solved(search(unweighted.weighted(weights[0]), start.whole), weights[0])]
    (solved,) = settled([sample], [start], again, start.theta.size)
    found, assessment = solved.whole, sample.assess(solved, solved.theta.size, level)
    quality = assessment.evidence
    if not found.converged:
        why = f"the search for the spectrum did not converge within {EVALUATIONS} evaluations"
        quality = dataclasses.replace(quality, refused=(*quality.refused, why))
    fields = vars(quality) | _spectrum(found, tau, quality.widening, level)
    return SpectrumFit(
        **fields, material=_prony(found, tau, step, nu), data=data, weights=sample.label, level=level,
        notes=(*data.notes, *sample.error(solved, assessment), *quality.doubts), curve=sample.curve(solved.kept),
    )  # fmt: skip


def _times(relaxed: bool, at: np.ndarray) -> np.ndarray:
    """Return the times of the spectrum (m,) [s]."""
    known = at[at > 0.0]
    ends = np.log10([known.min(), known.max()] if relaxed else [1.0 / known.max(), 1.0 / known.min()])
    count = max(int(PER_DECADE * (ends[1] - ends[0] + 2.0 * BEYOND)), 8)
    return np.logspace(ends[0] - BEYOND, ends[1] + BEYOND, count)


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
    return Solved(np.zeros(p), found.residual, U[:, :p] * S[:p], np.ones(p, dtype=bool), on, w, whole=found)


def _spectrum(found: SpectrumOptimum, tau: np.ndarray, widening: float, level: float) -> dict[str, Any]:
    """Return the fields on the spectrum and its resolution."""
    cov, resolution = posterior_covariance(found)
    sd, place = np.sqrt(np.diag(cov)) * widening, np.log10(tau)
    weight = np.abs(resolution) + 1e-300
    weight /= weight.sum(1, keepdims=True)
    centre = weight @ place
    width = 2.355 * np.sqrt(
        np.maximum(weight @ place**2 - centre**2, 0.0)
    )  # at half height of a normal curve
    resolved = (sd < KNOWN) & (np.abs(centre - place) < SHIFTED)
    z = student.two_sided(level)
    with np.errstate(over="ignore"):
        H, low, high = np.exp(found.log), np.exp(found.log - z * sd), np.exp(found.log + z * sd)
    return {
        "tau": tau, "H": H, "low": low, "high": high, "resolved": resolved, "width": np.where(resolved, width, np.nan),
        "equilibrium": found.equilibrium, "smoothness": found.smoothness,
    }  # fmt: skip


def _prony(found: SpectrumOptimum, tau: np.ndarray, step: float, nu: float) -> jc.Prony:
    """Return the equivalent series of the spectrum."""
    series = MaxwellSeries.with_times(tau, found.equilibrium > 0.0)
    moduli = step * np.exp(found.log)
    values = np.append(found.equilibrium, moduli) if found.equilibrium > 0.0 else moduli
    return series.material(series.parameters(values), Volume("nu", nu))
