"""An adhesive contact linearised at a solution, for its derivatives (``contact.implicit``)."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.contact.adhesive_model import Model, Move
from jaxcontact.contact.adhesive_state import faces_of, pasted, tools_of
from jaxcontact.contact.normal import Problem, Solution, masked_mean
from jaxcontact.operators.base import Linear


@pytree
class AdhesiveTangent:
    """The problem linearised at a solution, for ``contact.implicit``; gap: of the solution, (nx, ny)."""

    model: Model
    operator: Linear
    gap: Array

    @classmethod
    def of(cls, problem: Problem, found: Solution) -> AdhesiveTangent:
        """Linearise at a solution."""
        tools = tools_of(problem)
        gap = jnp.where(found.carried > 0.0, 0.0, found.displacement + problem.gap - found.approach)
        faces = faces_of(problem, found.carried > 0.0, tools.shape)
        model = Model(tools.inverse, problem.law, problem.law.stiffness(jnp.maximum(gap, 0.0)), faces)
        return cls(model, tools.operator, gap)

    def moved(self, wall: Array, approach: Array) -> Move:
        """Return the displacement that holds the cells in contact at the wall, which moves (nx, ny); linear."""
        displacement = self.model.faces.lift(pasted(wall, self.model.faces.held.shape))
        return Move(displacement, self.model.inverse(displacement), approach)

    def added(self, move: Move, change: Array) -> Move:
        """Return a move with one of the space added; linear."""
        total = move.displacement + change
        return Move(total, self.model.inverse(total), move.approach + self.model.faces.approach(change))

    def unbalanced(self, move: Move, forcing: Array, explicit: Array, load: Array) -> Array:
        """Return the tractions that a move leaves, projected, with changes of surface, attraction and load; linear."""
        tractions = jnp.zeros_like(move.pressure)
        attraction = explicit - self.model.attraction.softened(self.model.stiffness, forcing)
        given = load if self.model.faces.load_controlled else 0.0
        return self.model.tractions(*move) + self.model.balanced(tractions, attraction, given)

    def result(self, move: Move, forcing: Array, explicit: Array) -> tuple[Array, Array, Array, Array]:
        """Return the changes of pressure, displacement, approach and attraction for the whole move; linear."""
        nx, ny = self.gap.shape
        displacement, pressure = move.displacement[:nx, :ny], move.pressure[:nx, :ny]
        change = displacement + forcing - move.approach
        attraction = explicit - self.model.attraction.softened(self.model.stiffness, change)
        faces, approach = self.model.faces, move.approach
        if faces.of_zero_mean:
            pressure = pressure - masked_mean(pressure + attraction, ~faces.held)
        elif all(self.model.attraction.periodic):
            mean = jnp.mean(displacement)
            displacement, approach = displacement - mean, approach - mean
        return pressure, displacement, approach, attraction
