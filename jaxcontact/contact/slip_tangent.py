"""The linear system of the derivatives of a contact with friction: its space, its matrix and its right sides.

Where a cell sticks its slip stays; where it slips its traction stays on the rim of the friction disc, which grows with
pressure and coefficient of friction, and turns with the slip. ``contact.implicit`` has the derivative rule.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxcontact.contact import nonsymmetric
from jaxcontact.contact.friction import FreeDirections, preconditioner
from jaxcontact.contact.normal import masked_mean
from jaxcontact.contact.partial_slip import SlipProblem
from jaxcontact.contact.tangent_solves import TANGENT_ITERATIONS, TANGENT_TOLERANCE, Subspace
from jaxcontact.operators.base import Linear, TractionOperator

ROUNDING = 1e-12  # relative size of what a projection leaves of a right side outside its space


class Displacements(NamedTuple):
    """Products K_tt q and K_tz p (2, nx, ny), K_zt q and K_zz p (nx, ny); those of coupling are zero without it."""

    along: Array
    tangential_shift: Array
    normal_shift: Array
    normal: Array

    @classmethod
    def under(cls, operator: TractionOperator, q: Array, p: Array) -> "Displacements":
        """Return the products for a traction and a pressure."""
        along, normal_shift = operator.displaced(q)
        return cls(along, operator.tangential_from_normal(p), normal_shift, operator.normal(p))

    def total(self) -> Array:
        """Return the displacements in three directions, (3, nx, ny)."""
        return jnp.concatenate([self.along + self.tangential_shift, (self.normal_shift + self.normal)[None]])


class SlipSpace(NamedTuple):
    """Space of the changes (dq, dp), (3, nx, ny), of a contact with friction, and their effect on the traction."""

    problem: SlipProblem
    active: Subspace
    free: FreeDirections

    def __call__(self, change: Array) -> Array:
        return jnp.concatenate([self.free(change[:2]), self.active(change[2])[None]])

    def traction(self, free: Array, bound: Array) -> Array:
        """Return the change of the traction: a free part, and that of slipping cells whose bound changes. Its sum is zero
        where the tangential load is given."""
        dq = bound * self.free.normal
        if self.problem.tangential_load_controlled:
            dq = dq - self.free.uniform(jnp.sum(dq, (1, 2)))
        return free + dq

    def lifted(self, dq: Array, dp: Array) -> Array:
        """Return the displacements (3, nx, ny) due to changes of traction and pressure."""
        return Displacements.under(self.problem.operator, dq, dp).total()

    def turned(self, dq: Array) -> Array:
        """Return the change due to the rotation of tractions on the rim of the friction disc, (3, nx, ny)."""
        return jnp.concatenate([self.free.curvature * self.free.along(dq), jnp.zeros((1, *dq.shape[1:]))])

    def matrix(self, change: Array) -> Array:
        """Return the linearised residual of both laws due to a change."""
        change = self(change)
        dq = self.traction(change[:2], self.problem.coefficient * change[2])
        return self(self.lifted(dq, change[2]) + self.turned(dq))

    def solve(self, operator: Linear, right: Array) -> Array:
        """Solve by BiCGSTAB with the preconditioners of the separate problems; nan if it fails."""
        tangential = preconditioner(self.problem.operator, self.free)
        normal = self.problem.operator.normal.preconditioner()
        inverse = lambda r: self(jnp.concatenate([tangential(r[:2]), normal(self.active(r[2]))[None]]))
        b = self(right)
        x, _, met = nonsymmetric.bicgstab(operator, inverse, b, TANGENT_TOLERANCE, TANGENT_ITERATIONS)
        nothing = jnp.sum(b**2) <= ROUNDING**2 * jnp.sum(right**2)
        return jnp.where(nothing, 0.0, jnp.where(met, x, jnp.nan))


def given_changes(space: SlipSpace, change: SlipProblem, p: Array) -> tuple[Array, Array]:
    """Return the changes (dq, dp) that follow directly from those of load, coefficient of friction and tangential load."""
    problem, total = space.problem, jnp.sum(p)
    dp = jnp.zeros_like(p)
    if problem.load_controlled:
        dp = p * jnp.where(total > 0.0, change.target / jnp.where(total > 0.0, total, 1.0), 0.0)
    dq = space.traction(jnp.zeros((2, *p.shape)), problem.coefficient * dp + change.coefficient * p)
    if problem.tangential_load_controlled:
        dq = dq + space.free.uniform(change.tangential_target)
    return dq, dp


def prescribed_shifts(change: SlipProblem) -> Array:
    """Return the changes of shift and approach where they are prescribed, (3, 1, 1), and zero elsewhere."""
    shift = 0.0 * change.tangential_target if change.tangential_load_controlled else change.tangential_target
    approach = 0.0 * change.target if change.load_controlled else change.target
    return jnp.append(shift, approach)[:, None, None]


def multipliers(
    space: SlipSpace, change: SlipProblem, p: Array, moved: Array, without: Array
) -> tuple[Array, Array]:
    """Return the changes of shift and approach: prescribed ones, or those with which cells that stick and cells in contact
    move; without: the change of the approach where there is no contact."""
    shift, approach = change.tangential_target, change.target
    if space.problem.tangential_load_controlled:
        shift = space.free.push(jnp.sum(space.free.along(moved[:2]), (1, 2)))
    if space.problem.load_controlled:
        approach = jnp.where(jnp.any(p > 0.0), masked_mean(moved[2], p > 0.0), without)
    return shift, approach
