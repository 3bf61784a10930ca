"""Text representation of objects: each array by its length, range and unit."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np


def described(head: str, rows: Iterable[tuple[str, Any, str]], notes: Sequence[str] = ()) -> str:
    """Return a heading with lines of name, range and unit, without rows whose value is None, and a line for each note."""
    lines = [line(name, values, unit) for name, values, unit in rows if values is not None]
    return "\n".join([head, *lines, *(f"  note: {note}" for note in notes)])


def line(name: str, values: Any, unit: str = "") -> str:
    """Return a line with the number, or with the range and the shape of an array."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        text = str(values)
    elif array.size == 1:
        text = f"{array.item():.5g} {unit}"
    elif array.size == 0:
        text = "none"
    else:
        shape = " x ".join(map(str, array.shape))
        text = f"{np.min(array):.5g} to {np.max(array):.5g} {unit}".rstrip() + f" ({shape})"
    return f"  {name:14s} {text}".rstrip()
