"""Figure of the fit of a force curve: force over depth with the contact point, and the residuals."""

from typing import Any

import numpy as np

from fitting.views import axis_units, fit_picture

PICO = 1e12


def draw(fit: Any, path: Any) -> Any:
    """Return a Figure of a ``ForceFit``; saved where a path is given."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 6.5), layout="constrained")
    fit_picture.title(figure, fit)
    places = figure.add_gridspec(3, 1, height_ratios=(3, 1, 0.5))
    top = figure.add_subplot(places[0])
    bottom = figure.add_subplot(places[1], sharex=top)
    _, low, high = fit.nuisances["contact_point"]
    half = 0.5 * abs(high - low)
    top.plot(fit.depth, fit.force, ".", markersize=3, color="0.4", label="data, baseline subtracted")
    top.plot(fit.depth, fit.model_force, color="C0", label="model")
    top.plot(0.0, 0.0, "o", color="C1", label="contact point")
    for axes in (top, bottom):
        axes.axvspan(-half, half, color="C1", alpha=0.3, linewidth=0)
        axes.axvline(0.0, color="C1", linewidth=0.8)
    axis_units.label(top.yaxis, "force", "N", fit.force)
    top.tick_params(labelbottom=False)
    top.legend()
    bottom.plot(fit.depth, PICO * (fit.force - fit.model_force), ".", markersize=3, color="0.4")
    bottom.axhline(0.0, color="0.4", linewidth=0.8)
    axis_units.label(bottom.xaxis, "depth below the contact point", "m", np.abs(fit.depth))
    bottom.set_ylabel("residual [pN]")
    _values(figure.add_subplot(places[2]), fit)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def _values(axes: Any, fit: Any) -> None:
    """Print Young's modulus and the contact point with their intervals, and what the modulus is conditional on."""
    axes.axis("off")
    factor, unit = axis_units.multiple("Pa", fit.youngs_modulus[0])
    E, low, high = (value / factor for value in fit.youngs_modulus)
    lines = [f"E = {E:.4g} {unit}, {100 * fit.level:g} % interval {low:.4g} to {high:.4g} {unit}"]
    value, first, last = fit.nuisances["contact_point"]
    factor, unit = axis_units.multiple("m", max(abs(first), abs(last)))
    place = f"{value / factor:.5g} {unit}, {first / factor:.5g} to {last / factor:.5g} {unit}"
    lines.append(f"contact point at {place}")
    axes.text(0.0, 1.0, "\n".join(lines), va="top", family="monospace", fontsize="x-small")
