"""The results of sliding; their sign convention is that of ``history.observables``."""

import warnings
from dataclasses import field
from typing import Any, ClassVar

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.history.track import speed_of
from jaxcontact.inputs.grid import Grid
from jaxcontact.results.contact import ContactHistory, SteadyContact, closed, largest_over_time


def _over_load(force: Array, load: Array) -> Array:
    """Return force/load, zero without load."""
    return force / jnp.where(load > 0.0, load, jnp.inf)


def with_totals(fields: dict[str, Array], velocity: Array) -> dict[str, Array]:
    """Return the fields of a result with the friction power and the totals added; velocity: (..., 2), all in SI units."""
    friction_power = fields["coulomb_force"] * speed_of(velocity)
    return fields | {
        "friction_power": friction_power,
        "tangential_force": fields["hysteresis_force"] + fields["coulomb_force"],
        "power": fields["hysteresis_power"] + friction_power,
    }


def _traction(friction: Array, pressure: Array, velocity: Array) -> Array:
    """Return mu p along the velocity, (..., 2, nx, ny), from fields (..., nx, ny) and velocity (..., 2)."""
    square = jnp.sum(jnp.asarray(velocity) ** 2, -1, keepdims=True)
    direction = velocity / jnp.sqrt(jnp.where(square > 0.0, square, 1.0))
    return (friction * pressure)[..., None, :, :] * direction[..., None, None]


class _RenamedTotal:
    """The former name of the total tangential force, for one version."""

    tangential_force: Array

    @property
    def total_tangential_force(self) -> Array:
        """Deprecated name of ``tangential_force``."""
        message = "total_tangential_force: use tangential_force, which is the total"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return self.tangential_force


@pytree
class SlidingHistory(_RenamedTotal, ContactHistory):
    """A ``ContactHistory`` of a moving indenter, in the frame of the indenter, in SI units.

    velocity (nt, 2) [m/s] of the indenter over the body; friction (nx, ny): coefficient of Coulomb friction, zero without
    friction; pressure_centre (nt, 2) [m] from the indenter's axis; leading_peak (nt,) [Pa]: largest pressure ahead of the
    axis; temperature (nt, nx, ny) [K] of the surface, None without ``thermal``; stored_energy (nt,) [J]: energy
    stored in the body under the pressure; truncation_bound (nt,) [m]: bound on the displacement of the contact due to the
    part of the history that left the grid.

    Forces [N] and powers [W], (nt,), are positive if they resist the motion and are dissipated, and zero at rest. The
    totals, as a dynamometer on the holder of the indenter would measure them, are tangential_force, friction_coefficient
    (over the load) and power. Their parts are hysteresis_force and hysteresis_power of the viscoelastic body (zero on an
    elastic one), coulomb_force = sum of mu p times a cell's area, and friction_power = coulomb_force times speed. Without
    friction the totals equal the hysteresis parts. See ``history.observables`` for the convention, and for a term of the
    order of the slope of the profile times coulomb_force that is neglected. lateral_force (nt, 2) [N]: force of the
    pressure on the indenter due to the slopes of its profile (slopes above 1 are left out).

    hysteresis_force times speed plus load times rate of approach (without friction) equals hysteresis_power plus the rate
    of stored_energy, as long as no part of the history leaves the grid.

    status 4: a step moved farther than half the grid's width, and this and later steps are wrong; 5: the contact returned
    to where part of the history had left the grid, and the displacement missing there is significant
    (``truncation_bound`` above 1 % of the largest approach so far): the grid does not hold both the track and the contact;
    9: an earlier step failed, and this step depends on its history.
    """

    velocity: Array
    friction: Array
    lateral_force: Array
    tangential_force: Array
    hysteresis_force: Array
    coulomb_force: Array
    pressure_centre: Array
    leading_peak: Array
    power: Array
    hysteresis_power: Array
    friction_power: Array
    stored_energy: Array
    truncation_bound: Array
    temperature: Array | None = None

    @property
    def dropped(self) -> Array:
        """Deprecated name of ``truncation_bound``."""
        warnings.warn("dropped: use truncation_bound", DeprecationWarning, stacklevel=2)
        return self.truncation_bound

    @property
    def peak_temperature(self) -> Array:
        """The largest temperature at each time [K], (nt,). It is not available without ``thermal``, or if only the last
        map was kept."""
        return largest_over_time(self, "temperature", "slide")

    @property
    def friction_coefficient(self) -> Array:
        """The total friction coefficient tangential_force/load, (nt,); zero without load."""
        return _over_load(self.tangential_force, self.load)

    @property
    def traction(self) -> Array:
        """Tangential traction on the body [Pa]: mu p along the velocity, zero without friction.

        Its shape is (nt, 2, nx, ny), or (2, nx, ny) at the last time where ``pressure`` is (nx, ny), as ``subsurface``
        takes it.
        """
        if not self._has_maps_over_time:
            return _traction(self.friction, self.pressure, self.velocity[..., -1, :])
        return _traction(self.friction[..., None, :, :], self.pressure, self.velocity)


def sliding_history(**given: Any) -> SlidingHistory:
    """Return a history from its fields without the totals."""
    return SlidingHistory(**with_totals(given, given["velocity"]))


@pytree
class AdhesiveSlidingHistory(SlidingHistory):
    """A ``SlidingHistory`` with adhesion, in SI units.

    pressure, load, contact_area, jumps, jump_energy, cohesive_cells and tabor_number are as in ``AdhesiveHistory``. The
    energy that the body dissipates is the integral of hysteresis_power. friction_coefficient is zero under a load that
    pulls.
    """

    jumps: Array = field(kw_only=True)
    jump_energy: Array = field(kw_only=True)
    cohesive_cells: Array = field(kw_only=True)
    tabor_number: Array = field(kw_only=True)

    @property
    def in_contact(self) -> Array:
        """True for each cell whose gap is zero, whether it is pressed or pulled; of the shape of ``pressure``."""
        return closed(self)


def adhesive_sliding_history(**given: Any) -> AdhesiveSlidingHistory:
    """Return a history with adhesion from its fields without the totals."""
    return AdhesiveSlidingHistory(**with_totals(given, given["velocity"]))


@pytree
class SteadySliding(_RenamedTotal, SteadyContact):
    """Steady sliding, in the frame of the indenter, SI units.

    velocity (2,) [m/s]; profile, displacement [m] and pressure [Pa]: (nx, ny); approach [m]; load [N]; contact_area [m^2]
    (a count of cells), smooth_area [m^2], film_strain, friction (nx, ny), forces [N], powers [W], pressure_centre (2,)
    [m], leading_peak [Pa], iterations, error, status: as in ``SlidingHistory``; status 6: there is no steady state, and
    the numbers have no meaning.

    hysteresis_power [W]: dissipated in the dashpots of the body, computed from their internal variables; for a profile
    without walls it equals hysteresis_force times speed. approach_drift [m]: on a half-space with steady-state viscous
    flow, the increase of the approach for each factor e of the distance slid; ``approach`` is then that after sliding one
    width of the grid. Zero otherwise.
    """

    view: ClassVar[str] = "steady sliding"
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
    friction: Array
    lateral_force: Array
    tangential_force: Array
    hysteresis_force: Array
    coulomb_force: Array
    pressure_centre: Array
    leading_peak: Array
    power: Array
    hysteresis_power: Array
    friction_power: Array
    iterations: Array
    error: Array
    status: Array

    @property
    def friction_coefficient(self) -> Array:
        """The total friction coefficient tangential_force/load; zero without load."""
        return _over_load(self.tangential_force, self.load)

    @property
    def traction(self) -> Array:
        """Tangential traction on the body [Pa]: mu p along the velocity, (2, nx, ny); zero without friction."""
        return _traction(self.friction, self.pressure, self.velocity)
