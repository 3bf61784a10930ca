"""What the fields of a result are called: dimensions, unit and meaning, for files, tables and labelled arrays."""

import dataclasses
import importlib
from collections.abc import Collection
from typing import Any

import numpy as np

from jaxcontact._support.status import Status

# the grid is stored by its axes, the diagnostics by their names; what a function saved may be of any shape
NOT_STORED = ("grid", "saved", "diagnostics")

# dimensions, unit, meaning; a field with fewer dimensions lacks the first ones
TIME, MAP, VECTOR = ("time",), ("time", "x", "y"), ("time", "direction")
VECTOR_MAP = ("time", "direction", "x", "y")
FIELDS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "times": (TIME, "s", "time"),
    "profile": (("x", "y"), "m", "gap at first touch"),
    "pressure": (MAP, "Pa", "contact pressure, positive in compression"),
    "displacement": (MAP, "m", "displacement of both surfaces towards each other"),
    "gap": (MAP, "m", "gap between the surfaces, zero in contact"),
    "peak_pressure": (TIME, "Pa", "largest pressure"),
    "contact_radius": (TIME, "m", "radius of a circle of the smooth area, in plane strain half the width"),
    "converged": (TIME, "1", "whether the step can be trusted"),
    "friction_coefficient": (TIME, "1", "tangential force over normal load"),
    "sticking_share": (TIME, "1", "cells that stick over cells in contact"),
    "approach": (TIME, "m", "approach of the indenter from first touch"),
    "approach_drift": ((), "m", "sinking per e-fold of the distance slid"),
    "load": (TIME, "N", "normal load"),
    "contact_area": (TIME, "m2", "contact area, a count of cells"),
    "smooth_area": (TIME, "m2", "area within the contact's edge, found below the cell"),
    "film_strain": (TIME, "1", "shortening of the film over its thickness"),
    "iterations": (TIME, "1", "iterations of the solver"),
    "error": (TIME, "1", "error of the solver"),
    "status": (TIME, "1", "how far the step can be trusted"),
    "velocity": (VECTOR, "m s-1", "velocity of the indenter over the body"),
    "lateral_force": (VECTOR, "N", "force of the pressure on the indenter along the surface"),
    "friction": (("x", "y"), "1", "coefficient of Coulomb friction"),
    "tangential_force": (TIME, "N", "force against the motion, hysteresis and Coulomb friction"),
    "hysteresis_force": (TIME, "N", "force against the motion by hysteresis of the body"),
    "coulomb_force": (TIME, "N", "force against the motion by Coulomb friction"),
    "pressure_centre": (VECTOR, "m", "centre of pressure from the indenter's axis"),
    "leading_peak": (TIME, "Pa", "largest pressure ahead of the axis"),
    "power": (TIME, "W", "power lost, by hysteresis and friction"),
    "hysteresis_power": (TIME, "W", "power lost in the body"),
    "friction_power": (TIME, "W", "power lost to friction"),
    "stored_energy": (TIME, "J", "energy stored in the body"),
    "traction": (VECTOR_MAP, "Pa", "tangential traction on the body"),
    "slip": (VECTOR_MAP, "m", "slip of the body over the indenter since the time before"),
    "slip_ratio": (VECTOR_MAP, "1", "slip velocity of the body over the indenter, over the speed"),
    "creepage": (VECTOR, "1", "slip velocity of the indenter over the body, as rigid bodies, over the speed"),
    "stick": (MAP, "1", "in contact without slip"),
    "tangential_load": (VECTOR, "N", "tangential load on the indenter"),
    "tangential_displacement": (VECTOR, "m", "tangential displacement of the indenter"),
    "dissipated": (TIME, "J", "lost to friction since the first time"),
    "friction_work": (("x", "y"), "J m-2", "lost to friction per area from the first time to the last"),
    "jumps": (TIME, "1", "jumps from one branch of solutions to another since the first time"),
    "jump_energy": (TIME, "J", "energy lost in jumps since the first time"),
    "cohesive_cells": (TIME, "1", "cells across the zone of attraction at the edge of contact"),
    "dropped": (TIME, "m", "bound on the displacement of the history that left the grid"),
}

INSIDE: dict[str, tuple[tuple[str, ...], str, str]] = {
    "depths": (("depth",), "m", "depth below the surface"),
    "stress": (
        ("depth", "row", "column", "x", "y"),
        "Pa",
        "stress, tension positive: x, y, z by row and column",
    ),
    "displacement": (("depth", "component", "x", "y"), "m", "displacement (x, y, z), z into the body"),
    "von_mises": (("depth", "x", "y"), "Pa", "von Mises stress"),
}


def fields_of(names: Collection[str]) -> dict[str, tuple[tuple[str, ...], str, str]]:
    """The fields that a result with those names may have: below the surface, where depths are among them, others."""
    return INSIDE if "depths" in names else FIELDS


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
    return {name: values for name, values in derived_of(result).items() if "x" not in known[name][0]}


def dimensions(spec: tuple[str, ...], ndim: int) -> tuple[str, ...]:
    """The names of the dimensions of a stored field: the last ``ndim`` of those it may have."""
    return spec[len(spec) - ndim :]


def attributes(name: str, unit: str, meaning: str) -> dict[str, Any]:
    """Unit and meaning of a field; of the status also the meaning of its values, as in the CF conventions."""
    attributes: dict[str, Any] = {"units": unit, "long_name": meaning}
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
        axes["depth"] = ("depth", arrays["depths"], {"units": "m", "long_name": INSIDE["depths"][2]} | down)
    known = fields_of(arrays)
    if any("direction" in dimensions(known[name][0], a.ndim) for name, a in arrays.items() if name in known):
        axes["direction"] = ("direction", np.array(["x", "y"]), {"long_name": "component along x or y"})
    fields = {
        name: (dimensions(known[name][0], values.ndim), values, attributes(name, *known[name][1:]))
        for name, values in arrays.items()
        if name not in ("x", "y", "times", "depths")
    }
    return xarray.Dataset(fields, axes, {"Conventions": "CF-1.8", **notes})


def table(arrays: dict[str, np.ndarray]) -> Any:
    """A ``pandas.DataFrame`` over time of the stored fields that have a number, or one for x and y, at each time."""
    pandas = extra("pandas")

    columns = {}
    for name, values in arrays.items():
        spec, unit, _ = FIELDS.get(name, ((), "", ""))
        if spec == TIME:
            columns[f"{name} [{unit}]"] = values
        elif spec == VECTOR:
            columns |= {f"{name}_{axis} [{unit}]": values[:, i] for i, axis in enumerate("xy")}
    return pandas.DataFrame(columns).set_index("times [s]")


def extra(name: str, group: str = "io") -> Any:
    """A library of one of the extras."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"this needs {name}; install it with: pip install 'jaxcontact[{group}]'") from error
