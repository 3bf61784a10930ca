"""Of which times a run writes its maps, and what it writes of all the others.

A map of the plane is a thousand times as large as what else a step gives, and nobody looks at every one. With "few"
``result.npz`` is the history of a few of the times, whole, and ``course.npz`` has lines and single numbers at all of them.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from jaxcontact.labels import FIELDS, TIME

FEW, ALL, LAST = "few", "all", "last"  # what "save" of a case file and of the command line may be
MOST = 9  # times of maps with "few"


def chosen(kept: str, count: int) -> np.ndarray:
    """The indices of those of ``count`` times whose maps are kept, in order; none when only those of the last are.

    A few are in equal steps of the index, the first and the last among them: logarithmic where the times are.
    """
    if kept == LAST:
        return np.zeros(0, int)
    return np.unique(
        np.linspace(0, count - 1, min(MOST, count) if kept == FEW else count).round().astype(int)
    )


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
        if name == "x" or (_over_time(name, values) and "x" not in FIELDS.get(name, (TIME,))[0])
    }


def _over_time(name: str, values: Any) -> bool:
    """Whether an array has a value for each time; what is no field of a result is a line, which has."""
    dims = FIELDS.get(name, (TIME,))[0]
    return name not in ("x", "y") and dims[:1] == TIME and len(values.shape) >= len(dims)
