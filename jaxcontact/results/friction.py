"""What a contact with friction gives back."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.grid import Grid
from jaxcontact.results.contact import ContactHistory, ContactStep, SteadyContact


def sticking_share(stick: Array, pressure: Array) -> Array:
    """Return the number of cells that stick over the number in contact, over the last two axes; 0 without contact."""
    return jnp.sum(stick, (-2, -1)) / jnp.maximum(jnp.sum(pressure > 0.0, (-2, -1)), 1)


@pytree
class ShearStep(ContactStep):
    """One step as a ``save`` function of ``shear`` sees it, in SI units, by the names of ``ShearHistory``.

    traction and slip (since the time before): (2, nx, ny); stick: (nx, ny); tangential_load and
    tangential_displacement: (2,); dissipated: a number.
    """

    traction: Array
    slip: Array
    stick: Array
    tangential_load: Array
    tangential_displacement: Array
    dissipated: Array


@pytree
class ShearHistory(ContactHistory):
    """A ``ContactHistory`` with friction, SI units; fields over the grid are those of the last time unless save="all".

    traction (nt, 2, nx, ny) [Pa] on the body; slip (nt, 2, nx, ny) [m]: of the body over the indenter since the time
    before, opposite to the traction, zero off contact; stick (nt, nx, ny) bool: in contact without slip at the
    end of the step; tangential_load (nt, 2) [N] and tangential_displacement (nt, 2) [m] of the indenter; dissipated
    (nt,) [J]: by friction since times[0]; friction_work (nx, ny) [J/m^2]: the same per area at the last time, whatever
    ``save`` keeps, so that its sum over cells times ``grid.cell_area`` is ``dissipated[-1]``. Both take the bound mu p as
    linear over an inner step: the error is of second order in it, and zero at constant pressure (``history.shear_march``).

    displacement is the normal one, as in ``ContactHistory``; iterations are those of all rounds and both solvers;
    error is the larger of the two. status 8: friction cannot hold the tangential load, and the step has no solution;
    9: an earlier step failed, whose tractions, displacements and work this one inherits.
    """

    view: ClassVar[str] = "shear"
    traction: Array
    slip: Array
    stick: Array
    tangential_load: Array
    tangential_displacement: Array
    dissipated: Array
    friction_work: Array

    @property
    def sticking_share(self) -> Array:
        """Cells that stick over those in contact, (nt,); 0 without contact."""
        return sticking_share(self.stick, self.pressure)


@pytree
class SteadyRolling(SteadyContact):
    """Steady rolling, in the frame of the indenter, SI units.

    velocity (2,) [m/s]; profile, displacement (normal) [m] and pressure [Pa]: (nx, ny); traction (2, nx, ny) [Pa]
    on the body;
    slip_ratio (2, nx, ny): slip velocity of the body over the indenter, over |v|, opposite to the traction, zero off
    contact; stick (nx, ny) bool; tangential_load (2,) [N]; creepage (2,): slip velocity of the indenter over the body as
    rigid bodies, over |v|, given or found;
    hysteresis_power [W]: lost in the dashpots of a body that creeps under the pressure; friction_power [W]: tangential_load
    times creepage times |v|, lost by the tractions; power [W]: both together; hysteresis_force [N]: hysteresis_power over
    |v|, the rolling resistance without friction, positive against the motion. At a roller without torque the force at the
    axle is power over |v|. The convention is that of ``history.observables``;
    approach, load, contact_area, smooth_area, film_strain, error, status: as in ``ShearHistory``; iterations: of the
    last step.
    """

    view: ClassVar[str] = "rolling"
    grid: Grid
    velocity: Array
    profile: Array
    pressure: Array
    displacement: Array
    traction: Array
    slip_ratio: Array
    stick: Array
    tangential_load: Array
    creepage: Array
    hysteresis_force: Array
    power: Array
    hysteresis_power: Array
    friction_power: Array
    approach: Array
    load: Array
    contact_area: Array
    smooth_area: Array
    film_strain: Array
    iterations: Array
    error: Array
    status: Array

    @property
    def sticking_share(self) -> Array:
        """Cells that stick over those in contact, (); 0 without contact."""
        return sticking_share(self.stick, self.pressure)
