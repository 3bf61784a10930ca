"""The part of a curve before the points that were selected from it: history of the material, which a fit does not compare.

The response of a viscoelastic material to a hold depends on the loading before it. With that left out, as if the load of
the hold had been applied in one step, a ramp of half a relaxation time changes moduli by a third, and a hold that is fitted
from one and a half relaxation times on by more than a factor of two, without any sign of it in the residuals.
"""

import numpy as np

from fitting.data.contact import find_contact
from fitting.data.indentation import DEVIATIONS, IndentationData

MOST = 200  # largest number of points of the history, evenly spaced in those of the curve


def with_earlier(data: IndentationData) -> tuple[IndentationData, np.ndarray]:
    """Return a curve with the points in contact before its first one, and which of its points it had already, (n,)."""
    t, load, depth = _earlier(data)
    n = t.size
    if n == 0:
        return data, np.ones(data.t.size, dtype=bool)
    # the history is not compared, so that its standard deviations have no effect
    errors = {
        name: np.concatenate([np.full(n, values.max()), values])
        for name in DEVIATIONS
        if (values := getattr(data, name)) is not None
    }
    marks = None if data.marks is None else np.concatenate([np.full(n, "approach"), data.marks])
    note = f"the curve from {t[0]:.4g} to {data.t[0]:.4g} s is taken as history, and not fitted"
    longer = IndentationData(
        t=np.append(t, data.t), load=np.append(load, data.load), depth=np.append(depth, data.depth), marks=marks,
        notes=(*data.notes, note), whole=data.whole, cut=data.cut, **errors,
    )  # fmt: skip
    return longer, np.arange(longer.t.size) >= n


def _earlier(data: IndentationData) -> np.ndarray:
    """Return time, load and depth, (3, n), of the whole curve from contact to the first point, the contact included."""
    none = np.zeros((3, 0))
    if data.whole is None:
        return none
    if data.cut:  # the contact is at zero
        some = data.whole[:, (data.whole[0] > 0.0) & (data.whole[0] < data.t[0])]
        return np.concatenate([np.zeros((3, 1)), _thinned(some)], 1) if data.t[0] > 0.0 else none
    touching = data.whole[:, find_contact(*data.whole).before :]
    return _thinned(touching[:, touching[0] < data.t[0]])


def _thinned(points: np.ndarray) -> np.ndarray:
    """Return at most ``MOST`` of points (3, n), the first and the last included."""
    n = points.shape[1]
    return points[:, np.unique(np.linspace(0, n - 1, min(n, MOST)).round().astype(int))] if n else points
