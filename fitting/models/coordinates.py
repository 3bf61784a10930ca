"""Coordinates of an indentation fit: compliances of the material and instrument contributions to the measured depth.

All quantities are scaled: times by the duration, load and depth by their largest values, and compliances so that a
half-space has depth^(3/2) = int J dP. Compliances range over decades and are searched by their logarithms, except for
the fluidity, which must be able to reach its open end at zero, and for the compliances of a series with given times, of
which many are zero.
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
from fitting.models.structure import Structure
from jaxcontact.bodies.materials import Spectrum

NUISANCES = {"contact_point": "m", "drift": "m/s", "machine_compliance": "m/N"}
EDGE = 16.0  # bound of the logarithms of scaled compliances, 1e-7 to 1e7
BEYOND = 7.0  # of the logarithms of rates beyond the first time, where that is more


@functools.partial(
    jax.tree_util.register_dataclass,
    data_fields=["spring", "retarded", "flow", "rise", *NUISANCES, "rates"], meta_fields=[],
)  # fmt: skip
@dataclasses.dataclass(frozen=True)
class Coordinates:
    """One point of the search.

    spring (), retarded (k,), rise (k,): logarithms of j0, j_i and j_i/tau_i; flow (): f itself; contact_point, drift,
    machine_compliance (): contributions to the measured depth. rates (k,): 1/tau_i where the times are given; then rise
    is (0,), and spring and retarded are j0 and j_i themselves.
    """

    spring: Array
    retarded: Array
    flow: Array
    rise: Array
    contact_point: Array
    drift: Array
    machine_compliance: Array
    rates: Array | None

    def compliances(self) -> Spectrum:
        """Return the compliances of the material."""
        if self.rates is not None:
            return Spectrum(self.spring, self.retarded, self.rates, self.flow)
        rates = jnp.exp(self.rise - self.retarded)
        return Spectrum(jnp.exp(self.spring), jnp.exp(self.retarded), rates, self.flow)

    def offset(self, t: Array, load: Array) -> Array:
        """Return the sum of contact point, drift and machine compliance in the measured depth, (n,)."""
        return self.contact_point + self.drift * t + self.machine_compliance * load

    def vector(self) -> Array:
        """Return all coordinates that can be varied, (m,), in the order of the fields."""
        leaves = (getattr(self, field.name) for field in dataclasses.fields(self)[:-1])
        return jnp.concatenate([jnp.atleast_1d(leaf) for leaf in leaves])

    @classmethod
    def of(cls, vector: Array, branches: int, rates: Array | None) -> "Coordinates":
        """Return the coordinates of a vector (m,)."""
        flow = 1 + branches
        end = flow + 1 + (branches if rates is None else 0)
        point, drift, machine = vector[end:]
        return cls(
            vector[0], vector[1:flow], vector[flow], vector[flow + 1 : end], point, drift, machine, rates
        )

    def moved(self, places: Array, values: Array) -> "Coordinates":
        """Return this point with other values (k,) at some places of its vector."""
        vector = self.vector().at[places].set(values)
        return Coordinates.of(vector, self.retarded.shape[0], self.rates)


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Space(SearchSpace):
    """Bounds of a search over compliances, mostly by their logarithms, and over the quantities in ``NUISANCES``.

    box (m, 2): least and greatest compliances and nuisance parameters, scaled, 0 and inf where open; duration [s].
    """

    box: np.ndarray
    duration: float

    @classmethod
    def of(
        cls,
        structure: Structure,
        box: np.ndarray,
        unit: np.ndarray,
        duration: float,
        least: float = 0.0,
        decades: float = 0.0,
    ) -> "Space":
        """Return the space of a box (m, 2); least: lower bound of the open side of a linear coordinate; decades: logarithm
        of the duration over the first time, beyond which the range of a rate extends by ``BEYOND``."""
        places = np.arange(len(box))
        material = places < structure.size
        logs = material & (places != structure.flow) & (structure.tau is None)
        open_sides = np.stack([box[:, 0] == 0.0, np.isinf(box[:, 1])], -1)
        lower, upper = _bounds(box, material, logs, least, max(EDGE, decades + BEYOND))
        names = {place: name for name, place in structure.where.items()}
        return cls(
            structure=structure, lower=lower, upper=upper, unit=unit, logarithmic=logs, material=material,
            names=(*(names.get(i, "") for i in range(structure.size)), *NUISANCES), open=open_sides, box=box,
            duration=duration,
        )  # fmt: skip

    @property
    def linear_box(self) -> np.ndarray:
        """Bounds of the compliances (size, 2), with the lower bounds of the search at open sides of linear coordinates."""
        low, high = self.box[self.material].T
        return np.stack([np.where(self.logarithmic[self.material], low, self.lower[self.material]), high], -1)

    def point(self, vector: np.ndarray) -> Coordinates:
        """Return the coordinates of a vector."""
        tau = self.structure.tau
        return Coordinates.of(vector, self.structure.branches, None if tau is None else self.duration / tau)

    def vector(self, values: Array) -> Array:
        """Return the coordinates (m,) of scaled compliances > 0 and nuisance parameters (m,), which may be traced."""
        logs = self.logarithmic
        return jnp.where(logs, jnp.log(jnp.where(logs, values, 1.0)), values)

    def landscape(self, theta: np.ndarray, residual: Callable[[Any], Any]) -> Landscape:
        """Return the landscape about the optimum theta (m,) from the residuals (n,) as a function of the coordinates."""
        best = np.append(self.values(theta), theta[~self.material])
        run = functools.partial(_of_values, self, residual)
        return Landscape(Partial(run), best, self.box, self.unit, tuple(NUISANCES))

    def near(self, compliances: np.ndarray, least: float) -> np.ndarray:
        """Return a vector (m,) in the box with these compliances (size,), none below ``least``; nuisances at mid-range."""
        low, high = self.bounds
        vector, logs = 0.5 * (low + high), self.logarithmic[self.material]
        vector[self.material] = np.where(logs, np.log(np.maximum(compliances, least)), compliances)
        return np.clip(vector, low, high)


def _of_values(space: Space, residual: Callable[[Any], Any], values: Array) -> Any:
    """Return the residuals (n,) at scaled values (m,)."""
    return residual(space.vector(values))


def _bounds(
    box: np.ndarray, material: np.ndarray, logs: np.ndarray, least: float, edge: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds (m,) and (m,) of the coordinates, equal where one is held; open sides end at the edge."""
    low, high = box.T.copy()
    varied, linear = low < high, material & ~logs
    low[linear & (low == 0.0) & (high > 0.0)] = least
    high[material & varied] = np.minimum(high[material & varied], np.exp(edge))
    with np.errstate(divide="ignore"):
        low[logs], high[logs] = np.log(low[logs]), np.log(high[logs])
    low[logs & varied] = np.maximum(low[logs & varied], -edge)
    return low, high
