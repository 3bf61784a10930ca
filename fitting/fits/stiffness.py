"""Fit of a modulus, and of the thickness of a film, to the contact stiffness over depth."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting.data.probe import STIFFNESS, paraboloid_note, probe_of
from fitting.data.stiffness import StiffnessData
from fitting.fits.stiffness_search import StiffnessProblem, deviation, no_moves, pointwise
from fitting.inference.conclusion import FitProblem, conclude, least_squares
from fitting.inference.result import Fit, plain
from fitting.models.contact_stiffness import KINDS, WIDEST, Coated, Tip, contact_area, log_stiffness
from fitting.models.structure import Sought, limits
from fitting.views import stiffness_picture

CONTACTS = ("elastic", "oliver-pharr", "stated")
LEAST = 5  # fewest points of a fit
APART = 2.0  # factor from the modulus that the instrument states beyond which a fit is rejected


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StiffnessFit(Fit):
    """The fit of a contact stiffness over depth; ``Fit`` has what it shares with other fits.

    Its parameter is the shear modulus "G" [Pa] of the sample or of its film and, where it was fitted, the "thickness" [m].

    Attributes:
        youngs_modulus: (value, low, high) of E = 2 (1 + nu) G [Pa].
        indenter, nu, thickness [m], substrate, contact: given quantities on which the modulus is conditional; thickness is
            None for a half-space and the fitted one where it was fitted.
        radii (n,): contact radii [m], those of a half-space in an elastic contact.
        moduli (n,): Young's modulus [Pa] that each point would give alone, nan where none does.
        apparent (n,): the same on a half-space without a base.
    """

    indenter: Any
    nu: float
    thickness: float | None
    substrate: Any
    contact: str
    youngs_modulus: tuple[float, float, float]
    radii: np.ndarray
    moduli: np.ndarray
    apparent: np.ndarray

    @property
    def abscissa(self) -> tuple[str, str]:
        """The symbol and the unit of the abscissa."""
        return "depth", "m"

    def plot(self, path: Any = None) -> Any:
        """Return a figure of stiffness and modulus over depth, and of the residuals; saved where a path is given."""
        return stiffness_picture.draw(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with Young's modulus and the given quantities."""
        E = dict(zip(("value", "low", "high"), map(plain, self.youngs_modulus), strict=True))
        return super().to_dict() | {
            "youngs_modulus_Pa": E, "poisson_ratio": self.nu, "thickness_m": plain(self.thickness),
            **probe_of(self.indenter).key, "contact": self.contact,
        }  # fmt: skip

    def _choices(self) -> list[str]:
        return [*super()._choices(), probe_of(self.indenter).words]

    def _combination_lines(self) -> list[str]:
        E, low, high = self.youngs_modulus
        lines = [f"  E     = {E:11.5g} Pa    {100 * self.level:g} % interval {low:.5g} to {high:.5g}"]
        known = self.moduli[np.isfinite(self.moduli)]
        if known.size:
            spread = np.percentile(known, [10, 50, 90])
            lines.append(
                "  E of single depths: {1:.4g} Pa (median), {0:.4g} to {2:.4g} (80 % of them)".format(*spread)
            )
        return lines

    def _conditions(self) -> list[str]:
        if self.thickness is None:
            body = "a half-space"
        else:
            base = (
                "a rigid base"
                if self.substrate is None
                else f"a base of {float(self.substrate.G):.4g} Pa in shear"
            )
            body = f"a film of {self.thickness:.4g} m bonded to {base}"
        return [f"  the modulus is conditional on nu = {self.nu:.4g}, {body} and an {self.contact} contact"]


def fit_stiffness(
    data: StiffnessData, *, indenter: Any, nu: float = 0.3, thickness: float | str | None = None, substrate: Any = None,
    contact: str | None = None, area: Sequence[float] | None = None, epsilon: float = 0.75, beta: float = 1.0,
    weights: str | None = None, sigma: Any = None, bounds: dict[str, tuple] | None = None, level: float = 0.95,
) -> StiffnessFit:  # fmt: skip
    """Fit the modulus of a half-space or of a film, and the thickness of the film, to a contact stiffness over depth.

        S = beta 4 G a f(a/h)/(1 - nu)

    with the contact radius a, and the exact factor f of a film of thickness h bonded to an elastic or rigid base (1 on a
    half-space); derived in ``fitting/models/contact_stiffness.py``. The compliance of an elastic indenter is included.
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
    if not isinstance(data, StiffnessData):
        raise ValueError(f"data: expected StiffnessData, got {type(data).__name__}")
    weights = "estimated" if weights is None and sigma is None and data.sigma is None else weights
    body, tip = _body(indenter, nu, thickness, substrate), _tip(data, indenter, contact, area, epsilon, beta)
    fixed = {} if isinstance(thickness, str) or thickness is None else {"thickness": thickness}
    problem = StiffnessProblem.of(data, body, tip, weights, sigma, isinstance(thickness, str))
    if body.base is not None and thickness != "fit":
        _check_width(problem, float(thickness), data.depth)
    sought = Sought(problem.structure, limits(problem.structure, fixed, bounds), None)
    space = problem.space(sought.table)
    fit = FitProblem(data, sought, space, problem.sample, float(data.depth[-1]), level)
    of = lambda given: problem.objective(space, given)
    solved = least_squares(fit, of, problem.starts(space))
    off = deviation(fit, of, solved, thickness is not None)
    said, apart = _compared(data, problem)
    edges = _ends(sought, space, solved.theta)
    curved = () if tip.known else paraboloid_note(indenter, float(data.depth.max()), STIFFNESS)
    found = conclude(
        fit,
        solved._replace(
            left=off.left,
            against=(*off.against, *apart),
            notes=(*off.notes, *said, *edges, *curved),
            moves=no_moves,
        ),
    )
    return found.fit(
        StiffnessFit, **_own(problem, found, indenter, substrate, _named(data, tip, contact, area))
    )


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


def _check_width(problem: StiffnessProblem, thickness: float, depth: np.ndarray) -> None:
    """Raise ValueError where the contact is wider than ``WIDEST`` thicknesses."""
    wide = ~np.isfinite(log_stiffness(problem.start, thickness, problem.body, problem.tip)[0])
    if not wide.any():
        return
    fine = depth[depth < depth[wide].min()]
    what = f"expected a contact of at most {WIDEST:g} thicknesses, got one of {problem.tip.radii.max() / thickness:.3g}"
    if fine.size < LEAST:
        raise ValueError(
            f"thickness: {what}: the film is too thin for these depths; without it the sample is a half-space"
        )
    raise ValueError(
        f"thickness: {what}: window=(None, {fine.max():.4g}) keeps the depths at which the film can be used; without it the"
        " sample is a half-space"
    )


def _compared(data: StiffnessData, problem: StiffnessProblem) -> tuple[list[str], list[str]]:
    """Return notes that compare the moduli that the instrument states with those of the same points on a half-space, and
    reasons for rejection where they differ by more than a factor of ``APART``."""
    nu, body = problem.body.nu, problem.body._replace(base=None)
    G = pointwise(problem.stiffness, problem.start, body, problem.tip, lambda _: problem.stiffness)
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


def _ends(sought: Sought, space: Any, theta: np.ndarray) -> list[str]:
    """Return a note for each fitted parameter whose best value is an end of the range of the search."""
    notes = []
    for name, at, low, high, unit in zip(sought.table, theta, *space.bounds, space.unit, strict=True):
        if low < high and min(at - low, high - at) < 1e-3 * (high - low):
            more = "larger" if high - at < at - low else "smaller"
            notes.append(
                f"{name} ends at the bound of the search, {unit * np.exp(at):.3g}: {more} ones may describe the data better"
            )
    return notes


def _ideal(indenter: Any, kind: str, depth: np.ndarray) -> np.ndarray:
    """Return the area [m2] of the ideal indenter at contact depths (n,)."""
    if kind == "punch":
        return np.full(depth.size, np.pi * float(indenter.radius) ** 2)
    if kind == "ball":
        radius = float(indenter.radius)
        return np.pi * (2.0 * radius - np.minimum(depth, radius)) * np.minimum(depth, radius)
    return np.pi * (np.tan(float(indenter.half_angle)) * depth) ** 2


def _named(data: StiffnessData, tip: Tip, contact: str | None, area: Sequence[float] | None) -> str:
    """Return the kind of contact in words."""
    if contact == "stated" or (contact is None and data.area is not None and area is None):
        return "Oliver-Pharr (area of the file)"
    return "Oliver-Pharr" if tip.known else "elastic"


def _own(
    problem: StiffnessProblem, found: Any, indenter: Any, substrate: Any, contact: str
) -> dict[str, Any]:
    """Return the fields of a ``StiffnessFit`` that other fits do not have."""
    body, tip, values = problem.body, problem.tip, found.fields["values"]
    G, nu, thickness = values["G"], body.nu, values.get("thickness")
    to_E = 2.0 * (1.0 + nu)
    alone = lambda own: (
        to_E
        * pointwise(problem.stiffness, G, own, tip, lambda g: log_stiffness(g, thickness or 1.0, own, tip)[0])
    )
    apparent = alone(body._replace(base=None))
    return {
        "indenter": indenter, "nu": nu, "thickness": thickness, "substrate": substrate,
        "contact": contact,
        "youngs_modulus": tuple(to_E * value for value in (G, *found.fields["intervals"]["G"])),
        "radii": tip.radii, "apparent": apparent, "moduli": apparent if body.base is None else alone(body),
    }  # fmt: skip
