"""The fit of a ball on a half-space: its objective, where it begins, and what is said of its optimum."""

import functools

import numpy as np

from fitting import halfspace, nonlinear
from fitting.halfspace import Curve
from fitting.history import merge
from fitting.nonlinear import Best, Objective
from fitting.press import Found, Medium, Press, start

FALL = 0.02  # share of the greatest depth by which a depth may fall before the contact counts as shrinking


def search(press: Press, rise: float | None) -> Found:
    """The optimum; rise [s]: of a load to put in place of the measured one, or None."""
    knots, values = (press.t, press.load) if rise is None else _held(press, rise)
    top = int(np.argmax(press.depth))
    basis = merge(press.t, knots, values)
    curve = Curve(press.t, press.load, press.depth, press.weights, basis, press.extra, top)
    shrinks = bool(np.any(press.depth < np.maximum.accumulate(press.depth) - FALL))
    kind = "load" if press.control == "load" else "ting" if shrinks else "depth"
    at = press.space.point
    objective = Objective(
        lambda theta: halfspace.evaluate(at(theta), curve, kind),
        lambda theta, free: halfspace.slopes(at(theta), free, curve, kind),
        *press.space.bounds,
        floor=1e-26 * press.size,
    )
    best = nonlinear.minimise(objective, _start(press, curve, kind))
    notes, moves = _notes(best, press, kind), functools.partial(_moves, press, best)
    return Found(press, best, objective, notes, moves, Medium())


def _held(press: Press, rise: float) -> tuple[np.ndarray, np.ndarray]:
    """Knots and values of a linear rise to the mean load after it."""
    size, end = float(press.load[press.kept].mean()), rise / press.duration
    if rise == 0.0:
        return np.array([0.0, 1.0]), np.array([size, size])
    return np.array([0.0, end, 1.0]), np.array([0.0, size, size])


def _start(press: Press, curve: Curve, kind: str) -> np.ndarray:
    """By variable projection: depth^(3/2) is linear in the compliances under the measured load."""
    root = np.sqrt(np.maximum(press.depth, 1e-3))
    use = press.kept & ((kind != "ting") | (np.arange(press.t.size) <= curve.top))
    # weights of the depth: those of the fit under load control, even ones otherwise
    even = press.weights if press.control == "load" else np.ones(press.t.size)
    power = root**3 - press.extra * press.load
    return start(press, power, use / (1.5 * root) * even, curve.basis, least=1e-6)


def _moves(press: Press, best: Best, name: str) -> np.ndarray:
    """Change of the coordinates with nu: on a half-space every compliance goes with 1/(1 - nu)."""
    if name != "nu":
        raise ValueError(f"spread: a half-space has no {name}")
    space = press.space
    return np.where(space.logarithmic, 1.0, best.theta) * space.material / (1.0 - press.nu)


def _notes(best: Best, press: Press, kind: str) -> tuple[str, ...]:
    """What is said of an optimum: a contact that shrinks."""
    if kind == "ting":
        return (*press.notes, "the depth falls: Ting's solution from its maximum on")
    if kind == "load":
        on = press.weights > 0
        depth = press.depth[on] + best.residual[on] / press.weights[on]
        fall = float(np.max(np.maximum.accumulate(depth) - depth))
        if fall > FALL:
            note = f"the contact shrinks (depth falls by {100 * fall:.1f} %): Lee and Radok only approximate"
            return (*press.notes, note)
    return press.notes
