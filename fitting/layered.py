"""A ball on a viscoelastic film on an elastic substrate: the contact solver itself is the forward model.

The start is quasi-elastic: the approach of the ball on an elastic film, over a range of the film's
compliance, is solved once and inverted point by point; the compliances found are then fitted as creep
under the measured load. The grid is as wide as the contact of that start needs. What the grid and the
time steps do to the parameters is measured, by a run with more cells and steps at the optimum,
added to the model as a correction, and refined until what remains is small beside the noise.
"""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.creep import tau_range
from fitting.halfspace import FLOW, Curve, offset, parts
from fitting.history import merge
from fitting.models import PARTS
from fitting.nonlinear import Best, Objective, inverse, minimise
from fitting.press import NUISANCES, Press
from fitting.varpro import Problem, sides, solve

CELLS, MOST_CELLS, START_CELLS = 32, 128, 32
FINER, STEPS_FINER = 4, 3  # cells and steps of the run that corrects a chosen grid
LEFT = 8.0  # of a change found by it second order leaves an eighth for the steps, a fifteenth for the cells
TIMES = 96  # march times where there are more samples
MARGIN = 1.2  # grid over contact
LEAST_FLOW = 1e-8  # scaled, open end
SMALL = 0.2  # bias over standard error that is small
EDGE = 2
RANGE = np.linspace(-3.0, 12.0, 31)  # log of the film's scaled compliance


class Film(NamedTuple):
    """What the solver needs beside the coordinates, SI: units undo the scaling.

    times (m,) of the march; load, depth (m,): the controls there, scaled.
    """

    indenter: Any
    thickness: Array
    substrate: Any
    nu: Array
    spacing: Array
    times: Array
    load: Array
    depth: Array
    duration: Array
    load_unit: Array
    depth_unit: Array
    unit: Array
    correction: Array


def check(press: Press, layer: float, substrate: Any) -> None:
    """ValueError unless there is a film that can be solved."""
    if not (isinstance(layer, int | float | np.number) and np.isfinite(layer) and layer > 0):
        raise ValueError(f"layer: expected a thickness > 0 m, got {layer!r}")
    if not isinstance(substrate, jc.Elastic):
        raise ValueError(f"substrate: expected Elastic under a layer, got {type(substrate).__name__}")
    if press.model is jc.KelvinVoigt:
        raise ValueError("model: a Kelvin-Voigt film has J(0) = 0: expected StandardLinearSolid or another")


def floored(press: Press) -> Press:
    """The same, with the flow a little off zero, where the decay rates of the film have no slope."""
    lower = press.lower.copy()
    if lower[FLOW] == 0.0 < press.upper[FLOW]:
        lower[FLOW] = LEAST_FLOW
    return press._replace(lower=lower)


def film(press: Press, layer: float, substrate: Any, width: float, n: int, fine: int) -> Film:
    """The solver's inputs for n x n cells over ``width`` [m]; fine: march steps between samples."""
    t = march_times(press.t, fine)
    at = lambda y: jnp.interp(t, press.t, y)
    number = lambda x: jnp.asarray(x, dtype=float)
    return Film(
        press.indenter, number(layer), substrate, number(press.nu), number(width / n), jnp.asarray(t),
        at(press.load), at(press.depth), number(press.duration), number(press.load_unit),
        number(press.depth_unit), number(press.unit), jnp.zeros(press.t.size),
    )  # fmt: skip


def march_times(t: np.ndarray, fine: int) -> np.ndarray:
    """The samples themselves, or some, half of them evenly and half logarithmically spaced."""
    if t.size > TIMES:
        first = max(t[t > 0][0], 1e-4)
        t = np.unique(np.append(np.linspace(0.0, 1.0, TIMES // 2), np.geomspace(first, 1.0, TIMES // 2)))
    shares = np.arange(fine) / fine
    return np.append((t[:-1, None] + np.diff(t)[:, None] * shares).ravel(), t[-1])


def response(theta: Array, curve: Curve, film: Film, n: int, control: str) -> tuple[Array, Array, Array]:
    """Scaled depth (or load) at the samples (n,), status and contact radius [m] of the march."""
    j0, j2, f, k = parts(theta)
    slow = film.unit / film.duration
    material = jc.Prony(
        J0=j0 * film.unit, J=jnp.stack([j2 * film.unit]), tau=jnp.stack([film.duration / k]),
        nu=film.nu, fluidity=f * slow,
    )  # fmt: skip
    body = jc.LayeredHalfSpace([jc.Layer(material, film.thickness)], film.substrate)
    grid = jc.Grid(shape=(n, n), spacing=(film.spacing, film.spacing))
    if control == "load":
        drive: Any = jc.Load(film.load * film.load_unit)
    else:
        shift = jnp.interp(film.times, curve.t, offset(theta, curve))
        drive = jc.Approach((film.depth - shift) * film.depth_unit)
    run = jc.indent(body, film.indenter, drive, film.times * film.duration, grid=grid, save="last")
    found = run.approach / film.depth_unit if control == "load" else run.load / film.load_unit
    found = jnp.interp(curve.t, film.times, found)
    return (found + offset(theta, curve) if control == "load" else found), run.status, run.contact_radius


@functools.partial(jax.jit, static_argnames=("n", "control"))
def evaluate(theta: Array, curve: Curve, film: Film, n: int, control: str) -> tuple[Array, Array, Array]:
    """Weighted residuals (n,), the worst status, and the largest contact radius [m]."""
    found, status, radius = response(jnp.asarray(theta), curve, film, n, control)
    measured = curve.depth if control == "load" else curve.load
    return curve.weights * (found + film.correction - measured), jnp.max(status), jnp.max(radius)


@functools.partial(jax.jit, static_argnames=("n", "control"))
def slopes(theta: Array, free: Array, curve: Curve, film: Film, n: int, control: str) -> Array:
    """The Jacobian (n, k) with respect to the coordinates ``free``."""
    some = lambda x: curve.weights * response(theta.at[free].set(x), curve, film, n, control)[0]
    return jax.jacfwd(some)(theta[free])


def objective(press: Press, curve: Curve, film: Film, n: int) -> Objective:
    """Of the march on n x n cells; small steps of RSS do not count, they cost runs."""
    return Objective(
        lambda theta: evaluate(theta, curve, film, n, press.control)[0],
        lambda theta, free: slopes(jnp.asarray(theta), free, curve, film, n, press.control),
        press.lower, press.upper, ftol=1e-5, close=1e-2,
    )  # fmt: skip


def curve_of(press: Press) -> Curve:
    """The samples; the ball's own compliance is in the solver."""
    t, load, depth, weights = (jnp.asarray(a) for a in (press.t, press.load, press.depth, press.weights))
    return Curve(t, load, depth, weights, None, jnp.zeros(()), jnp.zeros((), int))


def start(press: Press, layer: float, substrate: Any) -> tuple[np.ndarray, float]:
    """Coordinates to start from, and the largest contact radius [m] there."""
    depth, radius = _elastic(press, layer, substrate)
    on = press.kept & (press.load > 0.3)
    scaled = np.where(on, press.depth * np.maximum(press.load, 1e-3) ** (-2.0 / 3.0), depth[0])
    J = np.exp(np.interp(scaled, depth, RANGE))
    slope = np.interp(scaled, depth, np.gradient(depth, RANGE)) / J
    low, high = press.lower[:4].copy(), press.upper[:4].copy()
    for i in (0, 1, 3):
        low[i], high[i] = (0.0 if low[i] <= -15.9 else np.exp(low[i])), np.exp(high[i])
    box = np.stack([low, high], -1)
    weights = np.where(on, slope / np.maximum(press.load, 0.3), 0.0)
    basis = merge(press.t, press.t, press.load)
    _, x, tau, _ = solve(
        Problem(
            J * press.load,
            weights,
            basis,
            low[:3],
            high[:3],
            box[3],
            tau_range(press.t, box),
            sides(low, high),
        )
    )
    theta = 0.5 * (press.lower + press.upper)
    theta[:4] = np.append(np.asarray(x), x[1] / tau)
    for i in (0, 1, 3):
        theta[i] = np.log(max(theta[i], 1e-2)) if np.isfinite(press.upper[i]) else -np.inf
    widest = radius[min(int(np.searchsorted(depth, scaled[on].max())) + 1, depth.size - 1)]
    return np.clip(theta, press.lower, press.upper), float(widest)


def _elastic(press: Press, layer: float, substrate: Any) -> tuple[np.ndarray, np.ndarray]:
    """Scaled depth and contact radius [m] under the largest load over elastic films of ``RANGE``."""
    width = 2.4 * np.sqrt(1.5 * float(press.indenter.radius) * press.depth_unit)
    rows = [
        _one(jnp.exp(x) * press.unit, press.indenter, substrate, layer, press.nu, press.load_unit, width)
        for x in RANGE
    ]
    depth, radius = np.array(rows).T
    return np.maximum.accumulate(depth / press.depth_unit), radius


@jax.jit
def _one(J: Any, indenter: Any, substrate: Any, layer: Any, nu: Any, load: Any, width: Any) -> Array:
    """Approach and contact radius [m] on an elastic film of compliance J."""
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1.0 / J, nu), layer)], substrate)
    grid = jc.Grid.square(n=START_CELLS, width=width)
    run = jc.indent(body, indenter, jc.Load(load), jnp.zeros(1), grid=grid, save="last")
    return jnp.stack([run.approach[0], run.contact_radius[0]])


class Fitted(NamedTuple):
    """The optimum, its objective, the cells and width of its grid, and the bias left over standard error (7,);
    moves(name) (7,): change of the coordinates with nu or thickness."""

    best: Best
    objective: Objective
    cells: int
    width: float
    bias: np.ndarray
    moves: Any


def fit(press: Press, layer: float, substrate: Any, grid: Any) -> Fitted:
    """Minimise on grids of doubled fineness until the bias left is small beside the noise."""
    theta, radius = start(press, layer, substrate)
    n = CELLS if grid is None else int(grid.shape[0])
    width = 2.0 * MARGIN * radius if grid is None else float(grid.width[0])
    curve, runs = curve_of(press), np.zeros(2, int)
    finer = FINER if grid is None else 2
    while True:
        here = film(press, layer, substrate, width, n, 1)
        first = objective(press, curve, here, n)
        best = minimise(first, theta)
        _, status, radius = evaluate(best.theta, curve, here, n, press.control)
        if int(status) == EDGE and grid is None:
            theta, width = best.theta, 1.3 * width
            continue
        _require(int(status), n)
        corrected = here._replace(
            correction=_correction(press, curve, here, best, layer, substrate, width, n, finer)
        )
        second = objective(press, curve, corrected, n)
        theta = best.theta
        best = minimise(second, theta)
        runs += [first.residual_runs + 3, first.jacobian_runs]
        bias = (
            np.abs(best.theta - theta)
            / (LEFT if grid is None else 3.0)
            / _standard_errors(best, second.free, press)
        )
        if bias.max() < SMALL or grid is not None or 2 * n > MOST_CELLS:
            second.residual_runs += int(runs[0])
            second.jacobian_runs += int(runs[1])
            moves = functools.partial(_moves, best, second.free, curve, corrected, n, press.control)
            return Fitted(best, second, n, width, bias, moves)
        theta, n = best.theta, 2 * n


def _correction(
    press: Press,
    curve: Curve,
    here: Film,
    best: Best,
    layer: float,
    substrate: Any,
    width: float,
    n: int,
    finer: int,
) -> Array:
    """Response of ``finer`` times the cells and three times the steps, less that of the grid, at the optimum."""
    fine = film(press, layer, substrate, width, finer * n, STEPS_FINER)
    weights = jnp.where(curve.weights > 0, curve.weights, 1.0)
    difference = evaluate(best.theta, curve._replace(weights=weights), fine, finer * n, press.control)[0]
    return (
        difference - evaluate(best.theta, curve._replace(weights=weights), here, n, press.control)[0]
    ) / weights


def _moves(
    best: Best, free: np.ndarray, curve: Curve, film: Film, n: int, control: str, name: str
) -> np.ndarray:
    """d theta/d nuisance = -(J^T J)^-1 J^T dr/d nuisance at the optimum, (7,)."""
    change = np.zeros(7)
    slope = np.asarray(_nuisance_slope(best.theta, curve, film, n, control, name))
    change[free] = -inverse(best.jacobian) @ (best.jacobian.T @ slope)
    return change


@functools.partial(jax.jit, static_argnames=("n", "control", "name"))
def _nuisance_slope(theta: Array, curve: Curve, film: Film, n: int, control: str, name: str) -> Array:
    """Of the weighted response, (n,), with nu or thickness."""
    some = lambda x: (
        curve.weights * response(jnp.asarray(theta), curve, film._replace(**{name: x}), n, control)[0]
    )
    return jax.jacfwd(some)(getattr(film, name))


def _standard_errors(best: Best, free: np.ndarray, press: Press) -> np.ndarray:
    """Of the coordinates (7,), infinite where held."""
    spread = np.full(7, np.inf)
    p = best.jacobian.shape[1]
    variance = 1.0 if press.label == "sigma" else best.rss / (press.kept.sum() - p)
    spread[free] = np.sqrt(np.diag(inverse(best.jacobian)) * variance)
    return np.maximum(spread, 1e-300)


def named(bias: np.ndarray, press: Press) -> dict[str, float]:
    """The bias of each fitted parameter and nuisance."""
    names = {part: name for name, part in PARTS[press.model].items()} | {i: n for n, i in NUISANCES.items()}
    return {names[int(i)]: float(bias[i]) for i in np.flatnonzero(press.upper > press.lower)}


def _require(status: int, n: int) -> None:
    if status:
        raise ValueError(f"grid: the contact on {n} x {n} cells has status {status}: a wider or finer grid")
