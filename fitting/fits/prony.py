"""Fit of a series of Kelvin-Voigt elements with given or automatically chosen retardation times: ``jc.Prony``.

    J(t) = J0 + sum_i J_i (1 - exp(-t/tau_i)) + fluidity t

is linear in the unknown compliances, which are all >= 0, so the fit is a bounded linear least-squares problem with one
optimum. Single elements of a series are often not identifiable although their sum is; the intervals show which.
"""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import Partial

import jaxcontact as jc
from fitting.data.creep import CreepData
from fitting.data.moduli import OscillationData, RelaxationData
from fitting.data.weights import nonnegative
from fitting.fits.creep import creep_sample
from fitting.fits.modulus import ModulusFit, alike, weighted_sample
from fitting.inference.result import Fit, FitProblem, conclude, least_squares
from fitting.inference.sample import Sample, Solved
from fitting.models.parameters import Landscape, Parameters
from fitting.models.structure import History, ParameterList, Sought, Step, columns, given_times, merge, series
from fitting.search.nonlinear import Objective
from jaxcontact.bodies.materials import Spectrum, from_relaxation

# Parts common to the fits of a series of given times, which are linear in values >= 0.


PER_DECADE = 3  # largest number of automatically chosen times per decade


def space_of(sought: Sought, columns: np.ndarray) -> Parameters:
    """Return the search space of the values, each scaled so that its weighted response (n,) of columns has norm one."""
    norms = np.linalg.norm(columns, axis=0)
    unit = 1.0 / np.where(norms > 0.0, norms, 1.0)
    box = sought.structure.box(sought.table) / unit[:, None]
    open_sides = np.stack([box[:, 0] == 0.0, np.isinf(box[:, 1])], -1)
    return Parameters.of(sought.structure, box, unit=unit, open=open_sides)


def objective(A: np.ndarray, y: np.ndarray, space: Parameters) -> Objective:
    """Return the least-squares objective |A x - y|^2 for x >= 0."""
    return Objective(
        lambda x: A @ x - y, lambda x, free: A[:, free], *space.bounds, floor=1e-26 * float(y @ y)
    )


def chosen_times(
    span: tuple[float, float], most: int, columns: Callable[[np.ndarray], np.ndarray], sample: Sample
) -> np.ndarray:
    """Return the times (k,) [s] of lowest BIC for k = 1, 2, ..., counting only nonzero values as parameters.

    span: shortest and longest time [s] of the data; most: largest k by the number of points; columns(tau) (n, m): response
    to each value set to one.
    """
    first, last = span
    most = int(np.clip(PER_DECADE * np.log10(last / first), 1, most))
    y, found = sample.weights * sample.measured, []
    for k in range(1, most + 1):
        tau = first * (last / first) ** ((np.arange(k) + 0.5) / k)
        A = sample.weights[:, None] * columns(tau)
        size = np.linalg.norm(A, axis=0)
        x = nonnegative(A / size, y)
        residual = float(np.linalg.norm(A / size @ x - y))
        misfit = residual**2 if sample.known else y.size * np.log(max(residual**2, 1e-26 * float(y @ y)))
        found.append((misfit + np.sum(x > 0) * np.log(y.size), tau))
    return min(found, key=lambda one: one[0])[1]


def landscape(space: Parameters, solved: Solved, A: np.ndarray, y: np.ndarray) -> Landscape:
    """Return the residuals as a function of the values, each scaled so that it alone gives a response of the norm of y
    (n,)."""
    free, y, J = space.upper > space.lower, solved.weights * y, solved.weights[:, None] * A
    unit = np.linalg.norm(y) / np.where(free, np.linalg.norm(J, axis=0), np.linalg.norm(y))
    box = np.where(free[:, None], [0.0, np.inf], 0.0)
    return Landscape(Partial(_residual, J * unit, y), solved.theta * space.unit / unit, box, unit)


def _residual(A: Array, y: Array, values: Any) -> Array:
    return A @ values - y


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
    # the response to each compliance set to one, zero for compliances that are not fitted
    fitted = np.isin(np.arange(sought.structure.size), list(sought.structure.where.values()))
    A = np.where(fitted, _columns(data, sought.structure.tau), 0.0)
    space = space_of(sought, sample.weights[:, None] * A)
    problem = FitProblem(data, sought, space, sample, float(data.t[-1]), level)
    of = lambda weights: objective(weights[:, None] * A * space.unit, weights * data.response, space)
    solved = least_squares(problem, of, [np.zeros(space.unit.size)])
    kept = landscape(space, solved, A, data.response)
    return conclude(problem, solved._replace(notes=notes, landscape=kept)).fit(PronyFit)


def _columns(data: CreepData, tau: Any) -> np.ndarray:
    """Return the response (n, k + 2) to a unit instantaneous compliance, to a unit compliance at each time, and to a
    unit fluidity."""
    return np.asarray(columns(_basis(data), 1.0 / tau))


def _basis(data: CreepData) -> Step | History:
    """Return the stress history of the test: a unit step, or the measured stress."""
    return Step(data.t) if data.J is not None else merge(data.t, *data.stress)


# Generalised Maxwell model: a relaxation modulus as a series of given times, and its creep compliance.
#
#     G(t) = Ge + sum_i G_i exp(-t/tau_i),     G*(omega) = Ge + sum_i G_i i omega tau_i/(1 + i omega tau_i)
#
# The equivalent compliances are those of ``jaxcontact.bodies.materials.from_relaxation``. Source: N. W. Tschoegl, The
# Phenomenological Theory of Linear Viscoelastic Behavior, 1989, secs. 3.5 and 8.1 (the models and their equivalence).


@dataclasses.dataclass(frozen=True, eq=False)
class MaxwellSeries(ParameterList):
    """The moduli Ge, G1 .. Gk of given relaxation times ``tau`` (k,) [s] as a list; the material is a ``jc.Prony``."""

    @classmethod
    def with_times(cls, tau: Any, equilibrium: bool) -> "MaxwellSeries":
        """Return the structure with times (k,) [s], with or without Ge; ValueError unless they are > 0."""
        tau = given_times(tau)
        names = (["Ge"] if equilibrium else []) + [f"G{i + 1}" for i in range(tau.size)]
        found = cls.of(jc.Prony, dict.fromkeys(names, "Pa"))
        return dataclasses.replace(found, tau=tau)

    @property
    def rates(self) -> np.ndarray:
        """Relaxation rates 1/tau (k,) [1/s]."""
        assert self.tau is not None
        return 1.0 / self.tau

    @property
    def solid(self) -> bool:
        """True if there is an equilibrium modulus."""
        return "Ge" in self.where

    def times(self, values: np.ndarray) -> Any:
        """Return the relaxation times (k,) [s]."""
        return self.tau

    def moduli(self, values: Array) -> tuple[Any, Array]:
        """Return Ge () and G (k,) of the list."""
        return (values[0], values[1:]) if self.solid else (0.0, values)

    def relaxation(self, values: Array, t: Array) -> Array:
        """Return G(t) at times t of any shape."""
        Ge, G = self.moduli(values)
        return Ge + jnp.exp(-t[..., None] * self.rates) @ G

    def complex_modulus(self, values: Array, omega: Array) -> Array:
        """Return G' + i G'' at angular frequencies omega of any shape."""
        Ge, G = self.moduli(values)
        s = 1j * omega[..., None] / self.rates
        return Ge + (s / (1.0 + s)) @ G

    def compliances(self, values: Array) -> Spectrum:
        """Return the equivalent compliances, k retarded ones and a fluidity."""
        Ge, G = self.moduli(values)
        return from_relaxation(Ge, G[::-1], jnp.asarray(self.rates[::-1]))

    def material(self, values: dict[str, Any], volume: Any) -> jc.Prony:
        """Return the equivalent series of retardation times."""
        c = self.compliances(jnp.stack([jnp.asarray(values[name], dtype=float) for name in self.where]))
        return jc.Prony(
            J0=c.instantaneous, J=c.amplitudes, tau=1.0 / c.rates, fluidity=c.fluidity, **volume.keyword
        )


# Fit of a generalised Maxwell model with given or automatically chosen relaxation times to a modulus.
#
# The model is linear in its moduli, which are all >= 0, so the fit is a bounded linear least-squares problem with one
# optimum, as that of a creep curve above.


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
    columns = lambda tau: _maxwell_columns(relaxed, at, MaxwellSeries.with_times(tau, equilibrium))
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


def _maxwell_columns(relaxed: bool, at: np.ndarray, series: MaxwellSeries) -> np.ndarray:
    """Return the response (n, m) to each modulus set to one, G' followed by G'' over frequency."""
    each = np.eye(series.size)
    if relaxed:
        return np.stack([np.asarray(series.relaxation(one, at)) for one in each], -1)
    found = np.stack([np.asarray(series.complex_modulus(one, at)) for one in each], -1)
    return np.concatenate([found.real, found.imag])
