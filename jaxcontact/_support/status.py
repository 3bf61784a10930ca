"""How far a step can be trusted."""

from enum import IntEnum

import jax.numpy as jnp
from jax import Array

LARGEST_ERROR = 1e-2
"""Relative error of the response beyond which a result is ``NOT_RESOLVED``."""


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
    INHERITED = 9
    NOT_FINITE = 10
    NOT_RESOLVED = 11

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
    Status.INHERITED: "an earlier step failed (see its own status), and this step builds on its result",
    Status.NOT_FINITE: "the body's response is not finite: a parameter is too large or too small to compute with",
    Status.NOT_RESOLVED: "the body's response is off by more than 1 %: kernels with more nodes, or a shorter time",
}


def first_of(*verdicts: tuple[Array, Status]) -> Array:
    """The status of the first condition that holds, ``FINE`` where none does."""
    status = jnp.asarray(int(Status.FINE))
    for condition, verdict in reversed(verdicts):
        status = jnp.where(condition, int(verdict), status)
    return status


def inherited(own: Array, earlier: Array) -> Array:
    """Return the status of a step that builds on earlier ones, from that of the step by itself.

    own: the status of the contact problem of this step; earlier: ``FINE`` if all steps before succeeded, else the status
    to report in place of a success. A failure of the step itself takes precedence. Contact on too few cells is no failure
    that is passed on: a load that rises from zero always begins with it, and what it adds to the history is small.
    """
    failed = passed_on(own) != Status.FINE
    return jnp.where(failed | (earlier == Status.FINE), own, earlier)


def passed_on(status: Array) -> Array:
    """Return what later inner steps of the same row inherit from a step of this status."""
    return jnp.where(status == Status.TOO_COARSE, int(Status.FINE), status)


def to_next_row(earlier: Array) -> Array:
    """Return what the next row inherits: ``INHERITED`` after any failure."""
    return jnp.where(earlier == Status.FINE, int(Status.FINE), int(Status.INHERITED))
