"""Kernels of traction: the response of body and indenter in three directions on a grid, ready for the march."""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._compile.kept_traces import Program
from jaxcontact._support.pytree import pytree
from jaxcontact._support.scale import Scale
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.operators.coupled import CoupledFamily, Tangential
from jaxcontact.operators.kernels import Errors, Kernels, compiled_build, largest_until
from jaxcontact.response.influence.tangential_coefficients import (
    SurfaceKernels,
    TangentialImages,
    tangential_coefficients,
)
from jaxcontact.response.influence.tangential_lines import tangential_lines
from jaxcontact.response.time.tangential_time import (
    TangentialExpansion,
    half_space_shares,
    tangential_expansion,
)


@pytree
class TractionKernels:
    """normal: as in ``indent``; family: the tangential operators C_0 and S_m; rates [1/s], (K,); mix (M, K); expansion: the
    tangential response that they come from.

    The tangential rates are their own; what a pressure draws along, too, is remembered at them.
    """

    normal: Kernels
    family: CoupledFamily
    rates: Array
    mix: Array
    expansion: TangentialExpansion

    def errors(self, duration: Array | float = jnp.inf) -> Errors:
        """Return the errors of a run of a duration [s], the larger ones of the normal and the tangential response."""
        return joint_errors(self.normal, self.expansion, duration)


def joint_errors(
    normal: Kernels, expansion: TangentialExpansion, duration: Array | float = jnp.inf
) -> Errors:
    """Return the larger errors of a normal and a tangential response in a run of a duration [s]."""
    errors = normal.errors(duration)
    images = largest_until(expansion.image_errors, jnp.minimum(duration, errors.horizon))
    separation = jnp.maximum(errors.separation, expansion.separation_error)
    return Errors(separation, jnp.maximum(errors.images, images), errors.horizon)


def assembled_traction(
    normal: Kernels, expansion: TangentialExpansion, indenter: Indenter, grid: Grid, *, coupled: bool
) -> TractionKernels:
    """Return the kernels of an expansion on a grid; ``normal``: those of the same body, indenter and grid.

    Tangential compliances of the two solids add, while their couplings of normal and tangential subtract.
    """
    coefficients = scaled_coefficients(expansion, indenter, grid, normal.scale)
    family = CoupledFamily(Tangential.of(coefficients, coupled=coupled, periodic=grid.periodic))
    mix = expansion.separable.mix / normal.scale.compliance
    return TractionKernels(normal, family, expansion.separable.rates, mix, expansion)


def compiled_traction(
    body: LayeredHalfSpace, indenter: Indenter, grid: Grid, *, coupled: bool
) -> TractionKernels:
    """Return the kernels of a body, an indenter and a grid; the programs of the expansions hold for all grids."""
    normal = compiled_build(body, indenter, grid)
    return _assembled(normal, _expansion(body), indenter, grid, coupled=coupled)


_expansion = Program(tangential_expansion)
_assembled = Program(assembled_traction, ("coupled",))


def scaled_coefficients(
    expansion: TangentialExpansion, indenter: Indenter, grid: Grid, scale: Scale
) -> SurfaceKernels:
    """The coefficients of C_0, with the indenter's, and of the S_m, (M + 1, nx, ny) in cells."""
    images = expansion.images
    weights = images.weights.at[:, 0, 0].add(_of_indenter(indenter))
    coefficients_of = tangential_lines if grid.plane_strain else tangential_coefficients
    coefficients = coefficients_of(grid, TangentialImages(images.depths, weights))
    scaled = jax.tree.map(lambda a: a / scale.length, coefficients)
    return jax.tree.map(lambda a: a.at[0].divide(scale.compliance), scaled)


def _of_indenter(indenter: Indenter) -> Array:
    """Return the contribution of the indenter to alpha (L, T, K) [1/Pa], (3,)."""
    if indenter.material is None:
        return jnp.zeros(3)
    shares = half_space_shares(indenter.material) * jnp.array([1.0, 1.0, -1.0])
    return shares * indenter.material.spectrum().instantaneous
