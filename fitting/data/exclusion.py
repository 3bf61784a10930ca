"""Single points of a measured curve that are left out of a fit."""

import dataclasses
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from fitting.data.creep import CreepData
from fitting.data.growth import GrowthData
from fitting.data.moduli import OscillationData, RelaxationData
from jaxcontact._support.pytree import require_real

Curve = TypeVar("Curve", CreepData, GrowthData, OscillationData, RelaxationData)
OWN = ("t", "J", "strain", "sigma", "scatter", "modulus", "thickness", "omega", "storage", "loss")


def exclude(data: Curve, at: Sequence[float]) -> Curve:
    """Return a curve without single points.

    A stress history that is given as knots is not changed, so that the strain of a creep test remains that of the whole
    history.

    Args:
        data: ``CreepData``, ``RelaxationData``, ``OscillationData`` or ``GrowthData``.
        at: times [s], or angular frequencies [rad/s], within the range of the curve; for each of them the nearest point is
            left out, all points if several are measured there.

    Returns:
        The other points, with a note.

    Raises:
        ValueError: data of another kind, a value outside the range of the curve, or fewer than 5 points left.

    Example:
        >>> data = fitting.RelaxationData(t=range(1, 8), modulus=[9, 6, 1, 4, 3, 2, 1], start=0.0)
        >>> print(fitting.exclude(data, [3.0]).modulus)
        [9. 6. 4. 3. 2. 1.]
    """
    kinds = (CreepData, RelaxationData, OscillationData, GrowthData)
    if not isinstance(data, kinds):
        names = ", ".join(kind.__name__ for kind in kinds)
        raise ValueError(f"data: expected one of {names}, got {type(data).__name__}")
    x: Any = data.omega if isinstance(data, OscillationData) else data.t
    symbol, unit = ("omega", "rad/s") if isinstance(data, OscillationData) else ("t", "s")
    require_real("exclude", at)
    values = np.asarray(list(at), dtype=float)
    wrong = values[~((values >= x.min()) & (values <= x.max()))]
    if wrong.size:
        raise ValueError(
            f"exclude: expected values of {symbol} from {x.min():.6g} to {x.max():.6g} {unit}, got {wrong[0]:g}"
        )
    near = {float(x[np.argmin(np.abs(x - value))]) for value in values}
    keep = ~np.isin(x, list(near))
    if np.sum(keep) < 5:
        raise ValueError(f"exclude: expected at least 5 points left, got {np.sum(keep)} of {x.size}")
    shown = ", ".join(f"{value:.5g}" for value in sorted(near))
    note = f"excluded by hand: {x.size - np.sum(keep)} of {x.size} points, at {symbol} = {shown} {unit}"
    names = {field.name for field in dataclasses.fields(data)}
    arrays = {name: getattr(data, name) for name in OWN if name in names}
    picked = {name: array[keep] for name, array in arrays.items() if array is not None}
    return dataclasses.replace(data, **picked, notes=(*data.notes, note))
