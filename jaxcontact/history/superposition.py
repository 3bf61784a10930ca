"""The direct superposition of all earlier steps: the oracle of the recursion, and the paper's method.

    u(t_n) = sum_{j <= n} Kbar(n, j) * (p_j - p_{j-1}),

with Kbar(n, j) the mean of the kernel K(t_n - s) over t_{j-1} <= s <= t_j: exact for a pressure linear
over each step. Time and memory grow with the square and the first power of the number of steps.
Each kernel is a weighted sum of the same images, so only their weights depend on (n, j).
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact import spectral
from jaxcontact._pytree import pytree
from jaxcontact.frf.normal import scaled_response
from jaxcontact.geometry import Indenter
from jaxcontact.history.recursive import Operator
from jaxcontact.kernels import Superposition, image_weights
from jaxcontact.layers import LayeredHalfSpace


@pytree
class Row:
    """One step n of the tables: its index, the image weights (n_steps, J) and the film's J (n_steps,)."""

    index: Array
    weights: Array
    film: Array


@pytree
class DirectMemory:
    """Keeps the pressure increments of all steps, (n_steps, nx, ny)."""

    images: Superposition
    n_steps: Array  # an array of that length, for its shape alone

    def start(self, shape: tuple[int, int]) -> Array:
        return jnp.zeros((self.n_steps.shape[0], *shape))

    def predict(self, increments: Array, pressure: Array, row: Row) -> tuple[Operator, Array]:
        """The kernel of the present step acts on the whole new pressure, so the old one is taken back.

        The present step's increment is zero so far, unless that step is taken again (``march.in_blocks``).
        """
        now = row.weights[row.index]
        past = jnp.where(jnp.arange(self.n_steps.shape[0])[:, None] <= row.index, row.weights, 0.0)
        fields = jnp.tensordot(past.T, increments, 1) - now[:, None, None] * pressure
        earlier = spectral.inverse(
            jnp.sum(self.images.spectra * spectral.transform(fields), 0), pressure.shape
        )
        spectrum = jnp.tensordot(now, self.images.spectra, 1)
        operator = Operator(spectrum, jnp.tensordot(now, self.images.circulants, 1), None, earlier)
        return operator, increments.at[row.index].add(-pressure)

    def update(self, increments: Array, pressure: Array, row: Row) -> Array:
        return increments.at[row.index].add(pressure)

    def film_shear_strain(self, increments: Array, pressure: Array, row: Row) -> Array:
        """The hereditary integral of the film's J over the pressure, without unit, (nx, ny)."""
        return jnp.tensordot(row.film, increments, 1) / self.images.units.compliance

    def observe(self, increments: Array, pressure: Array, row: Row) -> None:
        """Nothing beyond what every step reports."""

    def film_coefficients(self) -> Array | None:
        return self.images.film_coefficients


def rows(body: LayeredHalfSpace, indenter: Indenter, times: Array, *, quasi_elastic: bool) -> Row:
    """The tables for all steps, stacked: weights (n, n, J) and film (n, n); zero where j > n."""
    before = jnp.append(times[:1], times[:-1])
    lag_start = jnp.maximum(times[:, None] - times[None, :], 0.0)
    lag_end = jnp.maximum(times[:, None] - before[None, :], 0.0)
    weights = image_weights(body, indenter, lag_start, lag_end, quasi_elastic=quasi_elastic)
    n = times.shape[0]
    film = jnp.zeros((n, n))
    if body.layers:
        film_alone = LayeredHalfSpace((), body.layers[0].material)
        film = scaled_response(film_alone, jnp.ones(()), lag_start, lag_end) / (
            1.0 - body.layers[0].material.nu
        )
        film = jnp.tril(film)
    return Row(jnp.arange(n), weights, film)
