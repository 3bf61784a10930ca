"""Checks at the public boundary: ``ValueError`` with what was expected and what came.

Values are looked at where they are concrete. Under jit, grad and vmap they cannot be, and a check gives its
verdict as an array instead: the caller hands it on, and what it returns is then nan or marked by
``Status.OUT_OF_RANGE``, never a number. Concrete values that pass give True.
"""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.pytree import is_concrete

Verdict = Array | bool


def require(condition: bool, message: str) -> None:
    """Raise ``ValueError(message)`` unless the condition holds."""
    if not condition:
        raise ValueError(message)


def _every(name: str, value: Any, inside: Any, expected: str) -> Verdict:
    """``inside`` holds for every entry: raise if it does not, or say so later where values are not known."""
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
    """Every entry finite."""
    return _every(name, value, lambda a: abs(a) < jnp.inf, "finite numbers")


def positive(name: str, value: Any) -> Verdict:
    """Every entry finite and above zero."""
    return _every(name, value, lambda a: (a > 0) & (a < jnp.inf), "> 0")


def non_negative(name: str, value: Any) -> Verdict:
    """Every entry finite and not below zero."""
    return _every(name, value, lambda a: (a >= 0) & (a < jnp.inf), ">= 0")


def somewhere_positive(name: str, value: Any) -> Verdict:
    """Some entry above zero."""
    return _every(name, value, lambda a: (a > 0).any(), "> 0 at some time")


def poisson_ratio(name: str, value: Any) -> Verdict:
    """-1 < nu <= 0.5."""
    return _every(name, value, lambda a: (a > -1.0) & (a <= 0.5), "-1 < nu <= 0.5")


def between(name: str, value: Any, low: float, high: float) -> Verdict:
    """Every entry above ``low`` and not above ``high``."""
    return _every(name, value, lambda a: (a > low) & (a <= high), f"> {low:g} and <= {high:g}")


def whole(name: str, value: Any, low: int, high: int) -> None:
    """A whole number from ``low`` to ``high``, known before anything is traced."""
    good = isinstance(value, int | np.integer) and not isinstance(value, bool) and low <= value <= high
    require(good, f"{name}: expected {low} to {high}, got {value!r}")


def not_decreasing(name: str, value: Any) -> Verdict:
    """A one-dimensional array of at least one time, finite and not decreasing."""
    shape = np.shape(value)
    require(len(shape) == 1 and shape[0] >= 1, f"{name}: expected a 1-d array of times, got shape {shape}")
    rising = lambda a: (a[1:] >= a[:-1]).all() & (abs(a) < jnp.inf)
    return _every(name, value, rising, "finite times that do not decrease")


def one_of(name: str, value: Any, *accepted: str) -> None:
    """One of some words."""
    words = " or ".join(f'"{word}"' for word in accepted)
    require(value in accepted, f"{name}: expected {words}, got {value!r}")


def _show(numbers: np.ndarray) -> str:
    """A number as it is, a long array by its extremes."""
    if numbers.size == 1:
        return f"{numbers.item():g}"
    if numbers.size <= 6:
        return str([float(f"{v:.6g}") for v in numbers.ravel()])
    bad = numbers.size - int(np.sum(np.isfinite(numbers)))
    rest = f", {bad} of them not finite" if bad else ""
    return f"{numbers.size} values from {np.nanmin(numbers):g} to {np.nanmax(numbers):g}{rest}"
