"""Results of rubbing: a contact whose film forms and wears."""

from typing import ClassVar

from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.results.contact import ContactHistory, ContactStep, largest_over_time


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

    status 12: a time step is too long for the rate of growth or wear, or for the motion of the contact; 13: the film is
    thicker than the largest thickness for which its kernels were computed.
    """

    view: ClassVar[str] = "rubbing"
    thickness: Array
    friction_work: Array
    step_error: Array
    temperature: Array | None = None
    position: Array | None = None
    moved_profile: Array | None = None

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
