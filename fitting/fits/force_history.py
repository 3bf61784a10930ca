"""Fit of a viscoelastic material to a force curve of a microscope: approach, dwell and retraction in one.

The contact grows, stays and shrinks as the tip moves, and the force follows from the motion alone. Let F(d) be the elastic
force of the tip at the depth d for J = 1, which a contact of the radius a(d) has, and F'(d) its stiffness, that of a punch
of this radius. The contact is then a row of elements y > 0, each of the stiffness F''(y) dy, that the tip meets one after
the other at the depth y (for a ball y = x^2/R, where x is the distance of the element from the axis; on a half-space this
is the Abel transform of the pressure, V. L. Popov, M. Hess, Method of Dimensionality Reduction, 2015). With the
displacement w(y, t) of an element and G the relaxation modulus,

    q(y, t) = int_0^t G(t - s) dw(y, s),     force = int F''(y) q(y, t) dy,
    in contact   w = d(t) - y and q >= 0;     free   q = 0 and w >= d(t) - y.

This is the solution of T. C. T. Ting (J. Appl. Mech. 33 (1966) 845; 35 (1968) 248), at any history of the tip, with further
approaches after a retraction as well. Proof: expand the pressure in those of punches, p(r, t) = -int dq/dy p_a(y)(r) dy,
which is zero outside the contact where q is. The displacement is int -dw/dy u_a(y)(r) dy, and u_a = 1 inside the punch, so
that inside a contact of elastic depth Y it is (Y - profile) + w(Y, t) = d(t) - profile. Only a constant Poisson's ratio has
been used, which makes the modulus a common factor; the punches may stand on a layer bonded to a rigid base
(``thin_layer.py``). While the contact grows, the force is int G(t - s) dF(d(s)) (Lee and Radok), and after a single maximum
int_0^t1 G(t - s) dF(d(s)) with int_t1^t G(t - s) dd(s) = 0.

The measured load has a baseline besides, which drifts in time and is inclined in depth, and the depth of the contact point
is unknown. All of them are fitted together.
"""

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.data.contact import (
    DEGREES,
    LEAST_CURVE,
    NO_CONTACT,
    PICO,
    ForceCurve,
    ForceUnits,
    baseline,
    by_sensitivity,
    calibration_in_words,
    sample_noise,
    smooth,
)
from fitting.data.indentation import IndentationData, depth_notes, probe_of, too_deep
from fitting.data.weights import choose_weights
from fitting.fits.laws import law_rows
from fitting.inference import noise, verdict
from fitting.inference.result import Fit, FitProblem, conclude, least_squares, plain, widened
from fitting.inference.sample import Deviation, Sample, Solved, judged_by_size
from fitting.models.parameters import Parameters, spectrum
from fitting.models.structure import LAWS, Law, Sought, creep_structure, over_span
from fitting.models.thin_layer import Base, ThinLayer
from fitting.search import nonlinear
from fitting.search.nonlinear import Objective
from fitting.search.press import indenter_creep
from fitting.views import sheet, text
from jaxcontact._support.exponential import phi1
from jaxcontact.bodies.materials import Spectrum, relaxation_modes

# 1. The relaxation modulus of a material as a sum of exponentials, G(t) = sum_m weights_m exp(-rates_m t).

MODELS = (
    "StandardLinearSolid", "KelvinVoigt", "Maxwell", "Burgers", "FractionalKelvinVoigt", "Springpot",
)  # fmt: skip
SLOWEST, FASTEST = (
    0.02,
    20.0,
)  # rates of a springpot's modes: times the reciprocals of the duration and of a gap
SPACING = 0.8  # of the logarithms of these rates; the error of the sum is about 2 exp(-pi^2/SPACING)
INSTANT = 2.0  # rate of what is faster than a gap, times FASTEST/gap


def modulus_of(
    theta: Array, unit: Array, extra: Array | float, own: Spectrum | None, model: str, decades: int
) -> tuple[Array, Array]:
    """Return weights and rates (k,) of the scaled relaxation modulus at the coordinates (m,) of a material.

    unit (3,): logarithms of the compliance [1/Pa] and of the duration [s], and the gap between samples over the duration;
    extra: compliance of the tip at once; own: its creep, None of one that does not creep. A Kelvin-Voigt element has the
    modulus G + eta/gap exp(-t/gap), with an instantaneous compliance, because the force on it alone would contain the rate
    of the measured depth.

    A springpot has G(t) = V t^-alpha/Gamma(1 - alpha) = V sin(pi alpha)/pi int exp(alpha x) exp(-t exp(x)) dx, by the
    trapezoidal rule. The slower terms, a geometric series, become one mode of their mean rate, and the faster ones a
    dashpot.
    """
    log_compliance, lapse, gap = unit
    if model not in LAWS:
        # springs and dashpots: the compliances, of a Kelvin-Voigt element with the instantaneous one above
        c = spectrum(jnp.append(theta, jnp.zeros(3)), None)
        if model == "KelvinVoigt":
            J, r = c.amplitudes, c.rates
            c = Spectrum((J * r * gap / (1.0 + r * gap))[0], J / (1.0 + r * gap), r / (1.0 + r * gap), 0.0)
        amplitudes, rates, flow = c.amplitudes, c.rates, c.fluidity
        if own is not None:  # the compliances of sample and tip add
            amplitudes = jnp.concatenate([amplitudes, own.amplitudes])
            rates = jnp.concatenate([rates, own.rates])
            if own.fluidity is not None:
                flow = own.fluidity if flow is None else flow + own.fluidity
        # the modulus from the creep, s G(s) = 1/(s J(s)) in partial fractions
        order = jnp.argsort(rates)
        sorted_ = Spectrum(c.instantaneous, amplitudes[order], rates[order], flow)
        rates, weights = relaxation_modes(sorted_, extra)
        return weights, rates

    # a springpot, or one beside a spring: the sum of the trapezoidal rule at x, and what is slower and faster
    *spring, log_V, alpha = theta
    V = jnp.exp(log_V + log_compliance - alpha * lapse)
    first = math.log(SLOWEST)
    count = math.ceil((math.log(FASTEST) + decades * math.log(10.0) - first) / SPACING)
    x, h = first + SPACING * jnp.arange(count), SPACING
    size = V * h * jnp.sin(jnp.pi * alpha) / jnp.pi
    series = lambda power, start: jnp.exp(power * start) / -jnp.expm1(-jnp.abs(power) * h)
    slow = series(alpha, first - h)  # sum of exp(power x) over the terms beyond
    slow_rate = series(alpha + 1.0, first - h) / slow
    instant = INSTANT * jnp.exp(x[-1] + h)
    fast = series(alpha - 1.0, x[-1] + h) * instant
    weights = size * jnp.concatenate([jnp.stack([slow]), jnp.exp(alpha * x), jnp.stack([fast])])
    rates = jnp.concatenate([jnp.stack([slow_rate]), jnp.exp(x), jnp.stack([instant])])
    if spring:
        weights = jnp.append(weights, jnp.exp(spring[0] + log_compliance))
        rates = jnp.append(rates, 0.0)
    return weights, rates


_modulus = functools.partial(jax.jit, static_argnames=("model", "decades"))(modulus_of)


# 2. The force over a history of the depth.

CELLS = 64  # elements along the largest contact radius

# coordinates after those of the material, scaled: the depth of contact, and the baseline with its change in time and depth
NUISANCES = {"contact_point": "m", "baseline": "N", "drift": "N/s", "slope": "N/m"}
POINT, BASELINE, DRIFT, SLOPE = range(-len(NUISANCES), 0)


class History(NamedTuple):
    """A scaled force curve.

    t, depth (n,): at the samples and turning points; pick (m,): places of the samples among them; power: of the depth in F;
    widening: power of the contact radius in the depth; layer over scaled depths, None on a half-space; extra: compliance of
    the tip at once; unit (3,) and own: of ``modulus_of``.
    """

    t: Array
    depth: Array
    pick: Array
    power: Array | float
    widening: Array | float
    layer: ThinLayer | None
    extra: Array | float
    unit: Array
    own: Spectrum | None = None

    def elastic_force(self, depth: Array) -> Array:
        """Return F at a depth () > 0."""
        return depth**self.power * (1.0 if self.layer is None else self.layer.factor(depth))

    def elements(self, deepest: Array, cells: int) -> tuple[Array, Array]:
        """Return depths y (cells,) at which the tip meets the elements, and their stiffnesses.

        They have equal widths along the contact radius of a ball or cone. An element stands for all y of its width by the
        mean of these with the weight F'', so that the elastic force at the largest depth is exact.
        """
        ends = deepest * jnp.linspace(0.0, 1.0, cells + 1)[1:] ** self.widening
        force, slope = jax.vmap(jax.value_and_grad(self.elastic_force))(ends)
        stiffness = jnp.diff(slope, prepend=0.0)
        moment = jnp.diff(ends * slope - force, prepend=0.0)
        return moment / stiffness, stiffness


def contact_force(
    weights: Array, rates: Array, t: Array, depth: Array, places: Array, stiffness: Array
) -> Array:
    """Return the force (n,) of elements at depths ``places`` (c,) of some ``stiffness`` (c,) over a depth (n,) at t (n,).

    weights, rates (k,): of the relaxation modulus. The displacement of an element is linear between the times.
    """
    x = rates * jnp.diff(t, prepend=t[:1])[:, None]
    decay, rise = jnp.exp(-x), weights * phi1(x)

    def step(
        carry: tuple[Array, Array], now: tuple[Array, Array, Array]
    ) -> tuple[tuple[Array, Array], Array]:
        # the parts of q relax over the step; stress (k, c): of each mode, place (c,): the displacement w
        (stress, place), (decay, rise, depth) = carry, now
        stress = stress * decay[:, None]
        # q = 0 at the end of the step without a tip (free); in contact the tip pushes the element further, w = d - y
        free = place - stress.sum(0) / rise.sum()
        after = jnp.maximum(depth - places, free)
        force = stiffness @ (after - free) * rise.sum()
        return (stress + rise[:, None] * (after - place), after), force

    # before the first time, at which the elements are taken as undeformed
    start = jnp.zeros((rates.size, places.size)), jnp.zeros(places.size)
    return jax.lax.scan(step, start, (decay, rise, depth))[1]


def indentation_force(theta: Array, curve: History, model: str, decades: int, cells: int = CELLS) -> Array:
    """Return the scaled force (n,) without the baseline at the samples; theta = (material, *``NUISANCES``)."""
    weights, rates = modulus_of(theta[:POINT], curve.unit, curve.extra, curve.own, model, decades)
    depth = curve.depth - theta[POINT]
    deepest = jnp.maximum(jnp.max(depth), 1e-6)
    return contact_force(weights, rates, curve.t, depth, *curve.elements(deepest, cells))[curve.pick]


def force_with_baseline(theta: Array, curve: History, model: str, decades: int) -> Array:
    """Return the scaled load (n,) at the samples: the force and the baseline + drift t + slope depth."""
    t, depth = curve.t[curve.pick], curve.depth[curve.pick]
    return (
        indentation_force(theta, curve, model, decades)
        + theta[BASELINE]
        + theta[DRIFT] * t
        + theta[SLOPE] * depth
    )


@functools.partial(jax.jit, static_argnames=("model", "decades"))
def _slopes(theta: Array, curve: History, model: str, decades: int) -> Array:
    """Return the Jacobian (n, m) of ``force_with_baseline``, without passes through the contact for its linear part."""
    of_contact = lambda first: indentation_force(theta.at[:BASELINE].set(first), curve, model, decades)
    t, depth = curve.t[curve.pick], curve.depth[curve.pick]
    return jnp.column_stack([jax.jacfwd(of_contact)(theta[:BASELINE]), jnp.ones(t.size), t, depth])


def _weighted_slopes(
    curve: History, weights: np.ndarray, model: str, decades: int, theta: np.ndarray, free: np.ndarray
) -> np.ndarray:
    """Return the Jacobian (n, k) of the residuals with ``weights`` (n,) by the coordinates at the places ``free``."""
    found = np.asarray(_slopes(jnp.asarray(theta), curve, model, decades))
    return weights[:, None] * found[: weights.size, free]


COARSE = 24  # elements in the comparison of starts


@functools.partial(jax.jit, static_argnames=("model", "decades"))
def unit_forces(thetas: Array, curve: History, model: str, decades: int) -> Array:
    """Return the scaled forces (k, n) without the baseline at trial coordinates (k, m)."""
    return jax.vmap(lambda theta: indentation_force(theta, curve, model, decades, COARSE))(thetas)


# 3. The curve, without what pulls, and the turning points of its motion.

MOST = 500  # largest number of points, or means of neighbours
ROUGH_POINTS = 120  # points on which starts are compared
TRIALS = 40  # trial contact points
PULLS = 5.0, 0.02  # least tension, in standard deviations of the noise and of the largest force
ADHESIVE = 0.1  # tension over the largest force, above which the contact of a retraction is not fitted
AFTER = 3  # further points that are left out after the last one that pulls
TURN, SHARP = 3, 0.2  # points of a line at a turn of the motion, and least relative change of its speed


def without_tension(curve: ForceCurve) -> ForceCurve:
    """Return the curve without the points of a retraction that pulls, since the model has no adhesion; where it pulls with
    more than ``ADHESIVE`` of the largest force, without all of the retraction's contact."""
    part = np.array(curve.parts)[curve.marks]
    back = np.flatnonzero(part == "retract")
    if back.size < LEAST_CURVE:
        return curve
    load, approach = smooth(curve.load[back]), curve.load[part == "approach"]
    rise, scatter = float(np.max(smooth(approach - baseline(approach)))), sample_noise(approach)
    # the tension below the lower of the baselines before and after the contact
    first = baseline(curve.load[curve.marks == curve.marks[0]])
    zero = min(first, float(np.median(curve.load[back[-max(back.size // 10, 5) :]])))
    tension, least = zero - float(load.min()), max(PULLS[0] * scatter, PULLS[1] * rise)
    if tension <= least:
        return curve
    pulls = np.flatnonzero(load < zero - 0.5 * least)
    all_contact = tension > ADHESIVE * rise
    kept = curve.kept.copy()
    kept[back[0 if all_contact else pulls[0] : pulls[-1] + 1 + AFTER]] = False
    note = (
        f"the retraction pulls with up to {tension * PICO:.3g} pN, {100 * tension / rise:.2g} % of the largest force,"
        f" and this model has no adhesion: {'its contact' if all_contact else 'the part that pulls'} left out"
        f" ({int(np.sum(~kept))} of {back.size} points)"
    )
    return curve._replace(kept=kept, notes=(*curve.notes, note))


def corners(curve: ForceCurve) -> np.ndarray:
    """Return times [s] and depths [m] (2, k) at which the motion turns between two samples: where the lines through the
    points on both sides intersect there."""
    jumps = np.flatnonzero(curve.marks[1:] != curve.marks[:-1])
    places = np.unique(np.append(jumps, int(np.argmax(curve.depth)))[:, None] + np.arange(-TURN, TURN))
    found = []
    for i in places[(places >= 1) & (places < curve.t.size - 2)]:
        sides = slice(max(i - TURN + 1, 0), i + 1), slice(i + 1, min(i + TURN + 1, curve.t.size))
        t, origin = curve.t - curve.t[i], curve.depth[i]
        if np.ptp(t[sides[0]]) <= 0.0 or np.ptp(t[sides[1]]) <= 0.0:
            continue
        (a, b), (c, d) = (np.polyfit(t[some], curve.depth[some] - origin, 1) for some in sides)
        if abs(a - c) <= SHARP * max(abs(a), abs(c)):
            continue
        time = (d - b) / (a - c)
        if 0.0 < time < t[i + 1]:
            found.append((time + curve.t[i], a * time + b + origin))
    return np.array(found).reshape(-1, 2).T


# 4. The search for the parameters of the material, the contact point and the baseline.

EDGE = 16.0  # e-folds about the scale of the data at which moduli are bounded
# starts: retarded over instantaneous compliance, time over contact; of a fractional law alpha, and the spring's part
RATIOS, TIMES = (0.25, 1.0, 4.0), (0.03, 0.3, 3.0)
EXPONENTS, SHARES = (0.05, 0.15, 0.3, 0.5, 0.75), (0.2, 0.7)
ALPHA = 0.002, 0.98  # bounds of alpha
STARTS = 4  # number of starts from which the search is made


def structure_of(model: Any) -> Any:
    """Return the structure of a material; ValueError for one that a force curve is not fitted with."""
    structure = creep_structure(model)
    if structure.model.__name__ not in MODELS:
        raise ValueError(f"model: expected one of {', '.join(MODELS)}, got {structure.model.__name__}")
    return structure


class HistoryModel(NamedTuple):
    """A scaled force curve with its search space.

    curve: in SI; history: scaled; measured (m,): scaled load of the points that are fitted, above the first baseline; model:
    name of the material, and decades: between the gap of the samples and the duration, both for ``modulus_of``; units: of
    the scaling; sought; space; sample: load over time.
    """

    curve: ForceCurve
    indenter: Any
    history: History
    measured: np.ndarray
    model: str
    decades: int
    units: ForceUnits
    sought: Sought
    space: Parameters
    sample: Sample

    @classmethod
    def of(
        cls,
        curve: ForceCurve,
        indenter: Any,
        sought: Sought,
        thickness: float | None,
        unbonded: bool,
        weights: str | None,
        sigma: Any,
    ) -> "HistoryModel":
        """Return the scaled problem of a curve; ValueError where nothing changes in it."""
        # units, and the load above the first baseline
        probe, nu = probe_of(indenter), sought.volume.value
        units = ForceUnits.of(curve, float(np.max(curve.depth)), probe, sought.volume.one_minus_nu)
        units.check()
        load, depth, T, compliance = units
        above = (curve.load - baseline(curve.load[curve.marks == curve.marks[0]]))[curve.kept]
        layer = None
        if thickness is not None:
            layer = ThinLayer.of(indenter, thickness, nu, Base(bonded=not unbonded)).over(depth)

        # compliance of the tip over 1 - nu of the sample, scaled: at once, and its creep where it creeps
        creep, per_unit = indenter_creep(indenter), sought.volume.one_minus_nu * compliance
        extra, own = float(creep.instantaneous) / per_unit, None
        if creep.rates.size or creep.fluidity is not None:
            flow = 0.0 if creep.fluidity is None else creep.fluidity * T / per_unit
            own = Spectrum(jnp.zeros(()), creep.amplitudes / per_unit, creep.rates * T, jnp.asarray(flow))

        # times of samples and turning points; the gap is the usual one of the samples
        turns = corners(curve)
        times = np.concatenate([curve.t, turns[0]])
        order = np.argsort(times, kind="stable")
        pick = np.argsort(order, kind="stable")[: curve.t.size][curve.kept]
        gaps = np.diff(curve.t)
        gap = float(np.median(gaps[gaps > 0.0])) / T
        decades = math.ceil(-math.log10(gap))
        grid = (
            nonlinear.repeated(times[order] / T),
            nonlinear.repeated(np.concatenate([curve.depth, turns[1]])[order] / depth),
        )
        history = History(
            *grid, nonlinear.repeated(pick), probe.power, 1.0 / (probe.power - 1.0) if probe.power > 1.0 else 1.0,
            layer, extra, np.array([math.log(compliance), math.log(T), gap]), own,
        )  # fmt: skip

        # the fitted points with their weights, and the coordinates with their bounds
        t = curve.t[curve.kept]
        weight, label = choose_weights(t, above, weights, sigma)
        sample = Sample.of(("load", "N", t, above), weight, label, curve.marks[curve.kept], own_trends=True)
        back = "retract" in np.array(curve.parts)[sample.blocks]
        sought, space = _space(sought, units, gap, bool(back))
        model = sought.structure.model.__name__
        return cls(
            curve,
            indenter,
            history,
            above / load,
            model,
            decades,
            units,
            sought,
            space,
            sample,
        )

    def objective(self, weights: np.ndarray) -> Objective:
        """Return the least-squares objective for weights (m,) [1/N]."""
        own, measured = weights * self.units.load, nonlinear.repeated(self.measured)
        found = Objective.of(
            force_with_baseline, self.history, measured, nonlinear.without_weight(own), self.space,
            points=slice(weights.size), static=(self.model, self.decades),
        )  # fmt: skip
        slopes = functools.partial(_weighted_slopes, self.history, own, self.model, self.decades)
        return dataclasses.replace(found, jacobian=slopes)

    def modulus(self, theta: np.ndarray, t: Any) -> np.ndarray:
        """Return the relaxation modulus [Pa] at times [s]."""
        weights, rates = self.modes(theta)
        return np.exp(-np.multiply.outer(np.asarray(t, dtype=float), rates)) @ weights

    def modes(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the weights [Pa] and rates [1/s] of the relaxation modulus of the sample with its tip."""
        history = self.history
        given = jnp.asarray(theta[:POINT]), history.unit, history.extra, history.own, self.model, self.decades
        weights, rates = (np.asarray(part) for part in _modulus(*given))
        return weights / self.units.compliance, rates / self.units.time

    def starts(self) -> list[np.ndarray]:
        """Return the best coordinates of trial materials and contact points; at each of these the modulus as a whole and the
        baseline are linear, and follow from least squares."""
        # a few of the points, with that of the largest depth
        n, kept = self.curve.t.size, self.curve.kept
        some = np.unique(np.linspace(0, n - 1, min(n, ROUGH_POINTS)).round().astype(int))
        some = np.unique(np.append(some, int(np.argmax(self.curve.depth))))
        few = self.history._replace(
            t=nonlinear.repeated(self.curve.t[some] / self.units.time),
            depth=nonlinear.repeated(self.curve.depth[some] / self.units.depth),
            pick=nonlinear.repeated(np.flatnonzero(kept[some])),
        )
        some = some[kept[some]]
        t, depth = self.curve.t[some] / self.units.time, self.curve.depth[some] / self.units.depth
        places = np.cumsum(kept)[some] - 1
        y, w = self.measured[places], self.sample.weights[places] * self.units.load

        # The best contact point with each material: the baseline is projected out of the measured and the trial forces.
        # Without a slope in depth, which would be a drift, it has two terms.
        trials = np.linspace(0.0, 1.0, TRIALS, endpoint=False)
        base = (
            w[:, None]
            * np.stack([np.ones(t.size), t, depth], -1)[:, : 3 if self.space.upper[SLOPE] > 0.0 else 2]
        )
        Q = noise.basis(base)
        rest = w * y - Q @ (Q.T @ (w * y))
        found: list[tuple[float, np.ndarray]] = []
        for material in self._materials():
            thetas = np.zeros((TRIALS, material.size + len(NUISANCES)))
            thetas[:, : material.size] = material
            thetas[:, POINT] = trials
            forces = w * np.asarray(unit_forces(thetas, few, self.model, self.decades))[:, : some.size]
            with np.errstate(all="ignore"):  # of trials whose force is not finite, or zero
                others = forces - (forces @ Q) @ Q.T
                squares = np.sum(others * others, -1)
                size = others @ rest / squares
                apart = (size > 0.0) & (squares > 1e-20 * np.sum(forces * forces, -1))
                rss = np.where(apart, rest @ rest - size**2 * squares, math.inf)
            best = int(np.argmin(rss))
            if math.isfinite(rss[best]):
                x = np.linalg.lstsq(base, w * y - size[best] * forces[best], rcond=1e-10)[0]
                parts = self._scaled(material, size[best]), [trials[best]], x, np.zeros(3 - x.size)
                found.append((float(rss[best]), np.concatenate(parts)))
        if not found:
            raise ValueError(NO_CONTACT)
        found.sort(key=lambda one: one[0])
        return [np.clip(theta, *self.space.bounds) for _, theta in found[:STARTS]]

    def _materials(self) -> list[np.ndarray]:
        """Return coordinates of materials of about the unit of compliance, over ratios and times."""
        pushed = smooth(self.measured) > 0.1 * self.measured.max()
        contact = max(
            float(np.ptp(self.sample.t[pushed])) / self.units.time, 10.0 * float(self.history.unit[2])
        )
        logs, (size, lapse, _) = np.log, self.history.unit
        if self.model in LAWS:
            rows = []
            for alpha in EXPONENTS:
                pot = lambda part, a=alpha: logs(part) - size + a * (lapse + logs(contact))
                if self.model == "Springpot":
                    rows.append([pot(1.0), alpha])
                else:
                    rows += [[logs(share) - size, pot(1.0 - share), alpha] for share in SHARES]
            return [np.array(row) for row in rows]
        times = contact * np.array(TIMES)
        if self.model == "Maxwell":
            return [np.array([0.0, 1.0 / time]) for time in (*times, 10.0 * times[-1])]
        if self.model == "KelvinVoigt":
            return [np.array([-EDGE, 0.0, 0.0, -logs(time)]) for time in times]
        flows = (0.3 / contact, 3.0 / contact) if self.model == "Burgers" else (0.0,)
        return [
            np.array([0.0, logs(ratio), flow, logs(ratio / time)])
            for ratio in RATIOS
            for time in times
            for flow in flows
        ]

    def _scaled(self, material: np.ndarray, stiffness: float) -> np.ndarray:
        """Return the coordinates of a material whose moduli are ``stiffness`` times as large: of a law they are logarithms
        of moduli, else compliances or their logarithms."""
        logs = self.space.logarithmic[: material.size]
        change = math.log(stiffness)
        if self.model in LAWS:
            return material + change * logs
        return np.where(logs, material - change, material / stiffness)


def _space(sought: Sought, units: ForceUnits, gap: float, back: bool) -> tuple[Sought, Parameters]:
    """Return the sought material, and the coordinates with their bounds.

    gap: between samples over the duration; back: whether there is a retraction, without which a drift in time and a slope
    in depth are one.
    """
    load, depth, T, compliance = units
    others = np.array([[0.0, 1.0], [-2.0, 2.0], [-4.0, 4.0], [-4.0, 4.0] if back else [0.0, 0.0]])
    sizes = np.array([depth, load, load / T, load / depth])
    names, structure = tuple(NUISANCES), sought.structure
    if not isinstance(structure, Law):
        unit = structure.units(compliance, T)
        box = structure.box(sought.table) / unit[:, None]
        own = Parameters.of_compliances(structure, box, unit, decades=-math.log(gap))
        open_sides = np.concatenate([own.open, np.zeros((4, 2), dtype=bool)])
        # the instantaneous compliance of a Kelvin-Voigt element, which is not one of its parameters
        rows = np.concatenate([np.maximum(np.stack(own.bounds, -1), -EDGE), others])
        logs = own.logarithmic
    else:
        sought = over_span(sought, (gap * T, T))
        structure, lapse = sought.structure, math.log(T)
        law = law_rows(sought.table, -math.log(compliance), EDGE, (lapse, lapse), ALPHA)
        rows, unit = np.concatenate([np.array(list(law.values())), others]), np.ones(structure.size)
        logs = np.array([name != "alpha" for name in structure.where])
        open_sides = np.concatenate([np.ones((structure.size, 2), dtype=bool), np.zeros((4, 2), dtype=bool)])
    count = structure.size + len(NUISANCES)
    material = np.arange(count) < structure.size
    return sought, Parameters.of(
        structure, rows, unit=np.append(unit, sizes), logarithmic=np.append(logs, np.zeros(4, dtype=bool)),
        material=material, nuisances=names, open=open_sides,
    )  # fmt: skip


# 5. Judgement: systematic deviations by their size, as of the elastic fit. The model is fitted again to the shallower half.

CHANGE = (
    0.4  # of ln G between half the depth and the whole, beyond which a fit is rejected: +49 or -33 % of G
)
TREND = 0.05  # likewise, trend of the residuals over the largest force
HALF = 0.5  # of the largest depth


def deviation(problem: FitProblem, force: HistoryModel, solved: Solved) -> Deviation:
    """Return the systematic deviation of a solved force curve."""
    theta, unit = solved.theta, force.units.load
    kept, marks, t = force.curve.kept, force.sample.blocks, force.sample.t

    # a curve without a baseline or an indentation determines nothing
    depth = force.curve.depth[kept] / force.units.depth - theta[POINT]
    deviations, nothing = solved.residual / solved.weights / unit, np.zeros(theta.size)
    first = marks == marks[0]
    pushed = model_force(force, theta) / unit
    out, inside = first & (depth < 0.0), pushed > 0.0
    if out.sum() < max(5, verdict.SHORT * first.sum()):
        return Deviation(
            nothing,
            (
                f"the contact is among the first points ({int(out.sum())} before it): the curve has no baseline, so that"
                " the contact point is not determined",
            ),
        )
    if inside.sum() < verdict.FEW:
        return Deviation(nothing, (f"no indentation: {int(inside.sum())} points in contact",))
    scatter = float(np.std(deviations[out]))
    if pushed.max() < verdict.SEEN * scatter:
        return Deviation(
            nothing,
            (
                f"no indentation: the force rises by {pushed.max() * unit * PICO:.3g} pN, the noise of the baseline is"
                f" {scatter * unit * PICO:.3g} pN",
            ),
        )

    # a trend by its size: how the relaxation modulus changes with a fit to half the depth
    contact = float(np.ptp(t[inside]))
    times = contact * np.array([0.1, 1.0])

    def refits() -> list[np.ndarray | None]:
        """Return the fit to the parts of the curve up to half the largest depth; the history remains the whole one."""
        some = depth <= HALF * depth.max()
        if np.sum(some & inside) < verdict.FEW:
            return [None]
        return [nonlinear.minimise(force.objective(np.where(some, solved.weights, 0.0)), theta).theta]

    def moduli(one: np.ndarray) -> np.ndarray:
        """Return the logarithms of the relaxation modulus at a tenth of the time in contact and at this time."""
        return np.log(np.maximum(force.modulus(one, times), 1e-300))

    def words(trend: float, changes: np.ndarray, rejected: bool) -> str:
        percent = 100.0 * np.expm1(np.max(np.abs(changes)))
        size = (
            f"the residuals have a trend of {100 * trend:.1f} % of the largest force ({trend * unit * PICO:.3g} pN), up to"
            f" half the depth the modulus differs by {percent:.2g} %"
        )
        if not rejected:
            return f"{size}: within the intervals"
        return (
            f"{size} after {times[0]:.2g} to {times[1]:.2g} s: another model of the material, a thin sample (thickness),"
            " adhesion, or another shape of the tip"
        )

    size = lambda: max(verdict.trend(deviations[marks == mark]) for mark in np.unique(marks))
    return judged_by_size(problem, solved, size, refits, moduli, (TREND, CHANGE), words)


def model_force(force: HistoryModel, theta: np.ndarray) -> np.ndarray:
    """Return the force (m,) [N] of the model without the baseline."""
    found = _force(jnp.asarray(theta), force.history, force.model, force.decades)
    return np.asarray(found)[: force.measured.size] * force.units.load


_force = functools.partial(jax.jit, static_argnames=("model", "decades"))(indentation_force)


def force_of_baseline(force: HistoryModel, theta: np.ndarray) -> np.ndarray:
    """Return the baseline (m,) [N]."""
    t, depth = force.sample.t / force.units.time, force.curve.depth[force.curve.kept] / force.units.depth
    return (theta[BASELINE] + theta[DRIFT] * t + theta[SLOPE] * depth) * force.units.load


# 6. The fit.


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ViscoelasticForceFit(Fit):
    """The fit of a viscoelastic material to approach, dwell and retraction of a force curve; ``Fit`` has what it shares with
    other fits.

    Attributes:
        nuisances: {contact_point [m], baseline [N], drift [N/s], slope [N/m]: (value, low, high)}; the contact point is a
            depth as measured, the baseline is that at the first fitted point above the first tenth of the approach, and it
            changes with time and with the depth. Where drag was subtracted, also the drag [N s/m].
        indenter, nu, thickness [m], unbonded: given quantities on which the material is conditional; thickness is None for
            a half-space, and unbonded whether a layer slides on its base.
        segments (n,): "approach", "hold" or "retract" of each point.
        depth, force, model_force (n,): depth below the contact point [m], force without baseline [N], and that of the model.
        modes: weights [Pa] and rates [1/s] of the relaxation modulus as a sum of exponentials.
        contact_time: time [s] between the first and the last contact of the model.
    """

    indenter: Any
    nu: float
    thickness: float | None
    unbonded: bool
    nuisances: dict[str, tuple[float, float, float]]
    segments: np.ndarray
    depth: np.ndarray
    force: np.ndarray
    model_force: np.ndarray
    modes: tuple[np.ndarray, np.ndarray]
    contact_time: float

    def relaxation(self, t: Any) -> np.ndarray:
        """Return the relaxation modulus G(t) [Pa] at t >= 0 [s] of any shape, as the fit has it: between the gap of the
        samples and the duration of the curve, on an elastic tip that of sample and tip in series."""
        weights, rates = self.modes
        return np.exp(-np.multiply.outer(np.asarray(t, dtype=float), rates)) @ weights

    def plot(self, path: Any = None) -> Any:
        """Return a figure of force over depth, and of the residuals; saved where a path is given."""
        _, low, high = self.nuisances["contact_point"]
        breaks = np.flatnonzero(self.segments[1:] != self.segments[:-1]) + 1

        def panel(top: Any, bottom: Any) -> None:
            for part in np.split(np.arange(self.depth.size), breaks):
                colour = sheet.COLOURS[str(self.segments[part[0]])]
                for axes, y in ((top, self.force), (bottom, PICO * (self.force - self.model_force))):
                    axes.plot(
                        self.depth[part],
                        y[part],
                        ".",
                        markersize=3,
                        color=colour,
                        label=self.segments[part[0]],
                    )
                top.plot(self.depth[part], self.model_force[part], color="0.2", linewidth=1.0)
            top.plot(0.0, 0.0, "o", color="0.2", label="contact point")
            top.axvspan(-0.5 * abs(high - low), 0.5 * abs(high - low), color="0.5", alpha=0.3, linewidth=0)
            handles, labels = top.get_legend_handles_labels()
            once = dict(zip(labels, handles, strict=True))
            top.legend(once.values(), once.keys(), fontsize="small")
            sheet.axis_label(top.yaxis, "force", "N", self.force)
            sheet.axis_label(bottom.xaxis, "depth below the contact point", "m", np.abs(self.depth))
            bottom.set_ylabel("residual [pN]")

        return sheet.draw(self, path, panel)

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with the nuisance parameters and the given quantities."""
        key = lambda name: text.key(name, NUISANCES.get(name, "N s/m"))
        return super().to_dict() | {
            "poisson_ratio": self.nu, "thickness_m": plain(self.thickness), **probe_of(self.indenter).key,
            "nuisances": {key(name): [plain(v) for v in row] for name, row in self.nuisances.items()},
            "largest_depth_m": float(self.depth.max()), "contact_time_s": self.contact_time,
        }  # fmt: skip

    def _choices(self) -> list[str]:
        return [*super()._choices(), probe_of(self.indenter).words]

    def _nuisance_lines(self) -> list[str]:
        return [
            f"  {name.replace('_', ' ')} = {value:.5g} {NUISANCES.get(name, 'N s/m')}, {low:.5g} to {high:.5g}"
            for name, (value, low, high) in self.nuisances.items()
        ]

    def _combination_lines(self) -> list[str]:
        times = self.contact_time * np.array([0.1, 1.0])
        early, late = self.relaxation(times)
        E = 2.0 * (1.0 + self.nu)
        return [
            f"  relaxation modulus: E = {E * early:.4g} Pa after {times[0]:.3g} s, {E * late:.4g} Pa after {times[1]:.3g} s,"
            " a tenth of the time in contact and all of it"
        ]

    def _conditions(self) -> list[str]:
        body = text.layer(self.thickness, self.unbonded)
        return [
            f"  the material is conditional on nu = {self.nu:.4g} and {body}; largest depth {self.depth.max():.4g} m,"
            f" contact for {self.contact_time:.3g} s"
        ]


def fit_history(
    data: IndentationData, model: Any, *, indenter: Any, nu: float, thickness: float | None, unbonded: bool,
    weights: str | None, sigma: Any, fixed: dict[str, float] | None, bounds: dict[str, tuple] | None,
    errors: dict[str, float], spring_constant: float | None, dragged: Any, redrawn: Callable[[float], IndentationData],
    level: float, notes: tuple[str, ...],
) -> ViscoelasticForceFit:  # fmt: skip
    """Fit a viscoelastic material to a force curve, for ``fit_force``, whose arguments these are.

    data: without drag; dragged: the ``Drag`` that was subtracted, or None; redrawn(b): the curve without another drag b
    [N s/m]; notes: of ``without_drag``.
    """
    # 1. The model, and the curve about its contact, which a comparison of starts on few points finds.
    sought = Sought.of(structure_of(model), fixed, bounds, nu)
    if sought.structure.model in LAWS.values() and indenter.material is not None:
        raise ValueError(
            f"indenter: expected a rigid one with {sought.structure.model.__name__}, got one with a material"
        )

    def prepared(curve: ForceCurve) -> HistoryModel:
        return HistoryModel.of(curve, indenter, sought, thickness, unbonded, weights, sigma)

    segments = without_tension(ForceCurve.whole(data))
    coarse = prepared(segments.thinned(2 * ROUGH_POINTS))
    point = float(coarse.starts()[0][POINT]) * coarse.units.depth
    curve = segments.near_contact(point - (coarse.curve.zero - segments.zero)).thinned(MOST)
    force = prepared(curve)

    # 2. The optimum, and the systematic deviations of the curve from it.
    def searched(force: HistoryModel, starts: list[np.ndarray]) -> tuple[FitProblem, Solved]:
        problem = FitProblem(data, force.sought, force.space, force.sample, float(force.curve.t[-1]), level)
        return problem, least_squares(problem, force.objective, starts)

    problem, solved = searched(force, force.starts())
    theta, (unit, deepest, duration, _) = solved.theta, force.units
    deviated = deviation(problem, force, solved)
    fitted = model_force(force, theta)
    t, marks = force.sample.t, force.sample.blocks
    below, inside = curve.depth[curve.kept] - theta[POINT] * deepest, fitted > 0.0

    # 3. Notes on the curve, the model and the strain, and the fit with its intervals by the noise.
    said = list(curve.remarks)
    parts = [curve.parts[mark] for mark in dict.fromkeys(marks.tolist())]
    said.append(f"Ting's solution over {', '.join(parts)}")
    if "retract" not in parts:
        said.append("no retraction: the baseline has a drift and no slope in depth, which would be alike")
    if force.model == "KelvinVoigt":
        said.append(
            f"the modulus of the Kelvin-Voigt element is G + eta exp(-t/T)/T with the time of a sample, T ="
            f" {float(force.history.unit[2]) * duration:.3g} s: without an instantaneous compliance it would resist a jump"
            " of depth without limit; StandardLinearSolid fits this compliance"
        )
    deepest = float(below.max())
    said += depth_notes(indenter, deepest, thickness)
    if "retract" in parts and fitted[-1] > 0.1 * unit:
        said.append(
            "the curve ends in contact: its baseline after contact is not seen, and drift and creep are less apart"
        )
    against = (*too_deep(indenter, deepest), *deviated.against)
    solved = solved._replace(
        systematic=deviated.systematic, against=against, notes=(*said, *notes, *deviated.notes)
    )
    found = conclude(problem, solved)

    # 4. Errors of the calibration and of the drag, from fits to curves that are changed by one standard deviation of each
    # cause. changes: of the logarithms of the parameters, and after them of the coordinates [SI], by each cause.
    size, values, best = force.sought.structure.size, found.common.values, found.common.estimate.best
    changes: list[np.ndarray] = []
    causes: list[str] = []

    def refitted(changed: ForceCurve) -> np.ndarray:
        """Return the logarithms of the parameters, and after them the coordinates [SI], of a changed curve."""
        again = prepared(changed)
        _, moved = searched(again, [np.clip(theta, *again.space.bounds)])
        own = again.space.opened(moved.theta) * again.space.unit[:size]
        logs = np.log([float(v) for v in force.sought.structure.parameters(own).values()])
        return np.concatenate([logs, own])

    if errors:
        if errors.get("spring_constant"):
            # moduli are proportional to the spring constant, compliances to its inverse; not an order, nor what is held
            table, where = force.sought.table, force.sought.structure.where
            scales = {name: float(name != "alpha" and table[name][0] < table[name][1]) for name in values}
            scaled = np.ones(size)
            scaled[[where[name] for name in scales]] = list(scales.values())
            changes.append(errors["spring_constant"] * np.concatenate([list(scales.values()), best * scaled]))
        if errors.get("sensitivity"):
            slopes = by_sensitivity(lambda change: refitted(curve.recalibrated(change, spring_constant)))
            changes.append(errors["sensitivity"] * slopes)
        causes.append(calibration_in_words(errors))
    nuisances: dict[str, tuple[float, float, float]] = {}
    if dragged is not None:
        half = noise.two_sided(level, DEGREES) * dragged.sd
        nuisances["drag"] = dragged.coefficient, dragged.coefficient - half, dragged.coefficient + half
        if dragged.sd > 0.0:
            changed = [redrawn(max(dragged.coefficient + s * dragged.sd, 0.0)) for s in (1.0, -1.0)]
            ends = [
                refitted(without_tension(ForceCurve.whole(one)).near_contact(point).thinned(MOST))
                for one in changed
            ]
            changes.append(0.5 * (ends[0] - ends[1]))
            causes.append("drag")
    common = found.common
    if np.any(changes):
        spread = np.linalg.norm([change[: len(values)] for change in changes], axis=0)
        moves = [change[len(values) :] for change in changes]
        further = dict(zip(values, spread.tolist(), strict=True))
        percent = ", ".join(f"{name} {100 * sd:.3g} %" for name, sd in further.items())
        note = f"the intervals include the standard deviations of the {' and '.join(causes)}: {percent}"
        common = widened(common, problem, further, moves, note)

    # 5. Contact point and baseline in SI, with the sign that depth has in the file: (value, low, high), whose ends are
    # exchanged with the sign.
    rows = np.column_stack([theta, found.ends])[POINT:] * force.space.unit[POINT:, None]
    rows[POINT] = curve.inward * (rows[POINT] + curve.zero)
    rows[SLOPE] *= curve.inward
    for i in (POINT, SLOPE):
        if curve.inward < 0:
            rows[i] = rows[i, [0, 2, 1]]
    nuisances = {name: tuple(row.tolist()) for name, row in zip(NUISANCES, rows, strict=True)} | nuisances
    return found._replace(common=common).fit(
        ViscoelasticForceFit, indenter=indenter, nu=nu, thickness=thickness, unbonded=unbonded, nuisances=nuisances,
        segments=np.array(curve.parts)[marks],
        depth=below, force=force.measured * unit - force_of_baseline(force, theta), model_force=fitted,
        modes=force.modes(theta), contact_time=float(np.ptp(t[inside])) if np.any(inside) else 0.0,
    )  # fmt: skip
