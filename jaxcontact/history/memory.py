"""What a body remembers, as the march sees it.

A memory keeps fields of its own kind (arrays over the grid, spectra, increments: a pytree) and has four verbs.
A step of the march is

    operator, earlier, fields = memory.predict(fields, pressure, step)     before the new pressure is known
    pressure = contact(operator, profile + earlier, target)                operator(p) + earlier: the displacement
    fields = memory.update(fields, pressure, step)                         the new pressure is remembered
    observed = memory.observe(fields, pressure, step)                      what it shows beyond the contact

``step`` is the memory's own input: a time step, a shift, the row of a table.
"""

import abc
from typing import Any, NamedTuple

from jax import Array

from jaxcontact.operators.base import Operator


class Prediction(NamedTuple):
    """The coming step as far as it is known before its pressure.

    operator: of the step; earlier (nx, ny): the displacement left by all earlier pressure; fields: the memory's own;
    raised: how far growth has raised the surface since the start, (nx, ny) or 0.
    """

    operator: Operator
    earlier: Array
    fields: Any
    raised: Array | float = 0.0


class Observed(NamedTuple):
    """film_strain: shortening of the film over its thickness at its deepest point, (); more: a memory's own."""

    film_strain: Array
    more: Any


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
    def predict(self, fields: Any, pressure: Array, step: Any) -> Prediction:
        """The coming step, from the last pressure (nx, ny)."""

    @abc.abstractmethod
    def update(self, fields: Any, pressure: Array, step: Any) -> Any:
        """The fields after the step, with its new pressure."""

    @abc.abstractmethod
    def observe(self, fields: Any, pressure: Array, step: Any) -> Observed:
        """What a step shows, from the fields after it."""
