"""Measured curves: frozen, checked once, in SI units."""

import dataclasses
from typing import Any

import numpy as np

CONVENTIONS = {"J": 1.0, "1/(2G)": 2.0}


def _array(name: str, value: object, like: np.ndarray | None = None) -> np.ndarray:
    """A finite float array (n,), n >= 5; ValueError with its name otherwise."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: expected numbers, got {type(value).__name__}") from None
    if array.ndim != 1 or array.size < 5:
        raise ValueError(f"{name}: expected a 1-d array of at least 5 values, got shape {array.shape}")
    if like is not None and array.shape != like.shape:
        raise ValueError(f"{name}: expected {like.size} values as in t, got {array.size}")
    if not np.all(np.isfinite(array)):
        k = int(np.argmax(~np.isfinite(array)))
        raise ValueError(f"{name}: expected finite values, got {array[k]} at index {k}")
    array.setflags(write=False)
    return array


def _times(value: object) -> np.ndarray:
    t = _array("t", value)
    if t[0] < 0 or np.any(np.diff(t) < 0):
        raise ValueError("t: expected times >= 0 that do not decrease; read_creep sorts, CreepData does not")
    if np.unique(t).size < 5:
        raise ValueError(f"t: expected at least 5 different times, got {np.unique(t).size}")
    return t


@dataclasses.dataclass(frozen=True, eq=False)
class CreepData:
    """A creep curve: compliance J(t) after a stress step, or strain under a stress history.

    t (n,) [s], >= 0, not decreasing (repeated times are repeated measurements); J (n,) [1/Pa] > 0;
    or strain (n,) with stress: a pair (times, values [Pa]), piecewise linear, a repeated time being
    a jump, or an array (n,) measured at t. The stress is zero before its first time.
    convention: "J" = gamma/tau, or "1/(2G)" as phi in the paper's Eq. (14); ``compliance`` is J.
    notes: what a reader mended. Raises ValueError on anything else.
    """

    t: np.ndarray
    J: np.ndarray | None = None
    strain: np.ndarray | None = None
    stress: Any = None
    convention: str = "J"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)
        put("t", _times(self.t))
        if self.convention not in CONVENTIONS:
            raise ValueError(f"convention: expected one of {sorted(CONVENTIONS)}, got {self.convention!r}")
        if (self.J is None) == (self.strain is None):
            raise ValueError("CreepData: expected either J, or strain and stress; got both or none")
        if self.J is not None:
            if self.stress is not None:
                raise ValueError("stress: goes with strain, not with J")
            put("J", _array("J", self.J, self.t))
            if np.any(self.J <= 0):
                raise ValueError(f"J: expected > 0, got {self.J.min():g}")
            return
        put("strain", _array("strain", self.strain, self.t))
        put("stress", _history(self.stress, self.t))

    @property
    def compliance(self) -> np.ndarray | None:
        """Shear creep compliance J = gamma/tau [1/Pa], (n,), whatever the convention of the input."""
        return None if self.J is None else self.J * CONVENTIONS[self.convention]

    @property
    def response(self) -> np.ndarray:
        """What is fitted: J [1/Pa], or the strain (times 2 for the convention 1/(2G))."""
        values: Any = self.strain if self.J is None else self.J
        return values * CONVENTIONS[self.convention]


def _history(stress: object, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(knots, values) of the stress, checked."""
    if stress is None:
        raise ValueError("stress: expected (times, values) or an array as long as t, got None")
    knots, values = stress if isinstance(stress, tuple) and len(stress) == 2 else (t, stress)
    knots, values = np.array(knots, dtype=float), np.array(values, dtype=float)
    if knots.ndim != 1 or knots.shape != values.shape or knots.size == 0:
        raise ValueError(
            f"stress: expected times and values of one length, got {knots.shape} and {values.shape}"
        )
    if not (np.all(np.isfinite(knots)) and np.all(np.isfinite(values)) and np.all(np.diff(knots) >= 0)):
        raise ValueError("stress: expected finite values at times that do not decrease")
    if np.all(values == 0):
        raise ValueError("stress: expected a stress that is not zero throughout")
    return knots, values


@dataclasses.dataclass(frozen=True, eq=False)
class IndentationData:
    """An indentation curve: t (n,) [s] not decreasing, load (n,) [N], depth (n,) [m].

    notes: what a reader mended. Raises ValueError on anything else.
    """

    t: np.ndarray
    load: np.ndarray
    depth: np.ndarray
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", _times(self.t))
        object.__setattr__(self, "load", _array("load", self.load, self.t))
        object.__setattr__(self, "depth", _array("depth", self.depth, self.t))
