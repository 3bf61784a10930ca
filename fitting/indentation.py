"""Fit of a material to an indentation curve: a ball on a half-space, or on a film on a substrate."""

import time
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting import halfspace, layered, nonlinear
from fitting.creep import tau_range, threshold
from fitting.data import IndentationData
from fitting.halfspace import LOGS, Curve
from fitting.history import merge
from fitting.indentation_result import Film, IndentationFit, allowed, build
from fitting.nonlinear import Best, Objective
from fitting.press import Press, prepare
from fitting.varpro import Problem, sides
from fitting.varpro import solve as solve_linear

FALL = 0.02  # share of the greatest depth by which a depth may fall before the contact counts as shrinking


def fit_indentation(
    data: IndentationData,
    model: type | str = jc.Burgers,
    *,
    indenter: Any,
    nu: float,
    control: str = "load",
    weights: str | None = "absolute",
    sigma: Any = None,
    fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None,
    contact_point: float | str = 0.0,
    drift: float | str = 0.0,
    machine_compliance: float | str = 0.0,
    rise: float | None = None,
    layer: float | None = None,
    substrate: Any = None,
    grid: Any = None,
    level: float = 0.95,
) -> IndentationFit:
    """Fit ``model`` (a material class or its name) to an indentation curve.

    indenter: a ``jc.Sphere``; nu: of the material, held. control: "load" (the measured load drives the
    model, the depth is fitted) or "depth" (the other way). The measured history itself is in the
    integral (Lee and Radok; Ting where the depth falls after one maximum). Under load control the
    contact must grow. weights: "absolute" (one error for all points), "relative", or sigma (then weights
    is not used). fixed, bounds: as in ``fit_creep``. contact_point [m], drift [m/s] and
    machine_compliance [m/N] in the measured depth: numbers that are known, or "fit". rise [s]: put a
    load that rises linearly for so long and is then held in place of the measured one, for comparison
    with papers (M. L. Oyen, J. Mater. Res. 20 (2005) 2094; 0 is the step); later points are fitted.

    layer [m], substrate (``jc.Elastic``): a film of that thickness on it; the contact solver is then the
    forward model, on ``grid`` (a ``jc.Grid``) or one that is chosen so that what discretisation does to
    the parameters is below a fifth of their standard errors.

    Times count from the first sample, at which load and depth may step on. Raises ValueError on bad input.
    """
    started = time.perf_counter()
    if not 0.0 < level < 1.0:
        raise ValueError(f"level: expected between 0 and 1, got {level!r}")
    nuisances = {"contact_point": contact_point, "drift": drift, "machine_compliance": machine_compliance}
    press = prepare(data, model, indenter, nu, control, weights, sigma, fixed, bounds, nuisances, rise)
    n, p = int(press.kept.sum()), int(np.sum(press.upper > press.lower))
    if n <= p:
        raise ValueError(f"data: expected more points than the {p} free parameters, got {n}")
    if layer is None and substrate is None and grid is None:
        objective, start, notes = half_space(press, rise)
        best = nonlinear.minimise(objective, start)
        moves = lambda name: _moves(name, best, press)
        return _finish(press, objective, best, level, started, notes(best), Film(), moves)
    if rise is not None:
        raise ValueError(f"rise: expected None with a layer, got {rise!r}")
    layered.check(press, layer, substrate)
    press = layered.floored(press)
    found = layered.fit(press, layer, substrate, grid)
    cells = jc.Grid.square(n=found.cells, width=found.width)
    about = Film(layer, substrate, cells, layered.named(found.bias, press))
    return _finish(press, found.objective, found.best, level, started, list(press.notes), about, found.moves)


def _finish(
    press: Press,
    objective: Objective,
    best: Best,
    level: float,
    started: float,
    notes: list,
    film: Film,
    moves: Any,
) -> IndentationFit:
    """Profile, and gather."""
    n, p, known = int(press.kept.sum()), objective.free.size, press.label == "sigma"
    quality = allowed(best, press, p, threshold(level, n, p, known))
    ends = nonlinear.profile(objective, best, quality.level)
    spent = time.perf_counter() - started
    runs = (objective.residual_runs, objective.jacobian_runs)
    return build(press, best, objective.free, ends, quality, level, runs, spent, notes, film, moves)


def half_space(press: Press, rise: float | None) -> tuple[Objective, np.ndarray, Any]:
    """The objective of a half-space, its start, and notes on an optimum."""
    knots, values = (press.t, press.load) if rise is None else _held(press, rise)
    top = int(np.argmax(press.depth))
    curve = Curve(
        press.t, press.load, press.depth, press.weights, merge(press.t, knots, values), press.extra, top
    )
    shrinks = bool(np.any(press.depth < np.maximum.accumulate(press.depth) - FALL))
    kind = "load" if press.control == "load" else "ting" if shrinks else "depth"
    objective = Objective(
        lambda theta: halfspace.evaluate(theta, curve, kind),
        lambda theta, free: halfspace.slopes(theta, free, curve, kind),
        press.lower,
        press.upper,
        floor=1e-26 * float(np.sum((press.weights * press.measured) ** 2)),
    )
    return objective, _start(press, curve, kind), lambda best: _notes(best, press, curve, kind)


def _held(press: Press, rise: float) -> tuple[np.ndarray, np.ndarray]:
    """Knots and values of a linear rise to the mean load after it."""
    size, end = float(press.load[press.kept].mean()), rise / press.duration
    if rise == 0.0:
        return np.array([0.0, 1.0]), np.array([size, size])
    return np.array([0.0, end, 1.0]), np.array([0.0, size, size])


def _start(press: Press, curve: Curve, kind: str) -> np.ndarray:
    """By variable projection: depth^(3/2) is linear in the compliances under the measured load."""
    low, high = press.lower.copy(), press.upper.copy()
    for i in LOGS:
        # the edges of the search are those of the logarithms, not of the material
        low[i], high[i] = (0.0 if low[i] <= -15.9 else np.exp(low[i])), np.exp(high[i])
        high[i] = np.inf if high[i] > 8e6 else high[i]
    high[2] = np.inf if high[2] > 8e6 else high[2]
    root = np.sqrt(np.maximum(press.depth, 1e-3))
    use = press.kept & ((kind != "ting") | (np.arange(press.t.size) <= curve.top))
    box = np.stack([low[:4], high[:4]], -1)
    linear = Problem(
        root**3 - press.extra * press.load, use / (1.5 * root) * _even(press), curve.basis, low[:3], high[:3],
        box[3], tau_range(press.t, box), sides(low[:4], high[:4]),
    )  # fmt: skip
    _, x, tau, _ = solve_linear(linear)
    parts = np.append(np.asarray(x), x[1] / tau)
    theta = 0.5 * (press.lower + press.upper)
    theta[:4] = parts
    for i in LOGS:
        theta[i] = np.log(max(parts[i], 1e-6)) if np.isfinite(press.upper[i]) else -np.inf
    return np.clip(theta, press.lower, press.upper)


def _even(press: Press) -> np.ndarray:
    """Weights of the depth for the start: those of the fit under load control, even ones otherwise."""
    return press.weights if press.control == "load" else np.ones(press.t.size)


def _moves(name: str, best: Best, press: Press) -> np.ndarray:
    """Change of the coordinates with nu: on a half-space every compliance goes with 1/(1 - nu)."""
    if name != "nu":
        raise ValueError(f"spread: a half-space has no {name}")
    change = np.where(np.isin(np.arange(7), LOGS), 1.0, best.theta) * (np.arange(7) < 4)
    return change / (1.0 - press.nu)


def _notes(best: Any, press: Press, curve: Curve, kind: str) -> list[str]:
    """What is said of an optimum: a contact that shrinks under load control."""
    notes = list(press.notes)
    if kind == "ting":
        notes.append("the depth falls: Ting's solution from its maximum on")
    if kind == "load":
        on = press.weights > 0
        depth = press.depth[on] + best.residual[on] / press.weights[on]
        fall = float(np.max(np.maximum.accumulate(depth) - depth))
        if fall > FALL:
            notes.append(
                f"the contact shrinks (depth falls by {100 * fall:.1f} %): Lee and Radok only approximate"
            )
    return notes
