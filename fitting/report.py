"""What a fit says to a person: text and figure."""

import math
from typing import Any

import numpy as np

from fitting import models
from fitting.indentation_result import UNITS, IndentationFit
from fitting.result import ENOUGH, CreepFit

Fit = CreepFit | IndentationFit


def creep_summary(fit: CreepFit) -> str:
    """Several lines: parameters with intervals, what the data cannot tell, misfit, notes."""
    t = fit.data.t
    head = (
        f"{fit.model.__name__} fit of {t.size} points, t = {t[0]:.4g} to {t[-1]:.4g} s; "
        f"weights: {fit.weights}; compliance: {fit.data.convention}"
    )
    lines = [head, *(_parameter(fit, name) for name in fit.values), *_determination(fit), *_quality(fit)]
    return "\n".join([*lines, *(f"note: {note}" for note in fit.data.notes)])


def _parameter(fit: Fit, name: str) -> str:
    unit, value, (low, high) = models.unit(name), fit.values[name], fit.intervals[name]
    percent = f"{100 * fit.level:g} %"
    if name in fit.fixed:
        return f"  {name:5s} = {value:11.5g} {unit:5s} fixed"
    if fit.identified[name]:
        return f"  {name:5s} = {value:11.5g} {unit:5s} {percent} interval {low:.5g} to {high:.5g}"
    return f"  {name:5s} not determined: {_range(low, high)} {unit} ({percent}); best {value:.5g}"


def _range(low: float, high: float) -> str:
    """An interval whose open sides are not printed."""
    if low > 0 and math.isinf(high):
        return f"> {low:.4g}"
    if low == 0 and math.isfinite(high):
        return f"< {high:.4g}"
    return "any value" if low == 0 else f"{low:.4g} to {high:.4g}"


def _determination(fit: CreepFit) -> list[str]:
    lines = _separation(fit)
    for name, (value, sd, low, high) in fit.combinations.items():
        unit = "1/(Pa s)" if name == "slope0" else "1/Pa"
        lines.append(f"  {name:6s} = {value:11.5g} {unit}, sd {sd:.2g}, {_range(low, high)}")
    return lines


def _separation(fit: Fit) -> list[str]:
    """Duration against tau, and the weakest direction."""
    lines = []
    if math.isfinite(fit.tau):
        short = "" if fit.t_over_tau >= ENOUGH else f"; below {ENOUGH:g} flow and retardation do not separate"
        lines.append(f"  tau = {fit.tau:.5g} s, T/tau = {fit.t_over_tau:.3g}{short}")
    if fit.weakest:
        weak = " ".join(f"{v:+.2f} {name}" for name, v in fit.weakest.items())
        lines.append(
            f"  condition (log parameters) {fit.condition:.2g}; weakest: {weak}, sd {fit.weakest_sd:.2g}"
        )
    return lines


def _quality(fit: Fit) -> list[str]:
    lines = [
        f"  R2 = {fit.r2:.6f}, AIC {fit.aic:.1f}, BIC {fit.bic:.1f}, lag-1 residual correlation {fit.lag1:.2f}"
    ]
    if fit.misfit:
        lines.append(
            f"  MISFIT: residuals are correlated beyond chance; intervals were widened "
            f"{fit.widening:.2g} times and hold only if the model does"
        )
    return lines


def creep_figure(fit: CreepFit, path: Any = None) -> Any:
    """Data, fit and band above, weighted residuals below; a matplotlib Figure, saved if a path is given."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 5.5), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    t = fit.data.t
    if fit.data.J is not None:
        fine = np.linspace(t[0], t[-1], 200)
        low, high = fit.band(fine)
        top.fill_between(fine, low, high, alpha=0.3, label=f"{100 * fit.level:g} % band")
    top.plot(t, fit.data.response, ".", markersize=3, color="0.4", label="data")
    top.plot(t, fit.fitted, label=f"{fit.model.__name__}, R² = {fit.r2:.5f}")
    top.set_ylabel("J [1/Pa]" if fit.data.J is not None else "strain")
    top.legend()
    bottom.plot(t, -fit.residuals, ".", markersize=3)
    bottom.axhline(0.0, color="0.4", linewidth=0.8)
    bottom.set(xlabel="t [s]", ylabel=f"residual ({fit.weights})")
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def indentation_summary(fit: IndentationFit) -> str:
    """Several lines: parameters with intervals, what they are conditional on, misfit, notes."""
    t = fit.data.t[fit.kept]
    head = (
        f"{fit.model.__name__} fit of {t.size} points, t = {t[0]:.4g} to {t[-1]:.4g} s; "
        f"{fit.control} control; weights: {fit.weights}; ball of R = {float(fit.indenter.radius):.4g} m"
    )
    lines = [head, *(_parameter(fit, name) for name in fit.values)]
    for name, (value, low, high) in fit.nuisances.items():
        lines.append(
            f"  {name} = {value:.5g} {UNITS[name]}, {_range(low, high) if low > 0 else f'{low:.4g} to {high:.4g}'}"
        )
    lines += [*_separation(fit), *_quality(fit), _condition(fit)]
    forward, gradient = fit.runs
    lines.append(f"  {forward} forward and {gradient} gradient runs in {fit.seconds:.3g} s")
    return "\n".join([*lines, *(f"note: {note}" for note in (*fit.data.notes, *fit.notes))])


def _condition(fit: IndentationFit) -> str:
    """What the moduli hold for."""
    if fit.film.thickness is None:
        return f"  the moduli are conditional on nu = {fit.nu:g} and a half-space"
    return (
        f"  the moduli are conditional on thickness = {fit.film.thickness:.4g} m and nu = {fit.nu:g}, "
        "from which a wide contact cannot tell them apart\n"
        f"  grid {fit.film.grid.shape[0]} x {fit.film.grid.shape[1]}; discretisation bias over standard error: "
        + ", ".join(f"{name} {value:.2g}" for name, value in fit.film.bias.items())
    )


def indentation_figure(fit: IndentationFit, path: Any = None) -> Any:
    """Data and fit with residuals below, and J(t) with its band; a Figure, saved if a path is given."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(3, 1))
    top, bottom, right = (figure.add_subplot(place) for place in (grid[0, 0], grid[1, 0], grid[:, 1]))
    name, unit, t, measured = fit.curve
    top.plot(t, measured, ".", markersize=3, color="0.4", label="data")
    top.plot(t, fit.fitted, label=f"{fit.model.__name__}, R² = {fit.r2:.5f}")
    top.set(ylabel=f"{name} [{unit}]")
    top.tick_params(labelbottom=False)
    top.legend()
    bottom.plot(t, -fit.residuals, ".", markersize=3)
    bottom.axhline(0.0, color="0.4", linewidth=0.8)
    bottom.set(xlabel="t [s]", ylabel=f"residual\n({fit.weights})")
    fine = np.linspace(0.0, fit.duration, 200)
    low, high = fit.band(fine)
    right.fill_between(fine, low, high, alpha=0.3, label=f"{100 * fit.level:g} % band")
    right.plot(fine, fit.predict(fine))
    right.set(xlabel="time since the first sample [s]", ylabel="J [1/Pa]")
    right.legend()
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure
