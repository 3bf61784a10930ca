"""An indentation fit made ready: what was asked for, checked, and scaled.

Scaled are times by the duration, load and depth by their largest, and compliance so that a half-space
has depth^power = int J dP (``coordinates.py``, ``probe.py``).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import scipy

from fitting.data.contact import find_contact
from fitting.data.curves import IndentationData
from fitting.data.probe import Probe, probe_of
from fitting.data.weights import choose_weights
from fitting.models import adhesion
from fitting.models.coordinates import NUISANCES, Space
from fitting.models.history import columns
from fitting.models.structure import Structure, Volume
from fitting.search import varpro
from fitting.search.nonlinear import Best, Objective

AIR, AIR_SHARE = 5, 0.02  # points before contact that may be fitted, in number and of all
TIMES = np.geomspace(3e-3, 3.0, 7)  # retardation times over the duration that are started from
SHARED = np.array([0.45, 0.45, 0.1])  # between spring, retarded part and flow
VISIBLE = 1e-2  # scaled compliance that a part has at least there
LEAST_LOAD = 0.5  # share of the greatest load below which the contact certainly shrinks


class Press(NamedTuple):
    """t, load, depth (n,), scaled; kept (n,) bool: points that are fitted; weights (n,), 0 elsewhere.

    duration [s], load_unit [N], depth_unit [m], unit [1/Pa]: undo the scaling. table: bounds of the
    parameters; space: of the search; label: of the weights; adhesion: the work of it [J/m2]; notes.
    """

    data: IndentationData
    indenter: Any
    probe: Probe
    volume: Volume
    control: str
    t: np.ndarray
    load: np.ndarray
    depth: np.ndarray
    kept: np.ndarray
    weights: np.ndarray
    label: str
    duration: float
    load_unit: float
    depth_unit: float
    unit: float
    table: dict[str, tuple[float, float]]
    space: Space
    adhesion: float
    notes: tuple[str, ...]

    @property
    def extra(self) -> float:
        """Scaled compliance that an elastic ball adds to J."""
        return float(self.indenter.compliance()) / self.volume.share / self.unit

    @property
    def bulk(self) -> float | None:
        """Scaled bulk modulus, None for a constant nu."""
        return self.volume.value * self.unit if self.volume.name == "bulk_modulus" else None

    @property
    def pull(self) -> float:
        """Scaled 6 pi w R of the work of adhesion w, 0 without."""
        return (
            6.0 * np.pi * self.adhesion * float(self.indenter.radius) / self.load_unit
            if self.adhesion
            else 0.0
        )

    @property
    def known(self) -> bool:
        """Whether the standard deviations of the points are given."""
        return self.label == "sigma"

    @property
    def measured(self) -> np.ndarray:
        """What is fitted, (n,): depth under load control, load under depth control."""
        return self.depth if self.control == "load" else self.load

    @property
    def size(self) -> float:
        """Weighted sum of squares of what is fitted."""
        return float(np.sum((self.weights * self.measured) ** 2))

    @property
    def response(self) -> tuple[str, str]:
        """Name and unit of what is fitted."""
        return ("depth", "m") if self.control == "load" else ("load", "N")

    @property
    def response_unit(self) -> float:
        """Of what is fitted: [m] or [N]."""
        return self.depth_unit if self.control == "load" else self.load_unit


def prepare(
    data: IndentationData, structure: Structure, table: dict, indenter: Any, volume: Volume, control: str,
    weights: str | None, sigma: Any, nuisances: dict[str, float | str], rise: float | None, work: Any, film: bool,
) -> Press:  # fmt: skip
    """Check and scale; ValueError with expected and got. film: whether there is one, or a half-space."""
    probe = probe_of(indenter)
    _check(data, control, rise)
    work = adhesion.check(work, data, indenter, control, structure.model)
    t = data.t - data.t[0]
    kept = ((data.load > 0) | (work > 0)) & (data.depth > 0) & (t >= (rise or 0.0))
    if kept.sum() < 5:
        raise ValueError(
            f"data: expected at least 5 points in contact (load and depth > 0), got {kept.sum()}"
        )
    notes = [] if kept.all() else [f"{(~kept).sum()} points before contact or during the rise not fitted"]
    P, d, T = float(data.load.max()), float(data.depth.max()), float(t[-1])
    # J that a scaled compliance of one stands for
    unit = probe.size * d**probe.power / (volume.share * P)
    response = data.depth if control == "load" else data.load
    scatter = data.scatter_depth if control == "load" else data.scatter_load
    if weights is None and sigma is None:
        sigma = data.sigma_depth if control == "load" else data.sigma_load
        weights = "absolute" if sigma is None and scatter is None else None
    weight, label = _weights(t, response, kept, weights, sigma, scatter)
    space = _space(structure, table, nuisances, unit, T, np.array([d, d / T, d / P]))
    shrinks = probe.power > 1.0 and data.load[-1] < LEAST_LOAD * P
    if control == "load" and rise is None and shrinks:
        raise ValueError(
            f"data: load control needs a contact that grows, got a load that falls from {P:g} to"
            f' {data.load[-1]:g} N; leave the unloading out, or take control="depth"'
        )
    if not work:  # the load of a ball that sticks falls before it rises
        _check_contact(data, kept, probe.power, film)
    return Press(
        data, indenter, probe, volume, control, t / T, data.load / P, data.depth / d, kept,
        weight * float(response.max()), label, T, P, d, unit, table, space, work, tuple(notes),
    )  # fmt: skip


def _check(data: IndentationData, control: str, rise: float | None) -> None:
    if not isinstance(data, IndentationData):
        raise ValueError(f"data: expected IndentationData, got {type(data).__name__}")
    if control not in ("load", "depth"):
        raise ValueError(f'control: expected "load" or "depth", got {control!r}')
    if rise is not None and not (control == "load" and 0.0 <= rise < data.t[-1] - data.t[0]):
        raise ValueError(f"rise: expected 0 <= rise < the duration, under load control, got {rise!r} s")


def _check_contact(data: IndentationData, kept: np.ndarray, power: float, film: bool) -> None:
    """ValueError where points before contact would be fitted as if they were in it."""
    if data.cut:
        return
    found = find_contact(data.t, data.load, data.depth, power=power, film=film)
    # of resampled points, the samples that they stand for
    samples = (
        np.ones(kept.size)
        if data.scatter_depth is None
        else (data.scatter_depth.max() / data.scatter_depth) ** 2
    )
    fitted = round(float(np.sum((kept * samples)[: found.before])))
    if fitted > max(AIR, AIR_SHARE * np.sum(kept * samples)):
        raise ValueError(
            f"data: expected a curve from contact on, got {fitted} points before it, at {found.t:.4g} s and"
            f" {found.depth:.4g} m: data.in_contact({'film=True' if film else ''}) leaves them out"
        )


def _weights(
    t: np.ndarray, response: np.ndarray, kept: np.ndarray, weights: str | None, sigma: Any, scatter: Any
) -> tuple[np.ndarray, str]:
    """Weights (n,) [1/unit of the response], zero where not kept, and their label."""
    chosen = np.zeros(response.shape)
    if sigma is not None:
        weights, sigma = None, np.broadcast_to(np.asarray(sigma, dtype=float), response.shape)[kept]
    some = None if scatter is None else scatter[kept]
    chosen[kept], label = choose_weights(t[kept], response[kept], weights, sigma, some)
    return chosen, label


def _space(
    structure: Structure, table: dict, nuisances: dict, unit: float, T: float, sizes: np.ndarray
) -> Space:
    """Compliances, then contact point, drift and machine compliance, of ``sizes`` (3,) in SI."""
    units = structure.units(unit, T)
    held = [_nuisance(name, nuisances[name], size) for name, size in zip(NUISANCES, sizes, strict=True)]
    box = np.concatenate([structure.box(table) / units[:, None], held])
    return Space(structure, box, np.append(units, sizes), T)


def _nuisance(name: str, value: float | str, size: float) -> tuple[float, float]:
    """Bounds of a nuisance: equal where it is known."""
    if isinstance(value, str) and value.lower() == "fit":
        return (0.0 if name == "machine_compliance" else -1.0), 1.0
    if isinstance(value, str) or not np.isfinite(value):
        raise ValueError(f'{name}: expected a number or "fit", got {value!r}')
    return value / size, value / size


def start(press: Press, y: np.ndarray, weights: np.ndarray, basis: Any, least: float) -> np.ndarray:
    """Coordinates (m,) near the weighted least squares of y (n,) by the columns of ``basis``, at the samples.

    No logarithm begins below that of ``least``.
    """
    space = press.space
    box = space.linear_box
    if space.structure.tau is None:
        _, x, tau, _ = varpro.solve(_search(press, y, weights, basis))
        found = np.append(x, x[1] / tau)[varpro.PLACES[len(box)]]
    else:
        A = weights[:, None] * np.asarray(columns(basis, press.duration / space.structure.tau))
        low, high = box.T
        found = scipy.optimize.lsq_linear(A, weights * y, (low, np.maximum(high, low + 1e-300))).x
    return space.near(found, least)


def spread_starts(press: Press, y: np.ndarray, weights: np.ndarray, basis: Any) -> list[np.ndarray]:
    """More coordinates to start from, where a retardation time is sought: for each of ``TIMES`` held, the same
    least squares, and its compliance at the end shared out evenly."""
    space = press.space
    if space.structure.tau is not None or space.structure.branches == 0:
        return []
    x = np.asarray(varpro.solve_each(_search(press, y, weights, basis), TIMES))
    even = np.outer(x.sum(1), SHARED)
    x, times = np.concatenate([x, even]), np.tile(TIMES, 2)
    return [space.near(np.append(row, row[1] / tau), VISIBLE) for row, tau in zip(x, times, strict=True)]


def _search(press: Press, y: np.ndarray, weights: np.ndarray, basis: Any) -> varpro.TauSearch:
    return varpro.search(y, weights, basis, press.t, press.space.linear_box)


class Medium(NamedTuple):
    """thickness [m], substrate and grid of the solver; left (m,): the bias of the coordinates that its discretisation
    leaves, and {coordinate: that over its standard error}. None, zero and empty for a half-space."""

    thickness: float | None = None
    substrate: Any = None
    grid: Any = None
    left: np.ndarray = np.zeros(1)
    bias: dict[str, float] = {}  # noqa: RUF012


class Found(NamedTuple):
    """What was searched, the optimum and its objective; notes; moves(name) (m,): change of the coordinates with a
    quantity held in the fit; medium: what was indented; residual (n,): of the coordinates, None where it is dear;
    slow: the optimum for an edge that sticks and has time to creep; against: why the fit does not stand."""

    press: Press
    best: Best
    objective: Objective
    notes: tuple[str, ...]
    moves: Callable[[str], np.ndarray]
    medium: Medium
    residual: Callable[[Any], Any] | None = None
    slow: Best | None = None
    against: tuple[str, ...] = ()
