"""Preparation of curves at several temperatures for their superposition."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.data.curves import CreepData
from fitting.data.moduli import OscillationData, RelaxationData
from fitting.models.master_curve import Sweeps

KINDS = (OscillationData, RelaxationData, CreepData)
SAME = 0.5  # difference [K] below which temperatures are one
LEAST = 3  # fewest temperatures


def checked(data: Any) -> tuple[Any, ...]:
    """Return the curves; ValueError unless they are of one kind and have their temperatures."""
    several = tuple(data) if isinstance(data, Sequence) else ()
    kinds = sorted({type(one).__name__ for one in several}) or [type(data).__name__]
    if len(kinds) > 1 or not all(isinstance(one, KINDS) for one in several) or not several:
        names = ", ".join(kind.__name__ for kind in KINDS)
        raise ValueError(f"data: expected a list of curves of one kind of {names}, got {', '.join(kinds)}")
    without = sum(one.temperature is None for one in several)
    if without:
        raise ValueError(
            f"data: expected the temperature of every curve, got none for {without} of {len(several)}"
        )
    if isinstance(several[0], CreepData) and any(one.J is None for one in several):
        raise ValueError("data: expected creep curves with a compliance J, got strain under a stress history")
    return several


def sweeps_of(curves: tuple[Any, ...], reference: float | None) -> Sweeps:
    """Return the logarithms of all curves; ValueError for fewer than three temperatures."""
    T = np.array([one.temperature for one in curves])
    order = np.argsort(T, kind="stable")
    new = np.diff(T[order], prepend=-np.inf) > SAME
    group = np.empty(T.size, dtype=int)
    group[order] = np.cumsum(new) - 1
    mean = np.bincount(group, T) / np.bincount(group)
    if mean.size < LEAST:
        raise ValueError(f"data: expected curves at {LEAST} or more temperatures, got {mean.size}")
    place = mean.size // 2 if reference is None else int(np.argmin(np.abs(mean - reference)))
    if reference is not None and not abs(mean[place] - reference) <= SAME + 0.5 * _gap(mean):
        raise ValueError(
            f"reference: expected a temperature from {mean[0]:.5g} to {mean[-1]:.5g} K, got {reference!r}"
        )
    rows = [(x, y, part, k) for k, one in enumerate(curves) for x, y, part in _parts(one)]
    of = lambda place: np.concatenate([np.broadcast_to(row[place], row[0].shape) for row in rows])
    block = of(3).astype(int)
    return Sweeps(mean, place, of(0), of(1), group[block], of(2).astype(int), block)


def _gap(temperatures: np.ndarray) -> float:
    """Return the largest gap between neighbouring temperatures [K]."""
    return float(np.max(np.diff(temperatures)))


def _parts(one: Any) -> list[tuple[np.ndarray, np.ndarray, int]]:
    """Return (x, y, part) of the parts of a curve: ln |G*| and phase, ln G(t), or -ln J(t)."""
    if isinstance(one, OscillationData):
        x, G = np.log(one.omega), one.shear
        return [(x, np.log(np.abs(G)), 0), (x, np.angle(G), 1)]
    values = one.shear if isinstance(one, RelaxationData) else one.compliance
    known = (one.t > 0) & (values > 0)
    if np.sum(known) < 5:
        raise ValueError(
            f"data: expected at least 5 points with values > 0 at times > 0 in every curve, got {np.sum(known)}"
            f" at {one.temperature:.5g} K"
        )
    sign = 1.0 if isinstance(one, RelaxationData) else -1.0
    return [(-np.log(one.t[known]), sign * np.log(values[known]), 0)]
