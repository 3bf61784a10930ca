"""Derivatives of the solutions of contact problems, by the implicit function theorem.

No other module has derivative rules; jax differentiates all other code.

On the contact area A = {p > 0} the solution obeys K_AA p - approach = -gap, with sum p given or the approach
given. Hence, for changes dK, dgap, dtarget,

    K_AA dp - d approach = -(dK p + dgap)_A,      dp = 0 off A,      sum dp = d target (load)

which is linear: conjugate gradients in the same masked, zero-mean subspace, with the same preconditioner and
in the same window as the contact itself; for an operator that is not symmetric, BiCGSTAB. An operator is
linear in its leaves, so that dK p is the operator of the tangent. ``custom_linear_solve`` transposes the
solve, so forward and reverse mode and their compositions all follow from this one rule.

A cell that is just entering or leaving contact (p = 0 and g = 0) counts as outside, so that the derivative is the one-sided
derivative with the cell outside. Without contact the derivative of the pressure is zero. Under a load of zero the approach
is the lowest point of the surface less that of the profile; without history its derivative is zero. A derivative whose
linear solve fails is nan.

With adhesion (``contact.adhesive``) the set of cells that touch is constant, in the others the attraction follows the gap,
and the tangent is that of Newton's method, found by conjugate gradients for the displacement. Under the given control it is
positive on a branch of stable states and ceases to be so where the branch ends: conjugate gradients that meet a direction of
negative curvature give nan. (Without the sign it would be a number that means nothing.) Beyond a jump derivatives are those
of the new branch; that the jump itself moves is not in them. On a moving body and over a film whose thickness varies
(``contact.adhesive``) what the operator has beyond a uniform one acts on the change of the pressure as a part of the gap,
and the change is found by GMRES.

With friction the sets of stick and slip are constant as well: where a cell sticks its slip stays, where it slips its
traction stays on the rim, which grows with pressure and coefficient of friction, and turns with the slip
(``contact.friction``). Pressure and traction then follow from one linear system, by BiCGSTAB; in rolling, whose
operator is nearly skew, by GMRES; with adhesion, where the pressure does not depend on the traction, the traction follows
from a symmetric one of its own, by conjugate gradients.

First derivatives go over into those of the continuous problem as cells shrink. Second derivatives do not:
they are those of the discrete problem at a constant contact area, without the contribution of the moving edge
(under a given approach the load of an elastic body is piecewise linear: the second derivative is zero).
Differences of gradients over steps in which many cells enter see the edge.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.ad_checkpoint import checkpoint_name
from jax.flatten_util import ravel_pytree
from jax.scipy.sparse.linalg import gmres

from jaxcontact._support.pytree import replace
from jaxcontact._support.reductions import lowest_point
from jaxcontact.contact import adhesive, friction, nonsymmetric
from jaxcontact.contact.adhesive import AdhesiveTangent, Start
from jaxcontact.contact.friction import (
    FreeDirections,
    Round,
    SlipProblem,
    TangentialProblem,
    TangentialSolution,
    free_directions,
    preconditioner,
)
from jaxcontact.contact.krylov import bicgstab, conjugate_gradients
from jaxcontact.contact.normal import Problem, Solution, masked_mean, projected, solve
from jaxcontact.operators.coupled import TractionOperator
from jaxcontact.operators.operator import Linear, OnContact, Operator, cut, paste, place, unchanged

# Solutions of the linear systems of derivatives.
#
# Each is nan where it fails. Searches stop at a residual of ``TANGENT_TOLERANCE`` of the right side.


TANGENT_TOLERANCE = 1e-11
TANGENT_ITERATIONS = 400
DIRECTIONS, RESTARTS = 80, 10  # of GMRES, for systems that neither conjugate gradients nor BiCGSTAB solves
ROUNDING = 1e-14  # a part of a right side in the subspace that is smaller, relative to all of it, is rounding
LEFT = 1e-7  # largest relative residual of GMRES (measured: 3e-9 for a system whose operator itself contains a solve)


class Subspace(NamedTuple):
    """Subspace of the linear solves: fields on the cells of the mask and, under a load, of zero mean."""

    mask: Array
    load_controlled: bool

    def __call__(self, values: Array) -> Array:
        return projected(values, self.mask, self.load_controlled)

    def right_side(self, values: Array) -> Array:
        """Return the part of a right side in the subspace, zero where it is rounding alone.

        The part of a uniform field is zero in the subspace of zero mean; it occurs in reverse mode, as the cotangent of the
        sum of pressures under a given load. Rounding of the mean leaves a uniform remainder of it, outside the subspace, for
        which the search would not converge: it is projected once more.
        """
        inside, size = self(self(values)), jnp.sum(jnp.where(self.mask, values, 0.0) ** 2)
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
    there, back = lambda x: (inside(operator(x)), None), lambda r: inside(inverse(r, inside.mask))
    found = conjugate_gradients(there, back, inside.right_side(right), TANGENT_TOLERANCE, limit)
    return jnp.where(found.met | (limit == 0), found.x, jnp.nan)


def bicgstab_solution(operator: Linear, inverse: Linear, b: Array) -> Array:
    """Solve with an operator that is not symmetric; nan if it fails."""
    x, _, met = bicgstab(operator, inverse, b, TANGENT_TOLERANCE, TANGENT_ITERATIONS)
    return jnp.where(met, x, jnp.nan)


def conjugate_gradients_solution(operator: Linear, inverse: Linear, b: Array) -> Array:
    """Solve a symmetric positive linear system, preconditioned; nan if it is not positive, or the search fails."""
    found = conjugate_gradients(
        lambda x: (operator(x), None), inverse, b, TANGENT_TOLERANCE, TANGENT_ITERATIONS
    )
    return jnp.where(found.met, found.x, jnp.nan)


def gmres_solution(operator: Linear, b: Array) -> Array:
    """Solve a linear system; nan if it fails."""
    x, _ = gmres(
        operator, b, tol=TANGENT_TOLERANCE, restart=DIRECTIONS, maxiter=RESTARTS, solve_method="incremental"
    )
    met = jnp.sum((b - operator(x)) ** 2) <= LEFT**2 * jnp.sum(b**2)
    return jnp.where(met, x, jnp.nan)


# The linear system of the derivatives of a contact with friction: its space, its matrix and its right sides.
#
# Where a cell sticks its slip stays; where it slips its traction stays on the rim of the friction disc, which grows
# with pressure and coefficient of friction, and turns with the slip.


SLIP_ROUNDING = 1e-12  # relative size of what a projection leaves of a right side outside its space


class Displacements(NamedTuple):
    """Products K_tt q and K_tz p (2, nx, ny), K_zt q and K_zz p (nx, ny); those of coupling are zero without it."""

    along: Array
    tangential_by_pressure: Array
    normal_by_traction: Array
    normal: Array

    @classmethod
    def under(cls, operator: TractionOperator, q: Array, p: Array) -> "Displacements":
        """Return the products for a traction and a pressure."""
        along, normal_by_traction = operator.displaced(q)
        return cls(along, operator.tangential_from_normal(p), normal_by_traction, operator.normal(p))

    def total(self) -> Array:
        """Return the displacements in three directions, (3, nx, ny)."""
        return jnp.concatenate(
            [self.along + self.tangential_by_pressure, (self.normal_by_traction + self.normal)[None]]
        )


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
        dq = bound * self.free.outwards
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
        nothing = jnp.sum(b**2) <= SLIP_ROUNDING**2 * jnp.sum(right**2)
        return jnp.where(nothing, 0.0, bicgstab_solution(operator, inverse, b))


# The name under which reverse mode stores the solution of a step, so that no contact is solved again: pressure, displacement
# and approach; with adhesion or friction the whole solution.
KEPT = "pressure"


def solve_in_contact(problem: Problem, mask: Array, right: Array) -> Array:
    """Return x with P K P x = P right, P the projection onto the cells of the mask (and to zero mean under a given load)."""
    operator, inside = problem.operator, Subspace(mask, problem.load_controlled)
    on_mask = lambda x: inside(operator(inside(x)))
    if operator.symmetric:
        # ``search`` must not refer to traced values without a derivative, with which jax 0.10 fails
        search = lambda _, b: conjugate_gradients_in_window(operator, inside, b)
        return jax.lax.custom_linear_solve(on_mask, right, search, symmetric=True)

    def by(preconditioned: Operator, matrix: Linear, b: Array) -> Array:
        inverse = preconditioned.preconditioner()
        return bicgstab_solution(matrix, lambda x: inside(inverse(x)), inside.right_side(b))

    there, back = (partial(by, k) for k in (operator, operator.transpose()))
    return jax.lax.custom_linear_solve(on_mask, right, there, transpose_solve=back)


@jax.custom_jvp
def solve_contact(problem: Problem, start: Array, tolerance: Array, max_iterations: Array) -> Solution:
    """Solve a contact by ``solve`` of contact.normal, or of contact.nonsymmetric for an operator that is not symmetric;
    differentiable with respect to all numbers in ``problem``."""
    method = solve if problem.operator.symmetric else nonsymmetric.solve
    return method(problem, start, tolerance, max_iterations)


@jax.custom_jvp
def known_contact(problem: Problem, solution: Solution) -> Solution:
    """Return a solution that ``solve_contact``, or with adhesion ``solve_attracted``, has found for this problem, with its
    derivatives."""
    return solution


@known_contact.defjvp
def _known_contact_jvp(primals, tangents):
    (problem, found), (change, _) = primals, tangents
    if found.contact_pressure is None:
        return _moved_contact(problem, found, change)
    return found, _moved_attracted(problem, found, change)


@solve_contact.defjvp
def _solve_contact_jvp(primals, tangents):
    return _moved_contact(primals[0], solve_contact(*primals), tangents[0])


def _moved_contact(problem: Problem, solution: Solution, change: Problem) -> tuple[Solution, Solution]:
    """Return a solution, marked for reverse mode to store, and its tangent; linear in the change of the problem."""
    kept = solution.pressure, solution.displacement, solution.approach
    p, u, approach = (checkpoint_name(a, KEPT) for a in kept)
    law, operator = problem.law, problem.operator
    mask = law.free(p)

    # The right side dK p + dgap. Pressures that the law prescribes (p = H) change with the law and move the surface.
    forcing, target = operator.tangent(change.operator, p) + change.gap, change.target
    prescribed = jnp.zeros_like(p)
    if law.prescribes:
        prescribed = law.prescribed_change(change.law, p)
        forcing = forcing + operator(prescribed)
        target = target - jnp.sum(prescribed) if problem.load_controlled else target

    if not problem.load_controlled:
        dp, d_approach = solve_in_contact(problem, mask, target - forcing), target
    else:
        # The change of the sum scales the free pressures; the rest of the change has zero mean. (Where all pressures are
        # free, K free is the displacement.)
        free = jnp.where(mask, p, 0.0) if law.prescribes else p
        displaced = operator(free) if law.prescribes else u
        total = jnp.sum(free)
        over_total = jnp.where(total > 0.0, 1.0 / jnp.where(total > 0.0, total, 1.0), 0.0)
        share = target * over_total
        dp = share * free + solve_in_contact(problem, mask, -(forcing + share * displaced))
        # <free, K dp + forcing> = d approach sum free, with K^T free in place of the convolution of dp
        transposed = displaced if operator.symmetric else operator.transpose()(free)
        d_approach = jnp.sum(transposed * dp + free * forcing) * over_total
        # Without contact the approach is that of first touch; where the law prescribes the pressure of every cell in
        # contact it is not determined, and its derivative is nan.
        without = _first_touch(problem, change)
        if law.prescribes:
            without = jnp.where(jnp.any(law.touching(p)), jnp.nan, without)
        d_approach = jnp.where(total > 0.0, d_approach, without)

    du = forcing - change.gap + operator(dp)
    zero = jnp.zeros_like(solution.error), no_tangent(solution.iterations)
    tangent = Solution(dp + prescribed, du, d_approach, *zero)
    return replace(solution, pressure=p, displacement=u, approach=approach), tangent


def no_tangent(a: Array) -> np.ndarray:
    """Return the tangent of an array of integers or bools, which by convention of jax has the type float0."""
    return np.zeros(jnp.shape(a), jax.dtypes.float0)


def _first_touch(problem: Problem | SlipProblem, change: Problem | SlipProblem) -> Array:
    """Return the tangent of the approach at a load of zero (``normal.approach_of``), zero without history."""
    return jax.jvp(lowest_point, (problem.gap, 1.0), (change.gap, 0.0))[1] - change.lowest


@jax.custom_jvp
def solve_partial_slip(
    problem: SlipProblem, pressure: Array, traction: Array, tolerance: Array, max_iterations: Array
) -> Round:
    """``contact.friction.solve_partial_slip``, differentiable in everything in ``problem``."""
    return friction.solve_partial_slip(problem, pressure, traction, tolerance, max_iterations)


@jax.custom_jvp
def solve_attracted(problem: Problem, start: Start, tolerance: Array, max_iterations: Array) -> Solution:
    """Solve a contact with adhesion; differentiable in everything in ``problem``. With an operator that is not one even
    kernel, or with friction, a sequence of contacts is solved."""
    method = adhesive.solve_in_turn if _needs_turns(problem) else adhesive.solve
    return method(problem, start, tolerance, max_iterations)


@solve_attracted.defjvp
def _solve_attracted_jvp(primals, tangents):
    found = jax.tree.map(lambda a: checkpoint_name(a, KEPT), solve_attracted(*primals))
    return found, _moved_attracted(primals[0], found, tangents[0])


def _moved_attracted(problem: Problem, found: Solution, change: Problem) -> Solution:
    """Return the change of the solution of a contact with adhesion; linear in the change of the problem."""
    moved = _moved_in_turn if _needs_turns(problem) else _moved_solution
    return moved(problem, found, change)


def _needs_turns(problem: Problem) -> bool:
    operator = problem.operator
    return not operator.symmetric or operator.weights is not None or problem.drag is not None


def _moved_solution(problem: Problem, found: Solution, change: Problem) -> Solution:
    """``_moved_attracted`` of a contact that is solved at once."""
    # The right side: the change of K p and of the gap, and of the attraction where the law itself changes.
    tangent = AdhesiveTangent.at_solution(problem, found)
    model = tangent.model
    held, nowhere = found.carried > 0.0, jnp.zeros_like(found.pressure)
    assert found.separated is not None
    forcing = problem.operator.tangent(change.operator, found.pressure) + change.gap
    explicit = problem.law.explicit(change.law.law, tangent.gap)

    # A first change that closes the gap of the cells that touch, and what it leaves unbalanced elsewhere.
    given = nowhere[0, 0] if problem.load_controlled else change.target
    start = tangent.moved(jnp.where(held, given - forcing, 0.0), given)
    right = tangent.unbalanced(start, forcing, explicit, change.target)
    right = jnp.where(found.separated, 0.0, right)

    # The rest by Newton's matrix, positive on a stable branch; the operator itself is its preconditioner.
    back = lambda r: model.faces(tangent.operator(r))
    search = lambda _, b: conjugate_gradients_solution(model, back, model.faces(b))
    rest = jax.lax.custom_linear_solve(model, -right, search, symmetric=True)
    dp, du, d_approach, attraction = tangent.result(tangent.added(start, rest), forcing, explicit)

    # Surfaces that a tensile load has separated stay as they are.
    apart = lambda a, otherwise: jnp.where(found.separated, otherwise, a)
    return Solution(
        apart(dp, nowhere),
        apart(du + forcing - change.gap, nowhere),
        apart(d_approach, _first_touch(problem, change)),
        jnp.zeros_like(found.error),
        no_tangent(found.iterations),
        apart(jnp.where(held, dp + attraction, 0.0), nowhere),
        no_tangent(found.separated),
        no_tangent(found.unstable),
    )


def _moved_in_turn(problem: Problem, found: Solution, change: Problem) -> Solution:
    """``_moved_attracted`` of a contact that is the fixed point of a sequence."""
    p, carried = found.pressure, found.carried
    # the uniform operator is held: the fixed point does not depend on it
    held = adhesive.with_given(problem, p, carried)
    uniform, nothing = held.operator, jnp.zeros_like(p)
    seen = replace(found, displacement=uniform(p))
    alone = replace(change, operator=jax.tree.map(jnp.zeros_like, uniform), drag=None)
    still = jax.tree.map(jnp.zeros_like, alone)

    # the change of K p and of the drag where operator and drag change, and where pressures do
    forcing = problem.operator.tangent(change.operator, p)
    if problem.drag is not None:
        forcing = forcing + jax.jvp(lambda drag: drag(carried), (problem.drag,), (change.drag,))[1]

    def lifted(result: Solution) -> Array:
        by_pressure = problem.operator(result.pressure)
        return by_pressure if problem.drag is None else by_pressure + problem.drag.change(result.carried)

    # v changes by that, less U dp, under the change of the gap that it is itself
    response = lambda base, gap: _moved_solution(held, seen, replace(base, gap=gap))
    given = lambda result: lifted(result) - uniform(result.pressure)
    left = lambda dv: dv - given(response(still, dv))
    right = forcing + given(response(alone, change.gap + nothing))
    dv = linear_solution(left, right, gmres_solution)
    result = response(alone, change.gap + dv)
    return replace(result, displacement=forcing + lifted(result))


@solve_partial_slip.defjvp
def _solve_partial_slip_jvp(primals, tangents):
    problem, change = primals[0], tangents[0]
    found = checkpoint_name(solve_partial_slip(*primals), KEPT)
    p, q = found.normal.pressure, found.tangential.traction
    load_controlled, sum_given = problem.load_controlled, problem.tangential_load_controlled
    free = free_directions(problem.sheared(p, found.tangential_by_pressure), q, found.tangential.slip)
    space = SlipSpace(problem, Subspace(p > 0.0, load_controlled), free)

    # Changes that follow directly: the load scales the pressure, the bounds of slipping cells follow pressure and
    # coefficient, and free tractions make up a given sum.
    dp, total = jnp.zeros_like(p), jnp.sum(p)
    if load_controlled:
        dp = p * jnp.where(total > 0.0, change.target / jnp.where(total > 0.0, total, 1.0), 0.0)
    dq = space.traction(jnp.zeros((2, *p.shape)), problem.coefficient * dp + change.coefficient * p)
    if sum_given:
        dq = dq + space.free.uniform(change.tangential_target)

    # The right side: changes of operator, drift and gap, what those changes move, and given shift and approach.
    by_operator = Displacements.under(change.operator, q, p)
    forcing = by_operator.total() + jnp.concatenate([change.drift, change.gap[None]])
    shift = 0.0 * change.tangential_target if sum_given else change.tangential_target
    approach = 0.0 * change.target if load_controlled else change.target
    right = jnp.append(shift, approach)[:, None, None] - (forcing + space.lifted(dq, dp) + space.turned(dq))

    # The linear system of both laws for the rest of the change.
    rest = jax.lax.custom_linear_solve(space.matrix, space(right), space.solve, transpose_solve=space.solve)
    rest = space(rest)
    dp, dq = dp + rest[2], dq + space.traction(rest[:2], problem.coefficient * rest[2])
    lifted = Displacements.under(problem.operator, dq, dp)
    moved = forcing + lifted.total()

    # Shift and approach as multipliers: cells that stick, and cells in contact, move with them.
    d_shift, d_approach = change.tangential_target, change.target
    followed = moved + space.turned(dq)
    if sum_given:
        d_shift = space.free.push(jnp.sum(space.free.along(followed[:2]), (1, 2)))
    if load_controlled:
        without = _first_touch(problem, change)
        d_approach = jnp.where(jnp.any(p > 0.0), masked_mean(followed[2], p > 0.0), without)

    along, tangential_by_pressure, normal_by_traction, normal = jax.tree.map(jnp.add, by_operator, lifted)
    pressed, sheared = found.normal, found.tangential
    d_normal = Solution(dp, normal, d_approach, 0.0 * pressed.error, no_tangent(pressed.iterations))
    d_slip = jnp.where(p > 0.0, moved[:2] - d_shift[:, None, None], 0.0)
    d_tangential = TangentialSolution(
        dq,
        along,
        d_slip,
        no_tangent(sheared.stick),
        d_shift,
        0.0 * sheared.error,
        no_tangent(sheared.iterations),
    )
    counts = no_tangent(found.taken), no_tangent(found.rounds), no_tangent(found.settled)
    return found, Round(d_normal, d_tangential, tangential_by_pressure, normal_by_traction, *counts)


@jax.custom_jvp
def solve_tangential(
    problem: TangentialProblem, start: Array, displacement: Array, tolerance: Array, max_iterations: Array
) -> TangentialSolution:
    """``solve`` of contact.friction, at a given bound, differentiable in everything in ``problem``."""
    return friction.solve(problem, start, displacement, tolerance, max_iterations)


@solve_tangential.defjvp
def _solve_tangential_jvp(primals, tangents):
    problem, change = primals[0], tangents[0]
    found = checkpoint_name(solve_tangential(*primals), KEPT)
    operator, sum_given, q = problem.operator, problem.load_controlled, found.traction
    free = free_directions(problem, q, found.slip)
    turned = lambda dq: free.curvature * free.along(dq)

    # Changes that follow directly: the traction of slipping cells follows the bound, and free tractions make up a given sum.
    dq = change.bound * free.outwards
    if sum_given:
        dq = dq + free.uniform(change.target - jnp.sum(dq, (1, 2)))

    # The rest keeps the slip of cells that stick, P (K_tt + k) P x = P (d shift - forcing - (K_tt + k) dq); symmetric.
    by_operator = change.operator.tangential_from_tangential(q)
    forcing = by_operator + change.drift
    stiffness = lambda x: operator.tangential_from_tangential(x) + turned(x)
    shift = 0.0 * change.target if sum_given else change.target
    right = shift[:, None, None] - forcing - stiffness(dq)

    back = preconditioner(operator, free)
    search = lambda matrix, b: conjugate_gradients_solution(matrix, back, free(b))
    matrix = lambda x: free(stiffness(free(x)))
    dq = dq + free(jax.lax.custom_linear_solve(matrix, free(right), search, symmetric=True))
    lifted = operator.tangential_from_tangential(dq)
    moved, d_shift = forcing + lifted, change.target
    if sum_given:
        d_shift = free.push(jnp.sum(free.along(moved + turned(dq)), (1, 2)))
    d_slip = jnp.where(problem.contact, moved - d_shift[:, None, None], 0.0)
    return found, TangentialSolution(
        dq,
        by_operator + lifted,
        d_slip,
        no_tangent(found.stick),
        d_shift,
        0.0 * found.error,
        no_tangent(found.iterations),
    )


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
