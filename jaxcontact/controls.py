"""What is prescribed: the load or the approach."""

import numpy as np
from jax import Array

from jaxcontact import _checks
from jaxcontact._checks import Verdict
from jaxcontact._pytree import pytree


class Control:
    """A prescribed history: one value held, or one per time."""

    value: Array | float


@pytree
class Load(Control):
    """Normal load, linear between the times.

    Args:
        value: [N] >= 0 and somewhere positive, a number (held) or (nt,).

    Example:
        >>> ramp = jc.Load([0.0, 30.0, 60.0])
    """

    value: Array | float


@pytree
class Approach(Control):
    """Approach of the indenter from first touch, linear between the times.

    Args:
        value: [m], a number (held) or (nt,); below zero there is no contact.

    Example:
        >>> held = jc.Approach(2.5e-6)
    """

    value: Array | float


def check_control(control: Control, nt: int) -> Verdict:
    """A Load or Approach, a number or (nt,); a load not negative and somewhere positive."""
    _checks.require(
        isinstance(control, Load | Approach), f"control: expected Load or Approach, got {control!r}"
    )
    name, shape = type(control).__name__, np.shape(control.value)
    _checks.require(
        shape in ((), (nt,)), f"{name}: expected a number or shape ({nt},) as times, got shape {shape}"
    )
    if not isinstance(control, Load):
        return _checks.finite("Approach [m]", control.value)
    not_negative = _checks.non_negative("Load [N]", control.value)
    return not_negative & _checks.somewhere_positive("Load [N]", control.value)
