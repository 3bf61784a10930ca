"""The results of contacts (histories, steady states, the step passed to a ``save`` function) and of given pressures."""

from __future__ import annotations

import dataclasses
from dataclasses import field
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.fields import arrays_of, dataset, derived_of, table
from jaxcontact._support.prefixes import prefixed, told_apart
from jaxcontact._support.pytree import is_concrete, pytree
from jaxcontact._support.status import LARGEST_ERROR, Status, most_serious
from jaxcontact.bodies.body import LayeredHalfSpace
from jaxcontact.bodies.grid import Grid
from jaxcontact.history.motion import speed_of
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.results.notes import IMAGE_LIMIT, Diagnostics, Note, brief, notes_of
from jaxcontact.results.summaries import html, interior_summary, is_one_result, summary

# gap of a cell in contact, relative to the heights of the surface, at most; the solver leaves 1e-8
CLOSED = 1e-6


@pytree
class ContactStep:
    """A step as passed to a ``save`` function, in SI units, with the field names of ``ContactHistory``.

    pressure, displacement, gap, dent (None without ``hardness``) and contact_pressure (None unless the history has it) are
    maps (nx, ny); the other fields are scalars. status is that of the solver: that the response of the body is not accurate
    enough (``Status.NOT_RESOLVED``) is found for the whole run, in its result.
    """

    pressure: Array
    displacement: Array
    gap: Array
    approach: Array
    load: Array
    contact_area: Array
    smooth_area: Array
    film_strain: Array
    iterations: Array
    error: Array
    status: Array
    dent: Array | None = field(kw_only=True, default=None)
    contact_pressure: Array | None = field(kw_only=True, default=None)


@pytree
class ContactResult:
    """Base class of the contact results: notes, a short summary and labelled arrays.

    diagnostics: the numbers other than fields that ``notes`` depends on, a ``notes.Diagnostics``.
    """

    view: ClassVar[str] = "contact"  # which figure ``plot`` draws
    diagnostics: Diagnostics = dataclasses.field(kw_only=True, default=Diagnostics())

    @property
    def notes(self) -> tuple[Note, ...]:
        """The notes on this result, as text: the warnings that the call issues outside ``jax.jit`` and ``jax.vmap``.

        They are formed from numbers stored in the result, so a result computed inside ``jax.jit`` or ``jax.vmap`` has
        them as well once it is returned. A batch of runs (``jax.vmap``) has one note of each kind, that of the worst run,
        with the number of runs concerned; ``jax.tree.map(lambda a: a[i], result).notes`` are the notes of run i. Raises
        ValueError inside a transformation, where the numbers are not known.
        """
        return notes_of(self)

    @property
    def in_contact(self) -> Array:
        """True for each cell in contact, of the shape of ``pressure``."""
        carried = getattr(self, "contact_pressure", None)
        return (self.pressure if carried is None else carried) > 0.0  # type: ignore[attr-defined]

    def summary(self) -> str:
        """Return the first, last and largest values of the main quantities, the grid and the convergence status, as text."""
        return summary(self)

    def __repr__(self) -> str:
        return summary(self)

    def _repr_html_(self) -> str:
        return html(self)

    def to_xarray(self) -> Any:
        """Return fields and derived quantities as an ``xarray.Dataset`` with units and meanings; needs
        ``jaxcontact[io]``.

        Raises ValueError for a batch of runs (``jax.vmap``): select one with ``jax.tree.map(lambda a: a[i], result)``.
        """
        _check_one(self)
        attributes = {"kind": type(self).__name__, "notes": "\n".join(self.notes)}
        return dataset(arrays_of(self) | derived_of(self), attributes)

    def plot(self, body: LayeredHalfSpace | None = None, inside: Any = None, *, indenter: Any = None) -> Any:
        """Return a figure of the result: one sheet with the contact in cross-section, its dimensions, and its quantities.

        An axisymmetric contact is shown by pressure profiles, and approach, load, contact radius and peak pressure over
        time where they vary, with adhesion by load against approach with its jumps; a rough contact by maps of pressure,
        gap and contact, contact area against load, and the pressure distribution; sheared and rolling contacts by stick
        and slip zones and tractions; a film that forms by its thickness; steady sliding by its pressure.

        Args:
            body: the ``LayeredHalfSpace`` of the call, whose layers and materials the cross-section then names.
            inside: what ``subsurface`` returned for this result: the sheet then shows the von Mises stress as well.
            indenter: the indenter of the call, whose material and, if it is coated, layers the cross-section then names.

        Raises:
            ValueError: body, inside or indenter is of another type.
        """
        from jaxcontact.results import figures

        checks.require(
            body is None or isinstance(body, LayeredHalfSpace),
            f"body: expected a LayeredHalfSpace or None, got {type(body).__name__}",
        )
        checks.require(
            inside is None or getattr(inside, "view", "") == "interior",
            f"inside: expected the result of subsurface or None, got {type(inside).__name__}",
        )
        checks.require(
            indenter is None or isinstance(indenter, Indenter),
            f"indenter: expected an indenter such as Sphere or None, got {type(indenter).__name__}",
        )
        return figures.figure_of(self, body, inside, indenter)


def _check_one(result: Any) -> None:
    if not is_one_result(result):
        raise ValueError(
            f"result: expected the result of one run, got a status of shape {getattr(result.status, 'shape', None)}; "
            "select one run with jax.tree.map(lambda a: a[i], result)"
        )


@pytree
class ContactHistory(ContactResult):
    """The result of a contact over time, in SI units.

    times (nt,) [s]; pressure [Pa] and displacement [m] (of both surfaces, towards each other): (nt, nx, ny), or (nx, ny)
    at the last time with ``save="last"`` or a function; saved: the return values of that function, stacked over time;
    approach [m], load [N], contact_area [m^2] (a count of cells, with zero derivative), smooth_area [m^2], film_strain,
    iterations, error, status, time_step_error: (nt,).

    smooth_area is the contact area estimated from the pressure inside and the gap outside the contact edge
    (``contact.edge``), for any number of patches. It is continuous in load and material parameters, and differentiable.
    For a Hertz contact at least 5 cells across, the radius is accurate to 0.03 of a cell (10 cells: 0.005), and
    d smooth_area/d log(load) to 0.4 % in the mean over positions on the grid, with a root mean square error of 5 %
    for 5 cells, 1 % for 10 and 0.13 % for 40. Cells need not be square: the longer side then counts. On films thinner than
    about three cells, which respond locally, the radius is 0.04 to 0.08 of a cell too small (16 cells across the contact:
    the area by 1.8 %, 128: by 0.2 %; 0.12 of a cell on a soft film that is nearly incompressible).

    film_strain is the shortening of the film, the top layer, over its thickness at its deepest point (computed as on a
    rigid base; 0 without a film). Above 0.2 linear theory is inaccurate.

    indenter_displacement, of the shape of ``displacement`` [m], and indenter_film_strain (nt,) are those of the indenter's
    surface into the indenter, and of its own film, where it creeps or is coated; otherwise None. The displacement of the
    body is the difference.

    time_step_error: estimate of the relative error of the pressure due to the time steps, in which the pressure is linear
    (``history.time_loop``): of the largest error at any cell over the largest pressure; 0.5 to 3.5 times that in nine cases
    of ten, and zero without creep. Above 1 % there is a note, above 10 % the status is 12, for the times concerned alone.

    dent (nt, nx, ny) [m], None without ``hardness``: the depth by which the surface of the body has yielded since the first
    time; (nx, ny) at the last time where ``pressure`` is. displacement includes it: displacement - dent is elastic and
    viscous.

    status: an integer of ``Status``, which documents its meaning.
    """

    times: Array
    grid: Grid
    profile: Array
    pressure: Array
    displacement: Array
    saved: Any
    approach: Array
    load: Array
    contact_area: Array
    smooth_area: Array
    film_strain: Array
    iterations: Array
    error: Array
    status: Array
    time_step_error: Array | None = dataclasses.field(kw_only=True, default=None)
    indenter_displacement: Array | None = dataclasses.field(kw_only=True, default=None)
    indenter_film_strain: Array | None = dataclasses.field(kw_only=True, default=None)
    dent: Array | None = dataclasses.field(kw_only=True, default=None)

    @property
    def gap(self) -> Array:
        """The gap, profile + displacement - approach [m], of the shape of ``pressure``; zero in contact."""
        over_time = self._has_maps_over_time
        approach = self.approach if over_time else self.approach[..., -1]
        profile = self.profile[..., None, :, :] if over_time else self.profile
        return profile + self.displacement - approach[..., None, None]

    @property
    def peak_pressure(self) -> Array:
        """The largest pressure at each time [Pa], (nt,). It is not available where only the last pressure map was kept."""
        if not self._has_maps_over_time:
            raise AttributeError(
                "peak_pressure: expected pressures at all times, got the last map only, whose peak is"
                ' pressure.max(); keep all maps (save="all"), or the peaks: save=lambda step: step.pressure.max()'
            )
        return jnp.max(self.pressure, (-2, -1))

    @property
    def peak_dent(self) -> Array:
        """The depth of the deepest dent at each time [m], (nt,). It is not available without ``hardness``, or if only the
        last map was kept."""
        return largest_over_time(self, "dent", "the verb", "hardness")

    @property
    def _has_maps_over_time(self) -> bool:
        return self.pressure.ndim == self.approach.ndim + 2  # batch axes of vmap are in both

    @property
    def contact_radius(self) -> Array:
        """The contact radius sqrt(smooth_area/pi) [m], (nt,); in plane strain the half-width of the contact."""
        return radius_of(self.smooth_area, self.grid)

    @property
    def converged(self) -> Array:
        """True for each step that converged, i.e. whose status is ``Status.FINE``: (nt,) bool."""
        return self.status == Status.FINE

    def to_dataframe(self) -> Any:
        """Return all scalar time series, stored and derived, as a ``pandas.DataFrame`` with units in the column names."""
        _check_one(self)
        return table(arrays_of(self) | derived_of(self))


@pytree
class AdhesiveHistory(ContactHistory):
    """A ``ContactHistory`` with adhesion, in SI units.

    pressure is the contact pressure minus the attraction, which is negative where the surfaces attract each other; load is
    its integral; contact_area and smooth_area are those of the cells whose gap is zero.

    jumps (nt,): number of jumps into or out of contact since times[0], at which the solution left its branch of
    equilibria; jump_energy (nt,) [J]: energy lost by adhesion, in these jumps, since times[0]; viscous_energy (nt,) [J]:
    energy dissipated in the body since times[0], by the trapezoidal rule over the steps (nan for a thickness that changes
    in time and for the quasi-elastic correspondence). Both have zero derivatives; in a cycle that begins and ends
    without contact and relaxed, their sum is the area of the curve of load over approach, unless a tensile ``Load`` has
    separated the surfaces, which releases an unbounded energy that jump_energy does not include. cohesive_cells (nt,):
    number of cells across the zone of attraction at the contact edge, of length pi E* w/(4 s(0)^2), with E* from the
    compliance of a cell, or over which the gap grows by the range z = w/s(0) (for a ball sqrt(2 R z)) if these are fewer.
    Below three the pull-off load depends on the grid. Jumps are detected by the balance of energy (``history.normal_step``).

    tabor_number (nt,): (R w^2/(E*^2 z^3))^(1/3) of a ball, with the range z = w/s(0) and the contact modulus E* = 2/(C(t) +
    C_ball), where C(t) is the creep compliance (1 - nu) J of the material at the surface, and C_ball that of the ball, at
    the time since times[0]. Above about 5 the attraction acts as one of short range (JKR), below about 0.1 as one of long
    range (DMT). It is nan for indenters other than a ball, and summaries then leave it out.
    """

    view: ClassVar[str] = "adhesion"
    jumps: Array
    jump_energy: Array
    viscous_energy: Array
    cohesive_cells: Array
    tabor_number: Array

    @property
    def in_contact(self) -> Array:
        """True for each cell whose gap is zero, whether it is pressed or pulled; of the shape of ``pressure``."""
        return closed(self)


@pytree
class SteadyContact(ContactResult):
    """Base class of steady results, with the quantities derived from their common fields."""

    grid: Grid
    profile: Array
    pressure: Array
    displacement: Array
    approach: Array
    smooth_area: Array
    status: Array
    velocity: Array
    load: Array
    contact_area: Array
    film_strain: Array
    hysteresis_force: Array
    hysteresis_power: Array
    friction_power: Array
    power: Array
    iterations: Array
    error: Array
    contact_pressure: Array | None = field(kw_only=True, default=None)
    shear_strength: Array | None = field(kw_only=True, default=None)
    cohesive_cells: Array | None = field(kw_only=True, default=None)
    tabor_number: Array | None = field(kw_only=True, default=None)
    indenter_displacement: Array | None = field(kw_only=True, default=None)
    indenter_film_strain: Array | None = field(kw_only=True, default=None)

    @property
    def gap(self) -> Array:
        """The gap, profile + displacement - approach [m], (nx, ny); zero in contact."""
        return self.profile + self.displacement - self.approach[..., None, None]

    @property
    def peak_pressure(self) -> Array:
        """The largest pressure [Pa]."""
        return jnp.max(self.pressure, (-2, -1))

    @property
    def contact_radius(self) -> Array:
        """The contact radius sqrt(smooth_area/pi) [m]; in plane strain the half-width of the contact."""
        return radius_of(self.smooth_area, self.grid)

    @property
    def converged(self) -> Array:
        """True if the steady state converged, i.e. its status is ``Status.FINE``: () bool."""
        return self.status == Status.FINE


def closed(result: Any) -> Array:
    """Return the cells of a contact with adhesion whose gap is zero, of the shape of ``pressure``, bool."""
    relief = jnp.max(result.profile, (-2, -1)) - jnp.min(result.profile, (-2, -1))
    height = relief + jnp.max(jnp.abs(result.displacement), tuple(range(-result.displacement.ndim, 0)))
    return result.gap <= CLOSED * height


def largest_over_time(history: ContactHistory, name: str, verb: str, option: str = "thermal") -> Array:
    """Return the largest value of a map at each time, (nt,); AttributeError where there is none over time, for want of an
    option."""
    values = getattr(history, name)
    if values is None or not history._has_maps_over_time:
        raise AttributeError(
            f"peak_{name}: expected a {name} at all times, got"
            f" {f'none: {verb} was called without {option}=' if values is None else 'the last map only'}"
        )
    return jnp.max(values, (-2, -1))


def radius_of(area: Array, grid: Grid) -> Array:
    """Return the radius of a circular contact of this area [m]; in plane strain, the half-width of the contact."""
    if grid.plane_strain:
        return area / (2.0 * grid.spacing[1])
    touches = area > 0.0  # the square root is not differentiable at zero
    return jnp.where(touches, jnp.sqrt(jnp.where(touches, area, 1.0) / jnp.pi), 0.0)


# The results of contacts with friction.


def sticking_share(stick: Array, in_contact: Array) -> Array:
    """Return the number of sticking cells over the number of cells in contact, over the last two axes; 0 without contact."""
    return jnp.sum(stick, (-2, -1)) / jnp.maximum(jnp.sum(in_contact, (-2, -1)), 1)


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
    since the previous time, opposite to the traction, zero where that has a bound of zero: outside contact, and without
    friction; stick (nt, nx, ny) bool: cells in contact
    without slip at the end of the step; tangential_load (nt, 2) [N] and tangential_displacement (nt, 2) [m] of the
    indenter; dissipated (nt,) [J]: work dissipated by friction since times[0]; friction_work (nx, ny) [J/m^2]: the same
    work per unit area up to the last time, whatever ``save`` keeps, so that its sum over cells times ``grid.cell_area``
    is ``dissipated[-1]``. Both take the friction bound mu p as linear over an inner step: the error is of second order in
    the step, and zero at constant pressure (``history.friction_step``).

    displacement is the normal one, as in ``ContactHistory``; iterations counts those of both solvers in all outer
    iterations; error is the larger of the two solvers' errors. status 8: friction cannot hold the tangential load, and
    the step has no solution; 9: an earlier step failed, whose tractions, displacements and work this step starts from.

    With adhesion: contact_pressure (nt, nx, ny) [Pa], the pressure that contact carries, ``pressure`` plus the attraction
    where the gap is zero; the bound of the traction is then mu times it plus the shear strength. jumps, jump_energy (of the
    pressure alone), cohesive_cells and tabor_number as in ``AdhesiveHistory``. None without.
    """

    view: ClassVar[str] = "shear"
    traction: Array
    slip: Array
    stick: Array
    tangential_load: Array
    tangential_displacement: Array
    dissipated: Array
    friction_work: Array
    contact_pressure: Array | None = field(kw_only=True, default=None)
    jumps: Array | None = field(kw_only=True, default=None)
    jump_energy: Array | None = field(kw_only=True, default=None)
    cohesive_cells: Array | None = field(kw_only=True, default=None)
    tabor_number: Array | None = field(kw_only=True, default=None)

    @property
    def sticking_share(self) -> Array:
        """The number of sticking cells over the number of cells in contact, (nt,); 0 without contact."""
        return sticking_share(self.stick, self.in_contact)


@pytree
class SteadyRolling(SteadyContact):
    """Steady rolling, in the frame of the indenter, SI units.

    velocity (2,) [m/s]; profile and (normal) displacement [m] and pressure [Pa]: (nx, ny); traction (2, nx, ny) [Pa] on
    the body; slip_ratio (2, nx, ny): slip velocity of the body relative to the indenter over |v|, opposite to the
    traction, zero where that has a bound of zero: outside contact, and without friction; stick (nx, ny) bool;
    tangential_load (2,) [N]; creepage (2,): rigid-body slip velocity of the indenter relative to the body over |v|,
    prescribed or computed; spin [1/m]: the same of its rotation from x to y;
    moment [N m] of the tractions from x to y about the indenter's axis; hysteresis_power [W]: dissipated in the
    dashpots of a viscoelastic body under the pressure; friction_power [W]: dissipated by the tractions, |v| times
    (tangential_load times creepage + moment times spin) and, between unlike solids, where free rolling costs work too, the
    power that the pressure needs where the tractions move the surface; power [W]: their sum; hysteresis_force [N]:
    hysteresis_power over |v|, the rolling resistance without friction, positive against the motion. For a roller without
    torque, the force at the axle is power over |v|. The convention is that of ``history.memory``; approach, load,
    contact_area, smooth_area, film_strain, error, status: as in ``ShearHistory``; iterations: of the last step.

    indenter_displacement (nx, ny) [m] (normal) and indenter_film_strain: of the surface of an indenter that creeps or is
    coated, otherwise None; hysteresis_power is then that of both surfaces.

    contact_pressure (nx, ny) [Pa]: with adhesion the pressure that contact carries, ``pressure`` plus the attraction in the
    cells whose gap is zero; shear_strength (nx, ny) [Pa]; cohesive_cells and tabor_number: as in ``AdhesiveHistory``. None
    without adhesion.
    """

    view: ClassVar[str] = "rolling"
    traction: Array
    slip_ratio: Array
    stick: Array
    tangential_load: Array
    creepage: Array
    spin: Array
    moment: Array

    @property
    def sticking_share(self) -> Array:
        """The number of sticking cells over the number of cells in contact, (); 0 without contact."""
        return sticking_share(self.stick, self.in_contact)


# Results of rubbing: a contact whose film forms and wears.


@pytree
class RubbedStep(ContactStep):
    """One step as a ``save`` function of ``rub`` sees it, in SI units, by the names of ``RubbingHistory``.

    thickness and temperature (None without ``thermal``): (nx, ny); step_error: a number.
    """

    thickness: Array
    step_error: Array
    temperature: Array | None = None


@pytree
class RubbingHistory(ContactHistory):
    """A ``ContactHistory`` of a contact with film growth and wear, in SI units.

    thickness (nt, nx, ny) [m]: thickness of the film, or, with ``wears="indenter"``, of the material added to the indenter,
    which is negative where it is worn; temperature (nt, nx, ny) [K] of the surface, None without ``thermal``; both are
    (nx, ny) at the last time unless save="all"; friction_work (nx, ny) [J/m^2]: frictional work from the first time to the
    last; step_error (nt,) [m]: accumulated estimate of the error of the thickness due to the time steps, the largest value
    over the grid of each step.

    displacement is the elastic and viscous displacement minus the increase of the thickness; profile is the gap at first
    touch of the initial surfaces. With ``path=`` all maps are those of the body, position (nt, 2) [m] is that of the
    indenter on it, and moved_profile (nt, nx, ny) [m] is the profile at the position of the indenter.

    initial_indenter_film (nx, ny) [m]: with ``wears="indenter"`` the thickness of its film at the first time, zero without
    one; otherwise None, and the film is that of the body.

    With adhesion: contact_pressure (nt, nx, ny) [Pa], the pressure that contact carries, which is ``pressure`` plus the
    attraction where the gap is zero, and on which growth, wear and friction depend; jumps, jump_energy, cohesive_cells and
    tabor_number as in ``AdhesiveHistory``. None without.

    status 12: a time step is too long for the rate of growth or wear, or for the motion of the contact; 13: the film is
    thicker than the largest thickness for which its kernels were computed.
    """

    view: ClassVar[str] = "rubbing"
    thickness: Array
    friction_work: Array
    step_error: Array
    temperature: Array | None = None
    initial_indenter_film: Array | None = None
    position: Array | None = None
    moved_profile: Array | None = None
    contact_pressure: Array | None = None
    jumps: Array | None = None
    jump_energy: Array | None = None
    cohesive_cells: Array | None = None
    tabor_number: Array | None = None

    @property
    def gap(self) -> Array:
        """The gap [m], as in ``ContactHistory``, with the profile at the position of the indenter."""
        if self.moved_profile is None:
            return super().gap
        approach = self.approach if self._has_maps_over_time else self.approach[..., -1]
        return self.moved_profile + self.displacement - approach[..., None, None]

    @property
    def peak_thickness(self) -> Array:
        """The largest thickness at each time [m], (nt,). It is not available if only the last map was kept."""
        return largest_over_time(self, "thickness", "rub")

    @property
    def peak_temperature(self) -> Array:
        """The largest temperature at each time [K], (nt,). It is not available without ``thermal``, or if only the last map
        was kept."""
        return largest_over_time(self, "temperature", "rub")


# The results of sliding; their sign convention is that of ``history.memory``.


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


def _traction(result: Any, velocity: Array, over_time: bool = False) -> Array:
    """Return the shear stress of friction along the velocity, (..., 2, nx, ny), from fields (..., nx, ny), over time or not,
    and velocity (..., 2): mu p, with adhesion mu p_c + tau where the surfaces touch."""
    maps = lambda a: a[..., None, :, :] if over_time else a
    carried, strength = (getattr(result, name, None) for name in ("contact_pressure", "shear_strength"))
    shear = maps(result.friction) * (result.pressure if carried is None else carried)
    if carried is not None and strength is not None:
        shear = shear + jnp.where(carried > 0.0, maps(strength), 0.0)
    square = jnp.sum(jnp.asarray(velocity) ** 2, -1, keepdims=True)
    direction = velocity / jnp.sqrt(jnp.where(square > 0.0, square, 1.0))
    return shear[..., None, :, :] * direction[..., None, None]


@pytree
class SlidingHistory(ContactHistory):
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
    friction the totals equal the hysteresis parts. See ``history.memory`` for the convention, and for a term of the
    order of the slope of the profile times coulomb_force that is neglected. lateral_force (nt, 2) [N]: force of the
    pressure on the indenter due to the slopes of its profile (slopes above 1 are left out), of an indenter that creeps as
    it is deformed. Energies and powers are those of the body, not of an indenter that creeps.

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
        """Tangential traction on the body [Pa]: mu p along the velocity, with adhesion mu p_c + tau, zero without friction.

        Its shape is (nt, 2, nx, ny), or (2, nx, ny) at the last time where ``pressure`` is (nx, ny), as ``subsurface``
        takes it.
        """
        if not self._has_maps_over_time:
            return _traction(self, self.velocity[..., -1, :])
        return _traction(self, self.velocity, over_time=True)


def sliding_history(**given: Any) -> SlidingHistory:
    """Return a history from its fields without the totals."""
    return SlidingHistory(**with_totals(given, given["velocity"]))


@pytree
class AdhesiveSlidingHistory(SlidingHistory):
    """A ``SlidingHistory`` with adhesion, in SI units.

    pressure, load, contact_area, jumps, jump_energy, cohesive_cells and tabor_number are as in ``AdhesiveHistory``. The
    energy that the body dissipates is the integral of hysteresis_power. friction_coefficient is zero under a load that
    pulls. With friction, contact_pressure (nt, nx, ny) [Pa] is the pressure that contact carries, ``pressure`` plus the
    attraction where the gap is zero, and shear_strength (nx, ny) [Pa] that of the contact: the traction is mu p_c + tau.
    None without friction.
    """

    jumps: Array = field(kw_only=True)
    jump_energy: Array = field(kw_only=True)
    cohesive_cells: Array = field(kw_only=True)
    tabor_number: Array = field(kw_only=True)
    contact_pressure: Array | None = field(kw_only=True, default=None)
    shear_strength: Array | None = field(kw_only=True, default=None)

    @property
    def in_contact(self) -> Array:
        """True for each cell whose gap is zero, whether it is pressed or pulled; of the shape of ``pressure``."""
        return closed(self)


def adhesive_sliding_history(**given: Any) -> AdhesiveSlidingHistory:
    """Return a history with adhesion from its fields without the totals."""
    return AdhesiveSlidingHistory(**with_totals(given, given["velocity"]))


@pytree
class SteadySliding(SteadyContact):
    """Steady sliding, in the frame of the indenter, SI units.

    velocity (2,) [m/s]; profile, displacement [m] and pressure [Pa]: (nx, ny); approach [m]; load [N]; contact_area [m^2]
    (a count of cells), smooth_area [m^2], film_strain, friction (nx, ny), forces [N], powers [W], pressure_centre (2,)
    [m], leading_peak [Pa], iterations, error, status: as in ``SlidingHistory``; status 6: there is no steady state, and
    the numbers have no meaning.

    hysteresis_power [W]: dissipated in the dashpots of the body, computed from their internal variables; for a profile
    without walls it equals hysteresis_force times speed. approach_drift [m]: on a half-space with steady-state viscous
    flow, the increase of the approach for each factor e of the distance slid; ``approach`` is then that after sliding one
    width of the grid. Zero otherwise.

    indenter_displacement (nx, ny) [m] and indenter_film_strain: as in ``ContactHistory``, relaxed; None of an indenter that
    does not creep and is not coated.

    contact_pressure (nx, ny) [Pa]: with adhesion the pressure that contact carries, ``pressure`` plus the attraction in the
    cells whose gap is zero; shear_strength (nx, ny) [Pa], None without friction; cohesive_cells and tabor_number: as in
    ``AdhesiveHistory``. None without adhesion.
    """

    view: ClassVar[str] = "steady sliding"
    approach_drift: Array
    friction: Array
    lateral_force: Array
    tangential_force: Array
    coulomb_force: Array
    pressure_centre: Array
    leading_peak: Array

    @property
    def friction_coefficient(self) -> Array:
        """The total friction coefficient tangential_force/load; zero without load."""
        return _over_load(self.tangential_force, self.load)

    @property
    def traction(self) -> Array:
        """Tangential traction on the body [Pa]: mu p along the velocity, (2, nx, ny), with adhesion mu p_c + tau of the
        contact pressure and the shear strength; zero without friction."""
        return _traction(self, self.velocity)


CUT_OFF = 0.01  # of the largest displacement: a bound on what left the grid above which there is a note


@pytree
class InteriorFields:
    """Stresses and displacements below the surface, SI units.

    depths (nz,) [m]; stress (nz, 3, 3, nx, ny) [Pa], tension positive, with rows and columns in the order x, y, z;
    displacement (nz, 3, nx, ny) [m], z into the body; response_error (nz,): largest relative error of the body's response
    at each depth, over all wavelengths: that of a stress is relative to the largest component of stress, that of a
    displacement to the largest component of displacement, under waves of this length and longer ones; interfaces (n,)
    [m]: depths of the lower faces of the layers, None in a half-space without layers.
    """

    view: ClassVar[str] = "interior"
    grid: Grid
    depths: Array
    stress: Array
    displacement: Array
    response_error: Array | float = 0.0
    interfaces: Array | None = None

    @property
    def status(self) -> Array:
        """``OUT_OF_RANGE`` where a value is nan, ``NOT_RESOLVED`` where ``response_error`` exceeds 1 %, (nz,)."""
        invalid = jnp.isnan(jnp.sum(self.stress, (-4, -3, -2, -1)))
        error = jnp.broadcast_to(jnp.asarray(self.response_error), invalid.shape)
        return most_serious((invalid, Status.OUT_OF_RANGE), (error > LARGEST_ERROR, Status.NOT_RESOLVED))

    @property
    def von_mises(self) -> Array:
        """The von Mises stress, sqrt(3/2 s : s) of the stress deviator s [Pa], (nz, nx, ny); where that is zero its
        derivative is zero."""
        mean = jnp.trace(self.stress, axis1=1, axis2=2) / 3.0
        deviator = self.stress - mean[:, None, None] * jnp.eye(3)[:, :, None, None]
        square = 1.5 * jnp.sum(deviator**2, (1, 2))
        return jnp.where(square > 0.0, jnp.sqrt(jnp.where(square > 0.0, square, 1.0)), 0.0)

    @property
    def peak(self) -> tuple[Array, Array]:
        """The largest von Mises stress at the centres of cells [Pa] and its position (x, y, z), (3,) [m].

        Under friction the stress at the surface has a cusp at the edge of the contact, and the value there is too small
        (``docs/limits.md``).
        """
        field = self.von_mises
        k, i, j = jnp.unravel_index(jnp.argmax(field), field.shape)
        x, y = self.grid.axes()
        return field[k, i, j], jnp.stack([x[i], y[j], self.depths[k]])

    @property
    def notes(self) -> tuple[Note, ...]:
        """The warnings on these fields, as text: an input value, unchecked inside jit or vmap, was out of range, or the
        error of the response is large."""
        if not is_concrete(self) or not hasattr(self.stress, "__array__"):
            raise ValueError(
                "notes: expected fields with known values, got fields traced by jit, vmap or grad"
            )
        if np.isnan(np.sum(np.asarray(self.stress))):
            message = Status.OUT_OF_RANGE.message
            return (Note(message, brief(message)),)
        error = np.max(np.asarray(self.response_error))
        if not error > IMAGE_LIMIT:
            return ()
        limit = LARGEST_ERROR if error > LARGEST_ERROR else IMAGE_LIMIT
        kind = f"error of the response below the surface above {limit:g}"
        return (
            Note(
                f"the response below the surface has a relative error of up to {told_apart(float(error), limit, 1)}"
                f" (response_error)",
                kind,
                error,
            ),
        )

    def summary(self) -> str:
        """Return the largest stresses and displacements by depth, with their units."""
        return interior_summary(self)

    def __repr__(self) -> str:
        return interior_summary(self)

    def to_xarray(self) -> Any:
        """Return the fields and the von Mises stress as an ``xarray.Dataset``; needs ``jaxcontact[io]``."""
        attributes = {"kind": type(self).__name__, "notes": "\n".join(self.notes)}
        return dataset(arrays_of(self) | derived_of(self), attributes)

    def plot(self) -> Any:
        """Return a figure of the von Mises stress: a vertical section along x through its maximum, and its depth profile.

        Dashed lines are interfaces between layers, and a cross marks the maximum.
        """
        from jaxcontact.results import figures

        return figures.figure_of(self)


@pytree
class Deflection:
    """The displacement of the surface under a given pressure, SI units; made by ``deflection``.

    times (nt,) [s]; displacement (nt, nx, ny) [m] into the body, in the frame of the load; truncation_bound (nt,) [m]: bound
    on the displacement under the pressure due to history that has left the grid; response_error: largest relative error of
    the body's response on the grid, (); status (nt,): as of ``Status``.
    """

    view: ClassVar[str] = "deflection"
    grid: Grid
    times: Array
    displacement: Array
    truncation_bound: Array
    response_error: Array
    status: Array

    def __repr__(self) -> str:
        nx, ny = self.grid.shape
        what = f"Deflection of {nx} x {ny} cells at {jnp.size(self.times)} time{'s' if jnp.size(self.times) > 1 else ''}"
        if not is_concrete(self) or not hasattr(self.displacement, "__array__"):
            return what
        rows = [f"{what}: at most {prefixed(float(jnp.max(jnp.abs(self.displacement))), 'm')}"]
        return "\n".join([*rows, *(f"note: {note}" for note in self.notes)])

    @property
    def notes(self) -> tuple[Note, ...]:
        """The warnings on this result, as text. Raises ValueError while its values are traced."""
        if not is_concrete(self):
            raise ValueError(
                "notes: expected a result with known values, got one traced by jit, vmap or grad"
            )
        found = []
        for code in np.unique(np.asarray(self.status, int)):
            if code != Status.FINE:
                message = Status(int(code)).message
                found.append(Note(message, brief(message)))
        error, lost = float(self.response_error), float(jnp.max(self.truncation_bound))
        if IMAGE_LIMIT < error <= LARGEST_ERROR:
            found.append(
                Note(
                    f"the response has a relative error of up to {error:.1g}", "error of the response", error
                )
            )
        if lost > CUT_OFF * float(jnp.max(jnp.abs(self.displacement))):
            found.append(
                Note(
                    f"up to {lost:.2g} m of displacement left the grid: use a wider one",
                    "history left the grid",
                    lost,
                )
            )
        return tuple(found)

    def to_xarray(self) -> Any:
        """Return the fields as an ``xarray.Dataset`` with units and meanings; needs ``jaxcontact[io]``."""
        attributes = {"kind": type(self).__name__, "notes": "\n".join(self.notes)}
        return dataset(arrays_of(self) | derived_of(self), attributes)

    def plot(self) -> Any:
        """Return a figure of the displacement at the last time, and along x at y = 0 at all times."""
        from jaxcontact.results import figures

        return figures.figure_of(self)
