"""Search for modulus and thickness from a contact stiffness over depth, and the judgement of its residuals."""

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

import jaxcontact as jc
from fitting.data.stiffness import StiffnessData
from fitting.data.weights import choose_weights
from fitting.fits.force_verdict import Deviation
from fitting.inference import evidence
from fitting.inference.conclusion import FitProblem
from fitting.inference.evidence import Assessment, Solved
from fitting.models.contact_stiffness import WIDEST, Coated, Tip, log_stiffness
from fitting.models.search_space import ParameterSpace
from fitting.models.structure import ParameterList
from fitting.search import nonlinear
from fitting.search.nonlinear import Objective

REACH = math.log(1e4)  # of log G and of log thickness about their starting values
THIN = (1.0, 0.3, 3.0, 10.0)  # starting thicknesses over the largest contact radius
CHANGE, TREND = (
    0.2,
    0.1,
)  # of log G from the deeper half to all points, and of the stiffness: beyond them, rejection
WINDOW = 0.05  # fraction of the points in a running mean of the residuals
SPREAD = math.log(100.0)  # of the moduli of single points about that of all
TRIALS = 13  # moduli at which the stiffness is computed for these


@dataclasses.dataclass(frozen=True, eq=False)
class ElasticFilm(ParameterList):
    """The modulus of an elastic half-space or film, and the thickness of the film."""

    nu: float = 0.3

    def material(self, values: dict[str, Any], volume: Any) -> Any:
        """Return the elastic material."""
        return jc.Elastic(values["G"], self.nu if volume is None else volume.value)


class StiffnessSample(evidence.Sample):
    """The points of a stiffness curve, whose trends ``deviation`` judges in place of the common tests."""

    def assess(self, solved: Solved, p: int, level: float) -> Assessment:
        """Return the evidence without reasons for rejection."""
        found = super().assess(solved, p, level)
        return found._replace(evidence=dataclasses.replace(found.evidence, refused=()))


class StiffnessProblem(NamedTuple):
    """Measured stiffness (n,) [N/m], the body, the tip and the parameters.

    start: modulus [Pa] from which the search starts.
    """

    stiffness: np.ndarray
    body: Coated
    tip: Tip
    sample: StiffnessSample
    structure: ParameterList
    start: float

    @classmethod
    def of(
        cls, data: StiffnessData, body: Coated, tip: Tip, weights: str | None, sigma: Any, film: bool
    ) -> "StiffnessProblem":
        """Return the problem; ValueError on two choices of weights."""
        sigma = data.sigma if weights is None and sigma is None else sigma
        weight, label = choose_weights(data.depth, data.stiffness, weights, sigma)
        sample = StiffnessSample.of(("stiffness", "N/m", data.depth, data.stiffness), weight, label)
        units = {"G": "Pa"} | ({"thickness": "m"} if body.base is not None else {})
        structure = dataclasses.replace(ElasticFilm.of(jc.Elastic, units), nu=body.nu)
        half = body._replace(base=None)
        rigid = np.median(data.stiffness / np.exp(log_stiffness(1.0, 1.0, half._replace(tip=0.0), tip)[0]))
        soft = 1.0 / max(
            1.0 / rigid - body.tip / (1.0 - body.nu), 0.02 / rigid
        )  # without the tip's compliance
        return cls(data.stiffness, body, tip, sample, structure, float(soft))

    def space(self, table: dict[str, tuple[float, float]]) -> ParameterSpace:
        """Return the box of the search for log G and log thickness."""
        middle = [self.start, float(self.tip.radii.max())][: len(table)]
        rows = []
        for name, centre in zip(table, middle, strict=True):
            low, high = table[name]
            unit = np.log(centre)
            with np.errstate(divide="ignore"):
                ends = np.log([low, high])
            reach = (-REACH, REACH) if name == "G" else (-math.log(0.5 * WIDEST), REACH)
            rows.append(ends - unit if low == high else np.clip(ends - unit, *reach))
        return ParameterSpace.of(
            self.structure, np.array(rows), np.ones(len(rows), dtype=bool), np.array(middle)
        )

    def objective(self, space: ParameterSpace, weights: np.ndarray) -> Objective:
        """Return the least-squares objective for weights (n,) [m/N]."""

        @functools.lru_cache(maxsize=4)
        def model(key: bytes) -> tuple[np.ndarray, np.ndarray]:
            theta = np.frombuffer(key)
            values = space.unit * np.exp(theta)
            log, slopes = log_stiffness(values[0], values[1] if values.size > 1 else 1.0, self.body, self.tip)
            found = np.exp(log)
            return found, found[:, None] * slopes[:, : theta.size]

        return Objective(
            lambda theta: weights * (model(theta.tobytes())[0] - self.stiffness),
            lambda theta, free: weights[:, None] * model(theta.tobytes())[1][:, free],
            *space.bounds,
            floor=1e-26 * float(np.sum((weights * self.stiffness) ** 2)),
        )

    def starts(self, space: ParameterSpace) -> list[np.ndarray]:
        """Return coordinates: the modulus of a half-space and several thicknesses."""
        low, high = space.bounds
        if low.size == 1 or low[1] == high[1]:
            return [np.clip(np.zeros(low.size), low, high)]
        return [np.clip([0.0, math.log(thin)], low, high) for thin in THIN]


def no_moves(name: str) -> np.ndarray:
    """Raise ValueError: the change of the parameters with a held quantity is not computed."""
    raise ValueError(f"spread: a fit of a stiffness is conditional on its {name}; fit at other values of it")


def deviation(
    problem: FitProblem, of: Callable[[np.ndarray], Objective], solved: Solved, film: bool
) -> Deviation:
    """Return the systematic deviation of the points from the model; of: objective of weights (n,)."""
    nothing = np.zeros(solved.theta.size)
    found = evidence.Sample.assess(problem.sample, solved, problem.p, problem.level).evidence
    if not found.refused:
        return Deviation(nothing, (), ())
    depth, measured = problem.sample.t, problem.sample.measured
    deep = depth > np.median(depth)
    objective = of(np.where(deep, solved.weights, 0.0))
    change = solved.theta - nonlinear.minimise(objective, solved.theta).theta
    width = max(int(WINDOW * depth.size), 3)
    relative = solved.residual / solved.weights / measured
    trend = float(np.max(np.abs(np.convolve(relative, np.ones(width) / width, mode="valid"))))
    size = f"a trend of {100 * trend:.1f} % of the stiffness"
    stiffer = change[0] > 0
    how = f"is {100 * math.expm1(abs(change[0])):.1f} % {'higher' if stiffer else 'lower'} with the shallow points"
    if trend > TREND or abs(change[0]) > CHANGE:
        return Deviation(
            np.abs(change),
            (f"the residuals have {size}, and the modulus {how}: {_meaning(stiffer, film)}",),
            (),
        )
    note = f"the residuals have {size}; the modulus {how}, which the intervals include: {_meaning(stiffer, film)}"
    return Deviation(np.abs(change), (), (note,))


def _meaning(stiffer: bool, film: bool) -> str:
    """Return what a modulus that depends on the depth may mean, in the words of a user of a nanoindenter."""
    base = "" if film else ", or the base of a film below (give its thickness)"
    if stiffer:
        what = f"a blunt tip (calibrate the area), a hard surface layer, or a soft layer below{base}"
        return f"{what}; leave out shallow depths"
    return f"roughness or a soft surface layer, a contact found too early{base}; leave out shallow depths"


def pointwise(
    stiffness: np.ndarray, G: float, body: Coated, tip: Tip, model: Callable[[float], np.ndarray]
) -> np.ndarray:
    """Return the shear modulus (n,) [Pa] at which the model has each stiffness alone; nan beyond a factor of 100."""
    if body.base is None:
        share = 1.0 - body.nu
        below = 4.0 * tip.beta * tip.radii / stiffness - body.tip
        return np.where(below > 0.0, share / np.where(below > 0.0, below, 1.0), np.nan)
    logs = np.log(G) + np.linspace(-SPREAD, SPREAD, TRIALS)
    table = np.stack([model(float(np.exp(log))) for log in logs])  # (TRIALS, n)
    found = [_inverse(row, logs, at) for row, at in zip(table.T, np.log(stiffness), strict=True)]
    return np.exp(np.array(found))


def _inverse(values: np.ndarray, logs: np.ndarray, at: float) -> float:
    """Return the place where increasing values have a given one, nan outside."""
    known = np.isfinite(values)
    if known.sum() < 3 or not values[known][0] <= at <= values[known][-1]:
        return math.nan
    return float(PchipInterpolator(values[known], logs[known])(at))
