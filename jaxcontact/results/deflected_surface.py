"""The displacement of a surface that ``deflection`` returns."""

from __future__ import annotations

from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.prefixes import prefixed
from jaxcontact._support.pytree import is_concrete, pytree
from jaxcontact._support.status import LARGEST_ERROR, Status
from jaxcontact.bodies.grid import Grid
from jaxcontact.results.labels import arrays_of, dataset, derived_of
from jaxcontact.results.notes import IMAGE_LIMIT, Note, brief

CUT_OFF = 0.01  # of the largest displacement: a bound on what left the grid above which there is a note


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
