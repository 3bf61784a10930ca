"""Checks at the public boundary: ``ValueError`` with the expected and the received value.

Concrete values are checked at once. Values traced by jit, grad or vmap cannot be, and a check then returns its
verdict as an array: the caller uses it to set the result to nan or its status to
``Status.OUT_OF_RANGE``, so that no number is returned. For concrete values that pass, the verdict is True.
"""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.pytree import is_concrete, require_real

Verdict = Array | bool


def require(condition: bool, message: str) -> None:
    """Raise ``ValueError(message)`` unless the condition holds."""
    if not condition:
        raise ValueError(message)


def _every(name: str, value: Any, inside: Any, expected: str) -> Verdict:
    """Check that ``inside`` holds for every entry: raise ValueError if not, or return a verdict for traced values."""
    require_real(name, value)
    try:
        array = jnp.asarray(value, dtype=float) if not is_concrete(value) else np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: expected {expected}, got {value!r}") from None
    ok = inside(array).all()
    if is_concrete(value):
        require(bool(ok), f"{name}: expected {expected}, got {_show(np.asarray(array))}")
        return True
    return ok


def finite(name: str, value: Any) -> Verdict:
    """Check that every entry is finite."""
    return _every(name, value, lambda a: abs(a) < jnp.inf, "finite numbers")


def positive(name: str, value: Any) -> Verdict:
    """Check that every entry is finite and above zero."""
    return _every(name, value, lambda a: (a > 0) & (a < jnp.inf), "> 0")


def non_negative(name: str, value: Any) -> Verdict:
    """Check that every entry is finite and not below zero."""
    return _every(name, value, lambda a: (a >= 0) & (a < jnp.inf), ">= 0")


def since_loading(name: str, value: Any) -> Verdict:
    """Check that each time is a number and, counted from the loading, not negative."""
    return _every(name, value, lambda a: a >= 0, "times >= 0 s after the loading")


def somewhere_positive(name: str, value: Any) -> Verdict:
    """Check that some entry is above zero."""
    return _every(name, value, lambda a: (a > 0).any(), "> 0 at some time")


def poisson_ratio(name: str, value: Any) -> Verdict:
    """Check that -1 < nu <= 0.5."""
    return _every(name, value, lambda a: (a > -1.0) & (a <= 0.5), "-1 < nu <= 0.5")


def between(name: str, value: Any, low: float, high: float) -> Verdict:
    """Check that every entry is above ``low`` and not above ``high``."""
    return _every(name, value, lambda a: (a > low) & (a <= high), f"> {low:g} and <= {high:g}")


def at_most(name: str, value: Any, highest: float, hint: str) -> Verdict:
    """Check that no entry is above ``highest``; hint: what a larger value is likely to be."""
    return _every(name, value, lambda a: a <= highest, f"<= {highest:g} ({hint})")


def whole(name: str, value: Any, low: int, high: int) -> None:
    """Check for a whole number from ``low`` to ``high``, which must be concrete."""
    good = isinstance(value, int | np.integer) and not isinstance(value, bool) and low <= value <= high
    require(good, f"{name}: expected {low} to {high}, got {value!r}")


def not_decreasing(name: str, value: Any) -> Verdict:
    """Check for a one-dimensional array of at least one time, finite and non-decreasing."""
    shape = np.shape(value)
    require(len(shape) == 1 and shape[0] >= 1, f"{name}: expected a 1-d array of times, got shape {shape}")
    rising = lambda a: (a[1:] >= a[:-1]).all() & (abs(a) < jnp.inf)
    return _every(name, value, rising, "finite times that do not decrease")


def number_or_field(name: str, value: Any, shape: tuple[int, ...]) -> None:
    """Check for a number, or an array of a shape."""
    expected, given = f"a number or shape {tuple(shape)}", np.shape(value)
    require(given in ((), tuple(shape)), f"{name}: expected {expected}, got shape {given}")


def one_of(name: str, value: Any, *accepted: str) -> None:
    """Check for one of the accepted words."""
    words = " or ".join(f'"{word}"' for word in accepted)
    require(value in accepted, f"{name}: expected {words}, got {value!r}")


def _show(numbers: np.ndarray) -> str:
    """Return a number as text, or a long array by its extremes."""
    if numbers.size == 1:
        return f"{numbers.item():g}"
    if numbers.size <= 6:
        return str([float(f"{v:.6g}") for v in numbers.ravel()])
    bad = numbers.size - int(np.sum(np.isfinite(numbers)))
    rest = f", {bad} of them not finite" if bad else ""
    return f"{numbers.size} values from {np.nanmin(numbers):g} to {np.nanmax(numbers):g}{rest}"
