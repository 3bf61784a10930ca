"""The coordinates in which a fit searches, and the values of a material or law that they stand for."""

import dataclasses
from typing import NamedTuple, Self

import numpy as np
from jax.tree_util import Partial

from fitting.models.structure import Structure


class Landscape(NamedTuple):
    """What the residuals of a fit are over, for those that go on from it.

    residual (n,): weighted, of values (k,): the compliances, then nuisances, scaled; a pytree. best (k,); box (k,
    2): bounds, equal where held; unit (k,): of each in SI; nuisances: their names.
    """

    residual: Partial
    best: np.ndarray
    box: np.ndarray
    unit: np.ndarray
    nuisances: tuple[str, ...] = ()


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class SearchSpace:
    """The box of a search, for vectors (m,) of coordinates.

    structure: the values that are sought, a list (size,); lower, upper (m,): bounds of the coordinates, equal where one
    is held; unit (m,): SI value of a coordinate of one, or of a logarithm of zero; logarithmic (m,) bool: coordinates
    that are logarithms; material (m,) bool: those that stand for the structure's list, in its order; names (m,): their
    parameters, "" for none; open (m, 2) bool: bounds that end the search only, where the value may be 0 or infinite.
    """

    structure: Structure
    lower: np.ndarray
    upper: np.ndarray
    unit: np.ndarray
    logarithmic: np.ndarray
    material: np.ndarray
    names: tuple[str, ...]
    open: np.ndarray

    @classmethod
    def linear(
        cls, structure: Structure, box: np.ndarray, unit: np.ndarray, material: np.ndarray
    ) -> "SearchSpace":
        """Return the space of a search for the values themselves in a box (m, 2), over their units (m,)."""
        lower, upper = box.T
        names = {place: name for name, place in structure.where.items()}
        own = iter(names.get(i, "") for i in range(structure.size))
        return cls(
            structure=structure, lower=lower, upper=upper, unit=unit, logarithmic=np.zeros(lower.size, dtype=bool),
            material=material, names=tuple(next(own) if here else "" for here in material),
            open=np.stack([lower == 0.0, np.isinf(upper)], -1),
        )  # fmt: skip

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the coordinates, (m,) and (m,)."""
        return self.lower, self.upper

    @property
    def free(self) -> np.ndarray:
        """Indices (k,) of the coordinates that are varied."""
        return np.flatnonzero(self.upper > self.lower)

    def values(self, theta: np.ndarray) -> np.ndarray:
        """The list (size,) of a vector of coordinates, over its units."""
        own, logs = theta[self.material], self.logarithmic[self.material]
        return np.where(logs, np.exp(np.where(logs, own, 0.0)), own)

    def slope(self, theta: np.ndarray) -> np.ndarray:
        """Derivative (size,) of each value in SI with respect to its coordinate."""
        return np.where(self.logarithmic[self.material], self.values(theta), 1.0) * self.unit[self.material]

    def by_log(self, theta: np.ndarray) -> np.ndarray:
        """Derivative (size,) of each coordinate with respect to the logarithm of its value."""
        return np.where(self.logarithmic, 1.0, theta)[self.material]

    def to_si(self, theta: np.ndarray) -> np.ndarray:
        """Values and other quantities (m,) of a vector in SI."""
        return np.append(self.values(theta), theta[~self.material]) * self.unit

    def at_ends(self, theta: np.ndarray) -> np.ndarray:
        """The list (size,), 0 or infinite where a coordinate is at an open bound."""
        varied, own = self.lower < self.upper, self.material
        bottom = ((theta <= self.lower) & varied & self.open[:, 0])[own]
        top = ((theta >= self.upper) & varied & self.open[:, 1])[own]
        return np.where(bottom, 0.0, np.where(top, np.inf, self.values(theta)))

    def opened(self, theta: np.ndarray) -> np.ndarray:
        """The best list (size,) that is reported, over its units."""
        return self.at_ends(theta)

    def spans(self, theta: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Ends (size, 2) of the intervals in SI, from those (m, 2) of the coordinates about the best theta (m,)."""
        return np.stack([self.at_ends(end) for end in ends.T], -1) * self.unit[self.material][:, None]


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class ParameterSpace(SearchSpace):
    """The box of a search for the parameters of a law, which are themselves its list.

    All bounds end the search only; a best value at one of them is reported as it is, its interval as open.
    """

    @classmethod
    def of(
        cls, structure: Structure, box: np.ndarray, logarithmic: np.ndarray, unit: np.ndarray | None = None
    ) -> Self:
        """Return the space of a box (m, 2) of coordinates, of which some are logarithmic (m,) bool; unit (m,): SI value of a
        coordinate of one, or of a logarithm of zero, all 1 unless given."""
        lower, upper = box.T
        every = np.ones(lower.size, dtype=bool)
        return cls(
            structure=structure, lower=lower, upper=upper, unit=np.ones(lower.size) if unit is None else unit,
            logarithmic=logarithmic,
            material=every, names=tuple(structure.where), open=np.stack([every, every], -1),
        )  # fmt: skip

    def opened(self, theta: np.ndarray) -> np.ndarray:
        """The best list (size,)."""
        return self.values(theta)
