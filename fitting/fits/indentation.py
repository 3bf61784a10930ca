"""Fit of a material to the indentation curve of a half-space, a thin sample, or a film on a substrate."""

import dataclasses
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting.data.indentation import IndentationData
from fitting.data.probe import paraboloid_note, probe_of
from fitting.fits.adhesion import (
    AdhesiveChoices,
    AdhesiveFit,
    body_of,
    check_fitted,
    check_none,
    check_side,
    fit_adhesive,
    is_fitted,
    is_law,
)
from fitting.fits.adhesion_creep import fit_creeping_film
from fitting.inference.conclusion import FitProblem, conclude, solution
from fitting.inference.evidence import Sample, Solved, settled
from fitting.inference.result import Fit, plain
from fitting.models import thin_layer
from fitting.models.coordinates import NUISANCES, Space
from fitting.models.structure import Sought, Volume, structure_of
from fitting.search import half_space_search, layered_search
from fitting.search.layered import Coating
from fitting.search.nonlinear import Best, Objective
from fitting.search.press import Found, IndentationProblem, Instrument, Medium, Pressing, prepare
from fitting.views import report


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
        spent = f"  {agreed} of {sought} starts converged to this minimum; {runs} in {self.seconds:.3g} s"
        volume = Volume.of(self.nu, self.bulk_modulus)
        if self.adhesion:
            slow = ", ".join(f"{name} = {value:.5g}" for name, value in self.slow_edge.items())
            return [
                f"  the moduli are conditional on {volume}, a half-space, {self.adhesion:g} J/m2 and the"
                " instantaneous compliance at the edge (JKR)",
                f"  with the relaxed compliance at the edge: {slow}",
                spent,
            ]
        if film.thickness is not None and film.grid is None:
            body = f"a layer of {film.thickness:.4g} m bonded to a rigid base"
            return [f"  the moduli are conditional on {volume} and {body}", spent]
        if film.thickness is None:
            return [f"  the moduli are conditional on {volume} and a half-space", spent]
        bias = ", ".join(f"{name} {value:.2g}" for name, value in film.bias.items())
        n, m = film.grid.shape
        return [
            f"  the moduli are conditional on thickness = {film.thickness:.4g} m and {volume}, "
            "which a wide contact does not determine separately",
            f"  grid {n} x {m}; discretisation bias over standard error, within the intervals: {bias}",
            spent,
        ]


def fit_indentation(
    data: IndentationData, model: type | str = jc.Burgers, *, indenter: Any, nu: float | None = None,
    bulk_modulus: float | None = None, tau: Any = None, control: str = "load", weights: str | None = None,
    sigma: Any = None, fixed: dict[str, float] | None = None, bounds: dict[str, tuple] | None = None,
    contact_point: float | str = 0.0, drift: float | str = 0.0, machine_compliance: float | str = 0.0,
    rise: float | None = None, adhesion: Any = 0.0, layer: float | None = None, layers: Sequence[Any] | None = None,
    substrate: Any = None, grid: Any = None, thickness: float | None = None, level: float = 0.95,
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
        indenter: a ``jc.Sphere``, ``jc.Cone`` (``jc.Cone.berkovich()``) or, on a half-space, ``jc.FlatPunch``, elastic
            or rigid.
        nu: Poisson's ratio of the material, held constant; or
        bulk_modulus: constant bulk modulus [Pa] of an elastic response in volume, while the shear creeps.
        tau: retardation times (k,) [s]; required for ``jc.Prony``.
        control: the measured quantity that is prescribed and therefore not fitted: "load", under which the contact must
            grow, or "depth".
        weights: "absolute" (one error for all points; the default without a sigma), "proportional", "relative" or
            "estimated" (errors a + b y of the response y, estimated from the data and then from the residuals).
        sigma: in place of weights, the standard deviation of depth [m] or load [N], a number or (n,); by default the
            standard deviation that the data carry, if any.
        fixed: {parameter: value} [Pa, Pa s, or the SI unit of a series] of any subset.
        bounds: {parameter: (low, high)} of any subset, None for an open side.
        contact_point: offset of the measured depth [m], a known number or "fit".
        drift: drift of the measured depth [m/s], a known number or "fit".
        machine_compliance: compliance of the instrument [m/N], a known number or "fit".
        rise: replace the measured load by one that rises linearly for this time [s] and is then held constant, for
            comparison with papers (M. L. Oyen, J. Mater. Res. 20 (2005) 2094; 0 is a step); only later points are
            fitted, and no history before the first point is used.
        adhesion: of an adhesive ball; a known work of adhesion [J/m2] on a half-space: the theory of Johnson, Kendall and
            Roberts with the hereditary integral, for a growing contact, from the jump into contact at the first sample
            (derived in ``fitting/models/adhesion.py``). The edge is assumed to respond with the instantaneous
            compliance; ``slow_edge`` holds the parameters for the opposite limit. "fit": the work of adhesion and the
            strength of the attraction are parameters of an elastic half-space (``model="Elastic"``), for approach and
            retraction under ``control="depth"`` (D. Maugis, J. Colloid Interface Sci. 150 (1992) 243); "JKR": the same
            for an attraction of short range, also on an elastic film (``layer=`` a thickness, ``substrate=`` an
            ``Elastic``; ``fitting/models/adhesive_film.py``); ``bounds`` of G must say whether it is softer or stiffer.
            A law of adhesion (``jc.ExponentialAdhesion(work, range)`` or ``jc.DugdaleAdhesion``): material and work of a
            film that creeps on an elastic base, with the range or strength of the law held and its work as the start, for
            approach, dwell and retraction by the contact solver (``fitting/search/creeping_film_search.py``), in minutes;
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
    if is_fitted(adhesion):
        film = layer is not None or substrate is not None
        others = {"tau": tau, "rise": rise, "layers": layers, "grid": grid, "thickness": thickness}
        instrument = Instrument(contact_point, drift, machine_compliance)
        choices = AdhesiveChoices(instrument, weights, sigma, fixed, bounds, level)
        check_none(others | {"bulk_modulus": bulk_modulus})
        if is_law(adhesion):
            return fit_creeping_film(
                data, adhesion, (model, control), (indenter, nu, layer, substrate), choices
            )
        check_fitted(adhesion, model, film, control)
        body = body_of(indenter, nu, layer, substrate)
        check_side(body, choices)
        return fit_adhesive(data, adhesion, body, choices)
    structure = structure_of(model, tau)
    sought = Sought.of(structure, fixed, bounds, nu, bulk_modulus)
    control = control.lower() if isinstance(control, str) else control
    film = any(given is not None for given in (layer, layers, substrate, grid))
    if thickness is not None:
        _check_thin(thickness, sought.volume, indenter, film, adhesion)
    pressing = Pressing(indenter, control, rise, adhesion, film, thickness)
    instrument = Instrument(contact_point, drift, machine_compliance)
    press = prepare(data, sought, pressing, instrument, weights, sigma)
    problem = FitProblem(press.data, sought, press.space, _sample(press), press.units.duration, level)
    if film:
        _check_layered(press.pressing)
        found = layered_search.search(press, Coating.of(layer, layers, substrate), grid, _reweighed)
    else:
        found = _half_space(press)
    return _concluded(problem, found, started)


def _check_layered(pressing: Pressing) -> None:
    if pressing.rise is not None:
        raise ValueError(f"rise: expected None with a layer, got {pressing.rise!r}")
    if pressing.adhesion:
        raise ValueError(f"adhesion: expected none with a layer, got {pressing.adhesion:g} J/m2")


def _check_thin(thickness: float, volume: Volume, indenter: Any, film: bool, adhesion: float) -> None:
    """Raise ValueError unless a layer on a rigid base can be fitted with these."""
    if film or adhesion:
        raise ValueError(
            "thickness: expected no layer, layers, substrate, grid or adhesion beside it, got some"
        )
    if volume.name != "nu":
        raise ValueError(f"bulk_modulus: expected nu with a thickness, got {volume.value:g} Pa")
    if getattr(indenter, "material", None) is not None:
        raise ValueError("indenter: expected a rigid one on a thin layer, got one with a material")
    thin_layer.check(thickness, volume.value)


def _half_space(press: IndentationProblem) -> Found:
    """Return the optimum on a half-space, with weights that are consistent with it."""
    sample, unit = _sample(press), _response_unit(press)

    def again(changed: list[np.ndarray]) -> list[Solved]:
        own = press._replace(weights=np.where(press.kept, changed[0] * unit, 0.0))
        found = half_space_search.search(own)
        return [solution(found.objective, found.best, changed[0], press.kept)._replace(whole=found)]

    # points that are not fitted have a weight for the reweighting alone
    first = np.where(press.kept, sample.weights, sample.weights.max())
    return settled([sample], again([first]), again, press.space.free.size)[0].whole


def _concluded(problem: FitProblem, found: Found, started: float) -> IndentationFit:
    """Return the fit that follows from the optimum of the search."""
    press, best, objective = found.press, found.best, found.objective
    problem = dataclasses.replace(problem, space=press.space, sample=_sample(press))
    solved = solution(objective, best, problem.sample.weights, press.kept)._replace(
        notes=(*found.notes, *_curvature(press, best.theta)), moves=found.moves, left=found.medium.left,
        against=found.against,
        landscape=found.residual and press.space.landscape(best.theta, found.residual),
    )  # fmt: skip
    concluded, pressing = conclude(problem, solved), press.pressing
    return concluded.fit(
        IndentationFit, indenter=pressing.indenter, **press.sought.volume.keyword, control=pressing.control,
        film=found.medium, nuisances=_nuisances(press.space, best.theta, concluded.ends), kept=press.kept,
        adhesion=pressing.adhesion, slow_edge=_slow(found), starts=(best.starts, best.agreed),
        runs=(objective.residual_runs, objective.jacobian_runs), seconds=time.perf_counter() - started,
    )  # fmt: skip


def _reweighed(press: IndentationProblem, best: Best, objective: Objective) -> np.ndarray:
    """Return the scaled weights (n,) that follow from the optimum on a film, 0 for points that are not fitted."""
    sample, on = _sample(press), press.kept
    if not sample.adjustable:
        return press.weights
    some = {name: getattr(sample, name)[on] for name in ("t", "measured", "weights", "blocks")}
    solved = solution(objective, best, sample.weights, on).some(on)
    weights = np.zeros(on.size)
    weights[on] = sample._replace(**some).reweighed(solved, press.space.free.size) * _response_unit(press)
    return weights


def _sample(press: IndentationProblem) -> Sample:
    """Return the fitted curve in SI units; each segment of the curve is a separate series."""
    unit, marks = _response_unit(press), press.data.segments
    series = np.cumsum(np.append(False, marks[1:] != marks[:-1]))
    curve = (*press.pressing.response, press.data.t, press.measured * unit)
    return Sample.of(curve, press.weights / unit, press.label, series)


def _curvature(press: IndentationProblem, theta: np.ndarray) -> tuple[str, ...]:
    """Return a note on a ball that is not a paraboloid; with adhesion there is one by the contact radius."""
    place = press.space.names.index("contact_point")
    deepest = float(press.data.depth[press.kept].max() - press.space.to_si(theta)[place])
    return (
        ()
        if press.pressing.adhesion
        else paraboloid_note(press.pressing.indenter, deepest, thickness=press.pressing.thickness)
    )


def _response_unit(press: IndentationProblem) -> float:
    """Return the unit of the fitted quantity [m] or [N]."""
    return press.units.depth if press.pressing.control == "load" else press.units.load


def _slow(found: Found) -> dict[str, float]:
    """Return {parameter: value} in SI units of the fit with the relaxed compliance at the edge, {} without adhesion."""
    if found.slow is None:
        return {}
    space = found.press.space
    values = space.opened(found.slow.theta) * space.unit[space.material]
    return {name: float(value) for name, value in space.structure.parameters(values).items()}


def _nuisances(space: Space, theta: np.ndarray, ends: np.ndarray) -> dict[str, tuple[float, float, float]]:
    """Return {name: (value, low, high)} in SI units of the nuisance parameters that were fitted."""
    low, high = ends.T
    rows = np.stack([space.to_si(vector) for vector in (theta, low, high)], -1)
    fitted = [i for i in space.free if not space.material[i]]
    return {space.names[i]: tuple(rows[i].tolist()) for i in fitted}
