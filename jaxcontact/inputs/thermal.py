"""Heating of a rubbed surface by friction."""

from __future__ import annotations

from typing import Any

from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.grid import Grid, check_not_periodic
from jaxcontact.inputs.shifts import check_shift


@pytree
class Thermal:
    """Heating of the rubbed surface by friction, as the steady flash temperature of a half-space at each time.

    The temperature is T = ambient + rise, where the rise is that of ``flash_temperature`` under the flux share x friction x
    pressure x speed. In ``rub`` the contact does not move over the film, and the rise is that at zero velocity. In ``slide``
    it is that of a flux which moves over the body with the indenter.

    With ``shift`` the temperature changes the creep of the body: at each instant all its times are multiplied by one factor,
    that of the mean temperature of the contact (``history.heating``). Differences of temperature within the contact do not
    affect the creep, nor does temperature change the moduli.

    Args:
        ambient: temperature far from the contact [K] > 0.
        conductivity: thermal conductivity of the body [W/(m K)] > 0.
        share: fraction of the frictional heat that enters the body, from 0 to 1.
        shift: None, or the law of the shift factor of the body's times: ``ArrheniusShift``, ``WLFShift``, or a frozen pytree
            with ``log_factor(temperature)``.
        diffusivity: thermal diffusivity of the body [m2/s] > 0, for ``slide``; ``rub`` does not use it.

    Example:
        >>> steel_at_100_degrees = jc.Thermal(ambient=373.0, conductivity=46.0, share=0.5)
    """

    ambient: Array | float
    conductivity: Array | float
    share: Array | float = 1.0
    shift: Any = None
    diffusivity: Array | float | None = None

    def check(self) -> Verdict:
        """Return whether the values are in range; raises ValueError for values that are not traced and are out of range."""
        valid = checks.positive("Thermal ambient [K]", self.ambient)
        valid = valid & checks.positive("Thermal conductivity [W/(m K)]", self.conductivity)
        valid = valid & checks.between("Thermal share", self.share, -1e-12, 1.0)
        if self.diffusivity is not None:
            valid = valid & checks.positive("Thermal diffusivity [m2/s]", self.diffusivity)
        if self.shift is None:
            return valid
        valid = valid & check_shift(self.shift)
        name = "ln a_T of Thermal shift at ambient, inf where the body has infinite times"
        return valid & checks.finite(name, self.shift.log_factor(self.ambient))


def check_thermal(thermal: Any, grid: Grid, verb: str) -> Verdict:
    """Check None, or a ``Thermal`` on a grid that is not periodic."""
    if thermal is None:
        return True
    checks.require(
        isinstance(thermal, Thermal), f"thermal: expected Thermal or None, got {type(thermal).__name__}"
    )
    check_not_periodic(grid, f"{verb} with thermal")
    return thermal.check()
