"""Tests of the goodness of fit: a fit is rejected where its residuals show that the model does not describe the data.

Each test has a level that holds for every number of points: the probability of rejecting the right model by it, with
independent normal errors, is at most ``TREND`` for a trend and for systematic residuals, and ``CHANCE`` for a slip and for
outliers (``reasons``). Together they reject less than 1.5 % of right fits.
"""

import math
from typing import Any

import numpy as np
from scipy import special

from fitting.inference.noise import BEYOND_CHANCE, RHO, Noise, basis, two_sided, within
from fitting.models.structure import Structure

TREND = 5e-3  # probability of a trend, or of systematic residuals, in a series of white noise
LARGE = 200  # points above which the distribution of the Durbin-Watson statistic is normal
CHANCE = 1e-3  # probability of an outlier in a series of Gaussian noise
MATTERS = 1.0  # standard errors by which a relevant outlier moves the fit
ISOLATED = 0.5  # largest residual of a neighbour over that of an isolated outlier
NOT_DETERMINED = 0.5  # sd of a log parameter above which it is not identifiable
# probability, on each side, of an RSS with which a right standard deviation is found to be wrong
STATED = 0.005
# fraction of a variance that the curvature of a model may change, relative to its linearisation
CURVED = 0.02
# shear modulus [Pa] that no solid exceeds: that of diamond is 5.35e11 (C. A. Klein, G. F. Cardinale, Diam. Relat. Mater. 2
# (1993) 918: E = 1143 GPa, nu = 0.07)
STIFFEST = 6e11


TOO_FEW = "too few points in contact to judge the trend of the residuals"


def no_better(r2: float) -> str:
    """Return the reason against a fit that explains nothing."""
    return f"the model describes the data no better than a constant: R2 = {r2:.3g}"


def scattered(share: float) -> str:
    """Return the reason against a fit whose points scatter by more than the signal; share: of the one over the other."""
    percent = f"{100 * share:.3g} %"
    return f"the scatter of the points exceeds the signal: its standard deviation is {percent} of the fitted values"


def too_stiff(structure: Structure, intervals: dict[str, tuple[float, float]]) -> tuple[str, ...]:
    """Return the reason against a material whose shear modulus, of a creep law the instantaneous one, is above that of every
    solid with its whole interval, () for any other."""
    # a creep law is a list of compliances, of which the first is the instantaneous one; of other laws every modulus counts
    moduli = list(structure.where)
    if type(structure) is Structure:
        moduli = [name for name, place in structure.where.items() if place == 0] or moduli
    least = 0.0
    for name in moduli:
        low, high = intervals[name]
        unit = structure.unit(name)
        if unit == "Pa" or (unit == "1/Pa" and high > 0.0):
            least = max(least, low if unit == "Pa" else 1.0 / high)
    return beyond_solids(least)


def beyond_solids(modulus: float) -> tuple[str, ...]:
    """Return the reason against a fit whose shear modulus is at least ``modulus`` [Pa], () for one that a solid may have."""
    if not STIFFEST < modulus < math.inf:
        return ()
    return (
        f"the shear modulus is at least {modulus:.3g} Pa, more than that of diamond, 5.35e+11 Pa: expected data in SI units,"
        " as loads in N, lengths in m and stresses in Pa",
    )


def reasons(
    residuals: np.ndarray,
    Q: np.ndarray,
    noise: Noise,
    t: np.ndarray,
    blocks: np.ndarray,
    abscissa: tuple[str, str],
    sizes: np.ndarray | None = None,
    of_all: np.ndarray | None = None,
) -> tuple[str, ...]:
    """Return the reasons for rejecting a fit by its residuals, () if there are none.

    - A trend: the likeliest AR(1) noise has the largest correlation that is tried, and the Durbin-Watson statistic is as
      low by chance in white noise with probability ``TREND`` at most (``by_chance``).
    - Systematic residuals: their lag-1 correlation after AR(1) noise is subtracted exceeds 3.3 standard errors, and the
      Durbin-Watson statistic is as far on its side by chance with probability ``TREND`` at most.
    - A slip (``slipped``) and outliers that move the fit (``outlying``), at the level ``CHANCE``.

    residuals (weighted) (n,); t (n,), blocks (n,): their abscissae, of the symbol and unit in ``abscissa``, and blocks of
    neighbours; Q (n, k): orthonormal columns that span the Jacobian, or their rows for these points where
    they are part of the data; sizes (n,): their standard deviations up to a factor, where they change along the curve.
    A slip or an outlier is then one both with and without them. of_all (n, q): as Q, with the coordinates at a bound,
    if there are some; the truth may have them off the bound, so that the less certain of both tests for a trend counts.
    """
    symbol, unit = abscissa
    found, before, rows, spanned = [], residuals, Q, [Q if of_all is None else of_all, Q]
    if sizes is not None:
        spanned = [basis(one / sizes[:, None]) for one in spanned]
        residuals, Q = residuals / sizes, spanned[1]
    spanned = spanned[: 1 if of_all is None else 2]
    trend = noise.likeliest == RHO[-1]
    systematic = abs(noise.lag1_of_innovations) > BEYOND_CHANCE / math.sqrt(residuals.size)
    chances = [by_chance(residuals, one, blocks) for one in spanned] if trend or systematic else [1.0]
    chance = max(chances)
    if trend and chance <= TREND:
        found.append(
            f"the residuals follow a trend over many points: independent errors are as smooth with a probability of"
            f" {max(chance, 1e-12):.1g} (Durbin-Watson test)"
        )
    elif systematic and min(chance, 1.0 - min(chances)) <= TREND:
        found.append(
            f"the residuals are systematic: lag-1 correlation {noise.lag1:.2f}, and {noise.lag1_of_innovations:.2f} after an"
            " AR(1) noise is subtracted"
        )
    slip = slipped(residuals, Q.shape[1], blocks)
    if slip is not None and (sizes is None or slipped(before, rows.shape[1], blocks) == slip):
        found.append(
            f"the curve slips between {symbol} = {t[slip]:.4g} and {t[slip + 1]:.4g} {unit}: one jump of the residuals"
        )
    points, dof = [], max(residuals.size - Q.shape[1] - 1, 1)
    for i in outlying(residuals, Q, blocks):
        # the number of standard errors by which the fitted value changes when the point is left out
        own = min(float(Q[i] @ Q[i]), 1.0 - CURVED)
        others = (residuals @ residuals - residuals[i] ** 2 / (1.0 - own)) / dof
        if abs(residuals[i]) * math.sqrt(own) > MATTERS * (1.0 - own) * math.sqrt(max(others, 1e-300)):
            points.append(i)
    if sizes is not None and points:
        points = sorted(set(points) & set(outlying(before, rows, blocks)))
    if points:
        times = ", ".join(f"{t[i]:.4g}" for i in points[:3])
        found.append(
            f"outliers affect the fit: {len(points)} of {t.size} points, at {symbol} = {times} {unit}: leave them out, or"
            " give their uncertainty by sigma"
        )
    return tuple(found)


def by_chance(residuals: np.ndarray, Q: np.ndarray, blocks: np.ndarray) -> float:
    """Return the probability that independent normal errors have neighbours as similar as residuals (n,), or more so.

    The Durbin-Watson statistic d = sum (r_(i+1) - r_i)^2/sum r_i^2, with neighbours of one block, is a ratio of quadratic
    forms of the errors, whose covariance is 1 - Q Q^T. So the probability of a lower d is that of sum c_j z_j^2 <= 0 with
    the eigenvalues c_j of the difference of the forms, and independent standard normal z_j; it is found by numerical
    inversion of the characteristic function (J. Durbin, G. S. Watson, Biometrika 58 (1971) 1; J. P. Imhof, Biometrika 48
    (1961) 419). It is exact for a model that is linear over the intervals of its parameters, whatever the number of
    points. Above ``LARGE`` points d is taken as normal with its exact mean and variance. Q (n, k): as of ``reasons``.
    """
    n, same = residuals.size, within(blocks)
    total = float(residuals @ residuals)
    steps = np.diff(residuals)[same]
    if total <= 0.0 or not steps.size:
        return 1.0
    d = float(steps @ steps) / total
    across = lambda M: np.where(same[:, None], np.diff(M, axis=0), 0.0)
    if n > LARGE:
        # moments of r^T A r for A = D^T D and r of covariance M = 1 - Q Q^T, d over the mean of r^T r
        turned = lambda M: np.diff(across(M), axis=0, prepend=0.0, append=0.0) * -1.0
        AQ = turned(Q)
        inner = Q.T @ AQ
        ends = np.append(same, False).astype(float) + np.append(False, same)
        trace, square = float(ends.sum()), float(ends @ ends) + 2.0 * float(same.sum())
        gram = Q.T @ Q
        mean = trace - float(np.trace(inner))
        spread = square - 2.0 * float(np.sum(AQ**2)) + float(np.sum(inner * inner.T))
        dof = n - float(np.trace(gram))
        centre = mean / dof
        variance = 2.0 * (spread - mean**2 / dof) / (dof * (dof + 2.0))
        return float(special.ndtr((d - centre) / math.sqrt(max(variance, 1e-300))))
    D = across(np.eye(n))
    # the root of the covariance of the residuals, from the singular vectors of Q
    U, size, _ = np.linalg.svd(Q, full_matrices=False)
    root = np.eye(n) - (U * (1.0 - np.sqrt(np.maximum(1.0 - size**2, 0.0)))) @ U.T
    c = np.linalg.eigvalsh(root @ (D.T @ D - d * np.eye(n)) @ root)
    c = c[np.abs(c) > 1e-10 * np.max(np.abs(c))] / np.max(np.abs(c))
    if not c.size or np.all(c > 0.0):
        return 0.0 if c.size else 1.0
    u = np.exp(np.linspace(-40.0, 40.0, 4001))  # the integrand is smooth in log u, so that sums converge fast
    angle = 0.5 * np.sum(np.arctan(np.outer(c, u)), 0)
    size = np.exp(-0.25 * np.sum(np.log1p(np.outer(c, u) ** 2), 0))
    above = 0.5 + float(np.sum(np.sin(angle) * size)) * math.log(u[1] / u[0]) / math.pi
    return min(max(1.0 - above, 0.0), 1.0)


def outlying(residuals: np.ndarray, Q: np.ndarray, blocks: np.ndarray | None = None) -> list[int]:
    """Return the isolated points whose externally studentised residual is significant after Bonferroni correction.

    The score of a point has Student's t distribution with n - k - 1 degrees of freedom in a linear model, and some point
    of a series of normal noise is found with probability ``CHANCE`` at most. Where leverage leaves a residual less than
    ``CURVED`` of the variance of its error, or where the other points deviate by less than this fraction of what the point
    does, the curvature of the model makes up what is left; both are limited from below. So no point is found with fewer
    than four degrees of freedom. Q (n, k): as of ``reasons``; blocks (n,) of neighbours, None for a single block.
    """
    n = residuals.size
    one_minus_leverage = np.maximum(1.0 - np.sum(Q * Q, 1), CURVED)
    dof = n - Q.shape[1] - 1
    if dof < 1:
        return []
    own = residuals**2 / one_minus_leverage
    others = np.maximum(np.maximum(residuals @ residuals - own, CURVED * own), 1e-300) / dof
    score = np.abs(residuals) / np.sqrt(others * one_minus_leverage)
    far = np.flatnonzero(score > two_sided(1.0 - CHANCE / n, dof))
    return [int(i) for i in far if isolated(residuals, i, blocks)]


def slipped(residuals: np.ndarray, k: int, blocks: np.ndarray | None = None) -> int | None:
    """Return the point before a single significant jump of the residuals of k parameters; None if there is none.

    Differences of neighbours are small where a model is only slightly wrong, or the noise correlated; a slip of the
    instrument makes a single large one (a spike makes two, the steps of a digital display many). The jump is
    studentised by the other differences, with Bonferroni correction. blocks (n,): only points of one block are
    neighbours; None for a single block.
    """
    same = within(np.zeros(residuals.size) if blocks is None else blocks)
    jumps = np.where(same, np.diff(residuals), 0.0)
    count = int(same.sum())
    dof = count - k - 1
    if dof < 1:
        return None
    i = int(np.argmax(np.abs(jumps)))
    rest = np.delete(jumps, i)
    far = two_sided(1.0 - CHANCE / count, dof) * math.sqrt(rest @ rest / dof)
    single = np.max(np.abs(rest)) <= ISOLATED * abs(jumps[i])
    between = 0 < i < jumps.size - 1 and same[i - 1] and same[i + 1]
    return i if between and single and abs(jumps[i]) > far else None


def isolated(residuals: np.ndarray, i: int, blocks: np.ndarray | None = None) -> bool:
    """Return whether at most one neighbour of the same block deviates to the same side by half as much."""
    blocks = np.zeros(residuals.size) if blocks is None else blocks
    neighbours = [j for j in (i - 1, i + 1) if 0 <= j < residuals.size and blocks[j] == blocks[i]]
    near = residuals[neighbours] * np.sign(residuals[i])
    return bool(np.sum(near > ISOLATED * abs(residuals[i])) <= (near.size > 1))


def contradicted(rss: float, dof: float) -> int:
    """Return 1 where stated standard deviations are too small for a RSS of weighted residuals with ``dof`` degrees of
    freedom, -1 where they are too large, 0 where they agree.

    Of right standard deviations of normal errors a share of ``STATED`` is found to be wrong on each side, for any number
    of points.
    """
    if special.chdtrc(dof, rss) < STATED:
        return 1
    return -1 if special.chdtr(dof, rss) < STATED else 0


def identified(intervals: dict, table: dict, level: float, refused: Any = ()) -> dict[str, bool]:
    """Return which parameters are fixed or identifiable.

    A parameter is identifiable if its interval is closed on both sides, off the bounds and no wider than for sd(log) =
    0.5, and the fit is not rejected.
    """
    z = two_sided(level)
    result = {}
    for name, (low, high) in intervals.items():
        closed = table[name][0] < low and high < table[name][1]
        narrow = closed and math.log(high / low) < 2 * z * NOT_DETERMINED
        result[name] = bool(table[name][0] == table[name][1] or (narrow and not refused))
    return result


# Test of the residuals of several curves for a shape that they have in common.
#
# A model that lacks an effect (an induction time, a drift, a wrong probe) leaves residuals of the same shape in every
# curve. Each curve alone may hide it in its noise, and the correlation of neighbouring residuals may be as small as
# chance leaves it; summed over the curves the shape remains, while the noise averages out.
#
# The shape is a polynomial in the abscissa with equal coefficients in all curves, in units of the weighted residuals.
# It is made orthogonal to the Jacobian of the fit, and its coefficients are compared with zero by an F test. Where
# the noise is white, the denominator is the variance of the residuals that remain. Where it is correlated, the
# denominator is the variance of the coefficients among the curves, which the correlation increases as it does that of
# their sum.


DEGREES = 5  # of the polynomial, beside the constant
FLAT_SHAPE = 1e-8  # part of a column outside the Jacobian below which it is rounding


def common_shape(
    residual: np.ndarray, jacobian: np.ndarray, curve: np.ndarray, x: np.ndarray, white: bool = True
) -> tuple[float, np.ndarray]:
    """Return the probability that noise alone has a common shape as large, and the shape (n,) in the residuals.

    The probability is 1 with a single curve, or where too few points are left to judge.

    Args:
        residual: (n,) weighted residuals of all curves.
        jacobian: (n, k) derivatives of the residuals with respect to the fitted coordinates.
        curve: (n,) integers, equal for points of one curve.
        x: (n,) abscissa, which is scaled to -1 .. 1 over all curves; a logarithm where the curves cover decades.
        white: whether the noise of neighbouring points is independent.
    """
    labels, place = np.unique(curve, return_inverse=True)
    nothing = 1.0, np.zeros(residual.size)
    span = float(np.ptp(x))
    if labels.size < 2 or span == 0.0:
        return nothing
    Q = np.linalg.qr(jacobian[:, np.any(jacobian != 0.0, axis=0)])[0]
    outside = lambda A: A - Q @ (Q.T @ A)
    shapes = np.polynomial.legendre.legvander(2.0 * (x - x.min()) / span - 1.0, DEGREES)
    U, s, _ = np.linalg.svd(outside(shapes), full_matrices=False)
    U = U[:, s > FLAT_SHAPE * max(float(s[0]), FLAT_SHAPE * float(np.linalg.norm(shapes)))]
    q = U.shape[1]
    shape = U @ (U.T @ residual)
    rise = float(shape @ shape)
    if white:
        dof = residual.size - Q.shape[1] - q
        rest = float(residual @ residual) - rise
    else:
        # each curve with coefficients of its own: what they explain beyond the common ones
        own = np.concatenate([shapes * (place == k)[:, None] for k in range(labels.size)], axis=1)
        V, s, _ = np.linalg.svd(outside(own), full_matrices=False)
        V = V[:, s > FLAT_SHAPE * max(float(s[0]), FLAT_SHAPE * float(np.linalg.norm(own)))]
        dof = V.shape[1] - q
        rest = float(np.sum((V.T @ residual) ** 2)) - rise
    if q == 0 or dof < 1:
        return nothing
    return float(special.fdtrc(q, dof, rise / q * dof / max(rest, 1e-300))), shape


def reason_of_common_shape(
    residual: np.ndarray, jacobian: np.ndarray, curve: np.ndarray, x: np.ndarray, white: bool = True
) -> tuple[str, ...]:
    """Return the reason for rejecting a fit whose curves have residuals of a common shape, () if they have none; arguments
    as of ``common_shape``."""
    chance, shape = common_shape(residual, jacobian, curve, x, white)
    if not chance < CHANCE:
        return ()
    share = float(np.sqrt(np.sum(shape**2) / np.sum(residual**2)))
    return (
        f"the residuals of the {np.unique(curve).size} curves have a common shape, {100 * share:.2g} % of them in size,"
        f" which noise has with a probability of {chance:.1g}: the model lacks an effect that all curves show",
    )


WINDOW = 0.05  # fraction of the points in a running mean of the residuals


def trend(deviations: Any, n: Any = None, xp: Any = np) -> Any:
    """Return the largest running mean of deviations (n,), in size; of a row that is padded beyond n points, traced by jax
    with ``xp=jnp``, the mean of the n."""
    size = deviations.size
    n = size if n is None else n
    width = xp.clip(xp.asarray(WINDOW * n).astype(int), 3, n)
    sums = xp.concatenate([xp.zeros(1), xp.cumsum(deviations)])
    first = xp.arange(size)
    means = (sums[xp.minimum(first + width, size)] - sums[first]) / width
    return xp.max(xp.where(first + width <= n, xp.abs(means), 0.0))


# Faults of a force curve, from which no modulus follows: no baseline, no indentation, spikes, a jump, a flat end.
#
# The functions take one curve, or, traced by jax, the row of a map that is padded beyond its n points (``xp=jnp``).


SEEN = 5.0  # least indentation force in standard deviations of the baseline
SHORT = 0.02  # least baseline, as a fraction of the points of the curve
FEW = 8  # fewest points in contact
SPIKE, SPIKE_SEEN = 0.1, 8.0  # least isolated spike, over the largest force and in robust standard deviations
JUMP_SEEN = 6.0  # least jump, in robust standard deviations of the steps: a single point does not make one
BESIDE = 3  # points on either side of a jump
LAST, LEAST_RISE = 0.2, 0.25  # the end of the indentation, and its least rise over that of the model
RISE_SEEN = 5.0  # standard errors by which it is below
PICO = 1e12


def spikes(deviations: Any, pushed: Any, n: Any, xp: Any = np) -> tuple[Any, Any]:
    """Return the number of isolated spikes, and the largest of them over the largest force ``pushed``, 0 without one.

    They deviate by more than a tenth of the largest force and eight robust standard deviations, both neighbours by less
    than half as much: faults of the instrument, which no noise of a sample makes.
    """
    size = xp.abs(deviations)
    sigma = xp.sort(xp.where(xp.arange(size.size) < n, size, xp.inf))[n // 2] / 0.6745
    neighbour = xp.maximum(xp.pad(size[:-1], (1, 0)), xp.pad(size[1:], (0, 1)))
    high = (size > SPIKE * pushed) & (size > SPIKE_SEEN * sigma) & (neighbour <= ISOLATED * size)
    return xp.sum(high), xp.max(xp.where(high, size, 0.0)) / xp.maximum(pushed, 1e-300)


def jump(deviations: Any, pushed: Any, n: Any, xp: Any = np) -> Any:
    """Return the largest jump between two points over the largest force ``pushed``, 0 without one.

    It is a change by more than a tenth of the largest force and six robust standard deviations of such changes, of which
    more than half remains in the means of the ``BESIDE`` points on either side. The noise of a sample is not as abrupt, and
    correlated noise hides it from other tests.
    """
    steps, at = xp.diff(deviations), xp.arange(deviations.size - 1)
    size = xp.abs(steps)
    sigma = xp.sort(xp.where(at < n - 1, size, xp.inf))[(n - 1) // 2] / 0.6745
    means = xp.convolve(deviations, xp.full(BESIDE, 1.0 / BESIDE), "valid")
    remains = xp.pad(means[BESIDE:] - means[:-BESIDE], BESIDE - 1)
    inside = (at >= BESIDE - 1) & (at < n - BESIDE)
    jumps = inside & (remains * xp.sign(steps) > ISOLATED * size)
    highest = xp.max(xp.where(jumps, size, 0.0))
    seen = highest > xp.maximum(SPIKE * pushed, JUMP_SEEN * sigma)
    return xp.where(seen, highest, 0.0) / xp.maximum(pushed, 1e-300)


def rising(depth: Any, deviations: Any, model: Any, point: Any, n: Any, xp: Any = np) -> Any:
    """Return the rise of the force over that of the model in the last part of the indentation, 1 where it is no flat end.

    depth, deviations (model - load) and force of the model without baseline, (n,); point: depth of contact. Over the last
    fifth of the depth in contact, at least the last ``BESIDE`` + 1 points, both rises are slopes of least squares. An end is
    flat where the force rises by less than a quarter of the model and the difference exceeds five standard errors, with the
    noise of the differences of neighbours. A photodiode or an amplifier at its limit has such an end, and no elastic sample:
    Hertz's force rises there by a quarter of the whole. In short curves other tests take it for correlated noise.
    """
    at = xp.arange(depth.size)
    deep = depth >= depth[n - 1] - LAST * (depth[n - 1] - point)
    some = (at < n) & (deep | (at > n - BESIDE - 2))
    x = xp.where(some, depth - xp.sum(xp.where(some, depth, 0.0)) / xp.sum(some), 0.0)
    square, lag, rise = x @ x, x @ deviations, x @ model
    steps = xp.sort(xp.where(at[1:] < n, xp.abs(xp.diff(deviations)), xp.inf))
    sigma = steps[(n - 1) // 2] / 0.6745 / math.sqrt(2.0)
    flat = (rise > 0.0) & (rise - lag < LEAST_RISE * rise) & (lag > RISE_SEEN * sigma * xp.sqrt(square))
    return xp.where(flat, 1.0 - lag / xp.where(rise > 0.0, rise, 1.0), 1.0)


def spiked_or_jumped(spiky: int, highest: float, jumped: float) -> str:
    """Return the reason against a curve with spikes or a jump, "" without; the arguments are those of ``unusable``."""
    if spiky:
        return (
            f"spikes: {spiky} isolated points deviate from the curve by up to {100 * highest:.3g} % of"
            " the largest force: leave them out, or measure again"
        )
    if jumped:
        return (
            f"a jump by {100 * jumped:.3g} % of the largest force between two points: a contact that"
            " slips or breaks through, or a fault of the instrument; fit the part before it"
        )
    return ""


def unusable(
    before: int, n: int, spiky: int, highest: float, jumped: float, risen: float, pushed: float, scatter: float,
    unit: float,
) -> str:  # fmt: skip
    """Return why a curve determines no modulus, "" if it does.

    before: of its n points those before the contact; spiky, highest: of ``spikes``; jumped: of ``jump``; risen: of
    ``rising``; pushed, scatter: largest force, and standard deviation of the baseline, over ``unit`` [N].
    """
    if before < max(5, SHORT * n):
        return (
            f"the contact is among the first points ({before} before it): the curve has no baseline, so that the contact"
            " point is not determined"
        )
    if n - before < FEW:
        return f"no indentation: {n - before} points after the contact point"
    broken = spiked_or_jumped(spiky, highest, jumped)
    if broken:
        return broken
    if pushed < SEEN * scatter:
        return (
            f"no indentation: the force rises by {pushed * unit * PICO:.3g} pN, the noise of the baseline is"
            f" {scatter * unit * PICO:.3g} pN"
        )
    if risen < 1.0:
        return (
            f"a flat end: over the last fifth of the indentation the force rises by {100 * max(risen, 0.0):.2g} % of what"
            " the model does, as of a detector at its limit; fit the part before it"
        )
    return ""
