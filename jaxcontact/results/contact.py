"""What a simulation gives back."""

import dataclasses
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace
from jaxcontact._support.status import Status
from jaxcontact.inputs.grid import Grid
from jaxcontact.results.labels import arrays_of, dataset, derived_of, table
from jaxcontact.results.notes import Diagnostics, Note, notes_of
from jaxcontact.results.summaries import html, is_one_result, summary


@pytree
class ContactStep:
    """One step as a ``save`` function sees it, in SI units, by the names of ``ContactHistory``.

    pressure, displacement, gap: (nx, ny); the others: numbers.
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
class Readable:
    """The base of every result of a contact: its notes, a summary of ten lines, labelled arrays on demand.

    diagnostics: the numbers that ``notes`` depend on beside the fields, ``notes.Diagnostics``.
    """

    view: ClassVar[str] = "contact"  # which figure ``plot`` draws
    diagnostics: Diagnostics = dataclasses.field(kw_only=True, default=Diagnostics())

    @property
    def notes(self) -> tuple[Note, ...]:
        """The notes on this result, in words: the warnings that a plain call issues.

        They are formed from numbers in the result, so that one computed inside ``jax.jit`` or ``jax.vmap`` has them as well
        once it is returned. Of many runs in one (``jax.vmap``), one of each kind: the worst, with the number of runs that
        have one; ``jax.tree.map(lambda a: a[i], result).notes`` are those of run i. Raises ValueError inside a
        transformation, where the numbers are not known.
        """
        return notes_of(self)

    def summary(self) -> str:
        """First, last and largest of what matters, the grid, and how far the result can be trusted."""
        return summary(self)

    def __repr__(self) -> str:
        return summary(self)

    def _repr_html_(self) -> str:
        return html(self)

    def to_xarray(self) -> Any:
        """Return fields and derived quantities as an ``xarray.Dataset`` with units and meanings; needs ``jaxcontact[io]``.

        Raises ValueError for many runs in one (``jax.vmap``): take one with ``jax.tree.map(lambda a: a[i], result)``.
        """
        _check_one(self)
        told = {"kind": type(self).__name__, "notes": "\n".join(self.notes)}
        return dataset(arrays_of(self) | derived_of(self), told)

    def plot(self) -> Any:
        """A figure: pressure profiles, and approach, load and contact radius over time; of what is not round, maps of
        pressure, gap and contact, area against load and the spread of pressures; of what is sheared or rolls, stick and slip
        and the tractions; of a steady state, its pressure."""
        from jaxcontact.results import figures

        return figures.figure_of(self)


def _check_one(result: Any) -> None:
    if not is_one_result(result):
        raise ValueError(
            f"result: expected that of one run, got a status of shape {getattr(result.status, 'shape', None)}; "
            "take one of many with jax.tree.map(lambda a: a[i], result)"
        )


@pytree
class ContactHistory(Readable):
    """A contact over time, SI units.

    times (nt,) [s]; pressure [Pa], displacement [m] (of both surfaces, towards each other): (nt, nx, ny),
    or (nx, ny) of the last time with ``save="last"`` or a function; saved: what that function
    returned, stacked over time; approach [m], load [N], contact_area [m^2] (a count of cells, derivative
    zero), smooth_area [m^2], film_strain, iterations, error, status: (nt,).

    smooth_area is the area of contact from the pressure inside and the gap outside its edge (``contact.edge``), for any
    number of patches. It is continuous in load and material parameters, and differentiable. The radius of a Hertz contact
    of at least 5 cells across is right to 0.04 of a cell, and d smooth_area/d log(load) to 0.3 % in the mean over places on
    the grid, with a root mean square error of 0.4/(cells across).

    film_strain is the film's shortening over its thickness at its deepest point (as on a rigid base; 0
    without a film). Above 0.2 the linear theory is stretched.

    status: an integer of ``Status``, with its meaning there.
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

    @property
    def gap(self) -> Array:
        """profile + displacement - approach [m], of the shape of ``pressure``; zero in contact."""
        over_time = self._has_maps_over_time
        approach = self.approach if over_time else self.approach[..., -1]
        profile = self.profile[..., None, :, :] if over_time else self.profile
        return profile + self.displacement - approach[..., None, None]

    @property
    def peak_pressure(self) -> Array:
        """The largest pressure of each time [Pa], (nt,). Of a result with the map of the last time alone there is none."""
        if not self._has_maps_over_time:
            raise AttributeError(
                "peak_pressure: expected pressures of all times, got those of the last alone, whose peak is"
                ' pressure.max(); keep all maps (save="all"), or the peaks: save=lambda step: step.pressure.max()'
            )
        return jnp.max(self.pressure, (-2, -1))

    @property
    def _has_maps_over_time(self) -> bool:
        return self.pressure.ndim == self.approach.ndim + 2  # whatever vmap has put before

    @property
    def contact_radius(self) -> Array:
        """sqrt(smooth_area/pi) [m], (nt,); in plane strain half the width of the contact."""
        return radius_of(self.smooth_area, self.grid)

    @property
    def converged(self) -> Array:
        """(nt,) bool: the step can be trusted, its status is ``Status.FINE``."""
        return self.status == Status.FINE

    def to_dataframe(self) -> Any:
        """Return all numbers over time, fields and derived, as a ``pandas.DataFrame``; units in the names of its columns."""
        _check_one(self)
        return table(arrays_of(self) | derived_of(self))


@pytree
class AdhesiveHistory(ContactHistory):
    """A ``ContactHistory`` with adhesion, SI units.

    pressure is the sum of what contact carries and of the attraction, negative where the surfaces pull on each other;
    load is its integral; contact_area and smooth_area are those of the cells whose gap is zero.

    jumps (nt,): how often the solution has left its branch since times[0], as contact snaps in or off; jump_energy
    (nt,) [J]: what was lost by that, so that of the energy lost in a cycle of approach and retraction it is the part
    of adhesion, and the rest is lost in the body; cohesive_cells (nt,): cells across the zone at the edge of contact
    in which the surfaces attract each other (pi E* w/(4 s(0)^2) on a half-space with the compliance of a cell): below
    three the pull-off load depends on the grid. Jumps are found from the energy, as ``history.adhering`` says.
    """

    jumps: Array
    jump_energy: Array
    cohesive_cells: Array


@pytree
class SteadyContact(Readable):
    """The base of steady results, with the quantities that follow from these of their fields."""

    grid: Grid
    profile: Array
    pressure: Array
    displacement: Array
    approach: Array
    smooth_area: Array
    status: Array

    @property
    def gap(self) -> Array:
        """profile + displacement - approach [m], (nx, ny); zero in contact."""
        return self.profile + self.displacement - self.approach[..., None, None]

    @property
    def peak_pressure(self) -> Array:
        """The largest pressure [Pa]."""
        return jnp.max(self.pressure, (-2, -1))

    @property
    def contact_radius(self) -> Array:
        """sqrt(smooth_area/pi) [m]; in plane strain half the width of the contact."""
        return radius_of(self.smooth_area, self.grid)

    @property
    def converged(self) -> Array:
        """Whether the state can be trusted: its status is ``Status.FINE``, () bool."""
        return self.status == Status.FINE


def radius_of(area: Array, grid: Grid) -> Array:
    """Of a round contact of this area; in plane strain its half-width."""
    if grid.plane_strain:
        return area / (2.0 * grid.spacing[1])
    touches = area > 0.0  # the root has no slope at zero
    return jnp.where(touches, jnp.sqrt(jnp.where(touches, area, 1.0) / jnp.pi), 0.0)


def marked(result: Any, valid: Array | None) -> Any:
    """The result; nan throughout, with its status, where values were out of range. None: they were not."""
    if valid is None:
        return result
    spoilt = lambda a: jnp.where(valid, a, jnp.nan) if jnp.issubdtype(a.dtype, jnp.inexact) else a
    status = jnp.where(valid, result.status, int(Status.OUT_OF_RANGE))
    return replace(jax.tree.map(spoilt, result), status=status)
