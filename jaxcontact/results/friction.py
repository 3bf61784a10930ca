"""The results of contacts with friction."""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.grid import Grid
from jaxcontact.results.contact import ContactHistory, ContactStep, SteadyContact


def sticking_share(stick: Array, pressure: Array) -> Array:
    """Return the number of sticking cells over the number of cells in contact, over the last two axes; 0 without contact."""
    return jnp.sum(stick, (-2, -1)) / jnp.maximum(jnp.sum(pressure > 0.0, (-2, -1)), 1)


@pytree
class ShearStep(ContactStep):
    """A step as passed to a ``save`` function of ``shear``, in SI units, with the field names of ``ShearHistory``.

    traction and slip (since the previous time): (2, nx, ny); stick: (nx, ny); tangential_load and
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

    traction (nt, 2, nx, ny) [Pa] on the body; slip (nt, 2, nx, ny) [m]: displacement of the body relative to the indenter
    since the previous time, opposite to the traction, zero outside contact; stick (nt, nx, ny) bool: cells in contact
    without slip at the end of the step; tangential_load (nt, 2) [N] and tangential_displacement (nt, 2) [m] of the
    indenter; dissipated (nt,) [J]: work dissipated by friction since times[0]; friction_work (nx, ny) [J/m^2]: the same
    work per unit area up to the last time, whatever ``save`` keeps, so that its sum over cells times ``grid.cell_area``
    is ``dissipated[-1]``. Both take the friction bound mu p as linear over an inner step: the error is of second order in
    the step, and zero at constant pressure (``history.shear_march``).

    displacement is the normal one, as in ``ContactHistory``; iterations counts those of both solvers in all outer
    iterations; error is the larger of the two solvers' errors. status 8: friction cannot hold the tangential load, and
    the step has no solution; 9: an earlier step failed, whose tractions, displacements and work this step starts from.
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
        """The number of sticking cells over the number of cells in contact, (nt,); 0 without contact."""
        return sticking_share(self.stick, self.pressure)


@pytree
class SteadyRolling(SteadyContact):
    """Steady rolling, in the frame of the indenter, SI units.

    velocity (2,) [m/s]; profile and (normal) displacement [m] and pressure [Pa]: (nx, ny); traction (2, nx, ny) [Pa] on
    the body; slip_ratio (2, nx, ny): slip velocity of the body relative to the indenter over |v|, opposite to the
    traction, zero outside contact; stick (nx, ny) bool; tangential_load (2,) [N]; creepage (2,): rigid-body slip velocity
    of the indenter relative to the body over |v|, prescribed or computed; hysteresis_power [W]: dissipated in the
    dashpots of a viscoelastic body under the pressure; friction_power [W]: dissipated by the tractions, tangential_load
    times creepage times |v| and, between unlike solids, where free rolling costs work too, the power that the pressure
    needs where the tractions move the surface; power [W]: their sum; hysteresis_force [N]: hysteresis_power over |v|, the
    rolling resistance without friction, positive against the motion. For a roller without torque, the force at the axle is
    power over |v|. The convention is that of ``history.observables``; approach, load, contact_area, smooth_area,
    film_strain, error, status: as in ``ShearHistory``; iterations: of the last step.
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
        """The number of sticking cells over the number of cells in contact, (); 0 without contact."""
        return sticking_share(self.stick, self.pressure)
