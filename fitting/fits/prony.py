"""Fit of a series of Kelvin-Voigt elements with given or chosen retardation times: ``jc.Prony``.

    J(t) = J0 + sum_i J_i (1 - exp(-t/tau_i)) + fluidity t

is linear in what is sought, and everything is >= 0: a bounded linear least squares with one optimum.
Single elements of a series are often not determined although their sum is; the intervals say which.
"""

import dataclasses
from typing import Any

import numpy as np
import scipy
from jax import Array
from jax.tree_util import Partial

from fitting.data.curves import CreepData
from fitting.fits.creep import fit_weights, measured_curve
from fitting.inference import evidence
from fitting.inference.estimating import off_bounds, settled
from fitting.inference.evidence import Sample
from fitting.inference.result import Estimate, Fit, Landscape, findings
from fitting.models import history
from fitting.models.structure import Volume, limits, series
from fitting.search import nonlinear, profiles
from fitting.search.uncertainty import covariance, log_covariance

PER_DECADE = 3  # retardation times at most, where they are chosen


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PronyFit(Fit):
    """The fit of a ``jc.Prony`` with given times, which has what every ``Fit`` has.

    Its parameters are "J0", "J1" .. [1/Pa] and "fluidity" [1/(Pa s)], those that were sought; ``tau`` (k,)
    are the times.
    """


def fit_prony(
    data: CreepData, tau: Any = None, *, weights: str | None = None, sigma: Any = None, instantaneous: bool = True,
    flow: bool = True, nu: float = 0.3, level: float = 0.95,
) -> PronyFit:  # fmt: skip
    """Fit a series of retardation times to a creep curve; one optimum, no start is needed.

    Args:
        data: the curve, n points.
        tau: retardation times (k,) [s]; None: times evenly spaced in their logarithm over those of the data, as many
            as the lowest BIC asks for (at most three a decade), which a note says.
        weights: as in ``fit_creep``, but that no point is left out; or
        sigma: the standard deviation, a number or (n,) [unit of the data], taken as known.
        instantaneous: whether J0 is sought; else it is 0.
        flow: whether the fluidity is sought; else it is 0.
        nu: Poisson's ratio to carry along.
        level: of the intervals.

    Returns:
        The series with its intervals: of single elements, which are often not determined, and of J(t).

    Raises:
        ValueError: times that are not > 0, two choices of weights, or too few points.

    Example:
        >>> t = np.linspace(0.0, 10.0, 21)
        >>> data = fitting.CreepData(t=t, J=1e-6 * (2.0 - np.exp(-t / 3.0)))
        >>> fit = fitting.fit_prony(data, tau=[1.0, 3.0], weights="relative")
        >>> [f"{fit.values[name]:.3g}" for name in ("J0", "J2")]
        ['1e-06', '1e-06']
    """
    weight, label = fit_weights(data, weights, sigma)
    notes = data.notes
    if tau is None:
        tau = _chosen(data, weight, label == "sigma", instantaneous, flow)
        notes = (*notes, f"{len(tau)} retardation times chosen by BIC, {tau[0]:.3g} to {tau[-1]:.3g} s")
    structure = series(tau, instantaneous, flow)
    table, places = limits(structure, None, None), sorted(structure.where.values())
    p = len(places)
    evidence.check(level, data.t.size, p)
    assert structure.tau is not None
    bare = _columns(data, np.ones(data.t.size), structure.tau)[:, places]
    scale = 1.0 / np.linalg.norm(weight[:, None] * bare, axis=0)
    of = lambda weights: _objective(weights[:, None] * bare * scale, weights * data.response)
    y, A = weight * data.response, weight[:, None] * bare * scale
    best = nonlinear.minimise(of(weight), np.maximum(np.linalg.lstsq(A, y, rcond=None)[0], 0.0))
    sample, best, objective = settled(Sample.of(data.t, data.response, weight, label), of, best)
    judged = evidence.judge(sample, best.residual, best.jacobian, off_bounds(objective, best), p, level)
    ends = profiles.profile(objective, best, judged.levels()) * scale[:, None]
    y, A = sample.weights * data.response, sample.weights[:, None] * bare
    found = _estimate(structure.size, places, best.theta * scale, ends, A, y, judged.slopes / scale)
    names = {place: name for name, place in structure.where.items()}
    fields = findings(structure, table, level, Volume.of(nu, None), judged, found, [names[i] for i in places])
    return PronyFit(
        **fields | {"notes": (*notes, *fields["notes"])}, data=data, weights=label, duration=float(data.t[-1]),
        curve=measured_curve(data),
    )  # fmt: skip


def _objective(A: np.ndarray, y: np.ndarray) -> nonlinear.Objective:
    """|A x - y|^2 for x >= 0."""
    p = A.shape[1]
    return nonlinear.Objective(
        lambda x: A @ x - y, lambda x, free: A[:, free], np.zeros(p), np.full(p, np.inf),
        floor=1e-26 * float(y @ y),
    )  # fmt: skip


def _chosen(data: CreepData, weight: np.ndarray, known: bool, instantaneous: bool, flow: bool) -> np.ndarray:
    """Retardation times (k,) [s] of lowest BIC, of the compliances that are not zero: of k = 1, 2, ..."""
    first, last = float(np.min(data.t[data.t > 0.0])), float(data.t[-1])
    most = int(np.clip(PER_DECADE * np.log10(last / first), 1, data.t.size // 4))
    y, found = weight * data.response, []
    for k in range(1, most + 1):
        tau = first * (last / first) ** ((np.arange(k) + 0.5) / k)
        taken = [0] * instantaneous + list(range(1, k + 1)) + [k + 1] * flow
        columns = _columns(data, weight, tau)[:, taken]
        size = np.linalg.norm(columns, axis=0)
        x, residual = scipy.optimize.nnls(columns / size, y)
        misfit = residual**2 if known else y.size * np.log(max(residual**2, 1e-26 * float(y @ y)))
        found.append((misfit + np.sum(x > 0) * np.log(y.size), tau))
    return min(found, key=lambda one: one[0])[1]


def _columns(data: CreepData, weight: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Weighted, of J0, of each time, and of the fluidity, (n, k + 2)."""
    return weight[:, None] * np.asarray(history.columns(_basis(data), 1.0 / tau))


def _basis(data: CreepData) -> history.Step | history.History:
    """A step of one, or the stress that was measured."""
    return history.Step(data.t) if data.J is not None else history.merge(data.t, *data.stress)


def _estimate(
    size: int, places: list[int], x: np.ndarray, ends: np.ndarray, A: np.ndarray, y: np.ndarray,
    slopes: np.ndarray,
) -> Estimate:  # fmt: skip
    """From the compliances sought, at ``places``, their columns A (n, p) and slopes (m, p); the others are zero."""
    best, spans, J, whitened = (
        np.zeros(size),
        np.zeros((size, 2)),
        np.zeros((len(A), size)),
        np.zeros((len(slopes), size)),
    )
    best[places], spans[places], J[:, places], whitened[:, places] = x, ends, A, slopes
    free = np.isin(np.arange(size), places)
    log = log_covariance(whitened * best, best > 0)
    unit = np.linalg.norm(y) / np.where(free, np.linalg.norm(J, axis=0), np.linalg.norm(y))  # alone is all
    box = np.where(free[:, None], [0.0, np.inf], 0.0)
    land = Landscape(Partial(_residual, J * unit, y), best / unit, box, unit)
    still = lambda name: np.zeros(size)
    return Estimate(best, best, spans, covariance(whitened, free), log, still, land)


def _residual(A: Array, y: Array, values: Array) -> Array:
    return A @ values - y
