"""Coordinates of the search of a fit, and the parameter values that they represent."""

import dataclasses
from typing import NamedTuple, Self

import numpy as np
from jax.tree_util import Partial

from fitting.models.structure import Structure


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
class SearchSpace:
    """Bounds and scaling of a search over vectors (m,) of coordinates.

    structure: of the sought values, a list (size,); lower, upper (m,): bounds of the coordinates, equal where one is
    held; unit (m,): SI value of a coordinate of one, or of a logarithm of zero; logarithmic (m,) bool: coordinates that
    are logarithms; material (m,) bool: those that represent the structure's list, in its order; names (m,): their
    parameters, "" for none; open (m, 2) bool: bounds of the search only, at which the value may be 0 or infinite.
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
        """Return the space of a search for the values themselves in a box (m, 2), in units (m,)."""
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
        """Indices (k,) of the free coordinates."""
        return np.flatnonzero(self.upper > self.lower)

    def values(self, theta: np.ndarray) -> np.ndarray:
        """Return the list (size,) of a vector of coordinates, in its units."""
        own, logs = theta[self.material], self.logarithmic[self.material]
        return np.where(logs, np.exp(np.where(logs, own, 0.0)), own)

    def slope(self, theta: np.ndarray) -> np.ndarray:
        """Return the derivative (size,) of each value in SI with respect to its coordinate."""
        return np.where(self.logarithmic[self.material], self.values(theta), 1.0) * self.unit[self.material]

    def by_log(self, theta: np.ndarray) -> np.ndarray:
        """Return the derivative (size,) of each coordinate with respect to the logarithm of its value."""
        return np.where(self.logarithmic, 1.0, theta)[self.material]

    def to_si(self, theta: np.ndarray) -> np.ndarray:
        """Return the values and other quantities (m,) of a vector in SI."""
        return np.append(self.values(theta), theta[~self.material]) * self.unit

    def at_ends(self, theta: np.ndarray) -> np.ndarray:
        """Return the list (size,), 0 or infinite where a coordinate is at an open bound."""
        varied, own = self.lower < self.upper, self.material
        bottom = ((theta <= self.lower) & varied & self.open[:, 0])[own]
        top = ((theta >= self.upper) & varied & self.open[:, 1])[own]
        return np.where(bottom, 0.0, np.where(top, np.inf, self.values(theta)))

    def opened(self, theta: np.ndarray) -> np.ndarray:
        """Return the best list (size,) as it is reported, in its units."""
        return self.at_ends(theta)

    def spans(self, theta: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return the interval ends (size, 2) in SI, from those (m, 2) of the coordinates about the best theta (m,)."""
        return np.stack([self.at_ends(end) for end in ends.T], -1) * self.unit[self.material][:, None]


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class ParameterSpace(SearchSpace):
    """Bounds of a search for the parameters of a law, which are themselves its list.

    All bounds are those of the search only; a best value at a bound is reported unchanged, its interval as open.
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
        """Return the best list (size,)."""
        return self.values(theta)
