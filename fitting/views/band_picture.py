"""Figure of a prediction with its confidence band."""

from typing import Any

import numpy as np

from fitting.views import sheet

WIDE = 20.0  # ratio of the ends of an axis above which it is logarithmic


@sheet.styled
def draw(wanted: Any, at: np.ndarray, band: Any, level: float) -> Any:
    """Return a Figure of a predicted quantity (``PredictedQuantity``) at times or frequencies (k,)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.5), layout="constrained")
    axes, order = figure.add_subplot(), np.argsort(at)
    x, value, low, high = (np.asarray(y)[order] for y in (at, band.value, band.low, band.high))
    axes.fill_between(x, low, high, alpha=0.3, label=f"{100 * level:g} % band")
    ends = np.maximum([value - low, high - value], 0.0)
    axes.errorbar(x, value, ends, fmt="o-", markersize=4, capsize=3, label=wanted.name)
    if x[0] > 0.0 and x[-1] > WIDE * x[0]:
        axes.set_xscale("log")
    if np.all(low > 0.0) and value.max() > WIDE * value.min():
        axes.set_yscale("log")
    axes.set_xlabel("{} [{}]".format(*wanted.over))
    sheet.axis_label(axes.yaxis, wanted.name, wanted.unit, high)
    axes.legend()
    return figure
