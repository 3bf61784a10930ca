"""What a contact with friction gives back."""

from jax import Array

from jaxcontact._pytree import pytree
from jaxcontact.results import ContactHistory, Readable


@pytree
class ShearHistory(ContactHistory):
    """A ``ContactHistory`` with friction, SI units; fields that are (nt, ...) are those of the last time with save="last".

    traction (nt, 2, nx, ny) [Pa] on the body; slip (nt, 2, nx, ny) [m]: of the body over the indenter since the time
    before, opposite to the traction, zero off contact; stick (nt, nx, ny) bool: in contact without slip at the
    end of the step; tangential_load (nt, 2) [N] and tangential_displacement (nt, 2) [m] of the indenter; dissipated
    (nt,) [J]: by friction since times[0].

    displacement is the normal one, as in ``ContactHistory``; iterations are those of all rounds and both solvers;
    error is the larger of the two. status 8: friction cannot hold the tangential load, and the step has no solution.
    """

    traction: Array
    slip: Array
    stick: Array
    tangential_load: Array
    tangential_displacement: Array
    dissipated: Array

    __repr__ = Readable.__str__
