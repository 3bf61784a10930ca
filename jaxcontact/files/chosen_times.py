"""The choice of the times at which a run stores its maps.

A map takes about a thousand times the space of the other results of a step, and few maps are ever examined. With "few"
``result.npz`` is the complete history at a few of the times, and ``course.npz`` has lines and scalars at all of them.
By default a run keeps all maps if their total size is small, and a few otherwise.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from jaxcontact._support.fields import FIELDS, TIME

FEW, ALL, LAST = "few", "all", "last"  # values of "save" in a case file and on the command line
MOST = 9  # number of maps kept with "few"
COURSE = "course.npz"  # the file with all times, where maps are kept at a few
SMALL = 32e6  # total size of the maps of a run, in bytes, up to which all are kept by default


def chosen(kept: str, count: int) -> np.ndarray:
    """Return the indices of those of ``count`` times whose maps are kept, in order; an empty array for "last".

    A few times are evenly spaced in their index, including the first and the last: logarithmic where the times are.
    """
    if kept == LAST:
        return np.zeros(0, int)
    return np.unique(
        np.linspace(0, count - 1, min(MOST, count) if kept == FEW else count).round().astype(int)
    )


def kept_unless_said(fields: Iterable[str], shape: tuple[int, int], count: int) -> str:
    """Return "all" if the maps of those fields at ``count`` times take no more than ``SMALL``, else "few"."""
    return ALL if maps_of(fields, count) * 8.0 * shape[0] * shape[1] <= SMALL else FEW


def maps_of(fields: Iterable[str], count: int) -> int:
    """Return the number of maps, of one number per cell, of those fields at ``count`` times; a vector has two."""
    dims = [FIELDS[name].dimensions for name in fields]
    return sum((1 + ("direction" in dim)) * (count if "time" in dim else 1) for dim in dims if "x" in dim)


def at_times(arrays: Mapping[str, np.ndarray], indices: np.ndarray) -> dict[str, np.ndarray]:
    """Return the arrays of a history at some of its times; slip, an increment per step, is summed between them."""
    picked = {
        name: values[indices] if _over_time(name, values) else values for name, values in arrays.items()
    }
    if "slip" in arrays and _over_time("slip", arrays["slip"]):
        begins = np.append(0, indices[:-1] + 1)
        picked["slip"] = np.add.reduceat(arrays["slip"][: indices[-1] + 1], begins)
    return picked


def time_series_of(arrays: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arrays of a history that have a value at every time, except maps, with the axis x of lines."""
    return {
        name: values
        for name, values in arrays.items()
        if name == "x" or (_over_time(name, values) and "y" not in FIELDS[name].dimensions)
    }


def _over_time(name: str, values: Any) -> bool:
    """Return whether an array, a field or an axis of a result, has a value for each time."""
    dims = FIELDS[name].dimensions if name in FIELDS else ()
    return dims[:1] == TIME and len(values.shape) >= len(dims)
