"""Checks at the public boundary: ``ValueError`` with what was expected and what came.

Values are looked at only where they are concrete; under jit, grad and vmap they pass.
"""

from typing import Any

import numpy as np

from jaxcontact._pytree import is_concrete


def require(condition: bool, message: str) -> None:
    """Raise ``ValueError(message)`` unless the condition holds."""
    if not condition:
        raise ValueError(message)


def _values(value: Any) -> np.ndarray | None:
    return np.asarray(value, dtype=float) if is_concrete(value) else None


def positive(name: str, value: Any) -> None:
    """Every entry finite and above zero."""
    numbers = _values(value)
    if numbers is not None:
        require(
            bool(np.all(np.isfinite(numbers) & (numbers > 0))), f"{name}: expected > 0, got {_show(numbers)}"
        )


def non_negative(name: str, value: Any) -> None:
    """Every entry finite and not below zero."""
    numbers = _values(value)
    if numbers is not None:
        ok = np.all(np.isfinite(numbers) & (numbers >= 0))
        require(bool(ok), f"{name}: expected >= 0, got {_show(numbers)}")


def poisson_ratio(name: str, value: Any) -> None:
    """-1 < nu <= 0.5."""
    numbers = _values(value)
    if numbers is not None:
        ok = np.all((numbers > -1.0) & (numbers <= 0.5))
        require(bool(ok), f"{name}: expected -1 < nu <= 0.5, got {_show(numbers)}")


def not_decreasing(name: str, value: Any) -> None:
    """A one-dimensional array of at least one time, finite and not decreasing."""
    shape = np.shape(value)
    require(len(shape) == 1 and shape[0] >= 1, f"{name}: expected a 1-d array of times, got shape {shape}")
    numbers = _values(value)
    if numbers is not None:
        ok = np.all(np.isfinite(numbers)) and np.all(np.diff(numbers) >= 0)
        require(bool(ok), f"{name}: expected finite times that do not decrease, got {_show(numbers)}")


def _show(numbers: np.ndarray) -> str:
    """A number as it is, a long array by its extremes."""
    if numbers.size == 1:
        return f"{numbers.item():g}"
    if numbers.size <= 6:
        return str([float(f"{v:.6g}") for v in numbers.ravel()])
    return f"{numbers.size} values from {np.min(numbers):g} to {np.max(numbers):g}"
