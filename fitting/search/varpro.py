"""Bounded least squares that is linear except in one retardation time, with exact profiles (variable projection).

Every material here has J(t) = j0 + j2 (1 - exp(-t/tau)) + f t, with j0 = 1/G1, j2 = 1/G2, f = 1/eta1 and tau = eta2/G2
(some of them absent). Under a stress history the strain is x . [E, D(tau), F](t) with x = (j0, j2, f) (``structure.py``).
At a fixed tau this is a least-squares problem in a three-dimensional box, solved exactly by enumerating the faces of
the box, and tau is found by a one-dimensional search (variable projection: G. H. Golub, V. Pereyra, SIAM J. Numer.
Anal. 10 (1973) 413). The open end 1/eta1 = 0 is a face of the box.

The same faces give profile likelihoods without nested minimisation: at a fixed tau the points with RSS <= level form an
ellipsoid cut by the box, and the extent of a linear functional d . x over it has a closed form on each face; the
interval is the extreme of these over tau.

All quantities are dimensionless here: times are divided by the last time, data by their largest value.
"""

import dataclasses
import functools
import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.data.creep import CreepData
from fitting.models.parameters import Parameters
from fitting.models.structure import History, Step, Structure, columns, merge
from fitting.search import nonlinear
from jaxcontact._compile.programs import Program

# places of the two or four compliances of a material with no or one retardation time in (j0, j2, f, j2/tau)
PLACES = {2: [0, 2], 4: [0, 1, 2, 3]}
ROUNDING = 1e-14  # rounding error of RSS, as a fraction of the data's sum of squares
COARSE = 97  # values of log tau on the first grid, over the whole range of the search
ZOOM = 9  # values on each finer grid, over one step of the grid before on either side of the best value
ROUNDS = 4  # finer grids
CLOSER = 8  # steps of the search for each end of the range of tau that a level of RSS allows
FINE = 33  # values of log tau over that range, among which the extremes are found
PAIRS = np.triu_indices(3)  # pairs of columns whose products make the normal matrix
PLACE = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])  # place of each element of the normal matrix in that list


@jax.tree_util.register_static
@dataclasses.dataclass(frozen=True)
class Sides:
    """Possible states of each of (j0, j2, f): free (0), at its lower (1) or at its upper (2) bound."""

    choices: tuple[tuple[int, ...], ...]

    def faces(self) -> np.ndarray:
        """Return every face of the box, (k, 3)."""
        return np.array(list(itertools.product(*self.choices)))


class TauProblem(NamedTuple):
    """A weighted fit with one retardation time.

    data, weights (n,); history: the stress, a ``Step`` or a
    ``History``; lower, upper (3,) of (j0, j2, f); ratio (2,): bounds of j2/tau = 1/eta2;
    tau (2,): the range of the search; sides: of the box; origin (3,): point about which the sums are formed, because
    near the optimum RSS would lose its digits in the data's sum of squares if the sums were formed about zero.
    """

    data: Array
    weights: Array
    history: Any
    lower: Array
    upper: Array
    ratio: Array
    tau: Array
    sides: Sides
    origin: Array

    @property
    def free(self) -> np.ndarray:
        """Places (k,) of the fitted compliances among (j0, j2, f, j2/tau)."""
        lower, upper = self.limits
        return np.flatnonzero(np.asarray(lower) < np.asarray(upper))

    @property
    def limits(self) -> tuple[Array, Array]:
        """Bounds of (j0, j2, f, j2/tau), (4,) each."""
        return jnp.append(self.lower, self.ratio[0]), jnp.append(self.upper, self.ratio[1])


def tau_problem(
    y: np.ndarray, weights: np.ndarray, history: Step | History, t: np.ndarray, box: np.ndarray
) -> TauProblem:
    """Return the problem for scaled data y (n,) at t (n,), with the bounds of a material's compliances in ``box`` (m,
    2)."""
    bounds = np.zeros((4, 2))  # of (j0, j2, f, j2/tau)
    bounds[PLACES[len(box)]] = box
    low, high = bounds.T

    # The faces that can occur; usually far fewer than 27. A compliance that is fixed has the faces of one with an
    # open end, on one of which it is at its value: so materials with and without it share their compiled programs.
    ends = np.isfinite(high[:3]) & (low[:3] < high[:3])
    ends[1] |= np.isfinite(high[3]) and low[1] < high[1]
    sides = Sides(tuple((0, 1, 2) if capped else (0, 1) for capped in ends))

    # The range of retardation times to search, restricted to the bounds of j2 and j2/tau. Below t_first/40 and above
    # 300 times the last time the curve no longer depends on tau (to 1e-17 and to 2e-3 of a term that flow and spring
    # already represent).
    first, last = np.min(t[t > 0]) / 40.0, 300.0
    with np.errstate(divide="ignore", invalid="ignore"):
        least = low[1] / high[3] if low[1] > 0 and np.isfinite(high[3]) else 0.0
        most = high[1] / low[3] if low[3] > 0 and np.isfinite(high[1]) else np.inf
    first, last = max(first, least) if least > 0 else first, min(last, most)
    if high[1] == 0.0:
        first = last = 1.0  # without a retarded part tau is arbitrary
    elif first > last:
        first, last = least or most, most if np.isfinite(most) else least
    return TauProblem(
        y, weights, history, low[:3], high[:3], bounds[3], np.array([first, last]), sides, origin=np.zeros(3)
    )


class Faces(NamedTuple):
    """Solutions on the faces of the box: minimiser x (k, 3), inverse of the free block (k, 3, 3), rss (k,), inside (k,)
    bool."""

    x: Array
    inverse: Array
    rss: Array
    inside: Array


def box(problem: TauProblem, tau: Array) -> tuple[Array, Array]:
    """Return the bounds of (j0, j2, f) at this tau: those of 1/eta2 become bounds of j2."""
    lower = jnp.asarray(problem.lower).at[1].max(problem.ratio[0] * tau)
    upper = jnp.asarray(problem.upper).at[1].min(problem.ratio[1] * tau)
    return lower, upper


def _inverse3(A: Array) -> Array:
    """Return the inverse of symmetric positive (..., 3, 3) by L D L^T, with pivots kept above rounding."""
    tiny = 1e-15 * jnp.maximum(jnp.max(jnp.abs(A), axis=(-2, -1)), 1e-300)
    d0 = jnp.maximum(A[..., 0, 0], tiny)
    l10, l20 = A[..., 1, 0] / d0, A[..., 2, 0] / d0
    d1 = jnp.maximum(A[..., 1, 1] - l10 * A[..., 1, 0], tiny)
    l21 = (A[..., 2, 1] - l20 * A[..., 1, 0]) / d1
    d2 = jnp.maximum(A[..., 2, 2] - l20 * A[..., 2, 0] - l21 * l21 * d1, tiny)
    one, zero = jnp.ones_like(d0), jnp.zeros_like(d0)
    rows = [[one, zero, zero], [-l10, one, zero], [l10 * l21 - l20, -l21, one]]
    L = jnp.stack([jnp.stack(row, -1) for row in rows], -2)
    return jnp.sum(L[..., :, :, None] * L[..., :, None, :] / jnp.stack([d0, d1, d2], -1)[..., None, None], -3)


def faces(problem: TauProblem, tau: Array) -> Faces:
    """Return the least-squares solution on each face of the box at this tau."""
    # The normal matrix (3, 3), right-hand side and weighted sum of squares of the data minus the model at the origin.
    # The squared weights are separate from the products of columns: for many curves on one time grid the products are
    # formed once and the sums are one matrix product.
    C, square = columns(problem.history, jnp.reshape(1.0 / tau, 1)), problem.weights**2
    A = (square @ (C[:, PAIRS[0]] * C[:, PAIRS[1]]))[PLACE]
    remaining = problem.data - C @ problem.origin
    weighted = square * remaining
    b, yy = weighted @ C, weighted @ remaining

    # The minimiser and the inverse of the normal matrix on each face, in units of the columns.
    scale = 1.0 / jnp.sqrt(jnp.maximum(jnp.diagonal(A), 1e-300))
    A, b = A * scale[:, None] * scale, b * scale
    low, high = ((side - problem.origin) / scale for side in box(problem, tau))
    table = problem.sides.faces()
    free = jnp.asarray(table == 0)
    clamped = jnp.where(table == 1, low, jnp.where(table == 2, high, 0.0))
    usable = jnp.all(jnp.isfinite(clamped), -1)
    clamped = jnp.where(usable[:, None], clamped, 0.0)
    both = free[:, :, None] & free[:, None, :]
    inverse = _inverse3(jnp.where(both, A, jnp.eye(3))) * both
    x = jnp.einsum("fij,fj->fi", inverse, b - clamped @ A) + clamped
    rss = jnp.maximum(yy - 2.0 * x @ b + jnp.einsum("fi,ij,fj->f", x, A, x), 0.0)
    inside = usable & _within(x, low, high, free)
    return Faces(
        x * scale + problem.origin, inverse * scale[:, None] * scale, jnp.where(usable, rss, jnp.inf), inside
    )


def _within(x: Array, low: Array, high: Array, free: Array) -> Array:
    """Return whether x (..., 3) lies in the box along its free coordinates, and the box is not empty."""
    slack = 1e-12 * jnp.where(jnp.isfinite(high), jnp.abs(high), 0.0)
    ok = (x >= low - slack) & (x <= high + slack)
    return jnp.all(ok | ~free, -1) & jnp.all(low <= high + slack)


def best_at_each(problem: TauProblem, log_tau: Array) -> tuple[Array, Array]:
    """Return the lowest rss (k,) at each tau and its x (k, 3); inf where the box is empty."""

    def best(z: Array) -> tuple[Array, Array]:
        face = faces(problem, jnp.exp(z))
        rss = jnp.where(face.inside, face.rss, jnp.inf)
        k = jnp.argmin(rss)
        return rss[k], face.x[k]

    return jax.lax.map(best, log_tau)


@functools.partial(Program, work=lambda problem: 5e3)  # as ``minimise``
def solve(problem: TauProblem) -> tuple[Array, Array, Array, Array]:
    """Return (rss, x, tau, rss on the first grid of tau (COARSE,)), from a grid in log tau that is then refined."""
    lo, hi = jnp.log(problem.tau[0]), jnp.log(problem.tau[1])
    grid = jnp.linspace(lo, hi, COARSE)
    cost, _ = best_at_each(problem, grid)
    k = jnp.argmin(cost)
    step = (hi - lo) / (COARSE - 1)

    def zoom(_: int, state: tuple[Array, ...]) -> tuple[Array, ...]:
        points = jnp.clip(state[0] + jnp.linspace(-1.0, 1.0, ZOOM) * state[1], lo, hi)
        rss, x = best_at_each(problem, points)
        j = jnp.argmin(rss)
        return points[j], state[1] * (2.0 / (ZOOM - 1)), rss[j], x[j]

    start = (grid[k], step, cost[k], jnp.zeros(3))
    centre, _, rss, x = jax.lax.fori_loop(0, ROUNDS, zoom, start)
    return rss, x, jnp.exp(centre), cost


@functools.partial(Program, work=lambda problem, tau: 5e3)  # as ``minimise``
def solve_each(problem: TauProblem, tau: Array) -> Array:
    """Return the least-squares solutions (k, 3) at each of tau (k,)."""
    return best_at_each(problem, jnp.log(tau))[1]


def extent_at(problem: TauProblem, tau: Array, level: Array, d: Array) -> Array:
    """Return the extremes of d . x over {x in the box: rss <= level} at this tau; d (m, 3) -> (m, 2).

    On a face with minimiser x and inverse V of its block of the normal matrix the extremes are d.x -+ sqrt((level -
    rss) d.V.d), and count only where that point lies in the box. An empty set gives (inf, -inf).
    """
    face = faces(problem, tau)
    lower, upper = box(problem, tau)
    room = level - face.rss
    # at the ends of the reach RSS is the level itself, and rounding must not empty the set
    slack = ROUNDING * jnp.sum((problem.weights * problem.data) ** 2)
    direction = jnp.einsum("fij,mj->fmi", face.inverse, d)
    spread = jnp.einsum("fmi,mi->fm", direction, d)
    length = jnp.sqrt(jnp.maximum(room, 0.0)[:, None] / jnp.where(spread > 0, spread, jnp.inf))
    free = jnp.asarray(problem.sides.faces() == 0)[:, None, :]
    ends = []
    for sign in (-1.0, 1.0):
        x = face.x[:, None, :] + sign * length[..., None] * direction
        ok = _within(x, lower, upper, free) & (room >= -slack)[:, None] & jnp.isfinite(face.rss)[:, None]
        value = jnp.sum(x * d, -1)
        ends.append(sign * jnp.max(jnp.where(ok, sign * value, -jnp.inf), 0))
    return jnp.stack(ends, -1)


def extents(
    problem: TauProblem, tau: Array, cost: Array, level: Array, functional: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Return the extremes (m, 2) of functional(tau) . x over rss <= level, and the range (2,) of log tau.

    The nodes are Chebyshev points in log tau: the extent along tau is the edge of an ellipse-like region, which is
    smooth in the angle even where tau and the functional are strongly correlated.
    """
    # log of the lowest and the highest tau with rss <= level, between neighbours on the first grid of tau with
    # ``cost``; the end of the search range where open
    grid = jnp.linspace(jnp.log(problem.tau[0]), jnp.log(problem.tau[1]), COARSE)
    good = cost <= level
    best = jnp.log(tau)
    first = jnp.min(jnp.where(good, grid, best))
    last = jnp.max(jnp.where(good, grid, best))
    below = jnp.max(jnp.where(grid < first, grid, grid[0]))
    above = jnp.min(jnp.where(grid > last, grid, grid[-1]))

    inner, outer = jnp.stack([first, last]), jnp.stack([below, above])
    known, _ = best_at_each(problem, jnp.concatenate([best[None], inner, outer]))
    floor, goal = known[0], jnp.sqrt(jnp.maximum(level - known[0], 1e-300))
    height = lambda rss: jnp.sqrt(jnp.maximum(rss - floor, 0.0)) / goal - 1.0

    def close_in(_: int, state: tuple[Array, ...]) -> tuple[Array, ...]:
        """Take an Illinois step on the square root of the rise in rss, which is nearly linear."""
        inner, low, outer, high, side = state
        share = jnp.where(jnp.isfinite(high), -low / jnp.where(high > low, high - low, 1.0), 0.5)
        middle = inner + jnp.clip(share, 0.01, 0.99) * (outer - inner)
        here = height(best_at_each(problem, middle)[0])
        ok = here <= 0.0
        return (
            jnp.where(ok, middle, inner),
            jnp.where(ok, here, jnp.where(side == 1, 0.5 * low, low)),
            jnp.where(ok, outer, middle),
            jnp.where(ok, jnp.where(side == -1, 0.5 * high, high), here),
            jnp.where(ok, -1, 1),
        )

    start = (inner, height(known[1:3]), outer, height(known[3:]), jnp.zeros(2, int))
    inner = jax.lax.fori_loop(0, CLOSER, close_in, start)[0]
    open_end = jnp.stack([cost[0], cost[-1]]) <= level
    low, high = ends_of_tau = jnp.where(open_end, grid[jnp.array([0, -1])], inner)

    # the extremes at the nodes and at the optimum
    angle = jnp.linspace(0.0, jnp.pi, FINE)
    nodes = jnp.append(0.5 * (low + high) - 0.5 * (high - low) * jnp.cos(angle), jnp.log(tau))
    ends = jax.lax.map(lambda z: extent_at(problem, jnp.exp(z), level, functional(jnp.exp(z))), nodes)
    sign = jnp.array([-1.0, 1.0])
    y, at_best = ends[:-1] * sign, ends[-1] * sign

    # the summit between the nodes, by the parabola through the largest value and its neighbours
    k = jnp.clip(jnp.argmax(y, 0), 1, y.shape[0] - 2)
    before, here, after = (jnp.take_along_axis(y, (k + s)[None], 0)[0] for s in (-1, 0, 1))
    bend = 2.0 * here - before - after
    smooth = jnp.isfinite(bend) & (bend > 0.0)
    gain = jnp.where(smooth, (after - before) ** 2 / (8.0 * jnp.where(smooth, bend, 1.0)), 0.0)
    top = jnp.max(y, 0)
    most = jnp.where(here >= top, here + jnp.minimum(gain, 0.5 * jnp.where(smooth, bend, 0.0)), top)
    return jnp.maximum(most, at_best) * sign, ends_of_tau


# Optimum and profiles of a creep curve as compiled programs; a batch of curves (``fits/creep.py``) runs the same.
#
# Variable projection finds the optimum to the resolution of its grid of tau; Gauss-Newton steps with
# exact Jacobians in the logarithms of the compliances remove the remaining error.


STEPS = 3  # number of Gauss-Newton steps


class Scaled(NamedTuple):
    """A dimensionless problem with the units that undo its scaling: ``compliance`` [1/Pa] and ``time`` [s]."""

    tau_problem: TauProblem
    compliance: float
    time: float

    def space(self, structure: Structure) -> Parameters:
        """Return the coordinates (j0, j2, f, j2/tau) with units and bounds; a material has two of them or all."""
        low, high = (np.asarray(side) for side in self.tau_problem.limits)
        rate = self.compliance / self.time
        return Parameters.of(
            structure, np.stack([low, high], -1), unit=np.array([self.compliance, self.compliance, rate, rate]),
            material=np.isin(np.arange(4), PLACES[structure.size]), open=np.stack([low == 0.0, np.isinf(high)], -1),
        )  # fmt: skip


def scale(data: CreepData, weight: np.ndarray, structure: Structure, table: dict) -> Scaled:
    """Return the dimensionless problem of a curve with weights (n,) [1/unit of the response], padded; table: {parameter:
    (low, high)}."""
    y, size = data.response, float(np.max(np.abs(data.response)))
    span, (history, stress) = float(data.t[-1]), stress_history(data)
    unit = size / stress
    box = structure.box(table) / structure.units(unit, span)[:, None]
    y, weight = nonlinear.repeated(y / size), nonlinear.without_weight(weight * size)
    return Scaled(tau_problem(y, weight, history, data.t / span, box), unit, span)


def stress_history(data: CreepData) -> tuple[Step | History, float]:
    """Return the padded stress, scaled by its largest value and the duration, and that value [Pa]; a unit step for J
    data."""
    span = float(data.t[-1])
    t = nonlinear.repeated(data.t / span)
    if data.J is not None:
        return Step(t), 1.0
    knots, values = data.stress
    stress = float(np.max(np.abs(values)))
    return merge(t, nonlinear.repeated(knots / span), nonlinear.repeated(values / stress)), stress


class Optimum(NamedTuple):
    """An optimum: parts (4,) = (j0, j2, f, j2/tau), tau, weighted residual (n,), cost over the grid of tau."""

    parts: Array
    tau: Array
    residual: Array
    cost: Array


# as cell steps: 1 ms more without optimisation, 0.9 s to compile
@functools.partial(Program, work=lambda problem: 5e3)
def minimise(problem: TauProblem) -> Optimum:
    """Return the least-squares solution: variable projection, then Gauss-Newton in log parameters.

    Variable projection leaves an error of 1e-4 in tau, which converges quadratically in ``STEPS`` steps. Their number
    is fixed, so that a batch of curves does not wait for the slowest.
    """
    _, x, tau, cost = solve(problem)
    start = jnp.append(x, x[1] / tau)
    lower, upper = problem.limits
    active = strictly_inside(start, lower, upper)  # the other parts are held

    def residual(u: Array) -> Array:
        return _residual(problem, jnp.where(active, jnp.exp(u), start), tau)

    def step(_: int, u: Array) -> Array:
        r, J = residual(u), jax.jacfwd(residual)(u)
        size = jnp.where(active, jnp.sqrt(jnp.maximum(jnp.sum(J * J, 0), 1e-300)), 1.0)
        J = J / size
        A = J.T @ J + jnp.diag(jnp.where(active, 1e-13, 1.0))
        trial = u - jnp.clip(jnp.linalg.solve(A, J.T @ r) / size, -1.0, 1.0)
        after = residual(trial)
        return jnp.where(after @ after < r @ r, trial, u)

    u = jax.lax.fori_loop(0, STEPS, step, jnp.log(jnp.where(active, start, 1.0)))
    parts = jnp.clip(jnp.where(active, jnp.exp(u), start), lower, upper)
    found = _residual(problem, parts, tau)
    better = found @ found <= jnp.sum(_residual(problem, start, tau) ** 2)
    parts = jnp.where(better, parts, start)
    tau = _tau(parts, tau)
    return Optimum(parts, tau, _residual(problem, parts, tau), cost)


def strictly_inside(parts: Array, lower: Array, upper: Array) -> Array:
    """Return which compliances are off their bounds and nonzero, (4,) bool."""
    return (parts > lower * (1 + 1e-9)) & (parts < upper * (1 - 1e-9)) & (parts > 0)


def _tau(parts: Array, tau: Array) -> Array:
    """Return tau = j2/(j2/tau), or the given one where there is no retarded part."""
    some = (parts[1] > 0) & (parts[3] > 0)
    return jnp.where(some, parts[1] / jnp.where(some, parts[3], 1.0), tau)


def _residual(problem: TauProblem, parts: Array, tau: Array) -> Array:
    """Return the weighted residuals (n,) at (j0, j2, f, j2/tau), with the given tau where there is no retarded part."""
    C = (
        columns(problem.history, jnp.reshape(1.0 / _tau(parts, tau), 1))
        * jnp.asarray(problem.weights)[:, None]
    )
    return C @ parts[:3] - problem.weights * problem.data


@Program
def jacobian(problem: TauProblem, optimum: Optimum) -> Array:
    """Return the exact derivative of the weighted model with respect to parts, (n, 4); at j2 = 0 tau is held."""
    return jax.jacfwd(lambda parts: _residual(problem, parts, optimum.tau))(optimum.parts)


@Program
def residuals(problem: TauProblem, optimum: Optimum) -> Array:
    """Return the weighted residuals (n,) of a problem at the optimum of another."""
    return _residual(problem, optimum.parts, optimum.tau)


def residuals_at(problem: TauProblem, values: Array) -> Array:
    """Return the weighted residuals (n,) at the compliances of a material, (2,) or (4,), all > 0."""
    parts = jnp.zeros(4).at[np.asarray(PLACES[values.size])].set(values)
    return _residual(problem, parts, jnp.ones(()))


def inside_jacobian(problem: TauProblem, optimum: Optimum) -> np.ndarray:
    """Return the columns (n, k) of ``jacobian`` for the compliances off their bounds."""
    inside = strictly_inside(optimum.parts, *problem.limits)
    return np.asarray(jacobian(problem, optimum))[:, np.asarray(inside)]


@functools.partial(Program, work=lambda *_: 5e3)
def profile(problem: TauProblem, optimum: Optimum, level: Array, times: Array) -> Array:
    """Return profile-likelihood extents (m, 2) of (j0, j2, f, j2/tau, slope0, J(times)...) over RSS <= level, () or
    (m,).

    slope0 is the initial slope of J; the upper end is infinite where open.
    """
    problem = problem._replace(origin=optimum.parts[:3])

    def rows(tau: Array) -> Array:
        base = jnp.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])
        slope = jnp.stack([jnp.array([0.0, 1 / tau, 0]), jnp.array([0.0, 1 / tau, 1.0])])
        return jnp.concatenate([base, slope, columns(Step(times), jnp.reshape(1.0 / tau, 1))])

    one = lambda most, d: extents(problem, optimum.tau, optimum.cost, most, d)
    if jnp.ndim(level) == 0:
        ends, reach = one(level, rows)
    else:
        single = lambda i: one(level[i], lambda tau: jax.lax.dynamic_slice_in_dim(rows(tau), i, 1))
        ends, reach = jax.lax.map(single, jnp.arange(level.size))
        ends, reach = ends[:, 0], reach.T

    # An end is infinite where it grows with tau without limit: if every tau up to the upper end of the search fits,
    # j2 has no upper limit; if every tau down to the lower end does, neither 1/eta2 = j2/tau nor the initial slope
    # has one.
    low, high = jnp.log(problem.tau)
    slow = (reach[1] >= high) & ~jnp.isfinite(problem.upper[1])
    fast = (reach[0] <= low) & ~jnp.isfinite(problem.ratio[1])
    place = jnp.arange(ends.shape[0])
    open_end = jnp.where(place == 1, slow, ((place == 3) | (place == 4)) & fast)
    return ends.at[:, 1].set(jnp.where(open_end, jnp.inf, ends[:, 1]))
