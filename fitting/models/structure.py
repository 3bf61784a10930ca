"""Materials as lists of compliances, and the place of each parameter in the list.

    J(t) = j0 + sum_i j_i (1 - exp(-t/tau_i)) + f t,     q_i = j_i/tau_i

A fit represents a material by the list (j0, j_1 .. j_k, f, q_1 .. q_k), without the q where the retardation times are
given. Moduli and viscosities are reciprocals of compliances, so that an infinite one corresponds to a compliance of
zero; the parameters of ``jc.Prony`` are compliances themselves. The strain after a stress history is linear in the list,
strain = j0 E + sum_i j_i D(tau_i) + f F, with the columns

    E(t) = sigma(t),   D(t; tau) = int (1 - exp(-(t-s)/tau)) dsigma(s),   F(t) = int sigma ds,

which are 1, 1 - exp(-t/tau) and t for a unit step at t = 0. Between its knots the stress is linear, and a repeated time
marks a jump, so tau D' + D = sigma has a closed form over each segment and the Boltzmann integral is exact; it is evaluated
by a recursion over all knots and samples.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from typing import Any, Literal, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.views import text
from jaxcontact._support.exponential import ramps
from jaxcontact._support.pytree import require_real
from jaxcontact.bodies.materials import Material, Spectrum


class Step(NamedTuple):
    """A unit stress applied at t = 0; times t (n,)."""

    t: Array


class History(NamedTuple):
    """Merged knots and samples of a stress history.

    gap (m,): to the previous point; start (m,): stress just after the previous point; slope (m,): of the stress; stress
    (m,): at the point itself; integral (m,): of the stress; pick (n,): indices of the samples.
    """

    gap: Array
    start: Array
    slope: Array
    stress: Array
    integral: Array
    pick: Array


def columns(stressed: Step | History, rates: Array) -> Array:
    """Return [E, D(tau_1) .. D(tau_k), F], (n, k + 2), for rates 1/tau (k,)."""
    if isinstance(stressed, Step):
        t = jnp.asarray(stressed.t)[:, None]
        return jnp.concatenate([jnp.ones_like(t), -jnp.expm1(-t * rates), t], -1)
    parts = [stressed.stress[:, None], _delayed(stressed, rates), stressed.integral[:, None]]
    return jnp.concatenate(parts, -1)[stressed.pick]


def _delayed(stressed: History, rates: Array) -> Array:
    """Return D of tau D' + D = sigma, sigma = start + slope s over each gap, exactly; (m, k)."""
    ratio = stressed.gap[:, None] * rates
    held = stressed.start[:, None] * -jnp.expm1(-ratio)
    ramp = (stressed.slope * stressed.gap)[:, None] * ratio * ramps(ratio)[2]
    return recursion(jnp.exp(-ratio), held + ramp)


def recursion(decay: Array, forced: Array) -> Array:
    """Return y_i = decay_i y_(i-1) + forced_i along the first axis, y_(-1) = 0.

    The recursion is sequential: on a CPU this is less work, and compiles much faster, than an associative scan.
    """

    def step(y: Array, row: tuple[Array, Array]) -> tuple[Array, Array]:
        y = row[0] * y + row[1]
        return y, y

    return jax.lax.scan(step, jnp.zeros_like(forced[0]), (decay, forced))[1]


def merge(t: np.ndarray, knots: np.ndarray, values: np.ndarray) -> History:
    """Return the history at the samples t (n,) of the stress ``values`` at ``knots`` (both (k,)).

    Knots must not decrease; a repeated knot is a jump, at which a sample has the stress after it. The stress is zero
    before the first knot and constant after the last.
    """
    # the stress just after and just before the start, the knots and the samples; before a knot it is zero at the first one,
    # and the knot's own value if there is no jump
    times = np.concatenate([np.minimum(knots[:1], t[:1]), knots, t])
    jumps = np.concatenate([[True], np.diff(knots) == 0])
    before_knots = np.where(jumps, np.concatenate([[0.0], values[:-1]]), values)
    after = np.concatenate([np.zeros(1), values, _value_at(t, knots, values, "right")])
    before = np.concatenate([np.zeros(1), before_knots, _value_at(t, knots, values, "left")])
    order = np.argsort(times, kind="stable")
    times, after, before = times[order], after[order], before[order]
    gap = np.diff(times, prepend=times[0])
    start = np.concatenate([[0.0], after[:-1]])
    slope = np.where(gap > 0, (before - start) / np.where(gap > 0, gap, 1.0), 0.0)
    integral = np.cumsum(gap * 0.5 * (start + before) * (gap > 0))
    pick = np.argsort(order, kind="stable")[1 + len(knots) :]
    arrays = (jnp.asarray(a) for a in (gap, start, slope, after, integral, pick))
    return History(*arrays)


def _value_at(
    t: np.ndarray, knots: np.ndarray, values: np.ndarray, side: Literal["left", "right"]
) -> np.ndarray:
    """Return the stress just after t (side "right") or just before it (side "left")."""
    k = np.searchsorted(knots, t, side=side) - 1
    i, j = np.clip(k, 0, None), np.clip(k + 1, None, len(knots) - 1)
    width = knots[j] - knots[i]
    share = np.where(width > 0, (t - knots[i]) / np.where(width > 0, width, 1.0), 0.0)
    return np.where(k < 0, 0.0, values[i] + share * (values[j] - values[i]))


LEAST = 1e-9  # fraction of the largest compliance that replaces zero, where derivatives are needed


class Compressibility(NamedTuple):
    """The held parameter of the volumetric response: name "nu" or "bulk_modulus", and its value, () [Pa]."""

    name: str
    value: Any

    @classmethod
    def of(cls, nu: float | None, bulk_modulus: float | None) -> Compressibility:
        """Return the held parameter; ValueError unless exactly one of the two is given, within its range."""
        if (nu is None) == (bulk_modulus is None):
            raise ValueError(
                f"nu: expected exactly one of nu and bulk_modulus, got nu={nu}, bulk_modulus={bulk_modulus}"
            )
        name = "bulk_modulus" if nu is None else "nu"
        value: Any = bulk_modulus if nu is None else nu
        known = np.ndim(value) == 0 and np.asarray(value).dtype.kind in "fiu"
        if name == "nu" and not (known and -1.0 < value <= 0.5):
            raise ValueError(f"nu: expected -1 < nu <= 0.5, got {value!r}")
        if name == "bulk_modulus" and not (known and 0.0 < value < math.inf):
            raise ValueError(f"bulk_modulus: expected a number > 0 Pa, got {value!r}")
        return cls(name, value)

    @property
    def keyword(self) -> dict[str, Any]:
        """Keyword arguments of a material; the parameter that is not held is None."""
        return {"nu": None, "bulk_modulus": None, self.name: self.value}

    @property
    def one_minus_nu(self) -> Any:
        """1 - nu; with a bulk modulus that of an incompressible solid."""
        return 1.0 - self.value if self.name == "nu" else 0.5

    def __str__(self) -> str:
        unit = "" if self.name == "nu" else " Pa"
        return f"{self.name} = {self.value:.4g}{unit}"


@dataclasses.dataclass(frozen=True, eq=False)
class Structure:
    """A material class as a list of compliances.

    model: the class; where: {parameter: place in the list}; branches: k; tau (k,) [s]: the retardation times where they
    are given, and the parameters are compliances, else None.
    """

    model: type
    where: dict[str, int]
    branches: int
    tau: np.ndarray | None = None

    @property
    def flow(self) -> int:
        """Place of the fluidity in the list."""
        return 1 + self.branches

    @property
    def size(self) -> int:
        """Length of the list."""
        return 2 + self.branches * (2 if self.tau is None else 1)

    def units(self, compliance: float, time: float) -> np.ndarray:
        """Return the unit of each compliance, (size,), from one of compliance [1/Pa] and one of time [s]."""
        return np.where(np.arange(self.size) < self.flow, compliance, compliance / time)

    def off_zero(self, values: np.ndarray, time: float) -> np.ndarray:
        """Return a list of compliances with zeros replaced by small values, where the parameters are differentiable;
        time [s]."""
        unit = self.units(1.0, time)
        return np.maximum(values, LEAST * np.max(values / unit) * unit)

    def times(self, values: np.ndarray) -> float | np.ndarray:
        """Return the given retardation times (k,) [s], or that of a list of compliances; nan where there is none."""
        if self.tau is not None:
            return self.tau
        retarded, rise = values[1 : self.flow], values[self.flow + 1 :]
        if not np.any((retarded > 0) & (rise > 0)) or (np.isinf(retarded[0]) and np.isinf(rise[0])):
            return math.nan
        return float(retarded[0] / rise[0])

    def may_be_zero(self, name: str) -> bool:
        """Return whether a parameter may be held at 0; no parameter of a material may."""
        return False

    def unit(self, name: str) -> str:
        """Return the unit of a parameter."""
        if self.tau is not None:
            return "1/(Pa s)" if self.where[name] == self.flow else "1/Pa"
        return "Pa" if name.startswith("G") else "Pa s"

    def key(self, name: str) -> str:
        """Return a parameter's name with its unit, for files."""
        return text.key(name, self.unit(name))

    def compliances(self, values: Array) -> Spectrum:
        """Return the compliances of a list (size,); the rate is arbitrary where the retarded part is zero."""
        retarded = values[1 : self.flow]
        if self.tau is not None:
            return Spectrum(values[0], retarded, jnp.asarray(1.0 / self.tau), values[self.flow])
        some = retarded > 0
        rates = jnp.where(some, values[self.flow + 1 :] / jnp.where(some, retarded, 1.0), 1.0)
        return Spectrum(values[0], retarded, rates, values[self.flow])

    def parameters(self, compliances: Any) -> dict[str, Any]:
        """Return {parameter: value} of a list of compliances, which may be traced."""
        own = (lambda c: c) if self.tau is not None else reciprocal
        return {name: own(compliances[place]) for name, place in self.where.items()}

    def material(self, values: dict[str, Any], volume: Compressibility) -> Any:
        """Return the material with these parameters; parameters of a series that are not given are zero."""
        if self.tau is None:
            return self.model(**values, **volume.keyword)
        J = jnp.stack([jnp.asarray(values[f"J{i + 1}"]) for i in range(self.branches)])
        return jc.Prony(
            J0=values.get("J0", 0.0),
            J=J,
            tau=self.tau,
            fluidity=values.get("fluidity", 0.0),
            **volume.keyword,
        )

    def box(self, table: dict[str, tuple[float, float]]) -> np.ndarray:
        """Return the bounds of the compliances (size, 2) from those of the parameters; zero for a part that is absent."""
        box = np.zeros((self.size, 2))
        for name, place in self.where.items():
            low, high = table[name]
            box[place] = (low, high) if self.tau is not None else (reciprocal(high), reciprocal(low))
        return box

    def intervals(self, spans: np.ndarray, table: dict[str, tuple[float, float]]) -> dict:
        """Return the intervals of the parameters from those (size, 2) of the compliances, restricted to the bounds."""
        ends = [self.parameters(np.maximum(side, 0.0)) for side in spans.T]
        result = {}
        for name, (low, high) in table.items():
            least, most = sorted(end[name] for end in ends)
            result[name] = (max(float(least), low), min(float(most), high))
        return result


@dataclasses.dataclass(frozen=True, eq=False)
class ParameterList(Structure):
    """A law as the list of its own parameters; dimensions: {parameter: unit}, "" for a number; zeros: parameters that may
    be held at 0."""

    dimensions: dict[str, str] = dataclasses.field(default_factory=dict)
    zeros: tuple[str, ...] = ()

    @classmethod
    def of(cls, model: type, dimensions: dict[str, str], zeros: tuple[str, ...] = ()) -> Self:
        """Return the structure of a law whose parameters have these units, of which some may be held at 0."""
        where = {name: place for place, name in enumerate(dimensions)}
        return cls(model, where, 0, None, dimensions=dimensions, zeros=zeros)

    def times(self, values: np.ndarray) -> float:
        """Return nan: a law has no list of retardation times."""
        return math.nan

    def may_be_zero(self, name: str) -> bool:
        """Return whether a parameter may be held at 0."""
        return name in self.zeros

    @property
    def size(self) -> int:
        """Length of the list."""
        return len(self.where)

    def unit(self, name: str) -> str:
        """Return the unit of a parameter."""
        return self.dimensions[name]

    def parameters(self, compliances: Any) -> dict[str, Any]:
        """Return {parameter: value} of the list."""
        return {name: compliances[place] for name, place in self.where.items()}

    def off_zero(self, values: np.ndarray, time: float) -> np.ndarray:
        """Return the list unchanged, because the search keeps it off zero."""
        return values

    def material(self, values: dict[str, Any], volume: Any) -> Any:
        """Return the law with these parameters."""
        return self.model(**values)


# Laws that are no series of springs and dashpots: fractional ones, and materials of the user's own.

LAWS = {law.__name__: law for law in (jc.Springpot, jc.FractionalKelvinVoigt, jc.FractionalMaxwell)}
LAW_UNITS = {"G": "Pa", "V": "Pa s^alpha", "alpha": ""}
ORDERS = (0.02, 0.98)  # bounds of alpha of a Prony approximation
CUT = 1e-5  # relative error of the Prony approximation that is returned
OFF = 60  # number of times at which two laws are compared
HELD = ("nu", "bulk_modulus")
# the names that materials of jaxcontact have (``Material.shifted``), by their first letters, with units
OWN_UNITS = {"fluidity": "1/(Pa s)", "eta": "Pa s", "tau": "s", "G": "Pa", "J": "1/Pa"}


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

        # the one with the smaller of the largest relative differences of J(t) within the span
        t = np.geomspace(*self.span, OFF)
        exact = np.asarray(law.creep(t))
        off = lambda material: float(np.max(np.abs(np.asarray(material.creep(t)) / exact - 1.0)))
        return min((element, lower), key=off)

    @property
    def notes(self) -> tuple[str, ...]:
        """Note on the range of validity of the returned material."""
        low, high = self.span
        return (
            f"material: the law approximated by a Prony series, J(t) to {CUT:g} from {low:.4g} to {high:.4g} s",
        )


@dataclasses.dataclass(frozen=True, eq=False)
class OwnLaw(Law):
    """A material of one's own as the list of its parameters; start: the material at which the search begins.

    The material is a subclass of ``jaxcontact.abc.Material``. An instance is given in place of a model: its numbers are the
    start of the search, and what is not fitted (nu or a bulk modulus) is kept. All its other fields are numbers > 0. Their
    units are those of the class attribute ``units``, as in case files, or follow from their names (``OWN_UNITS``).
    """

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
        usual = {
            name: next((unit for known, unit in OWN_UNITS.items() if name.startswith(known)), "")
            for name in names
        }
        stated = getattr(start, "units", {})
        dimensions = {name: stated.get(name, usual[name]) for name in names}
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


CLASSICAL = {
    jc.Elastic: Structure(jc.Elastic, {"G": 0}, 0),
    jc.Maxwell: Structure(jc.Maxwell, {"G": 0, "eta": 1}, 0),
    jc.KelvinVoigt: Structure(jc.KelvinVoigt, {"G": 1, "eta": 3}, 1),
    jc.StandardLinearSolid: Structure(jc.StandardLinearSolid, {"G1": 0, "G2": 1, "eta2": 3}, 1),
    jc.Burgers: Structure(jc.Burgers, {"G1": 0, "G2": 1, "eta1": 2, "eta2": 3}, 1),
}


def resolve(model: type | str, also: tuple[str, ...] = ()) -> Structure:
    """Return the structure of a material class with at most one retardation time, given as a class or by name.

    also: further names that the error message lists as accepted.
    """
    cls = by_name(model, CLASSICAL) if isinstance(model, str) else model
    if cls not in CLASSICAL:
        names = [known.__name__ for known in CLASSICAL]
        raise ValueError(
            f"model: expected one of {sorted([*names, *also])}, got {getattr(model, '__name__', model)!r};"
            " fit_prony takes several retardation times, and fit_creep a material of one's own, as an instance"
        )
    return CLASSICAL[cls]


def by_name(name: str, classes: Iterable[type]) -> type | None:
    """Return the class of that name, ignoring case, or None."""
    return {cls.__name__.casefold(): cls for cls in classes}.get(name.casefold())


def given_times(tau: Any) -> np.ndarray:
    """Return the different times (k,) [s] of a series in their order; ValueError unless they are > 0."""
    require_real("tau", tau)
    times = np.unique(np.asarray(tau, dtype=float))
    if times.size == 0 or not np.all(np.isfinite(times) & (times > 0)):
        raise ValueError(f"tau: expected times > 0, got {times}")
    return times


def series(tau: Any, instantaneous: bool = True, flow: bool = True) -> Structure:
    """Return the structure of ``jc.Prony`` with given times (k,) [s], with or without J0 and the fluidity."""
    tau = given_times(tau)
    where = {f"J{i + 1}": i + 1 for i in range(tau.size)}
    where = ({"J0": 0} if instantaneous else {}) | where
    return Structure(jc.Prony, where | ({"fluidity": tau.size + 1} if flow else {}), tau.size, tau)


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
    return Law.of(law, {name: LAW_UNITS[name] for name in own if name in LAW_UNITS})


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


def structure_of(model: type | str, tau: Any) -> Structure:
    """Return the structure of a classical material, or of a series with given times."""
    is_series = model is jc.Prony or (isinstance(model, str) and model.casefold() == "prony")
    if is_series == (tau is None):
        raise ValueError(f"tau: expected retardation times for jc.Prony and None else, got {tau!r}")
    return series(tau) if is_series else resolve(model)


def of_material(material: Any) -> tuple[Structure, dict[str, float]]:
    """Return the structure of a material and its parameters; a series has no J0 or fluidity where these are zero."""
    if not isinstance(material, jc.Prony):
        structure = resolve(type(material))
        return structure, {name: float(getattr(material, name)) for name in structure.where}
    J, order = np.atleast_1d(material.J), np.argsort(np.atleast_1d(material.tau))
    structure = series(material.tau, float(material.J0) > 0, float(material.fluidity) > 0)
    values = structure.parameters(np.array([material.J0, *J[order], material.fluidity], dtype=float))
    return structure, values


def limits(
    structure: Structure, fixed: dict[str, float] | None, bounds: dict[str, tuple] | None
) -> dict[str, tuple[float, float]]:
    """Return the bounds of every parameter, (0, inf) unless given, equal ones where fixed; ValueError on bad input."""
    table = {name: (0.0, math.inf) for name in structure.where}
    for name, pair in (bounds or {}).items():
        _known(structure, name, "bounds")
        table[name] = _pair(name, pair)
    for name, value in (fixed or {}).items():
        _known(structure, name, "fixed")
        zero = structure.may_be_zero(name)
        known = isinstance(value, int | float | np.number) and math.isfinite(value)
        if not (known and (value > 0 or (zero and value == 0))):
            raise ValueError(f"fixed[{name!r}]: expected a number {'>=' if zero else '>'} 0, got {value!r}")
        table[name] = (float(value), float(value))
    if all(low == high for low, high in table.values()):
        raise ValueError(
            f"fixed: expected at least one parameter left free of {list(table)}, got all of them"
        )
    return table


class Sought(NamedTuple):
    """The material or law that a fit estimates.

    structure: its parameters; table: {parameter: (low, high)}, equal where it is held; volume: the held parameter of
    its volumetric response, a ``Compressibility``, None for a law without one.
    """

    structure: Structure
    table: dict[str, tuple[float, float]]
    volume: Any

    @classmethod
    def of(
        cls, structure: Structure, fixed: dict[str, float] | None, bounds: dict[str, tuple] | None,
        nu: float | None, bulk_modulus: float | None = None,
    ) -> Sought:  # fmt: skip
        """Return the sought material from the keywords of a fit; ValueError on bad input."""
        return cls(structure, limits(structure, fixed, bounds), Compressibility.of(nu, bulk_modulus))


def over_span(sought: Sought, span: tuple[float, float]) -> Sought:
    """Return a sought fractional law whose material is approximated over the times ``span`` [s], with the bounds of alpha
    limited to 1; ValueError where that leaves no interval."""
    assert isinstance(sought.structure, Law)
    low, high = sought.table["alpha"]
    if (low < high and low >= 1.0) or (low == high and not ORDERS[0] <= low <= 1.0):
        raise ValueError(f"alpha: expected between 0 and 1, and {ORDERS[0]} to 1 if fixed, got {low:g}")
    law = dataclasses.replace(sought.structure, span=span)
    return sought._replace(structure=law, table=sought.table | {"alpha": (low, min(high, 1.0))})


def _known(structure: Structure, name: str, what: str) -> None:
    """Raise ValueError unless a structure has the parameter; what: the argument that names it."""
    if name not in structure.where:
        raise ValueError(
            f"{what}: {structure.model.__name__} has parameters {list(structure.where)}, got {name!r}"
        )


def _pair(name: str, pair: tuple) -> tuple[float, float]:
    """Return the bounds of a parameter with 0 and inf for open sides; ValueError unless they are in order."""
    try:
        low, high = pair
    except (TypeError, ValueError):
        raise ValueError(
            f"bounds[{name!r}]: expected (low, high), None for an open side, got {pair!r}"
        ) from None
    low, high = 0.0 if low is None else float(low), math.inf if high is None else float(high)
    if not 0.0 <= low < high:
        raise ValueError(f"bounds[{name!r}]: expected 0 <= low < high, got {pair!r}")
    return low, high


def reciprocal(value: Any) -> Any:
    """Return 1/value, with 1/0 = inf and 1/inf = 0 for plain floats; traced values are simply inverted."""
    return math.inf if isinstance(value, float) and value == 0.0 else 1.0 / value
