"""Figure of the fit of a contact stiffness: stiffness and modulus over depth, residuals and parameters."""

from typing import Any

import numpy as np

from fitting.views import axis_units, fit_picture


def draw(fit: Any, path: Any) -> Any:
    """Return a Figure of a ``StiffnessFit``; saved where a path is given."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    fit_picture.title(figure, fit)
    places = figure.add_gridspec(3, 2, height_ratios=(3, 1, 0.5))
    top, bottom = figure.add_subplot(places[0, 0]), figure.add_subplot(places[1, 0])
    _, unit, depth, measured = fit.curve
    top.plot(depth, measured, ".", markersize=3, color="0.4", label="data")
    order = np.argsort(depth)
    top.plot(depth[order], fit.fitted[order], label="model")
    top.set_ylabel(f"contact stiffness [{unit}]")
    top.tick_params(labelbottom=False)
    top.legend()
    bottom.plot(depth, 100.0 * (measured / fit.fitted - 1.0), ".", markersize=3, color="0.4")
    bottom.axhline(0.0, color="0.4", linewidth=0.8)
    bottom.set_ylabel("residual [%]")
    _moduli(figure.add_subplot(places[:2, 1]), fit, depth)
    for axes in (top, bottom):
        axis_units.label(axes.xaxis, "depth", "m", depth)
    top.set_xlabel("")
    fit_picture.parameters(figure.add_subplot(places[2, :]), fit)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def _moduli(axes: Any, fit: Any, depth: np.ndarray) -> None:
    """Plot the modulus of single depths, and that of the fit with its interval."""
    if fit.thickness is not None:
        axes.plot(depth, fit.apparent, ".", markersize=3, color="0.7", label="with the base")
    axes.plot(depth, fit.moduli, ".", markersize=3, color="0.4", label="of single depths")
    E, low, high = fit.youngs_modulus
    axes.axhline(E, label="of all depths")
    if np.isfinite(high):
        axes.axhspan(low, high, alpha=0.3, label=f"{100 * fit.level:g} % interval")
    top = 1.2 * np.nanmax([E, *fit.moduli, *fit.apparent])
    axes.set_ylim(0.0, min(top, 5.0 * E))
    axis_units.label(axes.xaxis, "depth", "m", depth)
    axis_units.label(axes.yaxis, "Young's modulus", "Pa", np.array([E]))
    axes.legend()
