"""Operators of a kernel that is not even: those of an indenter that moves over a body with a memory."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, static
from jaxcontact.operators import spectral
from jaxcontact.operators.base import Corner, Linear, SplitOperator
from jaxcontact.operators.convolution import FLOOR, Convolution, cell_ratio, confined_compliance


@pytree
class Moving(SplitOperator):
    """A kernel that is not even: all as in ``Convolution``, but complex and without a window."""

    spectrum: Array
    circulant: Array
    periodic: spectral.Periodic = static(default=spectral.FREE)

    symmetric = False

    def __call__(self, pressure: Array) -> Array:
        return spectral.convolve(self.spectrum, pressure, self.periodic)

    def transpose(self) -> Moving:
        """The same with the motion reversed."""
        return jax.tree.map(jnp.conj, self)

    def preconditioner(self) -> Linear:
        """The inverse of the circulant, its real part raised to a floor above zero."""
        floor = FLOOR * jnp.mean(jnp.abs(self.circulant))
        inverse = 1.0 / jax.lax.complex(jnp.maximum(self.circulant.real, floor), self.circulant.imag)
        return lambda r: spectral.apply_circulant(inverse, r)

    def confined_compliance(self, shape: tuple[int, ...]) -> Array:
        return confined_compliance(self.circulant.real, shape)

    def cell_ratio(self, shape: tuple[int, ...]) -> Array | float:
        return cell_ratio(self.circulant.real, shape)

    def window_shape(self, shape: tuple[int, ...]) -> None:
        """None: the search runs on the whole grid."""
        return None

    def restricted(self, corner: Corner) -> Moving:
        """The whole: there is no window."""
        return self

    def even(self) -> Convolution:
        return Convolution(self.spectrum.real, self.circulant.real, None, self.periodic)

    def odd(self) -> Moving:
        return jax.tree.map(lambda a: 1j * a.imag, self)

    def plus_even(self, share: Array | float) -> Moving:
        return jax.tree.map(lambda a: a + share * a.real, self)
