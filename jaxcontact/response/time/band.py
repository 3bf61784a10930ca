"""The band of decay rates of a body, and the body with rounded parameters by which it and other choices are made.

Rates, frequencies, weights and picked wavenumbers are choices of an expansion in time (``response.time.rational``)
that carry no derivative. They are made for a body whose parameters are rounded to powers of 2^(1/8), so that they
stay the same while a parameter changes by less than a few per cent: values are then smooth in the parameters and
finite differences agree with derivatives.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import replace
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.inputs.materials import Material
from jaxcontact.response.stack import solids, spectra

MARGIN = 2.0  # by how much the rates reach beyond those of the solids,
SAMPLED = 10.0  # and the frequencies beyond the rates
SOFT = 3.0  # compliance that a layer finds in its surroundings, over that of the softest other solid
REACH = 1e4  # by how much the rates reach below those of the solids where there is no slowest one,
MORE_RATES, MORE_SHAPES = 1.5, 2.5  # how many times as many rates and shapes there are then,
HORIZON = 0.05  # and the latest time over the longest 1/rate
ROUNDING = 8.0  # steps of the rounding in a factor of two


class Window(NamedTuple):
    """rates: common rates [1/s], (K,); period: 1/s [s] at the sampled frequencies, (2 K,) imaginary; times [s] at which
    the error is measured, (K,); horizon: the latest time for which the expansion is made [s], () inf without one."""

    rates: Array
    period: Array
    times: Array
    horizon: Array


def creeps(solid: Material) -> bool:
    spectrum = solid.spectrum()
    return spectrum.rates.size > 0 or spectrum.fluidity is not None


def has_fluidity(solid: Material) -> bool:
    """Return whether materials of this class may have steady-state flow."""
    return solid.spectrum().fluidity is not None


def rounded(body: LayeredHalfSpace) -> LayeredHalfSpace:
    """Return the body with rounded parameters, without derivative."""
    layers = [
        replace(layer, material=_rounded(layer.material), thickness=_power(layer.thickness))
        for layer in body.sublayers()
    ]
    return LayeredHalfSpace(tuple(layers), _rounded(body.substrate))


def _rounded(material: Material) -> Material:
    """Round a material; of nu its distance from 1/2 is rounded."""
    given = {name: value for name, value in vars(material).items() if value is not None}
    change = {
        n: 0.5 - _power(0.5 - jnp.asarray(v, float)) if n == "nu" else _power(v) for n, v in given.items()
    }
    return replace(material, **change)


def _power(value: Array | float) -> Array:
    """Round to the nearest power of 2^(1/8); zero stays zero."""
    value = jax.lax.stop_gradient(jnp.asarray(value, float))
    return jnp.where(value > 0.0, jnp.exp2(jnp.round(ROUNDING * jnp.log2(value)) / ROUNDING), 0.0)


def may_have_no_slowest(body: LayeredHalfSpace) -> bool:
    """Return whether a solid may flow below a layer that may not, according to their classes.

    The rates of such a body have no lower bound: its layer resists bending the less, the longer the wave.
    """
    each = solids(body)
    may_rest = [not has_fluidity(solid) or "fluidity" in solid.may_be_zero for solid in each]
    return any(
        may_rest[i] and has_fluidity(each[j]) for i in range(len(each)) for j in range(i + 1, len(each))
    )


def _has_no_slowest(body: LayeredHalfSpace) -> Array:
    """Return whether a solid flows below a layer that does not, () bool."""
    flowing = spectra(body).fluidity > 0.0
    return jnp.any((jnp.cumsum(~flowing[:-1]) > 0) & flowing[1:])


def horizon(body: LayeredHalfSpace) -> Array:
    """Return the latest time for which an expansion is made [s], () inf where the rates have a lower bound."""
    return jnp.where(_has_no_slowest(body), HORIZON * REACH / band(body)[0], jnp.inf)


def window(body: LayeredHalfSpace, count: int) -> Window:
    """Return ``count`` rates for a rounded body, and what goes with them."""
    (low, high), last = band(body), horizon(body)
    endless = jnp.isfinite(last)
    low = jnp.where(endless, low / REACH, low)
    lowest = jnp.where(endless, low * SAMPLED, low / SAMPLED)
    latest = jnp.where(endless, last, SAMPLED / low)
    period = -1j / spread(lowest, high * SAMPLED, 2 * count)
    return Window(spread(low, high, count), period, spread(1.0 / (high * SAMPLED), latest, count), last)


def spread(low: Array, high: Array, count: int) -> Array:
    """Return points evenly spaced in their logarithm, (count,)."""
    return low * (high / low) ** jnp.linspace(0.0, 1.0, count)


def band(body: LayeredHalfSpace) -> tuple[Array, Array]:
    """Lowest and highest common rate [1/s] for the body's solids, () each.

    The poles of a stack lie where some moduli s/h(s) are positive and others negative, between the
    retardation and the relaxation rates of its solids. Only a fluid, whose retardation takes for ever, is
    held by the springs around it, and by that of its volume.
    """
    each = spectra(body)
    first, total = each.instantaneous, each.instantaneous + jnp.sum(each.amplitudes, -1)
    volume = [1.0 / solid.bulk_modulus for solid in solids(body) if solid.bulk_modulus is not None]
    softest = jnp.max(jnp.concatenate([total, jnp.asarray(volume, float)]))
    slowest = each.fluidity / (total + SOFT * softest)
    stiff = jnp.where(first > 0.0, first, jnp.min(jnp.where(first > 0.0, first, 1e-3 * total)) / SOFT)
    given = each.fluidity + jnp.sum(each.amplitudes * each.rates, -1)
    fastest = jnp.max(each.rates, -1, initial=0.0) + given / stiff
    rates = jnp.concatenate([each.rates.ravel(), slowest, fastest])
    high = jnp.max(rates)
    low = jnp.min(jnp.where(rates > 0.0, rates, jnp.inf))
    moves = high > 0.0
    return jnp.where(moves, low, 1.0) / MARGIN, jnp.where(moves, high, 1.0) * MARGIN
