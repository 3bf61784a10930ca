"""Figure of an indentation curve: the selected points over the measured ones."""

from typing import Any

from fitting.views import axis_units

COLOURS = {"approach": "C0", "hold": "C1", "retract": "C2"}


def draw(data: Any) -> Any:
    """Return a figure of load and depth over time and load over depth, with points that were left out in grey.

    Args:
        data: an ``IndentationData``.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 3.2), layout="constrained")
    panels = figure.subplots(1, 3)
    pairs = ((0, 1), (0, 2), (2, 1))
    taken, whole, segments = (data.t, data.load, data.depth), data.whole, data.segments
    names = (("time", "s"), ("load", "N"), ("depth", "m"))
    shown = taken if whole is None else whole
    for panel, (x, y) in zip(panels, pairs, strict=True):
        if whole is not None:
            panel.plot(whole[x], whole[y], color="0.75", lw=1, label="left out")
        for name in COLOURS:
            on = segments == name
            if on.any():
                panel.plot(taken[x][on], taken[y][on], ".", ms=3, color=COLOURS[name], label=name)
        axis_units.label(panel.xaxis, *names[x], shown[x])
        axis_units.label(panel.yaxis, *names[y], shown[y])
    panels[0].legend(frameon=False)
    return figure
