"""Declarations of the fields of results, each with its dimensions, unit and meaning.

The scale of a run (``Scale``), summaries, tables, labelled arrays, files and figures derive from these declarations. A new
field needs one line here and one in the class of its result.
"""

import dataclasses
import importlib
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact._support.status import Status
from jaxcontact._support.version import __version__

Dimensions = tuple[str, ...]
TIME: Dimensions = ("time",)
PLANE: Dimensions = ("x", "y")
MAP = TIME + PLANE
VECTOR: Dimensions = ("time", "direction")
VECTOR_MAP = VECTOR + PLANE
LINE: Dimensions = ("time", "x")


@dataclass(frozen=True)
class Field:
    """The declaration of a field.

    dimensions: their names; a field with fewer of them lacks the first ones; unit: in SI, for a ratio as "N/N"; shown:
    whether summaries and tables of cases include it, for vectors by component; from_maps: whether it follows from the maps
    of each time, so that a run which writes maps of some times only has to store it for all of them.
    """

    dimensions: Dimensions
    unit: str
    meaning: str
    shown: bool = False
    from_maps: bool = False

    @property
    def symbol(self) -> str:
        """The unit as written after a number in files: "1" for a ratio."""
        above, _, below = self.unit.partition("/")
        return "1" if above == below else self.unit

    @property
    def in_key(self) -> str:
        """The unit as written in the key of a summary, "peak_pressure_end_Pa" or "film_strain_end_m_per_m"."""
        return self.unit.replace("/", "_per_")

    @property
    def is_map(self) -> bool:
        return "x" in self.dimensions

    def dimensions_of(self, ndim: int) -> Dimensions:
        """Return the names of the dimensions of an array of this field: the last ``ndim`` of those declared."""
        return self.dimensions[len(self.dimensions) - ndim :]


FIELDS: dict[str, Field] = {  # in the order in which summaries show them
    "times": Field(TIME, "s", "time"),
    "profile": Field(PLANE, "m", "gap at first touch"),
    "moved_profile": Field(MAP, "m", "gap before contact where the indenter is, at no approach"),
    "pressure": Field(MAP, "Pa", "contact pressure, positive in compression"),
    "displacement": Field(MAP, "m", "sum of the displacements of both surfaces, each into its own body"),
    "indenter_displacement": Field(MAP, "m", "displacement of the indenter's surface, into the indenter"),
    "gap": Field(MAP, "m", "gap between the surfaces, zero in contact"),
    "in_contact": Field(MAP, "1", "whether a cell is in contact"),
    "pressure_line": Field(LINE, "Pa", "pressure at the row of cells nearest to y = 0", from_maps=True),
    "displacement_line": Field(LINE, "m", "displacement of both surfaces at that row", from_maps=True),
    "thickness_line": Field(LINE, "m", "thickness of the film at that row", from_maps=True),
    "dent_line": Field(LINE, "m", "depth of the dent at that row", from_maps=True),
    "temperature_line": Field(LINE, "K", "temperature of the surface at that row", from_maps=True),
    "approach": Field(TIME, "m", "approach of the indenter from first touch", shown=True),
    "load": Field(TIME, "N", "normal load", shown=True),
    "peak_pressure": Field(TIME, "Pa", "largest pressure", shown=True, from_maps=True),
    "contact_radius": Field(
        TIME, "m", "radius of a circle with the smooth area, in plane strain half the width", shown=True
    ),
    "contact_area": Field(TIME, "m2", "contact area, that of the cells in contact", shown=True),
    "smooth_area": Field(TIME, "m2", "contact area within an edge resolved below the cell size"),
    "peak_thickness": Field(TIME, "m", "largest thickness of the film", shown=True, from_maps=True),
    "peak_dent": Field(TIME, "m", "depth of the deepest dent", shown=True, from_maps=True),
    "peak_temperature": Field(TIME, "K", "largest temperature of the surface", shown=True, from_maps=True),
    "film_strain": Field(TIME, "m/m", "shortening of the film over its thickness", shown=True),
    "indenter_film_strain": Field(
        TIME, "m/m", "shortening of the indenter's film over its thickness", shown=True
    ),
    "tangential_force": Field(
        TIME, "N", "force against the motion, hysteresis and Coulomb friction", shown=True
    ),
    "friction_coefficient": Field(TIME, "N/N", "tangential force over normal load", shown=True),
    "hysteresis_force": Field(
        TIME, "N", "force against the motion due to hysteresis of the body", shown=True
    ),
    "coulomb_force": Field(TIME, "N", "force against the motion due to Coulomb friction", shown=True),
    "tangential_load": Field(VECTOR, "N", "tangential load on the indenter", shown=True),
    "tangential_displacement": Field(VECTOR, "m", "tangential displacement of the indenter", shown=True),
    "creepage": Field(
        VECTOR,
        "m/m",
        "rigid-body slip velocity of the indenter over the body, over the speed",
        shown=True,
    ),
    "spin": Field(
        (), "m-1", "rotation of the indenter on the body about the normal, over the distance rolled"
    ),
    "moment": Field((), "N m", "moment of the traction about the normal through the indenter's axis"),
    "sticking_share": Field(
        TIME, "m2/m2", "sticking cells over cells in contact", shown=True, from_maps=True
    ),
    "power": Field(TIME, "W", "power dissipated by hysteresis and friction", shown=True),
    "hysteresis_power": Field(TIME, "W", "power dissipated in the body", shown=True),
    "friction_power": Field(TIME, "W", "power dissipated by friction", shown=True),
    "dissipated": Field(TIME, "J", "energy dissipated by friction since the first time", shown=True),
    "jump_energy": Field(TIME, "J", "energy lost in jumps since the first time", shown=True),
    "viscous_energy": Field(TIME, "J", "energy dissipated in the body since the first time", shown=True),
    "jumps": Field(TIME, "1", "jumps from one branch of solutions to another since the first time"),
    "shear_strength": Field(PLANE, "Pa", "shear stress of the contact beside that of Coulomb's law"),
    "contact_pressure": Field(MAP, "Pa", "pressure that contact carries, without the attraction"),
    "cohesive_cells": Field(
        TIME, "m/m", "cells across the zone of attraction at the edge of contact", shown=True
    ),
    "tabor_number": Field(
        TIME, "m/m", "Tabor number of a ball with the creep compliance of the surface", shown=True
    ),
    "approach_drift": Field((), "m", "increase of the approach per factor e of the distance slid"),
    "iterations": Field(TIME, "1", "iterations of the solver"),
    "error": Field(TIME, "1", "error of the solver"),
    "status": Field(TIME, "1", "status of the step, 0 if it converged"),
    "converged": Field(TIME, "1", "whether the step converged"),
    "velocity": Field(VECTOR, "m s-1", "velocity of the indenter over the body"),
    "position": Field(VECTOR, "m", "position of the indenter on the body"),
    "lateral_force": Field(VECTOR, "N", "force of the pressure on the indenter along the surface"),
    "friction": Field(PLANE, "1", "coefficient of Coulomb friction"),
    "pressure_centre": Field(VECTOR, "m", "centre of pressure from the indenter's axis"),
    "leading_peak": Field(TIME, "Pa", "largest pressure ahead of the axis"),
    "stored_energy": Field(TIME, "J", "energy stored in the body"),
    "traction": Field(VECTOR_MAP, "Pa", "tangential traction on the body"),
    "slip": Field(VECTOR_MAP, "m", "slip of the body over the indenter since the previous time"),
    "slip_ratio": Field(VECTOR_MAP, "1", "slip velocity of the body over the indenter, over the speed"),
    "stick": Field(MAP, "1", "in contact without slip"),
    "friction_work": Field(
        PLANE, "J m-2", "energy dissipated by friction per area from the first time to the last"
    ),
    "thickness": Field(MAP, "m", "thickness of the film, or of the material added to the indenter"),
    "initial_indenter_film": Field(
        PLANE, "m", "thickness of the indenter's film at the first time, where it is what wears"
    ),
    "dent": Field(MAP, "m", "depth by which the surface of the body has yielded"),
    "temperature": Field(MAP, "K", "temperature of the surface"),
    "time_step_error": Field(TIME, "1", "estimated relative error of the pressure due to the time steps"),
    "step_error": Field(TIME, "m", "estimated error of the thickness due to the time steps"),
    "truncation_bound": Field(TIME, "m", "bound on the displacement due to the history that left the grid"),
    "response_error": Field((), "1", "largest relative error of the response of the body on the grid"),
}

INSIDE: dict[str, Field] = {  # fields below the surface
    "depths": Field(("depth",), "m", "depth below the surface"),
    "stress": Field(
        ("depth", "row", "column", *PLANE), "Pa", "stress, tension positive: x, y, z by row and column"
    ),
    "displacement": Field(("depth", "component", *PLANE), "m", "displacement (x, y, z), z into the body"),
    "von_mises": Field(("depth", *PLANE), "Pa", "von Mises stress"),
    "interfaces": Field(("interface",), "m", "depth of the lower faces of the layers"),
    "response_error": Field(("depth",), "1", "largest relative error of the response over all wavelengths"),
    "status": Field(("depth",), "1", "status of the fields at a depth, 0 if they are resolved"),
}


def fields_of(names: Collection[str]) -> dict[str, Field]:
    """Return the fields of a result with these names: those below the surface if depths are among them."""
    return INSIDE if "depths" in names else FIELDS


def following_from_maps(kind: type, names: Collection[str]) -> tuple[str, ...]:
    """Return the fields of a kind of result, with stored fields of these names, that follow from the maps of each time."""
    return tuple(
        name
        for name, field in FIELDS.items()
        if field.from_maps and (name.removesuffix("_line") in names or hasattr(kind, name))
    )


def shown() -> dict[str, Field]:
    """Return the fields that a summary shows, in order; for vectors each component, as ``tangential_load_x``."""
    rows: dict[str, Field] = {}
    for name, field in FIELDS.items():
        if field.shown:
            ends = ("_x", "_y") if "direction" in field.dimensions else ("",)
            rows |= {f"{name}{end}": field for end in ends}
    return rows


# The scale of a run, which makes its variables dimensionless.
#
# Internally, lengths are in units of dx and compliances in units of A, the compliance of a contact in the limit of long
# waves, so that coefficients, pressures and gaps are of order one whatever the user's units.

# exponents of length, 1/compliance and the cell area, by unit; fields of other units are not scaled
POWERS = {
    "m": (1, 0, 0),
    "Pa": (0, 1, 0),
    "m2": (0, 0, 1),
    "N": (0, 1, 1),
    "J": (1, 1, 1),
    "W": (1, 1, 1),
    "J m-2": (1, 1, 0),
}


@pytree
class Scale:
    """The units of the dimensionless variables: length [m], compliance [1/Pa], and cell_area [m^2] of the grid.

    A sum of scaled pressures over cells is a force in units of cell_area/compliance. Time is in seconds.
    """

    length: Array
    compliance: Array
    cell_area: Array

    def unit(self, name: str) -> Array:
        """Return the SI value of one scaled unit, for a field of a result."""
        length, pressure, area = POWERS[FIELDS[name].unit]
        return self.length**length * self.compliance ** (-pressure) * self.cell_area**area

    def to_si(self, **fields: Array) -> dict[str, Array]:
        """Return scaled fields by name in SI units; fields without a scale are unchanged."""
        return {
            name: value * self.unit(name) if FIELDS[name].unit in POWERS else value
            for name, value in fields.items()
        }

    def from_si(self, name: str, value: Array | float) -> Array:
        """Return the scaled value of a quantity in SI units."""
        return jnp.asarray(value) / self.unit(name)


# the grid is stored as its axes and the diagnostics by name; the values of a save function may have any shape
NOT_STORED = ("grid", "saved", "diagnostics")


def status_names() -> list[str]:
    """Return the names of the statuses 0, 1, ..."""
    return [status.name for status in Status]


def stored_fields(cls: type) -> list[str]:
    """Return the names of the fields of a result class that are written to files."""
    return [field.name for field in dataclasses.fields(cls) if field.name not in NOT_STORED]


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
