"""The common style of all pictures, and the representation of time.

The file ``style.mplstyle`` defines lines, legends and frames; ``matplotlib.style.use("jaxcontact.style")`` applies it to
any picture. Colours are those of viridis, which remain distinct for colour-blind readers and ordered in greyscale.
"""

import functools
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import numpy as np
from matplotlib import colormaps
from matplotlib import style as matplotlib_style
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize

from jaxcontact._support.prefixes import fitting_prefix

COLOURS = "viridis"
STYLE = "jaxcontact.style"
# fraction of the duration; if it holds more than half of the times, the axis of time is logarithmic
EARLY = 0.1
P = ParamSpec("P")
R = TypeVar("R")


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function that makes whole figures so that it draws in the common style."""

    @functools.wraps(draw)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> R:
        with matplotlib_style.context(STYLE):
            return draw(*args, **kwargs)

    return wrapper


def scale_of(values: Any, unit: str) -> tuple[float, str]:
    """Return the factor and the symbol of the multiple of an SI unit in which the largest value lies between 1 and 1000."""
    finite = np.abs(np.asarray(values, dtype=float))
    factor, prefix = fitting_prefix(float(np.max(finite)) if finite.size else 0.0)
    return factor, prefix + unit


def shows_decades(times: Any) -> bool:
    """Return whether times [s] span decades: none is negative, and most of them are early."""
    times = np.asarray(times, dtype=float)
    early = np.mean((times > 0.0) & (times <= EARLY * times[-1]))
    return bool(times[0] >= 0.0 and times.size > 3 and early > 0.5)


def first_after_zero(times: Any) -> float:
    """Return the first time [s] above zero, where a logarithmic axis begins."""
    times = np.asarray(times, dtype=float)
    return float(np.min(times[times > 0.0]))


def colours_of_time(times: Any) -> ScalarMappable:
    """Return a sequential colour map of times [s], logarithmic where they span decades."""
    times = np.asarray(times, dtype=float)
    low, high = float(times[0]), float(times[-1])
    if shows_decades(times):
        norm: Normalize = LogNorm(first_after_zero(times), high)
    else:
        norm = Normalize(low, high if high > low else low + 1.0)
    return ScalarMappable(norm, colormaps[COLOURS].resampled(256))


def time_axis(ax: Axes, times: Any) -> None:
    """Make the horizontal axis one of time [s], logarithmic (linear below the first time above 0) if times span decades."""
    ax.set_xlabel("time [s]")
    if shows_decades(times):
        ax.set_xscale("symlog", linthresh=first_after_zero(times), linscale=0.5)
        ax.set_xlim(float(np.min(times)), None)
