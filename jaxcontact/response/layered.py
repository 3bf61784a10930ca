"""The response of any stack of layers on a half-space, computed by recursion.

For one layer on an elastic substrate it agrees with the closed form of ``response.one_layer`` to 1e-12, so that no other
module depends on which of them is used.
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.layers import Layer, LayeredHalfSpace
from jaxcontact.inputs.materials import Material
from jaxcontact.response.base import QUADRATURE_NODES, QUADRATURE_WEIGHTS, Response, Separable
from jaxcontact.response.influence.images import Images
from jaxcontact.response.stack import mean_step, scaled_response, solids
from jaxcontact.response.time import ladder
from jaxcontact.response.time.rational import separate

RATES_A_NODE, SHAPES_A_NODE = 12, 4  # ``response.time.rational`` gives the accuracy of 24 rates and 8 shapes


@pytree
class Stack(Response):
    """One or more layers on a substrate; layers: the top one first."""

    layers: tuple[Layer, ...]
    substrate: Material

    @property
    def body(self) -> LayeredHalfSpace:
        return LayeredHalfSpace(self.layers, self.substrate)

    def step(self, wavenumber: Array, start: Array, end: Array) -> Array:
        return mean_step(self.body, wavenumber, start, end)

    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return the mean over an interval by five-point Gauss quadrature."""
        wavenumber, start, end = (jnp.asarray(a, float)[..., None] for a in (wavenumber, start, end))
        t = (start + end) / 2.0 + (end - start) / 2.0 * QUADRATURE_NODES
        compliances = jnp.stack([solid.creep(t) for solid in solids(self.body)])
        return jnp.sum(scaled_response(self.body, wavenumber, compliances) * QUADRATURE_WEIGHTS, -1) / 2.0

    def wavenumbers(self) -> Array:
        return ladder.wavenumbers(self.body)

    def separate(self, nodes: int) -> Separable:
        """Return a sum of products with fixed rates, about four per decade."""
        rates, shapes = RATES_A_NODE * nodes, SHAPES_A_NODE * nodes
        return separate(self.body, self.wavenumbers(), rates, shapes)

    def expand(self, values: Array) -> Images:
        return ladder.expand(self.body, values)

    def expand_shapes(self, shapes: Array) -> Images:
        return ladder.expand_shapes(self.body, shapes)
