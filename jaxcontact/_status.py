"""How far a step can be trusted."""

from enum import IntEnum

import jax.numpy as jnp
from jax import Array


class Status(IntEnum):
    """The verdict on a step; ``message`` says what it means and what helps.

    A step is converged, and its numbers mean what they say, where the status is ``FINE`` alone.

    Example:
        >>> import jaxcontact as jc
        >>> jc.Status(2).name, jc.Status.AT_EDGE.message
        ('AT_EDGE', 'contact at the edge of the grid: a wider grid')
    """

    FINE = 0
    NOT_CONVERGED = 1
    AT_EDGE = 2
    TOO_COARSE = 3
    MOVED_TOO_FAR = 4
    CAME_BACK = 5
    NOT_STEADY = 6
    OUT_OF_RANGE = 7
    SLIDES = 8
    NOT_FINITE = 9
    NOT_RESOLVED = 10

    @property
    def message(self) -> str:
        """What it means, and what helps."""
        return MESSAGES[self]


MESSAGES = {
    Status.FINE: "converged",
    Status.NOT_CONVERGED: "not converged: more iterations (max_iterations) or a looser tolerance",
    Status.AT_EDGE: "contact at the edge of the grid: a wider grid",
    Status.TOO_COARSE: "fewer than 3 cells across the contact: a finer grid",
    Status.MOVED_TOO_FAR: "a step of sliding moved more than half the grid's width: more substeps",
    Status.CAME_BACK: "the indenter came back to where history has left the grid: a wider grid",
    Status.NOT_STEADY: "no steady state: the body flows without limit, or rolling had not settled after 20 grid lengths",
    Status.OUT_OF_RANGE: "a value is outside its range (nu above 0.5, say), which jit or vmap kept from sight",
    Status.SLIDES: "friction cannot hold the tangential load: a smaller one, or a given displacement",
    Status.NOT_FINITE: "the body's response is not finite: a parameter is too large or too small to compute with",
    Status.NOT_RESOLVED: "the body's response is off by more than 1 %: kernels with more nodes, or a shorter time",
}


def first_of(*verdicts: tuple[Array, Status]) -> Array:
    """The status of the first condition that holds, ``FINE`` where none does."""
    status = jnp.asarray(int(Status.FINE))
    for condition, verdict in reversed(verdicts):
        status = jnp.where(condition, int(verdict), status)
    return status
