"""Coordinates of the search of a fit, and the parameter values that they represent."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
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
    ) -> SearchSpace:
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


# Coordinates of order one for the parameters of a minimisation, in which bounds are eliminated.
#
# A parameter x without bounds, with a scale s, has the coordinate z = x/s. Between bounds it is replaced by
#
#     x = low + (high - low)/(1 + exp(-z)),      x = low + s exp(z),      x = high - s exp(z)
#
# for two bounds, a lower one alone, and an upper one alone, with s = start - low or high - start: every z gives a
# value inside the bounds. A minimum on a bound is approached but not reached.


@dataclass(frozen=True)
class LeafCoordinates:
    """The coordinates of one leaf: bounds (None where open) and scale, which broadcast to its shape."""

    low: Any
    high: Any
    scale: Any

    @classmethod
    def of(cls, name: str, start: np.ndarray, bounds: Any, scale: Any) -> LeafCoordinates:
        """Return the coordinates of one leaf after checking its start, bounds and scale; ValueError that names the
        leaf."""
        if not np.all(np.isfinite(start)):
            raise ValueError(f"start{name}: expected finite numbers")
        low, high = _pair(name, bounds)
        inside = (low is None or np.all(start > low)) and (high is None or np.all(start < high))
        if not inside:
            raise ValueError(
                f"start{name}: expected values inside the bounds ({low}, {high}), got {_range(start)}"
            )
        if scale is not None and not np.all(np.asarray(scale) > 0.0):
            raise ValueError(f"scale{name}: expected > 0, got {scale}")
        if low is not None or high is not None:
            own = start - low if low is not None else high - start
            return cls(low, high, own)
        if scale is None:
            scale = float(np.sqrt(np.mean(start**2)))
            if scale == 0.0:
                raise ValueError(
                    f"scale{name}: expected a scale or bounds, since start{name} is zero throughout"
                )
        return cls(low, high, scale)

    def inwards(self, x: Array) -> Array:
        """Return the coordinate z of a value x."""
        if self.low is not None and self.high is not None:
            return jnp.log((x - self.low) / (self.high - x))
        if self.low is not None:
            return jnp.log((x - self.low) / self.scale)
        if self.high is not None:
            return jnp.log((self.high - x) / self.scale)
        return x / self.scale

    def outwards(self, z: Array) -> Array:
        """Return the value x of a coordinate z."""
        if self.low is not None and self.high is not None:
            return self.low + (self.high - self.low) * jax.nn.sigmoid(z)
        if self.low is not None:
            return self.low + self.scale * jnp.exp(z)
        if self.high is not None:
            return self.high - self.scale * jnp.exp(z)
        return z * self.scale


@dataclass(frozen=True)
class SearchCoordinates:
    """The coordinates of a tree of parameters, leaf by leaf."""

    tree: Any
    leaves: tuple[LeafCoordinates, ...]

    @classmethod
    def of(cls, start: Any, bounds: Any, scale: Any) -> SearchCoordinates:
        """Return the coordinates of a tree after checking start, bounds and scale; ValueError that names the leaf."""
        paths, tree = jax.tree_util.tree_flatten_with_path(start)
        if not paths:
            raise ValueError("start: expected numbers or arrays, got a tree without any")
        spans, scales = _by_leaf("bounds", bounds, tree), _by_leaf("scale", scale, tree)
        named = [(jax.tree_util.keystr(path), leaf) for path, leaf in paths]
        leaves = [
            LeafCoordinates.of(name, _numbers(name, leaf), span, size)
            for (name, leaf), span, size in zip(named, spans, scales, strict=True)
        ]
        return cls(tree, tuple(leaves))

    def inwards(self, values: Any) -> list[Array]:
        """Return the coordinates of a tree of values, a list over its leaves."""
        found = jax.tree.leaves(values)
        return [own.inwards(jnp.asarray(x, float)) for own, x in zip(self.leaves, found, strict=True)]

    def outwards(self, coordinates: list[Array]) -> Any:
        """Return the tree of values at the given coordinates."""
        values = [own.outwards(z) for own, z in zip(self.leaves, coordinates, strict=True)]
        return jax.tree.unflatten(self.tree, values)


def _numbers(name: str, leaf: Any) -> np.ndarray:
    """Return a leaf of ``start`` as an array of floats; ValueError that names it if it is none."""
    try:
        return np.asarray(leaf, float)
    except (TypeError, ValueError):
        raise ValueError(f"start{name}: expected a number or an array, got {leaf!r}") from None


def _by_leaf(name: str, given: Any, tree: Any) -> list[Any]:
    """Return the argument for each leaf: one value for all, or a tree like ``start``."""
    one_for_all = given is None or isinstance(given, float | int) or (name == "bounds" and _is_pair(given))
    if one_for_all:
        return [given] * tree.num_leaves
    try:
        found = tree.flatten_up_to(given)
    except (ValueError, TypeError, KeyError):
        raise ValueError(
            f"{name}: expected one for all parameters, or a tree like start, got {given!r}"
        ) from None
    return found


def _is_pair(given: Any) -> bool:
    numbers = isinstance(given, tuple) and len(given) == 2
    return numbers and all(end is None or isinstance(end, float | int) for end in given)


def _pair(name: str, bounds: Any) -> tuple[Any, Any]:
    """Return (low, high) as arrays, None where open."""
    if bounds is None:
        return None, None
    if not isinstance(bounds, tuple | list) or len(bounds) != 2:
        raise ValueError(f"bounds{name}: expected (low, high), None where open, got {bounds!r}")
    ends = (None if end is None or np.all(np.isinf(end)) else np.asarray(end, float) for end in bounds)
    low, high = ends
    if low is not None and high is not None and not np.all(low < high):
        raise ValueError(f"bounds{name}: expected low < high, got ({low}, {high})")
    return low, high


def _range(values: np.ndarray) -> str:
    return f"{values:g}" if values.size == 1 else f"{values.min():g} to {values.max():g}"
