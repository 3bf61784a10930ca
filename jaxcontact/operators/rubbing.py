"""What friction adds to sliding: the normal displacement under the traction that comes with the pressure.

Where all of a contact slides along the unit vector e, the traction on the body is q = mu p e (C. A. Coulomb), and sinks the
surface by K_zx * mu p e_x + K_zy * mu p e_y, kernels that are odd in the offset along the traction. They vanish for two
similar solids, and are then no concern of the pressure.
"""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from jaxcontact._pytree import pytree
from jaxcontact._scale import Scale
from jaxcontact.grid import Grid
from jaxcontact.indenters import Indenter
from jaxcontact.layers import LayeredHalfSpace
from jaxcontact.operators.coupled import spectrum
from jaxcontact.operators.traction_kernels import scaled_coefficients


@pytree
class Rubbing:
    """coefficient mu; along: K_zx and K_zy of C_0 and of the S_m at offsets (i, j) >= 0, (M + 1, 2, nx, ny); rates
    lambda_k [1/s], (K,), mix (M, K), as in ``TractionKernels``; at_zero: the S_m at wavenumber zero, (M,)."""

    coefficient: Array
    along: Array
    rates: Array
    mix: Array
    at_zero: Array

    def spectra(self, shape: tuple[int, int]) -> Array:
        """Spectra of mu K on the first cells, (M + 1, 2, my/2 + 1, mx)."""
        x, y = jnp.moveaxis(self.along[..., : shape[0], : shape[1]], 1, 0)
        return self.coefficient * jnp.stack([spectrum(x, -1, 1), spectrum(y, 1, -1)], 1)

    def lasting(self, spectra: Array) -> Array:
        """Those of mu lambda_k C_k, (K, 2, my/2 + 1, mx)."""
        return jnp.tensordot(self.mix.T, spectra[1:], 1)

    def point_strength(self) -> Array:
        """mu lambda_k C_k a length of one ahead of a unit force, times 2 pi, (K,)."""
        return self.coefficient * (self.at_zero @ self.mix)


def rub(body: LayeredHalfSpace, indenter: Indenter, grid: Grid, scale: Scale, coefficient: Array) -> Rubbing:
    """For use inside jit."""
    kernels, separable = scaled_coefficients(body, indenter, grid, scale)
    along = -jnp.stack([kernels.x, kernels.y], 1)
    mix = separable.mix / scale.compliance
    return Rubbing(coefficient, along, separable.rates, mix, separable.terms[2, 1:, 0])
