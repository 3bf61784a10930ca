"""Measured contact stiffness over depth, from continuous stiffness measurement: immutable, validated, in SI units."""

import dataclasses
from typing import Any

import numpy as np

from fitting.data.curves import array, deviations, window_note
from fitting.views.text import described

STATED = ("reduced modulus", "modulus")


@dataclasses.dataclass(frozen=True, eq=False)
class StiffnessData:
    """Contact stiffness of a nanoindentation over depth, from an oscillation of the load while it increases.

    Args:
        depth: (n,) [m] > 0.
        stiffness: (n,) storage stiffness of the contact [N/m] > 0, without that of the instrument.
        load: (n,) mean load [N] > 0, for the contact depth of Oliver and Pharr; None if unknown.
        sigma: (n,) standard deviations of the stiffness [N/m], or one value for all, if they are known.
        area: (n,) projected contact area [m2] > 0 that the instrument states, of which a fit takes the contact radius.
        stated: what the instrument found itself, to compare: {"reduced modulus": (n,), "modulus": (n,)} [Pa] or one of them.
        notes: remarks on the data, which are repeated in the notes of a fit.

    Raises:
        ValueError: values out of range, with the expected and the received value.

    Example:
        >>> data = fitting.StiffnessData(depth=[1e-7, 2e-7, 3e-7, 4e-7, 5e-7], stiffness=[1e4, 2e4, 3e4, 4e4, 5e4])
        >>> print(data.depth.size)
        5
    """

    depth: np.ndarray
    stiffness: np.ndarray
    load: np.ndarray | None = None
    sigma: Any = None
    area: np.ndarray | None = None
    stated: Any = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)
        put("depth", _positive("depth", "m", array("depth", self.depth)))
        put("stiffness", _positive("stiffness", "N/m", array("stiffness", self.stiffness, self.depth)))
        if self.load is not None:
            put("load", _positive("load", "N", array("load", self.load, self.depth)))
        if self.sigma is not None:
            spread = np.full(self.depth.size, self.sigma) if np.ndim(self.sigma) == 0 else self.sigma
            put("sigma", deviations("sigma", spread, self.depth))
        if self.area is not None:
            put("area", _positive("area", "m2", array("area", self.area, self.depth)))
        for name in self.stated or {}:
            if name not in STATED:
                raise ValueError(f"stated: expected keys among {', '.join(STATED)}, got {name!r}")
        put(
            "stated",
            {name: array(f"stated[{name!r}]", one, self.depth) for name, one in (self.stated or {}).items()},
        )

    def __repr__(self) -> str:
        rows = [("depth", self.depth, "m"), ("load", self.load, "N"), ("stiffness", self.stiffness, "N/m")]
        rows += [("sigma", self.sigma, "N/m"), ("area", self.area, "m2")]
        rows += [(f"stated {name}", values, "Pa") for name, values in self.stated.items()]
        return described(f"StiffnessData: {self.depth.size} points", rows, self.notes)

    def window(self, begin: float | None = None, end: float | None = None) -> "StiffnessData":
        """Return the points with depths from ``begin`` to ``end`` [m], None for an open side.

        Returns:
            The points, with a note.

        Raises:
            ValueError: begin is not before end, or fewer than 5 points.

        Example:
            >>> depth = np.linspace(1e-8, 1e-6, 100)
            >>> data = fitting.StiffnessData(depth=depth, stiffness=1e11 * depth)
            >>> print(data.window(5e-8).depth.size)
            96
        """
        low, high = -np.inf if begin is None else begin, np.inf if end is None else end
        if not low < high:
            raise ValueError(f"window: expected begin < end, got {begin!r} and {end!r}")
        keep = (self.depth >= low) & (self.depth <= high)
        if keep.sum() < 5:
            raise ValueError(f"window: expected at least 5 points, got {keep.sum()} of {keep.size}")
        names = ("depth", "stiffness", "load", "sigma", "area")
        some = {name: None if (y := getattr(self, name)) is None else y[keep] for name in names}
        some["stated"] = {name: values[keep] for name, values in self.stated.items()}
        return StiffnessData(**some, notes=(*self.notes, window_note((begin, end), "m", keep)))


def _positive(name: str, unit: str, values: np.ndarray) -> np.ndarray:
    """Return the values; ValueError unless all are > 0."""
    if np.any(values <= 0):
        k = int(np.argmax(values <= 0))
        raise ValueError(f"{name}: expected values > 0 {unit}, got {values[k]:g} at index {k}")
    return values
