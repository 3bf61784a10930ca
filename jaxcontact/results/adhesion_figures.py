"""The picture of a contact with adhesion: load against approach, with its hysteresis and jumps."""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes

from jaxcontact._support.prefixes import prefixed
from jaxcontact.results.picture_style import COLOURS, scale_of

SAME = 0.02  # of its range: a difference between the ends of a closed path


def load_against_approach(ax: Axes, history: Any) -> Axes:
    """Plot load [N] against approach [m], with jumps dashed.

    If the path ends where it began, the area that it encloses is the energy lost: it is shaded, and stands in the title with
    the parts that are lost in jumps and in the body.
    """
    approach, load = np.asarray(history.approach), np.asarray(history.load)
    (x_unit, x_name), (y_unit, y_name) = scale_of(approach, "m"), scale_of(load, "N")
    x, y, colour = approach / x_unit, load / y_unit, colormaps[COLOURS](0.3)
    jumped = np.flatnonzero(np.diff(np.asarray(history.jumps)) > 0)
    if _closed(x) and _closed(y):
        ax.fill(x, y, color=colour, alpha=0.15, lw=0.0, label="hysteresis")
        ax.set_title(_losses(history, lost_in_a_cycle(approach, load)), fontsize="medium")
    broken = jumped + 1  # a line that is interrupted at the jumps
    ax.plot(
        np.insert(x, broken, np.nan), np.insert(y, broken, np.nan), marker=".", ms=3, color=colour, lw=1.4
    )
    for i in jumped:
        ax.plot(
            x[i : i + 2], y[i : i + 2], "--", color="C3", lw=1.4, label="jump" if i == jumped[0] else None
        )
    ax.axhline(0.0, color="0.7", lw=0.8, zorder=0)
    ax.set(xlabel=f"approach [{x_name}]", ylabel=f"load [{y_name}]")
    if ax.get_legend_handles_labels()[1]:
        ax.legend(loc="upper left")
    return ax


def _losses(history: Any, lost: float) -> str:
    """Return the energy lost in a cycle, in jumps and, where it is known, in the body."""
    jumps, body = (float(np.asarray(a)[-1]) for a in (history.jump_energy, history.viscous_energy))
    words = f"lost {prefixed(lost, 'J')}, in jumps {prefixed(jumps, 'J')}"
    return words if np.isnan(body) else f"{words}, in the body {prefixed(body, 'J')}"


def _closed(values: np.ndarray) -> bool:
    """Return whether a path ends where it began."""
    return bool(abs(values[-1] - values[0]) < SAME * np.ptp(values))


def lost_in_a_cycle(approach: Any, load: Any) -> float:
    """Return the work [J] done on the contact, int P d(approach), which is lost where it ends as it began."""
    approach, load = np.asarray(approach), np.asarray(load)
    return float(np.sum(0.5 * (load[1:] + load[:-1]) * np.diff(approach)))
