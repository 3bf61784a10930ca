"""The wake of an indenter that rubs: what friction adds to ``verbs.steady.wake``.

The traction mu p e, e the unit vector of the velocity, leaves a history of its own, at the rates of the tangential response,

    u = C_0 * mu p + sum_k lambda_k C_k * mu eta_k,

C the response to a traction along e. Far behind a half-space or a substrate that creeps it is felt as a line of points, as
the pressure is, K/(2 pi) (r . e)/r^2 from each in place of N/(2 pi r).
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.operators import spectral
from jaxcontact.operators.base import Operator
from jaxcontact.operators.moving import Moving
from jaxcontact.operators.rubbing import Rubbing
from jaxcontact.verbs.steady.wake import Wake, doubled, on_grid


@pytree
class RubbedWake:
    """wake: of the pressure; rubbing: on the doubled grid; direction: e, (2,), zero at rest."""

    wake: Wake
    rubbing: Rubbing
    direction: Array

    def added_to(self, operator: Moving) -> Operator:
        """Return the operator with friction."""
        return self.rubbing.added_to(operator, self._spectrum())

    def displacement(self, pressure: Array) -> Array:
        """Return the normal displacement under the tractions alone, (nx, ny)."""
        return spectral.convolve(self._spectrum(), self.rubbing.sheared(pressure), self.wake.periodic)

    def coulomb_force(self, pressure: Array) -> Array:
        """Return the sum of mu p against the motion, (); zero at rest."""
        return self.rubbing.coulomb_force(pressure) * jnp.sum(self.direction**2)

    def drift(self, pressure: Array) -> Array:
        """Return the drift of the approach by friction, as ``Wake.drift`` does by the pressure."""
        if not self.wake.far_off:
            return jnp.zeros(())
        flows = self.rubbing.rates == 0.0
        strength = self.rubbing.point_strength() * self.wake.ratio / (2.0 * jnp.pi)
        total = jnp.sum(self.rubbing.sheared(pressure))
        return jnp.sum(jnp.where(flows, strength, 0.0)) * total / self.wake.speed

    def _spectrum(self) -> Array:
        """(my/2 + 1, mx) of all of it over p."""
        along = lambda spectra: jnp.tensordot(spectra, self.direction, ((-3,), (0,)))
        shape, rubbing = self.wake.shape, self.rubbing
        at_once = along(rubbing.spectra(shape)[0])
        if not rubbing.rates.size:
            return at_once
        wide = along(rubbing.lasting(rubbing.spectra(doubled(shape, self.wake.periodic))))
        near = jnp.sum(wide * self.wake.passage(rubbing.rates), 0)
        return at_once + on_grid(near, shape, self.wake.periodic, self._far() if self.wake.far_off else 0.0)

    def _far(self) -> Array:
        """Return the displacement due to the track beyond the grid, (mx, my)."""
        e = self.direction
        ahead = lambda x, y: (e[0] * x + e[1] * y) / jnp.maximum(x**2 + y**2, 1.0)
        strength = self.rubbing.point_strength() * self.wake.ratio / (2.0 * jnp.pi)
        return jnp.tensordot(strength, self.wake.beyond(self.rubbing.rates, ahead), 1)
