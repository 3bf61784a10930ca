"""Derivatives through the contact problem; the only module with derivative rules.

On the contact area A = {p > 0} the solution obeys K_AA p - approach = -gap, with sum p given or the approach
given. Hence, for changes dK, dgap, dtarget,

    K_AA dp - d approach = -(dK p + dgap)_A,      dp = 0 off A,      sum dp = d target (load)

which is linear: conjugate gradients in the same masked, zero-mean subspace and with the same
preconditioner as the contact itself. ``custom_linear_solve`` transposes it, so forward and reverse mode
and their compositions all follow from this one rule.

A cell that is just entering or leaving contact (p = 0 and g = 0) counts as outside: the derivative is
that of the side on which it stays out. Without contact all derivatives are zero.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact import spectral
from jaxcontact.contact.normal import Problem, Solution, masked_mean, preconditioner, projected, solve

TANGENT_TOLERANCE = 1e-12
TANGENT_ITERATIONS = 400


def solve_in_contact(problem: Problem, mask: Array, right: Array) -> Array:
    """x with P K P x = P right, P the projection onto cells of the mask (and zero mean under a load)."""
    load = problem.load_controlled

    def operator(x: Array) -> Array:
        return projected(spectral.convolve(problem.spectrum, projected(x, mask, load)), mask, load)

    def preconditioned_cg(operator, b: Array) -> Array:
        inverse = preconditioner(problem.circulant)
        b = projected(b, mask, load)
        z = projected(spectral.apply_circulant(inverse, b), mask, load)
        goal = TANGENT_TOLERANCE**2 * jnp.sum(b * z)

        def going(state):
            _, _, _, descent, count = state
            return (descent > goal) & (count < TANGENT_ITERATIONS)

        def step(state):
            x, r, t, descent, count = state
            lifted = operator(t)
            curvature = jnp.sum(t * lifted)
            size = descent / jnp.where(curvature > 0.0, curvature, 1.0)
            x, r = x + size * t, r - size * lifted
            z = projected(spectral.apply_circulant(inverse, r), mask, load)
            new = jnp.sum(r * z)
            return x, r, z + (new / descent) * t, new, count + 1

        first = (jnp.zeros_like(b), b, z, jnp.sum(b * z), 0)
        return jax.lax.while_loop(going, step, first)[0]

    return jax.lax.custom_linear_solve(operator, right, preconditioned_cg, symmetric=True)


@jax.custom_jvp
def solve_contact(problem: Problem, start: Array, tolerance: Array, max_iterations: Array) -> Solution:
    """``contact.normal.solve`` with derivatives with respect to everything in ``problem``."""
    return solve(problem, start, tolerance, max_iterations)


@solve_contact.defjvp
def _solve_contact_jvp(primals, tangents):
    problem, change = primals[0], tangents[0]
    solution = solve_contact(*primals)
    p, mask = solution.pressure, solution.pressure > 0.0
    forcing = spectral.convolve(change.spectrum, p)
    if problem.load_controlled:
        total = jnp.sum(p)
        share = jnp.where(total > 0.0, change.target / jnp.where(total > 0.0, total, 1.0), 0.0)
        right = -(forcing + change.gap + share * solution.displacement)
        dp = share * p + solve_in_contact(problem, mask, right)
        du = forcing + spectral.convolve(problem.spectrum, dp)
        d_approach = masked_mean(du + change.gap, mask)
    else:
        dp = solve_in_contact(problem, mask, change.target - forcing - change.gap)
        du = forcing + spectral.convolve(problem.spectrum, dp)
        d_approach = change.target
    zero_iterations = jnp.zeros((), dtype=jax.dtypes.float0)
    tangent = Solution(dp, du, d_approach, jnp.zeros_like(solution.error), zero_iterations)
    return solution, tangent
