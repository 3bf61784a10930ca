"""Result of a fit: a material, and how well the data determine it."""

import dataclasses
import json
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fitting.data.curves import evaluation_times
from fitting.inference import noise
from fitting.inference.sample import Curve, Evidence
from fitting.models.parameters import Landscape
from fitting.models.structure import Structure
from fitting.search.nonlinear import LogCovariance
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
