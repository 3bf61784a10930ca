"""Interface of the memory of a body in the march.

A memory keeps fields of its own kind (arrays over the grid, spectra, increments: a pytree) and has four methods.
A step of the march is

    operator, earlier, fields, raised = memory.predict(fields, traction, step)     before the new traction is known
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

from jaxcontact.history.step_error import Delayed
from jaxcontact.operators.base import Operator, TractionOperator


class Prediction(NamedTuple):
    """The coming step as far as it is known before its traction.

    operator: of the step; earlier: the displacement left by all earlier traction, of its shape; fields: the memory's own;
    raised: how far growth has raised the surface since the start, (nx, ny) or 0.
    """

    operator: Operator | TractionOperator
    earlier: Array
    fields: Any
    raised: Array | float = 0.0


class Memory(abc.ABC):
    """See the module; all scaled."""

    @property
    def inherits(self) -> bool:
        """True if a step depends on earlier ones (static); false only for an elastic body."""
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

    def stored_energy(self, fields: Any, pressure: Array) -> Array:
        """Return the elastic energy that the body stores under a pressure, (), nan where it is not known; scaled."""
        return jnp.asarray(jnp.nan)

    @abc.abstractmethod
    def delayed(self, fields: Any, pressure: Array) -> Delayed:
        """Return the delayed compliance under a pressure (nx, ny), from the fields after a step."""

    @abc.abstractmethod
    def observe(self, fields: Any, traction: Array, step: Any) -> dict[str, Array]:
        """Return scaled numbers by the names of a result, ``film_strain`` among them, from the fields after the step."""
