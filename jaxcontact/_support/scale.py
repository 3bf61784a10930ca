"""The scale of a run, which makes its variables dimensionless.

Internally, lengths are in units of dx and compliances in units of A, the compliance of a contact in the limit of long
waves, so that coefficients, pressures and gaps are of order one whatever the user's units.
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.fields import FIELDS
from jaxcontact._support.pytree import pytree

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
