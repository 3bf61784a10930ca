"""Viscous drag on the cantilever in the fit of a force curve: its correction, its error, and a note where it is left in.

While the tip moves at a constant speed the drag is part of the baseline. In contact a soft lever slows the tip down, so that
the drag decreases as the force increases. The coefficient and its error come from the baselines of approach and retraction
(``fitting/data/drag.py``).
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fitting.data.drag import DEGREES, Drag, find_drag
from fitting.data.indentation import IndentationData
from fitting.inference import student

SEEN, PART = 4.0, 0.01  # least drag in standard deviations, and as a part of the largest force, for a note


class Corrected(NamedTuple):
    """A curve without drag; drag: that was subtracted, None without a correction; notes."""

    data: IndentationData
    drag: Drag | None
    notes: tuple[str, ...]

    def interval(self, level: float) -> dict[str, tuple[float, float, float]]:
        """Return {"drag": (value, low, high)} [N s/m], {} without a correction."""
        if self.drag is None:
            return {}
        b, half = self.drag.coefficient, student.two_sided(level, DEGREES) * self.drag.sd
        return {"drag": (b, b - half, b + half)}

    def error(self, raw: IndentationData, modulus: Callable[[IndentationData], float]) -> float:
        """Return the standard deviation of the logarithm of a modulus due to that of the drag; modulus: of another curve."""
        if self.drag is None or self.drag.sd == 0.0:
            return 0.0
        b, sd = self.drag.coefficient, self.drag.sd
        ends = [modulus(raw.without_drag(max(b + sign * sd, 0.0))) for sign in (1.0, -1.0)]
        return 0.5 * abs(math.log(ends[0] / ends[1]))


def corrected(data: IndentationData, drag: float | str | None) -> Corrected:
    """Return a curve without drag; ValueError on bad input, and where the baselines show none."""
    if drag is None:
        return Corrected(data, None, _note(data))
    if isinstance(drag, str):
        if drag != "fit":
            raise ValueError(f'drag: expected a coefficient >= 0 N s/m, "fit" or None, got {drag!r}')
        found = find_drag(data)
        if found.coefficient < -SEEN * found.sd:
            raise ValueError(
                f"drag: expected a baseline of the approach above that of the retraction, got it"
                f" {-2e12 * found.coefficient * found.velocity:.3g} pN below: a drift, which is no drag"
            )
        found = found._replace(coefficient=max(found.coefficient, 0.0))
    else:
        if not (isinstance(drag, int | float | np.number) and 0.0 <= drag < np.inf):
            raise ValueError(f'drag: expected a coefficient >= 0 N s/m, "fit" or None, got {drag!r}')
        found = Drag(float(drag), 0.0, 0.0)
    return Corrected(data.without_drag(found.coefficient), found, ())


def _note(data: IndentationData) -> tuple[str, ...]:
    """Return a note where the baselines of approach and retraction differ as by drag."""
    try:
        found = find_drag(data)
    except ValueError:
        return ()
    shift = found.coefficient * found.velocity
    part = shift / float(np.ptp(data.load))
    if found.coefficient < SEEN * found.sd or part < PART:
        return ()
    return (
        f"the baseline of the approach is {2e12 * shift:.3g} pN above that of the retraction, as by a drag of"
        f" {found.coefficient:.3g} N s/m on the lever in liquid, {100 * part:.2g} % of the largest force on either side:"
        ' drag="fit" subtracts it, which matters where the tip slows down in contact',
    )
