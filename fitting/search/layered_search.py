"""Search of the fit of a film on a substrate, on a mesh that is fine enough for the data.

The start is quasi-elastic: the approach of the ball on an elastic film is solved once over a range of the film's
compliance and inverted point by point; the resulting compliances are then fitted as creep under the measured load. The
width of the grid follows from the contact of that start. The effect of the grid and the time steps on the parameters is
measured by a run with more cells and steps at the optimum and added to the model as a correction. The mesh is refined
until the remaining bias is small compared with the noise, or below a thousandth of the parameters, which is less than
the uncertainty of radius and thickness in any test.

A growing contact is at first only a few cells wide, and its load then depends on the position of the cells. Samples at
such times are part of the load history but are not fitted.
"""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting.models.history import merge
from fitting.search import layered
from fitting.search.layered import Coating, FilmTest, Mesh
from fitting.search.nonlinear import Best, Objective, minimise, moved
from fitting.search.press import Found, IndentationProblem, Medium, start
from fitting.search.uncertainty import inverse
from jaxcontact._support.prefixes import told_apart
from jaxcontact._support.status import PRECEDENCE

CELLS, MOST_CELLS, START_CELLS = 32, 128, 32
FINER, STEPS_FINER = 4, 3  # factors on cells and steps of the run that corrects an automatic grid
LEFT = 8.0  # second order: of the change, an eighth remains for the steps, a fifteenth for the cells
FINER_GIVEN, LEFT_GIVEN = 2, 3.0  # the same for a given grid
MARGIN = 1.2  # width of the grid over that of the contact
WIDER = 1.3
WEIGHTS = 1e-3  # relative change of the weights above which a film is fitted again
ACROSS = 4.0  # least number of cells across the contact of a fitted sample; the solver needs 3
LEAST_POINTS = 5  # least number of fitted points
LEAST_GIVEN = 16  # least number of cells along a side of a given grid
SMALL = 0.2  # acceptable bias over standard error
PER_MILLE = 1e-3  # acceptable bias of the logarithm of a parameter
Scene = Callable[[Mesh], FilmTest]
# function that returns the weights (n,) that follow from an optimum
Reweighed = Callable[[IndentationProblem, Best, Objective], np.ndarray]
STRAIN = 0.2  # of the top layer, beyond which linear theory is doubtful
RANGE = np.linspace(-3.0, 12.0, 31)  # log of the film's scaled compliance


def search(press: IndentationProblem, coating: Coating, grid: Any, reweighed: Reweighed) -> Found:
    """Minimise on meshes of doubled fineness until the remaining bias is small compared with the noise."""
    if isinstance(press.pressing.indenter, jc.FlatPunch):
        raise ValueError(
            "indenter: expected a Sphere or a Cone on a film, got FlatPunch, whose edge is as wide as a cell"
        )
    if press.space.structure.model is jc.KelvinVoigt:
        raise ValueError("model: a Kelvin-Voigt film has J(0) = 0: expected StandardLinearSolid or another")
    _check_grid(grid)
    theta, radius = _start(press, coating)
    chosen, runs = not isinstance(grid, jc.Grid), np.zeros(2, int)
    cells = CELLS if grid is None else grid if chosen else grid.shape[0]
    mesh = Mesh(cells, 2.0 * MARGIN * radius if chosen else float(grid.width[0]))
    finer, order = (FINER, LEFT) if grid is None else (FINER_GIVEN, LEFT_GIVEN)
    fitted = press.kept
    while True:
        press, coarse, objective, mesh = _resolved(press, coating, theta, mesh, chosen)
        weights = reweighed(press, coarse, objective)
        if not np.allclose(weights, press.weights, rtol=WEIGHTS, atol=0.0):
            press = press._replace(weights=weights)
            runs += objective.residual_runs, objective.jacobian_runs
            coarse, objective = _minimise(press, layered.scene(press, coating, mesh), coarse.theta)
        scene = functools.partial(layered.scene, press, coating)
        runs += objective.residual_runs + 3, objective.jacobian_runs
        film = _corrected(press, scene, coarse, mesh, finer)
        best, objective = _minimise(press, film, coarse.theta)
        left = np.abs(best.theta - coarse.theta) / order
        bias = left / _standard_errors(best, press)
        small = np.all((bias < SMALL) | (left < PER_MILLE))
        if small or grid is not None or 2 * mesh.cells > MOST_CELLS:
            break
        theta, mesh = best.theta, mesh._replace(cells=2 * mesh.cells)
    objective.residual_runs += int(runs[0])
    objective.jacobian_runs += int(runs[1])
    named = {press.space.names[i]: float(bias[i]) for i in press.space.free}
    medium = Medium(
        coating.thickness, coating.substrate, jc.Grid.square(n=mesh.cells, width=mesh.width), left, named
    )
    press = press._replace(notes=(*press.notes, *_notes(press, film, best, fitted)))
    return Found(press, best, objective, press.notes, functools.partial(_moves, press, best, film), medium)


def _notes(press: IndentationProblem, film: FilmTest, best: Best, fitted: np.ndarray) -> list[str]:
    """Return the notes on points (n,) bool that could not be fitted, and on the strain of the film."""
    notes, few = [], int(np.sum(fitted & ~press.kept))
    if few:
        notes.append(f"{few} points not fitted, at which the contact is fewer than {ACROSS:g} cells across")
    strain = float(np.max(layered.evaluate(press.space.point(best.theta), film)[3]))
    if strain > STRAIN:
        notes.append(
            f"the strain of the top layer reaches {told_apart(strain, STRAIN)}: beyond {STRAIN:g} linear theory is doubtful"
        )
    return notes


def _start(press: IndentationProblem, coating: Coating) -> tuple[np.ndarray, float]:
    """Return starting coordinates, and the largest contact radius [m] there."""
    depth, radius = _elastic(press, coating)
    on = press.kept & (press.load > 0.3)
    scaled = np.where(on, press.depth * np.maximum(press.load, 1e-3) ** (-1.0 / press.probe.power), depth[0])
    J = np.exp(np.interp(scaled, depth, RANGE))
    slope = np.interp(scaled, depth, np.gradient(depth, RANGE)) / J
    weights = np.where(on, slope / np.maximum(press.load, 0.3), 0.0)
    basis = merge(press.t, press.t, press.load)
    widest = radius[min(int(np.searchsorted(depth, scaled[on].max())) + 1, depth.size - 1)]
    return start(press, J * press.load, weights, basis, least=1e-2), float(widest)


def _elastic(press: IndentationProblem, coating: Coating) -> tuple[np.ndarray, np.ndarray]:
    """Return scaled depth and contact radius [m] under the largest load on elastic films of compliances ``RANGE``."""
    width = 2.4 * press.probe.widest(press.units.depth)
    grid = jc.Grid.square(n=START_CELLS, width=width)
    film = press.sought.volume.keyword, press.pressing.indenter, coating, press.units.load, grid
    rows = [layered.elastic(np.exp(x) * press.units.compliance, *film) for x in RANGE]
    depth, radius = np.array(rows).T
    return np.maximum.accumulate(depth / press.units.depth), radius


def _minimise(press: IndentationProblem, film: FilmTest, theta: np.ndarray) -> tuple[Best, Objective]:
    """Minimise from theta with a loose tolerance on RSS, because each evaluation is expensive."""
    at = press.space.point
    objective = Objective(
        lambda theta: layered.evaluate(at(theta), film)[0],
        lambda theta, free: layered.slopes(at(theta), free, film),
        *press.space.bounds, ftol=1e-5, close=1e-2,
    )  # fmt: skip
    return minimise(objective, theta), objective


def _resolved(
    press: IndentationProblem, coating: Coating, theta: np.ndarray, mesh: Mesh, chosen: bool
) -> tuple[IndentationProblem, Best, Objective, Mesh]:
    """Return the optimum on a mesh.

    An automatic mesh is widened while the contact reaches its edge; samples at which the contact is only a few cells
    across get zero weight.
    """
    press = _coarse_left_out(press, layered.scene(press, coating, mesh), theta, mesh)
    while True:
        film = layered.scene(press, coating, mesh)
        best, objective = _minimise(press, film, theta)
        statuses = np.asarray(layered.evaluate(press.space.point(best.theta), film)[1])
        failed = [code for code in PRECEDENCE[:-1] if code in statuses and code != jc.Status.TOO_COARSE]
        status = failed[0] if failed else jc.Status.FINE
        if status == jc.Status.AT_EDGE and chosen:
            mesh = mesh._replace(width=WIDER * mesh.width)
            press = _coarse_left_out(press, layered.scene(press, coating, mesh), best.theta, mesh)
        elif status:
            n, what = mesh.cells, jc.Status(status).message
            raise ValueError(f"grid: the contact of the best fit on {n} x {n} cells: {what}")
        elif not np.any(_touching(film, statuses == jc.Status.TOO_COARSE) & press.kept):
            return press, best, objective, mesh
        else:
            press = _coarse_left_out(press, film, best.theta, mesh)
        theta = best.theta


def _coarse_left_out(
    press: IndentationProblem, film: FilmTest, theta: np.ndarray, mesh: Mesh
) -> IndentationProblem:
    """Return the test without the samples at which the contact at theta is fewer than ``ACROSS`` cells across."""
    _, statuses, radius, _ = layered.evaluate(press.space.point(theta), film)
    few = 2.0 * np.asarray(radius) < ACROSS * mesh.width / mesh.cells
    kept = press.kept & ~_touching(film, few | (np.asarray(statuses) == jc.Status.TOO_COARSE))
    if kept.sum() < max(LEAST_POINTS, press.space.free.size + 1):
        raise ValueError(
            f"grid: expected at least {LEAST_POINTS} points at which the contact is {ACROSS:g} cells across, got"
            f" {kept.sum()} on {mesh.cells} x {mesh.cells} cells over {mesh.width:.3g} m: a finer grid"
        )
    return press._replace(kept=kept, weights=np.where(kept, press.weights, 0.0))


def _touching(film: FilmTest, marked: np.ndarray) -> np.ndarray:
    """Return which samples (n,) are interpolated from a march time that is marked, (m,) bool."""
    return np.interp(np.asarray(film.t), np.asarray(film.times), marked.astype(float)) > 0.0


def _check_grid(grid: Any) -> None:
    """Raise ValueError unless the grid is None, a number of cells, or a square ``jc.Grid`` without period."""
    if isinstance(grid, jc.Grid):
        (n, m), (width, depth) = grid.shape, (float(side) for side in grid.width)
        if n != m or abs(width - depth) > 1e-9 * width or any(grid.periodic):
            raise ValueError(f"grid: expected a square jc.Grid that is not periodic, got {grid!r}")
    elif grid is not None and (
        isinstance(grid, bool) or not isinstance(grid, int | np.integer) or grid < LEAST_GIVEN
    ):
        raise ValueError(
            f"grid: expected a jc.Grid, or a whole number of cells of at least {LEAST_GIVEN}, got {grid!r}"
        )


def _corrected(press: IndentationProblem, scene: Scene, best: Best, mesh: Mesh, finer: int) -> FilmTest:
    """Return the test corrected by the change of the response at the optimum on a finer mesh.

    The finer mesh has ``finer`` times the cells and three times the steps.
    """
    point, coarse = press.space.point(best.theta), scene(mesh)
    fine = scene(mesh._replace(cells=finer * mesh.cells, fine=STEPS_FINER))
    bare = {"weights": np.ones(press.t.size), "response": np.zeros(press.t.size)}
    response = lambda film: layered.evaluate(point, film._replace(**bare))[0]
    return coarse._replace(correction=response(fine) - response(coarse))


def _moves(press: IndentationProblem, best: Best, film: FilmTest, name: str) -> np.ndarray:
    """Return d theta/d nuisance at the optimum, (m,)."""
    slope = layered.nuisance_slope(press.space.point(best.theta), film, name=name)
    return moved(best, press.space.free, np.asarray(slope))


def _standard_errors(best: Best, press: IndentationProblem) -> np.ndarray:
    """Return the standard errors of the coordinates (m,), infinite where held."""
    spread = np.full(best.theta.size, np.inf)
    variance = 1.0 if press.label == "sigma" else best.rss / (press.kept.sum() - best.jacobian.shape[1])
    spread[press.space.free] = np.sqrt(np.diag(inverse(best.jacobian)) * variance)
    return np.maximum(spread, 1e-300)
