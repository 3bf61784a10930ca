"""Solutions of the linear systems of derivatives; ``contact.implicit`` states the systems and the derivative rules.

Each is nan where it fails. Searches stop at a residual of ``TANGENT_TOLERANCE`` of the right side.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jax.scipy.sparse.linalg import gmres

from jaxcontact.contact import nonsymmetric
from jaxcontact.contact.adhesive_model import Model
from jaxcontact.contact.linear import conjugate_gradients
from jaxcontact.contact.normal import projected
from jaxcontact.contact.window import cut, paste, place
from jaxcontact.operators.base import Linear, OnContact, Operator, unchanged

TANGENT_TOLERANCE = 1e-10
TANGENT_ITERATIONS = 400
DIRECTIONS, RESTARTS = 80, 10  # of GMRES, for systems that neither conjugate gradients nor BiCGSTAB solves
ROUNDING = 1e-14  # of a right side: what is left of it in the subspace may be an error of rounding
LEFT = 1e-7  # largest relative residual of GMRES (measured: 3e-9 for a system whose operator itself contains a solve)


class Subspace(NamedTuple):
    """Subspace of the linear solves: fields on the cells of the mask and, under a load, of zero mean."""

    mask: Array
    load_controlled: bool

    def __call__(self, values: Array) -> Array:
        return projected(values, self.mask, self.load_controlled)

    def right_side(self, values: Array) -> Array:
        """Return the part of a right side in the subspace, zero where it is rounding alone.

        That of a uniform field, by which reverse mode asks for the derivative of the load under a given one, is zero. A
        search for the solution of what rounding leaves of it fails, since the subspace is that of zero mean.
        """
        inside, size = self(values), jnp.sum(jnp.where(self.mask, values, 0.0) ** 2)
        return jnp.where(jnp.sum(inside**2) > ROUNDING**2 * size, inside, 0.0)


def conjugate_gradients_in_window(operator: Operator, inside: Subspace, right: Array) -> Array:
    """Solve in the window if it contains the mask, otherwise on the whole grid; the other of the two takes no step."""
    shape = operator.window_shape(right.shape)
    if shape is None:
        return _on_grid(operator, operator.preconditioner_on_contact(), inside, right, TANGENT_ITERATIONS)
    corner, fits = place(inside.mask, shape)
    b = inside.right_side(right)
    limits = jnp.where(fits, TANGENT_ITERATIONS, 0), jnp.where(fits, 0, TANGENT_ITERATIONS)
    within = inside._replace(mask=cut(inside.mask, corner, shape))
    restricted = operator.restricted(corner)
    plain = unchanged(restricted.preconditioner())  # as in the search for the pressure
    part = _on_grid(restricted, plain, within, cut(b, corner, shape), limits[0])
    whole = lambda: _on_grid(operator, operator.preconditioner_on_contact(), inside, b, limits[1])
    return jax.lax.cond(fits, lambda: paste(part, corner, right.shape), whole)


def _on_grid(
    operator: Operator, inverse: OnContact, inside: Subspace, right: Array, limit: Array | int
) -> Array:
    """Preconditioned conjugate gradients from zero, of at most ``limit`` iterations; nan if they fail.

    From zero: the tangent of the step before, extrapolated or not, leaves 0.2 to 0.9 of the right side
    where cells have entered contact, saves no iteration, and costs a convolution.
    """
    there, back = lambda x: inside(operator(x)), lambda r: inside(inverse(r, inside.mask))
    x, _, met = conjugate_gradients(there, back, inside.right_side(right), TANGENT_TOLERANCE, limit)
    return jnp.where(met | (limit == 0), x, jnp.nan)


def bicgstab(inside: Subspace, preconditioned: Operator, operator: Linear, right: Array) -> Array:
    """Solve with an operator that is not symmetric; nan if it fails."""
    inverse = preconditioned.preconditioner()
    b = inside.right_side(right)
    x, _, met = nonsymmetric.bicgstab(
        operator, lambda x: inside(inverse(x)), b, TANGENT_TOLERANCE, TANGENT_ITERATIONS
    )
    return jnp.where(met, x, jnp.nan)


def positive_definite_solution(model: Model, operator: Linear, right: Array) -> Array:
    """Return the solution of a system of the tangent by conjugate gradients; nan if it is not positive, or they fail."""
    inverse = lambda r: model.faces(operator(r))
    x, _, met = conjugate_gradients(model, inverse, model.faces(right), TANGENT_TOLERANCE, TANGENT_ITERATIONS)
    return jnp.where(met, x, jnp.nan)


def gmres_solution(operator: Linear, b: Array) -> Array:
    """Solve a linear system; nan if it fails."""
    x, _ = gmres(
        operator, b, tol=TANGENT_TOLERANCE, restart=DIRECTIONS, maxiter=RESTARTS, solve_method="incremental"
    )
    met = jnp.sum((b - operator(x)) ** 2) <= LEFT**2 * jnp.sum(b**2)
    return jnp.where(met, x, jnp.nan)
