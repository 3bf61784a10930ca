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

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array
from jax.ad_checkpoint import checkpoint_name

from jaxcontact import spectral
from jaxcontact._pytree import replace
from jaxcontact.contact import nonsymmetric
from jaxcontact.contact.normal import Problem, Solution, masked_mean, preconditioner, projected, solve

TANGENT_TOLERANCE = 1e-11
TANGENT_ITERATIONS = 400
KEPT = "pressure"  # what reverse mode keeps of a step: all that its linear solve needs


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

    def bicgstab(circulant: Array, operator, b: Array) -> Array:
        inverse = nonsymmetric.complex_preconditioner(circulant)
        precondition = lambda x: projected(spectral.apply_circulant(inverse, x), mask, load)
        b = projected(b, mask, load)
        return nonsymmetric.bicgstab(operator, precondition, b, TANGENT_TOLERANCE, TANGENT_ITERATIONS)[0]

    if not problem.symmetric:
        forward, back = (partial(bicgstab, c) for c in (problem.circulant, problem.circulant.conj()))
        return jax.lax.custom_linear_solve(operator, right, forward, transpose_solve=back)
    return jax.lax.custom_linear_solve(operator, right, preconditioned_cg, symmetric=True)


@jax.custom_jvp
def solve_contact(problem: Problem, start: Array, tolerance: Array, max_iterations: Array) -> Solution:
    """``solve`` of contact.normal or .nonsymmetric, differentiable in everything in ``problem``."""
    method = solve if problem.symmetric else nonsymmetric.solve
    return method(problem, start, tolerance, max_iterations)


@solve_contact.defjvp
def _solve_contact_jvp(primals, tangents):
    problem, change = primals[0], tangents[0]
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
        dp = share * p + solve_in_contact(problem, mask, right)
        du = forcing + spectral.convolve(problem.spectrum, dp)
        d_approach = masked_mean(du + change.gap, mask)
    else:
        dp = solve_in_contact(problem, mask, change.target - forcing - change.gap)
        du = forcing + spectral.convolve(problem.spectrum, dp)
        d_approach = change.target
    zero_iterations = jnp.zeros((), dtype=jax.dtypes.float0)
    tangent = Solution(dp, du, d_approach, jnp.zeros_like(solution.error), zero_iterations)
    return replace(solution, pressure=p), tangent
