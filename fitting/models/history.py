"""Columns of the linear strain response to a stress history: strain = j0 E + sum_i j_i D(tau_i) + f F.

    E(t) = sigma(t),   D(t; tau) = int (1 - exp(-(t-s)/tau)) dsigma(s),   F(t) = int sigma ds

For a unit step at t = 0 these are 1, 1 - exp(-t/tau) and t. Between its knots the stress is
linear, and a repeated time marks a jump, so tau D' + D = sigma has a closed form over each segment
and the Boltzmann integral is exact; it is evaluated by a recursion over all knots and samples.
"""

from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.exponential import ramps


class Step(NamedTuple):
    """A unit stress applied at t = 0; times t (n,)."""

    t: Array


class History(NamedTuple):
    """Merged knots and samples of a stress history.

    gap (m,): to the previous point; start (m,): stress just after the previous point; slope (m,): of the stress; stress
    (m,): at the point itself; integral (m,): of the stress; pick (n,): indices of the samples.
    """

    gap: Array
    start: Array
    slope: Array
    stress: Array
    integral: Array
    pick: Array


def columns(stressed: Step | History, rates: Array) -> Array:
    """Return [E, D(tau_1) .. D(tau_k), F], (n, k + 2), for rates 1/tau (k,)."""
    if isinstance(stressed, Step):
        t = jnp.asarray(stressed.t)[:, None]
        return jnp.concatenate([jnp.ones_like(t), -jnp.expm1(-t * rates), t], -1)
    parts = [stressed.stress[:, None], _delayed(stressed, rates), stressed.integral[:, None]]
    return jnp.concatenate(parts, -1)[stressed.pick]


def _delayed(stressed: History, rates: Array) -> Array:
    """Return D of tau D' + D = sigma, sigma = start + slope s over each gap, exactly; (m, k)."""
    ratio = stressed.gap[:, None] * rates
    held = stressed.start[:, None] * -jnp.expm1(-ratio)
    ramp = (stressed.slope * stressed.gap)[:, None] * ratio * ramps(ratio)[2]
    return recursion(jnp.exp(-ratio), held + ramp)


def recursion(decay: Array, forced: Array) -> Array:
    """Return y_i = decay_i y_(i-1) + forced_i along the first axis, y_(-1) = 0.

    The recursion is sequential: on a CPU this is less work, and compiles much faster, than an associative scan.
    """

    def step(y: Array, row: tuple[Array, Array]) -> tuple[Array, Array]:
        y = row[0] * y + row[1]
        return y, y

    return jax.lax.scan(step, jnp.zeros_like(forced[0]), (decay, forced))[1]


def merge(t: np.ndarray, knots: np.ndarray, values: np.ndarray) -> History:
    """Return the history at the samples t (n,) of the stress ``values`` at ``knots`` (both (k,)).

    Knots must not decrease; a repeated knot is a jump, at which a sample has the stress after it. The stress is zero
    before the first knot and constant after the last.
    """
    times = np.concatenate([np.minimum(knots[:1], t[:1]), knots, t])
    after = np.concatenate([np.zeros(1), values, _value_at(t, knots, values, "right")])
    before = np.concatenate([np.zeros(1), _value_before(knots, values), _value_at(t, knots, values, "left")])
    order = np.argsort(times, kind="stable")
    times, after, before = times[order], after[order], before[order]
    gap = np.diff(times, prepend=times[0])
    start = np.concatenate([[0.0], after[:-1]])
    slope = np.where(gap > 0, (before - start) / np.where(gap > 0, gap, 1.0), 0.0)
    integral = np.cumsum(gap * 0.5 * (start + before) * (gap > 0))
    pick = np.argsort(order, kind="stable")[1 + len(knots) :]
    arrays = (jnp.asarray(a) for a in (gap, start, slope, after, integral, pick))
    return History(*arrays)


def _value_at(
    t: np.ndarray, knots: np.ndarray, values: np.ndarray, side: Literal["left", "right"]
) -> np.ndarray:
    """Return the stress just after t (side "right") or just before it (side "left")."""
    k = np.searchsorted(knots, t, side=side) - 1
    i, j = np.clip(k, 0, None), np.clip(k + 1, None, len(knots) - 1)
    width = knots[j] - knots[i]
    share = np.where(width > 0, (t - knots[i]) / np.where(width > 0, width, 1.0), 0.0)
    return np.where(k < 0, 0.0, values[i] + share * (values[j] - values[i]))


def _value_before(knots: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the stress just before each knot: zero before the first, the knot's own value if there is no jump."""
    same = np.concatenate([[True], np.diff(knots) == 0])
    return np.where(same, np.concatenate([[0.0], values[:-1]]), values)
