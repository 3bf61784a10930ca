"""Any stack of layers on a half-space, by the recursion: the same questions as one layer, by another formula.

For one layer on an elastic substrate it answers what ``response.one_layer`` answers in closed form, to 1e-12,
which shows that nothing else depends on the formula.
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.layers import Layer, LayeredHalfSpace
from jaxcontact.inputs.materials import Elastic, Material
from jaxcontact.inputs.spectrum import Spectrum
from jaxcontact.response.base import QUADRATURE_NODES, QUADRATURE_WEIGHTS, Response, Separable
from jaxcontact.response.half_space import HalfSpace, may_flow
from jaxcontact.response.influence.images import Images
from jaxcontact.response.stack import mean_step, scaled_response, solids
from jaxcontact.response.time import ladder
from jaxcontact.response.time.rational import separate
from jaxcontact.response.volume import bed_creep, film_creep, film_shape

RATES_A_NODE, SHAPES_A_NODE = (
    12,
    4,
)  # see ``response.time.rational`` for what 24 rates and 8 shapes are good to


@pytree
class Stack(Response):
    """One layer or more on a substrate; layers: the top one first."""

    layers: tuple[Layer, ...]
    substrate: Material

    @property
    def body(self) -> LayeredHalfSpace:
        return LayeredHalfSpace(self.layers, self.substrate)

    def step(self, wavenumber: Array, start: Array, end: Array) -> Array:
        return mean_step(self.body, wavenumber, start, end)

    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """The mean over an interval by five Gauss points."""
        wavenumber, start, end = (jnp.asarray(a, float)[..., None] for a in (wavenumber, start, end))
        t = (start + end) / 2.0 + (end - start) / 2.0 * QUADRATURE_NODES
        compliances = jnp.stack([solid.creep(t) for solid in solids(self.body)])
        return jnp.sum(scaled_response(self.body, wavenumber, compliances) * QUADRATURE_WEIGHTS, -1) / 2.0

    def wavenumbers(self) -> Array:
        return ladder.wavenumbers(self.body)

    def separate(self, nodes: int) -> Separable:
        """Fixed rates, four a decade or so."""
        rates, shapes = RATES_A_NODE * nodes, SHAPES_A_NODE * nodes
        return separate(self.body, self.wavenumbers(), rates, shapes)

    def expand(self, values: Array) -> Images:
        return ladder.expand(self.body, values)

    def expand_shapes(self, shapes: Array) -> Images:
        return ladder.expand_shapes(self.body, shapes)

    def wide(self, t: Array | float) -> Array:
        return HalfSpace(self.substrate).wide(t)

    def narrow(self, t: Array | float) -> Array:
        return HalfSpace(self.layers[0].material).wide(t)

    def springs(self, t: Array | float) -> Array:
        """Of all layers, one under the other."""
        each = [bed_creep(layer.material).creep(t) * layer.thickness for layer in self.layers]
        return jnp.sum(jnp.stack(each), 0)

    def long_term(self) -> Array:
        return HalfSpace(self.substrate).long_term()

    def flows(self) -> Array:
        return jnp.any(jnp.stack([may_flow(solid) for solid in solids(self.body)]))

    def rigid_at_first(self) -> Array | bool:
        return jnp.any(jnp.stack([jnp.asarray(HalfSpace(s).rigid_at_first()) for s in solids(self.body)]))

    def stiffness_ratio(self) -> Array:
        return ladder.stiffness_contrast(self.body)

    def surface(self) -> Material:
        return self.layers[0].material

    def film(self) -> Layer:
        """The top layer."""
        return self.layers[0]

    def film_creep(self) -> Spectrum:
        return film_creep(self.layers[0].material)

    def on_rigid_base(self) -> Array:
        top = self.layers[0]
        return film_shape(top.material, self.wavenumbers() * top.thickness)

    def creeps_far(self) -> bool:
        return not isinstance(self.substrate, Elastic)
