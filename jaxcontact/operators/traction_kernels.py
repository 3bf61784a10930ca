"""Kernels of traction: the response of body and indenter in three directions on a grid, ready for the march."""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact._support.scale import Scale
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.operators.coupled import CoupledFamily, Tangential
from jaxcontact.operators.kernels import Kernels, build
from jaxcontact.response.influence.tangential_coefficients import (
    SurfaceKernels,
    TangentialImages,
    tangential_coefficients,
)
from jaxcontact.response.influence.tangential_images import fit_images
from jaxcontact.response.influence.tangential_lines import tangential_lines
from jaxcontact.response.time.tangential_time import (
    TangentialSeparable,
    half_space_shares,
    separate_tangential,
)


@pytree
class TractionKernels:
    """normal: as in ``indent``; family: the tangential operators C_0 and S_m; rates [1/s], (K,); mix (M, K).

    The tangential rates are their own; what a pressure draws along, too, is remembered at them.
    """

    normal: Kernels
    family: CoupledFamily
    rates: Array
    mix: Array


def build_traction(
    body: LayeredHalfSpace, indenter: Indenter, grid: Grid, *, coupled: bool
) -> TractionKernels:
    """The kernels of a body, an indenter and a grid, for use inside jit.

    Tangential compliances of the two solids add, while their couplings of normal and tangential subtract.
    """
    normal = build(body, indenter, grid)
    coefficients, separable = scaled_coefficients(body, indenter, grid, normal.scale)
    family = CoupledFamily(Tangential.of(coefficients, coupled=coupled, periodic=grid.periodic))
    return TractionKernels(normal, family, separable.rates, separable.mix / normal.scale.compliance)


def scaled_coefficients(
    body: LayeredHalfSpace, indenter: Indenter, grid: Grid, scale: Scale
) -> tuple[SurfaceKernels, TangentialSeparable]:
    """Of C_0, with the indenter's, and of the S_m, (M + 1, nx, ny) in cells, and what they come from."""
    separable = separate_tangential(body)
    images = fit_images(body, separable.terms)
    weights = images.weights.at[:, 0, 0].add(_of_indenter(indenter))
    coefficients_of = tangential_lines if grid.plane_strain else tangential_coefficients
    coefficients = coefficients_of(grid, TangentialImages(images.depths, weights))
    scaled = jax.tree.map(lambda a: a / scale.length, coefficients)
    return jax.tree.map(lambda a: a.at[0].divide(scale.compliance), scaled), separable


def _of_indenter(indenter: Indenter) -> Array:
    """What the indenter adds to alpha (L, T, K) [1/Pa], (3,)."""
    if indenter.material is None:
        return jnp.zeros(3)
    shares = half_space_shares(indenter.material) * jnp.array([1.0, 1.0, -1.0])
    return shares * indenter.material.spectrum().instantaneous
