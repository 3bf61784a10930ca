"""Fit of an elastic modulus to the force curve of a microscope, with its contact point and baseline."""

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy.interpolate
import scipy.optimize
from jax import Array
from scipy.special import ndtr

import jaxcontact as jc
from fitting.data.contact import (
    DEGREES,
    KINDS,
    LEAST_CURVE,
    NO_CONTACT,
    PICO,
    ForceCurve,
    ForceUnits,
    baseline,
    by_sensitivity,
    calibration_in_words,
    check_drag,
    directions,
    sample_noise,
    smooth,
    without_drag,
)
from fitting.data.curves import check_kind
from fitting.data.indentation import IndentationData, depth_notes, probe_of, too_deep
from fitting.data.weights import check_weights, choose_weights
from fitting.fits.adhesion import AdhesiveFit
from fitting.fits.contact_model import ContactModel, choose_contact_model
from fitting.fits.force_history import CHANGE, HALF, TREND, ViscoelasticForceFit, fit_history
from fitting.inference import noise, verdict
from fitting.inference.result import ElasticFit, FitProblem, conclude, least_squares, plain, widened
from fitting.inference.sample import Deviation, Sample, Solved, judged_by_size
from fitting.models import thin_layer
from fitting.models.parameters import Parameters
from fitting.models.structure import CLASSICAL, Compressibility, Sought
from fitting.models.thin_layer import RIGID, Base, ThinLayer
from fitting.search import nonlinear
from fitting.search.nonlinear import Objective
from fitting.views import sheet, text

# Force curve of an elastic sample: baseline, contact point and indentation, scaled for the search.
#
#     force = G size d^p f(d)/(1 - nu) + baseline + tilt t,     d = max(depth - contact point, 0)
#
# size and p of the indenter are those of ``data/indentation.py``, and f is the factor of a thin layer
# (``thin_layer.py``), 1 on a half-space. On an elastic base f depends on G as well; its series is linear in log G
# about a value of the search, which is repeated until it stays. In scaled form G size/((1 - nu) load unit) depth
# unit^p = 1/J.


PARTS = ("contact_point", "baseline", "tilt")  # coordinates after the two compliances
LOG_J, FLUIDITY, POINT, BASELINE, TILT = range(5)  # places of the coordinates; the fluidity is held at 0


class ScaledApproach(NamedTuple):
    """Scaled samples (n,) of an approach: t, depth, load and weights; power of the depth; layer in scaled depths, None on
    a half-space; extra: compliance of the indenter over 1 - nu, scaled; rise: derivative of the layer's series with respect
    to log G on an elastic base, 0 on a rigid one; at: log J at which the series holds."""

    t: Array
    depth: Array
    load: Array
    weights: Array
    power: Array | float
    layer: ThinLayer | None
    extra: Array | float
    rise: Array | float = 0.0
    at: Array | float = 0.0


def indentation_force(theta: Array, depth: Array, curve: ScaledApproach) -> Array:
    """Return the scaled force without the baseline at scaled depths from contact on, of any shape."""
    inside = depth > 0.0
    safe = jnp.where(inside, depth, 1.0)
    force = safe**curve.power / (jnp.exp(theta[LOG_J]) + curve.extra)
    if curve.layer is not None:
        layer = curve.layer._replace(series=curve.layer.series + curve.rise * (curve.at - theta[LOG_J]))
        force = force * layer.factor(safe)
    return jnp.where(inside, force, 0.0)


def force_with_baseline(theta: Array, curve: ScaledApproach) -> Array:
    """Return the scaled force (n,) at the samples; theta = (log J, fluidity 0, *``PARTS``)."""
    return (
        indentation_force(theta, curve.depth - theta[POINT], curve) + theta[BASELINE] + theta[TILT] * curve.t
    )


@jax.jit
def unit_forces(points: Array, curve: ScaledApproach) -> Array:
    """Return the scaled indentation forces (k, n) at J = 1 for trial contact points (k,)."""
    return jax.vmap(lambda point: indentation_force(jnp.zeros(1), curve.depth - point, curve))(points)


# Preparation of a force curve, and the search for modulus, contact point and baseline.


WEIGHTS = "estimated", "absolute"
MOST = 1000  # largest number of points, or means of neighbours
COARSE = 200  # that of the curve in which the contact is sought first
EDGE = 30.0  # bound of the logarithm of the scaled compliance
TRIALS = 80  # trial contact points
NUISANCES = dict(zip((*PARTS, "drag"), ("m", "N", "N/s", "N s/m"), strict=True))


class ForceModel(NamedTuple):
    """A scaled force curve with its search space.

    indenter; sought: the elastic solid; thickness [m] of a layer, None for a half-space; substrate: its elastic base,
    None for a rigid one; unbonded: whether it slides on its base; sample: load over depth [m].
    """

    approach: ForceCurve
    indenter: Any
    sought: Sought
    thickness: float | None
    substrate: jc.Elastic | None
    unbonded: bool
    curve: ScaledApproach
    units: ForceUnits
    space: Parameters
    sample: Sample

    @classmethod
    def of(
        cls, approach: ForceCurve, indenter: Any, sought: Sought, thickness: float | None,
        substrate: jc.Elastic | None, unbonded: bool, guess: float, weights: str | None, sigma: Any,
    ) -> "ForceModel":  # fmt: skip
        """Return the scaled problem of an approach; ValueError where nothing changes in it.

        guess: shear modulus [Pa] of the layer at which the factor of an elastic base is linearised.
        """
        probe, share, nu = probe_of(indenter), sought.volume.one_minus_nu, sought.volume.value
        units = ForceUnits.of(approach, float(approach.depth[-1]), probe, share)
        units.check()
        load, depth, T, compliance = units
        above = approach.load - baseline(approach.load)

        # the factor of a layer over scaled depths, and its change with the modulus on an elastic base
        layer, rise, at = None, 0.0, 0.0
        if thickness is not None:
            base = RIGID if substrate is None else Base(guess / float(substrate.G), float(substrate.nu))
            base = base._replace(bonded=not unbonded)
            layer = ThinLayer.of(indenter, thickness, nu, base).over(depth)
            if base.ratio:
                rise = thin_layer.table(nu, base, True)[thin_layer.kind_of(indenter)][1]
                at = -np.log(guess * compliance)
        weight, label = choose_weights(approach.t, above, weights, sigma)
        extra = float(indenter.compliance()) / share / compliance
        curve = ScaledApproach(
            approach.t / T,
            approach.depth / depth,
            above / load,
            weight * load,
            probe.power,
            layer,
            extra,
            rise,
            at,
        )
        sample = Sample.of(("load", "N", approach.depth, above), weight, label, own_trends=True)

        # the box of log J, the fluidity (held at 0), contact point, baseline and tilt
        low, high = sought.structure.box(sought.table)[0] / compliance
        with np.errstate(divide="ignore"):
            ends = np.clip(np.log([low, high]), -EDGE, EDGE)
        open_sides = np.zeros((5, 2), dtype=bool)
        open_sides[0] = low == 0.0, np.isinf(high)
        space = Parameters.of(
            sought.structure, [ends, [0.0, 0.0], [0.0, 1.0], [-2.0, 2.0], [-4.0, 4.0]],
            unit=np.array([compliance, compliance / T, depth, load, load / T]), logarithmic=np.arange(5) == 0,
            material=np.arange(5) < 2, nuisances=PARTS, open=open_sides,
        )  # fmt: skip
        return cls(approach, indenter, sought, thickness, substrate, unbonded, curve, units, space, sample)

    def modulus(self, theta: np.ndarray) -> float:
        """Return the shear modulus [Pa]."""
        return float(1.0 / (self.space.values(theta)[LOG_J] * self.units.compliance))

    @property
    def padded(self) -> ScaledApproach:
        """The curve, padded to a common length."""
        arrays = {
            name: nonlinear.repeated(np.asarray(getattr(self.curve, name))) for name in ("t", "depth", "load")
        }
        return self.curve._replace(weights=nonlinear.without_weight(self.curve.weights), **arrays)

    def objective(self, weights: np.ndarray) -> Objective:
        """Return the least-squares objective for weights (n,) [1/N]."""
        curve, own = self.padded, nonlinear.without_weight(weights * self.units.load)
        points = slice(weights.size)
        return Objective.of(force_with_baseline, curve, curve.load, own, self.space, points=points)

    def starts(self) -> list[np.ndarray]:
        """Return coordinates (5,) at the three best local minima over trial contact points; the rest is linear."""
        points = np.linspace(0.0, 1.0, TRIALS, endpoint=False)
        n = self.sample.t.size
        forces = np.asarray(unit_forces(points, self.padded))[:, :n]
        # at a deeper contact point the largest depth is smaller, and so is chi
        inside = np.isfinite(forces).all(1)
        chi = f"expected a sample with chi (sqrt(R depth)/thickness of a ball) up to {thin_layer.LARGEST:g}, got more"
        if not np.any(inside):
            raise ValueError(f"thickness: {chi} for every contact point on a way of {self.units.depth:.3g} m")
        # weighted RSS and coordinates (5,) for each contact point; inf where the sample would pull
        w, rss, found = np.asarray(self.curve.weights), np.full(TRIALS, np.inf), np.zeros((TRIALS, 5))
        for i, (force, point) in enumerate(zip(forces, points, strict=True)):
            if not inside[i] or not np.any(force > 0.0):
                continue
            A = np.stack([force, np.ones(n), np.asarray(self.curve.t)], -1) * w[:, None]
            x = np.linalg.lstsq(A, w * self.curve.load, rcond=None)[0]
            if x[0] > 0.0:
                rss[i] = float(np.sum((A @ x - w * self.curve.load) ** 2))
                found[i] = -np.log(x[0]), 0.0, point, x[1], x[2]
        lowest = [
            i for i in range(TRIALS) if rss[i] <= rss[max(i - 1, 0)] and rss[i] <= rss[min(i + 1, TRIALS - 1)]
        ]
        best = sorted((i for i in lowest if np.isfinite(rss[i])), key=lambda i: rss[i])[:3]
        if not best:
            raise ValueError(NO_CONTACT)
        # the best one lies at or beyond the end of the layer's law
        if not inside.all() and best[0] <= np.argmax(inside) + 1:
            raise ValueError(
                f"thickness: {chi} for the contact point that describes the curve: leave out the deep points with a window,"
                " or take the sample as a half-space"
            )
        return [np.clip(found[i], *self.space.bounds) for i in best]


# Judgement of a force curve: systematic deviations from the model by their size. The modulus is fitted again to the
# shallower half of the indentation (``inference/verdict.py``).


# part of the work of the approach that a retraction does not give back, above which a note says so
LOST = 0.1


def trend_words(trend: float, softer: float, rejected: bool, unit: float, thin: bool) -> str:
    """Return the size of the trend and of the change of log J with its meaning, in a microscopist's words.

    trend: over the largest force ``unit`` [N]; softer: change from half the depth to the whole; thin: of a thin sample.
    """
    way, percent = "falls" if softer > 0 else "rises", 100 * abs(math.expm1(-softer))
    if softer > 0:
        meaning = (
            "the sample seems to soften with depth: adhesion or repulsion near the contact, a tip blunter than assumed,"
            " or a stiff surface; fit a larger depth, or check the tip"
        )
    elif not thin:
        meaning = (
            "the sample seems to stiffen with depth: a thin sample on a hard base (give its --thickness), a brush or"
            " membrane above it, or a tip sharper than assumed"
        )
    else:
        meaning = (
            "the sample seems to stiffen with depth: thinner than given, a brush above it, or large strains"
        )
    size = f"a trend of {100 * trend:.1f} % of the largest force ({trend * unit * PICO:.3g} pN)"
    if rejected:
        return (
            f"the residuals have {size}, and the modulus {way} by {percent:.0f} % from half the depth to the whole:"
            f" {meaning}"
        )
    return (
        f"the residuals have {size}; the intervals include the change of the modulus from half the depth to the whole,"
        f" by which it {way} by {percent:.1f} %: {meaning}"
    )


def deviation(problem: FitProblem, force: ForceModel, solved: Solved) -> Deviation:
    """Return the systematic deviation of a solved force curve."""
    curve, theta, unit = force.curve, solved.theta, force.units.load
    depth, deviations = np.asarray(curve.depth), solved.residual / solved.weights / unit
    nothing, outside = np.zeros(theta.size), depth < theta[POINT]

    # A curve without indentation or baseline determines nothing.
    before = int(outside.sum())
    scatter = float(np.std(deviations[outside])) if before else 0.0
    pushed = float(indentation_force(theta, curve.depth[-1] - theta[POINT], curve))
    n = depth.size
    pressed = np.asarray(curve.load) + deviations - theta[BASELINE] - theta[TILT] * np.asarray(curve.t)
    spiky, highest = verdict.spikes(deviations, pushed, n)
    jumped = verdict.jump(deviations, pushed, n)
    risen = verdict.rising(depth, deviations, pressed, theta[POINT], n)
    why = verdict.unusable(before, n, spiky, highest, jumped, risen, pushed, scatter, unit)
    if why:
        return Deviation(nothing, (why,))

    def refits() -> list[np.ndarray | None]:
        """Return the fit up to half the largest depth."""
        some = depth - theta[POINT] <= HALF * (depth[-1] - theta[POINT])
        if np.sum(some & (depth > theta[POINT])) < 5:
            return [None]
        objective = force.objective(np.where(some, solved.weights, 0.0))
        return [nonlinear.minimise(objective, theta).theta]

    words = lambda trend, changes, rejected: trend_words(
        trend, float(changes[0, 0]), rejected, unit, force.thickness is not None
    )
    trend = lambda: verdict.trend(deviations)
    log_compliance = lambda theta: theta[:1]
    return judged_by_size(problem, solved, trend, refits, log_compliance, (TREND, CHANGE), words)


def hysteresis_note(data: IndentationData, approach: ForceCurve, point: float) -> tuple[str, ...]:
    """Return a note where the retraction of a curve does not give back the work of its approach, which an elastic sample
    does; point: contact point, as the depths of ``approach`` [m]."""
    back = data.segments == "retract"
    if back.sum() < LEAST_CURVE or data.numbered:
        return ()
    depth = approach.inward * data.depth[back] - approach.zero - point
    _, pushed = directions(data)
    load, first = smooth(pushed * data.load[back]), data.segments == "approach"
    outside = depth < -0.1 * (approach.depth[-1] - point)
    level = np.median(load[outside]) if outside.sum() >= LEAST_CURVE else baseline(pushed * data.load[first])
    there = approach.depth > point
    if there.sum() < verdict.FEW or depth[0] < depth[-1]:
        return ()
    away = approach.load[~there]
    pressed = np.maximum(approach.load[there] - (np.median(away) if away.size else approach.load[0]), 0.0)
    work = float(np.trapezoid(pressed, approach.depth[there]))
    given = float(np.trapezoid(np.maximum(load - level, 0.0)[::-1], np.maximum(depth, 0.0)[::-1]))
    if work <= 0.0 or given > (1.0 - LOST) * work:
        return ()
    return (
        f"approach and retraction differ: the retraction gives back {100.0 * given / work:.2g} % of the work of the"
        " approach, as of a sample that is viscoelastic, adhesive or plastic; model= fits a viscoelastic material to both",
    )


# searches at most on an elastic base, and the relative change of G at which they end
TURNS, SETTLED = 8, 1e-5


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ForceFit(ElasticFit):
    """The fit of a force curve; ``ElasticFit`` and ``Fit`` have what it shares with other fits. Its parameter is the shear
    modulus "G" [Pa].

    Attributes:
        nuisances: {contact_point [m], baseline [N], tilt [N/s], or [N] per sample without
            times: (value, low, high)}; the contact point is a depth as
            measured, the others belong to the force above the first tenth of the approach. With a correction, also the
            drag [N s/m] on the cantilever.
        polynomials: {name: (E [Pa], deviation from ``youngs_modulus``)} of fits with the approximations in common use for
            a thin layer, where they were requested.
        depth, force, model_force (n,): depth below the contact point [m], force without baseline [N], and that of the model.
        trended: whether the fit is rejected for a trend of its residuals.
        contact_model: why this model of the contact, with ``adhesion="auto"``; None else.
    """

    nuisances: dict[str, tuple[float, float, float]]
    polynomials: dict[str, tuple[float, float]]
    depth: np.ndarray
    force: np.ndarray
    model_force: np.ndarray
    trended: bool
    contact_model: ContactModel | None = None

    @functools.cached_property
    def modulus_over_depth(self) -> tuple[tuple[float, float, float, float], ...]:
        """Rows (depth [m], E, low, high [Pa]) of the apparent modulus, the measured force over that of the fitted model for
        E = 1 Pa, where the fit is rejected for a trend; none for another fit, or on an elastic base or for an elastic tip.

        Its logarithm is a cubic spline through the rows, and the contact point and baseline are fitted again with it, since
        those of the rejected fit are biased (see above ``ROWS``). An interval is that of the modulus at the
        depth below the contact point of the table, whose error it includes.
        """
        if not self.trended or self.substrate is not None or self.indenter.material is not None:
            return ()
        probe, layer = probe_of(self.indenter), None
        size = probe.size / (2.0 * (1.0 + self.nu) * (1.0 - self.nu))
        if self.thickness is not None:
            layer = ThinLayer.of(self.indenter, self.thickness, self.nu, Base(bonded=not self.unbonded))

        def law(d: np.ndarray) -> np.ndarray:
            return size * d**probe.power * (1.0 if layer is None else np.asarray(layer.factor(d)))

        return modulus_over_depth(self.depth, self.force, law, self.youngs_modulus[0], self.level)

    def plot(self, path: Any = None) -> Any:
        """Return a figure of force over depth with the contact point, and of the residuals; saved where a path is given."""
        value, low, high = self.nuisances["contact_point"]

        def panel(top: Any, bottom: Any) -> None:
            top.plot(
                self.depth, self.force, ".", markersize=3, color="0.4", label="data, baseline subtracted"
            )
            top.plot(self.depth, self.model_force, color=sheet.VIOLET, label="model")
            top.plot(0.0, 0.0, "o", color=sheet.BLUE, label="contact point")
            for axes in (top, bottom):
                axes.axvspan(
                    -0.5 * abs(high - low), 0.5 * abs(high - low), color=sheet.BLUE, alpha=0.3, linewidth=0
                )
                axes.axvline(0.0, color=sheet.BLUE, linewidth=0.8)
            sheet.axis_label(top.yaxis, "force", "N", self.force)
            bottom.plot(self.depth, PICO * (self.force - self.model_force), ".", markersize=3, color="0.4")
            sheet.axis_label(bottom.xaxis, "depth below the contact point", "m", np.abs(self.depth))
            bottom.set_ylabel("residual [pN]")

        factor, unit = sheet.multiple("Pa", self.youngs_modulus[0])
        E, least, most = (modulus / factor for modulus in self.youngs_modulus)
        percent = f"{100 * self.level:g} % interval"
        lines = [f"E = {E:.4g} {unit}, {percent} {least:.4g} to {most:.4g} {unit}"]
        factor, unit = sheet.multiple("m", max(abs(low), abs(high)))
        place = f"{value / factor:.5g} {unit}, {low / factor:.5g} to {high / factor:.5g} {unit}"
        return sheet.draw(self, path, panel, lines=[*lines, f"contact point at {place}"])

    def to_dict(self) -> dict[str, Any]:
        """Return ``ElasticFit.to_dict`` with the nuisance parameters and the modulus over depth."""
        key = lambda name: text.key(name, self._unit(name))
        chosen = {} if self.contact_model is None else {"contact_model": self.contact_model.to_dict()}
        return super().to_dict() | chosen | {
            "nuisances": {key(name): [plain(v) for v in row] for name, row in self.nuisances.items()},
            "polynomials": {name: {"youngs_modulus_Pa": E, "deviation": off} for name, (E, off) in self.polynomials.items()},
            "modulus_over_depth": [
                {"depth_m": depth, "youngs_modulus_Pa": row} for depth, *row in self.modulus_over_depth
            ],
            "largest_depth_m": float(self.depth.max()),
        }  # fmt: skip

    def _combination_lines(self) -> list[str]:
        lines = super()._combination_lines()
        for name, (modulus, off) in self.polynomials.items():
            lines.append(f"  {name}: E = {modulus:.5g} Pa, {100 * off:+.1f} %")
        table = self.modulus_over_depth
        if table:
            lines.append("  apparent modulus over the depth, with a contact point of its own:")
        lines += [
            f"    at {depth:.3g} m: E = {value:.4g} Pa, {low:.4g} to {high:.4g} Pa"
            for depth, value, low, high in table
        ]
        return lines

    def _nuisance_lines(self) -> list[str]:
        return [
            f"  {name.replace('_', ' ')} = {value:.5g} {self._unit(name)}, {low:.5g} to {high:.5g}"
            for name, (value, low, high) in self.nuisances.items()
        ]

    def _unit(self, name: str) -> str:
        """Return the unit of a nuisance parameter; the tilt of a curve without times is per sample."""
        return "N per sample" if name == "tilt" and self.data.numbered else NUISANCES[name]

    def _conditions(self) -> list[str]:
        body = text.layer(self.thickness, self.unbonded, self.substrate)
        return [
            *(self.contact_model.lines() if self.contact_model else []),
            f"  the modulus is conditional on nu = {self.nu:.4g} and {body}; largest depth {self.depth.max():.4g} m",
        ]


def fit_force(
    data: IndentationData, *, indenter: Any, model: type | str | None = None, nu: float = 0.5,
    thickness: float | None = None, substrate: Any = None, unbonded: bool = False, polynomials: bool = False,
    weights: str | None = None, sigma: Any = None, fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None, errors: dict[str, float] | None = None,
    spring_constant: float | None = None, drag: float | str | None = None, adhesion: str | None = None,
    level: float = 0.95,
) -> ForceFit | ViscoelasticForceFit | AdhesiveFit:  # fmt: skip
    """Fit modulus, contact point and baseline to the approach of a force curve, or a viscoelastic material to all of it.

        force = G size d^p f(d)/(1 - nu) + baseline + tilt t,     d = max(depth - contact point, 0)

    with the shape of the indenter (Hertz; I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47)

        ball of radius R:            size = 8/3 R^(1/2),        p = 3/2
        cone of half-angle alpha:    size = 4/pi tan(alpha),    p = 2
        flat punch of radius R:      size = 4 R,                p = 1

    and, on a thin layer, the exact factor f of ``thin_layer_factor``, 1 on a half-space. The
    baseline changes linearly in time, which at a constant speed of approach includes a tilt in height. All four parameters
    are fitted together and profiled, so that the uncertainty of the contact point is part of the interval of the modulus.
    The standard deviation of a point is estimated as (a^2 + (b force)^2)^(1/2), and its correlation is allowed for. A curve
    of more than 1000 points is replaced by means of neighbouring points.

    The interval of the modulus is that of the profile likelihood, enlarged in this order: (1) where the residuals have a
    trend, by the change of the modulus from half the depth to the whole; (2) with ``errors``, by the standard deviation of
    the calibration; (3) with a drag, by that of the drag, (2) and (3) as errors of ln G that are independent of the noise.

    A fit whose residuals have a trend is rejected where the modulus rises by more than 49 % or falls by more than 33 % from
    half the depth to the whole, or the trend exceeds 5 % of the largest force; ``modulus_over_depth`` is then a table of the
    modulus over the depth. It is also rejected without a baseline or an indentation, with isolated spikes, a jump, or a flat
    end (``unusable``).

    With a ``model`` the force follows from the whole history of the depth, in approach, dwell and retraction, with a
    contact that shrinks (T. C. T. Ting, J. Appl. Mech. 33 (1966) 845; derived in ``fitting/fits/force_history.py``):

        force = size/(1 - nu) int_0^t1(t) G(t - s) d(d^p f(d)) + baseline + drift t + slope depth

    with t1 = t while the contact grows, and int_t1^t G(t - s) dd(s) = 0 once it shrinks. The part of a retraction that
    pulls is left out, and all of its contact where it pulls with more than 10 % of the largest force.

    Args:
        data: the curve with load [N] and depth [m] = height - load/spring constant, including the baseline before contact
            (``read_indentation``).
        indenter: ``jc.Sphere``, ``jc.Cone`` or ``jc.FlatPunch``; a pyramid is the cone of equal area. Its material, None or
            known, is elastic, or with a viscoelastic ``model`` that is not fractional any one that creeps; on a sample with
            a thickness it is rigid.
        model: None, an elastic solid; or the viscoelastic material, a class or its name: StandardLinearSolid, KelvinVoigt
            (with an instantaneous compliance that keeps its force finite), Maxwell, Burgers, FractionalKelvinVoigt or
            Springpot.
        nu: Poisson's ratio.
        thickness: of a sample on a base, such as a gel on glass [m]; None: a half-space.
        substrate: the ``jc.Elastic`` material of the base, which glass needs below samples above about 10 MPa; None: a
            rigid base.
        unbonded: whether the sample slides on the base without friction (and does not lift off) instead of being bonded.
        polynomials: whether to fit the approximations in common use too (for a thickness and nu = 0.5).
        weights: "estimated" (the default), or "absolute": one error for all points.
        sigma: in its place, the standard deviation of the load [N], a number.
        fixed: {parameter: value} of a viscoelastic model, held at these values in SI.
        bounds: {parameter: (low, high)}, of an elastic solid {"G": (low, high)}.
        errors: relative standard deviations of the calibration, {"spring_constant": 0.1, "sensitivity": 0.03}, which then
            enter the interval of the modulus. The force is taken as proportional to both, and the depth as the height
            minus the deflection.
        spring_constant: of the cantilever [N/m], required with an error of the sensitivity.
        drag: viscous drag on the cantilever in liquid, whose force b d(depth)/dt is subtracted: b [N s/m], or "fit" to read
            it from the baselines of approach and retraction, with its error in the interval of the modulus; None: no
            correction, with a note where the baselines differ.
        adhesion: None, or "auto" for a ball on a half-space: Hertz, DMT, Maugis or JKR, by the tension of the retraction and
            the Tabor number that the fit of Maugis's theory finds (``fitting/fits/contact_model.py``). The result has what
            decided as ``contact_model``, also that the data do not tell.
        level: confidence level of the intervals.

    Returns:
        The modulus with its interval, and how well the model describes the curve: a ``ForceFit``, with a ``model`` a
        ``ViscoelasticForceFit``, and with adhesion an ``AdhesiveFit``.

    Raises:
        ValueError: bad values, a curve without approach or contact, a sample too thin for the table, a drag without two
            baselines or without times, or a ``model`` for a curve without times.

    Example:
        >>> t = np.linspace(0.0, 1.0, 201)
        >>> depth = 2e-6 * t
        >>> load = 16 / 9 * 1e3 * np.sqrt(5e-6) * np.maximum(depth - 1e-6, 0.0) ** 1.5  # E = 1 kPa, nu = 0.5
        >>> curve = fitting.IndentationData(t=t, load=load, depth=depth)
        >>> fit = fitting.fit_force(curve, indenter=jc.Sphere(radius=5e-6))
        >>> print(f"{fit.youngs_modulus[0]:.4g} Pa, contact at {fit.nuisances['contact_point'][0]:.4g} m")
        1000 Pa, contact at 1e-06 m
    """
    check_kind(data, IndentationData)
    # 1. With adhesion="auto" the choice of a contact model, which calls this function without it.
    if adhesion is not None:
        if not (isinstance(adhesion, str) and adhesion.lower() == "auto"):
            raise ValueError(
                f'adhesion: expected "auto" or None in a fit of a force curve, got {adhesion!r}: fit_indentation takes a'
                ' work of adhesion, "fit" and "JKR"'
            )
        beside = {
            "model": model, "thickness": thickness, "substrate": substrate, "unbonded": unbonded, "fixed": fixed,
            "errors": errors, "spring_constant": spring_constant, "polynomials": polynomials,
        }  # fmt: skip
        given = [name for name, value in beside.items() if value]
        given += [f"bounds of {name}" for name in bounds or {} if name != "G"]
        if given:
            raise ValueError(f"adhesion: expected no {', '.join(given)} beside it, got some")
        shared: dict[str, Any] = {
            "indenter": indenter, "nu": nu, "weights": weights, "sigma": sigma, "bounds": bounds, "level": level,
        }  # fmt: skip
        bare, dragged, notes = without_drag(data, drag)
        chosen = choose_contact_model(
            bare, elastic=functools.partial(fit_force, data, drag=drag, **shared), **shared
        )
        if not isinstance(chosen, AdhesiveFit):
            return chosen
        if dragged is not None and dragged.sd > 0.0:
            notes = ("the intervals do not include the error of the drag", *notes)
        return dataclasses.replace(chosen, notes=(*chosen.notes, *notes))

    # 2. A viscoelastic model has a fit of its own, to all segments of the curve.
    weights = "estimated" if weights is None and sigma is None else weights
    check_options(indenter, nu, thickness, substrate, unbonded, weights, sigma, errors, spring_constant, drag)
    if unbonded and polynomials:
        raise ValueError(
            "polynomials: expected False with unbonded, got True: they are those of a bonded sample"
        )
    if (
        model is not None
        and not (isinstance(model, str) and model.casefold() == "elastic")
        and model is not jc.Elastic
    ):
        for name, value in (("substrate", substrate), ("polynomials", polynomials or None)):
            if value is not None:
                raise ValueError(f"{name}: expected none with a viscoelastic model, got {value!r}")
        bare, dragged, notes = without_drag(data, drag)
        return fit_history(
            bare, model, indenter=indenter, nu=nu, thickness=thickness, unbonded=bool(unbonded), weights=weights,
            sigma=sigma, fixed=fixed,
            bounds=bounds, errors=errors or {}, spring_constant=spring_constant, dragged=dragged,
            redrawn=data.without_drag, level=level, notes=notes,
        )  # fmt: skip
    if fixed:
        raise ValueError(f"fixed: expected none without a viscoelastic model, got {fixed!r}")

    ignored = (
        ()
        if data.sigma_load is None or sigma is not None
        else ("the standard deviations of the load that the data carry are not used: sigma= takes a number",)
    )

    # 3. The approach about its contact, which a comparison of starts on few points finds, and the optimum.
    sought = Sought.of(CLASSICAL[jc.Elastic], None, bounds, nu)
    sample, errors = (indenter, sought, thickness, substrate, bool(unbonded)), errors or {}
    bare, dragged, notes = without_drag(data, drag)

    def taken(curve: IndentationData) -> ForceCurve:
        """Return the approach about the contact that the first comparison of starts finds."""
        approach = ForceCurve.approach(curve)
        coarse = ForceModel.of(approach.thinned(COARSE), *sample, 0.0, "absolute", None)
        point = coarse.starts()[0][POINT] * coarse.units.depth
        return approach.near_contact(point).thinned(MOST)

    def searched(curve: ForceCurve) -> tuple[ForceModel, FitProblem, Solved]:
        """Return the solution; on an elastic base the search is repeated until the modulus stays."""
        guess = 0.0
        for _ in range(TURNS + 1):
            force = ForceModel.of(curve, *sample, guess, weights, sigma)
            problem = FitProblem(bare, sought, force.space, force.sample, float(curve.t[-1]), level)
            solved = least_squares(problem, force.objective, force.starts())
            before, guess = guess, force.modulus(solved.theta)
            if substrate is None or abs(guess - before) <= SETTLED * guess:
                break
        return force, problem, solved

    def log_modulus(curve: ForceCurve) -> float:
        force, _, solved = searched(curve)
        return math.log(force.modulus(solved.theta))

    approach = taken(bare)
    force, problem, solved = searched(approach)

    # 4. Systematic deviations of the curve from the model, notes, and the fit with its intervals by the noise.
    off, theta = deviation(problem, force, solved), solved.theta
    unit, deepest = force.units.load, force.units.depth
    depth = float((1.0 - theta[POINT]) * deepest)
    said = (
        *approach.remarks, *ignored, *depth_notes(indenter, depth, thickness),
        *hysteresis_note(bare, approach, float(theta[POINT] * deepest)), *notes, *off.notes,
    )  # fmt: skip
    against = (*too_deep(indenter, depth), *off.against)
    solved = solved._replace(systematic=off.systematic, against=against, notes=said)
    found = conclude(problem, solved)

    # 5. Errors of the calibration and of the drag, from fits to curves that are changed by them.
    common, nuisances, slope = found.common, {}, 0.0
    if errors.get("sensitivity"):
        slope = by_sensitivity(lambda change: log_modulus(approach.recalibrated(change, spring_constant)))
    total = math.hypot(errors.get("spring_constant", 0.0), slope * errors.get("sensitivity", 0.0))
    causes = [(total, calibration_in_words(errors))]
    if dragged is not None:
        b, half = dragged.coefficient, noise.two_sided(level, DEGREES) * dragged.sd
        nuisances["drag"] = b, b - half, b + half
        if dragged.sd > 0.0:
            ends = [log_modulus(taken(data.without_drag(max(b + s * dragged.sd, 0.0)))) for s in (1.0, -1.0)]
            causes.append((0.5 * abs(ends[0] - ends[1]), "drag"))
    for sd, cause in causes:
        if sd:
            common = widened(
                common, problem, {"G": sd}, [sd * common.estimate.best],  # of 1/G
                f"the interval of the modulus includes the standard deviation of the {cause}, {100 * sd:.3g} % of the"
                " modulus",
            )  # fmt: skip

    # 6. Nuisance parameters in SI units; the contact point as a measured depth.
    rows = np.column_stack([theta, found.ends])[2:] * force.space.unit[2:, None]
    rows[0] = approach.inward * (rows[0] + approach.zero)
    if approach.inward < 0:
        rows[0] = rows[0, [0, 2, 1]]
    nuisances = {name: tuple(row.tolist()) for name, row in zip(PARTS, rows, strict=True)} | nuisances
    E = tuple(2.0 * (1.0 + nu) * value for value in (common.values["G"], *common.intervals["G"]))
    below = np.asarray(force.curve.depth) - theta[POINT]
    baseline_load = theta[BASELINE] + theta[TILT] * np.asarray(force.curve.t)
    return found._replace(common=common).fit(
        ForceFit, indenter=indenter, nu=nu, thickness=thickness, substrate=substrate, unbonded=unbonded,
        youngs_modulus=E, nuisances=nuisances, polynomials=_polynomials(force, solved, E[0]) if polynomials else {},
        depth=below * deepest, force=(np.asarray(force.curve.load) - baseline_load) * unit,
        model_force=np.asarray(indentation_force(theta, below, force.curve)) * unit, trended=off.trended,
    )  # fmt: skip


def check_options(
    indenter: Any,
    nu: float,
    thickness: float | None,
    substrate: Any,
    unbonded: Any,
    weights: str | None,
    sigma: Any,
    errors: Any,
    spring_constant: float | None,
    drag: Any,
) -> None:
    """Raise ValueError for what is wrong with any curve: a bad body or indenter, weights in proportion to a load whose
    baseline is zero, and unknown or bad errors of the calibration."""
    probe_of(indenter)
    Compressibility.of(nu, None)
    check_weights(weights, sigma, WEIGHTS)
    if sigma is not None and not (isinstance(sigma, int | float | np.number) and 0.0 < sigma < math.inf):
        raise ValueError(f"sigma: expected a standard deviation > 0 N, a number, got {sigma!r}")
    check_drag(drag)
    if substrate is not None and (thickness is None or not isinstance(substrate, jc.Elastic)):
        got = "no thickness" if thickness is None else type(substrate).__name__
        raise ValueError(f"substrate: expected Elastic, below a sample with a thickness, got {got}")
    if thickness is not None:
        thin_layer.check(thickness, nu)
        if indenter.material is not None:
            raise ValueError("indenter: expected a rigid one on a thin layer, got one with a material")
    for name, value in (errors or {}).items():
        if name not in KINDS:
            raise ValueError(f"errors: expected keys among {', '.join(KINDS)}, got {name!r}")
        if not (isinstance(value, int | float) and 0.0 <= value < 1.0):
            raise ValueError(
                f"errors[{name!r}]: expected a relative standard deviation from 0 to 1, got {value!r}"
            )
    k = spring_constant
    if k is not None and not (isinstance(k, int | float | np.number) and 0.0 < k < math.inf):
        raise ValueError(f"spring_constant: expected > 0 N/m, got {k!r}")
    if "sensitivity" in (errors or {}) and not (spring_constant or 0.0) > 0.0:
        raise ValueError(
            "spring_constant: expected the spring constant of the cantilever [N/m] with an error of the sensitivity,"
            f" got {spring_constant!r}"
        )
    thin_layer.check_unbonded(unbonded, thickness)


def _polynomials(force: ForceModel, solved: Any, E: float) -> dict[str, tuple[float, float]]:
    """Return {name: (E [Pa], relative deviation)} with the approximations for this indenter and nu."""
    found, depth = {}, force.units.depth
    layers = thin_layer.approximations(force.indenter, force.thickness, force.sought.volume.value)
    for name, layer in layers.items():
        scaled = layer._replace(scale=layer.scale * depth**layer.power)
        other = force._replace(curve=force.curve._replace(layer=scaled, rise=0.0))
        theta = nonlinear.minimise(other.objective(solved.weights), solved.theta).theta
        off = float(np.expm1(solved.theta[LOG_J] - theta[LOG_J]))
        found[name] = (E * (1.0 + off), off)
    return found


# The apparent modulus at a depth d is E(d) = (force - baseline - tilt)/law(d), with law(d) the force of the fitted model for
# E = 1 Pa,
#
#     force = E(d) law(d) + baseline + tilt,     log E a cubic spline through nodes from the contact to the largest depth.
#
# Many pairs of a contact point and an E near the contact describe a noisy curve: the earlier the contact, the closer to
# zero E begins. Differences of log E between nodes are therefore normal variables of mean 0 in advance, the first ones with
# the standard deviation ``SLOPE`` and the second ones with ``BEND``. The distribution of log E is summed over trial contact
# points, at each of which it is taken as normal (Laplace's method). The density of a contact point, which is skewed, is the
# largest one over the other coordinates (a profile) and not the integral over them. The integral is larger by the volume of
# the coordinates that describe the curve about as well, which grows with the depth before the sample resists; with it
# intervals of E were below the true one in 12 to 15 % of the curves of stiffening samples, and above it in none.
#
# The E of a film on a soft base falls steeply from the contact on, which a spline in the depth smooths: rows were up to 4 %
# too low, and 0 to 7 % of the intervals of four of them held E. A second spline, in the root of the depth and with half of
# what is known in advance, may begin with an infinite slope. Where E falls, an interval is the union of those of both.

ROWS = 5  # of the table
BEND, SLOPE = 0.5, 1.0
# trial contact points over the largest depth, at equal ratios of the depths from them to the last point: the contact point
# from which this depth counts is that of a homogeneous sample, which is late in one that stiffens
CONTACTS = 1.0 - np.geomspace(4.0, 0.4, 43)
BEFORE = 0.1  # share of the points before the contact, at least; where the baseline is shorter, half of it
# first step between the summed contact points, and accuracy of the best one, over the largest depth
STEP = 1e-4
CUT = 6.0  # excess of -log of the density at which the sum ends
LAST = 80  # summed contact points at most on each side
WEIGHINGS = 2  # fits from whose residuals the noise is estimated
LARGEST = 100.0  # log E [Pa] above this is cut, so that nothing overflows


class Course(NamedTuple):
    """The form of log E over the depth: a spline in this power of the depth, with differences between nodes whose standard
    deviations in advance are those above over ``advance``."""

    power: float
    advance: float


FIRST, SECOND = Course(1.0, 1.0), Course(0.5, 0.5)


class Conditional(NamedTuple):
    """The optimum at a given contact point: -log of the density, coordinates (log E at the nodes, baseline, tilt), their
    Fisher matrix, the force without baseline (n,), and the Jacobian (n, k) of the force."""

    contact: float
    cost: float
    x: np.ndarray
    fisher: np.ndarray
    force: np.ndarray
    slopes: np.ndarray


def modulus_over_depth(
    depth: np.ndarray, force: np.ndarray, law: Callable[[np.ndarray], np.ndarray], start: float, level: float
) -> tuple[tuple[float, float, float, float], ...]:
    """Return rows (depth [m], E, low, high [Pa]); none where the law is not finite at any trial contact point.

    depth, force (n,) about a first contact point [m, N]; law: force [N] over E [Pa] at depths from contact on; start: E.
    """
    deepest, top, n = float(depth.max()), float(np.ptp(force)), depth.size
    z, measured, along = depth / deepest, force / top, np.linspace(0.0, 1.0, n)
    nodes, each = np.linspace(0.0, 1.0, ROWS + 1), np.eye(ROWS + 1)
    in_advance = np.vstack([np.diff(each, 2, axis=0) / BEND, np.diff(each, axis=0) / SLOPE])
    in_advance = np.pad(in_advance, ((0, 0), (0, 2)))

    def splined(place: np.ndarray, power: float) -> np.ndarray:
        """Return log E (m, k) at places over the largest depth, per value at the nodes, as a spline in a power of it."""
        return scipy.interpolate.CubicSpline(nodes**power, each)(place**power)

    def at(contact: float, x: np.ndarray, sd: np.ndarray, course: Course = FIRST) -> Conditional:
        """Return the optimum at a contact point, from coordinates x; sd (n,) of the noise over the largest force."""
        d = np.maximum(z - contact, 0.0)
        spline, unit = splined(d / d.max(), course.power), law(d * deepest) / top
        known = course.advance * in_advance
        pushed = lambda x: unit * np.exp(np.minimum(spline @ x[:-2], LARGEST))

        def residual(x: np.ndarray) -> np.ndarray:
            return np.append((pushed(x) + x[-2] + x[-1] * along - measured) / sd, known @ x)

        def jacobian(x: np.ndarray) -> np.ndarray:
            slopes = np.column_stack([pushed(x)[:, None] * spline, np.ones(n), along])
            return np.vstack([slopes / sd[:, None], known])

        found = scipy.optimize.least_squares(residual, x, jacobian, method="lm")
        fisher, slopes = found.jac.T @ found.jac, found.jac[:n] * sd[:, None]
        return Conditional(contact, float(found.cost), found.x, fisher, pushed(found.x), slopes)

    # 1. Trial contact points at which the law is finite (a layer has a largest depth), with a baseline before the contact:
    # without one, a sample that begins at the first point and a negative tilt describe a curve as well.
    earliest = np.quantile(z, min(BEFORE, 0.5 * float(np.mean(z < 0.0))))
    within = (earliest < CONTACTS) & np.isfinite(law((1.0 - CONTACTS) * deepest))
    trials = CONTACTS[within]
    if not trials.size:
        return ()

    # 2. The optimum, with noise of the variance a^2 + b^2 force^2 and its correlation, both from the residuals before.
    def searched(
        starts: list[np.ndarray], sd: np.ndarray, course: Course
    ) -> tuple[Conditional, list[np.ndarray]]:
        """Return the optimum over the contact points, and the coordinates at the trial ones."""
        tried = [at(trial, own, sd, course) for trial, own in zip(trials, starts, strict=True)]
        first = int(np.argmin([one.cost for one in tried]))
        least, ends = tried[first], (trials[max(first - 1, 0)], trials[min(first + 1, trials.size - 1)])
        near = scipy.optimize.minimize_scalar(
            lambda contact: at(contact, least.x, sd, course).cost, bounds=ends, method="bounded",
            options={"xatol": STEP},
        )  # fmt: skip
        return at(float(near.x), least.x, sd, course), [one.x for one in tried]

    x = np.append(np.full(nodes.size, math.log(start)), [0.0, 0.0])
    starts = [x] * trials.size
    sd = np.full(n, sample_noise(force) / top)
    for turn in range(WEIGHINGS + 1):
        best, starts = searched(starts, sd, FIRST)
        x = best.x
        if turn == WEIGHINGS:
            break
        left = best.force + x[-2] + x[-1] * along - measured
        parts = np.stack([np.ones(n), best.force**2], -1)
        variance = parts @ scipy.optimize.nnls(parts / sd[:, None] ** 2, left**2 / sd**2)[0]
        sd = np.sqrt(np.maximum(variance, 1e-4 * np.mean(left**2)))
        # the variance that white noise would need for the errors of the coordinates that correlated noise has
        given = left / sd, best.slopes / sd[:, None], np.ones(x.size, dtype=bool), np.zeros(n)
        one_model = noise.ErrorModels(np.ones((1, n)), np.zeros(1))
        model = noise.noise_model(*given, one_model, x.size + 1, False)
        sd = sd * math.sqrt(model.share @ model.variance[:, 0, 0])

    def ends_of(middle: Conditional, course: Course) -> np.ndarray:
        """Return the ends (2, m) of the intervals of log E at the depths of the rows."""
        # Contact points to both sides until their density is negligible, in steps that follow its change.
        summed = [middle]
        for side in (-1.0, 1.0):
            one, step = middle, STEP
            for _ in range(LAST):
                contact = one.contact + side * step
                if not trials[0] <= contact <= trials[-1]:
                    break
                before, one = one, at(contact, one.x, sd, course)
                summed.append(one)
                if one.cost > middle.cost + CUT:
                    break
                change = abs(one.cost - before.cost)
                step *= 2.0 if change < 0.1 else 0.5 if change > 1.0 else 1.0
        summed.sort(key=lambda one: one.contact)

        # Normal distributions of log E at the depths of the rows, below each contact point's own, and the quantiles of their
        # sum. A depth d lies at d/(1 - contact) between the nodes, for a later contact beyond the last one, where the spline
        # is extrapolated. The weights are trapezoidal widths times the density.
        weights, means, sds = np.ones(1), [], []
        if len(summed) > 1:
            costs = np.array([one.cost for one in summed])
            weights = np.gradient([one.contact for one in summed]) * np.exp(costs.min() - costs)
        for one in summed:
            turned = splined(nodes[1:] * (1.0 - best.contact) / (1.0 - one.contact), course.power)
            covariance = np.linalg.inv(one.fisher)[: nodes.size, : nodes.size]
            means.append(turned @ one.x[:-2])
            sds.append(np.sqrt(np.einsum("ij,jk,ik->i", turned, covariance, turned)))
        share, ends = weights / weights.sum(), []
        for mean, spread in zip(np.transpose(means), np.transpose(sds), strict=True):
            beyond = lambda y, p, mean=mean, spread=spread: float(share @ ndtr((y - mean) / spread)) - p
            outer = float((mean - 9.0 * spread).min()), float((mean + 9.0 * spread).max())
            tails = 0.5 - 0.5 * level, 0.5 + 0.5 * level
            ends.append([scipy.optimize.brentq(beyond, *outer, args=(p,)) for p in tails])
        return np.transpose(ends)

    # 3. Intervals with the contact points summed; where E falls from the contact on, those of both splines together.
    value, ends = x[1:-2], ends_of(best, FIRST)
    if x[0] > x[1]:
        ends = np.vstack([ends, ends_of(searched(starts, sd, SECOND)[0], SECOND)])
    low, high = np.min([*ends, value], 0), np.minimum(np.max([*ends, value], 0), LARGEST)
    at_depths = nodes[1:] * (1.0 - best.contact) * deepest
    rows = np.stack([at_depths, np.exp(value), np.exp(low), np.exp(high)], -1)
    return tuple(tuple(row) for row in rows.tolist())
