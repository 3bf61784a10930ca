"""The contact problem for an operator that is not symmetric: sliding over a body with a memory.

    u = K * p,     g = u + gap - approach >= 0,     p >= 0,     p g = 0,     <p, K p> > 0,

the problem of ``contact.normal``, whose conjugate gradients need K = K^T. Here
an active set of cells A = {p > 0} or {g < 0} is guessed, K_AA dp = -g_A is solved on it by BiCGSTAB
(H. A. van der Vorst, SIAM J. Sci. Stat. Comput. 13 (1992) 631), p + dp is clipped at zero, and so
on: the primal-dual active set method (M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13
(2002) 865) with inexact solves. The preconditioner is the complex circulant of K.

Where the odd part of K is several times the even part S (a half-space that relaxes as the contact passes),
these sets may wander or cycle. If they have not come to rest soon, K_AA + S_AA takes the place of K_AA:
steps of the proximal point method in the norm of S (R. T. Rockafellar, SIAM J. Control Optim. 14 (1976)
877), which halve the error each for any K with <p, K p> > 0.

The stopping error is the largest |g| in contact or -g outside over the depth: stricter than there, where
only the mean over the load must be small, because these steps leave their errors at the rim.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import replace
from jaxcontact.contact import normal
from jaxcontact.contact.normal import Problem, Solution, approach_of, over_depth, projected, usable_start
from jaxcontact.operators.operator import Linear

REDUCTION = 0.03  # of the residual, by the linear solve on one active set
COLD_TOLERANCE, COLD_ITERATIONS = 1e-2, 50  # of the start
INNER = 20  # most BiCGSTAB iterations on one active set
PATIENCE, PROXIMAL_REDUCTION = 20, 0.3  # iterations without the proximal term, and its ``REDUCTION``


class _Krylov(NamedTuple):
    x: Array
    r: Array
    d: Array
    v: Array
    rho: Array
    size: Array
    omega: Array
    taken: Array


def _safe(value: Array) -> Array:
    return jnp.where(value == 0.0, 1.0, value)


def bicgstab(
    operator: Linear, inverse: Linear, b: Array, reduction: Array, limit: Array
) -> tuple[Array, Array, Array]:
    """x with operator(x) = b to a relative residual ``reduction``, the iterations taken, and whether it is met.

    The preconditioner ``inverse`` acts from the right; an iteration costs two applications of each.
    """
    goal = reduction**2 * jnp.sum(b**2)
    one = jnp.ones(())

    def going(k: _Krylov) -> Array:
        return (jnp.sum(k.r**2) > goal) & (k.taken < limit) & (k.rho != 0.0) & (k.omega != 0.0)

    def step(k: _Krylov) -> _Krylov:
        rho = jnp.sum(b * k.r)
        d = k.r + (rho / k.rho) * (k.size / k.omega) * (k.d - k.omega * k.v)
        direction = inverse(d)
        v = operator(direction)
        size = rho / _safe(jnp.sum(b * v))
        half = k.r - size * v
        correction = inverse(half)
        t = operator(correction)
        omega = jnp.sum(t * half) / _safe(jnp.sum(t**2))
        x = k.x + size * direction + omega * correction
        return _Krylov(x, half - omega * t, d, v, rho, size, omega, k.taken + 1)

    zero = jnp.zeros_like(b)
    first = _Krylov(zero, b, zero, zero, one, one, one, jnp.zeros((), int))
    last = jax.lax.while_loop(going, step, first)
    return last.x, last.taken, jnp.sum(last.r**2) <= goal


class _ActiveSet(NamedTuple):
    pressure: Array
    displacement: Array
    error: Array
    iterations: Array


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

    def assessed(p: Array, count: Array) -> _ActiveSet:
        u = problem.operator(p)
        approach = approach_of(problem, p, u)
        g = u + problem.gap - approach
        error = over_depth(problem, p, u, approach, jnp.max(law.violation(p, g)))
        if load:
            error = jnp.where(problem.target > 0.0, error, 0.0)
        return _ActiveSet(p, u, error, count)

    def improve(s: _ActiveSet) -> _ActiveSet:
        r = s.displacement + problem.gap - approach_of(problem, s.pressure, s.displacement)
        work = law.searching(s.pressure, r)
        project = lambda values: projected(values, work, load)
        patient = s.iterations < PATIENCE
        operator = problem.operator.plus_even(jnp.where(patient, 0.0, 1.0))
        inverse = operator.preconditioner()
        change, count, _ = bicgstab(
            lambda x: project(operator(x)),
            lambda x: project(inverse(x)),
            -project(r),
            jnp.where(patient, REDUCTION, PROXIMAL_REDUCTION),
            jnp.minimum(INNER, max_iterations - s.iterations),
        )
        p = s.pressure + change
        p = law.balanced(p, problem.target, work) if load else law.admissible(p)
        return assessed(p, s.iterations + jnp.maximum(count, 1))

    going = lambda s: (s.error > tolerance) & (s.iterations < max_iterations)
    first = assessed(usable_start(problem, start), jnp.zeros((), int))
    s = jax.lax.while_loop(going, improve, first)
    approach = approach_of(problem, s.pressure, s.displacement)
    return Solution(s.pressure, s.displacement, approach, s.error, s.iterations)
