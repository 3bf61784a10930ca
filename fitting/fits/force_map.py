"""Fits of the force curves of a map: one compiled program makes the fits of ``fit_force`` for thousands of curves.

The model is that of ``force.py``, in units of the largest depth and of the range of the load:

    force = c f(depth - p) + b + k t,     c = 1/(J + J_indenter),

with the law f of the indenter, on a thin sample times its factor. It is linear in c, b and k for a given contact point p, so
that the search is one in p alone (variable projection): the smallest weighted sum of squares

    R(p) = min over c, b, k = S_yy - S_fy^2/S_ff,

S: products of the parts of f and of the data outside the span of 1 and t, is computed at trial contact points over the whole
curve, and its lowest one is refined by Gauss-Newton steps inside the bracket of its neighbours. The profile likelihood
follows from the same R: an interval of p ends where R(p) reaches a level L, and one of c at the largest and smallest of
c(p) +- ((L - R(p))/S_ff)^(1/2) over p.

Weights are estimated, intervals follow from the noise and correlation of the residuals, and a curve is judged as by
``fit_force`` (``inference/noise_of_many.py``). The calibration of the widths is simulated for some of the curves of a map,
and the median of its factors, which differ by a few per cent, is used for all.

The program runs over the curves of a batch one after the other (``lax.map``), and the batches in threads, one for each
core. A loop over curves is faster than ``vmap``: its arrays remain in the cache of a core (0.05 ms instead of 0.2 ms for the
scan of a curve), and a search ends when its own curve has converged.
"""

import contextlib
import dataclasses
import functools
import hashlib
import math
import os
import re
import zipfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from tqdm import tqdm

import jaxcontact as jc
from fitting.data.contact import (
    LEAST_CURVE,
    NO_CONTACT,
    SEGMENTS,
    UNTIMED,
    ForceCurve,
    ForceUnits,
    baseline,
    by_sensitivity,
    calibration_in_words,
    signs,
)
from fitting.data.indentation import IndentationData, depth_notes, probe_of, too_deep
from fitting.fits import adhesive_map, force
from fitting.fits.adhesion import JKR, body_of, table_of
from fitting.fits.force import fit_force
from fitting.fits.indentation import fit_indentation
from fitting.inference import noise, verdict
from fitting.inference.noise_of_many import is_doubted, noise_of_one, orthonormal, quantiles
from fitting.inference.sample import EXACT, FLAT, NEGLIGIBLE, ROUNDING, SAME
from fitting.models.structure import CLASSICAL, Sought
from fitting.models.thin_layer import LARGEST, Base, ThinLayer
from fitting.search import nonlinear
from fitting.views import output, sheet, text
from jaxcontact._compile.programs import Program
from jaxcontact._support.pytree import require_real

STEPS, CLOSE = 60, 1e-10  # Gauss-Newton steps for a contact point, and the last of them
REACH = 0.1  # of a further search about a known contact point
TURNS = 4  # searches with weights from the previous one
ENDS, GRID = 6, 24  # secant steps to the end of an interval of p, and trial points of a profile of c
COUNT = 4  # coordinates


class Scaled(NamedTuple):
    """A curve in scaled units: t, depth, load, (N,), of which the first n count; chi: of a thin sample at the scaled
    depth 1."""

    t: Any
    depth: Any
    load: Any
    n: Any
    chi: Any


class Projected(NamedTuple):
    """The least squares at a contact point: R; c, b, k; S_ff; the law f and its derivative by the depth, (N,)."""

    rss: Array
    c: Array
    b: Array
    k: Array
    own: Array
    f: Array
    slope: Array


def law(depth: Array, chi: Array, layer: Any, power: float) -> Array:
    """Return f at depths of any shape, 0 above the surface, nan beyond the table of a layer.

    chi: at the scaled depth 1; layer: None, or coefficients (d,) of the Chebyshev series of the factor in
    2 chi/chi_max - 1, and chi_max.
    """
    inside = depth > 0.0
    safe = jnp.where(inside, depth, 1.0)
    plain = {1.0: safe, 1.5: safe * jnp.sqrt(safe), 2.0: safe * safe}[power]
    if layer is None:
        return jnp.where(inside, plain, 0.0)
    series, largest = layer
    chi = chi * {1.0: jnp.ones_like(safe), 1.5: jnp.sqrt(safe), 2.0: safe}[power]
    x = 2.0 * chi / largest - 1.0
    one, two = jnp.zeros_like(x), jnp.zeros_like(x)
    for j in range(series.shape[0] - 1, 0, -1):  # Clenshaw, in one loop over the depths
        one, two = series[j] + 2.0 * x * one - two, one
    factor = series[0] + x * one - two
    return jnp.where(inside, jnp.where(chi <= largest * (1.0 + 1e-9), plain * factor, jnp.nan), 0.0)


def line(curve: Scaled, weights: Array) -> tuple[Array, Array, Array]:
    """Return rows q (2, N) that span the weighted 1 and t, R of them, and the weighted load outside of them (N,)."""
    q, R = orthonormal(jnp.stack([weights, weights * curve.t]))
    y = weights * curve.load
    return q, R, y - (q @ y) @ q


def scanned(curve: Scaled, weights: Array, layer: Any, power: float) -> tuple[Array, Array]:
    """Return R at the trial contact points (TRIALS,), inf where the sample would pull, and the points."""
    points = jnp.linspace(0.0, 1.0, force.TRIALS, endpoint=False)
    q, _, y = line(curve, weights)
    f = jnp.where(weights > 0.0, law(curve.depth - points[:, None], curve.chi, layer, power), 0.0)
    deep = jnp.all(jnp.isfinite(f), 1)  # otherwise beyond the table of the layer
    f = jnp.where(jnp.isfinite(f), f, 0.0)
    products = f @ jnp.concatenate([weights * q, (weights * y)[None]]).T
    own = f**2 @ weights**2 - products[:, 0] ** 2 - products[:, 1] ** 2
    pushes = (products[:, 2] > 0.0) & (own > 0.0) & deep
    return jnp.where(pushes, y @ y - products[:, 2] ** 2 / jnp.where(pushes, own, 1.0), jnp.inf), points


def projected(
    p: Array, curve: Scaled, weights: Array, q: Array, R: Array, y: Array, layer: Any, power: float
) -> Projected:
    """Return the least squares at a contact point p; q, R, y: of ``line``."""
    at = lambda depth: law(depth, curve.chi, layer, power)
    f, slope = jax.jvp(at, (curve.depth - p,), (jnp.ones_like(curve.depth),))
    sound = jnp.isfinite(f) & jnp.isfinite(slope)
    f, slope = jnp.where(sound, f, 0.0), jnp.where(sound, slope, 0.0)
    g = weights * f
    along = q @ g
    out = g - along @ q
    own = jnp.maximum(out @ out, 1e-300)
    c = jnp.maximum(out @ y / own, 0.0)
    rest = y - c * out
    x = q @ (weights * curve.load) - c * along  # of the orthonormal rows
    k = x[1] / R[1, 1]
    b = (x[0] - R[0, 1] * k) / R[0, 0]
    return Projected(rest @ rest, c, b, k, own, f, slope)


def refined(
    p: Array, low: Array, high: Array, curve: Scaled, weights: Array, layer: Any, power: float
) -> tuple[Array, Projected]:
    """Return the contact point in a bracket with the smallest R."""
    q, R, y = line(curve, weights)

    def going(state: tuple) -> Array:
        *_, ended, count = state
        return ~ended & (count < STEPS)

    def step(state: tuple) -> tuple:
        p, low, high, _, last, _, count = state
        one = projected(p, curve, weights, q, R, y, layer, power)
        r = weights * (one.c * one.f + one.b + one.k * curve.t - curve.load)
        # the derivative of the model by p, outside the span of f, 1 and t
        turn = -one.c * weights * one.slope
        turn = turn - (q @ turn) @ q
        out = weights * one.f
        out = out - (q @ out) @ q
        turn = turn - (turn @ out) / one.own * out
        rise, square = turn @ r, jnp.maximum(turn @ turn, 1e-300)
        low, high = jnp.where(rise > 0.0, low, p), jnp.where(rise > 0.0, p, high)
        new = p - rise / square
        # bisection where the step leaves the bracket, or does not become shorter
        wild = (new <= low) | (new >= high) | ((count > 8) & (jnp.abs(new - p) > 0.5 * jnp.abs(last)))
        ended = jnp.where(wild, high - low, jnp.abs(new - p)) < CLOSE
        new = jnp.where(wild, 0.5 * (low + high), new)
        return jnp.where(ended, p, new), low, high, one, new - p, ended, count + 1

    zero = jnp.zeros(())
    nothing = Projected(zero, zero, zero, zero, zero, jnp.zeros_like(y), jnp.zeros_like(y))
    start = (p, low, high, nothing, jnp.asarray(jnp.inf), jnp.asarray(False), jnp.asarray(0))
    p, _, _, one, *_ = lax.while_loop(going, step, start)
    return p, one


def fit_one(
    curve: Scaled, extra: Array, constants: dict[str, Array], layer: Any, power: float
) -> dict[str, Array]:
    """Return the fit of a curve as numbers.

    extra: scaled compliance of the indenter; constants: the level and the quantiles of t that depend on n; layer, power: as
    of ``law``.
    """
    t, depth, load, n, _ = curve
    N = t.size
    on = jnp.arange(N) < n
    level, single = constants["level"], constants["single"]
    far = constants["slip"], constants["outlier"]

    # 1. The lowest of the trial contact points is the start.
    weights = jnp.where(on, 1.0, 0.0)
    rss, points = scanned(curve, weights, layer, power)
    best = jnp.argmin(rss)
    contact, real = jnp.isfinite(rss[best]), rss[best] > EXACT * jnp.sum((weights * load) ** 2)

    def theory(one: Projected, weights: Array) -> tuple[Array, Array, Array]:
        """Return fitted values, weighted residuals and the weighted Jacobian (4, N) by log J, p, b and k."""
        fitted = jnp.where(on, one.c * one.f + one.b + one.k * t, 0.0)
        J = jnp.maximum(1.0 / jnp.maximum(one.c, 1e-13) - extra, 1e-13)
        rows = jnp.stack([-J * one.c**2 * one.f, -one.c * one.slope, jnp.ones(N), t])
        return fitted, weights * (fitted - load), weights * rows

    # 2. The contact point between its neighbours, then weights that follow from the residuals, until they stay
    # (``sample.reweighted_until_stable``).
    def turn(state: tuple) -> tuple:
        count, p, reach, weights, *_ = state
        p, one = refined(
            p, jnp.maximum(p - reach, 0.0), jnp.minimum(p + reach, 1.0), curve, weights, layer, power
        )
        fitted, r, slopes = theory(one, weights)
        found = noise_of_one(r, slopes, fitted, jnp.where(on, weights, 1.0), n, level, single, real)
        new = jnp.where(on, 1.0 / (jnp.hypot(found.ratio, fitted) * found.sizes), 0.0)
        change = jnp.max(jnp.where(on, jnp.abs(jnp.log(new / weights)), 0.0))
        ended = (count > 0) & (change <= SAME) | (count == TURNS) | ~real | ~contact
        return count + 1, p, jnp.asarray(REACH), jnp.where(ended, weights, new), ended, one, found

    state = jax.eval_shape(turn, (jnp.asarray(0), points[best], jnp.asarray(REACH), weights))
    state = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), state)
    state = (state[0], points[best], jnp.asarray(1.0 / force.TRIALS), weights, *state[4:])
    _, p, _, weights, _, one, found = lax.while_loop(lambda state: ~state[4], turn, state)
    fitted, r, slopes = theory(one, weights)
    total = one.rss

    # 3. Ends of the intervals by profile likelihood: R reaches its least value plus the square of the half width.
    q, R, y = line(curve, weights)
    at = lambda p: projected(p, curve, weights, q, R, y, layer, power)
    rises = jnp.maximum(found.half**2, ROUNDING * jnp.sum((weights * load) ** 2))
    out, _ = orthonormal(jnp.stack([slopes[2], slopes[3], slopes[0], slopes[1]]))
    first = jnp.sqrt(rises[1]) / jnp.maximum(jnp.abs(out[3] @ slopes[1]), 1e-300)  # of the linear model

    def end(sign: Array) -> Array:
        def secant(_: int, away: Array) -> Array:
            place = jnp.clip(p + sign * away, 0.0, 1.0)
            height = jnp.sqrt(jnp.maximum(at(place).rss - total, 0.0) / rises[1])
            return jnp.clip(away / jnp.clip(height, 0.3, 3.0), 0.0, 1.0)

        return jnp.clip(p + sign * lax.fori_loop(0, ENDS, secant, first), 0.0, 1.0)

    ends = lax.map(end, jnp.array([-1.0, 1.0]))
    width = jnp.maximum(ends[1] - ends[0], 1e-12) * jnp.sqrt(rises[0] / rises[1])
    places = jnp.clip(p + 0.6 * width * jnp.linspace(-1.0, 1.0, GRID), 0.0, 1.0)
    rows = lax.map(lambda place: jnp.stack([(v := at(place)).rss, v.c, v.own]), places)
    room = jnp.sqrt(jnp.maximum(total + rises[0] - rows[:, 0], 0.0) / rows[:, 2])
    inside = rows[:, 0] <= total + rises[0]

    def furthest(sign: float) -> Array:
        """Return the largest (sign 1) or smallest c on the contour, by a parabola through the best places."""
        values = jnp.where(inside, sign * rows[:, 1] + room, -jnp.inf)
        i = jnp.clip(jnp.argmax(values), 1, GRID - 2)
        low, middle, high = values[i - 1], values[i], values[i + 1]
        bent = low - 2.0 * middle + high
        top = middle - 0.125 * (high - low) ** 2 / jnp.where(bent < 0.0, bent, -jnp.inf)
        return sign * jnp.where(jnp.isfinite(low) & jnp.isfinite(high) & (bent < 0.0), top, jnp.max(values))

    stiff = lambda c: -jnp.log(jnp.maximum(1.0 / jnp.maximum(c, 1e-13) - extra, 1e-13))  # log of 1/J
    logs = jnp.stack([stiff(one.c), stiff(furthest(-1.0)), stiff(furthest(1.0))])

    # 4. Judgement, in the order of ``force.deviation``.
    deviations = jnp.where(on, fitted - load, 0.0)
    outside = on & (depth < p)
    before = jnp.sum(outside)
    mean = jnp.sum(jnp.where(outside, deviations, 0.0)) / jnp.maximum(before, 1)
    scatter = jnp.sqrt(jnp.sum(jnp.where(outside, (deviations - mean) ** 2, 0.0)) / jnp.maximum(before, 1))
    pushed = one.c * law(depth[n - 1] - p, curve.chi, layer, power)
    spiky, highest = verdict.spikes(deviations, pushed, n, jnp)
    jumped = verdict.jump(deviations, pushed, n, jnp)
    risen = verdict.rising(depth, deviations, one.c * one.f, p, n, jnp)
    doubted = (
        is_doubted(r, slopes, found, n, far) & (total > NEGLIGIBLE * jnp.sum((weights * load) ** 2)) & real
    )
    # the fit up to half the largest depth
    some = on & (depth - p <= force.HALF * (depth[n - 1] - p))
    few = jnp.sum(some & (depth > p)) < 5
    half, shallow = refined(
        p,
        jnp.maximum(p - REACH, 0.0),
        jnp.minimum(p + REACH, 1.0),
        curve,
        jnp.where(some, weights, 0.0),
        layer,
        power,
    )
    softer = stiff(shallow.c) - logs[0]
    trend = verdict.trend(deviations, n, jnp)
    # too little of the data explained
    middle = jnp.sum(jnp.where(on, load, 0.0)) / n
    r2 = 1.0 - jnp.sum(deviations**2) / jnp.maximum(jnp.sum(jnp.where(on, (load - middle) ** 2, 0.0)), 1e-300)
    heavy = jnp.sum(weights**2 * load) / jnp.sum(weights**2)
    about = jnp.sum((weights * (load - heavy)) ** 2)
    spread, signal = jnp.sqrt(total / (n - COUNT)), jnp.sqrt(jnp.sum((weights * fitted) ** 2) / n)
    return {
        "log_G": logs, "p": p, "contact": jnp.concatenate([p[None], ends]), "baseline": one.b, "tilt": one.k,
        "amplitude": one.c, "r2": r2, "floor": found.ratio, "lag1": found.lag1, "before": before,
        "scatter": scatter, "pushed": pushed, "spikes": spiky, "highest": highest,
        "jumped": jumped, "risen": risen, "doubted": doubted, "few": few,
        "softer": softer, "moved": half - p, "trend": trend, "varied": found.varied, "found": contact,
        "poor": real & ((r2 <= 0.0) | (total >= about * (1.0 - FLAT))), "faint": real & (spread > signal),
        "excess": spread / jnp.maximum(signal, 1e-300), "finite": jnp.all(jnp.isfinite(logs)),
    }  # fmt: skip


# From curves to the program and back.


BATCH = 64  # curves of one call of the program
DEGREE, FINE = 32, 1e-9  # of the series of the factor of a thin sample, and its error
CALIBRATED = 16  # curves whose intervals are calibrated by simulation
VERDICTS = ("accepted", "rejected", "failed")
COLOURS = dict(zip(VERDICTS, (sheet.BLUE, sheet.REFUSED, "0.6"), strict=True))
SIZE = 5.0  # width of a map [inches]
NUMBERS = re.compile(r"-?\d[\d.]*(e[-+]?\d+)?")  # by which notes of one kind differ


@functools.partial(Program, static_argnames=("power",))
def fit_batch(
    curves: Scaled, extra: Array, constants: dict[str, Array], layer: Any, *, power: float
) -> dict[str, Array]:
    """Return the fits of the curves of a batch."""
    one = lambda row: fit_one(row[0], row[1], row[2], layer, power)
    return lax.map(one, (curves, extra, constants))


@functools.partial(Program, static_argnames=("power",))
def coarse_contacts(curves: Scaled, layer: Any, *, power: float) -> Array:
    """Return the contact points of the curves of a batch among the trial points, -1 without one."""

    def contact(curve: Scaled) -> Array:
        weights = jnp.where(jnp.arange(curve.t.size) < curve.n, 1.0, 0.0)
        rss, points = scanned(curve, weights, layer, power)
        best = jnp.argmin(rss)
        return jnp.where(jnp.isfinite(rss[best]), points[best], -1.0)

    return lax.map(contact, curves)


class Rows(NamedTuple):
    """Scaled curves with leading axes (m,), and the further arguments of the program.

    units (m, 4): load [N], depth [m], time [s] and compliance [1/Pa]; extra (m,): scaled compliance of the indenter; layer:
    Chebyshev coefficients of the factor of a thin sample up to the largest depth, and chi there, None on a half-space;
    power: of the depth in the law of the indenter.
    """

    curves: Scaled
    units: np.ndarray
    extra: np.ndarray
    layer: Any
    power: float

    @classmethod
    def of(
        cls, curves: Sequence[ForceCurve], indenter: Any, nu: float, thickness: float | None, unbonded: bool
    ) -> "Rows":
        """Return approaches in scaled units, padded to a common length with their last points."""
        probe, share, m = probe_of(indenter), 1.0 - nu, len(curves)
        n = np.array([one.t.size for one in curves])
        t, depth, load = np.zeros((3, m, nonlinear.length(int(n.max()))))
        units = np.zeros((m, 4))
        for i, one in enumerate(curves):
            own = ForceUnits.of(one, float(one.depth[-1]), probe, share)
            units[i] = own
            above = one.load - baseline(one.load)
            scaled = one.t / own.time, one.depth / own.depth, above / own.load
            for rows, values in zip((t, depth, load), scaled, strict=True):
                rows[i, : n[i]], rows[i, n[i] :] = values, values[-1]
        extra = float(indenter.compliance()) / share / units[:, 3]
        if thickness is None:
            return cls(Scaled(t, depth, load, n, np.zeros(m)), units, extra, None, probe.power)

        # the factor of a thin sample, in a series of its own that is as short as the depths of this map allow
        layer = ThinLayer.of(indenter, thickness, nu, Base(bonded=not unbonded))
        chi = float(layer.scale) * units[:, 1] ** float(layer.power)
        largest = min(float(chi.max()), LARGEST)
        x = np.cos(np.pi * (np.arange(64) + 0.5) / 64.0)
        s = 2.0 * np.log1p(0.5 * largest * (x + 1.0)) / math.log1p(LARGEST) - 1.0
        factor = np.exp(np.polynomial.chebyshev.chebval(s, np.asarray(layer.series)))
        series = np.polynomial.chebyshev.chebfit(x, factor, DEGREE)
        last = np.flatnonzero(np.abs(series) > FINE * np.abs(series).max())[-1]
        short = jnp.asarray(series[: max(int(last), 1) + 1]), jnp.asarray(largest)
        return cls(Scaled(t, depth, load, n, chi), units, extra, short, probe.power)

    def batches(self) -> list[tuple[int, np.ndarray]]:
        """Return the number of curves in each batch, and their places, filled up with the first one."""
        found, m = [], len(self.units)
        for first in range(0, m, BATCH):
            places, stop = np.arange(first, first + BATCH), min(first + BATCH, m)
            found.append((stop - first, np.where(places < stop, places, first)))
        return found

    def at(self, places: Any) -> Scaled:
        """Return the curves at some places."""
        return Scaled(*(array[places] for array in self.curves))


def fitted_batches(rows: Rows, level: float, threads: int | None) -> Iterator[dict[str, np.ndarray]]:
    """Yield the results of ``fit_one`` for the curves of each batch, {name: (count, ...)}; threads: batches at a time."""
    n = rows.curves.n
    of = {int(one): quantiles(int(one), COUNT, level) for one in np.unique(n)}
    names = "level", "single", "slip", "outlier"
    constants = {name: np.array([of[int(one)][name] for one in n]) for name in names}

    def batch(some: tuple[int, np.ndarray]) -> dict[str, np.ndarray]:
        count, places = some
        own = {name: values[places] for name, values in constants.items()}
        found = fit_batch(rows.at(places), rows.extra[places], own, rows.layer, power=rows.power)
        return {name: np.asarray(values)[:count] for name, values in found.items()}

    yield from adhesive_map.in_threads(batch, rows.batches(), threads or cores())


def cores() -> int:
    """Return the number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@functools.partial(Program, static_argnames=("power",))
def theory_of(x: Array, curve: Scaled, layer: Any, *, power: float) -> tuple[Array, Array]:
    """Return the scaled force (N,) at x = (c, p, b, k), and its derivatives (4, N) by the logarithm of c, p, b and k."""
    model = lambda x: x[0] * law(curve.depth - x[1], curve.chi, layer, power) + x[2] + x[3] * curve.t
    rows = jax.jacfwd(model)(x).T
    return model(x), rows.at[0].multiply(x[0])


def calibrated(found: dict[str, np.ndarray], rows: Rows, good: np.ndarray, level: float) -> np.ndarray:
    """Return the factors (2,) on the half widths of modulus and contact point: medians over some of the accepted curves.

    The factor of a curve is that of ``noise.Calibration``, which simulates its noise; those of the curves of a map differ by
    a few per cent.
    """
    places = np.flatnonzero(good)
    if not places.size:
        return np.ones(2)
    order = places[np.argsort(found["floor"][places], kind="stable")]
    some = order[np.unique(np.linspace(0, order.size - 1, min(order.size, CALIBRATED)).round().astype(int))]
    factors = []
    for i in some:
        curve = rows.at(i)
        n, load = int(curve.n), curve.load[: int(curve.n)]
        x = jnp.asarray([found[name][i] for name in ("amplitude", "p", "baseline", "tilt")])
        fitted, slopes = (np.asarray(v)[..., :n] for v in theory_of(x, curve, rows.layer, power=rows.power))
        size = np.abs(fitted)
        weights = 1.0 / np.hypot(found["floor"][i], fitted)
        high = noise.BEYOND * size.max()
        floors = np.geomspace(max(size.min() / noise.BEYOND, noise.LEAST * high), high, 25)
        shapes = np.hypot(floors[:, None], fitted) * weights
        residual, jacobian = weights * (fitted - load), (weights * slopes).T
        if residual @ residual <= ROUNDING * np.sum((weights * load) ** 2):
            continue  # without noise nothing is to be simulated
        tried, inside = noise.ErrorModels(shapes, floors), np.ones(COUNT, dtype=bool)
        model = noise.noise_model(residual, jacobian, inside, np.zeros(n, dtype=int), tried, COUNT, False)
        if model.calibration is None:
            continue
        directions = np.linalg.pinv(model.columns, rcond=1e-9).T[:, :2]
        factors.append(model.calibration.factors(directions / np.linalg.norm(directions, axis=0), level))
    return np.median(factors, 0) if factors else np.ones(2)


# Preparation of the curves of a map.


class Prepared(NamedTuple):
    """The approaches of a map that can be fitted, their places among its curves, and {place: reason} of the others."""

    approaches: list[ForceCurve]
    places: np.ndarray
    failed: dict[int, str]


def data_of(depth: Any, load: Any, t: Any) -> list[Any]:
    """Return curves from rows (m, n) padded with nan, or lists of arrays, up to the largest depth the approach; or
    the reason where a row is no curve."""
    require_real("depth", depth)
    require_real("load", load)
    if load is None:
        raise ValueError("load: expected rows (m, n) [N] beside those of the depth, got none")
    if len(depth) != len(load):
        raise ValueError(f"load: expected {len(depth)} curves as the depth has, got {len(load)}")
    shared = None if t is None or np.ndim(t[0]) else np.asarray(t, dtype=float)
    found: list[Any] = []
    for k in range(len(depth)):
        d, F = (np.asarray(values[k], dtype=float).ravel() for values in (depth, load))
        if d.shape != F.shape:
            raise ValueError(f"load: expected {d.size} points in curve {k}, got {F.size}")
        s = (
            np.arange(d.size, dtype=float)
            if t is None
            else shared
            if shared is not None
            else np.asarray(t[k], dtype=float)
        )
        if s.shape != d.shape:
            raise ValueError(f"t: expected {d.size} times of curve {k}, got {s.size}")
        on = np.isfinite(d) & np.isfinite(F) & np.isfinite(s)
        d, F, s = d[on], F[on], s[on]
        if d.size < LEAST_CURVE:
            found.append(f"expected at least {LEAST_CURVE} points, got {d.size}")
            continue
        inward, _ = signs(F - baseline(F), d)
        marks = np.full(d.size, SEGMENTS[2], dtype="<U8")
        marks[: int(np.argmax(inward * d)) + 1] = SEGMENTS[0]
        try:
            found.append(
                IndentationData(
                    t=s,
                    load=F,
                    depth=d,
                    marks=marks,
                    notes=(UNTIMED,) if t is None else (),
                    numbered=t is None,
                )
            )
        except ValueError as error:
            found.append(str(error))
    return found


def prepared(curves: Sequence[Any], rows_of: Callable[[Sequence[ForceCurve]], Rows]) -> Prepared:
    """Return the approaches about the contact, as ``fit_force`` takes them."""
    full, places, failed = [], [], {}
    for k, data in enumerate(curves):
        if isinstance(data, str):
            failed[k] = data
            continue
        try:
            one = ForceCurve.approach(data)
        except (ValueError, RuntimeError) as error:
            failed[k] = str(error)
            continue
        if one.t.size >= LEAST_CURVE and np.ptp(one.load) > 0.0 and one.depth[-1] > 0.0 and one.t[-1] > 0.0:
            full.append(one)
            places.append(k)
        else:
            failed[k] = (
                f"data: expected load, depth and time to change over at least {LEAST_CURVE} points, got ranges"
                f" {np.ptp(one.load):g} N, {one.depth[-1]:g} m, {one.t[-1]:g} s over {one.t.size} points"
            )
    if not full:
        return Prepared([], np.zeros(0, dtype=int), failed)
    # the contact points among the trial points, on a few means of neighbours
    few = [one.thinned(force.COARSE) for one in full]
    rows = rows_of(few)
    points = [
        np.asarray(coarse_contacts(rows.at(places), rows.layer, power=rows.power))[:count]
        for count, places in rows.batches()
    ]
    approaches, kept = [], []
    for one, k, thin, share in zip(full, places, few, np.concatenate(points), strict=True):
        if share < 0.0:
            failed[k] = NO_CONTACT
            continue
        approaches.append(one.near_contact(share * float(thin.depth[-1])).thinned(force.MOST))
        kept.append(k)
    return Prepared(approaches, np.array(kept, dtype=int), failed)


# The fits of a map, together or one by one, and where their results are kept.


class Store:
    """Results of curves in a folder, one file for each finished batch, found by the content of a curve and the options."""

    def __init__(self, folder: Any, options: Any) -> None:
        self.folder = None if folder is None else Path(folder)
        self.options = f"{jc.__version__} {options!r}".encode()
        self.known: dict[bytes, tuple[dict[str, np.ndarray], int]] = {}
        if self.folder is not None:
            self.folder.mkdir(parents=True, exist_ok=True)
            for path in sorted(self.folder.glob("*.npz")):
                with (
                    contextlib.suppress(OSError, ValueError, KeyError, zipfile.BadZipFile),
                    np.load(path) as file,
                ):
                    arrays = {name: file[name] for name in file.files}
                    keys = arrays.pop("keys")
                    self.known |= {row.tobytes(): (arrays, k) for k, row in enumerate(keys)}

    def key(self, *arrays: np.ndarray) -> bytes:
        """Return the key of a curve from its arrays, of numbers or of text."""
        digest = hashlib.sha1(self.options, usedforsecurity=False)
        for one in arrays:
            digest.update(
                repr(one.tolist()).encode() if one.dtype.kind == "U" else one.astype(float).tobytes()
            )
        return digest.digest()

    def add(self, keys: Sequence[bytes], arrays: dict[str, np.ndarray]) -> None:
        """Keep the results of a batch."""
        self.known |= {one: (arrays, k) for k, one in enumerate(keys)}
        if self.folder is not None and keys:
            rows = np.frombuffer(b"".join(keys), dtype=np.uint8).reshape(len(keys), -1)
            path = self.folder / f"{keys[0].hex()}.npz"

            def save(partial: Path) -> None:
                with partial.open("wb") as file:
                    np.savez(file, keys=rows, **arrays)  # type: ignore[arg-type]

            output.write(path, save)

    def gathered(self, keys: Sequence[bytes]) -> dict[str, np.ndarray]:
        """Return the results of curves, {name: (m, ...)}."""
        parts = [self.known[one] for one in keys]
        return {name: np.stack([arrays[name][k] for arrays, k in parts]) for name in parts[0][0]}


def empty(m: int) -> dict[str, Any]:
    """Return the arrays of m failed curves."""
    of = lambda *shape: np.full((m, *shape), np.nan)
    return {
        "G": of(3), "work": of(3), "contact": of(3), "r2": of(), "noise": of(), "depth": of(), "baseline": of(),
        "tilt": of(), "verdict": np.full(m, VERDICTS[2], dtype="<U8"), "reason": [""] * m, "notes": [()] * m,
    }  # fmt: skip


def all_together(
    curves: Sequence[Any], given: dict[str, Any], kept: Store, threads: int | None, progress: bool
) -> tuple[dict[str, Any], np.ndarray]:
    """Return the arrays of a map that the compiled program fits, and the factors of the calibration; given: arguments of
    ``fit_map``."""
    level, errors = given["level"], given["errors"] or {}

    # 1. The approaches about their contacts, and the fits of those that the store does not have.
    sample = given["indenter"], given["nu"], given["thickness"], given["unbonded"]
    rows_of = lambda some: Rows.of(some, *sample)
    ready, out = prepared(curves, rows_of), empty(len(curves))
    for k, why in ready.failed.items():
        out["reason"][k] = why
    if not ready.approaches:
        return out, np.ones(2)
    keys = [kept.key(one.t, one.load, one.depth) for one in ready.approaches]
    missing = [i for i, one in enumerate(keys) if one not in kept.known]
    with tqdm(
        total=len(missing), unit="curve", desc="fitting", disable=None if progress else True, leave=False
    ) as bar:
        if missing:
            first = 0
            for found in fitted_batches(rows_of([ready.approaches[i] for i in missing]), level, threads):
                count = len(found["r2"])
                kept.add([keys[i] for i in missing[first : first + count]], found)
                first += count
                bar.update(count)
    found = kept.gathered(keys)
    rows = rows_of(ready.approaches)

    # 2. Verdicts with reasons and notes, and what needs no interval.
    fill(out, found, rows, ready, given, [getattr(one, "notes", ()) for one in curves])

    # 3. Half widths with the factors of the calibration, then the change with half the depth, which noise does not include.
    good = out["verdict"][ready.places] == VERDICTS[0]
    factors = calibrated(found, rows, good, level)
    judged_by_change = found["doubted"] & ~found["few"] & (out["stage"][ready.places] == "")
    logs, contact = found["log_G"], found["contact"]
    sides = np.array([-1.0, 1.0])
    systematic = [
        np.where(judged_by_change, np.abs(found[name]), 0.0)[:, None] * sides for name in ("softer", "moved")
    ]
    logs = np.column_stack(
        [logs[:, 0], logs[:, :1] + factors[0] * (logs[:, 1:] - logs[:, :1]) + systematic[0]]
    )
    contact = np.column_stack(
        [
            contact[:, 0],
            np.clip(
                contact[:, :1] + factors[1] * (contact[:, 1:] - contact[:, :1]) + systematic[1], 0.0, 1.0
            ),
        ]
    )

    # 4. Errors of the calibration of the cantilever (``data/contact.py``, ``result.widened``).
    slope = np.zeros(len(keys))
    if errors.get("sensitivity"):

        def log_moduli(change: float) -> np.ndarray:
            moved = rows_of([one.recalibrated(change, given["spring_constant"]) for one in ready.approaches])
            logs = [found["log_G"][:, 0] for found in fitted_batches(moved, level, threads)]
            return np.concatenate(logs) - np.log(moved.units[:, 3])

        slope = by_sensitivity(log_moduli)
    total = np.hypot(errors.get("spring_constant", 0.0), slope * errors.get("sensitivity", 0.0))
    half = np.hypot(logs[:, 1:] - logs[:, :1], noise.two_sided(level) * total[:, None])
    logs[:, 1:] = logs[:, :1] + sides * half
    if errors:
        note = f"the interval of the modulus includes the standard deviation of the {calibration_in_words(errors)}"
        for k in ready.places:
            out["notes"][k] = (*out["notes"][k], note)

    # 5. In SI: the modulus, and the contact point as a measured depth.
    with np.errstate(over="ignore"):
        out["G"][ready.places] = np.exp(logs) / rows.units[:, 3:]
    for k in ready.places:
        stiff = verdict.beyond_solids(float(out["G"][k, 1]))
        if stiff and out["stage"][k] == "":
            out["verdict"][k] = VERDICTS[1]
            out["reason"][k] = "; ".join(filter(None, (out["reason"][k], *stiff)))
    zero = np.array([one.zero for one in ready.approaches])
    inward = np.array([one.inward for one in ready.approaches])
    depths = inward[:, None] * (contact * rows.units[:, 1:2] + zero[:, None])
    out["contact"][ready.places] = np.where(inward[:, None] < 0, depths[:, [0, 2, 1]], depths)
    return out, factors


def fill(
    out: dict[str, Any],
    found: dict[str, np.ndarray],
    rows: Rows,
    ready: Prepared,
    given: dict[str, Any],
    notes: Sequence[tuple[str, ...]],
) -> None:
    """Enter verdicts with reasons and notes, in the words of ``fit_force``, and what needs no interval."""
    indenter, thickness = given["indenter"], given["thickness"]
    load, depth, T, _ = rows.units.T
    places = ready.places
    out["r2"][places], out["noise"][places] = found["r2"], found["scatter"] * load
    out["depth"][places] = (1.0 - found["contact"][:, 0]) * depth
    out["baseline"][places], out["tilt"][places] = found["baseline"] * load, found["tilt"] * load / T
    out["stage"] = np.full(len(out["r2"]), "", dtype="<U8")
    for i, (k, one) in enumerate(zip(places, ready.approaches, strict=True)):
        if not found["found"][i]:
            out["reason"][k], out["stage"][k] = NO_CONTACT, "failed"
            continue
        said, why = [*notes[k], *one.remarks, *depth_notes(indenter, float(out["depth"][k]), thickness)], []
        of = lambda name: found[name][i].item()  # noqa: B023
        bad = verdict.unusable(
            of("before"), int(rows.curves.n[i]), of("spikes"), of("highest"), of("jumped"), of("risen"), of("pushed"),
            of("scatter"), float(load[i]),
        )  # fmt: skip
        if bad:
            why, out["stage"][k] = [bad], "unusable"
        elif of("doubted") and of("few"):
            why = [verdict.TOO_FEW]
        elif of("doubted"):
            refused = of("trend") > force.TREND or abs(of("softer")) > force.CHANGE
            words = force.trend_words(
                of("trend"), of("softer"), refused, float(load[i]), thickness is not None
            )
            (why if refused else said).append(words)
        why += too_deep(indenter, float(out["depth"][k]))
        if of("poor"):
            why.append(verdict.no_better(of("r2")))
        if of("faint"):
            why.append(verdict.scattered(of("excess")))
        if of("varied"):
            said.append("the noise changes along the depth; the intervals allow for it")
        out["verdict"][k] = VERDICTS[1] if why or not of("finite") else VERDICTS[0]
        out["reason"][k], out["notes"][k] = "; ".join(why), tuple(said)


def each_alone(
    curves: Sequence[Any], given: dict[str, Any], kept: Store, processes: int | None, progress: bool
) -> dict[str, Any]:
    """Return the arrays of a map whose curves are fitted one by one, by ``fit_force`` or ``fit_indentation``; given:
    arguments of ``fit_map``."""
    out, keys = empty(len(curves)), {}
    for k, one in enumerate(curves):
        if isinstance(one, str):
            out["reason"][k] = one
        else:
            # with the segments, of which a fit takes one or two, and the notes, which are stored with it
            keys[k] = kept.key(one.t, one.load, one.depth, one.segments, np.array(one.notes, dtype=str))
    missing = [k for k in keys if keys[k] not in kept.known]
    with tqdm(
        total=len(missing), unit="curve", desc="fitting", disable=None if progress else True, leave=False
    ) as bar:
        # adhesive curves together, but for those that are in doubt
        if given["adhesion"] is not None and all(
            given[name] is None for name in ("weights", "sigma", "bounds")
        ):
            left: list[int] = []
            for places, found in adhesive_map.fitted_batches(
                [curves[k] for k in missing], given["indenter"], given["nu"], given["level"], processes or cores(), BATCH
            ):  # fmt: skip
                good = [(missing[i], one) for i, one in zip(places, found, strict=True) if one is not None]
                left.extend(missing[i] for i, one in zip(places, found, strict=True) if one is None)
                if good:
                    kept.add(
                        [keys[k] for k, _ in good],
                        {name: np.array([one[name] for _, one in good]) for name in good[0][1]},
                    )
                bar.update(len(good))
            missing = left
        count = min(processes or cores(), max(len(missing), 1))
        run = functools.partial(fitted_alone, **given)
        with contextlib.ExitStack() as stack:
            if count > 1:
                import loky

                # processes of loky do not run the calling script again, which then needs no guard ``__main__``
                pool = stack.enter_context(loky.ProcessPoolExecutor(count))
                results = pool.map(run, [curves[k] for k in missing])
            else:
                results = map(run, [curves[k] for k in missing])
            for first in range(0, len(missing), BATCH):
                some = missing[first : first + BATCH]
                parts = []
                for _ in some:
                    parts.append(next(iter(results)))
                    bar.update()
                kept.add(
                    [keys[k] for k in some],
                    {name: np.array([one[name] for one in parts]) for name in parts[0]},
                )
    for k, key in keys.items():
        arrays, i = kept.known[key]
        numbers = arrays["numbers"][i]
        for name, value in zip(("G", "work", "contact"), numbers[:9].reshape(3, 3), strict=True):
            out[name][k] = value
        for name, value in zip(("r2", "noise", "depth", "baseline", "tilt"), numbers[9:], strict=True):
            out[name][k] = value
        out["verdict"][k], out["reason"][k], notes = (
            str(arrays[name][i]) for name in ("verdict", "reason", "notes")
        )
        out["notes"][k] = tuple(notes.split("\n")) if notes else ()
    return out


def fitted_alone(data: IndentationData, **given: Any) -> dict[str, Any]:
    """Return the fit of one curve as numbers and text."""
    adhesion, numbers = given.pop("adhesion"), np.full(14, np.nan)
    try:
        if adhesion is None:
            fit: Any = fit_force(data, **given)
            scatter = (
                float(np.std((fit.force - fit.model_force)[fit.depth < 0.0]))
                if np.any(fit.depth < 0.0)
                else math.nan
            )
            rest = [fit.depth.max(), fit.nuisances["baseline"][0], fit.nuisances["tilt"][0]]
            point, work = fit.nuisances["contact_point"], [math.nan] * 3
        else:
            names = (
                "indenter",
                "nu",
                "thickness",
                "substrate",
                "unbonded",
                "weights",
                "sigma",
                "bounds",
                "level",
            )
            own = {name: given[name] for name in names if given[name] is not None}
            fit = fit_indentation(
                data, jc.Elastic, control="depth", adhesion="JKR", contact_point="fit", **own
            )
            scatter = float(np.std(fit.curve[3] - fit.fitted))
            point = fit.nuisances["contact_point"]
            work = [fit.values["work"], *fit.intervals["work"]]
            rest = [float(data.depth.max()) - point[0], math.nan, math.nan]
    except (ValueError, RuntimeError) as error:
        return {"numbers": numbers, "verdict": VERDICTS[2], "reason": str(error), "notes": ""}
    numbers[:] = [fit.values["G"], *fit.intervals["G"], *work, *point, fit.r2, scatter, *rest]
    return {
        "numbers": numbers, "verdict": fit.verdict, "reason": "; ".join(fit.refused), "notes": "\n".join(fit.notes),
    }  # fmt: skip


# The result, and the public function.


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MapFit:
    """The fits of the force curves of a map; every array has one entry for each of its m curves, nan where it failed.

    Attributes:
        values: {"G": (m,)} shear modulus [Pa]; with adhesion also "work" (m,) [J/m2].
        intervals: {name: (m, 2)} of the values at the confidence ``level``.
        contact_point (m,), contact_interval (m, 2): contact point, a depth as measured [m], and its interval.
        verdict (m,): "accepted", "rejected" or "failed" (no contact, or too few points).
        reasons: (m,) of text, why a curve is not accepted, "" otherwise.
        notes: (m,) of tuples of remarks on the fit of a curve.
        r2 (m,): coefficient of determination; noise (m,): standard deviation of a point on the baseline [N].
        depth (m,): largest depth below the contact point [m].
        baseline (m,) [N], tilt (m,) [N/s], or [N] per sample without times.
        x, y (m,): places [m], nan where they are not known; shape: (rows, columns) of a scan in whose order the curves are,
            None otherwise.
        names: (m,) of text, files of the curves, and curve (m,): positions in them.
        indenter, nu, thickness [m], adhesion: on which the moduli are conditional.
        calibration: factors on the widths of the intervals of modulus and contact point, from simulations.
        level: confidence level.
    """

    values: dict[str, np.ndarray]
    intervals: dict[str, np.ndarray]
    contact_point: np.ndarray
    contact_interval: np.ndarray
    verdict: np.ndarray
    reasons: tuple[str, ...]
    notes: tuple[tuple[str, ...], ...]
    r2: np.ndarray
    noise: np.ndarray
    depth: np.ndarray
    baseline: np.ndarray
    tilt: np.ndarray
    x: np.ndarray
    y: np.ndarray
    shape: tuple[int, int] | None
    names: tuple[str, ...]
    curve: np.ndarray
    indenter: Any
    nu: float
    thickness: float | None
    adhesion: str | None
    calibration: tuple[float, float]
    level: float

    @property
    def accepted(self) -> np.ndarray:
        """Which curves are accepted, (m,) bool."""
        return self.verdict == VERDICTS[0]

    @property
    def youngs_modulus(self) -> np.ndarray:
        """Young's modulus E = 2 (1 + nu) G (m,) [Pa]."""
        return 2.0 * (1.0 + self.nu) * self.values["G"]

    @property
    def youngs_interval(self) -> np.ndarray:
        """Interval of Young's modulus (m, 2) [Pa]."""
        return 2.0 * (1.0 + self.nu) * self.intervals["G"]

    def over_scan(self, values: Any, accepted: bool = True) -> np.ndarray:
        """Return values (m,) in the shape of the scan, nan where a curve is not accepted (unless accepted=False).

        Raises:
            ValueError: the curves are no complete scan.
        """
        if self.shape is None:
            raise ValueError("shape: expected a map with the shape of its scan, got curves without it")
        values = np.asarray(values, dtype=float)
        return np.where(self.accepted | (not accepted), values, np.nan).reshape(self.shape)

    def summary(self) -> str:
        """Return the numbers of curves by verdict, the quartiles of the modulus and the kinds of notes and reasons."""
        m, good, E = self.verdict.size, self.accepted, self.youngs_modulus
        lines = [f"{good.sum()} of {m} curves accepted"]
        if good.any():
            low, middle, high = np.percentile(E[good], [25, 50, 75])
            lines.append(f"E = {middle:.4g} Pa (median), {low:.4g} to {high:.4g} Pa (half of them)")
            width = np.median(np.log(self.youngs_interval[good, 1] / self.youngs_interval[good, 0]))
            lines.append(
                f"{100 * self.level:g} % intervals of a curve: {50 * width:.2g} % to either side (median)"
            )
            if "work" in self.values:
                low, middle, high = np.percentile(self.values["work"][good], [25, 50, 75])
                lines.append(f"work of adhesion = {middle:.4g} J/m2 (median), {low:.4g} to {high:.4g} J/m2")
        why = ((NUMBERS.sub("0", reason.split(":")[0]), reason) for reason in self.reasons if reason)
        said = ((NUMBERS.sub("0", note), note) for one in self.notes for note in one)
        lines += [f"not accepted: {line}" for line in text.counted(why, m)]
        return "\n".join([*lines, *(f"note: {line}" for line in text.counted(said, m))])

    def __repr__(self) -> str:
        good = self.accepted
        rows = [("accepted", int(good.sum()), f"of {good.size}"), ("shape", self.shape, "")]
        if good.any():
            rows += [("E", self.youngs_modulus[good], "Pa"), ("contact point", self.contact_point[good], "m")]
        return text.described(f"MapFit: {good.size} curves", rows)

    def table(self) -> tuple[list[str], list[list[Any]]]:
        """Return the names of columns with units, and a row for each curve."""
        E, ends = self.youngs_modulus, self.youngs_interval
        columns: dict[str, Any] = {
            "file": self.names, "curve": self.curve, "x [m]": self.x, "y [m]": self.y, "E [Pa]": E, "E low [Pa]": ends[:, 0],
            "E high [Pa]": ends[:, 1], "contact point [m]": self.contact_point,
            "contact point low [m]": self.contact_interval[:, 0], "contact point high [m]": self.contact_interval[:, 1],
            "depth [m]": self.depth,
        }  # fmt: skip
        if "work" in self.values:
            work, ends = self.values["work"], self.intervals["work"]
            columns |= {"work [J/m2]": work, "work low [J/m2]": ends[:, 0], "work high [J/m2]": ends[:, 1]}
        columns |= {
            "R2": self.r2, "noise [N]": self.noise, "verdict": self.verdict, "reason": self.reasons,
            "notes": ["; ".join(one) for one in self.notes],
        }  # fmt: skip
        return list(columns), [list(row) for row in zip(*columns.values(), strict=True)]

    def to_csv(self, path: Any) -> None:
        """Write a row for each curve, with the units in the names of the columns; missing numbers are empty."""
        output.write_table(Path(path), *self.table())

    def to_netcdf(self, path: Any) -> None:
        """Write the arrays with dimensions (y, x) of a scan, or (curve), with units; needs the extra ``jaxcontact[io]``.

        The verdict is 0 (accepted), 1 (rejected) or 2 (failed), as its attributes state.
        """
        try:
            import h5netcdf  # noqa: F401
            import xarray
        except ImportError as error:
            raise ImportError(
                f"NetCDF needs {error.name}; install it with: pip install 'jaxcontact[io]'"
            ) from error
        m = self.verdict.size
        dims, shape = (("curve",), (m,)) if self.shape is None else (("y", "x"), self.shape)
        arrays = {
            "youngs_modulus": (self.youngs_modulus, "Pa"), "youngs_modulus_low": (self.youngs_interval[:, 0], "Pa"),
            "youngs_modulus_high": (self.youngs_interval[:, 1], "Pa"), "contact_point": (self.contact_point, "m"),
            "contact_point_low": (self.contact_interval[:, 0], "m"),
            "contact_point_high": (self.contact_interval[:, 1], "m"), "largest_depth": (self.depth, "m"),
            "r2": (self.r2, "1"), "noise": (self.noise, "N"), "x_position": (self.x, "m"), "y_position": (self.y, "m"),
        }  # fmt: skip
        if "work" in self.values:
            low, high = self.intervals["work"].T
            arrays |= {
                "work": (self.values["work"], "J/m2"),
                "work_low": (low, "J/m2"),
                "work_high": (high, "J/m2"),
            }
        fields: dict[str, Any] = {
            name: (dims, np.reshape(v, shape), {"units": unit}) for name, (v, unit) in arrays.items()
        }
        codes = np.array([VERDICTS.index(one) for one in self.verdict], dtype=np.int8)
        flags = {"flag_values": np.arange(3, dtype=np.int8), "flag_meanings": " ".join(VERDICTS)}
        fields["verdict"] = dims, codes.reshape(shape), flags
        own = {"thickness_m": self.thickness, "adhesion": self.adhesion}
        given = {"nu": self.nu, "confidence_level": self.level, "indenter": probe_of(self.indenter).words}
        given |= {name: value for name, value in own.items() if value is not None}
        scale = {}
        if self.shape is not None and np.all(np.isfinite(self.x)):
            x, y = self.x.reshape(shape), self.y.reshape(shape)
            scale = {"x": ("x", x[0], {"units": "m"}), "y": ("y", y[:, 0], {"units": "m"})}
        whole = xarray.Dataset(fields, coords=scale, attrs=given)
        output.write(Path(path), lambda partial: whole.to_netcdf(partial, engine="h5netcdf"))

    @sheet.styled
    def plot(self, path: Any = None) -> Any:
        """Return a figure of modulus, contact point (and work of adhesion) and verdict over the places of the scan, or over
        the number of the curve where these are not known; saved where a path is given."""
        from matplotlib.figure import Figure

        known = np.all(np.isfinite(self.x) & np.isfinite(self.y)) and np.ptp(self.x) + np.ptp(self.y) > 0.0
        fields = [("Young's modulus", "Pa", self.youngs_modulus), ("contact point", "m", self.contact_point)]
        if "work" in self.values:
            fields.append(("work of adhesion", "J/m2", self.values["work"]))
        count = len(fields) + 1
        # a scan that is wider than high needs less height: a map is 0.72 of its panel wide, titles and labels take the rest
        height = (
            np.clip(0.72 * np.ptp(self.y) / max(np.ptp(self.x), 1e-300) + 0.26, 0.5, 1.0) if known else 1.0
        )
        figure = Figure(figsize=(count * SIZE, height * SIZE), layout="constrained")
        axes = [figure.add_subplot(1, count, k + 1) for k in range(count)]
        if known:
            self._over_places(figure, axes, fields)
        else:
            self._over_numbers(axes, fields)
        if path is not None:
            output.write(Path(path), lambda partial: figure.savefig(partial, dpi=150, format="png"))
        return figure

    def _over_places(self, figure: Any, axes: list[Any], fields: list[tuple[str, str, np.ndarray]]) -> None:
        """Draw the fields and the verdict over the places, as pixels of a scan or as squares."""
        from matplotlib.colors import LogNorm

        x, y = self.x - self.x.min(), self.y - self.y.min()
        # squares that almost touch where the places are closest along an axis
        steps = np.concatenate([np.diff(np.unique(np.round(v, 12))) for v in (x, y)])
        spacing = float(steps.min()) if steps.size else 1.0
        size = (
            float(np.clip(0.56 * 72.0 * SIZE * spacing / max(np.ptp(x), np.ptp(y), 1e-300), 1.0, 60.0)) ** 2
        )
        for one, (name, unit, values) in zip(axes, fields, strict=False):
            shown = self.accepted & np.isfinite(values)
            one.scatter(x[~shown], y[~shown], s=size, marker="s", facecolor="none", edgecolor="0.7")
            if shown.any():
                factor, prefixed = sheet.multiple(unit, float(np.max(np.abs(values[shown]))))
                values = values / factor
                low, high = np.min(values[shown]), np.max(values[shown])
                log = unit == "Pa" and high > sheet.STEEP * low > 0.0
                drawn = one.scatter(
                    x[shown], y[shown], s=size, marker="s", c=values[shown], norm=LogNorm() if log else None
                )
                ticks = {"ticks": sheet.log_ticks(values[shown]), "format": "%g"} if log else {}
                figure.colorbar(drawn, ax=one, label=f"{name} [{prefixed}]", **ticks).minorticks_off()
            one.set_title(f"{name}; empty squares: not accepted", fontsize="medium")
        for verdict_, colour in COLOURS.items():
            some = self.verdict == verdict_
            if not some.any():
                continue
            axes[-1].scatter(
                x[some], y[some], s=size, marker="s", color=colour, label=f"{verdict_}: {some.sum()}"
            )
        # above the map, which has no empty corner
        legend = axes[-1].legend(
            loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(COLOURS), handlelength=1.0
        )
        for handle in legend.legend_handles:
            handle.set_sizes([60.0])  # and not that of a place
        for one in axes:
            # half a place beyond the outermost, so that no square is cut
            one.margins(*(max(0.05, 0.55 * spacing / max(np.ptp(v), spacing)) for v in (x, y)))
            one.set_aspect("equal", adjustable="datalim")
            sheet.axis_label(one.xaxis, "x", "m", x)
            sheet.axis_label(one.yaxis, "y", "m", y)

    def _over_numbers(self, axes: list[Any], fields: list[tuple[str, str, np.ndarray]]) -> None:
        """Draw the fields, the modulus with its interval, and the number of curves of each verdict."""
        number, ends = np.arange(self.verdict.size), self.youngs_interval.T
        for verdict_, colour in COLOURS.items():
            some = self.verdict == verdict_
            for k, (one, (_, _, values)) in enumerate(zip(axes, fields, strict=False)):
                if k == 0:
                    spans = np.where(np.isfinite(ends), [values - ends[0], ends[1] - values], 0.0)
                    spans = np.clip(np.nan_to_num(spans), 0.0, None)[:, some]
                    one.errorbar(
                        number[some],
                        values[some],
                        spans,
                        fmt=".",
                        color=colour,
                        label=verdict_ if np.any(np.isfinite(values[some])) else None,
                    )
                else:
                    one.plot(number[some], values[some], ".", color=colour)
            axes[-1].bar([verdict_], [some.sum()], color=colour)
        known = np.isfinite(fields[0][2])
        if known.any():
            axes[0].set_yscale("log")
        axes[0].set_ylabel("Young's modulus [Pa]")
        axes[0].legend()
        for one, (name, unit, values) in zip(axes[1:], fields[1:], strict=False):
            if self.accepted.any():  # a rejected fit far away does not set the scale
                low, high = np.min(values[self.accepted]), np.max(values[self.accepted])
                bottom, top = one.get_ylim()
                if bottom < 2.0 * low - high or top > 2.0 * high - low:
                    room = max(high - low, 0.1 * abs(high))
                    one.set_ylim(max(bottom, low - room), min(top, high + room))
            sheet.axis_label(one.yaxis, name, unit, values[np.isfinite(values)])
        axes[-1].set_ylabel("number of curves")
        for one in axes[:-1]:
            one.set_xlabel("number of the curve")


def fit_map(
    depth: Any, load: Any = None, t: Any = None, *, indenter: Any, nu: float = 0.5, shape: tuple[int, int] | None = None,
    x: Any = None, y: Any = None, thickness: float | None = None, substrate: Any = None, unbonded: bool = False,
    adhesion: str | None = None, weights: str | None = None, sigma: Any = None, bounds: dict[str, tuple] | None = None,
    errors: dict[str, float] | None = None, spring_constant: float | None = None, drag: float | str | None = None,
    level: float = 0.95, names: Sequence[str] | None = None, curve: Any = None, store: Any = None,
    processes: int | None = None, progress: bool = False,
) -> MapFit:  # fmt: skip
    """Fit modulus, contact point and baseline to every force curve of a map, as ``fit_force`` does for one.

        force = G size d^p f(d)/(1 - nu) + baseline + tilt t,     d = max(depth - contact point, 0)

    The curves are fitted by one compiled program, in batches, one batch on each core: about 3 ms of processor time for a
    curve of 512 points, and some 10 s for the program where it is not in the compilation cache. Weights, intervals and
    verdict are those of ``fit_force``; what it simulates for each curve (the calibration of the widths, a factor of 0.97 to
    1.08) is simulated for 16 curves of the map, and their median factor taken. ``bounds``, ``substrate``, ``weights``,
    ``sigma`` and ``drag`` make searches of another kind: with them ``fit_force`` is called for each curve, in processes.

    With ``adhesion="JKR"`` a program of its own fits approach and retraction, also about 5 to 8 ms a curve
    (``fitting/fits/adhesive_map.py``); ``fit_indentation`` decides on the curves whose residuals leave a doubt, in 0.05 to
    4 s each, as it does for all with ``bounds``, ``weights`` or ``sigma``.

    Args:
        depth: depths of the tip [m], height - load/spring constant: rows (m, n) padded with nan, a list of arrays, or a list
            of ``IndentationData``, from which load and times are then taken (or text, why a curve cannot be read). Of
            arrays the approach is the part up to the largest depth, of ``IndentationData`` the segment "approach".
        load: loads [N], likewise.
        t: times [s], (n,) for all curves or as the depth; None: samples are counted, and the tilt is per sample.
        indenter, nu, thickness, substrate, unbonded, weights, sigma, bounds, errors, spring_constant, drag, level: as in
            ``fit_force``.
        shape: (rows, columns) of a scan whose curves are given row by row.
        x, y: places of the curves (m,) [m].
        adhesion: "JKR": fit the work of adhesion of a ball on a half-space to approach and retraction, as
            ``fit_indentation`` for one curve does; without thickness, errors and drag. None: no adhesion.
        names, curve: files of the curves and positions in them (m,), for the tables.
        store: folder in which results are kept after each batch. A further call with the same options takes what is there,
            so that a map that was stopped (Ctrl-C) is continued, and further curves are added.
        processes: number of batches (or curves) at a time; None: one for each core.
        progress: whether to show a bar.

    Returns:
        Arrays over the map with ``summary()``, ``plot(path)``, ``to_csv(path)`` and ``to_netcdf(path)``.

    Raises:
        ValueError: bad arguments, or arrays that do not fit together. A curve that cannot be fitted has the verdict
            "failed".

    Example:
        >>> d = np.linspace(-1e-6, 1e-6, 200)
        >>> G = np.array([300.0, 500.0, 800.0, 1200.0])
        >>> load = 16 / 3 * G[:, None] * np.sqrt(5e-6) * np.maximum(d, 0.0) ** 1.5
        >>> load += 1e-11 * np.random.default_rng(0).standard_normal(load.shape)
        >>> found = fitting.fit_map(np.tile(d, (4, 1)), load, indenter=jc.Sphere(5e-6), shape=(2, 2))
        >>> print(found.accepted, np.round(found.over_scan(found.values["G"]), -1))
        [ True  True  True  True] [[ 300.  500.]
         [ 800. 1200.]]
    """
    if adhesion is not None and str(adhesion).upper() != "JKR":
        raise ValueError(f'adhesion: expected "JKR" or None, got {adhesion!r}')
    if adhesion is not None:
        beside = {"thickness": thickness, "substrate": substrate, "errors": errors, "drag": drag}
        others = [name for name, value in beside.items() if value]
        if others:
            raise ValueError(f"adhesion: expected no {', '.join(others)} beside it in a map, got some")
    if not 0.0 < level < 1.0:
        raise ValueError(f"level: expected between 0 and 1, got {level!r}")
    if processes is not None and not (isinstance(processes, int | np.integer) and processes >= 1):
        raise ValueError(f"processes: expected a whole number from 1 on or None, got {processes!r}")
    # what the fit of every curve would refuse
    weights = "estimated" if weights is None and sigma is None else weights
    force.check_options(
        indenter, nu, thickness, substrate, unbonded, weights, sigma, errors, spring_constant, drag
    )
    if adhesion is None:
        Sought.of(CLASSICAL[jc.Elastic], None, bounds, nu)
    else:
        body_of(indenter, nu)
        table_of(JKR, None, bounds)
    # a list of ``IndentationData``, or of text where one could not be read; otherwise arrays
    listed = isinstance(depth, list | tuple) and len(depth) > 0
    listed = listed and all(isinstance(one, IndentationData | str) for one in depth)
    curves = list(depth) if listed else data_of(depth, load, t)
    m = len(curves)
    if m == 0:
        raise ValueError("depth: expected at least one curve, got none")
    places = [np.full(m, np.nan) if v is None else np.asarray(v, dtype=float).ravel() for v in (x, y)]
    for name, own in zip("xy", places, strict=True):
        if own.size != m:
            raise ValueError(f"{name}: expected {m} places, one for each curve, got {own.size}")
    if shape is not None and math.prod(shape) != m:
        raise ValueError(f"shape: expected rows x columns = {m} curves, got {shape}")
    # arguments of the fit of a curve alone, with those for which the program has no search
    single = {
        "substrate": substrate, "weights": None if weights == "estimated" else weights, "sigma": sigma,
        "bounds": bounds or None, "drag": drag,
    }  # fmt: skip
    given = {
        "indenter": indenter, "nu": nu, "thickness": thickness, "unbonded": bool(unbonded), "adhesion": adhesion,
        "level": level, "errors": errors, "spring_constant": spring_constant, **single,
    }  # fmt: skip
    kept = Store(store, given)
    if adhesion is not None or any(v is not None for v in single.values()):
        found, factors = each_alone(curves, given, kept, processes, progress), np.ones(2)
    else:
        found, factors = all_together(curves, given, kept, processes, progress)
    fitted = ("G", "work") if adhesion is not None else ("G",)
    return MapFit(
        values={name: found[name][:, 0] for name in fitted}, intervals={name: found[name][:, 1:] for name in fitted},
        contact_point=found["contact"][:, 0], contact_interval=found["contact"][:, 1:], verdict=found["verdict"],
        reasons=tuple(found["reason"]), notes=tuple(found["notes"]), r2=found["r2"], noise=found["noise"],
        depth=found["depth"], baseline=found["baseline"], tilt=found["tilt"], x=places[0], y=places[1],
        shape=shape or scan_of(*places), names=tuple(names) if names is not None else ("",) * m,
        curve=np.arange(m) if curve is None else np.asarray(curve), indenter=indenter, nu=nu, thickness=thickness,
        adhesion=None if adhesion is None else "JKR", calibration=(float(factors[0]), float(factors[1])), level=level,
    )  # fmt: skip


def scan_of(x: np.ndarray, y: np.ndarray) -> tuple[int, int] | None:
    """Return (rows, columns) where places (m,) are those of a complete scan, row by row, None otherwise."""
    if x.size < 4 or not np.all(np.isfinite(x) & np.isfinite(y)):
        return None
    turns = np.flatnonzero(np.abs(np.diff(y)) > 1e-3 * np.ptp(y)) + 1
    columns = int(turns[0]) if turns.size else 0
    if columns < 2 or x.size % columns:
        return None
    X, Y, near = x.reshape(-1, columns), y.reshape(-1, columns), 0.1 / columns
    straight = np.ptp(X, axis=0).max() <= near * np.ptp(x) and np.ptp(Y, axis=1).max() <= near * np.ptp(y)
    rising = np.all(np.diff(X[0]) * np.sign(X[0, 1] - X[0, 0]) > 0.0) and np.all(
        np.abs(np.diff(Y[:, 0])) > 0.0
    )
    return (x.size // columns, columns) if straight and rising and np.unique(Y[:, 0]).size == len(Y) else None
