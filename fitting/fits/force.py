"""Fit of an elastic modulus to the force curve of a microscope, with its contact point and baseline."""

import dataclasses
from typing import Any

import numpy as np

from fitting.data.drag import UNTIMED
from fitting.data.indentation import IndentationData
from fitting.data.probe import paraboloid_note, probe_of
from fitting.fits import force_calibration, force_drag
from fitting.fits.force_search import NUISANCES, ApproachCurve, ForceProblem, Setup, trimmed
from fitting.fits.force_verdict import deviation
from fitting.inference.conclusion import FitProblem, conclude, least_squares
from fitting.inference.evidence import Solved
from fitting.inference.result import Fit, plain
from fitting.models import thickness_polynomials
from fitting.models.force_curve import PARTS, indentation_force
from fitting.search import nonlinear
from fitting.views import force_picture

TURNS, SETTLED = (
    8,
    1e-5,
)  # searches at most on an elastic base, and the relative change of G at which they end
STRAIN = 0.2  # depth over thickness beyond which linear elasticity is doubtful


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ForceFit(Fit):
    """The fit of a force curve; ``Fit`` has what it shares with other fits. Its parameter is the shear modulus "G" [Pa].

    Attributes:
        youngs_modulus: (value, low, high) of E = 2 (1 + nu) G [Pa].
        nuisances: {contact_point [m], baseline [N], tilt [N/s], or [N] per sample without
            times: (value, low, high)}; the contact point is a depth as
            measured, the others belong to the force above the first tenth of the approach. With a correction, also the
            drag [N s/m] on the cantilever.
        indenter, nu, thickness [m], substrate: given quantities on which the modulus is conditional; thickness is None for
            a half-space, substrate for a rigid base.
        polynomials: {name: (E [Pa], deviation from ``youngs_modulus``)} of fits with the approximations in common use for
            a thin layer, where they were requested.
        depth, force, model (n,): depth below the contact point [m], force without baseline [N], and that of the model.
    """

    indenter: Any
    nu: float
    thickness: float | None
    substrate: Any
    youngs_modulus: tuple[float, float, float]
    nuisances: dict[str, tuple[float, float, float]]
    polynomials: dict[str, tuple[float, float]]
    depth: np.ndarray
    force: np.ndarray
    model_force: np.ndarray

    @property
    def abscissa(self) -> tuple[str, str]:
        """The symbol and the unit of the abscissa."""
        return "depth", "m"

    def plot(self, path: Any = None) -> Any:
        """Return a figure of force over depth with the contact point, and of the residuals; saved where a path is given."""
        return force_picture.draw(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with Young's modulus, the nuisance parameters and the given quantities."""
        E = dict(zip(("value", "low", "high"), map(plain, self.youngs_modulus), strict=True))
        key = lambda name: f"{name}_{self._unit(name).replace('/', '_per_').replace(' ', '_')}"
        return super().to_dict() | {
            "youngs_modulus_Pa": E, "poisson_ratio": self.nu, "thickness_m": plain(self.thickness),
            **probe_of(self.indenter).key,
            "nuisances": {key(name): [plain(v) for v in row] for name, row in self.nuisances.items()},
            "polynomials": {name: {"youngs_modulus_Pa": E, "deviation": off} for name, (E, off) in self.polynomials.items()},
            "largest_depth_m": float(self.depth.max()),
        }  # fmt: skip

    def _choices(self) -> list[str]:
        return [*super()._choices(), probe_of(self.indenter).words]

    def _combination_lines(self) -> list[str]:
        E, low, high = self.youngs_modulus
        lines = [f"  E     = {E:11.5g} Pa    {100 * self.level:g} % interval {low:.5g} to {high:.5g}"]
        for name, (modulus, off) in self.polynomials.items():
            lines.append(f"  {name}: E = {modulus:.5g} Pa, {100 * off:+.1f} %")
        return lines

    def _nuisance_lines(self) -> list[str]:
        return [
            f"  {name.replace('_', ' ')} = {value:.5g} {self._unit(name)}, {low:.5g} to {high:.5g}"
            for name, (value, low, high) in self.nuisances.items()
        ]

    def _unit(self, name: str) -> str:
        """Return the unit of a nuisance parameter; the tilt of a curve without times is per sample."""
        return "N per sample" if name == "tilt" and UNTIMED in self.data.notes else NUISANCES[name]

    def _base(self) -> str:
        return (
            "a rigid base"
            if self.substrate is None
            else f"a base of {float(self.substrate.G):.4g} Pa in shear"
        )

    def _conditions(self) -> list[str]:
        body = (
            "a half-space"
            if self.thickness is None
            else f"a layer of {self.thickness:.4g} m bonded to {self._base()}"
        )
        return [
            f"  the modulus is conditional on nu = {self.nu:.4g} and {body}; largest depth {self.depth.max():.4g} m"
        ]


def fit_force(
    data: IndentationData, *, indenter: Any, nu: float = 0.5, thickness: float | None = None,
    substrate: Any = None, polynomials: bool = False, weights: str | None = None, sigma: Any = None,
    bounds: dict[str, tuple] | None = None, errors: dict[str, float] | None = None,
    spring_constant: float | None = None, drag: float | str | None = None, level: float = 0.95,
) -> ForceFit:  # fmt: skip
    """Fit modulus, contact point and baseline to the approach of a force curve.

        force = G size d^p f(d)/(1 - nu) + baseline + tilt t,     d = max(depth - contact point, 0)

    with size and p of the indenter (Hertz; Sneddon) and, on a thin layer, the exact factor f of ``thin_layer_factor``. The
    baseline changes linearly in time, which at a constant speed of approach includes a tilt in height. All four parameters
    are fitted together and profiled, so that the uncertainty of the contact point is part of the interval of the modulus.
    The standard deviation of a point is estimated as (a^2 + (b force)^2)^(1/2), and its correlation is allowed for. A curve
    of more than 1000 points is replaced by means of neighbouring points.

    Where the residuals have a trend, the intervals include the change of the modulus from half the depth to the whole; the
    fit is rejected where that exceeds 49 %, or the trend 5 % of the largest force.

    Args:
        data: the curve with load [N] and depth [m] = height - load/spring constant, including the baseline before contact
            (``read_indentation``).
        indenter: ``jc.Sphere``, ``jc.Cone`` or ``jc.FlatPunch``; a pyramid is the cone of equal area.
        nu: Poisson's ratio.
        thickness: of a sample bonded to a base, such as a gel on glass [m]; None: a half-space.
        substrate: the ``jc.Elastic`` material of the base, which glass needs below samples above about 10 MPa; None: a
            rigid base.
        polynomials: whether to fit the approximations in common use too (for a thickness and nu = 0.5).
        weights: "estimated" (the default), or "absolute": one error for all points.
        sigma: in its place, the standard deviation of the load [N], a number.
        bounds: {"G": (low, high)}.
        errors: relative standard deviations of the calibration, {"spring_constant": 0.1, "sensitivity": 0.03}, which then
            enter the interval of the modulus. The force is taken as proportional to both, and the depth as the height
            minus the deflection.
        spring_constant: of the cantilever [N/m], required with an error of the sensitivity.
        drag: viscous drag on the cantilever in liquid, whose force b d(depth)/dt is subtracted: b [N s/m], or "fit" to read
            it from the baselines of approach and retraction, with its error in the interval of the modulus; None: no
            correction, with a note where the baselines differ.
        level: confidence level of the intervals.

    Returns:
        The modulus with its interval, and how well the model describes the curve.

    Raises:
        ValueError: bad values, a curve without approach or contact, a sample too thin for the table, or a drag without two
            baselines or without times.

    Example:
        >>> t = np.linspace(0.0, 1.0, 201)
        >>> depth = 2e-6 * t
        >>> load = 16 / 9 * 1e3 * np.sqrt(5e-6) * np.maximum(depth - 1e-6, 0.0) ** 1.5  # E = 1 kPa, nu = 0.5
        >>> curve = fitting.IndentationData(t=t, load=load, depth=depth)
        >>> fit = fitting.fit_force(curve, indenter=jc.Sphere(radius=5e-6))
        >>> print(f"{fit.youngs_modulus[0]:.4g} Pa, contact at {fit.nuisances['contact_point'][0]:.4g} m")
        1000 Pa, contact at 1e-06 m
    """
    if not isinstance(data, IndentationData):
        raise ValueError(f"data: expected IndentationData, got {type(data).__name__}")
    weights = "estimated" if weights is None and sigma is None else weights
    setup = Setup.of(indenter, nu, thickness, bounds, substrate)
    errors = force_calibration.check(errors, spring_constant)
    bare = force_drag.corrected(data, drag)
    taken = lambda curve: trimmed(ApproachCurve.of(curve), setup).thinned()

    def searched(
        curve: ApproachCurve, own: Setup = setup, left: int = TURNS
    ) -> tuple[ForceProblem, FitProblem, Solved]:
        force = ForceProblem.of(curve, own, weights, sigma)
        problem = FitProblem(bare.data, own.sought, force.space, force.sample, float(curve.t[-1]), level)
        solved = least_squares(problem, force.objective, force.starts())
        G = _modulus(force, problem, solved)
        if substrate is None or left == 0 or abs(G - own.guess) <= SETTLED * G:
            return force, problem, solved
        return searched(curve, own._replace(guess=G), left - 1)

    approach = taken(bare.data)
    force, problem, solved = searched(approach)
    off = deviation(problem, force, solved)
    notes = (*_notes(force, solved.theta), *bare.notes, *off.notes)
    solved = solved._replace(left=off.left, against=off.against, notes=notes)
    found = conclude(problem, solved)
    modulus = lambda curve: _modulus(*searched(curve))
    fields, given = found.fields, (errors, spring_constant, modulus)
    fields = fields | force_calibration.calibrated(fields, problem, approach, *given)
    extra = bare.error(data, lambda curve: modulus(taken(curve)))
    fields = fields | force_calibration.widened(fields, problem, extra, "drag")
    own = _own(force, solved, found._replace(fields=fields), polynomials, bare.interval(level))
    return found._replace(fields=fields).fit(ForceFit, **own)


def _modulus(force: ForceProblem, _: FitProblem, solved: Solved) -> float:
    """Return the shear modulus [Pa] of a search."""
    compliance = force.space.values(solved.theta)[0] * force.units[3]
    return float(1.0 / compliance)


def _own(
    force: ForceProblem, solved: Any, concluded: Any, polynomials: bool, drag: dict[str, tuple]
) -> dict[str, Any]:
    """Return the fields of a ``ForceFit`` that other fits do not have."""
    setup, theta, (load, depth, *_) = force.setup, solved.theta, force.units
    G, nu = concluded.fields["values"]["G"], setup.sought.volume.value
    E = tuple(2.0 * (1.0 + nu) * value for value in (G, *concluded.fields["intervals"]["G"]))
    below = np.asarray(force.curve.depth) - theta[2]
    base = theta[3] + theta[4] * np.asarray(force.curve.t)
    return {
        "indenter": setup.indenter, "nu": nu, "thickness": setup.thickness, "substrate": setup.substrate,
        "youngs_modulus": E,
        "nuisances": _nuisances(force, theta, concluded.ends) | drag,
        "polynomials": _polynomials(force, solved, E[0]) if polynomials else {},
        "depth": below * depth, "force": (np.asarray(force.curve.load) - base) * load,
        "model_force": np.asarray(indentation_force(theta, below, force.curve)) * load,
    }  # fmt: skip


def _nuisances(
    force: ForceProblem, theta: np.ndarray, ends: np.ndarray
) -> dict[str, tuple[float, float, float]]:
    """Return {name: (value, low, high)} in SI units; the contact point as a measured depth."""
    rows = np.column_stack([theta, ends])[2:] * force.space.unit[2:, None]
    approach = force.approach
    rows[0] = approach.inward * (rows[0] + approach.zero)
    if approach.inward < 0:
        rows[0] = rows[0, [0, 2, 1]]
    return {name: tuple(row.tolist()) for name, row in zip(PARTS, rows, strict=True)}


def _notes(force: ForceProblem, theta: np.ndarray) -> tuple[str, ...]:
    """Return notes on the curve, and on the strain of a thin layer."""
    notes, approach = list(force.approach.notes), force.approach
    if approach.each > 1:
        notes.append(f"{approach.t.size} points are means of {approach.each} samples each")
    thickness, depth = force.setup.thickness, float((1.0 - theta[2]) * force.units[1])
    notes += paraboloid_note(force.setup.indenter, depth, thickness=thickness)
    if thickness is not None and depth > STRAIN * thickness:
        notes.append(
            f"the depth is {depth / thickness:.2g} of the thickness: beyond {STRAIN:g} linear elasticity is doubtful"
        )
    return tuple(notes)


def _polynomials(force: ForceProblem, solved: Any, E: float) -> dict[str, tuple[float, float]]:
    """Return {name: (E [Pa], relative deviation)} with the approximations for this indenter and nu."""
    found = {}
    setup, depth = force.setup, force.units[1]
    for name, layer in thickness_polynomials.approximations(
        setup.indenter, setup.thickness, setup.sought.volume.value
    ).items():
        scaled = layer._replace(scale=layer.scale * depth**layer.power)
        other = force._replace(curve=force.curve._replace(layer=scaled, rise=0.0))
        theta = nonlinear.minimise(other.objective(solved.weights), solved.theta).theta
        off = float(np.expm1(solved.theta[0] - theta[0]))
        found[name] = (E * (1.0 + off), off)
    return found
