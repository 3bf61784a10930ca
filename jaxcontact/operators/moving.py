"""Operators of a kernel that is not even: those of an indenter that moves over a body with a memory."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._pytree import pytree
from jaxcontact.operators import spectral
from jaxcontact.operators.base import Linear, Operator
from jaxcontact.operators.free_space import FLOOR, FreeSpace


@pytree
class Moving(Operator):
    """A kernel that is not even: spectrum and circulant as in ``FreeSpace``, but complex."""

    spectrum: Array
    circulant: Array

    symmetric = False

    def __call__(self, pressure: Array) -> Array:
        return spectral.convolve(self.spectrum, pressure)

    def transpose(self) -> Moving:
        """The same with the motion reversed."""
        return Moving(self.spectrum.conj(), self.circulant.conj())

    def preconditioner(self) -> Linear:
        """The inverse of the circulant, its real part raised to a floor above zero."""
        floor = FLOOR * jnp.mean(jnp.abs(self.circulant))
        inverse = 1.0 / jax.lax.complex(jnp.maximum(self.circulant.real, floor), self.circulant.imag)
        return lambda r: spectral.apply_circulant(inverse, r)

    def window_shape(self, shape: tuple[int, ...]) -> None:
        """None: the search runs on the whole grid."""
        return None

    def restricted(self) -> Moving:
        """The whole: there is no window."""
        return self

    def even(self) -> FreeSpace:
        return FreeSpace(self.spectrum.real, self.circulant.real, None)

    def plus_even(self, share: Array | float) -> Moving:
        return jax.tree.map(lambda a: a + share * a.real, self)
