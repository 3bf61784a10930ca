"""A ball on a viscoelastic half-space: depth from load, and load from depth.

While the contact grows (E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438)

    depth^(3/2) = 3/(8 sqrt(R)) int [(1 - nu) J(t - s) + A] dP(s),
    P = 8 sqrt(R)/(3 (1 - nu)) int G(t - s) d(depth^(3/2)),

with A = (1 - nu)/G of an elastic ball, and once it shrinks (T. C. T. Ting, J. Appl. Mech. 33 (1966)
845) the second integral ends at the earlier time t1(t) of equal contact, int_t1^t G(t - s) d(depth) = 0.
The load, or depth^(3/2) and depth, are linear between samples; then both integrals are exact
recursions. The measured depth is depth + contact point + drift t + machine compliance P.

All is scaled: times by the last, loads and depths by their largest, compliance so that no factor is
left: depth^(3/2) = int (J + a) dP.
"""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.history import columns, recursion

# coordinates: logarithms of j0, j2 and j2/tau, and f, contact point, drift, machine compliance as they are
J0, J2, FLOW, RATE, CONTACT, DRIFT, MACHINE = range(7)
LOGS = (J0, J2, RATE)
BISECTIONS = 24


class Curve(NamedTuple):
    """Scaled samples: t, load, depth, weights (n,); basis: the load's ``History``; extra: a, of the ball.

    top: index of the greatest depth, from which on the contact may shrink.
    """

    t: Array
    load: Array
    depth: Array
    weights: Array
    basis: Any
    extra: Array
    top: Array


def parts(theta: Array) -> tuple[Array, Array, Array, Array]:
    """(j0, j2, f, 1/tau) of the coordinates; any 1/tau where j2 is absent."""
    j2, q = jnp.exp(theta[J2]), jnp.exp(theta[RATE])
    some = (j2 > 0) & (q > 0)
    return jnp.exp(theta[J0]), j2, theta[FLOW], jnp.where(some, q / jnp.where(some, j2, 1.0), 1.0)


def depth_residual(theta: Array, curve: Curve) -> Array:
    """Weighted depth of the model less that measured, (n,); the load is given."""
    j0, j2, f, k = parts(theta)
    # an integral at or below zero: not in contact yet; the slope of the root stays finite
    total = columns(curve.basis, 1.0 / k) @ jnp.stack([j0 + curve.extra, j2, f])
    depth = jnp.where(total > 0, jnp.where(total > 0, total, 1.0) ** (2.0 / 3.0), 0.0)
    return curve.weights * (depth + offset(theta, curve) - curve.depth)


def offset(theta: Array, curve: Curve) -> Array:
    """Contact point, drift and machine compliance in the measured depth, (n,)."""
    return theta[CONTACT] + theta[DRIFT] * curve.t + theta[MACHINE] * curve.load


def load_residual(theta: Array, curve: Curve) -> Array:
    """Weighted load of the model less that measured, (n,); the depth is given and the contact grows."""
    weights, rates = relaxation(theta, curve)
    power = jnp.maximum(curve.depth - offset(theta, curve), 0.0) ** 1.5
    return curve.weights * (_memory(curve.t, power, rates) @ weights - curve.load)


def load_residual_ting(theta: Array, curve: Curve) -> Array:
    """As ``load_residual``, for one maximum of the depth: after it the integral ends at t1(t)."""
    weights, rates = relaxation(theta, curve)
    rising = jnp.arange(curve.t.size) <= curve.top
    depth = jnp.maximum(curve.depth - offset(theta, curve), 0.0)
    depth = jnp.where(rising, jax.lax.cummax(jnp.where(rising, depth, 0.0)), depth)
    last = jnp.where(rising, curve.t, _matching_time(curve, depth, weights, rates))
    power = depth**1.5
    ended = _at(curve.t, power, _memory(curve.t, power, rates), rates, last)
    decay = jnp.exp(-rates * (curve.t - last)[:, None])
    return curve.weights * ((decay * ended) @ weights - curve.load)


def relaxation(theta: Array, curve: Curve) -> tuple[Array, Array]:
    """G(t) = sum_k weights_k exp(-rates_k t) of J + a, (2,) and (2,).

    The rates are the roots of J0 s^2 + (J0 k + f + q) s + f k at s = -rate, with k = 1/tau, q = j2 k.
    """
    j0, j2, f, k = parts(theta)
    j0 = j0 + curve.extra
    b = j0 * k + f + j2 * k
    root = jnp.sqrt(jnp.maximum((j0 * k + j2 * k - f) ** 2 + 4.0 * f * j2 * k, 1e-300))
    fast = (b + root) / (2.0 * j0)
    slow = 2.0 * f * k / (b + root)
    weights = jnp.stack([(fast - k) / (root / j0), (k - slow) / (root / j0)]) / j0
    return weights, jnp.stack([fast, slow])


def _memory(t: Array, y: Array, rates: Array) -> Array:
    """int_0^t exp(-r (t - s)) dy(s) at the samples, (n, k); y steps on at the first and is linear between."""
    gap = jnp.diff(t, prepend=t[:1])
    rise = jnp.diff(y, prepend=jnp.zeros_like(y[:1]))
    x = rates * gap[:, None]
    return recursion(jnp.exp(-x), rise[:, None] * _mean_decay(x))


def _mean_decay(x: Array) -> Array:
    """(1 - exp(-x))/x, 1 at 0."""
    small = x < 1e-8
    return jnp.where(small, 1.0 - 0.5 * x, -jnp.expm1(-x) / jnp.where(small, 1.0, x))


def _at(t: Array, y: Array, memory: Array, rates: Array, when: Array) -> Array:
    """The memory integral at the times ``when`` (n,), between samples, (n, k)."""
    j = jnp.clip(jnp.searchsorted(t, when, side="right") - 1, 0, t.size - 2)
    gap, since = t[j + 1] - t[j], jnp.maximum(when - t[j], 0.0)
    slope = (y[j + 1] - y[j]) / jnp.where(gap > 0, gap, 1.0)
    x = rates * since[:, None]
    return jnp.exp(-x) * memory[j] + (slope * since)[:, None] * _mean_decay(x)


def _matching_time(curve: Curve, depth: Array, weights: Array, rates: Array) -> Array:
    """t1(t) (n,), by bisection up to the greatest depth; t_0 once the contact is lost.

    int_t1^t G(t - s) d(depth) falls with t1 at the rate G(t - t1) depth'(t1); one Newton step at
    that rate carries the derivative.
    """
    memory = _memory(curve.t, depth, rates)

    def left(t1: Array) -> Array:
        decay = jnp.exp(-rates * (curve.t - t1)[:, None])
        return (memory - decay * _at(curve.t, depth, memory, rates, t1)) @ weights

    def halve(_: int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        middle = 0.5 * (ends[0] + ends[1])
        late = left(middle) < 0.0
        return jnp.where(late, ends[0], middle), jnp.where(late, middle, ends[1])

    ends = jnp.full_like(curve.t, curve.t[0]), jnp.full_like(curve.t, curve.t[curve.top])
    low, high = jax.lax.fori_loop(0, BISECTIONS, halve, ends)
    t1 = jax.lax.stop_gradient(0.5 * (low + high))
    j = jnp.clip(jnp.searchsorted(curve.t, t1, side="right") - 1, 0, curve.t.size - 2)
    gap = curve.t[j + 1] - curve.t[j]
    speed = (depth[j + 1] - depth[j]) / jnp.where(gap > 0, gap, 1.0)
    rate = jnp.exp(-rates * (curve.t - t1)[:, None]) @ weights * speed
    # no step where the depth stands still, nor before the first contact
    moving = (rate > 1e-9 * jnp.max(rate)) & (t1 > curve.t[0] + 1e-6 * (curve.t[curve.top] - curve.t[0]))
    step = jnp.where(moving, left(t1) / jax.lax.stop_gradient(jnp.where(moving, rate, 1.0)), 0.0)
    return t1 + step


MODELS = {"load": depth_residual, "depth": load_residual, "ting": load_residual_ting}


@functools.partial(jax.jit, static_argnames="kind")
def evaluate(theta: Array, curve: Curve, kind: str) -> Array:
    """Weighted residuals (n,) of one of ``MODELS``."""
    return MODELS[kind](theta, curve)


@functools.partial(jax.jit, static_argnames="kind")
def slopes(theta: Array, free: Array, curve: Curve, kind: str) -> Array:
    """Their Jacobian (n, k) with respect to the coordinates ``free``."""
    some = lambda x: MODELS[kind](jnp.asarray(theta).at[free].set(x), curve)
    return jax.jacfwd(some)(jnp.asarray(theta)[free])


def scale_compliance(radius: float, nu: float, load: float, depth: float) -> float:
    """J [1/Pa] that a scaled compliance of one stands for: 8 sqrt(R) depth^(3/2)/(3 (1 - nu) load)."""
    return 8.0 * np.sqrt(radius) * depth**1.5 / (3.0 * (1.0 - nu) * load)
