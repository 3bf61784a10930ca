"""What an indentation fit varies: the compliances of the material and what else is in the measured depth.

All is scaled: times by the duration, load and depth by their largest, and compliances so that a
half-space has depth^(3/2) = int J dP. Compliances range over decades and are searched by their
logarithms, but for the fluidity, whose open end at zero must be within reach; those of a series with
given times as they are, since zeros are common among them.
"""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.models.structure import Compliances, Structure

NUISANCES = {"contact_point": "m", "drift": "m/s", "machine_compliance": "m/N"}
EDGE = 16.0  # logarithms of scaled compliances stay within 1e-7 to 1e7


@functools.partial(
    jax.tree_util.register_dataclass,
    data_fields=["spring", "retarded", "flow", "rise", *NUISANCES, "rates"], meta_fields=[],
)  # fmt: skip
@dataclasses.dataclass(frozen=True)
class Coordinates:
    """One point of the search.

    spring (), retarded (k,), rise (k,): logarithms of j0, j_i and j_i/tau_i; flow (): f as it is;
    contact_point, drift, machine_compliance (): in the measured depth. rates (k,): 1/tau_i where the times
    are given; then rise is (0,), and spring and retarded are j0 and j_i themselves.
    """

    spring: Array
    retarded: Array
    flow: Array
    rise: Array
    contact_point: Array
    drift: Array
    machine_compliance: Array
    rates: Array | None

    def compliances(self) -> Compliances:
        """The material's."""
        if self.rates is not None:
            return Compliances(self.spring, self.retarded, self.flow, self.rates)
        rates = jnp.exp(self.rise - self.retarded)
        return Compliances(jnp.exp(self.spring), jnp.exp(self.retarded), self.flow, rates)

    def offset(self, t: Array, load: Array) -> Array:
        """Contact point, drift and machine compliance in the measured depth, (n,)."""
        return self.contact_point + self.drift * t + self.machine_compliance * load

    def vector(self) -> Array:
        """Everything that can be varied, (m,), in the order of the fields."""
        leaves = (getattr(self, field.name) for field in dataclasses.fields(self)[:-1])
        return jnp.concatenate([jnp.atleast_1d(leaf) for leaf in leaves])

    @classmethod
    def of(cls, vector: Array, branches: int, rates: Array | None) -> "Coordinates":
        """From such a vector (m,)."""
        flow = 1 + branches
        end = flow + 1 + (branches if rates is None else 0)
        point, drift, machine = vector[end:]
        return cls(
            vector[0], vector[1:flow], vector[flow], vector[flow + 1 : end], point, drift, machine, rates
        )

    def moved(self, places: Array, values: Array) -> "Coordinates":
        """This point with other values (k,) at some places of its vector."""
        vector = self.vector().at[places].set(values)
        return Coordinates.of(vector, self.retarded.shape[0], self.rates)


@dataclasses.dataclass(frozen=True, eq=False)
class Space:
    """The box of a search, for vectors (m,) of coordinates.

    structure: of the material; box (m, 2): least and greatest compliances and nuisances, scaled, 0 and inf
    where open; unit (m,): of each in SI; duration [s]; least: where the open side of a compliance that is
    searched as it is ends.
    """

    structure: Structure
    box: np.ndarray
    unit: np.ndarray
    duration: float
    least: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Of the coordinates, "" where the material has no such compliance."""
        names = {place: name for name, place in self.structure.where.items()}
        return (*(names.get(i, "") for i in range(self.structure.size)), *NUISANCES)

    @property
    def material(self) -> np.ndarray:
        """Which coordinates are compliances, (m,) bool."""
        return np.arange(len(self.box)) < self.structure.size

    @property
    def logarithmic(self) -> np.ndarray:
        """Which coordinates are logarithms, (m,) bool."""
        by_log = self.structure.tau is None
        return self.material & (np.arange(len(self.box)) != self.structure.flow) & by_log

    @property
    def linear_box(self) -> np.ndarray:
        """Bounds of the compliances (size, 2), with the least ones at their end of an open side."""
        low, high = self.box[self.material].T
        ends = ~self.logarithmic[self.material] & (low == 0.0) & (high > 0.0)
        return np.stack([np.where(ends, self.least, low), high], -1)

    @functools.cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """(m,) and (m,): of the coordinates, equal where one is held. Open sides end at the edge."""
        low, high = np.concatenate([self.linear_box, self.box[~self.material]]).T.copy()
        open_top = self.material & (low < high)
        high[open_top] = np.minimum(high[open_top], np.exp(EDGE))
        logs, varied = self.logarithmic, low < high
        with np.errstate(divide="ignore"):
            low[logs], high[logs] = np.log(low[logs]), np.log(high[logs])
        low[logs & varied] = np.maximum(low[logs & varied], -EDGE)
        return low, high

    @property
    def free(self) -> np.ndarray:
        """Indices of the coordinates that are varied."""
        low, high = self.bounds
        return np.flatnonzero(high > low)

    def point(self, vector: np.ndarray) -> Coordinates:
        """The coordinates of a vector."""
        tau = self.structure.tau
        return Coordinates.of(vector, self.structure.branches, None if tau is None else self.duration / tau)

    def compliances(self, vector: np.ndarray) -> np.ndarray:
        """The material's list (size,), scaled."""
        own, logs = vector[self.material], self.logarithmic[self.material]
        return np.where(logs, np.exp(np.where(logs, own, 0.0)), own)

    def vector(self, values: Array) -> Array:
        """The coordinates (m,) of compliances > 0 and nuisances (m,), scaled, which may be traced."""
        logs = self.logarithmic
        return jnp.where(logs, jnp.log(jnp.where(logs, values, 1.0)), values)

    def slope(self, vector: np.ndarray) -> np.ndarray:
        """d compliance/d coordinate, (size,), scaled."""
        return np.where(self.logarithmic[self.material], self.compliances(vector), 1.0)

    def opened(self, vector: np.ndarray) -> np.ndarray:
        """Compliances (size,), 0 and inf where a coordinate sits at the end of an open side."""
        (low, high), own = self.bounds, self.material
        varied = low < high
        bottom = ((vector <= low) & varied & (self.box[:, 0] == 0.0))[own]
        top = ((vector >= high) & varied & np.isinf(self.box[:, 1]))[own]
        return np.where(bottom, 0.0, np.where(top, np.inf, self.compliances(vector)))

    def near(self, compliances: np.ndarray, least: float) -> np.ndarray:
        """A vector in the box (m,) with these compliances (size,), none below ``least``; nuisances half-way."""
        low, high = self.bounds
        vector, logs = 0.5 * (low + high), self.logarithmic[self.material]
        vector[self.material] = np.where(logs, np.log(np.maximum(compliances, least)), compliances)
        return np.clip(vector, low, high)

    def to_si(self, vector: np.ndarray) -> np.ndarray:
        """Compliances and nuisances (m,) of a vector in SI."""
        return np.append(self.compliances(vector), vector[~self.material]) * self.unit
