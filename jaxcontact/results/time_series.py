"""Pictures of scalar quantities of a history over time."""

from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxcontact._support.fields import FIELDS
from jaxcontact._support.prefixes import prefixed
from jaxcontact.results.picture_style import COLOURS, scale_of, styled, time_axis

CONSTANT = (
    1e-4  # relative change below which a quantity counts as constant: the figures of its value are the same
)


DRAWN = {  # the fields that figures show over time, and their labels
    "approach": "approach",
    "load": "load",
    "contact_radius": "contact radius",
    "peak_pressure": "peak pressure",
    "tangential_force": "force against the motion",
    "tangential_load": "tangential load",
    "dissipated": "dissipated by friction",
}


class TimeSeries(NamedTuple):
    """A quantity over time with the name and the unit that a figure shows."""

    name: str
    values: Any
    unit: str

    @property
    def varies(self) -> bool:
        return bool(np.ptp(self.values) > CONSTANT * np.max(np.abs(self.values)))

    def __str__(self) -> str:
        """The name and the value of a quantity that is constant."""
        return f"{self.name} {prefixed(float(f'{np.max(self.values):.4g}'), self.unit)}"


def time_series(history: Any) -> tuple[list[TimeSeries], str]:
    """Return the time series to plot, and a line of text on those that are constant.

    The series are approach, load, contact radius and peak pressure, and for sliding and shear the friction quantities. If
    any series varies, only those that vary are returned.
    """
    series = [
        TimeSeries(label, _values(history, name), FIELDS[name].unit)
        for name, label in DRAWN.items()
        if hasattr(history, name)
    ]
    if not any(one.varies for one in series):
        return series, ""
    return [one for one in series if one.varies], ", ".join(str(one) for one in series if not one.varies)


def _values(history: Any, name: str) -> np.ndarray:
    """Return a field over time, (nt,); of a tangential load, its component along its largest value."""
    return along_the_largest(history)[1] if name == "tangential_load" else np.asarray(getattr(history, name))


def along_the_largest(history: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return tangential displacement and load along the line of the largest tangential load, (nt,) each.

    The larger component of the direction is positive, so that a load along x has the sign of its x component.
    """
    load, displacement = np.asarray(history.tangential_load), np.asarray(history.tangential_displacement)
    largest = load[np.argmax(np.sum(load**2, 1))]
    largest = largest * np.sign(largest[np.argmax(np.abs(largest))])
    direction = largest / max(float(np.sqrt(np.sum(largest**2))), np.finfo(float).tiny)
    return displacement @ direction, load @ direction


def against_time(ax: Axes, times: Any, values: Any, name: str, unit: str) -> Axes:
    """Plot a scalar quantity of the history against time [s].

    The axis begins at zero, so that neither rounding nor a small change is enlarged to the whole height.
    """
    values, (factor, symbol) = np.asarray(values), scale_of(values, unit)
    ax.plot(times, values / factor, color=colormaps[COLOURS](0.3), lw=1.6, marker=".", ms=3)
    ax.set_ylabel(f"{name} [{symbol}]")
    time_axis(ax, times)
    ax.ticklabel_format(axis="y", useOffset=False)
    low, high = float(np.min(values)) / factor, float(np.max(values)) / factor
    if low == high == 0.0:
        ax.set_ylim(-1.0, 1.0)
    elif low >= 0.0:
        ax.set_ylim(0.0, 1.08 * high)
    elif high <= 0.0:
        ax.set_ylim(1.08 * low, 0.0)
    else:
        ax.axhline(0.0, color="0.7", lw=0.8, ls="-", zorder=0)
    return ax


@styled
def history_figure(history: Any) -> Figure:
    """Time series of the main quantities: one panel for each that varies, the constant ones in the title."""
    series, constant = time_series(history)
    figure = Figure(figsize=(3.6 * len(series), 3.4), layout="constrained")
    for ax, one in zip(np.atleast_1d(figure.subplots(1, len(series))), series, strict=True):
        against_time(ax, history.times, one.values, one.name, one.unit)
    figure.suptitle(constant, fontsize="medium")
    return figure
