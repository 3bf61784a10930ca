"""What is prescribed: the load or the approach."""

from jax import Array

from jaxcontact._pytree import pytree


class Control:
    """A prescribed history: one value held, or one per time."""

    value: Array | float


@pytree
class Load(Control):
    """Normal load [N], a number or (nt,), linear between the times."""

    value: Array | float


@pytree
class Approach(Control):
    """Approach of the indenter from first touch [m], a number or (nt,), linear between the times."""

    value: Array | float
