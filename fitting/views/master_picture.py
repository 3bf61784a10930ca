"""Figure of a time-temperature superposition: master curve, shift factors, residuals, and van Gurp-Palmen plot."""

from typing import Any

import numpy as np

from fitting.views import fit_picture

FINE = 300  # points of a line
RADIAN = 180.0 / np.pi  # degrees


def draw(fit: Any, path: Any) -> Any:
    """Return a Figure of a ``MasterFit``, a colour for each temperature; saved where a path is given.

    For moduli over frequency the last panel is the van Gurp-Palmen plot, the phase angle over |G*|, in which curves that
    superpose coincide without any shift of times.
    """
    from matplotlib import colormaps
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 8.0), layout="constrained")
    fit_picture.title(figure, fit)
    places = figure.add_gridspec(3, 2, height_ratios=(3, 3, 0.5))
    T = fit.temperatures
    colours = colormaps["viridis"](np.linspace(0.0, 0.92, T.size))
    _curves(figure.add_subplot(places[0, 0]), fit, colours)
    _factors(figure.add_subplot(places[0, 1]), fit, colours)
    _residuals(figure.add_subplot(places[1, 0]), fit, colours)
    last = figure.add_subplot(places[1, 1])
    (_palmen if fit.oscillation else _raw)(last, fit, colours)
    fit_picture.parameters(figure.add_subplot(places[2, :]), fit)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def _curves(axes: Any, fit: Any, colours: Any) -> None:
    """Plot the shifted data and the master curve."""
    for T, colour in zip(fit.temperatures, colours, strict=True):
        at, values = fit.shifted(T)
        for k, row in enumerate(values):
            mark = (
                {"marker": ".", "markersize": 5}
                if k == 0
                else {"marker": "o", "markersize": 3, "mfc": "none"}
            )
            label = f"{T:.4g} K" if k == 0 else None
            axes.loglog(at, row, linestyle="", color=colour, label=label, **mark)
    line = fit.line(FINE)
    found = fit.predict(line)
    rows = (found.real, found.imag) if fit.oscillation else (found,)
    names = ("G' (dots)", "G'' (circles)") if fit.oscillation else ("master curve",)
    for row, name, colour in zip(rows, names, ("C3", "C0"), strict=False):
        axes.loglog(line, row, color=colour, linewidth=1.0, label=name)
    name, unit = fit.quantity
    over = "ω a_T [rad/s]" if fit.oscillation else "t/a_T [s]"
    axes.set(xlabel=f"{over} at {fit.reference:.5g} K", ylabel=f"{name} [{unit}]")
    axes.legend(fontsize="x-small", ncol=2)


def _factors(axes: Any, fit: Any, colours: Any) -> None:
    """Plot the free shift factors with their intervals, and the law with its band."""
    T = fit.temperatures
    fine = np.linspace(T[0], T[-1], 80)
    law = np.array([fit.factor(t) for t in fine])
    axes.fill_between(fine, law[:, 1], law[:, 2], color="0.6", alpha=0.4, label=f"{100 * fit.level:g} % band")
    axes.semilogy(fine, law[:, 0], color="0.2", label=fit.model.__name__)
    for t, (a, low, high), colour in zip(T, fit.factors, colours, strict=True):
        axes.errorbar(t, a, [[a - low], [high - a]], fmt="o", markersize=4, capsize=4, color=colour)
    axes.set(xlabel="temperature [K]", ylabel="shift factor a_T [-]", yscale="log")
    axes.legend(fontsize="small")


def _residuals(axes: Any, fit: Any, colours: Any) -> None:
    """Plot the residuals in percent of the modulus."""
    s = fit.shifting.sweeps
    x = np.exp((s.x + np.log(fit.law_factors)[s.which]) * (1.0 if fit.oscillation else -1.0))
    for k, colour in enumerate(colours):
        on = s.which == k
        axes.semilogx(x[on], -100.0 * fit.residuals[on], ".", markersize=4, color=colour)
    axes.axhline(0.0, color="0.4", linewidth=0.8)
    over = "ω a_T [rad/s]" if fit.oscillation else "t/a_T [s]"
    axes.set(xlabel=over, ylabel=f"residual [% of {'|G*|' if fit.oscillation else fit.quantity[0]}]")


def _palmen(axes: Any, fit: Any, colours: Any) -> None:
    """Plot the phase angle over |G*| of the data as measured."""
    for one in fit.data:
        k = int(np.argmin(np.abs(fit.temperatures - one.temperature)))
        G = one.shear
        axes.semilogx(np.abs(G), RADIAN * np.angle(G), ".", markersize=4, color=colours[k])
    axes.set(xlabel="|G*| [Pa]", ylabel="phase angle [°]", title="van Gurp-Palmen plot, not shifted")
    axes.title.set_fontsize("small")


def _raw(axes: Any, fit: Any, colours: Any) -> None:
    """Plot the data as measured over time."""
    name, unit = fit.quantity
    for one in fit.data:
        k = int(np.argmin(np.abs(fit.temperatures - one.temperature)))
        values = one.compliance if name == "J" else one.shear
        axes.loglog(one.t, values, ".", markersize=4, color=colours[k])
    axes.set(xlabel="t [s]", ylabel=f"{name} [{unit}]", title="as measured")
    axes.title.set_fontsize("small")
