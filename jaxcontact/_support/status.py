"""The status of a step: whether it converged, and the reason if not."""

from enum import IntEnum

import jax.numpy as jnp
import numpy as np
from jax import Array

LARGEST_STEP_ERROR = 0.1
"""Estimated relative error of the pressure by the time steps above which the status is ``STEP_TOO_LONG``."""

LARGEST_ERROR = 1e-2
"""Relative error above which the status is ``NOT_RESOLVED`` (of the response) or ``STEP_TOO_LONG`` (of growth)."""

REFINED = (1, 4, 16, 64)
"""Numbers of substeps that are tried in turn until the error by the time steps is below ``LARGEST_ERROR``."""


class Status(IntEnum):
    """The status of a time step: whether its solution is valid and, if not, why.

    A step is converged, and its numbers are valid, only where the status is ``FINE`` (0). ``message`` states the meaning of
    each status and the remedy; ``list(jc.Status)`` lists all of them.

    Where several apply to a step, the most serious one is reported, in this order: OUT_OF_RANGE, NOT_STEADY, NOT_RESOLVED,
    NOT_FINITE, PULLED_OFF, LOAD_ABOVE_HARDNESS, GROSS_SLIP, NOT_CONVERGED, MOVED_TOO_FAR, AT_EDGE, REENTERED_TRACK,
    STEP_TOO_LONG, TOO_THICK, INHERITED, TOO_COARSE, FINE. The problem itself comes first (its values, its response, whether
    it has a solution), then whether this solution was found, then the grid and the time steps, and last a contact on few
    cells.

    Example:
        >>> import jaxcontact as jc
        >>> jc.Status(2).name, jc.Status.AT_EDGE.message
        ('AT_EDGE', 'contact at the edge of the grid: use a wider grid')
    """

    FINE = 0
    NOT_CONVERGED = 1
    AT_EDGE = 2
    TOO_COARSE = 3
    MOVED_TOO_FAR = 4
    REENTERED_TRACK = 5
    NOT_STEADY = 6
    OUT_OF_RANGE = 7
    GROSS_SLIP = 8
    INHERITED = 9
    NOT_FINITE = 10
    NOT_RESOLVED = 11
    STEP_TOO_LONG = 12
    TOO_THICK = 13
    PULLED_OFF = 14
    LOAD_ABOVE_HARDNESS = 15

    @property
    def message(self) -> str:
        """The meaning of the status, and the remedy."""
        return MESSAGES[self]


MESSAGES = {
    Status.FINE: "converged",
    Status.NOT_CONVERGED: "not converged: increase max_iterations, or use a looser tolerance",
    Status.AT_EDGE: "contact at the edge of the grid: use a wider grid",
    Status.TOO_COARSE: "fewer than 3 cells across the contact: use a finer grid",
    Status.MOVED_TOO_FAR: "a step of sliding moved more than half the grid's width: use more substeps",
    Status.REENTERED_TRACK: "the indenter returned to where part of the history has left the grid: use a wider grid",
    Status.NOT_STEADY: "no steady state: the body flows indefinitely, or rolling had not settled after 20 grid lengths",
    Status.OUT_OF_RANGE: "a value is outside its range (nu above 0.5, say) and could not be checked inside jit or vmap",
    Status.GROSS_SLIP: "friction cannot hold the tangential load: use a smaller load, or prescribe the displacement",
    Status.INHERITED: "an earlier step failed (see its own status), and this step starts from its result",
    Status.NOT_FINITE: "the result is not finite: a parameter is too large or too small to compute with",
    Status.NOT_RESOLVED: "the error of the body's response exceeds 1 %: use kernels with more nodes, or a shorter time",
    Status.STEP_TOO_LONG: "the time steps are too long: the pressure is off by more than 10 %, growth or wear in a step by"
    " more than 1 %, or the indenter moves along its path by over a quarter of the half-width of contact: use more substeps",
    Status.TOO_THICK: "the film is thicker than the largest thickness of its kernels: use a larger thickest",
    Status.PULLED_OFF: "the tensile load exceeds the pull-off force: there is no contact from here on",
    Status.LOAD_ABOVE_HARDNESS: "the load exceeds the hardness times the area on the grid that the indenter can touch",
}


PRECEDENCE = (
    Status.OUT_OF_RANGE,
    Status.NOT_STEADY,
    Status.NOT_RESOLVED,
    Status.NOT_FINITE,
    Status.PULLED_OFF,
    Status.LOAD_ABOVE_HARDNESS,
    Status.GROSS_SLIP,
    Status.NOT_CONVERGED,
    Status.MOVED_TOO_FAR,
    Status.AT_EDGE,
    Status.REENTERED_TRACK,
    Status.STEP_TOO_LONG,
    Status.TOO_THICK,
    Status.INHERITED,
    Status.TOO_COARSE,
    Status.FINE,
)
"""All statuses, the most serious first: of those that apply to a step, the first is reported."""

_RANK = np.argsort(PRECEDENCE)  # of each code: its place in PRECEDENCE


def more_serious(one: Array, other: Array) -> Array:
    """Return the more serious of two statuses, of any shape."""
    rank = jnp.asarray(_RANK)
    return jnp.asarray(PRECEDENCE)[jnp.minimum(rank[one], rank[other])]


def most_serious(*verdicts: tuple[Array, Status], status: Array | int = Status.FINE) -> Array:
    """Return the most serious of a status and of those whose condition holds; conditions: bool, of any shape."""
    rank = jnp.asarray(_RANK)[jnp.asarray(status)]
    for condition, verdict in verdicts:
        rank = jnp.where(condition, jnp.minimum(rank, _RANK[verdict]), rank)
    return jnp.asarray(PRECEDENCE)[rank]


def passed_on(status: Array) -> Array:
    """Return the status that later inner steps of the same row inherit from a step of this status.

    Contact on too few cells is not passed on as a failure: a load that rises from zero always begins with it, and its effect
    on the history is small. Separation under a tensile load is not passed on either: the pressure is zero afterwards.
    """
    no_failure = (status == Status.TOO_COARSE) | (status == Status.PULLED_OFF)
    return jnp.where(no_failure, int(Status.FINE), status)


def to_next_row(earlier: Array) -> Array:
    """Return the status that the next row inherits: ``INHERITED`` after any failure."""
    fine = jnp.zeros_like(earlier)  # of the type of a status, so that a step is traced once
    return jnp.where(earlier == Status.FINE, fine, int(Status.INHERITED))
