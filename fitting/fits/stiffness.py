"""Fit of a modulus, and of the thickness of a film, to the contact stiffness over depth."""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

import jaxcontact as jc
from fitting.data.curves import check_kind
from fitting.data.indentation import STIFFNESS, check_depth, paraboloid_note, probe_of
from fitting.data.stiffness import StiffnessData
from fitting.data.weights import choose_weights
from fitting.inference import verdict
from fitting.inference.result import ElasticFit, FitProblem, conclude, least_squares, no_moves
from fitting.inference.sample import Deviation, Sample, Solved, judged_by_size
from fitting.models.parameters import Parameters
from fitting.models.structure import ParameterList, Sought, limits
from fitting.models.thin_layer import Base, check_unbonded, contact_factors
from fitting.search import nonlinear
from fitting.search.nonlinear import Objective
from fitting.views import sheet, text

# Stiffness dF/d depth of an elastic contact with a half-space or with a layer bonded to a base.
#
# On a half-space S = 4 G a/(1 - nu) at the contact radius a (G. M. Pharr, W. C. Oliver, F. R. Brotzen, J. Mater. Res.
# 7 (1992) 613), and on a layer that times the factor of a flat punch of the radius a (``models/thin_layer.py``), for
# any tip of revolution, also after plastic flow. An elastic tip adds (1 - nu)/G to the compliance at every
# wavenumber.
#
# The contact radius follows from the depth d of an elastic contact, on a half-space a^2 = R d of a ball and a =
# (2/pi) d tan(half-angle) of a cone, or from the contact depth of W. C. Oliver, G. M. Pharr (J. Mater. Res. 7 (1992)
# 1564),
#
#     h_c = d - epsilon load/S,     pi a^2 = A(h_c).


WIDEST = 20.0  # contact radius over the thickness
NODES = 48  # contact radii that are solved
ROOM = (0.4, 2.0)  # factors by which their range exceeds that of a contact with a half-space
STEP = 1e-30  # of log G, imaginary
KINDS = {jc.Sphere: "ball", jc.Cone: "cone", jc.FlatPunch: "punch"}


@dataclasses.dataclass(frozen=True, eq=False)
class Tip:
    """The tip and the points at which it is in contact.

    indenter; kind: "ball", "cone" or "punch"; places (n,): depths [m] of an elastic contact, or contact radii [m];
    known: whether they are radii; beta: factor on the stiffness of a tip that is not of revolution.
    """

    indenter: Any
    kind: str
    places: np.ndarray
    known: bool
    beta: float

    @property
    def radii(self) -> np.ndarray:
        """Contact radii (n,) [m], on a half-space where they are not known."""
        if self.known or self.kind == "punch":
            return self.places
        if self.kind == "ball":
            return np.sqrt(float(self.indenter.radius) * self.places)
        return 2.0 / np.pi * self.places * math.tan(float(self.indenter.half_angle))

    @property
    def power(self) -> float:
        """Power of the thickness in the place of a given ratio of contact radius and thickness."""
        return 2.0 if self.kind == "ball" and not self.known else 1.0

    def place(self, found: dict[str, tuple[complex, complex]], ratio: float, thickness: float) -> complex:
        """Return the place at a contact radius over the thickness, from its ``contact_factors``."""
        if self.known or self.kind == "punch":
            return ratio * thickness
        chi = found[self.kind][0]
        if self.kind == "ball":
            return (chi * thickness) ** 2 / float(self.indenter.radius)
        return chi * thickness / math.tan(float(self.indenter.half_angle))


class Coated(NamedTuple):
    """The indented body: Poisson's ratio, and the modulus [Pa] and Poisson's ratio of the base of a layer.

    base: None for a half-space, inf for a rigid base; tip: compliance (1 - nu)/G of the tip [1/Pa]; bonded: False for a
    layer that slides on its base.
    """

    nu: float
    base: float | None
    base_nu: float
    tip: float
    bonded: bool = True


def log_stiffness(G: float, thickness: float, body: Coated, tip: Tip) -> tuple[np.ndarray, np.ndarray]:
    """Return log S [N/m] at the places (n,), and its derivatives (n, 2) with respect to log G and log thickness; nan
    where the contact is wider than ``WIDEST`` thicknesses."""
    own = G / (1.0 - body.nu) * body.tip
    if body.base is None:
        log = np.log(4.0 * tip.beta * G * tip.radii / ((1.0 - body.nu) * (1.0 + own)))
        return log, np.stack([np.full(log.size, 1.0 / (1.0 + own)), np.zeros(log.size)], -1)
    place, stiffness = _nodes(G, thickness, body, tip)
    x, order = place.real, np.argsort(place.real)
    value = CubicSpline(x[order], stiffness.real[order], extrapolate=False)
    rise = value(x, 1)
    moved = (stiffness.imag - rise * place.imag) / STEP
    at = np.log(tip.places)
    by_G = CubicSpline(x[order], moved[order], extrapolate=False)(at)
    return value(at), np.stack([by_G, 1.0 - tip.power * value(at, 1)], -1)


def _nodes(G: float, thickness: float, body: Coated, tip: Tip) -> tuple[np.ndarray, np.ndarray]:
    """Return the logarithms of place and stiffness at ``NODES`` contact radii, with a complex step of log G."""
    own = G * (1.0 + 1j * STEP)
    share = (1.0 - body.nu) / own
    assert body.base is not None
    ratio = own / body.base if math.isfinite(body.base) else 0.0
    base = Base(ratio, body.base_nu, body.tip / share, body.bonded)
    ends = np.array([tip.radii.min(), tip.radii.max()]) / thickness * ROOM
    ratios = np.geomspace(ends[0], min(ends[1], WIDEST), NODES)
    found = [contact_factors(ratio, body.nu, base) for ratio in ratios]
    places = [tip.place(one, ratio, thickness) for one, ratio in zip(found, ratios, strict=True)]
    factor = np.array([one["punch"][1] for one in found])
    stiffness = 4.0 * tip.beta * ratios * thickness * factor / (share * (1.0 + base.tip))
    return np.log(np.array(places, dtype=complex)), np.log(stiffness)


def contact_area(coefficients: Sequence[float], depth: np.ndarray) -> np.ndarray:
    """Return the area function c0 d^2 + c1 d + c2 d^(1/2) + c3 d^(1/4) + ... [m2] at contact depths (n,) [m]."""
    powers = np.append(2.0, 2.0 ** -np.arange(len(coefficients) - 1.0))
    return np.asarray(depth[:, None] ** powers @ np.asarray(coefficients, dtype=float))


# Search for modulus and thickness from a contact stiffness over depth, and the judgement of its residuals.


REACH = math.log(1e4)  # of log G and of log thickness about their starting values
REACHES = (-REACH, REACH), (-math.log(0.5 * WIDEST), REACH)
THIN = (1.0, 0.3, 3.0, 10.0)  # starting thicknesses over the largest contact radius
# of log G from the deeper half to all points, and of the stiffness: beyond them, rejection
CHANGE, TREND = 0.2, 0.1
SPREAD = math.log(100.0)  # of the moduli of single points about that of all
TRIALS = 13  # moduli at which the stiffness is computed for these


@dataclasses.dataclass(frozen=True, eq=False)
class ElasticFilm(ParameterList):
    """The modulus of an elastic half-space or film, and the thickness of the film."""

    nu: float = 0.3

    def material(self, values: dict[str, Any], volume: Any) -> Any:
        """Return the elastic material."""
        return jc.Elastic(values["G"], self.nu if volume is None else volume.value)


def deviation(
    problem: FitProblem, of: Callable[[np.ndarray], Objective], solved: Solved, film: bool
) -> Deviation:
    """Return the systematic deviation of the points from the model; of: objective of weights (n,)."""
    depth, measured = problem.sample.t, problem.sample.measured

    def refits() -> list[np.ndarray]:
        """Return the fit to the deeper half of the points."""
        objective = of(np.where(depth > np.median(depth), solved.weights, 0.0))
        return [nonlinear.minimise(objective, solved.theta).theta]

    def words(trend: float, changes: np.ndarray, rejected: bool) -> str:
        """Return the size of the trend and of the change with its meaning, in the words of a user of a nanoindenter."""
        change = float(changes[0, 0])
        base = "" if film else ", or the base of a film below (give its thickness)"
        if change > 0:
            way = "higher"
            meaning = f"a blunt tip (calibrate the area), a hard surface layer, or a soft layer below{base}"
        else:
            way, meaning = "lower", f"roughness or a soft surface layer, a contact found too early{base}"
        said = f"the modulus is {100 * abs(math.expm1(change)):.1f} % {way} with the shallow points"
        size = f"the residuals have a trend of {100 * trend:.1f} % of the stiffness"
        said = f"{size}, and {said}" if rejected else f"{size}; {said}, which the intervals include"
        return f"{said}: {meaning}; leave out shallow depths"

    trend = lambda: verdict.trend(solved.residual / solved.weights / measured)
    log_modulus = lambda theta: theta[:1]
    return judged_by_size(problem, solved, trend, refits, log_modulus, (TREND, CHANGE), words)


def pointwise(
    stiffness: np.ndarray, G: float, body: Coated, tip: Tip, model: Callable[[float], np.ndarray]
) -> np.ndarray:
    """Return the shear modulus (n,) [Pa] at which the model has each stiffness alone; nan beyond a factor of 100."""
    # the modulus on a half-space has a closed form
    if body.base is None:
        share = 1.0 - body.nu
        below = 4.0 * tip.beta * tip.radii / stiffness - body.tip
        return np.where(below > 0.0, share / np.where(below > 0.0, below, 1.0), np.nan)
    logs = np.log(G) + np.linspace(-SPREAD, SPREAD, TRIALS)
    table = np.stack([model(float(np.exp(log))) for log in logs])  # (TRIALS, n)
    found = np.full(stiffness.size, np.nan)
    for i, (values, at) in enumerate(zip(table.T, np.log(stiffness), strict=True)):
        known = np.isfinite(values)  # and increasing
        if known.sum() >= 3 and values[known][0] <= at <= values[known][-1]:
            found[i] = PchipInterpolator(values[known], logs[known])(at)
    return np.exp(found)


CONTACTS = ("elastic", "oliver-pharr", "stated")
LEAST = 5  # fewest points of a fit
APART = 2.0  # factor from the modulus that the instrument states beyond which a fit is rejected


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StiffnessFit(ElasticFit):
    """The fit of a contact stiffness over depth; ``ElasticFit`` and ``Fit`` have what it shares with other fits.

    Its parameter is the shear modulus "G" [Pa] of the sample or of its film and, where it was fitted, the "thickness" [m],
    which is then also the attribute ``thickness``.

    Attributes:
        contact: the kind of contact, on which the modulus is conditional.
        radii (n,): contact radii [m], those of a half-space in an elastic contact.
        moduli (n,): Young's modulus [Pa] that each point would give alone, nan where none does.
        apparent (n,): the same on a half-space without a base.
    """

    contact: str
    radii: np.ndarray
    moduli: np.ndarray
    apparent: np.ndarray

    def plot(self, path: Any = None) -> Any:
        """Return a figure of stiffness and modulus over depth, and of the residuals; saved where a path is given."""
        _, unit, depth, measured = self.curve
        E, low, high = self.youngs_modulus

        def panel(top: Any, bottom: Any) -> None:
            order = np.argsort(depth)
            top.plot(depth, measured, ".", markersize=3, color="0.4", label="data")
            top.plot(depth[order], self.fitted[order], label="model")
            top.set_ylabel(f"contact stiffness [{unit}]")
            bottom.plot(depth, 100.0 * (measured / self.fitted - 1.0), ".", markersize=3, color="0.4")
            bottom.set_ylabel("residual [%]")
            sheet.axis_label(bottom.xaxis, "depth", "m", depth)

        def moduli(axes: Any) -> None:
            """Plot the modulus of single depths, and that of the fit with its interval."""
            if self.thickness is not None:
                axes.plot(depth, self.apparent, ".", markersize=3, color="0.7", label="with the base")
            axes.plot(depth, self.moduli, ".", markersize=3, color="0.4", label="of single depths")
            axes.axhline(E, label="of all depths")
            if np.isfinite(high):
                axes.axhspan(low, high, alpha=0.3, label=f"{100 * self.level:g} % interval")
            axes.set_ylim(0.0, min(1.2 * np.nanmax([E, *self.moduli, *self.apparent]), 5.0 * E))
            sheet.axis_label(axes.xaxis, "depth", "m", depth)
            sheet.axis_label(axes.yaxis, "Young's modulus", "Pa", np.array([E]))
            axes.legend()

        return sheet.draw(self, path, panel, (moduli,))

    def to_dict(self) -> dict[str, Any]:
        """Return ``ElasticFit.to_dict`` with the kind of contact."""
        return super().to_dict() | {"contact": self.contact}

    def _combination_lines(self) -> list[str]:
        lines = super()._combination_lines()
        known = self.moduli[np.isfinite(self.moduli)]
        if known.size:
            spread = np.percentile(known, [10, 50, 90])
            lines.append(
                "  E of single depths: {1:.4g} Pa (median), {0:.4g} to {2:.4g} (80 % of them)".format(*spread)
            )
        return lines

    def _conditions(self) -> list[str]:
        body = text.layer(self.thickness, self.unbonded, self.substrate, "film")
        return [f"  the modulus is conditional on nu = {self.nu:.4g}, {body} and an {self.contact} contact"]


def fit_stiffness(
    data: StiffnessData, *, indenter: Any, nu: float = 0.3, thickness: float | str | None = None, substrate: Any = None,
    unbonded: bool = False, contact: str | None = None, area: Sequence[float] | None = None, epsilon: float = 0.75,
    beta: float = 1.0, weights: str | None = None, sigma: Any = None, bounds: dict[str, tuple] | None = None,
    level: float = 0.95,
) -> StiffnessFit:  # fmt: skip
    """Fit the modulus of a half-space or of a film, and the thickness of the film, to a contact stiffness over depth.

        S = beta 4 G a f(a/h)/(1 - nu)

    with the contact radius a, and the exact factor f of a film of thickness h bonded to an elastic or rigid base (1 on a
    half-space); derived in ``fitting/fits/stiffness.py``. The compliance of an elastic indenter is included.
    Where the residuals have a trend, the intervals include the change of the parameters from the deeper half of the
    points to all points, and the fit is rejected where that exceeds 22 % of the modulus or the trend 10 % of the stiffness.
    A modulus that the instrument states is printed beside that of the same points on a half-space, and the fit is rejected
    where they differ by more than a factor of two.

    Args:
        data: stiffness over depth, and the load for ``contact="oliver-pharr"``.
        indenter: ``jc.Sphere``, ``jc.Cone`` (``jc.Cone.berkovich()``) or ``jc.FlatPunch``, rigid or of an elastic
            material.
        nu: Poisson's ratio of the sample.
        thickness: of a film [m], or "fit" to fit it; None: a half-space.
        substrate: the ``jc.Elastic`` material below the film; None: a rigid base.
        unbonded: whether the film slides on the base without friction (and does not lift off) instead of being bonded.
        contact: "elastic", the contact radius of an elastic sample at each depth (the default for a ball and a punch), or
            "oliver-pharr", that of the contact depth (the default for a cone, under which most samples yield), or "stated",
            that of the contact area in the data (the default where they have it and no ``area`` is given).
        area: coefficients c0, c1, c2, ... [SI] of the area function c0 d^2 + c1 d + c2 d^(1/2) + c3 d^(1/4) + ... of the
            tip, for "oliver-pharr"; by default that of the ideal indenter.
        epsilon: of the contact depth d - epsilon load/S.
        beta: factor on the stiffness of a tip that is not of revolution; instruments often use 1.034 for Berkovich.
        weights: "estimated" (the default without standard deviations), "proportional", "relative" or "absolute".
        sigma: in its place, the standard deviation of the stiffness [N/m], a number or (n,).
        bounds: {"G": (low, high), "thickness": (low, high)} of any subset, None for an open side.
        level: confidence level of the intervals.

    Returns:
        The modulus with its interval, the modulus of each depth, and how well the model describes the curve.

    Raises:
        ValueError: bad values, no load for a contact depth, no area for a stated one, or a contact wider than 20
            thicknesses; the message has the depth up to which the film can be used.

    Example:
        >>> depth = np.linspace(2e-8, 4e-7, 40)
        >>> S = 2.0 * 50e9 / (1 - 0.3**2) * np.sqrt(5e-6 * depth)  # E = 50 GPa, R = 5 um
        >>> fit = fitting.fit_stiffness(fitting.StiffnessData(depth=depth, stiffness=S), indenter=jc.Sphere(5e-6))
        >>> print(f"{fit.youngs_modulus[0]:.4g} Pa")
        5e+10 Pa
    """
    check_kind(data, StiffnessData)
    weights = "estimated" if weights is None and sigma is None and data.sigma is None else weights
    sigma = data.sigma if weights is None and sigma is None else sigma
    check_unbonded(unbonded, thickness)
    check_depth(indenter, float(data.depth.max()))
    body = _body(indenter, nu, thickness, substrate)._replace(bonded=not unbonded)
    tip = _tip(data, indenter, contact, area, epsilon, beta)
    depth, stiffness, widest = data.depth, data.stiffness, float(tip.radii.max())
    weight, label = choose_weights(depth, stiffness, weights, sigma)
    sample = Sample.of(("stiffness", "N/m", depth, stiffness), weight, label, own_trends=True)

    # The starting modulus is that of a half-space, without the compliance of the tip.
    half = body._replace(base=None)
    rigid = np.median(stiffness / np.exp(log_stiffness(1.0, 1.0, half._replace(tip=0.0), tip)[0]))
    start = float(1.0 / max(1.0 / rigid - body.tip / (1.0 - nu), 0.02 / rigid))
    if body.base is not None and thickness != "fit":
        wide = ~np.isfinite(log_stiffness(start, float(thickness), body, tip)[0])
        fine = depth[depth < depth[wide].min(initial=np.inf)]
        what = f"expected a contact of at most {WIDEST:g} thicknesses, got one of {widest / float(thickness):.3g}"
        if wide.any() and fine.size < LEAST:
            raise ValueError(
                f"thickness: {what}: the film is too thin for these depths; without it the sample is a half-space"
            )
        if wide.any():
            raise ValueError(
                f"thickness: {what}: window=(None, {fine.max():.4g}) keeps the depths at which the film can be used; without"
                " it the sample is a half-space"
            )

    # The search for log G and log thickness over their starting values.
    units = {"G": "Pa"} | ({"thickness": "m"} if body.base is not None else {})
    structure = dataclasses.replace(ElasticFilm.of(jc.Elastic, units), nu=nu)
    fixed = {} if isinstance(thickness, str) or thickness is None else {"thickness": thickness}
    sought = Sought(structure, limits(structure, fixed, bounds), None)
    unit, rows = np.array([start, widest][: len(units)]), []
    for (low, high), own, reach in zip(sought.table.values(), unit, REACHES, strict=False):
        with np.errstate(divide="ignore"):
            ends = np.log([low, high]) - np.log(own)
        rows.append(ends if low == high else np.clip(ends, *reach))
    space = Parameters.of(structure, rows, unit=unit, logarithmic=True)
    lower, upper = space.bounds
    thin = THIN if lower.size > 1 and lower[1] < upper[1] else THIN[:1]
    starts = [np.clip([0.0, math.log(share)][: lower.size], lower, upper) for share in thin]

    @functools.lru_cache(maxsize=4)
    def model(key: bytes) -> tuple[np.ndarray, np.ndarray]:
        """Return the stiffness (n,) and its derivatives (n, m) with respect to the coordinates."""
        theta = np.frombuffer(key)
        values = space.unit * np.exp(theta)
        log, slopes = log_stiffness(values[0], values[1] if values.size > 1 else 1.0, body, tip)
        found = np.exp(log)
        return found, found[:, None] * slopes[:, : theta.size]

    def objective(weights: np.ndarray) -> Objective:
        return Objective(
            lambda theta: weights * (model(theta.tobytes())[0] - stiffness),
            lambda theta, free: weights[:, None] * model(theta.tobytes())[1][:, free],
            *space.bounds, floor=1e-26 * float(np.sum((weights * stiffness) ** 2)),
        )  # fmt: skip

    problem = FitProblem(data, sought, space, sample, float(depth[-1]), level)
    solved = least_squares(problem, objective, starts)

    # Trends, what the instrument states, and parameters at the end of their range.
    off = deviation(problem, objective, solved, thickness is not None)
    notes, apart = _compared(data, half, tip, start)
    for name, at, low, high, one in zip(sought.table, solved.theta, lower, upper, unit, strict=True):
        if low < high and min(at - low, high - at) < 1e-3 * (high - low):
            more = "larger" if high - at < at - low else "smaller"
            notes.append(
                f"{name} ends at the bound of the search, {one * np.exp(at):.3g}: {more} ones may describe the data better"
            )
    notes += () if tip.known else paraboloid_note(indenter, float(depth.max()), STIFFNESS)
    solved = solved._replace(
        systematic=off.systematic, against=(*off.against, *apart), notes=(*off.notes, *notes)
    )
    found = conclude(problem, solved._replace(moves=functools.partial(no_moves, "a fit of a stiffness")))

    # Young's modulus of all depths, and of single ones with and without the base.
    G, thickness = found.common.values["G"], found.common.values.get("thickness")
    to_E = 2.0 * (1.0 + nu)
    apparent = moduli = to_E * pointwise(stiffness, G, half, tip, lambda _: stiffness)
    if body.base is not None:
        of_film = lambda g: log_stiffness(g, thickness, body, tip)[0]
        moduli = to_E * pointwise(stiffness, G, body, tip, of_film)
    kind = "Oliver-Pharr" if tip.known else "elastic"
    if contact == "stated" or (contact is None and data.area is not None and area is None):
        kind = "Oliver-Pharr (area of the file)"
    return found.fit(
        StiffnessFit, indenter=indenter, nu=nu, thickness=thickness, substrate=substrate, unbonded=unbonded, contact=kind,
        youngs_modulus=tuple(to_E * value for value in (G, *found.common.intervals["G"])), radii=tip.radii,
        apparent=apparent, moduli=moduli,
    )  # fmt: skip


def _body(indenter: Any, nu: float, thickness: Any, substrate: Any) -> Coated:
    """Return the checked body; ValueError on bad input."""
    if not -1.0 < nu <= 0.5:
        raise ValueError(f"nu: expected -1 < nu <= 0.5, got {nu!r}")
    given = isinstance(thickness, int | float | np.number) and 0.0 < thickness < np.inf
    if not (thickness is None or given or thickness == "fit"):
        raise ValueError(f'thickness: expected a thickness > 0 m, "fit" or None, got {thickness!r}')
    tip = float(indenter.compliance()) if type(indenter) in KINDS else 0.0
    if thickness is None:
        if substrate is not None:
            raise ValueError('substrate: expected a thickness or "fit" with a substrate, got thickness=None')
        return Coated(nu, None, 0.3, tip)
    if substrate is None:
        return Coated(nu, np.inf, 0.3, tip)
    if not isinstance(substrate, jc.Elastic):
        raise ValueError(f"substrate: expected Elastic or None, got {type(substrate).__name__}")
    return Coated(nu, float(substrate.G), float(substrate.nu), tip)


def _tip(
    data: StiffnessData,
    indenter: Any,
    contact: str | None,
    area: Sequence[float] | None,
    epsilon: float,
    beta: float,
) -> Tip:
    """Return the tip with the places of its contact; ValueError on bad input."""
    # what gives the contact: stated areas, the depth of an elastic contact, or Oliver and Pharr's contact depth
    probe_of(indenter)
    kind = KINDS[type(indenter)]
    if contact is None and data.area is not None and area is None:
        contact = "stated"
    contact = contact or ("oliver-pharr" if kind == "cone" or area is not None else "elastic")
    if contact not in CONTACTS:
        raise ValueError(f"contact: expected one of {', '.join(CONTACTS)}, got {contact!r}")
    for name, value, least in (("beta", beta, 0.5), ("epsilon", epsilon, 0.0)):
        if not least <= value <= 2.0:
            raise ValueError(f"{name}: expected {least:g} to 2, got {value!r}")
    if contact == "stated":
        if data.area is None:
            raise ValueError('area: expected contact areas in the data for contact="stated", got none')
        if area is not None:
            raise ValueError("area: expected none with a stated contact, got coefficients")
        return Tip(indenter, kind, np.sqrt(data.area / np.pi), True, beta)
    if contact == "elastic":
        if area is not None:
            raise ValueError("area: expected none with an elastic contact, got coefficients")
        places = np.full(data.depth.size, float(indenter.radius)) if kind == "punch" else data.depth
        return Tip(indenter, kind, places, False, beta)
    if data.load is None:
        raise ValueError('load: expected loads for contact="oliver-pharr", got none')

    # h_c = h - epsilon F/S (W. C. Oliver, G. M. Pharr, J. Mater. Res. 7 (1992) 1564)
    depth = data.depth - epsilon * data.load / data.stiffness
    if np.any(depth <= 0.0):
        raise ValueError(
            f"data: expected contact depths > 0 m, got {np.sum(depth <= 0.0)} of {depth.size} that are not, the last at a"
            f" depth of {data.depth[depth <= 0.0].max():.3g} m: leave out the first depths with a window"
        )
    A = contact_area(area, depth) if area is not None else _ideal(indenter, kind, depth)
    if np.any(A <= 0.0):
        raise ValueError(f"area: expected areas > 0 m2 at all contact depths, got {A.min():.3g}")
    return Tip(indenter, kind, np.sqrt(A / np.pi), True, beta)


def _compared(data: StiffnessData, body: Coated, tip: Tip, start: float) -> tuple[list[str], list[str]]:
    """Return notes that compare the moduli that the instrument states with those of the same points on a half-space, and
    reasons for rejection where they differ by more than a factor of ``APART``."""
    nu, G = body.nu, pointwise(data.stiffness, start, body, tip, lambda _: data.stiffness)
    reduced = 2.0 * G / (1.0 - nu + G * body.tip)  # 1/Er = (1 - nu)/(2 G) + the tip's compliance/2
    own = {"reduced modulus": reduced, "modulus": 2.0 * (1.0 + nu) * G}
    notes, against = [], []
    for name, values in data.stated.items():
        known = np.isfinite(own[name]) & (values > 0.0)
        if not known.any():
            continue
        found, said = float(np.median(own[name][known])), float(np.median(values[known]))
        words = f"the instrument states a {name} of {said:.4g} Pa (median); these points give {found:.4g} Pa"
        ratio = max(found / said, said / found)
        if ratio > APART:
            against.append(
                f"{words}, which differs by a factor of {ratio:.3g}: check the tip, its area and the columns"
            )
        else:
            notes.append(f"{words} with nu = {nu:.4g}" if name == "modulus" else words)
    return notes, against


def _ideal(indenter: Any, kind: str, depth: np.ndarray) -> np.ndarray:
    """Return the area [m2] of the ideal indenter at contact depths (n,)."""
    if kind == "punch":
        return np.full(depth.size, np.pi * float(indenter.radius) ** 2)
    if kind == "ball":
        radius = float(indenter.radius)
        return np.pi * (2.0 * radius - np.minimum(depth, radius)) * np.minimum(depth, radius)
    return np.pi * (np.tan(float(indenter.half_angle)) * depth) ** 2
