"""Temperature of a surface that friction heats, and the reduced time in which a body creeps at it.

With a shift factor a_T the body creeps in reduced time, d xi = dt/a_T, at the mean temperature of the contact: that in the
middle of a step is extrapolated from the two steps before. A step much longer than the one before it has the temperature at
its start: after a load that rises quickly and then stays, the temperature does not go on rising.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import pytree
from jaxcontact.operators import spectral


@pytree
class Heated:
    """Temperature of the surface where friction heats it.

    spectrum: of the rise per heat flux on a cell [K m2/W], for ``spectral.convolve``; ambient [K], (); share: of the heat
    of friction that enters the body, (); shift: None, or the law of the shift factor of the body's times.
    """

    spectrum: Array
    ambient: Array
    share: Array
    shift: Any = None

    def rise(self, flux: Array) -> Array:
        """Return the rise of the temperature [K] under the heat flux of friction [W/m2], (nx, ny)."""
        return spectral.convolve(self.spectrum, self.share * flux)

    def temperature(self, flux: Array) -> Array:
        """Return the temperature [K] under the heat flux of friction [W/m2], (nx, ny)."""
        return self.ambient + self.rise(flux)

    def log_shift(self, temperature: Array, pressure: Array) -> Array:
        """Return the log of the shift factor at the mean temperature of the contact, without contact at ambient, ()."""
        if self.shift is None:
            return jnp.zeros(())
        touching = pressure > 0.0
        cells = jnp.sum(touching)
        rise = jnp.sum(jnp.where(touching, temperature - self.ambient, 0.0)) / jnp.maximum(cells, 1)
        return self.shift.log_factor(self.ambient + rise)

    def shifted(self, before: Array, temperature: Array | None, pressure: Array, dt: Array) -> Array:
        """Return the log of the shift factor at the end of a step, its rate of change over the step, and dt, (3,)."""
        if self.shift is None or temperature is None:
            return before
        now = self.log_shift(temperature, pressure)
        rate = (now - before[0]) / jnp.where(dt > 0.0, dt, jnp.inf)
        return jnp.stack([now, rate, dt])


def reduced(dt: Array, shift: Array) -> Array:
    """Return the reduced time of a step, from the log of the shift factor and its rate of change over the step before, and
    the length of that step. In a step that is longer the extrapolation is less by the square of the ratio.
    """
    before, rate, last = shift
    extrapolated = jnp.minimum(dt, last**2 / jnp.where(dt > 0.0, dt, jnp.inf))
    return dt * jnp.exp(-before - rate * extrapolated / 2.0)


def in_reduced_time(dt: Array, before: Array, after: Array) -> Array:
    """Return the reduced time of a step whose shift factor at its end is known, its logarithm linear in between; before,
    after: as ``Heated.shifted`` gives them.
    """
    return dt * jnp.exp(-before[0]) * phi1(after[0] - before[0])
