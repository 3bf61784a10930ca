"""The normal displacement under the tractions of sliding friction, which come with the pressure.

Where all of a contact slides along the unit vector e, the traction on the body is q = mu p e (C. A. Coulomb), and sinks the
surface by K_zx * mu p e_x + K_zy * mu p e_y, kernels that are odd in the offset along the traction. They vanish for two
similar solids, and are then no concern of the pressure.
"""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace
from jaxcontact._support.scale import Scale
from jaxcontact.bodies.body import LayeredHalfSpace
from jaxcontact.bodies.grid import Grid
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.operators.coupled import spectrum
from jaxcontact.operators.kernels import scaled_coefficients
from jaxcontact.operators.operator import Operator
from jaxcontact.response.tangential import TangentialExpansion, tangential_expansion


@pytree
class Rubbing:
    """The kernels of friction, and its coefficient.

    coefficient: mu, () or (nx, ny); along: K_zx and K_zy of C_0 and of the S_m at offsets (i, j) >= 0, (M + 1, 2, nx, ny);
    rates lambda_k [1/s], (K,), mix (M, K), as in ``TractionKernels``; expansion: the tangential response
    that they come from.
    """

    coefficient: Array
    along: Array
    rates: Array
    mix: Array
    expansion: TangentialExpansion

    @property
    def scale(self) -> Array:
        """The factor of the kernels, (): mu where it is one number, and the kernels then act on the pressure itself."""
        return self.coefficient if self.coefficient.ndim == 0 else jnp.ones(())

    @property
    def weights(self) -> Array | None:
        """The factor of the pressure before the kernels act on it, (nx, ny): mu where it varies, otherwise None."""
        return self.coefficient if self.coefficient.ndim else None

    def sheared(self, pressure: Array) -> Array:
        """Return the field on which the kernels act, (nx, ny)."""
        return pressure if self.weights is None else self.weights * pressure

    def coulomb_force(self, pressure: Array) -> Array:
        """Return the sum of mu p, ()."""
        return jnp.sum(self.coefficient * pressure)

    def added_to(self, operator: Operator, kernel: Array) -> Operator:
        """Return the operator of pressure and traction, from that of the pressure and the spectrum of the kernel.

        kernel: (my/2 + 1, mx), along the direction of sliding. The preconditioner stays that of the pressure.
        """
        if self.weights is None:
            return replace(operator, spectra=operator.spectra + kernel)
        spectra = jnp.concatenate([operator.spectra, kernel[None]])
        return replace(operator, spectra=spectra, weights=self.weights[None], entries=((0, 0, 0), (0, 1, 1)))

    def spectra(self, shape: tuple[int, int]) -> Array:
        """Return the spectra of ``scale`` K on the first cells, (M + 1, 2, my/2 + 1, mx)."""
        x, y = jnp.moveaxis(self.along[..., : shape[0], : shape[1]], 1, 0)
        return self.scale * jnp.stack([spectrum(x, -1, 1), spectrum(y, 1, -1)], 1)

    def lasting(self, spectra: Array) -> Array:
        """Return those of ``scale`` lambda_k C_k, (K, 2, my/2 + 1, mx)."""
        return jnp.tensordot(self.mix.T, spectra[1:], 1)

    def point_strength(self) -> Array:
        """Return ``scale`` lambda_k C_k a length of one ahead of a unit force, times 2 pi, (K,)."""
        return self.scale * (self.expansion.separable.terms[2, 1:, 0] @ self.mix)


def rub(body: LayeredHalfSpace, indenter: Indenter, grid: Grid, scale: Scale, coefficient: Array) -> Rubbing:
    """For use inside jit."""
    expansion = tangential_expansion(body)
    kernels = scaled_coefficients(expansion, indenter, grid, scale)
    along = -jnp.stack([kernels.x, kernels.y], 1)
    mix = expansion.separable.mix / scale.compliance
    return Rubbing(coefficient, along, expansion.separable.rates, mix, expansion)
