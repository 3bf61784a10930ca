"""What an indentation fit varies: the compliances of the material and what else is in the measured depth.

All is scaled: times by the duration, load and depth by their largest, and compliances so that a
half-space has depth^(3/2) = int J dP. Compliances range over decades and are searched by their
logarithms, but for the fluidity, whose open end at zero must be within reach; those of a series with
given times as they are, since zeros are common among them.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import Partial

from fitting.models.search_space import Landscape, SearchSpace
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


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Space(SearchSpace):
    """The box of a search over compliances, by their logarithms, and the quantities in ``NUISANCES``.

    box (m, 2): least and greatest compliances and nuisances, scaled, 0 and inf where open; duration [s].
    """

    box: np.ndarray
    duration: float

    @classmethod
    def of(
        cls, structure: Structure, box: np.ndarray, unit: np.ndarray, duration: float, least: float = 0.0
    ) -> "Space":
        """Return the space of a box (m, 2); least: where the open side of a compliance that is searched as it is ends."""
        places = np.arange(len(box))
        material = places < structure.size
        logs = material & (places != structure.flow) & (structure.tau is None)
        open_sides = np.stack([box[:, 0] == 0.0, np.isinf(box[:, 1])], -1)
        lower, upper = _bounds(box, material, logs, least)
        names = {place: name for name, place in structure.where.items()}
        return cls(
            structure=structure, lower=lower, upper=upper, unit=unit, logarithmic=logs, material=material,
            names=(*(names.get(i, "") for i in range(structure.size)), *NUISANCES), open=open_sides, box=box,
            duration=duration,
        )  # fmt: skip

    @property
    def linear_box(self) -> np.ndarray:
        """Bounds of the compliances (size, 2), with the least ones at their end of an open side."""
        low, high = self.box[self.material].T
        return np.stack([np.where(self.logarithmic[self.material], low, self.lower[self.material]), high], -1)

    def point(self, vector: np.ndarray) -> Coordinates:
        """The coordinates of a vector."""
        tau = self.structure.tau
        return Coordinates.of(vector, self.structure.branches, None if tau is None else self.duration / tau)

    def vector(self, values: Array) -> Array:
        """The coordinates (m,) of compliances > 0 and nuisances (m,), scaled, which may be traced."""
        logs = self.logarithmic
        return jnp.where(logs, jnp.log(jnp.where(logs, values, 1.0)), values)

    def landscape(self, theta: np.ndarray, residual: Callable[[Any], Any]) -> Landscape:
        """Return the landscape about the optimum theta (m,) of residuals (n,) of the coordinates."""
        best = np.append(self.values(theta), theta[~self.material])
        run = Partial(lambda values: residual(self.vector(values)))
        return Landscape(run, best, self.box, self.unit, tuple(NUISANCES))

    def near(self, compliances: np.ndarray, least: float) -> np.ndarray:
        """A vector in the box (m,) with these compliances (size,), none below ``least``; nuisances half-way."""
        low, high = self.bounds
        vector, logs = 0.5 * (low + high), self.logarithmic[self.material]
        vector[self.material] = np.where(logs, np.log(np.maximum(compliances, least)), compliances)
        return np.clip(vector, low, high)


def _bounds(
    box: np.ndarray, material: np.ndarray, logs: np.ndarray, least: float
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds (m,) and (m,) of the coordinates, equal where one is held; open sides end at the edge."""
    low, high = box.T.copy()
    varied, linear = low < high, material & ~logs
    low[linear & (low == 0.0) & (high > 0.0)] = least
    high[material & varied] = np.minimum(high[material & varied], np.exp(EDGE))
    with np.errstate(divide="ignore"):
        low[logs], high[logs] = np.log(low[logs]), np.log(high[logs])
    low[logs & varied] = np.maximum(low[logs & varied], -EDGE)
    return low, high
