"""Laws that are no series of springs and dashpots, fitted to a creep curve or a modulus: fractional ones, in the coordinates
log G, log V and alpha, and materials of the user's own, in the logarithms of their parameters.

Creep of fractional laws

After a step of stress the strain is the exact J(t) of the law, up to alpha = 1, where a springpot is a dashpot. Under a
stress history that is linear between its knots, the strain of a power law is a sum of powers of the times since each
knot: with the jumps and slopes of the stress, and p_a(t) = t^a/Gamma(1 + a),

    strain = stress/G + 1/V sum_i (jump_i p_alpha(t - t_i) + slope_i (p_(1+alpha)(t - t_(i-1)) - p_(1+alpha)(t - t_i))).

For a Kelvin-Voigt law, or under a history of many knots, the strain is that of the Prony approximation of the law
(``jaxcontact.bodies.materials``), evaluated as in ``structure.py``, up to alpha = 0.98. The modes that are faster than
any gap of the data are represented by one fast retardation time, because a springpot has no strain at the instant of a
step.
"""

import abc
import dataclasses
import functools
import itertools
import math
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.data.creep import CreepData
from fitting.inference.result import Conclusion, FitProblem, conclude, least_squares
from fitting.inference.sample import Sample, Solved
from fitting.models import structure
from fitting.models.parameters import Parameters
from fitting.models.structure import (
    HELD,
    ORDERS,
    Compressibility,
    Law,
    OwnLaw,
    Sought,
    Structure,
    limits,
    over_span,
)
from fitting.search import nonlinear, varpro
from fitting.search.nonlinear import Objective, minimise

EXACT = 1e-8  # relative error of the Prony approximation used in the fit
EDGE = 16.0  # e-folds beyond the range of the data at which log G and log V are bounded
MOST = 4_000_000  # largest number of samples times knots for the sum of powers
FAST = 40.0  # rate of the unresolved modes, times the shortest gap of the data
STARTS = tuple(itertools.product((0.1, 0.3, 0.5, 0.7, 0.9), (0.1, 0.5, 0.9)))  # alpha, spring's share


class LawSearch(abc.ABC):
    """The search for a law on scaled data: one class for each kind of data, of fractional laws and of own materials."""

    @property
    @abc.abstractmethod
    def span(self) -> tuple[float, float]:
        """Shortest and longest times [s] of the data."""

    def bounded(self, sought: Sought) -> Sought:
        """Return the sought law, whose material is approximated over the times of the data."""
        return over_span(sought, self.span)

    @abc.abstractmethod
    def space(self, sought: Sought) -> Parameters:
        """Return the coordinates of the search with their bounds."""

    @abc.abstractmethod
    def starts(self, law: Law, weights: np.ndarray) -> list[np.ndarray]:
        """Return the coordinates (m,) from which the search begins; weights (n,) [1/unit of the data]: the first ones."""

    @abc.abstractmethod
    def objective(self, space: Parameters, weights: np.ndarray) -> Objective:
        """Return the least-squares objective over the coordinates (m,) for weights (n,) [1/unit of the data]."""

    def concluded(
        self, data: Any, sought: Sought, sample: Sample, duration: float, level: float,
        remarks: Callable[[Solved], tuple[str, ...]] = lambda solved: (),
    ) -> tuple[Solved, Conclusion]:  # fmt: skip
        """Return the optimum and the fit with all common fields; remarks: function of the optimum that returns notes."""
        sought = self.bounded(sought)
        law, space = sought.structure, self.space(sought)
        assert isinstance(law, Law)
        problem = FitProblem(data, sought, space, sample, duration, level)
        solved = least_squares(
            problem, functools.partial(self.objective, space), self.starts(law, sample.weights)
        )
        landscape = space.landscape(solved.theta, solved.search_result.objective.residual, relative=True)
        notes = (*law.notes, *remarks(solved))
        return solved, conclude(problem, solved._replace(notes=notes, landscape=landscape))


def law_rows(
    table: dict[str, tuple[float, float]], size: float, edge: float, times: tuple[float, float],
    alpha: tuple[float, float],
) -> dict[str, tuple[float, float]]:  # fmt: skip
    """Return the ranges of log G, log V and alpha, restricted to the bounds of the parameters.

    size: logarithm of a modulus of the data, about which G lies within ``edge`` e-folds, and V/time^alpha at each of the
    times, given by their logarithms.
    """
    first, last = times
    widest = {
        "G": (size - edge, size + edge),
        "V": (size - edge + min(first, 0.0), size + edge + max(last, 0.0)),
    }
    rows = {}
    for name, bounds in table.items():
        with np.errstate(divide="ignore"):
            low, high = bounds if name == "alpha" else map(float, np.log(bounds))
        least, most = alpha if name == "alpha" else widest[name]
        rows[name] = (low, high) if low == high else (max(least, low), min(most, high))
    return rows


def law_parameters(law: Structure, rows: dict[str, tuple[float, float]]) -> Parameters:
    """Return the coordinates log G, log V and alpha of a law within ``rows``."""
    names = tuple(law.where)
    by_log = np.array([name != "alpha" for name in names])
    hidden = functools.partial(_undetermined, names)
    return Parameters.of(law, [rows[name] for name in names], logarithmic=by_log, undetermined=hidden)


def _undetermined(names: tuple[str, ...], theta: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return which parameters (m, 1) bool are unidentifiable because alpha is at a bound, where the law is nearly a
    spring or a dashpot.

    V is unidentifiable where the interval of alpha reaches the bound, G also where the best value does.
    """
    alpha = names.index("alpha")
    found = bool(np.isin(theta[alpha], ORDERS))  # at alpha = 1 the law is classical with viscosity V
    reached = found or bool(np.any(np.isin(ends[alpha], ORDERS)))
    return np.array([[{"V": reached, "G": found, "alpha": False}[name]] for name in names])


@dataclasses.dataclass(frozen=True, eq=False)
class ScaledCreepCurve(LawSearch):
    """A padded creep curve scaled by its duration, largest response and largest stress.

    size: the largest response; decades: decades between the shortest gap and the end of the curve; n: number of points.
    """

    stressed: Any
    y: np.ndarray
    size: float
    compliance: float
    duration: float
    decades: int
    n: int

    @classmethod
    def of(cls, data: CreepData) -> "ScaledCreepCurve":
        """Return the scaled curve of the data."""
        size, duration = float(np.max(np.abs(data.response))), float(data.t[-1])
        stressed, stress = varpro.stress_history(data)
        times = np.append(0.0, data.t) if data.J is not None else np.sort(np.append(data.t, data.stress[0]))
        gaps = np.diff(times)
        decades = math.ceil(math.log10(duration / float(np.min(gaps[gaps > 0]))))
        y = nonlinear.repeated(data.response / size)
        return cls(stressed, y, size, size / stress, duration, max(decades, 1), data.t.size)

    @property
    def span(self) -> tuple[float, float]:
        """Shortest and longest times [s] that the data resolve."""
        return self.duration * 10.0**-self.decades, self.duration

    def space(self, sought: Sought) -> Parameters:
        """Return the search space with its bounds."""
        lapse = math.log(self.duration)
        highest = 1.0 if has_own_strain(sought.structure.model, self.stressed) else ORDERS[1]
        rows = law_rows(sought.table, -math.log(self.compliance), EDGE, (lapse, lapse), (ORDERS[0], highest))
        return law_parameters(sought.structure, rows)

    def objective(self, space: Parameters, weights: np.ndarray) -> Objective:
        """Return the least-squares objective over the coordinates (m,), for weights (n,) [1/unit of the response]."""
        inputs = self.stressed, self.compliance, math.log(self.duration)
        own, static = nonlinear.without_weight(weights * self.size), (space.structure.model, self.decades)
        return Objective.of(_response, inputs, self.y, own, space, points=slice(self.n), static=static)

    def starts(self, law: Law, weights: np.ndarray) -> list[np.ndarray]:
        """Return starting coordinates from pairs of alpha and the fraction of the largest response that is due to the
        spring."""
        pairs = STARTS if "G" in law.where else STARTS[:: len({share for _, share in STARTS})]
        return [self._start(law, alpha, share) for alpha, share in pairs]

    def _start(self, law: Law, alpha: float, share: float) -> np.ndarray:
        size, part = -math.log(self.compliance), 1.0
        G = size - math.log(share)
        if law.model is jc.FractionalMaxwell:
            part = 1.0 - share
        # the response reached is a fraction of the asymptotic one
        elif law.model is jc.FractionalKelvinVoigt:
            G = size + math.log(share)
        V = size - math.log(part) + alpha * math.log(self.duration) - math.lgamma(1.0 + alpha)
        return np.array([{"G": G, "V": V, "alpha": alpha}[name] for name in law.where])


def _response(theta: Array, inputs: tuple[Any, Array, Array], model: type, decades: int) -> Array:
    """Return the scaled response (n,) at coordinates (m,), of which the last two are log V and alpha; inputs: the stress,
    the unit of compliance and the logarithm of the duration."""
    (*spring, log_V, alpha), (stressed, compliance, lapse) = theta, inputs
    given = {"G": jnp.exp(spring[0]) * compliance} if spring else {}
    law = model(**given, V=jnp.exp(log_V - alpha * lapse) * compliance, alpha=alpha)
    return _strain(law, stressed, decades)


def has_own_strain(model: type, stressed: Any) -> bool:
    """Return whether the strain is computed exactly, without the Prony approximation, for every alpha up to 1."""
    if isinstance(stressed, structure.Step):
        return True
    return model is not jc.FractionalKelvinVoigt and stressed.pick.size * stressed.gap.size <= MOST


def _strain(law: Any, stressed: Any, decades: int) -> Array:
    """Return the strain (n,) under the scaled stress."""
    if isinstance(stressed, structure.Step):
        return law.creep(stressed.t)
    if has_own_strain(type(law), stressed):
        return law.creep(0.0) * stressed.stress[stressed.pick] + _powers(stressed, law.alpha) / law.V
    shortest = 10.0**-decades
    cut, at_once = law.prony(shortest, 1.0, EXACT), law.creep(0.0)
    rates = jnp.append(1.0 / cut.tau, FAST / shortest)
    parts = jnp.concatenate([jnp.stack([at_once]), cut.J, jnp.stack([cut.J0 - at_once, cut.fluidity])])
    return structure.columns(stressed, rates) @ parts


def _powers(stressed: structure.History, alpha: Array) -> Array:
    """Return the strain (n,) of a springpot of V = 1 under a stress history, by the formula in the module's docstring."""
    power = lambda t, order: jc.Springpot(V=1.0, alpha=order).creep(t)
    times = jnp.cumsum(stressed.gap)
    jump = stressed.stress - stressed.start - stressed.slope * stressed.gap
    since = times[stressed.pick][:, None] - times
    ramps = power(jnp.maximum(since + stressed.gap, 0.0), 1.0 + alpha) - power(
        jnp.maximum(since, 0.0), 1.0 + alpha
    )
    return power(jnp.maximum(since, 0.0), alpha) @ jump + ramps @ stressed.slope


# Fractional laws fitted to a modulus over time or frequency, in the coordinates log G, log V and alpha.
#
# The moduli are those of the materials (``jaxcontact/bodies/materials.py``), in closed form.


MODULUS_EDGE = 25.0  # e-folds beyond the range of the data at which log G and log V are bounded
MODULUS_STARTS = tuple(itertools.product((0.2, 0.5, 0.8), (0.0, 0.5, 1.0)))  # alpha, place of the transition


@dataclasses.dataclass(frozen=True, eq=False)
class Relaxed(LawSearch):
    """A modulus over times [s] or angular frequencies [rad/s] x (n,), G' followed by G'' of an oscillation.

    y (n,): the modulus over its largest value ``unit`` [Pa].
    """

    relaxed: bool
    x: np.ndarray
    y: np.ndarray
    unit: float

    @property
    def span(self) -> tuple[float, float]:
        """Shortest and longest time [s] of the data."""
        low, high = float(self.x.min()), float(self.x.max())
        return (low, high) if self.relaxed else (1.0 / high, 1.0 / low)

    def space(self, sought: Sought) -> Parameters:
        """Return the search space of log G, log V and alpha, in SI units."""
        first, last = np.log(self.span)
        alpha = ORDERS[0], ORDERS[1] if self.relaxed else 1.0
        rows = law_rows(sought.table, np.log(self.unit), MODULUS_EDGE, (first, last), alpha)
        return law_parameters(sought.structure, rows)

    def starts(self, law: Law, weights: np.ndarray) -> list[np.ndarray]:
        """Return starting coordinates from pairs of alpha and the place of the transition on the logarithmic time axis."""
        first, last = np.log(self.span)
        pairs = MODULUS_STARTS if "G" in law.where else MODULUS_STARTS[::3]
        return [self._start(law, alpha, first + place * (last - first)) for alpha, place in pairs]

    def _start(self, law: Law, alpha: float, log_tau: float) -> np.ndarray:
        """Return the coordinates of a law whose spring and springpot are equal at a time."""
        size = np.log(self.unit)
        if law.model is jc.FractionalKelvinVoigt:
            size = np.log(np.median(np.abs(self.y)) * self.unit)
        at = {"G": size, "V": size + alpha * log_tau, "alpha": alpha}
        return np.array([at[name] for name in law.where])

    def objective(self, space: Parameters, weights: np.ndarray) -> Objective:
        """Return the least-squares objective for weights (n,) [1/Pa]."""
        inputs, static = (self.x, np.log(self.unit)), (space.structure.model, self.relaxed)
        return Objective.of(_moduli, inputs, self.y, weights * self.unit, space, static=static)


def moduli(law: Any, x: Array, relaxed: bool) -> Array:
    """Return G(t) (1, n) of a law at times x [s], or G' and G'' (2, n) at angular frequencies x [rad/s]."""
    if relaxed:
        return law.relaxation(x)[None]
    found = law.complex_modulus(x)
    return jnp.stack([found.real, found.imag])


def _moduli(theta: Array, inputs: tuple[Array, Array], model: type, relaxed: bool) -> Array:
    """Return the scaled moduli (n,) at coordinates (m,), of which the last two are log V and alpha; inputs: times or
    frequencies, and the logarithm of the unit of the modulus."""
    (*spring, log_V, alpha), (x, log_unit) = theta, inputs
    values = {"V": jnp.exp(log_V - log_unit), "alpha": alpha}
    values |= {"G": jnp.exp(spring[0] - log_unit)} if spring else {}
    return moduli(model(**values), x if relaxed else x[: x.size // 2], relaxed).ravel()


# Materials of the user's own (``structure.OwnLaw``), fitted to a creep curve or a modulus in the logarithms of their
# parameters.
#
# The strain under a stress history that is linear between its knots is exact for the material's retardation spectrum
# (``fitting/models/structure.py``); moduli are its ``relaxation`` and ``complex_modulus``.
#
# A search begins at the given numbers, and at the ``BEST`` of ``TRIED`` places within ``DECADES`` of them; the lowest of
# the minima counts, and of equal ones that of the given numbers. Two elements of a kind are exchanged in it if the start
# does not tell them apart.

TRIED, BEST = 400, 8  # places at which the residuals are computed, and of these the starts of searches
EQUAL = 1e-6  # relative difference of the sums of squares of two minima that count as equal
DECADES = 3.0  # factor of a parameter at such a place over the given one, either way


class _OwnCoordinates(LawSearch):
    """The coordinates, bounds and starts of a material of one's own, the same for a creep curve and for a modulus."""

    def bounded(self, sought: Sought) -> Sought:
        """Return the sought material with its own Poisson's ratio or bulk modulus in the place of the default."""
        assert isinstance(sought.structure, OwnLaw)
        own = (getattr(sought.structure.start, name) for name in HELD)
        return sought._replace(
            volume=Compressibility.of(*(None if value is None else float(value) for value in own))
        )

    def space(self, sought: Sought) -> Parameters:
        """Return the logarithms of the parameters within their bounds, and within ``EDGE`` e-folds of the start."""
        assert isinstance(sought.structure, OwnLaw)
        rows = []
        for (low, high), start in zip(sought.table.values(), sought.structure.first, strict=True):
            low, high = math.log(low) if low > 0.0 else -math.inf, math.log(high)
            rows.append((low, high) if low == high else (max(low, start - EDGE), min(high, start + EDGE)))
        return Parameters.of(sought.structure, rows, logarithmic=True)

    def starts(self, law: Law, weights: np.ndarray) -> list[np.ndarray]:
        """Return the coordinates (m,) of the lowest minimum with the first weights, where the search begins."""
        assert isinstance(law, OwnLaw)
        objective = self.objective(self.space(Sought(law, limits(law, None, None), None)), weights)
        apart = math.log(10.0) * DECADES
        places = law.first + apart * np.random.default_rng(0).uniform(-1.0, 1.0, (TRIED, law.first.size))
        sizes = np.array([float(np.sum(objective.at(place) ** 2)) for place in places])
        best = places[np.argsort(np.where(np.isfinite(sizes), sizes, np.inf))[:BEST]]
        found = [minimise(objective, start) for start in (law.first, *best)]
        # of equal minima, such as those with two elements exchanged, that of the given numbers
        low = min(one.rss for one in found) * (1.0 + EQUAL) + objective.floor
        return [next(one for one in found if one.rss <= low).theta]


class OwnCreepCurve(_OwnCoordinates, ScaledCreepCurve):
    """A padded creep curve, scaled, for a material of one's own."""

    def objective(self, space: Parameters, weights: np.ndarray) -> Objective:
        """Return the least-squares objective over the coordinates (m,), for weights (n,) [1/unit of the response]."""
        assert isinstance(space.structure, OwnLaw)
        inputs = self.stressed, self.compliance, self.duration, space.structure.start
        own, static = nonlinear.without_weight(weights * self.size), (tuple(space.structure.where),)
        return Objective.of(_own_response, inputs, self.y, own, space, points=slice(self.n), static=static)


def _own_response(theta: Array, inputs: tuple[Any, Array, Array, Any], names: tuple[str, ...]) -> Array:
    """Return the scaled strain (n,): J0 E + sum_i J_i D(tau_i) + fluidity F of ``structure.columns``."""
    basis, compliance, duration, start = inputs
    spectrum = dataclasses.replace(start, **dict(zip(names, jnp.exp(theta), strict=True))).spectrum()
    rates = jnp.atleast_1d(spectrum.rates) * duration
    flow = 0.0 if spectrum.fluidity is None else spectrum.fluidity * duration
    parts = [jnp.stack([jnp.asarray(part, float)]) for part in (spectrum.instantaneous, flow)]
    amounts = jnp.concatenate([parts[0], jnp.atleast_1d(spectrum.amplitudes), parts[1]]) / compliance
    return structure.columns(basis, rates) @ amounts


class OwnModulus(_OwnCoordinates, Relaxed):
    """A modulus over times or angular frequencies, scaled, for a material of one's own."""

    def starts(self, law: Law, weights: np.ndarray) -> list[np.ndarray]:
        """Return the coordinates (m,) of the lowest minimum with relative errors, where the search begins."""
        return super().starts(law, 1.0 / (self.unit * np.maximum(np.abs(self.y), np.finfo(float).tiny)))

    def objective(self, space: Parameters, weights: np.ndarray) -> Objective:
        """Return the least-squares objective for weights (n,) [1/Pa]."""
        assert isinstance(space.structure, OwnLaw)
        inputs, names = (self.x, self.unit, space.structure.start), tuple(space.structure.where)
        static = names, self.relaxed
        return Objective.of(_own_moduli, inputs, self.y, weights * self.unit, space, static=static)


def _own_moduli(
    theta: Array, inputs: tuple[Array, Array, Any], names: tuple[str, ...], relaxed: bool
) -> Array:
    """Return the scaled moduli (n,), G' followed by G'' of an oscillation."""
    x, unit, start = inputs
    material = dataclasses.replace(start, **dict(zip(names, jnp.exp(theta), strict=True)))
    return moduli(material, x if relaxed else x[: x.size // 2], relaxed).ravel() / unit
