"""Laws that are no series of springs and dashpots, fitted to a creep curve or a modulus: fractional ones, in the coordinates
log G, log V and alpha, and materials of the user's own, in the logarithms of their parameters.

Creep of fractional laws

After a step of stress the strain is the exact J(t) of the law, up to alpha = 1, where a springpot is a dashpot. Under a
stress history that is linear between its knots, the strain of a power law is a sum of powers of the times since each
knot: with the jumps and slopes of the stress, and p_a(t) = t^a/Gamma(1 + a),

    strain = stress/G + 1/V sum_i (jump_i p_alpha(t - t_i) + slope_i (p_(1+alpha)(t - t_(i-1)) - p_(1+alpha)(t - t_i))).

For a Kelvin-Voigt law, or under a history of many knots, the strain is that of the Prony approximation of the law
(``jaxcontact.bodies.materials``), evaluated as in ``history.py``, up to alpha = 0.98. The modes that are faster than
any gap of the data are represented by one fast retardation time, because a springpot has no strain at the instant of a
step.
"""

import abc
import dataclasses
import functools
import itertools
import math
from typing import Any, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.data.curves import CreepData
from fitting.models import history
from fitting.models.parameters import Parameters
from fitting.models.structure import (
    Compressibility,
    ParameterList,
    Sought,
    Structure,
    by_name,
    limits,
    resolve,
)
from fitting.search import nonlinear, varpro
from fitting.search.nonlinear import Objective, minimise
from jaxcontact.bodies.materials import Material

LAWS = {law.__name__: law for law in (jc.Springpot, jc.FractionalKelvinVoigt, jc.FractionalMaxwell)}
EXACT = 1e-8  # relative error of the Prony approximation used in the fit
CUT = 1e-5  # relative error of the Prony approximation that is returned
EDGE = 16.0  # e-folds beyond the range of the data at which log G and log V are bounded
ORDERS = (0.02, 0.98)  # bounds of alpha of a Prony approximation
MOST = 4_000_000  # largest number of samples times knots for the sum of powers
OFF = 60  # number of times at which two laws are compared
FAST = 40.0  # rate of the unresolved modes, times the shortest gap of the data
STARTS = tuple(itertools.product((0.1, 0.3, 0.5, 0.7, 0.9), (0.1, 0.5, 0.9)))  # alpha, spring's share

UNITS = {"G": "Pa", "V": "Pa s^alpha", "alpha": ""}


@dataclasses.dataclass(frozen=True, eq=False)
class Law(ParameterList):
    """A fractional material as the list of its parameters; it is approximated by a Prony series over the times ``span``
    [s]."""

    span: tuple[float, float] = (1.0, 1.0)

    def compliances(self, values: Array) -> Any:
        """Return the law itself, which provides ``creep``."""
        return self.model(**self.parameters(values))

    def material(self, values: dict[str, Any], volume: Any) -> jc.Prony:
        """Return the Prony approximation of the law, for the solver."""
        law = self.model(**values, **volume.keyword)
        if self.model is not jc.FractionalKelvinVoigt or values["alpha"] <= ORDERS[1]:
            return law.prony(*self.span, CUT)
        element = jc.Prony(
            J0=0.0,
            J=np.array([1.0 / law.G]),
            tau=np.array([(law.V / law.G) ** (1.0 / law.alpha)]),
            **volume.keyword,
        )
        lower = dataclasses.replace(law, alpha=ORDERS[1]).prony(*self.span, CUT)
        return min((element, lower), key=lambda material: self._off(law, material))

    def _off(self, law: Any, material: jc.Prony) -> float:
        """Return the largest relative difference of J(t) within the span."""
        t = np.geomspace(*self.span, OFF)
        return float(np.max(np.abs(np.asarray(material.creep(t)) / np.asarray(law.creep(t)) - 1.0)))

    @property
    def notes(self) -> tuple[str, ...]:
        """Note on the range of validity of the returned material."""
        low, high = self.span
        return (
            f"material: the law approximated by a Prony series, J(t) to {CUT:g} from {low:.4g} to {high:.4g} s",
        )


def creep_structure(model: Any, data: Any = None) -> Structure:
    """Return the structure of a classical or fractional material, given as a class or by name, or, for measured data, of an
    instance of any material (``own_structure``)."""
    if data is not None and isinstance(model, Material):
        return own_structure(model, data)
    law = by_name(model, LAWS.values()) if isinstance(model, str) else model
    if law not in LAWS.values():
        return resolve(model, also=tuple(LAWS))
    assert isinstance(law, type)
    own = [field.name for field in dataclasses.fields(law)]
    return Law.of(law, {name: UNITS[name] for name in own if name in UNITS})


def orders(table: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """Return the parameter bounds with those of alpha limited to 1; ValueError where the interval becomes empty."""
    low, high = table["alpha"]
    if (low < high and low >= 1.0) or (low == high and not ORDERS[0] <= low <= 1.0):
        raise ValueError(f"alpha: expected between 0 and 1, and {ORDERS[0]} to 1 if fixed, got {low:g}")
    return table | {"alpha": (low, min(high, 1.0))}


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


class _OverSpan(abc.ABC):
    """The search for a fractional law over the times that its data resolve, the same for a creep curve and for a modulus."""

    @property
    @abc.abstractmethod
    def span(self) -> tuple[float, float]:
        """Shortest and longest time [s] of the data."""

    def bounded(self, sought: Sought) -> Sought:
        """Return the sought law with bounds of alpha, its material approximated over the times of the data."""
        assert isinstance(sought.structure, Law)
        law = dataclasses.replace(sought.structure, span=self.span)
        return sought._replace(structure=law, table=orders(sought.table))


@dataclasses.dataclass(frozen=True, eq=False)
class ScaledCreepCurve(_OverSpan):
    """A padded creep curve scaled by its duration, largest response and largest stress.

    decades: decades between the shortest gap and the end of the curve; n: number of points.
    """

    stressed: Any
    y: np.ndarray
    weight: np.ndarray
    compliance: float
    duration: float
    decades: int
    n: int

    @classmethod
    def of(cls, data: CreepData, weight: np.ndarray) -> "ScaledCreepCurve":
        """Return the scaled curve of the data with weights (n,)."""
        size, duration = float(np.max(np.abs(data.response))), float(data.t[-1])
        stressed, stress = varpro.stress_history(data)
        times = np.append(0.0, data.t) if data.J is not None else np.sort(np.append(data.t, data.stress[0]))
        gaps = np.diff(times)
        decades = math.ceil(math.log10(duration / float(np.min(gaps[gaps > 0]))))
        y, weight = nonlinear.repeated(data.response / size), nonlinear.without_weight(weight * size)
        return cls(stressed, y, weight, size / stress, duration, max(decades, 1), data.t.size)

    @property
    def span(self) -> tuple[float, float]:
        """Shortest and longest times [s] that the data resolve."""
        return self.duration * 10.0**-self.decades, self.duration

    def space(self, sought: Sought) -> Parameters:
        """Return the search space with its bounds."""
        size, lapse = -math.log(self.compliance), math.log(self.duration)
        V = (size - EDGE + min(lapse, 0.0), size + EDGE + max(lapse, 0.0))
        highest = self.highest(sought.structure.model)
        whole = {"G": (size - EDGE, size + EDGE), "V": V, "alpha": (ORDERS[0], highest)}
        rows = {name: within(whole[name], name, bounds) for name, bounds in sought.table.items()}
        return law_parameters(sought.structure, rows)

    def objective(self, space: Parameters) -> Objective:
        """Return the least-squares objective over the coordinates (m,)."""
        inputs = self.stressed, self.compliance, math.log(self.duration)
        static = space.structure.model, self.decades
        return Objective.of(
            _response, inputs, self.y, self.weight, space, points=slice(self.n), static=static
        )

    def highest(self, model: type) -> float:
        """Return the upper bound of alpha in the search."""
        return 1.0 if has_own_strain(model, self.stressed) else ORDERS[1]

    def starts(self, law: Law) -> list[np.ndarray]:
        """Return starting coordinates from pairs of alpha and the fraction of the largest response that is due to the
        spring."""
        pairs = STARTS if "G" in law.where else STARTS[:: len({share for _, share in STARTS})]
        return [self._start(law, alpha, share) for alpha, share in pairs]

    def _start(self, law: Law, alpha: float, share: float) -> np.ndarray:
        size, part = -math.log(self.compliance), 1.0
        G = size - math.log(share)
        if law.model is jc.FractionalMaxwell:
            part = 1.0 - share
        elif (
            law.model is jc.FractionalKelvinVoigt
        ):  # the response reached is a fraction of the asymptotic one
            G = size + math.log(share)
        V = size - math.log(part) + alpha * math.log(self.duration) - math.lgamma(1.0 + alpha)
        return np.array([{"G": G, "V": V, "alpha": alpha}[name] for name in law.where])


def within(whole: tuple[float, float], name: str, bounds: tuple[float, float]) -> tuple[float, float]:
    """Return the range of a coordinate restricted to the bounds of its parameter."""
    with np.errstate(divide="ignore"):
        low, high = bounds if name == "alpha" else map(float, np.log(bounds))
    return (low, high) if low == high else (max(whole[0], low), min(whole[1], high))


def _response(theta: Array, inputs: tuple[Any, Array, Array], model: type, decades: int) -> Array:
    """Return the scaled response (n,) at coordinates (m,), of which the last two are log V and alpha; inputs: the stress,
    the unit of compliance and the logarithm of the duration."""
    (*spring, log_V, alpha), (stressed, compliance, lapse) = theta, inputs
    given = {"G": jnp.exp(spring[0]) * compliance} if spring else {}
    law = model(**given, V=jnp.exp(log_V - alpha * lapse) * compliance, alpha=alpha)
    return _strain(law, stressed, decades)


def has_own_strain(model: type, stressed: Any) -> bool:
    """Return whether the strain is computed exactly, without the Prony approximation, for every alpha up to 1."""
    if isinstance(stressed, history.Step):
        return True
    return model is not jc.FractionalKelvinVoigt and stressed.pick.size * stressed.gap.size <= MOST


def _strain(law: Any, stressed: Any, decades: int) -> Array:
    """Return the strain (n,) under the scaled stress."""
    if isinstance(stressed, history.Step):
        return law.creep(stressed.t)
    if has_own_strain(type(law), stressed):
        return law.creep(0.0) * stressed.stress[stressed.pick] + _powers(stressed, law.alpha) / law.V
    shortest = 10.0**-decades
    cut, at_once = law.prony(shortest, 1.0, EXACT), law.creep(0.0)
    rates = jnp.append(1.0 / cut.tau, FAST / shortest)
    parts = jnp.concatenate([jnp.stack([at_once]), cut.J, jnp.stack([cut.J0 - at_once, cut.fluidity])])
    return history.columns(stressed, rates) @ parts


def _powers(stressed: history.History, alpha: Array) -> Array:
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
class Relaxed(_OverSpan):
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
        size, (first, last) = np.log(self.unit), np.log(self.span)
        reach = (size - MODULUS_EDGE + min(first, 0.0), size + MODULUS_EDGE + max(last, 0.0))
        whole = {"G": (size - MODULUS_EDGE, size + MODULUS_EDGE), "V": reach, "alpha": (ORDERS[0], 1.0)}
        whole["alpha"] = (ORDERS[0], ORDERS[1] if self.relaxed else 1.0)
        rows = {name: within(whole[name], name, bounds) for name, bounds in sought.table.items()}
        return law_parameters(sought.structure, rows)

    def starts(self, law: Law) -> list[np.ndarray]:
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
        """Return the least-squares objective for weights (n,) of y."""
        inputs, static = (self.x, np.log(self.unit)), (space.structure.model, self.relaxed)
        return Objective.of(_moduli, inputs, self.y, weights, space, static=static)


def modulus(model: type, values: dict, x: Array, relaxed: bool) -> Array:
    """Return G(t) (1, n) at times x [s], or G' and G'' (2, n) at angular frequencies x [rad/s]."""
    law = model(**values)
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
    once = x if relaxed else x[: x.size // 2]
    return modulus(model, values, once, relaxed).ravel()


# Materials of the user's own, fitted to a creep curve or a modulus in the logarithms of their parameters.
#
# The material is a subclass of ``jaxcontact.abc.Material``. An instance is given in place of a model: its numbers are the
# start of the search, and what is not fitted (nu or a bulk modulus) is kept. All its other fields are numbers > 0. The
# strain under a stress history that is linear between its knots is exact for the material's retardation spectrum
# (``fitting/models/history.py``); moduli are its ``relaxation`` and ``complex_modulus``.
#
# A search begins at the given numbers, and at the ``BEST`` of ``TRIED`` places within ``DECADES`` of them; the lowest of
# the minima counts, and of equal ones that of the given numbers. Two elements of a kind are exchanged in it if the start
# does not tell them apart.

TRIED, BEST = 400, 8  # places at which the residuals are computed, and of these the starts of searches
EQUAL = 1e-6  # relative difference of the sums of squares of two minima that count as equal
DECADES = 3.0  # factor of a parameter at such a place over the given one, either way
HELD = ("nu", "bulk_modulus")
# the names that materials of jaxcontact have (``Material.shifted``), by their first letters, with units
OWN_UNITS = {"fluidity": "1/(Pa s)", "eta": "Pa s", "tau": "s", "G": "Pa", "J": "1/Pa"}


@dataclasses.dataclass(frozen=True, eq=False)
class OwnLaw(Law):
    """A material of one's own as the list of its parameters; start: the material at which the search begins."""

    start: Any = None

    @classmethod
    def of_material(cls, start: Material) -> Self:
        """Return the structure of a material; ValueError unless its parameters are numbers > 0."""
        fields = [field for field in dataclasses.fields(start) if not field.metadata.get("static")]  # type: ignore[arg-type]
        names = [field.name for field in fields if field.name not in HELD]
        for name in names:
            value = getattr(start, name)
            if np.ndim(value) != 0 or not (np.isreal(value) and 0.0 < float(value) < math.inf):
                raise ValueError(
                    f"model: expected numbers > 0 as the start of the search, got {name} = {value!r}"
                )
        if not names:
            raise ValueError(
                f"model: expected a material with parameters, got {type(start).__name__} without any"
            )
        dimensions = {
            name: next((unit for known, unit in OWN_UNITS.items() if name.startswith(known)), "")
            for name in names
        }
        where = {name: place for place, name in enumerate(names)}
        return cls(type(start), where, 0, None, dimensions=dimensions, start=start)

    def compliances(self, values: Array) -> Any:
        """Return the material, which provides ``creep``."""
        return self.material(self.parameters(values), None)

    def material(self, values: dict[str, Any], volume: Any) -> Any:
        """Return the material with these parameters and its own Poisson's ratio or bulk modulus."""
        return dataclasses.replace(self.start, **values)

    @property
    def notes(self) -> tuple[str, ...]:
        """None: the material is no approximation."""
        return ()

    @property
    def first(self) -> np.ndarray:
        """Logarithms (m,) of the start."""
        return np.log([float(getattr(self.start, name)) for name in self.where])


def own_structure(model: Material, data: Any) -> OwnLaw:
    """Return the structure of an instance of a material.

    ValueError where measured values were converted to shear with another Poisson's ratio than the material's, which would
    then not describe what was measured.
    """
    tensile = getattr(data, "nu", None)
    elastic = model.bulk_modulus is not None or model.nu is None
    if tensile is not None and (elastic or float(model.nu) != float(tensile)):
        own = "a bulk modulus" if elastic else f"nu = {float(model.nu):g}"
        raise ValueError(
            f"model: expected a material of nu = {tensile:g}, that of the data in tension, got {own}"
        )
    return OwnLaw.of_material(model)


class _OwnCoordinates:
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

    def starts(self, law: Any) -> list[np.ndarray]:
        """Return the coordinates (m,) of the lowest minimum with the first weights, where the search begins."""
        objective = self.objective(self.space(Sought(law, limits(law, None, None), None)))  # type: ignore[attr-defined]
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

    def objective(self, space: Parameters) -> Objective:
        """Return the least-squares objective over the coordinates (m,)."""
        assert isinstance(space.structure, OwnLaw)
        inputs = self.stressed, self.compliance, self.duration, space.structure.start
        names = tuple(space.structure.where)
        return Objective.of(
            _own_response, inputs, self.y, self.weight, space, points=slice(self.n), static=(names,)
        )


def _own_response(theta: Array, inputs: tuple[Any, Array, Array, Any], names: tuple[str, ...]) -> Array:
    """Return the scaled strain (n,): J0 E + sum_i J_i D(tau_i) + fluidity F of ``history.columns``."""
    basis, compliance, duration, start = inputs
    spectrum = dataclasses.replace(start, **dict(zip(names, jnp.exp(theta), strict=True))).spectrum()
    rates = jnp.atleast_1d(spectrum.rates) * duration
    flow = 0.0 if spectrum.fluidity is None else spectrum.fluidity * duration
    parts = [jnp.stack([jnp.asarray(part, float)]) for part in (spectrum.instantaneous, flow)]
    amounts = jnp.concatenate([parts[0], jnp.atleast_1d(spectrum.amplitudes), parts[1]]) / compliance
    return history.columns(basis, rates) @ amounts


class OwnModulus(_OwnCoordinates, Relaxed):
    """A modulus over times or angular frequencies, scaled, for a material of one's own."""

    def objective(self, space: Parameters, weights: np.ndarray | None = None) -> Objective:
        """Return the least-squares objective for weights (n,) of y, by default its reciprocals."""
        assert isinstance(space.structure, OwnLaw)
        weights = 1.0 / np.maximum(np.abs(self.y), np.finfo(float).tiny) if weights is None else weights
        inputs = self.x, self.unit, space.structure.start
        names = tuple(space.structure.where)
        return Objective.of(_own_moduli, inputs, self.y, weights, space, static=(names, self.relaxed))


def _own_moduli(
    theta: Array, inputs: tuple[Array, Array, Any], names: tuple[str, ...], relaxed: bool
) -> Array:
    """Return the scaled moduli (n,), G' followed by G'' of an oscillation."""
    x, unit, start = inputs
    material = dataclasses.replace(start, **dict(zip(names, jnp.exp(theta), strict=True)))
    if relaxed:
        return material.relaxation(x) / unit
    found = material.complex_modulus(x[: x.size // 2]) / unit
    return jnp.concatenate([found.real, found.imag])
