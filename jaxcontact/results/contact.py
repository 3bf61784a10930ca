"""The results of a normal contact: histories, steady states and the step passed to a ``save`` function."""

import dataclasses
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.pytree import pytree, replace
from jaxcontact._support.status import Status
from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.results.labels import arrays_of, dataset, derived_of, table
from jaxcontact.results.notes import Diagnostics, Note, notes_of
from jaxcontact.results.summaries import html, is_one_result, summary

CLOSED = (
    1e-6  # gap of a cell in contact, relative to the heights of the surface, at most; the solver leaves 1e-8
)


@pytree
class ContactStep:
    """A step as passed to a ``save`` function, in SI units, with the field names of ``ContactHistory``.

    pressure, displacement and gap are maps (nx, ny); the other fields are scalars. status is that of the solver: that the
    response of the body is not accurate enough (``Status.NOT_RESOLVED``) is found for the whole run, in its result.
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
        return self.pressure > 0.0  # type: ignore[attr-defined]

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

    def plot(self, body: LayeredHalfSpace | None = None, inside: Any = None) -> Any:
        """Return a figure of the result: one sheet with the contact in cross-section, its dimensions, and its quantities.

        An axisymmetric contact is shown by pressure profiles, and approach, load, contact radius and peak pressure over
        time where they vary, with adhesion by load against approach with its jumps; a rough contact by maps of pressure,
        gap and contact, contact area against load, and the pressure distribution; sheared and rolling contacts by stick
        and slip zones and tractions; a film that forms by its thickness; steady sliding by its pressure.

        Args:
            body: the ``LayeredHalfSpace`` of the call, whose layers and materials the cross-section then names.
            inside: what ``subsurface`` returned for this result: the sheet then shows the von Mises stress as well.

        Raises:
            ValueError: body or inside is of another type.
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
        return figures.figure_of(self, body, inside)


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
    for 5 cells, 1 % for 10 and 0.13 % for 40. Cells need not be square: the longer side then counts.

    film_strain is the shortening of the film, the top layer, over its thickness at its deepest point (computed as on a
    rigid base; 0 without a film). Above 0.2 linear theory is inaccurate.

    time_step_error: estimate of the relative error of the pressure due to the time steps, in which the pressure is linear
    (``history.step_error``); within a factor of about three of the largest error of approach, load and peak pressure, and
    zero without creep. Above 1 % there is a note, above 10 % the status is 12, for the times concerned alone.

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
    Below three the pull-off load depends on the grid. Jumps are detected by the balance of energy (``history.adhering``).

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


def largest_over_time(history: ContactHistory, name: str, verb: str) -> Array:
    """Return the largest value of a map at each time, (nt,); AttributeError where there is none over time."""
    values = getattr(history, name)
    if values is None or not history._has_maps_over_time:
        raise AttributeError(
            f"peak_{name}: expected a {name} at all times, got"
            f" {f'none: {verb} was called without thermal=' if values is None else 'the last map only'}"
        )
    return jnp.max(values, (-2, -1))


def radius_of(area: Array, grid: Grid) -> Array:
    """Return the radius of a circular contact of this area [m]; in plane strain, the half-width of the contact."""
    if grid.plane_strain:
        return area / (2.0 * grid.spacing[1])
    touches = area > 0.0  # the square root is not differentiable at zero
    return jnp.where(touches, jnp.sqrt(jnp.where(touches, area, 1.0) / jnp.pi), 0.0)


def nan_where_invalid(result: Any, valid: Array | None) -> Any:
    """Return the result with all its numbers nan and status OUT_OF_RANGE where ``valid`` is false; None means valid."""
    if valid is None:
        return result
    masked = lambda a: jnp.where(valid, a, jnp.nan) if jnp.issubdtype(a.dtype, jnp.inexact) else a
    status = jnp.where(valid, result.status, int(Status.OUT_OF_RANGE))
    return replace(jax.tree.map(masked, result), status=status)
