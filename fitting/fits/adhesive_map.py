"""Fits of the adhesive force curves of a map: one compiled program makes the fits of ``fit_indentation`` with "JKR".

The model is that of ``adhesion.py`` for an elastic half-space and an attraction of short range. In the units of
``models/adhesive_contact.py`` at the starting values of a curve, and with e and w the contact modulus and the work of
adhesion over these,

    load = w f(approach (e/w)^(2/3)),     approach = depth - p,     f = ``scaled_load``.

The coordinates are the logarithms of shear modulus and work of adhesion over their starting values, and p. Least squares,
profile likelihoods of all three and the noise of the residuals are computed for the points in contact of each curve. The
program runs over the curves of a batch one after the other, and the batches in threads, as those of ``force_map.py``.

The program only concludes a fit whose residuals pass the tests, or one that a fault of the instrument rejects. Curves in
doubt (a trend, outliers, a search that ends at a bound) need fits to parts of the curve and one with a range of the
attraction; these are made by ``fit_indentation`` itself.

Search and profiles are those of ``search/nonlinear.py`` in a form that is compiled: there a step
is a bounded linear problem of numpy and a walk along a profile may change to another branch of minima, which costs
milliseconds in each of a hundred steps of a curve. Here all of them take 7 ms: a step solves 3 by 3 equations and is cut at
the bounds, and an end lies on one branch. Curves whose best values or ends that does not find are in doubt.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from fitting.data.indentation import IndentationData, paraboloid_note
from fitting.fits.adhesion import AdhesiveTest, body_of, fault, read_adhesive, table_of
from fitting.inference import noise, verdict
from fitting.inference.noise_of_many import is_doubted, noise_of_one, quantiles
from fitting.inference.sample import EXACT, NEGLIGIBLE, ROUNDING
from fitting.models.adhesive_contact import JKR, scaled_load
from fitting.search import nonlinear
from fitting.search.press import Instrument
from jaxcontact._compile.programs import Program

COUNT = 3  # coordinates
# Levenberg-Marquardt steps, those along a profile, and trial values of its end
STEPS, INNER, ENDS = 100, 12, 8
FALL, CLOSE = 1e-12, 1e-2  # relative fall of RSS at convergence, and accuracy of the height of a profile


class Row(NamedTuple):
    """A curve in scaled units.

    depth, load (N,): of which the first n count; ball: compliance of the ball over that of the half-space at the start;
    start, low, high (3,): of the coordinates; zero: possible error of the zero of the load at the level;
    constants: the level and the quantiles of t that depend on n.
    """

    depth: Array
    load: Array
    n: Array
    ball: Array
    start: Array
    low: Array
    high: Array
    zero: Array
    constants: dict[str, Array]


def fit_one(row: Row) -> dict[str, Array]:
    """Return the fit of a curve in scaled units."""
    N, n = row.depth.size, row.n
    on = jnp.arange(N) < n

    def linearised(theta: Array) -> tuple[Array, Array]:
        """Return residuals (N,) and their derivatives (3, N)."""
        work, soft = jnp.exp(theta[1]), jnp.exp(-theta[0])
        e = (1.0 + row.ball) / (soft + row.ball)
        scale = jnp.cbrt(e / work) ** 2
        approach = (row.depth - theta[2]) * scale
        load, slope = jax.jvp(lambda x: scaled_load(x, None), (approach,), (jnp.ones(N),))
        turn = 2.0 / 3.0 * work * slope * approach
        rows = jnp.stack([turn * soft / (soft + row.ball), work * load - turn, -work * slope * scale])
        return jnp.where(on, work * load - row.load, 0.0), jnp.where(on, rows, 0.0)

    def search(theta: Array, held: Array, floor: Array, steps: int) -> tuple[Array, Array, Array, Array]:
        """Return the least squares over the coordinates that are not held (3,) bool, as ``nonlinear.minimise_some``: theta,
        residuals, their derivatives, and whether the search converged."""

        def going(state: tuple) -> Array:
            return ~state[-2] & (state[-1] < steps)

        def step(state: tuple) -> tuple:
            theta, r, rows, damping, _, count = state
            rss = r @ r
            J = jnp.where(held[:, None], 0.0, rows)
            gram, pull = J @ J.T, J @ r
            size = jnp.where(held, 1.0, jnp.diag(gram))
            at = lambda gram: jnp.linalg.solve(gram, -pull)
            move = at(gram + jnp.diag(jnp.where(held, 1.0, (damping + 1e-14) * size)))
            move = jnp.clip(theta + move, row.low, row.high) - theta
            expected = -(2.0 * move @ pull + move @ gram @ move)
            ended = (expected <= FALL * rss + floor) | (damping > 1e8)
            r_new, rows_new = linearised(theta + move)
            better = r_new @ r_new < rss  # false for nan
            gain = (rss - r_new @ r_new) / jnp.maximum(expected, 1e-300)
            less = damping * jnp.maximum(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
            less = jnp.where(less > 1e-4, less, 0.0)
            take = better & ~ended
            damping = jnp.where(better, less, jnp.maximum(10.0 * damping, 1e-3))
            pick = lambda new, old: jnp.where(take, new, old)
            return pick(theta + move, theta), pick(r_new, r), pick(rows_new, rows), damping, ended, count + 1

        state = (theta, *linearised(theta), jnp.zeros(()), jnp.asarray(False), jnp.asarray(0))
        theta, r, rows, _, ended, _ = lax.while_loop(going, step, state)
        return theta, r, rows, ended

    # 1. The least squares, with the weights of all points equal.
    nothing = jnp.zeros(COUNT, dtype=bool)
    size = jnp.sum(jnp.where(on, row.load**2, 0.0))
    theta, r, rows, converged = search(row.start, nothing, 1e-26 * size, STEPS)
    total, fitted = r @ r, jnp.where(on, row.load + r, 0.0)
    inside = jnp.all((theta > row.low) & (theta < row.high))

    # 2. The noise, with error models that are all the same, and the rises of RSS at the ends of the intervals.
    real, ones = total > EXACT * size, jnp.where(on, 1.0, 0.0)
    of = row.constants
    found = noise_of_one(r, rows, ones, jnp.ones(N), n, of["level"], of["single"], real)
    rises = jnp.maximum(found.half**2, ROUNDING * size)

    # 3. Ends of the intervals: the value of a coordinate at which the least squares over the others reach their level.
    gram = rows @ rows.T
    inverse = jnp.linalg.inv(gram + 1e-300 * jnp.eye(COUNT))

    def end(k_and_sign: tuple[Array, Array]) -> tuple[Array, Array]:
        k, sign = k_and_sign
        held = jnp.arange(COUNT) == k
        along = inverse[k] / inverse[k, k]
        line = jnp.sqrt(rises[k] * inverse[k, k])

        def going(state: tuple) -> Array:
            *_, ended, count = state
            return ~ended & (count < ENDS)

        def trial(state: tuple) -> tuple:
            away, start, from_away, inner, outer, _, count = state
            at = jnp.where(held, theta[k] + sign * away, start + sign * (away - from_away) * along)
            best, own, _, _ = search(jnp.clip(at, row.low, row.high), held, 1e-3 * rises[k], INNER)
            height = jnp.sqrt(jnp.maximum(own @ own - total, 0.0) / rises[k])
            # distances and heights of the last points on either side of the level
            point, below = jnp.stack([away, height]), height < 1.0
            inner, outer = jnp.where(below, point, inner), jnp.where(below, outer, point)
            share = (1.0 - inner[1]) / (outer[1] - inner[1])
            between = inner[0] + jnp.clip(share, 0.1, 0.9) * (outer[0] - inner[0])
            further = away / jnp.clip(height, 0.5, 3.0)
            new = jnp.where(jnp.isfinite(outer[0]), between, further)
            # at the level, and the rest of the way in proportion to the height; or where the height jumps past it, as at
            # points that leave the stable branch
            near, jumps = jnp.abs(height - 1.0) < CLOSE, outer[0] - inner[0] < CLOSE * outer[0]
            new = jnp.where(near, away / height, jnp.where(jumps, inner[0], new))
            return new, best, away, inner, outer, near | jumps, count + 1

        zero, far = jnp.zeros(2), jnp.full(2, jnp.inf)
        state = (line, theta, jnp.zeros(()), zero, far, jnp.asarray(False), jnp.asarray(0))
        away, *_, ended, _ = lax.while_loop(going, trial, state)
        return theta[k] + sign * away, ended

    places = jnp.repeat(jnp.arange(COUNT), 2), jnp.tile(jnp.array([-1.0, 1.0]), COUNT)
    ends, reached = lax.map(end, places)
    # an error of the zero of the load, which is independent of the noise, moves the coordinates by (J^T J)^-1 J^T zero
    by_zero = (inverse @ jnp.sum(rows, 1)) * row.zero
    half = jnp.hypot(ends.reshape(COUNT, 2) - theta[:, None], by_zero[:, None])
    ends = theta[:, None] + half * jnp.array([-1.0, 1.0])

    # 4. Whether the tests of the residuals leave a doubt, and how much of the data is explained.
    far = of["slip"], of["outlier"]
    doubted = is_doubted(r, rows, found, n, far) & (total > NEGLIGIBLE * size) & real
    mean = jnp.sum(jnp.where(on, row.load, 0.0)) / n
    about = jnp.sum(jnp.where(on, (row.load - mean) ** 2, 0.0))
    poor = (total >= about) | (total / (n - COUNT) > jnp.sum(fitted**2) / n)
    sound = jnp.all(jnp.isfinite(ends)) & jnp.all(reached) & converged & inside
    return {
        "theta": theta, "ends": ends, "r": r, "r2": 1.0 - total / jnp.maximum(about, 1e-300), "varied": found.varied,
        "spread": jnp.sqrt(jnp.maximum(total / n - (jnp.sum(r) / n) ** 2, 0.0)),
        "left": doubted | poor | ~sound,
    }  # fmt: skip


@Program
def fit_batch(rows: Row) -> dict[str, Array]:
    """Return the fits of the curves of a batch."""
    return lax.map(fit_one, rows)


class Curve(NamedTuple):
    """A curve of a map with its test, the starting values of G [Pa] and of the work of adhesion [J/m2], the units of its
    depth [m] and load [N], a zero of its depth [m], the error of the zero of its load [N] at the level, and the coordinates
    of the search: start, low, high (3,)."""

    test: AdhesiveTest
    G: float
    work: float
    depth_unit: float
    load_unit: float
    zero: float
    load_error: float
    box: np.ndarray

    @classmethod
    def of(cls, data: IndentationData, body: Any, level: float) -> "Curve":
        """Return a curve; ValueError for one that cannot be fitted."""
        data, zero_sd, seen, weights, _ = read_adhesive(data, body.ball, None, None)
        test = AdhesiveTest(data, seen, body, JKR, weights)
        start, R = test.start(), float(body.ball.radius)
        K = 4.0 / 3.0 * float(body.modulus(start["G"]))
        depth = float(np.cbrt(math.pi**2 * start["work"] ** 2 * R / K**2))
        space = test.space(table_of(JKR, None, None), Instrument(contact_point="fit"))
        zero = test.first_touch()
        low, high = (side[:COUNT].copy() for side in space.bounds)
        for side in (low, high):
            side[2] = (side[2] * space.unit[2] - zero) / depth
        first = np.clip(np.zeros(COUNT), low, high)
        G, work = start["G"], start["work"]
        error = noise.two_sided(level) * zero_sd
        return cls(test, G, work, depth, math.pi * work * R, zero, error, np.stack([first, low, high]))


def fitted_batches(
    curves: Sequence[IndentationData], indenter: Any, nu: float, level: float, threads: int, batch: int
) -> Iterator[tuple[list[int], list[dict[str, Any] | None]]]:
    """Yield the places of the curves of each batch and their results in the form of ``force_map.fitted_alone``: None where
    ``fit_indentation`` must decide."""
    body = body_of(indenter, nu)
    ready: list[tuple[int, Curve]] = []
    for i, data in enumerate(curves):
        try:
            ready.append((i, Curve.of(data, body, level)))
        except (ValueError, RuntimeError):
            yield [i], [None]  # the fit of the curve alone has the message
    if not ready:
        return
    N = nonlinear.length(max(int(one.test.seen.contact.sum()) for _, one in ready))

    def row_of(one: Curve) -> Row:
        test, contact = one.test, one.test.seen.contact
        n, (start, low, high) = int(contact.sum()), one.box
        pad = lambda values: np.pad(values, (0, N - n), mode="edge")
        # approach and retraction are series of their own
        of = quantiles(n, COUNT, level, blocks=2)
        constants: dict[str, Any] = {name: np.asarray(value) for name, value in of.items()}
        return Row(
            pad((test.data.depth[contact] - one.zero) / one.depth_unit), pad(test.data.load[contact] / one.load_unit),
            np.asarray(n), np.asarray(body.own * one.G / (1.0 - nu)), start, low, high,
            np.asarray(one.load_error / one.load_unit), constants,
        )  # fmt: skip

    def batch_of(some: list[tuple[int, Curve]]) -> list[dict[str, Any] | None]:
        rows = [row_of(one) for _, one in some]
        rows += [rows[0]] * (batch - len(rows))
        stacked = Row(*(
            {name: np.stack([row.constants[name] for row in rows]) for name in rows[0].constants}
            if field == "constants" else np.stack([getattr(row, field) for row in rows])
            for field in Row._fields
        ))  # fmt: skip
        found = {name: np.asarray(values) for name, values in fit_batch(stacked).items()}
        return [concluded(one, {name: v[k] for name, v in found.items()}) for k, (_, one) in enumerate(some)]

    pieces = [ready[first : first + batch] for first in range(0, len(ready), batch)]
    for some, found in zip(pieces, in_threads(batch_of, pieces, threads), strict=True):
        yield [i for i, _ in some], found


def in_threads(run: Callable, pieces: Sequence[Any], threads: int) -> Iterator[Any]:
    """Yield run(piece) for the batches of a map in their order; ``run`` in some threads at a time, since a compiled program
    releases the interpreter's lock."""
    with ThreadPoolExecutor(threads) as pool:
        waiting = [pool.submit(run, piece) for piece in pieces]
        try:
            for one in waiting:
                yield one.result()
        finally:  # after Ctrl-C, batches that wait are not begun
            for one in waiting:
                one.cancel()


def concluded(one: Curve, found: dict[str, np.ndarray]) -> dict[str, Any] | None:
    """Return numbers, verdict, reason and notes of a fit of the program, None where it is in doubt."""
    test = one.test
    contact, data = test.seen.contact, test.data
    deviations = -data.load.copy()
    deviations[contact] = found["r"][: int(contact.sum())] * one.load_unit
    broken = fault(data, contact, deviations)
    if not np.all(np.isfinite(found["ends"])) or (found["left"] and not broken):
        return None
    rows = np.column_stack([found["theta"], found["ends"]])
    G, work = one.G * np.exp(rows[0]), one.work * np.exp(rows[1])
    reason = "; ".join(filter(None, (broken, *verdict.beyond_solids(float(G[1])))))
    point = one.zero + one.depth_unit * rows[2]
    deepest = float(data.depth.max() - point[0])
    said = [*data.notes, *paraboloid_note(test.body.ball, deepest)]
    if found["varied"]:
        said.append("the noise changes along the depth; the intervals allow for it")
    rest = [float(found["r2"]), float(found["spread"]) * one.load_unit, deepest, math.nan, math.nan]
    return {
        "numbers": np.array([*G, *work, *point, *rest]), "verdict": "rejected" if reason else "accepted",
        "reason": reason, "notes": "\n".join(said),
    }  # fmt: skip
