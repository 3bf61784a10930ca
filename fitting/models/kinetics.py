"""Stress-activated growth of a film with removal in proportion to its thickness, in closed form."""

import dataclasses
import functools
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

import jaxcontact as jc
from jaxcontact._support.exponential import phi1

BOLTZMANN = 1.380649e-23  # J/K, exact
DIMENSIONS = {"rate": "m/s", "activation_energy": "J", "activation_volume": "m3", "removal_rate": "1/s"}


@functools.partial(jax.tree_util.register_dataclass, data_fields=list(DIMENSIONS), meta_fields=[])
@dataclasses.dataclass(frozen=True)
class GrowthKinetics:
    """Kinetics of a film that grows by a stress-activated process and is removed in proportion to its thickness.

        dh/dt = R - removal_rate h,     R = rate exp(-(activation_energy - activation_volume stress)/(k T))
        h(t) = initial exp(-removal_rate t) + R (1 - exp(-removal_rate t))/removal_rate

    at constant stress and temperature T; k is Boltzmann's constant.

    Source: N. N. Gosvami et al., Science 348 (2015) 102; J. Zhang, H. Spikes, Tribol. Lett. 63 (2016) 24.

    Args:
        rate: pre-exponential factor [m/s].
        activation_energy: [J].
        activation_volume: [m3].
        removal_rate: [1/s]; 0 without removal.

    Example:
        >>> kinetics = fitting.GrowthKinetics(1e-2, 1.2e-19, 4e-30, 1e-4)
        >>> print(f"{kinetics.thickness(3600.0, stress=1e9, temperature=373.0):.3g} m")
        4.99e-09 m
    """

    rate: Array | float
    activation_energy: Array | float
    activation_volume: Array | float
    removal_rate: Array | float

    def growth_rate(self, stress: Any, temperature: Any) -> Array:
        """Return R [m/s] at a stress [Pa] and a temperature [K], of any shapes that broadcast."""
        energy = self.activation_energy - self.activation_volume * jnp.asarray(stress)
        return self.rate * jnp.exp(-energy / (BOLTZMANN * jnp.asarray(temperature)))

    def thickness(self, t: Any, stress: Any, temperature: Any, initial: Any = 0.0) -> Array:
        """Return the thickness h(t) [m] at times t [s], with an initial thickness [m]; the shapes must broadcast."""
        t = jnp.asarray(t, dtype=float)
        decay = self.removal_rate * t
        return initial * jnp.exp(-decay) + self.growth_rate(stress, temperature) * t * phi1(decay)

    def law(self, temperature: float | None = None, stress: str = "pressure") -> Any:
        """Return the law for ``jaxcontact.rub`` at a temperature [K], by default that of the contact.

        stress: the stress that drives the growth, "pressure" or "shear".
        """
        grown = (self.rate, self.activation_energy, self.activation_volume)
        return jc.StressActivated(*grown, temperature, stress=stress) + jc.ProportionalRemoval(
            self.removal_rate
        )
