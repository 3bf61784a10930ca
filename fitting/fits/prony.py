"""Fit of a series of Kelvin-Voigt elements with given or automatically chosen retardation times: ``jc.Prony``.

    J(t) = J0 + sum_i J_i (1 - exp(-t/tau_i)) + fluidity t

is linear in the unknown compliances, which are all >= 0, so the fit is a bounded linear least-squares problem with one
optimum. Single elements of a series are often not identifiable although their sum is; the intervals show which.
"""

import dataclasses
from typing import Any

import numpy as np

from fitting.data.curves import CreepData
from fitting.fits.creep import creep_sample
from fitting.fits.linear_series import chosen_times, landscape, objective, space_of
from fitting.inference.conclusion import FitProblem, conclude, least_squares
from fitting.inference.result import Fit
from fitting.models import history
from fitting.models.structure import Sought, Structure, series


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PronyFit(Fit):
    """Result of the fit of a ``jc.Prony`` with given retardation times; the attributes are those of ``Fit``.

    Its parameters are those of "J0", "J1" .. [1/Pa] and "fluidity" [1/(Pa s)] that were fitted; ``tau`` (k,) holds the
    retardation times.
    """


def fit_prony(
    data: CreepData, tau: Any = None, *, weights: str | None = None, sigma: Any = None, instantaneous: bool = True,
    flow: bool = True, nu: float = 0.3, level: float = 0.95,
) -> PronyFit:  # fmt: skip
    """Fit a series of retardation times to a creep curve; the optimum is unique and no initial guess is needed.

    Args:
        data: the curve, n points.
        tau: retardation times (k,) [s]; None chooses times evenly spaced in their logarithm over the range of the data,
            in the number with the lowest BIC (at most three per decade), and records them in a note.
        weights: as in ``fit_creep``, except that no point is left out; or
        sigma: the known standard deviation, a number or (n,) [unit of the data].
        instantaneous: whether J0 is fitted; otherwise it is 0.
        flow: whether the fluidity is fitted; otherwise it is 0.
        nu: Poisson's ratio that the returned material is given.
        level: confidence level of the intervals.

    Returns:
        The series with the intervals of its elements, which are often not identifiable singly, and of J(t).

    Raises:
        ValueError: times that are not > 0, two choices of weights, or too few points.

    Example:
        >>> t = np.linspace(0.0, 10.0, 21)
        >>> data = fitting.CreepData(t=t, J=1e-6 * (2.0 - np.exp(-t / 3.0)))
        >>> fit = fitting.fit_prony(data, tau=[1.0, 3.0], weights="relative")
        >>> [f"{fit.values[name]:.3g}" for name in ("J0", "J2")]
        ['1e-06', '1e-06']
    """
    sample, notes = creep_sample(data, weights, sigma), []
    if tau is None:
        span = float(np.min(data.t[data.t > 0.0])), float(data.t[-1])
        columns = lambda tau: _columns(data, tau)[:, int(not instantaneous) : tau.size + 1 + flow]
        tau = chosen_times(span, data.t.size // 4, columns, sample)
        notes = [f"{len(tau)} retardation times chosen by BIC, {tau[0]:.3g} to {tau[-1]:.3g} s"]
    sought = Sought.of(series(tau, instantaneous, flow), None, None, nu)
    A = _sought_columns(data, sought.structure)
    space = space_of(sought, sample.weights[:, None] * A)
    problem = FitProblem(data, sought, space, sample, float(data.t[-1]), level)
    of = lambda weights: objective(weights[:, None] * A * space.unit, weights * data.response, space)
    solved = least_squares(problem, of, [np.zeros(space.unit.size)])
    kept = landscape(space, solved, A, data.response)
    return conclude(problem, solved._replace(notes=notes, landscape=kept)).fit(PronyFit)


def _sought_columns(data: CreepData, structure: Structure) -> np.ndarray:
    """Return the response (n, m) to each compliance set to one, zero for compliances that are not fitted."""
    sought = np.isin(np.arange(structure.size), list(structure.where.values()))
    return np.where(sought, _columns(data, structure.tau), 0.0)


def _columns(data: CreepData, tau: Any) -> np.ndarray:
    """Return the response (n, k + 2) to a unit instantaneous compliance, to a unit compliance at each time, and to a
    unit fluidity."""
    return np.asarray(history.columns(_basis(data), 1.0 / tau))


def _basis(data: CreepData) -> history.Step | history.History:
    """Return the stress history of the test: a unit step, or the measured stress."""
    return history.Step(data.t) if data.J is not None else history.merge(data.t, *data.stress)
