"""Shift factors of time-temperature superposition: all times of a material are multiplied by a_T(T).

A law is a frozen pytree with a method ``log_factor(temperature)`` that returns ln a_T; ``ArrheniusShift`` and ``WLFShift``
are two. Source: J. D. Ferry, Viscoelastic Properties of Polymers, 3rd ed., 1980, ch. 11.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.laws import BOLTZMANN, check_activation


@pytree
class ArrheniusShift:
    """The shift factor of a thermally activated viscosity: ln a_T = activation_energy/k (1/T - 1/reference).

    Args:
        activation_energy: of one molecule [J] >= 0, at most 1e-17 (62 eV).
        reference: temperature at which the material has its own times [K] > 0.

    Example:
        >>> shift = jc.ArrheniusShift(activation_energy=1.6e-19, reference=373.0)
        >>> f"{np.exp(shift.log_factor(393.0)):.3f}"
        '0.206'
    """

    activation_energy: Array | float
    reference: Array | float

    def log_factor(self, temperature: Array | float) -> Array:
        """Return ln a_T at a temperature [K] of any shape."""
        inverse = 1.0 / jnp.asarray(temperature, float) - 1.0 / self.reference
        return self.activation_energy / BOLTZMANN * inverse

    def check(self) -> Verdict:
        """Return whether the values are in range; raises ValueError for values that are not traced and are out of range."""
        valid = check_activation("ArrheniusShift", self.activation_energy)
        return valid & checks.positive("ArrheniusShift reference [K]", self.reference)


@pytree
class WLFShift:
    """The shift factor of Williams, Landel and Ferry: log10 a_T = -c1 (T - reference)/(c2 + T - reference).

    It holds above T = reference - c2, where the times become infinite; there and below ln a_T is inf.

    Args:
        c1: > 0.
        c2: [K] > 0.
        reference: temperature at which the material has its own times [K] > 0.

    Example:
        >>> shift = jc.WLFShift(c1=17.44, c2=51.6, reference=373.0)
        >>> f"{np.exp(shift.log_factor(383.0)):.2e}"
        '1.48e-03'
    """

    c1: Array | float
    c2: Array | float
    reference: Array | float

    def log_factor(self, temperature: Array | float) -> Array:
        """Return ln a_T at a temperature [K] of any shape."""
        above = jnp.asarray(temperature, float) - self.reference
        flows = self.c2 + above > 0.0
        return jnp.where(
            flows, -jnp.log(10.0) * self.c1 * above / jnp.where(flows, self.c2 + above, 1.0), jnp.inf
        )

    def check(self) -> Verdict:
        """Return whether the values are in range; raises ValueError for values that are not traced and are out of range."""
        valid = checks.positive("WLFShift c1", self.c1) & checks.positive("WLFShift c2 [K]", self.c2)
        return valid & checks.positive("WLFShift reference [K]", self.reference)


def check_shift(shift: Any) -> Verdict:
    """Return whether a shift's parameters are in range; ValueError for what is no shift."""
    checks.require(
        callable(getattr(shift, "log_factor", None)),
        f"Thermal shift: expected None or an object with a method log_factor, got {type(shift).__name__}",
    )
    return shift.check() if hasattr(shift, "check") else True
