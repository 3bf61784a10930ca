"""The shortening of a film at the deepest point of a contact, over its thickness there."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact._support.reductions import total


@pytree
class Film:
    """A film of one thickness on a rigid base.

    coefficients: displacement at offsets (i, j) >= 0 under a unit pressure on one cell, times the film's modulus, over its
    thickness, (nx, ny); weights [1/A] of the pressure and of the history fields, (1 + K,).
    """

    coefficients: Array
    weights: Array

    def strain(self, pressure: Array, history: Array) -> Array:
        """Return the strain at the deepest point, (), from the pressure (nx, ny) and the history fields (K, nx, ny)."""
        return deepest_strain(self.coefficients, _hereditary(self.weights, pressure, history))


@pytree
class VaryingFilm:
    """A film whose thickness varies in the plane.

    series: of the coefficients of ``Film`` in Chebyshev polynomials of the thickness, (n, nx, ny); shares: the
    polynomials of the thickness at each cell, (n, nx, ny); present: cells with a film, (nx, ny) bool; weights: as there.
    """

    series: Array
    shares: Array
    present: Array
    weights: Array

    def strain(self, pressure: Array, history: Array) -> Array:
        """Return the strain at the deepest point with a film, as if the film were as thick everywhere as it is there."""
        total = _hereditary(self.weights, pressure, history)
        i, j = _deepest(jnp.where(self.present, total, -jnp.inf))
        coefficients = jnp.tensordot(self.shares[:, i, j], self.series, 1)
        found = jnp.sum(_around(coefficients, i, j) * total)
        return jnp.where(jnp.any(self.present), found, 0.0)


def deepest_strain(coefficients: Array, strain: Array) -> Array:
    """Return the shortening of a film on a rigid base at the deepest point of the hereditary integral, both (nx, ny)."""
    return total(_around(coefficients, *_deepest(strain)) * strain)


def _hereditary(weights: Array, pressure: Array, history: Array) -> Array:
    """Return the hereditary integral of the pressure, (nx, ny)."""
    return weights[0] * pressure + jnp.tensordot(weights[1:], history, 1)


def _deepest(strain: Array) -> tuple[Array, Array]:
    """Return the indices of the first largest value: first its row, which takes a quarter of the time of both at once."""
    i = jnp.argmax(jnp.max(strain, axis=1))
    return i, jnp.argmax(strain[i])


def _around(coefficients: Array, i: Array, j: Array) -> Array:
    """Return the coefficients at the offsets of all cells from cell (i, j)."""
    nx, ny = coefficients.shape
    return coefficients[jnp.abs(jnp.arange(nx) - i)][:, jnp.abs(jnp.arange(ny) - j)]
