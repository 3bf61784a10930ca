"""Noise, intervals and residual tests of one fit as a function that jax compiles, for maps of thousands of fits.

The mathematics is that of ``noise.py`` and ``verdict.py``, whose docstrings have the equations and sources: error models
(a^2 + (b f)^2)^(1/2) on a grid of a/b, AR(1) correlation on a grid of rho, their restricted likelihood, the mixture of
Student's t distributions, changes of the noise along the curve, and the tests of the residuals. All arrays have the length N
of the padding; the n points of the curve come first. It differs in what costs much and changes little:

- The covariances of correlated noise are those of the mean error model over the posterior of a/b.
- The distribution of |t| is that of a transformed normal variable (D. L. Wallace, Ann. Math. Stat. 30 (1959) 1124), to 3e-4.
- The Durbin-Watson statistic is taken as normal with its exact mean and variance for every n.
- Simulations that calibrate the widths are not made here; ``fits/force_map.py`` makes them once for a map.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from fitting.inference import noise, verdict
from fitting.inference.noise import BEYOND_CHANCE, RHO
from fitting.inference.sample import ALIKE, BETTER, FAINT

SHAPES = 25  # error models
NEWTON = 12  # steps for a quantile of the mixture
SCORING = 20  # Fisher scoring steps for a change of the noise along the curve


@functools.lru_cache(maxsize=4096)
def quantiles(n: int, k: int, level: float, blocks: int = 1) -> dict[str, float]:
    """Return the level and the quantiles of t of a fit of k coordinates to n points: ``single`` of the intervals, those of
    the tests for a slip and for outliers. blocks: number of series of neighbours among the points."""
    jumps = max(n - blocks, 1)
    return {
        "level": level, "single": noise.two_sided(level, n - k),
        "slip": noise.two_sided(1.0 - verdict.CHANCE / jumps, max(jumps - k - 1, 1)),
        "outlier": noise.two_sided(1.0 - verdict.CHANCE / n, max(n - k - 1, 1)),
    }  # fmt: skip


class NoiseOfOne(NamedTuple):
    """The noise of one fit of k coordinates.

    half (k,): half widths of the intervals as square roots of the rise of RSS; ratio: a/b; sizes, spreads (N,): relative
    standard deviations along the curve, ``varied`` whether they change; lag1, lag1_of_innovations, edge: lag-1 correlation,
    that after AR(1) noise is subtracted, and whether the likeliest rho is the largest that is tried.
    """

    half: Array
    ratio: Array
    sizes: Array
    spreads: Array
    varied: Array
    lag1: Array
    lag1_of_innovations: Array
    edge: Array


def orthonormal(columns: Array) -> tuple[Array, Array]:
    """Return orthonormal rows Q (k, N) and R (k, k) with rows = R^T Q, of the rows (k, N); Gram and Schmidt, twice."""
    k = columns.shape[0]
    Q: list[Array] = []
    R = [[jnp.zeros(())] * k for _ in range(k)]
    for i in range(k):
        row = columns[i]
        for _ in range(2):
            for j in range(i):
                part = Q[j] @ row
                R[j][i] = R[j][i] + part
                row = row - part * Q[j]
        size = jnp.sqrt(row @ row)
        R[i][i] = size
        Q.append(row / jnp.maximum(size, 1e-300))
    return jnp.stack(Q), jnp.stack([jnp.stack(row) for row in R])


def lag_one(r: Array, n: Array) -> Array:
    """Return the correlation of neighbours of r (N,) about the mean of its first n values."""
    on = jnp.arange(r.size) < n
    r = jnp.where(on, r - jnp.sum(jnp.where(on, r, 0.0)) / n, 0.0)
    total = r @ r
    return jnp.where(total > 0.0, (r[1:] @ r[:-1]) / jnp.maximum(total, 1e-300), 0.0)


def excess(r: Array, on: Array) -> Array:
    """Return 1 + kappa/2 of the points ``on`` (N,) of r (N,), at least 1 (``noise.excess``)."""
    n = jnp.sum(on)
    square = jnp.where(on, r - jnp.sum(jnp.where(on, r, 0.0)) / n, 0.0) ** 2
    mean = jnp.sum(square) / n
    return jnp.maximum(0.5 * jnp.sum(square**2) / n / jnp.maximum(mean**2, 1e-300) - 0.5, 1.0)


def share_within(v: Array, dof: Array) -> tuple[Array, Array]:
    """Return the probability that |t| stays below v >= 0, and its derivative."""
    factor = (8.0 * dof + 1.0) / (8.0 * dof + 3.0)
    root = jnp.sqrt(dof * jnp.log1p(v**2 / dof))
    slope = jnp.where(v > 1e-8, v / jnp.maximum(root, 1e-300) / (1.0 + v**2 / dof), 1.0)
    z = factor * root
    return jax.scipy.special.erf(z * 2.0**-0.5), factor * slope * jnp.exp(-0.5 * z * z) * (
        2.0 / jnp.pi
    ) ** 0.5


def half_widths(share: Array, variance: Array, level: Array, single: Array, dof: Array) -> Array:
    """Return the half widths (k,) of a mixture with shares (m,) and variances (m, k); single: the quantile of t alone."""
    root = jnp.sqrt(jnp.maximum(variance, 1e-300))
    found = single * jnp.sqrt(share @ variance)
    low = single * jnp.min(jnp.where(share[:, None] > 0.0, root, jnp.inf), 0)

    def step(_: int, found: Array) -> Array:
        below, slope = share_within(found / root, dof)
        change = (share @ below - level) / jnp.maximum(share @ (slope / root), 1e-300)
        return jnp.maximum(found - change, low)

    return lax.fori_loop(0, NEWTON, step, found)


def posterior(
    r: Array,
    slopes: Array,
    shapes: Array,
    ratios: Array,
    n: Array,
    level: Array,
    single: Array,
    real: Array,
    alone: Array,
) -> tuple[Array, Array, Array]:
    """Return half (k,), ratio and likeliest rho (``noise.noise_model``).

    r (N,): weighted residuals; slopes (k, N): weighted Jacobian; shapes (S, N): standard deviations that are tried, all
    equal where the model is ``alone``.
    """
    k, N = slopes.shape
    S, on = shapes.shape[0], jnp.arange(N) < n
    Q, R = orthonormal(slopes)
    rss = r @ r
    inverse = jnp.where(on, 1.0 / shapes, 0.0)
    columns = jnp.concatenate([Q, (r / jnp.sqrt(jnp.maximum(rss / n, 1e-300)))[None]])
    # [Q, r]^T V^-1 [Q, r] for every error model and rho; V^-1 is tridiagonal
    pairs = [(i, j) for i in range(k + 1) for j in range(i + 1)]
    same = jnp.stack([columns[i] * columns[j] for i, j in pairs], -1)
    beside = jnp.stack(
        [columns[i, 1:] * columns[j, :-1] + columns[j, 1:] * columns[i, :-1] for i, j in pairs], -1
    )
    squares, near = inverse**2, inverse[:, 1:] * inverse[:, :-1]
    whole, close = squares @ same, near @ beside
    ends = squares[:, :1] * same[0] + squares[:, n - 1][:, None] * same[n - 1]
    rho = jnp.asarray(RHO)[None, :]
    terms = (1.0 + rho**2) / (1.0 - rho**2), rho / (1.0 - rho**2), rho**2 / (1.0 - rho**2)
    form = lambda a: terms[0] * whole[:, a, None] - terms[1] * close[:, a, None] - terms[2] * ends[:, a, None]
    # Cholesky factors of these (k + 1, k + 1) matrices, all (S, R) at once
    L: dict[tuple[int, int], Array] = {}
    for a, (i, j) in enumerate(pairs):
        rest = form(a) - sum((L[i, m] * L[j, m] for m in range(j)), jnp.zeros(()))
        L[i, j] = jnp.sqrt(jnp.maximum(rest + 1e-14, 1e-30)) if i == j else rest / L[j, j]
    logdet = (n - 1.0) * jnp.log1p(-(rho**2))
    logdet = logdet + 2.0 * jnp.sum(jnp.where(on, jnp.log(shapes), 0.0), 1)[:, None]
    logdet = logdet + 2.0 * sum(jnp.log(L[i, i]) for i in range(k))
    likelihood = -0.5 * (logdet + (n - k) * 2.0 * jnp.log(L[k, k]))
    likelihood = jnp.where(real, likelihood, jnp.where(rho > 0.0, -jnp.inf, 0.0))
    best = jnp.max(likelihood, 1, keepdims=True)
    likelihood = likelihood - best + best / jnp.where(alone, 1.0, excess(r, on))
    # prior, posterior, and whether the noise is more likely white than not
    prior = jnp.sqrt(1.0 - rho[0] ** 2)
    prior = prior * (1.0 - noise.WHITE) / jnp.sum(prior)
    prior = prior.at[0].add(noise.WHITE)
    share = jnp.exp(likelihood - jnp.max(likelihood)) * prior
    likeliest = jnp.argmax(jnp.max(likelihood, 0))
    white = (jnp.sum(share[:, 0]) > noise.MORE_LIKELY_THAN_NOT * jnp.sum(share)) | (n - k < noise.SHORT)
    share = jnp.where(white & (rho > 0.0), 0.0, share)
    share = jnp.where(share > noise.NEGLIGIBLE * jnp.max(share), share, 0.0)
    share = share / jnp.sum(share)
    # unit directions in the space of Q whose errors are those of the coordinates: columns of R^-T
    directions = jnp.linalg.inv(R + 1e-300 * jnp.eye(k)).T
    directions = directions / jnp.sqrt(jnp.sum(directions**2, 0))
    u = directions.T @ Q  # (k, N)
    square = jnp.where(on, shapes, 0.0) ** 2
    total, traces = jnp.sum(square, 1), square @ jnp.sum(Q**2, 0)
    scale = rss / jnp.maximum(total - traces, 1e-300)  # (n - k)/(n - p) is 1 here
    of_shape = jnp.sum(share, 1)
    ratio = jnp.sqrt((of_shape * scale) @ ratios**2 / jnp.maximum(of_shape @ scale, 1e-300))
    count = max(S, RHO.size)

    def plain() -> tuple[Array, Array]:
        return (
            jnp.zeros(count).at[:S].set(of_shape),
            jnp.ones((count, k)).at[:S].set(scale[:, None] * (square @ (u**2).T)),
        )

    def correlated() -> tuple[Array, Array]:
        mean = jnp.sqrt((of_shape * scale) @ square / jnp.maximum(of_shape @ scale, 1e-300))
        series = jnp.concatenate([u, Q]) * mean  # (2 k, N)

        def step(carry: tuple[Array, Array], x: Array) -> tuple[tuple[Array, Array], None]:
            past, summed = carry
            past = x + jnp.asarray(RHO)[:, None] * past  # x_i + rho x_(i-1) + ...
            return (past, summed + x * past), None

        zero = jnp.zeros((RHO.size, 2 * k))
        (_, half), _ = lax.scan(step, (zero, zero), series.T)
        spread = 2.0 * half - jnp.sum(series**2, 1)
        variance = (
            rss * spread[:, :k] / jnp.maximum(jnp.sum(mean**2) - jnp.sum(spread[:, k:], 1), 1e-300)[:, None]
        )
        of_rho = jnp.zeros(count).at[: RHO.size].set(jnp.sum(share, 0))
        return of_rho, jnp.ones((count, k)).at[: RHO.size].set(variance)

    parts, variance = lax.cond(white, plain, correlated)
    half = half_widths(parts, variance, level, single, n - float(k))
    return half, ratio, likeliest


def variation(r: Array, Q: Array, on: Array, k: int) -> tuple[Array, Array]:
    """Return whether the size of the noise changes along the curve, and its relative sizes (N,) (``noise.variation``); on
    (N,): the points that count."""
    n = jnp.sum(on)
    leverage = jnp.maximum(1.0 - jnp.sum(Q * Q, 0), 1e-3)
    square = jnp.where(on, r**2 / leverage, 0.0)
    square = square / jnp.maximum(jnp.sum(square) / n, noise.TINY)
    rank = jnp.cumsum(on) - 1.0
    x = 2.0 * rank / (n - 1.0) - 1.0
    columns = jnp.where(on, jnp.stack([jnp.ones_like(x), x, 0.5 * (3.0 * x**2 - 1.0)]), 0.0)
    normal = jnp.linalg.inv(columns @ columns.T)

    def scoring(_: int, found: Array) -> Array:
        pull = square * jnp.exp(-jnp.clip(found @ columns, -60.0, 60.0)) - 1.0
        return found + jnp.clip(normal @ (columns @ jnp.where(on, pull, 0.0)), -noise.REACH, noise.REACH)

    smooth = lax.fori_loop(0, SCORING, scoring, jnp.zeros(3)) @ columns
    loss = lambda log: jnp.sum(jnp.where(on, log + square * jnp.exp(-jnp.clip(log, -60.0, 60.0)), 0.0))
    # the mean square before and after each place at which the variance may have a step
    sums, before = jnp.cumsum(square), jnp.cumsum(on).astype(float)
    first, last = sums / jnp.maximum(before, 1.0), (sums[-1] - sums) / jnp.maximum(n - before, 1.0)
    allowed = on & (before >= noise.SIDE * n) & (before <= (1.0 - noise.SIDE) * n)
    costs = (
        before * jnp.log(jnp.maximum(first, noise.TINY))
        + (n - before) * jnp.log(jnp.maximum(last, noise.TINY))
        + n
    )
    at = jnp.argmin(jnp.where(allowed, costs, jnp.inf))
    stepped = jnp.where(
        jnp.arange(r.size) <= at, jnp.log(first[at] + noise.TINY), jnp.log(last[at] + noise.TINY)
    )

    def chance(log: Array, dof: int) -> Array:
        tails = excess(r / jnp.sqrt(leverage) * jnp.exp(-0.5 * log), on)
        ratio = jnp.maximum(n - loss(log), 0.0) / tails
        even = jnp.exp(-0.5 * ratio)  # of chi-square with two degrees of freedom, and with three
        return (
            even
            if dof == 2
            else jax.scipy.special.erfc(jnp.sqrt(0.5 * ratio)) + jnp.sqrt(2.0 * ratio / jnp.pi) * even
        )

    one, other = chance(smooth, 2) <= noise.CHANGES, chance(stepped, 3) <= noise.CHANGES
    log = jnp.where(other & (~one | (loss(stepped) + 2.0 < loss(smooth))), stepped, smooth)
    sizes = jnp.exp(0.5 * log)
    sizes = sizes / jnp.sqrt(jnp.sum(jnp.where(on, sizes**2, 0.0)) / n)
    return (one | other) & (n - k >= noise.ENOUGH), sizes


def noise_of_one(
    r: Array, slopes: Array, fitted: Array, weights: Array, n: Array, level: Array, single: Array, real: Array
) -> NoiseOfOne:
    """Return the noise of weighted residuals r (N,) with estimated weights (``sample.Sample.noise``).

    slopes (k, N): weighted Jacobian of the coordinates; fitted (N,), weights (N,) [their reciprocals]; level: of the
    intervals, and single: its quantile of t; real: whether the residuals exceed rounding.
    """
    k, N = slopes.shape
    on = jnp.arange(N) < n
    size = jnp.abs(fitted)
    largest, smallest = jnp.max(jnp.where(on, size, 0.0)), jnp.min(jnp.where(on, size, jnp.inf))
    high = noise.BEYOND * largest
    low = jnp.maximum(smallest / noise.BEYOND, noise.LEAST * high)
    ratios = low * (high / low) ** jnp.linspace(0.0, 1.0, SHAPES)
    log_variance = lambda spreads: (
        2.0 * jnp.sum(jnp.where(on, jnp.log(spreads), 0.0))
        + n * jnp.log(jnp.maximum(jnp.sum(jnp.where(on, r / spreads, 0.0) ** 2), 1e-300))
    )

    def of_base(a: Array) -> tuple[Array, ...]:
        """Return whether the noise changes along the curve about an error model, its cost, sizes, spreads and the cost of
        the model without a change."""
        shape = jnp.where(on, jnp.hypot(a, fitted) * weights, 1.0)
        shape = jnp.where(on, shape / jnp.sqrt(jnp.sum(jnp.where(on, shape**2, 0.0)) / n), 1.0)
        Q, _ = orthonormal(slopes / shape)
        even = jnp.where(on, r / shape, 0.0)
        # a single large residual is an outlier and no change: what is found must be there without it
        others = on & (jnp.arange(N) != jnp.argmax(jnp.abs(even)))
        found, sizes = lax.map(lambda some: variation(even, Q, some, k), jnp.stack([on, others]))
        found, sizes = jnp.all(found), sizes[0]
        spreads = jnp.where(found, shape * sizes, shape)
        # where neighbours are alike, it is the model that changes along the curve, not the noise
        alike = lag_one(even, n) > 2.0 * ALIKE / jnp.sqrt(n)
        alike = alike | (lag_one(jnp.where(on, r / spreads, 0.0), n) > ALIKE / jnp.sqrt(n))
        return found & ~alike, log_variance(spreads), sizes, spreads, log_variance(shape)

    def changes(ratio: Array) -> tuple[Array, ...]:
        """Return whether the noise changes along the curve, a/b, sizes and spreads of the likeliest such model."""
        bases = jnp.stack([ratio, FAINT * largest, largest / FAINT])
        able, costs, sizes, spreads, plain = lax.map(of_base, bases)
        least = plain[0] - BETTER * excess(jnp.where(on, r / spreads[0], 0.0), on)
        able = able & (costs <= least) & real
        chosen = jnp.argmin(jnp.where(able, costs, jnp.inf))
        return jnp.any(able), bases[chosen], sizes[chosen], spreads[chosen]

    def turn(state: tuple) -> tuple:
        """Take the posterior over all error models; where the noise changes along the curve, again with that model alone."""
        count, (varied, base, sizes, spreads), *_ = state
        shapes = jnp.where(varied, base, ratios)[:, None]
        shapes = jnp.where(on, jnp.hypot(shapes, fitted) * weights * jnp.where(varied, sizes, 1.0), 1.0)
        half, ratio, likeliest = posterior(
            r, slopes, shapes, jnp.where(varied, base, ratios), n, level, single, real, varied
        )
        half = half / jnp.where(
            varied, jnp.sqrt(jnp.maximum(1.0 - 2.0 * (noise.DEGREE + 1) / (n - k), 0.5)), 1.0
        )
        even = jnp.where(varied, jnp.where(on, r / shapes[0], 0.0), r)
        change = lax.cond(count == 0, lambda: changes(ratio), lambda: (varied, base, sizes, spreads))
        return count + 1, change, half, ratio, likeliest, even

    first = jnp.asarray(False), jnp.zeros(()), jnp.ones(N), jnp.ones(N)
    state = (jnp.asarray(0), first, jnp.zeros(k), jnp.zeros(()), jnp.asarray(0), jnp.zeros(N))
    more = lambda state: (state[0] == 0) | ((state[0] == 1) & state[1][0])
    _, (varied, _, sizes, spreads), half, ratio, likeliest, even = lax.while_loop(more, turn, state)
    rho = jnp.asarray(RHO)[likeliest]
    after = jnp.where(jnp.arange(N - 1) < n - 1, even[1:] - rho * even[:-1], 0.0)
    return NoiseOfOne(
        half, ratio, jnp.where(varied, sizes, 1.0), jnp.where(varied, spreads, 1.0), varied, lag_one(even, n),
        lag_one(after, n - 1), likeliest == RHO.size - 1,
    )  # fmt: skip


def is_doubted(r: Array, slopes: Array, found: NoiseOfOne, n: Array, far: tuple[Array, Array]) -> Array:
    """Return whether the tests of ``verdict.reasons`` find a trend, systematic residuals, a slip or outliers.

    far: quantiles of t of the tests for a slip and for outliers, at the level of the number of points.
    """
    k, N = slopes.shape
    on = jnp.arange(N) < n
    raw, (Q_raw, _) = r, orthonormal(slopes)
    spreads = jnp.where(on, found.spreads, 1.0)
    r = r / spreads
    Q, _ = orthonormal(slopes / spreads)
    total = jnp.maximum(r @ r, 1e-300)

    # Durbin and Watson's statistic with its mean and variance for r of covariance 1 - Q^T Q
    inner = (jnp.arange(N - 1) < n - 1).astype(float)
    steps = inner * jnp.diff(r)
    d = steps @ steps / total
    across = inner * jnp.diff(Q, axis=1)
    AQ = jnp.diff(across, axis=1, prepend=0.0, append=0.0) * -1.0
    QAQ = Q @ AQ.T
    trace, square = 2.0 * (n - 1.0), 4.0 * (n - 2.0) + 2.0 + 2.0 * (n - 1.0)
    mean, dof = trace - jnp.trace(QAQ), n - float(k)
    spread = square - 2.0 * jnp.sum(AQ**2) + jnp.sum(QAQ * QAQ.T)
    variance = 2.0 * (spread - mean**2 / dof) / (dof * (dof + 2.0))
    chance = jax.scipy.special.ndtr((d - mean / dof) / jnp.sqrt(jnp.maximum(variance, 1e-300)))
    systematic = jnp.abs(found.lag1_of_innovations) > BEYOND_CHANCE / jnp.sqrt(n)
    trend = found.edge & (chance <= verdict.TREND)
    trend = trend | (systematic & (jnp.minimum(chance, 1.0 - chance) <= verdict.TREND))

    def slip(r: Array) -> tuple[Array, Array]:
        """Return whether one jump stands alone, and its place (``verdict.slipped``)."""
        jumps = jnp.abs(jnp.where(jnp.arange(N - 1) < n - 1, jnp.diff(r), 0.0))
        i = jnp.argmax(jumps)
        rest = jumps.at[i].set(0.0)
        limit = far[0] * jnp.sqrt(rest @ rest / (n - 1.0 - k - 1.0))
        single = jnp.max(rest) <= verdict.ISOLATED * jumps[i]
        return (i > 0) & (i < n - 2) & single & (jumps[i] > limit), i

    (slips, at), (before, there) = slip(r), slip(raw)
    slips = slips & (~found.varied | (before & (at == there)))

    def outliers(r: Array, Q: Array) -> Array:
        """Return the isolated points that deviate beyond chance (``verdict.outlying``), (N,) bool."""
        one_minus_leverage = jnp.maximum(1.0 - jnp.sum(Q * Q, 0), verdict.CURVED)
        own, freedom = r**2 / one_minus_leverage, n - k - 1.0
        others = jnp.maximum(jnp.maximum(r @ r - own, verdict.CURVED * own), 1e-300) / freedom
        score = jnp.abs(r) / jnp.sqrt(others * one_minus_leverage)
        side = jnp.sign(r)
        before, after = jnp.pad(r[:-1], (1, 0)) * side, jnp.pad(r[1:], (0, 1)) * side
        near = (before > verdict.ISOLATED * jnp.abs(r)).astype(int) + (after > verdict.ISOLATED * jnp.abs(r))
        ends = (jnp.arange(N) == 0) | (jnp.arange(N) == n - 1)
        return on & (score > far[1]) & (near <= jnp.where(ends, 0, 1))

    own = jnp.minimum(jnp.sum(Q * Q, 0), 1.0 - verdict.CURVED)
    others = (r @ r - r**2 / (1.0 - own)) / jnp.maximum(n - k - 1.0, 1.0)
    moves = jnp.abs(r) * jnp.sqrt(own) > verdict.MATTERS * (1.0 - own) * jnp.sqrt(jnp.maximum(others, 1e-300))
    points = outliers(r, Q) & moves
    points = points & (~found.varied | outliers(raw, Q_raw))
    return trend | slips | jnp.any(points)
