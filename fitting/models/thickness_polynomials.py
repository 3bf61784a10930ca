"""Approximations in common use for the indentation of a thin incompressible sample bonded to its base, for comparison.

The factor on the force of a half-space is a polynomial in chi (``thin_layer.py``):

    ball   E. K. Dimitriadis et al., Biophys. J. 82 (2002) 2798
           P. D. Garcia, R. Garcia, Biophys. J. 114 (2018) 2923
           R. S. Chadwick, SIAM J. Appl. Math. 62 (2002) 1520 (the limit of a very thin sample)
    cone, punch   Garcia and Garcia
"""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jax import Array

from fitting.models.thin_layer import ThinLayer, kind_of

GARCIA = "Garcia and Garcia 2018"
FACTORS: dict[str, dict[str, tuple[float, ...]]] = {
    "ball": {
        "Dimitriadis 2002": (1.0, 1.133, 1.283, 0.769, 0.0975),
        GARCIA: (1.0, 1.133, 1.497, 1.469, 0.755),
        "Chadwick 2002": (0.0, 0.0, 0.0, 1.1781),
    },
    "cone": {GARCIA: (1.0, 0.721, 0.650, 0.491, 0.225)},
    "punch": {GARCIA: (1.0, 1.133, 1.283, 0.598, -0.291)},
}


class PolynomialLayer(NamedTuple):
    """A factor that is a polynomial in chi = scale depth^power; series (m,): coefficients from the constant on."""

    series: Array
    scale: Array | float
    power: Array | float

    def factor(self, depth: Array) -> Array:
        """Return the factor at depths > 0 of any shape."""
        return jnp.polyval(jnp.flip(jnp.asarray(self.series)), self.scale * depth**self.power)


def approximations(indenter: Any, thickness: float | None, nu: float) -> dict[str, PolynomialLayer]:
    """Return {name: factor} of the approximations for an indenter; none on a half-space or for nu other than 0.5."""
    if thickness is None or nu != 0.5:
        return {}
    exact = ThinLayer.of(indenter, thickness, nu)
    return {
        name: PolynomialLayer(jnp.asarray(coefficients), exact.scale, exact.power)
        for name, coefficients in FACTORS[kind_of(indenter)].items()
    }
