"""An indentation fit made ready: what was asked for, checked, and scaled.

Scaled are times by the duration, load and depth by their largest, and compliance so that a half-space
has depth^(3/2) = int J dP; the coordinates of the fit are those of ``halfspace.py``.
"""

from typing import Any, NamedTuple

import numpy as np

import jaxcontact as jc
from fitting import models
from fitting.creep import choose_weights
from fitting.data import IndentationData
from fitting.halfspace import CONTACT, DRIFT, FLOW, LOGS, MACHINE, scale_compliance

EDGE = 16.0  # logarithms of scaled compliances stay within 1e-7 to 1e7
LEAST_LOAD = 0.5  # share of the greatest load below which the contact certainly shrinks
NUISANCES = {"contact_point": CONTACT, "drift": DRIFT, "machine_compliance": MACHINE}


class Press(NamedTuple):
    """t, load, depth (n,), scaled; kept (n,) bool: points that are fitted; weights (n,), 0 elsewhere.

    duration [s], load_unit [N], depth_unit [m], unit [1/Pa]: undo the scaling. table: bounds of the
    parameters; lower, upper (7,): of the coordinates; label: of the weights; notes.
    """

    data: IndentationData
    model: type
    indenter: Any
    nu: float
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
    lower: np.ndarray
    upper: np.ndarray
    notes: tuple[str, ...]

    @property
    def extra(self) -> float:
        """Scaled compliance that an elastic ball adds to J."""
        return float(self.indenter.compliance()) / (1.0 - self.nu) / self.unit

    @property
    def measured(self) -> np.ndarray:
        """What is fitted, (n,): depth under load control, load under depth control."""
        return self.depth if self.control == "load" else self.load

    @property
    def response_unit(self) -> float:
        """Of what is fitted: [m] or [N]."""
        return self.depth_unit if self.control == "load" else self.load_unit


def prepare(
    data: IndentationData, model: type | str, indenter: Any, nu: float, control: str, weights: str | None,
    sigma: Any, fixed: dict | None, bounds: dict | None, nuisances: dict[str, float | str], rise: float | None,
) -> Press:  # fmt: skip
    """Check and scale; ValueError with expected and got."""
    model = models.resolve(model)
    _check(data, indenter, nu, control, rise)
    table = models.limits(model, fixed, bounds)
    t = data.t - data.t[0]
    kept = (data.load > 0) & (data.depth > 0) & (t >= (rise or 0.0))
    if kept.sum() < 5:
        raise ValueError(
            f"data: expected at least 5 points in contact (load and depth > 0), got {kept.sum()}"
        )
    notes = [] if kept.all() else [f"{(~kept).sum()} points before contact or during the rise not fitted"]
    P, d, T = float(data.load.max()), float(data.depth.max()), float(t[-1])
    unit = scale_compliance(float(indenter.radius), nu, P, d)
    response = data.depth if control == "load" else data.load
    weight, label = _weights(response, kept, weights, sigma)
    lower, upper = _box(models.compliance_box(model, table), unit, T, nuisances, (d, d / T, d / P))
    if control == "load" and rise is None and data.load[-1] < LEAST_LOAD * P:
        raise ValueError(
            f"data: load control needs a contact that grows, got a load that falls from {P:g} to"
            f' {data.load[-1]:g} N; leave the unloading out, or take control="depth"'
        )
    return Press(
        data, model, indenter, nu, control, t / T, data.load / P, data.depth / d, kept,
        weight * float(response.max()), label, T, P, d, unit, table, lower, upper, tuple(notes),
    )  # fmt: skip


def _check(data: IndentationData, indenter: Any, nu: float, control: str, rise: float | None) -> None:
    if not isinstance(data, IndentationData):
        raise ValueError(f"data: expected IndentationData, got {type(data).__name__}")
    if not isinstance(indenter, jc.Sphere):
        raise ValueError(f"indenter: expected a Sphere, got {type(indenter).__name__}")
    if not float(indenter.radius) > 0:
        raise ValueError(f"indenter: expected a radius > 0, got {indenter.radius}")
    if not -1.0 < nu <= 0.5:
        raise ValueError(f"nu: expected -1 < nu <= 0.5, got {nu}")
    if control not in ("load", "depth"):
        raise ValueError(f'control: expected "load" or "depth", got {control!r}')
    if rise is not None and not (control == "load" and 0.0 <= rise < data.t[-1] - data.t[0]):
        raise ValueError(f"rise: expected 0 <= rise < the duration, under load control, got {rise!r} s")


def _weights(
    response: np.ndarray, kept: np.ndarray, weights: str | None, sigma: Any
) -> tuple[np.ndarray, str]:
    """Weights (n,) [1/unit of the response], zero where not kept, and their label."""
    chosen = np.zeros(response.shape)
    if sigma is not None:
        weights, sigma = None, np.broadcast_to(np.asarray(sigma, dtype=float), response.shape)[kept]
    chosen[kept], label = choose_weights(response[kept], weights, sigma)
    return chosen, label


def _box(
    box: np.ndarray, unit: float, T: float, nuisances: dict[str, float | str], units: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds (7,) of the coordinates."""
    scaled = box / np.array([unit, unit, unit / T, unit / T])[:, None]
    low, high = np.zeros(7), np.zeros(7)
    low[:4], high[:4] = scaled.T
    high[FLOW] = min(high[FLOW], np.exp(EDGE))
    with np.errstate(divide="ignore"):
        for i in LOGS:
            present = high[i] > 0
            low[i], high[i] = np.log(low[i]), np.log(high[i])
            if present and low[i] < high[i]:
                low[i], high[i] = max(low[i], -EDGE), min(high[i], EDGE)
    for (name, i), size in zip(NUISANCES.items(), units, strict=True):
        low[i], high[i] = _nuisance(name, nuisances[name], size)
    return low, high


def _nuisance(name: str, value: float | str, size: float) -> tuple[float, float]:
    """Bounds of a nuisance: equal where it is known."""
    if value == "fit":
        return (0.0 if name == "machine_compliance" else -1.0), 1.0
    if isinstance(value, str) or not np.isfinite(value):
        raise ValueError(f'{name}: expected a number or "fit", got {value!r}')
    return value / size, value / size
