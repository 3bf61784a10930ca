"""Normal contact with adhesion on a body with a memory that the indenter moves over.

The operator K = K_e + K_o of a step has an odd part K_o, so that no energy belongs to the contact. With the pressure p under
K_o given,

    p -> the contact with adhesion of the operator K_e and the gap  gap + K_o p

has one (``contact.adhesive``), and its fixed point is the contact sought. The matrix K_e^-1 K_o has imaginary eigenvalues,
of up to 1.4 for E0/Einf = 10 where much of the creep happens within a step, so that the map alone need not contract. The
next p is therefore the combination of the last ``DEPTH`` results of the map, of weights whose sum is one, for which the
same combination of their changes is smallest (D. G. Anderson, J. ACM 12 (1965) 547). For a linear map this is GMRES with
few directions. On an elastic body K_o is zero. Where the search does not converge within ``max_iterations`` the error says
so.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import replace
from jaxcontact.contact import adhesive
from jaxcontact.contact.adhesive_state import Start, moved_by
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.operators.base import SplitOperator

PART = 0.1  # of the error of the last repetition, to which a contact is solved
DEPTH = 10  # of the combination; with 6 it does not converge where the eigenvalues reach 2
SINGULAR = 1e-12  # of the largest square of a change: what two combinations may differ by


class _Repeated(NamedTuple):
    """The contact after a repetition, the larger of its error and of the change of K_o p, and the iterations so far.

    next: p of the next repetition; results, changes: of the map, (DEPTH, nx, ny); repetitions: so far.
    """

    found: Solution
    error: Array
    iterations: Array
    next: Array
    results: Array
    changes: Array
    repetitions: Array


def frozen(problem: Problem, pressure: Array) -> Problem:
    """Return the problem of the even part of the operator, with the displacement of the odd part under a pressure."""
    operator = problem.operator
    assert isinstance(operator, SplitOperator)
    return replace(problem, operator=operator.even(), gap=problem.gap + operator.odd()(pressure))


def solve(problem: Problem, start: Start, tolerance: Array, max_iterations: Array) -> Solution:
    """Solve from a start; the displacement of the solution is that of the even part of the operator."""
    operator = problem.operator
    assert isinstance(operator, SplitOperator)
    odd, cell = operator.odd(), operator.even().cell_compliance()

    def repeat(s: _Repeated) -> _Repeated:
        begun = s.repetitions > 0
        contact = jnp.where(begun, s.found.carried > 0.0, start.contact)
        own = Start(s.found.pressure, contact, start.none & ~begun)
        goal = jnp.maximum(0.5 * tolerance, jnp.minimum(PART * s.error, 1e-2))
        found = adhesive.solve(frozen(problem, s.next), own, goal, max_iterations - s.iterations)
        change = found.pressure - s.next
        moved = moved_by(problem, cell, found.pressure, found.displacement)
        error = jnp.maximum(found.error, jnp.max(jnp.abs(odd(change))) / moved)
        assert found.unstable is not None and s.found.unstable is not None
        place = s.repetitions % DEPTH
        results, changes = s.results.at[place].set(found.pressure), s.changes.at[place].set(change)
        return _Repeated(
            replace(found, unstable=found.unstable | s.found.unstable),
            error,
            s.iterations + jnp.maximum(found.iterations, 1),
            jnp.tensordot(_weights(changes, s.repetitions + 1), results, 1),
            results,
            changes,
            s.repetitions + 1,
        )

    def going(s: _Repeated) -> Array:
        assert s.found.separated is not None
        return (s.error > tolerance) & (s.iterations < max_iterations) & ~s.found.separated

    last = jax.lax.while_loop(going, repeat, _before_the_first(start))
    # without the displacement by the pressure that was given
    first_touch = jnp.min(problem.gap) - problem.lowest
    approach = jnp.where(last.found.separated, first_touch, last.found.approach)
    return replace(last.found, approach=approach, error=last.error, iterations=last.iterations)


def _before_the_first(start: Start) -> _Repeated:
    """Return the state before the first repetition."""
    zero, none = jnp.zeros_like(start.pressure), jnp.zeros((), int)
    no, number = jnp.asarray(False), jnp.zeros(())
    nothing = Solution(start.pressure, zero, number, number, none, zero, no, no)
    empty = jnp.zeros((DEPTH, *zero.shape))
    return _Repeated(nothing, jnp.asarray(jnp.inf), none, start.pressure, empty, empty, none)


def _weights(changes: Array, count: Array) -> Array:
    """Return the weights of sum one (DEPTH,) of the least combination of the first ``count`` changes (DEPTH, nx, ny)."""
    known = jnp.arange(DEPTH) < count
    products = jnp.einsum("ixy,jxy->ij", changes, changes)
    least = SINGULAR * jnp.max(jnp.diag(products)) + jnp.finfo(float).tiny
    matrix = products + jnp.diag(jnp.where(known, least, 1.0))
    weights = jnp.linalg.solve(matrix, known.astype(float))
    return weights / jnp.sum(weights)
