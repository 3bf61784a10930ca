"""The scale of a run: what is one inside.

Inside, lengths are in units of dx and compliances in units of A, the compliance of a very wide contact, so
that coefficients, pressures and gaps are of order one whatever the user's units.
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree

# powers of length, 1/compliance and the cell's area in each unit of the result's fields
LENGTH, PRESSURE, AREA, FORCE, NONE = (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 1, 1), (0, 0, 0)
ENERGY, ENERGY_PER_AREA = (1, 1, 1), (1, 1, 0)
DIMENSIONS = {
    **dict.fromkeys(("profile", "displacement", "gap", "approach", "approach_drift"), LENGTH),
    **dict.fromkeys(("pressure_centre", "dropped", "slip", "tangential_displacement"), LENGTH),
    **dict.fromkeys(("pressure", "leading_peak", "traction"), PRESSURE),
    **dict.fromkeys(("contact_area", "smooth_area"), AREA),
    **dict.fromkeys(("load", "lateral_force", "hysteresis_force", "coulomb_force", "tangential_load"), FORCE),
    **dict.fromkeys(("stored_energy", "hysteresis_power", "friction_power", "power", "dissipated"), ENERGY),
    "friction_work": ENERGY_PER_AREA,
    "jump_energy": ENERGY,
    **dict.fromkeys(("jumps", "cohesive_cells"), NONE),
    **dict.fromkeys(
        ("film_strain", "iterations", "error", "status", "stick", "slip_ratio", "creepage"), NONE
    ),
}


@pytree
class Scale:
    """length [m] and compliance [1/Pa] that are one inside, and cell_area [m^2] of the grid.

    A sum of scaled pressures over cells is a force in units of cell_area/compliance. Time is in seconds.
    """

    length: Array
    compliance: Array
    cell_area: Array

    def unit(self, name: str) -> Array:
        """What one inside is, in SI, for a field of a result."""
        length, pressure, area = DIMENSIONS[name]
        return self.length**length * self.compliance ** (-pressure) * self.cell_area**area

    def to_si(self, **fields: Array) -> dict[str, Array]:
        """Scaled fields by name, in SI; a field that has no unit as it is."""
        return {
            name: value if DIMENSIONS[name] == NONE else value * self.unit(name)
            for name, value in fields.items()
        }

    def from_si(self, name: str, value: Array | float) -> Array:
        """A quantity in SI, scaled."""
        return jnp.asarray(value) / self.unit(name)
