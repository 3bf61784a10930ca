"""The figure of a growth fit: thickness over time of every curve with the fit, residuals and parameters."""

from typing import Any

import numpy as np

from fitting.views import axis_units, fit_picture


def draw(fit: Any, path: Any) -> Any:
    """Return a Figure of a ``GrowthFit``, a colour for each curve; saved where a path is given."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 7.0), layout="constrained")
    fit_picture.title(figure, fit)
    places = figure.add_gridspec(3, 1, height_ratios=(3, 1, 0.7))
    top = figure.add_subplot(places[0])
    bottom = figure.add_subplot(places[1], sharex=top)
    ends = np.cumsum([one.t.size for one in fit.data])[:-1]
    parts = (np.split(values, ends) for values in (fit.residuals, fit.fitted))
    for k, (one, residual, fitted) in enumerate(zip(fit.data, *parts, strict=True)):
        colour, line = f"C{k % 10}", np.linspace(0.0, one.t[-1], 200)
        top.plot(one.t, one.thickness, ".", markersize=4, color=colour)
        label = f"{one.stress / 1e6:.4g} MPa, {one.temperature:.4g} K"
        if fit.contact is not None:  # the band at a prescribed stress would be another one
            load = f"{one.load:.4g} N, {one.temperature:.4g} K"
            top.plot(one.t, fitted, color=colour, label=load)
        else:
            grown = fit.predict(line, one.stress, one.temperature, one.initial)
            top.plot(line, grown, color=colour, label=label)
            low, high = fit.band(line, one.stress, one.temperature, one.initial)
            if np.all(np.isfinite(high)):
                top.fill_between(line, low, high, color=colour, alpha=0.2)
        bottom.plot(one.t, -residual, ".", markersize=4, color=colour)
    axis_units.label(top.yaxis, "thickness", "m", fit.curve[3])
    top.tick_params(labelbottom=False)
    top.legend(fontsize="small")
    bottom.axhline(0.0, color="0.4", linewidth=0.8)
    bottom.set(xlabel="t [s]", ylabel=f"residual\n({fit.weights})")
    fit_picture.parameters(figure.add_subplot(places[2]), fit)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure
