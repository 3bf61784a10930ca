"""Figure of a relaxation spectrum: the moduli with the fit, the spectrum with its band, and the residuals."""

from typing import Any

import numpy as np

from fitting.views import fit_picture

NAMES, COLOURS = ("G'", "G''"), ("C3", "C0")


def draw(fit: Any, path: Any) -> Any:
    """Return a Figure of a ``SpectrumFit``; saved where a path is given."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 5.5), layout="constrained")
    fit_picture.title(figure, fit)
    places = figure.add_gridspec(2, 2, height_ratios=(3, 1))
    top, bottom = figure.add_subplot(places[0, 0]), figure.add_subplot(places[1, 0])
    _, _, x, y = fit.curve
    count = 1 if fit.relaxed else 2
    parts = [np.split(values, count) for values in (x, y, fit.fitted, fit.residuals)]
    for k, name in enumerate(("G(t)",) if fit.relaxed else NAMES):
        at, measured, fitted, residual = (part[k] for part in parts)
        on = (at > 0.0) & (measured > 0.0)
        top.loglog(at[on], measured[on], ".", markersize=4, color=COLOURS[k], label=name)
        top.loglog(at[at > 0.0], fitted[at > 0.0], color=COLOURS[k], linewidth=1.0)
        bottom.semilogx(at[at > 0.0], -residual[at > 0.0], ".", markersize=4, color=COLOURS[k])
    top.set_ylabel("modulus [Pa]")
    top.legend(fontsize="small")
    bottom.axhline(0.0, color="0.4", linewidth=0.8)
    bottom.set(xlabel="t [s]" if fit.relaxed else "ω [rad/s]", ylabel=f"residual [-]\n({fit.weights})")
    _spectrum(figure.add_subplot(places[:, 1]), fit)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def _spectrum(axes: Any, fit: Any) -> None:
    """Plot the spectrum, dashed where the data do not resolve it."""
    axes.loglog(fit.tau, fit.H, "--", color="0.6", label="not resolved")
    axes.loglog(fit.tau, np.where(fit.resolved, fit.H, np.nan), color="C0", label="H")
    band = [np.where(fit.resolved, end, np.nan) for end in (fit.low, fit.high)]
    axes.fill_between(fit.tau, *band, alpha=0.3, label=f"{100 * fit.level:g} % band")
    known = fit.high[fit.resolved] if fit.resolved.any() else fit.H
    axes.set(xlabel="τ [s]", ylabel="H [Pa]", ylim=(0.2 * fit.H[fit.resolved].min() if fit.resolved.any() else None,
                                                   3.0 * known.max()))  # fmt: skip
    axes.legend(fontsize="small")
