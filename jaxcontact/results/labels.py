"""The arrays of a result with their dimensions, units and meanings, for files, tables and labelled arrays."""

import dataclasses
import importlib
from typing import Any

import numpy as np

from jaxcontact._support.fields import FIELDS, INSIDE, TIME, VECTOR, Field, fields_of
from jaxcontact._support.status import Status
from jaxcontact._support.version import __version__

# the grid is stored as its axes and the diagnostics by name; the values of a save function may have any shape
NOT_STORED = ("grid", "saved", "diagnostics")


def status_names() -> list[str]:
    """Return the names of the statuses 0, 1, ..."""
    return [status.name for status in Status]


def stored_fields(cls: type) -> list[str]:
    """Return the names of the fields of a result class that are written to files."""
    return [field.name for field in dataclasses.fields(cls) if field.name not in NOT_STORED]


def optional_fields(cls: type) -> set[str]:
    """Return the names of the fields of a kind of result that may be None."""
    return {field.name for field in dataclasses.fields(cls) if field.default is None}


def arrays_of(result: Any) -> dict[str, np.ndarray]:
    """Return the stored fields of a result, and its axes x and y [m]."""
    x, y = result.grid.axes()
    given = {name: getattr(result, name) for name in stored_fields(type(result))}
    fields = {name: np.asarray(value) for name, value in given.items() if value is not None}
    return {"x": np.asarray(x), "y": np.asarray(y)} | fields


def derived_of(result: Any) -> dict[str, np.ndarray]:
    """Return the derived quantities of a result: the properties that ``FIELDS`` or ``INSIDE`` names.

    A history that keeps only the last pressure map has no peak pressure over time.
    """
    cls, found = type(result), {}
    for name in fields_of(stored_fields(cls)):
        if isinstance(getattr(cls, name, None), property) and hasattr(result, name):
            found[name] = np.asarray(getattr(result, name))
    return found


def numbers_of(result: Any) -> dict[str, np.ndarray]:
    """Return those of ``derived_of`` that are scalars or time series, not maps."""
    known = fields_of(stored_fields(type(result)))
    return {name: values for name, values in derived_of(result).items() if not known[name].is_map}


def attributes(name: str, field: Field) -> dict[str, Any]:
    """Return the unit and the meaning of a field; for the status, also the meaning of its values (CF conventions)."""
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
    """Return an ``xarray.Dataset`` of stored fields with dimensions, units and meanings; its attributes are ``notes``
    and the version of this package."""
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
    return xarray.Dataset(
        fields, axes, {"Conventions": "CF-1.8", "source": f"jaxcontact {__version__}", **notes}
    )


def table(arrays: dict[str, np.ndarray]) -> Any:
    """Return a ``pandas.DataFrame`` over time of the stored fields that are scalars, or vectors (x, y), at each time."""
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
    """Import and return a library that belongs to an optional extra."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(
            f"{name} is required; install it with: pip install 'jaxcontact[{group}]'"
        ) from error
