"""An indentation run reduced to the data that figures need: the middle row of the fields, and scalars over time."""

import warnings
from typing import Any, NamedTuple

import numpy as np

import jaxcontact as jc


class Trace(NamedTuple):
    """A contact over time, along the middle row of cells.

    times (nt,) [s]; x (n,) and y [m] of that row; pressure [Pa] and displacement [m] along it, (nt, n); peak
    [Pa] of the whole field, approach [m], load [N], radius [m], strain, status: (nt,).
    """

    times: np.ndarray
    x: np.ndarray
    y: float
    pressure: np.ndarray
    displacement: np.ndarray
    peak: np.ndarray
    approach: np.ndarray
    load: np.ndarray
    radius: np.ndarray
    strain: np.ndarray
    status: np.ndarray

    @property
    def distance(self) -> np.ndarray:
        """The distance r (n,) [m] of the middle row's cells from the axis."""
        return np.hypot(self.x, self.y)

    @property
    def converged(self) -> bool:
        """True if every step converged, within the grid and with enough cells."""
        return bool(np.all(self.status == 0))


def press(body: Any, ball: Any, control: Any, times: Any, grid: jc.Grid) -> Trace:
    """Run ``jc.indent`` and reduce the fields; the film strain is reported in the table instead of a warning."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="film strain")
        history = jc.indent(body, ball, control, times, grid=grid)
    x, y = (np.asarray(axis) for axis in grid.axes())
    middle = len(y) // 2
    return Trace(
        times=np.asarray(history.times),
        x=x,
        y=float(y[middle]),
        pressure=np.asarray(history.pressure[:, :, middle]),
        displacement=np.asarray(history.displacement[:, :, middle]),
        peak=np.asarray(history.pressure.max(axis=(1, 2))),
        approach=np.asarray(history.approach),
        load=np.asarray(history.load),
        radius=np.asarray(history.contact_radius),
        strain=np.asarray(history.film_strain),
        status=np.asarray(history.status),
    )


def pressure_at(trace: Trace, step: int, r: float) -> float:
    """Return the pressure [Pa] at distance r [m] from the axis, interpolated linearly along the middle row."""
    half = trace.x > 0.0
    return float(np.interp(r, trace.distance[half], trace.pressure[step][half]))
