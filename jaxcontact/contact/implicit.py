"""Derivatives through the contact problem; the only module with derivative rules.

On the contact area A = {p > 0} the solution obeys K_AA p - approach = -gap, with sum p given or the approach
given. Hence, for changes dK, dgap, dtarget,

    K_AA dp - d approach = -(dK p + dgap)_A,      dp = 0 off A,      sum dp = d target (load)

which is linear: conjugate gradients in the same masked, zero-mean subspace and with the same
preconditioner as the contact itself; for an operator that is not symmetric (a complex spectrum), BiCGSTAB.
``custom_linear_solve`` transposes it, so forward and reverse mode and their compositions all follow from
this one rule.

A cell that is just entering or leaving contact (p = 0 and g = 0) counts as outside: the derivative is
that of the side on which it stays out. Without contact all derivatives are zero.
"""

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
from jax import Array
from jax.ad_checkpoint import checkpoint_name

from jaxcontact import spectral
from jaxcontact._pytree import replace
from jaxcontact.contact import nonsymmetric
from jaxcontact.contact.normal import Problem, Solution, masked_mean, preconditioner, projected, solve

TANGENT_TOLERANCE = 1e-10
TANGENT_ITERATIONS = 400
KEPT = "pressure"  # what reverse mode keeps of a step: all that its linear solve needs


def solve_in_contact(problem: Problem, mask: Array, right: Array, start: Array) -> Array:
    """x with P K P x = P right, P the projection onto cells of the mask (and zero mean under a load).

    start: where the search begins; x does not depend on it.
    """
    inside = lambda x: projected(x, mask, problem.load_controlled)
    method = _symmetric if problem.symmetric else _not_symmetric
    return method(problem, inside, right, start)


def _symmetric(problem: Problem, inside: Callable[[Array], Array], right: Array, start: Array) -> Array:
    """By conjugate gradients.

    To keep the start out of the transpose it goes through the linear system as a second unknown that
    is equal to its right side; the transposed search starts from zero.
    """
    inverse = preconditioner(problem.circulant)
    lift = lambda x: inside(spectral.convolve(problem.spectrum, x))
    precondition = lambda r: inside(spectral.apply_circulant(inverse, r))

    def conjugate_gradients(_, pair: tuple[Array, Array]) -> tuple[Array, Array]:
        b, x = inside(pair[0]), inside(pair[1])
        goal = TANGENT_TOLERANCE**2 * jnp.sum(b * precondition(b))

        def going(state):
            return (state[3] > goal) & (state[4] < TANGENT_ITERATIONS)

        def step(state):
            x, r, t, descent, count = state
            lifted = lift(t)
            curvature = jnp.sum(t * lifted)
            length = descent / jnp.where(curvature > 0.0, curvature, 1.0)
            x, r = x + length * t, r - length * lifted
            z = precondition(r)
            new = jnp.sum(r * z)
            return x, r, z + (new / descent) * t, new, count + 1

        r = b - lift(x)
        z = precondition(r)
        return jax.lax.while_loop(going, step, (x, r, z, jnp.sum(r * z), 0))[0], pair[1]

    operator = lambda pair: (lift(inside(pair[0])), pair[1])
    start = start + 0.0 * right  # both or neither must be linear when it is transposed
    return jax.lax.custom_linear_solve(operator, (right, start), conjugate_gradients, symmetric=True)[0]


def _not_symmetric(problem: Problem, inside: Callable[[Array], Array], right: Array, start: Array) -> Array:
    """By BiCGSTAB, from zero."""

    def bicgstab(circulant: Array, operator, b: Array) -> Array:
        inverse = nonsymmetric.complex_preconditioner(circulant)
        precondition = lambda x: inside(spectral.apply_circulant(inverse, x))
        return nonsymmetric.bicgstab(
            operator, precondition, inside(b), TANGENT_TOLERANCE, TANGENT_ITERATIONS
        )[0]

    operator = lambda x: inside(spectral.convolve(problem.spectrum, inside(x)))
    forward, back = (partial(bicgstab, c) for c in (problem.circulant, problem.circulant.conj()))
    return jax.lax.custom_linear_solve(operator, right, forward, transpose_solve=back)


@jax.custom_jvp
def solve_contact(problem: Problem, start: Array, tolerance: Array, max_iterations: Array) -> Solution:
    """``solve`` of contact.normal or .nonsymmetric, differentiable in everything in ``problem``."""
    method = solve if problem.symmetric else nonsymmetric.solve
    return method(problem, start, tolerance, max_iterations)


@solve_contact.defjvp
def _solve_contact_jvp(primals, tangents):
    problem, change, start = primals[0], tangents[0], tangents[1]
    solution = solve_contact(*primals)
    p = checkpoint_name(solution.pressure, KEPT)
    mask = p > 0.0
    transformed = spectral.transform(p)
    forcing = spectral.inverse(change.spectrum * transformed, p.shape)
    if problem.load_controlled:
        total = jnp.sum(p)
        share = jnp.where(total > 0.0, change.target / jnp.where(total > 0.0, total, 1.0), 0.0)
        displacement = spectral.inverse(problem.spectrum * transformed, p.shape)
        right = -(forcing + change.gap + share * displacement)
        dp = share * p + solve_in_contact(problem, mask, right, start - share * p)
        du = forcing + spectral.convolve(problem.spectrum, dp)
        d_approach = masked_mean(du + change.gap, mask)
    else:
        dp = solve_in_contact(problem, mask, change.target - forcing - change.gap, start)
        du = forcing + spectral.convolve(problem.spectrum, dp)
        d_approach = change.target
    zero_iterations = jnp.zeros((), dtype=jax.dtypes.float0)
    tangent = Solution(dp, du, d_approach, jnp.zeros_like(solution.error), zero_iterations)
    return replace(solution, pressure=p), tangent
