"""Normal contact with adhesion on a body with a memory that the indenter moves over.

The operator K = K_e + K_o of a step has an odd part K_o, so that no energy belongs to the contact. With the pressure p under
K_o given,

    p -> the contact with adhesion of the operator K_e and the gap  gap + K_o p

has one (``contact.adhesive``), and its fixed point is the contact sought. Starting from the last step, the map is repeated
until K_o no longer changes. The creep within a step is a part of K that falls with the step, so that the map contracts where
steps are short; the glassy part of K is even. On an elastic body K_o is zero. Where the map does not contract within
``max_iterations`` the error says so.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import replace
from jaxcontact.contact import adhesive
from jaxcontact.contact.adhesive_state import Start
from jaxcontact.contact.normal import Problem, Solution
from jaxcontact.operators.base import SplitOperator

PART = 0.1  # of the error of the last repetition, to which a contact is solved


class _Repeated(NamedTuple):
    """The contact after a repetition, the larger of its error and of the change of K_o p, and the iterations so far."""

    found: Solution
    error: Array
    iterations: Array


def frozen(problem: Problem, pressure: Array) -> Problem:
    """Return the problem of the even part of the operator, with the displacement of the odd part under a pressure."""
    operator = problem.operator
    assert isinstance(operator, SplitOperator)
    return replace(problem, operator=operator.even(), gap=problem.gap + operator.odd()(pressure))


def solve(problem: Problem, start: Start, tolerance: Array, max_iterations: Array) -> Solution:
    """Solve from a start; the displacement of the solution is that of the even part of the operator."""
    operator = problem.operator
    assert isinstance(operator, SplitOperator)
    odd = operator.odd()
    yields = operator.even().cell_compliance() * problem.law.law.largest_traction

    def repeat(s: _Repeated) -> _Repeated:
        before, begun = s.found.pressure, jnp.isfinite(s.error)
        contact = jnp.where(begun, s.found.carried > 0.0, start.contact)
        own = Start(before, contact, start.none & ~begun)
        goal = jnp.maximum(0.5 * tolerance, jnp.minimum(PART * s.error, 1e-2))
        found = adhesive.solve(frozen(problem, before), own, goal, max_iterations - s.iterations)
        moved = jnp.max(jnp.abs(odd(found.pressure - before))) / yields
        assert found.unstable is not None and s.found.unstable is not None
        found = replace(found, unstable=found.unstable | s.found.unstable)
        return _Repeated(
            found, jnp.maximum(found.error, moved), s.iterations + jnp.maximum(found.iterations, 1)
        )

    def going(s: _Repeated) -> Array:
        assert s.found.separated is not None
        return (s.error > tolerance) & (s.iterations < max_iterations) & ~s.found.separated

    zero, none = jnp.zeros_like(problem.gap), jnp.zeros((), int)
    no, number = jnp.asarray(False), jnp.zeros(())
    nothing = Solution(start.pressure, zero, number, number, none, zero, no, no)
    first = _Repeated(nothing, jnp.asarray(jnp.inf), none)

    last = jax.lax.while_loop(going, repeat, first)
    return replace(last.found, error=last.error, iterations=last.iterations)
