"""The parameters of a search, and the compliances that coordinates of an indentation or of a modulus stand for.

A coordinate is a parameter over its unit, or the logarithm of that ratio. Compliances range over decades and are
searched by their logarithms, except for the fluidity, which must be able to reach its open end at zero, and for the
compliances of a series with given times, of which many are zero.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import Partial

from fitting.models.structure import ParameterList, Structure
from jaxcontact.bodies.materials import Spectrum

NUISANCES = {"contact_point": "m", "drift": "m/s", "machine_compliance": "m/N"}
EDGE = 16.0  # bound of the logarithms of scaled compliances, 1e-7 to 1e7
BEYOND = 7.0  # of the logarithms of rates beyond the first time, where that is more


class Landscape(NamedTuple):
    """Residuals of a fit as a function of its parameters, for posterior sampling and other later analyses.

    residual (n,): weighted, function of the scaled values (k,), the compliances followed by nuisance parameters; a
    pytree. best (k,); box (k, 2): bounds, equal where held; unit (k,): of each value in SI; nuisances: their names.
    """

    residual: Partial
    best: np.ndarray
    box: np.ndarray
    unit: np.ndarray
    nuisances: tuple[str, ...] = ()


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Parameters:
    """Names, units and bounds of the parameters of a search over vectors (m,) of coordinates.

    structure: the list (size,) that some coordinates represent, the compliances of a material or the parameters of a
    law; the others are nuisance parameters, or compliances that the material does not have and that are held at zero (in a
    creep fit). names (m,): "" for a coordinate that is no parameter; unit (m,): SI value
    of a coordinate of one, or of a logarithm of zero; logarithmic (m,) bool: coordinates that are logarithms; lower,
    upper (m,): bounds of the coordinates, equal where one is held; material (m,) bool: those of the list, in its order;
    open (m, 2) bool: bounds of the search only, at which the value may be 0 or infinite; undetermined(theta, ends) (m,)
    or (m, 2) bool: interval ends that are open because the data leave them open, None: no further ones.
    """

    structure: Structure
    names: tuple[str, ...]
    unit: np.ndarray
    logarithmic: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    material: np.ndarray
    open: np.ndarray
    undetermined: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None

    @classmethod
    def of(
        cls, structure: Structure, box: Any, *, unit: Any = 1.0, logarithmic: Any = False, material: Any = True,
        nuisances: Sequence[str] = (), open: Any = True,
        undetermined: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
    ) -> Parameters:  # fmt: skip
        """Return the parameters with coordinates in a box (m, 2); the other arguments are those of the class, for all
        coordinates or (m,), and ``nuisances`` the names of the coordinates that are not of the list."""
        lower, upper = np.array(box, dtype=float).T
        every = lambda values, kind: np.broadcast_to(np.asarray(values, dtype=kind), lower.shape).copy()
        of_list = every(material, bool)
        known = {place: name for name, place in structure.where.items()}
        own, others = iter(range(structure.size)), iter(nuisances)
        names = tuple(known.get(next(own), "") if here else next(others, "") for here in of_list)
        return cls(
            structure=structure, names=names, unit=every(unit, float), logarithmic=every(logarithmic, bool),
            lower=lower, upper=upper, material=of_list,
            open=np.broadcast_to(np.asarray(open, dtype=bool), (lower.size, 2)).copy(), undetermined=undetermined,
        )  # fmt: skip

    @classmethod
    def of_compliances(
        cls, structure: Structure, box: np.ndarray, unit: np.ndarray, *, least: float = 0.0, decades: float = 0.0
    ) -> Parameters:  # fmt: skip
        """Return the coordinates of ``spectrum`` and ``instrument_offset`` from a box (m, 2) of compliances and
        ``NUISANCES``, scaled, 0 and inf where open.

        least: lower bound of the open side of a linear coordinate; decades: logarithm of the duration over the first
        time, beyond which the range of a rate extends by ``BEYOND``.
        """
        places = np.arange(len(box))
        material = places < structure.size
        logs = material & (places != structure.flow) & (structure.tau is None)
        open_sides = np.stack([box[:, 0] == 0.0, np.isinf(box[:, 1])], -1)
        low, high = box.T.copy()
        varied, linear, edge = low < high, material & ~logs, max(EDGE, decades + BEYOND)
        low[linear & (low == 0.0) & (high > 0.0)] = least
        high[material & varied] = np.minimum(high[material & varied], np.exp(edge))
        with np.errstate(divide="ignore"):
            low[logs], high[logs] = np.log(low[logs]), np.log(high[logs])
        low[logs & varied] = np.maximum(low[logs & varied], -edge)
        return cls.of(
            structure, np.stack([low, high], -1), unit=unit, logarithmic=logs, material=material,
            nuisances=tuple(NUISANCES), open=open_sides,
        )  # fmt: skip

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the coordinates, (m,) and (m,)."""
        return self.lower, self.upper

    @property
    def free(self) -> np.ndarray:
        """Indices (k,) of the free coordinates."""
        return np.flatnonzero(self.upper > self.lower)

    @property
    def box(self) -> np.ndarray:
        """Bounds (m, 2) of the values over their units; of compliances 0 and inf where they are open."""
        box = np.stack([self.lower, self.upper], -1)
        logs = self.logarithmic[:, None]
        box = np.where(logs, np.exp(np.where(logs, box, 0.0)), box)
        if isinstance(self.structure, ParameterList):
            return box
        return np.where(self.open & (self.lower < self.upper)[:, None], [0.0, np.inf], box)

    def values(self, theta: np.ndarray) -> np.ndarray:
        """Return the list (size,) of a vector of coordinates, in its units."""
        own, logs = theta[self.material], self.logarithmic[self.material]
        return np.where(logs, np.exp(np.where(logs, own, 0.0)), own)

    def coordinates(self, values: Array) -> Array:
        """Return the coordinates (m,) of all values over their units (m,), > 0 where logarithmic, which may be traced."""
        return jnp.where(self.logarithmic, jnp.log(jnp.where(self.logarithmic, values, 1.0)), values)

    def to_si(self, theta: np.ndarray) -> np.ndarray:
        """Return the values and other quantities (m,) of a vector in SI."""
        return np.append(self.values(theta), theta[~self.material]) * self.unit

    def fitted_nuisances(self, theta: np.ndarray, ends: np.ndarray) -> dict[str, tuple[float, float, float]]:
        """Return {name: (value, low, high)} in SI of the free quantities beside the list, from interval ends (m, 2)."""
        found = {}
        for i in self.free[~self.material[self.free]]:
            value, low, high = (float(self.to_si(vector)[i]) for vector in (theta, *ends.T))
            found[self.names[i]] = value, low, high
        return found

    def at_ends(self, theta: np.ndarray) -> np.ndarray:
        """Return the list (size,), 0 or infinite where a coordinate is at an open bound."""
        varied, own = self.lower < self.upper, self.material
        bottom = ((theta <= self.lower) & varied & self.open[:, 0])[own]
        top = ((theta >= self.upper) & varied & self.open[:, 1])[own]
        return np.where(bottom, 0.0, np.where(top, np.inf, self.values(theta)))

    def opened(self, theta: np.ndarray) -> np.ndarray:
        """Return the best list (size,) as it is reported, in its units: a compliance at an open bound as 0 or infinite,
        a parameter of a law unchanged, since the bound is that of its search."""
        return self.values(theta) if isinstance(self.structure, ParameterList) else self.at_ends(theta)

    def spans(self, theta: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return the interval ends (size, 2) in SI, from those (m, 2) of the coordinates about the best theta (m,)."""
        if self.undetermined is not None:
            away = self.undetermined(theta, ends) & (self.lower < self.upper)[:, None]
            ends = np.where(away, np.stack(self.bounds, -1), ends)
        return np.stack([self.at_ends(end) for end in ends.T], -1) * self.unit[self.material][:, None]

    def near(self, compliances: np.ndarray, least: float) -> np.ndarray:
        """Return a vector (m,) in the box with these compliances (size,), none below ``least``; nuisances at mid-range."""
        vector, logs = 0.5 * (self.lower + self.upper), self.logarithmic[self.material]
        vector[self.material] = np.where(logs, np.log(np.maximum(compliances, least)), compliances)
        return np.clip(vector, *self.bounds)

    def landscape(
        self, theta: np.ndarray, residual: Callable[[Any], Any], relative: bool = False
    ) -> Landscape:
        """Return the landscape about the optimum theta (m,) from the residuals (n,) as a function of the coordinates.

        relative: whether the values of the landscape are those over the best ones.
        """
        best = np.append(self.values(theta), theta[~self.material])
        unit = best if relative else np.ones(best.size)
        names = tuple(name for name, own in zip(self.names, self.material, strict=True) if not own)
        run = functools.partial(_residual_at_values, self, residual, unit)
        return Landscape(Partial(run), best / unit, self.box / unit[:, None], self.unit * unit, names)


def _residual_at_values(
    parameters: Parameters, residual: Callable[[Any], Any], unit: np.ndarray, values: Array
) -> Any:
    """Return the residuals (n,) at values (m,) over ``unit``; a module function, so that fits can be pickled."""
    return residual(parameters.coordinates(values * unit))


def spectrum(theta: Array, rates: Array | None) -> Spectrum:
    """Return the compliances of the coordinates (log j0, log j_i, f, log j_i/tau_i, ``NUISANCES``).

    rates (k,): 1/tau_i where the times are given; the coordinates are then (j0, j_i, f, ``NUISANCES``).
    """
    flow = 1 + ((theta.size - 2 - len(NUISANCES)) // 2 if rates is None else rates.shape[0])
    if rates is not None:
        return Spectrum(theta[0], theta[1:flow], rates, theta[flow])
    retarded, rise = theta[1:flow], theta[flow + 1 : 2 * flow]
    return Spectrum(jnp.exp(theta[0]), jnp.exp(retarded), jnp.exp(rise - retarded), theta[flow])


def instrument_offset(theta: Array, t: Array, load: Array) -> Array:
    """Return the sum of contact point, drift and machine compliance in the measured depth, (n,)."""
    return theta[-3] + theta[-2] * t + theta[-1] * load
