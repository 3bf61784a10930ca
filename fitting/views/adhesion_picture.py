"""Figure of the fit of an adhesive force curve: load over depth, residuals, parameters and verdict."""

from typing import Any

import numpy as np

from fitting.views.fit_picture import parameters, title


def draw(fit: Any, path: Any) -> Any:
    """Return a figure of an ``AdhesiveFit``; save it where a path is given."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 6.5), layout="constrained")
    title(figure, fit)
    places = figure.add_gridspec(3, 1, height_ratios=(3, 1, 0.6))
    top = figure.add_subplot(places[0])
    bottom = figure.add_subplot(places[1], sharex=top)
    data, kept = fit.data, fit.kept
    depth, load = data.depth * 1e9, data.load * 1e9
    top.axhline(0.0, color="0.8", linewidth=0.8)
    top.plot(depth[~kept], load[~kept], ".", markersize=3, color="0.8", label="out of contact, not fitted")
    for name, colour in (("approach", "C0"), ("hold", "C2"), ("retract", "C1")):
        on = kept & (data.segments == name)
        if on.any():
            top.plot(depth[on], load[on], ".", markersize=3, color=colour, label=name)
            bottom.plot(depth[on], -fit.residuals[on[kept]], ".", markersize=3, color=colour)
    order = np.argsort(depth[kept])
    top.plot(
        depth[kept][order], 1e9 * fit.fitted[order], color="black", linewidth=1.0, label=fit.model.__name__
    )
    top.axhline(-1e9 * fit.pull_off[0], color="0.4", linewidth=0.8, linestyle="--", label="pull-off")
    top.set(ylabel="load [nN]")
    top.tick_params(labelbottom=False)
    top.legend(fontsize="small")
    bottom.axhline(0.0, color="0.4", linewidth=0.8)
    bottom.set(xlabel="depth [nm]", ylabel=f"residual\n({fit.weights})")
    parameters(figure.add_subplot(places[2]), fit)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure
