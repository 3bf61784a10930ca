"""The results of a given pressure: fields below the surface (``subsurface``), and the surface itself (``deflection``)."""

from __future__ import annotations

from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.prefixes import prefixed, told_apart
from jaxcontact._support.pytree import is_concrete, pytree
from jaxcontact._support.status import LARGEST_ERROR, Status, most_serious
from jaxcontact.bodies.grid import Grid
from jaxcontact.results.labels import arrays_of, dataset, derived_of
from jaxcontact.results.notes import IMAGE_LIMIT, Note, brief
from jaxcontact.results.summaries import interior_summary

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
