"""The way of an indenter over a body whose fields stay in place."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import is_concrete, pytree
from jaxcontact.indenters.shapes import Cone, Cylinder, Indenter, Sphere
from jaxcontact.inputs.grid import Grid, MovedGrid

LONGEST = 1 / 4  # of the half-width of the contact: what the indenter may move in a step


@pytree
class Track:
    """The way of an indenter over the body.

    start: its first position [m], (2,), where the gap is the stepper's profile; length: the scale of lengths [m].
    """

    indenter: Indenter
    grid: Grid
    start: Array
    length: Array

    def rise(self, position: Array) -> Array:
        """Return what the profile of the indenter at a position is above that at the start, scaled, (nx, ny)."""
        return (self._profile(position) - self._profile(self.start)) / self.length

    def _profile(self, position: Array) -> Array:
        grid = self.grid
        return self.indenter.profile(MovedGrid(grid.shape, grid.spacing, grid.periodic, tuple(position)))

    def carried(self, pressure: Array, move: Array) -> Array:
        """Return a pressure moved with the indenter by whole cells, from which a search may start."""
        cells = jnp.round(jax.lax.stop_gradient(move / jnp.stack(self.grid.spacing))).astype(int)
        return jnp.roll(pressure, (cells[0], cells[1]), (0, 1))

    def leaps(self, move: Array, touching: Array) -> Array:
        """Return whether a move is more than ``LONGEST`` of the half-width of the contact in its direction.

        The half-widths along x and y are those of the cells ``touching``, (nx, ny); along y there is none in plane strain.
        """
        dx, dy = self.grid.spacing
        half = jnp.stack([jnp.sum(jnp.any(touching, 1)) * dx, jnp.sum(jnp.any(touching, 0)) * dy]) / 2.0
        share = move / jnp.where(half > 0.0, half, jnp.inf)
        return jnp.sum((share[:1] if self.grid.plane_strain else share) ** 2) > LONGEST**2


def check_path(path: Any, times: Any, indenter: Any, grid: Grid) -> Verdict:
    """Check a path (nt, 2): no jump, on the grid where it ends there, and an indenter whose profile can be moved."""
    checks.require(
        isinstance(indenter, Sphere | Cone | Cylinder),
        f"indenter: expected a Sphere, Cone or Cylinder with path, got {type(indenter).__name__}",
    )
    if not is_concrete(path, times, grid):
        return True
    still, moves = np.diff(np.asarray(times, float)) == 0.0, np.any(np.diff(path, axis=0) != 0.0, 1)
    checks.require(not np.any(still & moves), "path [m]: expected no move between two equal times, got one")
    for axis, name in enumerate("xy"):
        half, farthest = float(grid.width[axis]) / 2.0, float(np.max(np.abs(path[:, axis])))
        checks.require(
            grid.periodic[axis] or farthest < half,
            f"path [m]: expected positions within {half:g} of the centre of the grid along {name}, got {farthest:g}",
        )
        if grid.periodic[axis]:
            _check_goes_on(np.diff(path[:, axis]), half, name)
    return True


def _check_goes_on(moves: np.ndarray, half: float, name: str) -> None:
    """Raise ValueError for a path around a periodic axis that starts again on the other side of the grid: single long moves
    (nt - 1,) back between short ones forward."""
    forward = np.sign(np.sum(np.sign(moves)))
    long = (np.abs(moves) > half) & (moves * forward < 0.0)
    checks.require(
        not np.any(long) or np.any(np.abs(moves[~long]) > half),
        f"path [m]: expected positions that go on around the periodic axis {name}, beyond the grid, or moves of at most half"
        f" its width, {half:g}, got one of {moves[np.argmax(long)]:g} back: they seem to start again",
    )
