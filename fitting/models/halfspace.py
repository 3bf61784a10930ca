"""Indentation of a viscoelastic half-space or thin layer by a ball, cone or punch: depth from load, and load from depth.

While the contact grows (E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438)

    depth^(3/2) = 3/(8 sqrt(R)) int [(1 - nu) J(t - s) + A] dP(s),
    P = 8 sqrt(R)/(3 (1 - nu)) int G(t - s) d(depth^(3/2))                (and so with a bulk modulus: ``surface``),

(other powers and sizes for other probes, ``data/indentation.py``),

with A = (1 - nu)/G of an elastic ball, and once it shrinks (T. C. T. Ting, J. Appl. Mech. 33 (1966)
845) the second integral ends at the earlier time t1(t) of equal contact, int_t1^t G(t - s) d(depth) = 0.
The load, or depth^(3/2) and depth, are linear between samples; then both integrals are exact recursions.

In a layer bonded to a rigid base, with a constant nu, the modulus is a factor of the response at every wavenumber, so
that both arguments hold with depth^(3/2) f(depth) in place of depth^(3/2), f of ``thin_layer.py``.

The measured depth is depth + contact point + drift t + machine compliance P. Adhesive
contact is derived in ``adhesive_contact.py``.

Times are scaled by the duration, load and depth by their largest values, and compliances so that
depth^(3/2) = int (J + extra) dP.
"""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from fitting.models import adhesive_contact
from fitting.models.parameters import instrument_offset, spectrum
from fitting.models.structure import columns, recursion
from fitting.models.thin_layer import LARGEST, ThinLayer
from jaxcontact._compile.programs import Program
from jaxcontact._support.exponential import phi1
from jaxcontact.bodies import materials
from jaxcontact.bodies.materials import Spectrum

BISECTIONS = 24
NEWTON = 12  # iterations for the depth in a layer, which converge quadratically in logarithms


class Curve(NamedTuple):
    """Scaled samples of an indentation test.

    t, load, depth, weights (n,); history: the load's ``History``; extra: A of the ball, over 1 - nu; bulk: the bulk
    modulus, or None for a constant nu; power: of the depth; top: index of the largest depth, after which the contact
    may shrink; pull: 6 pi w R of the work of adhesion w; edge: fraction of the creep in the compliance of an adhesive
    edge, 0 for J(0) and 1 for J(t); layer: the factor of a thin layer over scaled depths, None on a half-space; rates (k,):
    1/tau_i of a series with given times, else None; own: delayed creep of an indenter that creeps, whose creep at once is
    in extra, or None.
    """

    t: Array
    load: Array
    depth: Array
    weights: Array
    history: Any
    extra: Array
    bulk: Array | None
    power: Array
    top: Array
    pull: Array | float = 0.0
    edge: Array | float = 0.0
    layer: ThinLayer | None = None
    rates: Array | None = None
    own: Spectrum | None = None

    def surface(self, theta: Array) -> Spectrum:
        """Return the effective J of both surfaces at coordinates (m,) (``parameters.spectrum``), without extra."""
        c, own = surface(spectrum(theta, self.rates), self.bulk), self.own
        if own is None:
            return c
        flow = sum(
            (jnp.asarray(each.fluidity) for each in (c, own) if each.fluidity is not None), jnp.zeros(())
        )
        amplitudes = jnp.concatenate([c.amplitudes, own.amplitudes])
        return Spectrum(c.instantaneous, amplitudes, jnp.concatenate([c.rates, own.rates]), flow)

    def indentation(self, theta: Array) -> Array:
        """Return the measured depth without the contributions of the instrument (n,), 0 before contact."""
        return jnp.maximum(self.depth - instrument_offset(theta, self.t, self.load), 0.0)

    def force(self, depth: Array) -> Array:
        """Return the scaled force (n,) of an elastic body of J = 1 at depths (n,) >= 0."""
        return depth**self.power * (1.0 if self.layer is None else self.layer.factor(depth))

    def depth_at(self, force: Array) -> Array:
        """Return the depths (n,) of scaled forces (n,) at J = 1, 0 without a force; nan beyond the table of a layer."""
        # the derivative of the root stays finite
        positive = jnp.where(force > 0, force, 1.0)
        depth = positive ** (1.0 / self.power) if self.layer is None else _depth_in_layer(positive, self)
        return jnp.where(force > 0, depth, 0.0)


def _depth_in_layer(force: Array, curve: "Curve") -> Array:
    """Return the depths (n,) of scaled forces (n,) > 0, by Newton's method in logarithms."""
    layer = curve.layer
    assert layer is not None

    def excess(x: Array, layer: ThinLayer, force: Array) -> Array:
        return curve.power * x + layer.log_factor(jnp.exp(x)) - jnp.log(force)

    fixed = jax.lax.stop_gradient((layer, force))

    def step(_: int, x: Array) -> Array:
        value, slope = jax.jvp(lambda y: excess(y, *fixed), (x,), (jnp.ones_like(x),))
        return x - value / slope

    x = jax.lax.fori_loop(0, NEWTON, step, jnp.log(fixed[1]) / curve.power)
    x = jax.lax.stop_gradient(x)
    slope = jax.jvp(lambda y: excess(y, *fixed), (x,), (jnp.ones_like(x),))[1]
    depth = jnp.exp(x - excess(x, layer, force) / slope)  # one more step carries the derivative
    return jnp.where(layer.chi(depth) <= LARGEST, depth, jnp.nan)


def residual_of(theta: Array, curve: Curve, kind: str) -> Array:
    """Return the weighted residuals (n,) of a kind of test: of the depth where the load is given, otherwise of the load.

    kind: "load", a given load, or "depth", a given depth, in a contact that never shrinks; "ting", a given depth that rises
    to one maximum and then falls, where the integral over the past ends at t1(t); "sticky load" and "sticky depth", as the
    first two, for an adhesive ball.
    """
    c, sticky = curve.surface(theta), kind.startswith("sticky")
    if kind.endswith("load"):
        force = _hereditary(c, curve)
        depth = adhesive_contact.under_load(force, _neck(c, curve))[0] if sticky else curve.depth_at(force)
        return curve.weights * (depth + instrument_offset(theta, curve.t, curve.load) - curve.depth)

    weights, rates = relaxation_modes(c, curve.extra)
    depth = curve.indentation(theta)
    if kind == "ting":
        rising = jnp.arange(curve.t.size) <= curve.top
        depth = jnp.where(rising, _highest(jnp.where(rising, depth, 0.0)), depth)
        last = jnp.where(rising, curve.t, _matching_time(curve, depth, weights, rates))
    power = adhesive_contact.at_depth(depth, _neck(c, curve))[0] if sticky else curve.force(depth)
    modes = _memory(curve.t, power, rates)
    if kind == "ting":
        decay = jnp.exp(-rates * (curve.t - last)[:, None])
        modes = decay * _at(curve.t, power, modes, rates, last)
    return curve.weights * (modes @ weights - curve.load)


def _hereditary(c: Spectrum, curve: Curve) -> Array:
    """Return int (J + extra) dP at the samples, (n,)."""
    flow = jnp.asarray(c.fluidity)
    x = jnp.concatenate([jnp.stack([c.instantaneous + curve.extra]), c.amplitudes, jnp.stack([flow])])
    return columns(curve.history, c.rates) @ x


def _neck(c: Spectrum, curve: Curve) -> Array:
    """Return kappa of ``adhesive_contact.py``, (n,)."""
    creep = c.creep(curve.t - curve.t[0]) - c.instantaneous
    return adhesive_contact.root(curve.pull * (c.instantaneous + curve.edge * creep + curve.extra))


@functools.partial(jax.jit, static_argnames="kind")
def sticky_area(theta: Array, curve: Curve, kind: str) -> tuple[Array, Array]:
    """Return alpha (n,), proportional to the contact area of an adhesive ball, and J(t) + extra (n,), scaled."""
    c = curve.surface(theta)
    if kind == "sticky load":
        alpha = adhesive_contact.under_load(_hereditary(c, curve), _neck(c, curve))[1]
    else:
        depth = curve.indentation(theta)
        alpha = adhesive_contact.at_depth(depth, _neck(c, curve))[1]
    return alpha, c.creep(curve.t - curve.t[0]) + curve.extra


def surface(c: Spectrum, bulk: Array | None) -> Spectrum:
    """Return the effective J of the surface; with a bulk modulus K, 2 (1 - nu) J has the transform J + 3/(G + 3 K).

    Source: ``response.stack``.
    """
    if bulk is None:
        return c
    start, retarded, rates = materials.parallel_creep(_ascending(c), 3.0 * bulk)
    return Spectrum(
        c.instantaneous + 3.0 * start,
        jnp.concatenate([c.amplitudes, 3.0 * retarded]),
        jnp.concatenate([c.rates, rates]),
        c.fluidity,
    )


def relaxation_modes(c: Spectrum, extra: Array) -> tuple[Array, Array]:
    """Return weights and rates, (k + 1,) each, of G(t) = sum_m weights_m exp(-rates_m t), the modulus of J + extra."""
    rates, weights = materials.relaxation_modes(_ascending(c), extra)
    return weights, rates


def _ascending(c: Spectrum) -> Spectrum:
    """Return the spectrum with its rates in ascending order."""
    order = jnp.argsort(c.rates)
    return Spectrum(c.instantaneous, c.amplitudes[order], c.rates[order], c.fluidity)


def _highest(y: Array) -> Array:
    """Return the running maximum (n,); a sequential scan compiles three times faster than ``lax.cummax``."""

    def step(top: Array, here: Array) -> tuple[Array, Array]:
        top = jnp.maximum(top, here)
        return top, top

    return jax.lax.scan(step, jnp.zeros(()), y)[1]


def _memory(t: Array, y: Array, rates: Array) -> Array:
    """Return int_0^t exp(-r (t - s)) dy(s) at the samples, (n, k); y steps at the first sample and is piecewise linear."""
    gap = jnp.diff(t, prepend=t[:1])
    rise = jnp.diff(y, prepend=jnp.zeros_like(y[:1]))
    x = rates * gap[:, None]
    return recursion(jnp.exp(-x), rise[:, None] * phi1(x))


def _at(t: Array, y: Array, memory: Array, rates: Array, when: Array) -> Array:
    """Return the memory integral at the times ``when`` (n,), between samples, (n, k)."""
    j = jnp.clip(jnp.searchsorted(t, when, side="right") - 1, 0, t.size - 2)
    gap, since = t[j + 1] - t[j], jnp.maximum(when - t[j], 0.0)
    slope = (y[j + 1] - y[j]) / jnp.where(gap > 0, gap, 1.0)
    x = rates * since[:, None]
    return jnp.exp(-x) * memory[j] + (slope * since)[:, None] * phi1(x)


def _matching_time(curve: Curve, depth: Array, weights: Array, rates: Array) -> Array:
    """Return t1(t) (n,), by bisection up to the time of the largest depth; t_0 once the contact is lost.

    int_t1^t G(t - s) d(depth) falls with t1 at the rate G(t - t1) depth'(t1); one Newton step with this rate carries
    the derivative.
    """
    series = depth, weights, rates, _memory(curve.t, depth, rates)
    fixed = jax.lax.stop_gradient(series)  # the bisection needs no derivative, and compiles faster without

    def left(t1: Array, depth: Array, weights: Array, rates: Array, memory: Array) -> Array:
        decay = jnp.exp(-rates * (curve.t - t1)[:, None])
        return (memory - decay * _at(curve.t, depth, memory, rates, t1)) @ weights

    def halve(_: int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        middle = 0.5 * (ends[0] + ends[1])
        late = left(middle, *fixed) < 0.0
        return jnp.where(late, ends[0], middle), jnp.where(late, middle, ends[1])

    ends = jnp.full_like(curve.t, curve.t[0]), jnp.full_like(curve.t, curve.t[curve.top])
    low, high = jax.lax.fori_loop(0, BISECTIONS, halve, ends)
    t1 = jax.lax.stop_gradient(0.5 * (low + high))
    j = jnp.clip(jnp.searchsorted(curve.t, t1, side="right") - 1, 0, curve.t.size - 2)
    gap = curve.t[j + 1] - curve.t[j]
    speed = (depth[j + 1] - depth[j]) / jnp.where(gap > 0, gap, 1.0)
    rate = jnp.exp(-rates * (curve.t - t1)[:, None]) @ weights * speed
    # no step where the depth is constant, nor before the first contact
    moving = (rate > 1e-9 * jnp.max(rate)) & (t1 > curve.t[0] + 1e-6 * (curve.t[curve.top] - curve.t[0]))
    step = jnp.where(moving, left(t1, *series) / jax.lax.stop_gradient(jnp.where(moving, rate, 1.0)), 0.0)
    return t1 + step


@functools.partial(Program, static_argnames=("kind",))
def evaluate(theta: Array, curve: Curve, kind: str) -> Array:
    """Return the weighted residuals (n,), as ``residual_of``."""
    return residual_of(theta, curve, kind)


@functools.partial(Program, static_argnames=("kind",))
def linear(theta: Array, free: Array, curve: Curve, kind: str) -> tuple[Array, Array]:
    """Return the residuals and their Jacobian (n, k) with respect to the coordinates at the places ``free`` (k,).

    Both are computed in one program.
    """

    def some(x: Array) -> tuple[Array, Array]:
        residual = residual_of(theta.at[free].set(x), curve, kind)
        return residual, residual

    jacobian, residual = jax.jacfwd(some, has_aux=True)(theta[free])
    return residual, jacobian


@functools.partial(jax.jit, static_argnames="kind")
def layer_slope(theta: Array, curve: Curve, change: ThinLayer, kind: str) -> Array:
    """Return the derivative of the weighted residuals (n,) along a change of the layer's factor."""
    run = lambda layer: residual_of(theta, curve._replace(layer=layer), kind)
    return jax.jvp(run, (curve.layer,), (change,))[1]


@functools.partial(jax.jit, static_argnames="kind")
def bulk_slope(theta: Array, curve: Curve, kind: str) -> Array:
    """Return the derivative of the weighted residuals (n,) with respect to the bulk modulus."""
    return jax.jacfwd(lambda bulk: residual_of(theta, curve._replace(bulk=bulk), kind))(
        jnp.asarray(curve.bulk)
    )
