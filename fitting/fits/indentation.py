"""Fit of a material to an indentation curve: a ball on a half-space, or on a film on a substrate."""

import dataclasses
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting.data.indentation import IndentationData
from fitting.data.probe import probe_of
from fitting.inference.conclusion import FitProblem, conclude, solution
from fitting.inference.evidence import Sample
from fitting.inference.result import Fit, plain
from fitting.models.coordinates import NUISANCES, Space
from fitting.models.structure import Sought, Volume, structure_of
from fitting.search import half_space_search, layered_search
from fitting.search.layered import Coating
from fitting.search.press import Found, Instrument, Medium, Press, Pressing, prepare
from fitting.views import report


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class IndentationFit(Fit):
    """The fit of an indentation curve; ``Fit`` has what it shares with other fits.

    Attributes:
        control: "load" or "depth", what drove the model.
        nu or bulk_modulus [Pa] (the other is None), indenter, film: what the moduli are conditional on.
        nuisances: {contact_point [m], drift [m/s], machine_compliance [m/N]: (value, low, high)}.
        kept: (n,) bool, the points fitted, which ``fitted`` and ``residuals`` are of.
        adhesion: the work of it that was given [J/m2], 0 for none.
        slow_edge: {parameter: value} of the same fit with J(t) in place of J(0) at the edge of a contact that sticks,
            the two ends of what the edge may do; {} without adhesion.
        runs: (forward, gradient) evaluations of the model.
        starts: (sought, agreed): minima that were sought, and those as low as this one.
        seconds: for all of the fit.
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
        """As ``Fit.to_dict``, with the nuisances and what the moduli are conditional on."""
        key = lambda name: f"{name}_{NUISANCES[name].replace('/', '_per_')}"
        return super().to_dict() | {
            "control": self.control,
            "nuisances": {key(name): plain(row) for name, row in self.nuisances.items()},
            **probe_of(self.indenter).key, "poisson_ratio": self.nu,
            "bulk_modulus_Pa": self.bulk_modulus,
            "film_thickness_m": plain(self.film.thickness), "adhesion_J_per_m2": self.adhesion,
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
            between = report.span(low, high) if low > 0 else f"{low:.4g} to {high:.4g}"
            lines.append(f"  {name} = {value:.5g} {NUISANCES[name]}, {between}")
        return lines

    def _conditions(self) -> list[str]:
        film, runs = self.film, f"{self.runs[0]} forward and {self.runs[1]} gradient runs"
        sought, agreed = self.starts
        spent = f"  {agreed} of {sought} starts came to this minimum; {runs} in {self.seconds:.3g} s"
        volume = Volume.of(self.nu, self.bulk_modulus)
        if self.adhesion:
            slow = ", ".join(f"{name} = {value:.5g}" for name, value in self.slow_edge.items())
            return [
                f"  the moduli are conditional on {volume}, a half-space, {self.adhesion:g} J/m2 and an edge that closes"
                " at once (JKR)",
                f"  were the edge as slow as the test: {slow}",
                spent,
            ]
        if film.thickness is None:
            return [f"  the moduli are conditional on {volume} and a half-space", spent]
        bias = ", ".join(f"{name} {value:.2g}" for name, value in film.bias.items())
        n, m = film.grid.shape
        return [
            f"  the moduli are conditional on thickness = {film.thickness:.4g} m and {volume}, "
            "from which a wide contact cannot tell them apart",
            f"  grid {n} x {m}; discretisation bias over standard error, within the intervals: {bias}",
            spent,
        ]


def fit_indentation(
    data: IndentationData,
    model: type | str = jc.Burgers,
    *,
    indenter: Any,
    nu: float | None = None,
    bulk_modulus: float | None = None,
    tau: Any = None,
    control: str = "load",
    weights: str | None = None,
    sigma: Any = None,
    fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None,
    contact_point: float | str = 0.0,
    drift: float | str = 0.0,
    machine_compliance: float | str = 0.0,
    rise: float | None = None,
    adhesion: float = 0.0,
    layer: float | None = None,
    layers: Sequence[Any] | None = None,
    substrate: Any = None,
    grid: Any = None,
    level: float = 0.95,
) -> IndentationFit:
    """Fit a material to the indentation of a half-space, or of a film on a substrate, by a ball, cone or punch.

    The measured history itself is in the hereditary integral (Lee and Radok; Ting where the depth falls
    after one maximum). Times count from the first sample, at which load and depth may step on. With a
    ``layer`` the contact solver is the forward model.

    Args:
        data: the curve, n points.
        model: a material class or its name.
        indenter: a ``jc.Sphere``, ``jc.Cone`` (``jc.Cone.berkovich()``) or, on a half-space, ``jc.FlatPunch``, elastic
            or rigid.
        nu: Poisson's ratio of the material, held; or
        bulk_modulus: [Pa], held, of an elastic response in volume, while the shear creeps.
        tau: retardation times (k,) [s] of ``jc.Prony``, which needs them.
        control: what drives the model and is not fitted: "load", under which the contact must grow, or "depth".
        weights: "absolute" (one error for all points; the default without a sigma), "relative" or "estimated".
        sigma: in place of weights, the standard deviation of depth [m] or load [N], a number or (n,); that of the
            data where they have one.
        fixed: {parameter: value} [Pa, Pa s, or SI of a series] of any subset.
        bounds: {parameter: (low, high)} of any subset, None for an open side.
        contact_point: in the measured depth [m], a number that is known or "fit".
        drift: likewise [m/s].
        machine_compliance: likewise [m/N].
        rise: put a load that rises linearly for so long [s] and is then held in place of the measured one,
            for comparison with papers (M. L. Oyen, J. Mater. Res. 20 (2005) 2094; 0 is the step); later
            points are fitted.
        adhesion: work of adhesion [J/m2], known, of a ball that sticks to a half-space: Johnson, Kendall and Roberts
            with the hereditary integral, for a contact that grows, from the jump into contact at the first sample on
            (``fitting/models/adhesion.py`` derives it). The edge is taken to close at once; ``slow_edge`` has the
            parameters if it is slow.
        layer: thickness [m] of a film of the material.
        layers: in place of ``layer``, all layers from the top: one thickness [m], that of the material, and known
            ``jc.Layer`` and ``jc.Graded`` above and below it.
        substrate: the known material under it, elastic or not.
        grid: ``jc.Grid`` for the film, square, or the number of its cells along a side, n x n cells as wide as the
            contact needs; else both are chosen so that what discretisation does to the parameters is below a fifth
            of their standard errors or a thousandth of themselves. Samples at which the contact is fewer than 4
            cells across are not fitted, and a note says how many.
        level: of the intervals.

    Returns:
        The material with its intervals, how well the data determine it, and what it is conditional on.

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
    structure = structure_of(model, tau)
    sought = Sought.of(structure, fixed, bounds, nu, bulk_modulus)
    control = control.lower() if isinstance(control, str) else control
    film = any(given is not None for given in (layer, layers, substrate, grid))
    pressing = Pressing(indenter, control, rise, adhesion, film)
    instrument = Instrument(contact_point, drift, machine_compliance)
    press = prepare(data, sought, pressing, instrument, weights, sigma)
    problem = FitProblem(data, sought, press.space, _sample(press), press.units.duration, level)
    if film:
        _check_layered(press.pressing)
        found = layered_search.search(press, Coating.of(layer, layers, substrate), grid)
    else:
        found = half_space_search.search(press)
    return _concluded(problem, found, started)


def _check_layered(pressing: Pressing) -> None:
    if pressing.rise is not None:
        raise ValueError(f"rise: expected None with a layer, got {pressing.rise!r}")
    if pressing.adhesion:
        raise ValueError(f"adhesion: expected none with a layer, got {pressing.adhesion:g} J/m2")


def _concluded(problem: FitProblem, found: Found, started: float) -> IndentationFit:
    """Return the fit from the optimum."""
    press, best, objective = found.press, found.best, found.objective
    problem = dataclasses.replace(problem, space=press.space, sample=_sample(press))
    solved = solution(objective, best, problem.sample.weights, press.kept)._replace(
        notes=found.notes, moves=found.moves, left=found.medium.left, against=found.against,
        landscape=found.residual and press.space.landscape(best.theta, found.residual),
    )  # fmt: skip
    concluded, pressing = conclude(problem, solved), press.pressing
    return concluded.fit(
        IndentationFit, indenter=pressing.indenter, **press.sought.volume.keyword, control=pressing.control,
        film=found.medium, nuisances=_nuisances(press.space, best.theta, concluded.ends), kept=press.kept,
        adhesion=pressing.adhesion, slow_edge=_slow(found), starts=(best.starts, best.agreed),
        runs=(objective.residual_runs, objective.jacobian_runs), seconds=time.perf_counter() - started,
    )  # fmt: skip


def _sample(press: Press) -> Sample:
    """What is fitted, in SI; the segments of the curve are series of their own."""
    unit = press.units.depth if press.pressing.control == "load" else press.units.load
    marks = press.data.segments
    series = np.cumsum(np.append(False, marks[1:] != marks[:-1]))
    curve = (*press.pressing.response, press.data.t, press.measured * unit)
    return Sample.of(curve, press.weights / unit, press.label, series)


def _slow(found: Found) -> dict[str, float]:
    """{parameter: value} in SI of the fit with a slow edge."""
    if found.slow is None:
        return {}
    space = found.press.space
    values = space.opened(found.slow.theta) * space.unit[space.material]
    return {name: float(value) for name, value in space.structure.parameters(values).items()}


def _nuisances(space: Space, theta: np.ndarray, ends: np.ndarray) -> dict[str, tuple[float, float, float]]:
    """(value, low, high) in SI of those that were fitted."""
    low, high = ends.T
    rows = np.stack([space.to_si(vector) for vector in (theta, low, high)], -1)
    fitted = [i for i in space.free if not space.material[i]]
    return {space.names[i]: tuple(rows[i].tolist()) for i in fitted}
