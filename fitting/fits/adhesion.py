"""Fit of the modulus and the work of adhesion to an adhesive force curve, approach and retraction."""

import dataclasses
import math
import time
from typing import Any, NamedTuple

import numpy as np

import jaxcontact as jc
from fitting.data.indentation import IndentationData
from fitting.data.probe import probe_of
from fitting.data.pull_off import read_pull_off, zeroed
from fitting.inference import student
from fitting.inference.conclusion import Conclusion, FitProblem, conclude, least_squares
from fitting.inference.evidence import Sample
from fitting.inference.result import Fit, plain
from fitting.models.adhesive_curve import JKR, MaugisDugdale
from fitting.models.coordinates import NUISANCES
from fitting.models.search_space import ParameterSpace
from fitting.models.structure import Sought, Volume
from fitting.search.adhesive_search import MODELS, UNITS, AdhesiveTest, Body, table_of
from fitting.search.nonlinear import moved
from fitting.search.press import Instrument, weigh
from fitting.views import adhesion_picture, report

LAWS = (jc.ExponentialAdhesion, jc.DugdaleAdhesion)
CELLS = 48  # along a side of the grid of the solver

Interval = tuple[float, float, float]


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class AdhesiveFit(Fit):
    """Result of the fit of an adhesive force curve; the attributes common to all fits are documented in ``Fit``.

    Its parameters are "G" [Pa], "work" [J/m2] and, where the attraction has a range, "strength" [Pa] or "range" [m].

    Attributes:
        law: the law of adhesion with the fitted parameters; None for an attraction of short range (JKR).
        tabor_number: (R w^2/(E*^2 z^3))^(1/3) of the fitted law, z = w/s(0); nan without a range.
        pull_off: (value, low, high) [N]: the largest tension, read from the curve without a model.
        separation_work: (value, low, high) [J]: the work of the tension of the retraction, likewise.
        nu, indenter: given quantities on which the parameters are conditional; thickness [m] of a film, or None.
        nuisances: {contact_point [m], drift [m/s], machine_compliance [m/N]: (value, low, high)} of those that were
            fitted.
        kept: (n,) bool, the points in contact, which were fitted.
        runs: (forward, gradient) numbers of evaluations of the model.
        starts: (number of local searches, number that reached this minimum).
        seconds: wall time of the whole fit [s].
    """

    law: Any
    tabor_number: float
    pull_off: Interval
    separation_work: Interval
    nu: float
    indenter: Any
    thickness: float | None
    nuisances: dict[str, Interval]
    kept: np.ndarray
    runs: tuple[int, int]
    starts: tuple[int, int]
    seconds: float

    def plot(self, path: Any = None) -> Any:
        """Return a figure of load over depth with the fit, and of the residuals; save it where a path is given."""
        return adhesion_picture.draw(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with pull-off and work of separation, the Tabor number and what was held."""
        key = lambda name: f"{name}_{NUISANCES[name].replace('/', '_per_')}"
        return super().to_dict() | {
            "pull_off_N": plain(self.pull_off), "separation_work_J": plain(self.separation_work),
            "tabor_number": plain(self.tabor_number), "poisson_ratio": self.nu, **probe_of(self.indenter).key,
            "film_thickness_m": plain(self.thickness),
            "nuisances": {key(name): plain(row) for name, row in self.nuisances.items()},
            "starts": self.starts[0], "starts_agreed": self.starts[1],
            "forward_runs": self.runs[0], "gradient_runs": self.runs[1], "time_s": self.seconds,
        }  # fmt: skip

    def _choices(self) -> list[str]:
        return ["depth control", *super()._choices(), probe_of(self.indenter).words]

    def _nuisance_lines(self) -> list[str]:
        rows = self.nuisances.items()
        return [
            f"  {name} = {v:.5g} {NUISANCES[name]}, {low:.4g} to {high:.4g}" for name, (v, low, high) in rows
        ]

    def _combination_lines(self) -> list[str]:
        percent = f"{100 * self.level:g} % interval"
        read = (("pull-off force", "N", self.pull_off), ("work of separation", "J", self.separation_work))
        lines = [
            f"  {name} = {v:.5g} {unit}, {percent} {low:.5g} to {high:.5g}"
            for name, unit, (v, low, high) in read
        ]
        if math.isfinite(self.tabor_number):
            lines.append(f"  Tabor number {self.tabor_number:.3g}")
        return lines

    def _conditions(self) -> list[str]:
        body = "a half-space" if self.thickness is None else f"a film of {self.thickness:.4g} m"
        runs = f"{self.runs[0]} forward and {self.runs[1]} gradient runs in {self.seconds:.3g} s"
        return [f"  the parameters are conditional on nu = {self.nu:.4g} and {body}; {runs}"]


class AdhesiveChoices(NamedTuple):
    """Keywords of a fit of an adhesive curve, as in ``fit_indentation``."""

    instrument: Instrument
    weights: str | None
    sigma: Any
    fixed: dict[str, float] | None
    bounds: dict[str, tuple] | None
    level: float


def is_fitted(adhesion: Any) -> bool:
    """Return whether an ``adhesion=`` asks for a fit of the work of adhesion; ValueError for another text."""
    if isinstance(adhesion, str) and adhesion.lower() not in ("fit", "jkr"):
        raise ValueError(
            f'adhesion: expected "fit", "JKR", a law of adhesion or a work of adhesion [J/m2], got {adhesion!r}'
        )
    if not isinstance(adhesion, LAWS):
        return isinstance(adhesion, str)
    for field in dataclasses.fields(adhesion):
        value = getattr(adhesion, field.name)
        if not (np.ndim(value) == 0 and 0.0 < value < math.inf):
            raise ValueError(f"adhesion: {field.name}: expected a number > 0, got {value!r}")
    return True


def check_fitted(adhesion: Any, model: Any, film: bool, control: Any, others: dict[str, bool]) -> None:
    """Raise ValueError for keywords of ``fit_indentation`` that a fit of the work of adhesion does not take."""
    if getattr(model, "__name__", model) not in ("Elastic", "elastic"):
        raise ValueError(
            f"model: expected Elastic with a fit of the work of adhesion, got {getattr(model, '__name__', model)!r}: a"
            " receding edge on a viscoelastic solid has no closed form; pass a known work, for the approach alone"
        )
    if control != "depth":
        raise ValueError(f'control: expected "depth" with a fit of the work of adhesion, got {control!r}')
    if film and isinstance(adhesion, str):
        raise ValueError(
            f"adhesion: expected a law of adhesion with a layer, whose parameters the solver starts from, got {adhesion!r}"
        )
    for name in (name for name, given in others.items() if given):
        raise ValueError(f"{name}: expected none with a fit of the work of adhesion")


def body_of(indenter: Any, nu: Any, layer: Any, substrate: Any) -> Body:
    """Return what is pressed; ValueError for anything but a ball on a half-space, or on one film on a substrate."""
    if not isinstance(indenter, jc.Sphere):
        raise ValueError(f"adhesion: expected a Sphere, got {type(indenter).__name__}")
    if (layer is None) != (substrate is None):
        raise ValueError(
            f"layer: expected a thickness together with a substrate, got layer={layer!r}, substrate={substrate!r}"
        )
    if layer is not None and not (np.ndim(layer) == 0 and layer > 0.0):
        raise ValueError(f"layer: expected a thickness > 0 m, got {layer!r}")
    return Body(float(Volume.of(nu, None).value), indenter, layer, substrate)


def fit_adhesive(
    data: IndentationData, adhesion: Any, body: Body, choices: AdhesiveChoices, grid: Any = None
) -> AdhesiveFit:
    """Fit G, the work of adhesion and the strength or range of the attraction.

    adhesion: "fit" (Maugis) or "JKR" for a closed form on a half-space, or a law whose parameters the contact solver starts
    from.
    """
    started = time.perf_counter()
    if not (grid is None or (isinstance(grid, int) and grid >= 16)):
        raise ValueError(
            f"grid: expected a number of cells of at least 16 with a law of adhesion, got {grid!r}"
        )
    if not isinstance(data, IndentationData):
        raise ValueError(f"data: expected IndentationData, got {type(data).__name__}")
    data = zeroed(data)
    seen = read_pull_off(data)
    weights, label = weigh(data, seen.contact, "depth", choices.weights, choices.sigma)
    closed = isinstance(adhesion, str)
    model = {"jkr": JKR, "fit": MaugisDugdale}[adhesion.lower()] if closed else MODELS[type(adhesion)]
    test = AdhesiveTest(
        data, seen, body, None if closed else adhesion, model, weights, CELLS if grid is None else grid
    )
    return _concluded(test, _found(test, label, choices), choices, started)


class _Searched(NamedTuple):
    """A problem with its solution and what follows from it."""

    problem: FitProblem
    solved: Any
    concluded: Conclusion


def _found(test: AdhesiveTest, label: str, choices: AdhesiveChoices) -> _Searched:
    """Return the conclusion of the search of a test."""
    table = table_of(test.model, choices.fixed, choices.bounds)
    space = test.space(table, choices.instrument)
    sought = Sought(space.structure, table, Volume.of(test.body.nu, None))
    blocks = np.cumsum(np.append(False, test.data.segments[1:] != test.data.segments[:-1]))
    sample = Sample.of(("load", "N", test.data.t, test.data.load), test.weights, label, blocks)
    problem = FitProblem(test.data, sought, space, sample, float(np.ptp(test.data.t)), choices.level)
    solved = least_squares(problem, lambda weights: test.objective(space, weights), test.starts(space))
    solved = solved._replace(kept=test.seen.contact)
    if test.law is not None:
        left = _grid_error(test, space, solved)
        note, against = _grid_note(space, left, test.cells), test.failures(space, solved.theta)
        solved = solved._replace(left=left, notes=(*solved.notes, note), against=against)
    return _Searched(problem, solved, conclude(problem, solved))


def _grid_error(test: AdhesiveTest, space: ParameterSpace, solved: Any) -> np.ndarray:
    """Return a bound (m,) on the error of the coordinates by the grid: twice their change on one of twice the cells.

    The error of the pull-off load is of first order in the size of a cell where the zone at the edge is not resolved, so
    that a grid of half the size removes half of it.
    """
    best, objective = solved.whole
    finer = test._replace(cells=2 * test.cells).objective(space, solved.weights)
    change = moved(best, objective.free, finer.at(best.theta) - best.residual)
    return 2.0 * np.abs(change)


def _grid_note(space: ParameterSpace, left: np.ndarray, cells: int) -> str:
    """Return a note with the bound on the error of the parameters by the grid."""
    shares = [
        f"{name} {100 * left[i]:.2g} %" for i, name in enumerate(space.structure.where) if left[i] > 0.0
    ]
    return f"error by the grid of {cells} x {cells} cells, within the intervals: up to {', '.join(shares)}"


def _tabor(body: Body, G: float, work: float, largest: float) -> float:
    """Return the Tabor number of a law of adhesion with the attraction ``largest`` [Pa] in contact."""
    law = jc.DugdaleAdhesion(work, largest)
    return float(law.tabor_number(float(body.ball.radius), body.modulus(G)))


def _concluded(test: AdhesiveTest, found: _Searched, choices: AdhesiveChoices, started: float) -> AdhesiveFit:
    """Return the fit that follows from the search."""
    space, (best, objective), body = found.problem.space, found.solved.whole, test.body
    values = found.concluded.fields["values"]
    law = _law(test, values)
    tabor = (
        math.nan if law is None else _tabor(body, values["G"], values["work"], float(law.largest_traction))
    )
    z, seen = student.two_sided(choices.level), test.seen
    rows = np.stack([space.to_si(v) for v in (best.theta, *found.concluded.ends.T)], -1)
    nuisances = {space.names[i]: tuple(rows[i].tolist()) for i in space.free if not space.material[i]}
    notes = (*found.concluded.fields["notes"], *_range_note(test, found, law))
    return found.concluded.fit(
        AdhesiveFit, material=jc.Elastic(values["G"], body.nu), law=law, tabor_number=tabor, notes=notes,
        pull_off=_interval(seen.force, z * seen.force_sd), separation_work=_interval(seen.work, z * seen.work_sd),
        nu=body.nu, indenter=body.ball, thickness=body.thickness, nuisances=nuisances, kept=seen.contact,
        runs=(objective.residual_runs, objective.jacobian_runs), starts=(best.starts, best.agreed),
        seconds=time.perf_counter() - started,
    )  # fmt: skip


def _law(test: AdhesiveTest, values: dict[str, float]) -> Any:
    """Return the law of adhesion with the fitted parameters; None for JKR."""
    if test.model is JKR:
        return None
    kind = jc.DugdaleAdhesion if test.law is None else type(test.law)
    return kind(*list(values.values())[1:])


def _range_note(test: AdhesiveTest, found: _Searched, law: Any) -> tuple[str, ...]:
    """Return a note if the curve does not determine the strength or the range of a law that was fitted."""
    fields = found.concluded.fields
    name = next((name for name in ("strength", "range") if name in fields["values"]), None)
    if law is None or name is None or fields["identified"][name]:
        return ()
    low, high = fields["intervals"][name]
    G, work = fields["values"]["G"], fields["values"]["work"]
    largest = (low, high) if name == "strength" else (work / high, work / low if low > 0.0 else math.inf)
    tabor = [_tabor(test.body, G, work, s) if math.isfinite(s) and s > 0.0 else s for s in largest]
    return (
        f"the range of the attraction is not identified: {name} {report.span(low, high)} {UNITS[name]}, a Tabor number"
        f" {report.span(*tabor)}; the interval of the work of adhesion allows for it",
    )


def _interval(value: float, half: float) -> Interval:
    return value, value - half, value + half
