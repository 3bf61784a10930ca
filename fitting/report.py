"""What a fit says to a person: lines of text, and a figure. They read a ``Fit``, whatever its kind."""

import math
from typing import Any

import numpy as np

ENOUGH = 4.0  # duration over the longest retardation time from which flow and retardation separate


def parameter(fit: Any, name: str) -> str:
    """A parameter with its interval, or what is known of it."""
    unit, value, (low, high) = fit.structure.unit(name), fit.values[name], fit.intervals[name]
    percent = f"{100 * fit.level:g} %"
    if name in fit.fixed:
        return f"  {name:5s} = {value:11.5g} {unit:5s} fixed"
    if fit.identified[name]:
        return f"  {name:5s} = {value:11.5g} {unit:5s} {percent} interval {low:.5g} to {high:.5g}"
    return f"  {name:5s} not determined: {span(low, high)} {unit} ({percent}); best {value:.5g}"


def span(low: float, high: float) -> str:
    """An interval whose open sides are not printed."""
    if low > 0 and math.isinf(high):
        return f"> {low:.4g}"
    if low == 0 and math.isfinite(high):
        return f"< {high:.4g}"
    return "any value" if low == 0 else f"{low:.4g} to {high:.4g}"


def separation(fit: Any) -> list[str]:
    """Duration against the retardation times, and the weakest direction."""
    lines = []
    if math.isfinite(fit.t_over_tau):
        short = "" if fit.t_over_tau >= ENOUGH else f"; below {ENOUGH:g} flow and retardation do not separate"
        times = ", ".join(f"{tau:.5g}" for tau in np.atleast_1d(fit.tau))
        lines.append(f"  tau = {times} s, T/tau = {fit.t_over_tau:.3g}{short}")
    if fit.weakest:
        weak = " ".join(f"{v:+.2f} {name}" for name, v in fit.weakest.items())
        lines.append(
            f"  condition (log parameters) {fit.condition:.2g}; weakest: {weak}, sd {fit.weakest_sd:.2g}"
        )
    return lines


def quality(fit: Any) -> list[str]:
    """How well the model describes the data."""
    lines = [
        f"  R2 = {fit.r2:.6f}, AIC {fit.aic:.1f}, BIC {fit.bic:.1f}, lag-1 residual correlation {fit.lag1:.2f}"
    ]
    if fit.misfit:
        lines.append(
            f"  MISFIT: residuals are correlated beyond chance; intervals were widened "
            f"{fit.widening:.2g} times and hold only if the model does"
        )
    return lines


def picture(fit: Any, path: Any) -> Any:
    """Data, fit and residuals; J(t) with its band, beside them where the data are not J themselves."""
    from matplotlib.figure import Figure

    name, unit, t, measured = fit.curve
    direct = name == "J"
    figure = Figure(figsize=(7.0, 5.5) if direct else (9.0, 5.0), layout="constrained")
    places = figure.add_gridspec(2, 1 if direct else 2, height_ratios=(3, 1))
    top = figure.add_subplot(places[0, 0])
    bottom = figure.add_subplot(places[1, 0], sharex=top)
    if direct:
        _band(top, fit, np.linspace(t[0], t[-1], 200))
    else:
        _compliance(figure.add_subplot(places[:, 1]), fit)
    top.plot(t, measured, ".", markersize=3, color="0.4", label="data")
    top.plot(t, fit.fitted, label=f"{fit.model.__name__}, R² = {fit.r2:.5f}")
    top.set(ylabel=f"{name} [{unit}]")
    top.tick_params(labelbottom=False)
    top.legend()
    bottom.plot(t, -fit.residuals, ".", markersize=3)
    bottom.axhline(0.0, color="0.4", linewidth=0.8)
    bottom.set(xlabel="t [s]", ylabel=f"residual\n({fit.weights})")
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def _compliance(axes: Any, fit: Any) -> None:
    """J(t) of the material and its band."""
    t = np.linspace(0.0, fit.duration, 200)
    _band(axes, fit, t)
    axes.plot(t, fit.predict(t))
    axes.set(xlabel="time since the first sample [s]", ylabel="J [1/Pa]")
    axes.legend()


def _band(axes: Any, fit: Any, t: np.ndarray) -> None:
    low, high = fit.band(t)
    axes.fill_between(t, low, high, alpha=0.3, label=f"{100 * fit.level:g} % band")
