"""Fit of a material to the indentation curve of a half-space, a thin sample, or a film on a substrate."""

import dataclasses
import functools
import time
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

import jaxcontact as jc
from fitting.data.contact import runs_of
from fitting.data.indentation import IndentationData, paraboloid_note, probe_of
from fitting.fits.adhesion import (
    AdhesiveFit,
    body_of,
    check_fitted,
    fit_adhesive,
    fit_creeping_film,
    is_law,
)
from fitting.inference.result import Fit, FitProblem, conclude, plain, solution
from fitting.inference.sample import Sample, Solved, check_count, reweighted_until_stable
from fitting.models import adhesive_contact, halfspace, thin_layer
from fitting.models.halfspace import Curve
from fitting.models.parameters import NUISANCES
from fitting.models.structure import Compressibility, Sought, columns, merge, structure_of
from fitting.models.thin_layer import Base, ThinLayer
from fitting.search import nonlinear
from fitting.search.nonlinear import Best, Objective, inverse, minimise, moved
from fitting.search.press import (
    STEPPED,
    Coating,
    FilmTest,
    Found,
    IndentationProblem,
    Instrument,
    Medium,
    Mesh,
    Pressing,
    elastic,
    evaluate,
    linearise,
    nuisance_slope,
    prepare,
    scene,
    spread_starts,
    start,
)
from fitting.views import text
from jaxcontact._support.prefixes import told_apart
from jaxcontact._support.status import PRECEDENCE

# Search of the fit of a probe on a half-space, or on a layer bonded to a rigid base: its objective, starts and notes.
#
# Under depth control, or with an unknown contact point, there may be several minima. The search then starts from
# several retardation times on a subset of the points, and continues with all points from the lowest minimum.


STRAIN = 0.2  # depth over the thickness of a layer beyond which linear theory is doubtful
FALL = 0.02  # fraction of the largest depth by which the depth may fall without the contact shrinking
FEW = 126  # number of points on which several minima are sought


def search_half_space(press: IndentationProblem) -> Found:
    """Return the optimum of a test on a half-space or a layer on a rigid base."""
    rise, thickness, n, deepest = (
        press.pressing.rise,
        press.pressing.thickness,
        press.t.size,
        press.units.depth,
    )
    by_load, adhesive = press.pressing.control == "load", bool(press.pressing.adhesion)

    # The history of the load: as measured, or a linear rise to the mean load after it.
    knots, values = press.t, press.load
    if rise is not None:
        size = float(press.load[press.kept].mean())
        knots, values = np.array([0.0, 1.0]), np.array([size, size])
        if rise > 0.0:
            knots, values = np.array([0.0, rise / press.units.duration, 1.0]), np.array([0.0, size, size])

    # The model. The contact of a flat punch does not change where the depth falls.
    falls = bool(np.any(press.depth < np.maximum.accumulate(press.depth) - FALL))
    kind = "load" if by_load else "ting" if falls and press.probe.power > 1.0 else "depth"
    kind = f"sticky {press.pressing.control}" if adhesive else kind

    # Starts by variable projection: depth^power is linear in the compliances under the measured load. The weights of
    # the depth are those of the fit under load control, uniform otherwise.
    depth, power = np.maximum(press.depth, 1e-3), press.probe.power
    use = press.kept & ((kind != "ting") | (np.arange(n) <= int(np.argmax(press.depth))))
    even = press.weights if by_load else np.ones(n)
    raised = depth**power if press.layer is None else depth**power * np.exp(press.layer.log_factor(depth))
    history = merge(nonlinear.repeated(press.t), nonlinear.repeated(knots), nonlinear.repeated(values))
    response = nonlinear.repeated(raised - press.extra * press.load)
    own = press.own  # the creep of the indenter, which is known, is no part of that of the sample
    if own is not None:
        parts = np.concatenate([np.zeros(1), own.amplitudes, np.reshape(own.fluidity, 1)])
        response = response - np.asarray(columns(history, own.rates)) @ parts
    weights = nonlinear.without_weight(use * depth / (power * raised) * even)
    # a single start searches over every retardation time
    one = kind == "load" and np.all(press.space.material[press.space.free])
    several = [] if one else spread_starts(press, response, weights, history)
    starts = several or [start(press, response, weights, history, least=1e-6)]

    # The lowest minimum on some of the points, evenly spaced and with the largest depth, and from there on all of
    # them.
    every = np.arange(n)
    few = np.unique(np.append(np.linspace(0, n - 1, min(FEW, n)).round().astype(int), np.argmax(press.depth)))
    objective = _objective(press, every, knots, values, kind)
    coarse = _objective(press, few, knots, values, kind) if few.size < n else objective
    low = nonlinear.minimise_from(coarse, starts)
    best = low if coarse is objective else nonlinear.minimise(objective, low.theta).after(low)

    # Notes: the strain of a layer is large, or the contact shrinks.
    notes = list(press.notes)
    if thickness is not None and deepest > STRAIN * thickness:
        share = told_apart(deepest / thickness, STRAIN)
        notes.append(f"the depth is {share} of the thickness: beyond {STRAIN:g} linear theory is doubtful")
    if kind == "ting":
        notes.append("the depth falls: Ting's solution from its maximum on")
    elif kind == "load" and power > 1.0:
        on = press.weights > 0
        fitted = press.depth[on] + best.residual[on] / press.weights[on]
        fall = float(np.max(np.maximum.accumulate(fitted) - fitted))
        if fall > FALL:
            notes.append(
                f"the contact shrinks (depth falls by {100 * fall:.1f} %): Lee and Radok only approximate"
            )
    curve = _curve(press, every, knots, values)
    moves = functools.partial(_half_space_moves, press, best, curve, kind)
    residual = functools.partial(_residual_at, curve, kind, n)
    medium = Medium(thickness, unbonded=press.pressing.unbonded)
    found = Found(press, best, objective, tuple(notes), moves, medium, residual)
    if not adhesive:
        return found

    # With adhesion: the opposite limit of the edge, and how far the theory holds.
    slow = nonlinear.minimise(_objective(press, every, knots, values, kind, edge=1.0), best.theta)
    alpha, creep = (np.asarray(part)[:n] for part in halfspace.sticky_area(best.theta, curve, kind))
    radius = float(press.pressing.indenter.radius)
    widest = float(np.sqrt(radius * deepest * alpha.max()))
    modulus = 2.0 / (creep[0] * press.units.compliance * press.sought.volume.one_minus_nu)
    doubled = press.t[creep > 2.0 * creep[0]]
    lives = 1.0 / doubled[0] if doubled.size else 1.0
    doubts = adhesive_contact.doubts(press.pressing.adhesion, radius, widest, modulus, lives)
    against = adhesive_contact.against(alpha)
    return found._replace(slow=slow, notes=(*notes, *doubts), against=against)


def _residual_at(curve: Curve, kind: str, n: int, theta: Any) -> Any:
    """Return the weighted residuals (n,) at a vector of coordinates; a module function, so that fits can be pickled."""
    return halfspace.evaluate(theta, curve, kind=kind)[:n]


def _objective(
    press: IndentationProblem,
    points: np.ndarray,
    knots: np.ndarray,
    values: np.ndarray,
    kind: str,
    edge: float = 0.0,
) -> Objective:
    """Return the least-squares objective over some of the points, padded internally.

    Residuals and Jacobian are one program: a second one for the residuals alone would take longer to compile than it
    saves.
    """
    curve, space, n = _curve(press, points, knots, values)._replace(edge=edge), press.space, points.size

    @functools.lru_cache(maxsize=2)
    def linear(theta: bytes) -> list[np.ndarray]:
        both = halfspace.linear(np.frombuffer(theta), space.free, curve, kind=kind)
        return [np.asarray(part)[:n] for part in both]

    return Objective(
        lambda theta: linear(theta.tobytes())[0],
        lambda theta, free: linear(theta.tobytes())[1],
        *space.bounds,
        floor=1e-26 * float(np.sum((press.weights * press.measured) ** 2)),
    )


def _curve(press: IndentationProblem, points: np.ndarray, knots: np.ndarray, values: np.ndarray) -> Curve:
    """Return the samples at ``points``, padded."""
    t, load, depth = (nonlinear.repeated(y[points]) for y in (press.t, press.load, press.depth))
    history = merge(t, nonlinear.repeated(knots), nonlinear.repeated(values))
    weights = nonlinear.without_weight(press.weights[points])
    return Curve(
        t, load, depth, weights, history, press.extra, press.bulk, press.probe.power, int(np.argmax(depth)),
        press.pull, layer=press.layer, rates=press.rates, own=press.own,
    )  # fmt: skip


def _half_space_moves(
    press: IndentationProblem, best: Best, curve: Curve, kind: str, name: str
) -> np.ndarray:
    """Return the derivative of the coordinates with respect to a held quantity; with nu every compliance scales as 1/(1
    - nu)."""
    space, units, volume = press.space, press.units, press.sought.volume
    if name != volume.name and (name != "thickness" or press.layer is None):
        raise ValueError(f"spread: a half-space has no {name}")
    if name == "bulk_modulus":
        slope = np.asarray(halfspace.bulk_slope(best.theta, curve, kind))[: press.t.size]
        return moved(best, space.free, slope * units.compliance)
    alone = np.where(space.logarithmic, 1.0, best.theta) * space.material / volume.one_minus_nu
    found = alone if name == "nu" else np.zeros(best.theta.size)
    if press.layer is None:
        return found
    # the factor of a layer depends on nu and on the thickness
    held = {"thickness": press.pressing.thickness, "nu": volume.value}

    def layer(value: Any) -> ThinLayer:
        base = Base(bonded=not press.pressing.unbonded)
        return ThinLayer.of(press.pressing.indenter, **(held | {name: value}), base=base).over(units.depth)

    change = jax.jvp(layer, (held[name],), (1.0,))[1]
    slope = np.asarray(halfspace.layer_slope(best.theta, curve, change, kind))
    return found + moved(best, space.free, slope[: press.t.size])


# Search of the fit of a film on a substrate, on a mesh that is fine enough for the data.
#
# The start is quasi-elastic: the approach of the ball on an elastic film is solved once over a range of the film's
# compliance and inverted point by point; the resulting compliances are then fitted as creep under the measured load.
# The width of the grid follows from the contact of that start. The effect of the grid and the time steps on the
# parameters is measured by a run with more cells and steps at the optimum and added to the model as a correction. The
# mesh is refined until the remaining bias is small compared with the noise, or below a thousandth of the parameters,
# which is less than the uncertainty of radius and thickness in any test.
#
# A growing contact is at first only a few cells wide, and its load then depends on the position of the cells. Samples
# at such times are part of the load history but are not fitted.


CELLS, MOST_CELLS, START_CELLS = 32, 128, 32
FINER, STEPS_FINER = 4, 3  # factors on cells and steps of the run that corrects an automatic grid
LEFT = 8.0  # second order: of the change, an eighth remains for the steps, a fifteenth for the cells
FINER_GIVEN, LEFT_GIVEN = 2, 3.0  # the same for a given grid
MOST_STEPS = 8  # between samples
MARGIN = 1.2  # width of the grid over that of the contact
WIDER = 1.3
WEIGHTS = 1e-3  # relative change of the weights above which a film is fitted again
ACROSS = 4.0  # least number of cells across the contact of a fitted sample; the solver needs 3
LEAST_POINTS = 5  # least number of fitted points
LEAST_GIVEN = 16  # least number of cells along a side of a given grid
SMALL = 0.2  # acceptable bias over standard error
PER_MILLE = 1e-3  # acceptable bias of the logarithm of a parameter
# function that returns the weights (n,) that follow from an optimum
Reweighed = Callable[[IndentationProblem, Best, Objective], np.ndarray]
RANGE = np.linspace(-3.0, 12.0, 31)  # log of the film's scaled compliance


def search_layered(press: IndentationProblem, coating: Coating, grid: Any, reweighed: Reweighed) -> Found:
    """Minimise on meshes of doubled fineness until the remaining bias is small compared with the noise."""
    if isinstance(press.pressing.indenter, jc.FlatPunch):
        raise ValueError(
            "indenter: expected a Sphere or a Cone on a film, got FlatPunch, whose edge is as wide as a cell"
        )
    if press.space.structure.model is jc.KelvinVoigt:
        raise ValueError("model: a Kelvin-Voigt film has J(0) = 0: expected StandardLinearSolid or another")
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
            coarse, objective = _minimise(press, scene(press, coating, mesh), coarse.theta)
        runs += objective.residual_runs + 3, objective.jacobian_runs

        # the change of the response at the optimum with more cells and steps, as a correction of the model
        film = scene(press, coating, mesh)
        fine = scene(press, coating, mesh._replace(cells=finer * mesh.cells, fine=STEPS_FINER * mesh.fine))
        bare = film._replace(weights=np.ones(press.t.size), response=np.zeros(press.t.size))
        plain = linearise(coarse.theta, press.space.free, bare)[0]
        film = film._replace(correction=evaluate(coarse.theta, fine) - plain)
        best, objective = _minimise(press, film, coarse.theta)

        # the bias that remains over the standard errors of the coordinates, which are infinite where held
        spread = np.full(best.theta.size, np.inf)
        variance = 1.0 if press.label == "sigma" else best.rss / (press.kept.sum() - best.jacobian.shape[1])
        spread[press.space.free] = np.sqrt(np.diag(inverse(best.jacobian)) * variance)
        discretisation = np.abs(best.theta - coarse.theta) / order
        bias = discretisation / np.maximum(spread, 1e-300)
        small = np.all((bias < SMALL) | (discretisation < PER_MILLE))
        if small or grid is not None or 2 * mesh.cells > MOST_CELLS:
            break
        theta, mesh = best.theta, mesh._replace(cells=2 * mesh.cells)
    objective.residual_runs += int(runs[0])
    objective.jacobian_runs += int(runs[1])
    named = {press.space.names[i]: float(bias[i]) for i in press.space.free}
    medium = Medium(
        coating.thickness,
        coating.substrate,
        jc.Grid.square(n=mesh.cells, width=mesh.width),
        discretisation,
        named,
        unbonded=coating.unbonded,
    )
    notes, few = list(press.notes), int(np.sum(fitted & ~press.kept))
    if few:
        notes.append(f"{few} points not fitted, at which the contact is fewer than {ACROSS:g} cells across")
    strain = float(np.max(linearise(best.theta, press.space.free, film)[4]))
    if strain > STRAIN:
        notes.append(
            f"the strain of the top layer reaches {told_apart(strain, STRAIN)}: beyond {STRAIN:g} linear theory is doubtful"
        )
    press = press._replace(notes=tuple(notes))
    return Found(
        press, best, objective, press.notes, functools.partial(_layered_moves, press, best, film), medium
    )


def _start(press: IndentationProblem, coating: Coating) -> tuple[np.ndarray, float]:
    """Return starting coordinates, and the largest contact radius [m] there."""
    # scaled depth and contact radius [m] under the largest load on elastic films of compliances ``RANGE``
    grid = jc.Grid.square(n=START_CELLS, width=2.4 * press.probe.widest(press.units.depth))
    film = press.sought.volume.keyword, press.pressing.indenter, coating, press.units.load, grid
    rows = [elastic(np.exp(x) * press.units.compliance, *film) for x in RANGE]
    depth, radius = np.array(rows).T
    depth = np.maximum.accumulate(depth / press.units.depth)

    # the compliance at each point, which is fitted as creep under the measured load
    on = press.kept & (press.load > 0.3)
    scaled = np.where(on, press.depth * np.maximum(press.load, 1e-3) ** (-1.0 / press.probe.power), depth[0])
    J = np.exp(np.interp(scaled, depth, RANGE))
    slope = np.interp(scaled, depth, np.gradient(depth, RANGE)) / J
    weights = np.where(on, slope / np.maximum(press.load, 0.3), 0.0)
    history = merge(press.t, press.t, press.load)
    widest = radius[min(int(np.searchsorted(depth, scaled[on].max())) + 1, depth.size - 1)]
    return start(press, J * press.load, weights, history, least=1e-2), float(widest)


def _minimise(press: IndentationProblem, film: FilmTest, theta: np.ndarray) -> tuple[Best, Objective]:
    """Minimise from theta with a loose tolerance on RSS, because each evaluation is expensive."""
    linearised = lambda theta: linearise(theta, press.space.free, film)
    objective = Objective.of_one_program(linearised, press.space.bounds, ftol=1e-5)
    return minimise(objective, theta), objective


def _resolved(
    press: IndentationProblem, coating: Coating, theta: np.ndarray, mesh: Mesh, chosen: bool
) -> tuple[IndentationProblem, Best, Objective, Mesh]:
    """Return the optimum on a mesh.

    An automatic mesh is widened while the contact reaches its edge, and steps that are too long are halved; samples at which
    the contact is only a few cells across get zero weight.
    """
    press = _coarse_left_out(press, scene(press, coating, mesh), theta, mesh)
    while True:
        film = scene(press, coating, mesh)
        best, objective = _minimise(press, film, theta)
        statuses = np.asarray(linearise(best.theta, press.space.free, film)[2])
        failed = [code for code in PRECEDENCE[:-1] if code in statuses and code != jc.Status.TOO_COARSE]
        status = failed[0] if failed else jc.Status.FINE
        if status == jc.Status.AT_EDGE and chosen:
            mesh = mesh._replace(width=WIDER * mesh.width)
            press = _coarse_left_out(press, scene(press, coating, mesh), best.theta, mesh)
        elif status == jc.Status.STEP_TOO_LONG and mesh.fine < MOST_STEPS:
            mesh = mesh._replace(fine=2 * mesh.fine)
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
    _, _, statuses, radius, _ = linearise(theta, press.space.free, film)
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


def _layered_moves(press: IndentationProblem, best: Best, film: FilmTest, name: str) -> np.ndarray:
    """Return d theta/d nuisance at the optimum, (m,)."""
    slope = nuisance_slope(best.theta, film, name=name)
    return moved(best, press.space.free, np.asarray(slope))


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class IndentationFit(Fit):
    """Result of the fit of an indentation curve; the attributes common to all fits are documented in ``Fit``.

    Attributes:
        control: "load" or "depth", the measured history that was prescribed in the model.
        nu or bulk_modulus [Pa] (the other is None), indenter, film: given quantities on which the moduli are
            conditional.
        nuisances: {contact_point [m], drift [m/s], machine_compliance [m/N]: (value, low, high)} of those that were
            fitted.
        kept: (n,) bool, the points that were fitted; ``fitted`` and ``residuals`` have values at these points.
        adhesion: the given work of adhesion [J/m2], 0 without adhesion.
        slow_edge: {parameter: value} of the same fit with J(t) in place of J(0) at the edge of the adhesive contact,
            the opposite limit of the behaviour of the edge; {} without adhesion.
        runs: (forward, gradient) numbers of evaluations of the model.
        starts: (number of local searches, number that reached this minimum).
        seconds: wall time of the whole fit [s].
    """

    indenter: Any
    nu: float | None
    bulk_modulus: float | None
    control: str
    film: Medium
    nuisances: dict[str, tuple[float, float, float]]
    kept: np.ndarray
    adhesion: float
    slow_edge: dict[str, float]
    runs: tuple[int, int]
    starts: tuple[int, int]
    seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with the nuisance parameters and the quantities on which the moduli are conditional."""
        return super().to_dict() | {
            "control": self.control,
            "nuisances": {text.key(name, NUISANCES[name]): plain(row) for name, row in self.nuisances.items()},
            **probe_of(self.indenter).key, "poisson_ratio": self.nu,
            "bulk_modulus_Pa": self.bulk_modulus,
            "film_thickness_m": plain(self.film.thickness), **({"unbonded": True} if self.film.unbonded else {}),
            "adhesion_J_per_m2": self.adhesion,
            "slow_edge": {self.structure.key(name): plain(value) for name, value in self.slow_edge.items()},
            "bias_over_standard_error": dict(self.film.bias),
            "starts": self.starts[0], "starts_agreed": self.starts[1],
            "forward_runs": self.runs[0], "gradient_runs": self.runs[1], "time_s": self.seconds,
        }  # fmt: skip

    def _choices(self) -> list[str]:
        return [f"{self.control} control", *super()._choices(), probe_of(self.indenter).words]

    def _nuisance_lines(self) -> list[str]:
        lines = []
        for name, (value, low, high) in self.nuisances.items():
            between = text.span(low, high) if low > 0 else f"{low:.4g} to {high:.4g}"
            lines.append(f"  {name} = {value:.5g} {NUISANCES[name]}, {between}")
        return lines

    def _conditions(self) -> list[str]:
        film, runs = self.film, f"{self.runs[0]} forward and {self.runs[1]} gradient runs"
        sought, agreed = self.starts
        spent = f"  {agreed} of {sought} starts converged to this minimum; {runs} in {self.seconds:.3g} s"
        volume = Compressibility.of(self.nu, self.bulk_modulus)
        if self.adhesion:
            slow = ", ".join(f"{name} = {value:.5g}" for name, value in self.slow_edge.items())
            return [
                f"  the moduli are conditional on {volume}, a half-space, {self.adhesion:g} J/m2 and the"
                " instantaneous compliance at the edge (JKR)",
                f"  with the relaxed compliance at the edge: {slow}",
                spent,
            ]
        if film.thickness is not None and film.grid is None:
            body = text.layer(film.thickness, film.unbonded)
            return [f"  the moduli are conditional on {volume} and {body}", spent]
        if film.thickness is None:
            return [f"  the moduli are conditional on {volume} and a half-space", spent]
        bias = ", ".join(f"{name} {value:.2g}" for name, value in film.bias.items())
        n, m = film.grid.shape
        loose = " of a film that slides on what is below it" if film.unbonded else ""
        return [
            f"  the moduli are conditional on thickness = {film.thickness:.4g} m{loose} and {volume}, "
            "which a wide contact does not determine separately",
            f"  grid {n} x {m}; discretisation bias over standard error, within the intervals: {bias}",
            spent,
        ]


def fit_indentation(
    data: IndentationData, model: type | str = jc.Burgers, *, indenter: Any, nu: float | None = None,
    bulk_modulus: float | None = None, tau: Any = None, control: str = "load", weights: str | None = None,
    sigma: Any = None, fixed: dict[str, float] | None = None, bounds: dict[str, tuple] | None = None,
    contact_point: float | str | None = None, drift: float | str = 0.0, machine_compliance: float | str = 0.0,
    rise: float | None = None, adhesion: Any = 0.0, layer: float | None = None, layers: Sequence[Any] | None = None,
    substrate: Any = None, grid: Any = None, thickness: float | None = None, unbonded: bool = False, level: float = 0.95,
) -> IndentationFit | AdhesiveFit:  # fmt: skip
    """Fit a material to the indentation of a half-space, or of a film on a substrate, by a ball, cone or punch.

    The measured history is used in the hereditary integral (Lee and Radok; Ting where the depth falls after a single
    maximum). Times count from the first sample, at which load and depth may step; of a part of a curve (``only``,
    ``window``), the part before it is history and not fitted. With a ``thickness`` the integrals
    hold with the exact force on a layer bonded to a rigid base (``thin_layer_factor``), such as a gel in a dish:

        P(t) = int G(t - s) d(F(depth(s))),     F the elastic force over the modulus.

    With a ``layer`` the contact solver is the forward model.

    Args:
        data: the curve, n points.
        model: a material class or its name.
        indenter: a ``jc.Sphere``, ``jc.Cone`` (``jc.Cone.berkovich()``) or, on a half-space, ``jc.FlatPunch``, rigid
            or of a known material, which may creep; with a ``layer`` also coated.
        nu: Poisson's ratio of the material, held constant; or
        bulk_modulus: constant bulk modulus [Pa] of an elastic response in volume, while the shear creeps.
        tau: retardation times (k,) [s]; required for ``jc.Prony``.
        control: the measured quantity that is prescribed and therefore not fitted: "load", under which the contact must
            grow, or "depth".
        weights: "absolute" (one error for all points; the default without a sigma), "proportional", "relative" or
            "estimated" (standard deviation (a^2 + (b y)^2)^(1/2) of the response y, estimated from the data and then
            from the residuals); with adhesion "absolute" alone.
        sigma: in place of weights, the standard deviation of depth [m] or load [N], a number or (n,); by default the
            standard deviation that the data carry, if any.
        fixed: {parameter: value} [Pa, Pa s, or the SI unit of a series] of any subset.
        bounds: {parameter: (low, high)} of any subset, None for an open side.
        contact_point: offset of the measured depth [m], a known number or "fit"; by default "fit" if the data are
            ``in_contact`` from a contact found from the load, and begin with it, so that its error is in the intervals;
            otherwise and with a ``rise`` or ``adhesion`` 0.
        drift: drift of the measured depth [m/s], a known number or "fit".
        machine_compliance: compliance of the instrument [m/N], a known number or "fit".
        rise: replace the measured load by one that rises linearly for this time [s] and is then held constant, for
            comparison with papers (M. L. Oyen, J. Mater. Res. 20 (2005) 2094; 0 is a step); only later points are
            fitted, and no history before the first point is used.
        adhesion: of an adhesive ball; a known work of adhesion [J/m2] on a half-space: the theory of Johnson, Kendall and
            Roberts with the hereditary integral, for a growing contact, from the jump into contact at the first sample
            (derived in ``fitting/models/adhesive_contact.py``). The edge is assumed to respond with the instantaneous
            compliance; ``slow_edge`` holds the parameters for the opposite limit. "fit": the work of adhesion and the
            strength of the attraction are parameters of an elastic half-space (``model="Elastic"``), for approach and
            retraction under ``control="depth"`` (D. Maugis, J. Colloid Interface Sci. 150 (1992) 243); "JKR": the same
            for an attraction of short range, also on an elastic film (``layer=`` a thickness, ``substrate=`` an
            ``Elastic``; ``fitting/models/adhesive_contact.py``); ``bounds`` of G must say whether it is softer or stiffer.
            A law of adhesion (``jc.ExponentialAdhesion(work, range)`` or ``jc.DugdaleAdhesion``): material and work of a
            film that creeps on an elastic base, with the range or strength of the law held and its work as the start, for
            approach, dwell and retraction by the contact solver (``fitting/fits/adhesion.py``), in minutes;
            ``bounds`` must say that G1 (or G) is at most that of the base.
            ``fixed`` and ``bounds`` take "work" and "strength" too, and the result is an ``AdhesiveFit``. Where the
            residuals have a trend, its intervals include the changes of modulus and work with half the contact and, for
            "JKR" on a half-space, with a range of the attraction; the fit is rejected where one of these exceeds 49 %, or
            the trend 5 % of the largest force.
        layer: thickness [m] of a film of the material.
        layers: in place of ``layer``, all layers from the top: one thickness [m], that of the material, and known
            ``jc.Layer`` and ``jc.Graded`` above and below it.
        substrate: the known material below the film, elastic or viscoelastic.
        grid: a square ``jc.Grid`` for the film, or the number n of cells along a side of an n x n grid whose width
            follows from the contact; by default both are chosen so that the discretisation error of each parameter is
            below a fifth of its standard error or a thousandth of its value. Samples at which the contact is fewer than
            4 cells across are not fitted, and a note gives their number.
        thickness: of a sample bonded to a rigid base [m], in place of ``layer``; the indenter is then rigid and nu is 0 to
            0.5.
        unbonded: whether the sample of a ``thickness``, or the film of a ``layer``, slides without friction on what is below
            it, not lifting off, instead of being bonded.
        level: confidence level of the intervals.

    Returns:
        The material with its intervals, how well the data determine it, and the quantities on which it is conditional.

    Raises:
        ValueError: bad values, too few points in contact, a load that falls under load control, or a film
            whose contact does not fit the given grid.

    Example:
        >>> t = np.linspace(0.0, 10.0, 21)
        >>> depth = (3 * 0.5 / 8 * 1e-6 * (1 + t)) ** (2 / 3)  # J = 1e-6 (1 + t), nu = 0.5, R = 1 m, P = 1 N
        >>> hold = fitting.IndentationData(t=t, load=np.ones(21), depth=depth)
        >>> fit = fitting.fit_indentation(hold, "Maxwell", indenter=jc.Sphere(radius=1.0), nu=0.5)
        >>> print(f"G = {fit.values['G']:.4g} Pa, eta = {fit.values['eta']:.4g} Pa s")
        G = 1e+06 Pa, eta = 1e+06 Pa s
    """
    started = time.perf_counter()
    any_layer = [given for given in (thickness, layer, layers) if given is not None]
    thin_layer.check_unbonded(unbonded, any_layer[0] if any_layer else None)
    if contact_point is None:
        contact_point, data = _contact_of(data, rise is not None or bool(adhesion))
    instrument = Instrument(contact_point, drift, machine_compliance)

    # With a work of adhesion that is fitted: fits of their own (``adhesion.py``).
    if isinstance(adhesion, str) and adhesion.lower() not in ("fit", "jkr"):
        raise ValueError(
            f'adhesion: expected "fit", "JKR", a law of adhesion or a work [J/m2], got {adhesion!r}'
        )
    if isinstance(adhesion, str) or is_law(adhesion):
        others = {
            "tau": tau, "rise": rise, "layers": layers, "grid": grid, "thickness": thickness,
            "bulk_modulus": bulk_modulus, "unbonded": unbonded or None,
        }  # fmt: skip
        for name, given in others.items():
            if given is not None:
                raise ValueError(f"{name}: expected none with a fit of the work of adhesion")
        choices: dict[str, Any] = {
            "instrument": instrument, "weights": weights, "sigma": sigma, "fixed": fixed, "bounds": bounds, "level": level,
        }  # fmt: skip
        if is_law(adhesion):
            return fit_creeping_film(
                data, adhesion, model, control=control, indenter=indenter, nu=nu, thickness=layer, substrate=substrate,
                **choices,
            )  # fmt: skip
        check_fitted(adhesion, model, layer is not None or substrate is not None, control)
        return fit_adhesive(data, adhesion, body_of(indenter, nu, layer, substrate), **choices)

    # The problem of a half-space, of a thin sample on a rigid base, or of a film.
    structure = structure_of(model, tau)
    sought = Sought.of(structure, fixed, bounds, nu, bulk_modulus)
    control = control.lower() if isinstance(control, str) else control
    film = any(given is not None for given in (layer, layers, substrate, grid))
    if thickness is not None:  # a layer on a rigid base
        if film or adhesion:
            raise ValueError(
                "thickness: expected no layer, layers, substrate, grid or adhesion beside it, got some"
            )
        if sought.volume.name != "nu":
            raise ValueError(f"bulk_modulus: expected nu with a thickness, got {sought.volume.value:g} Pa")
        if getattr(indenter, "material", None) is not None:
            raise ValueError("indenter: expected a rigid one on a thin layer, got one with a material")
        thin_layer.check(thickness, sought.volume.value)
    pressing = Pressing(indenter, control, rise, adhesion, film, thickness, bool(unbonded))
    press = prepare(data, sought, pressing, instrument, weights, sigma)
    check_count(level, _sample(press).fewest_points, press.space.free.size)

    # The optimum, with weights that are consistent with it.
    if film:
        if rise is not None:
            raise ValueError(f"rise: expected None with a layer, got {rise!r}")
        if press.pressing.adhesion:
            raise ValueError(f"adhesion: expected none with a layer, got {press.pressing.adhesion:g} J/m2")
        found = search_layered(press, Coating.of(layer, layers, substrate, unbonded), grid, _reweighed)
    else:
        sample, unit = _sample(press), _response_unit(press)

        def solve(weights: np.ndarray) -> Solved:
            found = search_half_space(press._replace(weights=np.where(press.kept, weights * unit, 0.0)))
            return solution(found.objective, found.best, weights, press.kept)._replace(search_result=found)

        # points that are not fitted have a weight for the reweighting alone
        first = np.where(press.kept, sample.weights, sample.weights.max())
        found = reweighted_until_stable(sample, solve(first), solve, press.space.free.size).search_result

    # A ball that is not a paraboloid has a note, with adhesion one by the contact radius.
    press, best, objective = found.press, found.best, found.objective
    pressing, space, theta, notes = press.pressing, press.space, best.theta, found.notes
    if not pressing.adhesion:
        place = space.names.index("contact_point")
        deepest = float(press.data.depth[press.kept].max() - space.to_si(theta)[place])
        notes = (*notes, *paraboloid_note(pressing.indenter, deepest, thickness=thickness))
    problem = FitProblem(press.data, sought, space, _sample(press), press.units.duration, level)
    solved = solution(objective, best, problem.sample.weights, press.kept)._replace(
        notes=notes, moves=found.moves, systematic=found.medium.discretisation, against=found.against,
        landscape=found.residual and space.landscape(theta, found.residual),
    )  # fmt: skip
    concluded = conclude(problem, solved)

    # The parameters with the relaxed compliance at an adhesive edge.
    slow_edge = {}
    if found.slow is not None:
        values = space.opened(found.slow.theta) * space.unit[space.material]
        slow_edge = {name: float(value) for name, value in structure.parameters(values).items()}
    return concluded.fit(
        IndentationFit, indenter=pressing.indenter, **press.sought.volume.keyword, control=pressing.control,
        film=found.medium, nuisances=space.fitted_nuisances(theta, concluded.ends), kept=press.kept,
        adhesion=pressing.adhesion, slow_edge=slow_edge,
        starts=(best.starts, best.agreed), runs=(objective.residual_runs, objective.jacobian_runs),
        seconds=time.perf_counter() - started,
    )  # fmt: skip


def _contact_of(data: IndentationData, elsewhere: bool) -> tuple[float | str, IndentationData]:
    """Return the default of ``contact_point``, and the curve with a note if the error of its contact is left out.

    A contact found from the load is fitted again if the points show it. From a hold alone it would be confused with creep.
    elsewhere: whether the fit takes the contact from elsewhere.
    """
    if elsewhere or not getattr(data, "contact_found", False):
        return 0.0, data
    if data.load[0] < STEPPED * data.load.max():
        return "fit", data
    note = "the contact found is taken as exact: the points fitted begin after it, and do not show its error"
    return 0.0, dataclasses.replace(data, notes=(*data.notes, note))


def _reweighed(press: IndentationProblem, best: Best, objective: Objective) -> np.ndarray:
    """Return the scaled weights (n,) that follow from the optimum on a film, 0 for points that are not fitted."""
    sample, on = _sample(press), press.kept
    if not sample.adjustable:
        return press.weights
    solved = solution(objective, best, sample.weights, on).only(on)
    weights = np.zeros(on.size)
    weights[on] = sample.only(on).reweighed(solved, press.space.free.size) * _response_unit(press)
    return weights


def _sample(press: IndentationProblem) -> Sample:
    """Return the fitted curve in SI units; each segment of the curve is a separate series."""
    unit, series = _response_unit(press), runs_of(press.data.segments)
    curve = (*press.pressing.response, press.data.t, press.measured * unit)
    return Sample.of(curve, press.weights / unit, press.label, series)


def _response_unit(press: IndentationProblem) -> float:
    """Return the unit of the fitted quantity [m] or [N]."""
    return press.units.depth if press.pressing.control == "load" else press.units.load
