"""The common look of all pictures, and how time is shown.

``style.mplstyle`` says what lines, legends and frames look like; ``matplotlib.style.use("jaxcontact.style")`` gives it to
any picture. Colours are those of viridis, which a colour-blind eye tells apart and a grey print keeps in order.
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

COLOURS = "viridis"
STYLE = "jaxcontact.style"
EARLY = 0.1  # of the duration: where more than half of the times lie in it, decades are what they show
P = ParamSpec("P")
R = TypeVar("R")


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """What makes whole figures, in the common style."""

    @functools.wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> R:
        with matplotlib_style.context(STYLE):
            return draw(*args, **kwargs)

    return drawn


def shows_decades(times: Any) -> bool:
    """Whether times [s] are spread over decades: from 0 or later on, and most of them early."""
    times = np.asarray(times, dtype=float)
    early = np.mean((times > 0.0) & (times <= EARLY * times[-1]))
    return bool(times[0] >= 0.0 and times.size > 3 and early > 0.5)


def first_after_zero(times: Any) -> float:
    """The first time [s] above zero, where a logarithm begins."""
    times = np.asarray(times, dtype=float)
    return float(np.min(times[times > 0.0]))


def colours_of_time(times: Any) -> ScalarMappable:
    """The sequential colours of times [s], logarithmic where these show decades."""
    times = np.asarray(times, dtype=float)
    low, high = float(times[0]), float(times[-1])
    if shows_decades(times):
        norm: Normalize = LogNorm(first_after_zero(times), high)
    else:
        norm = Normalize(low, high if high > low else low + 1.0)
    return ScalarMappable(norm, colormaps[COLOURS].resampled(256))


def time_axis(ax: Axes, times: Any) -> None:
    """The horizontal axis as time [s]: where times show decades logarithmic, linear from zero to the first one after it."""
    ax.set_xlabel("time [s]")
    if shows_decades(times):
        ax.set_xscale("symlog", linthresh=first_after_zero(times), linscale=0.5)
        ax.set_xlim(float(np.min(times)), None)
