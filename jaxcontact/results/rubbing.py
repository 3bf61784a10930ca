"""What a rubbed contact gives back."""

from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.results.contact import ContactHistory, ContactStep


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
    """A ``ContactHistory`` of surfaces that form and wear, SI units.

    thickness (nt, nx, ny) [m]: of the film, or, with ``wears="indenter"``, of what has formed on the indenter, negative
    where it is worn; temperature (nt, nx, ny) [K] of the surface, None without ``thermal``; both (nx, ny) of the last time
    unless save="all"; friction_work (nx, ny) [J/m2]: of friction from the first time to the last; step_error (nt,) [m]: sum
    of the estimated errors of the thickness by the steps in time, each the largest over the grid.

    displacement is that of the surface: elastic and viscous displacement less what has formed; profile is the gap at first
    touch of the surfaces as they are at first. status 12: a step of growth or wear is too long; 13: the film is thicker than
    what its kernels are made for.
    """

    thickness: Array
    friction_work: Array
    step_error: Array
    temperature: Array | None = None
