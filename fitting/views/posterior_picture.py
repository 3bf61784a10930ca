"""Figure of a posterior: a histogram of each parameter, with its interval and that of the profile likelihood."""

from typing import Any

import numpy as np

BINS = 60


def draw(found: Any, units: dict[str, str], profiles: dict[str, tuple[float, float]], level: float) -> Any:
    """Return a Figure of a ``Posterior``; profiles: {parameter: interval of the profile likelihood}."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.5 * len(found.samples), 3.5), layout="constrained")
    for k, (name, values) in enumerate(found.samples.items()):
        axes = figure.add_subplot(1, len(found.samples), k + 1)
        wide = values.max() > 10.0 * values.min()
        edges = (np.geomspace if wide else np.linspace)(values.min(), values.max(), BINS)
        axes.hist(values, edges, color="0.75")
        for place, (ends, colour, what) in enumerate(
            ((found.intervals[name], "C0", "posterior"), (profiles[name], "C1", "profile"))
        ):
            shown = np.clip(ends, values.min(), values.max())  # an open side ends with the draws
            height = -0.04 * (1 + place) * axes.get_ylim()[1]
            axes.plot(
                shown, [height, height], color=colour, linewidth=3.0, label=f"{100 * level:g} %, {what}"
            )
        axes.set(xlabel=f"{name} [{units[name]}]", xscale="log" if wide else "linear", yticks=[])
    figure.axes[0].legend(fontsize="small")
    return figure
