"""Fit of a generalised Maxwell model with given or automatically chosen relaxation times to a modulus.

The model is linear in its moduli, which are all >= 0, so the fit is a bounded linear least-squares problem with one
optimum, as that of ``prony.py`` for a creep curve.
"""

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.data.moduli import OscillationData, RelaxationData
from fitting.fits.linear_series import chosen_times, landscape, objective, space_of
from fitting.fits.modulus import ModulusFit, alike, weighted_sample
from fitting.inference.conclusion import FitProblem, conclude, least_squares
from fitting.models.maxwell_series import MaxwellSeries
from fitting.models.structure import Sought

UNRELAXED = (
    "Ge is the modulus that has not relaxed within the data ({:.3g} s): whether it relaxes later the data do not show,"
    " and its interval does not include"
)
BEYOND = 10.0**0.5  # factor by which the range of chosen times exceeds that of the data at either end


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MaxwellFit(ModulusFit):
    """Result of the fit of a generalised Maxwell model; the attributes common to all fits are documented in ``Fit``.

    Its parameters are "Ge" and "G1", "G2" .. [Pa], of the relaxation times ``tau`` (k,) [s]; ``material`` is the equivalent
    ``jc.Prony``. The optimum is unique.
    """

    def _parts(self, values: Array, at: Array) -> Array:
        """Return G (1, k), or G' and G'' (2, k), of the list of moduli."""
        series = self.structure
        assert isinstance(series, MaxwellSeries)
        if self.relaxed:
            return series.relaxation(values, at)[None]
        found = series.complex_modulus(values, at)
        return jnp.stack([found.real, found.imag])

    def _conditions(self) -> list[str]:
        return []


def fit_maxwell(
    data: RelaxationData | OscillationData, tau: Any = None, *, weights: str | None = None, sigma: Any = None,
    equilibrium: bool = True, nu: float = 0.3, level: float = 0.95,
) -> MaxwellFit:  # fmt: skip
    """Fit a series of relaxation times to a relaxation modulus, or to storage and loss moduli over frequency.

        G(t) = Ge + sum_i G_i exp(-t/tau_i),     G*(omega) = Ge + sum_i G_i i omega tau_i/(1 + i omega tau_i)

    The optimum is unique and no initial guess is needed.

    Args:
        data: the modulus over time, or the moduli over frequency.
        tau: relaxation times (k,) [s]; None chooses times evenly spaced in their logarithm over the range of the data and
            half a decade beyond, in the number with the lowest BIC (at most three per decade), and records them in a note.
        weights: as in ``fit_relaxation`` ("estimated" by default) or ``fit_oscillation`` ("proportional" by default); or
        sigma: the known standard deviation [Pa], a number or (n,), or (2, n) as in ``fit_oscillation``.
        equilibrium: whether the equilibrium modulus Ge is fitted; otherwise it is 0 and the body flows. With chosen times
            Ge includes all parts that relax after the time range of the data, and its interval does not allow for that.
        nu: Poisson's ratio that the returned material is given.
        level: confidence level of the intervals.

    Returns:
        The moduli with their intervals, which are often not identifiable singly, and the equivalent ``jc.Prony``.

    Raises:
        ValueError: data of another type, times that are not > 0, two choices of weights, or too few points.

    Example:
        >>> t = np.linspace(0.0, 10.0, 21)
        >>> data = fitting.RelaxationData(t=t, modulus=1e6 * (1.0 + np.exp(-t / 3.0)))
        >>> fit = fitting.fit_maxwell(data, tau=[1.0, 3.0], weights="relative")
        >>> [f"{fit.values[name]:.3g}" for name in ("Ge", "G2")]
        ['1e+06', '1e+06']
    """
    if not isinstance(data, RelaxationData | OscillationData):
        raise ValueError(f"data: expected RelaxationData or OscillationData, got {type(data).__name__}")
    relaxed = isinstance(data, RelaxationData)
    if weights is None and sigma is None:
        weights = "estimated" if relaxed else "proportional"
    _, sample, duration = weighted_sample(data, weights, sigma)
    at = data.t if isinstance(data, RelaxationData) else data.omega
    columns = lambda tau: _columns(relaxed, at, MaxwellSeries.with_times(tau, equilibrium))
    notes: list[str] = []
    if tau is None:
        tau = chosen_times(_span(relaxed, at), sample.t.size // 4, columns, sample)
        notes = [f"{len(tau)} relaxation times chosen by BIC, {tau[0]:.3g} to {tau[-1]:.3g} s"]
    A = columns(tau)
    sought = Sought.of(MaxwellSeries.with_times(tau, equilibrium), None, None, nu)
    space = space_of(sought, sample.weights[:, None] * A)
    problem = FitProblem(data, sought, space, sample, duration, level)
    of = lambda weights: objective(weights[:, None] * A * space.unit, weights * sample.measured, space)
    solved = least_squares(problem, of, [np.zeros(space.unit.size)])
    if notes and equilibrium and solved.theta[0] > 0.0:
        notes.insert(0, UNRELAXED.format(_span(relaxed, at)[1] / BEYOND))
    notes[:0] = alike(data, solved)
    kept = landscape(space, solved, A, sample.measured)
    found = conclude(problem, solved._replace(notes=notes, landscape=kept))
    return found.fit(MaxwellFit, starts=(1, 1))


def _span(relaxed: bool, at: np.ndarray) -> tuple[float, float]:
    """Return the shortest and longest relaxation time [s] that times or angular frequencies show.

    They exceed the range of the data, because an element changes the modulus over more than a decade about its time.
    """
    known = at[at > 0.0]
    ends = float(known.min()), float(known.max())
    ends = ends if relaxed else (1.0 / ends[1], 1.0 / ends[0])
    return ends[0] / BEYOND, ends[1] * BEYOND


def _columns(relaxed: bool, at: np.ndarray, series: MaxwellSeries) -> np.ndarray:
    """Return the response (n, m) to each modulus set to one, G' followed by G'' over frequency."""
    each = np.eye(series.size)
    if relaxed:
        return np.stack([np.asarray(series.relaxation(one, at)) for one in each], -1)
    found = np.stack([np.asarray(series.complex_modulus(one, at)) for one in each], -1)
    return np.concatenate([found.real, found.imag])
