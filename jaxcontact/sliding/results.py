"""What sliding gives back."""

import jax.numpy as jnp
from jax import Array

from jaxcontact._pytree import pytree
from jaxcontact.grid import Grid
from jaxcontact.results import ContactHistory, SteadyContact


def friction(force: Array, load: Array) -> Array:
    """force/load, zero without load."""
    return force / jnp.where(load > 0.0, load, jnp.inf)


@pytree
class SlidingHistory(ContactHistory):
    """A ``ContactHistory`` of a moving indenter, in the frame of the indenter, SI units.

    velocity (nt, 2) [m/s] of the indenter over the body; lateral_force (nt, 2) [N] of the pressure on the
    indenter, over the slope of its profile (walls steeper than 1 do not count); tangential_force (nt,) [N]: its
    part against the motion, positive when it resists, zero at rest; pressure_centre (nt, 2) [m] from the
    indenter's axis; leading_peak (nt,) [Pa]: largest pressure ahead of the axis; power (nt,) [W]
    dissipated in the body; stored_energy (nt,) [J]; dropped (nt,) [m]: bound on the displacement in
    contact that the history which left the grid would still add.

    coulomb_force (nt,) [N]: friction times load, against the motion; zero without ``friction``. It comes on top:
    ``tangential_force`` and ``friction_coefficient`` are of the pressure alone, over the slopes of the profile, and
    ``power`` and ``stored_energy`` of its work.

    Without friction tangential_force times speed plus load times rate of approach is power plus the rate of
    stored_energy, as long as nothing leaves the grid.

    status 4: a step moved farther than half the grid's width, and this and later steps are wrong; 5: the
    contact has come back to where history had left the grid, by enough to move it (``dropped`` above 1 % of
    the approach): the grid does not hold the track and the contact.
    """

    velocity: Array
    lateral_force: Array
    tangential_force: Array
    pressure_centre: Array
    coulomb_force: Array
    leading_peak: Array
    power: Array
    stored_energy: Array
    dropped: Array

    @property
    def friction_coefficient(self) -> Array:
        """tangential_force/load, (nt,), without Coulomb's; zero without load."""
        return friction(self.tangential_force, self.load)

    @property
    def total_tangential_force(self) -> Array:
        """tangential_force and coulomb_force together [N], (nt,)."""
        return self.tangential_force + self.coulomb_force


@pytree
class SteadySliding(SteadyContact):
    """Steady sliding, in the frame of the indenter, SI units.

    velocity (2,) [m/s]; profile, displacement [m] and pressure [Pa]: (nx, ny); approach [m]; load [N];
    contact_area [m^2] (a count of cells), smooth_area [m^2], film_strain, lateral_force (2,), tangential_force [N],
    coulomb_force [N], pressure_centre (2,) [m], leading_peak [Pa], iterations, error, status: as in ``SlidingHistory``;
    status 6: there is no steady state, and the numbers mean nothing.

    power [W]: what the dashpots of the body take up, from their own state; it equals tangential_force
    times speed for a profile without walls and without friction. approach_drift [m]: a half-space that flows without
    limit sinks by this much for each e-fold of the distance slid; ``approach`` is then that after one width of the grid.
    Zero otherwise.
    """

    grid: Grid
    velocity: Array
    profile: Array
    pressure: Array
    displacement: Array
    approach: Array
    approach_drift: Array
    load: Array
    contact_area: Array
    smooth_area: Array
    film_strain: Array
    lateral_force: Array
    tangential_force: Array
    coulomb_force: Array
    pressure_centre: Array
    leading_peak: Array
    power: Array
    iterations: Array
    error: Array
    status: Array

    @property
    def friction_coefficient(self) -> Array:
        """tangential_force/load, without Coulomb's; zero without load."""
        return friction(self.tangential_force, self.load)

    @property
    def total_tangential_force(self) -> Array:
        """tangential_force and coulomb_force together [N]."""
        return self.tangential_force + self.coulomb_force
