"""The quadratic model of the energy of an adhesive contact, and its minimum by preconditioned conjugate gradients.

Some cells are held at the wall; displacements change in the space that this leaves. The model is K^-1 less the softening by
the attraction, and may have directions of negative curvature.

Source: J. Nocedal, S. J. Wright, Numerical Optimization, 2006, sections 7.1 and 16.7.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, static
from jaxcontact.contact.attraction import Attraction
from jaxcontact.contact.normal import masked_mean
from jaxcontact.operators.base import Linear

MOST_DIRECTIONS = 80  # of conjugate gradients in one minimisation


class Move(NamedTuple):
    """A change of the displacement on the padded grid, of K^-1 times it, and of the approach."""

    displacement: Array
    pressure: Array
    approach: Array


class Goal(NamedTuple):
    """When a minimisation stops; r is the residual of the tractions, and K r the displacement that it causes.

    reduction: of the norm sqrt(<r, K r>), relative to the first r; descent: the value of <r, K r> to reach instead, if it
    is not zero; enough: the largest displacement K r at which the minimisation stops in any case.
    """

    reduction: Array
    enough: Array
    descent: Array


@pytree
class HeldCells:
    """The space in which displacements change while some cells are held at the wall.

    held: (mx, my) bool. Under a load the held cells move together, with the approach; under an approach on a periodic grid
    (``of_zero_mean``) changes have zero mean.
    """

    held: Array
    load_controlled: bool = static()
    of_zero_mean: bool = static()

    def __call__(self, values: Array) -> Array:
        """Return the orthogonal projection onto the space."""
        free = jnp.where(self.held, 0.0, values)
        if self.of_zero_mean:
            return free - jnp.where(self.held, 0.0, masked_mean(values, ~self.held))
        if self.load_controlled:
            return free + jnp.where(self.held, masked_mean(values, self.held), 0.0)
        return free

    def lift(self, values: Array) -> Array:
        """Return a displacement with the given values on the held cells, and of zero mean where it must be."""
        held = jnp.where(self.held, values, 0.0)
        if not self.of_zero_mean:
            return held
        spread = -jnp.sum(held) / jnp.maximum(jnp.sum(~self.held), 1)
        return held + jnp.where(self.held, 0.0, spread)

    def approach(self, change: Array) -> Array:
        """Return the approach that goes with a displacement of the space, ()."""
        return masked_mean(change, self.held) if self.load_controlled else jnp.zeros(())


@pytree
class Model:
    """The tangent of the tractions at a state: K^-1 less the softening by attraction.

    stiffness: of the attraction at its points.
    """

    inverse: Linear
    attraction: Attraction
    stiffness: Array
    faces: HeldCells

    def __call__(self, change: Array) -> Array:
        """Return the change of the tractions for a displacement of the space, projected; symmetric."""
        return self.tractions(change, self.inverse(change), self.faces.approach(change))

    def tractions(self, displacement: Array, pressure: Array, approach: Array) -> Array:
        """Return the change of the tractions for a displacement, K^-1 times it and an approach, projected."""
        nx, ny = self.shape
        softened = self.attraction.softened(self.stiffness, displacement[:nx, :ny] - approach)
        return self.balanced(pressure, -softened)

    def balanced(self, pressure: Array, attraction: Array, load: Array | float = 0.0) -> Array:
        """Return pressures (mx, my) and attraction (nx, ny) that are not balanced by contact or load, projected."""
        nx, ny = self.shape
        left = pressure.at[:nx, :ny].add(jnp.where(self.faces.held[:nx, :ny], 0.0, attraction))
        if self.faces.load_controlled:
            apart = jnp.sum(jnp.where(self.faces.held[:nx, :ny], 0.0, attraction)) + load
            left = left - jnp.where(self.faces.held, apart / jnp.maximum(jnp.sum(self.faces.held), 1), 0.0)
        return self.faces(left)

    @property
    def shape(self) -> tuple[int, int]:
        """Cells of the grid inside the padded one."""
        squares, periodic = self.stiffness.shape[-2:], self.attraction.periodic
        nx, ny = (n if wraps else n - 1 for n, wraps in zip(squares, periodic, strict=True))
        return nx, ny


class _Inner(NamedTuple):
    change: Array
    lifted: Array  # K^-1 times it
    residual: Array
    direction: Array
    descent: Array
    taken: Array
    bent: Array
    going: Array


def minimised(
    model: Model, preconditioner: Linear, start: Move, residual: Array, goal: Goal, reach: Array
) -> tuple[Move, Array, Array, Goal]:
    """Return the minimum of the model, the iterations taken, whether it has none and the goal of a repetition with more
    cells held, from a start that leaves ``residual`` of the tractions.

    They end at a direction of negative curvature, which is followed as far as the attraction reaches. What is left then
    may be more than in the beginning, so that a repetition has a goal of its own.
    """
    faces = model.faces
    inverse = lambda r: faces(preconditioner(r))
    z = inverse(residual)
    descent = jnp.sum(residual * z)
    least = jnp.where(goal.descent > 0.0, goal.descent, goal.reduction**2 * descent)
    unmet = lambda z, descent: (descent > least) & (jnp.max(jnp.abs(z)) > goal.enough)

    def step(s: _Inner) -> _Inner:
        lifted = model.inverse(s.direction)
        tangent = model.tractions(s.direction, lifted, faces.approach(s.direction))
        curvature = jnp.sum(s.direction * tangent)
        bent = curvature <= 0.0
        far = reach / jnp.max(jnp.abs(s.direction))
        size = jnp.where(bent, far, s.descent / jnp.where(bent, 1.0, curvature))
        change, total = s.change + size * s.direction, s.lifted + size * lifted
        left = s.residual - size * tangent
        z = inverse(left)
        new = jnp.sum(left * z)
        direction = z + (new / jnp.where(s.descent > 0.0, s.descent, 1.0)) * s.direction
        going = ~bent & unmet(z, new) & (s.taken + 1 < MOST_DIRECTIONS)
        return _Inner(change, total, left, direction, new, s.taken + 1, bent, going)

    zero = jnp.zeros_like(z)
    # one direction at least, since what is left over may be small, but not the rest of the stopping error
    first = _Inner(zero, zero, residual, z, descent, jnp.zeros((), int), jnp.asarray(False), descent > 0.0)
    found = jax.lax.while_loop(lambda s: s.going, step, first)
    move = Move(
        start.displacement + found.change,
        start.pressure + found.lifted,
        start.approach + faces.approach(found.change),
    )
    return move, found.taken, found.bent, goal._replace(descent=jnp.where(found.bent, 0.0, least))
