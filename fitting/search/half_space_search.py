"""Search of the fit of a probe on a half-space, or on a layer bonded to a rigid base: its objective, starts and notes.

Under depth control, or with an unknown contact point, there may be several minima. The search then starts from several
retardation times on a subset of the points, and continues with all points from the lowest minimum.
"""

import functools
from typing import Any

import jax
import numpy as np

from fitting.models import adhesion, halfspace
from fitting.models.coordinates import Space
from fitting.models.halfspace import Curve
from fitting.models.history import merge
from fitting.models.thin_layer import ThinLayer
from fitting.search import nonlinear, padding
from fitting.search.nonlinear import Best, Objective, moved
from fitting.search.press import Found, IndentationProblem, Medium, spread_starts, start
from jaxcontact._support.prefixes import told_apart

STRAIN = 0.2  # depth over the thickness of a layer beyond which linear theory is doubtful
FALL = 0.02  # fraction of the largest depth by which the depth may fall without the contact shrinking
FEW = 126  # number of points on which several minima are sought


def search(press: IndentationProblem) -> Found:
    """Return the optimum of a test on a half-space or a layer on a rigid base."""
    rise = press.pressing.rise
    knots, values = (press.t, press.load) if rise is None else _held(press, rise)
    falls = bool(np.any(press.depth < np.maximum.accumulate(press.depth) - FALL))
    shrinks = falls and press.probe.power > 1.0  # the contact of a flat punch does not change
    kind = "load" if press.pressing.control == "load" else "ting" if shrinks else "depth"
    kind = f"sticky {press.pressing.control}" if press.pressing.adhesion else kind
    whole, few = np.arange(press.t.size), _some(press)
    objective = _objective(press, whole, knots, values, kind)
    coarse = _objective(press, few, knots, values, kind) if few.size < whole.size else objective
    low = nonlinear.minimise_from(coarse, _starts(press, knots, values, kind))
    best = low if coarse is objective else nonlinear.minimise(objective, low.theta)
    best = best._replace(starts=low.starts, agreed=low.agreed, others=low.others)
    curve = _curve(press, whole, knots, values)
    notes, moves = _notes(best, press, kind), functools.partial(_moves, press, best, curve, kind)
    residual = functools.partial(_residual_at, press.space, curve, kind, whole.size)
    found = Found(press, best, objective, notes, moves, Medium(press.pressing.thickness), residual)
    if not press.pressing.adhesion:
        return found
    slow = nonlinear.minimise(_objective(press, whole, knots, values, kind, edge=1.0), best.theta)
    return _stuck(found._replace(slow=slow), curve, kind)


def _residual_at(space: Space, curve: Curve, kind: str, n: int, theta: Any) -> Any:
    """Return the weighted residuals (n,) at a vector of coordinates; a module function, so that fits can be pickled."""
    return halfspace.evaluate(space.point(theta), curve, kind=kind)[:n]


def _stuck(found: Found, curve: Curve, kind: str) -> Found:
    """Return the result with the notes and reasons for rejection that concern adhesion."""
    press = found.press
    scaled = halfspace.sticky_area(press.space.point(found.best.theta), curve, kind)
    alpha, creep = (np.asarray(part)[: press.t.size] for part in scaled)
    radius = float(press.pressing.indenter.radius)
    widest = float(np.sqrt(radius * press.units.depth * alpha.max()))
    modulus = 2.0 / (creep[0] * press.units.compliance * press.sought.volume.share)
    doubled = press.t[creep > 2.0 * creep[0]]
    lives = 1.0 / doubled[0] if doubled.size else 1.0
    doubts = adhesion.doubts(press.pressing.adhesion, radius, widest, modulus, lives)
    return found._replace(notes=(*found.notes, *doubts), against=adhesion.against(alpha))


def _objective(
    press: IndentationProblem,
    points: np.ndarray,
    knots: np.ndarray,
    values: np.ndarray,
    kind: str,
    edge: float = 0.0,
) -> Objective:
    """Return the least-squares objective over some of the points, padded internally.

    Residuals and Jacobian are one program: a second one for the residuals alone would take longer to compile than it
    saves.
    """
    curve, space, n = _curve(press, points, knots, values)._replace(edge=edge), press.space, points.size

    @functools.lru_cache(maxsize=2)
    def linear(theta: bytes) -> list[np.ndarray]:
        both = halfspace.linear(space.point(np.frombuffer(theta)), space.free, curve, kind=kind)
        return [np.asarray(part)[:n] for part in both]

    return Objective(
        lambda theta: linear(theta.tobytes())[0],
        lambda theta, free: linear(theta.tobytes())[1],
        *space.bounds,
        floor=1e-26 * float(np.sum((press.weights * press.measured) ** 2)),
    )


def _curve(press: IndentationProblem, points: np.ndarray, knots: np.ndarray, values: np.ndarray) -> Curve:
    """Return the samples at ``points``, padded."""
    t, load, depth = (padding.repeated(y[points]) for y in (press.t, press.load, press.depth))
    basis = merge(t, padding.repeated(knots), padding.repeated(values))
    weights = padding.without_weight(press.weights[points])
    return Curve(
        t, load, depth, weights, basis, press.extra, press.bulk, press.probe.power, int(np.argmax(depth)),
        press.pull, layer=press.layer,
    )  # fmt: skip


def _some(press: IndentationProblem) -> np.ndarray:
    """Return a subset of the points, evenly spaced and including the largest depth."""
    even = np.linspace(0, press.t.size - 1, min(FEW, press.t.size)).round().astype(int)
    return np.unique(np.append(even, np.argmax(press.depth)))


def _held(press: IndentationProblem, rise: float) -> tuple[np.ndarray, np.ndarray]:
    """Return knots and values of a linear rise to the mean load after it."""
    size, end = float(press.load[press.kept].mean()), rise / press.units.duration
    if rise == 0.0:
        return np.array([0.0, 1.0]), np.array([size, size])
    return np.array([0.0, end, 1.0]), np.array([0.0, size, size])


def _starts(press: IndentationProblem, knots: np.ndarray, values: np.ndarray, kind: str) -> list[np.ndarray]:
    """Return starting coordinates from variable projection: depth^power is linear in the compliances under the measured
    load."""
    depth, n = np.maximum(press.depth, 1e-3), press.probe.power
    use = press.kept & ((kind != "ting") | (np.arange(press.t.size) <= int(np.argmax(press.depth))))
    # weights of the depth: those of the fit under load control, uniform otherwise
    even = press.weights if press.pressing.control == "load" else np.ones(press.t.size)
    raised = depth**n if press.layer is None else depth**n * np.exp(press.layer.log_factor(depth))
    power = padding.repeated(raised - press.extra * press.load)
    weights = padding.without_weight(use * depth / (n * raised) * even)
    basis = merge(padding.repeated(press.t), padding.repeated(knots), padding.repeated(values))
    one = kind == "load" and np.all(press.space.material[press.space.free])
    several = [] if one else spread_starts(press, power, weights, basis)
    # a single start searches over every retardation time
    return several or [start(press, power, weights, basis, least=1e-6)]


def _moves(press: IndentationProblem, best: Best, curve: Curve, kind: str, name: str) -> np.ndarray:
    """Return the derivative of the coordinates with respect to a held quantity; with nu every compliance scales as 1/(1
    - nu)."""
    space = press.space
    if name != press.sought.volume.name and (name != "thickness" or press.layer is None):
        raise ValueError(f"spread: a half-space has no {name}")
    if name in ("nu", "thickness"):
        alone = np.where(space.logarithmic, 1.0, best.theta) * space.material / press.sought.volume.share
        found = alone if name == "nu" else np.zeros(best.theta.size)
        return found if press.layer is None else found + _layer_moves(press, best, curve, kind, name)
    slope = np.asarray(halfspace.bulk_slope(space.point(best.theta), curve, kind))[: press.t.size]
    return moved(best, space.free, slope * press.units.compliance)


def _layer_moves(press: IndentationProblem, best: Best, curve: Curve, kind: str, name: str) -> np.ndarray:
    """Return the derivative of the coordinates with respect to nu or the thickness in the factor of a layer."""
    tip, depth = press.pressing.indenter, press.units.depth
    held = {"thickness": press.pressing.thickness, "nu": press.sought.volume.value}

    def layer(value: Any) -> ThinLayer:
        found = ThinLayer.of(tip, **(held | {name: value}))
        return found._replace(scale=found.scale * depth**found.power)

    change = jax.jvp(layer, (held[name],), (1.0,))[1]
    slope = np.asarray(halfspace.layer_slope(press.space.point(best.theta), curve, change, kind))
    return moved(best, press.space.free, slope[: press.t.size])


def _notes(best: Best, press: IndentationProblem, kind: str) -> tuple[str, ...]:
    """Return the notes on an optimum: the contact shrinks, or the strain of a layer is large."""
    thickness, deepest = press.pressing.thickness, press.units.depth
    if thickness is not None and deepest > STRAIN * thickness:
        share = told_apart(deepest / thickness, STRAIN)
        of = f"the depth is {share} of the thickness: beyond {STRAIN:g} linear theory is doubtful"
        press = press._replace(notes=(*press.notes, of))
    if kind == "ting":
        return (*press.notes, "the depth falls: Ting's solution from its maximum on")
    if kind == "load" and press.probe.power > 1.0:
        on = press.weights > 0
        depth = press.depth[on] + best.residual[on] / press.weights[on]
        fall = float(np.max(np.maximum.accumulate(depth) - depth))
        if fall > FALL:
            note = f"the contact shrinks (depth falls by {100 * fall:.1f} %): Lee and Radok only approximate"
            return (*press.notes, note)
    return press.notes
