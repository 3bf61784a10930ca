"""The fields of results: each declared once, with its dimensions, unit and meaning.

The scale of a run, summaries, tables, labelled arrays, files and figures derive from these declarations. A new field is
one line here and one in the class of its result.
"""

from collections.abc import Collection
from dataclasses import dataclass

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

    dimensions: their names; a field with fewer of them lacks the first ones; unit: in SI, of a ratio as "N/N"; shown:
    whether summaries and tables of cases have it, of a vector each component.
    """

    dimensions: Dimensions
    unit: str
    meaning: str
    shown: bool = False

    @property
    def symbol(self) -> str:
        """The unit behind a number in files: "1" for a ratio."""
        above, _, below = self.unit.partition("/")
        return "1" if above == below else self.unit

    @property
    def in_key(self) -> str:
        """The unit in the key of a summary, "peak_pressure_end_Pa" or "film_strain_end_m_per_m"."""
        return self.unit.replace("/", "_per_")

    @property
    def is_map(self) -> bool:
        return "x" in self.dimensions

    def dimensions_of(self, ndim: int) -> Dimensions:
        """The names of the dimensions of an array of this field: the last ``ndim`` of those that it may have."""
        return self.dimensions[len(self.dimensions) - ndim :]


FIELDS: dict[str, Field] = {  # in the order in which summaries show them
    "times": Field(TIME, "s", "time"),
    "profile": Field(PLANE, "m", "gap at first touch"),
    "pressure": Field(MAP, "Pa", "contact pressure, positive in compression"),
    "displacement": Field(MAP, "m", "displacement of both surfaces towards each other"),
    "gap": Field(MAP, "m", "gap between the surfaces, zero in contact"),
    "pressure_line": Field(LINE, "Pa", "pressure at the row of cells nearest to y = 0"),
    "displacement_line": Field(LINE, "m", "displacement of both surfaces at that row"),
    "approach": Field(TIME, "m", "approach of the indenter from first touch", shown=True),
    "load": Field(TIME, "N", "normal load", shown=True),
    "peak_pressure": Field(TIME, "Pa", "largest pressure", shown=True),
    "contact_radius": Field(
        TIME, "m", "radius of a circle of the smooth area, in plane strain half the width", shown=True
    ),
    "contact_area": Field(TIME, "m2", "contact area, a count of cells", shown=True),
    "smooth_area": Field(TIME, "m2", "area within the contact's edge, found below the cell"),
    "film_strain": Field(TIME, "m/m", "shortening of the film over its thickness", shown=True),
    "tangential_force": Field(
        TIME, "N", "force against the motion, hysteresis and Coulomb friction", shown=True
    ),
    "friction_coefficient": Field(TIME, "N/N", "tangential force over normal load", shown=True),
    "hysteresis_force": Field(TIME, "N", "force against the motion by hysteresis of the body", shown=True),
    "coulomb_force": Field(TIME, "N", "force against the motion by Coulomb friction", shown=True),
    "tangential_load": Field(VECTOR, "N", "tangential load on the indenter", shown=True),
    "tangential_displacement": Field(VECTOR, "m", "tangential displacement of the indenter", shown=True),
    "creepage": Field(
        VECTOR,
        "m/m",
        "slip velocity of the indenter over the body, as rigid bodies, over the speed",
        shown=True,
    ),
    "sticking_share": Field(TIME, "m2/m2", "cells that stick over cells in contact", shown=True),
    "power": Field(TIME, "W", "power lost, by hysteresis and friction", shown=True),
    "hysteresis_power": Field(TIME, "W", "power lost in the body", shown=True),
    "friction_power": Field(TIME, "W", "power lost to friction", shown=True),
    "dissipated": Field(TIME, "J", "lost to friction since the first time", shown=True),
    "approach_drift": Field((), "m", "sinking per e-fold of the distance slid"),
    "iterations": Field(TIME, "1", "iterations of the solver"),
    "error": Field(TIME, "1", "error of the solver"),
    "status": Field(TIME, "1", "how far the step can be trusted"),
    "converged": Field(TIME, "1", "whether the step can be trusted"),
    "velocity": Field(VECTOR, "m s-1", "velocity of the indenter over the body"),
    "lateral_force": Field(VECTOR, "N", "force of the pressure on the indenter along the surface"),
    "friction": Field(PLANE, "1", "coefficient of Coulomb friction"),
    "pressure_centre": Field(VECTOR, "m", "centre of pressure from the indenter's axis"),
    "leading_peak": Field(TIME, "Pa", "largest pressure ahead of the axis"),
    "stored_energy": Field(TIME, "J", "energy stored in the body"),
    "traction": Field(VECTOR_MAP, "Pa", "tangential traction on the body"),
    "slip": Field(VECTOR_MAP, "m", "slip of the body over the indenter since the time before"),
    "slip_ratio": Field(VECTOR_MAP, "1", "slip velocity of the body over the indenter, over the speed"),
    "stick": Field(MAP, "1", "in contact without slip"),
    "friction_work": Field(PLANE, "J m-2", "lost to friction per area from the first time to the last"),
    "dropped": Field(TIME, "m", "bound on the displacement of the history that left the grid"),
}

INSIDE: dict[str, Field] = {  # fields below the surface
    "depths": Field(("depth",), "m", "depth below the surface"),
    "stress": Field(
        ("depth", "row", "column", *PLANE), "Pa", "stress, tension positive: x, y, z by row and column"
    ),
    "displacement": Field(("depth", "component", *PLANE), "m", "displacement (x, y, z), z into the body"),
    "von_mises": Field(("depth", *PLANE), "Pa", "von Mises stress"),
    "response_error": Field(("depth",), "1", "largest relative error of the response over all wavelengths"),
    "status": Field(("depth",), "1", "how far the fields at a depth can be trusted"),
}


def fields_of(names: Collection[str]) -> dict[str, Field]:
    """Return the fields that a result with those names may have: those below the surface where depths are among them."""
    return INSIDE if "depths" in names else FIELDS


def shown() -> dict[str, Field]:
    """Return the fields that a summary shows, in its order; of a vector each component, as ``tangential_load_x``."""
    rows: dict[str, Field] = {}
    for name, field in FIELDS.items():
        if field.shown:
            ends = ("_x", "_y") if "direction" in field.dimensions else ("",)
            rows |= {f"{name}{end}": field for end in ends}
    return rows
