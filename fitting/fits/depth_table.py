"""Table of the apparent modulus over the depth of a force curve, with a contact point and a baseline of its own."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy.interpolate
import scipy.optimize
from scipy.special import ndtr

from fitting.data.contact import sample_noise
from fitting.inference import noise

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

    def at(contact: float, x: np.ndarray, sd: np.ndarray) -> Conditional:
        """Return the optimum at a contact point, from coordinates x; sd (n,) of the noise over the largest force."""
        d = np.maximum(z - contact, 0.0)
        spline, unit = scipy.interpolate.CubicSpline(nodes, each)(d / d.max()), law(d * deepest) / top
        pushed = lambda x: unit * np.exp(np.minimum(spline @ x[:-2], LARGEST))

        def residual(x: np.ndarray) -> np.ndarray:
            return np.append((pushed(x) + x[-2] + x[-1] * along - measured) / sd, in_advance @ x)

        def jacobian(x: np.ndarray) -> np.ndarray:
            slopes = np.column_stack([pushed(x)[:, None] * spline, np.ones(n), along])
            return np.vstack([slopes / sd[:, None], in_advance])

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
    x = np.append(np.full(nodes.size, math.log(start)), [0.0, 0.0])
    starts = [x] * trials.size
    sd = np.full(n, sample_noise(force) / top)
    for turn in range(WEIGHINGS + 1):
        tried = [at(trial, own, sd) for trial, own in zip(trials, starts, strict=True)]
        starts = [one.x for one in tried]
        first = int(np.argmin([one.cost for one in tried]))
        least, ends = tried[first], (trials[max(first - 1, 0)], trials[min(first + 1, trials.size - 1)])
        near = scipy.optimize.minimize_scalar(
            lambda contact, x=least.x, sd=sd: at(contact, x, sd).cost, bounds=ends, method="bounded",
            options={"xatol": STEP},
        )  # fmt: skip
        best = at(float(near.x), least.x, sd)
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

    # 3. Contact points to both sides until their density is negligible, in steps that follow its change.
    summed = [best]
    for side in (-1.0, 1.0):
        one, step = best, STEP
        for _ in range(LAST):
            contact = one.contact + side * step
            if not trials[0] <= contact <= trials[-1]:
                break
            before, one = one, at(contact, one.x, sd)
            summed.append(one)
            if one.cost > best.cost + CUT:
                break
            change = abs(one.cost - before.cost)
            step *= 2.0 if change < 0.1 else 0.5 if change > 1.0 else 1.0
    summed.sort(key=lambda one: one.contact)

    # 4. Normal distributions of log E at the depths of the rows, below each contact point's own, and the quantiles of their
    # sum. A depth d lies at d/(1 - contact) between the nodes, for a later contact beyond the last one, where the spline is
    # extrapolated. The weights are trapezoidal widths times the density.
    weights, means, sds = np.ones(1), [], []
    if len(summed) > 1:
        costs = np.array([one.cost for one in summed])
        weights = np.gradient([one.contact for one in summed]) * np.exp(costs.min() - costs)
    for one in summed:
        place = nodes[1:] * (1.0 - best.contact) / (1.0 - one.contact)
        turned = scipy.interpolate.CubicSpline(nodes, each)(place)
        covariance = np.linalg.inv(one.fisher)[: nodes.size, : nodes.size]
        means.append(turned @ one.x[:-2])
        sds.append(np.sqrt(np.einsum("ij,jk,ik->i", turned, covariance, turned)))
    share, rows = weights / weights.sum(), []
    for i, (mean, spread) in enumerate(zip(np.transpose(means), np.transpose(sds), strict=True)):
        beyond = lambda y, p, mean=mean, spread=spread: float(share @ ndtr((y - mean) / spread)) - p
        outer = float((mean - 9.0 * spread).min()), float((mean + 9.0 * spread).max())
        low, high = (
            scipy.optimize.brentq(beyond, *outer, args=(p,)) for p in (0.5 - 0.5 * level, 0.5 + 0.5 * level)
        )
        value = float(x[i + 1])
        ends = (math.exp(min(low, value)), math.exp(max(high, value)))
        rows.append((float(nodes[i + 1] * (1.0 - best.contact) * deepest), math.exp(value), *ends))
    return tuple(rows)
