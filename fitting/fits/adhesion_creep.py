"""Fit of a viscoelastic film and the work of adhesion to an adhesive force curve: approach, dwell and retraction."""

from __future__ import annotations

import math
import time
from typing import Any, NamedTuple

import numpy as np

import jaxcontact as jc
from fitting.data.indentation import IndentationData
from fitting.data.pull_off import check_signs, read_pull_off, zeroed
from fitting.fits.adhesion import AdhesiveChoices, AdhesiveFit, body_of, interval_of_tension
from fitting.inference import student
from fitting.inference.conclusion import Conclusion, FitProblem, conclude, least_squares
from fitting.inference.evidence import Sample, Solved
from fitting.models.adhesive_curve import JKR
from fitting.models.structure import Sought, Volume, limits, resolve
from fitting.search.adhesive_search import AdhesiveTest, Body
from fitting.search.creeping_film_search import (
    CELLS,
    FINER,
    LEFT,
    MARGIN,
    SHARES,
    AdhesiveFilm,
    CreepingFilm,
    Run,
    loads,
    starting_values,
    structure_with_work,
    with_work,
)
from fitting.search.layered import Coating
from fitting.search.nonlinear import moved
from fitting.search.press import indentation_weights
from jaxcontact._support.prefixes import told_apart

WIDER, WIDENINGS = 1.3, 4  # of the grid, where the contact reaches its edge
FEW_COHESIVE = 3  # cells across the zone of attraction, as in the notes of ``indent``
BAD = jc.Status.NOT_CONVERGED, jc.Status.INHERITED


def check_creeping(adhesion: Any, model: Any, control: Any, film: tuple[Any, Any], bounds: Any) -> type:
    """Return the class of the material; ValueError for what a fit with a law of adhesion does not take.

    film: thickness and base, as given.
    """
    if film == (None, None):
        raise ValueError(
            f'adhesion: expected "fit", "JKR" or a work of adhesion [J/m2] on a half-space, got {adhesion!r}'
        )
    material = resolve(model).model
    if material not in SHARES:
        elastic = ': adhesion="JKR" fits an elastic film' if material is jc.Elastic else ""
        raise ValueError(
            f"model: expected one of {sorted(known.__name__ for known in SHARES)} with a law of adhesion, got"
            f" {material.__name__}{elastic}"
        )
    if control != "depth":
        raise ValueError(f'control: expected "depth" with a law of adhesion, got {control!r}')
    _check_softer(material, bounds, film[1])
    return material


def _check_softer(material: type, bounds: dict[str, tuple] | None, base: Any) -> None:
    """Raise ValueError for a film that may be stiffer than its base: a softer one can have the same curve."""
    name = "G" if material is jc.Maxwell else "G1"
    most = ((bounds or {}).get(name) or (None, None))[1]
    if isinstance(base, jc.Elastic) and (most is None or not most <= float(base.G)):
        raise ValueError(
            f"bounds: expected an upper bound of {name} up to the modulus of the base, {float(base.G):.4g} Pa, got {most!r}:"
            " a film softer and one stiffer than the base can have the same curve"
        )


class _Fitted(NamedTuple):
    """The test with its problem, the solution, the run that it belongs to, and the numbers of starts of the first search."""

    test: CreepingFilm
    problem: FitProblem
    solved: Solved
    run: Run
    starts: tuple[int, int]


def fit_creeping_film(
    data: IndentationData,
    law: Any,
    described: tuple[Any, Any],
    given: tuple[Any, Any, Any, Any],
    choices: AdhesiveChoices,
) -> AdhesiveFit:
    """Fit the material and the work of adhesion, with the range or strength of the law held.

    described: model and control; given: indenter, Poisson's ratio, thickness [m] of the film and substrate.
    """
    started = time.perf_counter()
    material = check_creeping(law, *described, given[2:], choices.bounds)
    if not isinstance(data, IndentationData):
        raise ValueError(f"data: expected IndentationData, got {type(data).__name__}")
    body = body_of(*given)
    data, zero_sd = zeroed(data)
    check_signs(data, float(body.ball.radius))
    seen = read_pull_off(data)
    weights, label = indentation_weights(data, seen.contact, "depth", choices.weights, choices.sigma)
    half_space = AdhesiveTest(data, seen, Body(body.nu, body.ball), JKR, weights, 0.0)
    G, work, duration = half_space.start()["G"], float(law.work), float(np.ptp(data.t))
    film = AdhesiveFilm(body.nu, Coating.of(given[2], None, given[3]), body.ball, law)
    radius = _radius(body, G, work, float(np.ptp(data.depth[seen.contact])))
    test = CreepingFilm(
        data, seen, film, material, starting_values(material, G, work, duration), radius, weights
    )
    found = _found(test, label, student.two_sided(choices.level) * zero_sd, choices)
    return _concluded(found, conclude(found.problem, found.solved), body, choices, started)


def _radius(body: Body, G: float, work: float, depth: float) -> float:
    """Return the contact radius [m] that is expected at the deepest point."""
    R = float(body.ball.radius)
    neck = np.cbrt(math.pi * work * R**2 / float(body.modulus(G)))
    return float(math.sqrt(R * depth) + neck)


def _found(test: CreepingFilm, label: str, zero: float, choices: AdhesiveChoices) -> _Fitted:
    """Return the solution on a grid that is wide enough, corrected by a finer one."""
    structure = structure_with_work(test.material)
    table = limits(structure, choices.fixed, choices.bounds)
    space = test.space(table, choices.instrument)
    blocks = np.cumsum(np.append(False, test.data.segments[1:] != test.data.segments[:-1]))
    curve = ("load", "N", test.data.t, test.data.load)
    sample = Sample.of(curve, test.weights, label, blocks)
    sought = Sought(structure, table, Volume.of(test.film.nu, None))
    problem = FitProblem(test.data, sought, space, sample, float(np.ptp(test.data.t)), choices.level)
    run = test.run(space, 2.0 * MARGIN * test.radius)
    starts = test.starts(space)
    for _ in range(WIDENINGS):
        coarse = _solved(test, problem, run, starts)
        statuses, _ = _contact(test, coarse, run)
        if not np.any(statuses == jc.Status.AT_EDGE):
            break
        run, starts = test.run(space, WIDER * float(run.grid.width[0])), [coarse.theta]
    run = run._replace(correction=test.correction(coarse.theta, space, run))
    solved = _solved(test, problem, run, [coarse.theta])
    _count(coarse, solved)
    left = np.abs(solved.theta - coarse.theta) / LEFT
    best, objective = solved.whole
    off = np.abs(moved(best, objective.free, solved.weights * zero))
    solved = solved._replace(
        left=left + off, kept=test.seen.contact, against=_against(*_contact(test, solved, run))
    )
    first = coarse.whole[0]
    return _Fitted(test, problem, solved, run, (first.starts, first.agreed))


def _solved(test: CreepingFilm, problem: FitProblem, run: Run, starts: list[np.ndarray]) -> Solved:
    return least_squares(problem, lambda weights: test.objective(problem.space, weights, run), starts)


def _count(first: Solved, last: Solved) -> None:
    """Add the evaluations of the first search to those of the last."""
    last.whole[1].residual_runs += first.whole[1].residual_runs
    last.whole[1].jacobian_runs += first.whole[1].jacobian_runs


def _contact(test: CreepingFilm, solved: Solved, run: Run) -> tuple[np.ndarray, float]:
    """Return statuses up to the last point in contact, and the fewest cells across the zone of attraction (finer grid)."""
    last = float(run.t[np.flatnonzero(test.seen.contact)[-1]])
    _, status, cells = loads(solved.theta, run, test.material)
    reached = np.asarray(run.times) <= last
    return np.asarray(status)[reached], FINER * float(np.min(np.asarray(cells)[reached]))


def _against(statuses: np.ndarray, cells: float) -> tuple[str, ...]:
    """Return the reasons for rejecting a fit whose model is not solved at all times in contact, or not resolved."""
    bad = int(np.sum(np.isin(statuses, BAD)))
    edge = int(np.sum(statuses == jc.Status.AT_EDGE))
    reasons = []
    if bad:
        reasons.append(f"the contact of the best fit did not converge at {bad} of {statuses.size} times")
    if edge:
        reasons.append(f"the contact of the best fit reaches the edge of the grid at {edge} times")
    if cells < FEW_COHESIVE:
        reasons.append(
            f"{told_apart(cells, FEW_COHESIVE)}"
            f" cells across the zone of attraction at the edge of contact, and below {FEW_COHESIVE} the fit"
            " depends on the grid: give a law of longer range, which hardly changes the pull-off at Tabor numbers above 3"
        )
    return tuple(reasons)


def _concluded(
    found: _Fitted, concluded: Conclusion, body: Body, choices: AdhesiveChoices, started: float
) -> AdhesiveFit:
    """Return the fit that follows from the search."""
    test, space, (best, objective) = found.test, found.problem.space, found.solved.whole
    values = dict(concluded.fields["values"])
    work = values.pop("work")
    law = with_work(test.film.law, work)
    material = test.material(**values, nu=body.nu)
    tabor = float(law.tabor_number(float(body.ball.radius), body.modulus(1.0 / float(material.creep(0.0)))))
    rows = np.stack([space.to_si(v) for v in (best.theta, *concluded.ends.T)], -1)
    nuisances = {space.names[i]: tuple(rows[i].tolist()) for i in space.free if not space.material[i]}
    # the lowest load of the fitted curve in contact, and its slope by the coordinates from that row of the Jacobian
    model = test.data.load + np.divide(
        best.residual,
        found.solved.weights,
        out=np.full(test.data.t.size, np.inf),
        where=found.solved.weights > 0.0,
    )
    lowest = int(np.argmin(model))
    force = -float(model[lowest])
    slope = -best.jacobian[lowest] / (found.solved.weights[lowest] * force)
    z, seen, width = student.two_sided(choices.level), test.seen, float(found.run.grid.width[0])
    note = (
        f"the range of the attraction is held at {float(law.characteristic_range):.3g} m; grid of {CELLS} x {CELLS} cells"
        f" over {width:.3g} m, corrected by a finer one"
    )
    return concluded.fit(
        AdhesiveFit, material=material, law=law, tabor_number=tabor, notes=(*concluded.fields["notes"], note),
        pull_off=interval_of_tension(force, slope, found.solved, concluded), separation_work=seen.separation_work(z),
        nu=body.nu, indenter=body.ball, film=body.film, nuisances=nuisances, kept=seen.contact,
        runs=(objective.residual_runs, objective.jacobian_runs), starts=found.starts,
        seconds=time.perf_counter() - started,
    )  # fmt: skip
