"""Derivatives through the contact problem; the only module with derivative rules.

On the contact area A = {p > 0} the solution obeys K_AA p - approach = -gap, with sum p given or the approach
given. Hence, for changes dK, dgap, dtarget,

    K_AA dp - d approach = -(dK p + dgap)_A,      dp = 0 off A,      sum dp = d target (load)

which is linear: conjugate gradients in the same masked, zero-mean subspace, with the same preconditioner and
in the same window as the contact itself; for an operator that is not symmetric, BiCGSTAB. An operator is
linear in its leaves, so that dK p is the operator of the tangent. ``custom_linear_solve`` transposes the
solve, so forward and reverse mode and their compositions all follow from this one rule.

A cell that is just entering or leaving contact (p = 0 and g = 0) counts as outside: the derivative is
that of the side on which it stays out. Without contact no derivative of the pressure is left. Under a load of zero the
approach follows the lowest point of the surface less that of the profile; without history its derivative is zero. A
derivative whose linear solve fails is nan.

With adhesion (``contact.adhesive``) the cells that touch are held, on the others the attraction follows the gap, and the
tangent is that of Newton's method, found by conjugate gradients for the displacement. Under the given control it is
positive on a branch of stable states and ceases to be so where the branch ends: conjugate gradients that meet a direction of
negative curvature give nan. (Without the sign it would be a number that means nothing.) Beyond a jump derivatives are
those of the new branch; that the jump itself moves is not in them. On a moving body (``contact.adhesive_sliding``) the odd
part of the operator acts on the change of the pressure as a part of the gap, and the change is found by GMRES.

With friction the sets of stick and slip are held as well: where a cell sticks its slip stays, where it slips its
traction stays on the rim, which grows with pressure and coefficient of friction, and turns with the slip
(``contact.friction``). Pressure and traction then follow from one linear system, by BiCGSTAB; in rolling, whose
operator is nearly skew, by GMRES.

First derivatives go over into those of the continuous problem as cells shrink. Second derivatives do not:
they are those of the discrete problem with its area of contact held, and miss what the moving edge adds
(under a given approach the load of an elastic body is piecewise linear: the second derivative is zero).
Differences of gradients over steps in which many cells enter see the edge.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.ad_checkpoint import checkpoint_name
from jax.flatten_util import ravel_pytree

from jaxcontact._support.pytree import replace
from jaxcontact.contact import adhesive, adhesive_sliding, nonsymmetric, partial_slip
from jaxcontact.contact.adhesive_state import Start
from jaxcontact.contact.adhesive_tangent import AdhesiveTangent
from jaxcontact.contact.friction import TangentialSolution, free_directions
from jaxcontact.contact.normal import Problem, Solution, solve
from jaxcontact.contact.partial_slip import Round, SlipProblem
from jaxcontact.contact.slip_tangent import (
    Displacements,
    SlipSpace,
    given_changes,
    multipliers,
    prescribed_shifts,
)
from jaxcontact.contact.tangent_solves import (
    Subspace,
    bicgstab,
    conjugate_gradients_in_window,
    gmres_solution,
    positive_definite_solution,
)
from jaxcontact.operators.base import Linear

KEPT = "pressure"  # what reverse mode keeps of a step, as far as it is needed, so that no contact is solved again: the
# pressure, from which the linear solve follows, displacement and approach; with friction the whole solution


def solve_in_contact(problem: Problem, mask: Array, right: Array) -> Array:
    """x with P K P x = P right, P the projection onto cells of the mask (and zero mean under a load)."""
    operator, inside = problem.operator, Subspace(mask, problem.load_controlled)
    on_mask = lambda x: inside(operator(inside(x)))
    if operator.symmetric:
        # closes over nothing whose derivative it does not want: jax 0.10 fails on what is left of such a one
        search = lambda _, b: conjugate_gradients_in_window(operator, inside, b)
        return jax.lax.custom_linear_solve(on_mask, right, search, symmetric=True)
    there, back = (partial(bicgstab, inside, k) for k in (operator, operator.transpose()))
    return jax.lax.custom_linear_solve(on_mask, right, there, transpose_solve=back)


@jax.custom_jvp
def solve_contact(problem: Problem, start: Array, tolerance: Array, max_iterations: Array) -> Solution:
    """``solve`` of contact.normal or .nonsymmetric, differentiable in everything in ``problem``."""
    method = solve if problem.operator.symmetric else nonsymmetric.solve
    return method(problem, start, tolerance, max_iterations)


@jax.custom_jvp
def known_contact(problem: Problem, solution: Solution) -> Solution:
    """Return a solution that ``solve_contact`` has found for this problem, with its derivatives."""
    return solution


@known_contact.defjvp
def _known_contact_jvp(primals, tangents):
    return _moved_contact(primals[0], primals[1], tangents[0])


@solve_contact.defjvp
def _solve_contact_jvp(primals, tangents):
    return _moved_contact(primals[0], solve_contact(*primals), tangents[0])


def _moved_contact(problem: Problem, solution: Solution, change: Problem) -> tuple[Solution, Solution]:
    """Return a solution, which reverse mode keeps, and its change; linear in the change of the problem."""
    kept = solution.pressure, solution.displacement, solution.approach
    p, u, approach = (checkpoint_name(a, KEPT) for a in kept)
    law = problem.law
    mask = law.free(p)
    forcing, target = problem.operator.tangent(change.operator, p) + change.gap, change.target
    prescribed = jnp.zeros_like(p)
    if law.prescribes:
        prescribed = law.prescribed_change(change.law, p)
        forcing = forcing + problem.operator(prescribed)
        target = target - jnp.sum(prescribed) if problem.load_controlled else target
    if problem.load_controlled:
        dp, d_approach = _under_load(problem, change, p, mask, forcing, target)
    else:
        dp, d_approach = solve_in_contact(problem, mask, target - forcing), target
    du = forcing - change.gap + problem.operator(dp)
    zero_iterations = jnp.zeros((), dtype=jax.dtypes.float0)
    tangent = Solution(dp + prescribed, du, d_approach, jnp.zeros_like(solution.error), zero_iterations)
    return replace(solution, pressure=p, displacement=u, approach=approach), tangent


def _under_load(
    problem: Problem, change: Problem, p: Array, mask: Array, forcing: Array, target: Array
) -> tuple[Array, Array]:
    """Return the tangents of the free pressures, whose sum changes by ``target``, and of the approach.

    The change of the sum scales the free pressures. Without contact the approach is that of first touch;
    where the law prescribes the pressure of every cell in contact it is not determined, and its tangent is nan.
    """
    # the pressure itself where that is the same, so that it is transformed once for all convolutions
    free = jnp.where(mask, p, 0.0) if problem.law.prescribes else p
    total = jnp.sum(free)
    over_total = jnp.where(total > 0.0, 1.0 / jnp.where(total > 0.0, total, 1.0), 0.0)
    share = target * over_total
    dp = share * free + solve_in_contact(problem, mask, -(forcing + share * problem.operator(free)))
    # <free, K dp + forcing> = d approach sum free, with K^T free in place of the convolution of dp
    back = problem.operator.transpose()(free)
    d_approach = jnp.sum(back * dp + free * forcing) * over_total
    without = _first_touch(problem, change)
    if problem.law.prescribes:
        without = jnp.where(jnp.any(problem.law.touching(p)), jnp.nan, without)
    return dp, jnp.where(total > 0.0, d_approach, without)


def _first_touch(problem: Problem | SlipProblem, change: Problem | SlipProblem) -> Array:
    """Return the tangent of the approach at a load of zero (``normal.approach_of``), zero without history."""
    return change.gap.ravel()[jnp.argmin(problem.gap)] - change.lowest


@jax.custom_jvp
def solve_partial_slip(
    problem: SlipProblem, pressure: Array, traction: Array, tolerance: Array, max_iterations: Array
) -> Round:
    """``contact.partial_slip.solve``, differentiable in everything in ``problem``."""
    return partial_slip.solve(problem, pressure, traction, tolerance, max_iterations)


@jax.custom_jvp
def solve_adhesive(problem: Problem, start: Start, tolerance: Array, max_iterations: Array) -> Solution:
    """``solve`` of contact.adhesive, differentiable in everything in ``problem``."""
    return adhesive.solve(problem, start, tolerance, max_iterations)


@solve_adhesive.defjvp
def _solve_adhesive_jvp(primals, tangents):
    found = solve_adhesive(*primals)
    found = jax.tree.map(lambda a: checkpoint_name(a, KEPT), found)
    return found, _moved_solution(primals[0], found, tangents[0])


def _moved_solution(problem: Problem, found: Solution, change: Problem) -> Solution:
    """Return the change of the solution of a contact with adhesion; linear in the change of the problem."""
    tangent = AdhesiveTangent.of(problem, found)
    held, nowhere = found.carried > 0.0, jnp.zeros_like(found.pressure)
    assert found.separated is not None
    forcing = problem.operator.tangent(change.operator, found.pressure) + change.gap
    explicit = problem.law.explicit(change.law.law, tangent.gap)
    given = nowhere[0, 0] if problem.load_controlled else change.target
    start = tangent.moved(jnp.where(held, given - forcing, 0.0), given)
    right = tangent.unbalanced(start, forcing, explicit, change.target)
    right = jnp.where(found.separated, 0.0, right)
    search = lambda _, b: positive_definite_solution(tangent.model, tangent.operator, b)
    rest = jax.lax.custom_linear_solve(tangent.model, -right, search, symmetric=True)
    dp, du, d_approach, attraction = tangent.result(tangent.added(start, rest), forcing, explicit)
    apart = lambda a, otherwise: jnp.where(found.separated, otherwise, a)
    no = lambda a: np.zeros(jnp.shape(a), jax.dtypes.float0)
    return Solution(
        apart(dp, nowhere),
        apart(du + forcing - change.gap, nowhere),
        apart(d_approach, _first_touch(problem, change)),
        jnp.zeros_like(found.error),
        no(found.iterations),
        apart(jnp.where(held, dp + attraction, 0.0), nowhere),
        no(found.separated),
        no(found.unstable),
    )


@jax.custom_jvp
def solve_adhesive_sliding(
    problem: Problem, start: Start, tolerance: Array, max_iterations: Array
) -> Solution:
    """``solve`` of contact.adhesive_sliding, differentiable in everything in ``problem``."""
    return adhesive_sliding.solve(problem, start, tolerance, max_iterations)


@solve_adhesive_sliding.defjvp
def _solve_adhesive_sliding_jvp(primals, tangents):
    problem, change = primals[0], tangents[0]
    found = solve_adhesive_sliding(*primals)
    found = jax.tree.map(lambda a: checkpoint_name(a, KEPT), found)
    odd, by_odd = problem.operator.odd(), change.operator.odd()(found.pressure)
    alone = replace(change, operator=change.operator.even(), gap=change.gap + by_odd)
    held = adhesive_sliding.frozen(problem, found.pressure)
    moved = lambda gap: _moved_solution(held, found, replace(alone, gap=gap))
    still = jax.tree.map(jnp.zeros_like, alone)
    left = lambda dp: dp - _moved_solution(held, found, replace(still, gap=odd(dp))).pressure
    right = moved(alone.gap).pressure
    dp = linear_solution(left, right, gmres_solution)
    return found, moved(alone.gap + odd(dp))


@solve_partial_slip.defjvp
def _solve_partial_slip_jvp(primals, tangents):
    problem, change = primals[0], tangents[0]
    found = checkpoint_name(solve_partial_slip(*primals), KEPT)
    p, q = found.normal.pressure, found.tangential.traction
    free = free_directions(problem.sheared(p, found.tangential_shift), q, found.tangential.slip)
    space = SlipSpace(problem, Subspace(p > 0.0, problem.load_controlled), free)
    by_operator = Displacements.under(change.operator, q, p)
    forcing = by_operator.total() + jnp.concatenate([change.drift, change.gap[None]])
    dq, dp = given_changes(space, change, p)
    right = -(forcing + space.lifted(dq, dp) + space.turned(dq)) + prescribed_shifts(change)
    rest = jax.lax.custom_linear_solve(space.matrix, space(right), space.solve, transpose_solve=space.solve)
    rest = space(rest)
    dp, dq = dp + rest[2], dq + space.traction(rest[:2], problem.coefficient * rest[2])
    lifted = Displacements.under(problem.operator, dq, dp)
    moved = forcing + lifted.total()
    d_shift, d_approach = multipliers(
        space, change, p, moved + space.turned(dq), _first_touch(problem, change)
    )
    along, tangential_shift, normal_shift, normal = jax.tree.map(jnp.add, by_operator, lifted)
    no = lambda a: np.zeros(jnp.shape(a), jax.dtypes.float0)
    pressed, sheared = found.normal, found.tangential
    d_normal = Solution(dp, normal, d_approach, 0.0 * pressed.error, no(pressed.iterations))
    d_slip = jnp.where(free.contact, moved[:2] - d_shift[:, None, None], 0.0)
    d_tangential = TangentialSolution(
        dq, along, d_slip, no(sheared.stick), d_shift, 0.0 * sheared.error, no(sheared.iterations)
    )
    counts = no(found.taken), no(found.rounds), no(found.settled)
    return found, Round(d_normal, d_tangential, tangential_shift, normal_shift, *counts)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def implied(equations: Callable[[Any, Any], Any], given: Any, solution: Any) -> Any:
    """The solution of equations(given, solution) = 0, found elsewhere, with the derivatives that this implies.

    ``equations`` is a function of a module; what is to be held in derivatives, it holds itself.
    """
    return solution


@implied.defjvp
def _implied_jvp(equations, primals, tangents):
    (given, solution), (change, _) = primals, tangents
    flat, unflattened = ravel_pytree(solution)  # of one array: all of the right side depends on the change

    def residual(given: Any, flat: Array) -> Array:
        return ravel_pytree(equations(given, unflattened(flat)))[0]

    forcing = jax.jvp(lambda given: residual(given, flat), (given,), (change,))[1]
    slope = jax.linearize(lambda z: residual(given, z), flat)[1]
    moved = jax.lax.custom_linear_solve(slope, forcing, gmres_solution, transpose_solve=gmres_solution)
    return solution, unflattened(-moved)


def linear_solution(operator: Linear, right: Array, solve: Callable[[Linear, Array], Array]) -> Array:
    """Return x with operator(x) = right by ``solve``, which also solves the adjoint equation of reverse mode."""
    return jax.lax.custom_linear_solve(operator, right, solve, solve)
