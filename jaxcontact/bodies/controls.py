"""Prescribed histories: the normal load or the approach and, with friction, the tangential load or displacement."""

from typing import Any

import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import is_concrete, pytree


class Control:
    """A prescribed normal history: a constant value, or one value per time."""

    value: Array | float


@pytree
class Load(Control):
    """A prescribed normal load, linear between the times.

    Args:
        value: load [N] >= 0 and positive at some time, a number (constant) or (nt,). With adhesion it may be negative.

    Example:
        >>> ramp = jc.Load([0.0, 30.0, 60.0])
    """

    value: Array | float


@pytree
class Approach(Control):
    """A prescribed approach of the indenter from first touch, linear between the times.

    Args:
        value: approach [m], a number (constant) or (nt,). Without adhesion there is no contact at negative values.

    Example:
        >>> constant = jc.Approach(2.5e-6)
    """

    value: Array | float


def check_control(control: Control, nt: int, *, adhesive: bool = False) -> Verdict:
    """Check a Load or Approach, a number or (nt,); a load without adhesion is non-negative and positive at some time."""
    if not isinstance(control, Load | Approach):
        raise ValueError(f"control: expected Load or Approach, got {control!r}")
    name, shape = type(control).__name__, np.shape(control.value)
    checks.require(
        shape in ((), (nt,)), f"{name}: expected a number or shape ({nt},) as times, got shape {shape}"
    )
    if not isinstance(control, Load):
        return checks.finite("Approach [m]", control.value)
    if adhesive:
        return checks.finite("Load [N]", control.value)
    not_negative = checks.non_negative("Load [N]", control.value)
    return not_negative & checks.somewhere_positive("Load [N]", control.value)


class TangentialControl:
    """A prescribed tangential history: a constant vector, or one vector per time."""

    value: Array


@pytree
class TangentialLoad(TangentialControl):
    """Tangential load on the indenter, transmitted to the body as traction; linear between the times.

    Args:
        value: load (x, y) [N], (2,) (constant) or (nt, 2), smaller than friction coefficient times normal load.

    Example:
        >>> reversed_load = jc.TangentialLoad([[0.0, 0.0], [5.0, 0.0], [-5.0, 0.0]])
    """

    value: Array


@pytree
class TangentialDisplacement(TangentialControl):
    """Tangential displacement of the indenter from its position at first touch, linear between the times.

    Args:
        value: displacement (x, y) [m], (2,) (constant) or (nt, 2).

    Example:
        >>> constant = jc.TangentialDisplacement((1e-7, 0.0))
    """

    value: Array


def check_tangential(control: TangentialControl, nt: int) -> Verdict:
    """Check a TangentialLoad or TangentialDisplacement: (2,) or (nt, 2), finite."""
    checks.require(
        isinstance(control, TangentialLoad | TangentialDisplacement),
        f"tangential: expected TangentialLoad or TangentialDisplacement, got {control!r}",
    )
    name = type(control).__name__
    checks.require(
        is_concrete(control.value) or not isinstance(control.value, list | tuple),
        f"{name}: expected an array inside jit, vmap and grad, got a {type(control.value).__name__} of traced numbers:"
        " join them by jnp.stack",
    )
    shape = np.shape(control.value)
    checks.require(
        shape in ((2,), (nt, 2)), f"{name}: expected shape (2,) or ({nt}, 2) as times, got shape {shape}"
    )
    return checks.finite(name, control.value)


def check_friction(friction: Any, cells: tuple[int, ...]) -> Verdict:
    """Check a coefficient of friction: a number or a field of shape ``cells``, non-negative; raise ValueError otherwise."""
    checks.number_or_field("friction", friction, cells)
    return checks.non_negative("friction", friction)
