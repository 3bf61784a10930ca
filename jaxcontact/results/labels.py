"""The arrays of a result with their dimensions, units and meanings, for files, tables and labelled arrays."""

import dataclasses
import importlib
from typing import Any

import numpy as np

from jaxcontact._support.fields import FIELDS, INSIDE, TIME, VECTOR, Field, fields_of
from jaxcontact._support.status import Status

# the grid is stored by its axes, the diagnostics by their names; what a function saved may be of any shape
NOT_STORED = ("grid", "saved", "diagnostics")


def status_names() -> list[str]:
    """The names of the statuses 0, 1, ..."""
    return [status.name for status in Status]


def stored_fields(cls: type) -> list[str]:
    """The names of those fields of a kind of result that go into files."""
    return [field.name for field in dataclasses.fields(cls) if field.name not in NOT_STORED]


def arrays_of(result: Any) -> dict[str, np.ndarray]:
    """The stored fields of a result, and its axes x and y [m]."""
    x, y = result.grid.axes()
    fields = {name: np.asarray(getattr(result, name)) for name in stored_fields(type(result))}
    return {"x": np.asarray(x), "y": np.asarray(y)} | fields


def derived_of(result: Any) -> dict[str, np.ndarray]:
    """Return the quantities of a result that follow from its fields: the properties that ``FIELDS`` or ``INSIDE`` names.

    A history with the map of its last time alone has no peak pressure over time.
    """
    cls, found = type(result), {}
    for name in fields_of(stored_fields(cls)):
        if isinstance(getattr(cls, name, None), property) and hasattr(result, name):
            found[name] = np.asarray(getattr(result, name))
    return found


def numbers_of(result: Any) -> dict[str, np.ndarray]:
    """Return those of ``derived_of`` that are numbers, over time or alone, and not maps."""
    known = fields_of(stored_fields(type(result)))
    return {name: values for name, values in derived_of(result).items() if not known[name].is_map}


def attributes(name: str, field: Field) -> dict[str, Any]:
    """Return unit and meaning of a field; of the status also the meaning of its values, as in the CF conventions."""
    attributes: dict[str, Any] = {"units": field.symbol, "long_name": field.meaning}
    if name == "status":
        values = {
            "flag_values": [int(status) for status in Status],
            "flag_meanings": " ".join(status_names()),
        }
        return attributes | values
    return attributes


def _axis(name: str, values: np.ndarray, unit: str, meaning: str) -> tuple[str, np.ndarray, dict[str, str]]:
    return name, values, {"units": unit, "long_name": meaning, "axis": name[0].upper()}


def dataset(arrays: dict[str, np.ndarray], notes: dict[str, Any]) -> Any:
    """An ``xarray.Dataset`` of stored fields, each with its dimensions, unit and meaning; notes: its attributes."""
    xarray = extra("xarray")

    axes = {axis: _axis(axis, arrays[axis], "m", f"{axis} of the cell centres") for axis in "xy"}
    if "times" in arrays:
        axes["time"] = _axis("time", arrays["times"], "s", "time")
    if "depths" in arrays:
        down = {"axis": "Z", "positive": "down"}
        axes["depth"] = (
            "depth",
            arrays["depths"],
            {"units": "m", "long_name": INSIDE["depths"].meaning} | down,
        )
    known = fields_of(arrays)
    if any("direction" in known[name].dimensions_of(a.ndim) for name, a in arrays.items() if name in known):
        axes["direction"] = ("direction", np.array(["x", "y"]), {"long_name": "component along x or y"})
    fields = {
        name: (known[name].dimensions_of(values.ndim), values, attributes(name, known[name]))
        for name, values in arrays.items()
        if name not in ("x", "y", "times", "depths")
    }
    return xarray.Dataset(fields, axes, {"Conventions": "CF-1.8", **notes})


def table(arrays: dict[str, np.ndarray]) -> Any:
    """A ``pandas.DataFrame`` over time of the stored fields that have a number, or one for x and y, at each time."""
    pandas = extra("pandas")

    columns = {}
    for name, values in arrays.items():
        field = FIELDS.get(name)
        if field and field.dimensions == TIME:
            columns[f"{name} [{field.symbol}]"] = values
        elif field and field.dimensions == VECTOR:
            columns |= {f"{name}_{axis} [{field.symbol}]": values[:, i] for i, axis in enumerate("xy")}
    return pandas.DataFrame(columns).set_index("times [s]")


def extra(name: str, group: str = "io") -> Any:
    """A library of one of the extras."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"this needs {name}; install it with: pip install 'jaxcontact[{group}]'") from error
