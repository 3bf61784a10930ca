"""Figure of a fit: data, model and residuals over time, the parameters, and the verdict."""

import functools
import math
import textwrap
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fitting.views import text
from jaxcontact._support.prefixes import fitting_prefix

# Plot axes with SI prefixes that suit their values: 3.5 1/GPa and 120 nm rather than 3.5e-9 1/Pa and 1.2e-7 m.


def axis_label(axis: Any, name: str, unit: str, values: np.ndarray) -> None:
    """Label a matplotlib axis of values in an SI unit, with ticks in a multiple of that unit."""
    factor, unit = multiple(unit, float(np.max(np.abs(values), initial=0.0)))
    axis.set_label_text(f"{name} [{unit}]")
    if factor != 1.0:
        axis.set_major_formatter(lambda value, _: f"{value / factor:g}")


def multiple(unit: str, largest: float) -> tuple[float, str]:
    """Return (factor, unit) in which the largest value is 1 to 1000; units other than Pa, 1/Pa, N and m are unchanged."""
    if unit == "1/Pa":
        factor, prefixed = multiple("Pa", 1e3 / largest if largest > 0.0 else 1.0)
        return 1.0 / factor, f"1/{prefixed}"
    if unit not in ("Pa", "N", "m"):
        return 1.0, unit
    factor, prefix = fitting_prefix(largest)
    return factor, prefix + unit


EARLY = 0.1  # fraction of the duration with half of the samples, below which the time axis is logarithmic
DECADES = 20.0  # ratio of the ends of an axis of J or G above which it is logarithmic, and of its values
STEEP = 3.0
HELD = 0.95  # fraction of the largest load above which it is held
STYLE = "jaxcontact.style"  # that of the figures of results
# its colours; names such as C0 would be those of the style in which a figure is saved
VIOLET, BLUE, GREEN = "#440154", "#31688e", "#23a06b"
REFUSED = "#b2182b"  # red, of the verdict of a fit that is rejected
RESIDUAL = "residual\n[std. deviations]"
FINE = 400  # number of points of a line
EVERY = 3  # of these points, those at which a band is computed; 400 = 133 x 3 + 1
HIDDEN = 3.0  # width of a band [points] that cannot be seen below its line
LETTERS = 90  # characters of a line above the narrowest figure


def deviations(fit: Any, of: Any = None) -> np.ndarray:
    """Return measured minus fitted values in standard deviations, those that were given or else estimated with the fit.

    of: another fit with the same weights, whose estimate is taken.
    """
    scale = 1.0 if fit.weights == "sigma" else (of or fit).noise or 1.0
    return -np.asarray(fit.residuals) / scale


def styled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a function that draws a figure so that it has the style of the figures of results."""

    @functools.wraps(function)
    def wrapper(*args: Any, **kwargs: Any) -> Any:
        from matplotlib import style

        with style.context(STYLE):
            return function(*args, **kwargs)

    return wrapper


@styled
def draw(
    fit: Any, path: Any, panel: Callable[[Any, Any], None], beside: Sequence[Callable[[Any], None]] = (),
    lines: Sequence[str] | None = None,
) -> Any:  # fmt: skip
    """Return a figure of a fit with its verdict above and its parameters below; save it where a path is given.

    panel(top, bottom): plots data and model, and below them the residuals, over one abscissa; beside: each plots into one of
    the axes at the right; lines: of text in place of the parameters.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.0 + 2.0 * len(beside)) if beside else (7.5, 6.5), layout="constrained")
    title(figure, fit)
    lines = [text.parameter(fit, name) for name in fit.values] if lines is None else lines
    places = figure.add_gridspec(3, 2 if beside else 1, height_ratios=(3, 1, 0.5 if lines else 1e-3))
    top = figure.add_subplot(places[0, 0])
    bottom = figure.add_subplot(places[1, 0], sharex=top)
    panel(top, bottom)
    top.tick_params(labelbottom=False)
    if top.get_legend() is None:
        top.legend(fontsize="small")
    bottom.axhline(0.0, color="0.4", linewidth=0.8)
    if beside:
        right = places[:2, 1].subgridspec(len(beside), 1)
        for k, plot in enumerate(beside):
            plot(figure.add_subplot(right[k]))
    if lines:
        below = figure.add_subplot(places[2, :])
        below.axis("off")
        below.text(0.0, 1.0, "\n".join(lines), va="top", family="monospace", fontsize="x-small")
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def draw_material(fit: Any, path: Any) -> Any:
    """Return a figure of the ``Fit`` of a material, with J(t) and its band beside the data where these are not J."""
    name, unit, t, measured = fit.curve
    direct = name == "J"

    def panel(top: Any, bottom: Any) -> None:
        line = _times(t, t[0], t[-1])
        top.plot(t, measured, ".", markersize=_dots(t), color="0.4", label="data")
        label = fit.model.__name__ + ("" if math.isnan(fit.r2) else f", R² = {fit.r2:.5f}")
        top.plot(*((line, fit.predict(line)) if direct else _broken(t, fit.fitted)), label=label)
        axis_label(top.yaxis, name, unit, measured)
        bottom.plot(t, deviations(fit), ".", markersize=_dots(t), color="0.4")
        bottom.set(xlabel="{} [{}]".format(*fit.abscissa), ylabel=RESIDUAL)
        scale_axes(top, t, measured, direct)
        if _is_hold(fit):  # the time alone, since the values of an indentation begin at zero
            scale_axes(top, t, np.zeros(1), True)
        if direct:
            _band(top, fit, line)

    return draw(fit, path, panel, () if direct else (functools.partial(compliance, fit),))


@styled
def draw_models(fits: Sequence[Any], path: Any) -> Any:
    """Return a figure of a ``Comparison``: data and all models, and below them the residuals of each, lowest BIC first."""
    from matplotlib import colormaps
    from matplotlib.figure import Figure

    best = fits[0]
    name, unit, t, measured = best.curve
    moduli = name not in ("J", "depth", "load")
    figure = Figure(figsize=(7.5, 4.0 + 0.9 * len(fits)), layout="constrained")
    top, *below = figure.subplots(1 + len(fits), 1, sharex=True, height_ratios=[4.0] + [1.0] * len(fits))
    top.plot(t, measured, ".", markersize=_dots(t), color="0.4", label="data")
    axis_label(top.yaxis, name, unit, measured)
    colours = colormaps["viridis"](np.linspace(0.0, 0.85, len(fits)))
    for k, (fit, axes, colour) in enumerate(zip(fits, below, colours, strict=True)):
        known, of = fit.model.__name__, f"{fit.bic - best.bic:+.1f}" if k else f"{fit.bic:.1f}"
        dashes = ("-", "--", ":", "-.")[k % 4]
        line, label = _broken(fit.curve[2], fit.fitted), f"{known}, BIC {of}, {fit.verdict}"
        top.plot(*line, color=colour, linestyle=dashes, label=label)
        axes.plot(fit.curve[2], deviations(fit, best), ".", markersize=_dots(t), color=colour)
        axes.axhline(0.0, color="0.4", linewidth=0.8)
        axes.set_title(known, fontsize="small", loc="left", pad=2.0)
    # not the best place, which takes long to find among many points
    top.legend(fontsize="small", loc="upper left" if measured[-1] > measured[0] else "upper right")
    below[-1].set_xlabel("{} [{}]".format(*best.abscissa))
    figure.supylabel("residuals [standard deviations of the best fit]", fontsize="small", y=0.3)
    scale_axes(top, t, measured, name == "J" or moduli)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


@styled
def draw_tests(fit: Any, path: Any) -> Any:
    """Return a figure of a ``JointFit``: data and fit of every test side by side, and the parameters below."""
    from matplotlib.figure import Figure

    tests = fit.curves
    figure = Figure(figsize=(4.5 * len(tests), 5.0), layout="constrained")
    title(figure, fit)
    places = figure.add_gridspec(2, len(tests), height_ratios=(4, 1))
    for k, (name, unit, x, values, fitted) in enumerate(tests):
        axes = figure.add_subplot(places[0, k])
        axes.plot(x, values, ".", markersize=_dots(x), color="0.4", label="data")
        axes.plot(*_broken(x, fitted), label=fit.model.__name__)
        positive = np.all(values > 0) and np.all(fitted > 0)
        over = "angular frequency [rad/s]" if name.startswith("G'") else "t [s]"
        axes.set(xlabel=over, ylabel=f"{name} [{unit}]", xscale="log", yscale="log" if positive else "linear")
        axes.legend()
    parameters(figure.add_subplot(places[1, :]), fit)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def title(figure: Any, fit: Any) -> None:
    """Write the verdict above a figure."""
    reasons = [textwrap.fill(reason, LETTERS) for reason in fit.refused]
    lines = [f"{fit.verdict}: {text.in_words(fit)}", *reasons]
    figure.suptitle("\n".join(lines), fontsize="medium", color=REFUSED if fit.refused else "black")


def _broken(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a line that is interrupted where t decreases, as between storage and loss modulus."""
    back = np.flatnonzero(np.diff(t) < 0) + 1
    return np.insert(t, back, np.nan), np.insert(y, back, np.nan)


def parameters(axes: Any, fit: Any) -> None:
    """Print the line of each parameter from the summary."""
    axes.axis("off")
    lines = [text.parameter(fit, name) for name in fit.values]
    axes.text(0.0, 1.0, "\n".join(lines), va="top", family="monospace", fontsize="x-small")


def _scale(t: np.ndarray) -> str:
    """Return "log" where most samples are early, otherwise "linear"."""
    return "log" if np.median(t) - t[0] < EARLY * (t[-1] - t[0]) else "linear"


def _is_hold(fit: Any) -> bool:
    """Return whether the load of an indentation, or the depth where the load is fitted, is held for most of the time."""
    control = getattr(fit.data, {"depth": "load", "load": "depth"}.get(fit.curve[0], ""), None)
    t = fit.curve[2]
    if control is None or np.shape(control) != t.shape:
        return False
    held = np.asarray(control) > HELD * np.max(control)
    return bool(np.sum(np.diff(t)[held[1:]]) > 0.5 * (t[-1] - t[0]))


def _dots(samples: Any) -> float:
    """Return the size of the marks of samples, which a few have to be to be seen."""
    return 3.0 if len(samples) > 60 else 7.0


def scale_axes(axes: Any, t: np.ndarray, values: np.ndarray, of_material: bool) -> None:
    """Make the axes of a curve logarithmic: that of time where most samples are early.

    The axes of a property of a material (J(t), G(t)) are logarithmic where times span more than a decade, and its values
    where they are positive and not all alike: a misfit at early times, where values are small, is seen there alone.
    """
    later = t[t > 0.0]
    if of_material and later.size and t[0] >= 0.0 and t[-1] > DECADES * later[0]:
        # a first point at zero stays in view, left of the first decade
        axes.set_xscale("log") if t[0] > 0.0 else axes.set_xscale("symlog", linthresh=later[0], linscale=0.3)
        if np.all(values > 0.0) and np.max(values) > STEEP * np.min(values):
            logarithmic(axes, values)
    else:
        axes.set_xscale(_scale(t))


def logarithmic(axes: Any, values: np.ndarray) -> None:
    """Make the vertical axis logarithmic, with more ticks where it spans few decades."""
    from matplotlib.ticker import NullFormatter

    formatter = axes.yaxis.get_major_formatter()
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(log_ticks(values))
    axes.yaxis.set_major_formatter(formatter)
    axes.yaxis.set_minor_formatter(NullFormatter())


def log_ticks(values: np.ndarray) -> Any:
    """Return the ticks of a logarithmic axis of positive values: the fewer decades, the more in each."""
    from matplotlib.ticker import LogLocator

    ratio = np.max(values) / np.min(values)
    subs = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0) if ratio < 10.0 else (1.0, 2.0, 5.0) if ratio < 100.0 else (1.0,)
    return LogLocator(subs=subs)


def _times(t: np.ndarray, begin: float, end: float) -> np.ndarray:
    """Return times from begin to end [s], with the spacing of the samples t."""
    later = t[t > begin]
    if _scale(t) == "linear" and not end > DECADES * max(begin, later[0]):
        return np.linspace(begin, end, FINE)
    if begin > 0.0:
        return np.geomspace(begin, end, FINE)
    return np.append(begin, np.geomspace(later[0], end, FINE - 1))


def compliance(fit: Any, axes: Any) -> None:
    """Plot J(t) of the material and its band; on a logarithmic axis from the time of the first sample on."""
    first = float(fit.since[fit.since > 0.0][0])
    t = _times(fit.since, first if fit.duration > DECADES * first else 0.0, fit.duration)
    axes.plot(t, fit.predict(t))
    axes.set_xlabel("time [s]")
    J = np.asarray(fit.predict(t))
    axis_label(axes.yaxis, "J", "1/Pa", J)
    scale_axes(axes, t, J, True)
    _band(axes, fit, t)
    axes.legend()


def _band(axes: Any, fit: Any, t: np.ndarray) -> None:
    """Fill the band of J(t) at t (FINE,) in axes that are scaled; a legend says so where the line of J hides it.

    The distances of the band from J vary slowly, and are interpolated between nodes.
    """
    nodes, J, place = t[::EVERY], fit.predict(t), np.arange(t.size)
    low, high = (J + np.interp(place, place[::EVERY], end - J[::EVERY]) for end in fit.band(nodes))
    ends = [axes.transData.transform(np.column_stack([t, end]))[:, 1] for end in (low, high)]
    hidden = ", within the line" if np.max(ends[1] - ends[0]) < HIDDEN * axes.figure.dpi / 72.0 else ""
    axes.fill_between(t, low, high, alpha=0.3, label=f"{100 * fit.level:g} % band{hidden}")


# Figure of an indentation curve: the selected points over the measured ones.


COLOURS = {"approach": VIOLET, "hold": BLUE, "retract": GREEN}


@styled
def draw_curve(data: Any) -> Any:
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
        axis_label(panel.xaxis, *names[x], shown[x])
        axis_label(panel.yaxis, *names[y], shown[y])
    panels[0].legend(frameon=False)
    return figure


WIDE = 20.0  # ratio of the ends of an axis above which it is logarithmic


@styled
def prediction(wanted: Any, at: np.ndarray, band: Any, level: float) -> Any:
    """Return a Figure of a predicted quantity (``PredictedQuantity``) at times or frequencies (k,)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.5), layout="constrained")
    axes, order = figure.add_subplot(), np.argsort(at)
    x, value, low, high = (np.asarray(y)[order] for y in (at, band.value, band.low, band.high))
    axes.fill_between(x, low, high, alpha=0.3, label=f"{100 * level:g} % band")
    ends = np.maximum([value - low, high - value], 0.0)
    axes.errorbar(x, value, ends, fmt="o-", markersize=4, capsize=3, label=wanted.name)
    if x[0] > 0.0 and x[-1] > WIDE * x[0]:
        axes.set_xscale("log")
    if np.all(low > 0.0) and value.max() > WIDE * value.min():
        axes.set_yscale("log")
    axes.set_xlabel("{} [{}]".format(*wanted.over))
    axis_label(axes.yaxis, wanted.name, wanted.unit, high)
    axes.legend()
    return figure
