"""The contact problem for an operator that is not symmetric: sliding over a body with a memory.

    u = K * p,     g = u + gap - approach >= 0,     p >= 0,     p g = 0,     <p, K p> > 0,

the problem of ``contact.normal``, whose conjugate gradients need K = K^T. Here an active set of cells A, p > 0 or g < 0,
is guessed, K_AA dp = -g_A is solved on it by BiCGSTAB (``contact.krylov``), p + dp is clipped at zero, and so on:
the primal-dual active set method (M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2002) 865) with inexact solves.
The preconditioner is the complex circulant of K.

Where the odd part of K is several times the even part S (a half-space that relaxes as the contact passes),
these sets may wander or cycle. If they have not come to rest soon, K_AA + S_AA takes the place of K_AA:
steps of the proximal point method in the norm of S (R. T. Rockafellar, SIAM J. Control Optim. 14 (1976)
877), which halve the error each for any K with <p, K p> > 0.

The stopping error is the largest |g| in contact or -g outside over the depth. This is stricter than in
``contact.normal``, where only the mean over the load must be small, because these steps leave their errors at the rim.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import replace
from jaxcontact._support.reductions import totals
from jaxcontact.contact import normal
from jaxcontact.contact.krylov import bicgstab
from jaxcontact.contact.normal import (
    Problem,
    Solution,
    approach_of,
    depth_of,
    positive_or_one,
    projected,
    usable_start,
)

REDUCTION = 0.03  # reduction of the residual by the linear solve on one active set
COLD_TOLERANCE, COLD_ITERATIONS = 1e-2, 50  # of the initial pressure by the even part
INNER = 20  # most BiCGSTAB iterations on one active set
PATIENCE, PROXIMAL_REDUCTION = 20, 0.3  # iterations without the proximal term, and the ``REDUCTION`` with it


def cold_start(problem: Problem) -> Array:
    """Return the initial pressure without a contact nearby: roughly that of the even part of K, (nx, ny).

    From a cruder guess, cells that are let go too early deep inside the contact of a film that flows far
    may not come back.
    """
    even = replace(problem, operator=problem.operator.even())
    limit, nothing = jnp.asarray(COLD_ITERATIONS), jnp.zeros_like(problem.gap)
    return normal.solve(even, nothing, jnp.asarray(COLD_TOLERANCE), limit).pressure


def solve(problem: Problem, start: Array, tolerance: Array, max_iterations: Array) -> Solution:
    """Solve from a start pressure (nx, ny); ``iterations`` counts those of BiCGSTAB.

    A load of zero, or an approach that reaches nothing, gives no pressure. The caller finds in ``error``
    whether the tolerance was met.
    """
    load, law = problem.load_controlled, problem.law

    def assessed(p: Array, count: Array) -> Solution:
        u = problem.operator(p)
        approach = approach_of(problem, p, u)
        worst = jnp.max(law.violation(p, u + problem.gap - approach))
        size, energy = totals(p, p * u)
        error = worst / positive_or_one(depth_of(problem, approach, energy, size))
        if load:  # nothing to find without a load
            error = jnp.where(problem.target > 0.0, error, 0.0)
        return Solution(p, u, approach, error, count)

    def improve(s: Solution) -> Solution:
        # 1. The active set: cells under pressure and cells that overlap.
        gap = s.displacement + problem.gap - s.approach
        active = law.may_change(s.pressure, gap)
        project = lambda values: projected(values, active, load)

        # 2. K_AA dp = -g_A, roughly; with K + S in place of K, the proximal step, once the sets have had time to settle.
        patient = s.iterations < PATIENCE
        operator = problem.operator.plus_even(jnp.where(patient, 0.0, 1.0))
        inverse = operator.preconditioner()
        change, count, _ = bicgstab(
            lambda x: project(operator(x)),
            lambda x: project(inverse(x)),
            -project(gap),
            jnp.where(patient, REDUCTION, PROXIMAL_REDUCTION),
            jnp.minimum(INNER, max_iterations - s.iterations),
        )

        # 3. The nearest admissible pressure, of the given sum.
        p = s.pressure + change
        p = law.balanced(p, problem.target, active) if load else law.admissible(p)
        return assessed(p, s.iterations + jnp.maximum(count, 1))

    going = lambda s: (s.error > tolerance) & (s.iterations < max_iterations)
    start = usable_start(problem, start)
    return jax.lax.while_loop(going, improve, assessed(start, jnp.zeros((), int)))
