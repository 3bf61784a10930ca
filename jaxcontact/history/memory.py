"""What a body remembers, as the march sees it.

A memory keeps fields of its own kind (arrays over the grid, spectra, increments: a pytree) and has four methods.
A step of the march is

    operator, earlier, fields = memory.predict(fields, traction, step)     before the new traction is known
    traction = contact(operator, profile + earlier, target)                operator(t) + earlier: the displacement
    fields = memory.update(fields, traction, step)                         the new traction is remembered
    numbers = memory.observe(fields, traction, step)                       observed beyond the contact itself

``traction`` is the pressure (nx, ny) or, with friction, q_x, q_y and p, (3, nx, ny); ``earlier`` is the displacement in
the same directions. ``step`` is the memory's own input: a time step, a shift, the row of a table.
"""

import abc
from typing import Any, NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxcontact.operators.base import Operator, TractionOperator


class Prediction(NamedTuple):
    """operator: of the coming step; earlier: the displacement left by all earlier traction, of its shape; fields."""

    operator: Operator | TractionOperator
    earlier: Array
    fields: Any


class Memory(abc.ABC):
    """See the module; all scaled."""

    @property
    def inherits(self) -> bool:
        """Whether a step depends on earlier ones, static; false for an elastic body alone."""
        return True

    @abc.abstractmethod
    def start(self, shape: tuple[int, int]) -> Any:
        """Fields without history, on a grid of this shape."""

    @abc.abstractmethod
    def predict(self, fields: Any, traction: Array, step: Any) -> Prediction:
        """Return the prediction for the coming step, from the last traction."""

    @abc.abstractmethod
    def update(self, fields: Any, traction: Array, step: Any) -> Any:
        """Return the fields after the step, with its new traction."""

    @abc.abstractmethod
    def observe(self, fields: Any, traction: Array, step: Any) -> dict[str, Array]:
        """Return scaled numbers by the names of a result, ``film_strain`` among them, from the fields after the step."""


def deepest_strain(coefficients: Array, strain: Array) -> Array:
    """Shortening of the film on a rigid base at the deepest point of the hereditary integral, both (nx, ny)."""
    nx, ny = strain.shape
    deepest = jnp.unravel_index(jnp.argmax(strain), strain.shape)
    row = jnp.abs(jnp.arange(nx) - deepest[0])
    column = jnp.abs(jnp.arange(ny) - deepest[1])
    return jnp.sum(coefficients[row][:, column] * strain)
