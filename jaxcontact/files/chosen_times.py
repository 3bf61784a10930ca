"""Of which times a run writes its maps, and what it writes of all the others.

A map of the plane is a thousand times as large as what else a step gives, and nobody looks at every one. With "few"
``result.npz`` is the history of a few of the times, whole, and ``course.npz`` has lines and single numbers at all of them.
A run that does not say keeps all maps where they are small together, and a few where they are not.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from jaxcontact._support.fields import FIELDS, TIME

FEW, ALL, LAST = "few", "all", "last"  # what "save" of a case file and of the command line may be
MOST = 9  # times of maps with "few"
COURSE = "course.npz"  # what has all times, where the maps are of a few
SMALL = 32e6  # bytes of all maps of a run, up to which all are kept unless it says otherwise


def chosen(kept: str, count: int) -> np.ndarray:
    """The indices of those of ``count`` times whose maps are kept, in order; none when only those of the last are.

    A few are in equal steps of the index, the first and the last among them: logarithmic where the times are.
    """
    if kept == LAST:
        return np.zeros(0, int)
    return np.unique(
        np.linspace(0, count - 1, min(MOST, count) if kept == FEW else count).round().astype(int)
    )


def kept_unless_said(fields: Iterable[str], shape: tuple[int, int], count: int) -> str:
    """ "all" where the maps of those fields at ``count`` times take no more than ``SMALL``, "few" otherwise."""
    return ALL if maps_of(fields, count) * 8.0 * shape[0] * shape[1] <= SMALL else FEW


def maps_of(fields: Iterable[str], count: int) -> int:
    """How many maps, of one number a cell, those fields are at ``count`` times; a vector has two."""
    dims = [FIELDS[name].dimensions for name in fields]
    return sum((1 + ("direction" in dim)) * (count if "time" in dim else 1) for dim in dims if "x" in dim)


def at_times(arrays: Mapping[str, np.ndarray], indices: np.ndarray) -> dict[str, np.ndarray]:
    """The arrays of a history at some of its times; slip, which is since the time before, is summed in between."""
    picked = {
        name: values[indices] if _over_time(name, values) else values for name, values in arrays.items()
    }
    if "slip" in arrays and _over_time("slip", arrays["slip"]):
        begins = np.append(0, indices[:-1] + 1)
        picked["slip"] = np.add.reduceat(arrays["slip"][: indices[-1] + 1], begins)
    return picked


def course_of(arrays: Mapping[str, Any]) -> dict[str, Any]:
    """What a history has of every time but its maps: numbers and lines, and the axis x of these."""
    return {
        name: values
        for name, values in arrays.items()
        if name == "x" or (_over_time(name, values) and "y" not in FIELDS[name].dimensions)
    }


def _over_time(name: str, values: Any) -> bool:
    """Whether an array, a field or an axis of a result, has a value for each time."""
    dims = FIELDS[name].dimensions if name in FIELDS else ()
    return dims[:1] == TIME and len(values.shape) >= len(dims)
