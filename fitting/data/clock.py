"""Detection of whether the times of a curve count from the load, since J(t) and G(t) are functions of the time since
loading.

The clock of an instrument may have started earlier. Then the first time is late: many sample intervals after zero where
samples are evenly spaced. Times whose spacing grows in proportion to them, as in logarithmic sampling, count from the
load whatever the first of them is. Late times of even spacing may count from the load too, with the first samples left
out, and the times alone do not distinguish the two cases, so the caller must decide.
"""

import numpy as np

LATE = 5.0  # largest first time, in sample intervals, if the clock starts with the load
EVENLY = 2.5  # the same for even spacing, where one or two samples may be missing
EVEN = 0.2  # largest relative difference of even spacings
FIRST = 9  # number of spacings examined
ALIKE = 0.3  # relative tolerance of spacing that grows with time


def counts_from_zero(t: np.ndarray) -> bool:
    """Return whether the clock appears to start with the load: an early first sample, or growing spacing."""
    different = np.unique(t[np.isfinite(t)])
    if different.size < 3:
        return True
    gaps = np.diff(different)
    first = gaps[:FIRST]
    even = first.max() - first.min() < EVEN * first.max()
    if different[0] <= (EVENLY if even else LATE) * gaps[0] * (1.0 + 1e-9):
        return True
    middle = different.size // 2
    grown = (different[middle + 1] - different[middle]) / gaps[0]
    return bool(abs(grown / (different[middle] / different[0]) - 1) < ALIKE and grown > 1 + ALIKE)


def since_load(t: np.ndarray, start: float | None) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the times (n,) since the load, which began at ``start`` [s] on their clock, and notes.

    Without a start the times count from the load, and a note says so if their spacing suggests otherwise.

    Raises:
        ValueError: a start after the first of the times.
    """
    if start is None:
        note = (
            f"t begins late, at {t[0]:g} s, and is taken as the time since the load;"
            f" give start={t[0]:g} if the load began then, start=0 if not"
        )
        return t, () if counts_from_zero(t) else (note,)
    if not (np.isfinite(start) and start <= t[0]):
        raise ValueError(f"start: expected a time not after the first of t, {t[0]:g} s, got {start!r}")
    return t - start, ()
