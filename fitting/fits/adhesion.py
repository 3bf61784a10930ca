"""Fit of the modulus and the work of adhesion to an adhesive force curve, approach and retraction."""

import dataclasses
import math
import time
from typing import Any, NamedTuple

import numpy as np

import jaxcontact as jc
from fitting.data.indentation import IndentationData
from fitting.data.probe import paraboloid_note, probe_of
from fitting.data.pull_off import check_signs, read_pull_off, zeroed
from fitting.fits.adhesion_verdict import AdhesiveSample, deviation
from fitting.inference import student
from fitting.inference.conclusion import Conclusion, FitProblem, conclude, least_squares
from fitting.inference.result import Fit, plain
from fitting.models.adhesive_curve import JKR, MaugisDugdale
from fitting.models.adhesive_film import FilmOnBase
from fitting.models.coordinates import NUISANCES
from fitting.models.structure import Sought, Volume
from fitting.search.adhesive_search import AdhesiveTest, Body, table_of
from fitting.search.nonlinear import minimise_from, moved
from fitting.search.press import Instrument, indentation_weights
from fitting.search.uncertainty import inverse
from fitting.views import adhesion_picture, report

Interval = tuple[float, float, float]

TENSION = 0.02  # of the tension on a film, by which a curve of the solver at a Tabor number of 3 exceeded JKR
FILM_NOTE = (
    f"on a film the attraction is taken to have no range; the intervals allow for {100 * TENSION:g} % of the tension, as a"
    " Tabor number of 3 may change it, and with a longer range the work is too large by more"
)


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class AdhesiveFit(Fit):
    """Result of the fit of an adhesive force curve; the attributes common to all fits are documented in ``Fit``.

    Its parameters are "G" [Pa], "work" [J/m2] and, where the attraction has a range, "strength" [Pa]; of a film that creeps
    those of its material and "work".

    Attributes:
        law: the law of adhesion with the fitted parameters and what was held of it; None for an attraction of short range
            (JKR).
        tabor_number: (R w^2/(E*^2 z^3))^(1/3) of the fitted law, z = w/s(0); nan without a range.
        pull_off: (value, low, high) [N]: the largest tension of the fitted curve, 3/2 pi w R for JKR on a half-space. The
            lowest reading is no estimate of it, since the noise selects it.
        separation_work: (value, low, high) [J]: the work of the tension of the retraction, read from the curve without a
            model; the interval includes the distance between the last point in contact and the next.
        nu, indenter, film: given quantities on which the parameters are conditional; film: None for a half-space, else
            thickness [m], and modulus [Pa] and Poisson's ratio of the base.
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
    film: FilmOnBase | None
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
            "tabor_number": plain(self.tabor_number), "poisson_ratio": self.nu,
            "film_thickness_m": None if self.film is None else self.film.thickness, **probe_of(self.indenter).key,
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
        runs = f"{self.runs[0]} forward and {self.runs[1]} gradient runs in {self.seconds:.3g} s"
        body = "a half-space"
        if self.film is not None:
            body = f"a film of {self.film.thickness:.4g} m on a base of G = {self.film.base:.4g} Pa"
        return [f"  the parameters are conditional on nu = {self.nu:.4g} and {body}; {runs}"]


class AdhesiveChoices(NamedTuple):
    """Keywords of a fit of an adhesive curve, as in ``fit_indentation``."""

    instrument: Instrument
    weights: str | None
    sigma: Any
    fixed: dict[str, float] | None
    bounds: dict[str, tuple] | None
    level: float


def is_law(adhesion: Any) -> bool:
    """Return whether an ``adhesion=`` is a law of adhesion, whose work is fitted and whose range is held."""
    return isinstance(adhesion, jc.ExponentialAdhesion | jc.DugdaleAdhesion)


def is_fitted(adhesion: Any) -> bool:
    """Return whether an ``adhesion=`` asks for a fit of the work of adhesion; ValueError for anything but a number else."""
    if isinstance(adhesion, str) and adhesion.lower() not in ("fit", "jkr"):
        raise ValueError(
            f'adhesion: expected "fit", "JKR", a law of adhesion or a work [J/m2], got {adhesion!r}'
        )
    return isinstance(adhesion, str) or is_law(adhesion)


def check_none(others: dict[str, Any]) -> None:
    """Raise ValueError for keywords of ``fit_indentation`` that a fit of the work of adhesion does not take."""
    for name in (name for name, given in others.items() if given is not None):
        raise ValueError(f"{name}: expected none with a fit of the work of adhesion")


def check_fitted(adhesion: Any, model: Any, film: bool, control: Any) -> None:
    """Raise ValueError for what a fit of a closed form does not take."""
    if getattr(model, "__name__", model) not in ("Elastic", "elastic"):
        raise ValueError(
            f"model: expected Elastic with a fit of the work of adhesion, got {getattr(model, '__name__', model)!r}: a"
            " receding edge on a viscoelastic solid has no closed form; pass a law of adhesion for a film that creeps, or a"
            " known work for the approach alone"
        )
    if control != "depth":
        raise ValueError(f'control: expected "depth" with a fit of the work of adhesion, got {control!r}')
    if film and adhesion.lower() != "jkr":
        raise ValueError(f'adhesion: expected "JKR" with a layer, got {adhesion!r}')


def body_of(indenter: Any, nu: Any, layer: Any = None, substrate: Any = None) -> Body:
    """Return what is pressed; ValueError for anything but a ball on a half-space, or on a film on an elastic base."""
    if not isinstance(indenter, jc.Sphere):
        raise ValueError(f"adhesion: expected a Sphere, got {type(indenter).__name__}")
    nu = float(Volume.of(nu, None).value)
    return Body(nu, indenter, None if layer is None and substrate is None else _film_of(layer, substrate))


def check_side(body: Body, choices: AdhesiveChoices) -> None:
    """Raise ValueError for a film that may be softer or stiffer than its base, where both can have the same curve."""
    if body.film is None or "G" in (choices.fixed or {}):
        return
    low, high = (choices.bounds or {}).get("G") or (None, None)
    softer, stiffer = high is not None and high <= body.film.base, low is not None and low >= body.film.base
    if not (softer or stiffer):
        raise ValueError(
            f"bounds: expected an upper bound of G up to that of the base, {body.film.base:.4g} Pa, for a softer film, or a"
            f" lower bound from it on for a stiffer one, with a fit of the work of adhesion, got {(low, high)!r}: a film"
            " softer and one stiffer than the base can have the same curve"
        )


def _film_of(layer: Any, substrate: Any) -> FilmOnBase:
    """Return a film with a thickness [m] on an elastic base; ValueError for anything else."""
    if not isinstance(layer, int | float | np.number) or not 0.0 < float(layer) < math.inf:
        raise ValueError(
            f"layer: expected a thickness > 0 m with a fit of the work of adhesion, got {layer!r}"
        )
    if not isinstance(substrate, jc.Elastic) or substrate.nu is None:
        raise ValueError(
            f"substrate: expected Elastic with nu beside a fit of the work of adhesion, got {substrate!r}"
        )
    return FilmOnBase(float(layer), float(substrate.G), float(substrate.nu))


def fit_adhesive(data: IndentationData, adhesion: str, body: Body, choices: AdhesiveChoices) -> AdhesiveFit:
    """Fit G, the work of adhesion and, with "fit" (Maugis) but not with "JKR", the strength of the attraction."""
    started = time.perf_counter()
    if not isinstance(data, IndentationData):
        raise ValueError(f"data: expected IndentationData, got {type(data).__name__}")
    data, zero_sd = zeroed(data)
    check_signs(data, float(body.ball.radius))
    seen = read_pull_off(data)
    weights, label = indentation_weights(data, seen.contact, "depth", choices.weights, choices.sigma)
    model = {"jkr": JKR, "fit": MaugisDugdale}[adhesion.lower()]
    test = AdhesiveTest(data, seen, body, model, weights, student.two_sided(choices.level) * zero_sd)
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
    sample = AdhesiveSample.of(("load", "N", test.data.t, test.data.load), test.weights, label, blocks)
    problem = FitProblem(test.data, sought, space, sample, float(np.ptp(test.data.t)), choices.level)
    solved = least_squares(problem, lambda weights: test.objective(space, weights), test.starts(space))
    best, objective = solved.whole
    off = np.abs(
        moved(best, objective.free, solved.weights * test.zero)
    )  # what an error of the zero of the load changes
    solved = solved._replace(kept=test.seen.contact)
    ranged = test.model is JKR and test.body.film is None
    other = (lambda: _with_range(test, solved.weights, choices)) if ranged else None
    found = deviation(test, problem, solved, other)
    left = found.left + (off if test.zero > 0.0 else 0.0)
    notes = found.notes
    if test.body.film is not None:
        tension = TENSION * np.minimum(test.data.load, 0.0)
        left = left + np.abs(moved(best, objective.free, solved.weights * tension))
        notes = (*notes, FILM_NOTE)
    solved = solved._replace(left=left, against=found.against, notes=(*solved.notes, *notes))
    return _Searched(problem, solved, conclude(problem, solved))


def _with_range(test: AdhesiveTest, weights: np.ndarray, choices: AdhesiveChoices) -> np.ndarray:
    """Return the coordinates (m,) of the fit of Maugis's theory, without that of the strength."""
    other = test._replace(model=MaugisDugdale)
    space = other.space(table_of(other.model, choices.fixed, choices.bounds), choices.instrument)
    best = minimise_from(other.objective(space, weights), other.starts(space))
    return np.delete(best.theta, MaugisDugdale._fields.index("strength"))


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
    deepest = float(test.data.depth.max()) - dict(zip(space.names, rows[:, 0], strict=True))["contact_point"]
    notes = (
        *found.concluded.fields["notes"],
        *_range_note(test, found, law),
        *paraboloid_note(body.ball, deepest),
    )
    return found.concluded.fit(
        AdhesiveFit, material=jc.Elastic(values["G"], body.nu), law=law, tabor_number=tabor, notes=notes,
        pull_off=_pull_off(test, found), separation_work=seen.separation_work(z),
        nu=body.nu, indenter=body.ball, film=body.film, nuisances=nuisances, kept=seen.contact,
        runs=(objective.residual_runs, objective.jacobian_runs), starts=(best.starts, best.agreed),
        seconds=time.perf_counter() - started,
    )  # fmt: skip


def _law(test: AdhesiveTest, values: dict[str, float]) -> Any:
    """Return the law of adhesion with the fitted parameters; None for JKR."""
    if test.model is JKR:
        return None
    return jc.DugdaleAdhesion(values["work"], values["strength"])


def _range_note(test: AdhesiveTest, found: _Searched, law: Any) -> tuple[str, ...]:
    """Return a note if the curve does not determine the strength of a law that was fitted."""
    fields = found.concluded.fields
    if law is None or fields["identified"]["strength"]:
        return ()
    low, high = fields["intervals"]["strength"]
    G, work = fields["values"]["G"], fields["values"]["work"]
    tabor = [_tabor(test.body, G, work, s) if math.isfinite(s) and s > 0.0 else s for s in (low, high)]
    return (
        f"the range of the attraction is not identified: strength {report.span(low, high)} Pa, a Tabor number"
        f" {report.span(*tabor)}; the interval of the work of adhesion allows for it",
    )


def _pull_off(test: AdhesiveTest, found: _Searched) -> Interval:
    """Return the largest tension of the fitted curve with its interval [N].

    On a half-space with JKR it is 3/2 pi w R, whose interval is that of the work. Otherwise it depends on the other
    parameters too, and its interval is that of its logarithm by linearisation.
    """
    body, fields = test.body, found.concluded.fields
    radius = float(body.ball.radius)
    if body.film is None and test.model is JKR:
        unit = 1.5 * math.pi * radius
        return tuple(unit * v for v in (fields["values"]["work"], *fields["intervals"]["work"]))  # type: ignore[return-value]
    force, slope = test.pull_off(found.problem.space, found.solved.whole[0].theta)
    return interval_of_tension(force, slope[found.problem.space.free], found.solved, found.concluded)


def interval_of_tension(force: float, slope: np.ndarray, solved: Any, concluded: Conclusion) -> Interval:
    """Return a force with its interval, linearised in its logarithm.

    slope (k,): derivative of log force with respect to the free coordinates.
    """
    best, objective = solved.whole
    inside = (best.theta > objective.lower)[objective.free] & (best.theta < objective.upper)[objective.free]
    slope = np.where(inside, slope, 0.0)
    rise = float(concluded.assessment.levels(slope[:, None])[0]) - best.rss
    spread = slope[inside] @ inverse(best.jacobian[:, inside]) @ slope[inside]
    left = 0.0 if solved.left is None else float(np.abs(slope) @ np.abs(solved.left)[objective.free])
    growth = math.exp(math.sqrt(max(rise * spread, 0.0)) + left)
    return force, force / growth, force * growth
